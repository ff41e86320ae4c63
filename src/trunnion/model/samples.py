"""Measured deviations of a number from a CSV file that the user names; a model never reads another file by itself."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trunnion.errors import Finding, MechanismError
from trunnion.model.csv_table import column
from trunnion.model.parameters import measured
from trunnion.model.tolerances import variations

if TYPE_CHECKING:
    from trunnion.model.numbers import Numbers

__all__ = ["with_samples"]


def with_samples(mechanism: Numbers, name: str, path: str | os.PathLike[str]) -> dict[str, Any]:
    """Plain data of the mechanism with a number that varies as the deviations in a file; limits stated are kept."""
    numbers = mechanism.parameter_set
    target = numbers.resolve(name)
    if target not in numbers.entries:
        raise MechanismError(Finding(f"the model states no '{target}'", "--sample", "state it, then its deviations"))
    deviations = column(Path(path), measured(mechanism, numbers.entries.values())[target])
    key, stated = variations(mechanism, numbers).get(target, (target, None))
    data = mechanism.data()
    kept = {} if stated is None or stated.limits is None else {"limits": stated.limits.source}
    own = key if numbers.resolve(key) == target else target
    entry = {**kept, "distribution": "sample", "values": deviations}
    data["tolerances"] = {**data.get("tolerances", {}), own: entry}
    return data
