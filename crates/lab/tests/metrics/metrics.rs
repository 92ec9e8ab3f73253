//! Metrics against scikit-image and SciPy on committed pictures (fixtures/metrics/make.py), and
//! against plain reason.

use bouncelight_lab::metrics::{
    self, Comparison, FlipMaps, LayerComparison, MetricError, NAMES, Options, Picture, Views, compare, compare_with,
    heat_color, heat_map, paper, psnr,
};

fn picture(pixels: &[f32], width: usize) -> Picture<'_> {
    Picture::new("test", width, pixels.len() / 3 / width, pixels).expect("sound")
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

fn compare_both(a: &[f32], b: &[f32], width: usize) -> Comparison {
    let views = |p| Views { display: picture(p, width), linear: Some(picture(p, width)) };
    compare(views(a), views(b)).expect("comparable")
}

mod against_scikit_image {
    use super::*;
    use bouncelight_scene::image_io::{Image, read_png};

    const COLUMNS: [(&str, &str); 8] = [
        ("paper_l1", "l1"),
        ("paper_l2", "l2"),
        ("paper_ssim", "paper-ssim"),
        ("paper_fid", "fid"),
        ("psnr", "psnr"),
        ("ssim", "ssim"),
        ("mean_absolute_error", "mae"),
        ("rel_mse", "relmse"),
    ];

    fn load(name: &str) -> Image {
        let path = crate::common::root().join("tests/fixtures/metrics").join(name);
        let image = read_png(&path).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((image.width, image.height, image.channels), (61, 47, 3));
        image
    }

    fn expected() -> Vec<serde_json::Value> {
        let all: serde_json::Value =
            serde_json::from_str(include_str!("../../../../tests/fixtures/metrics/expected.json"))
                .expect("expected.json");
        let pairs = all["pairs"].as_array().expect("pairs").clone();
        assert_eq!(pairs.len(), 4);
        pairs
    }

    /// Relative difference; of numbers below 0.001, which equal pictures give, a thousand times the
    /// absolute one.
    fn off(value: f64, want: f64) -> f64 {
        (value - want).abs() / want.abs().max(1e-3)
    }

    #[test]
    fn numbers_agree() {
        let (mut checked, mut worst) = (0, 0.0f64);
        for pair in expected() {
            let (a, b) = (load(pair["a"].as_str().expect("a")), load(pair["b"].as_str().expect("b")));
            let ours = compare_both(&a.pixels, &b.pixels, 61);
            for (key, name) in COLUMNS {
                let value = ours.value(name).expect("known");
                match pair[key].as_f64() {
                    Some(want) => {
                        worst = worst.max(off(value, want));
                        assert!(off(value, want) < 1e-6, "{key} of {} {}: {value}, not {want}", pair["a"], pair["b"])
                    }
                    None => assert_eq!(value, f64::INFINITY, "{key}"),
                }
                checked += 1;
            }
        }
        println!("largest relative difference of {checked} numbers: {worst:.1e}");
        assert_eq!(checked, 32);
    }

    /// Negative control: one level in one channel of one pixel moves every number away from the
    /// expected one, and so does forgetting the stretch or the paper's data range.
    #[test]
    fn numbers_would_notice() {
        let pair = &expected()[0];
        let (mut a, b) = (load(pair["a"].as_str().expect("a")), load(pair["b"].as_str().expect("b")));
        let (x, y) = (a.pixels.clone(), b.pixels.clone());
        let raw = metrics::ssim(picture(&x, 61), picture(&y, 61), paper::SSIM_DATA_RANGE).expect("comparable");
        for (key, what) in [("paper_ssim", "stretch"), ("ssim", "data range")] {
            assert!(off(raw, pair[key].as_f64().expect("number")) > 1e-3, "forgetting the {what} goes unnoticed");
        }

        let middle = a.pixels.len() / 2;
        a.pixels[middle] += 1.0 / 255.0;
        let changed = compare_both(&a.pixels, &b.pixels, 61);
        for (key, name) in COLUMNS {
            let (value, want) = (changed.value(name).expect("known"), pair[key].as_f64().expect("number"));
            assert!(off(value, want) > 1e-6, "{key} did not move: {value}");
        }
    }
}

#[test]
fn equal_pictures_are_equal() {
    let a = noise(32 * 20 * 3, 1);
    let c = compare_both(&a, &a, 32);
    assert_eq!((c.paper.l1, c.paper.l2, c.display.mean_absolute_error), (0.0, 0.0, 0.0));
    assert!((c.paper.ssim - 1.0).abs() < 1e-12 && (c.display.ssim - 1.0).abs() < 1e-12);
    assert!(c.paper.fid < 1e-12 && c.display.psnr == f64::INFINITY);
    assert_eq!(c.linear.map(|l| l.rel_mse), Some(0.0));
}

#[test]
fn stretch_hides_exposure_and_psnr_does_not() {
    let a = noise(32 * 20 * 3, 2);
    let dim: Vec<f32> = a.iter().map(|v| v * 0.25 + 0.5).collect();
    let c = compare_both(&dim, &a, 32);
    assert!(c.paper.l1 < 1e-2 && c.paper.fid < 1e-9, "{:?}", c.paper);
    assert!(c.display.psnr < 15.0, "{:?}", c.display);
}

#[test]
fn values_known_by_hand() {
    let a = [0.5f32; 8 * 8 * 3];
    let b = [0.6f32; 8 * 8 * 3];
    assert!((psnr(picture(&a, 8), picture(&b, 8)).expect("comparable") - 20.0).abs() < 1e-5);
    let rel = metrics::rel_mse(picture(&a, 8), picture(&b, 8)).expect("comparable");
    assert!((rel - 0.01 / 0.37).abs() < 1e-6);
    // A tenth too dark everywhere; only the sign tells from a tenth too bright.
    let relative = |x: &[f32], y: &[f32]| {
        let (x, y) = (picture(x, 8), picture(y, 8));
        [metrics::mean_relative_error(x, y).expect("comparable"), metrics::bias(x, y).expect("comparable")]
    };
    let dim = b.map(|v| v * 0.9);
    let [mre, bias] = relative(&dim, &b);
    assert!((mre - 0.1).abs() < 1e-6 && (bias + 0.1).abs() < 1e-6, "{mre} {bias}");
    // Half a tenth too dark, half as much too bright: an error without a bias.
    let mut mixed = dim;
    mixed[..96].fill(0.66);
    let [mre, bias] = relative(&mixed, &b);
    assert!((mre - 0.1).abs() < 1e-6 && bias.abs() < 1e-6, "{mre} {bias}");
    assert_eq!(relative(&[0.0; 192], &[0.0; 192]), [0.0, 0.0]);
    assert_eq!(relative(&a, &[0.0; 192]), [f64::INFINITY; 2]);
    // A flat channel stretches to 0 and not to NaN.
    let flat = compare_both(&a, &b, 8);
    assert_eq!((flat.paper.l1, flat.paper.fid), (0.0, 0.0));
    // Flat greys have no variance, so SSIM is its luminance term: 2·0.5·0.6 over 0.5² + 0.6², K1 =
    // 0.01.
    assert!((flat.display.ssim - 0.6001 / 0.6101).abs() < 1e-6);
    // Red is 1 in a share of the pixels and 0 elsewhere, the other channels are flat: the distance
    // is that of two Gaussians on a line, (p − q)² + (σp − σq)², with covariances that have no
    // inverse.
    let share = |count: usize| -> Vec<f32> { (0..100).flat_map(|i| [f32::from(i < count), 0.3, 0.7]).collect() };
    let (few, many) = (share(20), share(50));
    let sigma = |p: f64| (p * (1.0 - p) * 100.0 / 99.0).sqrt();
    let want = 0.09 + (sigma(0.2) - sigma(0.5)).powi(2);
    let fid = paper::fid(picture(&few, 10), picture(&many, 10)).expect("comparable");
    assert!((fid - want).abs() < 1e-9, "{fid}, not {want}");
}

#[test]
fn what_cannot_be_compared_is_refused() {
    let good = noise(8 * 8 * 3, 4);
    let mut bad = good.clone();
    bad[3 * (2 * 8 + 5) + 1] = f32::NAN;
    bad[190] = f32::INFINITY;
    let error = Picture::new("out.exr", 8, 8, &bad).expect_err("NaN");
    assert_eq!(error, MetricError::NonFinite { picture: "out.exr".into(), x: 5, y: 2, channel: 'G', count: 2 });
    assert!(error.to_string().contains("out.exr"));
    for (w, h) in [(8, 7), (0, 0), (usize::MAX, 3)] {
        assert!(matches!(Picture::new("p", w, h, &good), Err(MetricError::Shape { .. })), "{w}×{h}");
    }
    assert!(Picture::new("p", 0, 0, &[]).is_err());
    let layer =
        |size, a: &[f32], b: &[f32]| LayerComparison::new(["a", "b"], size, "Depth", a, b).map(|l| l.linear.bias);
    assert_eq!(layer([2, 1], &[3.0, 5.0], &[2.0, 6.0]), Ok(0.0));
    for (size, a, b) in [([2, 1], 2, 4), ([2, 1], 3, 3), ([0, 1], 2, 2), ([0, 0], 0, 0)] {
        let wrong = layer(size, &good[..a], &good[..b]);
        assert!(matches!(wrong, Err(MetricError::Shape { .. })), "{size:?} {a} {b}");
    }

    let (wide, tall) = (noise(8 * 16 * 3, 5), noise(8 * 16 * 3, 5));
    let (a, b) = (picture(&wide, 16), picture(&tall, 8));
    let errors = [
        paper::l1(a, b).err(),
        paper::l2(a, b).err(),
        paper::ssim(a, b).err(),
        paper::fid(a, b).err(),
        psnr(a, b).err(),
        metrics::ssim(a, b, 1.0).err(),
        metrics::mean_absolute_error(a, b).err(),
        metrics::rel_mse(a, b).err(),
        metrics::mean_relative_error(a, b).err(),
        metrics::bias(a, b).err(),
        heat_map(a, b, 1.0).err(),
        compare(Views { display: a, linear: None }, Views { display: b, linear: None }).err(),
    ];
    for error in errors {
        let words = error.expect("different sizes").to_string();
        assert!(words.contains("16×8") && words.contains("8×16"), "{words}");
    }
    let small = noise(6 * 6 * 3, 6);
    let small = picture(&small, 6);
    assert!(matches!(metrics::ssim(small, small, 1.0), Err(MetricError::TooSmall { width: 6, .. })));
    let dot = [0.5; 3];
    assert!(matches!(paper::fid(picture(&dot, 1), picture(&dot, 1)), Err(MetricError::TooSmall { .. })));
}

#[test]
fn record_is_json_with_schema() {
    let (a, b) = (noise(8 * 8 * 3, 7), noise(8 * 8 * 3, 8));
    let views = |p| Views { display: picture(p, 8), linear: Some(picture(p, 8)) };
    let cheap = Options { flip: false, hdr_flip: false, ..Options::default() };
    let (quick, maps) = compare_with(views(&a), views(&b), cheap).expect("comparable");
    assert_eq!((maps, quick.value("flip"), quick.value("hdrflip")), (FlipMaps::default(), None, None));
    let json = serde_json::to_value(&quick).expect("serialises");
    assert!(json["flip"].is_null() && json["hdr_flip"].is_null());
    let c = compare_both(&a, &b, 8);
    let json = serde_json::to_value(&c).expect("serialises");
    assert_eq!(json["schema"], 1);
    assert_eq!(json["width"], 8);
    assert!(json["paper"]["l1"].is_f64() && json["display"]["psnr"].is_f64() && json["linear"]["rel_mse"].is_f64());
    assert!(json["flip"].is_f64() && json["hdr_flip"]["mean"].is_f64() && json["linear"]["bias"].is_f64());
    assert!(json["hdr_flip"]["exposures"]["count"].is_u64() && json["pixels_per_degree"].is_f64());
    for (name, more_is_better) in NAMES {
        let value = c.value(name).expect("every listed name").abs();
        assert_eq!(c.passes(name, value), Some(true));
        assert_eq!(c.passes(name, value - 0.5), Some(more_is_better), "{name}");
    }
    assert_eq!((c.value("lpips"), c.passes("lpips", 1.0)), (None, None));
}

#[test]
fn heat_grows_lighter_and_shows_the_place() {
    let luma = |c: [u8; 3]| 0.2126 * f32::from(c[0]) + 0.7152 * f32::from(c[1]) + 0.0722 * f32::from(c[2]);
    let ramp: Vec<f32> = (0..=100).map(|i| luma(heat_color(i as f32 / 100.0))).collect();
    assert!(ramp.windows(2).all(|w| w[1] >= w[0]), "lightness rises");
    assert!(ramp[0] < 5.0 && ramp[100] > 200.0);
    let a = vec![0.5f32; 8 * 8 * 3];
    let mut b = a.clone();
    b[3 * 20..3 * 21].fill(0.75);
    let map = heat_map(picture(&a, 8), picture(&b, 8), 0.25).expect("same size");
    assert_eq!(map.len(), 192);
    assert_eq!(map[60..63], heat_color(1.0));
    assert!(map.chunks_exact(3).enumerate().all(|(i, p)| i == 20 || p == heat_color(0.0)));
}
