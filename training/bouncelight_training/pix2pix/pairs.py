"""Picture pairs for the paper's recipe: what the rasteriser knows, four RGB pictures, and what Cycles made of the same view.

    python -m bouncelight_training.pix2pix.pairs --raster DIR --cycles DIR --out pairs.npz [--rooms 6-63] [--normals clamped|halved]

RASTER/roomIIII_viewV.exr comes from pix2pix.raster, CYCLES/roomIIII_viewV.exr from cycles/paper_rooms.py, of one size. All five pictures
are 8-bit and went through Blender's Filmic view, as the authors' did (their published sets 0002 to 0005 were compared with ours):

    depth    (z - min)/(max - min) over the picture's surfaces, background 1
    direct   direct light, and the sky's without occlusion (radiance times diffuse and glossy colour): what Eevee calls direct
    diffuse  albedo
    normal   world normal, Z up, clamped at zero, so walls that face -X or -Y lose theirs ("halved": 0.5 + 0.5 n, not Filmic, loses nothing)
    target   Cycles' Combined
"""
import argparse
import json
import os
import re
import sys

import numpy as np
import OpenEXR

from ..archive import load
from ..errors import TrainingError, reported
from ..filmic import filmic
from ..stream import SKY_RADIANCE, indices, is_judged

NAME = re.compile(r"room(\d{4,})_view(\d+)\.exr")
# Blender's Normalize node takes what is farther for background.
FARTHEST = 1e4
NORMALS = ("clamped", "halved")
# In the order in which the network takes them.
PICTURES = ("depth", "direct", "diffuse", "normal")
# The project's validation rooms are nobody's training rooms.
VALIDATION = {2, 3, 4, 5}
SHARES = (0.7, 0.15, 0.15)


def layers(path, prefix=""):
    """Channels of an EXR by name, without `prefix`; float32 [h,w]."""
    try:
        with OpenEXR.File(path, separate_channels=True) as file:
            return {name.removeprefix(prefix): channel.pixels.astype(np.float32) for name, channel in file.channels().items()}
    except (OSError, RuntimeError, ValueError) as error:
        raise TrainingError(f"{path}: not a readable EXR: {error}") from error


def stacked(channels, names, path):
    """Some channels as [h,w,n]; missing or not finite ones are errors."""
    missing = [n for n in names if n not in channels]
    if missing:
        raise TrainingError(f"{path}: no channel {missing[0]}; draw it again")
    out = np.stack([channels[n] for n in names], -1)
    if not np.isfinite(out).all():
        raise TrainingError(f"{path}: {names[0]} holds {np.count_nonzero(~np.isfinite(out))} values that are not finite; draw it again")
    return out


def of(layer):
    return [f"{layer}.{c}" for c in "RGB"]


def inputs_of(path, normals="clamped"):
    """The network's four pictures of a raster EXR, in its order: bytes [4,h,w,3]."""
    channels = layers(path)
    light, diffuse, glossy = (stacked(channels, names, path) for names in ("RGB", of("DiffCol"), of("GlossCol")))
    x, y, z = np.moveaxis(stacked(channels, ["Normal.X", "Normal.Y", "Normal.Z"], path), -1, 0)
    normal = np.stack([x, -z, y], -1)
    depth = stacked(channels, ["Depth.Z"], path)
    surface = depth < FARTHEST
    if not surface.any():
        raise TrainingError(f"{path}: nothing but background; leave it out")
    nearest, farthest = depth[surface].min(), depth[surface].max()
    depth = np.where(surface, (depth - nearest) / max(farthest - nearest, 1e-6), 1.0)
    lit = light + SKY_RADIANCE * (diffuse + glossy) * surface
    shown = [filmic(np.repeat(depth, 3, -1)), filmic(lit), filmic(diffuse), filmic(np.maximum(normal, 0)) if normals == "clamped" else 0.5 + 0.5 * normal]
    return as_bytes(np.stack(shown))


def target_of(path):
    """Cycles' picture as it is shown: bytes [h,w,3]."""
    return as_bytes(filmic(stacked(layers(path, "ViewLayer."), of("Combined"), path)))


def as_bytes(values):
    return (np.clip(values, 0, 1) * 255 + 0.5).astype(np.uint8)


def views_of(raster, cycles, rooms=None):
    """Views that are in both folders: sorted [(room, view, raster path, Cycles path)]."""
    found = {}
    for kind, folder in enumerate((raster, cycles)):
        if not os.path.isdir(folder):
            raise TrainingError(f"{folder}: no such folder")
        for name in os.listdir(folder):
            match = NAME.fullmatch(name)
            if match and (rooms is None or int(match[1]) in rooms):
                found.setdefault((int(match[1]), int(match[2])), {})[kind] = os.path.join(folder, name)
    both = [(*key, paths[0], paths[1]) for key, paths in sorted(found.items()) if len(paths) == 2]
    if not both:
        raise TrainingError(f"{raster} and {cycles} share no view roomIIII_viewV.exr")
    if len(both) < len(found):
        print(f"{len(found) - len(both)} views are in one of the folders only and are left out", file=sys.stderr)
    return both


def refuse_judged(rooms):
    kept = sorted(r for r in set(map(int, rooms)) if is_judged(r))
    if kept:
        raise TrainingError(f"rooms {kept} are kept for judging and must not be trained or tuned on; remove them from the folder or pass --rooms")


def build(raster, cycles, out, rooms=None, normals="clamped"):
    """Writes the pairs: pictures u8 [n,4,h,w,3], target u8 [n,h,w,3], room and view i32 [n], report (JSON text), and returns the report."""
    views = views_of(raster, cycles, rooms)
    refuse_judged(room for room, *_ in views)
    pictures, targets = [], []
    for _, _, ours, theirs in views:
        pictures.append(inputs_of(ours, normals))
        targets.append(target_of(theirs))
        if pictures[-1].shape[1:] != targets[-1].shape or targets[-1].shape != targets[0].shape:
            raise TrainingError(f"{ours} has {pictures[-1].shape[1:3]} pixels, {theirs} {targets[-1].shape[:2]}, the first view {targets[0].shape[:2]}; all must be the same")
    numbers = {"room": [v[0] for v in views], "view": [v[1] for v in views]}
    height, width = targets[0].shape[:2]
    report = {"views": len(views), "rooms": sorted(set(numbers["room"])), "size": [width, height], "normals": normals, "view_transform": "filmic"}
    with open(out + ".part", "wb") as file:
        np.savez_compressed(file, pictures=np.stack(pictures), target=np.stack(targets), report=json.dumps(report), **{k: np.asarray(v, np.int32) for k, v in numbers.items()})
    os.replace(out + ".part", out)
    return report


class Pairs:
    """The arrays of `build` in memory."""

    def __init__(self, path):
        arrays, self.report = load(path, ("pictures", "target", "room", "view"), "pix2pix.pairs")
        self.path = path
        self.pictures, self.target, self.room, self.view = (arrays[n] for n in ("pictures", "target", "room", "view"))
        refuse_judged(self.room)

    def __len__(self):
        return len(self.target)

    def split(self, seed):
        """Indices of the training, validation and test views: 70, 15 and 15 of 100 rooms drawn by `seed`; VALIDATION rooms validate."""
        rooms = np.array(sorted(set(map(int, self.room)) - VALIDATION))
        rooms = np.random.default_rng((seed, 70)).permutation(rooms)
        cuts = np.cumsum([round(share * len(rooms)) for share in SHARES[:2]])
        parts = [set(map(int, part)) for part in np.split(rooms, cuts)]
        parts[1] |= VALIDATION & set(map(int, self.room))
        return [np.array([i for i, room in enumerate(self.room) if int(room) in part], int) for part in parts]

    def tensors(self, index):
        """(four pictures [1,12,h,w], target [1,3,h,w]) in [-1, 1], as float32 arrays."""
        four = self.pictures[index].astype(np.float32) / 127.5 - 1
        target = self.target[index].astype(np.float32) / 127.5 - 1
        h, w = target.shape[:2]
        return four.transpose(0, 3, 1, 2).reshape(1, 12, h, w), target.transpose(2, 0, 1)[None]


@reported
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--raster", required=True, help="folder of pix2pix.raster")
    parser.add_argument("--cycles", required=True, help="folder of cycles/paper_rooms.py")
    parser.add_argument("--out", required=True, help="the .npz to write")
    parser.add_argument("--rooms", type=lambda t: set(indices(t)), help="take these rooms only")
    parser.add_argument("--normals", choices=NORMALS, default="clamped")
    a = parser.parse_args(arguments)
    print(json.dumps(build(a.raster, a.cycles, a.out, a.rooms, a.normals), indent=1))


if __name__ == "__main__":
    main()
