//! The planner: totals against counts by hand, fusion, and memory that no two living tensors share.

use bouncelight::net::format::Weights;
use bouncelight::net::gpu::{Choice, Facts, Kernel, KernelConfig, Source, Tuned, Variant};
use bouncelight::net::graph::{
    Activation, Add, AddAt, Concat, Conv2d, Graph, GraphError, Op, Padding, Shape, Upsample,
};
use bouncelight::net::plan::{ALIGN, Kind, Options, Plan, PlanError, Precision, Step, Tensor};
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
        padding: Padding::all(edge / 2),
        groups: 1,
        bias: true,
        activation: Activation::Relu,
        add: None,
        add_at: AddAt::default(),
    })
}

fn up(name: &str, input: &str, size_as: &str) -> Op {
    let (input, size_as) = (input.into(), Some(size_as.into()));
    Op::UpsampleBilinear(Upsample { name: name.into(), input, size_as, scale: None, output: name.into() })
}

fn add(name: &str, a: &str, b: &str, activation: Activation) -> Op {
    Op::Add(Add { name: name.into(), inputs: [a.into(), b.into()], output: name.into(), activation })
}

fn graph(input_channels: u32, ops: Vec<Op>) -> Graph {
    let output = ops.last().unwrap().output().to_string();
    Graph { input_channels, ops, output }
}

/// The tensor whose values `tensor` has, past dropout that is off and functions that do nothing.
fn origin<'a>(graph: &'a Graph, tensor: &'a str) -> &'a str {
    let made = graph.ops.iter().find(|op| op.output() == tensor);
    match made {
        Some(Op::Dropout(o)) => origin(graph, &o.input),
        Some(Op::Activation(o)) if o.activation == Activation::None => origin(graph, &o.input),
        _ => tensor,
    }
}

/// `whole` is a concatenation of which `part` is a part.
fn is_part(graph: &Graph, part: &str, whole: &str) -> bool {
    let part = part.trim_end_matches(".fitted");
    graph.ops.iter().any(|op| match op {
        Op::Concat(o) if o.output == whole => {
            o.inputs.iter().any(|i| i == part || origin(graph, i) == part || is_part(graph, part, origin(graph, i)))
        }
        _ => false,
    })
}

/// Bytes of a tensor from its first to its last value, and which vectors of a pixel are its own.
fn extent(plan: &Plan, t: &Tensor) -> (u64, u64) {
    let pixels = t.shape.pixels();
    let vectors = (pixels - 1) * u64::from(t.pitch) + u64::from(t.shape.vectors());
    let root = &plan.tensors[t.root];
    assert_eq!(t.offset, root.offset + u64::from(t.slice) * t.vector_bytes());
    assert!(t.slice + t.shape.vectors() <= root.shape.vectors() && t.pitch == root.shape.vectors());
    (t.offset, t.offset + vectors * t.vector_bytes())
}

/// No two tensors that live at one time share bytes, except a step that overwrites what it reads,
/// and a part of a concatenation.
fn check_memory(graph: &Graph, plan: &Plan) {
    for (i, a) in plan.tensors.iter().enumerate() {
        assert_eq!(plan.tensors[a.root].offset % ALIGN, 0);
        let [from, to] = <[u64; 2]>::from(extent(plan, a));
        assert!(from >= plan.zero_bytes && to <= plan.arena_bytes);
        for (j, b) in plan.tensors.iter().enumerate().skip(i + 1) {
            let [other_from, other_to] = <[u64; 2]>::from(extent(plan, b));
            let beside =
                a.root == b.root && (a.slice + a.shape.vectors() <= b.slice || b.slice + b.shape.vectors() <= a.slice);
            let apart = to <= other_from || other_to <= from || beside;
            let in_place = plan.steps.iter().enumerate().any(|(time, s)| {
                let elementwise = matches!(s.kind, Kind::Copy | Kind::Scale { .. });
                let skip = s.skip == Some(i) && (s.input != i || elementwise);
                let read = skip || s.input == i && elementwise;
                s.output == j && read && a.last == time + 1 && b.first == time + 1 && a.offset == b.offset
            });
            let handed_over = a.root == b.root && (a.last <= b.first || b.last <= a.first);
            let part = is_part(graph, &a.name, &b.name) || is_part(graph, &b.name, &a.name);
            let alive_together = a.first <= b.last && b.first <= a.last;
            assert!(
                apart || in_place || handed_over || part || !alive_together,
                "{} and {} share memory while both live",
                a.name,
                b.name
            );
        }
    }
    let sum: u64 = plan.tensors.iter().map(|t| t.bytes().next_multiple_of(ALIGN)).sum();
    assert!(plan.arena_bytes <= plan.zero_bytes + sum);
    for (time, step) in plan.steps.iter().enumerate().map(|(i, s)| (i + 1, s)) {
        // Number, mean and squares of each tile and channel; mean, scale and shift of each channel.
        let [input, output] = [step.input, step.output].map(|t| plan.tensors[t].shape);
        match step.kind {
            Kind::Moments => assert_eq!(output.vectors(), 3 * input.vectors()),
            Kind::Merge { .. } => {
                let picture = step.second.unwrap();
                assert_eq!(output.vectors(), 3 * plan.tensors[picture].shape.vectors());
                // The moments are those of the picture, taken once.
                let of = |s: &&Step| match s.kind {
                    Kind::Moments => s.output == step.input && s.input == picture,
                    _ => s.moments == Some(step.input) && s.output == picture,
                };
                assert_eq!(plan.steps[..time - 1].iter().filter(of).count(), 1, "{}", step.name);
            }
            _ => {}
        }
        if let Some(moments) = step.moments {
            let tensor = &plan.tensors[moments];
            assert_eq!(tensor.shape.vectors(), 3 * output.vectors());
            assert!(
                tensor.full && tensor.first == time && matches!(step.kind, Kind::Conv { .. } | Kind::Transposed { .. })
            );
        }
        for read in step.reads() {
            // Only these kernels read 32 bits out of an arena of 16.
            let wide = plan.precision == Precision::F16 && plan.tensors[read].full && step.second != Some(read);
            let reads_wide =
                matches!(step.kind, Kind::Window { .. } | Kind::Scale { fixed: true } | Kind::Merge { .. });
            assert!(!wide || reads_wide, "{} is read by {}", plan.tensors[read].name, step.name);
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
    check_memory(&graph, &plan);
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
    let sums = graph(4, body(Activation::None));
    let plan = Plan::new(&sums, 9, 5).unwrap();
    assert_eq!(plan.steps.len(), 2);
    assert_eq!((plan.steps[1].add_at, plan.steps[1].activation), (AddAt::AfterActivation, Activation::Relu));
    check_memory(&sums, &plan);
    // ReLU inside and outside: the epilogue has one activation, so the sum stays a step.
    let sums = graph(4, body(Activation::Relu));
    let plan = Plan::new(&sums, 9, 5).unwrap();
    assert_eq!((plan.steps.len(), plan.steps[2].kind), (3, Kind::Copy));
    check_memory(&sums, &plan);
    // Both summands are read again later.
    let mut ops = body(Activation::None);
    ops.push(add("t", "b", "s", Activation::None));
    ops.push(add("u", "a", "t", Activation::None));
    let sums = graph(4, ops);
    let plan = Plan::new(&sums, 9, 5).unwrap();
    assert_eq!(plan.steps.len(), 5);
    check_memory(&sums, &plan);
}

/// A batch norm that is not folded rounds once, as one that is: what it alone reads of a
/// convolution stays in 32 bits.
#[test]
fn what_a_batch_norm_reads_is_not_rounded() {
    let norm = serde_json::json!({"name": "n", "input": "a", "output": "n", "channels": 4});
    let norm = Op::parse("batch_norm", norm).unwrap().unwrap();
    let alone = graph(4, vec![conv("a", "input", "a", [4, 4], 3, 1), norm.clone(), conv("b", "n", "b", [4, 4], 3, 1)]);
    let options = Options { fuse: false, precision: Precision::F16, ..Options::default() };
    let full = |graph: &Graph| {
        let plan = Plan::with(graph, 9, 5, &options).unwrap();
        check_memory(graph, &plan);
        ["a", "n"].map(|name| plan.tensors.iter().find(|t| t.name == name).unwrap().full)
    };
    assert_eq!(full(&alone), [true, false]);
    // Somebody else reads it too, and would not know.
    let shared = graph(4, vec![conv("a", "input", "a", [4, 4], 3, 1), norm, conv("b", "a", "b", [4, 4], 3, 1)]);
    assert_eq!(full(&shared), [false, false]);
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

/// A random graph: each operator reads tensors made before it; sums and concatenations only where
/// sizes agree.
fn random_graph(choices: &[(u8, u8, u8)], [width, height]: [u32; 2]) -> Graph {
    let mut graph = Graph { input_channels: 3, ops: Vec::new(), output: String::new() };
    let mut made = vec![("input".to_string(), Shape { channels: 3, height, width })];
    for (i, (kind, a, b)) in choices.iter().enumerate() {
        let name = format!("t{i}");
        let (from, shape) = made[*a as usize % made.len()].clone();
        let channels = shape.channels;
        let of_size = |m: &&(String, Shape)| (m.1.width, m.1.height) == (shape.width, shape.height);
        let beside = made.iter().filter(of_size).nth(*b as usize % 3).cloned();
        let partner = made.iter().filter(|m| m.1 == shape).nth(*b as usize % 3).cloned();
        let activation =
            [Activation::None, Activation::Relu, Activation::LeakyRelu(0.2), Activation::Exp][*b as usize % 4];
        let json = |rest: serde_json::Value| {
            let mut fields = serde_json::json!({"name": name, "input": from, "output": name});
            fields.as_object_mut().unwrap().extend(rest.as_object().unwrap().clone());
            let op = fields.as_object_mut().unwrap().remove("op").unwrap();
            Op::parse(op.as_str().unwrap(), fields).unwrap().unwrap()
        };
        let even = channels % 2 == 0;
        let op = match (kind % 15, partner, beside) {
            (0 | 1, ..) => conv(&name, &from, &name, [channels, 1 + u32::from(*b) % 12], 3, 1),
            (2, ..) => conv(&name, &from, &name, [channels, channels], 3, 2),
            (3, ..) => up(&name, &from, &made[*b as usize % made.len()].0),
            (4 | 5, Some(other), _) => add(&name, &from, &other.0, activation),
            (6 | 7, _, Some(other)) => {
                Op::Concat(Concat { name: name.clone(), inputs: vec![from, other.0], output: name.clone() })
            }
            (8, ..) => {
                json(serde_json::json!({"op": "group_norm", "channels": channels, "groups": if even { 2 } else { 1 },
                    "activation": activation}))
            }
            (9, ..) => json(serde_json::json!({"op": "batch_norm", "channels": channels})),
            (10, ..) => json(serde_json::json!({"op": "activation", "activation": activation})),
            (11, ..) => json(serde_json::json!({"op": "dropout", "p": 0.5})),
            (12, ..) if shape.width.max(shape.height) < 100 => {
                json(serde_json::json!({"op": "upsample_nearest", "scale": 2}))
            }
            (13, ..) => json(serde_json::json!({"op": "pad", "padding": [1, 0, b % 3, 2]})),
            (14, ..) if shape.width.max(shape.height) < 100 => {
                json(serde_json::json!({"op": "conv_transpose2d", "in_channels": channels, "out_channels": 8,
                    "kernel": [4, 4], "stride": 2, "padding": 1, "bias": false}))
            }
            _ => conv(&name, &from, &name, [channels, 5], 1, 1),
        };
        graph.ops.push(op);
        graph.output = name.clone();
        match graph.shapes(width, height) {
            Ok(shapes) => made.push((name, *shapes.last().unwrap())),
            // More channels than there may be.
            Err(_) => drop(graph.ops.pop()),
        }
    }
    graph.output = made.last().unwrap().0.clone();
    graph
}

/// A convolution measures what it makes for the norm that reads it; anything else is read again.
#[test]
fn norms_are_measured_where_their_input_is_made() {
    let norm = |name: &str, input: &str, groups: u32| {
        let fields = serde_json::json!({"name": name, "input": input, "output": name, "channels": 4, "groups": groups});
        Op::parse("group_norm", fields).unwrap().unwrap()
    };
    let count = |ops: Vec<Op>, fuse: bool| {
        let graph = graph(4, ops);
        let plan = Plan::with(&graph, 70, 50, &Options { fuse, ..Options::default() }).unwrap();
        check_memory(&graph, &plan);
        let moments = plan.steps.iter().filter(|s| s.kind == Kind::Moments).count();
        let told = plan.rows().iter().filter(|r| r.kind.ends_with(" + moments")).count();
        assert_eq!(told, plan.steps.iter().filter(|s| s.moments.is_some()).count());
        [moments, told]
    };
    let conv = |name: &str, input: &str| conv(name, input, name, [4, 4], 3, 1);
    assert_eq!(count(vec![conv("a", "input"), norm("n", "a", 2)], true), [0, 1]);
    assert_eq!(count(vec![conv("a", "input"), norm("n", "a", 2)], false), [1, 0]);
    // Two norms of one picture share what was measured.
    let two = vec![conv("a", "input"), norm("n", "a", 2), norm("m", "a", 1), add("s", "n", "m", Activation::None)];
    assert_eq!(count(two, true), [0, 1]);
    // The input, and the result of another norm, nobody measures.
    assert_eq!(count(vec![norm("n", "input", 2), norm("m", "n", 1), conv("a", "m")], true), [2, 0]);
    // A resampling that is not fused stands between.
    let between = vec![conv("a", "input"), up("u", "a", "a"), norm("n", "u", 2)];
    assert_eq!(count(between, true), [1, 0]);
}

/// Every kernel's tiles find room, whatever the picture.
#[test]
fn moments_of_every_kernel_fit() {
    let conv = |kernel: u32, stride: u32, groups: u32| {
        serde_json::json!({"op": "conv2d", "name": "c", "input": "n", "output": "c", "in_channels": 8,
            "out_channels": 20,
            "kernel": [kernel, kernel], "stride": stride, "padding": kernel / 2, "groups": groups})
    };
    let up = |kernel: u32, stride: u32| {
        serde_json::json!({"op": "conv_transpose2d", "name": "c", "input": "n", "output": "c", "in_channels": 8,
            "out_channels": 20, "kernel": [kernel, kernel], "stride": stride})
    };
    let layers = [conv(3, 1, 1), conv(1, 1, 1), conv(4, 2, 1), conv(3, 1, 4), up(4, 2), up(2, 3), up(7, 4)];
    let sizes = [[1, 1], [1, 200], [200, 1], [37, 29], [2, 77], [64, 64], [500, 3], [16, 16], [33, 4]];
    let (mut seen, mut tight) = (0, 0);
    for (layer, nearest) in layers.into_iter().flat_map(|l| [(l.clone(), 1), (l, 2)]) {
        let parse = |mut fields: serde_json::Value| {
            let kind = fields.as_object_mut().unwrap().remove("op").unwrap();
            Op::parse(kind.as_str().unwrap(), fields).unwrap().unwrap()
        };
        let enlarge = serde_json::json!({"op": "upsample_nearest", "name": "n", "input": "input", "output": "n",
            "scale": nearest});
        let norm = serde_json::json!({"op": "instance_norm", "name": "y", "input": "c", "output": "y", "channels": 20});
        let graph = graph(8, [enlarge, layer, norm].map(parse).to_vec());
        for [width, height] in sizes {
            for precision in [Precision::F32, Precision::F16] {
                let Ok(plan) = Plan::with(&graph, width, height, &Options { precision, ..Options::default() }) else {
                    continue;
                };
                let step = plan.steps.iter().find(|s| s.moments.is_some()).unwrap();
                let room = plan.tensors[step.moments.unwrap()].shape.width;
                let ways = [Source::Uniform, Source::Storage, Source::Staged].into_iter();
                let ways = ways.flat_map(|w| (1..=4).map(move |v| KernelConfig::new(w, v)));
                let cut = ways.clone().map(|p| KernelConfig { parts: 2, ..p });
                let variants = ways.chain(cut).map(Variant::Fixed).chain([Variant::Auto, Variant::Plain]);
                for (variant, software) in variants.flat_map(|v| [(v, true), (v, false)]) {
                    let facts = Facts { software, half: true };
                    let choice = Choice { variant, tuned: &Tuned::new(), facts };
                    let kernel = Kernel::choose(&plan, step, &choice);
                    assert!(
                        (1..=room).contains(&kernel.tiles()),
                        "{variant:?} {width}×{height}: {} of {room}",
                        kernel.tiles()
                    );
                    let merge = plan.steps.iter().find(|s| matches!(s.kind, Kind::Merge { .. })).unwrap();
                    assert_eq!(Kernel::choose(&plan, merge, &choice).tiles(), kernel.tiles());
                    seen += 1;
                    tight += usize::from(kernel.tiles() == room);
                }
            }
        }
    }
    // Negative control: less room would not do.
    assert!(seen > 10_000 && tight > 100, "{seen} {tight}");
}

proptest! {
    #[test]
    fn living_tensors_never_overlap(
        choices in prop::collection::vec(any::<(u8, u8, u8)>(), 1..24), width in 1u32..70, height in 1u32..70,
        fuse in any::<bool>(), half in any::<bool>(), dropout in any::<bool>(),
    ) {
        let graph = random_graph(&choices, [width, height]);
        prop_assume!(!graph.ops.is_empty());
        let precision = if half { Precision::F16 } else { Precision::F32 };
        let options = Options { fuse, precision, dropout, ..Options::default() };
        let Ok(plan) = Plan::with(&graph, width, height, &options) else { return Ok(()) };
        check_memory(&graph, &plan);
        let [w, h] = plan.inner;
        prop_assert!(w >= width && h >= height);
        prop_assert_eq!(plan.flops(), graph.flops(w, h).unwrap());
        let output = &plan.tensors[plan.output];
        prop_assert!(output.full && output.root == plan.output);
        let whole = *graph.shapes(w, h).unwrap().iter().zip(&graph.ops).find(|(_,
            op)| op.output() == graph.output).unwrap().0;
        let kept = [Graph::cropped(whole.width, width, w), Graph::cropped(whole.height, height, h)];
        prop_assert_eq!([output.shape.width, output.shape.height], kept);
        prop_assert_eq!(output.shape.channels, whole.channels);
    }
}

#[test]
fn the_shipped_filter_is_modelled_within_a_millisecond() {
    use bouncelight_lab::study::projection::{Cost, GTX_1050, modelled};
    let weights = Weights::shipped().expect("it is whole");
    let ms = |precision, packed_input| {
        let options = Options { precision, packed_input, ..Options::default() };
        let plan = Plan::with(&weights.graph, 256, 128, &options).expect("it fits");
        let costs: Vec<Cost> = plan.steps.iter().map(|s| Cost::of_step(&plan, s, &s.name)).collect();
        // Equal taps of an enlarged input are added up beforehand.
        let done: f64 = costs.iter().map(|c| c.flops).sum();
        assert!(done < 0.75 * plan.flops() as f64, "{done} of {}", plan.flops());
        modelled(&costs, &GTX_1050).ms
    };
    let [full, half, packed] = [(Precision::F32, false), (Precision::F16, false), (Precision::F16, true)]
        .map(|(precision, packed)| ms(precision, packed));
    println!("{full:.3} ms in 32 bits, {half:.3} in 16 with an input of 32, {packed:.3} with one of 16");
    assert!(packed < 0.9, "{packed}");
    // Negative control: what it takes as other networks run.
    assert!(full > 0.9 && half > packed, "{full} {half}");
}
