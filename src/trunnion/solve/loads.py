"""What acts on the links beside gravity and inertia: the loads of the model and its springs, with their power."""

from __future__ import annotations

import functools
import operator
from collections.abc import Container, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, flat, namespace
from trunnion.algebra.spline import look_up
from trunnion.model.expression import PLACED
from trunnion.model.mechanism import Mechanism
from trunnion.solve.forward import Assembly, Forward, Vector, forward, start
from trunnion.solve.system import System, Values

NOTHING_USEFUL = "there is no load, and no spring or weight is marked useful"  # so that an efficiency is undefined
STATE_USEFUL = "state what it drives as a load; of what it lifts mark the link useful: true"
SPLINED = 3  # of a spline every so many points: it bends at none, but may be anything between two that are far apart

Share = float | NDArray[np.float64]  # of what resists a joint at rest, with the sign of the slip about to begin


class LoadAction(NamedTuple):
    """What one load or spring does: the wrench on each link, about what all on it are, and the power it gives, W."""

    on: list[tuple[str, Any]]
    power: Number

    @property
    def undefined(self) -> Number:
        """Where it has no value."""
        numbers = (primal(number) for _, wrench in self.on for number in flat(wrench))
        return ~np.isfinite(functools.reduce(operator.add, numbers, 0.0))


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

    def vector(self, path: str) -> Vector | None:
        """A force, or in space a moment; None if it is not stated."""
        components = tuple(self.get(f"{path}.{axis}") for axis in self.walk.system.axes)
        return None if any(number is None for number in components) else components

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
            bends = knots if table.interpolation == "linear" else [*knots[:-1:SPLINED], knots[-1]]
            yield Switch(place, bends, knots[-1] - knots[0] if table.repeats else None)

    def _named(self, name: str) -> Number:
        """What a name in an expression stands for: a dimension, the drive, time, or a table."""
        table = self.walk.system.mechanism.tables.get(name)
        if table is not None:
            knots, values, place = self._of_table(name)
            return look_up(knots, values, place, table.interpolation == "spline", table.repeats)
        if name == "time":
            return self.walk.time
        if name in ("drive", "speed"):
            return self._drive[0] if name == "drive" else self.walk.direction * self._drive[1]
        return self._placed(name) if PLACED in name else self.walk.values[f"dimensions.{name}"]

    def _placed(self, name: str) -> Number:
        """Turn or slide of a joint, coordinate of a point, or a rate of these: named as a column of a result."""
        walk, (of, _, rest) = self.walk, name.partition(PLACED)
        if PLACED in rest:
            point, _, component = rest.partition(PLACED)
            motion = walk.point(of, point)
            vector = motion.velocity if component.startswith("velocity_") else motion.place
            coordinate: Number = vector[walk.system.axes.index(component[-1])]
            return coordinate
        which = 1 if rest.startswith("slide") else 0
        if rest.endswith("_velocity"):
            return walk.rates(of)[which]
        driven = of in walk.system.mechanism.drivers and walk.system.turns(of) == (which == 0)
        return self._driven(of)[0] if driven else walk.coordinates(of)[which]

    @functools.cached_property
    def _drive(self) -> tuple[Number, Number, Number]:
        return self._driven(next(iter(self.walk.system.mechanism.drivers)))

    def _driven(self, name: str) -> tuple[Number, Number, Number]:
        """Coordinate of a driver within its turn, and its rates."""
        system, values = self.walk.system, self.walk.values
        coordinate = system.drive(values, name, self.walk.time)
        if not system.is_free(values, name) or not (span := system.span(values, name)).periodic:
            return coordinate
        begin = values.get(f"drivers.{name}.start", 0.0)  # loads come again every turn
        return begin + np.mod(coordinate[0] - begin, span.travel), *coordinate[1:]

    def _of_table(self, name: str) -> tuple[list[Number], list[Number], Number]:
        """Knots and values of a table, and the place in it."""
        mechanism, numbers, path = self.walk.system.mechanism, self.walk.values, f"tables.{name}.points"
        table, last = mechanism.tables[name], len(mechanism.tables[name].points) - 1
        knots, values = ([numbers[f"{path}.{k}.{key}"] for k in range(last + 1)] for key in ("at", "value"))
        if table.period is not None and not closes(mechanism, name):  # the first point comes again as the last
            knots, values = [*knots, knots[0] + numbers[f"tables.{name}.period"]], [*values, values[0]]
        return knots, values, self.walk.time if table.over == "time" else self._drive[0]


def closes(mechanism: Mechanism, name: str) -> bool:
    """Whether the points of a table reach over all of its period, and the last is its first again."""
    nominal, last = mechanism.parameter_set.nominal, len(mechanism.tables[name].points) - 1
    first, end = (nominal[f"tables.{name}.points.{k}.at"] for k in (0, last))
    return bool(end - first >= nominal.get(f"tables.{name}.period", np.inf) * (1 - 1e-9))


def placed(mechanism: Mechanism) -> bool:
    """Whether a load speaks of joints or points, so that what it is takes the motion of the links."""
    entries = mechanism.parameter_set.entries.values()
    return any(entry.varies and any(PLACED in name for name in entry.quantity.names) for entry in entries)


def stated_walk(system: System, values: Values, assembly: Assembly, time: Number) -> Forward:
    """A walk that knows what the loads may speak of: the drivers alone, if that is all."""
    if placed(system.mechanism):
        return forward(system, values, assembly, time)
    walk = start(system, values)
    walk.time = time
    return walk


# ---- loads ----------------------------------------------------------------------------------------------------


def stated_loads(
    walk: Forward, zero_slip: Mapping[str, Share], sensed: Container[str] = ()
) -> Iterator[tuple[str, LoadAction]]:
    """The loads of the model, by name. zero_slip: see `backward.Given`; sensed: joints of which it tells all."""
    expressions, algebra = Stated(walk), walk.algebra
    for name, load in walk.system.mechanism.loads.items():
        path = f"loads.{name}"
        if load.joint is None:  # a force at a point of a link and a moment, in global axes or the link's
            link = load.link or ""
            frame, twist, _ = walk.motions[link]
            force, moment = expressions.vector(f"{path}.force") or algebra.NULL, expressions.get(f"{path}.moment")
            if moment is None:
                moment = expressions.vector(f"{path}.moment") or algebra.NO_MOMENT
            if load.frame == "link":
                force, moment = algebra.rotated(frame, force), algebra.rotated_moment(frame, moment)
            place = walk.placed(frame, link, load.at) if load.at else algebra.point_of(frame, algebra.NULL)
            wrench = algebra.about(force, moment, place)
            yield name, LoadAction([(link, wrench)], algebra.power(wrench, twist))
            continue
        # a torque or force that opposes the motion of a joint, whichever way it goes or one way only
        torque, force = expressions.get(f"{path}.resisting_torque"), expressions.get(f"{path}.resisting_force")
        size, turns = (force, False) if torque is None else (torque, True)
        speed = walk.rates(load.joint)[0 if turns else 1]
        sign = _sense(walk, load.joint, turns, speed, zero_slip.get(load.joint, 0.0), load.joint in sensed)
        if load.only is not None:
            sign = np.where(sign * (1.0 if load.only == "positive" else -1.0) > 0.0, sign, 0.0)
        yield name, _in_joint(walk, load.joint, -sign * size, turns, speed)


def _sense(walk: Forward, joint: str, turns: bool, speed: Number, at_rest: Share, sensed: bool) -> Number:
    """Sign of the speed of a joint.

    at_rest: the share of what resists where there is no motion, with the sign of that which is about to begin; sensed:
    whatever the speed says.
    """
    return at_rest if sensed else np.where(walk.still(joint, turns), at_rest, np.sign(primal(speed)))


def _in_joint(walk: Forward, joint: str, effort: Number, turns: bool, speed: Number) -> LoadAction:
    """An effort in the freedom of a joint, on its second link by its first: N m about its axis, or N along it."""
    first, second = walk.system.joints[joint].links
    wrench, times = walk.axis(joint, turns)[1], walk.algebra.times
    return LoadAction([(second, times(effort, wrench)), (first, times(-effort, wrench))], effort * speed)


# ---- losses of joints ------------------------------------------------------------------------------------------


def losses(
    walk: Forward, zero_slip: Mapping[str, Share], sensed: Container[str] = ()
) -> Iterator[tuple[str, LoadAction, Number]]:
    """What resists the joints whatever their load: −sgn(v) constant − viscous v, its power, and the effort itself."""
    for joint in walk.system.lossy:
        turns, path = walk.system.turns(joint), f"joints.{joint}.losses"
        speed = walk.rates(joint)[0 if turns else 1]
        constant, viscous = (walk.values.get(f"{path}.{key}", 0.0) for key in ("constant", "viscous"))
        sign = _sense(walk, joint, turns, speed, zero_slip.get(joint, 0.0), joint in sensed)
        effort = -sign * constant - viscous * speed
        yield joint, _in_joint(walk, joint, effort, turns, speed), effort


# ---- springs --------------------------------------------------------------------------------------------------


def springs(walk: Forward) -> Iterator[tuple[str, LoadAction, SpringState]]:
    """The springs and dampers of the model: pull = preload + stiffness · elongation + damping · rate."""
    for name, spring in walk.system.mechanism.springs.items():
        path = f"springs.{name}"
        if spring.between is not None:
            yield name, *_line(walk, path, spring.between, spring.only)
            continue
        joint = spring.joint or ""
        turns = walk.system.turns(joint)
        speed = walk.rates(joint)[0 if turns else 1]
        free = walk.values.get(f"{path}.{'free_angle' if turns else 'free_length'}", 0.0)
        if not turns:
            elongation = walk.coordinates(joint)[1] - free
        elif joint in walk.system.mechanism.drivers:  # whole turns count
            elongation = walk.system.drive(walk.values, joint, walk.time)[0] - free
        else:  # the nearest is meant
            angle = walk.coordinates(joint)[0] - free
            xp = namespace(angle)
            elongation = xp.arctan2(xp.sin(angle), xp.cos(angle))
        state = spring_state(walk, path, elongation, speed, spring.only)
        yield name, _in_joint(walk, joint, -state.force, turns, speed), state


def _line(walk: Forward, path: str, ends: tuple[str, str], only: str | None) -> tuple[LoadAction, SpringState]:
    """A spring along the line between two points; no value where they meet, for the line has no direction there.

    One without free length, preload or damping pulls by its stiffness times the way between them, there too.
    """
    (link, _, _), (other, _, _) = parts = [end.partition(".") for end in ends]
    a, b = (walk.point(on, point) for on, _, point in parts)
    apart = [q - p for p, q in zip(a.place, b.place, strict=True)]
    square = _dot(apart, apart)
    xp = namespace(square)
    free, preload, damping, stiffness = (
        walk.values.get(f"{path}.{key}", 0.0) for key in ("free_length", "preload", "damping", "stiffness")
    )
    directed = abs(primal(free)) + abs(primal(preload)) + abs(primal(damping))
    stretched, needs = primal(square) > 0, 0.0 if only == "pull" else directed  # a slack rope needs no direction
    length = xp.sqrt(xp.where(stretched, square, namespace(needs).where(needs > 0, np.nan, 1.0)))
    rate = _dot([q - p for p, q in zip(a.velocity, b.velocity, strict=True)], apart) / length
    elongation = xp.where(stretched, length, 0.0 * length) - free
    state = spring_state(walk, path, elongation, rate, only)
    along = namespace(state.force, stiffness).where(primal(square) + directed > 0, state.force / length, stiffness)
    on = []
    for body, end, sign in ((link, a, 1.0), (other, b, -1.0)):
        pull = tuple(sign * along * part for part in apart)
        on.append((body, walk.algebra.about(pull, walk.algebra.NO_MOMENT, end.place)))
    return LoadAction(on, state.power), state


def _dot(a: Sequence[Number], b: Sequence[Number]) -> Number:
    return functools.reduce(operator.add, (p * q for p, q in zip(a, b, strict=True)))


def spring_state(walk: Forward, path: str, elongation: Number, rate: Number, only: str | None) -> SpringState:
    """The spring at an elongation. only: it acts where that is positive (pull) or negative (push), its damper too."""
    stiffness, damping, preload = (walk.values.get(f"{path}.{key}", 0.0) for key in ("stiffness", "damping", "preload"))
    force = preload + stiffness * elongation + damping * rate
    loss = damping * rate * rate
    if only is not None:
        outside = primal(elongation)
        idle = outside <= 0 if only == "pull" else outside >= 0  # not so where there is no elongation: NaN is kept
        force, loss = (namespace(number).where(idle, 0.0, number) for number in (force, loss))
    return SpringState(force, elongation, -force * rate, loss)


def useful_loads(mechanism: Mechanism) -> list[str]:
    """Loads whose power is the purpose: those marked useful, or all if no load, spring or weight is."""
    marked = [name for name, load in mechanism.loads.items() if load.useful]
    others = useful_springs(mechanism) or useful_weights(mechanism)
    return marked if marked or others else list(mechanism.loads)


def useful_springs(mechanism: Mechanism) -> list[str]:
    """Springs whose power is the purpose: those marked useful."""
    return [name for name, spring in mechanism.springs.items() if spring.useful]


def useful_weights(mechanism: Mechanism) -> list[str]:
    """Links whose weight is the purpose, as of a lift: those marked useful."""
    return [name for name, link in mechanism.effective_links.items() if link.useful]


def has_useful_work(mechanism: Mechanism) -> bool:
    """Whether it is stated what work is useful, without which there is no efficiency."""
    return bool(useful_loads(mechanism) or useful_springs(mechanism) or useful_weights(mechanism))


def useful_powers(walk: Forward, loads: Mapping[str, Number], springs_: Mapping[str, SpringState]) -> Iterator[Number]:
    """What each useful load, spring and weight gives the mechanism, W. loads: powers; springs_: states, by name."""
    mechanism, values = walk.system.mechanism, walk.values
    yield from (loads[name] for name in useful_loads(mechanism))
    yield from (springs_[name].power for name in useful_springs(mechanism))
    gravity = walk.system.vector(values, "gravity")
    for link in useful_weights(mechanism):
        velocity = walk.at(link, walk.system.centre(values, link)).velocity
        yield values[f"links.{link}.mass"] * _dot(gravity, velocity)
