//! What mistakes of a host look like: `docs/images/symptoms.png`, drawn by the host of
//! `examples/embed`.
//!
//!     cargo run --release --example symptoms -- docs/images/symptoms.png

#[path = "embed/main.rs"]
#[allow(dead_code, reason = "the program's own part")]
mod host;

use bouncelight::gi::{Depth, Forward, MotionSense};
use bouncelight::gpu::readback;
use bouncelight::wgpu;
use host::Host;

/// Pixels of one picture; three by two of them.
const SIZE: [u32; 2] = [264, 198];
const ACROSS: usize = 3;
/// Frames at rest, then with a box that moves.
const FRAMES: [u32; 2] = [48, 14];

type Failure = Box<dyn std::error::Error>;
type Mistake = fn(&mut Host);

/// What is done to a host, and how many times its light is drawn; row by row.
const MISTAKES: [(Mistake, f32); 6] = [
    (|_| (), 1.0),
    // Depth is said to be of the clip space of OpenGL.
    (|host| host.conventions.depth = Depth::ForwardGl, 1.0),
    // Normals whose z points to the eye, with matrices that look down +Z.
    (
        |host| {
            host.conventions.forward = Forward::PositiveZ;
            let camera = &mut host.renderer.matrices;
            camera.view_from_world.iter_mut().for_each(|column| column[2] = -column[2]);
            camera.clip_from_view[2] = camera.clip_from_view[2].map(|v| -v);
        },
        1.0,
    ),
    // The projection has y down, the picture has it up.
    (|host| host.renderer.matrices.clip_from_view[1][1] *= -1.0, 1.0),
    // Motion the wrong way round.
    (|host| host.conventions.motion_sense = MotionSense::FromPast, 1.0),
    // The panel is found by rays, and a lamp drawn in its place, too.
    (|_| (), 2.0),
];

fn main() -> Result<(), Failure> {
    let path = std::env::args_os().nth(1).ok_or("usage: symptoms PICTURE.png")?;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let [w, h] = SIZE.map(|n| n as usize);
    let rows = MISTAKES.len() / ACROSS;
    let mut sheet = vec![255; 3 * w * h * MISTAKES.len()];
    for (number, (mistake, times)) in MISTAKES.iter().enumerate() {
        let mut host = Host::new(&device, &queue, SIZE)?;
        mistake(&mut host);
        for frame in 0..FRAMES[0] + FRAMES[1] {
            host.frame((frame as f32 - FRAMES[0] as f32).max(0.0) / 6.0)?;
        }
        let rgba = readback::texture(&device, &queue, &host.renderer.picture)?;
        for (y, row) in rgba.chunks_exact(4 * w).enumerate() {
            let at = 3 * (w * (ACROSS * (y + h * (number / ACROSS)) + number % ACROSS));
            for (to, from) in sheet[at..at + 3 * w].chunks_exact_mut(3).zip(row.chunks_exact(4)) {
                to.copy_from_slice(&[from[0], from[1], from[2]].map(|byte| lit(byte, *times)));
            }
        }
    }
    let size = [(w * ACROSS) as u32, (h * rows) as u32];
    Ok(bouncelight_scene::image_io::write_png(path.as_ref(), size[0], size[1], &sheet, &[])?)
}

/// An sRGB byte of so many times the light.
fn lit(byte: u8, times: f32) -> u8 {
    let v = f32::from(byte) / 255.0;
    let light = times * if v > 0.04045 { ((v + 0.055) / 1.055).powf(2.4) } else { v / 12.92 };
    let v = if light > 0.0031308 { 1.055 * light.powf(1.0 / 2.4) - 0.055 } else { 12.92 * light };
    (255.0 * v.min(1.0)).round() as u8
}
