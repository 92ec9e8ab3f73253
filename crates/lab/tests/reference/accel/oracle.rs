//! Triangles, rays, and brute force in double precision as the oracle.

use crate::common;
use bouncelight::accel::{Accel, AccelGpu, HitGpu, RayCaster, RayGpu};

pub type Point = [f32; 3];
pub type Triangle = [Point; 3];

pub const NONE: u32 = u32::MAX;

/// Reproducible numbers: PCG-XSH-RR 64/32.
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((((self.0 >> 18) ^ self.0) >> 27) as u32).rotate_right((self.0 >> 59) as u32)
    }
    /// In [-1, 1).
    pub fn signed(&mut self) -> f32 {
        self.bits() as f32 * (2.0 / 4_294_967_296.0) - 1.0
    }
    pub fn point(&mut self) -> Point {
        std::array::from_fn(|_| self.signed())
    }
    pub fn direction(&mut self) -> Point {
        loop {
            let p = self.point();
            let length = p.iter().map(|x| x * x).sum::<f32>().sqrt();
            if length > 0.1 && length < 1.0 {
                return p.map(|x| x / length);
            }
        }
    }
}

pub fn add(a: Point, b: Point, scale: f32) -> Point {
    std::array::from_fn(|k| a[k] + b[k] * scale)
}

/// Triangles of size `size` scattered in the cube [-1, 1]³.
pub fn soup(count: usize, size: f32, seed: u64) -> Vec<Triangle> {
    let mut random = Random(seed);
    let mut corners = || {
        let centre = random.point();
        std::array::from_fn(|_| add(centre, random.point(), size))
    };
    (0..count).map(|_| corners()).collect()
}

/// Unit sphere, closed, `n` × 2`n` quads halved.
pub fn sphere(n: usize) -> Vec<Triangle> {
    let at = |i: usize, j: usize| {
        // Poles and seam are the same numbers whichever quad asks.
        let (theta, phi) =
            (i as f64 / n as f64 * std::f64::consts::PI, (j % (2 * n)) as f64 / n as f64 * std::f64::consts::PI);
        let ring = if i == 0 || i == n { 0.0 } else { theta.sin() };
        [ring * phi.cos(), theta.cos(), ring * phi.sin()].map(|x| x as f32)
    };
    let mut all = Vec::new();
    for i in 0..n {
        for j in 0..2 * n {
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            if i > 0 {
                all.push([a, b, c]);
            }
            if i + 1 < n {
                all.push([a, c, d]);
            }
        }
    }
    all
}

/// Möller and Trumbore in f64: distance of the hit and cosine of its angle with the normal, if any.
pub fn hit(triangle: &Triangle, origin: Point, direction: Point) -> Option<(f64, f64)> {
    let wide = |p: Point| p.map(f64::from);
    let sub = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| a[k] - b[k]) };
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let cross = |a: [f64; 3], b: [f64; 3]| -> [f64; 3] {
        std::array::from_fn(|k| a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3])
    };
    let [a, b, c] = triangle.map(wide);
    let (e1, e2, d) = (sub(b, a), sub(c, a), wide(direction));
    let p = cross(d, e2);
    let inverse = 1.0 / dot(e1, p);
    let s = sub(wide(origin), a);
    let u = dot(s, p) * inverse;
    let q = cross(s, e1);
    let v = dot(d, q) * inverse;
    let t = dot(e2, q) * inverse;
    let normal = cross(e1, e2);
    let cosine = dot(normal, d).abs() / (dot(normal, normal) * dot(d, d)).sqrt();
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some((t, cosine))
}

/// What the nearest hit of all triangles is.
pub struct Nearest {
    triangle: u32,
    t: f64,
    /// The runner-up's distance.
    second: f64,
    cosine: f64,
}

pub fn brute(triangles: &[Triangle], ray: &RayGpu) -> Nearest {
    let mut best = Nearest { triangle: NONE, t: f64::INFINITY, second: f64::INFINITY, cosine: 1.0 };
    for (i, triangle) in triangles.iter().enumerate() {
        match hit(triangle, ray.origin, ray.direction) {
            Some((t, cosine)) if t < best.t => best = Nearest { triangle: i as u32, t, second: best.t, cosine },
            Some((t, _)) => best.second = best.second.min(t),
            None => {}
        }
    }
    best
}

pub fn ray(origin: Point, direction: Point) -> RayGpu {
    RayGpu { origin, t_max: f32::INFINITY, direction, any: 0 }
}

/// Rays that disagree with brute force: another triangle (unless two are equally near) or another
/// distance. Distances agree to 1e-5; where a ray grazes its triangle, rounding of the corners
/// moves the hit along it, by one over the cosine.
pub fn disagreements(triangles: &[Triangle], rays: &[RayGpu], hits: &[HitGpu], unit: f64) -> usize {
    let wrong = |ray: &RayGpu, got: &HitGpu| {
        let best = brute(triangles, ray);
        let close = |a: f64, b: f64| (a - b).abs() <= 1e-5 * a.abs().max(b.abs()).max(0.1 * unit / best.cosine);
        let right = close(got.t.into(), best.t) && (got.triangle == best.triangle || close(best.t, best.second));
        let wrong = if best.triangle == NONE { got.triangle != NONE } else { got.triangle == NONE || !right };
        if wrong {
            println!("{ray:?} gave {got:?}, not triangle {} at {} (next {})", best.triangle, best.t, best.second);
        }
        wrong
    };
    rays.iter().zip(hits).filter(|(ray, got)| wrong(ray, got)).count()
}

/// What a scene is traced with on the GPU.
pub struct Bench {
    gpu: bouncelight::gpu::Gpu,
    caster: RayCaster,
}

impl Bench {
    pub fn new() -> Option<Self> {
        let gpu = common::gpu()?;
        let caster = RayCaster::new(&gpu.device);
        Some(Self { gpu, caster })
    }
    pub fn trace(&self, accel: &Accel, rays: &[RayGpu]) -> Vec<HitGpu> {
        let on_gpu = AccelGpu::new(&self.gpu.device, &self.gpu.queue, accel).unwrap();
        self.caster.trace(&self.gpu.device, &self.gpu.queue, &on_gpu, rays).unwrap()
    }
}

pub fn random_rays(count: usize, reach: f32, seed: u64) -> Vec<RayGpu> {
    let mut random = Random(seed);
    (0..count).map(|_| ray(random.point().map(|x| x * reach), random.direction())).collect()
}

pub fn on_cpu(accel: &Accel, rays: &[RayGpu]) -> Vec<HitGpu> {
    let none = |t| HitGpu { t, triangle: NONE, uv: [0.0; 2], instance: NONE, leaf: 0 };
    let hit = |r: &RayGpu| match accel.closest(r.origin, r.direction, r.t_max) {
        Some(h) => HitGpu { t: h.t, triangle: h.triangle, uv: h.uv, instance: NONE, leaf: 0 },
        None => none(r.t_max),
    };
    rays.iter().map(hit).collect()
}
