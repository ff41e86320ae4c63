"""A mechanism while the hand changes its numbers: motion, forces and locking margin, many times a second.

What does not change from answer to answer, as the positions before the drag, is worked out once for a text. Of many
joints the forces are those of the position that is shown: those of a whole cycle take longer than a hand waits.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.errors import Finding, MechanismError, Status
from trunnion.solve.backward import Backward
from trunnion.solve.forward import Forward
from trunnion.solve.margin import least_beside, margin_for_sure, margin_in
from trunnion.solve.run import Run, prepare
from trunnion.solve.status import pose_status, status_of
from trunnion.solve.system import Values
from trunnion.studio.loaded import Asked
from trunnion.studio.placed import tracked

__all__ = ["Live", "live_columns", "live_in_space", "places_at", "uncollected"]

Array = NDArray[np.float64]

AT_ONCE = 12_000  # joints times positions whose forces are worked out in the time of a picture
MOST_TRACKED = 6_000  # places of all tracks that are drawn in it: the page writes each as text
STILL = 1e-9  # of the size: a point that moves less has no track
MOST_FOLLOWED = 16  # contacts whose friction is followed until they lock: the time grows with their cube
NEAR = 3.0  # multiple of the friction up to which the margin is looked for: farther it takes longer than the forces


@contextmanager
def uncollected() -> Iterator[None]:
    """Without looking for rubbish in circles: what an answer makes would count as what stays, and all be searched."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def places_at(question: Asked) -> dict[str, tuple[float, float]]:
    """Where the points of a model are at the position that is shown, m; MechanismError where it has no answer."""
    _refuse_space(question.state.run)
    paths, index = tracked(question.state, question.steps), question.index
    places = {key: (float(track["x"][index]), float(track["y"][index])) for key, track in paths.items()}
    if not np.all(np.isfinite(list(places.values()))):
        what = "cannot be assembled at the position that is shown"
        raise MechanismError(Finding(what, remedy="go to another position"))
    return places


@dataclass(frozen=True, eq=False)
class Live:
    """A mechanism in the plane while its numbers are changed.

    Parameters
    ----------
    run
        The mechanism as it is stated.
    values
        Numbers that are replaced, SI, by path.
    steps
        Positions of its cycle.
    """

    run: Run
    values: Mapping[str, float]
    steps: int

    def __post_init__(self) -> None:
        _refuse_space(self.run)

    @cached_property
    def time(self) -> Array:
        """Of the positions, s."""
        return np.asarray(self.run.cycle.times(self.steps))

    @cached_property
    def numbers(self) -> Values:
        """All numbers, the replaced ones among them."""
        return self.run.system.mechanism.parameters(self.values) if self.values else self.run.values

    @cached_property
    def _cycle(self) -> Backward | None:
        """Motion and forces of all positions, None of many joints."""
        few = len(self.run.system.joints) * self.steps <= AT_ONCE
        return self.run.solve(self.time, self.numbers) if few else None

    @cached_property
    @np.errstate(all="ignore")
    def walk(self) -> Forward:
        """Its motion over the cycle; of many joints the places alone."""
        cycle = self._cycle
        return cycle.walk if cycle else self.run.posed(self.time, self.numbers)

    @cached_property
    def tracks(self) -> dict[str, Array]:
        """Where every point "link.point" goes, (2, position), m."""
        return _places(self.walk, self.steps)

    @np.errstate(all="ignore")
    def told(self, index: int) -> dict[str, Any]:
        """What the page draws and tells of it, with forces at a position at least.

        Returns
        -------
        dict
            The columns of `live_columns`, of all positions or of the shown one alone; then with `tracks`, thinned, of
            what moves. status: of all positions; margin: the locking margin at the shown one, `value` None where it has
            none, and whether it is `beyond` that.
        """
        back = self._cycle
        if back is None:
            back = self.run.solve(self.time[[index]], self.numbers)
            columns = live_columns(back, 1)
            status = pose_status(self.walk, (self.steps,))
            status[index] = columns["status"][0]
            columns |= {"tracks": self._drawn(), "status": [int(code) for code in status]}
            return columns | {"margin": _margin(self.run, self.numbers, back, columns["status"], index, np.True_)}
        columns, lanes = live_columns(back, self.steps), np.arange(self.steps) == index
        return columns | {"margin": _margin(self.run, self.numbers, back, columns["status"], index, lanes)}

    def _drawn(self) -> dict[str, dict[str, Array]]:
        """Where each joint and each free point goes that moves, at as many positions as can be drawn in time."""
        system = self.run.system
        joints = {f"{links[1]}.{name}" for name, (_, links) in system.joints.items()}
        keys = [key for key in self.tracks if key in joints or key.partition(".")[2] not in system.joints]
        places = np.array([self.tracks[key] for key in keys])  # (point, axis, position)
        reach = np.fmax.reduce(np.fmax.reduce(places, axis=2) - np.fmin.reduce(places, axis=2), axis=1)
        moving = np.flatnonzero(reach > STILL * np.fmax.reduce(reach))
        stride = -(-len(moving) * self.steps // MOST_TRACKED)
        return {keys[k]: dict(zip("xy", places[k, :, ::stride], strict=True)) for k in moving}


def live_in_space(run: Run, values: Mapping[str, float], steps: int, index: int) -> dict[str, Any]:
    """A mechanism in space with some numbers replaced: its scene, for bodies change with numbers, and its margin."""
    from trunnion.cycle.positions import positions  # not for the first picture
    from trunnion.cycle.summary import result_of
    from trunnion.views.cycle.scene import scene

    changed = prepare(run.system.mechanism.with_values(values)) if values else run
    with np.errstate(all="ignore"):
        result = result_of(changed, positions(changed, steps, averaged=False, margin=False)).dataset
        back = changed.solve(changed.cycle.times(steps)[[index]])
        status = [int(code) for code in result["status"].values]
        margin = _margin(changed, changed.values, back, status, index, np.True_)
    return {"scene": scene(result, max_positions=steps), "status": status, "margin": margin}


@np.errstate(all="ignore")
def _margin(run: Run, numbers: Values, back: Backward, status: Sequence[int], index: int, lanes: Any) -> dict[str, Any]:
    """The locking margin at a position, looked for up to NEAR. lanes: where the forces have the position.

    Of many contacts it is a multiple that the margin is more than.
    """
    many = sum(map(len, back.rubbed)) > MOST_FOLLOWED
    time = run.cycle.times(len(status))[[index]]
    if status[index] == Status.ZERO_SLIP and run.cycle.duration > 0:
        figure = partial(margin_for_sure if many else margin_in, most=NEAR)
        margin = float(least_beside(figure, lambda at: run.solve(at, numbers), time, run.cycle)[0])
    else:
        margins = margin_for_sure(back, NEAR) if many else margin_in(back, NEAR, lanes)
        every = np.broadcast_to(np.asarray(margins, float), np.shape(back.walk.time))
        margin = float(every[index if np.ndim(lanes) else 0])
    if status[index] > Status.LOCKED or np.isnan(margin):
        return {"value": None, "beyond": False}
    return {"value": min(margin, NEAR), "beyond": many or margin > NEAR}


def _refuse_space(run: Run) -> None:
    if run.system.spatial:
        raise MechanismError(Finding("is dragged in space by steps along its axes", remedy="state by how much"))


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
    numbers = {("effort", name): effort for name, effort in back.efforts.items()}
    for name in system.joints:
        numbers |= dict(zip(((name, "x"), (name, "y")), tuple(back.reactions[name])[:2], strict=True))
        numbers[name, "loss"], numbers[name, "friction"] = back.losses[name], back.friction[name]
    rows = _rows(list(numbers.values()), steps)
    rows[:, status >= Status.NOT_CONVERGED] = np.nan
    force = dict(zip(numbers, rows, strict=True))
    joints = {}
    for name in system.joints:
        reaction = {axis: force[name, axis] for axis in "xy"}
        joints[name] = {"reaction": reaction, "friction_power": force[name, "loss"]}
        if not system.turns(name):
            joints[name]["friction"] = force[name, "friction"]
    frames = [motion.frame for motion in walk.motions.values()]
    angles = np.arctan2(*(_rows([getattr(frame, part) for frame in frames], steps) for part in "sc"))
    return {
        "points": {key: dict(zip("xy", place, strict=True)) for key, place in _places(walk, steps).items()},
        "angles": dict(zip(walk.motions, angles, strict=True)),
        "status": [int(code) for code in status],
        "efforts": {name: force["effort", name] for name in back.efforts},
        "joints": joints,
    }


def _rows(numbers: Sequence[Any], steps: int) -> Array:
    """Numbers of a walk at every position, (number, position): a call for each takes longer than all of them."""
    table = np.empty((len(numbers), steps))
    for row, number in zip(table, numbers, strict=True):
        row[:] = primal(number)
    return table


def _places(walk: Forward, steps: int) -> dict[str, Array]:
    """Where every point "link.point" is, (2, position), m."""
    order = {link: k for k, link in enumerate(walk.motions)}
    frames = [motion.frame for motion in walk.motions.values()]
    x, y, c, s = (_rows([getattr(frame, part) for frame in frames], steps) for part in "xycs")
    of = [order[link] for link, _ in walk.system.points]
    u, v = np.array([walk.local_place(link, name) for link, name in walk.system.points], float).T[:, :, None]
    places = np.stack([x[of] + c[of] * u - s[of] * v, y[of] + s[of] * u + c[of] * v], axis=1)
    return {f"{link}.{name}": place for (link, name), place in zip(walk.system.points, places, strict=True)}
