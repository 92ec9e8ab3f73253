//! What few rays have found, as averages over cells show it: no blotches, no pattern, and contacts
//! kept.

use crate::build::{floor, look_at, material, point, quad, scene};
use crate::gather::lit;
use crate::{common, world};
use bouncelight::gi::Method;
use bouncelight::gi::gather::Options;
use bouncelight::gpu::Gpu;
use bouncelight::render::capture::{CaptureOptions, Layer, capture};
use bouncelight::scene::{Environment, Scene};

const SIZE: [u32; 2] = [96, 64];
const CELLS: [usize; 2] = [24, 16];

/// The usual options with a table for small scenes.
fn few() -> Options {
    Options { slots: world::FEW_SLOTS, ..Default::default() }
}

/// Means of cells of 4×4 pixels of the first channel.
fn of_cells(data: &[f32]) -> Vec<f64> {
    let at = |cell: usize| {
        let (x, y) = (4 * (cell % CELLS[0]), 4 * (cell / CELLS[0]));
        let pixels = (0..16).map(|i| (y + i / 4) * SIZE[0] as usize + x + i % 4);
        pixels.map(|p| f64::from(data[3 * p])).sum::<f64>() / 16.0
    };
    (0..CELLS[0] * CELLS[1]).map(at).collect()
}

/// A black floor below a small white square that a lamp next to it lights: few rays meet the
/// square, and what they find is some thousand times what the floor has.
fn lamp_at_a_shade() -> Scene {
    let shade = quad([-0.05, 2.0, -0.05], [0.1, 0.0, 0.0], [0.0, 0.0, 0.1]);
    let mut s = scene(vec![floor(6.0, 0.0), shade], vec![point([0.0, 1.9, 0.0], 10.0, 0.0)]);
    s.materials = vec![material([0.02; 3]), material([0.8; 3])];
    s.materials[1].double_sided = true;
    s.meshes[1].material = 1;
    s.environment = Environment::constant([0.0; 3]);
    s.cameras = vec![look_at([0.0, 3.0, 4.0], [0.0, 0.0, 0.0], 0.6)];
    s
}

#[test]
fn what_one_bright_ray_brings_is_no_blotch_and_is_not_lost() {
    let Some(gpu) = common::gpu() else { return };
    let drawn = |blur: bool, seed: u32| {
        let method = Method::Gather(Options { blur, seed, ..few() });
        of_cells(&lit(&gpu, &mut world::renderer(&gpu, SIZE, method), &lamp_at_a_shade(), 16).0.data)
    };
    let mean = |cells: &[f64]| cells.iter().sum::<f64>() / cells.len() as f64;
    let brightest = |cells: &[f64]| cells.iter().copied().fold(0.0, f64::max) / mean(cells);
    // A handful of rays meets the shade: what one seed's few bring hangs on how many neighbours they have.
    let (mut in_all, mut brought) = (0.0, 0.0);
    for seed in 0..8 {
        let (shown, rays) = (drawn(true, seed), drawn(false, seed));
        println!(
            "brightest {:.2} {:.2}, mean {:.5} {:.5}",
            brightest(&shown),
            brightest(&rays),
            mean(&shown),
            mean(&rays)
        );
        assert!(brightest(&shown) < 3.5, "{} times the mean", brightest(&shown));
        // Control: the rays themselves.
        assert!(brightest(&rays) > 20.0, "{}", brightest(&rays));
        in_all += mean(&shown);
        brought += mean(&rays);
    }
    assert!((in_all / brought - 1.0).abs() < 0.15, "{in_all} of {brought}");
}

/// How much cells differ from those beside them, root mean square over the mean, away from the
/// picture's border.
fn roughness_of(cells: &[f64]) -> f64 {
    let (mut squares, mut sum, mut count) = (0.0, 0.0, 0.0);
    for y in 3..CELLS[1] - 3 {
        for x in 3..CELLS[0] - 3 {
            let i = y * CELLS[0] + x;
            let apart = cells[i] - 0.25 * (cells[i - 1] + cells[i + 1] + cells[i - CELLS[0]] + cells[i + CELLS[0]]);
            squares += apart * apart;
            sum += cells[i];
            count += 1.0;
        }
    }
    (squares / count).sqrt() / (sum / count)
}

/// Light that a rough metal floor shows of a small square that glows: by cells.
fn rough_metal(gpu: &Gpu, frames: u32) -> Vec<f64> {
    let square = quad([-0.3, 1.5, -4.0], [0.6, 0.0, 0.0], [0.0, 0.6, 0.0]);
    let mut s = scene(vec![floor(8.0, 0.0), square], vec![]);
    s.materials = vec![material([1.0; 3]), material([0.0; 3])];
    (s.materials[0].metallic, s.materials[0].roughness) = (1.0, 0.6);
    s.materials[1].emissive = [50.0; 3];
    s.meshes[1].material = 1;
    s.environment = Environment::constant([0.0; 3]);
    s.cameras = vec![look_at([0.0, 1.5, 3.0], [0.0, 0.0, 0.0], 0.6)];
    let mut renderer = world::renderer(gpu, SIZE, Method::Gather(few()));
    let options = CaptureOptions { layers: &[Layer::GlossInd], warmup: frames - 1, ..Default::default() };
    let uploaded = crate::gather::uploaded(gpu, &s);
    let frame = capture(gpu, &mut renderer, &uploaded, &s.cameras[0], options).expect("the frame is drawn");
    of_cells(&frame.layer(Layer::GlossInd).expect("asked for").data)
}

/// Of each 2×2 cells one in turn sends a ray into its lobe; which one it was is not to be seen.
/// (Each cell with the noise of its own turn: 0.55.)
#[test]
fn turns_of_cells_leave_no_pattern_in_rough_lobes() {
    let Some(gpu) = common::gpu() else { return };
    let cells = rough_metal(&gpu, 16);
    let rough = roughness_of(&cells);
    // Control: every second cell brighter by a fifth.
    let striped: Vec<f64> = (0..cells.len()).map(|i| cells[i] * if i % 2 == 0 { 1.2 } else { 1.0 }).collect();
    println!("{rough:.4}, with stripes {:.4}", roughness_of(&striped));
    assert!(rough < 0.07, "{rough}");
    assert!(roughness_of(&striped) > 0.07);
}

/// A floor whose shading normals lean by 40°, as those of coarse meshes and bumps do, under an even
/// sky.
fn leaning_floor(lean: f32) -> Scene {
    let mut ground = floor(8.0, 0.0);
    let (sine, cosine) = lean.to_radians().sin_cos();
    ground.normals = vec![[0.0, cosine, sine]; ground.normals.len()];
    let mut s = scene(vec![ground], vec![]);
    s.materials = vec![material([0.02; 3])];
    s.environment = Environment::constant([1.0; 3]);
    s.cameras = vec![look_at([0.0, 3.0, 4.0], [0.0, 0.0, 0.0], 0.6)];
    s
}

/// What cells beside each other have found is averaged over the plane that they lie in, not over
/// the one that shading normals tell, in which hardly two rows of them lie.
#[test]
fn leaning_normals_leave_no_bands() {
    let Some(gpu) = common::gpu() else { return };
    let drawn = |blur: bool| {
        let method = Method::Gather(Options { blur, ..few() });
        of_cells(&lit(&gpu, &mut world::renderer(&gpu, SIZE, method), &leaning_floor(40.0), 16).0.data)
    };
    let [shown, rays] = [true, false].map(|blur| roughness_of(&drawn(blur)));
    println!("{shown:.4}, without blur {rays:.4}");
    // By the plane of shading normals: 0.77 of it.
    assert!(shown < 0.6 * rays, "{shown} of {rays}");
}

/// A black wall of 15 cm on a black floor under an even sky: x from a long wall of height h the
/// floor sees (1 + x/√(x² + h²))/2 of the sky. The wall is 2.6 cells high, and the blur five wide.
#[test]
fn light_at_the_foot_of_a_wall_is_not_averaged_with_that_of_the_floor_around() {
    let Some(gpu) = common::gpu() else { return };
    let high = 0.15f64;
    let wall = quad([0.0, 0.0, 6.0], [0.0, 0.0, -12.0], [0.0, high as f32, 0.0]);
    let mut s = scene(vec![floor(6.0, 0.0), wall], vec![]);
    s.materials = vec![material([0.02; 3])];
    s.materials[0].double_sided = true;
    s.environment = Environment::constant([1.0; 3]);
    s.cameras = vec![look_at([2.0, 2.25, 0.0], [0.3, 0.0, 0.0], 0.3)];
    let cell = 4.0 * 2.0 * 0.15f64.tan() * 2.8 / f64::from(SIZE[1]);
    let expected = |x: f64, h: f64| 0.5 * (1.0 + x / x.hypot(h));
    let drawn = |options, frames| lit(&gpu, &mut world::renderer(&gpu, SIZE, Method::Gather(options)), &s, frames);
    // 128 rays a cell, the last half of them at rest, one in four frames.
    let (light, places) = drawn(few(), 320);
    // Light so far from the wall, in cells, over what the formula gives.
    let over = |light: &[f32], from: f64, to: f64, h: f64| {
        let (mut found, mut wanted) = (0.0, 0.0);
        for (e, p) in light.chunks_exact(3).zip(places.data.chunks_exact(3)) {
            let x = f64::from(p[0]) / cell;
            if p[1].abs() < 1e-3 && x > from && x < to {
                found += f64::from(e[0]);
                wanted += expected(x * cell, h);
            }
        }
        found / wanted
    };
    let far = over(&light.data, 1.0, 4.0, high);
    assert!((far - 1.0).abs() < 0.03, "{far}");
    assert!((over(&light.data, 1.0, 4.0, 0.5 * high) - 1.0).abs() > 0.06, "a wall half as high");
    // Nearer to it cells are coarser than the light; what they know without any blur is the measure
    // there.
    let [shown, known] = [&light, &drawn(Options::PLAIN, 512).0].map(|l| over(&l.data, 0.0, 1.0, high));
    println!("{far:.3}; in the nearest cell {shown:.3}, without blur {known:.3}");
    assert!((shown / known - 1.0).abs() < 0.03, "{shown}, {known}");
    // Control: five cells in the mean, the outer ones by half, of which two are the wall's.
    let blurred = [(0.5, 1.0), (1.5, 1.0), (2.5, 0.5)].map(|(x, w)| (w * expected(x * cell, high), w));
    let blurred = blurred.iter().map(|b| b.0).sum::<f64>() / blurred.iter().map(|b| b.1).sum::<f64>();
    assert!(blurred / expected(0.5 * cell, high) > 1.12);
}
