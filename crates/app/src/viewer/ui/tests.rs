//! The overlay without any window.

use super::*;
use egui::{PointerButton, Vec2};
use std::sync::Arc;

/// Runs the overlay without any window, one frame for each list of events.
fn run(state: &mut State, frames: Vec<Vec<egui::Event>>) -> Rect {
    run_in(&egui::Context::default(), state, frames)
}

fn run_in(context: &egui::Context, state: &mut State, frames: Vec<Vec<egui::Event>>) -> Rect {
    let mut memory = Memory::default();
    let (times, measured) = (Times::default(), BTreeMap::new());
    let mut place = Rect::NOTHING;
    for events in frames {
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(800.0, 500.0)));
        let input = egui::RawInput { screen_rect, events, focused: true, ..Default::default() };
        let facts = Facts::bare(&times, &measured);
        let mut output = context.run_ui(input, |ui| place = show(ui, state, &mut memory, &facts));
        output.textures_delta.clear();
    }
    place
}

fn state() -> State {
    let mut state = State::new(Default::default());
    state.show("cornell".into(), Arc::new(bouncelight_scene::bundled::scene("cornell").expect("bundled")));
    state
}

fn press(key: egui::Key) -> egui::Event {
    egui::Event::Key { key, physical_key: None, pressed: true, repeat: false, modifiers: Default::default() }
}

fn button(pos: Pos2, pressed: bool) -> egui::Event {
    egui::Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers: Default::default() }
}

#[test]
fn the_panel_leaves_the_rest_to_the_picture() {
    let mut state = state();
    let place = run(&mut state, vec![vec![], vec![]]);
    assert_eq!((place.left(), place.right()), (0.0, 500.0));
    assert!(place.top() > 10.0 && place.bottom() < 490.0, "banner and status: {place}");
    state.apply(Action::Panel);
    assert_eq!(run(&mut state, vec![vec![], vec![]]), Rect::from_min_size(Pos2::ZERO, Vec2::new(800.0, 500.0)));
}

#[test]
fn hands_over_the_picture_move_the_camera_and_over_the_panel_they_do_not() {
    let drag = |from: Pos2| {
        let to = from + Vec2::new(30.0, 0.0);
        vec![
            vec![egui::Event::PointerMoved(from)],
            vec![button(from, true)],
            vec![egui::Event::PointerMoved(to)],
            vec![button(to, false)],
        ]
    };
    let mut state = state();
    let eye = state.navigator.eye;
    run(&mut state, drag(Pos2::new(700.0, 420.0)));
    assert_eq!(state.navigator.eye, eye, "the panel is no picture");
    run(&mut state, drag(Pos2::new(200.0, 200.0)));
    assert_ne!(state.navigator.eye, eye);
    // The line is nearer than the camera to a hand that grabs it.
    state.settings.split = true;
    let (eye, line) = (state.navigator.eye, state.settings.line);
    run(&mut state, drag(Pos2::new(250.0, 200.0)));
    assert_eq!(state.navigator.eye, eye);
    assert!((state.settings.line - line - 30.0 / 500.0).abs() < 1e-3, "{}", state.settings.line);
}

#[test]
fn keys_reach_the_state_but_not_while_somebody_types() {
    let mut state = state();
    run(&mut state, vec![vec![press(egui::Key::Num4)], vec![press(egui::Key::H)]]);
    assert_eq!((state.settings.view, state.help), (View::Depth, true));
    state.apply(Action::Escape);
    // Tab goes to the first control; from then on letters are its own.
    let mut tabbed = vec![vec![]];
    tabbed.extend((0..3).map(|_| vec![press(egui::Key::Tab)]));
    tabbed.push(vec![press(egui::Key::Num1)]);
    run(&mut state, tabbed);
    assert_eq!(state.settings.view, View::Depth);
}

#[test]
fn tab_reaches_every_control_and_space_presses_it() {
    let (mut state, context) = (state(), egui::Context::default());
    let mut seen = std::collections::HashSet::new();
    for _ in 0..60 {
        run_in(&context, &mut state, vec![vec![press(egui::Key::Tab)]]);
        let Some(id) = context.memory(|m| m.focused()) else { continue };
        // The first time a control has the focus it is pressed; what that changes is changed
        // back.
        if seen.insert(id) {
            let (split, help) = (state.settings.split, state.help);
            run_in(&context, &mut state, vec![vec![press(egui::Key::Space)], vec![]]);
            if state.settings.split != split {
                seen.insert(egui::Id::unique("split was pressed"));
                state.apply(Action::Split);
            }
            if state.help != help {
                seen.insert(egui::Id::unique("help was pressed"));
                state.apply(Action::Help);
            }
            run_in(&context, &mut state, vec![vec![press(egui::Key::Space)], vec![]]);
            (state.help, state.settings.split) = (help, split);
        }
    }
    let pressed = ["split was pressed", "help was pressed"].map(|name| seen.contains(&egui::Id::unique(name)));
    assert_eq!(pressed, [true, true]);
    // Ten rooms, the status line, and what the four open ones hold.
    assert!(seen.len() >= 24, "{} controls", seen.len());
}

/// Opens every section, and every light's entry, by clicks.
fn open_all(context: &egui::Context, state: &mut State, seen: &mut dyn FnMut(&str, &State, Rect)) {
    let (times, measured, mut memory) = (Times::default(), BTreeMap::new(), Memory::default());
    context.all_styles_mut(|style| style.animation_time = 0.0);
    let frame = |state: &mut State, memory: &mut Memory, events: Vec<egui::Event>| {
        let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(800.0, 4000.0)));
        let input = egui::RawInput { screen_rect, events, focused: true, ..Default::default() };
        let mut place = Rect::NOTHING;
        let facts = Facts::bare(&times, &measured);
        context.run_ui(input, |ui| place = show(ui, state, memory, &facts)).textures_delta.clear();
        place
    };
    frame(state, &mut memory, vec![]);
    let names = ["Camera", "Lights", "light 1", "light 2", "Objects", "Performance", "Memory", "Speed and accuracy"];
    for name in names.into_iter().chain(["Window"]) {
        let place = frame(state, &mut memory, vec![]);
        seen(name, state, place);
        let Some(&[x, y]) = memory.places.get(name) else { panic!("{name} is not to be seen") };
        let at = Pos2::new(x, y);
        for events in [vec![egui::Event::PointerMoved(at)], vec![button(at, true)], vec![button(at, false)], vec![]] {
            frame(state, &mut memory, events);
        }
    }
    // What is open is shown for a while.
    (0..5).for_each(|_| {
        let place = frame(state, &mut memory, vec![]);
        seen("all", state, place);
    });
}

#[test]
fn showing_a_number_does_not_change_it_nor_the_pictures_size() {
    use bouncelight::scene::{Light, LightKind};
    let mut scene = bouncelight_scene::bundled::scene("cornell").expect("bundled");
    // Straight down, out of the widgets' ranges, with more digits than they show.
    let (position, direction) = ([0.123_456_7, 2.0, 1e4], [0.0, -1.0, 0.0]);
    scene.lights = vec![
        Light::from(LightKind::Directional { direction, irradiance: 3e6, angle: 2.0 }),
        Light::from(LightKind::Spot {
            position,
            direction,
            intensity: 1.234_567,
            radius: 200.0,
            range: None,
            inner_angle: 0.1,
            outer_angle: 0.2,
        }),
        Light::from(LightKind::Point { position, intensity: 0.000_123, radius: 0.0, range: None }),
    ];
    scene.cameras[0].yfov = 0.005;
    let mut state = State::new(Default::default());
    state.show("odd".into(), Arc::new(scene));
    state.settings.samples = 100_000;
    state.settings.exposure = 13.131_313;
    state.selected = Some(0);
    let (before, version) = (state.settings.clone(), state.version);
    let (fov, camera) = (state.navigator.fov, state.navigator.file_camera);
    let mut size = None;
    open_all(&egui::Context::default(), &mut state, &mut |name, _, place| {
        assert_eq!(*size.get_or_insert(place.size()), place.size(), "{name}");
    });
    assert_eq!(state.version, version, "the scene is as it was");
    assert_eq!(state.settings, before);
    assert_eq!((state.navigator.fov, state.navigator.file_camera), (fov, camera));
}

#[test]
fn a_wheel_counts_where_it_was_turned() {
    let mut state = state();
    let wheel = || egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Line,
        delta: Vec2::new(0.0, 1.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Unknown,
        modifiers: Default::default(),
    };
    let (panel, picture) = (Pos2::new(700.0, 200.0), Pos2::new(200.0, 200.0));
    let (eye, moved) = (state.navigator.eye, |p| egui::Event::PointerMoved(p));
    // A slow frame hears of both at once.
    run(&mut state, vec![vec![], vec![moved(panel), wheel(), moved(picture)]]);
    assert_eq!(state.navigator.eye, eye);
    run(&mut state, vec![vec![], vec![moved(picture), wheel(), moved(panel)]]);
    assert_ne!(state.navigator.eye, eye);
}

/// Milliseconds that the layout and the triangles of a window take, the median of 200 each: without
/// the timing overlay, with it, and with passes and graph.
fn costs() -> [f64; 3] {
    let (mut times, start) = (Times::default(), std::time::Instant::now());
    let at = |frame: usize| start + std::time::Duration::from_micros(16_667) * frame as u32;
    let own = times.run.clone();
    // Each row has numbers of its own.
    let ms = |k: usize| 0.2 + 0.0137 * (k % 16) as f64 + 0.001 * (k * k % 97) as f64;
    let labels = [
        "gbuffer",
        "shadow",
        "lights",
        "direct",
        "gi.downsample",
        "gi.reproject",
        "gi.trace",
        "gi.accumulate",
        "gi.pack",
        "net.a",
        "net.b",
        "net.c",
        "gi.reconstruct",
        "composite",
        "tonemap",
        "viewer.show",
    ];
    for i in 0..crate::viewer::frames::HISTORY {
        let passes: Vec<_> = labels.iter().zip(0..).map(|(l, k)| (l.to_string(), ms(7 * i + k))).collect();
        let now = at(i);
        times.frame(now, &passes, ms(3), &own);
        times.now.cpu.add(now, ms(3));
        times.now.interval.add(now, ms(5));
        times.overlay.add(now, ms(1));
    }
    let measured = BTreeMap::new();
    let mut windows = [(false, false), (true, false), (true, true)].map(|(shown, expanded)| {
        let mut state = state();
        (state.settings.timing.shown, state.settings.timing.expanded) = (shown, expanded);
        state.settings.greeted = true;
        state.apply(Action::Panel);
        (egui::Context::default(), state, Memory::default(), Vec::new())
    });
    for i in 0..210usize {
        for (context, state, memory, took) in &mut windows {
            let screen_rect = Some(Rect::from_min_size(Pos2::ZERO, Vec2::new(1280.0, 800.0)));
            let input = egui::RawInput { screen_rect, focused: true, ..Default::default() };
            let facts = Facts { timestamps: true, software: false, live: true, ..Facts::bare(&times, &measured) };
            let began = std::time::Instant::now();
            let mut output = context.run_ui(input, |ui| _ = show(ui, state, memory, &facts));
            let jobs = context.tessellate(std::mem::take(&mut output.shapes), output.pixels_per_point);
            let ms = 1e3 * began.elapsed().as_secs_f64();
            output.textures_delta.clear();
            assert!(!jobs.is_empty());
            // The first build fonts.
            if i >= 10 {
                took.push(ms);
            }
        }
        let passes: Vec<_> = labels.iter().zip(0..).map(|(l, k)| (l.to_string(), ms(7 * i + k))).collect();
        times.frame(at(crate::viewer::frames::HISTORY + i), &passes, 0.5, &own);
    }
    windows.map(|(_, _, memory, mut took)| {
        drop(memory);
        took.sort_by(f64::total_cmp);
        took[took.len() / 2]
    })
}

#[test]
fn the_timing_overlay_costs_next_to_nothing() {
    // Tests are built without optimisation of the window's own code, which makes it four times as slow. It is laid out
    // four times a second at most: what passes and graph take is 0.03 ms a frame at 60 Hz.
    let most = if cfg!(debug_assertions) { [0.6, 2.0] } else { [0.3, 0.5] };
    // A busy machine is no slow overlay.
    let best = (0..6).map(|_| costs()).map(|[none, sums, all]| [none, sums - none, all - none]);
    let best = best.reduce(|a, b| [0, 1, 2].map(|i| a[i].min(b[i]))).expect("some");
    println!(
        "a layout without it {:.3} ms; its sums {:.3} ms more, all of it {:.3} ms more",
        best[0], best[1], best[2]
    );
    assert!(best[1] <= most[0] && best[2] <= most[1], "{best:?} ms");
}
