//! What must hold of any light: it is linear, it has its colour, it knows no metres.

use super::super::{Corruption, Limit, Observation, StabilityError, Test, TestRun, measures, rooms};
use super::SMALL;
use bouncelight::scene::{Camera, Environment, LightKind, Scene};

/// Frames of each picture.
const FRAMES: usize = 20;

const LINEAR: &str = "physics: light is linear; half floats have steps of 0.05 %";

fn lamps() -> [LightKind; 2] {
    [rooms::sun(rooms::BACKWARDS, 2.0), rooms::lamp([2.5, 2.5, -1.0], 6.0)]
}

/// The hall with sun, lamp and sky times these factors.
fn hall(sun: f32, lamp: f32, sky: f32) -> Scene {
    let [s, l] = lamps();
    let mut scene = rooms::hall(rooms::RED, &[s, l], 0.1 * sky);
    for (light, factor) in scene.lights.iter_mut().zip([sun, lamp]) {
        light.color = [factor; 3];
    }
    scene
}

/// A copy with `factor` times the light.
fn times(look: &Observation, factor: f32) -> Observation {
    Observation { light: look.light.iter().map(|v| v * factor).collect(), ..look.clone() }
}

pub static TWICE: Test = Test {
    name: "twice",
    question: "Is twice the light exactly twice the answer, and no light none?",
    limits: &[
        Limit::share("difference of half the answer to twice the light", 0.001, LINEAR),
        Limit::count("values above 0 without any light", 0.0, "physics"),
    ],
    control: Corruption::Curve(0.9),
    size: SMALL,
    paths: 16,
    pictures: false,
    run: |run| {
        let camera = rooms::hall_camera();
        let once = run.settled(&hall(1.0, 1.0, 1.0), &camera, FRAMES)?;
        let twice = run.settled(&hall(2.0, 2.0, 2.0), &camera, FRAMES)?;
        let none = run.settled(&hall(0.0, 0.0, 0.0), &camera, FRAMES)?;
        run.keep("once", &once);
        run.keep("twice", &twice);
        run.keep("none", &none);
        let lit = none.light.iter().filter(|v| **v != 0.0).count();
        Ok(vec![measures::change(&times(&twice, 0.5), &once), lit as f64])
    },
};

pub static SUM: Test = Test {
    name: "sum",
    question: "Is the light of sun, lamp and sky together the sum of theirs apart?",
    limits: &[Limit::share(
        "difference of the whole from the sum, over 4×4 pixels",
        0.05,
        "physics; 5 % for the noise of four pictures",
    )],
    control: Corruption::Curve(0.8),
    size: SMALL,
    paths: 64,
    pictures: false,
    run: |run| {
        let camera = rooms::hall_camera();
        let of = |sun, lamp, sky| run.settled(&hall(sun, lamp, sky), &camera, 2 * FRAMES);
        let whole = of(1.0, 1.0, 1.0)?;
        let parts = [of(1.0, 0.0, 0.0)?, of(0.0, 1.0, 0.0)?, of(0.0, 0.0, 1.0)?];
        let mut sum = parts[0].clone();
        for (i, v) in sum.light.iter_mut().enumerate() {
            *v += parts[1].light[i] + parts[2].light[i];
        }
        run.keep("together", &whole);
        parts.iter().zip(["sun", "lamp", "sky"]).for_each(|(part, name)| run.keep(name, part));
        Ok(vec![measures::at_same_places(&sum, &whole).0])
    },
};

pub static EXPOSURE: Test = Test {
    name: "exposure",
    question: "Is the answer the same, but for its scale, in light 64 times as weak and as strong?",
    limits: &[Limit::share("largest difference of the scaled answers", 0.005, "physics; ten steps of a half float")],
    control: Corruption::Curve(0.99),
    size: SMALL,
    paths: 16,
    pictures: false,
    run: |run| {
        let camera = rooms::hall_camera();
        let plain = run.settled(&hall(1.0, 1.0, 1.0), &camera, FRAMES)?;
        let mut worst = 0.0f64;
        for factor in [1.0 / 64.0, 64.0] {
            let other = run.settled(&hall(factor, factor, factor), &camera, FRAMES)?;
            let back = times(&other, 1.0 / factor);
            worst = worst.max(measures::change(&back, &plain));
            run.keep(if factor < 1.0 { "/64, scaled back" } else { "x64, scaled back" }, &scaled_back(&other, factor));
        }
        Ok(vec![worst])
    },
};

fn scaled_back(look: &Observation, factor: f32) -> Observation {
    Observation { rgb: look.rgb.iter().map(|v| v / factor).collect(), ..times(look, 1.0 / factor) }
}

pub static SATURATED: Test = Test {
    name: "saturated",
    question: "Does pure red light stay pure red?",
    limits: &[Limit::share("green and blue over red", 0.0, "physics: a channel without light has none")],
    control: Corruption::Grey(0.01),
    size: SMALL,
    paths: 16,
    pictures: false,
    run: |run| {
        let mut red = hall(1.0, 1.0, 0.0);
        red.lights.iter_mut().for_each(|l| l.color = [1.0, 0.0, 0.0]);
        red.environment = Environment::constant([0.1, 0.0, 0.0]);
        let look = run.settled(&red, &rooms::hall_camera(), FRAMES)?;
        run.keep("pure red", &look);
        let sum = |c: usize| look.light.iter().skip(c).step_by(3).map(|v| f64::from(v.abs())).sum::<f64>();
        Ok(vec![measures::share(sum(1) + sum(2), sum(0))])
    },
};

pub static UNITS: Test = Test {
    name: "units",
    question: "Is the light the same in a file whose unit is a thousand times too large or too small?",
    limits: &[
        Limit::share(
            "in millimetres taken for metres (1000 times as large)",
            0.05,
            "physics: the picture is the same; 5 % for noise",
        ),
        Limit::share(
            "in kilometres taken for metres (1000 times as small)",
            0.05,
            "physics: the picture is the same; 5 % for noise",
        ),
    ],
    control: Corruption::Metres(0.5),
    size: SMALL,
    paths: 32,
    pictures: false,
    run: |run| {
        let (scene, camera) = (hall(1.0, 1.0, 1.0), rooms::hall_camera());
        let plain = run.settled(&scene, &camera, 2 * FRAMES)?;
        run.keep("metres", &plain);
        let large = unit(run, &scene, &camera, 1000.0, "x1000")?;
        let small = unit(run, &scene, &camera, 0.001, "/1000")?;
        Ok(vec![measures::change(&large, &plain), measures::change(&small, &plain)])
    },
};

fn unit(
    run: &TestRun<'_>,
    scene: &Scene,
    camera: &Camera,
    factor: f32,
    name: &str,
) -> Result<Observation, StabilityError> {
    let (scene, camera) = rooms::scaled(scene, camera, factor);
    let look = run.settled(&scene, &camera, 2 * FRAMES)?;
    run.keep(name, &look);
    Ok(look)
}
