use super::*;
use crate::scene::{ColorSpace, Image, Instance, Material, Sampler, TextureRef};

/// Two squares of one square metre that look and glow as the picture says, of 64×64 texels.
fn card(texel: impl Fn(usize, usize) -> [u8; 3]) -> Scene {
    let rgba = (0..64 * 64).flat_map(|i| texel(i % 64, i / 64).into_iter().chain([255]));
    let image =
        Image { name: String::new(), width: 64, height: 64, rgba: rgba.collect(), color_space: ColorSpace::Linear };
    let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let texture = Some(TextureRef { image: 0, sampler: Sampler::default(), uv_set: 0, transform });
    let color = Material { base_color_texture: texture, metallic: 0.0, ..Default::default() };
    let glow = Material { emissive: [10.0; 3], emissive_texture: texture, ..Default::default() };
    let uv0 = vec![[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let mesh = Mesh {
        positions: uv0.iter().map(|[u, v]| [*u, *v, 0.0]).collect(),
        normals: vec![[0.0, 0.0, 1.0]; 4],
        uv0,
        indices: vec![0, 1, 2, 0, 2, 3],
        ..Default::default()
    };
    let instance = |mesh: usize| Instance {
        name: String::new(),
        mesh,
        transform: Mat4::from_translation(Vec3::Z * mesh as f32).to_cols_array_2d(),
    };
    Scene {
        meshes: vec![mesh.clone(), Mesh { material: 1, ..mesh }],
        materials: vec![color, glow],
        images: vec![image],
        instances: vec![instance(0), instance(1)],
        ..Default::default()
    }
}

/// How far what rays know of each of the cards is from its picture, in the mean over the card,
/// and from all of its light; triangles. In pieces or whole.
fn off(scene: &Scene, cut: bool) -> [(f32, f32, usize); 2] {
    let reductions = Reductions::new(scene);
    let pieces = if cut { Pieces::of(scene, &reductions) } else { vec![Pieces::default(); 2] };
    [0, 1].map(|m| {
        let Seen { mesh, made } = pieces[m].met(scene, &scene.meshes[m], &reductions);
        mesh.check(2).expect("it is sound");
        let known = surfaces::of_mesh(scene, &mesh, mesh.positions.len() - made.len(), &reductions);
        let light = |s: &surfaces::Surface| if m == 0 { s.diffuse.x } else { s.emission.x / 10.0 };
        let corners: Vec<[Vec3; 3]> =
            mesh.indices.chunks_exact(3).map(|t| [0, 1, 2].map(|k| mesh.positions[t[k] as usize].into())).collect();
        let area: f32 = mesh.indices.chunks_exact(3).map(|t| super::area(&mesh, t)).sum();
        assert!((area - 1.0).abs() < 1e-5, "{area}");
        let all: f32 = mesh.indices.chunks_exact(3).zip(&known).map(|(t, s)| super::area(&mesh, t) * light(s)).sum();
        let (mut apart, mut truth) = (0.0, 0.0);
        for i in 0..64 * 64 {
            let p = Vec3::new((i % 64) as f32 + 0.51, (i / 64) as f32 + 0.49, 0.0) / 64.0;
            let inside = |[a, b, c]: &[Vec3; 3]| {
                [(a, b), (b, c), (c, a)].iter().all(|(from, to)| (**to - **from).cross(p - **from).z >= 0.0)
            };
            let at = corners.iter().position(inside).expect("pieces leave no hole");
            let here = f32::from(scene.images[0].rgba[4 * i]) / 255.0;
            apart += (light(&known[at]) - here).abs() / 4096.0;
            truth += here / 4096.0;
        }
        (apart, (all - truth).abs() / truth, corners.len())
    })
}

#[test]
fn light_comes_from_where_the_picture_has_it() {
    let window = card(|x, y| [if (10..17).contains(&x) && (20..31).contains(&y) { 255 } else { 0 }; 3]);
    let halves = card(|x, _| if x < 32 { [220, 20, 20] } else { [20, 20, 220] });
    for (name, scene) in [("window", window), ("halves", halves)] {
        let (found, whole) = (off(&scene, true), off(&scene, false));
        println!("{name}: {found:?}, whole {whole:?}");
        for (m, ((apart, light, triangles), (before, _, two))) in found.into_iter().zip(whole).enumerate() {
            assert!(apart < 0.35 * before && light < 0.04, "{name}, mesh {m}: {apart} of {before}, light {light}");
            assert!(two == 2 && triangles > 2 && triangles < 200, "{triangles}");
        }
    }
}

#[test]
fn what_is_alike_or_small_stays_whole() {
    let whole = |scene: &Scene| Pieces::of(scene, &Reductions::new(scene)).iter().all(|p| !p.any());
    assert!(whole(&card(|_, _| [90; 3])));
    // A pattern that is finer than any piece.
    let fine = |x: usize, y: usize| [if (x ^ y) & 1 == 0 { 200 } else { 0 }; 3];
    assert!(whole(&card(fine)));
    // Negative control: a coarse one. Then the card among walls, its glow beside a lamp.
    let mut scene = card(|x, y| [if (x / 32) ^ (y / 32) == 0 { 200 } else { 0 }; 3]);
    assert!(!whole(&scene));
    let wall = Mesh { material: 2, ..scene.meshes[0].clone() };
    scene.meshes.push(wall);
    scene.materials.push(Material { emissive: [10.0; 3], ..Default::default() });
    let place = |i: usize| Instance {
        name: String::new(),
        mesh: 2,
        transform: Mat4::from_scale(Vec3::splat(9.0 + i as f32)).to_cols_array_2d(),
    };
    scene.instances.extend((0..40).map(place));
    assert!(whole(&scene));
}

#[test]
fn pieces_are_bounded_and_repeat() {
    // Each of many squares differs within.
    let mut scene = card(|x, _| [if x < 21 { 255 } else { 0 }; 3]);
    scene.meshes.truncate(1);
    scene.instances.truncate(1);
    for i in 1..200u32 {
        let mesh = &mut scene.meshes[0];
        for k in 0..4 {
            let [x, y, _] = mesh.positions[k];
            mesh.positions.push([x, y, i as f32]);
            mesh.normals.push([0.0, 0.0, 1.0]);
            mesh.uv0.push(mesh.uv0[k]);
        }
        mesh.indices.extend([0, 1, 2, 0, 2, 3].map(|k| 4 * i + k));
    }
    let reductions = Reductions::new(&scene);
    let pieces = Pieces::of(&scene, &reductions);
    let met = pieces[0].met(&scene, &scene.meshes[0], &reductions);
    let more = met.mesh.indices.len() / 3 - 400;
    assert!(more > 500 && more <= FEW, "{more}");
    assert_eq!(Pieces::of(&scene, &reductions)[0].cuts, pieces[0].cuts);
}

#[test]
fn neighbours_share_what_they_have_got() {
    let scene = card(|x, _| [if x < 32 { 255 } else { 0 }; 3]);
    let reductions = Reductions::new(&scene);
    let met = Pieces::of(&scene, &reductions)[0].met(&scene, &scene.meshes[0], &reductions);
    // The diagonal is cut by both triangles in the same places.
    let middle = |m: &Made| m.of[..2] == [0, 2] && m.weights[..2] == [0.5, 0.5];
    assert_eq!(met.made.iter().filter(|m| middle(m)).count(), 1);
    // Corners that lie in one place, and others.
    let places = places_of(&met.made, vec![0, 1, 2, 0]);
    let of = |a: u32, b: u32| {
        let is = |m: &Made| m.weights[..2] == [0.5, 0.5] && [m.of[0], m.of[1]] == [a, b];
        met.made.iter().position(is).map(|i| places[4 + i])
    };
    assert_eq!((of(0, 2), of(0, 1)), (of(2, 3), of(0, 1).filter(|p| *p > 2)));
}
