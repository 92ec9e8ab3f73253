//! The library's public items, as `docs/public-api.txt` lists them: what changes there changes what
//! others have built on, so it is changed by hand and said in CHANGELOG.md. Renew the list by
//!
//!     RENEW=1 cargo test --test repo
//!
//! Read from the sources by `syn`, since rustdoc's JSON needs a nightly compiler. What macros would
//! make public is not seen; there is none. What is hidden from the documentation is for the sister
//! packages, may change in any release, and is not listed.

mod items;
mod modules;

use items::{Line, lines};
use modules::Modules;
use std::path::Path;

const LIST: &str = "docs/public-api.txt";
/// Items (not fields and variants) that a host can read about in one sitting.
const MOST: usize = 600;

fn listed() -> Vec<Line> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    lines(&Modules::read(&root.join("src/lib.rs")), &[])
}

fn text(lines: &[Line]) -> String {
    lines.iter().map(|line| format!("{}\n", line.text)).collect()
}

#[test]
fn public_items_are_those_that_are_listed() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(LIST);
    let found = text(&listed());
    if std::env::var_os("RENEW").is_some() {
        std::fs::write(&path, &found).expect("the list is written");
    }
    let said = std::fs::read_to_string(&path).expect("the list is there");
    let missing = |a: &str, b: &str| -> Vec<String> {
        let b: std::collections::BTreeSet<&str> = b.lines().collect();
        a.lines().filter(|line| !b.contains(line)).map(str::to_owned).collect()
    };
    let (new, gone) = (missing(&found, &said), missing(&said, &found));
    assert!(
        found == said,
        "the public items are not those of {LIST}.\nnew: {new:#?}\ngone: {gone:#?}\n\
         If that is meant, run `RENEW=1 cargo test --test repo` and say it in CHANGELOG.md."
    );
    let items = found.lines().filter(|l| !l.starts_with("field ") && !l.starts_with("variant ")).count();
    assert!((200..=MOST).contains(&items), "{items} items");
    // What hosts use is there.
    for item in ["gi::World::prepare(&mut self,", "gi::View::record<'a>(&mut self,", "gi::Inputs<'a>.depth:"] {
        assert!(found.contains(item), "{item}");
    }
}

#[test]
fn no_signature_of_gi_names_glam() {
    let lines = listed();
    let leaks: Vec<&str> = lines.iter().filter(|l| l.glam).map(|l| l.text.as_str()).collect();
    println!("{} of {} public items name glam: {leaks:#?}", leaks.len(), lines.len());
    assert!(!leaks.iter().any(|l| l.contains(" gi::")), "{leaks:#?}");
}

/// Negative control: what is to be found is found, in each way in which it can be written.
#[test]
fn leaks_and_changes_are_seen() {
    let of = |source: &str| lines(&Modules::parsed(source), &[]);
    let one = |source: &str| {
        let mut lines = of(source);
        assert_eq!(lines.len(), 1, "{source}: {:?}", text(&lines));
        lines.remove(0)
    };
    for leak in [
        "pub fn f(v: glam::Vec3) {}",
        "use glam::{Mat4, Vec3}; pub fn f() -> Option<[Vec3; 2]> { None }",
        "use glam::Vec3 as V; pub const ORIGIN: V = V::ZERO;",
        "mod hidden { use glam::Vec3; pub fn f(v: Vec3) {} } pub use hidden::f;",
        "use glam::Vec3; struct Hidden; impl Hidden { pub fn f() {} } pub type Place = Vec3;",
    ] {
        assert!(one(leak).glam, "{leak}");
    }
    assert!(!one("use glam::Vec3; pub fn f(v: [f32; 3]) { let _ = Vec3::from(v); }").glam);
    assert_eq!(
        one("mod a { pub fn f(x: &mut u32) -> Vec<u8> { vec![] } } pub use a::f;").text,
        "fn f(x: &mut u32) -> Vec<u8>"
    );
    // What is not public is not listed, and neither is what only tests see.
    for hidden in
        ["fn f() {}", "pub(crate) fn f() {}", "mod a { pub fn f() {} }", "#[cfg(test)] pub mod a { pub fn f() {} }"]
    {
        assert!(of(hidden).is_empty(), "{hidden}");
    }
    let all = of("pub struct S { pub a: u8, b: u8 } impl S { pub fn f(&self) {} fn g(&self) {} } impl Clone for S {}
        pub enum E { A, B { c: u8 } } pub trait T { const N: u8; fn h(&self); }");
    let expected = [
        "enum E",
        "variant E::A",
        "variant E::B { c: u8 }",
        "struct S",
        "field S.a: u8",
        "fn S::f(&self)",
        "impl Clone for S",
        "trait T",
        "const T::N: u8",
        "fn T::h(&self)",
    ];
    let found: Vec<&str> = all.iter().map(|l| l.text.as_str()).collect();
    for item in expected {
        assert!(found.contains(&item), "{item} of {found:#?}");
    }
    assert_eq!(found.len(), expected.len(), "{found:#?}");
}
