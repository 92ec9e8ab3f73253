"""The safetensors container, read and written with numpy alone.

Not by the `safetensors` package, because that one keeps the last of two tensors with one name and stops at the first fault;
this one reports every fault, the same ones as the Rust reader (`src/net/header.rs`).
"""

import json

import numpy as np

from .problems import NotReadable, Problem

MAX_HEADER = 8 << 20
MAX_TENSORS = 8192
MAX_FILE = 1 << 30
# Bytes of one number.
SIZES = {"BOOL": 1, "U8": 1, "I8": 1, "F8_E5M2": 1, "F8_E4M3": 1, "U16": 2, "I16": 2, "F16": 2, "BF16": 2,
         "U32": 4, "I32": 4, "F32": 4, "U64": 8, "I64": 8, "F64": 8}
# Number types that weights files use.
DTYPES = {"F32": np.dtype("<f4"), "F16": np.dtype("<f2"), "I8": np.dtype("i1")}


class Pairs(list):
    """A JSON object as it is written: (key, value) pairs, duplicates kept."""


def _refuse(text):
    raise ValueError(f"{text} is no JSON number")


def load_json(text):
    """Objects as `Pairs`; NaN, Infinity and halves of surrogate pairs are refused, as the Rust reader does."""
    value = json.loads(text, object_pairs_hook=Pairs, parse_constant=_refuse)
    if "\\u" in text:
        json.dumps(value, ensure_ascii=False).encode()
    return value


def _natural(value):
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1 << 64


def _tensor(name, value):
    """(dtype, shape, [from, to]) of a header entry."""
    if not isinstance(value, Pairs):
        raise NotReadable("not-safetensors", f"the header is not as specified: tensor `{name}` is no object")
    keys = [key for key, _ in value]
    if any(keys.count(key) > 1 for key in ("dtype", "shape", "data_offsets")):
        raise NotReadable("not-safetensors", f"the header is not as specified: tensor `{name}` has a field twice")
    entry = dict(value)
    dtype, shape, place = (entry.get(k) for k in ("dtype", "shape", "data_offsets"))
    sound = (isinstance(dtype, str) and isinstance(shape, list) and not isinstance(shape, Pairs) and all(map(_natural, shape))
             and isinstance(place, list) and not isinstance(place, Pairs) and len(place) == 2 and all(map(_natural, place)))
    if not sound:
        raise NotReadable("not-safetensors", f"the header is not as specified: tensor `{name}` needs dtype, shape and data_offsets")
    return dtype, tuple(shape), tuple(place)


def parse(data, problems):
    """(metadata, {name: (dtype, shape, (from, to))}, tensor bytes). Faults of single tensors go to `problems`; raises NotReadable."""
    if len(data) < 8:
        raise NotReadable("not-safetensors", f"it has {len(data)} bytes, and the header's length alone takes 8")
    length = int.from_bytes(data[:8], "little")
    rest = memoryview(data)[8:]
    if len(rest) and rest[0] != ord("{"):
        raise NotReadable("not-safetensors", "the header does not begin with `{`")
    if length > MAX_HEADER:
        raise NotReadable("not-safetensors", f"its header claims {length} bytes, more than the {MAX_HEADER} allowed")
    if length > len(rest):
        raise NotReadable("truncated", f"{length + 8} bytes are needed, it has {len(data)}")
    try:
        header = load_json(bytes(rest[:length]).decode("utf-8"))
    except (ValueError, RecursionError) as error:
        raise NotReadable("not-safetensors", f"the header is not as specified: {error}") from error
    rest = rest[length:]
    metadata, entries = [], []
    for name, value in header:
        if name == "__metadata__":
            if not isinstance(value, Pairs) or not all(isinstance(v, str) for _, v in value):
                raise NotReadable("not-safetensors", "the header is not as specified: __metadata__ is no map of texts")
            metadata.append(dict(value))
        else:
            entries.append((name, _tensor(name, value)))
    if len(entries) > MAX_TENSORS:
        raise NotReadable("not-safetensors", f"it has {len(entries)} tensors, more than the {MAX_TENSORS} allowed")
    end = max((place[1] for _, (_, _, place) in entries), default=0)
    if end > len(rest):
        raise NotReadable("truncated", f"{length + 8 + end} bytes are needed, it has {len(data)}")
    if len(metadata) > 1:
        problems.append(Problem("duplicate", "__metadata__", "`__metadata__` occurs twice"))
    _layout(entries, len(rest), problems)
    tensors = {}
    for name, info in entries:
        if name in tensors:
            problems.append(Problem("duplicate", name, f"`{name}` occurs twice"))
        else:
            tensors[name] = info
    for name, info in list(tensors.items()):
        fault = _size_fault(*info)
        if fault:
            problems.append(Problem("size", name, f"tensor `{name}` {fault}"))
            del tensors[name]
    return (metadata[0] if metadata else {}), tensors, rest


def _layout(entries, length, problems):
    """Tensors must tile the data without hole or overlap."""
    end = 0
    for (start, stop), name in sorted((info[2], name) for name, info in entries):
        if start != end:
            word = "overlaps the tensor before it" if start < end else "leaves a hole before it"
            problems.append(Problem("size", name, f"tensor `{name}` begins at byte {start} and {word} (which ends at {end})"))
        end = max(end, stop)
    if end != length:
        problems.append(Problem("trailing", "", f"{length - end} bytes at the end belong to no tensor"))


def _size_fault(dtype, shape, place):
    have = place[1] - place[0]
    if have < 0:
        return f"ends at byte {place[1]}, before its beginning at {place[0]}"
    if dtype not in SIZES:
        return f"has the unknown type `{dtype}`"
    need = SIZES[dtype]
    for edge in shape:
        need *= edge
    if need != have:
        return f"needs {need} bytes for shape {list(shape)} of {dtype}, but has {have}"
    return None


def values(tensors, data, name):
    """The array of a tensor that `parse` has passed and whose type is one of `DTYPES`; a view, nothing is copied."""
    dtype, shape, (start, _) = tensors[name]
    count = 1
    for edge in shape:
        count *= edge
    return np.frombuffer(data, DTYPES[dtype], count, start).reshape(shape)


def build(arrays, metadata):
    """The file's bytes: largest number type first, then by name; the header is padded with blanks so that the data is aligned to eight bytes."""
    kinds = {value: key for key, value in DTYPES.items()}
    arrays = {name: np.ascontiguousarray(a, a.dtype.newbyteorder("<")) for name, a in arrays.items()}
    order = sorted(arrays, key=lambda name: (-arrays[name].dtype.itemsize, name))
    header, end = {"__metadata__": metadata}, 0
    for name in order:
        size = arrays[name].nbytes
        header[name] = {"dtype": kinds[arrays[name].dtype], "shape": list(arrays[name].shape), "data_offsets": [end, end + size]}
        end += size
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    return b"".join([len(text).to_bytes(8, "little"), text, *(arrays[name].tobytes() for name in order)])
