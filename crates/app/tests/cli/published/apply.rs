//! Pictures through the networks: against PyTorch's outputs, through the program, with the authors'
//! own pictures.

use super::convert::{converted, named, norm};
use super::state::{bytes, hashes, state};
use crate::common;
use bouncelight::net::format::{Dtype, Weights};
use bouncelight_lab::network::cpu;
use bouncelight_lab::network::pictures::{self, Pictures};
use bouncelight_scene::image_io;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const NAMES: [&str; 4] = ["depth", "direct", "diffuse", "normal"];
const EVERY: usize = 487;

fn root(path: &str) -> PathBuf {
    common::root().join(path)
}

/// Bytes of the four pictures that `published.py` calls synthetic.
fn synthetic(width: usize, height: usize) -> [Vec<u8>; 4] {
    NAMES.map(|name| {
        let noise = hashes(name, 3 * width * height);
        let shade = |(i, v): (usize, f32)| {
            let ramp = (i / 3 % width) as f32 / width as f32;
            ((0.5 * v + 0.5 * ramp) * 255.0).floor() as u8
        };
        noise.into_iter().enumerate().map(shade).collect()
    })
}

fn run(weights: &Weights, size: [u32; 2], bytes: &[Vec<u8>; 4]) -> Vec<f32> {
    let [depth, direct, diffuse, normal] =
        bytes.each_ref().map(|b| b.iter().map(|v| f32::from(*v) / 255.0).collect::<Vec<_>>());
    let pictures =
        Pictures { size, depth: &depth, direct: &direct, diffuse: &diffuse, normal: &normal, gathered: None };
    let input = pictures::input(weights, &pictures).unwrap();
    pictures::picture(&cpu::run(weights, &input).unwrap())
}

fn program(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_bouncelight")).args(args).output().expect("the program starts")
}

#[track_caller]
fn fails(args: &[&str], code: i32, words: &[&str]) {
    let out = program(args);
    let text = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(code), "{args:?}: {text}");
    assert!(!text.contains("panicked"), "{text}");
    words.iter().for_each(|w| assert!(text.contains(w), "`{w}` is not in: {text}"));
}

fn write_pictures(folder: &Path, size: [u32; 2], bytes: &[Vec<u8>; 4]) {
    for (name, bytes) in NAMES.iter().zip(bytes) {
        image_io::write_png(&folder.join(format!("{name}.png")), size[0], size[1], bytes, &[]).unwrap();
    }
}

/// The flags of `apply` for the pictures, weights and output in `folder`.
fn flags(folder: &Path) -> Vec<String> {
    let path = |name: &str| folder.join(name).to_str().expect("a temporary path is text").to_string();
    let mut flags: Vec<String> =
        NAMES.iter().flat_map(|name| [format!("--{name}"), path(&format!("{name}.png"))]).collect();
    flags.extend(["--weights".into(), path("net.safetensors"), "-o".into(), path("out.png")]);
    flags.insert(0, "apply".into());
    flags
}

#[test]
fn pictures_are_those_that_pytorch_gives() {
    let text = std::fs::read_to_string(root("weights-format/fixtures/published.json")).unwrap();
    let cases: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
    assert_eq!(cases.len(), 10);
    for case in &cases {
        let word = |key: &str| case[key].as_str().unwrap();
        let number = |value: &serde_json::Value| value.as_u64().unwrap() as usize;
        let [width, height] = [0, 1].map(|i| number(&case["size"][i]));
        // "instance" of deep illumination is its batch norm state in training mode.
        let stored = if word("arch") == "pix2pix" { word("norm") } else { "batch" };
        let from = state(word("arch"), stored, number(&case["width"]));
        let weights = converted(&from, named(word("arch")), norm(word("norm")), Dtype::F32).unwrap();
        let size = [width as u32, height as u32];
        let ours: Vec<f32> = run(&weights, size, &synthetic(width, height)).into_iter().step_by(EVERY).collect();
        let theirs: Vec<f32> = case["output"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap() as f32).collect();
        assert_eq!(ours.len(), theirs.len());
        let worst = ours.iter().zip(&theirs).fold(0f32, |m, (a, b)| m.max((a - b).abs()));
        assert!(worst < 1e-4, "{} {} {size:?}: {worst}", word("arch"), word("norm"));
        // Control: depth and direct light swapped give another picture.
        let mut swapped = synthetic(width, height);
        swapped.swap(0, 1);
        let other: Vec<f32> = run(&weights, size, &swapped).into_iter().step_by(EVERY).collect();
        assert!(other.iter().zip(&theirs).any(|(a, b)| (a - b).abs() > 0.01));
    }
}

#[test]
fn the_program_converts_tells_and_applies() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().expect("a temporary path is text").to_string();
    let from = state("pix2pix", "group", 2);
    std::fs::write(path("state.safetensors"), bytes(&from)).unwrap();
    let (input, output) = (path("state.safetensors"), path("net.safetensors"));
    let convert = ["weights", "convert", &input, "--arch", "pix2pix", "--norm", "group", "-o", &output];
    let out = program(&convert);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let weights = Weights::load(Path::new(&output)).unwrap();
    assert_eq!(weights.provenance["converted_from"], "state.safetensors");
    assert_eq!(weights.provenance["sha256"].as_str().map(str::len), Some(64));
    let info = String::from_utf8(program(&["weights", "info", &output, "--size", "2048x1024"]).stdout).unwrap();
    for words in ["depth 3 (signed), direct 3", "display_signed", "2048x1024", "up1.model.0", "sha256", "stored as F32"]
    {
        assert!(info.contains(words), "`{words}` is not in: {info}");
    }
    let size = [201, 133];
    let synthetic = synthetic(201, 133);
    write_pictures(folder.path(), size, &synthetic);
    let flags = flags(folder.path());
    let apply: Vec<&str> = flags.iter().map(String::as_str).collect();
    let out = program(&apply);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let (picture, metadata) = image_io::read_png_with_metadata(Path::new(&path("out.png"))).unwrap();
    let expected = run(&weights, size, &synthetic);
    let worst = picture.pixels.iter().zip(&expected).fold(0f32, |m, (a, b)| m.max((a - b).abs()));
    assert!([picture.width, picture.height] == size && worst < 0.6 / 255.0, "{worst}");
    assert!(metadata.contains(&("Weights".into(), weights.hash_text())));
    // Dropout with a seed gives another picture, and the same one twice.
    let dropped = |seed: &str| {
        let mut args = apply.clone();
        args.extend(["--dropout", seed]);
        assert!(program(&args).status.success());
        image_io::read_png(Path::new(&path("out.png"))).unwrap().pixels
    };
    let first = dropped("1");
    assert!(first == dropped("1") && first != dropped("2") && first != picture.pixels);
}

#[test]
fn what_cannot_be_applied() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().expect("a temporary path is text").to_string();
    let weights = converted(&state("pix2pix", "batch", 1), named("pix2pix"), norm("batch"), Dtype::F16).unwrap();
    std::fs::write(path("net.safetensors"), weights.to_bytes()).unwrap();
    write_pictures(folder.path(), [20, 10], &synthetic(20, 10));
    let flags = flags(folder.path());
    let with = |flag: &str, value: &str| -> Vec<String> {
        let mut flags = flags.clone();
        let at = flags.iter().position(|f| f == flag).expect("a flag of apply");
        flags[at + 1] = value.into();
        flags
    };
    let check = |flag: &str, value: &str, code: i32, words: &[&str]| {
        let args = with(flag, value);
        fails(&args.iter().map(String::as_str).collect::<Vec<_>>(), code, words);
        assert!(!Path::new(&path("out.png")).exists(), "nothing is written");
    };
    image_io::write_png(Path::new(&path("small.png")), 19, 10, &[0; 570], &[]).unwrap();
    check("--normal", &path("small.png"), 2, &["small.png", "19x10", "20x10", "one size"]);
    check("--normal", &path("none.png"), 1, &["none.png"]);
    check("--normal", &path("net.safetensors"), 1, &["net.safetensors", "PNG"]);
    let mut encoder = png::Encoder::new(std::fs::File::create(path("clear.png")).unwrap(), 20, 10);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(&[100; 800]).unwrap();
    check("--depth", &path("clear.png"), 2, &["clear.png", "alpha"]);
    let mut encoder = png::Encoder::new(std::fs::File::create(path("deep.png")).unwrap(), 20, 10);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Sixteen);
    encoder.write_header().unwrap().write_image_data(&[100; 1200]).unwrap();
    check("--depth", &path("deep.png"), 2, &["deep.png", "16 bits"]);
    check("-o", &path("out.exr"), 2, &["out.exr", ".png"]);
    let filter = root("assets/weights/filter.safetensors");
    check("--weights", filter.to_str().unwrap(), 4, &["light", "cells", "made from pictures"]);
    check("--weights", "generator-gather", 4, &["want the picture `gathered`"]);
    let free = root("weights-format/fixtures/add.safetensors");
    check("--weights", free.to_str().unwrap(), 4, &["free", "nothing says what they are"]);
    if common::gpu().is_some() {
        let (net, out) = (path("net.safetensors"), path("out.png"));
        let render = ["render", "interior", "--size", "16x8", "--samples", "1", "-o", &out, "--weights"];
        // The method is that of the weights.
        let drawn = program(&[&render[..], &[&net]].concat());
        assert!(drawn.status.success(), "{}", String::from_utf8_lossy(&drawn.stderr));
        let (_, metadata) = image_io::read_png_with_metadata(Path::new(&out)).unwrap();
        assert!(metadata.contains(&("Weights".into(), weights.hash_text())), "{metadata:?}");
        std::fs::remove_file(&out).unwrap();
        let free = free.to_str().unwrap();
        fails(&[&render[..], &[free, "--method", "generator"]].concat(), 2, &["free", "generator's"]);
    }
    // A faulty state is refused as a whole.
    let mut faulty = state("pix2pix", "batch", 1);
    faulty.remove("final.2.bias");
    faulty.remove("up1.model.1.running_var");
    std::fs::write(path("faulty.safetensors"), bytes(&faulty)).unwrap();
    let (input, output) = (path("faulty.safetensors"), path("made.safetensors"));
    let convert = ["weights", "convert", &input, "--arch", "pix2pix", "--norm", "batch", "-o", &output];
    fails(&convert, 4, &["faulty.safetensors", "final.2.bias", "up1.model.1.running_var"]);
    assert!(!Path::new(&output).exists());
    fails(
        &["weights", "convert", &input, "--arch", "deep-illumination", "--norm", "group", "-o", &output],
        2,
        &["batch"],
    );
}

/// The authors' pictures, a quarter in size, with a narrow generator, against PyTorch on the same
/// files.
#[test]
fn the_authors_pictures() {
    let Some(shared) = common::shared() else { return };
    if !common::python(common::Need::Torch, "torch, PIL") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name).to_str().expect("a temporary path is text").to_string();
    let script = root("weights-format/fixtures/published.py");
    let made = Command::new("python3")
        .args([
            script.to_str().unwrap(),
            "authors",
            shared.join("reference/authors").to_str().unwrap(),
            "0003",
            &path(""),
        ])
        .output()
        .expect("python3 has just answered");
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let (input, output) = (path("state.safetensors"), path("net.safetensors"));
    let convert = ["weights", "convert", &input, "--arch", "pix2pix", "--norm", "group", "-o", &output];
    let out = program(&convert);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let flags = flags(folder.path());
    let out = program(&flags.iter().map(String::as_str).collect::<Vec<_>>());
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let picture = image_io::read_png(Path::new(&path("out.png"))).unwrap();
    let expected: Vec<f32> = bytemuck::pod_collect_to_vec(&std::fs::read(path("expected.f32")).unwrap());
    assert_eq!([picture.width, picture.height], [512, 256]);
    let worst = picture.pixels.iter().zip(&expected).fold(0f32, |m, (a, b)| m.max((a - b).abs()));
    println!("largest difference from PyTorch: {:.2} of 255", worst * 255.0);
    assert!(worst < 0.6 / 255.0, "{worst}");
    let mean = expected.iter().sum::<f32>() / expected.len() as f32;
    assert!(expected.iter().any(|v| (v - mean).abs() > 0.1), "there is something to compare");
}
