"""Peers from made-up records: what is drawn, what is left out, equal times, and that a killed run keeps what it has."""
import contextlib
import io
import json
import math
import os
import shutil
import sys
import tempfile
import unittest
import unittest.mock

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, ".."))
import chart  # noqa: E402
from peers import record  # noqa: E402

RESULTS = os.path.join(HERE, "..", "..", "docs", "results")
TIMES = {"frame_s": 0.6, "frame_cpu_s": 1.0, "path_s": 0.3, "path_cpu_s": 0.5}


def made_up(scenes=("hall", "yard")):
    """Denoised paths whose error halves with four times as many, a peer in all scenes and one in the first alone."""
    rows = []
    for scene in scenes:
        rows += [{"scene": scene, "row": f"{n} paths + OIDN", "paths": n, "denoise_s": 0.2, "denoise_cpu_s": 0.0, "light": 0.2 / math.sqrt(n), "flip": 0.1, "psnr": 30 + n} for n in (1, 2, 4, 8)]
        rows += [{"scene": scene, "row": row, "light": 0.05, "flip": 0.02, "psnr": 35.0} for row in ("gather, TAA", "gather, first frame")]
        rows.append({"scene": scene, "row": "Everywhere", "light": 0.3, "flip": 0.2, "psnr": 20.0, "wall_s": 9.0, "cpu_s": 4.0})
    rows.append({"scene": scenes[0], "row": "Once only", "light": 0.3, "flip": 0.2, "psnr": 20.0, "wall_s": 9.0, "cpu_s": 4.0})
    return {"rows": rows, "times": {scene: TIMES for scene in scenes}, "stability": {}}


class Peers(unittest.TestCase):
    def test_the_chart_draws_what_was_judged_in_every_scene(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("chart.json", "chart.csv"):
                shutil.copy(os.path.join(RESULTS, name), folder)
            path = os.path.join(folder, "peers.json")
            with open(path, "w") as file:
                json.dump(made_up(), file)
            drawn = []
            for words in ([], ["--peers", path]):
                with unittest.mock.patch.object(sys, "argv", ["chart.py", folder, *words]):
                    chart.main()
                with open(os.path.join(folder, "chart.svg"), encoding="utf-8") as file:
                    drawn.append(file.read())
            with unittest.mock.patch.object(sys, "argv", ["chart.py", folder, "--metric", "l1", "--peers", path]), contextlib.redirect_stderr(io.StringIO()) as said:
                self.assertRaises(SystemExit, chart.main)
        self.assertIn("L1", said.getvalue())
        # Without the option nothing of it is there; with it, not what lacks a scene.
        for word in ("Everywhere", "8 paths + OIDN", "of 2 scenes"):
            self.assertNotIn(word, drawn[0])
            self.assertIn(word, drawn[1])
        self.assertNotIn("Once only", drawn[1])

    def test_marks_take_processor_time_over_cores(self):
        peers, curve = record.marks(made_up(), "light")
        self.assertEqual(peers, [("Everywhere", 2.0, 0.3)])
        self.assertEqual([(name, time) for name, time, _ in curve][:2], [("1 paths + OIDN", 0.25), ("2 paths + OIDN", 0.5)])

    def test_equal_time(self):
        rest = next(record.equal_time(made_up()))
        # A frame takes as long as two paths; 32 as 64, more than were drawn: the most that were.
        self.assertAlmostEqual(rest["rest"][0], 0.2 / math.sqrt(2))
        self.assertEqual(rest["rest"][1], 2)
        self.assertEqual(rest["cut"], (0.2 / math.sqrt(8), 64))
        # A frame that is quicker than a path leaves no picture to compare with.
        quick = made_up()
        quick["times"]["hall"] = TIMES | {"frame_cpu_s": 0.2}
        self.assertIsNone(next(record.equal_time(quick))["rest"][0])

    def test_tables_and_going_on(self):
        with tempfile.TemporaryDirectory() as folder:
            first = record.Record(folder, "/bin/true")
            for row in made_up()["rows"]:
                first.put(row)
            first.put_times("hall", TIMES)
            first.write()
            again = record.Record(folder, "/bin/true")
            again.put({"scene": "hall", "row": "Everywhere", "light": 0.1, "flip": 0.2, "psnr": 20.0, "wall_s": 9.0})
            again.write()
            with open(os.path.join(folder, "peers.md")) as file:
                text = file.read()
            self.assertEqual(len(again.all["rows"]), len(made_up()["rows"]))
        self.assertIn("| Everywhere | 10.0 | 30.0 | 20.0 |", text)
        # No mean over fewer scenes than the others have.
        self.assertIn("| Once only | 30.0 | – | – |", text)


if __name__ == "__main__":
    unittest.main()
