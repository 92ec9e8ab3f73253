//! The planner: totals against counts by hand, fusion, and memory that no two living tensors share.

use bouncelight::net::format::Weights;
use bouncelight::net::graph::{Activation, Add, AddAt, Conv2d, Graph, GraphError, Op, UpsampleBilinear};
use bouncelight::net::plan::{ALIGN, Kind, Plan, PlanError};
use proptest::prelude::*;

fn conv(name: &str, input: &str, output: &str, [i, o]: [u32; 2], edge: u32, stride: u32) -> Op {
    Op::Conv2d(Conv2d {
        name: name.into(),
        input: input.into(),
        output: output.into(),
        in_channels: i,
        out_channels: o,
        kernel: [edge, edge],
        stride,
        padding: edge / 2,
        activation: Activation::Relu,
        add: None,
        add_at: AddAt::default(),
    })
}

fn up(name: &str, input: &str, size_as: &str) -> Op {
    let [input, size_as] = [input, size_as].map(String::from);
    Op::UpsampleBilinear(UpsampleBilinear { name: name.into(), input, size_as, output: name.into() })
}

fn add(name: &str, a: &str, b: &str, activation: Activation) -> Op {
    Op::Add(Add { name: name.into(), inputs: [a.into(), b.into()], output: name.into(), activation })
}

fn graph(input_channels: u32, ops: Vec<Op>) -> Graph {
    let output = ops.last().unwrap().output().to_string();
    Graph { input_channels, ops, output }
}

/// No two tensors that live at one time share bytes, except a sum that overwrites its skip in place.
fn check_memory(plan: &Plan) {
    for (i, a) in plan.tensors.iter().enumerate() {
        assert_eq!(a.offset % ALIGN, 0);
        assert!(a.offset >= plan.zero_bytes && a.offset + a.shape.padded_bytes() <= plan.arena_bytes);
        for (j, b) in plan.tensors.iter().enumerate().skip(i + 1) {
            let apart = a.offset + a.shape.padded_bytes() <= b.offset || b.offset + b.shape.padded_bytes() <= a.offset;
            let in_place = plan.steps.iter().any(|s| {
                s.output == j && s.skip == Some(i) && s.input != i && a.last == b.first && a.offset == b.offset
            });
            let alive_together = a.first <= b.last && b.first <= a.last;
            assert!(apart || in_place || !alive_together, "{} and {} share memory while both live", a.name, b.name);
        }
    }
    let sum: u64 = plan.tensors.iter().map(|t| t.shape.padded_bytes().next_multiple_of(ALIGN)).sum();
    assert!(plan.arena_bytes <= plan.zero_bytes + sum);
    for (time, step) in plan.steps.iter().enumerate().map(|(i, s)| (i + 1, s)) {
        for read in std::iter::once(step.input).chain(step.skip) {
            assert!(plan.tensors[read].first < time && plan.tensors[read].last >= time);
        }
    }
}

#[test]
fn the_compact_network_counted_by_hand() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/weights-format/fixtures/unet.safetensors");
    let graph = Weights::load(path.as_ref()).unwrap().graph;
    let plan = Plan::new(&graph, 256, 128).unwrap();
    let [p0, p1, p2, p3] = [32768u64, 8192, 2048, 512];
    let convs = p0 * 9 * (21 * 16 + 16 * 16 + 16 * 16 + 16 * 3)
        + p1 * (9 * (16 * 24 + 24 * 24 + 24 * 24) + 24 * 16)
        + p2 * (9 * (24 * 32 + 32 * 32 + 32 * 32) + 32 * 24)
        + p3 * (9 * (32 * 48 + 2 * 48 * 48) + 48 * 32);
    let ups = 9 * (p0 * 16 + p1 * 24 + p2 * 32);
    assert_eq!(plan.flops(), 2 * convs + ups);
    assert_eq!(graph.flops(256, 128).unwrap(), plan.flops());
    let weights = 9
        * (21 * 16 + 16 * 16 * 2 + 16 * 3 + 16 * 24 + 24 * 24 * 2 + 24 * 32 + 32 * 32 * 2 + 32 * 48 + 48 * 48 * 2)
        + 24 * 16
        + 32 * 24
        + 48 * 32;
    let biases = 16 * 2 + 24 * 2 + 32 * 2 + 48 * 3 + 32 * 2 + 24 * 2 + 16 * 2 + 3;
    assert_eq!(graph.parameters(), weights + biases);
    // Three skips are fused into the upsampling before them.
    assert_eq!((graph.ops.len(), plan.steps.len()), (22, 19));
    assert_eq!(plan.steps.iter().filter(|s| s.kind == Kind::Upsample && s.skip.is_some()).count(), 3);
    check_memory(&plan);
    let sum: u64 = plan.tensors.iter().map(|t| t.shape.padded_bytes()).sum();
    println!("arena {} bytes of {sum} without sharing", plan.arena_bytes);
    // Input and first layer live together, so this is the least there can be (but for the zeros).
    assert_eq!(plan.arena_bytes - plan.zero_bytes, p0 * 4 * (24 + 16));
}

#[test]
fn sums_fuse_where_they_may() {
    let body = |activation| {
        vec![conv("a", "input", "a", [4, 4], 3, 1), conv("b", "a", "b", [4, 4], 3, 1), add("s", "a", "b", activation)]
    };
    let plan = Plan::new(&graph(4, body(Activation::None)), 9, 5).unwrap();
    assert_eq!(plan.steps.len(), 2);
    assert_eq!((plan.steps[1].add_at, plan.steps[1].activation), (AddAt::AfterActivation, Activation::Relu));
    check_memory(&plan);
    // ReLU inside and outside: the epilogue has one activation, so the sum stays a step.
    let plan = Plan::new(&graph(4, body(Activation::Relu)), 9, 5).unwrap();
    assert_eq!((plan.steps.len(), plan.steps[2].kind), (3, Kind::Copy));
    check_memory(&plan);
    // Both summands are read again later.
    let mut ops = body(Activation::None);
    ops.push(add("t", "b", "s", Activation::None));
    ops.push(add("u", "a", "t", Activation::None));
    let plan = Plan::new(&graph(4, ops), 9, 5).unwrap();
    assert_eq!(plan.steps.len(), 5);
    check_memory(&plan);
}

#[test]
fn errors_name_the_operator() {
    let two = graph(4, vec![conv("a", "input", "a", [4, 4], 3, 2), add("s", "a", "input", Activation::None)]);
    let error = Plan::new(&two, 8, 8).unwrap_err();
    assert!(matches!(&error, PlanError::Graph { source: GraphError::Sizes { op, .. }, .. } if op == "s"), "{error}");
    let one = graph(4, vec![conv("a", "input", "a", [4, 4], 3, 1)]);
    assert!(Plan::new(&one, 0, 8).is_err() && Plan::new(&one, 8, u32::MAX).is_err());
    let error = Plan::new(&one, 16384, 16384).unwrap_err();
    assert!(matches!(error, PlanError::TooLarge { .. }), "{error}");
}

/// A random graph: each operator reads tensors made before it; sums only where shapes agree.
fn random_graph(choices: &[(u8, u8, u8)]) -> Graph {
    let mut ops: Vec<Op> = Vec::new();
    // Name, channels, level of halving.
    let mut made = vec![("input".to_string(), 3u32, 0u32)];
    for (i, (kind, a, b)) in choices.iter().enumerate() {
        let name = format!("t{i}");
        let (from, channels, level) = made[*a as usize % made.len()].clone();
        let partner = made.iter().filter(|m| m.1 == channels && m.2 == level).nth(*b as usize % 3).cloned();
        let (op, channels, level) = match (kind % 5, partner) {
            (0, _) => {
                (conv(&name, &from, &name, [channels, 1 + u32::from(*b) % 9], 3, 1), 1 + u32::from(*b) % 9, level)
            }
            (1, _) if level < 3 => (conv(&name, &from, &name, [channels, channels], 3, 2), channels, level + 1),
            (2, _) => {
                let target = made[*b as usize % made.len()].clone();
                (up(&name, &from, &target.0), channels, target.2)
            }
            (_, Some(other)) => {
                let activation = if b % 2 == 0 { Activation::None } else { Activation::Relu };
                (add(&name, &from, &other.0, activation), channels, level)
            }
            _ => (conv(&name, &from, &name, [channels, 5], 1, 1), 5, level),
        };
        ops.push(op);
        made.push((name, channels, level));
    }
    graph(3, ops)
}

proptest! {
    #[test]
    fn living_tensors_never_overlap(
        choices in prop::collection::vec(any::<(u8, u8, u8)>(), 1..24), width in 1u32..70, height in 1u32..70,
    ) {
        let graph = random_graph(&choices);
        let plan = Plan::new(&graph, width, height).unwrap();
        check_memory(&plan);
        prop_assert_eq!(plan.flops(), graph.flops(width, height).unwrap());
        prop_assert!(plan.steps.len() <= graph.ops.len());
        prop_assert_eq!(&plan.tensors[plan.output].name, &graph.output);
    }
}
