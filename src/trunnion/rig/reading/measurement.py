"""What a measurement is to the analysis: courses over the cycle, turn by turn, with their accuracy; the efficiency.

Everything is SI. A measurement has conditions, a condition has courses, a course has one row for each turn.
"""

from __future__ import annotations

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtr, stdtrit

from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import finding_rows
from trunnion.results.dataset import MemberUnits, Variable, dataset_of, described
from trunnion.rig.reading.turns import LeftOfSteps

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
COURSE = ("condition", "channel", "position")
VARIABLES = {
    "mean": Variable(COURSE, "channel", "mean over the turns"),
    "scatter": Variable(COURSE, "channel", "standard deviation between turns"),
    "uncertainty": Variable(COURSE, "channel", "its standard uncertainty"),
    "turns": Variable(COURSE, "1", "turns with a value at the position", np.intp),
    "set": Variable(("condition", "setting"), "SI", "what was set"),
    "speed": Variable(("condition",), "rad/s", "mean speed of the driver"),
    "phase": Variable(("position",), "1", "share of the cycle"),
}


@dataclass(frozen=True)
class Accuracy:
    """Standard uncertainties of a channel that averaging does not lessen, in the unit of the course.

    zero, gain (relative): the same at every position of all turns of a file; own: the part of `zero` that each file has
    by itself, as by the mean of its unloaded stretch; datum: value at which the sensor reads 0, from where an error of
    its gain acts. resolution: step between readings, 0 if there is none; cut: beside `zero`, of readings that may be
    rounded or cut off to a step that noise does not carry them over; left: what of the error by steps all turns repeat,
    None for all of step/√12.
    """

    zero: float = 0.0
    gain: float = 0.0
    resolution: float = 0.0
    own: float = 0.0
    cut: float = 0.0
    left: LeftOfSteps | None = None
    datum: float = 0.0


@dataclass(frozen=True)
class Signal:
    """One channel in one condition.

    channel: its name in the mapping; measures: as `measures.measures.named` reads it (`effort:input`, `load:brake`);
    unit: SI; turns: (turn, position), NaN where there is nothing to be had. read_in: unit of the readings for people,
    factor to SI, where they are in a unit of what is measured: U/min. per_turn: pulses of a speed that is worked out
    from them, 0 of others; local: standard uncertainty of each position by itself, beside that of the accuracy.
    """

    channel: str
    measures: str
    unit: str
    turns: Array
    accuracy: Accuracy = Accuracy()
    read_in: tuple[str, float] = ("", 1.0)
    per_turn: int = 0
    local: Array | float = 0.0

    @property
    def shown(self) -> tuple[str, float]:
        """Unit in which values are shown, and its factor to SI: that of the readings, else SI."""
        return self.read_in if self.read_in[0] else (self.unit, 1.0)

    @cached_property
    def count(self) -> NDArray[np.intp]:
        """Turns that have a value, (position,)."""
        return np.asarray(np.count_nonzero(np.isfinite(self.turns), axis=0))

    @cached_property
    def mean(self) -> Array:
        """Mean over the turns, (position,); NaN where no turn has a value."""
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            return np.asarray(np.nanmean(self.turns, axis=0))

    @cached_property
    def scatter(self) -> Array:
        """Standard deviation between turns, (position,); NaN with fewer than two."""
        return between_turns(self.turns)

    @cached_property
    def unresolved(self) -> float:
        """Standard uncertainty by the resolution, what turns repeat of step/√12 (GUM F.2.2.1), where they scatter by
        less than half a step; more carries them over the steps, and their mean is finer."""
        step, left = self.accuracy.resolution, self.accuracy.left
        if not step:
            return 0.0
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            fine = float(np.nanmedian(self.scatter)) > step / 2
        return 0.0 if fine else (1.0 if left is None else left.share) * step / 12**0.5

    @cached_property
    def uncertainty(self) -> Array:
        """Standard uncertainty of the mean, (position,); NaN with fewer than two turns."""
        return self.parts().total

    def parts(self, angle: Array | float = 0.0) -> Uncertainty:
        """Its parts: GUM (JCGM 100:2008), 4.2 and 5.1. angle: (position,), that by the angle of the drive."""
        zero = np.full_like(self.mean, np.hypot(self.accuracy.zero, self.accuracy.cut))
        random = self.scatter / np.sqrt(np.maximum(self.count, 1))
        local = np.hypot(np.full_like(random, self.unresolved), self.local)
        gain = self.accuracy.gain * (self.mean - self.accuracy.datum)  # of what the sensor reads
        shared = np.array([zero, gain, np.broadcast_to(angle, zero.shape)])
        return Uncertainty(random, local, shared, self.count, self.turns - self.mean)


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Standard uncertainty of a course, (position,), in its parts.

    random: of the mean over the turns; local: what else each position has by itself, such as the resolution; shared:
    (part, position), of the zero, the gain and the angle, each the same at all positions; turns: deviations of the
    turns from their mean, (turn, position).
    """

    random: Array
    local: Array
    shared: Array
    count: NDArray[np.intp]
    turns: Array

    @property
    def total(self) -> Array:
        """All together, NaN with fewer than two turns."""
        with np.errstate(over="ignore"):  # of numbers near the end of the floats
            return np.asarray(np.sqrt(self.random**2 + self.local**2 + np.sum(self.shared**2, axis=0)))

    @property
    def freedom(self) -> Array:
        """Effective degrees of freedom by Welch and Satterthwaite, infinite without scatter; GUM, G.4.1."""
        with np.errstate(all="ignore"):
            freedom = (self.count - 1) / (self.random**2 / self.total**2) ** 2
        return np.where(np.isfinite(freedom), freedom, np.inf)

    def expanded(self, coverage: float) -> Array:
        """U = k_p u, with k_p of Student's distribution; GUM, G.3.2."""
        return np.asarray(student(self.freedom, coverage) * self.total)

    def at(self, where: NDArray[np.bool_]) -> Uncertainty:
        """That of some of the positions."""
        return Uncertainty(*(part[..., where] for part in vars(self).values()))


@dataclass(frozen=True)
class Condition:
    """One working condition: what was set, and what was measured over the cycle.

    values: numbers of the model that were set or measured once, by name, SI; units: of those with a unit, SI; phase:
    (position,), share of the cycle from the start of the model's, in [0, 1); files: where it comes from. speed: of the
    driver, mean over the turns, rad/s, below zero where its coordinate falls; start, cycle: its coordinate at phase 0,
    and how far it goes in a cycle, rad; duration: of a cycle that is a time, s; NaN where one is not known. lag:
    standard uncertainty, s, of when the coordinate is passed, by the sampling of pulses; cut: that of the angle, rad
    with its sign, by readings that may be cut off, alike in all files of that resolution.
    """

    name: str
    values: Mapping[str, float]
    phase: Array
    courses: Mapping[str, Signal]
    files: Sequence[str] = ()
    speed: float = float("nan")
    start: float = float("nan")
    cycle: float = float("nan")
    lag: float = 0.0
    cut: float = 0.0
    units: Mapping[str, str] = field(default_factory=dict)
    duration: float = float("nan")


def between_turns(turns: Array) -> Array:
    """Standard deviation between turns, (position,) of (turn, position); NaN with fewer than two."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        return np.asarray(np.nanstd(turns, axis=0, ddof=1))


def rms(values: Array) -> float:
    """Root mean square of what is there; NaN of nothing."""
    finite = values[np.isfinite(values)]
    with np.errstate(over="ignore"):  # of numbers near the end of the floats
        return float(np.sqrt(np.mean(finite**2))) if finite.size else float("nan")


def student(freedom: Array | float, coverage: float) -> Array:
    """k_p of U = k_p u by Student's distribution, with the probability that ± coverage has of a normal one, which it is
    for infinite degrees of freedom; GUM, G.3.2."""
    freedom = np.asarray(freedom, float)
    factor = stdtrit(np.where(np.isfinite(freedom), np.maximum(freedom, 1.0), 1.0), ndtr(coverage))
    return np.asarray(np.where(np.isfinite(freedom), factor, coverage))


@dataclass(frozen=True)
class Measurement:
    """All conditions of a measurement, what there is to say of the data, and what was done to them.

    done: sentences for a report, such as the filter and its cut-off.
    """

    name: str
    conditions: tuple[Condition, ...]
    findings: tuple[Finding, ...] = ()
    done: Sequence[str] = field(default_factory=tuple)

    @property
    def channels(self) -> dict[str, Signal]:
        """The first course of each channel."""
        return {name: course for condition in reversed(self.conditions) for name, course in condition.courses.items()}


def dataset(measurement: Measurement) -> xr.Dataset:
    """Means over the turns with scatter and standard uncertainty, by condition, channel and position; SI.

    `set` has what was set, by the names of the model's values; NaN where a condition has none.
    """
    conditions, first = measurement.conditions, measurement.channels
    channels, phase = list(first), max((condition.phase for condition in conditions), key=len)
    names = list(dict.fromkeys(name for condition in conditions for name in condition.values))
    sizes = {"condition": len(conditions), "channel": len(channels), "position": len(phase), "setting": len(names)}
    arrays: dict[str, NDArray[Any]] = {name: variable.blank(sizes) for name, variable in VARIABLES.items()}
    arrays["phase"][:] = phase
    for i, condition in enumerate(conditions):
        arrays["speed"][i] = condition.speed
        arrays["set"][i] = [condition.values.get(name, np.nan) for name in names]
        for channel, course in condition.courses.items():
            at = i, channels.index(channel), slice(0, len(condition.phase))
            arrays["mean"][at], arrays["scatter"][at] = course.mean, course.scatter
            arrays["uncertainty"][at], arrays["turns"][at] = course.uncertainty, course.count
    units = {"channel": MemberUnits("channel", [first[name].unit for name in channels])}
    labels = {"condition": [condition.name for condition in conditions], "channel": channels, "setting": names}
    attributes = {
        "name": measurement.name,
        "measured": [first[name].measures for name in channels],
        "done": list(measurement.done),
        "findings": finding_rows(measurement.findings),
    }
    along = described({"phase": arrays.pop("phase")}, VARIABLES)
    return dataset_of("measurement", described(arrays, VARIABLES, units), labels, attributes, along)


# ---- efficiency ------------------------------------------------------------------------------------------------

COVERAGE = 2.0
"""Factor k of the expanded uncertainty U = k u where turns are many: 95.45 % of a normal distribution (GUM 6.3.3)."""

LACKING = 0.1
"""Share of its positions that a turn may lack and still count."""

Powers = Sequence[tuple[Signal, Signal]]  # torque or force with its speed


class Contribution(NamedTuple):
    """What a source, "gain", "zero", "resolution" or "repeatability", of a channel does to the efficiency.

    input: its standard uncertainty, of a gain relative, else in the unit of the channel; sensitivity: ∂η/∂ of it.
    """

    channel: str
    source: str
    input: float
    sensitivity: float

    @property
    def effect(self) -> float:
        """The standard uncertainty of η by it alone."""
        return abs(self.sensitivity) * self.input


@dataclass(frozen=True)
class Efficiency:
    """An efficiency measured in one condition.

    value: mean power out over mean power in, over the time of all whole turns; power_in, power_out: W; per_turn: ratios
    of the single turns; left_out: turns that lack more than LACKING of their positions.
    """

    value: float
    power_in: float
    power_out: float
    per_turn: Array
    contributions: tuple[Contribution, ...]
    left_out: int = 0

    @property
    def uncertainty(self) -> float:
        """Standard; NaN of one turn."""
        return float(np.sqrt(sum(part.effect * part.effect for part in self.contributions)))

    @property
    def freedom(self) -> float:
        """Effective degrees of freedom: those of the scatter between turns by its share of u². GUM, G.4.1."""
        scatter = sum(part.effect for part in self.contributions if part.source == "repeatability")
        share = self.uncertainty / scatter if scatter > 0 else float("inf")
        square = share * share  # not a power: near the end of the floats that is an error
        return (len(self.per_turn) - 1) * square * square if scatter > 0 else float("inf")

    def factor(self, coverage: float = COVERAGE) -> float:
        """k of U = k u: Student's for the freedom, with the probability that `coverage` has of a normal one."""
        return float(student(self.freedom, coverage))

    @property
    def expanded(self) -> float:
        """U = k u with k for 95.45 %."""
        return self.factor() * self.uncertainty

    def __str__(self) -> str:
        return f"η = {self.value:.4f} ± {self.expanded:#.2g} (k = {self.factor():.2g})"


def pairs_of(condition: Condition, joints: Mapping[str, str] | None = None) -> tuple[Powers, Powers] | None:
    """The channels that tell power in and out: `effort:D` with `rate:D`, `load:L` with `rate:` of its joint.

    joints: that the loads act in, by name of the load. Without it a load goes with the one measured speed that is no
    driver's, or with the only one there is. None where a torque or its speed is missing.
    """
    subjects: dict[str, dict[str, Signal]] = {"effort": {}, "rate": {}, "load": {}}
    for course in condition.courses.values():
        kind, _, subject = course.measures.partition(":")
        subjects.get(kind, {}).setdefault(subject, course)
    efforts, rates, loads = subjects.values()
    free = [name for name in rates if name not in efforts] or list(rates)
    places = {name: (joints or {}).get(name, free[0] if len(free) == 1 else "") for name in loads}
    if not efforts or not loads or any(name not in rates for name in (*efforts, *places.values())):
        return None
    return [(course, rates[name]) for name, course in efforts.items()], [
        (course, rates[places[name]]) for name, course in loads.items()
    ]


def efficiency_of(condition: Condition, joints: Mapping[str, str] | None = None) -> Efficiency:
    """The efficiency of one condition, with its standard uncertainty.

    η = P_out/P_in of the means over whole turns: dη = (dP_out − η dP_in)/P_in, and a power changes with a torque by ω,
    with a speed by T, each by the time that the driver dwells at a position; the dwell with 1/ω of its channel. That is
    taken from the mean course, not from each turn: 1/ω of a noisy ω is too large by its variance.

    Parameters
    ----------
    condition : with the courses of torques and speeds.
    joints : see `pairs_of`.

    Returns
    -------
    Efficiency; with fewer than two whole turns the scatter is not known, and the uncertainty is NaN.

    Raises
    ------
    MechanismError
        Where the channels do not tell both powers, no turn is whole, or no power goes in.
    """
    sides = pairs_of(condition, joints)
    if sides is None:
        measured = ", ".join(f"{name} ({course.measures})" for name, course in condition.courses.items()) or "none"
        what = f"the channels do not measure input and output power; there are {measured}"
        remedy = "measure effort: and rate: of the driver, load: of a load on a joint and rate: of that joint"
        raise MechanismError(Finding(what, condition.name, remedy))
    dwell, timing = np.ones(len(condition.phase)), None  # equal, unless one driver turns one way throughout
    if np.isfinite(condition.speed):
        speeds = [speed for _, speed in sides[0]]
        driver = min(speeds, key=lambda speed: abs(abs(float(np.mean(speed.mean))) - abs(condition.speed)))
        if np.isfinite(driver.mean).all() and np.min(driver.mean) * np.max(driver.mean) > 0:
            dwell, timing = 1 / np.abs(driver.mean), driver
            dwell = dwell / np.mean(dwell)
    powers = np.array([np.sum([dwell * force.turns * speed.turns for force, speed in side], axis=0) for side in sides])
    # what few positions of a turn lack is the mean of the others there: without it the mean of the turn would be off
    finite = np.all(np.isfinite(powers), axis=0)
    fillable = np.mean(~finite, axis=1) <= LACKING
    fillable &= np.any(finite[fillable], axis=0).all()  # else nothing is known of a position
    if not np.any(fillable):
        what = f"no turn is whole in all channels of {len(fillable)}"
        raise MechanismError(Finding(what, condition.name, "see the gaps reported by `trunnion data`"))
    finite, powers = finite[fillable], powers[:, fillable]
    usual = np.sum(powers, axis=1, where=finite) / np.maximum(np.sum(finite, axis=0), 1)
    powers_in, powers_out = np.mean(np.where(finite, powers, usual[:, None]), axis=2)
    power_in, power_out = float(np.mean(powers_in)), float(np.mean(powers_out))
    if not power_in:
        names = " or ".join(course.channel for pair in sides[0] for course in pair)
        what = f"there is no input power: {names} reads 0 throughout"
        raise MechanismError(Finding(what, condition.name, "check these channels: a sensor may have failed"))
    value = power_out / power_in
    with np.errstate(all="ignore"):
        per_turn = powers_out / powers_in
    weights: dict[str, tuple[Signal, Array]] = {}  # ∂η/∂x of the readings of each channel, (turn, position)
    for side, factor in zip(sides, (-value, 1.0), strict=True):
        for force, speed in side:
            by = factor / power_in * dwell
            parts = [(force, by * speed.turns[fillable]), (speed, by * force.turns[fillable])]
            if timing is not None:
                parts.append((timing, -by * force.turns[fillable] * speed.turns[fillable] / timing.mean))
            for course, weight in parts:  # a channel in several powers has the sum
                weights[course.channel] = course, weights.get(course.channel, (course, 0.0))[1] + weight
    scatter = float(np.std(per_turn, ddof=1)) / len(per_turn) ** 0.5 if len(per_turn) > 1 else float("nan")
    every = [Contribution("", "repeatability", scatter, 1.0)]
    for name, (course, weight) in weights.items():  # of what it reads, x → (1 + gain) x + zero
        accuracy, turns = course.accuracy, course.turns[fillable]
        by_gain, by_zero = float(np.nanmean(weight * (turns - accuracy.datum))), float(np.nanmean(weight))
        unresolved = Signal(name, course.measures, course.unit, turns, accuracy).unresolved
        every.append(Contribution(name, "gain", accuracy.gain, by_gain))
        every.append(Contribution(name, "zero", accuracy.zero, by_zero))
        every.append(Contribution(name, "resolution", unresolved, by_zero))
    contributions = tuple(part for part in every if not part.input <= 0)  # NaN stays
    return Efficiency(value, power_in, power_out, per_turn, contributions, int(np.count_nonzero(~fillable)))
