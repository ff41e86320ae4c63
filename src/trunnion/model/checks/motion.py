"""Checks of what moves: drivers with their motion laws, tables and motors; gear pairs; the rows of a loop."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, Severity, counted
from trunnion.joints.pairs import PAIRS
from trunnion.model.checks.loads import unread
from trunnion.model.joint_parts import has_pin, motions
from trunnion.model.names import nearest
from trunnion.model.parameters import Numbers
from trunnion.model.parts import PolarPoint
from trunnion.model.rules import faults

__all__ = ["driver_findings", "driver_values", "gear_values", "gears", "loop"]

Values = Mapping[str, Number]
LOOP_PAIRS = tuple(kind for kind, pair in PAIRS.items() if pair.one_axis)  # whose motion is a dual angle about one axis


def driver_findings(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each driver drives a joint that one number can move, by a law that fits it."""
    drivable = ", ".join(kind for kind, pair in PAIRS.items() if pair.drivable)
    for name, driver in mechanism.drivers.items():
        where, joint = f"drivers.{name}", mechanism.effective_joints[name]
        pair, moved = PAIRS[joint.type], mechanism.effective_joints[driver.moves or name]
        moves = f"has {counted(pair.count, 'freedom')}" if pair.count else "does not move"
        endless = not has_pin(moved.type) and driver.law == "constant" and driver.range is None
        natural = driver.points is not None and driver.ends == "natural"
        yield from faults(
            where,
            (not pair.drivable, "",
             f"the joint '{name}' is {joint.type}: it {moves} and cannot be driven by one number",
             f"drive one of {drivable}"),
            (driver.moves in mechanism.drivers, "moves", f"the joint '{driver.moves}' is driven itself"),
            (pair.drivable and endless, "", f"a driven {moved.type} joint needs a range", "add range: [0 mm, 50 mm]"),
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
        turns = gap / (2 * np.pi) if has_pin(joint.type) else np.inf
        open_end = driver.periodic and abs(gap) > 1e-9 * np.max(np.abs(places))
        yield from faults(
            where,
            (begin != 0, "points.0", f"the table begins at {begin:g} s", "begin it at 0 s and shift it by delay: …"),
            (len({*places}) == 1, "points", "the table never moves"),
            (open_end and not abs(turns - np.round(turns)) <= 1e-9, "points",
             f"a periodic table that begins at {places[0]:g} and ends at {places[-1]:g} (SI)",
             "end it where it begins, or whole turns from there, or state periodic: false"),
        )  # fmt: skip
    engaged, opened = value("motor.clutch_from", 0.0), value("motor.clutch_until", np.inf)
    yield from faults(
        where,
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
        sliding = [joint for joint in gear.joints if not has_pin(joints[joint].type)]
        keys = [key for key in ("ratio", "radius", "lead") if getattr(gear, key) is not None]
        states = f"{' and '.join(keys) or 'no ratio, radius or lead'} {'are' if len(keys) > 1 else 'is'} stated"
        shared, screw = {*joints[first].links} & {*joints[second].links}, gear.lead is not None
        wrong = [*faults(
            where,
            (mechanism.space == "spatial", "", "gear pairs are planar"),
            (name in joints, "", "a joint has this name too"),
            (len(sliding) == 2, "joints", "both joints slide", "name a revolute joint, or two"),
            (len(sliding) == 1 and keys not in (["radius"], ["lead"]), "",
             f"the joint '{'/'.join(sliding)}' slides, and {states}",
             "state radius: … of the wheel (rack, chain, rope), or lead: … (screw), not both"),
            (not sliding and keys != ["ratio"], "", f"both joints turn, and {states}", "state ratio: … alone"),
        )]  # fmt: skip
        yield from wrong
        if wrong:
            continue
        yield from faults(
            where,
            *((screw and key in gear.model_fields_set, key, "has no effect: a screw has no pitch point")
              for key in ("pressure_angle", "teeth")),
            (len(shared) == 2, "joints", "both joints are between the same two links"),
            (gear.touches and not shared, "",
             f"'{first}' and '{second}' have no link in common that carries both gears, or wheel and rack",
             "guide both on one link, or state teeth: false for a train, belt or chain that passes torques alone"),
        )  # fmt: skip
        thread = mechanism.joints.get(mechanism.coupled(name)[0]) if screw else None
        rubs = thread is not None and joints[mechanism.coupled(name)[0]].friction is not None
        if rubs and thread and not (thread.friction and thread.pin and thread.pin.radius):
            joint = mechanism.coupled(name)[0]
            remedy = f"state friction and pin.radius of {joint}, the mean radius of the thread, or friction: 0"
            yield Finding(f"its thread rubs as the pin of {joint} does by joint_defaults", where, remedy,
                          Severity.WARNING)  # fmt: skip


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
        (len(rows) == 1, "loop", "one joint makes no loop", "add the joints and links up to the ground again"),
        *((True, "loop", f"the joint or link '{name}' occurs in several rows") for name in again),
        (rows and fixed in mechanism.links and fixed not in links, "ground" if mechanism.ground else "loop",
         f"the fixed link '{fixed}' is not a link of the loop: {', '.join(links)}"),
        *((row.type not in LOOP_PAIRS, f"loop.{row.joint}.type",
           f"a {row.type} joint has no place in the table of a loop, whose joints move about one axis",
           f"use one of {', '.join(LOOP_PAIRS)}, or state links and joints instead") for row in rows),
        *((getattr(row, freedom) is not None, f"loop.{row.joint}.{freedom}",
           f"the {freedom} of a {row.type} joint is free, not constant")
          for row in rows for freedom in motions(row.type)),
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
