//! The path tracer's host, told by a kernel whose every sample is known: nothing is lost, doubled
//! or mixed up, however the work is cut.

use crate::common;
use bouncelight::gpu::Gpu;
use bouncelight::scene::{Camera, Scene};
use bouncelight_lab::reference::{
    JUDGED, Job, Kernel, Layer, ReferenceScene, Subject, Traced, Tracer, TracerError, TracerOptions, job,
};
use std::time::Duration;

/// Sample values are hashes of (seed, half, point, sample): uniform in [0, 1).
const PATH: &str = r#"
@compute @workgroup_size(64)
fn path(@builtin(global_invocation_id) id: vec3u) {
    if id.x >= job.point_count {
        return;
    }
    let point = job.first_point + id.x;
    let at = point - job.film_first;
    for (var i = job.first_sample; i < job.first_sample + job.sample_count; i++) {
        let u = hash01(job.seed * 2u + job.half, point, i, 0u);
        var spot = vec2f(f32(point % job.size.x) + 0.5, f32(point / job.size.x) + 0.5);
        if (job.flags & JOB_POINTS) != 0u {
            spot = points[point];
        }
        film_add(at, FILM_DIFF_DIR, vec4f(u, 0.25 * u, 0.0, 1.0));
        film_add(at, FILM_DIFF_IND, vec4f(vec3f(0.125 * u), 0.0));
        film_add(at, FILM_GLOSS_DIR, vec4f(0.5, 0.0, 0.0, 0.25 * spot.y));
        film_add(at, FILM_GLOSS_IND, vec4f(0.25, 0.5, 0.0, 0.0));
        film_add(at, FILM_EMIT, vec4f(0.0, 0.0, 0.75, spot.x));
        film_add(at, FILM_DIFF_COL, vec4f(0.5, 0.25, 0.0, spot.y));
        film_add(at, FILM_GLOSS_COL, vec4f(0.5, 0.5, 0.0, job.filter_width));
        film_add(at, FILM_ANALYTIC, vec4f(0.5 * u, 0.0, 0.0, 0.0));
    }
}
"#;

const FIRST_HIT: &str = r#"
@group(1) @binding(2) var<storage, read_write> hits: array<vec4f>;
@compute @workgroup_size(64)
fn first_hit(@builtin(global_invocation_id) id: vec3u) {
    if id.x < job.point_count {
        let point = job.first_point + id.x;
        hits[point - job.film_first] = vec4f(1.0, 2.0, 3.0, f32(point));
    }
}
"#;

struct Bench {
    gpu: Gpu,
    kernel: Kernel,
    scene: ReferenceScene,
    camera: Camera,
}

fn bench(path: &str) -> Option<Bench> {
    let gpu = common::gpu()?;
    let library =
        [include_str!("../../../../shaders/reference/types.wgsl"), include_str!("../../../../shaders/lib/hash.wgsl")]
            .concat();
    let film = include_str!("../../../../shaders/reference/film.wgsl");
    let kernel = Kernel::from_wgsl(&gpu.device, &[&library, film, path].concat(), &[&library, FIRST_HIT].concat());
    let scene = ReferenceScene::new(&gpu.device, &gpu.queue, &Scene::default()).unwrap();
    let camera = Camera::look_at([0.0; 3], [0.0, 0.0, -1.0], 1.0);
    Some(Bench { gpu, kernel, scene, camera })
}

impl Bench {
    fn try_tracer(&self, size: [u32; 2], points: Option<&[[f32; 2]]>, o: TracerOptions) -> Result<Tracer, TracerError> {
        let subject = Subject { camera: &self.camera, size, points };
        Tracer::new(&self.gpu.device, &self.gpu.queue, &self.kernel, &self.scene, subject, o)
    }

    fn tracer(&self, size: [u32; 2], points: Option<&[[f32; 2]]>, options: TracerOptions) -> Tracer {
        self.try_tracer(size, points, options).unwrap()
    }

    fn trace(&self, size: [u32; 2], points: Option<&[[f32; 2]]>, options: TracerOptions) -> Traced {
        let mut tracer = self.tracer(size, points, options);
        while tracer.step().unwrap() {}
        assert!(tracer.is_finished() && tracer.progress() == 1.0);
        tracer.finish().unwrap()
    }
}

fn all(samples: u32) -> TracerOptions {
    TracerOptions { samples, seed: 5, layers: Layer::ALL.to_vec(), ..Default::default() }
}

fn pcg(v: u32) -> u32 {
    let state = v.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// What the kernel draws.
fn u(seed: u32, half: u32, point: u32, sample: u32) -> f64 {
    f64::from(pcg((seed * 2 + half) ^ pcg(point ^ pcg(sample ^ pcg(0)))) >> 8) / 16_777_216.0
}

fn mean_u(seed: u32, point: u32, samples: u32) -> f64 {
    let half = |half, n: u32| (0..n).map(|i| u(seed, half, point, i)).sum::<f64>();
    (half(0, samples.div_ceil(2)) + half(1, samples / 2)) / f64::from(samples)
}

#[track_caller]
fn near(a: f32, b: f64) {
    assert!((f64::from(a) - b).abs() <= 1e-6 * b.abs().max(1e-3), "{a} against {b}");
}

#[test]
fn every_sample_counts_once_and_layers_are_divided_as_blender_does() {
    let Some(bench) = bench(PATH) else { return };
    let (size, samples) = ([37, 11], 7);
    let traced = bench.trace(size, None, all(samples));
    assert_eq!((traced.traced, traced.samples, traced.dropped), (37 * 11 * 7, [7, 7], 0));
    let at = |layer: Layer, i: usize| {
        let channels = layer.channels().len();
        traced.layer(layer).unwrap()[i * channels..][..channels].to_vec()
    };
    for i in 0..37 * 11 {
        let u = mean_u(5, i as u32, samples);
        near(at(Layer::DiffDir, i)[0], u / 0.5);
        near(at(Layer::DiffDir, i)[1], 0.25 * u / 0.25);
        assert_eq!(at(Layer::DiffDir, i)[2], 0.0, "no light where there is no colour");
        near(at(Layer::DiffInd, i)[0], 0.125 * u / 0.5);
        near(at(Layer::Gi, i)[0], (u + 0.125 * u - 0.5 * u) / 0.5);
        near(at(Layer::Analytic, i)[0], u);
        assert_eq!(at(Layer::DiffCol, i), [0.5, 0.25, 0.0]);
        assert_eq!(at(Layer::GlossDir, i), [1.0, 0.0, 0.0]);
        assert_eq!(at(Layer::GlossInd, i), [0.5, 1.0, 0.0]);
        assert_eq!(at(Layer::Emit, i), [0.0, 0.0, 0.75]);
        let (x, y) = ((i % 37) as f32 + 0.5, (i / 37) as f32 + 0.5);
        assert_eq!(at(Layer::Env, i), [x, y, 1.5], "background, and the filter's default width");
        assert_eq!(at(Layer::Normal, i), [0.0, 0.25 * y, 0.0]);
        assert_eq!((at(Layer::Depth, i), at(Layer::Position, i)), (vec![i as f32], vec![1.0, 2.0, 3.0]));
        // The sum of its parts. Diffuse blue has light without colour, which no layer can hold:
        // 0.125 u.
        let part = |d, a, b, c: usize| f64::from(at(d, i)[c]) * f64::from(at(a, i)[c] + at(b, i)[c]);
        for c in 0..3 {
            let sum = part(Layer::DiffCol, Layer::DiffDir, Layer::DiffInd, c)
                + part(Layer::GlossCol, Layer::GlossDir, Layer::GlossInd, c)
                + f64::from(at(Layer::Emit, i)[c] + at(Layer::Env, i)[c]);
            let lost = if c == 2 { 0.125 * u } else { 0.0 };
            near(at(Layer::Combined, i)[c], sum + lost);
        }
        assert_eq!(at(Layer::Combined, i)[3], 1.0);
    }
    // The control: one sample more is another picture.
    assert_ne!(bench.trace(size, None, all(samples + 1)).layers, traced.layers);
    assert_ne!(bench.trace(size, None, TracerOptions { seed: 6, ..all(samples) }).layers, traced.layers);
}

#[test]
fn neither_bands_nor_dispatches_show() {
    let Some(bench) = bench(PATH) else { return };
    let whole = bench.trace([53, 29], None, all(9));
    for (band, dispatch) in [(64, 100_000), (777, 100_000), (1536, 10), (u32::MAX, 10)] {
        let dispatch = Duration::from_micros(dispatch);
        let pieces = bench.trace([53, 29], None, TracerOptions { band, dispatch, ..all(9) });
        assert_eq!(pieces.layers, whole.layers, "bands of {band}, dispatches of {dispatch:?}");
        assert_eq!(pieces.traced, whole.traced);
        for (a, b) in pieces.noise.iter().zip(&whole.noise) {
            assert!((a.pixel / b.pixel - 1.0).abs() < 1e-9 && (a.picture / b.picture - 1.0).abs() < 1e-9);
        }
    }
}

#[test]
fn points_cost_by_the_point_and_have_no_filter() {
    let Some(bench) = bench(PATH) else { return };
    let list: Vec<[f32; 2]> = (0..100).map(|i| [10.0 * i as f32 + 0.25, 7.0]).collect();
    let traced = bench.trace([4096, 4096], Some(&list), all(6));
    assert_eq!((traced.size, traced.traced), ([100, 1], 600));
    let env = traced.layer(Layer::Env).unwrap();
    for (i, point) in list.iter().enumerate() {
        assert_eq!(env[3 * i..3 * i + 3], [point[0], point[1], 0.0]);
        near(traced.layer(Layer::Analytic).unwrap()[3 * i], mean_u(5, i as u32, 6));
    }
}

#[test]
fn it_stops_when_the_noise_is_small_enough_and_not_before() {
    let Some(bench) = bench(PATH) else { return };
    // Gi is 1.25 u, 0.5 u and 0 … its error, averaged over channels, against its mean.
    let options = |bound| TracerOptions { until_error: Some((Layer::Gi, bound)), ..all(4096) };
    let needed = |bound: f64| {
        let (a, b) = (1.25f64, 1.5f64);
        let relative = ((a * a + b * b) / 3.0 / 12.0).sqrt() / ((a + b) / 3.0 * 0.5);
        (relative / bound).powi(2)
    };
    for bound in [0.1, 0.05] {
        let traced = bench.trace([128, 64], None, options(bound));
        let got = f64::from(traced.samples[0]);
        assert!(got >= needed(bound) && got < 1.6 * needed(bound), "{got} samples for {}", needed(bound));
        let noise = traced.noise_of(Layer::Gi).unwrap();
        assert!(noise.pixel <= bound && noise.pixel_at_most <= bound, "{noise:?}");
        let truth = (needed(1.0) / got).sqrt();
        assert!((noise.pixel / truth - 1.0).abs() < 0.05, "{} against {truth}", noise.pixel);
    }
    // Bands stop on their own, all of them late enough.
    let bands = bench.trace([128, 64], None, TracerOptions { band: 2048, ..options(0.05) });
    assert!(f64::from(bands.samples[0]) >= needed(0.05) && bands.noise_of(Layer::Gi).unwrap().pixel <= 0.05);
    // One pixel never tells how noisy it is: the cap ends it.
    let one = bench.trace([1, 1], None, TracerOptions { samples: 300, ..options(0.5) });
    assert_eq!((one.samples, one.traced), ([300, 300], 300));
}

#[test]
fn it_can_be_looked_at_before_it_is_done() {
    let Some(bench) = bench(PATH) else { return };
    let options = TracerOptions { dispatch: Duration::from_micros(1), layers: vec![Layer::Analytic], ..all(4) };
    let mut tracer = bench.tracer([100, 50], None, options);
    assert!(tracer.step().unwrap() && tracer.step().unwrap());
    assert!(tracer.progress() < 0.5 && tracer.samples() == 0 && tracer.traced() > 0);
    let reached = tracer.traced() as usize;
    let early = tracer.resolve().unwrap().layer(Layer::Analytic).unwrap().to_vec();
    for (i, v) in early.chunks_exact(3).enumerate() {
        near(v[0], if i < reached { u(5, 0, i as u32, 0) } else { 0.0 });
    }
    assert!(tracer.noise(Layer::Combined).unwrap().pixel.is_infinite(), "half the film is empty");
    let mut progress = tracer.progress();
    while tracer.step().unwrap() {
        assert!(tracer.progress() >= progress);
        progress = tracer.progress();
    }
    assert!(!tracer.step().unwrap() && tracer.samples() == 4);
    assert!(tracer.noise(Layer::Combined).unwrap().pixel < 1.0);
}

#[test]
fn a_value_that_is_no_number_is_left_out_and_told() {
    let broken = PATH.replace("vec4f(vec3f(0.125 * u), 0.0)", "vec4f(bitcast<f32>(0x7fc00000u + i), 1.0, 1.0, 0.0)");
    assert_ne!(broken, PATH);
    let Some(bench) = bench(&broken) else { return };
    let traced = bench.trace([8, 8], None, all(4));
    assert_eq!(traced.dropped, 64 * 4);
    assert!(traced.layers.iter().all(|(_, data)| data.iter().all(|v| v.is_finite())));
}

#[test]
fn what_cannot_be_traced_is_refused_with_the_reason() {
    let Some(bench) = bench(PATH) else { return };
    let refused = |size, points: Option<&[[f32; 2]]>, options| match bench.try_tracer(size, points, options) {
        Ok(_) => panic!("{size:?} was taken"),
        Err(e) => e.to_string(),
    };
    assert!(refused([0, 5], None, all(1)).contains("nothing to trace"));
    assert!(refused([5, 5], Some(&[]), all(1)).contains("nothing to trace"));
    assert!(refused([1 << 20, 1 << 20], None, all(1)).contains("at most"));
    assert!(refused([5, 5], Some(&[[0.0; 2], [f32::NAN, 1.0]]), all(1)).contains("point 1"));
    assert!(refused([5, 5], None, all(0)).contains("at least one sample"));
    for bound in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let options = TracerOptions { until_error: Some((Layer::Combined, bound)), ..all(1) };
        assert!(refused([5, 5], None, options).contains("above 0"));
    }
    let options = TracerOptions { until_error: Some((Layer::Normal, 0.1)), ..all(1) };
    assert!(refused([5, 5], None, options).contains(JUDGED[0].name()));
    assert!(refused([5, 5], None, TracerOptions { clamp: f32::NAN, ..all(1) }).contains("clamp"));
    assert!(refused([5, 5], None, TracerOptions { filter_width: -1.0, ..all(1) }).contains("filter"));
    let lost = Camera { transform: [[f32::NAN; 4]; 4], ..bench.camera.clone() };
    let subject = Subject { camera: &lost, size: [4, 4], points: None };
    let result = Tracer::new(&bench.gpu.device, &bench.gpu.queue, &bench.kernel, &bench.scene, subject, all(1));
    assert!(result.err().expect("a camera nowhere is refused").to_string().contains("camera"));
    assert_eq!(Job::new(&bench.camera, [4, 4]).bounces, job::UNLIMITED);
}

/// The path tracer itself in the Cornell box.
fn cornell() -> Option<Bench> {
    let gpu = common::gpu()?;
    let scene = bouncelight_lab::scenes::load("cornell").unwrap();
    let camera = scene.cameras[0].clone();
    let packed = ReferenceScene::new(&gpu.device, &gpu.queue, &scene).unwrap();
    Some(Bench { kernel: Kernel::new(&gpu.device), scene: packed, camera, gpu })
}

#[test]
fn the_picture_is_the_sum_of_its_layers() {
    let Some(bench) = cornell() else { return };
    let traced = bench.trace([24, 24], None, all(4));
    let layer = |l| traced.layer(l).unwrap();
    let (mut worst, mut brightest, mut lit) = (0.0f32, 0.0f32, 0);
    for i in 0..3 * 24 * 24 {
        let v = |l| layer(l)[i];
        let sum = v(Layer::DiffCol) * (v(Layer::DiffDir) + v(Layer::DiffInd))
            + v(Layer::GlossCol) * (v(Layer::GlossDir) + v(Layer::GlossInd))
            + v(Layer::Emit)
            + v(Layer::Env);
        let picture = layer(Layer::Combined)[i / 3 * 4 + i % 3];
        worst = worst.max((sum - picture).abs() / picture.max(0.1));
        brightest = brightest.max(picture);
        lit += usize::from(v(Layer::DiffInd) > 0.0);
    }
    assert!(worst < 1e-5, "{worst}");
    assert!(brightest > 1.0 && lit > 1000, "{brightest}, {lit}: there is light, bounced too");
    assert!(layer(Layer::Depth).iter().any(|d| *d < 100.0) && traced.dropped == 0);
    // Bands of the real kernel, too: random numbers are keyed by the pixel, and sums do not depend
    // on the cutting.
    let bands = bench.trace([24, 24], None, TracerOptions { band: 128, dispatch: Duration::from_millis(1), ..all(4) });
    assert_eq!(bands.layers, traced.layers);
}

#[test]
fn rays_begin_at_the_near_plane() {
    let Some(mut bench) = cornell() else { return };
    let depths = |bench: &Bench| bench.trace([24, 24], None, all(1)).layer(Layer::Depth).unwrap().to_vec();
    let least = |all: &[f32]| all.iter().copied().fold(f32::INFINITY, f32::min);
    let whole = depths(&bench);
    let hit: Vec<f32> = whole.iter().copied().filter(|d| *d < 100.0).collect();
    let near = 0.5 * (least(&hit) + hit.iter().copied().fold(0.0, f32::max));
    bench.camera.near = near;
    let cut = depths(&bench);
    assert!(least(&cut) >= near && cut.iter().any(|d| *d < 100.0), "{} before {near}", least(&cut));
    // Negative control: there was something before it, and what lies behind has stayed.
    assert!(least(&whole) < 0.9 * near);
    assert!(whole.iter().zip(&cut).all(|(a, b)| *a < near || (a - b).abs() < 1e-4 * b));
}

#[test]
fn chosen_points_agree_with_the_pixels_of_a_whole_picture() {
    // Every fourth pixel, as the network samples; the halves' difference gives each point's error
    // bar.
    let size = [32u32, 32];
    let list: Vec<[f32; 2]> =
        (0..64).map(|i| [(4 * (i % 8) + 2) as f32 + 0.5, (4 * (i / 8) + 2) as f32 + 0.5]).collect();
    let options = |seed| TracerOptions {
        seed,
        samples: 16,
        filter_width: 0.0,
        layers: Layer::ALL.to_vec(),
        ..Default::default()
    };
    let Some(bench) = cornell() else { return };
    let runs = |points: Option<&[[f32; 2]]>, seeds: std::ops::Range<u32>| -> Vec<Traced> {
        seeds.map(|seed| bench.trace(size, points, options(seed))).collect()
    };
    let (whole, points) = (runs(None, 0..4), runs(Some(&list), 4..8));
    assert_eq!((points[0].traced, whole[0].traced), (64 * 16, 32 * 32 * 16), "cost goes by the point");
    let pixel = |p: usize| (4 * (p / 8) + 2) * 32 + 4 * (p % 8) + 2;
    // What does not vary agrees exactly.
    for p in 0..64 {
        let (a, b) = (points[0].layer(Layer::Depth).unwrap()[p], whole[0].layer(Layer::Depth).unwrap()[pixel(p)]);
        assert!((a - b).abs() < 1e-4 * b, "depth of point {p}: {a} against {b}");
    }
    // Mean over points of a layer, run by run: four independent numbers on either side.
    let means = |runs: &[Traced], at: &dyn Fn(usize) -> usize| -> (f64, f64) {
        let of = |t: &Traced| {
            let gi = t.layer(Layer::Gi).unwrap();
            (0..64).map(|p| f64::from(gi[3 * at(p)] + gi[3 * at(p) + 1] + gi[3 * at(p) + 2])).sum::<f64>() / 192.0
        };
        let values: Vec<f64> = runs.iter().map(of).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let noise = runs.iter().map(|t| t.noise_of(Layer::Gi).unwrap()).map(|n| n.pixel * n.mean).sum::<f64>();
        // Error of a mean over 64 points and four runs, from the halves' noise of one point in one
        // run.
        (mean, noise / 4.0 / (64.0f64 * 4.0).sqrt())
    };
    let (a, b) = (means(&points, &|p| p), means(&whole, &pixel));
    let bar = (a.1.powi(2) + b.1.powi(2)).sqrt();
    assert!((a.0 - b.0).abs() < 4.0 * bar, "{a:?} against {b:?}");
    // The control: half a cell away there is other light.
    let moved = means(&whole, &|p| pixel(p) - 2 * 32 - 2);
    println!("{a:?} at the points, {b:?} in the picture, {moved:?} elsewhere, bar {bar:.4}");
    assert!((a.0 - moved.0).abs() > 4.0 * bar, "{a:?} against {moved:?}");
}
