//! Ways to spoil pictures on purpose: the negative controls. Each stands for something that real
//! methods do wrong.

use super::observation::Observation;
use crate::study::judge::NOTHING;
use bouncelight::numbers::SplitMix;

/// What is done to every frame that a test looks at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Corruption {
    /// Every value of every frame times 1 ± this, by lot: noise that never settles.
    Noise(f32),
    /// This share of what was shown stays for another frame: a history that does not let go.
    Late(f32),
    /// Light grows by this share from the picture's top left to its bottom right: an answer that
    /// depends on where in the picture a place is.
    Screen(f32),
    /// Light times this: wrong energy.
    Gain(f32),
    /// This much radiance is added where there is a surface: light through walls.
    Leak(f32),
    /// Light to this power: an answer that is not linear in the light.
    Curve(f32),
    /// This share of each channel is the mean of the three: colours that run.
    Grey(f32),
    /// Light falls by this share over ten metres from the eye: an answer that knows metres.
    Metres(f32),
    /// A value in the middle is NaN.
    Broken,
}

impl Corruption {
    /// In words, for records.
    pub fn words(self) -> String {
        match self {
            Corruption::Noise(a) => format!("noise of ±{:.0} % in every frame", 100.0 * a),
            Corruption::Late(a) => format!("{:.0} % of each frame stays in the next", 100.0 * a),
            Corruption::Screen(a) => format!("{:.0} % more light from the top left to the bottom right", 100.0 * a),
            Corruption::Gain(a) => format!("{a} times the light"),
            Corruption::Leak(a) => format!("{a} W/(m² sr) more everywhere"),
            Corruption::Curve(a) => format!("light to the power {a}"),
            Corruption::Grey(a) => format!("{:.0} % of each colour runs into the others", 100.0 * a),
            Corruption::Metres(a) => format!("{:.0} % less light every ten metres", 100.0 * a),
            Corruption::Broken => "a pixel that is no number".into(),
        }
    }

    /// Spoils `look`; `number` is that of the frame, `before` what was shown `passed` frames ago.
    pub(super) fn spoil(self, look: &mut Observation, number: u64, before: Option<&Observation>, passed: u32) {
        let [width, height] = look.size.map(|n| n as usize);
        let depth = &look.depth;
        let is_surface = |pixel: usize| depth[pixel] < NOTHING;
        let before = [before.map(|b| &b.light), before.map(|b| &b.rgb)];
        for (values, old) in [&mut look.light, &mut look.rgb].into_iter().zip(before) {
            for (pixel, at) in values.chunks_exact_mut(3).enumerate() {
                let across = (pixel % width) as f32 / width as f32 + (pixel / width) as f32 / height as f32;
                match self {
                    Corruption::Noise(a) => {
                        let factor = 1.0 + a * (2.0 * lot(number, pixel as u64) - 1.0);
                        at.iter_mut().for_each(|v| *v *= factor);
                    }
                    Corruption::Late(a) => {
                        let Some(old) = old else { continue };
                        let stays = a.powi(passed as i32);
                        at.iter_mut().zip(&old[3 * pixel..]).for_each(|(v, o)| *v = stays * o + (1.0 - stays) * *v);
                    }
                    Corruption::Screen(a) => at.iter_mut().for_each(|v| *v *= 1.0 + 0.5 * a * across),
                    Corruption::Gain(a) => at.iter_mut().for_each(|v| *v *= a),
                    Corruption::Leak(a) if is_surface(pixel) => at.iter_mut().for_each(|v| *v += a),
                    Corruption::Curve(a) => at.iter_mut().for_each(|v| *v = v.max(0.0).powf(a)),
                    Corruption::Grey(a) => {
                        let mean = at.iter().sum::<f32>() / 3.0;
                        at.iter_mut().for_each(|v| *v += a * (mean - *v));
                    }
                    Corruption::Metres(a) if is_surface(pixel) => {
                        at.iter_mut().for_each(|v| *v *= (1.0 - a).powf(depth[pixel] / 10.0));
                    }
                    Corruption::Leak(_) | Corruption::Metres(_) | Corruption::Broken => {}
                }
            }
        }
        if self == Corruption::Broken {
            look.broken += 1;
        }
    }
}

/// Uniform in [0, 1) by frame and pixel: the pair's place in one row of numbers.
fn lot(frame: u64, pixel: u64) -> f32 {
    SplitMix::new((frame << 32 | pixel).wrapping_mul(0x9E37_79B9_7F4A_7C15)).next()
}
