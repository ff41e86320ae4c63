"""A sweep in words and numbers: its scales in the units they were given in, what runs along what, figures by name.

Figures are named as the columns of the CSV file: `efficiency`, `A.effort_max`, `B.reaction_max`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import nearest
from trunnion.results.attributes import attribute
from trunnion.results.quantities import SUPERSCRIPT, WORDS
from trunnion.results.tables.studies import swept as figures
from trunnion.studies.sweep.study import FIGURES
from trunnion.views.common.cycle import Array

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "KINDS", "Arrangement", "Scale", "arrange", "arranged", "cause", "check_axes", "check_kind", "check_measure",
    "grid", "meaning", "scales", "statuses", "thinned", "written",
]  # fmt: skip

KINDS = ("curves", "map")  # of figures

CAUSES = {
    Status.NOT_CONVERGED: "not converged",
    Status.LOCKED: "locked",
    Status.LOAD_UNDEFINED: "load undefined",
    Status.SINGULAR: "dead centre",
    Status.NOT_ASSEMBLED: "cannot be assembled",
}
SIGNS = {"um": "µm", "deg": "°", **WORDS}  # in figures


class Scale(NamedTuple):
    """A swept name with its values in the unit they were given in."""

    name: str
    unit: str
    values: Array

    @property
    def title(self) -> str:
        """The name with its unit, for an axis or the head of a column."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def label(self) -> str:
        """The same with the unit as figures show it: µm for um, ° for deg."""
        return self._replace(unit=SIGNS.get(self.unit, self.unit)).title

    @property
    def varies(self) -> bool:
        return len(self.values) > 1

    def say(self, index: int) -> str:
        """A value with its unit."""
        return f"{self.values[index]:.6g} {self.unit}".rstrip()

    def told(self, index: int) -> str:
        """An equation for a figure: "misalignment = −5°"."""
        unit = SIGNS.get(self.unit, self.unit)
        gap = "" if unit in ("", "°") else " "
        return f"{self.name} = {written(self.values[index])}{gap}{unit}"


def written(value: float) -> str:
    """A number as it was given, for a figure: a true minus, 2.5×10⁻⁶ for 2.5e-06."""
    mantissa, _, power = f"{value + 0.0:.6g}".partition("e")
    shown = f"{mantissa}×10{str(int(power)).translate(SUPERSCRIPT)}" if power else mantissa
    return shown.replace("-", "−")


def scales(result: xr.Dataset) -> list[Scale]:
    """The swept names of a result."""
    found = []
    for name in attribute(result, "swept"):
        told = result[name].attrs
        unit = str(told["written_unit"] or told["units"])
        found.append(
            Scale(name, "" if unit == "1" else unit, result[name].values / float(told["written_factor"]) + 0.0)
        )
    return found


# ---- what runs along what -------------------------------------------------------------------------------------


class Arrangement(NamedTuple):
    """Which name runs along the axis, which tells the curves (or runs upwards in a map), which the panels.

    fixed: names with one value, which have no place but in the title.
    """

    x: Scale
    other: Scale | None
    facets: tuple[Scale, ...]
    fixed: tuple[Scale, ...]

    def at(self) -> str:
        """The fixed values in words, none of them to be broken into lines; "" if there are none."""
        return ", ".join(one.told(0).replace(" ", "\u00a0") for one in self.fixed)


def arrange(result: xr.Dataset, x: str = "", family: str = "") -> Arrangement:
    """What runs along what: the axis is `x`, the curves are of `family`, the panels of the other names, in order.

    Unless they are given, the first two names with more than one value. MechanismError for a name that is not swept.
    """
    every = {one.name: one for one in scales(result)}
    first, second = check_axes({name: len(one.values) for name, one in every.items()}, x, family)
    rest = [one for name, one in every.items() if name not in (first, second)]
    return Arrangement(
        every[first],
        every[second] if second else None,
        tuple(one for one in rest if one.varies),
        tuple(one for one in rest if not one.varies),
    )


def check_kind(kind: str) -> None:
    """MechanismError for a kind of figure that there is not."""
    if kind not in KINDS:
        raise MechanismError(Finding(f"there is no kind of figure '{kind}'", "--kind", nearest(kind, KINDS)))


def check_axes(counts: Mapping[str, int], x: str = "", family: str = "") -> tuple[str, str]:
    """Names of the axis and of the curves, "" if there is one curve, from how many values each swept name has."""
    for name, option in ((x, "--x"), (family, "--family")):
        if name and name not in counts:
            raise MechanismError(Finding(f"'{name}' is not swept over", option, nearest(name, counts)))
    if x and x == family:
        raise MechanismError(Finding(f"'{x}' cannot be both the axis and the curves", "--family", "name another"))
    order = sorted(counts, key=lambda name: counts[name] == 1)  # stable: as given, those with one value last
    first = x or next((name for name in order if name != family), family)
    second = family if first != family else ""
    return first, second or next((name for name in order if name != first and counts[name] > 1), "")


def arranged(result: xr.Dataset, plan: Arrangement, values: NDArray[np.generic]) -> NDArray[np.generic]:
    """Values of all points in the order of the file as (axis, curve, *facets)."""
    names = attribute(result, "swept")
    shown = [plan.x, *([plan.other] if plan.other else []), *plan.facets]
    cube = values.reshape([result.sizes[name] for name in names])
    cube = cube.transpose([names.index(one.name) for one in (*shown, *plan.fixed)])
    cube = cube.reshape([len(one.values) for one in shown])
    return cube if plan.other else cube[:, np.newaxis]


def grid(result: xr.Dataset, plan: Arrangement, name: str) -> tuple[str, Array]:
    """Unit and values, (axis, curve, *facets), of a figure."""
    found = figures(result)
    if name not in found:
        of_errors = name.endswith("_ideal") or name.endswith("transmission_error_max")
        what = "no mechanism of the sweep has errors" if of_errors else "the sweep does not hold it"
        remedy = "state errors, a misalignment or a seat: loaded" if of_errors else nearest(name, found)
        raise MechanismError(Finding(f"{what}: there is no figure '{name}'", "--measure", remedy))
    unit, values = found[name]
    return unit, np.asarray(arranged(result, plan, values), float)


def statuses(result: xr.Dataset, plan: Arrangement) -> NDArray[np.int8]:
    """Codes of status, (axis, curve, *facets)."""
    flat = result["status"].transpose(*attribute(result, "swept")).values.ravel()
    return np.asarray(arranged(result, plan, flat), np.int8)


def thinned(count: int, most: int) -> list[int]:
    """Indices of at most so many of them, evenly, the ends among them."""
    return [int(i) for i in np.unique(np.rint(np.linspace(0, count - 1, min(count, most))))]


# ---- in words -------------------------------------------------------------------------------------------------


def check_measure(names: str | Iterable[str], mechanism: Mechanism) -> list[str]:
    """Those of the names that are of measures of the model, or written as one is, and not of figures of every sweep.

    MechanismError with the nearest name, and the measures there are, if a name is neither.
    """
    members = {"driver": list(mechanism.drivers), "joint": list(mechanism.effective_joints)}
    known = [
        f"{member}.{key.removeprefix('drive_')}" if one.dims else key
        for key, one in FIGURES.items()
        for member in (members[one.dims[0]] if one.dims else [""])
        if key != "status"
    ]
    own = []
    for name in [names] if isinstance(names, str) else names:
        if name in mechanism.measures or (":" in name and name not in known):
            own.append(name)
        elif name not in known:
            remedy = nearest(name, [*known, *mechanism.measures])
            there = f"; the model's measures are {', '.join(mechanism.measures)}" if mechanism.measures else ""
            raise MechanismError(Finding(f"there is no figure or measure '{name}'", "--measure", f"{remedy}{there}"))
    return own


def meaning(name: str, unit: str) -> str:
    """A figure in words: "largest reaction of B"; of a whole cycle what it is called."""
    member, _, key = name.rpartition(".")
    told = FIGURES.get(key) or FIGURES.get(f"drive_{key}")
    if told is None or not told.dims:
        return name.replace("_", " ")
    if key == "transmission_error_max":
        return f"maximum error of the {'slide' if unit == 'm' else 'rotation'} of {member}"
    return f"{told.long_name} of {member}"


def cause(code: int) -> str:
    """Why a point has no figures, in a word or two."""
    return next(text for status, text in CAUSES.items() if status == code)
