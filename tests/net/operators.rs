//! Every operator: PyTorch ↔ CPU twin ↔ kernels, fused and unfused, in 32 and 16 bits.

use crate::hashed::{self, cases, graphs};
use crate::{common, run_gpu};
use bouncelight::net::cpu;
use bouncelight::net::gpu::{Options, Variant};
use bouncelight::net::op_facts::KINDS;
use bouncelight::net::plan::Precision;
use std::collections::BTreeSet;

pub const TOLERANCE: f32 = 1e-4;
pub const TOLERANCE_HALF: f32 = 5e-3;

#[test]
fn the_cpu_twin_agrees_with_pytorch_on_every_operator() {
    let (cases, metadata) = cases("operators.safetensors");
    let graphs = graphs(&metadata.unwrap());
    assert_eq!(graphs.keys().collect::<Vec<_>>(), cases.keys().collect::<Vec<_>>());
    let mut worst = (0f32, String::new());
    for (name, graph) in &graphs {
        let weights = hashed::network(graph);
        for case in &cases[name] {
            let input = hashed::input(name, graph.input_channels, case.size);
            let e = case.error(&cpu::run(&weights, &input).unwrap());
            assert!(e <= TOLERANCE, "{name} {:?}: relative error {e}", case.size);
            worst = if e > worst.0 { (e, name.clone()) } else { worst };
        }
    }
    let kinds: BTreeSet<&str> = graphs.values().flat_map(|g| &g.ops).map(|op| op.kind()).collect();
    assert_eq!(kinds, KINDS.into_iter().collect(), "every operator is in some graph");
    println!("{} graphs, {} cases, worst {worst:?}", graphs.len(), cases.values().map(Vec::len).sum::<usize>());
}

#[test]
fn the_kernels_agree_on_every_operator() {
    let Some(gpu) = common::gpu() else { return };
    let (cases, metadata) = cases("operators.safetensors");
    let graphs = graphs(&metadata.unwrap());
    let full = Options::default();
    let half = Options { precision: Precision::F16, ..full };
    let ways = [
        (full, TOLERANCE, 3),
        (Options { fuse: false, ..full }, TOLERANCE, 1),
        (Options { variant: Variant::Plain, ..full }, TOLERANCE, 1),
        (half, TOLERANCE_HALF, 1),
        (Options { fuse: false, variant: Variant::Plain, ..half }, TOLERANCE_HALF, 1),
    ];
    let mut faults = Vec::new();
    for (options, tolerance, sizes) in ways {
        let mut worst = (0f32, String::new());
        for (name, graph) in &graphs {
            let weights = hashed::network(graph);
            for case in cases[name].iter().rev().take(sizes) {
                let input = hashed::input(name, graph.input_channels, case.size);
                let found = run_gpu(&gpu, &weights, &input, options);
                let twin = cpu::run(&weights, &input).unwrap();
                let e = case.error(&found).max(hashed::error(&found.data, &twin.data));
                if e > tolerance || found.shape != twin.shape {
                    faults.push(format!("{name} {:?} {options:?}: relative error {e}", case.size));
                }
                worst = if e > worst.0 { (e, name.clone()) } else { worst };
            }
        }
        println!("{options:?}: worst {worst:?}");
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

/// Negative control: weights of another name are other weights, and that shows.
#[test]
fn other_weights_are_noticed() {
    let (cases, metadata) = cases("operators.safetensors");
    let graphs = graphs(&metadata.unwrap());
    for name in ["conv4x4_s2", "up4x4_s2", "group_norm", "batch_norm"] {
        let mut graph = graphs[name].clone();
        let text = serde_json::to_string(&graph.ops).unwrap().replace("\"name\":\"", "\"name\":\"x");
        let ops: Vec<serde_json::Value> = serde_json::from_str(&text).unwrap();
        graph.ops = hashed::graphs(&serde_json::json!({name: {"input_channels": graph.input_channels, "ops": ops}}))
            [name]
            .ops
            .clone();
        let case = &cases[name][0];
        let input = hashed::input(name, graph.input_channels, case.size);
        assert!(case.error(&cpu::run(&hashed::network(&graph), &input).unwrap()) > 100.0 * TOLERANCE, "{name}");
    }
}
