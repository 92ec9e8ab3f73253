//! Every kernel of the network in every example permutation is valid WGSL under WebGPU's default capabilities, and the
//! uniform has the layout of the Rust side. Needs no GPU.

use bouncelight::gpu::shaders;
use bouncelight::net::gpu::{StepUniform, example_preludes};
use naga::valid::{Capabilities, ValidationFlags, Validator};

#[test]
fn every_permutation_is_valid() {
    let examples = example_preludes();
    for shader in shaders::NET {
        assert!(examples.iter().any(|(name, _)| *name == shader.name), "{} has an example prelude", shader.name);
    }
    let mut seen = 0;
    for (name, prelude) in &examples {
        let text = shaders::source(name, prelude);
        let module = naga::front::wgsl::parse_str(&text).unwrap_or_else(|e| panic!("{}", e.emit_to_string(&text)));
        Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(&module)
            .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&text)));
        let size = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("Step")).map(|(_, t)| match t.inner {
            naga::TypeInner::Struct { span, .. } => span as usize,
            _ => 0,
        });
        assert_eq!(size, Some(size_of::<StepUniform>()), "{name}: size of Step");
        seen += 1;
    }
    println!("{seen} permutations");
    assert_eq!(seen, 96);
    // Negative control: without its prelude no kernel is valid.
    assert!(naga::front::wgsl::parse_str(&shaders::source("net.add", "")).is_err());
}
