"""Figures that are written whole or not at all."""
import os

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402


def save(figure, path):
    """Written whole or not at all."""
    figure.savefig(path + ".part.png", dpi=110)
    plt.close(figure)
    os.replace(path + ".part.png", path)
