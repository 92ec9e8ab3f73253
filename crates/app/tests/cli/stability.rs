//! `bouncelight stability`: what is asked for wrongly, and exit codes.

use crate::common;
use assert_cmd::Command;
use bouncelight_lab::study::stability;

fn program() -> Command {
    Command::new(env!("CARGO_BIN_EXE_bouncelight"))
}

#[test]
fn what_is_asked_for_wrongly_is_said() {
    let said = |args: &[&str]| {
        let done = program().arg("stability").args(args).output().expect("it runs");
        (done.status.code(), String::from_utf8_lossy(&done.stderr).into_owned())
    };
    let (code, text) = said(&["--suite", "crop,nonsense"]);
    assert!(code == Some(2) && text.contains("`nonsense`") && text.contains("two-places"), "{text}");
    let (code, text) = said(&["--methods", "magic"]);
    assert!(code == Some(2) && text.contains("`magic`") && text.contains("gather"), "{text}");
    let (code, text) = said(&["--methods", "ambient", "--judge", "gather"]);
    assert!(code == Some(2) && text.contains("--judge"), "{text}");
    let list = program().args(["stability", "--list"]).output().expect("it runs");
    let list = String::from_utf8_lossy(&list.stdout).into_owned();
    assert!(stability::all().iter().all(|t| list.contains(t.name)) && list.contains("at most"));
}

#[test]
fn a_failure_is_exit_code_5_unless_it_is_another_methods_or_known() {
    let Some(_) = common::gpu() else { return };
    let code = |args: &[&str]| {
        let args = [&["stability", "--suite", "sealed", "-q"], args].concat();
        program().args(args).output().expect("it runs").status.code()
    };
    assert_eq!(code(&["--methods", "ambient"]), Some(5));
    assert_eq!(code(&["--methods", "ambient", "--allow-known"]), Some(0));
    assert_eq!(code(&["--methods", "direct,ambient", "--judge", "direct"]), Some(0));
}
