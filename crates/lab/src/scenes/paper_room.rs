//! The seed paper's scenes, exactly: room INDEX of the stream that its authors drew with Python's
//! `random.seed(0)`.
//!
//! Harris-Dewey and Klein 2021 (arXiv 2110.12039). A room is 50 to 250 of Blender's default
//! primitives scattered between four coloured walls on a coloured floor, lit by a sun and a grey
//! sky. The recipe stands in Blender's coordinates (Z up) and is turned to ours, (x, y, z) → (x, z,
//! −y), at the very end, as Blender's glTF exporter does.

use std::f64::consts::PI;

use glam::{DMat4, DVec3};
use rand_mt::Mt;

use bouncelight::scene::{Camera, Environment, Instance, Light, LightKind, Material, Mesh, SUN_ANGLE, Scene};
use bouncelight_scene::shapes::{self, Shape};

/// The largest index that [`bouncelight_scene::load`] accepts. The authors used 2,509 scenes; drawing the
/// stream takes a second about every hundred thousand.
pub const MAX_INDEX: u32 = 65_535;

/// Radiance of the grey sky in every room, W/(m²·sr).
pub const SKY_RADIANCE: f32 = 0.050_876_09;

/// Euler XYZ rotation of the sun in Blender's coordinates; it shines along its local −Z.
const SUN_EULER: [f64; 3] = [0.284_422_1, -0.154_949_6, -4.811_157_7];

/// Blender's Z-up coordinates to ours.
const Y_UP: DMat4 = DMat4::from_cols_array(&[1., 0., 0., 0., 0., 0., -1., 0., 0., 1., 0., 0., 0., 0., 0., 1.]);

/// Python's `random.Random(0)`: MT19937 seeded by `init_by_array([0])`.
struct Python(Mt);

impl Python {
    fn seed_zero() -> Self {
        Self(Mt::new_with_key([0u32]))
    }

    /// `randint(low, high)`: rejection sampling of `getrandbits(bit_length(n))` below n.
    fn randint(&mut self, low: i32, high: i32) -> i32 {
        let n = (high - low + 1) as u32;
        let shift = n.leading_zeros();
        loop {
            let bits = self.0.next_u32() >> shift;
            if bits < n {
                return low + bits as i32;
            }
        }
    }

    /// `random()`: 53 bits in [0, 1).
    fn random(&mut self) -> f64 {
        let high = f64::from(self.0.next_u32() >> 5);
        let low = f64::from(self.0.next_u32() >> 6);
        (high * 67_108_864.0 + low) / 9_007_199_254_740_992.0
    }

    /// Degrees as the recipe turns them into radians.
    fn angle(&mut self, high: i32) -> f64 {
        PI * f64::from(self.randint(0, high)) / 180.0
    }

    fn color(&mut self) -> [f32; 3] {
        std::array::from_fn(|_| self.random() as f32)
    }
}

/// One object as drawn from the stream, in Blender's coordinates.
struct Object {
    location: DVec3,
    euler: [f64; 3],
    color: [f32; 3],
    shape: Shape,
}

struct Room {
    objects: Vec<Object>,
    walls: [[f32; 3]; 5],
    pitch: f64,
    yaw: f64,
}

fn draw(rng: &mut Python) -> Room {
    let count = rng.randint(50, 250);
    let objects = (0..count)
        .map(|_| {
            let x = f64::from(rng.randint(-50, 50));
            let y = f64::from(rng.randint(-50, 50));
            let location = DVec3::new(x, y, f64::from(rng.randint(2, 15)));
            let euler = std::array::from_fn(|_| rng.angle(360));
            let color = rng.color();
            Object { location, euler, color, shape: Shape::ALL[rng.randint(0, 5) as usize] }
        })
        .collect();
    let walls = std::array::from_fn(|_| rng.color());
    let pitch = PI / 2.0 - rng.angle(10);
    let yaw = rng.angle(360);
    Room { objects, walls, pitch, yaw }
}

/// Blender's Euler XYZ: about X first, then Y, then Z, all fixed axes.
fn euler_xyz([x, y, z]: [f64; 3]) -> DMat4 {
    DMat4::from_rotation_z(z) * DMat4::from_rotation_y(y) * DMat4::from_rotation_x(x)
}

fn to_f32(matrix: DMat4) -> [[f32; 4]; 4] {
    matrix.as_mat4().to_cols_array_2d()
}

/// Room `index` of the stream. Drawing it takes time proportional to `index`, about a millisecond
/// for a hundred.
///
/// The camera's field of view is the one that makes pictures twice as wide as high show what the
/// authors' show.
pub fn scene(index: u32) -> Scene {
    let mut rng = Python::seed_zero();
    for _ in 0..index {
        draw(&mut rng);
    }
    let room = draw(&mut rng);

    let shapes = Shape::ALL.map(shapes::flat);
    let mut scene = Scene {
        name: format!("paper-room:{index}"),
        environment: Environment::constant([SKY_RADIANCE; 3]),
        ..Scene::default()
    };
    let from_y_up = Y_UP.transpose();
    let mut place = |name: String, shape: Shape, color: [f32; 3], blender: DMat4| {
        let material = scene.materials.len();
        scene.materials.push(Material {
            name: name.clone(),
            base_color: [color[0], color[1], color[2], 1.0],
            metallic: 0.0,
            roughness: 0.5,
            double_sided: true,
            ..Material::default()
        });
        let mesh = scene.meshes.len();
        scene.meshes.push(Mesh { name: name.clone(), material, ..shapes[shape as usize].clone() });
        scene.instances.push(Instance { name, mesh, transform: to_f32(Y_UP * blender * from_y_up) });
    };
    for (i, object) in room.objects.iter().enumerate() {
        let world = DMat4::from_translation(object.location) * euler_xyz(object.euler);
        place(format!("{}_{i:03}", object.shape.name()), object.shape, object.color, world);
    }
    let walls = [
        ("wall_nx", [-50.0, 0.0, 25.0], [50.0, 1.0, 25.0], 90.0f64),
        ("wall_ny", [0.0, -50.0, 25.0], [50.0, 1.0, 25.0], 0.0),
        ("wall_py", [0.0, 50.0, 25.0], [50.0, 1.0, 25.0], 0.0),
        ("wall_px", [50.0, 0.0, 25.0], [50.0, 1.0, 25.0], 90.0),
        ("floor", [0.0, 0.0, 0.0], [50.0, 50.0, 1.0], 0.0),
    ];
    for ((name, location, scale, turn), color) in walls.into_iter().zip(room.walls) {
        let turned = DMat4::from_translation(DVec3::from(location)) * DMat4::from_rotation_z(turn.to_radians());
        place(name.to_owned(), Shape::Cube, color, turned * DMat4::from_scale(DVec3::from(scale)));
    }

    let direction = (Y_UP * euler_xyz(SUN_EULER)).transform_vector3(DVec3::NEG_Z).normalize();
    scene.lights.push(Light {
        name: "sun".to_owned(),
        color: [1.0; 3],
        kind: LightKind::Directional { direction: direction.as_vec3().into(), irradiance: 1.0, angle: SUN_ANGLE },
        is_emissive_proxy: false,
    });
    let camera = DMat4::from_translation(DVec3::new(0.0, 0.0, 10.0)) * euler_xyz([room.pitch, 0.0, room.yaw]);
    scene.cameras.push(Camera {
        name: "camera".to_owned(),
        transform: to_f32(Y_UP * camera),
        // A 36 mm wide sensor behind a 30 mm lens is 18 mm high at 2:1.
        yfov: 2.0 * (9.0f32 / 30.0).atan(),
        aspect: None,
        near: 0.1,
        far: 100.0,
    });
    scene
}
