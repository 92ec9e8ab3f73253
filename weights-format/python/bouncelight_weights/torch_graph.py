"""The PyTorch module that a graph describes (optional; the rest of the package does without PyTorch)."""

import torch
from torch import nn
from torch.nn import functional as F

from .graph import complete, inner_size
from .operators import sides

_ACTIVATIONS = {"none": lambda x: x, "relu": F.relu, "tanh": torch.tanh, "sigmoid": torch.sigmoid, "silu": F.silu,
                "softplus": F.softplus, "exp": torch.exp}


def activation(spelt):
    """The function that a file spells as a word, or as {"leaky_relu": slope}."""
    return (lambda x: F.leaky_relu(x, spelt["leaky_relu"])) if isinstance(spelt, dict) else _ACTIVATIONS[spelt]


def _module(op):
    """The module that holds an operator's trained numbers, or None."""
    kind = op["op"]
    if kind == "conv2d":
        # Padding is done by `_pad`, since it may differ from side to side.
        return nn.Conv2d(op["in_channels"], op["out_channels"], tuple(op["kernel"]), stride=op["stride"], groups=op["groups"],
                         bias=op["bias"])
    if kind == "conv_transpose2d":
        return nn.ConvTranspose2d(op["in_channels"], op["out_channels"], tuple(op["kernel"]), stride=op["stride"],
                                  padding=op["padding"], output_padding=op["output_padding"], bias=op["bias"])
    if kind == "batch_norm":
        module = nn.BatchNorm2d(op["channels"], eps=op["eps"], affine=op["affine"])
        # Counts training steps, which no weights file needs.
        module.num_batches_tracked = None
        return module
    if kind == "instance_norm":
        return nn.InstanceNorm2d(op["channels"], eps=op["eps"], affine=op["affine"])
    if kind == "group_norm":
        return nn.GroupNorm(op["groups"], op["channels"], eps=op["eps"], affine=op["affine"])
    return None


def _pad(x, padding):
    left, top, right, bottom = sides(padding)
    return F.pad(x, (left, right, top, bottom))


class GraphNet(nn.Module):
    """Runs a list of operators. Parameters carry the operators' names, so `state_dict()` is what `write` takes. In training mode
    dropout drops, as PyTorch does it."""

    def __init__(self, graph, output):
        super().__init__()
        self.graph, self.output = graph, output
        for op in complete(graph):
            module = _module(op)
            if module is not None:
                self._place(op["name"], module)

    def _place(self, name, module):
        parent = self
        *path, leaf = name.split(".")
        for part in path:
            if part not in dict(parent.named_children()):
                parent.add_module(part, nn.Module())
            parent = getattr(parent, part)
        parent.add_module(leaf, module)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """x: [N, C, H, W] → [N, C_out, H, W], for sizes at which all tensors fit together."""
        t = {"input": x}
        for op in complete(self.graph):
            t[op["output"]] = self._run(op, t)
        return t[self.output]

    def padded(self, x: torch.Tensor) -> torch.Tensor:
        """`forward` for any size: the last row and column are repeated up to `inner_size`, and the output is cropped."""
        height, width = x.shape[-2:]
        inner_w, inner_h = inner_size(complete(self.graph), x.shape[1], width, height)
        y = self(F.pad(x, (0, inner_w - width, 0, inner_h - height), mode="replicate"))
        return y[..., :-(-y.shape[-2] * height // inner_h), :-(-y.shape[-1] * width // inner_w)]

    def _run(self, op, t):
        kind, act = op["op"], activation(op.get("activation", "none"))
        x = t[op["input"]] if "input" in op else None
        if kind == "conv2d":
            y = self.get_submodule(op["name"])(_pad(x, op["padding"]))
            if op["add"] is None:
                return act(y)
            return act(y + t[op["add"]]) if op["add_at"] == "before_activation" else act(y) + t[op["add"]]
        if kind == "instance_norm" and x.shape[-2:] == (1, 1):
            # PyTorch refuses one pixel in training mode; its deviation from its own mean is 0.
            module = self.get_submodule(op["name"])
            return act(torch.zeros_like(x) if module.bias is None else module.bias[None, :, None, None].expand_as(x))
        if kind in ("conv_transpose2d", "batch_norm", "instance_norm", "group_norm"):
            return act(self.get_submodule(op["name"])(x))
        if kind.startswith("upsample"):
            size = t[op["size_as"]].shape[-2:] if op["size_as"] is not None else [n * op["scale"] for n in x.shape[-2:]]
            if kind == "upsample_nearest":
                return F.interpolate(x, size=size, mode="nearest")
            return F.interpolate(x, size=size, mode="bilinear", align_corners=False)
        if kind == "pad":
            return _pad(x, op["padding"])
        if kind == "concat":
            return torch.cat([t[name] for name in op["inputs"]], 1)
        if kind == "add":
            return act(t[op["inputs"][0]] + t[op["inputs"][1]])
        if kind == "activation":
            return act(x)
        if kind == "dropout":
            return F.dropout(x, op["p"], self.training)
        raise ValueError(f"operator `{kind}` is unknown")
