"""As much of glTF as this host draws: a GLB's triangles with constant or textured colour, its first camera, its lights.

Not read: metallic-roughness, normal and occlusion pictures, alpha, skins, animations.
"""

import io
import json
import struct
from pathlib import Path

import numpy as np
from PIL import Image

TYPES = {5121: "u1", 5123: "u2", 5125: "u4", 5126: "f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Scene:
    """draws: one dict for each primitive; lights: dicts; camera: world matrix, yfov, near."""

    def __init__(self, path):
        data = Path(path).read_bytes()
        size = struct.unpack_from("<I", data, 12)[0]
        self.json = json.loads(data[20 : 20 + size])
        self.bin = data[28 + size :]
        self.draws, self.lights, self.camera = [], [], None
        self.images = [self._image(i) for i in range(len(self.json.get("images", [])))]
        for node in self.json["nodes"]:
            if "children" in node:
                raise ValueError("this host reads scenes as `export_scene` writes them: nodes without children")
            world = np.array(node.get("matrix", np.eye(4).ravel()), np.float64).reshape(4, 4).T
            if "mesh" in node:
                self.draws += [self._draw(p, world) for p in self.json["meshes"][node["mesh"]]["primitives"]]
            if "camera" in node and self.camera is None:
                perspective = self.json["cameras"][node["camera"]]["perspective"]
                self.camera = {"world": world, "yfov": perspective["yfov"], "near": perspective["znear"]}
            light = node.get("extensions", {}).get("KHR_lights_punctual")
            if light:
                self._light(self.json["extensions"]["KHR_lights_punctual"]["lights"][light["light"]], world)

    def _view(self, index):
        view = self.json["bufferViews"][index]
        offset = view.get("byteOffset", 0)
        return self.bin[offset : offset + view["byteLength"]], view.get("byteStride")

    def _image(self, index):
        return Image.open(io.BytesIO(self._view(self.json["images"][index]["bufferView"])[0])).convert("RGBA")

    def _array(self, index):
        accessor = self.json["accessors"][index]
        kind, width = np.dtype(TYPES[accessor["componentType"]]), WIDTHS[accessor["type"]]
        data, stride = self._view(accessor["bufferView"])
        stride = stride or kind.itemsize * width
        start = accessor.get("byteOffset", 0)
        return np.ndarray((accessor["count"], width), kind, data, start, (stride, kind.itemsize)).copy()

    def _draw(self, primitive, world):
        at = primitive["attributes"]
        material = self.json["materials"][primitive["material"]]
        pbr = material.get("pbrMetallicRoughness", {})
        strength = material.get("extensions", {}).get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1)
        positions = self._array(at["POSITION"])
        texture = pbr.get("baseColorTexture")
        uvs = self._array(at["TEXCOORD_0"]) if "TEXCOORD_0" in at else np.zeros((len(positions), 2))
        return {
            "world": world,
            "vertices": np.hstack([positions, self._array(at["NORMAL"]), uvs]).astype("f4"),
            "indices": self._array(primitive["indices"]).astype("u4"),
            "color": pbr.get("baseColorFactor", [1, 1, 1, 1])[:3],
            "image": self.json["textures"][texture["index"]]["source"] if texture else None,
            "metallic": pbr.get("metallicFactor", 1),
            "roughness": pbr.get("roughnessFactor", 1),
            "emission": [strength * e for e in material.get("emissiveFactor", [0, 0, 0])],
        }

    def _light(self, light, world):
        # What stands for a glowing panel is found by rays. Lux and candela become W/m² and W/sr.
        if light.get("extras", {}).get("bouncelight", {}).get("is_emissive_proxy"):
            return
        strength = np.array(light.get("color", [1, 1, 1])) * light["intensity"] / 683
        self.lights.append({"kind": light["type"], "strength": strength, "place": world[:3, 3], "back": world[:3, 2]})

    def bounds(self):
        """Lowest and highest corner of all triangles."""
        corners = [d["vertices"][:, :3] @ d["world"][:3, :3].T + d["world"][:3, 3] for d in self.draws]
        all_of_them = np.concatenate(corners)
        return all_of_them.min(0), all_of_them.max(0)
