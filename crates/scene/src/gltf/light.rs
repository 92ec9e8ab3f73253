//! KHR_lights_punctual. Lux and candela become W/m² and W/sr by division by 683.

use glam::{Mat4, Vec3};
use gltf::khr_lights_punctual::Kind;

use super::Loader;
use bouncelight::scene::{LUMENS_PER_WATT, Light, LightKind, SUN_ANGLE};

/// What glTF has no field for and [`crate::export`] writes into a light's extras.
#[derive(serde::Deserialize, Default)]
#[serde(default)]
struct Extent {
    radius: Option<f32>,
    angle: Option<f32>,
    is_emissive_proxy: bool,
}

#[derive(serde::Deserialize)]
struct Extras {
    bouncelight: Extent,
}

impl Loader<'_> {
    /// Adds a light at a node. It shines along the node's −Z.
    pub(super) fn light(&mut self, light: &gltf::khr_lights_punctual::Light, node: &str, world: Mat4) {
        let place = format!("lights[{}] '{node}'", light.index());
        let strength = light.intensity() / LUMENS_PER_WATT;
        let color = light.color();
        let finite = strength.is_finite() && strength >= 0.0 && color.iter().all(|c| c.is_finite() && *c >= 0.0);
        let direction = world.transform_vector3(Vec3::NEG_Z).try_normalize();
        let (true, Some(direction)) = (finite, direction) else {
            return self.warn(&place, "has an impossible colour, intensity or transform and is left out");
        };
        let direction = direction.into();
        let position = world.w_axis.truncate().into();
        let extras = light.extras().as_ref().and_then(|raw| serde_json::from_str::<Extras>(raw.get()).ok());
        let extent = extras.map(|e| e.bouncelight).unwrap_or_default();
        let good = |v: Option<f32>| v.filter(|v| v.is_finite() && *v >= 0.0);
        let radius = good(extent.radius).unwrap_or(0.0);
        let range = good(light.range()).filter(|&r| r > 0.0);
        let kind = match light.kind() {
            Kind::Directional => {
                let angle = good(extent.angle).unwrap_or(SUN_ANGLE);
                LightKind::Directional { direction, irradiance: strength, angle }
            }
            Kind::Point => LightKind::Point { position, intensity: strength, radius, range },
            Kind::Spot { inner_cone_angle, outer_cone_angle } => {
                let outer_angle = outer_cone_angle.clamp(1e-3, std::f32::consts::FRAC_PI_2);
                let inner_angle = inner_cone_angle.clamp(0.0, outer_angle - 1e-4);
                LightKind::Spot { position, direction, intensity: strength, radius, range, inner_angle, outer_angle }
            }
        };
        self.scene.lights.push(Light {
            name: node.to_owned(),
            color,
            kind,
            is_emissive_proxy: extent.is_emissive_proxy,
        });
    }
}
