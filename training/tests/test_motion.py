"""The temporal term on made-up frames: what stands still counts nothing, what flickers is learnt away."""
import os
import sys
import tempfile
import unittest

import numpy as np
import torch
from safetensors.numpy import save_file

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from bouncelight_training import export, motion, train  # noqa: E402
from bouncelight_training.errors import TrainingError  # noqa: E402
from bouncelight_training.features import SLICES  # noqa: E402
from bouncelight_training.weights import read  # noqa: E402
from tests import test_toy  # noqa: E402
from tests.test_toy import H, W  # noqa: E402


def frames(room, brighter=2.0):
    """A sample whose second frame is the first moved one cell to the left, under an exposure `brighter` times as large."""
    raster, _ = test_toy.view(np.random.default_rng((3, room)))
    following = np.roll(raster["features"], -1, 2)
    for name in ("direct", "outgoing", "sky", "guess"):
        following[SLICES[name]] = np.log1p(np.expm1(following[SLICES[name]]) / brighter)
    x, y = np.meshgrid(np.arange(W, dtype=np.float32), np.arange(H, dtype=np.float32))
    flow = np.stack([np.where(x > 0, x - 1, motion.UNSEEN), np.where(x > 0, y, motion.UNSEEN)])
    return raster | {"next_features": following, "next_scale": raster["scale"] * brighter, "flow": flow.astype(np.float32)}


def write(folder, rooms, change=lambda sample: sample):
    os.makedirs(folder, exist_ok=True)
    for room in rooms:
        arrays = {name: np.ascontiguousarray(values, np.float32) for name, values in change(frames(room)).items()}
        save_file(arrays, os.path.join(folder, f"room{room:04}_view0.safetensors"))
    out = folder + ".npz"
    motion.build(folder, out)
    return out


class Motion(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        torch.set_num_threads(1)
        cls.scratch = tempfile.TemporaryDirectory()
        cls.folder = cls.scratch.name
        test_toy.write_views(cls.folder, [2, 6, 7, 8])
        cls.train, cls.validation = (test_toy.build(cls.folder, rooms, name) for rooms, name in (({6, 7, 8}, "train.npz"), ({2}, "val.npz")))

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    def config(self, **more):
        return train.Config(**{"train": self.train, "validation": self.validation, "batch": 3, "epochs": 15, "warmup_steps": 3,
                               "learning_rate": 5e-3, "ema": 0.9, "widths": (8, 12), **more})

    def place(self, name):
        return os.path.join(self.folder, name)

    def test_what_stands_still_does_not_flicker(self):
        pairs = motion.Pairs(write(self.place("still"), [6, 7]))
        self.assertLess(motion.flicker(pairs), 2e-3)  # half floats

        def stay(sample):
            sample["flow"][0] = np.where(sample["flow"][0] >= 0, sample["flow"][0] + 1, motion.UNSEEN)
            sample["next_features"][SLICES["guess"]] *= 1.1
            return sample

        # Light that is another in the second frame, and an exposure that is not brought to the first's.
        self.assertGreater(motion.flicker(motion.Pairs(write(self.place("other"), [6, 7], stay))), 0.05)
        pairs.next_scale /= 2
        self.assertGreater(motion.flicker(pairs), 0.3)

    def test_a_window_shows_what_the_whole_shows(self):
        pairs = motion.Pairs(write(self.place("window"), [6]))
        cut = pairs.pair(0, 4, 8)
        light = torch.expm1(cut.frames[:, SLICES["guess"]])
        first, there, inside = motion.change(light[:1], light[1:], cut)
        self.assertEqual(inside[0].sum().item(), 7 * H, "all but its left column")
        self.assertLess(((first - there).abs() * inside[:, None]).max().item(), 2e-3)

    def test_flicker_is_learnt_away(self):
        def noisy(sample):
            # Positions that the network has only seen as zeros: whatever it makes of them is flicker.
            sample["next_features"][SLICES["position"]] = np.random.default_rng(1).normal(0, 1, (3, H, W))
            return sample

        path = write(self.place("noisy"), [6, 7, 8], noisy)
        pairs, found = motion.Pairs(path), {}
        for name, more in {"without": {}, "with": {"motion": path, "temporal": 1.0, "temporal_from": 0.2}}.items():
            run = train.train(self.config(**more), self.place(name))
            model = run.averaged()
            found[name] = (motion.flicker(pairs, lambda f: model(f)), run.rows[-1]["validation_error"])
        self.assertLess(found["with"][0], 0.5 * found["without"][0])
        self.assertLess(found["with"][1], 1.5 * found["without"][1])
        # A file of the same numbers flickers as much.
        out = self.place("out.safetensors")
        export.export(self.place("with"), out)
        self.assertAlmostEqual(motion.flicker(pairs, motion.network_of(out)), found["with"][0], delta=0.2 * found["with"][0] + 1e-3)

    def test_a_file_can_lie_halfway_to_another(self):
        ends = [self.place(f"end{i}.safetensors") for i in (1, 2)]
        for i, out in enumerate(ends):
            train.train(self.config(epochs=2, seed=i + 1), self.place(f"end{i}"))
            export.export(self.place(f"end{i}"), out)
        middle = self.place("middle.safetensors")
        told = export.export(self.place("end0"), middle, halfway_to=ends[1])
        a, b, m = (read(path) for path in (*ends, middle))
        for name, values in m[0].items():
            np.testing.assert_allclose(values, 0.5 * (a[0][name] + b[0][name]), atol=1e-6)
        self.assertEqual(m[1]["provenance"]["halfway_to"]["file"], "end2.safetensors")
        self.assertAlmostEqual(m[1]["provenance"]["validation_error"]["value"], told["validation_error_of_file"], places=4)
        train.train(self.config(epochs=1, widths=(8, 16)), self.place("wider"))
        with self.assertRaisesRegex(TrainingError, "another one"):
            export.export(self.place("wider"), middle, halfway_to=ends[1])

    def test_a_killed_run_goes_on_with_the_same_pairs(self):
        path = write(self.place("resumed"), [6, 7])
        config = self.config(motion=path, temporal=0.5, temporal_from=0.0, epochs=4)
        whole = train.train(config, self.place("whole"))
        train.train(config, self.place("parts"), stop_after=3).save()
        parts = train.train(config, self.place("parts"))
        for name, values in whole.average.items():
            self.assertTrue(torch.equal(values, parts.average[name]), name)

    def test_bad_pairs_are_refused(self):
        def without(sample):
            del sample["flow"]
            return sample

        def broken(sample):
            sample["flow"][0, 0, 0] = np.nan
            return sample

        for name, change, message in (("without", without, "no tensor flow"), ("nan", broken, "not finite")):
            with self.assertRaisesRegex(TrainingError, message):
                write(self.place("bad_" + name), [6], change)
        with self.assertRaisesRegex(TrainingError, "kept for judging"):
            write(self.place("judged"), [27])
        with self.assertRaisesRegex(TrainingError, "go together"):
            train.train(self.config(motion=self.place("x")), self.place("alone"))
        with open(self.place("text.npz"), "w") as file:
            file.write("no archive")
        with self.assertRaisesRegex(TrainingError, "not readable.*bouncelight_training.motion"):
            motion.Pairs(self.place("text.npz"))


if __name__ == "__main__":
    unittest.main()
