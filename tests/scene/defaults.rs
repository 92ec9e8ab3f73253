//! The camera and the light that scenes get which bring none.

use bouncelight::scene::{
    Camera, Instance, Light, LightKind, Material, Mesh, Scene, defaults,
    shapes::{self, Shape},
};
use glam::{Mat4, Quat, Vec3};

/// A scene of one mesh, placed once.
fn one(mesh: Mesh, material: Material, transform: Mat4) -> Scene {
    Scene {
        name: "one".to_owned(),
        meshes: vec![mesh],
        materials: vec![material],
        instances: vec![Instance { name: "it".to_owned(), mesh: 0, transform: transform.to_cols_array_2d() }],
        ..Scene::default()
    }
}

/// A cube without its +Z face, twice as wide as deep.
fn open_box() -> Mesh {
    let mut mesh = shapes::flat(Shape::Cube);
    let front = |t: &&[u32]| mesh.normals[t[0] as usize][2] > 0.5;
    mesh.indices = mesh.indices.chunks_exact(3).filter(|t| !front(t)).flatten().copied().collect();
    mesh
}

#[test]
fn the_camera_looks_into_the_open_side() {
    for quarter in 0..4 {
        let turn = Quat::from_rotation_y(quarter as f32 * std::f32::consts::FRAC_PI_2);
        let inside = Material { double_sided: true, ..Material::default() };
        let scene = one(open_box(), inside, Mat4::from_rotation_translation(turn, Vec3::new(7.0, -3.0, 1.0)));
        let forward = Vec3::from(defaults::framing_camera(&scene).forward());
        assert!(forward.dot(turn * Vec3::NEG_Z) > 0.9, "turned {quarter} times: {forward}");
    }
    // Negative control: a closed cube is seen from the front, whichever way it is turned.
    let closed = one(shapes::flat(Shape::Cube), Material::default(), Mat4::from_rotation_y(1.0));
    assert!(defaults::framing_camera(&closed).forward()[2] < -0.8);
}

#[test]
fn everything_is_in_the_picture() {
    let stretched = Mat4::from_scale_rotation_translation(
        Vec3::new(30.0, 2.0, 0.5),
        Quat::from_rotation_z(0.3),
        Vec3::new(100.0, 50.0, -20.0),
    );
    for shape in Shape::ALL {
        let scene = one(shapes::flat(shape), Material::default(), stretched);
        let camera = defaults::framing_camera(&scene);
        let to_view = Mat4::from_cols_array_2d(&camera.transform).inverse();
        let slope = (camera.yfov / 2.0).tan();
        let mut widest = 0.0f32;
        for p in &scene.meshes[0].positions {
            let v = to_view.transform_point3(stretched.transform_point3((*p).into()));
            assert!(v.z < -camera.near, "{}: in front of the near plane", shape.name());
            widest = widest.max(v.x.abs().max(v.y.abs()) / (-v.z * slope));
        }
        assert!(widest < 1.0 && widest > 0.5, "{}: {widest}", shape.name());
    }
}

#[test]
fn look_at_makes_a_rotation() {
    for (eye, target) in [([1.0, 2.0, 3.0], [-4.0, 0.0, 1.0]), ([0.0, 5.0, 0.0], [0.0; 3]), ([1.0; 3], [1.0; 3])] {
        let camera = Camera::look_at(eye, target, 1.0);
        let m = Mat4::from_cols_array_2d(&camera.transform);
        assert!((m.determinant() - 1.0).abs() < 1e-5);
        assert_eq!(camera.eye(), eye);
        let wanted = (Vec3::from(target) - Vec3::from(eye)).normalize_or(Vec3::NEG_Z);
        assert!(Vec3::from(camera.forward()).dot(wanted) > 0.9999);
        assert!(camera.near > 0.0);
    }
}

fn completed(mut scene: Scene) -> (Vec<Light>, Scene) {
    defaults::complete(&mut scene);
    (scene.lights.clone(), scene)
}

#[test]
fn glowing_surfaces_are_stood_for_by_lights() {
    let glow = Material { emissive: [4.0, 2.0, 0.0], ..Material::default() };
    let mut square = shapes::flat(Shape::Cube);
    let down: Vec<u32> =
        square.indices.chunks_exact(3).filter(|t| square.normals[t[0] as usize][1] < -0.5).flatten().copied().collect();
    square.indices = down;
    let place = Mat4::from_translation(Vec3::new(0.0, 9.0, 0.0)) * Mat4::from_scale(Vec3::new(1.5, 1.0, 1.0));
    let (lights, scene) = completed(one(square, glow.clone(), place));
    let [Light { color, kind: LightKind::Spot { position, direction, intensity, radius, outer_angle, .. }, .. }] =
        lights[..]
    else {
        panic!("one spot: {lights:?}")
    };
    // A 3 m by 2 m sheet at y = 8.
    assert_eq!(color, [1.0, 0.5, 0.0]);
    assert!((intensity - 4.0 * 6.0).abs() < 1e-3 && (radius - (6.0 / std::f32::consts::PI).sqrt()).abs() < 1e-4);
    assert!(Vec3::from(direction).distance(Vec3::NEG_Y) < 1e-5);
    let below = 8.0 - position[1];
    assert!(below > 0.0 && below < 0.05, "just off the surface: {below}");
    assert_eq!(outer_angle, std::f32::consts::FRAC_PI_2);
    assert_eq!(scene.warnings.len(), 1);
    assert_eq!(scene.environment.radiance, [0.0; 3]);

    let (lights, _) = completed(one(shapes::flat(Shape::UvSphere), glow.clone(), Mat4::IDENTITY));
    let [Light { kind: LightKind::Point { position, intensity, radius, .. }, .. }] = lights[..] else {
        panic!("one point: {lights:?}")
    };
    // A ball of radius 1 has the intensity radiance times π; the polygon is a little smaller.
    assert!((intensity / (4.0 * std::f32::consts::PI) - 1.0).abs() < 0.02, "{intensity}");
    assert!(Vec3::from(position).length() < 1e-4 && (radius - 1.0).abs() < 0.02);

    // Only the four strongest of many; a dark scene gets the sun.
    let mut many = one(shapes::flat(Shape::UvSphere), glow.clone(), Mat4::IDENTITY);
    for i in 1..9 {
        let transform = Mat4::from_scale(Vec3::splat(i as f32)).to_cols_array_2d();
        many.instances.push(Instance { name: format!("{i}"), mesh: 0, transform });
    }
    let (lights, _) = completed(many);
    let names: Vec<_> = lights.iter().map(|l| &l.name[..1]).collect();
    assert_eq!(names, ["8", "7", "6", "5"]);
    let (lights, scene) = completed(one(shapes::flat(Shape::Cube), Material::default(), Mat4::IDENTITY));
    assert!(matches!(lights[0].kind, LightKind::Directional { irradiance: 1.0, direction, .. } if direction[1] < -0.5));
    assert!(scene.warnings[0].contains("sun"));
}
