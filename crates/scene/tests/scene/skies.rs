//! Pictures of the surroundings of every kind that their formats allow.

use bouncelight::scene::environment::EnvironmentImage;

use crate::glb::put;

const WIDTH: usize = 16;
const HEIGHT: usize = 8;

/// RGBE: bright above the horizon, a coloured block in it, blue below.
fn texel(x: usize, y: usize) -> [u8; 4] {
    match (x, y) {
        (4..8, 0..4) => [128, 32, 32, 130],
        (_, 0..4) => [128, 128, 128, 129],
        _ => [8, 8, 64, 129],
    }
}

fn rows(of: impl Fn(usize, usize) -> [u8; 4]) -> Vec<u8> {
    (0..HEIGHT).flat_map(|y| (0..WIDTH).map(move |x| (x, y))).flat_map(|(x, y)| of(x, y)).collect()
}

#[track_caller]
fn load(header: &str, pixels: &[u8]) -> Result<EnvironmentImage, String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = put(folder.path(), "sky.hdr", &[header.as_bytes(), pixels].concat());
    let (environment, _) = bouncelight_scene::sky::load(&path).map_err(|e| e.to_string())?;
    Ok(EnvironmentImage::clone(environment.image.as_ref().expect("a picture")))
}

const HEADER: &str = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 8 +X 16\n";

/// Scanlines in the newer run-length coding.
fn packed() -> Vec<u8> {
    let mut out = Vec::new();
    for y in 0..HEIGHT {
        out.extend([2, 2, 0, WIDTH as u8]);
        for channel in 0..4 {
            out.extend([4]);
            out.extend((0..4).map(|x| texel(x, y)[channel]));
            out.extend([128 + 4, texel(4, y)[channel], 128 + 8, texel(8, y)[channel]]);
        }
    }
    out
}

/// Scanlines in the older one: a pixel, and how often it is repeated.
fn repeated() -> Vec<u8> {
    let row = |y| [[texel(0, y), [1, 1, 1, 3]], [texel(4, y), [1, 1, 1, 3]], [texel(8, y), [1, 1, 1, 7]]];
    (0..HEIGHT).flat_map(row).flatten().flatten().collect()
}

#[test]
fn radiance_pictures_of_every_kind() {
    let flat = rows(texel);
    let plain = load(HEADER, &flat).expect("it loads");
    assert_eq!((plain.width, plain.height), (16, 8));
    assert_eq!((&plain.rgb[..3], &plain.rgb[12..15]), (&[1.0; 3][..], &[2.0, 0.5, 0.5][..]));
    let (last_x, last_y) = (WIDTH - 1, HEIGHT - 1);
    let columns: Vec<u8> =
        (0..WIDTH).flat_map(|x| (0..HEIGHT).map(move |y| (x, y))).flat_map(|(x, y)| texel(x, y)).collect();
    let sized = |size: &str| HEADER.replace("-Y 8 +X 16", size);
    let twice = rows(|x, y| {
        let [r, g, b, e] = texel(x, y);
        [r, g, b, e + 1]
    });
    let same = [
        ("packed", HEADER.to_owned(), packed()),
        ("repeated", HEADER.to_owned(), repeated()),
        ("signature", HEADER.replace("RADIANCE", "RGBE"), flat.clone()),
        ("CRLF", HEADER.replace('\n', "\r\n"), flat.clone()),
        (
            "comments",
            HEADER.replace("FORMAT", "# made by hand\nSOFTWARE=a test\nVIEW= -vtv\nGAMMA=1\nFORMAT"),
            flat.clone(),
        ),
        ("no format", HEADER.replace("FORMAT=32-bit_rle_rgbe\n", ""), flat.clone()),
        ("bottom up", sized("+Y 8 +X 16"), rows(|x, y| texel(x, last_y - y))),
        ("mirrored", sized("-Y 8 -X 16"), rows(|x, y| texel(last_x - x, y))),
        ("turned round", sized("+Y 8 -X 16"), rows(|x, y| texel(last_x - x, last_y - y))),
        ("columns", sized("+X 16 -Y 8"), columns),
        ("exposure", HEADER.replace("FORMAT", "EXPOSURE=4\nEXPOSURE= 0.5\nFORMAT"), twice.clone()),
        ("colours", HEADER.replace("FORMAT", "COLORCORR=2 2 2\nFORMAT"), twice.clone()),
    ];
    for (name, header, pixels) in same {
        let picture = load(&header, &pixels).unwrap_or_else(|e| panic!("{name}: {e}"));
        assert_eq!((picture.width, picture.height), (16, 8), "{name}");
        assert!(picture.rgb == plain.rgb, "{name}");
    }
    // Negative controls: exposures and directions that are not there are not taken out.
    assert!(load(HEADER, &twice).expect("it loads").rgb != plain.rgb);
    assert!(load(&sized("+Y 8 +X 16"), &flat).expect("it loads").rgb != plain.rgb);
    // White of D65 as XYZE.
    let white = load(&HEADER.replace("rgbe", "xyze"), &rows(|_, _| [121, 128, 139, 129])).expect("it loads");
    assert!(white.rgb.iter().all(|v| (v - 1.0).abs() < 0.02), "{:?}", &white.rgb[..3]);
}

#[test]
fn radiance_pictures_that_are_not_whole_or_none() {
    let refused = |header: &str, pixels: &[u8], words: &[&str]| {
        let told = load(header, pixels).map(drop).expect_err("it is refused");
        assert!(words.iter().all(|w| told.contains(w)) && told.contains("sky.hdr"), "{told}");
    };
    for whole in [rows(texel), packed(), repeated()] {
        assert!(load(HEADER, &whole).is_ok());
        refused(HEADER, &whole[..whole.len() - 1], &["truncated", "scanline 7 of 8"]);
        refused(HEADER, &[], &["truncated", "scanline 0 of 8"]);
    }
    refused("#?RADIANCE\n", &[], &["header has no end"]);
    refused(&HEADER.replace("rgbe", "rgb"), &[], &["FORMAT"]);
    for size in ["-Y 8", "-Y 8 +Y 8", "-Y 0 +X 16", "8 16", "-Y x +X 16", "-Y 99999999999 +X 1"] {
        refused(&HEADER.replace("-Y 8 +X 16", size), &[], &["size"]);
    }
    refused(&HEADER.replace("-Y 8 +X 16", "-Y 100000 +X 100000"), &[], &["more than"]);
    refused(&HEADER.replace("FORMAT", "EXPOSURE=0\nFORMAT"), &rows(texel), &["EXPOSURE"]);
    refused(HEADER, &[1, 1, 1, 4], &["begins with a repetition"]);
    refused(HEADER, &[9, 9, 9, 9, 1, 1, 1, 200], &["longer than its scanline"]);
    refused(HEADER, &[2, 2, 0, 17], &["length other than 16"]);
}

/// Channels of an EXR: its layer's names, where its pixels lie, and the picture that it shows.
fn exr_with(
    names: &[&str],
    first: [i32; 2],
    size: [usize; 2],
    of: impl Fn(usize, usize) -> [f32; 3],
) -> Result<EnvironmentImage, String> {
    use exr::prelude::*;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("sky.exr");
    let channel = |(c, name): (usize, &&str)| {
        let values = (0..size[0] * size[1]).map(|i| of(i % size[0], i / size[0])[c.min(2)]).collect();
        AnyChannel::new(Text::from(*name), FlatSamples::F32(values))
    };
    let channels = AnyChannels::sort(names.iter().enumerate().map(channel).collect());
    let attributes = LayerAttributes { layer_position: Vec2(first[0], first[1]), ..LayerAttributes::default() };
    let layer = exr::prelude::Layer::new(Vec2(size[0], size[1]), attributes, Encoding::UNCOMPRESSED, channels);
    let shown = IntegerBounds::from_dimensions(Vec2(WIDTH, HEIGHT));
    let image = exr::prelude::Image::empty(ImageAttributes::new(shown)).with_layer(layer);
    image.write().to_file(&path).expect("it is written");
    let (environment, _) = bouncelight_scene::sky::load(&path).map_err(|e| e.to_string())?;
    Ok(EnvironmentImage::clone(environment.image.as_ref().expect("a picture")))
}

#[test]
fn exr_pictures_of_every_kind() {
    let ramp = |x: usize, y: usize| [x as f32, y as f32, 0.5];
    let whole = [WIDTH, HEIGHT];
    let plain = exr_with(&["R", "G", "B"], [0, 0], whole, ramp).expect("it loads");
    assert_eq!((plain.width, plain.height, &plain.rgb[3 * 17..3 * 18]), (16, 8, &[1.0, 1.0, 0.5][..]));
    for names in [
        ["r", "g", "b"],
        ["sky.R", "sky.G", "sky.B"],
        ["sky.r", "sky.g", "sky.b"],
        ["ViewLayer.Combined.R", "ViewLayer.Combined.G", "ViewLayer.Combined.B"],
    ] {
        assert!(exr_with(&names, [0, 0], whole, ramp).expect("it loads").rgb == plain.rgb, "{names:?}");
    }
    // Luminance, alone and with alpha: grey.
    let grey = |x: usize, y: usize| [(x + y) as f32, 1.0, 1.0];
    for names in [&["Y"][..], &["Y", "A"], &["y", "a"]] {
        let picture = exr_with(names, [0, 0], whole, grey).expect("it loads");
        assert!(picture.rgb.chunks_exact(3).enumerate().all(|(i, p)| p == [(i % 16 + i / 16) as f32; 3]), "{names:?}");
    }
    // Pixels that are a part of what is shown, or more than it.
    let moved =
        |dx: i64, dy: i64| move |x: usize, y: usize| [(x as i64 + dx + 100) as f32, (y as i64 + dy + 100) as f32, 0.5];
    let placed = exr_with(&["R", "G", "B"], [0, 0], whole, moved(0, 0)).expect("it loads");
    let cropped = exr_with(&["R", "G", "B"], [3, 2], [8, 4], moved(3, 2)).expect("it loads");
    for (i, (have, full)) in cropped.rgb.chunks_exact(3).zip(placed.rgb.chunks_exact(3)).enumerate() {
        let inside = (3..11).contains(&(i % 16)) && (2..6).contains(&(i / 16));
        assert_eq!(have, if inside { full } else { &[0.0; 3] }, "{i}");
    }
    assert_eq!((cropped.width, cropped.height), (16, 8));
    let overscan = exr_with(&["R", "G", "B"], [-4, -3], [30, 20], moved(-4, -3)).expect("it loads");
    assert!(overscan.rgb == placed.rgb && (overscan.width, overscan.height) == (16, 8));
    let beside = exr_with(&["R", "G", "B"], [40, -30], [4, 4], ramp).expect("it loads");
    assert!(beside.rgb.iter().all(|v| *v == 0.0));
    // A few bytes do not claim a great window.
    let claimed = exr_with(&["R", "G", "B"], [0, 0], [1 << 12, 1], ramp).expect("it loads");
    assert_eq!((claimed.width, claimed.height), (16, 8));
    // Negative controls: no picture of light, and two of them.
    for names in [&["Depth.Z"][..], &["Normal.X", "Normal.Y", "Normal.Z"], &["a.R", "a.G", "a.B", "b.R", "b.G", "b.B"]]
    {
        let told = exr_with(names, [0, 0], whole, ramp).map(drop).expect_err("it is refused");
        assert!(told.contains("sky.exr") && told.contains(names[0].split('.').next().expect("a name")), "{told}");
    }
}
