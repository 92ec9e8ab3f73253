//! "Copy as command": the `bouncelight render` or `trace` line whose picture is the one on show, bit
//! for bit.

use super::choice::Source;
use super::state::State;
use bouncelight::gpu_scene::TextureMemory;
use bouncelight::net::plan::Precision;
use bouncelight::render::Backdrop;
use bouncelight_lab::network::shipped;
use bouncelight_scene::units::Up;
use std::path::Path;

/// The line for the left side of the view. `output` is the file it writes, `view.png` if nobody
/// says.
pub fn line(state: &State, output: Option<&str>) -> String {
    let words = words(state, output.unwrap_or("view.png"));
    let quoted: Vec<String> = words.iter().map(|w| quote(w)).collect();
    format!("bouncelight {}", quoted.join(" "))
}

/// The same as separate words, without the program's name.
pub fn words(state: &State, output: &str) -> Vec<String> {
    let Some(shown) = &state.shown else { return vec!["doctor".into()] };
    let s = &state.settings;
    let command = if s.left == Source::Reference { "trace" } else { "render" };
    let mut words: Vec<String> = vec![command.into(), shown.spec.clone(), "-o".into(), output.into()];
    let mut flag = |name: &str, value: String| {
        // As one word, since values may begin with a minus.
        words.push(format!("--{name}={value}"));
    };
    flag("size", format!("{}x{}", state.size[0], state.size[1]));
    let n = &state.navigator;
    match n.file_camera {
        Some(camera) => flag("camera", camera.to_string()),
        None => {
            flag("eye", format!("{},{},{}", n.eye.x, n.eye.y, n.eye.z));
            flag("look-at", format!("{},{},{}", n.target.x, n.target.y, n.target.z));
            flag("fov", n.fov.to_string());
        }
    }
    match s.left {
        Source::Reference => flag("spp", s.spp.to_string()),
        method => {
            flag("method", method.name().into());
            flag("samples", s.samples.to_string());
        }
    }
    // A single frame is one of a history that has not settled.
    if s.samples == 1 && s.left.has_history() {
        flag("accumulate", "1".into());
    }
    // Weights of another kind of network are not what draws (`shipped::fitting`).
    let others = |path: &Path| shipped::find(path).is_ok_and(|weights| shipped::method_of(&weights) != s.left);
    if let (true, Some(weights)) = (s.left.needs_weights(), s.weights.as_ref().filter(|path| !others(path))) {
        flag("weights", weights.display().to_string());
    }
    if s.left.gathers() {
        // As `jobs::method` makes it: a network has its own.
        let fitted = state.gather.clone().filter(|_| s.left == Source::Gather);
        let rays = (s.rays != 1.0).then(|| format!("rays={}", s.rays));
        let words: Vec<String> = fitted.into_iter().chain(rays).collect();
        if !words.is_empty() {
            flag("gather", words.join(","));
        }
    }
    if let (true, Some(numbers)) = (s.left.has_ambient_term(), &state.ambient_term) {
        flag("ambient-term", numbers.clone());
    }
    if let (true, Some(precision)) = (s.left.needs_weights(), state.precision) {
        flag("precision", if precision == Precision::F16 { "f16" } else { "f32" }.into());
    }
    if state.units.scale != 1.0 {
        flag("scale", state.units.scale.to_string());
    }
    if state.units.up == Up::Z {
        flag("up", "z".into());
    }
    match state.textures {
        TextureMemory::Auto => {}
        TextureMemory::Full => flag("textures", "full".into()),
        TextureMemory::Compressed => flag("textures", "compressed".into()),
    }
    if let Some(environment) = &shown.environment {
        flag("environment", environment.clone());
        if let Some((_, turn)) = shown.sky.as_ref().filter(|(_, turn)| *turn != 0.0) {
            flag("environment-turn", turn.to_string());
        }
    }
    if s.backdrop != Backdrop::Shown && s.left != Source::Reference {
        flag("backdrop", s.backdrop.name().into());
    }
    if let Some(name) = shown.variant.and_then(|n| shown.scene.variants.get(n)) {
        flag("variant", name.clone());
    }
    if let Some((animation, time)) = shown.pose {
        flag("animation", animation.to_string());
        flag("pose-time", time.to_string());
    }
    for edit in state.light_edits() {
        flag("light", edit.to_string());
    }
    for (object, [x, y, z]) in &shown.moved {
        flag("object", format!("{object} {x},{y},{z}"));
    }
    // A file without light is measured unless somebody says a number.
    if state.stops() != 0.0 || shown.scene.lightless {
        flag("exposure", state.stops().to_string());
    }
    flag("tonemap", s.tonemap.name().into());
    words
}

/// For a POSIX shell.
fn quote(word: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_=+,.:/@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) { word.into() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewer::state::Action;
    use bouncelight_scene::edit::LightEdit;
    use std::sync::Arc;

    #[test]
    fn the_line_names_weights_of_the_kind_that_draws() {
        let mut state = State::new(Default::default());
        state.show("cornell".into(), Arc::new(bouncelight_lab::scenes::paper_room::scene(3)));
        state.settings.weights = Some("filter".into());
        for (method, named) in [(Source::Neural, true), (Source::Generator, false), (Source::Gather, false)] {
            state.settings.left = method;
            assert_eq!(line(&state, None).contains(" --weights=filter"), named, "{method:?}");
        }
        // What cannot be read is named, so that the program says so.
        state.settings.weights = Some("nowhere.safetensors".into());
        state.settings.left = Source::Generator;
        assert!(line(&state, None).contains("--weights=nowhere.safetensors"));
    }

    #[test]
    fn the_line_says_everything_that_differs() {
        let mut state = State::new(Default::default());
        state.show("it's here.glb".into(), Arc::new(bouncelight_lab::scenes::paper_room::scene(3)));
        let text = line(&state, None);
        assert!(
            text.starts_with(r"bouncelight render 'it'\''s here.glb' -o view.png --size=640x360 --camera=0"),
            "{text}"
        );
        assert!(!text.contains("--light") && !text.contains("--environment") && !text.contains("--exposure"), "{text}");
        state.navigator.orbit(-30.0, 10.0);
        let edit = LightEdit { light: 0, strength: Some(3.25), ..LightEdit::default() };
        for action in [Action::Light(edit), Action::Exposure(-0.5), Action::Sky(0.25), Action::Select(Some(2))] {
            state.apply(action);
        }
        state.apply(Action::Move(glam::Vec3::new(0.5, 0.0, -1.0)));
        let text = line(&state, None);
        for word in
            ["'--light=0 strength=3.25'", "--exposure=-0.5", "--environment=0.25", "'--object=2 0.5,0,-1'", "--eye="]
        {
            assert!(text.contains(word), "{word} is missing in {text}");
        }
        (state.settings.left, state.gather) = (Source::Gather, Some("entry_scale=0.25".into()));
        assert!(line(&state, None).contains("--gather=entry_scale=0.25 "));
        state.apply(Action::Rays(0.5));
        assert!(line(&state, None).contains("--gather=entry_scale=0.25,rays=0.5 "));
        state.settings.left = Source::Neural;
        assert!(line(&state, None).contains("--gather=rays=0.5 "), "a network takes rays and nothing that was fitted");
        state.apply(Action::Reset);
        state.settings.left = Source::Gather;
        assert!(!line(&state, None).contains("rays="));
        assert!(!line(&state, None).contains("--object"));
        state.settings.left = Source::Reference;
        let text = line(&state, None);
        assert!(text.starts_with("bouncelight trace ") && text.contains("--spp="), "{text}");
        assert!(!["--method", "--samples", "--gather"].iter().any(|flag| text.contains(flag)), "{text}");
    }
}
