"""The flat columns of every kind of result, chosen from one table."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trunnion.errors import Finding, MechanismError
from trunnion.results.tables import comparison, cycle, identification, motion, studies, tolerances
from trunnion.results.tables.column import Column, kept, whole

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["KINDS", "Column", "check_table", "columns", "kind_of", "table_of"]

TABULAR = (".csv", ".parquet", ".xlsx")  # files whose name says which table; the others hold the whole result

OF_CONTACTS = ("impacts", "spectrum")  # tables of a motion in which a joint is in play

Tables = Mapping[str, Callable[[Any], list[Column]]]


def _whole(flat: Callable[[Any], Any]) -> Callable[[Any], list[Column]]:
    return lambda result: whole(flat(result))


def _swept(result: xr.Dataset) -> Iterator[tuple[str, str, Any]]:
    return ((name, unit, values) for name, (unit, values) in studies.swept(result).items())


_OF_TOLERANCES = {name: _whole(flat) for name, flat in tolerances.TABLES.items()}
# the kinds of results: of each its tables by name, the one that a file holds first if its name says nothing else
KINDS: dict[str, Tables] = {
    "cycle": {"positions": cycle.positions},
    "motion": {
        "times": motion.times,
        "events": _whole(motion.events),
        "impacts": _whole(motion.impacts),
        "spectrum": _whole(motion.spectrum),
    },
    "sweep": {"points": _whole(_swept)},
    "play": {"positions": studies.played},
    "assembly": {"positions": studies.fitted},
    "measurement": {"courses": _whole(studies.courses)},
    "comparison": {name: _whole(flat) for name, flat in comparison.TABLES.items()},
    "identification": {name: _whole(flat) for name, flat in identification.TABLES.items()},
    "tolerance": _OF_TOLERANCES,
    "allocation": {"parameters": _OF_TOLERANCES["parameters"], **_OF_TOLERANCES},
}
# by what a result is known that names no kind, of an older version: an attribute, a dimension or a variable
_MARKS = {
    "identified": "identification", "comparing": "comparison", "swept": "sweep", "bought": "allocation",
    "parameter": "tolerance", "measure": "play", "assembling": "assembly", "setting": "measurement",
}  # fmt: skip


def kind_of(result: xr.Dataset) -> str:
    """The kind of a result, of KINDS."""
    known = {str(name) for name in (*result.attrs, *result.dims, *result.variables)}
    return str(result.attrs.get("kind", "")) or next((_MARKS[mark] for mark in _MARKS if mark in known), "cycle")


def columns(result: xr.Dataset, table: str = "") -> list[Column]:
    """(name, unit, values of a window of rows) of every flat column of a table, the first if none is named."""
    tables = KINDS[kind_of(result)]
    return kept(tables[table or next(iter(tables))](result))


def table_of(path: str | os.PathLike[str], result: xr.Dataset) -> str:
    """The table that a file of this name holds: of `x.positions.csv` the positions; MechanismError as `check_table`."""
    kind = kind_of(result)
    check_table(path, kind, "contact" in result.dims)
    inner = _inner(path)
    return inner if inner in KINDS[kind] else next(iter(KINDS[kind]))


def check_table(path: str | os.PathLike[str], kind: str, in_play: bool = True) -> None:
    """MechanismError for a name such as `x.contributions.csv`, which asks for a table that a kind of result has not.

    Only of kinds with several tables, and of a cycle those of a motion in time; a part of a name with other characters
    than letters (`x.2.csv`) asks for none. in_play: of a motion, whether a joint is in play.
    """
    inner, suffix = _inner(path), Path(path).suffix
    tables = [name for name in KINDS[kind] if in_play or name not in OF_CONTACTS]
    others = set(KINDS["motion"]) - {"times"} if kind in ("cycle", "motion") else set()
    if suffix.lower() not in TABULAR or not inner.isalpha() or inner in tables:
        return
    if inner in others or len(tables) > 1:
        named = f" or x.TABLE{suffix}, TABLE: {', '.join(tables)}" if len(tables) > 1 else ""
        why = ": no joint is in play" if inner in KINDS[kind] else " of a cycle" if kind == "cycle" else ""
        raise MechanismError(Finding(f"there is no table '{inner}'{why}", str(path), f"use x{suffix}{named}"))


def _inner(path: str | os.PathLike[str]) -> str:
    return Path(Path(path).stem).suffix.lstrip(".").lower()
