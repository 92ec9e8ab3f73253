//! Picture files: what is written reads back, what is broken is refused in words, nothing is left
//! half-written.

use crate::common;
use bouncelight_scene::image_io::{
    self, Decoded, ImageError, Layer, read_exr, read_png, write_exr, write_png, write_whole,
};
use std::path::{Path, PathBuf};

const W: u32 = 37;
const H: u32 = 21;

/// Repeatable values that cover small, large and negative numbers.
fn values(count: usize, seed: u32) -> Vec<f32> {
    (0..count).map(|i| ((i as u32 * 7919 + seed * 104_729) % 10_007) as f32 / 10_007.0 * 4.0 - 1.0).collect()
}

fn layers() -> Vec<Layer> {
    let n = (W * H) as usize;
    vec![
        Layer::new("", "RGBA", &values(4 * n, 1)),
        Layer::new("DiffDir", "RGB", &values(3 * n, 2)),
        Layer::new("Normal", "XYZ", &values(3 * n, 3)),
        Layer::new("Depth", "Z", &values(n, 4).iter().map(|v| v * 12_345.678).collect::<Vec<_>>()),
        Layer::new("Position", "XYZ", &values(3 * n, 5)),
        Layer::new("Motion", "XY", &values(2 * n, 6)),
    ]
}

fn metadata() -> Vec<(String, String)> {
    [("Software", "bouncelight"), ("adapter", "llvmpipe (LLVM 15)"), ("command line", "render Küche.glb → 光.exr")]
        .map(|(k, v)| (k.to_string(), v.to_string()))
        .to_vec()
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

/// Names in `folder`, to see that no temporary file stays.
fn entries(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .expect("folder")
        .map(|e| e.expect("entry").file_name().to_string_lossy().into())
        .collect();
    names.sort();
    names
}

fn exr_in(folder: &Path) -> (PathBuf, Vec<u8>) {
    let path = folder.join("a.exr");
    write_exr(&path, W, H, &layers(), &metadata()).expect("written");
    let bytes = std::fs::read(&path).expect("there");
    (path, bytes)
}

fn png_in(folder: &Path) -> (PathBuf, Vec<u8>) {
    let path = folder.join("a.png");
    let rgb: Vec<u8> = (0..W * H * 3).map(|i| (i * 31 % 256) as u8).collect();
    write_png(&path, W, H, &rgb, &metadata()).expect("written");
    let bytes = std::fs::read(&path).expect("there");
    (path, bytes)
}

#[test]
fn exr_comes_back_layer_by_layer() {
    let dir = folder();
    let (path, _) = exr_in(dir.path());
    let read = read_exr(&path).expect("readable");
    assert_eq!((read.width, read.height, read.layers.len()), (W, H, 6));
    for layer in layers() {
        let got = read.layer(&layer.name).expect("layer");
        assert_eq!(got.channels.len(), layer.channels.len());
        let exact = ["Depth", "Position", "Motion"].contains(&layer.name.as_str());
        for ((name, want), (got_name, got)) in layer.channels.iter().zip(&got.channels) {
            assert_eq!(name, got_name);
            for (w, g) in want.iter().zip(got) {
                let allowed = if exact { 0.0 } else { w.abs() / 2048.0 + 1e-7 };
                assert!((w - g).abs() <= allowed, "{} {name}: {w} came back as {g}", layer.name);
            }
        }
    }
    for (key, value) in metadata() {
        assert!(read.metadata.contains(&(key.clone(), value)), "metadata `{key}`");
    }
    assert_eq!(entries(dir.path()), ["a.exr"]);
}

#[test]
fn half_layers_clamp_instead_of_overflowing_and_keep_nan() {
    let dir = folder();
    let path = dir.path().join("bright.exr");
    let layer = Layer::new("", "RGB", &[1e9, -1e9, 0.5, f32::NAN, f32::INFINITY, 0.0]);
    write_exr(&path, 2, 1, &[layer], &[]).expect("written");
    let read = read_exr(&path).expect("readable");
    let pixels = read.image("").expect("beauty").pixels;
    assert_eq!(pixels[..3], [65504.0, -65504.0, 0.5]);
    assert!(pixels[3].is_nan() && pixels[4] == f32::INFINITY);
    match read.check_finite("").expect_err("two bad values") {
        ImageError::NonFinite { x: 1, y: 0, count: 2, channel, .. } => assert_eq!(channel, "R"),
        other => panic!("{other}"),
    }
}

#[test]
fn png_comes_back_with_metadata() {
    let dir = folder();
    let (path, _) = png_in(dir.path());
    let (image, text) = image_io::read_png_with_metadata(&path).expect("readable");
    assert_eq!((image.width, image.height, image.channels), (W, H, 3));
    let back: Vec<u32> = image.pixels.iter().map(|v| (v * 255.0).round() as u32).collect();
    assert_eq!(back, (0..W * H * 3).map(|i| i * 31 % 256).collect::<Vec<_>>());
    for pair in metadata() {
        assert!(text.contains(&pair), "{pair:?}");
    }
    assert_eq!(entries(dir.path()), ["a.png"]);
}

#[test]
fn png_of_every_depth_becomes_floats() {
    let dir = folder();
    let path = dir.path().join("deep.png");
    let encode = |color, depth, data: &[u8]| {
        let mut bytes = Vec::new();
        let mut encoder = png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.write_header().and_then(|mut w| w.write_image_data(data)).expect("encodes");
        std::fs::write(&path, bytes).expect("written");
        read_png(&path).expect("readable")
    };
    let grey16 = encode(png::ColorType::Grayscale, png::BitDepth::Sixteen, &[0x80, 0x00, 0xff, 0xff]);
    assert_eq!((grey16.channels, grey16.pixels[0], grey16.pixels[5]), (3, 32768.0 / 65535.0, 1.0));
    let rgba16 =
        encode(png::ColorType::Rgba, png::BitDepth::Sixteen, &[0, 1, 0, 2, 0, 3, 255, 255, 1, 0, 2, 0, 3, 0, 255, 255]);
    assert_eq!((rgba16.channels, rgba16.pixels[1]), (4, 2.0 / 65535.0));
    assert_eq!(rgba16.to_rgb().len(), 6);
    let bits = encode(png::ColorType::Grayscale, png::BitDepth::One, &[0b0100_0000]);
    assert_eq!(bits.pixels, [0.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
}

#[test]
fn kind_is_told_by_content_and_not_by_name() {
    let dir = folder();
    let (png, _) = png_in(dir.path());
    let swapped = dir.path().join("really_a_png.exr");
    std::fs::rename(png, &swapped).expect("renamed");
    assert!(matches!(image_io::read(&swapped), Ok(Decoded::Display(_))));
    assert!(matches!(read_exr(&swapped), Err(ImageError::NotThisFormat { expected: "an EXR", .. })));
    let (exr, _) = exr_in(dir.path());
    assert!(matches!(image_io::read(&exr), Ok(Decoded::Linear(_))));
    assert!(matches!(read_png(&exr), Err(ImageError::NotThisFormat { expected: "a PNG", .. })));
}

#[test]
fn bad_files_are_errors_that_name_them() {
    let dir = folder();
    let path = dir.path().join("broken.bin");
    let check = |bytes: Option<&[u8]>, words: &str| {
        if let Some(bytes) = bytes {
            std::fs::write(&path, bytes).expect("written");
        }
        for error in [read_exr(&path).err(), read_png(&path).err(), image_io::read(&path).err()] {
            let error = error.expect("refused").to_string();
            assert!(error.contains("broken.bin") && error.contains(words), "{error}");
        }
    };
    check(None, "cannot be read");
    check(Some(b""), "empty");
    check(Some(b"P6 1 1 255 not an image of ours"), "not a");
    let message = read_exr(dir.path()).expect_err("a folder").to_string();
    assert!(message.contains("folder"), "{message}");
}

#[test]
fn every_truncation_is_an_error() {
    let dir = folder();
    let (path, bytes) = exr_in(dir.path());
    let mut tried = 0;
    for length in (1..bytes.len()).step_by(97) {
        std::fs::write(&path, &bytes[..length]).expect("written");
        assert!(read_exr(&path).is_err(), "EXR cut to {length} of {} bytes was read", bytes.len());
        tried += 1;
    }
    let (path, bytes) = png_in(dir.path());
    for length in 1..bytes.len() {
        std::fs::write(&path, &bytes[..length]).expect("written");
        assert!(read_png(&path).is_err(), "PNG cut to {length} of {} bytes was read", bytes.len());
        tried += 1;
    }
    assert!(tried > 500, "{tried} truncations");
}

/// Damage may go unnoticed inside pixels, but it must never panic or hang.
#[test]
fn damaged_bytes_never_panic() {
    let dir = folder();
    for (path, bytes) in [exr_in(dir.path()), png_in(dir.path())] {
        for step in 0..400usize {
            let mut damaged = bytes.clone();
            // The first kilobyte (headers, tables) gets every second hit.
            let span = if step % 2 == 0 { bytes.len().min(1024) } else { bytes.len() };
            let at = step * 7919 % span;
            damaged[at] ^= 1 << (step % 8);
            damaged[(at + 1) % bytes.len()] = 0xff;
            std::fs::write(&path, &damaged).expect("written");
            let _ = image_io::read(&path);
        }
    }
}

#[test]
fn claimed_sizes_are_refused_before_memory_is_taken() {
    let dir = folder();
    let (path, mut bytes) = png_in(dir.path());
    // IHDR: width and height at 16, its checksum at 29.
    bytes[16..24].copy_from_slice(&[0, 0x0f, 0xff, 0xff, 0, 0x0f, 0xff, 0xff]);
    let crc = crc32(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&crc.to_be_bytes());
    std::fs::write(&path, &bytes).expect("written");
    let error = read_png(&path).expect_err("a trillion pixels");
    assert!(matches!(error, ImageError::TooLarge { width: 1_048_575, .. }), "{error}");

    let (path, mut bytes) = exr_in(dir.path());
    for name in [&b"dataWindow\0box2i\0"[..], &b"displayWindow\0box2i\0"[..]] {
        let at = bytes.windows(name.len()).position(|w| w == name).expect("attribute") + name.len() + 4;
        bytes[at + 8..at + 16].copy_from_slice(&[0xff, 0xff, 0x0f, 0, 0xff, 0xff, 0x0f, 0]);
    }
    std::fs::write(&path, &bytes).expect("written");
    let error = read_exr(&path).expect_err("a trillion pixels");
    assert!(matches!(error, ImageError::TooLarge { width: 1_048_576, .. }), "{error}");
}

fn crc32(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0u32, |crc, &b| {
        (0..8).fold(crc ^ u32::from(b), |c, _| if c & 1 == 1 { 0xedb8_8320 ^ (c >> 1) } else { c >> 1 })
    })
}

#[test]
fn output_that_cannot_be_written_leaves_nothing_behind() {
    let dir = folder();
    let rgb = vec![0; 12];
    let missing = dir.path().join("no/such/folder/a.png");
    let error = write_png(&missing, 2, 2, &rgb, &[]).expect_err("no folder");
    assert!(matches!(error, ImageError::NoFolder { .. }) && error.to_string().contains("no/such/folder"), "{error}");
    let error = write_png(dir.path(), 2, 2, &rgb, &[]).expect_err("a folder");
    assert!(matches!(error, ImageError::IsFolder { .. }), "{error}");

    let shape = write_png(&dir.path().join("a.png"), 2, 2, &rgb[..11], &[]).expect_err("too short");
    assert!(matches!(shape, ImageError::Shape { .. }), "{shape}");
    let key = vec![("k".repeat(80), "text".to_string())];
    assert!(write_png(&dir.path().join("a.png"), 2, 2, &rgb, &key).is_err(), "a PNG key has at most 79 characters");
    assert!(write_png(&dir.path().join("a.png"), 0, 2, &[], &[]).is_err());
    let exr = dir.path().join("a.exr");
    let layer = Layer::new("", "RGB", &[0.0; 12]);
    for (w, h, layers) in
        [(3, 2, vec![layer.clone()]), (2, 2, vec![layer.clone(), layer.clone()]), (0, 0, vec![]), (2, 2, vec![])]
    {
        let error = write_exr(&exr, w, h, &layers, &[]).expect_err("does not fit");
        assert!(matches!(error, ImageError::Shape { .. }) && error.to_string().contains("a.exr"), "{error}");
    }
    assert_eq!(entries(dir.path()), Vec::<String>::new());
}

#[test]
fn replacing_keeps_links_and_is_whole() {
    let dir = folder();
    let path = dir.path().join("a.png");
    std::fs::write(&path, b"old").expect("written");
    write_whole(&path, b"new").expect("replaced");
    assert_eq!(std::fs::read(&path).expect("there"), b"new");
    #[cfg(unix)]
    {
        let link = dir.path().join("link.png");
        std::os::unix::fs::symlink(&path, &link).expect("linked");
        write_whole(&link, b"through").expect("replaced");
        assert!(link.symlink_metadata().expect("there").is_symlink());
        assert_eq!(std::fs::read(&path).expect("there"), b"through");
        assert_eq!(entries(dir.path()), ["a.png", "link.png"]);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn full_disks_and_places_without_permission_are_named() {
    let full = Path::new("/dev/full");
    if full.exists() {
        let error = write_png(full, 2, 2, &[0; 12], &[]).expect_err("no space");
        assert!(error.to_string().starts_with("/dev/full: cannot be written: No space left"), "{error}");
    }
    let error = write_png(Path::new("/proc/a.png"), 2, 2, &[0; 12], &[]).expect_err("not a place for files");
    assert!(matches!(error, ImageError::Write { .. }) && error.to_string().contains("/proc/a.png"), "{error}");
}

#[test]
fn a_missing_layer_is_named_with_those_that_exist() {
    let dir = folder();
    let (path, _) = exr_in(dir.path());
    let error = read_exr(&path).expect("readable").image("GlossInd").expect_err("not in it").to_string();
    for word in ["a.exr", "`GlossInd`", "DiffDir [R G B]", "(root) [R G B A]"] {
        assert!(error.contains(word), "{error}");
    }
}

/// Blender's own files: DWAA, half floats, names that begin with the view layer.
#[test]
fn cycles_references_are_read() {
    let Some(shared) = common::shared() else { return };
    let path = shared.join("reference/cycles/paper_0002/frame0000.exr");
    let read = read_exr(&path).expect("readable");
    assert_eq!((read.width, read.height), (1024, 512));
    for (name, channels) in [("", 4), ("DiffDir", 3), ("DiffInd", 3), ("DiffCol", 3), ("Normal", 3), ("Depth", 1)] {
        let image = read.image(name).expect("layer");
        assert!(image.channels == channels || name.is_empty(), "{name}: {} channels", image.channels);
        if name != "Depth" {
            read.check_finite(name).expect("finite");
        }
    }
    // Most pixels show a surface, and its normal is a unit vector up to DWAA's losses.
    let normals = read.image("Normal").expect("layer");
    let unit = normals.pixels.chunks_exact(3).filter(|n| (n.iter().map(|v| v * v).sum::<f32>() - 1.0).abs() < 0.1);
    assert!(unit.count() > 1024 * 512 * 9 / 10);
}
