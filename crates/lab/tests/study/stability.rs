//! `bouncelight stability`: tests that the truth passes and its spoilt copy fails, verdicts,
//! record, page, pictures, exit codes.

use crate::common;
use bouncelight::gi::Method;
use bouncelight_lab::study::stability::{
    self, Event, Finding, Overview, Record, StabilityError, Subject, Suite, SuiteOptions,
};
use bouncelight_scene::image_io;

fn method(name: &str, method: Method) -> Subject {
    Subject::Method { name: name.into(), method }
}

fn found<'a>(finding: &'a Finding, subject: &str) -> &'a stability::Found {
    finding.found.iter().find(|f| f.subject == subject).expect("it was tested")
}

#[test]
fn gather_passes_what_ambient_fails_and_every_control_fails() {
    let Some(gpu) = common::gpu() else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let subjects = vec![
        method("gather", Method::Gather(Default::default())),
        method("ambient", Method::Ambient(Default::default())),
        method("direct", Method::Direct),
    ];
    let tests = stability::named("sealed,thin-wall,saturated,half").expect("they are there");
    let suite = Suite::new(&gpu, SuiteOptions { tests, subjects, kept: None, resume: None });
    let (mut begun, mut overview) = (0, Overview::default());
    let mut written = Vec::new();
    let record: Record = suite
        .run(&|| true, &mut |event| -> Result<(), StabilityError> {
            match event {
                Event::Begun { .. } => begun += 1,
                Event::Known { .. } => panic!("nothing was kept"),
                Event::Done { finding, sheet } => {
                    overview.push(sheet);
                    written.push(overview.write(&folder.path().join("overview.png"))?);
                    sheet.write(&folder.path().join(format!("{}.png", finding.name)))?;
                    assert!(!sheet.write_film(&folder.path().join("none.png"))?, "nothing moves here");
                }
            }
            Ok(())
        })
        .expect("it runs");
    assert_eq!((begun, record.tests.len()), (suite.steps(), 4));
    for finding in &record.tests {
        assert!(finding.sound, "{}: {:?}", finding.name, finding.criteria);
    }
    let [sealed, thin, saturated, half] = &record.tests[..] else { panic!("four tests") };
    for finding in [sealed, thin, saturated] {
        let gather = found(finding, "gather");
        println!("{}: gather {:?}, ambient {:?}", finding.name, gather.values, found(finding, "ambient").values);
        assert_eq!((gather.pass, found(finding, "direct").pass), (Some(true), Some(true)), "{}", finding.name);
    }
    // Who takes every place for open lights a closed room.
    assert_eq!(found(sealed, "ambient").pass, Some(false));
    assert_eq!(record.failures("ambient"), ["sealed"]);
    // A test without meaning for a method is no failure.
    assert!(half.found.iter().all(|f| f.pass.is_none() && f.values.is_empty()));

    let json = serde_json::to_value(&record).expect("it can be written");
    assert_eq!((&json["schema"], &json["tests"][0]["name"]), (&1.into(), &"sealed".into()));
    assert!(json["tests"][0]["criteria"][0]["control"].as_f64().expect("a number") > 1e-3);
    let page = stability::page(&record, "bouncelight stability");
    assert!(page.contains("| sealed | ") && page.contains("- **sealed**, `ambient`: "), "{page}");
    let sheet = image_io::read_png(&folder.path().join("sealed.png")).expect("a picture");
    // Four rows: the truth and three methods.
    assert!(sheet.height > 4 * 128 && sheet.pixels.iter().any(|v| *v > 0.5));
    // One sheet of several tests, a column each; of one test there is none.
    assert_eq!(written, [false, true, true, true]);
    let overview = image_io::read_png(&folder.path().join("overview.png")).expect("a picture");
    assert!(overview.width > 4 * 256 && overview.height > 4 * 128, "{}×{}", overview.width, overview.height);
}

/// The truth itself passes in units a thousand times as large, and what a slow history shows in a
/// doorway is noticed.
#[test]
fn units_and_doorway_say_something() {
    let Some(gpu) = common::gpu() else { return };
    let tests = stability::named("units,doorway").expect("they are there");
    let subjects = vec![method("direct", Method::Direct)];
    let suite = Suite::new(&gpu, SuiteOptions { tests, subjects, kept: None, resume: None });
    let record: Record = suite.run(&|| true, &mut |_| Ok::<(), StabilityError>(())).expect("it runs");
    for finding in &record.tests {
        assert!(finding.sound, "{}: {:?}", finding.name, finding.criteria);
    }
}

/// Objects that move change the light between surfaces that stand still (half a minute: 150 frames
/// of white rooms).
#[test]
fn a_door_that_is_shut_leaves_a_dark_room() {
    let Some(gpu) = common::gpu() else { return };
    let subjects = vec![method("gather", Method::Gather(Default::default()))];
    let tests = stability::named("door").expect("it is there");
    let suite = Suite::new(&gpu, SuiteOptions { tests, subjects, kept: None, resume: None });
    let record = suite.run(&|| true, &mut |_| -> Result<(), StabilityError> { Ok(()) }).expect("it runs");
    let door = &record.tests[0];
    assert!(door.sound, "{:?}", door.criteria);
    assert_eq!(found(door, "gather").pass, Some(true), "{:?}", found(door, "gather").values);
}

#[test]
fn a_run_can_be_stopped_and_goes_on_after_what_cannot_be_drawn() {
    let Some(gpu) = common::gpu() else { return };
    let tests = || stability::named("sealed").expect("it is there");
    let run = |subjects: Vec<Subject>, go_on: &dyn Fn() -> bool| {
        let suite = Suite::new(&gpu, SuiteOptions { tests: tests(), subjects, kept: None, resume: None });
        suite.run(go_on, &mut |_| -> Result<(), StabilityError> { Ok(()) })
    };
    let stopped = run(vec![method("direct", Method::Direct)], &|| false).expect_err("nobody may draw");
    assert!(stopped.to_string().contains("stopped"), "{stopped}");
}

#[test]
fn an_animation_holds_all_frames_and_shows_the_first_to_who_knows_none() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("film.png");
    let frames: Vec<Vec<u8>> = (0..3u8).map(|i| vec![50 * (i + 1); 3 * 8 * 4]).collect();
    let frames: Vec<&[u8]> = frames.iter().map(Vec::as_slice).collect();
    image_io::write_apng(&path, [8, 4], &frames, 100).expect("written");
    let first = image_io::read_png(&path).expect("a PNG like any other");
    assert_eq!((first.width, first.height), (8, 4));
    assert!(first.pixels.iter().all(|v| (*v - 50.0 / 255.0).abs() < 1e-6));
    let bytes = std::fs::read(&path).expect("readable");
    let count = |chunk: &[u8]| bytes.windows(4).filter(|w| *w == chunk).count();
    assert_eq!((count(b"acTL"), count(b"fcTL"), count(b"fdAT")), (1, 3, 2));
    // Negative control: frames of another size are refused, and nothing is written.
    let other = folder.path().join("other.png");
    assert!(image_io::write_apng(&other, [8, 5], &frames, 100).is_err() && !other.exists());
}
