"""What is minimised, and what is reported.

Targets hold path-tracing noise. The relative square (p - t)^2 / (p' + eps)^2, p' taken as a constant, has its minimum at the
mean of the noisy targets (Lehtinen et al. 2018); L1 and logarithmic losses have it at their median, which is too dark.
"""
import torch
import torch.nn.functional as F

POOL = 4
LOUD = 0.04  # relative square of a picture; rooms with targets of 32 samples a pixel have about 0.02
DARK = 0.01  # light in units of s below which a picture is black anyway


def relative_square(prediction, target, mask, epsilon):
    """Mean over pictures of the means over their kept cells; prediction and target [n,3,h,w] in units of s, mask [n,h,w]. A picture with
    more than LOUD counts as one of LOUD: some are so noisy that their gradient would drown all others'."""
    weight = mask.unsqueeze(1).to(prediction.dtype)
    error = (prediction - target) / (prediction.detach().clamp(min=0) + epsilon)
    means = (error * error * weight).sum((1, 2, 3)) / (3 * weight.sum((1, 2, 3))).clamp(min=1)
    return (means / (means.detach() / LOUD).clamp(min=1)).mean()


def pooled(x, mask, size=POOL):
    """Means over size x size cells of the kept ones, and which blocks are at least half kept."""
    weight = mask.unsqueeze(1).to(x.dtype)
    share = F.avg_pool2d(weight, size)
    mean = F.avg_pool2d(x * weight, size) / share.clamp(min=1e-6)
    return mean, share[:, 0] >= 0.5


def picture_difference(prediction, target, mask, albedo, direct):
    """Mean |log2| of the ratio of the composites, after pooling 4x4 cells: Filmic encodes light as its logarithm, so this is
    what an L1 of the finished picture weighs. Pooling comes first because the median of single noisy targets is too dark;
    at 32 samples a pixel the mean of 16 cells holds about 6 % of noise. Arguments in units of s."""
    a, kept = pooled(albedo * (direct + prediction.clamp(min=0)), mask)
    b, _ = pooled(albedo * (direct + target), mask)
    difference = (torch.log2(a + DARK) - torch.log2(b.clamp(min=0) + DARK)).abs()
    weight = kept.unsqueeze(1).to(a.dtype)
    return (difference * weight).sum() / (3 * weight.sum()).clamp(min=1)


def pooled_error(prediction, target, mask, size=POOL):
    """(sum |dE|, sum E) over blocks of size x size cells: their ratio is the error that the project quotes. Units of the arguments."""
    p, kept = pooled(prediction, mask, size)
    t, _ = pooled(target, mask, size)
    kept = kept.unsqueeze(1)
    return ((p - t).abs() * kept).sum().item(), (t * kept).sum().item()
