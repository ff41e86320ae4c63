"""A mechanism while the hand changes its numbers: motion, forces and locking margin, many times a second.

What does not change from answer to answer, as the positions before the drag, is worked out once for a text. Of many
joints the forces are those of the position that is shown: those of a whole cycle take longer than a hand waits.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Status
from trunnion.solve.backward import Backward
from trunnion.solve.forward import Forward
from trunnion.solve.margin import least_beside, margin_for_sure, margin_in
from trunnion.solve.run import Run, prepare
from trunnion.solve.status import status_of
from trunnion.solve.system import Values, rubbing
from trunnion.studio.loaded import Asked
from trunnion.studio.placed import columns, tracked, tracks
from trunnion.studio.sketch import Vector

__all__ = ["Live", "live_columns", "live_in_space", "places_at", "uncollected"]

Array = NDArray[np.float64]

AT_ONCE = 12_000  # joints times positions whose forces are worked out in the time of a picture
MOST_TRACKED = 6_000  # places of all tracks that are drawn in it: the page writes each as text
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
    _backs: dict[int, Backward] = field(default_factory=dict)

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

    @property
    def few(self) -> bool:
        """Whether all positions are solved in the time of a picture; else the shown one alone is."""
        return len(self.run.system.joints) * self.steps <= AT_ONCE

    def solved(self, index: int) -> Backward:
        """Motion and forces of all positions, of many joints those of one position."""
        key = 0 if self.few else index
        if key not in self._backs:
            self._backs[key] = self.run.solve(self.time if self.few else self.time[[index]], self.numbers)
        return self._backs[key]

    @np.errstate(all="ignore")
    def nearest(self, link: str, point: str, to: Vector, index: int, slack: float) -> int:
        """Position at which a point of a link is nearest to a place, m: `index` unless another is nearer by `slack`."""
        far = _far(self.solved(index).walk, link, point, to)
        if len(far) < self.steps:
            if far[0] <= slack:
                return index
            far = _far(self.run.posed(self.time, self.numbers), link, point, to)
        if not np.any(np.isfinite(far)):
            return index
        near = int(np.nanargmin(far))
        return index if far[index] <= far[near] + slack else near

    @np.errstate(all="ignore")
    def told(self, index: int) -> dict[str, Any]:
        """What the page draws and tells of it, with forces at a position at least.

        Returns
        -------
        dict
            The columns of `live_columns`, of all positions or of the shown one alone; then with `tracks`, thinned, of
            what moves. margin: the locking margin at the shown one, `value` None where it has none, and whether it is
            `beyond` that.
        """
        back, lanes = self.solved(index), np.arange(self.steps) == index
        columns = live_columns(back, self.steps if self.few else 1)
        status = columns["status"]
        if not self.few:
            columns["tracks"], lanes = self._tracks(), np.True_
        here = status[index if self.few else 0]
        return columns | {"margin": _margin(self.run, self.numbers, back, here, self.time[index], lanes)}

    def _tracks(self) -> dict[str, dict[str, Array]]:
        """Where each joint and each free point goes that moves, at as many positions as can be drawn in time."""
        system, ground = self.run.system, self.run.system.mechanism.fixed_link
        still = {name for name, (_, links) in system.joints.items() if ground in links and system.turns(name)}
        joints = {(links[1], name) for name, (_, links) in system.joints.items() if name not in still}
        free = {(link, name) for link, name in system.points if link != ground and name not in system.joints}
        time = self.time[:: -(-len(joints | free) * self.steps // MOST_TRACKED)]
        return tracks(self.run.posed(time, self.numbers), len(time), joints | free)


def live_in_space(run: Run, values: Mapping[str, float], steps: int, index: int) -> dict[str, Any]:
    """A mechanism in space with some numbers replaced: its scene, for bodies change with numbers, and its margin."""
    from trunnion.cycle.positions import positions  # not for the first picture
    from trunnion.cycle.summary import result_of
    from trunnion.views.scene import scene

    changed = prepare(run.system.mechanism.with_values(values)) if values else run
    with np.errstate(all="ignore"):
        result = result_of(changed, positions(changed, steps, averaged=False, margin=False)).dataset
        back = changed.solve(changed.cycle.times(steps)[[index]])
        status = [int(code) for code in result["status"].values]
        here, time = status[index], float(changed.cycle.times(steps)[index])
        margin = _margin(changed, changed.values, back, here, time, np.True_)
    return {"scene": scene(result, max_positions=steps), "status": status, "margin": margin}


@np.errstate(all="ignore")
def _margin(run: Run, numbers: Values, back: Backward, status: int, time: float, lanes: Any) -> dict[str, Any]:
    """The locking margin at a position, looked for up to NEAR. lanes: where the forces have the position.

    Of many contacts it is a multiple that the margin is more than.
    """
    if status > Status.LOCKED:
        return {"value": None, "beyond": False}
    many = sum(map(run.system.resting, rubbing(run.system))) > MOST_FOLLOWED
    if status == Status.ZERO_SLIP and run.cycle.duration > 0:
        figure = partial(margin_for_sure if many else margin_in, most=NEAR)
        beside = least_beside(figure, lambda at: run.solve(at, numbers), np.array([time]), run.cycle)
        margin = float(beside[0])
    else:
        margins = margin_for_sure(back, NEAR) if many else margin_in(back, NEAR, lanes)
        every = np.broadcast_to(np.asarray(margins, float), np.shape(back.walk.time))
        margin = float(every[np.flatnonzero(lanes)[0]])
    if np.isnan(margin):
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
        drivers, N m or N; joints: of each the reaction, x and y, N, friction_power, W, and friction along a slide, N.
        Forces are NaN where a position is not solved.
    """
    walk, system = back.walk, back.walk.system
    status = status_of(back, (steps,))
    numbers = {("", name): effort for name, effort in back.efforts.items()}
    for name in system.joints:
        numbers |= dict(zip(((name, "x"), (name, "y")), tuple(back.reactions[name])[:2], strict=True))
        numbers[name, "friction_power"] = back.losses[name]
        if not system.turns(name):
            numbers[name, "friction"] = back.friction[name]
    rows = columns(list(numbers.values()), steps)
    rows[:, status >= Status.NOT_CONVERGED] = np.nan
    joints: dict[str, dict[str, Array]] = {name: {} for name in ("", *system.joints)}
    for (name, part), row in zip(numbers, rows, strict=True):
        joints[name][part] = row
    efforts = joints.pop("")
    angles = np.arctan2(*(columns([getattr(frame, part) for frame in walk.frames.values()], steps) for part in "sc"))
    return {
        "points": tracks(walk, steps),
        "angles": dict(zip(walk.frames, angles, strict=True)),
        "status": [int(code) for code in status],
        "efforts": efforts,
        "joints": joints,
    }


def _far(walk: Forward, link: str, point: str, to: Vector) -> Array:
    """Distance of a point of a link from a place at each position, m."""
    track = tracks(walk, len(walk.time), [(link, point)])[f"{link}.{point}"]
    return np.hypot(track["x"] - to[0], track["y"] - to[1])
