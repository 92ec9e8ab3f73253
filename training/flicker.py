"""How much full pictures flicker along motion, beside what the path tracer's own do: the last two frames of the pan of judge.py (1 degree a
frame), compared at the world points that both show.

    python training/flicker.py out/flicker ../shared/reference/real [--methods gather,neural] [--samples 16] [--spp 32] [--scenes hotel,study]

The number is the root mean square of the change, over means of 4x4 pixels, over the mean of the picture. Everything counts: shadows, textures, light and
what mirrors show, so that a picture without a fault has some. Frames are drawn with --samples a pixel and the pixel filter that the path tracer has, or
with temporal anti-aliasing, `METHOD+taa`. The path tracer's noise is no change: each frame is traced twice, with --spp paths a pixel and other seeds,
and the changes of the one are multiplied with those of the other. `control`: each frame as the first after a cut, without any history.
"""
import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from judge import PAN_FRAMES, layers, pan_to, references  # noqa: E402
from turned import at_both, camera_of  # noqa: E402


def picture(layers_of):
    """The finished picture, linear: [h,w,3]."""
    return np.stack([layers_of[c] for c in "RGB"], -1)


def change(first, second, camera):
    """[h/4,w/4,3]: change of means over those of 4x4 pixels that both pictures show; NaN where they are less than half."""
    a, b, same = at_both(first, second, camera, picture)
    h, w = (n // 4 for n in same.shape)
    pooled = lambda x: x[:4 * h, :4 * w].reshape(h, 4, w, 4, -1).sum((1, 3))
    count = pooled(same.astype(np.float32))
    return np.where(count >= 8, pooled((b - a) * same[..., None]) / np.maximum(count, 1), np.nan)


def size(change, other=None):
    """Root of the mean square; of two measurements of one change, whose noise has nothing in common, of what they have."""
    return np.sqrt(max(np.nanmean(change * (change if other is None else other)), 0))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", help="folder for our pictures")
    parser.add_argument("references", help="folder of references, one folder a scene with scene.glb and meta.json")
    parser.add_argument("--methods", default="gather,neural,neural+taa", type=lambda t: t.split(","))
    parser.add_argument("--scenes", type=lambda t: t.split(","))
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--size", default="256x128")
    parser.add_argument("--bouncelight", default="target/release/bouncelight")
    a = parser.parse_args()
    os.makedirs(a.out, exist_ok=True)
    for _, name, scene, _ in references(a.references):
        if a.scenes and name not in a.scenes:
            continue
        path_of_meta = os.path.join(os.path.dirname(scene[0]), "meta.json")
        with open(path_of_meta) as file:
            meta = json.load(file)
        cameras = [camera_of(meta, degrees) for degrees in (1, 0)]

        def render(path, *more):
            subprocess.run([a.bouncelight, "render", *scene, "--size", a.size, "--aov", "all", "-q", "-o", path, *more], check=True)

        def alone(what, number, *more):
            """A frame by itself."""
            path = os.path.join(a.out, f"{name}_{what}_{number}.exr")
            if not os.path.exists(path):
                render(path, *cameras[number][0], *more)
            return layers(path)

        traced, means = [], []
        for seed in (1, 2):
            frames = [alone(f"paths{seed}", i, "--method", "reference", "--spp", str(a.spp), "--seed", str(2 * seed + i)) for i in (0, 1)]
            traced.append(change(*frames, cameras[1][1]))
            means.append(picture(frames[0]).mean())
        mean = np.mean(means)
        own = size(*traced) / mean
        print(f"{name} path tracer: {100 * own:.2f} % ({100 * size(traced[0]) / mean:.1f} with its noise), {100 * np.isfinite(traced[0]).mean():.0f} % of the picture", flush=True)
        for row in a.methods:
            method, _, taa = row.partition("+")
            frames = [os.path.join(a.out, f"{name}_{row}_pan{number}.exr") for number in (PAN_FRAMES - 1, PAN_FRAMES)]
            if not all(os.path.exists(path) for path in frames):
                with tempfile.TemporaryDirectory() as folder:
                    with open(os.path.join(folder, "pan.json"), "w") as file:
                        json.dump(pan_to(path_of_meta), file)
                    fine = ["--taa", str(PAN_FRAMES)] if taa else ["--samples", str(a.samples)]
                    render(os.path.join(folder, "{frame}.exr"), "--method", method, *fine, "--path", os.path.join(folder, "pan.json"))
                    for number, path in zip((PAN_FRAMES - 1, PAN_FRAMES), frames):
                        shutil.move(os.path.join(folder, f"{number}.exr"), path)
            ours = size(change(*map(layers, frames), cameras[1][1])) / mean
            print(f"{name} {row}: {100 * ours:.2f} %, {ours / own:.2f} of the path tracer's", flush=True)
        cut = [alone("cut", i, "--method", "gather", "--gi-frames", "1", "--samples", str(a.samples), "--gather", f"seed={i}") for i in (0, 1)]
        ours = size(change(*cut, cameras[1][1])) / mean
        print(f"{name} control: {100 * ours:.2f} %, {ours / own:.2f}", flush=True)


if __name__ == "__main__":
    main()
