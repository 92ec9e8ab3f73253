//! Contact shadows: how much of the light from all around reaches a surface past what stands right beside it.
//! [`upsample`](super::upsample) multiplies a method's light with it.
//!
//! Two estimates, of which the lower counts. What the depth buffer shows, at half resolution (cheaper and nearer than
//! [`occlusion`](super::occlusion): no thickness and no sectors, one horizon a direction). And spheres that stand in for the
//! scene's small compact objects (`scene::upload`), seen or not, at every pixel; this pass finds which are near each tile of
//! the picture. What it cannot do: see what is neither in the picture nor like a ball.

use super::bitmask::{Kernel, Stage, bind, half_of, write_entry};
use super::exposure::storage_entry;
use super::inputs::{BoundInputs, InputGroup};
use super::rung::Cost;
use crate::gpu::timing::Recorder;
use crate::scene::upload::MOST_SPHERES;

/// Directions in the tangent plane. (6 instead of 4 would take 0.03 points of the light's error, of 4.4 %, and half as much
/// time again.)
const AZIMUTHS: u32 = 4;
/// Points on each of them.
const TAPS: u32 = 2;
/// How far an occluder may be, as part of the distance from the camera: about as wide as a texel of the cube around the
/// camera is there, beyond which surfels are blockers themselves. (Error of the light on training rooms 2 to 5 with points in
/// the tangent plane only: 0.06 4.70 %, 0.1 4.64 %, 0.16 4.57 %, 0.25 4.62 %; without the pass 4.87 %.)
pub const RADIUS: f32 = 0.16;
/// The nearest point, as part of the radius.
const NEAREST: f32 = 0.06;
/// Sine of the elevation that counts as the surface itself.
const BIAS: f32 = 0.03;

/// How far a sphere counts, in its radii. (Farther ones are in the light's dimming by small objects already: error on the same
/// rooms with 2, 3, 4 and 6 radii 4.36, 4.35, 4.38 and 4.45 %.)
const SPHERE_REACH: f32 = 2.0;
/// Pixels on a side of the squares that know which spheres are near them.
const TILE: u32 = 16;

/// The constants of `beside.wgsl`.
pub(super) fn sphere_prelude() -> String {
    format!(
        "const TILE = {TILE}u;\nconst MOST_SPHERES = {MOST_SPHERES}u;\nconst SPHERE_REACH = f32({SPHERE_REACH:?});\n"
    )
}

/// What [`ContactPass`] has found, for [`upsample`](super::upsample).
#[derive(Debug, Clone, Copy)]
pub struct Beside<'a> {
    /// Cosine-weighted visibility past what the picture shows, `R32Float`, 0 to 1, half the picture's size (rounded up).
    pub visibility: &'a wgpu::TextureView,
    /// [`World::spheres`](super::World::spheres).
    pub spheres: &'a wgpu::Buffer,
    /// For each tile of 16² pixels, row by row, a bit for each sphere, whole words a tile; set where it may be near.
    pub nearby: &'a wgpu::Buffer,
}

/// The constants as WGSL.
pub fn prelude() -> String {
    let mut text = format!("const CELL_SIDE = 8i;\nconst AZIMUTHS = {AZIMUTHS}i;\nconst TAPS = {TAPS}i;\n");
    for (name, value) in [("RADIUS", RADIUS), ("NEAREST", NEAREST), ("BIAS", BIAS)] {
        text.push_str(&format!("const {name} = f32({value:?});\n"));
    }
    text + &sphere_prelude()
}

/// How many spheres of a buffer are looked at, those of radius 0 included.
fn count(spheres: &wgpu::Buffer) -> u32 {
    (spheres.size() / 16).min(u64::from(MOST_SPHERES)) as u32
}

/// Bytes of [`Beside::nearby`] for pictures of `size` pixels; never 0, so that it can be bound.
fn nearby_bytes(size: [u32; 2], spheres: &wgpu::Buffer) -> u64 {
    let [w, h] = size.map(|n| u64::from(n.div_ceil(TILE)));
    (4 * w * h * u64::from(count(spheres).div_ceil(32))).max(4)
}

/// What is bound.
struct Bound {
    group: wgpu::BindGroup,
    spheres: wgpu::Buffer,
    nearby: wgpu::Buffer,
}

/// The pass.
pub struct ContactPass {
    device: wgpu::Device,
    kernel: Kernel,
    visibility: Stage,
    bound: Option<Bound>,
    made: u64,
}

impl ContactPass {
    /// Compiles the shader; `inputs` gives the layout of group 0.
    pub fn new(device: &wgpu::Device, inputs: &InputGroup) -> Self {
        let entries = [write_entry(0, wgpu::TextureFormat::R32Float), storage_entry(1, true), storage_entry(2, false)];
        Self {
            kernel: Kernel::new(device, inputs, "gi.contact", &prelude(), &entries),
            visibility: Stage::new("gi.contact", wgpu::TextureFormat::R32Float),
            device: device.clone(),
            bound: None,
            made: 0,
        }
    }

    /// Makes room for pictures of `size` pixels, and looks at `spheres` ([`World::spheres`](super::World::spheres)) from now on;
    /// true when something of [`found`](Self::found) is new and groups that bind it must be made anew.
    pub fn fit(&mut self, size: [u32; 2], spheres: &wgpu::Buffer) -> bool {
        let same = self.bound.as_ref().is_some_and(|b| b.spheres == *spheres);
        if !self.visibility.fit(&self.device, half_of(size)) && same {
            return false;
        }
        let nearby = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("gi.contact.nearby"),
            size: nearby_bytes(size, spheres),
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let resources = [bind(self.visibility.get()), spheres.as_entire_binding(), nearby.as_entire_binding()];
        let group = self.kernel.group(&self.device, &resources);
        self.bound = Some(Bound { group, spheres: spheres.clone(), nearby });
        self.made += 1;
        true
    }

    /// What [`record`](Self::record) finds.
    ///
    /// # Panics
    /// Before [`fit`](Self::fit).
    pub fn found(&self) -> Beside<'_> {
        let bound = self.bound.as_ref().expect("fitted before");
        Beside { visibility: self.visibility.get(), spheres: &bound.spheres, nearby: &bound.nearby }
    }

    /// Records `gi.contact`.
    ///
    /// # Panics
    /// Before [`fit`](Self::fit).
    pub fn record(&self, recorder: &mut Recorder<'_>, inputs: &BoundInputs) {
        let bound = self.bound.as_ref().expect("fitted before");
        self.kernel.record(recorder, inputs, &bound.group, half_of(inputs.size));
    }

    /// Lets go of the host's buffer.
    pub fn forget(&mut self) {
        self.bound = None;
    }

    /// GPU memory, bytes.
    pub fn bytes(&self) -> u64 {
        self.visibility.bytes() + self.bound.as_ref().map_or(0, |b| b.nearby.size())
    }

    /// Bind groups made so far.
    pub fn made(&self) -> u64 {
        self.made
    }

    /// How many spheres it looks at, those of radius 0 included.
    pub fn sphere_count(&self) -> u32 {
        self.bound.as_ref().map_or(0, |b| count(&b.spheres))
    }

    /// What the pass costs for a picture of `size` pixels: 70 operations a texel, 20 a direction, 50 a point, 5 for each of the
    /// distances of points, of which there are two sets; 30 for the tile's corners and range, and each texel of a tile's 64
    /// asks a part of the `spheres` with 42 each.
    pub fn cost(size: [u32; 2], spheres: u32) -> Cost {
        let [w, h] = half_of(size);
        let texels = f64::from(w) * f64::from(h);
        let tiles = 30.0 + 42.0 * f64::from(spheres) / 64.0;
        let points = f64::from(TAPS);
        let flops = 70.0 + f64::from(AZIMUTHS) * (20.0 + points * 50.0) + 2.0 * points * 5.0 + tiles;
        Cost::new("gi.contact", texels * flops, texels * (4.0 * 4.0 + 4.0 + 4.0))
    }
}
