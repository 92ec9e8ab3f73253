//! Small scenes, made in code: boxes without gloss under lamps, suns and skies.

use bouncelight::scene::{Camera, Environment, Instance, Light, LightKind, Material, Scene};
use bouncelight_scene::shapes;
use glam::{Mat4, Quat, Vec3};

/// Low corner, high corner, albedo.
pub type Block = ([f32; 3], [f32; 3], [f32; 3]);

pub const GREY: [f32; 3] = [0.5; 3];
pub const WHITE: [f32; 3] = [0.8; 3];
pub const RED: [f32; 3] = [0.8, 0.1, 0.1];

/// Boxes under lights and an even sky.
pub fn scene(blocks: &[Block], lights: &[LightKind], sky: f32) -> Scene {
    let mut scene = Scene { name: "stability".into(), ..Scene::default() };
    scene.environment = Environment::constant([sky; 3]);
    for (low, high, colour) in blocks {
        block(&mut scene, *low, *high, *colour);
    }
    scene.lights = lights.iter().map(|kind| light(*kind, [1.0; 3])).collect();
    scene
}

pub fn light(kind: LightKind, color: [f32; 3]) -> Light {
    Light { name: String::new(), color, kind, is_emissive_proxy: false }
}

/// A dielectric without gloss.
pub fn matt(colour: [f32; 3]) -> Material {
    let [r, g, b] = colour;
    Material { base_color: [r, g, b, 1.0], metallic: 0.0, f0: 0.0, ..Material::default() }
}

/// Adds a box; its number among the instances.
pub fn block(scene: &mut Scene, low: [f32; 3], high: [f32; 3], colour: [f32; 3]) -> usize {
    let (low, high) = (Vec3::from(low), Vec3::from(high));
    body(scene, shapes::Shape::Cube, 0.5 * (low + high), 0.5 * (high - low), Quat::IDENTITY, matt(colour))
}

/// Adds one of Blender's shapes; its number among the instances.
pub fn body(scene: &mut Scene, shape: shapes::Shape, at: Vec3, size: Vec3, turn: Quat, material: Material) -> usize {
    scene.materials.push(material);
    let mut mesh = shapes::flat(shape);
    mesh.material = scene.materials.len() - 1;
    scene.meshes.push(mesh);
    let transform = Mat4::from_scale_rotation_translation(size, turn, at).to_cols_array_2d();
    scene.instances.push(Instance { name: String::new(), mesh: scene.meshes.len() - 1, transform });
    scene.instances.len() - 1
}

pub fn sun(direction: [f32; 3], irradiance: f32) -> LightKind {
    LightKind::Directional { direction, irradiance, angle: 0.0 }
}

pub fn lamp(position: [f32; 3], intensity: f32) -> LightKind {
    LightKind::Point { position, intensity, radius: 0.02, range: None }
}

/// Shines onto the wall behind the camera of [`hall`].
pub const BACKWARDS: [f32; 3] = [0.2, -0.7, 0.7];

/// A floor of 12 m, an open top, four walls of 4 m, a block. The wall at +Z, behind
/// [`hall_camera`], has a colour of its own.
pub fn hall(behind: [f32; 3], lights: &[LightKind], sky: f32) -> Scene {
    hall_of(GREY, behind, lights, sky)
}

/// As [`hall`], all else of another colour.
pub fn hall_of(colour: [f32; 3], behind: [f32; 3], lights: &[LightKind], sky: f32) -> Scene {
    let blocks = [
        ([-6.0, -0.2, -6.0], [6.0, 0.0, 6.0], colour),
        ([-6.2, 0.0, -6.0], [-6.0, 4.0, 6.0], colour),
        ([6.0, 0.0, -6.0], [6.2, 4.0, 6.0], colour),
        ([-6.0, 0.0, -6.2], [6.0, 4.0, -6.0], colour),
        ([-6.0, 0.0, 6.0], [6.0, 4.0, 6.2], behind),
        ([-1.0, 0.0, -3.0], [1.0, 1.5, -1.0], colour),
    ];
    scene(&blocks, lights, sky)
}

/// Looks at the hall's far wall.
pub fn hall_camera() -> Camera {
    Camera::look_at([0.0, 1.6, 3.0], [0.0, 0.6, -3.0], 1.0)
}

/// The six slabs, 0.2 m thick, about a closed room.
pub fn shell(low: [f32; 3], high: [f32; 3], colour: [f32; 3]) -> Vec<Block> {
    let mut blocks = Vec::new();
    for axis in 0..3 {
        for side in 0..2 {
            let (mut from, mut to) = (low.map(|v| v - 0.2), high.map(|v| v + 0.2));
            if side == 0 {
                to[axis] = low[axis]
            } else {
                from[axis] = high[axis]
            }
            blocks.push((from, to, colour));
        }
    }
    blocks
}

/// Two rooms of 4×4×3 m side by side, closed but for an opening of 1×2 m in the wall between them,
/// which is `thick` metres thick. The first room is at x < 0.
pub fn two_rooms(thick: f32, opening: bool, colour: [f32; 3]) -> Vec<Block> {
    let mut blocks = shell([-4.0, 0.0, -2.0], [4.0, 3.0, 2.0], colour);
    // No plane of any grid.
    let (low, high) = (0.13, 0.13 + thick);
    if opening {
        blocks.push(([low, 0.0, -2.0], [high, 3.0, -0.5], colour));
        blocks.push(([low, 0.0, 0.5], [high, 3.0, 2.0], colour));
        blocks.push(([low, 2.0, -0.5], [high, 3.0, 0.5], colour));
    } else {
        blocks.push(([low, 0.0, -2.0], [high, 3.0, 2.0], colour));
    }
    blocks
}

/// `camera` turned about the vertical through its own place, degrees, counter-clockwise from above.
pub fn yawed(camera: &Camera, degrees: f32) -> Camera {
    let turn = Mat4::from_rotation_y(degrees.to_radians());
    let mut transform = turn * Mat4::from_cols_array_2d(&camera.transform);
    transform.w_axis = Mat4::from_cols_array_2d(&camera.transform).w_axis;
    Camera { transform: transform.to_cols_array_2d(), ..camera.clone() }
}

/// Everything `factor` times as large, seen and lit alike.
pub fn scaled(scene: &Scene, camera: &Camera, factor: f32) -> (Scene, Camera) {
    let scale = Mat4::from_scale(Vec3::splat(factor));
    let mut scene = scene.clone();
    for instance in &mut scene.instances {
        instance.transform = (scale * Mat4::from_cols_array_2d(&instance.transform)).to_cols_array_2d();
    }
    for light in &mut scene.lights {
        if let LightKind::Point { position, intensity, radius, .. } = &mut light.kind {
            *position = position.map(|v| v * factor);
            *intensity *= factor * factor;
            *radius *= factor;
        }
    }
    let mut camera = camera.clone();
    (0..3).for_each(|k| camera.transform[3][k] *= factor);
    camera.near *= factor;
    (scene, camera)
}
