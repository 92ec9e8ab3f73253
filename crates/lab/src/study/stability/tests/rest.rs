//! A still camera before a still scene.

use super::super::{Corruption, Limit, Script, StabilityError, Test, TestRun, measures, rooms};
use super::{LARGE, LONG, SMALL};
use bouncelight::scene::{Camera, Scene};

const STILL: &str = "half of the least contrast that an eye sees, 1 % (Weber)";

const CHANGE: Limit = Limit::share("change from frame to frame", 0.005, STILL);
const SPARK: Limit = Limit::share(
    "largest change of a pixel (99.9th percentile, of the mean light)",
    0.05,
    "a spark of 5 % in one frame of a thousandth of the picture",
);

pub static FROZEN: Test = Test {
    name: "frozen",
    question: "Does a still picture come to rest within 100 frames?",
    limits: &[CHANGE, SPARK, Limit::share("change of all light since frame 50", 0.01, "1 % (Weber)")],
    control: Corruption::Noise(0.1),
    size: SMALL,
    paths: 16,
    pictures: true,
    run: |run| {
        at_rest(run, &rooms::hall(rooms::GREY, &[rooms::sun(rooms::BACKWARDS, 2.0)], 0.02), &rooms::hall_camera(), 100)
    },
};

pub static DARK_ROOM: Test = Test {
    name: "dark-room",
    question: "Is a dark room, lit by a patch of sun behind the camera, quiet for 200 frames?",
    limits: &[
        CHANGE,
        SPARK,
        Limit::share(
            "change of all light since frame 100",
            0.02,
            "twice the least contrast that an eye sees, over three seconds",
        ),
    ],
    run: |run| {
        let (room, camera) = dark_room();
        at_rest(run, &room, &camera, 200)
    },
    ..FROZEN
};

pub static REPEAT: Test = Test {
    name: "repeat",
    question: "Do the same frames give the same picture again?",
    limits: &[Limit::share(
        "largest difference of a value, of the mean",
        0.0,
        "to the bit: what differs by chance flickers",
    )],
    control: Corruption::Noise(0.01),
    size: LARGE,
    paths: 4,
    pictures: true,
    run: |run| {
        let hall = rooms::hall(rooms::RED, &[rooms::sun(rooms::BACKWARDS, 2.0)], 0.05);
        let camera = rooms::hall_camera();
        let (a, b) = (run.settled(&hall, &camera, 8)?, run.settled(&hall, &camera, 8)?);
        run.keep("once", &a);
        run.keep("again", &b);
        let largest = a.light.iter().zip(&b.light).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        Ok(vec![measures::share(f64::from(largest), b.mean())])
    },
};

/// A closed room with a window, through which the sun falls on the floor behind the camera.
pub(super) fn dark_room() -> (Scene, Camera) {
    let mut blocks = rooms::shell([-3.0, 0.0, -3.0], [3.0, 3.0, 3.0], rooms::GREY);
    // The wall at +X, with a window of 0.8×0.8 m.
    blocks.remove(1);
    let x = [3.0, 3.2];
    for (y, z) in
        [([-0.2, 1.2], [-3.2, 3.2]), ([2.0, 3.2], [-3.2, 3.2]), ([1.2, 2.0], [-3.2, -0.4]), ([1.2, 2.0], [0.4, 3.2])]
    {
        blocks.push(([x[0], y[0], z[0]], [x[1], y[1], z[1]], rooms::GREY));
    }
    let room = rooms::scene(&blocks, &[rooms::sun([-0.8, -0.6, 0.0], 10.0)], 0.1);
    (room, Camera::look_at([-0.5, 1.5, 0.5], [-3.0, 1.3, -0.6], 1.0))
}

fn at_rest(run: &TestRun<'_>, scene: &Scene, camera: &Camera, frames: usize) -> Result<Vec<f64>, StabilityError> {
    let half = frames / 2;
    let script = Script::new().rest(camera, half - 1).look(camera).rest(camera, frames - half - 2).looks(camera, 2);
    let looks = run.render_sequence(scene, script)?;
    run.keep(&format!("frame {half}"), &looks[0]);
    run.keep(&format!("frame {frames}"), &looks[2]);
    run.keep("change ×8", &measures::shown_change(&looks[1], &looks[2], 8.0));
    debug_assert!(frames >= LONG);
    let change = measures::change(&looks[1], &looks[2]);
    let largest = measures::largest_change(&looks[1], &looks[2]);
    let drift = measures::share((looks[2].mean() - looks[0].mean()).abs(), looks[2].mean());
    Ok(vec![change, largest, drift])
}
