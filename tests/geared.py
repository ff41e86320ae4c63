"""Mechanisms with gear pairs, as plain data; part of the table in `mechanisms`."""

from __future__ import annotations

from mechanisms_parts import Data, body, joined, slide


def geared_five_bar() -> Data:
    """Two cranks on the ground in mesh, external teeth: the second is a module of its own behind the driver."""
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "E": [1.2, 0.1]}},
            "crank": body({"A": [0, 0], "B": [0.3, 0]}, 1, 0.3),
            "left": body({"B": [0, 0], "C": [1.3, 0], "P": [0.6, 0.3]}, 2, 1.0),
            "right": body({"D": [0, 0], "C": [1.2, 0]}, 3, 1.0),
            "wheel": body({"E": [0, 0], "D": [0.25, 0]}, 4, 0.25),
        },
        "joints": joined("ground -A- crank -B- left -C- right -D- wheel -E- ground"),
        # the wheel is the first link of E: its rotation against the ground is minus that of the joint
        "gears": {"mesh": {"joints": ["A", "E"], "ratio": 0.5, "phase": 0.4}},
        "drivers": {"A": {"speed": 3.0, "start": 0.3}},
        "loads": {"work": {"link": "left", "at": "P", "force": [5.0, -30.0]}},
        "assembly": {"C": [0.7, 1.2]},
    }


def planet_drive() -> Data:
    """A planet on a driven carrier rolls inside a fixed ring and drives a slider: internal teeth."""
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "P": slide(0.0, -0.1)}},
            "carrier": body({"A": [0, 0], "B": [0.4, 0]}, 1, 0.4),
            "planet": body({"B": [0, 0], "C": [0.15, 0.05]}, 2, 0.2),
            "rod": body({"C": [0, 0], "D": [1.4, 0]}, 3, 1.0),
            "slider": body({"D": [0, 0], "P": slide(0.0, 0.0)}, 4, 0.2),
        },
        "joints": joined("ground -A- carrier -B- planet -C- rod -D- slider, ground =P= slider"),
        "gears": {"ring": {"joints": ["A", "B"], "ratio": -3.0, "phase": 0.2, "pressure_angle": 0.4}},
        "drivers": {"A": {"speed": 2.0}},
        "loads": {"work": {"link": "slider", "at": "D", "force": [-25.0, 0.0]}},
        "assembly": {"D": [1.8, -0.1]},
    }


def geared_loop() -> Data:
    """A five-bar whose two last pins are geared to each other on the link between them: one module of three links."""
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "E": [1.0, 0.0]}},
            "crank": body({"A": [0, 0], "B": [0.2, 0]}, 1, 0.2),
            "left": body({"B": [0, 0], "C": [0.9, 0], "P": [0.5, 0.2]}, 2, 0.8),
            "right": body({"C": [0, 0], "D": [0.7, 0]}, 3, 0.7),
            "wheel": body({"D": [0, 0], "E": [0.5, 0]}, 4, 0.5),
        },
        "joints": joined("ground -A- crank -B- left -C- right -D- wheel -E- ground"),
        "gears": {"pair": {"joints": ["C", "D"], "ratio": 0.6, "phase": -0.5}},
        "drivers": {"A": {"speed": 4.0, "start": 0.35}},
        "loads": {"work": {"link": "left", "at": "P", "moment": 3.0, "force": [4.0, -9.0]}},
        "assembly": {"C": [0.55, 0.8]},
    }


def rocker_train() -> Data:
    """A rocker turns a second arm through a train that passes torques alone, and that arm drives a slider."""
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "D": [1.0, 0], "E": [1.4, 0.9], "P": slide(2.2, 0.4, 1.2)}},
            "crank": body({"A": [0, 0], "B": [0.25, 0]}, 1, 0.25),
            "coupler": body({"B": [0, 0], "C": [0.9, 0]}, 2, 0.9),
            "rocker": body({"D": [0, 0], "C": [0.7, 0]}, 3, 0.7),
            "arm": body({"E": [0, 0], "F": [0.3, 0]}, 2, 0.3),
            "rod": body({"F": [0, 0], "G": [1.0, 0]}, 1, 1.0),
            "slider": body({"G": [0, 0], "P": slide(0.0, 0.0)}, 2, 0.2),
        },
        "joints": joined(
            "ground -A- crank -B- coupler -C- rocker, ground -D- rocker, ground -E- arm -F- rod -G- slider, "
            "ground =P= slider"
        ),
        "gears": {"train": {"joints": ["D", "E"], "ratio": 0.7, "phase": -2.5, "teeth": False}},
        "drivers": {"A": {"speed": 5.0}},
        "loads": {"work": {"link": "slider", "at": "G", "force": [-10.0, -20.0]}},
        "assembly": {"C": [0.8, 0.7], "G": [2.3, 0.7]},
    }


def rack_on_rocker() -> Data:
    """A crank pushes a bar through a swivel that carries a pinion: the slide is determined before the pinion.

    The pair lists the slide first, and the bar is the first link of its joint. It passes the pinion on the far side.
    """
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "D": [0.7, 0.1]}},
            "crank": body({"A": [0, 0], "T": [0.2, 0]}, 1, 0.2),
            "bar": body({"T": [0, 0], "S": slide(0.4, 0.03)}, 2, 0.8),
            "swivel": body({"D": [0, 0], "S": slide(0.0, 0.05), "B": [0.02, -0.04]}, 1, 0.2),
            "pinion": body({"B": [0, 0]}, 3, 0.1),
        },
        "joints": joined("ground -A- crank -T- bar =S= swivel, ground -D- swivel -B- pinion"),
        "gears": {"mesh": {"joints": ["S", "B"], "radius": 0.06, "phase": 0.02, "pressure_angle": 0.3}},
        "drivers": {"A": {"speed": 3.0, "start": 0.4}},
        "loads": {"work": {"link": "pinion", "moment": 4.0}},
        "assembly": {"S": [0.7, 0.15]},
    }


def rack_in_loop() -> Data:
    """A five-bar whose coupler guides a rack that meshes with the next link: one module of five links."""
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "E": [1.0, 0.0], "U": [-0.6, 0.0]}},
            "crank": body({"A": [0, 0], "B": [0.09, 0]}, 1, 0.09),
            "left": body({"B": [0, 0], "C": [0.9, 0], "S": slide(0.5, 0.1)}, 2, 0.8),
            "right": body({"C": [0, 0], "D": [0.7, 0]}, 3, 0.7),
            "wheel": body({"D": [0, 0], "E": [0.5, 0]}, 4, 0.5),
            "rack": body({"S": slide(0.0, 0.0), "T": [-0.3, 0.05]}, 2, 0.4),
            "rod": body({"T": [0, 0], "U": [0.7, 0]}, 1, 0.7),
        },
        "joints": joined("ground -A- crank -B- left -C- right -D- wheel -E- ground, left =S= rack -T- rod -U- ground"),
        "gears": {"mesh": {"joints": ["C", "S"], "radius": 0.1, "phase": 0.05}},
        "drivers": {"A": {"speed": 4.0, "start": 0.2}},
        "loads": {"work": {"link": "left", "at": "S", "force": [4.0, -9.0]}},
        "assembly": {"C": [0.65, 0.8], "T": [0.07, 0.2]},
    }


def screwed_strut() -> Data:
    """A strut of two parts, screwed in and out by a wheel on one of them, lifts an arm."""
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "D": [0.1, -0.4]}},
            "arm": body({"A": [0, 0], "C": [0.8, 0]}, 2, 0.8),
            "tube": body({"D": [0, 0], "S": slide(0.0, 0.0), "W": [0.05, 0.02]}, 1, 0.3),
            "spindle": body({"S": slide(-0.3, 0.0), "C": [0.2, 0]}, 3, 0.4),
            "wheel": body({"W": [0, 0]}, 1, 0.05),
        },
        "joints": joined("ground -A- arm -C- spindle, ground -D- tube =S= spindle, tube -W- wheel"),
        "gears": {"screw": {"joints": ["W", "S"], "lead": 0.006, "phase": 0.3}},
        "drivers": {"W": {"speed": 20.0, "range": [0.0, 120.0]}},
        "loads": {"work": {"link": "arm", "at": "C", "force": [30.0, -200.0]}},
        "assembly": {"C": [0.75, 0.2]},
    }
