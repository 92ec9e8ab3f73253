"""Error against cost, with the Pareto frontier: a chart of what training/judge.py measured.

    python training/judge.py out/judge data/judge --csv out/judge.csv
    bouncelight bench paper-room:0 --method all --json out/bench.json
    python training/chart.py out/judge.csv out/error_over_cost --bench out/bench.json [--weights "apply paper"=assets/weights/paper.safetensors] [--group room]

Writes out/error_over_cost.png and .svg. Across: arithmetic that finds and adds indirect light for one picture, GFLOP, as bounce-
light counts it (docs/performance.md); up: the paper's L1, mean over the rows whose scene begins with --group. A record of the
bench names methods; FILE=ROW says which row of the CSV its method `neural` is. The paper's own network stands where its
authors' table and its layers put it. The frontier joins the rows that nothing beats in both.
"""
import argparse
import csv
import json

import matplotlib

from table import of_weights

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.transforms import Bbox  # noqa: E402

PAPER = ("the paper's network\n(its own pictures)", 104.0, 45178.0)
NAMES = {"apply paper": "the paper's recipe, our small run"}
NOT_SHOWN = {"constant", "best constant"}


def errors(path, group, metric):
    """Mean of a metric for each row of the CSV."""
    rows = {}
    with open(path, newline="") as file:
        for line in csv.DictReader(file):
            if line["scene"].startswith(group) and line["row"] not in NOT_SHOWN:
                rows.setdefault(line["row"], []).append(float(line[metric]))
    if not rows:
        raise SystemExit(f"error: {path}: no scene begins with `{group}`")
    return {row: sum(values) / len(values) for row, values in rows.items()}


def costs(records):
    """GFLOP of each row from bench records."""
    found = {"direct": 0.0}
    for record in records:
        path, _, name = record.partition("=")
        with open(path) as file:
            for m in json.load(file)["methods"]:
                if m["costs"]:
                    found[name if name and m["method"] == "neural" else m["method"]] = sum(c["flops"] for c in m["costs"]) / 1e9
    return found


def frontier(points):
    """Those that no other point beats in both cost and error, cheapest first."""
    best, out = float("inf"), []
    for point in sorted(points, key=lambda p: (p[1], p[2])):
        if point[2] < best:
            best = point[2]
            out.append(point)
    return out


def label(axes, points):
    """Each point's name (of networks, the size) beside it, at the first of seven places where it covers no point and no other name."""
    figure = axes.get_figure()
    figure.canvas.draw()
    places = [(5, 4, "left"), (5, -11, "left"), (8, -3, "left"), (-5, 4, "right"), (-5, -11, "right"), (0, 8, "center"), (0, -16, "center")]
    dots = [axes.transData.transform(point[1:]) for point in points]
    taken = [Bbox.from_bounds(x - 3, y - 3, 6, 6) for x, y in dots]
    for name, x, y in sorted(points, key=lambda point: -point[1]):
        for dx, dy, side in places:
            text = axes.annotate(NAMES.get(name, name.removeprefix("neural ")), (x, y), xytext=(dx, dy), textcoords="offset points", fontsize=8, ha=side)
            box = text.get_window_extent(figure.canvas.get_renderer()).padded(3)
            if not any(box.overlaps(other) for other in taken) or (dx, dy, side) == places[-1]:
                taken.append(box)
                break
            text.remove()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("csv")
    parser.add_argument("out", help="without the ending")
    parser.add_argument("--bench", action="append", required=True, metavar="FILE[=ROW]")
    parser.add_argument("--weights", action="append", default=[], metavar="ROW=FILE", help="a network on pictures, which has no record: the arithmetic of its layers")
    parser.add_argument("--bouncelight", default="target/release/bouncelight")
    parser.add_argument("--group", default="room")
    parser.add_argument("--metric", default="l1")
    a = parser.parse_args()
    error, cost = errors(a.csv, a.group, a.metric), costs(a.bench)
    cost |= {row: of_weights(a.bouncelight, path)["gflop"] for row, _, path in (entry.partition("=") for entry in a.weights)}
    ours = [(row, cost[row], error[row]) for row in error if row in cost]
    for row in sorted(set(error) - set(cost)):
        print(f"{row}: no bench record, left out")
    points = ours + ([PAPER] if a.metric == "l1" else [])
    best = frontier(points)
    figure, axes = plt.subplots(figsize=(8, 5), constrained_layout=True)
    axes.plot([p[1] for p in best], [p[2] for p in best], color="0.7", drawstyle="steps-post", zorder=1, label="nothing is cheaper and better")
    for name, x, y in points:
        axes.scatter(x, y, color="C3" if name == PAPER[0] else "C0" if (name, x, y) in best else "0.5", zorder=2)
    axes.set_xscale("symlog", linthresh=0.1)
    axes.set(yscale="log", xlabel="arithmetic for one picture of 1024×512, GFLOP (counted)", ylabel={"l1": "the paper's L1"}.get(a.metric, a.metric), xlim=(0, 1000))
    axes.grid(alpha=0.3, which="both")
    axes.legend(fontsize=8)
    label(axes, points)
    for ending in ("png", "svg"):
        figure.savefig(f"{a.out}.{ending}", dpi=120)
    print("frontier: " + ", ".join(p[0].replace("\n", " ") for p in best))


if __name__ == "__main__":
    main()
