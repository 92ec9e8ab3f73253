"""The paper's recipe on small made-up pictures: published graphs, views, both adversarial steps, kill and resume, export, the program.

    python -m unittest discover -s tests        (in training/)

With BOUNCELIGHT=FILE naming the program, the exported file also goes through `apply` and `weights convert`.
"""
import importlib.util
import json
import math
import os
import shutil
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
from bouncelight_training.pix2pix import examples, export, model, train, views  # noqa: E402
from bouncelight_weights.graph import complete  # noqa: E402

W, H = 32, 16
PROGRAM = os.environ.get("BOUNCELIGHT")


def write_exr(path, channels):
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {k: np.ascontiguousarray(v, np.float32) for k, v in channels.items()}).write(path)


def raster_of(room, seed=0):
    """A raster EXR's channels and Cycles' picture of blocks of colour, half lit, where Cycles has a bounce that direct light misses."""
    rng = np.random.default_rng((seed, room))
    albedo = np.repeat(np.repeat(rng.uniform(0.2, 0.8, (2, 4, 3)), H // 2, 0), W // 4, 1)
    lit = (np.arange(W)[None, :, None] < rng.integers(8, 24)) * np.ones((H, 1, 1))
    direct = 0.3 * lit * albedo
    full = direct + albedo * (stream.SKY_RADIANCE + 0.1 * direct.mean())
    depth = np.broadcast_to(10 + np.arange(H)[:, None], (H, W))
    rgb = lambda name, values: {f"{name}{c}": values[..., i] for i, c in enumerate("RGB")}
    ours = rgb("", 0.9 * full) | rgb("DiffCol.", albedo) | rgb("DiffDir.", np.repeat(0.3 * lit, 3, -1)) | rgb("GlossCol.", np.full((H, W, 3), 0.04)) | rgb("GlossDir.", np.zeros((H, W, 3)))
    ours |= rgb("Emit.", np.zeros((H, W, 3))) | {"Normal.X": -np.ones((H, W)), "Normal.Y": np.zeros((H, W)), "Normal.Z": np.zeros((H, W)), "Depth.Z": depth}
    return ours, rgb("ViewLayer.Combined.", full)


def write_views(folder, rooms, seed=0):
    for room in rooms:
        raster, cycles = (os.path.join(folder, name) for name in ("raster.exr", "cycles.exr"))
        for path, channels in zip((raster, cycles), raster_of(room, seed)):
            write_exr(path, channels)
        name = f"room{room:04}"
        pictures = views.inputs_of(raster) | {views.TARGET: views.target_of(cycles)}
        views.write(os.path.join(folder, name + ".npz"), pictures, {"view": name, "room": room, "size": (W, H), "samples": 1, "targets": "made up"})
    return folder


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


    def test_deep_illumination_is_the_published_network(self):
        import published
        x = torch.randn(1, 12, 256, 256, generator=torch.Generator().manual_seed(0))
        theirs, ours = published.DeepIllumination(4, "batch").eval(), model.generator(4, "batch", "deep-illumination").eval()
        state = {}
        for key, values in theirs.state_dict().items():
            if key.startswith("conv") or key.startswith("deconv"):
                state[key] = values
        for i in range(1, 9):
            for name, step in ((f"conv{i}", i - 1), (f"deconv{i}", 7 - i)):
                norm = f"{name}.batch_norm"
                if f"{norm}.weight" in ours.state_dict():
                    state |= {f"{norm}.{k}": v for k, v in getattr(theirs, theirs.names[step]).state_dict().items() if k != "num_batches_tracked"}
        train.load(ours, state)
        with torch.no_grad():
            self.assertLess((ours(x) - theirs(x)).abs().max().item(), 1e-6)
            # Negative control: another picture.
            self.assertGreater((ours(x.flip(-1)) - theirs(x)).abs().max().item(), 1e-3)

    def test_the_gathered_generator_begins_with_what_it_is_given(self):
        x = torch.rand(1, 15, 256, 256, generator=torch.Generator().manual_seed(0)) * 2 - 1
        made = model.generator(4, network="gathered").eval()
        with torch.no_grad():
            far = (made(x) - x[:, 12:]).abs().mean().item()
            self.assertLess(far, 0.5)
            made.get_submodule("final.2").weight.zero_(), made.get_submodule("final.2").bias.zero_()
            self.assertTrue(torch.equal(made(x), x[:, 12:]))


class Toy(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        torch.set_num_threads(1)
        cls.scratch = tempfile.TemporaryDirectory()
        cls.folder = cls.scratch.name
        cls.views = write_views(tempfile.mkdtemp(dir=cls.folder), [2, 6, 7, 8, 9, 13])

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    def config(self, **more):
        return train.Config(**{"views": self.views, "width": 2, "steps": 25, "log_steps": 10, "crop": "24x16", "learning_rate": 2e-3, "average": 0.9, **more})

    def run_in(self, name, config=None, **more):
        return train.train(config or self.config(), os.path.join(self.folder, name), **more)

    def test_views(self):
        data = examples.Examples(self.views, "pix2pix", 5)
        pictures = data.pictures[1]
        self.assertEqual(pictures["depth"][0, :, 0].tolist(), filmic.shown(np.zeros((W, 3)))[:, 0].tolist())
        self.assertEqual(pictures["depth"][-1, :, 0].tolist(), filmic.shown(np.ones((W, 3)))[:, 0].tolist())
        # Lit by the sky where the sun does not reach, and never darker than nothing; the file's picture is brighter there.
        self.assertGreater(int(pictures["direct"].min()), 0)
        raster, cycles = raster_of(6)
        light = np.stack([raster[f"DiffDir.{c}"] * raster[f"DiffCol.{c}"] for c in "RGB"], -1)
        sky = stream.SKY_RADIANCE * np.stack([raster[f"DiffCol.{c}"] + raster[f"GlossCol.{c}"] for c in "RGB"], -1)
        np.testing.assert_allclose(pictures["direct"].astype(int), filmic.shown(light + sky).astype(int), atol=1)
        np.testing.assert_allclose(pictures["gathered"].astype(int), filmic.shown(np.stack([raster[c] for c in "RGB"], -1)).astype(int), atol=1)
        # A wall that faces -X is lost by clamping.
        self.assertEqual(int(pictures["normal"].max()), 0)
        four, target = data.example(1)
        self.assertEqual((four.shape, target.shape), ((1, 12, H, W), (1, 3, H, W)))
        np.testing.assert_allclose(four[0, 3:6, 2, 5], pictures["direct"][2, 5] / 127.5 - 1, atol=1e-6)
        # A window, and another order of colours: of light and albedo, not of depth and normals.
        part, _ = data.example(1, (slice(2, 10), slice(4, 20)), (2, 0, 1))
        np.testing.assert_array_equal(part[0, 3:6], four[0, [5, 3, 4], 2:10, 4:20])
        np.testing.assert_array_equal(part[0, 9:12], four[0, 9:12, 2:10, 4:20])
        self.assertEqual(examples.Examples(self.views, "gathered", 5).example(1)[0].shape[1], 15)
        stretched, _ = examples.Examples(self.views, "deep-illumination", 5).example(1)
        self.assertEqual((stretched[0, 3:6].min(), stretched[0, 3:6].max()), (-1, 1))
        # Room 2 validates, and every fifth; no view does both.
        self.assertEqual((sorted(data.validation), sorted(data.train)), ([0, 4], [1, 2, 3, 5]))

    def test_refuses(self):
        folder = tempfile.mkdtemp(dir=self.folder)
        write_views(folder, [33])
        with self.assertRaisesRegex(TrainingError, "room 33 is kept for judging"):
            examples.Examples(folder, "pix2pix", 5)
        with self.assertRaisesRegex(TrainingError, r"\[33, 2201\] are kept for judging"):
            views.main.__wrapped__([folder, "--rooms", "6,33,2201"])
        with self.assertRaisesRegex(TrainingError, "either --rooms or --scene"):
            views.main.__wrapped__([folder])
        write_exr(os.path.join(folder, "cycles.exr"), {"Y": np.zeros((H, W))})
        with self.assertRaisesRegex(TrainingError, "no channel"):
            views.target_of(os.path.join(folder, "cycles.exr"))
        with self.assertRaisesRegex(TrainingError, "no views.*pix2pix.views"):
            examples.Examples(os.path.join(folder, "none"), "pix2pix", 5)
        with open(os.path.join(folder, "room0006.npz"), "wb") as file:
            file.write(b"half a file")
        with self.assertRaisesRegex(TrainingError, "room0006.npz: not a view.*pix2pix.views"):
            examples.Examples(folder, "pix2pix", 5)

    def test_only_the_described_step_has_an_adversarial_gradient(self):
        gradients = {}
        for adversarial in train.ADVERSARIAL:
            for l1 in (0.0, 100.0):
                config = self.config(adversarial=adversarial, l1=l1)
                run = train.Run(config, self.folder, examples.Examples(self.views, "pix2pix", 5))
                torch.manual_seed(1)
                run.losses(*run.example()[1:])[2].backward()
                gradients[adversarial, l1] = run.generator.get_submodule("final.2").weight.grad.norm().item()
        self.assertEqual(gradients["published", 0.0], 0.0)
        self.assertGreater(gradients["described", 0.0], 1e-6)
        self.assertGreater(gradients["published", 100.0], 1e-6)

    def test_learns_resumes_exports(self):
        for adversarial in train.ADVERSARIAL:
            config = self.config(adversarial=adversarial)
            whole = self.run_in(f"whole-{adversarial}", config)
            self.assertEqual(whole.step, 25)
            self.assertLess(whole.rows[-1]["validation_l1"], whole.rows[0]["validation_l1"])
            # Stopped with a save at step 7, then killed without one.
            name = f"killed-{adversarial}"
            self.run_in(name, config, stop_after=7).save()
            self.run_in(name, config, stop_after=2)
            again = self.run_in(name, config)
            self.assertEqual("discriminator" in whole.networks, adversarial == "described")
            for part, network in whole.networks.items():
                for key, values in network.state_dict().items():
                    self.assertTrue(torch.equal(values, again.networks[part].state_dict()[key]), key)
        other = self.run_in("other", self.config(seed=2))
        self.assertFalse(torch.equal(whole.generator.state_dict()["final.2.weight"], other.generator.state_dict()["final.2.weight"]))
        with self.assertRaisesRegex(TrainingError, "another seed"):
            self.run_in("whole-published", self.config(seed=2))
        for name in ("config.json", "log.csv", "loss.png", "validation.png"):
            self.assertTrue(os.path.getsize(os.path.join(self.folder, "whole-published", name)), name)
        # It goes on with more steps at its end only.
        self.run_in("stopped", self.config(), stop_after=3).save()
        with self.assertRaisesRegex(TrainingError, "another steps"):
            self.run_in("stopped", self.config(steps=30))
        shutil.copytree(os.path.join(self.folder, "whole-published"), os.path.join(self.folder, "further"))
        further = self.run_in("further", self.config(steps=30))
        self.assertEqual((further.step, len(further.before)), (30, 1))
        self.assertIn("--steps 25", further.before[0])
        run, out = os.path.join(self.folder, "whole-published"), os.path.join(self.folder, "toy.safetensors")
        sizes = []
        for stored, delta in (("f32", 1e-6), ("f16", 1e-2), ("i8", 1e-2)):
            told = export.export(run, out, stored=stored)
            self.assertAlmostEqual(told["validation_l1"], told["of_file"]["validation_l1"], delta=delta)
            sizes.append(told["bytes"])
        self.assertEqual(sizes, sorted(sizes, reverse=True))
        with open(os.path.join(self.folder, "toy.json")) as file:
            about = json.load(file)
        self.assertEqual(about["samples_seen"], 25)
        self.assertNotIn(self.folder, json.dumps(about))
        wrong = export.generator_of(export.read_checkpoint(os.path.join(self.folder, "other", "checkpoint.pt")))
        with self.assertRaisesRegex(TrainingError, "not what was trained"):
            export.verify(out, wrong, 1e-6, [torch.randn(1, 12, H, W)])

    def test_not_finite_stops(self):
        with self.assertRaisesRegex(TrainingError, r"generator's loss is nan at step \d+ \(room\d+\)"):
            self.run_in("exploded", self.config(l1=float("nan")))

    @unittest.skipUnless(PROGRAM, "SKIP: BOUNCELIGHT does not name the program")
    def test_the_program_gives_the_same_picture(self):
        self.run_in("short", self.config(width=4), stop_after=10).save()
        run = os.path.join(self.folder, "short")
        out, state, converted = (os.path.join(self.folder, n) for n in ("short.safetensors", "state.safetensors", "converted.safetensors"))
        export.export(run, out, stored="f16", state_path=state)
        data = examples.Examples(self.views, "pix2pix", 5)
        flags = []
        for name in model.PICTURES:
            path = os.path.join(self.folder, f"{name}.png")
            picture = data.pictures[1][name]
            Image.fromarray(np.repeat(picture, 3, -1) if name == "depth" else picture).save(path)
            flags += [f"--{name}", path]
        subprocess.run([PROGRAM, "weights", "convert", state, "--arch", "pix2pix", "--norm", "group", "--dtype", "f16", "-o", converted], check=True, capture_output=True)
        documents = [export.read(path)[1] for path in (out, converted)]
        for field in ("graph", "inputs", "output", "cell", "table"):
            self.assertEqual(*[complete(d["graph"]) if field == "graph" else d[field] for d in documents])
        four = torch.from_numpy(data.example(1)[0])
        with torch.no_grad():
            expected = train.as_shown(export.generator_of(export.read_checkpoint(os.path.join(run, "checkpoint.pt"))).padded(four)).astype(int)
        made = os.path.join(self.folder, "made.png")
        for weights in (out, converted):
            subprocess.run([PROGRAM, "apply", *flags, "--weights", weights, "-o", made, "-q"], check=True, capture_output=True)
            self.assertLessEqual(np.abs(np.asarray(Image.open(made)).astype(int) - expected).max(), 1, weights)
        # Negative control: dropout makes another picture.
        subprocess.run([PROGRAM, "apply", *flags, "--weights", out, "-o", made, "-q", "--dropout", "1"], check=True, capture_output=True)
        self.assertGreater(np.abs(np.asarray(Image.open(made)).astype(int) - expected).max(), 1)

    @unittest.skipUnless(PROGRAM and importlib.util.find_spec("pyoidn"), "SKIP: BOUNCELIGHT does not name the program, or no pyoidn")
    def test_views_of_a_scene_are_inside_it(self):
        eye, target, fov = views.camera_of([2 * math.tan(math.radians(30)) * 4 / 32, 1, 2, 3, 0, 0, -1], 32)
        self.assertEqual((eye, target), ([1, 2, 3], [1, 2, 2]))
        self.assertAlmostEqual(fov, 60)
        out = os.path.join(self.folder, "scene")
        views.main([out, "--scene", "cornell", "--views", "2", "--size", "64x32", "--spp", "1", "--sky", "0.1,0.2,0.3", "--bouncelight", PROGRAM])
        self.assertEqual(sorted(os.listdir(out)), ["cornell000.npz", "cornell001.npz"])
        for name in os.listdir(out):
            pictures, _ = views.read(os.path.join(out, name))
            # In a box that is shut on all sides but one, many pixels have a colour and light.
            for part in ("diffuse", "target", "gathered"):
                self.assertGreater((pictures[part].max(-1) > 0).mean(), 0.3, (name, part))

    @unittest.skipUnless(PROGRAM, "SKIP: BOUNCELIGHT does not name the program")
    def test_frames_are_given_what_views_hold(self):
        """`render` makes the pictures on the GPU, `views` from layers of a file; the same network paints the same picture of both."""
        at = lambda name: os.path.join(self.folder, name)
        scene = ["paper-room:6", "--size", "96x64", "--environment", "0.05"]
        for network in ("pix2pix", "gathered"):
            self.run_in(f"short-{network}", self.config(width=4, network=network), stop_after=5).save()
            export.export(at(f"short-{network}"), at("net.safetensors"))
            method = ["--method", "generator-gather" if network == "gathered" else "generator", "--weights", at("net.safetensors")]
            more = ["--samples", "1", "-q"]
            drawn = method + (["--accumulate", "1"] if network == "gathered" else [])
            layers = "DiffDir,DiffCol,GlossDir,GlossCol,Emit,Normal,Depth"
            subprocess.run([PROGRAM, "render", *scene, "--method", "gather", "--accumulate", "1", *more, "--aov", layers, "-o", at("layers.exr")], check=True, capture_output=True)
            subprocess.run([PROGRAM, "render", *scene, *drawn, *more, "--precision", "f32", "--exposure", "0", "-o", at("drawn.png")], check=True, capture_output=True)
            pictures = views.inputs_of(at("layers.exr"), 0.05)
            x = np.concatenate([examples.encoded(pictures[name], "signed").transpose(2, 0, 1) for name in model.NETWORKS[network][0]])[None]
            with torch.no_grad():
                expected = train.as_shown(export.generator_of(export.read_checkpoint(at(f"short-{network}/checkpoint.pt"))).padded(torch.from_numpy(x))).astype(int)
            surface = views.layers(at("layers.exr"))["Depth.Z"] < views.FARTHEST
            off = np.abs(np.asarray(Image.open(at("drawn.png")).convert("RGB")).astype(int) - expected)[surface]
            self.assertLess(off.mean(), 0.6, network)
            self.assertLess(np.percentile(off, 99), 4, network)
            # Negative control: the picture moved by a pixel is another.
            self.assertGreater(np.abs(np.roll(expected, 3, 1) - expected)[surface].mean(), 0.6, network)


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
