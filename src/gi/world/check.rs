//! What a host may have got wrong, found in a few texels: each field against itself, depth against
//! the world's triangles, normals against depth, motion against the cameras. Other readings are
//! tried, and one that fits is named.

use super::sample::{SIDE, Sample};
use crate::gi::interface::{
    Conventions, Depth, Forward, Inputs, MotionSense, MotionUnits, NormalEncoding, NormalRange, NormalSpace,
};
use crate::gi::stage::inputs::Params;
use glam::{Mat3, Vec2, Vec3};

/// A field of [`Inputs`] that does not hold what its convention says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Complaint {
    /// The field.
    pub field: &'static str,
    /// What was found, and what it looks like; one sentence without a full stop.
    pub mistake: String,
}

impl std::fmt::Display for Complaint {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "`{}`: {}", self.field, self.mistake)
    }
}

/// Share of samples that agree from which a reading counts as right, and below which as wrong.
const RIGHT: f32 = 0.7;
const WRONG: f32 = 0.5;

/// All that is judged.
pub(super) struct Evidence<'a> {
    pub inputs: &'a Inputs<'a>,
    pub samples: &'a [Sample],
    pub now: Params,
    /// Of the frame before, if this one follows it.
    pub before: Option<Params>,
    /// How many times the way to each sample a ray goes; the same in the mirrored picture. Nothing
    /// without a world.
    pub rays: Option<[Vec<f32>; 2]>,
}

impl Evidence<'_> {
    pub fn complaints(&self) -> Vec<Complaint> {
        let mut all = Vec::new();
        self.broken(&mut all);
        if let Some(mistake) = self.depth() {
            all.push(Complaint { field: "depth", mistake });
            // What follows is held against depth.
            return all;
        }
        let rest = [("normal", self.normal()), ("motion", self.motion())];
        all.extend(rest.into_iter().filter_map(|(field, m)| m.map(|mistake| Complaint { field, mistake })));
        all
    }

    fn seen(&self) -> impl Iterator<Item = (usize, &Sample)> {
        self.samples.iter().enumerate().filter(|(_, s)| s.distance() > 0.0)
    }

    fn broken(&self, all: &mut Vec<Complaint>) {
        let i = self.inputs;
        let mut count = |there: bool, field, what: &str, bad: &dyn Fn(&Sample) -> bool| {
            let n = self.samples.iter().filter(|s| bad(s)).count();
            if there && n > 0 {
                all.push(Complaint { field, mistake: format!("{n} of {} texels are {what}", SIDE * SIDE) });
            }
        };
        const NAN: &str = "NaN or infinite";
        count(true, "depth", NAN, &|s| s.depth[2] > 0.0);
        count(true, "depth", "outside of 0 to 1", &|s| !(0.0..=1.0).contains(&s.depth[0]));
        count(true, "normal", NAN, &|s| s.normal[3] > 0.0);
        count(i.motion.is_some(), "motion", NAN, &|s| s.motion[3] > 0.0);
        count(i.albedo.is_some(), "albedo", NAN, &|s| s.broken[0] > 0.0);
        count(i.albedo.is_some(), "albedo", "negative or above 1", &|s| s.color[0] > 1.001 || s.color[1] < 0.0);
        count(i.direct.is_some(), "direct", NAN, &|s| s.broken[1] > 0.0);
        count(i.direct.is_some(), "direct", "negative", &|s| s.color[3] < 0.0);
        count(i.emissive.is_some(), "emissive", NAN, &|s| s.broken[2] > 0.0);
    }

    fn depth(&self) -> Option<String> {
        let background = self.now.depth[2];
        if self.seen().next().is_none() {
            return Some(format!(
                "every texel is {background}, the background: nothing was drawn, or depth goes the other way"
            ));
        }
        let [rays, mirrored] = self.rays.as_ref()?;
        let near = |t: f32| (t - 1.0).abs() < 0.05;
        let share = |agrees: &dyn Fn(usize, &Sample) -> Option<bool>| {
            let all: Vec<bool> = self.seen().filter_map(|(i, s)| agrees(i, s)).collect();
            all.iter().filter(|a| **a).count() as f32 / all.len().max(1) as f32
        };
        let met = share(&|i, _| Some(near(rays[i])));
        if met >= WRONG {
            return None;
        }
        let found = format!("it agrees with the world's triangles at {:.0} % of the pixels", 100.0 * met);
        let read = |depth: Depth| {
            let conventions = Conventions { depth, ..self.inputs.conventions };
            Params::of(&Inputs { conventions, ..*self.inputs }, None).ok()
        };
        for depth in [Depth::Reversed, Depth::Forward, Depth::ForwardGl] {
            let Some(p) = read(depth).filter(|_| depth != self.inputs.conventions.depth) else { continue };
            let agrees = |i: usize, s: &Sample| {
                let distance = p.depth[0] / (s.depth[0] + p.depth[1]);
                (s.depth[0] != p.depth[2]).then(|| near(rays[i] * s.distance() / distance))
            };
            if share(&agrees) >= RIGHT {
                return Some(format!("{found}; read as `Depth::{depth:?}` it would agree"));
            }
        }
        if share(&|i, _| Some(near(mirrored[i]))) >= RIGHT {
            return Some(format!("{found}; turned upside down it would agree: flip y of the projection"));
        }
        let mut times: Vec<f32> = self.seen().map(|(i, _)| rays[i]).filter(|t| t.is_finite()).collect();
        let k = median(&mut times)?;
        if share(&|i, _| Some(near(rays[i] / k))) >= RIGHT {
            return Some(format!("{found}, but is the same {k:.3} times too small everywhere: other units or planes"));
        }
        let matrices = "wrong matrices (column-major? `view_from_world`, not its inverse?)";
        Some(format!("{found}: {matrices}, instances, or planes of the projection"))
    }

    fn normal(&self) -> Option<String> {
        let flat: Vec<&Sample> = self.seen().map(|(_, s)| s).filter(|s| s.depth[3] > 0.0).collect();
        let [x, y, z] = self.now.world_from_view.map(|c| Vec3::new(c[0], c[1], c[2]));
        let turn = Mat3::from_cols(x, y, z);
        let score = |encoding, range, space, sign: Vec3| {
            let cosine = |s: &&Sample| {
                let n = decode(Vec3::new(s.normal[0], s.normal[1], s.normal[2]), encoding, range) * sign;
                let ahead = self.inputs.conventions.forward == Forward::PositiveZ && encoding != NormalEncoding::Xy;
                let n = match space {
                    NormalSpace::World => n,
                    NormalSpace::View if ahead => turn * Vec3::new(n.x, n.y, -n.z),
                    NormalSpace::View => turn * n,
                };
                n.dot(Vec3::new(s.plane[0], s.plane[1], s.plane[2]))
            };
            flat.iter().map(cosine).sum::<f32>() / flat.len().max(1) as f32
        };
        let c = &self.inputs.conventions;
        let stated = score(c.normal_encoding, c.normal_range, c.normal_space, Vec3::ONE);
        if flat.len() < 16 {
            return None;
        }
        // Of readings that fit alike, that which differs least from what was said.
        let mut best = (f32::MIN, 0.0, String::new());
        let signs = [
            ("", Vec3::ONE),
            (", with y negated", Vec3::new(1.0, -1.0, 1.0)),
            (", with z negated", Vec3::new(1.0, 1.0, -1.0)),
            (", negated", Vec3::NEG_ONE),
        ];
        for (flipped, sign) in signs {
            for range in [NormalRange::Signed, NormalRange::Unsigned] {
                for space in [NormalSpace::World, NormalSpace::View] {
                    for encoding in [NormalEncoding::Octahedral, NormalEncoding::Xyz, NormalEncoding::Xy] {
                        let score = score(encoding, range, space, sign);
                        let differs = [
                            !flipped.is_empty(),
                            range != c.normal_range,
                            space != c.normal_space,
                            encoding != c.normal_encoding,
                        ];
                        let rank = score - 0.02 * differs.iter().filter(|d| **d).count() as f32;
                        if rank > best.0 {
                            best = (rank, score, format!("`{encoding:?}`, `{range:?}`, `{space:?}`{flipped}"));
                        }
                    }
                }
            }
        }
        // A camera that is hardly tilted confuses spaces only a little, but then the right one is
        // far nearer.
        let (_, score, name) = best;
        let better = score > 0.85 && 1.0 - stated > 2.0 * (1.0 - score) + 0.02;
        let found = format!("its mean cosine with the surface that depth shows is {stated:.2}");
        if better {
            return Some(format!("{found}; as {name} it would be {score:.2}"));
        }
        (stated < RIGHT).then_some(found)
    }

    fn motion(&self) -> Option<String> {
        let before = self.before.filter(|_| self.inputs.motion.is_some())?;
        let size = Vec2::new(self.now.size[0] as f32, self.now.size[1] as f32);
        let seen: Vec<(Vec2, Vec2)> = self
            .seen()
            .filter_map(|(_, s)| Some((self.expected(&before, s)? * size, Vec2::new(s.motion[0], s.motion[1]))))
            .collect();
        let c = &self.inputs.conventions;
        let error = |units, sense, flip: f32| {
            let conventions = Conventions { motion_units: units, motion_sense: sense, ..*c };
            let read = Params::of(&Inputs { conventions, ..*self.inputs }, Some(before.shift())).ok()?;
            let [a, b, x, y] = read.motion;
            let off = |&(expected, texel): &(Vec2, Vec2)| {
                (expected - (texel * Vec2::new(a, flip * b) + Vec2::new(x, y)) * size).length()
            };
            median(&mut seen.iter().map(off).collect::<Vec<_>>())
        };
        let moved = median(&mut seen.iter().map(|s| s.0.length()).collect::<Vec<_>>())?;
        let stated = error(c.motion_units, c.motion_sense, 1.0)?;
        if stated < 0.5 + 0.3 * moved {
            return None;
        }
        let found = format!("the cameras say {moved:.1} pixels, of which it is {stated:.1} off (medians)");
        if moved > 0.5 {
            for (flip, flipped) in [(1.0, ""), (-1.0, ", with y negated")] {
                for units in [MotionUnits::Uv, MotionUnits::Pixels, MotionUnits::Ndc] {
                    for sense in [MotionSense::ToPast, MotionSense::FromPast] {
                        if error(units, sense, flip)? < 0.1 + 0.1 * moved {
                            return Some(format!("{found}; as `{units:?}`, `{sense:?}`{flipped} it would fit"));
                        }
                    }
                }
            }
        }
        Some(format!("{found}; does it hold jitter (`MotionJitter::Included`)?"))
    }

    /// Texture coordinates then minus now of a surface at rest, free of jitter.
    fn expected(&self, before: &Params, s: &Sample) -> Option<Vec2> {
        let at = Vec3::from(self.now.eye_position()) + Vec3::new(s.offset[0], s.offset[1], s.offset[2]);
        let [x, y, z] = before.world_from_view.map(|c| Vec3::new(c[0], c[1], c[2]));
        let from_eye = at - Vec3::from(before.eye_position());
        let d = -z.dot(from_eye);
        let [w, h, ox, oy] = before.unproject;
        let ndc = Vec2::new(x.dot(from_eye) / (w * d) - ox, y.dot(from_eye) / (h * d) - oy);
        let then = Vec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) - Vec2::from(before.shift());
        let size = Vec2::new(self.now.size[0] as f32, self.now.size[1] as f32);
        let now = (Vec2::new(s.offset[3], s.mirrored[3]) + 0.5) / size - Vec2::from(self.now.shift());
        (d > 0.0).then_some(then - now)
    }
}

/// `stored_vector` of `shaders/gi/inputs.wgsl`.
fn decode(texel: Vec3, encoding: NormalEncoding, range: NormalRange) -> Vec3 {
    let v = if range == NormalRange::Unsigned { 2.0 * texel - 1.0 } else { texel };
    match encoding {
        NormalEncoding::Octahedral => crate::gi::cpu::oct_decode([v.x, v.y]).into(),
        NormalEncoding::Xyz => v.normalize_or(Vec3::Z),
        NormalEncoding::Xy => Vec3::new(v.x, v.y, (1.0 - v.x * v.x - v.y * v.y).max(0.0).sqrt()).normalize_or(Vec3::Z),
    }
}

fn median(values: &mut [f32]) -> Option<f32> {
    values.sort_by(f32::total_cmp);
    values.get(values.len() / 2).copied()
}
