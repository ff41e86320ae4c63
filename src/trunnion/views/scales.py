"""A sweep in words and numbers: its scales in the units they were given in, what runs along what, figures by name.

Figures are named as the columns of the CSV file: `efficiency`, `A.effort_max`, `B.reaction_max`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import nearest
from trunnion.results.attributes import attribute
from trunnion.results.quantities import SUPERSCRIPT, WORDS
from trunnion.results.tables.studies import swept as figures
from trunnion.studies.sweep.study import FIGURES
from trunnion.views.charts import Axis
from trunnion.views.common.cycle import Array

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "KINDS", "Arrangement", "Scale", "arrange", "axis_of", "cause", "check_axes", "check_measure", "edges", "grid",
    "meaning", "on_scale", "statuses", "thinned",
]  # fmt: skip

KINDS = ("curves", "map")  # of figures
CAUSES = {
    int(Status.NOT_CONVERGED): "not converged",
    int(Status.LOCKED): "locked",
    int(Status.LOAD_UNDEFINED): "load undefined",
    int(Status.SINGULAR): "dead centre",
    int(Status.NOT_ASSEMBLED): "cannot be assembled",
}
SIGNS = {"um": "µm", "deg": "°", **WORDS}  # in figures


class Scale(NamedTuple):
    """A swept name with its values in the unit they were given in."""

    name: str
    unit: str
    values: Array

    @property
    def title(self) -> str:
        """The name with its unit, for the head of a column."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name

    @property
    def label(self) -> str:
        """The same for an axis, with the unit as figures show it: µm for um, ° for deg."""
        return self._replace(unit=SIGNS.get(self.unit, self.unit)).title

    def say(self, index: int) -> str:
        """A value with its unit."""
        return f"{self.values[index]:.6g} {self.unit}".rstrip()

    def equation(self, index: int) -> str:
        """A value for a figure: "misalignment = −5°"."""
        unit = SIGNS.get(self.unit, self.unit)
        return f"{self.name} = {_written(self.values[index])}{'' if unit in ('', '°') else ' '}{unit}"


def _written(value: float) -> str:
    """A number as it was given, for a figure: a true minus, 2.5×10⁻⁶ for 2.5e-06."""
    mantissa, _, power = f"{value + 0.0:.6g}".partition("e")
    number = f"{mantissa}×10{str(int(power)).translate(SUPERSCRIPT)}" if power else mantissa
    return number.replace("-", "−")


def cause(code: int) -> str:
    """Why a point has no figures, in a word or two."""
    return CAUSES[int(code)]


def thinned(count: int, most: int) -> list[int]:
    """Indices of at most so many of them, evenly, the ends among them."""
    return [int(i) for i in np.unique(np.rint(np.linspace(0, count - 1, min(count, most))))]


# ---- what runs along what -----------------------------------------------------------------------------------------


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
        return ", ".join(scale.equation(0).replace(" ", "\u00a0") for scale in self.fixed)


def arrange(result: xr.Dataset, x: str = "", family: str = "") -> Arrangement:
    """What runs along what: the axis is `x`, the curves are of `family`, the panels of the other names, in order.

    Unless they are given, the first two names with more than one value. MechanismError for a name that is not swept.
    """
    every = {}
    for name in attribute(result, "swept"):
        about = result[name].attrs
        unit = str(about["written_unit"] or about["units"])
        values = result[name].values / float(about["written_factor"]) + 0.0
        every[name] = Scale(name, "" if unit == "1" else unit, values)
    first, second = check_axes({name: len(scale.values) for name, scale in every.items()}, x, family)
    rest = [scale for name, scale in every.items() if name not in (first, second)]
    facets, fixed = (tuple(s for s in rest if (len(s.values) > 1) is varies) for varies in (True, False))
    return Arrangement(every[first], every[second] if second else None, facets, fixed)


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


def _arranged(result: xr.Dataset, plan: Arrangement, values: NDArray[Any]) -> NDArray[Any]:
    """Values of all points in the order of the file as (axis, curve, *facets)."""
    names = attribute(result, "swept")
    drawn = [plan.x, *([plan.other] if plan.other else []), *plan.facets]
    cube = values.reshape([result.sizes[name] for name in names])
    cube = cube.transpose([names.index(scale.name) for scale in (*drawn, *plan.fixed)])
    cube = cube.reshape([len(scale.values) for scale in drawn])
    return cube if plan.other else cube[:, np.newaxis]


def grid(result: xr.Dataset, plan: Arrangement, name: str) -> tuple[str, Array]:
    """Unit and values, (axis, curve, *facets), of a figure."""
    every = figures(result)
    if name not in every:
        of_errors = name.endswith(("_ideal", "transmission_error_max"))
        what = "no mechanism of the sweep has errors" if of_errors else "the sweep does not hold it"
        remedy = "state errors, a misalignment or a seat: loaded" if of_errors else nearest(name, every)
        raise MechanismError(Finding(f"{what}: there is no figure '{name}'", "--measure", remedy))
    unit, values = every[name]
    return unit, np.asarray(_arranged(result, plan, values), float)


def statuses(result: xr.Dataset, plan: Arrangement) -> NDArray[np.int8]:
    """Codes of status, (axis, curve, *facets)."""
    flat = result["status"].transpose(*attribute(result, "swept")).values.ravel()
    return np.asarray(_arranged(result, plan, flat), np.int8)


def check_measure(names: str | Iterable[str], mechanism: Mechanism) -> list[str]:
    """Those of the names that are of measures of the model, or written as one is, and not of figures of every sweep.

    MechanismError with the nearest name, and the measures there are, if a name is neither.
    """
    members = {"driver": list(mechanism.drivers), "joint": list(mechanism.effective_joints)}
    every = [
        f"{member}.{key.removeprefix('drive_')}" if figure.dims else key
        for key, figure in FIGURES.items()
        for member in (members[figure.dims[0]] if figure.dims else [""])
        if key != "status"
    ]
    of_model = []
    for name in [names] if isinstance(names, str) else names:
        if name in mechanism.measures or (":" in name and name not in every):
            of_model.append(name)
        elif name not in every:
            remedy = nearest(name, [*every, *mechanism.measures])
            if mechanism.measures:
                remedy += f"; the model's measures are {', '.join(mechanism.measures)}"
            raise MechanismError(Finding(f"there is no figure or measure '{name}'", "--measure", remedy))
    return of_model


def meaning(name: str, unit: str) -> str:
    """A figure in words: "largest reaction of B"; of a whole cycle what it is called."""
    member, _, key = name.rpartition(".")
    about = FIGURES.get(key) or FIGURES.get(f"drive_{key}")
    if about is None or not about.dims:
        return name.replace("_", " ")
    if key == "transmission_error_max":
        return f"maximum error of the {'slide' if unit == 'm' else 'rotation'} of {member}"
    return f"{about.long_name} of {member}"


def on_scale(scale: Scale) -> str:
    """ "log" if the values of a name are positive, span ten times or more and are spaced by ratios; else "linear"."""
    values = np.unique(scale.values)
    if values.size < 3 or values[0] <= 0 or values[-1] < 10 * values[0]:
        return "linear"
    ratios, steps = np.diff(np.log(values)), np.diff(values)
    return "log" if ratios.max() / ratios.min() < min(4.0, steps.max() / steps.min()) else "linear"


def edges(scale: Scale, values: Array, margin: float = 0.015) -> Array:
    """Where the surroundings of rising values end: half-way to the next on the scale of their axis, a little beyond the
    first and the last."""
    log = on_scale(scale) == "log"
    places = np.log(values) if log else values
    low, high = float(places[0]), float(places[-1])
    more = margin * (high - low) if high > low else 0.5 * abs(low) or 0.5
    places = np.concatenate([[low - more], (places[:-1] + places[1:]) / 2, [high + more]])
    return np.asarray(np.exp(places) if log else places, float)


def axis_of(scale: Scale, room: int, margin: float = 0.015) -> Axis:
    """The axis along which a swept name runs; few values stand there as they were given. room: characters of a line."""
    values, log = np.unique(scale.values), on_scale(scale) == "log"
    few = values.size == 1 or (log and values.size <= 7)
    places = [(float(value), _written(value)) for value in values] if few else None
    title = fill(scale.label, room, break_long_words=False)
    low, *_, high = edges(scale, values, margin).tolist()
    return Axis(title, (low, high), places, log, powers=not log and not few)
