"""Writes the fixture that the program's own learning (src/net/learn) is held against: losses, gradients and steps of PyTorch.

    python3 gradients.py            (in training/; writes ../tests/fixtures/learn/gradients.safetensors)

Two made-up pictures of 17x11 cells, one that the shipped network nearly answers rightly and one that is so wrong that it counts as one of
losses.LOUD. Of every tensor the norm of the gradient of their mean loss and its first values; then five steps of AdamW as train.py takes
them, with the loss before each, and the averages of a few tensors after them.
"""
import os

import numpy as np
import torch
from safetensors.numpy import save_file

from bouncelight_training import losses
from bouncelight_training.features import CHANNELS, SLICES
from bouncelight_training.model import light
from bouncelight_training.weights import GraphNet, read

HERE = os.path.dirname(os.path.abspath(__file__))
SHIPPED = os.path.join(HERE, "..", "assets", "weights", "small.safetensors")
OUT = os.path.join(HERE, "..", "tests", "fixtures", "learn", "gradients.safetensors")
W, H, FIRST, STEPS, RATE, EPSILON, EMA = 17, 11, 512, 5, 1e-3, 0.05, 0.99
AVERAGED = ("enc0.a.weight", "up1.conv.weight", "head.weight", "head.bias")


def pictures():
    """Features [2,24,h,w], target [2,3,h,w] in units of the exposure, mask [2,h,w]."""
    rng = np.random.default_rng(1)
    features = rng.uniform(0, 1, (2, CHANNELS, H, W)).astype(np.float32)
    guess = np.expm1(features[:, SLICES["guess"]])
    wrong = np.array([0.1, 1.5]).reshape(2, 1, 1, 1)
    target = (guess * np.exp(wrong * rng.standard_normal(guess.shape))).astype(np.float32)
    return features, target, rng.uniform(size=(2, H, W)) > 0.1


def network():
    """The shipped network, in the precision that the fixture is true to."""
    tensors, document = read(SHIPPED)
    model = GraphNet(document["graph"], document["output"]["tensor"])
    model.load_state_dict({name: torch.from_numpy(values.astype(np.float32)) for name, values in tensors.items()})
    return model.double()


def main():
    arrays = pictures()
    features, target = (torch.from_numpy(a).double() for a in arrays[:2])
    mask, model = torch.from_numpy(arrays[2]), network()
    loss_of = lambda: losses.relative_square(light(model(features), features), target, mask, EPSILON)
    optimiser = torch.optim.AdamW(model.parameters(), lr=RATE, weight_decay=1e-4)
    average = {name: p.detach().clone() for name, p in model.named_parameters()}
    out = {"features": arrays[0], "target": arrays[1], "mask": arrays[2].astype(np.float32)}
    steps = []
    for step in range(STEPS):
        optimiser.zero_grad()
        loss = loss_of()
        loss.backward()
        steps.append(loss.item())
        if step == 0:
            for name, p in model.named_parameters():
                out[f"gradient.{name}"] = p.grad.flatten()[:FIRST].float().numpy()
                out[f"norm.{name}"] = np.array([p.grad.norm().item()], np.float32)
        torch.nn.utils.clip_grad_norm_(model.parameters(), 1.0)
        optimiser.step()
        decay = min(EMA, (1 + step) / (10 + step))
        for name, p in model.named_parameters():
            average[name].lerp_(p.detach(), 1 - decay)
    out["losses"] = np.array(steps, np.float32)
    out |= {f"average.{name}": average[name].flatten().float().numpy() for name in AVERAGED}
    os.makedirs(os.path.dirname(OUT), exist_ok=True)
    save_file({name: np.ascontiguousarray(values) for name, values in out.items()}, OUT)
    print(f"{os.path.getsize(OUT)} bytes, losses {steps}")


if __name__ == "__main__":
    main()
