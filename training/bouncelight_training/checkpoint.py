"""How a run is kept on disk, and how it is asked to end."""
import torch

from .errors import TrainingError


class Stop(Exception):
    """Somebody asked the run to end; its state is saved first."""


def read_checkpoint(path):
    """A checkpoint's dictionary (plain tensors and numbers only)."""
    try:
        return torch.load(path, map_location="cpu", weights_only=True)
    except Exception as error:  # torch raises many types for a damaged file
        raise TrainingError(f"{path}: not a readable checkpoint: {error}") from error
