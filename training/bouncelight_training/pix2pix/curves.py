"""Pictures of a run of the paper's recipe: its curves, and its views beside Cycles'."""
import numpy as np

from ..pictures import plt, save


def losses(rows, path):
    """L1, the networks' losses where there is a discriminator, and the validation views' PSNR, against pictures seen."""
    samples = [row["step"] for row in rows]
    adversarial = any(row["adversarial"] for row in rows)
    figure, panels = plt.subplots(1, 2 + adversarial, figsize=(10 + 5 * adversarial, 4), constrained_layout=True)
    left, right = panels[0], panels[-1]
    left.plot(samples, [row["train_l1"] for row in rows], label="training (with dropout)")
    left.plot(samples, [row["validation_l1"] for row in rows], label="validation")
    left.set(ylabel="L1 of pictures in [-1, 1]", ylim=(0, None))
    if adversarial:
        panels[1].plot(samples, [row["adversarial"] for row in rows], label="generator's, adversarial")
        panels[1].plot(samples, [row["discriminator"] for row in rows], label="discriminator's")
        panels[1].set(ylabel="cross-entropy", ylim=(0, None))
    right.plot(samples, [row["validation_psnr"] for row in rows], label="validation")
    right.set(ylabel="PSNR (dB)")
    for axes in panels:
        axes.set_xlabel("pictures seen")
        axes.grid(alpha=0.3)
        axes.legend()
    save(figure, path)


def validation(examples, predicted, path, title):
    """One row a view: direct light, the network's picture, the path tracer's, and four times their difference. `predicted`: bytes by index."""
    figure, axes = plt.subplots(len(predicted), 4, figsize=(17, 2.2 * len(predicted) + 0.5), squeeze=False, constrained_layout=True)
    for row, (i, picture) in zip(axes, predicted.items()):
        difference = np.abs(picture.astype(int) - examples.target(i))
        shown = [examples.direct(i), picture, examples.target(i), np.clip(4 * difference, 0, 255).astype(np.uint8)]
        for axis, image, text in zip(row, shown, ["raster: direct light and sky", "network", "paths", "|difference| × 4"]):
            axis.imshow(image, interpolation="nearest")
            axis.set(xticks=[], yticks=[])
            if row is axes[0]:
                axis.set_title(text, fontsize=10)
        row[0].set_ylabel(examples.names[i], fontsize=9)
    figure.suptitle(title, fontsize=11)
    save(figure, path)
