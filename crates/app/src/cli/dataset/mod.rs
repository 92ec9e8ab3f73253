//! `bouncelight dataset`: what a network that filters learns from, in views around the paper's rooms,
//! through rooms of their kind, homes or a scene, one safetensors file a view (training/README.md has
//! the format). `training/cycles/scene_file.py` reads the `views.json` written here.

mod writer;

use super::{
    args::{Global, usage},
    interrupt,
    progress::Progress,
    scene_args::Lit,
    stdout::say,
};
use anyhow::{Context, Result};
use bouncelight::gi::{gather, inputs::cells_of};
use bouncelight::scene::{self, Camera, LightKind, Scene};
use bouncelight_lab::scenes::{home, paper_room};
use bouncelight_lab::study::{
    moments::{self, When},
    varied,
    views::{around, turned},
};
use bouncelight_scene::image_io::write_whole;
use serde_json::json;
use std::path::{Path, PathBuf};
use writer::Writer;

/// Rooms that pictures are judged on; training never sees them (docs/results/accuracy.md).
const JUDGED: [u32; 10] = [0, 1, 10, 11, 12, 14, 27, 33, 37, 47];
/// From this index on all rooms are kept for judging.
const JUDGED_FROM: u32 = 2200;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Scenes: the paper's rooms, varied ones, homes (flats and streets made by code), or one scene.
    #[arg(long, value_enum, default_value = "paper-room", help_heading = SCENES)]
    recipe: Recipe,
    /// Indices of rooms or homes, such as 6-9,13.
    #[arg(long, value_parser = parse_rooms, required_if_eq_any([("recipe", "paper-room"),
        ("recipe", "paper-room-varied"), ("recipe", "home")]), value_name = "LIST", help_heading = SCENES)]
    rooms: Option<Rooms>,
    /// Scene file or bundled scene, for recipe scene.
    #[arg(long, required_if_eq("recipe", "scene"), help_heading = SCENES)]
    scene: Option<String>,
    #[command(flatten)]
    lit: Lit,
    /// Views, 1 to 10000: directions in a room, cameras of a home (3), or around the scene's camera.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(1..=10_000), value_name = "N",
        help_heading = SCENES)]
    views: u32,
    /// Seed of the views of recipe scene.
    #[arg(long, default_value_t = 0, value_name = "N", help_heading = SCENES)]
    seed: u64,
    /// Allow rooms that are kept for judging.
    #[arg(long, help_heading = SCENES)]
    judge: bool,
    /// Picture size, pixels; a sample has a quarter of it, a value per 4x4 cell.
    #[arg(long, default_value = "1024x512", value_parser = super::args::parse_size, value_name = "WxH",
        help_heading = SAMPLES)]
    size: [u32; 2],
    /// Rays per cell of the target light, 1 to 65536.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=65_536), value_name = "N", help_heading = SAMPLES)]
    spp: u32,
    /// When a cell's history is written, in order: frames after a cut, `pan` (moving camera), `lamp` or
    /// `thing` (after it moved), such as 1,2,8,pan,20,lamp,thing.
    #[arg(long, required = true, value_delimiter = ',', value_parser = parse_moment, value_name = "LIST",
        help_heading = SAMPLES)]
    moments: Vec<When>,
    /// Weights of a network that filters, whose light is written, too.
    #[arg(long, value_name = "FILE", help_heading = SAMPLES)]
    weights: Option<PathBuf>,
    /// Constants of gather whose histories are written, such as rays=0.5 or rays=4000 [default:
    /// its own].
    #[arg(long, value_name = "LIST", help_heading = SAMPLES)]
    gather: Option<gather::Options>,
    /// Folder to write; samples that exist are kept, so a stopped run resumes.
    #[arg(long, value_name = "DIR", help_heading = SAMPLES)]
    out: PathBuf,
    /// Only every n-th room or view from the i-th, such as 0/4, 1/4 ... for four machines.
    #[arg(long, default_value = "0/1", value_parser = parse_shard, value_name = "I/N", help_heading = SAMPLES)]
    shard: [u32; 2],
    /// Also write each room as .glb with a _views.json, for targets from Cycles.
    #[arg(long, help_heading = SAMPLES)]
    export: bool,
}

/// Headings of the help.
const SCENES: &str = "Scenes";
/// As [`SCENES`].
const SAMPLES: &str = "Samples";

/// Examples at the end of the help.
pub const EXAMPLES: &str = "\
Examples:
  bouncelight dataset --rooms 2-9 --spp 256 --moments 1,2,8,pan --out data
  bouncelight dataset --recipe home --rooms 0-99 --spp 16 --moments 1,8 --out data --shard 0/4
  bouncelight dataset --recipe scene --scene scene.glb --spp 256 --moments 1,8,20 --out data";

#[derive(Debug, Clone, Copy, PartialEq, clap::ValueEnum)]
enum Recipe {
    // The scene stream of the paper's authors.
    PaperRoom,
    // Rooms of that kind with other lights, skies, roofs, metals, sizes and cameras.
    PaperRoomVaried,
    Home,
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
            return Err(format!("{part} is not a range of rooms"));
        }
        rooms.extend(low..=high);
    }
    Ok(Rooms(rooms))
}

fn parse_moment(text: &str) -> Result<When, String> {
    match text.parse() {
        Ok(frames) if frames > 0 => Ok(When::Frames(frames)),
        _ => [When::Pan, When::Lamp, When::Thing]
            .into_iter()
            .find(|when| when.name() == text)
            .ok_or_else(|| format!("{text} is neither a number of frames nor `pan`, `lamp` or `thing`")),
    }
}

fn parse_shard(text: &str) -> Result<[u32; 2], String> {
    let number = |t: &str| t.trim().parse::<u32>().map_err(|e| format!("{t}: {e}"));
    let (i, n) = text.split_once('/').ok_or("a shard is I/N, such as 0/4")?;
    let shard = [number(i)?, number(n)?];
    if shard[0] < shard[1] { Ok(shard) } else { Err(format!("{text}: of n shards the first is 0, the last n-1")) }
}

pub fn run(global: &Global, args: Args) -> Result<()> {
    if let (Recipe::PaperRoom, Some(Rooms(rooms))) = (args.recipe, &args.rooms) {
        let kept: Vec<_> = rooms.iter().filter(|i| JUDGED.contains(i) || **i >= JUDGED_FROM).collect();
        if !kept.is_empty() && !args.judge {
            return Err(usage(format!("rooms {kept:?} are kept for judging; add --judge to use them so")));
        }
    }
    if args.recipe != Recipe::Scene && args.lit.is_given() {
        return Err(usage("--environment, --light-radius and --sun-angle go with recipe scene".into()));
    }
    std::fs::create_dir_all(&args.out).with_context(|| format!("cannot make the folder {}", args.out.display()))?;
    interrupt::install()?;
    let gpu = global.open_gpu()?;
    if moments::ages(&args.moments).is_none() {
        return Err(usage(
            "--moments must increase: a number is a frame after the cut, `pan` takes 6 frames, `lamp` and `thing` 14"
                .into(),
        ));
    }
    let mut writer = Writer::open(gpu, &args)?;
    match (args.recipe, &args.rooms, &args.scene) {
        (Recipe::PaperRoom | Recipe::PaperRoomVaried | Recipe::Home, Some(rooms), _) => {
            many_rooms(global, &mut writer, rooms, &args)?
        }
        (Recipe::Scene, _, Some(spec)) => one_scene(global, &mut writer, spec, &args)?,
        _ => return Err(usage("--rooms goes with the rooms' recipes, --scene with recipe scene".into())),
    }
    report(&args.out)
}

/// Says before the work begins what it will take up.
fn announce(global: &Global, args: &Args, samples: usize) {
    let [w, h] = cells_of(args.size).map(u64::from);
    // The light to be learnt, its place, and each moment; about 1 KB of header.
    let planes = 7 + args.moments.len() as u64 * moments::PLANES;
    let bytes = samples as u64 * (w * h * planes * 4 + 1024);
    if !global.quiet {
        eprintln!("{samples} samples, {:.1} MB in all, in {}", bytes as f64 / 1e6, args.out.display());
    }
}

fn many_rooms(global: &Global, writer: &mut Writer, Rooms(rooms): &Rooms, args: &Args) -> Result<()> {
    let [shard, of] = args.shard;
    let mine: Vec<u32> = rooms.iter().copied().skip(shard as usize).step_by(of as usize).collect();
    let home = args.recipe == Recipe::Home;
    let count = if home { args.views.min(home::CAMERAS as u32) } else { args.views };
    announce(global, args, mine.len() * count as usize);
    let mut progress = Progress::new(global, "views", mine.len() as u64 * u64::from(count));
    let (kind, build): (&str, fn(u32) -> Scene) = match args.recipe {
        Recipe::PaperRoomVaried => ("varied", varied::scene),
        Recipe::Home => ("home", home::scene),
        _ => ("room", paper_room::scene),
    };
    for room in mine {
        let name = format!("{kind}{room:04}");
        let stem = |view: u32| format!("{name}_view{view}");
        let views_of = |scene: &Scene| -> Vec<Camera> {
            if home {
                return scene.cameras.iter().take(count as usize).cloned().collect();
            }
            (0..count).map(|view| turned(&scene.cameras[0], view as f32 / count as f32)).collect()
        };
        if args.export {
            // Written again by every run: the next one may ask for more views.
            let scene = build(room);
            bouncelight_scene::export::write_glb(&scene, &writer.out.join(format!("{name}.glb")))?;
            record_views(writer, &name, &scene.name, u64::from(room), &views_of(&scene), &scene)?;
        }
        let mut missing = Vec::new();
        for view in 0..count {
            if writer.has(&stem(view))? {
                progress.step();
            } else {
                missing.push(view);
            }
        }
        if missing.is_empty() {
            continue;
        }
        let scene = build(room);
        let mut uploaded = writer.upload(&scene)?;
        let cameras = views_of(&scene);
        for view in missing {
            let camera = &cameras[view as usize];
            writer.write(&stem(view), &mut uploaded, camera, room.wrapping_mul(10_007).wrapping_add(view))?;
            progress.step();
        }
    }
    progress.finish();
    Ok(())
}

/// Views in which much of the picture is closer than this part of the scene's size stand in front
/// of a wall or in one.
const TOO_CLOSE: f32 = 0.03;

fn one_scene(global: &Global, writer: &mut Writer, spec: &str, args: &Args) -> Result<()> {
    let mut scene = bouncelight_lab::scenes::load_with(spec, global.load_options())?;
    args.lit.apply(&mut scene)?;
    let mut uploaded = writer.upload(&scene)?;
    let stem = Path::new(spec).file_stem().map_or(spec.into(), |s| s.to_string_lossy().into_owned());
    let [shard, of] = args.shard;
    announce(global, args, (args.views.saturating_sub(shard)).div_ceil(of) as usize);
    let mut progress = Progress::new(global, "views", args.views.into());
    let mut cameras = Vec::new();
    for camera in around(&scene, args.seed).take(args.views as usize * 20) {
        let view = cameras.len() as u32;
        if view == args.views {
            break;
        }
        // Which views are fit is found out by drawing them, the same ones by every shard.
        if writer.closer_than(&uploaded.raster, &camera, TOO_CLOSE * scene_size(&scene))? > 0.1 {
            continue;
        }
        let name = format!("{stem}_view{view}");
        if view % of == shard && !writer.has(&name)? {
            writer.write(&name, &mut uploaded, &camera, view)?;
        }
        cameras.push(camera);
        progress.step();
    }
    progress.finish();
    record_views(writer, &stem, spec, args.seed, &cameras, &scene)
}

/// Writes where the cameras stand, and what glTF has no field for, so whoever renders the targets
/// needs it from here.
fn record_views(writer: &Writer, stem: &str, spec: &str, seed: u64, cameras: &[Camera], scene: &Scene) -> Result<()> {
    let size = |l: &scene::Light| match l.kind {
        LightKind::Directional { angle, .. } => json!({ "name": l.name, "angle": angle }),
        LightKind::Point { radius, .. } | LightKind::Spot { radius, .. } => json!({ "name": l.name, "radius": radius }),
    };
    let view = |c: &Camera| json!({ "world_from_camera": c.transform, "yfov": c.yfov });
    let record = json!({
        "schema": 1, "scene": spec, "seed": seed, "size": writer.size(),
        "views": cameras.iter().map(view).collect::<Vec<_>>(),
        "environment": scene.environment.radiance, "lights": scene.lights.iter().map(size).collect::<Vec<_>>(),
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
    say!("{} files, {:.1} MB in {}", sizes.len(), sizes.iter().sum::<u64>() as f64 / 1e6, out.display());
    Ok(())
}
