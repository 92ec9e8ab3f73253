"""Pairs rasterised features with path-traced light, and keeps the pairs of one split in one .npz.

    python -m bouncelight_training.data --features DIR --out train.npz [--rooms 6-9,13]                 light traced by bouncelight
    python -m bouncelight_training.data --features DIR --cycles DIR --out train.npz [--rooms 6-9,13]    light rendered by Cycles
    ... --denoise                                                                                       and denoised (pip install pyoidn)
    python -m bouncelight_training.data --join rooms.npz,varied.npz --out train.npz                     several of these as one

FEATURES/roomIIII_viewV.safetensors (or variedIIII_viewV, or SCENE_viewV) is what `bouncelight dataset` writes. With `--spp N` it traces the
light at the very points that the cells look at, and nothing has to be left out but the background.

Otherwise CYCLES/roomIIII_viewV.exr comes from cycles/paper_rooms.py, that of a scene from cycles/scene_file.py. The target is the light that a GI method must add, as E/pi: Cycles' DiffDir (which holds the sky's light) + DiffInd
minus our own direct light, so whatever our direct light gets wrong is not charged to the network twice. With --denoise both layers go
through Intel's Open Image Denoise together, guided by albedo and normal: 32 samples a pixel then lie 1.5 % from 320 samples instead of 5 %
(cell by cell; 0.8 instead of 1.2 % after 4x4 pooling), so that what is left to learn is not nine tenths noise.

The raster has one sample point a cell; Cycles' pixel is a filtered mean over about the cell. Where the two cannot be the
same thing, the cell is left out of the loss, for the first of these reasons that holds:

    background  nothing was hit at the sample point
    spread      depth varies by more than 5 % inside the cell: a silhouette
    normal      the sample's normal and Cycles' filtered one differ by more than 10 degrees, or the latter is shorter than 0.95
    depth       the depths differ by more than 10 % (Cycles' depth is one random point of the pixel)
    albedo      the albedos differ by more than 0.05: a border between materials on one plane
    shadow      our direct light varies in the 3x3 neighbourhood (of cells that pass so far) by more than 10 % of its maximum
    negative    the target is below -(2 % of s + 5 % of direct light): shadows disagree. Smaller negatives stay in: they
                are noise, and cutting noise off on one side would make the network too bright.
"""
import argparse
import json
import os
import re
import sys
import zlib

import numpy as np
import OpenEXR
from safetensors.numpy import load_file

from .archive import load, save
from .errors import TrainingError, reported
from .features import CHANNELS, LUMINANCE, SLICES
from .stream import indices as indices_in_order, is_judged

REASONS = ["background", "spread", "normal", "depth", "albedo", "shadow", "negative"]
MAX_SPREAD, MIN_COSINE, MIN_LENGTH = 0.05, float(np.cos(np.radians(10))), 0.95
MAX_DEPTH_RATIO, MAX_ALBEDO, MAX_VARIATION = 1.1, 0.05, 0.10
COLUMNS = ("features", "target", "mask", "scale", "room", "view")
NAME = re.compile(r"(?:(room|varied)(\d{4,})|(.+))_view(\d+)\.(safetensors|exr)$")


class Dark(TrainingError):
    """A view without any light."""


def number_of(match):
    """A number for the room or scene of a file's name, so that splits hold for all of them: rooms of the stream have their own, all
    others one below zero."""
    if match[1]:
        return int(match[2]) if match[1] == "room" else -1 - int(match[2])
    return -1_000_000 - zlib.crc32(match[3].encode()) % 1_000_000_000


def refuse_judged(rooms):
    """Raises TrainingError when a room is one that is kept for judging."""
    kept = sorted(r for r in set(map(int, rooms)) if is_judged(r))
    if kept:
        raise TrainingError(f"rooms {kept} are kept for judging and must not be trained or tuned on; remove them from the folder or pass --rooms")


def denoised(light, albedo, normal):
    """Light [3,h,w] without its path-tracing noise, guided by albedo and normal of the same shape."""
    try:
        import pyoidn
    except ImportError as error:
        raise TrainingError(f"--denoise needs Open Image Denoise: pip install pyoidn ({error})") from error
    image = lambda a: np.ascontiguousarray(np.moveaxis(a, 0, -1), np.float32)
    result = pyoidn.denoise(image(light), albedo=image(np.clip(albedo, 0, 1)), normal=image(normal), hdr=True)
    return np.ascontiguousarray(np.moveaxis(np.asarray(result), -1, 0))


def read_cycles(path, denoise=False):
    """Layers of a Cycles EXR with Y up: diff_dir, diff_ind, diff_col, normal [3,h,w], depth [h,w]; float32. With `denoise` diff_dir holds
    the denoised sum of both, and diff_ind is 0."""
    try:
        with OpenEXR.File(path, separate_channels=True) as file:
            pixels = {name: channel.pixels.astype(np.float32) for name, channel in file.channels().items()}
    except (OSError, RuntimeError, ValueError) as error:
        raise TrainingError(f"{path}: not a readable EXR: {error}") from error

    def layer(name, channels):
        missing = [f"ViewLayer.{name}.{c}" for c in channels if f"ViewLayer.{name}.{c}" not in pixels]
        if missing:
            raise TrainingError(f"{path}: no layer {missing[0]}; render it with cycles/paper_rooms.py")
        return np.stack([pixels[f"ViewLayer.{name}.{c}"] for c in channels])

    x, y, z = layer("Normal", "XYZ")
    out = {"diff_dir": layer("DiffDir", "RGB"), "diff_ind": layer("DiffInd", "RGB"), "diff_col": layer("DiffCol", "RGB"),
           "normal": np.stack([x, z, -y]), "depth": layer("Depth", "Z")[0]}
    for name, values in out.items():
        if not np.isfinite(values).all():
            raise TrainingError(f"{path}: {name} holds {np.count_nonzero(~np.isfinite(values))} values that are not finite; render the view again")
    if denoise:
        out["diff_dir"] = denoised(out["diff_dir"] + out["diff_ind"], out["diff_col"], np.stack([x, y, z]))
        out["diff_ind"] = np.zeros_like(out["diff_ind"])
    return out


def read_features(path):
    """Tensors of a feature file, float32; shapes and finiteness checked."""
    try:
        tensors = {name: values.astype(np.float32) for name, values in load_file(path).items()}
    except Exception as error:  # safetensors raises its own type for every defect
        raise TrainingError(f"{path}: not a readable safetensors file: {error}") from error
    h, w = tensors["features"].shape[-2:] if "features" in tensors and tensors["features"].ndim == 3 else (0, 0)
    expected = {"features": (CHANNELS, h, w), "scale": (1,), "direct": (3, h, w), "albedo": (3, h, w), "normal": (3, h, w), "depth": (h, w)}
    for name, shape in expected.items():
        if name not in tensors:
            raise TrainingError(f"{path}: no tensor {name}; write it again with `bouncelight dataset`")
        if tensors[name].shape != shape:
            raise TrainingError(f"{path}: tensor {name} has shape {tensors[name].shape}, expected {shape}")
        if not np.isfinite(tensors[name]).all():
            raise TrainingError(f"{path}: tensor {name} holds {np.count_nonzero(~np.isfinite(tensors[name]))} values that are not finite")
    if "light" in tensors and (tensors["light"].shape != (3, h, w) or not np.isfinite(tensors["light"]).all()):
        raise TrainingError(f"{path}: tensor light has shape {tensors['light'].shape} or values that are not finite; make the sample again")
    if tensors["scale"][0] <= 0:
        raise Dark(f"{path}: scale is {tensors['scale'][0]}; a picture without any light teaches nothing, leave it out")
    return tensors


def neighbourhood(a, reduce, padding):
    """`reduce` (np.maximum or np.minimum) over the 3x3 neighbourhood of [h,w]."""
    padded = np.pad(a, 1, constant_values=padding)
    h, w = a.shape
    out = a
    for dy in range(3):
        for dx in range(3):
            out = reduce(out, padded[dy:dy + h, dx:dx + w])
    return out


def own(raster):
    """As `pair`, with the light that bouncelight traced."""
    hit = (raster["features"][SLICES["hit"]][0] > 0.5) & (raster["depth"] > 0)
    counts = dict.fromkeys(REASONS, 0) | {"background": int((~hit).sum())}
    return raster["light"] / float(raster["scale"][0]), hit, counts


def pair(raster, cycles):
    """The target E/pi in units of s [3,h,w], the mask [h,w] and how many cells each reason took."""
    s = float(raster["scale"][0])
    target = cycles["diff_dir"] + cycles["diff_ind"] - raster["direct"]
    hit = (raster["features"][SLICES["hit"]][0] > 0.5) & (raster["depth"] > 0)
    length = np.linalg.norm(cycles["normal"], axis=0)
    cosine = (cycles["normal"] * raster["normal"]).sum(0) / np.maximum(length, 1e-6)
    ratio = np.abs(np.log(np.maximum(raster["depth"], 1e-6) / np.maximum(cycles["depth"], 1e-6)))
    rejected = [
        ~hit,
        raster["features"][SLICES["spread"]][0] > MAX_SPREAD,
        (cosine < MIN_COSINE) | (length < MIN_LENGTH),
        ratio > np.log(MAX_DEPTH_RATIO),
        np.abs(cycles["diff_col"] - raster["albedo"]).max(0) > MAX_ALBEDO,
    ]
    inside = ~np.any(rejected, axis=0)
    direct = np.tensordot(LUMINANCE, raster["direct"], 1)
    highest = neighbourhood(np.where(inside, direct, 0), np.maximum, 0)
    lowest = neighbourhood(np.where(inside, direct, np.inf), np.minimum, np.inf)
    rejected.append(inside & (highest - lowest > MAX_VARIATION * highest) & (highest > 0.01 * s))
    rejected.append((target < -(0.02 * s + 0.05 * direct)).any(0))
    mask = np.ones_like(hit)
    counts = {}
    for reason, cells in zip(REASONS, rejected):
        counts[reason] = int((mask & cells).sum())
        mask &= ~cells
    return target / s, mask, counts


def pairs_of(features_dir, cycles_dir, rooms):
    """The views to be paired: list of (room, view, feature path, EXR path or None)."""
    found = {}
    folders = [(features_dir, "safetensors")] + ([(cycles_dir, "exr")] if cycles_dir else [])
    for folder, extension in folders:
        if not os.path.isdir(folder):
            raise TrainingError(f"{folder}: no such folder")
        for name in os.listdir(folder):
            match = NAME.fullmatch(name)
            if not match or match[5] != extension:
                continue
            room = number_of(match)
            if rooms is None or room in rooms:
                found.setdefault((room, int(match[4])), {})[extension] = os.path.join(folder, name)
    pairs = [(room, view, paths["safetensors"], paths.get("exr")) for (room, view), paths in sorted(found.items()) if len(paths) == len(folders)]
    if not pairs:
        raise TrainingError(f"{' and '.join(f for f, _ in folders)} share no view roomIIII_viewV or SCENE_viewV")
    alone = len(found) - len(pairs)
    if alone:
        print(f"{alone} views are in one of the folders only and are left out", file=sys.stderr)
    refuse_judged(room for room, *_ in pairs)
    return pairs


def build(features_dir, cycles_dir, out, rooms=None, denoise=False):
    """Writes the split's cache and returns the mask report. Arrays: features f16 [n,24,h,w], target f16 [n,3,h,w] in units
    of s, mask bool [n,h,w], scale f32 [n], room and view i32 [n], report (JSON text)."""
    pairs = pairs_of(features_dir, cycles_dir, rooms)
    columns = {key: [] for key in COLUMNS}
    totals = dict.fromkeys(REASONS, 0)
    for room, view, feature_path, exr_path in pairs:
        try:
            raster = read_features(feature_path)
        except Dark as error:
            print(f"left out: {error}", file=sys.stderr)
            continue
        if exr_path is None and "light" not in raster:
            raise TrainingError(f"{feature_path} holds no traced light; make it with --spp, or pass --cycles")
        cycles = exr_path and read_cycles(exr_path, denoise)
        if cycles and raster["depth"].shape != cycles["depth"].shape:
            raise TrainingError(f"{feature_path} has {raster['depth'].shape} cells, {exr_path} {cycles['depth'].shape} pixels; both must be the same")
        target, mask, counts = pair(raster, cycles) if cycles else own(raster)
        if mask.mean() < 0.1:
            print(f"warning: {feature_path}: only {mask.mean():.1%} of the cells can be trusted; {counts}", file=sys.stderr)
        for reason in REASONS:
            totals[reason] += counts[reason]
        values = (raster["features"].astype(np.float16), target.astype(np.float16), mask, raster["scale"][0], room, view)
        for key, value in zip(columns, values):
            columns[key].append(value)
    if not columns["room"]:
        raise TrainingError(f"{features_dir}: no view in it has any light")
    kinds = {"scale": np.float32, "room": np.int32, "view": np.int32}
    arrays = {key: np.asarray(value, kinds.get(key)) for key, value in columns.items()}
    return save(out, arrays, summarise(arrays, totals) | {"denoised": denoise})


def join(paths, out):
    """Writes several splits as one and returns its report, which holds theirs as `parts`. No view may be in two of them."""
    splits = [Split(path) for path in paths]
    shapes = {split.features.shape[1:] for split in splits}
    if len(shapes) > 1:
        raise TrainingError(f"{', '.join(paths)}: views of different sizes: {sorted(shapes)}")
    arrays = {key: np.concatenate([getattr(split, key) for split in splits]) for key in COLUMNS}
    views = list(zip(arrays["room"].tolist(), arrays["view"].tolist()))
    twice = sorted({view for view in views if views.count(view) > 1})
    if twice:
        raise TrainingError(f"{', '.join(paths)}: room {twice[0][0]} view {twice[0][1]} is in two of them")
    totals = {reason: sum(split.report["rejected"].get(reason, 0.0) * split.report["cells"] for split in splits) for reason in REASONS}
    return save(out, arrays, summarise(arrays, totals) | {"parts": [split.report for split in splits]})


def summarise(arrays, totals):
    """What a log and a weights file say about a split."""
    cells = arrays["mask"].size
    mask = arrays["mask"]
    lit = np.moveaxis(arrays["target"], 1, -1)[mask].astype(np.float32)
    return {"views": len(mask), "rooms": sorted(map(int, set(arrays["room"]))), "cells": cells, "kept": float(mask.mean()),
            "rejected": {reason: n / cells for reason, n in totals.items()},
            "target_over_s_mean": lit.mean(0).tolist(), "target_negative": float((lit < 0).mean())}


class Split:
    """A split in memory: the arrays of `build`, and the report as a dictionary."""

    def __init__(self, path):
        arrays, self.report = load(path, COLUMNS, "data")
        self.path = path
        self.features, self.target, self.mask = arrays["features"], arrays["target"], arrays["mask"]
        self.scale, self.room, self.view = arrays["scale"], arrays["room"], arrays["view"]
        refuse_judged(self.room)
        for name in ("features", "target", "scale"):
            for i, values in enumerate(arrays[name]):
                if not np.isfinite(values).all():
                    raise TrainingError(f"{path}: {name} of room {self.room[i]} view {self.view[i]} holds values that are not finite")

    def __len__(self):
        return len(self.mask)


def check_apart(train, validation, apart="room"):
    """Raises TrainingError when a room is in both splits. With `apart` "view" they may share a scene, but no view of it."""
    if apart not in ("room", "view"):
        raise TrainingError(f"splits are apart by room or by view, not by {apart}")
    if apart == "view":
        same = [int(v) for i, v in enumerate(validation.view) if any(np.array_equal(validation.features[i], train.features[k]) for k in range(len(train)))]
        if same:
            raise TrainingError(f"views {same} of {validation.path} are in {train.path}, too; draw them with another seed")
        return
    both = sorted(set(map(int, train.room)) & set(map(int, validation.room)))
    if both:
        raise TrainingError(f"rooms {both} are in {train.path} and in {validation.path}; split by room")


def indices(text):
    """Room numbers of "6-9,13"."""
    return set(indices_in_order(text))


@reported
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    source = parser.add_mutually_exclusive_group(required=True)
    source.add_argument("--features", help="folder of `bouncelight dataset`")
    source.add_argument("--join", type=lambda text: text.split(","), help="files that this command made, with commas between")
    parser.add_argument("--cycles", help="folder of cycles/paper_rooms.py; absent: the light that `bouncelight dataset --spp` traced")
    parser.add_argument("--out", required=True, help="the .npz to write")
    parser.add_argument("--rooms", type=indices, help="take these rooms only")
    parser.add_argument("--denoise", action="store_true", help="take the noise out of Cycles' light first")
    a = parser.parse_args(arguments)
    if a.denoise and not a.cycles:
        parser.error("--denoise is for Cycles' pictures; bouncelight traces light at sample points, which are no picture")
    if a.rooms:
        refuse_judged(a.rooms)
    if a.join and (a.cycles or a.rooms):
        parser.error("--join takes files as they are, without --cycles and --rooms")
    report = join(a.join, a.out) if a.join else build(a.features, a.cycles, a.out, a.rooms, a.denoise)
    print(json.dumps(report, indent=1))


if __name__ == "__main__":
    main()
