"""Motion in time with joints in play: from onset to lift-off of every contact.

A step ends where a gap closes or opens, so that every step is taken through smooth forces. Between contacts the pin
flies; the forces of a contact come with its onset, whose speed of approach its law needs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from trunnion.dynamics.guards import Crossing
from trunnion.dynamics.integrate import Integration
from trunnion.dynamics.rates import Seeing, Seen
from trunnion.dynamics.solution import Event, Stretch
from trunnion.dynamics.touching import FIRST, SLOWEST, Onset
from trunnion.joints.contact import elastic_force

__all__ = ["ContactMotion", "Impact", "OpenContact", "step_nodes"]

Array = NDArray[np.float64]
Rate = Callable[[float, Array], Array]
Dense = Callable[[Array], Array]  # the state by time, (time,) -> (number, time)

CLOSELY = 33  # times about a largest force
GAUSS = np.array(np.polynomial.legendre.leggauss(10))  # nodes in −1 … 1, and weights
NEARLY = 1e-3  # of the largest force so far: a step that comes as near may hold a larger one


class Impact(NamedTuple):
    """One contact from onset to lift-off: its label, begin and end, s (NaN while it lasts), speed of approach and of
    separation, m/s, largest normal force, N, and penetration, m, wear index ∫ |F| |slip| dt, J, impulse ∫ F dt, N s,
    and what the contact law has lost, J."""

    label: str
    begin: float
    end: float
    approach: float
    separation: float
    force: float
    depth: float
    wear: float
    impulse: float
    loss: float = 0.0


@dataclass
class OpenContact:
    """A contact that lasts: its onset, and what it has come to so far."""

    begin: float
    approach: float
    force: float = 0.0
    depth: float = 0.0
    wear: float = 0.0
    impulse: float = 0.0
    separation: float = 0.0
    loss: float = 0.0


@dataclass
class ContactMotion(Integration):
    """An integration that follows the contacts of `motion`. impacts: those that are over."""

    impacts: list[Impact] = field(default_factory=list)

    def __post_init__(self) -> None:
        super().__post_init__()
        each = self.motion.contacts.each
        self.seeing = cast("Seeing", self.dynamics)
        self.onsets = (None,) * len(each)
        self._open: dict[int, OpenContact] = {}
        self._clearance = self.motion.contacts.least_clearance

    def _rate(self, sense: float, now: float, between: tuple[float, float]) -> Rate:
        """The derivative of a row by time."""

        def rate(moment: float, numbers: Array) -> Array:
            self.solution.asked += 1
            inside = numbers.copy()
            inside[: len(self.motion.names)] = self._in_range(numbers[: len(self.motion.names)])
            if not np.all(np.isfinite(numbers)):
                return numbers * np.nan
            return self.seeing.derivative(moment, inside, self.onsets, now, self.senses)

        return rate

    # ---- gaps -------------------------------------------------------------------------------------------------

    def _look(self, dense: Dense, times: Array) -> Seen:
        """The contacts at times of a step."""
        at = self.layout.moment(times, np.asarray(dense(times)))._replace(onsets=self.onsets)
        with np.errstate(all="ignore"):
            return self.seeing.look(at)

    def _values(self, stretch: Stretch) -> Callable[[Array], Array] | None:
        return partial(self._gaps, stretch.state)

    def _gaps(self, dense: Dense, times: Array) -> Array:
        """Gaps, m, (contact, time), negative where a contact that touches is open or another has closed."""
        sign = np.array([1.0 if onset is None else -1.0 for onset in self.onsets])
        found: Array = sign[:, None] * self._look(dense, times).gap
        return found

    def _changed(self, crossing: Crossing, row: Array) -> float:
        """Let a contact begin or end; how long the first step after it may be, s."""
        k, time = crossing
        label = self.motion.contacts.labels[k]
        rate = float(self._look(lambda times: row[:, None], np.array([time])).rate[k, 0])
        onsets: list[Onset] = list(self.onsets)
        if onsets[k] is None:
            onsets[k] = max(-rate, SLOWEST)
            self._open[k] = OpenContact(time, max(-rate, 0.0))
            self.solution.events.append(Event(time, "impact", label, -rate, "m/s"))
        else:
            onsets[k] = None
            one = self._open.pop(k)
            self.impacts.append(
                Impact(
                    label, one.begin, time, one.approach, rate, one.force, one.depth, one.wear, one.impulse, one.loss
                )
            )
            self.solution.events.append(Event(time, "lift-off", label, rate, "m/s"))
        self.onsets = tuple(onsets)
        return FIRST * self._clearance / max(abs(rate), SLOWEST)

    # ---- what a contact comes to ------------------------------------------------------------------------------

    def _measured(self, stretch: Stretch) -> None:
        """Peaks, impulse, wear and loss of the contacts that last, of a step: by Gauss and Legendre's rule on its dense
        output, between places where a slip turns round."""
        if not self._open:
            return
        dense, begin, end = stretch.state, stretch.begin, stretch.end
        times, weights = step_nodes(begin, end)
        seen = self._look(dense, times)
        for k, one in self._open.items():
            contact = self.motion.contacts.each[k]
            normal, slip = seen.normal[k], seen.slip[k]
            elastic = elastic_force(-seen.gap[k], contact.stiffness, contact.exponent)
            one.impulse += float(weights @ normal)
            one.loss += float(weights @ ((elastic - normal) * seen.rate[k]))
            turns = np.flatnonzero(slip[1:] * slip[:-1] < 0.0)
            if len(turns):
                places = [self._turn(dense, k, times[i], times[i + 1]) for i in turns]
                one.wear += self._rubbed(dense, k, [begin, *places, end])
            else:
                one.wear += float(weights @ np.abs(normal * slip))
            one.force = self._largest(dense, times, seen.normal[k], k, 1, one.force)
            one.depth = self._largest(dense, times, -seen.gap[k], k, -1, one.depth)

    def _turn(self, dense: Dense, k: int, low: float, high: float) -> float:
        """When the slip of a contact turns round."""
        return float(brentq(lambda time: float(self._look(dense, np.array([time])).slip[k, 0]), low, high))

    def _rubbed(self, dense: Dense, k: int, ends: list[float]) -> float:
        """Wear index of a contact, J, over parts of a step."""
        found = 0.0
        for begin, end in pairwise(ends):
            times, weights = step_nodes(begin, end)
            seen = self._look(dense, times)
            found += float(weights @ np.abs(seen.normal[k] * seen.slip[k]))
        return found

    def _largest(self, dense: Dense, times: Array, seen: Array, k: int, what: int, known: float) -> float:
        """The largest normal force (what: 1) or penetration (−1) of a contact, from before and within a step: looked at
        closely where it may be the largest."""
        top = int(np.argmax(seen))
        if seen[top] > (1.0 - NEARLY) * known:
            low, high = times[max(top - 1, 0)], times[min(top + 1, len(times) - 1)]
            close = self._look(dense, np.linspace(low, high, CLOSELY))
            known = max(known, _peak(close.normal[k] if what > 0 else -close.gap[k]))
        return known

    def finished(self) -> list[Impact]:
        """All contacts, those that last at the end with an end that is not known."""
        last = [
            Impact(self.motion.contacts.labels[k], one.begin, np.nan, one.approach, np.nan, one.force, one.depth,
                   one.wear, one.impulse, one.loss)
            for k, one in self._open.items()
        ]  # fmt: skip
        return sorted([*self.impacts, *last], key=lambda one: one.begin)


def step_nodes(begin: float, end: float) -> tuple[Array, Array]:
    """Times of a step, its ends and the nodes of Gauss and Legendre's rule, s, and their weights, 0 at the ends."""
    nodes, weights = 0.5 * (end - begin) * GAUSS
    return np.concatenate([[begin], 0.5 * (begin + end) + nodes, [end]]), np.concatenate([[0.0], weights, [0.0]])


def _peak(values: Array) -> float:
    """The largest of equally spaced numbers, of the parabola through it and its neighbours."""
    k = int(np.argmax(values))
    if not 0 < k < len(values) - 1:
        return float(values[k])
    before, top, after = (float(one) for one in values[k - 1 : k + 2])
    bend = before - 2.0 * top + after
    return top if bend >= 0.0 else top - 0.125 * (after - before) ** 2 / bend
