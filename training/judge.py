"""Pictures by every method against Cycles: the accuracy table of docs/results/accuracy.md.

    python training/cycles/paper_rooms.py data/judge --rooms 0,27,33,37,47 --views 1 --size 1024x512 --spp 64 --denoise --judge
    python training/judge.py out/judge data/judge [../shared/reference/cycles] [--rooms 0,27,2200-2239] [--methods direct,ambient,...]
                             [--samples 4] [--constant 0.0592,0.0631,0.0570] [--csv out/judge.csv] [--bouncelight target/release/bouncelight]

A method `gather@N` is drawn after N frames of a still camera (1: the first after a cut), `gather@pan` after sixteen frames in which the
camera, settled before, turned by 1 degree each; one without says nothing of frames and has the program's own default. `gather+caustics=0`
(or another of its numbers) is drawn with `render --gather caustics=0`, for references made without Cycles' "Reflective Caustics"; `gather+taa@pan` under temporal
anti-aliasing (over the pan, or the frames) in place of --samples. A method `neural:FILE` is the network of that weights file; its row is called `neural NAME` after the file. Generators
(`generator`, `generator-gather`, `generator:FILE`) paint pictures, so they have no light.
`paths@N` is our path tracer with N paths a pixel, `paths+oidn@N` with Open Image Denoise on top; they have no light here.

A folder of references holds either roomIIII_view0.exr, as cycles/paper_rooms.py writes them, or one folder a scene with scene.glb,
frame0000.exr and meta.json. Rooms are averaged into one row a method; other scenes get a row each. With --rooms only these are taken, and
one without a reference is an error that gives the command which renders it. Our pictures have the reference's size. A picture that exists is kept
if the same program drew it with the same weights and samples (stamps.json beside it; --keep: whoever drew it), and its comparison if
neither it nor the reference is newer, so a killed run goes on where it stopped.

Rows that are no methods: with --constant, that one ambient light (E/pi), the floor that everything else has to pass (0.0508761, the sky's radiance, is the raster picture that the paper's network starts from); `best constant` is fitted to each picture itself, by least absolute error
before the view transform: nobody can know it, it is there for scale.

A scene whose reference is black is left out, with a line that says so.

`light` is the error of the diffuse light that direct lighting misses: mean |difference| / mean after 4x4 pooling, on pixels with
a surface, against Cycles' DiffInd + DiffDir - our DiffDir (Cycles counts the sky into DiffDir). With 64 samples a pixel Cycles' own
noise is about 0.02 of it. Pixels where Cycles has less than 2 % of its median light are left out: coincident faces, which it shows black.
"""
import argparse
import csv
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

import numpy as np
import OpenEXR

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from bouncelight_training.stream import indices  # noqa: E402

# Radiance, W/(m² sr), below which nothing of a picture is seen: 8 bits at 16 times the exposure.
BLACK = 1 / 255 / 16
METRICS = ["l1", "l2", "paper-ssim", "fid", "psnr", "ssim", "flip", "relmse", "light"]


def layers(path):
    with OpenEXR.File(path, separate_channels=True) as file:
        return {name.removeprefix("ViewLayer."): c.pixels.astype(np.float32) for name, c in file.channels().items()}


def rgb(all_layers, name):
    prefix = f"{name}." if name else ""
    return np.stack([all_layers[f"{prefix}{c}"] for c in "RGB"], -1)


def write(path, image):
    """An EXR, whole or not at all."""
    channels = {c: np.ascontiguousarray(image[..., i]).astype(np.float32) for i, c in enumerate("RGB")}
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, channels).write(path + ".part.exr")
    os.replace(path + ".part.exr", path)


def digest(path):
    with open(path, "rb") as f:
        return hashlib.sha256(f.read()).hexdigest()[:16]


class Stamps:
    """What drew the pictures of a folder: a line of text for each, in stamps.json."""

    def __init__(self, folder, keep):
        self.path, self.keep, self.known = os.path.join(folder, "stamps.json"), keep, {}
        if os.path.exists(self.path):
            with open(self.path) as f:
                self.known = json.load(f)

    def fresh(self, picture, stamp):
        return os.path.exists(picture) and (self.keep or self.known.get(os.path.basename(picture)) == stamp)

    def put(self, picture, stamp):
        self.known[os.path.basename(picture)] = stamp
        with open(self.path + ".part", "w") as f:
            json.dump(self.known, f, indent=0)
        os.replace(self.path + ".part", self.path)


def compared(program, ours, reference):
    """The record of `bouncelight compare`, kept beside our picture."""
    result = ours + ".json"
    try:
        if os.path.getmtime(result) >= max(os.path.getmtime(ours), os.path.getmtime(reference)):
            with open(result) as f:
                return json.load(f)
    except (OSError, ValueError):
        pass  # None yet, or one that a kill cut off.
    subprocess.run([program, "compare", ours, reference, "--json", result, "-q"], check=True, stdout=subprocess.DEVNULL)
    with open(result) as f:
        return json.load(f)


def with_constant(direct, light):
    """The raster's direct light plus a constant diffuse light everywhere, its glossy share by the split sum."""
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


def pooled(light, weight):
    """4x4 means of light where weight is 1."""
    h, w = (n // 4 * 4 for n in weight.shape)
    block = lambda a: a[:h, :w].reshape(h // 4, 4, w // 4, 4, -1).sum((1, 3))
    total = block(weight[..., None])
    return block(light * weight[..., None]) / np.maximum(total, 1), total[..., 0] > 8


def light_error(ours, direct, reference, taa=False):
    """The error of the light itself, see above."""
    surface = (direct["Depth.Z"] < 1e9) & (rgb(direct, "DiffCol").min(-1) > 0.01)
    all_light = (rgb(reference, "DiffInd") + rgb(reference, "DiffDir")).mean(-1)
    weight = (surface & (all_light >= 0.02 * np.median(all_light[surface]))).astype(np.float32)
    truth, full = pooled(rgb(reference, "DiffInd") + rgb(reference, "DiffDir") - rgb(direct, "DiffDir"), weight)
    # Anti-aliased over frames its direct light is another than that of samples.
    own = rgb(ours, "DiffDir") - rgb(direct, "DiffDir") if taa else 0
    guess, _ = pooled(rgb(ours, "DiffInd") + own, weight)
    return float(np.abs(guess - truth)[full].mean() / truth[full].mean())


def references(folder, rooms=None):
    """(group, name, scene arguments, reference picture) of each scene in a folder of references, or of some rooms."""
    for name in sorted(os.listdir(folder)):
        path = os.path.join(folder, name)
        room = re.fullmatch(r"room(\d+)_view0\.exr", name)
        if rooms is not None and (not room or int(room[1]) not in rooms):
            continue
        if room:
            yield "paper rooms", name.removesuffix(".exr"), [f"paper-room:{int(room[1])}"], path
        elif os.path.exists(os.path.join(path, "scene.glb")):
            with open(os.path.join(path, "meta.json")) as f:
                meta = json.load(f)
            # glTF cannot say a point light's radius; the older files' is 0.5 m.
            points = meta.get("point") or [[0, 0, 0, 0, 0.5]]
            flags = ["--environment", str(meta["world"])]
            flags += ["--light-radius", str(points[0][4])] if meta["light"] == "point" else []
            yield name, name, [os.path.join(path, "scene.glb"), *flags], os.path.join(path, "frame0000.exr")


def all_methods(program):
    """All methods that the program draws frames by."""
    text = subprocess.run([program, "render", "--help"], check=True, capture_output=True, text=True).stdout
    return re.search(r"--method\b.*?possible values: ([^\]]+)", text, re.DOTALL)[1].replace(",", " ").split()


def draw(program, scene, row, path, size, samples):
    """Draws `row` = (kind, weights) of a scene into `path`."""
    kind, weights = row
    kind, _, state = kind.partition("@")
    kind, *options = kind.split("+")
    taa = ["--taa", str(PAN_FRAMES if state == "pan" else max(int(state or 32) - 1, 1))] if "taa" in options else None
    options = [o for o in options if o != "taa"]
    if kind == "paths":
        with tempfile.TemporaryDirectory() as folder:
            traced = os.path.join(folder, "traced.exr")
            subprocess.run([program, "trace", *scene, "--size", size, "--spp", state, "--aov", "all", "-o", traced, "-q"], check=True)
            if "oidn" in options:
                from peers import paths  # It takes this module's functions.
                paths.denoised(traced, path)
            else:
                write(path, rgb(layers(traced), ""))
        return
    command = [program, "render", *scene, "--size", size, "--method", kind, *(taa or ["--samples", str(samples)]), "--aov", "all"]
    command += ["--weights", weights] if weights else []
    command += ["--gather", ",".join(options)] if options else []
    if state == "pan":
        with tempfile.TemporaryDirectory() as folder:
            keys = os.path.join(folder, "pan.json")
            with open(keys, "w") as f:
                json.dump(pan_to(os.path.join(os.path.dirname(scene[0]), "meta.json")), f)
            subprocess.run([*command, "--path", keys, "-o", os.path.join(folder, "{frame}.exr"), "-q"], check=True)
            shutil.move(os.path.join(folder, f"{PAN_FRAMES}.exr"), path)
        return
    subprocess.run([*command, "-o", path] + (["--accumulate", state] if state else []) + ["-q"], check=True)


PAN_FRAMES = 16


def pan_to(meta):
    """A path of PAN_FRAMES frames at 1/60 s that turns by 1 degree each and ends as a reference's meta.json says."""
    with open(meta) as f:
        meta = json.load(f)
    eye, target = np.array(meta["eye"]), np.array(meta["target"])
    keys = []
    for frame in range(PAN_FRAMES + 1):
        a = np.radians(PAN_FRAMES - frame)
        x, y, z = target - eye
        turned = eye + [np.cos(a) * x + np.sin(a) * z, y, -np.sin(a) * x + np.cos(a) * z]
        keys.append({"time": frame / 60, "eye": eye.tolist(), "look_at": turned.tolist(), "fov": meta["fov"]})
    return {"schema": 1, "keys": keys}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", help="folder for our pictures")
    parser.add_argument("references", nargs="+", help="folders of Cycles' pictures")
    parser.add_argument("--methods", help="default: all", type=lambda t: t.split(","))
    parser.add_argument("--constant", type=lambda t: [float(v) for v in t.split(",")])
    parser.add_argument("--rooms", type=indices, help="take these rooms only, such as 0,27,2200-2239")
    parser.add_argument("--samples", type=int, default=4)
    parser.add_argument("--keep", action="store_true", help="keep our pictures even if another program or other weights drew them")
    parser.add_argument("--csv", help="also write every scene's numbers here")
    parser.add_argument("--bouncelight", default="target/release/bouncelight")
    a = parser.parse_args()
    a.methods = a.methods or all_methods(a.bouncelight)
    found = [scene for folder in a.references for scene in references(folder, a.rooms)]
    missing = sorted(set(a.rooms or []) - {int(name[4:8]) for _, name, _, _ in found if name.startswith("room")})
    if missing:
        listed = ",".join(map(str, missing))
        sys.exit(f"no reference of rooms {listed}; make them with\n  python training/cycles/paper_rooms.py {a.references[0]} --rooms {listed} --views 1 --size 1024x512 --spp 64 --denoise --judge")
    os.makedirs(a.out, exist_ok=True)
    rows, record, program, stamps = {}, [], digest(a.bouncelight), Stamps(a.out, a.keep)

    def compare(group, name, row, ours, reference, light=float("nan")):
        r = compared(a.bouncelight, ours, reference)
        paper, display, linear = r["paper"], r["display"], r["linear"]
        values = [paper["l1"], paper["l2"], paper["ssim"], paper["fid"], display["psnr"], display["ssim"], r["flip"], linear["rel_mse"] if linear else float("nan"), light]
        rows.setdefault(group, {}).setdefault(row, []).append(values)
        record.append([name, row, *values])

    for group, name, scene, reference in found:
        truth, drawn = layers(reference), {}
        if rgb(truth, "Combined").max() < BLACK:
            print(f"{name}: left out, its reference is black; the camera may stand inside something", file=sys.stderr, flush=True)
            continue
        height, width = truth["Combined.R"].shape
        for method in ["direct"] + [m for m in a.methods if m != "direct"]:
            kind, _, weights = method.partition(":")
            row = f"{kind} {os.path.splitext(os.path.basename(weights))[0]}".strip()
            path = os.path.join(a.out, f"{name}_{row.replace(' ', '_')}.exr")
            stamp = f"{program} {digest(weights) if os.path.exists(weights) else weights} {a.samples} {width}x{height}"
            if not stamps.fresh(path, stamp):
                draw(a.bouncelight, scene, (kind, weights), path, f"{width}x{height}", a.samples)
                stamps.put(path, stamp)
            drawn[method] = layers(path)
            if method in a.methods:
                compare(group, name, row, path, reference, float("nan") if kind.startswith(("generator", "paths")) else light_error(drawn[method], drawn["direct"], truth, "+taa" in kind))
        extra = [("constant", with_constant(drawn["direct"], a.constant))] if a.constant else []
        extra += [("best constant", with_constant(drawn["direct"], best_constant(drawn["direct"], truth)))]
        for row, picture in extra:
            path = os.path.join(a.out, f"{name}_{row.replace(' ', '_')}.exr")
            stamp = f"{program} {a.constant if row == 'constant' else ''} {a.samples} {width}x{height}"
            if not stamps.fresh(path, stamp):
                write(path, picture)
                stamps.put(path, stamp)
            compare(group, name, row, path, reference)
        print(f"{name}: L1 " + ", ".join(f"{row} {values[-1][0]:,.0f}" for row, values in rows[group].items()), file=sys.stderr, flush=True)
    for group, methods in rows.items():
        scenes = len(next(iter(methods.values())))
        print(f"\n| {group}{f' ({scenes})' if scenes > 1 else ''} | " + " | ".join(METRICS) + " |\n|" + "---|" * (len(METRICS) + 1))
        for row, values in methods.items():
            m = np.mean(values, 0)
            linear, light = "" if np.isnan(m[7]) else f"{m[7]:.4f}", "" if np.isnan(m[8]) else f"{100 * m[8]:.1f} %"
            print(f"| {row} | {m[0]:,.0f} | {m[1]:,.0f} | {m[2]:.4f} | {m[3]:.4f} | {m[4]:.2f} | {m[5]:.4f} | {m[6]:.4f} | {linear} | {light} |")
    if a.csv:
        with open(a.csv, "w", newline="") as f:
            csv.writer(f).writerows([["scene", "row", *METRICS], *record])


if __name__ == "__main__":
    main()
