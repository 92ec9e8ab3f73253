//! `bouncelight dataset`: network inputs of views around the paper's rooms or through a scene, one safetensors file a view.
//!
//! The targets that belong to them are rendered by Cycles under the same file stems: `training/cycles/paper_rooms.py`
//! draws the same rooms from the same stream, `training/cycles/scene_file.py` reads the `views.json` written here.

use super::{
    args::{Global, usage},
    interrupt,
    progress::Progress,
};
use crate::{
    gi::Method,
    gpu::Gpu,
    image_io::write_whole,
    render::{Renderer, RendererOptions},
    scene::{self, Camera, LightKind, Scene, paper_room, upload::SceneGpu},
    study::{
        dataset::{Sample, sample},
        views::{around, turned},
    },
};
use anyhow::{Context, Result};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Rooms that pictures are judged on; training never sees them (docs/accuracy.md).
const JUDGED: [u32; 10] = [0, 1, 10, 11, 12, 14, 27, 33, 37, 47];
/// From this index on all rooms are kept for judging.
const JUDGED_FROM: u32 = 2200;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// What is drawn.
    #[arg(long, value_enum, default_value = "paper-room")]
    recipe: Recipe,
    /// Indices of rooms, such as 6-9,13 (recipe paper-room).
    #[arg(long, value_parser = parse_rooms, required_if_eq("recipe", "paper-room"))]
    rooms: Option<Rooms>,
    /// A scene file or bundled scene (recipe scene).
    #[arg(long, required_if_eq("recipe", "scene"))]
    scene: Option<String>,
    /// Views of each room (directions into which the full turn is cut) or of the scene (drawn around its own camera).
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    views: u32,
    /// Seed of the views of recipe scene.
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Width and height of the rasterised picture; the inputs have a quarter of it.
    #[arg(long, default_value = "1024x512", value_parser = super::args::parse_size, value_name = "WxH")]
    size: [u32; 2],
    /// Folder for the samples; those that exist are kept, so a stopped run goes on where it was.
    #[arg(long)]
    out: PathBuf,
    /// Allow rooms that are kept for judging.
    #[arg(long)]
    judge: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
enum Recipe {
    /// The scene stream of the paper's authors.
    PaperRoom,
    /// Views through one scene.
    Scene,
}

#[derive(Debug, Clone)]
struct Rooms(Vec<u32>);

fn parse_rooms(text: &str) -> Result<Rooms, String> {
    let number = |t: &str| t.trim().parse::<u32>().map_err(|e| format!("{t}: {e}"));
    let mut rooms = Vec::new();
    for part in text.split(',') {
        let (low, high) = part.split_once('-').unwrap_or((part, part));
        let (low, high) = (number(low)?, number(high)?);
        if low > high || high - low > 10_000 {
            return Err(format!("{part} is no range of rooms"));
        }
        rooms.extend(low..=high);
    }
    Ok(Rooms(rooms))
}

pub fn run(global: &Global, args: Args) -> Result<()> {
    if let Some(Rooms(rooms)) = &args.rooms {
        let kept: Vec<_> = rooms.iter().filter(|i| JUDGED.contains(i) || **i >= JUDGED_FROM).collect();
        if !kept.is_empty() && !args.judge {
            return Err(usage(format!(
                "rooms {kept:?} are kept for judging; --judge if that is what they are drawn for"
            )));
        }
    }
    std::fs::create_dir_all(&args.out).with_context(|| format!("cannot make the folder {}", args.out.display()))?;
    interrupt::install()?;
    let gpu = global.open_gpu()?;
    let options = RendererOptions { method: Method::Cache, ..Default::default() };
    let renderer = Renderer::new(&gpu.device, &gpu.queue, args.size, options)?;
    let mut writer = Writer { gpu, renderer, out: args.out.clone() };
    match (&args.rooms, &args.scene) {
        (Some(Rooms(rooms)), _) if args.recipe == Recipe::PaperRoom => {
            paper_rooms(global, &mut writer, rooms, args.views)?
        }
        (_, Some(spec)) if args.recipe == Recipe::Scene => one_scene(global, &mut writer, spec, args.views, args.seed)?,
        _ => return Err(usage("--rooms goes with recipe paper-room, --scene with recipe scene".into())),
    }
    report(&args.out)
}

/// Draws samples and writes them; a file that exists is kept.
struct Writer {
    gpu: Gpu,
    renderer: Renderer,
    out: PathBuf,
}

impl Writer {
    /// Writes the sample `stem`, unless it is there already.
    fn write(&mut self, stem: &str, scene: &SceneGpu, camera: &Camera) -> Result<()> {
        let path = self.out.join(format!("{stem}.safetensors"));
        if !path.exists() {
            let sample = self.sample(scene, camera)?;
            write_whole(&path, &sample.to_bytes()?)?;
        }
        Ok(())
    }

    fn sample(&mut self, scene: &SceneGpu, camera: &Camera) -> Result<Sample> {
        interrupt::check()?;
        Ok(sample(&self.gpu, &mut self.renderer, scene, camera)?)
    }
}

fn paper_rooms(global: &Global, writer: &mut Writer, rooms: &[u32], views: u32) -> Result<()> {
    let mut progress = Progress::new(global, "views", rooms.len() as u64 * u64::from(views));
    for &room in rooms {
        let scene = paper_room::scene(room);
        let uploaded = SceneGpu::new(&writer.gpu.device, &writer.gpu.queue, &scene)?;
        for view in 0..views {
            let camera = turned(&scene.cameras[0], view as f32 / views as f32);
            writer.write(&format!("room{room:04}_view{view}"), &uploaded, &camera)?;
            progress.step();
        }
    }
    progress.finish();
    Ok(())
}

/// Views in which much of the picture is closer than this part of the scene's size stand in front of a wall or in one.
const TOO_CLOSE: f32 = 0.03;

fn one_scene(global: &Global, writer: &mut Writer, spec: &str, views: u32, seed: u64) -> Result<()> {
    let scene = scene::load(spec)?;
    let uploaded = SceneGpu::new(&writer.gpu.device, &writer.gpu.queue, &scene)?;
    let stem = Path::new(spec).file_stem().map_or(spec.into(), |s| s.to_string_lossy().into_owned());
    let mut progress = Progress::new(global, "views", views.into());
    let mut cameras = Vec::new();
    for camera in around(&scene, seed).take(views as usize * 20) {
        if cameras.len() == views as usize {
            break;
        }
        let sample = writer.sample(&uploaded, &camera)?;
        if sample.closer_than(TOO_CLOSE * scene_size(&scene)) > 0.1 {
            continue;
        }
        let path = writer.out.join(format!("{stem}_view{}.safetensors", cameras.len()));
        write_whole(&path, &sample.to_bytes()?)?;
        cameras.push(json!({ "world_from_camera": camera.transform, "yfov": camera.yfov }));
        progress.step();
    }
    progress.finish();
    // glTF has no field for these, so whoever renders the targets needs them from here.
    let radius = |l: &crate::scene::Light| match l.kind {
        LightKind::Directional { angle, .. } => json!({ "name": l.name, "angle": angle }),
        LightKind::Point { radius, .. } | LightKind::Spot { radius, .. } => json!({ "name": l.name, "radius": radius }),
    };
    let record = json!({
        "schema": 1, "scene": spec, "seed": seed, "size": writer.renderer.size(), "views": cameras,
        "environment": scene.environment.radiance, "lights": scene.lights.iter().map(radius).collect::<Vec<_>>(),
    });
    write_whole(&writer.out.join(format!("{stem}_views.json")), format!("{record:#}\n").as_bytes())?;
    Ok(())
}

fn scene_size(scene: &Scene) -> f32 {
    scene::bounds::world_bounds(scene).map_or(1.0, |(low, high)| glam::Vec3::from(low).distance(high.into()))
}

fn report(out: &Path) -> Result<()> {
    let files = std::fs::read_dir(out).with_context(|| format!("cannot read {}", out.display()))?;
    let sizes: Vec<u64> = files.flatten().flat_map(|f| f.metadata()).filter(|m| m.is_file()).map(|m| m.len()).collect();
    println!("{} files, {:.1} MB in {}", sizes.len(), sizes.iter().sum::<u64>() as f64 / 1e6, out.display());
    Ok(())
}
