"""Checks of drivers: their motion laws, tables and motors; of gear pairs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, Severity, counted
from trunnion.joints.pairs import PAIRS
from trunnion.model.checks.loads import unread
from trunnion.model.joint_parts import has_pin
from trunnion.model.parameters import Numbers
from trunnion.model.rules import stated_wrongly

__all__ = ["driver_findings", "driver_values", "gear_values", "gears"]


def driver_findings(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each driver drives a joint that one number can move, by a law that fits it."""
    for name, driver in mechanism.drivers.items():
        where, joint = f"drivers.{name}", mechanism.effective_joints[name]
        pair, moved = PAIRS[joint.type], mechanism.effective_joints[driver.moves or name]
        drivable = [kind for kind, pair_kind in PAIRS.items() if pair_kind.drivable]
        moves = f"has {counted(pair.count, 'freedom')}" if pair.count else "does not move"
        endless = not has_pin(moved.type) and driver.law == "constant" and driver.range is None
        points, natural = driver.points or (), driver.points is not None and driver.ends == "natural"
        yield from stated_wrongly(
            (not pair.drivable, f"the joint '{name}' is {joint.type}: it {moves} and cannot be driven by one number",
             where, f"drive one that is {', '.join(drivable[:-1])} or {drivable[-1]}"),
            (driver.moves in mechanism.drivers, f"the joint '{driver.moves}' is driven itself", f"{where}.moves",
             "name one that is not"),
            (pair.drivable and endless, f"a driven {moved.type} joint needs a range", where,
             "add range: [0 mm, 50 mm]"),
            (driver.found and driver.law != "constant",
             f"the motion law {driver.law} prescribes a coordinate that is free", f"{where}.law",
             "state speed: … (what all but `simulate` prescribe), or no motor"),
            (bool(points) and driver.periodic and len(points) < 3, "a periodic table needs at least three points",
             f"{where}.points", "add points"),
            *((natural and key in driver.model_fields_set and bool(getattr(driver, key)),
               f"a table with natural ends has no '{key}'", f"{where}.{key}", f"remove ends or {key}")
              for key in ("periodic", "delay")),
        )  # fmt: skip
        if driver.file is not None and driver.law == "table":
            yield unread(driver.file, where)


def driver_values(mechanism: Numbers, name: str, values: Mapping[str, Number]) -> Iterator[Finding]:
    """Whether table, motor and range of a driver make a motion."""
    where, driver = f"drivers.{name}", mechanism.drivers[name]

    def value(path: str, absent: float = np.nan) -> float:
        return float(values.get(f"{where}.{path}", absent))

    if driver.points is not None:
        rows = range(len(driver.points))
        begin, places = value("points.0.time"), [value(f"points.{k}.coordinate") for k in rows]
        gap, joint = places[-1] - places[0], mechanism.effective_joints[driver.moves or name]
        turns = gap / (2 * np.pi) if has_pin(joint.type) else np.inf
        open_end = driver.periodic and abs(gap) > 1e-9 * np.max(np.abs(places))
        yield from stated_wrongly(
            (begin != 0, f"the table begins at {begin:g} s", f"{where}.points.0",
             "begin it at 0 s and shift it by delay: …"),
            (len({*places}) == 1, "the table never moves", f"{where}.points", "give it an extent"),
            (bool(open_end and not abs(turns - np.round(turns)) <= 1e-9),
             f"a periodic table that begins at {places[0]:g} and ends at {places[-1]:g} (SI)", f"{where}.points",
             "end it where it begins, or whole turns from there, or state periodic: false"),
        )  # fmt: skip
    start, end = value("range.from"), value("range.to")
    engaged, opened = value("motor.clutch_from", 0.0), value("motor.clutch_until", np.inf)
    yield from stated_wrongly(
        (start == end, f"the range begins and ends at {start:g}", f"{where}.range", "give it an extent"),
        *((value(f"motor.{effort}") * value(f"motor.{speed}") < 0,
           f"the motor drives away from its {speed}: their signs differ", f"{where}.motor.{effort}",
           f"give {effort} and {speed} the same sign")
          for effort, speed in (("stall_effort", "no_load_speed"), ("breakdown_effort", "synchronous_speed"))),
        (f"{where}.motor.clutch" in values and value("motor.inertia") == 0,
         "is 0, and a clutch needs a rotor that turns by itself while it slips", f"{where}.motor.inertia",
         "give a number above 0"),
        (opened <= engaged, f"the clutch opens at {opened:g} s, not after it engages at {engaged:g} s",
         f"{where}.motor.clutch_until", "give a time after clutch_from"),
    )  # fmt: skip


def gears(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each gear pair couples two joints that it can, and has teeth only where its gears can touch."""
    joints = mechanism.effective_joints
    for name, gear in mechanism.gears.items():
        where = f"gears.{name}"
        first, second = gear.joints
        sliding = [joint for joint in gear.joints if not has_pin(joints[joint].type)]
        keys = [key for key in ("ratio", "radius", "lead") if getattr(gear, key) is not None]
        states = f"{' and '.join(keys) or 'no ratio, radius or lead'} {'are' if len(keys) > 1 else 'is'} stated"
        shared = {*joints[first].links} & {*joints[second].links}
        faults = [*stated_wrongly(
            (mechanism.space == "spatial", "gear pairs are planar", where, "use a planar mechanism"),
            (name in joints, "a joint has this name too", where, "rename the gear pair"),
            (len(sliding) == 2, "both joints slide", f"{where}.joints", "name a revolute joint, or two"),
            (len(sliding) == 1 and keys not in (["radius"], ["lead"]),
             f"the joint '{'/'.join(sliding)}' slides, and {states}", where,
             "state radius: … of the wheel (rack, chain, rope), or lead: … (screw), not both"),
            (not sliding and keys != ["ratio"], f"both joints turn, and {states}", where,
             "state ratio: … alone, or name a prismatic joint"),
        )]  # fmt: skip
        yield from faults
        if faults:
            continue
        screw = gear.lead is not None
        yield from stated_wrongly(
            *((screw and key in gear.model_fields_set, "has no effect: a screw has no pitch point", f"{where}.{key}",
               "remove it") for key in ("pressure_angle", "teeth")),
            (len(shared) == 2, "both joints are between the same two links", f"{where}.joints",
             "name joints of three links"),
            (gear.touches and not shared,
             f"'{first}' and '{second}' have no link in common that carries both gears, or wheel and rack", where,
             "guide both on one link, or state teeth: false for a train, belt or chain that passes torques alone"),
        )  # fmt: skip
        threaded = mechanism.joints.get(mechanism.coupled(name)[0]) if screw else None
        rubs = threaded is not None and joints[mechanism.coupled(name)[0]].friction is not None
        if rubs and threaded and not (threaded.friction and threaded.pin and threaded.pin.radius):
            joint = mechanism.coupled(name)[0]
            what = f"its thread rubs as the pin of {joint} does by joint_defaults"
            remedy = f"state friction and pin.radius of {joint}, the mean radius of the thread, or friction: 0"
            yield Finding(what, where, remedy, Severity.WARNING)


def gear_values(mechanism: Numbers, values: Mapping[str, Number]) -> Iterator[Finding]:
    """Gears without a pitch point, or on one centre."""
    for name, gear in mechanism.gears.items():
        carriers = mechanism.carriers(name) if gear.ratio is not None and gear.teeth else None
        if carriers is None:
            continue
        where, ratio = f"gears.{name}", values[f"gears.{name}.ratio"]
        if abs((1 if carriers[0] == carriers[1] else -1) * ratio - 1) < 1e-9:
            what = "relative to the link that carries them, the gears turn equally: they have no pitch point"
            yield Finding(what, f"{where}.ratio", "state teeth: false, or another ratio")
        carrier = mechanism.effective_joints[gear.joints[0]].links[carriers[0]]
        paths = [f"links.{carrier}.points.{joint}" for joint in gear.joints]
        places = np.array([[values.get(f"{path}.{axis}", np.nan) for axis in "xy"] for path in paths], dtype=float)
        if np.hypot(*(places[1] - places[0])) <= 1e-12 * np.max(np.abs(places)):  # apart by no more than rounding
            what = "both joints are at the same point of the link that carries them: the centre distance is zero"
            yield Finding(what, where, "move one, or state teeth: false for gears inside each other or a belt")
