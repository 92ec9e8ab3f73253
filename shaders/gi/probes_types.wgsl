// What the passes of gi.probes share. `gi::probes::gpu::ProbeParams` is the Rust side.

struct ProbeParams {
    // Surfels; the parts of the sky and the black surfel follow them in the lists of light.
    surfels: u32,
    // Links of a surfel, and how many of them carry the light that bounces on.
    rays: u32,
    inner_rays: u32,
    light_count: u32,
    // Mean radiance of the environment.
    environment: vec3f,
    // Edge of the field's cubes, metres.
    side: f32,
    // Where the field's cubes are counted from, metres.
    centre: vec3f,
    // Entries of the field's table less 1.
    table_mask: u32,
    // The largest spacing of surfels, metres.
    spacing: f32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

// Parts of the sky.
const SKY = 64u;
