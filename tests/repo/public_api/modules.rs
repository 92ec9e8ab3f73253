//! A crate's modules, parsed, and where names in them lead.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use syn::{Item, UseTree};

/// A module's items.
#[derive(Default)]
pub struct Module {
    pub items: Vec<Item>,
    /// Names that it brings in, and what they stand for.
    pub uses: BTreeMap<String, Vec<String>>,
}

/// All modules by path; the crate's root is "".
pub struct Modules(BTreeMap<String, Module>);

/// What a path leads to.
pub enum Found {
    /// An item of a module.
    Item(String, String),
    Module(String),
    /// Something of another crate.
    Foreign,
}

pub fn join(module: &str, name: &str) -> String {
    if module.is_empty() { name.to_owned() } else { format!("{module}::{name}") }
}

/// Name, path and whether all names behind the path are meant, of each leaf of a `use`.
pub fn leaves(tree: &UseTree) -> Vec<(String, Vec<String>, bool)> {
    match tree {
        UseTree::Path(p) => {
            let add = |(name, mut path, all): (String, Vec<String>, bool)| {
                path.insert(0, p.ident.to_string());
                (name, path, all)
            };
            leaves(&p.tree).into_iter().map(add).collect()
        }
        UseTree::Name(n) if n.ident == "self" => vec![(String::new(), Vec::new(), false)],
        UseTree::Name(n) => vec![(n.ident.to_string(), vec![n.ident.to_string()], false)],
        UseTree::Rename(r) => vec![(r.rename.to_string(), vec![r.ident.to_string()], false)],
        UseTree::Glob(_) => vec![(String::new(), Vec::new(), true)],
        UseTree::Group(g) => g.items.iter().flat_map(leaves).collect(),
    }
}

pub fn for_tests(attributes: &[syn::Attribute]) -> bool {
    let tests = |a: &syn::Attribute| {
        a.path().is_ident("cfg") && a.meta.require_list().is_ok_and(|l| l.tokens.to_string().contains("test"))
    };
    attributes.iter().any(tests)
}

/// `#[doc(hidden)]`: what the sister packages need and no host.
pub fn hidden(attributes: &[syn::Attribute]) -> bool {
    let hides = |a: &syn::Attribute| {
        a.path().is_ident("doc") && a.meta.require_list().is_ok_and(|l| l.tokens.to_string() == "hidden")
    };
    attributes.iter().any(hides)
}

impl Modules {
    /// The crate whose root is this file.
    pub fn read(root: &Path) -> Self {
        let mut all = Self(BTreeMap::new());
        all.file("", root, root.parent().expect("a file is in a folder"));
        all
    }

    /// A crate of one file, for tests.
    pub fn parsed(source: &str) -> Self {
        let mut all = Self(BTreeMap::new());
        all.add("", syn::parse_file(source).expect("it is Rust").items, Path::new(""));
        all
    }

    /// `folder` holds the files of the module's own modules.
    fn file(&mut self, module: &str, file: &Path, folder: &Path) {
        let source = std::fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        let parsed = syn::parse_file(&source).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
        self.add(module, parsed.items, folder);
    }

    fn add(&mut self, module: &str, items: Vec<Item>, folder: &Path) {
        let mut uses = BTreeMap::new();
        for item in &items {
            match item {
                Item::Use(u) => {
                    for (name, path, all) in leaves(&u.tree) {
                        let name = if name.is_empty() { path.last().cloned().unwrap_or_default() } else { name };
                        if !all {
                            uses.insert(name, path);
                        }
                    }
                }
                Item::Mod(m) if !for_tests(&m.attrs) => {
                    let name = m.ident.to_string();
                    let (path, inner) = (join(module, &name), folder.join(&name));
                    match &m.content {
                        Some((_, items)) => self.add(&path, items.clone(), &inner),
                        None => {
                            let candidates: [PathBuf; 2] = [folder.join(format!("{name}.rs")), inner.join("mod.rs")];
                            let file = candidates.iter().find(|f| f.exists());
                            self.file(&path, file.unwrap_or_else(|| panic!("no file of {path}")), &inner);
                        }
                    }
                }
                _ => {}
            }
        }
        self.0.insert(module.to_owned(), Module { items, uses });
    }

    pub fn get(&self, module: &str) -> Option<&Module> {
        self.0.get(module)
    }

    pub fn iter(&self) -> impl Iterator<Item = (&String, &Module)> {
        self.0.iter()
    }

    /// Where `path`, written in `module`, leads.
    pub fn find(&self, module: &str, path: &[String]) -> Found {
        self.step(module, path, 0)
    }

    fn step(&self, module: &str, path: &[String], depth: usize) -> Found {
        let Some((first, rest)) = path.split_first().filter(|_| depth < 32) else {
            return Found::Module(module.to_owned());
        };
        let parent = || module.rsplit_once("::").map_or("", |(p, _)| p);
        match first.as_str() {
            "crate" => return self.step("", rest, depth + 1),
            "self" => return self.step(module, rest, depth + 1),
            "super" => return self.step(parent(), rest, depth + 1),
            _ => {}
        }
        let child = join(module, first);
        if self.0.contains_key(&child) {
            return self.step(&child, rest, depth + 1);
        }
        let Some(here) = self.0.get(module) else { return Found::Foreign };
        if rest.is_empty() && here.items.iter().any(|i| name(i).is_some_and(|n| n == *first)) {
            return Found::Item(module.to_owned(), first.clone());
        }
        match here.uses.get(first) {
            Some(to) if to != path => self.step(module, &[to, rest].concat(), depth + 1),
            _ => Found::Foreign,
        }
    }

    /// Whether a name, written in `module`, stands for glam or something of it.
    pub fn is_glam(&self, module: &str, name: &str) -> bool {
        let mut path = vec![name.to_owned()];
        let mut module = module.to_owned();
        for _ in 0..32 {
            if path[0] == "glam" {
                return true;
            }
            if let Found::Item(at, _) = self.find(&module, &path) {
                return self.get(&at).is_none();
            }
            match self.get(&module).and_then(|m| m.uses.get(&path[0])) {
                Some(to) if to[0] == "crate" || to[0] == "super" || to[0] == "self" => {
                    // Through a module of this crate that brings it in.
                    let (last, way) = to.split_last().expect("a path is not empty");
                    let Found::Module(at) = self.find(&module, way) else { return false };
                    (module, path) = (at, vec![last.clone()]);
                }
                Some(to) if *to != path => path.clone_from(to),
                _ => return false,
            }
        }
        false
    }
}

/// What an item is called.
pub fn name(item: &Item) -> Option<String> {
    Some(match item {
        Item::Const(i) => i.ident.to_string(),
        Item::Enum(i) => i.ident.to_string(),
        Item::Fn(i) => i.sig.ident.to_string(),
        Item::Static(i) => i.ident.to_string(),
        Item::Struct(i) => i.ident.to_string(),
        Item::Trait(i) => i.ident.to_string(),
        Item::Type(i) => i.ident.to_string(),
        Item::Union(i) => i.ident.to_string(),
        _ => return None,
    })
}
