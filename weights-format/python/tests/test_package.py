"""The package's own tests: python3 tests/test_package.py [FILE…]. Plain asserts, numpy alone.

FILEs are sound files that another writer made; they must verify.
"""

import json
import pathlib
import sys
import tempfile

import numpy as np

HERE = pathlib.Path(__file__).parent
FORMAT = HERE.parent.parent
sys.path.insert(0, str(HERE.parent))
import bouncelight_weights as bw  # noqa: E402
from bouncelight_weights import container  # noqa: E402
from bouncelight_weights.document import check as check_document  # noqa: E402
from bouncelight_weights.graph import complete, inner_size, shapes  # noqa: E402
from bouncelight_weights.operators import OPERATORS, tensors  # noqa: E402
from bouncelight_weights.problems import NotReadable  # noqa: E402


def raises(kind, work):
    try:
        work()
    except kind as error:
        return error
    raise AssertionError(f"no {kind.__name__}")


def arrays_for(graph, dtype=np.float32):
    """Seeded numbers for every tensor of a graph; variances are positive."""
    rng = np.random.default_rng(1)
    found = {n: rng.normal(0, 0.1, s) for op in complete(graph) for n, s in tensors(op).items()}
    return {n: (np.abs(v) if n.endswith("running_var") else v).astype(dtype) for n, v in found.items()}


def every_operator():
    """A graph with each operator, (graph, output)."""
    def op(kind, name, output, **fields):
        return {"op": kind, "name": name, "output": output, **fields}

    return [
        op("conv2d", "a", "a", input="input", in_channels=6, out_channels=8, kernel=[3, 3], padding=1, groups=2, bias=False),
        op("group_norm", "g", "g", input="a", channels=8, groups=2, activation={"leaky_relu": 0.2}),
        op("conv2d", "down", "d", input="g", in_channels=8, out_channels=4, kernel=[4, 4], stride=2, padding=[1, 1, 1, 1]),
        op("conv_transpose2d", "up", "u", input="d", in_channels=4, out_channels=8, kernel=[4, 4], stride=2, padding=1),
        op("concat", "cat", "c", inputs=["u", "g"]),
        op("batch_norm", "n", "n", input="c", channels=16, activation="silu"),
        op("instance_norm", "i", "i", input="n", channels=16),
        op("pad", "p", "p", input="i", padding=[1, 1, 0, 0]),
        op("upsample_nearest", "un", "un", input="p", scale=2),
        op("upsample_bilinear", "ub", "ub", input="un", size_as="input"),
        op("conv2d", "o", "o", input="ub", in_channels=16, out_channels=6, kernel=[1, 1]),
        op("add", "s", "s", inputs=["o", "input"]),
        op("dropout", "dr", "dr", input="s", p=0.5),
        op("activation", "t", "t", input="dr", activation="tanh"),
        op("conv2d", "head", "y", input="t", in_channels=6, out_channels=3, kernel=[1, 3], padding=[1, 0, 1, 0]),
    ], "y"


def picture_document(graph, output, **more):
    return bw.document(graph, output, inputs=[("depth", 3), ("direct", 3, "signed_stretched")], table=("images", 1), cell=1,
                       meaning="display_signed", output_channels=3, **more)


def test_round_trips(folder):
    graph, output = every_operator()
    assert {op["op"] for op in graph} == set(OPERATORS)
    for dtype in (np.float32, np.float16):
        arrays = arrays_for(graph, dtype)
        bw.write(folder / "net.safetensors", arrays, picture_document(graph, output, provenance={"ä": [1, None]}))
        again, doc = bw.read(folder / "net.safetensors")
        assert doc["provenance"] == {"ä": [1, None]} and doc["version"] == bw.VERSION
        assert again.keys() == arrays.keys() and all(np.array_equal(again[n], arrays[n]) and again[n].dtype == dtype for n in arrays)
    arrays = arrays_for(graph)
    stored = bw.quantised(arrays, graph)
    assert stored["up.weight"].dtype == np.int8 and stored["up.weight_scale"].shape == (8,) and stored["a.weight_scale"].shape == (8,)
    bw.write(folder / "bytes.safetensors", stored, picture_document(graph, output))
    again, _ = bw.read(folder / "bytes.safetensors")
    for name, values in arrays.items():
        step = np.abs(values).max() / 127
        assert np.abs(again[name] - values).max() <= (0.51 * step if values.ndim == 4 else 0), name
    # A channel of zeros has a scale nevertheless.
    arrays["o.weight"][2] = 0
    bw.write(folder / "bytes.safetensors", bw.quantised(arrays, graph), picture_document(graph, output))
    assert not bw.read(folder / "bytes.safetensors")[0]["o.weight"][2].any()


def test_nothing_faulty_is_written(folder):
    graph, output = bw.unet(widths=(2, 3))
    arrays = arrays_for(graph)
    arrays.pop("head.bias")
    arrays["head.weight"] = arrays["head.weight"].astype(np.float64)
    error = raises(bw.WeightsError, lambda: bw.write(folder / "no.safetensors", arrays, bw.document(graph, output)))
    assert {(p.code, p.subject) for p in error.problems} == {("missing", "head.bias"), ("dtype", "head.weight")}
    assert not list(folder.glob("no*"))
    raises(bw.WeightsError, lambda: bw.read(FORMAT / "fixtures/bad/missing.safetensors"))
    assert [p.code for p in bw.verify(folder / "none.safetensors")] == ["io"]


def test_bad_files_have_the_faults_that_are_expected(_):
    expected = json.loads((FORMAT / "fixtures/bad/expected.json").read_text())
    assert len(expected) > 50 and expected["sound"] == []
    for name, faults in expected.items():
        found = bw.verify(FORMAT / f"fixtures/bad/{name}.safetensors")
        assert all(str(p) for p in found)
        assert sorted({(p.code, p.subject) for p in found}) == [tuple(f) for f in faults], f"{name}: {found}"


def test_bytes_of_any_kind_give_an_answer(_):
    sound = (FORMAT / "fixtures/bad/sound.safetensors").read_bytes()
    rng = np.random.default_rng(7)
    header = 8 + int.from_bytes(sound[:8], "little")
    refused = 0
    for _ in range(1500):
        data = bytearray(sound)
        for at in rng.integers(0, header, rng.integers(1, 4)):
            data[at] = rng.integers(0, 256)
        refused += bool(bw._parse(bytes(data[:rng.integers(0, 2 * len(data))]))[0])
    assert 750 < refused <= 1500, refused


def test_sizes(_):
    graph = complete(every_operator()[0])
    assert inner_size(graph, 6, 13, 9) == (14, 10) and inner_size(graph, 6, 2, 2) == (2, 2)
    assert shapes(graph, 6, 14, 10)[-1] == (3, 10, 14)
    raises(ValueError, lambda: shapes(graph, 6, 13, 9))


def test_schema(_):
    schema = bw.schema()
    assert json.loads((FORMAT / "schema.json").read_text()) == schema, "make it anew: python3 -m bouncelight_weights --schema"
    try:
        import jsonschema
    except ImportError:
        return print("SKIP: jsonschema is not installed")
    validator = jsonschema.Draft202012Validator(schema)
    unet = bw.document(*bw.unet())
    for doc in (unet, picture_document(*every_operator())):
        assert not list(validator.iter_errors(doc))
    # Everything that the schema refuses, the package refuses; a schema cannot see how operators fit together.
    for name in json.loads((FORMAT / "fixtures/bad/expected.json").read_text()):
        try:
            text = container.parse((FORMAT / f"fixtures/bad/{name}.safetensors").read_bytes(), [])[0][bw.KEY]
            doc = json.loads(text)
        except (NotReadable, KeyError, ValueError):
            continue
        if not validator.is_valid(doc):
            assert check_document(doc)[0], name


def test_files_from_elsewhere(_):
    for path in sys.argv[1:]:
        assert bw.verify(path) == [], path


def main():
    tests = [(name, test) for name, test in globals().items() if name.startswith("test_")]
    for name, test in tests:
        with tempfile.TemporaryDirectory() as folder:
            test(pathlib.Path(folder))
        print(f"{name} ok")
    print(f"ran {len(tests)} tests on {len(sys.argv) - 1} files from elsewhere")


if __name__ == "__main__":
    main()
