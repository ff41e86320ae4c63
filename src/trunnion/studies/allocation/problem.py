"""What tolerances to buy: the least cost that keeps every measure within its limits. The problem and its answer.

Unknown are the half widths t of the contributions (of a clearance: the radial clearance). Every row is one measure at
one position, with a limit on either side of its nominal. What it comes to is

    offset + Σ drift_i t_i ± (Σ linear_i t_i + z √(Σ (spread_i t_i)²))    within the limits

of which each criterion takes a part: the worst case is linear, RSS a spread with z = 1, and a yield has spread and
drift of normal deviations, z so that the yield is met.

All of them, and the costs, are convex in t: a point at which the conditions of Karush, Kuhn and Tucker hold is the
global optimum. The answer carries a lower bound of the cost that proves it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding
from trunnion.model.tolerances import ProcessChoice
from trunnion.results.quantities import drawn_in, signed
from trunnion.statistics.costs import Cost

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
    """What each contribution does to each row, per unit of its half width: arrays (row, contribution), or (row,).

    lower, upper: limits of the deviation from the nominal, infinite where there is none; offset: deviation of the
    middle of the tolerances. linear, spread, drift: see above; the spread is signed, which matters with a correlation,
    (contribution, contribution). labels, units: of the rows for messages: names, SI units.
    """

    linear: Array
    spread: Array
    drift: Array
    lower: Array
    upper: Array
    offset: Array
    correlation: Array | None = None
    labels: tuple[str, ...] = ()
    units: tuple[str, ...] = ()


@dataclass(frozen=True)
class AllocationProblem:
    """Contributions and their effects; z: how many standard deviations of room a yield asks for.

    caps: the largest margin that each row can have, (row,), infinite where there is no end to it; None: not looked at.
    """

    contributions: tuple[Contribution, ...]
    effects: RowEffects
    z: float = 1.0
    caps: Array | None = None

    def margins(self) -> Array:
        """Standard deviations of room that is asked of each row, (row,).

        They are z, but where a row cannot have z, as what is not bought takes up most of its room, they stay below
        its cap: (z⁻ⁿ + cap⁻ⁿ)^(−1/n). However large z, there are half widths with such margins.
        """
        factors = np.full(len(self.effects.offset), self.z)
        return factors if self.caps is None else factors * (1 + (factors / self.caps) ** BENT) ** (-1 / BENT)

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

    def extent(self, tolerances: Array) -> tuple[Array, Array]:
        """Middle and half width of each row's range, (row,) each."""
        effects = self.effects
        parts = effects.spread * tolerances
        turned = parts if effects.correlation is None else parts @ effects.correlation
        root = np.sqrt(np.maximum(np.einsum("ri,ri->r", parts, turned), 0.0))
        return effects.offset + effects.drift @ tolerances, effects.linear @ tolerances + self.margins() * root

    def used(self, tolerances: Array) -> Array:
        """Share of its room that each row takes, (row,): above 1 breaks a limit."""
        (middle, half), effects, base = self.extent(tolerances), self.effects, self.effects.offset
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


@dataclass(frozen=True)
class Answer:
    """Half widths to buy, or why there are none (`findings` with an error, NaN).

    tolerances, costs: by contribution, m or rad; a fixed one costs nothing. bound: no allocation costs less than this;
    gap: cost minus bound, a share of the cost that tolerances change. price: what one more unit (rad, m, …) of a row's
    room would save, (row,); NaN for a discrete choice. choices: names of the options taken.
    Of a yield: expected, of normal deviations, linearly; sampled, by those samples that chose the margin; checked, by
    fresh ones, which had no part in it.
    """

    problem: AllocationProblem
    tolerances: Array
    costs: Array
    bound: float
    gap: float
    price: Array
    choices: dict[str, str] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    expected: float = np.nan
    sampled: SampledYield | None = None
    checked: SampledYield | None = None

    @property
    def cost(self) -> float:
        """That of all tolerances."""
        return float(np.sum(self.costs))

    @property
    def found(self) -> bool:
        """Whether there is an allocation."""
        return bool(np.isfinite(self.cost))

    @property
    def proven(self) -> bool:
        """Whether the gap proves a global optimum."""
        return self.gap <= PROVEN

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
    lost, no_price = np.full(len(problem.contributions), np.nan), np.full(len(problem.effects.offset), np.nan)
    return Answer(problem, lost, lost, np.nan, np.nan, no_price, findings=tuple(findings))


def shortfalls(problem: AllocationProblem, least: Array) -> list[Finding]:
    """Of each measure with a limit that is broken even with all tolerances at their least what they would have to be.

    least: the half widths, m or rad, that are the least to be had.
    """
    used, effects, findings = problem.used(least), problem.effects, []
    labels = np.array(effects.labels or [""] * len(used))
    broken, (middle, half) = used > 1 + ALLOWED, problem.extent(least)
    low, high = middle - half, middle + half

    def say(row: int, deviation: float) -> str:
        factor, unit = drawn_in(deviation, effects.units[row]) if effects.units else (1.0, "")
        return signed(deviation, factor, unit, digits=6)

    for label in dict.fromkeys(labels[broken].tolist()):
        row = int(np.argmax(np.where(labels == label, used, -np.inf)))
        upwards = high[row] - effects.upper[row] >= effects.lower[row] - low[row]
        over, limit = (high[row], effects.upper[row]) if upwards else (low[row], effects.lower[row])
        largest = problem.contributions[int(np.argmax((effects.linear + np.abs(effects.spread))[row] * least))]
        what = f"the limit {say(row, limit)} is infeasible: with all tolerances at their least the deviation "
        what += f"is {say(row, over)}"
        if problem.caps is not None:
            what += f" ({problem.margins()[row]:.3g} standard deviations of a normal distribution)"
        remedy, where = (
            f"widen the limit, change the nominal mechanism, or narrow first '{largest.name}', the largest share",
            label or f"row {row + 1}",
        )
        figures = {"limit": limit, "takes": over}
        findings.append(Finding.error("allocation.impossible", where, what, remedy, **figures))
    return findings
