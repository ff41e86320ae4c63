"""Random planar mechanisms by family: cranks with up to three groups behind them, serial arms, gears."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from benchmarks.drawn.plane import Data, Place, Plane, unit

__all__ = ["FAMILIES", "drawn", "seated"]

# families and how often each is drawn
FAMILIES = {
    "slider-crank": 5,
    "slider-crank, no offset": 1,
    "press": 3,
    "four-bar": 2,
    "inverted slider-crank": 2,
    "scotch yoke": 2,
    "elliptic": 1,
    "six-bar": 5,
    "eight-bar": 1,
    "class III": 2,
    "cylinder": 1,
    "serial": 1,
    "geared": 2,
    "planet": 1,
    "train": 1,
}
SECOND = ("RRR", "RRP", "PRR", "RPR", "PRP", "RPP", "PPR")  # the group behind the first, of every class II


def _first(plane: Plane, kind: str, turning: float = 0.3) -> list[str]:
    """A crank and a group on it and the ground."""
    crank, b = plane.crank(float(plane.rng.uniform(0.1, turning)))
    return _behind(plane, kind, crank, b, plane.size * float(plane.rng.uniform(0.8, 1.5)))


def _behind(plane: Plane, kind: str, base: str, b: Place, reach: float) -> list[str]:
    """A group of class II on a place of a link, and on the ground."""
    groups: dict[str, Callable[[str, Place, str, float], list[str]]] = {
        "RRR": plane.rrr,
        "RRP": plane.rrp,
        "PRR": lambda base, b, other, reach: plane.rrp(other, b, base, reach),
        "RPR": plane.rpr,
        "PRP": plane.prp,
        "RPP": plane.rpp,
        "PPR": lambda base, b, other, reach: plane.rpp(other, b, base, reach),
    }
    return groups[kind](base, b, "ground", reach)


def _further(plane: Plane, links: Sequence[str]) -> list[str]:
    """Another group on a random place of the links there are."""
    base = str(plane.rng.choice(list(links)))
    points = [np.array(p["at"] if isinstance(p, dict) else p) for p in plane.data["links"][base]["points"].values()]
    at = plane.placed(base, points[int(plane.rng.integers(len(points)))]) + 0.5 * plane.at_random()
    kind = str(plane.rng.choice(SECOND))
    return _behind(plane, kind, base, at, plane.size * float(plane.rng.uniform(1.0, 2.0)))


def _six_bar(plane: Plane, groups: int = 1) -> None:
    links = _first(plane, str(plane.rng.choice(["RRR", "RRP", "RPR", "RPP"])), 0.2)
    for _ in range(groups):
        links = _further(plane, links)


def _triad(plane: Plane) -> None:
    crank, b = plane.crank(float(plane.rng.uniform(0.05, 0.15)))
    plane.triad(crank, b, plane.size * float(plane.rng.uniform(0.8, 1.2)))


def _elliptic(plane: Plane) -> None:
    """A driven slide with a group on it."""
    ram = plane.link()
    plane.drive(plane.guide("ground", ram, np.zeros(2), unit(plane.direction())), 0.2)
    _behind(plane, str(plane.rng.choice(["RRR", "RRP", "RPR"])), ram, plane.at_random(), plane.size)


def _cylinder(plane: Plane) -> None:
    """A rocker moved by a driven slide between two pins, and perhaps a group behind it."""
    rng, rocker, block, arm = plane.rng, plane.link(), plane.link(), plane.link()
    at = plane.size * float(rng.uniform(0.6, 1.2)) * unit(plane.direction())
    angle = float(np.arctan2(at[1], at[0]) + rng.choice([-1, 1]) * rng.uniform(1.0, 2.1))
    foot = at + plane.size * float(rng.uniform(0.8, 1.2)) * unit(angle)
    plane.pin("ground", rocker, np.zeros(2))
    plane.pin(rocker, block, at)
    joint = plane.guide(block, arm, at + 0.3 * (foot - at), unit(angle + float(rng.uniform(-0.1, 0.1))))
    plane.pin(arm, "ground", foot)
    plane.drive(joint, float(rng.uniform(0.05, 0.2)))
    if rng.random() < 0.6:
        _further(plane, [rocker])


def _serial(plane: Plane) -> None:
    """A driven slide on a driven arm, and perhaps a group behind them."""
    arm = plane.link()
    plane.drive(plane.pin("ground", arm, np.zeros(2)), float(plane.rng.uniform(0.1, 0.5)))
    ram = plane.link()
    joint = plane.guide(arm, ram, plane.at_random(), unit(plane.direction()))
    plane.drive(joint, float(plane.rng.uniform(0.05, 0.3)))
    if plane.rng.random() < 0.5:
        _further(plane, [ram])


def _geared(plane: Plane) -> None:
    """Two cranks on the ground in mesh or in a train, and a group between them."""
    rng = plane.rng
    crank, b = plane.crank(float(rng.uniform(0.1, 0.25)))
    wheel = plane.link()
    at = plane.size * float(rng.uniform(1.0, 1.6)) * unit(plane.direction())
    joint = plane.pin("ground", wheel, at)
    d = at + plane.size * float(rng.uniform(0.1, 0.25)) * unit(plane.direction())
    _mesh(plane, "J0", joint, float(rng.choice([-2, -0.5, 0.5, 2])))
    one, two = plane.link(), plane.link()
    across = d - b
    c = b + 0.5 * across + float(rng.choice([-1, 1]) * rng.uniform(0.5, 0.9)) * np.array([-across[1], across[0]])
    for pair in ((crank, one, b), (one, two, c), (two, wheel, d)):
        plane.pin(*pair)


def _mesh(plane: Plane, one: str, two: str, ratio: float) -> None:
    """A gear pair with the phase that the pose has."""
    gear: Data = {"joints": [one, two], "ratio": ratio, "phase": plane.coordinate(two) - ratio * plane.coordinate(one)}
    if plane.rng.random() < 0.3:
        gear["teeth"] = False
    elif plane.rng.random() < 0.5:
        gear["pressure_angle"] = float(plane.rng.uniform(0.0, 0.5))
    plane.data["gears"] = {"mesh": gear}


def _planet(plane: Plane) -> None:
    """A planet on a driven carrier rolls in or on a wheel of the ground and drives a slider or a rocker."""
    rng = plane.rng
    carrier, b = plane.crank(float(rng.uniform(0.2, 0.3)))
    planet = plane.link()
    _mesh(plane, "J0", plane.pin(carrier, planet, b), float(rng.choice([-3, -2, 2, 3])))
    c = b + plane.size * float(rng.uniform(0.05, 0.15)) * unit(plane.direction())
    _behind(plane, str(rng.choice(["RRR", "RRP", "RPR"])), planet, c, plane.size * float(rng.uniform(1.0, 1.5)))


def _train(plane: Plane) -> None:
    """A rocker turns an arm far off through a train, and the arm drives a group."""
    _first(plane, "RRR", 0.2)
    joint = list(plane.data["joints"])[-1]
    arm = plane.link()
    far = 2 * plane.size * unit(plane.direction())
    other = plane.pin("ground", arm, far)
    _mesh(plane, joint, other, float(plane.rng.uniform(0.4, 1.0)) * float(plane.rng.choice([-1, 1])))
    plane.data["gears"]["mesh"] |= {"teeth": False}
    plane.data["gears"]["mesh"].pop("pressure_angle", None)
    at = far + plane.size * float(plane.rng.uniform(0.15, 0.3)) * unit(plane.direction())
    _behind(plane, str(plane.rng.choice(["RRR", "RRP", "RPR", "RPP"])), arm, at, plane.size)


def _central(plane: Plane) -> None:
    """A slider-crank whose guide passes the shaft of the crank and the pin of the slider."""
    rng = plane.rng
    radius, rod = float(rng.uniform(0.1, 0.35)), float(rng.uniform(0.8, 1.5))
    crank, b = plane.crank(radius)
    towards = plane.direction()
    axis = unit(towards)
    along, across = float(b @ axis), float(b @ [-axis[1], axis[0]])
    p = (along + np.sqrt((rod * plane.size) ** 2 - across**2)) * axis
    one, two = plane.link(), plane.link()
    plane.pin(crank, one, b)
    plane.pin(one, two, p)
    plane.guide(two, "ground", p, axis)


def _press(plane: Plane) -> None:
    """A slider-crank that rubs in its guide alone, the slider's pin in the middle of that, the work beside its axis.

    So the moment in the guide knows no friction, but the force across it does: where the larger of the two changes, a
    Newton step of one side ends on the other.
    """
    rng = plane.rng
    plane.clean, plane.bare_pins, plane.busy = 1.0, True, False
    crank, b = plane.crank(float(rng.uniform(0.1, 0.3)))
    plane.rrp(crank, b, "ground", plane.size * float(rng.uniform(0.8, 1.5)))
    joint, guide = list(plane.data["joints"].items())[-1]
    guide["friction"] = {"coefficient": float(rng.uniform(0.05, 0.6))}
    slider = list(plane.pose)[-1]
    points = [plane.data["links"][link]["points"] for link in (slider, "ground")]
    if guide["links"][1] == "ground":  # the middle of a guide is that on its second link
        guide["links"].reverse()
    pin = next(name for name in points[0] if name != joint)
    points[0][joint]["at"] = list(points[0][pin])
    place, axis = np.array(points[0][joint]["at"]), np.array(points[0][joint]["axis"])
    beside = guide["guide"]["length"] * float(rng.uniform(-0.15, 0.15)) * np.array([-axis[1], axis[0]])
    points[0]["W"] = [float(n) for n in place + beside]
    force = plane.mass * plane.size * plane.pace**2 * float(10 ** rng.uniform(1.0, 3.0)) * float(rng.choice([-1, 1]))
    load = {"link": slider, "at": "W", "force": [float(n) for n in force * axis], "frame": "link", "useful": True}
    plane.data["loads"] = {"press": load}


BUILT: dict[str, Callable[[Plane], Any]] = {
    "slider-crank": lambda plane: _first(plane, "RRP"),
    "slider-crank, no offset": _central,
    "press": _press,
    "four-bar": lambda plane: _first(plane, "RRR", 0.2),
    "inverted slider-crank": lambda plane: _first(plane, "RPR"),
    "scotch yoke": lambda plane: _first(plane, "RPP"),
    "elliptic": _elliptic,
    "six-bar": _six_bar,
    "eight-bar": lambda plane: _six_bar(plane, 2),
    "class III": _triad,
    "cylinder": _cylinder,
    "serial": _serial,
    "geared": _geared,
    "planet": _planet,
    "train": _train,
}


def drawn(seed: int) -> tuple[str, Data]:
    """The family and the model of a seed."""
    rng = np.random.default_rng([20_26, seed])
    names = list(FAMILIES)
    share = np.array(list(FAMILIES.values()), float)
    family = str(rng.choice(names, p=share / share.sum()))
    plane = Plane(rng)
    BUILT[family](plane)
    plane.loaded()
    return family, plane.data


def seated(seed: int) -> tuple[str, Data]:
    """The same with play in every pin and some guides, each lying where its load presses it; without gear pairs."""
    family, data = drawn(seed)
    if "gears" in data:
        return seated(seed + 1_000_003)
    rng = np.random.default_rng([20_28, seed])
    points = [point for link in data["links"].values() for point in link["points"].values()]
    size = max(float(np.hypot(*(point["at"] if isinstance(point, dict) else point))) for point in points)
    for joint in data["joints"].values():
        clearance = size * float(10 ** rng.uniform(-5, -3.5))
        if joint["type"] == "revolute":
            joint["pin"] = {"radius": 0.01 * size, **joint.get("pin", {}), "clearance": clearance}
            joint["seat"] = "loaded"
        elif rng.random() < 0.5:
            joint["guide"]["clearance"] = clearance
            joint["seat"] = "loaded"
    return family, data
