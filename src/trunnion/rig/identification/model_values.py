"""Estimates as values of a model: in the unit that was written there, with the digits that they have."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from trunnion.model.expression import LITERAL
from trunnion.model.mechanism import Mechanism
from trunnion.model.units import UnitError, normalise, unit
from trunnion.results.attributes import attribute
from trunnion.rig.identification.number_text import decimals

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["values"]

USUAL = {"rad": "deg", "m": "mm"}


def values(mechanism: Mechanism, result: xr.Dataset) -> dict[str, float | str]:
    """Values by path for `Mechanism.with_values`, of all that the data tell."""
    found: dict[str, float | str] = {}
    units = attribute(result, "parameter_units")
    for p, own in enumerate(attribute(result, "parameter_paths")):
        estimate = float(result["estimate"].values[p])
        spread = float(result["standard_uncertainty"].values[p])
        if math.isfinite(estimate):
            for path in own:
                found[path] = _text(mechanism, path, estimate, spread, units[p])
    return found


def _text(mechanism: Mechanism, path: str, value: float, spread: float, si: str) -> float | str:
    written = _unit(mechanism, path) or USUAL.get(si, "" if si == "1" else si)
    try:
        factor = float(unit(written)[0]) if written else 1.0
    except UnitError:
        written, factor = "", 1.0
    places = decimals(spread / factor) if spread > 0 else 6
    rounded = round(value / factor, places)
    number = f"{rounded:.{max(places, 0)}f}" if places < 12 else f"{rounded:.6g}"
    return f"{number} {written}" if written else float(number)


def _unit(mechanism: Mechanism, path: str) -> str:
    """The unit that a number is written in, if it is a number with a unit."""
    entry = mechanism.parameter_set.entries.get(path)
    source = entry.quantity.source if entry else ""
    if not isinstance(source, str):
        return ""
    found = LITERAL.fullmatch(normalise(source).strip().removeprefix("-").strip())
    return (found["unit"] or "") if found else ""
