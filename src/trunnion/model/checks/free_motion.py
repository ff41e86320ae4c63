"""Checks of a driver whose motion is found: its motor, and where it begins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from trunnion.errors import Finding

__all__ = ["motor_values"]


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
