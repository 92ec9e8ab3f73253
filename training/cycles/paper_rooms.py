"""Paper rooms rendered with Blender's Cycles: the targets that the network is trained on.

    pip install bpy==4.5.15                                   # Python 3.11
    python training/cycles/paper_rooms.py OUT --rooms 6-9,13,15-26 [--views 8] [--size 256x128] [--spp 32]
    python training/cycles/paper_rooms.py OUT --rooms 2200-2239 --views 1 --size 1024x512 --spp 64 --denoise --judge

Room INDEX is scene INDEX of the stream that the paper's authors seeded with 0 (what `bouncelight` calls
`paper-room:INDEX`); view V turns the camera by V * 360/views degrees about the vertical. Each view becomes
OUT/roomIIII_viewV.exr (half floats, lossless, Blender's pass names, nothing denoised unless --denoise) with the light's diffuse
layers. A file that exists is kept, so a killed run goes on where it stopped. Rooms kept for judging are refused
unless --judge says that this is what they are rendered for.

All objects of one shape share one mesh and differ by object-level material, which makes building a room a matter
of a second instead of ten; the geometry is the same as with one mesh each.
"""
import argparse
import math
import os
import sys
import time

import bpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from bouncelight_training.stream import SHAPES, SKY_RADIANCE, indices, is_judged, rooms_of_stream  # noqa: E402

SUN_EULER = (0.2844221, -0.1549496, -4.8111577)


def principled(name, rgb):
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    bsdf = material.node_tree.nodes["Principled BSDF"]
    bsdf.inputs["Base Color"].default_value = (*rgb, 1)
    bsdf.inputs["Roughness"].default_value = 0.5
    return material


def shape_meshes():
    meshes = {}
    for shape in SHAPES:
        getattr(bpy.ops.mesh, f"primitive_{shape}_add")()
        meshes[shape] = bpy.context.object.data
        # Object-level materials need a slot on the mesh to override.
        meshes[shape].materials.append(None)
        bpy.data.objects.remove(bpy.context.object)
    return meshes


def add(scene, name, mesh, colour, location, rotation, scale=(1, 1, 1)):
    obj = bpy.data.objects.new(name, mesh)
    scene.collection.objects.link(obj)
    obj.location, obj.rotation_euler, obj.scale = location, rotation, scale
    obj.material_slots[0].link = "OBJECT"
    obj.material_slots[0].material = principled(name, colour)


def build(room, sky, light):
    objects, walls, pitch, yaw = room
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    meshes = shape_meshes()
    for i, (shape, location, rotation, colour) in enumerate(objects):
        add(scene, f"{shape}_{i:03}", meshes[shape], colour, location, rotation)
    placed = [((-50, 0, 25), 90), ((0, -50, 25), 0), ((0, 50, 25), 0), ((50, 0, 25), 90)]
    for i, (location, turn) in enumerate(placed):
        add(scene, f"wall_{i}", meshes["cube"], walls[i], location, (0, 0, math.radians(turn)), (50, 1, 25))
    add(scene, "floor", meshes["cube"], walls[4], (0, 0, 0), (0, 0, 0), (50, 50, 1))
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy, sun.angle = light, 0.00918
    sun_object = bpy.data.objects.new("sun", sun)
    sun_object.rotation_euler = SUN_EULER
    scene.collection.objects.link(sun_object)
    world = bpy.data.worlds.new("world")
    scene.world = world
    world.use_nodes = True
    world.node_tree.nodes["Background"].inputs[0].default_value = (sky,) * 3 + (1,)
    camera = bpy.data.cameras.new("camera")
    camera.lens, camera.sensor_width, camera.clip_start, camera.clip_end = 30, 36, 0.1, 100
    camera_object = bpy.data.objects.new("camera", camera)
    camera_object.location, camera_object.rotation_mode = (0, 0, 10), "XYZ"
    camera_object.rotation_euler = (pitch, 0, yaw)
    scene.collection.objects.link(camera_object)
    scene.camera = camera_object
    return scene, camera_object, yaw


def configure(scene, size, spp, bounces, denoise=False, unlimited=False, layers=True):
    """`denoise`: False, True, or "fast", three seconds a megapixel instead of eight and 2 dB nearer to the noise. `layers`: whether more than the picture is written."""
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    scene.render.use_persistent_data = True
    cycles = scene.cycles
    cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling = spp, bool(denoise), False
    if denoise:
        cycles.denoiser = "OPENIMAGEDENOISE"
    if denoise == "fast":
        cycles.denoising_quality, cycles.denoising_prefilter = "BALANCED", "FAST"
    cycles.max_bounces, cycles.diffuse_bounces, cycles.glossy_bounces = min(bounces, 12), min(bounces, 4), min(bounces, 4)
    cycles.sample_clamp_indirect = 10
    if unlimited:  # The light itself: what the limits above take away is up to a tenth of it in bright rooms.
        cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 128
        cycles.sample_clamp_indirect = cycles.blur_glossy = 0
    layer = scene.view_layers[0]
    for use in ("z", "normal", "diffuse_color", "diffuse_direct", "diffuse_indirect", "glossy_color", "glossy_direct", "glossy_indirect"):
        setattr(layer, f"use_pass_{use}", layers)
    settings = scene.render.image_settings
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "16", "ZIP"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out")
    parser.add_argument("--rooms", required=True, type=indices, help="stream indices, such as 6-9,13")
    parser.add_argument("--views", type=int, default=8, help="how many directions the full turn is cut into")
    parser.add_argument("--only-view", type=int, help="render this one of the views alone")
    parser.add_argument("--size", default="256x128", type=lambda t: tuple(map(int, t.split("x"))))
    parser.add_argument("--spp", type=int, default=32)
    parser.add_argument("--sky", type=float, default=SKY_RADIANCE, help="world radiance")
    parser.add_argument("--bounces", type=int, default=12, help="0 leaves direct light only")
    parser.add_argument("--unlimited", action="store_true", help="128 bounces, no clamp, no \"Filter Glossy\": the light itself")
    parser.add_argument("--denoise", action="store_true", help="denoise the Combined layer (no other)")
    parser.add_argument("--seed", type=int, default=0, help="added to the seed of Cycles' random numbers: another one gives the same picture with other noise")
    parser.add_argument("--judge", action="store_true", help="allow the rooms kept for judging")
    a = parser.parse_args()
    kept = [i for i in a.rooms if is_judged(i)]
    if kept and not a.judge:
        sys.exit(f"rooms {kept} are kept for judging; pass --judge if that is what they are rendered for")
    os.makedirs(a.out, exist_ok=True)
    views = range(a.views) if a.only_view is None else [a.only_view]
    for index, room in rooms_of_stream(set(a.rooms)).items():
        path = lambda v: os.path.join(a.out, f"room{index:04}_view{v}.exr")
        todo = [v for v in views if not os.path.exists(path(v))]
        if not todo:
            continue
        scene, camera, yaw = build(room, a.sky, 1.0)
        configure(scene, a.size, a.spp, a.bounces, a.denoise, a.unlimited)
        scene.cycles.seed = index + a.seed
        for view in todo:
            start = time.time()
            camera.rotation_euler[2] = yaw + 2 * math.pi * view / a.views
            scene.render.filepath = path(view) + ".part.exr"
            bpy.ops.render.render(write_still=True)
            os.replace(path(view) + ".part.exr", path(view))
            print(f"room {index} view {view}: {time.time() - start:.1f} s", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
