//! A compute shader in the language of another host, and what it binds, both through naga.

use super::manifest::{Binding, Member, Struct};
use super::{ExportError, Target};
use naga::back::{glsl, pipeline_constants, spv};
use naga::proc::{BoundsCheckPolicies, BoundsCheckPolicy, GlobalCtx};
use naga::valid::{Capabilities, ModuleInfo, ValidationFlags, Validator};
use naga::{AddressSpace, Handle, ImageClass, Module, ResourceBinding, ScalarKind, ShaderStage, Type, TypeInner};
use std::collections::BTreeMap;

/// A shader that has been parsed and validated without any optional feature.
pub(super) struct Parsed {
    module: Module,
    info: ModuleInfo,
}

/// What a shader's text becomes.
pub(super) struct Translated {
    pub bytes: Vec<u8>,
    pub entry: String,
}

impl Parsed {
    /// Parses and validates.
    pub fn new(name: &str, text: &str) -> Result<Self, ExportError> {
        let wrong = |message: String| ExportError::Shader { shader: name.to_owned(), message };
        let module = naga::front::wgsl::parse_str(text).map_err(|e| wrong(e.emit_to_string(text)))?;
        // WebGPU has packing of halves; naga counts it as a capability because some old OpenGL has
        // not.
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::SHADER_FLOAT16_IN_FLOAT32);
        let info = validator.validate(&module).map_err(|e| wrong(e.emit_to_string(text)))?;
        Ok(Self { module, info })
    }

    fn entry(&self, name: &str) -> Option<(usize, &naga::EntryPoint)> {
        let fits = |(_, e): &(usize, &naga::EntryPoint)| e.stage == ShaderStage::Compute && e.name == name;
        self.module.entry_points.iter().enumerate().find(fits)
    }

    /// Threads of a workgroup of entry point `entry`.
    pub fn workgroup_size(&self, entry: &str) -> Option<[u32; 3]> {
        self.entry(entry).map(|(_, e)| e.workgroup_size)
    }

    /// What entry point `entry` uses, in the order of groups and bindings.
    pub fn bindings(&self, entry: &str, target: Target) -> Vec<Binding> {
        let Some((index, _)) = self.entry(entry) else { return Vec::new() };
        let used = self.info.get_entry_point(index);
        let context = self.module.to_ctx();
        let mut bindings = Vec::new();
        for (handle, variable) in self.module.global_variables.iter() {
            let Some(place) = variable.binding.filter(|_| !used[handle].is_empty()) else { continue };
            let inner = &self.module.types[variable.ty].inner;
            let buffer = || (self.struct_name(variable.ty), Some(bytes(inner, context)));
            let (kind, (holds, bytes)) = match (variable.space, inner) {
                (AddressSpace::Uniform, _) => ("uniform", buffer()),
                (AddressSpace::Storage { access }, _) if access.contains(naga::StorageAccess::STORE) => {
                    ("storage", buffer())
                }
                (AddressSpace::Storage { .. }, _) => ("read-only-storage", buffer()),
                (_, TypeInner::Image { class: ImageClass::Storage { format, .. }, .. }) => {
                    ("storage-texture", (Some(format!("{format:?}").to_lowercase()), None))
                }
                (_, TypeInner::Image { class: ImageClass::Sampled { kind: ScalarKind::Uint, .. }, .. }) => {
                    ("texture", (Some("uint".to_owned()), None))
                }
                _ => ("texture", (Some("float".to_owned()), None)),
            };
            bindings.push(Binding {
                group: place.group,
                binding: place.binding,
                slot: None,
                name: variable.name.clone().unwrap_or_default(),
                kind: kind.to_owned(),
                holds,
                bytes,
            });
        }
        bindings.sort_by_key(|b| (b.group, b.binding));
        if target == Target::Glsl430 {
            let mut next = [0; 4];
            for binding in &mut bindings {
                let space = match binding.kind.as_str() {
                    "uniform" => 0,
                    "texture" => 2,
                    "storage-texture" => 3,
                    _ => 1,
                };
                binding.slot = Some(next[space]);
                next[space] += 1;
            }
        }
        bindings
    }

    fn struct_name(&self, ty: Handle<Type>) -> Option<String> {
        let ty = &self.module.types[ty];
        matches!(ty.inner, TypeInner::Struct { .. }).then(|| ty.name.clone()).flatten()
    }

    /// The struct of that name.
    pub fn layout(&self, name: &str) -> Option<Struct> {
        let ty = self.module.types.iter().find(|(_, ty)| ty.name.as_deref() == Some(name))?.1;
        let TypeInner::Struct { members, span } = &ty.inner else { return None };
        let member = |m: &naga::StructMember| Member {
            name: m.name.clone().unwrap_or_default(),
            kind: type_name(&self.module.types[m.ty].inner),
            offset: m.offset,
        };
        let named = members.iter().map(member).filter(|m| !m.name.starts_with("pad"));
        Some(Struct { bytes: *span, members: named.collect() })
    }

    /// The shader in the language of `target`; `text` is what was parsed.
    pub fn translate(
        &self,
        (name, text): (&str, &str),
        entry: &str,
        target: Target,
        bindings: &[Binding],
    ) -> Result<Translated, ExportError> {
        let wrong = |message: String| ExportError::Shader { shader: name.to_owned(), message };
        let stage = Some((ShaderStage::Compute, entry));
        if target == Target::Wgsl && self.module.overrides.is_empty() {
            return Ok(Translated { bytes: text.as_bytes().to_vec(), entry: entry.to_owned() });
        }
        let (module, info) =
            pipeline_constants::process_overrides(&self.module, &self.info, stage, &Default::default())
                .map_err(|e| wrong(e.to_string()))?;
        match target {
            Target::Wgsl => Err(wrong("it has overrides, which WGSL hosts would have to set".to_owned())),
            Target::Glsl430 => {
                let place = |b: &Binding| ResourceBinding { group: b.group, binding: b.binding };
                let slots = bindings.iter().map(|b| (place(b), b.slot.unwrap_or(0) as u8));
                let options = glsl::Options {
                    version: glsl::Version::Desktop(430),
                    writer_flags: glsl::WriterFlags::empty(),
                    binding_map: slots.collect::<BTreeMap<_, _>>().into_iter().collect(),
                    // Shaders write what a workgroup shares before they read it (`gpu::bind`).
                    zero_initialize_workgroup_memory: false,
                };
                let pipeline = glsl::PipelineOptions {
                    shader_stage: ShaderStage::Compute,
                    entry_point: entry.to_owned(),
                    multiview: None,
                };
                // As wgpu has them on OpenGL: what lies beyond a buffer GLSL itself leaves
                // undefined.
                let policies = BoundsCheckPolicies {
                    image_load: BoundsCheckPolicy::ReadZeroSkipWrite,
                    ..BoundsCheckPolicies::default()
                };
                let mut out = String::new();
                let mut writer = glsl::Writer::new(&mut out, &module, &info, &options, &pipeline, policies)
                    .map_err(|e| wrong(e.to_string()))?;
                writer.write().map_err(|e| wrong(e.to_string()))?;
                Ok(Translated { bytes: with_integer_mix(&out).into_bytes(), entry: "main".to_owned() })
            }
            Target::Spirv => {
                let mut options = spv::Options {
                    lang_version: (1, 3),
                    bounds_check_policies: BoundsCheckPolicies {
                        index: BoundsCheckPolicy::Restrict,
                        buffer: BoundsCheckPolicy::Restrict,
                        image_load: BoundsCheckPolicy::ReadZeroSkipWrite,
                        binding_array: BoundsCheckPolicy::Unchecked,
                    },
                    zero_initialize_workgroup_memory: spv::ZeroInitializeWorkgroupMemoryMode::None,
                    ..spv::Options::default()
                };
                options.flags.remove(spv::WriterFlags::ADJUST_COORDINATE_SPACE | spv::WriterFlags::DEBUG);
                let pipeline =
                    spv::PipelineOptions { shader_stage: ShaderStage::Compute, entry_point: entry.to_owned() };
                let words =
                    spv::write_vec(&module, &info, &options, Some(&pipeline)).map_err(|e| wrong(e.to_string()))?;
                let bytes = words.iter().flat_map(|w| w.to_le_bytes()).collect();
                Ok(Translated { bytes, entry: entry.to_owned() })
            }
        }
    }
}

/// GLSL's `mix` chooses among vectors of integers from 4.50 on only, and naga takes it for granted.
fn with_integer_mix(text: &str) -> String {
    if !text.contains("mix(") {
        return text.to_owned();
    }
    let mut own = String::new();
    for (n, parts) in [(1, ""), (2, "xy"), (3, "xyz"), (4, "xyzw")] {
        let name = |prefix: &str, scalar: &str| if n == 1 { scalar.to_owned() } else { format!("{prefix}vec{n}") };
        let (float, bools) = (name("", "float"), name("b", "bool"));
        let mut weights = vec![float.clone(), bools.clone(), "float".to_owned()];
        weights.dedup();
        weights.truncate(if n == 1 { 2 } else { 3 });
        for weight in weights {
            own += &format!("{float} own_mix({float} a, {float} b, {weight} t) {{ return mix(a, b, t); }}\n");
        }
        for kind in [name("u", "uint"), name("i", "int"), bools.clone()] {
            let choice = |p: char| if n == 1 { "t ? b : a".to_owned() } else { format!("t.{p} ? b.{p} : a.{p}") };
            let all: Vec<_> = if n == 1 { vec![choice(' ')] } else { parts.chars().map(choice).collect() };
            let all = all.join(", ");
            own += &format!("{kind} own_mix({kind} a, {kind} b, {bools} t) {{ return {kind}({all}); }}\n");
        }
    }
    own += "#define mix own_mix\n";
    // Behind the lines that come first.
    let head: usize = text.split_inclusive('\n').take_while(|l| l.starts_with('#')).map(str::len).sum();
    format!("{}{own}{}", &text[..head], &text[head..])
}

/// Least bytes of a buffer of this type: one element of an array without a length.
fn bytes(inner: &TypeInner, context: GlobalCtx<'_>) -> u64 {
    match inner {
        TypeInner::Array { size: naga::ArraySize::Dynamic, stride, .. } => u64::from(*stride),
        inner => u64::from(inner.size(context)),
    }
}

/// As WGSL writes it.
fn type_name(inner: &TypeInner) -> String {
    let scalar = |s: naga::Scalar| match s.kind {
        ScalarKind::Sint => "i32",
        ScalarKind::Uint => "u32",
        _ => "f32",
    };
    match *inner {
        TypeInner::Scalar(s) => scalar(s).to_owned(),
        TypeInner::Vector { size, scalar: s } => format!("vec{}<{}>", size as u8, scalar(s)),
        TypeInner::Matrix { columns, rows, scalar: s } => format!("mat{}x{}<{}>", columns as u8, rows as u8, scalar(s)),
        _ => "?".to_owned(),
    }
}
