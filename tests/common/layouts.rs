//! What tests of the layout of structs share: each struct of each shader's uniform and storage
//! variables must be a row of the package that owns the shader, field by field.

use bouncelight::gpu::shaders;
use bouncelight::layouts::Layout;
use naga::{AddressSpace, Handle, Module, Type, TypeInner};
use std::collections::{BTreeMap, BTreeSet};

/// What follows the first element of an array in Rust, which shaders name one by one.
const WITHIN: [&str; 6] = ["green", "blue", "rough_use", "normal_use", "occlusion_use", "emissive_use"];

pub fn parse(name: &str, prelude: &str) -> Module {
    let text = shaders::source(name, prelude);
    naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)))
}

/// The structs within `ty`, itself included.
fn structs(module: &Module, ty: Handle<Type>, found: &mut BTreeMap<String, Layout>) {
    match &module.types[ty].inner {
        TypeInner::Array { base, .. } => structs(module, *base, found),
        TypeInner::Struct { members, span } => {
            let name = |name: &Option<String>| name.clone().expect("WGSL names everything");
            let fields = members.iter().map(|m| (name(&m.name), m.offset as usize)).collect();
            found.insert(name(&module.types[ty].name), Layout { size: *span as usize, fields });
            members.iter().for_each(|m| structs(module, m.ty, found));
        }
        _ => {}
    }
}

/// The structs that the host and a shader share.
pub fn shared(module: &Module) -> BTreeMap<String, Layout> {
    let mut found = BTreeMap::new();
    for (_, variable) in module.global_variables.iter() {
        if matches!(variable.space, AddressSpace::Uniform | AddressSpace::Storage { .. }) {
            structs(module, variable.ty, &mut found);
        }
    }
    found
}

/// Rust's row is what the shader has, padding aside.
pub fn same(rust: &Layout, shader: &Layout) -> bool {
    let mut fields = shader.fields.clone();
    let nothing = |name: &str| name.starts_with("pad") || WITHIN.contains(&name);
    fields.retain(|name, _| rust.fields.contains_key(name) || !nothing(name));
    rust.size == shader.size && rust.fields == fields
}

/// Every struct of `shaders` is one of `rows` or of `without`, and each of these is some shader's.
pub fn check(
    shaders: impl Iterator<Item = String>,
    preludes: &BTreeMap<String, String>,
    rows: &[(&str, Layout)],
    without: &[&str],
) {
    let (mut used, mut other) = (BTreeSet::new(), BTreeSet::new());
    for shader in shaders {
        let module = parse(&shader, preludes.get(&shader).map_or("", |p| p));
        for (name, layout) in shared(&module) {
            if without.contains(&name.as_str()) {
                other.insert(name);
                continue;
            }
            let row = rows.iter().position(|(row, rust)| *row == name && same(rust, &layout));
            used.insert(row.unwrap_or_else(|| panic!("{shader}: no row of layouts.rs is `{name}`, {layout:?}")));
        }
    }
    assert_eq!((used.len(), other.len()), (rows.len(), without.len()), "rows that no shader has");
}
