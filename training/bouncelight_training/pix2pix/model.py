"""The published networks as lists of operators and modules, of any base width.

The generator's operators carry the published code's module names, so its `state_dict()` has the published keys and
`bouncelight weights convert --arch pix2pix` takes it; the graph is the one that this conversion makes. The discriminator is
PatchGAN's: four halving blocks and one answer for each patch.
"""
import torch
from torch import nn

from ..errors import TrainingError
from ..weights import GraphNet
from .pairs import PICTURES  # noqa: F401

INPUTS, OUTPUTS, LEAK, GROUPS, EPS = 12, 3, 0.2, 2, 1e-5
NORMS = ("group", "instance", "batch")
# In down4 to down8 and up1 to up4.
DROPOUT = 0.5
# A width or height that is no multiple of this is padded: eight halvings with skips.
MULTIPLE = 256


def multiple(step):
    """Channels after down step `step` (1 to 8) in base widths."""
    return 2 ** min(step - 1, 3)


def _norm(kind, name, source, output, channels, activation):
    op = {"op": f"{kind}_norm", "name": name, "input": source, "channels": channels, "eps": EPS, "affine": True, "activation": activation, "output": output}
    return op | ({"groups": GROUPS} if kind == "group" else {})


def _conv(kind, name, source, output, channels, **more):
    return {"op": kind, "name": name, "input": source, "in_channels": channels[0], "out_channels": channels[1], "kernel": [4, 4], "padding": 1, "activation": "none",
            "output": output, **more}


def generator_graph(width, norm="group"):
    """The generator's operators and its output's name."""
    if norm not in NORMS:
        raise TrainingError(f"no such norm: {norm}; there are {', '.join(NORMS)}")
    leaky, graph, source, channels = {"leaky_relu": LEAK}, [], "input", INPUTS
    for i in range(1, 9):
        module, out, last = f"down{i}.model", width * multiple(i), f"d{i}"
        normed = f"{module}.normed" if i >= 4 else last
        if i in (1, 8):
            graph.append(_conv("conv2d", f"{module}.0", source, normed, (channels, out), stride=2, bias=False, activation=leaky))
        else:
            graph.append(_conv("conv2d", f"{module}.0", source, f"{module}.conv", (channels, out), stride=2, bias=False))
            graph.append(_norm(norm, f"{module}.1", f"{module}.conv", normed, out, leaky))
        if i >= 4:
            graph.append({"op": "dropout", "name": f"{module}.{2 if i == 8 else 3}", "input": normed, "p": DROPOUT, "output": last})
        source, channels = last, out
    for i in range(1, 8):
        module, out, own = f"up{i}.model", width * multiple(8 - i), f"up{i}.model.normed"
        graph.append(_conv("conv_transpose2d", f"{module}.0", source, f"{module}.conv", (channels, out), stride=2, output_padding=0, bias=False))
        graph.append(_norm(norm, f"{module}.1", f"{module}.conv", own, out, "relu"))
        if i <= 4:
            graph.append({"op": "dropout", "name": f"{module}.3", "input": own, "p": DROPOUT, "output": f"{module}.dropped"})
            own = f"{module}.dropped"
        graph.append({"op": "concat", "name": f"up{i}.cat", "inputs": [own, f"d{8 - i}"], "output": f"u{i}"})
        source, channels = f"u{i}", 2 * out
    graph.append({"op": "upsample_nearest", "name": "final.0", "input": source, "scale": 2, "output": "final.up"})
    graph.append({"op": "pad", "name": "final.1", "input": "final.up", "padding": [1, 1, 0, 0], "output": "final.pad"})
    graph.append(_conv("conv2d", "final.2", "final.pad", "y", (channels, OUTPUTS), stride=1, bias=True, activation="tanh"))
    return graph, "y"


def first_numbers(module):
    """The published first values: weights from N(0, 0.02), norms' from N(1, 0.02), norms' biases 0, convolutions' as PyTorch has them."""
    for part in module.modules():
        if isinstance(part, (nn.Conv2d, nn.ConvTranspose2d)):
            nn.init.normal_(part.weight, 0.0, 0.02)
        elif isinstance(part, (nn.GroupNorm, nn.InstanceNorm2d, nn.BatchNorm2d)):
            nn.init.normal_(part.weight, 1.0, 0.02)
            nn.init.zeros_(part.bias)
    return module


def generator(width, norm="group"):
    """[n,12,h,w] pictures in [-1, 1] (depth, direct, diffuse, normal) to [n,3,h,w]; `padded` takes any h and w."""
    return first_numbers(GraphNet(*generator_graph(width, norm)))


class Discriminator(nn.Module):
    """A picture and the four it was made from, [n,3,h,w] and [n,12,h,w], to one number a patch: [n,1,h/16,w/16] logits."""

    def __init__(self, width):
        super().__init__()
        layers, channels = [], OUTPUTS + INPUTS
        for i in range(4):
            out = width * 2 ** i
            layers += [nn.Conv2d(channels, out, 4, 2, 1)] + ([nn.GroupNorm(GROUPS, out)] if i else []) + [nn.LeakyReLU(LEAK)]
            channels = out
        # Published with a row and a column of zeros before it, so that the answer keeps the size.
        self.model = nn.Sequential(*layers, nn.ZeroPad2d((1, 0, 1, 0)), nn.Conv2d(channels, 1, 4, padding=1, bias=False))

    def forward(self, picture: torch.Tensor, pictures: torch.Tensor) -> torch.Tensor:
        return self.model(torch.cat((picture, pictures), 1))
