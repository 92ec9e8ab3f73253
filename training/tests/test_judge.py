"""The judging command with a stand-in for the program: any list of rooms, kept pictures, what is drawn again."""
import json
import os
import stat
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import OpenEXR

HERE = os.path.dirname(os.path.abspath(__file__))
JUDGE = os.path.join(HERE, "..", "judge.py")
H, W = 8, 16

# `render` and `compare` of the program, which write down that they were called.
PROGRAM = """#!{python}
import json, sys
sys.path[:0] = {path!r}
import test_judge
words = dict(zip(sys.argv[3::2], sys.argv[4::2]))
with open({log!r}, "a") as file:
    file.write(" ".join(sys.argv[1:3]) + " " + words.get("--size", "") + "\\n")
if sys.argv[1] == "render":
    test_judge.picture(words["-o"], 0.5 if words["--method"] == "direct" else 0.75, "")
else:
    words = dict(zip(sys.argv[4::2], sys.argv[5::2]))
    values = {{"paper": dict.fromkeys(["l1", "l2", "ssim", "fid"], 1.0), "display": {{"psnr": 30.0, "ssim": 1.0}}, "flip": 0.1, "linear": {{"rel_mse": 0.5}}}}
    json.dump(values, open(words["--json"], "w"))
"""


def picture(path, light, prefix="ViewLayer.", combined=""):
    """A grey wall, lit evenly, with the layers that are judged."""
    names = {f"{combined}{c}": light for c in "RGB"} | {f"{layer}.{c}": v for c in "RGB" for layer, v in (("DiffCol", 0.5), ("GlossCol", 0.04), ("DiffDir", 0.5), ("DiffInd", light - 0.5))}
    channels = {f"{prefix}{name}": np.full((H, W), value, np.float32) for name, value in (names | {"Depth.Z": 5.0}).items()}
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}, channels).write(path)


class Judge(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = scratch.name
        self.program, self.log, self.references, self.out = (os.path.join(self.folder, n) for n in ("program", "log", "references", "out"))
        os.makedirs(self.references)
        for room in (0, 2200, 2239):
            picture(os.path.join(self.references, f"room{room:04}_view0.exr"), 1.0, combined="Combined.")
        self.write_program("")

    def write_program(self, more):
        with open(self.program, "w") as file:
            file.write(PROGRAM.format(python=sys.executable, path=[HERE], log=self.log) + more)
        os.chmod(self.program, stat.S_IRWXU)

    def judge(self, *words, code=0):
        """The command's output, and what the program was asked for by it."""
        if os.path.exists(self.log):
            os.remove(self.log)
        done = subprocess.run([sys.executable, JUDGE, self.out, self.references, "--methods", "direct,gather", "--bouncelight", self.program, *words], capture_output=True, text=True)
        self.assertEqual(done.returncode, code, done.stderr)
        if not os.path.exists(self.log):
            return done.stdout + done.stderr, []
        with open(self.log) as file:
            return done.stdout + done.stderr, file.read().splitlines()

    def test_any_rooms_and_goes_on(self):
        text, asked = self.judge("--rooms", "2200-2239", code=1)
        self.assertIn("--rooms 2201,2202,", text)
        self.assertEqual(asked, [])
        text, asked = self.judge("--rooms", "2200,2239")
        self.assertIn("| paper rooms (2) |", text)
        # Half of the light that direct lighting misses: gather has an error of a half.
        self.assertRegex(text, r"\| gather \| .*\| 50.0 % \|")
        self.assertEqual(sorted(a for a in asked if a.startswith("render")), [f"render paper-room:{room} {W}x{H}" for room in (2200, 2239) for _ in range(2)])
        # Everything is kept; what a kill left out or cut off is made.
        self.assertEqual(self.judge("--rooms", "2200,2239")[1], [])
        os.remove(os.path.join(self.out, "room2239_view0_gather.exr"))
        with open(os.path.join(self.out, "room2200_view0_gather.exr.json"), "w") as file:
            file.write('{"paper": ')
        asked = self.judge("--rooms", "2200,2239")[1]
        self.assertEqual(len([a for a in asked if a.startswith("render")]), 1)
        self.assertEqual(len([a for a in asked if a.startswith("compare")]), 2)
        # Without --rooms all references are taken; another program draws everything anew, unless told to keep.
        self.assertIn("| paper rooms (3) |", self.judge()[0])
        self.write_program("# newer\n")
        self.assertEqual(self.judge("--keep")[1], [])
        self.assertEqual(len([a for a in self.judge()[1] if a.startswith("render")]), 6)
        with open(os.path.join(self.out, "stamps.json")) as file:
            self.assertEqual(len(json.load(file)), 9)


if __name__ == "__main__":
    unittest.main()
