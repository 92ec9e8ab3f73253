//! Conversion: every norm, any width, every fault at once.

use super::state::{State, bytes, state};
use bouncelight::net::format::{Dtype, Problem, Provenance, Weights};
use bouncelight_lab::network::convert::published;
use bouncelight_lab::network::convert::{Arch, ConvertError, Norm, Recipe, convert};
use std::path::Path;

pub fn named(name: &str) -> Arch {
    if name == "pix2pix" { Arch::Pix2pix } else { Arch::DeepIllumination }
}

pub fn norm(name: &str) -> Norm {
    match name {
        "group" => Norm::Group,
        "instance" => Norm::Instance,
        _ => Norm::Batch,
    }
}

pub fn converted(state: &State, arch: Arch, norm: Norm, dtype: Dtype) -> Result<Weights, ConvertError> {
    let mut provenance = Provenance::new();
    provenance.insert("seed".into(), 1.into());
    let recipe = Recipe { arch, norm, dtype, name: "test".into(), licence: "CC0-1.0".into(), provenance };
    let written = convert(Path::new("state.safetensors"), &bytes(state), &recipe)?;
    Ok(Weights::from_bytes(&written).expect("what is written is sound"))
}

#[track_caller]
fn faults(state: &State, arch: Arch, norm: Norm) -> Vec<String> {
    match converted(state, arch, norm, Dtype::F32) {
        Err(ConvertError::StateDict { problems, .. }) => problems.iter().map(Problem::to_string).collect(),
        other => panic!("expected a faulty state, got {other:?}"),
    }
}

#[test]
fn the_papers_generator_has_its_size() {
    let graph = published::graph(Arch::Pix2pix, Norm::Group, 64, true);
    assert_eq!(graph.check(), []);
    // 54.41 M in convolutions, the rest in norms.
    assert_eq!(graph.parameters(), 54_413_315 + 9_856);
    // By hand, convolutions at 1024×512: 34.69 GFLOP down, 62.88 up, 6.44 in the last one; norms
    // and the like add 0.2.
    let flops = graph.flops(1024, 512).unwrap() as f64 / 1e9;
    assert!((104.0..104.4).contains(&flops), "{flops} GFLOP");
    let wide = published::graph(Arch::DeepIllumination, Norm::Batch, 128, true);
    assert_eq!(wide.check(), []);
    let shapes = wide.shapes(256, 256).unwrap();
    let last = shapes.last().unwrap();
    assert_eq!((last.channels, last.width, last.height), (3, 256, 256));
}

#[test]
fn any_width_and_norm() {
    for (arch_name, norm_name, width) in [
        ("pix2pix", "group", 2),
        ("pix2pix", "group", 6),
        ("pix2pix", "instance", 3),
        ("pix2pix", "batch", 1),
        ("deep-illumination", "batch", 5),
    ] {
        let from = state(arch_name, norm_name, width);
        let weights = converted(&from, named(arch_name), norm(norm_name), Dtype::F32).unwrap();
        assert_eq!(weights.graph, published::graph(named(arch_name), norm(norm_name), width as u32, true));
        assert_eq!((weights.table.name.as_str(), weights.provenance["seed"].as_u64()), ("images", Some(1)));
        let key = if arch_name == "pix2pix" { "up3.model.0.weight" } else { "deconv3.weight" };
        assert_eq!(weights.tensors()[key].data, from[key].2);
        if arch_name != "pix2pix" {
            for layer in ["conv4", "conv7", "deconv1", "deconv4"] {
                let own = weights.values(&format!("{layer}.batch_norm"), "running_var");
                assert_eq!(own, from["batch_norm8.running_var"].2, "layers of one width share a norm");
            }
        }
    }
}

#[test]
fn numbers_of_other_types() {
    let exact = converted(&state("pix2pix", "group", 2), Arch::Pix2pix, Norm::Group, Dtype::F32).unwrap();
    for (dtype, tolerance) in [("F64", 0.0), ("F16", 1e-3), ("BF16", 8e-3)] {
        let mut from = state("pix2pix", "group", 2);
        from.values_mut().for_each(|t| t.0 = dtype);
        let weights = converted(&from, Arch::Pix2pix, Norm::Group, Dtype::F16).unwrap();
        let [ours, theirs] = [&weights, &exact].map(|w| &w.tensors()["down4.model.0.weight"]);
        assert_eq!((ours.stored, weights.tensors()["final.2.bias"].stored), (Dtype::F16, Dtype::F32));
        for (a, b) in ours.data.iter().zip(&theirs.data) {
            assert!((a - b).abs() <= (tolerance + 5e-4) * b.abs() + 1e-7, "{dtype}: {a} {b}");
        }
    }
}

#[test]
fn states_that_differ_a_little() {
    // DataParallel's prefix.
    let prefixed = state("pix2pix", "group", 2).into_iter().map(|(k, v)| (format!("module.{k}"), v)).collect();
    assert!(converted(&prefixed, Arch::Pix2pix, Norm::Group, Dtype::F32).is_ok());
    // Instance norm without weight and bias is PyTorch's default.
    let mut plain = state("pix2pix", "instance", 2);
    plain.retain(|k, _| !k.contains(".model.1."));
    let weights = converted(&plain, Arch::Pix2pix, Norm::Instance, Dtype::F32).unwrap();
    assert!(weights.values("down3.model.1", "weight").is_empty());
    // A batch norm network as it runs in training mode.
    for (arch_name, norm_name) in [("pix2pix", "batch"), ("deep-illumination", "batch")] {
        let weights = converted(&state(arch_name, norm_name, 2), named(arch_name), Norm::Instance, Dtype::F32).unwrap();
        assert!(weights.tensors().keys().all(|k| !k.contains("running")));
    }
    let refused = converted(&state("deep-illumination", "batch", 2), Arch::DeepIllumination, Norm::Group, Dtype::F32);
    assert!(matches!(refused, Err(ConvertError::NoSuchVariant)));
}

#[test]
fn all_faults_at_once() {
    let mut spoilt = state("pix2pix", "group", 4);
    spoilt.remove("up2.model.1.bias");
    spoilt.insert("discriminator.weight".into(), ("F32", vec![1], vec![0.0]));
    spoilt.insert("down5.model.0.weight".into(), ("F32", vec![32, 31, 4, 4], vec![0.0; 32 * 31 * 16]));
    // The first layer alone says another width; the seven others outvote it.
    spoilt.insert("down1.model.0.weight".into(), ("F32", vec![8, 12, 4, 4], vec![0.0; 8 * 12 * 16]));
    spoilt.get_mut("final.2.bias").unwrap().0 = "I64";
    spoilt.get_mut("up7.model.0.weight").unwrap().2[5] = f32::NAN;
    let found = faults(&spoilt, Arch::Pix2pix, Norm::Group);
    assert_eq!(found.len(), 6, "{found:#?}");
    for words in [
        ["`up2.model.1.bias`", "missing"],
        ["`discriminator.weight`", "no operator"],
        ["`down5.model.0.weight`", "[32, 32, 4, 4]"],
        ["`down1.model.0.weight`", "[4, 12, 4, 4]"],
        ["`final.2.bias`", "I64"],
        ["`up7.model.0.weight`", "index 5"],
    ] {
        assert!(found.iter().any(|f| words.iter().all(|w| f.contains(w))), "{words:?} in {found:#?}");
    }
    // The other architecture lacks everything, in one message.
    assert!(faults(&state("pix2pix", "group", 2), Arch::DeepIllumination, Norm::Batch).len() > 50);
    // Batch norm wants statistics that a group norm network does not have.
    let lacking = faults(&state("pix2pix", "group", 2), Arch::Pix2pix, Norm::Batch);
    assert!(lacking.len() == 26 && lacking.iter().all(|f| f.contains("running_")), "{lacking:#?}");
    // Shared keys are blamed once.
    let mut shared = state("deep-illumination", "batch", 2);
    shared.get_mut("batch_norm8.running_var").unwrap().2[3] = -1.0;
    let found = faults(&shared, Arch::DeepIllumination, Norm::Batch);
    assert!(found.len() == 1 && found[0].contains("`batch_norm8.running_var`"), "{found:#?}");
    let mut huge = state("pix2pix", "group", 2);
    huge.get_mut("down2.model.0.weight").unwrap().2[0] = 1e5;
    assert!(converted(&huge, Arch::Pix2pix, Norm::Group, Dtype::F32).is_ok());
    let error = converted(&huge, Arch::Pix2pix, Norm::Group, Dtype::F16).unwrap_err().to_string();
    assert!(error.contains("65504") && error.contains("`down2.model.0.weight`"), "{error}");
}

#[test]
fn widths_that_cannot_be() {
    // Two groups need an even number of channels.
    assert!(
        faults(&state("pix2pix", "group", 3), Arch::Pix2pix, Norm::Group).iter().any(|f| f.contains("multiple of 2"))
    );
    let mut odd = state("pix2pix", "group", 2);
    odd.insert("down1.model.0.weight".into(), ("F32", vec![1 << 40, 12, 0, 4], vec![]));
    assert!(!faults(&odd, Arch::Pix2pix, Norm::Group).is_empty());
    let only: State = [("down1.model.0.weight".to_string(), ("F32", vec![1 << 40, 0, 4, 4], vec![]))].into();
    assert!(faults(&only, Arch::Pix2pix, Norm::Group).iter().any(|f| f.contains("channels")));
    let weights = std::fs::read(crate::common::root().join("assets/weights/filter.safetensors")).unwrap();
    let recipe = Recipe {
        arch: Arch::Pix2pix,
        norm: Norm::Group,
        dtype: Dtype::F32,
        name: String::new(),
        licence: "CC0-1.0".into(),
        provenance: Provenance::new(),
    };
    assert!(matches!(convert(Path::new("x"), &weights, &recipe), Err(ConvertError::Already { .. })));
}
