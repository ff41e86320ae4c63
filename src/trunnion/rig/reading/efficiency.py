"""Efficiency as a test rig finds it, η = P_out/P_in = T_out ω_out/(T_in ω_in) [P 22], with its uncertainty.

Powers are means over the time of whole turns of the product of torque and speed at each position. Positions are equal
steps of the crank angle: each counts by the time that the driver dwells there, 1/ω of its mean course, for a mean over
equal angles is off by the first order of a speed that varies within the turn. The uncertainty follows the Guide
to the expression of uncertainty in measurement (JCGM 100:2008): type A from the ratios of the single turns (4.2), type
B from gain, zero and resolution of every channel, each with its sensitivity ∂η/∂x (5.1). A channel that stands on both
sides, such as one speed sensor for both, has its errors in both. Gain, zero and resolution of different channels are
taken as independent.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.rig.reading.measurement import Condition, Signal, student

if TYPE_CHECKING:
    from trunnion.model.mechanism import Mechanism

__all__ = ["COVERAGE", "Efficiency", "Pairs", "UncertaintyContribution", "efficiency_of", "load_joints", "pairs_of"]

COVERAGE = 2.0
"""Factor k of the expanded uncertainty U = k u where turns are many: 95.45 % of a normal distribution (GUM 6.3.3)."""

LACKING = 0.1
"""Share of its positions that a turn may lack and still count."""

Array = NDArray[np.float64]
Source = Literal["gain", "zero", "resolution", "repeatability"]


@dataclass(frozen=True)
class UncertaintyContribution:
    """What one source of one channel does to the efficiency; channel: empty of the scatter between turns.

    input: its standard uncertainty, of a gain relative, else in the unit of the channel; sensitivity: ∂η/∂ of it;
    effect: the standard uncertainty of η by it alone, |sensitivity| · input.
    """

    channel: str
    source: Source
    input: float
    sensitivity: float

    @property
    def effect(self) -> float:
        return abs(self.sensitivity) * self.input


@dataclass(frozen=True)
class Efficiency:
    """An efficiency measured in one condition.

    value: mean power out over mean power in, over the time of all whole turns; uncertainty: standard; power_in,
    power_out: W; per_turn: ratios of the single turns; left_out: turns that lack more than LACKING of their positions.
    """

    value: float
    uncertainty: float
    power_in: float
    power_out: float
    per_turn: Array
    contributions: tuple[UncertaintyContribution, ...]
    left_out: int = 0

    @property
    def freedom(self) -> float:
        """Effective degrees of freedom: those of the scatter between turns by its share of u². GUM, G.4.1."""
        scatter = sum(one.effect for one in self.contributions if one.source == "repeatability")
        share = self.uncertainty / scatter if scatter > 0 else float("inf")
        square = share * share  # not a power: near the end of the floats that is an error
        return (self.turns - 1) * square * square if scatter > 0 else float("inf")

    def factor(self, coverage: float = COVERAGE) -> float:
        """k of U = k u: Student's for the freedom, with the probability that `coverage` has of a normal one."""
        return float(student(self.freedom, coverage))

    @property
    def expanded(self) -> float:
        """U = k u with k for 95.45 %."""
        return self.factor() * self.uncertainty

    @property
    def turns(self) -> int:
        """Whole turns that it is made of."""
        return len(self.per_turn)

    def __str__(self) -> str:
        return f"η = {self.value:.4f} ± {self.expanded:#.2g} (k = {self.factor():.2g})"


@dataclass(frozen=True)
class Pairs:
    """The courses whose products are powers: (torque or force, speed), of drivers and of loads."""

    driven: tuple[tuple[Signal, Signal], ...]
    loaded: tuple[tuple[Signal, Signal], ...]


def load_joints(mechanism: Mechanism) -> dict[str, str]:
    """The joint that each load on a joint acts in, by name of the load."""
    return {name: load.joint for name, load in mechanism.loads.items() if load.joint is not None}


def pairs_of(condition: Condition, joints: Mapping[str, str] | None = None) -> Pairs | None:
    """The channels that tell power in and out: `effort:D` with `rate:D`, `load:L` with `rate:` of its joint.

    joints: of the loads, see `load_joints`. Without it a load goes with the one measured speed that is no driver's, or
    with the only one there is. None where a torque or its speed is missing.
    """
    subjects: dict[str, dict[str, Signal]] = {"effort": {}, "rate": {}, "load": {}}
    for course in condition.courses.values():
        kind, _, subject = course.measures.partition(":")
        if kind in subjects:
            subjects[kind].setdefault(subject, course)
    efforts, rates, loads = subjects["effort"], subjects["rate"], subjects["load"]
    free = [name for name in rates if name not in efforts] or list(rates)
    guessed = free[0] if len(free) == 1 else ""
    places = {name: (joints or {}).get(name, guessed) for name in loads}
    if not efforts or not loads or any(name not in rates for name in (*efforts, *places.values())):
        return None
    return Pairs(
        tuple((course, rates[name]) for name, course in efforts.items()),
        tuple((course, rates[places[name]]) for name, course in loads.items()),
    )


def efficiency_of(condition: Condition, joints: Mapping[str, str] | None = None) -> Efficiency:
    """The efficiency of one condition, with its standard uncertainty.

    joints: see `pairs_of`. With fewer than two whole turns the scatter is not known, and the uncertainty is NaN.
    Raises MechanismError where the channels do not tell both powers, no turn is whole, or no power goes in.
    """
    pairs = pairs_of(condition, joints)
    if pairs is None:
        there = ", ".join(f"{name} ({course.measures})" for name, course in condition.courses.items()) or "none"
        what = f"the channels do not measure input and output power; there are {there}"
        remedy = "measure effort: and rate: of the driver, load: of a load on a joint and rate: of that joint"
        raise MechanismError(Finding(what, condition.name, remedy))
    dwell, timing = _dwell(pairs, condition)
    powers_in, powers_out, whole = _filled(
        *(np.sum([dwell * force.turns * speed.turns for force, speed in side], axis=0)  # NaN where one has a gap
          for side in (pairs.driven, pairs.loaded))
    )  # fmt: skip
    left_out = int(np.count_nonzero(~whole))
    if not np.any(whole):
        what = f"no turn is whole in all channels of {len(whole)}"
        raise MechanismError(Finding(what, condition.name, "see the gaps reported by `trunnion data`"))
    power_in, power_out = float(np.mean(powers_in)), float(np.mean(powers_out))
    if not power_in:
        zero = " or ".join(one.channel for pair in pairs.driven for one in pair)
        what = f"there is no input power: {zero} reads 0 throughout"
        raise MechanismError(Finding(what, condition.name, "check these channels: a sensor may have failed"))
    value = power_out / power_in
    with np.errstate(all="ignore"):
        per_turn = powers_out / powers_in
    weights = _weights(pairs, value, power_in, whole, dwell, timing)
    scatter = float(np.std(per_turn, ddof=1)) / len(per_turn) ** 0.5 if len(per_turn) > 1 else float("nan")
    contributions = [UncertaintyContribution("", "repeatability", scatter, 1.0)] if scatter != 0 else []
    for name, (course, weight) in weights.items():  # of what it reads, x → (1 + gain) x + zero
        by_zero, read = float(np.nanmean(weight)), course.turns - course.accuracy.datum
        every = [
            UncertaintyContribution(name, "gain", course.accuracy.gain, float(np.nanmean(weight * read))),
            UncertaintyContribution(name, "zero", course.accuracy.zero, by_zero),
            UncertaintyContribution(name, "resolution", course.unresolved, by_zero),
        ]
        contributions += [one for one in every if one.input > 0]
    uncertainty = float(np.sqrt(sum(one.effect * one.effect for one in contributions)))
    return Efficiency(value, uncertainty, power_in, power_out, per_turn, tuple(contributions), left_out)


def _dwell(pairs: Pairs, condition: Condition) -> tuple[Array, list[Signal]]:
    """Time that the driver spends at each position, (position,), 1 in the mean, and the course it was taken from.

    By the driver whose mean speed is that of the angle; equal, of no course, if it does not turn one way throughout or
    the cycle is a time. By the mean course, not that of each turn: 1/ω of a noisy ω is too large by its variance.
    """
    if np.isfinite(condition.speed):
        speeds = [(abs(abs(float(np.mean(speed.mean))) - abs(condition.speed)), speed) for _, speed in pairs.driven]
        driver = min(speeds, key=lambda one: one[0])[1]
        if np.isfinite(driver.mean).all() and np.min(driver.mean) * np.max(driver.mean) > 0:
            dwell = 1 / np.abs(driver.mean)
            return dwell / np.mean(dwell), [driver]
    return np.ones(len(condition.phase)), []


def _filled(powers_in: Array, powers_out: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Mean powers of each whole turn, W, and which turns are.

    A position that few of a turn lack is given both powers of the other turns there, in the mean: to leave it out would
    put the turn's mean off by what a course has of its own there. A turn that lacks more is left out.
    """
    there = np.isfinite(powers_in) & np.isfinite(powers_out)
    whole = np.mean(~there, axis=1) <= LACKING
    whole &= np.any(there[whole], axis=0).all()  # else nothing is known of a position
    found = []
    for powers in (powers_in[whole], powers_out[whole]):
        known = there[whole]
        usual = np.sum(powers, axis=0, where=known) / np.maximum(np.sum(known, axis=0), 1)
        found.append(np.mean(np.where(known, powers, usual), axis=1))
    return found[0], found[1], whole


def _weights(
    pairs: Pairs, value: float, power_in: float, whole: NDArray[np.bool_], dwell: Array, timing: Sequence[Signal]
) -> dict[str, tuple[Signal, Array]]:
    """∂η/∂x of the readings of each channel, at every position of all whole turns; its mean is that of a zero.

    η = P_out/P_in: dη = (dP_out − η dP_in)/P_in, and a power changes with a torque by ω, with a speed by T, each by the
    dwell there; the dwell itself with 1/ω of its channel. A channel in several powers has the sum.
    """
    found: dict[str, tuple[Signal, Array]] = {}
    for side, factor in ((pairs.driven, -value), (pairs.loaded, 1.0)):
        for force, speed in side:
            by = factor / power_in * dwell
            parts = [(force, by * speed.turns[whole]), (speed, by * force.turns[whole])]
            power = force.turns[whole] * speed.turns[whole]
            parts += [(one, -by * power / one.mean) for one in timing]
            for own, weight in parts:
                before = found.get(own.channel)
                found[own.channel] = (own, weight if before is None else before[1] + weight)
    return {name: (Signal(name, one.measures, one.unit, one.turns[whole], one.accuracy), weight)
            for name, (one, weight) in found.items()}  # fmt: skip
