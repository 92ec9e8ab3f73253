//! Normal maps where tangents or texels name no direction.

use bouncelight::render::capture::Layer;
use bouncelight::scene::{Image, Sampler, Scene, TextureRef};
use serde_json::json;

use crate::build::{look_at, quad, render, scene, sun};
use crate::common;
use crate::glb::{Glb, png};
use crate::shared::assert_sound;

/// A texel that leans to the right by 0.6, and one that names no direction.
const RIGHT: [u8; 4] = [204, 128, 230, 255];
const NONE: [u8; 4] = [0, 0, 0, 255];

/// A wall of two triangles that share corners, with a normal map and maybe tangents.
fn wall(texel: [u8; 4], tangents: Option<[f32; 16]>) -> Glb {
    let mut glb = Glb::new();
    let places = glb.floats("VEC3", &[-1.0, -1.0, 0.0, 1.0, -1.0, 0.0, 1.0, 1.0, 0.0, -1.0, 1.0, 0.0]);
    let normals = glb.floats("VEC3", &[0.0, 0.0, 1.0].repeat(4));
    let uvs = glb.floats("VEC2", &[0.0, 1.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    let indices = glb.accessor("SCALAR", 5125, 6, &[0u32, 1, 2, 0, 2, 3].map(u32::to_le_bytes).concat());
    glb.json["meshes"][0]["primitives"][0] = json!({"indices": indices, "material": 0,
        "attributes": {"POSITION": places, "NORMAL": normals, "TEXCOORD_0": uvs}});
    if let Some(tangents) = tangents {
        let tangents = glb.floats("VEC4", &tangents);
        glb.attribute("TANGENT", tangents);
    }
    let view = glb.view(&png(texel, 2, 2));
    glb.json["images"] = json!([{"bufferView": view, "mimeType": "image/png"}]);
    glb.json["textures"] = json!([{"source": 0}]);
    glb.json["materials"] = json!([{"normalTexture": {"index": 0}}]);
    glb
}

/// The tangent of each corner of the triangles, in their order.
fn by_corner(scene: &Scene) -> Vec<[f32; 4]> {
    let mesh = &scene.meshes[0];
    mesh.indices.iter().map(|&i| mesh.tangents[i as usize]).collect()
}

#[test]
fn tangents_that_span_no_plane_are_made_anew() {
    let made = by_corner(&wall(RIGHT, None).load().expect("it loads"));
    assert!(made.iter().all(|t| (t[0] - 1.0).abs() < 1e-6 && t[3] == 1.0), "{made:?}");
    for bad in [[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 1.0], [0.0, 0.0, -3.0, -1.0], [1e-30, 0.0, 0.0, 1.0]] {
        let all = wall(RIGHT, Some(bad.repeat(4).try_into().expect("sixteen"))).load().expect("it loads");
        assert_sound(&all);
        assert_eq!(by_corner(&all), made, "{bad:?}");
        assert!(all.warnings.iter().any(|w| w.contains("4 tangents")), "{:?}", all.warnings);
    }
    // One alone: the file's own stay at the others, which a mended mesh must not turn.
    let up = [0.0, 1.0, 0.0, 1.0];
    let one = [[0.0; 4], up, up, up].concat().try_into().expect("sixteen");
    let one = wall(RIGHT, Some(one)).load().expect("it loads");
    let right = [1.0, 0.0, 0.0, 1.0];
    assert_eq!(by_corner(&one), [right, up, up, right, up, up]);
    // Negative control: sound ones are the file's.
    let kept = wall(RIGHT, Some(up.repeat(4).try_into().expect("sixteen"))).load().expect("it loads");
    assert_eq!(by_corner(&kept), [up; 6]);
    assert!(!kept.warnings.iter().any(|w| w.contains("tangents")), "{:?}", kept.warnings);
}

#[test]
fn texels_that_point_nowhere_or_into_the_surface_are_flat() {
    let texel = |texel: [u8; 4]| {
        let scene = wall(texel, None).load().expect("it loads");
        <[u8; 3]>::try_from(&scene.images[0].rgba[..3]).expect("three")
    };
    assert_eq!([texel(NONE), texel([128, 128, 128, 255])], [[128, 128, 255]; 2]);
    assert_eq!(texel([255, 255, 0, 255]), [128, 128, 255]);
    // A map of two channels leaves out blue.
    let [r, g, b] = texel([204, 128, 0, 255]);
    assert!((r, g) == (204, 128) && b.abs_diff(RIGHT[2]) <= 1, "{b}");
    // Negative control: what is a direction stays.
    for kept in [RIGHT, [255, 128, 128, 255], [0, 128, 128, 255]] {
        assert_eq!(texel(kept), kept[..3]);
    }
}

/// A wall towards the camera, made without a loader that would mend it.
fn raw(texel: [u8; 4], tangent: [f32; 4], normals: [[f32; 3]; 4]) -> Scene {
    let mut mesh = quad([-2.0, -2.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]);
    (mesh.tangents, mesh.normals) = (vec![tangent; 4], normals.to_vec());
    let mut scene = scene(vec![mesh], vec![sun([0.2, 0.1, -1.0], 3.0, 0.0)]);
    let color_space = bouncelight::scene::ColorSpace::Linear;
    scene.images = vec![Image { name: "map".into(), width: 1, height: 1, rgba: texel.to_vec(), color_space }];
    let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    scene.materials[0].normal_texture =
        Some(TextureRef { image: 0, sampler: Sampler::default(), uv_set: 0, transform });
    scene
}

const FRONT: [[f32; 3]; 4] = [[0.0, 0.0, 1.0]; 4];

/// Maps, tangents and normals, and the x of the normal that they make, where one is sure.
fn raw_walls() -> Vec<(&'static str, Scene, Option<f32>)> {
    let (right, none) = ([1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]);
    let against = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], [-1.0, 0.0, 0.0]];
    let mut steep = raw(RIGHT, right, FRONT);
    steep.materials[0].normal_scale = 1e30;
    let mut small = raw(RIGHT, right, FRONT);
    small.instances[0].transform = glam::Mat4::from_scale(glam::Vec3::splat(1e-12)).to_cols_array_2d();
    small.meshes[0].positions.iter_mut().for_each(|p| *p = p.map(|v| v * 1e12));
    vec![
        ("the control leans to the right", raw(RIGHT, right, FRONT), Some(0.6)),
        ("no tangent", raw(RIGHT, none, FRONT), None),
        ("along the normal", raw(RIGHT, [0.0, 0.0, 1.0, 1.0], FRONT), None),
        ("a black map", raw(NONE, right, FRONT), Some(0.0)),
        ("a grey map", raw([127, 127, 127, 255], right, FRONT), None),
        ("normals against each other", raw(RIGHT, right, against), None),
        ("an endless scale", steep, None),
        ("an instance of little size", small, Some(0.6)),
    ]
}

#[test]
fn no_shader_makes_nan_of_a_vector_without_direction() {
    let Some(gpu) = common::gpu() else { return };
    let camera = look_at([0.0, 0.0, 3.0], [0.0; 3], 0.7);
    for (name, scene, x) in raw_walls() {
        let frame = render(&gpu, &scene, &camera, [16, 16], 1);
        assert!(frame.beauty.data.iter().all(|v| v.is_finite()), "{name}: not a number in the picture");
        let normal = frame.layer(Layer::Normal).expect("asked for");
        for n in normal.data.chunks_exact(3) {
            let length = n.iter().map(|v| v * v).sum::<f32>().sqrt();
            assert!((length - 1.0).abs() < 0.01, "{name}: {n:?}");
            assert!(name.contains("against") || n[2] > -1e-3, "{name}: {n:?} looks away");
        }
        if let Some(x) = x {
            assert!((normal.at(8, 8)[0] - x).abs() < 0.01, "{name}: {:?}", normal.at(8, 8));
        }
    }
}

#[test]
fn nor_does_the_path_tracer() {
    use bouncelight_lab::reference::{Kernel, Layer, ReferenceScene, Subject, Tracer, TracerOptions};
    let Some(gpu) = common::gpu() else { return };
    let camera = look_at([0.0, 0.0, 3.0], [0.0; 3], 0.7);
    let kernel = Kernel::new(&gpu.device);
    let lit = |scene: &Scene| {
        let packed = ReferenceScene::new(&gpu.device, &gpu.queue, scene).expect("it packs");
        let subject = Subject { camera: &camera, size: [16, 16], points: None };
        let options = TracerOptions { samples: 4, ..Default::default() };
        let mut tracer = Tracer::new(&gpu.device, &gpu.queue, &kernel, &packed, subject, options).expect("it traces");
        while tracer.step().expect("it traces") {}
        let traced = tracer.finish().expect("it ends");
        traced.layer(Layer::Combined).expect("the picture").to_vec()
    };
    for (name, scene, x) in raw_walls() {
        let picture = lit(&scene);
        assert!(picture.iter().all(|v| v.is_finite()), "{name}: not a number in the picture");
        let middle = picture[4 * (8 * 16 + 8)];
        assert!(x.is_none() || middle > 0.1, "{name}: black, {middle}");
    }
}
