"""The compact U-Net: additive skips, no normalisation, no dropout, 3x3 convolutions and ReLU.

Each parameter's name is the name of the operator that uses it in the weights file (`<operator>.weight`, `<operator>.bias`).
"""
import torch
import torch.nn.functional as F
from torch import nn

from .features import CHANNELS, Y_MAX, Y_MIN

WIDTHS = (16, 24, 32, 48)


def conv(inputs, outputs, size=3, stride=1):
    return nn.Conv2d(inputs, outputs, size, stride, padding=size // 2)


class CompactUNet(nn.Module):
    """[n,21,h,w] features to [n,3,h,w] y with E/pi = s * exp(clamp(y, -10, 6)); any h and w.

    The last layer starts with zero weights and `bias`, so an untrained network gives the constant s * exp(bias)."""

    def __init__(self, widths=WIDTHS, channels=CHANNELS, bias=(0.0, 0.0, 0.0)):
        super().__init__()
        self.widths, self.channels = tuple(widths), channels
        a, b, c, d = widths
        self.enc0_a, self.enc0_b = conv(channels, a), conv(a, a)
        self.down1_a, self.down1_b = conv(a, b, stride=2), conv(b, b)
        self.down2_a, self.down2_b = conv(b, c, stride=2), conv(c, c)
        self.down3_a, self.down3_b, self.down3_c = conv(c, d, stride=2), conv(d, d), conv(d, d)
        self.up2_a, self.up2_b = conv(d, c, 1), conv(c, c)
        self.up1_a, self.up1_b = conv(c, b, 1), conv(b, b)
        self.up0_a, self.up0_b = conv(b, a, 1), conv(a, a)
        self.head = conv(a, 3)
        for name, module in self.named_children():
            if name != "head":
                nn.init.kaiming_normal_(module.weight, nonlinearity="linear" if name in ("up2_a", "up1_a", "up0_a") else "relu")
                nn.init.zeros_(module.bias)
        nn.init.zeros_(self.head.weight)
        with torch.no_grad():
            self.head.bias.copy_(torch.as_tensor(bias))

    def forward(self, x):
        e0 = F.relu(self.enc0_b(F.relu(self.enc0_a(x))))
        e1 = F.relu(self.down1_b(F.relu(self.down1_a(e0))))
        e2 = F.relu(self.down2_b(F.relu(self.down2_a(e1))))
        e3 = F.relu(self.down3_c(F.relu(self.down3_b(F.relu(self.down3_a(e2))))))
        x = F.relu(self.up2_b(upsampled(self.up2_a(e3), e2) + e2))
        x = F.relu(self.up1_b(upsampled(self.up1_a(x), e1) + e1))
        x = F.relu(self.up0_b(upsampled(self.up0_a(x), e0) + e0))
        return self.head(x)


def upsampled(x, like):
    return F.interpolate(x, size=like.shape[-2:], mode="bilinear", align_corners=False)


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
    with torch.no_grad():
        model(torch.zeros(1, model.channels, height, width))
    for hook in hooks:
        hook.remove()
    return total
