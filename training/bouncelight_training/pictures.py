"""Pictures of a run: the loss curve, and what the network makes of validation views."""
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402

from .features import SLICES, light_of  # noqa: E402


def shown(light):
    """[3,h,w] in units of the exposure to [h,w,3] for the screen: x/(1+x), then sRGB's gamma."""
    light = np.moveaxis(np.maximum(light, 0), 0, -1)
    return np.clip((light / (1 + light)) ** (1 / 2.2), 0, 1)


def save(figure, path):
    """Written whole or not at all."""
    figure.savefig(path + ".part.png", dpi=110)
    plt.close(figure)
    os.replace(path + ".part.png", path)


def loss_curve(rows, path):
    """Training loss and validation error by samples seen."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), constrained_layout=True)
    samples = [row["samples"] for row in rows]
    left.plot(samples, [row["train_loss"] for row in rows], label="training")
    left.plot(samples, [row["validation_loss"] for row in rows], label="validation (averaged weights)")
    left.set(yscale="log", xlabel="samples seen", ylabel="relative square")
    left.legend()
    right.plot(samples, [100 * row["validation_error"] for row in rows])
    right.set(xlabel="samples seen", ylabel="mean |ΔE| / mean E, pooled 4×4 (%)", ylim=(0, None))
    for axes in (left, right):
        axes.grid(alpha=0.3)
    save(figure, path)


def validation_views(split, predictions, path, title):
    """One row a view: light and finished picture, target beside prediction, and where they differ. `predictions` maps
    indices of the split to [3,h,w] in units of s."""
    figure, axes = plt.subplots(len(predictions), 5, figsize=(20, 2.2 * len(predictions) + 0.5), squeeze=False, constrained_layout=True)
    for row, (i, prediction) in zip(axes, predictions.items()):
        features = split.features[i].astype(np.float32)
        target, mask = split.target[i].astype(np.float32), split.mask[i]
        albedo, direct = features[SLICES["albedo"]], light_of(features, "direct")
        hit = features[SLICES["hit"]]
        difference = (prediction - target).mean(0) / max(float(target.mean(0)[mask].mean()), 1e-6)
        pictures = [shown(4 * target * hit), shown(4 * prediction * hit), np.where(mask, difference, np.nan),
                    shown(4 * albedo * (direct + target)), shown(4 * albedo * (direct + prediction * hit))]
        titles = ["light to add: Cycles", "network", "difference / mean (±1; grey: left out)", "picture: Cycles", "network"]
        for axis, picture, text in zip(row, pictures, titles):
            axis.set_facecolor("0.5")
            axis.imshow(picture, cmap="RdBu_r", vmin=-1, vmax=1, interpolation="nearest")
            axis.set(xticks=[], yticks=[])
            if row is axes[0]:
                axis.set_title(text, fontsize=10)
        row[0].set_ylabel(f"room {split.room[i]} view {split.view[i]}", fontsize=9)
    figure.suptitle(title, fontsize=11)
    save(figure, path)
