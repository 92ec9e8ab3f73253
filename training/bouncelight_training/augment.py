"""Pictures that are as true as the rendered ones: colours exchanged, left and right exchanged.

Scaling all lights is not here because it would change nothing: features and target are in units of the exposure s.
"""
import numpy as np

from .features import LUMINANCE, SLICES, channel_means

COLOURED = ["direct", "outgoing", "albedo", "sky", "guess"]
LIGHTS = ["direct", "outgoing", "sky", "guess"]


def permute_colours(features, target, order, means=None):
    """Exchanges red, green and blue of lights, albedo and target together. The exposure is a luminance, so with coloured
    light it changes; everything in units of it is brought to the new one. `means`: channel_means of the whole picture, where the
    features are a window of it."""
    means = channel_means(features) if means is None else means
    features, target = features.copy(), target[list(order)]
    for name in COLOURED:
        features[SLICES[name]] = features[SLICES[name]][list(order)]
    ratio = float(LUMINANCE @ means[list(order)]) / max(float(LUMINANCE @ means), 1e-20)
    if abs(ratio - 1) > 1e-3:
        for name in LIGHTS:
            features[SLICES[name]] = np.log1p(np.expm1(features[SLICES[name]]) / ratio)
        target = target / ratio
    return features, target


def mirror(features, target, mask):
    """Exchanges left and right: x of the gravity frame turns round in normals and positions. (A cell's sample point is half
    a pixel right of its centre; mirrored it is half a pixel left. That is ignored.)"""
    features = features[..., ::-1].copy()
    for name in ("normal", "position"):
        features[SLICES[name].start] *= -1
    return features, target[..., ::-1], mask[..., ::-1]


def cropped(features, target, mask, width, rng):
    """A window of `width` cells, as high as the picture, at a random place; the network sees about so far."""
    left = int(rng.integers(0, max(mask.shape[-1] - width, 0) + 1))
    return features[..., left:left + width], target[..., left:left + width], mask[..., left:left + width]


def augmented(features, target, mask, rng, crop=0):
    """One of the twelve versions of a picture, or of a window `crop` cells wide (0: of all of it), float32."""
    means = channel_means(features)
    if crop:
        features, target, mask = cropped(features, target, mask, crop, rng)
    features, target = features.astype(np.float32), target.astype(np.float32)
    features, target = permute_colours(features, target, rng.permutation(3), means)
    if rng.random() < 0.5:
        features, target, mask = mirror(features, target, mask)
    return features, target, mask
