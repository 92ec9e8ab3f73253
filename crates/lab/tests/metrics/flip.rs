//! FLIP and HDR-FLIP against NVIDIA's own evaluator on committed pictures
//! (fixtures/metrics/flip/make.py), and against plain reason.

use bouncelight_lab::metrics::{
    MetricError, Picture,
    flip::{FlipMap, PIXELS_PER_DEGREE, exposures, flip, hdr_flip},
    heat_color,
};

fn picture(pixels: &[f32], width: usize) -> Picture<'_> {
    Picture::new("test", width, pixels.len() / 3 / width, pixels).expect("sound")
}

fn ldr(a: &[f32], b: &[f32], width: usize) -> FlipMap {
    flip(picture(a, width), picture(b, width), PIXELS_PER_DEGREE).expect("comparable")
}

fn hdr(a: &[f32], b: &[f32], width: usize) -> FlipMap {
    hdr_flip(picture(a, width), picture(b, width), PIXELS_PER_DEGREE).expect("comparable").0
}

/// Repeatable noise in [0, 1].
fn noise(count: usize, seed: u32) -> Vec<f32> {
    (0..count as u32)
        .map(|i| {
            let h = (i ^ seed.wrapping_mul(0x9e37_79b9)).wrapping_mul(0x85eb_ca6b);
            ((h ^ (h >> 13)).wrapping_mul(0xc2b2_ae35) >> 8) as f32 / (1 << 24) as f32
        })
        .collect()
}

mod against_the_reference {
    use super::*;
    use bouncelight_lab::metrics;
    use bouncelight_scene::image_io::{self, Decoded};
    use serde_json::Value;

    struct Pair {
        a: Vec<f32>,
        b: Vec<f32>,
        width: usize,
        ppd: f32,
        expected: Value,
        map: Vec<f32>,
    }

    fn load(name: &str) -> (Vec<f32>, usize) {
        let path = crate::common::root().join("tests/fixtures/metrics/flip").join(name);
        let image = match image_io::read(&path).unwrap_or_else(|e| panic!("{e}")) {
            Decoded::Display(image) => image,
            Decoded::Linear(layers) => layers.image("Combined").unwrap_or_else(|e| panic!("{e}")),
        };
        (image.to_rgb(), image.width as usize)
    }

    fn pairs(kind: &str, count: usize) -> Vec<Pair> {
        let all: Value = serde_json::from_str(include_str!("../../../../tests/fixtures/metrics/flip/expected.json"))
            .expect("expected.json");
        let rows = all[kind].as_array().expect("rows").clone();
        assert_eq!(rows.len(), count);
        rows.into_iter()
            .map(|row| {
                let name = |key: &str| row[key].as_str().expect("a file's name").to_string();
                let ((a, width), (b, _), (map, _)) = (load(&name("a")), load(&name("b")), load(&name("map")));
                let ppd = row["pixels_per_degree"].as_f64().expect("number") as f32;
                Pair { a, b, width, ppd, map: map.into_iter().step_by(3).collect(), expected: row }
            })
            .collect()
    }

    /// Distance from the expected mean, and the largest distance of a pixel.
    fn off(map: &FlipMap, pair: &Pair) -> (f64, f32) {
        assert_eq!(map.values.len(), pair.map.len());
        let worst = map.values.iter().zip(&pair.map).map(|(v, want)| (v - want).abs()).fold(0.0, f32::max);
        ((map.mean() - pair.expected["mean"].as_f64().expect("number")).abs(), worst)
    }

    #[test]
    fn ldr_agrees() {
        for pair in pairs("ldr", 8) {
            let (a, b) = (picture(&pair.a, pair.width), picture(&pair.b, pair.width));
            let (mean, pixel) = off(&flip(a, b, pair.ppd).expect("comparable"), &pair);
            println!("{} {}: mean off by {mean:.1e}, worst pixel by {pixel:.1e}", pair.expected["a"], pair.ppd);
            assert!(mean < 2e-6 && pixel < 1e-4, "{}: {mean:e} {pixel:e}", pair.expected);
        }
    }

    #[test]
    fn hdr_agrees() {
        for pair in pairs("hdr", 4) {
            let (a, b) = (picture(&pair.a, pair.width), picture(&pair.b, pair.width));
            let (map, range) = hdr_flip(a, b, pair.ppd).expect("comparable");
            let (mean, pixel) = off(&map, &pair);
            println!("{} {}: mean off by {mean:.1e}, worst pixel by {pixel:.1e}", pair.expected["a"], pair.ppd);
            assert!(mean < 2e-6 && pixel < 1e-4, "{}: {mean:e} {pixel:e}", pair.expected);
            for (ours, key) in [(range.start, "start"), (range.stop, "stop"), (range.count as f32, "count")] {
                let want = pair.expected[key].as_f64().expect("number") as f32;
                assert!((ours - want).abs() < 1e-5, "{key}: {ours}, not {want}");
            }
        }
    }

    /// The other metrics of radiance, against numpy.
    #[test]
    fn linear_metrics_agree() {
        for pair in pairs("hdr", 4) {
            let (a, b) = (picture(&pair.a, pair.width), picture(&pair.b, pair.width));
            for (ours, key) in [
                (metrics::rel_mse(a, b), "rel_mse"),
                (metrics::mean_absolute_error(a, b), "mean_absolute_error"),
                (metrics::mean_relative_error(a, b), "mean_relative_error"),
                (metrics::bias(a, b), "bias"),
            ] {
                let ours = ours.expect("comparable");
                let want = pair.expected[key].as_f64().expect("number");
                assert!((ours - want).abs() < 1e-6 * want.abs(), "{key} of {}: {ours}, not {want}", pair.expected["a"]);
            }
        }
    }

    /// Negative controls: what a wrong implementation might forget moves the numbers beyond the
    /// tolerance.
    #[test]
    fn mistakes_would_be_noticed() {
        let pair = &pairs("ldr", 8)[0];
        let tell = |a: &[f32], b: &[f32], ppd| {
            let (mean, pixel) =
                off(&flip(picture(a, pair.width), picture(b, pair.width), ppd).expect("comparable"), pair);
            assert!(mean > 2e-5 || pixel > 4e-4, "{mean:e} {pixel:e}");
        };
        // One level in one channel of one pixel; another viewing distance; linear values taken for
        // display values.
        let mut touched = pair.a.clone();
        touched[3 * (20 * pair.width + 30) + 1] += 1.0 / 255.0;
        tell(&touched, &pair.b, pair.ppd);
        tell(&pair.a, &pair.b, pair.ppd * 1.01);
        let squared = |p: &[f32]| p.iter().map(|v| v * v).collect::<Vec<_>>();
        tell(&squared(&pair.a), &squared(&pair.b), pair.ppd);

        let pair = &pairs("hdr", 4)[1];
        let (a, b) = (picture(&pair.a, pair.width), picture(&pair.b, pair.width));
        let swapped = off(&hdr_flip(b, a, pair.ppd).expect("comparable").0, pair);
        assert!(swapped.0 > 1e-4, "the reference chooses the exposures: {swapped:?}");
        let clipped: Vec<f32> = pair.b.iter().map(|v| v.min(4.0)).collect();
        let range = exposures(picture(&clipped, pair.width));
        assert!((f64::from(range.start) - pair.expected["start"].as_f64().expect("number")).abs() > 1.0);
    }
}

#[test]
fn equal_pictures_differ_by_nothing() {
    let a = noise(40 * 30 * 3, 1);
    assert!(ldr(&a, &a, 40).values.iter().all(|&v| v == 0.0));
    let bright: Vec<f32> = a.iter().map(|v| v * 200.0).collect();
    assert!(hdr(&bright, &bright, 40).values.iter().all(|&v| v == 0.0));
}

#[test]
fn ldr_is_symmetric_and_stays_in_range() {
    let (a, b) = (noise(37 * 21 * 3, 2), noise(37 * 21 * 3, 3));
    let (there, back) = (ldr(&a, &b, 37), ldr(&b, &a, 37));
    assert_eq!(there, back);
    let (black, white) = (vec![0.0; 12 * 9 * 3], vec![1.0; 12 * 9 * 3]);
    let most = ldr(&black, &white, 12);
    for map in [&there, &most, &hdr(&black, &white, 12)] {
        assert!(map.values.iter().all(|v| (0.0..=1.0).contains(v)));
    }
    assert!(most.mean() > 0.9 && there.mean() > 0.1 && there.mean() < most.mean());
    // A checkerboard against its inverse: the strongest edges and points there are.
    let board =
        |odd: usize| -> Vec<f32> { (0..16 * 16).flat_map(|i| [((i % 16 + i / 16 + odd) % 2) as f32; 3]).collect() };
    assert!(ldr(&board(0), &board(1), 16).values.iter().all(|v| (0.0..=1.0).contains(v)));
}

#[test]
fn it_is_the_same_seen_in_a_mirror_or_turned() {
    let (w, h) = (23, 14);
    let (a, b) = (noise(w * h * 3, 4), noise(w * h * 3, 5));
    let moved = |p: &[f32], f: fn(usize, usize) -> (usize, usize), width: usize| -> Vec<f32> {
        let mut out = vec![0.0; p.len()];
        for i in 0..p.len() / 3 {
            let (x, y) = f(i % 23, i / 23);
            out[3 * (y * width + x)..][..3].copy_from_slice(&p[3 * i..][..3]);
        }
        out
    };
    let straight = ldr(&a, &b, w).mean();
    let mirrored = ldr(&moved(&a, |x, y| (22 - x, y), w), &moved(&b, |x, y| (22 - x, y), w), w).mean();
    let turned = ldr(&moved(&a, |x, y| (y, x), h), &moved(&b, |x, y| (y, x), h), h).mean();
    assert!((straight - mirrored).abs() < 1e-5 && (straight - turned).abs() < 1e-5, "{straight} {mirrored} {turned}");
}

#[test]
fn the_eye_forgives_from_afar() {
    // Fine noise against its own mean: a viewer further away (more pixels in a degree) sees less of
    // it.
    let grain: Vec<f32> = noise(64 * 48, 6).into_iter().flat_map(|v| [0.4 + 0.2 * v; 3]).collect();
    let flat = vec![0.5; grain.len()];
    let at = |ppd| flip(picture(&grain, 64), picture(&flat, 64), ppd).expect("comparable").mean();
    let [near, default, far] = [at(20.0), at(PIXELS_PER_DEGREE), at(250.0)];
    assert!(near > default && default > far, "{near} {default} {far}");
}

#[test]
fn hdr_sees_what_one_exposure_hides() {
    // Two lamps of 20 and 40: both white on a display, an error of a factor of two in light.
    let scene = |lamp: f32| -> Vec<f32> {
        (0..48 * 32).flat_map(|i| if i % 48 < 12 { [lamp; 3] } else { [0.3, 0.25, 0.2] }).collect()
    };
    let (dim, bright) = (scene(20.0), scene(40.0));
    let shown = |p: &[f32]| p.iter().map(|v| v.min(1.0)).collect::<Vec<_>>();
    assert_eq!(ldr(&shown(&dim), &shown(&bright), 48).mean(), 0.0);
    let map = hdr(&dim, &bright, 48);
    let (lamp, wall) = (map.values[16 * 48 + 4], map.values[16 * 48 + 40]);
    assert!(lamp > 0.1 && wall < 0.01, "{lamp} {wall}");
}

#[test]
fn small_dark_and_extreme_pictures_have_a_number() {
    let shapes = [(1, 1), (2, 1), (1, 7), (3, 2)];
    let values = [0.0, 1e-30, 0.5, 1e9, f32::MAX, -3.0];
    for (w, h) in shapes {
        for a in values {
            for b in values {
                let (a, b) = (vec![a; w * h * 3], vec![b; w * h * 3]);
                for ppd in [0.01, PIXELS_PER_DEGREE] {
                    let l = flip(picture(&a, w), picture(&b, w), ppd).expect("comparable");
                    let (m, range) = hdr_flip(picture(&a, w), picture(&b, w), ppd).expect("comparable");
                    assert!(l.values.iter().chain(&m.values).all(|v| (0.0..=1.0).contains(v)), "{a:?} {b:?}");
                    assert!(range.start.is_finite() && range.stop >= range.start && range.count >= 2, "{range:?}");
                }
            }
        }
    }
    // In a flat picture every pixel counts the same.
    let map = ldr(&[0.3; 5 * 4 * 3], &[0.6; 5 * 4 * 3], 5);
    assert!(map.values.iter().all(|v| (v - map.values[0]).abs() < 1e-5) && map.values[0] > 0.1);
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let (wide, tall) = (noise(8 * 16 * 3, 7), noise(8 * 16 * 3, 7));
    let (a, b) = (picture(&wide, 16), picture(&tall, 8));
    assert!(matches!(flip(a, b, PIXELS_PER_DEGREE), Err(MetricError::Sizes { .. })));
    assert!(matches!(hdr_flip(a, b, PIXELS_PER_DEGREE), Err(MetricError::Sizes { .. })));
    for ppd in [0.0, -1.0, f32::NAN, f32::INFINITY, 1e6] {
        assert!(matches!(flip(a, a, ppd), Err(MetricError::PixelsPerDegree { .. })), "{ppd}");
        assert!(hdr_flip(a, a, ppd).is_err());
    }
}

#[test]
fn heat_map_shows_the_place() {
    let a = vec![0.5; 40 * 40 * 3];
    let mut b = a.clone();
    b[3 * (20 * 40 + 20)..][..3].copy_from_slice(&[1.0, 0.0, 0.0]);
    let map = ldr(&a, &b, 40);
    let heat = map.heat_map();
    assert_eq!(heat.len(), a.len());
    assert_eq!(heat[..3], heat_color(0.0));
    let hottest = (0..1600).max_by(|&i, &j| map.values[i].total_cmp(&map.values[j])).expect("pixels");
    assert!((hottest % 40).abs_diff(20) < 2 && (hottest / 40).abs_diff(20) < 2, "{hottest}");
    assert!(heat[3 * hottest] > heat[0]);
}
