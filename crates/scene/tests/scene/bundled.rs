//! Bundled scenes, and what survives being written and read again.

use bouncelight::scene::{LightKind, Scene, bounds};
use bouncelight_lab::scenes::paper_room;
use bouncelight_scene::{bundled, export, gltf};
use glam::Vec3;

use crate::shared::assert_sound;

fn triangles(scene: &Scene) -> usize {
    scene.instances.iter().map(|i| scene.meshes[i.mesh].indices.len() / 3).sum()
}

#[test]
fn every_name_makes_a_sound_scene() {
    for name in bundled::NAMES {
        let scene = bouncelight_scene::load(name).expect("a bundled scene");
        assert_sound(&scene);
        assert!(scene.warnings.is_empty());
        assert_eq!(scene.name, *name);
        let count = triangles(&scene);
        println!("{name}: {count} triangles, {} meshes, {} images", scene.meshes.len(), scene.images.len());
        assert!(count < 20_000);
        // Deterministic to the last bit.
        assert_eq!(export::to_glb(&scene), export::to_glb(&bundled::scene(name).expect("again")));
        // Windings agree with normals, or culling would open holes.
        for mesh in &scene.meshes {
            for t in mesh.indices.chunks_exact(3) {
                let [a, b, c] = [0, 1, 2].map(|k| Vec3::from(mesh.positions[t[k] as usize]));
                let normal: Vec3 = t.iter().map(|&v| Vec3::from(mesh.normals[v as usize])).sum();
                let cross = (b - a).cross(c - a);
                assert!(cross.dot(normal) > 0.0, "{name}, {}: {a} {b} {c}", mesh.name);
            }
        }
    }
    assert!(bundled::scene("no such scene").is_none());
}

#[test]
fn the_cornell_light_has_the_flux_of_its_panel() {
    let scene = bundled::scene("cornell").expect("cornell");
    let panel = scene.meshes.iter().find(|m| m.name == "panel").expect("a panel");
    let [a, b, c] = [0, 1, 2].map(|i| Vec3::from(panel.positions[i]));
    let area = (b - a).cross(c - b).length();
    let radiance = scene.materials[panel.material].emissive[0];
    let LightKind::Spot { intensity, inner_angle, outer_angle, .. } = scene.lights[0].kind else { panic!("a spot") };
    assert_eq!((inner_angle, outer_angle), (0.0, std::f32::consts::FRAC_PI_2));
    // The cosine squared over a hemisphere is 2π/3; a diffuse emitter's flux is π L A.
    let (spot, surface) = (intensity * 2.0 / 3.0, radiance * area);
    assert!((spot - surface).abs() < 1e-3 * surface, "{spot} {surface}");
}

#[test]
fn the_animated_scene_moves_and_begins_where_it_ends() {
    let still = bundled::scene("motion").expect("motion");
    let at = |time: f32| {
        let mut scene = still.clone();
        assert!(scene.pose(0, time));
        let LightKind::Spot { position, direction, .. } = scene.lights[0].kind else { panic!("a spot") };
        let places = scene.instances.iter().flat_map(|i| i.transform.concat());
        places.chain(position).chain(direction).collect::<Vec<f32>>()
    };
    let apart = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
    let end = still.rig.as_ref().expect("animated").animations[0].end;
    let LightKind::Spot { position, .. } = still.lights[0].kind else { panic!("a spot") };
    let rest: Vec<f32> = still.instances.iter().flat_map(|i| i.transform.concat()).chain(position).collect();
    assert!(apart(&at(0.0), &rest) < 1e-5 && apart(&at(0.0), &at(end)) < 1e-5);
    for i in 1..8 {
        assert!(apart(&at(0.0), &at(end * i as f32 / 8.0 + 0.05)) > 0.05, "{i}");
    }
    // The lamp's light hangs in its shade at any time, and nothing leaves the box.
    for i in 0..64 {
        let mut scene = still.clone();
        scene.pose(0, end * i as f32 / 64.0);
        let bulb = scene.instances.iter().find(|i| i.name == "bulb").expect("a bulb");
        let mesh = &scene.meshes[bulb.mesh];
        let (low, high) = bounds::instance_bounds(bulb, mesh).expect("placed");
        let LightKind::Spot { position, .. } = scene.lights[0].kind else { panic!("a spot") };
        let middle = 0.5 * (Vec3::from(low) + Vec3::from(high));
        assert!((middle.distance(position.into()) - 0.08).abs() < 1e-3, "{middle} {position:?}");
        let (low, high) = bounds::world_bounds(&scene).expect("placed");
        assert!(low[1] > -1e-4 && high[1] < 2.001 && low[0] > -1.501 && high[0] < 1.501, "{low:?} {high:?}");
    }
}

/// Where two scenes differ by more than rounding; empty when they are the same.
fn differences(a: &Scene, b: &Scene) -> Vec<String> {
    let mut out = Vec::new();
    let mut same = |what: &str, equal: bool| {
        if !equal {
            out.push(what.to_owned());
        }
    };
    let near = |a: &[f32], b: &[f32]| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a == b || (a - b).abs() <= 1e-5 * a.abs().max(1.0))
    };
    same(
        "counts",
        (a.meshes.len(), a.instances.len(), a.images.len()) == (b.meshes.len(), b.instances.len(), b.images.len()),
    );
    same("environment", near(&a.environment.radiance, &b.environment.radiance));
    for (x, y) in a.meshes.iter().zip(&b.meshes) {
        same("mesh name", x.name == y.name);
        same("positions", x.positions == y.positions);
        same("normals", near(x.normals.as_flattened(), y.normals.as_flattened()));
        same("tangents", near(x.tangents.as_flattened(), y.tangents.as_flattened()));
        same("uv", x.uv0 == y.uv0 && x.uv1 == y.uv1);
        same("indices", x.indices == y.indices);
        let (m, n) = (&a.materials[x.material], &b.materials[y.material]);
        same("material name", m.name == n.name);
        same("base colour", m.base_color == n.base_color);
        same("emission", near(&m.emissive, &n.emissive));
        same(
            "surface",
            (m.metallic, m.roughness, m.double_sided, m.unlit) == (n.metallic, n.roughness, n.double_sided, n.unlit),
        );
        same("alpha", m.alpha_mode == n.alpha_mode);
        for (s, t) in [
            (m.base_color_texture, n.base_color_texture),
            (m.metallic_roughness_texture, n.metallic_roughness_texture),
            (m.normal_texture, n.normal_texture),
            (m.emissive_texture, n.emissive_texture),
        ] {
            same("texture", s.is_some() == t.is_some());
            if let (Some(s), Some(t)) = (s, t) {
                let (i, j) = (&a.images[s.image], &b.images[t.image]);
                same("image", i.rgba == j.rgba && i.color_space == j.color_space && i.width == j.width);
                same("sampler", s.sampler == t.sampler && s.uv_set == t.uv_set);
                same("texture transform", near(s.transform.as_flattened(), t.transform.as_flattened()));
            }
        }
    }
    for (x, y) in a.instances.iter().zip(&b.instances) {
        same("instance", x.name == y.name && x.mesh == y.mesh && x.transform == y.transform);
    }
    let numbers = |s: &Scene| -> Vec<f32> {
        let lights = s.lights.iter().flat_map(|l| {
            let mut v = l.color.to_vec();
            v.push(f32::from(u8::from(l.is_emissive_proxy)));
            match l.kind {
                LightKind::Directional { direction, irradiance, angle } => {
                    v.extend(direction);
                    v.extend([irradiance, angle]);
                }
                LightKind::Point { position, intensity, radius, range } => {
                    v.extend(position);
                    v.extend([intensity, radius, range.unwrap_or(-1.0)]);
                }
                LightKind::Spot { position, direction, intensity, radius, range, inner_angle, outer_angle } => {
                    v.extend(position);
                    v.extend(direction);
                    v.extend([intensity, radius, range.unwrap_or(-1.0), inner_angle, outer_angle]);
                }
            }
            v
        });
        let cameras = s.cameras.iter().flat_map(|c| {
            let far = if c.far.is_finite() { c.far } else { -1.0 };
            [c.transform.concat(), vec![c.yfov, c.near, far]].concat()
        });
        lights.chain(cameras).collect()
    };
    same("lights and cameras", near(&numbers(a), &numbers(b)));
    out.dedup();
    out
}

/// What a change is noticed as, and the change.
type Change = (&'static str, fn(&mut Scene));

#[test]
fn scenes_survive_being_written_and_read() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("again.glb");
    let mut all: Vec<Scene> = bundled::NAMES.iter().filter_map(|n| bundled::scene(n)).collect();
    all.push(paper_room::scene(3));
    for scene in &mut all {
        // Things that the bundled scenes do not use themselves.
        scene.materials[0].alpha_mode = bouncelight::scene::AlphaMode::Mask { cutoff: 0.3 };
        scene.materials[1].unlit = true;
        if let Some(texture) = &mut scene.materials.iter_mut().find_map(|m| m.base_color_texture.as_mut()) {
            texture.transform = [[0.6, 1.6, 0.1], [-0.8, 1.2, 0.2]];
        }
        export::write_glb(scene, &path).unwrap_or_else(|e| panic!("{e}"));
        let again = gltf::load(&path).unwrap_or_else(|e| panic!("{e}"));
        assert!(again.warnings.is_empty(), "{:?}", again.warnings);
        assert_eq!(differences(scene, &again), Vec::<String>::new(), "{}", scene.name);
        assert_eq!(bounds::world_bounds(scene), bounds::world_bounds(&again));
        // Negative controls: small changes are noticed.
        let changes: [Change; 6] = [
            ("positions", |s| s.meshes[0].positions[0][1] += 1e-4),
            ("base colour", |s| s.materials[s.meshes[0].material].base_color[0] *= 0.99),
            ("instance", |s| s.instances[0].transform[3][0] += 1e-4),
            ("lights and cameras", |s| s.cameras[0].yfov += 1e-3),
            ("lights and cameras", |s| s.lights[0].is_emissive_proxy ^= true),
            ("environment", |s| s.environment.radiance[0] += 1e-2),
        ];
        for (what, change) in changes {
            let mut off = again.clone();
            change(&mut off);
            assert_eq!(differences(scene, &off), [what]);
        }
    }
    let left = std::fs::read_dir(folder.path()).expect("readable").count();
    assert_eq!(left, 1, "no temporary file stays");
}

#[test]
fn an_empty_scene_can_be_written() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("empty.glb");
    export::write_glb(&Scene::default(), &path).expect("written");
    let message = gltf::load(&path).expect_err("there is nothing in it").to_string();
    assert!(message.contains("empty.glb: there is nothing to draw"), "{message}");
}
