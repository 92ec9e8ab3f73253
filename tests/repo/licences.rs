//! What is depended on may be given on: licences and sources as `deny.toml` allows them, for those
//! who have no `cargo deny`. Asks `cargo metadata` for all packages of all features and platforms.

use serde_json::Value;
use std::process::Command;

/// Whether an SPDX expression can be met with what is allowed. A slash is the older way to write
/// OR.
fn is_met(expression: &str, allowed: &dyn Fn(&str) -> bool) -> bool {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " OR ").replace(" WITH ", "_WITH_");
    let words: Vec<String> = spaced.split_whitespace().map(|w| w.replace("_WITH_", " WITH ")).collect();
    let mut at = 0;
    let met = any(&words, &mut at, allowed);
    met && at == words.len()
}

fn any(words: &[String], at: &mut usize, allowed: &dyn Fn(&str) -> bool) -> bool {
    let mut met = all(words, at, allowed);
    while words.get(*at).is_some_and(|w| w == "OR") {
        *at += 1;
        met |= all(words, at, allowed);
    }
    met
}

fn all(words: &[String], at: &mut usize, allowed: &dyn Fn(&str) -> bool) -> bool {
    let mut met = one(words, at, allowed);
    while words.get(*at).is_some_and(|w| w == "AND") {
        *at += 1;
        met &= one(words, at, allowed);
    }
    met
}

fn one(words: &[String], at: &mut usize, allowed: &dyn Fn(&str) -> bool) -> bool {
    let Some(word) = words.get(*at) else { return false };
    *at += 1;
    if word != "(" {
        return allowed(word);
    }
    let met = any(words, at, allowed);
    let closed = words.get(*at).is_some_and(|w| w == ")");
    *at += 1;
    met && closed
}

fn strings(list: &toml::Value) -> Vec<String> {
    list.as_array().into_iter().flatten().filter_map(|v| v.as_str().map(str::to_owned)).collect()
}

#[test]
fn all_that_is_depended_on_may_be_given_on() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(root.join("deny.toml")).expect("deny.toml is there");
    let deny: toml::Value = toml::from_str(&text).expect("it is TOML");
    let allow = strings(&deny["licenses"]["allow"]);
    let exceptions = deny["licenses"]["exceptions"].as_array().expect("a list");
    let registry = format!("registry+{}", strings(&deny["sources"]["allow-registry"])[0]);

    let metadata = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--all-features", "--locked"])
        .current_dir(root)
        .output()
        .expect("cargo runs");
    assert!(metadata.status.success(), "{}", String::from_utf8_lossy(&metadata.stderr));
    let metadata: Value = serde_json::from_slice(&metadata.stdout).expect("it is JSON");
    let packages = metadata["packages"].as_array().expect("a list");
    assert!(packages.len() > 300, "{} packages", packages.len());
    let mut wrong = Vec::new();
    for package in packages {
        let (name, license) = (package["name"].as_str().unwrap_or_default(), package["license"].as_str());
        let own = exceptions.iter().filter(|e| e["crate"].as_str() == Some(name)).flat_map(|e| strings(&e["allow"]));
        let own: Vec<String> = own.collect();
        let allowed = |id: &str| allow.iter().chain(&own).any(|a| a == id);
        if !license.is_some_and(|l| is_met(l, &allowed)) {
            wrong.push(format!("{name}: {license:?}"));
        }
        match package["source"].as_str() {
            None => {}
            Some(source) if source == registry => {}
            Some(source) => wrong.push(format!("{name}: from {source}")),
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    // Each exception is needed: without it its package would be refused.
    for exception in exceptions {
        let of = packages.iter().find(|p| p["name"] == exception["crate"].as_str().unwrap_or_default());
        let license = of.and_then(|p| p["license"].as_str()).expect("the package of an exception is depended on");
        assert!(!is_met(license, &|id| allow.iter().any(|a| a == id)), "{license}");
    }
}

#[test]
fn expressions_are_read() {
    let allowed = |id: &str| ["MIT", "Zlib", "Apache-2.0 WITH LLVM-exception"].contains(&id);
    for met in ["MIT", "MIT OR GPL-3.0-only", "GPL-2.0/MIT", "MIT AND Zlib", "(GPL-3.0-only OR MIT) AND Zlib"] {
        assert!(is_met(met, &allowed), "{met}");
    }
    assert!(is_met("Apache-2.0 WITH LLVM-exception OR GPL-3.0-only", &allowed));
    for refused in ["GPL-3.0-only", "MIT AND GPL-3.0-only", "Apache-2.0", "", "(MIT", "MIT AND (GPL-3.0-only OR X)"] {
        assert!(!is_met(refused, &allowed), "{refused}");
    }
}
