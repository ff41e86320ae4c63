"""The model's own measures over one cycle: their courses at its positions, and the figure of each."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.unwrap import unwrap_row
from trunnion.errors import Finding, MechanismError, Severity, Status
from trunnion.measures.evaluation import courses_of
from trunnion.measures.measures import Measure, named
from trunnion.measures.over_cycle import figures_of
from trunnion.measures.positions import plan, within
from trunnion.results.dataset import MemberUnits, Variable, described, with_variables
from trunnion.results.figure import MORE_THAN, Figure
from trunnion.results.sentences import finding_for
from trunnion.solve.forward import forward
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.seating import seating_of

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["VARIABLES", "Watched", "watched"]

Array = NDArray[np.float64]
VARIABLES = {
    "measure_value": Variable(
        ("measure", "position"), "measure", "the model's measure; NaN of one that is no number of a position"
    ),
    "measure_figure": Variable(
        ("measure",), "measure_figure", "figure of the measure over the cycle; NaN of one that states none"
    ),
}
SWITCHES = ", where a load begins or ends or a joint reverses, and the pins cross their play"
# figures of single positions, and the course whose extremes these are
OF_PLACES: dict[str, Callable[[Array], Array]] = {
    **dict.fromkeys(
        ("value", "maximum", "minimum", "peak-to-peak", "place-of-maximum", "place-of-minimum", "time ratio"),
        lambda course: course,
    ),
    "largest": np.abs,
}
TAKEN = ("time", "drive", "power_in", "power_useful", "seat_rounds", "status")  # columns of the result


@dataclass(frozen=True)
class Watched:
    """values: (measure, position), figures: (measure,), SI; findings: which measures of the model are left out, why.

    notes: what a pin that loses contact does to a figure, by the measure's name; extremes: least and largest value over
    the cycle of one that states no figure, where no pin does.
    """

    run: Run
    measures: Sequence[Measure]
    values: Array
    figures: Array
    findings: Sequence[Finding]
    notes: Mapping[str, str]
    extremes: Mapping[str, tuple[float, float]]

    def joined(self, result: xr.Dataset) -> xr.Dataset:
        """A result with them."""
        if not self.measures:
            return result
        system, values = self.run.system, self.run.values
        arrays = {"measure_value": self.values, "measure_figure": self.figures}
        units = {
            "measure": MemberUnits("measure", [one.unit(system) for one in self.measures]),
            "measure_figure": MemberUnits("measure", [one.figure_unit(system, values) for one in self.measures]),
        }
        labelled = result.assign_coords(measure=np.asarray([one.name for one in self.measures], dtype=str))
        return with_variables(labelled, described(arrays, VARIABLES, units))

    def summary(self) -> Iterator[Figure]:
        """The figure of each; of one that states none its extremes over the cycle."""
        for measure, figure in zip(self.measures, self.figures, strict=True):
            name, subject, unit = measure.name, f"measure {measure.name}", measure.unit(self.run.system)
            if measure.rule != "deviation":
                own = measure.figure_unit(self.run.system, self.run.values)
                aspect, note = measure.statistic.replace("-", " "), self.notes.get(name, "")
                figure, aspect = (MARGIN, MORE_THAN) if np.isinf(figure) else (figure, aspect)
                yield Figure(name, subject, figure, own, aspect, note=note)
            elif name in self.extremes:
                least, most = self.extremes[name]
                yield Figure(f"{name}.min", subject, least, unit, "minimum")
                yield Figure(f"{name}.max", subject, most, unit, "maximum")


def watched(run: Run, time: Array, method: FrictionMethod, status: NDArray[Any] | None = None) -> Watched:
    """The model's measures over the cycle. time: positions of the result, s; status: theirs, if known.

    A figure at a position where a pin loses contact is NaN: it is that of a seat which would jump.
    """
    steps, measures, findings = len(time), [], []
    for name in run.system.mechanism.measures:
        try:
            measures.append(_had(run, name, steps))
        except MechanismError as error:
            told = f"the measure '{name}' is left out: {error.findings[0].what}"
            findings.append(Finding(told, f"measures.{name}", error.findings[0].remedy, Severity.NOTE))
    values = _values_at(run, measures, time, method)
    stated = [one for one in measures if one.rule != "deviation"]
    with np.errstate(all="ignore"):
        of_cycle = figures_of(run, stated, method) if stated else {}
        extremes = _extremes(run, [one for one in measures if one.rule == "deviation"], method)
    figures = np.array([of_cycle.get(one.name, np.nan) for one in measures], float)
    valid = np.ones(steps, bool) if status is None else status != Status.CONTACT_LOST
    notes: dict[str, str] = {}
    for measure, figure in zip(measures, figures, strict=True):
        if measure.rule.startswith("dead centre") and not np.isfinite(figure):
            ends = "minimum", "maximum: leave out as"
            what, other = ends if measure.rule.endswith("least") else ("maximum", "minimum: state as: place-of-minimum")
            notes[measure.name] = f"no {what} within the cycle; for a {other}"
        elif measure.rule == "time ratio" and not np.isfinite(figure):
            notes[measure.name] = "it does not go forth and back in a cycle that repeats, or jumps back"
    if np.all(valid):
        return Watched(run, measures, values, figures, findings, notes, extremes)
    dial = run.system.dial(run.values, time)
    for i, measure in enumerate(measures):
        if measure.rule == "deviation":
            continue
        there = _resting_on(run, measure, values[i], time)
        lost = ~valid[there]
        if measure.rule in OF_PLACES and np.any(lost):
            at = " and ".join(dial.at(int(k)) for k in there[lost])
            figures[i], notes[measure.name] = np.nan, f"not valid: a pin loses contact at its place, {at}"
            why = SWITCHES if _beside_switch(run, time, there[lost]) else ""
            where = f"measures.{measure.name}"
            findings.append(finding_for("measure.contact_lost", where, at=at, phrases={"why": why}))
        elif np.any(lost):
            notes[measure.name] = f"a pin loses contact at {np.count_nonzero(lost)} of its {len(lost)} positions"
    return Watched(run, measures, values, figures, findings, notes, extremes)


def _extremes(run: Run, measures: Sequence[Measure], method: FrictionMethod) -> dict[str, tuple[float, float]]:
    """Least and largest value of measures over the cycle, where no pin loses contact; of those of one number alone."""
    single = [one for one in measures if one.single(run.system)]
    if not single:
        return {}
    gaps = seating_of(run, method).gaps if run.seats else None
    ends = [
        figures_of(run, [replace(one, statistic=statistic) for one in single], method, gaps)
        for statistic in ("minimum", "maximum")
    ]
    return {one.name: (ends[0][one.name], ends[1][one.name]) for one in single}


def _beside_switch(run: Run, time: Array, places: NDArray[np.intp]) -> bool:
    """Whether the model switches within a step of every one of some positions."""
    step, around = run.cycle.duration / len(time), run.cycle.duration if run.cycle.periodic else np.inf
    away = np.abs(time[places, None] - run.edges[1:-1])
    return bool(np.all(np.min(np.minimum(away, around - away), axis=1, initial=np.inf) <= step))


def _resting_on(run: Run, measure: Measure, values: Array, time: Array) -> NDArray[np.intp]:
    """Positions that a figure is of, nearest to it: those of its extremes, or all of its window."""
    window = plan(run, [measure], len(time)).windows[measure.name]
    duration, places = run.cycle.duration, within(run, window.time)
    more = [duration] if run.cycle.periodic and duration > 0 else []  # after the last position the first one again
    index = np.unique(np.rint(np.interp(places, [*time, *more], range(len(time) + len(more)))).astype(int) % len(time))
    course = values[index]
    if measure.rule not in OF_PLACES or not np.any(np.isfinite(course)):
        return index
    picks = [pick(OF_PLACES[measure.rule](course)) for pick in (np.nanargmin, np.nanargmax)]
    ends = {"minimum": picks[:1], "place-of-minimum": picks[:1], "peak-to-peak": picks, "time ratio": picks}
    return index[ends.get(measure.rule, picks[1:])]


def _had(run: Run, name: str, steps: int) -> Measure:
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
    plan(run, [measure], steps)
    if measure.of_places:
        measure.curve(forward(run.system, run.values, run.chosen.assembly, np.zeros(1)))
    return measure


def _values_at(run: Run, measures: Sequence[Measure], time: Array, method: FrictionMethod) -> Array:
    """The measures, (measure, position), at some times in a row, s; NaN of one that is no number of a
    position, but of several, or of the whole cycle."""
    system = run.system
    values = np.full((len(measures), len(time)), np.nan)
    if not measures:
        return values
    with np.errstate(all="ignore"):
        courses = courses_of(run, measures, time, method)[0]
        walk = forward(system, run.values, run.chosen.assembly, time)
    for i, measure in enumerate(measures):
        if len(courses[measure.name]) > 1 or measure.of.reduced:
            continue
        values[i] = courses[measure.name][0]
        if measure.wants_margin:
            values[i][values[i] >= MARGIN] = np.inf
        if measure.turning(system):
            rate = np.broadcast_to(np.asarray(measure.coordinate(system).rate(walk), float), time.shape)
            step = float(time[1] - time[0]) if len(time) > 1 else 0.0
            unwrap_row(values[i], rate, step)
    return values
