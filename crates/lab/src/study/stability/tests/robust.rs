//! Odd sizes, odd scenes, numbers that are none.

use super::super::{Corruption, Limit, Observation, Script, StabilityError, Test, TestRun, measures, rooms};
use super::SMALL;
use crate::study::session::SessionError;
use bouncelight::render::RenderError;
use bouncelight::scene::{Camera, LightKind, Mesh, Scene};

pub static SIZES: Test = Test {
    name: "sizes",
    question: "Are pictures of any size, and of scenes with next to nothing in them, finite and whole?",
    limits: &[Limit::count("pictures that are not", 0.0, "a program that works")],
    control: Corruption::Broken,
    size: SMALL,
    paths: 1,
    pictures: false,
    run: |run| {
        let camera = rooms::hall_camera();
        let hall = rooms::hall(rooms::RED, &[rooms::sun(rooms::BACKWARDS, 2.0)], 0.1);
        let empty = rooms::scene(&[], &[rooms::sun(rooms::BACKWARDS, 2.0)], 1.0);
        let mut faults = 0;
        for size in [[1, 1], [17, 13], [1, 64], [64, 1], [3, 2]] {
            faults += fails(run, &hall, &camera, size)?;
        }
        // As wide, and as high, as 8K.
        let limit = run.stage.gpu.device.limits().max_texture_dimension_2d;
        for size in [[7680, 4], [4, 4320]] {
            faults += fails(run, &hall, &camera, size.map(|n: u32| n.min(limit)))?;
        }
        for scene in [&empty, &sky_only(), &triangle()] {
            faults += fails(run, scene, &camera, [32, 24])?;
        }
        Ok(vec![f64::from(faults)])
    },
};

fn sky_only() -> Scene {
    rooms::scene(&[], &[], 1.0)
}

fn triangle() -> Scene {
    let mut scene = rooms::scene(&[([0.0; 3], [1.0; 3], rooms::GREY)], &[rooms::sun([0.0, 0.0, -1.0], 2.0)], 0.5);
    scene.meshes[0] = Mesh {
        positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]],
        normals: vec![[0.0, 0.0, 1.0]; 3],
        indices: vec![0, 1, 2],
        ..Mesh::default()
    };
    scene
}

/// 1 for a picture that cannot be drawn, has another size or holds what is no number.
fn fails(run: &TestRun<'_>, scene: &Scene, camera: &Camera, size: [u32; 2]) -> Result<u32, StabilityError> {
    let scope = run.stage.gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let looks = run.render_sequence_at(scene, size, Script::new().rest(camera, 2).look(camera));
    let refused = pollster::block_on(scope.pop());
    match looks {
        Err(StabilityError::Session(SessionError::Stopped)) => Err(SessionError::Stopped.into()),
        Err(e) => {
            tracing::warn!("{}×{}: {e}", size[0], size[1]);
            Ok(1)
        }
        Ok(looks) => {
            let whole = looks[0].size == size && looks[0].light.len() == 3 * looks[0].pixels();
            Ok(u32::from(!whole || refused.is_some() || broken(&looks[0]) > 0))
        }
    }
}

/// Values that are no numbers.
fn broken(look: &Observation) -> usize {
    look.broken + look.light.iter().chain(&look.rgb).filter(|v| !v.is_finite()).count()
}

pub static BROKEN: Test = Test {
    name: "broken-input",
    question: "Do normals, glow and lights that are no numbers leave the rest of the picture alone?",
    limits: &[
        Limit::count("pixels that are no numbers", 0.0, "one NaN spreads to everything that reads it"),
        Limit::share(
            "change of the light elsewhere",
            0.1,
            "the broken box and lamp take part of the room's light with them",
        ),
    ],
    control: Corruption::Broken,
    size: SMALL,
    paths: 16,
    pictures: false,
    run: |run| {
        let camera = rooms::hall_camera();
        let mut hall = rooms::hall(rooms::RED, &[rooms::sun(rooms::BACKWARDS, 2.0)], 0.1);
        let at = ([1.8, 0.0, -2.2], [2.2, 0.4, -1.8]);
        let number = rooms::block(&mut hall, at.0, at.1, rooms::GREY);
        let sane = run.settled(&hall, &camera, 20)?;
        let mesh = hall.instances[number].mesh;
        hall.meshes[mesh].normals.iter_mut().for_each(|n| *n = [f32::NAN; 3]);
        hall.materials[number].emissive = [f32::INFINITY, f32::NAN, 1.0];
        let lamp = LightKind::Point { position: [0.0, f32::NAN, 0.0], intensity: f32::NAN, radius: 0.1, range: None };
        hall.lights.push(rooms::light(lamp, [1.0; 3]));
        run.keep("sound", &sane);
        match run.settled(&hall, &camera, 20) {
            Ok(look) => {
                run.keep("broken", &look);
                Ok(vec![broken(&look) as f64, change_elsewhere(&sane, &look, at)])
            }
            Err(StabilityError::Session(SessionError::Render(RenderError::NotFinite { count, .. }))) => {
                Ok(vec![count as f64, f64::INFINITY])
            }
            Err(e) => Err(e),
        }
    },
};

/// Change of light at places outside the box.
fn change_elsewhere(a: &Observation, b: &Observation, (low, high): ([f32; 3], [f32; 3])) -> f64 {
    let (low, high) = (glam::Vec3::from(low) - 0.01, glam::Vec3::from(high) + 0.01);
    let inside = |p: glam::Vec3| p.cmpge(low).all() && p.cmple(high).all();
    let mut a = a.clone();
    for (pixel, place) in a.positions().into_iter().enumerate() {
        if place.is_some_and(inside) {
            a.light[3 * pixel..3 * pixel + 3].copy_from_slice(&b.light[3 * pixel..3 * pixel + 3]);
        }
    }
    measures::change(&a, b)
}
