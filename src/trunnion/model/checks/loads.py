"""Checks of what loads may speak of (the motion, tables) and of springs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, Severity
from trunnion.joints.pairs import PAIRS
from trunnion.model.expression import MOTION, PLACED, RESERVED
from trunnion.model.joint_parts import motions
from trunnion.model.names import as_key, nearest
from trunnion.model.parameters import Numbers
from trunnion.model.parts import Joint, Load, Spring, freedoms
from trunnion.model.quantity import Quantity
from trunnion.model.units import ANGLE, ANY, KINDS, Dimension, UnitError, dimension_text, fits

__all__ = [
    "expression_name",
    "load_findings",
    "motion_dimensions",
    "spring_values",
    "springs",
    "table_values",
    "tables",
    "unknown_name",
    "unread",
]

Values = Mapping[str, Number]
Dimensions = Mapping[str, Dimension | None]


# ---- names in the expressions of loads ------------------------------------------------------------------------


def motion_dimensions(mechanism: Numbers, names: Dimensions) -> dict[str, Dimension | None]:
    """What an expression in a load may speak of beside the dimensions, and what each measures."""
    dimensions: dict[str, Dimension | None] = {"time": KINDS["time"].dimensions[0]}
    joint = mechanism.effective_joints.get(next(iter(mechanism.drivers), ""))
    if joint is not None:
        slides = "rotation" not in freedoms(joint.type)
        dimensions["drive"] = KINDS["length"].dimensions[0] if slides else ANGLE
        dimensions["speed"] = KINDS["speed" if slides else "angular speed"].dimensions[0]
    dimensions.update(_placed_dimensions(mechanism))
    for name, table in mechanism.tables.items():
        dimensions[name] = next(
            (dimension for _, value in table.points if (dimension := _measure(value, names)) is not None), None
        )
    return dimensions


def _placed_dimensions(mechanism: Numbers) -> Iterator[tuple[str, Dimension]]:
    """Turn and slide of every joint, coordinates of every point and their rates, named as the columns of a result."""
    kinds = {"rotation": ("angle", "angular speed"), "slide": ("length", "speed")}
    for name, joint in mechanism.effective_joints.items():
        for freedom in motions(joint.type):
            for rate, kind in zip(("", "_velocity"), kinds[freedom], strict=True):
                yield f"{name}.{freedom}{rate}", KINDS[kind].dimensions[0]
    for link, points in mechanism.points.items():
        for point in points:
            for axis in "xyz"[: mechanism.coordinates]:
                yield f"{link}.{point}.{axis}", KINDS["length"].dimensions[0]
                yield f"{link}.{point}.velocity_{axis}", KINDS["speed"].dimensions[0]


def _measure(value: Quantity, names: Dimensions) -> Dimension | None:
    if not set(value.names) <= names.keys():
        return None
    try:
        return value.check(names, ANY)
    except UnitError:
        return None


def unknown_name(mechanism: Numbers, name: str, path: str, source: object, names: Dimensions) -> Finding:
    """A name in an expression that means nothing there."""
    section = path.partition(".")[0]
    refers = "" if str(source).strip() == name else f"refers to '{name}', which "
    what = f"'{source}' {refers}is not one of the dimensions"
    if section == "measures" and name in ("start", "end") and path.rpartition(".")[2] in ("at", "over"):
        return Finding(f"'{name}' is no position", path, "write the coordinate of the driver there, or a time, as 0 s")
    if name in ("off", "none"):
        return Finding(f"'{source}' is no number", path, "write 0")
    if PLACED in name and section != "loads":
        return Finding(what, path, "motions of joints and points are for loads; give a number or a dimension")
    if section == "loads" and name in mechanism.measures:
        placed = [label for label, _ in _placed_dimensions(mechanism)]
        examples = ", ".join(dict.fromkeys([placed[0], placed[-2]]))
        remedy = f"name the motion of a joint or a point as the columns of a result do: {examples} …"
        what = f"'{source}' refers to the measure '{name}', which is no coordinate or speed at every position"
        return Finding(what, path, remedy)
    if name not in MOTION and name not in mechanism.tables:
        remedy = nearest(name, [*names, *(motion_dimensions(mechanism, names) if section == "loads" else ())])
        if not names and section != "loads":
            remedy = f"state it, as in dimensions: {{{as_key(name)}: 30 mm}}"
        if remedy.startswith("known:") and section == "loads":
            placed = [label for label, _ in _placed_dimensions(mechanism)]
            remedy = nearest(name, [*names, *MOTION, *mechanism.tables]).removesuffix(", …")
            moves = [label for label in placed if label.endswith("slide_velocity")] or placed[1:2]
            remedy += f"; the motion of a joint or point, such as {', '.join(moves[:2] + placed[-2:-1])}"
        return Finding(what, path, remedy)
    if section == "loads":
        return Finding(f"'{source}' refers to '{name}', but the model has no driver", path, "state a driver")
    return Finding(what, path, "drive, speed, time and tables are for loads; give a number or a dimension")


# ---- tables ---------------------------------------------------------------------------------------------------


def expression_name(name: str, where: str) -> Iterator[Finding]:
    """Whether a dimension or a table can be spoken of in an expression by its name."""
    if name in RESERVED or name in MOTION:
        yield Finding(f"'{name}' is a reserved name of expressions", where, "rename it")
    elif not name.isidentifier() or name.startswith("_"):
        remedy = "name it with letters, digits and _, a letter first"
        yield Finding(f"'{name}' cannot be used in an expression", where, remedy)


def tables(mechanism: Numbers, names: Dimensions) -> Iterator[Finding]:
    """Names of the tables, and whether the values of each measure one thing."""
    for name, table in mechanism.tables.items():
        where = f"tables.{name}"
        yield from expression_name(name, where)
        if name in mechanism.dimensions:
            yield Finding(f"'{name}' is a dimension", where, "rename the table")
        if table.over == "drive" and not mechanism.drivers:
            yield Finding(
                "is over the coordinate of the first driver, but the model has no driver", where, "state a driver"
            )
        if table.file is not None:
            yield unread(table.file, where)
            continue
        if not table.points:
            remedy = (
                f"state points: {_EXAMPLES[table.over]}, or file: {as_key(f'{name}.csv')}, or give a file by --table"
            )
            yield Finding("has no points", where, remedy)
            continue
        if table.repeats and len(table.points) < (3 if table.period is None else 2):
            yield Finding("a periodic table needs three points", f"{where}.points", "add points")
        if table.period is not None and table.model_fields_set >= {"periodic"} and not table.periodic:
            what = "has no effect on a table without a period"
            yield Finding(what, f"{where}.period", "remove it, or write periodic: true")
        first: Dimension | None = None
        for k, (_, value) in enumerate(table.points):
            measured = _measure(value, names)
            first = first if first is not None else measured
            if measured is not None and first is not None and not (fits(measured, first) and fits(first, measured)):
                what = f"is {dimension_text(measured)}, the values before are {dimension_text(first)}"
                yield Finding(what, f"{where}.points.{k}.value", "use one unit within a table")


_EXAMPLES = {"drive": "[[0 deg, 40 bar], [360 deg, 40 bar]]", "time": "[[0 s, 40 bar], [1 s, 40 bar]]"}


def unread(file: str, where: str) -> Finding:
    """Of a table that names a file in a model that was not read from one."""
    what = f"names the file '{file[:60]}', but this model was not read from a file and has no folder"
    remedy = "give its points instead, or write the model into a file beside it and read that"
    return Finding(what, f"{where}.file", remedy)


def table_values(mechanism: Numbers, values: Values) -> Iterator[Finding]:
    """Whether a periodic table ends as it begins."""
    for name, table in mechanism.tables.items():
        where = f"tables.{name}.points"
        rows = range(len(table.points))
        if not rows:
            continue
        places, column = ([values[f"{where}.{k}.{key}"] for k in rows] for key in ("at", "value"))
        if table.repeats and all(places[k] > places[k - 1] for k in rows[1:]):
            yield from _repeated(mechanism, name, (places, column), values)


def _repeated(
    mechanism: Numbers, name: str, points: tuple[list[Number], list[Number]], values: Values
) -> Iterator[Finding]:
    """Whether a periodic table ends as it begins, or has a period that its points fit."""
    table, where = mechanism.tables[name], f"tables.{name}.points"
    places, column = points
    period = values.get(f"tables.{name}.period", np.nan)
    extent = places[-1] - places[0]
    if extent > period * (1 + SAME):
        what = f"is {period:g}, and the points go over {extent:g} (SI)"
        yield Finding(what, f"tables.{name}.period", "state the whole period, or leave points out")
        return
    closed = not extent < period * (1 - SAME)  # by its last point, not by its period
    if closed and abs(column[-1] - column[0]) > 1e-9 * np.max(np.abs(column)):
        what = f"a periodic table that begins at {column[0]:g} and ends at {column[-1]:g} (SI)"
        cycle, unit = _cycle(mechanism, table.over, values)
        short = table.period is None and cycle is not None and extent < cycle * (1 - SAME)
        state = f", or state period: {_told(cycle, unit)}" if short and cycle else ""
        yield Finding(what, where, f"end it with the value it begins with, one period later{state}")
    elif table.period is None:
        yield from _misfit(mechanism, name, extent, values)


SAME = 1e-9  # of a period
FITS = 1e-4  # of a cycle: what a period may be off a part of it, as 6.283 rad is


def _misfit(mechanism: Numbers, name: str, extent: Number, values: Values) -> Iterator[Finding]:
    """A table that repeats after something that is no turn, no part of one and no whole number of them."""
    cycle, unit = _cycle(mechanism, mechanism.tables[name].over, values)
    if cycle is None or not extent > 0:
        return
    ratio = max(cycle / extent, extent / cycle)
    if abs(ratio - np.round(ratio)) <= FITS:
        return
    size, full = (_told(length, unit) for length in (extent, cycle))
    what = f"it repeats after {size}, which is neither a part nor a multiple of the cycle of {full}"
    state = f"state period: {full}, or period: {size} if that is meant" if extent < cycle else f"state period: {size}"
    remedy = f"end it one cycle after its first point, with the value of that, or {state}"
    yield Finding(what, f"tables.{name}.points", remedy)


def _told(period: Number, unit: str) -> str:
    """A period as it is written in a file."""
    return f"{np.degrees(period) if unit == 'deg' else period:.6g} {unit}"


def _cycle(mechanism: Numbers, over: str, values: Values) -> tuple[float | None, str]:
    """After what the motion repeats, and in which unit it is told: a turn of the first driver, or a time."""
    first = next(iter(mechanism.drivers), "")
    joint = mechanism.effective_joints.get(first)
    if over == "drive":
        turns = joint is not None and "rotation" in freedoms(joint.type)
        return (2 * np.pi if turns else None), "deg"
    driver, before = mechanism.drivers.get(first), f"drivers.{first}."
    if driver is None or len(mechanism.drivers) > 1 or driver.law == "table" or driver.moves:
        return None, "s"
    numbers = {path.removeprefix(before): value for path, value in values.items() if path.startswith(before)}
    with suppress(KeyError, ZeroDivisionError):  # findings of their own
        span = driver.motion.span({**numbers, **driver.options})
        if span.periodic and np.isfinite(span.duration) and span.duration > 0:
            return float(span.duration), "s"
    return None, "s"


# ---- losses of joints ------------------------------------------------------------------------------------------


# ---- springs --------------------------------------------------------------------------------------------------


def springs(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each spring stands somewhere and states what it needs."""
    for name, spring in mechanism.springs.items():
        where = f"springs.{name}"
        if (spring.between is None) == (spring.joint is None):
            remedy = "state between: [link.point, link.point] or joint: …"
            yield Finding("states neither or both of two points and a joint", where, remedy)
            continue
        joints, joint = mechanism.effective_joints, spring.joint or ""
        if spring.between is not None:
            ends = {end.partition(".")[0] for end in spring.between}
            if len(ends) == 1:
                yield Finding(
                    f"both ends are on the link '{ends.pop()}'", f"{where}.between", "name points of two links"
                )
        elif joint not in joints:
            continue
        elif not motions(joints[joint].type):
            what = f"a {joints[joint].type} joint has no one axis for a spring to act about or along"
            remedy = "put it in a revolute, prismatic, cylindrical or helical joint, or between two points"
            yield Finding(what, f"{where}.joint", remedy)
            continue
        turns = spring.between is None and "rotation" in freedoms(joints[joint].type)
        yield from _free(spring, turns, where)


def _free(spring: Spring, turns: bool, where: str) -> Iterator[Finding]:
    """What the spring states of itself."""
    key, other = ("free_angle", "free_length") if turns else ("free_length", "free_angle")
    if getattr(spring, other) is not None:
        kind = "turns" if turns else "acts along a line"
        yield Finding(f"this spring {kind}", f"{where}.{other}", f"state {key} instead")
    elif spring.stiffness is None and spring.damping is None and spring.preload is None:
        yield Finding("this spring is empty", where, "state a stiffness, a damping or a preload")
    elif spring.stiffness is not None and getattr(spring, key) is None:
        example = "20 deg" if turns else "40 mm"
        yield Finding(f"a stiffness without a {key}", where, f"add {key}: {example}; its force there is the preload")
    elif spring.stiffness is None and getattr(spring, key) is not None:
        yield Finding(f"a {key} has no effect without a stiffness", f"{where}.{key}", "add stiffness: … or remove it")
    if spring.only is not None and turns:
        yield Finding(f"a spring in a joint that turns cannot only {spring.only}", f"{where}.only", "remove it")
    elif spring.only is not None and spring.stiffness is None:
        remedy = "add stiffness: … and free_length: …, at which it begins to act"
        yield Finding(f"a spring that can only {spring.only} needs a stiffness", where, remedy)


def spring_values(mechanism: Numbers, values: Values) -> Iterator[Finding]:
    """Signs, the sense of a preload, and a free angle that would count whole turns where nothing counts them."""
    for name, spring in mechanism.springs.items():
        where = f"springs.{name}"
        if values.get(f"{where}.stiffness", np.nan) == 0 and not values.get(f"{where}.preload", 0.0):
            yield Finding("is 0: the spring does not pull", f"{where}.stiffness", "remove it", Severity.WARNING)
        preload = values.get(f"{where}.preload", np.nan)
        if spring.only is not None and preload * (1 if spring.only == "pull" else -1) < 0:
            what = f"is {preload:g} N, which {'pushes' if preload < 0 else 'pulls'}; the spring can only {spring.only}"
            yield Finding(what, f"{where}.preload", "change its sign, or remove it")
        turns = np.abs(values.get(f"{where}.free_angle", np.nan)) / (2 * np.pi)
        if spring.joint not in mechanism.drivers and turns > 1:
            what = f"is {turns:.3g} turns, but the rotation of '{spring.joint}', which is not driven, counts none"
            yield Finding(what, f"{where}.free_angle", "state the angle within a turn and the winding as preload: …")


def load_findings(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each load acts on a link or resists a joint, with what that needs."""
    for name, load in mechanism.loads.items():
        where = f"loads.{name}"
        if (load.link is None) == (load.joint is None):
            link, _, point = str(load.at or "").rpartition(".")
            remedy = (
                f"state link: {link}, at: {point}" if link in mechanism.effective_links else "state link: … or joint: …"
            )
            yield Finding("acts on neither or both of a link and a joint", where, remedy)
        elif load.link is not None:
            yield from _link_load(mechanism, load, load.link, where)
        else:
            yield from _joint_load(mechanism, load, where)


def _link_load(mechanism: Numbers, load: Load, link: str, where: str) -> Iterator[Finding]:
    if load.resisting_torque is not None or load.resisting_force is not None:
        yield Finding("a resisting load acts on a joint, not a link", where, "state joint: … instead of link: …")
    elif load.only is not None:
        yield Finding("only is for a load that resists a joint", f"{where}.only", "remove it, or state joint: …")
    elif load.force is None and load.moment is None:
        yield Finding("this load is empty", where, "state a force or a moment")
    if load.force is not None and load.at is None:
        yield Finding("the force has no point to act at", where, "add at: <a point of the link>")
    if load.moment is not None and isinstance(load.moment, tuple) != (mechanism.space == "spatial"):
        form = "one number" if mechanism.space == "planar" else "[x, y, z]"
        yield Finding(f"the moment of a {mechanism.space} model is {form}", f"{where}.moment", f"write {form}")
    if link in mechanism.points and load.at is not None and load.at not in mechanism.points[link]:
        points = mechanism.points[link]
        yield Finding(f"the link '{link}' has no point '{load.at}'", f"{where}.at", nearest(load.at, points))
    if link == mechanism.fixed_link:
        yield Finding("acts on the fixed link and has no effect", where, "name a moving link", Severity.WARNING)


def _joint_load(mechanism: Numbers, load: Load, where: str) -> Iterator[Finding]:
    joints = mechanism.effective_joints
    if load.frame != "global":
        yield Finding("frame is for a load on a link", f"{where}.frame", "remove it")
    if load.force is not None or load.moment is not None or load.at is not None:
        yield Finding(
            "at, force and moment are for a load on a link", where, "state resisting_torque or resisting_force"
        )
    elif load.resisting_torque is None and load.resisting_force is None:
        yield Finding("this load is empty", where, "state resisting_torque or resisting_force")
    elif load.resisting_torque is not None and load.resisting_force is not None:
        yield Finding("resists a rotation and a slide at once", where, "state a load for each")
    if load.joint is None or load.joint not in joints:
        return
    for key, freedom in (("resisting_torque", "rotation"), ("resisting_force", "slide")):
        if getattr(load, key) is not None:
            yield from resisted(joints[load.joint], key, freedom, where)


def resisted(joint: Joint, key: str, freedom: str, where: str) -> Iterator[Finding]:
    """Whether a joint has the motion that a load resists."""
    if freedom in motions(joint.type):
        return
    what, remedy = f"a {joint.type} joint has no {freedom} to resist", "remove it"
    if not motions(joint.type) and PAIRS[joint.type].count:
        what = f"a {joint.type} joint has no one axis that a {key.replace('_', ' ')} could act about or along"
        remedy = "resist a revolute, prismatic, cylindrical or helical joint, or state a force or moment on a link"
    yield Finding(what, f"{where}.{key}", remedy)
