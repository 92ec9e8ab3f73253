"""python test.py DATA SCENE: has headless Chromium draw the page with DATA (`scene.glb`, and a folder for each method),
keeps its pictures there and has the program draw SCENE by the same methods: FLIP is within 0.05, and is not without the
pass's light."""

import argparse
import functools
import http.server
import queue
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse
from pathlib import Path

import numpy as np
from PIL import Image

FLAGS = ["--headless=new", "--no-sandbox", "--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"]
THRESHOLD = 0.05
# Exit code with which `bouncelight render` says that a picture differs from its reference.
ABOVE_THRESHOLD = 5


class Server(http.server.SimpleHTTPRequestHandler):
    """The page's folder, DATA as /data, and what the page posts."""

    def __init__(self, *args, data, answers, **more):
        self.data, self.answers = data, answers
        super().__init__(*args, directory=Path(__file__).parent, **more)

    def translate_path(self, path):
        plain = urllib.parse.unquote(urllib.parse.urlparse(path).path)
        parts = [p for p in plain.split("/") if p not in ("", ".", "..")]
        if parts[:1] == ["data"]:
            return str(Path(self.data, *parts[1:]))
        return super().translate_path(path)

    def do_POST(self):
        body = self.rfile.read(int(self.headers["Content-Length"]))
        self.send_response(204)
        self.end_headers()
        self.answers.put((urllib.parse.urlparse(self.path), body))

    def log_message(self, *_):
        pass


def draw(args, method):
    """The page's picture of METHOD after the frames, and how many seconds that took with loading and compiling."""
    answers = queue.Queue()
    handler = functools.partial(Server, data=args.data, answers=answers)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    url = f"http://127.0.0.1:{server.server_port}/?test={method}&frames={args.frames}"
    began = time.monotonic()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [args.chromium, *FLAGS, f"--user-data-dir={profile}", url]
        browser = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        try:
            said, body = answers.get(timeout=args.wait)
        except queue.Empty:
            sys.exit(f"{method}: the page has not answered in {args.wait:.0f} s")
        finally:
            browser.terminate()
            browser.wait()
            server.shutdown()
    if said.path != "/picture":
        sys.exit(f"the page says: {body.decode()}")
    about = urllib.parse.parse_qs(said.query)
    width, height = map(int, about["size"][0].split("x"))
    rows = np.frombuffer(body, "u1").reshape(height, int(about["row"][0]))
    pixels = rows[:, : 4 * width].reshape(height, width, 4)[..., :3].copy()
    return Image.fromarray(pixels), time.monotonic() - began


def judge(args, picture, size, method):
    """The exit code of the program when it compares its own picture with PICTURE, after it has printed the FLIP."""
    with tempfile.TemporaryDirectory() as folder:
        command = [args.program, "-q", "render", args.scene, "--size", "{}x{}".format(*size), "--tonemap", "none"]
        # The page's frame is not averaged over jittered ones.
        command += ["--samples", "1", "--method", method, "-o", f"{folder}/own.png"]
        command += [] if method == "direct" else ["--accumulate", str(args.frames)]
        command += ["--reference", picture, "--metric", "flip", "--threshold", str(THRESHOLD)]
        print(f"beside our own {method}:", end=" ", flush=True)
        return subprocess.run(command, check=False).returncode


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data")
    parser.add_argument("scene")
    parser.add_argument("--methods", nargs="+", default=["gather", "neural"])
    parser.add_argument("--frames", type=int, default=48)
    parser.add_argument("--program", default="bouncelight")
    parser.add_argument("--chromium", default="chromium")
    parser.add_argument("--wait", type=float, default=600, help="seconds that a picture may take")
    args = parser.parse_args()
    wrong = []
    for method in args.methods:
        image, seconds = draw(args, method)
        picture = f"{args.data}/{method}.png"
        image.save(picture)
        print(f"{picture}: {args.frames} frames by Chromium in {seconds:.0f} s")
        if judge(args, picture, image.size, method) != 0:
            wrong.append(f"{method}: not our own picture")
        if judge(args, picture, image.size, "direct") != ABOVE_THRESHOLD:
            wrong.append(f"{method}: without the pass's light the pictures should differ")
    sys.exit("\n".join(wrong) or None)


if __name__ == "__main__":
    main()
