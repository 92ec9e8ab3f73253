//! What is public of a crate, one line an item.

use super::modules::{Found, Modules, for_tests, hidden, join, leaves, name};
use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use std::collections::BTreeMap;
use syn::{Fields, ImplItem, Item, TraitItem, Visibility};

/// A public item.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Line {
    pub text: String,
    /// A type of glam stands in it.
    pub glam: bool,
}

/// Public items of all modules but those of `without`, in order of their paths.
pub fn lines(modules: &Modules, without: &[&str]) -> Vec<Line> {
    let mut all = Walk { modules, without, impls: impls(modules), lines: Vec::new() };
    all.module("", "", 0);
    let mut lines = all.lines;
    // An implementation stands with its type.
    let place = |text: &str| text.split_once(" for ").or(text.split_once(' ')).map_or("", |(_, rest)| rest).to_owned();
    lines.sort_by_key(|line| (place(&line.text), line.text.clone()));
    lines.dedup();
    lines
}

/// An `impl` and the module that it stands in.
type Impls<'a> = BTreeMap<(String, String), Vec<(&'a str, &'a syn::ItemImpl)>>;

/// By module and name of the type.
fn impls(modules: &Modules) -> Impls<'_> {
    let mut all: Impls<'_> = BTreeMap::new();
    for (module, of) in modules.iter() {
        for item in &of.items {
            let Item::Impl(i) = item else { continue };
            let syn::Type::Path(path) = &*i.self_ty else { continue };
            let path: Vec<String> = path.path.segments.iter().map(|s| s.ident.to_string()).collect();
            if let (false, Found::Item(at, name)) = (for_tests(&i.attrs), modules.find(module, &path)) {
                all.entry((at, name)).or_default().push((module, i));
            }
        }
    }
    all
}

struct Walk<'a> {
    modules: &'a Modules,
    without: &'a [&'a str],
    impls: Impls<'a>,
    lines: Vec<Line>,
}

impl Walk<'_> {
    /// The public items of `module`, which others see at `path`.
    fn module(&mut self, module: &str, path: &str, depth: usize) {
        let modules = self.modules;
        let Some(of) = modules.get(module).filter(|_| depth < 16 && !self.without.contains(&path)) else { return };
        for item in &of.items {
            match item {
                Item::Mod(m) if is_public(&m.vis) && !hidden(&m.attrs) => {
                    let name = m.ident.to_string();
                    self.module(&join(module, &name), &join(path, &name), depth + 1);
                }
                Item::Use(u) if is_public(&u.vis) && !hidden(&u.attrs) => {
                    for (name, target, all) in leaves(&u.tree) {
                        match modules.find(module, &target) {
                            Found::Module(at) if all => self.module(&at, path, depth + 1),
                            Found::Module(at) => self.module(&at, &join(path, &name), depth + 1),
                            Found::Item(at, item) => self.named(&at, &item, &join(path, &name)),
                            Found::Foreign => {
                                let text = format!("use {} = {}", join(path, &name), target.join("::"));
                                self.lines.push(Line { text, glam: target[0] == "glam" });
                            }
                        }
                    }
                }
                _ if visibility(item).is_some_and(is_public) => {
                    if let Some(name) = name(item) {
                        self.named(module, &name, &join(path, &name));
                    }
                }
                _ => {}
            }
        }
    }

    fn line(&mut self, module: &str, text: String, tokens: TokenStream) {
        let glam = idents(tokens).iter().any(|name| self.modules.is_glam(module, name));
        self.lines.push(Line { text, glam });
    }

    /// Items called `name` of a module (a function and a type may share it), seen at `path`.
    fn named(&mut self, module: &str, called: &str, path: &str) {
        let modules = self.modules;
        let Some(of) = modules.get(module) else { return };
        for item in of.items.iter().filter(|i| name(i).is_some_and(|n| n == called)) {
            match item {
                Item::Fn(f) => self.function(module, &f.sig, path),
                Item::Const(c) => self.typed(module, "const", path, &c.ty),
                Item::Static(s) => self.typed(module, "static", path, &s.ty),
                Item::Type(t) => {
                    let generics = plain(&t.generics);
                    self.line(module, format!("type {path}{generics} = {}", plain(&t.ty)), t.ty.to_token_stream());
                }
                Item::Struct(s) => {
                    let path = format!("{path}{}", plain(&s.generics));
                    self.shape(module, "struct", &path, &s.attrs);
                    for (number, field) in
                        s.fields.iter().enumerate().filter(|(_, f)| is_public(&f.vis) && !hidden(&f.attrs))
                    {
                        let name = field.ident.as_ref().map_or(number.to_string(), ToString::to_string);
                        self.typed(module, "field", &format!("{path}.{name}"), &field.ty);
                    }
                }
                Item::Enum(e) => {
                    self.shape(module, "enum", path, &e.attrs);
                    for variant in &e.variants {
                        let fields = match &variant.fields {
                            Fields::Unit => String::new(),
                            Fields::Named(named) => {
                                let of = |f: &syn::Field| Some(format!("{}: {}", f.ident.as_ref()?, plain(&f.ty)));
                                let all: Vec<String> = named.named.iter().filter_map(of).collect();
                                format!(" {{ {} }}", all.join(", "))
                            }
                            Fields::Unnamed(u) => {
                                let all: Vec<String> = u.unnamed.iter().map(|f| plain(&f.ty)).collect();
                                format!("({})", all.join(", "))
                            }
                        };
                        let text = format!("variant {path}::{}{fields}", variant.ident);
                        let types = variant.fields.iter().map(|f| f.ty.to_token_stream()).collect();
                        self.line(module, text, types);
                    }
                }
                Item::Trait(t) => {
                    let bounds = plain(&t.supertraits);
                    let bounds = if bounds.is_empty() { bounds } else { format!(": {bounds}") };
                    self.line(module, format!("trait {path}{bounds}"), TokenStream::new());
                    for item in &t.items {
                        match item {
                            TraitItem::Fn(f) => self.function(module, &f.sig, &format!("{path}::{}", f.sig.ident)),
                            TraitItem::Const(c) => self.typed(module, "const", &format!("{path}::{}", c.ident), &c.ty),
                            other => self.line(module, plain(other), other.to_token_stream()),
                        }
                    }
                }
                _ => {}
            }
        }
        for (at, of) in self.impls.get(&(module.to_owned(), called.to_owned())).cloned().unwrap_or_default() {
            self.implementation(at, of, path);
        }
    }

    fn implementation(&mut self, module: &str, of: &syn::ItemImpl, path: &str) {
        if let Some((_, of_trait, _)) = &of.trait_ {
            self.line(module, format!("impl {} for {path}", plain(of_trait)), of_trait.to_token_stream());
            return;
        }
        for item in &of.items {
            match item {
                ImplItem::Fn(f) if is_public(&f.vis) && !for_tests(&f.attrs) && !hidden(&f.attrs) => {
                    self.function(module, &f.sig, &format!("{path}::{}", f.sig.ident));
                }
                ImplItem::Const(c) if is_public(&c.vis) => {
                    self.typed(module, "const", &format!("{path}::{}", c.ident), &c.ty);
                }
                _ => {}
            }
        }
    }

    /// A type, with what it derives.
    fn shape(&mut self, module: &str, kind: &str, path: &str, attributes: &[syn::Attribute]) {
        let derives = attributes.iter().filter(|a| a.path().is_ident("derive"));
        let derives: Vec<String> =
            derives.filter_map(|a| Some(tidy(&a.meta.require_list().ok()?.tokens.to_string()))).collect();
        let derives = if derives.is_empty() { String::new() } else { format!(": {}", derives.join(", ")) };
        self.line(module, format!("{kind} {path}{derives}"), TokenStream::new());
    }

    fn typed(&mut self, module: &str, kind: &str, path: &str, of: &syn::Type) {
        self.line(module, format!("{kind} {path}: {}", plain(of)), of.to_token_stream());
    }

    fn function(&mut self, module: &str, signature: &syn::Signature, path: &str) {
        let text = tidy(&signature.to_token_stream().to_string());
        let (before, after) = text.split_once(&format!("fn {}", signature.ident)).unwrap_or(("", ""));
        self.line(module, format!("{before}fn {path}{after}"), signature.to_token_stream());
    }
}

fn is_public(v: &Visibility) -> bool {
    matches!(v, Visibility::Public(_))
}

fn visibility(item: &Item) -> Option<&Visibility> {
    Some(match item {
        Item::Const(i) => &i.vis,
        Item::Enum(i) => &i.vis,
        Item::Fn(i) => &i.vis,
        Item::Static(i) => &i.vis,
        Item::Struct(i) => &i.vis,
        Item::Trait(i) => &i.vis,
        Item::Type(i) => &i.vis,
        Item::Union(i) => &i.vis,
        _ => return None,
    })
}

fn idents(tokens: TokenStream) -> Vec<String> {
    let of = |tree| match tree {
        TokenTree::Ident(i) => vec![i.to_string()],
        TokenTree::Group(g) => idents(g.stream()),
        _ => Vec::new(),
    };
    tokens.into_iter().flat_map(of).collect()
}

fn plain(tokens: &impl ToTokens) -> String {
    tidy(&tokens.to_token_stream().to_string())
}

/// As rustfmt would space it, nearly.
fn tidy(tokens: &str) -> String {
    let mut text = tokens.split_whitespace().collect::<Vec<_>>().join(" ");
    for (from, to) in [
        (" :: ", "::"),
        (":: ", "::"),
        (" ::", "::"),
        ("< ", "<"),
        (" <", "<"),
        (" >", ">"),
        (" ,", ","),
        (" :", ":"),
        ("& ", "&"),
        (" (", "("),
        ("( ", "("),
        (" )", ")"),
        ("[ ", "["),
        (" ]", "]"),
        (" ;", ";"),
        (",)", ")"),
        (",>", ">"),
        ("! ", "!"),
        ("* ", "*"),
        (" . . ", ".."),
    ] {
        text = text.replace(from, to);
    }
    text.replace("->(", "-> (").replace(":(", ": (").replace(",(", ", (").replace("=(", "= (")
}
