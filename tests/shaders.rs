//! Every shader of the table parses and validates, and its uniform structs lie as their Rust twins do.

use bouncelight::gpu::shaders;

/// `const` lines that a module expects from the code that compiles it.
fn prelude(name: &str) -> &'static str {
    match name {
        _ => "",
    }
}

fn parse(name: &str) -> (naga::Module, String) {
    let text = shaders::source(name, prelude(name));
    let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)));
    (module, text)
}

#[test]
fn every_shader_validates() {
    let mut seen = 0;
    for shader in shaders::all() {
        let (module, text) = parse(shader.name);
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{}: {}", shader.name, e.emit_to_string(&text)));
        seen += 1;
    }
    assert_eq!(shaders::RENDER.len(), 6);
    assert_eq!(seen, shaders::RENDER.len() + shaders::GI.len() + shaders::NET.len());
}
