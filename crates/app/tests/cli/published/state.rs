//! State dicts whose numbers follow from their names, as `weights-format/fixtures/published.py`
//! makes them.

use std::collections::BTreeMap;

/// Tensors by key: type, shape, values as they will be written.
pub type State = BTreeMap<String, (&'static str, Vec<usize>, Vec<f32>)>;

/// `count` numbers in [0, 1) that belong to `name`.
pub fn hashes(name: &str, count: usize) -> Vec<f32> {
    let seed = name.bytes().fold(0x811c_9dc5u32, |s, b| (s ^ u32::from(b)).wrapping_mul(0x0100_0193));
    let hash = |n: usize| {
        let mut v = (n as u32).wrapping_mul(0x9e37_79b1).wrapping_add(seed);
        v = (v ^ (v >> 16)).wrapping_mul(0x85eb_ca6b);
        v = (v ^ (v >> 13)).wrapping_mul(0xc2b2_ae35);
        ((v ^ (v >> 16)) >> 8) as f32 / 16_777_216.0
    };
    (0..count).map(hash).collect()
}

fn insert(state: &mut State, name: &str, shape: &[usize]) {
    let number = |u: f32| match shape {
        [_, channels, ..] => (u - 0.5) * (4.0 / f64::from((channels * 16) as f32).sqrt()) as f32,
        _ if name.ends_with("running_mean") => (u - 0.5) * 0.25,
        _ if name.ends_with("weight") || name.ends_with("running_var") => u + 0.5,
        _ => u - 0.5,
    };
    let values = hashes(name, shape.iter().product()).into_iter().map(number).collect();
    state.insert(name.into(), ("F32", shape.into(), values));
}

fn norm(state: &mut State, module: &str, channels: usize, statistics: bool) {
    insert(state, &format!("{module}.weight"), &[channels]);
    insert(state, &format!("{module}.bias"), &[channels]);
    if statistics {
        insert(state, &format!("{module}.running_mean"), &[channels]);
        insert(state, &format!("{module}.running_var"), &[channels]);
        state.insert(format!("{module}.num_batches_tracked"), ("I64", vec![], vec![3.0]));
    }
}

const TIMES: [usize; 8] = [1, 2, 4, 8, 8, 8, 8, 8];

/// State of the generator of `arch` with `norm_name` and base width `width`.
pub fn state(arch: &str, norm_name: &str, width: usize) -> State {
    let out = TIMES.map(|t| t * width);
    let mut state = State::new();
    let into = |i: usize| if i == 0 { 12 } else { out[i - 1] };
    let below = |i: usize| if i == 0 { out[7] } else { 2 * out[7 - i] };
    if arch == "pix2pix" {
        for (i, own) in out.into_iter().enumerate() {
            insert(&mut state, &format!("down{}.model.0.weight", i + 1), &[own, into(i), 4, 4]);
            if i > 0 && i < 7 {
                norm(&mut state, &format!("down{}.model.1", i + 1), own, norm_name == "batch");
            }
        }
        for i in 0..7 {
            insert(&mut state, &format!("up{}.model.0.weight", i + 1), &[below(i), out[6 - i], 4, 4]);
            norm(&mut state, &format!("up{}.model.1", i + 1), out[6 - i], norm_name == "batch");
        }
        insert(&mut state, "final.2.weight", &[3, 2 * width, 4, 4]);
        insert(&mut state, "final.2.bias", &[3]);
        return state;
    }
    for i in 0..8 {
        insert(&mut state, &format!("conv{}.weight", i + 1), &[out[i], into(i), 4, 4]);
        insert(&mut state, &format!("conv{}.bias", i + 1), &[out[i]]);
        let own = if i < 7 { out[6 - i] } else { 3 };
        insert(&mut state, &format!("deconv{}.weight", i + 1), &[below(i), own, 4, 4]);
        insert(&mut state, &format!("deconv{}.bias", i + 1), &[own]);
    }
    for (times, name) in [(1, "batch_norm"), (2, "batch_norm2"), (4, "batch_norm4"), (8, "batch_norm8")] {
        norm(&mut state, name, times * width, true);
    }
    state
}

/// The state dict as a safetensors file.
pub fn bytes(state: &State) -> Vec<u8> {
    let (mut header, mut data) = (String::from("{\"__metadata__\":{\"format\":\"pt\"}"), Vec::new());
    for (name, (dtype, shape, values)) in state {
        let from = data.len();
        for v in values {
            match *dtype {
                "I64" => data.extend((*v as i64).to_le_bytes()),
                "F16" => data.extend(half::f16::from_f32(*v).to_le_bytes()),
                "BF16" => data.extend(half::bf16::from_f32(*v).to_le_bytes()),
                "F64" => data.extend(f64::from(*v).to_le_bytes()),
                _ => data.extend(v.to_le_bytes()),
            }
        }
        let to = data.len();
        header.push_str(&format!(
            ",\"{name}\":{{\"dtype\":\"{dtype}\",\"shape\":{shape:?},\"data_offsets\":[{from},{to}]}}"
        ));
    }
    header.push('}');
    [&(header.len() as u64).to_le_bytes()[..], header.as_bytes(), &data].concat()
}
