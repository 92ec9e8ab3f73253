//! A small furnished room: the sun falls through a window onto a wooden floor, a lamp hangs over
//! the table, and the strongly coloured walls, rug and sofa bleed into everything white.
//!
//! The room is 5 m wide (x), 4.6 m deep (z) and 2.7 m high, closed on all sides; walls are slabs,
//! so that nothing leaks in a shadow map. The camera stands inside, near the +Z wall.

use glam::{Affine3A, Quat, Vec3, vec3};

use super::builder::Builder;
use super::textures;
use bouncelight::scene::{Camera, Environment, Light, LightKind, Material, SUN_ANGLE, Scene};

/// Half the width, the height, half the depth of the room; thickness of its walls. Metres.
const HALF: f32 = 2.5;
const HIGH: f32 = 2.7;
const DEEP: f32 = 2.3;
const WALL: f32 = 0.25;

/// Where the lamp hangs, metres: the middle of its bulb.
const BULB: Vec3 = vec3(-0.15, 1.72, -0.55);

/// Materials that several parts share.
struct Palette {
    white: usize,
    wood: usize,
    dark_wood: usize,
    brass: usize,
    black: usize,
}

fn dielectric(name: &str, [r, g, b]: [f32; 3], roughness: f32) -> Material {
    Material { name: name.to_owned(), base_color: [r, g, b, 1.0], metallic: 0.0, roughness, ..Material::default() }
}

/// Builds the room.
pub(super) fn scene() -> Scene {
    let mut b = Builder::new("interior");
    let palette = Palette {
        white: b.material(dielectric("white paint", [0.80, 0.79, 0.76], 0.5)),
        wood: b.material(dielectric("oak", [0.50, 0.29, 0.14], 0.45)),
        dark_wood: b.material(dielectric("walnut", [0.16, 0.075, 0.035], 0.4)),
        brass: b.material(Material {
            name: "brass".to_owned(),
            base_color: [0.91, 0.66, 0.33, 1.0],
            metallic: 1.0,
            roughness: 0.25,
            ..Material::default()
        }),
        black: b.material(dielectric("black metal", [0.02, 0.02, 0.022], 0.4)),
    };
    shell(&mut b);
    window(&mut b, &palette);
    table(&mut b, &palette);
    shelves(&mut b, &palette);
    sofa(&mut b, &palette);
    decoration(&mut b, &palette);
    lamp(&mut b, &palette);

    let mut scene = b.scene;
    scene.environment = Environment::constant([0.55, 0.72, 1.0]);
    scene.lights.push(Light {
        name: "sun".to_owned(),
        color: [1.0, 0.90, 0.74],
        kind: LightKind::Directional {
            direction: vec3(0.70, -0.56, -0.30).normalize().into(),
            irradiance: 30.0,
            angle: SUN_ANGLE,
        },
        is_emissive_proxy: false,
    });
    let camera = Camera::look_at([1.0, 1.50, 2.15], [-0.16, 0.88, -1.2], 52f32.to_radians());
    scene.cameras.push(Camera { name: "room".to_owned(), near: 0.05, ..camera });
    scene
}

/// Floor, ceiling and walls; the −X wall has the window's opening.
fn shell(b: &mut Builder) {
    let floor = Material {
        base_color_texture: Some(b.texture(textures::wood_color())),
        normal_texture: Some(b.texture(textures::wood_normal())),
        metallic_roughness_texture: Some(b.texture(textures::wood_roughness())),
        ..dielectric("floor", [1.0; 3], 1.0)
    };
    let floor = b.material(floor);
    let (plaster, relief) = (b.texture(textures::plaster_color()), b.texture(textures::plaster_normal()));
    let wall = |b: &mut Builder, name: &str, color: [f32; 3]| {
        b.material(Material {
            base_color_texture: Some(plaster),
            normal_texture: Some(relief),
            ..dielectric(name, color, 0.9)
        })
    };
    let cream = wall(b, "cream plaster", [0.83, 0.78, 0.68]);
    let red = wall(b, "terracotta plaster", [0.74, 0.23, 0.09]);
    let teal = wall(b, "teal plaster", [0.06, 0.36, 0.38]);
    let ceiling = wall(b, "white plaster", [0.85, 0.85, 0.83]);
    let (x, y, z) = (HALF, HIGH, DEEP);
    let flat = Affine3A::IDENTITY;
    let out = |v: f32| v + WALL;
    b.part("floor", floor, 0.5, |p| p.block(vec3(-out(x), -WALL, -out(z)), vec3(out(x), 0.0, out(z)), flat));
    b.part("ceiling", ceiling, 0.4, |p| p.block(vec3(-out(x), y, -out(z)), vec3(out(x), out(y), out(z)), flat));
    b.part("back wall", red, 0.4, |p| p.block(vec3(-out(x), 0.0, -out(z)), vec3(out(x), y, -z), flat));
    b.part("front wall", cream, 0.4, |p| p.block(vec3(-out(x), 0.0, z), vec3(out(x), y, out(z)), flat));
    b.part("right wall", teal, 0.4, |p| p.block(vec3(x, 0.0, -z), vec3(out(x), y, z), flat));
    let [low, high] = OPENING;
    b.part("left wall", cream, 0.4, |p| {
        p.block(vec3(-out(x), 0.0, -z), vec3(-x, low[0], z), flat);
        p.block(vec3(-out(x), high[0], -z), vec3(-x, y, z), flat);
        p.block(vec3(-out(x), low[0], -z), vec3(-x, high[0], low[1]), flat);
        p.block(vec3(-out(x), low[0], high[1]), vec3(-x, high[0], z), flat);
    });
}

/// Lowest and highest (y, z) of the window.
const OPENING: [[f32; 2]; 2] = [[0.75, -1.25], [2.35, 0.95]];

fn window(b: &mut Builder, palette: &Palette) {
    let [[y0, z0], [y1, z1]] = OPENING;
    let flat = Affine3A::IDENTITY;
    let (far, near) = (-HALF - 0.16, -HALF - 0.10);
    b.part("window frame", palette.white, 1.0, |p| {
        let mut bar = |low: [f32; 2], high: [f32; 2]| {
            p.block(vec3(far, low[0], low[1]), vec3(near, high[0], high[1]), flat);
        };
        bar([y0, z0], [y0 + 0.06, z1]);
        bar([y1 - 0.06, z0], [y1, z1]);
        let middle = (z0 + z1) * 0.5;
        for z in [z0, middle - 0.03, z1 - 0.06] {
            bar([y0 + 0.06, z], [y1 - 0.06, z + 0.06]);
        }
        let cross = y0 + 0.68 * (y1 - y0);
        bar([cross, z0 + 0.06], [cross + 0.04, middle - 0.03]);
        bar([cross, middle + 0.03], [cross + 0.04, z1 - 0.06]);
    });
    b.part("window sill", palette.white, 1.0, |p| {
        p.block(vec3(-HALF - 0.02, y0 - 0.04, z0 - 0.06), vec3(-HALF + 0.14, y0, z1 + 0.06), flat);
    });
    b.part("skirting", palette.white, 1.0, |p| {
        let (t, h) = (0.018, 0.09);
        p.block(vec3(-HALF, 0.0, -DEEP), vec3(-HALF + t, h, DEEP), flat);
        p.block(vec3(HALF - t, 0.0, -DEEP), vec3(HALF, h, DEEP), flat);
        p.block(vec3(-HALF + t, 0.0, -DEEP), vec3(HALF - t, h, -DEEP + t), flat);
        p.block(vec3(-HALF + t, 0.0, DEEP - t), vec3(HALF - t, h, DEEP), flat);
    });
}

fn table(b: &mut Builder, palette: &Palette) {
    let rug = Material { base_color_texture: Some(b.texture(textures::rug())), ..dielectric("rug", [1.0; 3], 1.0) };
    let rug = b.material(rug);
    b.part("rug", rug, 1.0, |p| {
        let (low, high) = (vec3(-1.45, 0.0, -1.35), vec3(1.05, 0.014, 0.35));
        p.picture(low.with_y(high.y), Vec3::Z * (high.z - low.z), Vec3::X * (high.x - low.x));
        for (origin, along) in [
            (vec3(low.x, 0.0, low.z), Vec3::Z * (high.z - low.z)),
            (vec3(high.x, 0.0, high.z), Vec3::NEG_Z * (high.z - low.z)),
            (vec3(low.x, 0.0, high.z), Vec3::X * (high.x - low.x)),
            (vec3(high.x, 0.0, low.z), Vec3::NEG_X * (high.x - low.x)),
        ] {
            p.quad(origin, along, Vec3::Y * high.y);
        }
    });
    let center = vec3(BULB.x, 0.0, BULB.z);
    b.part("table", palette.wood, 1.0, |p| {
        let at = Affine3A::from_translation(center);
        p.block(vec3(-0.62, 0.40, -0.36), vec3(0.62, 0.44, 0.36), at);
        for (x, z) in [(-0.56, -0.30), (0.56, -0.30), (-0.56, 0.30), (0.56, 0.30)] {
            p.block(vec3(x - 0.025, 0.014, z - 0.025), vec3(x + 0.025, 0.40, z + 0.025), at);
        }
    });
    let top = center.with_y(0.44);
    b.part("brass ball", palette.brass, 1.0, |p| p.ball(top + vec3(0.22, 0.11, 0.05), 0.11, 40));
    let glaze = b.material(dielectric("blue glaze", [0.03, 0.12, 0.55], 0.12));
    b.part("vase", glaze, 1.0, |p| {
        let profile = [
            [0.0, 0.0],
            [0.055, 0.0],
            [0.055, 0.0],
            [0.085, 0.05],
            [0.10, 0.11],
            [0.085, 0.18],
            [0.045, 0.24],
            [0.035, 0.29],
            [0.05, 0.33],
            [0.05, 0.33],
            [0.04, 0.325],
            [0.028, 0.28],
            [0.0, 0.26],
        ];
        p.lathe(top + vec3(-0.30, 0.0, -0.10), &profile, 40);
    });
    let covers = [[0.70, 0.05, 0.05], [0.05, 0.35, 0.12], [0.85, 0.80, 0.70]];
    for (i, color) in covers.into_iter().enumerate() {
        let cover = b.material(dielectric("book cover", color, 0.6));
        let turn = Quat::from_rotation_y(0.35 - 0.3 * i as f32);
        let at = Affine3A::from_rotation_translation(turn, top + vec3(0.02, 0.032 * i as f32, 0.19));
        let half = vec3(0.14, 0.0, 0.10) * (1.0 - 0.08 * i as f32);
        b.part("book", cover, 1.0, |p| p.block(-half, half.with_y(0.031), at));
    }
}

fn shelves(b: &mut Builder, palette: &Palette) {
    let (x0, x1, z0, z1) = (-2.25, -1.0, -DEEP + 0.01, -DEEP + 0.31);
    let flat = Affine3A::IDENTITY;
    let boards = [0.08, 0.50, 0.92, 1.34, 1.76];
    b.part("shelf", palette.white, 1.0, |p| {
        for x in [x0, x1 - 0.025] {
            p.block(vec3(x, 0.0, z0), vec3(x + 0.025, 1.785, z1), flat);
        }
        for y in boards {
            p.block(vec3(x0 + 0.025, y, z0), vec3(x1 - 0.025, y + 0.025, z1), flat);
        }
    });
    let colors = [
        [0.75, 0.10, 0.06],
        [0.90, 0.55, 0.08],
        [0.10, 0.32, 0.62],
        [0.12, 0.42, 0.16],
        [0.80, 0.74, 0.62],
        [0.35, 0.08, 0.30],
        [0.05, 0.10, 0.16],
    ];
    let covers = colors.map(|c| b.material(dielectric("spine", c, 0.55)));
    // Rows of books; the numbers only have to look as if nobody had chosen them.
    for (row, (y, books, start)) in
        [(boards[0], 9, 0.06), (boards[1], 7, 0.42), (boards[2], 11, 0.06), (boards[3], 5, 0.06)]
            .into_iter()
            .enumerate()
    {
        let mut x = x0 + start;
        for i in 0..books {
            let odd = (i * 7 + row * 5) % 11;
            let (thick, tall, deep) =
                (0.028 + 0.004 * (odd % 5) as f32, 0.24 + 0.012 * odd as f32, 0.16 + 0.008 * (odd % 7) as f32);
            let low = vec3(x, y + 0.025, z0 + 0.02);
            b.part("book", covers[(i * 3 + row * 2) % 7], 1.0, |p| p.block(low, low + vec3(thick, tall, deep), flat));
            x += thick + 0.003;
        }
    }
    let middle = 0.5 * (z0 + z1);
    let red = b.material(dielectric("red lacquer", [0.72, 0.03, 0.03], 0.15));
    b.part("red ball", red, 1.0, |p| p.ball(vec3(-2.05, boards[1] + 0.125, middle), 0.10, 32));
    b.part("brass bowl", palette.brass, 1.0, |p| {
        let profile =
            [[0.0, 0.0], [0.06, 0.0], [0.06, 0.0], [0.12, 0.05], [0.15, 0.12], [0.15, 0.12], [0.11, 0.05], [0.0, 0.02]];
        p.lathe(vec3(-1.35, boards[3] + 0.025, middle), &profile, 40);
    });
    let green = b.material(dielectric("green glaze", [0.10, 0.45, 0.20], 0.2));
    b.part("pyramid", green, 1.0, |p| {
        p.lathe(vec3(-1.3, boards[4] + 0.025, middle), &[[0.0, 0.0], [0.13, 0.0], [0.13, 0.0], [0.0, 0.3]], 4);
    });
    b.part("yellow box", covers[1], 1.0, |p| {
        let at =
            Affine3A::from_rotation_translation(Quat::from_rotation_y(0.5), vec3(-1.95, boards[4] + 0.025, middle));
        p.block(vec3(-0.12, 0.0, -0.09), vec3(0.12, 0.16, 0.09), at);
    });
}

fn sofa(b: &mut Builder, palette: &Palette) {
    let mustard = b.material(dielectric("mustard fabric", [0.78, 0.42, 0.05], 0.95));
    let pillow = b.material(dielectric("pillow", [0.82, 0.80, 0.76], 0.95));
    let (x0, x1, z0, z1) = (1.5, 2.42, -1.75, 0.25);
    let flat = Affine3A::IDENTITY;
    b.part("sofa", mustard, 1.0, |p| {
        p.block(vec3(x0, 0.12, z0), vec3(x1, 0.30, z1), flat);
        p.block(vec3(x1 - 0.22, 0.30, z0), vec3(x1, 0.82, z1), flat);
        p.block(vec3(x0, 0.30, z0), vec3(x1 - 0.22, 0.58, z0 + 0.18), flat);
        p.block(vec3(x0, 0.30, z1 - 0.18), vec3(x1 - 0.22, 0.58, z1), flat);
        let half = 0.5 * (z0 + z1);
        p.block(vec3(x0 - 0.02, 0.30, z0 + 0.19), vec3(x1 - 0.23, 0.44, half - 0.005), flat);
        p.block(vec3(x0 - 0.02, 0.30, half + 0.005), vec3(x1 - 0.23, 0.44, z1 - 0.19), flat);
    });
    b.part("sofa feet", palette.dark_wood, 1.0, |p| {
        for x in [x0 + 0.05, x1 - 0.11] {
            for z in [z0 + 0.05, z1 - 0.11] {
                p.block(vec3(x, 0.0, z), vec3(x + 0.06, 0.12, z + 0.06), flat);
            }
        }
    });
    b.part("pillow", pillow, 1.0, |p| {
        let turn = Quat::from_rotation_y(0.3) * Quat::from_rotation_z(-0.35);
        let at = Affine3A::from_rotation_translation(turn, vec3(2.06, 0.445, -1.22));
        p.block(vec3(-0.06, 0.0, -0.2), vec3(0.06, 0.40, 0.2), at);
    });
}

fn decoration(b: &mut Builder, palette: &Palette) {
    let canvas =
        Material { base_color_texture: Some(b.texture(textures::painting())), ..dielectric("painting", [1.0; 3], 0.7) };
    let canvas = b.material(canvas);
    let (low, high, z) = ([-0.45f32, 1.15f32], [1.0f32, 2.0f32], -DEEP);
    b.part("painting", canvas, 1.0, |p| {
        let size = vec3(high[0] - low[0], high[1] - low[1], 0.0);
        p.picture(vec3(low[0], low[1], z + 0.02), Vec3::X * size.x, Vec3::Y * size.y);
    });
    b.part("picture frame", palette.dark_wood, 1.0, |p| {
        let (t, flat) = (0.045, Affine3A::IDENTITY);
        p.block(vec3(low[0] - t, low[1] - t, z), vec3(high[0] + t, low[1], z + 0.035), flat);
        p.block(vec3(low[0] - t, high[1], z), vec3(high[0] + t, high[1] + t, z + 0.035), flat);
        p.block(vec3(low[0] - t, low[1], z), vec3(low[0], high[1], z + 0.035), flat);
        p.block(vec3(high[0], low[1], z), vec3(high[0] + t, high[1], z + 0.035), flat);
    });
    let clay = b.material(dielectric("clay", [0.80, 0.78, 0.74], 0.8));
    let soil = b.material(dielectric("soil", [0.05, 0.03, 0.02], 1.0));
    let leaf = b.material(Material { double_sided: true, ..dielectric("leaf", [0.06, 0.30, 0.05], 0.45) });
    let pot = vec3(1.55, 0.0, -2.02);
    b.part("pot", clay, 1.0, |p| {
        let profile = [
            [0.0, 0.0],
            [0.13, 0.0],
            [0.13, 0.0],
            [0.18, 0.34],
            [0.18, 0.34],
            [0.16, 0.34],
            [0.16, 0.34],
            [0.15, 0.29],
        ];
        p.lathe(pot, &profile, 40);
    });
    b.part("soil", soil, 1.0, |p| p.lathe(pot, &[[0.152, 0.30], [0.0, 0.30]], 24));
    b.part("leaves", leaf, 1.0, |p| {
        for i in 0..14 {
            let turn = 2.399_963 * i as f32;
            let lean = 0.12 + 0.045 * i as f32;
            let out = vec3(turn.cos(), 0.0, turn.sin());
            let side = Vec3::Y.cross(out) * 0.045;
            let length = 0.95 - 0.03 * i as f32;
            // Each blade is a chain of quads that bends outwards.
            let point = |t: f32| {
                pot + vec3(0.0, 0.28 + length * t * (1.0 - 0.35 * lean * t), 0.0) + out * (0.03 + length * lean * t * t)
            };
            let width = |t: f32| side * (1.0 - t) * (0.35 + 2.6 * t);
            p.ribbon(
                &(0..=6)
                    .map(|k| k as f32 / 6.0)
                    .map(|t| [point(t) - width(t), point(t) + width(t)])
                    .collect::<Vec<_>>(),
            );
        }
    });
}

fn lamp(b: &mut Builder, palette: &Palette) {
    let warm = [1.0, 0.62, 0.30];
    // Bright enough to look like a lamp, and little light (a tenth) next to the point light, which
    // is the room's true lamp: the path tracer counts both.
    let glow = b.material(Material { emissive: warm.map(|c| c * 20.0), ..dielectric("bulb", [0.8; 3], 0.5) });
    let shade = b.material(Material { double_sided: true, ..dielectric("enamel", [0.82, 0.80, 0.74], 0.3) });
    b.part("bulb", glow, 1.0, |p| p.ball(BULB, 0.045, 24));
    b.part("lamp shade", shade, 1.0, |p| {
        let profile: Vec<[f32; 2]> = (0..=12)
            .map(|i| {
                let (sin, cos) = (0.12 + 1.40 * i as f32 / 12.0).sin_cos();
                [0.24 * sin, 0.19 * cos]
            })
            .rev()
            .collect();
        p.lathe(BULB + vec3(0.0, -0.035, 0.0), &profile, 48);
    });
    b.part("lamp cord", palette.black, 1.0, |p| {
        p.lathe(BULB, &[[0.03, 0.13], [0.03, 0.2], [0.03, 0.2], [0.006, 0.21], [0.006, HIGH - BULB.y]], 16);
    });
    // Inside the bulb the light would see nothing but the bulb, so it hangs just below.
    b.scene.lights.push(Light {
        name: "lamp".to_owned(),
        color: warm,
        kind: LightKind::Point {
            position: (BULB - vec3(0.0, 0.10, 0.0)).into(),
            intensity: 1.6,
            radius: 0.045,
            range: None,
        },
        is_emissive_proxy: false,
    });
}
