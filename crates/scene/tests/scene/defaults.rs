//! The camera and the light that scenes get which bring none.

use bouncelight::scene::{Camera, Instance, Light, LightKind, Material, Mesh, Scene};
use bouncelight_scene::defaults;
use bouncelight_scene::look::{self, Daylight, Look};
use bouncelight_scene::shapes::{self, Shape};
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

fn first(scene: &Scene) -> Camera {
    look::first_camera(Look::new(scene).as_ref())
}

#[test]
fn the_camera_looks_into_the_open_side() {
    for quarter in 0..4 {
        let turn = Quat::from_rotation_y(quarter as f32 * std::f32::consts::FRAC_PI_2);
        let inside = Material { double_sided: true, ..Material::default() };
        let scene = one(open_box(), inside, Mat4::from_rotation_translation(turn, Vec3::new(7.0, -3.0, 1.0)));
        let forward = Vec3::from(first(&scene).forward());
        assert!(forward.dot(turn * Vec3::NEG_Z) > 0.7, "turned {quarter} times: {forward}");
    }
    // Negative control: a closed cube is seen from the front, at an angle and from above, whichever
    // way it is turned.
    let closed = one(shapes::flat(Shape::Cube), Material::default(), Mat4::IDENTITY);
    let [x, y, z] = first(&closed).forward();
    assert!(z < -0.6 && x.abs() > 0.4 && y < -0.2, "{x} {y} {z}");
    assert!(!Look::new(&closed).unwrap().is_interior(), "a solid body is no room");
}

/// How far out of the middle of a square picture the farthest of `points` is; 1 is its edge.
fn reach(camera: &Camera, points: impl Iterator<Item = Vec3>) -> f32 {
    let to_view = Mat4::from_cols_array_2d(&camera.transform).inverse();
    let slope = (camera.yfov / 2.0).tan();
    points.fold(0.0f32, |reach, p| {
        let v = to_view.transform_point3(p);
        assert!(v.z < -camera.near, "in front of the near plane");
        reach.max(v.x.abs().max(v.y.abs()) / (-v.z * slope))
    })
}

#[test]
fn everything_is_in_the_picture() {
    let stretched = Mat4::from_scale_rotation_translation(
        Vec3::new(30.0, 2.0, 0.5),
        Quat::from_rotation_z(0.3),
        Vec3::new(100.0, 50.0, -20.0),
    );
    for shape in Shape::ALL {
        for unit in [1e-3, 1.0, 1e3] {
            let place = Mat4::from_scale(Vec3::splat(unit)) * stretched;
            let scene = one(shapes::flat(shape), Material::default(), place);
            let camera = first(&scene);
            let points = scene.meshes[0].positions.iter().map(|p| place.transform_point3((*p).into()));
            let widest = reach(&camera, points);
            assert!(widest < 1.0 && widest > 0.9, "{} by {unit}: {widest}", shape.name());
        }
    }
}

#[test]
fn what_lies_far_away_does_not_count() {
    let ball = || one(shapes::flat(Shape::UvSphere), Material::default(), Mat4::IDENTITY);
    let alone = first(&ball());
    let with = |at: Vec3, size: f32| {
        let mut scene = ball();
        scene.meshes.push(shapes::flat(Shape::Cube));
        let transform = Mat4::from_scale_rotation_translation(Vec3::splat(size), Quat::IDENTITY, at).to_cols_array_2d();
        scene.instances.push(Instance { name: "far".to_owned(), mesh: 1, transform });
        first(&scene)
    };
    let apart = |a: &Camera| Vec3::from(a.eye()).distance(alone.eye().into());
    assert!(apart(&with(Vec3::new(400.0, 3.0, 0.0), 1.0)) < 1e-3, "one thing far away");
    assert!(apart(&with(Vec3::ZERO, 500.0)) < 1e-3, "a dome");
    // Negative control: what is near is part of it.
    assert!(apart(&with(Vec3::new(4.0, 0.0, 0.0), 1.0)) > 1.0);
}

#[test]
fn planes_around_a_thing_are_not_framed_and_rooms_are() {
    // A ball of radius 1 on a floor of 4.8 m by 4.8 m times `share`, with walls of 4.3 m that face it.
    let camera = |planes: usize, share: f32| {
        let mut scene = one(shapes::flat(Shape::UvSphere), Material::default(), Mat4::from_translation(Vec3::Y));
        scene.meshes.push(shapes::flat(Shape::Cube));
        let (low, high) = (share * Vec3::new(-2.4, 0.0, -2.4), share * Vec3::new(2.4, 4.3, 2.4));
        let t = 0.01;
        let slabs = [
            (low - Vec3::Y * t, high.with_y(0.0)),
            (low - Vec3::Z * t, high.with_z(low.z)),
            (low - Vec3::X * t, high.with_x(low.x)),
        ];
        for (low, high) in slabs.into_iter().take(planes) {
            let place = Mat4::from_translation(0.5 * (low + high)) * Mat4::from_scale(0.5 * (high - low));
            let transform = place.to_cols_array_2d();
            scene.instances.push(Instance { name: "plane".to_owned(), mesh: 1, transform });
        }
        first(&scene)
    };
    let apart = |planes: usize, share: f32| {
        let [a, b] = [camera(0, 1.0), camera(planes, share)].map(|c| (Vec3::from(c.eye()), Vec3::from(c.forward())));
        // From another side it may be, but no farther away.
        (a.0.distance(Vec3::Y) - b.0.distance(Vec3::Y)).abs().max(1.0 - b.1.dot((Vec3::Y - b.0).normalize()))
    };
    assert!(apart(1, 1.0) < 0.05 && apart(2, 1.0) < 0.05, "{} {}", apart(1, 1.0), apart(2, 1.0));
    // Negative controls: three planes are a room, and a small one is a base.
    assert!(apart(3, 1.0) > 0.5 && apart(1, 0.7) > 0.3, "{} {}", apart(3, 1.0), apart(1, 0.7));
}

/// A room of 6 m by 2.7 m by 4 m between slabs; `window` leaves the upper half of the +X wall open.
fn room(window: bool) -> Scene {
    let mut scene = one(shapes::flat(Shape::Cube), Material::default(), Mat4::IDENTITY);
    scene.instances.clear();
    let mut slab = |low: [f32; 3], high: [f32; 3]| {
        let (low, high) = (Vec3::from(low), Vec3::from(high));
        let place = Mat4::from_translation(0.5 * (low + high)) * Mat4::from_scale(0.5 * (high - low));
        scene.instances.push(Instance { name: "slab".to_owned(), mesh: 0, transform: place.to_cols_array_2d() });
    };
    slab([-0.3, -0.3, -0.3], [6.3, 0.0, 4.3]);
    slab([-0.3, 2.7, -0.3], [6.3, 3.0, 4.3]);
    slab([-0.3, 0.0, -0.3], [6.3, 2.7, 0.0]);
    slab([-0.3, 0.0, 4.0], [6.3, 2.7, 4.3]);
    slab([-0.3, 0.0, 0.0], [0.0, 2.7, 4.0]);
    slab([6.0, 0.0, 0.0], [6.3, if window { 1.2 } else { 2.7 }, 4.0]);
    slab([2.0, 0.0, 1.5], [3.0, 0.7, 2.5]);
    scene
}

#[test]
fn in_a_room_one_stands_in_it() {
    let within = |p: [f32; 3]| (0.2..5.8).contains(&p[0]) && (0.2..2.5).contains(&p[1]) && (0.2..3.8).contains(&p[2]);
    for window in [true, false] {
        let scene = room(window);
        let look = Look::new(&scene).unwrap();
        assert!(look.is_interior());
        let camera = look.camera();
        assert!(within(camera.eye()) && (1.0..2.0).contains(&camera.eye()[1]), "{:?}", camera.eye());
        // Whichever side one wishes to see, one stays inside.
        for back in [Vec3::X, Vec3::Z, Vec3::NEG_X] {
            let camera = look.from(back, 0.8, 1.5);
            assert!(within(camera.eye()) && Vec3::from(camera.forward()).dot(-back) > 0.9, "{back}");
        }
        match look.daylight(&camera) {
            Daylight::Openings(Some(sun)) => assert!(window && sun.x > 0.5 && sun.y > 0.2, "{sun}"),
            Daylight::Lamp { position, height } => {
                assert!(!window && within(position.into()) && (1.5..2.7).contains(&height), "{position} {height}");
            }
            other => panic!("{window}: {other:?}"),
        }
        let lit = completed(room(window)).1;
        assert!(lit.lightless && lit.default_light && lit.warnings[0].contains("room"), "{:?}", lit.warnings);
    }
    // Negative control: through a camera outside it is lit as any other thing.
    let scene = room(true);
    let outside = Camera::look_at([12.0, 4.0, 9.0], [3.0, 1.0, 2.0], 0.8);
    assert_eq!(Look::new(&scene).unwrap().daylight(&outside), Daylight::Outdoors);
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
    assert!(
        matches!(lights[0].kind, LightKind::Directional { irradiance: 2.75, direction, .. } if direction[1] < -0.5)
    );
    assert!(scene.warnings[0].contains("sun"));
}
