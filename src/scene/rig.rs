//! Animations of nodes over time, as glTF has them: where they are, and with them objects, cameras,
//! lights, joints of skins and weights of morph targets.

mod channel;

use super::deform::Joint;
use super::{Camera, LightKind, Scene};
use glam::{DMat4, DVec3, Mat4, Quat, Vec3};

pub use channel::{Channel, Interpolation, Property};

/// The tree of nodes behind a scene's instances, and how they move.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Rig {
    /// Origin of the scene, in the space of nodes without a parent, metres.
    pub origin: [f64; 3],
    /// Parents before their children.
    pub nodes: Vec<RigNode>,
    /// Node of each of [`Scene::instances`].
    pub instances: Vec<usize>,
    /// Node of each of the first of [`Scene::cameras`]; those that follow were added by a loader.
    pub cameras: Vec<usize>,
    /// Node of each of the first of [`Scene::lights`].
    pub lights: Vec<usize>,
    /// Nodes that move each of [`Scene::deforms`].
    pub deforms: Vec<RigDeform>,
    /// Joints that deforming meshes may name.
    pub skins: Vec<Skin>,
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

/// Nodes that move a deforming mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct RigDeform {
    /// Node that places the mesh, and has the weights.
    pub node: usize,
    /// Index into [`Rig::skins`], if it has one.
    pub skin: Option<usize>,
    /// Weights of its morph targets at rest.
    pub weights: Vec<f32>,
}

/// Joints of a skin.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Skin {
    /// Node of each joint.
    pub joints: Vec<usize>,
    /// From the space of the skin's meshes to that of each joint, as they were bound; column-major.
    pub inverse_bind: Vec<[[f32; 4]; 4]>,
}

/// Channels that play together.
#[derive(Debug, Clone, PartialEq)]
pub struct Animation {
    /// Name in the file.
    pub name: String,
    /// Time of the last key, seconds.
    pub end: f32,
    /// Channels: which property of which node moves how.
    pub channels: Vec<Channel>,
}

/// World transforms at a time, column-major.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pose {
    /// Of each of [`Rig::instances`].
    pub instances: Vec<[[f32; 4]; 4]>,
    /// Of each of [`Rig::cameras`].
    pub cameras: Vec<[[f32; 4]; 4]>,
    /// Of each of [`Rig::lights`].
    pub lights: Vec<[[f32; 4]; 4]>,
    /// Of each of [`Rig::deforms`]: joints, weights, and whether its instances stand at the origin,
    /// see [`joints`].
    pub deforms: Vec<(Vec<Joint>, Vec<f32>, bool)>,
}

/// Matrices of a skin's joints in the space of its mesh's node, as glTF defines them: the node's
/// own place cancels out. `joints`: world transform and inverse bind matrix of each. True beside
/// them where the node has no inverse, or turns things over, which would turn front faces to the
/// back; then the vertices are in the world, and the mesh has to stand at its origin.
pub fn joints<'a>(node: Mat4, joints: impl Iterator<Item = (Mat4, &'a [[f32; 4]; 4])>) -> (Vec<Joint>, bool) {
    let inverse = Some(node.as_dmat4().inverse()).filter(|m| m.is_finite() && node.determinant() > 0.0);
    let from_world = inverse.unwrap_or(DMat4::IDENTITY);
    let rows = |(joint, bind): (Mat4, &[[f32; 4]; 4])| {
        let matrix = (from_world * joint.as_dmat4() * Mat4::from_cols_array_2d(bind).as_dmat4()).as_mat4();
        [0, 1, 2].map(|k| matrix.row(k).to_array())
    };
    (joints.map(rows).collect(), inverse.is_none())
}

impl Rig {
    /// Returns the transforms in animation `animation` at `time`, seconds; `None` if there is no such
    /// animation.
    pub fn pose(&self, animation: usize, time: f32) -> Option<Pose> {
        let animation = self.animations.get(animation)?;
        let mut nodes = self.nodes.clone();
        let mut weights: Vec<Vec<f32>> = self.deforms.iter().map(|d| d.weights.clone()).collect();
        for channel in &animation.channels {
            let value = channel.at(time);
            let node = &mut nodes[channel.node];
            match (channel.property, value.as_slice()) {
                (Property::Translation, &[x, y, z]) => node.translation = [x, y, z],
                (Property::Rotation, &[x, y, z, w]) => node.rotation = [x, y, z, w],
                (Property::Scale, &[x, y, z]) => node.scale = [x, y, z],
                (Property::Weights, value) => {
                    let of_node = self.deforms.iter().zip(&mut weights).filter(|(d, _)| d.node == channel.node);
                    of_node.filter(|(_, w)| w.len() == value.len()).for_each(|(_, w)| w.copy_from_slice(value));
                }
                _ => {}
            }
        }
        // With 64 bits: what is far from the file's origin may hang on nodes that are not.
        let root = DMat4::from_translation(-DVec3::from(self.origin));
        let mut exact: Vec<DMat4> = Vec::with_capacity(nodes.len());
        for node in &nodes {
            let [scale, translation] = [node.scale, node.translation].map(Vec3::from);
            let own = Mat4::from_scale_rotation_translation(scale, Quat::from_array(node.rotation), translation);
            exact.push(node.parent.map_or(root, |p| exact[p]) * own.as_dmat4());
        }
        let world: Vec<Mat4> = exact.iter().map(DMat4::as_mat4).collect();
        let placed = |nodes: &[usize]| nodes.iter().map(|&n| world[n].to_cols_array_2d()).collect();
        let deform = |(d, weights): (&RigDeform, Vec<f32>)| {
            let skin = d.skin.and_then(|s| self.skins.get(s));
            let (matrices, free) = skin.map_or((Vec::new(), false), |skin| {
                joints(world[d.node], skin.joints.iter().map(|&j| world[j]).zip(&skin.inverse_bind))
            });
            (matrices, weights, free)
        };
        Some(Pose {
            instances: placed(&self.instances),
            cameras: placed(&self.cameras),
            lights: placed(&self.lights),
            deforms: self.deforms.iter().zip(weights).map(deform).collect(),
        })
    }

    /// The animation that `name` names: by its name, else by its number from 0.
    pub fn find(&self, name: &str) -> Option<usize> {
        let number = || name.parse().ok().filter(|n| *n < self.animations.len());
        self.animations.iter().position(|a| a.name == name).or_else(number)
    }
}

impl Camera {
    /// Puts the camera where a node is, whose scale and shear are not a camera's. False, and
    /// nothing is done, where the node has no rotation.
    pub fn place(&mut self, world: Mat4) -> bool {
        let (_, rotation, position) = world.to_scale_rotation_translation();
        let sound = rotation.is_finite() && rotation.length_squared() >= 0.5 && position.is_finite();
        if sound {
            self.transform = Mat4::from_rotation_translation(rotation.normalize(), position).to_cols_array_2d();
        }
        sound
    }
}

impl LightKind {
    /// Puts the light where a node is, shining along its −Z. False, and nothing is done, where that
    /// is nowhere.
    pub fn place(&mut self, world: Mat4) -> bool {
        let to = world.w_axis.truncate();
        let Some(along) = world.transform_vector3(Vec3::NEG_Z).try_normalize().filter(|_| to.is_finite()) else {
            return false;
        };
        match self {
            LightKind::Directional { direction, .. } => *direction = along.into(),
            LightKind::Point { position, .. } => *position = to.into(),
            LightKind::Spot { position, direction, .. } => (*position, *direction) = (to.into(), along.into()),
        }
        true
    }
}

impl Scene {
    /// Puts objects, cameras, lights and vertices where animation `animation` has them at `time`,
    /// seconds. False if there is no such animation.
    pub fn pose(&mut self, animation: usize, time: f32) -> bool {
        let known = self.pose_parts(animation, time);
        if known {
            self.move_vertices();
        }
        known
    }

    /// As [`Scene::pose`], but leaves the vertices of [`Scene::meshes`] where they are: what the
    /// GPU and rays need is in [`Scene::deforms`]. For whoever draws one frame after the other.
    pub fn pose_parts(&mut self, animation: usize, time: f32) -> bool {
        let Some(pose) = self.rig.as_ref().and_then(|rig| rig.pose(animation, time)) else { return false };
        self.instances.iter_mut().zip(pose.instances).for_each(|(instance, transform)| instance.transform = transform);
        let world = |m: &[[f32; 4]; 4]| Mat4::from_cols_array_2d(m);
        self.cameras.iter_mut().zip(&pose.cameras).for_each(|(camera, m)| _ = camera.place(world(m)));
        self.lights.iter_mut().zip(&pose.lights).for_each(|(light, m)| _ = light.kind.place(world(m)));
        for (deform, (joints, weights, free)) in self.deforms.iter_mut().zip(pose.deforms) {
            (deform.joints, deform.weights) = (joints, weights);
            if free {
                let of_mesh = self.instances.iter_mut().filter(|i| i.mesh == deform.mesh);
                of_mesh.for_each(|i| i.transform = Mat4::IDENTITY.to_cols_array_2d());
            }
        }
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
        let width = if property == Property::Rotation { 4 } else { 3 };
        let values = values.iter().flat_map(|v| v[..width].to_vec()).collect();
        Channel { node: 1, property, interpolation, times: vec![1.0, 3.0], values }
    }

    fn rig(channel: Channel) -> Rig {
        let node =
            |parent, x| RigNode { parent, translation: [x, 0.0, 0.0], rotation: [0.0, 0.0, 0.0, 1.0], scale: [1.0; 3] };
        let animations = vec![Animation { name: String::new(), end: 3.0, channels: vec![channel] }];
        let nodes = vec![node(None, 10.0), node(Some(0), 1.0), node(Some(1), 2.0)];
        Rig { nodes, instances: vec![2, 0], animations, ..Rig::default() }
    }

    fn places(rig: &Rig, time: f32) -> [Vec3; 2] {
        let pose = rig.pose(0, time).unwrap().instances;
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
