"""A scene folder (scene.glb, meta.json) rendered with Cycles until little noise is left: references for judge.py.

    pip install bpy==4.5.15                                   # Python 3.11
    python training/cycles/real_scene.py ../shared/reference/real/hotel OUT/hotel [--spp 1024] [--chunk 256] [--threads 2]

One scene a run. 64 bounces of every kind, no clamp; neither kind of caustics, Filter Glossy 1 (Blender's default). Only Combined is denoised.
The samples come in chunks, each with its own seed and file, so a killed run goes on where it stopped; frame0000.exr is their mean, as half floats
without loss. meta.json beside it says what was done, and its `sha256` is that of frame0000.exr.
"""
import argparse
import hashlib
import json
import math
import os
import sys
import time

import bpy
import numpy as np
from mathutils import Vector

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import paper_rooms  # noqa: E402


def z_up(v):
    """glTF's axes to Blender's."""
    return Vector((v[0], -v[2], v[1]))


def add(scene, name, data, at=(0, 0, 0), along=None):
    thing = bpy.data.objects.new(name, data)
    scene.collection.objects.link(thing)
    thing.location = z_up(at)
    if along is not None:
        thing.rotation_euler = z_up(along).to_track_quat("-Z", "Y").to_euler()
    return thing


def load(folder):
    """The scene of a folder with the camera, lights and sky that meta.json says, and what that holds."""
    with open(os.path.join(folder, "meta.json")) as file:
        meta = json.load(file)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=os.path.join(folder, "scene.glb"))
    scene = bpy.context.scene
    for thing in [o for o in scene.objects if o.type in ("LIGHT", "CAMERA")]:
        bpy.data.objects.remove(thing)
    if meta.get("sun"):
        sun = bpy.data.lights.new("sun", "SUN")
        sun.energy, sun.angle = meta["sun"][3], 0.00918
        add(scene, "sun", sun, along=[-n for n in meta["sun"][:3]])
    for x, y, z, watts, radius in meta.get("point", []):
        lamp = bpy.data.lights.new("lamp", "POINT")
        lamp.energy, lamp.shadow_soft_size = watts, radius
        add(scene, "lamp", lamp, (x, y, z))
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (*[meta["world"]] * 3, 1)
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.angle = "VERTICAL", math.radians(meta["fov"])
    camera.clip_start, camera.clip_end = meta["near"], meta["near"] * 1e6
    scene.camera = add(scene, "camera", camera, meta["eye"], [t - e for e, t in zip(meta["eye"], meta["target"])])
    return scene, meta


def mean_of(paths, out):
    """The mean of some pictures, layer by layer, as half floats."""
    import OpenEXR
    total = {}
    for path in paths:
        with OpenEXR.File(path, separate_channels=True) as file:
            for name, channel in file.channels().items():
                total[name] = total.get(name, 0) + channel.pixels.astype(np.float64) / len(paths)
    # What no surface is has a depth that halves cannot hold.
    channels = {name: np.minimum(a, 65504).astype(np.float16) if not name.endswith("Depth.Z") else a.astype(np.float32) for name, a in total.items()}
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, channels).write(out + ".part.exr")
    os.replace(out + ".part.exr", out)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", help="folder with scene.glb and meta.json")
    parser.add_argument("out")
    parser.add_argument("--spp", type=int, default=1024)
    parser.add_argument("--chunk", type=int, default=256, help="samples of one render")
    parser.add_argument("--threads", type=int, default=0, help="0: all")
    a = parser.parse_args()
    os.makedirs(a.out, exist_ok=True)
    final, start = os.path.join(a.out, "frame0000.exr"), time.time()
    if os.path.exists(final):
        return
    paths = [os.path.join(a.out, f"chunk{i:02}.exr") for i in range(math.ceil(a.spp / a.chunk))]
    scene = None
    for seed, path in enumerate(paths):
        if os.path.exists(path):
            continue
        if not scene:
            scene, meta = load(a.scene)
            paper_rooms.configure(scene, meta["res"], a.chunk, 64, True)
            scene.render.threads_mode, scene.render.threads = ("FIXED", a.threads) if a.threads else ("AUTO", 0)
            cycles = scene.cycles
            cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = 64
            cycles.sample_clamp_indirect, cycles.caustics_reflective, cycles.caustics_refractive = 0, False, False
        scene.cycles.seed = seed
        scene.render.filepath = os.path.abspath(path) + ".part.exr"
        bpy.ops.render.render(write_still=True)
        os.replace(scene.render.filepath, path)
        print(f"{path}: {time.time() - start:.0f} s", file=sys.stderr, flush=True)
    mean_of(paths, final)
    with open(os.path.join(a.scene, "meta.json")) as file:
        meta = json.load(file)
    with open(final, "rb") as file:
        meta |= {"spp": len(paths) * a.chunk, "bounces": 64, "clamp": 0, "blender": bpy.app.version_string, "sha256": hashlib.sha256(file.read()).hexdigest()}
    with open(os.path.join(a.out, "meta.json"), "w") as file:
        json.dump(meta, file, indent=1)


if __name__ == "__main__":
    main()
