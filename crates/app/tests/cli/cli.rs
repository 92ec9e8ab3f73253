//! The program as a user meets it: exit codes, messages, files that appear or do not.

use crate::common;
use crate::program::{bouncelight, fails, is_empty, path};
use assert_cmd::Command;
use std::path::Path;

#[test]
fn usage_errors_exit_with_2() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir, "x.png");
    fails(&["render", "interior", "-o", &out, "--size", "0x0"], 2, &["--size", "at least 1"]);
    fails(&["render", "interior", "-o", &out, "--size", "12"], 2, &["1024x512"]);
    fails(
        &["render", "interior", "-o", &out, "--size", "-1x5"],
        2,
        &["--size", "-1x5", "`-1` is not a number of pixels"],
    );
    fails(&["render", "interior", "-o", &out, "--eye", "1,2,3"], 2, &["--look-at"]);
    fails(&["render", "interior", "-o", &out, "--eye", "1,2,3", "--look-at", "1,2,3"], 2, &["same point"]);
    fails(&["render", "interior", "-o", &out, "--camera", "99"], 2, &["--camera 99"]);
    // 16 bits are for networks: where none runs, nothing can be had of them.
    let word = &["--precision", "network"];
    fails(&["render", "interior", "--method", "ssgi", "-o", &out, "--precision", "f16"], 2, word);
    fails(&["bench", "interior", "--method", "ssgi", "--precision", "f16"], 2, word);
    fails(&["doctor", "--precision", "f16"], 2, word);
    fails(&["render", "interior", "-o", &out, "--precision", "f8"], 2, &["f16"]);
    fails(&["render", "interior", "-o", &out, "--fov", "180"], 2, &["--fov"]);
    fails(&["render", "interior", "-o", &path(&dir, "x.exr"), "--aov", "Bogus"], 2, &["Bogus", "DiffInd"]);
    fails(&["render", "interior", "-o", &out, "--environment", "nan"], 2, &["finite"]);
    fails(&["render", "interior", "-o", &path(&dir, "x.bmp")], 2, &[".png", ".exr"]);
    fails(&["render", "interior"], 2, &["--output"]);
    fails(&["paint"], 2, &["paint"]);
    // Weights of the other kind.
    let render = ["render", "interior", "-o", &out, "--size", "32x16", "--method"];
    let with = |words: [&'static str; 3]| render.iter().copied().chain(words).collect::<Vec<_>>();
    fails(&with(["neural", "--weights", "generator"]), 2, &["generator: weights of table `images`", "filter's"]);
    fails(&with(["generator", "--weights", "filter"]), 2, &["filter: weights of table `cells`", "generator's"]);
    fails(&with(["generator", "--weights", "generator-gather"]), 2, &["`images` with `gathered`;", "without"]);
    for method in ["rsm", "cache", "probes"] {
        fails(&["render", "interior", "-o", &out, "--method", method], 2, &[method, "gather"]);
        fails(&["bench", "interior", "--method", method], 2, &[method]);
    }
    let samples = ["dataset", "--spp", "2", "--moments", "1", "--out", &path(&dir, "d"), "--rooms"];
    fails(&[&samples[..], &["5-47"]].concat(), 2, &["judging", "47"]);
    fails(&[&samples[..], &["5", "--shard", "4/4"]].concat(), 2, &["4/4", "n-1"]);
    fails(&["dataset", "--rooms", "5", "--spp", "2", "--out", &path(&dir, "d")], 2, &["--moments"]);
    assert!(is_empty(dir.path()), "a usage error leaves nothing behind");
}

#[test]
fn invalid_scenes_exit_with_4_and_name_the_file() {
    let dir = tempfile::tempdir().unwrap();
    let out = path(&dir, "out.png");
    let (cut, empty, stray) = (path(&dir, "cut.glb"), path(&dir, "empty.glb"), path(&dir, "scene.txt"));
    std::fs::write(&cut, b"glTF\x02\0\0\0\xff\0\0\0").unwrap();
    std::fs::write(&empty, b"").unwrap();
    std::fs::write(&stray, b"hello").unwrap();
    fails(&["render", &cut, "-o", &out], 4, &["cut.glb"]);
    fails(&["render", &empty, "-o", &out], 4, &["empty.glb"]);
    let sky = path(&dir, "sky.hdr");
    std::fs::write(&sky, b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n\x02\x02").unwrap();
    fails(&["render", "interior", "-o", &out, "--environment", &sky], 4, &["sky.hdr", "truncated"]);
    std::fs::remove_file(&sky).unwrap();
    fails(&["render", "interior", "-o", &out, "--environment", &sky], 4, &["sky.hdr", "cannot be read"]);
    fails(&["render", &stray, "-o", &out], 4, &["scene.txt", ".glb"]);
    fails(&["render", dir.path().to_str().unwrap(), "-o", &out], 4, &["folder"]);
    fails(&["render", &path(&dir, "none.gltf"), "-o", &out], 4, &["none.gltf"]);
    fails(&["render", "no-such-scene", "-o", &out], 4, &["no-such-scene", "interior"]);
    fails(&["render", "paper-room:-1", "-o", &out], 4, &["paper-room:-1"]);
    assert!(!Path::new(&out).exists());
}

#[test]
fn a_zero_byte_texture_is_a_warning_that_names_it_and_the_scene_still_draws() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let (scene, out) = (path(&dir, "triangle.gltf"), path(&dir, "out.png"));
    std::fs::write(path(&dir, "empty.png"), b"").unwrap();
    // Three positions and three texture coordinates.
    let data = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAAAAAAAAAAAAIA/AAAAAAAAAAAAAIA/";
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"material":0}}]}}],
        "materials":[{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
        "textures":[{{"source":0}}],"images":[{{"uri":"empty.png"}}],
        "buffers":[{{"byteLength":60,"uri":"data:application/octet-stream;base64,{data}"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":24}}],
        "accessors":[
          {{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
          {{"bufferView":1,"componentType":5126,"count":3,"type":"VEC2"}}]}}"#
    );
    std::fs::write(&scene, text).unwrap();
    let run = bouncelight(&["render", &scene, "-o", &out, "--size", "64x32"]);
    let told = String::from_utf8_lossy(&run.stderr);
    assert!(run.status.success(), "{told}");
    assert!(told.contains("warning") && told.contains("empty.png"), "{told}");
    assert!(Path::new(&out).exists());
}

#[test]
fn unwritable_outputs_exit_with_1_before_anything_is_drawn() {
    let dir = tempfile::tempdir().unwrap();
    fails(&["render", "interior", "-o", &path(&dir, "no/such/folder/x.png")], 1, &["no/such/folder"]);
    let folder = path(&dir, "folder.png");
    std::fs::create_dir(&folder).unwrap();
    fails(&["render", "interior", "-o", &folder], 1, &["folder.png"]);
    assert!(is_empty(Path::new(&folder)), "nothing half-written stays");
}

#[test]
fn no_adapter_exits_with_3_and_says_what_to_install() {
    // Without any adapter the answer is another one.
    if common::gpu().is_none() {
        return;
    }
    fails(&["doctor", "--adapter", "no such card"], 3, &["no such card"]);
    // A Vulkan loader that is pointed at no driver finds none.
    let out = Command::new(env!("CARGO_BIN_EXE_bouncelight"))
        .args(["doctor", "--backend", "vulkan"])
        .env("VK_DRIVER_FILES", "/dev/null")
        .env("VK_ICD_FILENAMES", "/dev/null")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(3), "{text}");
    assert!(!cfg!(target_os = "linux") || text.contains("mesa-vulkan-drivers"), "{text}");
}

#[test]
fn doctor_describes_each_backend_or_says_that_it_has_no_adapter() {
    // OpenGL on the CPU cannot draw into everything that Vulkan can.
    let codes = ["vulkan", "gl"].map(|backend| {
        let out = bouncelight(&["doctor", "--backend", backend, "--json"]);
        match out.status.code() {
            Some(0) => assert!(String::from_utf8_lossy(&out.stdout).contains("driver_faults")),
            code => assert_eq!(code, Some(3), "{backend}: {}", String::from_utf8_lossy(&out.stderr)),
        }
        out.status.code()
    });
    assert!(common::gpu().is_none() || codes.contains(&Some(0)));
}

#[test]
fn a_wrong_backend_variable_is_named() {
    let out =
        Command::new(env!("CARGO_BIN_EXE_bouncelight")).arg("doctor").env("WGPU_BACKEND", "glide").output().unwrap();
    assert_eq!(out.status.code(), Some(3));
    assert!(String::from_utf8_lossy(&out.stderr).contains("glide"));
}

#[test]
fn render_writes_a_whole_picture_with_provenance() {
    let Some(gpu) = common::gpu() else { return };
    let dir = tempfile::tempdir().unwrap();
    let png = path(&dir, "cornell.png");
    let out = bouncelight(&["render", "cornell", "--method", "neural", "-o", &png, "--size", "160x80"]);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let (image, metadata) = bouncelight_scene::image_io::read_png_with_metadata(Path::new(&png)).unwrap();
    assert_eq!((image.width, image.height), (160, 80));
    let text = |key: &str| metadata.iter().find(|(k, _)| k == key).map(|(_, v)| v.clone()).unwrap_or_default();
    assert!(text("Adapter").contains(&gpu.info.name));
    assert!(text("Command").contains("render cornell"));
    assert!(text("Weights").len() >= 8);
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 1, "no temporary file stays");
}

#[test]
fn the_same_command_gives_the_same_picture_and_all_layers() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let layers = |name: &str, seed: &str| {
        let file = path(&dir, name);
        let drawn = ["render", "interior", "--size", "96x48", "--samples", "2", "--aov", "all"];
        let out = bouncelight(&[&drawn[..], &["-o", &file, "--seed", seed]].concat());
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        bouncelight_scene::image_io::read_exr(Path::new(&file)).unwrap()
    };
    let (a, b, c) = (layers("a.exr", "1"), layers("b.exr", "1"), layers("c.exr", "2"));
    let beauty = a.image("Combined").unwrap().to_rgb();
    assert_eq!(beauty, b.image("Combined").unwrap().to_rgb());
    assert_ne!(beauty, c.image("Combined").unwrap().to_rgb(), "another seed is another picture");
    for name in ["DiffDir", "DiffInd", "DiffCol", "Emit", "Normal", "Depth", "Position", "Motion"] {
        a.layer(name).unwrap();
    }
}

#[test]
fn rays_in_another_order_give_the_same_picture() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let drawn = |from: &str, to: &str| {
        let folder = path(&dir, "shaders");
        let own = crate::common::root().join("shaders");
        let mut folders = vec![own.clone()];
        while let Some(of) = folders.pop() {
            let there = Path::new(&folder).join(of.strip_prefix(&own).unwrap());
            std::fs::create_dir_all(&there).unwrap();
            for entry in std::fs::read_dir(of).unwrap().map(Result::unwrap) {
                if entry.path().is_dir() {
                    folders.push(entry.path());
                } else {
                    let text = std::fs::read_to_string(entry.path()).unwrap();
                    std::fs::write(there.join(entry.file_name()), text.replace(from, to)).unwrap();
                }
            }
        }
        let file = path(&dir, "x.exr");
        let args = ["render", "cornell", "--size", "64x48", "--method", "gather", "--accumulate", "3", "-o", &file];
        let out = bouncelight(&[&args[..], &["--shaders", &folder]].concat());
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        bouncelight_scene::image_io::read_exr(Path::new(&file)).unwrap().image("Combined").unwrap().to_rgb()
    };
    let next = "noted_jobs[JOB_COUNTS / 2u + i]";
    for shader in [
        include_str!("../../../../shaders/gi/gather/trace.wgsl"),
        include_str!("../../../../shaders/gi/gather/cache_update.wgsl"),
    ] {
        assert!(shader.contains(next));
    }
    let forwards = drawn(next, next);
    assert_eq!(drawn(next, "noted_jobs[JOB_COUNTS / 2u + count - 1u - i]"), forwards);
    // Negative control: every second ray is traced by nobody.
    assert_ne!(drawn(next, "noted_jobs[JOB_COUNTS / 2u + (i & ~1u)]"), forwards);
}

#[test]
fn layers_add_up_to_the_picture_as_blenders_do() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    for method in ["ambient", "neural"] {
        let file = path(&dir, &format!("{method}.exr"));
        let out =
            bouncelight(&["render", "interior", "-o", &file, "--size", "96x48", "--aov", "all", "--method", method]);
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let layers = bouncelight_scene::image_io::read_exr(Path::new(&file)).unwrap();
        let of = |name: &str| layers.image(name).unwrap().to_rgb();
        let [beauty, col, dir, ind] = ["Combined", "DiffCol", "DiffDir", "DiffInd"].map(of);
        let [gloss, gloss_dir, gloss_ind, emit] = ["GlossCol", "GlossDir", "GlossInd", "Emit"].map(of);
        let depth = layers.image("Depth").unwrap().pixels;
        let error = |indirect: f32| {
            let (mut sum, mut all) = (0.0, 0.0);
            for i in (0..beauty.len()).filter(|i| depth[i / 3] < 1e9) {
                let diffuse = col[i] * (dir[i] + indirect * ind[i]);
                let added = diffuse + gloss[i] * (gloss_dir[i] + indirect * gloss_ind[i]) + emit[i];
                sum += f64::from((added - beauty[i]).abs());
                all += f64::from(beauty[i]);
            }
            sum / all
        };
        assert!(error(1.0) < 2e-3, "{method}: {}", error(1.0));
        // Negative control: without indirect light the sum is another picture.
        assert!(error(0.0) > 0.1, "{method}: {}", error(0.0));
    }
}

#[test]
fn a_reference_above_the_threshold_exits_with_5() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let (bright, diff) = (path(&dir, "bright.png"), path(&dir, "diff.png"));
    let base = ["render", "cornell", "--size", "96x48", "-o"];
    let with = |extra: &[&str]| bouncelight(&[&base[..], extra].concat());
    assert!(with(&[&bright, "--exposure", "1"]).status.success());
    let again = path(&dir, "again.png");
    let same = with(&[&again, "--exposure", "1", "--reference", &bright, "--metric", "psnr", "--threshold", "60"]);
    assert!(same.status.success(), "{}", String::from_utf8_lossy(&same.stderr));
    let dark = with(&[&again, "--reference", &bright, "--metric", "psnr", "--threshold", "60", "--diff", &diff]);
    assert_eq!(dark.status.code(), Some(5), "{}", String::from_utf8_lossy(&dark.stderr));
    assert!(Path::new(&diff).exists() && Path::new(&again).exists(), "the pictures are kept for a look");

    // Against its own radiance any exposure is right; FLIP tells another light, and so does its
    // map.
    let (linear, lit) = (path(&dir, "linear.exr"), path(&dir, "lit.png"));
    assert!(with(&[&linear]).status.success());
    let flip = ["--reference", &linear, "--metric", "flip", "--threshold", "0.01", "--diff", &diff];
    let own = with(&[&[&again[..], "--exposure", "1"], &flip[..]].concat());
    assert!(own.status.success(), "{}", String::from_utf8_lossy(&own.stderr));
    let other = with(&[&[&lit[..], "--environment", "0.5"], &flip[..]].concat());
    assert_eq!(other.status.code(), Some(5), "{}", String::from_utf8_lossy(&other.stderr));
    let hot = bouncelight_scene::image_io::read_png(Path::new(&diff)).unwrap();
    assert!(hot.pixels.iter().copied().fold(0.0, f32::max) > 0.3);

    // What cannot be judged is told before anything is drawn.
    let fresh = path(&dir, "fresh.png");
    let light = [&base[..], &[&fresh, "--reference", &bright, "--metric", "hdrflip"]].concat();
    fails(&light, 2, &["hdrflip", "bright.png", "EXR"]);
    let size = ["render", "cornell", "--size", "64x48", "-o", &fresh, "--reference", &bright];
    fails(&size, 1, &["64×48", "96×48", "bright.png"]);
    assert!(!Path::new(&fresh).exists());
}

#[test]
fn bench_prints_passes_and_writes_a_record_that_it_can_compare_with() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().unwrap();
    let json = path(&dir, "bench.json");
    let base = ["bench", "cornell", "--size", "128x64", "--frames", "3", "--warmup", "1", "--layers"];
    let out = bouncelight(&[&base[..], &["--json", &json]].concat());
    let text = String::from_utf8_lossy(&out.stdout);
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    for word in ["shadow", "gbuffer", "direct", "net.down0.a", "gi.features", "wall clock", "MiB of GPU memory"] {
        assert!(text.contains(word), "`{word}` is missing in: {text}");
    }
    let record: serde_json::Value = serde_json::from_slice(&std::fs::read(&json).unwrap()).unwrap();
    assert_eq!(record["schema"], 1);
    assert_eq!(record["methods"].as_array().unwrap().len(), 5);
    // Against a base that was a thousand times faster, it is too slow.
    let mut fast = record.clone();
    for m in fast["methods"].as_array_mut().unwrap() {
        for key in ["gpu_ms", "wall_ms"] {
            if let Some(v) = m[key]["median"].as_f64() {
                m[key]["median"] = (v / 1000.0).into();
            }
        }
    }
    std::fs::write(&json, fast.to_string()).unwrap();
    let slow = bouncelight(&[&base[..], &["--compare", &json, "--fail-over", "5%"]].concat());
    assert_eq!(slow.status.code(), Some(6), "{}", String::from_utf8_lossy(&slow.stderr));
}

#[test]
fn gl_draws_the_same_picture_as_vulkan() {
    let dir = tempfile::tempdir().unwrap();
    // The Cornell box has six local shadow maps, the room four cascades: shapes that GL could
    // mistake for a cube map.
    for scene in ["cornell", "paper-room:2"] {
        let mut files = Vec::new();
        for backend in ["vulkan", "gl"] {
            let file = path(&dir, &format!("{backend}.png"));
            let out = bouncelight(&["render", scene, "-o", &file, "--size", "128x64", "--backend", backend]);
            if out.status.code() == Some(i32::from(bouncelight_app::cli::error::NO_ADAPTER)) {
                let need = if backend == "gl" { common::Need::OpenGl } else { common::Need::Adapter };
                return common::skip(need, format_args!("--backend {backend} finds no adapter"));
            }
            assert!(out.status.success(), "{scene} on {backend}: {}", String::from_utf8_lossy(&out.stderr));
            files.push(file);
        }
        let psnr = |a: &str, b: &str| {
            let out = bouncelight(&["compare", a, b, "--metric", "psnr"]);
            let text = String::from_utf8_lossy(&out.stdout).into_owned();
            text.split_whitespace().last().and_then(|v| v.parse::<f64>().ok()).expect("compare prints a number")
        };
        let value = psnr(&files[0], &files[1]);
        assert!(value > 50.0, "{scene}: {value} dB between Vulkan and GL");
        // Negative control: a tenth of a stop is told apart.
        let brighter = path(&dir, "brighter.png");
        let args = ["render", scene, "-o", &brighter, "--size", "128x64", "--backend", "gl", "--exposure", "0.1"];
        assert!(bouncelight(&args).status.success());
        let control = psnr(&files[0], &brighter);
        assert!(control < 50.0, "{scene}: {control} dB for another exposure");
    }
}

#[test]
#[cfg(unix)]
fn results_may_be_read_in_part_and_a_full_disk_is_said() {
    let run = |more: &str| {
        let shell = format!(
            "{} weights info ../../assets/weights/filter.safetensors {more}",
            env!("CARGO_BIN_EXE_bouncelight")
        );
        std::process::Command::new("bash")
            .args(["-c", &format!("set -o pipefail; {shell}")])
            .output()
            .expect("bash runs")
    };
    let part = run("| head -1");
    let said = String::from_utf8_lossy(&part.stderr).into_owned();
    assert!(part.status.success() && !part.stdout.is_empty() && said.is_empty(), "{:?} {said}", part.status);
    let full = run("> /dev/full");
    assert_eq!(full.status.code(), Some(1));
    assert!(String::from_utf8_lossy(&full.stderr).starts_with("error: cannot write to standard output"));
}

#[test]
#[cfg(unix)]
fn what_never_ends_is_not_read_and_a_reason_is_said_once() {
    fails(&["compare", "/dev/zero", "/dev/zero"], 1, &["/dev/zero", "not a regular file"]);
    let out = bouncelight(&["compare", "no-such.png", "no-such.png"]);
    let said = String::from_utf8_lossy(&out.stderr);
    assert_eq!(said.matches("os error 2").count(), 1, "{said}");
}
