//! Flats and streets made by code: the same again, fit to be looked at, of every kind, and closed
//! where they should be.

use crate::shared::assert_sound;
use bouncelight::accel::SceneBlocks;
use bouncelight::scene::{self, Camera, LightKind, Scene, bounds::instance_bounds};
use bouncelight_lab::scenes::home;
use glam::{Mat4, Vec3};

/// Names of what only flats and only streets have.
fn has(scene: &Scene, name: &str) -> bool {
    scene.instances.iter().any(|i| i.name == name)
}

/// Skies by day are brighter than by night.
fn by_day(scene: &Scene) -> bool {
    scene.environment.radiance.iter().any(|c| *c > 0.1)
}

fn triangles(scene: &Scene) -> usize {
    scene.instances.iter().map(|i| scene.meshes[i.mesh].indices.len() / 3).sum()
}

/// Lowest and highest corner of each instance.
fn boxes(scene: &Scene) -> Vec<(Vec3, Vec3)> {
    let of = |i: &scene::Instance| instance_bounds(i, &scene.meshes[i.mesh]).expect("placed");
    scene.instances.iter().map(of).map(|(low, high)| (low.into(), high.into())).collect()
}

/// Whether `eye` is at least `by` metres away from all boxes.
fn stands_free(boxes: &[(Vec3, Vec3)], eye: Vec3, by: f32) -> bool {
    !boxes.iter().any(|(low, high)| (*low - by).cmplt(eye).all() && eye.cmplt(*high + by).all())
}

/// The nearest surface in the middle of a camera's picture, metres.
fn nearest_ahead(blocks: &SceneBlocks, camera: &Camera) -> f32 {
    let [right, up, back, _] = camera.transform.map(|[x, y, z, _]| Vec3::new(x, y, z));
    let steps = [-0.12f32, 0.0, 0.12];
    let directions = steps.into_iter().flat_map(|x| steps.map(|y| (right * x + up * y - back).normalize()));
    let hits = directions.filter_map(|d| blocks.walk(camera.eye(), d.into(), (1e3, false), 0, &mut |_| {}));
    hits.map(|(hit, _)| hit.t).fold(f32::INFINITY, f32::min)
}

/// How many of 2,000 directions from `eye` meet nothing.
fn misses(blocks: &SceneBlocks, eye: [f32; 3]) -> usize {
    let direction = |i: usize| {
        let y = 1.0 - (2 * i + 1) as f32 / 2_000.0;
        let (sin, cos) = (2.399_963_2 * i as f32).sin_cos();
        let out = (1.0 - y * y).sqrt();
        [cos * out, y, sin * out]
    };
    (0..2_000).filter(|&i| blocks.walk(eye, direction(i), (1e6, true), 0, &mut |_| {}).is_none()).count()
}

#[test]
fn homes_are_the_same_again() {
    for index in [0, 5, 13, 4_711, home::MAX_INDEX] {
        // Numbers are written with as many digits as it takes to tell them apart.
        let told = |i: u32| format!("{:?}", Scene { name: String::new(), ..home::scene(i) });
        assert!(told(index) == told(index), "home {index}");
        // Negative control: its neighbour is another.
        assert!(told(index) != told(index ^ 1), "home {index}");
    }
    assert_eq!(bouncelight_lab::scenes::load("home:7").expect("made by code").name, "home:7");
}

#[test]
fn homes_can_be_looked_at() {
    for index in 0..60 {
        let home = home::scene(index);
        assert_sound(&home);
        let count = triangles(&home);
        assert!((500..=60_000).contains(&count), "home {index}: {count} triangles");
        for i in &home.instances {
            let volume = Mat4::from_cols_array_2d(&i.transform).determinant().abs();
            assert!(volume > 1e-12, "home {index}: {} has no volume ({volume:e})", i.name);
        }
        let glows = home.materials.iter().any(|m| m.emissive != [0.0; 3]);
        assert!(!home.lights.is_empty() || glows || by_day(&home), "home {index}: light");
        assert_eq!(home.cameras.len(), 3, "home {index}");
        let (boxes, blocks) = (boxes(&home), SceneBlocks::new(&home).expect("trees"));
        let floors = home.instances.iter().zip(&boxes).filter(|(i, _)| ["floor", "road"].contains(&&*i.name));
        let floors: Vec<_> = floors.map(|(_, b)| *b).collect();
        for camera in &home.cameras {
            let eye = Vec3::from(camera.eye());
            assert!((45.0..=75.0).contains(&camera.yfov.to_degrees()));
            assert!(stands_free(&boxes, eye, 0.25), "home {index}: {} at {eye}", camera.name);
            let above = |(low, high): &(Vec3, Vec3)| low.x < eye.x && eye.x < high.x && low.z < eye.z && eye.z < high.z;
            assert!(floors.iter().any(above), "home {index}: {} at {eye} is outside", camera.name);
            let near = nearest_ahead(&blocks, camera);
            assert!(near >= 0.5, "home {index}: {} looks at something {near} m away", camera.name);
        }
        // Negative control: within a thing nobody stands free.
        let (low, high) = boxes[boxes.len() / 2];
        assert!(!stands_free(&boxes, 0.5 * (low + high), 0.01));
    }
}

#[test]
fn homes_are_of_every_kind() {
    let (mut days, mut suns, mut closed, mut night_flats, mut streets) = (0, 0, 0, 0, 0);
    let (mut points, mut spots, mut panels, mut glowing, mut parts, mut shiny) = (0, 0, 0, 0, 0, 0);
    for index in 0..600 {
        let home = home::scene(index);
        let street = has(&home, "road");
        streets += u32::from(street);
        assert_eq!(home.cameras.len(), 3, "home {index}");
        let sun = |l: &scene::Light| matches!(l.kind, LightKind::Directional { .. });
        if by_day(&home) {
            days += 1;
            suns += u32::from(home.lights.iter().any(sun));
        } else {
            assert!(!home.lights.iter().any(sun), "home {index}: a sun by night");
            night_flats += u32::from(!street);
            closed += u32::from(!street && !has(&home, "window frame"));
        }
        points += u32::from(home.lights.iter().any(|l| matches!(l.kind, LightKind::Point { .. })));
        spots +=
            u32::from(home.lights.iter().any(|l| matches!(l.kind, LightKind::Spot { .. }) && !l.is_emissive_proxy));
        panels += u32::from(home.lights.iter().any(|l| l.is_emissive_proxy));
        glowing += u32::from(has(&home, "glowing shade"));
        let materials = home.instances.iter().map(|i| &home.materials[home.meshes[i.mesh].material]);
        shiny += materials.filter(|m| m.metallic > 0.5 || m.roughness < 0.25).count();
        parts += home.instances.len();
    }
    let share = |n: u32, of: u32| f64::from(n) / f64::from(of);
    let shiny = shiny as f64 / parts as f64;
    println!(
        "streets {streets}, days {days}, suns {suns}, closed {closed} of {night_flats}; with points {points}, spots \
         {spots}, panels {panels}, glowing shades {glowing}; {:.1} % of the parts are metal or glossy",
        100.0 * shiny
    );
    assert_eq!(streets, 100);
    assert!((share(days, 600) - 0.55).abs() < 0.06 && (share(suns, days) - 0.65).abs() < 0.08);
    assert!((share(closed, night_flats) - 0.3).abs() < 0.1);
    assert!([points, spots, panels, glowing].iter().all(|n| *n >= 20));
    assert!((0.03..0.16).contains(&shiny));
}

#[test]
fn walls_do_not_leak() {
    let (mut closed, mut open, mut seen) = (0, 0, 0);
    for index in 0..120 {
        let mut home = home::scene(index);
        if has(&home, "road") {
            continue;
        }
        let blocks = SceneBlocks::new(&home).expect("trees");
        let lost: usize = home.cameras.iter().map(|c| misses(&blocks, c.eye())).sum();
        if has(&home, "window frame") {
            open += 1;
            seen += u32::from(lost > 0);
            continue;
        }
        closed += 1;
        assert_eq!(lost, 0, "home {index} leaks");
        // Negative control: without its ceiling it does.
        home.instances.retain(|i| i.name != "ceiling");
        let blocks = SceneBlocks::new(&home).expect("trees");
        assert!(home.cameras.iter().all(|c| misses(&blocks, c.eye()) > 100), "home {index}: an open top");
    }
    println!("{closed} closed flats; the sky is seen from {seen} of {open} with windows");
    assert!(closed >= 5 && 3 * seen > 2 * open);
}
