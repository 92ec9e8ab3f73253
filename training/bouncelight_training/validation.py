"""How a network does on views that it does not learn from."""
import torch

from . import losses
from .features import channels_of, light_of
from .model import light


def validate(model, split, config, device="cpu", draw=4):
    """Loss and pooled error over a split, and the predictions of the views that are drawn (one a room first)."""
    channels = channels_of(config.features)
    loss = above = below = 0.0
    first = {}
    for i, room in enumerate(split.room):
        first.setdefault(int(room), i)
    drawn, predicted = list(first.values())[:draw], {}
    with torch.no_grad():
        for i in range(len(split)):
            features, target, mask = (torch.from_numpy(a[i:i + 1]) for a in (split.features, split.target, split.mask))
            features = features.float().to(device, memory_format=torch.channels_last)
            prediction = light(model(features[:, channels]), features).clamp(min=0).cpu().contiguous()
            target = target.float()
            loss += losses.relative_square(prediction, target, mask, config.epsilon).item() / len(split)
            # Back to E/pi: pictures are weighed by their light, as on a screen.
            difference, light_sum = losses.pooled_error(prediction * float(split.scale[i]), target * float(split.scale[i]), mask)
            above, below = above + difference, below + light_sum
            if i in drawn:
                predicted[i] = prediction[0].numpy()
    return {"validation_loss": loss, "validation_error": above / max(below, 1e-20)}, predicted


def guess_error(split):
    """The pooled error of the first guess, which an untrained network has too."""
    above = below = 0.0
    for i in range(len(split)):
        guess = torch.from_numpy(light_of(split.features[i], "guess"))[None]
        difference, light_sum = losses.pooled_error(guess * float(split.scale[i]), torch.from_numpy(split.target[i:i + 1]).float() * float(split.scale[i]),
                                                    torch.from_numpy(split.mask[i:i + 1]))
        above, below = above + difference, below + light_sum
    return above / max(below, 1e-20)
