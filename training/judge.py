"""Pictures of the rooms kept for judging, by every method, against Cycles: the accuracy table of docs/accuracy.md.

    python training/cycles/paper_rooms.py data/judge --rooms 0,27,33,37,47 --views 1 --size 1024x512 --spp 64 --denoise --judge
    python training/judge.py data/judge out/judge --constant 0.0592,0.0631,0.0570 [--samples 4] [--bouncelight target/release/bouncelight]

--constant is the one ambient light (E/pi) that fits the training rooms best (python -m bouncelight_training.baseline); its row is
the floor that a network has to pass. `best constant` is fitted to each picture itself, by least absolute error before the view
transform: nobody can know it, it is there for scale. Prints one Markdown row a method: means over the rooms.
"""
import argparse
import json
import os
import re
import subprocess
import sys

import numpy as np
import OpenEXR

METRICS = ["l1", "l2", "paper-ssim", "fid", "psnr", "ssim", "relmse"]


def layers(path):
    with OpenEXR.File(path, separate_channels=True) as file:
        return {name.removeprefix("ViewLayer."): c.pixels.astype(np.float32) for name, c in file.channels().items()}


def rgb(all_layers, name):
    prefix = f"{name}." if name else ""
    return np.stack([all_layers[f"{prefix}{c}"] for c in "RGB"], -1)


def write(path, image):
    channels = {c: np.ascontiguousarray(image[..., i]).astype(np.float32) for i, c in enumerate("RGB")}
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, channels).write(path)


def with_constant(direct, light):
    """The raster's direct light plus a constant diffuse light everywhere, its glossy share by the split sum as in composite."""
    on_surface = (direct["Depth.Z"] < 1e9)[..., None]
    return rgb(direct, "") + on_surface * (rgb(direct, "DiffCol") + rgb(direct, "GlossCol")) * np.asarray(light, np.float32)


def best_constant(direct, reference):
    """The constant light that fits one picture: weighted median of (reference - direct) / colour, channel by channel."""
    colour = rgb(direct, "DiffCol") + rgb(direct, "GlossCol")
    wanted = rgb(reference, "Combined") - rgb(direct, "")
    light = []
    for c in range(3):
        weight, value = colour[..., c].ravel(), wanted[..., c].ravel()
        use = weight > 0.02
        ratio, weight = value[use] / weight[use], weight[use]
        order = np.argsort(ratio)
        light.append(ratio[order][np.searchsorted(np.cumsum(weight[order]), weight.sum() / 2)])
    return light


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cycles", help="folder of cycles/paper_rooms.py")
    parser.add_argument("out", help="folder for our pictures")
    parser.add_argument("--constant", required=True, type=lambda t: [float(v) for v in t.split(",")])
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--weights")
    parser.add_argument("--bouncelight", default="target/release/bouncelight")
    a = parser.parse_args()
    os.makedirs(a.out, exist_ok=True)
    rows = {}

    def compare(row, ours, reference):
        record = ours + ".json"
        subprocess.run([a.bouncelight, "compare", ours, reference, "--json", record, "--metric", "l1"], check=True, stdout=subprocess.DEVNULL)
        with open(record) as f:
            r = json.load(f)
        values = [r["paper"]["l1"], r["paper"]["l2"], r["paper"]["ssim"], r["paper"]["fid"], r["display"]["psnr"], r["display"]["ssim"], r["linear"]["rel_mse"]]
        rows.setdefault(row, []).append(values)

    for name in sorted(os.listdir(a.cycles)):
        match = re.fullmatch(r"room(\d+)_view0\.exr", name)
        if not match:
            continue
        room, reference = int(match[1]), os.path.join(a.cycles, name)
        pictures = {}
        for method in ("direct", "ambient", "neural"):
            pictures[method] = os.path.join(a.out, f"room{room:04}_{method}.exr")
            command = [a.bouncelight, "render", f"paper-room:{room}", "-o", pictures[method], "--method", method, "--samples", str(a.samples), "--aov", "all", "-q"]
            if method == "neural" and a.weights:
                command += ["--weights", a.weights]
            subprocess.run(command, check=True)
            compare(method, pictures[method], reference)
        direct, truth = layers(pictures["direct"]), layers(reference)
        for row, light in (("constant", a.constant), ("best constant", best_constant(direct, truth))):
            path = os.path.join(a.out, f"room{room:04}_{row.replace(' ', '_')}.exr")
            write(path, with_constant(direct, light))
            compare(row, path, reference)
        print(f"room {room}: " + ", ".join(f"{row} {values[-1][0]:.0f}" for row, values in rows.items()), file=sys.stderr, flush=True)
    print("| method | " + " | ".join(METRICS) + " |\n|" + "---|" * (len(METRICS) + 1))
    for row, values in rows.items():
        m = np.mean(values, 0)
        print(f"| {row} | {m[0]:,.0f} | {m[1]:,.0f} | {m[2]:.4f} | {m[3]:.4f} | {m[4]:.2f} | {m[5]:.4f} | {m[6]:.4f} |")


if __name__ == "__main__":
    main()
