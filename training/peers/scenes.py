"""The scenes on which peers are judged: real ones, the paper's rooms, the bundled interior."""
import os
import re
from dataclasses import dataclass

import judge

SIZE = "512x256"


@dataclass
class Scene:
    name: str
    #: The scene and its flags for `bouncelight`.
    words: list
    reference: str
    #: For Blender: a folder with scene.glb and meta.json, or a room's index.
    source: str
    #: Whether the reference has light that gloss throws onto diffuse surfaces.
    caustics: bool

    @property
    def method(self):
        """`gather` that shows the light that the reference has."""
        return "gather" if self.caustics else "gather+caustics=0"


def all_scenes(folders, fine=(), interior=None):
    """Scenes of folders of references: a folder a scene, roomIIII_view0.exr, interior.exr (whose scene is the folder `interior`). Those of
    which `fine` has a reference are judged by it."""
    for folder in folders:
        for _, name, words, reference in judge.references(folder):
            room = re.fullmatch(r"room(\d+)_view0", name)
            better = [path for path in (os.path.join(f, name, "frame0000.exr") for f in fine) if os.path.exists(path)]
            reference = better[0] if better else reference
            yield Scene(f"room {int(room[1])}" if room else name, words, reference, room[1] if room else os.path.join(folder, name), bool(room))
        path = os.path.join(folder, "interior.exr")
        if os.path.exists(path):
            yield Scene("interior", ["interior"], path, interior, True)


def layers_of(found):
    """Layers of our pictures, Cycles' or Eevee's, the finished picture always as R, G, B."""
    return found | {c: found[f"Combined.{c}"] for c in "RGB" if f"Combined.{c}" in found}


def layers(path):
    return layers_of(judge.layers(path))


#: Metres in a unit of files that have another.
METRES = {"hotel": 0.001, "city": 0.01}
