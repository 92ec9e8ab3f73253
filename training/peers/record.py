"""peers.json: what was drawn and measured, kept from run to run; and its tables."""
import json
import os
import platform
import subprocess

OIDN = "2.5.1"
SETTINGS = {
    "gather": "settled: 32 frames of a still camera, then four samples; `, TAA`: temporal anti-aliasing, 31 frames; `, first frame`: one frame after a cut",
    "paths": f"`bouncelight trace`, all bounces, Open Image Denoise {OIDN} (pyoidn) with albedo and normal, HDR, high quality",
    "eevee": "16 samples, screen tracing at full resolution for all roughnesses, Fast GI (horizon scan) without a limit of distance; lengths in metres",
    "probes": "the same, and one volume of about 2,000 light probes, a cell wider than the scene, 256 bake samples",
}


def seconds(row, times, cores=2):
    """What a peer's picture takes on all cores: its processor time over their number, which other work on the machine does not lengthen; else what the clock said."""
    if "paths" in row:
        return (row["paths"] * times["path_cpu_s"] + row["denoise_cpu_s"]) / cores
    return row["cpu_s"] / cores if "cpu_s" in row else row["wall_s"]


def marks(record, metric):
    """For the chart: (peers, curve of paths + OIDN), each a list of (name, mean seconds, mean error), of rows that were judged in every timed scene."""
    kinds = {True: [], False: []}
    for name in dict.fromkeys(r["row"] for r in record["rows"]):
        rows = [r for r in record["rows"] if r["row"] == name and r["scene"] in record["times"] and r.get(metric) is not None and ("paths" in r or "wall_s" in r)]
        if rows and len(rows) == len(record["times"]):
            time = sum(seconds(r, record["times"][r["scene"]]) for r in rows) / len(rows)
            kinds["paths" in rows[0]].append((name, time, sum(r[metric] for r in rows) / len(rows)))
    return kinds[False], sorted(kinds[True], key=lambda mark: mark[1])


def geometric(low, high, t):
    """Between two numbers, even in their logarithm."""
    return low ** (1 - t) * high**t


class Record:
    def __init__(self, folder, program):
        self.path, self.page = os.path.join(folder, "peers.json"), os.path.join(folder, "peers.md")
        version = subprocess.run([program, "--version"], capture_output=True, text=True).stdout.strip()
        self.all = {"schema": 1, "size": [512, 256], "version": version, "machine": f"{os.cpu_count()} cores, {platform.machine()}", "settings": SETTINGS, "rows": [], "times": {}, "stability": {}}
        if os.path.exists(self.path):
            with open(self.path) as file:
                self.all |= {key: value for key, value in json.load(file).items() if key in ("rows", "times", "stability")}

    def put(self, row):
        rows, name = self.all["rows"], lambda r: (r["scene"], r["row"])
        at = next((i for i, r in enumerate(rows) if name(r) == name(row)), len(rows))
        rows[at:at + 1] = [row]

    def put_times(self, scene, times):
        self.all["times"][scene] = times

    def put_stability(self, scene, rows):
        self.all["stability"][scene] = rows

    def write(self):
        for path, text in ((self.path, json.dumps(self.all, indent=1)), (self.page, page(self.all))):
            with open(path + ".part", "w") as file:
                file.write(text)
            os.replace(path + ".part", path)


def table(rows, key, scale=1, form="{:.1f}"):
    """A table of one error: a line a peer, a column a scene, the mean of those scenes that all have."""
    names, peers = (list(dict.fromkeys(r[k] for r in rows)) for k in ("scene", "row"))
    value = {(r["row"], r["scene"]): r.get(key) for r in rows}
    lines = ["| | " + " | ".join(names) + " | mean |", "|" + "---|" * (len(names) + 2)]
    for peer in peers:
        found = [value.get((peer, name)) for name in names]
        said = ["–" if v is None else form.format(scale * v) for v in found]
        mean = form.format(scale * sum(found) / len(found)) if None not in found else "–"
        lines.append(f"| {peer} | " + " | ".join(said) + f" | {mean} |")
    return "\n".join(lines)


def at_time(curve, seconds, path_s, denoise_s, key):
    """The error of paths + OIDN after some seconds, and how many paths those are: between the numbers that were drawn, even in logarithms. None where not
    even one path is done, or more than were drawn."""
    paths = (seconds - denoise_s) / path_s
    for (n, low), (m, high) in zip(curve, curve[1:]):
        if n <= paths <= m:
            t = (paths - n) / (m - n)
            return geometric(low, high, t) if key != "psnr" else low + (high - low) * t, paths
    return (None, paths) if paths < curve[0][0] else (curve[-1][1], paths)


def equal_time(record, key="light", clock="cpu_s"):
    """For each scene: `gather` at the time of one frame and of 32, and paths + OIDN at those times."""
    for scene, times in record["times"].items():
        rows = {r["row"]: r for r in record["rows"] if r["scene"] == scene}
        curve = sorted((r["paths"], r) for r in rows.values() if "paths" in r)
        if not curve or "gather, TAA" not in rows:
            continue
        denoise = sorted(r["denoise_" + clock] for _, r in curve)[len(curve) // 2]
        frame, path = times["frame_" + clock], times["path_" + clock]
        points = [(n, r[key]) for n, r in curve]
        yield {"scene": scene, "frame_s": frame, "path_s": path, "denoise_s": denoise, "gather": rows["gather, TAA"][key], "first": rows["gather, first frame"][key],
               "one_path": points[0][1], "rest": at_time(points, frame, path, denoise, key), "cut": at_time(points, 32 * frame, path, denoise, key)}


def equal_table(record, key, clock, scale, form):
    show = lambda v: "–" if v is None else form.format(scale * v)
    lines = ["| scene | frame | path | OIDN | `gather` at rest | paths in a frame | their error (of 1 path, where it is less) | paths in 32 frames | their error |", "|" + "---|" * 9]
    for r in equal_time(record, key, clock):
        rest, cut = r["rest"], r["cut"]
        lines.append(f"| {r['scene']} | {r['frame_s']:.2f} s | {r['path_s']:.2f} s | {r['denoise_s']:.2f} s | {show(r['gather'])} | {max(rest[1], 0):.1f} | {show(rest[0] if rest[0] is not None else r['one_path'])} | {cut[1]:.0f} | {show(cut[0])} |")
    return "\n".join(lines)


def page(record):
    rows, text = record["rows"], []
    for title, key, scale, form in (("Light, %", "light", 100, "{:.1f}"), ("PSNR, dB", "psnr", 1, "{:.1f}"), ("FLIP", "flip", 1, "{:.3f}"), ("SSIM", "ssim", 1, "{:.3f}")):
        text.append(f"## {title}\n\n{table([r for r in rows if key in r], key, scale, form)}\n")
    for key, word, scale, form in (("light", "light, %", 100, "{:.1f}"), ("psnr", "PSNR, dB", 1, "{:.1f}")):
        for clock, said in (("cpu_s", "processor"), ("s", "wall")):
            if clock == "cpu_s":
                text.append(f"## Equal time ({said}), {word}\n\n{equal_table(record, key, clock, scale, form)}\n")
    text.append("## Seconds\n")
    for key in ("wall_s", "cpu_s", "bake_s", "bake_cpu_s"):
        some = [r for r in rows if r.get(key) is not None]
        if some:
            text.append(f"{key}\n\n{table(some, key)}\n")
    for scene, found in record["stability"].items():
        text.append(f"## Stability: {scene}\n\n" + "\n".join(f"- {name}: {json.dumps(value)}" for name, value in found.items()) + "\n")
    return "\n".join(text)
