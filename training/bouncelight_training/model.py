"""The compact U-Net: additive skips, no normalisation, no dropout, 3x3 convolutions and leaky ReLU.

The topology stands in one place, `bouncelight_weights.unet`, as the list of operators that is also exported; here it gets
its starting weights and its meaning: a gain g and a rest r on what method `gather` answers,

    E/pi = max(0, guess * exp(clamp(g, -2, 2)) + s * clamp(r, -1, 1))
"""
import torch
from torch import nn

from .features import CHANNELS, MOST_ADDED, MOST_GAIN, SLICES
from .weights import GraphNet, unet

WIDTHS = (16, 24, 32, 48)
# Slope below 0. With 0 (ReLU) whole runs died: every unit of a layer below 0 for all pictures, and no gradient back.
LEAK = 0.1
MEANING, ANSWER = "gain_and_rest_on_guess", 6


def compact_unet(widths=WIDTHS, channels=CHANNELS, pointwise=0):
    """[n,24,h,w] features to [n,6,h,w] gain and rest, any h and w. The last layer starts with zero weights, so that an
    untrained network changes nothing. The first `pointwise` levels have 1x1 kernels."""
    model = GraphNet(*unet(channels, tuple(widths), ANSWER, pointwise, {"leaky_relu": LEAK}))
    for op in model.graph:
        if op["op"] == "conv2d":
            layer = model.get_submodule(op["name"])
            nn.init.kaiming_normal_(layer.weight, nonlinearity="linear" if op["activation"] == "none" else "leaky_relu", a=LEAK)
            nn.init.zeros_(layer.bias)
    nn.init.zeros_(layer.weight)
    return model


def light(answer, features):
    """E/pi in units of s from the network's answer; not cut off at 0, so that a loss can pull it up again."""
    guess = torch.expm1(features[:, SLICES["guess"]])
    gain, rest = answer[:, :3].clamp(-MOST_GAIN, MOST_GAIN), answer[:, 3:].clamp(-MOST_ADDED, MOST_ADDED)
    return guess * torch.exp(gain) + rest


def parameter_count(model):
    """Trainable numbers."""
    return sum(p.numel() for p in model.parameters())


def flops(model, height, width):
    """Multiplications and additions of the convolutions for one picture of height x width cells (2 per weight and place)."""
    total = 0

    def count(module, _, output):
        nonlocal total
        total += 2 * module.weight.numel() * output.shape[-1] * output.shape[-2]

    hooks = [m.register_forward_hook(count) for m in model.modules() if isinstance(m, nn.Conv2d)]
    first = next(model.parameters())
    with torch.no_grad():
        model(torch.zeros(1, model.graph[0]["in_channels"], height, width, device=first.device))
    for hook in hooks:
        hook.remove()
    return total
