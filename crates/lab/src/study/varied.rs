//! Rooms of the paper's kind that are none of the paper's: other lights, skies, roofs with a
//! window, metals, sizes, colours and camera heights. What a network learns from in order not to
//! take one sun and one grey sky for the world.

use bouncelight::numbers::SplitMix;
use bouncelight::scene::{Camera, Environment, Instance, Light, LightKind, Material, SUN_ANGLE, Scene};
use bouncelight_scene::shapes::{self, Shape};
use glam::{Mat4, Quat, Vec3};
use std::f32::consts::{PI, TAU};

/// Half the edge of the floor, metres, as in the paper's rooms.
const HALF: f32 = 50.0;
/// Half the thickness of walls, floor and roof, metres.
const THICK: f32 = 1.0;

/// Room `index` of this stream; the same index gives the same room. 20 to 250 primitives of 1 to 6
/// metres between walls of 10 to 50 metres; 40 % have a roof with a window; the light is a sun
/// (half of them), a point light or a spot light, tinted, 15 % of the objects are metals; the sky
/// may be tinted, dim or black.
pub fn scene(index: u32) -> Scene {
    let mut room = Room::new(index);
    let height = room.between(10.0, 50.0);
    let n = &mut room.numbers;
    let count = 20 + (n.next() * 231.0) as u32;
    for i in 0..count {
        let shape = Shape::ALL[(room.numbers.next() * 6.0) as usize % 6];
        let at =
            Vec3::new(room.between(-HALF, HALF), room.between(0.05, 0.9) * height.min(20.0), room.between(-HALF, HALF));
        let size = Vec3::splat(room.between(0.5, 3.0))
            * Vec3::new(room.between(0.6, 1.5), room.between(0.6, 1.5), room.between(0.6, 1.5));
        let turn = Quat::from_rotation_y(room.between(0.0, TAU)) * Quat::from_rotation_x(room.between(0.0, TAU));
        let material = room.material();
        room.place(format!("object_{i:03}"), shape, material, Mat4::from_scale_rotation_translation(size, turn, at));
    }
    room.shell(height);
    room.light(height);
    room.camera(height);
    room.scene
}

struct Room {
    scene: Scene,
    numbers: SplitMix,
}

impl Room {
    fn new(index: u32) -> Self {
        let scene = Scene { name: format!("paper-room-varied:{index}"), ..Scene::default() };
        Self { scene, numbers: SplitMix::new(0x5EED_0000_0000_0000 | u64::from(index)) }
    }

    fn between(&mut self, low: f32, high: f32) -> f32 {
        low + (high - low) * self.numbers.next()
    }

    fn chance(&mut self, share: f32) -> bool {
        self.numbers.next() < share
    }

    /// A colour; a third of them are pale, as most rooms are.
    fn color(&mut self) -> [f32; 3] {
        let pale = self.chance(0.33);
        std::array::from_fn(|_| if pale { self.between(0.5, 0.9) } else { self.between(0.02, 0.98) })
    }

    /// White, but for a tint of up to `most` of a channel.
    fn tint(&mut self, most: f32) -> [f32; 3] {
        std::array::from_fn(|_| 1.0 - most * self.numbers.next())
    }

    fn material(&mut self) -> Material {
        let [r, g, b] = self.color();
        let metal = self.chance(0.15);
        let roughness = if metal { self.between(0.1, 0.7) } else { self.between(0.3, 1.0) };
        let metallic = f32::from(u8::from(metal));
        Material { base_color: [r, g, b, 1.0], metallic, roughness, double_sided: true, ..Material::default() }
    }

    fn place(&mut self, name: String, shape: Shape, material: Material, transform: Mat4) {
        let mut mesh = shapes::flat(shape);
        (mesh.material, mesh.name) = (self.scene.materials.len(), name.clone());
        self.scene.materials.push(Material { name: name.clone(), ..material });
        let instance = Instance { name, mesh: self.scene.meshes.len(), transform: transform.to_cols_array_2d() };
        self.scene.meshes.push(mesh);
        self.scene.instances.push(instance);
    }

    /// A box between two corners.
    fn slab(&mut self, name: &str, material: Material, low: Vec3, high: Vec3) {
        let place = Mat4::from_scale_rotation_translation(0.5 * (high - low), Quat::IDENTITY, 0.5 * (high + low));
        self.place(name.into(), Shape::Cube, material, place);
    }

    /// Floor, walls, and perhaps a roof around a window.
    fn shell(&mut self, height: f32) {
        let (near, far, top) = (HALF - THICK, HALF + THICK, Vec3::Y * height);
        let sides = [
            (Vec3::new(-far, 0.0, -far), Vec3::new(-near, 0.0, far)),
            (Vec3::new(near, 0.0, -far), Vec3::new(far, 0.0, far)),
            (Vec3::new(-far, 0.0, -far), Vec3::new(far, 0.0, -near)),
            (Vec3::new(-far, 0.0, near), Vec3::new(far, 0.0, far)),
        ];
        for (low, high) in sides {
            let plain = Material { metallic: 0.0, ..self.material() };
            self.slab("wall", plain, low, high + top);
        }
        let plain = Material { metallic: 0.0, ..self.material() };
        self.slab("floor", plain, Vec3::new(-far, -2.0 * THICK, -far), Vec3::new(far, 0.0, far));
        if !self.chance(0.4) {
            return;
        }
        let roof = Material { metallic: 0.0, ..self.material() };
        let hole = [self.between(5.0, 25.0), self.between(5.0, 25.0)];
        let [x, z] = [self.between(-20.0, 20.0), self.between(-20.0, 20.0)];
        let (low, high) = (height, height + 2.0 * THICK);
        let mut part = |a: [f32; 2], b: [f32; 2]| {
            self.slab("roof", roof.clone(), Vec3::new(a[0], low, a[1]), Vec3::new(b[0], high, b[1]));
        };
        part([-far, -far], [x - hole[0], far]);
        part([x + hole[0], -far], [far, far]);
        part([x - hole[0], -far], [x + hole[0], z - hole[1]]);
        part([x - hole[0], z + hole[1]], [x + hole[0], far]);
    }

    fn light(&mut self, height: f32) {
        let (which, strength) = (self.numbers.next(), self.between(0.5, 2.0));
        let position =
            Vec3::new(self.between(-35.0, 35.0), self.between(0.3, 0.95) * height, self.between(-35.0, 35.0));
        let aim = Vec3::new(self.between(-25.0, 25.0), 0.0, self.between(-25.0, 25.0)) - position;
        // As bright twenty metres away as a sun of that strength.
        let intensity = 400.0 * strength;
        let kind = if which < 0.5 {
            let (turn, up) = (self.between(0.0, TAU), self.between(0.35, 1.45));
            let direction = Vec3::new(turn.cos() * up.cos(), -up.sin(), turn.sin() * up.cos());
            LightKind::Directional { direction: direction.normalize().into(), irradiance: strength, angle: SUN_ANGLE }
        } else if which < 0.8 {
            LightKind::Point { position: position.into(), intensity, radius: self.between(0.1, 0.5), range: None }
        } else {
            LightKind::Spot {
                position: position.into(),
                direction: aim.normalize_or(Vec3::NEG_Y).into(),
                intensity: 2.0 * intensity,
                radius: 0.2,
                range: None,
                inner_angle: 0.3,
                outer_angle: self.between(0.5, 1.2),
            }
        };
        let color = self.tint(0.4);
        self.scene.lights.push(Light { name: "light".into(), color, kind, is_emissive_proxy: false });
        let sky = if self.chance(0.1) { 0.0 } else { self.between(0.01, 0.15) };
        self.scene.environment = Environment::constant(self.tint(0.5).map(|c| c * sky));
    }

    fn camera(&mut self, height: f32) {
        let eye =
            Vec3::new(self.between(-25.0, 25.0), self.between(0.05, 0.8) * height.min(25.0), self.between(-25.0, 25.0));
        let (turn, tilt) = (self.between(0.0, TAU), self.between(-0.35, 0.2));
        let ahead = Vec3::new(turn.cos() * tilt.cos(), tilt.sin(), turn.sin() * tilt.cos());
        let yfov = self.between(25.0, 55.0) * PI / 180.0;
        let camera = Camera::look_at(eye.into(), (eye + ahead).into(), yfov);
        self.scene.cameras.push(Camera { name: "camera".into(), near: 0.1, far: 150.0, ..camera });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rooms_are_sound_the_same_again_and_of_every_kind() {
        let mut kinds = [0; 3];
        let mut roofs = 0;
        for index in 0..60 {
            let room = scene(index);
            assert!(room.meshes.iter().all(|m| m.material < room.materials.len()));
            assert_eq!((room.cameras.len(), room.lights.len()), (1, 1));
            kinds[match room.lights[0].kind {
                LightKind::Directional { .. } => 0,
                LightKind::Point { .. } => 1,
                LightKind::Spot { .. } => 2,
            }] += 1;
            roofs += u32::from(room.instances.iter().any(|i| i.name == "roof"));
            let transforms = |s: &Scene| s.instances.iter().map(|i| i.transform).collect::<Vec<_>>();
            assert_eq!(transforms(&room), transforms(&scene(index)));
            assert_ne!(transforms(&room), transforms(&scene(index + 1)));
        }
        assert!(kinds.iter().all(|n| *n > 5) && (10..40).contains(&roofs), "{kinds:?} {roofs}");
    }
}
