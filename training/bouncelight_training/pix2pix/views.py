"""Views for the paper's recipe, a file each: what the rasteriser knows, what `gather` makes of it, and what a path tracer shows.

    python -m bouncelight_training.pix2pix.views data/rooms --rooms 2-5,48-347 --bouncelight ../target/release/bouncelight
    python -m bouncelight_training.pix2pix.views data/interior --scene interior --sky 0.55,0.72,1 --views 48 --size 512x256 --spp 32 --bouncelight …

Rooms are seen as the authors saw them, their targets are Cycles' (bpy); a scene is seen from places around its camera (as
`bouncelight dataset --recipe scene` finds them), its targets are `bouncelight trace`'s. Both are denoised by Open Image Denoise, so
few paths do: 4 a pixel are 47 dB from 96. `--samples 4,1` draws every second view with one sample a pixel, as in real time.

OUT/roomIIII.npz or OUT/NAMEIII.npz holds bytes [h,w,3] that went through Blender's Filmic view, as the authors' did (their published sets
0002 to 0005 were compared with ours):

    depth     (z - min)/(max - min) over the picture's surfaces, background 1
    direct    direct light, and the sky's without occlusion (radiance times diffuse and glossy colour): what Eevee calls direct
    diffuse   albedo
    normal    world normal, Z up, clamped at zero, so walls that face -X or -Y lose theirs
    gathered  direct light and that of method `gather`, after a few frames
    target    the path-traced picture

A file is written whole or not at all and one that exists is kept, so a killed run goes on where it stopped; `--shard 0/2` and `1/2` share
the work. Rooms kept for judging are refused.
"""
import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
import zipfile

import numpy as np
import OpenEXR

from ..errors import TrainingError, reported
from ..filmic import shown
from ..stream import SKY_RADIANCE, camera, indices, is_judged, rooms_of_stream

# In the order in which the published network takes them; `gathered` is ours.
PICTURES = ("depth", "direct", "diffuse", "normal")
GATHERED, TARGET = "gathered", "target"
ALL = (*PICTURES, GATHERED, TARGET)
# Blender's Normalize node takes what is farther for background.
FARTHEST = 1e4
# Of the small pictures that places in a scene are looked for with.
HEIGHT = 32
LAYERS = "DiffDir,DiffCol,GlossDir,GlossCol,Emit,Normal,Depth"
CYCLES = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "cycles")


def layers(path, prefix=""):
    """Channels of an EXR by name, without `prefix`; float32 [h,w]."""
    try:
        with OpenEXR.File(path, separate_channels=True) as file:
            return {name.removeprefix(prefix): channel.pixels.astype(np.float32) for name, channel in file.channels().items()}
    except (OSError, RuntimeError, ValueError) as error:
        raise TrainingError(f"{path}: not a readable EXR: {error}") from error


def stacked(channels, names, path):
    """Some channels as [h,w,n]; missing or not finite ones are errors."""
    missing = [n for n in names if n not in channels]
    if missing:
        raise TrainingError(f"{path}: no channel {missing[0]}; draw it again")
    out = np.stack([channels[n] for n in names], -1)
    if not np.isfinite(out).all():
        raise TrainingError(f"{path}: {names[0]} holds {np.count_nonzero(~np.isfinite(out))} values that are not finite; draw it again")
    return out


def of(layer):
    return [f"{layer}.{c}" for c in "RGB"]


def inputs_of(path, sky=SKY_RADIANCE):
    """The network's pictures of a raster EXR by name, bytes [h,w,3]: PICTURES, and `gathered`, which is the file's own picture.
    Direct light is made of the file's layers; without them the file's picture is taken for it. `sky`: radiance from everywhere, L or (R, G, B)."""
    channels = layers(path)
    get = lambda names: stacked(channels, names, path)
    picture, diffuse, glossy, depth = get("RGB"), get(of("DiffCol")), get(of("GlossCol")), get(["Depth.Z"])
    x, y, z = np.moveaxis(get(["Normal.X", "Normal.Y", "Normal.Z"]), -1, 0)
    surface = depth < FARTHEST
    if not surface.any():
        raise TrainingError(f"{path}: nothing but background; leave it out")
    light = picture
    if "DiffDir.R" in channels:
        light = np.where(surface, get(of("DiffDir")) * diffuse + get(of("GlossDir")) * glossy + get(of("Emit")), picture)
    nearest, farthest = depth[surface].min(), depth[surface].max()
    stretched = np.where(surface, (depth - nearest) / max(farthest - nearest, 1e-6), 1.0)
    return {"depth": shown(np.repeat(stretched, 3, -1)), "direct": shown(light + np.asarray(sky, np.float32) * (diffuse + glossy) * surface), "diffuse": shown(diffuse),
            "normal": shown(np.maximum(np.stack([x, -z, y], -1), 0)), GATHERED: shown(picture)}


def target_of(path, prefix="ViewLayer."):
    """A path-traced picture as it is shown: bytes [h,w,3]."""
    channels = layers(path, prefix)
    return shown(stacked(channels, of("Combined") if "Combined.R" in channels else "RGB", path))


def write(path, pictures, report):
    """Writes a view whole or not at all."""
    with open(path + ".part", "wb") as file:
        np.savez_compressed(file, report=json.dumps(report), **pictures)
    os.replace(path + ".part", path)


def read(path):
    """A view's pictures by name and its report."""
    try:
        with np.load(path) as file:
            arrays = {name: file[name] for name in (*ALL, "report")}
    except (OSError, ValueError, EOFError, KeyError, zipfile.BadZipFile) as error:
        raise TrainingError(f"{path}: not a view: {error}; make it again with python -m bouncelight_training.pix2pix.views") from error
    return arrays, json.loads(str(arrays.pop("report")))


def run(command):
    """Runs a program; returns what it said on standard error."""
    try:
        done = subprocess.run(command, capture_output=True, text=True)
    except OSError as error:
        raise TrainingError(f"{command[0]}: {error}; build it with cargo build --release, or pass --bouncelight") from error
    if done.returncode:
        raise TrainingError(f"{' '.join(command)} ended with code {done.returncode}: {done.stderr.strip()}")
    return done.stderr


def words_of(eye, target, fov):
    return [f"--{name}={','.join(f'{v:.9g}' for v in values)}" for name, values in (("eye", eye), ("look-at", target), ("fov", (fov,)))]


class Rooms:
    """The paper's rooms, with Cycles for targets."""

    def __init__(self, a):
        sys.path.insert(0, CYCLES)
        try:
            import paper_rooms
        except ImportError as error:
            raise TrainingError(f"targets of rooms need bpy, and training/cycles beside this package: {error}") from error
        self.a, self.blender, self.sky, self.targets = a, paper_rooms, SKY_RADIANCE, f"Cycles, {a.spp} samples a pixel, denoised"
        self.rooms = rooms_of_stream(set(a.rooms))

    def views(self):
        return [(f"room{i:04}", i) for i in self.a.rooms]

    def words(self, index):
        return [f"paper-room:{index}", *words_of(*camera(self.rooms[index], 0, self.a.size)), "--environment", str(SKY_RADIANCE)]

    def target(self, index, _raster, path):
        import bpy
        scene = self.blender.build(self.rooms[index], SKY_RADIANCE, 1.0)[0]
        self.blender.configure(scene, self.a.size, self.a.spp, 12, denoise="fast", layers=False)
        if self.a.threads:
            scene.render.threads_mode, scene.render.threads = "FIXED", self.a.threads
        scene.cycles.seed, scene.render.filepath = index, path
        bpy.ops.render.render(write_still=True)
        return target_of(path)


def camera_of(view, height):
    """Eye, target and vertical field of view in degrees of a sample's `view` (README, "The data"): what a cell of 4 pixels covers at distance 1,
    place and direction, of a picture so many pixels high."""
    foot, eye, ahead = view[0], view[1:4], view[4:7]
    return eye, [e + a for e, a in zip(eye, ahead)], math.degrees(2 * math.atan(0.5 * foot * height / 4))


class Scene:
    """Places around one scene's camera, with our path tracer for targets."""

    def __init__(self, a):
        self.a, self.sky, self.targets = a, a.sky, f"bouncelight trace, {a.spp} samples a pixel, denoised"
        with tempfile.TemporaryDirectory() as folder:
            run([a.bouncelight, "dataset", "--recipe", "scene", "--scene", a.scene, "--views", str(a.views), "--seed", str(a.seed), "--spp", "1", "--moments", "1", "--size", f"{2 * HEIGHT}x{HEIGHT}", "--out", folder])
            from safetensors.numpy import load_file
            found = sorted(name for name in os.listdir(folder) if name.endswith(".safetensors"))
            self.cameras = [load_file(os.path.join(folder, name))["view"].tolist() for name in found]

    def views(self):
        name = os.path.splitext(os.path.basename(self.a.scene))[0].replace(":", "_")
        return [(f"{name}{i:03}", i) for i in range(len(self.cameras))]

    def words(self, index):
        return [self.a.scene, *words_of(*camera_of(self.cameras[index], HEIGHT))]

    def target(self, index, raster, path):
        try:
            import pyoidn
        except ImportError as error:
            raise TrainingError(f"targets of a scene need pyoidn: {error}") from error
        run([self.a.bouncelight, "trace", *self.words(index), "--size", "x".join(map(str, self.a.size)), "--spp", str(self.a.spp), "--aov", "DiffCol,GlossCol,Normal", "-o", path, "-q"])
        channels = layers(path)
        plain = lambda names: np.ascontiguousarray(stacked(channels, names, path))
        albedo = np.clip(plain(of("DiffCol")) + plain(of("GlossCol")), 0, 1)
        return shown(pyoidn.denoise(plain("RGB"), albedo=albedo, normal=plain(["Normal.X", "Normal.Y", "Normal.Z"]), hdr=True))


def draw(source, a, path, name, index, samples):
    """Draws one view into `path`."""
    with tempfile.TemporaryDirectory() as folder:
        raster = os.path.join(folder, "raster.exr")
        run([a.bouncelight, "render", *source.words(index), "--size", "x".join(map(str, a.size)), "--method", "gather", "--accumulate", "4", "--samples", str(samples), "--aov", LAYERS, "-o", raster, "-q"])
        pictures = inputs_of(raster, source.sky)
        pictures[TARGET] = source.target(index, raster, os.path.join(folder, "target.exr"))
    write(path, pictures, {"view": name, "room": index if isinstance(source, Rooms) else None, "size": a.size, "samples": samples, "targets": source.targets})


@reported
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--rooms", type=indices, help="stream indices, such as 6-9,13")
    parser.add_argument("--scene", help="a scene instead of rooms: a file or a bundled one")
    parser.add_argument("--views", type=int, default=48, help="places in the scene")
    parser.add_argument("--seed", type=int, default=0, help="of those places")
    parser.add_argument("--sky", default="0", type=lambda t: tuple(map(float, t.split(","))), help="radiance that direct light of the scene gets from everywhere: L or R,G,B")
    parser.add_argument("--size", default="1024x512", type=lambda t: tuple(map(int, t.split("x"))))
    parser.add_argument("--samples", default="4,1", type=lambda t: tuple(map(int, t.split(","))), help="jittered frames of the inputs, view by view in turn")
    parser.add_argument("--spp", type=int, default=4, help="paths a pixel of the target")
    parser.add_argument("--threads", type=int, default=0, help="of Cycles; 0: all cores")
    parser.add_argument("--shard", default="0/1", type=lambda t: tuple(map(int, t.split("/"))))
    parser.add_argument("--bouncelight", default="target/release/bouncelight", help="the program")
    a = parser.parse_args(arguments)
    if (a.rooms is None) == (a.scene is None):
        raise TrainingError("either --rooms or --scene is needed")
    kept = [i for i in a.rooms or () if is_judged(i)]
    if kept:
        raise TrainingError(f"rooms {kept} are kept for judging; leave them out")
    os.makedirs(a.out, exist_ok=True)
    source = Rooms(a) if a.rooms else Scene(a)
    for at, (name, index) in enumerate(source.views()):
        path = os.path.join(a.out, name + ".npz")
        if at % a.shard[1] == a.shard[0] and not os.path.exists(path):
            draw(source, a, path, name, index, a.samples[at // a.shard[1] % len(a.samples)])
            print(name, file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
