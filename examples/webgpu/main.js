// Draws the scene and the light that the exported pass finds: `?data=FOLDER` holds `scene.glb`, `gather`, `neural`.
// With `?test=METHOD` it draws `frames` frames and posts the picture's bytes to the server instead.

import { Pass, cameraValues } from "./pass.js";
import { Renderer } from "./renderer.js";
import { loadScene } from "./scene.js";

const query = new URLSearchParams(location.search);
const data = query.get("data") ?? "data";
const say = (text) => { document.querySelector("#words").textContent = text; };

async function start() {
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter) throw new Error("this browser has no WebGPU adapter");
  const device = await adapter.requestDevice();
  const errors = [];
  device.onuncapturederror = (e) => { errors.push(e.error.message); say(e.error.message); };
  const method = query.get("test");
  const scene = await loadScene(`${data}/scene.glb`);
  const { size } = await (await fetch(`${data}/${method ?? "gather"}/bouncelight.json`)).json();
  const renderer = new Renderer(device, scene, size, "rgba8unorm");
  const passes = {};
  // A network's shaders take long to compile, so a pass is loaded when it is asked for.
  const loaded = (name) => passes[name] ??= Pass.load(device, `${data}/${name}`, renderer.inputs).catch((error) => {
    delete passes[name];
    throw error;
  });
  const frame = (encoder, pass, shift) => {
    const view = renderer.view(shift);
    renderer.draw(encoder, view);
    pass.record(encoder, cameraValues(view, renderer.projection()));
  };
  if (method) return await test(device, renderer, await loaded(method), frame, errors);

  const canvas = document.querySelector("canvas");
  [canvas.width, canvas.height] = size;
  const context = canvas.getContext("webgpu");
  context.configure({ device, format: "rgba8unorm" });
  const [select, split] = ["select", "input"].map((tag) => document.querySelector(tag));
  const times = {};
  let [shown, waiting] = [null, ""];
  // The pass before is shown while the one that was chosen is compiled, which may take minutes without a GPU.
  const choose = async () => {
    const name = select.value;
    waiting = `${name} is being loaded and compiled`;
    say(waiting);
    try {
      const pass = await loaded(name);
      if (select.value !== name) return;
      [shown, waiting] = [{ name, pass }, ""];
    } catch (error) {
      if (select.value === name) say(waiting = String(error));
    }
  };
  select.onchange = choose;
  const loop = async () => {
    const { name, pass } = shown ?? {};
    if (pass) {
      const began = performance.now();
      const encoder = device.createCommandEncoder();
      frame(encoder, pass);
      renderer.show(encoder, context.getCurrentTexture().createView(), pass, split.value * size[0]);
      device.queue.submit([encoder.finish()]);
      await device.queue.onSubmittedWorkDone();
      const took = performance.now() - began;
      times[name] = 0.9 * (times[name] ?? took) + 0.1 * took;
      const measured = Object.entries(times).map(([name, ms]) => `${name} ${ms.toFixed(1)} ms a frame`);
      if (!errors.length) say([...measured, waiting].filter(Boolean).join(", "));
    }
    requestAnimationFrame(guarded);
  };
  const guarded = () => loop().catch((error) => say(String(error)));
  choose();
  guarded();
}

async function test(device, renderer, pass, frame, errors) {
  const [width, height] = renderer.size;
  for (let k = 0; k < Number(query.get("frames")); k += 1) {
    const encoder = device.createCommandEncoder();
    frame(encoder, pass);
    device.queue.submit([encoder.finish()]);
    await device.queue.onSubmittedWorkDone();
    if (errors.length) throw new Error(errors[0]);
  }
  const usage = GPUTextureUsage.RENDER_ATTACHMENT | GPUTextureUsage.COPY_SRC;
  const texture = device.createTexture({ size: [width, height], format: "rgba8unorm", usage });
  const bytesPerRow = 256 * Math.ceil(width / 64);
  const buffer = device.createBuffer({ size: bytesPerRow * height, usage: GPUBufferUsage.COPY_DST | GPUBufferUsage.MAP_READ });
  const encoder = device.createCommandEncoder();
  renderer.show(encoder, texture.createView(), pass, 0);
  encoder.copyTextureToBuffer({ texture }, { buffer, bytesPerRow }, [width, height]);
  device.queue.submit([encoder.finish()]);
  await buffer.mapAsync(GPUMapMode.READ);
  if (errors.length) throw new Error(errors.join("\n"));
  await fetch(`/picture?row=${bytesPerRow}&size=${width}x${height}`, { method: "POST", body: buffer.getMappedRange() });
}

start().catch(async (error) => {
  say(String(error));
  if (query.has("test")) await fetch("/error", { method: "POST", body: String(error.stack ?? error) });
});
