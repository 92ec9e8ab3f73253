"""The weights format's own Python package, as installed or else from this repository; and what is written, read back."""
import os
import sys

import numpy as np
import torch

from .errors import TrainingError

try:
    import bouncelight_weights  # noqa: F401
except ImportError:
    sys.path.append(os.path.join(os.path.dirname(__file__), "..", "..", "weights-format", "python"))

from bouncelight_weights import WeightsError, compact, document, quantised, read, write  # noqa: E402, F401
from bouncelight_weights.torch_graph import GraphNet  # noqa: E402, F401
ODD_SIZES = [(37, 21), (5, 3), (1, 1)]


def verify(path, model, tolerance):
    """Reads `path` back and runs its graph beside `model` on odd sizes. Returns the largest |difference| of y, or raises TrainingError."""
    try:
        tensors, doc = read(path)
    except WeightsError as error:
        raise TrainingError(str(error)) from error
    again = GraphNet(doc["graph"], doc["output"]["tensor"])
    again.load_state_dict({name: torch.from_numpy(values.astype(np.float32)) for name, values in tensors.items()})
    again.eval()
    generator = torch.Generator().manual_seed(1)
    channels = sum(feature["channels"] for feature in doc["inputs"])
    worst = 0.0
    with torch.no_grad():
        for w, h in ODD_SIZES:
            x = torch.rand(1, channels, h, w, generator=generator)
            worst = max(worst, (again(x) - model(x)).abs().max().item())
    if not worst <= tolerance:
        raise TrainingError(f"{path}: read back it gives y that differ by {worst:.2e}, allowed {tolerance:.0e}; the file is not what was trained")
    return worst
