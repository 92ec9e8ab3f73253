//! Somebody else's renderer (`renderer.rs`: a depth prepass and a forward pass), with our light in
//! it: a box that moves in a room, and a glowing panel that lights it. What embedding takes is in
//! [`Host`].
//!
//!     cargo run --no-default-features --features io --example embed -- FOLDER

pub(crate) mod renderer;
pub(crate) mod scene;

use bouncelight::gi::{self, Conventions, Inputs, Instance, MeshSource, Surface, Vertices, View, World, WorldOptions};
use bouncelight::wgpu::{self, VertexFormat};
use renderer::Renderer;
use scene::{BLOCKS, Drawn, place};

type Failure = Box<dyn std::error::Error>;

/// The renderer, and what it needs of ours.
pub(crate) struct Host {
    pub(crate) renderer: Renderer,
    /// How the renderer's targets are to be read.
    pub(crate) conventions: Conventions,
    world: World,
    pub(crate) view: View,
    before: f32,
}

impl Host {
    pub(crate) fn new(device: &wgpu::Device, queue: &wgpu::Queue, size: [u32; 2]) -> Result<Self, Failure> {
        // Its vertex buffer is taken as it is; each box is an instance of the one mesh, with a
        // surface of its own.
        let corners = scene::cube();
        let attribute = |offset| {
            let (bytes, format) = (bytemuck::cast_slice(&corners), VertexFormat::Float32x3);
            Vertices { bytes, offset, stride: 24, format }
        };
        let mesh = MeshSource::new(attribute(0), gi::Indices::None);
        let mut world = World::new(device, WorldOptions::default());
        world.mesh(0, &MeshSource { normals: Some(attribute(12)), ..mesh })?;
        Ok(Self {
            renderer: Renderer::new(device, queue, size, &corners, BLOCKS.len()),
            conventions: Conventions {
                depth: gi::Depth::Forward,
                normal_encoding: gi::NormalEncoding::Xyz,
                normal_range: gi::NormalRange::Unsigned,
                normal_space: gi::NormalSpace::View,
                motion_units: gi::MotionUnits::Pixels,
                ..Default::default()
            },
            world,
            view: View::new(device, queue, size, &gi::Method::Gather(Default::default()))?,
            before: 0.0,
        })
    }

    /// Draws the scene as it is after `time` seconds.
    pub(crate) fn frame(&mut self, time: f32) -> Result<(), Failure> {
        let mut drawn = Vec::new();
        for (number, (_, _, albedo, glow)) in BLOCKS.into_iter().enumerate() {
            let [world, before] = [time, self.before].map(|t| place(number, t));
            drawn.push(Drawn { world, before, color: [albedo[0], albedo[1], albedo[2], glow] });
            let surface = Surface { albedo, emission: [glow; 3], f0: 0.0, ..Default::default() };
            self.world.instance(number as u64, Instance { mesh: 0, transform: world, surface: Some(surface) })?;
        }
        self.before = time;

        let host = &self.renderer;
        self.world.prepare(&host.queue)?;
        let mut encoder = host.device.create_command_encoder(&Default::default());
        host.prepass(&mut encoder, &drawn);
        let inputs = Inputs {
            motion: Some(&host.motion),
            conventions: self.conventions,
            moves_with_world: true,
            ..Inputs::new(host.size, &host.depth, &host.normal, host.matrices)
        };
        self.view.record(&mut encoder, &self.world, &inputs, &host.light)?;
        host.forward(&mut encoder);
        host.queue.submit([encoder.finish()]);
        Ok(())
    }
}

fn main() -> Result<(), Failure> {
    let folder = std::env::args_os().nth(1).ok_or("usage: embed FOLDER")?;
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapter = pollster::block_on(instance.request_adapter(&Default::default()))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
        required_features: View::optional_features(&adapter),
        required_limits: View::required_limits(),
        ..Default::default()
    }))?;
    let mut host = Host::new(&device, &queue, [480, 360])?;
    std::fs::create_dir_all(&folder)?;
    for number in 0..80 {
        // It settles at rest, then the box moves.
        host.frame((number as f32 - 32.0).max(0.0) / 20.0)?;
        if number % 16 == 15 {
            let path = std::path::Path::new(&folder).join(format!("{number:03}.png"));
            let rgba = bouncelight::gpu::readback::texture(&device, &queue, &host.renderer.picture)?;
            let rgb: Vec<u8> = rgba.chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
            bouncelight_scene::image_io::write_png(&path, host.renderer.size[0], host.renderer.size[1], &rgb, &[])?;
        }
    }
    Ok(())
}
