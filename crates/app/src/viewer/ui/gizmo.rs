//! Handles in the picture: arrows along the axes of a selected object, and where lamps are. They
//! are drawn with every frame, and so follow the camera.

use crate::viewer::state::{Action, State};
use bouncelight::render::View as Eye;
use bouncelight::scene::LightKind;
use egui::{Align2, Color32, Pos2, Rect, Shape, Stroke, Vec2};
use glam::{Mat4, Vec3};

/// Length of an arrow, points.
const LENGTH: f32 = 64.0;
/// Distance from an arrow in which it is grabbed, points.
const REACH: f32 = 8.0;
/// X, Y and Z; told apart without colours by their letters.
const COLOURS: [Color32; 3] =
    [Color32::from_rgb(0xe0, 0x5a, 0x4b), Color32::from_rgb(0x7a, 0xc8, 0x50), Color32::from_rgb(0x56, 0xa6, 0xe9)];
const AXES: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];

/// Where points of the scene are seen in the picture at `rect`, points.
struct Lens {
    clip: Mat4,
    near: f32,
    rect: Rect,
    size: Vec2,
}

impl Lens {
    fn new(state: &State, rect: Rect, density: f32) -> Option<Self> {
        let shown = state.shown.as_ref()?;
        let eye = Eye::new(&state.navigator.camera(&shown.scene, state.size), state.size, [0.0; 2]);
        let size = Vec2::new(state.size[0] as f32, state.size[1] as f32) / density;
        Some(Self { clip: Mat4::from_cols_array_2d(&eye.clip_from_world), near: eye.near, rect, size })
    }

    fn place(&self, p: Vec3) -> Option<Pos2> {
        let p = self.clip * p.extend(1.0);
        let ndc = p.truncate() / p.w;
        (p.w > self.near).then(|| self.rect.min + Vec2::new(0.5 + 0.5 * ndc.x, 0.5 - 0.5 * ndc.y) * self.size)
    }
}

/// An arrow: its ends in the picture, and the metres that it is long.
fn arrows(state: &State, lens: &Lens) -> Option<[Option<(Pos2, Pos2, f32)>; 3]> {
    let [low, high] = state.selected_box()?;
    let middle = 0.5 * (low + high);
    let start = lens.place(middle)?;
    let forward = state.navigator.axes()[2];
    let depth = (middle - state.navigator.eye).dot(forward).max(1e-6);
    // So many metres are as long as an arrow that lies in the picture's plane.
    let metres = 2.0 * (0.5 * state.navigator.fov.to_radians()).tan() * depth / lens.size.y.max(1.0) * LENGTH;
    Some(AXES.map(|axis| {
        let end = lens.place(middle + metres * axis)?;
        // One that points at the eye can be neither seen nor pulled.
        (start.distance(end) > 0.2 * LENGTH).then_some((start, end, metres))
    }))
}

/// The axis whose arrow is under `p`.
pub fn grabbed(state: &State, p: Pos2, rect: Rect, density: f32) -> Option<usize> {
    let arrows = arrows(state, &Lens::new(state, rect, density)?)?;
    let distance = |(a, b, _): (Pos2, Pos2, f32)| {
        let along = b - a;
        let t = ((p - a).dot(along) / along.length_sq()).clamp(0.15, 1.1);
        (a + t * along).distance(p)
    };
    let near =
        arrows.iter().enumerate().filter_map(|(i, arrow)| Some((i, distance((*arrow)?)))).filter(|n| n.1 < REACH);
    near.min_by(|a, b| a.1.total_cmp(&b.1)).map(|n| n.0)
}

/// Moves the selected object along an axis by a drag of `d` points.
pub fn drag(state: &mut State, axis: usize, d: Vec2, rect: Rect, density: f32) {
    let arrow = Lens::new(state, rect, density).and_then(|lens| arrows(state, &lens)?[axis]);
    if let Some((a, b, metres)) = arrow {
        let along = b - a;
        state.apply(Action::Move(AXES[axis] * metres * (d.dot(along) / along.length_sq())));
    }
}

/// Arrows of the selected object, and lamps while their section is open.
pub fn shapes(
    state: &State,
    rect: Rect,
    density: f32,
    fonts: &dyn Fn(Pos2, Align2, &str, Color32) -> Shape,
) -> Vec<Shape> {
    let mut shapes = Vec::new();
    let Some(lens) = Lens::new(state, rect, density) else { return shapes };
    if let Some(arrows) = arrows(state, &lens) {
        for ((arrow, colour), name) in arrows.into_iter().zip(COLOURS).zip(["X", "Y", "Z"]) {
            let Some((a, b, _)) = arrow else { continue };
            let along = (b - a).normalized();
            let across = 4.5 * along.rot90();
            shapes.push(Shape::line_segment([a, b], Stroke::new(4.0, Color32::from_black_alpha(160))));
            shapes.push(Shape::line_segment([a, b], Stroke::new(2.5, colour)));
            let head = vec![b + 11.0 * along, b + across, b - across];
            shapes.push(Shape::convex_polygon(head, colour, Stroke::new(1.0, Color32::from_black_alpha(160))));
            shapes.push(fonts(b + 20.0 * along, Align2::CENTER_CENTER, name, colour));
        }
    }
    let lights = state.shown.iter().filter(|_| state.lamps).flat_map(|shown| shown.scene.lights.iter().enumerate());
    for (i, light) in lights {
        let (LightKind::Point { position, .. } | LightKind::Spot { position, .. }) = light.kind else { continue };
        let Some(p) = lens.place(position.into()).filter(|p| rect.contains(*p)) else { continue };
        let [r, g, b] = light.color.map(|c| (255.0 * c.clamp(0.0, 1.0).powf(1.0 / 2.2)) as u8);
        shapes.push(Shape::circle_filled(p, 7.0, Color32::from_black_alpha(170)));
        shapes.push(Shape::circle_filled(p, 4.0, Color32::from_rgb(r, g, b)));
        shapes.push(Shape::circle_stroke(p, 7.0, Stroke::new(1.5, Color32::WHITE)));
        if let LightKind::Spot { direction, .. } = light.kind {
            let to = lens.place(Vec3::from(position) + 0.1 * state.navigator.scale * Vec3::from(direction));
            if let Some(to) = to.filter(|to| to.distance(p) > 9.0) {
                let from = p + 7.0 * (to - p).normalized();
                shapes.push(Shape::line_segment([from, to], Stroke::new(1.5, Color32::WHITE)));
            }
        }
        shapes.push(fonts(p + Vec2::new(10.0, 0.0), Align2::LEFT_CENTER, &i.to_string(), Color32::WHITE));
    }
    shapes
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn state() -> (State, Rect) {
        let mut state = State::new(Default::default());
        state.show("cornell".into(), Arc::new(bouncelight_scene::bundled::scene("cornell").expect("bundled")));
        let rect = Rect::from_min_size(Pos2::new(10.0, 20.0), Vec2::new(640.0, 360.0));
        (state, rect)
    }

    /// The first object that has something below it.
    fn standing(state: &mut State) {
        let count = state.shown.as_ref().unwrap().scene.instances.len();
        let found = (0..count).find(|&i| {
            state.selected = Some(i);
            state.above_floor().is_some_and(|gap| gap.abs() < 0.05)
        });
        assert!(found.is_some(), "something stands on the floor");
    }

    #[test]
    fn an_arrow_pulls_along_its_axis_alone_and_as_far_as_the_hand() {
        let (mut state, rect) = state();
        standing(&mut state);
        let lens = Lens::new(&state, rect, 1.0).unwrap();
        let all = arrows(&state, &lens).unwrap();
        let (a, b, _) = all[0].expect("X lies in the picture");
        let half = a + 0.5 * (b - a);
        assert_eq!(grabbed(&state, half, rect, 1.0), Some(0));
        assert_eq!(grabbed(&state, half + Vec2::new(0.0, 40.0), rect, 1.0), None);
        drag(&mut state, 0, Vec2::new(20.0, 3.0), rect, 1.0);
        let object = state.selected.unwrap();
        let [x, y, z] = state.shown.as_ref().unwrap().moved[&object];
        assert!(x > 0.0 && (y, z) == (0.0, 0.0), "{x} {y} {z}");
        let after = arrows(&state, &Lens::new(&state, rect, 1.0).unwrap()).unwrap()[0].unwrap().0;
        assert!((after.x - a.x - 20.0).abs() < 2.0, "{after} from {a}");
    }

    #[test]
    fn what_is_lifted_falls_back_to_the_floor() {
        let (mut state, _) = state();
        standing(&mut state);
        let object = state.selected.unwrap();
        let gap = state.above_floor().unwrap();
        state.apply(Action::Move(Vec3::Y * 0.3));
        assert!((state.above_floor().unwrap() - gap - 0.3).abs() < 1e-4);
        state.apply(Action::Floor);
        assert!(state.above_floor().unwrap().abs() < 1e-4);
        let [_, y, _] = state.shown.as_ref().unwrap().moved[&object];
        assert!((y + gap).abs() < 1e-3, "{y}");
    }
}
