#!/usr/bin/env python3
"""Makes docs/gallery.md: the first picture of ten files, ours beside F3D's.

    python3 docs/gallery.py [--program target/release/bouncelight] [--shared ../shared] [--only NAME] [--keep FOLDER]

Files are stripped of their cameras and lights before, so that both programs have to find their own. Needs Pillow, and
for F3D's half `f3d` and `xvfb-run` (Debian packages f3d and xvfb). Nothing of other people's files is kept but the
pictures, whose captions name the authors.
"""
import argparse
import json
import pathlib
import re
import struct
import subprocess
import tempfile

from PIL import Image

DOCS = pathlib.Path(__file__).resolve().parent
SIZE = (640, 320)
SHOWN = (400, 200)
REAL = "reference/real"
# Name, file below the shared folder, author, what is hard.
FILES = [
    ("hotel", f"{REAL}/hotel/scene.glb", '"Hotel Room Ege Carpets Lotus Wave Grey" by Aaron Openshaw (Sketchfab)', "a closed room in millimetres"),
    ("apartment", f"{REAL}/apartment_day/scene.glb", '"Dream Apartment" by Mad_Huron (Sketchfab)', "rooms without ceilings"),
    ("study", f"{REAL}/study/scene.glb", '"The Botanist\'s Study" by riikkakilpelainen (Sketchfab)', "a diorama with a glowing beam"),
    ("city", f"{REAL}/city/scene.glb", '"WW2 Cityscene" by SilkevdSmissen (Sketchfab)', "a street in centimetres"),
    ("sampleroom", f"{REAL}/sampleroom/scene.glb", "sample room of Sascha Willems' Vulkan assets", "a room open to one side"),
    ("pica", "real/pica_pica_mini_diorama/scene.gltf", '"PICA PICA - Mini Diorama 01" (skfb.ly/6C7pD) by SEED.EA, CC BY-NC 4.0', "an object of many parts"),
    ("cornell", "real/cornell_box_gltf/scene.gltf", "the Cornell box, data of Cornell University's program of computer graphics", "a box with a lamp"),
    ("cornell-obj", "real/cornell_box_obj/cornell_box.obj", "the same as OBJ, from the tests of the crate tobj", "surfaces without glow"),
    ("paper-room", "reference/cycles/paper_0002/scene.glb", "our own, after Harris-Dewey and Klein's room stream", "loose things in a box"),
    ("metal", "reference/cycles/metal_301/scene.glb", "our own", "metals"),
]


def strip(source, folder):
    """The file without cameras and lights; OBJ files as they are."""
    if source.suffix == ".obj":
        return source
    data = source.read_bytes()
    binary = data[:4] == b"glTF"
    if binary:
        length = struct.unpack("<I", data[12:16])[0]
        text, rest = data[20 : 20 + length], data[20 + length :]
    else:
        text, rest = data, b""
    scene = json.loads(text)
    scene.pop("cameras", None)
    scene.get("extensions", {}).pop("KHR_lights_punctual", None)
    for node in scene.get("nodes", []):
        node.pop("camera", None)
        node.get("extensions", {}).pop("KHR_lights_punctual", None)
        if not node.get("extensions"):
            node.pop("extensions", None)
    for key in ("extensionsUsed", "extensionsRequired"):
        left = [name for name in scene.get(key, []) if name != "KHR_lights_punctual"]
        scene.pop(key, None)
        if left:
            scene[key] = left
    if not scene.get("extensions"):
        scene.pop("extensions", None)
    out = json.dumps(scene).encode()
    if binary:
        out += b" " * (-len(out) % 4)
        head = struct.pack("<4sIIII", b"glTF", 2, 20 + len(out) + len(rest), len(out), 0x4E4F534A)
        target = folder / "scene.glb"
        target.write_bytes(head + out + rest)
        return target
    target = folder / source.name
    target.write_bytes(out)
    for beside in source.parent.iterdir():
        if beside.name != source.name:
            (folder / beside.name).symlink_to(beside)
    return target


def draw(command, target):
    """Runs a command that writes `target`; the last lines that it says."""
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode or not target.exists():
        raise SystemExit(f"{command[0]} {target.name}: {done.stdout[-500:]}{done.stderr[-500:]}")
    return [line for line in done.stderr.splitlines() if line.startswith(("warning", "exposure"))]


def plain(line):
    """What the program said, without the place of the file and without "warning"."""
    line = re.sub(r"^warning: ", "", line).replace("; --exposure says another", "")
    return re.sub(r"^(\S*/|'scene' |'cornell_box' )", "", line)


def main():
    args = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    args.add_argument("--program", default="target/release/bouncelight")
    args.add_argument("--shared", type=pathlib.Path, default=pathlib.Path("../shared"))
    args.add_argument("--only", help="one of the names; writes no page")
    args.add_argument("--keep", type=pathlib.Path, help="where the whole pictures stay")
    args = args.parse_args()
    rows, said = [], {}
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        keep = args.keep or folder
        keep.mkdir(parents=True, exist_ok=True)
        for name, file, author, hard in FILES:
            if args.only and args.only != name:
                continue
            own = folder / name
            own.mkdir()
            file = strip(args.shared / file, own)
            ours, theirs = keep / f"{name}.png", keep / f"{name}-f3d.png"
            size = "x".join(map(str, SIZE))
            # `--allow-outside`: what lies beside a copy is a link.
            said[name] = draw([args.program, "render", str(file), "-o", str(ours), "--size", size, "--allow-outside"], ours)
            size = ",".join(map(str, SIZE))
            draw(["xvfb-run", "-a", "f3d", str(file), "--output", str(theirs), "--resolution", size, "--dry-run"], theirs)
            rows.append((name, author, hard, ours, theirs))
            print(name, *said[name], sep="\n  ", flush=True)
        if args.only:
            return
        sheet = Image.new("RGB", (2 * SHOWN[0] + 4, len(rows) * (SHOWN[1] + 4)), (24, 24, 24))
        for i, row in enumerate(rows):
            for k, path in enumerate(row[3:]):
                picture = Image.open(path).convert("RGB").resize(SHOWN, Image.LANCZOS)
                sheet.paste(picture, (k * (SHOWN[0] + 4), i * (SHOWN[1] + 4)))
        sheet.save(DOCS / "images/gallery.jpg", quality=80)
    lines = [
        "# First pictures",
        "",
        "What `bouncelight render FILE -o picture.png` shows of ten files that were stripped of their cameras and lights, beside",
        "what F3D 1.3.1 (Debian) shows of the same. Made by `python3 docs/gallery.py`, on Mesa's CPU driver. Do not edit.",
        "",
        "![Ours left, F3D's right](images/gallery.jpg)",
        "",
        "*Ours left, F3D's right, in the order of the table.*",
        "",
        "| | file | what is hard | what the program said |",
        "|---|---|---|---|",
    ]
    for i, (name, author, hard, *_) in enumerate(rows):
        told = "; ".join(plain(line) for line in said[name])
        lines.append(f"| {i + 1} | {author} | {hard} | {told} |")
    (DOCS / "gallery.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
