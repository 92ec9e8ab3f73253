//! What is seen must not decide what light there is.

use super::super::{Corruption, Limit, Script, Test, measures, rooms};
use super::{LARGE, LONG, SMALL};
use bouncelight::scene::Camera;

const SAME: &str = "physics: diffuse light does not depend on the camera; 5 % is a fourteenth of a stop";

pub static RED_WALL: Test = Test {
    name: "red-wall",
    question: "Does a sunlit red wall still light the floor when it has left the picture?",
    limits: &[
        Limit::share("change of light at the same places, over 4×4 pixels", 0.05, SAME),
        Limit::share("change of red over green there", 0.02, "twice the least contrast that an eye sees"),
    ],
    control: Corruption::Screen(0.5),
    size: LARGE,
    paths: 128,
    pictures: true,
    run: |run| {
        let hall = rooms::hall(rooms::RED, &[rooms::sun([0.0, -0.6, 0.8], 3.0)], 0.05);
        let eye = [0.0, 1.8, 1.0];
        let (wall, floor) = (Camera::look_at(eye, [0.0, 0.8, 6.0], 1.0), Camera::look_at(eye, [0.0, 0.0, 2.2], 1.0));
        let mut script = Script::new().rest(&wall, LONG).look(&wall);
        for i in 1..=12 {
            let t = i as f32 / 12.0;
            script = script.rest(&Camera::look_at(eye, [0.0, 0.8 - 0.8 * t, 6.0 - 3.8 * t], 1.0), 1);
        }
        let looks = run.render_sequence(&hall, script.rest(&floor, LONG).look(&floor))?;
        run.keep("wall in view", &looks[0]);
        run.keep("wall out of view", &looks[1]);
        let [then, now] = measures::means_at_same_places(&looks[0], &looks[1]);
        let tint = |m: [f64; 3]| measures::share(m[0], m[1]);
        let turned = measures::share((tint(now) - tint(then)).abs(), tint(then));
        Ok(vec![measures::at_same_places(&looks[0], &looks[1]).0, turned])
    },
};

pub static CROP: Test = Test {
    name: "crop",
    question: "Do the same pixels show the same light in a narrower picture?",
    limits: &[Limit::share("change of light at the same places, over 4×4 pixels", 0.05, SAME)],
    control: Corruption::Screen(1.0),
    size: LARGE,
    paths: 160,
    pictures: true,
    run: |run| {
        let hall = rooms::hall([0.9, 0.1, 0.1], &[rooms::sun(rooms::BACKWARDS, 3.0)], 0.05);
        // Twice as long a lens on as many pixels: networks take the size that they have learnt.
        let of = |tangent: f32| Camera { yfov: 2.0 * tangent.atan(), ..rooms::hall_camera() };
        let (wide, narrow) = (run.settled(&hall, &of(0.8), LONG)?, run.settled(&hall, &of(0.4), LONG)?);
        run.keep("wide", &wide);
        run.keep("narrow", &narrow);
        Ok(vec![measures::at_same_places(&wide, &narrow).0])
    },
};

pub static TWO_PLACES: Test = Test {
    name: "two-places",
    question: "Are the same surfaces equally bright from two places?",
    limits: &[Limit::share("change of light at the same places, over 4×4 pixels", 0.05, SAME)],
    control: Corruption::Screen(0.5),
    size: SMALL,
    paths: 96,
    pictures: false,
    run: |run| {
        let hall = rooms::hall(rooms::RED, &[rooms::sun(rooms::BACKWARDS, 3.0)], 0.05);
        let from = |eye: [f32; 3]| Camera::look_at(eye, [0.0, 0.4, -2.5], 1.0);
        let left = run.settled(&hall, &from([-4.0, 1.6, 2.0]), LONG)?;
        let right = run.settled(&hall, &from([3.0, 2.4, 3.0]), LONG)?;
        run.keep("from the left", &left);
        run.keep("from the right", &right);
        Ok(vec![measures::at_same_places(&left, &right).0])
    },
};
