//! What networks are known to do: splotches, coarse numbers, scenes unlike those they have learnt.

use super::super::{Corruption, Limit, Observation, StabilityError, Subject, Test, measures, rooms};
use super::{LARGE, LONG, SMALL};
use bouncelight::gi::Method;
use bouncelight::net::plan::Precision;
use bouncelight::scene::{Camera, ColorSpace, Image, Sampler, Scene, TextureRef};
use bouncelight_scene::shapes::Shape;
use glam::{Quat, Vec3};

pub static FLAT: Test = Test {
    name: "flat",
    question: "Is a plain wall in even light free of splotches?",
    limits: &[Limit::share(
        "standard deviation over 8×8 pixels of what should be even",
        0.02,
        "physics: under an open sky a floor has one light; twice the least contrast that an eye sees",
    )],
    control: Corruption::Screen(0.5),
    size: LARGE,
    paths: 8,
    pictures: true,
    run: |run| {
        // Nothing but a floor under the sky and a sun: the same light everywhere.
        let floor = [([-40.0, -0.2, -40.0], [40.0, 0.0, 40.0], rooms::GREY)];
        let scene = rooms::scene(&floor, &[rooms::sun([0.3, -0.9, 0.1], 1.0)], 0.3);
        let look = run.settled(&scene, &Camera::look_at([0.0, 4.0, 4.0], [0.0, 0.0, -1.0], 0.8), 24)?;
        run.keep("an even floor", &look);
        Ok(vec![measures::unevenness(&look, |_, _| true, 8)])
    },
};

pub static HALF: Test = Test {
    name: "half",
    question: "Is the answer of a network stored in 16 bits that of 32?",
    limits: &[Limit::share("difference", 0.005, "ten steps of a half float")],
    control: Corruption::Noise(0.1),
    size: SMALL,
    paths: 8,
    pictures: false,
    run: |run| {
        let (scene, camera) =
            (rooms::hall(rooms::RED, &[rooms::sun(rooms::BACKWARDS, 2.0)], 0.1), rooms::hall_camera());
        let of = |precision| match run.subject() {
            Subject::Method { name, method: Method::Neural(neural) } => {
                let mut neural = neural.clone();
                neural.network.precision = precision;
                let subject = Subject::Method { name: name.clone(), method: Method::Neural(neural) };
                run.as_other(&subject).settled(&scene, &camera, 8)
            }
            Subject::Truth => run.settled(&scene, &camera, 8),
            _ => Err(StabilityError::NotForIt("it has no network")),
        };
        let (full, half) = (of(Precision::F32)?, of(Precision::F16)?);
        run.keep("32 bits", &full);
        run.keep("16 bits", &half);
        Ok(vec![measures::change(&half, &full)])
    },
};

pub static UNSEEN: Test = Test {
    name: "unseen",
    question: "Is the light right in a scene of shapes and textures that no training has seen?",
    limits: &[Limit::share(
        "error of light over 4×4 pixels",
        0.15,
        "the worst real scene's is 17 % (docs/results/accuracy.md)",
    )],
    control: Corruption::Gain(1.3),
    size: [128, 64],
    paths: 128,
    pictures: true,
    run: |run| {
        let (scene, camera) = still_life();
        let (look, truth) = (run.settled(&scene, &camera, LONG)?, run.truth(&scene, &camera)?);
        run.keep("shapes and checks", &look);
        Ok(vec![pooled_error(&look, &truth)])
    },
};

/// A checkered floor, two walls, a torus, a cone, a ball and a tilted plate under a lamp and a sky.
fn still_life() -> (Scene, Camera) {
    let blocks = [
        ([-4.0, -0.2, -4.0], [4.0, 0.0, 4.0], [1.0; 3]),
        ([-4.0, 0.0, -4.2], [4.0, 4.0, -4.0], [0.3, 0.5, 0.7]),
        ([-4.2, 0.0, -4.0], [-4.0, 4.0, 4.0], [0.8, 0.6, 0.2]),
    ];
    let mut scene = rooms::scene(&blocks, &[rooms::lamp([1.5, 3.0, 1.0], 12.0)], 0.25);
    let checks =
        |x: u32, y: u32| if (x / 8 + y / 8).is_multiple_of(2) { [230, 220, 200, 255] } else { [60, 80, 60, 255] };
    let rgba = (0..64).flat_map(|y| (0..64).flat_map(move |x| checks(x, y))).collect();
    scene.images.push(Image { name: "checks".into(), width: 64, height: 64, rgba, color_space: ColorSpace::Srgb });
    let transform = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    scene.materials[0].base_color_texture =
        Some(TextureRef { image: 0, sampler: Sampler::default(), uv_set: 0, transform });
    // The box's places seen from above, in metres over four.
    let floor = &mut scene.meshes[0];
    floor.uv0 = floor.positions.iter().map(|p| [0.5 + 0.5 * p[0], 0.5 + 0.5 * p[2]]).collect();
    let mut put = |shape, at: [f32; 3], size: f32, turn, colour| {
        rooms::body(&mut scene, shape, Vec3::from(at), Vec3::splat(size), turn, rooms::matt(colour));
    };
    put(Shape::Torus, [-1.0, 0.3, -1.0], 1.2, Quat::from_rotation_x(0.3), [0.8, 0.3, 0.3]);
    put(Shape::Cone, [1.6, 0.9, -2.0], 0.9, Quat::IDENTITY, [0.3, 0.8, 0.4]);
    put(Shape::UvSphere, [0.6, 0.5, 0.6], 0.5, Quat::IDENTITY, [0.8; 3]);
    put(Shape::IcoSphere, [-2.4, 0.6, 1.0], 0.6, Quat::IDENTITY, [0.4, 0.4, 0.9]);
    (scene, Camera::look_at([3.0, 2.4, 4.2], [-0.4, 0.5, -0.8], 0.8))
}

/// Σ|Δ| / Σ after 4×4 pooling over blocks that are all surface.
fn pooled_error(look: &Observation, truth: &Observation) -> f64 {
    let [w, h] = truth.size.map(|n| n as usize);
    let (mut apart, mut all) = (0.0, 0.0);
    for (bx, by) in (0..h / 4).flat_map(|y| (0..w / 4).map(move |x| (x, y))) {
        let pixels: Vec<usize> = (0..16).map(|i| (4 * by + i / 4) * w + 4 * bx + i % 4).collect();
        if pixels.iter().all(|&p| truth.is_surface(p)) {
            for c in 0..3 {
                let mean = |l: &Observation| pixels.iter().map(|p| f64::from(l.light[3 * p + c])).sum::<f64>() / 16.0;
                apart += (mean(look) - mean(truth)).abs();
                all += mean(truth);
            }
        }
    }
    measures::share(apart, all)
}
