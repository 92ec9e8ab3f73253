"""What the rasteriser knows about the paper's rooms: one EXR a view, drawn by `bouncelight render --method direct`.

    python -m bouncelight_training.pix2pix.raster OUT --rooms 6-9,13 [--views 2] [--size 256x128] [--samples 4] [--bouncelight FILE]

Views and names are those of cycles/paper_rooms.py: view V of N turns the camera by V/N of a full turn. A file that exists is
kept, so a killed run goes on where it stopped. Rooms kept for judging are refused unless --judge is there.
"""
import argparse
import os
import subprocess
import sys

from ..errors import TrainingError, reported
from ..stream import SKY_RADIANCE, camera, indices, is_judged, rooms_of_stream

LAYERS = "DiffCol,GlossCol,Normal,Depth"


def size_of(text):
    """(width, height) of "256x128"."""
    width, height = map(int, text.split("x"))
    return width, height


def draw(program, room, index, turn, size, samples, path):
    """Draws one view into `path`, whole or not at all."""
    eye, target, fov = camera(room, turn, size)
    words = [f"--{name}={','.join(f'{v:.9g}' for v in values)}" for name, values in (("eye", eye), ("look-at", target), ("fov", (fov,)))]
    command = [program, "render", f"paper-room:{index}", *words, "--environment", str(SKY_RADIANCE), "--size", f"{size[0]}x{size[1]}", "--method", "direct",
               "--samples", str(samples), "--aov", LAYERS, "-o", path + ".part.exr", "-q"]
    try:
        done = subprocess.run(command, capture_output=True, text=True)
    except OSError as error:
        raise TrainingError(f"{program}: {error}; build it with cargo build --release, or pass --bouncelight") from error
    if done.returncode:
        raise TrainingError(f"{' '.join(command)} ended with code {done.returncode}: {done.stderr.strip()}")
    os.replace(path + ".part.exr", path)


@reported
def main(arguments=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--rooms", required=True, type=indices, help="stream indices, such as 6-9,13")
    parser.add_argument("--views", type=int, default=2, help="how many directions the full turn is cut into")
    parser.add_argument("--size", default="256x128", type=size_of)
    parser.add_argument("--samples", type=int, default=4, help="jittered frames that are averaged")
    parser.add_argument("--bouncelight", default="target/release/bouncelight", help="the program")
    parser.add_argument("--judge", action="store_true", help="allow the rooms kept for judging")
    a = parser.parse_args(arguments)
    kept = [i for i in a.rooms if is_judged(i)]
    if kept and not a.judge:
        raise TrainingError(f"rooms {kept} are kept for judging; pass --judge if that is what they are drawn for")
    os.makedirs(a.out, exist_ok=True)
    for index, room in rooms_of_stream(set(a.rooms)).items():
        for view in range(a.views):
            path = os.path.join(a.out, f"room{index:04}_view{view}.exr")
            if not os.path.exists(path):
                draw(a.bouncelight, room, index, view / a.views, a.size, a.samples, path)
        print(f"room {index}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
