//! The frame's share of `gi.probes`: buffers of a bake, and the passes over them.

use super::{Bake, SAMPLES, SKY, random};
use crate::accel::AccelGpu;
use crate::gi::cells::CellSide;
use crate::gi::exposure::{self, output_entry, storage_entry};
use crate::gi::inputs::InputGroup;
use crate::gi::rung::{Cost, Rung};
use crate::gi::view_cache::ViewCache;
use crate::gi::{GiError, Inputs, ambient::check_output};
use crate::gpu::{shaders, timing::Recorder};
use crate::render::tool::{self, READ, READ_WRITE, UNIFORM};
use glam::Vec3;
use wgpu::util::DeviceExt;

/// `ProbeParams` of `shaders/gi/probes_types.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[allow(missing_docs, reason = "documented in the shader")]
pub struct ProbeParams {
    pub surfels: u32,
    pub rays: u32,
    pub inner_rays: u32,
    pub light_count: u32,
    pub environment: [f32; 3],
    pub side: f32,
    pub centre: [f32; 3],
    pub table_mask: u32,
    pub spacing: f32,
    pub seed: u32,
    pub pad: [u32; 2],
}

/// Exchanges of light before the last gather: with it a path bounces four times, as Cycles' paths do by default.
const ROUNDS: usize = 3;
/// Links of a surfel that light bounces along; their noise is averaged by the gather that follows.
const INNER_RAYS: u32 = 32;

/// The method at work.
pub struct ProbesGi {
    device: wgpu::Device,
    params: ProbeParams,
    inputs: InputGroup,
    light: wgpu::ComputePipeline,
    light_layout: wgpu::BindGroupLayout,
    bounce: wgpu::ComputePipeline,
    gather: wgpu::ComputePipeline,
    bounces: [wgpu::BindGroup; 2],
    apply: wgpu::ComputePipeline,
    apply_layout: wgpu::BindGroupLayout,
    buffers: Buffers,
    accel: AccelGpu,
    no_lights: wgpu::Buffer,
    lights: Option<(wgpu::Buffer, wgpu::BindGroup)>,
    outputs: ViewCache<1>,
    size: [u32; 2],
    bytes: u64,
    list: f64,
}

struct Buffers {
    params: wgpu::Buffer,
    samples: wgpu::Buffer,
    sources: wgpu::Buffer,
    direct: wgpu::Buffer,
    radiance: [wgpu::Buffer; 2],
    table: wgpu::Buffer,
    lists: wgpu::Buffer,
    surfels: wgpu::Buffer,
    walls: wgpu::Buffer,
    digits: wgpu::Buffer,
    directions: wgpu::Buffer,
}

impl ProbesGi {
    /// Uploads `bake` and makes the pipelines.
    ///
    /// # Errors
    /// [`GiError::Bake`] when a part of it exceeds what the device binds.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue, bake: &Bake) -> Result<Self, GiError> {
        let n = bake.surfels.len();
        let spacing = bake.surfels.iter().map(|s| s.spacing).fold(1e-6f32, f32::max);
        let params = ProbeParams {
            surfels: n as u32,
            rays: bake.rays,
            inner_rays: bake.rays.min(INNER_RAYS),
            light_count: 0,
            environment: [0.0; 3],
            side: bake.field.side,
            centre: bake.field.centre.to_array(),
            table_mask: bake.field.table.len() as u32 - 1,
            spacing,
            seed: bake.seed,
            pad: [0; 2],
        };
        let accel = AccelGpu::new(device, queue, &bake.accel).map_err(|e| GiError::Bake(e.to_string()))?;
        let links = transposed(bake);
        let limit = device.limits().max_storage_buffer_binding_size;
        let make = |label: &str, data: &[u8]| {
            if data.len() as u64 > limit {
                return Err(GiError::Bake(format!("{label} needs {} bytes, the device binds {limit}", data.len())));
            }
            // Never empty, and large enough for one element of any array.
            let mut padded = data.to_vec();
            padded.resize(data.len().max(32), 0);
            let usage = wgpu::BufferUsages::STORAGE;
            Ok(device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents: &padded,
                usage,
            }))
        };
        let lights = vec![0u8; 16 * (n + SKY as usize + 1)];
        let links = make("gi.probes.links", bytemuck::cast_slice(&links))?;
        let digits: Vec<_> = (0..bake.rays).map(random::digits).collect();
        let buffers = Buffers {
            params: device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("gi.probes"),
                size: size_of::<ProbeParams>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            samples: make("gi.probes.samples", bytemuck::cast_slice(&samples(bake)))?,
            sources: make("gi.probes.sources", bytemuck::cast_slice(&sources(bake)))?,
            directions: make("gi.probes.directions", &vec![0u8; 4 * n])?,
            direct: make("gi.probes.direct", &lights)?,
            radiance: [make("gi.probes.radiance", &lights)?, make("gi.probes.radiance", &lights)?],
            table: make("gi.probes.table", bytemuck::cast_slice(&bake.field.table))?,
            lists: make("gi.probes.lists", bytemuck::cast_slice(&bake.field.lists))?,
            walls: make("gi.probes.walls", bytemuck::cast_slice(&bake.field.walls))?,
            digits: make("gi.probes.digits", bytemuck::cast_slice(&digits))?,
            surfels: make("gi.probes.surfels", bytemuck::cast_slice(&packed(bake, spacing)))?,
        };
        let bytes = links.size()
            + [
                &buffers.samples,
                &buffers.sources,
                &buffers.direct,
                &buffers.table,
                &buffers.lists,
                &buffers.surfels,
                &buffers.walls,
            ]
            .map(wgpu::Buffer::size)
            .iter()
            .sum::<u64>()
            + 2 * buffers.radiance[0].size()
            + bake.accel.bytes();

        let stage = wgpu::ShaderStages::COMPUTE;
        let uniform = wgpu::BindGroupLayoutEntry { binding: 0, visibility: stage, ty: UNIFORM, count: None };
        let light_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("gi.probes.light"),
            entries: &[
                uniform,
                AccelGpu::layout_entry(),
                storage_entry(2, true),
                storage_entry(3, true),
                storage_entry(4, true),
                storage_entry(5, false),
                storage_entry(6, false),
                storage_entry(7, false),
            ],
        });
        let light = tool::compute(device, "gi.probes_light", "probes_light", &[&light_layout]);
        let layout =
            tool::layout(device, "gi.probes.bounce", stage, &[UNIFORM, READ, READ, READ, READ, READ_WRITE, READ, READ]);
        let bounce = tool::compute(device, "gi.probes_bounce", "probes_bounce", &[&layout]);
        let gather = tool::compute(device, "gi.probes_bounce", "probes_gather", &[&layout]);
        let bounces = [0, 1].map(|from| {
            tool::group(
                device,
                "gi.probes.bounce",
                &layout,
                &[
                    buffers.params.as_entire_binding(),
                    links.as_entire_binding(),
                    buffers.sources.as_entire_binding(),
                    buffers.direct.as_entire_binding(),
                    buffers.radiance[from].as_entire_binding(),
                    buffers.radiance[1 - from].as_entire_binding(),
                    buffers.digits.as_entire_binding(),
                    buffers.directions.as_entire_binding(),
                ],
            )
        });
        let inputs = InputGroup::new(device);
        let apply_layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("gi.probes.apply"),
            entries: &[
                uniform,
                storage_entry(1, true),
                storage_entry(2, true),
                storage_entry(3, true),
                storage_entry(4, true),
                output_entry(5),
                storage_entry(6, true),
            ],
        });
        let module = shaders::module_with(device, "gi.probes_apply", &CellSide::Four.prelude());
        let apply = exposure::pipeline(device, "gi.probes.apply", &module, "probes_apply", &inputs, &apply_layout);
        let no_lights = make("gi.probes.no_lights", &[0; 64])?;
        let cells = bake.field.table.iter().filter(|e| e[0] != 0).count();
        Ok(Self {
            device: device.clone(),
            params,
            inputs,
            light,
            light_layout,
            bounce,
            gather,
            bounces,
            apply,
            apply_layout,
            buffers,
            accel,
            no_lights,
            lights: None,
            outputs: ViewCache::new(),
            size: [0; 2],
            bytes,
            list: bake.field.lists.len() as f64 / cells.max(1) as f64,
        })
    }

    /// The group of `gi.probes.light` for these lights.
    fn light_group(&mut self, lights: &wgpu::Buffer) -> wgpu::BindGroup {
        if let Some((known, group)) = &self.lights
            && known == lights
        {
            return group.clone();
        }
        let b = &self.buffers;
        let bind = |binding, buffer: &wgpu::Buffer| (binding, buffer.clone());
        let list = [
            bind(0, &b.params),
            bind(2, lights),
            bind(3, &b.samples),
            bind(4, &b.sources),
            bind(5, &b.direct),
            bind(6, &b.radiance[0]),
            bind(7, &b.directions),
        ];
        let mut entries: Vec<_> = list
            .iter()
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding: *binding, resource: buffer.as_entire_binding() })
            .collect();
        entries.push(self.accel.entry());
        let group = self.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("gi.probes.light"),
            layout: &self.light_layout,
            entries: &entries,
        });
        self.lights = Some((lights.clone(), group.clone()));
        group
    }
}

impl Rung for ProbesGi {
    fn record(
        &mut self,
        recorder: &mut Recorder<'_>,
        queue: &wgpu::Queue,
        inputs: &Inputs<'_>,
        output: &wgpu::TextureView,
    ) -> Result<(), GiError> {
        check_output(output, inputs.size)?;
        if inputs.size != self.size {
            self.forget();
            self.size = inputs.size;
        }
        let bound = self.inputs.bind(queue, inputs)?;
        let environment = inputs.environment.map(|c| if c.is_finite() { c.max(0.0) } else { 0.0 });
        let lights = inputs.lights.map_or(self.no_lights.clone(), |l| l.buffer.clone());
        let light_count = inputs.lights.map_or(0, |l| l.count);
        let params = ProbeParams { light_count, environment, ..self.params };
        queue.write_buffer(&self.buffers.params, 0, bytemuck::bytes_of(&params));
        let light_group = self.light_group(&lights);
        // After an odd number of exchanges the second buffer holds the light, and the gather writes the first.
        let last = ROUNDS % 2;
        let received = &self.buffers.radiance[1 - last];
        let b = &self.buffers;
        let group = self.outputs.get([output], || {
            let buffers = [&b.params, &b.table, &b.lists, &b.surfels, received];
            let mut entries: Vec<_> = (0u32..)
                .zip(buffers)
                .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
                .collect();
            entries.push(wgpu::BindGroupEntry { binding: 5, resource: wgpu::BindingResource::TextureView(output) });
            entries.push(wgpu::BindGroupEntry { binding: 6, resource: b.walls.as_entire_binding() });
            Ok::<_, GiError>(self.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some("gi.probes.apply"),
                layout: &self.apply_layout,
                entries: &entries,
            }))
        })?;
        let all = self.params.surfels + SKY + 1;
        recorder.compute("gi.probes.light", |pass| {
            pass.set_pipeline(&self.light);
            pass.set_bind_group(0, &light_group, &[]);
            pass.dispatch_workgroups((all * SAMPLES).div_ceil(64), 1, 1);
        });
        for round in 0..ROUNDS {
            recorder.compute("gi.probes.bounce", |pass| {
                pass.set_pipeline(&self.bounce);
                pass.set_bind_group(0, &self.bounces[round % 2], &[]);
                pass.dispatch_workgroups(all.div_ceil(64), 1, 1);
            });
        }
        recorder.compute("gi.probes.gather", |pass| {
            pass.set_pipeline(&self.gather);
            pass.set_bind_group(0, &self.bounces[last], &[]);
            pass.dispatch_workgroups(all.div_ceil(64), 1, 1);
        });
        recorder.compute("gi.probes.apply", |pass| {
            bound.set(pass);
            pass.set_bind_group(1, &group, &[]);
            pass.set_pipeline(&self.apply);
            tool::dispatch(pass, bound.size);
        });
        Ok(())
    }

    fn forget(&mut self) {
        self.inputs.forget();
        self.outputs.clear();
    }

    fn bytes(&self) -> u64 {
        self.inputs.bytes() + self.bytes
    }

    fn costs(&self, size: [u32; 2]) -> Vec<Cost> {
        let pixels = f64::from(size[0]) * f64::from(size[1]);
        let n = f64::from(self.params.surfels);
        let (inner, rays) = (f64::from(self.params.inner_rays), f64::from(self.params.rays));
        // One light, which half of the sample points face. A shadow ray looks at about 20 blocks of 64 bytes, 250
        // operations each. A link's direction and the gleam that half of the surfels have make 75 operations.
        let shadow_rays = n * f64::from(SAMPLES) * 0.5;
        let (rounds, link) = (ROUNDS as f64, 75.0);
        vec![
            Cost::new(
                "gi.probes.light",
                shadow_rays * 20.0 * 250.0,
                shadow_rays * 1280.0 + n * (f64::from(SAMPLES) * 16.0 + 104.0),
            ),
            Cost::new("gi.probes.bounce", rounds * n * (inner * link + 60.0), rounds * n * (inner * 2.0 + 100.0)),
            Cost::new("gi.probes.gather", n * (rays * link + 40.0), n * (rays * 2.0 + 84.0)),
            Cost::new("gi.probes.apply", pixels * (120.0 + self.list * 65.0), pixels * 16.0 + n * 52.0),
        ]
    }
}

/// Word k of surfel i at k · surfels + i.
fn transposed(bake: &Bake) -> Vec<u32> {
    let (n, words) = (bake.surfels.len(), bake.rays as usize / 2);
    let mut out = vec![0u32; n * words];
    for (i, row) in bake.links.chunks_exact(bake.rays as usize).enumerate() {
        for (k, pair) in row.chunks_exact(2).enumerate() {
            out[k * n + i] = u32::from(pair[0]) | u32::from(pair[1]) << 16;
        }
    }
    out
}

fn samples(bake: &Bake) -> Vec<[u32; 4]> {
    let pack = |(p, n): &([f32; 3], [f32; 3])| {
        let [x, y] = octahedral((*n).into()).map(|c| u32::from((c * 32767.0).round() as i16 as u16));
        [p[0].to_bits(), p[1].to_bits(), p[2].to_bits(), x | y << 16]
    };
    bake.samples.iter().map(pack).collect()
}

fn sources(bake: &Bake) -> Vec<[u32; 4]> {
    let four = |[x, y, z]: [f32; 3], w: u32| [x.to_bits(), y.to_bits(), z.to_bits(), w];
    let surfels = bake.surfels.iter().flat_map(|s| {
        let [x, y] = octahedral(s.normal.into()).map(|c| u32::from((c * 32767.0).round() as i16 as u16));
        [four(s.albedo, s.roughness.to_bits()), four(s.emission, x | y << 16), four(s.f0, 0)]
    });
    let sky = bake.sky.iter().flat_map(|&c| [[0; 4], four(c, 0), [0; 4]]);
    surfels.chain(sky).chain([[0; 4]; 3]).collect()
}

fn packed(bake: &Bake, largest: f32) -> Vec<[u32; 4]> {
    let pack = |s: &super::Surfel| {
        let [x, y] = octahedral(s.normal.into()).map(|c| ((c + 1.0) * 2047.5).round().clamp(0.0, 4095.0) as u32);
        let finer = ((largest / s.spacing).log2() * 32.0).round().clamp(0.0, 255.0) as u32;
        let [px, py, pz] = s.position.map(f32::to_bits);
        [px, py, pz, x | y << 12 | finer << 24]
    };
    bake.surfels.iter().map(pack).collect()
}

/// Unit vector in two numbers of [−1, 1], as `oct_decode` reads them.
fn octahedral(v: Vec3) -> [f32; 2] {
    let v = v / v.abs().element_sum().max(1e-9);
    if v.z >= 0.0 { [v.x, v.y] } else { [(1.0 - v.y.abs()).copysign(v.x), (1.0 - v.x.abs()).copysign(v.y)] }
}
