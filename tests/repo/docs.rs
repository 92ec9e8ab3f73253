//! Links of the documents lead somewhere.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Markdown files of the repository, those of other people's folders left out.
fn pages(root: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![root.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder").flatten() {
            let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
            if path.is_dir() && !name.starts_with('.') && !["target", "out", "node_modules"].contains(&name.as_str()) {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "md") {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

/// A page without blocks and spans of code, in which brackets are no links.
fn prose(text: &str) -> String {
    let mut fenced = false;
    let line = |line: &str| {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
        }
        if fenced || line.starts_with("    ") {
            return String::new();
        }
        line.split('`').step_by(2).collect::<Vec<_>>().join("")
    };
    text.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// Targets of links and pictures.
fn links(text: &str) -> Vec<String> {
    let prose = prose(text);
    let targets = prose.split("](").skip(1).filter_map(|rest| rest.split(')').next());
    targets.map(str::to_owned).filter(|t| !t.contains("://") && !t.starts_with("mailto:")).collect()
}

/// Anchors of a page's headings, as GitHub makes them.
fn anchors(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut fenced = false;
    for line in text.lines() {
        fenced ^= line.starts_with("```");
        let heading = line.trim_start_matches('#');
        if fenced || heading.len() == line.len() || !heading.starts_with(' ') {
            continue;
        }
        let kept = heading.trim().to_lowercase();
        let kept: String = kept.chars().filter(|c| c.is_alphanumeric() || " -_".contains(*c)).collect();
        let anchor = kept.replace(' ', "-");
        let again = (1..).map(|n| format!("{anchor}-{n}")).find(|a| !found.contains(a));
        let own = if found.contains(&anchor) { again.expect("a number is free") } else { anchor };
        found.insert(own);
    }
    found
}

/// What is wrong with a link of `page`.
fn wrong(page: &Path, text: &str, target: &str) -> Option<String> {
    let (path, anchor) = target.split_once('#').unwrap_or((target, ""));
    let file = if path.is_empty() { page.to_owned() } else { page.parent()?.join(path) };
    if !file.exists() {
        return Some(format!("{}: {target} is not there", page.display()));
    }
    let other = if path.is_empty() { text.to_owned() } else { std::fs::read_to_string(&file).unwrap_or_default() };
    let named = anchor.is_empty() || anchors(&other).contains(anchor);
    (!named).then(|| format!("{}: {target} has no such heading", page.display()))
}

#[test]
fn links_lead_to_pages_and_headings() {
    let root = crate::common::root();
    let (mut bad, mut seen) = (Vec::new(), 0);
    for page in pages(&root) {
        let text = std::fs::read_to_string(&page).expect("text");
        for target in links(&text) {
            seen += 1;
            bad.extend(wrong(&page, &text, &target));
        }
    }
    assert!(bad.is_empty(), "{bad:#?}");
    assert!(seen > 300, "{seen} links");
    // Negative controls.
    let page = root.join("README.md");
    let text = "# A heading (here)\n[a](#a-heading-here) `[b](no)`\n";
    assert_eq!(links(text), ["#a-heading-here"]);
    assert_eq!(wrong(&page, text, "#a-heading-here"), None);
    assert!(wrong(&page, text, "#another").is_some() && wrong(&page, text, "docs/none.md").is_some());
}
