"""Fitting a network to a scene, with a stand-in for the program that makes samples up."""
import json
import os
import stat
import sys
import tempfile
import unittest

import numpy as np
import torch

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, ".."), HERE]
from bouncelight_training import finetune, model  # noqa: E402
from bouncelight_training.errors import TrainingError  # noqa: E402
from bouncelight_training.features import CHANNELS, TABLE  # noqa: E402
from bouncelight_training.weights import document, read, write  # noqa: E402

# Takes the flags of `bouncelight dataset --recipe scene`, as the finetune command gives them.
PROGRAM = """#!{python}
import os, sys
sys.path[:0] = {path!r}
import numpy as np
from safetensors.numpy import save_file
from test_toy import view
words = dict(zip(sys.argv[2::2], sys.argv[3::2]))
assert sys.argv[1] == "dataset" and words["--recipe"] == "scene" and int(words["--spp"]) > 0
os.makedirs(words["--out"], exist_ok=True)
for v in range(int(words["--views"])):
    raster, layers = view(np.random.default_rng((int(words["--seed"]), v)))
    raster["light"] = np.ascontiguousarray(layers["DiffDir"] + layers["DiffInd"] - raster["direct"], np.float32)
    save_file(raster, os.path.join(words["--out"], f"{{words['--scene']}}_view{{v}}.safetensors"))
"""


class Finetune(unittest.TestCase):
    def setUp(self):
        torch.set_num_threads(1)
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = scratch.name
        self.program = os.path.join(self.folder, "program")
        with open(self.program, "w") as file:
            file.write(PROGRAM.format(python=sys.executable, path=[p for p in sys.path if p]))
        os.chmod(self.program, stat.S_IRWXU)
        self.init = os.path.join(self.folder, "init.safetensors")
        network = model.compact_unet((4, 6, 8), pointwise=1)
        write(self.init, network.state_dict(), document(network.graph, network.output, inputs=TABLE, meaning=model.MEANING, output_channels=model.ANSWER))

    def test_held_out_views_get_better(self):
        out = os.path.join(self.folder, "toy.safetensors")
        told = finetune.finetune(self.program, "toy", out, self.folder, self.init, views=10, spp=16, epochs=12, learning_rate=5e-3, ema=0.9, threads=1)
        error = told["held_out_error"]
        state = finetune.train.read_checkpoint(os.path.join(self.folder, "run", "checkpoint.pt"))
        self.assertEqual(state["best"][0], min(state["best"][0], *[row["validation_error"] for row in state["rows"]]))
        self.assertTrue(all(torch.equal(values, state["average"][name]) for name, values in state["best"][1].items()))
        # The network starts as the first guess and may change it by 30 %.
        self.assertEqual(error["before"], error["first guess"])
        self.assertLess(error["after"], 0.9 * error["before"])
        self.assertEqual((told["views"], told["held_out_views"], told["samples_seen"]), (10, 2, 120))
        tensors, doc = read(out)
        self.assertEqual(doc["name"], "fitted to toy")
        self.assertIn("16 samples a cell", json.dumps(doc["provenance"]))
        self.assertEqual(finetune.shape_of(out), ((4, 6, 8), 1, tuple(name for name, _ in TABLE)))
        self.assertGreater(np.abs(tensors["head.weight"]).max(), 0)

    def test_says_what_is_wrong(self):
        other = os.path.join(self.folder, "other.safetensors")
        network = model.GraphNet(*model.unet(CHANNELS, (4, 6), model.ANSWER))
        write(other, network.state_dict(), document(network.graph, network.output, inputs=TABLE, meaning=model.MEANING, output_channels=model.ANSWER))
        with self.assertRaisesRegex(TrainingError, "not one of this package's U-Nets"):
            finetune.shape_of(other)
        with self.assertRaisesRegex(TrainingError, "none.safetensors: cannot start from it"):
            finetune.shape_of(os.path.join(self.folder, "none.safetensors"))
        with self.assertRaisesRegex(TrainingError, "build it with cargo"):
            finetune.draw(os.path.join(self.folder, "nothing"), "toy", self.folder, 1, 1, 1, "64x32")
        with self.assertRaisesRegex(TrainingError, "ended with code 1"):
            finetune.draw(self.program, "toy", self.folder, 1, 0, 1, "64x32")


if __name__ == "__main__":
    unittest.main()
