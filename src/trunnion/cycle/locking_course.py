"""Locking over the cycle, read of courses: ranges of its states, the margin, the joint that decides, the way back, and
the friction that holds the loads.

Powers of the mechanism passed forward and backward are rows over time, its state is that of their panels: so the ends
of a range are breaks of the course, and nothing depends on which positions are asked for.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.algebra.dual import primal
from trunnion.algebra.panels import CANCELLED
from trunnion.cycle.course import CycleCourse, course_of, margin_of
from trunnion.cycle.locking_states import (
    BACK_LOCKED,
    HELD,
    HELD_AND_DRIVEN,
    NEAR,
    NO_MARGIN,
    PUSHES,
    LockingRange,
    LockingState,
    on_dial,
    states,
)  # fmt: skip
from trunnion.cycle.passage import critical_multiples, passage, passed, reverse
from trunnion.cycle.scales import scales_of
from trunnion.errors import Status
from trunnion.results.figure import MORE_THAN, Figure
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.loads import has_useful_work, useful_loads, useful_springs
from trunnion.solve.memory import in_blocks
from trunnion.solve.status import status_of
from trunnion.solve.switches import MARGINS, accuracy_of, breaks_between
from trunnion.solve.system import felt, law_of

if TYPE_CHECKING:
    from trunnion.solve.run import Run

__all__ = ["LockingCourse", "critical_figure", "holding_multiples", "locking_course"]

Array = NDArray[np.float64]
STATES = list(LockingState)  # by their codes
TIMES = "times the friction"  # what a locking margin is
LITTLE = 1e-3  # of what the useful loads give: what masses, other loads and springs may supply beside it
BACK = Accuracy(1e-7, shortest=1e-8, rounds=14, most=32)  # beside a locked position each one takes long
HOLDING = Accuracy(1e-12, 1e-14, widest=1.0, rounds=12)
SHORT = 1e-5  # of the cycle: a range that is less is none, as where loads have no power for a moment
BITS = 48  # joints that are told apart by the state of their critical multiples
MOST_PLACES = 3  # named in one figure
BESIDE = 1e-8  # of the cycle: a position that is next to an end is behind it


def locking_course(run: Run, method: FrictionMethod) -> LockingCourse | None:
    """Locking over the cycle of a run, found once; None without a driver."""
    if not run.system.mechanism.drivers:
        return None
    return run.once(("locking", method), lambda: LockingCourse(run, method))


@dataclass(frozen=True)
class LockingCourse:
    """Locking over the cycle. method: how friction is settled, and how far the margin is looked for."""

    run: Run
    method: FrictionMethod

    # ---- the way back -----------------------------------------------------------------------------------------

    @cached_property
    def courses(self) -> Courses:
        """Powers, W, delivered to the drivers, given by the useful loads and by all else, backward; then the effort of
        every driver backward. The states of the panels are codes of `LockingState`, pins in the middle of their play.
        """
        run, plain = self.run, replace(self.method, name="newton", margin_up_to=0.0)
        seated = course_of(run, replace(self.method, margin_up_to=0.0)) if run.seats else None
        least = scales_of(run).floor("W")

        def look(time: Array) -> tuple[Array, NDArray[np.int8]]:
            back = run.solve(time if run.cycle.duration > 0 else 0.0 * time, method=plain)
            ahead, other = passage(back), reverse(run, back.walk, plain)
            status: NDArray[np.integer] = status_of(back, time.shape)
            if seated is not None:  # where it locks pins are in their seats
                status = seated.status[seated.courses.panels_of(time)]
                ahead = ahead._replace(locked=status == Status.LOCKED)
            answered = ((status < Status.NOT_CONVERGED) | (status == Status.LOCKED)) & np.isfinite(other.acting)
            efforts = [other.efforts[name] for name in run.system.mechanism.drivers]
            powers = [other.delivered, other.given, other.acting - other.given]
            return np.stack([*powers, *efforts]), states(ahead, other, answered, least)

        def like(sizes: Array) -> Array:
            return np.concatenate([np.full(3, np.max(sizes[:3])), np.full(len(sizes) - 3, np.max(sizes[3:]))])

        bends = [bend.time for bend in run.bends]
        bends = bends if seated is None else [*bends, *seated.courses.breaks]
        breaks = breaks_between(run.cycle, np.array(bends)) if run.cycle.duration > 0 else np.array([0.0, 1.0])
        with np.errstate(all="ignore"):
            in_parts = in_blocks(look, len(run.system.joints))
            return Courses.of(in_parts, breaks, like, accuracy_of(run.cycle, BACK))

    def all_states(self) -> set[LockingState]:
        """The states that there are."""
        return {STATES[code] for code in np.unique(self.courses.states)}

    def pushed(self) -> bool:
        """Whether anything acts on it."""
        return bool(np.nanmax(np.abs(self.courses.coefficients[:, 1:3]), initial=0.0) > 0)

    def states_at(self, time: Array) -> NDArray[np.int8]:
        """The code of the state at times, s; where it changes that of what follows."""
        return self.courses.states[self.courses.panels_of(time)].astype(np.int8)

    def reverse_figure(self) -> Figure | None:
        """Power that reaches the drivers over that of the useful loads and springs; None if these do not drive.

        A mean over the cycle, so it is called self-locking only if friction holds the loads wherever they push.
        """
        run, courses = self.run, self.courses
        name, subject = "efficiency_reverse", "efficiency when backdriven by the useful loads" + centred(run)
        if not has_useful_work(run.system.mechanism):
            return None
        error = np.maximum(courses.error(), CANCELLED * courses.mean(np.abs))[:3]
        means = courses.mean()[:3]
        delivered, useful, others = np.where(np.abs(means) <= error, 0.0, means)
        if np.isfinite(useful) and not useful > 0:
            return None
        if (locked := courses.share(np.isin(courses.states, BACK_LOCKED))) > SHORT:
            return Figure(name, subject, None, place=f"in {locked:.2%} of the cycle", note="it locks")
        if LockingState.UNSOLVED in self.all_states() or not np.isfinite(delivered + useful):
            return Figure(name, subject, None, note="not every position is solved")
        if others > max(np.sum(error[:2]), LITTLE * useful):
            return Figure(name, subject, None, note=_beside(run))
        pushes = self.all_states() & PUSHES
        value = min(float(delivered / useful), 1.0)
        if value <= 0 and pushes <= {LockingState.SELF_LOCKING}:
            return Figure(name, subject, value, note="self-locking")
        if value <= 0:
            return Figure(name, subject, value, note="it takes work on the whole; see the ranges of `locking`")
        differ = len(pushes) > 1 and felt(run.system, run.values)
        return Figure(name, subject, value, note="the mean; see the ranges of `locking`" * bool(differ))

    def reversing_figures(self) -> Iterator[Figure]:
        """The largest effort that each driver has to supply to go back over its range, as to open a clamp."""
        run, scales = self.run, scales_of(self.run)
        if run.cycle.periodic:
            return
        for i, name in enumerate(run.system.mechanism.drivers):
            unit = "N m" if run.system.turns(name) else "N"
            # a drive supplies effort against the sense in which it went forward; it goes one way where it has a dial
            middles = self.courses.edges[:-1] + self.courses.half
            sense = np.sign(primal(run.system.drive(run.values, name, middles)[1])) * np.ones(len(middles))
            tops = []
            for sign in (1.0, -1.0):
                top = self.course.extreme("effort", i, sign=-sign, panels=sense == sign, unit=unit)
                tops += [] if top is None else [(-sign * top.value, top)]
            supplied, top = max(tops, key=lambda pair: pair[0], default=(0.0, None))
            if top is not None and supplied > scales.floor(unit):
                subject = f"drive {'torque' if unit == 'N m' else 'force'} of {name} to reverse the motion"
                place = self.course.told(top)
                yield Figure(f"{name}.effort_reverse", subject, top.value, unit, "largest", place)

    @cached_property
    def course(self) -> CycleCourse:
        """The rows by name."""
        efforts = len(self.run.system.mechanism.drivers)
        return CycleCourse(self.run, {"power": (3,), "effort": (efforts,)}, self.courses)

    # ---- ranges -----------------------------------------------------------------------------------------------

    def ranges(self, near: float = NEAR) -> list[LockingRange]:
        """The parts of the cycle in which its state stays the same, in their order; after them those that run, but with
        a margin below `near`."""
        return self.run.once(("locking ranges", self.method, near), lambda: self._ranges(near))

    def _ranges(self, near: float) -> list[LockingRange]:
        parts = _merged(self.courses.edges, self.courses.states, SHORT * self.courses.span)
        ranges: list[tuple[LockingState | None, float, float]] = [
            (STATES[code], low, high) for code, low, high in parts
        ]
        if self.margins is not None:
            ranges += [(None, low, high) for low, high in self._close_to_locking(self.margins.courses, near)]
        values, places = on_dial(self.run, [end for _, *ends in ranges for end in ends])
        return [
            LockingRange(
                state, low, high, *self._least(low, high), values[2 * k : 2 * k + 2], places[2 * k : 2 * k + 2]
            )
            for k, (state, low, high) in enumerate(ranges)
        ]

    def _close_to_locking(self, margins: Courses, near: float) -> list[tuple[float, float]]:
        """Begin and end, s, of where it runs with a margin below `near`."""
        cut = margins.parted(np.concatenate([self.courses.edges, margins.passages(0, near)]))
        middles = cut.edges[:-1] + cut.half
        close = (cut.at(middles)[0] < near) & ~np.isin(self.states_at(middles), NO_MARGIN)
        parts = _merged(cut.edges, close.astype(int), SHORT * cut.span)
        return [(low, high) for below, low, high in parts if below]

    def _least(self, low: float, high: float) -> tuple[float, str]:
        """The smallest margin between two times, s, and where."""
        if self.margins is None:
            return np.nan, ""
        cut = replace(self.margins, courses=self.margins.courses.parted(np.array([low, high])))
        middles = cut.courses.edges[:-1] + cut.courses.half
        inside = (middles > low) & (middles < high) & cut.valid
        least = cut.extreme("locking_margin", sign=-1.0, panels=inside)
        if least is not None:
            return least.value, cut.told(least).removeprefix("at ")
        return (np.inf if np.any(inside & (cut.status < Status.LOAD_UNDEFINED)) else np.nan), ""

    def attribute(self, time: Array, near: float = NEAR) -> dict[str, Any]:
        """The ranges for the attribute `locking_ranges` of a result: see `docs/reference/results.md`."""
        dial, duration = self.run.system.dial(self.run.values, time), self.run.cycle.duration or 1.0
        rows, margin = [], BESIDE * duration
        for part in self.ranges(near):
            first = int(np.searchsorted(time, part.low - margin))
            last = len(time) if part.high >= duration else int(np.searchsorted(time, part.high - margin))
            state = "" if part.state is None else part.state.name.lower()
            place = {"first": first, "count": last - first, "times": [part.low, part.high]}
            rows.append({"state": state, **place, "cells": part.cells(near), "ends": part.ends})
        return {"of": dial.of, "unit": dial.unit.strip(), "positions": len(time), "near": near, "rows": rows}

    def sign_figure(self) -> Figure | None:
        """Where friction no longer holds the loads that push forward: there the drive effort changes its sign."""
        ranges = [part for part in self.ranges() if part.state is not None]
        places = [
            after.places[0] for before, after in pairwise(ranges) if {before.state, after.state} == HELD_AND_DRIVEN
        ]
        if not places:
            return None
        where = ", ".join(places[:MOST_PLACES]) + f" and {len(places) - MOST_PLACES} more" * (len(places) > MOST_PLACES)
        return Figure("drive_effort_sign", f"the drive effort changes sign{centred(self.run, ',')} at", where)

    # ---- the margin and the joint that decides ----------------------------------------------------------------

    @cached_property
    def margins(self) -> CycleCourse | None:
        """The course of the locking margin; None if it is not looked for."""
        return margin_of(self.run, self.method) if self.method.margin_up_to else None

    def margin_figure(self, subject: str = "locking margin", note: str = TIMES) -> Figure | None:
        """The least multiple of all friction at which it locks; `margin_up_to` is as far as that is looked for."""
        name, margins = "locking_margin", self.margins
        if margins is None:
            return None
        least = margins.extreme(name, sign=-1.0, panels=margins.valid)
        if least is not None:
            return Figure(name, subject, least.value, aspect="minimum", place=margins.told(least), note=note)
        if np.any(margins.valid & (margins.status < Status.LOAD_UNDEFINED)):
            return Figure(name, subject, self.method.margin_up_to, aspect=MORE_THAN, note=note)
        return Figure(name, subject, None, note=note)

    def responsible(self) -> tuple[str, float] | None:
        """The joint whose friction, changed alone, decides at the place of the least margin, and the multiple of it.

        Of a mechanism that runs, the first to lock it; of one that is locked, the one that need be lowered the least.
        """
        sound = {joint: multiple for joint, multiple in self._critical.items() if np.isfinite(multiple)}
        locked = [joint for joint, multiple in sound.items() if multiple < 1.0]
        if locked:
            joint = max(locked, key=sound.__getitem__)
            return (joint, sound[joint]) if sound[joint] > 0 else None
        joint = min(sound, key=sound.__getitem__, default="")
        return (joint, sound[joint]) if joint else None

    @cached_property
    def _critical(self) -> dict[str, float]:
        """The critical multiples of the joints at the place of the least margin."""
        margins = self.margins
        least = None if margins is None else margins.extreme("locking_margin", sign=-1.0, panels=margins.valid)
        if margins is None or least is None:
            return {}
        time = np.array([margins.side(least, "locking_margin", -1.0)])
        plain = replace(self.method, name="newton", margin_up_to=0.0)
        with np.errstate(all="ignore"):
            multiples = critical_multiples(self.run.solve(time, method=plain), self.method.margin_up_to)
        return {joint: float(multiple[0]) for joint, multiple in multiples.items()}

    def critical_figures(self, tables: dict[str, Array]) -> Iterator[Figure]:
        """The least critical multiple of each joint whose friction is not 0, and its friction there.

        tables: the multiples at some positions, which tell what is nowhere finite.
        """
        run, joints = self.run, felt(self.run.system, self.run.values)

        def look(time: Array) -> tuple[Array, NDArray[np.int64]]:
            time = time if run.cycle.duration > 0 else 0.0 * time
            multiples = critical_multiples(run.solve(time, method=FrictionMethod()), MARGIN)
            rows = np.array([multiples.get(joint, np.full(time.shape, np.nan)) for joint in joints])
            rows = np.where(np.isfinite(rows), rows, np.nan)
            return rows, np.tensordot(1 << (np.arange(len(joints)) % BITS), np.isfinite(rows), 1)

        if not joints:
            return
        with np.errstate(all="ignore"):
            in_parts = in_blocks(look, len(run.system.joints) * len(joints))
            courses = Courses.of(in_parts, self.courses.breaks, None, accuracy_of(run.cycle, MARGINS))
        course = CycleCourse(run, {"multiple": (len(joints),)}, courses)
        every = np.ones(len(courses.half), bool)
        for i, joint in enumerate(joints):
            name, subject = f"{joint}.critical_multiple", f"critical multiple of {joint} alone"
            least = course.extreme("multiple", i, sign=-1.0, panels=every)
            if least is None:
                bounded = np.any(np.isinf(tables[joint]))
                yield Figure(name, subject, MARGIN if bounded else None, aspect=MORE_THAN * bool(bounded))
                continue
            figure = Figure(name, subject, least.value, aspect="minimum", place=course.told(least))
            alone = critical_figure(run, joint, least.value, course.told(least))
            if alone.name != name:
                yield figure
                yield alone
            else:
                yield alone if least.value == 0 else figure

    # ---- friction that holds the loads ------------------------------------------------------------------------

    def holding_figures(self) -> list[Figure]:
        """From which friction on it holds: wherever the loads push, if it does, else at the end of its range, if there.

        None where it holds even without, as where masses take more than the loads give.
        """
        run, pushes = self.run, self.all_states() & PUSHES
        everywhere = bool(pushes) and pushes <= HELD
        if not everywhere and run.cycle.periodic:
            return []
        duration = run.cycle.duration
        if everywhere:

            def look(time: Array) -> tuple[Array, NDArray[np.int64]]:
                multiples = holding_multiples(run, time)
                return multiples[None], np.isfinite(multiples).astype(int)

            breaks = self.courses.breaks
            courses = Courses.of(look, breaks, None, accuracy_of(run.cycle, MARGINS._replace(tolerance=1e-9)))
            course = CycleCourse(run, {"multiple": ()}, courses)
            every = np.ones(len(courses.half), bool)
            top = course.extreme("multiple", panels=every)
            multiple, place = (0.0, "") if top is None else (top.value, course.told(top))
        else:
            multiple = float(holding_multiples(run, np.array([duration]))[0])
            place = f"at {run.system.dial(run.values, np.array([duration])).at(0)}"
        if not multiple > 0:
            return []
        aspect, subject = "maximum" * everywhere, "down to which it is self-locking" + centred(run)
        forward = self.states_at(np.array([duration]))[0] == LockingState.SELF_LOCKING_FORWARD
        note = "below it the loads drive it on, onto a stop there" * bool(forward and not run.cycle.periodic)
        more = ("1", aspect, place, note)
        figures = [Figure("holding_multiple", f"multiple of all friction {subject}", multiple, *more)]
        paths = {f"joints.{joint}.friction.{law_of(run.system, joint).scale}" for joint in felt(run.system, run.values)}
        same = {float(np.ravel(primal(run.values[path]))[0]) if path in run.values else np.nan for path in paths}
        if len(same) == 1 and np.isfinite(value := same.pop()):
            subject = f"friction coefficient {subject}"
            figures.append(Figure("holding_coefficient", subject, multiple * value, *more))
        return figures


def holding_multiples(run: Run, time: Array) -> Array:
    """Multiple of all friction down to which friction holds the loads, at each time, s; NaN where it does not.

    There the power delivered to the drivers, in the direction in which the loads push, rises from 0. 0 where it is
    held without the friction that follows loads.
    """
    multiples, least = np.full(len(time), np.nan), scales_of(run).floor("W")
    walk = run.walk(time)
    for direction in (walk, walk.backward()):
        full = passed(run, direction, FrictionMethod())
        holding = np.flatnonzero((full.acting > least) & (full.locked | (full.delivered <= 0)))
        if not len(holding):
            continue

        def released(
            lane: NDArray[np.intp], multiple: Array, times: Array = time[holding], back: bool = direction.direction < 0
        ) -> tuple[Array, NDArray[np.intp]]:
            """Power delivered to the drivers for multiples of all friction; below 0 where it locks."""
            part = run.walk(np.repeat(times[lane], multiple.shape[1]))
            through = passed(run, part.backward() if back else part, FrictionMethod(multiple=multiple.ravel()))
            power = np.where(through.locked, -np.abs(through.acting), through.delivered)
            return power.reshape(1, *multiple.shape), through.locked.reshape(multiple.shape).astype(np.intp)

        with np.errstate(all="ignore"):
            each = Courses.many(released, [np.array([0.0, 1.0])] * len(holding), None, HOLDING)
        for lane, course in zip(holding, each, strict=True):
            passages = course.passages(0)
            none = course.ends(0)[1][0] <= 0.0
            multiples[lane] = 0.0 if none or not len(passages) else passages[0]
    return multiples


# ---- words ----------------------------------------------------------------------------------------------------


def critical_figure(run: Run, joint: str, multiple: float, place: str) -> Figure:
    """The critical friction of a joint alone: its coefficient if its law is proportional to one, else the multiple."""
    parameter = law_of(run.system, joint).scale
    if not multiple > 0:
        subject = f"critical multiple of the friction of {joint} alone (it locks even without)"
        return Figure(f"{joint}.critical_multiple", subject, 0.0, place=place)
    if not parameter:
        subject = f"critical multiple of the friction of {joint} alone"
        return Figure(f"{joint}.critical_multiple", subject, multiple, place=place)
    value = float(np.ravel(primal(run.values[f"joints.{joint}.friction.{parameter}"]))[0])
    subject = f"critical friction {parameter} of {joint} alone"
    return Figure(f"{joint}.critical_{parameter}", subject, multiple * value, place=place)


def centred(run: Run, after: str = "") -> str:
    """What ranges and the way back are of: of the mechanism without play."""
    return (", pins centred" + after) * bool(run.seats)


def _beside(run: Run) -> str:
    """What supplies work beside the useful loads."""
    mechanism = run.system.mechanism
    loads, springs = useful_loads(mechanism), useful_springs(mechanism)
    sources = {
        "masses": any(link.mass.source != 0 for link in mechanism.effective_links.values()),
        "springs": any(name not in springs for name in mechanism.springs),
        "loads that are not useful": any(name not in loads for name in mechanism.loads),
    }
    others = [source for source, supplies in sources.items() if supplies]
    return f"{', '.join(others)} supply work too" if others else "more than 1: not solved accurately enough"


def _merged(edges: Array, codes: NDArray[np.integer], shortest: float) -> list[tuple[int, float, float]]:
    """Code, begin and end of the stretches of one code; what is shorter than `shortest` is of what follows."""
    stretches: list[tuple[int, float, float]] = []
    low = float(edges[0])
    for k, code in enumerate(codes.tolist()):
        high = float(edges[k + 1])
        if k + 1 < len(codes) and codes[k + 1] == code:
            continue
        if high - low <= shortest and k + 1 < len(codes):
            continue  # the next begins here
        if stretches and (stretches[-1][0] == code or high - low <= shortest):
            stretches[-1] = (*stretches[-1][:2], high)
        else:
            stretches.append((code, low, high))
        low = high
    return stretches
