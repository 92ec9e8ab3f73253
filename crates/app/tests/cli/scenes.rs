//! Scenes as the command line meets them: what they may name, scenes of nothing, surroundings that
//! replace default light.

use crate::common;
use crate::program::{bouncelight, fails, path};
use std::path::Path;

/// Three positions, a triangle; whatever else a test needs comes in `more`.
fn triangle(dir: &tempfile::TempDir, name: &str, more: &str) -> String {
    let scene = path(dir, name);
    let data = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA";
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
        "buffers":[{{"byteLength":36,"uri":"data:application/octet-stream;base64,{data}"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}}],
        {more}}}"#
    );
    std::fs::write(&scene, text).unwrap();
    scene
}

/// What is told before a usage error ends the run: the scene's warnings, without a GPU.
fn warnings(args: &[&str]) -> String {
    let out = bouncelight(&[&["render"], args, &["-o", "never.png", "--camera", "99"]].concat());
    let text = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(text.contains("--camera 99"), "{text}");
    text
}

#[test]
fn scenes_of_nothing_exit_with_4() {
    let dir = tempfile::tempdir().unwrap();
    let (noise, out) = (path(&dir, "noise.obj"), path(&dir, "out.png"));
    std::fs::write(&noise, [7, 200, 13, 10, 0, 255]).unwrap();
    fails(&["render", &noise, "-o", &out], 4, &["noise.obj", "nothing to draw"]);
    let empty = path(&dir, "empty.gltf");
    std::fs::write(&empty, r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[]}]}"#).unwrap();
    fails(&["trace", &empty, "-o", &out], 4, &["empty.gltf", "nothing to draw"]);
    assert!(!Path::new(&out).exists());
}

#[test]
fn what_a_scene_names_stays_in_its_folder_unless_allowed() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("scene")).unwrap();
    let more =
        r#""materials":[{"emissiveTexture":{"index":0}}],"textures":[{"source":0}],"images":[{"uri":"../x.png"}]"#;
    let scene = triangle(&dir, "scene/a.gltf", more);
    let told = warnings(&[&scene]);
    assert!(told.contains("'../x.png' lies outside") && told.contains("--allow-outside"), "{told}");
    let told = warnings(&[&scene, "--allow-outside"]);
    assert!(!told.contains("lies outside") && told.contains("'../x.png' cannot be read"), "{told}");
}

#[test]
fn given_surroundings_replace_the_default_sun() {
    let dir = tempfile::tempdir().unwrap();
    let scene = triangle(&dir, "a.gltf", r#""materials":[{}]"#);
    assert!(warnings(&[&scene]).contains("a sun of 2.75 W/m²"));
    assert!(!warnings(&[&scene, "--environment", "0.5"]).contains("sun"));
    // There is no light to change any more, where without surroundings there is one.
    let light = ["--light", "0 strength=2", "--camera", "99", "-o", "never.png"];
    fails(&[&["render", &scene], &light[..]].concat(), 2, &["--camera 99"]);
    fails(&[&["render", &scene, "--environment", "0.5"], &light[..]].concat(), 2, &["--light"]);

    // A picture with one overflown texel is used, and told.
    let sky = path(&dir, "sky.exr");
    let mut rgb = vec![0.5f32; 3 * 16 * 8];
    (rgb[30], rgb[31]) = (f32::INFINITY, -1.0);
    let layer = bouncelight_scene::image_io::Layer::new("", "RGB", &rgb);
    bouncelight_scene::image_io::write_exr(Path::new(&sky), 16, 8, &[layer], &[]).unwrap();
    let told = warnings(&[&scene, "--environment", &sky]);
    assert!(told.contains("sky.exr: 2 radiances") && told.contains("clamped"), "{told}");
    assert!(!told.contains("a sun of"), "{told}");
    // Negative control: a picture full of them is none.
    rgb[..60].fill(f32::NAN);
    let layer = bouncelight_scene::image_io::Layer::new("", "RGB", &rgb);
    bouncelight_scene::image_io::write_exr(Path::new(&sky), 16, 8, &[layer], &[]).unwrap();
    fails(&["render", &scene, "-o", "never.png", "--environment", &sky], 4, &["sky.exr", "finite"]);
}

#[test]
fn a_picture_without_a_background_has_alpha() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let scene = path(&dir, "half.obj");
    std::fs::write(path(&dir, "m.mtl"), "newmtl wall\nKd 0.5 0.5 0.5\nnewmtl pane\nKd 0.5 0.5 0.5\nd 0.5\n").unwrap();
    let wall =
        "v -1 -0.5 0\nv 0 -0.5 0\nv 0 0.5 0\nv -1 0.5 0\nv 1 -0.5 0\nv 1 0.5 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
    std::fs::write(
        &scene,
        format!("mtllib m.mtl\n{wall}usemtl wall\nf 1/1 2/2 3/3 4/4\nusemtl pane\nf 2/1 5/2 6/3 3/4\n"),
    )
    .unwrap();
    let drawn = |name: &str, more: &[&str]| {
        let out = path(&dir, name);
        let seen = ["--size", "32x32", "--method", "direct", "--eye", "0,0,5", "--look-at", "0,0,0", "--fov", "34"];
        let run = bouncelight(&[&["render", &scene, "-o", &out], &seen[..], more].concat());
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        out
    };
    let places = [(16 + 2 * 32, 0.0), (11 + 16 * 32, 1.0), (20 + 16 * 32, 0.5)];
    for flag in ["--backdrop", "--background"] {
        let png = bouncelight_scene::image_io::read_png(Path::new(&drawn("a.png", &[flag, "transparent"]))).unwrap();
        assert_eq!(png.channels, 4);
        let exr = bouncelight_scene::image_io::read_exr(Path::new(&drawn("a.exr", &[flag, "transparent"]))).unwrap();
        let alpha = exr.layer("").unwrap().channel("A").unwrap().to_vec();
        for (i, wanted) in places {
            assert!((png.pixels[4 * i + 3] - wanted).abs() < 0.01, "{i}: {}", png.pixels[4 * i + 3]);
            assert!((alpha[i] - wanted).abs() < 0.01, "{i}: {}", alpha[i]);
        }
        // Colours of the PNG are not multiplied: pane and wall are lit the same.
        let [wall, pane] = [11 + 16 * 32, 20 + 16 * 32].map(|i| png.pixels[4 * i]);
        assert!((wall - pane).abs() < 0.06 && wall > 0.2, "{wall} {pane}");
    }
    // Negative control: with a background there is no alpha.
    assert_eq!(bouncelight_scene::image_io::read_png(Path::new(&drawn("b.png", &[]))).unwrap().channels, 3);
    let never = path(&dir, "never.png");
    let taa = ["--backdrop", "transparent", "--taa", "4"];
    fails(&[&["render", &scene, "-o", &never], &taa[..]].concat(), 2, &["--taa", "alpha"]);
}
