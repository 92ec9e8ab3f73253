"""The whole chain on small made-up data, in seconds: files, pairs, training, kill and resume, export, verification.

    python -m unittest discover -s tests        (in training/; pytest finds it as well)
"""
import json
import os
import sys
import tempfile
import unittest

import numpy as np
import OpenEXR
import torch
from safetensors.numpy import load_file, save_file

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from bouncelight_training import augment, baseline, data, export, losses, model, train, validation  # noqa: E402
from bouncelight_training.errors import TrainingError  # noqa: E402
from bouncelight_training.features import CHANNELS, LUMINANCE, SLICES, channel_means  # noqa: E402

H, W, SKY = 16, 32, np.array([0.05, 0.06, 0.08])


def view(rng):
    """A floor below a wall, a lit half, coloured lights: features and the Cycles layers that belong to them."""
    albedo = np.repeat(np.repeat(rng.uniform(0.2, 0.8, (3, 2, 4)), H // 2, 1), W // 4, 2)
    floor = np.arange(H)[:, None] >= H // 2 + 0 * np.arange(W)[None]
    normal = np.where(floor, np.array([0, 1.0, 0])[:, None, None], np.array([0, 0, 1.0])[:, None, None])
    lit = np.arange(W)[None] < rng.integers(8, 24) + 0 * np.arange(H)[:, None]
    direct = np.array([0.3, 0.25, 0.2])[:, None, None] * lit
    depth = np.where(floor, 10.0, 20.0) * rng.uniform(0.5, 2)
    s = float((np.tensordot(LUMINANCE, direct, 1)).mean() + LUMINANCE @ SKY)
    ones = np.ones((1, H, W))
    light = SKY[:, None, None] * np.where(floor, 0.8, 0.5) + 0.2 * albedo.mean((1, 2), keepdims=True) * direct.mean((1, 2), keepdims=True)
    # A first guess that is too bright on floors and too dark on walls.
    guess = light * np.where(floor, 1.5, 0.6)
    features = np.concatenate([np.log1p(direct / s), np.log1p(albedo * direct / s), albedo, normal, np.zeros((3, H, W)),
                               np.log(depth / depth.mean())[None], 0 * ones, ones, np.log1p(SKY / s)[:, None, None] * np.ones((3, H, W)),
                               np.log1p(guess / s)])
    noisy = light * rng.gamma(100, 1 / 100, (3, H, W))
    raster = {"features": features, "scale": np.array([s]), "direct": direct, "albedo": albedo, "normal": normal, "depth": depth}
    raster = {name: np.ascontiguousarray(v, np.float32) for name, v in raster.items()}
    return raster, {"DiffDir": direct + 0.5 * noisy, "DiffInd": 0.5 * noisy, "DiffCol": albedo,
                    "Normal": np.stack([normal[0], -normal[2], normal[1]]), "Depth": depth[None]}


def write_views(folder, rooms, views=2, seed=0):
    """Feature and EXR files of made-up rooms in folder/features and folder/cycles."""
    for kind in ("features", "cycles"):
        os.makedirs(os.path.join(folder, kind), exist_ok=True)
    for room in rooms:
        for v in range(views):
            raster, layers = view(np.random.default_rng((seed, room, v)))
            save_file(raster, os.path.join(folder, "features", f"room{room:04}_view{v}.safetensors"))
            letters = {"Normal": "XYZ", "Depth": "Z"}
            channels = {f"ViewLayer.{name}.{c}": np.ascontiguousarray(plane, np.float32)
                        for name, planes in layers.items() for c, plane in zip(letters.get(name, "RGB"), planes)}
            header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
            OpenEXR.File(header, channels).write(os.path.join(folder, "cycles", f"room{room:04}_view{v}.exr"))


def build(folder, rooms, name):
    out = os.path.join(folder, name)
    data.build(os.path.join(folder, "features"), os.path.join(folder, "cycles"), out, rooms)
    return out


class Toy(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        torch.set_num_threads(1)
        cls.scratch = tempfile.TemporaryDirectory()
        cls.folder = cls.scratch.name
        write_views(cls.folder, [2, 6, 7, 8])
        cls.train, cls.validation = build(cls.folder, {6, 7, 8}, "train.npz"), build(cls.folder, {2}, "val.npz")

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    def config(self, **more):
        return train.Config(**{"train": self.train, "validation": self.validation, "batch": 3, "epochs": 15, "warmup_steps": 3,
                               "learning_rate": 5e-3, "ema": 0.9, **more})

    def run_in(self, name, config=None, **more):
        return train.train(config or self.config(), os.path.join(self.folder, name), **more)

    def test_pairs(self):
        split = data.Split(self.train)
        self.assertEqual(split.features.shape, (6, CHANNELS, H, W))
        raster, layers = view(np.random.default_rng((0, 6, 0)))
        expected = (layers["DiffDir"] + layers["DiffInd"] - raster["direct"]) / raster["scale"][0]
        np.testing.assert_allclose(split.target[0], expected, rtol=2e-3, atol=2e-3)
        # Only the columns on both sides of the shadow's edge are left out.
        self.assertEqual(int((~split.mask[0]).sum()), 2 * H)
        self.assertAlmostEqual(split.report["rejected"]["shadow"], 1 - split.report["kept"], places=6)

    def test_own_light_needs_no_cycles(self):
        folder = tempfile.mkdtemp(dir=self.folder)
        write_views(folder, [6], 1)
        path = os.path.join(folder, "features", "room0006_view0.safetensors")
        features, out = os.path.join(folder, "features"), os.path.join(folder, "own.npz")
        with self.assertRaisesRegex(TrainingError, "no traced light"):
            data.build(features, None, out)
        tensors = load_file(path)
        tensors["light"] = np.full((3, H, W), 0.25, np.float32)
        os.remove(path)
        save_file(tensors, os.path.join(features, "varied0003_view0.safetensors"))
        data.build(features, None, out)
        split = data.Split(out)
        self.assertEqual((int(split.room[0]), float(split.mask.mean())), (-4, 1.0))
        np.testing.assert_allclose(split.target[0].astype(np.float32) * split.scale[0], 0.25, rtol=1e-3)

    def test_views_without_light_are_left_out(self):
        folder = tempfile.mkdtemp(dir=self.folder)
        write_views(folder, [6, 7], 1)
        for room, left in ((6, 1), (7, 0)):
            path = os.path.join(folder, "features", f"room{room:04}_view0.safetensors")
            tensors = load_file(path)
            tensors["scale"] = np.zeros(1, np.float32)
            os.remove(path)
            save_file(tensors, path)
            if left:
                build(folder, None, "lit.npz")
                self.assertEqual(list(data.Split(os.path.join(folder, "lit.npz")).room), [7])
            else:
                with self.assertRaisesRegex(TrainingError, "no view in it has any light"):
                    build(folder, None, "dark.npz")

    def test_splits_join(self):
        out = os.path.join(self.folder, "joined.npz")
        report = data.join([self.train, self.validation], out)
        whole, first, second = data.Split(out), data.Split(self.train), data.Split(self.validation)
        self.assertEqual(len(whole), len(first) + len(second))
        self.assertTrue(np.array_equal(whole.target[:len(first)], first.target) and np.array_equal(whole.features[len(first):], second.features))
        self.assertEqual(report["rooms"], [2, 6, 7, 8])
        self.assertAlmostEqual(report["kept"], whole.mask.mean())
        self.assertAlmostEqual(sum(report["rejected"].values()) + report["kept"], 1.0, places=6)
        # No view twice.
        with self.assertRaisesRegex(TrainingError, "room 6 view 0 is in two"):
            data.join([self.train, out], os.path.join(self.folder, "twice.npz"))
        self.assertFalse(os.path.exists(os.path.join(self.folder, "twice.npz")))

    def test_masks_see_what_is_wrong(self):
        folder = tempfile.mkdtemp(dir=self.folder)
        write_views(folder, [6], 1)
        path = os.path.join(folder, "features", "room0006_view0.safetensors")
        good = load_file(path)
        cycles = data.read_cycles(os.path.join(folder, "cycles", "room0006_view0.exr"))

        def rejected(change):
            raster = {k: v.copy() for k, v in good.items()}
            change(raster)
            return data.pair(raster, cycles)[2]

        def spread(r):
            r["features"][SLICES["spread"], :4] = 0.06

        def hit(r):
            r["features"][SLICES["hit"], :4] = 0

        changes = {"background": hit, "spread": spread, "normal": lambda r: r["normal"][:, :4].__imul__(-1), "depth": lambda r: r["depth"][:4].__imul__(1.2),
                   "albedo": lambda r: r["albedo"][:, :4].__iadd__(0.1), "negative": lambda r: r["direct"].__iadd__(0.3)}
        for reason, change in changes.items():
            self.assertEqual(rejected(lambda r: None)[reason], 0, reason)
            self.assertGreater(rejected(change)[reason], 4 * W - 1, reason)

    def test_refuses(self):
        with self.assertRaisesRegex(TrainingError, "kept for judging"):
            data.refuse_judged([6, 27])
        with self.assertRaisesRegex(TrainingError, "kept for judging"):
            data.refuse_judged([2200])
        folder = tempfile.mkdtemp(dir=self.folder)
        write_views(folder, [33], 1)
        with self.assertRaisesRegex(TrainingError, r"\[33\]"):
            build(folder, None, "x.npz")
        with self.assertRaisesRegex(TrainingError, "split by room"):
            self.run_in("same", self.config(validation=self.train))

    def test_learns_resumes_exports(self):
        whole = self.run_in("whole")
        self.assertEqual((whole.step, whole.samples()), (30, 90))
        self.assertLess(whole.rows[-1]["train_loss"], 0.5 * whole.rows[0]["train_loss"])
        # Untrained the error is that of the first guess, about 0.45.
        untrained = model.compact_unet(whole.config.widths)
        guessed = validation.validate(untrained, data.Split(self.validation), whole.config)[0]["validation_error"]
        self.assertTrue(0.35 < guessed < 0.55, guessed)
        self.assertLess(whole.rows[-1]["validation_error"], 0.2)
        # Stopped at step 13, in the middle of an epoch, with a save as a signal makes it; then killed without one at step 20.
        self.run_in("killed", stop_after=13).save()
        self.run_in("killed", stop_after=7)
        again = self.run_in("killed")
        for name, values in whole.average.items():
            self.assertTrue(torch.equal(values, again.average[name]), name)
        # Negative control: another seed gives other weights.
        other = self.run_in("other", self.config(seed=2))
        self.assertFalse(torch.equal(whole.average["head.weight"], other.average["head.weight"]))
        with self.assertRaisesRegex(TrainingError, "another seed"):
            self.run_in("whole", self.config(seed=2))
        for name in ("config.json", "log.csv", "loss.png", "validation.png"):
            self.assertTrue(os.path.getsize(os.path.join(self.folder, "whole", name)), name)
        out = os.path.join(self.folder, "toy.safetensors")
        for kind in ("i8", "", "f16"):
            told = export.export(os.path.join(self.folder, "whole"), out, kind=kind)
            self.assertAlmostEqual(told["validation_error"], told["validation_error_of_file"], delta=1e-2 if kind == "f16" else 1e-5)
        with open(os.path.join(self.folder, "toy.json")) as file:
            about = json.load(file)
        self.assertEqual(about["samples_seen"], 90)
        self.assertNotIn(self.folder, json.dumps(about))
        wrong = export.network_of(train.read_checkpoint(os.path.join(self.folder, "other", "checkpoint.pt")))
        with self.assertRaisesRegex(TrainingError, "not what was trained"):
            export.verify(out, wrong, export.TOLERANCE_HALF)

    def test_learns_for_bytes(self):
        run = self.run_in("bytes", self.config(quantise="i8", quantise_from=0.5))
        out = os.path.join(self.folder, "bytes.safetensors")
        told = export.export(os.path.join(self.folder, "bytes"), out)
        # What training last said is what the file gives.
        self.assertEqual(told["stored"], "i8")
        self.assertAlmostEqual(told["validation_error_of_file"], run.rows[-1]["validation_error"], places=6)
        tensors, _ = export.read(out)
        for name, values in run.averaged().state_dict().items():
            self.assertTrue(np.array_equal(tensors[name], values.numpy()), name)
        # Negative controls: rounding changes weights, and their true values are kept beside it.
        self.assertGreater(np.abs(run.average["head.weight"].numpy() - tensors["head.weight"]).max(), 0)
        self.assertLess(len(np.unique(tensors["head.weight"][0])), 256)
        self.assertLess(os.path.getsize(out), 0.4 * 4 * model.parameter_count(run.model))
        with self.assertRaisesRegex(TrainingError, "no such storage: i4"):
            self.run_in("nibbles", self.config(quantise="i4", quantise_from=0.0))

    def test_splits_by_view(self):
        views = self.config(validation=self.train, apart="view")
        with self.assertRaisesRegex(TrainingError, r"views \[0, 1, 0, 1, 0, 1\] .* another seed"):
            self.run_in("same-views", views)
        self.assertEqual(self.run_in("other-views", self.config(apart="view"), stop_after=1).step, 1)

    def test_not_finite_stops(self):
        folder = tempfile.mkdtemp(dir=self.folder)
        write_views(folder, [6], 1)
        path = os.path.join(folder, "features", "room0006_view0.safetensors")
        tensors = load_file(path)
        tensors["features"][2, 3, 4] = np.nan
        save_file(tensors, path)
        with self.assertRaisesRegex(TrainingError, "room0006_view0.safetensors: tensor features holds 1 "):
            build(folder, None, "x.npz")
        with np.load(self.train) as file:
            arrays = dict(file)
        arrays["target"][1, 0, 0, 0] = np.inf
        poisoned = os.path.join(folder, "poisoned.npz")
        np.savez(poisoned, **arrays)
        with self.assertRaisesRegex(TrainingError, "target of room 6 view 1"):
            self.run_in("poisoned", self.config(train=poisoned))
        with self.assertRaisesRegex(TrainingError, "(loss|gradient) is (nan|inf) at step"):
            self.run_in("exploded", self.config(epsilon=float("nan")))

    def test_bad_files_are_errors(self):
        path = os.path.join(self.folder, "broken.npz")
        with open(path, "wb") as file:
            file.write(b"PK\x03\x04 and no more")
        for call in (lambda: data.Split(path), lambda: data.Split(path + ".none"), lambda: data.read_features(path),
                     lambda: data.read_cycles(path), lambda: train.read_checkpoint(path)):
            with self.assertRaises(TrainingError):
                call()

    def test_mirror_and_colours(self):
        split = data.Split(self.train)
        f, t, m = split.features[0].astype(np.float32), split.target[0].astype(np.float32), split.mask[0]
        back = augment.mirror(*augment.mirror(f, t, m))
        for a, b in zip(back, (f, t, m)):
            np.testing.assert_array_equal(a, b)
        # The exposure is the luminance of what the features hold, before and after an exchange of colours.
        self.assertAlmostEqual(float(LUMINANCE @ channel_means(f)), 1, delta=5e-3)
        permuted, target = augment.permute_colours(f, t, [2, 0, 1])
        self.assertAlmostEqual(float(LUMINANCE @ channel_means(permuted)), 1, delta=5e-3)
        ratio = np.expm1(permuted[SLICES["sky"]][0, 0, 0]) / np.expm1(f[SLICES["sky"]][2, 0, 0])
        np.testing.assert_allclose(target, t[[2, 0, 1]] * ratio, rtol=1e-2)
        # Negative control: in this coloured light the exposure does change.
        self.assertGreater(abs(ratio - 1), 0.01)
        # A window has the exposure of its picture, even one without any light.
        dark = f.copy()
        for name in ("direct", "outgoing", "sky"):
            dark[SLICES[name]][..., W // 2:] = 0
        whole, target = augment.permute_colours(dark, t, [2, 0, 1])
        part, some = augment.permute_colours(dark[..., W // 2:], t[..., W // 2:], [2, 0, 1], channel_means(dark))
        np.testing.assert_array_equal(part, whole[..., W // 2:])
        np.testing.assert_array_equal(some, target[..., W // 2:])

    def test_loss_has_its_minimum_at_the_mean(self):
        rng = np.random.default_rng(0)
        target = torch.from_numpy(rng.gamma(1.0, 1.0, (1, 3, 64, 64)))
        mask = torch.ones(1, 64, 64, dtype=torch.bool)
        for factor, sign in ((0.8, -1), (1.25, 1)):
            p = (target.mean() * factor).clone().requires_grad_()
            losses.relative_square(p.expand_as(target), target, mask, 0.05).backward()
            self.assertEqual(np.sign(p.grad.item()), sign)
        # Cells that are left out do not count.
        mask[:, :32] = False
        target[:, :, :32] = 1e6
        p = torch.ones_like(target)
        self.assertLess(losses.relative_square(p, target, mask, 0.05).item(), 100)

    def test_size(self):
        network = model.compact_unet()
        self.assertEqual(model.parameter_count(network), 106518)
        self.assertAlmostEqual(model.flops(network, 128, 256) / 1e9, 0.98, delta=0.01)
        for h, w in ((1, 1), (5, 3), (17, 13)):
            y = network(torch.randn(2, CHANNELS, h, w))
            self.assertEqual(tuple(y.shape), (2, 6, h, w))
            self.assertEqual(y.abs().max().item(), 0)
            # Untrained, the light is the first guess.
            features = torch.rand(2, CHANNELS, h, w)
            guess = torch.expm1(features[:, SLICES["guess"]])
            torch.testing.assert_close(model.light(y, features), guess, rtol=0, atol=0)
            self.assertFalse(torch.equal(model.light(y + 0.01, features), guess))

    def test_baseline(self):
        rows, _ = baseline.fit(data.Split(self.train), data.Split(self.validation))
        self.assertEqual(len(rows), 12)
        by = {(r["unit"], r["colour"], r["fit"]): r for r in rows}
        # Each fit is best at what it minimises.
        self.assertLessEqual(by["E/pi", "rgb", "least absolute"]["train_error"], by["E/pi", "rgb", "least squares"]["train_error"] + 1e-6)
        self.assertLessEqual(by["E/pi", "rgb", "least absolute of the picture"]["train_picture"], by["E/pi", "rgb", "least absolute"]["train_picture"] + 1e-6)
        self.assertLess(by["E/pi", "rgb", "least absolute"]["train_error"], by["E/pi", "grey", "least absolute"]["train_error"])


if __name__ == "__main__":
    unittest.main()
