"""In which units numbers are shown: SI with prefixes, or feet, inches and pounds if the model states those.

What is shown within `shown_as` follows the model at hand: all sentences, tables and pictures ask the same formatter
(`results.quantities`), which asks here. Files keep their units.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from types import MappingProxyType
from typing import Any

from trunnion.model.units import si_unit, unit

__all__ = ["ScreenUnits", "follow", "in_use", "shown_as", "stated_by", "stated_units"]

ScreenUnits = Mapping[str, tuple[float, str]]  # SI unit → factor and unit in which a number of it is shown
ANGLES = {"rad": "deg"}  # where no angle is stated; nobody reads radians
LENGTHS = {**dict.fromkeys(("ft", "foot", "feet"), "ft"), **dict.fromkeys(("in", "inch", "inches"), "in"), "yd": "ft"}
POUNDS = re.compile(r"\b(lbf|ozf|kip|lbs?|oz|slug|psi|ksi|hp)\b")
_NONE: ScreenUnits = MappingProxyType({})
_IN_USE: ContextVar[ScreenUnits] = ContextVar("units in use", default=_NONE)


def stated_units(mechanism: Any) -> dict[str, str]:
    """The unit that a mechanism states most often, for each unit of SI: {"m": "mm", "rad": "deg"}."""
    if "stated_units" not in mechanism.worked_out:
        entries = [entry for entry in mechanism.parameter_set.entries.values() if not entry.alias]
        stated = [entry.quantity.unit for entry in entries if entry.quantity.unit[:1] not in ("", "1", "%", "‰")]
        units: dict[str, str] = {}
        for text, _ in Counter(stated).most_common():
            units.setdefault(si_unit(unit(text)[1]), text)
        mechanism.worked_out["stated_units"] = {si: text for si, text in (ANGLES | units).items() if si != text}
    return dict(mechanism.worked_out["stated_units"])


def _customary(units_stated: Mapping[str, str]) -> ScreenUnits:
    """Feet or inches for lengths that are stated so, pounds for forces, and what follows of both."""
    length = LENGTHS.get(units_stated.get("m", ""), "")
    pounds = any(POUNDS.search(units_stated.get(si, "")) for si in ("N", "N m", "kg", "Pa", "N/m", "W"))
    units = {"m": length, "m/s": f"{length}/s", "m/s^2": f"{length}/s^2"} if length else {}
    if pounds:
        force = units_stated["N"] if POUNDS.search(units_stated.get("N", "")) else "lbf"
        torque = units_stated["N m"] if POUNDS.search(units_stated.get("N m", "")) else f"{force} {length or 'ft'}"
        units |= {"N": force, "N m": torque, "J": torque, "W": f"{torque}/s", "Pa": "psi", "N s": f"{force} s"}
        units |= {"N/m": f"{force}/{length or 'ft'}"}
        units |= {si: units_stated[si] for si in ("W", "Pa") if POUNDS.search(units_stated.get(si, ""))}
    return {si: (1 / float(unit(text)[0]), text.replace("^2", "²")) for si, text in units.items()}


def in_use() -> ScreenUnits:
    """The units in use; what is not among them is shown in SI."""
    return _IN_USE.get()


def follow(units: Mapping[str, str]) -> None:
    """Show numbers as a model has them from now on: all of a run of the command line is about one."""
    _IN_USE.set(_customary(units))


@contextmanager
def shown_as(units: Mapping[str, str]) -> Iterator[None]:
    """Show numbers as a model has them, by its stated units."""
    token = _IN_USE.set(_customary(units))
    try:
        yield
    finally:
        _IN_USE.reset(token)


def stated_by(arguments: Iterable[Any]) -> Mapping[str, str] | None:
    """The stated units of the first model or result among the arguments of a call; None if there is none."""
    for argument in arguments:
        if hasattr(type(argument), "worked_out"):
            return stated_units(argument)
        if isinstance(units := getattr(argument, "attrs", {}), Mapping) and "model_units" in units:
            return dict(json.loads(units["model_units"] or "{}"))
    return None
