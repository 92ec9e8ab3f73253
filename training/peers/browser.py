"""three.js' screen-space global illumination in Chromium: see browser/."""
import json
import math
import os
import shutil
import subprocess
import tempfile

import numpy as np

import judge
from bouncelight_training.stream import SKY_RADIANCE, camera, rooms_of_stream
from peers import scenes

FRAMES = 16
#: SSGINode's giIntensity; its default, 10, is no physical light. Chosen among 1, 3 and 10 with the hotel in view.
INTENSITY = 1
STAMP = f"three 0.187 {FRAMES} {INTENSITY}"
HERE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "browser")


def job_of(scene):
    """Camera, lights and sky of a scene for page.html; None where this package has no file of it."""
    if not os.path.isdir(scene.source):
        return None
    with open(os.path.join(scene.source, "meta.json")) as file:
        meta = json.load(file)
    if "eye" not in meta:
        return None
    scale, white = scenes.METRES.get(scene.name, 1), [1, 1, 1]
    suns = [{"towards": meta["sun"][:3], "strength": meta["sun"][3], "color": white}] if meta.get("sun") else []
    lamps = [{"at": p[:3], "intensity": p[3] * scale**2 / (4 * math.pi), "color": white} for p in meta.get("point", [])]
    return {"size": [int(n) for n in scenes.SIZE.split("x")], "scale": scale, "eye": meta["eye"], "target": meta["target"], "fov": meta["fov"], "near": meta["near"],
            "world": [meta["world"]] * 3, "suns": suns, "lamps": lamps, "frames": FRAMES, "intensity": INTENSITY}


def draw(program, scene, path, **more):
    job = job_of(scene)
    if job is None:
        raise OSError("three.js: only scenes with a folder of their own are drawn")
    with tempfile.TemporaryDirectory() as folder:
        words, raw = os.path.join(folder, "job.json"), os.path.join(folder, "picture.f32")
        with open(words, "w") as file:
            json.dump(job | more, file)
        done = subprocess.run([shutil.which("node") or "node", "draw.mjs", words, os.path.join(scene.source, "scene.glb"), raw], cwd=HERE, capture_output=True, text=True, timeout=590)
        said = json.loads(done.stdout) if done.stdout else {"error": done.stderr}
        if "error" in said or not os.path.exists(raw):
            raise OSError(said.get("error", "no picture") + done.stderr[-2000:])
        wide, high = job["size"]
        judge.write(path, np.fromfile(raw, np.float32).reshape(high, wide, 4)[..., :3])
    return {"wall_s": said["seconds"], "chromium": said["chromium"], "version": said["three"]}
