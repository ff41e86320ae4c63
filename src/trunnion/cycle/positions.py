"""The positions of a cycle: every variable of the results, statuses and means, before the books are made."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.unwrap import Tail
from trunnion.cycle import contact_loss, diagnosis, resting_joints
from trunnion.cycle.compiled import CycleKernel, compiles
from trunnion.cycle.course import CycleCourse, course_of
from trunnion.cycle.deviations import COMPARED, fill_errors
from trunnion.cycle.kept import needed
from trunnion.cycle.means import AVERAGED, Means, still
from trunnion.cycle.near_locking import LOOKED
from trunnion.cycle.unanswered import blank
from trunnion.cycle.variables import fill_of
from trunnion.cycle.written import Arrays, fill_chunk, fill_lanes, link_numbers, write
from trunnion.errors import Finding, MechanismError, Status
from trunnion.results import variables as results
from trunnion.solve.backward import Backward
from trunnion.solve.compiled_seats import CompiledLooks, Travelling, as_inputs
from trunnion.solve.eccentricity_rate import Lanes, lanes, part_of
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.memory import CHUNK
from trunnion.solve.run import Run
from trunnion.solve.seating import Seats, by_numpy, seats_of, settle
from trunnion.solve.system import Dial, Values

__all__ = ["IDEAL", "Arrays", "Positions", "check_steps", "positions", "stretch"]


MOST_STEPS = 100_000_000
SEATED_AT_ONCE = 1 << 17  # positions whose seats the compiled engine settles together


def check_steps(steps: int) -> None:
    if not isinstance(steps, (int, np.integer)) or not 1 <= steps <= MOST_STEPS:
        remedy = f"give a whole number from 1 to {MOST_STEPS:,}"
        raise MechanismError(Finding(f"cannot analyse {steps} positions", "steps", remedy))


@dataclass(frozen=True)
class Positions:
    """What every position of a cycle came to, before the books of the cycle are made of it.

    means: over the cycle; ideal: those of the mechanism without errors, if it has any; losses: of contact; walked: the
    one walk that they all came of, where it was one and pins lie in no seats; compiled: whether the compiled engine
    found them; course: that of the cycle, which does not depend on the positions, if it was looked for.
    """

    arrays: Arrays
    labels: dict[str, list[str]]
    time: NDArray[np.float64]
    dial: Dial
    method: FrictionMethod
    causes: diagnosis.Causes
    means: Means
    ideal: Means | None
    losses: list[contact_loss.Loss]
    walked: Backward | None = None
    compiled: bool = False
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
    among: int = 0,
) -> Positions:
    """The numbers of every variable of `results` at equally spaced positions, their statuses and causes.

    margin: whether the locking margin is looked for; it is infinite if not. averaged: whether the means over the cycle
    are, which ask for many positions more; they are NaN if not. engine: see `compiled.cycle_kernels`. wanted: the
    variables that will be read beside those that the books of the cycle are made of, all if not given; among: how many
    positions there will be in all, if more.
    """
    check_steps(steps)
    _refuse_seats(run)
    method = replace(method or FrictionMethod(), margin_up_to=MARGIN if margin else 0.0)
    steps = steps if run.cycle.duration > 0 else 1
    found = stretch(run, run.cycle.times(steps), method, engine, wanted, progress=progress, among=among)
    if not averaged:
        return found
    quick = replace(method, margin_up_to=0.0)  # the margin is known by now
    course = course_of(run, quick)
    ideal = course_of(run, quick, ideal=True).means if run.erring else None
    return replace(found, course=course, means=course.means, ideal=ideal)


def stretch(
    run: Run,
    time: NDArray[np.float64],
    method: FrictionMethod,
    engine: str = "auto",
    wanted: Collection[str] | None = None,
    tails: dict[str, Tail] | None = None,
    progress: Callable[[int], None] | None = None,
    among: int = 0,
) -> Positions:
    """The same at some times of the cycle, s, in a row and equally spaced; the means are NaN.

    tails: of the angles before these times, and then of these; among: how many times there are in all, if more.
    """
    steps, wanted = len(time), None if wanted is None else needed(wanted, run.system, run.erring)
    labels = fill_of(run.system).labels(run.system) | ({"end": ["1", "2"]} if run.seats else {})
    parts = [part for part, there in (("seats", run.seats), ("errors", run.erring)) if there]
    arrays = results.allocate(labels, steps, fill_of(run.system).absent(run.system), parts, wanted)
    causes = diagnosis.Causes(run.system)
    ideal = {name: np.zeros(arrays[name].shape, arrays[name].dtype) for name in IDEAL} if run.erring else {}
    compiled = compiles(engine, run, max(steps, among), method) and _fill_compiled(
        arrays, ideal, run, time, method, causes, engine == "auto"
    )
    back = None
    for low in range(0, 0 if compiled else steps, CHUNK):
        window = slice(low, min(low + CHUNK, steps))
        if run.erring:
            back = _fill_as_built(arrays, ideal, run, time, window, method, causes)
        else:
            back = run.solve(time[window], method=method)
            fill_chunk(arrays, back, time[window], window, causes)
        if progress:
            progress(window.stop)
    quick = replace(method, margin_up_to=0.0)  # the margin is known by now
    resting_joints.bracket(arrays, run, time, quick, causes.zero_slip(), causes.seats())
    losses = contact_loss.find(arrays, run, time) if run.seats else []
    fill_of(run.system).unwrap(arrays, run.system, run.values, time, tails)
    walked = back if steps <= min(LOOKED, CHUNK) and not run.seats else None
    meant = still(ideal) if run.erring else None
    dial = run.system.dial(run.values, time)
    return Positions(arrays, labels, time, dial, method, causes, still(arrays), meant, losses, walked, compiled)


def _refuse_seats(run: Run) -> None:
    """MechanismError where pins lie in seats of a module that closes with special dimensions only."""
    seated = {seat.joint for seat in run.seats}
    for module in run.system.plan.modules:
        names = [name for name in module.joints if name in seated]
        if module.redundant and names:
            what = f"the links {', '.join(module.links)} are over-constrained: they do not close with seat: loaded"
            remedy = "analyse with --seat free; see `trunnion assemble` for the play that it needs"
            raise MechanismError(Finding(what, f"joints.{names[0]}.seat", remedy))


IDEAL = (*AVERAGED, "status")  # what the means of the ideal mechanism are made of


def _fill_as_built(
    arrays: Arrays,
    ideal: Arrays,
    run: Run,
    time: NDArray[np.float64],
    window: slice,
    method: FrictionMethod,
    causes: diagnosis.Causes,
) -> Backward:
    """One chunk of a mechanism with errors beside the ideal one; the walk it came of."""
    part, quick = time[window], replace(method, margin_up_to=0.0)
    labels = fill_of(run.system).labels(run.system)
    seen = lanes(part, run.cycle) if run.seats else Lanes(part, np.arange(len(part)), 0)
    scratch = results.allocate(
        labels, len(seen.times), fill_of(run.system).absent(run.system), wanted={*IDEAL, *COMPARED}
    )
    meant = run.ideal(seen.times, quick)
    fill_chunk(scratch, meant, seen.times, slice(0, len(seen.times)))
    own = slice(int(seen.own[0]), int(seen.own[-1]) + 1)
    scratch = {name: array[..., own] for name, array in scratch.items()}
    for name, array in ideal.items():
        array[..., window] = scratch[name]
    if run.seats:
        seated = settle(run, seen, method, by_numpy(run, seen, method, meant))
        back = seated.back
        fill_chunk(arrays, back, part, window, causes)
        _note_seats(arrays, seated, window, causes)
    else:
        back = run.solve(part, method=method)
        fill_chunk(arrays, back, part, window, causes)
    fill_errors(arrays, scratch, link_numbers(run.system), window)
    blank(arrays, arrays["status"][window].astype(np.int8), window)
    return back


def _note_seats(arrays: Arrays, seated: Seats, window: slice, causes: diagnosis.Causes) -> None:
    """What the iteration came to in one chunk, beside the walk with the pins in their seats."""
    causes.note_seats(seated.offsets, seated.sticks, window.start)
    arrays["seat_rounds"][window] = seated.rounds
    arrays["seat_travel"][window] = seated.told
    arrays["seat_change"][window] = seated.change
    status = arrays["status"][window]
    np.maximum(status, np.where(seated.sticks, status.dtype.type(Status.ZERO_SLIP), 0), out=status)


def _fill_compiled(
    arrays: Arrays,
    ideal: Arrays,
    run: Run,
    time: NDArray[np.float64],
    method: FrictionMethod,
    causes: diagnosis.Causes,
    or_not: bool,
) -> bool:
    """All positions by the compiled engine. or_not: False where it cannot, in place of a MechanismError."""
    if run.seats:
        return _fill_seated(arrays, ideal, run, time, method, causes, or_not)
    try:
        own = _kernel(run, run.values, time, arrays, method)
    except MechanismError:
        if or_not:
            return False
        raise
    left = own.fill(arrays, run.values, time)[1]
    _fill_rest(arrays, left, lambda lanes: run.solve(time[lanes], method=method), time, causes)
    if run.erring:
        _fill_beside_ideal(arrays, ideal, run, time, slice(0, len(time)), method)
    return True


def _fill_beside_ideal(
    arrays: Arrays,
    ideal: Arrays,
    run: Run,
    time: NDArray[np.float64],
    window: slice,
    method: FrictionMethod,
) -> None:
    """The ideal mechanism at some positions, compiled, and what differs from it."""
    quick, system, part = replace(method, margin_up_to=0.0), run.system, time[window]
    labels, absent = fill_of(system).labels(system), fill_of(system).absent(system)
    meant = results.allocate(labels, len(part), absent, wanted={*IDEAL, *COMPARED})
    left = _kernel(run, run.ideal_values, part, meant, quick).fill(meant, run.ideal_values, part)[1]
    _fill_rest(meant, left, lambda lanes: run.ideal(part[lanes], quick), part)
    for name, array in ideal.items():
        array[..., window] = meant[name]
    fill_errors(arrays, meant, link_numbers(system), window)
    blank(arrays, arrays["status"][window].astype(np.int8), window)


def _fill_seated(
    arrays: Arrays,
    ideal: Arrays,
    run: Run,
    time: NDArray[np.float64],
    method: FrictionMethod,
    causes: diagnosis.Causes,
    or_not: bool,
) -> bool:
    """The same with pins in seats, as many positions at a time as memory should hold twice."""
    for low in range(0, len(time), SEATED_AT_ONCE):
        window = slice(low, min(low + SEATED_AT_ONCE, len(time)))
        part, some = time[window], {name: array[..., window] for name, array in arrays.items()}
        seen = lanes(part, run.cycle)
        try:
            seats = seats_of(run, seen, CompiledLooks(run, seen.times, method))
            inputs = {**run.values, **as_inputs(seats.offsets, seats.moving)}
            own = _kernel(run, inputs, part, some, method)
        except MechanismError:
            if or_not:
                return False
            raise

        def solved(places: NDArray[np.intp], seats: Seats = seats, low: int = low) -> Backward:
            own = places - low
            offsets = {path: numbers[own] for path, numbers in seats.offsets.items()}
            return run.at(time[places], offsets, method, travel=part_of(seats.moving, own, whole=True))

        _fill_rest(arrays, own.fill(some, inputs, part)[1] + low, solved, time, causes)
        _note_seats(arrays, seats, window, causes)
        _fill_beside_ideal(arrays, ideal, run, time, window, method)
    return True


def _kernel(run: Run, values: Values, time: NDArray[np.float64], arrays: Arrays, method: FrictionMethod) -> CycleKernel:
    """The compiled kernel of some variables, made once for numbers of one kind."""
    read = tuple(name for name, array in arrays.items() if array.strides[-1])
    of = Travelling(run.system, run.values, run.cycle, run.chosen) if len(values) > len(run.values) else run
    key = "compiled", values is run.values, len(values), method, read
    return run.once(key, lambda: CycleKernel(of, values, time, arrays, write, method))


def _fill_rest(
    arrays: Arrays,
    left: NDArray[np.intp],
    solve: Callable[[NDArray[np.intp]], Backward],
    time: NDArray[np.float64],
    causes: diagnosis.Causes | None = None,
) -> None:
    """Those positions that the compiled engine leaves to NumPy. solve: the walk of some of them."""
    for low in range(0, len(left), CHUNK):
        lanes = left[low : low + CHUNK]
        fill_lanes(arrays, solve(lanes), time[lanes], (lanes,), causes)
