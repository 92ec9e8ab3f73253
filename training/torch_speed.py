#!/usr/bin/env python3
"""Times one network in PyTorch on the best device that it has, for `cargo xtask gpu-report`; prints a JSON record.

    PYTHONPATH=weights-format/python python3 training/torch_speed.py assets/weights/filter.safetensors 256x128

The graph of the weights file becomes a PyTorch module, in channels-last layout, 32 bits, eager and compiled; each time is the fastest of
several runs that are waited for. The package that is needed is torch; where it is missing, the last line of the error says so.
"""

import argparse
import json
import time


def fastest(run, wait, seconds):
    """Milliseconds of the fastest run within the time, at least three."""
    run()
    wait()
    end, best, runs = time.perf_counter() + seconds, float("inf"), 0
    while runs < 3 or (time.perf_counter() < end and runs < 200):
        start = time.perf_counter()
        run()
        wait()
        best, runs = min(best, time.perf_counter() - start), runs + 1
    return best * 1e3


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("weights", help="weights file")
    parser.add_argument("size", help="WIDTHxHEIGHT of the network's input, cells")
    parser.add_argument("--seconds", type=float, default=60, help="time for everything")
    args = parser.parse_args()
    started = time.perf_counter()
    try:
        import torch
    except ImportError:
        raise SystemExit("python3 has no package torch")
    import numpy as np
    from bouncelight_weights import read
    from bouncelight_weights.torch_graph import GraphNet
    # 32 bits are meant: NVIDIA's tensor cores would round the products to 10 bits.
    torch.backends.cudnn.allow_tf32 = False
    torch.backends.cudnn.benchmark = True
    width, height = map(int, args.size.split("x"))
    device = "cuda" if torch.cuda.is_available() else "mps" if torch.backends.mps.is_available() else "cpu"
    tensors, document = read(args.weights)
    module = GraphNet(document["graph"], document["output"]["tensor"])
    module.load_state_dict({k: torch.from_numpy(np.array(v, np.float32)) for k, v in tensors.items()})
    module.eval().to(device=device, memory_format=torch.channels_last)
    channels = sum(i["channels"] for i in document["inputs"])
    x = torch.rand(1, channels, height, width, device=device).to(memory_format=torch.channels_last)

    def wait():
        if device == "cuda":
            torch.cuda.synchronize()
        elif device == "mps":
            torch.mps.synchronize()

    name = torch.cuda.get_device_name() if device == "cuda" else device
    record = {"version": torch.__version__, "device": name, "threads": torch.get_num_threads(), "cells": [width, height]}
    with torch.inference_mode():
        record["ms"] = round(fastest(lambda: module.padded(x), wait, 3), 4)
        record["compiled_ms"] = None
        # Compiling takes half a minute; the rest of the time may not be enough for it.
        if args.seconds - (time.perf_counter() - started) > 30:
            try:
                compiled = torch.compile(module.padded)
                record["compiled_ms"] = round(fastest(lambda: compiled(x), wait, 3), 4)
            except Exception as error:
                record["not_compiled"] = str(error).strip().splitlines()[-1]
    print(json.dumps(record))


if __name__ == "__main__":
    main()
