"""Light at the same places from two cameras, on a made-up wall: what stays on it does not change, what stays in the picture does; and noise that
two measurements do not share is no flicker."""
import os
import sys
import unittest

import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
import flicker  # noqa: E402
import turned  # noqa: E402

META = {"eye": [0, 0, 5], "target": [0, 0, 0], "fov": 40.0}
H, W = 64, 128


def wall(degrees, light_of, aside=0.0):
    """Layers of the wall z = 0 from a camera turned by so many degrees; `light_of(place, row, column)`. The places are of samples so many pixels
    `aside` of the centres."""
    _, (eye, right, up, forward, tangent) = turned.camera_of(META, degrees)
    row, column = np.mgrid[0:H, 0:W]
    u, v = 2 * (column + 0.5) / W - 1, 1 - 2 * (row + 0.5) / H
    def at(u):
        ray = forward + u[..., None] * tangent * W / H * right + v[..., None] * tangent * up
        return eye - ray * (eye[2] / ray[..., 2:])

    light, place = light_of(at(u), row, column), at(u + 2 * aside / W)
    layers = {"Depth.Z": np.full((H, W), 5.0)}
    for i, (axis, colour) in enumerate(zip("XYZ", "RGB")):
        layers[f"Position.{axis}"], layers[f"Normal.{axis}"] = place[..., i], np.full((H, W), float(i == 2))
        layers[f"DiffCol.{colour}"], layers[f"DiffInd.{colour}"], layers[colour] = np.full((H, W), 0.5), light, light
    return layers


def cameras_to(degrees):
    return [turned.camera_of(META, d)[1] for d in (0, degrees)]


class Turned(unittest.TestCase):
    def test_light_that_stays_on_the_wall_does_not_change_and_light_of_the_picture_does(self):
        cameras = cameras_to(5)
        on_wall = lambda place, row, column: 1 + 0.5 * np.sin(2 * place[..., 0])
        in_picture = lambda place, row, column: 1 + 0.5 * np.sin(column / 8)
        still, bias, share = turned.changed(wall(0, on_wall), wall(5, on_wall), cameras)
        self.assertLess(still, 1e-3)
        self.assertLess(abs(bias), 1e-3)
        self.assertGreater(share, 0.7)
        self.assertGreater(turned.changed(wall(0, in_picture), wall(5, in_picture), cameras)[0], 0.1)
        self.assertGreater(turned.changed(wall(0, on_wall), wall(5, on_wall), cameras, shift=8)[0], 0.05)

    def test_samples_aside_of_their_pixels_are_no_change(self):
        cameras = cameras_to(5)
        on_wall = lambda place, row, column: 1 + 0.5 * np.sin(2 * place[..., 0])
        first, second = wall(0, on_wall, aside=0.5), wall(5, on_wall, aside=-0.5)
        self.assertLess(turned.changed(first, second, cameras)[0], 1e-3)
        # Negative control: light that is aside itself.
        moved = lambda place, row, column: on_wall(place + [0.03, 0, 0], row, column)
        self.assertGreater(turned.changed(wall(0, on_wall), wall(5, moved), cameras)[0], 1e-2)

    def test_another_colour_is_another_surface(self):
        cameras = cameras_to(5)
        other = wall(5, lambda place, row, column: np.ones((H, W)))
        for colour in "RGB":
            other[f"DiffCol.{colour}"] = np.full((H, W), 0.9)
        first = wall(0, lambda place, row, column: np.ones((H, W)))
        self.assertFalse(turned.at_both(first, other, cameras, flicker.picture)[2].any())

    def test_noise_of_two_measurements_is_no_flicker(self):
        cameras = cameras_to(1)
        rng = np.random.default_rng(1)
        noisy = lambda change: lambda place, row, column: 1 + change * np.sin(40 * place[..., 0]) + 0.2 * rng.normal(size=(H, W))

        def flickers(change):
            twice = [flicker.change(wall(0, noisy(0.0)), wall(1, noisy(change)), cameras) for _ in range(2)]
            return flicker.size(*twice), flicker.size(twice[0])

        # 0.2 over means of 16 pixels, in both pictures.
        none, with_noise = flickers(0.0)
        self.assertGreater(with_noise, 0.03)
        self.assertLess(none, 0.5 * with_noise)
        some, _ = flickers(1.0)
        self.assertGreater(some, 1.5 * with_noise)


if __name__ == "__main__":
    unittest.main()
