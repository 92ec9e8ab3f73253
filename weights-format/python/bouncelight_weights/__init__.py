"""Write, read and verify bouncelight weights files, with numpy alone.

The specification is ../../README.md. `torch_graph` in this package (optional, needs PyTorch) builds the module that a graph
describes, so that the topology stands in one place: the list of operators.

    from bouncelight_weights import write, read, verify, unet
    graph, output = unet()
    write("net.safetensors", state_dict, document(graph, output, provenance={...}))
"""

import json
import os
import tempfile

import numpy as np

from . import container
from .document import CELLS_V1, CELLS_V2, IMAGES_V1, KEY, MEANINGS, OLDER_TABLES, SCALE_SUFFIX, TABLES, VERSION, check_tensors, schema
from .document import check as check_document
from .graph import complete
from .operators import OPERATORS, scaled_axis, tensors
from .problems import NotReadable, Problem, WeightsError

__all__ = ["CELLS_V1", "CELLS_V2", "IMAGES_V1", "KEY", "OPERATORS", "VERSION", "Problem", "WeightsError", "check", "compact", "conv2d", "document",
           "quantised", "read", "schema", "unet", "verify", "write"]


def conv2d(name, input, output, in_channels, out_channels, kernel=3, stride=1, padding=None, activation="none", **rest):
    """One convolution; `padding` defaults to kernel // 2."""
    return {"op": "conv2d", "name": name, "input": input, "output": output, "in_channels": in_channels,
            "out_channels": out_channels, "kernel": [kernel, kernel], "stride": stride,
            "padding": kernel // 2 if padding is None else padding, "activation": activation, **rest}


def unet(in_channels=15, widths=(16, 24, 32, 48), out_channels=12, pointwise=0, activation="relu"):
    """The compact U-Net: (graph, output tensor's name). Additive skips, 1x1 before each upsampling, no normalisation. The first
    `pointwise` levels look at single places only (1x1 kernels, one before the way down and one after the way up), which
    is a fifth of the arithmetic: for answers that are smooth along surfaces, and change from one to the next."""
    graph, level = [], "input"
    channels = in_channels
    last = len(widths) - 1
    for i, width in enumerate(widths):
        block = "enc0" if i == 0 else f"down{i}"
        small = i < pointwise
        convs = 3 if i == last else 1 if small else 2
        for j in range(convs):
            letter = "abc"[j]
            output = f"e{i}" if j == convs - 1 else f"{block}.{letter}"
            stride = 2 if i > 0 and j == 0 else 1
            kernel = 1 if small and stride == 1 else 3
            graph.append(conv2d(f"{block}.{letter}", level, output, channels, width, kernel, stride, activation=activation))
            level, channels = output, width
    for i in range(last - 1, -1, -1):
        width, block = widths[i], f"up{i}"
        graph += [
            conv2d(f"{block}.lateral", level, f"{block}.lateral", channels, width, kernel=1),
            {"op": "upsample_bilinear", "name": f"{block}.upsample", "input": f"{block}.lateral", "size_as": f"e{i}",
             "output": f"{block}.upsample"},
            {"op": "add", "name": f"{block}.skip", "inputs": [f"{block}.upsample", f"e{i}"], "output": f"{block}.skip"},
            conv2d(f"{block}.conv", f"{block}.skip", f"d{i}", width, width, 1 if i < pointwise else 3, activation=activation),
        ]
        level, channels = f"d{i}", width
    graph.append(conv2d("head", level, "y", channels, out_channels, 1 if pointwise else 3))
    return graph, "y"


def compact(in_channels=15, widths=(12, 24, 32, 48), out_channels=12, activation="relu"):
    """A U-Net for GPUs, of few dispatches: (graph, output tensor's name). A level below is enlarged by the convolution that reads it,
    and its skip is added there; two convolutions a level from the third on, and one at the borders."""
    graph, level, channels = [], "input", in_channels
    last = len(widths) - 1
    for i, width in enumerate(widths):
        kinds = [("a", 1 if i == 0 else 3, 1 if i == 0 else 2)] + [("b", 3, 1)] * (i > 1)
        for letter, kernel, stride in kinds:
            output = f"e{i}" if letter == kinds[-1][0] else f"down{i}.{letter}"
            graph.append(conv2d(f"down{i}.{letter}", level, output, channels, width, kernel, stride, activation=activation))
            level, channels = output, width
    for i in range(last - 1, -1, -1):
        graph += [
            {"op": "upsample_nearest", "name": f"up{i}.larger", "input": level, "size_as": f"e{i}", "output": f"up{i}.larger"},
            conv2d(f"up{i}.conv", f"up{i}.larger", f"d{i}", channels, widths[i], activation=activation, add=f"e{i}"),
        ]
        level, channels = f"d{i}", widths[i]
    graph.append(conv2d("head", level, "y", channels, out_channels, 1))
    return graph, "y"


def document(graph, output_tensor, *, inputs=None, table=("cells", 1), cell=4, meaning=MEANINGS[0], output_channels=12,
             licence="MIT OR Apache-2.0", name="", provenance=None):
    """The JSON document of a file. `inputs`: (feature, channels) or (feature, channels, encoding), by default the whole table in its
    order; without an encoding it is the table's first, `plain` in table `free`."""
    rows = OLDER_TABLES.get(tuple(table), TABLES.get(table[0], ({}, False))[0])
    inputs = [(n, channels) for n, (channels, _) in rows.items()] if inputs is None else inputs

    def feature(name, channels, encoding=None):
        return {"name": name, "channels": channels, "encoding": encoding or (rows[name][1][0] if name in rows else "plain")}

    return {
        "version": VERSION, "name": name, "licence": licence,
        "table": {"name": table[0], "version": table[1]},
        "inputs": [feature(*i) for i in inputs],
        "cell": cell,
        "output": {"tensor": output_tensor, "meaning": meaning, "channels": output_channels},
        "graph": graph, "provenance": provenance or {},
    }


def check(arrays, doc):
    """Every fault of `doc` (dict) with `arrays` (name to array) as a list of `Problem`s; empty when sound."""
    problems, graph = check_document(doc)
    if graph is not None:
        kinds = {dtype: name for name, dtype in container.DTYPES.items()}
        info = {n: (kinds.get(np.dtype(a.dtype).newbyteorder("<"), str(a.dtype)), a.shape) for n, a in arrays.items()}
        problems += check_tensors(graph, info, arrays.__getitem__, set())
    return problems


def quantised(arrays, graph):
    """`arrays` with the weights of convolutions as bytes and their scales: value = byte · scale of its output channel."""
    arrays = dict(arrays)
    for op in complete(graph):
        name, axis = f"{op['name']}.weight", scaled_axis(op)
        if axis is None or name not in arrays:
            continue
        weight = np.asarray(arrays[name], np.float32)
        others = tuple(i for i in range(weight.ndim) if i != axis)
        scale = np.maximum(np.abs(weight).max(axis=others) / np.float32(127), np.finfo(np.float32).tiny)
        arrays[name] = np.rint(weight / np.expand_dims(scale, others)).astype(np.int8)
        arrays[name + SCALE_SUFFIX] = scale.astype(np.float32)
    return arrays


def write(path, tensors, doc):
    """Checks and writes one file whole or not at all. `tensors`: name to array (or PyTorch tensor), as in a state dict; float32,
    float16, or int8 with scales (`quantised`)."""
    arrays = {k: np.asarray(v.detach().cpu().numpy() if hasattr(v, "detach") else v) for k, v in tensors.items()}
    problems = check(arrays, doc)
    if problems:
        raise WeightsError(path, problems)
    data = container.build(arrays, {KEY: json.dumps(doc, sort_keys=True, separators=(",", ":"))})
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


def _plain(value, strict=True):
    """`Pairs` as dicts. Raises ValueError where a key stands twice; not `strict`: the last one counts."""
    if isinstance(value, container.Pairs):
        found = {k: _plain(v, strict) for k, v in value}
        if strict and len(found) != len(value):
            raise ValueError("a field stands twice")
        return found
    return [_plain(v, strict) for v in value] if isinstance(value, list) else value


def _operator(pairs):
    """One operator; where a key stands twice, what is left says nothing but its name, which `check` refuses."""
    try:
        return _plain(pairs)
    except ValueError:
        return {"name": dict(pairs).get("name"), "op": None}


def _document(text, problems):
    """The document as dicts, or None and a problem."""
    try:
        loose = container.load_json(text)
        if not isinstance(loose, container.Pairs) or len(dict(loose)) != len(loose):
            raise ValueError("no object, or a field stands twice")
        fields = dict(loose)
        # Provenance is anybody's.
        own = {"provenance": _plain(fields.pop("provenance"), strict=False)} if "provenance" in fields else {}
        graph = fields.get("graph")
        if isinstance(graph, list) and not isinstance(graph, container.Pairs):
            own["graph"] = [_operator(op) for op in fields.pop("graph")]
        return {**_plain(container.Pairs(fields.items())), **own}
    except (ValueError, RecursionError) as error:
        problems.append(Problem("document", "", f"metadata `{KEY}`: {error}"))
        return None


def _parse(data):
    """(problems, tensors as stored, document) of a file's bytes."""
    problems = []
    try:
        metadata, info, rest = container.parse(data, problems)
    except NotReadable as error:
        return [error.problem], {}, None
    if KEY not in metadata:
        return problems + [Problem("document", "", f"metadata `{KEY}`: the key is missing, so this file holds no bouncelight network")], {}, None
    reported = {p.subject for p in problems if p.code == "size"}
    doc = _document(metadata[KEY], problems)
    graph = None
    if doc is not None:
        faults, graph = check_document(doc)
        problems += faults
    if graph is not None:
        problems += check_tensors(graph, info, lambda name: container.values(info, rest, name), reported)
    if problems:
        return problems, {}, doc
    return [], {name: container.values(info, rest, name).copy() for name in info}, doc


def _widened(arrays, graph):
    """Bytes multiplied by their scales, everything else as it is."""
    arrays = dict(arrays)
    for op in complete(graph):
        name, axis = f"{op['name']}.weight", scaled_axis(op)
        if axis is not None and arrays[name].dtype == np.int8:
            others = tuple(i for i in range(arrays[name].ndim) if i != axis)
            arrays[name] = arrays[name].astype(np.float32) * np.expand_dims(arrays.pop(name + SCALE_SUFFIX), others)
    return arrays


def read(path):
    """(tensors, document) of a file; bytes with scales come as float32. Raises WeightsError when it is not sound."""
    with open(path, "rb") as file:
        problems, arrays, doc = _parse(file.read(container.MAX_FILE + 1))
    if problems:
        raise WeightsError(path, problems)
    return _widened(arrays, doc["graph"]), doc


def verify(path):
    """List of faults of the file at `path`; empty when it is sound."""
    try:
        if os.path.getsize(path) > container.MAX_FILE:
            return [Problem("too-large", "", f"more than the {container.MAX_FILE} bytes allowed")]
        with open(path, "rb") as file:
            return _parse(file.read())[0]
    except OSError as error:
        return [Problem("io", "", f"cannot be read: {error}")]
