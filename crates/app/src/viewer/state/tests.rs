//! What keys and files do to the state, without a window.

use super::*;

pub fn state() -> State {
    let mut state = State::new(Settings::default());
    state.show("interior".into(), Arc::new(bouncelight_lab::scenes::paper_room::scene(3)));
    state
}

#[test]
fn dropped_files_are_sorted_by_their_names() {
    let mut state = state();
    for path in ["a.HDR", "b.exr", "net.safetensors", "scene.glb", "interior"] {
        state.apply(Action::Open(path.into()));
    }
    let expected = [
        Request::Surroundings("a.HDR".into()),
        Request::Surroundings("b.exr".into()),
        Request::Weights(Some("net.safetensors".into())),
        Request::Load("scene.glb".into()),
        Request::Load("interior".into()),
    ];
    assert_eq!(state.requests, expected);
}

#[test]
fn the_error_view_finds_itself_a_truth() {
    let mut state = state();
    assert_eq!(state.sources(), [Source::Gather]);
    assert!(!state.wants_reference());
    state.settings.right = Source::Gather;
    state.apply(Action::View(View::Error));
    assert_eq!(state.sources(), [Source::Gather, Source::Reference]);
    assert!(state.wants_reference());
    state.apply(Action::Escape);
    assert_eq!(state.requests, [Request::Cancel]);
}

#[test]
fn wireframes_are_refused_with_a_sentence_where_there_can_be_none() {
    let mut state = state();
    state.apply(Action::View(View::Wireframe));
    assert_eq!((state.settings.view, state.messages.len()), (View::Wireframe, 0));
    state.lines(false);
    assert_eq!(state.settings.view, View::Picture, "a new device has none");
    state.apply(Action::View(View::Albedo));
    state.apply(Action::View(View::Wireframe));
    assert_eq!(state.settings.view, View::Albedo);
    assert!(state.messages.iter().any(|m| m.error && m.text == NO_LINES));
}

#[test]
fn the_same_scene_again_keeps_the_camera() {
    let mut state = state();
    state.navigator.orbit(10.0, 0.0);
    let camera = state.navigator.clone();
    let scene = state.shown.as_ref().unwrap().original.clone();
    state.show("interior".into(), scene.clone());
    assert_eq!(state.navigator, camera);
    state.show("another".into(), scene);
    assert_ne!(state.navigator, camera);
    assert_eq!(state.settings.recent, ["another", "interior"]);
}
