"""A sweep in words and numbers: its scales in the units they were given in, what runs along what, figures by name.

Figures are named as the columns of the CSV file: `efficiency`, `A.effort_max`, `B.reaction_max`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from math import prod
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import nearest
from trunnion.results.attributes import attribute
from trunnion.results.quantities import SUPERSCRIPT, WORDS, prefixed
from trunnion.results.tables.studies import swept as figures
from trunnion.studies.sweep.study import FIGURES
from trunnion.views.charts import Axis, Line, Look, Mark, outside
from trunnion.views.common.cycle import Array
from trunnion.views.common.peaks import ease_of_status, usual_peak
from trunnion.views.readings import ending

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "ALIKE", "KINDS", "NOTHING", "Arrangement", "Field", "Scale", "arrange", "axis_of", "cause", "check_axes",
    "check_measure", "ends", "field_of", "grid", "middles", "on_scale", "rings", "statuses", "thinned",
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
MOST_PANELS = 12
NOTHING = -1  # beside the statuses: sound, and yet without a number
ALIKE = 1e-9  # of the largest: numbers that differ by less are taken as one


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


def _meaning(name: str, unit: str) -> str:
    """A figure in words: "largest reaction of B"; of a whole cycle what it is called."""
    member, _, key = name.rpartition(".")
    about = FIGURES.get(key) or FIGURES.get(f"drive_{key}")
    if about is None or not about.dims:
        return name.replace("_", " ")
    if key == "transmission_error_max":
        return f"maximum error of the {'slide' if unit == 'm' else 'rotation'} of {member}"
    return f"{about.long_name} of {member}"


# ---- what a figure shows ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Field:
    """A figure of a sweep as it is drawn: numbers in its unit, (axis, curve, panel), the axis rising.

    label: with the unit; scope: the magnitude that is shown; factor: from SI. panels: their titles; hidden: how many
    more there are; columns: how many stand side by side; room: characters along a panel. nothing: what a sound point
    without a number has: "∞" or "no value".
    """

    plan: Arrangement
    x: Array
    values: Array
    ideal: Array | None
    status: NDArray[np.int8]
    unit: str
    title: str
    label: str
    scope: float
    factor: float
    panels: list[str]
    hidden: int
    columns: int
    nothing: str

    @property
    def room(self) -> int:
        """Characters along a panel."""
        return {1: 70, 2: 40, 3: 28, 4: 24}[self.columns]

    def beyond(self, panel: int) -> list[Mark]:
        """What a panel says of its peak, where that is outside the frame."""
        peak = float(np.nanmax(np.abs(self.values[:, :, panel]), initial=0.0))
        return [outside(peak / self.factor, self.unit)] if peak > self.scope else []


def field_of(result: xr.Dataset, measure: str, x: str, family: str) -> Field:
    """The numbers of a figure, brought into order; of too many panels some."""
    plan = arrange(result, x, family)
    unit, values = grid(result, plan, measure)
    nothing = "∞" if np.isinf(values).any() else "no value"  # a margin beyond the last that is looked for
    values = np.where(np.isfinite(values), values, np.nan)
    ideal = grid(result, plan, f"{measure}_ideal")[1] if f"{measure}_ideal" in result else None
    order = np.argsort(plan.x.values, kind="stable")
    sizes = [len(scale.values) for scale in plan.facets]
    total = prod(sizes)
    while prod(sizes) > MOST_PANELS:
        sizes[int(np.argmax(sizes))] -= 1
    places = list(product(*(thinned(len(s.values), size) for s, size in zip(plan.facets, sizes, strict=True))))

    def panelled(array: NDArray[Any]) -> NDArray[Any]:
        rows: list[Any] = [(order, slice(None), *place) for place in places]
        return np.stack([array[row] for row in rows], axis=-1)

    values, status = panelled(values), panelled(statuses(result, plan))
    ideal = None if ideal is None else panelled(ideal)
    scope = usual_peak(ease_of_status(result, status), values, ideal)
    factor, display_unit = prefixed(scope, unit)
    count, title = len(places), _meaning(measure, unit)
    columns = count if count <= 3 else 2 if count == 4 else 3 if count <= 6 or count == 9 else 4
    if len(sizes) == 2 and 1 < sizes[-1] <= 4:  # the values of the last name side by side
        columns = sizes[-1]
    room = {1: 70, 2: 40, 3: 28, 4: 24}[columns]
    titles = [_panel_title([s.equation(i) for s, i in zip(plan.facets, place, strict=True)], room) for place in places]
    return Field(
        plan, plan.x.values[order], values * factor, None if ideal is None else ideal * factor, status, unit, title,
        f"{title} [{display_unit}]" if display_unit else title,
        scope * factor, factor, titles, total - count, columns, nothing,
    )  # fmt: skip


def _panel_title(parts: list[str], room: int) -> str:
    """The values of a panel in lines of so many characters; too long names by their ends."""
    short = (ending(part, room).replace(" ", "\u00a0") for part in parts)
    return fill(", ".join(short), room, break_long_words=False).replace("\u00a0", " ")


def on_scale(scale: Scale) -> str:
    """ "log" if the values of a name are positive, span ten times or more and are spaced by ratios; else "linear"."""
    values = np.unique(scale.values)
    if values.size < 3 or values[0] <= 0 or values[-1] < 10 * values[0]:
        return "linear"
    ratios, steps = np.diff(np.log(values)), np.diff(values)
    return "log" if ratios.max() / ratios.min() < min(4.0, steps.max() / steps.min()) else "linear"


def middles(scale: Scale, values: Array) -> Array:
    """Half-way between neighbours of rising values, on the scale that their axis has."""
    return np.sqrt(values[:-1] * values[1:]) if on_scale(scale) == "log" else (values[:-1] + values[1:]) / 2


def ends(scale: Scale, margin: float = 0.015) -> tuple[float, float]:
    """Ends of an axis: a little beyond the first and the last value."""
    low, high = float(scale.values.min()), float(scale.values.max())
    if on_scale(scale) == "log":
        more = (high / low) ** margin
        return low / more, high * more
    more = margin * (high - low) if high > low else 0.5 * abs(low) or 0.5
    return low - more, high + more


def axis_of(scale: Scale, room: int, margin: float = 0.015) -> Axis:
    """The axis along which a swept name runs; few values stand there as they were given. room: characters of a line."""
    values, log = np.unique(scale.values), on_scale(scale) == "log"
    few = values.size == 1 or (log and values.size <= 7)
    places = [(float(value), _written(value)) for value in values] if few else None
    title = fill(scale.label, room, break_long_words=False)
    return Axis(title, ends(scale, margin), places, log, powers=not log and not few)


def rings(x: Array, y: Array, size: float, beyond: bool = False) -> list[Mark]:
    """Rings of a size around points at which contact is lost; in the legend one that is seen. beyond: the frame, too"""
    look, empty = Look("limit", dash="none", mark="o", size=7, hollow=True, order=4), np.empty(0)
    legend = Line(empty, empty, "contact lost at some position", look)
    return [legend, Line(x, y, None, look.but(size=size, unclipped=beyond))]
