//! Light kept on surfaces: a bake of who sees whom, relit every frame.
//!
//! Irradiance probes sit on the surfaces ("surfels"), where light is received, instead of in the air: a surfel has a
//! normal, so it needs no directional basis, and it cannot stand behind a wall. **This is a bake**: [`Bake::new`] takes
//! seconds and holds for static geometry and materials only; lights, sky and cameras may change freely.
//!
//! What is baked (all of it depends on geometry and materials, none of it on light):
//! - surfels: points about one spacing apart on all surfaces that light paths from the cameras reach, nearer to each
//!   other where other surfaces are near (Ward 1988), with normal, material and a few sample points around;
//! - links: for each surfel, which surfel (or which part of the sky) each of its rays over the hemisphere meets;
//! - the field: a hash grid that tells which surfels are near a point, and how far each of them sees along its own
//!   surface, so that light does not reach round a wall ([`field`]).
//!
//! What a frame does: shadow rays from the sample points to every light (`gi.probes.light`, through the reference's
//! acceleration structure, so that it needs no shadow map that happens to cover the place), three exchanges of light
//! along a part of the links (`gi.probes.bounce`), one gather along all of them (`gi.probes.gather`), and for each pixel
//! an average of the surfels around it (`gi.probes.apply`). The whole of it is linear in the light: a direct-to-indirect
//! transfer (Hašan, Pellacini and Bala 2006) in the form of a sparse matrix.
//!
//! What it cannot do: moving or changing objects; detail finer than its spacing (contact shadows); mirrors on the way
//! (of the specular lobe it knows what the lights' own light gives at roughness 0.4 and above, all else counts as diffuse); textures whose coverage is partial count as whole or as nothing, a triangle each.

pub mod field;
mod gpu;
mod random;
mod scatter;
mod spread;
mod surface;

pub use gpu::{ProbeParams, ProbesGi};
use spread::Spread;

use crate::accel::{Accel, AccelError};
use crate::scene::Scene;
use field::Field;
use glam::{Vec2, Vec3};
use thiserror::Error;

/// Parts of the sky: an octahedral map of 8×8.
pub const SKY_SIDE: u32 = 8;
/// Their number.
pub const SKY: u32 = SKY_SIDE * SKY_SIDE;
/// Surfels at most: links are 16 bits, and the sky and the black surfel need numbers, too.
pub const MOST: u32 = 65_536 - SKY - 1;
/// Sample points of a surfel's direct light.
pub const SAMPLES: u32 = 4;

/// What a bake is to be.
#[derive(Debug, Clone, PartialEq)]
pub struct BakeOptions {
    /// Surfels to spread, 1 to [`MOST`]; their spacing follows from it.
    pub records: u32,
    /// Links of each surfel, a multiple of 2.
    pub rays: u32,
    /// Points from which the scene is looked at: only what light paths from there reach gets surfels. Empty: everything.
    pub seen_from: Vec<[f32; 3]>,
    /// Spacing as a share of the harmonic mean distance to other surfaces.
    pub nearness: f32,
    /// Least spacing as a share of the largest.
    pub finest: f32,
    /// The same seed gives the same bake.
    pub seed: u32,
    /// Threads; 0 for as many as there are cores.
    pub threads: usize,
}

impl Default for BakeOptions {
    fn default() -> Self {
        Self { records: 8192, rays: 128, seen_from: Vec::new(), nearness: 0.8, finest: 0.2, seed: 0, threads: 0 }
    }
}

/// Why there is no bake.
#[derive(Debug, Error)]
pub enum BakeError {
    /// Options out of range.
    #[error(
        "a bake of {records} surfels with {rays} links each cannot be made: 1 to {MOST} surfels, 2 to 4096 links, an even number"
    )]
    Options {
        /// Surfels asked for.
        records: u32,
        /// Links asked for.
        rays: u32,
    },
    /// A mesh that disagrees with itself or is missing.
    #[error("instance `{instance}` cannot be baked: {reason}")]
    Mesh {
        /// The instance's name.
        instance: String,
        /// What is wrong.
        reason: String,
    },
    /// There is no acceleration structure.
    #[error(transparent)]
    Accel(#[from] AccelError),
    /// The caller's progress function said stop.
    #[error("the bake was stopped")]
    Stopped,
}

/// A surfel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surfel {
    /// World space, metres.
    pub position: [f32; 3],
    /// Unit normal.
    pub normal: [f32; 3],
    /// Distance to its neighbours, metres.
    pub spacing: f32,
    /// Diffuse reflectance.
    pub albedo: [f32; 3],
    /// Specular reflectance at normal incidence.
    pub f0: [f32; 3],
    /// Perceptual roughness.
    pub roughness: f32,
    /// Emitted radiance, W/(m²·sr).
    pub emission: [f32; 3],
}

/// A place and a unit normal.
pub type Sample = ([f32; 3], [f32; 3]);

/// The baked transfer. Belongs to the scene it was made of.
pub struct Bake {
    /// The surfels.
    pub surfels: Vec<Surfel>,
    /// Sample points, [`SAMPLES`] a surfel: lifted place and unit normal.
    pub samples: Vec<Sample>,
    /// Links, `rays` a surfel: a surfel, or `surfels.len()` + part of the sky, or that + [`SKY`] for what is black.
    pub links: Vec<u16>,
    /// Links of each surfel.
    pub rays: u32,
    /// Which surfels are near a point.
    pub field: Field,
    /// Radiance of each part of the sky as a multiple of the mean.
    pub sky: Vec<[f32; 3]>,
    /// Links that met a surface without surfels.
    pub lost: usize,
    /// Its seed.
    pub seed: u32,
    /// Seconds that the bake took.
    pub seconds: f64,
    pub(crate) accel: Accel,
}

impl Bake {
    /// Bakes `scene`. `progress` hears how much is done (0 to 1) and answers whether to go on.
    ///
    /// # Errors
    /// [`BakeError`]. A scene without surfaces is a bake without surfels.
    pub fn new(
        scene: &Scene,
        options: &BakeOptions,
        progress: &(dyn Fn(f32) -> bool + Sync),
    ) -> Result<Self, BakeError> {
        let start = std::time::Instant::now();
        let (records, rays) = (options.records, options.rays);
        if !(1..=MOST).contains(&records) || !(2..=4096).contains(&rays) || !rays.is_multiple_of(2) {
            return Err(BakeError::Options { records, rays });
        }
        let surfaces = surface::Surfaces::new(scene)?;
        let spread = Spread::new(options.threads, progress);
        let wanted = (records as usize * 24).max(4096);
        let candidates = scatter::paths(&surfaces, options, wanted, &spread.part(0.05, 0.25))?;
        let (low, high) = surfaces.bounds().unwrap_or_default();
        let extent = (high - low).length() * 0.5;
        let (chosen, spacings) = scatter::choose(&candidates, options, extent);

        let places = chosen.iter().zip(&spacings).map(|(&i, &s)| {
            let point = &candidates[i as usize].point;
            (point.position, point.normal, s)
        });
        let places: Vec<(Vec3, Vec3, f32)> = places.collect();
        let largest = spacings.iter().copied().fold(0.0f32, f32::max);
        // Numbers of cubes are 10 bits an axis.
        let side = (largest * 0.75).max(2.0 * extent / 1000.0).max(1e-6);
        let mut field = Field::new(places, side, (low + high) * 0.5);
        let walls = spread.part(0.25, 0.3).map(chosen.len() as u32, |i| {
            let point = &candidates[chosen[i as usize] as usize].point;
            walls(&surfaces, point, spacings[i as usize], extent)
        })?;
        field.walls = walls;
        let near = spread.part(0.3, 0.35).map(candidates.len() as u32, |i| {
            let point = &candidates[i as usize].point;
            field.nearest(point.position, point.normal)
        })?;
        let (surfels, samples) = gather(&candidates, &chosen, &spacings, &near, extent);
        let links = spread.part(0.35, 1.0).map(surfels.len() as u32, |i| {
            links(&surfaces, &field, &candidates[chosen[i as usize] as usize].point, i, options, extent)
        })?;
        let links = links.concat();
        let black = surfels.len() + SKY as usize;
        let lost = links.iter().filter(|&&l| l as usize == black).count();
        let sky = sky(scene);
        let seconds = start.elapsed().as_secs_f64();
        Ok(Self { surfels, samples, links, rays, field, sky, lost, seed: options.seed, seconds, accel: surfaces.accel })
    }

    /// What the bake took, in one line.
    pub fn sentence(&self) -> String {
        format!(
            "baked {} surfels with {} links each in {:.1} s, {:.1} MB; holds for this geometry and these materials only",
            self.surfels.len(),
            self.rays,
            self.seconds,
            self.bytes() as f64 / 1e6
        )
    }

    /// Bytes of what is baked, as it lies on the GPU.
    pub fn bytes(&self) -> u64 {
        let n = self.surfels.len() as u64;
        n * (48 + 16 + 16 + 16 * u64::from(SAMPLES))
            + 2 * self.links.len() as u64
            + self.field.bytes()
            + self.accel.bytes()
    }
}

impl std::fmt::Debug for Bake {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Bake").field("surfels", &self.surfels.len()).field("rays", &self.rays).finish_non_exhaustive()
    }
}

/// Averages over the candidates around each surfel, and sample points among them.
fn gather(
    candidates: &[scatter::Candidate],
    chosen: &[u32],
    spacings: &[f32],
    near: &[Option<u32>],
    extent: f32,
) -> (Vec<Surfel>, Vec<Sample>) {
    let mut points: Vec<Vec<u32>> = vec![Vec::new(); chosen.len()];
    for (i, owner) in (0u32..).zip(near) {
        if let Some(owner) = *owner {
            points[owner as usize].push(i);
        }
    }
    let mut samples = Vec::with_capacity(chosen.len() * SAMPLES as usize);
    let mut surfels = Vec::with_capacity(chosen.len());
    for (k, &i) in chosen.iter().enumerate() {
        let point = &candidates[i as usize].point;
        let own = if points[k].is_empty() { &chosen[k..=k] } else { &points[k][..] };
        let mean = |of: &dyn Fn(&surface::Point) -> Vec3| {
            let sum: Vec3 = own.iter().map(|&j| of(&candidates[j as usize].point)).sum();
            (sum / own.len() as f32).to_array()
        };
        surfels.push(Surfel {
            position: point.position.to_array(),
            normal: point.normal.to_array(),
            spacing: spacings[k],
            albedo: mean(&|p| p.albedo),
            f0: mean(&|p| p.f0),
            roughness: mean(&|p| Vec3::splat(p.roughness))[0],
            emission: mean(&|p| p.emission),
        });
        for s in 0..SAMPLES as usize {
            // In the order in which paths found them, which has no order in space.
            let j = own[s * own.len() / SAMPLES as usize];
            let p = &candidates[j as usize].point;
            samples.push((scatter::lifted(p, extent).to_array(), p.normal.to_array()));
        }
    }
    (surfels, samples)
}

/// How far a surfel sees along its surface in each of sixteen directions, see [`field::WALLS`].
fn walls(surfaces: &surface::Surfaces<'_>, point: &surface::Point, spacing: f32, extent: f32) -> [u32; 4] {
    let (x, y) = field::frame(point.normal);
    let origin = scatter::lifted(point, extent) + point.plane * (0.02 * spacing);
    let reach = field::REACH * spacing;
    let mut words = [0; 4];
    for sector in 0..field::SECTORS {
        let mut free = reach;
        for (turn, rise) in [(0.2, 0.03), (0.8, 0.03), (0.5, 0.2)] {
            let phi = (sector as f32 + turn) * (std::f32::consts::TAU / field::SECTORS as f32);
            let flat = x * phi.cos() + y * phi.sin();
            if let Some((_, t)) = surfaces.meet(origin, flat + point.normal * rise, free) {
                free = free.min(t);
            }
        }
        let steps = (free / reach * field::WALLS).ceil().clamp(0.0, field::WALLS) as u32;
        words[sector as usize / 4] |= steps << (8 * (sector % 4));
    }
    words
}

/// What the rays of a surfel meet.
fn links(
    surfaces: &surface::Surfaces<'_>,
    field: &Field,
    point: &surface::Point,
    index: u32,
    options: &BakeOptions,
    extent: f32,
) -> Vec<u16> {
    let mut random = random::Stream::new(options.seed ^ 0x5bd1_e995, index);
    let flips = random::flips(options.seed, index);
    let origin = scatter::lifted(point, extent);
    let surfels = field.len() as u32;
    let link = |k: u32| {
        let mut direction = random::cosine(point.normal, random::sobol(k, flips));
        // Below the horizon of a smoothly shaded triangle: mirrored up.
        let below = direction.dot(point.plane);
        if below < 0.0 {
            direction -= 2.0 * below * point.plane;
        }
        match surfaces.meet(origin, direction, f32::MAX) {
            None => surfels + sky_part(direction),
            Some((met, _)) => field.pick(met.position, met.normal, random.next()).unwrap_or(surfels + SKY),
        }
    };
    (0..options.rays).map(link).map(|l| l as u16).collect()
}

/// The part of the sky in a direction: a cell of the octahedral map.
fn sky_part(d: Vec3) -> u32 {
    let d = d / d.abs().element_sum().max(1e-9);
    let mut uv = Vec2::new(d.x, d.y);
    if d.z < 0.0 {
        uv = Vec2::new((1.0 - d.y.abs()).copysign(d.x), (1.0 - d.x.abs()).copysign(d.y));
    }
    let cell = ((uv * 0.5 + 0.5) * SKY_SIDE as f32).floor().clamp(Vec2::ZERO, Vec2::splat(SKY_SIDE as f32 - 1.0));
    cell.y as u32 * SKY_SIDE + cell.x as u32
}

/// Each part's radiance as a multiple of the environment's mean.
fn sky(scene: &Scene) -> Vec<[f32; 3]> {
    let even = vec![[1.0; 3]; SKY as usize];
    let Some(image) = &scene.environment.image else { return even };
    let mut sums = vec![(Vec3::ZERO, 0.0f32); SKY as usize];
    let (width, height) = (image.width as usize, image.height as usize);
    for y in 0..height {
        let theta = std::f32::consts::PI * (y as f32 + 0.5) / height as f32;
        for x in 0..width {
            // Inverse of `scene::environment::coordinates`.
            let phi = std::f32::consts::TAU * ((x as f32 + 0.5) / width as f32 - 0.5);
            let d = Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin());
            let Some(rgb) = image.rgb.get(3 * (y * width + x)..3 * (y * width + x) + 3) else { continue };
            let sum = &mut sums[sky_part(d) as usize];
            *sum = (sum.0 + Vec3::from_slice(rgb) * theta.sin(), sum.1 + theta.sin());
        }
    }
    let mean = Vec3::from(scene.environment.radiance).max(Vec3::splat(1e-20));
    sums.iter().map(|(rgb, weight)| (*rgb / weight.max(1e-9) / mean).to_array()).collect()
}
