"""The paper's recipe on small made-up pictures: published graph, pairs, both adversarial steps, kill and resume, export, the program.

    python -m unittest discover -s tests        (in training/)

With BOUNCELIGHT=FILE naming the program, the exported file also goes through `apply` and `weights convert`.
"""
import json
import os
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import OpenEXR
import torch
from PIL import Image

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, ".."), os.path.join(HERE, "..", "..", "weights-format", "fixtures")]
from bouncelight_training import filmic, stream  # noqa: E402
from bouncelight_training.errors import TrainingError  # noqa: E402
from bouncelight_training.pix2pix import export, model, pairs, train  # noqa: E402
from bouncelight_weights.graph import complete  # noqa: E402

W, H = 32, 16
PROGRAM = os.environ.get("BOUNCELIGHT")


def write_exr(path, channels):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {k: np.ascontiguousarray(v, np.float32) for k, v in channels.items()}).write(path)


def write_views(folder, rooms, seed=0):
    """Rooms of blocks of colour, half lit; Cycles' picture has a bounce that direct light misses."""
    for kind in ("raster", "cycles"):
        os.makedirs(os.path.join(folder, kind), exist_ok=True)
    for room in rooms:
        rng = np.random.default_rng((seed, room))
        albedo = np.repeat(np.repeat(rng.uniform(0.2, 0.8, (2, 4, 3)), H // 2, 0), W // 4, 1)
        lit = (np.arange(W)[None, :, None] < rng.integers(8, 24)) * np.ones((H, 1, 1))
        direct = 0.3 * lit * albedo
        full = direct + albedo * (stream.SKY_RADIANCE + 0.1 * direct.mean())
        depth = np.broadcast_to(10 + np.arange(H)[:, None], (H, W))
        name = f"room{room:04}_view0.exr"
        ours = {"RGB"[c]: direct[..., c] for c in range(3)} | {f"DiffCol.{'RGB'[c]}": albedo[..., c] for c in range(3)}
        ours |= {f"GlossCol.{c}": np.full((H, W), 0.04) for c in "RGB"} | {"Normal.X": -np.ones((H, W)), "Normal.Y": np.zeros((H, W)), "Normal.Z": np.zeros((H, W))}
        write_exr(os.path.join(folder, "raster", name), ours | {"Depth.Z": depth})
        write_exr(os.path.join(folder, "cycles", name), {f"ViewLayer.Combined.{'RGB'[c]}": full[..., c] for c in range(3)})


def build(folder, rooms=None, normals="clamped", name="pairs.npz"):
    out = os.path.join(folder, name)
    pairs.build(os.path.join(folder, "raster"), os.path.join(folder, "cycles"), out, rooms, normals)
    return out


class Published(unittest.TestCase):
    def test_graph_is_the_published_network(self):
        import published
        self.assertEqual(sum(p.numel() for p in model.generator(64).parameters()), 54_413_315 + 9_856)
        x = torch.randn(1, 12, 256, 256, generator=torch.Generator().manual_seed(0))
        for norm in model.NORMS:
            theirs, ours = published.Pix2pix(4, norm), model.generator(4, norm)
            state = {k: v for k, v in theirs.state_dict().items() if not k.endswith("num_batches_tracked")}
            train.load(ours, state)
            for mode in (True, False):
                theirs.train(mode), ours.train(mode)
                torch.manual_seed(3)
                expected = theirs(x)
                torch.manual_seed(3)
                self.assertTrue(torch.equal(ours(x), expected), (norm, mode))
            # Negative control: dropout changes the picture.
            torch.manual_seed(4)
            self.assertFalse(torch.equal(ours.train()(x), expected), norm)

    def test_discriminator_answers_for_patches(self):
        patches = model.Discriminator(4)
        self.assertEqual(tuple(patches(torch.zeros(1, 3, 128, 256), torch.zeros(1, 12, 128, 256)).shape), (1, 1, 8, 16))
        self.assertEqual(sum(isinstance(m, torch.nn.Conv2d) for m in patches.modules()), 5)


class Toy(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        torch.set_num_threads(1)
        cls.scratch = tempfile.TemporaryDirectory()
        cls.folder = cls.scratch.name
        write_views(cls.folder, [2, 6, 7, 8, 9, 13])
        cls.pairs = build(cls.folder)

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    def config(self, **more):
        return train.Config(**{"pairs": self.pairs, "width": 2, "epochs": 5, "log_steps": 10, **more})

    def run_in(self, name, config=None, **more):
        return train.train(config or self.config(), os.path.join(self.folder, name), **more)

    def test_pairs(self):
        data = pairs.Pairs(self.pairs)
        self.assertEqual((data.pictures.shape, data.target.shape), ((6, 4, H, W, 3), (6, H, W, 3)))
        depth, direct, diffuse, normal = data.pictures[1]
        np.testing.assert_array_equal(depth[0], filmic.shown(np.zeros((W, 3))))
        np.testing.assert_array_equal(depth[-1], filmic.shown(np.ones((W, 3))))
        # Lit by the sky where the sun does not reach, and never darker than nothing.
        self.assertGreater(int(direct.min()), 0)
        # A wall that faces -X: lost by clamping, kept by halving.
        self.assertEqual(int(normal.max()), 0)
        halved = pairs.Pairs(build(self.folder, {6}, "halved", "halved.npz"))
        self.assertEqual(halved.pictures[0, 3, 0, 0].tolist(), [0, 128, 128])
        four, target = data.tensors(1)
        self.assertEqual((four.shape, target.shape), ((1, 12, H, W), (1, 3, H, W)))
        np.testing.assert_allclose(four[0, 3:6, 2, 5], direct[2, 5] / 127.5 - 1, atol=1e-6)
        parts = [set(map(int, data.room[part])) for part in data.split(1)]
        self.assertEqual(set.union(*parts), {2, 6, 7, 8, 9, 13})
        self.assertEqual(sum(map(len, parts)), 6)
        self.assertIn(2, parts[1])

    def test_refuses(self):
        folder = tempfile.mkdtemp(dir=self.folder)
        write_views(folder, [33, 2201])
        with self.assertRaisesRegex(TrainingError, r"\[33, 2201\] are kept for judging"):
            build(folder)
        write_exr(os.path.join(folder, "cycles", "room0033_view0.exr"), {"Y": np.zeros((H, W))})
        with self.assertRaisesRegex(TrainingError, "no channel Combined.R"):
            pairs.target_of(os.path.join(folder, "cycles", "room0033_view0.exr"))
        with self.assertRaisesRegex(TrainingError, "not readable.*pix2pix.pairs"):
            pairs.Pairs(os.path.join(folder, "none.npz"))

    def test_only_the_described_step_has_an_adversarial_gradient(self):
        gradients = {}
        for adversarial in train.ADVERSARIAL:
            for l1 in (0.0, 100.0):
                run = train.Run(self.config(adversarial=adversarial, l1=l1), self.folder, pairs.Pairs(self.pairs))
                torch.manual_seed(1)
                four, target = run.on_device(int(run.train[0]))
                loss = run.losses(four, target)[2]
                loss.backward()
                gradients[adversarial, l1] = run.generator.get_submodule("final.2").weight.grad.norm().item()
        self.assertEqual(gradients["published", 0.0], 0.0)
        self.assertGreater(gradients["described", 0.0], 1e-6)
        self.assertGreater(gradients["published", 100.0], 1e-6)

    def test_learns_resumes_exports(self):
        for adversarial in train.ADVERSARIAL:
            config = self.config(adversarial=adversarial)
            whole = self.run_in(f"whole-{adversarial}", config)
            steps = 5 * len(whole.train)
            self.assertEqual(whole.step, steps)
            self.assertLess(whole.rows[-1]["validation_l1"], whole.rows[0]["validation_l1"])
            # Stopped with a save at step 7, then killed without one.
            name = f"killed-{adversarial}"
            self.run_in(name, config, stop_after=7).save()
            self.run_in(name, config, stop_after=2)
            again = self.run_in(name, config)
            for part in ("generator", "discriminator"):
                for key, values in getattr(whole, part).state_dict().items():
                    self.assertTrue(torch.equal(values, getattr(again, part).state_dict()[key]), key)
        other = self.run_in("other", self.config(seed=2))
        self.assertFalse(torch.equal(whole.generator.state_dict()["final.2.weight"], other.generator.state_dict()["final.2.weight"]))
        with self.assertRaisesRegex(TrainingError, "another seed"):
            self.run_in("whole-published", self.config(seed=2))
        for name in ("config.json", "log.csv", "loss.png", "validation.png"):
            self.assertTrue(os.path.getsize(os.path.join(self.folder, "whole-published", name)), name)
        run, out = os.path.join(self.folder, "whole-published"), os.path.join(self.folder, "toy.safetensors")
        for half in (False, True):
            told = export.export(run, out, half=half)
            self.assertAlmostEqual(told["validation_l1"], told["of_file"]["validation_l1"], delta=1e-2 if half else 1e-6)
        with open(os.path.join(self.folder, "toy.json")) as file:
            about = json.load(file)
        self.assertEqual(about["samples_seen"], steps)
        self.assertNotIn(self.folder, json.dumps(about))
        wrong = export.generator_of(export.read_checkpoint(os.path.join(self.folder, "other", "checkpoint.pt")))
        with self.assertRaisesRegex(TrainingError, "not what was trained"):
            export.verify(out, wrong, 1e-6, [torch.randn(1, 12, H, W)])

    def test_not_finite_stops(self):
        with self.assertRaisesRegex(TrainingError, r"generator's loss is nan at step \d+ \(room \d+ view 0\)"):
            self.run_in("exploded", self.config(l1=float("nan")))

    @unittest.skipUnless(PROGRAM, "SKIP: BOUNCELIGHT does not name the program")
    def test_the_program_gives_the_same_picture(self):
        self.run_in("short", self.config(width=4), stop_after=10).save()
        run = os.path.join(self.folder, "short")
        out, state, converted = (os.path.join(self.folder, n) for n in ("short.safetensors", "state.safetensors", "converted.safetensors"))
        export.export(run, out, half=True, state_path=state)
        data = pairs.Pairs(self.pairs)
        flags = []
        for name, picture in zip(model.PICTURES, data.pictures[1]):
            path = os.path.join(self.folder, f"{name}.png")
            Image.fromarray(picture).save(path)
            flags += [f"--{name}", path]
        subprocess.run([PROGRAM, "weights", "convert", state, "--arch", "pix2pix", "--norm", "group", "--dtype", "f16", "-o", converted], check=True, capture_output=True)
        documents = [export.read(path)[1] for path in (out, converted)]
        for field in ("graph", "inputs", "output", "cell", "table"):
            self.assertEqual(*[complete(d["graph"]) if field == "graph" else d[field] for d in documents])
        four = torch.from_numpy(data.tensors(1)[0])
        with torch.no_grad():
            expected = train.as_shown(export.generator_of(export.read_checkpoint(os.path.join(run, "checkpoint.pt"))).padded(four)).astype(int)
        made = os.path.join(self.folder, "made.png")
        for weights in (out, converted):
            subprocess.run([PROGRAM, "apply", *flags, "--weights", weights, "-o", made, "-q"], check=True, capture_output=True)
            self.assertLessEqual(np.abs(np.asarray(Image.open(made)).astype(int) - expected).max(), 1, weights)
        # Negative control: dropout makes another picture.
        subprocess.run([PROGRAM, "apply", *flags, "--weights", out, "-o", made, "-q", "--dropout", "1"], check=True, capture_output=True)
        self.assertGreater(np.abs(np.asarray(Image.open(made)).astype(int) - expected).max(), 1)


class Filmic(unittest.TestCase):
    def test_is_what_blender_shows(self):
        # Linear red, green, blue, then what Blender shows through Filmic, AgX and Neutral; the limits are tests/render/tonemap.rs's.
        path = os.path.join(HERE, "..", "..", "tests", "fixtures", "tonemap", "samples.bin")
        samples = np.fromfile(path, "<f4").reshape(-1, 12)
        difference = 255 * np.abs(filmic.filmic(samples[:, :3]) - samples[:, 3:6])
        self.assertLess(difference.mean(), 0.25)
        self.assertLess(np.percentile(difference, 99.9), 4)
        # Negative control: AgX is another view.
        self.assertGreater(255 * np.abs(filmic.filmic(samples[:, :3]) - samples[:, 6:9]).mean(), 5)

    def test_bad_light(self):
        self.assertEqual(filmic.shown([[0, -1, np.nan], [np.inf, np.inf, np.inf]]).tolist(), [[0, 0, 0], [255, 255, 255]])


if __name__ == "__main__":
    unittest.main()
