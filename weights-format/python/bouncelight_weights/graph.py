"""Checks of a graph, the same as the Rust reader's (`src/net/check.rs`, `graph.rs`, `shape.rs`)."""

from .operators import MAX_CHANNELS, NORMS, OPERATORS, REQUIRED, U32, Fraction, filled, sides
from .problems import Problem

MAX_EDGE = 16384


def field_fault(op):
    """What is wrong with the fields of one operator, or None."""
    fields = OPERATORS[op["op"]]
    for field in op:
        if field != "op" and field not in fields:
            return f"unknown field `{field}`"
    for field, (kind, default) in fields.items():
        if field not in op:
            if default is REQUIRED:
                return f"missing field `{field}`"
        elif not kind.fits(op[field]):
            return f"field `{field}` is {op[field]!r}"
    return None


def reads(op):
    """Tensors whose values an operator reads."""
    if "inputs" in op:
        return list(op["inputs"])
    return [op["input"]] + ([op["add"]] if op.get("add") is not None else [])


def check(graph, input_channels, output):
    """Every fault of a graph of filled operators, and whether its dimensions are sound enough to say which tensors there should be."""
    problems, sized = [], True

    def fault(op, sentence):
        problems.append(Problem("graph", op, f"graph: operator `{op}`: {sentence}"))

    if not graph:
        fault("", "the graph has no operator")
    if not 1 <= input_channels <= MAX_CHANNELS:
        fault("input", f"channels is {input_channels}, allowed are 1 to {MAX_CHANNELS}")
        sized = False
    known, names = {"input": input_channels}, set()
    for op in graph:
        name, kind = op["name"], op["op"]
        if name in names:
            fault(name, "occurs twice")
        names.add(name)
        size_as = [op["size_as"]] if op.get("size_as") is not None else []
        for tensor in reads(op) + size_as:
            if tensor not in known:
                fault(name, f"reads tensor `{tensor}`, which no operator before it writes")
        for sentence, size in _numbers(op):
            fault(name, sentence)
            sized = sized and not size
        if kind.startswith("upsample") and (op["size_as"] is None) == (op["scale"] is None):
            fault(name, "give either `size_as` or `scale`")
        out, faults, bad_size = _channels(op, known)
        sized = sized and not bad_size
        for sentence in faults:
            fault(name, sentence)
        if op["output"] in known:
            fault(name, f"writes tensor `{op['output']}`, which exists already")
        known[op["output"]] = out
    if not any(op["output"] == output for op in graph):
        problems.append(Problem("graph", output, f"graph: the output tensor `{output}` is written by no operator"))
    return problems, sized


def _numbers(op):
    """(sentence, whether sizes are meaningless with it) for each number outside what the operators support."""
    for field, (kind, _) in OPERATORS[op["op"]].items():
        if not kind.sound(op[field]):
            yield f"{field} is {op[field]}", not isinstance(kind, Fraction) and field != "activation"
    if op["op"] == "conv_transpose2d" and op["output_padding"] > max(op["stride"], 1) - 1:
        yield f"output_padding is {op['output_padding']}, allowed are 0 to the stride less 1", True
    if op["op"] in ("conv2d", "group_norm"):
        for field in ("in_channels", "out_channels", "channels"):
            if field in op and op["groups"] and op[field] % op["groups"]:
                yield f"{field} {op[field]} is no multiple of {op['groups']}", True


def _channels(op, known):
    """(channels of the output or None, faults, whether one of them makes sizes meaningless)."""
    kind, faults, bad_size = op["op"], [], False

    def want(tensor, wanted):
        found = known.get(tensor)
        if found is not None and wanted is not None and found != wanted:
            faults.append(f"tensor `{tensor}` has {found} channels, {wanted} are needed")

    if kind in ("conv2d", "conv_transpose2d"):
        want(op["input"], op["in_channels"])
        if op.get("add") is not None:
            want(op["add"], op["out_channels"])
        out = op["out_channels"]
    elif kind in NORMS:
        want(op["input"], op["channels"])
        out = op["channels"]
    elif kind == "add":
        out = known.get(op["inputs"][0])
        want(op["inputs"][1], out)
    elif kind == "concat":
        parts = [known.get(t) for t in op["inputs"]]
        out = None if None in parts else min(sum(parts), U32 - 1)
    else:
        out = known.get(op["input"])
    if kind == "concat" and out is not None and not 1 <= out <= MAX_CHANNELS:
        faults.append(f"channels is {out}, allowed are 1 to {MAX_CHANNELS}")
        bad_size = True
    return out, faults, bad_size


class SizeError(ValueError):
    """The graph does not fit a picture's size; `op` is where."""

    def __init__(self, op, sentence):
        super().__init__(sentence)
        self.op = op


def shapes(graph, channels, width, height):
    """[(channels, height, width)] of each operator's output. The graph has passed `check`; raises SizeError."""
    if not (1 <= width <= MAX_EDGE and 1 <= height <= MAX_EDGE):
        raise SizeError("input", f"{width}×{height} is not within 1 to {MAX_EDGE}")
    known, found = {"input": (channels, height, width)}, []
    for op in graph:
        shape = _shape(op, known)
        if max(shape[1:]) > MAX_EDGE:
            raise SizeError(op["name"], f"output edge is {max(shape[1:])}")
        known[op["output"]] = shape
        found.append(shape)
    return found


def _shape(op, known):
    kind, name = op["op"], op["name"]
    inputs = [known[t] for t in reads(op)]
    c, h, w = inputs[0]
    if kind == "conv2d":
        left, top, right, bottom = sides(op["padding"])
        edges = []
        for edge, k in ((h + top + bottom, op["kernel"][0]), (w + left + right, op["kernel"][1])):
            if edge < k:
                raise SizeError(name, f"a {k} kernel does not fit the padded input of {edge} pixels")
            edges.append((edge - k) // op["stride"] + 1)
        shape = (op["out_channels"], *edges)
        if op["add"] is not None and known[op["add"]] != shape:
            raise SizeError(name, f"{known[op['add']]} and {shape} do not fit together")
        return shape
    if kind == "conv_transpose2d":
        edges = [(n - 1) * op["stride"] + k + op["output_padding"] - 2 * op["padding"] for n, k in zip((h, w), op["kernel"])]
        if min(edges) < 1:
            raise SizeError(name, "nothing is left after the padding is cut off")
        return (op["out_channels"], *edges)
    if kind.startswith("upsample"):
        return (c, *known[op["size_as"]][1:]) if op["size_as"] is not None else (c, h * op["scale"], w * op["scale"])
    if kind == "pad":
        left, top, right, bottom = sides(op["padding"])
        return c, h + top + bottom, w + left + right
    if kind == "concat":
        if any(other[1:] != (h, w) for other in inputs):
            raise SizeError(name, f"{inputs} do not fit together")
        return sum(other[0] for other in inputs), h, w
    if kind == "add" and inputs[0] != inputs[1]:
        raise SizeError(name, f"{inputs} do not fit together")
    return c, h, w


def inner_size(graph, channels, width, height):
    """The size, at least width×height, at which the network runs: the next multiples of the smallest power of two at which its
    tensors fit together. Raises SizeError."""
    try:
        shapes(graph, channels, width, height)
        return width, height
    except SizeError as error:
        first = error
    for bits in range(1, 11):
        size = [-(-edge // (1 << bits)) << bits for edge in (width, height)]
        try:
            shapes(graph, channels, *size)
            return tuple(size)
        except SizeError:
            pass
    raise first


def complete(graph):
    """Every operator with its defaults written out."""
    return [filled(op) for op in graph]
