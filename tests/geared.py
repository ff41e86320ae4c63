"""Mechanisms with gear pairs, as plain data; part of the table in `mechanisms`."""

from __future__ import annotations

from mechanisms_parts import Data, body, prismatic, revolute, slide


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
        "joints": {
            "A": revolute("ground", "crank"),
            "B": revolute("crank", "left"),
            "C": revolute("left", "right"),
            "D": revolute("right", "wheel"),
            "E": revolute("wheel", "ground"),
        },
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
        "joints": {
            "A": revolute("ground", "carrier"),
            "B": revolute("carrier", "planet"),
            "C": revolute("planet", "rod"),
            "D": revolute("rod", "slider"),
            "P": prismatic("ground", "slider"),
        },
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
        "joints": {
            "A": revolute("ground", "crank"),
            "B": revolute("crank", "left"),
            "C": revolute("left", "right"),
            "D": revolute("right", "wheel"),
            "E": revolute("wheel", "ground"),
        },
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
        "joints": {
            "A": revolute("ground", "crank"),
            "B": revolute("crank", "coupler"),
            "C": revolute("coupler", "rocker"),
            "D": revolute("ground", "rocker"),
            "E": revolute("ground", "arm"),
            "F": revolute("arm", "rod"),
            "G": revolute("rod", "slider"),
            "P": prismatic("ground", "slider"),
        },
        "gears": {"train": {"joints": ["D", "E"], "ratio": 0.7, "phase": -2.5, "teeth": False}},
        "drivers": {"A": {"speed": 5.0}},
        "loads": {"work": {"link": "slider", "at": "G", "force": [-10.0, -20.0]}},
        "assembly": {"C": [0.8, 0.7], "G": [2.3, 0.7]},
    }
