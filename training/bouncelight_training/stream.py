"""The paper's rooms as random numbers: what the authors' script drew for each scene, in its order, after `random.seed(0)`.

No Blender in here: cycles/paper_rooms.py builds the rooms, `camera` says where they are looked at from.
"""
import math
import random

SHAPES = ["cube", "cylinder", "cone", "uv_sphere", "ico_sphere", "torus"]
JUDGED = {0, 1, 10, 11, 12, 14, 27, 33, 37, 47}
FIRST_JUDGED = 2200
SKY_RADIANCE = 0.05087609
# Half the sensor's width over the focal length: 36 mm and 30 mm.
HALF_WIDTH = 0.6
EYE_HEIGHT = 10.0


def is_judged(room):
    """Whether a room is kept for judging; nothing is trained or tuned on it."""
    return room in JUDGED or room >= FIRST_JUDGED


def draw_room(rng):
    """One room's random numbers, in the order in which the authors' recipe draws them: objects, walls, pitch and yaw (radians)."""
    objects = []
    for _ in range(rng.randint(50, 250)):
        location = (rng.randint(-50, 50), rng.randint(-50, 50), rng.randint(2, 15))
        rotation = tuple(math.pi * rng.randint(0, 360) / 180 for _ in range(3))
        colour = tuple(rng.uniform(0, 1) for _ in range(3))
        objects.append((SHAPES[rng.randint(0, 5)], location, rotation, colour))
    walls = [tuple(rng.uniform(0, 1) for _ in range(3)) for _ in range(5)]
    pitch = math.pi / 2 - math.pi * rng.randint(0, 10) / 180
    yaw = math.pi * rng.randint(0, 360) / 180
    return objects, walls, pitch, yaw


def rooms_of_stream(wanted):
    """The rooms with the wanted indices; the stream has to be drawn from its start."""
    rng = random.Random(0)
    return {i: room for i in range(max(wanted) + 1) for room in [draw_room(rng)] if i in wanted}


def camera(room, turn, size):
    """Eye, a point looked at (metres, Y up) and the vertical field of view (degrees) of a room's camera, turned about the
    vertical by `turn` of a full turn, for pictures of `size` (width, height)."""
    _, _, pitch, yaw = room
    yaw += 2 * math.pi * turn
    ahead = (-math.sin(yaw) * math.sin(pitch), -math.cos(pitch), -math.cos(yaw) * math.sin(pitch))
    eye = (0.0, EYE_HEIGHT, 0.0)
    return eye, tuple(e + 10 * a for e, a in zip(eye, ahead)), math.degrees(2 * math.atan(HALF_WIDTH * size[1] / size[0]))


def indices(text):
    """Room numbers of "6-9,13", in order."""
    out = []
    for part in text.split(","):
        low, _, high = part.partition("-")
        out += range(int(low), int(high or low) + 1)
    return out
