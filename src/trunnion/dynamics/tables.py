"""What moves and loads one free coordinate, tabulated over its way: accelerations in microseconds.

With one free coordinate q all reactions are, for given friction forces φ, affine in q̈ with coefficients that depend on
q alone:

    r = A q̈ + B q̇² + D q̇ + C + G φ,    E = likewise,    slip = S q̇

A, B, C, D, G are columns that walks through the modules give: unit acceleration, unit speed, dampers at unit speed,
loads and gravity at rest, unit friction forces. They are smooth in q between the places where a load jumps or bends,
and are kept as Chebyshev polynomials on panels there, refined until they miss no walk by more than rounding. One
evaluation sums the polynomials, and settles φ = law(N(r), slip) with q̈ from E = T. Where it is not certain that there
is one solution the walks are asked (`rates.Walks`), which are the oracle of it all.

Source of the interpolation: L. N. Trefethen, Approximation Theory and Approximation Practice, SIAM, 2013, chapters 4
and 8.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.nested import flat
from trunnion.dynamics.start import Places
from trunnion.dynamics.state import FreeMotion
from trunnion.joints.pairs import PlanarContactLoad
from trunnion.solve.backward import Sense, body_loads, stated_actions, under
from trunnion.solve.contacts import contacts_of
from trunnion.solve.forward import Forward, forward
from trunnion.solve.system import Values, freed, law_of, rubbing

__all__ = [
    "EXACT",
    "FIXED",
    "NODES",
    "PANELS",
    "POWERS",
    "Rub",
    "Tables",
    "numbers",
    "rubs_of",
    "scale_of",
    "tabulated",
    "unfit",
]

Array = NDArray[np.float64]

NODES = 12  # of a panel
PANELS = 32  # of a turn, or of a range, to begin with
DOUBLINGS = 5
EXACT = 1e-11  # of the largest of each number over the way
SMALL = 1e-3  # of the largest number of its kind: of what is below, the share of that counts
RATE = "velocity"  # in the name of a motion that a load speaks of
POWERS = 6  # numbers after the columns and slips
FIXED = 5  # columns before those of the friction forces: q̈, q̇², q̇, loads forward, loads backward


@dataclass(frozen=True)
class Rub:
    """A contact that rubs: its joint, its law with parameters, and where its components of the reactions stand."""

    joint: str
    function: Callable[..., Any]
    parameters: dict[str, float]
    load: Any
    rows: slice
    interval: bool
    bristle: int
    at_rest: Callable[..., Any] | None = None


@dataclass(frozen=True)
class Tables:
    """Polynomials of every number over the way.

    edges: (panel + 1,) coordinates; coefficients: (panel, node, number); rubs: the contacts; error: largest miss found
    between the nodes, of the largest of each number.
    """

    motion: FreeMotion
    edges: Array
    coefficients: Array
    period: float | None
    rubs: tuple[Rub, ...]
    error: float

    @cached_property
    def _orders(self) -> Array:
        return np.arange(NODES, dtype=float)

    def numbers(self, q: float) -> Array:
        """All numbers at a coordinate; NaN beyond the way."""
        q = q % self.period if self.period is not None else q
        panel = int(np.searchsorted(self.edges, q, side="right")) - 1
        if not 0 <= panel < len(self.edges) - 1:
            if q != self.edges[-1]:
                return np.full(self.coefficients.shape[2], np.nan)
            panel = len(self.edges) - 2
        low, high = self.edges[panel], self.edges[panel + 1]
        place = min(1.0, max(-1.0, (2.0 * q - low - high) / (high - low)))
        found: Array = np.cos(self._orders * np.arccos(place)) @ self.coefficients[panel]
        return found


# ---- what can be tabulated ------------------------------------------------------------------------------------


def tabulated(motion: FreeMotion, known: Places) -> Tables | None:
    """The tables of a motion; None where its forces are not functions of one coordinate and its speed."""
    if unfit(motion) or motion.cycle.duration <= 0:
        return None
    way = (0.0, known.period) if known.period is not None else known.limits
    edges = np.unique(np.concatenate([way, [bend for bend in known.bends if way[0] < bend < way[1]]]))
    widest = (way[1] - way[0]) / PANELS
    with np.errstate(all="ignore"):
        rubs = rubs_of(motion)
        for _ in range(DOUBLINGS):
            parted = _parted(edges, widest)
            found, error = _fitted(motion, rubs, parted)
            if not error > EXACT:
                break
            widest *= 0.5
    if not error <= 1e2 * EXACT:
        return None
    return Tables(motion, parted, found, known.period, rubs, error)


def unfit(motion: FreeMotion) -> str:
    """Why the forces are not functions of one coordinate and its speed; empty if they are."""
    mechanism = motion.system.mechanism
    if len(mechanism.drivers) != 1:
        return "several drivers move"
    if motion.meeting:
        return "two assemblies meet on its way"
    if any(gear.teeth for gear in mechanism.gears.values()):
        return "a gear pair has teeth"
    timed = {"time", "speed"} | {name for name, table in mechanism.tables.items() if table.over == "time"}
    for entry in mechanism.parameter_set.entries.values():
        if entry.varies and any(name in timed or RATE in name for name in entry.quantity.names):
            return f"{entry.path} depends on time or speed"
    wound = any(spring.joint in mechanism.drivers for spring in mechanism.springs.values())  # it counts whole turns
    wound = wound and motion.cycle.periodic and motion.system.turns(motion.names[0])
    return "a spring winds up at the driven joint" if wound else ""


def _parted(edges: Array, widest: float) -> Array:
    parts = [
        np.linspace(low, high, int(np.ceil((high - low) / widest)) + 1)[:-1] for low, high in itertools.pairwise(edges)
    ]
    return np.append(np.concatenate(parts), edges[-1])


def _fitted(motion: FreeMotion, rubs: Sequence[Rub], edges: Array) -> tuple[Array, float]:
    """Coefficients (panel, node, number) through the Chebyshev nodes of every panel, and their largest miss between."""
    angles = np.pi * (np.arange(NODES) + 0.5) / NODES
    middle, half = (edges[1:] + edges[:-1]) / 2, (edges[1:] - edges[:-1]) / 2
    values = numbers(motion, rubs, (middle[:, None] + half[:, None] * np.cos(angles)).ravel(), motion.values)
    values = values.reshape(len(values), len(middle), NODES)
    cosines = np.cos(np.arange(NODES)[:, None] * angles[None])
    found = 2.0 / NODES * np.einsum("on,kpn->pok", cosines, values)
    found[:, 0] *= 0.5
    tried = np.array([-0.97, 0.03])
    exact = numbers(motion, rubs, (middle[:, None] + half[:, None] * tried).ravel(), motion.values)
    basis = np.cos(np.arange(NODES)[:, None] * np.arccos(tried)[None])
    miss = np.abs(np.einsum("ot,pok->kpt", basis, found).reshape(len(exact), -1) - exact)
    scale = scale_of(np.max(np.abs(values), axis=(1, 2)), len(rubs))
    worst = np.max(miss, axis=1) / np.where(scale > 0, scale, 1.0)
    return found, float(np.max(worst))


def scale_of(largest: Array, count: int) -> Array:
    """What a miss of each number is measured by: its largest size, if that is no rounding beside others of its kind."""
    wide = FIXED + count
    size = 1 + (len(largest) - wide - count - POWERS) // wide
    found = largest.copy()
    columns = found[: size * wide].reshape(size, wide)
    columns[:] = np.maximum(columns, SMALL * columns.max(axis=0))
    for part in (slice(size * wide, size * wide + count), slice(size * wide + count, None)):
        found[part] = np.maximum(found[part], SMALL * np.max(found[part], initial=0.0))
    return found


# ---- the numbers, from walks ----------------------------------------------------------------------------------


def _lanes(motion: FreeMotion, values: Values, q: Array, rate: float, second: float, gravity: bool) -> Forward:
    values = dict(freed(values, {motion.names[0]: (q, np.full_like(q, rate), np.full_like(q, second))}))
    if not gravity:
        values |= dict.fromkeys((f"gravity.{axis}" for axis in motion.system.axes), 0.0)
    return forward(motion.system, values, motion.assembly, np.zeros_like(q))


def _components(load: Any, reaction: Any) -> list[Any]:
    """What a normal load depends on, in axes that turn with the joint: of a guide its force across and its couple."""
    if isinstance(load, PlanarContactLoad):
        return list(reaction[:2]) if load.across is None else list(load.sides(reaction))
    return list(load.felt(reaction))


def rubs_of(motion: FreeMotion) -> tuple[Rub, ...]:
    """The contacts, with components and laws."""
    q = np.array([float(np.ravel(primal(motion.system.drive(motion.values, motion.names[0], 0.0)[0]))[0])])
    walk, found, row = _lanes(motion, motion.values, q, 1.0, 0.0, True), list[Rub](), 0
    zero = under(walk, {}).module_reactions
    for joint in rubbing(motion.system):
        law = law_of(motion.system, joint)
        parameters = {key: float(motion.values[f"joints.{joint}.friction.{key}"]) for key in law.parameters}
        bristle = motion.bristles.index(joint) if joint in motion.bristles else -1
        for one in contacts_of(walk, joint):
            size = len(_components(one.load, zero[joint]))
            rows = slice(row, row + size)
            found.append(
                Rub(joint, law.function, parameters, one.load, rows, law.interval_at_rest, bristle, law.at_rest)
            )
            row += size
    return tuple(found)


def numbers(motion: FreeMotion, rubs: Sequence[Rub], q: Array, values: Values) -> Array:
    """(number, …, coordinate): E and components by column, slips, then powers per speed and dampers' loss.

    values: of the mechanism, or (sample, 1) where they vary; q then (sample, coordinate).
    """
    at_rest, moving = _lanes(motion, values, q, 0.0, 0.0, True), _lanes(motion, values, q, 1.0, 0.0, False)
    joints = dict.fromkeys(rub.joint for rub in rubs)
    contacts = [(joint, one) for joint in joints for one in contacts_of(moving, joint)]
    loads = [body_loads(_lanes(motion, values, q, 0.0, 1.0, False)), body_loads(moving)]
    static, powers = [], []
    for sense in (1.0, -1.0):
        stated, _, _ = stated_actions(at_rest, _senses(motion, moving, sense))
        static.append(_summed(at_rest, body_loads(at_rest), stated))
        driven = _lanes(motion, values, q, sense * motion.unit[0] ** 0.5, 0.0, True)
        powers.append(stated_actions(driven, {})[1] / (motion.unit[0] ** 0.5))
    fast, _, spring_power = stated_actions(moving, _senses(motion, moving, 1.0))
    slow, _, _ = stated_actions(at_rest, _senses(motion, moving, 1.0))
    _, _, both = stated_actions(_lanes(motion, values, q, -1.0, 0.0, False), _senses(motion, moving, 1.0))
    loads += [_summed(at_rest, fast, slow, -1.0), *static]
    for joint, one in contacts:
        first, second = motion.system.joints[joint][1]
        unit = {link: moving.on_link(link, one.unit, joint) for link in (first, second)}
        loads.append({second: unit[second], first: moving.algebra.times(-1.0, unit[first])})
    columns = [_column(motion, moving, contacts, load) for load in loads]
    for k, (_, one) in enumerate(contacts):
        if one.felt:
            own = _components(one.load, tuple(flat(one.unit)))
            rows = rubs[k].rows
            for i, number in enumerate(own):
                columns[FIXED + k][1 + rows.start + i] = columns[FIXED + k][1 + rows.start + i] + number
    flat_rows: list[Any] = [columns[j][i] for i in range(len(columns[0])) for j in range(len(columns))]
    flat_rows += [one.slip for _, one in contacts]
    flat_rows += [*powers, (spring_power - both) / 2, -(spring_power + both) / 2, *_dragged(moving)]
    return np.array([np.broadcast_to(np.asarray(primal(row), float), q.shape) for row in flat_rows])


def _dragged(moving: Forward) -> tuple[Any, Any]:
    """Power of the losses of joints that do not follow the load: per speed, and per its square."""
    steady: Any = 0.0
    square: Any = 0.0
    for joint in moving.system.lossy:
        speed, path = moving.speed(joint), f"joints.{joint}.losses"
        steady = steady + np.abs(primal(speed)) * moving.values.get(f"{path}.constant", 0.0)
        square = square + speed * speed * moving.values.get(f"{path}.viscous", 0.0)
    return steady, square


def _senses(motion: FreeMotion, moving: Forward, sense: float) -> dict[str, Sense]:
    """Which way each load that resists a joint acts, for a sense of the coordinate."""
    return {joint: sense * np.sign(moving.speed(joint) + 0.0 * moving.time) for joint in motion.system.resisted}


def _summed(walk: Forward, one: dict[str, Any], other: dict[str, Any], factor: float = 1.0) -> dict[str, Any]:
    algebra = walk.algebra
    return {link: algebra.added(load, algebra.times(factor, other[link])) for link, load in one.items()}


def _column(motion: FreeMotion, walk: Forward, contacts: Sequence[tuple[str, Any]], loads: dict[str, Any]) -> list[Any]:
    """E and every component under some loads."""
    ground = motion.system.mechanism.fixed_link
    back = under(walk, {link: load for link, load in loads.items() if link != ground})
    found = [back.efforts[motion.names[0]]]
    for joint, one in contacts:
        found += _components(one.load, back.module_reactions[joint])
    return found
