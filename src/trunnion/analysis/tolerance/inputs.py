"""What varies from one mechanism to the next: toleranced numbers, and where pins lie in their holes.

A toleranced number is its value as built plus a random deviation (`statistics.distributions`). A pin in a play that no
seat decides lies anywhere in its hole: each end uniform over its interval, disc or ball, whose radius is that of the
sample. A run-out has a random size and a direction that is uniform over a turn.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.analysis import shifts
from trunnion.analysis.analyse import Run
from trunnion.analysis.seating import given_offsets
from trunnion.analysis.shifts import Play
from trunnion.errors import Finding, MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.model.tolerances import Tolerance
from trunnion.statistics.population import Marginal, Population
from trunnion.statistics.streams import correlated

__all__ = ["Inputs", "inputs_of"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Inputs:
    """The random numbers of a mechanism, in the order in which they are drawn.

    tolerances: of numbers, drawn from the population; loose: joints whose pins may lie anywhere in their holes; held:
    those whose seats are given.
    """

    run: Run
    tolerances: tuple[Tolerance, ...]
    loose: tuple[str, ...]
    held: tuple[str, ...]
    population: Population

    @property
    def names(self) -> list[str]:
        """Paths of the toleranced numbers, and `joints.NAME.clearance` for every pin that may lie anywhere."""
        return [*(one.path for one in self.tolerances), *(f"joints.{name}.clearance" for name in self.loose)]

    @cached_property
    def dims(self) -> int:
        """How many uniform numbers a sample takes."""
        play = sum(len(end) for name in self.loose for end in self.ends(name))
        return len(self.tolerances) + sum(bool(one.direction) for one in self.tolerances) + play

    @property
    def parts(self) -> list[list[int]]:
        """Which of the uniform numbers each of `names` is drawn from."""
        found: list[list[int]] = [[i] for i in range(len(self.tolerances))]
        place = len(self.tolerances)
        for own, tolerance in zip(found, self.tolerances, strict=True):
            if tolerance.direction:
                own.append(place)
                place += 1
        for name in self.loose:
            count = sum(len(end) for end in self.ends(name))
            found.append(list(range(place, place + count)))
            place += count
        return found

    def ends(self, joint: str) -> Sequence[Sequence[str]]:
        """Names of the components of the pin's offset at each end of a joint's hole."""
        play = self.play(joint, self.run.values)
        assert play is not None  # else it would not be loose
        return play.model.ends

    def play(self, joint: str, values: Mapping[str, Number]) -> Play | None:
        """The play of a joint with these numbers."""
        return shifts.play_of(self.run.system.mechanism.space, self.run.system.joints[joint][0], values, joint)

    def values(self, u: Array, rotation: Array | None = None) -> dict[str, Number]:
        """Every number of the mechanism, (sample, 1) where it varies, from u, (dims, sample), uniform in (0, 1).

        rotation: orthogonal, of the normal scores of the toleranced numbers; it changes none of their distributions.
        """
        count = len(self.tolerances)
        rest = iter(u[count:])
        own = u[:count] if rotation is None else correlated(u[:count], rotation)
        deviations: dict[str, Number] = {}
        turned: dict[str, Number] = {}
        for tolerance, row in zip(self.tolerances, self.population.draw(own), strict=True):
            deviations[tolerance.path] = row[:, None]
            if tolerance.direction:
                turned[tolerance.direction] = (2 * np.pi * next(rest) - np.pi)[:, None]
        values = self.run.system.mechanism.parameters(turned, deviations)
        for joint in self.loose:
            values.update(self._anywhere(joint, values, rest))
        for joint in self.held:
            values.update(self.seat(joint, values))
        return values

    def seat(self, joint: str, values: Mapping[str, Number]) -> dict[str, Number]:
        """Offsets of a pin whose seat is given."""
        play = self.play(joint, values)
        assert play is not None  # a seat is one of a play
        return play.model.paths(f"seats.{joint}", given_offsets(values, joint, play))

    def _anywhere(self, joint: str, values: Mapping[str, Number], rest: object) -> dict[str, Number]:
        """Offsets of a pin at each end, uniform over the interval, disc or ball."""
        play = self.play(joint, values)
        assert play is not None
        offsets = []
        for end, radius in zip(play.model.ends, play.radii, strict=True):
            unit = within([next(rest) for _ in end])  # type: ignore[call-overload]
            room = np.maximum(radius, 0.0)  # a fit that presses leaves none
            offsets.append(tuple(room * part[:, None] for part in unit))
        return play.model.paths(f"seats.{joint}", offsets)


def within(u: Sequence[Array]) -> list[Array]:
    """Points uniform over the interval (−1, 1), the unit disc or the unit ball, from as many numbers in (0, 1)."""
    if len(u) == 1:
        return [2 * u[0] - 1]
    angle = 2 * np.pi * u[1]
    if len(u) == 2:
        radius = np.sqrt(u[0])
        return [radius * np.cos(angle), radius * np.sin(angle)]
    radius, height = np.cbrt(u[0]), 2 * u[2] - 1
    across = radius * np.sqrt(1 - height * height)
    return [across * np.cos(angle), across * np.sin(angle), radius * height]


def inputs_of(run: Run) -> Inputs:
    """The random numbers of a mechanism. Raises MechanismError if nothing varies, or a play has no length."""
    mechanism = run.system.mechanism
    tolerances = tuple(mechanism.tolerated())
    given = {seat.joint for seat in run.seats if seat.given is not None}
    plays = {name: play for name in run.system.joints if (play := _play(run, name)) is not None}
    loose = tuple(name for name in plays if name not in given)
    held = tuple(name for name in plays if name in given)
    if not tolerances and not loose:
        remedy = "write `60 mm ± 0.05 mm`, an entry in `tolerances`, or a clearance of a joint"
        raise MechanismError(Finding("nothing has a tolerance or a clearance", "tolerances", remedy))
    findings = list(_uneven(mechanism, tolerances))
    for name, play in plays.items():
        findings += shifts.unstated_length(name, play)
    if findings:
        raise MechanismError(findings)
    marginals = [Marginal(one.distribution, one.lower, one.upper, one.options) for one in tolerances]
    return Inputs(run, tolerances, loose, held, Population(marginals, mechanism.correlation()))


def _uneven(mechanism: Mechanism, tolerances: Sequence[Tolerance]) -> Iterator[Finding]:
    """Speeds and ranges that vary while there are other drivers, which would no longer be at the same positions."""
    for one in tolerances:
        section, _, rest = one.path.partition(".")
        key = rest.partition(".")[2].partition(".")[0]
        if section == "drivers" and len(mechanism.drivers) > 1 and key != "start":
            what = "it cannot vary alone: the drivers would no longer be at the same positions together"
            yield Finding(what, f"tolerances.{one.path}", "leave it out, or vary the start of the driver")


def _play(run: Run, joint: str) -> Play | None:
    return shifts.play_of(run.system.mechanism.space, run.system.joints[joint][0], run.values, joint)
