"""Checks of drivers: their motion laws, tables and motors; of gear pairs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding
from trunnion.model.parameters import Numbers
from trunnion.model.parts import freedoms

__all__ = [
    "gear_values",
    "gears",
    "motor_values",
]


def motor_values(values: Mapping[str, float], where: str) -> Iterator[Finding]:
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
    """Whether each gear pair speaks of two joints that turn, and has teeth only where its gears can touch."""
    joints = mechanism.effective_joints
    for name, gear in mechanism.gears.items():
        where = f"gears.{name}"
        if mechanism.space == "spatial":
            yield Finding("gear pairs are planar", where, "use a planar mechanism")
            continue
        if name in joints:
            yield Finding("a joint has this name too", where, "rename the gear pair")
        for joint in gear.joints:
            if joint in joints and "rotation" not in freedoms(joints[joint].type):
                yield Finding(f"the joint '{joint}' does not turn", f"{where}.joints", "name a revolute joint")
        if gear.joints[0] != gear.joints[1] and all(joint in joints for joint in gear.joints):
            yield from _teeth(mechanism, name, where)


def _teeth(mechanism: Numbers, name: str, where: str) -> Iterator[Finding]:
    gear = mechanism.gears[name]
    one, two = (mechanism.effective_joints[joint].links for joint in gear.joints)
    shared = set(one) & set(two)
    if len(shared) == 2:
        yield Finding("both joints are between the same two links", f"{where}.joints", "name joints of three links")
    elif gear.teeth and not shared:
        what = f"'{gear.joints[0]}' and '{gear.joints[1]}' have no link in common that carries both gears"
        yield Finding(what, where, "state teeth: false for a train, belt or chain that passes torques alone")


def gear_values(mechanism: Numbers, values: Mapping[str, Number]) -> Iterator[Finding]:
    """Gears without a pitch point, or on one centre."""
    for name, gear in mechanism.gears.items():
        where = f"gears.{name}"
        ratio = values.get(f"{where}.ratio", np.nan)
        known = len({*gear.joints} & mechanism.effective_joints.keys()) == len(gear.joints)
        carriers = mechanism.carriers(name) if known else None
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
