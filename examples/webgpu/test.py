"""python test.py DATA METHOD OUT.png [--frames N] [--raster]: has headless Chromium draw the page with DATA (`scene.glb` and
a folder METHOD) and keeps the picture. `--raster`: without the pass's light."""

import argparse
import functools
import http.server
import queue
import subprocess
import sys
import tempfile
import threading
import urllib.parse
from pathlib import Path

import numpy as np
from PIL import Image

FLAGS = ["--headless=new", "--no-sandbox", "--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"]


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


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data")
    parser.add_argument("method")
    parser.add_argument("out")
    parser.add_argument("--frames", type=int, default=48)
    parser.add_argument("--raster", action="store_true")
    parser.add_argument("--chromium", default="chromium")
    args = parser.parse_args()
    answers = queue.Queue()
    handler = functools.partial(Server, data=args.data, answers=answers)
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    url = f"http://127.0.0.1:{server.server_port}/?test={args.method}&frames={args.frames}"
    url += "&raster" if args.raster else ""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        command = [args.chromium, *FLAGS, f"--user-data-dir={profile}", url]
        browser = subprocess.Popen(command, stderr=subprocess.DEVNULL)
        try:
            said, body = answers.get(timeout=400)
        except queue.Empty:
            sys.exit("the page has not answered")
        finally:
            browser.terminate()
            browser.wait()
    if said.path != "/picture":
        sys.exit(f"the page says: {body.decode()}")
    about = urllib.parse.parse_qs(said.query)
    width, height = map(int, about["size"][0].split("x"))
    rows = np.frombuffer(body, "u1").reshape(height, int(about["row"][0]))
    Image.fromarray(rows[:, : 4 * width].reshape(height, width, 4)[..., :3].copy()).save(args.out)
    print(f"{args.out}: {args.frames} frames of {args.method} by Chromium")


if __name__ == "__main__":
    main()
