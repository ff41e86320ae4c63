"""Figures of measures: of one mechanism as it is, and of many that differ in their numbers from a nominal one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy
from trunnion.measures.evaluation import Kernel, SeatedKernel
from trunnion.measures.figures import Read
from trunnion.measures.group import MOTION, Group, matters
from trunnion.measures.measures import Measure
from trunnion.measures.positions import ends_by_name
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run
from trunnion.solve.seating import seating_of
from trunnion.solve.switches import MARGINS, SEATED
from trunnion.solve.system import Values

__all__ = ["Many", "Read", "figures_of"]

Array = NDArray[np.float64]


@np.errstate(all="ignore")
def figures_of(run: Run, measures: Sequence[Measure], method: FrictionMethod) -> dict[str, float]:
    """The figures of measures of one mechanism, SI, by name; NaN where a place that one needs has no answer.

    Extremes leave out where a pin loses contact, for its seat would jump there.
    Raises MechanismError for places and windows that are not in the cycle.
    """
    figures: dict[str, float] = {}
    gaps = seating_of(run, method).gaps if run.seats and measures else np.zeros((2, 0))
    for ends, grouped in together(run, measures):
        kernel = SeatedKernel(run, grouped, replace(method, margin_up_to=0.0), gaps)
        group = Group(run, grouped, ends, run.values, kernel, {})
        breaks = [bend.time for bend in run.bends if run.seats or matters(bend, grouped)]
        breaks += [*(seating_of(run, method).breaks if run.seats else ()), *gaps.ravel()]
        motion = MOTION if group.of_motion else Accuracy()
        accuracy = MARGINS if grouped[0].wants_margin else SEATED if run.seats else motion
        figures |= group.own_figures(np.array(breaks), accuracy)
    return {measure.name: figures[measure.name] for measure in measures}


def together(run: Run, measures: Sequence[Measure]) -> list[tuple[tuple[float, ...], tuple[Measure, ...]]]:
    """Measures whose courses have the same panels, with the place or the ends of their window, s, (0,) at rest.

    Raises MechanismError for places and windows that are not in the cycle.
    """
    groups: dict[tuple[object, ...], list[Measure]] = {}
    every = ends_by_name(run, measures)
    for measure in measures:
        ends = every[measure.name]
        against = measure.of.against or measure.rule == "deviation"
        key = (ends, measure.wants_margin, measure.of_motion, against and not measure.of_motion)
        groups.setdefault(key if len(ends) != 1 else (ends,), []).append(measure)
    return [(every[group[0].name], tuple(group)) for group in groups.values()]


class Many:
    """Measures of a nominal mechanism, ready to be read of others.

    run: the mechanism; values: its numbers, with pins where they are to be. kernels: what evaluates some measures.
    figures: of the nominal mechanism, by name; times: of those that are an extreme, s, else NaN.
    """

    def __init__(
        self, run: Run, measures: Sequence[Measure], values: Values, kernels: Callable[[Sequence[Measure]], Kernel]
    ) -> None:
        self.run, self.measures, self.values, self._kernels = run, tuple(measures), values, kernels
        self.figures: dict[str, float] = {}
        self.times: dict[str, float] = {}
        self._groups = [
            Group(run, group, ends, values, kernels(group), self.figures) for ends, group in together(run, measures)
        ]
        self.tune(values)

    def tune(self, values: Values) -> None:
        """Let the panels resolve the courses of some mechanisms, which stand for all that are to be read."""
        self.figures.clear()
        with np.errstate(all="ignore"):
            for group in self._groups:
                group.tune(values)
        reads = self.read(self.values)
        self.figures.update((name, float(np.ravel(read.figure)[0])) for name, read in reads.items())
        self.times = {measure.name: float(reads[measure.name].time[0]) for measure in self.measures}

    def only(self, measures: Sequence[Measure]) -> Many:
        """The same of some of the measures, their panels tuned to the nominal mechanism alone."""
        return Many(self.run, measures, self.values, self._kernels)

    def angle(self, measure: Measure, times: Array) -> Array:
        """The angle of the nominal mechanism near some times, s, without jumps, of a measure that turns."""
        group = next(group for group in self._groups if measure in group.measures)
        return np.asarray(np.interp(times, *group.angles[measure.name]))

    def spots(self, measure: Measure) -> Array:
        """Times, s, rising, at which a course is looked through, both sides of every break among them."""
        group = next(group for group in self._groups if measure in group.measures)
        return group.edges if group.at_place else group.spots

    def read(self, values: Values, times: Mapping[str, Array] | None = None) -> dict[str, Read]:
        """What the courses of mechanisms with other numbers say, by measure.

        values: (lane, 1) where they vary, floats or dual numbers. times: of each measure, s, at which its course is to
        be shown.
        """
        reads: dict[str, Read] = {}
        with np.errstate(all="ignore"):
            for group in self._groups:
                reads |= group.read(values, times or {})
        return {measure.name: reads[measure.name] for measure in self.measures}
