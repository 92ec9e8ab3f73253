"""Trains the network that guides `gather`'s filter.

    python -m bouncelight_training.filter.train --train FOLDER[,FOLDER] --validation FOLDER --run runs/NAME [--minutes 20] [--device cuda]

The same command goes on where a killed run stopped. The run's folder holds config.json, checkpoint.pt and log.csv; what is kept is the
average of the weights over steps (EMA) that did best on the validation's views, what training begins with (untrained: `gather` itself) included.
"""
import argparse
import copy
import csv
import dataclasses
import json
import math
import os
import sys
import time

import numpy as np
import torch
import torch.nn.functional as F
from torch import nn

from ..errors import TrainingError, reported
from ..losses import pooled_error
from ..model import LEAK, flops, parameter_count
from ..provenance import commit, machine_of
from ..weights import GraphNet, WeightsError, compact, read
from . import blur, samples

# What the answer of such a network means, in weights files.
MEANING = "filter"
# Of the loss of `gather`: a picture that is right already teaches nothing.
LEAST_BASE = 0.01
# The same of what changes from one frame to the next.
LEAST_CHANGE = 1e-4
# Sides of the squares of cells over which light is compared.
POOLS = (1, 2, 4, 16)
# A picture that has become so much worse counts no more than this.
LOUD = 2.0
# Share of steps that may be lost to gradients that are not numbers.
MOST_LOST = 0.01
FIELDS = ["step", "samples", "seconds", "learning_rate", "loss", "validation_error", "gather_error"]


@dataclasses.dataclass
class Config:
    """What a run is made of."""

    train: str = ""
    validation: str = ""
    begin: str = ""  # weights file whose numbers training begins with; else the untrained network
    teacher: str = ""  # weights file of a network of any shape whose filtered light is learnt, too
    taught: float = 0.5  # what that light counts; the rest is the target
    widths: tuple = (12, 24, 32, 48)
    pools: tuple = POOLS  # sides of the squares of cells that the loss compares
    every: int = 1  # one view of so many
    minutes: float = 20.0
    steps: int = 0  # so many in place of minutes, so that runs on a busy machine are alike
    batch: int = 4
    crop: int = 48  # cells on a side of the windows that steps look at; 0: whole pictures
    learning_rate: float = 1e-3
    weight_decay: float = 1e-2
    ema: float = 0.998
    raw: float = 0.3  # share of the loss that looks at the first step alone
    flicker: float = 0.1  # what a change between two frames of a still camera counts against the rest, where samples have both
    seed: int = 1
    threads: int = 2
    device: str = "cpu"


def network(config):
    """The network that training begins with: that of a weights file, or an untrained one, whose answer is zeros."""
    if config.begin:
        return network_of(config.begin)
    torch.manual_seed(config.seed)
    model = GraphNet(*compact(samples.CHANNELS, tuple(config.widths), blur.GUIDANCE, {"leaky_relu": LEAK}))
    for op in model.graph:
        if op["op"] == "conv2d":
            layer = model.get_submodule(op["name"])
            nn.init.kaiming_normal_(layer.weight, nonlinearity="linear" if op["activation"] == "none" else "leaky_relu", a=LEAK)
            nn.init.zeros_(layer.bias)
    # All places alike have no slope: exp(-distance²) is flat there. A hundredth is far enough to begin.
    nn.init.normal_(layer.weight, std=0.01)
    nn.init.zeros_(layer.weight[8:])
    return model


def network_of(path):
    """The network of a weights file, of whatever shape."""
    try:
        tensors, doc = read(path)
        if doc["output"]["meaning"] != MEANING:
            raise TrainingError(f"{path}: a network of meaning {doc['output']['meaning']} does not filter")
        model = GraphNet(doc["graph"], doc["output"]["tensor"])
        model.load_state_dict({name: torch.from_numpy(np.asarray(values, np.float32)) for name, values in tensors.items()})
    except (OSError, WeightsError, RuntimeError) as error:
        raise TrainingError(f"{path}: cannot begin with it: {error}") from error
    return model


def loss_of(shown, target, mask, mean, noise, pools=POOLS):
    """Square of the difference over light here and in the picture, of cells and of means over 2x2, 4x4 and 16x16 of them: without bias on targets
    that hold noise, and even to bright and dark: [n]. Each is weighed by its side, since noise goes with that and what is wrong in the mean does not:
    a filter that trusts dark cells more has less noise and too little light. And by how much of it the target's noise is; a place whose difference is
    beyond five times both lights counts by the root: a firefly. shown, target [n,3,h,w], mask [n,h,w], mean and noise [n]."""
    mean, weight = mean.view(-1, 1, 1, 1), mask.unsqueeze(1).to(shown.dtype)
    loss = 0.0
    for size in pools:
        share = F.avg_pool2d(weight, size)
        pooled = [F.avg_pool2d(x * weight, size) / share.clamp(min=1e-6) for x in (shown, target)]
        here = pooled[0].detach().clamp(min=0)
        scale = (here + 0.05 * mean) * mean
        error, most = (pooled[0] - pooled[1]) ** 2 / scale, 25 * (here + mean) ** 2 / scale
        error = torch.where(error > most, torch.sqrt(error * most + 1e-12), error)
        means = (error * share).sum((1, 2, 3)) / (3 * share.sum((1, 2, 3))).clamp(min=1)
        loss = loss + size * means * 0.02 / (0.02 + (noise / size) ** 2)
    return loss


def change_of(shown, later, batch, pools=POOLS):
    """`loss_of` of the next frame's light against this one's, which should be the same: [n]."""
    return loss_of(later, shown, batch["mask"], batch["mean"], torch.zeros_like(batch["mean"]), pools)


def held(answer):
    """What keeps an answer [n,12,h,w] small where nothing speaks for it, and within its limits."""
    beyond = (answer[:, 8:10].abs() - blur.MAX_LOG).clamp(min=0)
    return 1e-3 * (answer[:, :8] ** 2).mean() + 0.01 * (beyond ** 2).mean()


def augmented(batch, rng):
    """The batch, or its mirror image (left for right; the gravity frame's x with it), with its colours in another order."""
    names = [name for name, n in samples.TABLE for _ in range(n)]
    order = torch.as_tensor(rng.permutation(3), device=batch["mask"].device)
    batch = batch | {k: batch[k][:, order] for k in ("light", "target")}
    if rng.random() < 0.5:
        batch = {k: v.flip(-1) if torch.is_tensor(v) and v.dim() > 1 else v for k, v in batch.items()}
        features = batch["features"].clone()
        for name in ("normal", "dominant_direction"):
            features[:, names.index(name)] *= -1
        batch["features"] = features
    features, first = batch["features"].clone(), names.index("chroma")
    # The weights of the three colours in a luminance stay those of the order before: of a network that is to look at differences, no matter.
    light = batch["light"]
    total = light.sum(1).clamp(min=1e-20)
    features[:, first], features[:, first + 1] = (light[:, 0] - light[:, 1]) / total, (light[:, 2] - light[:, 1]) / total
    return batch | {"features": features}


def window(pile, size, rng):
    """Where a window of `size` cells on a side lies, or None for all."""
    h, w = pile.fields["mask"].shape[-2:]
    return (*(int(rng.integers(0, max(n - size, 0) + 1)) for n in (h, w)), size) if size else None


def in_parts(pile, size=16):
    """All moments of a pile, so many at once: (their samples, the batch)."""
    for first in range(0, len(pile.samples), size):
        numbers = range(first, min(first + size, len(pile.samples)))
        yield [pile.samples[i] for i in numbers], pile.taken(list(numbers))


def validate(model, piles):
    """Error of `gather`'s light and of the network's, by moment, and over all: of each cell, as finished pictures are judged by blocks of 4x4 pixels.
    It holds the target's noise."""
    sums = {}
    with torch.no_grad():
        for some, batch in (part for pile in piles for part in in_parts(pile)):
            mean = batch["mean"].view(-1, 1, 1, 1)
            for which, answer in (("gather", None), ("network", model(batch["features"]))):
                shown = blur.filtered(batch, answer)[0].clamp(min=0) / mean
                errors = [pooled_error(shown[i:i + 1], batch["target"][i:i + 1] / mean[i], batch["mask"][i:i + 1], 1) for i in range(len(some))]
                for sample, (off, light) in zip(some, errors):
                    for key in (sample.when, "all"):
                        a, b = sums.get((key, which), (0, 0))
                        sums[key, which] = (a + off, b + light)
    return {f"{key} {which}": off / max(light, 1e-20) for (key, which), (off, light) in sums.items()}


def changes(model, piles):
    """Mean |change| of the light from one frame of a still camera to the next over mean light, of `gather` and of the network; empty without such frames."""
    sums = {}
    with torch.no_grad():
        for pile in piles:
            for i in np.flatnonzero(pile.later >= 0):
                batch = pile.taken([i, pile.later[i]])
                mask = batch["mask"][:1].unsqueeze(1)
                for which, answer in (("gather", None), ("network", model(batch["features"]))):
                    shown = blur.filtered(batch, answer)[0].clamp(min=0)
                    a, b = sums.get(which, (0, 0))
                    sums[which] = (a + ((shown[1:] - shown[:1]).abs() * mask).sum().item(), b + (shown[:1] * mask).sum().item())
    return {f"change {which}": a / max(b, 1e-20) for which, (a, b) in sums.items()}


class Run:
    """A network on its way."""

    def __init__(self, config, folder):
        self.config, self.folder = config, folder
        self.model = network(config).to(config.device)
        self.average = {k: v.detach().clone() for k, v in self.model.state_dict().items()}
        self.optimiser = torch.optim.AdamW(self.model.parameters(), lr=config.learning_rate, weight_decay=config.weight_decay)
        self.step, self.seconds, self.rows, self.best = 0, 0.0, [], (float("inf"), None)
        self.lost = 0  # steps whose gradient was not a number

    @property
    def path(self):
        return os.path.join(self.folder, "checkpoint.pt")

    def save(self):
        state = {k: getattr(self, k) for k in ("average", "step", "seconds", "rows", "best")}
        state |= {"config": dataclasses.asdict(self.config), "graph": self.model.graph, "output": self.model.output, "model": self.model.state_dict(), "optimiser": self.optimiser.state_dict(),
                  "commit": commit(), "machine": machine_of(torch.device(self.config.device))}
        torch.save(state, self.path + ".part")
        os.replace(self.path + ".part", self.path)

    def load(self):
        if not os.path.exists(self.path):
            return
        state = read_checkpoint(self.path)
        differ = [k for k, v in dataclasses.asdict(self.config).items() if k not in ("minutes", "steps", "threads", "device") and state["config"].get(k, v) != v]
        if differ:
            raise TrainingError(f"{self.path} was made with another {differ[0]}; use another --run")
        self.model.load_state_dict(state["model"])
        self.optimiser.load_state_dict(state["optimiser"])
        for k in ("average", "step", "seconds", "rows", "best"):
            setattr(self, k, state[k])
        self.average = {k: v.to(self.config.device) for k, v in self.average.items()}

    def averaged(self):
        model = copy.deepcopy(self.model)
        model.load_state_dict(self.average)
        return model.eval()

    def done(self, lately=0.0):
        """Which part of the run is gone, `lately` being seconds since the clock was looked at."""
        return min(self.step / self.config.steps if self.config.steps else (self.seconds + lately) / (60 * self.config.minutes), 1)

    def train_step(self, piles, began):
        """One step on moments of one pile; its loss (a tensor, so that a GPU need not be waited for; None where its gradient was not a number, and
        nothing was learnt) and the rate."""
        c = self.config
        rng = np.random.default_rng([c.seed, self.step])
        done = self.done(time.monotonic() - began)
        rate = c.learning_rate * min(1, (self.step + 1) / 50) * (0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * done)))
        for group in self.optimiser.param_groups:
            group["lr"] = rate
        counts = np.array([len(pile.samples) for pile in piles])
        pile = piles[rng.choice(len(piles), p=counts / counts.sum())]
        chosen = rng.integers(0, len(pile.samples), c.batch)
        # Beside each its next frame, if there is one.
        followed = np.flatnonzero(pile.later[chosen] >= 0) if c.flicker else []
        batch = augmented(pile.taken(np.concatenate([chosen, pile.later[chosen[followed]]]), window(pile, c.crop, rng)), rng)
        answer = self.model(batch["features"])
        shown, first = blur.filtered(batch, answer)
        learnt = [batch[k] for k in ("target", "mask", "mean", "noise")]
        loss = (1 - c.raw) * loss_of(shown, *learnt, c.pools) + c.raw * loss_of(first, *learnt, c.pools)
        # Over that of `gather` alone: a late moment counts as much as an early one, a quiet picture as much as one of fireflies.
        loss = loss / (batch["base"] + LEAST_BASE)
        if len(followed):
            change = change_of(shown[followed], shown[c.batch:], {k: batch[k][followed] for k in ("mask", "mean")}, c.pools)
            change = c.flicker * change / (batch["change"][followed] + LEAST_CHANGE)
            loss = loss.index_add(0, torch.as_tensor(followed, device=loss.device), change)
        loss = (loss / (loss.detach() / LOUD).clamp(min=1)).mean() + held(answer)
        self.optimiser.zero_grad()
        loss.backward()
        self.step += 1
        if not torch.isfinite(nn.utils.clip_grad_norm_(self.model.parameters(), 0.5)):
            self.lost += 1
            if self.lost > MOST_LOST * self.step + 1:
                raise TrainingError(f"step {self.step}: the gradient is not a number, {self.lost} times now; what did best so far is in {self.path}")
            return None, rate
        self.optimiser.step()
        keep = min(c.ema, (self.step + 1) / (self.step + 10))
        torch._foreach_lerp_(list(self.average.values()), list(self.model.state_dict().values()), 1 - keep)
        return loss.detach(), rate


def read_checkpoint(path):
    try:
        return torch.load(path, weights_only=True, map_location="cpu")
    except (OSError, RuntimeError, ValueError, EOFError, KeyError) as error:
        raise TrainingError(f"{path}: not a readable checkpoint: {error}") from error


def piles_of(config):
    """What is learnt and what is held out. Views of the same name are the same view."""
    torch.set_num_threads(config.threads)
    # What a teacher says has no noise.
    most = samples.MOST_NOISE / max(1 - config.taught, 1e-6) if config.teacher else samples.MOST_NOISE
    views = [sample for name in config.train.split(",") for sample in samples.read(name, config.every, most)]
    held_out = samples.read(config.validation)
    shared = {v.name for v in views} & {v.name for v in held_out}
    if shared:
        raise TrainingError(f"{sorted(shared)[0]} stands in training and validation")
    return samples.piles(views, config.device), samples.piles(held_out, config.device)


def taught(piles, config):
    """Mixes the light that another network's filter shows into the targets: it is less noisy, and of all views that the network has seen."""
    asked = (config.teacher, config.taught) if config.teacher and config.taught else None
    other = next((pile.taught_by for pile in piles if pile.taught_by not in (None, asked)), None)
    if other:
        raise TrainingError(f"views are mixed with the light of {other[0]} already")
    if not asked:
        return
    teacher = network_of(config.teacher).to(config.device).eval()
    with torch.no_grad():
        for pile in piles:
            if pile.taught_by == asked:
                continue
            light = [blur.filtered(batch, teacher(batch["features"]))[0].clamp(min=0) for _, batch in in_parts(pile)]
            pile.fields["target"] = torch.lerp(pile.fields["target"], torch.cat(light), config.taught)
            pile.fields["noise"] = pile.fields["noise"] * (1 - config.taught)
            pile.taught_by, pile.based_on = asked, None


def based(piles, pools):
    """Gives piles the loss of `gather` alone, and that of its changes from one frame to the next."""
    with torch.no_grad():
        for pile in piles:
            # A minute for a thousand moments: runs that share piles do so once.
            if pile.based_on == pools:
                continue
            pile.based_on = pools
            shown, losses = [], []
            for _, batch in in_parts(pile):
                shown.append(blur.filtered(batch)[0])
                losses.append(loss_of(shown[-1], *(batch[k] for k in ("target", "mask", "mean", "noise")), pools))
            pile.fields["base"], shown = torch.cat(losses), torch.cat(shown)
            pile.fields["change"] = torch.zeros_like(pile.fields["base"])
            followed = np.flatnonzero(pile.later >= 0)
            if len(followed):
                batch = {k: pile.fields[k][followed] for k in ("mask", "mean")}
                pile.fields["change"][followed] = change_of(shown[followed], shown[pile.later[followed]], batch, pools)


def train(config, folder):
    """Runs to the end; returns the Run."""
    piles, held_out = piles_of(config)
    os.makedirs(folder, exist_ok=True)
    run = Run(config, folder)
    run.load()
    with open(os.path.join(folder, "config.json"), "w") as file:
        json.dump(dataclasses.asdict(config), file, indent=1)
    taught(piles, config)
    based(piles, config.pools)
    count = sum(len(pile.samples) for pile in piles)
    print(f"{parameter_count(run.model)} parameters, {flops(run.model, 128, 256) / 1e9:.3f} GFLOP at 256x128 cells; {count} training and "
          f"{sum(len(pile.samples) for pile in held_out)} validation moments", file=sys.stderr, flush=True)
    began, sums, looked = time.monotonic(), [], time.monotonic()
    if run.step == 0:
        note(run, held_out, 0.0, 0.0)
    while run.done() < 1:
        loss, rate = run.train_step(piles, began)
        done = run.done(time.monotonic() - began)
        if loss is not None:
            sums.append(loss)
            if run.step % 32 == 0:
                loss.item()  # Waits for a GPU, so that the clock tells what is done.
        if time.monotonic() - looked > 90 or done >= 1:
            run.seconds, began = run.seconds + time.monotonic() - began, time.monotonic()
            note(run, held_out, torch.stack(sums).mean().item() if sums else math.nan, rate)
            run.save()
            sums, looked, began = [], time.monotonic(), time.monotonic()
    return run


def note(run, held_out, loss, rate):
    """Validates the averaged network, keeps it if it is the best, adds a row to the log."""
    errors = validate(run.averaged(), held_out) | changes(run.averaged(), held_out)
    if errors["all network"] < run.best[0]:
        run.best = (errors["all network"], {k: v.clone() for k, v in run.average.items()})
    run.rows.append({"step": run.step, "samples": run.step * run.config.batch, "seconds": round(run.seconds, 1), "learning_rate": rate,
                     "loss": loss, "validation_error": errors["all network"], "gather_error": errors["all gather"]})
    with open(os.path.join(run.folder, "log.csv.part"), "w", newline="") as file:
        writer = csv.DictWriter(file, FIELDS)
        writer.writeheader()
        writer.writerows(run.rows)
    os.replace(os.path.join(run.folder, "log.csv.part"), os.path.join(run.folder, "log.csv"))
    print(f"step {run.step} {run.seconds:.0f} s loss {loss:.4f} " + " ".join(f"{k} {v:.2%}" for k, v in errors.items()), file=sys.stderr, flush=True)


@reported
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--run", required=True, help="folder of the run; continued if it has a checkpoint")
    for field in dataclasses.fields(Config):
        numbers = lambda t: tuple(int(n) for n in t.split(","))
        kind = numbers if field.name in ("widths", "pools") else type(field.default)
        parser.add_argument("--" + field.name, type=kind, default=field.default, help=f"default {field.default}")
    a = vars(parser.parse_args(arguments))
    folder = a.pop("run")
    config = Config(**a)
    for name in ("train", "validation"):
        if not getattr(config, name):
            raise TrainingError(f"--{name} is missing: a folder that bouncelight dataset --moments has written")
    train(config, folder)


if __name__ == "__main__":
    main()
