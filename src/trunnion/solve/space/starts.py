"""Poses to start from where a loop does not close: those of the mechanism without errors, or where it is open least."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.groups.redundant import RANK
from trunnion.results.sentences import finding_for
from trunnion.solve.assembly import Chosen, choose, distance
from trunnion.solve.forward import forward, start
from trunnion.solve.space.determinacy import look
from trunnion.solve.space.loops import Loops
from trunnion.solve.system import Cycle, System, Values
from trunnion.solve.track import GUESSES, SEED, guess_reaches

__all__ = ["Start", "start_of"]

Array = NDArray[np.float64]
NEARLY = 0.05  # rad, or of the size: an assembly open by more is none
FOLLOWED = 180  # positions of a cycle through which the one that is open least is followed
JUMP = 0.5  # rad, or of the size: farther from one of them to the next it is another assembly


Start = Callable[[Array], Array]  # coordinates (lane, kept) near those of the closed loops at times, s, or NaN


def _ideal(system: System, values: Values, chosen: Chosen) -> Start:
    """Those of the mechanism without errors, which closes."""

    def coordinates(time: Array) -> Array:
        pose = forward(system, values, chosen.assembly, time).poses[0]
        return np.stack([np.broadcast_to(pose.q[i], time.shape) for i in system.groups[0].kept], axis=-1)

    return coordinates


def start_of(system: System, values: Values, ideal: Values, cycle: Cycle) -> tuple[Start, list[Finding]]:
    """Where to start from, and what there is to say of it.

    Raises MechanismError where the mechanism leaves a freedom undetermined, or is nowhere even nearly closed.
    """
    chosen = choose(system, ideal, cycle)
    wrong = [error for error in look(system, ideal, chosen, cycle).findings() if error.where == "drivers"]
    if wrong:
        raise MechanismError(wrong)
    if chosen.found[0]:
        return _ideal(system, ideal, chosen), list(chosen.findings)
    nearly = _followed(system, values, cycle)
    misfit = finding_for("assembly.misfit", "links")
    if nearly is None:
        what = f"{misfit.what}: the loops are not nearly closed at any position"
        raise MechanismError(Finding(what, "links", "check the lengths"))
    return nearly, [misfit]


def _followed(system: System, values: Values, cycle: Cycle) -> Start | None:
    """A mechanism that closes nowhere, along the poses in which it is open least.

    From the first position at which an assembly is nearly closed on, and back: that nearest the hints.
    """
    time = np.linspace(0.0, cycle.duration, FOLLOWED + 1 if cycle.duration else 1)
    loops = Loops.of(system, values, (), time)
    rows = np.full((len(time), len(loops.group.kept)), np.nan)
    for begin in sorted({int(i) for i in np.linspace(0, len(time) - 1, 13)}):
        first = _nearest(system, values, loops.at(np.full(GUESSES, begin)))
        if first is not None:
            break
    else:
        return None
    for order in (range(begin, len(time)), range(begin, -1, -1)):
        q = first
        for place in order:
            coordinates_, gap = loops.at(np.array([place])).least_open(q[None], np.zeros((1, 0)))
            if not gap[0] <= NEARLY or not np.max(np.abs(coordinates_[0] - q)) <= JUMP:
                break
            rows[place] = q = coordinates_[0]

    def coordinates(at: Array) -> Array:
        moment = np.mod(at, time[-1]) if cycle.periodic and time[-1] else np.asarray(at)
        return np.asarray(rows[np.argmin(np.abs(moment[:, None] - time), axis=1)])

    return coordinates


def _nearest(system: System, values: Values, loops: Loops) -> Array | None:
    """Coordinates of the assembly nearest the hints at one position, from many guesses; None if none nearly closes."""
    rng = np.random.default_rng(SEED)
    guesses = [rng.uniform(-reach, reach, GUESSES) for reach in guess_reaches(loops.group, loops.size)]
    none = np.zeros((GUESSES, 0))
    with np.errstate(all="ignore"):
        q, gap = loops.least_open(np.stack(guesses, axis=-1), none)
    good = np.flatnonzero(gap <= NEARLY)
    if not len(good):
        return None
    part = loops.at(good)
    singular = np.linalg.svd(part.linear(q[good], none[good]).jacobian, compute_uv=False)
    if loops.group.free and np.all(singular[:, -1] <= RANK * singular[:, 0]):
        what = "the joints leave a freedom undetermined"
        raise MechanismError(Finding(what, "drivers", "add a driver, or joints to these links"))
    far = distance(start(system, values), system.plan.modules[0], part.frames(q[good], none[good]))
    order = np.lexsort((gap[good], np.round(np.broadcast_to(far, good.shape) / loops.size**2, 6)))
    return np.asarray(q[good[order[0]]])
