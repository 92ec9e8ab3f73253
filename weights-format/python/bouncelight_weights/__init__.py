"""Write, read and verify bouncelight weights files (numpy and safetensors only).

The specification is ../../README.md. `torch_graph` in this package (optional, needs PyTorch) builds the module that a graph
describes, so that the topology stands in one place: the list of operators.

    from bouncelight_weights import write, read, verify, unet
    graph, output = unet(in_channels=21)
    write("net.safetensors", state_dict, document(graph, output, provenance={...}))
"""

import json
import os
import tempfile

import numpy as np
from safetensors import safe_open
from safetensors.numpy import save

VERSION = 1
KEY = "bouncelight"
SCREEN_V1 = (
    ("direct", 3), ("outgoing", 3), ("albedo", 3), ("normal", 3), ("position", 3),
    ("depth", 1), ("spread", 1), ("hit", 1), ("sky", 3),
)
MEANINGS = ("log_irradiance_over_exposure", "plain")
_FIELDS = {
    "conv2d": ({"name", "input", "output", "in_channels", "out_channels", "kernel"},
               {"stride", "padding", "activation", "add", "add_at"}),
    "upsample_bilinear": ({"name", "input", "size_as", "output"}, set()),
    "add": ({"name", "inputs", "output"}, {"activation"}),
}


class WeightsError(ValueError):
    """A weights file, or what should become one, is wrong; `problems` lists every fault."""

    def __init__(self, path, problems):
        super().__init__(f"{path}:" + "".join(f"\n  {p}" for p in problems))
        self.problems = problems


def conv2d(name, input, output, in_channels, out_channels, kernel=3, stride=1, padding=None, activation="none", **rest):
    """One convolution; `padding` defaults to kernel // 2."""
    return {"op": "conv2d", "name": name, "input": input, "output": output, "in_channels": in_channels,
            "out_channels": out_channels, "kernel": [kernel, kernel], "stride": stride,
            "padding": kernel // 2 if padding is None else padding, "activation": activation, **rest}


def unet(in_channels=21, widths=(16, 24, 32, 48), out_channels=3):
    """The compact U-Net: (graph, output tensor's name). Additive skips, 1x1 before each upsampling, no normalisation."""
    graph, level = [], "input"
    channels = in_channels
    last = len(widths) - 1
    for i, width in enumerate(widths):
        block = "enc0" if i == 0 else f"down{i}"
        convs = 3 if i == last else 2
        for j in range(convs):
            letter = "abc"[j]
            output = f"e{i}" if j == convs - 1 else f"{block}.{letter}"
            stride = 2 if i > 0 and j == 0 else 1
            graph.append(conv2d(f"{block}.{letter}", level, output, channels, width, stride=stride, activation="relu"))
            level, channels = output, width
    for i in range(last - 1, -1, -1):
        width, block = widths[i], f"up{i}"
        graph += [
            conv2d(f"{block}.lateral", level, f"{block}.lateral", channels, width, kernel=1),
            {"op": "upsample_bilinear", "name": f"{block}.upsample", "input": f"{block}.lateral", "size_as": f"e{i}",
             "output": f"{block}.upsample"},
            {"op": "add", "name": f"{block}.skip", "inputs": [f"{block}.upsample", f"e{i}"], "output": f"{block}.skip"},
            conv2d(f"{block}.conv", f"{block}.skip", f"d{i}", width, width, activation="relu"),
        ]
        level, channels = f"d{i}", width
    graph.append(conv2d("head", level, "y", channels, out_channels))
    return graph, "y"


def document(graph, output_tensor, *, inputs=SCREEN_V1, table=("screen", 1), cell=4, meaning=MEANINGS[0], output_channels=3,
             licence="MIT OR Apache-2.0", name="", provenance=None):
    """The JSON document of a file. `inputs`: pairs of feature name and channels, in table order."""
    return {
        "version": VERSION, "name": name, "licence": licence,
        "table": {"name": table[0], "version": table[1]},
        "inputs": [{"name": n, "channels": c} for n, c in inputs],
        "cell": cell,
        "output": {"tensor": output_tensor, "meaning": meaning, "channels": output_channels},
        "graph": graph, "provenance": provenance or {},
    }


def check(tensors, doc):
    """Every fault of `doc` (dict) with `tensors` (name to array) as a list of sentences; empty when sound."""
    problems = []
    if doc.get("version") != VERSION:
        return [f"document version {doc.get('version')!r}; known: {VERSION}"]
    missing = {"licence", "table", "inputs", "cell", "output", "graph"} - doc.keys()
    if missing:
        return [f"document lacks {sorted(missing)}"]
    if doc["table"].get("version") != 1 or doc["table"].get("name") not in ("screen", "free"):
        problems.append(f"feature table {doc['table']} is unknown")
    elif doc["table"]["name"] == "screen":
        order = [n for n, _ in SCREEN_V1]
        used = [f["name"] for f in doc["inputs"]]
        problems += [f"input feature {f}: not in table screen" for f in doc["inputs"] if (f["name"], f["channels"]) not in SCREEN_V1]
        if used != [n for n in order if n in used]:
            problems.append("input features are not in the table's order, or one stands twice")
    if doc["output"].get("meaning") not in MEANINGS:
        problems.append(f"output meaning {doc['output'].get('meaning')!r} is unknown")
    channels = {"input": sum(f["channels"] for f in doc["inputs"])}
    wanted, names = {}, set()
    for i, op in enumerate(doc["graph"]):
        kind, where = op.get("op"), f"graph[{i}] `{op.get('name', '?')}`"
        if kind not in _FIELDS:
            problems.append(f"{where}: operator `{kind}` is unknown")
            continue
        need, may = _FIELDS[kind]
        fields = set(op) - {"op"}
        if need - fields or fields - need - may:
            problems.append(f"{where}: missing fields {sorted(need - fields)}, unknown fields {sorted(fields - need - may)}")
            continue
        if op["name"] in names:
            problems.append(f"{where}: name occurs twice")
        names.add(op["name"])
        reads = op["inputs"] if kind == "add" else [op["input"]] + [op[k] for k in ("size_as", "add") if op.get(k)]
        problems += [f"{where}: reads `{t}`, which nothing before it writes" for t in reads if t not in channels]
        if op["output"] in channels:
            problems.append(f"{where}: tensor `{op['output']}` exists already")
        out = channels.get(reads[0], 0)
        if kind == "conv2d":
            if channels.get(op["input"], op["in_channels"]) != op["in_channels"]:
                problems.append(f"{where}: `{op['input']}` has {channels[op['input']]} channels, not {op['in_channels']}")
            out = op["out_channels"]
            wanted[f"{op['name']}.weight"] = (out, op["in_channels"], *op["kernel"])
            wanted[f"{op['name']}.bias"] = (out,)
        others = reads[1:] if kind == "add" else [op["add"]] if op.get("add") else []
        problems += [f"{where}: `{t}` has {channels[t]} channels, not {out}" for t in others if channels.get(t, out) != out]
        channels[op["output"]] = out
    tensor = doc["output"].get("tensor")
    if channels.get(tensor) != doc["output"].get("channels") or tensor == "input":
        problems.append(f"output tensor `{tensor}` is not written with {doc['output'].get('channels')} channels")
    for t, shape in wanted.items():
        if t not in tensors:
            problems.append(f"tensor `{t}` is missing")
            continue
        value = np.asarray(tensors[t])
        if value.shape != shape:
            problems.append(f"tensor `{t}` has shape {value.shape}, the graph needs {shape}")
        if value.dtype not in (np.float32, np.float16):
            problems.append(f"tensor `{t}` holds {value.dtype}; float32 and float16 are read")
        elif not np.isfinite(value).all():
            problems.append(f"tensor `{t}` holds values that are not finite")
    problems += [f"tensor `{t}` is used by no operator" for t in tensors if t not in wanted]
    return problems


def write(path, tensors, doc):
    """Checks and writes one file whole or not at all. `tensors`: name to array (or PyTorch tensor), as in a state dict."""
    arrays = {k: np.ascontiguousarray(v.detach().cpu().numpy() if hasattr(v, "detach") else v) for k, v in tensors.items()}
    problems = check(arrays, doc)
    if problems:
        raise WeightsError(path, problems)
    data = save(arrays, metadata={KEY: json.dumps(doc, sort_keys=True, separators=(",", ":"))})
    folder = os.path.dirname(os.path.abspath(path))
    handle, temporary = tempfile.mkstemp(dir=folder, suffix=".part")
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(temporary, 0o644)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def read(path):
    """(tensors, document) of a file; raises WeightsError when it is not sound."""
    with safe_open(path, framework="np") as file:
        text = (file.metadata() or {}).get(KEY)
        if text is None:
            raise WeightsError(path, [f"metadata key `{KEY}` is missing"])
        tensors = {k: file.get_tensor(k) for k in file.keys()}
    doc = json.loads(text)
    problems = check(tensors, doc)
    if problems:
        raise WeightsError(path, problems)
    return tensors, doc


def verify(path):
    """List of faults of the file at `path`; empty when it is sound."""
    try:
        read(path)
    except WeightsError as error:
        return error.problems
    except Exception as error:  # The container's own reader raises several kinds.
        return [f"not a readable safetensors file: {error}"]
    return []
