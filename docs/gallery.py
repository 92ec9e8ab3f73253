#!/usr/bin/env python3
"""Makes docs/reports/gallery.md: the first picture of ten files, ours beside F3D's and that of Khronos' glTF Sample Renderer.

    python3 docs/gallery.py [--program target/release/bouncelight] [--shared ../shared] [--only NAME] [--keep FOLDER]
                            [--khronos FOLDER] [--browser chromium]

Files are stripped of their cameras and lights before, so that all programs have to find their own. Needs Pillow; for
F3D's picture `f3d` and `xvfb-run` (Debian packages f3d and xvfb); for Khronos' Chromium, and npm unless --khronos says
where the package lies unpacked (gallery_khronos.py). Nothing of other people's files is kept but the pictures, whose
captions name the authors. The last column of the table is what somebody saw in the pictures: look again when they change.
"""
import argparse
import json
import pathlib
import re
import struct
import subprocess
import tempfile

from PIL import Image, ImageDraw

import gallery_khronos

DOCS = pathlib.Path(__file__).resolve().parent
SIZE = (640, 320)
SHOWN = (400, 200)
REAL = "reference/real"
# Name, file below the shared folder, author, what is hard, what differs from Khronos' picture.
FILES = [
    ("hotel", f"{REAL}/hotel/scene.glb", '"Hotel Room Ege Carpets Lotus Wave Grey" by Aaron Openshaw (Sketchfab)', "a closed room in millimetres",
     "ours stands in the room with sun through its window, Khronos' sees it small from outside through walls that face away; ours is worse in far corners, which are nearly black"),
    ("apartment", f"{REAL}/apartment_day/scene.glb", '"Dream Apartment" by Mad_Huron (Sketchfab)', "rooms without ceilings",
     "ours looks down into the rooms, Khronos' at an outer wall from the side; both make room for the figure that stands apart, which ours shows edge-on, a line at the bottom, and Khronos' whole"),
    ("study", f"{REAL}/study/scene.glb", '"The Botanist\'s Study" by riikkakilpelainen (Sketchfab)', "a diorama with a glowing beam",
     "ours fills the picture and has shadows, Khronos' looks along the wall; ours is worse in its near-black base, which is dark grey, its wall, close to white, and the beam in the window, an opaque beige, since the file's glow is shown 7.7 times as bright"),
    ("city", f"{REAL}/city/scene.glb", '"WW2 Cityscene" by SilkevdSmissen (Sketchfab)', "a street in centimetres",
     "ours looks from above and is larger, Khronos' from the side; ours is worse in the tree, whose leaves glow red (the file's faint glow is shown 13 times as bright, Khronos' leaves are the texture's dull red), the black base, which is grey, and pale walls; blended leaves are in order in ours, in Khronos' they let through what is behind"),
    ("sampleroom", f"{REAL}/sampleroom/scene.glb", "sample room of Sascha Willems' Vulkan assets", "a room open to one side",
     "ours looks in at the open side, Khronos' at the outside of a wall, off the middle; ours has a shadow over half of it and blue dots of sunlight along the edge of the back wall"),
    ("pica", "real/pica_pica_mini_diorama/scene.gltf", '"PICA PICA - Mini Diorama 01" (skfb.ly/6C7pD) by SEED.EA, CC BY-NC 4.0', "an object of many parts",
     "ours shows the floor and most things, Khronos' looks along the floor from far; its clock is behind our pillar, colours are the same, and glossy walls mirror the room in ours, the sky in Khronos'"),
    ("cornell", "real/cornell_box_gltf/scene.gltf", "the Cornell box, data of Cornell University's program of computer graphics", "a box with a lamp",
     "ours is twice as large and has shadows and the walls' colours on the boxes, Khronos' is evenly lit from the front; ours is worse in what the sun does not reach, which is blotched, and in a few specks of sunlight up the left back edge"),
    ("cornell-obj", "real/cornell_box_obj/cornell_box.obj", "the same as OBJ, from the tests of the crate tobj", "surfaces without glow",
     "Khronos' reads no OBJ"),
    ("paper-room", "reference/cycles/paper_0002/scene.glb", "our own, after Harris-Dewey and Klein's room stream", "loose things in a box",
     "ours looks into the box from above, Khronos' at its front wall, and shows none of the things; colours of the wall are the same"),
    ("metal", "reference/cycles/metal_301/scene.glb", "our own", "metals",
     "as the box before: the things are seen in ours only, so the pictures say nothing of how metals differ"),
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
            (folder / beside.name).symlink_to(beside.resolve())
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
    args.add_argument("--khronos", type=pathlib.Path, help="where Khronos' package lies; else npm fetches it")
    args.add_argument("--browser", default="chromium", help="what draws Khronos' pictures")
    args = args.parse_args()
    rows, said, gltf = [], {}, {}
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        keep = args.keep or folder
        keep.mkdir(parents=True, exist_ok=True)
        for name, file, author, hard, seen in FILES:
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
            if file.suffix != ".obj":
                gltf[name] = file
            rows.append((name, author, hard, seen, ours, theirs, keep / f"{name}-khronos.png"))
            print(name, *said[name], sep="\n  ", flush=True)
        if gltf:
            failed = gallery_khronos.draw_all(gltf, keep, SIZE, args.khronos, args.browser)
            if failed:
                raise SystemExit(f"Khronos' renderer: {failed}")
        if args.only:
            return
        sheet = Image.new("RGB", (3 * SHOWN[0] + 8, len(rows) * (SHOWN[1] + 4)), (24, 24, 24))
        for i, row in enumerate(rows):
            for k, path in enumerate(row[4:]):
                corner = (k * (SHOWN[0] + 4), i * (SHOWN[1] + 4))
                if path.exists():
                    sheet.paste(Image.open(path).convert("RGB").resize(SHOWN, Image.LANCZOS), corner)
                else:
                    middle = (corner[0] + SHOWN[0] // 2, corner[1] + SHOWN[1] // 2)
                    ImageDraw.Draw(sheet).text(middle, "reads glTF only", (160, 160, 160), anchor="mm")
        sheet.save(DOCS / "images/gallery.jpg", quality=80)
    lines = [
        "# First pictures",
        "",
        "What `bouncelight render FILE -o picture.png` shows of ten files that were stripped of their cameras and lights, beside",
        "what F3D 1.3.1 (Debian) and Khronos' glTF Sample Renderer "
        f"(npm: {gallery_khronos.PACKAGE} {gallery_khronos.VERSION}) show of the",
        "same. Made by `python3 docs/gallery.py`, on Mesa's CPU driver (Khronos': SwiftShader, in Chromium). Do not edit.",
        "",
        "Khronos' renderer is driven as its Sample Viewer does it when a file is opened: camera, exposure 1, Khronos' neutral",
        "tone curve, surroundings as light and background. The Sample Viewer's photographed surroundings are not in the package:",
        "a plain sky with a soft sun behind the camera, made by a formula of ours, is in their place, so how bright its pictures",
        "are says little, and how they are framed and coloured says more. It computes no shadows and no light from surface to",
        "surface. It stops at the empty texture of file 6; there it was given a white one.",
        "",
        "![Ours, F3D's, Khronos'](../images/gallery.jpg)",
        "",
        "*Ours left, F3D's in the middle, Khronos' right, in the order of the table.*",
        "",
        "| | file | what is hard | what the program said | ours beside Khronos' |",
        "|---|---|---|---|---|",
    ]
    for i, (name, author, hard, seen, *_) in enumerate(rows):
        told = "; ".join(plain(line) for line in said[name])
        lines.append(f"| {i + 1} | {author} | {hard} | {told} | {seen} |")
    (DOCS / "reports/gallery.md").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
