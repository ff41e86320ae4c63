"""The flat columns of every kind of result, chosen from one table: which there are, and which of them a file gets."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import TYPE_CHECKING, Any

from trunnion.errors import Finding, MechanismError
from trunnion.model.names import nearest
from trunnion.model.units import unit
from trunnion.results.attributes import attribute
from trunnion.results.dataset import Column
from trunnion.results.tables import cycle, studies

if TYPE_CHECKING:
    import xarray as xr

TABULAR = (".csv", ".parquet", ".xlsx")  # files whose name says which table; the others hold the whole result

OF_CONTACTS = ("impacts", "spectrum")  # tables of a motion in which a joint is in play

# the kinds of results: of each its tables by name, the one that a file holds first if its name says nothing else
KINDS: dict[str, Mapping[str, Callable[[Any], list[Column]]]] = {
    "cycle": {"positions": cycle.positions},
    "motion": {"times": cycle.times, "events": cycle.events, "impacts": cycle.impacts, "spectrum": cycle.spectrum},
    "sweep": {"points": studies.points},
    "play": {"positions": studies.played},
    "assembly": {"positions": studies.fitted},
    "measurement": {"courses": studies.courses},
    "comparison": studies.COMPARISON,
    "identification": studies.IDENTIFICATION,
    "tolerance": studies.TOLERANCE,
    "allocation": {"parameters": studies.TOLERANCE["parameters"], **studies.TOLERANCE},
}


def kind_of(result: xr.Dataset) -> str:
    """The kind of a result, of KINDS."""
    return str(result.attrs.get("kind", "cycle"))


def columns(result: xr.Dataset, table: str = "") -> list[Column]:
    """Every flat column of a table, the first if none is named."""
    tables = KINDS[kind_of(result)]
    return tables[table or next(iter(tables))](result)


def table_of(path: str | os.PathLike[str], result: xr.Dataset) -> str:
    """The table that a file of this name holds: of `x.positions.csv` the positions; MechanismError as `check_table`."""
    kind = kind_of(result)
    inner = check_table(path, kind, "contact" in result.dims)
    return inner if inner in KINDS[kind] else next(iter(KINDS[kind]))


def check_table(path: str | os.PathLike[str], kind: str, in_play: bool = True) -> str:
    """What a file's name asks for: the table `positions` of `x.positions.csv`, or else what stands there.

    MechanismError for a table that a kind of result has not: of kinds with several tables, and of a cycle for those of
    a motion in time; a part of a name with other characters than letters (`x.2.csv`) asks for none. in_play: of a
    motion, whether a joint is in play.
    """
    inner, suffix = Path(Path(path).stem).suffix.lstrip(".").lower(), Path(path).suffix
    tables = [name for name in KINDS[kind] if in_play or name not in OF_CONTACTS]
    others = set(KINDS["motion"]) - {"times"} if kind in ("cycle", "motion") else set()
    if suffix.lower() not in TABULAR or not inner.isalpha() or inner in tables:
        return inner
    if inner in others or len(tables) > 1:
        named = f" or x.TABLE{suffix}, TABLE: {', '.join(tables)}" if len(tables) > 1 else ""
        raise MechanismError(Finding(f"there is no table '{inner}'", str(path), f"use x{suffix}{named}"))
    return inner


# ---- which columns a file gets --------------------------------------------------------------------------------


# of a cycle, beside the usual columns: coordinates, velocities and accelerations; margins, efficiency and effort
# forward and backward; whatever there is at each position. Other kinds of results have but the usual ones
OF_CYCLE: dict[str, Callable[[xr.Dataset], list[Column]]] = {
    "motion": cycle.motion, "locking": cycle.locking,
    "all": lambda result: _once([*cycle.positions(result), *cycle.motion(result), *cycle.rest(result)]),
}  # fmt: skip
GROUPS = ("usual", *OF_CYCLE)


def _group(name: str, result: xr.Dataset, table: str) -> list[Column]:
    return OF_CYCLE[name](result) if name in OF_CYCLE and kind_of(result) == "cycle" else columns(result, table)


def selected(result: xr.Dataset, names_asked: Sequence[str] | None = None, table: str = "") -> list[Column]:
    """The columns of a table of a result, in the order asked for and each once.

    names_asked: groups of GROUPS, names of columns, or patterns of them such as `crank.B.*`; the usual ones by default.
    The time is always there, if the table has it. Raises MechanismError for a name that no column has.
    """
    if names_asked is None:
        return columns(result, table)
    every = _group("all", result, table)
    chosen = [column for column in every[:1] if column.name == "time"]
    for name in names_asked:
        matching = [column for column in every if fnmatchcase(column.name, name)]
        matching = _group(name, result, table) if name in GROUPS else matching
        if not matching:
            remedy = nearest(name, [*GROUPS, *(column.name for column in every)])
            raise MechanismError(Finding(f"there is no column '{name}'", "columns", remedy))
        chosen += matching
    return _once(chosen)


def _once(every: Iterable[Column]) -> list[Column]:
    first: dict[str, Column] = {}
    for column in every:
        first.setdefault(column.name, column)
    return list(first.values())


def in_model_units(result: xr.Dataset, every: Iterable[Column]) -> list[Column]:
    """Columns in the units of the model, named with their unit: `rod.C.x [mm]`; what has no unit stays as it is."""
    units: Mapping[str, str] = dict(attribute(result, "model_units", "{}"))
    converted = []
    for name, si, values in every:
        model_unit = units.get(si, si)
        heading = name if model_unit in ("", "1") else f"{name} [{model_unit}]"
        converted.append(
            Column(heading, model_unit, values if model_unit == si else values * (1 / float(unit(model_unit)[0])))
        )
    return converted
