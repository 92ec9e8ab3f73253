"""Pictures of a run of the paper's recipe: its curves, and its views beside Cycles'."""
import numpy as np

from ..pictures import plt, save


def losses(rows, path):
    """L1 and both networks' losses, and the validation views' PSNR, against pictures seen."""
    samples = [row["samples"] for row in rows]
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(15, 4), constrained_layout=True)
    left.plot(samples, [row["train_l1"] for row in rows], label="training (with dropout)")
    left.plot(samples, [row["validation_l1"] for row in rows], label="validation")
    left.set(ylabel="L1 of pictures in [-1, 1]", ylim=(0, None))
    middle.plot(samples, [row["adversarial"] for row in rows], label="generator's, adversarial")
    middle.plot(samples, [row["discriminator"] for row in rows], label="discriminator's")
    middle.set(ylabel="cross-entropy", ylim=(0, None))
    right.plot(samples, [row["validation_psnr"] for row in rows], label="validation")
    right.set(ylabel="PSNR (dB)")
    for axes in (left, middle, right):
        axes.set_xlabel("pictures seen")
        axes.grid(alpha=0.3)
        axes.legend()
    save(figure, path)


def validation(pairs, predicted, path, title):
    """One row a view: direct light, the network's picture, Cycles', and four times their difference. `predicted`: bytes by index."""
    figure, axes = plt.subplots(len(predicted), 4, figsize=(17, 2.2 * len(predicted) + 0.5), squeeze=False, constrained_layout=True)
    for row, (i, picture) in zip(axes, predicted.items()):
        difference = np.abs(picture.astype(int) - pairs.target[i])
        shown = [pairs.pictures[i, 1], picture, pairs.target[i], np.clip(4 * difference, 0, 255).astype(np.uint8)]
        for axis, image, text in zip(row, shown, ["raster: direct light and sky", "network", "Cycles", "|difference| × 4"]):
            axis.imshow(image, interpolation="nearest")
            axis.set(xticks=[], yticks=[])
            if row is axes[0]:
                axis.set_title(text, fontsize=10)
        row[0].set_ylabel(f"room {pairs.room[i]} view {pairs.view[i]}", fontsize=9)
    figure.suptitle(title, fontsize=11)
    save(figure, path)
