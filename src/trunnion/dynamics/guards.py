"""Where something changes within a step: located on its dense output.

What ends a step - a gap that closes, a joint that comes to rest or breaks away, a clutch that lets go, a place at which
a force bends - is a number that becomes negative, see `first_crossing`. A motion ends at the end of a driver's range,
or where two assemblies of the links meet, see `Guards`; of one driver alone these are known beforehand, as bends.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from trunnion.algebra.dual import single
from trunnion.dynamics.rates import Layout
from trunnion.dynamics.solution import Ended, Stretch
from trunnion.dynamics.state import FreeMotion, Moment, repeated
from trunnion.errors import Status
from trunnion.solve.backward import NEAR_SINGULAR, pose_status
from trunnion.solve.change_points import touched

Array = NDArray[np.float64]

LOOKS = 12  # parts of a step at whose ends one looks
ROUNDING = 1e-9  # of a coordinate: by how much it may seem beyond its range where it begins at the end of it
NEARLY = 0.1  # of 1/condition: where a straight line from the last two looks leaves less at the next, it may touch zero
FORESEEN = 1e-3  # of 1/condition: from there on it is foreseen where it touches zero
FINE = 40  # halvings towards the beginning of a step, where a number that has just changed its sign is next to nothing
LARGE = 1e300  # for a number without bound
RUBBING = 20.0  # condition from which it is near where joints rub: their friction grows with it and costs more and more
BESIDE = 0.25  # of the way that is left: poses there, on both sides, confirm the place


class Crossing(NamedTuple):
    """A number that becomes negative: its row, and the time, s."""

    row: int
    time: float


def first_crossing(values: Callable[[Array], Array], begin: float, times: Array) -> Crossing | None:
    """The first number that becomes negative within a step, at a time at which it is negative.

    values: (number, time), which are not negative where the step begins but for rounding; times: at which one looks, up
    to the end of the step.
    """
    negative, first = values(times) < 0.0, None
    for row in np.flatnonzero(negative.any(axis=1)):

        def value(time: float, row: int = int(row)) -> float:
            return min(float(values(np.array([time]))[row, 0]), LARGE)

        k = int(np.argmax(negative[row]))
        low, high = float(times[k - 1]) if k else begin, float(times[k])
        if k == 0:  # it may have changed its sign at the beginning: look for where it is as it should be
            nearer = begin + (high - begin) * 0.5 ** np.arange(FINE, -1.0, -1.0)
            near = values(nearer)[row]
            good = np.flatnonzero(near > 0.0)
            low, high = (nearer[good[-1]], high) if len(good) else (nearer[np.argmax(near < 0.0)],) * 2
        # on the side on which it is negative: a force that begins there has begun
        place = float(brentq(value, low, high, xtol=1e-16, rtol=8.9e-16)) if value(low) > 0.0 else low
        step = np.spacing(abs(place))
        while place < high and value(place) >= 0.0:
            place, step = min(place + step, high), 2.0 * step
        if first is None or place < first.time:
            first = Crossing(int(row), place)
    return first


@dataclass
class Guards:
    """Looks at the steps of one motion.

    limits: by driver the coordinates between which it may move; passed: times of change points through which it goes
    on, s, until they are taken down; last: that of the last one.
    """

    motion: FreeMotion
    layout: Layout
    limits: Mapping[str, tuple[float, float]]
    passed: list[float] = field(default_factory=list)
    last: float = -np.inf

    def __post_init__(self) -> None:
        motion, alone = self.motion, len(self.motion.system.mechanism.drivers) == 1
        limits = [(k, self.limits[name]) for k, name in enumerate(motion.names) if name in self.limits]
        self._limited = [(k, ends) for k, ends in limits if np.any(np.isfinite(ends))]
        # modules that are looked at, with their rows of `margins`: of one driver alone those that are passed
        self._meeting = [(row, k) for row, k in enumerate(motion.meeting) if not alone or motion.passes(k)]

    def bounded(self, stretch: Stretch, before: Stretch | None) -> tuple[Stretch, Ended | None]:
        """A step up to the first end of the motion within it or just ahead, and that end. before: the step that it goes
        on from, if there is one."""
        ends = [*self._out_of_range(stretch), *self._change_points(stretch, before)]
        ended = min(ends, key=lambda end: end.time, default=None)
        if ended is None:
            return stretch, None
        return self._continued(stretch)._replace(end=max(stretch.begin, ended.time)), ended

    # ---- ranges -----------------------------------------------------------------------------------------------

    def _out_of_range(self, stretch: Stretch) -> Iterator[Ended]:
        n = self.layout.coordinates
        for k, ends in self._limited:
            times = np.linspace(stretch.begin, stretch.end, LOOKS + 1)
            rates = stretch.state(times)[n + k]
            turns = np.flatnonzero(rates[1:] * rates[:-1] < 0.0)  # not where the motion has ended: NaN
            times = np.unique([*times, *(_root(stretch, n + k, 0.0, times[i], times[i + 1]) for i in turns)])
            places = stretch.state(times)[k]
            for level, outward in zip(ends, (-1.0, 1.0), strict=True):
                outside_by = outward * (places - level)
                outside = np.flatnonzero(outside_by > ROUNDING * max(1.0, abs(level)))
                if len(outside):
                    i = int(outside[0])
                    inside = np.flatnonzero(outside_by[:i] < 0.0)
                    time = _root(stretch, k, level, times[inside[-1]], times[i]) if len(inside) else stretch.begin
                    yield Ended("simulate.range", time, {"driver": self.motion.names[k], "coordinate": level})

    # ---- change points ----------------------------------------------------------------------------------------

    def _change_points(self, stretch: Stretch, before: Stretch | None) -> Iterator[Ended]:
        """Where 1/condition of a module touches zero, see `solve.change_points`; what is passed is taken down.

        Near there the digits of the accelerations are lost like its square. So it is foreseen, too, with accelerations
        that stay as they are.
        """
        if not self._meeting or stretch.end <= stretch.begin:
            return
        last = before if before is not None and before.end == stretch.begin else stretch
        onward = self._continued(stretch)
        times = np.linspace(stretch.begin, stretch.end, LOOKS + 1)
        times = np.insert(times, 0, stretch.begin - (last.end - last.begin) / LOOKS)

        def margins(moments: Array) -> Array:
            rows = np.where(moments < stretch.begin, last.state(moments), onward.state(moments))
            walk = self.motion.walk(self.layout.moment(moments, rows))
            return np.array([np.broadcast_to(each, moments.shape) for each in self.motion.margins(walk)])

        looks, spans = margins(times), np.diff(times)
        ahead = looks[:, 1:-1] + (looks[:, 1:-1] - looks[:, :-2]) * spans[1:] / spans[:-1]
        near = (ahead <= NEARLY * looks[:, 1:-1]) & np.isfinite(looks[:, 2:])
        for row, module in self._meeting:

            def margin(moments: Array, row: int = row) -> Array:
                return np.asarray(margins(moments)[row])

            met = touched(margin, times, np.flatnonzero(near[row]) + 1)
            if self.motion.passes(module):
                for time in sorted(met):
                    if time > self.last + spans[-1]:  # not the same one from the looks before and after it
                        self.passed.append(time)
                        self.last = time
                continue
            left, slope = float(looks[row, -1]), float(looks[row, -1] - looks[row, -2]) / spans[-1]
            if left < FORESEEN and slope < 0.0 and np.isfinite(margin(np.array([stretch.end - 2.0 * left / slope]))[0]):
                met += touched(margin, stretch.end - left / slope * np.arange(3.0), np.array([1]))
            for time in met:
                place = float(onward.state(np.array([time]))[0, 0])
                yield Ended("simulate.change_point", time, self.motion.change_point(module, place))

    def _continued(self, stretch: Stretch) -> Stretch:
        """A step that goes on beyond its end: works with the powers, coordinates with the accelerations that it has
        there."""
        n, end = self.layout.coordinates, stretch.end
        span = (end - stretch.begin) / LOOKS
        begun, ended = stretch.state(np.array([end - span, end])).T
        slopes = (ended - begun) / span
        slopes[:n] = ended[n : 2 * n]

        def state(times: Array) -> Array:
            over = np.maximum(times - end, 0.0)
            rows = np.array(stretch.state(np.minimum(times, end))) + slopes[:, None] * over
            rows[:n] += 0.5 * slopes[n : 2 * n, None] * over**2
            return np.asarray(rows)

        return stretch._replace(state=state)


def dead_centre(motion: FreeMotion, at: Moment, second: float) -> tuple[float, float] | None:
    """Where the one free coordinate turns round at the dead centre of its joint: the time until then, s, and its place;
    None if it does not.

    There the links go on while the driven coordinate q turns round, q* − q ~ (t* − t)²: the inertia reduced to it grows
    without bound, and the links cannot be assembled beyond. Steps shrink in proportion to t* − t and would never
    arrive. The place is foreseen from the last step, t* = t − q̇/q̈ and q* = q − q̇²/(2 q̈), and confirmed by poses on
    both sides. second: q̈; at: of one lane.
    """
    speed, q = single(at.rate[0]), single(at.q[0])
    if not speed * second < 0.0:
        return None
    left = -0.5 * speed * speed / second
    near_by = repeated(at, 3)._replace(q=np.array([[q, q + (1 - BESIDE) * left, q + (1 + BESIDE) * left]]))
    walk = motion.walk(near_by)
    near = np.broadcast_to(walk.condition, (3,))[0] > (NEAR_SINGULAR if motion.affine else RUBBING)
    status = pose_status(walk, (3,))
    ends = near and status[1] != Status.NOT_ASSEMBLED and status[2] == Status.NOT_ASSEMBLED
    return (-speed / second, q + left) if ends else None


def _root(stretch: Stretch, number: int, level: float, low: float, high: float) -> float:
    """The time at which a number of the state has a value, between two at which it lies on both sides of it."""
    return float(brentq(lambda time: float(stretch.state(np.array([time]))[number, 0]) - level, low, high, xtol=1e-16))
