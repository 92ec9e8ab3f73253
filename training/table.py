"""The table of docs/accuracy.md: errors, costs and sizes of every row in one place.

    python training/judge.py out/judge data/judge --csv out/judge.csv …
    bouncelight bench paper-room:0 --method all --json out/bench.json
    python training/table.py out/judge.csv --bench out/bench.json \\
        --weights neural=assets/weights/small.safetensors --weights "apply paper"=assets/weights/paper.safetensors [--group room] [--bouncelight target/release/bouncelight]

Errors are means over the scenes whose name begins with --group. GFLOP and MB are what `bench` counts for all indirect light of one picture (of a network on pictures: what `weights info` counts); "GTX 1050" is a
projection from these counts (src/study/projection.rs: a roofline with an efficiency of 0.35), never a measurement; "GPU" is measured, and left out where all records come from software adapters.
The paper's own row holds its authors' means over their 375 pictures, and what `weights info` counts for its layers.
"""
import argparse
import csv
import json
import re
import subprocess

ERRORS = [("l1", "L1", "{:,.0f}"), ("l2", "L2", "{:,.0f}"), ("paper-ssim", "SSIM(2.0)", "{:.4f}"), ("fid", '"FID"', "{:.4f}"), ("psnr", "PSNR", "{:.2f}"),
          ("flip", "FLIP", "{:.4f}"), ("relmse", "relMSE", "{:.4f}"), ("light", "light", "{:.1%}")]
COSTS = [("gflop", "GFLOP", "{:.2f}"), ("mb", "MB", "{:.0f}"), ("parameters", "parameters", "{:,}"), ("gpu", "GPU, ms", "{:.2f}"), ("projected", "GTX 1050, ms, projected", "{:.2f}")]
# src/study/projection.rs.
PEAK, BANDWIDTH, EFFICIENCY = 1.86e12, 112e9, 0.35
# The authors' table, and the layers of their network (64 channels) at 1024x512.
PAPER = {"l1": 45178, "l2": 2143, "paper-ssim": 0.9849, "fid": 0.0031, "gflop": 104.02, "mb": 780.8, "parameters": 54_423_171}


def projected(costs):
    """Milliseconds of passes one after the other, each (flops, bytes)."""
    return sum(1e3 * max(flops / PEAK, moved / BANDWIDTH) / EFFICIENCY for flops, moved in costs)


def errors(paths, group):
    """{row: {metric: mean over scenes}} in the files' order."""
    rows = {}
    for path in paths:
        with open(path, newline="") as file:
            for line in csv.DictReader(file):
                if line["scene"].startswith(group):
                    rows.setdefault(line["row"], {})[line["scene"]] = line
    if not rows:
        raise SystemExit(f"error: {', '.join(paths)}: no scene begins with `{group}`")
    most = max(map(len, rows.values()))
    for row, scenes in rows.items():
        if len(scenes) < most:
            raise SystemExit(f"error: {row} has {len(scenes)} scenes, others have {most}; judge it on all of them")
    return {row: {m: sum(float(line[m]) for line in scenes.values()) / most for m, *_ in ERRORS} for row, scenes in rows.items()}


def of_bench(record):
    """{row: costs} of a record FILE[=ROW]; ROW is what its method `neural` is called."""
    path, _, name = record.partition("=")
    with open(path) as file:
        bench = json.load(file)
    found = {}
    for m in bench["methods"]:
        passes = [(c["flops"], c["bytes"]) for c in m["costs"]]
        costs = {"gflop": sum(f for f, _ in passes) / 1e9, "mb": sum(b for _, b in passes) / 1e6, "projected": projected(passes)}
        if not bench["software"] and m["gpu_ms"]:
            costs["gpu"] = m["gpu_ms"]["median"]
        found[name if name and m["method"] == "neural" else m["method"]] = costs
    return found


def of_weights(program, path):
    """Parameters of a weights file, and what its layers cost at 1024x512."""
    text = subprocess.run([program, "weights", "info", path, "--size", "1024x512"], check=True, capture_output=True, text=True).stdout
    gflop, mb = (float(n) for n in re.search(r": ([\d.]+) GFLOP, ([\d.]+) MB moved", text).groups())
    return {"parameters": int(re.search(r"parameters (\d+)", text)[1]), "gflop": gflop, "mb": mb}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("csv", nargs="+")
    parser.add_argument("--bench", action="append", default=[], metavar="FILE[=ROW]")
    parser.add_argument("--weights", action="append", default=[], metavar="ROW=FILE")
    parser.add_argument("--group", default="room")
    parser.add_argument("--bouncelight", default="target/release/bouncelight")
    a = parser.parse_args()
    rows = errors(a.csv, a.group)
    rows["the paper's network, its own pictures"] = dict(PAPER)
    for record in a.bench:
        for row, costs in of_bench(record).items():
            rows.get(row, {}).update(costs)
    for entry in a.weights:
        row, _, path = entry.partition("=")
        if row in rows:
            found = of_weights(a.bouncelight, path)
            # A network that corrects a method has its layers in the bench's counts.
            rows[row].update(found if "gflop" not in rows[row] else {"parameters": found["parameters"]})
    # What nobody measured gets no column.
    columns = [c for c in COSTS + ERRORS if any(c[0] in values for values in rows.values())]
    print("| | " + " | ".join(title for _, title, _ in columns) + " |\n|" + "---|" * (len(columns) + 1))
    for row, values in rows.items():
        if values.get("gflop") and "projected" not in values:
            values["projected"] = projected([(1e9 * values["gflop"], 1e6 * values["mb"])])
        cells = [form.format(values[key]) if key in values and values[key] == values[key] else "" for key, _, form in columns]
        print(f"| {row} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
