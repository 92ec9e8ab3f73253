"""What is minimised, and what is reported.

Targets hold path-tracing noise. The relative square (p - t)^2 / (p' + eps)^2, p' taken as a constant, has its minimum at the
mean of the noisy targets (Lehtinen et al. 2018); L1 and logarithmic losses have it at their median, which is too dark.
"""
import torch
import torch.nn.functional as F

POOL = 4


def relative_square(prediction, target, mask, epsilon):
    """Mean over the kept cells; prediction and target [n,3,h,w] in units of s, mask [n,h,w]."""
    weight = mask.unsqueeze(1).to(prediction.dtype)
    error = (prediction - target) / (prediction.detach() + epsilon)
    return (error * error * weight).sum() / (3 * weight.sum()).clamp(min=1)


def tonemapped_difference(prediction, target, mask, albedo, direct):
    """Mean |difference| of x/(1+x) of the composite. Only for targets without noise (see above), as a late term."""
    weight = mask.unsqueeze(1).to(prediction.dtype)
    a, b = albedo * (direct + prediction), albedo * (direct + target.clamp(min=0))
    return ((a / (1 + a) - b / (1 + b)).abs() * weight).sum() / (3 * weight.sum()).clamp(min=1)


def pooled(x, mask, size=POOL):
    """Means over size x size cells of the kept ones, and which blocks are at least half kept."""
    weight = mask.unsqueeze(1).to(x.dtype)
    share = F.avg_pool2d(weight, size)
    mean = F.avg_pool2d(x * weight, size) / share.clamp(min=1e-6)
    return mean, share[:, 0] >= 0.5


def pooled_error(prediction, target, mask):
    """(sum |dE|, sum E) over blocks of 4x4 cells: their ratio is the error that the project quotes. Units of the arguments."""
    p, kept = pooled(prediction, mask)
    t, _ = pooled(target, mask)
    kept = kept.unsqueeze(1)
    return ((p - t).abs() * kept).sum().item(), (t * kept).sum().item()
