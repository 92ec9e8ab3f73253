//! OBJ and MTL.

use bouncelight::scene::{AlphaMode, Scene, Wrap};

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
    let scene = bouncelight_scene::load(path.to_str().expect("a path")).unwrap_or_else(|e| panic!("{e}"));
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
    let scene = bouncelight_scene::load(path.to_str().expect("a path")).unwrap_or_else(|e| panic!("{e}"));
    assert_sound(&scene);
    assert!(scene.warnings.iter().any(|w| w.contains("gone.mtl")), "{:?}", scene.warnings);
    assert!(scene.warnings.iter().any(|w| w.contains("no known material")), "{:?}", scene.warnings);
}

const SQUARE: &str = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n";
const UVS: &str = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";
const FACE: &str = "f 1/1 2/2 3/3 4/4\n";

/// Loads `obj` beside a library `m.mtl`, a texture `t.png` and one `a b.png`.
#[track_caller]
fn load(obj: &str, mtl: &str) -> Scene {
    let folder = tempfile::tempdir().expect("a temporary folder");
    put(folder.path(), "m.mtl", mtl.as_bytes());
    put(folder.path(), "t.png", &png([200, 100, 50, 255], 2, 2));
    put(folder.path(), "a b.png", &png([200, 100, 50, 255], 2, 2));
    let path = put(folder.path(), "a.obj", obj.as_bytes());
    let scene = bouncelight_scene::load(path.to_str().expect("a path")).unwrap_or_else(|e| panic!("{obj}: {e}"));
    assert_sound(&scene);
    scene
}

/// Corners of all triangles, however they share vertices.
fn corners(scene: &Scene) -> Vec<[f32; 3]> {
    scene.meshes.iter().flat_map(|m| m.indices.iter().map(|&i| m.positions[i as usize])).collect()
}

fn area(scene: &Scene) -> f32 {
    let side = |t: &[[f32; 3]]| {
        let [a, b, c] = [0, 1, 2].map(|k| glam::Vec3::from(t[k]));
        (b - a).cross(c - a).z / 2.0
    };
    corners(scene).chunks_exact(3).map(|t| side(t).abs()).sum()
}

/// The material of the first mesh.
fn material(scene: &Scene) -> &bouncelight::scene::Material {
    &scene.materials[scene.meshes[0].material]
}

fn warned(scene: &Scene, words: &[&str]) -> bool {
    scene.warnings.iter().any(|w| words.iter().all(|word| w.contains(word)))
}

#[test]
fn concave_faces_cover_what_their_outline_does() {
    let dart = load("v -1 0 0\nv 0 0.5 0\nv 1 0 0\nv 0 2 0\nf 1 2 3 4\n", "");
    assert!((area(&dart) - 1.5).abs() < 1e-6, "{}", area(&dart));
    let ell = load("v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 4 5 6 1 2 3\n", "");
    assert!((area(&ell) - 3.0).abs() < 1e-6, "{}", area(&ell));
    // Negative control: a fan around the first corner covers the notch, too.
    let fan = load("v -1 0 0\nv 0 0.5 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\nf 1 3 4\n", "");
    assert!(area(&fan) > 2.4, "{}", area(&fan));
}

#[test]
fn lines_go_on_and_end_in_any_way() {
    let plain = corners(&load(&format!("{SQUARE}f 1 2 3 4\n"), ""));
    for same in [
        format!("{SQUARE}f 1 2 \\\n3 4\n"),
        format!("{SQUARE}f 1 2\\\n3 4\n"),
        format!("{SQUARE}f 1 2 \\\n3 \\\n4 \\\n"),
        format!("v -1 \\\n -1 0\n{}f 1 2 3 4\n", &SQUARE[10..]),
        format!("{SQUARE}f 1 2 \\\n3 4\n").replace('\n', "\r\n"),
        format!("{SQUARE}f 1 2 3 4\n").replace('\n', "\r"),
        format!("{SQUARE}f 1 2 3 4 # the front\n"),
        format!("{SQUARE}f 1 2 3 4#the front"),
        format!("{SQUARE}f 1 2 3 4\n").replace(' ', "\t"),
        format!("{SQUARE}f 1 2 3 4\n").replace("1 1 0", "1 1 0 # corner"),
        format!("{SQUARE}f 1 2 3 4\n").to_uppercase(),
        format!("# c:\\models\\\n{SQUARE}vt 0.5\nf 1/1 2/1 3/1 4/1\n"),
        format!("{}f 1 2 3 4\n", SQUARE.replace(" 0\n", " 0 1.0\n")),
    ] {
        assert_eq!(corners(&load(&same, "")), plain, "{same:?}");
    }
    // Negative control: a corner that is elsewhere is seen.
    assert_ne!(corners(&load(&format!("{SQUARE}f 1 2 3 4\n").replace("1 1 0", "1 2 0"), "")), plain);
    // Lines are counted as they stand in the file.
    let broken = crate::glb::load_bytes("a.obj", b"v 0 \\\n 0 0\nv 1 0 \\\nx\n").map(drop).unwrap_err().to_string();
    assert!(broken.contains("line 3") && broken.contains("'x'"), "{broken}");
}

#[test]
fn what_is_no_surface_is_left_out() {
    let plain = load(&format!("{SQUARE}f 1 2 3 4\n"), "");
    let with = load(
        &format!("{SQUARE}f 1 2 3 4\nv 5 5 5\nv 6 5 5\nv 6 6 5\nl 5 6 7\nl 5 6\np 5 6 7\nf 5 6\nsurf 0 1 0 1 5 6 7\n"),
        "",
    );
    assert_eq!(corners(&with), corners(&plain));
    assert!(
        warned(&with, &["3 lines and points"]) && warned(&with, &["1 faces with less than three"]),
        "{:?}",
        with.warnings
    );
    assert!(warned(&with, &["free-form"]) && !warned(&plain, &["left out"]));
}

#[test]
fn names_of_materials_and_libraries() {
    let red = "newmtl a b\nKd 1 0 0\nnewmtl wood #2\nKd 0 1 0\nnewmtl wood #1\nKd 0 0 1\n";
    let colour = |words: &str| material(&load(&format!("{words}\n{SQUARE}f 1 2 3 4\n"), red)).base_color;
    for same in [
        "mtllib m.mtl\nusemtl a b",
        "mtllib m.mtl\nusemtl a b # red",
        "mtllib\tm.mtl # all\nUSEMTL\ta b \t",
        "mtllib none.mtl m.mtl\nusemtl a b",
        "mtllib m.mtl none.mtl\nusemtl a b",
        "MTLLIB \"m.mtl\"\nusemtl a b",
        "mtllib .\\m.mtl\nusemtl a b",
        "usemtl a b\nmtllib m.mtl",
    ] {
        assert_eq!(colour(same), [1.0, 0.0, 0.0, 1.0], "{same:?}");
    }
    assert_eq!(colour("mtllib m.mtl\nusemtl wood #1"), [0.0, 0.0, 1.0, 1.0], "a name may hold #");
    assert_eq!(colour("mtllib m.mtl\nusemtl wood"), [0.0, 1.0, 0.0, 1.0], "the first of that name");
    // Negative control: an unknown one is grey.
    assert_eq!(colour("mtllib m.mtl\nusemtl b"), [0.8, 0.8, 0.8, 1.0]);
    let told = load(&format!("mtllib none.mtl m.mtl\nusemtl a b\n{SQUARE}f 1 2 3 4\n"), red);
    assert!(warned(&told, &["library 'none.mtl'"]) && !warned(&told, &["'m.mtl'"]), "{:?}", told.warnings);
}

#[test]
fn attributes_belong_to_corners() {
    let far = "v 5 5 0\nv 6 5 0\nv 6 6 0\n";
    let textured = "newmtl m\nmap_Kd t.png\n";
    let quad = |scene: &Scene| {
        let mesh = &scene.meshes[0];
        let of = |i: u32| (mesh.positions[i as usize], mesh.uv0.get(i as usize).copied(), mesh.normals[i as usize]);
        mesh.indices.iter().map(|&i| of(i)).filter(|c| c.0[0] < 4.0).collect::<Vec<_>>()
    };
    let head = format!("mtllib m.mtl\n{SQUARE}{far}{UVS}vn 0.6 0 0.8\nusemtl m\n");
    let plain = load(&format!("{head}{FACE}"), textured);
    for mixed in
        [format!("{head}{FACE}f 5 6 7\n"), format!("{head}f 5 6 7\n{FACE}"), format!("{head}f 5//1 6//1 7//1\n{FACE}")]
    {
        let mixed = load(&mixed, textured);
        assert_eq!((mixed.meshes.len(), quad(&mixed)), (1, quad(&plain)));
    }
    // Normals of some: the file's there, the triangle's elsewhere.
    let some = load(&format!("{head}f 1/1/1 2/2/1 3/3/1 4/4/1\nf 5 6 7\n"), textured);
    assert!(quad(&some).iter().all(|c| c.2 == [0.6, 0.0, 0.8]));
    let mesh = &some.meshes[0];
    let flat = mesh.indices[6..].iter().map(|&i| mesh.normals[i as usize]);
    assert!(flat.eq([[0.0, 0.0, 1.0]; 3]));
    // Colours of some, with and without alpha; the rest is white.
    for red in [" 1 0 0\n", " 1 0 0 1\n", " 1 0 0 0.5\n"] {
        let coloured = load(&format!("{}{far}f 1 2 3 4\nf 5 6 7\n", SQUARE.replace('\n', red)), "");
        let mesh = &coloured.meshes[0];
        for (p, c) in mesh.positions.iter().zip(&mesh.colors) {
            assert_eq!(*c, if p[0] < 4.0 { [1.0, 0.0, 0.0, 1.0] } else { [1.0; 4] }, "{red}");
        }
    }
    // Negative control: nothing of it is invented.
    let bare = load(&format!("{SQUARE}f 1 2 3 4\n"), "");
    assert!(bare.meshes[0].uv0.is_empty() && bare.meshes[0].colors.is_empty());
}

#[test]
fn one_statement_of_a_library_loses_no_other() {
    let obj = format!("mtllib m.mtl\nusemtl red\n{SQUARE}f 1 2 3 4\n");
    for strange in [
        "Kd 0.5",
        "Kd 0.5 0.5",
        "d -halo 0.5",
        "Kd xyz 0.2 0.2 0.2",
        "Kd xyz 0.2",
        "map_Kd -s",
        "Ns",
        "Kd spectral file.rfl 1",
        "Kd",
        "Kd a b c",
        "Kd 1 0 nan",
        "Ns x",
        "d",
        "Tr",
        "map_Kd",
        "map_Kd -s 2 2",
        "illum",
        "Ke 1e999 0 0",
        "foo bar",
        "Kd\u{e4}",
        "norm -bm x",
        "\\",
    ] {
        let scene = load(&obj, &format!("{strange}\nnewmtl other\n{strange}\nnewmtl red\nKd 1 0 0\n"));
        assert_eq!(material(&scene).base_color, [1.0, 0.0, 0.0, 1.0], "{strange}");
    }
    let told = load(&obj, "newmtl red\nKd spectral file.rfl 1\n");
    assert!(warned(&told, &["'m.mtl', line 2", "Kd", "spectra"]), "{:?}", told.warnings);
    assert!(warned(&load(&obj, "newmtl red\n\nNs x\n"), &["line 3", "Ns", "'x'"]));
    let colour = |kd: &str| material(&load(&obj, &format!("newmtl red\n{kd}\n"))).base_color;
    assert_eq!(colour("Kd 0.5"), [0.5, 0.5, 0.5, 1.0], "one number is grey");
    assert_eq!(colour("KD 1 0 0 # c"), [1.0, 0.0, 0.0, 1.0]);
    let [r, g, b, _] = colour("Kd xyz 0.4124 0.2126 0.0193");
    assert!((r - 1.0).abs() < 1e-3 && g < 1e-3 && b < 1e-3, "the red of Rec.709: {r} {g} {b}");
    // A flood of warnings is counted.
    let many = load(&obj, &format!("newmtl red\n{}", "Ns x\n".repeat(1000)));
    assert!(many.warnings.len() < 40 && warned(&many, &["980 more such lines"]), "{}", many.warnings.len());
}

#[test]
fn transparency_is_said_in_two_ways() {
    let alpha = |words: &str| {
        let scene =
            load(&format!("mtllib m.mtl\nusemtl m\n{SQUARE}f 1 2 3 4\n"), &format!("newmtl m\nKd 1 0 0\n{words}\n"));
        let m = material(&scene);
        assert_eq!(m.alpha_mode == AlphaMode::Blend, m.base_color[3] < 1.0);
        m.base_color[3]
    };
    assert_eq!([alpha("d 0.25"), alpha("Tr 0.75"), alpha("TR 0.75")], [0.25; 3]);
    assert_eq!([alpha("d 1.0\nTr 0.0"), alpha("Tr 0.0\nd 1.0"), alpha(""), alpha("Tr 0")], [1.0; 4]);
    assert_eq!([alpha("d 0.25\nTr 0.5"), alpha("Tr 0.5\nd 0.25")], [0.25; 2], "d wins");
}

#[test]
fn maps_have_options_and_names_with_spaces() {
    let head = format!("mtllib m.mtl\nusemtl m\n{SQUARE}{UVS}{FACE}");
    let map = |statement: &str| {
        let scene = load(&head, &format!("newmtl m\nKd 1 1 1\n{statement}\n"));
        assert!(!warned(&scene, &["checker"]), "{statement}: {:?}", scene.warnings);
        let used = material(&scene).base_color_texture.unwrap_or_else(|| panic!("{statement}: no texture"));
        (used.transform, used.sampler.wrap[0])
    };
    let (plain, twice) = ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[2.0, 0.0, 0.0], [0.0, 2.0, -1.0]]);
    for same in [
        "map_Kd t.png",
        "map_kd t.png",
        "MAP_KD\tt.png  ",
        "map_Kd a b.png",
        "map_Kd \"a b.png\"",
        "map_Kd .\\t.png",
        "map_Kd -bm 1 -mm 0 1 -blendu on -texres 512 -imfchan r -t 1 1 t.png",
        "map_Kd t.png # wood",
        "map_Kd t.png -blendu on",
    ] {
        assert_eq!(map(same), (plain, Wrap::Repeat), "{same}");
    }
    for same in [
        "map_Kd -s 2 2 1 t.png",
        "map_Kd -s 2 2 t.png",
        "map_Kd -S 2 2 1 a b.png",
        "map_Kd -clamp off -s 2 2 1 -o 0 0 0 t.png",
        "map_Kd t.png -s 2 2 1",
        "map_Kd -s 2 \\\n2 1 t.png",
    ] {
        assert_eq!(map(same), (twice, Wrap::Repeat), "{same}");
    }
    // Up by half a texture: the row that was at v is seen at v + 1/2, counted upwards.
    assert_eq!(map("map_Kd -o 0.5 0.25 0 t.png").0, [[1.0, 0.0, 0.5], [0.0, 1.0, -0.25]]);
    assert_eq!(map("map_Kd -s 2 t.png").0, [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0]]);
    assert_eq!(map("map_Kd -clamp on t.png"), (plain, Wrap::ClampToEdge));
    // Negative control: a name that is none is told.
    assert!(warned(&load(&head, "newmtl m\nmap_Kd -s 2 2 1 c.png\n"), &["'c.png'", "checker"]));
}

#[test]
fn map_coordinates_keep_their_digits() {
    let square = |x: f64, y: f64| {
        let corner = |dx: f64, dy: f64| format!("v {} {} 12.5\n", x + dx, y + dy);
        [corner(0.0, 0.0), corner(0.125, 0.0), corner(0.125, 0.125), corner(0.0, 0.125), "f 1 2 3 4\n".into()].concat()
    };
    let sides = |scene: &Scene| {
        let c = corners(scene);
        [(c[1][0] - c[0][0]), (c[2][1] - c[1][1])]
    };
    let far = load(&square(500_123.437_5, 4_649_776.062_5), "");
    assert_eq!(sides(&far), [0.125; 2]);
    assert!(warned(&far, &["far from the file's origin", "(500123, 4649776, 0)"]), "{:?}", far.warnings);
    // Negative controls: near ones stay, and so does what reaches as far as it is away.
    let near = load(&square(99.0, -12.0), "");
    assert_eq!((corners(&near)[0], sides(&near)), ([99.0, -12.0, 12.5], [0.125; 2]));
    let large = load("v 120000 0 0\nv -120000 0 0\nv 0 90000 0\nf 1 2 3\n", "");
    assert_eq!(corners(&large)[0], [120_000.0, 0.0, 0.0]);
    assert!(!warned(&large, &["far from"]));
}
