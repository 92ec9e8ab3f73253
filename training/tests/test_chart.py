"""The chart of the record in docs/results, and what must not be on it."""
import os
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, ".."))
import chart  # noqa: E402

RESULTS = os.path.join(HERE, "..", "..", "docs", "results")


class Chart(unittest.TestCase):
    def test_what_was_judged_in_every_scene_is_drawn(self):
        with tempfile.TemporaryDirectory() as folder:
            for name in ("chart.json", "chart.csv"):
                shutil.copy(os.path.join(RESULTS, name), folder)
            drawn = {}
            for metric in ("light", "flip"):
                subprocess.run([sys.executable, chart.__file__, folder, "--metric", metric], check=True)
                with open(os.path.join(folder, "chart.svg"), encoding="utf-8") as file:
                    drawn[metric] = file.read()
        for svg in drawn.values():
            for word in ("MODELLED, NOT MEASURED", "a CPU driver, no GPU", "gather", "16 paths", "bouncelight chart"):
                self.assertIn(word, svg)
        # A network on pictures has no light of its own.
        self.assertNotIn("paper on pictures", drawn["light"])
        self.assertIn("paper on pictures", drawn["flip"])

    def test_the_frontier_is_what_nothing_beats(self):
        points = [(1.0, 9.0), (2.0, 9.5), (3.0, 4.0), (3.0, 5.0), (9.0, 4.0), (8.0, 1.0)]
        self.assertEqual(chart.frontier(points), [(1.0, 9.0), (3.0, 4.0), (8.0, 1.0)])
        self.assertEqual(chart.frontier([]), [])


if __name__ == "__main__":
    unittest.main()
