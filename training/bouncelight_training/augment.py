"""Pictures that are as true as the rendered ones: colours exchanged, left and right exchanged.

Scaling all lights is not here because it would change nothing: features and target are in units of the exposure s.
"""
import numpy as np

from .features import LUMINANCE, SLICES, channel_means

COLOURED = ["direct", "outgoing", "albedo", "sky"]
LIGHTS = ["direct", "outgoing", "sky"]


def permute_colours(features, target, order):
    """Exchanges red, green and blue of lights, albedo and target together. The exposure is a luminance, so with coloured
    light it changes; everything in units of it is brought to the new one."""
    features, target = features.copy(), target[list(order)]
    for name in COLOURED:
        features[SLICES[name]] = features[SLICES[name]][list(order)]
    before, means = float(LUMINANCE @ channel_means(features)[np.argsort(order)]), channel_means(features)
    ratio = float(LUMINANCE @ means) / max(before, 1e-20)
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


def augmented(features, target, mask, rng):
    """One of the twelve versions of a picture, float32."""
    features, target = features.astype(np.float32), target.astype(np.float32)
    features, target = permute_colours(features, target, rng.permutation(3))
    if rng.random() < 0.5:
        features, target, mask = mirror(features, target, mask)
    return features, target, mask
