//! EXT_lights_area (a draft of Khronos; Babylon.js reads and writes it): flat lights, as surfaces
//! that glow on one side.

use super::Loader;
use super::instancing::Copy;
use bouncelight::scene::{Instance, LUMENS_PER_WATT, Light, LightKind, Material, Mesh};
use glam::{Mat4, Vec3};
use serde::Deserialize;
use std::f32::consts::{FRAC_PI_2, PI, TAU};

pub(super) const NAME: &str = "EXT_lights_area";
/// Corners of a disc.
const SIDES: u32 = 64;

/// One of the file's area lights.
#[derive(Deserialize)]
#[serde(default)]
struct Area {
    color: [f32; 3],
    /// Candela per square metre.
    intensity: f32,
    #[serde(rename = "type")]
    shape: String,
    size: f32,
    rect: Rect,
}

impl Default for Area {
    fn default() -> Self {
        Self { color: [1.0; 3], intensity: 1000.0, shape: "rect".into(), size: 1.0, rect: Rect::default() }
    }
}

#[derive(Deserialize)]
#[serde(default)]
struct Rect {
    aspect: f32,
}

impl Default for Rect {
    fn default() -> Self {
        Self { aspect: 1.0 }
    }
}

impl Loader<'_> {
    /// Adds the area light of a node, if it has one: a surface that glows along the node's −Z, with
    /// a light that stands in for it where surfaces light nothing.
    pub(super) fn area_light(&mut self, node: &gltf::Node<'_>, name: &str, place: &str, world: Mat4) {
        let root = self.document.as_json();
        let own = root.nodes[node.index()].extensions.as_ref().and_then(|e| e.others.get(NAME));
        let Some(index) = own.and_then(|e| e.get("light")) else { return };
        let place = format!("{place}.extensions.{NAME}");
        let lights = root.extensions.as_ref().and_then(|e| e.others.get(NAME)).and_then(|e| e.get("lights"));
        let light = index.as_u64().and_then(|i| lights?.get(usize::try_from(i).ok()?));
        let Some(light) = light.and_then(|l| Area::deserialize(l).ok()) else {
            return self.warn(&place, "names no area light that can be read, and is left out");
        };
        let scales = [world.x_axis, world.y_axis, world.z_axis].map(|axis| axis.length());
        let scale = scales.into_iter().fold(0.0, f32::max);
        let radiance = Vec3::from(light.color) * (light.intensity / LUMENS_PER_WATT);
        let (height, width) = (light.size, light.size * light.rect.aspect);
        let (corners, area) = match light.shape.as_str() {
            "rect" => (rectangle(width, height), width * height),
            "disk" => (disc(0.5 * light.size), 0.25 * PI * light.size * light.size),
            other => return self.warn(&place, &format!("a light of type `{other}` is not known and is left out")),
        };
        let direction = world.transform_vector3(Vec3::NEG_Z).try_normalize();
        let good = radiance.is_finite() && radiance.min_element() >= 0.0 && area.is_finite() && area > 0.0;
        let (true, Some(direction), true) = (good, direction, scales.iter().all(|s| *s > 0.0)) else {
            return self.warn(&place, "has an impossible colour, intensity, size or transform and is left out");
        };
        // Its size follows the largest of the node's scales alone.
        let copy = Copy { scale: scales.map(|s| scale / s), ..Copy::SELF };
        let (material, mesh) = (self.scene.materials.len(), self.scene.meshes.len());
        self.scene.materials.push(Material {
            name: name.to_owned(),
            base_color: [0.0, 0.0, 0.0, 1.0],
            metallic: 0.0,
            f0: 0.0,
            emissive: radiance.into(),
            ..Material::default()
        });
        let count = corners.len() as u32;
        self.scene.meshes.push(Mesh {
            name: name.to_owned(),
            normals: vec![[0.0, 0.0, -1.0]; corners.len()],
            positions: corners,
            indices: (1..count - 1).flat_map(|i| [0, i + 1, i]).collect(),
            material,
            ..Mesh::default()
        });
        let transform = (world * copy.matrix()).to_cols_array_2d();
        self.scene.instances.push(Instance { name: name.to_owned(), mesh, transform });
        self.placed.push(copy);

        let strongest = radiance.max_element();
        if strongest <= 0.0 {
            return;
        }
        let area = area * scale * scale;
        let radius = (area / PI).sqrt();
        self.scene.lights.push(Light {
            name: name.to_owned(),
            color: (radiance / strongest).into(),
            kind: LightKind::Spot {
                position: (world.w_axis.truncate() + direction * (0.01 * radius)).into(),
                direction: direction.into(),
                intensity: strongest * area,
                radius,
                range: None,
                inner_angle: 0.0,
                outer_angle: FRAC_PI_2,
            },
            is_emissive_proxy: true,
        });
    }
}

/// Corners against the clock as seen from +Z.
fn rectangle(width: f32, height: f32) -> Vec<[f32; 3]> {
    let (x, y) = (0.5 * width, 0.5 * height);
    vec![[-x, -y, 0.0], [x, -y, 0.0], [x, y, 0.0], [-x, y, 0.0]]
}

/// A polygon of the disc's area.
fn disc(radius: f32) -> Vec<[f32; 3]> {
    let step = TAU / SIDES as f32;
    let radius = radius * (step / step.sin()).sqrt();
    (0..SIDES).map(|i| [radius * (i as f32 * step).cos(), radius * (i as f32 * step).sin(), 0.0]).collect()
}
