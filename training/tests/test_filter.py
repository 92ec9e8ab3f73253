"""The filter that a network guides: torch against the shaders, in samples that the program draws (BOUNCELIGHT=FILE); a few steps of
training; what is refused."""
import glob
import json
import os
import subprocess
import sys
import tempfile
import types
import unittest

import numpy as np
import torch

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from bouncelight_training.errors import TrainingError  # noqa: E402
from bouncelight_training.filter import blur, export, samples, train  # noqa: E402

SHIPPED = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "assets", "weights", "filter.safetensors")
PROGRAM = os.environ.get("BOUNCELIGHT")
SIZE = ["--size", "96x64", "--spp", "4", "-q"]


def draw(folder, rooms, *more, moments="1,8,pan"):
    """Samples of homes, in a folder. 96x64 pixels: 24x16 cells."""
    run = subprocess.run([PROGRAM, "dataset", "--recipe", "home", "--rooms", rooms, "--views", "1", "--out", folder, "--moments", moments, *SIZE, *more], capture_output=True, text=True)
    assert run.returncode == 0, run.stderr


def moments_of(folder):
    """Every moment of one view, also where a lamp changes light in so many cells that `samples.read` leaves the moment out."""
    (path,) = glob.glob(os.path.join(folder, "*.safetensors"))
    return samples.all_of(path)


def off(sample, answer):
    """How far torch's light is from the program's, over the mean light."""
    batch = samples.stacked([sample])
    (shown, _), theirs, mask = blur.filtered(batch, answer), batch["shown"], batch["mask"]
    return (((shown - theirs).abs() * mask).sum() / (theirs * mask).sum()).item()


@unittest.skipUnless(PROGRAM, "SKIP: BOUNCELIGHT does not name the program")
class WithTheProgram(unittest.TestCase):
    def test_torch_filters_as_the_shaders_do(self):
        with tempfile.TemporaryDirectory() as folder:
            draw(os.path.join(folder, "a"), "1", moments="1,8,pan,lamp,thing")
            views = moments_of(os.path.join(folder, "a"))
            self.assertEqual(sorted(v.when for v in views), ["1", "8", "lamp", "pan", "thing"])
            for view in views:
                self.assertGreater(view.mask.sum(), 20, view.when)
                # Where surfaces are curved the shaders average light with its direction, torch without: a thousandth.
                near, control = off(view, None), off(view, torch.randn(1, blur.GUIDANCE, *view.mask.shape, generator=torch.Generator().manual_seed(1)))
                self.assertLess(near, 2e-3, view.when)
                self.assertGreater(control, 10 * near, view.when)
            # A network of random numbers: the program runs it, torch runs it, and they show the same light.
            config = train.Config(train="a", validation="b", widths=(4, 8))
            run = train.Run(config, folder)
            torch.nn.init.normal_(run.model.get_submodule("head").weight, std=0.5)
            run.average = {k: v.detach().half().float() for k, v in run.model.state_dict().items()}
            run.best, run.rows = (1.0, run.average), [{"validation_error": 1.0, "gather_error": 1.0}]
            run.save()
            file = os.path.join(folder, "random.safetensors")
            export.export(folder, file)
            model = run.averaged()
            draw(os.path.join(folder, "b"), "1", "--weights", file)
            for view in moments_of(os.path.join(folder, "b")):
                with torch.no_grad():
                    answer = model(samples.stacked([view])["features"])
                near, control = off(view, answer), off(view, None)
                self.assertLess(near, 2e-3, view.when)
                self.assertGreater(control, 5 * near, view.when)

    def test_a_few_steps_of_training_and_an_export(self):
        with tempfile.TemporaryDirectory() as folder:
            for name, rooms in (("a", "1-2"), ("b", "3")):
                draw(os.path.join(folder, name), rooms)
            paths = ["--train", os.path.join(folder, "a"), "--validation", os.path.join(folder, "b"), "--run", os.path.join(folder, "run")]
            train.main([*paths, "--minutes", "0.05", "--widths", "4,8"])
            summary = export.export(os.path.join(folder, "run"), os.path.join(folder, "toy.safetensors"))
            self.assertLessEqual(summary["value"], summary["gather"])
            info = subprocess.run([PROGRAM, "weights", "verify", summary["file"]], capture_output=True, text=True)
            self.assertEqual(info.returncode, 0, info.stderr)
            with open(os.path.join(folder, "toy.json")) as file:
                self.assertIn("filter.train", json.load(file)["command"])
            with self.assertRaisesRegex(TrainingError, "training and validation"):
                train.train(train.Config(train=os.path.join(folder, "a"), validation=os.path.join(folder, "a")), os.path.join(folder, "other"))


class Alone(unittest.TestCase):
    def test_what_cannot_be_begun_with_is_named(self):
        other = os.path.join(os.path.dirname(SHIPPED), "..", "..", "weights-format", "fixtures", "add.safetensors")
        with self.assertRaisesRegex(TrainingError, "cannot begin with it"):
            train.network_of("none.safetensors")
        with self.assertRaisesRegex(TrainingError, "does not filter"):
            train.network(train.Config(begin=other))

    def test_a_mirror_image_turns_what_points_sideways(self):
        flat = np.ones((3, 24, 24), np.float32)
        pile, = self.made_up([("a", "4", 4, flat, flat)])
        names = [name for name, n in samples.TABLE for _ in range(n)]
        seen = set()
        for seed in range(8):
            batch = pile.taken([0])
            turned = train.augmented(batch, np.random.default_rng(seed))
            for name in ("normal", "dominant_direction"):
                x = names.index(name)
                mirrored = torch.equal(turned["features"][:, x], -batch["features"][:, x].flip(-1))
                self.assertTrue(mirrored or torch.equal(turned["features"][:, x], batch["features"][:, x]))
                self.assertEqual(torch.equal(turned["features"][:, x + 1], batch["features"][:, x + 1].flip(-1)), mirrored)
                seen.add(mirrored)
        self.assertEqual(seen, {True, False})

    def test_another_network_teaches(self):
        noisy = np.random.default_rng(1).gamma(2, 0.5, (3, 24, 24)).astype(np.float32)

        def slope(**teacher):
            piles = self.made_up([("a", "4", 4, noisy, np.ones_like(noisy))])
            config = train.Config(widths=(4, 8), batch=2, learning_rate=0.0, **teacher)
            train.taught(piles, config)
            train.based(piles, train.POOLS)
            run = train.Run(config, "")
            run.train_step(piles, 0.0)
            return torch.cat([p.grad.flatten() for p in run.model.parameters()])

        alone, taught = slope(), slope(teacher=SHIPPED, taught=1.0)
        self.assertGreater((alone - taught).abs().max(), 1e-4)
        # Negative control: one that counts for nothing.
        self.assertTrue(torch.equal(slope(teacher=SHIPPED, taught=0.0), alone))

    def made_up(self, moments):
        """Samples of a plane, 24x24 cells: (name, when, age, light [3,h,w] and target)."""
        h = w = 24
        ones = np.ones((h, w), np.float32)
        x = np.stack([np.tile(np.arange(w), (h, 1)), np.tile(np.arange(h)[:, None], (1, w)), np.zeros((h, w))]).astype(np.float32)
        made = []
        for name, when, age, light, target in moments:
            features = np.random.default_rng(1).normal(size=(samples.CHANNELS, h, w)).astype(np.float32)
            made.append(types.SimpleNamespace(
                name=name, when=when, age=float(age), features=features, light=light, square=2 * light[0] ** 2, x=x, n=np.stack([0 * ones, 0 * ones, ones]),
                frames=age * ones, strictness=ones, nearness=0 * ones, shown=light, target=target, mask=ones > 0, mean=float(light.mean()), noise=0.1, base=0.0))
        return samples.piles(made)

    def test_the_next_frame_of_a_moment_is_found(self):
        flat = np.ones((3, 24, 24), np.float32)
        kinds = [("a", "4", 4), ("a", "5", 5), ("b", "5", 5), ("a", "pan", 3), ("b", "1", 1), ("c", "2", 2)]
        pile, = self.made_up([(*kind, flat, flat) for kind in kinds])
        self.assertEqual(pile.later.tolist(), [1, -1, -1, -1, -1, -1])

    def test_what_changes_from_frame_to_frame_counts(self):
        flat = np.ones((3, 24, 24), np.float32)
        noisy = [(flat * np.random.default_rng(seed).gamma(2, 0.5, (1, 24, 24))).astype(np.float32) for seed in (1, 2)]
        still, = self.made_up([("a", "4", 4, noisy[0], flat), ("a", "5", 5, noisy[0], flat)])
        restless, = self.made_up([("a", "4", 4, noisy[0], flat), ("a", "5", 5, noisy[1], flat)])
        model = train.network(train.Config(widths=(4, 8)))
        one = lambda pile: train.changes(model, [pile])["change gather"]
        # The frame before counts for less than the one after, whose age is greater: nothing else differs.
        self.assertLess(one(still), 0.01)
        self.assertGreater(one(restless), 0.05)
        for pile in (still, restless):
            train.based([pile], train.POOLS)
        self.assertGreater(restless.fields["change"][0], 30 * still.fields["change"][0])
        self.assertEqual(restless.fields["change"][1], 0)

        # A step towards a network that flickers less: the term is what turns it that way.
        def slope(flicker):
            run = train.Run(train.Config(widths=(4, 8), batch=4, crop=0, flicker=flicker, learning_rate=0.0), "")
            run.train_step([restless], 0.0)
            return torch.cat([p.grad.flatten() for p in run.model.parameters()])

        self.assertGreater((slope(10.0) - slope(0.0)).abs().max(), 1e-3)
        quiet = self.made_up([("a", "4", 4, noisy[0], flat), ("b", "5", 5, noisy[1], flat)])
        self.assertEqual(train.changes(model, quiet), {})

    def test_a_step_without_a_gradient_teaches_nothing_and_many_end_the_run(self):
        flat = np.ones((3, 24, 24), np.float32)
        broken = self.made_up([("a", "4", 4, flat, np.nan * flat)])
        train.based(broken, train.POOLS)
        run = train.Run(train.Config(widths=(4, 8), batch=2), "")
        before = [p.detach().clone() for p in run.model.parameters()]
        loss, _ = run.train_step(broken, 0.0)
        self.assertIsNone(loss)
        self.assertTrue(all(torch.equal(a, b) for a, b in zip(before, run.model.parameters())))
        with self.assertRaisesRegex(TrainingError, "not a number, 2 times"):
            run.train_step(broken, 0.0)
        # What has one does teach.
        good = self.made_up([("a", "4", 4, flat * np.random.default_rng(1).gamma(2, 0.5, (1, 24, 24)).astype(np.float32), flat)])
        train.based(good, train.POOLS)
        run = train.Run(train.Config(widths=(4, 8), batch=2), "")
        self.assertIsNotNone(run.train_step(good, 0.0)[0])
        self.assertFalse(all(torch.equal(a, b) for a, b in zip(before, run.model.parameters())))

    def test_what_is_no_sample_is_named(self):
        with tempfile.TemporaryDirectory() as folder:
            with self.assertRaisesRegex(TrainingError, "no samples"):
                samples.read(folder)
            with open(os.path.join(folder, "a.safetensors"), "wb") as file:
                file.write(b"nothing")
            with self.assertRaisesRegex(TrainingError, "a.safetensors: not a sample"):
                samples.read(folder)

    def test_slopes_are_numbers_in_the_dark(self):
        # Beside one bright cell its neighbours have next to nothing: what one brings over the others' light is beyond numbers.
        h, w = 8, 16
        x = torch.stack([torch.arange(w).float().expand(h, w), torch.arange(h).float().view(-1, 1).expand(h, w), torch.zeros(h, w)])
        light = 10.0 ** (-30 * torch.rand(1, 1, h, w, generator=torch.Generator().manual_seed(1))).expand(1, 3, h, w)
        batch = {"x": x[None], "n": torch.tensor([0.0, 0, 1]).view(1, 3, 1, 1).expand(1, 3, h, w), "light": light, "square": light[:, 0] ** 2,
                 "frames": torch.full((1, h, w), 4.0), "age": torch.tensor([4.0]), "strictness": torch.full((1, h, w), 2.0),
                 "nearness": torch.zeros(1, h, w)}
        answer = (3 * torch.randn(1, blur.GUIDANCE, h, w, generator=torch.Generator().manual_seed(2))).requires_grad_()
        blur.filtered(batch, answer)[0].sum().backward()
        self.assertTrue(torch.isfinite(answer.grad).all())
        self.assertGreater(answer.grad.abs().max().item(), 0)
        # A ratio that is cut after it was taken is not.
        a, b = torch.tensor(1.0), torch.tensor(1e-25, requires_grad=True)
        (a / b).clamp(max=60).backward()
        self.assertFalse(torch.isfinite(b.grad))

    def test_places_apart_keep_light_apart_and_trust_counts(self):
        # A plane, its left half bright and its right half dark.
        h, w = 8, 16
        x = torch.stack([torch.arange(w).float().expand(h, w), torch.arange(h).float().view(-1, 1).expand(h, w), torch.zeros(h, w)])
        light = torch.where(torch.arange(w) < w // 2, 1.0, 0.1).expand(3, h, w)
        batch = {"x": x[None], "n": torch.tensor([0.0, 0, 1]).view(1, 3, 1, 1).expand(1, 3, h, w), "light": light[None], "square": (light[0] ** 2)[None],
                 "frames": torch.full((1, h, w), 4.0), "age": torch.tensor([4.0]), "strictness": torch.full((1, h, w), 2.0),
                 "nearness": torch.zeros(1, h, w)}
        plain, _ = blur.filtered(batch)
        apart = torch.zeros(1, blur.GUIDANCE, h, w)
        apart[:, 0] = apart[:, 4] = torch.where(torch.arange(w) < w // 2, 0.0, 100.0)
        kept, _ = blur.filtered(batch, apart)
        self.assertGreater((plain - light).abs().max().item(), 0.3)
        self.assertLess((kept - light).abs().max().item(), 1e-5)
        # What is trusted more pulls its neighbours' light towards its own.
        trusted = torch.zeros(1, blur.GUIDANCE, h, w)
        trusted[:, 8, :, :w // 2] = 2.0
        pulled, _ = blur.filtered(batch, trusted)
        self.assertGreater(pulled[0, 0, 4, w // 2].item(), plain[0, 0, 4, w // 2].item() + 0.05)


if __name__ == "__main__":
    unittest.main()
