"""python main.py EXPORT SCENE.glb OUT.png [--frames 64] [--beside]: draws the scene with this folder's own OpenGL renderer
and the light that the exported pass finds."""

import argparse

import moderngl
import numpy as np
from PIL import Image

from gi_pass import Pass, camera_values
from renderer import Renderer
from scene import Scene


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("export")
    parser.add_argument("scene")
    parser.add_argument("out")
    parser.add_argument("--frames", type=int, default=64)
    parser.add_argument("--beside", action="store_true", help="the same without the pass to the left")
    args = parser.parse_args()
    ctx = moderngl.create_standalone_context(backend="egl", require=430)
    gi = Pass(ctx, args.export)
    renderer = Renderer(ctx, Scene(args.scene), tuple(gi.manifest["size"]))
    for _ in range(args.frames):
        view, projection = renderer.camera()
        inputs = renderer.draw(view, projection)
        gi.frame(camera_values(view, projection), inputs)
    picture = renderer.show(gi)
    if args.beside:
        picture = np.hstack([renderer.show(gi, light=False), picture])
    Image.fromarray(picture).save(args.out)
    print(f"{args.out}: {args.frames} frames of {gi.manifest['method']} by {ctx.info['GL_RENDERER']}")


if __name__ == "__main__":
    main()
