//! Draws a glTF file with Bevy, with and without the pass, into a PNG.
//!
//!     cargo run --example scene -- SCENE.glb OUT.png [--size WxH] [--frames N] [--without | --beside]
//!
//! The picture is to be compared with `bouncelight render --tonemap none`: the file's lights cast
//! shadows, lamps that stand for glowing surfaces are left out (rays find those), and 1 W/(m²·sr)
//! is white.

use bevy::gltf::{GltfExtras, GltfSceneExtras};
use bevy::light::GlobalAmbientLight;
use bevy::prelude::*;
use bevy_bouncelight::headless::Headless;
use bevy_bouncelight::{Bouncelight, BouncelightPlugin, Complaints, LUMENS_PER_WATT};
use std::process::ExitCode;

struct Args {
    scene: std::path::PathBuf,
    out: std::path::PathBuf,
    size: [u32; 2],
    frames: u32,
    with: bool,
    beside: bool,
}

fn args() -> Option<Args> {
    let mut named = Vec::new();
    let (mut size, mut frames, mut with, mut beside) = ([384, 384], 64, true, false);
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        match word.as_str() {
            "--size" => {
                let value = words.next()?;
                let (w, h) = value.split_once('x')?;
                size = [w.parse().ok()?, h.parse().ok()?];
            }
            "--frames" => frames = words.next()?.parse().ok()?,
            "--without" => with = false,
            "--beside" => beside = true,
            _ => named.push(word),
        }
    }
    let [scene, out] = <[String; 2]>::try_from(named).ok()?;
    Some(Args { scene: scene.into(), out: out.into(), size, frames, with, beside })
}

fn main() -> ExitCode {
    let Some(args) = args() else {
        eprintln!("usage: scene SCENE.glb OUT.png [--size WxH] [--frames N] [--without | --beside]");
        return ExitCode::from(2);
    };
    match draw(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("error: {why}");
            ExitCode::FAILURE
        }
    }
}

fn draw(args: &Args) -> Result<(), String> {
    let scene = std::path::absolute(&args.scene).map_err(|e| format!("{}: {e}", args.scene.display()))?;
    let (folder, file) = (scene.parent(), scene.file_name());
    let (Some(folder), Some(file)) = (folder.and_then(|f| f.to_str()), file.and_then(|f| f.to_str())) else {
        return Err(format!("{} is no file in a folder", args.scene.display()));
    };
    let mut headless = Headless::new(args.size, folder);
    headless.app.add_plugins(BouncelightPlugin { check: true });
    headless.app.insert_resource(GlobalAmbientLight { brightness: 0.0, ..default() });
    headless.app.add_systems(Update, (correct::<PointLight>, correct::<SpotLight>, correct::<DirectionalLight>, sky));
    let assets = headless.app.world().resource::<AssetServer>().clone();
    let handle = assets.load(GltfAssetLabel::Scene(0).from_asset(file.to_owned()));
    headless.app.world_mut().spawn(WorldAssetRoot(handle.clone()));
    let cameras = |world: &mut World| {
        let mut query = world.query_filtered::<(Entity, &Camera), With<Camera3d>>();
        query.iter(world).filter(|(_, c)| c.is_active).map(|(e, _)| e).next()
    };
    if !headless.wait(4000, |world| cameras(world).is_some()) {
        return Err(format!("{}: it was not loaded, or has no camera or no triangles", args.scene.display()));
    }
    let camera = cameras(headless.app.world_mut()).ok_or("there is no camera")?;
    let drawing = headless.camera();
    let mut entity = headless.app.world_mut().entity_mut(camera);
    entity.insert((drawing, bevy_bouncelight::equipment()));
    // Bevy asks for a camera's target when the camera or its lens is new.
    if let Some(mut lens) = entity.get_mut::<Projection>() {
        lens.set_changed();
    }
    let mut shots = Vec::new();
    if args.beside || !args.with {
        for _ in 0..8 {
            headless.frame();
        }
        shots.push(headless.picture().ok_or("the picture did not come")?);
    }
    if args.with {
        headless.app.world_mut().entity_mut(camera).insert(Bouncelight);
        for _ in 0..args.frames {
            headless.frame();
        }
        shots.push(headless.picture().ok_or("the picture did not come")?);
        let render = headless.app.sub_app(bevy::render::RenderApp).world();
        let complaints = render.get_resource::<Complaints>().ok_or("nothing was drawn")?;
        if complaints.cameras == 0 || !complaints.found.is_empty() {
            return Err(format!("the pass complains: {complaints:?}"));
        }
    }
    save(&shots, args)
}

/// Lamps of a file cast no shadows, and Bevy takes their linear colours for sRGB.
fn correct<L: Lamp>(mut lamps: Query<(Entity, &mut L, Option<&GltfExtras>), Added<L>>, mut commands: Commands) {
    for (entity, mut lamp, extras) in &mut lamps {
        lamp.correct();
        if extras.is_some_and(|e| e.value.contains("\"is_emissive_proxy\":true")) {
            commands.entity(entity).despawn();
        }
    }
}

/// The sky that bouncelight writes into a file, W/(m²·sr); others have none.
fn sky(extras: Query<&GltfSceneExtras, Added<GltfSceneExtras>>, mut commands: Commands) {
    for extras in &extras {
        let Ok(value) = serde_json::from_str::<serde_json::Value>(&extras.value) else { continue };
        let radiance = |i: usize| value["bouncelight"]["environment"][i].as_f64().unwrap_or_default() as f32;
        let color = Color::linear_rgb(radiance(0), radiance(1), radiance(2));
        commands.insert_resource(ClearColor(color));
        commands.insert_resource(GlobalAmbientLight { color, brightness: LUMENS_PER_WATT, ..default() });
    }
}

trait Lamp: Component<Mutability = bevy::ecs::component::Mutable> {
    fn correct(&mut self);
}

fn linear(color: Color) -> Color {
    let read = color.to_srgba();
    Color::linear_rgb(read.red, read.green, read.blue)
}

impl Lamp for PointLight {
    fn correct(&mut self) {
        (self.shadow_maps_enabled, self.color) = (true, linear(self.color));
    }
}

impl Lamp for SpotLight {
    fn correct(&mut self) {
        (self.shadow_maps_enabled, self.color) = (true, linear(self.color));
    }
}

impl Lamp for DirectionalLight {
    fn correct(&mut self) {
        (self.shadow_maps_enabled, self.color) = (true, linear(self.color));
    }
}

/// Side by side, whole or not at all.
fn save(shots: &[Image], args: &Args) -> Result<(), String> {
    let [w, h] = args.size.map(|n| n as usize);
    let mut all = vec![0; 4 * w * h * shots.len()];
    for (number, shot) in shots.iter().enumerate() {
        let rows = shot.data.as_deref().ok_or("the picture is empty")?.chunks_exact(4 * w);
        for (row, pixels) in rows.take(h).enumerate() {
            let at = 4 * w * (row * shots.len() + number);
            all[at..at + 4 * w].copy_from_slice(pixels);
        }
    }
    let mut image = shots[0].clone();
    image.texture_descriptor.size.width = (w * shots.len()) as u32;
    image.data = Some(all);
    let picture = image.try_into_dynamic().map_err(|e| e.to_string())?.into_rgb8();
    let failed = |e: &dyn std::fmt::Display| format!("{}: {e}", args.out.display());
    let part = args.out.with_extension("part.png");
    picture.save(&part).map_err(|e| failed(&e))?;
    std::fs::rename(&part, &args.out).map_err(|e| failed(&e))
}
