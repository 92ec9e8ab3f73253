"""Fits a network to one scene: samples, pairs, training and export in one command.

    python -m bouncelight_training.finetune --bouncelight FILE --scene FILE --out mine.safetensors [--init small.safetensors]
                                            [--views 40] [--spp 64] [--minutes 5] [--size 1024x512] [--work DIR]

`bouncelight dataset` scatters views through the scene and traces their light; the network starts from a weights file (the shipped
`small` if none is named) and learns them. A few views are learnt too well after a while, so the weights that did best on other views
are kept; yet others are held out, and their error before and after is what is printed at the end. Both have four times the samples. --views, --spp and --size are what time goes into: on a slow machine start with
`--views 12 --spp 32 --size 512x256`. Everything is kept in the work folder, and the same command goes on where it was stopped.
"""
import argparse
import json
import os
import signal
import subprocess
import sys

import numpy as np
import torch

from . import data, train
from .data import Split
from .errors import TrainingError, reported
from .export import export
from .features import APPLIED_ADDED, APPLIED_GAIN, SLICES
from .losses import pooled_error
from .model import ANSWER, LEAK
from .weights import WeightsError, read, unet

SHIPPED = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "assets", "weights", "small.safetensors")
# Views that choose, views that are held out, both against those that are learnt; and how much finer their light is traced.
CHOOSING, HELD_OUT, FINER = 0.1, 0.2, 4


def shape_of(path):
    """(widths, pointwise, features) of a weights file's network, which must be a U-Net of this package."""
    try:
        _, doc = read(path)
    except (OSError, WeightsError) as error:
        raise TrainingError(f"{path}: cannot start from it: {error}") from error
    convolutions = {op["name"]: op for op in doc["graph"] if op["op"] == "conv2d"}
    widths = []
    while (first := f"{f'down{len(widths)}' if widths else 'enc0'}.a") in convolutions:
        widths.append(convolutions[first]["out_channels"])
    pointwise = sum(convolutions.get(f"up{i}.conv", {}).get("kernel") == [1, 1] for i in range(len(widths)))
    channels = sum(feature["channels"] for feature in doc["inputs"])
    if not widths or unet(channels, tuple(widths), ANSWER, pointwise, {"leaky_relu": LEAK})[0] != doc["graph"]:
        raise TrainingError(f"{path}: cannot start from it: its network is not one of this package's U-Nets; name another --init")
    return tuple(widths), pointwise, tuple(feature["name"] for feature in doc["inputs"])


def draw(program, scene, folder, views, spp, seed, size):
    """Samples of a scene by the program; those that exist are kept."""
    command = [program, "dataset", "--recipe", "scene", "--scene", scene, "--views", str(views), "--seed", str(seed), "--spp", str(spp), "--size", size, "--out", folder]
    print(" ".join(command), file=sys.stderr, flush=True)
    try:
        code = subprocess.run(command, stdout=subprocess.DEVNULL).returncode
    except OSError as error:
        raise TrainingError(f"{program}: {error}; build it with cargo build --release") from error
    if code:
        raise TrainingError(f"{program} dataset ended with code {code}; the same command goes on where it stopped")


def applied_error(model, split, channels):
    """The pooled error of the light as the program makes it of a network's answer; without a network, of the first guess."""
    above = below = 0.0
    with torch.no_grad():
        for i in range(len(split)):
            features = torch.from_numpy(split.features[i:i + 1].astype(np.float32))
            light = torch.expm1(features[:, SLICES["guess"]])
            if model is not None:
                answer = model(features[:, channels])
                light = light * torch.exp(answer[:, :3].clamp(-APPLIED_GAIN, APPLIED_GAIN)) + answer[:, 3:].clamp(-APPLIED_ADDED, APPLIED_ADDED)
            s = float(split.scale[i])
            difference, total = pooled_error(light.clamp(min=0) * s, torch.from_numpy(split.target[i:i + 1]).float() * s, torch.from_numpy(split.mask[i:i + 1]))
            above, below = above + difference, below + total
    return above / max(below, 1e-20)


def finetune(program, scene, out, work, init=SHIPPED, views=40, spp=64, minutes=5.0, size="1024x512", seed=1, epochs=0, **settings):
    """Does it all; returns what is printed. With `epochs` these are counted instead of minutes (for tests)."""
    widths, pointwise, features = shape_of(init)
    paths = {}
    others = [(name, max(round(share * views), 2), FINER * spp, seed + 1 + i) for i, (name, share) in enumerate((("choosing", CHOOSING), ("held-out", HELD_OUT)))]
    for name, count, samples, drawn_by in [("train", views, spp, seed), *others]:
        folder = os.path.join(work, f"{name}-{count}-{samples}-{drawn_by}-{size}")
        draw(program, scene, folder, count, samples, drawn_by, size)
        paths[name] = os.path.join(work, f"{name}.npz")
        data.build(folder, None, paths[name])
    config = train.Config(train=paths["train"], validation=paths["choosing"], keep_best=1, widths=widths, pointwise=pointwise, features=features, init=init, apart="view",
                          epochs=epochs or 1, minutes=0.0 if epochs else minutes, seed=seed,
                          **{"batch": 2, "learning_rate": 5e-4, "warmup_steps": 20, "ema": 0.99, "picture_l1": 0.1} | settings)
    held_out, channels = Split(paths["held-out"]), train.channels_of(features)
    data.check_apart(Split(paths["train"]), held_out, "view")
    before = train.network(config)
    train.start_from(before, init)
    folder = os.path.join(work, "run")
    run = train.train(config, folder)
    told = export(folder, out, kind="f16", name=f"fitted to {os.path.splitext(os.path.basename(scene))[0]}", targets=f"bouncelight's path tracer, {spp} samples a cell")
    errors = {"first guess": applied_error(None, held_out, channels), "before": applied_error(before.eval(), held_out, channels),
              "after": applied_error(run.averaged(), held_out, channels)}
    return {"file": out, "views": len(run.train), "samples_seen": run.samples(), "minutes": round(run.elapsed / 60, 1), "held_out_views": len(held_out),
            "held_out_error": {name: round(value, 5) for name, value in errors.items()}, "largest_difference": told["largest_difference"]}


@reported
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bouncelight", default="target/release/bouncelight", help="the program")
    parser.add_argument("--scene", required=True, help="a scene file, or the name of a bundled scene")
    parser.add_argument("--out", required=True, help="the weights file to write")
    parser.add_argument("--work", help="folder for samples and the run; default: beside the weights file")
    parser.add_argument("--init", default=SHIPPED, help="weights file to start from; default: the shipped small")
    parser.add_argument("--views", type=int, default=40)
    parser.add_argument("--spp", type=int, default=64, help="samples for each cell")
    parser.add_argument("--size", default="1024x512", help="of the rasterised picture; the network has a quarter of it")
    parser.add_argument("--minutes", type=float, default=5.0, help="of training; drawing the samples comes before it")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=0)
    a = parser.parse_args(arguments)
    if a.views < 1 or a.spp < 1 or a.minutes <= 0:
        raise TrainingError("--views, --spp and --minutes must be above 0")
    for s in (signal.SIGINT, signal.SIGTERM):
        signal.signal(s, lambda *_: train.STOPPING.append(True))
    work = a.work or os.path.splitext(a.out)[0] + "_work"
    os.makedirs(work, exist_ok=True)
    try:
        told = finetune(a.bouncelight, a.scene, a.out, work, a.init, a.views, a.spp, a.minutes, a.size, a.seed, threads=a.threads)
    except train.Stop:
        print(f"stopped; the same command continues (state in {work})", file=sys.stderr)
        sys.exit(130)
    print(json.dumps(told, indent=1))
    error = told["held_out_error"]
    print(f"held-out error, mean |dE| / mean E as the program applies it: first guess {error['first guess']:.2%}, before {error['before']:.2%}, after {error['after']:.2%}")
    if error["after"] >= error["before"]:
        print("the scene's views did not get better; more --views or --minutes, or keep the network that you had", file=sys.stderr)


if __name__ == "__main__":
    main()
