"""Checks of a driver whose motion is found: its motor, and where it begins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from trunnion.errors import Finding
from trunnion.joints.motors import MOTORS
from trunnion.model.parts import Driver

__all__ = ["FREE", "free_motion", "motor_values"]

FREE = ("free", "motor", "initial")  # keys of a driver that no motion law takes
# of every kind of motor
COMMON = (
    *("kind", "ratio", "efficiency", "inertia", "off_from", "brake", "brake_from"),
    *("clutch", "clutch_from", "clutch_until"),
)
EXAMPLES = {
    "effort": "4 N m",
    "stall_effort": "4 N m",
    "no_load_speed": "1500 rpm",
    "breakdown_effort": "20 N m",
    "breakdown_slip": "0.2",
    "synchronous_speed": "1500 rpm",
    "points": "[[0 rpm, 4 N m], [1500 rpm, 0 N m]]",
    "target": "300 rpm",
    "proportional": "0.5 N m s/rad",
    "limit": "10 N m",
}


def free_motion(driver: Driver, where: str) -> Iterator[Finding]:
    """Whether a driver states what its motor needs and nothing else, and whether motion in time can free it."""
    if driver.initial is not None and not driver.found:
        what = "'initial' has no effect on a driver whose motion is prescribed"
        yield Finding(what, f"{where}.initial", "remove it, or state free: true or a motor")
    if driver.found and driver.law != "constant":
        what = f"the motion law {driver.law} prescribes a coordinate that is free"
        yield Finding(what, f"{where}.law", "state speed: … (what all but `simulate` prescribe), or no motor")
    motor = driver.motor
    if motor is None:
        return
    takes = (*COMMON, *motor.of.needs, *motor.of.takes)
    for key in sorted(motor.model_fields_set - set(takes)):
        remedy = f"remove it; the keys of {motor.kind} are {', '.join(takes)}"
        yield Finding(f"'{key}' has no effect on a motor of the kind {motor.kind}", f"{where}.motor.{key}", remedy)
    for key in motor.of.needs:
        if getattr(motor, key) is None:
            kinds = ", ".join(MOTORS)
            remedy = f"add {key}: {EXAMPLES[key]}, or state another kind: {kinds}"
            yield Finding(f"'{key}' is missing", f"{where}.motor", remedy)
    for key, other in (("brake", "brake_from"), ("brake_from", "brake")):
        if getattr(motor, key) is not None and getattr(motor, other) is None:
            yield Finding(f"a brake needs '{other}'", f"{where}.motor.{key}", f"add {other}")
    for key in ("clutch_from", "clutch_until"):
        if getattr(motor, key) is not None and motor.clutch is None:
            yield Finding("there is no clutch", f"{where}.motor.{key}", "add clutch: 5 N m, what it transmits at most")
    if motor.clutch is not None and motor.inertia is None:
        what = "a clutch needs the inertia of the rotor, which turns by itself while it slips"
        yield Finding(what, f"{where}.motor.clutch", "add inertia: 0.02 kg m^2, on the motor's side")


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
