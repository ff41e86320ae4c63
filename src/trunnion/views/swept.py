"""A sweep in words and numbers: its scales in the units they were given in, its figures by name, a short table.

Figures are named as the columns of the CSV file: `efficiency`, `A.effort_max`, `B.reaction_max`.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from trunnion.analysis.sweep import FIGURES
from trunnion.errors import Finding, MechanismError, Status
from trunnion.export import figures
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import nearest
from trunnion.views.cycle import Array

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Scale", "cause", "check_measure", "grid", "meaning", "scales", "statuses", "table"]

MOST_ROWS, MOST_COLUMNS = 40, 8  # of a table
CAUSES = {
    Status.NOT_CONVERGED: "not converged",
    Status.LOCKED: "locked",
    Status.LOAD_UNDEFINED: "load undefined",
    Status.SINGULAR: "dead centre",
    Status.NOT_ASSEMBLED: "cannot be assembled",
}


class Scale(NamedTuple):
    """A swept name with its values in the unit they were given in."""

    name: str
    unit: str
    values: Array

    @property
    def title(self) -> str:
        """The name with its unit, for an axis or the head of a column."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    def say(self, index: int) -> str:
        """A value with its unit."""
        return f"{self.values[index]:.6g} {self.unit}".rstrip()


def scales(result: xr.Dataset) -> list[Scale]:
    """The swept names of a result."""
    found = []
    for name in json.loads(result.attrs["swept"]):
        told = result[name].attrs
        unit = str(told["written_unit"] or told["units"])
        found.append(
            Scale(name, "" if unit == "1" else unit, result[name].values / float(told["written_factor"]) + 0.0)
        )
    return found


def check_measure(name: str, mechanism: Mechanism) -> None:
    """MechanismError with the nearest name if a sweep of a mechanism has no such figure."""
    members = {"driver": list(mechanism.drivers), "joint": list(mechanism.effective_joints)}
    known = [
        f"{member}.{key.removeprefix('drive_')}" if one.dims else key
        for key, one in FIGURES.items()
        for member in (members[one.dims[0]] if one.dims else [""])
        if key != "status"
    ]
    if name not in known:
        raise MechanismError(Finding(f"there is no figure '{name}'", "--measure", nearest(name, known)))


def grid(result: xr.Dataset, name: str) -> tuple[str, Array]:
    """Unit and values, (first name, second name), of a figure."""
    shape = [result.sizes[one] for one in json.loads(result.attrs["swept"])]
    found = figures(result)
    if name not in found:
        what = f"no mechanism of the sweep has errors: there is no figure '{name}'"
        raise MechanismError(Finding(what, "--measure", "state errors, a misalignment or a seat: loaded"))
    unit, values = found[name]
    return unit, np.asarray(values, float).reshape(shape[0], -1)


def meaning(name: str, unit: str) -> str:
    """A figure in words: "largest reaction of B"; of a whole cycle what it is called."""
    member, _, key = name.rpartition(".")
    told = FIGURES.get(key) or FIGURES.get(f"drive_{key}")
    if told is None or not told.dims:
        return name.replace("_", " ")
    if key == "transmission_error_max":
        return f"largest error of the {'slide' if unit == 'm' else 'rotation'} of {member}"
    return f"{told.long_name} of {member}"


def statuses(result: xr.Dataset) -> Array:
    swept = json.loads(result.attrs["swept"])
    return np.asarray(result["status"].transpose(*swept).values).reshape(result.sizes[swept[0]], -1)


def cause(code: int) -> str:
    """Why a point has no figures, in a word or two."""
    return next(text for status, text in CAUSES.items() if status == code)


# ---- table ----------------------------------------------------------------------------------------------------


def table(result: xr.Dataset, measure: str = "efficiency") -> tuple[list[str], list[list[str]], int]:
    """Head, rows and how many points are not shown: figures over one name, or one figure over both."""
    over, *others = scales(result)
    return _matrix(result, measure, over, others[0]) if others else _list(result, measure, over)


def _thinned(count: int, most: int) -> list[int]:
    """Indices of at most so many of them, evenly, the ends among them."""
    return [int(i) for i in np.unique(np.rint(np.linspace(0, count - 1, min(count, most))))]


def _list(result: xr.Dataset, measure: str, over: Scale) -> tuple[list[str], list[list[str]], int]:
    found = figures(result)
    efforts = [name for name in found if name.endswith(".effort_max")]
    ideal = [name for name in ("efficiency_ideal",) if name in found]
    margin = [name for name in ("locking_margin",) if name in found]
    shown = list(dict.fromkeys([measure, "efficiency", *ideal, *efforts, "friction_power_mean", *margin]))
    picked, status = _thinned(len(over.values), MOST_ROWS), statuses(result)[:, 0]
    titles = [f"{name.replace('_', ' ')} [{found[name][0]}]".removesuffix(" [1]") for name in shown]
    words = [_word(int(code)) for code in status]
    head = [over.title, *titles, *(["status"] if any(words) else [])]
    rows = []
    for i in picked:
        cells = ["" if np.isnan(found[name][1][i]) else _number(found[name][1][i]) for name in shown]
        rows.append([_number(over.values[i]), *cells, *([words[i]] if any(words) else [])])
    return head, rows, len(over.values) - len(picked)


def _word(code: int) -> str:
    """What a table says of a point that has no figures, or not quite sound ones."""
    if code >= Status.NOT_CONVERGED:
        return cause(code)
    milder = {int(Status.NEAR_SINGULAR): "near singular", int(Status.CONTACT_LOST): "contact lost"}
    return milder.get(code, "")


def _number(value: float) -> str:
    return f"{value + 0.0:.6g}".replace("inf", "∞")  # + 0.0: no negative zero


def _matrix(result: xr.Dataset, measure: str, over: Scale, other: Scale) -> tuple[list[str], list[list[str]], int]:
    _, values = grid(result, measure)
    status = statuses(result)
    down, across = _thinned(values.shape[0], MOST_ROWS), _thinned(values.shape[1], MOST_COLUMNS)
    head = [over.title, *(other.say(k) for k in across)]
    rows = []
    for i in down:
        cells = [
            cause(int(status[i, k])) if np.isnan(values[i, k]) and status[i, k] >= Status.NOT_CONVERGED
            else _number(values[i, k])
            for k in across
        ]  # fmt: skip
        rows.append([f"{over.values[i]:.6g}", *cells])
    return head, rows, values.size - len(down) * len(across)
