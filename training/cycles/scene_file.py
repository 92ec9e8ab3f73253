"""A glTF scene rendered with Blender's Cycles: the reference picture beside bouncelight's.

    pip install bpy==4.5.15                                   # Python 3.11
    cargo run --release --example export_scene -- interior out/interior.glb
    python training/cycles/scene_file.py out/interior.glb out/interior_reference.exr --world 0.3,0.4,0.5 --light-radius 0.05 --spp 1024

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


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("out", help="multi-layer EXR, or a folder with --views")
    parser.add_argument("--views", help="views.json of `bouncelight dataset --recipe scene`: one EXR a view, light sizes and sky taken from it")
    parser.add_argument("--size", default="1024x512", type=lambda t: tuple(map(int, t.split("x"))))
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--camera", type=int, default=0)
    parser.add_argument("--world", default=[0.0] * 3, type=numbers, help="radiance of the surroundings")
    parser.add_argument("--light-radius", type=float, default=0.0)
    parser.add_argument("--sun-angle", type=float, default=0.00918)
    parser.add_argument("--denoise", type=int, default=1, help="denoise the Combined layer")
    parser.add_argument("--seed", type=int, default=0, help="of Cycles' random numbers")
    a = parser.parse_args()
    record = None
    if a.views:
        with open(a.views) as f:
            record = json.load(f)
        a.world = record["environment"]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=a.scene)
    scene = bpy.context.scene
    cameras = [o for o in scene.objects if o.type == "CAMERA"]
    if a.camera >= len(cameras):
        sys.exit(f"{a.scene}: {len(cameras)} cameras")
    scene.camera = cameras[a.camera]
    light_sizes([o for o in scene.objects if o.type == "LIGHT"], a.light_radius, a.sun_angle, record)
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (*a.world, 1)
    paper_rooms.configure(scene, a.size, a.spp, 12, bool(a.denoise))
    scene.cycles.seed = a.seed

    def draw(path):
        scene.render.filepath = os.path.abspath(path) + ".part.exr"
        bpy.ops.render.render(write_still=True)
        os.replace(scene.render.filepath, path)

    if not record:
        draw(a.out)
        return
    os.makedirs(a.out, exist_ok=True)
    stem = os.path.basename(a.views).removesuffix("_views.json")
    for i, view in enumerate(record["views"]):
        path = os.path.join(a.out, f"{stem}_view{i}.exr")
        if not os.path.exists(path):
            place(scene, view)
            scene.cycles.seed = i
            draw(path)


main()
