//! Speed of rays: primary, shadow and diffuse ones through the rooms of the paper, and their cost against the number of triangles.
//!
//!     cargo run --release --example rays -- [--repeat N] [--csv F.csv] [--svg F.svg]
//!
//! Rays are read from and hits written to buffers, which counts; the row `nothing` says how much that is. On a CPU driver
//! the time is that of the processor, not the clock on the wall, so that other work on the machine does not count.

use bouncelight::accel::{Accel, AccelGpu, RayBatch, RayCaster, RayGpu};
use bouncelight::gpu::{Gpu, GpuOptions};
use bouncelight::scene::{LightKind, Scene};
use glam::{Mat4, Vec3};
use std::f32::consts::{PI, TAU};
use std::fmt::Write;
use std::time::Instant;

const SIDE: usize = 384;
const KINDS: [&str; 3] = ["primary", "shadow", "diffuse"];

struct Random(u64);

impl Random {
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / 16_777_216.0
    }
}

/// Where rays start and where the light is.
struct View {
    eye: Vec3,
    ahead: Vec3,
    light: Light,
}

enum Light {
    Towards(Vec3),
    At(Vec3),
}

fn flatten(scene: &Scene) -> Vec<[[f32; 3]; 3]> {
    let mut triangles = Vec::new();
    for instance in &scene.instances {
        let (mesh, place) = (&scene.meshes[instance.mesh], Mat4::from_cols_array_2d(&instance.transform));
        let corner = |k: u32| place.transform_point3(mesh.positions[k as usize].into()).to_array();
        triangles.extend(mesh.indices.chunks_exact(3).map(|t| [corner(t[0]), corner(t[1]), corner(t[2])]));
    }
    triangles
}

fn view(scene: &Scene) -> View {
    let camera = Mat4::from_cols_array_2d(&scene.cameras[0].transform);
    let sun = scene.lights.iter().find_map(|l| match l.kind {
        LightKind::Directional { direction, .. } => Some(-Vec3::from(direction)),
        _ => None,
    });
    let light = Light::Towards(sun.unwrap_or(Vec3::Y));
    View { eye: camera.w_axis.truncate(), ahead: -camera.z_axis.truncate(), light }
}

/// 27 spheres in a box, about `count` triangles in all: the same shapes at every count.
fn spheres(count: usize) -> (Vec<[[f32; 3]; 3]>, View) {
    let n = ((count as f64 / 27.0 / 4.0).sqrt().round() as usize).max(2);
    let at = |i: usize, j: usize| {
        let (theta, phi) = (i as f32 / n as f32 * PI, (j % (2 * n)) as f32 / n as f32 * PI);
        Vec3::new(theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin())
    };
    let (mut triangles, mut random) = (Vec::new(), Random(5));
    for k in 0..27 {
        let jitter = Vec3::new(random.unit(), random.unit(), random.unit()) * 0.3;
        let centre = Vec3::new((k % 3) as f32, (k / 3 % 3) as f32, (k / 9) as f32) - 1.0 + jitter;
        for (i, j) in (0..n).flat_map(|i| (0..2 * n).map(move |j| (i, j))) {
            let corners = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            let [a, b, c, d] = corners.map(|p| (centre + 0.4 * p).to_array());
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    for (axis, side) in [(0, -2.0f32), (0, 2.0), (1, -2.0), (1, 2.0), (2, -2.0), (2, 2.0)] {
        let at = |u: f32, v: f32| {
            let mut p = [side; 3];
            (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (2.0 * u, 2.0 * v);
            p
        };
        let [a, b, c, d] = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
        triangles.extend([[a, b, c], [a, c, d]]);
    }
    let light = Light::At(Vec3::new(0.0, 1.8, 0.0));
    (triangles, View { eye: Vec3::new(0.1, 0.2, 1.9), ahead: Vec3::NEG_Z, light })
}

/// The three kinds of rays, pixel by pixel.
fn rays(triangles: &[[[f32; 3]; 3]], accel: &Accel, view: &View) -> [Vec<RayGpu>; 3] {
    let ray = |o: Vec3, d: Vec3, t_max, any| RayGpu { origin: o.into(), direction: d.into(), t_max, any };
    let right = view.ahead.cross(Vec3::Y).normalize();
    let up = right.cross(view.ahead);
    let mut random = Random(1);
    let [mut primary, mut shadow, mut diffuse] = [const { Vec::new() }; 3];
    for (y, x) in (0..SIDE).flat_map(|y| (0..SIDE).map(move |x| (y, x))) {
        let at = |i: usize, jitter: f32| (i as f32 + jitter) / SIDE as f32 * 2.0 - 1.0;
        let d = (view.ahead + right * at(x, random.unit()) * 0.8 - up * at(y, random.unit()) * 0.5).normalize();
        primary.push(ray(view.eye, d, f32::INFINITY, 0));
        let Some(hit) = accel.closest(view.eye.into(), d.into(), f32::INFINITY) else { continue };
        let [a, b, c] = triangles[hit.triangle as usize].map(Vec3::from);
        let n = (b - a).cross(c - a).normalize();
        let n = if n.dot(d) > 0.0 { -n } else { n };
        let p = view.eye + d * hit.t + n * (1e-4 * hit.t);
        let (z, phi) = (random.unit() * 2.0 - 1.0, random.unit() * TAU);
        let ball = ((1.0 - z * z).sqrt() * Vec3::new(phi.cos(), phi.sin(), 0.0)).with_z(z);
        diffuse.push(ray(p, (n + 0.999 * ball).normalize(), f32::INFINITY, 0));
        let blur = 0.01 * Vec3::new(random.unit(), random.unit(), random.unit());
        shadow.push(match view.light {
            Light::Towards(d) => ray(p, (d + blur).normalize(), f32::INFINITY, 1),
            Light::At(q) => ray(p, q + blur - p, 1.0, 1),
        });
    }
    [primary, shadow, diffuse]
}

/// Seconds that this process's threads have run, where Linux tells.
fn busy() -> Option<f64> {
    let threads = std::fs::read_dir("/proc/self/task").ok()?;
    let one = |dir: std::io::Result<std::fs::DirEntry>| {
        let text = std::fs::read_to_string(dir.ok()?.path().join("schedstat")).ok()?;
        text.split_whitespace().next()?.parse::<f64>().ok()
    };
    Some(threads.filter_map(one).sum::<f64>() * 1e-9)
}

struct Row {
    name: String,
    triangles: usize,
    mebibytes: f64,
    build: f64,
    visits: [f64; 3],
    /// Nanoseconds a ray.
    cost: [f64; 3],
}

/// A scene on the GPU with its rays.
struct Prepared {
    row: Row,
    batches: [(RayBatch, usize); 3],
}

/// `empty`: the rays of the scene, but nothing to hit.
fn prepare(gpu: &Gpu, caster: &RayCaster, name: &str, scene: (Vec<[[f32; 3]; 3]>, View), empty: bool) -> Prepared {
    let (triangles, view) = scene;
    let start = Instant::now();
    let mut accel = Accel::build(&triangles).expect("the count is within bounds");
    let build = start.elapsed().as_secs_f64();
    let kinds = rays(&triangles, &accel, &view);
    if empty {
        accel = Accel::build(&[]).expect("nothing is within bounds");
    }
    let on_gpu = AccelGpu::new(&gpu.device, &gpu.queue, &accel).expect("the structure fits");
    let visits = kinds.each_ref().map(|rays| {
        let some = rays.iter().step_by(37);
        let count = some.clone().count() as f64;
        some.map(|r| accel.visits(r.origin, r.direction, r.t_max)).sum::<usize>() as f64 / count
    });
    let row = Row {
        name: name.into(),
        triangles: accel.triangle_count(),
        mebibytes: accel.bytes() as f64 / 1_048_576.0,
        build,
        visits,
        cost: [f64::INFINITY; 3],
    };
    Prepared { row, batches: kinds.each_ref().map(|rays| (caster.batch(&gpu.device, &on_gpu, rays), rays.len())) }
}

/// One run of each kind of ray; the best run counts.
fn measure(gpu: &Gpu, caster: &RayCaster, scene: &mut Prepared) {
    let cores = std::thread::available_parallelism().map_or(1, usize::from) as f64;
    for (best, (batch, count)) in scene.row.cost.iter_mut().zip(&scene.batches) {
        let (start, busy_before) = (Instant::now(), busy());
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        caster.record(&mut encoder, batch);
        gpu.queue.submit([encoder.finish()]);
        gpu.device.poll(bouncelight::wgpu::PollType::wait_indefinitely()).expect("the device lives");
        let seconds = match (busy_before, busy()) {
            (Some(a), Some(b)) if gpu.is_software() => (b - a) / cores,
            _ => start.elapsed().as_secs_f64(),
        };
        *best = best.min(seconds * 1e9 / *count as f64);
    }
}

/// Cost a ray over the number of triangles; a straight line is a logarithm.
fn chart(rows: &[Row], adapter: &str) -> String {
    let (width, height, left, bottom, top) = (760.0, 420.0, 64.0, 360.0, 48.0);
    let most = rows.iter().flat_map(|r| r.cost).fold(0.0, f64::max) * 1.1;
    let x = |triangles: f64| left + (triangles.log10() - 2.85) / 3.25 * (width - left - 110.0);
    let y = |ns: f64| bottom - ns / most * (bottom - top);
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n\
         <text x=\"{left}\" y=\"20\" font-size=\"15\">Cost of a ray against the number of triangles</text>\n\
         <text x=\"{left}\" y=\"37\" fill=\"#666\">27 spheres in a box; dashed: a + b · log(triangles), fitted. {adapter}</text>\n"
    );
    for decade in 3..=6 {
        let at = x(10f64.powi(decade));
        let _ = writeln!(
            svg,
            "<path d=\"M{at:.1} {top}V{bottom}\" stroke=\"#ddd\"/><text x=\"{at:.1}\" y=\"{}\" text-anchor=\"middle\">10{}</text>",
            bottom + 20.0,
            ['³', '⁴', '⁵', '⁶'][decade as usize - 3]
        );
    }
    let step = 10f64.powf((most / 3.0).log10().floor());
    let step = if most / step > 10.0 { step * 2.5 } else { step };
    for tick in (0..).map(|i| f64::from(i) * step).take_while(|t| *t < most) {
        let at = y(tick);
        let _ = writeln!(
            svg,
            "<path d=\"M{left} {at:.1}H{}\" stroke=\"#ddd\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{tick:.0}</text>",
            width - 110.0,
            left - 6.0,
            at + 4.0
        );
    }
    let _ = writeln!(
        svg,
        "<text x=\"{:.0}\" y=\"{}\" text-anchor=\"middle\">triangles</text>",
        (left + width - 110.0) / 2.0,
        bottom + 42.0
    );
    let _ = writeln!(
        svg,
        "<text transform=\"translate(16 {:.0}) rotate(-90)\" text-anchor=\"middle\">ns a ray</text>",
        (top + bottom) / 2.0
    );
    for (k, color) in ["#1b6ca8", "#c7522a", "#3a7d44"].iter().enumerate() {
        let (a, b, fit) = logarithm(rows, k);
        let points = rows.iter().map(|r| format!("{:.1},{:.1}", x(r.triangles as f64), y(r.cost[k])));
        let _ = writeln!(
            svg,
            "<polyline points=\"{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>",
            points.collect::<Vec<_>>().join(" ")
        );
        for r in rows {
            let _ = writeln!(
                svg,
                "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3.5\" fill=\"{color}\"/>",
                x(r.triangles as f64),
                y(r.cost[k])
            );
        }
        let line = |n: f64| y((a + b * n.log10()).max(0.0));
        let _ = writeln!(
            svg,
            "<path d=\"M{:.1} {:.1}L{:.1} {:.1}\" stroke=\"{color}\" stroke-dasharray=\"4 4\"/>",
            x(1e3),
            line(1e3),
            x(1.2e6),
            line(1.2e6)
        );
        let end = rows.last().map_or(0.0, |r| y(r.cost[k]));
        let _ = writeln!(
            svg,
            "<text x=\"{:.1}\" y=\"{:.1}\" fill=\"{color}\">{}</text>",
            width - 104.0,
            end + 4.0,
            KINDS[k]
        );
        println!("{}: {a:.0} + {b:.0} · log10(triangles) ns a ray, R² {fit:.3}", KINDS[k]);
    }
    svg + "</svg>\n"
}

/// Least squares of cost against log10(triangles): offset, slope, R².
fn logarithm(rows: &[Row], kind: usize) -> (f64, f64, f64) {
    let n = rows.len() as f64;
    let points: Vec<_> = rows.iter().map(|r| ((r.triangles as f64).log10(), r.cost[kind])).collect();
    let (mx, my) = points.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / n, s.1 + p.1 / n));
    let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| f(p.0 - mx, p.1 - my)).sum::<f64>();
    let (xy, xx, yy) = (sum(&|x, y| x * y), sum(&|x, _| x * x), sum(&|_, y| y * y));
    (my - xy / xx * mx, xy / xx, xy * xy / (xx * yy))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let value = |name: &str| args.iter().position(|a| a == name).and_then(|i| args.get(i + 1));
    let repeat = value("--repeat").map_or(Ok(9), |n| n.parse())?;
    let gpu = Gpu::open(&GpuOptions::default())?;
    println!("{}", gpu.sentence());
    let caster = RayCaster::new(&gpu.device);
    let mut scenes = vec![prepare(&gpu, &caster, "nothing", spheres(1000), true)];
    for name in ["cornell", "interior", "paper-room:0", "paper-room:1", "paper-room:2"] {
        let scene = bouncelight::scene::load(name)?;
        scenes.push(prepare(&gpu, &caster, name, (flatten(&scene), view(&scene)), false));
    }
    for count in [1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000] {
        scenes.push(prepare(&gpu, &caster, &format!("spheres {count}"), spheres(count), false));
    }
    // All scenes in turn, so that other work on the machine hits all alike.
    for _ in 0..repeat {
        scenes.iter_mut().for_each(|scene| measure(&gpu, &caster, scene));
    }
    println!("| scene | triangles | MiB | build, s | primary, Mray/s | shadow | diffuse | visits, primary / diffuse |");
    println!("|---|---|---|---|---|---|---|---|");
    let rows: Vec<Row> = scenes.into_iter().map(|s| s.row).collect();
    for row in &rows {
        let ([p, s, d], [u, _, w]) = (row.cost.map(|ns| 1e3 / ns), row.visits);
        let (name, triangles, size, build) = (&row.name, row.triangles, row.mebibytes, row.build);
        println!("| {name} | {triangles} | {size:.1} | {build:.2} | {p:.2} | {s:.2} | {d:.2} | {u:.1} / {w:.1} |");
    }
    let rows = &rows[6..];
    let svg = chart(rows, &gpu.info.name);
    if let Some(path) = value("--csv") {
        let mut csv =
            String::from("triangles,bytes,build_s,primary_ns,shadow_ns,diffuse_ns,primary_visits,diffuse_visits\n");
        for r in rows {
            let [a, b, c] = r.cost;
            let [u, _, w] = r.visits;
            writeln!(
                csv,
                "{},{:.0},{:.3},{a:.1},{b:.1},{c:.1},{u:.2},{w:.2}",
                r.triangles,
                r.mebibytes * 1_048_576.0,
                r.build
            )?;
        }
        std::fs::write(path, csv)?;
    }
    if let Some(path) = value("--svg") {
        std::fs::write(path, svg)?;
    }
    Ok(())
}
