//! Trees of meshes under a tree of instances: rays must meet what they meet where all triangles
//! stand in one list.

use super::oracle::*;
use bouncelight::accel::{Accel, RayCaster, SceneBlocks, SceneRays};
use bouncelight::scene::{Instance, Material, Mesh, Scene};
use glam::{Mat4, Quat, Vec3};

fn mesh(triangles: &[Triangle]) -> Mesh {
    let positions: Vec<[f32; 3]> = triangles.iter().flatten().copied().collect();
    let normals = vec![[0.0, 1.0, 0.0]; positions.len()];
    Mesh { indices: (0..positions.len() as u32).collect(), positions, normals, ..Default::default() }
}

/// Meshes of a few triangles, each placed several times: turned, stretched, mirrored.
fn placed() -> (Scene, Vec<Triangle>) {
    let mut scene = Scene { materials: vec![Material::default()], ..Default::default() };
    for (i, count) in [1usize, 40, 300].into_iter().enumerate() {
        scene.meshes.push(mesh(&soup(count, 0.4, i as u64 + 5)));
    }
    for k in 0..60u32 {
        let f = k as f32;
        let scale = Vec3::new(0.1 + 0.3 * (f * 0.7).sin().abs(), 0.2, if k % 3 == 0 { -0.2 } else { 0.3 });
        let turn = Quat::from_axis_angle(Vec3::new(f.sin(), f.cos(), 0.3).normalize(), f);
        let at = Vec3::new((f * 1.3).sin(), (f * 2.1).sin(), (f * 3.7).sin());
        let transform = Mat4::from_scale_rotation_translation(scale, turn, at).to_cols_array_2d();
        scene.instances.push(Instance { name: String::new(), mesh: k as usize % 3, transform });
    }
    let world = world_triangles(&scene);
    (scene, world)
}

fn world_triangles(scene: &Scene) -> Vec<Triangle> {
    let of = |i: &Instance| {
        let m = Mat4::from_cols_array_2d(&i.transform);
        let p = &scene.meshes[i.mesh].positions;
        scene.meshes[i.mesh]
            .indices
            .chunks_exact(3)
            .map(|t| [0, 1, 2].map(|k| m.transform_point3(p[t[k] as usize].into()).to_array()))
            .collect::<Vec<_>>()
    };
    scene.instances.iter().flat_map(of).collect()
}

/// Share of rays that meet something else, or at another distance, than in the one list.
fn different(gpu: &bouncelight::gpu::Gpu, caster: &RayCaster, rays: &SceneRays, world: &[Triangle]) -> f64 {
    let accel = Accel::build(world).unwrap();
    let sent = random_rays(4000, 1.5, 3);
    let hits = caster.trace(&gpu.device, &gpu.queue, rays.accel(), &sent).unwrap();
    let wrong = sent.iter().zip(&hits).filter(|(ray, hit)| {
        let expected = accel.closest(ray.origin, ray.direction, ray.t_max);
        match expected {
            None => hit.triangle != u32::MAX,
            Some(e) => hit.triangle == u32::MAX || (e.t - hit.t).abs() > 1e-4 * (1.0 + e.t),
        }
    });
    let met = hits.iter().filter(|h| h.triangle != u32::MAX).count();
    assert!(met > 500 && met < 3900, "{met} rays met something");
    wrong.count() as f64 / sent.len() as f64
}

#[test]
fn instances_are_met_where_they_stand_and_where_they_go() {
    let Some(gpu) = crate::common::gpu() else { return };
    let (mut scene, world) = placed();
    let mut rays = SceneRays::new(&gpu.device, &gpu.queue, &scene).expect("they fit");
    let caster = RayCaster::new(&gpu.device);
    // A ray along an edge may find either side's triangle, or a neighbour's.
    assert!(different(&gpu, &caster, &rays, &world) < 1e-3);
    for i in &mut scene.instances {
        i.transform[3][0] += 0.4;
    }
    let moved = world_triangles(&scene);
    // Negative control: nobody has told the rays yet.
    assert!(different(&gpu, &caster, &rays, &moved) > 0.1);
    rays.place(&gpu.queue, &scene);
    assert!(different(&gpu, &caster, &rays, &moved) < 1e-3);
}

/// How many of 2,000 rays meet something else by the walk on the CPU than in the one list of all
/// triangles, instances and numbers of triangles included; and the blocks that a ray reads. Any hit
/// reads no more than the nearest one does.
fn walked_wrongly(blocks: &SceneBlocks, scene: &Scene, world: &[Triangle]) -> (usize, f64) {
    let accel = Accel::build(world).unwrap();
    let sent = random_rays(2000, 1.5, 3);
    let sizes = scene.meshes.iter().map(|m| m.indices.len() as u32 / 3).collect::<Vec<_>>();
    let mut read = 0;
    let off = |ray: &&bouncelight::accel::RayGpu| {
        let (mut nearest, mut any) = (0, 0);
        let walk = |any, n: &mut usize| blocks.walk(ray.origin, ray.direction, (ray.t_max, any), 0, &mut |_| *n += 1);
        let (found, some) = (walk(false, &mut nearest), walk(true, &mut any));
        assert!(found.is_some() == some.is_some() && any <= nearest);
        read += nearest;
        match (accel.closest(ray.origin, ray.direction, ray.t_max), found) {
            (None, found) => found.is_some(),
            (Some(_), None) => true,
            (Some(e), Some((hit, instance))) => {
                // In the one list an instance's triangles follow those of the instances before it.
                let mesh = scene.instances[instance as usize].mesh;
                let before = |n: usize, of: &dyn Fn(usize) -> usize| (0..n).map(|i| sizes[of(i)]).sum::<u32>();
                let in_mesh = hit.triangle - before(mesh, &|i| i);
                let in_list = before(instance as usize, &|i| scene.instances[i].mesh) + in_mesh;
                (e.t - hit.t).abs() > 1e-4 * (1.0 + e.t) || in_list != e.triangle
            }
        }
    };
    let wrong = sent.iter().filter(off).count();
    (wrong, read as f64 / sent.len() as f64)
}

#[test]
fn the_walk_through_instances_on_the_cpu_is_the_same() {
    let (scene, world) = placed();
    assert!(walked_wrongly(&SceneBlocks::new(&scene).unwrap(), &scene, &world).0 <= 2);
    // Negative control: the blocks of a scene that has moved.
    let mut moved = scene.clone();
    moved.instances.iter_mut().for_each(|i| i.transform[3][0] += 0.4);
    assert!(walked_wrongly(&SceneBlocks::new(&moved).unwrap(), &scene, &world).0 > 200);
}

/// Six meshes in one place, among others a seventh that stands in two.
fn parts_of_one() -> Scene {
    let mut scene = Scene { materials: vec![Material::default()], ..Default::default() };
    let turn = Quat::from_axis_angle(Vec3::new(0.3, 0.9, 0.1).normalize(), 0.7);
    let at = |x: f32| Mat4::from_scale_rotation_translation(Vec3::new(0.7, 0.5, -0.6), turn, Vec3::new(x, 0.1, 0.2));
    for k in 0..7 {
        scene.meshes.push(mesh(&soup(if k == 3 { 5 } else { 120 }, 0.4, k + 30)));
        let mut put = |x| {
            let transform = at(x).to_cols_array_2d();
            scene.instances.push(Instance { name: String::new(), mesh: k as usize, transform });
        };
        put(if k == 3 { -0.8 } else { 0.0 });
        if k == 3 {
            put(0.9);
        }
    }
    scene
}

#[test]
fn meshes_in_one_place_share_a_tree_until_one_goes() {
    let mut scene = parts_of_one();
    let world = world_triangles(&scene);
    let mut blocks = SceneBlocks::new(&scene).unwrap();
    let (wrong, read) = walked_wrongly(&blocks, &scene, &world);
    assert!(wrong <= 2, "{wrong}");
    // Where each is a hair off the others all have their own.
    let mut apart = scene.clone();
    for (k, instance) in apart.instances.iter_mut().enumerate() {
        instance.transform[3][1] += 1e-6 * k as f32;
    }
    let (wrong, of_seven) = walked_wrongly(&SceneBlocks::new(&apart).unwrap(), &apart, &world);
    assert!(wrong <= 2 && read < 0.7 * of_seven, "{wrong}: {read} blocks a ray, {of_seven} of seven trees");

    // One part goes.
    scene.instances[1].transform[3][0] += 0.5;
    let world = world_triangles(&scene);
    assert!(walked_wrongly(&blocks, &scene, &world).0 > 20, "who has not heard of it");
    blocks.place(&scene);
    assert!(walked_wrongly(&blocks, &scene, &world).0 <= 2);

    let Some(gpu) = crate::common::gpu() else { return };
    let caster = RayCaster::new(&gpu.device);
    let mut scene = parts_of_one();
    let mut rays = SceneRays::new(&gpu.device, &gpu.queue, &scene).expect("they fit");
    assert!(different(&gpu, &caster, &rays, &world_triangles(&scene)) < 1e-3);
    assert_eq!((rays.counts().instances, rays.counts().left_out), (8, 0));
    let (id, version) = (rays.id(), rays.version());
    // All go: the tree stays.
    scene.instances.iter_mut().for_each(|i| i.transform[3][2] += 0.3);
    assert!(!rays.place(&gpu.queue, &scene));
    assert!(different(&gpu, &caster, &rays, &world_triangles(&scene)) < 1e-3);
    scene.instances[1].transform[3][0] += 0.5;
    assert!(different(&gpu, &caster, &rays, &world_triangles(&scene)) > 0.02);
    assert!(rays.place(&gpu.queue, &scene), "what is bound is another");
    assert!(different(&gpu, &caster, &rays, &world_triangles(&scene)) < 1e-3);
    assert_eq!((rays.counts().instances, rays.counts().left_out), (8, 0));
    assert!(rays.id() == id && rays.version() > version + 1);
}

#[test]
fn nothing_to_meet_is_no_error() {
    let Some(gpu) = crate::common::gpu() else { return };
    let rays = SceneRays::new(&gpu.device, &gpu.queue, &Scene::default()).expect("nothing fits");
    let hits =
        RayCaster::new(&gpu.device).trace(&gpu.device, &gpu.queue, rays.accel(), &random_rays(64, 1.0, 1)).unwrap();
    assert!(hits.iter().all(|h| h.triangle == u32::MAX));
    assert_eq!(rays.counts().instances, 0);
}
