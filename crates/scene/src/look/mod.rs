//! The first look: from where a scene is seen for which nobody says it, and what kind of place it
//! is.
//!
//! A scene is an **interior** if most places in it where one can stand have walls and a ceiling
//! around them, and no side of it is open enough to look in. There the camera stands in the room;
//! everything else is seen whole, from a three-quarter view a little above, or from the side that
//! lets one look deepest.

mod extent;
mod grid;
mod inside;
mod outside;
mod strays;

use bouncelight::scene::{Camera, Scene};
use extent::Extent;
use glam::Vec3;
use grid::Grid;
use inside::Stand;
use outside::Shape;

/// Vertical field of view of the camera that looks at a scene from outside, radians.
pub const FRAMING_YFOV: f32 = outside::YFOV;

/// Share of all directions in which a wall stands around who is in a room: windows and doors are
/// open.
const ENCLOSED: f32 = 0.8;
/// Of those, at most, in which one would see a wall from behind.
const BEHIND: f32 = 0.1;
/// Share of the places that are enclosed in a room, whatever one sees from outside …
const CLOSED: f32 = 0.9;
/// … or in one that lets nobody look in: …
const PLACES: f32 = 0.5;
/// … from a side that shows as much of a scene's depth one does.
const OPEN: f32 = 0.45;

/// How light gets to what a camera sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Daylight {
    /// From above: the camera stands in the open.
    Outdoors,
    /// Through windows and doors of the room where the camera stands; most of a sun's comes in from
    /// this direction (a unit vector towards it), if any does.
    Openings(Option<Vec3>),
    /// Not at all: the room is closed. A lamp could hang here, so high above the floor.
    Lamp {
        /// Under the ceiling.
        position: Vec3,
        /// Above the floor, the scene's unit.
        height: f32,
    },
}

/// Share of the places that have walls but no ceiling, from which on one looks into the rooms from
/// above.
const ROOFLESS: f32 = 0.3;

/// What a scene looks like from anywhere, so far as framing it goes.
pub struct Look<'a> {
    scene: &'a Scene,
    core: Extent,
    grid: Grid,
    /// Places to stand in a room.
    stands: Vec<Stand>,
    /// Towards the eye, from outside.
    back: Vec3,
    interior: bool,
}

impl<'a> Look<'a> {
    /// `None` where nothing is placed.
    pub fn new(scene: &'a Scene) -> Option<Self> {
        let mut core = Extent::of(scene)?;
        let grid = Grid::new(scene, core.low, core.high);
        let all = inside::stands(&grid);
        let count = all.len();
        let share = |n: usize| n as f32 / count.max(1) as f32;
        let free = all.iter().filter(|s| s.walls.behind <= BEHIND).count();
        let roofless = share(all.iter().filter(|s| s.open_above).count()) >= ROOFLESS;
        let stands: Vec<Stand> = all.into_iter().filter(|s| s.walls.is_room()).collect();
        let enclosed = share(stands.len());
        let shape = match () {
            () if roofless => Shape::Roofless,
            () if enclosed >= PLACES => Shape::Boxed,
            () => Shape::Body,
        };
        let (mut back, mut depth) = outside::direction(scene, &core, shape);
        let interior = enclosed >= CLOSED || (enclosed >= PLACES && depth < OPEN);
        if !interior {
            let subject = core.without_planes(scene);
            if subject.size() < core.size() {
                core = subject;
                (back, depth) = outside::direction(scene, &core, shape);
            }
        }
        tracing::info!(
            "{}: one can stand in {count} places, {free} of them in no solid body, {} of them enclosed{}; from outside \
             one sees {:.0} % deep: {}",
            scene.name,
            stands.len(),
            if roofless { ", many with walls but no ceiling" } else { "" },
            100.0 * depth,
            if interior { "an interior" } else { "seen from outside" }
        );
        Some(Self { scene, core, grid, stands, back, interior })
    }

    /// Whether it is a room that one has to stand in to see it.
    pub fn is_interior(&self) -> bool {
        self.interior
    }

    /// The first camera: in the room of an interior, else outside.
    pub fn camera(&self) -> Camera {
        let inside = if self.interior { inside::camera(&self.grid, &self.stands, None) } else { None };
        inside.unwrap_or_else(|| self.outside(self.back, FRAMING_YFOV, 1.0))
    }

    /// The same for pictures `aspect` times as wide as high, which show more of a scene that is
    /// seen from outside.
    pub fn camera_for(&self, aspect: f32) -> Camera {
        if self.interior { self.camera() } else { self.outside(self.back, FRAMING_YFOV, aspect) }
    }

    /// A camera that looks along −`back` (a unit vector) and sees all of it, or as much as one sees
    /// inside. `yfov` in radians, `aspect` is the picture's width by its height.
    pub fn from(&self, back: Vec3, yfov: f32, aspect: f32) -> Camera {
        let level = back.with_y(0.0).length() > 0.3;
        let inside = if self.interior && level { inside::camera(&self.grid, &self.stands, Some(-back)) } else { None };
        inside.unwrap_or_else(|| self.outside(back, yfov, aspect))
    }

    /// How light gets to what `camera` sees.
    pub fn daylight(&self, camera: &Camera) -> Daylight {
        let eye = Vec3::from(camera.eye());
        if self.core.holds(eye) && inside::around(&self.grid, eye).is_room() {
            inside::daylight(&self.grid, eye, &self.stands)
        } else {
            Daylight::Outdoors
        }
    }

    fn outside(&self, back: Vec3, yfov: f32, aspect: f32) -> Camera {
        outside::camera(self.scene, &self.core, back, yfov, aspect)
    }

    /// How far away that is what one would turn around who looks through `camera`: the middle of
    /// what is framed, or where one looks in a room.
    pub fn distance(&self, camera: &Camera) -> f32 {
        let (eye, forward) = (Vec3::from(camera.eye()), Vec3::from(camera.forward()));
        let size = self.core.size();
        if self.core.holds(eye) {
            self.grid.ray(eye, forward).map_or(0.5 * size, |h| 0.7 * h.distance).max(0.02 * size)
        } else {
            (self.core.middle() - eye).dot(forward).max(0.02 * size)
        }
    }

    /// How large what is framed is, its diagonal.
    pub fn size(&self) -> f32 {
        self.core.size()
    }
}

/// Name of the camera that looks at a scene from outside for want of one in the file.
pub const FRAMING: &str = "framing";

/// The camera of a scene that brings none; `look` is its, if anything is placed in it. It shows
/// everything in any picture at least as wide as high.
pub fn first_camera(look: Option<&Look<'_>>) -> Camera {
    match look {
        Some(look) => look.camera(),
        None => Camera { name: FRAMING.to_owned(), ..Camera::look_at([0.0, 0.0, 3.0], [0.0; 3], FRAMING_YFOV) },
    }
}
