"""Flicker and turns, as flicker.py and turned.py measure them, of peers beside `gather`."""


def of(a, scene):
    return {}
