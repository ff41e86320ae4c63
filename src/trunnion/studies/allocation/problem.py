"""What tolerances to buy: the least cost that keeps every measure within its limits. The problem and its answer.

Unknown are the half widths t of the contributions (of a clearance: the radial clearance). Every row is one measure at
one position, with a limit on either side of its nominal. With effects per unit of t the criteria are

    worst case   offset ± Σ worst_i t_i                              within the limits
    rss          offset ± √(Σ (half_i t_i)²)                         within the limits
    yield        offset + Σ mean_i t_i ± z √(Σ (deviation_i t_i)²)   within the limits, z so that the yield is met

All of them, and the costs, are convex in t: a point at which the conditions of Karush, Kuhn and Tucker hold is the
global optimum. The answer carries a lower bound of the cost that proves it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding
from trunnion.model.tolerances import ProcessChoice
from trunnion.results.quantities import drawn_in, signed
from trunnion.statistics.costs import Cost

__all__ = [
    "AllocationProblem",
    "Answer",
    "Contribution",
    "Criterion",
    "RowEffects",
    "SampledYield",
    "Trial",
]

Array = NDArray[np.float64]
Criterion = Literal["worst-case", "rss", "yield"]
ALLOWED = 1e-9  # of a limit: how far a row may lie beyond it
BENT = 8.0  # n, how late margins bend to their cap
PROVEN = 1e-6  # of the cost that tolerances change: up to this gap of the solver an optimum is claimed


@dataclass(frozen=True)
class Contribution:
    """One tolerance or clearance.

    value: its half width as stated, m or rad: kept if it has neither a cost nor options.
    cost: of any half width from least to most; options: the processes to choose from; not both.
    group: those of one group get one half width, or the option of the same name.
    """

    name: str
    value: float = 0.0
    cost: Cost | None = None
    options: tuple[ProcessChoice, ...] = ()
    group: str = ""
    least: float = 0.0
    most: float = np.inf

    @property
    def fixed(self) -> bool:
        """Whether it stays as it is."""
        return self.cost is None and not self.options


@dataclass(frozen=True)
class RowEffects:
    """What each contribution does to each row, per unit of its half width: arrays (row, contribution).

    lower, upper: limits of the deviation from the nominal, (row,), infinite where there is none; offset: deviation of
    the middle of the tolerances, (row,). worst: |∂y/∂p|, of a clearance |Q₁| + |Q₂|; half: what RSS squares, worst if
    None; deviation, mean: standard deviation and mean, half/3 and 0 if None; correlation: (contribution,
    contribution). half and deviation are signed: that matters with correlation, and for a yield.
    labels, places, units: of the rows for messages: names, where in the cycle (" at 60°"), and SI units.
    """

    worst: Array
    lower: Array
    upper: Array
    half: Array | None = None
    deviation: Array | None = None
    mean: Array | None = None
    offset: Array | None = None
    correlation: Array | None = None
    labels: tuple[str, ...] = ()
    places: tuple[str, ...] = ()
    units: tuple[str, ...] = ()

    def say(self, row: int, value: float) -> str:
        """A deviation of a row with its sign and unit, angles in degrees, lengths in mm."""
        factor, unit = drawn_in(value, self.units[row]) if self.units else (1.0, "")
        return signed(value, factor, unit, digits=6)

    def spread(self) -> Array:
        """What RSS squares."""
        return self.worst if self.half is None else self.half

    def sigma(self) -> Array:
        """Standard deviation of a row per unit of each half width, signed, (row, contribution)."""
        return self.spread() / 3 if self.deviation is None else self.deviation

    def drift(self) -> Array:
        """Mean of a row per unit of each half width, (row, contribution)."""
        return np.zeros_like(self.worst) if self.mean is None else self.mean

    def middle(self) -> Array:
        """Deviation of the middle of the tolerances, (row,)."""
        return np.zeros(len(self.worst)) if self.offset is None else self.offset

    def scaled(self, factor: float) -> RowEffects:
        """With all limits times a factor."""
        return replace(self, lower=factor * self.lower, upper=factor * self.upper)


@dataclass(frozen=True)
class AllocationProblem:
    """Contributions, their effects, the criterion; z: how many standard deviations of room `yield` asks for.

    caps: the largest margin that each row can have, (row,), infinite where there is no end to it; None: not looked at.
    """

    contributions: tuple[Contribution, ...]
    effects: RowEffects
    criterion: Criterion = "worst-case"
    z: float = 3.0
    caps: Array | None = None

    def margins(self) -> Array:
        """Standard deviations of room that `yield` asks of each row, (row,).

        They are z, but where a row cannot have z, as what is not bought takes up most of its room, they stay below
        its cap: (z⁻ⁿ + cap⁻ⁿ)^(−1/n). However large z, there are half widths with such margins.
        """
        factors = np.full(len(self.effects.worst), self.z)
        return factors if self.caps is None else factors * (1 + (factors / self.caps) ** BENT) ** (-1 / BENT)

    def with_effects(self, effects: RowEffects) -> AllocationProblem:
        """The same with other effects of its rows, or of the first ones of them alone."""
        return replace(self, effects=effects, caps=None if self.caps is None else self.caps[: len(effects.worst)])

    def groups(self) -> dict[str, list[Contribution]]:
        """What is bought together, by the name of the group, or of the one contribution."""
        together: dict[str, list[Contribution]] = {}
        for contribution in self.contributions:
            if not contribution.fixed:
                together.setdefault(contribution.group or f"={contribution.name}", []).append(contribution)
        return together

    def narrowest(self) -> Array:
        """The least half widths that can be had, (contribution,)."""
        place = {contribution.name: i for i, contribution in enumerate(self.contributions)}
        least = np.array([contribution.value * contribution.fixed for contribution in self.contributions])
        for members in self.groups().values():
            rows, options = [place[member.name] for member in members], list(common_options(members).values())
            if members[0].options:
                widths = np.array([[option.tolerance for option in each] for each in options])
                least[rows] = np.min(widths.reshape(-1, len(rows)), axis=0, initial=np.inf)
            else:
                least[rows] = max(member.least for member in members)
        return least

    def costs(self, tolerances: Array) -> Array:
        """What the half widths cost by formula, (contribution,); 0 of the others."""
        pairs = zip(self.contributions, tolerances.tolist(), strict=True)
        return np.array([contribution.cost.value(t) if contribution.cost else 0.0 for contribution, t in pairs])

    def at(self, tolerances: Array) -> tuple[Array, Array]:
        """Least and largest deviation of each row that the criterion reckons with, (row,) each."""
        middle, half = self.extent(tolerances)
        return middle - half, middle + half

    def extent(self, tolerances: Array) -> tuple[Array, Array]:
        """Middle and half width of each row's range, (row,) each."""
        effects = self.effects
        if self.criterion == "worst-case":
            return effects.middle(), effects.worst @ tolerances
        if self.criterion == "rss":
            return effects.middle(), _norm(effects.spread() * tolerances, effects.correlation)
        drift = effects.middle() + effects.drift() @ tolerances
        return drift, self.margins() * _norm(effects.sigma() * tolerances, effects.correlation)

    def used(self, tolerances: Array) -> Array:
        """Share of its room that each row takes, (row,): above 1 breaks a limit."""
        middle, half = self.extent(tolerances)
        base, effects = self.effects.middle(), self.effects
        room = np.stack([effects.upper - base, base - effects.lower])
        taken = np.stack([middle - base + half, base - middle + half])
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(room > 0, taken / room, np.inf)
        return np.asarray(np.max(np.where(np.isinf(room), 0.0, share), axis=0), float)


class SampledYield(NamedTuple):
    """A yield that was sampled, with its interval."""

    share: float
    low: float
    high: float


class Trial(NamedTuple):
    """One allocation that was sampled on the way to a yield."""

    z: float
    cost: float
    sampled: SampledYield


@dataclass(frozen=True)
class Answer:
    """Half widths to buy, or why there are none (`findings` with an error, NaN).

    tolerances, costs: by contribution, m or rad; a fixed one costs nothing. choices: names of the options taken.
    bound: no allocation costs less than this; gap: cost minus bound, a share of the cost that tolerances change.
    proven: whether the gap proves a global optimum.
    price: what one more unit (rad, m, …) of a row's room would save, (row,); NaN for a discrete choice.
    used: share of its room each row takes.
    Of a yield: expected, of normal deviations, linearly; sampled, by those samples that chose the margin; checked, by
    fresh ones, which had no part in it; trials: all margins that were tried.
    """

    problem: AllocationProblem
    tolerances: Array
    costs: Array
    cost: float
    bound: float
    gap: float
    proven: bool
    choices: dict[str, str] = field(default_factory=dict)
    price: Array = field(default_factory=lambda: np.zeros(0))
    findings: tuple[Finding, ...] = ()
    expected: float = np.nan
    sampled: SampledYield | None = None
    checked: SampledYield | None = None
    trials: tuple[Trial, ...] = ()

    @property
    def found(self) -> bool:
        """Whether there is an allocation."""
        return bool(np.isfinite(self.cost))

    @property
    def used(self) -> Array:
        """Share of its room that each row takes, (row,)."""
        return self.problem.used(self.tolerances)

    @property
    def by_name(self) -> dict[str, float]:
        """Half widths by the names of the contributions."""
        names = [contribution.name for contribution in self.problem.contributions]
        return dict(zip(names, self.tolerances.tolist(), strict=True))


def common_options(members: Sequence[Contribution]) -> dict[str, list[ProcessChoice]]:
    """Options by name that all members of a group have within the bounds of all, one for each member."""
    least, most = max(member.least for member in members), min(member.most for member in members)
    fit = [{each.name: each for each in member.options if least <= each.tolerance <= most} for member in members]
    return {name: [offer[name] for offer in fit] for name in fit[0] if all(name in offer for offer in fit)}


def none(problem: AllocationProblem, findings: Sequence[Finding]) -> Answer:
    """The answer that there is none."""
    lost, no_price = np.full(len(problem.contributions), np.nan), np.full(len(problem.effects.worst), np.nan)
    return Answer(problem, lost, lost, np.nan, np.nan, np.nan, False, {}, no_price, tuple(findings))


def optimum(
    problem: AllocationProblem, tolerances: Array, costs: Array, bound: float, gap: float, price: Array,
    choices: dict[str, str],
) -> Answer:  # fmt: skip
    """The answer of a solver, with a doubt where its gap proves no global optimum."""
    cost, proven = float(np.sum(costs)), gap <= PROVEN
    what, remedy = f"the optimality gap is {gap:.1e} of the cost of the tolerances", "check the orders of magnitude"
    doubts = () if proven else (Finding.warning("allocation.proven_roughly", "costs", what, remedy, gap=gap),)
    return Answer(problem, tolerances, costs, cost, min(bound, cost), gap, proven, choices, price, doubts)


def shortfalls(problem: AllocationProblem, least: Array) -> list[Finding]:
    """Of each measure with a limit that is broken even with all tolerances at their least what they would have to be.

    least: the half widths, m or rad, that are the least to be had.
    """
    used, effects, findings = problem.used(least), problem.effects, []
    labels, places = (np.array(texts or [""] * len(used)) for texts in (effects.labels, effects.places))
    broken, (low, high) = used > 1 + ALLOWED, problem.at(least)
    for label in dict.fromkeys(labels[broken].tolist()):
        row = int(np.argmax(np.where(labels == label, used, -np.inf)))
        upwards = high[row] - effects.upper[row] >= effects.lower[row] - low[row]
        over, limit = (high[row], effects.upper[row]) if upwards else (low[row], effects.lower[row])
        largest = problem.contributions[int(np.argmax(effects.worst[row] * least))]
        narrow = f"narrow '{largest.name}', which has no cost and" * largest.fixed
        narrow = narrow or f"allow '{largest.name}' a smaller least: it"
        what = f"the limit {effects.say(row, limit)} is infeasible: with all tolerances at their least the deviation "
        what += f"is {effects.say(row, over)}{places[row]}"
        if problem.criterion == "yield":
            what += f" ({problem.margins()[row]:.3g} standard deviations of a normal distribution)"
        remedy, figures = f"widen the limit, or first {narrow} has the largest share", {"limit": limit, "takes": over}
        where = label or f"row {row + 1}"
        findings.append(Finding.error("allocation.impossible", where, what, remedy, **figures, largest=largest.name))
    return findings


def _norm(parts: Array, correlation: Array | None) -> Array:
    """√(vᵀ C v) of each row of parts, (row,)."""
    turned = parts if correlation is None else parts @ correlation
    return np.asarray(np.sqrt(np.maximum(np.einsum("ri,ri->r", parts, turned), 0.0)), float)
