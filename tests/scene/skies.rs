//! Pictures of the surroundings of every kind that their formats allow.

use bouncelight::scene::Environment;
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
    let (environment, _) = Environment::load(&path).map_err(|e| e.to_string())?;
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
