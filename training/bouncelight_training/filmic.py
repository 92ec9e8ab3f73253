"""From scene light to what is shown: Blender's Filmic view (look None, display sRGB), as src/render/tonemap_curve.rs has it."""
import numpy as np

LIGHT_MAX = 65504.0


def filmic(light):
    """Display values in [0, 1] of linear Rec.709 light [..., 3]. Negative light and NaN count as none."""
    light = np.clip(np.nan_to_num(np.asarray(light, np.float32), nan=0.0, posinf=LIGHT_MAX, neginf=0.0), 0, LIGHT_MAX)
    # Far above white the darker channels are drawn towards the brightest.
    peak = np.minimum(light.max(-1, keepdims=True), 5898.24)
    share = np.clip(4.018064e-5 * (peak ** 1.2161947 - 19.18678), 0, 1)
    lifted = light + share * np.maximum(peak - light, 0)
    stops = np.log2(np.maximum(lifted, 1e-9)) + 12.473931
    u = np.clip(stops / 8.25 - 1, -1, 1)
    p = 0.28364078 + u * (0.63562186 + u * (0.5312596 + u * 0.18086761))
    q = 1 + u * (-0.83427715 + u * 1.4648784)
    return np.clip(p / q, 0, 1)


def shown(light):
    """`filmic` as bytes."""
    return (filmic(light) * 255 + 0.5).astype(np.uint8)
