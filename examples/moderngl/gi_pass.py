"""The pass that `bouncelight export --target glsl430` wrote, run by OpenGL 4.3 through moderngl.

Knows nothing of any renderer: textures, a camera and a frame go in, light comes out.
"""

import json
import struct
from pathlib import Path

import moderngl
import numpy as np

# WebGPU's name of a format: components and moderngl's type.
FORMATS = {
    "r32float": (1, "f4"), "rg16float": (2, "f2"), "rgba16float": (4, "f2"), "rgba32float": (4, "f4"),
    "rgba8unorm": (4, "f1"), "rgba8unorm-srgb": (4, "f1"), "rgba32uint": (4, "u4"),
}


def camera_values(view, projection, depth="forward-gl"):
    """What the manifest calls `camera.NAME`, of row-major 4×4 matrices: view space (looking down −Z) from the world,
    and the projection that drew the picture whose first row is at the top.

    depth: "reversed" and "forward" for clip space 0 to w, "forward-gl" for −w to w."""
    view, p = np.asarray(view, np.float64), np.asarray(projection, np.float64)
    if p[3][2] != -1 or p[3][3] != 0:
        raise ValueError("the projection is not a perspective that looks down -Z")
    a, b = p[2][2], p[2][3]
    distance = (0.5 * b, 0.5 * (a - 1.0)) if depth == "forward-gl" else (b, a)
    background, step = (0.0, 0.0) if depth == "reversed" else (1.0, 6e-8)
    rotation = view[:3, :3]
    # The camera's frame without its tilt: horizontal right, up, horizontal backward.
    up, back = rotation[1], rotation[2]
    flat = back if np.hypot(back[0], back[2]) > 1e-3 else up * -np.sign(back[1])
    z = np.array([flat[0], 0.0, flat[2]])
    z /= np.linalg.norm(z)
    y = np.array([0.0, 1.0, 0.0])
    gravity = np.stack([np.cross(y, z), y, z])
    return {
        "unproject": [1 / p[0][0], 1 / p[1][1], p[0][2], p[1][2]],
        "depth": [*distance, background, step / abs(distance[0])],
        "gravity_from_view": (gravity @ rotation.T).T.ravel(),
        "gravity_from_world": gravity.T.ravel(),
        "world_from_view": rotation.ravel(),
        "eye": [*(-rotation.T @ view[:3, 3]), 0.0],
    }


class Pass:
    """Everything in `folder`, uploaded."""

    def __init__(self, ctx, folder):
        self.ctx, folder = ctx, Path(folder)
        self.manifest = m = json.loads((folder / "bouncelight.json").read_text())
        if m["schema"] not in (1, 2) or m["target"] != "glsl430":
            raise ValueError(f"{folder}: schema {m['schema']}, target {m['target']}; this host reads 1 and 2, glsl430")

        def content(row, size):
            return (folder / row["file"]).read_bytes() if "file" in row else bytes([row["fill"]]) * size

        self.buffers = {b["name"]: ctx.buffer(content(b, b["bytes"])) for b in m["buffers"]}
        self.textures = {}
        for row in m["textures"]:
            components, kind = FORMATS[row["format"]]
            width, height = row["size"]
            data = content(row, width * height * components * np.dtype(kind.replace("f1", "u1")).itemsize)
            texture = ctx.texture((width, height), components, data, alignment=1, dtype=kind)
            # Textures of integers are not complete with linear filters.
            texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
            self.textures[row["name"]] = texture
        self.shaders = [ctx.compute_shader((folder / s["file"]).read_text()) for s in m["shaders"]]
        self.k = self.cache_iteration = 0

    @property
    def output(self):
        """Light that direct lighting misses, E/π; rows from the top."""
        return self.textures["output"]

    @property
    def specular(self):
        """Radiance that specular lobes reflect of surroundings and bounces; rows from the top."""
        return self.textures["specular_output"]

    @property
    def sky(self):
        """Radiance of the surroundings, the mean if they are a picture."""
        return next(w["values"]["environment"] for w in self.manifest["frames"][0]["writes"] if w["type"] == "Params")[:3]

    def frame(self, camera, inputs, reset=False):
        """Records and runs a frame: `camera` of `camera_values`, `inputs` textures by the manifest's names, rows from
        the top. `reset`: the picture has nothing to do with the one before."""
        m = self.manifest
        self.k = 0 if reset else self.k
        steady = m["steady"]
        beyond = self.k - steady["from"]
        frame = m["frames"][self.k if beyond < 0 else steady["from"] + beyond % steady["period"]]
        for write in frame["writes"]:
            self._write(write, camera)
        for number in frame["dispatches"]:
            self._dispatch(m["dispatches"][number], inputs)
        self.k += 1
        self.cache_iteration += frame["cache_updates"]

    def _value(self, value, camera):
        if not isinstance(value, str):
            return value
        name, _, more = value.partition(" + ")
        if name.startswith("camera."):
            return camera[name.removeprefix("camera.")]
        return {"frame": self.k, "cache_iteration": self.cache_iteration}[name] + int(more or 0)

    def _write(self, write, camera):
        layout = self.manifest["uniforms"][write["type"]]
        data = bytearray(layout["bytes"])
        for member in layout["members"]:
            value, kind = self._value(write["values"][member["name"]], camera), member["type"]
            numbers = [value] if np.isscalar(value) else list(value)
            letter = "I" if "u32" in kind else "f"
            if kind.startswith("mat3x3"):
                numbers = [n for c in range(3) for n in (*numbers[3 * c : 3 * c + 3], 0.0)]
            elif kind.startswith("vec"):
                numbers = numbers[: int(kind[3])]
            struct.pack_into(f"{len(numbers)}{letter}", data, member["offset"],
                             *[int(n) if letter == "I" else float(n) for n in numbers])
        self.buffers[write["buffer"]].write(bytes(data), offset=write["offset"])

    def _dispatch(self, dispatch, inputs):
        shader = self.manifest["shaders"][dispatch["shader"]]
        for binding, bound in zip(shader["bindings"], dispatch["resources"], strict=True):
            name, slot, kind = bound["resource"], binding["slot"], binding["kind"]
            if kind == "texture":
                inputs.get(name, self.textures[name]).use(slot)
            elif kind == "storage-texture":
                self.textures[name].bind_to_image(slot, read=False, write=True)
            else:
                buffer = self.buffers[name]
                where = {"offset": bound.get("offset", 0), "size": bound.get("bytes", -1)}
                bind = buffer.bind_to_uniform_block if kind == "uniform" else buffer.bind_to_storage_buffer
                bind(slot, **where)
        self.shaders[dispatch["shader"]].run(*dispatch["workgroups"])
        self.ctx.memory_barrier()
