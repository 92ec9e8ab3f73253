"""How much full pictures flicker along motion, beside what the path tracer's own do: the last two frames of the pan of judge.py (1 degree a
frame), compared at the world points that both show.

    python training/flicker.py out/flicker ../shared/reference/real [--methods gather,neural] [--samples 16] [--spp 32] [--scenes hotel,study]

The number is the root mean square of the change, over means of 4x4 pixels, over the mean of the picture. Everything counts: shadows, textures, light and
what mirrors show, so that a picture without a fault has some. Frames are drawn with --samples a pixel and the pixel filter that the path tracer has, or
with temporal anti-aliasing, `METHOD+taa`. The path tracer's noise is no change: each frame is traced twice, with --spp paths a pixel and other seeds,
and the changes of the one are multiplied with those of the other. What blends is drawn as it is seen, over the picture (--blending sorted), not by lot as for layers.
`control`: each frame as the first after a cut, without any history.
"""
import json
import os
import shutil
import subprocess
import sys
import tempfile

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from judge import PAN_FRAMES, layers, pan_to  # noqa: E402
from turned import arguments, at_both, camera_of, scenes_of  # noqa: E402

# How a viewer draws what blends.
SEEN = ["--blending", "sorted"]


def picture(layers_of):
    """The finished picture, linear: [h,w,3]."""
    return np.stack([layers_of[c] for c in "RGB"], -1)


def change(first, second, cameras):
    """[h/4,w/4,3]: change of means over those of 4x4 pixels that both pictures show; NaN where they are less than half."""
    a, b, same = at_both(first, second, cameras, picture)
    h, w = (n // 4 for n in same.shape)
    pooled = lambda x: x[:4 * h, :4 * w].reshape(h, 4, w, 4, -1).sum((1, 3))
    count = pooled(same.astype(np.float32))
    return np.where(count >= 8, pooled((b - a) * same[..., None]) / np.maximum(count, 1), np.nan)


def size(change, other=None):
    """Root of the mean square; of two measurements of one change, whose noise has nothing in common, of what they have."""
    return np.sqrt(max(np.nanmean(change * (change if other is None else other)), 0))


def beside(ours, own):
    """What is said of our change beside the path tracer's own."""
    return f"{ours / own:.2f} of the path tracer's" if own > 0 else "the path tracer's own is below what its noise lets be told"


def main():
    parser = arguments(__doc__, "gather,neural,neural+taa", 16, "256x128")
    parser.add_argument("--spp", type=int, default=256)
    a = parser.parse_args()
    os.makedirs(a.out, exist_ok=True)
    for name, scene, path_of_meta, meta in scenes_of(a):
        flags, cameras = zip(*(camera_of(meta, degrees) for degrees in (1, 0)))

        def draw(command, path, *more):
            subprocess.run([a.bouncelight, command, *scene, "--size", a.size, "--aov", "all", "-q", "-o", path, *more], check=True)

        def alone(what, number, command, *more):
            """A frame by itself."""
            path = os.path.join(a.out, f"{name}_{what}_{number}.exr")
            if not os.path.exists(path):
                draw(command, path, *flags[number], *more)
            return layers(path)

        traced, means = [], []
        for seed in (1, 2):
            frames = [alone(f"paths{seed}", i, "trace", "--spp", str(a.spp), "--seed", str(2 * seed + i)) for i in (0, 1)]
            traced.append(change(*frames, cameras))
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
                    draw("render", os.path.join(folder, "{frame}.exr"), "--method", method, *SEEN, *fine, "--path", os.path.join(folder, "pan.json"))
                    for number, path in zip((PAN_FRAMES - 1, PAN_FRAMES), frames):
                        shutil.move(os.path.join(folder, f"{number}.exr"), path)
            ours = size(change(*map(layers, frames), cameras)) / mean
            print(f"{name} {row}: {100 * ours:.2f} %, {beside(ours, own)}", flush=True)
        cut = [alone("cut", i, "render", "--method", "gather", *SEEN, "--accumulate", "1", "--samples", str(a.samples), "--gather", f"seed={i}") for i in (0, 1)]
        ours = size(change(*cut, cameras)) / mean
        print(f"{name} control: {100 * ours:.2f} %, {beside(ours, own)}", flush=True)


if __name__ == "__main__":
    main()
