"""A block of samples on a GPU: what grows with the positions is done there, what grows with the samples alone here.

The device solves every position, counts the bins of the courses, looks for the places where a course may be largest and
for the gravest status. Of each sample there come back the positions about those places, of which the figure is made as
by any other engine: figures, histograms, moments and yields are counted by the same code, in the same order. Courses
whose figure is no extreme, such as a mean or a straightness, are copied and judged here.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.measures.evaluation import NumpyKernel
from trunnion.measures.extremes import Extreme, Grid, Tops, highest
from trunnion.measures.figures import Curve, Reference, course_of, judged, judged_course, known, number_at
from trunnion.measures.measures import Measure
from trunnion.solve.backward import Backward
from trunnion.solve.compiled_device import DeviceKernel, Resident, differs
from trunnion.statistics.histogram import Bins, count
from trunnion.studies.tolerance.kernel import parts_of

__all__ = ["DeviceReducer", "Reduced"]

Array = NDArray[np.float64]
Counts = NDArray[np.int64]
OF_EXTREMES = (
    "maximum", "minimum", "peak-to-peak", "largest", "place-of-maximum", "place-of-minimum", "dead centre",
    "dead centre, least", "deviation",
)  # fmt: skip
CHECKED = 4  # samples of every block whose figures and counts are worked out here too
ROUNDED, ZERO = 1e-9, 1e-12  # of a figure, and in SI: Newton's method takes as many steps as the slowest sample needs


class Reduced(NamedTuple):
    """What is kept of a block: figures and whether they conform, (measure, sample); of each measure the counts of its
    course, (position of the window, bin); the gravest status of each sample."""

    figures: Array
    passed: Array
    bands: Sequence[Counts]
    gravest: NDArray[np.int8]


@dataclass(frozen=True, eq=False)
class DeviceReducer:
    """Blocks of samples, reduced on the first GPU.

    numpy: the kernel that it stands for; positions: of a cycle; nominal: by measure; bands: middle and bins of each
    course.
    """

    numpy: NumpyKernel
    positions: int
    nominal: Mapping[str, Reference]
    bands: Sequence[tuple[Array, Bins]]

    def reduced(self, values: Mapping[str, Number], time: Number, samples: int) -> Reduced:
        """MechanismError where the device gives other numbers than NumPy."""
        figures, passed, counts = [], [], []
        with self.kernel.resident({**values, **self._meant}, np.asarray(time, float), samples, self._there) as found:
            for measure, (middle, bins) in zip(self.numpy.measures, self.bands, strict=True):
                nominal = self.nominal[measure.name]
                if _stays(nominal):
                    course = _Course(found, f"{measure.name} number", nominal)
                    one, good = judged_course(course.curve(samples), nominal)
                    counted = course.counted(middle, bins, samples)
                    _verify(course, one, middle, bins)
                else:
                    names = [name for name, (of, _) in self._figures.items() if of is measure]
                    one, good, curve = judged([found.rows(name, samples) for name in names], nominal)
                    counted = count((curve - middle).T, bins)
                figures.append(one)
                passed.append(good)
                counts.append(counted)
            return Reduced(np.array(figures), np.array(passed, float), counts, found.gravest())

    @cached_property
    def _parts(self) -> dict[str, tuple[Measure, int]]:
        return parts_of(self.numpy)

    @cached_property
    def _meant(self) -> dict[str, Array]:
        """Courses of the nominal mechanism as numbers that differ by position; 0 outside of the window."""
        found = {}
        for measure in self.numpy.measures:
            nominal = self.nominal[measure.name]
            for k, part in enumerate(nominal.parts if _stays(nominal) else ()):
                row = found[f"nominal.{measure.name}.{k}"] = np.zeros((1, self.positions))
                row[0, nominal.window.index] = part
        return found

    @cached_property
    def _figures(self) -> dict[str, tuple[Measure, Callable[[Backward], Number]]]:
        """By a name the one number that a figure is made of, or all parts of its course, and of which measure."""
        found = {}
        for name, (measure, k) in self._parts.items():
            nominal = self.nominal[measure.name]
            if not _stays(nominal):
                found[name] = measure, _part(measure, k)
            elif not k:
                found[f"{measure.name} number"] = measure, _number(measure, nominal)
        return found

    @cached_property
    def kernel(self) -> DeviceKernel:
        """Of all that is read off a position."""
        figures = {name: figure for name, (_, figure) in self._figures.items()}
        return DeviceKernel(self.numpy.run, figures, self.numpy.forces, self.numpy.method)

    def _there(self, name: str, status: NDArray[np.int8]) -> NDArray[np.bool_]:
        """Where a figure of the kernel has an answer."""
        return known(self._figures[name][0], status)


def _stays(nominal: Reference) -> bool:
    """Whether a course is one number a position, at different positions, so that it stays on the device."""
    index = nominal.window.index
    return nominal.measure.rule not in ("line", "ratio", "work") and len(np.unique(index)) == len(index)


def _part(measure: Measure, k: int) -> Callable[[Backward], Number]:
    return lambda back: measure.curve(back.walk if measure.of_motion else back)[k]


def _number(measure: Measure, nominal: Reference) -> Callable[[Backward], Number]:
    def found(back: Backward) -> Number:
        meant = [back.walk.values[f"nominal.{measure.name}.{k}"] for k in range(len(nominal.parts))]
        return number_at(measure.curve(back.walk if measure.of_motion else back), meant, nominal)

    return found


class _Curve(Curve):
    """A curve whose numbers are on the device: `number` is a `_Course`."""

    __slots__ = ()

    def largest(self, sign: float = 1.0) -> Extreme:
        return highest(self.number.tops(sign, self.grid), self.grid)

    def both(self) -> tuple[Number, Number]:
        return self.largest().value, self.largest(-1.0).value


class _Course:
    """The numbers, by this name, of a measure on the device; place: their positions, gain: what is added to each."""

    def __init__(self, found: Resident, name: str, nominal: Reference) -> None:
        self.found, self.name, self.nominal = found, name, nominal
        self.place = np.asarray(nominal.window.index, np.int64)
        self.gain = np.zeros(len(self.place))
        if nominal.opened:
            self.place, self.gain = np.append(self.place, self.place[0]), np.append(self.gain, nominal.turns)

    def curve(self, samples: int) -> Curve:
        """The course of all samples: here, unless it is extremes alone that are looked for."""
        if self.nominal.measure.rule not in OF_EXTREMES:
            return course_of(self.nominal, self.rows(samples))
        return _Curve(*course_of(self.nominal, np.zeros(len(self.nominal.window.index)))._replace(number=self))

    def rows(self, samples: int) -> Array:
        """The numbers of the first samples at the positions of the window."""
        return self.found.rows(self.name, samples)[:, self.nominal.window.index]

    def tops(self, sign: float, grid: Grid) -> Tops:
        """Where the numbers with this sign may be largest."""
        found, places, best = self.found, len(self.place), np.empty(self.found.samples, np.int64)
        with found.device.holding(self.place, self.gain, best.nbytes) as (place, gain, into):
            further = found.device.listed(
                "tops", found.samples, found.samples * places, found.positions, places, place.address, gain.address,
                int(sign), int(grid.period is not None), found.address(self.name), into.address,
            )  # fmt: skip
            into.get(best)
        first = np.arange(found.samples) * places + np.maximum(best, 0)
        rows, tops = np.divmod(np.sort(np.concatenate([first, further])), places)
        spots = np.column_stack([grid.stencils.nodes[tops], tops, (tops - 1) % places, (tops + 1) % places])
        about = found.take(self.name, rows[:, None] * found.positions + self.place[spots])
        about = sign * (about + self.gain[spots])
        known, (value, before, after) = np.ascontiguousarray(about[:, :-3]), about[:, -3:].T
        return Tops(rows, tops, known, value, (before, after), best < 0)

    def counted(self, middle: Array, bins: Bins, samples: int) -> Counts:
        """How many numbers of the first samples are in each bin about the middle, at each position of the window."""
        places = len(self.nominal.window.index)
        counts = np.zeros((places, bins.number), np.int32)
        given = [self.place, np.array(middle), np.array(np.broadcast_to(bins.scale, places))]
        with self.found.device.holding(*given, counts) as (*sources, into):
            self.found.device.reduce(
                "bins", samples * places, self.found.positions, places, *(one.address for one in sources),
                bins.fineness, bins.octaves, self.found.address(self.name), into.address,
            )  # fmt: skip
            return into.get(counts).astype(np.int64)


def _verify(course: _Course, figures: Array, middle: Array, bins: Bins) -> None:
    """MechanismError unless figures and counts of the first samples are those of their numbers."""
    samples, nominal = min(CHECKED, course.found.samples), course.nominal
    rows = course.rows(samples)
    expected = judged_course(course_of(nominal, rows), nominal)[0]
    if not np.allclose(figures[:samples], expected, rtol=ROUNDED, atol=ZERO, equal_nan=True):
        raise differs(f"the figures of '{nominal.measure.name}'")
    if not np.array_equal(course.counted(middle, bins, samples), count((rows - middle).T, bins)):
        raise differs(f"the counts of '{nominal.measure.name}'")
