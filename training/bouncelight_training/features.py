"""The feature table that the rasteriser writes and the network reads, and the colours hidden in it.

All radiance enters as ln(1 + L/s) with s the picture's exposure, so multiplying every light by one number changes neither
the network's input nor its output: what it makes of s and of the first guess is linear in light by construction.
"""
import numpy as np

TABLE = [("direct", 3), ("outgoing", 3), ("albedo", 3), ("normal", 3), ("position", 3), ("depth", 1), ("spread", 1), ("hit", 1), ("sky", 3), ("guess", 3)]
NAMES = tuple(n for n, _ in TABLE)
CHANNELS = sum(n for _, n in TABLE)
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)
# Of the answer, |g| and |r|, while it is learnt: wider than the program keeps them (src/gi/neural/reconstruct.rs), since a number at its limit has no slope.
MOST_GAIN, MOST_ADDED = 2.0, 1.0
# And as the program keeps them.
APPLIED_GAIN, APPLIED_ADDED = 0.3, 0.1

_offset = 0
SLICES = {}
for _name, _n in TABLE:
    SLICES[_name] = slice(_offset, _offset + _n)
    _offset += _n


def channels_of(names):
    """Channels of some features, as a list of indices."""
    return [c for name, _ in TABLE if name in names for c in range(SLICES[name].start, SLICES[name].stop)]


def light_of(features, name):
    """A light feature ("direct", "outgoing", "sky" or "guess") in units of s: float32 [3,h,w]."""
    return np.expm1(features[SLICES[name]].astype(np.float32))


def channel_means(features):
    """What the exposure is the luminance of: the mean over cells of direct + emitted + environment, units of s: [3]."""
    direct, sky = light_of(features, "direct"), light_of(features, "sky")
    emitted = light_of(features, "outgoing") - features[SLICES["albedo"]].astype(np.float32) * direct
    # Float16 leaves noise of either sign where nothing glows.
    emitted = np.where(emitted > 0.01, emitted, 0.0)
    return (direct + emitted + sky).mean((1, 2))
