//! The same frames give the same light, to the bit.

use crate::common;
use crate::gather::{go_on, uploaded};
use crate::world;
use bouncelight::gi::Method;
use bouncelight::gi::gather::Options;
use bouncelight::scene::Camera;
use bouncelight_lab::scenes::home;
use glam::{Mat4, Quat};
use std::sync::atomic::{AtomicBool, Ordering};

const SIZE: [u32; 2] = [96, 64];

/// What `f` gives while other threads keep the processor busy, so that a driver's threads on it come
/// in another order.
fn busy<T>(f: impl FnOnce() -> T) -> T {
    let on = AtomicBool::new(true);
    std::thread::scope(|threads| {
        for _ in 0..2 {
            threads.spawn(|| {
                while on.load(Ordering::Relaxed) {
                    std::hint::spin_loop();
                }
            });
        }
        let found = f();
        on.store(false, Ordering::Relaxed);
        found
    })
}

/// Threads put light into the world's table in any order, which must not show. In half a table more
/// entries are not where they belong but further on, where order has put them.
#[test]
fn a_camera_that_turns_in_a_home_sees_the_same_again() {
    let Some(gpu) = common::gpu() else { return };
    let scene = home::scene(2);
    let frames = if common::whole() { 24 } else { 6 };
    let raster = uploaded(&gpu, &scene);
    let own = Mat4::from_cols_array_2d(&scene.cameras[0].transform);
    let film = |seed: u32, frames: usize| -> Vec<Vec<f32>> {
        let options = Options { slots: Options::default().slots / 2, seed, ..Default::default() };
        let mut renderer = world::renderer(&gpu, SIZE, Method::Gather(options));
        let turned = |i: usize| own * Mat4::from_quat(Quat::from_rotation_y(0.03 * i as f32));
        let camera = |i: usize| Camera { transform: turned(i).to_cols_array_2d(), ..scene.cameras[0].clone() };
        (0..frames).map(|i| go_on(&gpu, &mut renderer, &raster, &camera(i), 1)).collect()
    };
    let first = film(0, frames);
    let again = busy(|| film(0, frames));
    let other = (0..frames).find(|&i| first[i] != again[i]);
    assert_eq!(other, None, "the first frame that has other light");
    assert_ne!(film(1, 1)[0], first[0], "of other rays");
}
