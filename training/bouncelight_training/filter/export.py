"""Writes a run's best network as a weights file that bouncelight loads, and reads it back.

    python -m bouncelight_training.filter.export --run runs/NAME --out NAME.safetensors [--name TEXT]
"""
import argparse
import datetime
import json
import os

from ..errors import TrainingError, reported
from ..model import parameter_count
from ..weights import GraphNet, WeightsError, document, verify, write
from . import blur, samples
from .train import MEANING, Config, read_checkpoint


def export(run, out, name=""):
    """Writes the file, half floats, and its provenance beside it; returns a summary."""
    state = read_checkpoint(os.path.join(run, "checkpoint.pt"))
    config = Config(**{k: tuple(v) if isinstance(v, list) else v for k, v in state["config"].items()} | {"device": "cpu"})
    error, average = state["best"]
    model = GraphNet(state["graph"], state["output"])
    model.load_state_dict(average)
    model.eval()
    words = [f"--{k} {','.join(map(str, v)) if isinstance(v, tuple) else v}" for k, v in vars(config).items() if v != getattr(Config(), k) and k not in ("train", "validation")]
    folders = ",".join(os.path.basename(os.path.normpath(f)) for f in config.train.split(","))
    about = {
        "command": f"python -m bouncelight_training.filter.train --train {folders} --validation {os.path.basename(os.path.normpath(config.validation))} {' '.join(words)}",
        "commit": state["commit"], "date": datetime.date.today().isoformat(), "device": state["machine"], "seed": config.seed,
        "samples_seen": state["step"] * config.batch, "training_minutes": round(state["seconds"] / 60, 1),
        "validation_error": {"measure": "mean |dE| / mean E of cells, all moments, the targets' noise included", "value": round(error, 5), "gather": round(state["rows"][0]["gather_error"], 5)},
    }
    tensors = {k: v.half().contiguous() for k, v in model.state_dict().items()}
    try:
        write(out, tensors, document(model.graph, model.output, inputs=samples.TABLE, table=("cells", 2), meaning=MEANING, output_channels=blur.GUIDANCE,
                                     name=name or os.path.basename(os.path.normpath(run)), provenance=about))
    except (WeightsError, OSError) as problem:
        raise TrainingError(str(problem)) from problem
    worst = verify(out, model, 2e-2)
    with open(os.path.splitext(out)[0] + ".json", "w") as file:
        json.dump(about, file, indent=1)
        file.write("\n")
    return {"file": out, "bytes": os.path.getsize(out), "parameters": parameter_count(model), "largest_difference": worst, **about["validation_error"]}


@reported
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", required=True)
    parser.add_argument("--out", required=True)
    parser.add_argument("--name", default="", help="a few words; default: the run's name")
    a = parser.parse_args(arguments)
    print(json.dumps(export(a.run, a.out, a.name), indent=1))


if __name__ == "__main__":
    main()
