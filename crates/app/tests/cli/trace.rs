//! `bouncelight trace` as a user meets it: flags, metadata, exit codes, files that appear
//! or do not.

use crate::common;
use crate::program::{bouncelight, fails};
use bouncelight_scene::image_io::{Layers, read_exr};
use std::path::Path;

/// Traces the Cornell box with `flags` into `name`; gives the file and what was said.
#[track_caller]
fn trace(dir: &Path, name: &str, flags: &[&str]) -> (Layers, String) {
    let path = dir.join(name);
    let out = path.to_str().expect("a temporary path is text");
    let args = [&["trace", "cornell", "-o", out], flags].concat();
    let done = bouncelight(&args);
    let text = String::from_utf8_lossy(&done.stderr).into_owned();
    assert_eq!(done.status.code(), Some(0), "{args:?}: {text}");
    (read_exr(&path).unwrap(), text)
}

fn key(layers: &Layers, name: &str) -> String {
    let found = layers.metadata.iter().find(|(k, _)| k == name);
    found.unwrap_or_else(|| panic!("no {name} in {:?}", layers.metadata)).1.clone()
}

#[test]
fn flags_that_make_no_sense_exit_with_2() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("x.exr");
    let out = path.to_str().unwrap();
    let traced = |flags: &[&str], words: &[&str]| {
        fails(&[&["trace", "cornell", "-o", out], flags].concat(), 2, words);
    };
    traced(&["--spp", "0"], &["--spp"]);
    for bound in ["0", "-1", "nan", "inf"] {
        traced(&["--until-error", bound], &["--until-error", "above 0"]);
    }
    traced(&["--clamp", "nan"], &["--clamp", "or above"]);
    traced(&["--cells", "0"], &["--cells"]);
    traced(&["--cells", "4", "--denoise"], &["--cells", "--denoise"]);
    traced(&["--aov", "Motion"], &["Motion", "Gi, Analytic"]);
    traced(&["--aov", "Depth,Depth"], &["twice"]);
    // What belongs to frames is no flag of paths, and the other way round.
    for flag in ["--method", "--samples", "--taa", "--frames", "--backdrop", "--weights", "--gather", "--accumulate"] {
        traced(&[flag, "1"], &[flag]);
    }
    for flag in ["--spp", "--until-error", "--clamp", "--bounces", "--cells"] {
        fails(&["render", "cornell", "-o", out, flag, "4"], 2, &[flag, "bouncelight trace"]);
    }
    for (command, output) in [("render", "-o"), ("export", "--output")] {
        let more: &[&str] = if command == "export" { &["--target", "wgsl"] } else { &["--spp", "4"] };
        let args = [&[command, "cornell", output, out, "--method", "reference"], more].concat();
        fails(&args, 2, &["bouncelight trace"]);
    }
    fails(&["render", "cornell", "-o", out, "--spp", "4", "--method", "reference"], 2, &["bouncelight trace"]);
    fails(&["render", "cornell", "-o", out, "--method", "magic"], 2, &["magic", "direct", "gather"]);
    fails(&["render", "cornell", "--method", "direct", "-o", out, "--aov", "Gi"], 2, &["Gi", "Motion"]);
    fails(&["bench", "cornell", "--method", "reference"], 2, &["real-time", "bouncelight trace"]);
    assert!(std::fs::read_dir(dir.path()).unwrap().next().is_none(), "a usage error leaves nothing behind");
}

#[test]
fn pictures_tell_their_noise_and_how_they_were_made() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let flags = ["--size", "20x12", "--spp", "5", "--aov", "all", "--seed", "3"];
    let limits = ["--bounces", "12", "--diffuse-bounces", "4", "--glossy-bounces", "4", "--clamp", "10"];
    let (a, said) = trace(dir.path(), "a.exr", &[&flags[..], &limits].concat());
    assert_eq!((a.width, a.height), (20, 12));
    for layer in
        "DiffDir DiffInd DiffCol GlossDir GlossInd GlossCol Emit Env Gi Analytic Normal Depth Position".split(' ')
    {
        a.check_finite(layer).unwrap();
    }
    assert!(said.contains("5 samples a pixel") && said.contains("noise left"), "{said}");
    for (name, value) in [
        ("ReferenceSamples", "5"),
        ("ReferenceSamplesMost", "5"),
        ("ReferenceSeed", "3"),
        ("ReferenceBounces", "12 4 4"),
        ("ReferenceClamp", "10"),
        ("ReferenceCells", "none"),
    ] {
        assert_eq!(key(&a, name), value, "{name}");
    }
    for name in ["Combined", "DiffInd", "Gi"] {
        let noise: f64 = key(&a, &format!("ReferenceNoise{name}")).parse().unwrap();
        let mean: f64 = key(&a, &format!("ReferenceNoiseOfMean{name}")).parse().unwrap();
        assert!(noise > 0.01 && noise < 10.0 && mean > 0.0 && mean < noise, "{name}: {noise}, {mean}");
    }
    assert!(key(&a, "ReferenceSamplesPerSecond").parse::<f64>().unwrap() > 0.0);
    // The same seed gives the same picture, another seed another one.
    let (again, _) = trace(dir.path(), "again.exr", &[&flags[..], &limits].concat());
    assert_eq!(again.layers, a.layers);
    let (other, _) = trace(dir.path(), "other.exr", &["--size", "20x12", "--spp", "5", "--aov", "all", "--quiet"]);
    assert_ne!(other.layer("").unwrap(), a.layer("").unwrap());
    assert_eq!(key(&other, "ReferenceBounces"), "unlimited unlimited unlimited");
}

/// A preview is nearer to the truth than what it is made of, as bright, and told; layers stay as
/// they were traced.
#[test]
fn a_preview_is_nearer_to_the_truth_and_says_what_it_is() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let of = |name: &str, spp: &str, more: &[&str]| {
        trace(dir.path(), name, &[&["--size", "64x64", "--spp", spp, "--aov", "Gi,Normal"], more].concat())
    };
    let (truth, _) = of("truth.exr", "384", &["--seed", "7"]);
    let (noisy, said) = of("noisy.exr", "16", &[]);
    assert!(!said.contains("denoised") && key(&noisy, "ReferenceDenoised") == "false");
    let (preview, said) = of("preview.exr", "16", &["--denoise"]);
    assert!(said.contains("denoised") && key(&preview, "ReferenceDenoised") == "true", "{said}");
    for layer in ["Gi", "Normal"] {
        assert_eq!(noisy.layer(layer).unwrap(), preview.layer(layer).unwrap());
    }
    assert_eq!(preview.layers.len(), noisy.layers.len(), "no layer that was not asked for");
    let pixels = |l: &Layers| ["R", "G", "B"].map(|c| l.layer("").unwrap().channel(c).unwrap().to_vec()).concat();
    let (truth, noisy, preview) = (pixels(&truth), pixels(&noisy), pixels(&preview));
    let mean = |p: &[f32]| p.iter().sum::<f32>() / p.len() as f32;
    let off = |p: &[f32]| p.iter().zip(&truth).map(|(a, b)| (a - b).abs()).sum::<f32>() / truth.iter().sum::<f32>();
    println!("{:.1} % off, {:.1} % denoised", 100.0 * off(&noisy), 100.0 * off(&preview));
    assert!(off(&preview) < 0.7 * off(&noisy), "{} of {}", off(&preview), off(&noisy));
    // Negative control: averaged over neighbours whatever they show, it is further off than it was.
    let near = |i: usize| {
        (0..25).map(move |k| (i % 4096 + 64 * (k / 5) + k % 5).saturating_sub(130).min(4095) + 4096 * (i / 4096))
    };
    let smeared: Vec<f32> = (0..noisy.len()).map(|i| near(i).map(|j| noisy[j]).sum::<f32>() / 25.0).collect();
    assert!(off(&smeared) > off(&noisy), "{}", off(&smeared));
    assert!((mean(&preview) / mean(&truth) - 1.0).abs() < 0.03, "sparks are all that it takes away");
}

#[test]
fn cells_and_error_bounds() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let (cells, _) =
        trace(dir.path(), "cells.exr", &["--size", "65x33", "--cells", "4", "--until-error", "0.5", "--aov", "Gi"]);
    assert_eq!((cells.width, cells.height, key(&cells, "ReferenceCells").as_str()), (17, 9, "4"));
    assert!(key(&cells, "ReferenceNoiseGi").parse::<f64>().unwrap() <= 0.5);
    assert!(key(&cells, "ReferenceSamples").parse::<u32>().unwrap() >= 16);
    // A picture of cells can be judged, and the exit code tells.
    let (own, out) = (dir.path().join("cells.exr"), dir.path().join("one.png"));
    let (own, out) = (own.to_str().unwrap(), out.to_str().unwrap());
    let start = ["trace", "cornell", "--size", "65x33", "--cells", "4", "--spp", "1"];
    let judged = |threshold| [&start[..], &["-o", out, "--reference", own, "--threshold", threshold]].concat();
    assert_eq!(bouncelight(&judged("0.9")).status.code(), Some(0));
    fails(&judged("0.000001"), 5, &["mae"]);
}

#[test]
fn odd_scenes_and_sizes() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = dir.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let out = dir.path().join("out.exr");
    let out = out.to_str().unwrap();
    let ok = |scene: &str, flags: &[&str]| {
        let args = [&["trace", scene, "--spp", "2", "-o", out], flags].concat();
        let done = bouncelight(&args);
        assert_eq!(done.status.code(), Some(0), "{}", String::from_utf8_lossy(&done.stderr));
        read_exr(Path::new(out)).unwrap().check_finite("").unwrap();
    };
    ok("cornell", &["--size", "1x1"]);
    ok("cornell", &["--size", "1x7", "--environment", "0"]);
    // Inside the left wall, and far outside.
    ok("cornell", &["--size", "5x3", "--eye", "1e7,0,0", "--look-at", "0,0,0"]);
    // One vertex is no number: the scene is refused, by name.
    let positions = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAwH8AAAAA";
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "buffers":[{{"byteLength":36,"uri":"data:application/octet-stream;base64,{positions}"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,1]}}]}}"#
    );
    let broken = file("broken.gltf", &text);
    let gone = dir.path().join("gone.exr");
    fails(&["trace", &broken, "-o", gone.to_str().unwrap()], 4, &["broken.gltf", "not a finite"]);
    assert!(!gone.exists());
}

#[cfg(unix)]
/// Writes a glTF file of `instances` copies of a fan of `triangles`.
fn write_copies(path: &Path, triangles: u16, instances: u32) {
    let mut bytes = Vec::new();
    for i in 0..triangles + 2 {
        let angle = f32::from(i) * 1e-3;
        [angle.cos(), angle.sin(), 0.0].iter().for_each(|x: &f32| bytes.extend(x.to_le_bytes()));
    }
    let positions = bytes.len();
    (1..=triangles).for_each(|i| [0, i, i + 1].iter().for_each(|x: &u16| bytes.extend(x.to_le_bytes())));
    let count = instances as usize;
    // Side by side: rays that look for a place to stand meet few.
    let node = |i| format!(r#"{{"mesh":0,"translation":[{},0,0]}}"#, 3 * i);
    let nodes = (0..count).map(node).collect::<Vec<_>>().join(",");
    let list = (0..count).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
    let (all, vertices, indices) = (bytes.len(), triangles + 2, 3 * u32::from(triangles));
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"buffers":[{{"byteLength":{all},"uri":"fan.bin"}}],
        "bufferViews":[{{"buffer":0,"byteLength":{positions}}},{{"buffer":0,"byteOffset":{positions},"byteLength":{}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{vertices},"type":"VEC3","min":[-1,-1,0],"max":[1,1,0]}},
        {{"bufferView":1,"componentType":5123,"count":{indices},"type":"SCALAR"}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
        "cameras":[{{"type":"perspective","perspective":{{"yfov":1.0,"znear":0.1}}}}],
        "nodes":[{nodes},{{"camera":0}}],"scenes":[{{"nodes":[{list},{count}]}}],"scene":0}}"#,
        all - positions
    );
    std::fs::write(path, text).unwrap();
    std::fs::write(path.with_file_name("fan.bin"), bytes).unwrap();
}

#[test]
fn more_than_the_device_holds_exits_with_4_before_memory_is_taken() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("copies.gltf");
    let out = dir.path().join("x.png").display().to_string();
    let args = ["trace", path.to_str().unwrap(), "--spp", "1", "--size", "8x8", "-o", &out];
    // A hundred million triangles are too many for any device's bindings or for the tree.
    write_copies(&path, 50_000, 2_000);
    fails(&args, 4, &["copies", "100000000"]);
    // Negative control: the same file with two copies is drawn.
    write_copies(&path, 100, 2);
    fails(&args, 0, &[]);
}

#[test]
fn an_interrupted_run_exits_with_130_and_leaves_nothing() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("long.exr");
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_bouncelight"))
        .args(["trace", "cornell", "--size", "64x64", "--spp", "1000000"])
        .args(["--progress", "plain", "-o", out.to_str().unwrap()])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    // The first line of progress says that tracing has begun.
    let lines = std::io::BufRead::lines(std::io::BufReader::new(child.stderr.take().unwrap()));
    let mut seen = false;
    for line in lines.map_while(Result::ok) {
        if !seen && line.contains("/1000000 samples") {
            seen = true;
            let kill = std::process::Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
            assert!(kill.unwrap().success());
        }
    }
    assert!(seen, "there was no progress");
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(std::fs::read_dir(dir.path()).unwrap().next().is_none(), "nothing half-written");
}
