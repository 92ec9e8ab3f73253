//! A lamp or a thing on its way to where a scene has it: what samples of a filter show of light that
//! changes.

use super::error::DatasetError;
use bouncelight::gpu::Gpu;
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::numbers::SplitMix;
use bouncelight::scene::{Camera, Light, LightKind, Scene, bounds::instance_bounds, environment::EnvironmentImage};
use glam::{Mat4, Quat, Vec3};
use std::{ops::Range, sync::Arc};

/// Lamps nearest to what the camera looks at, and things largest to its eye, of which one is drawn.
const LAMPS: usize = 2;
const THINGS: usize = 4;
/// Where that is, metres before the eye.
const AHEAD: f32 = 2.0;
/// Sides of what a person moves, metres, and how far from the eye it stands.
const SIDES: Range<f32> = 0.1..2.0;
const DISTANCES: Range<f32> = 0.3..8.0;
/// Tangents of angles to the axis of view over that of the picture's border up to which a thing's
/// middle is looked for.
const WITHIN: f32 = 0.8;

/// What a change begins with; it ends with the scene.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// Another light in the place of one.
    Lamp {
        /// Index into [`Scene::lights`].
        light: usize,
        /// What it begins as: of the same kind.
        from: Box<Light>,
    },
    /// Surroundings of another strength.
    Sky {
        /// So many times the scene's.
        times: f32,
    },
    /// A thing elsewhere.
    Thing {
        /// Indices into [`Scene::instances`].
        parts: Range<usize>,
        /// Where it begins, from where it stands, metres.
        from: Vec3,
    },
}

impl Change {
    /// Of a lamp near what the camera looks at (a sun is near everything): dimmed or brightened to 0
    /// to 2 times its strength, or moved by up to 0.8 metres or 20°. Of the sky where there is no
    /// lamp; `None` where there is neither. The same seed gives the same change.
    pub fn of_lamp(scene: &Scene, camera: &Camera, seed: u32) -> Option<Self> {
        let mut numbers = SplitMix::new(0x1a39_0000_0000 | u64::from(seed));
        let place = Mat4::from_cols_array_2d(&camera.transform);
        let looked_at = place.transform_point3(Vec3::NEG_Z * AHEAD);
        let distance = |light: &Light| match light.kind {
            LightKind::Directional { .. } => 0.0,
            LightKind::Point { position, .. } | LightKind::Spot { position, .. } => looked_at.distance(position.into()),
        };
        let own = scene.lights.iter().enumerate().filter(|(_, l)| !l.is_emissive_proxy);
        let mut near: Vec<(f32, usize)> = own.map(|(i, l)| (distance(l), i)).collect();
        near.sort_by(|a, b| a.0.total_cmp(&b.0));
        near.truncate(LAMPS);
        let times = 2.0 * numbers.next();
        if near.is_empty() {
            return scene.environment.radiance.iter().any(|v| *v > 0.0).then_some(Self::Sky { times });
        }
        let light = near[(numbers.next() * near.len() as f32) as usize % near.len()].1;
        let mut from = scene.lights[light].clone();
        let moves = numbers.next() < 0.5;
        let mut within = |most: f32| most * (2.0 * numbers.next() - 1.0);
        let by = Vec3::new(within(0.8), within(0.3), within(0.8));
        let turn = Quat::from_rotation_y(within(20f32.to_radians())) * Quat::from_rotation_x(within(0.2));
        match &mut from.kind {
            LightKind::Directional { direction, irradiance, .. } => match moves {
                true => *direction = (turn * Vec3::from(*direction)).into(),
                false => *irradiance *= times,
            },
            LightKind::Point { position, intensity, .. } | LightKind::Spot { position, intensity, .. } => match moves {
                true => *position = (Vec3::from(*position) + by).into(),
                false => *intensity *= times,
            },
        }
        Some(Self::Lamp { light, from: Box::new(from) })
    }

    /// Of a thing in view that a person could move (neighbours in the list of instances that share
    /// a name are its parts): 0.3 to 1 metre along the floor. `None` where there is none.
    pub fn of_thing(scene: &Scene, camera: &Camera, aspect: f32, seed: u32) -> Option<Self> {
        let mut numbers = SplitMix::new(0x7419_0000_0000 | u64::from(seed));
        let view = Mat4::from_cols_array_2d(&camera.transform).inverse();
        let border = (0.5 * camera.yfov).tan();
        let mut seen: Vec<(f32, Range<usize>)> = Vec::new();
        for parts in things(scene) {
            let boxes = scene.instances[parts.clone()].iter();
            let boxes = boxes.filter_map(|i| instance_bounds(i, scene.meshes.get(i.mesh)?));
            let joined = boxes.map(|(low, high)| (Vec3::from(low), Vec3::from(high)));
            let Some((low, high)) = joined.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1))) else { continue };
            let (side, at) = ((high - low).max_element(), view.transform_point3(0.5 * (low + high)));
            let inside = at.x.abs() < -at.z * border * aspect * WITHIN && at.y.abs() < -at.z * border * WITHIN;
            if inside && SIDES.contains(&side) && DISTANCES.contains(&-at.z) {
                seen.push((side / -at.z, parts));
            }
        }
        seen.sort_by(|a, b| b.0.total_cmp(&a.0));
        seen.truncate(THINGS);
        let parts = seen.get((numbers.next() * seen.len() as f32) as usize)?.1.clone();
        let from =
            Quat::from_rotation_y(std::f32::consts::TAU * numbers.next()) * Vec3::X * (0.3 + 0.7 * numbers.next());
        Some(Self::Thing { parts, from })
    }

    /// `scene` with so much of the change undone: 0 is the scene, 1 what the change begins with.
    pub fn undone(&self, scene: &Scene, share: f32) -> Scene {
        let mut changed = scene.clone();
        match self {
            Self::Lamp { light, from } => {
                changed.lights[*light].kind = between(&scene.lights[*light].kind, &from.kind, share);
            }
            Self::Sky { times } => {
                let factor = 1.0 + (times - 1.0) * share;
                changed.environment.radiance = changed.environment.radiance.map(|v| v * factor);
                changed.environment.image = changed.environment.image.as_deref().map(|image| {
                    let rgb = image.rgb.iter().map(|v| v * factor).collect();
                    Arc::new(EnvironmentImage { rgb, ..image.clone() })
                });
            }
            Self::Thing { parts, from } => {
                for instance in &mut changed.instances[parts.clone()] {
                    for (place, by) in instance.transform[3].iter_mut().zip((*from * share).to_array()) {
                        *place += by;
                    }
                }
            }
        }
        changed
    }

    /// What was uploaded of `scene` becomes that of [`undone`](Self::undone).
    ///
    /// # Errors
    /// Of a sky that cannot be uploaded.
    pub fn upload(&self, gpu: &Gpu, raster: &mut SceneGpu, scene: &Scene, share: f32) -> Result<(), DatasetError> {
        let changed = self.undone(scene, share);
        match self {
            Self::Lamp { .. } => raster.set_lights(&gpu.device, &gpu.queue, &changed),
            Self::Sky { .. } => raster.set_environment(&gpu.device, &gpu.queue, &changed)?,
            Self::Thing { .. } => raster.set_placements(&gpu.queue, &changed),
        }
        Ok(())
    }
}

/// Neighbours in the list of instances that share a name.
fn things(scene: &Scene) -> impl Iterator<Item = Range<usize>> + '_ {
    let mut from = 0;
    scene.instances.chunk_by(|a, b| a.name == b.name).map(move |parts| {
        let range = from..from + parts.len();
        from = range.end;
        range
    })
}

/// A light between two of one kind: strength, place and direction; at 0 the first, to the bit.
fn between(first: &LightKind, second: &LightKind, share: f32) -> LightKind {
    let mix = |a: f32, b: f32| a + (b - a) * share;
    let way = |a: [f32; 3], b: [f32; 3]| Vec3::from(a).lerp(b.into(), share).to_array();
    let turned = |a: [f32; 3], b: [f32; 3]| match share == 0.0 {
        true => a,
        false => Vec3::from(a).lerp(b.into(), share).normalize_or(a.into()).to_array(),
    };
    let mut kind = *first;
    match (&mut kind, second) {
        (
            LightKind::Directional { direction, irradiance, .. },
            LightKind::Directional { direction: to, irradiance: as_strong, .. },
        ) => (*direction, *irradiance) = (turned(*direction, *to), mix(*irradiance, *as_strong)),
        (LightKind::Point { position, intensity, .. }, LightKind::Point { position: to, intensity: as_strong, .. }) => {
            (*position, *intensity) = (way(*position, *to), mix(*intensity, *as_strong))
        }
        (LightKind::Spot { position, intensity, .. }, LightKind::Spot { position: to, intensity: as_strong, .. }) => {
            (*position, *intensity) = (way(*position, *to), mix(*intensity, *as_strong))
        }
        _ => {}
    }
    kind
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenes::home;
    use bouncelight::scene::{Instance, Mesh};

    /// Two lamps and a cube of two parts before the camera, one behind it.
    fn scene() -> Scene {
        let point = |x: f32, z: f32| -> Light {
            LightKind::Point { position: [x, 0.0, z], intensity: 3.0, radius: 0.1, range: None }.into()
        };
        let mesh = Mesh {
            positions: vec![[0.0; 3], [0.5, 0.0, 0.0], [0.0, 0.5, 0.5]],
            indices: vec![0, 1, 2],
            ..Mesh::default()
        };
        let at = |name: &str, z: f32| Instance {
            name: name.into(),
            mesh: 0,
            transform: Mat4::from_translation(Vec3::Z * z).to_cols_array_2d(),
        };
        Scene {
            lights: vec![point(0.0, 50.0), point(0.0, -2.0), Light { is_emissive_proxy: true, ..point(0.0, -2.0) }],
            meshes: vec![mesh],
            instances: vec![at("behind", 3.0), at("cube", -3.0), at("cube", -3.1), at("far", -90.0)],
            ..Scene::default()
        }
    }

    fn camera() -> Camera {
        Camera::look_at([0.0; 3], [0.0, 0.0, -1.0], 1.0)
    }

    #[test]
    fn a_change_ends_with_the_scene_to_the_bit() {
        let (scene, camera) = (home::scene(0), home::scene(0).cameras[0].clone());
        for seed in 0..8 {
            let changes = [Change::of_lamp(&scene, &camera, seed), Change::of_thing(&scene, &camera, 2.0, seed)];
            for change in changes.into_iter().flatten() {
                let (end, start) = (change.undone(&scene, 0.0), change.undone(&scene, 1.0));
                let told = |s: &Scene| {
                    (
                        s.lights.clone(),
                        s.environment.clone(),
                        s.instances.iter().map(|i| i.transform).collect::<Vec<_>>(),
                    )
                };
                assert_eq!(told(&end), told(&scene), "{change:?}");
                assert_ne!(told(&start), told(&scene), "{change:?}");
                assert_eq!(
                    Some(change.clone()),
                    match change {
                        Change::Thing { .. } => Change::of_thing(&scene, &camera, 2.0, seed),
                        _ => Change::of_lamp(&scene, &camera, seed),
                    }
                );
            }
        }
    }

    #[test]
    fn things_in_view_move_whole_and_stand_ins_stay() {
        let (scene, camera) = (scene(), camera());
        for seed in 0..16 {
            let Some(Change::Thing { parts, from }) = Change::of_thing(&scene, &camera, 2.0, seed) else {
                panic!("{seed}")
            };
            assert_eq!(parts, 1..3);
            assert!(from.y == 0.0 && (0.3..=1.0).contains(&from.length()), "{from}");
            let Some(Change::Lamp { light, from }) = Change::of_lamp(&scene, &camera, seed) else { panic!("{seed}") };
            assert!(light < 2);
            let LightKind::Point { position, intensity, .. } = from.kind else { panic!("{from:?}") };
            let LightKind::Point { position: own, .. } = scene.lights[light].kind else { unreachable!() };
            // Either moves or changes, not both.
            assert!((intensity == 3.0) != (position == own) && (0.0..=6.0).contains(&intensity), "{from:?}");
        }
        // Negative control: nothing in view, nothing that shines.
        let away = Camera::look_at([0.0; 3], [0.0, 1.0, 0.1], 1.0);
        assert_eq!(Change::of_thing(&scene, &away, 2.0, 0), None);
        assert_eq!(Change::of_lamp(&Scene::default(), &camera, 0), None);
    }

    #[test]
    fn without_lamps_the_sky_changes() {
        let mut open = Scene::default();
        open.environment.radiance = [0.5; 3];
        let Some(change @ Change::Sky { times }) = Change::of_lamp(&open, &camera(), 3) else { panic!() };
        assert!((0.0..=2.0).contains(&times));
        assert_eq!(change.undone(&open, 1.0).environment.radiance, [0.5 * times; 3]);
    }
}
