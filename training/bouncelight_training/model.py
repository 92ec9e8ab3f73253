"""The compact U-Net: additive skips, no normalisation, no dropout, 3x3 convolutions and ReLU.

The topology stands in one place, `bouncelight_weights.unet`, as the list of operators that is also exported; here it gets
its starting weights and its meaning: E/pi = s * exp(clamp(y, -10, 6)).
"""
import torch
from torch import nn

from .features import CHANNELS, Y_MAX, Y_MIN
from .weights import GraphNet, unet

WIDTHS = (16, 24, 32, 48)


def compact_unet(widths=WIDTHS, channels=CHANNELS, bias=(0.0, 0.0, 0.0)):
    """[n,21,h,w] features to [n,3,h,w] y, any h and w. The last layer starts with zero weights and `bias`, so that an
    untrained network gives the constant s * exp(bias)."""
    model = GraphNet(*unet(channels, tuple(widths)))
    for op in model.graph:
        if op["op"] == "conv2d":
            layer = model.get_submodule(op["name"])
            nn.init.kaiming_normal_(layer.weight, nonlinearity="relu" if op["activation"] == "relu" else "linear")
            nn.init.zeros_(layer.bias)
    nn.init.zeros_(layer.weight)
    with torch.no_grad():
        layer.bias.copy_(torch.as_tensor(bias))
    return model


def light(y):
    """E/pi in units of s from the network's output."""
    return torch.exp(torch.clamp(y, Y_MIN, Y_MAX))


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
