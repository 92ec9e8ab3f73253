//! What mistakes of a host look like: `docs/images/symptoms.png`, drawn by the host of `examples/embed`.
//!
//!     cargo run --release --example symptoms -- docs/images/symptoms.png

#[path = "embed/main.rs"]
#[allow(dead_code, reason = "the program's own part")]
mod host;

use bouncelight::gi::{Depth, MotionSense, NormalSpace};
use bouncelight::gpu::readback;
use bouncelight::scene::LightKind;
use bouncelight::wgpu;
use host::Host;

/// Pixels of one picture; three by two of them.
const SIZE: [u32; 2] = [264, 198];
const ACROSS: usize = 3;
/// Frames at rest, then with a box that moves.
const FRAMES: [u32; 2] = [48, 24];

type Failure = Box<dyn std::error::Error>;

/// Row by row.
const MISTAKES: [fn(&mut Host) -> Result<(), Failure>; 6] = [
    |_| Ok(()),
    // Depth is said to be of the clip space of OpenGL.
    |host| {
        host.conventions.depth = Depth::ForwardGl;
        Ok(())
    },
    // Normals are along the camera's axes, and are said to be along the world's.
    |host| {
        host.conventions.normal_space = NormalSpace::World;
        Ok(())
    },
    // The projection has y down, the picture has it up.
    |host| {
        host.renderer.matrices.clip_from_view[1][1] *= -1.0;
        Ok(())
    },
    // Motion the wrong way round.
    |host| {
        host.conventions.motion_sense = MotionSense::FromPast;
        Ok(())
    },
    // A lamp of the panel's light under the panel, which rays find anyway.
    |host| {
        let intensity = 6.0 * 1.2 * 1.2;
        let (position, direction, radius, range) = ([0.0, 2.9, 0.0], [0.0, -1.0, 0.0], 0.5, None);
        let (inner_angle, outer_angle) = (0.0, std::f32::consts::FRAC_PI_2);
        let lamp = LightKind::Spot { position, direction, intensity, radius, range, inner_angle, outer_angle };
        Ok(host.world.lights(&[lamp.into()])?)
    },
];

fn main() -> Result<(), Failure> {
    let path = std::env::args_os().nth(1).ok_or("usage: symptoms PICTURE.png")?;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&Default::default()))?;
    let [w, h] = SIZE.map(|n| n as usize);
    let rows = MISTAKES.len() / ACROSS;
    let mut sheet = vec![255; 3 * w * h * MISTAKES.len()];
    for (number, mistake) in MISTAKES.iter().enumerate() {
        let mut host = Host::new(&device, &queue, SIZE)?;
        mistake(&mut host)?;
        for frame in 0..FRAMES[0] + FRAMES[1] {
            host.frame((frame as f32 - FRAMES[0] as f32).max(0.0) / 12.0)?;
        }
        let rgba = readback::texture(&device, &queue, &host.renderer.picture)?;
        for (y, row) in rgba.chunks_exact(4 * w).enumerate() {
            let at = 3 * (w * (ACROSS * (y + h * (number / ACROSS)) + number % ACROSS));
            for (to, from) in sheet[at..at + 3 * w].chunks_exact_mut(3).zip(row.chunks_exact(4)) {
                to.copy_from_slice(&from[..3]);
            }
        }
    }
    let size = [(w * ACROSS) as u32, (h * rows) as u32];
    Ok(bouncelight::image_io::write_png(path.as_ref(), size[0], size[1], &sheet, &[])?)
}
