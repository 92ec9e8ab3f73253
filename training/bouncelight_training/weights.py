"""The weights format's own Python package: as installed, or else from this repository."""
import os
import sys

try:
    import bouncelight_weights  # noqa: F401
except ImportError:
    sys.path.append(os.path.join(os.path.dirname(__file__), "..", "..", "weights-format", "python"))

from bouncelight_weights import WeightsError, document, quantised, read, unet, write  # noqa: E402, F401
from bouncelight_weights.torch_graph import GraphNet  # noqa: E402, F401
