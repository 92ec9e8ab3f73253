//! OBJ and MTL.

use bouncelight::scene::{self, AlphaMode};

use crate::glb::{png, put};
use crate::shared::assert_sound;

#[test]
fn materials_textures_and_triangulation() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::create_dir(folder.path().join("tex")).expect("a folder");
    put(folder.path(), "tex/a picture.png", &png([1, 2, 3, 255], 2, 2));
    put(
        folder.path(),
        "m.mtl",
        b"newmtl one\nKd 0.5 0.25 0.125\nNs 30\nd 0.5\nmap_Kd tex/a picture.png\n\
          newmtl two\nKd 1 0 0\nKe 3 2 1\nmap_Kd tex/gone.png\n",
    );
    let path = put(
        folder.path(),
        "a.obj",
        b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 2\n\
          o quad\nusemtl one\nf 1/1/1 2/2/1 3/3/1 4/4/1\no bare\nusemtl two\nf 4 3 2 1\n",
    );
    let scene = scene::load(path.to_str().expect("a path")).unwrap_or_else(|e| panic!("{e}"));
    assert_sound(&scene);
    assert_eq!(scene.meshes.len(), 2);
    let (quad, bare) = (&scene.meshes[0], &scene.meshes[1]);
    assert_eq!((quad.indices.len(), bare.indices.len()), (6, 6));
    assert_eq!(quad.normals, [[0.0, 0.0, 1.0]; 4], "the file's normals, at unit length");
    assert_eq!(quad.uv0[0], [0.0, 1.0], "v is turned to run downwards");
    assert_eq!(bare.normals, [[0.0, 0.0, -1.0]; 6], "flat");
    let (one, two) = (&scene.materials[quad.material], &scene.materials[bare.material]);
    assert_eq!((one.base_color, one.alpha_mode), ([0.5, 0.25, 0.125, 0.5], AlphaMode::Blend));
    assert!((one.roughness - 0.5).abs() < 1e-6, "Ns 30 is roughness 1/2: {}", one.roughness);
    assert_eq!((two.emissive, two.metallic), ([3.0, 2.0, 1.0], 0.0));
    assert_eq!(scene.images[0].rgba[..4], [1, 2, 3, 255]);
    assert!(scene.images[1].name.contains("stand-in"));
    assert!(scene.warnings.iter().any(|w| w.contains("tex/gone.png")), "{:?}", scene.warnings);
}

#[test]
fn a_missing_library_is_a_warning() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = put(folder.path(), "a.obj", b"mtllib gone.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl x\nf -3 -2 -1\n");
    let scene = scene::load(path.to_str().expect("a path")).unwrap_or_else(|e| panic!("{e}"));
    assert_sound(&scene);
    assert!(scene.warnings.iter().any(|w| w.contains("gone.mtl")), "{:?}", scene.warnings);
    assert!(scene.warnings.iter().any(|w| w.contains("no known material")), "{:?}", scene.warnings);
}
