"""Training for the numbers that a file stores: half floats, or bytes with one scale for each output channel.

In the last part of a run (`--quantise i8 --quantise-from 0.8`) forward and backward see the rounded weights and the step moves the
true ones, as if rounding had slope 1 (the straight-through estimator). What is validated is the rounded average, which is what
`export` writes: the rounding here is `bouncelight_weights.quantised`'s, to the bit.
"""
import contextlib

import torch

from .errors import TrainingError

KINDS = ("", "f16", "i8")
# A scale is never below the smallest normal number.
TINY = torch.finfo(torch.float32).tiny


def check(kind):
    """Raises TrainingError where nothing is known of a storage."""
    if kind not in KINDS:
        raise TrainingError(f"no such storage: {kind}; there are f16 and i8")


def rounded(values, axis, kind):
    """A tensor's values as a file of `kind` gives them back. `axis`: the one of output channels for a convolution's weights, else None."""
    if kind == "f16":
        return values.half().float()
    if kind != "i8" or axis is None:
        return values
    others = [i for i in range(values.dim()) if i != axis]
    scale = (values.abs().amax(others, keepdim=True) / 127).clamp(min=TINY)
    return (values / scale).round() * scale


def axes(model):
    """The axis of output channels of each convolution's weights, by tensor name."""
    kinds = {"conv2d": 0, "conv_transpose2d": 1}
    return {f"{op['name']}.weight": kinds[op["op"]] for op in model.graph if op["op"] in kinds}


@torch.no_grad()
def round_(model, kind):
    """Rounds a network's numbers in place; returns it."""
    check(kind)
    known = axes(model)
    for name, values in model.state_dict().items():
        values.copy_(rounded(values, known.get(name), kind))
    return model


@contextlib.contextmanager
def rounding(model, kind):
    """The network is rounded inside, and has its own numbers again after it; gradients made inside stay."""
    if not kind:
        yield
        return
    kept = {name: values.clone() for name, values in model.state_dict().items()}
    round_(model, kind)
    try:
        yield
    finally:
        with torch.no_grad():
            for name, values in model.state_dict().items():
                values.copy_(kept[name])
