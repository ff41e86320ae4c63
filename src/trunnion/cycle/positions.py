"""The positions of a cycle: every variable of the results, statuses and means, before the books are made."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.panels import POINTS
from trunnion.cycle.course import CycleCourse, Means, course_of, unknown
from trunnion.cycle.cycle_kernel import compiles, kernel_of
from trunnion.cycle.fill import COMPARED, Arrays, Causes, allocate, fill_chunk, fill_errors, labels, unwrap
from trunnion.errors import Finding, MechanismError, Status
from trunnion.model.arguments import strict_arguments
from trunnion.model.names import nearest
from trunnion.results import variables as results
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.margin import least_beside, margin_in
from trunnion.solve.run import CHUNK, Run, blocks
from trunnion.solve.seating import NO_LOAD, SETTLED, UNSETTLED, Seating, seating_of
from trunnion.solve.system import Dial, System

Array = NDArray[np.float64]
Dtype = Literal["float64", "float32"]
INSIDE = 1e-9  # of the cycle: positions at the ends of a time belong to it
# what summary and findings are made of
BOOKS = {
    "condition", "drive_effort", "drive_power", "friction_iterations", "friction_power", "joint_slide",
    "locking_margin", "power_residual", "reaction_force", "reaction_moment", "spring_elongation", "spring_power",
    "status", "useful_power",
}  # fmt: skip
# what makes an angle run on over whole turns
TURNED = {
    "joint_rotation": ("joint_rotation_velocity", "link_angle", "link_angle_velocity"),
    "link_angle": ("link_angle_velocity", "joint_rotation", "joint_rotation_velocity"),
}
MOST_STEPS = 10_000_000  # all of them are held in memory: of a four-bar 10 GB, some variables of it less


def check_steps(steps: int) -> None:
    if not 1 <= steps <= MOST_STEPS:
        remedy = f"give a whole number from 1 to {MOST_STEPS:,}, for all positions are held in memory"
        raise MechanismError(Finding(f"cannot analyse {steps} positions", "steps", remedy))


@strict_arguments
@dataclass(frozen=True)
class Kept:
    """variables: names of `results.VARIABLES`, all if not given; the status is always kept. dtype: of the floats."""

    variables: tuple[str, ...] | None = None
    dtype: Dtype = "float64"

    @classmethod
    def read(cls, variables: Sequence[str] | None, dtype: Dtype) -> Kept:
        """What somebody asks for; MechanismError for a name or a kind of number that there is not."""
        for name in variables or ():
            if name not in results.VARIABLES:
                remedy = nearest(name, list(results.VARIABLES))
                raise MechanismError(Finding(f"a result has no variable '{name}'", "variables", remedy))
        return cls(None if variables is None else (*dict.fromkeys([*variables, "status"]),), dtype)

    @property
    def margin(self) -> bool:
        """Whether the locking margin is to be found, which may take longer than all else."""
        return self.variables is None or "locking_margin" in self.variables


ALL = Kept()


def needed(names_asked: Collection[str], system: System, erring: bool) -> set[str]:
    """The variables that have to be found for those that are wanted and for the books of the cycle."""
    variables = {*names_asked, *BOOKS}
    if erring:
        parts = {name for name, entry in results.VARIABLES.items() if entry.part}
        variables |= {*parts, *COMPARED}
    variables |= {results.SAME_AS[name] for name in variables & results.SAME_AS.keys()}
    if any(joint.pair.threaded for joint in system.joints.values()):  # a screw's slide follows its rotation
        variables.add("joint_rotation")
    return variables | {other for name in variables & TURNED.keys() for other in TURNED[name]}


@dataclass(frozen=True)
class Positions:
    """What every position of a cycle came to, before the books of the cycle are made of it.

    means: over the cycle; ideal: those of the mechanism without errors, if it has any; course: that of the cycle, which
    does not depend on the positions, if it was looked for.
    """

    arrays: Arrays
    labels: dict[str, list[str]]
    time: Array
    dial: Dial
    method: FrictionMethod
    causes: Causes
    means: Means
    ideal: Means | None
    course: CycleCourse | None = None


def positions(
    run: Run,
    steps: int = 360,
    method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
    margin: bool = True,
    averaged: bool = True,
    engine: str = "auto",
    wanted: Collection[str] | None = None,
    at: float | None = None,
) -> Positions:
    """The numbers of every variable of `results` at equally spaced positions, their statuses and causes.

    margin: whether the locking margin is looked for; it is infinite if not. averaged: whether the means over the cycle
    are, which ask for many positions more; they are NaN if not. engine: see `cycle_kernel.compiles`. wanted: the
    variables that will be read beside those that the books of the cycle are made of, all if not given. at: a time,
    s, for that position alone.
    """
    check_steps(steps)
    seated = {seat.joint for seat in run.seats}
    for module in run.system.plan.modules:
        if module.redundant and (names := [name for name in module.joints if name in seated]):
            what = f"the links {', '.join(module.links)} are over-constrained: they do not close with seat: loaded"
            remedy = "analyse with --seat free; see `trunnion assemble` for the play that it needs"
            raise MechanismError(Finding(what, f"joints.{names[0]}.seat", remedy))
    method = replace(method or FrictionMethod(), margin_up_to=MARGIN if margin else 0.0)
    steps = steps if run.cycle.duration > 0 else 1
    time = run.cycle.times(steps) if at is None else np.array([at])
    result = stretch(run, time, method, engine, wanted, progress)
    return over_cycle(run, result) if averaged else result


def over_cycle(run: Run, result: Positions) -> Positions:
    """The same with the course of the cycle and its means, which do not depend on the positions."""
    quick = replace(result.method, margin_up_to=0.0)  # the margin is known by now
    course = course_of(run, quick)
    ideal = course_of(run, quick, ideal=True).means if run.erring else None
    return replace(result, course=course, means=course.means, ideal=ideal)


def stretch(
    run: Run,
    time: Array,
    method: FrictionMethod,
    engine: str = "auto",
    variables: Collection[str] | None = None,
    progress: Callable[[int], None] | None = None,
) -> Positions:
    """The same at some times of the cycle, s, in a row and equally spaced; the means are NaN."""
    steps, variables = len(time), None if variables is None else needed(variables, run.system, run.erring)
    names = labels(run.system) | ({"end": ["1", "2"]} if run.seats else {})
    parts = [part for part, has in (("seats", run.seats), ("errors", run.erring)) if has]
    arrays, causes = allocate(run.system, steps, parts, variables), Causes(run.system)
    compiled = compiles(engine, run, steps, method) and _compiled(arrays, run, time, method, causes, engine)
    quick, seating = replace(method, margin_up_to=0.0), seating_of(run, method) if run.seats else None
    for window in blocks(0 if compiled else steps, len(run.system.joints)):
        seated = seating.at(time[window], method) if seating else None
        fill_chunk(arrays, seated.back if seated else run.solve(time[window], method=method), window, causes)
        if seating and seated:
            causes.keep("stuck", "", seated.sticks, np.arange(window.start, window.stop))
            arrays["seat_rounds"][window], arrays["seat_change"][window] = seated.rounds, seating.change[seated.states]
            arrays["seat_travel"][window] = seated.states == SETTLED
            status = arrays["status"][window]
            np.maximum(status, np.where(seated.sticks, status.dtype.type(Status.ZERO_SLIP), 0), out=status)
        if run.erring:
            meant = allocate(run.system, len(time[window]), wanted=COMPARED)
            fill_chunk(meant, run.ideal.solve(time[window], method=quick), slice(None))
            fill_errors(arrays, meant, run.system, window)
        if progress:
            progress(window.stop)
    resting = {joint: places for joint, (places, _) in causes.of("rest").items()}
    _bracket(arrays, run, time, quick, resting, seating)
    if method.margin_up_to and resting and run.cycle.duration > 0:
        places = np.unique(np.concatenate(list(resting.values())))
        solve = (lambda at: seating.at(at, method).back) if seating else (lambda at: run.solve(at, method=method))
        least = least_beside(partial(margin_in, most=method.margin_up_to), solve, time[places], run.cycle)
        arrays["locking_margin"][places] = np.where(np.isnan(least), arrays["locking_margin"][places], least)
    if seating:
        _lose_contact(arrays, seating, time)
    unwrap(arrays, run.system, run.values, time)
    means = unknown(len(run.system.mechanism.drivers), len(run.system.joints))
    dial = run.system.dial(run.values, time)
    return Positions(arrays, names, time, dial, method, causes, means, means if run.erring else None)


def _compiled(arrays: Arrays, run: Run, time: Array, method: FrictionMethod, causes: Causes, engine: str) -> bool:
    """All positions by the compiled engine; False where that cannot, of the engine auto."""
    kernel = kernel_of(run, engine, run.values, time, arrays, method)
    if kernel is None:
        return False
    kernel.fill(arrays, run.values, time, causes)
    if run.erring:
        meant, quick = allocate(run.system, len(time), wanted=COMPARED), replace(method, margin_up_to=0.0)
        ideal = kernel_of(run, "compiled", run.ideal.values, time, meant, quick)
        assert ideal is not None
        ideal.fill(meant, run.ideal.values, time)
        fill_errors(arrays, meant, run.system, slice(0, len(time)))
    return True


# ---- where pins lose contact -------------------------------------------------------------------------------------


def _lose_contact(arrays: Arrays, seating: Seating, time: Array) -> None:
    """Write the losses of contact of joints that their loads seat into `contact_lost`, the status and the numbers.

    The massless-link model of play keeps the pin at the wall of its hole. That ends where the load vanishes or turns
    round, which the courses of the loads without play say whatever the positions are; where the load of a pin that
    travels points away from its wall; and where a seat does not settle, since there the load changes more by the seat
    than it presses.

    The number of each joint is |F × Ḟ|/|F|³, rad/(N s), of its reaction without play, in space of the force on an end.
    S. W. E. Earles and C. L. S. Wu (Predicting the occurrence of contact loss and impact at a bearing from a
    zero-clearance analysis, Proc. 4th World Congress on the Theory of Machines and Mechanisms, 1975, 1013-1018) found
    it to tell impact from about 1 rad/(N s) on. It is empirical, and has a unit.
    """
    run, loads, status = seating.run, seating.loads, arrays["status"]
    for first in range(0, len(time), CHUNK):
        window = slice(first, min(first + CHUNK, len(time)))
        forces, rates = loads.courses.at(time[window]), loads.rates.at(time[window])
        for number, vectors in zip(arrays["contact_loss_number"][:, window], loads.vectors, strict=True):
            for rows in vectors:  # |F × Ḟ|/|F|³
                force, rate = forces[rows], rates[rows]
                square = np.sum(force * force, axis=0)
                with np.errstate(all="ignore"):
                    across = np.linalg.norm(rate - force * (np.sum(force * rate, axis=0) / square), axis=0)
                    pressed = np.sqrt(square) > NO_LOAD * loads.largest
                    number[...] = np.fmax(number, np.where(pressed, across / square, np.nan))
    joints, duration, lost = list(run.system.joints), run.cycle.duration, arrays["contact_lost"]
    step = time[1] - time[0] if len(time) > 1 else 0.0
    for halt in seating.halts:
        lost[joints.index(halt.joint), (halt.low <= time) & (time < halt.high)] = 1
    times = [(cross.end, cross.low, cross.time, cross.high) for cross in loads.passages]
    for end, low, middle, high in times + [(end, low, low, high) for end, low, high in loads.idle]:
        row, away = joints.index(end.seat.joint), np.abs(time - middle)
        away = np.minimum(away, duration - away) if run.cycle.periodic else away
        lost[row, (time >= low - INSIDE * duration) & (time <= high + INSIDE * duration)] = 1
        if np.min(away) <= (0.5 + INSIDE) * step:  # the position next to it, if it lies between two
            lost[row, np.argmin(away)] = 1
    late = np.flatnonzero((seating.states(time) == UNSETTLED) & (status != Status.ZERO_SLIP))
    if len(late):  # of the joint whose end bears least
        rows = [joints.index(seat.joint) for seat in run.seats if seat.given is None]
        sizes = np.sqrt(np.sum(arrays["end_force"][rows][..., late] ** 2, axis=2))
        least = np.argmin(np.nan_to_num(np.min(np.where(np.isfinite(sizes), sizes, np.inf), axis=1)), axis=0)
        lost[np.array(rows)[least], late] = 1
    lost[:, status >= Status.NOT_CONVERGED] = 0
    anywhere = np.any(lost > 0, axis=0)
    np.maximum(status, np.where(anywhere, status.dtype.type(Status.CONTACT_LOST), status.dtype.type(0)), out=status)


# ---- drive efforts where a joint rests -------------------------------------------------------------------------

LANES = 512  # positions solved at once, each with many shares
SHARES = np.concatenate([[-1.0], POINTS, [1.0]])  # of the resistance of a contact; they are close at the ends
FLAT = 1e-9  # of the effort: where it rises by less between the ends it is followed no farther
CLOSER, ZOOMED = 7, 18  # places between the neighbours of the highest, and how often these are narrowed
ROUNDS = 3  # of several contacts, each by itself: they hardly depend on one another


def _bracket(
    arrays: dict[str, Array],
    run: Run,
    time: Array,
    method: FrictionMethod,
    resting: Mapping[str, NDArray[np.intp]],
    seating: Seating | None,
) -> None:
    """Fill drive_effort_lower and drive_effort_upper: what resists a joint that rests may be anything between two ends.

    The effort is no linear function of that resistance, for other joints rub the more the harder they are pressed, and
    it bends where a guide tilts over. So its extremes are looked for between the ends, for one contact after the other;
    of several joints that rest the separate effects are added (first order). resting: places at which a joint does;
    seating: where pins lie, if not in the middle.
    """
    if not resting or not run.system.mechanism.drivers:
        return  # both are the effort itself, or there is none
    ends = {sign: arrays["drive_effort"].copy() for sign in (-1.0, 1.0)}
    for joint, places in resting.items():
        for low in range(0, len(places), LANES):
            part = places[low : low + LANES]
            seats = seating.offsets(time[part]) if seating else {}
            for sign, change in _effort_changes(run, joint, time[part], seats, method).items():
                ends[sign][:, part] += change
    arrays["drive_effort_lower"], arrays["drive_effort_upper"] = ends.values()


def _effort_changes(
    run: Run, joint: str, time: Array, seats: Mapping[str, Array], method: FrictionMethod
) -> dict[float, Array]:
    """By how much each effort may be less, sign −1, and more, 1, where a joint rests, (driver, time); NaN where it may
    lock."""
    contacts, drivers = run.system.resting(joint), run.system.mechanism.drivers
    lane = np.arange(len(time))

    def efforts(shares: Array) -> Array:
        """(driver, share, time) under shares of the resistance of each contact, −1 to 1, (contact, share, time)."""
        count = shares.shape[1]
        offsets = {path: np.tile(row, count) for path, row in seats.items()}
        senses = {joint: tuple(shares.reshape(contacts, -1))}
        numbers = run.at(np.tile(time, count), offsets, method, senses).efforts
        rows = [np.broadcast_to(numbers[name], count * len(time)) for name in drivers]
        return np.array(rows).reshape(len(drivers), count, -1)

    shares = np.zeros((contacts, 1 + len(SHARES), len(time)))
    shares[0, 1:] = SHARES[:, None]
    middle, *first = np.moveaxis(efforts(shares), 1, 0)
    changes = {sign: np.zeros(middle.shape) for sign in (-1.0, 1.0)}
    for sign, (row, at_rest) in itertools.product(changes, enumerate(middle)):
        most, best = changes[sign][row], np.zeros((contacts, 1, len(time)))
        for contact in list(range(contacts)) * (ROUNDS if contacts > 1 else 1):
            spots, values = np.repeat(SHARES[:, None], len(time), axis=1), np.array(first)[:, row]
            for round_ in range(ZOOMED):
                if round_ or contact or np.any(best):
                    tried = np.repeat(best, len(spots), axis=1)
                    tried[contact] = spots
                    values = efforts(tried)[row]
                values = sign * (values - at_rest)
                k = np.argmax(values, axis=0)  # of one without a value, if any
                top, better = values[k, lane], ~(values[k, lane] <= most)
                most[better], best[contact, 0, better] = top[better], spots[k, lane][better]
                rises = top > np.maximum(values[0], values[-1]) + FLAT * (np.abs(at_rest) + np.ptp(values, axis=0))
                if not np.any(rises):
                    break
                low, high = (spots[np.where(rises, k + side, k), lane] for side in (-1, 1))
                spots = np.linspace(low, high, CLOSER)
    return {sign: sign * most for sign, most in changes.items()}
