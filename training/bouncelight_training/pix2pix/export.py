"""Writes the generator of a run as a weights file that `bouncelight apply` takes, and proves that it says the same.

    python -m bouncelight_training.pix2pix.export --run runs/paper --out generator.safetensors [--views data/rooms] [--stored f32|f16|i8] [--state state.safetensors]

The averaged weights are written. The file is read back, its own graph is run on validation views and on odd sizes, and the outputs are
compared with the network in the checkpoint; of bytes, which round to a percent, the pictures are (--stored i8: at most 0.2 dB are lost). Provenance stands
in the file and, for people, beside it as generator.json. `--state` also writes the state dict with the published keys, which `bouncelight weights convert
--arch pix2pix` takes.
"""
import argparse
import datetime
import json
import os

import numpy as np
import torch

from ..checkpoint import read_checkpoint
from ..errors import TrainingError, reported
from ..weights import GraphNet, WeightsError, document, quantised, read, write
from .examples import Examples
from .model import AROUND, NETWORKS, generator
from .train import Config, load, validate

# Sums in another order; half floats, through sixteen layers and a tangent (docs/internals/network.md).
TOLERANCE = {"f32": 1e-4, "f16": 2e-2, "i8": 2.0}
# dB of validation that bytes may cost.
LOST = 0.2
ODD_SIZES = [(37, 21), (256, 256)]


def generator_of(state):
    """The generator of a checkpoint, without dropout."""
    config = Config(**state["config"])
    model = generator(config.width, config.norm, config.network)
    load(model, state["averaged"])
    return model.eval()


def provenance(state, scores):
    """Where the numbers come from; paths are reduced to file names."""
    config = dict(state["config"], views=",".join(os.path.basename(os.path.normpath(part)) for part in state["config"]["views"].split(",")))
    adversarial = {"published": "the generator's step sees the discriminator's answer without gradient: an L1 regression", "described": "the gradient flows"}
    recipe = {"pix2pix": "Harris-Dewey and Klein 2021 (arXiv 2110.12039), generator of their published code",
              "gathered": "the generator of Harris-Dewey and Klein 2021, given the picture with the light of `gather` as well, which also goes around it",
              "deep-illumination": "Thomas and Forbes 2018, generator of their published code"}
    report = {key: value for key, value in state["report"].items() if key != "names"} | {"first_and_last": [state["report"]["names"][0], state["report"]["names"][-1]]}
    return {"recipe": recipe[config["network"]], "adversarial": adversarial[config["adversarial"]], "command": state["command"], "goes_on_from": state["before"], "commit": state["commit"],
            "date": datetime.date.today().isoformat(), "device": state["machine"], "seed": config["seed"], "config": config, "samples_seen": state["step"],
            "training_minutes": round(state["elapsed"] / 60, 1), "data": {"inputs": "bouncelight's rasteriser, Filmic, normals clamped", "report": report},
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
    widened = {name: values.astype(np.float32) for name, values in tensors.items() if not name.endswith("_scale")}
    for name, values in tensors.items():
        if name.endswith("_scale"):
            of = name.removesuffix("_scale")
            transposed = any(op["op"] == "conv_transpose2d" and op["name"] + ".weight" == of for op in doc["graph"])
            widened[of] *= values.reshape((1, -1, 1, 1) if transposed else (-1, 1, 1, 1))
    load(again, {name: torch.from_numpy(values) for name, values in widened.items()})
    worst = 0.0
    with torch.no_grad():
        for x in inputs:
            worst = max(worst, (again.padded(x) - model.padded(x)).abs().max().item())
    if not worst <= tolerance:
        raise TrainingError(f"{path}: read back it gives y that differ by {worst:.2e}, allowed {tolerance:.0e}; the file is not what was trained")
    return worst, again


def export(run, out, views=None, stored="f32", state_path=None):
    """Writes the file and its provenance; returns a summary."""
    state = read_checkpoint(os.path.join(run, "checkpoint.pt"))
    model, config = generator_of(state), Config(**state["config"])
    data = Examples(views or config.views, config.network, config.every)
    if data.report != state["report"]:
        raise TrainingError(f"{data.folders}: these are not the views that the run was trained on")
    scores = validate(model, data, data.validation)[0]
    about = provenance(state, scores)
    numbers = {name: values.contiguous() for name, values in model.state_dict().items()}
    pictures, encoding = NETWORKS[config.network]
    tensors = {name: (values.half() if stored == "f16" else values) for name, values in numbers.items()}
    if stored == "i8":
        # What goes around the network is to stay as it is.
        tensors = quantised({name: values.numpy() for name, values in numbers.items() if not name.startswith(AROUND)}, model.graph)
        tensors |= {name: values for name, values in numbers.items() if name.startswith(AROUND)}
    try:
        if state_path:
            from safetensors.torch import save_file
            save_file(numbers, state_path)
        write(out, tensors, document(model.graph, model.output, inputs=[(name, 3, encoding) for name in pictures], table=("images", 1), cell=1, meaning="display_signed", output_channels=3,
                                     name=f"{config.network}, width {config.width}", provenance=about))
    except (WeightsError, OSError) as problem:
        raise TrainingError(str(problem)) from problem
    random = torch.Generator().manual_seed(1)
    inputs = [torch.rand(1, 3 * len(pictures), h, w, generator=random) * 2 - 1 for w, h in ODD_SIZES] + [torch.from_numpy(data.example(int(data.validation[0]))[0])]
    worst, again = verify(out, model, TOLERANCE[stored], inputs)
    reread = validate(again, data, data.validation)[0]
    if not scores["validation_psnr"] - reread["validation_psnr"] <= LOST:
        raise TrainingError(f"{out}: stored as {stored} it has {reread['validation_psnr']:.2f} dB of {scores['validation_psnr']:.2f}; store it as f16")
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
    parser.add_argument("--views", help="default: those that the run used")
    parser.add_argument("--stored", choices=tuple(TOLERANCE), default="f32", help="numbers in the file")
    parser.add_argument("--state", help="also write the state dict with the published keys here")
    a = parser.parse_args(arguments)
    print(json.dumps(export(a.run, a.out, a.views, a.stored, a.state), indent=1))


if __name__ == "__main__":
    main()
