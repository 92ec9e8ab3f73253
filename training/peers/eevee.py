"""Blender's Eevee Next on a scene, by bpy without a window: `python -m peers.eevee SOURCE OUT.exr [--probes 600]`.

Its lengths are thresholds in metres, so a scene in other units is scaled to them. Rays are traced on the screen at full resolution for all
roughnesses, horizon scans (Fast GI) do the rest; with --probes a volume of about so many light probes over the whole scene is baked first. The first
sample compiles shaders; it is drawn before the clock starts. `OUT.exr.json` has the times.
"""
import argparse
import json
import math
import os
import sys
import time

import bpy
from mathutils import Matrix, Vector

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "cycles"))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import paper_rooms  # noqa: E402
import real_scene  # noqa: E402
from bouncelight_training.stream import SKY_RADIANCE, rooms_of_stream  # noqa: E402


def load(source):
    """The scene of a room's index or of a folder. A folder whose meta.json has no eye has camera and lights in its file."""
    if not os.path.isdir(source):
        return paper_rooms.build(rooms_of_stream({int(source)})[int(source)], SKY_RADIANCE, 1.0)[0]
    with open(os.path.join(source, "meta.json")) as file:
        meta = json.load(file)
    if "eye" in meta:
        return real_scene.load(source)[0]
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=os.path.join(source, "scene.glb"))
    scene = bpy.context.scene
    scene.camera = next(o for o in scene.objects if o.type == "CAMERA")
    scene.camera.data.sensor_fit = "VERTICAL"
    scene.camera.data.angle = math.radians(meta["fov"])
    for light in (o.data for o in scene.objects if o.type == "LIGHT"):
        if light.type == "SUN":
            light.angle = 0.00918
        else:
            light.shadow_soft_size = meta["light_radius"]
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (*meta["world"], 1)
    return scene


def in_metres(scene, scale):
    """Everything times `scale` about the origin, so that lengths are metres; lamps keep what they shine on surfaces."""
    bpy.context.view_layer.update()
    for thing in [o for o in scene.objects if not o.parent]:
        thing.matrix_world = Matrix.Scale(scale, 4) @ thing.matrix_world
    for thing in scene.objects:
        if thing.type == "CAMERA":
            thing.data.clip_start *= scale
            thing.data.clip_end *= scale
        elif thing.type == "LIGHT" and thing.data.type != "SUN":
            thing.data.energy *= scale**2
            thing.data.shadow_soft_size *= scale
    bpy.context.view_layer.update()


def configure(scene, size, samples):
    scene.render.engine = "BLENDER_EEVEE_NEXT"
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.resolution_percentage = 100
    eevee = scene.eevee
    eevee.taa_render_samples, eevee.use_shadows, eevee.use_raytracing, eevee.ray_tracing_method = samples, True, True, "SCREEN"
    eevee.ray_tracing_options.resolution_scale, eevee.ray_tracing_options.trace_max_roughness = "1", 1.0
    eevee.use_fast_gi, eevee.fast_gi_method, eevee.fast_gi_resolution, eevee.fast_gi_distance = True, "GLOBAL_ILLUMINATION", "1", 0
    layer, settings = scene.view_layers[0], scene.render.image_settings
    layer.use_pass_z = layer.use_pass_diffuse_color = layer.use_pass_diffuse_direct = True
    settings.file_format, settings.color_depth, settings.exr_codec = "OPEN_EXR_MULTILAYER", "32", "ZIP"


def bake(scene, probes, samples):
    """A volume of light probes over the scene; the grid, and the seconds of wall and processor."""
    bpy.context.view_layer.update()
    corners = [o.matrix_world @ Vector(c) for o in scene.objects if o.type == "MESH" for c in o.bound_box]
    low, high = (Vector(f(c[i] for c in corners) for i in range(3)) for f in (min, max))
    data = bpy.data.lightprobes.new("volume", "VOLUME")
    volume = bpy.data.objects.new("volume", data)
    scene.collection.objects.link(volume)
    span = high - low
    step = (span.x * span.y * span.z / probes) ** (1 / 3)
    grid = [max(2, min(64, round(v / step))) for v in span]
    data.resolution_x, data.resolution_y, data.resolution_z = grid
    # The outermost cell of a volume fades into the sky, so it lies outside of the walls.
    volume.location, volume.scale = (low + high) / 2, Vector(v / 2 * (1 + 2 / n) for v, n in zip(span, grid))
    # Surfels a metre: about 60,000 over walls of this size, at most 20. Blender counts them in units of the volume, which is 2 wide.
    surfels = min(20, math.sqrt(6e4 / (2 * (span.x * span.y + span.y * span.z + span.z * span.x))))
    data.surfel_density = max(1, round(surfels * max(volume.scale)))
    data.bake_samples, data.clamp_indirect, data.capture_world, data.capture_distance = samples, 0, True, span.length
    bpy.context.view_layer.objects.active = volume
    volume.select_set(True)
    start, work = time.time(), time.process_time()
    for _ in range(8):
        try:
            bpy.ops.object.lightprobe_cache_bake(subset="ALL")
            break
        except RuntimeError:  # Too many for its memory.
            surfels *= 0.7
            data.surfel_density = max(1, round(surfels * max(volume.scale)))
    return {"grid": grid, "surfels_a_metre": surfels, "bake_s": time.time() - start, "bake_cpu_s": time.process_time() - work}


def draw(scene, path, samples):
    """Renders into a file, whole or not at all; seconds of wall and processor."""
    scene.eevee.taa_render_samples = samples
    scene.render.filepath = os.path.abspath(path) + ".part.exr"
    start, work = time.time(), time.process_time()
    bpy.ops.render.render(write_still=True)
    os.replace(scene.render.filepath, path)
    return {"wall_s": time.time() - start, "cpu_s": time.process_time() - work}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source", help="a room's index, or a folder with scene.glb and meta.json")
    parser.add_argument("out")
    parser.add_argument("--size", default=[512, 256], type=lambda t: [int(n) for n in t.split("x")])
    parser.add_argument("--samples", type=int, default=16)
    parser.add_argument("--scale", type=float, default=1.0, help="metres in a unit of the scene")
    parser.add_argument("--probes", type=int, default=0, help="about so many light probes; none: screen only")
    parser.add_argument("--bake-samples", type=int, default=256)
    parser.add_argument("--turns", default=[], type=lambda t: [float(n) for n in t.split(",")],
                        help="also draw these turns of the camera about the vertical, degrees, into OUT_DEGREES.exr")
    a = parser.parse_args()
    scene = load(a.source)
    if a.scale != 1:
        in_metres(scene, a.scale)
    configure(scene, a.size, a.samples)
    record = {"version": bpy.app.version_string, "samples": a.samples}
    record |= bake(scene, a.probes, a.bake_samples) if a.probes else {}
    record["first_s"] = draw(scene, a.out + ".first.exr", 1)["wall_s"]
    os.remove(a.out + ".first.exr")
    record |= draw(scene, a.out, a.samples)
    settled = scene.camera.matrix_world.copy()
    for degrees in a.turns:
        scene.camera.matrix_world = Matrix.Translation(settled.translation) @ Matrix.Rotation(math.radians(degrees), 4, "Z") @ Matrix.Translation(-settled.translation) @ settled
        draw(scene, f"{a.out.removesuffix('.exr')}_{degrees:g}.exr", a.samples)
    with open(a.out + ".times", "w") as file:
        json.dump(record, file)


if __name__ == "__main__":
    main()
