"""Mechanisms that many tests share, as plain data, and what is asked of their results again and again."""

import copy
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import trunnion
from brief import brief
from mechanisms_parts import Data, body, joined, slide
from trunnion import Mechanism
from trunnion.groups.general import General
from trunnion.groups.tree import OUTER, GroupJoint

Array = NDArray[np.float64]
DURANGO = Path(__file__).parents[1] / "examples" / "durango-fourbar.yaml"


def law_named(name: str) -> Data:
    """Friction by a law of the table, with a sensible value for each of its parameters."""
    from trunnion.joints.friction import FRICTION_LAWS

    def value(parameter: str, declared: Any) -> float:
        if declared.default is not None:
            return float(declared.default)
        wanted = {"stiffness": 3e3, "static": 0.2}.get(parameter, 0.01 if "speed" in parameter else 0.15)
        return min(max(wanted, declared.minimum), declared.maximum)

    parameters = {key: one for key, one in FRICTION_LAWS[name].parameters.items() if not one.optional}
    return {"law": name, **{key: value(key, declared) for key, declared in parameters.items()}}


def model(data: Data, friction: float | Data | None = 0.12, radius: float = 0.01, guide: float = 0.4) -> Data:
    """The data with gravity and friction in every joint."""
    defaults: Data = {"pin": {"radius": radius}}
    if any(joint["type"] == "prismatic" for joint in data["joints"].values()):
        defaults["guide"] = {"length": guide}
    if friction is not None:
        defaults["friction"] = friction
    return {"gravity": [0.3, -9.81], "joint_defaults": defaults, **data}


def four_bar(ab: float = 0.3, bc: float = 0.9, cd: float = 0.7, ad: float = 1.0, side: float = 1.0) -> Data:
    """Crank and rocker by default; side: where C is at the start."""
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "D": [ad, 0]}},
            "crank": body({"A": [0, 0], "B": [ab, 0]}, 1, ab),
            "coupler": body({"B": [0, 0], "C": [bc, 0], "E": [0.4 * bc, 0.3 * bc]}, 2, bc),
            "rocker": body({"D": [0, 0], "C": [cd, 0]}, 3, cd),
        },
        "joints": joined("ground -A- crank -B- coupler -C- rocker, ground -D- rocker"),
        "drivers": {"A": {"speed": 4.0}},
        "loads": {
            "push": {"link": "coupler", "at": "E", "force": [12.0, -30.0]},
            "brake": {"link": "rocker", "moment": -7.0},
        },
        "assembly": {"C": [0.9 * ad, side * cd]},
    }


def slider_crank(r: float = 0.3, length: float = 1.0, offset: float = 0.1) -> Data:
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "C": slide(0, offset)}},
            "crank": body({"A": [0, 0], "B": [r, 0]}, 1, r),
            "rod": body({"B": [0, 0], "P": [length, 0]}, 2, length),
            "piston": body({"P": [0, 0], "C": slide(0.05, 0), "H": [0.1, 0.08]}, 3, r),
        },
        "joints": joined("ground -A- crank -B- rod -P- piston, ground =C= piston"),
        "drivers": {"A": {"speed": -6.0}},
        "loads": {"gas": {"link": "piston", "at": "H", "force": [-50.0, 4.0]}},
        "assembly": {"P": [r + length, offset]},
    }


def inverted_slider_crank() -> Data:
    """Crank and swinging arm in which a block slides (RPR group): a shaper's drive, the arm's pin off its slide."""
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "D": [0.1, -0.8]}},
            "crank": body({"A": [0, 0], "B": [0.3, 0]}, 1, 0.3),
            "block": body({"B": [0, 0], "S": slide(0.02, 0.01, 0.1)}, 2, 0.2),
            "arm": body({"D": [0, 0], "S": slide(0.03, 0, np.pi / 2 + 0.1), "T": [0, 1.5]}, 3, 1.0),
        },
        "joints": joined("ground -A- crank, block -B- crank, arm =S= block, ground -D- arm"),
        "drivers": {"A": {"speed": 3.0, "start": 0.2}},
        "loads": {"cut": {"link": "arm", "at": "T", "force": [20.0, 5.0]}},
        "assembly": {"S": [0.3, 0.0], "arm.T": [0.5, 0.8]},
    }


def watt_six_bar() -> Data:
    data = four_bar()
    data["links"]["ground"]["points"]["G"] = [2.0, 0.1]
    data["links"]["rocker"]["points"]["F"] = [0.5, 0.3]
    data["links"]["rod"] = body({"F": [0, 0], "H": [1.0, 0]}, 4)
    data["links"]["output"] = body({"G": [0, 0], "H": [0.8, 0]}, 5)
    data["joints"] |= joined("rod -F- rocker, rod -H- output -G- ground")
    data["loads"]["work"] = {"link": "output", "moment": 9.0, "useful": True}
    data["assembly"]["H"] = [2.0, 1.0]
    return data


def stephenson_six_bar() -> Data:
    """Stephenson III: a dyad on the coupler point of a four-bar."""
    data = four_bar()
    data["links"]["ground"]["points"]["G"] = [0.2, 1.4]
    data["links"]["rod"] = body({"E": [0, 0], "H": [0.8, 0]}, 4)
    data["links"]["output"] = body({"G": [0, 0], "H": [0.7, 0]}, 5)
    data["joints"] |= joined("coupler -E- rod -H- output, ground -G- output")
    data["loads"]["work"] = {"link": "output", "moment": -9.0}
    data["assembly"]["H"] = [0.9, 1.3]
    return data


def class_three() -> Data:
    """A ternary link on three rods: to the crank and to two pins of the ground (Assur group of class III)."""
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "G": [1.4, -0.15], "H": [0.55, 1.9]}},
            "crank": body({"A": [0, 0], "B": [0.1, 0]}, 1, 0.2),
            "rod1": body({"B": [0, 0], "P": [0.8485, 0]}, 2, 0.8),
            "rod2": body({"G": [0, 0], "Q": [0.7566, 0]}, 3, 0.7),
            "rod3": body({"H": [0, 0], "R": [0.8944, 0]}, 4, 0.8),
            "plate": body({"P": [0, 0], "Q": [0.6, 0], "R": [0.25, 0.5]}, 5, 0.4),
        },
        "joints": joined(
            "ground -A- crank -B- rod1 -P- plate -Q- rod2, rod3 -R- plate, ground -G- rod2, rod3 -H- ground"
        ),
        "drivers": {"A": {"speed": 5.0}},
        "loads": {"push": {"link": "plate", "at": "R", "force": [7.0, -20.0]}, "turn": {"link": "rod3", "moment": 3.0}},
        "assembly": {"P": [0.7, 0.6], "Q": [1.3, 0.6], "R": [0.95, 1.1]},
    }


def five_bar() -> Data:
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "E": [0.8, 0]}},
            "left": body({"A": [0, 0], "B": [0.3, 0]}, 1, 0.3),
            "right": body({"E": [0, 0], "D": [0.25, 0]}, 2, 0.3),
            "rod1": body({"B": [0, 0], "C": [0.9, 0]}, 3, 0.9),
            "rod2": body({"D": [0, 0], "C": [0.8, 0], "T": [1.0, 0.1]}, 4, 0.8),
        },
        "joints": joined("ground -A- left, right -E- ground, left -B- rod1, rod2 -C- rod1, right -D- rod2"),
        "drivers": {"A": {"speed": 2.0}, "E": {"speed": -4.0, "start": 0.4}},
        "loads": {"tool": {"link": "rod2", "at": "T", "force": [-5.0, 11.0]}},
        "assembly": {"C": [0.5, 0.8]},
    }


def excavator() -> Data:
    """A boom raised by a cylinder, and on it a stick that is turned by a driver on the moving boom."""
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "B": [0.5, -0.2]}},
            "boom": body({"A": [0, 0], "C": [0.9, 0.15], "K": [2.0, 0]}, 1, 1.5),
            "barrel": body({"B": [0, 0], "S": slide(0.1, 0)}, 2, 0.4),
            "rod": body({"C": [0.05, 0], "S": slide(-0.5, 0)}, 3, 0.4),
            "stick": body({"K": [0, 0], "T": [1.1, 0.1]}, 4, 0.8),
        },
        "joints": joined("ground -A- boom, ground -B- barrel, boom -C- rod, barrel =S= rod, stick -K- boom"),
        "drivers": {"S": {"speed": 0.05, "range": [0.0, 0.2]}, "K": {"speed": -0.2, "range": [1.9, 1.1]}},
        "loads": {"dig": {"link": "stick", "at": "T", "force": [-80.0, 120.0]}},
        "assembly": {"C": [0.8, 0.4]},
    }


def serial_arm() -> Data:
    """Revolute, prismatic, revolute: drivers on moving links, nothing closes."""
    return {
        "links": {
            "ground": {"points": {"A": [0.2, 0.1]}},
            "arm": body({"A": [0.1, 0], "P": slide(0.5, 0.1, 0.3)}, 1),
            "ram": body({"P": slide(-0.2, 0.05, -0.4), "W": [0.6, 0.1]}, 2),
            "hand": body({"W": [0.05, 0.02], "T": [0.4, 0]}, 3, 0.3),
        },
        "joints": joined("ground -A- arm =P= ram, hand -W- ram"),
        "drivers": {
            "A": {"speed": 1.0, "range": [0.0, 2.0]},
            "P": {"speed": -0.25, "range": [0.5, 0.0]},
            "W": {"speed": 3.0, "range": [0.0, 6.0]},
        },
        "loads": {"tip": {"link": "hand", "at": "T", "force": [3.0, -8.0]}},
    }


def scotch_yoke() -> Data:
    """Crank pin in a block, block in the slot of a yoke, yoke in a guide (RPP group)."""
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "G": slide(0.6, 0.05, 0.1)}},
            "crank": body({"A": [0, 0], "B": [0.25, 0]}, 1, 0.25),
            "block": body({"B": [0, 0], "S": slide(0.01, 0, 1.4)}, 2, 0.1),
            "yoke": body({"S": slide(0, 0.1, 1.4), "G": slide(0.5, 0, 0.0)}, 3, 0.4),
        },
        "joints": joined("ground -A- crank -B- block =S= yoke, ground =G= yoke"),
        "drivers": {"A": {"speed": 2.5}},
        "loads": {"work": {"link": "yoke", "at": "S", "force": [-15.0, 2.0]}},
        "assembly": {"S": [0.25, 0.0]},
    }


def elliptic_bar() -> Data:
    """A bar between two slides, one driven (RRP group on a sliding driver)."""
    return {
        "links": {
            "ground": {"points": {"X": slide(0, 0), "Y": slide(0, 0, 1.3)}},
            "ram": body({"X": slide(0, 0), "P": [0.1, 0.02]}, 1, 0.2),
            "bar": body({"P": [0, 0], "Q": [0.9, 0]}, 2, 0.9),
            "slider": body({"Q": [0, 0], "Y": slide(0.05, 0.1, 1.3)}, 3, 0.2),
        },
        "joints": joined("ground =X= ram -P- bar -Q- slider, ground =Y= slider"),
        "drivers": {"X": {"speed": 0.3, "range": [0.05, 0.5]}},
        "loads": {"work": {"link": "slider", "at": "Q", "force": [1.0, -25.0]}},
        "assembly": {"Q": [0.2, 0.8]},
    }


def tangent_drive() -> Data:
    """A driven arm with a slot, a block in the slot, pinned to a slide on the ground (PRP group)."""
    return {
        "links": {
            "ground": {"points": {"A": [0, 0], "G": slide(0.5, 0.1, 1.5)}},
            "arm": body({"A": [0, 0], "S": slide(0.3, 0.02, 0.05)}, 1, 0.5),
            "block": body({"S": slide(0, 0), "P": [0.02, 0.01]}, 2, 0.1),
            "slider": body({"P": [0, 0.05], "G": slide(0.03, 0, 1.5)}, 3, 0.2),
        },
        "joints": joined("ground -A- arm, block =S= arm, block -P- slider =G= ground"),
        "drivers": {"A": {"speed": 0.7, "range": [-0.6, 0.6]}},
        "loads": {"work": {"link": "slider", "at": "P", "force": [2.0, -40.0]}},
        "assembly": {"P": [0.5, -0.3]},
    }


# ---- with gear pairs ------------------------------------------------------------------------------------------


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


MODELS: Mapping[str, Callable[[], Data]] = {
    "four-bar": four_bar, "four-bar, other branch": lambda: four_bar(side=-1.0), "slider-crank": slider_crank,
    "inverted slider-crank": inverted_slider_crank, "Watt six-bar": watt_six_bar,
    "Stephenson six-bar": stephenson_six_bar, "class III": class_three, "five-bar": five_bar, "excavator": excavator,
    "serial arm": serial_arm, "Scotch yoke": scotch_yoke, "elliptic bar": elliptic_bar, "tangent drive": tangent_drive,
    "geared five-bar": geared_five_bar, "planet drive": planet_drive, "geared loop": geared_loop,
    "rocker train": rocker_train, "rack on a rocker": rack_on_rocker, "rack in a loop": rack_in_loop,
    "screwed strut": screwed_strut,
}  # fmt: skip


def build(data: Data, **options: Any) -> Mechanism:
    """The mechanism of one of the tables above, with friction and gravity."""
    return Mechanism(**model(copy.deepcopy(data), **options))


def findings(result: Any) -> list[dict[str, str]]:
    return list(json.loads(result.attrs["findings"]))


def analyse(data: Data, steps: int = 36, method: Any = None, **options: Any) -> Any:
    return trunnion.analyse(build(data, **options), steps, method)


def positions_of(data: Data, steps: int = 36, method: Any = None, **options: Any) -> Any:
    """The variables of every position, without what is asked of the cycle."""
    return brief(build(data, **options), steps, method)


def transformed(data: Data, turn: float = 0.0, shift: Sequence[float] = (0.0, 0.0), mirror: bool = False) -> Data:
    """The same mechanism in a turned, shifted, mirrored frame: ground, gravity, loads, hints, drivers.

    Links keep their own frames, mirrored in their x axis if the whole is. Gravity must be in the data.
    """
    data = copy.deepcopy(data)
    sign = -1.0 if mirror else 1.0
    c, s = float(np.cos(turn)), float(np.sin(turn))

    def vector(v: Sequence[float]) -> list[float]:
        x, y = float(v[0]), sign * float(v[1])
        return [c * x - s * y, s * x + c * y]

    def place(v: Sequence[float]) -> list[float]:
        x, y = vector(v)
        return [x + shift[0], y + shift[1]]

    def local(v: Sequence[float]) -> list[float]:
        return [float(v[0]), sign * float(v[1])]

    def added(joint: str) -> float:
        """To its rotation, which counts from the frame's x axis: that has turned, if it is a joint of the ground."""
        links = data["joints"][joint]["links"]
        return {0: turn, 1: -turn}[links.index("ground")] if "ground" in links else 0.0

    for name, link in data["links"].items():
        at, direction = (place, vector) if name == "ground" else (local, local)
        for key, value in link["points"].items():
            link["points"][key] = (
                {"at": at(value["at"]), "axis": direction(value["axis"])} if isinstance(value, dict) else at(value)
            )
        link |= {"centre": local(link["centre"])} if "centre" in link else {}
    data["gravity"] = vector(data["gravity"])
    for load in data.get("loads", {}).values():
        load |= {"force": vector(load["force"])} if "force" in load else {}
        load |= {"moment": sign * load["moment"]} if "moment" in load else {}
    data["assembly"] = {key: place(value) for key, value in data.get("assembly", {}).items()}
    turning = [name for name, joint in data["joints"].items() if joint["type"] == "revolute"]
    for name in set(turning) & data["drivers"].keys():
        driver = data["drivers"][name]
        driver["speed"] *= sign
        if "range" in driver:
            driver["range"] = [sign * q + added(name) for q in driver["range"]]
        else:
            driver["start"] = sign * driver.get("start", 0.0) + added(name)
    for gear in data.get("gears", {}).values():
        key = next(key for key in ("ratio", "radius", "lead") if key in gear)
        first, *second = (added(joint) for joint in gear["joints"] if joint in turning)
        if key == "ratio":
            gear["phase"] = sign * gear["phase"] + second[0] - gear["ratio"] * first
        else:  # a slide is the same in a mirror
            gear[key] *= sign
            gear["phase"] -= gear[key] / (1.0 if key == "radius" else 2 * np.pi) * first
    return data


LENGTHS = ("points", "at", "centre", "assembly", "radius", "length", "width", "bearing", "offset", "clearance", "pitch",
           "lead")  # fmt: skip


def in_units(data: Data, length: float, mass: float = 1.0, time: float = 1.0) -> Data:
    """The same mechanism told in other units: a metre is `length`, a kilogram `mass`, a second `time` of them."""
    force = mass * length / time**2
    units = dict.fromkeys(LENGTHS, length) | dict.fromkeys(("axis", "x"), 1.0)
    units |= {"mass": mass, "inertia": mass * length**2, "gravity": length / time**2, "force": force}
    units |= dict.fromkeys(("moment", "resisting_torque"), force * length)

    def told(value: Any, unit: float) -> Any:
        if isinstance(value, dict):
            return {key: told(part, units.get(key, unit)) for key, part in value.items()}
        if isinstance(value, list):
            return [told(part, unit) for part in value]
        return value if unit == 1.0 or isinstance(value, str | bool) else unit * value

    data = told(copy.deepcopy(data), 1.0)
    for name, driver in data["drivers"].items():
        unit = length if data["joints"][name]["type"] == "prismatic" else 1.0
        driver |= {"speed": driver["speed"] * unit / time} if "speed" in driver else {}
        driver |= {"range": told(driver["range"], unit)} if "range" in driver else {}
    for gear in data.get("gears", {}).values():
        gear |= {"phase": length * gear["phase"]} if "phase" in gear and "ratio" not in gear else {}
    return dict(data)


def dyad(letters: str) -> General:
    """General group of two links on known links: outer joint, inner joint, outer joint."""
    first, inner, last = ({"R": "revolute", "P": "prismatic"}[letter] for letter in letters)
    joints = (GroupJoint(first, (OUTER, 0)), GroupJoint(inner, (0, 1)), GroupJoint(last, (OUTER, 1)))
    return General(2, joints)


def eccentric_press() -> Mechanism:
    """A slider-crank with friction in its guide alone, whose load presses beside the middle of the guide.

    The load F is 0.2 of the guide's length off its axis, so that its couple presses with 0.4 F at any friction, and the
    side force of the rod with (F − φ) tan β where the load moves the slider: there friction takes the load over from
    the side force, which it changes, to the couple, which it does not.
    """
    return Mechanism(
        links={
            "frame": {"points": {"O": [0, 0], "S": slide(0, 0)}},
            "crank": {"points": {"O": [0, 0], "P": [0.08, 0]}},
            "rod": {"points": {"P": [0, 0], "Q": [0.2, 0]}},
            "slider": {"points": {"Q": [0, 0], "S": slide(0, 0), "L": [0, 0.02]}},
        },
        joints=joined(
            "frame -O- crank -P- rod -Q- slider, frame =S= slider", S={"guide": {"length": 0.1}, "friction": 0.49}
        ),
        joint_defaults={"pin": {"radius": 0.005}},
        drivers={"O": {"speed": 1.0}},
        loads={"work": {"link": "slider", "at": "L", "force": [-100.0, 0.0]}},
        assembly={"Q": [0.28, 0.0]},
    )
