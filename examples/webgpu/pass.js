// The pass that `bouncelight export --target wgsl` wrote, run by WebGPU with its default limits. Knows no renderer.

const STEP = { reversed: 0, forward: 6e-8 };

// What the manifest calls `camera.NAME`. `view`: rows of the rotation from the world into view space (looking down -Z)
// and `eye`; `p`: rows of a projection with clip space 0 to w.
export function cameraValues({ rotation, eye }, p, depth = "reversed") {
  const [a, b] = [p[2][2], p[2][3]];
  const [up, back] = [rotation[1], rotation[2]];
  // The camera's frame without its tilt: horizontal right, up, horizontal backward.
  const flat = Math.hypot(back[0], back[2]) > 1e-3 ? back : up.map((u) => -Math.sign(back[1]) * u);
  const length = Math.hypot(flat[0], flat[2]);
  const z = [flat[0] / length, 0, flat[2] / length];
  const gravity = [[z[2], 0, -z[0]], [0, 1, 0], z];
  const columns = (rows) => [0, 1, 2].flatMap((c) => rows.map((row) => row[c]));
  const dot = (u, v) => u[0] * v[0] + u[1] * v[1] + u[2] * v[2];
  return {
    unproject: [1 / p[0][0], 1 / p[1][1], p[0][2], p[1][2]],
    depth: [b, a, depth === "reversed" ? 0 : 1, STEP[depth] / Math.abs(b)],
    gravity_from_world: columns(gravity),
    gravity_from_view: columns(gravity.map((g) => rotation.map((r) => dot(g, r)))),
    world_from_view: rotation.flat(),
    eye: [...eye, 0],
  };
}

export class Pass {
  // Everything in the folder at `url`. `inputs`: views of the host's textures by the manifest's names.
  static async load(device, url, inputs) {
    const read = async (file) => {
      const answer = await fetch(`${url}/${file}`);
      if (!answer.ok) throw new Error(`${url}/${file}: ${answer.status}`);
      return answer;
    };
    const manifest = await (await read("bouncelight.json")).json();
    if (![1, 2].includes(manifest.schema) || manifest.target !== "wgsl") {
      throw new Error(`${url}: schema ${manifest.schema}, target ${manifest.target}; this page reads 1 and 2, wgsl`);
    }
    const content = async (row, bytes) =>
      row.file ? new Uint8Array(await (await read(row.file)).arrayBuffer()) : new Uint8Array(bytes).fill(row.fill);
    const pass = new Pass();
    Object.assign(pass, { device, manifest, buffers: {}, textures: {}, views: {}, k: 0, cacheIteration: 0 });
    for (const row of manifest.buffers) {
      const usage = GPUBufferUsage.COPY_DST
        | (row.usage.includes("uniform") ? GPUBufferUsage.UNIFORM : 0)
        | (row.usage.includes("storage") ? GPUBufferUsage.STORAGE : 0);
      const buffer = device.createBuffer({ size: row.bytes, usage });
      if (row.file || row.fill) device.queue.writeBuffer(buffer, 0, await content(row, row.bytes));
      pass.buffers[row.name] = buffer;
    }
    const stored = new Set();
    for (const { shader, resources } of manifest.dispatches) {
      const written = resources.filter((_, i) => manifest.shaders[shader].bindings[i].kind === "storage-texture");
      written.forEach(({ resource }) => stored.add(resource));
    }
    for (const row of manifest.textures) {
      if (inputs[row.name]) {
        pass.views[row.name] = inputs[row.name];
        continue;
      }
      const written = stored.has(row.name) ? GPUTextureUsage.STORAGE_BINDING : 0;
      const usage = GPUTextureUsage.TEXTURE_BINDING | GPUTextureUsage.COPY_DST | written;
      const texture = device.createTexture({ size: row.size, format: row.format, usage });
      if (row.file) {
        const bytes = await content(row, 0);
        const layout = { bytesPerRow: bytes.length / row.size[1] };
        device.queue.writeTexture({ texture }, bytes, layout, row.size);
      }
      pass.views[row.name] = texture.createView();
    }
    const modules = {};
    pass.pipelines = await Promise.all(manifest.shaders.map(async (shader) => {
      modules[shader.file] ??= read(shader.file).then((r) => r.text()).then((code) => device.createShaderModule({ code }));
      const compute = { module: await modules[shader.file], entryPoint: shader.entry };
      return device.createComputePipelineAsync({ layout: "auto", compute });
    }));
    pass.groups = manifest.dispatches.map((dispatch) => pass.#groups(dispatch));
    return pass;
  }

  #groups(dispatch) {
    const { bindings } = this.manifest.shaders[dispatch.shader];
    const groups = new Map();
    bindings.forEach((binding, i) => {
      const { resource, offset, bytes } = dispatch.resources[i];
      const buffer = this.buffers[resource];
      const bound = binding.kind.endsWith("texture") ? this.views[resource] : { buffer, offset, size: bytes };
      if (!groups.has(binding.group)) groups.set(binding.group, []);
      groups.get(binding.group).push({ binding: binding.binding, resource: bound });
    });
    const pipeline = this.pipelines[dispatch.shader];
    return [...groups].map(([group, entries]) => {
      return [group, this.device.createBindGroup({ layout: pipeline.getBindGroupLayout(group), entries })];
    });
  }

  // Light that direct lighting misses, E/π, and radiance that lobes reflect.
  get output() { return this.views.output; }
  get specular() { return this.views.specular_output; }
  // Radiance of the surroundings.
  get sky() { return this.manifest.frames[0].writes.find((w) => w.type === "Params").values.environment.slice(0, 3); }

  // Records a frame. `reset`: the picture has nothing to do with the one before.
  record(encoder, camera, reset = false) {
    const { frames, steady, dispatches } = this.manifest;
    if (reset) this.k = 0;
    const beyond = this.k - steady.from;
    const frame = frames[beyond < 0 ? this.k : steady.from + (beyond % steady.period)];
    for (const write of frame.writes) this.#write(write, camera);
    const pass = encoder.beginComputePass();
    for (const number of frame.dispatches) {
      pass.setPipeline(this.pipelines[dispatches[number].shader]);
      for (const [group, bound] of this.groups[number]) pass.setBindGroup(group, bound);
      pass.dispatchWorkgroups(...dispatches[number].workgroups);
    }
    pass.end();
    this.k += 1;
    this.cacheIteration += frame.cache_updates;
  }

  #value(value, camera) {
    if (typeof value !== "string") return value;
    const [name, more] = value.split(" + ");
    if (name.startsWith("camera.")) return camera[name.slice(7)];
    const counters = { frame: this.k, cache_iteration: this.cacheIteration };
    return counters[name] + Number(more ?? 0);
  }

  #write(write, camera) {
    const { bytes, members } = this.manifest.uniforms[write.type];
    const data = new DataView(new ArrayBuffer(bytes));
    for (const { name, type, offset } of members) {
      let numbers = [this.#value(write.values[name], camera)].flat();
      if (type.startsWith("mat3x3")) numbers = [0, 1, 2].flatMap((c) => [...numbers.slice(3 * c, 3 * c + 3), 0]);
      else if (type.startsWith("vec")) numbers = numbers.slice(0, Number(type[3]));
      const set = type.includes("u32") ? "setUint32" : "setFloat32";
      numbers.forEach((n, i) => data[set](offset + 4 * i, n, true));
    }
    this.device.queue.writeBuffer(this.buffers[write.buffer], write.offset, data.buffer);
  }
}
