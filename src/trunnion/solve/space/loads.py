"""What acts on the links in space beside gravity and inertia: the loads of the model and its springs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.space import Screw, about, power, rotated, times, vector_minus
from trunnion.algebra.vector import Vector3, dot, scaled
from trunnion.model.parts import Load
from trunnion.solve.backward import ZERO_SLIP
from trunnion.solve.loads import Share, SpringState, Stated, spring_state
from trunnion.solve.space.motion import SpatialPoint, SpatialWalk

__all__ = ["SpatialAction", "springs", "stated_loads"]

NULL: Vector3 = (0.0, 0.0, 0.0)


class SpatialAction(NamedTuple):
    """What one load or spring does: wrenches on links about the origin, and the power it gives, W."""

    on: list[tuple[str, Screw]]
    power: Number

    @property
    def undefined(self) -> Number:
        """Where it has no value."""
        size: Number = 0.0
        for _, wrench in self.on:
            for number in (*wrench.u, *wrench.m):
                size = size + primal(number)
        return ~np.isfinite(size)


def stated_loads(walk: SpatialWalk, zero_slip: Mapping[str, Share]) -> Iterator[tuple[str, SpatialAction]]:
    """The loads of the model, by name. zero_slip: see `kinetostatics.Given`."""
    stated = Stated(walk)
    for name, load in walk.system.mechanism.loads.items():
        path = f"loads.{name}"
        if load.joint is None:
            yield name, _push(walk, stated, load, path)
        else:
            torque, force = stated.get(f"{path}.resisting_torque"), stated.get(f"{path}.resisting_force")
            size = force if torque is None else torque
            yield name, _resist(walk, load, size, torque is not None, zero_slip.get(load.joint, 0.0))


def _vector(stated: Stated, path: str) -> Vector3 | None:
    x, y, z = (stated.get(f"{path}.{axis}") for axis in "xyz")
    return None if x is None or y is None or z is None else (x, y, z)


def _push(walk: SpatialWalk, stated: Stated, load: Load, path: str) -> SpatialAction:
    """A force at a point of a link and a moment, in global axes or the link's."""
    link = load.link or ""
    frame, twist, _ = walk.motions[link]
    force, moment = _vector(stated, f"{path}.force") or NULL, _vector(stated, f"{path}.moment") or NULL
    if load.frame == "link":
        force, moment = rotated(frame, force), rotated(frame, moment)
    place = walk.point(link, load.at).place if load.at else frame.place
    wrench = about(force, moment, place)
    return SpatialAction([(link, wrench)], power(wrench, twist))


def _resist(walk: SpatialWalk, load: Load, size: Number, turns: bool, at_rest: Share) -> SpatialAction:
    """A torque or force that opposes the motion of a joint, whichever way it goes or one way only."""
    joint = load.joint or ""
    speed = walk.rates(joint)[0 if turns else 1]
    pace = walk.pace
    scale = ZERO_SLIP * pace * (1.0 if turns else walk.size)
    sign = np.where(np.abs(primal(speed)) <= scale, at_rest, np.sign(primal(speed)))
    if load.only is not None:
        sign = np.where(sign * (1.0 if load.only == "positive" else -1.0) > 0.0, sign, 0.0)
    return _in_joint(walk, joint, -sign * size, turns, speed)


def _in_joint(walk: SpatialWalk, joint: str, effort: Number, turns: bool, speed: Number) -> SpatialAction:
    """An effort in the freedom of a joint, on its second link by its first: N m about its axis, or N along it."""
    first, second = walk.system.joints[joint][1]
    element = walk.element(second, joint)
    along = scaled(effort, element.z)
    wrench = Screw(NULL, along) if turns else about(along, NULL, element.place)
    return SpatialAction([(second, wrench), (first, times(-1.0, wrench))], effort * speed)


def springs(walk: SpatialWalk) -> Iterator[tuple[str, SpatialAction, SpringState]]:
    """The springs and dampers of the model: pull = preload + stiffness · elongation + damping · rate."""
    for name, spring in walk.system.mechanism.springs.items():
        path = f"springs.{name}"
        if spring.between is not None:
            yield name, *_line(walk, path, spring.between, spring.only)
            continue
        joint = spring.joint or ""
        turns = walk.system.turns(joint)
        elongation = _elongation(walk, path, joint, turns)
        speed = walk.rates(joint)[0 if turns else 1]
        state = spring_state(walk, path, elongation, speed, spring.only)
        yield name, _in_joint(walk, joint, -state.force, turns, speed), state


def _elongation(walk: SpatialWalk, path: str, joint: str, turns: bool) -> Number:
    """Turn or slide of a joint beyond the free one; whole turns count where it is driven, else the nearest is meant."""
    if not turns:
        return walk.coordinates(joint)[1] - walk.values.get(f"{path}.free_length", 0.0)
    free = walk.values.get(f"{path}.free_angle", 0.0)
    if joint in walk.system.mechanism.drivers:
        return walk.system.drive(walk.values, joint, walk.time)[0] - free
    angle = walk.coordinates(joint)[0] - free
    xp = namespace(angle)
    return xp.arctan2(xp.sin(angle), xp.cos(angle))


def _line(walk: SpatialWalk, path: str, ends: tuple[str, str], only: str | None) -> tuple[SpatialAction, SpringState]:
    """A spring along the line between two points; no value where they meet, for the line has no direction there."""
    (one, a), (other, b) = ((end.partition(".")[0], _end(walk, end)) for end in ends)
    apart = vector_minus(b.place, a.place)
    square = dot(apart, apart)
    xp = namespace(square)
    there, meeting = primal(square) > 0, 1.0 if only == "pull" else np.nan  # a slack rope needs no direction
    length = xp.sqrt(xp.where(there, square, meeting))
    direction = scaled(1 / length, apart)
    rate = dot(vector_minus(b.velocity, a.velocity), direction)
    elongation = xp.where(there, length, 0.0 * length) - walk.values.get(f"{path}.free_length", 0.0)
    state = spring_state(walk, path, elongation, rate, only)
    pull = scaled(state.force, direction)
    on = [(one, about(pull, NULL, a.place)), (other, about(scaled(-1.0, pull), NULL, b.place))]
    return SpatialAction(on, state.power), state


def _end(walk: SpatialWalk, end: str) -> SpatialPoint:
    link, _, point = end.partition(".")
    return walk.point(link, point)
