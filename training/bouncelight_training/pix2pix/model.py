"""The published networks as lists of operators and modules, of any base width.

The generators' operators carry the published codes' module names; the graphs are those that `bouncelight weights convert` makes of
published weights, and the Pix2Pix generator's `state_dict()` has the published keys. `gathered` is ours: the Pix2Pix generator given the picture with
the light of `gather` as well, which also goes around it, so that it paints what is to be changed. The discriminator is PatchGAN's:
four halving blocks and one answer for each patch.
"""
import torch
from torch import nn

from ..errors import TrainingError
from ..weights import GraphNet
from .views import GATHERED, PICTURES

INPUTS, OUTPUTS, LEAK, GROUPS, EPS = 12, 3, 0.2, 2, 1e-5
# Pictures, in the order in which each takes them, and how they are written in weights files.
NETWORKS = {"pix2pix": (PICTURES, "signed"), "gathered": ((*PICTURES, GATHERED), "signed"), "deep-illumination": (("diffuse", "direct", "normal", "depth"), "signed_stretched")}
AROUND = "around"
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


def _halvings(norm, graph, name, source, channels, out, last, steps):
    """A convolution that halves the picture; `steps`: its norm's name or None, its activation, its dropout's name or None."""
    normed, activation, dropout = steps
    module = name.removesuffix(".0")
    own = f"{module}.normed" if dropout else last
    graph.append(_conv("conv2d", name, source, f"{module}.conv" if normed else own, (channels, out[0]), stride=2, bias=out[1], **({} if normed else {"activation": activation})))
    if normed:
        graph.append(_norm(norm, normed, f"{module}.conv", own, out[0], activation))
    if dropout:
        graph.append({"op": "dropout", "name": dropout, "input": own, "p": DROPOUT, "output": last})


def generator_graph(width, norm="group", network="pix2pix"):
    """A generator's operators and its output's name."""
    if norm not in NORMS:
        raise TrainingError(f"no such norm: {norm}; there are {', '.join(NORMS)}")
    if network not in NETWORKS:
        raise TrainingError(f"no such network: {network}; there are {', '.join(NETWORKS)}")
    make = _deep_illumination if network == "deep-illumination" else _pix2pix
    graph = make(width, norm, 3 * len(NETWORKS[network][0]))
    if network == "gathered":
        graph.insert(-1, {"op": "conv2d", "name": AROUND, "input": "input", "in_channels": 15, "out_channels": OUTPUTS, "kernel": [1, 1], "bias": True, "output": "gathered.picture"})
        graph[-1] |= {"add": "gathered.picture", "add_at": "after_activation"}
    return graph, "y"


def _pix2pix(width, norm, channels):
    leaky, graph, source = {"leaky_relu": LEAK}, [], "input"
    for i in range(1, 9):
        module, out = f"down{i}.model", width * multiple(i)
        dropout = f"{module}.{2 if i == 8 else 3}" if i >= 4 else None
        _halvings(norm, graph, f"{module}.0", source, channels, (out, False), f"d{i}", (None if i in (1, 8) else f"{module}.1", leaky, dropout))
        source, channels = f"d{i}", out
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
    return graph


def _deep_illumination(width, norm, channels):
    """Thomas and Forbes 2018, each layer with a norm of its own (theirs shares one between layers of equal width)."""
    leaky, graph, source = {"leaky_relu": LEAK}, [], "input"
    for i in range(1, 9):
        out, last = width * multiple(i), f"encoder{i}"
        _halvings(norm, graph, f"conv{i}", source, channels, (out, True), last, (None if i in (1, 8) else f"conv{i}.batch_norm", "relu" if i == 8 else leaky, None))
        source, channels = last, out
    for i in range(1, 8):
        name, out, own = f"deconv{i}", width * multiple(8 - i), f"deconv{i}.normed"
        graph.append(_conv("conv_transpose2d", name, source, f"{name}.conv", (channels, out), stride=2, output_padding=0, bias=True))
        graph.append(_norm(norm, f"{name}.batch_norm", f"{name}.conv", own, out, "none"))
        if i <= 3:
            graph.append({"op": "dropout", "name": f"{name}.dropout", "input": own, "p": DROPOUT, "output": f"{name}.dropped"})
            own = f"{name}.dropped"
        graph.append({"op": "concat", "name": f"{name}.cat", "inputs": [own, f"encoder{8 - i}"], "output": f"{name}.joined"})
        graph.append({"op": "activation", "name": f"{name}.relu", "input": f"{name}.joined", "activation": "relu", "output": f"decoder{i}"})
        source, channels = f"decoder{i}", 2 * out
    graph.append(_conv("conv_transpose2d", "deconv8", source, "y", (channels, OUTPUTS), stride=2, output_padding=0, bias=True, activation="tanh"))
    return graph


def first_numbers(module):
    """The published first values: weights from N(0, 0.02), norms' from N(1, 0.02), norms' biases 0, convolutions' as PyTorch has them."""
    for part in module.modules():
        if isinstance(part, (nn.Conv2d, nn.ConvTranspose2d)):
            nn.init.normal_(part.weight, 0.0, 0.02)
        elif isinstance(part, (nn.GroupNorm, nn.InstanceNorm2d, nn.BatchNorm2d)):
            nn.init.normal_(part.weight, 1.0, 0.02)
            nn.init.zeros_(part.bias)
    return module


def generator(width, norm="group", network="pix2pix"):
    """[n,c,h,w] pictures in [-1, 1], in the order of NETWORKS, to [n,3,h,w]; `padded` takes any h and w."""
    made = first_numbers(GraphNet(*generator_graph(width, norm, network)))
    if network == "gathered":
        # It begins with the picture that it is given.
        around = made.get_submodule(AROUND)
        with torch.no_grad():
            around.weight.zero_()
            around.bias.zero_()
            around.weight[:, -OUTPUTS:, 0, 0] = torch.eye(OUTPUTS)
    return made


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
