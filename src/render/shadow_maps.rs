//! The shadow maps of a scene: who has which, and what each sees.

use super::light_choice::{Estimate, FEW, LightOptions, LightShadowGpu, NO_END, choose};
use super::shadow_kept::Kept;
use super::shadow_sun::{self, Stage};
use super::shadow_view::ShadowViewGpu;
use super::view::View;
use super::{cull::Volume, shadow_local};
use crate::gpu_scene::SceneGpu;
use crate::lights::{LightGpu, fits_one_map};
use crate::scene::{Light, LightKind};
use glam::Vec3;

/// Suns that cast shadows.
pub const MAX_SUNS: u32 = 4;
/// Maps that point and spot lights share.
pub const MAX_LOCAL_LAYERS: u32 = 96;

/// Sizes of shadow maps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ShadowOptions {
    /// Side of a cascade's map for a single sun, texels; several suns get half. From 64 to 4096.
    pub sun_size: u32,
    /// Cascades a sun, 1 to 4.
    pub cascades: u32,
    /// Side of a local light's map, texels; many lights get half. From 64 to 2048.
    pub local_size: u32,
}

impl Default for ShadowOptions {
    fn default() -> Self {
        Self { sun_size: 2048, cascades: 4, local_size: 1024 }
    }
}

/// Spacing of the cameras in their uniform buffer: the largest alignment a device may ask for.
pub(super) const CAMERA_STRIDE: u64 = 256;

/// What of the shadow maps depends on the kinds of lights only.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Plan {
    /// Maps that each light needs.
    maps: Vec<u32>,
    is_sun: Vec<bool>,
    sun_size: u32,
    sun_layers: u32,
    local_size: u32,
    local_layers: u32,
}

impl Plan {
    fn new(lights: &[Light], options: &ShadowOptions) -> Self {
        let cascades = options.cascades.clamp(1, 4);
        let is_sun: Vec<bool> = lights.iter().map(|l| matches!(l.kind, LightKind::Directional { .. })).collect();
        let need = |l: &Light| match l.kind {
            LightKind::Directional { .. } => cascades,
            kind => {
                if fits_one_map(&kind) {
                    1
                } else {
                    6
                }
            }
        };
        let maps: Vec<u32> = lights.iter().map(need).collect();
        let suns = is_sun.iter().filter(|s| **s).count() as u32;
        let wanted: u32 = maps.iter().zip(&is_sun).filter(|(_, sun)| !**sun).map(|(m, _)| m).sum();
        let local_layers = wanted.min(MAX_LOCAL_LAYERS);
        let sun_size = options.sun_size.clamp(64, 4096) >> u32::from(suns > 1);
        let local_size = options.local_size.clamp(64, 2048) >> u32::from(local_layers > 24);
        Self { maps, is_sun, sun_size, sun_layers: suns.min(MAX_SUNS) * cascades, local_size, local_layers }
    }
}

/// A map that a light has.
pub(super) struct Map {
    pub view: ShadowViewGpu,
    /// What it sees.
    pub volume: Volume,
    /// Its layer among all: the suns' come first.
    pub layer: usize,
}

/// The maps of one scene, with what the direct pass binds.
pub struct ShadowMaps {
    plan: Plan,
    pub(super) sun: wgpu::Texture,
    pub(super) local: wgpu::Texture,
    /// All layers, the suns' first, and what each was drawn of.
    pub(super) layers: Vec<wgpu::TextureView>,
    pub(super) kept: Vec<Option<Kept>>,
    /// Layers that each light has.
    held: Vec<Vec<usize>>,
    /// Maps of all lights that have some, in the order of `view_buffer`.
    pub(super) maps: Vec<Map>,
    pub(super) cameras: wgpu::Buffer,
    pub(super) group: wgpu::BindGroup,
    pub(super) camera_bytes: Vec<u8>,
    of_light: Vec<LightShadowGpu>,
    warned: bool,
    /// All cascades.
    pub sun_view: wgpu::TextureView,
    /// All local maps.
    pub local_view: wgpu::TextureView,
    /// [`ShadowViewGpu`] of each map.
    pub view_buffer: wgpu::Buffer,
    /// [`LightShadowGpu`] of each light.
    pub light_buffer: wgpu::Buffer,
}

/// Whom [`ShadowMaps::allot`] serves.
pub(super) struct Audience<'a> {
    pub scene: &'a SceneGpu,
    pub view: &'a View,
    pub options: &'a LightOptions,
    /// Lights that stand in for glowing surfaces are drawn.
    pub stand_ins: bool,
}

impl ShadowMaps {
    /// Maps for the lights of `scene`; `bind` makes the group of the cameras' buffer.
    pub(super) fn new(
        device: &wgpu::Device,
        scene: &SceneGpu,
        options: &ShadowOptions,
        bind: impl FnOnce(&wgpu::Buffer) -> wgpu::BindGroup,
    ) -> Self {
        let plan = Plan::new(&scene.lights, options);
        let array = |label, size: u32, layers: u32| {
            let size = if layers == 0 { 1 } else { size };
            device.create_texture(&wgpu::TextureDescriptor {
                label: Some(label),
                size: wgpu::Extent3d { width: size, height: size, depth_or_array_layers: array_layers(layers) },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Depth32Float,
                usage: wgpu::TextureUsages::RENDER_ATTACHMENT | wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            })
        };
        let sun = array("shadow_sun", plan.sun_size, plan.sun_layers);
        let local = array("shadow_local", plan.local_size, plan.local_layers);
        let whole = |texture: &wgpu::Texture| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2Array),
                ..Default::default()
            })
        };
        let layer = |texture: &wgpu::Texture, i: u32| {
            texture.create_view(&wgpu::TextureViewDescriptor {
                dimension: Some(wgpu::TextureViewDimension::D2),
                base_array_layer: i,
                array_layer_count: Some(1),
                ..Default::default()
            })
        };
        let suns = (0..plan.sun_layers).map(|i| layer(&sun, i));
        let layers: Vec<_> = suns.chain((0..plan.local_layers).map(|i| layer(&local, i))).collect();
        let buffer = |label, size: u64, usage: wgpu::BufferUsages| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: usage | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let (views, lights) = (layers.len().max(1) as u64, scene.lights.len());
        let storage = wgpu::BufferUsages::STORAGE;
        let cameras = buffer("shadow.cameras", views * CAMERA_STRIDE, wgpu::BufferUsages::UNIFORM);
        let group = bind(&cameras);
        Self {
            sun_view: whole(&sun),
            local_view: whole(&local),
            view_buffer: buffer("shadow.views", views * size_of::<ShadowViewGpu>() as u64, storage),
            light_buffer: buffer("shadow.lights", (size_of::<LightShadowGpu>() * lights.max(1)) as u64, storage),
            maps: Vec::with_capacity(layers.len()),
            kept: vec![None; layers.len()],
            held: vec![Vec::new(); lights],
            camera_bytes: vec![0; layers.len() * CAMERA_STRIDE as usize],
            of_light: Vec::with_capacity(lights),
            warned: false,
            plan,
            sun,
            local,
            layers,
            cameras,
            group,
        }
    }

    /// Bytes of the depth maps.
    pub fn bytes(&self) -> Vec<(&'static str, u64)> {
        let bytes = |t: &wgpu::Texture| 4 * u64::from(t.width()).pow(2) * u64::from(t.depth_or_array_layers());
        vec![("shadow_sun", bytes(&self.sun)), ("shadow_local", bytes(&self.local))]
    }

    /// Gives maps to the lights that matter, fits them to what is seen, and writes what shaders
    /// know of it.
    pub(super) fn allot(&mut self, queue: &wgpu::Queue, audience: &Audience<'_>) {
        let Audience { scene, view, options, stand_ins } = *audience;
        let lights: Vec<LightGpu> = scene.lights.iter().map(LightGpu::new).collect();
        let counts: Vec<bool> = scene.lights.iter().map(|l| stand_ins || !l.is_emissive_proxy).collect();
        let (plan, lamps) = (&self.plan, self.plan.is_sun.iter().filter(|s| !**s).count());
        let wanted = |sun: bool| {
            let of = plan.maps.iter().zip(&plan.is_sun).zip(&counts);
            of.filter(|((_, is_sun), counts)| **is_sun == sun && **counts).map(|((m, _), _)| m).sum::<u32>()
        };
        let scarce = wanted(true) > plan.sun_layers || wanted(false) > plan.local_layers;
        let cuts = lights.len() > FEW && options.cut > 0.0;
        let estimate = (scarce || cuts).then(|| Estimate::new(view, scene.bounds, &lights, &counts));

        let given = estimate.as_ref().map_or_else(|| vec![0.0; lights.len()], |e| e.given.clone());
        let held: Vec<bool> = self.held.iter().map(|h| !h.is_empty()).collect();
        let group = |sun: bool, room: u32| {
            let maps: Vec<u32> =
                (0..lights.len()).map(|i| if plan.is_sun[i] == sun && counts[i] { plan.maps[i] } else { 0 }).collect();
            choose(&given, &maps, &held, room)
        };
        let (suns, locals) = (group(true, plan.sun_layers), group(false, plan.local_layers));
        let chosen: Vec<bool> = suns.iter().zip(&locals).map(|(a, b)| *a || *b).collect();
        self.hold(&chosen);
        if scarce && !std::mem::replace(&mut self.warned, true) {
            self.tell(scene, &counts);
        }
        self.fit(scene, view);
        for (light, shadow) in lights.iter().zip(&mut self.of_light) {
            let reach = estimate.as_ref().filter(|_| cuts && light.kind != 0);
            shadow.reach = reach.map_or(NO_END, |e| e.reach(light, lamps, options.cut));
        }
        for (map, bytes) in self.maps.iter().zip(self.camera_bytes.chunks_exact_mut(CAMERA_STRIDE as usize)) {
            bytes[..64].copy_from_slice(bytemuck::bytes_of(&map.view.clip_from_world));
            bytes[64..68].copy_from_slice(&view.seed.to_ne_bytes());
        }
        if !self.of_light.is_empty() {
            queue.write_buffer(&self.light_buffer, 0, bytemuck::cast_slice(&self.of_light));
        }
        if !self.maps.is_empty() {
            let views: Vec<ShadowViewGpu> = self.maps.iter().map(|m| m.view).collect();
            queue.write_buffer(&self.cameras, 0, &self.camera_bytes);
            queue.write_buffer(&self.view_buffer, 0, bytemuck::cast_slice(&views));
        }
    }

    /// Who is not chosen gives layers back, and who is new takes some.
    fn hold(&mut self, chosen: &[bool]) {
        let mut free = vec![true; self.layers.len()];
        for (held, chosen) in self.held.iter_mut().zip(chosen) {
            if !chosen {
                held.clear();
            }
            held.iter().for_each(|&layer| free[layer] = false);
        }
        let suns = self.plan.sun_layers as usize;
        for (i, held) in self.held.iter_mut().enumerate().filter(|(i, held)| chosen[*i] && held.is_empty()) {
            let range = if self.plan.is_sun[i] { 0..suns } else { suns..free.len() };
            held.extend(range.filter(|&layer| free[layer]).take(self.plan.maps[i] as usize));
            held.iter().for_each(|&layer| free[layer] = false);
        }
    }

    /// Says who goes without, and why.
    fn tell(&self, scene: &SceneGpu, counts: &[bool]) {
        for (sun, what) in [(true, "suns"), (false, "lamps")] {
            let without: Vec<&str> = (0..self.held.len())
                .filter(|&i| self.plan.is_sun[i] == sun && counts[i] && self.held[i].is_empty())
                .map(|i| scene.lights[i].name.as_str())
                .collect();
            if without.is_empty() {
                continue;
            }
            let names = without.iter().take(8).map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ");
            let more = if without.len() > 8 { format!(" and {} more", without.len() - 8) } else { String::new() };
            let room = if sun {
                format!("{MAX_SUNS} suns, the strongest, have shadows")
            } else {
                format!(
                    "there are {} shadow maps (six for a lamp that shines all around, one for a narrow cone), and those \
                    that give this view most have them",
                    self.plan.local_layers
                )
            };
            let count = without.len();
            tracing::warn!("{count} {what} shine through walls, without shadow: {room}; not {names}{more}");
        }
    }

    /// Fills `maps` for what `view` sees, and which of them are whose.
    fn fit(&mut self, scene: &SceneGpu, view: &View) {
        let extent = scene.bounds.map_or(0.0, |(low, high)| Vec3::from(low).distance(high.into()));
        let shines = self.plan.is_sun.iter().zip(&self.held).any(|(sun, held)| *sun && !held.is_empty());
        let stage = Stage::new(view, scene.bounds, if shines { nearest(scene, view) } else { None });
        let suns = self.plan.sun_layers as usize;
        self.maps.clear();
        self.of_light.clear();
        for (light, held) in scene.lights.iter().zip(&self.held) {
            let (first, count) = (self.maps.len() as u32, held.len() as u32);
            self.of_light.push(LightShadowGpu { first, count, reach: NO_END, pad: 0 });
            if count == 0 {
                continue;
            }
            let (views, reach) = match light.kind {
                LightKind::Directional { direction, .. } => {
                    (shadow_sun::cascades(view, direction.into(), &stage, count, self.plan.sun_size), None)
                }
                LightKind::Spot { position, direction, radius, outer_angle, range, .. } if count == 1 => {
                    let (p, d) = (position.into(), direction.into());
                    let near = shadow_local::near(radius, extent);
                    let spot = shadow_local::spot(p, d, outer_angle, near, self.plan.local_size);
                    (vec![spot], range.map(|r| (p, r)))
                }
                LightKind::Point { position, radius, range, .. } | LightKind::Spot { position, radius, range, .. } => {
                    let (p, near) = (Vec3::from(position), shadow_local::near(radius, extent));
                    (shadow_local::cube(p, near, self.plan.local_size).to_vec(), range.map(|r| (p, r)))
                }
            };
            for (mut view, &layer) in views.into_iter().zip(held) {
                view.layer = if layer < suns { layer } else { layer - suns } as u32;
                let seen = Volume::new(&view.clip_from_world);
                let volume = reach.map_or(seen, |(p, r)| seen.within(p, r));
                self.maps.push(Map { view, volume, layer });
            }
        }
    }
}

/// Distance to the nearest box of an instance that is in view, except those that the eye is in.
fn nearest(scene: &SceneGpu, view: &View) -> Option<f32> {
    let (volume, eye) = (Volume::new(&view.clip_from_world_unjittered), Vec3::from(view.eye()));
    let draws = scene.draws.iter().filter(|d| volume.meets(&d.bounds));
    let slots = draws.flat_map(|d| &scene.slots[d.instances.start as usize..d.instances.end as usize]);
    let distances = slots.filter(|s| volume.meets(&s.bounds)).map(|s| {
        let (low, high) = (Vec3::from(s.bounds.0), Vec3::from(s.bounds.1));
        eye.distance(eye.clamp(low, high))
    });
    distances.filter(|&d| d > 0.0).reduce(f32::min)
}

/// Layers to allocate for `used` ones. wgpu's GL backend guesses what an array is from its shape:
/// one layer becomes a plain texture and a square multiple of six a cube map, neither of which
/// binds as the array that the shader reads.
fn array_layers(used: u32) -> u32 {
    let layers = used.max(2);
    if layers.is_multiple_of(6) { layers + 1 } else { layers }
}
