//#import lib/frame.wgsl
//#import lib/octahedral.wgsl
//#import lib/screen.wgsl
//#import lib/tonemap.wgsl

// What the window shows: a picture or one of the things it was made from, on both sides of a line
// that can be dragged.

struct Show {
    // Where the picture begins in the window, pixels.
    origin: vec2f,
    // Pixels of the picture left of the line.
    split: f32,
    // Half the width of the line, pixels; 0 for none.
    line: f32,
    // What is shown, numbered as `viewer::View`.
    view: u32,
    // exposure = 2^EV
    exposure: f32,
    kind: u32,
    // 1 where the target encodes sRGB itself.
    linear_target: u32,
    // What sums are multiplied by: left, right.
    scale: vec2f,
    // Pixels that one texel of the picture covers: left, right.
    texel: vec2u,
    // Metres that depth is compared with.
    metres: f32,
    // Display difference that is shown brightest.
    full_error: f32,
    // Texels of a cell and least and greatest value, for network inputs.
    low: f32,
    high: f32,
}

@group(0) @binding(0) var<uniform> frame: Frame;
@group(0) @binding(1) var<uniform> show: Show;
@group(0) @binding(2) var depth_texture: texture_2d<f32>;
@group(0) @binding(3) var normal_texture: texture_2d<f32>;
@group(0) @binding(4) var albedo_texture: texture_2d<f32>;
@group(0) @binding(5) var specular_texture: texture_2d<f32>;
@group(0) @binding(6) var emissive_texture: texture_2d<f32>;
@group(0) @binding(7) var direct_diffuse: texture_2d<f32>;
@group(0) @binding(8) var direct_specular: texture_2d<f32>;
@group(0) @binding(9) var indirect_left: texture_2d<f32>;
@group(0) @binding(10) var indirect_right: texture_2d<f32>;
@group(0) @binding(11) var indirect_specular: texture_2d<f32>;
@group(0) @binding(12) var left: texture_2d<f32>;
@group(0) @binding(13) var right: texture_2d<f32>;
@group(0) @binding(14) var feature: texture_2d<f32>;

@fragment
fn fragment(@builtin(position) position: vec4f) -> @location(0) vec4f {
    let pixel = vec2u(max(position.xy - show.origin, vec2f(0.0)));
    let side = u32(f32(pixel.x) + 0.5 > show.split);
    var shown = display(pixel, side);
    let from_line = abs(f32(pixel.x) + 0.5 - show.split);
    if show.line > 0.0 && from_line < show.line + 1.0 {
        // White with a dark rim is seen on anything.
        shown = select(vec3f(0.0), vec3f(1.0), from_line < show.line);
    }
    return screen_color(shown, show.linear_target);
}

// Display-encoded colour of a pixel.
fn display(pixel: vec2u, side: u32) -> vec3f {
    let depth = textureLoad(depth_texture, pixel, 0).x;
    let hit = depth > 0.0;
    switch show.view {
        case 0u: { return radiance_shown(picture(pixel, side)); }
        case 1u: { return tonemap_srgb_oetf(textureLoad(albedo_texture, pixel, 0).rgb); }
        case 2u: {
            let normal = oct_decode(textureLoad(normal_texture, pixel, 0).xy);
            return select(vec3f(0.0), normal * 0.5 + 0.5, hit);
        }
        case 3u: {
            // Near is bright; half as bright every `metres` more.
            return select(vec3f(0.0), vec3f(exp2(-frame.near / max(depth, 1e-9) / show.metres)), hit);
        }
        case 4u: { return radiance_shown(textureLoad(direct_diffuse, pixel, 0).rgb); }
        case 5u: {
            if side == 0u { return radiance_shown(textureLoad(indirect_left, pixel / show.texel.x, 0).rgb); }
            return radiance_shown(textureLoad(indirect_right, pixel / show.texel.y, 0).rgb);
        }
        case 6u: {
            return radiance_shown(textureLoad(direct_specular, pixel, 0).rgb
                + textureLoad(indirect_specular, pixel, 0).rgb);
        }
        case 7u: { return select(vec3f(0.0), vec3f(textureLoad(specular_texture, pixel, 0).a), hit); }
        case 8u: {
            let difference = abs(radiance_shown(picture(pixel, 0u)) - radiance_shown(picture(pixel, 1u)));
            return magma(dot(difference, vec3f(1.0 / 3.0)) / show.full_error);
        }
        case 9u: {
            let cell = min(pixel / 4u, textureDimensions(feature) - 1u);
            return magma((textureLoad(feature, cell, 0).x - show.low) / max(show.high - show.low, 1e-9));
        }
        case 11u: {
            // All tiles, as large as they fit.
            let size = vec2f(textureDimensions(feature));
            let window = vec2f(textureDimensions(depth_texture));
            let texel = (vec2f(pixel) + 0.5) / min(window.x / size.x, window.y / size.y);
            let inside = all(texel < size);
            let value = textureLoad(feature, vec2u(min(texel, size - 1.0)), 0);
            return select(vec3f(0.2), magma(value.x), inside && value.y > 0.0);
        }
        case 12u: {
            // Bright over dim is seen on any picture and where there is none.
            let line = textureLoad(feature, min(pixel, textureDimensions(feature) - 1u), 0).x;
            return mix(0.4 * radiance_shown(picture(pixel, side)), vec3f(1.0, 0.92, 0.78), 0.9 * line);
        }
        default: { return radiance_shown(textureLoad(emissive_texture, pixel, 0).rgb); }
    }
}

// Scene-linear radiance of one side.
fn picture(pixel: vec2u, side: u32) -> vec3f {
    if side == 0u {
        return textureLoad(left, pixel / show.texel.x, 0).rgb * show.scale.x;
    }
    return textureLoad(right, pixel / show.texel.y, 0).rgb * show.scale.y;
}

fn radiance_shown(radiance: vec3f) -> vec3f {
    return tonemap(show.kind, radiance * show.exposure);
}

// `metrics::heat_color`: black over purple and orange to pale yellow, to be read without red-green
// vision.
fn magma(value: f32) -> vec3f {
    let t = saturate(value);
    let high = vec3f(5.234, -5.416, -12.442);
    let c = ((((high * t + vec3f(-11.408, 11.196, 31.858)) * t + vec3f(6.17, -6.577, -23.746)) * t
        + vec3f(-0.073, 1.587, 2.842)) * t + vec3f(1.083, 0.182, 2.247)) * t + vec3f(-0.021, 0.011, -0.004);
    return saturate(c);
}
