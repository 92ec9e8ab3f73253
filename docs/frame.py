#!/usr/bin/env python3
"""Draws docs/images/frame.svg: the frame's passes in order, and what each reads and writes.

    python3 docs/frame.py
"""
import os
from html import escape

OUT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "images", "frame.svg")

RESOURCES = [
    "scene: triangles, BVH, lights", "shadow maps, light lists", "G-buffer", "direct light, E/π", "cell pixels",
    "history of cells", "what rays found", "radiance cache", "specular history of pixels", "exposure, tensors",
    "cell light", "indirect light, E/π and specular", "HDR picture",
    "anti-lag result",
]
# Group, pass, what it does, resources read, resources written.
PASSES = [
    ("Raster", "deform", "skins and morph targets", "0", "0"),
    ("Raster", "shadow", "depth from each lamp", "0", "1"),
    ("Raster", "gbuffer", "depth, normal, albedo, …", "0", "2"),
    ("Raster", "lights", "light lists, from nine lights", "0 2", "1"),
    ("Raster", "direct", "analytic lights with shadows", "0 1 2", "3"),
    ("Trace", "gi.downsample", "one pixel for each 4×4 cell", "2", "4"),
    ("Trace", "gi.gradient", "temporal gradient, after changes", "0 2 5 6 7", "6"),
    ("Trace", "gi.reproject", "reproject, find disocclusions", "2 4 5 6 13", "4 6"),
    ("Trace", "gi.cache_evict", "free old cache entries", "7", "7"),
    ("Trace", "gi.trace", "trace cells' rays", "0 2 4 7", "6 7"),
    ("Trace", "gi.cache_select", "entries that are due in an update", "7", "7"),
    ("Trace", "gi.cache_update", "update the cache, 1 to 32 times", "0 7", "7"),
    ("Trace", "gi.specular_trace", "trace specular rays of pixels", "0 2 7 8", "8"),
    ("Denoise", "gi.accumulate", "temporal accumulation", "2 4 5 6 7 13", "5"),
    ("Denoise", "gi.exposure", "mean light (neural)", "2 3", "9"),
    ("Denoise", "gi.features", "network inputs (neural)", "2 5 9", "9"),
    ("Denoise", "net.*", "U-Net: guidance (neural)", "9", "9"),
    ("Denoise", "gi.blur", "bilateral blur, 5×5 cells; anti-lag", "5 9", "10 13"),
    ("Denoise", "gi.atrous", "one à-trous step", "5 9 10", "10"),
    ("Denoise", "gi.upsample", "joint bilateral upsampling", "2 4 8 10", "11"),
    ("Picture", "composite", "albedo · (direct + indirect) + …", "2 3 11", "12"),
    ("Picture", "blended", "veils, sorted", "0 1 11 12", "12"),
    ("Picture", "taa", "temporal anti-aliasing, if on", "2 12", "12"),
    ("Picture", "tonemap", "for a display", "12", ""),
]
COLOURS = {"Raster": "#0072b2", "Trace": "#d55e00", "Denoise": "#009e73", "Picture": "#7a5195"}
LEFT, TOP, ROW, COLUMN = 446, 190, 26, 42


def text(x, y, words, more=""):
    return f'<text x="{x}" y="{y}" {more}>{escape(words)}</text>'


def main():
    width, height = LEFT + COLUMN * len(RESOURCES) + 130, TOP + ROW * len(PASSES) + 50
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="13">',
        f'<rect width="{width}" height="{height}" fill="#fff"/>',
    ]
    bottom = TOP + ROW * len(PASSES)
    for i, name in enumerate(RESOURCES):
        x = LEFT + COLUMN * i + COLUMN // 2
        rows = [j for j, p in enumerate(PASSES) if str(i) in (p[3] + " " + p[4]).split()]
        out.append(f'<line x1="{x}" y1="{TOP - 6}" x2="{x}" y2="{bottom}" stroke="#e4e4e4"/>')
        out.append(f'<line x1="{x}" y1="{TOP + ROW * rows[0] + 13}" x2="{x}" y2="{TOP + ROW * rows[-1] + 13}" stroke="#888" stroke-width="2"/>')
        out.append(text(x, TOP - 12, name, f'transform="rotate(-40 {x} {TOP - 12})"'))
    group, first = None, 0
    for j, (of, name, what, reads, writes) in enumerate(PASSES):
        y, colour = TOP + ROW * j, COLOURS[of]
        if of != group:
            group, first = of, y
            count = sum(p[0] == of for p in PASSES)
            middle = y + ROW * count / 2
            out.append(f'<rect x="10" y="{y + 2}" width="24" height="{ROW * count - 4}" rx="4" fill="{colour}"/>')
            out.append(text(22, middle, of, f'fill="#fff" text-anchor="middle" transform="rotate(-90 22 {middle})" dy="4"'))
        if j % 2 == 0:
            out.append(f'<rect x="40" y="{y}" width="{LEFT + COLUMN * len(RESOURCES) - 40}" height="{ROW}" fill="{colour}" opacity="0.07"/>')
        out.append(text(48, y + 17, name, f'font-family="monospace" font-weight="bold" fill="{colour}"'))
        out.append(text(196, y + 17, what))
        for i in range(len(RESOURCES)):
            x = LEFT + COLUMN * i + COLUMN // 2
            if str(i) in writes.split():
                out.append(f'<rect x="{x - 8}" y="{y + 5}" width="16" height="16" rx="2" fill="{colour}"/>')
                if str(i) in reads.split():
                    out.append(f'<circle cx="{x}" cy="{y + 13}" r="4" fill="#fff"/>')
            elif str(i) in reads.split():
                out.append(f'<circle cx="{x}" cy="{y + 13}" r="7" fill="#fff" stroke="{colour}" stroke-width="2.5"/>')
    y = bottom + 30
    for x, shape, words in [
        (48, f'<circle cx="48" cy="{y - 5}" r="7" fill="#fff" stroke="#555" stroke-width="2.5"/>', "reads"),
        (128, f'<rect x="120" y="{y - 13}" width="16" height="16" rx="2" fill="#555"/>', "writes"),
        (208, f'<rect x="200" y="{y - 13}" width="16" height="16" rx="2" fill="#555"/><circle cx="208" cy="{y - 5}" r="4" fill="#fff"/>', "reads and writes"),
    ]:
        out += [shape, text(x + 14, y, words)]
    out.append(text(446, y, "Time runs downwards: each row is a pass, in the order of recording."))
    with open(OUT, "w", encoding="utf-8") as file:
        file.write("\n".join(out) + "\n</svg>\n")


if __name__ == "__main__":
    main()
