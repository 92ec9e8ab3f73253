"""Two processes do what one with twice the batch does, at toy scale on a CPU."""
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest

import torch

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [os.path.join(HERE, ".."), HERE]
from bouncelight_training import distributed, train  # noqa: E402
from bouncelight_training.errors import TrainingError  # noqa: E402
from test_toy import build, write_views  # noqa: E402

ENVIRONMENT = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": os.pathsep.join([os.path.join(HERE, ".."), os.environ.get("PYTHONPATH", "")])}


def torchrun(*words, processes=2):
    return [sys.executable, "-m", "torch.distributed.run", "--standalone", f"--nproc_per_node={processes}", *words]


def read(path):
    with open(path) as file:
        return file.read()


class Distributed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        torch.set_num_threads(1)
        cls.scratch = tempfile.TemporaryDirectory()
        cls.folder = cls.scratch.name
        write_views(cls.folder, [2, 6, 7, 8])
        cls.data = {"train": build(cls.folder, {6, 7, 8}, "train.npz"), "validation": build(cls.folder, {2}, "val.npz")}

    @classmethod
    def tearDownClass(cls):
        cls.scratch.cleanup()

    def config(self, **more):
        # A clip that never clips: gradients are compared as they are.
        return {**self.data, "batch": 2, "epochs": 4, "warmup_steps": 3, "learning_rate": 5e-3, "ema": 0.9, "clip": 1e9, **more}

    def steps(self, name, steps, **more):
        """What two processes have after so many steps."""
        out = os.path.join(self.folder, f"{name}.pt")
        done = subprocess.run(torchrun(os.path.join(HERE, "one_step.py"), json.dumps(self.config(**more)), os.path.join(self.folder, name), str(steps), out),
                              env=ENVIRONMENT, capture_output=True, text=True, timeout=240)
        self.assertEqual(done.returncode, 0, done.stderr)
        return torch.load(out, weights_only=True)

    def alone(self, name, steps, **more):
        return train.train(train.Config(**self.config(**more)), os.path.join(self.folder, name), stop_after=steps)

    def test_first_gradient_is_that_of_the_whole_batch(self):
        both = self.steps("both", 1)
        whole, half = self.alone("whole", 1, batch=4), self.alone("half", 1, batch=2)
        self.assertEqual(both["samples"], 4)
        for name, p in whole.model.named_parameters():
            scale = p.grad.abs().max().clamp(min=1e-12)
            self.assertLess(((both["gradient"][name] - p.grad).abs().max() / scale).item(), 1e-4, name)
        # Negative control: half of the batch has another gradient.
        bias = dict(half.model.named_parameters())["head.bias"].grad
        self.assertGreater(((both["gradient"]["head.bias"] - bias).abs().max() / bias.abs().max()).item(), 1e-2)

    def test_uneven_last_batch_counts_each_picture_once(self):
        # Six pictures, four a step, so the second step has two: one for each process.
        both, whole = self.steps("uneven", 2), self.alone("uneven-whole", 2, batch=4)
        self.assertEqual((both["samples"], whole.samples()), (6, 6))
        for name, p in whole.model.named_parameters():
            scale = p.grad.abs().max().clamp(min=1e-12)
            self.assertLess(((both["gradient"][name] - p.grad).abs().max() / scale).item(), 2e-2, name)

        # Killed after an epoch and continued by two processes, the bits are those of a run without the kill.
        again, straight, other = self.steps("uneven", 2), self.steps("straight", 4), self.steps("seed", 4, seed=2)
        self.assertTrue(all(torch.equal(again["model"][name], values) for name, values in straight["model"].items()))
        self.assertFalse(torch.equal(other["model"]["head.weight"], straight["model"]["head.weight"]))

    def test_shares(self):
        world = distributed.World("cpu")
        world.size = 3
        for pictures in range(1, 8):
            weights, seen = 0.0, []
            for world.rank in range(3):
                places, weight = world.share(list(range(pictures)))
                weights += weight
                seen += places if weight else []
            self.assertAlmostEqual(weights, 3)
            self.assertEqual(sorted(seen), list(range(pictures)))

    def test_command_stops_and_goes_on(self):
        run = os.path.join(self.folder, "command")
        flags = [f"--{k.replace('_', '-')}={v}" for k, v in self.config(epochs=10_000).items()]
        command = torchrun("-m", "bouncelight_training.train", "--folder", run, *flags)
        said, text = os.path.join(self.folder, "said.txt"), ""
        with open(said, "w") as file:
            process = subprocess.Popen(command, env=ENVIRONMENT, stderr=file, cwd=self.folder)
        end = time.monotonic() + 240
        while "epoch" not in text and process.poll() is None and time.monotonic() < end:
            time.sleep(0.5)
            text = read(said)
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=120)
        self.assertIn("stopped; the same command continues", read(said))
        state = train.read_checkpoint(os.path.join(run, "checkpoint.pt"))
        self.assertEqual(state["processes"], 2)
        self.assertTrue(state["command"].startswith("torchrun --standalone --nproc_per_node=2 -m bouncelight_training.train"), state["command"])
        with self.assertRaisesRegex(TrainingError, "made by 2 processes, now there are 1"):
            self.alone("command", 1, epochs=10_000)


if __name__ == "__main__":
    unittest.main()
