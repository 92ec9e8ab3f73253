// A small deferred renderer on WebGPU: G-buffers, and a composite that adds what a pass found.

const SHARED = /* wgsl */ `
struct View { clip: mat4x4f, before: mat4x4f, eye: vec4f, sky: vec4f, shown: vec4f }
@group(0) @binding(0) var<uniform> view: View;
// The share of even light that a lobe shows: the split sum of bouncelight's shaders/lib/brdf.wgsl.
fn lobe(f0: vec3f, roughness: f32, n_v: f32) -> vec3f {
    let x = 1.0 - saturate(n_v);
    let r = saturate(roughness);
    let s = max(r, 0.1);
    let exponent = (6.0393 + 26.2500 * r * r) * exp(-3.1851 * r);
    let rim = 1.2024 + r * (-3.4406 + r * (3.4447 - r * 1.1744));
    let bias = saturate(pow(max(x, 1e-6), exponent) * rim + 0.01503 * r * (1.0 - r));
    let q = vec4f(1.0, s, s * s, s * s * s);
    let scale = dot(vec4f(0.9051, 0.9982, -2.4025, 0.7910), q)
        + x * (dot(vec4f(0.3306, -3.0833, 5.2607, -2.3697), q)
        + x * (dot(vec4f(-2.2334, 20.9684, -41.1089, 23.1553), q)
        + x * (dot(vec4f(6.3627, -54.4488, 103.1189, -56.3863), q)
        + x * dot(vec4f(-5.7047, 38.8754, -67.3500, 35.1796), q))));
    return f0 * clamp(scale, 0.0, 1.0 - bias) + bias;
}`;

const GEOMETRY = SHARED + /* wgsl */ `
struct Object { world: mat4x4f, color: vec4f, emission: vec4f }
@group(1) @binding(0) var<uniform> object: Object;
struct Varying {
    @builtin(position) place: vec4f, @location(0) p: vec3f, @location(1) n: vec3f, @location(2) before: vec4f,
    @location(3) now: vec4f,
}
@vertex fn vertex(@location(0) position: vec3f, @location(1) normal: vec3f) -> Varying {
    let p = object.world * vec4f(position, 1.0);
    let m = mat3x3f(object.world[0].xyz, object.world[1].xyz, object.world[2].xyz);
    // The cofactors: the inverse's transpose times the determinant.
    let n = mat3x3f(cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])) * normal;
    let now = view.clip * p;
    return Varying(now, p.xyz, n, view.before * p, now);
}
struct Fields {
    @location(0) normal: vec2f, @location(1) albedo: vec4f, @location(2) specular: vec4f, @location(3) emissive: vec4f,
    @location(4) motion: vec2f,
}
@fragment fn fragment(in: Varying) -> Fields {
    let v = normalize(view.eye.xyz - in.p);
    var n = normalize(in.n);
    n = select(n, -n, dot(n, v) < 0.0);
    let q = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    let s = select(vec2f(-1.0), vec2f(1.0), q >= vec2f(0.0));
    let metallic = object.color.a;
    let roughness = object.emission.a;
    let share = lobe(vec3f(0.04), roughness, dot(n, v)).x;
    let motion = (in.before.xy / in.before.w - in.now.xy / in.now.w) * vec2f(0.5, -0.5);
    return Fields(
        select((1.0 - abs(q.yx)) * s, q, n.z >= 0.0),
        vec4f(object.color.rgb * (1.0 - metallic) * (1.0 - share), 1.0),
        vec4f(mix(vec3f(0.04), object.color.rgb, metallic), roughness),
        vec4f(object.emission.rgb, 1.0),
        motion,
    );
}`;

const COMPOSITE = SHARED + /* wgsl */ `
@group(1) @binding(0) var albedo: texture_2d<f32>;
@group(1) @binding(1) var emissive: texture_2d<f32>;
@group(1) @binding(2) var depth: texture_2d<f32>;
@group(1) @binding(3) var indirect: texture_2d<f32>;
@group(1) @binding(4) var specular: texture_2d<f32>;
@vertex fn vertex(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    return vec4f(select(-1.0, 3.0, i == 1u), select(-1.0, 3.0, i == 2u), 0.0, 1.0);
}
@fragment fn fragment(@builtin(position) place: vec4f) -> @location(0) vec4f {
    let pixel = vec2i(place.xy);
    let z = textureLoad(depth, pixel, 0).x;
    var hdr = view.sky.rgb;
    if z > 0.0 {
        hdr = textureLoad(emissive, pixel, 0).rgb;
        // Right of the split: with what the pass found.
        if place.x >= view.shown.x {
            hdr += textureLoad(albedo, pixel, 0).rgb * textureLoad(indirect, pixel, 0).rgb
                + textureLoad(specular, pixel, 0).rgb;
        }
    }
    let c = saturate(hdr);
    return vec4f(select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, 12.92 * c, c <= vec3f(0.0031308)), 1.0);
}`;

const FORMATS = { normal: "rg16float", albedo: "rgba8unorm", specular: "rgba8unorm", emissive: "rgba16float", motion: "rg16float" };

export class Renderer {
  constructor(device, scene, size, format) {
    Object.assign(this, { device, scene, size });
    const texture = (f) => device.createTexture({
      size, format: f, usage: GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.TEXTURE_BINDING,
    }).createView();
    this.targets = Object.fromEntries(Object.entries(FORMATS).map(([name, f]) => [name, texture(f)]));
    this.depth = texture("depth32float");
    // No lamp or sun is drawn, so direct light is 0: a texture that nobody writes.
    this.inputs = { ...this.targets, depth: this.depth, direct: texture("rgba16float") };
    const module = device.createShaderModule({ code: GEOMETRY });
    const buffers = [0, 1].map((shaderLocation) => (
      { arrayStride: 12, attributes: [{ shaderLocation, offset: 0, format: "float32x3" }] }));
    this.geometry = device.createRenderPipeline({
      layout: "auto",
      vertex: { module, buffers },
      fragment: { module, targets: Object.values(FORMATS).map((f) => ({ format: f })) },
      depthStencil: { format: "depth32float", depthWriteEnabled: true, depthCompare: "greater" },
    });
    const screen = device.createShaderModule({ code: COMPOSITE });
    const shown = (f) => device.createRenderPipeline({
      layout: "auto", vertex: { module: screen }, fragment: { module: screen, targets: [{ format: f }] },
    });
    this.composite = shown(format);
    const filled = (data, usage) => {
      const buffer = device.createBuffer({ size: data.byteLength, usage: usage | GPUBufferUsage.COPY_DST });
      device.queue.writeBuffer(buffer, 0, data);
      return buffer;
    };
    const group = (pipeline, index, resources) => device.createBindGroup({
      layout: pipeline.getBindGroupLayout(index), entries: resources.map((resource, binding) => ({ binding, resource })),
    });
    this.group = group;
    const uniform = () => filled(new Float32Array(44), GPUBufferUsage.UNIFORM);
    [this.drawn, this.shown] = [uniform(), uniform()];
    this.drawnGroup = group(this.geometry, 0, [{ buffer: this.drawn }]);
    this.shownGroup = group(this.composite, 0, [{ buffer: this.shown }]);
    this.draws = scene.draws.map((d) => {
      const object = new Float32Array([...d.world, ...d.color, d.metallic, ...d.emission, d.roughness]);
      return {
        count: d.indices.length,
        indices: filled(d.indices, GPUBufferUsage.INDEX),
        vertices: [filled(d.positions, GPUBufferUsage.VERTEX), filled(d.normals, GPUBufferUsage.VERTEX)],
        group: group(this.geometry, 1, [{ buffer: filled(object, GPUBufferUsage.UNIFORM) }]),
      };
    });
  }

  // Reversed depth, no far plane. Rows.
  projection() {
    const f = 1 / Math.tan(this.scene.camera.yfov / 2);
    return [[f * this.size[1] / this.size[0], 0, 0, 0], [0, f, 0, 0], [0, 0, 0, this.scene.camera.znear], [0, 0, -1, 0]];
  }

  // The scene's camera, moved by `shift` in the world: rows of the rotation into view space, and the eye.
  view(shift = [0, 0, 0]) {
    const w = this.scene.camera.world;
    return { rotation: [0, 4, 8].map((i) => w.slice(i, i + 3)), eye: [0, 1, 2].map((i) => w[12 + i] + shift[i]) };
  }

  // Records the G-buffers.
  draw(encoder, { rotation, eye }) {
    const p = this.projection();
    const view = rotation.map((r) => [...r, -(r[0] * eye[0] + r[1] * eye[1] + r[2] * eye[2])]).concat([[0, 0, 0, 1]]);
    const clip = [0, 1, 2, 3].flatMap((c) => p.map((row) => row.reduce((sum, n, i) => sum + n * view[i][c], 0)));
    this.device.queue.writeBuffer(this.drawn, 0, new Float32Array([...clip, ...(this.before ?? clip), ...eye, 0]));
    this.before = clip;
    const attachment = (target) => ({ view: target, loadOp: "clear", storeOp: "store", clearValue: [0, 0, 0, 0] });
    const pass = encoder.beginRenderPass({
      colorAttachments: Object.values(this.targets).map(attachment),
      depthStencilAttachment: { view: this.depth, depthLoadOp: "clear", depthStoreOp: "store", depthClearValue: 0 },
    });
    pass.setPipeline(this.geometry);
    pass.setBindGroup(0, this.drawnGroup);
    for (const { count, indices, vertices, group } of this.draws) {
      pass.setBindGroup(1, group);
      vertices.forEach((v, slot) => pass.setVertexBuffer(slot, v));
      pass.setIndexBuffer(indices, "uint32");
      pass.drawIndexed(count);
    }
    pass.end();
    this.eye = eye;
  }

  // Records the picture into `target`; left of pixel `split` without the pass's light.
  show(encoder, target, pass, split) {
    const shown = [...this.before, ...this.before, ...this.eye, 0, ...pass.sky, 0, split, ...this.size, 0];
    this.device.queue.writeBuffer(this.shown, 0, new Float32Array(shown));
    const { albedo, emissive } = this.targets;
    this.groups ??= new Map();
    if (!this.groups.has(pass)) {
      const bound = [albedo, emissive, this.depth, pass.output, pass.specular];
      this.groups.set(pass, this.group(this.composite, 1, bound));
    }
    const screen = encoder.beginRenderPass({
      colorAttachments: [{ view: target, loadOp: "clear", storeOp: "store", clearValue: [0, 0, 0, 1] }],
    });
    screen.setPipeline(this.composite);
    screen.setBindGroup(0, this.shownGroup);
    screen.setBindGroup(1, this.groups.get(pass));
    screen.draw(3);
    screen.end();
  }
}
