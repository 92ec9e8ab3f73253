//! Where the viewer's camera stands, and how hands move it. No window, no wgpu.

use bouncelight::scene::{Camera, Scene, bounds::world_bounds};
use bouncelight_scene::look::Look;
use glam::{Quat, Vec3};

/// Steepest angle between view and horizon, radians: straight up has no left and right.
const STEEPEST: f32 = 1.553;
/// Radians that a drag over one point of the window turns.
const TURN: f32 = 0.006;

/// Vertical field of view of the long lens, degrees.
const LONG: f32 = 2.0;

/// Sides from which a scene can be looked at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Preset {
    Front,
    Right,
    Back,
    Left,
    Top,
    Corner,
}

impl Preset {
    /// All of them.
    pub const ALL: [Preset; 6] =
        [Preset::Front, Preset::Right, Preset::Back, Preset::Left, Preset::Top, Preset::Corner];

    /// What the window calls it.
    pub fn title(self) -> &'static str {
        ["Front", "Right", "Back", "Left", "Top", "3/4 view"][self as usize]
    }

    /// From the scene towards the eye.
    fn direction(self) -> Vec3 {
        [Vec3::Z, Vec3::X, Vec3::NEG_Z, Vec3::NEG_X, Vec3::new(0.0, 1.0, 0.02), Vec3::new(1.0, 0.6, 1.0)][self as usize]
            .normalize()
    }
}

/// The camera as hands move it: an eye that looks at a target, level, or one of the file's cameras
/// as it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Navigator {
    /// Where the eye is, metres.
    pub eye: Vec3,
    /// What it looks at and turns around.
    pub target: Vec3,
    /// Vertical field of view, degrees.
    pub fov: f32,
    /// Drags turn the head instead of the scene.
    pub fly: bool,
    /// Metres a second.
    pub speed: f32,
    /// Radius of the scene, metres: what lengths are small or large against.
    pub scale: f32,
    /// The file's camera that is used untouched.
    pub file_camera: Option<usize>,
}

impl Default for Navigator {
    fn default() -> Self {
        Self {
            eye: Vec3::new(0.0, 0.0, 3.0),
            target: Vec3::ZERO,
            fov: 45.0,
            fly: false,
            speed: 1.0,
            scale: 1.0,
            file_camera: None,
        }
    }
}

impl Navigator {
    /// The camera to draw pictures of `size` pixels with.
    pub fn camera(&self, scene: &Scene, size: [u32; 2]) -> Camera {
        match self.file_camera.and_then(|n| scene.cameras.get(n)) {
            Some(camera) => camera.for_picture(size),
            None => Camera::look_at(self.eye.into(), self.target.into(), self.fov.to_radians()),
        }
    }

    /// Takes camera `n` of the file for pictures of `size` pixels; nothing where there is none.
    pub fn take(&mut self, scene: &Scene, n: usize, size: [u32; 2]) {
        let Some(camera) = scene.cameras.get(n).map(|camera| camera.for_picture(size)) else { return };
        let (eye, forward) = (Vec3::from(camera.eye()), Vec3::from(camera.forward()));
        let (middle, radius) = sphere(scene);
        // The point of the view axis nearest to the scene's middle, but in front.
        // A long lens stands as much further away.
        let longer = 1.0f32.max(0.4 / (0.5 * camera.yfov).tan());
        let distance = (middle - eye).dot(forward).clamp(0.1 * radius, 10.0 * longer * radius);
        (self.eye, self.target) = (eye, eye + forward * distance);
        self.fov = camera.yfov.to_degrees();
        (self.speed, self.scale) = (0.4 * radius, radius);
        self.file_camera = Some(n);
    }

    /// Pictures have another size: the file's camera, if it is on show, may see more or less.
    pub fn resize(&mut self, scene: &Scene, size: [u32; 2]) {
        if let Some(camera) = self.file_camera.and_then(|n| scene.cameras.get(n)) {
            self.fov = camera.for_picture(size).yfov.to_degrees();
        }
    }

    /// The file's camera, which is the one on show, has moved.
    pub fn follow(&mut self, camera: &Camera) {
        let distance = self.eye.distance(self.target);
        self.eye = camera.eye().into();
        self.target = self.eye + distance * Vec3::from(camera.forward());
    }

    fn moved(&mut self) {
        self.file_camera = None;
    }

    /// From the target to the eye.
    fn back(&self) -> Vec3 {
        self.eye - self.target
    }

    /// Turns `back` by a drag of (dx, dy) points, level, not over the poles.
    fn turned(back: Vec3, dx: f32, dy: f32) -> Vec3 {
        let length = back.length().max(f32::MIN_POSITIVE);
        let yaw = back.x.atan2(back.z) - TURN * dx;
        let pitch = ((back.y / length).clamp(-1.0, 1.0).asin() + TURN * dy).clamp(-STEEPEST, STEEPEST);
        length * (Quat::from_rotation_y(yaw) * Vec3::new(0.0, pitch.sin(), pitch.cos()))
    }

    /// The eye goes around the target.
    pub fn orbit(&mut self, dx: f32, dy: f32) {
        self.eye = self.target + Self::turned(self.back(), dx, dy);
        self.moved();
    }

    /// The head turns; the eye stays.
    pub fn look(&mut self, dx: f32, dy: f32) {
        self.target = self.eye - Self::turned(self.back(), dx, dy);
        self.moved();
    }

    /// Eye and target slide so that what lies at the target follows the pointer over a window of
    /// `height` points.
    pub fn pan(&mut self, dx: f32, dy: f32, height: f32) {
        let metres = 2.0 * (0.5 * self.fov.to_radians()).tan() * self.back().length() / height.max(1.0);
        let [right, up, _] = self.axes();
        let by = (up * dy - right * dx) * metres;
        (self.eye, self.target) = (self.eye + by, self.target + by);
        self.moved();
    }

    /// Nearer (positive) or farther by notches of a wheel.
    pub fn dolly(&mut self, notches: f32) {
        let back = self.back() * 0.88f32.powf(notches);
        self.eye = self.target + back.clamp_length(1e-3 * self.scale, 1e6 * self.scale);
        self.moved();
    }

    /// Changes between a lens of 2°, for which parallels are nearly parallel, and the usual one;
    /// what is at the target keeps its size.
    pub fn long_lens(&mut self) {
        let half = |degrees: f32| (0.5 * degrees.to_radians()).tan();
        let to = if self.is_long() { 45.0 } else { LONG };
        let back = self.back() * (half(self.fov) / half(to));
        (self.eye, self.fov) = (self.target + back, to);
        self.moved();
    }

    /// Whether parallels are nearly parallel.
    pub fn is_long(&self) -> bool {
        self.fov <= 1.5 * LONG
    }

    /// The wheel while flying.
    pub fn faster(&mut self, notches: f32) {
        self.speed = (self.speed * 1.25f32.powf(notches)).clamp(1e-3 * self.scale, 1e5 * self.scale);
    }

    /// Flies along right, up and forward for `seconds`.
    pub fn fly(&mut self, direction: Vec3, seconds: f32) {
        let [right, _, forward] = self.axes();
        let Some(direction) = (right * direction.x + Vec3::Y * direction.y + forward * direction.z).try_normalize()
        else {
            return;
        };
        let by = direction * self.speed * seconds;
        (self.eye, self.target) = (self.eye + by, self.target + by);
        self.moved();
    }

    /// All of the scene in view, from where one looks now; in a room, as much of it as one sees
    /// from inside.
    pub fn fit(&mut self, scene: &Scene, aspect: f32) {
        let back = self.back();
        self.frame(scene, aspect, |room| if room { level(back) } else { back.normalize_or(Vec3::Z) });
    }

    /// All of the scene in view, from a side.
    pub fn preset(&mut self, scene: &Scene, aspect: f32, preset: Preset) {
        self.frame(scene, aspect, |_| preset.direction());
    }

    /// Frames the scene from a direction, which may depend on whether it is a room.
    fn frame(&mut self, scene: &Scene, aspect: f32, back: impl FnOnce(bool) -> Vec3) {
        if let Some(look) = Look::new(scene) {
            let camera = look.from(back(look.is_interior()), self.fov.to_radians(), aspect);
            self.stand(&look, &camera);
        }
    }

    /// Where a scene without cameras is first seen from, in a picture of a shape.
    pub fn first(&mut self, scene: &Scene, aspect: f32) {
        if let Some(look) = Look::new(scene) {
            self.stand(&look, &look.camera_for(aspect));
        }
    }

    fn stand(&mut self, look: &Look<'_>, camera: &Camera) {
        let (eye, forward) = (Vec3::from(camera.eye()), Vec3::from(camera.forward()));
        (self.eye, self.target) = (eye, eye + forward * look.distance(camera));
        self.fov = camera.yfov.to_degrees();
        (self.speed, self.scale) = (0.2 * look.size(), 0.5 * look.size());
        self.moved();
    }

    /// Right, up and forward.
    pub fn axes(&self) -> [Vec3; 3] {
        let forward = -self.back().normalize_or(Vec3::Z);
        let right = forward.cross(Vec3::Y).normalize_or(Vec3::X);
        [right, right.cross(forward), forward]
    }
}

/// The same direction without its rise.
fn level(v: Vec3) -> Vec3 {
    v.with_y(0.0).normalize_or(Vec3::Z)
}

/// Middle and radius of a sphere around the scene.
pub fn sphere(scene: &Scene) -> (Vec3, f32) {
    match world_bounds(scene) {
        Some((low, high)) => {
            let (low, high) = (Vec3::from(low), Vec3::from(high));
            let radius = 0.5 * low.distance(high);
            (0.5 * (low + high), if radius > 0.0 { radius } else { 1.0 })
        }
        None => (Vec3::ZERO, 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene() -> Scene {
        bouncelight_scene::bundled::scene("cornell").expect("bundled")
    }

    #[test]
    fn orbiting_keeps_the_distance_and_never_tips_over() {
        let mut n = Navigator::default();
        for _ in 0..50 {
            n.orbit(13.0, 40.0);
        }
        assert!((n.back().length() - 3.0).abs() < 1e-3);
        assert!(n.back().y > 2.9 && n.axes()[1].y > 0.0, "{n:?}");
        // Dragging right shows the left side of what is looked at: the eye goes left.
        let mut n = Navigator::default();
        n.orbit(10.0, 0.0);
        assert!(n.eye.x < 0.0);
    }

    #[test]
    fn looking_keeps_the_eye_and_flying_follows_the_view() {
        let mut n = Navigator::default();
        n.look(100.0, 0.0);
        assert_eq!(n.eye, Vec3::new(0.0, 0.0, 3.0));
        let forward = n.axes()[2];
        n.speed = 2.0;
        n.fly(Vec3::Z, 0.5);
        assert!((n.eye - Vec3::new(0.0, 0.0, 3.0)).distance(forward) < 1e-5);
        n.fly(Vec3::ZERO, 1.0);
        n.faster(1.0);
        assert_eq!(n.speed, 2.5);
    }

    #[test]
    fn a_pan_moves_the_target_with_the_pointer() {
        let mut n = Navigator::default();
        n.pan(0.0, 100.0, 200.0);
        // Half the window's height is tan(22.5°)·3 metres; dragging down brings down what was
        // above.
        assert!((n.target.y - 3.0 * 22.5f32.to_radians().tan()).abs() < 1e-4, "{}", n.target.y);
    }

    #[test]
    fn a_long_lens_keeps_the_size_of_what_is_looked_at() {
        let scene = scene();
        let mut n = Navigator { target: Vec3::new(0.0, 1.0, 0.0), ..Navigator::default() };
        let seen = |n: &Navigator, p: Vec3| {
            let view = bouncelight::render::View::new(&n.camera(&scene, [100, 100]), [100, 100], [0.0; 2]);
            let p = glam::Mat4::from_cols_array_2d(&view.clip_from_world) * p.extend(1.0);
            p.truncate() / p.w
        };
        let (at, behind) = (n.target + Vec3::X, n.target + Vec3::new(1.0, 0.0, -1.0));
        let before = [seen(&n, at), seen(&n, behind)];
        n.long_lens();
        let after = [seen(&n, at), seen(&n, behind)];
        assert!((before[0].x - after[0].x).abs() < 0.01, "{before:?} {after:?}");
        // A metre behind it, size is lost only through the usual lens.
        assert!((after[1].x / after[0].x - 1.0).abs() < 0.02 && before[1].x / before[0].x < 0.85);
        n.long_lens();
        assert!((n.eye - Vec3::new(0.0, 0.0, 3.0)).length() < 1e-3 && !n.is_long());
    }

    #[test]
    fn a_lens_from_afar_turns_around_what_it_looks_at() {
        let mut scene = scene();
        let (middle, radius) = sphere(&scene);
        // As an orthographic camera of a file is drawn.
        let yfov = 1.0f32.to_radians();
        let away = radius / (0.5 * yfov).tan();
        scene.cameras[0] = Camera::look_at((middle + away * Vec3::Z).into(), middle.into(), yfov);
        let mut n = Navigator::default();
        n.take(&scene, 0, [100, 100]);
        assert!(n.target.distance(middle) < 0.01 * radius && n.is_long(), "{n:?}");
    }

    #[test]
    fn fitting_shows_every_corner_in_any_shape_of_window() {
        let scene = scene();
        let (low, high) = world_bounds(&scene).unwrap();
        for preset in Preset::ALL {
            for size in [[640u32, 360], [200, 400]] {
                let mut n = Navigator::default();
                n.preset(&scene, size[0] as f32 / size[1] as f32, preset);
                let view = bouncelight::render::View::new(&n.camera(&scene, size), size, [0.0; 2]);
                let clip = glam::Mat4::from_cols_array_2d(&view.clip_from_world);
                for i in 0..8 {
                    let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
                    let p = clip * Vec3::new(pick(0), pick(1), pick(2)).extend(1.0);
                    assert!(p.w > 0.0 && p.x.abs() <= p.w && p.y.abs() <= p.w, "{preset:?} {size:?} corner {i}: {p}");
                }
            }
        }
    }

    #[test]
    fn a_narrow_window_cuts_no_sides_off_a_file_camera() {
        let mut scene = scene();
        scene.cameras[0].aspect = Some(2.0);
        let wide = |camera: &Camera, size: [u32; 2]| bouncelight::render::View::new(camera, size, [0.0; 2]).tan_half;
        let framed = wide(&scene.cameras[0], [400, 200]);
        let mut n = Navigator::default();
        n.take(&scene, 0, [400, 200]);
        for (size, kept) in [([400, 200], 0), ([200, 400], 0), ([900, 200], 1)] {
            n.resize(&scene, size);
            let seen = wide(&n.camera(&scene, size), size);
            assert!((seen[kept] - framed[kept]).abs() < 1e-5, "{size:?}: {seen:?} for {framed:?}");
            assert!(seen[0] > framed[0] - 1e-5 && seen[1] > framed[1] - 1e-5, "{size:?}: {seen:?} for {framed:?}");
            // Hands go on from there, and what moves is no file's camera any more.
            let mut moved = n.clone();
            moved.dolly(0.0);
            assert!((wide(&moved.camera(&scene, size), size)[1] - seen[1]).abs() < 1e-5, "{size:?}");
        }
        scene.cameras[0].aspect = None;
        assert_eq!(n.camera(&scene, [200, 400]).yfov, scene.cameras[0].yfov);
    }

    #[test]
    fn a_file_camera_is_used_as_it_is_until_it_is_moved() {
        let scene = scene();
        let mut n = Navigator::default();
        n.take(&scene, 0, [100, 100]);
        assert_eq!(n.camera(&scene, [100, 100]).transform, scene.cameras[0].transform);
        n.dolly(1.0);
        assert_eq!(n.file_camera, None);
        assert_ne!(n.camera(&scene, [100, 100]).transform, scene.cameras[0].transform);
        n.take(&scene, 99, [100, 100]);
        assert_eq!(n.file_camera, None);
    }
}
