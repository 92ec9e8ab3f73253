"""Trains the paper's generator against its discriminator.

    python -m bouncelight_training.pix2pix.train --pairs pairs.npz --run runs/paper [--width 16] [--minutes 45] [--adversarial published|described]

Loss of the generator: binary cross-entropy of the discriminator's answer + 100 times the L1 of pictures in [-1, 1]; Adam, 2e-4,
betas 0.5 and 0.999, one picture a step. `published` is what the authors' program does: the generator's step hands the discriminator a
copy without gradient, so the adversarial term trains nothing and the generator learns an L1 regression. `described` is what their
text says: the gradient flows.

Everything lands in the run's folder: config.json, checkpoint.pt, log.csv, loss.png, validation.png. The same command goes on where a
killed run stopped, with the same bits as without the interruption: the order of pictures and what dropout drops depend on seed and step
alone. Pictures whose sides are no multiples of 256 are padded as the program pads them. Validation is without dropout.
"""
import argparse
import csv
import dataclasses
import json
import math
import os
import signal
import sys
import time

import numpy as np
import torch
from torch import nn

from ..checkpoint import Stop, read_checkpoint
from ..errors import TrainingError, reported
from ..provenance import commit, machine_of
from . import curves
from .model import NORMS, Discriminator, first_numbers, generator
from .pairs import Pairs

FIELDS = ["step", "epoch", "samples", "seconds", "train_l1", "adversarial", "discriminator", "validation_l1", "validation_psnr"]
ADVERSARIAL = ("published", "described")


@dataclasses.dataclass
class Config:
    """What a run is made of."""

    pairs: str = ""
    width: int = 64  # channels after the first step down
    discriminator_width: int = 0  # 0: as the generator
    norm: str = "group"
    adversarial: str = "published"
    l1: float = 100.0
    epochs: int = 200
    minutes: float = 0.0  # 0: as many epochs as above; else until this much training time is used
    learning_rate: float = 2e-4
    beta1: float = 0.5
    beta2: float = 0.999
    seed: int = 1
    threads: int = 0  # 0: torch's choice
    device: str = "cpu"
    log_steps: int = 500  # a line of the log, with validation, after so many steps
    checkpoint_seconds: float = 120.0


# What may differ between a run's first command and the one that continues it.
FREE = {"pairs", "epochs", "minutes", "threads", "device", "checkpoint_seconds"}


def load(module, tensors):
    """Copies numbers by name; every one must be there."""
    own = module.state_dict()
    if set(own) != set(tensors):
        raise TrainingError(f"the checkpoint's network is another: {sorted(set(own) ^ set(tensors))[0]}")
    with torch.no_grad():
        for name, values in own.items():
            values.copy_(tensors[name])


def command_of(config, folder):
    """The command that makes this run; of paths the last part only."""
    words = ["python -m bouncelight_training.pix2pix.train", "--run", os.path.basename(os.path.normpath(folder))]
    for field in dataclasses.fields(Config):
        value = getattr(config, field.name)
        if value != field.default:
            words += ["--" + field.name.replace("_", "-"), os.path.basename(str(value))]
    return " ".join(words)


class Run:
    """Both networks, their optimisers and the progress of one run, and how they are kept on disk."""

    def __init__(self, config, folder, pairs):
        self.config, self.folder, self.pairs = config, folder, pairs
        self.train, self.validation, self.test = pairs.split(config.seed)
        for name, part in (("training", self.train), ("validation", self.validation)):
            if not len(part):
                raise TrainingError(f"{pairs.path}: no {name} view is left after the split by room; give more rooms")
        torch.manual_seed(config.seed)
        if config.threads:
            torch.set_num_threads(config.threads)
        self.device, self.commit = torch.device(config.device), commit()
        self.generator = generator(config.width, config.norm).to(self.device)
        self.discriminator = first_numbers(Discriminator(config.discriminator_width or config.width)).to(self.device)
        self.optimisers = [torch.optim.Adam(m.parameters(), lr=config.learning_rate, betas=(config.beta1, config.beta2)) for m in (self.generator, self.discriminator)]
        self.step, self.elapsed, self.rows, self.sums = 0, 0.0, [], [0.0] * 4

    @property
    def checkpoint_path(self):
        return os.path.join(self.folder, "checkpoint.pt")

    def save(self):
        """Writes checkpoint.pt whole: a kill leaves the old one or the new one."""
        rooms = {name: sorted(set(map(int, self.pairs.room[part]))) for name, part in (("train", self.train), ("validation", self.validation), ("test", self.test))}
        state = {"config": dataclasses.asdict(self.config), "generator": dict(self.generator.state_dict()), "discriminator": dict(self.discriminator.state_dict()),
                 "optimisers": [o.state_dict() for o in self.optimisers], "step": self.step, "elapsed": self.elapsed, "rows": self.rows, "sums": self.sums,
                 "command": command_of(self.config, self.folder), "commit": self.commit, "machine": machine_of(self.device), "report": self.pairs.report, "rooms": rooms}
        torch.save(state, self.checkpoint_path + ".part")
        os.replace(self.checkpoint_path + ".part", self.checkpoint_path)

    def load(self):
        """Continues from checkpoint.pt if there is one."""
        if not os.path.exists(self.checkpoint_path):
            return
        state = read_checkpoint(self.checkpoint_path)
        ours = dataclasses.asdict(self.config)
        differ = [k for k in ours if k not in FREE and ours[k] != state["config"].get(k)]
        if differ:
            raise TrainingError(f"{self.checkpoint_path} was made with another {differ[0]} ({state['config'].get(differ[0])}, now {ours[differ[0]]}); use another --run")
        if state["report"] != self.pairs.report:
            raise TrainingError(f"{self.checkpoint_path} was trained on other pairs than {self.pairs.path}; use another --run")
        load(self.generator, state["generator"])
        load(self.discriminator, state["discriminator"])
        for optimiser, values in zip(self.optimisers, state["optimisers"]):
            optimiser.load_state_dict(values)
        self.step, self.elapsed, self.rows, self.sums = state["step"], state["elapsed"], state["rows"], state["sums"]
        print(f"continues at step {self.step} ({self.elapsed / 60:.1f} min used)", file=sys.stderr)

    @property
    def epoch(self):
        return self.step // len(self.train)

    def progress(self):
        """0 at the start, 1 at the end."""
        if self.config.minutes:
            return self.elapsed / (60 * self.config.minutes)
        return self.step / (self.config.epochs * len(self.train))

    def on_device(self, index):
        return (torch.from_numpy(a).to(self.device) for a in self.pairs.tensors(index))

    def losses(self, four, target):
        """(adversarial, L1, generator's loss, its picture) of the generator's step."""
        fake = self.generator.padded(four)
        seen = fake if self.config.adversarial == "described" else fake.detach()
        answer = self.discriminator(seen, four)
        adversarial = nn.functional.binary_cross_entropy_with_logits(answer, torch.ones_like(answer))
        l1 = nn.functional.l1_loss(fake, target)
        return adversarial, l1, adversarial + self.config.l1 * l1, fake

    def train_step(self):
        """One picture; which one, and what dropout drops, follows from seed and step alone."""
        begun = time.monotonic()
        index = int(np.random.default_rng((self.config.seed, self.epoch)).permutation(self.train)[self.step % len(self.train)])
        torch.manual_seed((self.config.seed << 32) + self.step)
        four, target = self.on_device(index)
        self.generator.train()
        adversarial, l1, loss, fake = self.losses(four, target)
        self.optimisers[0].zero_grad(set_to_none=True)
        loss.backward()
        self.check("generator's loss", loss, index)
        self.optimisers[0].step()

        self.optimisers[1].zero_grad(set_to_none=True)
        real, made = self.discriminator(target, four), self.discriminator(fake.detach(), four)
        cross_entropy = nn.functional.binary_cross_entropy_with_logits
        judged = 0.5 * (cross_entropy(real, torch.ones_like(real)) + cross_entropy(made, torch.zeros_like(made)))
        judged.backward()
        self.check("discriminator's loss", judged, index)
        self.optimisers[1].step()
        self.step += 1
        self.sums = [a + b for a, b in zip(self.sums, (l1.item(), adversarial.item(), judged.item(), 1.0))]
        self.elapsed += time.monotonic() - begun

    def check(self, what, loss, index):
        """Raises TrainingError where a loss is not a number."""
        if not math.isfinite(loss.item()):
            raise TrainingError(f"the {what} is {loss.item()} at step {self.step} (room {self.pairs.room[index]} view {self.pairs.view[index]}); the last checkpoint is kept; "
                                "lower the learning rate or look at this view")

    def finish(self, draw):
        """Validates, logs and saves."""
        scores, predicted = validate(self.generator, self.pairs, self.validation, self.device)
        l1, adversarial, judged, n = self.sums
        n = max(n, 1.0)
        row = {"step": self.step, "epoch": self.epoch, "samples": self.step, "seconds": round(self.elapsed, 1), "train_l1": l1 / n, "adversarial": adversarial / n,
               "discriminator": judged / n, **scores}
        self.rows.append(row)
        self.sums = [0.0] * 4
        self.save()
        write_log(self.rows, os.path.join(self.folder, "log.csv"))
        curves.losses(self.rows, os.path.join(self.folder, "loss.png"))
        if draw:
            curves.validation(self.pairs, predicted, os.path.join(self.folder, "validation.png"),
                              f"{self.step} pictures seen, validation PSNR {row['validation_psnr']:.2f} dB")
        print(f"step {self.step:6}  {self.elapsed / 60:6.1f} min  train L1 {row['train_l1']:.4f}  discriminator {row['discriminator']:.3f}  validation L1 "
              f"{row['validation_l1']:.4f}  PSNR {row['validation_psnr']:.2f}", file=sys.stderr, flush=True)


def validate(model, pairs, part, device="cpu", draw=4):
    """L1 in [-1, 1] and mean PSNR of the finished 8-bit pictures, without dropout; and the pictures that are drawn, one a room."""
    model.eval()
    first = {}
    for i in part:
        first.setdefault(int(pairs.room[i]), int(i))
    drawn, predicted, sums = list(first.values())[:draw], {}, np.zeros(2)
    with torch.no_grad():
        for i in part:
            four, target = (torch.from_numpy(a).to(device) for a in pairs.tensors(i))
            made = model.padded(four)
            picture = as_shown(made)
            error = np.square((picture.astype(np.float32) - pairs.target[i]) / 255).mean()
            sums += (nn.functional.l1_loss(made, target).item(), -10 * math.log10(max(float(error), 1e-10)))
            if int(i) in drawn:
                predicted[int(i)] = picture
    l1, psnr = sums / len(part)
    return {"validation_l1": float(l1), "validation_psnr": float(psnr)}, predicted


def as_shown(output):
    """Bytes [h,w,3] of the network's answer [1,3,h,w], as `bouncelight apply` writes them."""
    picture = (output[0].permute(1, 2, 0).cpu().numpy() + 1) / 2
    return np.floor(picture.clip(0, 1) * 255 + 0.5).astype(np.uint8)


def write_log(rows, path):
    with open(path + ".part", "w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS)
        writer.writeheader()
        writer.writerows(rows)
    os.replace(path + ".part", path)


def train(config, folder, stop_after=None):
    """Runs to the end (or for `stop_after` steps, for tests) and returns the Run."""
    pairs = Pairs(config.pairs)
    os.makedirs(folder, exist_ok=True)
    run = Run(config, folder, pairs)
    run.load()
    with open(os.path.join(folder, "config.json"), "w") as file:
        json.dump(dataclasses.asdict(config), file, indent=1)
    count = sum(p.numel() for p in run.generator.parameters())
    print(f"{count} parameters; {len(run.train)} training, {len(run.validation)} validation and {len(run.test)} test views of {pairs.report['size'][0]}x{pairs.report['size'][1]}",
          file=sys.stderr, flush=True)
    saved, begun, drawn = time.monotonic(), run.step, 0.0
    while run.progress() < 1:
        run.train_step()
        last = run.progress() >= 1
        if run.step % config.log_steps == 0 or last:
            draw = last or time.monotonic() - drawn > 60
            run.finish(draw)
            saved, drawn = time.monotonic(), time.monotonic() if draw else drawn
        elif time.monotonic() - saved > config.checkpoint_seconds:
            run.save()
            saved = time.monotonic()
        if stop_after is not None and run.step - begun >= stop_after:
            break
        if STOPPING:
            run.save()
            raise Stop
    return run


STOPPING = []


@reported
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", required=True, help="folder of the run; continued if it has a checkpoint")
    for field in dataclasses.fields(Config):
        choices = {"adversarial": ADVERSARIAL, "norm": NORMS}.get(field.name)
        parser.add_argument("--" + field.name.replace("_", "-"), type=type(field.default), default=field.default, choices=choices, help=f"default {field.default}")
    a = vars(parser.parse_args(arguments))
    folder = a.pop("run")
    config = Config(**a)
    if not config.pairs:
        raise TrainingError("--pairs is missing: the .npz made by python -m bouncelight_training.pix2pix.pairs")
    for s in (signal.SIGINT, signal.SIGTERM):
        signal.signal(s, lambda *_: STOPPING.append(True))
    try:
        train(config, folder)
    except Stop:
        print(f"stopped; the same command continues (state in {folder})", file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    main()
