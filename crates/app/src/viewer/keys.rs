//! Keys and what they do: one table, which the help page shows, too.

use super::choice::View;
use super::film::Film;
use super::state::{Action, State};
use egui::{Key, Modifiers};

/// Modifier keys of a binding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum With {
    Nothing,
    Shift,
    Ctrl,
}

/// A key and what it does.
pub struct Binding {
    pub key: Key,
    pub with: With,
    pub doc: &'static str,
    pub action: fn(&State) -> Action,
}

const fn bind(key: Key, with: With, doc: &'static str, action: fn(&State) -> Action) -> Binding {
    Binding { key, with, doc, action }
}

/// All keys but those that fly (W A S D Q E, held) and the arrows.
pub const BINDINGS: &[Binding] = &[
    bind(Key::Num1, With::Nothing, "picture", |_| Action::View(View::Picture)),
    bind(Key::Num2, With::Nothing, "albedo", |_| Action::View(View::Albedo)),
    bind(Key::Num3, With::Nothing, "normals", |_| Action::View(View::Normal)),
    bind(Key::Num4, With::Nothing, "depth", |_| Action::View(View::Depth)),
    bind(Key::Num5, With::Nothing, "direct light", |_| Action::View(View::Direct)),
    bind(Key::Num6, With::Nothing, "indirect light", |_| Action::View(View::Indirect)),
    bind(Key::Num7, With::Nothing, "reflections", |_| Action::View(View::Reflections)),
    bind(Key::Num8, With::Nothing, "roughness", |_| Action::View(View::Roughness)),
    bind(Key::Num9, With::Nothing, "error against the other side", |_| Action::View(View::Error)),
    bind(Key::Num0, With::Nothing, "network inputs, next channel", |_| Action::Feature(1)),
    bind(Key::Num0, With::Shift, "network inputs, previous channel", |_| Action::Feature(-1)),
    bind(Key::L, With::Nothing, "network layers, next", |_| Action::Layer(1)),
    bind(Key::L, With::Shift, "network layers, previous", |_| Action::Layer(-1)),
    bind(Key::J, With::Nothing, "wireframe", |_| Action::View(View::Wireframe)),
    bind(Key::M, With::Nothing, "next method", |_| Action::NextMethod(1)),
    bind(Key::M, With::Shift, "previous method", |_| Action::NextMethod(-1)),
    bind(Key::X, With::Nothing, "split: two methods side by side", |_| Action::Split),
    bind(Key::OpenBracket, With::Nothing, "line to the left", |_| Action::MoveSplit(-0.02)),
    bind(Key::CloseBracket, With::Nothing, "line to the right", |_| Action::MoveSplit(0.02)),
    bind(Key::Comma, With::Nothing, "darker by a quarter stop", |s| Action::Exposure(s.stops() - 0.25)),
    bind(Key::Period, With::Nothing, "brighter by a quarter stop", |s| Action::Exposure(s.stops() + 0.25)),
    bind(Key::Period, With::Shift, "automatic exposure", |_| Action::AutoExposure),
    bind(Key::T, With::Nothing, "next tonemap", |_| Action::Tonemap(None)),
    bind(Key::F, With::Nothing, "fit the scene into view", |_| Action::Fit),
    bind(Key::V, With::Nothing, "next standard view", |_| Action::NextPreset),
    bind(Key::C, With::Nothing, "next camera of the file", |_| Action::NextCamera),
    bind(Key::O, With::Shift, "background", |_| Action::NextBackdrop),
    bind(Key::Z, With::Nothing, "half resolution while moving", |_| Action::Coarse),
    bind(Key::O, With::Nothing, "near-orthographic lens", |_| Action::LongLens),
    bind(Key::O, With::Ctrl, "open a file", |_| Action::Browse(false)),
    bind(Key::F11, With::Nothing, "full screen", |_| Action::FullScreen),
    bind(Key::G, With::Nothing, "orbit or look around", |_| Action::Fly),
    bind(Key::I, With::Nothing, "play the file's animation", |_| Action::Animate),
    bind(Key::R, With::Nothing, "record the camera's path", |_| Action::Record),
    bind(Key::Y, With::Nothing, "play the camera's path", |_| Action::Play),
    bind(Key::N, With::Nothing, "accumulate twice as many", |s| Action::Samples(2 * s.settings.samples)),
    bind(Key::N, With::Shift, "accumulate half as many", |s| Action::Samples(s.settings.samples / 2)),
    bind(Key::B, With::Shift, "flicker meter", |_| Action::Flicker),
    bind(Key::T, With::Shift, "light or dark", |_| Action::Theme),
    bind(Key::B, With::Nothing, "continuous rendering", |_| Action::Measure),
    bind(Key::F3, With::Nothing, "timing overlay", |_| Action::Timing),
    bind(Key::F3, With::Shift, "passes and graph", |_| Action::ExpandTiming),
    bind(Key::P, With::Nothing, "panel", |_| Action::Panel),
    bind(Key::K, With::Nothing, "copy as command", |_| Action::CopyCommand),
    bind(Key::End, With::Nothing, "selected object to the floor", |_| Action::Floor),
    bind(Key::Z, With::Ctrl, "undo", |_| Action::Undo),
    bind(Key::Y, With::Ctrl, "redo (or Ctrl + Shift + Z)", |_| Action::Redo),
    bind(Key::U, With::Nothing, "reset lights, objects and rays", |_| Action::Reset),
    bind(Key::F5, With::Nothing, "load the scene again", |_| Action::Reload),
    bind(Key::F12, With::Nothing, "capture PNG", |_| Action::Capture { exr: false }),
    bind(Key::F12, With::Shift, "capture EXR with layers", |_| Action::Capture { exr: true }),
    bind(Key::H, With::Nothing, "this help", |_| Action::Help),
    bind(Key::F1, With::Nothing, "this help", |_| Action::Help),
    bind(Key::Escape, With::Nothing, "close, deselect, cancel", |_| Action::Escape),
    bind(Key::Q, With::Ctrl, "quit", |_| Action::Quit),
];

/// What a key is about, for the help page.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Topic {
    Navigation,
    Show,
    Method,
    Picture,
    Scene,
    Measure,
    Window,
}

impl Topic {
    /// All of them, as the page has them.
    pub const ALL: [Topic; 7] =
        [Topic::Navigation, Topic::Show, Topic::Method, Topic::Picture, Topic::Scene, Topic::Measure, Topic::Window];

    /// What the page calls it.
    pub fn title(self) -> &'static str {
        ["Navigation", "Show", "Method", "Picture", "Scene", "Measure", "Window"][self as usize]
    }
}

/// What a binding is about.
pub fn topic(binding: &Binding, state: &State) -> Topic {
    use Action as A;
    match (binding.action)(state) {
        A::Fit | A::NextPreset | A::NextCamera | A::Fly | A::LongLens | A::Record | A::Play => Topic::Navigation,
        A::View(_) | A::Feature(_) | A::Layer(_) => Topic::Show,
        A::NextMethod(_) | A::Split | A::MoveSplit(_) => Topic::Method,
        A::Exposure(_) | A::AutoExposure | A::Tonemap(_) | A::NextBackdrop | A::Coarse | A::Samples(_) => {
            Topic::Picture
        }
        A::Floor | A::Browse(_) | A::Animate | A::Reset | A::Undo | A::Redo | A::Reload => Topic::Scene,
        A::Timing | A::ExpandTiming | A::Measure | A::Flicker => Topic::Measure,
        _ => Topic::Window,
    }
}

/// What pressing `key` does.
pub fn action(key: Key, modifiers: Modifiers, state: &State) -> Option<Action> {
    if key == Key::Z && (modifiers.command || modifiers.ctrl) && modifiers.shift {
        return Some(Action::Redo);
    }
    let with = match (modifiers.command || modifiers.ctrl, modifiers.shift) {
        (true, _) => With::Ctrl,
        (_, true) => With::Shift,
        _ => With::Nothing,
    };
    BINDINGS.iter().find(|b| b.key == key && b.with == with).map(|b| (b.action)(state))
}

/// What the arrows do: move the selected object over the floor, else orbit. Points of the drag they
/// stand for, or metres.
pub fn arrow(key: Key) -> Option<[f32; 2]> {
    match key {
        Key::ArrowLeft => Some([-1.0, 0.0]),
        Key::ArrowRight => Some([1.0, 0.0]),
        Key::ArrowUp => Some([0.0, -1.0]),
        Key::ArrowDown => Some([0.0, 1.0]),
        _ => None,
    }
}

/// The setting that a binding changes, as it is now.
pub fn current(binding: &Binding, state: &State) -> String {
    let s = &state.settings;
    let on = |b: bool| if b { "on" } else { "off" }.to_string();
    match (binding.action)(state) {
        Action::View(view) if view == s.view => "shown".into(),
        Action::Feature(_) if s.view == View::Feature => format!("channel {}", s.feature),
        Action::Layer(_) if s.view == View::Layer => format!("layer {}", s.layer + 1),
        Action::NextMethod(_) => s.left.title().into(),
        Action::Split => on(s.split),
        Action::MoveSplit(_) => format!("{:.0} %", 100.0 * s.line),
        Action::Exposure(_) => format!("{:+.2} EV", state.stops()),
        Action::AutoExposure => on(state.auto_exposure),
        Action::Tonemap(_) => s.tonemap.name().into(),
        Action::NextPreset => state.preset.map_or("", |p| p.title()).into(),
        Action::NextCamera => state.navigator.file_camera.map_or("free".into(), |n| format!("camera {n}")),
        Action::Fly => if state.navigator.fly { "look around" } else { "orbit" }.into(),
        Action::NextBackdrop => state.settings.backdrop.name().into(),
        Action::Coarse => on(state.settings.coarse),
        Action::LongLens => on(state.navigator.is_long()),
        Action::FullScreen => on(state.full_screen),
        Action::Measure => on(state.measure),
        Action::Panel => on(s.panel),
        Action::Timing => on(s.timing.shown),
        Action::ExpandTiming => on(s.timing.shown && s.timing.expanded),
        Action::Flicker => on(s.flicker),
        Action::Theme => if s.dark { "dark" } else { "light" }.into(),
        Action::Samples(_) => format!("{} frames", s.samples),
        Action::Record => on(matches!(state.film, Film::Records(_))),
        Action::Animate => on(state.animated.is_some()),
        Action::Play => on(matches!(state.film, Film::Plays { .. })),
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_means_two_things() {
        for (i, a) in BINDINGS.iter().enumerate() {
            assert!(BINDINGS[..i].iter().all(|b| b.key != a.key || b.with != a.with), "{:?}", a.key);
            let flies = [Key::W, Key::A, Key::S, Key::D, Key::Q, Key::E].contains(&a.key);
            assert!(!flies || a.with == With::Ctrl, "{:?} flies", a.key);
        }
    }

    #[test]
    fn keys_act_and_the_help_tells_how_it_stands() {
        let mut state = State::new(Default::default());
        let press = |state: &mut State, key, modifiers| {
            let action = action(key, modifiers, state).expect("bound");
            state.apply(action);
        };
        press(&mut state, Key::Num2, Modifiers::NONE);
        assert_eq!(state.settings.view, View::Albedo);
        press(&mut state, Key::Period, Modifiers::NONE);
        press(&mut state, Key::Period, Modifiers::NONE);
        press(&mut state, Key::M, Modifiers::SHIFT);
        let row = |key| current(BINDINGS.iter().find(|b| b.key == key).unwrap(), &state);
        assert_eq!(
            (row(Key::Period).as_str(), row(Key::M).as_str(), row(Key::Num2).as_str()),
            ("+0.50 EV", "SSGI", "shown")
        );
        assert_eq!(action(Key::W, Modifiers::NONE, &state), None);
        assert_eq!(action(Key::Q, Modifiers::NONE, &state), None);
    }
}
