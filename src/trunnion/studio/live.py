"""Where the points of a mechanism are over its cycle; motion, forces and locking margin while the hand changes its
numbers, many times a second; small pictures of the examples.

What does not change from answer to answer, as the positions before the drag, is worked out once for a text. Of many
joints the forces are those of the position that is shown: those of a whole cycle take longer than a hand waits.
"""

from __future__ import annotations

import gc
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import lru_cache, partial
from math import cos, radians, sin
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import flat
from trunnion.errors import MechanismError, Status
from trunnion.solve.backward import Backward, status_of
from trunnion.solve.forward import Forward
from trunnion.solve.margin import least_beside, margin_for_sure, margin_in
from trunnion.solve.run import Run, prepare
from trunnion.solve.system import Values, rubbing
from trunnion.studio.loaded import Asked, Loaded, loaded
from trunnion.studio.sketch import refused

Array = NDArray[np.float64]

AT_ONCE = 12_000  # joints times positions whose forces are worked out in the time of a picture
MOST_TRACKED = 6_000  # places of all tracks that are drawn in it: the page writes each as text
MOST_FOLLOWED = 16  # contacts whose friction is followed until they lock: the time grows with their cube
NEAR = 3.0  # multiple of the friction up to which the margin is looked for: farther it takes longer than the forces
SMALL_STEPS = 60  # of a small picture
SHOWN = 8  # position of them that is drawn: at the start many mechanisms lie in line
TURNED, TILTED = radians(35), radians(25)  # of its view of mechanisms in space, in which z is up


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


# ---- where points are -----------------------------------------------------------------------------------------------


@lru_cache(maxsize=4)
@np.errstate(all="ignore")
def tracked(state: Loaded, steps: int) -> dict[str, dict[str, Array]]:
    """Tracks of a model's points; MechanismError where its structure does not determine them."""
    return tracks(state.run.posed(state.run.cycle.times(steps), state.run.values), steps)


def columns(numbers: Sequence[Any], steps: int) -> Array:
    """Numbers of a walk at every position, (number, position): a call for each takes longer than all of them."""
    table = np.empty((len(numbers), steps))
    for row, number in zip(table, numbers, strict=True):
        row[:] = primal(number)
    return table


def tracks(walk: Forward, steps: int, points: Iterable[tuple[str, str]] | None = None) -> dict[str, dict[str, Array]]:
    """Where points (link, name) are over the positions of a walk, m, by "link.name"; all if none are named."""
    points = list(walk.system.points if points is None else points)
    order = {link: k for k, link in enumerate(dict.fromkeys(link for link, _ in points))}
    numbers = columns([number for link in order for number in flat(walk.frames[link])], steps)
    frames = numbers.reshape(len(order), -1, steps).swapaxes(0, 1)
    if walk.system.spatial:
        axes, origin = frames[:9].reshape(3, 3, len(order), steps), frames[9:]
    else:
        x, y, c, s = frames
        axes, origin = np.array([[c, s], [-s, c]]), np.array([x, y])
    of = [order[link] for link, _ in points]
    local = np.array([walk.local_place(link, name) for link, name in points], float).reshape(len(of), -1).T
    places = origin[:, of] + sum(part[:, None] * axis[:, of] for part, axis in zip(local, axes, strict=True))
    return {f"{link}.{name}": dict(zip(walk.system.axes, place, strict=True))
            for (link, name), place in zip(points, places.swapaxes(0, 1), strict=True)}  # fmt: skip


def places_at(question: Asked) -> dict[str, complex]:
    """Where the points of a model are at the position that is shown, m; MechanismError where it has no answer."""
    if question.state.run.system.spatial:
        raise refused("is dragged in space by steps along its axes", "", "state by how much")
    paths, index = tracked(question.state, question.steps), question.index
    places = {key: complex(track["x"][index], track["y"][index]) for key, track in paths.items()}
    if not np.all(np.isfinite(list(places.values()))):
        raise refused("cannot be assembled at the position that is shown", "", "go to another position")
    return places


# ---- while numbers change -------------------------------------------------------------------------------------------


class Live:
    """A mechanism in the plane while its numbers are changed.

    Parameters
    ----------
    run : the mechanism as it is stated.
    values : numbers that are replaced, SI, by path.
    steps : positions of its cycle.
    """

    def __init__(self, run: Run, values: Mapping[str, float], steps: int) -> None:
        self.run, self.steps = run, steps
        self.numbers = run.system.mechanism.parameters(values) if values else run.values
        self.time = np.asarray(run.cycle.times(steps))
        self.few = len(run.system.joints) * steps <= AT_ONCE  # all are solved in time; else the shown position alone
        self._backs: dict[int, Backward] = {}

    def solved(self, index: int) -> Backward:
        """Motion and forces of all positions, of many joints those of one position."""
        key = 0 if self.few else index
        if key not in self._backs:
            self._backs[key] = self.run.solve(self.time if self.few else self.time[[index]], self.numbers)
        return self._backs[key]

    @np.errstate(all="ignore")
    def nearest(self, link: str, point: str, to: complex, index: int, slack: float) -> int:
        """Position at which a point of a link is nearest to a place, m: `index` unless another is nearer by `slack`."""

        def distances(walk: Forward) -> Array:
            track = tracks(walk, len(walk.time), [(link, point)])[f"{link}.{point}"]
            return np.hypot(track["x"] - to.real, track["y"] - to.imag)

        far = distances(self.solved(index).walk)
        if len(far) < self.steps:
            if far[0] <= slack:
                return index
            far = distances(self.run.posed(self.time, self.numbers))
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
            Of all positions, or of the shown one alone with `tracks`, thinned, of what moves: points: x, y, m, of each
            "link.point"; angles: of the links, rad; status: of the positions; efforts: of the drivers, N m or N;
            joints: of each the reaction, x and y, N, friction_power, W, and friction along a slide, N. Forces are NaN
            where a position is not solved. margin: the locking margin at the shown one, `value` None where it has none,
            and whether it is `beyond` that.
        """
        back, steps = self.solved(index), self.steps if self.few else 1
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
        sines, cosines = (columns([getattr(frame, part) for frame in walk.frames.values()], steps) for part in "sc")
        lanes = np.arange(self.steps) == index if self.few else np.True_
        here = int(status[index if self.few else 0])
        moving = {}
        if not self.few:  # where each joint and each free point goes that moves, at as many positions as can be drawn
            ground = system.mechanism.fixed_link
            still = {name for name, joint in system.joints.items() if ground in joint.links and system.turns(name)}
            ends = {(joint.links[1], name) for name, joint in system.joints.items() if name not in still}
            ends |= {(link, name) for link, name in system.points if link != ground and name not in system.joints}
            time = self.time[:: -(-len(ends) * self.steps // MOST_TRACKED)]
            moving = {"tracks": tracks(self.run.posed(time, self.numbers), len(time), ends)}
        return {
            "points": tracks(walk, steps),
            "angles": dict(zip(walk.frames, np.arctan2(sines, cosines), strict=True)),
            "status": [int(code) for code in status],
            "efforts": joints.pop(""),
            "joints": joints,
            **moving,
            "margin": _margin(self.run, self.numbers, back, here, self.time[index], lanes),
        }


@np.errstate(all="ignore")
def live_in_space(run: Run, values: Mapping[str, float], steps: int, index: int) -> dict[str, Any]:
    """A mechanism in space with some numbers replaced: its scene, for bodies change with numbers, and its margin."""
    from trunnion.cycle.positions import positions  # not for the first picture
    from trunnion.cycle.summary import result_of
    from trunnion.views.scene import scene

    changed = prepare(run.system.mechanism.with_values(values)) if values else run
    times = changed.cycle.times(steps)
    result = result_of(changed, positions(changed, steps, averaged=False, margin=False)).dataset
    status, back = [int(code) for code in result["status"].values], changed.solve(times[[index]])
    margin = _margin(changed, changed.values, back, status[index], float(times[index]), np.True_)
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


# ---- small pictures of the examples -----------------------------------------------------------------------------


@lru_cache(maxsize=128)
def thumbnail(text: str) -> dict[str, Any]:
    """Links with their points at one position, and paths, in a plane, m; none of a model not placed.

    Of mechanisms in space a parallel projection.
    """
    state, places = loaded(text), dict[str, Array]()
    try:
        for key, (x, y, *z) in ((key, track.values()) for key, track in tracked(state, SMALL_STEPS).items()):
            places[key] = np.array([x, y])
            if z:  # seen from the side and from above
                across, depth = cos(TURNED) * x + sin(TURNED) * y, cos(TURNED) * y - sin(TURNED) * x
                places[key] = np.array([across, cos(TILTED) * z[0] + sin(TILTED) * depth])
    except MechanismError:
        pass
    complete = np.all([np.isfinite(track).all(axis=0) for track in places.values()], axis=0) if places else [False]
    if not np.any(complete):
        return {"links": [], "paths": []}
    reached, ground = np.flatnonzero(complete), state.run.system.mechanism.fixed_link
    index = reached[min(SHOWN, len(reached) - 1)]
    links: dict[str, list[list[float]]] = {}
    for key, track in places.items():
        links.setdefault(key.rpartition(".")[0], []).append([float(part) for part in track[:, index]])
    moved = [track[:, reached] for key, track in places.items() if key.rpartition(".")[0] != ground]
    return {
        "links": [{"ground": link == ground, "points": points} for link, points in links.items()],
        "paths": [{"x": x, "y": y} for x, y in moved if np.ptp(x) + np.ptp(y) > 0],
    }  # fmt: skip
