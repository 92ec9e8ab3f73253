"""The single constant ambient light that suits a training split best: what the network has to beat.

    python -m bouncelight_training.baseline --train train.npz [--validation val.npz]

Four fits, each as an absolute E/pi and as a multiple of the picture's exposure s, RGB and grey: least squares (the mean),
least absolute differences (the median), and least absolute differences of the finished picture, albedo * (direct +
constant), under Filmic's logarithmic encoding - what the paper's L1 is nearest to. Fitted on means over 4x4 cells, because
the median of noisy targets is too dark. Errors are mean |dE| / mean E of the same means.
"""
import argparse
import json

import numpy as np
import torch

from .data import Split
from .errors import reported
from .features import LUMINANCE, SLICES, light_of
from .losses import pooled

STOPS_BELOW, STOPS = 10.0, 16.5  # of Filmic's log encoding around middle grey 0.18


def encoded(radiance):
    """Filmic's logarithmic encoding (without its contrast curve)."""
    return np.clip((np.log2(np.maximum(radiance, 1e-9) / 0.18) + STOPS_BELOW) / STOPS, 0, 1)


def blocks(split):
    """Pooled target, direct light and albedo: [n,3], absolute E/pi, and the exposure s of each row [n]."""
    columns = [[], [], [], []]
    for i in range(len(split)):
        features, s = split.features[i].astype(np.float32), float(split.scale[i])
        mask = torch.from_numpy(split.mask[i:i + 1])
        for column, values in zip(columns, (split.target[i].astype(np.float32) * s, light_of(features, "direct") * s, features[SLICES["albedo"]])):
            mean, kept = pooled(torch.from_numpy(np.ascontiguousarray(values))[None], mask)
            column.append(mean[0].permute(1, 2, 0)[kept[0]].numpy())
        columns[3].append(np.full(len(columns[0][-1]), s, np.float32))
    return [np.concatenate(c) for c in columns]


def fitted(target, direct, albedo, unit, grey):
    """The three constants in units of `unit` [n,1] (ones: absolute): name -> [3]."""
    groups = [[0, 1, 2]] if grey else [[0], [1], [2]]
    out = {}
    # |c*u - t| is least at the median of t/u weighted by u.
    for name in ("least squares", "least absolute", "least absolute of the picture"):
        constant = np.zeros(3)
        for channels in groups:
            t, d, a = (x[:, channels] for x in (target, direct, albedo))
            u = np.broadcast_to(unit, t.shape)
            if name == "least squares":
                c = float((t * u).sum() / (u * u).sum())
            else:
                cost = (lambda c: np.abs(c * u - t).mean()) if name == "least absolute" else (
                    lambda c: np.abs(encoded(a * (d + c * u)) - encoded(a * (d + np.maximum(t, 0)))).mean())
                c = descend(cost, float(np.median(t / u)))
            constant[channels] = c
        out[name] = constant
    return out


def descend(cost, start):
    """The minimum of a one-dimensional cost by three ever finer scans around `start`."""
    centre, span = max(start, 1e-6), 4.0
    for _ in range(3):
        tried = centre * np.geomspace(1 / span, span, 33)
        centre, span = float(tried[np.argmin([cost(c) for c in tried])]), span ** (1 / 8)
    return centre


def fit(train, validation=None):
    """All constants with their errors: list of dictionaries."""
    sets = {"train": blocks(train)} | ({"validation": blocks(validation)} if validation else {})
    target, direct, albedo, scale = sets["train"]
    out = []
    for relative in (False, True):
        for grey in (True, False):
            unit = scale[:, None] if relative else np.ones((len(scale), 1), np.float32)
            for name, constant in fitted(target, direct, albedo, unit, grey).items():
                row = {"unit": "s" if relative else "E/pi", "colour": "grey" if grey else "rgb", "fit": name, "constant": [round(float(c), 6) for c in constant]}
                for which, (t, d, a, s) in sets.items():
                    prediction = constant * (s[:, None] if relative else 1.0)
                    row[f"{which}_error"] = float(np.abs(prediction - t).sum() / t.sum())
                    row[f"{which}_picture"] = float(np.abs(encoded(a * (d + prediction)) - encoded(a * (d + np.maximum(t, 0)))).mean())
                out.append(row)
    mean = (target / scale[:, None]).mean(0)
    return out, {"mean E/pi": target.mean(0).tolist(), "mean in units of s": mean.tolist(), "luminance in units of s": float(LUMINANCE @ mean)}


@reported
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--train", required=True)
    parser.add_argument("--validation")
    parser.add_argument("--json", help="write the rows here too")
    a = parser.parse_args(arguments)
    rows, means = fit(Split(a.train), Split(a.validation) if a.validation else None)
    if a.json:
        with open(a.json, "w") as file:
            json.dump({"means": means, "rows": rows}, file, indent=1)
    print(json.dumps(means))
    for row in rows:
        errors = "  ".join(f"{k.replace('_', ' ')} {v:.2%}" if k.endswith("error") else f"{k.replace('_', ' ')} {v:.4f}" for k, v in row.items() if k.startswith(("train", "valid")))
        print(f"{row['unit']:5} {row['colour']:4} {row['fit']:30} {row['constant']}  {errors}")


if __name__ == "__main__":
    main()
