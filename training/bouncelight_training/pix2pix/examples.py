"""Views of pix2pix.views in memory, and the examples that a training step takes from them."""
import glob
import os

import numpy as np

from ..errors import TrainingError
from ..stream import is_judged
from .model import NETWORKS
from .views import ALL, TARGET, read

# The project's validation rooms are nobody's training rooms.
VALIDATION = {2, 3, 4, 5}


def encoded(values, encoding):
    """Bytes as the network takes them (weights-format/README.md)."""
    v = values.astype(np.float32)
    if encoding == "signed":
        return v / 127.5 - 1
    low, high = v.min(), v.max()
    return 2 * (v - low) / (high - low) - 1 if high > low else np.full_like(v, -1)


class Examples:
    """The views of some folders. Every `every`-th validates, and rooms 2 to 5; all others train."""

    def __init__(self, folders, network, every):
        self.folders, self.network, self.every = folders, network, every
        paths = [path for folder in folders.split(",") for path in sorted(glob.glob(os.path.join(folder, "*.npz")))]
        if not paths:
            raise TrainingError(f"{folders}: no views; make them with python -m bouncelight_training.pix2pix.views")
        self.names, self.pictures, reports = [], [], []
        for path in paths:
            pictures, report = read(path)
            if report["room"] is not None and is_judged(report["room"]):
                raise TrainingError(f"{path}: room {report['room']} is kept for judging and must not be trained or tuned on; remove it")
            # Grey; a third of the memory.
            self.pictures.append({name: pictures[name][..., :1] if name == "depth" else pictures[name] for name in ALL})
            self.names.append(report["view"])
            reports.append(report)
        validate = [report["room"] in VALIDATION or i % every == every - 1 for i, report in enumerate(reports)]
        self.train, self.validation = (np.array([i for i, v in enumerate(validate) if v == wanted], int) for wanted in (False, True))
        for name, part in (("training", self.train), ("validation", self.validation)):
            if not len(part):
                raise TrainingError(f"{folders}: no {name} view is left; make more views")
        self.report = {"views": len(paths), "names": self.names, "sizes": sorted({tuple(r["size"]) for r in reports}), "targets": sorted({r["targets"] for r in reports}),
                       "samples": sorted({r["samples"] for r in reports}), "every": every}

    def example(self, index, window=None, order=(0, 1, 2)):
        """(pictures [1,c,h,w], target [1,3,h,w]) as float32. `window`: rows and columns, slices; `order`: of red, green and blue, in everything but depth
        and normals: a room of other colours."""
        window = window or (slice(None), slice(None))

        def channels(name, encoding):
            values = self.pictures[index][name][window]
            if name == "depth":
                values = np.repeat(values, 3, -1)
            elif name != "normal":
                values = values[..., list(order)]
            return encoded(values, encoding).transpose(2, 0, 1)

        wanted, encoding = NETWORKS[self.network]
        return np.concatenate([channels(name, encoding) for name in wanted])[None], channels(TARGET, "signed")[None]

    def size(self, index):
        """Height and width."""
        return self.pictures[index][TARGET].shape[:2]

    def target(self, index):
        return self.pictures[index][TARGET]

    def direct(self, index):
        return self.pictures[index]["direct"]
