//! What `cargo xtask gpu-report` runs: measures this device and writes DEVICE.json and DEVICE.md.
//!
//!     gpu_report --fit FILE | [--out FOLDER] [--minutes M] [--sizes WxH,WxH,…] [--scenes NAME,…] [--triangles N,…] [--commit HASH] [--no-pytorch]
//!
//! `--fit FILE` measures nothing: it fits the model of `study::projection` to the record FILE, writes
//! its parameters and the record's tables anew, and prints how well they agree.

use bouncelight::gpu::{Gpu, GpuOptions};
use bouncelight_lab::study::hardware::{HardwareOptions, HardwareReport, measure};
use bouncelight_lab::study::projection;
use bouncelight_scene::image_io::write_whole;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode};
use std::time::{Duration, Instant};

const USAGE: &str = "usage: gpu_report --fit FILE | [--out FOLDER] [--minutes M] [--sizes WxH,...] [--scenes NAME,...] \
    [--triangles N,...] [--commit HASH] [--no-pytorch]";

/// Scenes that need no file: the usual room, a box with one lamp, a closed interior.
const SCENES: &str = "paper-room:2,interior,cornell";
/// The second is the one that all scenes are measured at; the last has 27 times its pixels, as an
/// H100 is 26 GTX 1050s.
const SIZES: &str = "512x256,1024x512,1920x1080,2048x1024,3840x2160,5376x2688";
const TRIANGLES: &str = "1000,10000,100000,1000000";

/// Time that PyTorch is given, seconds: importing it takes ten.
const PYTORCH: u64 = 75;

struct Args {
    out: PathBuf,
    time: Duration,
    options: [String; 3],
    commit: Option<String>,
    pytorch: bool,
    fit: Option<PathBuf>,
}

/// Where the program reads the model's parameters from.
const MODEL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/crates/lab/src/study/projection/model.json");

fn args() -> Result<Args, String> {
    let mut args = Args {
        out: "docs/measured".into(),
        time: Duration::from_secs(450),
        options: [SCENES, SIZES, TRIANGLES].map(str::to_owned),
        commit: None,
        pytorch: true,
        fit: None,
    };
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut value = || words.next().ok_or(format!("{word} needs a value\n{USAGE}"));
        match word.as_str() {
            "--out" => args.out = value()?.into(),
            "--minutes" => {
                let minutes: f64 = value()?.parse().map_err(|e| format!("--minutes: {e}"))?;
                let time = Duration::try_from_secs_f64(minutes * 60.0).map_err(|e| format!("--minutes: {e}"))?;
                args.time = time;
            }
            "--scenes" => args.options[0] = value()?,
            "--sizes" => args.options[1] = value()?,
            "--triangles" => args.options[2] = value()?,
            "--commit" => args.commit = Some(value()?),
            "--fit" => args.fit = Some(value()?.into()),
            "--no-pytorch" => args.pytorch = false,
            other => return Err(format!("`{other}` is not known\n{USAGE}")),
        }
    }
    Ok(args)
}

fn size(text: &str) -> Result<[u32; 2], String> {
    let sides = text.split_once('x').and_then(|(w, h)| Some([w.parse().ok()?, h.parse().ok()?]));
    sides.filter(|s| !s.contains(&0)).ok_or(format!("`{text}` is no size; write it as 1024x512"))
}

fn main() -> ExitCode {
    let args = match args() {
        Ok(args) => args,
        Err(message) => {
            eprintln!("error: {message}");
            return ExitCode::from(2);
        }
    };
    let done = match &args.fit {
        Some(record) => fit(record),
        None => report(args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            ExitCode::FAILURE
        }
    }
}

/// Fits the model to a record.
fn fit(path: &Path) -> Result<(), Box<dyn std::error::Error>> {
    let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
    let report: HardwareReport = serde_json::from_str(&text).map_err(|e| format!("{}: {e}", path.display()))?;
    let found = projection::fit::fit(&report)
        .ok_or(format!("{}: its device's data sheet is not known, or it holds no counts of threads", path.display()))?;
    println!("{}\n{}", found.text, serde_json::to_string_pretty(&found.model)?);
    write_whole(Path::new(MODEL), format!("{}\n", serde_json::to_string_pretty(&found.model)?).as_bytes())?;
    eprintln!("wrote {MODEL}");
    if found.model.parameters == *projection::model() {
        let page = path.with_extension("md");
        write_whole(&page, report.markdown().as_bytes())?;
        eprintln!("wrote {}", page.display());
    } else {
        eprintln!("the tables of the record follow when this is run again, by a program with these parameters");
    }
    Ok(())
}

fn report(args: Args) -> Result<(), Box<dyn std::error::Error>> {
    let [scenes, sizes, triangles] = args.options;
    let sizes = sizes.split(',').map(size).collect::<Result<Vec<_>, _>>()?;
    let scenes = scenes
        .split(',')
        .map(|name| Ok((name.to_owned(), bouncelight_lab::scenes::load(name)?)))
        .collect::<Result<Vec<_>, bouncelight_scene::SceneError>>()?;
    let triangles = triangles
        .split(',')
        .map(|n| n.parse().map_err(|e| format!("--triangles {n}: {e}")))
        .collect::<Result<_, _>>()?;
    std::fs::create_dir_all(&args.out).map_err(|e| format!("{}: {e}", args.out.display()))?;
    let gpu = Gpu::open(&GpuOptions::default())?;
    eprintln!("{}", gpu.sentence());
    let started = Instant::now();
    let time = args.time.saturating_sub(Duration::from_secs(if args.pytorch {
        PYTORCH.min(args.time.as_secs() / 5)
    } else {
        0
    }));
    let shared = sizes.get(1).or(sizes.first()).copied();
    let mut told =
        |what: &str| eprintln!("{:>4.0} of {:.0} s: {what}", started.elapsed().as_secs_f64(), args.time.as_secs_f64());
    let mut report = measure(&gpu, &HardwareOptions { scenes, sizes, time, triangles }, &mut told)?;
    report.commit = args.commit;
    if let (true, Some(size)) = (args.pytorch, shared) {
        told("PyTorch");
        report.pytorch = pytorch(size, args.time.saturating_sub(started.elapsed()));
    }
    report.seconds = started.elapsed().as_secs_f64();
    write(&args.out, &report)?;
    println!("{}", report.markdown());
    for what in &report.left_out {
        eprintln!("left out: {what}");
    }
    Ok(())
}

/// The network in PyTorch on the best device that it has, or why not.
fn pytorch(size: [u32; 2], left: Duration) -> Value {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let [width, height] = size.map(|n| n.div_ceil(4));
    let output = Command::new("python3")
        .arg(root.join("training/torch_speed.py"))
        .arg(root.join("assets/weights/filter.safetensors"))
        .arg(format!("{width}x{height}"))
        .args(["--seconds", &left.as_secs().to_string()])
        .env("PYTHONPATH", root.join("weights-format/python"))
        .output();
    let failed = |reason: &str| Value::String(reason.trim().lines().last().unwrap_or("no reason given").into());
    match output {
        Err(e) => failed(&format!("python3: {e}")),
        Ok(o) if o.status.success() => {
            serde_json::from_slice(&o.stdout).unwrap_or_else(|e| failed(&format!("its record cannot be read: {e}")))
        }
        Ok(o) => failed(&String::from_utf8_lossy(&o.stderr)),
    }
}

fn write(folder: &Path, report: &HardwareReport) -> Result<(), Box<dyn std::error::Error>> {
    let stem = report.file_stem();
    let json = format!("{}\n", serde_json::to_string_pretty(report)?);
    for (extension, text) in [("json", json), ("md", report.markdown())] {
        let path = folder.join(format!("{stem}.{extension}"));
        write_whole(&path, text.as_bytes())?;
        eprintln!("wrote {}", path.display());
    }
    Ok(())
}
