"""The positions of a cycle: every variable of the results, statuses and means, before the books are made."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle import contact_loss, diagnosis, resting_joints
from trunnion.cycle.course import CycleCourse, course_of
from trunnion.cycle.cycle_kernel import CycleKernel, compiles
from trunnion.cycle.deviations import COMPARED, fill_errors
from trunnion.cycle.fill import allocate, labels, unwrap
from trunnion.cycle.kept import needed
from trunnion.cycle.means import IDEAL, Means, still
from trunnion.cycle.unanswered import blank
from trunnion.cycle.written import Arrays, fill_chunk, link_numbers
from trunnion.errors import Finding, MechanismError, Status
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.memory import blocks
from trunnion.solve.run import Run
from trunnion.solve.seating import SETTLED, seating_of
from trunnion.solve.system import Dial, Values

__all__ = ["Arrays", "Positions", "check_steps", "positions", "stretch"]


MOST_STEPS = 10_000_000  # all of them are held in memory: of a four-bar 10 GB, some variables of it less


def check_steps(steps: int) -> None:
    if not 1 <= steps <= MOST_STEPS:
        remedy = f"give a whole number from 1 to {MOST_STEPS:,}, for all positions are held in memory"
        raise MechanismError(Finding(f"cannot analyse {steps} positions", "steps", remedy))


@dataclass(frozen=True)
class Positions:
    """What every position of a cycle came to, before the books of the cycle are made of it.

    means: over the cycle; ideal: those of the mechanism without errors, if it has any; course: that of the cycle, which
    does not depend on the positions, if it was looked for.
    """

    arrays: Arrays
    labels: dict[str, list[str]]
    time: NDArray[np.float64]
    dial: Dial
    method: FrictionMethod
    causes: diagnosis.Causes
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
) -> Positions:
    """The numbers of every variable of `results` at equally spaced positions, their statuses and causes.

    margin: whether the locking margin is looked for; it is infinite if not. averaged: whether the means over the cycle
    are, which ask for many positions more; they are NaN if not. engine: see `cycle_kernel.compiles`. wanted: the
    variables that will be read beside those that the books of the cycle are made of, all if not given.
    """
    check_steps(steps)
    _refuse_seats(run)
    method = replace(method or FrictionMethod(), margin_up_to=MARGIN if margin else 0.0)
    steps = steps if run.cycle.duration > 0 else 1
    found = stretch(run, run.cycle.times(steps), method, engine, wanted, progress)
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
    progress: Callable[[int], None] | None = None,
) -> Positions:
    """The same at some times of the cycle, s, in a row and equally spaced; the means are NaN."""
    steps, wanted = len(time), None if wanted is None else needed(wanted, run.system, run.erring)
    names = labels(run.system) | ({"end": ["1", "2"]} if run.seats else {})
    parts = [part for part, there in (("seats", run.seats), ("errors", run.erring)) if there]
    arrays = allocate(run.system, steps, parts, wanted)
    causes = diagnosis.Causes(run.system)
    ideal = {name: np.zeros(arrays[name].shape, arrays[name].dtype) for name in IDEAL} if run.erring else {}
    compiled = compiles(engine, run, steps, method) and _fill_compiled(
        arrays, ideal, run, time, method, causes, engine == "auto"
    )
    for window in blocks(0 if compiled else steps, len(run.system.joints)):
        if run.erring:
            _fill_as_built(arrays, ideal, run, time, window, method, causes)
        else:
            back = run.solve(time[window], method=method)
            fill_chunk(arrays, back, time[window], window, causes)
        if progress:
            progress(window.stop)
    quick = replace(method, margin_up_to=0.0)  # the margin is known by now
    offsets = seating_of(run, method).offsets(time) if run.seats else {}
    resting_joints.bracket(arrays, run, time, quick, causes.zero_slip(), offsets)
    if run.seats:
        contact_loss.find(arrays, seating_of(run, method), time)
    unwrap(arrays, run.system, run.values, time)
    means = still(arrays, run.system.mechanism)
    meant = still(ideal, run.system.mechanism) if run.erring else None
    dial = run.system.dial(run.values, time)
    return Positions(arrays, names, time, dial, method, causes, means, meant)


def _refuse_seats(run: Run) -> None:
    """MechanismError where pins lie in seats of a module that closes with special dimensions only."""
    seated = {seat.joint for seat in run.seats}
    for module in run.system.plan.modules:
        names = [name for name in module.joints if name in seated]
        if module.redundant and names:
            what = f"the links {', '.join(module.links)} are over-constrained: they do not close with seat: loaded"
            remedy = "analyse with --seat free; see `trunnion assemble` for the play that it needs"
            raise MechanismError(Finding(what, f"joints.{names[0]}.seat", remedy))


def _fill_as_built(
    arrays: Arrays,
    ideal: Arrays,
    run: Run,
    time: NDArray[np.float64],
    window: slice,
    method: FrictionMethod,
    causes: diagnosis.Causes,
) -> None:
    """One chunk of a mechanism with errors beside the ideal one."""
    part, quick = time[window], replace(method, margin_up_to=0.0)
    scratch = allocate(run.system, len(part), wanted={*IDEAL, *COMPARED})
    fill_chunk(scratch, run.ideal(part, quick), part, slice(0, len(part)))
    for name, array in ideal.items():
        array[..., window] = scratch[name]
    seating = seating_of(run, method) if run.seats else None
    seated = seating.at(part, method) if seating else None
    back = seated.back if seated else run.solve(part, method=method)
    fill_chunk(arrays, back, part, window, causes)
    if seating and seated:
        causes.note_sticking(np.flatnonzero(seated.sticks) + window.start)
        arrays["seat_rounds"][window], arrays["seat_change"][window] = seated.rounds, seating.change[seated.states]
        arrays["seat_travel"][window] = seated.states == SETTLED
        status = arrays["status"][window]
        np.maximum(status, np.where(seated.sticks, status.dtype.type(Status.ZERO_SLIP), 0), out=status)
    fill_errors(arrays, scratch, link_numbers(run.system), window)
    blank(arrays, arrays["status"][window].astype(np.int8), window)


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
    try:
        own = _kernel(run, run.values, time, arrays, method)
    except MechanismError:
        if or_not:
            return False
        raise
    own.fill(arrays, run.values, time, causes)
    if run.erring:
        _fill_beside_ideal(arrays, ideal, run, time, method)
    return True


def _fill_beside_ideal(
    arrays: Arrays,
    ideal: Arrays,
    run: Run,
    time: NDArray[np.float64],
    method: FrictionMethod,
) -> None:
    """The ideal mechanism at all positions, compiled, and what differs from it."""
    quick, system, everywhere = replace(method, margin_up_to=0.0), run.system, slice(0, len(time))
    meant = allocate(system, len(time), wanted={*IDEAL, *COMPARED})
    _kernel(run, run.ideal_values, time, meant, quick).fill(meant, run.ideal_values, time)
    for name, array in ideal.items():
        array[...] = meant[name]
    fill_errors(arrays, meant, link_numbers(system), everywhere)
    blank(arrays, arrays["status"].astype(np.int8), everywhere)


def _kernel(run: Run, values: Values, time: NDArray[np.float64], arrays: Arrays, method: FrictionMethod) -> CycleKernel:
    """The compiled kernel of some variables, made once for numbers of one kind."""
    read = tuple(name for name, array in arrays.items() if array.strides[-1])
    key = "compiled", values is run.values, method, read
    return run.once(key, lambda: CycleKernel(run, values, time, arrays, method))
