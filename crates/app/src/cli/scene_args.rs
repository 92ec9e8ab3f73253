//! Flags about the scene, and how they turn into one, lit, posed and seen from somewhere.

use super::args::{Global, parse_size, usage};
use anyhow::{Context, Result};
use bouncelight::scene::{Camera, Environment, LightKind, Scene};
use bouncelight_scene::edit::{LightEdit, ObjectEdit};
use bouncelight_scene::look::{FRAMING, Look};
use clap::Args;
use std::path::PathBuf;

/// How a scene is lit where its file does not say.
#[derive(Debug, Args)]
#[command(next_help_heading = "Light")]
pub struct Lit {
    /// Sky: radiance in W/(m²·sr), grey or R,G,B, or a lat-long .hdr or .exr picture [default: the
    /// file's].
    #[arg(long, value_parser = parse_surroundings, value_name = "R,G,B|FILE")]
    pub environment: Option<Surroundings>,
    /// Rotation of a sky picture about the vertical, from +X towards +Z.
    #[arg(long, value_name = "DEGREES", requires = "environment", default_value_t = 0.0, allow_hyphen_values = true)]
    pub environment_turn: f32,
    /// Radius of point and spot lights, m, >= 0 [default: the file's].
    #[arg(long, value_name = "M")]
    pub light_radius: Option<f32>,
    /// Angular diameter of suns, radians, >= 0 [default: the file's].
    #[arg(long, value_name = "RAD")]
    pub sun_angle: Option<f32>,
}

impl Lit {
    /// Whether any of it is.
    pub fn is_given(&self) -> bool {
        self.environment.is_some() || self.light_radius.is_some() || self.sun_angle.is_some()
    }

    /// Lights the scene so; what a picture of the surroundings lacks is among the scene's warnings.
    pub fn apply(&self, scene: &mut Scene) -> Result<()> {
        match &self.environment {
            Some(Surroundings::Constant(radiance)) => {
                bouncelight_scene::defaults::surround(scene, Environment::constant(*radiance))
            }
            Some(Surroundings::Picture(path)) => {
                let (environment, mended) = bouncelight_scene::sky::load(path)?;
                if !self.environment_turn.is_finite() {
                    return Err(usage(format!("--environment-turn {} is not an angle", self.environment_turn)));
                }
                bouncelight_scene::defaults::surround(scene, environment.turned(self.environment_turn));
                scene.warnings.extend(mended);
            }
            None => {}
        }
        for light in &mut scene.lights {
            match &mut light.kind {
                LightKind::Directional { angle, .. } => *angle = positive("--sun-angle", self.sun_angle, *angle)?,
                LightKind::Point { radius, .. } | LightKind::Spot { radius, .. } => {
                    *radius = positive("--light-radius", self.light_radius, *radius)?;
                }
            }
        }
        Ok(())
    }
}

/// Which scene, how it is lit, and from where it is seen.
#[derive(Debug, Args)]
pub struct SceneArgs {
    /// A .gltf, .glb or .obj file, `interior`, `cornell`, `motion`, `home:N` or `paper-room:N`.
    pub scene: String,
    /// Material variant of the file, by name or number from 0.
    #[arg(long, value_name = "NAME|N", help_heading = SCENE)]
    pub variant: Option<String>,
    /// Animation of the file, by name or number from 0.
    #[arg(long, value_name = "NAME|N", help_heading = SCENE)]
    pub animation: Option<String>,
    /// Animation time; of frame 0 in a sequence.
    #[arg(long, visible_alias = "time", requires = "animation", default_value_t = 0.0, value_name = "SECONDS",
        help_heading = SCENE)]
    pub pose_time: f32,
    /// Move object N by X,Y,Z metres; repeatable.
    #[arg(long, value_name = "N X,Y,Z", help_heading = SCENE)]
    pub object: Vec<ObjectEdit>,
    /// Picture size, pixels.
    #[arg(long, default_value = "1024x512", value_parser = parse_size, allow_hyphen_values = true, value_name = "WxH",
        help_heading = CAMERA)]
    pub size: [u32; 2],
    /// Camera of the file, from 0.
    #[arg(long, default_value_t = 0, conflicts_with_all = ["eye", "look_at"], value_name = "N", help_heading = CAMERA)]
    pub camera: usize,
    /// Camera position, metres; with --look-at.
    #[arg(long, value_parser = parse_vec3, requires = "look_at", allow_hyphen_values = true, value_name = "X,Y,Z",
        help_heading = CAMERA)]
    pub eye: Option<[f32; 3]>,
    /// Point that the camera looks at, metres; with --eye.
    #[arg(long, value_parser = parse_vec3, requires = "eye", allow_hyphen_values = true, value_name = "X,Y,Z",
        help_heading = CAMERA)]
    pub look_at: Option<[f32; 3]>,
    /// Vertical field of view, 0 to 180 degrees [default: the camera's, or 45].
    #[arg(long, value_name = "D", help_heading = CAMERA)]
    pub fov: Option<f32>,
    #[command(flatten)]
    pub lit: Lit,
    /// Change light N by color, strength, direction, position or size, or add it with
    /// kind=sun|point|spot; repeatable.
    #[arg(long, value_name = "N KEY=VALUE ...", help_heading = "Light")]
    pub light: Vec<LightEdit>,
}

/// Headings of the help.
const SCENE: &str = "Scene";
/// As [`SCENE`].
const CAMERA: &str = "Camera";

impl SceneArgs {
    /// Loads the scene, tells its warnings, and applies the flags about light.
    pub fn load(&self, global: &Global) -> Result<Scene> {
        let mut scene = bouncelight_lab::scenes::load_with(&self.scene, global.load_options())?;
        self.lit.apply(&mut scene)?;
        if !global.quiet {
            for warning in &scene.warnings {
                eprintln!("warning: {warning}");
            }
        }
        if let Some(name) = &self.variant {
            let known = scene.variants.iter().position(|v| v == name).or_else(|| name.parse().ok());
            if !known.is_some_and(|n| scene.choose_variant(n)) {
                let all = scene.variants.join(", ");
                return Err(usage(format!("--variant {name}: the scene has {} variants: {all}", scene.variants.len())));
            }
        }
        if let Some(animation) = self.animation(&scene)? {
            scene.pose(animation, self.pose_time);
        }
        self.edit(&mut scene)?;
        Ok(scene)
    }

    /// Number of the animation that is asked for.
    pub fn animation(&self, scene: &Scene) -> Result<Option<usize>> {
        let Some(name) = &self.animation else { return Ok(None) };
        let rig = scene.rig.as_ref();
        let names = || rig.iter().flat_map(|r| &r.animations).map(|a| a.name.as_str()).collect::<Vec<_>>();
        match rig.and_then(|r| r.find(name)) {
            Some(found) => Ok(Some(found)),
            None => {
                let names = names();
                let text = format!("the scene has {} animations: {}", names.len(), names.join(", "));
                Err(usage(format!("--animation {name}: {}", text.trim_end_matches(": "))))
            }
        }
    }

    /// Moves everything to `time` of animation `animation`, seconds, but the vertices that only the
    /// CPU needs; changes by hand stay.
    pub fn move_to(&self, scene: &mut Scene, animation: usize, time: f32) -> Result<()> {
        scene.pose_parts(animation, time);
        self.edit(scene)
    }

    fn edit(&self, scene: &mut Scene) -> Result<()> {
        self.light.iter().try_for_each(|edit| edit.apply(scene)).map_err(|e| usage(format!("--light: {e}")))?;
        self.object.iter().try_for_each(|edit| edit.apply(scene)).map_err(|e| usage(format!("--object: {e}")))
    }

    /// The camera that the flags ask for.
    pub fn camera(&self, scene: &Scene) -> Result<Camera> {
        let fov = match self.fov {
            Some(d) if !(d > 0.0 && d < 180.0) => return Err(usage(format!("--fov {d} is not between 0 and 180"))),
            d => d.map(f32::to_radians),
        };
        if let (Some(eye), Some(target)) = (self.eye, self.look_at) {
            if eye == target {
                return Err(usage("--eye and --look-at are the same point".into()));
            }
            return Ok(Camera::look_at(eye, target, fov.unwrap_or(45f32.to_radians())));
        }
        let mut camera = scene
            .cameras
            .get(self.camera)
            .cloned()
            .with_context(|| format!("--camera {}: the scene has {} cameras", self.camera, scene.cameras.len()))
            .map_err(|e| usage(format!("{e:#}")))?;
        if camera.name == FRAMING
            && let Some(look) = Look::new(scene).filter(|_| scene.cameras.len() == 1)
        {
            // Made for any shape of picture; this one's is known.
            camera = look.camera_for(self.size[0] as f32 / self.size[1] as f32);
        }
        camera = camera.for_picture(self.size);
        camera.yfov = fov.unwrap_or(camera.yfov);
        Ok(camera)
    }
}

fn positive(flag: &str, given: Option<f32>, otherwise: f32) -> Result<f32> {
    match given {
        None => Ok(otherwise),
        Some(v) if v.is_finite() && v >= 0.0 => Ok(v),
        Some(v) => Err(usage(format!("{flag} {v} is not a length or angle"))),
    }
}

fn parse_floats(text: &str) -> Result<Vec<f32>, String> {
    text.split(',')
        .map(|t| t.trim().parse::<f32>().map_err(|e| format!("{t}: {e}")))
        .map(|v| v.and_then(|v| if v.is_finite() { Ok(v) } else { Err(format!("{v} is not a finite number")) }))
        .collect()
}

fn parse_vec3(text: &str) -> Result<[f32; 3], String> {
    parse_floats(text)?.try_into().map_err(|_| "write three numbers, such as 1,2,3".into())
}

/// What `--environment` names.
#[derive(Debug, Clone)]
pub enum Surroundings {
    /// One radiance, W/(m²·sr).
    Constant([f32; 3]),
    /// A lat-long picture.
    Picture(PathBuf),
}

fn parse_surroundings(text: &str) -> Result<Surroundings, String> {
    let lower = text.to_ascii_lowercase();
    if [".hdr", ".exr"].iter().any(|e| lower.ends_with(e)) {
        return Ok(Surroundings::Picture(text.into()));
    }
    parse_radiance(text).map(Surroundings::Constant).map_err(|e| format!("{e}; or the name of an .hdr or .exr picture"))
}

fn parse_radiance(text: &str) -> Result<[f32; 3], String> {
    let values = parse_floats(text)?;
    let rgb = match values.as_slice() {
        [grey] => [*grey; 3],
        [r, g, b] => [*r, *g, *b],
        _ => return Err("write one number or three, such as 0.05 or 0.1,0.2,0.3".into()),
    };
    if rgb.iter().any(|v| *v < 0.0) { Err("radiance cannot be negative".into()) } else { Ok(rgb) }
}
