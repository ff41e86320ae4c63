"""What the texts of the command line's options say: `name=value`, `name=file`, `name=from:to:count`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from trunnion.errors import Finding, MechanismError

__all__ = ["over", "points", "setting", "table_file"]


def setting(text: str) -> tuple[str, float | str]:
    """A name and its value from `name=value`."""
    name, equals, value = text.partition("=")
    if not equals or not name.strip() or not value.strip():
        raise MechanismError(Finding(f"'{text}' sets nothing", "--set", "write name=value, e.g. AB=2.1m"))
    return name.strip(), _plain(value)


def _plain(text: str) -> float | str:
    """A number, which is SI, or a text with its unit."""
    try:
        return float(text)
    except ValueError:
        return text.strip()


def over(texts: list[str]) -> dict[str, Any]:
    """Values to sweep over, by name: from, to and count of `name=0deg:30deg:7`, or the list of `name=0deg,5deg`."""
    found: dict[str, Any] = {}
    for text in texts:
        name, _, values = (part.strip() for part in text.partition("="))
        parts = values.split(":")
        if not name or not all(part.strip() for part in parts) or len(parts) not in (1, 3):
            remedy = "write NAME=FROM:TO:COUNT or NAME=VALUE,VALUE,…, e.g. misalignment=0deg:30deg:7"
            raise MechanismError(Finding(f"'{text}' is no range and no list of values", "--over", remedy))
        if name in found:
            raise MechanismError(Finding(f"'{name}' is given twice", "--over", "give all its values at once"))
        found[name] = _range(name, parts) if len(parts) == 3 else [_plain(value) for value in values.split(",")]
    return found


def _range(name: str, parts: list[str]) -> tuple[float | str, float | str, int]:
    try:
        return _plain(parts[0]), _plain(parts[1]), int(parts[2])
    except ValueError:
        what = f"the count '{parts[2].strip()}' is no whole number"
        raise MechanismError(Finding(what, f"--over {name}", "write FROM:TO:COUNT, e.g. 0deg:30deg:7")) from None


def points(grid: Mapping[str, Any]) -> int:
    """How many points a grid has."""
    return math.prod(values[2] if isinstance(values, tuple) else len(values) for values in grid.values())


def table_file(text: str) -> tuple[str, str]:
    """A name and its file from `name=file`."""
    name, _, path = (part.strip() for part in text.partition("="))
    if not name or not path:
        raise MechanismError(Finding(f"'{text}' names no file", "--table", "write NAME=FILE, e.g. A=motion.csv"))
    return name, path
