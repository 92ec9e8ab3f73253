"""What each input, each part of the answer and each term of the loss is worth: each left out once.

    python -m bouncelight_training.filter.ablation --train FOLDER[,FOLDER] --validation FOLDER --run runs/ablation --begin filter.safetensors --steps 400

A line a run: the validation's error with what it began with, that part missing, and after as many steps as the others. What a part is worth is
the difference to `all`, of which there are three runs with other seeds: less than they differ by is nothing. A killed command goes on where it
stopped. Takes the other options of bouncelight_training.filter.train.
"""
import dataclasses
import os

from ..errors import reported
from . import blur, samples, train

SEEDS = 3


def variants(config):
    """(name, config) of each run."""
    change = lambda **fields: dataclasses.replace(config, **fields)
    for seed in range(SEEDS):
        yield f"all, seed {config.seed + seed}", change(seed=config.seed + seed)
    for name, _ in samples.TABLE:
        yield f"no {name}", change(without=(name,))
    for part in blur.PARTS:
        yield f"answer without {part}", change(mute=(part,))
    yield "loss without the first step alone", change(raw=0.0)
    yield "loss without flicker", change(flicker=0.0)
    for pool in config.pools:
        yield f"loss without {pool}x{pool} cells", change(pools=tuple(p for p in config.pools if p != pool))


def table(rows):
    """Markdown of (name, error before, error after), percent."""
    lines = ["| | at first | after the steps | over `all` |", "|---|---|---|---|"]
    base = sum(after for _, _, after in rows[:SEEDS]) / SEEDS
    lines += [f"| {name} | {100 * first:.3f} | {100 * after:.3f} | {100 * (after - base):+.3f} |" for name, first, after in rows]
    return "\n".join(lines)


@reported
def main(arguments=None):
    config, folder = train.asked(__doc__, arguments)
    rows, read = [], train.piles_of(config)
    for name, one in variants(config):
        run = train.train(one, os.path.join(folder, name.replace(" ", "_").replace(",", "")), read=read)
        rows.append((name, run.rows[0]["validation_error"], run.rows[-1]["validation_error"]))
        print(f"{name}: {100 * rows[-1][1]:.3f} -> {100 * rows[-1][2]:.3f} %; `gather` {100 * run.rows[0]['gather_error']:.3f} %", flush=True)
    print("\n" + table(rows))


if __name__ == "__main__":
    main()
