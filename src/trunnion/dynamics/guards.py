"""Where a step ends a motion: at the end of a driver's range, or where two assemblies of the links meet.

Both are looked for on the dense output of every step, and located there. Of one driver alone the places are known
beforehand, and are approached from one side: see `integrate`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from trunnion.dynamics.rates import Layout
from trunnion.dynamics.solution import Ended, Stretch
from trunnion.dynamics.state import FreeMotion, Moment
from trunnion.solve.change_points import touched

__all__ = ["Guards"]

Array = NDArray[np.float64]

LOOKS = 12  # parts of a step at whose ends one looks
ROUNDING = 1e-9  # of a coordinate: by how much it may seem beyond its range where it begins at the end of it
NEARLY = 0.1  # of 1/condition: where a straight line from the last two looks leaves less at the next, it may touch zero


@dataclass
class Guards:
    """Looks at the steps of one motion.

    limits: by driver the coordinates between which it may move; margins: tells 1/condition of the modules of
    `FreeMotion.meeting`, (module, lane); passed: times of change points through which it goes on, s, until they are
    taken down; last: that of the last one.
    """

    motion: FreeMotion
    layout: Layout
    limits: Mapping[str, tuple[float, float]]
    margins: Callable[[Moment], Array]
    passed: list[float] = field(default_factory=list)
    last: float = -np.inf

    def ended(self, stretch: Stretch, before: Stretch | None) -> Ended | None:
        """The first end of the motion within a step. before: the step that it goes on from, if there is one."""
        ends = [*self._out_of_range(stretch), *self._change_points(stretch, before)]
        return min(ends, key=lambda end: end.time, default=None)

    # ---- ranges -----------------------------------------------------------------------------------------------

    @cached_property
    def _limited(self) -> list[tuple[int, str]]:
        """Of several free coordinates those that have a range."""
        several = len(self.motion.names) > 1
        return [(k, name) for k, name in enumerate(self.motion.names) if several and name in self.limits]

    def _out_of_range(self, stretch: Stretch) -> Iterator[Ended]:
        n = self.layout.coordinates
        for k, name in self._limited:
            times = np.linspace(stretch.begin, stretch.end, LOOKS + 1)
            rates = stretch.state(times)[n + k]
            turns = np.flatnonzero(rates[1:] * rates[:-1] < 0.0)  # not where the motion has ended: NaN
            times = np.unique([*times, *(_root(stretch, n + k, 0.0, times[i], times[i + 1]) for i in turns)])
            places = stretch.state(times)[k]
            for level, outward in zip(self.limits[name], (-1.0, 1.0), strict=True):
                beyond = outward * (places - level)
                outside = np.flatnonzero(beyond > ROUNDING * max(1.0, abs(level)))
                if len(outside):
                    i = int(outside[0])
                    inside = i > 0 and beyond[i - 1] < 0.0
                    time = _root(stretch, k, level, times[i - 1], times[i]) if inside else float(times[max(i - 1, 0)])
                    yield Ended("simulate.range", time, {"driver": name, "coordinate": level})

    # ---- change points ----------------------------------------------------------------------------------------

    @cached_property
    def _meeting(self) -> list[tuple[int, int]]:
        """The modules that are looked at, with their rows of `margins`: of one driver alone those that are passed."""
        alone = len(self.motion.system.mechanism.drivers) == 1
        rows = enumerate(self.motion.meeting)
        return [(row, module) for row, module in rows if not alone or self.motion.passes(module)]

    def _change_points(self, stretch: Stretch, before: Stretch | None) -> Iterator[Ended]:
        """Where 1/condition of a module touches zero, see `solve.change_points`; what is passed is taken down."""
        if not self._meeting or stretch.end <= stretch.begin:
            return
        last = before if before is not None and before.end == stretch.begin else stretch
        times = np.linspace(stretch.begin, stretch.end, LOOKS + 1)
        times = np.insert(times, 0, stretch.begin - (last.end - last.begin) / LOOKS)

        def margins(moments: Array) -> Array:
            early = moments < stretch.begin
            rows = np.where(early, last.state(moments), stretch.state(moments))
            return self.margins(self.layout.moment(moments, rows))

        looks, spans = margins(times), np.diff(times)
        ahead = looks[:, 1:-1] + (looks[:, 1:-1] - looks[:, :-2]) * spans[1:] / spans[:-1]
        for row, module in self._meeting:
            places = np.flatnonzero(ahead[row] <= NEARLY * looks[row, 1:-1]) + 1
            for time in touched(lambda moment, row=row: float(margins(np.array([moment]))[row, 0]), times, places):  # type: ignore[misc]
                if not self.motion.passes(module):
                    place = float(stretch.state(np.array([time]))[0, 0])
                    yield Ended("simulate.change_point", time, self.motion.change_point(module, place))
                elif time > self.last + spans[-1]:
                    self.last = time
                    self.passed.append(time)


def _root(stretch: Stretch, number: int, level: float, low: float, high: float) -> float:
    """The time at which a number of the state has a value, between two at which it lies on both sides of it."""
    return float(brentq(lambda time: float(stretch.state(np.array([time]))[number, 0]) - level, low, high, xtol=1e-16))
