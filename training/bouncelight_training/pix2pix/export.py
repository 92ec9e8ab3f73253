"""Writes the generator of a run as a weights file that `bouncelight apply` takes, and proves that it says the same.

    python -m bouncelight_training.pix2pix.export --run runs/paper --out paper.safetensors [--pairs pairs.npz] [--half] [--targets TEXT] [--state state.safetensors]

The file is read back, its own graph is run on validation views and on odd sizes, and the outputs are compared with the network in the
checkpoint. Provenance stands in the file and, for people, beside it as paper.json. `--state` also writes the state dict with the
published keys, which `bouncelight weights convert --arch pix2pix` takes.
"""
import argparse
import datetime
import json
import os

import numpy as np
import torch

from ..checkpoint import read_checkpoint
from ..errors import TrainingError, reported
from ..weights import GraphNet, WeightsError, document, read, write
from .model import PICTURES, generator
from .pairs import Pairs
from .train import Config, load, validate

TARGETS = "Cycles 4.5, 256x128, 32 samples a pixel, not denoised"
# Sums in another order; half floats, through sixteen layers and a tangent (docs/internals/network.md).
TOLERANCE, TOLERANCE_HALF = 1e-4, 2e-2
ODD_SIZES = [(37, 21), (256, 256)]


def generator_of(state):
    """The generator of a checkpoint, without dropout."""
    config = Config(**state["config"])
    model = generator(config.width, config.norm)
    load(model, state["generator"])
    return model.eval()


def provenance(state, scores, targets):
    """Where the numbers come from; paths are reduced to file names."""
    config = dict(state["config"], pairs=os.path.basename(state["config"]["pairs"]))
    adversarial = {"published": "the generator's step sees the discriminator's answer without gradient: an L1 regression", "described": "the gradient flows"}
    return {"recipe": "Harris-Dewey and Klein 2021 (arXiv 2110.12039), generator and discriminator of their published code", "adversarial": adversarial[config["adversarial"]],
            "command": state["command"], "commit": state["commit"], "date": datetime.date.today().isoformat(), "device": state["machine"], "seed": config["seed"],
            "config": config, "samples_seen": state["step"], "training_minutes": round(state["elapsed"] / 60, 1),
            "data": {"inputs": f"bouncelight's rasteriser, 4 samples a pixel, Filmic, normals {state['report']['normals']}", "targets": targets,
                     "report": state["report"], "rooms": state["rooms"]},
            "validation": {"measure": "L1 of pictures in [-1, 1]; PSNR of 8-bit pictures, dB; without dropout", "l1": round(scores["validation_l1"], 5),
                           "psnr": round(scores["validation_psnr"], 3)},
            "last_lines": [{k: (round(v, 6) if isinstance(v, float) else v) for k, v in row.items()} for row in state["rows"][-5:]]}


def verify(path, model, tolerance, inputs):
    """Reads `path` back and runs its graph beside `model`. Returns the largest |difference| and the network read, or raises TrainingError."""
    try:
        tensors, doc = read(path)
    except WeightsError as error:
        raise TrainingError(str(error)) from error
    again = GraphNet(doc["graph"], doc["output"]["tensor"]).eval()
    load(again, {name: torch.from_numpy(values.astype(np.float32)) for name, values in tensors.items()})
    worst = 0.0
    with torch.no_grad():
        for x in inputs:
            worst = max(worst, (again.padded(x) - model.padded(x)).abs().max().item())
    if not worst <= tolerance:
        raise TrainingError(f"{path}: read back it gives y that differ by {worst:.2e}, allowed {tolerance:.0e}; the file is not what was trained")
    return worst, again


def export(run, out, pairs=None, half=False, targets=TARGETS, state_path=None):
    """Writes the file and its provenance; returns a summary."""
    state = read_checkpoint(os.path.join(run, "checkpoint.pt"))
    model, config = generator_of(state), Config(**state["config"])
    data = Pairs(pairs or config.pairs)
    part = [i for i, room in enumerate(data.room) if int(room) in state["rooms"]["validation"]]
    if not part:
        raise TrainingError(f"{data.path} has none of the run's validation rooms {state['rooms']['validation']}")
    scores = validate(model, data, part)[0]
    about = provenance(state, scores, targets)
    tensors = {name: (values.half() if half else values).contiguous() for name, values in model.state_dict().items()}
    try:
        if state_path:
            from safetensors.torch import save_file
            save_file({name: values.contiguous() for name, values in model.state_dict().items()}, state_path)
        write(out, tensors, document(model.graph, model.output, inputs=[(name, 3) for name in PICTURES], table=("images", 1), cell=1, meaning="display_signed", output_channels=3,
                                     name=f"pix2pix, width {config.width}", provenance=about))
    except (WeightsError, OSError) as problem:
        raise TrainingError(str(problem)) from problem
    random = torch.Generator().manual_seed(1)
    inputs = [torch.rand(1, 12, h, w, generator=random) * 2 - 1 for w, h in ODD_SIZES] + [torch.from_numpy(data.tensors(part[0])[0])]
    worst, again = verify(out, model, TOLERANCE_HALF if half else TOLERANCE, inputs)
    reread = validate(again, data, part)[0]
    with open(os.path.splitext(out)[0] + ".json", "w") as file:
        json.dump(about, file, indent=1)
        file.write("\n")
    return {"file": out, "bytes": os.path.getsize(out), "parameters": sum(p.numel() for p in model.parameters()), "samples_seen": state["step"],
            "largest_difference": worst, **scores, "of_file": reread}


@reported
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--pairs", help="default: those that the run used")
    parser.add_argument("--targets", default=TARGETS, help="how the pictures were path-traced, in words, for the provenance")
    parser.add_argument("--half", action="store_true", help="store half floats")
    parser.add_argument("--state", help="also write the state dict with the published keys here")
    a = parser.parse_args(arguments)
    print(json.dumps(export(a.run, a.out, a.pairs, a.half, a.targets, a.state), indent=1))


if __name__ == "__main__":
    main()
