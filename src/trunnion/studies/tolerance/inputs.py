"""What varies from one mechanism to the next: toleranced numbers, and where pins lie in their holes.

A toleranced number is its value as built plus a random deviation (`statistics.distributions`). A pin in a play that no
seat decides lies anywhere in its hole: each end uniform over its interval, disc or ball, whose radius is that of the
sample. It keeps that place on the link of the hole as the joint turns, or on the one that the model names. A run-out
has a random size and a direction that is uniform over a turn.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, derivative
from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError
from trunnion.model.tolerances import FULL_TURN, Tolerance
from trunnion.solve import shifts
from trunnion.solve.run import Run
from trunnion.solve.shifts import Play, given_offsets
from trunnion.statistics.distributions import Marginal, Population, correlated

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Inputs:
    """The random numbers of a mechanism, in the order in which they are drawn.

    tolerances: of numbers, drawn from the population; loose: joints whose pins may lie anywhere in their holes; held:
    those whose seats are given; pressed: those whose pins lie where their loads press them, which the kernel finds.
    """

    run: Run
    tolerances: tuple[Tolerance, ...]
    loose: tuple[str, ...]
    held: tuple[str, ...]
    pressed: tuple[str, ...]
    population: Population

    @property
    def names(self) -> list[str]:
        """Paths of the toleranced numbers, and `joints.NAME.clearance` for every pin that may lie anywhere."""
        return [
            *(tolerance.path for tolerance in self.tolerances),
            *(f"joints.{name}.clearance" for name in self.loose),
        ]

    @cached_property
    def nominal(self) -> dict[str, Number]:
        """The numbers of the nominal mechanism, pins in the seats that are given."""
        values: dict[str, Number] = {**self.run.values}
        for joint in self.held:
            values.update(self.seat(joint, self.run.values))
        return values

    @cached_property
    def dims(self) -> int:
        """How many uniform numbers a sample takes."""
        return sum(map(len, self.parts))

    @property
    def parts(self) -> list[list[int]]:
        """Which of the uniform numbers each of `names` is drawn from."""
        parts: list[list[int]] = [[i] for i in range(len(self.tolerances))]
        place = len(self.tolerances)
        for rows, tolerance in zip(parts, self.tolerances, strict=True):
            if tolerance.direction:
                rows.append(place)
                place += 1
        for name in self.loose:
            count = sum(len(end) for end in self.ends(name))
            parts.append(list(range(place, place + count)))
            place += count
        return parts

    def ends(self, joint: str) -> Sequence[Sequence[str]]:
        """Names of the components of the pin's offset at each end of a joint's hole."""
        return self.play(joint, self.run.values).model.ends

    def carriers(self, joint: str) -> tuple[str, ...]:
        """Which of `shifts.CARRIERS` may carry the seat of a pin as the joint turns; the first does in samples."""
        return shifts.carriers_of(self.run.system.mechanism, joint)

    def angle(self, i: int) -> str:
        """Path of the angle that a toleranced number is, or that goes with it."""
        return self.tolerances[i].direction or self.tolerances[i].path

    @cached_property
    def duals(self) -> dict[str, Number]:
        """Every number with its derivatives by all toleranced numbers, then by the angle that each is or goes with."""
        count = len(self.tolerances)
        seeds = np.eye(2 * count)[:, :, None]
        deviations = {tolerance.path: Dual(0.0, seeds[i]) for i, tolerance in enumerate(self.tolerances)}
        for i, each in enumerate(self.tolerances):  # the angle of a run-out is no toleranced number
            if each.direction or each.distribution == FULL_TURN:
                path, seed = self.angle(i), Dual(0.0, seeds[count + i])
                deviations[path] = deviations[path] + seed if path in deviations else seed
        return self.run.system.mechanism.parameters(deviations=deviations)

    def derivatives(self, number: Number) -> Array:
        """The derivatives of one of `duals`, or of what follows from them, (2 × number,)."""
        return np.broadcast_to(np.asarray(derivative(number), float), (2 * len(self.tolerances), 1))[:, 0]

    @cached_property
    def turned(self) -> dict[int, int]:
        """Of each toleranced number that changes the size of what points anywhere, which of them is the direction."""
        angles = [i for i, each in enumerate(self.tolerances) if each.direction or each.distribution == FULL_TURN]
        count = len(self.tolerances)
        if not angles:
            return {}
        values = self.duals
        # sizes, and the path of the direction they point in: of misaligned axes and of seats that are given
        directed: list[tuple[Sequence[Number], str]] = []
        for joint in self.run.system.joints:
            path = f"joints.{joint}.misalignment"
            aside = "offset_towards" if f"{path}.offset_towards" in values else "towards"
            for size, angle in ((f"{path}.tilt", f"{path}.towards"), (f"{path}.offset", f"{path}.{aside}")):
                if {size, angle} <= values.keys():
                    directed.append(([values[size]], angle))
        for joint in self.held:
            seats = (f"joints.{joint}.seat.{key}" for key in ("xi", "beta"))
            directed += [(self.play(joint, values).radii, angle) for angle in seats if angle in values]
        directions: dict[int, int] = {}
        for sizes, towards in directed:
            turning = [i for i in angles if self.derivatives(values[towards])[count + i]]
            numbers = [i for i in range(count) if i not in angles and any(self.derivatives(size)[i] for size in sizes)]
            directions.update({i: turning[0] for i in numbers if turning})
        return directions

    def play(self, joint: str, values: Mapping[str, Number]) -> Play:
        """The play of a loose or held joint with these numbers."""
        play = shifts.play_of(self.run.system.mechanism.space, self.run.system.joints[joint].type, values, joint)
        assert play is not None  # else it would be neither
        return play

    def values(self, u: Array, rotation: Array | None = None) -> dict[str, Number]:
        """Every number of the mechanism, (sample, 1) where it varies, from u, (dims, sample), uniform in (0, 1).

        rotation: orthogonal, of the normal scores of the toleranced numbers; it changes none of their distributions.
        """
        count = len(self.tolerances)
        rest = iter(u[count:])
        scores = u[:count] if rotation is None else correlated(u[:count], rotation)
        deviations: dict[str, Number] = {}
        turned: dict[str, Number] = {}
        for tolerance, row in zip(self.tolerances, self.population.draw(scores), strict=True):
            deviations[tolerance.path] = row[:, None]
            if tolerance.direction:
                turned[tolerance.direction] = (2 * np.pi * next(rest) - np.pi)[:, None]
        values = self.run.system.mechanism.parameters(turned, deviations)
        for joint in self.loose:
            play, offsets = self.play(joint, values), []
            for end, radius in zip(play.model.ends, play.radii, strict=True):
                unit = within([next(rest) for _ in end])
                room = np.maximum(radius, 0.0)  # a fit that presses leaves none
                offsets.append(tuple(room * part[:, None] for part in unit))
            values.update(play.model.paths(f"{self.carriers(joint)[0]}.{joint}", offsets))
        for joint in self.held:
            values.update(self.seat(joint, values))
        return values

    def seat(self, joint: str, values: Mapping[str, Number]) -> dict[str, Number]:
        """Offsets of a pin whose seat is given."""
        play = self.play(joint, values)
        return play.model.paths(f"seats.{joint}", given_offsets(values, joint, play))


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
    seated = tuple(seat.joint for seat in run.seats if seat.given is not None)
    pressed = tuple(seat.joint for seat in run.seats if seat.given is None)
    plays = plays_of(run)
    loose = tuple(name for name in plays if name not in (*seated, *pressed))
    if not tolerances and not loose:
        remedy = "write `60 mm ± 0.05 mm`, an entry in `tolerances`, or a clearance of a joint without a seat"
        raise MechanismError(Finding("nothing has a tolerance or a clearance", "tolerances", remedy))
    findings = []
    for tolerance in tolerances if len(mechanism.drivers) > 1 else ():
        section, *rest = tolerance.path.split(".")
        if section == "drivers" and rest[1:2] != ["start"]:
            what = "it cannot vary alone: the drivers would have different cycle times"
            remedy = "leave it out, or vary the start of the driver"
            findings.append(Finding(what, f"tolerances.{tolerance.path}", remedy))
    if findings:
        raise MechanismError(findings)
    marginals = [
        Marginal(tolerance.distribution, tolerance.lower, tolerance.upper, tolerance.options)
        for tolerance in tolerances
    ]
    return Inputs(run, tolerances, loose, seated, pressed, Population(marginals, mechanism.correlation()))


def plays_of(run: Run) -> dict[str, Play]:
    """The plays of all joints that have one; MechanismError for one without a length over which its pin leans."""
    space, plays = run.system.mechanism.space, dict[str, Play]()
    for name, joint in run.system.joints.items():
        if (play := shifts.play_of(space, joint.type, run.values, name)) is not None:
            plays[name] = play
    findings = [finding for name, play in plays.items() for finding in shifts.unstated_length(name, play)]
    if findings:
        raise MechanismError(findings)
    return plays
