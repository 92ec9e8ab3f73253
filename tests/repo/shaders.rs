//! Every shader parses and validates. (`layouts.rs` compares their structs with those of Rust.)

use bouncelight::gpu::shaders;

/// Every permutation of every shader: (shader, its prelude). Shaders without
/// numbers from outside have one.
fn permutations() -> Vec<(String, String)> {
    let gi = bouncelight::gi::example_preludes().into_iter().chain(bouncelight::render::example_preludes());
    let gi = gi.map(|(name, prelude)| (name.to_owned(), prelude));
    let mut all: Vec<_> = gi.chain(bouncelight::net::gpu::example_preludes()).collect();
    let plain = shaders::names().filter(|name| !all.iter().any(|(n, _)| n == name)).collect::<Vec<_>>();
    all.extend(plain.into_iter().map(|name| (name, String::new())));
    all
}

fn parse(name: &str, prelude: &str) -> (naga::Module, String) {
    let text = shaders::source(name, prelude);
    let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)));
    (module, text)
}

/// Validates against WebGPU without any optional feature. (Packing halves into words belongs to
/// WebGPU; naga counts it as a capability because some old OpenGL cannot.)
fn validate(module: &naga::Module) -> Result<(), Box<naga::WithSpan<naga::valid::ValidationError>>> {
    validate_with(module, naga::valid::Capabilities::empty())
}

/// As [`validate`], with optional features.
fn validate_with(
    module: &naga::Module,
    more: naga::valid::Capabilities,
) -> Result<(), Box<naga::WithSpan<naga::valid::ValidationError>>> {
    let (flags, core) = (naga::valid::ValidationFlags::all(), naga::valid::Capabilities::SHADER_FLOAT16_IN_FLOAT32);
    naga::valid::Validator::new(flags, core | more).validate(module).map(|_| ()).map_err(Box::new)
}

#[test]
fn every_shader_validates_in_every_permutation() {
    let permutations = permutations();
    for (name, prelude) in &permutations {
        let (module, text) = parse(name, prelude);
        let half = naga::valid::Capabilities::SHADER_FLOAT16;
        let more = if name.contains("_arithmetic") { half } else { naga::valid::Capabilities::empty() };
        // These alone need an optional feature, and are taken only where the device has it.
        assert_eq!(validate(&module).is_err(), !more.is_empty(), "{name}");
        validate_with(&module, more).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)));
        let shared = module.global_variables.iter().filter(|(_, v)| v.space == naga::AddressSpace::WorkGroup);
        let bytes: u32 = shared.map(|(_, v)| module.types[v.ty].inner.size(module.to_ctx())).sum();
        // WebGPU's default limit.
        assert!(bytes <= 16384, "{name}: {bytes} bytes of a workgroup's memory");
    }
    let names: Vec<_> = shaders::names().collect();
    let seen: std::collections::BTreeSet<_> = permutations.iter().map(|p| p.0.clone()).collect();
    assert_eq!(seen.len(), names.len(), "two shaders of one name: {names:?}");
    assert_eq!(seen, names.into_iter().collect(), "every shader was seen");
    // Of the network, whose kernels are made of parts.
    let kernels = permutations.iter().filter(|(name, _)| name.starts_with("net.")).count();
    assert_eq!((shaders::NetKernel::all().count(), kernels), (46, 496));
}

/// Type of a place in memory that threads share; None for other memory, and inside vectors.
fn shared_place(
    module: &naga::Module,
    function: &naga::Function,
    place: naga::Handle<naga::Expression>,
) -> Option<naga::Handle<naga::Type>> {
    use naga::{AddressSpace, Expression, TypeInner};
    let inside = |base| Some(&module.types[shared_place(module, function, base)?].inner);
    match function.expressions[place] {
        Expression::GlobalVariable(variable) => {
            let variable = &module.global_variables[variable];
            let shared = matches!(variable.space, AddressSpace::WorkGroup | AddressSpace::Storage { .. });
            shared.then_some(variable.ty)
        }
        Expression::Access { base, .. } => match inside(base)? {
            TypeInner::Array { base, .. } => Some(*base),
            _ => None,
        },
        Expression::AccessIndex { base, index } => match inside(base)? {
            TypeInner::Array { base, .. } => Some(*base),
            TypeInner::Struct { members, .. } => Some(members[index as usize].ty),
            _ => None,
        },
        _ => None,
    }
}

/// Stores into a component, chosen by a number, of a vector that threads share.
fn chosen_components(module: &naga::Module, function: &naga::Function, block: &naga::Block) -> usize {
    use naga::{Expression, Statement, TypeInner};
    let within = |block: &naga::Block| chosen_components(module, function, block);
    let one = |statement: &Statement| match statement {
        Statement::Store { pointer, .. } => {
            let Expression::Access { base, .. } = function.expressions[*pointer] else { return 0 };
            let place = shared_place(module, function, base).map(|ty| &module.types[ty].inner);
            usize::from(matches!(place, Some(TypeInner::Vector { .. })))
        }
        Statement::Block(block) => within(block),
        Statement::If { accept, reject, .. } => within(accept) + within(reject),
        Statement::Switch { cases, .. } => cases.iter().map(|case| within(&case.body)).sum(),
        Statement::Loop { body, continuing, .. } => within(body) + within(continuing),
        _ => 0,
    };
    block.iter().map(one).sum()
}

/// The same, in all of a shader.
fn all_chosen_components(module: &naga::Module) -> usize {
    let functions = module.functions.iter().map(|(_, f)| f).chain(module.entry_points.iter().map(|e| &e.function));
    functions.map(|f| chosen_components(module, f, &f.body)).sum()
}

/// Components of one vector are no places of their own: what two threads write there at once, one may
/// lose. Whoever chooses a component by a number leaves the others to other threads.
#[test]
fn no_two_threads_write_one_vector() {
    for (name, prelude) in permutations() {
        assert_eq!(all_chosen_components(&parse(&name, &prelude).0), 0, "{name}");
    }
    // Negative control: in memory of the workgroup, of the device, and of the thread's own.
    let stores = |place: &str| {
        let text =
            "var<workgroup> group: array<vec4f, 2>; @group(0) @binding(0) var<storage, read_write> device: array<vec4f>;
            @compute @workgroup_size(4) fn main(@builtin(local_invocation_index) i: u32) {
                var own: array<vec4f, 2>;
                if i < 3u { PLACE = 1.0; }
            }";
        let text = text.replace("PLACE", place);
        all_chosen_components(&naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{place}: {e}")))
    };
    assert_eq!(["group[1][i]", "device[i / 4u][i % 4u]", "own[1][i]", "device[i].x"].map(stores), [1, 1, 0, 0]);
}

/// Negative control: a shader that uses what it does not have is refused.
#[test]
fn a_shader_without_its_numbers_is_refused() {
    assert!(naga::front::wgsl::parse_str(&shaders::source("gi.features", "")).is_err());
    let half = naga::front::wgsl::parse_str("enable f16;\n@compute @workgroup_size(1) fn main() { _ = 1.0h; }");
    assert!(half.is_err() || validate(&half.unwrap()).is_err(), "16-bit arithmetic needs a feature");
}

/// Nothing lies about that no shader brings in.
#[test]
fn every_file_is_part_of_a_shader() {
    fn files(folder: &std::path::Path, found: &mut Vec<std::path::PathBuf>) {
        for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
            match entry.path() {
                path if path.is_dir() => files(&path, found),
                path => found.push(path),
            }
        }
    }
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders");
    let mut all = Vec::new();
    files(&root, &mut all);
    let used: std::collections::BTreeSet<_> =
        shaders::names().flat_map(|name| shaders::joined(&name, "").files).map(|(_, file)| root.join(file)).collect();
    let unused: Vec<_> =
        all.iter().filter(|f| f.extension().is_some_and(|e| e == "wgsl") && !used.contains(*f)).collect();
    assert!(unused.is_empty(), "{unused:?}");
}
