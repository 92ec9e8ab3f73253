//! What is far from the origin or around everything, and pictures without their end.

use bouncelight::scene::{LightKind, Scene};
use serde_json::json;

use crate::repaired::{load, square, warned};
use crate::shared::world_points;

#[test]
fn pictures_without_their_end_show_what_is_there() {
    let side = 256u32;
    let pixel = |x: u32, y: u32| [x as u8, y as u8, 200, 255];
    let picture = image::RgbaImage::from_fn(side, side, |x, y| image::Rgba(pixel(x, y)));
    let coded = |format: image::ImageFormat| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        let rgb = image::DynamicImage::ImageRgba8(picture.clone()).into_rgb8();
        rgb.write_to(&mut bytes, format).expect("it is written");
        bytes.into_inner()
    };
    let shown = |name: &str, bytes: &[u8]| {
        let mut glb = square();
        let view = glb.view(bytes);
        glb.json["images"] = json!([{"bufferView": view, "mimeType": format!("image/{name}")}]);
        glb.json["textures"] = json!([{"source": 0}]);
        glb.json["materials"] = json!([{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}]);
        glb.json["meshes"][0]["primitives"][0]["material"] = json!(0);
        load(&glb)
    };
    let told = |scene: &Scene| scene.warnings.iter().any(|w| w.contains("is cut off"));
    for (name, format, slack) in [("png", image::ImageFormat::Png, 0), ("jpeg", image::ImageFormat::Jpeg, 12)] {
        let whole = coded(format);
        let right = |scene: &Scene, rows: u32| {
            let close = |(i, p): (usize, &[u8])| {
                let expected = pixel(i as u32 % side, i as u32 / side);
                p.iter().zip(expected).all(|(a, b)| a.abs_diff(b) <= slack)
            };
            scene.images[0].rgba.chunks_exact(4).enumerate().take((rows * side) as usize).all(close)
        };
        for (left, rows) in [(whole.len() - 12, 192), (whole.len() / 2, 24)] {
            let scene = shown(name, &whole[..left]);
            assert!(told(&scene) && right(&scene, rows), "{name}, {left} bytes: {:?}", scene.warnings);
            assert_eq!([scene.images[0].width, scene.images[0].height], [side; 2]);
        }
        // Negative controls: a whole one is not told so, whatever follows it; of a header alone there is nothing.
        assert!(!told(&shown(name, &whole)) && !told(&shown(name, &[&whole[..], &[7; 100]].concat())));
        assert!(right(&shown(name, &whole), side));
        let nothing = shown(name, &whole[..36]);
        assert!(nothing.images[0].name.contains("stand-in") && !told(&nothing), "{name}");
    }
}

#[test]
fn a_sphere_around_everything_is_the_sky() {
    // A small floor in a box of so many metres, seen from inside.
    let around = |size: f32, unlit: bool, textured: bool| {
        let mut glb = square();
        let corner = |i: usize, k: usize| if i >> k & 1 == 1 { size } else { -size };
        let places: Vec<f32> = (0..8).flat_map(|i| [corner(i, 0), corner(i, 1), corner(i, 2)]).collect();
        let places = glb.floats("VEC3", &places);
        let sides = [[0, 2, 6, 4], [1, 5, 7, 3], [0, 4, 5, 1], [2, 3, 7, 6], [0, 1, 3, 2], [4, 6, 7, 5]];
        let indices: Vec<u8> = sides.iter().flat_map(|s| [s[0], s[1], s[2], s[0], s[2], s[3]]).collect();
        let indices = glb.accessor("SCALAR", 5121, 36, &indices);
        // Red above and blue below.
        let colors: Vec<f32> =
            (0..8).flat_map(|i| if i >> 1 & 1 == 1 { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] }).collect();
        let colors = glb.floats("VEC3", &colors);
        let mut box_ = json!({"primitives": [{"attributes": {"POSITION": places}, "indices": indices, "material": 0}]});
        if textured {
            box_["primitives"][0]["attributes"]["COLOR_0"] = json!(colors);
        }
        glb.json["meshes"].as_array_mut().expect("a list").push(box_);
        let unlit = if unlit { json!({"KHR_materials_unlit": {}}) } else { json!({}) };
        glb.json["materials"] =
            json!([{"pbrMetallicRoughness": {"baseColorFactor": [0.4, 0.6, 0.9, 1.0]}, "extensions": unlit}]);
        glb.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}]);
        glb.json["nodes"] =
            json!([{"mesh": 0}, {"mesh": 1, "name": "sky"}, {"camera": 0, "translation": [0.0, 0.0, 1.2]}]);
        glb.json["scenes"] = json!([{"nodes": [0, 1, 2]}]);
        load(&glb)
    };
    let plain = around(30.0, true, false);
    assert_eq!(plain.instances.len(), 1);
    warned(&plain, &["'sky'", "taken for the sky"]);
    let near = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.02);
    assert!(near(plain.environment.radiance, [0.4, 0.6, 0.9]), "{:?}", plain.environment.radiance);
    assert!(!plain.lights.is_empty(), "the sun that a file without light gets");
    // As it is seen: red above, blue below.
    let coloured = around(30.0, true, true);
    let image = coloured.environment.image.expect("a picture");
    assert!(near(image.radiance([0.0, 1.0, 0.0]), [0.4, 0.0, 0.0]), "{:?}", image.radiance([0.0, 1.0, 0.0]));
    assert!(near(image.radiance([0.0, -1.0, 0.0]), [0.0, 0.0, 0.9]));
    assert!(near(image.radiance([1.0, 0.0, 0.0]), [0.2, 0.0, 0.45]));
    // Negative controls: what is lit is a room, and what is near is one, and told.
    assert_eq!(around(30.0, false, false).instances.len(), 2);
    let room = around(1.5, true, false);
    assert_eq!(room.instances.len(), 2);
    warned(&room, &["'sky'", "no light"]);
}

#[test]
fn map_coordinates_are_moved_to_the_origin() {
    let at = |x: f64, animated: bool| {
        let mut glb = square();
        let light = json!({"type": "point", "intensity": 100.0});
        glb.json["extensions"] = json!({"KHR_lights_punctual": {"lights": [light]}});
        glb.json["cameras"] = json!([{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}]);
        let lamp = json!({"light": 0});
        glb.json["nodes"] = json!([{"translation": [x, -0.75 * x, 0.5 * x], "children": [1, 2, 3]},
            {"mesh": 0, "translation": [0.125, 0.0, 0.0], "rotation": [0.0, 0.6, 0.0, 0.8]},
            {"camera": 0, "translation": [0.25, 1.0, 3.0]},
            {"translation": [0.5, 2.0, 1.0], "extensions": {"KHR_lights_punctual": lamp}}]);
        let min_max = [json!([-1.0, -1.0, 0.0]), json!([1.0, 1.0, 0.0])];
        (glb.json["accessors"][0]["min"], glb.json["accessors"][0]["max"]) = (min_max[0].clone(), min_max[1].clone());
        if animated {
            let times = glb.floats("SCALAR", &[0.0, 1.0]);
            let places = glb.floats("VEC3", &[0.125, 0.0, 0.0, 0.125, 1.0, 0.0]);
            glb.json["animations"] = json!([{"samplers": [{"input": times, "output": places}],
                "channels": [{"sampler": 0, "target": {"node": 1, "path": "translation"}}]}]);
        }
        load(&glb)
    };
    // Places relative to the camera.
    let seen = |scene: &Scene| {
        let eye = glam::Vec3::from(scene.cameras[0].eye());
        let LightKind::Point { position, .. } = scene.lights[0].kind else { panic!("a lamp") };
        let mut all = world_points(scene, 0);
        all.push(position.into());
        all.iter().map(|p| (*p - eye).to_array()).collect::<Vec<_>>()
    };
    let close = |a: &[[f32; 3]], b: &[[f32; 3]]| {
        a.as_flattened().iter().zip(b.as_flattened()).all(|(a, b)| (a - b).abs() < 2e-3)
    };
    let right = seen(&at(0.0, false));
    for x in [100_000.0, 500_000.0, 6_378_136.0, -4_649_776.0] {
        for animated in [false, true] {
            let mut far = at(x, animated);
            assert!(close(&seen(&far), &right), "{x}: {:?}", seen(&far));
            warned(&far, &["far from the file's origin"]);
            if animated {
                assert!(far.pose(0, 1.0));
                let mut near = at(0.0, true);
                near.pose(0, 1.0);
                assert!(close(&seen(&far), &seen(&near)) && !close(&seen(&far), &right));
            }
        }
    }
    // Negative control: what is near stays where it is.
    let near = at(64.0, false);
    assert_eq!(near.cameras[0].eye(), [64.25, -47.0, 35.0]);
}
