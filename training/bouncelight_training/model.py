"""What networks have in common, and what is counted of them."""
import torch
from torch import nn

# Slope below 0. With 0 (ReLU) whole runs died: every unit of a layer below 0 for all pictures, and no gradient back.
LEAK = 0.1


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
