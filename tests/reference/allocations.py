"""Allocation problems on plain numbers, and a four-bar's sensitivities from its loop equation."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.model.tolerances import ProcessChoice
from trunnion.statistics.costs import Cost
from trunnion.studies.allocation.problem import AllocationProblem, Answer, Contribution, Criterion, RowEffects
from trunnion.studies.allocation.solve import cheapest
from trunnion.studies.allocation.yields import Verify, meet

Array = NDArray[np.float64]
FOUR_BAR = (100.0, 30.0, 90.0, 70.0)  # ground, crank, coupler, rocker, mm
PRICES = (1.0, 0.6, 1.0, 0.8)  # B of the costs B/t^0.45, t in mm


def rocker_sensitivities(crank: Array) -> Array:
    """∂θ₄/∂l of the four-bar at crank angles, rad: (position, 4), rad/mm.

    l₂ u₂ + l₃ u₃ = l₁ x + l₄ u₄ with u = (cos θ, sin θ). Along u₃ its variation has no dθ₃:
    dl₂ u₂·u₃ + dl₃ = dl₁ x·u₃ + dl₄ u₄·u₃ + l₄ dθ₄ n₄·u₃, n₄ normal to u₄.
    """
    l1, l2, l3, l4 = FOUR_BAR
    pin = np.stack([l2 * np.cos(crank), l2 * np.sin(crank)])
    way = np.array([[l1], [0.0]]) - pin
    d = np.hypot(*way)
    along = (l3**2 - l4**2 + d**2) / (2 * d)
    u3 = (along * way + np.sqrt(l3**2 - along**2) * np.stack([-way[1], way[0]])) / d / l3
    u4 = (pin + l3 * u3 - np.array([[l1], [0.0]])) / l4
    u2 = pin / l2
    lever = l4 * (-u4[1] * u3[0] + u4[0] * u3[1])
    parts = [-u3[0], np.sum(u2 * u3, axis=0), np.ones_like(d), -np.sum(u4 * u3, axis=0)]
    return np.asarray(np.stack(parts) / lever, float).T


def four_bar(
    criterion: Criterion = "worst-case", positions: int = 72, limit: float = np.radians(0.1)
) -> AllocationProblem:
    """The four-bar of THEORY 7: rocker angle within ± limit at all positions; half widths in mm."""
    effect = rocker_sensitivities(np.arange(positions) * 2 * np.pi / positions)
    bought = tuple(
        Contribution(f"l{i + 1}", cost=Cost("power", {"B": price, "k": 0.45, "unit": 1.0}))
        for i, price in enumerate(PRICES)
    )
    return AllocationProblem(bought, rows(effect, limit, criterion))


def rows(
    effect: Array, limit: float | Array, criterion: Criterion = "worst-case", drift: Array | None = None, **more: Any
) -> RowEffects:
    """Rows with limits ± limit; standard deviations are a third of half widths, 3 of them what an RSS is."""
    each, nothing = np.broadcast_to(np.asarray(limit, float), len(effect)).copy(), np.zeros_like(effect)
    linear, spread = {"worst-case": (np.abs(effect), nothing), "rss": (nothing, effect)}.get(
        criterion, (nothing, effect / 3)
    )
    drift = nothing if drift is None or criterion != "yield" else drift
    more.setdefault("offset", np.zeros(len(effect)))
    return RowEffects(linear, spread, drift, **{"lower": -each, "upper": each, **more})


def solve(
    problem: AllocationProblem, target: float | None = None, verify: Verify | None = None, sure: bool = False
) -> Answer:
    """The cheapest answer, with a yield if one is asked for."""
    return cheapest(problem) if target is None else meet(problem, target, verify, sure)


def bought(costs: list[Cost], **bounds: float) -> tuple[Contribution, ...]:
    """Contributions p0, p1, … with costs."""
    return tuple(Contribution(f"p{i}", cost=cost, **bounds) for i, cost in enumerate(costs))


def random_costs(rng: np.random.Generator, count: int) -> list[Cost]:
    """A mixture of both models."""
    models = rng.choice(["power", "exponential"], count)
    return [
        Cost(model, {"A": 1.0, "B": rng.uniform(0.5, 5), "k": rng.uniform(0.3, 2.5), "unit": rng.uniform(0.02, 0.1)})
        for model in models
    ]


def random_options(rng: np.random.Generator, count: int) -> tuple[ProcessChoice, ...]:
    """Processes: the narrower, the dearer."""
    widths, prices = np.sort(rng.uniform(0.01, 0.1, count)), np.sort(rng.uniform(1, 20, count))[::-1]
    return tuple(ProcessChoice(f"p{k}", t, c) for k, (t, c) in enumerate(zip(widths, prices, strict=True)))
