"""What acts on the links beside gravity and inertia: the loads of the model and its springs, with their power."""

from __future__ import annotations

import functools
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.plane import Wrench, turned
from trunnion.algebra.table import look_up
from trunnion.model.mechanism import Mechanism
from trunnion.model.parts import Load
from trunnion.solve.forward import Forward, PointMotion

if TYPE_CHECKING:
    pass
__all__ = [
    "Action",
    "Share",
    "Slip",
    "SpringState",
    "Stated",
    "Switch",
    "spring_state",
    "springs",
    "stated_loads",
    "useful_loads",
]


SPLINED = 3  # of a spline every so many points: it bends at none, but may be anything between two that are far apart

Share = float | NDArray[np.float64]  # of what resists a joint at rest, with the sign of the slip about to begin


class Slip(NamedTuple):
    """Relative speed of a joint, second link against first (rad/s, m/s), and where it is zero to rounding."""

    speed: Number
    zero: Number


class Action(NamedTuple):
    """What one load or spring does: wrenches on links about global places (None: a pure moment), power given, W."""

    on: list[tuple[str, Wrench, tuple[Number, Number] | None]]
    power: Number

    @property
    def undefined(self) -> Number:
        """Where it has no value."""
        size: Number = 0.0
        for _, wrench, _ in self.on:
            size = size + primal(wrench.x) + primal(wrench.y) + primal(wrench.m)
        return ~np.isfinite(size)


class SpringState(NamedTuple):
    """Pull of a spring (N or N m), length or angle beyond the free one, power it gives, and loss in its damper, W."""

    force: Number
    elongation: Number
    power: Number
    loss: Number


class Switch(NamedTuple):
    """A number of the motion, and the levels at which something jumps or bends as it passes them.

    period: after which the levels come again; None: they do not.
    """

    number: Number
    levels: Sequence[Number] = (0.0,)
    period: Number | None = None


class Stated:
    """Numbers of the model at the times of a walk: those of its values, and expressions of the motion."""

    def __init__(self, walk: Forward) -> None:
        self.walk = walk
        self.entries = walk.system.mechanism.parameter_set.entries

    def get(self, path: str) -> Number | None:
        """The number with a path; None if it is not stated."""
        if path in self.walk.values:
            return self.walk.values[path]
        entry = self.entries.get(path)
        if entry is None:
            return None
        return entry.quantity.evaluate({name: self._named(name) for name in entry.quantity.names})

    def vector(self, path: str) -> tuple[Number, Number] | None:
        """A force in the plane; None if it is not stated."""
        x, y = self.get(f"{path}.x"), self.get(f"{path}.y")
        return None if x is None or y is None else (x, y)

    def switches(self) -> Iterator[Switch]:
        """What decides where numbers that vary with the motion jump or bend: ends of `between` …, points of tables."""
        tables: dict[str, None] = {}
        for entry in self.entries.values():
            if entry.varies and entry.quantity.expression is not None:
                named = {name: self._named(name) for name in entry.quantity.names}
                yield from (Switch(kink(named)) for kink in entry.quantity.expression.kinks)
                tables.update(dict.fromkeys(named.keys() & self.walk.system.mechanism.tables.keys()))
        for name in tables:
            table, (knots, _, place) = self.walk.system.mechanism.tables[name], self._of_table(name)
            known = knots if table.interpolation == "linear" else [*knots[:-1:SPLINED], knots[-1]]
            yield Switch(place, known, knots[-1] - knots[0] if table.repeats else None)

    def _named(self, name: str) -> Number:
        """What a name in an expression stands for: a dimension, the drive, time, or a table."""
        if name in self.walk.system.mechanism.tables:
            return self._table(name)
        if name == "time":
            return self.walk.time
        if name in ("drive", "speed"):
            return self._drive[0] if name == "drive" else self.walk.direction * self._drive[1]
        return self.walk.values[f"dimensions.{name}"]

    @functools.cached_property
    def _drive(self) -> tuple[Number, Number, Number]:
        first = next(iter(self.walk.system.mechanism.drivers))
        return self.walk.system.drive(self.walk.values, first, self.walk.time)

    def _of_table(self, name: str) -> tuple[list[Number], list[Number], Number]:
        """Knots and values of a table, and the place in it."""
        table, path = self.walk.system.mechanism.tables[name], f"tables.{name}.points"
        knots, values = (
            [self.walk.values[f"{path}.{k}.{key}"] for k in range(len(table.points))] for key in ("at", "value")
        )
        if table.period is not None and self._open(name):
            knots, values = [*knots, knots[0] + self.walk.values[f"tables.{name}.period"]], [*values, values[0]]
        return knots, values, self.walk.time if table.over == "time" else self._drive[0]

    def _table(self, name: str) -> Number:
        table, (knots, values, place) = self.walk.system.mechanism.tables[name], self._of_table(name)
        return look_up(knots, values, place, table.interpolation == "spline", table.repeats)

    def _open(self, name: str) -> bool:
        """Whether the points of a table end before its period does: the first then comes again as the last."""
        nominal = self.walk.system.mechanism.parameter_set.nominal
        last = len(self.walk.system.mechanism.tables[name].points) - 1
        first, end, period = (nominal[f"tables.{name}.{key}"] for key in ("points.0.at", f"points.{last}.at", "period"))
        return bool(end - first < period * (1 - 1e-9))


# ---- loads ----------------------------------------------------------------------------------------------------


def stated_loads(
    walk: Forward, slips: Mapping[str, Slip], zero_slip: Mapping[str, Share]
) -> Iterator[tuple[str, Action]]:
    """The loads of the model, by name. zero_slip: see `kinetostatics.solve`."""
    stated = Stated(walk)
    for name, load in walk.system.mechanism.loads.items():
        path = f"loads.{name}"
        if load.joint is None:
            yield name, _push(stated, load, path)
        else:
            torque, force = stated.get(f"{path}.resisting_torque"), stated.get(f"{path}.resisting_force")
            size = force if torque is None else torque
            yield name, _resist(walk, load, size, slips[load.joint], zero_slip.get(load.joint, 0.0))


def _push(stated: Stated, load: Load, path: str) -> Action:
    """A force at a point of a link and a moment, in global axes or the link's."""
    walk, link = stated.walk, load.link or ""
    on: list[tuple[str, Wrench, tuple[Number, Number] | None]] = []
    power: Number = 0.0
    force, moment = stated.vector(f"{path}.force"), stated.get(f"{path}.moment")
    if force is not None:
        at = walk.point(link, load.at) if load.at else walk.local_point(link, 0.0, 0.0)
        if load.frame == "link":
            frame = walk.motions[link].frame
            force = turned(frame.c, frame.s, *force)
        on.append((link, Wrench(*force, 0.0), at.place))
        power = power + force[0] * at.velocity[0] + force[1] * at.velocity[1]
    if moment is not None:
        on.append((link, Wrench(0.0, 0.0, moment), None))
        power = power + moment * walk.motions[link].twist.w
    return Action(on, power)


def _resist(walk: Forward, load: Load, size: Number, slip: Slip, at_rest: Share) -> Action:
    """A torque or force that opposes the motion of a joint, whichever way it goes or one way only.

    at_rest: the share of the load where there is no motion, with the sign of that which is about to begin.
    """
    sign = np.where(slip.zero, at_rest, np.sign(primal(slip.speed)))
    if load.only is not None:
        sign = np.where(sign * (1.0 if load.only == "positive" else -1.0) > 0.0, sign, 0.0)
    return _in_joint(walk, load.joint or "", -sign * size, slip)


def _in_joint(walk: Forward, joint: str, effort: Number, slip: Slip) -> Action:
    """An effort in the freedom of a joint, on its second link by its first: N m if it turns, N along its slide."""
    kind, (first, second) = walk.system.joints[joint]
    power = effort * slip.speed
    if kind == "revolute":
        return Action([(second, Wrench(0.0, 0.0, effort), None), (first, Wrench(0.0, 0.0, -effort), None)], power)
    axis, at = walk.element(first, joint), walk.element(second, joint)
    x, y, place = effort * axis.c, effort * axis.s, (at.x, at.y)
    return Action([(second, Wrench(x, y, 0.0), place), (first, Wrench(-x, -y, 0.0), place)], power)


# ---- springs --------------------------------------------------------------------------------------------------


def springs(walk: Forward, slips: Mapping[str, Slip]) -> Iterator[tuple[str, Action, SpringState]]:
    """The springs and dampers of the model: pull = preload + stiffness · elongation + damping · rate."""
    for name, spring in walk.system.mechanism.springs.items():
        path = f"springs.{name}"
        if spring.between is not None:
            yield name, *_line(walk, path, spring.between, spring.only)
            continue
        joint = spring.joint or ""
        slip = slips[joint]
        turns = walk.system.joints[joint][0] == "revolute"
        elongation = _turned_by(walk, path, joint) if turns else _slid_by(walk, path, joint)
        state = spring_state(walk, path, elongation, slip.speed, spring.only)
        yield name, _in_joint(walk, joint, -state.force, slip), state


def _line(walk: Forward, path: str, ends: tuple[str, str], only: str | None) -> tuple[Action, SpringState]:
    """A spring along the line between two points; no value where they meet, for the line has no direction there."""
    (one, a), (other, b) = ((end.partition(".")[0], _end(walk, end)) for end in ends)
    dx, dy = b.place[0] - a.place[0], b.place[1] - a.place[1]
    square = dx * dx + dy * dy
    xp = namespace(square)
    apart, meeting = primal(square) > 0, 1.0 if only == "pull" else np.nan  # a slack rope needs no direction
    length = xp.sqrt(xp.where(apart, square, meeting))
    ux, uy = dx / length, dy / length
    rate = (b.velocity[0] - a.velocity[0]) * ux + (b.velocity[1] - a.velocity[1]) * uy
    elongation = xp.where(apart, length, 0.0 * length) - walk.values.get(f"{path}.free_length", 0.0)
    state = spring_state(walk, path, elongation, rate, only)
    x, y = state.force * ux, state.force * uy
    return Action([(one, Wrench(x, y, 0.0), a.place), (other, Wrench(-x, -y, 0.0), b.place)], state.power), state


def _end(walk: Forward, end: str) -> PointMotion:
    link, _, point = end.partition(".")
    return walk.point(link, point)


def _turned_by(walk: Forward, path: str, joint: str) -> Number:
    """Rotation of a joint beyond the free angle: of a driven one whole turns count, of others the nearest is meant."""
    free = walk.values.get(f"{path}.free_angle", 0.0)
    if joint in walk.system.mechanism.drivers:
        return walk.system.drive(walk.values, joint, walk.time)[0] - free
    first, second = (walk.motions[link].frame for link in walk.system.joints[joint][1])
    c, s = first.c * second.c + first.s * second.s, first.c * second.s - first.s * second.c
    xp = namespace(free)
    c, s = turned(xp.cos(free), -xp.sin(free), c, s)
    return namespace(s, c).arctan2(s, c)


def _slid_by(walk: Forward, path: str, joint: str) -> Number:
    """Slide of a joint beyond the free one."""
    first, second = walk.system.joints[joint][1]
    one, two = walk.element(first, joint), walk.element(second, joint)
    slide = one.c * (two.x - one.x) + one.s * (two.y - one.y)
    return slide - walk.values.get(f"{path}.free_length", 0.0)


def spring_state(walk: Forward, path: str, elongation: Number, rate: Number, only: str | None) -> SpringState:
    """The spring at an elongation. only: it acts where that is positive (pull) or negative (push), its damper too."""
    stiffness, damping, preload = (walk.values.get(f"{path}.{key}", 0.0) for key in ("stiffness", "damping", "preload"))
    force = preload + stiffness * elongation + damping * rate
    loss = damping * rate * rate
    if only is not None:
        beyond = primal(elongation)
        idle = beyond <= 0 if only == "pull" else beyond >= 0  # not so where there is no elongation: NaN is kept
        force, loss = (namespace(number).where(idle, 0.0, number) for number in (force, loss))
    return SpringState(force, elongation, -force * rate, loss)


def useful_loads(mechanism: Mechanism) -> list[str]:
    """Loads whose power is the purpose: those marked useful, or all if none is."""
    marked = [name for name, load in mechanism.loads.items() if load.useful]
    return marked or list(mechanism.loads)
