//! Cameras. An orthographic one becomes a long lens from afar, since all passes after this know
//! perspectives only.

use super::Loader;
use bouncelight::scene::Camera;
use bouncelight::scene::bounds::world_bounds;
use bouncelight::scene::rig::RigNode;
use glam::{Mat4, Vec3};
use gltf::camera::Projection;

/// Vertical field of view of the lens that stands for an orthographic camera, radians. At 1° what
/// is as far before or behind the middle as the picture is high is shown 1.7 % too large or too
/// small.
const LENS: f32 = std::f32::consts::PI / 180.0;

/// No length of a camera's is larger, metres.
const MOST: f32 = 1e12;

/// What is said of a camera that can show nothing.
const IMPOSSIBLE: &str = "has an impossible lens or transform and is left out";

/// An orthographic camera, whose lens waits for the whole scene to be known.
pub(super) struct Orthographic {
    /// Index in the scene's cameras.
    camera: usize,
    /// World space from the node's.
    world: Mat4,
    /// Half the height of what it shows, metres.
    ymag: f32,
    /// Its planes, metres.
    znear: f32,
    zfar: f32,
    /// How far the eye was moved back along its +Z, metres.
    back: f32,
}

impl Loader<'_> {
    /// Adds a node's camera. An orthographic one stands at the node until [`Loader::move_back`].
    pub(super) fn camera(&mut self, camera: &gltf::Camera, node: &str, world: Mat4) {
        let place = format!("cameras[{}] '{node}'", camera.index());
        let (yfov, aspect, near, far, flat) = match camera.projection() {
            Projection::Perspective(lens) => (lens.yfov(), lens.aspect_ratio(), lens.znear(), lens.zfar(), None),
            Projection::Orthographic(lens) => {
                (LENS, Some(lens.xmag() / lens.ymag()), lens.znear(), Some(lens.zfar()), Some(lens))
            }
        };
        let aspect = aspect.filter(|a| *a > 0.0 && *a < MOST);
        let transform = Mat4::IDENTITY.to_cols_array_2d();
        let far = far.filter(|&far| far > near).unwrap_or(f32::INFINITY);
        let mut camera = Camera { name: node.to_owned(), transform, yfov, aspect, near, far };
        if let Some(lens) = &flat {
            let sizes = [lens.xmag(), lens.ymag()];
            if sizes.iter().any(|s| !(*s > 0.0 && *s < MOST)) || near.is_nan() || near.abs() > MOST {
                let [x, y] = sizes;
                let what = format!(
                    "is orthographic with xmag {x}, ymag {y} and znear {near} and is left out; \
                     xmag and ymag must be above 0"
                );
                return self.warn(&place, &what);
            }
        } else if !(yfov > 0.0 && yfov < std::f32::consts::PI && near > 0.0 && near.is_finite()) {
            return self.warn(&place, IMPOSSIBLE);
        }
        if !camera.place(world) {
            return self.warn(&place, IMPOSSIBLE);
        }
        if let Some(lens) = &flat {
            let (camera, ymag) = (self.scene.cameras.len(), lens.ymag());
            self.orthographic.push(Orthographic { camera, world, ymag, znear: near, zfar: far, back: 0.0 });
            self.warn(&place, "is orthographic and is drawn by a lens of 1° from afar");
        }
        self.scene.cameras.push(camera);
    }

    /// Moves the eyes of orthographic cameras back as far as makes the lens show 2 · `ymag` at the
    /// reference plane: in the middle of what there is between the camera's planes, and at its near
    /// plane where there is nothing.
    pub(super) fn move_back(&mut self) {
        if self.orthographic.is_empty() {
            return;
        }
        let bounds = world_bounds(&self.scene);
        for flat in &mut self.orthographic {
            let camera = &mut self.scene.cameras[flat.camera];
            let (eye, forward) = (Vec3::from(camera.eye()), Vec3::from(camera.forward()));
            let depth = |p: Vec3| (p - eye).dot(forward);
            let [nearest, farthest] = bounds.map_or([flat.znear; 2], |(low, high)| {
                let (low, high) = (Vec3::from(low), Vec3::from(high));
                let reach = (0.5 * (high - low)).dot(forward.abs());
                let middle = depth(0.5 * (low + high));
                [middle - reach, middle + reach]
            });
            let first = nearest.max(flat.znear);
            let last = farthest.min(flat.zfar).max(first);
            // Where the eye would stand within a deep scene, its front has the say: nothing may lie
            // behind the eye, nor be shown at more than twice its size.
            let distance = flat.ymag / (0.5 * LENS).tan();
            let reference = (0.5 * (first + last)).min(first + 0.5 * distance);
            let reference = if reference.abs() < MOST { reference } else { flat.znear };
            flat.back = distance - reference;
            let at = eye - forward * flat.back;
            [camera.transform[3][0], camera.transform[3][1], camera.transform[3][2]] = at.into();
            // Nothing lies before `first`, which is half of `distance` away at least; so this cuts
            // as the file says.
            camera.near = (flat.znear + flat.back).max(0.01 * distance);
            camera.far = flat.zfar + flat.back;
        }
    }

    /// Nodes of their own for eyes that were moved back from their node, so that they move with it.
    pub(super) fn with_eyes(&self, nodes: &mut Vec<RigNode>, mut cameras: Vec<usize>) -> Vec<usize> {
        for flat in &self.orthographic {
            // A node's scale is not a camera's.
            let scale = flat.world.z_axis.truncate().length().max(f32::MIN_POSITIVE);
            let translation = [0.0, 0.0, flat.back / scale];
            let (rotation, parent) = ([0.0, 0.0, 0.0, 1.0], Some(cameras[flat.camera]));
            nodes.push(RigNode { parent, translation, rotation, scale: [1.0; 3] });
            cameras[flat.camera] = nodes.len() - 1;
        }
        cameras
    }
}
