//! One name, one meaning: shader files are joined without namespaces, so a name at the top level of
//! two files that may be joined is the same thing in both.

use std::collections::BTreeMap;
use std::path::Path;

/// Names that several files of a folder define by design, and why.
const ALTERNATIVES: [(&str, &str, &[&str]); 3] = [
    ("", "stages of a pipeline, one a shader", &["main", "vertex", "fragment"]),
    (
        "gi/gather/",
        "what a shader tells jobs.wgsl and path.wgsl",
        &["block_of", "wants", "begin", "finish", "hit_material"],
    ),
    // A kernel takes one file of each such set (src/gpu/shaders/net.rs).
    (
        "net/",
        "variants of the network's kernels",
        &[
            "ELEMENT",
            "FULL",
            "Four",
            "Matrix",
            "Place",
            "STAGED",
            "TILE",
            "arena",
            "column",
            "convolve",
            "close",
            "done",
            "end_input",
            "first_input",
            "gather",
            "inputs",
            "load",
            "load_full",
            "mean_scale_shift",
            "narrow",
            "place",
            "source",
            "stage",
            "store",
            "store_full",
            "sum",
            "weight",
            "weights",
            "wide",
            "write",
        ],
    ),
];

/// Folders whose files any other room may import. (The network's kernels import none.)
const LIBRARIES: [&str; 2] = ["lib", "accel"];

/// Whether one shader may hold both files.
fn may_meet(a: &str, b: &str) -> bool {
    let room = |file: &str| file.split('/').next().unwrap_or_default().to_owned();
    let (a, b) = (room(a), room(b));
    let library = |r: &str| LIBRARIES.contains(&r);
    a == b || (library(&a) || library(&b)) && a != "net" && b != "net"
}

/// Name and text of what a file defines at the top level. Of bindings the text is what they hold: their
/// numbers and access differ from pass to pass, and a texture that one pass writes another reads.
fn definitions(text: &str) -> Vec<(String, String)> {
    let plain: Vec<&str> = text.lines().map(|l| l.split("//").next().unwrap_or_default()).collect();
    let mut found = Vec::new();
    let (mut depth, mut one) = (0_i32, String::new());
    for c in plain.join(" ").chars() {
        one.push(c);
        depth += match c {
            '{' | '(' => 1,
            '}' | ')' => -1,
            _ => 0,
        };
        if depth == 0 && (c == ';' || c == '}') {
            found.extend(definition(&std::mem::take(&mut one)));
        }
    }
    found
}

fn definition(text: &str) -> Option<(String, String)> {
    let mut rest = text.trim();
    // Attributes: `@compute`, `@workgroup_size(8, 8)`.
    while let Some(attribute) = rest.strip_prefix('@') {
        let end = attribute.find(|c: char| !c.is_alphanumeric() && c != '_')?;
        let after = &attribute[end..];
        rest = match after.strip_prefix('(') {
            Some(inside) => inside.split_once(')')?.1,
            None => after,
        }
        .trim();
    }
    let (kind, after) = rest.split_at(rest.find(|c: char| !c.is_alphanumeric())?);
    if !["fn", "const", "struct", "var", "alias", "override"].contains(&kind) {
        return None;
    }
    let (space, after) = match after.strip_prefix('<') {
        Some(inside) => inside.split_once('>')?,
        None => ("", after),
    };
    let name: String = after.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    let is_texture = after.contains(": texture_");
    let held = if is_texture { "texture".to_owned() } else { after.split_whitespace().collect::<Vec<_>>().join(" ") };
    let space = space.split(',').next().unwrap_or_default();
    Some((name, format!("{kind}<{space}> {held}")))
}

/// Names that mean different things in files that may be joined, and where.
fn collisions(files: &[(String, String)]) -> Vec<String> {
    let mut by_name: BTreeMap<String, Vec<(&str, String)>> = BTreeMap::new();
    for (file, text) in files {
        definitions(text).into_iter().for_each(|(n, held)| by_name.entry(n).or_default().push((file, held)));
    }
    let designed = |name: &str, a: &str, b: &str| {
        let within = |folder: &str| a.starts_with(folder) && b.starts_with(folder);
        ALTERNATIVES.iter().any(|(folder, _, names)| within(folder) && names.contains(&name))
    };
    let mut found = Vec::new();
    for (name, places) in &by_name {
        for (i, (a, held)) in places.iter().enumerate() {
            let other =
                places[i + 1..].iter().find(|(b, other)| may_meet(a, b) && !designed(name, a, b) && other != held);
            found.extend(other.map(|(b, _)| format!("`{name}`: {a}, {b}")));
        }
    }
    found
}

#[test]
fn a_name_means_one_thing_in_all_shaders_that_may_be_joined() {
    fn read(root: &Path, folder: &Path, all: &mut Vec<(String, String)>) {
        for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
            let path = entry.path();
            if path.is_dir() {
                read(root, &path, all);
            } else if path.extension().is_some_and(|e| e == "wgsl") {
                let name = path.strip_prefix(root).expect("inside").to_string_lossy().replace('\\', "/");
                all.push((name, std::fs::read_to_string(&path).expect("text")));
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let mut all = Vec::new();
    read(&root, &root, &mut all);
    all.sort();
    assert!(all.iter().map(|(_, text)| definitions(text).len()).sum::<usize>() > 900, "they were read");
    let found = collisions(&all);
    assert!(found.is_empty(), "{} names have several meanings:\n{}", found.len(), found.join("\n"));
}

/// Negative controls: what collides, and what does not.
#[test]
fn names_of_two_meanings_are_found() {
    let found = |files: &[(&str, &str)]| {
        let files: Vec<_> = files.iter().map(|(file, text)| ((*file).to_owned(), (*text).to_owned())).collect();
        collisions(&files)
    };
    let number =
        |n: u32| format!("// A number.\nconst FEW = {n};\nfn f() -> u32 {{ let FEW_MORE = 1u; return 1u; }}\n");
    let (four, eight) = (number(4), number(8));
    assert_eq!(found(&[("gi/a.wgsl", &four), ("gi/b.wgsl", &eight)]), ["`FEW`: gi/a.wgsl, gi/b.wgsl"]);
    assert_eq!(found(&[("lib/a.wgsl", &four), ("gi/b.wgsl", &eight)]).len(), 1);
    assert!(found(&[("gi/a.wgsl", &four), ("gi/b.wgsl", &four)]).is_empty(), "the same text");
    assert!(found(&[("gi/a.wgsl", &four), ("net/b.wgsl", &eight)]).is_empty(), "never joined");
    // What is designed in one folder is not in another.
    let body = |n: u32| format!("fn stage(i: u32) {{\n    if i > {n}u {{ return; }}\n}}\n");
    assert_eq!(found(&[("gi/a.wgsl", &body(1)), ("gi/b.wgsl", &body(2))]).len(), 1);
    assert!(found(&[("net/a.wgsl", &body(1)), ("net/b.wgsl", &body(2))]).is_empty(), "variants");
    let binding = |n: u32, access: &str, of: &str| {
        format!("@group(2) @binding({n})\nvar<storage, {access}> light: array<{of}>;\n")
    };
    let (read, write, other) =
        (binding(1, "read", "vec4f"), binding(3, "read_write", "vec4f"), binding(1, "read", "u32"));
    assert!(found(&[("gi/a.wgsl", &read), ("gi/b.wgsl", &write)]).is_empty(), "the same buffer");
    assert_eq!(found(&[("gi/a.wgsl", &read), ("gi/b.wgsl", &other)]).len(), 1);
    let entry = "@compute @workgroup_size(8, 8)\nfn blur(@builtin(global_invocation_id) id: vec3u) {}\n";
    assert_eq!(definitions(entry)[0].0, "blur");
}
