"""Reflections by roughness against the path tracer: the roughness table of docs/results/accuracy.md.

    python training/roughness.py out/roughness ../shared/reference/cycles/metal_301/scene.glb --environment 0.0508761
                                 [--methods direct,gather] [--roughness 0.05,0.15,0.3,0.5,0.7,1] [--spp 256] [--size 256x128]

Every metal of the scene, then every dielectric, is given each roughness in turn, the rest stays as it is. Judged are only the pixels of the materials that
were changed, after 2x2 pooling: `error` is the mean |difference| / mean of the radiance they reflect from sky and bounces (GlossInd x GlossCol, for the
reference with the sky's share of GlossDir); `bias` the same without the bars; `HDR-FLIP` is of the whole picture with all other pixels true. `noise` is the
path tracer's own part of `error`, from a second rendering with another seed. Pictures that exist are kept.
"""
import argparse
import copy
import json
import os
import struct
import subprocess

import numpy as np

from judge import layers, rgb, write

METAL = 0.5  # metallic above this


def read_glb(path):
    """(description, binary chunk) of a binary glTF file."""
    with open(path, "rb") as f:
        data = f.read()
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20 : 20 + length]), data[20 + length :]


def write_glb(path, description, rest):
    text = json.dumps(description).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as f:
        f.write(struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest)


def with_roughness(description, metals, roughness):
    """The scene with that roughness on all metals or on all that are none."""
    changed = copy.deepcopy(description)
    for material in changed["materials"]:
        surface = material.setdefault("pbrMetallicRoughness", {})
        if (surface.get("metallicFactor", 1.0) > METAL) == metals:
            surface["roughnessFactor"] = roughness
    return changed


def pooled(light, mask):
    """2x2 means of the pixels in the mask, of blocks that lie in it whole."""
    h, w = (n // 2 * 2 for n in mask.shape)
    block = lambda a: a[:h, :w].reshape(h // 2, 2, w // 2, 2, -1).mean((1, 3))
    return block(light)[block(mask[..., None].astype(np.float32))[..., 0] == 1]


def reflected(all_layers, direct):
    """Radiance that surfaces reflect specularly, without that of the analytic lights, which `direct` holds."""
    return rgb(all_layers, "GlossCol") * (rgb(all_layers, "GlossInd") + rgb(all_layers, "GlossDir") - rgb(direct, "GlossDir"))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", help="folder for pictures")
    parser.add_argument("scene", help="a .glb with metals")
    parser.add_argument("--environment", default="0.0508761")
    parser.add_argument("--methods", default="gather", type=lambda t: t.split(","))
    parser.add_argument("--roughness", default="0.05,0.15,0.3,0.5,0.7,1", type=lambda t: [float(v) for v in t.split(",")])
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--size", default="256x128")
    parser.add_argument("--bouncelight", default="target/release/bouncelight")
    a = parser.parse_args()
    os.makedirs(a.out, exist_ok=True)
    description, rest = read_glb(a.scene)

    def draw(scene, path, command, *more):
        if not os.path.exists(path):
            command = [a.bouncelight, command, scene, "-o", path, "--size", a.size, "--aov", "all"]
            subprocess.run([*command, "--environment", a.environment, "-q", *more], check=True)
        return layers(path)

    print("| material | roughness | noise | method | error | bias | HDR-FLIP |\n|---|---|---|---|---|---|---|")
    for metals in [True, False]:
        for roughness in a.roughness:
            base = os.path.join(a.out, f"{'metal' if metals else 'dielectric'}_{roughness:g}")
            scene = base + ".glb"
            write_glb(scene, with_roughness(description, metals, roughness), rest)
            direct = draw(scene, base + "_direct.exr", "render", "--method", "direct", "--samples", "4")
            reference, second = (
                draw(scene, f"{base}_reference{seed}.exr", "trace", "--spp", str(a.spp), "--seed", str(seed)) for seed in (1, 2)
            )
            surface = direct["Depth.Z"] < 1e9
            mask = surface & ((rgb(direct, "DiffCol").max(-1) < 0.01) == metals)
            one, two = (pooled(reflected(r, direct), mask) for r in (reference, second))
            truth = (one + two) / 2
            # The mean of two renderings has half of the difference between them.
            noise = np.abs(one - two).mean() / 2 / truth.mean()
            whole = (rgb(reference, "") + rgb(second, "")) / 2
            write(base + "_truth.exr", whole)
            for method in a.methods:
                ours = direct if method == "direct" else draw(scene, f"{base}_{method}.exr", "render", "--method", method, "--samples", "4")
                guess = pooled(reflected(ours, direct), mask)
                patched = base + f"_{method}_patched.exr"
                write(patched, np.where(mask[..., None], rgb(ours, ""), whole))
                record = patched + ".json"
                command = [a.bouncelight, "compare", patched, base + "_truth.exr", "--metric", "hdrflip", "--json", record, "-q"]
                subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
                with open(record) as f:
                    flip = json.load(f)["hdr_flip"]["mean"]
                error, bias = np.abs(guess - truth).mean() / truth.mean(), (guess - truth).mean() / truth.mean()
                kind = "metal" if metals else "dielectric"
                print(f"| {kind} | {roughness:g} | {noise:.1%} | {method} | {error:.1%} | {bias:+.1%} | {flip:.4f} |", flush=True)


if __name__ == "__main__":
    main()
