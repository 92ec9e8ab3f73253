"""Trains a generator of the paper's kind.

    python -m bouncelight_training.pix2pix.train --views data/rooms --run runs/paper [--network pix2pix|gathered|deep-illumination] [--width 16] [--steps 20000]
                                                 [--adversarial published|described] [--norm group|instance|batch]

`published` is what the authors' program does: the generator's step hands the discriminator a copy without gradient, so the adversarial
term trains nothing and the generator learns an L1 regression; the discriminator is left out, which changes no number of the generator. `described` is
what their text says: binary cross-entropy of the discriminator's answer + 100 times the L1 of pictures in [-1, 1]. One picture a step, Adam, betas 0.5 and 0.999.

What is ours: a step sees a window of a picture (--crop), whole pictures in the last part of the run (--whole); the learning rate falls to nothing over the
second half; weights are averaged (--average), and the averages are validated and exported; red, green and blue change places at random (--permute 0: they stay),
since rooms are as likely in other colours.

Everything lands in the run's folder: config.json, checkpoint.pt, log.csv, loss.png, validation.png. The same command goes on where a
killed run stopped, with the same bits as without the interruption: what a step sees and what dropout drops depend on seed and step
alone. A run at its end goes on with more --steps. Validation is without dropout.
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
from .examples import Examples
from .model import NETWORKS, NORMS, Discriminator, first_numbers, generator

FIELDS = ["step", "seconds", "train_l1", "adversarial", "discriminator", "validation_l1", "validation_psnr"]
ADVERSARIAL = ("published", "described")


@dataclasses.dataclass
class Config:
    """What a run is made of."""

    views: str = ""  # folders of pix2pix.views, between commas
    network: str = "pix2pix"
    width: int = 64  # channels after the first step down
    discriminator_width: int = 0  # 0: as the generator
    norm: str = "group"
    adversarial: str = "published"
    l1: float = 100.0
    steps: int = 20000
    learning_rate: float = 2e-4
    beta1: float = 0.5
    beta2: float = 0.999
    average: float = 0.999  # share of the averaged weights that a step keeps; 0: no averages
    crop: str = "512x256"  # width and height of a window, multiples of 256 where nothing is to be padded
    whole: float = 0.25  # share of the run, at its end, that sees whole pictures
    permute: int = 1
    every: int = 10  # every so many views validate
    seed: int = 1
    threads: int = 0  # 0: torch's choice
    device: str = "cpu"
    log_steps: int = 500  # a line of the log, with validation, after so many steps
    validate: int = 12  # views that are validated then; all at the end
    checkpoint_seconds: float = 120.0


# What may differ between a run's first command and the one that continues it.
FREE = {"views", "threads", "device", "checkpoint_seconds"}
# What may differ, too, once the run is at its end: it goes on, the learning rate rises and falls again.
AT_THE_END = {"steps", "whole", "learning_rate"}


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
            words += ["--" + field.name.replace("_", "-"), ",".join(os.path.basename(part) for part in str(value).split(","))]
    return " ".join(words)


class Run:
    """The networks, their optimisers and the progress of one run, and how they are kept on disk."""

    def __init__(self, config, folder, examples):
        self.config, self.folder, self.examples = config, folder, examples
        self.crop = tuple(map(int, config.crop.split("x")))
        torch.manual_seed(config.seed)
        if config.threads:
            torch.set_num_threads(config.threads)
        self.device, self.commit = torch.device(config.device), commit()
        make = lambda: generator(config.width, config.norm, config.network).to(self.device, memory_format=torch.channels_last)
        self.generator = make()
        self.averaged = make()
        load(self.averaged, self.generator.state_dict())
        self.networks = {"generator": self.generator, "averaged": self.averaged}
        trained = [self.generator]
        if config.adversarial == "described":
            self.discriminator = first_numbers(Discriminator(config.discriminator_width or config.width)).to(self.device, memory_format=torch.channels_last)
            self.networks["discriminator"] = self.discriminator
            trained.append(self.discriminator)
        self.optimisers = [torch.optim.Adam(m.parameters(), lr=config.learning_rate, betas=(config.beta1, config.beta2)) for m in trained]
        self.step, self.elapsed, self.rows, self.sums = 0, 0.0, [], [0.0] * 4
        # Commands of which this one was gone on with at their ends.
        self.before = []

    @property
    def checkpoint_path(self):
        return os.path.join(self.folder, "checkpoint.pt")

    def save(self):
        """Writes checkpoint.pt whole: a kill leaves the old one or the new one."""
        state = {"config": dataclasses.asdict(self.config), **{name: dict(network.state_dict()) for name, network in self.networks.items()},
                 "optimisers": [o.state_dict() for o in self.optimisers], "step": self.step, "elapsed": self.elapsed, "rows": self.rows, "sums": self.sums,
                 "command": command_of(self.config, self.folder), "before": self.before, "commit": self.commit, "machine": machine_of(self.device), "report": self.examples.report}
        torch.save(state, self.checkpoint_path + ".part")
        os.replace(self.checkpoint_path + ".part", self.checkpoint_path)

    def load(self):
        """Continues from checkpoint.pt if there is one."""
        if not os.path.exists(self.checkpoint_path):
            return
        state = read_checkpoint(self.checkpoint_path)
        ours = dataclasses.asdict(self.config)
        free = FREE | AT_THE_END if state["step"] >= state["config"]["steps"] else FREE
        differ = [k for k in ours if k not in free and ours[k] != state["config"].get(k)]
        if differ:
            raise TrainingError(f"{self.checkpoint_path} was made with another {differ[0]} ({state['config'].get(differ[0])}, now {ours[differ[0]]}); use another --run")
        if state["report"] != self.examples.report:
            raise TrainingError(f"{self.checkpoint_path} was trained on other views than {self.config.views}; use another --run")
        for name, network in self.networks.items():
            load(network, state[name])
        for optimiser, values in zip(self.optimisers, state["optimisers"]):
            optimiser.load_state_dict(values)
        self.step, self.elapsed, self.rows, self.sums = state["step"], state["elapsed"], state["rows"], state["sums"]
        further = any(ours[k] != state["config"].get(k) for k in AT_THE_END)
        self.before = state["before"] + [state["command"]] if further else state["before"]
        print(f"continues at step {self.step} ({self.elapsed / 60:.1f} min used)", file=sys.stderr)

    @property
    def progress(self):
        """0 at the start, 1 at the end."""
        return self.step / self.config.steps

    def example(self):
        """What this step sees: index, pictures and target. It follows from seed and step alone."""
        epoch, at = divmod(self.step, len(self.examples.train))
        index = int(np.random.default_rng((self.config.seed, epoch)).permutation(self.examples.train)[at])
        rng, window = np.random.default_rng((self.config.seed, self.step, 1)), None
        (height, width), (w, h) = self.examples.size(index), self.crop
        if self.progress < 1 - self.config.whole:
            y, x = (int(rng.integers(max(length - part, 0) + 1)) for length, part in ((height, h), (width, w)))
            window = (slice(y, y + h), slice(x, x + w))
        order = rng.permutation(3) if self.config.permute else (0, 1, 2)
        return index, *self.on_device(self.examples.example(index, window, order))

    def on_device(self, arrays):
        return (torch.from_numpy(a).to(self.device, memory_format=torch.channels_last) for a in arrays)

    def losses(self, pictures, target):
        """(adversarial or None, L1, generator's loss, its picture) of the generator's step."""
        fake = self.generator.padded(pictures)
        l1 = nn.functional.l1_loss(fake, target)
        if self.config.adversarial == "published":
            return None, l1, self.config.l1 * l1, fake
        answer = self.discriminator(fake, pictures[:, :12])
        adversarial = nn.functional.binary_cross_entropy_with_logits(answer, torch.ones_like(answer))
        return adversarial, l1, adversarial + self.config.l1 * l1, fake

    def train_step(self):
        """One picture."""
        begun = time.monotonic()
        index, pictures, target = self.example()
        torch.manual_seed((self.config.seed << 32) + self.step)
        for optimiser in self.optimisers:
            optimiser.param_groups[0]["lr"] = self.config.learning_rate * min(1.0, 2 * (1 - self.progress))
        self.generator.train()
        adversarial, l1, loss, fake = self.losses(pictures, target)
        self.optimisers[0].zero_grad(set_to_none=True)
        loss.backward()
        self.check("generator's loss", loss, index)
        self.optimisers[0].step()
        told = [l1.item(), 0.0, 0.0, 1.0]
        if adversarial is not None:
            told[1:3] = adversarial.item(), self.discriminator_step(pictures[:, :12], target, fake.detach(), index)
        self.step += 1
        self.average()
        self.sums = [a + b for a, b in zip(self.sums, told)]
        self.elapsed += time.monotonic() - begun

    def discriminator_step(self, four, target, fake, index):
        self.optimisers[1].zero_grad(set_to_none=True)
        real, made = self.discriminator(target, four), self.discriminator(fake, four)
        cross_entropy = nn.functional.binary_cross_entropy_with_logits
        judged = 0.5 * (cross_entropy(real, torch.ones_like(real)) + cross_entropy(made, torch.zeros_like(made)))
        judged.backward()
        self.check("discriminator's loss", judged, index)
        self.optimisers[1].step()
        return judged.item()

    def average(self):
        """The first steps count less, so that the averages do not remember the first numbers."""
        keep = min(self.config.average, self.step / (self.step + 10)) if self.config.average else 0.0
        with torch.no_grad():
            for mean, now in zip(self.averaged.state_dict().values(), self.generator.state_dict().values()):
                mean.lerp_(now, 1 - keep)

    def check(self, what, loss, index):
        """Raises TrainingError where a loss is not a number."""
        if not math.isfinite(loss.item()):
            raise TrainingError(f"the {what} is {loss.item()} at step {self.step} ({self.examples.names[index]}); the last checkpoint is kept; "
                                "lower the learning rate or look at this view")

    def finish(self, draw, last):
        """Validates, logs and saves."""
        part = self.examples.validation
        scores, predicted = validate(self.averaged, self.examples, part if last else part[:: -(-len(part) // self.config.validate)], self.device)
        l1, adversarial, judged, n = self.sums
        n = max(n, 1.0)
        self.rows.append({"step": self.step, "seconds": round(self.elapsed, 1), "train_l1": l1 / n, "adversarial": adversarial / n, "discriminator": judged / n, **scores})
        self.sums = [0.0] * 4
        self.save()
        write_log(self.rows, os.path.join(self.folder, "log.csv"))
        curves.losses(self.rows, os.path.join(self.folder, "loss.png"))
        if draw:
            title = f"{self.config.network}, width {self.config.width}: {self.step} pictures seen, {self.elapsed / 60:.0f} min on {self.config.threads or torch.get_num_threads()} threads"
            curves.validation(self.examples, predicted, os.path.join(self.folder, "validation.png"), title)
        print(f"step {self.step} ({self.elapsed / 60:.1f} min): training L1 {l1 / n:.4f}, validation L1 {scores['validation_l1']:.4f}, {scores['validation_psnr']:.2f} dB", file=sys.stderr, flush=True)


def validate(model, examples, part, device="cpu", draw=4):
    """L1 in [-1, 1] and mean PSNR of the finished 8-bit pictures, without dropout; and the pictures that are drawn."""
    model.eval()
    predicted, sums = {}, np.zeros(2)
    with torch.no_grad():
        for i in map(int, part):
            pictures, target = (torch.from_numpy(a).to(device, memory_format=torch.channels_last) for a in examples.example(i))
            made = model.padded(pictures)
            picture = as_shown(made)
            error = np.square((picture.astype(np.float32) - examples.target(i)) / 255).mean()
            sums += (nn.functional.l1_loss(made, target).item(), -10 * math.log10(max(float(error), 1e-10)))
            if len(predicted) < draw:
                predicted[i] = picture
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
    examples = Examples(config.views, config.network, config.every)
    os.makedirs(folder, exist_ok=True)
    run = Run(config, folder, examples)
    run.load()
    with open(os.path.join(folder, "config.json"), "w") as file:
        json.dump(dataclasses.asdict(config), file, indent=1)
    count = sum(p.numel() for p in run.generator.parameters())
    print(f"{count} parameters; {len(examples.train)} training and {len(examples.validation)} validation views", file=sys.stderr, flush=True)
    saved, begun, drawn = time.monotonic(), run.step, 0.0
    while run.progress < 1:
        run.train_step()
        last = run.progress >= 1
        if run.step % config.log_steps == 0 or last:
            draw = last or time.monotonic() - drawn > 60
            run.finish(draw, last)
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
        choices = {"adversarial": ADVERSARIAL, "norm": NORMS, "network": tuple(NETWORKS)}.get(field.name)
        parser.add_argument("--" + field.name.replace("_", "-"), type=type(field.default), default=field.default, choices=choices, help=f"default {field.default}")
    a = vars(parser.parse_args(arguments))
    folder = a.pop("run")
    config = Config(**a)
    if not config.views:
        raise TrainingError("--views is missing: folders made by python -m bouncelight_training.pix2pix.views")
    for s in (signal.SIGINT, signal.SIGTERM):
        signal.signal(s, lambda *_: STOPPING.append(True))
    try:
        train(config, folder)
    except Stop:
        print(f"stopped; the same command continues (state in {folder})", file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    main()
