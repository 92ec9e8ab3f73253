//! One property of one node over time.

use glam::{Quat, Vec4};

/// A property of a node over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Index into [`Rig::nodes`](super::Rig::nodes).
    pub node: usize,
    /// The property.
    pub property: Property,
    /// Interpolation between keys.
    pub interpolation: Interpolation,
    /// Seconds, rising, at least one.
    pub times: Vec<f32>,
    /// Values: as many for each time as the property has numbers, or for [`Interpolation::Cubic`] three
    /// times as many: in-tangents, values, out-tangents.
    pub values: Vec<f32>,
}

/// Property that a channel moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "as in glTF")]
pub enum Property {
    Translation,
    Rotation,
    Scale,
    /// Of the node's morph targets.
    Weights,
}

/// Interpolation between two keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "as in glTF")]
pub enum Interpolation {
    Step,
    Linear,
    Cubic,
}

impl Interpolation {
    /// Values at each key.
    pub fn parts(self) -> usize {
        if self == Self::Cubic { 3 } else { 1 }
    }
}

impl Channel {
    /// Numbers of the property.
    pub fn width(&self) -> usize {
        self.values.len() / (self.interpolation.parts() * self.times.len().max(1))
    }

    /// The value at `time`; before the first key and after the last these stand.
    pub fn at(&self, time: f32) -> Vec<f32> {
        let (width, parts) = (self.width(), self.interpolation.parts());
        // In-tangent, value and out-tangent of a cubic's key; else there is the value alone.
        let value = |key: usize, part: usize, i: usize| {
            self.values[(key * parts + if parts == 3 { part } else { 0 }) * width + i]
        };
        let last = self.times.len() - 1;
        let next = self.times.partition_point(|&t| t <= time);
        let rotates = self.property == Property::Rotation;
        let found: Vec<f32> = if next == 0 || next > last || self.interpolation == Interpolation::Step {
            let key = next.max(1) - 1;
            (0..width).map(|i| value(key, 1, i)).collect()
        } else {
            let (a, b) = (next - 1, next);
            let span = self.times[b] - self.times[a];
            let t = (time - self.times[a]) / span;
            let quaternion = |key: usize| Quat::from_array([0, 1, 2, 3].map(|i| value(key, 1, i))).normalize();
            match self.interpolation {
                Interpolation::Cubic => {
                    let (t2, t3) = (t * t, t * t * t);
                    let one = |i: usize| {
                        value(a, 1, i) * (2.0 * t3 - 3.0 * t2 + 1.0)
                            + value(a, 2, i) * span * (t3 - 2.0 * t2 + t)
                            + value(b, 1, i) * (3.0 * t2 - 2.0 * t3)
                            + value(b, 0, i) * span * (t3 - t2)
                    };
                    (0..width).map(one).collect()
                }
                _ if rotates => quaternion(a).slerp(quaternion(b), t).to_array().to_vec(),
                _ => (0..width).map(|i| value(a, 1, i) + (value(b, 1, i) - value(a, 1, i)) * t).collect(),
            }
        };
        if !rotates {
            return found;
        }
        Vec4::from_slice(&found).try_normalize().unwrap_or(Vec4::W).to_array().to_vec()
    }
}
