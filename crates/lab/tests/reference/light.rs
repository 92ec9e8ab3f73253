//! Light sources against closed forms: rectangles, suns, lamps; and the laws that hold for any
//! scene: light adds up, and the way back is the way there.

use crate::harness::{Lab, Options, Strategy, Sums, Traced, lab};
use crate::scenes::*;
use crate::stats::{Mean, SIGMAS};
use bouncelight::scene::{Camera, Environment, Instance, Light, Material, Mesh, Scene};
use glam::DVec3;
use std::f64::consts::PI;

const SIZE: [u32; 2] = [64, 64];
const FLOOR: f32 = 0.6;

fn floor() -> (Mesh, Material) {
    (quad([-20.0, 0.0, 20.0], [40.0, 0.0, 0.0], [0.0, 0.0, -40.0]), lambert(FLOOR))
}

/// Looks down at the floor around the origin.
fn above() -> Camera {
    camera([0.0, 6.0, 3.0], [0.0, 0.0, 0.0], 0.5)
}

/// What the floor's direct light is, as a mean over the points, for the irradiance `e` at each of
/// them.
fn floor_light(points: &[[f32; 2]], e: impl Fn(DVec3) -> f64) -> f64 {
    let camera = above();
    let place = |&p| on_plane(&camera, SIZE, p, DVec3::ZERO, DVec3::Y);
    points.iter().map(|p| f64::from(FLOOR) / PI * e(place(p))).sum::<f64>() / points.len() as f64
}

fn lit_floor(lab: &Lab, lights: Vec<Light>, panel: Option<Mesh>, options: &Options) -> Traced {
    let mut parts = vec![floor()];
    // A black panel, so that it sends no light back that it got from the floor.
    parts.extend(panel.map(|mesh| (mesh, glowing(0.0, 5.0))));
    lab.trace(&scene(parts, lights), &above(), SIZE, &grid(SIZE, 16), options)
}

/// Panels of radiance 5, seen from below or from the side, and the polygon formula.
#[test]
fn a_panel_lights_the_floor_by_lamberts_formula() {
    let Some(lab) = lab() else { return };
    let points = grid(SIZE, 16);
    let corners = |m: &Mesh| m.positions.iter().map(|&p| glam::Vec3::from(p).as_dvec3()).collect::<Vec<_>>();
    let panels = [
        // Parallel to the floor, out of the camera's way.
        ("overhead", quad([-2.0, 2.5, -3.0], [1.5, 0.0, 0.0], [0.0, 0.0, 1.0])),
        // Upright, standing on the floor: its horizon is its lower edge.
        ("upright", quad([-1.5, 0.0, -2.6], [3.0, 0.0, 0.0], [0.0, 2.0, 0.0])),
    ];
    for (seed, (name, panel)) in panels.into_iter().enumerate() {
        let polygon = corners(&panel);
        let expected = floor_light(&points, |p| 5.0 * polygon_irradiance(p, DVec3::Y, &polygon));
        let options = Options { samples: 64, seed: seed as u32, lambert: true, ..Default::default() };
        let t = lit_floor(lab, vec![], Some(panel.clone()), &options);
        t.mean(|s| s.diff_dir[0]).assert_is(&format!("{name} panel"), expected);
        // The black panel sends nothing back.
        assert_eq!(t.mean(|s| s.diff_ind[0]).value, 0.0);

        // Sampling lights alone, hitting them alone and both together are three ways to one answer.
        // The panel overhead is small and rarely hit by chance.
        let by_chance = [1024, 512][seed];
        for (strategy, samples) in [(Strategy::LightsOnly, 128), (Strategy::HitsOnly, by_chance)] {
            let options = Options { samples, strategy, ..options };
            let t = lit_floor(lab, vec![], Some(panel.clone()), &options);
            t.mean(|s| s.diff_dir[0]).assert_is(&format!("… {strategy:?}"), expected);
        }
        let t = lit_floor(lab, vec![], Some(panel), &Options { strategy: Strategy::CountTwice, ..options });
        let twice = t.mean(|s| s.diff_dir[0]);
        assert!((twice.value / expected - 2.0).abs() < 0.1, "counting both in full gives {twice:?}");
    }
}

/// The sun is a disc; its irradiance on a tilted surface is that on one that faces it, times the
/// cosine, whatever its size.
#[test]
fn sunlight_goes_with_the_cosine() {
    let Some(lab) = lab() else { return };
    for (seed, angle) in [0.00918f32, 0.3].into_iter().enumerate() {
        let direction = DVec3::new(0.5, -1.0, 0.3);
        let light = sun(direction.as_vec3().into(), 2.0, angle);
        let options = Options { samples: 32, seed: seed as u32, lambert: true, ..Default::default() };
        let t = lit_floor(lab, vec![light], None, &options);
        let expected = f64::from(FLOOR) / PI * 2.0 * -direction.normalize().y;
        let found = t.mean(|s| s.diff_dir[0]);
        println!("sun of {angle} rad: {found:?}, expected {expected}");
        assert!((found.value / expected - 1.0).abs() < 1e-5 + 4.0 * found.relative());
        assert!(found.relative() < 0.002);
    }
}

/// A lamp without size, and one of radius 0.3 as Cycles has it: a disc that faces the point lit,
/// which gives I·cos/(d² + r²) where all of it is above the horizon.
#[test]
fn lamps_go_with_the_inverse_square() {
    let Some(lab) = lab() else { return };
    let points = grid(SIZE, 16);
    let at = DVec3::new(-0.8, 2.0, -0.5);
    for (seed, radius) in [0.0f64, 0.3].into_iter().enumerate() {
        let e = |p: DVec3| {
            let to = at - p;
            50.0 * to.normalize().y / (to.length_squared() + radius * radius)
        };
        let light = point(at.as_vec3().into(), 50.0, radius as f32);
        let options = Options { samples: 32, seed: seed as u32, lambert: true, ..Default::default() };
        let t = lit_floor(lab, vec![light], None, &options);
        t.mean(|s| s.diff_dir[0]).assert_is(&format!("lamp of radius {radius}"), floor_light(&points, e));
    }
}

/// glTF's cone: the square of a ramp that is linear in the cosine.
#[test]
fn a_spot_fades_by_gltfs_ramp() {
    let Some(lab) = lab() else { return };
    let points = grid(SIZE, 16);
    let (at, axis) = (DVec3::new(0.5, 3.0, 0.2), DVec3::new(-0.2, -1.0, 0.0).normalize());
    let (inner, outer) = (0.15f64, 0.5f64);
    let e = |p: DVec3| {
        let to = at - p;
        let ramp = (-to.normalize().dot(axis) - outer.cos()) / (inner.cos() - outer.cos());
        40.0 * ramp.clamp(0.0, 1.0).powi(2) * to.normalize().y / to.length_squared()
    };
    let light = spot(at.as_vec3().into(), axis.as_vec3().into(), 40.0, inner as f32, outer as f32);
    let t = lit_floor(lab, vec![light], None, &Options { samples: 16, lambert: true, ..Default::default() });
    t.mean(|s| s.diff_dir[0]).assert_is("spot", floor_light(&points, e));
}

/// A room with a block in it, diffuse and shiny surfaces, and every kind of light.
fn furnished(lights: Vec<Light>, panel: f32, sky: f32) -> Scene {
    let shiny = Material { f0: 0.04, roughness: 0.3, ..lambert(0.7) };
    let walls = [lambert(0.7), lambert(0.4), shiny, lambert(0.8), lambert(0.6), metal(0.8, 0.4)];
    let mut parts = cuboid([0.0; 3], [2.0; 3], true, walls);
    // No ceiling: the sky comes in.
    parts.remove(3);
    parts.push((body(bouncelight_scene::shapes::Shape::Cube, 0.6, false), lambert(0.5)));
    parts.push((quad([-1.99, -1.0, -0.5], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]), glowing(0.3, panel)));
    let mut scene = scene(parts, lights);
    scene.environment = Environment { radiance: [sky; 3], ..scene.environment };
    scene
}

fn seen(lab: &Lab, scene: &Scene, seed: u32) -> Traced {
    let eye = camera([1.5, 1.2, 1.7], [-0.5, -0.8, -0.5], 1.0);
    lab.trace(scene, &eye, SIZE, &grid(SIZE, 16), &Options { samples: 64, seed, ..Default::default() })
}

/// Each light alone, summed, is all of them together; twice the light is twice the picture; none is
/// none.
#[test]
fn light_adds_up() {
    let Some(lab) = lab() else { return };
    let lamp = point([0.8, 1.5, 0.5], 3.0, 0.1);
    let shine = sun([0.3, -1.0, 0.2], 0.8, 0.01);
    let alone = [
        furnished(vec![lamp.clone()], 0.0, 0.0),
        furnished(vec![shine.clone()], 0.0, 0.0),
        furnished(vec![], 2.0, 0.0),
        furnished(vec![], 0.0, 0.3),
    ];
    let parts: Vec<Mean> = alone.iter().zip(10..).map(|(s, seed)| seen(lab, s, seed).mean(Sums::radiance)).collect();
    let together = seen(lab, &furnished(vec![lamp.clone(), shine.clone()], 2.0, 0.3), 1);
    let all = together.mean(Sums::radiance);
    println!("alone: {parts:?}\ntogether: {all:?}");
    let sum = parts.iter().fold(Mean { value: 0.0, error: 0.0 }, |a, &b| a + b);
    let off = all - sum;
    assert!(off.value.abs() <= SIGMAS * off.error, "{all:?} is not {sum:?}");
    // Each part is large enough that leaving it out, or 2 % of all, would be noticed.
    assert!(parts.iter().all(|p| p.value > SIGMAS * off.error), "{parts:?} {off:?}");
    assert!(SIGMAS * off.error < 0.02 * all.value, "{off:?} is too coarse");

    let twice = |l: &Light| Light { color: [2.0; 3], ..l.clone() };
    let doubled = seen(lab, &furnished(vec![twice(&lamp), twice(&shine)], 4.0, 0.6), 1);
    for (once, two) in together.halves().iter().flatten().zip(doubled.halves().iter().flatten()) {
        let (once, two) = (once.radiance(), two.radiance());
        assert!((two - 2.0 * once).abs() <= 1e-5 * two.abs(), "{two} is not twice {once}");
    }
    let dark = seen(lab, &furnished(vec![], 0.0, 0.0), 1);
    assert!(dark.halves().iter().flatten().all(|s| s.radiance() == 0.0), "light without any source");
}

/// One face of a box: centre and half extents of the box, the face as [`cuboid`] counts them.
struct Patch {
    center: [f32; 3],
    half: [f32; 3],
    face: usize,
}

impl Patch {
    fn parts(&self, albedo: f32, glow: f32) -> Vec<(Mesh, Material)> {
        let mut materials = [0.2f32; 6].map(lambert);
        materials[self.face] = glowing(albedo, glow);
        cuboid(self.center, self.half, false, materials)
    }

    /// Width, height and a camera whose picture the face fills exactly, so that even points of it
    /// are even on the face.
    fn squarely(&self) -> ([f32; 2], Camera) {
        let axis = self.face / 2;
        let mut normal = glam::Vec3::ZERO;
        normal[axis] = if self.face % 2 == 1 { 1.0 } else { -1.0 };
        let middle = glam::Vec3::from(self.center) + normal * self.half[axis];
        let away = 0.5;
        // Walls are seen with +Y up, floors with −Z up.
        let [x, y, z] = self.half;
        let (width, height) = [(z, y), (x, z), (x, y)][axis];
        let eye = camera((middle + normal * away).into(), middle.into(), 2.0 * (height / away).atan());
        ([2.0 * width, 2.0 * height], eye)
    }
}

/// The power that patch B gets from a glowing patch A, all bounces in a furnished room included, is
/// what A gets from B glowing likewise (Helmholtz).
#[test]
fn the_way_back_is_the_way_there() {
    let Some(lab) = lab() else { return };
    // A is upright, B lies half hidden behind the block from much of A.
    let patches = [
        Patch { center: [-1.8, -1.0, 0.0], half: [0.1, 0.25, 0.4], face: 1 },
        Patch { center: [1.2, -1.9, 0.6], half: [0.2, 0.05, 0.2], face: 3 },
    ];
    let albedo = 0.5f32;
    let received = |glow: [f32; 2], watch: usize, seed: u32| {
        let mut scene = furnished(vec![], 0.0, 0.0);
        for (mesh, material) in patches.iter().zip(glow).flat_map(|(p, glow)| p.parts(albedo, glow)) {
            let index = scene.meshes.len();
            scene.instances.push(Instance { name: "patch".into(), mesh: index, transform: IDENTITY });
            scene.meshes.push(Mesh { material: index, ..mesh });
            scene.materials.push(material);
        }
        let ([width, height], eye) = patches[watch].squarely();
        let picture = [(320.0 * width) as u32, (320.0 * height) as u32];
        let options = Options { samples: 128, seed, lambert: true, ..Default::default() };
        let t = lab.trace(&scene, &eye, picture, &grid(picture, 16), &options);
        // Irradiance from outgoing diffuse light, times the area.
        t.mean(|s| s.diff_dir[0] + s.diff_ind[0]) * (PI / f64::from(albedo) * f64::from(width * height))
    };
    let (there, back) = (received([4.0, 0.0], 1, 5), received([0.0, 4.0], 0, 6));
    println!("from A to B {there:?}, from B to A {back:?}");
    let off = there - back;
    assert!(off.value.abs() <= SIGMAS * off.error, "{there:?} there, {back:?} back");
    assert!(SIGMAS * off.error < 0.04 * there.value, "{off:?} is too coarse");
    // The patches' areas differ by 2.5, so forgetting them is noticed; and so is 4 % more on one
    // side.
    assert!((off + there * 0.04).value.abs() > SIGMAS * off.error);
}
