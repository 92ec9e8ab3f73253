"""The JSON document: its fields, feature tables, meanings; and what tensors it needs."""

import numpy as np

from . import graph as graphs
from .operators import OPERATORS, U32, operator_schemas, scaled_axis, tensors
from .problems import Problem

VERSION = 2
KNOWN_VERSIONS = (1, 2)
KEY = "bouncelight"
MAX_OPS = 1024
MEANINGS = ("filter", "display_signed", "plain")
_PICTURE = ("signed", "signed_stretched", "unit")
# Feature: (channels, encodings); files of version 1 mean the first encoding.
CELLS_V2 = {
    "light": (1, ("over_sum_with_exposure",)), "chroma": (2, ("differences_over_sum",)), "deviation": (1, ("log1p_over_light",)),
    "history_length": (1, ("inverse_root",)), "fast_history": (1, ("difference_over_sum",)), "hit_proximity": (1, ("twice_width_over_length",)),
    "depth": (1, ("log_over_mean",)), "normal": (3, ("gravity_frame",)), "hit": (1, ("flag",)), "dominant_direction": (3, ("gravity_frame",)),
}
# The same by other names.
CELLS_V1 = {
    "light": (1, ("over_sum_with_exposure",)), "chroma": (2, ("differences_over_sum",)), "deviation": (1, ("log1p_over_light",)),
    "frames": (1, ("inverse_root",)), "lately": (1, ("difference_over_sum",)), "nearness": (1, ("twice_width_over_length",)),
    "depth": (1, ("log_over_mean",)), "normal": (3, ("gravity_frame",)), "hit": (1, ("flag",)), "towards": (3, ("gravity_frame",)),
}
IMAGES_V1 = {name: (3, _PICTURE) for name in ("depth", "direct", "diffuse", "normal", "gathered")}
# Table: (features, whether a network uses them in the table's order).
TABLES = {"cells": (CELLS_V2, True), "images": (IMAGES_V1, False), "free": ({}, False)}
# Newest version of each, where it is not 1, and the features of older ones.
TABLE_VERSIONS, OLDER_TABLES = {"cells": 2}, {("cells", 1): CELLS_V1}
SCALE_SUFFIX = "_scale"
MAX_SCALE = float(np.finfo(np.float32).max) / 128


def _natural(value):
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value


def _object(value, fields):
    """Whether `value` is an object with exactly these fields; {field: (check, required)}."""
    return (isinstance(value, dict) and all(k in fields for k in value)
            and all(check(value[k]) if k in value else not required for k, (check, required) in fields.items()))


def _text(value):
    return isinstance(value, str)


def _u32(value):
    return _natural(value) and value < U32


_TABLE = {"name": (_text, True), "version": (_natural, True)}
_FEATURE = {"name": (_text, True), "channels": (_u32, True), "encoding": (_text, False)}
_OUTPUT = {"tensor": (_text, True), "meaning": (_text, True), "channels": (_u32, True)}
_DOCUMENT = {
    "version": (_natural, True), "name": (_text, False), "licence": (_text, True), "table": (lambda v: _object(v, _TABLE), True),
    "inputs": (lambda v: isinstance(v, list) and all(_object(f, _FEATURE) for f in v), True), "cell": (_u32, True),
    "output": (lambda v: _object(v, _OUTPUT), True), "graph": (lambda v: isinstance(v, list), True),
    "provenance": (lambda v: True, False),
}


def check(doc):
    """(problems, graph or None) of a document; the graph has its defaults filled in, None when it cannot say which tensors it needs."""
    version = doc.get("version") if isinstance(doc, dict) else None
    if _natural(version) and version not in KNOWN_VERSIONS:
        return [Problem("version", "the document", f"the document has version {version}; known up to {VERSION}")], None
    if not _object(doc, _DOCUMENT):
        wrong = [k for k in doc if k not in _DOCUMENT or not _DOCUMENT[k][0](doc[k])] if isinstance(doc, dict) else ["(all)"]
        lacks = [k for k, (_, required) in _DOCUMENT.items() if required and k not in doc] if isinstance(doc, dict) else []
        return [Problem("document", "", f"metadata `{KEY}`: unknown or wrong fields {wrong}, missing fields {lacks}")], None
    problems = _inputs(doc)

    def fault(sentence):
        problems.append(Problem("document", "", f"metadata `{KEY}`: {sentence}"))

    if doc["output"]["meaning"] not in MEANINGS:
        fault(f"output meaning `{doc['output']['meaning']}` is unknown; known: {', '.join(MEANINGS)}")
    if not 1 <= doc["cell"] <= 64:
        fault(f"cell is {doc['cell']}, allowed are 1 to 64")
    if not doc["licence"].strip():
        fault("licence is empty; write an SPDX expression, or LicenseRef-unknown")
    if not isinstance(doc.get("provenance"), (dict, type(None))):
        fault("provenance is no object")
    if len(doc["graph"]) > MAX_OPS:
        fault(f"the graph has {len(doc['graph'])} operators, more than the {MAX_OPS} allowed")
        return problems, None
    faults = [f for i, op in enumerate(doc["graph"]) for f in _operator(i, op)]
    problems += faults
    if faults:
        return problems, None
    graph = graphs.complete(doc["graph"])
    channels, output = min(sum(f["channels"] for f in doc["inputs"]), U32 - 1), doc["output"]
    wrong, sized = graphs.check(graph, channels, output["tensor"])
    problems += wrong
    if wrong:
        return problems, graph if sized else None
    try:
        shapes = graphs.shapes(graph, channels, *graphs.inner_size(graph, channels, 253, 131))
        found = next(s[0] for s, op in zip(shapes, graph) if op["output"] == output["tensor"])
        if found != output["channels"]:
            problems.append(Problem("graph", "output", f"graph: tensor `{output['tensor']}` has {found} channels, {output['channels']} are needed"))
    except graphs.SizeError as error:
        problems.append(Problem("graph", error.op, f"graph: operator `{error.op}`: {error}"))
    return problems, graph


def _operator(index, op):
    name = op["name"] if isinstance(op, dict) and _text(op.get("name")) else "?"
    if not isinstance(op, dict) or not _text(op.get("op")):
        return [Problem("operator", name, f"graph[{index}] `{name}`: field `op` is missing or no string, or a field stands twice")]
    if op["op"] not in OPERATORS:
        return [Problem("unknown-operator", name, f"graph[{index}] `{name}`: operator `{op['op']}` is unknown; a newer program may run it")]
    wrong = graphs.field_fault(op)
    return [Problem("operator", name, f"graph[{index}] `{name}`: {wrong}")] if wrong else []


def _inputs(doc):
    """Faults of the features."""
    name, version = doc["table"]["name"], doc["table"]["version"]
    newest = TABLE_VERSIONS.get(name, 1)
    if not 1 <= version <= newest:
        known = "1" if newest == 1 else f"1 to {newest}"
        return [Problem("version", f"feature table `{name}`", f"feature table `{name}` has version {version}; known: {known}")]
    if name not in TABLES:
        return [Problem("document", "", f"metadata `{KEY}`: feature table `{name}` is unknown; known: {', '.join(TABLES)}")]
    problems = [] if doc["inputs"] else [Problem("document", "", f"metadata `{KEY}`: there is no input feature")]
    rows, ordered = TABLES[name]
    rows = OLDER_TABLES.get((name, version), rows)
    order, following, seen = list(rows), 0, set()
    for feature in doc["inputs"]:
        own, encoding = feature["name"], feature.get("encoding", "")

        def fault(sentence):
            problems.append(Problem("feature", own, f"input feature `{own}`: {sentence}"))

        if own in seen:
            fault("it stands twice")
            continue
        seen.add(own)
        if doc["version"] == 1 and encoding:
            fault("field `encoding` came with version 2 of the document")
        if doc["version"] > 1 and not encoding:
            fault("field `encoding` is missing or empty")
        if not rows:
            continue
        if own not in rows:
            fault(f"table `{name}` version {version} has no such feature")
            continue
        channels, encodings = rows[own]
        if feature["channels"] != channels:
            fault(f"it has {channels} channels in table `{name}`, not {feature['channels']}")
        if encoding and encoding not in encodings:
            fault(f"encoding `{encoding}` is unknown in table `{name}`; known: {', '.join(encodings)}")
        if ordered and order.index(own) < following:
            fault("it stands out of the table's order")
        following = order.index(own) + 1
    return problems


def check_tensors(graph, info, array, reported):
    """Faults of the tensors for a filled graph. `info`: {name: (dtype, shape, …)}; `array(name)` gives a tensor's values;
    `reported`: names that are faulty already and so are not missing."""
    problems, scales = [], set()
    wanted = {name: (shape, op) for op in graph for name, shape in tensors(op).items()}
    for name in sorted(wanted):
        shape, op = wanted[name]
        if name not in info:
            if name not in reported:
                problems.append(Problem("missing", name, f"tensor `{name}` is missing"))
            continue
        dtype = info[name][0]
        fits = _shape(problems, name, info[name][1], shape)
        axis = scaled_axis(op) if name == f"{op['name']}.weight" else None
        if dtype == "I8" and axis is not None:
            scale = name + SCALE_SUFFIX
            scales.add(scale)
            if scale not in reported:
                problems += _scale(scale, info, array, shape[axis])
        elif dtype not in ("F32", "F16"):
            problems.append(Problem("dtype", name, f"tensor `{name}` holds {dtype}; F32 and F16 are read, and I8 for the weights of convolutions"))
        elif fits:
            values = array(name)
            bad = ~np.isfinite(values)
            if bad.any():
                problems.append(Problem("not-finite", name, f"tensor `{name}` holds {bad.sum()} values that are not finite, the first at index {bad.argmax()}"))
            low = np.isfinite(values) & (values < 0)
            if name.endswith(".running_var") and low.any():
                problems.append(Problem("negative", name, f"tensor `{name}` holds {low.sum()} values below 0; a variance has none"))
    problems += [Problem("unexpected", name, f"tensor `{name}` is used by no operator") for name in info if name not in wanted and name not in scales]
    return problems


def _shape(problems, name, found, wanted):
    if tuple(found) == tuple(wanted):
        return True
    problems.append(Problem("shape", name, f"tensor `{name}` has shape {list(found)}, the graph needs {list(wanted)}"))
    return False


def _scale(name, info, array, channels):
    if name not in info:
        return [Problem("missing", name, f"tensor `{name}` is missing")]
    if info[name][0] != "F32":
        return [Problem("dtype", name, f"tensor `{name}` holds {info[name][0]}; scales are F32")]
    problems = []
    if _shape(problems, name, info[name][1], (channels,)):
        values = array(name)
        bad = ~((values > 0) & (values <= MAX_SCALE))
        if bad.any():
            problems.append(Problem("scale", name, f"tensor `{name}`: the scale at index {bad.argmax()} is not a number above 0 and up to {MAX_SCALE:e}"))
    return problems


def schema():
    """The document's JSON schema; ../../schema.json is this."""
    integer = {"type": "integer", "minimum": 1, "maximum": 4096}
    encodings = sorted({e for rows, _ in TABLES.values() for _, known in rows.values() for e in known})
    part = lambda required, properties: {"type": "object", "additionalProperties": False, "required": required, "properties": properties}  # noqa: E731
    feature = part(["name", "channels"], {
        "name": {"type": "string"}, "channels": integer,
        "encoding": {"type": "string", "minLength": 1, "description": f"required from version 2 on; in tables cells and images one of {', '.join(encodings)}"}})
    return {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": f"bouncelight weights document, versions {KNOWN_VERSIONS[0]} to {VERSION}",
        "description": "Made by `python3 -m bouncelight_weights --schema`.",
        **part(["version", "licence", "table", "inputs", "cell", "output", "graph"], {
            "version": {"enum": list(KNOWN_VERSIONS)}, "name": {"type": "string"}, "licence": {"type": "string", "pattern": "\\S"},
            "table": part(["name", "version"], {"name": {"enum": list(TABLES)}, "version": {"enum": sorted({1, *TABLE_VERSIONS.values()})}}),
            "inputs": {"type": "array", "minItems": 1, "items": feature},
            "cell": {"type": "integer", "minimum": 1, "maximum": 64},
            "output": part(["tensor", "meaning", "channels"], {"tensor": {"type": "string"}, "meaning": {"enum": list(MEANINGS)}, "channels": integer}),
            "graph": {"type": "array", "minItems": 1, "maxItems": MAX_OPS, "items": {"oneOf": [{"$ref": f"#/$defs/{kind}"} for kind in OPERATORS]}},
            "provenance": {"type": ["object", "null"]}}),
        "$defs": operator_schemas(),
    }
