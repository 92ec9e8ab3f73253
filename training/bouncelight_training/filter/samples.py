"""What `bouncelight dataset --moments` writes: one safetensors file a view (crates/lab/src/study/moments.rs)."""
import concurrent.futures
import functools
import glob
import multiprocessing
import os

import numpy as np
import torch
from safetensors import SafetensorError
from safetensors.numpy import load_file

from ..errors import TrainingError
from .blur import ATROUS_STRIDE, WIDE_BLUR_FRAMES

# Table `cells`, version 2 (src/gi/neural/memory.rs).
TABLE = [("light", 1), ("chroma", 2), ("deviation", 1), ("history_length", 1), ("fast_history", 1), ("hit_proximity", 1), ("depth", 1), ("normal", 3), ("hit", 1), ("dominant_direction", 3)]
CHANNELS = sum(n for _, n in TABLE)
# Cosine between two normals above which a cell's two pixels are taken for one surface.
SAME_NORMAL = 0.9
# Root mean square error of a cell's target over the picture's mean above which the picture teaches nothing.
MOST_NOISE = 2.0
# Views from which on it is worth starting processes to read them.
MANY = 64
FIELDS = ("features", "light", "square", "x", "n", "frames", "strictness", "nearness", "shown", "target", "mask")


def unpack_normals(bits):
    """[h,w] words of two signed 16-bit numbers to [3,h,w] unit normals (`oct_decode` of shaders/lib/octahedral.wgsl)."""
    words = np.ascontiguousarray(bits).view(np.uint32)
    low, high = (words & 0xFFFF).astype(np.uint16).view(np.int16), (words >> 16).astype(np.uint16).view(np.int16)
    x, y = (np.clip(v.astype(np.float32) / 32767, -1, 1) for v in (low, high))
    z = 1 - np.abs(x) - np.abs(y)
    t = np.maximum(-z, 0)
    n = np.stack([x - np.where(x >= 0, t, -t), y - np.where(y >= 0, t, -t), z])
    return n / np.maximum(np.linalg.norm(n, axis=0), 1e-20)


def within_reach(cells):
    """Of cells [h,w] all whose filter's last step asks one of them, 5x5 in strides."""
    h, w = cells.shape
    around = np.pad(cells, 2 * ATROUS_STRIDE)
    return np.any([around[y:y + h, x:x + w] for y in range(0, 4 * ATROUS_STRIDE + 1, ATROUS_STRIDE) for x in range(0, 4 * ATROUS_STRIDE + 1, ATROUS_STRIDE)], axis=0)


class Sample:
    """One moment of one view, as arrays of one picture: `features` [15,h,w], `light`, `x`, `n` [3,h,w], `frames`, `square`, `strictness`,
    `nearness` [h,w]; what is to be learnt, `target` [3,h,w], and where (`mask` [h,w]); `shown` [3,h,w]: what `gather` itself shows."""

    def __init__(self, file, when, name):
        self.name, self.when = name, when
        past = file[f"past.{when}"].astype(np.float32)
        n = unpack_normals(file[f"past.{when}"][11])
        frames = past[3]
        foot, eye, ahead = file["view"][0], file["view"][1:4], file["view"][4:7]
        z = np.einsum("c,chw->hw", ahead, past[8:11] - eye[:, None, None])
        shown = file[f"shown.{when}"]
        self.shown = np.maximum(np.stack([shown[4 * c + 3] + (shown[4 * c:4 * c + 3] * n).sum(0) for c in range(3)]), 0)
        self.strictness = 1 / (0.5 * foot * np.maximum(z, 1e-9))
        self.features, self.light, self.square, self.x, self.n, self.frames = file[f"features.{when}"], past[0:3], past[7], past[8:11], n, frames
        self.target, self.noise, self.base = file["light"], float(file["noise"][0]), 0.0
        # Halves of a word: roughness, nearness.
        self.nearness = (np.ascontiguousarray(file[f"past.{when}"][15]).view(np.uint32) >> 16).astype(np.uint16).view(np.float16)
        self.age = float(file[f"age.{when}"][0])
        # Where light has changed the filter shows that of lately, and asks no network.
        # After a pan another pixel may stand for a cell than in the still pictures that the light is of.
        same = np.abs(((file["place"][:3] - past[8:11]) * n).sum(0)) * self.strictness < 1
        same &= (unpack_normals(file["place"][3]) * n).sum(0) > SAME_NORMAL
        self.mask = (frames > 0) & np.isfinite(self.target).all(0) & same & ~within_reach(file[f"changed.{when}"][0] > 0)
        for field in ("features", "light", "square", "x", "n", "frames", "strictness", "nearness", "shown", "target"):
            setattr(self, field, np.ascontiguousarray(np.nan_to_num(getattr(self, field), posinf=0, neginf=0), np.float32))
        self.x = self.x * (self.frames > 0)
        # `gather` lacks some of the light in its first frames, or has too much. A filter cannot mend that, and is not to
        # learn to count bright cells for more: what is learnt is where light is, not how much there is in all.
        self.target = self.target * np.float32((self.shown * self.mask).sum() / max((self.target * self.mask).sum(), 1e-20))
        self.mean = float((self.target * self.mask).sum() / max(3 * self.mask.sum(), 1))


def all_of(path):
    """Every moment of a view."""
    try:
        file = load_file(path)
        moments = [name.split(".")[1] for name in file if name.startswith("past.")]
        return [Sample(file, when, os.path.basename(path).removesuffix(".safetensors")) for when in moments]
    except (OSError, SafetensorError, KeyError) as error:
        raise TrainingError(f"{path}: not a sample of a filter: {error}; make it with bouncelight dataset --moments") from error


def moments_of(path, most_noise=MOST_NOISE):
    """The moments of a view that teach something: none of pictures without light, or with more noise than that."""
    return [sample for sample in all_of(path) if sample.mean > 1e-6 and sample.mask.mean() > 0.2 and sample.noise < most_noise]


def read(folder, every=1, most_noise=MOST_NOISE):
    """All moments of the views of a folder, or of one view in so many. Many views are read by as many processes as there are cores."""
    paths = sorted(glob.glob(os.path.join(folder, "*.safetensors")))[::every]
    if not paths:
        raise TrainingError(f"{folder}: no samples; make them with bouncelight dataset --moments")
    if len(paths) < MANY:
        return [sample for path in paths for sample in moments_of(path, most_noise)]
    # Forked, which is quick, since nothing of torch has run yet that has threads.
    with concurrent.futures.ProcessPoolExecutor(mp_context=multiprocessing.get_context("fork")) as pool:
        return [sample for samples in pool.map(functools.partial(moments_of, most_noise=most_noise), paths, chunksize=4) for sample in samples]


def stacked(samples, device="cpu"):
    """A batch: one tensor of every field; `narrow`: whether all of it is blurred narrowly."""
    batch = {field: torch.from_numpy(np.stack([getattr(sample, field) for sample in samples])).to(device) for field in FIELDS}
    for number in ("mean", "age", "noise", "base"):
        batch[number] = torch.tensor([getattr(sample, number) for sample in samples], dtype=torch.float32, device=device)
    return batch | {"narrow": all(is_narrow(sample) for sample in samples)}


def is_narrow(sample):
    """Whether the cells of a moment are blurred narrowly."""
    return sample.age > WIDE_BLUR_FRAMES


class Pile:
    """Moments of one size of pictures and one breadth of the blur, as tensors."""

    def __init__(self, samples, device="cpu"):
        self.samples, self.fields = samples, stacked(samples, device)
        self.based_on = None  # squares of cells over which the losses of `gather` are that it holds
        self.taught_by = None  # weights file whose light is mixed into its targets, and how much of it
        # Of each the moment that is its next frame by a still camera, -1 where there is none.
        places = {(sample.name, sample.age): i for i, sample in enumerate(samples) if sample.when.isdigit()}
        self.later = np.array([places.get((sample.name, sample.age + 1), -1) if sample.when.isdigit() else -1 for sample in samples])

    def taken(self, which, window=None):
        """The moments of these numbers; `window`: of them rows and columns from a place on, (y, x, side), or what there is."""
        index = torch.as_tensor(which, device=self.fields["mean"].device)
        batch = {k: v if isinstance(v, bool) else v[index] for k, v in self.fields.items()}
        if window:
            y, x, side = window
            batch = {k: v[..., y:y + side, x:x + side] if torch.is_tensor(v) and v.dim() > 1 else v for k, v in batch.items()}
        return batch


def piles(samples, device="cpu"):
    """All samples, by size and breadth."""
    kinds = sorted({(sample.mask.shape, is_narrow(sample)) for sample in samples})
    return [Pile([v for v in samples if (v.mask.shape, is_narrow(v)) == kind], device) for kind in kinds]
