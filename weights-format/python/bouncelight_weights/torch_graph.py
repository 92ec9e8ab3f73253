"""The PyTorch module that a graph describes (optional; the rest of the package does without PyTorch)."""

import torch
from torch import nn
from torch.nn import functional as F

_ACTIVATIONS = {"none": lambda x: x, "relu": F.relu}


class GraphNet(nn.Module):
    """Runs a list of operators. Parameters carry the operators' names, so `state_dict()` is what `write` takes."""

    def __init__(self, graph, output):
        super().__init__()
        self.graph, self.output = graph, output
        for op in graph:
            if op["op"] == "conv2d":
                self._place(op["name"], nn.Conv2d(op["in_channels"], op["out_channels"], tuple(op["kernel"]),
                                                  stride=op.get("stride", 1), padding=op.get("padding", 0)))

    def _place(self, name, module):
        parent = self
        *path, leaf = name.split(".")
        for part in path:
            if part not in dict(parent.named_children()):
                parent.add_module(part, nn.Module())
            parent = getattr(parent, part)
        parent.add_module(leaf, module)

    def forward(self, x: torch.Tensor) -> torch.Tensor:
        """x: [N, C, H, W] → [N, C_out, H, W]."""
        t = {"input": x}
        for op in self.graph:
            act = _ACTIVATIONS[op.get("activation", "none")]
            if op["op"] == "conv2d":
                y = self.get_submodule(op["name"])(t[op["input"]])
                if op.get("add") is None:
                    y = act(y)
                elif op.get("add_at", "before_activation") == "before_activation":
                    y = act(y + t[op["add"]])
                else:
                    y = act(y) + t[op["add"]]
            elif op["op"] == "upsample_bilinear":
                y = F.interpolate(t[op["input"]], size=t[op["size_as"]].shape[-2:], mode="bilinear", align_corners=False)
            elif op["op"] == "add":
                y = act(t[op["inputs"][0]] + t[op["inputs"][1]])
            else:
                raise ValueError(f"operator `{op['op']}` is unknown")
            t[op["output"]] = y
        return t[self.output]
