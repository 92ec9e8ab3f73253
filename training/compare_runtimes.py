#!/usr/bin/env python3
"""Times one network in PyTorch, ONNX Runtime and bouncelight on the processor, in one run, interleaved.

    PYTHONPATH=weights-format/python python3 training/compare_runtimes.py assets/weights/filter.safetensors 256x128 \\
        --bouncelight "target/release/examples/network" --threads 2

The graph of the weights file becomes a PyTorch module (`bouncelight_weights.torch_graph`), which is exported to ONNX; the same
input of random numbers goes to all, the outputs are compared with PyTorch's in float64, and the runtimes take turns, so that other
work on the machine hits all alike. What is told for each is the fastest turn and the median of the ratios of its turns to ONNX
Runtime's of the same round. `--pix2pix WIDTH` writes the paper's generator with random weights to the named file first. Processor time
is that of all threads, divided by their number: what the clock would show on an idle machine whose cores are all busy. Packages: torch;
onnx and onnxruntime if that one is to be measured.
"""

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np


def arguments():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("weights", help="weights file")
    parser.add_argument("size", help="WIDTHxHEIGHT of the network's input")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=20)
    parser.add_argument("--bouncelight", metavar="PROGRAM", action="append", default=[],
                        help="example `network`, which answers on standard input and output; several are compared")
    parser.add_argument("--no-torch", action="store_true", help="do not time PyTorch")
    parser.add_argument("--pix2pix", type=int, metavar="WIDTH", help="write the paper's generator of this base width there first")
    parser.add_argument("--json", metavar="FILE", help="write the record there")
    return parser.parse_args()


class Torch:
    """PyTorch, eager."""

    def __init__(self, module, x, channels_last):
        import torch
        layout = torch.channels_last if channels_last else torch.contiguous_format
        self.torch, self.module = torch, module.to(memory_format=layout)
        self.x = torch.from_numpy(x).to(memory_format=layout)

    def run(self):
        start, used = time.perf_counter(), time.process_time()
        with self.torch.inference_mode():
            self.y = self.module.padded(self.x)
        return time.perf_counter() - start, time.process_time() - used

    def output(self):
        return self.y.numpy()


class Onnx:
    """ONNX Runtime's CPU provider, all graph optimisations."""

    def __init__(self, module, x, threads):
        import onnxruntime
        import torch
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "net.onnx")
            # The tracing exporter: it needs no further package, and a graph without branches traces exactly.
            torch.onnx.export(module, (torch.from_numpy(x),), path, dynamo=False, opset_version=18)
            options = onnxruntime.SessionOptions()
            options.intra_op_num_threads, options.inter_op_num_threads = threads, 1
            # Threads that wait must not burn the processor time that is measured.
            options.add_session_config_entry("session.intra_op.allow_spinning", "0")
            options.graph_optimization_level = onnxruntime.GraphOptimizationLevel.ORT_ENABLE_ALL
            self.session = onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])
        self.feed = {self.session.get_inputs()[0].name: x}

    def run(self):
        start, used = time.perf_counter(), time.process_time()
        self.y = self.session.run(None, self.feed)[0]
        return time.perf_counter() - start, time.process_time() - used

    def output(self):
        return self.y


class Bouncelight:
    """Our runtime in a process of its own: one line in, one run, its seconds in one line out; the output on request."""

    def __init__(self, program, weights, x):
        self.folder = tempfile.TemporaryDirectory()
        self.files = [os.path.join(self.folder.name, n) for n in ("in.f32", "out.f32")]
        x[0].tofile(self.files[0])
        self.shape = x.shape
        command = [*program.split(), weights, f"{x.shape[3]}x{x.shape[2]}", *self.files]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.run()

    def run(self):
        self.process.stdin.write("run\n")
        self.process.stdin.flush()
        wall, used = map(float, self.process.stdout.readline().split())
        return wall, used

    def output(self):
        self.process.stdin.write("write\n")
        self.process.stdin.flush()
        channels, height, width = map(int, self.process.stdout.readline().split())
        return np.fromfile(self.files[1], np.float32).reshape(1, channels, height, width)


def pix2pix(path, width):
    """The paper's generator, group norm, random weights. (The published code's graph, as `bouncelight weights convert` makes it.)"""
    import torch
    from bouncelight_weights import conv2d, document, write
    from bouncelight_weights.torch_graph import GraphNet
    leaky, graph = {"leaky_relu": 0.2}, []
    widths = [width * min(2 ** i, 8) for i in range(8)]
    level, channels = "input", 12
    for i, out in enumerate(widths, 1):
        normed = i not in (1, 8)
        graph.append(conv2d(f"down{i}.model.0", level, f"d{i}.conv" if normed else f"d{i}", channels, out, kernel=4, stride=2,
                            padding=1, activation="none" if normed else leaky, bias=False))
        if normed:
            graph.append({"op": "group_norm", "name": f"down{i}.model.1", "input": f"d{i}.conv", "channels": out, "groups": 2,
                          "activation": leaky, "output": f"d{i}"})
        level, channels = f"d{i}", out
    for i, out in enumerate([widths[6 - j] for j in range(7)], 1):
        graph.append({"op": "conv_transpose2d", "name": f"up{i}.model.0", "input": level, "in_channels": channels,
                      "out_channels": out, "kernel": [4, 4], "stride": 2, "padding": 1, "bias": False, "output": f"u{i}.conv"})
        graph.append({"op": "group_norm", "name": f"up{i}.model.1", "input": f"u{i}.conv", "channels": out, "groups": 2,
                      "activation": "relu", "output": f"u{i}.norm"})
        graph.append({"op": "concat", "name": f"up{i}.skip", "inputs": [f"u{i}.norm", f"d{8 - i}"], "output": f"u{i}"})
        level, channels = f"u{i}", out + widths[7 - i]
    graph.append({"op": "upsample_nearest", "name": "final.0", "input": level, "scale": 2, "output": "final.up"})
    graph.append(conv2d("final.2", "final.up", "y", channels, 3, kernel=4, padding=[2, 2, 1, 1], activation="tanh"))
    torch.manual_seed(1)
    module = GraphNet(graph, "y")
    inputs = [(name, 3) for name in ("depth", "direct", "diffuse", "normal")]
    write(path, module.state_dict(), document(graph, "y", inputs=inputs, table=("images", 1), cell=1, meaning="display_signed", output_channels=3,
                                              licence="CC0-1.0", name="pix2pix"))


def main():
    args = arguments()
    import torch
    from bouncelight_weights import read
    from bouncelight_weights.torch_graph import GraphNet
    torch.set_num_threads(args.threads)
    if args.pix2pix:
        pix2pix(args.weights, args.pix2pix)
    tensors, document = read(args.weights)
    module = GraphNet(document["graph"], document["output"]["tensor"])
    module.load_state_dict({k: torch.from_numpy(np.array(v, np.float32)) for k, v in tensors.items()})
    module.eval()
    width, height = map(int, args.size.split("x"))
    channels = sum(i["channels"] for i in document["inputs"])
    x = np.random.default_rng(1).standard_normal((1, channels, height, width)).astype(np.float32)
    with torch.inference_mode():
        exact = module.double().padded(torch.from_numpy(x).double()).numpy()
    module.float()
    runtimes = {}
    if not args.no_torch:
        runtimes = {"PyTorch": Torch(module, x, False), "PyTorch, channels last": Torch(module, x, True)}
    try:
        runtimes["ONNX Runtime"] = Onnx(module, x, args.threads)
    except ImportError as missing:
        print(f"without ONNX Runtime: {missing}", file=sys.stderr)
    for program in args.bouncelight:
        name = "bouncelight" if len(args.bouncelight) == 1 else f"bouncelight {program[-12:]}"
        runtimes[name] = Bouncelight(program, args.weights, x)
    turns = {name: [] for name in runtimes}
    for turn in range(args.rounds + 1):
        for name, runtime in runtimes.items():
            wall, used = runtime.run()
            if turn > 0:
                turns[name].append((wall * 1e3, used * 1e3 / args.threads))
    record = {"schema": 1, "weights": os.path.basename(args.weights), "size": [width, height], "threads": args.threads,
              "rounds": args.rounds, "load": os.getloadavg()[0], "torch": torch.__version__, "runtimes": {}}
    base = turns.get("ONNX Runtime") or next(iter(turns.values()))
    print(f"{record['weights']} at {args.size}, {args.threads} threads, {args.rounds} rounds, load {record['load']:.1f}")
    print(f"{'':<24}{'clock, ms':>20}{'processor time / threads, ms':>32}{'':>14}")
    print(f"{'':<24}{'fastest':>10}{'ratio':>10}{'fastest':>20}{'ratio':>12}{'max error':>14}")
    for name, runtime in runtimes.items():
        error = float(np.abs(runtime.output() - exact).max() / np.abs(exact).max())
        row = {"error": error}
        for i, kind in enumerate(("clock", "processor")):
            row[f"{kind}_ms"] = min(t[i] for t in turns[name])
            # Of the same round, so that other work on the machine hits both.
            row[f"{kind}_ratio"] = statistics.median(t[i] / b[i] for t, b in zip(turns[name], base))
        record["runtimes"][name] = row
        print(f"{name:<24}{row['clock_ms']:>10.2f}{row['clock_ratio']:>10.2f}{row['processor_ms']:>20.2f}"
              f"{row['processor_ratio']:>12.2f}{error:>14.1e}")
        if not error < 1e-3:
            sys.exit(f"{name} computes something else: relative error {error}")
    if args.json:
        with open(args.json, "w", encoding="utf-8") as file:
            json.dump(record, file, indent=1)


if __name__ == "__main__":
    main()
