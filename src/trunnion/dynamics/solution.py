"""What an integration in time found: stretches between events, the events, and why it ended early."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Courses
from trunnion.algebra.panels import FIT, POINTS
from trunnion.dynamics.followed import Snapshot
from trunnion.dynamics.rates import Layout
from trunnion.dynamics.state import Mode, Moment

Array = NDArray[np.float64]

CLOSE = 1e-13  # of the time or coordinate: places that are one


class Event(NamedTuple):
    """Something that happens at a time, s: its kind, what it happens to, and a figure with its unit."""

    time: float
    kind: str
    of: str
    figure: float = np.nan
    unit: str = ""


@dataclass
class Impact:
    """One contact from onset to lift-off: its label, begin and end, s (NaN while it lasts), speed of approach and of
    separation, m/s, largest normal force, N, and penetration, m, wear index ∫ |F| |slip| dt, J, and impulse ∫ F dt,
    N s."""

    label: str
    begin: float
    approach: float
    end: float = np.nan
    separation: float = np.nan
    force: float = 0.0
    depth: float = 0.0
    wear: float = 0.0
    impulse: float = 0.0


class Stretch(NamedTuple):
    """A time without events: begin and end, s, and the state in between, (time,) -> (number, time).

    mode: what is so all the while; resting: whether all free coordinates rest; snapshot: from which the assembly goes
    on, where it is followed.
    """

    begin: float
    end: float
    state: Callable[[Array], Array]
    mode: Mode
    resting: bool = False
    snapshot: Snapshot | None = None

    def at(self, layout: Layout, time: Array) -> Moment:
        """The moments of some times, s."""
        return layout.moment(time, np.asarray(self.state(time)), self.mode)


class Ended(NamedTuple):
    """Why an integration ended before its time."""

    code: str
    time: float
    figures: dict[str, Any]


@dataclass
class Solution:
    """What an integration found: stretches one after the other, events, and why it ended early, if it did.

    notes: figures of findings by their code; impacts: contacts of joints in play, by their begin at the end.
    """

    layout: Layout
    stretches: list[Stretch] = field(default_factory=list)
    events: list[Event] = field(default_factory=list)
    ended: Ended | None = None
    asked: int = 0
    notes: dict[str, dict[str, Any]] = field(default_factory=dict)
    impacts: list[Impact] = field(default_factory=list)

    @property
    def end(self) -> float:
        """The time until which there is a motion, s."""
        return self.stretches[-1].end if self.stretches else 0.0

    def at(self, time: Array) -> tuple[Array, NDArray[np.intp]]:
        """State (number, time) and number of the stretch at rising times; NaN, −1 after the end."""
        rows_at = np.full((self.layout.size, len(time)), np.nan)
        which = np.full(len(time), -1, np.intp)
        ends = np.array([stretch.end for stretch in self.stretches])
        # the end is reached but for rounding
        time = np.where((time > self.end) & (time <= self.end * (1 + 2 * CLOSE)), self.end, time)
        number = np.searchsorted(ends, time)
        for lanes in np.split(np.arange(len(time)), np.flatnonzero(np.diff(number)) + 1) if len(time) else []:
            if (k := number[lanes[0]]) < len(ends):
                rows_at[:, lanes] = self.stretches[k].state(time[lanes])
                which[lanes] = k
        return rows_at, which


def step_nodes(begins: Array) -> Array:
    """Times at whose values the polynomials of steps are, (step, node), s; begins: of the steps, and the last end."""
    return np.asarray(0.5 * (begins[1:] + begins[:-1])[:, None] + 0.5 * np.diff(begins)[:, None] * POINTS)


def over_steps(begins: Array, numbers: Array) -> Courses:
    """Numbers at `step_nodes`, (row, step, node), as courses: each step is a polynomial, as is its dense output."""
    coefficients = np.moveaxis(numbers @ FIT.T, 0, 1)
    sizes = np.max(np.abs(numbers), axis=(1, 2))
    return Courses(begins, coefficients, np.zeros(len(begins) - 1, np.intp), begins, sizes, numbers[0].size)
