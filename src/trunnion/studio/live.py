"""A mechanism while the hand changes its numbers: motion, forces and locking margin, many times a second.

What does not change from answer to answer, as the positions before the drag, is worked out once for a text.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.solve.backward import Backward
from trunnion.solve.margin import least_beside, margin_in
from trunnion.solve.run import Run
from trunnion.solve.status import status_of
from trunnion.studio.loaded import Asked
from trunnion.studio.placed import column, tracked, tracks

__all__ = ["live_columns", "live_margin", "places_at", "solved_with"]

Array = NDArray[np.float64]

NEAR = 3.0  # multiple of the friction up to which the margin is looked for: farther it takes longer than the forces


def places_at(asked: Asked) -> dict[str, tuple[float, float]]:
    """Where the points of a model are at the position that is shown, m; MechanismError where it has no answer."""
    _refuse_space(asked.state.run)
    paths, index = tracked(asked.state, asked.steps), asked.index
    places = {key: (float(track["x"][index]), float(track["y"][index])) for key, track in paths.items()}
    if not np.all(np.isfinite(list(places.values()))):
        what = "cannot be assembled at the position that is shown"
        raise MechanismError(Finding(what, remedy="go to another position"))
    return places


@np.errstate(all="ignore")
def solved_with(run: Run, values: Mapping[str, float], steps: int) -> Backward:
    """Motion and forces of a mechanism in the plane over its cycle, with some numbers replaced."""
    _refuse_space(run)
    time = run.cycle.times(steps)
    return run.solve(time, run.system.mechanism.parameters(values)) if values else run.solve(time)


def _refuse_space(run: Run) -> None:
    if run.system.mechanism.space != "planar":
        raise MechanismError(Finding("cannot be dragged in space", remedy="change its numbers instead"))


@np.errstate(all="ignore")
def live_columns(back: Backward, steps: int) -> dict[str, Any]:
    """Return what the page draws and tells of a mechanism that is being changed.

    Returns
    -------
    dict
        points: x, y, m, of each "link.point"; angles: of the links, rad; status: of the positions; efforts: of the
        drivers, N m or N; joints: the series of each that a scene of the page has: reaction, N, friction along a
        slide, N, and friction_power, W. Forces are NaN where a position is not solved.
    """
    walk, system = back.walk, back.walk.system
    status = status_of(back, (steps,))
    known = status < Status.NOT_CONVERGED

    def force(number: Any) -> Array:
        return np.where(known, column(number, steps), np.nan)

    joints = {}
    for name in system.joints:
        reaction = dict(zip("xy", map(force, tuple(back.reactions[name])[:2]), strict=True))
        joints[name] = {"reaction": reaction, "friction_power": force(back.losses[name])}
        if not system.turns(name):
            joints[name]["friction"] = force(back.friction[name])
    return {
        "points": tracks(walk, steps),
        "angles": {
            link: column(np.arctan2(motion.frame.s, motion.frame.c), steps) for link, motion in walk.motions.items()
        },
        "status": [int(code) for code in status],
        "efforts": {name: force(effort) for name, effort in back.efforts.items()},
        "joints": joints,
    }


@np.errstate(all="ignore")
def live_margin(
    back: Backward, run: Run, values: Mapping[str, float], status: Sequence[int], index: int
) -> dict[str, Any]:
    """The locking margin of one position, where it has one, and whether it is beyond that.

    run, values: what was solved, and with which numbers replaced; status: of all positions.
    """
    steps = len(status)
    if status[index] == Status.ZERO_SLIP and run.cycle.duration > 0:
        numbers = run.system.mechanism.parameters(values)
        time = run.cycle.times(steps)[[index]]
        figure, solve = partial(margin_in, most=NEAR), lambda at: run.solve(at, numbers)
        margin = float(least_beside(figure, solve, time, run.cycle)[0])
    else:
        every = np.broadcast_to(np.asarray(margin_in(back, NEAR, np.arange(steps) == index), float), (steps,))
        margin = float(every[index])
    if status[index] > Status.LOCKED or np.isnan(margin):
        return {"value": None, "beyond": False}
    return {"value": min(margin, NEAR), "beyond": margin > NEAR}
