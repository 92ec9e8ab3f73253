"""Writes a run's averaged weights as a weights file that bouncelight loads, and proves that it says the same.

    python -m bouncelight_training.export --run runs/NAME --out NAME.safetensors [--validation val.npz] [--name TEXT] [--half | --bytes]

A run with --quantise is stored as it was trained for.
The file is read back, its own graph is run on validation views and on odd sizes, and the outputs are compared with the
network in the checkpoint. Provenance stands in the file and, for people, beside it as NAME.json.
"""
import argparse
import datetime
import json
import os

import numpy as np
import torch

from . import quantise
from .data import Split
from .errors import TrainingError, reported
from .features import TABLE, channels_of
from .model import ANSWER, MEANING, flops, parameter_count
from .train import Config, network, read_checkpoint
from .validation import validate
from .weights import GraphNet, WeightsError, document, quantised, read, write

ODD_SIZES = [(37, 21), (5, 3), (1, 1)]
# Sums in another order differ by about 1e-6 in y; half floats move y by a few thousandths.
TOLERANCE, TOLERANCE_HALF = 1e-4, 2e-2
TARGETS = "Cycles 4.5, 256x128, 32 samples a pixel"


def network_of(state):
    """The network of a checkpoint with its averaged weights."""
    model = network(Config(**state["config"]))
    model.load_state_dict(state["average"])
    return model.eval()


def stored(model, kind):
    """The arrays of a file: f32, half floats, or bytes with scales."""
    if kind == "i8":
        return quantised({name: values.numpy() for name, values in model.state_dict().items()}, model.graph)
    return {name: (values.half() if kind == "f16" else values).contiguous() for name, values in model.state_dict().items()}


def drawn_halfway(model, path):
    """The network half-way between it and that of a weights file, weight by weight: a network that has learnt something new and the one it started
    from often lie in one valley, and between them is better at both (Wortsman et al. 2022). Whether it is must be measured."""
    try:
        tensors, doc = read(path)
    except (OSError, WeightsError) as error:
        raise TrainingError(f"{path}: {error}") from error
    state = model.state_dict()
    if {name: tuple(v.shape) for name, v in state.items()} != {name: tuple(v.shape) for name, v in tensors.items()}:
        raise TrainingError(f"{path}: its network is another one; only two of the same shape have a middle")
    model.load_state_dict({name: 0.5 * (values + torch.from_numpy(tensors[name].astype(np.float32))) for name, values in state.items()})
    return {"halfway_to": {"file": os.path.basename(path), "command": doc.get("provenance", {}).get("command", ""), "commit": doc.get("provenance", {}).get("commit", "")}}


def provenance(state, error, targets):
    """Where the numbers come from; paths are reduced to file names. `targets` says in words how the light was path-traced."""
    config = dict(state["config"])
    for name in ("train", "validation", "motion", "init"):
        config[name] = os.path.basename(config.get(name, ""))
    last = state["rows"][-10:]
    before = {}
    if state["config"].get("init"):
        try:
            before = {"started_from": {k: v for k, v in read(state["config"]["init"])[1].get("provenance", {}).items() if k != "last_epochs"}}
        except (WeightsError, OSError) as error:
            before = {"started_from": f"{config['init']}, which is gone: {error.__class__.__name__}"}
    return {**before,
        "command": state["command"], "commit": state["commit"], "date": datetime.date.today().isoformat(),
        "device": state["machine"], "seed": config["seed"], "config": config, "samples_seen": state["samples"],
        "training_minutes": round(state["elapsed"] / 60, 1),
        "data": {"targets": f"{targets}: DiffDir + DiffInd minus our direct light, as E/pi",
                 "train": state["train_report"], "validation": state["validation_report"], **({"motion": state["motion_report"]} if state.get("motion_report") else {})},
        "validation_error": {"measure": "mean |dE| / mean E after 4x4 pooling", "value": round(error, 5)},
        "last_epochs": [{k: (round(v, 6) if isinstance(v, float) else v) for k, v in row.items()} for row in last],
    }


def verify(path, model, tolerance, split=None):
    """Reads `path` back and runs its graph beside `model`. Returns the largest |difference| of y, or raises TrainingError."""
    try:
        tensors, doc = read(path)
    except WeightsError as error:
        raise TrainingError(str(error)) from error
    again = GraphNet(doc["graph"], doc["output"]["tensor"])
    again.load_state_dict({name: torch.from_numpy(values.astype(np.float32)) for name, values in tensors.items()})
    again.eval()
    generator = torch.Generator().manual_seed(1)
    channels = sum(feature["channels"] for feature in doc["inputs"])
    inputs = [torch.rand(1, channels, h, w, generator=generator) for w, h in ODD_SIZES]
    if split is not None:
        named = channels_of([feature["name"] for feature in doc["inputs"]])
        inputs += [torch.from_numpy(split.features[:1].astype(np.float32))[:, named]]
    worst = 0.0
    with torch.no_grad():
        for x in inputs:
            worst = max(worst, (again(x) - model(x)).abs().max().item())
    if not worst <= tolerance:
        raise TrainingError(f"{path}: read back it gives y that differ by {worst:.2e}, allowed {tolerance:.0e}; the file is not what was trained")
    return worst, again


def export(run, out, validation=None, name="", kind="", targets=TARGETS, halfway_to=""):
    """Writes the file and its provenance; returns a summary. `kind`: how numbers are stored, "" (as the run was trained), "f32", "f16" or "i8".
    `halfway_to`: a weights file, see `drawn_halfway`."""
    state = read_checkpoint(os.path.join(run, "checkpoint.pt"))
    model, config = network_of(state), Config(**state["config"])
    middle = drawn_halfway(model, halfway_to) if halfway_to else {}
    split, kind = Split(validation or config.validation), kind or config.quantise or "f32"
    exact = validate(model, split, config)[0]["validation_error"]
    tensors = stored(model, kind)
    # What the file says is compared with the network after the same rounding, except for half floats, whose file is held against the exact one.
    if kind == "i8" or config.quantise:
        quantise.round_(model, kind if kind != "f32" else "")
    error = validate(model, split, config)[0]["validation_error"]
    about = middle | provenance(state, error, targets)
    try:
        write(out, tensors, document(model.graph, model.output, inputs=[(n, c) for n, c in TABLE if n in config.features], meaning=MEANING, output_channels=ANSWER,
                                     name=name or os.path.basename(os.path.normpath(run)), provenance=about))
    except (WeightsError, OSError) as problem:
        raise TrainingError(str(problem)) from problem
    worst, again = verify(out, model, TOLERANCE_HALF if kind == "f16" and not config.quantise else TOLERANCE, split)
    reread = validate(again, split, config)[0]["validation_error"]
    with open(os.path.splitext(out)[0] + ".json", "w") as file:
        json.dump(about, file, indent=1)
        file.write("\n")
    return {"file": out, "bytes": os.path.getsize(out), "parameters": parameter_count(model), "gflop": flops(model, 128, 256) / 1e9,
            "largest_difference": worst, "stored": kind, "validation_error_unrounded": exact, "validation_error": error, "validation_error_of_file": reread}


@reported
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--validation", help="default: the one the run used")
    parser.add_argument("--name", default="", help="a few words; default: the run's name")
    parser.add_argument("--targets", default=TARGETS, help="how the light was path-traced, in words, for the provenance")
    parser.add_argument("--halfway-to", default="", help="a weights file of the same network: write the middle between it and the run's")
    kinds = parser.add_mutually_exclusive_group()
    kinds.add_argument("--half", dest="kind", action="store_const", const="f16", default="", help="store half floats")
    kinds.add_argument("--bytes", dest="kind", action="store_const", const="i8", help="store convolutions' weights as bytes with a scale for each output channel")
    a = parser.parse_args(arguments)
    print(json.dumps(export(a.run, a.out, a.validation, a.name, a.kind, a.targets, a.halfway_to), indent=1))


if __name__ == "__main__":
    main()
