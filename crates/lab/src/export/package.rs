//! A [`Recording`] as a manifest and files, and those in a folder.

use super::manifest::{self, Bound, Buffer, Content, Frame, Manifest, Shader, Steady, Struct, Texture, Value, Write};
use super::record::{Recording, Taken, part};
use super::shader::Parsed;
use super::{ExportError, MANIFEST, Target};
use bouncelight::gpu::readback;
use bouncelight::gpu::tape::Source;
use std::collections::BTreeMap;
use std::path::Path;

/// Structs that the host writes each frame, and their members that are not the same in every frame:
/// `camera` is what the view decides, the others are counters.
const HOST: [(&str, &[&str]); 2] = [
    ("Params", &["unproject", "depth", "gravity_from_view", "gravity_from_world", "world_from_view", "eye"]),
    ("Gather", &["eye", "frame", "cache_iteration", "last_iteration"]),
];

/// Uniform offsets are multiples of this under WebGPU's default limits.
const STRIDE: u64 = 256;

/// What a folder will hold.
#[derive(Debug, Clone)]
pub struct Package {
    /// How to use it.
    pub manifest: Manifest,
    /// Names within the folder, and bytes; without the manifest.
    pub files: Vec<(String, Vec<u8>)>,
}

/// Something with a name that the manifest counts up.
struct Named<T> {
    resource: T,
    name: String,
    /// Kinds of bindings that it has somewhere.
    kinds: Vec<String>,
}

struct Packing<'a> {
    target: Target,
    recording: &'a Recording,
    parsed: BTreeMap<Source, Parsed>,
    sources: Vec<(Source, String)>,
    shaders: Vec<Shader>,
    dispatches: Vec<manifest::Dispatch>,
    buffers: Vec<Named<wgpu::Buffer>>,
    textures: Vec<Named<wgpu::Texture>>,
    uniforms: BTreeMap<String, Struct>,
    files: Vec<(String, Vec<u8>)>,
}

impl Recording {
    /// Everything of the recording, read back from the device.
    pub(super) fn package(
        &self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        method: &str,
        target: Target,
    ) -> Result<Package, ExportError> {
        let mut packing = Packing {
            target,
            recording: self,
            parsed: BTreeMap::new(),
            sources: Vec::new(),
            shaders: Vec::new(),
            dispatches: Vec::new(),
            buffers: Vec::new(),
            textures: Vec::new(),
            uniforms: BTreeMap::new(),
            files: Vec::new(),
        };
        let frames: Vec<Frame> =
            (0u32..).zip(&self.frames).map(|(k, frame)| packing.frame(k, frame)).collect::<Result<_, _>>()?;
        let steady = steady(&frames).ok_or_else(|| ExportError::Recording {
            pass: method.to_owned(),
            reason: format!("its frames do not repeat within {}", frames.len()),
        })?;
        let frames = frames[..steady.from + steady.period].to_vec();
        let mut buffers = packing.host_buffers(&frames);
        for named in &packing.buffers {
            let bytes = readback::buffer(device, queue, &named.resource, 0, named.resource.size())?;
            let usage = |kind: &String| if kind == "uniform" { "uniform" } else { "storage" };
            let mut usages: Vec<_> = named.kinds.iter().map(usage).collect();
            usages.sort_unstable();
            usages.dedup();
            let (name, bytes_) = (named.name.clone(), bytes.len() as u64);
            let content = content(&mut packing.files, &named.name, bytes);
            buffers.push(Buffer { name, bytes: bytes_, usage: usages.join(" "), content });
        }
        let textures = packing.textures(device, queue)?;
        let Packing { shaders, dispatches, uniforms, files, .. } = packing;
        let manifest = Manifest {
            schema: manifest::SCHEMA,
            bouncelight: env!("CARGO_PKG_VERSION").to_owned(),
            target: target.name().to_owned(),
            method: method.to_owned(),
            size: self.size,
            buffers,
            textures,
            uniforms,
            shaders,
            dispatches,
            frames,
            steady,
        };
        Ok(Package { manifest, files })
    }
}

impl Packing<'_> {
    fn frame(&mut self, k: u32, taken: &[Taken]) -> Result<Frame, ExportError> {
        let mut written: BTreeMap<&'static str, Vec<Vec<u8>>> = BTreeMap::new();
        let mut run = Vec::with_capacity(taken.len());
        for one in taken {
            let gap = |reason: String| ExportError::Recording { pass: one.dispatch.label.clone(), reason };
            let shader = self.shader(one)?;
            let mut resources = Vec::new();
            for binding in self.shaders[shader].bindings.clone() {
                let (group, number) = (binding.group, binding.binding);
                let host = HOST.iter().find(|(name, _)| binding.holds.as_deref() == Some(name));
                if let Some((name, _)) = host.filter(|_| binding.kind == "uniform") {
                    let uniform = one.uniforms.iter().find(|u| (u.0, u.1) == (group, number));
                    let bytes = &uniform.ok_or_else(|| gap(format!("nothing was written to `{}`", binding.name)))?.2;
                    let slots = written.entry(name).or_default();
                    let slot = slots.iter().position(|s| s == bytes).unwrap_or_else(|| {
                        slots.push(bytes.clone());
                        slots.len() - 1
                    });
                    resources.push(Bound {
                        resource: name.to_lowercase(),
                        offset: Some(slot as u64 * STRIDE),
                        bytes: Some(bytes.len() as u64),
                    });
                    continue;
                }
                let groups = one.dispatch.groups.iter().find(|g| g.0 == group);
                let bound = groups.and_then(|(_, bound, shift)| {
                    let shift = if bound.first()?.0 == number { *shift } else { 0 };
                    Some((&bound.iter().find(|(n, _)| *n == number)?.1, u64::from(shift)))
                });
                let (bound, shift) = bound.ok_or_else(|| gap(format!("nothing is bound to `{}`", binding.name)))?;
                resources.push(self.resource(bound, shift, &binding));
            }
            let (label, workgroups) = (one.dispatch.label.clone(), one.dispatch.workgroups);
            let dispatch = manifest::Dispatch { label, shader, workgroups, resources };
            run.push(self.dispatches.iter().position(|d| *d == dispatch).unwrap_or_else(|| {
                self.dispatches.push(dispatch);
                self.dispatches.len() - 1
            }));
        }
        let (writes, cache_updates) = self.writes(k, &written)?;
        Ok(Frame { writes, dispatches: run, cache_updates })
    }

    /// The number of a dispatch's shader.
    fn shader(&mut self, taken: &Taken) -> Result<usize, ExportError> {
        let (source, entry) = (&taken.dispatch.source, &taken.dispatch.entry);
        let place = self.sources.iter().position(|(s, e)| s == source && e == entry);
        if let Some(place) = place {
            return Ok(place);
        }
        let pass = || taken.dispatch.label.clone();
        if source.text.is_empty() {
            return Err(ExportError::Recording { pass: pass(), reason: "its shader was compiled before".into() });
        }
        if !self.parsed.contains_key(source) {
            self.parsed.insert(source.clone(), Parsed::new(&source.name, &source.text)?);
        }
        let parsed = &self.parsed[source];
        let bindings = parsed.bindings(entry, self.target);
        let workgroup_size = parsed.workgroup_size(entry).ok_or_else(|| ExportError::Recording {
            pass: pass(),
            reason: format!("shader `{}` has no entry point `{entry}`", source.name),
        })?;
        for name in bindings.iter().filter(|b| b.kind == "uniform").filter_map(|b| b.holds.as_deref()) {
            if HOST.iter().any(|(host, _)| *host == name)
                && let Some(layout) = parsed.layout(name)
            {
                self.uniforms.insert(name.to_owned(), layout);
            }
        }
        let translated = parsed.translate((&source.name, &source.text), entry, self.target, &bindings)?;
        let plain = if entry == "main" { source.name.clone() } else { format!("{}.{entry}", source.name) };
        let name = unique(plain, |name| self.shaders.iter().any(|s| s.name == name));
        let file = format!("shaders/{name}.{}", self.target.extension());
        self.files.push((file.clone(), translated.bytes));
        self.sources.push((source.clone(), entry.clone()));
        self.shaders.push(Shader { name, file, entry: translated.entry, workgroup_size, bindings });
        Ok(self.shaders.len() - 1)
    }

    fn resource(&mut self, bound: &bouncelight::gpu::bind::Bound, shift: u64, binding: &manifest::Binding) -> Bound {
        let taken = |name: &str, this: &Self| {
            let host =
                this.recording.host.iter().any(|h| h.1 == name) || HOST.iter().any(|h| h.0.to_lowercase() == name);
            host || this.buffers.iter().any(|b| b.name == name) || this.textures.iter().any(|t| t.name == name)
        };
        if let Some((buffer, offset, bytes)) = part(bound) {
            let place = self.buffers.iter().position(|b| b.resource == *buffer).unwrap_or_else(|| {
                let name = unique(binding.name.clone(), |name| taken(name, self));
                self.buffers.push(Named { resource: buffer.clone(), name, kinds: Vec::new() });
                self.buffers.len() - 1
            });
            self.buffers[place].kinds.push(binding.kind.clone());
            let whole = offset + shift == 0 && bytes == buffer.size();
            let resource = self.buffers[place].name.clone();
            let (offset, bytes) = ((!whole).then_some(offset + shift), (!whole).then_some(bytes));
            return Bound { resource, offset, bytes };
        }
        let bouncelight::gpu::bind::Bound::View(view) = bound else { unreachable!("all else is a part of a buffer") };
        let place = self.textures.iter().position(|t| t.resource == *view.texture()).unwrap_or_else(|| {
            let host = self.recording.host.iter().find(|(texture, ..)| texture == view.texture());
            let own = || unique(binding.name.clone(), |name| taken(name, self));
            let name = host.map_or_else(own, |(_, name, _)| (*name).to_owned());
            self.textures.push(Named { resource: view.texture().clone(), name, kinds: Vec::new() });
            self.textures.len() - 1
        });
        self.textures[place].kinds.push(binding.kind.clone());
        Bound { resource: self.textures[place].name.clone(), offset: None, bytes: None }
    }

    /// What the host writes in frame `k`, and how many cache updates it has.
    fn writes(&self, k: u32, written: &BTreeMap<&'static str, Vec<Vec<u8>>>) -> Result<(Vec<Write>, u32), ExportError> {
        let mut writes = Vec::new();
        let number = |bytes: &[u8], layout: &Struct, name: &str| {
            let at = layout.members.iter().find(|m| m.name == name).map_or(0, |m| m.offset as usize);
            u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
        };
        let mut cache_updates = 0;
        for (name, changing) in HOST {
            let (Some(slots), Some(layout)) = (written.get(name), self.uniforms.get(name)) else { continue };
            let iteration = |bytes: &Vec<u8>| number(bytes, layout, "cache_iteration");
            let (first, last) =
                (slots.iter().map(iteration).min().unwrap_or(0), slots.iter().map(iteration).max().unwrap_or(0));
            if name == "Gather" {
                cache_updates = last - first + 1;
            }
            for (slot, bytes) in slots.iter().enumerate() {
                let mut values = BTreeMap::new();
                for member in &layout.members {
                    let value = match member.name.as_str() {
                        "frame" if number(bytes, layout, "frame") != k => {
                            let reason = format!("its frame is {}, not {k}", number(bytes, layout, "frame"));
                            return Err(ExportError::Recording { pass: name.to_owned(), reason });
                        }
                        "frame" => Value::Host("frame".to_owned()),
                        name @ ("cache_iteration" | "last_iteration") => match number(bytes, layout, name) - first {
                            0 => Value::Host("cache_iteration".to_owned()),
                            more => Value::Host(format!("cache_iteration + {more}")),
                        },
                        other if changing.contains(&other) => Value::Host(format!("camera.{other}")),
                        _ => value(&bytes[member.offset as usize..], &member.kind),
                    };
                    values.insert(member.name.clone(), value);
                }
                let (buffer, offset) = (name.to_lowercase(), slot as u64 * STRIDE);
                writes.push(Write { buffer, offset, kind: name.to_owned(), values });
            }
        }
        Ok((writes, cache_updates))
    }

    /// Buffers of what the host writes.
    fn host_buffers(&self, frames: &[Frame]) -> Vec<Buffer> {
        let room = |name: &str| {
            let writes = frames.iter().flat_map(|f| &f.writes).filter(|w| w.kind == name);
            writes.map(|w| w.offset + STRIDE).max()
        };
        let buffer = |(name, _): &(&str, &[&str])| {
            Some(Buffer {
                name: name.to_lowercase(),
                bytes: room(name)?,
                usage: "uniform".to_owned(),
                content: Content::Fill(0),
            })
        };
        HOST.iter().filter_map(buffer).collect()
    }

    fn textures(&mut self, device: &wgpu::Device, queue: &wgpu::Queue) -> Result<Vec<Texture>, ExportError> {
        let mut all = Vec::new();
        for named in &self.textures {
            let (texture, name) = (&named.resource, &named.name);
            let host = self.recording.host.iter().find(|h| h.0 == *texture).map(|h| h.2);
            let (stored, loaded) =
                (named.kinds.iter().any(|k| k == "storage-texture"), named.kinds.iter().any(|k| k == "texture"));
            let role = host.unwrap_or(if stored && !loaded { "output" } else { "internal" });
            let content = if stored || host.is_some() {
                Content::Fill(0)
            } else {
                content(&mut self.files, name, readback::texture(device, queue, texture)?)
            };
            all.push(Texture {
                name: name.clone(),
                role: role.to_owned(),
                size: [texture.width(), texture.height()],
                format: format!("{:?}", texture.format()).to_lowercase().replace("srgb", "-srgb"),
                content,
            });
        }
        Ok(all)
    }
}

/// `name`, or with a number where it is taken.
fn unique(name: String, taken: impl Fn(&str) -> bool) -> String {
    if !taken(&name) {
        return name;
    }
    let mut numbered = (2u32..).map(|n| format!("{name}_{n}"));
    numbered.find(|n| !taken(n)).unwrap_or(name)
}

/// A file of `bytes`, unless all of them are the same.
fn content(files: &mut Vec<(String, Vec<u8>)>, name: &str, bytes: Vec<u8>) -> Content {
    let first = bytes.first().copied().unwrap_or(0);
    if bytes.iter().all(|b| *b == first) {
        return Content::Fill(first);
    }
    let file = format!("data/{name}.bin");
    files.push((file.clone(), bytes));
    Content::File(file)
}

/// The member of type `kind` that begins `bytes`.
fn value(bytes: &[u8], kind: &str) -> Value {
    let word = |i: usize| [bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]];
    let number = |i| {
        if kind.contains("u32") {
            f64::from(u32::from_le_bytes(word(i)))
        } else {
            f64::from(f32::from_le_bytes(word(i)))
        }
    };
    let places: Vec<usize> = match kind {
        "u32" | "f32" => return Value::Number(number(0)),
        "mat3x3<f32>" => (0..3).flat_map(|c| (0..3).map(move |r| 4 * c + r)).collect(),
        // `vecN<…>`.
        _ => (0..kind.as_bytes().get(3).map_or(0, |n| usize::from(n - b'0'))).collect(),
    };
    Value::Numbers(places.into_iter().map(number).collect())
}

/// From which frame on they repeat, every one or every two; known when they have done so eight
/// times.
fn steady(frames: &[Frame]) -> Option<Steady> {
    let repeats = |period: usize| {
        let from =
            (0..frames.len().checked_sub(period)?).rev().take_while(|&k| frames[k] == frames[k + period]).last()?;
        (frames.len() - from >= 8 * period).then_some(Steady { from, period })
    };
    [1, 2].into_iter().filter_map(repeats).min_by_key(|s| s.from + s.period)
}

impl Package {
    /// Writes all into `folder`, which is new, empty, or an earlier export that is replaced: whole
    /// or not at all.
    ///
    /// # Errors
    /// [`ExportError::Folder`], [`ExportError::Write`].
    pub fn write(&self, folder: &Path) -> Result<(), ExportError> {
        check_folder(folder)?;
        let fail = |source| ExportError::Write { path: folder.into(), source };
        let parent = folder.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let work = tempfile::Builder::new().prefix(".bouncelight-").tempdir_in(parent).map_err(fail)?;
        let fresh = work.path().join("fresh");
        for sub in ["shaders", "data"] {
            std::fs::create_dir_all(fresh.join(sub)).map_err(fail)?;
        }
        for (name, bytes) in &self.files {
            std::fs::write(fresh.join(name), bytes).map_err(fail)?;
        }
        let text = serde_json::to_vec_pretty(&self.manifest).map_err(|e| fail(e.into()))?;
        std::fs::write(fresh.join(MANIFEST), text).map_err(fail)?;
        // What was there goes away with the temporary folder.
        let before = work.path().join("before");
        let replaced = folder.exists();
        if replaced {
            std::fs::rename(folder, &before).map_err(fail)?;
        }
        std::fs::rename(&fresh, folder).map_err(|e| {
            if replaced {
                let _ = std::fs::rename(&before, folder);
            }
            fail(e)
        })
    }
}

/// Whether [`Package::write`] would take `folder`, found out before any work.
///
/// # Errors
/// [`ExportError::Folder`].
pub fn check_folder(folder: &Path) -> Result<(), ExportError> {
    let wrong = |reason| Err(ExportError::Folder { path: folder.into(), reason });
    let parent = folder.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !parent.is_dir() {
        return wrong("the folder that it would be in does not exist");
    }
    if !folder.exists() {
        return if folder.file_name().is_some() { Ok(()) } else { wrong("it has no name") };
    }
    let Ok(entries) = std::fs::read_dir(folder) else { return wrong("it is not a readable folder") };
    // Whatever else is in it would go with the export that is replaced.
    let ours = |name: &std::ffi::OsStr| [MANIFEST, "shaders", "data"].iter().any(|own| name == *own);
    let names: Vec<_> = entries.flatten().map(|e| e.file_name()).collect();
    if names.is_empty() || (folder.join(MANIFEST).is_file() && names.iter().all(|n| ours(n))) {
        return Ok(());
    }
    wrong("the folder holds something else than an export; name a new one")
}
