"""Which columns a table file gets: groups, or columns by name."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from trunnion.errors import Finding, MechanismError
from trunnion.model.names import nearest
from trunnion.results.tables import KINDS, columns, cycle, kind_of
from trunnion.results.tables.column import Column, kept

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["GROUPS", "selected"]


def _motion(result: xr.Dataset, table: str) -> list[Column]:
    return cycle.motion(result) if _of_cycle(result) else columns(result, table)


def _locking(result: xr.Dataset, table: str) -> list[Column]:
    return cycle.locking(result) if _of_cycle(result) else columns(result, table)


def _all(result: xr.Dataset, table: str) -> list[Column]:
    usual = columns(result, table)
    return _once([*usual, *cycle.motion(result), *cycle.rest(result)]) if _of_cycle(result) else usual


# usual: what a file has if nothing is asked for; motion: coordinates, velocities and accelerations; locking: margins,
# efficiency and effort forward and backward; all: whatever there is at each position
GROUPS: dict[str, Callable[[xr.Dataset, str], list[Column]]] = {
    "usual": columns, "motion": _motion, "locking": _locking, "all": _all,
}  # fmt: skip


def selected(result: xr.Dataset, wanted: Sequence[str] | None = None, table: str = "") -> list[Column]:
    """The columns of a table of a result, in the order asked for and each once.

    wanted: groups of GROUPS, names of columns, or patterns of them such as `crank.B.*`; the usual ones if not given.
    The time is always there, if the table has it. Raises MechanismError for a name that no column has.
    """
    if wanted is None:
        return columns(result, table)
    table = table or next(iter(KINDS[kind_of(result)]))
    known = _all(result, table)
    found = [column for column in known[:1] if column[0] == "time"]
    for name in wanted:
        own = [one for one in known if fnmatchcase(one[0], name)]
        own = kept(GROUPS[name](result, table)) if name in GROUPS else own
        if not own:
            remedy = nearest(name, [*GROUPS, *(column[0] for column in known)])
            raise MechanismError(Finding(f"there is no column '{name}'", "columns", remedy))
        found += own
    return _once(found)


def _of_cycle(result: xr.Dataset) -> bool:
    return kind_of(result) == "cycle"


def _once(found: Iterable[Column]) -> list[Column]:
    first: dict[str, Column] = {}
    for column in kept(found):
        first.setdefault(column[0], column)
    return list(first.values())
