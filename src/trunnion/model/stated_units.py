"""The units that a model is written in."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING

from trunnion.model.units import UnitError, si_unit, unit

if TYPE_CHECKING:
    from trunnion.model.mechanism import Mechanism

__all__ = ["stated_units"]

STATED = re.compile(r"\s*[-+]?[\d.]+(?:[eE][-+]?\d+)?\s*([A-Za-zµ°][^±(]*?)\s*(?:[±+(-].*)?")  # "60 mm ± 0.05 mm"
ANGLES = {"rad": "deg"}  # where no angle is stated; nobody reads radians


def stated_units(mechanism: Mechanism) -> dict[str, str]:
    """The unit that the model states most often, for each unit of SI: {"m": "mm", "rad": "deg"}."""
    if "stated_units" not in mechanism.worked_out:
        mechanism.worked_out["stated_units"] = _stated_units(mechanism)
    return dict(mechanism.worked_out["stated_units"])


def _stated_units(mechanism: Mechanism) -> dict[str, str]:
    counts: Counter[tuple[str, str]] = Counter()
    for entry in mechanism.parameter_set.entries.values():
        text = str(entry.quantity.source)
        found = STATED.fullmatch(text)
        if entry.alias or not found:
            continue
        try:
            counts[si_unit(unit(found[1])[1]), found[1]] += 1
        except UnitError:  # of a formula: "2 e", "40 N * x"
            continue
    stated: dict[str, str] = {}
    for (si, own), _ in counts.most_common():
        stated.setdefault(si, own)
    return {si: own for si, own in (ANGLES | stated).items() if si != own}
