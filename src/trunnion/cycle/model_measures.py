"""The model's own measures over one cycle: their courses at its positions, and the figure of each; and by name all of a
mechanism that can be set, swept and measured."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import single
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.measures.evaluation import courses_of
from trunnion.measures.figures import SIGNS
from trunnion.measures.many import figures_of
from trunnion.measures.measures import Measure, named, rate_of_angle
from trunnion.measures.positions import ends_by_name
from trunnion.model.measure_table import MEASURES
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import MORE_THAN, Figure
from trunnion.results.dataset import MemberUnits, Variable, described
from trunnion.solve.forward import forward
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.run import Run, prepare
from trunnion.solve.seating import seating_of
from trunnion.solve.switches import unwrap_row

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
VARIABLES = {
    "measure_value": Variable(
        ("measure", "position"), "measure", "the model's measure; NaN of one that is no number of a position"
    ),
    "measure_figure": Variable(
        ("measure",), "measure_figure", "figure of the measure over the cycle; NaN of one that states none"
    ),
}
BETWEEN = ("largest", "peak-to-peak", "time ratio")  # rules of two extremes
TAKEN = ("time", "drive", "power_in", "power_useful", "seat_rounds", "status")  # columns of the result


@dataclass(frozen=True)
class Watched:
    """values: (measure, position), figures: (measure,), SI; findings: which measures of the model are left out, why.

    notes: what is to be known of a figure, by the measure's name; extremes: least and largest value over the cycle of
    one that states no figure. Extremes leave out where a pin loses contact: there its seat would jump.
    """

    run: Run
    measures: Sequence[Measure]
    values: Array
    figures: Array
    findings: Sequence[Finding]
    notes: Mapping[str, str]
    extremes: Mapping[str, tuple[float, float]]

    @property
    def labels(self) -> dict[str, list[str]]:
        """Names along their dimension, if there are any."""
        return {"measure": [measure.name for measure in self.measures]} if self.measures else {}

    def variables(self) -> dict[str, xr.Variable]:
        """What a result has of them."""
        if not self.measures:
            return {}
        system, values = self.run.system, self.run.values
        arrays = {"measure_value": self.values, "measure_figure": self.figures}
        units = {
            "measure": MemberUnits("measure", [measure.unit(system) for measure in self.measures]),
            "measure_figure": MemberUnits(
                "measure", [measure.figure_unit(system, values) for measure in self.measures]
            ),
        }
        return described(arrays, VARIABLES, units)

    def summary(self) -> Iterator[Figure]:
        """The figure of each; of one that states none its extremes over the cycle."""
        for measure, figure in zip(self.measures, self.figures, strict=True):
            name, subject, unit = measure.name, f"measure {measure.name}", measure.unit(self.run.system)
            if measure.rule != "deviation":
                unit_own = measure.figure_unit(self.run.system, self.run.values)
                aspect, note = measure.statistic.replace("-", " "), self.notes.get(name, "")
                figure, aspect = (MARGIN, MORE_THAN) if np.isinf(figure) else (figure, aspect)
                yield Figure(name, subject, figure, unit_own, aspect, note=note)
            elif name in self.extremes:
                least, most = self.extremes[name]
                yield Figure(f"{name}.min", subject, least, unit, "minimum")
                yield Figure(f"{name}.max", subject, most, unit, "maximum")


def watched(run: Run, time: Array, method: FrictionMethod) -> Watched:
    """The model's measures over the cycle. time: positions of the result, s."""
    of_cycle = run.once(("measures", method), lambda: _over_cycle(run, method))
    measures = of_cycle.measures
    values = np.full((len(measures), len(time)), np.nan)
    with np.errstate(all="ignore"):
        courses = courses_of(run, measures, time, method)[0] if measures else {}
    for row, measure in zip(values, measures, strict=True):
        if measure.of.reduced or len(courses[measure.name]) > 1:  # a number of the whole cycle, or several
            continue
        row[:] = courses[measure.name][0]
        if measure.wants_margin:
            row[row >= MARGIN] = np.inf
        if measure.turning(run.system):
            rate = np.asarray(rate_of_angle(measure.coordinate(run.system), run.walk(time)), float)
            unwrap_row(row, np.broadcast_to(rate, time.shape), float(time[1] - time[0]) if len(time) > 1 else 0.0)
    return replace(of_cycle, values=values)


def _over_cycle(run: Run, method: FrictionMethod) -> Watched:
    """The same at no position."""
    measures, findings, notes = list[Measure](), list[Finding](), dict[str, str]()
    for name in run.system.mechanism.measures:
        try:
            measures.append(_of_a_cycle(run, name))
        except MechanismError as error:
            what = f"the measure '{name}' is left out: {error.findings[0].what}"
            findings.append(Finding(what, f"measures.{name}", error.findings[0].remedy, Severity.NOTE))
    single = [item for item in measures if item.rule == "deviation" and item.single(run.system)]
    asked = [item for item in measures if item.rule != "deviation"]
    least, most = (
        figures_of(run, [replace(item, statistic=statistic) for item in single], method)
        for statistic in ("minimum", "maximum")
    )
    figures = figures_of(run, asked, method)
    gaps = seating_of(run, method).gaps if run.seats and asked else np.zeros((2, 0))
    for measure in asked:
        if np.isfinite(figures[measure.name]):
            if np.size(gaps):
                share = float(np.sum(gaps[1] - gaps[0])) / run.cycle.duration
                without = "without" if measure.rule in SIGNS or measure.rule in BETWEEN else "a pin loses contact in"
                notes[measure.name] = f"{without} {share:.2g} of the cycle"
        elif measure.at is not None and np.size(gaps):
            notes[measure.name] = "a pin loses contact there: state another place, or analyse with --seat free"
        elif measure.rule.startswith("dead centre"):
            notes[measure.name] = "none within the cycle; the other one has as: place-of-minimum, or no as"
        elif measure.rule == "time ratio":
            notes[measure.name] = "it does not go forth and back in a cycle that repeats, or jumps back"
        elif measure.formula:
            notes[measure.name] = "it has no value at some positions: check roots and divisions, or state over:"
    row = np.array([figures.get(item.name, np.nan) for item in measures])
    extremes = {name: (least[name], most[name]) for name in least}
    return Watched(run, measures, np.zeros((len(measures), 0)), row, findings, notes, extremes)


def _of_a_cycle(run: Run, name: str) -> Measure:
    """A measure of the model; MechanismError if this cycle has none such."""
    measure = named(run.system.mechanism, [name], run.values)[0]
    if name in TAKEN:
        raise MechanismError(Finding("it has the name of a column of the result", remedy="call it otherwise"))
    if measure.of.against or measure.of_attitude(run.system):
        what = "it is a deviation from the nominal mechanism"
        raise MechanismError(Finding(what, remedy="see `trunnion tolerance` for the effect of tolerances on it"))
    if measure.in_time:
        remedy = "see `trunnion simulate`, and `tolerance` and `sweep` for what changes it"
        raise MechanismError(Finding("it is of a motion in time", remedy=remedy))
    if measure.of.of_forces and run.determinacy is not None:
        run.determinacy.refuse()
    ends_by_name(run, [measure])
    if measure.of_places:
        measure.curve(run.walk(np.zeros(1)))
    return measure


# ---- what can be set, swept and measured -----------------------------------------------------------------------

TIMES = ("at", "over", "within", "along")  # of a measure, and no number to sweep over: they say what is looked at


class Named(NamedTuple):
    """A number or a measure by its name, its SI unit and value, NaN where there is none, and what it is in words.

    use: "sweep" of a number that `--set` and `sweep --over` take, "set" of one that `--set` alone takes, "stated" of a
    measure of the model, "measure" of one that can be named. text: of a number as it was written.
    """

    name: str
    use: str
    unit: str
    value: float
    text: str


@np.errstate(all="ignore")
def vocabulary(mechanism: Mechanism) -> tuple[list[Named], list[Finding]]:
    """Every number and every measure of a mechanism by name, with unit and present value: of a measure its figure over
    the cycle, of one that has none by itself that at the start. Then which measures of the model have none, and why.

    Raises MechanismError if the structure does not determine the motion.
    """
    run, kinds, values = prepare(mechanism), mechanism.parameter_kinds(), mechanism.parameters()
    shortest = dict[str, str]()
    for ending, paths in mechanism.parameter_names.endings.items():
        path = paths[0]
        if len(paths) == 1 and len(ending) < len(shortest.get(path, path)) and mechanism.path_of(ending) == path:
            shortest[path] = ending  # it means this number, and no dimension or whole path
    names = []
    for path, entry in mechanism.parameter_set.entries.items():
        section, _, rest = path.partition(".")
        name, value = rest if section == "dimensions" else shortest.get(path, path), single(values.get(path, np.nan))
        swept = path in values and not (section == "measures" and rest.split(".")[1] in TIMES)
        text = str(entry.quantity.source)
        names.append(Named(name, "sweep" if swept else "set", kinds[path].unit, value, text))
    of_cycle = watched(run, np.zeros(1), FrictionMethod())
    figures = dict(zip((item.name for item in of_cycle.measures), of_cycle.figures, strict=True))
    listed = [*named(mechanism, mechanism.measures, run.values), *_others(run)]
    open_ = run.determinacy is not None and any(item.severity is Severity.ERROR for item in run.determinacy.findings())
    courses = [item for item in listed if item.single(run.system) and (item.of_motion or not open_)]
    starts = courses_of(run, courses, np.zeros(1), FrictionMethod())[0]
    for measure in listed:
        value = float(figures.get(measure.name, np.nan))
        if not np.isfinite(value) and measure.name in starts:
            value = single(starts[measure.name][0])
        use = "stated" if measure.name in mechanism.measures else "measure"
        unit = measure.figure_unit(run.system, run.values)
        names.append(Named(measure.name, use, unit, value, measure.of.long_name))
    return names, list(of_cycle.findings)


def _others(run: Run) -> Iterator[Measure]:
    """What can be measured beside what the model states: every kind of everything that moves or bears and has it."""
    mechanism = run.system.mechanism
    walk = forward(run.system, run.values, run.chosen.assembly, np.zeros(1))
    for kind, of in MEASURES.items():
        if of.space not in ("", mechanism.space) or kind == "expression":
            continue
        for subject in mechanism.named(of.of) if isinstance(of.of, str) else of.of:
            if subject.partition(".")[0] == mechanism.fixed_link and of.of in ("point", "link"):
                continue
            axes = ("x", "y", "z")[: mechanism.coordinates]
            picked = of.vector_in(mechanism.space)
            for axis in (*([""] if picked != "must" else []), *(axes if picked else ())):
                full_name = f"{subject}.{axis}" if axis else subject
                text = full_name if kind == "point" else f"{kind}:{full_name}"
                with suppress(MechanismError):  # such as the slide of a joint that turns
                    measure = named(mechanism, [text], run.values)[0]
                    if measure.of_places:
                        measure.curve(walk)
                    yield measure
