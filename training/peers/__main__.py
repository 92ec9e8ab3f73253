"""Draws and judges what people would use instead of bouncelight, in one run; the tables of docs/results/peers.md.

    cd training
    python cycles/paper_rooms.py data/rooms --rooms 2-5 --views 1 --size 512x256 --spp 64 --unlimited --denoise
    bouncelight trace interior --size 512x256 --spp 128 --seed 77 --aov all -o data/rooms/interior.exr
    cargo run --release --example export_scene -- interior data/interior/scene.glb
    python -m peers out/peers --references ../../shared/reference/real data/rooms --fine ../../shared/reference/fine --interior data/interior
                              [--peers ours,paths,eevee,probes,three] [--scenes hotel,city] [--times] [--stability hotel,sampleroom]
                              [--bouncelight ../target/release/bouncelight]

- ours: `gather` and `neural` settled (32 frames, four samples), `gather` as a viewer shows it (temporal anti-aliasing, a frame a picture), and its first frame after a cut.
- paths: our path tracer at 1, 2, 4, 8, 16 and 32 paths a pixel, Open Image Denoise on top (pip install pyoidn).
- eevee, probes: Blender's Eevee Next (pip install bpy==4.5.15), screen only and with a baked volume of light probes.
- three: three.js' SSGI in Chromium (needs node; in peers/browser: npm install).

Everything has the reference's camera and light and is judged as linear pictures under Filmic at one exposure; errors as in judge.py. What exists is kept
if the same program drew it, so a killed run goes on. --times measures a frame of `gather` and a path (do nothing else on the machine meanwhile).
OUT/peers.json and OUT/peers.md are written after every scene, from all that is known.
"""
import argparse
import json
import os
import subprocess
import sys

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import judge  # noqa: E402
from peers import paths, record, scenes, stability, times  # noqa: E402

HERE = os.path.dirname(os.path.abspath(__file__))
PATHS = [1, 2, 4, 8, 16, 32]
PROBES = 2000
#: Rows of ours: what it is called, words after the method, samples a pixel.
OURS = [("gather", "", 4), ("gather, TAA", "+taa", 1), ("gather, first frame", "@1", 1), ("neural", "", 4)]
GROUPS = ["ours", "paths", "eevee", "probes", "three"]


class Run:
    def __init__(self, a):
        self.a, self.program, self.stamps = a, judge.digest(a.bouncelight), judge.Stamps(a.out, a.keep)
        self.direct = None

    def made(self, picture, stamp, draw):
        """Draws a picture unless it is there; keeps what `draw` says of it in PICTURE.times."""
        if not self.stamps.fresh(picture, stamp):
            said = draw()
            if said is not None:
                with open(picture + ".times", "w") as file:
                    json.dump(said, file)
            self.stamps.put(picture, stamp)
        try:
            with open(picture + ".times") as file:
                return json.load(file)
        except FileNotFoundError:
            return {}

    def path(self, scene, name):
        return os.path.join(self.a.out, f"{scene.name}_{name}".replace(" ", "_").replace(",", "") + ".exr")

    def without_black(self, picture, found, truth):
        """The picture, or a copy with the reference's pixels where that shows coincident faces black (as light_error leaves them out)."""
        surface, light = self.direct["Depth.Z"] < 1e9, sum(truth[f"{n}.{c}"] for n in ("DiffInd", "DiffDir") for c in "RGB")
        black = surface & (judge.rgb(self.direct, "DiffCol").min(-1) > 0.01) & (light < 0.02 * np.median(light[surface]))
        if not black.any():
            return picture
        whole = scenes.layers_of(truth)
        copy = picture.removesuffix(".exr") + ".judged.exr"
        if not os.path.exists(copy) or os.path.getmtime(copy) < os.path.getmtime(picture):
            judge.write(copy, np.where(black[..., None], judge.rgb(whole, ""), judge.rgb(found, "")))
        return copy

    def judged(self, scene, row, picture, said, with_direct=False):
        """A row of the record. with_direct: the picture has its own direct light, or all light in DiffDir."""
        found, truth = scenes.layers(picture), judge.layers(scene.reference)
        r, light = judge.compared(self.a.bouncelight, self.without_black(picture, found, truth), scene.reference), None
        if "DiffInd.R" in found or "DiffDir.R" in found:
            nothing = {f"DiffInd.{c}": 0 * self.direct["DiffDir.R"] for c in "RGB"}
            light = judge.light_error(nothing | found, self.direct, truth, with_direct)
        return {"scene": scene.name, "row": row, "light": light, "psnr": r["display"]["psnr"], "ssim": r["display"]["ssim"], "flip": r["flip"], **said}

    def ours(self, scene):
        for row, more, samples in OURS:
            picture, method = self.path(scene, row), scene.method if row != "neural" else scene.method.replace("gather", "neural")
            self.made(picture, f"{self.program} {method}{more} {samples}", lambda: judge.draw(self.a.bouncelight, scene.words, (method + more, None), picture, scenes.SIZE, samples, None))
            yield self.judged(scene, row, picture, {}, "taa" in more)

    def paths(self, scene):
        for n in PATHS:
            traced, picture = self.path(scene, f"{n} paths"), self.path(scene, f"{n} paths oidn")
            said = self.made(traced, f"{self.program} {n}", lambda: {"paths_s": paths.traced(self.a.bouncelight, scene, n, traced)})
            said |= self.made(picture, f"{self.program} {n} pyoidn", lambda: paths.denoised(traced, picture))
            yield self.judged(scene, f"{n} path{'s'[:n > 1]} + OIDN", picture, {"paths": n, "denoise_s": said["wall_s"], "denoise_cpu_s": said["cpu_s"]})

    def blender(self, scene, row, probes):
        picture = self.path(scene, row)
        words = [sys.executable, "-m", "peers.eevee", scene.source, picture, "--scale", str(scenes.METRES.get(scene.name, 1)), "--probes", str(probes)]
        said = self.made(picture, f"4.5.15 {probes}", lambda: subprocess.run(words, check=True, cwd=os.path.join(HERE, ".."), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=self.a.patience) and None)
        yield self.judged(scene, row, picture, said, True)

    def three(self, scene):
        from peers import browser
        picture = self.path(scene, "three")
        said = self.made(picture, browser.STAMP, lambda: browser.draw(self.a.bouncelight, scene, picture))
        yield self.judged(scene, "three.js SSGI", picture, said)

    def rows(self, scene, group):
        if group in ("eevee", "probes"):
            return self.blender(scene, "Eevee" if group == "eevee" else "Eevee, probes", 0 if group == "eevee" else PROBES)
        return getattr(self, group)(scene)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter, prog="python -m peers")
    words = lambda t: t.split(",")
    parser.add_argument("out", type=os.path.abspath)
    parser.add_argument("--references", nargs="+", required=True, type=os.path.abspath)
    parser.add_argument("--fine", nargs="+", default=[], type=os.path.abspath, help="folders of references with less noise; scenes that they have are judged by them")
    parser.add_argument("--interior", type=os.path.abspath, help="folder with the bundled interior's scene.glb, for peers")
    parser.add_argument("--peers", type=words, default=GROUPS)
    parser.add_argument("--scenes", type=words)
    parser.add_argument("--times", action="store_true", help="measure times of frames and paths, and draw nothing")
    parser.add_argument("--stability", type=words, help="of these scenes; draws nothing else")
    parser.add_argument("--patience", type=int, default=1200, help="most seconds for a picture by Blender")
    parser.add_argument("--keep", action="store_true")
    parser.add_argument("--bouncelight", default="../target/release/bouncelight", type=os.path.abspath)
    a = parser.parse_args()
    os.makedirs(a.out, exist_ok=True)
    run, known = Run(a), record.Record(a.out, a.bouncelight)
    for scene in scenes.all_scenes(a.references, a.fine, a.interior):
        if a.scenes and scene.name not in a.scenes:
            continue
        if a.times:
            known.put_times(scene.name, times.of(a.bouncelight, scene, a.out))
        elif a.stability is not None:
            if scene.name in a.stability:
                known.put_stability(scene.name, stability.of(a, scene))
        else:
            direct = run.path(scene, "direct")
            run.made(direct, run.program, lambda: judge.draw(a.bouncelight, scene.words, ("direct", None), direct, scenes.SIZE, 4, None))
            run.direct = judge.layers(direct)
            for group in a.peers:
                try:
                    for row in run.rows(scene, group):
                        known.put(row | {"reference": "fine" if scene.reference.startswith(tuple(a.fine)) else "coarse"})
                except (subprocess.SubprocessError, OSError) as error:
                    print(f"{scene.name}, {group}: {error}", file=sys.stderr, flush=True)
                known.write()
        known.write()
        print(scene.name, file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
