//! `bouncelight doctor`: which adapter, what it can do, and the fix when there is none.

use super::args::Global;
use super::stdout::say;
use anyhow::Result;
use bouncelight::gpu::probe::driver_faults;
use bouncelight::gpu::{self, Gpu};
use bouncelight::gpu_scene::TextureMemory;
use serde_json::json;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Print a JSON record instead of text.
    #[arg(long, help_heading = "Options")]
    json: bool,
}

/// Examples at the end of the help.
pub const EXAMPLES: &str = "\
Examples:
  bouncelight doctor
  bouncelight doctor --adapter cpu
  bouncelight doctor --backend vulkan --json";

/// Limits that the passes lean on: name and what a WebGPU default device grants.
fn limits(l: &wgpu::Limits) -> [(&'static str, u64); 8] {
    [
        ("max_texture_dimension_2d", l.max_texture_dimension_2d.into()),
        ("max_color_attachment_bytes_per_sample", l.max_color_attachment_bytes_per_sample.into()),
        ("max_storage_buffers_per_shader_stage", l.max_storage_buffers_per_shader_stage.into()),
        ("max_storage_textures_per_shader_stage", l.max_storage_textures_per_shader_stage.into()),
        ("max_storage_buffer_binding_size", l.max_storage_buffer_binding_size),
        ("max_compute_workgroup_storage_size", l.max_compute_workgroup_storage_size.into()),
        ("max_compute_invocations_per_workgroup", l.max_compute_invocations_per_workgroup.into()),
        ("max_sampled_textures_per_shader_stage", l.max_sampled_textures_per_shader_stage.into()),
    ]
}

pub fn run(global: &Global, args: Args) -> Result<()> {
    let options = global.gpu_options();
    let (_, adapters) = gpu::candidates(&options)?;
    let found: Vec<_> =
        adapters.iter().map(|a| a.get_info()).map(|i| format!("{} ({:?})", i.name, i.backend)).collect();
    let gpu = Gpu::open(&options)?;
    let wanted = gpu::wanted_features();
    let (used, missing) = (wanted & gpu.adapter.features(), wanted - gpu.adapter.features());
    let (have, need) = (limits(&gpu.device.limits()), limits(&wgpu::Limits::default()));
    let short: Vec<_> = have.iter().zip(need).filter(|(h, n)| h.1 < n.1).map(|(h, _)| h.0).collect();
    let names = |f: wgpu::Features| f.iter_names().map(|(n, _)| n.to_lowercase()).collect::<Vec<_>>();
    let faults = driver_faults(&gpu)?;
    if args.json {
        let record = json!({
            "schema": 1, "adapter": gpu.info.name, "backend": format!("{:?}", gpu.info.backend).to_lowercase(),
            "driver": gpu.info.driver, "driver_info": gpu.info.driver_info, "software": gpu.is_software(),
            "limits": have.into_iter().collect::<std::collections::BTreeMap<_, _>>(), "limits_below_default": short,
            "features_used": names(used), "features_missing": names(missing), "adapters": found,
            "driver_faults": faults.iter().map(|f| f.name()).collect::<Vec<_>>(),
        });
        say!("{record:#}");
        return Ok(());
    }
    say!("adapter   {}", gpu.sentence());
    say!("others    {}", found.iter().skip(1).cloned().collect::<Vec<_>>().join(", "));
    say!("features  used: {}; missing: {}", list(&names(used)), list(&names(missing)));
    for (name, value) in have {
        say!("limit     {name} = {value}{}", if short.contains(&name) { "  (below WebGPU's default)" } else { "" });
    }
    let blocks = used.contains(wgpu::Features::TEXTURE_COMPRESSION_BC);
    let most = TextureMemory::MOST >> 20;
    if blocks {
        say!("textures  compressed (BC7, 1 byte a texel) where a scene's take more than {most} MiB; --textures");
    } else {
        say!("textures  uncompressed, 4 bytes a texel: this device lacks BC7");
    }
    for fault in faults {
        say!("driver    {}", fault.sentence());
    }
    if missing.contains(wgpu::Features::TIMESTAMP_QUERY) {
        say!("note      without timestamp_query, bench shows synchronised wall-clock time only");
    }
    Ok(())
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none".into() } else { names.join(", ") }
}
