"""One process of test_distributed: takes STEPS steps of the run that ARGUMENTS (JSON) describe; the first one keeps what came out.

    torchrun --nproc_per_node=2 one_step.py ARGUMENTS FOLDER STEPS OUT
"""
import json
import os
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import torch  # noqa: E402
from bouncelight_training import train  # noqa: E402


def main(config, folder, steps, out):
    torch.set_num_threads(1)
    run = train.train(train.Config(**config), folder, stop_after=steps)
    if run.world.first:
        torch.save({"gradient": {n: p.grad for n, p in run.model.named_parameters()}, "model": dict(run.model.state_dict()), "samples": run.samples()}, out)
    run.world.leave()


if __name__ == "__main__":
    main(json.loads(sys.argv[1]), sys.argv[2], int(sys.argv[3]), sys.argv[4])
