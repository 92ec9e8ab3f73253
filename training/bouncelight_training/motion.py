"""Light that stands still while the camera moves: the temporal term of the loss, and how much a network flickers.

    bouncelight dataset --recipe paper-room --rooms 6-9,13,15-26 --views 1 --motion --out data/motion
    python -m bouncelight_training.motion --features data/motion --out data/motion.npz
    python -m bouncelight_training.train … --motion data/motion.npz --temporal 0.5
    python -m bouncelight_training.motion --pairs data/motion-2-5.npz --weights small.safetensors,other.safetensors

Each sample holds two frames of a camera that takes a small step, and for each cell of the first the place where the second shows the
same surface. Diffuse light does not depend on where it is looked at from, so the reference's own change along these motion vectors is
zero, and all change is flicker. No target is needed.
"""
import argparse
import dataclasses
import json
import os
import sys

import numpy as np
import torch
import torch.nn.functional as F

from .archive import load, save
from .data import NAME, Dark, indices, number_of, read_features, refuse_judged
from .errors import TrainingError, reported
from .features import APPLIED_ADDED, APPLIED_GAIN, CHANNELS, SLICES, channels_of
from .losses import relative_square
from .model import light
from .weights import GraphNet, WeightsError, read

KEYS = ("features", "next_features", "scale", "next_scale", "flow", "room", "view")
UNSEEN = -1e4  # src/study/motion.rs


def read_pair(path):
    """A sample of `bouncelight dataset --motion`."""
    tensors = read_features(path)
    h, w = tensors["features"].shape[-2:]
    for name, shape in {"next_features": (CHANNELS, h, w), "next_scale": (1,), "flow": (2, h, w)}.items():
        if name not in tensors:
            raise TrainingError(f"{path}: no tensor {name}; write it again with `bouncelight dataset --motion`")
        if tensors[name].shape != shape or not np.isfinite(tensors[name]).all():
            raise TrainingError(f"{path}: tensor {name} has shape {tensors[name].shape}, expected {shape}, or values that are not finite")
    if tensors["next_scale"][0] <= 0:
        raise Dark(f"{path}: its second frame has no light; leave it out")
    return tensors


def build(folder, out, rooms=None):
    """Writes all samples of a folder as one file and returns its report."""
    if not os.path.isdir(folder):
        raise TrainingError(f"{folder}: no such folder")
    found = []
    for name in sorted(os.listdir(folder)):
        match = NAME.fullmatch(name)
        if match and match[5] == "safetensors" and (rooms is None or number_of(match) in rooms):
            found.append((number_of(match), int(match[4]), os.path.join(folder, name)))
    if not found:
        raise TrainingError(f"{folder}: no samples in it")
    refuse_judged(room for room, *_ in found)
    columns = {key: [] for key in KEYS}
    for room, view, path in found:
        try:
            t = read_pair(path)
        except Dark as error:
            print(f"left out: {error}", file=sys.stderr)
            continue
        values = (t["features"].astype(np.float16), t["next_features"].astype(np.float16), t["scale"][0], t["next_scale"][0], t["flow"], room, view)
        for key, value in zip(KEYS, values):
            columns[key].append(value)
    if not columns["room"]:
        raise TrainingError(f"{folder}: no view in it has any light")
    kinds = {"scale": np.float32, "next_scale": np.float32, "room": np.int32, "view": np.int32}
    arrays = {key: np.asarray(value, kinds.get(key)) for key, value in columns.items()}
    return save(out, arrays, {"views": len(columns["room"]), "rooms": sorted(map(int, set(arrays["room"]))), "seen": float((arrays["flow"][:, 0] > UNSEEN / 2).mean())})


@dataclasses.dataclass
class Pair:
    """Two frames as tensors."""

    frames: torch.Tensor  # features [2,24,h,w]
    flow: torch.Tensor  # where the second shows each surface of the first, cells [1,2,h,w]
    ratio: float  # the second's exposure over the first's


class Pairs:
    """Such a file in memory."""

    def __init__(self, path):
        arrays, self.report = load(path, KEYS, "motion")
        self.path = path
        for name, values in arrays.items():
            if not all(np.isfinite(part).all() for part in values):
                raise TrainingError(f"{path}: {name} holds values that are not finite")
            setattr(self, name, values)
        refuse_judged(self.room)

    def __len__(self):
        return len(self.flow)

    def pair(self, i, left=0, width=0, device="cpu"):
        """Pair i, or a window of it `width` cells wide (0: to its right edge) from cell `left` on."""
        cut = slice(left, left + width if width else None)
        frames = np.stack([self.features[i][..., cut], self.next_features[i][..., cut]]).astype(np.float32)
        flow = self.flow[i:i + 1, ..., cut] - np.array([left, 0], np.float32)[:, None, None]
        return Pair(torch.from_numpy(frames).to(device), torch.from_numpy(flow).to(device), float(self.next_scale[i] / self.scale[i]))

    def draw(self, rng, width, device):
        """A pair at random, or a window of it `width` cells wide (0: all of it)."""
        i, whole = int(rng.integers(len(self))), self.flow.shape[-1]
        width = min(width or whole, whole)
        return self.pair(i, int(rng.integers(0, whole - width + 1)), width, device)


def picked(image, flow):
    """Values of image [n,c,h,w] at the places of flow [n,2,h,w] (cells), between cells linearly, and where they lie inside [n,h,w]."""
    h, w = image.shape[-2:]
    x, y = flow[:, 0], flow[:, 1]
    inside = (x >= 0) & (y >= 0) & (x <= w - 1) & (y <= h - 1)
    grid = torch.stack([2 * x / max(w - 1, 1) - 1, 2 * y / max(h - 1, 1) - 1], -1).clamp(-2, 2)
    return F.grid_sample(image, grid, mode="bilinear", padding_mode="border", align_corners=True), inside


def change(first, second, pair):
    """Light [1,3,h,w] of the first frame; that of the second where it shows the same surface, in units of the first's exposure; and where
    it does [1,h,w]."""
    there, inside = picked(second, pair.flow)
    return first, there * pair.ratio, inside


def flicker_loss(first, second, pair, epsilon):
    """Relative square of what changes of the light [1,3,h,w] (units of each frame's exposure) along motion vectors; both frames learn."""
    first, there, inside = change(first, second, pair)
    mean = (0.5 * (first + there)).detach()
    return relative_square(mean + first - there, mean, inside, epsilon)


def flicker(pairs, answer=None):
    """Mean |change of E| along motion vectors over mean E, of a network's light (or, with none, of the first guess)."""
    above = below = 0.0
    with torch.no_grad():
        for i in range(len(pairs)):
            pair = pairs.pair(i)
            lit = light(answer(pair.frames), pair.frames) if answer else torch.expm1(pair.frames[:, SLICES["guess"]])
            lit = lit.clamp(min=0)
            first, there, inside = change(lit[:1], lit[1:], pair)
            weight = inside[:, None] * float(pairs.scale[i])
            above += ((first - there).abs() * weight).sum().item()
            below += (first * weight).sum().item()
    return above / max(below, 1e-20)


def network_of(path):
    """The network of a weights file as a function of features [n,24,h,w], kept to the limits that the program keeps it to."""
    try:
        tensors, doc = read(path)
    except (OSError, WeightsError) as error:
        raise TrainingError(f"{path}: {error}") from error
    model = GraphNet(doc["graph"], doc["output"]["tensor"])
    model.load_state_dict({name: torch.from_numpy(values.astype(np.float32)) for name, values in tensors.items()})
    channels = channels_of([feature["name"] for feature in doc["inputs"]])
    most = torch.tensor([APPLIED_GAIN] * 3 + [APPLIED_ADDED] * 3)[:, None, None]
    return lambda features: model(features[:, channels]).clamp(-most, most)


@reported
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--features", help="folder of `bouncelight dataset --motion`, to be made one file of pairs")
    source.add_argument("--pairs", help="such a file: prints by how much the light of the first guess and of --weights changes")
    parser.add_argument("--out", help="the .npz to write")
    parser.add_argument("--weights", type=lambda text: text.split(","), default=[], help="weights files, with commas between")
    parser.add_argument("--rooms", type=indices, help="take these rooms only")
    a = parser.parse_args(arguments)
    if a.features:
        if not a.out:
            parser.error("--features needs --out")
        print(json.dumps(build(a.features, a.out, a.rooms), indent=1))
        return
    pairs = Pairs(a.pairs)
    print(f"{len(pairs)} pairs; mean |change of E| along motion vectors over mean E")
    print(f"{flicker(pairs):8.3%}  gather")
    for path in a.weights:
        print(f"{flicker(pairs, network_of(path)):8.3%}  {path}")


if __name__ == "__main__":
    main()
