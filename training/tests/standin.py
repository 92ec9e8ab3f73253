"""Features for views that only Cycles has drawn, made from Cycles' own layers: a stand-in to rehearse training with until the
rasteriser writes the real ones. The sun's light is guessed from DiffDir, so numbers reached with it say nothing about bouncelight.

    python tests/standin.py CYCLES_DIR OUT_DIR [--rooms 6-9]
"""
import argparse
import math
import os
import random
import re
import sys

import numpy as np
from safetensors.numpy import save_file

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.dirname(HERE))
from bouncelight_training.data import indices, read_cycles, refuse_judged  # noqa: E402
from bouncelight_training.features import LUMINANCE  # noqa: E402

SKY = 0.05087609
SUN_EULER = (0.2844221, -0.1549496, -4.8111577)


def cameras_of_stream():
    """Camera (pitch, yaw) of every room of the stream, in turn."""
    rng = random.Random(0)
    while True:
        for _ in range(rng.randint(50, 250)):
            for low, high in [(-50, 50), (-50, 50), (2, 15), (0, 360), (0, 360), (0, 360)]:
                rng.randint(low, high)
            for _ in range(3):
                rng.uniform(0, 1)
            rng.randint(0, 5)
        for _ in range(15):
            rng.uniform(0, 1)
        pitch, yaw = math.pi / 2 - math.pi * rng.randint(0, 10) / 180, math.pi * rng.randint(0, 360) / 180
        yield pitch, yaw


def to_sun():
    """Unit vector towards the sun, Y up."""
    x, y, z = SUN_EULER
    cx, sx, cy, sy, cz, sz = math.cos(x), math.sin(x), math.cos(y), math.sin(y), math.cos(z), math.sin(z)
    # Third column of Rz Ry Rx: where the light's local +Z points.
    bx, by, bz = cz * sy * cx + sz * sx, sz * sy * cx - cz * sx, cy * cx
    return np.array([bx, bz, -by], np.float32)


def median3(a):
    """3x3 median of [h,w]."""
    padded = np.pad(a, 1, mode="edge")
    h, w = a.shape
    return np.median([padded[y:y + h, x:x + w] for y in range(3) for x in range(3)], axis=0)


def features_of(cycles, pitch, yaw):
    """The tensors of a feature file."""
    h, w = cycles["depth"].shape
    depth = cycles["depth"]
    hit = (depth < 1e4) & (np.linalg.norm(cycles["normal"], axis=0) > 0.5)
    normal = cycles["normal"] / np.maximum(np.linalg.norm(cycles["normal"], axis=0), 1e-6)
    albedo = np.clip(cycles["diff_col"], 0, 1) * hit
    cosine = np.maximum(np.tensordot(to_sun(), normal, 1), 0) / math.pi
    lit = (median3(np.tensordot(LUMINANCE, cycles["diff_dir"], 1)) > 0.5 * cosine + 0.01) & hit
    direct = np.repeat((cosine * lit)[None], 3, 0)
    s = float(np.tensordot(LUMINANCE, direct, 1).mean() + SKY)
    # Gravity frame: Blender's yaw is a turn about the vertical; at yaw 0 the camera looks along +Y, which is -Z with Y up.
    turn = np.array([[math.cos(yaw), 0, -math.sin(yaw)], [0, 1, 0], [math.sin(yaw), 0, math.cos(yaw)]], np.float32)
    gravity_normal = np.tensordot(turn, normal, 1)
    x = ((np.arange(w) + 0.625) / w * 2 - 1) * 18 / 30
    y = (1 - (np.arange(h) + 0.625) / h * 2) * 18 / 30 * h / w
    view = np.stack([x[None] * depth, y[:, None] * depth, -depth])
    tilt = pitch - math.pi / 2
    gravity = np.stack([view[0], math.cos(tilt) * view[1] - math.sin(tilt) * view[2], math.sin(tilt) * view[1] + math.cos(tilt) * view[2]])
    m = math.exp(np.log(depth[hit]).mean())
    v = gravity / m
    position = v / (1 + np.linalg.norm(v, axis=0))
    logarithm = np.log(np.where(hit, depth, m) / m)
    padded = np.pad(logarithm, 1, mode="edge")
    # Neighbouring cells stand for the 16 pixels of the cell, which Cycles' small picture does not have.
    spread = np.max([np.abs(padded[a:a + h, b:b + w] - logarithm) for a in range(3) for b in range(3)], axis=0)
    # A slope is no edge: what a plane through the neighbours would give is taken off.
    smooth = 0.5 * np.maximum(np.abs(padded[1:-1, 2:] - padded[1:-1, :-2]), np.abs(padded[2:, 1:-1] - padded[:-2, 1:-1]))
    spread = np.clip(spread - smooth, 0, 1)
    tensors = [np.log1p(direct / s), np.log1p(albedo * direct / s), albedo, gravity_normal, position, np.clip(logarithm, -4, 4)[None], spread[None]]
    features = np.concatenate([np.where(hit, t, 0) for t in tensors] + [hit[None], np.full((3, h, w), math.log1p(SKY / s))])
    values = {"features": features, "scale": np.array([s]), "direct": direct, "albedo": albedo, "normal": normal * hit, "depth": depth * hit}
    return {name: np.ascontiguousarray(v, dtype=np.float32) for name, v in values.items()}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cycles")
    parser.add_argument("out")
    parser.add_argument("--rooms", type=indices)
    parser.add_argument("--views", type=int, default=8, help="how many directions the full turn was cut into")
    a = parser.parse_args()
    os.makedirs(a.out, exist_ok=True)
    names = [re.fullmatch(r"room(\d+)_view(\d+)\.exr", n) for n in sorted(os.listdir(a.cycles))]
    wanted = [m for m in names if m and (a.rooms is None or int(m[1]) in a.rooms)]
    refuse_judged(int(m[1]) for m in wanted)
    stream = cameras_of_stream()
    cameras = [next(stream) for _ in range(max(int(m[1]) for m in wanted) + 1)]
    for m in wanted:
        pitch, yaw = cameras[int(m[1])]
        made = features_of(read_cycles(os.path.join(a.cycles, m[0])), pitch, yaw + 2 * math.pi * int(m[2]) / a.views)
        save_file(made, os.path.join(a.out, f"room{m[1]}_view{m[2]}.safetensors"))


if __name__ == "__main__":
    main()
