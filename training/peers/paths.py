"""Our path tracer at few paths a pixel with Open Image Denoise on top."""
import os
import re
import subprocess
import time

import numpy as np
import OpenEXR

import judge


def traced(program, scene, paths, path, *more):
    """Traces into a file with all layers; the seconds that the paths took, as the program says."""
    words = [program, "trace", *scene.words, "--size", "512x256", "--spp", str(paths), "--aov", "all", "--progress", "none", "-o", path, *more]
    done = subprocess.run(words + ([] if scene.caustics else ["--no-caustics"]), check=True, capture_output=True, text=True)
    return float(re.search(r"samples? a pixel in ([\d.]+) s", done.stderr + done.stdout)[1])


def denoised(source, out):
    """A traced picture, denoised with albedo and normal as guides, and its light likewise (as on white surfaces), for light_error. Writes
    R, G, B and DiffInd; the seconds of wall and processor that the picture's denoising took."""
    import pyoidn
    found = judge.layers(source)
    plain = lambda a: np.ascontiguousarray(a, np.float32)
    albedo = np.clip(judge.rgb(found, "DiffCol") + judge.rgb(found, "GlossCol"), 0, 1)
    normal = plain(np.stack([found[f"Normal.{c}"] for c in "XYZ"], -1))
    light = pyoidn.denoise(plain(judge.rgb(found, "Gi")), albedo=np.ones_like(normal), normal=normal, hdr=True)
    start, work = time.time(), time.process_time()
    picture = pyoidn.denoise(plain(judge.rgb(found, "")), albedo=plain(albedo), normal=normal, hdr=True)
    seconds = {"wall_s": time.time() - start, "cpu_s": time.process_time() - work}
    channels = {c: plain(picture[..., i]) for i, c in enumerate("RGB")} | {f"DiffInd.{c}": plain(light[..., i]) for i, c in enumerate("RGB")}
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, channels).write(out + ".part.exr")
    os.replace(out + ".part.exr", out)
    return seconds
