"""Checks of what moves and what acts: drivers, gear pairs, loops; loads, springs, and the tables that they speak of."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, counted
from trunnion.joints.pairs import PAIRS
from trunnion.model.expression import MOTION, PLACED, RESERVED
from trunnion.model.fields import drive_kind
from trunnion.model.names import as_key, nearest
from trunnion.model.parameters import Numbers
from trunnion.model.parts import PolarPoint
from trunnion.model.quantity import Quantity
from trunnion.model.rules import faults
from trunnion.model.units import ANY, KINDS, Dimension, UnitError, dimension_text, fits

Values = Mapping[str, Number]
ON_ONE_AXIS = tuple(kind for kind, pair in PAIRS.items() if pair.one_axis)  # whose motion is a dual angle about it


def driver_findings(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each driver drives a joint that one number can move, by a law that fits it."""
    for name, driver in mechanism.drivers.items():
        where, joint = f"drivers.{name}", mechanism.effective_joints[name]
        pair, moved = joint.pair, mechanism.effective_joints[driver.moves or name]
        moves = f"has {counted(pair.count, 'freedom')}" if pair.count else "does not move"
        endless = not moved.pair.turns and driver.law == "constant" and driver.range is None
        natural = driver.points is not None and driver.ends == "natural"
        yield from faults(
            where,
            (not pair.one_axis, "",
             f"the joint '{name}' is {joint.type}: it {moves} and cannot be driven by one number",
             f"drive one of {', '.join(ON_ONE_AXIS)}"),
            (driver.moves in mechanism.drivers, "moves", f"the joint '{driver.moves}' is driven itself"),
            (pair.one_axis and endless, "", f"a driven {moved.type} joint needs a range", "add range: [0 mm, 50 mm]"),
            (driver.found and driver.law != "constant", "law",
             f"the motion law {driver.law} prescribes a coordinate that is free",
             "state speed: … (what all but `simulate` prescribe), or no motor"),
            (driver.periodic and len(driver.points or (0, 0, 0)) < 3, "points",
             "a periodic table needs at least three points"),
            *((natural and key in driver.model_fields_set and getattr(driver, key), key,
               f"a table with natural ends has no '{key}'") for key in ("periodic", "delay")),
        )  # fmt: skip
        if driver.file is not None and driver.law == "table":
            yield unread(driver.file, where)


def driver_values(mechanism: Numbers, name: str, values: Values) -> Iterator[Finding]:
    """Whether table, motor and range of a driver make a motion."""
    where, driver = f"drivers.{name}", mechanism.drivers[name]

    def value(path: str, absent: float = np.nan) -> float:
        return float(values.get(f"{where}.{path}", absent))

    if driver.points is not None:
        begin, places = value("points.0.time"), [value(f"points.{k}.coordinate") for k in range(len(driver.points))]
        gap, joint = places[-1] - places[0], mechanism.effective_joints[driver.moves or name]
        turns = gap / (2 * np.pi) if joint.pair.turns else np.inf
        open_end = driver.periodic and abs(gap) > 1e-9 * np.max(np.abs(places))
        yield from faults(
            where,
            (begin != 0, "points.0", f"the table begins at {begin:g} s", "begin it at 0 s and shift it by delay: …"),
            (open_end and not abs(turns - np.round(turns)) <= 1e-9, "points",
             f"a periodic table that begins at {places[0]:g} and ends at {places[-1]:g} (SI)",
             "end it where it begins, or whole turns from there, or state periodic: false"),
        )  # fmt: skip
    engaged, opened = value("motor.clutch_from", 0.0), value("motor.clutch_until", np.inf)
    with np.errstate(all="ignore"):
        lasts = np.divide(value("range.to") - value("range.from"), value("speed"))
    yield from faults(
        where,
        (np.isinf(lasts), "range", "no number of seconds is long enough to pass the range at the speed"),
        (value("range.from") == value("range.to"), "range", f"the range begins and ends at {value('range.from'):g}"),
        *((value(f"motor.{effort}") * value(f"motor.{speed}") < 0, f"motor.{effort}",
           f"the motor drives away from its {speed}: their signs differ")
          for effort, speed in (("stall_effort", "no_load_speed"), ("breakdown_effort", "synchronous_speed"))),
        (f"{where}.motor.clutch" in values and value("motor.inertia") == 0, "motor.inertia",
         "is 0, and a clutch needs a rotor that turns by itself while it slips"),
        (opened <= engaged, "motor.clutch_until",
         f"the clutch opens at {opened:g} s, not after it engages at {engaged:g} s"),
    )  # fmt: skip


def gears(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each gear pair couples two joints that it can, and has teeth only where its gears can touch."""
    joints = mechanism.effective_joints
    for name, gear in mechanism.gears.items():
        where, (first, second) = f"gears.{name}", gear.joints
        sliding = [joint for joint in gear.joints if not joints[joint].pair.turns]
        shared, screw = {*joints[first].links} & {*joints[second].links}, gear.lead is not None
        yield from faults(
            where,
            (mechanism.space == "spatial", "", "gear pairs are planar"),
            (name in joints, "", "a joint has this name too"),
            (len(sliding) == 2, "joints", "both joints slide", "name a revolute joint, or two"),
            (len(sliding) == 1 and not gear.slides, "ratio", f"is stated, and the joint '{'/'.join(sliding)}' slides",
             "state radius: … of the wheel (rack, chain, rope), or lead: … (screw)"),
            (not sliding and gear.slides, "lead" if screw else "radius", "is stated, and both joints turn",
             "state ratio: …"),
            (len(shared) == 2, "joints", "both joints are between the same two links"),
            (gear.touches and not shared, "",
             f"'{first}' and '{second}' have no link in common that carries both gears, or wheel and rack",
             "guide both on one link, or state teeth: false for a train, belt or chain that passes torques alone"),
        )  # fmt: skip


def gear_values(mechanism: Numbers, values: Values) -> Iterator[Finding]:
    """Gears without a pitch point, or on one centre."""
    for name, gear in mechanism.gears.items():
        carriers = mechanism.carriers(name) if gear.ratio is not None and gear.teeth else None
        if carriers is None:
            continue
        ratio = (1 if carriers[0] == carriers[1] else -1) * values[f"gears.{name}.ratio"]
        carrier = mechanism.effective_joints[gear.joints[0]].links[carriers[0]]
        paths = [f"links.{carrier}.points.{joint}" for joint in gear.joints]
        places = np.array([[values.get(f"{path}.{axis}", np.nan) for axis in "xy"] for path in paths], dtype=float)
        yield from faults(
            f"gears.{name}",
            (abs(ratio - 1) < 1e-9, "ratio",
             "relative to the link that carries them, the gears turn equally: they have no pitch point",
             "state teeth: false, or another ratio"),
            (np.hypot(*(places[1] - places[0])) <= 1e-12 * np.max(np.abs(places)), "",  # apart by no more than rounding
             "both joints are at the same point of the link that carries them: the centre distance is zero",
             "move one, or state teeth: false for gears inside each other or a belt"),
        )  # fmt: skip


def loop(mechanism: Numbers) -> Iterator[Finding]:
    """Whether the rows of the loop make one chain; frames and centres of links that only a loop, or a plane, has."""
    rows, fixed = mechanism.loop, mechanism.fixed_link
    links, joints = [row.link for row in rows], [row.joint for row in rows]
    again = sorted({name for names in (joints, links) for name in names if names.count(name) > 1})
    yield from faults(
        "",
        (rows and mechanism.space == "planar", "loop", "a loop is spatial", "state space: spatial"),
        (rows and mechanism.joints, "joints", "joints and loop are both given"),
        *((True, "loop", f"the joint or link '{name}' occurs in several rows") for name in again),
        (rows and fixed in mechanism.links and fixed not in links, "ground" if mechanism.ground else "loop",
         f"the fixed link '{fixed}' is not a link of the loop: {', '.join(links)}"),
        *((row.type not in ON_ONE_AXIS, f"loop.{row.joint}.type",
           f"a {row.type} joint has no place in the table of a loop, whose joints move about one axis",
           f"use one of {', '.join(ON_ONE_AXIS)}, or state links and joints instead") for row in rows),
        *((getattr(row, freedom) is not None, f"loop.{row.joint}.{freedom}",
           f"the {freedom} of a {row.type} joint is free, not constant")
          for row in rows for freedom in PAIRS[row.type].motions),
    )  # fmt: skip
    for name, link in mechanism.links.items():
        ends = [joint for joint, entry in mechanism.effective_joints.items() if name in entry.links]
        yield from faults(
            f"links.{name}",
            (link.frame is not None and not rows, "frame", "frame is for the links of a loop"),
            (link.frame is not None and rows and ends and link.frame not in ends, "frame",
             f"'{link.frame}' is not a joint of the link '{name}'", nearest(link.frame or "", ends)),
            (mechanism.space == "spatial" and isinstance(link.centre, PolarPoint), "centre",
             "distance and angle place a point in the plane only"),
            *((point in ends, f"points.{point}",
               f"the joint '{point}' is where the loop has it, and cannot be placed again")
              for point in (link.points if rows else ())),
        )  # fmt: skip


Dimensions = Mapping[str, Dimension | None]
RATES = {KINDS["angle"]: KINDS["angular speed"], KINDS["length"]: KINDS["speed"]}


# ---- names in the expressions of loads ------------------------------------------------------------------------


def motion_dimensions(mechanism: Numbers, names: Dimensions) -> dict[str, Dimension | None]:
    """What an expression in a load may speak of beside the dimensions, and what each measures.

    Turns and slides of joints, coordinates of points and their rates are named as the columns of a result.
    """
    kinds = {"time": KINDS["time"]}
    if next(iter(mechanism.drivers), "") in mechanism.effective_joints:
        kinds |= {"drive": drive_kind(mechanism), "speed": RATES[drive_kind(mechanism)]}
    for name, joint in mechanism.effective_joints.items():
        for freedom in joint.pair.motions:
            kind = KINDS["angle" if freedom == "rotation" else "length"]
            kinds |= {f"{name}.{freedom}": kind, f"{name}.{freedom}_velocity": RATES[kind]}
    for point in mechanism.named("point"):
        for axis in "xyz"[: mechanism.coordinates]:
            kinds |= {f"{point}.{axis}": KINDS["length"], f"{point}.velocity_{axis}": KINDS["speed"]}
    measured = {name: [_measure(value, names) for _, value in table.points] for name, table in mechanism.tables.items()}
    of_tables = {name: next((kind for kind in column if kind), None) for name, column in measured.items()}
    return {**{name: kind.dimensions[0] for name, kind in kinds.items()}, **of_tables}


def _measure(value: Quantity, names: Dimensions) -> Dimension | None:
    with suppress(UnitError, KeyError):  # findings of their own
        return value.check(names, ANY)
    return None


def unknown_name(mechanism: Numbers, name: str, path: str, source: object, names: Dimensions) -> Finding:
    """A name in an expression that means nothing there."""
    refers = "" if str(source).strip() == name else f"refers to '{name}', which "
    moves = motion_dimensions(mechanism, names) if path.startswith("loads.") else {}
    remedy = nearest(name, [*names, *moves])
    if not moves and (PLACED in name or name in MOTION or name in mechanism.tables):
        remedy = "motions of joints and points, drive, speed, time and tables are for loads"
    elif moves and name in MOTION:
        remedy = "the model has no driver"
    return Finding(f"'{source}' {refers}is not one of the dimensions", path, remedy)


# ---- tables ---------------------------------------------------------------------------------------------------


def expression_name(name: str, where: str) -> Iterator[Finding]:
    """Whether a dimension or a table can be spoken of in an expression by its name."""
    if name in RESERVED or name in MOTION:
        yield Finding(f"'{name}' is a reserved name of expressions", where)
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
        example = "[[0 s, 40 bar], [1 s, 40 bar]]" if table.over == "time" else "[[0 deg, 40 bar], [360 deg, 40 bar]]"
        yield from faults(
            where,
            (name in mechanism.dimensions, "", f"'{name}' is a dimension"),
            (table.over == "drive" and not mechanism.drivers, "",
             "is over the coordinate of a driver, and there is none"),
            (not count, "", "has no points",
             f"state points: {example}, or file: {as_key(f'{name}.csv')}, or give a file by --table"),
            (count and table.repeats and count < (3 if table.period is None else 2), "points",
             "a periodic table needs three points"),
        )  # fmt: skip
        measures = [_measure(value, names) for _, value in table.points]
        first = next((measured for measured in measures if measured), None)
        for k, measured in enumerate(measures):
            if measured and first and not (fits(measured, first) and fits(first, measured)):
                what = f"is {dimension_text(measured)}, the values before are {dimension_text(first)}"
                yield Finding(what, f"{where}.points.{k}.value")


def unread(file: str, where: str) -> Finding:
    """Of a table that names a file in a model that was not read from one."""
    what = f"names the file '{file[:60]}', but this model was not read from a file and has no folder"
    remedy = "give its points instead, or write the model into a file beside it and read that"
    return Finding(what, f"{where}.file", remedy)


SAME = 1e-9  # of a period, or of the largest value
FITS = 1e-4  # of a cycle: what a period may be off a part of it, as 6.283 rad is


def table_values(mechanism: Numbers, values: Values) -> Iterator[Finding]:
    """Whether a periodic table ends as it begins, and after what the motion does."""
    for name, table in mechanism.tables.items():
        where = f"tables.{name}.points"
        if not table.repeats or not table.points:
            continue
        begin, end = f"{where}.0", f"{where}.{len(table.points) - 1}"
        extent, period = values[f"{end}.at"] - values[f"{begin}.at"], values.get(f"tables.{name}.period", np.nan)
        closed = not extent < period * (1 - SAME)  # by its last point, not by its period
        first, last = values[f"{begin}.value"], values[f"{end}.value"]
        largest = max(abs(values[f"{where}.{k}.value"]) for k in range(len(table.points)))
        cycle, unit = _cycle(mechanism, table.over, values)
        size, full = (f"{np.degrees(length) if unit == 'deg' else length:.6g} {unit}" for length in (extent, cycle))
        ratio = max(cycle / extent, extent / cycle) if extent > 0 else np.nan
        if extent > period * (1 + SAME):
            yield Finding(f"is {period:g}, and the points go over {extent:g} (SI)", f"tables.{name}.period")
        elif closed and abs(last - first) > SAME * largest:
            state = f", or state period: {full}" if table.period is None and extent < cycle * (1 - SAME) else ""
            remedy = f"end it with the value it begins with, one period later{state}"
            yield Finding(f"a periodic table that begins at {first:g} and ends at {last:g} (SI)", where, remedy)
        elif table.period is None and abs(ratio - np.round(ratio)) > FITS:
            what = f"it repeats after {size}, which is neither a part nor a multiple of the cycle of {full}"
            yield Finding(what, where, f"end it one cycle after its first point, or state period: {size}")


def _cycle(mechanism: Numbers, over: str, values: Values) -> tuple[float, str]:
    """After what the motion repeats, nan if it does not, and its unit: a turn of the driver, or a time."""
    first = next(iter(mechanism.drivers), "")
    joint, driver = mechanism.effective_joints.get(first), mechanism.drivers.get(first)
    if over == "drive":
        return (2 * np.pi if joint and joint.pair.turns else np.nan), "deg"
    if driver is not None and len(mechanism.drivers) == 1 and driver.law != "table" and not driver.moves:
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
        turns = joint is not None and joint.pair.turns
        key, other = ("free_angle", "free_length") if turns else ("free_length", "free_angle")
        free, stiff = getattr(spring, key) is not None, spring.stiffness is not None
        yield from faults(
            where,
            (len(ends) == 1, "between", f"both ends are on the link '{min(ends, default='')}'"),
            (joint is not None and not joint.pair.motions, "joint",
             f"a {joint and joint.type} joint has no one axis for a spring to act about or along",
             f"put it in a {ONE_AXIS}, or between two points"),
            (getattr(spring, other) is not None, other, f"this spring has no {other}", f"state {key} instead"),
            (stiff and not free, "", f"a stiffness without a {key}", f"add {key}: …; its force there is the preload"),
            (spring.only and turns, "only", f"a spring in a joint that turns cannot only {spring.only}"),
        )  # fmt: skip


def spring_values(mechanism: Numbers, values: Values) -> Iterator[Finding]:
    """The sense of a preload, and a free angle that would count whole turns where nothing counts them."""
    for name, spring in mechanism.springs.items():
        where, preload = f"springs.{name}", values.get(f"springs.{name}.preload", 0.0)
        turns = np.abs(values.get(f"{where}.free_angle", np.nan)) / (2 * np.pi)
        pushes = preload < 0
        yield from faults(
            where,
            (spring.only and preload != 0 and pushes == (spring.only == "pull"), "preload",
             f"is {preload:g} N, which {'pushes' if pushes else 'pulls'}; the spring can only {spring.only}"),
            (spring.joint not in mechanism.drivers and turns > 1, "free_angle",
             f"is {turns:.3g} turns, but the rotation of '{spring.joint}', which is not driven, counts none",
             "state the angle within a turn and the winding as preload: …"),
        )  # fmt: skip


# ---- loads ----------------------------------------------------------------------------------------------------


def load_findings(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each load acts at a point of its link, or along a freedom of its joint."""
    spatial = mechanism.space == "spatial"
    for name, load in mechanism.loads.items():
        where, joint = f"loads.{name}", mechanism.effective_joints.get(load.joint or "")
        points, freed = mechanism.points.get(load.link or "", ()), joint.pair.motions if joint else ()
        resists = {"resisting_torque": "rotation", "resisting_force": "slide"}
        yield from faults(
            where,
            (load.moment is not None and isinstance(load.moment, tuple) != spatial, "moment",
             f"the moment of a {mechanism.space} model is {'[x, y, z]' if spatial else 'one number'}"),
            (load.at is not None and load.at not in points, "at",
             f"the link '{load.link}' has no point '{load.at}'", nearest(load.at or "", points)),
            *((getattr(load, key) is not None and freedom not in freed, key,
               f"a {joint and joint.type} joint has no "
               f"{f'{freedom} to resist' if freed else 'one axis that it could act about or along'}",
               f"resist a {ONE_AXIS}, or state a force or moment on a link") for key, freedom in resists.items()),
        )  # fmt: skip
