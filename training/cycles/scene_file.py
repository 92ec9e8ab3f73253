"""A glTF scene rendered with Blender's Cycles: the reference picture beside bouncelight's.

    pip install bpy==4.5.15                                   # Python 3.11
    cargo run --release --example export_scene -- interior out/interior.glb
    python training/cycles/scene_file.py out/interior.glb out/interior_reference.exr --world 0.3,0.4,0.5 --light-radius 0.05 --spp 1024
    python training/cycles/scene_file.py out/interior.glb data/cycles --views data/features/interior_views.json --size 256x128 --spp 32 --denoise 0
    python training/cycles/scene_file.py data/features data/cycles --size 256x128 --spp 32 --denoise 0    # every STEM.glb with its STEM_views.json

glTF has no field for the sky, a sun's angle or a lamp's radius, so they come as flags, as for `bouncelight render`.
The light settings are those of paper_rooms.py: 12 bounces, 4 diffuse, 4 glossy, indirect clamp 10. Only Combined is denoised.
"""
import argparse
import json
import os
import sys

import bpy
import mathutils

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import paper_rooms  # noqa: E402


def numbers(text):
    values = [float(t) for t in text.split(",")]
    return values * 3 if len(values) == 1 else values


def place(scene, view):
    """Sets the scene's camera to one of the views of a views.json."""
    camera = scene.camera.data
    camera.sensor_fit, camera.angle_y = "VERTICAL", view["yfov"]
    columns = view["world_from_camera"]
    y_up = mathutils.Matrix([[columns[c][r] for c in range(4)] for r in range(4)])
    # Blender's Z is up; a camera looks down its own -Z in both.
    scene.camera.parent = None
    scene.camera.matrix_world = mathutils.Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1))) @ y_up


def light_sizes(lights, radius, angle, record):
    """Sun angles and lamp radii: from the record, by name, else from the flags."""
    sizes = {l["name"]: l.get("radius", l.get("angle")) for l in (record or {}).get("lights", [])}
    for light in lights:
        size = sizes.get(light.name.split(".")[0], sizes.get(light.data.name.split(".")[0]))
        if light.data.type == "SUN":
            light.data.angle = angle if size is None else size
        else:
            light.data.shadow_soft_size = radius if size is None else size


def load(path, camera):
    """The scene of a glTF file, seen by its camera number `camera`."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=path)
    scene = bpy.context.scene
    cameras = [o for o in scene.objects if o.type == "CAMERA"]
    if camera >= len(cameras):
        sys.exit(f"{path}: {len(cameras)} cameras")
    scene.camera = cameras[camera]
    return scene


def prepare(scene, a, world, record=None):
    """Lights' sizes, sky and Cycles' settings."""
    light_sizes([o for o in scene.objects if o.type == "LIGHT"], a.light_radius, a.sun_angle, record)
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (*world, 1)
    paper_rooms.configure(scene, a.size, a.spp, 12, bool(a.denoise), a.unlimited)
    scene.cycles.seed = a.seed


def draw(scene, path):
    """Renders into a file, whole or not at all."""
    scene.render.filepath = os.path.abspath(path) + ".part.exr"
    bpy.ops.render.render(write_still=True)
    os.replace(scene.render.filepath, path)


def draw_views(a, file, views):
    """One EXR for each view of a views.json; those that exist are kept, and a scene that has all of them is not read."""
    with open(views) as f:
        record = json.load(f)
    stem = os.path.basename(views).removesuffix("_views.json")
    paths = [os.path.join(a.out, f"{stem}_view{i}.exr") for i in range(len(record["views"]))]
    if all(map(os.path.exists, paths)):
        return
    scene = load(file, a.camera)
    if any(o.type == "LIGHT" and o.data.type == "SPOT" for o in scene.objects):
        print(f"{file}: left out; Blender's spot lights fade towards the cone's edge in another way than glTF's", file=sys.stderr)
        return
    prepare(scene, a, record["environment"], record)
    for i, (view, path) in enumerate(zip(record["views"], paths)):
        if not os.path.exists(path):
            place(scene, view)
            scene.cycles.seed = a.seed + i
            draw(scene, path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene", help="a glTF file, or a folder of them with a views.json each")
    parser.add_argument("out", help="multi-layer EXR; a folder where there are views")
    parser.add_argument("--views", help="views.json of `bouncelight dataset`: one EXR a view, light sizes and sky taken from it")
    parser.add_argument("--size", default="1024x512", type=lambda t: tuple(map(int, t.split("x"))))
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--camera", type=int, default=0)
    parser.add_argument("--world", default=[0.0] * 3, type=numbers, help="radiance of the surroundings")
    parser.add_argument("--light-radius", type=float, default=0.0)
    parser.add_argument("--sun-angle", type=float, default=0.00918)
    parser.add_argument("--denoise", type=int, default=1, help="denoise the Combined layer")
    parser.add_argument("--unlimited", action="store_true", help="as in paper_rooms.py")
    parser.add_argument("--seed", type=int, default=0, help="of Cycles' random numbers")
    a = parser.parse_args()
    if os.path.isdir(a.scene):
        names = sorted(n for n in os.listdir(a.scene) if n.endswith("_views.json"))
        jobs = [(os.path.join(a.scene, n.removesuffix("_views.json") + ".glb"), os.path.join(a.scene, n)) for n in names]
        missing = [file for file, _ in jobs if not os.path.exists(file)]
        if missing or not jobs:
            sys.exit(f"{missing[0]} is missing; `bouncelight dataset --export` writes it" if missing else f"{a.scene}: no _views.json in it")
    elif a.views:
        jobs = [(a.scene, a.views)]
    else:
        scene = load(a.scene, a.camera)
        prepare(scene, a, a.world)
        draw(scene, a.out)
        return
    os.makedirs(a.out, exist_ok=True)
    for i, (file, views) in enumerate(jobs):
        draw_views(a, file, views)
        print(f"{i + 1} of {len(jobs)} scenes", file=sys.stderr, flush=True)


main()
