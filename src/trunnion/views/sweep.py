"""Views of a sweep: figures of the cycle over swept names, as tables, families of curves, maps, and a page.

Figures are named as the columns of the CSV file: `efficiency`, `A.effort_max`, `B.reaction_max`. One name runs along
the axis or down the table, a second one makes the curves or the columns, each value of further names a panel or a table
of its own; names with one value are in the title. Long tables are thinned evenly, their ends included.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise, product
from math import prod
from textwrap import fill
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.model.names import nearest
from trunnion.results.attributes import attribute
from trunnion.results.dataset import without_noise
from trunnion.results.quantities import SUPERSCRIPT, WORDS, prefixed
from trunnion.results.tables.studies import swept as figures_of
from trunnion.solve.friction_method import MARGIN
from trunnion.studies.sweep_grid import FIGURES
from trunnion.views.axis import Array
from trunnion.views.charts import Axis, Chart, ColourScale, Contours, Line, Look, Mark, Panel, Plot, Stripe
from trunnion.views.curves import check_kind, ease_of_status, outside, usual_peak
from trunnion.views.page import Section, Table, counts, page

if TYPE_CHECKING:
    from trunnion.model.mechanism import Mechanism

KINDS = ("curves", "map")  # of figures
CAUSES = {
    int(Status.NOT_CONVERGED): "not converged",
    int(Status.LOCKED): "locked",
    int(Status.LOAD_UNDEFINED): "load undefined",
    int(Status.SINGULAR): "dead centre",
    int(Status.NOT_ASSEMBLED): "cannot be assembled",
}
MILDER = {int(Status.NEAR_SINGULAR): "near singular", int(Status.CONTACT_LOST): "contact lost"}
SIGNS = {"um": "µm", "deg": "°", **WORDS}  # in figures
MOST_ROWS, MOST_COLUMNS, MOST_TABLES = 40, 8, 6
BESIDE = "friction_power_mean", "locking_margin"  # in the table beside the measure, if the sweep has them


# ---- what runs along what -----------------------------------------------------------------------------------------


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

    @property
    def log(self) -> bool:
        """Whether its values are positive, span ten times or more and are spaced by ratios."""
        values = np.unique(self.values)
        if values.size < 3 or values[0] <= 0 or values[-1] < 10 * values[0]:
            return False
        ratios, steps = np.diff(np.log(values)), np.diff(values)
        return bool(ratios.max() / ratios.min() < min(4.0, steps.max() / steps.min()))

    def say(self, index: int) -> str:
        """A value with its unit."""
        return f"{self.values[index]:.6g} {self.unit}".rstrip()

    def equation(self, index: int) -> str:
        """A value for a figure, not to be broken into lines: "misalignment = −5°"."""
        unit = SIGNS.get(self.unit, self.unit)
        text = f"{self.name} = {_written(self.values[index])}{'' if unit in ('', '°') else ' '}{unit}"
        return text.replace(" ", "\u00a0")

    def edges(self, values: Array, margin: float = 0.015) -> Array:
        """Where the surroundings of rising values end: half-way to the next on the scale of their axis, a little beyond
        the first and the last."""
        places = np.log(values) if self.log else values
        low, high = float(places[0]), float(places[-1])
        more = margin * (high - low) if high > low else 0.5 * abs(low) or 0.5
        places = np.concatenate([[low - more], (places[:-1] + places[1:]) / 2, [high + more]])
        return np.asarray(np.exp(places) if self.log else places, float)

    def axis(self, room: int, margin: float = 0.015) -> Axis:
        """The axis along which it runs; few values stand there as they were given. room: characters of a line."""
        values = np.unique(self.values)
        few = values.size == 1 or (self.log and values.size <= 7)
        places = [(float(value), _written(value)) for value in values] if few else None
        low, *_, high = self.edges(values, margin).tolist()
        return Axis(fill(self.label, room, break_long_words=False), (low, high), places, self.log)


def _written(value: float) -> str:
    """A number as it was given, for a figure: a true minus, 2.5×10⁻⁶ for 2.5e-06."""
    mantissa, _, power = f"{value + 0.0:.6g}".partition("e")
    text = f"{mantissa}×10{str(int(power)).translate(SUPERSCRIPT)}" if power else mantissa
    return text.replace("-", "−")


def thinned(count: int, most: int) -> list[int]:
    """Indices of at most so many of them, evenly, the ends among them."""
    return [int(i) for i in np.unique(np.rint(np.linspace(0, count - 1, min(count, most))))]


class Cell(NamedTuple):
    """What a panel shows, (axis, curve): the numbers, those of the ideal mechanism, why there is none, 0 where there is
    one, and where contact is lost at some position."""

    values: Array
    ideal: Array
    codes: NDArray[np.int8]
    lost: NDArray[np.bool_]

    def taken(self, rows: Any) -> Cell:
        """Some of the rows, or cells, in another order."""
        return Cell(*(part[rows] for part in self))


class Arrangement(NamedTuple):
    """Which name runs along the axis, which makes the curves (or runs upwards in a map), which the panels.

    fixed: names with one value, which have no place but in the title.
    """

    x: Scale
    other: Scale | None
    facets: tuple[Scale, ...]
    fixed: tuple[Scale, ...]

    def title(self, text: str, place: Sequence[int] = ()) -> str:
        """A title with the values of the facets at a place, and of the fixed names."""
        at = [scale.equation(i) for scale, i in zip(self.facets, place, strict=False)]
        at += [scale.equation(0) for scale in self.fixed]
        return f"{text} at {', '.join(at)}" if at else text

    @property
    def places(self) -> list[tuple[int, ...]]:
        """The panels: a number of the value of each facet."""
        return list(product(*(range(len(scale.values)) for scale in self.facets)))

    def cube(self, result: xr.Dataset, values: NDArray[Any]) -> NDArray[Any]:
        """Values of all points in the order of the file as (axis, curve, *facets)."""
        swept = attribute(result, "swept")
        array = xr.DataArray(values.reshape([result.sizes[name] for name in swept]), dims=swept)
        array = array.squeeze([scale.name for scale in self.fixed])
        drawn = [self.x.name, *([self.other.name] if self.other else []), *(scale.name for scale in self.facets)]
        cube = array.transpose(*drawn).values
        return np.asarray(cube if self.other else cube[:, np.newaxis])


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


def check_axes(sizes: Mapping[str, int], x: str = "", family: str = "") -> tuple[str, str]:
    """Names of the axis and of the curves, "" if there is one curve, from how many values each swept name has."""
    for name, option in ((x, "--x"), (family, "--family")):
        if name and name not in sizes:
            raise MechanismError(Finding(f"'{name}' is not swept over", option, nearest(name, sizes)))
    if x and x == family:
        raise MechanismError(Finding(f"'{x}' cannot be both the axis and the curves", "--family", "name another"))
    order = sorted(sizes, key=lambda name: sizes[name] == 1)  # stable: as given, those with one value last
    first = x or next((name for name in order if name != family), family)
    second = family if first != family else ""
    return first, second or next((name for name in order if name != first and sizes[name] > 1), "")


def check_measure(measures: str | Iterable[str], mechanism: Mechanism) -> list[str]:
    """Those of the names that are of measures of the model, or written as one is, and not of figures of every sweep.

    MechanismError with the nearest name, and the measures there are, if a name is neither.
    """
    of_dim = {"driver": list(mechanism.drivers), "joint": list(mechanism.effective_joints)}
    every = [
        f"{member}.{key.removeprefix('drive_')}" if figure.dims else key
        for key, figure in FIGURES.items()
        for member in (of_dim[figure.dims[0]] if figure.dims else [""])
        if key != "status"
    ]
    of_model = []
    for name in [measures] if isinstance(measures, str) else measures:
        if name in mechanism.measures or (":" in name and name not in every):
            of_model.append(name)
        elif name not in every:
            remedy = nearest(name, [*every, *mechanism.measures])
            if mechanism.measures:
                remedy += f"; the model's measures are {', '.join(mechanism.measures)}"
            raise MechanismError(Finding(f"there is no figure or measure '{name}'", "--measure", remedy))
    return of_model


def grid(result: xr.Dataset, plan: Arrangement, name: str) -> tuple[str, Array]:
    """Unit and values, (axis, curve, *facets), of a figure."""
    every = figures_of(result)
    if name not in every:
        of_errors = name.endswith(("_ideal", "transmission_error_max"))
        what = "no mechanism of the sweep has errors" if of_errors else "the sweep does not hold it"
        remedy = "state errors, a misalignment or a seat: loaded" if of_errors else nearest(name, every)
        raise MechanismError(Finding(f"{what}: there is no figure '{name}'", "--measure", remedy))
    unit, values = every[name]
    return unit, plan.cube(result, np.asarray(values, float))


def statuses(result: xr.Dataset, plan: Arrangement) -> NDArray[np.int8]:
    """Codes of status, (axis, curve, *facets)."""
    return plan.cube(result, result["status"].transpose(*attribute(result, "swept")).values.astype(np.int8))


# ---- tables -------------------------------------------------------------------------------------------------------


def tables(result: xr.Dataset, measures: Sequence[str] = ("efficiency",), x: str = "", family: str = "") -> list[Table]:
    """One table of several figures over a single name; of more names one for each measure and value of the facets."""
    result = without_noise(result)
    plan = arrange(result, x, family)
    status = statuses(result, plan)
    if plan.other is None:
        return [_over_one(result, measures, plan, status[:, 0])]
    every = []
    for measure in measures:
        name, values = _column(result, plan, measure)
        picked = [plan.places[i] for i in thinned(len(plan.places), MOST_TABLES)]
        down, across = (
            thinned(len(plan.x.values), MOST_ROWS // len(picked)),
            thinned(len(plan.other.values), MOST_COLUMNS),
        )
        for place in picked:
            cell: Any = (slice(None), slice(None), *place)
            rows = [[_number(plan.x.values[i]),
                     *(_number(values[cell][i, k], name) or CAUSES.get(int(status[cell][i, k]), "") for k in across)]
                    for i in down]  # fmt: skip
            title = plan.title(f"{name} over {plan.x.name} and, in columns, {plan.other.name},", place).rstrip(",")
            head, left_out = [plan.x.title, *map(plan.other.say, across)], values[cell].size - len(down) * len(across)
            every.append(Table(title, head, rows, left_out))
        hidden = (len(plan.places) - len(picked)) * len(plan.x.values) * len(plan.other.values)
        every[-1] = replace(every[-1], left_out=every[-1].left_out + hidden)
    return every


def _over_one(result: xr.Dataset, measures: Sequence[str], plan: Arrangement, status: NDArray[np.int8]) -> Table:
    """Several figures over one name: the measures, efficiency and efforts, and what stands beside.

    Of a driver's effort the ends that lie beyond 0 at any point: both where its sign changes.
    """
    every, efforts = figures_of(result), list[str]()
    for driver in (name.removesuffix(".effort_max") for name in every if name.endswith(".effort_max")):
        ends = {f"{driver}.effort_min": -1.0, f"{driver}.effort_max": 1.0}
        reached = [name for name, sign in ends.items() if np.nanmax(sign * every[name][1], initial=0.0) > 0]
        efforts += reached or [f"{driver}.effort_max"]
    columns = [_column(result, plan, name)
               for name in dict.fromkeys([*measures, "efficiency", "efficiency_ideal", *efforts, *BESIDE])
               if name in every or name in measures]  # fmt: skip
    words = [(CAUSES | MILDER).get(int(code), "") for code in status]
    picked = thinned(len(plan.x.values), MOST_ROWS)
    rows = [[_number(plan.x.values[i]), *(_number(values[i, 0], head) for head, values in columns),
             *([words[i]] if any(words) else [])] for i in picked]  # fmt: skip
    title = f"{', '.join(name.replace('_', ' ') for name in measures)} over {plan.x.name}"
    head = [plan.x.title, *(head for head, _ in columns), *(["status"] if any(words) else [])]
    return Table(plan.title(f"{title},").rstrip(","), head, rows, len(words) - len(picked))


def _column(result: xr.Dataset, plan: Arrangement, name: str) -> tuple[str, Array]:
    """Head and numbers of a figure: lengths in mm, angles in degrees."""
    unit, values = grid(result, plan, name)
    factor, display_unit = {"m": (1e3, "mm"), "rad": (180 / np.pi, "deg")}.get(unit, (1.0, unit))
    return name.replace("_", " ") + (f" [{display_unit}]" if display_unit not in ("", "1") else ""), factor * values


def _number(value: float, head: str = "") -> str:
    """Empty for what is not known; of a locking margin, which alone has no end and no unit, as far as it is looked for.

    head: of its column, with the unit; the effort of a mechanism that locks is ∞.
    """
    if np.isnan(value):
        return ""
    if value == np.inf and "[" not in head:
        return f"> {MARGIN:g}"
    return f"{value + 0.0:.6g}".replace("inf", "∞")  # + 0.0: no negative zero


# ---- figures ------------------------------------------------------------------------------------------------------

WIDE = 74  # characters of a title in a line
MOST_PANELS = 12
MOST_NAMED = 8  # curves that are told apart by a legend; more by a scale of colours
MARKS, MOST_MARKED = "os^DvPX*", 40  # points of a curve, so that curves are told apart in grey, too
BANDS = 10  # of a map
ALIKE = 1e-9  # of the largest: numbers that differ by less are taken as one
NOTHING = -1  # beside the statuses: sound, and yet without a number
HATCHES = {
    NOTHING: "oo", int(Status.NOT_CONVERGED): "...", int(Status.LOCKED): "////", int(Status.LOAD_UNDEFINED): "||||",
    int(Status.SINGULAR): "----", int(Status.NOT_ASSEMBLED): "xxx",
}  # fmt: skip


def figure(
    result: xr.Dataset, kind: str = "curves", measure: str = "efficiency", x: str = "", family: str = ""
) -> Plot:
    """A number of the cycle over swept names, a panel for each value of further names.

    Parameters
    ----------
    result : of a sweep
    kind : of KINDS. Where there is no answer it is grey or hatched, with the cause; the curves of a mechanism with
        errors stand beside those of the ideal one, if the sweep has them
    measure : the number, by its column in the CSV file
    x, family : the name along the axis and that of the curves, or upwards in a map; the first two that vary if not
        given

    Raises
    ------
    MechanismError : for names that are not swept, and for a map of fewer than two names that vary
    """
    check_kind(kind, KINDS)
    result = without_noise(result)
    plan = arrange(result, x, family)
    if kind == "map" and any(scale is None or np.unique(scale.values).size < 2 for scale in (plan.x, plan.other)):
        remedy = "sweep over two names with several values each, or draw curves"
        raise MechanismError(Finding("a map needs two names that vary", "--kind map", remedy))
    unit, values = grid(result, plan, measure)
    ideal = grid(result, plan, f"{measure}_ideal")[1] if f"{measure}_ideal" in result else np.full(values.shape, np.nan)
    status, causes = statuses(result, plan), {NOTHING: "∞" if np.isinf(values).any() else "no value"} | CAUSES
    values = np.where(np.isfinite(values), values, np.nan)
    usual = usual_peak(ease_of_status(result, status), values, ideal)
    factor, unit_shown = prefixed(usual, unit)
    values, ideal, usual = values * factor, ideal * factor, usual * factor
    codes = np.where(status >= Status.NOT_CONVERGED, status, np.where(np.isfinite(values), 0, NOTHING))
    noun = meaning(measure, unit)
    label = f"{noun} [{unit_shown}]" if unit_shown else noun
    picked = [plan.places[k] for k in thinned(len(plan.places), MOST_PANELS)]
    columns = len(picked) if len(picked) <= 3 else 2 if len(picked) == 4 else 3 if len(picked) <= 9 else 4
    room, bounds = 78 // columns, _bounds(np.append(values, ideal), usual)
    colours = _levels(label, np.append(values, ideal), bounds) if kind == "map" else _colours(plan.other)
    lost, panels = (status == Status.CONTACT_LOST) & np.isfinite(values), []
    for place in picked:
        cell = Cell(values, ideal, codes, lost).taken((slice(None), slice(None), *place))
        head = fill(plan._replace(fixed=()).title("", place).removeprefix(" at "), room, break_long_words=False)
        peak = float(np.nanmax(np.abs(cell.values), initial=0.0))
        cut = [outside(peak / factor, unit)] if peak > usual * (1 + ALIKE) else []
        wide, along = 32 if head else 60, plan.x.axis(room, 0.0 if kind == "map" else 0.015)
        if kind == "map" and plan.other is not None and colours is not None:
            up, marks = plan.other.axis(wide, 0.0), _map(plan, cell, causes, colours)
        else:
            up, marks = Axis(fill(label, wide, break_long_words=False), bounds), _curves(plan, cell, causes)
        panels.append(Panel("", [Chart(along, up, [*marks, *cut], title=head)]))
    rows = -(-len(panels) // columns)
    over = f"{plan.x.name} and {plan.other.name}" if kind == "map" and plan.other else plan.x.name
    hidden = f" ({len(picked)} of {len(plan.places)} panels)" if len(picked) < len(plan.places) else ""
    title = plan.title(f"{noun[:1].upper()}{noun[1:]} over {over}") + hidden
    panels = [Panel("", panel.charts, 3.45 if rows == 1 else 0.35 / rows + 2.1) for panel in panels]
    return Plot(fill(title, WIDE, break_long_words=False), panels, columns, 7.4 if len(panels) == 1 else 9.4,
                shared=True, colours=colours)  # fmt: skip


def meaning(name: str, unit: str) -> str:
    """A figure in words: "largest reaction of B"; of a whole cycle what it is called."""
    member, _, key = name.rpartition(".")
    about = FIGURES.get(key) or FIGURES.get(f"drive_{key}")
    if about is None or not about.dims:
        return name.replace("_", " ")
    if key == "transmission_error_max":
        return f"maximum error of the {'slide' if unit == 'm' else 'rotation'} of {member}"
    return f"{about.long_name} of {member}"


def _bounds(every: Array, usual: float) -> tuple[float, float]:
    """Ends of the common axis of curves, a little beyond all numbers but peaks that are cut."""
    finite = every[np.isfinite(every)]
    low, high = np.clip([finite.min(), finite.max()], -usual, usual).tolist() if finite.size else (0.0, 1.0)
    margin = 0.05 * (high - low) if high - low > ALIKE * usual else 0.1 * abs(high) or 1.0
    return low - margin, high + margin


def _colours(other: Scale | None) -> ColourScale | None:
    """The scale of colours that tells many curves apart."""
    if other is None or len(other.values) <= MOST_NAMED:
        return None
    return ColourScale(other.label, float(other.values.min()), float(other.values.max()), other.log)


def _levels(title: str, every: Array, bounds: tuple[float, float]) -> ColourScale:
    """Round edges of a few bands over what is shown."""
    from matplotlib.ticker import MaxNLocator

    finite = every[np.isfinite(every)]
    ends = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    margin = (bounds[1] - bounds[0]) / 22  # of bounds that are a twentieth wider at either end
    low, high = bounds[0] + margin, bounds[1] - margin
    if ends[1] - ends[0] <= ALIKE * max(map(abs, ends)):
        return ColourScale(title, *bounds, levels=bounds)
    levels = [float(level) for level in MaxNLocator(BANDS, steps=[1, 2, 2.5, 5, 10]).tick_values(low, high)]
    return ColourScale(title, *ends, levels=levels)


def _lost(x: Array, y: Array, size: float) -> list[Mark]:
    """Rings around points at which contact is lost at some position."""
    look = Look("limit", dash="none", mark="o", size=size, hollow=True, order=4)
    return [Line(x, y, "contact lost at some position", look)] if x.size else []


def _curves(plan: Arrangement, cell: Cell, causes: Mapping[int, str]) -> list[Mark]:
    """One curve for each value of the second name; grey where none has an answer, crosses at the ends of gaps."""
    other, order, colours = plan.other, np.argsort(plan.x.values, kind="stable"), _colours(plan.other)
    x, (values, ideal, codes, lost) = plan.x.values[order], cell.taken(order)
    gone = np.where((codes == 0).any(axis=1), 0, np.where(codes, codes, NOTHING).max(axis=1))
    ends, sides = plan.x.edges(x), np.append(np.flatnonzero(np.diff(gone, prepend=99)), len(gone))
    marks: list[Mark] = [Stripe(ends[start], ends[stop], causes[int(gone[start])])
                         for start, stop in pairwise(sides.tolist()) if gone[start]]  # fmt: skip
    compared = bool(np.isfinite(ideal).any())
    for k, y in enumerate(values.T):
        look = Look(k, mark=MARKS[k % 8] if x.size <= MOST_MARKED else "", size=3.5)
        label = "as built" if compared else None
        if colours is not None and other is not None:
            look, label = Look(colours.share(float(other.values[k])), 1.2, mark="o" * (x.size == 1)), None
        elif other is not None:
            label = other.equation(k)
        marks.append(Line(x, y, label, look))
        at_gap = np.isfinite(y) & (np.isnan(np.append(y[:1], y[:-1])) | np.isnan(np.append(y[1:], y[-1:])))
        if at_gap.any():
            marks.append(Line(x[at_gap], y[at_gap], None, look._replace(dash="none", mark="x", size=7.0, order=4.0)))
        if compared:
            name = None if k else "ideal" if other is None else "ideal, dashed"
            marks.append(Line(x, ideal[:, k], name, Look("ink", 1.0, "long")))
    rows, across = np.nonzero(lost)
    return [*marks, *_lost(x[rows], values[rows, across], 6.0)]


def _map(plan: Arrangement, cell: Cell, causes: Mapping[int, str], colours: ColourScale) -> list[Mark]:
    """Bands of the number over two names, hatched where there is none."""
    assert plan.other is not None  # as `figure` sees to
    (x, across), (y, upward) = (np.unique(scale.values, return_index=True) for scale in (plan.x, plan.other))
    values, _, codes, lost = cell.taken(np.ix_(across, upward))
    gaps = [(causes[code], hatch, codes == code) for code, hatch in HATCHES.items() if np.any(codes == code)]
    rows, columns = np.nonzero(lost)
    rings = _lost(x[rows], y[columns], float(np.clip(160 / max(lost.shape), 1.5, 8)))
    return [Contours(x, y, values, plan.x.edges(x, 0.0), plan.other.edges(y, 0.0), colours, gaps), *rings]


# ---- report -------------------------------------------------------------------------------------------------------


def report(
    result: xr.Dataset, measures: Sequence[str] = ("efficiency",), x: str = "", family: str = "", kind: str = "curves"
) -> str:
    """The whole report as HTML, a figure and tables of every measure; options: those of `figure`."""
    over = " and ".join(attribute(result, "swept"))
    facts = [*counts((prod(result.sizes[name] for name in attribute(result, "swept")), "point")), ("over", over)]
    parts = []
    for name in measures:
        after = [table.titled(f"{table.title}; {table.left_out:,} points more in a table file" if table.left_out
                              else table.title) for table in tables(result, [name], x, family)]  # fmt: skip
        pictures = [(f"{name} over {over}", figure(result, kind, name, x, family))]
        parts.append(Section(name, "", pictures, after=after))
    return page(result, "Results over a range of model values", facts, parts)
