#!/usr/bin/env python3
"""First pictures of glTF files by Khronos' glTF Sample Renderer, in a browser without a window; docs/gallery.py calls it.

    python3 docs/gallery_khronos.py FILE.glb ... --out FOLDER [--package FOLDER] [--browser chromium]

Needs Pillow and Chromium. Without --package, npm fetches the renderer into a temporary folder. The page that drives it
does what Khronos' Sample Viewer does when a file is opened (its camera, its exposure, its tone curve). What the package
lacks is Khronos' photographed surroundings: `panorama` makes a plain sky in their place.
"""
import argparse
import functools
import http.server
import json
import math
import pathlib
import shutil
import subprocess
import tarfile
import tempfile
import threading

from PIL import Image

PACKAGE = "@khronosgroup/gltf-viewer"
VERSION = "1.1.0"
FLAGS = [
    "--headless=new", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
    "--ignore-gpu-blocklist", "--no-first-run", "--disable-extensions", "--disable-background-networking",
]
# As the Sample Viewer's own main.js: the default scene, no camera of the file, the view fitted to the extents.
# The renderer's other settings are its defaults.
PAGE = """<!doctype html><meta charset="utf-8"><canvas id="canvas" width="WIDTH" height="HEIGHT"></canvas>
<script src="package/dist/libs/libktx.js"></script>
<script>window.DracoDecoderModule = () => {};</script>
<script type="module">
import { GltfView } from "./package/dist/gltf-viewer.module.js";
const say = (path, body) => fetch(path, { method: "POST", body });
try {
    const canvas = document.getElementById("canvas");
    const context = canvas.getContext("webgl2", { alpha: false, antialias: true, preserveDrawingBuffer: true });
    const view = new GltfView(context);
    const loader = view.createResourceLoader(undefined, undefined, "package/dist/libs/");
    const state = view.createState();
    state.environment = await loader.loadEnvironment("panorama.hdr", { lut_sheen_E_file: "sheen.png" });
    for (const [name, file] of Object.entries(FILES)) {
        try {
            state.gltf = await loader.loadGltf(file);
            state.sceneIndex = state.gltf.scene ?? 0;
            state.cameraIndex = undefined;
            state.gltf.scenes[state.sceneIndex].applyTransformHierarchy(state.gltf);
            state.userCamera.perspective.aspectRatio = canvas.width / canvas.height;
            state.userCamera.resetView(state.gltf, state.sceneIndex);
            // Twice, since what the first draw uploads may lack mip levels in it.
            view.renderFrame(state, canvas.width, canvas.height);
            view.renderFrame(state, canvas.width, canvas.height);
            await say("picture/" + name, await new Promise((done) => canvas.toBlob(done)));
        } catch (error) {
            await say("error/" + name, String(error.stack));
        }
    }
    await say("end");
} catch (error) {
    await say("end", String(error.stack));
}
</script>
"""


def panorama(path, width=256, height=128):
    """A sky of radiance 0.35 at the horizon and 0.8 overhead, a ground of 0.2, and a sun with a soft edge, 45° high,
    behind the camera to the right. Radiance HDR, without run lengths."""
    data = bytearray(b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % (height, width))
    sun = direction(0.4, 0.25)
    for y in range(height):
        for x in range(width):
            at = direction((x + 0.5) / width, (y + 0.5) / height)
            sky = 0.35 + 0.45 * max(at[1], 0.0)
            ground = 1.0 / (1.0 + math.exp(at[1] / 0.02))
            angle = math.acos(min(1.0, sum(a * b for a, b in zip(at, sun))))
            value = sky * (1.0 - ground) + 0.2 * ground + 5.0 * math.exp(-((angle / 0.26) ** 2))
            fraction, exponent = math.frexp(value)
            data += bytes([int(fraction * 256.0)] * 3 + [exponent + 128])
    path.write_bytes(data)


def direction(u, v):
    """Where a place of the panorama lies."""
    around, down = (u - 0.5) * 2.0 * math.pi, v * math.pi
    return math.cos(around) * math.sin(down), math.cos(down), math.sin(around) * math.sin(down)


def fetch(folder):
    """The package by npm, unpacked below `folder`."""
    subprocess.run(["npm", "pack", "--silent", f"{PACKAGE}@{VERSION}"], cwd=folder, check=True, stdout=subprocess.PIPE)
    with tarfile.open(next(folder.glob("*.tgz"))) as archive:
        archive.extractall(folder, filter="data")
    return folder / "package"


def mirror(source, target):
    """Links to all that lies in a folder. An empty texture ends the renderer's draw, so a white one stands in for it."""
    target.mkdir()
    for beside in source.iterdir():
        if beside.is_dir():
            mirror(beside, target / beside.name)
        elif beside.stat().st_size == 0:
            Image.new("RGB", (1, 1), "white").save(target / beside.name, "png")
        else:
            (target / beside.name).symlink_to(beside.resolve())


class Handler(http.server.SimpleHTTPRequestHandler):
    """Serves the folder, and takes what the page sends."""

    def do_POST(self):
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        kind, _, name = self.path.strip("/").partition("/")
        if kind == "picture":
            (self.server.out / f"{name}-khronos.png").write_bytes(body)
        elif kind == "error":
            self.server.errors[name] = body.decode()
        else:
            self.server.errors.update({"page": body.decode()} if body else {})
            self.server.ended.set()
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_):
        pass


def draw_all(files, out, size, package=None, browser="chromium", seconds=1800):
    """Draws `files` (name: path) to `out/NAME-khronos.png`; what went wrong, by name."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        package = package or fetch(folder)
        root = folder / "served"
        root.mkdir()
        (root / "package").symlink_to(pathlib.Path(package).resolve())
        for name, file in files.items():
            mirror(file.absolute().parent, root / name)
        panorama(root / "panorama.hdr")
        Image.new("RGB", (1, 1)).save(root / "sheen.png")
        served = json.dumps({name: f"{name}/{file.name}" for name, file in files.items()})
        page = PAGE.replace("WIDTH", str(size[0])).replace("HEIGHT", str(size[1])).replace("FILES", served)
        (root / "index.html").write_text(page)
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Handler, directory=root))
        server.out, server.errors, server.ended = out, {}, threading.Event()
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/index.html"
        command = [shutil.which(browser) or browser, *FLAGS, f"--user-data-dir={folder / 'profile'}", "--remote-debugging-port=0"]
        with open(folder / "said", "w+") as said:
            running = subprocess.Popen([*command, address], stdout=said, stderr=said)
            try:
                if not server.ended.wait(seconds):
                    said.seek(0)
                    raise SystemExit(f"the browser did not end: {said.read()[-2000:]}")
            finally:
                running.terminate()
                running.wait()
                server.shutdown()
        return server.errors


def main():
    args = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    args.add_argument("files", nargs="+", type=pathlib.Path)
    args.add_argument("--out", type=pathlib.Path, required=True)
    args.add_argument("--package", type=pathlib.Path)
    args.add_argument("--browser", default="chromium")
    args = args.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    files = {f"{i}-{file.parent.name}": file for i, file in enumerate(args.files)}
    for name, error in draw_all(files, args.out, (640, 320), args.package, args.browser).items():
        print(f"{name}: {error}")


if __name__ == "__main__":
    main()
