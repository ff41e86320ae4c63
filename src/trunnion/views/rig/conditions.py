"""Names of working conditions, short enough for a table: what all of them begin with goes into the head."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["shortened"]


def shortened(names: Sequence[str]) -> tuple[str, list[str]]:
    """Head of a column and its entries: "misalignment, input.speed" and "0 deg, 250 rpm", …

    A number keeps to its unit. Names that do not set the same numbers in the same order stay whole, under "condition".
    """
    rows = [[part.partition(" ") for part in name.split(", ")] for name in names]
    keys = [[key for key, _, _ in row] for row in rows]
    if not rows or any(one != keys[0] for one in keys) or not all(value for row in rows for _, _, value in row):
        return "condition", list(names)
    return ", ".join(keys[0]), [", ".join(value.replace(" ", "\u00a0") for _, _, value in row) for row in rows]
