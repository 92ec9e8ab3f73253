//! Lights of every kind, and cameras.

use super::studio::{Feature, SUN, Shape, of, turn};
use crate::glb::Glb;
use serde_json::{Value, json};

fn list(json: &mut Value) -> &mut Value {
    &mut json["extensions"]["KHR_lights_punctual"]["lights"]
}

/// A ball under `light`, which hangs at `place` and looks down; the sky is dim.
fn lit(light: Value, place: [f32; 3]) -> Glb {
    let mut glb = of(&Shape::ball());
    *list(&mut glb.json) = json!([light]);
    glb.json["nodes"][SUN]["translation"] = json!(place);
    glb.json["nodes"][SUN]["rotation"] = json!(turn([1.0, 0.0, 0.0], -1.3));
    glb.json["scenes"][0]["extras"]["bouncelight"]["environment"] = json!([0.03, 0.03, 0.04]);
    glb
}

/// The same with an area light.
fn area(shape: &str) -> Glb {
    let mut glb = lit(json!({}), [0.2, 2.3, 0.9]);
    glb.json["extensions"].as_object_mut().expect("some").remove("KHR_lights_punctual");
    glb.json["nodes"][SUN]["extensions"] = json!({"EXT_lights_area": {"light": 0}});
    glb.json["extensions"]["EXT_lights_area"] =
        json!({"lights": [{"type": shape, "intensity": 1400.0, "size": 0.8, "color": [1.0, 0.9, 0.8]}]});
    glb
}

pub fn features() -> Vec<Feature> {
    let dark = |json: &mut Value| list(json)[0]["intensity"] = json!(0.0);
    let sun = json!({"type": "directional", "intensity": 1600.0, "color": [0.6, 0.8, 1.0]});
    let lamp = json!({"type": "point", "intensity": 1100.0, "color": [1.0, 0.8, 0.6]});
    let mut ranged = lamp.clone();
    ranged["range"] = json!(2.0);
    let spot = json!({"type": "spot", "intensity": 1800.0, "spot": {"innerConeAngle": 0.25, "outerConeAngle": 0.5}});
    let mut only_sky = of(&Shape::ball());
    *list(&mut only_sky.json) = json!([]);
    only_sky.json["nodes"][SUN] = json!({});
    let mut lens = of(&Shape::ball());
    lens.json["cameras"][0]["perspective"] = json!({"yfov": 0.35, "znear": 0.05, "aspectRatio": 1.0});
    lens.json["nodes"][2] = json!({"camera": 0, "translation": [2.6, 1.6, 2.6],
        "rotation": (glam::Quat::from_rotation_y(0.785) * glam::Quat::from_rotation_x(-0.2)).to_array()});
    let far = |json: &mut Value| json["extensions"]["EXT_lights_area"]["lights"][0]["intensity"] = json!(100.0);
    vec![
        Feature::new("directional light", "lux, coloured", lit(sun, [0.0, 3.0, 0.0]), dark),
        Feature::new("point light", "candela", lit(lamp, [0.9, 2.0, 1.2]), dark),
        Feature::new("point light with range", "nothing from 2 m on", lit(ranged, [0.9, 2.0, 1.2]), |json| {
            list(json)[0].as_object_mut().expect("a light").remove("range");
        }),
        Feature::new("spot light", "a cone with a soft rim", lit(spot, [0.0, 2.6, 0.8]), |json| {
            list(json)[0]["spot"] = json!({"innerConeAngle": 0.9, "outerConeAngle": 1.2});
        }),
        Feature::new("EXT_lights_area, rect", "a square of 0.8 m", area("rect"), far),
        Feature::new("EXT_lights_area, disk", "a disc of 0.8 m", area("disk"), far),
        Feature::new("sky alone", "no light in the file", only_sky, |json| {
            json["scenes"][0]["extras"]["bouncelight"]["environment"] = json!([0.3, 0.3, 0.2]);
        }),
        Feature::new("camera", "a long lens in another place", lens, |json| {
            json["cameras"][0]["perspective"]["yfov"] = json!(0.45);
        }),
    ]
}
