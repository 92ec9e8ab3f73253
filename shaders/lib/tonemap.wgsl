// From scene light to display values. src/render/tonemap_curve.rs is the CPU form, same names and
// constants, and says where they come from and how near Blender they stand.

// Display-encoded sRGB in [0, 1] of linear Rec.709 light. kind: 0 filmic, 1 agx, 2 neutral, 3 none
// (sRGB with clamping).
fn tonemap(kind: u32, rgb: vec3f) -> vec3f {
    let light = clamp(rgb, vec3f(0.0), vec3f(65504.0));
    switch kind {
        case 0u: { return tonemap_filmic(light); }
        case 1u: { return tonemap_agx(light); }
        case 2u: { return tonemap_neutral(light); }
        default: { return tonemap_srgb_oetf(light); }
    }
}

fn tonemap_srgb_oetf(linear: vec3f) -> vec3f {
    let v = clamp(linear, vec3f(0.0), vec3f(1.0));
    let power = 1.055 * pow(max(v, vec3f(0.003)), vec3f(1.0 / 2.4)) - 0.055;
    return select(power, 12.92 * v, v <= vec3f(0.0031308));
}

fn tonemap_filmic(light: vec3f) -> vec3f {
    let peak = min(tonemap_max3(light), 5898.24);
    let share = clamp(4.018064e-5 * (pow(max(peak, 1e-9), 1.2161947) - 19.18678), 0.0, 1.0);
    let lifted = light + share * max(vec3f(peak) - light, vec3f(0.0));
    let stops = log2(max(lifted, vec3f(1e-9))) + 12.473931;
    let u = clamp(stops / 8.25 - 1.0, vec3f(-1.0), vec3f(1.0));
    let p = 0.28364078 + u * (0.63562186 + u * (0.5312596 + u * 0.18086761));
    let q = 1.0 + u * (-0.83427715 + u * 1.4648784);
    return clamp(p / q, vec3f(0.0), vec3f(1.0));
}

fn tonemap_agx(light: vec3f) -> vec3f {
    // Columns here, rows in the CPU form.
    let into = mat3x3f(
        vec3f(0.54481476, 0.14041695, 0.08881039),
        vec3f(0.37378736, 0.7541376, 0.17887175),
        vec3f(0.08139789, 0.1054455, 0.73231787),
    );
    let back = mat3x3f(
        vec3f(1.9648874, -0.2993134, -0.16435264),
        vec3f(-0.8559884, 1.326398, -0.23818398),
        vec3f(-0.108899, -0.02708457, 1.4025366),
    );
    let inset = max(into * light, vec3f(1e-10));
    let formed = tonemap_agx_sigmoid(inset);
    // With highest and lowest channel kept, hue is where the middle one lies between them.
    let low0 = tonemap_min3(inset);
    let low = tonemap_min3(formed);
    let span = tonemap_max3(formed) - low;
    let before = (inset - low0) / max(tonemap_max3(inset) - low0, 1e-12);
    let after = (formed - low) / max(span, 1e-12);
    let out = back * (low + span * mix(before, after, vec3f(0.4)));
    let raised = out + max(-tonemap_min3(out), 0.0);
    let scale = min(tonemap_agx_weight(out) / max(tonemap_agx_weight(raised), 1e-9), 1.0);
    return tonemap_srgb_oetf(raised * scale);
}

fn tonemap_agx_sigmoid(v: vec3f) -> vec3f {
    let t = clamp(log2(v / 0.18) / 16.5 + 10.0 / 16.5, vec3f(0.0), vec3f(1.0));
    let a = 2.4 * (t - 10.0 / 16.5);
    let scale = select(vec3f(0.7151983), vec3f(0.5656756), a < vec3f(0.0));
    let h = abs(a) / scale;
    let bend = scale * h / pow(1.0 + h * sqrt(h), vec3f(1.0 / 1.5));
    let encoded = 0.4894371 + select(bend, -bend, a < vec3f(0.0));
    return pow(max(encoded, vec3f(0.0)), vec3f(2.4));
}

fn tonemap_agx_weight(c: vec3f) -> f32 {
    let high = tonemap_max3(c);
    return high - tonemap_min3(c) + dot(vec3f(0.20675949, 0.6581253, 0.1351152), 2.0 * c - high);
}

fn tonemap_neutral(light: vec3f) -> vec3f {
    let low = tonemap_min3(light);
    let offset = select(0.04, low - 6.25 * low * low, low < 0.08);
    let base = light - offset;
    let peak = tonemap_max3(base);
    if (peak < 0.76) {
        return tonemap_srgb_oetf(base);
    }
    let top = 1.0 - 0.0576 / (peak - 0.52);
    let keep = 1.0 / (0.15 * (peak - top) + 1.0);
    return tonemap_srgb_oetf(top + (base * (top / peak) - top) * keep);
}

fn tonemap_max3(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

fn tonemap_min3(v: vec3f) -> f32 {
    return min(v.x, min(v.y, v.z));
}
