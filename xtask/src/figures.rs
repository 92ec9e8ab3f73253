//! `cargo xtask figures`: every picture of docs that this program draws.

use super::{built, cargo, command, make_sure_of_adapter, run};
use std::path::Path;
use std::process::Command;

/// Largest figure, and largest picture of a pass, bytes.
const LARGEST: u64 = 500_000;
const LARGEST_OF_PASS: u64 = 100_000;

/// The viewer's window: two methods side by side, with the timing overlay.
const WINDOW: &str = r#"[
    { "wait": "loaded" }, { "key": "F3" }, { "wait": "idle" }, { "key": "Shift+F3" }, { "key": "B" },
    { "until": { "/timing/count": { "min": 21 } } }, { "key": "B" }, { "wait": "idle" },
    { "screenshot": "viewer.png" }, { "quit": true }
]"#;

/// Draws them; what this machine lacks programs or files for is left as it is, and said.
pub fn draw() -> Result<(), String> {
    let images = Path::new("docs/images");
    run(&mut command("python3", &["docs/frame.py"]))?;
    let build = ["build", "--workspace", "--features", "bouncelight-app/script"];
    let examples = ["--bin", "bouncelight", "--example", "passes", "--example", "symptoms"];
    cargo(&[&build[..], &examples].concat())?;
    let program = built("debug")?;
    make_sure_of_adapter(&program)?;
    let folder = program.parent().ok_or("the program has no folder")?;
    let work = folder.with_file_name("figures");
    std::fs::create_dir_all(&work).map_err(|e| format!("{}: {e}", work.display()))?;
    let text = |path: &Path| path.to_string_lossy().into_owned();
    let example = |name: &str| text(&folder.join("examples").join(name));
    let program = text(&program);

    run(&mut command(&example("passes"), &["docs/images/passes"]))?;
    run(&mut command(&example("symptoms"), &["docs/images/symptoms.png"]))?;
    let demo = text(&work.join("demo.png"));
    run(&mut command(&program, &["demo", "--no-times", "-o", &demo]))?;
    jpeg(&demo, &images.join("demo.jpg"))?;
    window(&program, &work, &images.join("viewer.jpg"))?;
    gallery(&program)?;
    super::conformance()?;
    println!("xtask: the hosts' pictures are drawn by `cargo xtask hosts`, the training curve by training/");
    sizes(images, LARGEST)?;
    sizes(&images.join("passes"), LARGEST_OF_PASS)
}

/// Has Pillow write a picture as JPEG.
fn jpeg(from: &str, to: &Path) -> Result<(), String> {
    let script = "import sys; from PIL import Image; \
                  Image.open(sys.argv[1]).convert('RGB').save(sys.argv[2], quality=88, optimize=True)";
    run(&mut command("python3", &["-c", script, from, &to.to_string_lossy()]))
}

/// The window, where there is an X server for it.
fn window(program: &str, work: &Path, to: &Path) -> Result<(), String> {
    if Command::new("xvfb-run").arg("--help").output().is_err() {
        println!("xtask: SKIP the viewer's window: no xvfb-run");
        return Ok(());
    }
    std::fs::write(work.join("steps.json"), WINDOW).map_err(|e| format!("{}: {e}", work.display()))?;
    let screen = ["-a", "-s", "-screen 0 1280x800x24", program, "view", "interior", "--method", "gather"];
    let mut session = command("xvfb-run", &[&screen[..], &["--size", "960x540", "--script", "steps.json"]].concat());
    run(session.current_dir(work))?;
    jpeg(&work.join("viewer.png").to_string_lossy(), to)
}

/// First pictures of files beside other programs', where these and the files are there.
fn gallery(program: &str) -> Result<(), String> {
    let lacks = if !Path::new("../shared/reference/real").exists() {
        "the files (../shared/reference/real)"
    } else if Command::new("f3d").arg("--version").output().is_err() {
        "f3d"
    } else {
        return run(&mut command("python3", &["docs/gallery.py", "--program", program]));
    };
    println!("xtask: SKIP the gallery: no {lacks}");
    Ok(())
}

/// Fails where a picture is larger than `most` bytes.
fn sizes(folder: &Path, most: u64) -> Result<(), String> {
    let entries = std::fs::read_dir(folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    for entry in entries.flatten() {
        let bytes = entry.metadata().map_or(0, |m| if m.is_file() { m.len() } else { 0 });
        if bytes > most {
            return Err(format!("{}: {bytes} bytes; at most {most} are allowed", entry.path().display()));
        }
    }
    Ok(())
}
