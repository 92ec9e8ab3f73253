//! `bouncelight fit`: what it finds is kept beside the scene and obeyed until that changes.

use crate::{build, common};
use bouncelight::gi::name::MethodName;
use bouncelight_lab::study::fitted::Fitted;
use bouncelight_scene::export;
use std::path::{Path, PathBuf};
use std::process::Output;

fn bouncelight(folder: &Path, args: &[&str]) -> Output {
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_bouncelight"));
    command.current_dir(folder).args(args).output().expect("the program starts")
}

#[track_caller]
fn ends(out: &Output, code: i32, words: &[&str]) -> String {
    let text = String::from_utf8_lossy(&[out.stdout.as_slice(), &out.stderr].concat()).into_owned();
    assert_eq!(out.status.code(), Some(code), "{text}");
    assert!(!text.contains("panicked"), "{text}");
    for word in words {
        assert!(text.contains(word), "`{word}` is missing in: {text}");
    }
    text
}

/// The method that drew a PNG, by its metadata.
fn drawn_by(path: &Path) -> String {
    let reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(path).unwrap())).read_info().unwrap();
    let info = reader.info();
    let latin = info.uncompressed_latin1_text.iter().map(|t| (t.keyword.clone(), t.text.clone()));
    let utf8 = info.utf8_text.iter().map(|t| (t.keyword.clone(), t.get_text().unwrap()));
    latin.chain(utf8).find(|(k, _)| k == "Method").expect("metadata names the method").1
}

#[test]
fn what_was_found_is_kept_and_obeyed_until_the_scene_changes() {
    if common::gpu().is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    export::write_glb(&build::open_walls(), &at("open.glb")).unwrap();
    let light = ["--environment", "1", "--size", "64x32"];
    let run = |args: &[&str]| bouncelight(folder.path(), &[args, &light].concat());
    let out = run(&["fit", "open.glb", "--target", "light=12%", "--views", "1", "--spp", "128", "--report", "page"]);
    ends(&out, 0, &["ambient", "**chosen**", "open.glb.gi.toml"]);
    let kept: PathBuf = at("open.glb.gi.toml");
    let fitted = Fitted::load(&kept).unwrap().expect("written");
    assert_eq!((fitted.method, fitted.measured.reached), (MethodName::Ambient, true));
    assert!(fitted.measured.error <= 0.12 && fitted.measured.cost.contains("GTX 1050"), "{fitted:?}");
    for name in ["page/fit.md", "page/fit.json", "page/view0_reference.png"] {
        assert!(at(name).metadata().unwrap().len() > 100, "{name}");
    }
    // Obeyed, overridden, and not obeyed under another light.
    let drawn = |more: &[&str], code, words: &[&str]| {
        let out =
            bouncelight(folder.path(), &[&["render", "open.glb", "-o", "a.png", "--size", "64x32"], more].concat());
        ends(&out, code, words);
        drawn_by(&at("a.png"))
    };
    assert_eq!(drawn(&["--environment", "1"], 0, &["`ambient`, as fitted"]), "ambient");
    assert_eq!(drawn(&["--environment", "1", "--method", "direct"], 0, &[]), "direct");
    assert_eq!(drawn(&["--environment", "1", "--gi", "none", "--accumulate", "1"], 0, &[]), "gather");
    assert_eq!(drawn(&["--environment", "2", "--accumulate", "1"], 0, &["is ignored", "fit` again"]), "gather");
    let bench = run(&["bench", "open.glb", "--frames", "1", "--warmup", "0"]);
    let text = ends(&bench, 0, &["ambient"]);
    assert!(!text.contains("gather"), "{text}");
}

#[test]
fn what_cannot_be_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let run = |args: &[&str]| bouncelight(folder.path(), args);
    for (target, told) in
        [("light", "METRIC=BOUND"), ("light=0", "above 0"), ("magic=1", "not a metric"), ("light=2", "share")]
    {
        ends(&run(&["fit", "cornell", "--target", target]), 2, &[told]);
    }
    ends(&run(&["fit", "cornell", "--budget-ms=-1"]), 2, &["budget"]);
    ends(&run(&["fit", "nowhere.glb"]), 4, &["nowhere.glb"]);
    ends(&run(&["render", "cornell", "-o", "a.png", "--gi", "nowhere.toml"]), 2, &["nowhere.toml"]);
    for (text, told) in
        [("schema = ", "line 1"), ("schema = 1\nmethod = \"magic\"\n", "magic"), ("schema = 1\n", "missing field")]
    {
        std::fs::write(folder.path().join("cornell.gi.toml"), text).unwrap();
        for command in ["render", "bench"] {
            let args: &[&str] =
                if command == "render" { &["render", "cornell", "-o", "a.png"] } else { &["bench", "cornell"] };
            ends(&run(args), 4, &["cornell.gi.toml", told, "fit"]);
        }
    }
    assert!(!folder.path().join("a.png").exists());
}
