//! The paper's stream against Python's own random numbers, Blender's own vertices, and Blender's
//! exported rooms.

use bouncelight::scene::{LightKind, Scene};
use bouncelight_lab::scenes::paper_room;
use glam::{DMat3, DMat4, DQuat, DVec3, Mat4, Vec3};
use serde_json::Value;

use crate::common::shared_path;
use crate::shared::{assert_sound, hausdorff, unique, world_points};

const NUMBERS: &str = include_str!("../../../../tests/fixtures/paper_room/numbers.json");
const PRIMITIVES: &str = include_str!("../../../../tests/fixtures/paper_room/primitives.json");

fn number(value: &Value) -> f64 {
    value.as_f64().expect("a number in the fixture")
}

fn vector(value: &Value) -> DVec3 {
    DVec3::new(number(&value[0]), number(&value[1]), number(&value[2]))
}

fn y_up(v: DVec3) -> DVec3 {
    DVec3::new(v.x, v.z, -v.y)
}

/// Largest difference between a room and what the fixture says of it: (colours, vertex positions,
/// camera).
fn compare(scene: &Scene, room: &Value, primitives: &Value) -> [f64; 3] {
    let objects = room["objects"].as_array().expect("objects");
    assert_eq!(scene.instances.len(), objects.len() + 5);
    let (mut worst_color, mut worst_point) = (0.0f64, 0.0f64);
    let mut color = |material: usize, expected: DVec3| {
        let [r, g, b, a] = scene.materials[material].base_color.map(f64::from);
        assert_eq!(a, 1.0);
        worst_color = worst_color.max((DVec3::new(r, g, b) - expected).abs().max_element());
    };
    for (i, object) in objects.iter().enumerate() {
        let shape = object[0].as_str().expect("a shape's name");
        let angle = |k: usize| number(&object[k]).to_radians();
        // Turned one axis after the other by quaternions, not by the product of matrices that the
        // library forms.
        let turn =
            DQuat::from_rotation_z(angle(6)) * DQuat::from_rotation_y(angle(5)) * DQuat::from_rotation_x(angle(4));
        let at = DVec3::new(number(&object[1]), number(&object[2]), number(&object[3]));
        let vertices = primitives[shape]["vertices"].as_array().expect("vertices");
        let expected: Vec<Vec3> = vertices.iter().map(|v| y_up(turn * vector(v) + at).as_vec3()).collect();
        color(
            scene.meshes[scene.instances[i].mesh].material,
            DVec3::new(number(&object[7]), number(&object[8]), number(&object[9])),
        );
        // The first forty objects hold every shape many times over; all of them would take minutes.
        if i < 40 {
            let points = unique(world_points(scene, i));
            worst_point = worst_point.max(f64::from(hausdorff(&points, &expected)));
        }
    }
    for (i, wall) in room["walls"].as_array().expect("walls").iter().enumerate() {
        color(scene.meshes[scene.instances[objects.len() + i].mesh].material, vector(wall));
    }
    let (pitch, yaw) = (number(&room["pitch_degrees"]).to_radians(), number(&room["yaw_degrees"]).to_radians());
    let turn = DMat3::from_rotation_z(yaw) * DMat3::from_rotation_x(pitch);
    let camera = Mat4::from_cols_array_2d(&scene.cameras[0].transform).as_dmat4();
    let expected = DMat4::from_cols(
        y_up(turn.x_axis).extend(0.0),
        y_up(turn.y_axis).extend(0.0),
        y_up(turn.z_axis).extend(0.0),
        DVec3::new(0.0, 10.0, 0.0).extend(1.0),
    );
    let worst_camera = (0..4).map(|c| (camera.col(c) - expected.col(c)).abs().max_element()).fold(0.0, f64::max);
    [worst_color, worst_point, worst_camera]
}

#[test]
fn rooms_are_those_that_python_draws() {
    let numbers: Value = serde_json::from_str(NUMBERS).expect("numbers.json");
    let primitives: Value = serde_json::from_str(PRIMITIVES).expect("primitives.json");
    for index in [0u32, 7, 2199] {
        let room = paper_room::scene(index);
        assert_sound(&room);
        let worst = compare(&room, &numbers[index.to_string()], &primitives);
        println!("room {index}: colours {:.1e}, vertices {:.1e}, camera {:.1e}", worst[0], worst[1], worst[2]);
        assert!(worst.iter().all(|w| *w < 1e-4), "room {index}: {worst:?}");
    }
    // Negative control: one object's colour, one position and the camera, each a little off, are
    // noticed.
    let room = &numbers["7"];
    let mut off = paper_room::scene(7);
    off.materials[3].base_color[1] += 2e-4;
    off.instances[5].transform[3][0] += 2e-4;
    off.cameras[0].transform[3][1] += 2e-4;
    let worst = compare(&off, room, &primitives);
    assert!(worst.iter().all(|w| *w > 1e-4), "{worst:?}");
}

#[test]
fn shapes_have_blenders_vertices_area_and_outward_normals() {
    let primitives: Value = serde_json::from_str(PRIMITIVES).expect("primitives.json");
    let triangles = [12, 124, 62, 960, 80, 1152];
    for (shape, triangles) in bouncelight_scene::shapes::Shape::ALL.into_iter().zip(triangles) {
        let mesh = bouncelight_scene::shapes::flat(shape);
        let known = &primitives[shape.name()];
        assert_eq!(mesh.indices.len(), triangles * 3, "{}", shape.name());
        let mut area = 0.0;
        for t in mesh.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(mesh.positions[t[k] as usize]).as_dvec3());
            let cross = (b - a).cross(c - a);
            area += 0.5 * cross.length();
            let normal = Vec3::from(mesh.normals[t[0] as usize]).as_dvec3();
            assert!(cross.normalize().dot(normal) > 0.999, "{}: winding and normal agree", shape.name());
            // From the centre of the body; for the torus, from the centre of its tube.
            let middle = (a + b + c) / 3.0;
            let ring = DVec3::new(middle.x, 0.0, middle.z).normalize();
            let inside = if shape == bouncelight_scene::shapes::Shape::Torus { ring } else { DVec3::ZERO };
            assert!(normal.dot(middle - inside) > 0.0, "{}: outwards", shape.name());
        }
        assert!((area - number(&known["area"])).abs() < 1e-4 * area, "{}: {area}", shape.name());
        let vertices = known["vertices"].as_array().expect("vertices");
        let expected: Vec<Vec3> = vertices.iter().map(|v| y_up(vector(v)).as_vec3()).collect();
        let points = unique(mesh.positions.iter().map(|&p| p.into()).collect());
        assert_eq!(points.len(), expected.len(), "{}", shape.name());
        assert!(hausdorff(&points, &expected) < 1e-5, "{}", shape.name());
    }
}

#[test]
fn light_sky_and_lens_are_the_papers() {
    let room = bouncelight_lab::scenes::load("paper-room:7").expect("room 7");
    assert_eq!(room.name, "paper-room:7");
    assert_eq!(room.environment.radiance, [0.050_876_09; 3]);
    assert!((room.cameras[0].yfov - 0.582_913_6).abs() < 1e-6);
    assert_eq!(room.cameras[0].eye(), [0.0, 10.0, 0.0]);
    assert_eq!((room.cameras[0].near, room.cameras[0].far), (0.1, 100.0));
    assert!(room.materials.iter().all(|m| m.metallic == 0.0 && m.roughness == 0.5));
    let [light] = &room.lights[..] else { panic!("one light") };
    let LightKind::Directional { direction, irradiance, angle } = light.kind else { panic!("a sun") };
    assert_eq!((irradiance, angle), (1.0, 0.00918));
    assert!(direction[1] < -0.9, "the sun stands high: {direction:?}");
}

#[test]
fn rooms_are_those_that_blender_exported() {
    let mut seen = 0;
    for index in [2u32, 3, 4, 5] {
        let Some(path) = shared_path(&format!("reference/cycles/paper_{index:04}/scene.glb")) else { continue };
        let theirs = bouncelight_scene::gltf::load(&path).expect("the reference's glb");
        let ours = paper_room::scene(index);
        assert_eq!(ours.instances.len(), theirs.instances.len());
        for (i, instance) in ours.instances.iter().enumerate() {
            let name = &instance.name;
            let j = theirs.instances.iter().position(|t| t.name == *name).expect("an object of the same name");
            let distance = hausdorff(&unique(world_points(&ours, i)), &unique(world_points(&theirs, j)));
            assert!(distance < 1e-4, "{index} {name}: {distance}");
            let color = |s: &Scene, k: usize| s.materials[s.meshes[s.instances[k].mesh].material].base_color;
            let (a, b) = (color(&ours, i), color(&theirs, j));
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4), "{index} {name}: {a:?} {b:?}");
        }
        let (a, b) = (&ours.cameras[0], &theirs.cameras[0]);
        assert!((a.yfov - b.yfov).abs() < 1e-5);
        let flat = |m: [[f32; 4]; 4]| m.into_iter().flatten();
        assert!(flat(a.transform).zip(flat(b.transform)).all(|(a, b)| (a - b).abs() < 1e-4), "{index}: camera");
        let sun = |s: &Scene| match s.lights[0].kind {
            LightKind::Directional { direction, irradiance, .. } => (Vec3::from(direction), irradiance),
            _ => panic!("a sun"),
        };
        let (a, b) = (sun(&ours), sun(&theirs));
        assert!(a.0.distance(b.0) < 1e-5 && (a.1 - b.1).abs() < 1e-5, "{a:?} {b:?}");
        seen += 1;
    }
    println!("{seen} exported rooms compared");
    assert!(seen == 4 || seen == 0, "some of the references are missing");
    if seen > 0 {
        // Negative control: the neighbouring room is another one.
        let path = shared_path("reference/cycles/paper_0002/scene.glb").expect("was there");
        let theirs = bouncelight_scene::gltf::load(&path).expect("the reference's glb");
        let other = paper_room::scene(3);
        assert!(other.instances.iter().zip(&theirs.instances).any(|(a, b)| a.name != b.name));
    }
}
