//! A name for what a scene is, so that results can be kept beside it and known to be out of date.

use bouncelight::scene::{Camera, Image, Mesh, Scene};
use sha2::{Digest, Sha256};
use std::fmt::{self, Write};

/// Everything that decides what a scene looks like, as 16 hexadecimal digits: meshes, placements,
/// materials, images, lights and surroundings. Names, cameras and how things could move do not
/// count.
pub fn of_scene(scene: &Scene) -> String {
    // Taken apart, so that whoever adds a field decides here whether it counts.
    let Scene {
        name: _,
        meshes,
        instances,
        materials,
        images,
        lights,
        cameras: _,
        environment,
        variants: _,
        // How they stand now is in the meshes.
        deforms: _,
        rig: _,
        default_light: _,
        lightless: _,
        warnings: _,
    } = scene;
    let mut hash = Hash::default();
    for mesh in meshes {
        let Mesh { name: _, positions, normals, tangents, uv0, uv1, colors, indices, material, variants: _ } = mesh;
        hash.bytes(bytemuck::cast_slice(positions));
        hash.bytes(bytemuck::cast_slice(normals));
        hash.bytes(bytemuck::cast_slice(tangents));
        hash.bytes(bytemuck::cast_slice(uv0));
        hash.bytes(bytemuck::cast_slice(uv1));
        hash.bytes(bytemuck::cast_slice(colors));
        hash.bytes(bytemuck::cast_slice(indices));
        hash.text(material);
    }
    instances.iter().for_each(|i| hash.text(&(i.mesh, i.transform)));
    for image in images {
        let Image { name: _, width, height, rgba, color_space } = image;
        hash.text(&(width, height, color_space));
        hash.bytes(rgba);
    }
    // Rust prints floats so that they read back bit for bit; names in these lists are short.
    hash.text(materials);
    hash.text(lights);
    hash.text(&environment.radiance);
    if let Some(image) = &environment.image {
        hash.text(&(image.width, image.height));
        hash.bytes(bytemuck::cast_slice(&image.rgb));
    }
    hash.end()
}

/// From where it is seen, but for the camera's name.
pub fn of_camera(camera: &Camera) -> String {
    let Camera { name: _, transform, yfov, aspect: _, near, far } = camera;
    of_text(&(transform, yfov, near, far))
}

/// Whatever its `Debug` form says.
pub fn of_text(what: &impl fmt::Debug) -> String {
    let mut hash = Hash::default();
    hash.text(what);
    hash.end()
}

#[derive(Default)]
struct Hash(Sha256);

impl Hash {
    fn bytes(&mut self, bytes: &[u8]) {
        // Lengths first: what ends one array cannot begin the next.
        self.0.update((bytes.len() as u64).to_le_bytes());
        self.0.update(bytes);
    }

    fn text(&mut self, what: &(impl fmt::Debug + ?Sized)) {
        write!(self, "{what:?};").expect("a hash takes everything");
    }

    fn end(self) -> String {
        self.0.finalize().iter().take(8).map(|b| format!("{b:02x}")).collect()
    }
}

impl Write for Hash {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0.update(text.as_bytes());
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_seen_counts_and_names_do_not() {
        let scene = crate::scenes::load("cornell").unwrap();
        let own = of_scene(&scene);
        assert_eq!((own.len(), own.clone()), (16, of_scene(&scene.clone())));
        let changed = |change: &dyn Fn(&mut Scene)| {
            let mut other = scene.clone();
            change(&mut other);
            of_scene(&other)
        };
        assert_eq!(changed(&|s| s.name = "other".into()), own);
        assert_eq!(changed(&|s| s.meshes[0].name = "other".into()), own);
        assert_ne!(changed(&|s| s.meshes[0].positions[0][0] += 1e-6), own);
        assert_ne!(changed(&|s| s.instances[0].transform[3][1] += 1e-6), own);
        assert_ne!(changed(&|s| s.materials[0].roughness *= 0.99), own);
        assert_ne!(changed(&|s| s.environment.radiance[2] += 1e-6), own);
        let camera = &scene.cameras[0];
        let mut turned = camera.clone();
        turned.yfov += 1e-6;
        assert_ne!(of_camera(camera), of_camera(&turned));
    }
}
