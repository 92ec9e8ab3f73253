"""Whether light keeps still on its surfaces when the camera turns: a picture from a reference's camera and one turned by some degrees about
the vertical, both settled, compared at the world points that both show.

    python training/turned.py out/turned ../shared/reference/real [--methods gather,neural] [--degrees 15] [--frames 32] [--scenes hotel,study]

Each pixel's place (Position, at the pixel's centre) of the first picture is looked up in the second, between the four pixels around it, all of which must show the
same surface: on the first's plane to a pixel's width, with its normal (cosine 0.95) and its albedo (to a quarter). Light is all diffuse light
that a method adds (DiffInd), as means over 4x4 pixels of the first picture; the number is mean |difference| / mean, its mean difference in
brackets. `control`: light of the second four pixels to the side. `--degrees 0.7` tells what noise and places of cells have of it.
"""
import argparse
import os
import subprocess
import sys

import numpy as np

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from judge import layers, pooled, references, rgb  # noqa: E402
import json  # noqa: E402


def camera_of(meta, degrees):
    """Flags of the reference's camera, turned about the vertical; and the matrix that brings a world point to its pixels in [-1, 1]."""
    eye, target = np.array(meta["eye"], float), np.array(meta["target"], float)
    a = np.radians(degrees)
    x, y, z = target - eye
    to = np.array([np.cos(a) * x + np.sin(a) * z, y, -np.sin(a) * x + np.cos(a) * z])
    forward = to / np.linalg.norm(to)
    right = np.cross(forward, [0, 1, 0])
    right /= np.linalg.norm(right)
    words = lambda v: ",".join(f"{n:.6f}" for n in v)
    flags = ["--eye", words(eye), "--look-at", words(eye + to), "--fov", str(meta["fov"])]
    return flags, (eye, right, np.cross(right, forward), forward, np.tan(np.radians(meta["fov"]) / 2))


def around(x, y, wide, high):
    """The four pixels around places in units of pixels, pixel centres at whole numbers: (rows, columns, weights)."""
    left, top = np.floor(x).astype(int), np.floor(y).astype(int)
    for down in (0, 1):
        for right in (0, 1):
            weight = np.abs(1 - right - (x - left)) * np.abs(1 - down - (y - top))
            yield (top + down).clip(0, high - 1), (left + right).clip(0, wide - 1), weight


def changed(first, second, cameras, shift=0):
    """mean |difference| / mean of the light at the points that both pictures show, the mean difference over that, and the share of such cells."""
    a, b, same = at_both(first, second, cameras, lambda picture: rgb(picture, "DiffInd"), shift)
    # Of black surfaces nobody sees the light.
    same &= rgb(first, "DiffCol").min(-1) > 0.01
    (a, full), (b, _) = (pooled(light, same.astype(np.float32)) for light in (a, b))
    d = (b - a)[full]
    return np.abs(d).mean() / a[full].mean(), d.mean() / a[full].mean(), full.mean()


def centred(place, normal, camera):
    """Places of pixels' centres, which is where filtered light is: a sample's, which a layer holds, lies up to half a pixel aside. The rays through the
    centres meet the planes of what the pixels show there; where that is farther away than two pixels, which on a surface seen along itself are
    longer, it is no plane."""
    eye, right, up, forward, tangent = camera
    h, w = place.shape[:2]
    v, u = np.meshgrid(1 - (2 * np.arange(h) + 1) / h, (2 * np.arange(w) + 1) / w - 1, indexing="ij")
    ray = forward + u[..., None] * tangent * w / h * right + v[..., None] * tangent * up
    facing = (ray * normal).sum(-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        centre = eye + ray * (((place - eye) * normal).sum(-1) / facing)[..., None]
        along = np.abs(facing) / np.linalg.norm(ray, axis=-1)
        near = np.linalg.norm(centre - place, axis=-1) * along < 4 * tangent / h * np.abs((place - eye) @ forward)
    return np.where((near & np.isfinite(centre).all(-1))[..., None], centre, place)


def at_both(first, second, cameras, light_of, shift=0):
    """What `light_of` takes from either picture at the first's pixels ([h,w,3] each), and which of them show points that both do [h,w]."""
    vector = lambda o, name: np.stack([o[f"{name}.{c}"] for c in "XYZ"], -1)
    normal, albedo = vector(first, "Normal"), rgb(first, "DiffCol")
    place = centred(vector(first, "Position"), normal, cameras[0])
    eye, right, up, forward, tangent = cameras[1]
    h, w = first["Depth.Z"].shape
    at = place - eye
    z = at @ forward
    with np.errstate(divide="ignore", invalid="ignore"):
        u, v = at @ right / (z * tangent * w / h), at @ up / (z * tangent)
    same = (first["Depth.Z"] < 1e9) & (z > 0) & (np.abs(u) < 1) & (np.abs(v) < 1)
    x, y = np.where(same, (u + 1) / 2 * w - 0.5, 0), np.where(same, (1 - v) / 2 * h - 0.5, 0)
    pixel = 2 * tangent / h * np.where(same, z, 1)
    places, normals, albedos, lights = vector(second, "Position"), vector(second, "Normal"), rgb(second, "DiffCol"), light_of(second)
    light = np.zeros_like(albedo)
    for row, column, weight in around(x, y, w, h):
        alike = np.abs(((places[row, column] - place) * normal).sum(-1)) < pixel
        alike &= (normals[row, column] * normal).sum(-1) > 0.95
        alike &= np.abs(albedos[row, column] - albedo).max(-1) <= np.maximum(0.25 * albedo.max(-1), 0.01)
        same &= alike | (weight < 1e-3)
        light += weight[..., None] * lights[row, (column + shift).clip(0, w - 1)]
    return light_of(first), light, same


def arguments(description, methods, samples, size):
    """The command line that such comparisons share, with these defaults; a command adds its own to it."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", help="folder for our pictures")
    parser.add_argument("references", help="folder of references, one folder a scene with scene.glb and meta.json")
    parser.add_argument("--methods", default=methods, type=lambda t: t.split(","))
    parser.add_argument("--scenes", type=lambda t: t.split(","))
    parser.add_argument("--samples", type=int, default=samples)
    parser.add_argument("--size", default=size)
    parser.add_argument("--bouncelight", default="target/release/bouncelight")
    return parser


def scenes_of(a):
    """(name, scene arguments, path of meta.json, what it says) of each scene that is asked for."""
    for _, name, scene, _ in references(a.references):
        if not a.scenes or name in a.scenes:
            path = os.path.join(os.path.dirname(scene[0]), "meta.json")
            with open(path) as file:
                yield name, scene, path, json.load(file)


def main():
    parser = arguments(__doc__, "gather,neural", 4, "512x256")
    parser.add_argument("--degrees", type=float, default=15)
    parser.add_argument("--frames", type=int, default=32)
    a = parser.parse_args()
    os.makedirs(a.out, exist_ok=True)
    for name, scene, _, meta in scenes_of(a):
        for method in a.methods:
            drawn, cameras = [], []
            for degrees in (0, a.degrees):
                path = os.path.join(a.out, f"{name}_{method}_{degrees:g}.exr")
                flags, camera = camera_of(meta, degrees)
                if not os.path.exists(path):
                    subprocess.run([a.bouncelight, "render", *scene, *flags, "--size", a.size, "--method", method, "--accumulate", str(a.frames),
                                    "--samples", str(a.samples), "--aov", "all", "-q", "-o", path], check=True)
                drawn.append(layers(path))
                cameras.append(camera)
            change, bias, share = changed(*drawn, cameras)
            control = changed(*drawn, cameras, shift=4)[0]
            print(f"{name} {method}: {100 * change:.2f} % ({100 * bias:+.2f}), {100 * share:.0f} % of the picture; control {100 * control:.1f} %", flush=True)


if __name__ == "__main__":
    main()
