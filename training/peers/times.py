"""Times of a frame of `gather` and of a path a pixel, on the same machine and size."""
import json
import os
import resource
import subprocess

from peers import paths, scenes


def _spent(job):
    """What a job returns, and the processor seconds of the programs that it ran."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    result = job()
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return result, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def _bench(program, scene, warmup, frames, path):
    words = [program, "bench", *scene.words, "--size", scenes.SIZE, "--method", "gather", "--warmup", str(warmup), "--frames", str(frames), "--json", path, "-q"]
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
    with open(path) as file:
        return json.load(file)["methods"][0]["wall_ms"]["median"] / 1e3


def of(program, scene, out):
    """Seconds of wall and processor. Starting costs the same for few and many, so processor time is told by their difference. `rest`: the median of frames 17
    to 21 of a still camera; `cut`: the mean of the frames from the third on."""
    path, picture = os.path.join(out, "bench.json"), os.path.join(out, "timed.exr")
    _, few = _spent(lambda: _bench(program, scene, 1, 1, path))
    wall, many = _spent(lambda: _bench(program, scene, 16, 5, path))
    one, less = _spent(lambda: paths.traced(program, scene, 1, picture))
    four, more = _spent(lambda: paths.traced(program, scene, 4, picture))
    return {"frame_s": wall, "frame_cpu_s": (many - few) / 19, "path_s": (four - one) / 3, "path_cpu_s": (more - less) / 3}
