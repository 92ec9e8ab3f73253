//! Studies draw through one place: its pictures, sequences and references keep what they promise.

use crate::common;
use bouncelight::gi::Method;
use bouncelight::render::capture::Layer;
use bouncelight::scene::{Environment, LightKind};
use bouncelight_lab::study::judge::{compare, light_error};
use bouncelight_lab::study::projection::{GTX_1050, modelled};
use bouncelight_lab::study::session::{Edits, FrameChange, Session, SessionError, SessionOptions, Settling};
use bouncelight_lab::study::truth;

const SIZE: [u32; 2] = [64, 32];

fn mean(values: &[f32]) -> f32 {
    values.iter().sum::<f32>() / values.len() as f32
}

#[test]
fn pictures_are_judged_by_a_kept_reference() {
    let Some(gpu) = common::gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let scene = bouncelight_lab::scenes::load("paper-room:7").expect("made by code");
    let camera = scene.cameras[0].clone();
    let options = SessionOptions { kept: Some(folder.path().join("kept")), ..SessionOptions::default() };
    let mut session = Session::new(&gpu, scene, SIZE, options).expect("it fits");
    let truth = session.reference(&camera, &truth::samples(64, 1)).expect("traced");
    assert!(!truth.kept && truth.samples == [64, 64] && truth.light_noise() > 0.0);
    let again = session.reference(&camera, &truth::samples(64, 1)).expect("read");
    assert!(again.kept && again.layers == truth.layers && again.samples == truth.samples);
    // Numbers go through JSON, whose reader may miss the last bit.
    assert!((again.light_noise() / truth.light_noise() - 1.0).abs() < 1e-12);
    // Other paths are another picture, whose error is about the noise that both state.
    let other = session.reference(&camera, &truth::samples(64, 2)).expect("traced");
    assert!(!other.kept && other.layers != truth.layers);
    let apart = light_error(other.layer(bouncelight_lab::reference::Layer::Gi), &truth).expect("there is light");
    let ratio = apart.error / (apart.floor * 2f64.sqrt());
    assert!((0.4..2.5).contains(&ratio), "{apart:?}");
    let mut of = |method: Method| {
        let shot = session.picture(&method, &camera, Settling::SETTLED).expect("drawn");
        assert_eq!((shot.drawn_by, shot.fallback.as_ref()), (method.name(), None));
        let light = light_error(&shot.added(), &truth).expect("there is light").error;
        let seen = compare(&shot.rgb(), &truth, false).expect("sizes agree");
        let costs = session.count(&method, &camera).expect("counted");
        let projected = modelled(&costs, &GTX_1050).ms;
        (light, seen.display.psnr, projected, shot.settled)
    };
    let (direct, ambient) = (of(Method::Direct), of(Method::Ambient(Default::default())));
    let gather = of(Method::Gather(Default::default()));
    assert!((direct.0 - 1.0).abs() < 1e-6 && direct.2 == 0.0, "{direct:?}");
    assert!(gather.0 < 0.5 * ambient.0 && ambient.0 < direct.0, "{gather:?} {ambient:?}");
    assert!(gather.1 > ambient.1 && ambient.1 > direct.1, "{gather:?} {ambient:?} {direct:?}");
    assert!(gather.2 > ambient.2 && ambient.2 > 0.0, "{gather:?} {ambient:?}");
    assert_eq!((gather.3, ambient.3), (Some(Method::SETTLED), None));
}

#[test]
fn sequences_keep_their_history_and_leave_the_scene_as_it_was() {
    let Some(gpu) = common::gpu() else { return };
    let scene = bouncelight_lab::scenes::load("paper-room:7").expect("made by code");
    let camera = scene.cameras[0].clone();
    let mut dark = scene.lights.clone();
    for light in &mut dark {
        if let LightKind::Directional { irradiance, .. } = &mut light.kind {
            *irradiance = 0.0;
        }
    }
    let off = Edits {
        lights: Some(dark),
        environment: Some(Environment::constant([0.0; 3])),
        placements: vec![(0, scene.instances[1].transform)],
    };
    let mut session = Session::new(&gpu, scene, SIZE, SessionOptions::default()).expect("it fits");
    let hash = session.hash().to_owned();
    let method = Method::Gather(Default::default());
    let mut change = |frame: u32| FrameChange {
        edits: if frame == 2 { off.clone() } else { Edits::default() },
        wanted: frame != 1,
        cut: frame == 3,
        ..FrameChange::still(&camera)
    };
    let mut shots = Vec::new();
    session.render_sequence(&method, &mut change, 4, &mut |shot| shots.push(shot)).expect("drawn");
    assert_eq!(shots.iter().map(|s| s.number).collect::<Vec<_>>(), [0, 2, 3]);
    // History goes on through frame 1, which nobody read, and ends at the cut.
    assert_eq!(shots.iter().map(|s| s.settled).collect::<Vec<_>>(), [Some(1), Some(3), Some(1)]);
    let direct = |i: usize| mean(&shots[i].layer(Layer::DiffDir).data);
    assert!(direct(0) > 0.01 && direct(1) == 0.0, "{} {}", direct(0), direct(1));
    assert_eq!(session.hash(), hash);
    let after = session.picture(&method, &camera, Settling::COLD).expect("drawn");
    assert_eq!(after.frame.beauty.data, shots[0].frame.beauty.data);
    // Edits of what is not there change nothing.
    let wrong = Edits { placements: vec![(9999, off.placements[0].1)], ..Edits::default() };
    assert!(matches!(session.edit(&wrong), Err(SessionError::Instance { index: 9999, .. })));
    session.edit(&off).expect("it is there");
    assert_ne!(session.hash(), hash);
    let traced = session.reference(&camera, &truth::samples(4, 0)).expect("traced");
    assert!(traced.rgb().iter().all(|v| *v == 0.0), "no light at all");
}

#[test]
fn lamps_that_stand_in_for_surfaces_are_counted_once() {
    let Some(gpu) = common::gpu() else { return };
    let scene = bouncelight_lab::scenes::load("cornell").expect("bundled");
    assert!(scene.lights.iter().any(|l| l.is_emissive_proxy));
    let camera = scene.cameras[0].clone();
    let mut session = Session::new(&gpu, scene, [64, 64], SessionOptions::default()).expect("it fits");
    let truth = session.reference(&camera, &truth::samples(64, 1)).expect("traced");
    let direct = session.picture(&Method::Direct, &camera, Settling::COLD).expect("drawn");
    let shot = session.picture(&Method::Gather(Default::default()), &camera, Settling::SETTLED).expect("drawn");
    let error = |light: &[f32]| light_error(light, &truth).expect("there is light").error;
    let (added, naive) = (error(&shot.added()), error(&shot.layer(Layer::DiffInd).data));
    println!("direct {}, DiffInd alone {naive}, added {added}", error(&direct.added()));
    // The lamp's own light is in DiffInd, but was no light that `direct` misses.
    assert!(added < 0.5 && naive > 2.0 * added, "{added} {naive}");
}

#[test]
fn whoever_watches_can_stop() {
    let Some(gpu) = common::gpu() else { return };
    let scene = bouncelight_lab::scenes::load("cornell").expect("bundled");
    let camera = scene.cameras[0].clone();
    let mut session = Session::new(&gpu, scene, SIZE, SessionOptions::default()).expect("it fits").watched(|_| false);
    let method = Method::Gather(Default::default());
    let stopped = |e| matches!(e, Err(SessionError::Stopped));
    assert!(stopped(session.picture(&method, &camera, Settling::SETTLED).map(|_| ())));
    assert!(stopped(session.trace(&camera, &truth::samples(4, 0)).map(|_| ())));
    let mut change = |_| FrameChange::still(&camera);
    assert!(stopped(session.render_sequence(&Method::Direct, &mut change, 2, &mut |_| ())));
}
