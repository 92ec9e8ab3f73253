"""What is reported of light."""
import torch.nn.functional as F

POOL = 4


def pooled(x, mask, size=POOL):
    """Means over size x size cells of the kept ones, and which blocks are at least half kept."""
    weight = mask.unsqueeze(1).to(x.dtype)
    share = F.avg_pool2d(weight, size)
    mean = F.avg_pool2d(x * weight, size) / share.clamp(min=1e-6)
    return mean, share[:, 0] >= 0.5


def pooled_error(prediction, target, mask, size=POOL):
    """(sum |dE|, sum E) over blocks of size x size cells: their ratio is the error that the project quotes. Units of the arguments."""
    p, kept = pooled(prediction, mask, size)
    t, _ = pooled(target, mask, size)
    kept = kept.unsqueeze(1)
    return ((p - t).abs() * kept).sum().item(), (t * kept).sum().item()
