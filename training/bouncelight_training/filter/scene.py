"""Fits the network that guides `gather`'s filter to one scene: samples, training and export in one command.

    python -m bouncelight_training.filter.scene --bouncelight FILE --scene FILE --out mine.safetensors [--begin filter.safetensors]
                                                [--views 24] [--spp 64] [--minutes 2] [--size 512x256] [--work DIR] [-- --environment 0.5 ...]

`bouncelight dataset` scatters views through the scene and keeps what cells remember at several moments; the network begins with a weights
file (the shipped `filter` if none is named) and learns them for some minutes. Weights are kept that did best on other views, those that it
began with included; yet others are held out, and their error before and after is what is printed at the end. Flags after `--` say how the
scene is lit (`--environment`, `--light-radius`). Everything is kept in the work folder, and the same command goes on where it was stopped.
"""
import argparse
import copy
import json
import os
import subprocess
import sys

from ..errors import TrainingError, reported
from . import export, samples, train

SHIPPED = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "..", "assets", "weights", "filter.safetensors")
MOMENTS = "1,2,4,8,pan,20"
# Views that choose and views that are held out, against those that are learnt.
CHOOSING, HELD_OUT = 1 / 6, 1 / 4


def draw(program, scene, folder, views, spp, seed, size, lit):
    """Samples of a scene by the program; those that exist are kept."""
    command = [program, "dataset", "--recipe", "scene", "--scene", scene, "--views", str(views), "--seed", str(seed), "--spp", str(spp),
               "--size", size, "--moments", MOMENTS, "--out", folder, *lit]
    print(" ".join(command), file=sys.stderr, flush=True)
    try:
        code = subprocess.run(command, stdout=subprocess.DEVNULL).returncode
    except OSError as error:
        raise TrainingError(f"{program}: {error}; build it with cargo build --release") from error
    if code:
        raise TrainingError(f"{program} dataset ended with code {code}; the same command goes on where it stopped")


def fit(program, scene, out, work, begin=SHIPPED, views=24, spp=64, minutes=2.0, size="512x256", seed=1, lit=(), **settings):
    """Does it all; returns what is printed."""
    before = train.network_of(begin)
    folders = {}
    for i, (name, count) in enumerate((("train", views), ("choosing", max(round(CHOOSING * views), 2)), ("held-out", max(round(HELD_OUT * views), 2)))):
        folders[name] = os.path.join(work, f"{name}-{count}-{spp}-{seed + i}-{size}")
        draw(program, scene, folders[name], count, spp, seed + i, size, lit)
    config = train.Config(train=folders["train"], validation=folders["choosing"], begin=begin, minutes=minutes, seed=seed,
                          **{"batch": 8, "learning_rate": 3e-4, "ema": 0.99} | settings)
    # Views of one scene are told apart by their seeds.
    run = train.train(config, os.path.join(work, "run"), same_names=True)
    held_out = samples.piles(samples.read(folders["held-out"]), config.device)
    after = copy.deepcopy(before)
    after.load_state_dict(run.best[1])
    errors = [train.validate(model.to(config.device).eval(), held_out, run.channels, run.parts) for model in (before, after)]
    told = export.export(os.path.join(work, "run"), out, f"fitted to {os.path.splitext(os.path.basename(scene))[0]}")
    moments = {key.removesuffix(" network"): [round(v, 5) for v in (errors[0][f"{key.removesuffix(' network')} gather"], errors[0][key], errors[1][key])]
               for key in errors[0] if key.endswith(" network")}
    return {"file": out, "views": views, "samples_seen": run.step * config.batch, "minutes": round(run.seconds / 60, 1),
            "held_out_error": {"columns": ["gather", "before", "after"], **moments}, "largest_difference": told["largest_difference"]}


@reported
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--bouncelight", default="target/release/bouncelight", help="the program")
    parser.add_argument("--scene", required=True, help="a scene file, or the name of a bundled scene")
    parser.add_argument("--out", required=True, help="the weights file to write")
    parser.add_argument("--work", help="folder for samples and the run; default: beside the weights file")
    parser.add_argument("--begin", default=SHIPPED, help="weights file to begin with; default: the shipped filter")
    parser.add_argument("--views", type=int, default=24)
    parser.add_argument("--spp", type=int, default=64, help="rays a cell of the light to be learnt")
    parser.add_argument("--size", default="512x256", help="of the rasterised picture; the network has a quarter of it")
    parser.add_argument("--minutes", type=float, default=2.0, help="of training; drawing the samples comes before it")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("lit", nargs="*", help="flags of `bouncelight dataset` that say how the scene is lit, after --")
    a = parser.parse_args(arguments)
    if a.views < 1 or a.spp < 1 or a.minutes <= 0:
        raise TrainingError("--views, --spp and --minutes must be above 0")
    work = a.work or os.path.splitext(a.out)[0] + "_work"
    os.makedirs(work, exist_ok=True)
    told = fit(a.bouncelight, a.scene, a.out, work, a.begin, a.views, a.spp, a.minutes, a.size, a.seed, a.lit, threads=a.threads, device=a.device)
    print(json.dumps(told, indent=1))
    gather, before, after = told["held_out_error"]["all"]
    print(f"held-out error, mean |dE| / mean E: gather {gather:.2%}, before {before:.2%}, after {after:.2%}")
    if after >= before:
        print("the scene's views did not get better; more --views or --minutes, or keep the network that you had", file=sys.stderr)


if __name__ == "__main__":
    main()
