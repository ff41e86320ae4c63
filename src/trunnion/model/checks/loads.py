"""Checks of what loads may speak of (the motion, tables) and of springs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, Severity
from trunnion.model.expression import MOTION, PLACED, RESERVED
from trunnion.model.joint_parts import freedoms, motions
from trunnion.model.names import as_key, nearest
from trunnion.model.parameters import Numbers
from trunnion.model.quantity import Quantity
from trunnion.model.rules import stated_wrongly
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
    in_load = path.startswith("loads.")
    refers = "" if str(source).strip() == name else f"refers to '{name}', which "
    what, sayable = f"'{source}' {refers}is not one of the dimensions", [*names]
    if name in ("off", "none"):
        return Finding(f"'{source}' is no number", path, "write 0")
    if path.startswith("measures.") and name in ("start", "end"):
        return Finding(f"'{name}' is no position", path, "write the coordinate of the driver there, or a time, as 0 s")
    if not in_load and (PLACED in name or name in MOTION or name in mechanism.tables):
        remedy = (
            "motions of joints and points, drive, speed, time and tables are for loads; give a number or a dimension"
        )
        return Finding(what, path, remedy)
    if in_load and name in MOTION:
        return Finding(f"'{source}' refers to '{name}', but the model has no driver", path, "state a driver")
    if in_load:
        moves = motion_dimensions(mechanism, names)
        sayable += moves
        placed = [label for label in moves if PLACED in label]
        remedy = nearest(name, sayable)
        if not remedy.startswith("did you mean"):
            slides = [label for label in placed if label.endswith("slide_velocity")] or placed[:1]
            remedy = (
                f"name a dimension, a table, or the motion of a joint or point as {', '.join(slides + placed[-2:-1])}"
            )
        return Finding(what, path, remedy)
    return Finding(
        what, path, nearest(name, names) if names else f"state it, as in dimensions: {{{as_key(name)}: 30 mm}}"
    )


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
        where, count = f"tables.{name}", len(table.points)
        yield from expression_name(name, where)
        if table.file is not None:
            yield unread(table.file, where)
            continue
        remedy = f"state points: {_EXAMPLES[table.over]}, or file: {as_key(f'{name}.csv')}, or give a file by --table"
        yield from stated_wrongly(
            (name in mechanism.dimensions, f"'{name}' is a dimension", where, "rename the table"),
            (table.over == "drive" and not mechanism.drivers, "is over the coordinate of a driver, and there is none",
             where, "state a driver"),
            (not count, "has no points", where, remedy),
            (bool(count) and table.repeats and count < (3 if table.period is None else 2),
             "a periodic table needs three points", f"{where}.points", "add points"),
            (table.period is not None and "periodic" in table.model_fields_set and not table.periodic,
             "has no effect on a table without a period", f"{where}.period", "remove it, or write periodic: true"),
        )  # fmt: skip
        measures = [_measure(value, names) for _, value in table.points]
        first = next((measured for measured in measures if measured is not None), None)
        for k, measured in enumerate(measures):
            if measured and first and not (fits(measured, first) and fits(first, measured)):
                what = f"is {dimension_text(measured)}, the values before are {dimension_text(first)}"
                yield Finding(what, f"{where}.points.{k}.value", "use one unit within a table")


_EXAMPLES = {"drive": "[[0 deg, 40 bar], [360 deg, 40 bar]]", "time": "[[0 s, 40 bar], [1 s, 40 bar]]"}


def unread(file: str, where: str) -> Finding:
    """Of a table that names a file in a model that was not read from one."""
    what = f"names the file '{file[:60]}', but this model was not read from a file and has no folder"
    remedy = "give its points instead, or write the model into a file beside it and read that"
    return Finding(what, f"{where}.file", remedy)


def table_values(mechanism: Numbers, values: Values) -> Iterator[Finding]:
    """Whether a periodic table ends as it begins, and after what the motion does."""
    for name, table in mechanism.tables.items():
        where = f"tables.{name}.points"
        if not table.repeats or not table.points:
            continue
        begin, end = (f"{where}.0", f"{where}.{len(table.points) - 1}")
        extent = values[f"{end}.at"] - values[f"{begin}.at"]
        period = values.get(f"tables.{name}.period", np.nan)
        if extent > period * (1 + SAME):
            what = f"is {period:g}, and the points go over {extent:g} (SI)"
            yield Finding(what, f"tables.{name}.period", "state the whole period, or leave points out")
            continue
        closed = not extent < period * (1 - SAME)  # by its last point, not by its period
        first, last = values[f"{begin}.value"], values[f"{end}.value"]
        largest = max(abs(values[f"{where}.{k}.value"]) for k in range(len(table.points)))
        cycle, unit = _cycle(mechanism, table.over, values)
        size, full = (f"{np.degrees(length) if unit == 'deg' else length:.6g} {unit}" for length in (extent, cycle))
        if closed and abs(last - first) > SAME * largest:
            what = f"a periodic table that begins at {first:g} and ends at {last:g} (SI)"
            state = f", or state period: {full}" if table.period is None and extent < cycle * (1 - SAME) else ""
            yield Finding(what, where, f"end it with the value it begins with, one period later{state}")
        elif table.period is None and extent > 0 and _uneven(cycle / extent):
            what = f"it repeats after {size}, which is neither a part nor a multiple of the cycle of {full}"
            remedy = f"end it one cycle after its first point, with the value of that, or state period: {size}"
            yield Finding(what, where, f"{remedy} if that is meant")


SAME = 1e-9  # of a period, or of the largest value
FITS = 1e-4  # of a cycle: what a period may be off a part of it, as 6.283 rad is


def _uneven(ratio: float) -> bool:
    """Whether a cycle is neither a multiple nor a part of a period; nan where it has none."""
    larger = max(ratio, 1 / ratio)
    return bool(abs(larger - np.round(larger)) > FITS)


def _cycle(mechanism: Numbers, over: str, values: Values) -> tuple[float, str]:
    """After what the motion repeats, nan if it does not, and its unit: a turn of the driver, or a time."""
    first = next(iter(mechanism.drivers), "")
    joint, driver = mechanism.effective_joints.get(first), mechanism.drivers.get(first)
    if over == "drive":
        return (2 * np.pi if joint and "rotation" in freedoms(joint.type) else np.nan), "deg"
    if driver is None or len(mechanism.drivers) > 1 or driver.law == "table" or driver.moves:
        return np.nan, "s"
    before = f"drivers.{first}."
    numbers = {path.removeprefix(before): value for path, value in values.items() if path.startswith(before)}
    with suppress(KeyError, ZeroDivisionError):  # findings of their own
        span = driver.motion.span({**numbers, **driver.options})
        return (float(span.duration) if span.periodic and np.isfinite(span.duration) else np.nan), "s"
    return np.nan, "s"


# ---- springs --------------------------------------------------------------------------------------------------

ONE_AXIS = "revolute, prismatic, cylindrical or helical joint"


def springs(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each spring stands somewhere and states what it needs."""
    for name, spring in mechanism.springs.items():
        where, joint = f"springs.{name}", mechanism.effective_joints.get(spring.joint or "")
        ends = {end.partition(".")[0] for end in spring.between or ()}
        if (spring.between is None) == (joint is None):
            remedy = "state between: [link.point, link.point] or joint: …"
            yield Finding("states neither or both of two points and a joint", where, remedy)
            continue
        turns = joint is not None and "rotation" in freedoms(joint.type)
        key, other = ("free_angle", "free_length") if turns else ("free_length", "free_angle")
        free, stiff = getattr(spring, key) is not None, spring.stiffness is not None
        acts = "turns" if turns else "acts along a line"
        example = "20 deg" if turns else "40 mm"
        yield from stated_wrongly(
            (len(ends) == 1, f"both ends are on the link '{min(ends, default='')}'", f"{where}.between",
             "name points of two links"),
            (joint is not None and not motions(joint.type),
             f"a {joint and joint.type} joint has no one axis for a spring to act about or along", f"{where}.joint",
             f"put it in a {ONE_AXIS}, or between two points"),
            (getattr(spring, other) is not None, f"this spring {acts}", f"{where}.{other}", f"state {key} instead"),
            (not stiff and spring.damping is None and spring.preload is None, "this spring is empty", where,
             "state a stiffness, a damping or a preload"),
            (stiff and not free, f"a stiffness without a {key}", where,
             f"add {key}: {example}; its force there is the preload"),
            (free and not stiff, f"a {key} has no effect without a stiffness", f"{where}.{key}",
             "add stiffness: … or remove it"),
            (bool(spring.only) and turns, f"a spring in a joint that turns cannot only {spring.only}", f"{where}.only",
             "remove it"),
            (bool(spring.only) and not turns and not stiff, f"a spring that can only {spring.only} needs a stiffness",
             where, "add stiffness: … and free_length: …, at which it begins to act"),
        )  # fmt: skip


def spring_values(mechanism: Numbers, values: Values) -> Iterator[Finding]:
    """The sense of a preload, and a free angle that would count whole turns where nothing counts them."""
    for name, spring in mechanism.springs.items():
        where = f"springs.{name}"
        preload = values.get(f"{where}.preload", 0.0)
        if values.get(f"{where}.stiffness") == 0 and preload == 0:
            yield Finding("is 0: the spring does not pull", f"{where}.stiffness", "remove it", Severity.WARNING)
        if spring.only is not None and preload * (1 if spring.only == "pull" else -1) < 0:
            what = f"is {preload:g} N, which {'pushes' if preload < 0 else 'pulls'}; the spring can only {spring.only}"
            yield Finding(what, f"{where}.preload", "change its sign, or remove it")
        turns = np.abs(values.get(f"{where}.free_angle", np.nan)) / (2 * np.pi)
        if spring.joint not in mechanism.drivers and turns > 1:
            what = f"is {turns:.3g} turns, but the rotation of '{spring.joint}', which is not driven, counts none"
            yield Finding(what, f"{where}.free_angle", "state the angle within a turn and the winding as preload: …")


# ---- loads ----------------------------------------------------------------------------------------------------


def load_findings(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each load acts on a link or resists a joint, with what that needs."""
    for name, load in mechanism.loads.items():
        where, joint = f"loads.{name}", mechanism.effective_joints.get(load.joint or "")
        acts = [key for key in ("at", "force", "moment") if getattr(load, key) is not None]
        resists = [key for key in ("resisting_torque", "resisting_force") if getattr(load, key) is not None]
        if (load.link is None) == (load.joint is None):
            link, _, point = str(load.at or "").rpartition(".")
            remedy = (
                f"state link: {link}, at: {point}" if link in mechanism.effective_links else "state link: … or joint"
            )
            yield Finding("acts on neither or both of a link and a joint", where, remedy)
        elif load.link is not None:
            form = "one number" if mechanism.space == "planar" else "[x, y, z]"
            points = mechanism.points[load.link]
            yield from stated_wrongly(
                (bool(resists), "a resisting load acts on a joint, not a link", where,
                 "state joint: … instead of link: …"),
                (load.only is not None, "only is for a load that resists a joint", f"{where}.only",
                 "remove it, or state joint: …"),
                (not resists and load.force is None and load.moment is None, "this load is empty", where,
                 "state a force or a moment"),
                (load.force is not None and load.at is None, "the force has no point to act at", where,
                 "add at: <a point of the link>"),
                (load.moment is not None and isinstance(load.moment, tuple) != (mechanism.space == "spatial"),
                 f"the moment of a {mechanism.space} model is {form}", f"{where}.moment", f"write {form}"),
                (load.at is not None and load.at not in points, f"the link '{load.link}' has no point '{load.at}'",
                 f"{where}.at", nearest(load.at or "", points)),
            )  # fmt: skip
            if load.link == mechanism.fixed_link:
                what = "acts on the fixed link and has no effect"
                yield Finding(what, where, "name a moving link", Severity.WARNING)
        elif joint is not None:
            remedy = f"resist a {ONE_AXIS}, or state a force or moment on a link"
            yield from stated_wrongly(
                (load.frame != "global", "frame is for a load on a link", f"{where}.frame", "remove it"),
                (bool(acts), "at, force and moment are for a load on a link", where,
                 "state resisting_torque or resisting_force"),
                (not acts and not resists, "this load is empty", where, "state resisting_torque or resisting_force"),
                (len(resists) == 2, "resists a rotation and a slide at once", where, "state a load for each"),
            )  # fmt: skip
            for key in resists:
                freedom = "rotation" if key == "resisting_torque" else "slide"
                if freedom not in motions(joint.type):
                    axis = (
                        f"{freedom} to resist" if motions(joint.type) else "one axis that it could act about or along"
                    )
                    yield Finding(f"a {joint.type} joint has no {axis}", f"{where}.{key}", remedy)
