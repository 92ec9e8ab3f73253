//! The path tracer against Blender's Cycles on the reference folder, under Cycles' own limits (12
//! bounces, 4 diffuse, 4 glossy, clamp 10), metals included.
//!
//! The reference renders have 64 samples a pixel, which leaves DiffInd 13 % of noise.
//! `tests/fixtures/cycles/second_*` hold one pixel in 128 of a second render with another seed, so
//! that the difference can be told without any noise (`agreement.rs`). The default test looks at
//! those 4096 pixels; the whole pictures are behind `--ignored`.

use crate::agreement::{Agreement, Value, tiles};
use crate::common::{self, Need};
use crate::harness::{Lab, Options, Traced, lab};
use bouncelight::render::capture::Picture;
use bouncelight::render::tonemap_curve::Tonemap;
use bouncelight::scene::{Environment, LightKind, Scene};
use bouncelight_scene::image_io::{self, Image, Layers};
use std::path::{Path, PathBuf};

const SCENES: [&str; 7] = ["sun_101", "point_201", "metal_301", "paper_0002", "paper_0003", "paper_0004", "paper_0005"];
const SKY: f32 = 0.050_876_09;

/// Distance between the pixels that the fixtures keep; the first lies at half of it.
const STEP: [usize; 2] = [16, 8];

/// Allowed root mean square difference, over the mean, noise taken off.
const RMS: f64 = 0.02;
/// Allowed mean of the difference, over the mean.
const BIAS: f64 = 0.01;
/// Least PSNR after Filmic, noise taken off, dB.
const PSNR: f64 = 38.0;

/// A scene of the reference folder with what its file cannot say.
fn reference_scene(shared: &Path, name: &str) -> Scene {
    let path = shared.join("reference/cycles").join(name).join("scene.glb");
    let mut scene = bouncelight_scene::gltf::load(&path).unwrap_or_else(|e| panic!("{e}"));
    scene.environment = Environment { radiance: [SKY; 3], ..scene.environment };
    for light in &mut scene.lights {
        if let LightKind::Point { radius, .. } = &mut light.kind {
            *radius = 0.5;
        }
    }
    scene
}

fn read(path: &Path) -> Layers {
    image_io::read_exr(path).unwrap_or_else(|e| panic!("{e}"))
}

fn rgb(image: &Image, x: usize, y: usize) -> [f64; 3] {
    let c = image.channels as usize;
    let i = (y * image.width as usize + x) * c;
    [0, 1, 2].map(|k| f64::from(image.pixels[i + k]))
}

/// Which pixels are looked at.
struct Sampling<'a> {
    pixels: Vec<[usize; 2]>,
    /// Size of a tile, pixels of the picture.
    tile: [usize; 2],
    /// The second render, and the step between the pixels that it holds.
    second: &'a Layers,
    step: [usize; 2],
    /// Samples a pixel in each half.
    samples: u32,
}

/// The answers for one scene.
#[derive(Debug)]
struct Answers {
    /// DiffDir and DiffInd.
    layers: [(&'static str, Agreement, Agreement); 2],
    /// Mean of DiffCol, ours over theirs.
    color: f64,
    /// After Filmic against the denoised picture: our noise taken off, and as it is.
    psnr: [f64; 2],
}

impl Answers {
    fn good(&self) -> bool {
        let fits = |(_, pixels, tiles): &(_, Agreement, Agreement)| {
            pixels.bias.value.abs() <= BIAS + 2.0 * pixels.bias.error && tiles.within(RMS) && pixels.within(RMS)
        };
        self.layers.iter().all(fits) && self.psnr[0] >= PSNR
    }

    fn print(&self, name: &str) {
        for (layer, p, t) in &self.layers {
            println!(
                "{name} {layer}: bias {:+.3} ± {:.3} %; rms {:.2} % of pixels (resolution {:.2}), {:.2} % of tiles ({:.2})",
                100.0 * p.bias.value,
                100.0 * p.bias.error,
                100.0 * p.rms(),
                100.0 * p.resolution(),
                100.0 * t.rms(),
                100.0 * t.resolution()
            );
        }
        println!("{name} DiffCol: ours {:.4} of theirs", self.color);
        println!("{name}: PSNR {:.1} dB, our noise included {:.1} dB", self.psnr[0], self.psnr[1]);
    }
}

fn traced(lab: &Lab, scene: &Scene, size: [u32; 2], s: &Sampling<'_>) -> Traced {
    let points: Vec<[f32; 2]> = s.pixels.iter().map(|&[x, y]| [x as f32 + 0.5, y as f32 + 0.5]).collect();
    let options = Options { samples: s.samples, filter: 1.5, like_cycles: true, ..Default::default() };
    lab.trace(scene, &scene.cameras[0], size, &points, &options)
}

/// `factors` multiply our direct and indirect light; anything but 1 is wrong.
fn compare(t: &Traced, reference: &Layers, s: &Sampling<'_>, factors: impl Fn(usize, usize) -> [f64; 2]) -> Answers {
    let [a, b] = t.halves();
    let image = |layers: &Layers, name: &str| layers.image(name).unwrap_or_else(|e| panic!("{e}"));
    let col = image(reference, "DiffCol");
    let across = (reference.width as usize).div_ceil(s.tile[0]);
    let layer = |name: &'static str, which: usize| {
        let (first, second) = (image(reference, name), image(s.second, name));
        let (mut values, mut groups) = (Vec::new(), Vec::new());
        for (i, &[x, y]) in s.pixels.iter().enumerate() {
            let ours_col = [0, 1, 2].map(|c| 0.5 * (a[i].diff_col[c] + b[i].diff_col[c]));
            if rgb(&col, x, y).iter().chain(&ours_col).any(|&c| c <= 0.02) {
                continue;
            }
            let factor = factors(x, y)[which];
            let (c, d) = (rgb(&first, x, y), rgb(&second, x / s.step[0], y / s.step[1]));
            values.push([0, 1, 2].map(|k| Value {
                ours: [&a[i], &b[i]].map(|h| factor * [h.diff_dir, h.diff_ind][which][k] / ours_col[k]),
                theirs: [c[k], d[k]],
            }));
            groups.push(y / s.tile[1] * across + x / s.tile[0]);
        }
        let least = s.tile[0] * s.tile[1] / (s.step[0] * s.step[1]) / 2;
        (name, Agreement::of(&values), Agreement::of(&tiles(&values, &groups, least)))
    };
    let combined = image(reference, "Combined");
    let (mut colors, mut known) = (0.0, 0.0);
    for (i, &[x, y]) in s.pixels.iter().enumerate() {
        colors += (0..3).map(|c| 0.5 * (a[i].diff_col[c] + b[i].diff_col[c])).sum::<f64>();
        known += rgb(&col, x, y).iter().sum::<f64>();
    }
    let filmic = |v: [f64; 3]| Tonemap::Filmic.apply(v.map(|v| v as f32)).map(f64::from);
    let (mut apart, mut plain) = (0.0, 0.0);
    for (i, &[x, y]) in s.pixels.iter().enumerate() {
        let scaled = |h: &crate::harness::Sums| {
            let [dir, ind] = factors(x, y);
            [0, 1, 2].map(|c| h.channel(c) + (dir - 1.0) * h.diff_dir[c] + (ind - 1.0) * h.diff_ind[c])
        };
        let (p, q) = (scaled(&a[i]), scaled(&b[i]));
        let both = filmic([0, 1, 2].map(|c| 0.5 * (p[c] + q[c])));
        let (p, q, truth) = (filmic(p), filmic(q), filmic(rgb(&combined, x, y)));
        for c in 0..3 {
            apart += (p[c] - truth[c]) * (q[c] - truth[c]);
            plain += (both[c] - truth[c]).powi(2);
        }
    }
    let decibels = |sum: f64| -10.0 * (sum / (3 * s.pixels.len()) as f64).max(1e-9).log10();
    Answers {
        layers: [layer("DiffDir", 0), layer("DiffInd", 1)],
        color: colors / known,
        psnr: [decibels(apart), decibels(plain)],
    }
}

fn right(_: usize, _: usize) -> [f64; 2] {
    [1.0; 2]
}

#[test]
fn light_is_that_of_cycles() {
    let Some(lab) = lab() else { return };
    let Some(shared) = common::shared() else { return };
    let (mut squares, mut biases) = (Vec::new(), Vec::new());
    for name in SCENES {
        let scene = reference_scene(&shared, name);
        let reference = read(&shared.join("reference/cycles").join(name).join("frame0000.exr"));
        let fixture = format!("tests/fixtures/cycles/second_{name}.exr");
        let second = read(&crate::common::root().join(fixture));
        let size = [reference.width, reference.height];
        let [w, h] = size.map(|s| s as usize);
        assert_eq!([w / STEP[0], h / STEP[1]], [second.width as usize, second.height as usize]);
        let pixels = (0..(w / STEP[0]) * (h / STEP[1]))
            .map(|i| [i % (w / STEP[0]) * STEP[0] + STEP[0] / 2, i / (w / STEP[0]) * STEP[1] + STEP[1] / 2])
            .collect();
        let s = Sampling { pixels, tile: [64, 64], second: &second, step: STEP, samples: 16 };
        let t = traced(lab, &scene, size, &s);
        let answers = compare(&t, &reference, &s, right);
        answers.print(name);
        assert!(answers.good(), "{name}: {answers:?}");
        squares.push(answers.layers[1].2.square.value);
        biases.push(answers.layers[1].1.bias.value);

        // 6 % more indirect light, or 8 % more on the left and less on the right, which leaves the
        // mean alone.
        let brighter = compare(&t, &reference, &s, |_, _| [1.0, 1.06]);
        assert!(!brighter.good(), "{name}: 6 % more indirect light went unnoticed: {brighter:?}");
        let tilted = compare(&t, &reference, &s, |x, _| if x < w / 2 { [1.08; 2] } else { [0.92; 2] });
        assert!(!tilted.good(), "{name}: 8 % more on the left, less on the right went unnoticed: {tilted:?}");
    }
    // Noise that hides a difference in one scene does not hide it in all of them.
    let all = squares.iter().sum::<f64>() / squares.len() as f64;
    println!("DiffInd, tiles of all scenes: rms {:.2} %", 100.0 * all.max(0.0).sqrt());
    let bias = biases.iter().sum::<f64>() / biases.len() as f64;
    println!("DiffInd of all scenes: bias {:+.2} %", 100.0 * bias);
    assert!(all <= RMS * RMS && bias.abs() <= BIAS, "{squares:?} {biases:?}");
}

/// `BOUNCELIGHT_SECOND=out/second cargo test --release --test reference -- --ignored --nocapture whole_pictures`,
/// where the folder holds the whole second renders that `tests/fixtures/cycles/second.py` makes.
/// `BOUNCELIGHT_SPP` (default 64) samples a pixel, `BOUNCELIGHT_SCENES` a list of scenes instead of
/// all.
#[test]
#[ignore = "minutes; needs the whole second renders"]
fn whole_pictures_are_those_of_cycles() {
    let Some(lab) = lab() else { return };
    let Some(shared) = common::shared() else { return };
    let Some(folder) = std::env::var_os("BOUNCELIGHT_SECOND").map(PathBuf::from) else {
        return common::skip(Need::Shared, "BOUNCELIGHT_SECOND names no folder of second renders");
    };
    let spp: u32 = std::env::var("BOUNCELIGHT_SPP").map_or(64, |v| v.parse().expect("a number of samples"));
    let wanted = std::env::var("BOUNCELIGHT_SCENES").unwrap_or_default();
    let mut bad = Vec::new();
    for name in SCENES.iter().filter(|n| wanted.is_empty() || wanted.split(',').any(|w| w == **n)) {
        let scene = reference_scene(&shared, name);
        let reference = read(&shared.join("reference/cycles").join(name).join("frame0000.exr"));
        let second = read(&folder.join(format!("{name}.exr")));
        let size = [reference.width, reference.height];
        let [w, h] = size.map(|s| s as usize);
        let pixels = (0..w * h).map(|i| [i % w, i / w]).collect();
        let s = Sampling { pixels, tile: [8, 8], second: &second, step: [1, 1], samples: spp / 2 };
        let start = std::time::Instant::now();
        let t = traced(lab, &scene, size, &s);
        let answers = compare(&t, &reference, &s, right);
        println!("{name}: {:.1} s", start.elapsed().as_secs_f64());
        answers.print(name);
        pictures(name, &t, &reference, &second);
        if !answers.good() {
            bad.push(format!("{name}: {answers:?}"));
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
}

/// Differences of both layers over the layer's mean, averaged over 4×4 pixels: grey for none, ±20 %
/// black and white.
fn pictures(name: &str, t: &Traced, reference: &Layers, second: &Layers) {
    let [w, h] = [reference.width as usize, reference.height as usize];
    for (which, layer) in ["DiffDir", "DiffInd"].into_iter().enumerate() {
        let (c, d) = (reference.image(layer).expect("there"), second.image(layer).expect("there"));
        let col = reference.image("DiffCol").expect("there");
        let mean = c.pixels.iter().map(|&v| f64::from(v)).sum::<f64>() / c.pixels.len() as f64;
        let (bw, bh) = (w / 4, h / 4);
        let mut data = vec![0.0f32; 3 * bw * bh];
        for i in 0..w * h {
            let (x, y) = (i % w, i / w);
            let [a, b] = t.halves();
            for k in 0..3 {
                let albedo = 0.5 * (a[i].diff_col[k] + b[i].diff_col[k]);
                if albedo <= 0.02 || rgb(&col, x, y)[k] <= 0.02 {
                    continue;
                }
                let pick = |s: &crate::harness::Sums| [s.diff_dir, s.diff_ind][which][k];
                let ours = 0.5 * (pick(&a[i]) + pick(&b[i])) / albedo;
                let theirs = 0.5 * (rgb(&c, x, y)[k] + rgb(&d, x, y)[k]);
                data[3 * (y / 4 * bw + x / 4) + k] += ((ours - theirs) / mean / 16.0) as f32;
            }
        }
        let data = data.into_iter().map(|v| 0.214 + v).collect();
        crate::build::show(&format!("{name}_{layer}"), &Picture { width: bw, height: bh, channels: 3, data }, 1.0);
    }
}
