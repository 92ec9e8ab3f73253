//! Scripted sessions: a list of steps that drives the window with mouse and keys, asks how things
//! stand, and takes pictures.
//!
//! ```json
//! [ { "wait": "idle" }, { "key": "2" }, { "expect": { "/view": "albedo" } },
//!   { "drag": [[200, 150], [260, 150]] }, { "screenshot": "albedo.png" }, { "resize": [500, 300] } ]
//! ```
//!
//! Places are in points from the window's top left; a `click` can also name something of the panel
//! that is to be seen (`/places`). Steps: `wait` (`loaded`, `idle`, `samples:N`, or a number of
//! frames), `key` (`"F12"`, `"Shift+F12"`), `hold` and `release` of a key, `text`, `move`, `press`,
//! `lift`, `click`, `drag` with optional `button` and `keys`, `wheel`, `drop` of a file, `copy` of
//! one over another, `resize` (to nothing, too), `zoom` of the text, `scale` (pixels a point),
//! `minimise`, `lose` (`surface`, `device`), `variant` of materials by number, `expect` (JSON
//! pointer into the state: a value, or `{"min","max","contains","not"}`), `until` (the same, waited
//! for), `save` of such values, `expect_saved` and `expect_not_saved`, `print` of values on
//! standard output, `screenshot`, `quit`.

use egui::{Event, Key, Modifiers, PointerButton, Pos2};
use serde::Deserialize;
use serde_json::Value;
use std::collections::{BTreeMap, VecDeque};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Longest that a step may wait.
const PATIENCE: Duration = Duration::from_secs(180);
/// Time between two steps.
pub const STEP: Duration = Duration::from_millis(8);

/// One step; exactly one of the fields but `button` and `keys` is given.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Step {
    wait: Option<Value>,
    key: Option<String>,
    hold: Option<String>,
    release: Option<String>,
    text: Option<String>,
    #[serde(rename = "move")]
    to: Option<[f32; 2]>,
    press: Option<[f32; 2]>,
    lift: Option<[f32; 2]>,
    click: Option<Place>,
    until: Option<BTreeMap<String, Value>>,
    copy: Option<[PathBuf; 2]>,
    scale: Option<f32>,
    drag: Option<Vec<[f32; 2]>>,
    button: Option<String>,
    keys: Option<String>,
    wheel: Option<f32>,
    drop: Option<String>,
    resize: Option<[u32; 2]>,
    zoom: Option<f32>,
    minimise: Option<bool>,
    lose: Option<String>,
    expect: Option<BTreeMap<String, Value>>,
    save: Option<BTreeMap<String, String>>,
    expect_saved: Option<BTreeMap<String, String>>,
    expect_not_saved: Option<BTreeMap<String, String>>,
    variant: Option<usize>,
    print: Option<Vec<String>>,
    screenshot: Option<PathBuf>,
    quit: Option<bool>,
}

/// A place of the window: points, or the name of something in the panel.
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
enum Place {
    At([f32; 2]),
    Named(String),
}

/// What the window has to do for a step that is no event.
#[derive(Debug, Clone, PartialEq)]
pub enum Order {
    Resize([u32; 2]),
    Zoom(f32),
    /// Pixels a point, as after a change of screens.
    Scale(f32),
    Copy([PathBuf; 2]),
    Variant(usize),
    Minimise(bool),
    LoseSurface,
    LoseDevice,
    Drop(String),
    Screenshot(PathBuf),
    /// The end, well.
    Quit,
    /// The end, badly.
    Fail(String),
}

/// A script at work.
#[derive(Debug)]
pub struct Script {
    steps: VecDeque<(usize, Step)>,
    /// Events of a step that takes several frames.
    pending: VecDeque<Event>,
    since: Instant,
    frames: u64,
    pointer: Pos2,
    saved: BTreeMap<String, Value>,
    /// When the next step may be made, and frames that the window had drawn at the last.
    next: Instant,
    drawn: u64,
}

/// What a frame begins with.
#[derive(Debug, Default)]
pub struct Turn {
    pub events: Vec<Event>,
    pub orders: Vec<Order>,
}

impl Script {
    /// Reads a script.
    ///
    /// # Errors
    /// The text names the file and the place.
    pub fn load(path: &Path) -> Result<Self, String> {
        let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
        Self::parse(&text).map_err(|e| format!("{}: {e}", path.display()))
    }

    fn parse(text: &str) -> Result<Self, String> {
        let steps: Vec<Step> = serde_json::from_str(text).map_err(|e| e.to_string())?;
        for (i, step) in steps.iter().enumerate() {
            for name in [&step.key, &step.hold, &step.release].into_iter().flatten() {
                key(name).ok_or_else(|| format!("step {i}: there is no key `{name}`"))?;
            }
        }
        let steps = steps.into_iter().enumerate().collect();
        let (pending, pointer) = (VecDeque::new(), Pos2::ZERO);
        let (now, saved) = (Instant::now(), BTreeMap::new());
        Ok(Self { steps, pending, since: now, frames: 0, pointer, saved, next: now, drawn: 0 })
    }

    /// Whether the next step may be made, `drawn` frames after the beginning: one frame after the
    /// other, also where held keys let the window draw without end. `quiet`: nothing waits to be
    /// drawn.
    pub fn is_due(&mut self, now: Instant, drawn: u64, quiet: bool) -> bool {
        let due = now >= self.next && (quiet || drawn > self.drawn);
        if due {
            (self.next, self.drawn) = (now + STEP, drawn);
        }
        due
    }

    /// What the next frame begins with. `state` is how things stand after the last one.
    pub fn turn(&mut self, state: &Value) -> Turn {
        let mut turn = Turn::default();
        self.frames += 1;
        if let Some(event) = self.pending.pop_front() {
            if let Event::PointerMoved(p) = event {
                self.pointer = p;
            }
            turn.events.push(event);
            return turn;
        }
        while let Some((i, mut step)) = self.steps.front().cloned() {
            if let Some(wait) = &step.wait {
                if !self.is_over(wait, state) {
                    if self.since.elapsed() > PATIENCE {
                        turn.orders.push(Order::Fail(format!("step {i}: waited in vain for {wait}; {state:#}")));
                    }
                    return turn;
                }
                self.advance();
                continue;
            }
            if let Some(all) = &step.until {
                if let Some(text) = all.iter().find_map(|(place, wanted)| differs(state, place, wanted)) {
                    if self.since.elapsed() > PATIENCE {
                        turn.orders.push(Order::Fail(format!("step {i}: waited in vain; {text}; {state:#}")));
                    }
                    return turn;
                }
                self.advance();
                continue;
            }
            self.advance();
            if let Some(all) = &step.expect {
                if let Some(text) = all.iter().find_map(|(place, wanted)| differs(state, place, wanted)) {
                    turn.orders.push(Order::Fail(format!("step {i}: {text}")));
                    return turn;
                }
                continue;
            }
            if let Some(all) = &step.print {
                let found = |p: &String| (p.clone(), state.pointer(p).cloned().unwrap_or(Value::Null));
                println!("{}", Value::Object(all.iter().map(found).collect()));
                continue;
            }
            if let Some(all) = &step.save {
                for (name, place) in all {
                    self.saved.insert(name.clone(), state.pointer(place).cloned().unwrap_or(Value::Null));
                }
                continue;
            }
            let checks = [(&step.expect_saved, true), (&step.expect_not_saved, false)];
            if let Some((all, same)) = checks.iter().find_map(|(all, same)| Some((all.as_ref()?, *same))) {
                for (name, place) in all {
                    let found = state.pointer(place).unwrap_or(&Value::Null);
                    let saved = self.saved.get(name).unwrap_or(&Value::Null);
                    if (found == saved) != same {
                        turn.orders.push(Order::Fail(format!("step {i}: {place} was {saved} and is {found}")));
                        return turn;
                    }
                }
                continue;
            }
            tracing::info!("step {i}");
            if let Some(Place::Named(name)) = &step.click {
                let place = state.get("places").and_then(|p| p.get(name));
                let Some(place) = place.and_then(|p| serde_json::from_value(p.clone()).ok()) else {
                    turn.orders
                        .push(Order::Fail(format!("step {i}: `{name}` is not to be seen; {:#}", state["places"])));
                    return turn;
                };
                step.click = Some(Place::At(place));
            }
            self.act(&step, &mut turn);
            return turn;
        }
        turn.orders.push(Order::Quit);
        turn
    }

    fn advance(&mut self) {
        self.steps.pop_front();
        self.since = Instant::now();
        self.frames = 0;
    }

    fn is_over(&self, wait: &Value, state: &Value) -> bool {
        if let Some(frames) = wait.as_u64() {
            return self.frames > frames;
        }
        let is = |place: &str| state.pointer(place).and_then(Value::as_bool).unwrap_or(false);
        match wait.as_str().unwrap_or("") {
            "loaded" => is("/loaded"),
            // Two frames, so that what was just asked for has begun.
            "idle" => self.frames > 2 && is("/idle"),
            text => {
                let samples = text.strip_prefix("samples:").and_then(|n| n.parse::<u64>().ok());
                let found = state.pointer("/reference/samples").and_then(Value::as_u64).unwrap_or(0);
                samples.is_some_and(|n| found >= n)
            }
        }
    }

    fn act(&mut self, step: &Step, turn: &mut Turn) {
        let modifiers = step.keys.as_deref().map(modifiers).unwrap_or_default();
        let button = match step.button.as_deref() {
            Some("middle") => PointerButton::Middle,
            Some("right") => PointerButton::Secondary,
            _ => PointerButton::Primary,
        };
        let at = |[x, y]: [f32; 2]| Pos2::new(x, y);
        let pointer = |pos: Pos2, pressed| Event::PointerButton { pos, button, pressed, modifiers };
        if let Some(name) = &step.key {
            turn.events.push(key_event(name, true));
            self.pending.push_back(key_event(name, false));
        }
        turn.events.extend(step.hold.as_deref().map(|name| key_event(name, true)));
        turn.events.extend(step.release.as_deref().map(|name| key_event(name, false)));
        turn.events.extend(step.text.clone().map(Event::Text));
        if step.keys.is_some() {
            turn.events.push(Event::ModifiersChanged(modifiers));
        }
        if let Some(p) = step.to {
            self.pointer = at(p);
            turn.events.push(Event::PointerMoved(self.pointer));
        }
        if let Some(p) = step.press.or(step.lift) {
            self.pointer = at(p);
            turn.events.extend([Event::PointerMoved(self.pointer), pointer(self.pointer, step.press.is_some())]);
        }
        if let Some(Place::At(p)) = step.click {
            self.pointer = at(p);
            turn.events.push(Event::PointerMoved(self.pointer));
            // egui learns what lies under the pointer a frame later.
            self.pending.extend([pointer(self.pointer, true), pointer(self.pointer, false)]);
        }
        if let Some([first, rest @ ..]) = step.drag.as_deref() {
            turn.events.push(Event::PointerMoved(at(*first)));
            self.pending.push_back(pointer(at(*first), true));
            self.pending.extend(rest.iter().map(|p| Event::PointerMoved(at(*p))));
            self.pending.push_back(pointer(at(*rest.last().unwrap_or(first)), false));
        }
        if step.keys.is_some() && step.drag.is_some() {
            self.pending.push_back(Event::ModifiersChanged(Modifiers::NONE));
        }
        if let Some(notches) = step.wheel {
            turn.events.push(Event::MouseWheel {
                unit: egui::MouseWheelUnit::Line,
                delta: egui::vec2(0.0, notches),
                phase: egui::TouchPhase::Move,
                source: egui::MouseWheelSource::Unknown,
                modifiers,
            });
        }
        let orders = &mut turn.orders;
        orders.extend(step.drop.clone().map(Order::Drop));
        orders.extend(step.resize.map(Order::Resize));
        orders.extend(step.zoom.map(Order::Zoom));
        orders.extend(step.scale.map(Order::Scale));
        orders.extend(step.variant.map(Order::Variant));
        orders.extend(step.copy.clone().map(Order::Copy));
        orders.extend(step.minimise.map(Order::Minimise));
        orders.extend(step.lose.as_deref().map(
            |what| {
                if what == "device" { Order::LoseDevice } else { Order::LoseSurface }
            },
        ));
        orders.extend(step.screenshot.clone().map(Order::Screenshot));
        orders.extend(step.quit.filter(|q| *q).map(|_| Order::Quit));
    }
}

/// Modifiers named in `text`, such as `Ctrl+Shift`.
fn modifiers(text: &str) -> Modifiers {
    let has = |word: &str| text.split('+').any(|w| w.eq_ignore_ascii_case(word));
    Modifiers { shift: has("Shift"), ctrl: has("Ctrl"), command: has("Ctrl"), alt: has("Alt"), mac_cmd: false }
}

/// The key that `name` ends with.
fn key(name: &str) -> Option<Key> {
    Key::from_name(name.rsplit('+').next().unwrap_or(name))
}

fn key_event(name: &str, pressed: bool) -> Event {
    let key = key(name).unwrap_or(Key::F35);
    Event::Key { key, physical_key: None, pressed, repeat: false, modifiers: modifiers(name) }
}

/// How a value differs from what a script wants.
fn differs(state: &Value, place: &str, wanted: &Value) -> Option<String> {
    let found = state.pointer(place).unwrap_or(&Value::Null);
    (!agrees(found, wanted)).then(|| format!("{place} is {found}, not {wanted}"))
}

/// Whether a value is what a script wants.
fn agrees(found: &Value, wanted: &Value) -> bool {
    let Some(rules) = wanted.as_object() else {
        return match (found.as_f64(), wanted.as_f64()) {
            (Some(a), Some(b)) => (a - b).abs() <= 1e-4 * b.abs().max(1.0),
            _ => found == wanted,
        };
    };
    rules.iter().all(|(rule, value)| match rule.as_str() {
        "min" => found.as_f64().zip(value.as_f64()).is_some_and(|(a, b)| a >= b),
        "max" => found.as_f64().zip(value.as_f64()).is_some_and(|(a, b)| a <= b),
        "contains" => match (found, value.as_str()) {
            (Value::String(text), Some(part)) => text.contains(part),
            (Value::Array(all), Some(part)) => all.iter().any(|v| v.as_str().is_some_and(|t| t.contains(part))),
            _ => false,
        },
        "not" => !agrees(found, value),
        _ => false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn run(steps: Value, state: &Value, turns: usize) -> Vec<Turn> {
        let mut script = Script::parse(&steps.to_string()).unwrap();
        (0..turns).map(|_| script.turn(state)).collect()
    }

    #[test]
    fn steps_become_events_one_after_the_other() {
        let steps = json!([{ "wait": "loaded" }, { "key": "Shift+F12" }, { "drag": [[1, 2], [3, 4]], "keys": "Ctrl" }]);
        let waiting = run(steps.clone(), &json!({ "loaded": false }), 3);
        assert!(waiting.iter().all(|t| t.events.is_empty() && t.orders.is_empty()));
        let turns = run(steps, &json!({ "loaded": true }), 8);
        let Event::Key { key: Key::F12, pressed: true, modifiers, .. } = turns[0].events[0] else {
            panic!("{turns:?}")
        };
        assert!(modifiers.shift && !modifiers.ctrl);
        assert!(matches!(turns[1].events[0], Event::Key { pressed: false, .. }));
        assert!(matches!(turns[3].events[0], Event::PointerButton { pressed: true, modifiers, .. } if modifiers.ctrl));
        assert_eq!(turns[4].events, [Event::PointerMoved(Pos2::new(3.0, 4.0))]);
        assert_eq!(turns[7].orders, [Order::Quit]);
    }

    #[test]
    fn expectations_that_fail_end_the_script() {
        let state = json!({ "view": "albedo", "ev": 0.5, "messages": ["no such file: x.glb"] });
        let good = json!([{ "expect": { "/view": "albedo", "/ev": { "min": 0.4, "max": 0.6 },
            "/messages": { "contains": "x.glb" } } }]);
        assert_eq!(run(good, &state, 1)[0].orders, [Order::Quit]);
        for bad in [
            json!({ "/view": "normal" }),
            json!({ "/ev": { "min": 0.6 } }),
            json!({ "/missing": 1 }),
            json!({ "/view": { "not": "albedo" } }),
        ] {
            let turns = run(json!([{ "expect": bad }]), &state, 1);
            assert!(matches!(turns[0].orders[0], Order::Fail(_)), "{bad}");
        }
        assert!(Script::parse("[{\"key\":\"Hyper\"}]").is_err());
        assert!(Script::parse("[{\"dance\":1}]").is_err());
    }

    #[test]
    fn what_was_saved_can_be_expected_to_have_changed() {
        let steps = json!([{ "save": { "eye": "/eye" } }, { "wait": 1 }, { "expect_not_saved": { "eye": "/eye" } }]);
        let mut script = Script::parse(&steps.to_string()).unwrap();
        script.turn(&json!({ "eye": 1 }));
        script.turn(&json!({ "eye": 2 }));
        assert_eq!(script.turn(&json!({ "eye": 2 })).orders, [Order::Quit]);
        let same = run(steps, &json!({ "eye": 1 }), 4);
        assert!(same.iter().flat_map(|t| &t.orders).any(|o| matches!(o, Order::Fail(_))));
    }
}
