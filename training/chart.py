"""Draws what `bouncelight chart` measured: error up, time across, once as measured and once as modelled for a GTX 1050.

    python training/chart.py docs/results [--metric light|flip|l1] [--peers peers.json]

FOLDER holds chart.json and chart.csv; chart.svg goes beside them. Full marks are settled pictures, hollow ones the first frame
after a cut, bars the best and the worst scene; grey steps join what nothing beats in both, the dashed line is of paths. Marks differ
in shape as well as in colour (Okabe and Ito's palette), and their names stand beside them. --peers adds what `python -m peers` measured, over its
own scenes: stars, and the dotted curve of denoised paths that is to be beaten. Needs matplotlib.
"""
import argparse
import csv
import json
import os
import sys

import matplotlib

matplotlib.use("Agg")
# Words stay words, and the same record gives the same file.
matplotlib.rcParams.update({"svg.fonttype": "none", "svg.hashsalt": "bouncelight", "font.size": 9})
import matplotlib.pyplot as plt  # noqa: E402
from matplotlib.ticker import LogLocator  # noqa: E402

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from peers.record import marks  # noqa: E402

TITLES = {"light": "error of the light that is added, %", "flip": "FLIP", "l1": "the paper's L1 (sum, for 1024×512 pixels)"}
COLUMNS = {"light": "light", "flip": "flip", "l1": "l1_per_1024x512"}
COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"]
MARKS = "os^Dv"


def mean(values):
    return sum(values) / len(values) if values else None


def numbers(rows, column, scale=1.0):
    return [scale * float(row[column]) for row in rows if row[column]]


def entries(folder, metric):
    """The record, the clock that counts, and what every scene knows of each entry: its kind, errors and times."""
    with open(os.path.join(folder, "chart.json"), encoding="utf-8") as file:
        record = json.load(file)
    with open(os.path.join(folder, "chart.csv"), encoding="utf-8", newline="") as file:
        lines = [line for line in csv.DictReader(file) if not line["failed"]]
    scenes = sum(not scene.get("failed") for scene in record["scenes"])
    drawn = [line for line in lines if line["kind"] == "method" and line["state"] == "settled"]
    agree = all(line["gpu_ms_median"] and abs(float(line["gpu_ms_median"]) / float(line["wall_ms_median"]) - 1) <= 0.1 for line in drawn)
    clock, found, scale = "gpu_ms_median" if agree else "wall_ms_median", [], 100.0 if metric == "light" else 1.0
    for entry in record["entries"]:
        states = {state: [li for li in lines if li["entry"] == entry["name"] and li["state"] == state] for state in ("settled", "cold")}
        error = numbers(states["settled"], COLUMNS[metric], scale)
        if len(error) == scenes:
            found.append({"name": entry["name"], "kind": entry["kind"], "paths": entry["paths"], "error": error,
                          "cold": mean(numbers(states["cold"], COLUMNS[metric], scale)), "ms": mean(numbers(states["settled"], clock)),
                          "cold_ms": mean(numbers(states["cold"], clock)), "projected": mean(numbers(states["settled"], "projected_gtx1050_ms"))})
    return record, clock, found


def frontier(points):
    """Those of (time, error) that none beats in both, quickest first."""
    best = []
    for point in sorted(points):
        if not best or point[1] < best[-1][1]:
            best.append(point)
    return best


def panel(axes, found, time, cold_time):
    drawn = [e for e in found if e["kind"] != "paths" and e[time] is not None]
    positive = [e[time] for e in drawn if e[time] > 0]
    # What takes no time stands at the axis, where a logarithm has no place for it.
    nothing = min(positive, default=1.0) / 2
    best = frontier([(max(e[time], nothing), mean(e["error"])) for e in drawn])
    axes.step([x for x, _ in best], [y for _, y in best], where="post", color="0.75", linewidth=3, zorder=1)
    for i, e in enumerate(drawn):
        x, y, style = max(e[time], nothing), mean(e["error"]), {"color": COLOURS[i % len(COLOURS)], "marker": MARKS[i % len(MARKS)]}
        axes.errorbar(x, y, [[y - min(e["error"])], [max(e["error"]) - y]], capsize=3, linewidth=1, **style)
        if e["cold"] is not None and e[cold_time] is not None:
            axes.plot([x, e[cold_time]], [y, e["cold"]], markevery=[1], markerfacecolor="white", linewidth=1.5, **style)
        axes.annotate(e["name"] + (" (0 ms)" if e[time] == 0 else ""), (x, y), (8, -14 if i % 2 else 6), textcoords="offset points")
    axes.set(xscale="log", yscale="log")
    axes.margins(x=0.15)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        axis.set_major_formatter(lambda value, _: f"{value:g}")
        axis.set_minor_formatter("")
    axes.grid(color="0.9")


def draw_peers(axes, path, metric):
    """Peers as stars and denoised paths as a dotted curve; how many scenes they were judged on."""
    with open(path, encoding="utf-8") as file:
        record = json.load(file)
    peers, curve = marks(record, metric)
    scale = 100 if metric == "light" else 1
    axes.plot([1e3 * time for _, time, _ in curve], [scale * error for *_, error in curve], ":", marker="P", color="#7f3c8d", markersize=6, linewidth=1.5)
    for name, time, error in [*peers, *curve]:
        if (name, time, error) in peers:
            axes.plot(1e3 * time, scale * error, "*", color="#7f3c8d", markersize=11)
        axes.annotate(name, (1e3 * time, scale * error), (7, 5), textcoords="offset points", fontsize=8, color="#7f3c8d")
    return len(record["times"])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--metric", choices=TITLES, default="light")
    parser.add_argument("--peers", help="peers.json of `python -m peers`, to be drawn with it")
    a = parser.parse_args()
    if a.peers and a.metric == "l1":
        parser.error("--peers: peers are not judged by the paper's L1")
    record, clock, found = entries(a.folder, a.metric)
    device, made = record["device"], record["provenance"]
    figure, (here, there) = plt.subplots(1, 2, figsize=(12.8, 6.2), sharey=True, width_ratios=[3, 2], layout="constrained")
    panel(here, found, "ms", "cold_ms")
    paths = [e for e in found if e["kind"] == "paths"]
    here.plot([e["ms"] for e in paths], [mean(e["error"]) for e in paths], "k--o", markersize=3, linewidth=1)
    for e in paths:
        here.annotate(e["name"], (e["ms"], mean(e["error"])), (5, 3), textcoords="offset points", fontsize=8)
    beside = f"\npeers (stars, dotted) of {draw_peers(here, a.peers, a.metric)} scenes" if a.peers else ""
    here.set_title(f"Measured: {device['adapter']}{' (a CPU driver, no GPU)' if device['software'] else ''}{beside}", loc="left")
    here.set(xlabel=f"time of a whole frame, ms ({'timestamps' if clock.startswith('gpu') else 'synchronised clock'})", ylabel=TITLES[a.metric])
    panel(there, found, "projected", "projected")
    there.set_title("MODELLED, NOT MEASURED: GTX 1050", loc="left", fontsize=9)
    there.set(xlabel="light's own passes by count, ms (without the rasteriser)")
    scenes = [s["name"] for s in record["scenes"] if not s.get("failed")]
    w, h = record["size"]
    figure.suptitle(f"Error against time at {w}×{h}, mean of {len(scenes)} scenes: {', '.join(scenes)}", fontsize=9)
    figure.supxlabel(f"bouncelight {made['version']} · commit {made['commit']} · {made['date']} · {device['driver']}", fontsize=8, color="0.4")
    figure.savefig(os.path.join(a.folder, "chart.svg"), metadata={"Date": made["date"], "Description": made["command"]})


if __name__ == "__main__":
    main()
