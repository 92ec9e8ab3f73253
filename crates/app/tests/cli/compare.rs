//! `bouncelight compare` as a user meets it: names, numbers, heat maps, records, layers, errors.
//! Needs no adapter.

use assert_cmd::Command;
use bouncelight_scene::image_io::{Layer, read_png, write_exr, write_png};
use serde_json::Value;
use std::path::Path;

fn run(args: &[&str]) -> (i32, String, String) {
    let out = Command::new(env!("CARGO_BIN_EXE_bouncelight")).arg("compare").args(args).output().expect("it starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (out.status.code().expect("an exit code"), text(&out.stdout), text(&out.stderr))
}

/// The printed rows.
#[track_caller]
fn rows(args: &[&str]) -> Vec<(String, f64)> {
    let (code, out, err) = run(args);
    assert_eq!(code, 0, "{args:?}: {err}");
    out.lines()
        .map(|line| {
            let (name, value) = line.split_once(' ').expect("a name and a number");
            (name.into(), value.trim().parse().expect("a number"))
        })
        .collect()
}

#[track_caller]
fn fails(args: &[&str], code: i32, words: &[&str]) {
    let (got, _, text) = run(args);
    assert_eq!(got, code, "{args:?}: {text}");
    assert!(!text.contains("panicked"), "{args:?}: {text}");
    for word in words {
        assert!(text.contains(word), "{args:?}: `{word}` is missing in: {text}");
    }
}

fn fixture(name: &str) -> String {
    let path = crate::common::root().join("tests/fixtures/metrics/flip").join(name);
    path.to_str().expect("text").into()
}

fn expected(kind: &str, a: &str) -> Value {
    let all: Value = serde_json::from_str(include_str!("../../../../tests/fixtures/metrics/flip/expected.json"))
        .expect("expected.json");
    let rows = all[kind].as_array().expect("rows");
    rows.iter().find(|row| row["a"] == a).expect("the pair").clone()
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).to_str().expect("a temporary path is text").into()
    }

    /// An EXR of 8×8 pixels with a beauty, DiffInd and Depth, everything `gain` times as much.
    fn exr(&self, name: &str, gain: f32, touch: impl Fn(&mut Vec<Layer>)) -> String {
        let values = |count: usize| (0..64 * count).map(|i| gain * (0.25 + i as f32 / 512.0)).collect::<Vec<_>>();
        let mut layers = vec![
            Layer::new("", "RGBA", &values(4)),
            Layer::new("DiffInd", "RGB", &values(3)),
            Layer::new("Depth", "Z", &values(1)),
        ];
        touch(&mut layers);
        let path = self.path(name);
        write_exr(Path::new(&path), 8, 8, &layers, &[]).expect("writable");
        path
    }
}

#[test]
fn names_choose_the_rows() {
    let [a, b] = ["interior_ambient.exr", "interior_neural.exr"].map(fixture);
    let names = |args: &[&str]| rows(args).into_iter().map(|(name, _)| name).collect::<Vec<_>>();
    let all = ["l1", "l2", "paper-ssim", "fid", "psnr", "ssim", "mae", "flip", "relmse", "mre", "bias", "hdrflip"];
    assert_eq!(names(&[&a, &b]), all);
    assert_eq!(names(&[&a, &b, "--metric", "paper"]), all[..4]);
    for name in all {
        assert_eq!(names(&[&a, &b, "--metric", name]), [name]);
    }
    // Pictures that are only shown have no metrics of light; a PNG beside an EXR neither.
    let png = fixture("interior_neural.png");
    for other in [&fixture("interior_ambient.png"), &a] {
        assert_eq!(names(&[other, &png]), all[..8]);
        for name in &all[8..] {
            fails(&[other, &png, "--metric", name], 2, &[name, "EXR", "interior_neural.png"]);
        }
    }
}

#[test]
fn both_flips_are_the_reference_evaluators() {
    let value = |args: &[&str]| rows(args)[0].1;
    let (a, b) = (fixture("interior_ambient.png"), fixture("interior_neural.png"));
    let want = expected("ldr", "interior_ambient.png")["mean"].as_f64().expect("number");
    assert!((value(&[&a, &b, "--metric", "flip"]) - want).abs() < 2e-6);
    let other = value(&[&a, &b, "--metric", "flip", "--pixels-per-degree", "30"]);
    assert!((other - want).abs() > 1e-3, "another distance is another number: {other}");
    let (a, b) = (fixture("interior_ambient.exr"), fixture("interior_neural.exr"));
    let want = expected("hdr", "interior_ambient.exr");
    assert!((value(&[&a, &b, "--metric", "hdrflip"]) - want["mean"].as_f64().expect("number")).abs() < 2e-6);
    for (name, key) in [("relmse", "rel_mse"), ("mre", "mean_relative_error"), ("bias", "bias")] {
        let ours = value(&[&a, &b, "--metric", name]);
        assert!((ours - want[key].as_f64().expect("number")).abs() < 1e-6, "{name} {ours}");
    }
    // An EXR is judged as the same view transform shows it: the PNGs of this pair are Filmic.
    let shown = expected("ldr", "interior_ambient.png")["mean"].as_f64().expect("number");
    let filmic = value(&[&a, &b, "--metric", "flip"]);
    let agx = value(&[&a, &b, "--metric", "flip", "--tonemap", "agx"]);
    assert!((filmic - shown).abs() < 2e-3 && (agx - shown).abs() > 4e-3, "{filmic} {agx} {shown}");
}

#[test]
fn heat_maps_and_records() {
    let dir = Folder::new();
    let (a, b) = (fixture("interior_ambient.exr"), fixture("interior_neural.exr"));
    let mut maps = Vec::new();
    for metric in ["flip", "hdrflip", "mae"] {
        let file = dir.path(&format!("{metric}.png"));
        rows(&[&a, &b, "--metric", "psnr", "--heatmap", &file, "--heatmap-metric", metric]);
        let image = read_png(Path::new(&file)).expect("a picture");
        assert_eq!((image.width, image.height), (96, 64));
        maps.push(image.pixels);
    }
    assert!(maps[0] != maps[1] && maps[0] != maps[2] && maps[1] != maps[2]);
    let default = dir.path("default.png");
    rows(&[&a, &b, "--metric", "psnr", "--heatmap", &default]);
    assert_eq!(read_png(Path::new(&default)).expect("a picture").pixels, maps[0], "FLIP's is the default");
    let same = dir.path("same.png");
    rows(&[&a, &a, "--heatmap", &same]);
    let black = read_png(Path::new(&same)).expect("a picture").pixels;
    assert!(black.iter().all(|v| *v < 0.1), "equal pictures are dark all over");

    // Standard output holds the record and nothing else.
    let (code, out, _) = run(&[&a, &b, "--json", "-"]);
    let record: Value = serde_json::from_str(&out).expect("JSON");
    assert_eq!((code, &record["schema"], &record["width"]), (0, &1.into(), &96.into()));
    assert!(record["flip"].is_f64() && record["hdr_flip"]["exposures"]["start"].is_f64());
    let file = dir.path("record.json");
    rows(&[&a, &b, "--metric", "l1", "--json", &file]);
    let record: Value = serde_json::from_slice(&std::fs::read(&file).expect("written")).expect("JSON");
    assert!(
        record["flip"].is_null() && record["paper"]["l1"].is_f64() && record["linear"]["mean_relative_error"].is_f64()
    );
}

#[test]
fn one_layer_of_both_files() {
    let dir = Folder::new();
    let (a, b) = (dir.exr("a.exr", 1.5, |_| {}), dir.exr("b.exr", 1.0, |_| {}));
    for layer in ["DiffInd", "Depth", "Combined"] {
        let of = rows(&[&a, &b, "--layer", layer]);
        let names: Vec<_> = of.iter().map(|(n, _)| n.as_str()).collect();
        assert_eq!(names, ["relmse", "mre", "bias", "mae"]);
        assert!((of[1].1 - 0.5).abs() < 1e-3 && (of[2].1 - 0.5).abs() < 1e-3, "half too bright: {of:?}");
    }
    assert!(rows(&[&b, &a, "--layer", "DiffInd", "--metric", "bias"])[0].1 < -0.3, "a third too dark");
    assert_eq!(rows(&[&a, &a, "--layer", "DiffInd"]).iter().map(|r| r.1).sum::<f64>(), 0.0);
    // 1 for every value of the reference that is 0.25 in the mean: known by hand.
    let ones = |value: f32| move |layers: &mut Vec<Layer>| layers.push(Layer::new("Motion", "XY", &[value; 128]));
    let (c, d) = (dir.exr("c.exr", 1.0, ones(1.0)), dir.exr("d.exr", 1.0, ones(0.25)));
    let values: Vec<f64> = rows(&[&c, &d, "--layer", "Motion"]).into_iter().map(|(_, v)| v).collect();
    let want = [0.5625 / 0.0725, 3.0, 3.0, 0.75];
    assert!(values.iter().zip(want).all(|(v, w)| (v - w).abs() < 1e-5), "{values:?}");

    let (heat, json) = (dir.path("heat.png"), dir.path("layer.json"));
    rows(&[&a, &b, "--layer", "DiffInd", "--heatmap", &heat, "--json", &json]);
    assert_eq!(read_png(Path::new(&heat)).expect("a picture").width, 8);
    let record: Value = serde_json::from_slice(&std::fs::read(&json).expect("written")).expect("JSON");
    assert_eq!((&record["schema"], &record["layer"]), (&1.into(), &"DiffInd".into()));
    assert!(record["linear"]["bias"].is_f64());

    fails(&[&a, &b, "--layer", "GlossDir"], 2, &["a.exr", "GlossDir", "DiffInd [R G B]", "Depth [Z]"]);
    fails(&[&a, &fixture("text.png"), "--layer", "DiffInd"], 2, &["text.png", "no layers"]);
    fails(&[&a, &b, "--layer", "DiffInd", "--metric", "psnr"], 2, &["psnr", "mre"]);
    let grey = dir.exr("grey.exr", 1.0, |layers| layers[1] = Layer::new("DiffInd", "Y", &[0.5; 64]));
    fails(&[&a, &grey, "--layer", "DiffInd"], 2, &["R G B", "grey.exr", "DiffInd"]);
    fails(&[&a, &fixture("stops.exr"), "--layer", "Combined"], 1, &["8×8", "56×40"]);
    let nan = dir.exr("nan.exr", 1.0, |layers| {
        layers[1].channels[1].1[8 * 3 + 5] = f32::NAN;
        layers[1].channels[2].1[63] = f32::INFINITY;
    });
    fails(&[&a, &nan, "--layer", "DiffInd"], 1, &["nan.exr", "DiffInd", "2 non-finite", "x 5, y 3"]);
    rows(&[&a, &nan, "--layer", "Depth"]);
    rows(&[&a, &nan, "--metric", "psnr"]);
}

#[test]
fn what_cannot_be_compared_says_why() {
    let dir = Folder::new();
    let good = fixture("interior_neural.png");
    fails(&[&good, &fixture("text.png")], 1, &["96×64", "80×48", "text.png"]);
    fails(&[&good, &fixture("text.png"), "--metric", "flip"], 1, &["96×64", "80×48"]);
    let nan = dir.exr("nan.exr", 1.0, |layers| layers[0].channels[0].1[8 * 2 + 7] = f32::NAN);
    fails(&[&nan, &nan], 1, &["nan.exr", "1 non-finite", "x 7, y 2"]);
    let no_beauty = dir.exr("layers.exr", 1.0, |layers| drop(layers.remove(0)));
    fails(&[&no_beauty, &no_beauty], 1, &["layers.exr", "Combined", "DiffInd"]);
    fails(&[dir.0.path().to_str().expect("text"), &good], 1, &["is a folder"]);
    fails(&[&good, &dir.path("none.png")], 1, &["none.png"]);
    for name in ["interior_neural.png", "interior_neural.exr"] {
        let (cut, bytes) = (dir.path(&format!("cut_{name}")), std::fs::read(fixture(name)).expect("a fixture"));
        for length in [0, 3, 20, bytes.len() / 2, bytes.len() - 5] {
            std::fs::write(&cut, &bytes[..length]).expect("writable");
            fails(&[&cut, &good, "--metric", "flip"], 1, &["cut_interior_neural"]);
        }
    }
    let text = dir.path("notes.txt");
    std::fs::write(&text, "not a picture").expect("writable");
    fails(&[&text, &good], 1, &["notes.txt", "PNG or EXR"]);
    let small = dir.path("small.png");
    write_png(Path::new(&small), 4, 4, &[128; 48], &[]).expect("writable");
    fails(&[&small, &small], 1, &["7×7", "4×4"]);

    fails(&[&good, &good, "--metric", "lpips"], 2, &["lpips", "hdrflip"]);
    for ppd in ["0", "nan", "1e9", "x"] {
        fails(&[&good, &good, "--pixels-per-degree", ppd], 2, &["--pixels-per-degree"]);
    }
    let heat = dir.path("heat.png");
    fails(&[&good, &good, "--heatmap", &heat, "--heatmap-metric", "hdrflip"], 2, &["hdrflip", "EXR"]);
    fails(&[&good, &good, "--heatmap", &heat, "--layer", "X", "--heatmap-metric", "mae"], 2, &["--layer"]);
    assert!(!Path::new(&heat).exists());
    fails(&[&good, &good, "--heatmap", &dir.path("no/heat.png")], 1, &["no/heat.png", "folder"]);
    fails(&[&good, &good, "--json", &dir.path("no/a.json")], 1, &["no/a.json", "folder"]);
}
