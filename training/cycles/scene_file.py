"""A glTF scene rendered with Blender's Cycles: the reference picture beside bouncelight's.

    pip install bpy==4.5.15                                   # Python 3.11
    cargo run --release --example export_scene -- interior out/interior.glb
    python training/cycles/scene_file.py out/interior.glb out/interior_reference.exr --world 0.3,0.4,0.5 --light-radius 0.05 --spp 1024

glTF has no field for the sky, a sun's angle or a lamp's radius, so they come as flags, as for `bouncelight render`.
The light settings are those of paper_rooms.py: 12 bounces, 4 diffuse, 4 glossy, indirect clamp 10. Only Combined is denoised.
"""
import argparse
import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import paper_rooms  # noqa: E402


def numbers(text):
    values = [float(t) for t in text.split(",")]
    return values * 3 if len(values) == 1 else values


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("out", help="multi-layer EXR")
    parser.add_argument("--size", default="1024x512", type=lambda t: tuple(map(int, t.split("x"))))
    parser.add_argument("--spp", type=int, default=256)
    parser.add_argument("--camera", type=int, default=0)
    parser.add_argument("--world", default=[0.0] * 3, type=numbers, help="radiance of the surroundings")
    parser.add_argument("--light-radius", type=float, default=0.0)
    parser.add_argument("--sun-angle", type=float, default=0.00918)
    parser.add_argument("--denoise", type=int, default=1, help="denoise the Combined layer")
    a = parser.parse_args()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=a.scene)
    scene = bpy.context.scene
    cameras = [o for o in scene.objects if o.type == "CAMERA"]
    if a.camera >= len(cameras):
        sys.exit(f"{a.scene}: {len(cameras)} cameras")
    scene.camera = cameras[a.camera]
    for light in (o.data for o in scene.objects if o.type == "LIGHT"):
        if light.type == "SUN":
            light.angle = a.sun_angle
        else:
            light.shadow_soft_size = a.light_radius
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (*a.world, 1)
    paper_rooms.configure(scene, a.size, a.spp, 12, bool(a.denoise))
    scene.render.filepath = os.path.abspath(a.out) + ".part.exr"
    bpy.ops.render.render(write_still=True)
    os.replace(scene.render.filepath, a.out)


main()
