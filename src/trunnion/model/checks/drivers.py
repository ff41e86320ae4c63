"""Checks of drivers: their motion laws, tables and motors; of gear pairs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, Severity, counted
from trunnion.joints.pairs import PAIRS
from trunnion.model.checks.loads import unread
from trunnion.model.names import nearest
from trunnion.model.parameters import Numbers
from trunnion.model.parts import Driver, Joint, freedoms

__all__ = ["driver_findings", "driver_values", "gear_values", "gears"]


def driver_findings(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each driver drives a joint that one number can move, by a law that fits it."""
    joints = mechanism.effective_joints
    for name, driver in mechanism.drivers.items():
        where = f"drivers.{name}"
        if name not in joints:
            yield Finding(f"there is no joint '{name}' to drive", where, nearest(name, joints))
        elif not PAIRS[joints[name].type].drivable:
            pair, drivable = PAIRS[joints[name].type], [kind for kind, pair_kind in PAIRS.items() if pair_kind.drivable]
            moves = f"has {counted(pair.count, 'freedom')}" if pair.count else "does not move"
            what = f"the joint '{name}' is {joints[name].type}: it {moves} and cannot be driven by one number"
            yield Finding(what, where, f"drive one that is {', '.join(drivable[:-1])} or {drivable[-1]}")
        elif driver.moves in mechanism.drivers:
            yield Finding(f"the joint '{driver.moves}' is driven itself", f"{where}.moves", "name one that is not")
        elif (moved := joints.get(driver.moves or name)) and _slides_without_end(driver, moved):
            yield Finding(f"a driven {moved.type} joint needs a range", where, "add range: [0 mm, 50 mm]")
        yield from _motion(driver, where)


def _slides_without_end(driver: Driver, moved: Joint) -> bool:
    """Whether a joint that does not turn is to move at a constant speed for ever."""
    return "rotation" not in freedoms(moved.type) and driver.law == "constant" and driver.range is None


def _motion(driver: Driver, where: str) -> Iterator[Finding]:
    """Whether a table that a driver follows can be read, and what else it states goes with it."""
    if driver.file is not None and driver.law == "table":
        yield unread(driver.file, where)
    if driver.found and driver.law != "constant":
        what = f"the motion law {driver.law} prescribes a coordinate that is free"
        yield Finding(what, f"{where}.law", "state speed: … (what all but `simulate` prescribe), or no motor")
    if driver.points is not None and driver.periodic and len(driver.points) < 3:
        yield Finding("a periodic table needs at least three points", f"{where}.points", "add points")
    if driver.points is not None and driver.ends == "natural":
        for key in ("periodic", "delay"):
            if key in driver.model_fields_set and getattr(driver, key):
                yield Finding(f"a table with natural ends has no '{key}'", f"{where}.{key}", f"remove ends or {key}")


def driver_values(mechanism: Numbers, name: str, values: Mapping[str, Number]) -> Iterator[Finding]:
    """Whether table, motor and range of a driver make a motion."""
    where, driver = f"drivers.{name}", mechanism.drivers[name]
    if driver.points is not None:
        yield from _table(mechanism, name, values)
    yield from _motor_values(values, where)
    start, end = (values.get(f"{where}.range.{end}", np.nan) for end in ("from", "to"))
    if start == end:
        yield Finding(f"the range begins and ends at {start:g}", f"{where}.range", "give it an extent")


def _table(mechanism: Numbers, name: str, values: Mapping[str, Number]) -> Iterator[Finding]:
    """Whether the points of a driver's table make a motion."""
    driver, where = mechanism.drivers[name], f"drivers.{name}.points"
    rows = range(len(driver.points or ()))
    times, coordinates = ([values[f"{where}.{k}.{key}"] for k in rows] for key in ("time", "coordinate"))
    if times[0] != 0 and not np.isnan(times[0]):
        what = f"the table begins at {times[0]:g} s"
        yield Finding(what, f"{where}.0", "begin it at 0 s and shift it by delay: …")
    if all(coordinate == coordinates[0] for coordinate in coordinates):
        yield Finding("the table never moves", where, "give it an extent")
    joint = mechanism.effective_joints.get(driver.moves or name)
    gap = coordinates[-1] - coordinates[0]
    if driver.periodic and joint and abs(gap) > 1e-9 * np.max(np.abs(coordinates)):
        turns = gap / (2 * np.pi)
        if "rotation" not in freedoms(joint.type) or abs(turns - np.round(turns)) > 1e-9:
            what = f"a periodic table that begins at {coordinates[0]:g} and ends at {coordinates[-1]:g} (SI)"
            yield Finding(what, where, "end it where it begins, or whole turns from there, or state periodic: false")


def _motor_values(values: Mapping[str, float], where: str) -> Iterator[Finding]:
    """Whether the numbers of a motor can be those of one."""
    where = f"{where}.motor"
    for effort, speed in (("stall_effort", "no_load_speed"), ("breakdown_effort", "synchronous_speed")):
        if values.get(f"{where}.{effort}", np.nan) * values.get(f"{where}.{speed}", np.nan) < 0:
            what = f"the motor drives away from its {speed}: their signs differ"
            yield Finding(what, f"{where}.{effort}", f"give {effort} and {speed} the same sign")
    yield from _clutch_values(values, where)


def _clutch_values(values: Mapping[str, float], where: str) -> Iterator[Finding]:
    """Whether a clutch has a rotor to hold, and engages before it opens."""
    if f"{where}.clutch" in values and values.get(f"{where}.inertia") == 0.0:
        what = "is 0, and a clutch needs a rotor that turns by itself while it slips"
        yield Finding(what, f"{where}.inertia", "give a number above 0")
    begin, end = values.get(f"{where}.clutch_from", 0.0), values.get(f"{where}.clutch_until", np.inf)
    if end <= begin:
        what = f"the clutch opens at {end:g} s, not after it engages at {begin:g} s"
        yield Finding(what, f"{where}.clutch_until", "give a time after clutch_from")


def gears(mechanism: Numbers) -> Iterator[Finding]:
    """Whether each gear pair speaks of two joints that it can couple, and has teeth only where its gears can touch."""
    joints = mechanism.effective_joints
    for name, gear in mechanism.gears.items():
        where = f"gears.{name}"
        if mechanism.space == "spatial":
            yield Finding("gear pairs are planar", where, "use a planar mechanism")
            continue
        if name in joints:
            yield Finding("a joint has this name too", where, "rename the gear pair")
        if gear.joints[0] != gear.joints[1] and all(joint in joints for joint in gear.joints):
            faults = list(_coupling(mechanism, name, where))
            yield from faults
            if all(fault.severity is not Severity.ERROR for fault in faults):
                yield from _teeth(mechanism, name, where)


def _coupling(mechanism: Numbers, name: str, where: str) -> Iterator[Finding]:
    """Whether a gear pair states the one number that couples two rotations, or a rotation and a slide."""
    gear = mechanism.gears[name]
    sliding = [joint for joint in gear.joints if "rotation" not in freedoms(mechanism.effective_joints[joint].type)]
    keys = [key for key in ("ratio", "radius", "lead") if getattr(gear, key) is not None]
    if len(sliding) == 2:
        yield Finding("both joints slide", f"{where}.joints", "name a revolute joint, or two")
    elif sliding and keys not in (["radius"], ["lead"]):
        what = f"the joint '{sliding[0]}' slides, and {_states(keys)}"
        yield Finding(what, where, "state radius: … of the wheel (rack, chain, rope), or lead: … (screw), not both")
    elif not sliding and keys != ["ratio"]:
        remedy = "state ratio: … alone" if "ratio" in keys or not keys else "state ratio: …, or name a prismatic joint"
        yield Finding(f"both joints turn, and {_states(keys)}", where, remedy)
    elif gear.lead is not None:
        yield from _thread(mechanism, mechanism.coupled(name)[0], where)
        for key in sorted({"teeth", "pressure_angle"} & gear.model_fields_set):
            yield Finding("has no effect: a screw has no pitch point", f"{where}.{key}", "remove it")


def _thread(mechanism: Numbers, joint: str, where: str) -> Iterator[Finding]:
    """Whether the friction of a thread was meant: the defaults are those of pins."""
    joint_entry = mechanism.joints.get(joint)
    if joint_entry is None or mechanism.effective_joints[joint].friction is None:
        return
    if joint_entry.friction is None or joint_entry.pin is None or joint_entry.pin.radius is None:
        what = f"its thread rubs as the pin of {joint} does by joint_defaults"
        remedy = f"state friction and pin.radius of {joint}, the mean radius of the thread, or friction: 0"
        yield Finding(what, where, remedy, Severity.WARNING)


def _states(keys: list[str]) -> str:
    return f"{' and '.join(keys) or 'no ratio, radius or lead'} {'are' if len(keys) > 1 else 'is'} stated"


def _teeth(mechanism: Numbers, name: str, where: str) -> Iterator[Finding]:
    gear = mechanism.gears[name]
    first, second = gear.joints
    first_sides, two = (mechanism.effective_joints[joint].links for joint in gear.joints)
    shared = set(first_sides) & set(two)
    if len(shared) == 2:
        yield Finding("both joints are between the same two links", f"{where}.joints", "name joints of three links")
    elif gear.radius is not None and not shared:
        what = f"'{first}' and '{second}' have no link in common that carries the wheel and guides the rack or rope"
        yield Finding(what, where, "guide it on the link on which the wheel turns")
    elif gear.touches and not shared:
        what = f"'{first}' and '{second}' have no link in common that carries both gears"
        yield Finding(what, where, "state teeth: false for a train, belt or chain that passes torques alone")


def gear_values(mechanism: Numbers, values: Mapping[str, Number]) -> Iterator[Finding]:
    """Gears without a pitch point, or on one centre."""
    for name, gear in mechanism.gears.items():
        where = f"gears.{name}"
        if gear.ratio is None:
            continue
        ratio = values.get(f"{where}.ratio", np.nan)
        complete = len({*gear.joints} & mechanism.effective_joints.keys()) == len(gear.joints)
        carriers = mechanism.carriers(name) if complete else None
        if gear.teeth and carriers and abs((1 if carriers[0] == carriers[1] else -1) * ratio - 1) < 1e-9:
            what = "relative to the link that carries them, the gears turn equally: they have no pitch point"
            yield Finding(what, f"{where}.ratio", "state teeth: false, or another ratio")
        if gear.teeth and carriers and not _apart(mechanism, name, carriers, values):
            what = "both joints are at the same point of the link that carries them: the centre distance is zero"
            yield Finding(what, where, "move one, or state teeth: false for gears inside each other or a belt")


def _apart(mechanism: Numbers, name: str, carriers: tuple[int, int], values: Mapping[str, Number]) -> bool:
    """Whether the centres of two gears are apart, by more than rounding of where they lie."""
    joints = mechanism.gears[name].joints
    carrier = mechanism.effective_joints[joints[0]].links[carriers[0]]
    places = [[values.get(f"links.{carrier}.points.{joint}.{axis}", np.nan) for axis in "xy"] for joint in joints]
    (ax, ay), (dx, dy) = places
    distance = np.hypot(dx - ax, dy - ay)
    return not distance <= 1e-12 * max(abs(ax), abs(ay), abs(dx), abs(dy))
