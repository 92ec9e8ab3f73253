"""Samples per second of Cycles and of bouncelight's path tracer, in one run on the same cores.

    pip install bpy==4.5.15                                   # Python 3.11
    cargo build --release
    python training/cycles/speed.py SCENE.glb [--size 512x256] [--spp 16,64] [--rounds 3] [--threads 2]
                                    [--world 0.0508761] [--light-radius 0.5] [--program target/release/bouncelight]

Both draw the same file with the same camera, 12 bounces (4 diffuse, 4 glossy), clamp 10, the same layers, no denoiser.
A sample's cost is the slope between the two sample counts, so building the scene, starting up and writing the file fall
out; what they took is printed beside it ("rest"). The programs take turns, and medians over the rounds are printed, so
that other work on the machine hits both alike; for numbers to quote, let nothing else run.
"""
import argparse
import contextlib
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import paper_rooms  # noqa: E402


@contextlib.contextmanager
def quiet():
    """Blender writes its progress to the process's own standard output."""
    sys.stdout.flush()
    kept, null = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    try:
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)
        os.close(null)


def load(a):
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=a.scene)
    scene = bpy.context.scene
    scene.camera = next(o for o in scene.objects if o.type == "CAMERA")
    for light in (o.data for o in scene.objects if o.type == "LIGHT"):
        if light.type == "SUN":
            light.angle = 0.00918
        else:
            light.shadow_soft_size = a.light_radius
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (a.world,) * 3 + (1,)
    paper_rooms.configure(scene, a.size, a.spp[0], 12)
    scene.render.threads_mode, scene.render.threads = "FIXED", a.threads
    return scene


def cycles(scene, spp, folder):
    scene.cycles.samples = spp
    scene.render.filepath = os.path.join(folder, "cycles.exr")
    start = time.perf_counter()
    with quiet():
        bpy.ops.render.render(write_still=True)
    return time.perf_counter() - start


def ours(a, spp, folder):
    command = [a.program, "-q", "trace", a.scene, "-o", os.path.join(folder, "ours.exr"),
               "--spp", str(spp), "--size", f"{a.size[0]}x{a.size[1]}", "--environment", ",".join([str(a.world)] * 3),
               "--light-radius", str(a.light_radius), *a.limits.split(), *(["--aov", a.aov] if a.aov else [])]
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env={**os.environ, "LP_NUM_THREADS": str(a.threads)})
    return time.perf_counter() - start


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("--size", default="512x256", type=lambda t: tuple(map(int, t.split("x"))))
    parser.add_argument("--spp", default="16,64", type=lambda t: sorted(map(int, t.split(","))))
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--threads", type=int, default=2, help="for Cycles and for Mesa's CPU driver")
    parser.add_argument("--world", type=float, default=0.0508761, help="radiance of the surroundings")
    parser.add_argument("--light-radius", type=float, default=0.5)
    parser.add_argument("--program", default="target/release/bouncelight")
    parser.add_argument("--limits", default="--bounces 12 --diffuse-bounces 4 --glossy-bounces 4 --clamp 10")
    parser.add_argument("--aov", default="DiffDir,DiffInd,DiffCol,GlossDir,GlossInd,GlossCol,Normal,Depth")
    parser.add_argument("--json", help="where to write the numbers")
    a = parser.parse_args()
    scene = load(a)
    low, high = a.spp[0], a.spp[-1]
    pixels = a.size[0] * a.size[1]
    rows = {"cycles": [], "ours": []}
    with tempfile.TemporaryDirectory() as folder:
        # Warm up: Blender keeps the scene's data between renders, the driver caches its compiled shaders.
        cycles(scene, 1, folder), ours(a, 1, folder)
        for i in range(a.rounds):
            for name, draw in (("cycles", lambda n: cycles(scene, n, folder)), ("ours", lambda n: ours(a, n, folder))):
                few, many = draw(low), draw(high)
                rate = pixels * (high - low) / (many - few)
                rest = few - low * pixels / rate
                rows[name].append({"rate": rate, "rest": rest, "seconds": [few, many]})
                print(f"round {i} {name:6}: {rate:12,.0f} samples/s, rest {rest:6.2f} s ({low} spp {few:.2f} s, {high} spp {many:.2f} s)", flush=True)
    medians = {name: statistics.median(r["rate"] for r in row) for name, row in rows.items()}
    ratios = [o["rate"] / c["rate"] for o, c in zip(rows["ours"], rows["cycles"])]
    print(f"{os.path.basename(os.path.dirname(os.path.abspath(a.scene)))}, {a.size[0]}x{a.size[1]}: Cycles {medians['cycles']:,.0f}, "
          f"ours {medians['ours']:,.0f} samples/s (medians); ratio {statistics.median(ratios):.2f} (rounds {', '.join(f'{r:.2f}' for r in ratios)})")
    if a.json:
        with open(a.json, "w") as f:
            json.dump({"schema": 1, "scene": a.scene, "size": a.size, "spp": a.spp, "threads": a.threads,
                       "blender": bpy.app.version_string, "rounds": rows, "medians": medians, "ratio": statistics.median(ratios)}, f, indent=1)


main()
