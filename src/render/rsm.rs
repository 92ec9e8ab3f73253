//! Reflective shadow maps (Dachsbacher and Stamminger 2005): what every light sees, as tiny G-buffers. Each lit texel
//! sends light on; `gi/emitters` turns texels into emitters.
//!
//! They are tiles of their own instead of colour attachments of the shadow maps: four cascades of 2048² with albedo and
//! normal (8 bytes a texel) would write 134 MB a frame and read most of it back, against 0.3 MB for one tile of 128².
//! The draws are the same ones, in the same step of the frame. A light always lights what its own map shows, so the
//! map's depth also is the shadow map for the points around the camera that the cascades do not cover.
//!
//! A sun's tile covers the scene's bounds, or [`REACH`] metres around the eye where the scene is larger; then it moves
//! with the eye in steps of whole blocks, so that emitters stay where they are. A spot has one tile, a point light (or a
//! spot wider than 60°) six. Texels and their grouping into emitters are fixed, so that nothing jumps when a light moves
//! slowly.

use super::atlas::{self, Atlas, AtlasPass, AtlasViewGpu, Tile};
use super::shadow::{MAX_LOCAL_LAYERS, MAX_SUNS, is_flat};
use crate::gpu::timing::Recorder;
use crate::scene::upload::SceneGpu;
use crate::scene::{Light, LightKind};
use glam::{Quat, Vec2, Vec3};

/// Texels on a side of the blocks that a tile is made of; `BLOCK` in `shaders/gi/emitters.wgsl`.
pub const BLOCK: u32 = 8;
/// How far a sun's tile reaches from the eye, metres.
pub const REACH: f32 = 96.0;
/// Angle between a sun's tile and the world's axes, radians: about one texel in eight.
const TILT: f32 = 0.13;
/// Columns of the atlas, texels.
const WIDTH: u32 = 512;

/// Where the tiles of a scene's lights lie.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Plan {
    tiles: Vec<Tile>,
    /// First tile and number of tiles of each light; none for lights beyond the budget.
    of_light: Vec<[u32; 2]>,
    height: u32,
    blocks: u32,
}

impl Plan {
    fn new(lights: &[Light]) -> Self {
        let is_sun = |l: &Light| matches!(l.kind, LightKind::Directional { .. });
        let suns = lights.iter().filter(|l| is_sun(l)).count();
        let sun_side = if suns > 1 { 64 } else { 128 };
        let local_side = if lights.len() - suns > 1 { 32 } else { 64 };
        let mut plan = Self { tiles: Vec::new(), of_light: vec![[0; 2]; lights.len()], height: 0, blocks: 0 };
        let (mut used_suns, mut used_local) = (0, 0);
        for sun in [true, false] {
            let side = if sun { sun_side } else { local_side };
            let (mut column, top) = (0, plan.height);
            for (i, light) in lights.iter().enumerate().filter(|(_, l)| is_sun(l) == sun) {
                let count = if sun || is_flat(&light.kind) { 1 } else { 6 };
                let (used, most) = if sun { (&mut used_suns, MAX_SUNS) } else { (&mut used_local, MAX_LOCAL_LAYERS) };
                if *used + count > most {
                    continue;
                }
                *used += count;
                plan.of_light[i] = [plan.tiles.len() as u32, count];
                for _ in 0..count {
                    let per_row = WIDTH / side;
                    let origin = [column % per_row * side, top + column / per_row * side];
                    plan.tiles.push(Tile { origin, side, light: i as u32, first_block: plan.blocks });
                    plan.height = origin[1] + side;
                    plan.blocks += (side / BLOCK).pow(2);
                    column += 1;
                }
            }
        }
        plan
    }
}

/// The maps of one scene's lights.
pub struct RsmMaps {
    plan: Plan,
    /// The textures.
    pub atlas: Atlas,
    views: Vec<AtlasViewGpu>,
    /// First view and number of views of each light, a storage buffer of `vec2u`.
    pub of_light: wgpu::Buffer,
}

impl RsmMaps {
    /// Makes the maps that the lights of `scene` need.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, pass: &AtlasPass, scene: &SceneGpu) -> Self {
        let plan = Plan::new(&scene.lights);
        let atlas = pass.atlas(device, "rsm", [WIDTH, plan.height.max(1)], plan.tiles.len());
        let of_light = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("rsm.lights"),
            size: 8 * plan.of_light.len().max(1) as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        if !plan.of_light.is_empty() {
            queue.write_buffer(&of_light, 0, bytemuck::cast_slice(&plan.of_light));
        }
        let views = Vec::with_capacity(plan.tiles.len());
        Self { plan, atlas, views, of_light }
    }

    /// Fits the maps around `eye` and draws them: pass `rsm`.
    pub fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        pass: &AtlasPass,
        scene: &SceneGpu,
        eye: Vec3,
    ) {
        self.views.clear();
        let bounds = scene.bounds.map_or((Vec3::ZERO, Vec3::ZERO), |(low, high)| (low.into(), high.into()));
        for (light, &[first, count]) in scene.lights.iter().zip(&self.plan.of_light) {
            let tiles = &self.plan.tiles[first as usize..(first + count) as usize];
            for (i, &tile) in tiles.iter().enumerate() {
                self.views.push(fit(light, i, tile, bounds, eye));
            }
        }
        // Lights were planned suns first; the views go where their tiles are.
        self.views.sort_by_key(|v| v.first_block);
        pass.record(recorder, queue, "rsm", scene, &mut self.atlas, &self.views);
    }

    /// Tiles in all.
    pub fn count(&self) -> u32 {
        self.plan.tiles.len() as u32
    }

    /// Blocks of [`BLOCK`]² texels in all.
    pub fn blocks(&self) -> u32 {
        self.plan.blocks
    }

    /// Blocks of the largest tile.
    pub fn most_blocks(&self) -> u32 {
        self.plan.tiles.iter().map(|t| (t.side / BLOCK).pow(2)).max().unwrap_or(0)
    }
}

/// View number `i` of `light`.
fn fit(light: &Light, i: usize, tile: Tile, bounds: (Vec3, Vec3), eye: Vec3) -> AtlasViewGpu {
    match light.kind {
        LightKind::Directional { direction, .. } => sun(direction.into(), tile, bounds, eye),
        LightKind::Spot { position, direction, radius, outer_angle, .. } if is_flat(&light.kind) => {
            let forward = Vec3::from(direction).normalize_or(Vec3::NEG_Y);
            atlas::perspective(position.into(), atlas::upright(forward), outer_angle.tan(), near(radius), tile)
        }
        LightKind::Point { position, radius, .. } | LightKind::Spot { position, radius, .. } => {
            atlas::perspective(position.into(), atlas::cube_axes(i), 1.0, near(radius), tile)
        }
    }
}

/// What is inside the lamp itself is not lit by it; as in the shadow maps.
fn near(radius: f32) -> f32 {
    (0.5 * radius).max(0.01)
}

fn sun(direction: Vec3, tile: Tile, bounds: (Vec3, Vec3), eye: Vec3) -> AtlasViewGpu {
    let to_light = -direction.normalize_or(Vec3::NEG_Y);
    // Axes that nearly follow the world's while the sun is above: a room then fills the tile. Nearly, so that an edge of
    // a wall or its shadow crosses the texels of a row one after the other and not all at once when the sun moves. The
    // only direction where they turn suddenly is straight up from below.
    let turn = Quat::from_rotation_arc(Vec3::Y, to_light) * Quat::from_rotation_y(TILT);
    let axes = [turn * Vec3::X, turn * Vec3::NEG_Z, to_light];
    let along = |p: Vec3| Vec3::new(p.dot(axes[0]), p.dot(axes[1]), p.dot(axes[2]));
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for i in 0..8 {
        let pick = |bit: usize, low, high| if i & bit == 0 { low } else { high };
        let p = Vec3::new(
            pick(1, bounds.0.x, bounds.1.x),
            pick(2, bounds.0.y, bounds.1.y),
            pick(4, bounds.0.z, bounds.1.z),
        );
        (low, high) = (low.min(along(p)), high.max(along(p)));
    }
    let pad = Vec3::splat(0.01) + 0.005 * (high - low);
    (low, high) = (low - pad, high + pad);
    let place = along(eye);
    let limit = |low: f32, high: f32, place: f32| {
        if high - low <= 2.0 * REACH {
            return (low, high);
        }
        let step = 2.0 * REACH * BLOCK as f32 / tile.side as f32;
        let middle = (place.clamp(low + REACH, high - REACH) / step).round() * step;
        (middle - REACH, middle + REACH)
    };
    let (x, y) = (limit(low.x, high.x, place.x), limit(low.y, high.y, place.y));
    let (least, most) = (Vec2::new(x.0, y.0), Vec2::new(x.1, y.1));
    atlas::parallel(axes, least.extend(low.z), most.extend(high.z), tile)
}
