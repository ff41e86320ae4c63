"""Mechanisms as STEP assemblies, drawn at a position, and what their parts are in closed form."""

from __future__ import annotations

import math

import numpy as np

from exchange.step_files import StepFile, box, prism, turn, turned

STILL = (np.eye(3), np.zeros(3))


def placed(parts, rotation, shift):
    """Parts {name: (shape, matrix, shift)} turned and shifted as a whole."""
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


def four_bar():
    """Ground 100 mm, crank 30, coupler 90, rocker 70; four loose pins of one part."""
    ground = bar(100, [(0, 10.04), (100, 10.04)], -10, 0)
    crank = bar(30, [(0, 10.02), (30, 10.05)], 0, 10, 8)
    coupler = bar(90, [(0, 10.03), (90, 10.03)], 10, 20, 8)
    rocker = bar(70, [(0, 10.02), (70, 10.06)], 0, 10, 8)
    pin = turned([(0, 0), (5, 0), (5, 20), (0, 20)])
    angle = math.pi / 3
    b = 30 * np.array([math.cos(angle), math.sin(angle)])
    to_d = np.array([100, 0]) - b
    far = float(np.linalg.norm(to_d))
    lean = math.atan2(to_d[1], to_d[0]) + math.acos((90**2 + far**2 - 70**2) / (2 * 90 * far))
    c = b + 90 * np.array([math.cos(lean), math.sin(lean)])
    swing = math.atan2(c[1], c[0] - 100)
    z = (0, 0, 1)
    at = {"pin": (0, 0, -10), "pin-2": (*b, 0), "pin-3": (*c, 0), "pin-4": (100, 0, -10)}
    links = {
        "ground": (ground, *STILL),
        "crank": (crank, turn(z, angle), np.zeros(3)),
        "coupler": (coupler, turn(z, lean), np.array([*b, 0])),
        "rocker": (rocker, turn(z, swing), np.array([100, 0, 0])),
    }
    return links | {name: (pin, np.eye(3), np.array(place, float)) for name, place in at.items()}


SHAFTS = math.pi / 6  # angle between the shafts of the Cardan joint


def cardan():
    """Two forks and a cross, drawn with the pin of the first fork normal to the plane of the shafts, z."""
    c, s = math.cos(SHAFTS), math.sin(SHAFTS)
    along, across = np.array([c, s]), np.array([-s, c])
    wall = [along * a + across * b for a, b in ((60, -90), (60, 40), (40, 40), (40, -60))]
    outline = [(-60, -90), *wall, (-40, -60), (-40, 40), (-60, 40)]
    frame = prism(outline, -30, 30)
    frame.feature(5, (-40, 0, 0), [(10.02, 0), (10.02, -20)], 7)
    frame.feature(3, (*(40 * along), 0), [(10.03, 0), (10.03, -20)], 1)

    def fork(shaft):
        outline = [(-23, -30), (23, -30), (23, 10), (15, 10), (15, -22), (-15, -22), (-15, 10), (-23, 10)]
        shape = prism(outline, -8, 8)
        shape.feature(1, (23, 0, 0), [(5.01, 0), (5.01, -8)], 3).feature(7, (-23, 0, 0), [(5.01, 0), (5.01, -8)], 5)
        return shape.feature(0, (0, -30, 0), shaft)

    held = [(14, 0), (14, 10), (10, 10), (10, 30), (14, 30), (14, 35), (0, 35)]
    plain = [(14, 0), (14, 9), (10, 9), (10, 40), (0, 40)]
    cross = box((-9, -9, -9), (9, 9, 9))
    for face, x, y in ((0, 0, -9), (1, 9, 0), (2, 0, 9), (3, -9, 0)):
        boss(cross, face, (x, y, 0), 10, 14)
    z, x, second = np.array([0.0, 0, 1]), np.array([1.0, 0, 0]), np.array([-s, c, 0])
    out = -np.array([c, s, 0])
    parts = {
        "frame": (frame, *STILL),
        "input": (fork(held), np.column_stack([z, x, np.cross(z, x)]), np.zeros(3)),
        "cross": (cross, np.column_stack([z, second, np.cross(z, second)]), np.zeros(3)),
        "output": (fork(plain), np.column_stack([second, out, np.cross(second, out)]), np.zeros(3)),
    }
    return parts
