//! Lights and doors that change under a still camera.

use super::super::{Corruption, Limit, Observation, Script, Test, measures, rooms};
use super::{LONG, SMALL};
use crate::study::session::Edits;
use bouncelight::scene::{Camera, Light};

const SOON: &str = "a tenth of a second at 60 frames: what happens later no longer seems to be caused by the switch";

pub static SWITCH: Test = Test {
    name: "switch",
    question: "Does light follow a lamp that is switched off and on?",
    limits: &[
        Limit::frames("frames until nine tenths are gone", 6.0, SOON),
        Limit::share("old light that is left after 30 frames", 0.02, "twice the least contrast that an eye sees"),
        Limit::frames("frames until nine tenths are back", 6.0, SOON),
        Limit::share("light that is missing after 30 frames", 0.05, "a fourteenth of a stop"),
    ],
    control: Corruption::Late(0.93),
    size: SMALL,
    paths: 16,
    pictures: false,
    run: |run| {
        let lamp = |w: f32| rooms::lamp([1.5, 3.0, 0.5], w);
        let hall = |w: f32| rooms::hall(rooms::GREY, &[lamp(w)], 0.02);
        let switch = |w: f32| Edits { lights: Some(hall(w).lights), ..Edits::default() };
        let camera = rooms::hall_camera();
        let after = |script: Script| script.looks(&camera, 8).rest(&camera, 21).look(&camera);
        let script = after(Script::new().rest(&camera, LONG).look(&camera).edit(switch(0.0)));
        let looks = run.render_sequence(&hall(20.0), after(script.edit(switch(20.0))))?;
        run.roll(&looks);
        let names = ["on", "off, frame 1", "off, frame 6", "off, frame 30", "on, frame 1", "on, frame 30"];
        let kept = [0, 1, 6, 9, 10, 18];
        kept.into_iter().zip(names).for_each(|(i, name)| run.keep(name, &looks[i]));
        let means: Vec<f64> = looks.iter().map(Observation::mean).collect();
        let dark = run.settled(&hall(0.0), &camera, LONG)?.mean();
        let bright = run.settled(&hall(20.0), &camera, LONG)?.mean();
        let off = measures::frames_to_ninety(&means[1..9], means[0], dark);
        let on = measures::frames_to_ninety(&means[10..18], means[9], bright);
        let left = measures::share((means[9] - dark).abs(), (bright - dark).abs());
        let missing = measures::share((bright - means[18]).abs(), bright);
        Ok(vec![unless_dark(off, bright), left, unless_dark(on, bright), missing])
    },
};

/// A method without any light has nothing to follow with.
fn unless_dark(frames: f64, bright: f64) -> f64 {
    if bright == 0.0 { f64::INFINITY } else { frames }
}

pub static SWEEP: Test = Test {
    name: "sweep",
    question: "Does light follow a lamp that moves at 15 metres a second, evenly?",
    limits: &[
        Limit::share("light on the way against light of the same lamp at rest", 0.15, "a fifth of a stop"),
        Limit::share(
            "second difference of all light from frame to frame, over its mean",
            0.02,
            "twice the least contrast that an eye sees",
        ),
    ],
    control: Corruption::Late(0.93),
    // All light is the mean of as many rays as there are cells: at 96×64 `gather` has 2.3 % of
    // noise (docs/log).
    size: [192, 128],
    paths: 16,
    pictures: false,
    run: |run| {
        let lamp = |i: usize| rooms::lamp([-3.0 + 0.25 * i as f32, 2.5, 1.5], 10.0);
        let hall = |i: usize| rooms::hall(rooms::GREY, &[lamp(i)], 0.02);
        let camera = rooms::hall_camera();
        // The first frame is looked at, or a picture that lingers could not be seen.
        let mut script = Script::new().rest(&camera, LONG).look(&camera);
        for i in 1..=20 {
            let lights: Vec<Light> = hall(i).lights;
            script = script.edit(Edits { lights: Some(lights), ..Edits::default() });
            script = script.look(&camera);
        }
        let looks = run.render_sequence(&hall(0), script)?;
        run.roll(&looks);
        let mut lag = 0.0;
        for (i, name) in [(16, "frame 16"), (20, "frame 20")] {
            let look = &looks[i];
            let rest = run.settled(&hall(i), &camera, LONG)?;
            lag += 0.5 * measures::change(look, &rest);
            run.keep(name, look);
            run.keep("at rest", &rest);
        }
        // Of the frames in which it moves: eighteen, since three would be a draw of lots.
        let means: Vec<f64> = looks[1..].iter().map(Observation::mean).collect();
        let bends: f64 = means.windows(3).map(|m| (m[0] - 2.0 * m[1] + m[2]).abs() / m[1]).sum();
        Ok(vec![lag, bends / (means.len() - 2) as f64])
    },
};

pub static DOOR: Test = Test {
    name: "door",
    question: "Does a room go dark when the door to the lit room next to it is shut, and bright when it is opened?",
    limits: &[
        Limit::frames(
            "frames until nine tenths are gone",
            12.0,
            "a fifth of a second; a hand needs longer for the door",
        ),
        Limit::share("light that is left after 30 frames", 0.02, "twice the least contrast that an eye sees"),
        Limit::share("change of the open room's light after shutting and opening", 0.1, "a seventh of a stop"),
    ],
    control: Corruption::Late(0.95),
    size: SMALL,
    paths: 16,
    pictures: false,
    run: |run| {
        let mut rooms_ =
            rooms::scene(&rooms::two_rooms(0.2, true, rooms::WHITE), &[rooms::lamp([-2.5, 2.4, 0.6], 20.0)], 0.0);
        // It slides into the wall.
        let door = rooms::block(&mut rooms_, [0.18, -0.05, 0.6], [0.28, 2.05, 1.75], rooms::WHITE);
        let open = rooms_.instances[door].transform;
        let at = |share: f32| {
            let mut placed = open;
            placed[3][2] -= 1.175 * share;
            Edits { placements: vec![(door, placed)], ..Edits::default() }
        };
        let camera = Camera::look_at([3.4, 1.6, 1.5], [1.0, 0.7, -0.8], 1.1);
        let mut script = Script::new().rest(&camera, LONG).look(&camera);
        for i in 1..=10 {
            script = script.edit(at(0.1 * i as f32));
            script = if i < 10 { script.rest(&camera, 1) } else { script.look(&camera) };
        }
        script = script.looks(&camera, 15).rest(&camera, 13).look(&camera);
        for i in 1..=10 {
            script = script.edit(at(1.0 - 0.1 * i as f32)).rest(&camera, 1);
        }
        let looks = run.render_sequence(&rooms_, script.rest(&camera, 29).look(&camera))?;
        run.roll(&looks);
        let kept =
            [(0, "open"), (1, "just shut"), (12, "12 frames later"), (17, "30 frames later"), (18, "open again")];
        kept.into_iter().for_each(|(i, name)| run.keep(name, &looks[i]));
        let means: Vec<f64> = looks.iter().map(Observation::mean).collect();
        let gone = measures::frames_to_ninety(&means[1..17], means[0], 0.0);
        let left = measures::share(means[17], means[0]);
        let back = measures::share((means[18] - means[0]).abs(), means[0]);
        Ok(vec![unless_dark(gone, means[0]), left, back])
    },
};
