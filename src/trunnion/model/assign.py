"""Putting a value at its place in the plain data of a model."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

from trunnion.model.parameters import Location
from trunnion.model.quantity import Quantity

__all__ = ["assign"]


def assign(
    data: dict[str, Any], location: Location, value: float | str | Quantity | list[str], coordinates: int
) -> None:
    """Put a value at its place in plain data, making the groups on the way and writing short forms out."""
    holder: Any = data
    for key, following in pairwise(location):
        if isinstance(holder, dict) and holder.get(key) is None:
            holder[key] = [0] * coordinates if isinstance(following, int) else {}
        if following == "at" and isinstance(holder[key], list):
            holder[key] = {"at": holder[key]}
        elif isinstance(following, str) and not isinstance(holder[key], dict):
            short = {"limits": holder[key]} if location[0] == "tolerances" else {"coefficient": holder[key]}
            holder[key] = {} if key == "seat" else short  # the short form, of tolerances and of friction
        holder = holder[key]
    holder[location[-1]] = value
