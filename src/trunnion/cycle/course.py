"""The course of a mechanism over its cycle: efforts, reactions, powers, strokes as `Courses`, and what is read of them.

Means, and the efficiency that follows from them, have the error of their integrals. One that this error, or rounding,
may have made is 0: power that a load gives and takes back.

It is found once for a run and does not depend on which positions are asked for. Breaks are those that the model states
(`switches`); what it does not state, as a guide that tilts over or the end of what can be assembled, is located by the
courses themselves.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Courses, Place
from trunnion.algebra.panels import CANCELLED
from trunnion.cycle.fill import COMPARED, Arrays, allocate, fill_chunk, fill_errors
from trunnion.cycle.scales import scales_of
from trunnion.errors import Status
from trunnion.results.attributes import Figure
from trunnion.solve.backward import Backward, status_of
from trunnion.solve.contacts import bearing_ends
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import has_useful_work
from trunnion.solve.margin import locking_margin
from trunnion.solve.run import Run
from trunnion.solve.seating import seating_of
from trunnion.solve.switches import MARGINS, SEATED
from trunnion.solve.system import System

Array = NDArray[np.float64]
POWERS = ("drive_power", "useful_power", "friction_power", "power_residual")
FORCES = ("drive_effort", "reaction_force", "reaction_moment", "end_load", "gear_torque", "drive_effort_change")
FOLLOWED = ("drive_effort", *POWERS, "reaction_force")
COMPARED_ROWS = ("point_error", "joint_rotation_error", "joint_slide_error", "drive_effort_change")
NEXT = 1e-6  # of the cycle: an extreme is beside what is no farther, and said to be there
CLOSE = 1e-10  # of the cycle: breaks that are one
SUPPOSED = "supposed_power"  # W: by how much that through the drivers differs from what stands in for it
MOST_SUPPOSED = 0.05  # of the power through the drivers: with more of it the means have no answer
RESIDUALS = 4.0  # of the mean residual of the power balance: what rounding leaves of a power that cancels


class Mean(NamedTuple):
    """A mean, the error of its integral, the mean of the magnitude, and what may be no more than rounding."""

    value: float
    error: float
    size: float
    rounding: float

    @property
    def net(self) -> float:
        """The value; 0 where it is no more than its error or rounding."""
        return 0.0 if abs(self.value) <= max(self.error, self.rounding) else self.value


@dataclass(frozen=True)
class Means:
    """Means over one cycle, W; NaN where any place of it has no answer.

    drive_power: of all drivers; useful_power: that the useful loads take; friction_power: lost in all joints;
    friction_power_mean: in each joint; drive_effort_rms: root mean square of each driver, N m or N; supposed: share
    of the power through the drivers by which it differs from that which stands in for it (`SUPPOSED`);
    has_useful_work: whether it is stated what work is useful.
    """

    drive_power: Mean
    useful_power: Mean
    friction_power: Mean
    friction_power_mean: Array
    drive_effort_rms: Array
    supposed: float = 0.0
    has_useful_work: bool = True

    @property
    def drive_power_mean(self) -> float:
        """Of all drivers, W."""
        return self.drive_power.net

    @property
    def useful_power_mean(self) -> float:
        """Taken by the useful loads, W."""
        return self.useful_power.net

    @property
    def efficiency(self) -> float:
        """Useful work over drive work of the cycle [D 1]; NaN where the loads drive, a place has no answer, or nothing
        is useful."""
        work = self.drive_power.net
        return self.useful_power.net / work if work > 0 and self.has_useful_work else float("nan")

    @property
    def efficiency_error(self) -> float:
        """How far the errors of both integrals, and what is supposed where pins do not settle, may have moved it."""
        work, value = self.drive_power.net, abs(self.efficiency)
        integrals = self.useful_power.error + value * self.drive_power.error
        return integrals / work + value * self.supposed if work > 0 else float("nan")


def unknown(drivers: int, joints: int, supposed: float = 0.0, has_useful_work: bool = True) -> Means:
    """Means without an answer; what share of them is supposed stays."""
    none = Mean(np.nan, np.nan, np.nan, np.nan)
    return Means(none, none, none, np.full(joints, np.nan), np.full(drivers, np.nan), supposed, has_useful_work)


POLE, GROWS = np.array([1e-6, 1e-5, 1e-4]), 2.5  # of the cycle from a break: what grows so many times at each is a pole


@dataclass(frozen=True)
class CycleCourse:
    """The courses of a run's variables.

    shapes: of each variable, whose rows follow one another; courses: of them all.
    """

    run: Run
    shapes: Mapping[str, tuple[int, ...]]
    courses: Courses

    @cached_property
    def _places(self) -> dict[str, slice]:
        ends = np.cumsum([0, *(int(np.prod(shape)) for shape in self.shapes.values())])
        return {name: slice(*ends[k : k + 2]) for k, name in enumerate(self.shapes)}

    @cached_property
    def status(self) -> NDArray[np.intp]:
        """Of every panel."""
        return np.asarray(self.courses.states)

    @cached_property
    def sound(self) -> NDArray[np.bool_]:
        """Panels whose figures can be relied on: solved; those in which a joint rests only if there are no others.

        Where a pin loses contact it is taken to stay in a seat that would jump: forces there are no answer.
        """
        solved = (self.status == Status.SOLVED) & self.reached
        return np.asarray(solved if np.any(solved) else (self.status == Status.ZERO_SLIP) & self.reached)

    @cached_property
    def valid(self) -> NDArray[np.bool_]:
        """Panels where no pin loses contact."""
        return np.asarray((self.status != Status.CONTACT_LOST) & self.reached)

    @cached_property
    def ranges(self) -> list[tuple[float, float, bool]]:
        """Begin and end, s, of the ranges that can be assembled, and whether each holds the start.

        In a motion that comes again the last may go on at the start: then it ends before it begins.
        """
        edges, open_ = self.courses.edges, np.concatenate([[1], self.status == Status.NOT_ASSEMBLED, [1]])
        changes = np.flatnonzero(np.diff(open_))
        spans = [(float(edges[a]), float(edges[b]), a == 0) for a, b in changes.reshape(-1, 2)]
        if len(spans) > 1 and self.run.cycle.periodic and not (open_[1] or open_[-2]):
            spans = [(spans[-1][0], spans[0][1], True), *spans[1:-1]]
        return spans

    @cached_property
    def reached(self) -> NDArray[np.bool_]:
        """Panels that are reached from the start without a gap; all if it cannot be assembled there."""
        start = next((ends for *ends, holds in self.ranges if holds), None)
        if start is None:
            return np.ones(len(self.courses.half), bool)
        middles, (low, high) = self.courses.edges[:-1] + self.courses.half, start
        return np.asarray((middles > low) & (middles < high) if low < high else (middles > low) | (middles < high))

    @property
    def note(self) -> str:
        """Of how much of the cycle a figure is, where a pin loses contact in the rest; empty where it does nowhere."""
        lost = self.status == Status.CONTACT_LOST
        return f"without {self.courses.share(lost):.2g} of the cycle" if np.any(lost) else ""

    def beside(self, place: Place, status: Status) -> bool:
        """Whether an extreme is at the edge of panels of a status."""
        away = np.minimum(np.abs(self.courses.edges[:-1] - place.time), np.abs(self.courses.edges[1:] - place.time))
        return bool(np.any((away <= NEXT * self.courses.span) & (self.status == status)))

    def picked(self, name: str, *which: int) -> Courses:
        """The rows of a variable, or of one of its joints, links, drivers alone."""
        places = self._places[name]
        return self.courses.picked(np.arange(places.start, places.stop).reshape(self.shapes[name])[which].ravel())

    def extreme(
        self,
        name: str,
        *which: int,
        of: Callable[[Array], Array] = lambda rows: rows[0],
        sign: float = 1.0,
        panels: NDArray[np.bool_] | None = None,
        unit: str = "",
    ) -> Place | None:
        """The largest or least value of a number, in sound panels if no others are given.

        Parameters
        ----------
        name, which
            Variable, and which of its joints, links, drivers.
        of
            What is made of its rows, (row, panel, place), the only one itself if not given.
        unit
            Of the number, so that rounding is told from change.

        Returns
        -------
        Place
            Infinite where the number grows without bound towards a break; None where no panel has a value.
        """
        chosen, courses = self.sound if panels is None else panels, self.picked(name, *which)
        place = courses.extreme(of, sign, chosen, scales_of(self.run).floor(unit))
        if place is None or not place.at_break:
            return place
        breaks, away = courses.breaks, courses.span * POLE
        k = int(np.argmin(np.abs(breaks - place.time)))
        # positions close to a singular one may begin here: then the number grows towards that
        others = np.array([breaks[other] for other in (k - 1, k + 1) if 0 <= other < len(breaks)])
        close = self.status[courses.panel((others + breaks[k]) / 2)] == Status.NEAR_SINGULAR
        ends = [end for end in (place.time, *others[close]) if courses.edges[0] <= end <= courses.edges[-1]]
        times = np.array([times for end in ends for times in (end - away, end + away)])
        inside = np.all((times >= courses.edges[0]) & (times <= courses.edges[-1]), axis=1)
        values = sign * of(courses.at(times.ravel())).reshape(times.shape)
        grows = inside & np.all(values[:, :-1] > GROWS * np.abs(values[:, 1:]), axis=1)
        return place._replace(value=sign * np.inf) if np.any(grows) else place

    def figure(self, name: str, subject: str, top: Place, unit: str, aspect: str) -> Figure:
        """An extreme as a figure: none where it has no bound."""
        locks = ": it locks there" * self.beside(top, Status.LOCKED)
        note = f"no bound{locks}" * bool(np.isinf(top.value))
        return Figure(name, subject, top.value, unit, aspect, self.told(top), note)

    def told(self, place: Place) -> str:
        """Where an extreme is, in words."""
        cycle, time = self.run.cycle, place.time
        if place.everywhere and cycle.duration > 0:
            return "everywhere"
        time = 0.0 if place.everywhere else time
        nearest = float(self.courses.breaks[np.argmin(np.abs(self.courses.breaks - time))])
        time = nearest if abs(nearest - time) <= NEXT * self.courses.span else time
        if cycle.periodic and cycle.duration - time <= CLOSE * cycle.duration:
            time = 0.0
        return f"at {self.run.system.dial(self.run.values, np.array([time, cycle.duration])).at(0)}"

    @cached_property
    def means(self) -> Means:
        """Means over the cycle; NaN where a part of it has no answer."""

        def total(rows: Array) -> Array:
            return np.asarray(np.sum(rows, axis=0))

        parts = [self.picked(name) for name in ("drive_power", "useful_power", "friction_power")]
        with np.errstate(all="ignore"):
            values = np.array([part.mean(total) for part in parts])
            sizes = np.array([part.mean(lambda rows: np.abs(total(rows))) for part in parts])
            residual = self.picked("power_residual").mean(np.abs)[0]
            squares = self.picked("drive_effort").mean(np.square)
        each = [np.sum(part.error()) for part in parts]
        rounding = np.maximum(CANCELLED * sizes, RESIDUALS * residual)
        rounding[2] = max(rounding[2], CANCELLED * np.max(sizes))
        driven, useful, rubbed = (Mean(*(float(part[k]) for part in (values, each, sizes, rounding))) for k in range(3))
        lost = parts[2].mean()
        supposed = float(self.picked(SUPPOSED).mean()[0] / sizes[0]) if SUPPOSED in self.shapes else 0.0
        useful_work = has_useful_work(self.run.system.mechanism)
        if supposed > MOST_SUPPOSED:
            return unknown(len(squares), len(lost), supposed, useful_work)
        return Means(driven, useful, rubbed, lost, np.sqrt(squares), supposed, useful_work)


def magnitude(rows: Array) -> Array:
    """Of a number or a vector, (component, panel, place)."""
    return np.asarray(np.sqrt(np.sum(rows**2, axis=0)))


def followed(system: System, errs: bool) -> tuple[str, ...]:
    """The variables that the summary of a cycle is made of."""
    in_space = ("reaction_moment",) * (system.mechanism.space == "spatial")
    slides = ("joint_slide",) * any(joint.pair.guided for joint in system.joints.values())
    ends = ("end_load",) * any(bearing_ends(system.mechanism, joint) for joint in system.joints)
    return (*FOLLOWED, *in_space, *slides, *ends, *(COMPARED_ROWS if errs else ()))


def course_of(
    run: Run, method: FrictionMethod, ideal: bool = False, names: tuple[str, ...] | None = None
) -> CycleCourse:
    """The course of a run over its cycle, found once.

    ideal: of the mechanism without errors; names: of the variables, those of the summary if not given.
    """
    names = names or followed(run.system, run.erring and not ideal)

    def looked() -> CycleCourse:
        looking = _Looking(run, method, ideal, names)
        accuracy = SEATED if looking.seats else None
        courses = run.courses(looking, looking.bends(), accuracy, lambda sizes: like(run, looking.shapes, sizes))
        return CycleCourse(run, looking.shapes, courses)

    return run.once(("course", method, ideal, names), looked)


def margin_of(run: Run, method: FrictionMethod) -> CycleCourse:
    """The course of the locking margin, NaN where it is beyond what the method looks for, found once."""

    def looked() -> CycleCourse:
        looking = _Looking(run, method, ideal=False, names=())

        def look(time: Array) -> tuple[Array, NDArray[np.integer]]:
            back, valid = looking.solved(time)
            status: NDArray[np.integer] = status_of(back, time.shape)
            margin = np.broadcast_to(np.asarray(locking_margin(back), float), time.shape)
            return margin_rows(margin, np.where(valid, status, np.maximum(status, Status.CONTACT_LOST)))

        return CycleCourse(run, {"locking_margin": ()}, run.courses(look, looking.bends(), MARGINS))

    return run.once(("margin", method), looked)


def margin_rows(margin: Array, status: NDArray[np.integer]) -> tuple[Array, NDArray[np.integer]]:
    """The row of the course of a locking margin with its statuses: NaN where it is beyond what is looked for."""
    return np.where(np.isfinite(margin) & (status < Status.LOAD_UNDEFINED), margin, np.nan)[None], status


class _Looking:
    """The variables of a run as rows, at any times.

    shapes: of each variable, known from the first look on.
    """

    def __init__(self, run: Run, method: FrictionMethod, ideal: bool, names: tuple[str, ...]) -> None:
        self.run, self.method, self.ideal = run, method, ideal
        self.seats = seating_of(run, method) if run.seats and not ideal else None
        self.errs = run.erring and not ideal
        self.shapes: dict[str, tuple[int, ...]] = {}
        self._names = names

    def bends(self) -> list[float]:
        """Times, s, at which rows may jump or bend."""
        bends = [*([] if self.ideal else self.run.bends), *(self.run.ideal.bends if self.run.erring else [])]
        return [*(bend.time for bend in bends), *(self.seats.breaks if self.seats else ())]

    def solved(self, time: Array) -> tuple[Backward, NDArray[np.bool_]]:
        """The mechanism at times, s, and where no pin loses contact."""
        if self.seats:
            seated = self.seats.at(time, self.method)
            return seated.back, seated.valid
        return (self.run.ideal if self.ideal else self.run).solve(time, method=self.method), np.ones(time.shape, bool)

    def __call__(self, time: Array) -> tuple[Array, NDArray[np.integer]]:
        """Rows and statuses at times, s."""
        back, valid = self.solved(time)
        arrays = self._filled(back, time)
        if self.errs:
            meant = self._filled(self.run.ideal.solve(time, method=self.method), time)
            fill_errors(arrays, meant, self.run.system, slice(None))
        if self.seats:
            # where a pin loses contact the mechanism without errors stands in for it, with what that may change
            powers = [np.sum(part["drive_power"], axis=0) for part in (arrays, meant)]
            apart = np.abs(powers[1] - np.where(np.isfinite(powers[0]), powers[0], 0.0))
            lost = ~valid & (arrays["status"] < Status.NOT_CONVERGED)
            for name in self._names:
                if name in meant and name not in COMPARED_ROWS:
                    arrays[name] = np.where(valid, arrays[name], meant[name])
            arrays[SUPPOSED] = np.where(valid, 0.0, apart)
            arrays["status"] = np.where(lost, np.maximum(arrays["status"], Status.CONTACT_LOST), arrays["status"])
            sticks = self.seats.sticks(time)
            arrays["status"] = np.where(sticks, np.maximum(arrays["status"], Status.ZERO_SLIP), arrays["status"])
        self.shapes, rows = stacked(arrays, (*self._names, SUPPOSED), 1)
        return rows, arrays["status"].astype(np.intp)

    def _filled(self, back: Backward, time: Array) -> Arrays:
        """The variables of a walk at times, s."""
        names = {*self._names, "status", *(COMPARED if self.errs else ())}
        arrays = allocate(self.run.system, len(time), ["errors"] if self.errs else [], names)
        fill_chunk(arrays, back, slice(None))
        if "end_load" in self._names:  # what a joint does not have is no gap in a course
            for i, joint in enumerate(self.run.system.joints):
                arrays["end_load"][i, bearing_ends(self.run.system.mechanism, joint) :] = 0.0
        return arrays


def stacked(arrays: Arrays, names: Sequence[str], places: int) -> tuple[dict[str, tuple[int, ...]], Array]:
    """Shapes and rows of some variables, those of each after one another. places: how many of the last dims are."""
    shapes = {name: arrays[name].shape[:-places] for name in names if name in arrays}
    return shapes, np.concatenate([arrays[name].reshape(-1, *arrays[name].shape[-places:]) for name in shapes])


def like(run: Run, shapes: Mapping[str, tuple[int, ...]], sizes: Array) -> Array:
    """The largest magnitude of what is like each row: what is far below it is rounding.

    Forces, and moments by a length, come of one another; so do powers; see `scales_of`.
    """
    scales = scales_of(run)
    names = np.repeat(list(shapes), [int(np.prod(shape)) for shape in shapes.values()])
    units, turning = np.ones(len(names)), [run.system.turns(name) for name in run.system.mechanism.drivers]
    units[np.isin(names, ("reaction_moment", "gear_torque"))] = scales.length
    for name in ("drive_effort", "drive_effort_change"):
        units[names == name] = np.where(turning, scales.length, 1.0)[: np.count_nonzero(names == name)]
    forces, powers = np.isin(names, FORCES), np.isin(names, (*POWERS, SUPPOSED))
    size_of_each = np.where(names == "joint_rotation_error", 1.0, scales.length)
    size_of_each[forces] = units[forces] * np.max(sizes[forces] / units[forces], initial=scales.force)
    size_of_each[powers] = np.max(sizes[powers], initial=scales.force * scales.length * scales.rate)
    return size_of_each
