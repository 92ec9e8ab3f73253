//! `bouncelight export`: what is written agrees with the shaders, and with what the pass records.

use crate::common;
use crate::program::{bouncelight, fails, path};
use bouncelight::gi::{CameraMatrices, Inputs, Lights, Method, Neural, Rays, method};
use bouncelight::gpu::{Gpu, timing::Recorder};
use bouncelight::gpu_scene::SceneGpu;
use bouncelight::net::format::Weights;
use bouncelight::wgpu::{self, TextureFormat as F, TextureUsages as U};
use bouncelight_lab::export::manifest::{Binding, Manifest};
use bouncelight_lab::export::{self, Package, Target};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{AddressSpace, Module, TypeInner};
use std::collections::BTreeSet;

const SIZE: [u32; 2] = [67, 41];

fn methods() -> [Method; 2] {
    let weights = Weights::shipped().expect("the shipped weights are sound");
    [Method::Gather(Default::default()), Method::Neural(Box::new(Neural::from(weights)))]
}

fn exported(gpu: &Gpu, method: &Method, target: Target) -> Package {
    let scene = bouncelight_lab::scenes::load("cornell").expect("a bundled scene");
    export::export((&gpu.device, &gpu.queue), &scene, method, SIZE, target).expect("it can be exported")
}

fn file<'a>(package: &'a Package, name: &str) -> &'a [u8] {
    &package.files.iter().find(|(n, _)| n == name).unwrap_or_else(|| panic!("no file {name}")).1
}

fn validated(module: &Module, name: &str) -> naga::valid::ModuleInfo {
    // As in `tests/repo/shaders.rs`.
    let mut validator = Validator::new(ValidationFlags::all(), Capabilities::SHADER_FLOAT16_IN_FLOAT32);
    validator.validate(module).unwrap_or_else(|e| panic!("{name}: {e:?}"))
}

/// Group, binding and kind of what an entry point uses, or of all there is without `info`.
fn used(module: &Module, info: Option<&naga::valid::ModuleInfo>, entry: &str) -> BTreeSet<(u32, u32, String)> {
    let index = module.entry_points.iter().position(|e| e.name == entry).expect("the entry point is there");
    let mut found = BTreeSet::new();
    for (handle, variable) in module.global_variables.iter() {
        let within = info.is_none_or(|info| !info.get_entry_point(index)[handle].is_empty());
        let Some(place) = variable.binding.filter(|_| within) else { continue };
        let kind = match (variable.space, &module.types[variable.ty].inner) {
            (AddressSpace::Uniform, _) => "uniform",
            (AddressSpace::Storage { access }, _) if access.contains(naga::StorageAccess::STORE) => "storage",
            (AddressSpace::Storage { .. }, _) => "read-only-storage",
            (_, TypeInner::Image { class: naga::ImageClass::Storage { .. }, .. }) => "storage-texture",
            _ => "texture",
        };
        found.insert((place.group, place.binding, kind.to_owned()));
    }
    found
}

fn told(bindings: &[Binding]) -> BTreeSet<(u32, u32, String)> {
    bindings.iter().map(|b| (b.group, b.binding, b.kind.clone())).collect()
}

/// Everything that a manifest says of itself fits together: names, sizes, slots, numbers.
fn consistent(m: &Manifest) -> Result<(), String> {
    for dispatch in &m.dispatches {
        let shader = m.shaders.get(dispatch.shader).ok_or("a shader that is not there")?;
        if shader.bindings.len() != dispatch.resources.len() {
            return Err(format!("{}: {} bindings", dispatch.label, dispatch.resources.len()));
        }
        if dispatch.workgroups.contains(&0) || dispatch.workgroups.iter().any(|n| *n > 65535) {
            return Err(format!("{}: {:?} workgroups", dispatch.label, dispatch.workgroups));
        }
        for (binding, bound) in shader.bindings.iter().zip(&dispatch.resources) {
            let place = format!("{}: `{}`", dispatch.label, binding.name);
            if binding.kind.ends_with("texture") {
                if !m.textures.iter().any(|t| t.name == bound.resource) {
                    return Err(format!("{place} has no texture"));
                }
                continue;
            }
            let buffer = m.buffers.iter().find(|b| b.name == bound.resource).ok_or(format!("{place}: no buffer"))?;
            let offset = bound.offset.unwrap_or(0);
            let bytes = bound.bytes.unwrap_or(buffer.bytes - offset.min(buffer.bytes));
            if offset % 256 != 0 || offset + bytes > buffer.bytes || bytes < binding.bytes.unwrap_or(0) {
                return Err(format!("{place}: {bytes} bytes from {offset} of {}", buffer.bytes));
            }
        }
    }
    for frame in &m.frames {
        if frame.dispatches.iter().any(|d| *d >= m.dispatches.len()) {
            return Err("a dispatch that is not there".into());
        }
        for write in &frame.writes {
            let layout = m.uniforms.get(&write.kind).ok_or("a struct that is not there")?;
            let named: BTreeSet<_> = layout.members.iter().map(|member| &member.name).collect();
            if named != write.values.keys().collect() {
                return Err(format!("{}: not every member is written", write.kind));
            }
        }
    }
    if m.frames.len() != m.steady.from + m.steady.period {
        return Err(format!("{} frames", m.frames.len()));
    }
    Ok(())
}

#[test]
fn shaders_of_every_target_validate_and_bind_what_the_manifest_says() {
    let Some(gpu) = common::gpu() else { return };
    for method in methods() {
        for target in Target::ALL {
            let package = exported(&gpu, &method, target);
            let m = &package.manifest;
            consistent(m).unwrap_or_else(|e| panic!("{} {}: {e}", m.method, m.target));
            assert!(m.shaders.len() >= 9, "{} shaders", m.shaders.len());
            for shader in &m.shaders {
                let bytes = file(&package, &shader.file);
                let (module, info) = match target {
                    Target::Wgsl => {
                        let text = std::str::from_utf8(bytes).unwrap();
                        let module = naga::front::wgsl::parse_str(text).unwrap();
                        let info = validated(&module, &shader.name);
                        (module, Some(info))
                    }
                    // naga reads its own SPIR-V with other signs of integers, which its validator
                    // refuses; `spirv-val` judges it below. There is nothing in it that the entry
                    // point does not use.
                    Target::Spirv => {
                        let module = naga::front::spv::parse_u8_slice(bytes, &Default::default());
                        (module.unwrap_or_else(|e| panic!("{}: {e}", shader.name)), None)
                    }
                    Target::Glsl430 => {
                        // OpenGL's own compiler reads it in `examples/moderngl`.
                        let text = std::str::from_utf8(bytes).unwrap();
                        assert!(text.starts_with("#version 430 core\n"), "{}", shader.name);
                        for binding in &shader.bindings {
                            let slot = format!("binding = {})", binding.slot.expect("GLSL has slots"));
                            assert!(text.contains(&slot), "{}: {slot}", shader.name);
                        }
                        // Setting shared arrays to zero, element by element, takes Mesa minutes.
                        assert!(!text.contains("gl_LocalInvocationID == uvec3(0u)"), "{}", shader.name);
                        continue;
                    }
                };
                let used = used(&module, info.as_ref(), &shader.entry);
                assert_eq!(used, told(&shader.bindings), "{} {}", m.target, shader.name);
                // Negative control: without one of them they differ.
                assert_ne!(used, told(&shader.bindings[1..]), "{}", shader.name);
                let entry = module.entry_points.iter().find(|e| e.name == shader.entry).expect("it is there");
                assert_eq!(entry.workgroup_size, shader.workgroup_size, "{}", shader.name);
            }
        }
    }
}

/// What `spirv-val` says of `bytes`.
fn spirv_val(bytes: &[u8]) -> std::process::Output {
    let mut file = tempfile::NamedTempFile::new().expect("a file");
    std::io::Write::write_all(&mut file, bytes).expect("it can be written");
    let mut command = std::process::Command::new("spirv-val");
    command.args(["--target-env", "vulkan1.1"]).arg(file.path()).output().expect("it starts")
}

#[test]
fn spirv_is_valid_for_vulkan() {
    let Some(gpu) = common::gpu() else { return };
    if let Err(e) = std::process::Command::new("spirv-val").arg("--version").output() {
        return common::skip(common::Need::SpirvVal, e);
    }
    for method in methods() {
        let package = exported(&gpu, &method, Target::Spirv);
        for shader in &package.manifest.shaders {
            let bytes = file(&package, &shader.file);
            let said = spirv_val(bytes);
            assert!(said.status.success(), "{}: {}", shader.name, String::from_utf8_lossy(&said.stderr));
            // Negative control: without its last words it is none.
            assert!(!spirv_val(&bytes[..bytes.len() - 8]).status.success(), "{}", shader.name);
        }
    }
}

/// Negative controls of `consistent`.
#[test]
fn a_manifest_with_a_gap_is_noticed() {
    let Some(gpu) = common::gpu() else { return };
    let whole = exported(&gpu, &methods()[0], Target::Wgsl).manifest;
    let broken = |mend: fn(&mut Manifest)| {
        let mut m = whole.clone();
        mend(&mut m);
        assert!(consistent(&m).is_err());
    };
    broken(|m| drop(m.dispatches[0].resources.remove(0)));
    broken(|m| drop(m.buffers.pop()));
    broken(|m| drop(m.textures.remove(0)));
    broken(|m| m.buffers.iter_mut().for_each(|b| b.bytes /= 2));
    broken(|m| drop(m.frames[3].writes[0].values.pop_first()));
    broken(|m| drop(m.frames.pop()));
}

/// Labels of the passes of each frame, as a profiler sees them who knows nothing of the tape.
fn recorded(gpu: &Gpu, method: &Method, frames: usize) -> Vec<Vec<String>> {
    let (device, queue) = (&gpu.device, &gpu.queue);
    let scene = bouncelight_lab::scenes::load("cornell").expect("a bundled scene");
    let mut uploaded = SceneGpu::new(device, queue, &scene).expect("it fits");
    uploaded.trace(device, queue, &scene).expect("it has rays");
    let texture = |format, usage| {
        let size = wgpu::Extent3d { width: SIZE[0], height: SIZE[1], depth_or_array_layers: 1 };
        let (dimension, label) = (wgpu::TextureDimension::D2, None);
        let texture = device.create_texture(&wgpu::TextureDescriptor {
            label,
            size,
            mip_level_count: 1,
            sample_count: 1,
            dimension,
            format,
            usage,
            view_formats: &[],
        });
        texture.create_view(&Default::default())
    };
    let [depth, normal, light, specular] =
        [F::R32Float, F::Rg16Float, F::Rgba16Float, F::Rgba8Unorm].map(|format| texture(format, U::TEXTURE_BINDING));
    let output = texture(F::Rgba16Float, U::STORAGE_BINDING);
    let [x, y, z, w] = [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];
    let camera = CameraMatrices {
        view_from_world: [x, y, z, w],
        clip_from_view: [x, y, [0.0, 0.0, 0.0, -1.0], [0.0, 0.0, 0.1, 0.0]],
    };
    let lights = Lights {
        buffer: &uploaded.light_buffer,
        count: 1,
        has_emissive_proxies: false,
        version: uploaded.light_version,
    };
    let inputs = Inputs {
        albedo: Some(&light),
        direct: Some(&light),
        specular: Some(&specular),
        lights: Some(lights),
        rays: uploaded.rays.as_ref().map(|scene| Rays { scene, environment: &uploaded.environment_view }),
        ..Inputs::new(SIZE, &depth, &normal, camera)
    };
    let mut technique = method::build(device, queue, SIZE, method).expect("it fits").expect("it draws");
    let settings = wgpu_profiler::GpuProfilerSettings::default();
    let mut profiler = wgpu_profiler::GpuProfiler::new(device, settings).expect("settings are sound");
    let mut all = Vec::new();
    for _ in 0..frames {
        let mut encoder = device.create_command_encoder(&Default::default());
        technique
            .record(&mut Recorder::timed(&mut encoder, &profiler), queue, &inputs, (&output).into())
            .expect("it records");
        profiler.resolve_queries(&mut encoder);
        queue.submit([encoder.finish()]);
        profiler.end_frame().expect("all queries are closed");
        device.poll(wgpu::PollType::wait_indefinitely()).expect("the device answers");
        let results = profiler.process_finished_frame(queue.get_timestamp_period()).expect("the frame is done");
        all.push(results.into_iter().map(|r| r.label).collect());
    }
    all
}

#[test]
fn every_pass_of_every_frame_is_written_down() {
    let Some(gpu) = common::gpu() else { return };
    for method in methods() {
        let m = exported(&gpu, &method, Target::Wgsl).manifest;
        let mut seen = 0;
        for (k, mut labels) in recorded(&gpu, &method, 32).into_iter().enumerate() {
            let beyond = k.checked_sub(m.steady.from);
            let frame = &m.frames[beyond.map_or(k, |b| m.steady.from + b % m.steady.period)];
            let mut told: Vec<_> = frame.dispatches.iter().map(|d| m.dispatches[*d].label.clone()).collect();
            seen += labels.len();
            // A pass of several dispatches has one label there.
            told.dedup_by(|b, a| a == b && !a.starts_with("gi.cache_update"));
            labels.dedup_by(|b, a| a == b && !a.starts_with("gi.cache_update"));
            assert_eq!(told, labels, "{} frame {k}", m.method);
        }
        assert!(seen >= 32 * 9, "{seen} passes");
    }
}

#[test]
fn a_folder_is_written_whole_or_not_at_all() {
    if common::gpu().is_none() {
        return;
    }
    let dir = tempfile::tempdir().expect("a folder");
    let out = path(&dir, "out");
    let export = |more: &[&str]| bouncelight(&[&["export", "cornell", "--size", "64x48", "-o", &out], more].concat());
    for target in ["wgsl", "glsl430", "spirv"] {
        // The second and third replace what the first has written.
        assert!(export(&["--target", target]).status.success());
        let text = std::fs::read_to_string(dir.path().join("out/bouncelight.json")).expect("a manifest");
        let m: Manifest = serde_json::from_str(&text).expect("it is a manifest");
        assert_eq!((m.schema, m.target.as_str(), m.size), (2, target, [64, 48]));
        for shader in &m.shaders {
            assert!(dir.path().join("out").join(&shader.file).is_file(), "{}", shader.file);
        }
        let count = std::fs::read_dir(dir.path().join("out/shaders")).expect("shaders").count();
        assert!(count <= m.shaders.len(), "nothing of the export before stays");
    }
    let left: Vec<_> = std::fs::read_dir(&dir).expect("a folder").flatten().map(|e| e.file_name()).collect();
    assert_eq!(left, ["out"], "nothing else is left behind");
    let mine = path(&dir, "mine");
    std::fs::create_dir(&mine).unwrap();
    std::fs::write(dir.path().join("mine/letter"), "dear").unwrap();
    let base = ["export", "cornell", "--target", "wgsl", "-o"];
    let with = |rest: &[&'static str]| [&base[..4], rest].concat();
    fails(&[&base[..], &[&mine]].concat(), 2, &["mine", "something else"]);
    assert_eq!(std::fs::read(dir.path().join("mine/letter")).unwrap(), b"dear");
    // Nor does it go where it lies beside an earlier export.
    std::fs::write(dir.path().join("out/letter"), "dear").unwrap();
    fails(&[&base[..], &[&out]].concat(), 2, &["out", "something else"]);
    assert_eq!(std::fs::read(dir.path().join("out/letter")).unwrap(), b"dear");
    fails(&with(&["-o", "/nowhere/at/all"]), 2, &["does not exist"]);
    let fresh = path(&dir, "fresh");
    fails(&["export", "cornell", "--target", "wgsl", "--method", "ssgi", "-o", &fresh], 2, &["gather"]);
    fails(&["export", "cornell", "--target", "hlsl", "-o", &fresh], 2, &["hlsl"]);
    fails(&["export", "nowhere.glb", "--target", "wgsl", "-o", &fresh], 4, &["nowhere.glb"]);
    assert!(!dir.path().join("fresh").exists());
}
