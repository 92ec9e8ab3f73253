//! Day: a sky and perhaps a sun through the windows. Night: lamps in some of the rooms.
//!
//! Strengths follow from what they light: the light E/π that a room's walls would have if they were
//! grey is drawn, and the strength is what gives it in a room of that surface. So pictures come out
//! well at exposure 0.

use super::builder::{Builder, Form, Piece, Solid};
use super::furnish::Furnisher;
use super::look::Look;
use super::plan::{Plan, Room, SIDES};
use bouncelight::scene::{Environment, Light, LightKind, SUN_ANGLE};
use glam::{Mat4, Quat, Vec3, vec3};
use std::f32::consts::{FRAC_PI_2, PI, TAU};

/// What an average room's surfaces swallow of the light that meets them.
const SWALLOWED: f32 = 0.45;

/// White, or a sky's tint of blue, grey or evening.
pub(super) fn sky_tint(b: &mut Builder) -> [f32; 3] {
    let depth = b.between(0.0, 0.5);
    if b.chance(0.85) { [1.0 - depth, 1.0 - 0.6 * depth, 1.0] } else { [1.0, 1.0 - 0.5 * depth, 1.0 - depth] }
}

/// A sun over the horizon, whiter the higher it stands; it shines from the turn `from`.
pub(super) fn sun(b: &mut Builder, from: f32, irradiance: f32) {
    let up = b.between(0.14, 1.15);
    let (green, blue) = (0.75 + 0.2 * up.sin(), 0.45 + 0.45 * up.sin());
    let direction = vec3(-from.cos() * up.cos(), -up.sin(), -from.sin() * up.cos());
    let kind = LightKind::Directional { direction: direction.normalize().into(), irradiance, angle: SUN_ANGLE };
    b.scene.lights.push(Light { name: "sun".into(), color: [1.0, green, blue], kind, is_emissive_proxy: false });
}

/// From candles to overcast noon; a tenth are coloured.
pub(super) fn lamp_tint(b: &mut Builder) -> [f32; 3] {
    if b.chance(0.1) {
        return b.hue(0.6, 1.0);
    }
    let cold = b.between(0.0, 1.0);
    [1.0 - 0.15 * cold * cold, 0.6 + 0.35 * cold, 0.3 + 0.7 * cold]
}

/// Sky and perhaps sun, by the size of the windows.
pub(super) fn day(b: &mut Builder, plan: &Plan) {
    let lit = plan.rooms.iter().filter(|r| r.glass() > 0.0);
    let (surface, glass) = lit.fold((0.0, 0.0), |(s, g), r| (s + r.surface(), g + r.glass()));
    let clear = b.chance(0.65);
    // Half of what a window shows is ground.
    let wanted = b.between(0.2, 0.5) * if clear { 0.5 } else { 1.0 };
    let sky = (wanted * surface * SWALLOWED / (0.6 * glass.max(0.1))).clamp(0.15, 7.0);
    let tint = sky_tint(b);
    b.scene.environment = Environment::constant(tint.map(|c| c * sky));
    if !clear {
        return;
    }
    // Mostly from where a window is.
    let from = if b.chance(0.75) {
        let sides = SIDES.iter().filter(|s| plan.rooms.iter().any(|r| r.openings[**s].iter().any(|o| o.window)));
        let sides: Vec<usize> = sides.copied().collect();
        [PI, 0.0, -FRAC_PI_2, FRAC_PI_2][b.one_of(&sides)] + b.between(-1.1, 1.1)
    } else {
        b.between(0.0, TAU)
    };
    let irradiance = sky * b.between(4.0, 16.0);
    sun(b, from, irradiance);
}

/// A black sky or a dim one.
pub(super) fn dark_sky(b: &mut Builder) {
    let sky = if b.chance(0.5) { 0.0 } else { b.between(0.002, 0.02) };
    let tint = sky_tint(b);
    b.scene.environment = Environment::constant(tint.map(|c| c * sky));
}

/// 1 to 6 lamps in some rooms. Returns which.
pub(super) fn night(b: &mut Builder, plan: &mut Plan, look: &Look) -> Vec<usize> {
    dark_sky(b);
    let count = plan.rooms.len();
    let lit_count = if count < 3 { 1 } else { b.count(1, count - 1) };
    let first = b.below(count);
    let lit: Vec<usize> = (0..lit_count).map(|i| (first + i) % count).collect();
    let most = (6 / lit_count).min(3);
    for &i in &lit {
        let lamps = b.count(1, most);
        for _ in 0..lamps {
            let wanted = b.between(0.2, 0.6) / (lamps as f32).sqrt();
            lamp(&mut Furnisher { b, room: &mut plan.rooms[i], look }, wanted);
        }
    }
    lit
}

/// Radiant intensity of a lamp that shines everywhere in a room, W/sr, for a light E/π.
fn intensity(room: &Room, wanted: f32) -> f32 {
    0.25 * wanted * room.surface() * SWALLOWED
}

fn point(b: &mut Builder, at: Vec3, color: [f32; 3], intensity: f32, radius: f32) {
    let kind = LightKind::Point { position: at.into(), intensity, radius, range: None };
    b.scene.lights.push(Light { name: "lamp".into(), color, kind, is_emissive_proxy: false });
}

fn lamp(f: &mut Furnisher<'_>, wanted: f32) {
    let (size, top) = (f.room.size(), f.room.air.high.y);
    let (x, z) = (f.b.between(0.25, 0.75), f.b.between(0.25, 0.75));
    let at = f.room.air.low + vec3(x * size.x, top, z * size.z);
    match f.b.below(10) {
        0 => bulb(f, at, wanted),
        1 | 2 => pendant(f, at, wanted),
        3 | 4 => floor_lamp(f, at, wanted),
        5 => table_lamp(f, at, wanted),
        6 => spots(f, at, wanted),
        7 | 8 => panel(f, at, wanted),
        _ => globe(f, at, wanted),
    }
}

/// Naked, under the ceiling.
fn bulb(f: &mut Furnisher<'_>, at: Vec3, wanted: f32) {
    let (color, strength) = (lamp_tint(f.b), intensity(f.room, wanted));
    cord(&mut f.b.piece("cord", Mat4::from_translation(at)), f.look, 0.1);
    let radius = f.b.between(0.03, 0.06);
    point(f.b, at - Vec3::Y * 0.2, color, strength, radius);
}

/// A two-sided shade without lids around `at`, `half` as high and `radius` wide.
fn shade(f: &mut Furnisher<'_>, at: Vec3, radius: f32, half: f32) {
    let pose = Mat4::from_translation(at);
    let size = vec3(radius, half, radius);
    f.b.piece("shade", pose).form(Form::Tube, f.look.shade, Vec3::ZERO, size, Quat::IDENTITY);
}

fn pendant(f: &mut Furnisher<'_>, at: Vec3, wanted: f32) {
    let (radius, half) = (f.b.between(0.12, 0.28), f.b.between(0.08, 0.15));
    let length = f.b.between(0.35, 0.8).min(at.y - 1.75);
    if !hangs_free(f.room, at, radius, at.y - length - half) {
        return bulb(f, at, wanted);
    }
    let (color, strength) = (lamp_tint(f.b), intensity(f.room, 1.4 * wanted));
    cord(&mut f.b.piece("cord", Mat4::from_translation(at)), f.look, length - 0.05);
    let middle = at - Vec3::Y * length;
    shade(f, middle, radius, half);
    point(f.b, middle, color, strength, 0.04);
}

fn floor_lamp(f: &mut Furnisher<'_>, at: Vec3, wanted: f32) {
    let Some(pose) = f.at_wall([0.44, 0.44, 1.75]) else { return bulb(f, at, wanted) };
    let (color, strength, high) = (lamp_tint(f.b), intensity(f.room, 1.3 * wanted), f.b.between(1.25, 1.6));
    let (look, glows) = (f.look, f.b.chance(0.3));
    let mut p = f.b.piece("floor lamp", pose);
    p.post(look.black, [0.0, 0.0, 0.22], 0.14, 0.02);
    p.post(look.metal, [0.0, 0.02, 0.22], 0.012, high - 0.1);
    let middle = pose.transform_point3(vec3(0.0, high, 0.22));
    if glows {
        glowing(f, middle, Form::Cylinder, vec3(0.15, 0.16, 0.15), color, strength);
    } else {
        shade(f, middle, 0.19, 0.15);
        point(f.b, middle, color, strength, 0.04);
    }
}

fn table_lamp(f: &mut Furnisher<'_>, at: Vec3, wanted: f32) {
    if f.room.tops.is_empty() {
        return pendant(f, at, wanted);
    }
    let which = f.b.below(f.room.tops.len());
    let top = f.room.tops.swap_remove(which);
    let (color, strength, look) = (lamp_tint(f.b), intensity(f.room, wanted), f.look);
    let foot = f.b.one_of(&look.small);
    let mut p = f.b.piece("table lamp", Mat4::from_translation(top));
    p.post(foot, [0.0; 3], 0.06, 0.02);
    p.post(foot, [0.0, 0.02, 0.0], 0.02, 0.2);
    let middle = top + Vec3::Y * 0.33;
    shade(f, middle, 0.12, 0.1);
    point(f.b, middle, color, strength, 0.03);
}

/// Two or three in a row, aimed anywhere below.
fn spots(f: &mut Furnisher<'_>, at: Vec3, wanted: f32) {
    let color = lamp_tint(f.b);
    let count = f.b.count(1, 3);
    for i in 0..count {
        let along = 0.5 * (i as f32 - 0.5 * (count - 1) as f32);
        let base = at + vec3(along, 0.0, 0.0);
        let direction = vec3(f.b.between(-0.7, 0.7), -1.0, f.b.between(-0.7, 0.7)).normalize();
        let outer_angle = f.b.between(0.4, 0.85);
        // What a lamp sends everywhere, in its cone.
        let share = 0.5 * (1.0 - outer_angle.cos());
        let strength = intensity(f.room, wanted) / (count as f32 * share);
        let turn = Quat::from_rotation_arc(Vec3::NEG_Y, direction);
        let middle = base - Vec3::Y * 0.1;
        let mut p = f.b.piece("spot", Mat4::IDENTITY);
        p.form(Form::Cuboid, f.look.black, base - Vec3::Y * 0.03, vec3(0.01, 0.03, 0.01), Quat::IDENTITY);
        p.form(Form::Cylinder, f.look.metal, middle, vec3(0.035, 0.06, 0.035), turn);
        let kind = LightKind::Spot {
            position: (middle + 0.075 * direction).into(),
            direction: direction.into(),
            intensity: strength,
            radius: 0.025,
            range: None,
            inner_angle: 0.6 * outer_angle,
            outer_angle,
        };
        f.b.scene.lights.push(Light { name: "spot".into(), color, kind, is_emissive_proxy: false });
    }
}

/// A light that stands in for a surface that faces `direction`: the ramp of a wide spot is the
/// cosine's square, so half as much again has the surface's flux.
pub(super) fn stand_in(b: &mut Builder, at: Vec3, direction: Vec3, color: [f32; 3], radiance: f32, area: f32) {
    let kind = LightKind::Spot {
        position: (at + 0.01 * direction).into(),
        direction: direction.into(),
        intensity: 1.5 * radiance * area,
        radius: (area / PI).sqrt(),
        range: None,
        inner_angle: 0.0,
        outer_angle: FRAC_PI_2,
    };
    b.scene.lights.push(Light { name: "panel".into(), color, kind, is_emissive_proxy: true });
}

/// Glowing, in a box at the ceiling.
fn panel(f: &mut Furnisher<'_>, at: Vec3, wanted: f32) {
    let half = vec3(f.b.between(0.2, 0.6), 1e-3, f.b.between(0.1, 0.3));
    let (color, area) = (lamp_tint(f.b), 4.0 * half.x * half.z);
    let radiance = 0.9 * wanted * f.room.surface() * SWALLOWED / area;
    let glow = f.b.glow("panel", color.map(|c| c * radiance));
    let (frame, low) = (f.look.white, at - Vec3::Y * 0.06);
    let mut p = f.b.piece("panel", Mat4::IDENTITY);
    let wide = half + vec3(0.02, 0.0, 0.02);
    p.block(frame, (low - wide).with_y(low.y + 0.005).into(), (at + wide).with_y(at.y + 0.01).into());
    p.form(Form::Panel, glow, low, half, Quat::IDENTITY);
    stand_in(f.b, low, Vec3::NEG_Y, color, radiance, area);
}

/// A glowing ball on a cord, or on the ceiling where the room is low.
fn globe(f: &mut Furnisher<'_>, at: Vec3, wanted: f32) {
    let (color, strength, radius) = (lamp_tint(f.b), intensity(f.room, wanted), f.b.between(0.1, 0.2));
    let length = f.b.between(0.2, 0.6).min(at.y - 2.0 - radius).max(radius + 0.02);
    cord(&mut f.b.piece("cord", Mat4::from_translation(at)), f.look, length);
    glowing(f, at - Vec3::Y * length, Form::Ball, Vec3::splat(radius), color, strength);
}

/// A body that sends what a lamp of `intensity` does. No light stands in for it: rays find it.
fn glowing(f: &mut Furnisher<'_>, at: Vec3, form: Form, half: Vec3, color: [f32; 3], intensity: f32) {
    let area = match form {
        Form::Cylinder => TAU * half.x * (2.0 * half.y + half.x),
        _ => 2.0 * TAU * half.x * half.x,
    };
    // Flux: 4π · intensity = π · radiance · area.
    let radiance = 4.0 * intensity / area;
    let glow = f.b.glow("glowing shade", color.map(|c| c * radiance));
    f.b.piece("glowing shade", Mat4::from_translation(at)).form(form, glow, Vec3::ZERO, half, Quat::IDENTITY);
}

/// Whether something that hangs from the ceiling down to `low` hangs free.
fn hangs_free(room: &Room, at: Vec3, radius: f32, low: f32) -> bool {
    let [a, c] = [at - radius, at + radius];
    room.free(Solid::new(a.with_y(low), c.with_y(room.air.high.y)))
}

/// What hangs from the ceiling: a cord and a rose.
fn cord(p: &mut Piece<'_>, look: &Look, length: f32) {
    p.form(Form::Cylinder, look.white, vec3(0.0, -0.015, 0.0), vec3(0.05, 0.015, 0.05), Quat::IDENTITY);
    p.form(Form::Cuboid, look.black, Vec3::Y * (-0.5 * length), vec3(0.004, 0.5 * length, 0.004), Quat::IDENTITY);
}
