//! Names that were replaced by the field's terms (docs/internals/glossary.md) do not come back.

use std::path::{Path, PathBuf};

/// Labels of passes, functions, constants, types and options that have gone.
const GONE: &[&str] = &[
    "gi.cells",
    "gi.recall",
    "gi.rays",
    "gi.settle",
    "gi.renew",
    "gi.evict",
    "gi.smooth",
    "gi.bring",
    "gi.mirror",
    "gi.lit",
    "gi.glossy",
    "past_at",
    "past_from",
    "lately_noise",
    "lately_share",
    "LATELY",
    "FRESH",
    "STALE",
    "YOUNG_FRAMES",
    "ROUNDS_YOUNG",
    "ROUNDS_RESTED",
    "looks_of",
    "HURRY",
    "STIR",
    "HURRIED",
    "BRIEF",
    "told_at",
    "kinship",
    "at_rim",
    "BLOTCH",
    "without_rare",
    "SPARKS",
    "gleams",
    "gloss_of",
    "lobe_over",
    "LIFT",
    "entry_lots",
    "entry_queries",
    "claim_entry",
    "BY_ENTRIES",
    "FURTHER",
    "ENTRY_ROOMS",
    "WALKS",
    "COURSE",
    "CHANCES",
    "WALKERS",
    "set_out",
    "line_ended",
    "Met",
    "MET_UNLIT",
    "IN_TURN",
    "knows_scene",
    "shows_lobes",
    "OrBelow",
    "Shelf",
    "Permutation",
    "Trial",
    "Yardstick",
    "hear_job",
    "hear_reference",
    "BringPass",
    "GlossyPass",
    "CellsPass",
    "--gi-frames",
    "--most-samples",
    "--unseen",
];

/// The words of a text that have gone: none of their neighbours belongs to a word.
fn gone(text: &str) -> Vec<&'static str> {
    let part = |c: Option<char>| c.is_some_and(|c| c.is_alphanumeric() || c == '_');
    let whole = |word: &str, at: usize| {
        let (before, after) = (text[..at].chars().next_back(), text[at + word.len()..].chars().next());
        !part(before) && !part(after) && after != Some('-')
    };
    let found = |word: &&&'static str| text.match_indices(**word).any(|(at, _)| whole(word, at));
    GONE.iter().filter(found).copied().collect()
}

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        let ending = path.extension().and_then(|e| e.to_str()).unwrap_or_default();
        let left_out = ["docs/log", "docs/measured", "target", "node_modules"].iter().any(|end| path.ends_with(end));
        if path.is_dir() && !left_out {
            files(&path, found);
        } else if ["rs", "wgsl", "py", "js", "md"].contains(&ending) {
            found.push(path);
        }
    }
}

#[test]
fn replaced_names_do_not_come_back() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut all = Vec::new();
    for folder in ["src", "shaders", "crates", "tests", "training", "examples", "docs/guide", "docs/internals"] {
        files(&root.join(folder), &mut all);
    }
    assert!(all.len() > 500, "{} files", all.len());
    let mut found = Vec::new();
    for path in &all {
        let name = path.strip_prefix(root).expect("inside").to_string_lossy().replace('\\', "/");
        if name != "tests/repo/words.rs" {
            let text = std::fs::read_to_string(path).unwrap_or_default();
            found.extend(gone(&text).into_iter().map(|word| format!("{name}: `{word}`")));
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// Negative control.
#[test]
fn a_replaced_name_is_found() {
    assert_eq!(gone("let a = LIFT * x; // of gi.rays"), ["gi.rays", "LIFT"]);
    assert!(gone("RAY_LIFT, LIFTS, gi.rays_more, --unseen-light").is_empty());
}
