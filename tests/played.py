"""Mechanisms with play in their joints, and what an offset of a pin really does, for the tests of `play`."""

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

import toleranced
from mechanisms import Array
from mechanisms_parts import Data
from toleranced import fourbar
from trunnion import Mechanism
from trunnion.algebra.dual import Dual, derivative
from trunnion.algebra.plane import Wrench
from trunnion.algebra.space import Screw
from trunnion.joints.clearance import CLEARANCE_MODELS, Vector
from trunnion.measures.measures import MOTIONS, Measure, value
from trunnion.solve import shifts
from trunnion.solve.backward import Backward, gears_of, pass_on, unloaded
from trunnion.solve.forward import Forward, SpatialWalk, forward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.shifts import HOLE, Play
from trunnion.solve.system import System, Values

Loads = dict[str, list[Vector]]  # load at each end, by joint
FROM_60 = {"A": {"speed": 1.0, "start": np.radians(60)}}


def with_play(data: Data, clearance: float = 1e-5, float_: float = 0.0) -> Mechanism:
    """A mechanism of plain data with the same clearance in every joint that can have one."""
    data = copy.deepcopy(data)
    space = data.get("space", "planar")
    rows = data["loop"] if "loop" in data else data["joints"].values()
    for joint in rows:
        if joint["type"] not in CLEARANCE_MODELS[space]:
            continue
        slides, ball = joint["type"] == "prismatic", joint["type"] == "spherical"
        sizes = {"length": 0.3} if slides else {"radius": 0.01}
        sizes |= {"bearing": 0.2} if space == "spatial" and not slides and not ball else {}
        part = "guide" if slides else "pin"
        joint[part] = sizes | joint.get(part, {}) | {"clearance": clearance}
        if float_ and space == "spatial" and joint["type"] == "revolute":
            joint[part]["end_float"] = float_
    return Mechanism(**{"trunnion": 1, **data})


def measures_of(run: Run) -> list[str]:
    """Names of every measure of the motion that a mechanism has."""
    mechanism = run.system.mechanism
    axes = mechanism.coordinates
    turning = ("revolute", "cylindrical", "helical")
    sliding = ("prismatic", "cylindrical", "helical")
    found = [f"{link}.{point}.{axis}" for link, point in run.system.points for axis in "xyz"[:axes]]
    found += [f"rotation:{name}" for name, joint in run.system.joints.items() if joint.type in turning]
    found += [f"slide:{name}" for name, joint in run.system.joints.items() if joint.type in sliding]
    ends = ("",) if axes == 2 else (".x", ".y", ".z")
    spinning = {link for module in run.system.plan.modules for link, _, _ in module.spinning}
    return found + [f"angle:{link}{end}" for link in mechanism.effective_links if link not in spinning for end in ends]


def offsets_of(plays: Mapping[str, Play], offsets: Mapping[str, Sequence[Vector]]) -> dict[str, Array]:
    """Offsets at the ends of joints by the names that `System.elements` knows."""
    return {
        path: np.asarray(number)
        for name, ends in offsets.items()
        for path, number in plays[name].model.paths(f"seats.{name}", ends).items()
    }


def pressed_to(load: Vector, radius: float) -> Vector:
    """The offset of largest work."""
    size = float(np.sqrt(sum(float(np.ravel(part)[0]) ** 2 for part in load)))
    return tuple(radius * float(np.ravel(part)[0]) / size if size > 0 else 0.0 for part in load)


def changes(run: Run, measure: Measure, offsets: Mapping[str, Array], time: Array) -> Array:
    """What offsets change in a measure of the motion, by the exact closure."""
    base = value(measure, forward(run.system, run.values, run.chosen.assembly, time))
    moved = value(measure, forward(run.system, {**run.values, **offsets}, run.chosen.assembly, time))
    return np.asarray(moved - base)


def four_bar(joint: str, clearance: float = 2e-5) -> Mechanism:
    """Links of 100, 30, 90, 70 mm, crank from 60°, play in one joint."""
    data = fourbar(tolerances={}, measures={}, drivers=FROM_60).data()
    data["joints"][joint]["pin"] = {"radius": 0.005, "clearance": clearance}
    return Mechanism(**data)


def rssr(clearance: float = 2e-5, float_: float = 0.0, hole_on: str = "rocker") -> Mechanism:
    """The RSSR linkage with a pin and hole at its output: 20 mm long, the middle on the common normal."""
    pin: Data = {"radius": 0.01, "hole_radius": 0.01 + clearance, "length": 0.02}
    data = toleranced.rssr(pin | ({"end_float": float_} if float_ else {}), {}, measures={}, drivers=FROM_60).data()
    if hole_on == "ground":
        data["joints"]["D"]["links"] = ["rocker", "ground"]
        data["assembly"] = {"D": -np.radians(74)}
    return Mechanism(**data)


# ---- what an offset does, two ways beside the batch of the study ------------------------------------------------


def plays(system: System, values: Values) -> dict[str, Play]:
    """The play of every joint that states some, by joint; where it is less than none, the fit presses: none."""
    space, found = system.mechanism.space, {}
    for name, joint in system.joints.items():
        one = shifts.play_of(space, joint.type, values, name)
        if one is not None:
            found[name] = one._replace(radii=tuple(np.where(radius > 0, radius, 0.0) for radius in one.radii))
    return found


def by_virtual_load(walk: Forward, measure: Measure, known: Mapping[str, Play]) -> Loads:
    """Qᵢ of a measure of the motion at each end of each joint: ∂y/∂cᵢ, in its unit a metre, hole's frame."""
    back = under(walk, unit_loads(measure, walk))
    holes = {name: walk.in_hole(name, back.reactions[name]) for name in known}
    return {name: play.model.loads(*holes[name], play.length) for name, play in known.items()}


def unit_loads(measure: Measure, walk: Forward) -> dict[str, Any]:
    """Loads by link, about the global origin, whose power is the rate of a measure of MOTIONS.

    They are equal and opposite on the two links of a joint. Under these alone, the drivers at rest, the reactions say
    what every small displacement in a joint does to it.
    """
    space = isinstance(walk, SpatialWalk)
    none: Any = (0.0, 0.0, 0.0) if space else 0.0
    along: Any = measure.along or tuple(float(axis == measure.axis) for axis in ("xyz" if space else "xy"))
    if measure.kind == "point":
        link, point = measure.subject.split(".")
        return {link: walk.algebra.about(along, none, walk.point(link, point).place)}
    if measure.kind == "angle":
        return {measure.subject: Screw(none, along) if space else Wrench(0.0, 0.0, 1.0)}
    links, ends = walk.system.joints[measure.subject].links, walk.ends(measure.subject)
    axis: Any = ends[1].z if space else (ends[0].c, ends[0].s)
    load: Any = Screw(none, axis) if space else Wrench(0.0, 0.0, 1.0)
    if measure.kind == "slide":
        load = walk.algebra.about(axis, none, walk.algebra.place_of(ends[1]))
    return {links[0]: walk.algebra.times(-1.0, load), links[1]: load}


def under(walk: Forward, loads: Mapping[str, Any]) -> Backward:
    """Reactions to these loads alone, each about what those of its link are, without friction; the drivers hold still.

    They are what moves with the play of joints, so gear pairs pass torques alone.
    """
    back = Backward(walk, unloaded(walk) | dict(loads))
    for number in reversed(range(len(walk.poses))):
        module, group = walk.system.plan.modules[number], walk.system.groups[number]
        if gears := gears_of(group):
            group = replace(group, gears=tuple(gear._replace(carriers=None) for gear in gears))
        reactions = walk.reactions(number, [back.loads[link] for link in module.links], group)
        pass_on(back, number, reactions, (), (), toothed=False)
    return back


def by_duals(run: Run, measure: Measure, known: Mapping[str, Play], time: Array, method: FrictionMethod) -> Loads:
    """The same by derivatives through the whole analysis, of any measure that is one number at each position.

    Seats stay on the hole.
    """
    paths = [f"{HOLE}.{name}.{key}" for name, play in known.items() for end in play.model.ends for key in end]
    rows = dict(zip(paths, np.eye(len(paths))[:, :, None], strict=True))  # each moves in a sample of its own
    offsets = {path: Dual(0.0, row) for path, row in rows.items()}
    with np.errstate(all="ignore"):
        if measure.kind in MOTIONS:
            number = value(measure, forward(run.system, {**run.values, **offsets}, run.chosen.assembly, time))
        elif measure.of_motion:
            number = measure.curve(forward(run.system, {**run.values, **offsets}, run.chosen.assembly, time))[0]
        else:
            number = measure.curve(run.at(time, offsets, method))[0]
    each = iter(np.broadcast_to(derivative(number), (len(rows), len(time))))
    return {name: [tuple(next(each) for _ in end) for end in play.model.ends] for name, play in known.items()}
