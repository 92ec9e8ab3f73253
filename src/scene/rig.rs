//! Animations of nodes: translation, rotation and scale over time, as glTF has them. Skins and
//! morph targets are not here.

use super::Scene;
use glam::{Mat4, Quat, Vec3, Vec4};

/// The tree of nodes behind a scene's instances, and how they move.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rig {
    /// Parents before their children.
    pub nodes: Vec<RigNode>,
    /// Node of each of [`Scene::instances`].
    pub instances: Vec<usize>,
    /// Never empty.
    pub animations: Vec<Animation>,
}

/// A node at rest.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigNode {
    /// Index of the node it hangs on.
    pub parent: Option<usize>,
    /// Metres.
    pub translation: [f32; 3],
    /// Unit quaternion x, y, z, w.
    pub rotation: [f32; 4],
    /// By axis.
    pub scale: [f32; 3],
}

/// Channels that play together.
#[derive(Debug, Clone, PartialEq)]
pub struct Animation {
    /// Name in the file.
    pub name: String,
    /// Time of the last key, seconds.
    pub end: f32,
    /// What moves.
    pub channels: Vec<Channel>,
}

/// A property of a node over time.
#[derive(Debug, Clone, PartialEq)]
pub struct Channel {
    /// Index into [`Rig::nodes`].
    pub node: usize,
    /// Which property.
    pub property: Property,
    /// What lies between keys.
    pub interpolation: Interpolation,
    /// Seconds, rising, at least one.
    pub times: Vec<f32>,
    /// One for each time, or for [`Interpolation::Cubic`] three: in-tangent, value, out-tangent.
    /// Three-vectors end with 0.
    pub values: Vec<[f32; 4]>,
}

/// What a channel moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "as in glTF")]
pub enum Property {
    Translation,
    Rotation,
    Scale,
}

/// What lies between two keys.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "as in glTF")]
pub enum Interpolation {
    Step,
    Linear,
    Cubic,
}

impl Channel {
    /// The value at `time`; before the first key and after the last these stand.
    fn at(&self, time: f32) -> Vec4 {
        let cubic = self.interpolation == Interpolation::Cubic;
        let value = |key: usize, part: usize| Vec4::from(self.values[if cubic { 3 * key + part } else { key }]);
        let last = self.times.len() - 1;
        let next = self.times.partition_point(|&t| t <= time);
        let rotates = self.property == Property::Rotation;
        let found = if next == 0 {
            value(0, 1)
        } else if next > last {
            value(last, 1)
        } else {
            let (a, b) = (next - 1, next);
            let span = self.times[b] - self.times[a];
            let t = (time - self.times[a]) / span;
            match self.interpolation {
                Interpolation::Step => value(a, 1),
                Interpolation::Linear if rotates => {
                    Quat::from_vec4(value(a, 1)).normalize().slerp(Quat::from_vec4(value(b, 1)).normalize(), t).into()
                }
                Interpolation::Linear => value(a, 1).lerp(value(b, 1), t),
                Interpolation::Cubic => {
                    let (t2, t3) = (t * t, t * t * t);
                    value(a, 1) * (2.0 * t3 - 3.0 * t2 + 1.0)
                        + value(a, 2) * span * (t3 - 2.0 * t2 + t)
                        + value(b, 1) * (3.0 * t2 - 2.0 * t3)
                        + value(b, 0) * span * (t3 - t2)
                }
            }
        };
        if rotates { found.try_normalize().unwrap_or(Vec4::W) } else { found }
    }
}

impl Rig {
    /// World transform of each instance in animation `animation` at `time`, seconds; `None` if
    /// there is no such animation.
    pub fn pose(&self, animation: usize, time: f32) -> Option<Vec<[[f32; 4]; 4]>> {
        let animation = self.animations.get(animation)?;
        let mut nodes = self.nodes.clone();
        for channel in &animation.channels {
            let value = channel.at(time);
            let node = &mut nodes[channel.node];
            match channel.property {
                Property::Translation => node.translation = value.truncate().to_array(),
                Property::Rotation => node.rotation = value.to_array(),
                Property::Scale => node.scale = value.truncate().to_array(),
            }
        }
        let mut world: Vec<Mat4> = Vec::with_capacity(nodes.len());
        for node in &nodes {
            let [scale, translation] = [node.scale, node.translation].map(Vec3::from);
            let own = Mat4::from_scale_rotation_translation(scale, Quat::from_array(node.rotation), translation);
            world.push(node.parent.map_or(own, |p| world[p] * own));
        }
        Some(self.instances.iter().map(|&n| world[n].to_cols_array_2d()).collect())
    }
}

impl Scene {
    /// Places all instances as animation `animation` has them at `time`, seconds. False if there is no such animation.
    pub fn pose(&mut self, animation: usize, time: f32) -> bool {
        let Some(pose) = self.rig.as_ref().and_then(|rig| rig.pose(animation, time)) else { return false };
        self.instances.iter_mut().zip(pose).for_each(|(instance, transform)| instance.transform = transform);
        true
    }

    /// Gives every mesh its material of variant `variant`. False if there is no such variant.
    pub fn choose_variant(&mut self, variant: usize) -> bool {
        for mesh in &mut self.meshes {
            mesh.material = mesh.variants.get(variant).copied().unwrap_or(mesh.material);
        }
        variant < self.variants.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(property: Property, interpolation: Interpolation, values: &[[f32; 4]]) -> Channel {
        Channel { node: 1, property, interpolation, times: vec![1.0, 3.0], values: values.to_vec() }
    }

    fn rig(channel: Channel) -> Rig {
        let node =
            |parent, x| RigNode { parent, translation: [x, 0.0, 0.0], rotation: [0.0, 0.0, 0.0, 1.0], scale: [1.0; 3] };
        let animations = vec![Animation { name: String::new(), end: 3.0, channels: vec![channel] }];
        Rig { nodes: vec![node(None, 10.0), node(Some(0), 1.0), node(Some(1), 2.0)], instances: vec![2, 0], animations }
    }

    fn places(rig: &Rig, time: f32) -> [Vec3; 2] {
        let pose = rig.pose(0, time).unwrap();
        [0, 1].map(|i: usize| Mat4::from_cols_array_2d(&pose[i]).transform_point3(Vec3::ZERO))
    }

    #[test]
    fn children_follow_and_others_stay() {
        let moves = [[1.0, 0.0, 0.0, 0.0], [1.0, 4.0, 0.0, 0.0]];
        let linear = rig(channel(Property::Translation, Interpolation::Linear, &moves));
        for (time, y) in [(0.0, 0.0), (1.0, 0.0), (2.0, 2.0), (3.0, 4.0), (9.0, 4.0)] {
            assert_eq!(places(&linear, time), [Vec3::new(13.0, y, 0.0), Vec3::new(10.0, 0.0, 0.0)]);
        }
        let step = rig(channel(Property::Translation, Interpolation::Step, &moves));
        assert_eq!((places(&step, 2.9)[0].y, places(&step, 3.0)[0].y), (0.0, 4.0));
        assert_eq!(linear.pose(1, 0.0), None);
    }

    #[test]
    fn turns_take_the_short_way_and_cubics_their_tangents() {
        let half = std::f32::consts::FRAC_1_SQRT_2;
        // A quarter turn about z, written with the other sign.
        let turn =
            rig(channel(Property::Rotation, Interpolation::Linear, &[[0.0, 0.0, 0.0, 1.0], [0.0, 0.0, -half, -half]]));
        let at = places(&turn, 2.0)[0] - Vec3::new(11.0, 0.0, 0.0);
        assert!(at.distance(Vec3::new(2.0 * half, 2.0 * half, 0.0)) < 1e-5, "{at}");
        let zero = [0.0; 4];
        let cubic = |out: f32| {
            let values = [zero, [1.0, 0.0, 0.0, 0.0], [0.0, out, 0.0, 0.0], zero, [1.0, 4.0, 0.0, 0.0], zero];
            places(&rig(channel(Property::Translation, Interpolation::Cubic, &values)), 2.0)[0].y
        };
        assert!((cubic(0.0) - 2.0).abs() < 1e-5);
        // An out-tangent of 1 m/s over 2 s adds 2 · (1/8).
        assert!((cubic(1.0) - 2.25).abs() < 1e-5);
    }
}
