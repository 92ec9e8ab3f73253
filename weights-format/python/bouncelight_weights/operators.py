"""The operators: their fields and what they may be, the tensors they need. One table for the checks and for schema.json."""

MAX_CHANNELS, MAX_KERNEL, MAX_STRIDE, MAX_PAD, MAX_SCALE, MAX_JOINED = 4096, 7, 4, 64, 8, 16
U32 = 1 << 32
REQUIRED = object()
ACTIVATIONS = ("none", "relu", "tanh", "sigmoid", "silu", "softplus", "exp")


class Natural:
    """A whole number; `low` to `high` are judged with the graph, 0 to 2³² − 1 with the fields."""

    def __init__(self, low, high):
        self.low, self.high = low, high

    def fits(self, value):
        return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < U32

    def sound(self, value):
        return self.low <= value <= self.high

    def schema(self):
        return {"type": "integer", "minimum": self.low, "maximum": self.high}


class Fraction(Natural):
    """A number of single precision; `open_low`, `open_high`: the border itself is excluded."""

    def __init__(self, low, high, open_low=False, open_high=False):
        super().__init__(low, high)
        self.open_low, self.open_high = open_low, open_high

    def fits(self, value):
        return isinstance(value, (int, float)) and not isinstance(value, bool)

    def sound(self, value):
        above = value > self.low if self.open_low else value >= self.low
        return above and (value < self.high if self.open_high else value <= self.high)

    def schema(self):
        low = "exclusiveMinimum" if self.open_low else "minimum"
        high = "exclusiveMaximum" if self.open_high else "maximum"
        return {"type": "number", low: self.low, high: self.high}


class Is:
    """Anything that a function accepts, with the schema that says the same."""

    def __init__(self, fits, schema, sound=lambda value: True):
        self.fits, self._schema, self.sound = fits, schema, sound

    def schema(self):
        return self._schema


def _texts(low, high):
    def fits(value):
        return isinstance(value, list) and low <= len(value) <= high and all(isinstance(v, str) for v in value)
    return fits


def _slope(value):
    return value["leaky_relu"] if isinstance(value, dict) else None


def _activation(value):
    if isinstance(value, dict):
        return list(value) == ["leaky_relu"] and Fraction(0, 0).fits(value["leaky_relu"])
    return isinstance(value, str) and value in ACTIVATIONS


def sides(padding):
    """[left, top, right, bottom] of a padding."""
    return [padding] * 4 if isinstance(padding, int) else list(padding)


def _sides(high):
    edge = Natural(0, high)
    return Is(lambda v: edge.fits(v) or isinstance(v, list) and len(v) == 4 and all(map(edge.fits, v)),
              {"oneOf": [edge.schema(), {"type": "array", "items": edge.schema(), "minItems": 4, "maxItems": 4}]},
              lambda v: all(map(edge.sound, sides(v))))


TEXT = Is(lambda v: isinstance(v, str), {"type": "string"})
MAYBE_TEXT = Is(lambda v: v is None or isinstance(v, str), {"type": ["string", "null"]})
FLAG = Is(lambda v: isinstance(v, bool), {"type": "boolean"})
PAIR = Is(_texts(2, 2), {"type": "array", "minItems": 2, "maxItems": 2, "items": {"type": "string"}})
TEXTS = Is(_texts(0, U32), {"type": "array", "minItems": 1, "maxItems": MAX_JOINED, "items": {"type": "string"}},
           lambda v: 1 <= len(v) <= MAX_JOINED)
KERNEL = Is(lambda v: isinstance(v, list) and len(v) == 2 and all(map(Natural(0, 0).fits, v)),
            {"type": "array", "minItems": 2, "maxItems": 2, "items": Natural(1, MAX_KERNEL).schema()},
            lambda v: all(1 <= k <= MAX_KERNEL for k in v))
ACTIVATION = Is(_activation,
                {"oneOf": [{"enum": list(ACTIVATIONS)},
                           {"type": "object", "additionalProperties": False, "required": ["leaky_relu"],
                            "properties": {"leaky_relu": Fraction(-1000, 1000).schema()}}]},
                lambda v: _slope(v) is None or abs(_slope(v)) <= 1000)
ADD_AT = Is(lambda v: v in ("before_activation", "after_activation"), {"enum": ["before_activation", "after_activation"]})
CHANNELS, STRIDE = Natural(1, MAX_CHANNELS), Natural(1, MAX_STRIDE)
EPS = Fraction(0, 1, open_low=True)


def _maybe(kind):
    return Is(lambda v: v is None or kind.fits(v), {"oneOf": [kind.schema(), {"type": "null"}]},
              lambda v: v is None or kind.sound(v))


_ENDS = {"name": (TEXT, REQUIRED), "output": (TEXT, REQUIRED)}
_ONE = {**_ENDS, "input": (TEXT, REQUIRED)}
_WEIGHTS = {**_ONE, "in_channels": (CHANNELS, REQUIRED), "out_channels": (CHANNELS, REQUIRED), "kernel": (KERNEL, REQUIRED),
            "stride": (STRIDE, 1), "bias": (FLAG, True), "activation": (ACTIVATION, "none")}
_UPSAMPLE = {**_ONE, "size_as": (MAYBE_TEXT, None), "scale": (_maybe(Natural(1, MAX_SCALE)), None)}
_NORM = {**_ONE, "channels": (CHANNELS, REQUIRED), "eps": (EPS, 1e-5), "affine": (FLAG, True), "activation": (ACTIVATION, "none")}

# Operator: field: (kind, default).
OPERATORS = {
    "conv2d": {**_WEIGHTS, "padding": (_sides(MAX_KERNEL - 1), 0), "groups": (CHANNELS, 1), "add": (MAYBE_TEXT, None),
               "add_at": (ADD_AT, "before_activation")},
    "conv_transpose2d": {**_WEIGHTS, "padding": (Natural(0, MAX_KERNEL - 1), 0), "output_padding": (Natural(0, MAX_STRIDE - 1), 0)},
    "upsample_nearest": _UPSAMPLE,
    "upsample_bilinear": _UPSAMPLE,
    "pad": {**_ONE, "padding": (_sides(MAX_PAD), REQUIRED)},
    "concat": {**_ENDS, "inputs": (TEXTS, REQUIRED)},
    "add": {**_ENDS, "inputs": (PAIR, REQUIRED), "activation": (ACTIVATION, "none")},
    "batch_norm": _NORM,
    "instance_norm": {**_NORM, "affine": (FLAG, False)},
    "group_norm": {**_NORM, "groups": (CHANNELS, REQUIRED)},
    "activation": {**_ONE, "activation": (ACTIVATION, REQUIRED)},
    "dropout": {**_ONE, "p": (Fraction(0, 1, open_high=True), REQUIRED)},
}
NORMS = ("batch_norm", "instance_norm", "group_norm")


def filled(op):
    """The operator with every default written out."""
    return {**{field: default for field, (_, default) in OPERATORS[op["op"]].items() if default is not REQUIRED}, **op}


def tensors(op):
    """{name: shape} of the trained tensors of a filled operator, as PyTorch has them."""
    kind, name = op["op"], op["name"]
    if kind == "conv2d":
        found = {"weight": (op["out_channels"], op["in_channels"] // max(op["groups"], 1), *op["kernel"])}
    elif kind == "conv_transpose2d":
        found = {"weight": (op["in_channels"], op["out_channels"], *op["kernel"])}
    elif kind in NORMS:
        channels = (op["channels"],)
        found = {"weight": channels, "bias": channels} if op["affine"] else {}
        if kind == "batch_norm":
            found.update(running_mean=channels, running_var=channels)
    else:
        return {}
    if kind.startswith("conv") and op["bias"]:
        found["bias"] = (op["out_channels"],)
    return {f"{name}.{leaf}": shape for leaf, shape in found.items()}


def scaled_axis(op):
    """The axis of the output channels of `NAME.weight`, which may be stored as bytes with scales; None where there is none."""
    return {"conv2d": 0, "conv_transpose2d": 1}.get(op["op"])


def operator_schemas():
    """{operator: its JSON schema}."""
    return {kind: {"type": "object", "additionalProperties": False,
                   "required": ["op"] + [field for field, (_, default) in fields.items() if default is REQUIRED],
                   "properties": {"op": {"const": kind}, **{field: of.schema() for field, (of, _) in fields.items()}}}
            for kind, fields in OPERATORS.items()}
