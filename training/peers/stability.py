"""Flicker along a pan of 1 degree a frame, and light at the same points after a turn of 15, as flicker.py and turned.py measure them, of peers beside `gather`.

A peer without history is drawn anew for each camera, the path tracer with another seed each, as in motion. Places, normals and albedo are our raster's.
"""
import json
import os
import re
import subprocess
import sys

import judge
from flicker import change, size
from peers import paths, scenes
from turned import camera_of, changed

HERE = os.path.dirname(os.path.abspath(__file__))
#: Degrees of the cameras: the picture, a frame of the pan before it, the turned one.
TURNS = [0, 1, 15]


def _ours(a, scene, folder):
    """{row: {flicker, turned}} of `gather`, and the path tracer's own flicker, by those commands."""
    found = {}
    references = os.path.dirname(scene.source)
    share = ["--scenes", scene.name, "--size", scenes.SIZE, "--bouncelight", a.bouncelight]
    for script, key, words in (("flicker.py", "flicker", ["--methods", "gather+taa", "--samples", "4", "--spp", "8"]), ("turned.py", "turned", ["--methods", "gather"])):
        done = subprocess.run([sys.executable, os.path.join(HERE, "..", script), os.path.join(folder, key), references, *share, *words], check=True, capture_output=True, text=True)
        for row, value in re.findall(rf"^{scene.name} (.+?): ([\d.]+) %", done.stdout, re.MULTILINE):
            found.setdefault({"control": "gather, no history"}.get(row, row), {})[key] = float(value) / 100
    return found


def _frames(a, scene, folder, row):
    """A peer's pictures at each of TURNS."""
    if row.startswith("Eevee"):
        out = os.path.join(folder, row.replace(", ", "_") + ".exr")
        drawn = [out, *(f"{out.removesuffix('.exr')}_{t}.exr" for t in TURNS[1:])]
        words = ["--scale", str(scenes.METRES.get(scene.name, 1)), "--probes", "2000" if "probes" in row else "0", "--turns", "1,15"]
        if not all(map(os.path.exists, drawn)):
            subprocess.run([sys.executable, "-m", "peers.eevee", scene.source, out, *words], check=True, cwd=os.path.join(HERE, ".."), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        return [scenes.layers(path) for path in drawn]
    drawn, spp = [], int(row.split()[0])
    with open(os.path.join(scene.source, "meta.json")) as file:
        meta = json.load(file)
    for turn in TURNS:
        traced, picture = (os.path.join(folder, f"{spp}_{turn}{end}.exr") for end in ("", "_oidn"))
        if not os.path.exists(picture):
            paths.traced(a.bouncelight, scene, spp, traced, "--seed", str(turn + 1), *camera_of(meta, turn)[0])
            paths.denoised(traced, picture)
        drawn.append(judge.layers(picture))
    return drawn


def of(a, scene):
    peers = [row for group, row in (("paths", "4 paths + OIDN"), ("eevee", "Eevee"), ("probes", "Eevee, probes")) if group in a.peers]
    folder = os.path.join(a.out, f"stability_{scene.name}")
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(scene.source, "meta.json")) as file:
        meta = json.load(file)
    found, places, cameras = _ours(a, scene, folder), [], []
    for turn in TURNS:
        flags, camera = camera_of(meta, turn)
        path = os.path.join(folder, f"direct_{turn}.exr")
        if not os.path.exists(path):
            judge.draw(a.bouncelight, [*scene.words, *flags], ("direct", None), path, scenes.SIZE, 4, None)
        places.append(judge.layers(path))
        cameras.append(camera)
    for row in peers:
        seen = []
        for place, own in zip(places, _frames(a, scene, folder, row)):
            # Eevee has all diffuse light in one layer.
            light = {f"DiffInd.{c}": own[f"DiffInd.{c}"] if "DiffInd.R" in own else own[f"DiffDir.{c}"] - place[f"DiffDir.{c}"] for c in "RGB"}
            seen.append(place | light | {c: own[c] for c in "RGB"})
        still, before, turned = seen
        mean = sum(still[c].mean() for c in "RGB") / 3
        found[row] = {"flicker": float(size(change(before, still, (cameras[1], cameras[0]))) / mean), "turned": float(changed(still, turned, (cameras[0], cameras[2]))[0])}
    return found
