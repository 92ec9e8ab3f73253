"""python test.py EXPORT SCENE SCENE.glb YARDSTICK [FRAMES]: draws frames with this folder's renderer and a camera that moves, runs the
exported pass on them, has the Rust pass run on the same bytes (YARDSTICK is `yardstick.rs`, built), and compares. Then the same
with mistakes, each of which must be noticed."""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import moderngl
import numpy as np

from gi_pass import Pass, camera_values
from renderer import Renderer
from scene import Scene

# What of the textures the Rust pass is given, as bytes of the formats in `yardstick.rs`.
INPUTS = ["depth", "normal", "albedo", "emissive", "direct", "motion", "specular"]
# Of the tonemapped light: the mean must be within a step of 8 bits, and so must this share of all numbers.
STEP, SHARE = 1 / 255, 0.99


def tonemapped(light):
    v = np.maximum(light[..., :3].astype("f8"), 0)
    return (v / (1 + v)) ** (1 / 2.2)


class Drawn:
    """Frames as this host drew them, kept as bytes."""

    def __init__(self, ctx, scene, size, count):
        renderer = Renderer(ctx, scene, size)
        self.ctx, self.size, self.frames = ctx, size, []
        for k in range(count):
            # Sideways and forth, with a stop at the end.
            shift = (0.02 * min(k, count // 2), 0.0, -0.01 * min(k, count // 2))
            view, projection = renderer.camera(shift)
            inputs = renderer.draw(view, projection)
            self.frames.append((view, projection, {n: inputs[n].read(alignment=1) for n in INPUTS}))

    def write(self, folder):
        columns = lambda matrix: np.asarray(matrix).T.tolist()
        cameras = [{"view_from_world": columns(v), "clip_from_view": columns(p)} for v, p, _ in self.frames]
        (folder / "inputs.json").write_text(json.dumps({"size": self.size, "frames": cameras}))
        for k, (_, _, textures) in enumerate(self.frames):
            for name, data in textures.items():
                (folder / f"{k}.{name}").write_bytes(data)

    def textures(self):
        """One texture for each input."""
        ctx, size = self.ctx, self.size
        kinds = {"depth": (1, "f4"), "normal": (2, "f2"), "motion": (2, "f2"), "specular": (4, "f1")}
        made = {}
        for name in INPUTS:
            components, kind = kinds.get(name, (4, "f2"))
            made[name] = ctx.texture(size, components, alignment=1, dtype=kind)
            made[name].filter = (moderngl.NEAREST, moderngl.NEAREST)
        return made

    def run(self, export, flipped=False, depth="forward-gl", break_manifest=None):
        """The exported pass's light after the last frame; optionally with a mistake."""
        gi = Pass(self.ctx, export)
        if break_manifest:
            break_manifest(gi.manifest)
        textures = self.textures()
        for view, projection, data in self.frames:
            for name, texture in textures.items():
                rows = np.frombuffer(data[name], "u1").reshape(self.size[1], -1)
                texture.write((rows[::-1] if flipped else rows).tobytes(), alignment=1)
            gi.frame(camera_values(view, projection, depth), textures)
        light = np.frombuffer(gi.output.read(alignment=1), "f2").reshape(self.size[1], self.size[0], 4)
        return light[::-1] if flipped else light


def differences(a, b):
    error = np.abs(tonemapped(a) - tonemapped(b))
    return error.mean(), (error <= STEP).mean(), error.max()


def main():
    export, name, glb, yardstick = sys.argv[1:5]
    # Half of them in motion, where rounding decides which rays count as a change: after 8 in all a hundredth of the
    # numbers is more than a step off, after 16 two thousandths.
    count = int(sys.argv[5]) if len(sys.argv) > 5 else 16
    ctx = moderngl.create_standalone_context(backend="egl", require=430)
    manifest = json.loads((Path(export) / "bouncelight.json").read_text())
    drawn = Drawn(ctx, Scene(glb), tuple(manifest["size"]), count)
    with tempfile.TemporaryDirectory() as folder:
        drawn.write(Path(folder))
        rust = []
        for _ in range(2):
            subprocess.run([yardstick, name, manifest["method"], folder], check=True)
            light = np.fromfile(Path(folder) / "rust.output", "f2").reshape(drawn.size[1], drawn.size[0], 4)
            rust.append(light)
    failed = []

    def judge(what, light, right):
        mean, share, most = differences(light, rust[0])
        good = mean <= STEP and share >= SHARE and np.isfinite(light).all()
        verdict = "as it should" if good == right else "WRONG"
        print(f"{manifest['method']}, {what}: mean {255 * mean:.3f}/255, {100 * share:.2f} % within 1/255, "
              f"most {255 * most:.1f}/255: {'passes' if good else 'fails'}, {verdict}")
        if good != right:
            failed.append(what)

    def unbound(manifest):
        # Means are written elsewhere than where the next frame reads them.
        for dispatch in manifest["dispatches"]:
            shader = manifest["shaders"][dispatch["shader"]]
            for binding, bound in zip(shader["bindings"], dispatch["resources"]):
                if dispatch["label"] == "gi.accumulate" and binding["name"] == "history_next":
                    bound["resource"] = "records"

    lit = tonemapped(rust[0]).mean()
    print(f"{manifest['method']}: {count} frames, tonemapped light of the Rust pass is {lit:.3f} in the mean")
    assert lit > 0.05, "there is light to compare"
    judge("the Rust pass a second time", rust[1], True)
    judge("the exported pass", drawn.run(export), True)
    judge("control, rows from the bottom", drawn.run(export, flipped=True), False)
    judge("control, depth taken for clip space 0 to 1", drawn.run(export, depth="forward"), False)
    judge("control, a binding swapped", drawn.run(export, break_manifest=unbound), False)
    sys.exit(f"failed: {', '.join(failed)}" if failed else 0)


if __name__ == "__main__":
    main()
