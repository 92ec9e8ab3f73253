"""Trains the compact U-Net on the CPU (or a GPU, with --device cuda).

    python -m bouncelight_training.train --train train.npz --validation val.npz --run runs/NAME [--minutes 25]
    torchrun --standalone --nproc_per_node=N -m bouncelight_training.train --folder runs/NAME …        on N processes, --batch pictures each

Everything lands in the run's folder: config.json, checkpoint.pt, log.csv, loss.png, validation.png. The same command goes
on where a killed run stopped; the order of pictures and their augmentation depend on the seed and the step alone, so without
--minutes the result is the same as without the interruption. With --minutes the learning rate follows the time used
instead of the steps done. Weights are averaged over steps (EMA); validation and export use the average.
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

from . import augment, losses, motion, pictures, quantise
from .data import Split, check_apart
from .distributed import World
from .errors import TrainingError, reported
from .features import NAMES, SLICES, channels_of
from .model import compact_unet, flops, light, parameter_count
from .provenance import command_of, commit, machine_of
from .validation import guess_error, validate
from .weights import WeightsError, read

FIELDS = ["epoch", "step", "samples", "seconds", "learning_rate", "train_loss", "validation_loss", "validation_error"]


@dataclasses.dataclass
class Config:
    """What a run is made of. A run's config.json holds these; --config reads such a file."""

    train: str = ""
    validation: str = ""
    widths: tuple = (16, 24, 32, 48)
    pointwise: int = 0  # levels with 1x1 kernels
    features: tuple = NAMES  # what the network is given, of the table
    epochs: int = 60
    minutes: float = 0.0  # 0: as many epochs as above; else until this much training time is used
    batch: int = 4
    crop: int = 0  # width in cells of the windows that are cut from pictures; 0: whole pictures
    init: str = ""  # a weights file to start from (fine-tuning), of this network or a smaller one with the same features
    learning_rate: float = 2e-3
    final_learning_rate: float = 2e-5
    warmup_steps: int = 50
    weight_decay: float = 1e-4
    clip: float = 1.0  # largest gradient norm
    ema: float = 0.998
    epsilon: float = 0.05  # of the relative square, units of s
    outside: float = 0.0  # weight of staying with the first guess on surfaces whose target is not trusted (silhouettes, borders of shadows)
    picture_l1: float = 0.0  # weight in the last third of the L1 on the pooled picture (losses.picture_difference)
    motion: str = ""  # pairs of frames (motion.py), for:
    temporal: float = 0.0  # weight of what changes along motion vectors, in the last part of a run
    temporal_from: float = 0.5  # share of the run after which that begins
    keep_best: int = 0  # 1: what is kept at the end is the average that did best on the validation views, the start included
    apart: str = "room"  # what the splits must not share: rooms, or views of one scene
    quantise: str = ""  # f16 or i8: learn for weights that are stored so (quantise.py)
    quantise_from: float = 0.8  # share of the run after which that begins
    seed: int = 1
    threads: int = 0  # 0: torch's choice
    device: str = "cpu"
    checkpoint_seconds: float = 120.0


# What may differ between a run's first command and the one that continues it.
FREE = {"minutes", "threads", "device", "checkpoint_seconds", "train", "validation", "motion", "init"}


class Stop(Exception):
    """Somebody asked the run to end; its state is saved first."""


def network(config):
    """The untrained network of a configuration."""
    return compact_unet(config.widths, len(channels_of(config.features)), config.pointwise)


def start_from(model, path):
    """Loads a weights file's numbers into a network of the same graph, or of one that has grown in width, in the size of its
    kernels or by convolutions between others: what is new then starts so that the answer stays (nearly) the same."""
    try:
        tensors, _ = read(path)
    except (OSError, WeightsError) as error:
        raise TrainingError(f"{path}: cannot start from it: {error}") from error
    state = model.state_dict()
    unknown = set(tensors) - set(state)
    if unknown:
        raise TrainingError(f"{path}: cannot start from it: this network has no {sorted(unknown)[0]}")
    for name, values in state.items():
        old = torch.from_numpy(tensors[name].astype(np.float32)) if name in tensors else None
        if old is None and values.dim() == 4 and values.shape[0] == values.shape[1]:
            nn.init.dirac_(values)
        elif old is not None and any(a > b for a, b in zip(old.shape, values.shape)):
            raise TrainingError(f"{path}: cannot start from it: its {name} is larger")
        elif old is not None and values.dim() == 4:
            # New channels go out with zeros until they have learnt something.
            (rows, columns), (y, x) = old.shape[:2], [(n - o) // 2 for n, o in zip(values.shape[2:], old.shape[2:])]
            values[:rows] = 0
            values[:rows, :columns, y:y + old.shape[2], x:x + old.shape[3]] = old
        elif old is not None:
            values[:len(old)] = old
    model.load_state_dict(state)


def batch_of(split, indices, rngs, device, crop=0):
    """Augmented pictures as tensors, each with random numbers of its own: features, target, mask."""
    made = [augment.augmented(split.features[i], split.target[i], split.mask[i], rng, crop) for i, rng in zip(indices, rngs)]
    features, target, mask = (torch.from_numpy(np.stack([np.ascontiguousarray(m[k]) for m in made])) for k in range(3))
    return features.to(device, memory_format=torch.channels_last), target.to(device), mask.to(device)


class Run:
    """Model, optimiser, average and progress of one training run, and how they are kept on disk."""

    def __init__(self, config, folder, train, validation):
        self.config, self.folder, self.train, self.validation = config, folder, train, validation
        torch.manual_seed(config.seed)
        if config.threads:
            torch.set_num_threads(config.threads)
        self.world, self.commit = World(config.device), commit()
        self.device = self.world.device
        self.channels = channels_of(config.features)
        self.model = network(config).to(self.device, memory_format=torch.channels_last)
        if config.init:
            start_from(self.model, config.init)
        self.parallel = self.world.parallel(self.model)
        self.average = {name: p.detach().clone() for name, p in self.model.state_dict().items()}
        self.optimiser = torch.optim.AdamW(self.model.parameters(), lr=config.learning_rate, weight_decay=config.weight_decay)
        self.step, self.elapsed, self.rows, self.sums = 0, 0.0, [], [0.0, 0]
        self.batch = config.batch * self.world.size  # pictures of a step, over all processes
        self.steps_per_epoch = math.ceil(len(train) / self.batch)
        if bool(config.motion) != bool(config.temporal):
            raise TrainingError("--motion and --temporal go together: a file of pairs, and what they weigh")
        self.pairs = motion.Pairs(config.motion) if config.motion else None
        if self.pairs and self.pairs.flow.shape[2:] != train.mask.shape[1:]:
            raise TrainingError(f"{config.motion}: frames of {self.pairs.flow.shape[:1:-1]} cells, the views of {train.path} have {train.mask.shape[:0:-1]}; draw both in one size")
        self.best = None  # (validation error, weights) with --keep-best
        self.stopping = False  # somebody asked some process to end

    @property
    def checkpoint_path(self):
        return os.path.join(self.folder, "checkpoint.pt")

    @property
    def epoch(self):
        return self.step // self.steps_per_epoch

    def save(self):
        """Writes checkpoint.pt whole: a kill leaves the old one or the new one."""
        if not self.world.first:
            return
        state = {"best": self.best, "processes": self.world.size, "config": dataclasses.asdict(self.config), "model": self.model.state_dict(), "average": self.average,
                 "optimiser": self.optimiser.state_dict(), "step": self.step, "elapsed": self.elapsed, "rows": self.rows, "sums": self.sums,
                 "samples": self.samples(), "command": command_of(self.config, self.folder, self.world.size), "commit": self.commit, "machine": machine_of(self.device), "train_report": self.train.report, "validation_report": self.validation.report,
                 "motion_report": self.pairs.report if self.pairs else None}
        torch.save(state, self.checkpoint_path + ".part")
        os.replace(self.checkpoint_path + ".part", self.checkpoint_path)

    def load(self):
        """Continues from checkpoint.pt if there is one."""
        if not os.path.exists(self.checkpoint_path):
            return
        state = read_checkpoint(self.checkpoint_path)
        ours = json.loads(json.dumps(dataclasses.asdict(self.config)))
        theirs = json.loads(json.dumps(state["config"]))
        differ = [k for k in ours if k not in FREE and ours[k] != theirs.get(k)]
        if differ:
            raise TrainingError(f"{self.checkpoint_path} was made with another {differ[0]} ({theirs.get(differ[0])}, now {ours[differ[0]]}); use another --run")
        if state.get("processes", 1) != self.world.size:
            raise TrainingError(f"{self.checkpoint_path} was made by {state.get('processes', 1)} processes, now there are {self.world.size}; use as many, or another --run")
        if state["train_report"] != self.train.report:
            raise TrainingError(f"{self.checkpoint_path} was trained on other data than {self.train.path}; use another --run")
        self.model.load_state_dict(state["model"])
        self.average = {name: p.to(self.device) for name, p in state["average"].items()}
        self.optimiser.load_state_dict(state["optimiser"])
        self.best = state.get("best")
        self.step, self.elapsed, self.rows, self.sums = state["step"], state["elapsed"], state["rows"], state["sums"]
        print(f"continues at step {self.step} (epoch {self.epoch}, {self.elapsed / 60:.1f} min used)", file=sys.stderr)

    def samples(self):
        """Pictures seen so far."""
        done, rest = divmod(self.step, self.steps_per_epoch)
        return done * len(self.train) + min(rest * self.batch, len(self.train))

    def progress(self):
        """0 at the start, 1 at the end."""
        if self.config.minutes:
            return min(self.elapsed / (60 * self.config.minutes), 1.0)
        return min(self.step / (self.config.epochs * self.steps_per_epoch), 1.0)

    def learning_rate(self):
        """Linear warm-up, then half a cosine."""
        c = self.config
        warm = min((self.step + 1) / max(c.warmup_steps, 1), 1.0)
        return warm * (c.final_learning_rate + 0.5 * (c.learning_rate - c.final_learning_rate) * (1 + math.cos(math.pi * self.progress())))

    def loss(self, prediction, features, target, mask):
        loss = losses.relative_square(prediction, target, mask, self.config.epsilon)
        if self.config.outside:
            # Nothing else says what the network answers there, and the way back to full resolution reads those cells, too.
            guess, hit = torch.expm1(features[:, SLICES["guess"]]), features[:, SLICES["hit"]][:, 0] > 0.5
            loss = loss + self.config.outside * losses.relative_square(prediction, guess, hit & ~mask, self.config.epsilon)
        if self.config.picture_l1 and self.progress() > 2 / 3:
            direct = torch.expm1(features[:, SLICES["direct"]])
            loss = loss + self.config.picture_l1 * losses.picture_difference(prediction, target, mask, features[:, SLICES["albedo"]], direct)
        return loss

    def pair(self):
        """The two frames of this step's temporal term, if it has one; which they are follows from seed, step and process alone."""
        if not self.pairs or self.progress() <= self.config.temporal_from:
            return None
        return self.pairs.draw(np.random.default_rng((self.config.seed, 1 << 21, self.step, self.world.rank)), self.config.crop, self.device)

    def train_step(self):
        """One batch; which one follows from seed and step alone. Each process takes its share of it."""
        begun = time.monotonic()
        place = self.step % self.steps_per_epoch
        order = np.random.default_rng((self.config.seed, self.epoch)).permutation(len(self.train))
        chosen = order[place * self.batch:(place + 1) * self.batch]
        places, weight = self.world.share(chosen)
        chosen = chosen[places]
        rngs = [np.random.default_rng((self.config.seed, 1 << 20, self.step, place)) for place in places]
        features, target, mask = batch_of(self.train, chosen, rngs, self.device, self.config.crop)
        pair = self.pair()
        for group in self.optimiser.param_groups:
            group["lr"] = self.learning_rate()
        self.model.train()
        self.optimiser.zero_grad(set_to_none=True)
        with quantise.rounding(self.model, self.storage()):
            answer = self.parallel((torch.cat([features, pair.frames]) if pair else features)[:, self.channels])
            loss = self.loss(light(answer[:len(features)], features), features, target, mask)
            if pair:
                frames = light(answer[-2:], pair.frames)
                loss = loss + self.config.temporal * motion.flicker_loss(frames[:1], frames[1:], pair, self.config.epsilon)
            (weight * loss).backward()
        value = loss.item()
        views = ", ".join(f"room {self.train.room[i]} view {self.train.view[i]}" for i in chosen)
        if not math.isfinite(value):
            raise TrainingError(f"the loss is {value} at step {self.step} ({views}); the last checkpoint is kept; lower the learning rate or look at these views")
        norm = torch.nn.utils.clip_grad_norm_(self.model.parameters(), self.config.clip)
        if not torch.isfinite(norm):
            raise TrainingError(f"the gradient is {norm.item()} at step {self.step} ({views}); the last checkpoint is kept")
        self.optimiser.step()
        decay = min(self.config.ema, (1 + self.step) / (10 + self.step))
        with torch.no_grad():
            for name, p in self.model.state_dict().items():
                self.average[name].lerp_(p, 1 - decay)
        self.step += 1
        # The clock decides on learning rate and end, so all processes must read the same one: the first's.
        elapsed = (self.elapsed + time.monotonic() - begun) * self.world.size if self.world.first else 0.0
        value, self.elapsed, stopping = self.world.agree(weight * value, elapsed, float(bool(STOPPING)))
        self.sums, self.stopping = [self.sums[0] + value, self.sums[1] + 1], stopping > 0

    def storage(self):
        """How weights are rounded by now: "" while they are not."""
        return self.config.quantise if self.progress() >= self.config.quantise_from else ""

    def averaged(self):
        """The model with averaged weights, as they would be stored."""
        model = network(self.config).to(self.device, memory_format=torch.channels_last)
        model.load_state_dict(self.average)
        return quantise.round_(model, self.storage()).eval()

    def note_best(self, scores):
        """Keeps the average if no other did better; at the end it becomes the best one."""
        if not self.config.keep_best:
            return
        if self.best is None or scores["validation_error"] < self.best[0]:
            self.best = [scores["validation_error"], {name: values.clone() for name, values in self.average.items()}]
        if self.progress() >= 1:
            self.average = {name: values.to(self.device) for name, values in self.best[1].items()}

    def finish_epoch(self, draw):
        """Validates, logs and saves, all in the first process."""
        if not self.world.first:
            return
        scores, predicted = validate(self.averaged(), self.validation, self.config, self.device)
        self.note_best(scores)
        row = {"epoch": self.epoch, "step": self.step, "samples": self.samples(), "seconds": round(self.elapsed, 1), "learning_rate": self.learning_rate(),
               "train_loss": self.sums[0] / max(self.sums[1], 1), **scores}
        self.rows.append(row)
        self.sums = [0.0, 0]
        self.save()
        write_log(self.rows, os.path.join(self.folder, "log.csv"))
        pictures.loss_curve(self.rows, os.path.join(self.folder, "loss.png"))
        if draw:
            title = f"epoch {row['epoch']}, {row['samples']} samples seen, error {row['validation_error']:.1%}"
            pictures.validation_views(self.validation, predicted, os.path.join(self.folder, "validation.png"), title)
        print(f"epoch {row['epoch']:4}  {row['seconds'] / 60:6.1f} min  train {row['train_loss']:.4f}  validation {row['validation_loss']:.4f}"
              f"  error {row['validation_error']:.2%}", file=sys.stderr, flush=True)


def read_checkpoint(path):
    """A checkpoint's dictionary (plain tensors and numbers only)."""
    try:
        return torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # torch raises many types for a damaged file
        raise TrainingError(f"{path}: not a readable checkpoint: {error}") from error


def write_log(rows, path):
    with open(path + ".part", "w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS)
        writer.writeheader()
        writer.writerows(rows)
    os.replace(path + ".part", path)


def train(config, folder, stop_after=None):
    """Runs to the end (or for `stop_after` steps, for tests) and returns the Run."""
    train_split, validation = Split(config.train), Split(config.validation)
    check_apart(train_split, validation, config.apart)
    os.makedirs(folder, exist_ok=True)
    run = Run(config, folder, train_split, validation)
    run.load()
    if run.world.first:
        introduce(run)
        if run.step == 0 and config.keep_best:
            run.note_best(validate(run.averaged(), validation, config, run.device)[0])
    saved, begun, drawn = time.monotonic(), run.step, 0.0
    while run.progress() < 1:
        run.train_step()
        last = run.progress() >= 1
        if run.step % run.steps_per_epoch == 0 or last:
            draw = last or time.monotonic() - drawn > 60
            run.finish_epoch(draw)
            saved, drawn = time.monotonic(), time.monotonic() if draw else drawn
        elif time.monotonic() - saved > config.checkpoint_seconds:
            run.save()
            saved = time.monotonic()
        if stop_after is not None and run.step - begun >= stop_after:
            break
        if run.stopping:
            run.save()
            raise Stop
    return run


def introduce(run):
    """Writes config.json and says what is to be trained on what."""
    with open(os.path.join(run.folder, "config.json"), "w") as file:
        json.dump(dataclasses.asdict(run.config), file, indent=1)
    h, w = run.train.mask.shape[1:]
    print(f"{parameter_count(run.model)} parameters, {flops(run.model, h, w) / 1e9:.2f} GFLOP at {w}x{h} cells; {len(run.train)} training and "
          f"{len(run.validation)} validation views, {run.train.report['kept']:.0%} and {run.validation.report['kept']:.0%} of the cells kept; "
          f"the first guess is wrong by {guess_error(run.validation):.2%}", file=sys.stderr, flush=True)


STOPPING = []


@reported
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", "--folder", dest="run", required=True, help="folder of the run; continued if it has a checkpoint (torchrun takes --folder only: it has options that begin with run)")
    parser.add_argument("--config", help="JSON with any of the settings below; flags win over it")
    for field in dataclasses.fields(Config):
        kind = {"widths": lambda t: tuple(int(n) for n in t.split(",")), "features": lambda t: tuple(t.split(","))}.get(field.name, type(field.default))
        parser.add_argument("--" + field.name.replace("_", "-"), type=kind, default=None, help=f"default {field.default}")
    a = vars(parser.parse_args(arguments))
    folder, file = a.pop("run"), a.pop("config")
    settings = {}
    if file:
        try:
            with open(file) as f:
                settings = json.load(f)
        except (OSError, ValueError) as error:
            raise TrainingError(f"{file}: {error}") from error
        unknown = set(settings) - {f.name for f in dataclasses.fields(Config)}
        if unknown:
            raise TrainingError(f"{file}: no such setting: {sorted(unknown)[0]}")
    settings |= {k: v for k, v in a.items() if v is not None}
    config = Config(**settings)
    config.widths, config.features = tuple(config.widths), tuple(config.features)
    unknown = set(config.features) - set(NAMES)
    if unknown:
        raise TrainingError(f"no such feature: {sorted(unknown)[0]}; there are {', '.join(NAMES)}")
    for name in ("train", "validation"):
        if not getattr(config, name):
            raise TrainingError(f"--{name} is missing: the .npz of the split, made by python -m bouncelight_training.data")
    for s in (signal.SIGINT, signal.SIGTERM):
        signal.signal(s, lambda *_: STOPPING.append(True))
    quantise.check(config.quantise)
    try:
        train(config, folder).world.leave()
    except Stop:
        print(f"stopped; the same command continues (state in {folder})", file=sys.stderr)
        sys.exit(130)


if __name__ == "__main__":
    main()
