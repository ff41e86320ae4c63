"""Mechanisms as STEP assemblies, drawn at a position, and what their parts are in closed form."""

from __future__ import annotations

import math

import numpy as np

from exchange.step_files import StepFile, box, prism, turn

STILL = (np.eye(3), np.zeros(3))


def placed(parts, rotation=None, shift=(0, 0, 0)):
    """Parts {name: (shape, matrix, shift)} turned and shifted as a whole."""
    rotation = np.eye(3) if rotation is None else rotation
    return {
        name: (shape, rotation @ matrix, rotation @ np.array(at, float) + np.array(shift, float))
        for name, (shape, matrix, at) in parts.items()
    }


def written(path, parts, unit="mm", **options):
    """A STEP file of an assembly."""
    file = StepFile(unit, **options)
    file.assembly("mechanism", *((file.part(name, shape), *place) for name, (shape, *place) in parts.items()))
    return file.write(path)


def bar(length, holes, low, high, width=15.0, split="seam"):
    """A plate from (0, 0) to (length, 0) with through holes [(x, diameter)]."""
    shape = box((-width, -width, low), (length + width, width, high), split)
    for x, diameter in holes:
        shape.feature("bottom", (x, 0, low), [(diameter / 2, 0), (diameter / 2, low - high)], "top")
    return shape


def boss(shape, face, point, diameter, length):
    """A pin on a face."""
    return shape.feature(face, point, [(diameter / 2, 0), (diameter / 2, length), (0, length)])


def slider_crank(angle=math.pi / 3, split="seam"):
    """Crank 50 mm, rod 200 mm; the slider lies in a slot of the frame."""
    outline = [(-30, -40), (320, -40), (320, -15.02), (120, -15.02), (120, 15.02), (320, 15.02), (320, 40), (-30, 40)]
    frame = prism(outline, -12, 0, split).feature("bottom", (0, 0, -12), [(10.02, 0), (10.02, -12)], "top")
    crank = boss(boss(bar(50, [], 0, 10, split=split), "bottom", (0, 0, 0), 20, 12), "top", (50, 0, 10), 16, 10)
    rod = bar(200, [(0, 16.03), (200, 12.02)], 10, 20, 12, split)
    slider = boss(box((-20, -15, -12), (20, 15, 0), split), "top", (0, 0, 0), 12, 20)
    pin = 50 * np.array([math.cos(angle), math.sin(angle), 0])
    lean = -math.asin(pin[1] / 200)
    x = pin[0] + 200 * math.cos(lean)
    z = (0, 0, 1)
    return {
        "frame": (frame, *STILL),
        "crank": (crank, turn(z, angle), np.zeros(3)),
        "rod": (rod, turn(z, lean), pin),
        "slider": (slider, np.eye(3), np.array([x, 0, 0])),
    }
