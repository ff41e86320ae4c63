"""Yields and their intervals against true ones, and what Sobol points gain: true ones by formula or quadrature."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.polynomial.hermite_e import hermegauss
from scipy import optimize, stats

from mechanisms import Array
from mechanisms_parts import prismatic
from toleranced import FOURBAR, fourbar, fourbar_angle
from trunnion import Mechanism
from trunnion.studies.tolerance.first_order import ToleranceStudy, study
from trunnion.studies.tolerance.sampled import QUANTILES, sampled

MM, SEEDS = 1e-3, 200
T = 0.05 * MM


# ---- true figures ---------------------------------------------------------------------------------------------


def sledge() -> Mechanism:
    """A slide whose point is where three normal lengths put it: y = a + b + c + drive, σ = (1, 2, 2)/3 · 0.01 mm."""
    limits = {
        "all": {"limit": "±0.015 mm"},
        "most": {"limit": "±0.02 mm"},
        "half": {"limit": "+0.004/-0.01 mm"},
        "above": {"at_least": "59.985 mm"},
        "rare": {"limit": "±0.028 mm"},
    }
    return Mechanism(
        dimensions={"a": "10 mm", "b": "20 mm", "c": "30 mm"},
        links={
            "ground": {"points": {"X": {"at": ["a", 0], "axis": [1, 0]}}},
            "ram": {"points": {"X": {"at": ["-b", 0], "axis": [1, 0]}, "P": ["c", 0]}},
        },
        joints={"X": prismatic("ground", "ram")},
        drivers={"X": {"speed": 0.01, "range": [-0.01, 0.01]}},
        tolerances={"a": "±0.01 mm", "b": "±0.02 mm", "c": "±0.02 mm"},
        measures={name: {"point": "ram.P", "axis": "x", "at": "0 mm", **limit} for name, limit in limits.items()},
    )


def of_sledge() -> list[float]:
    """Yields by the normal distribution, σ = 0.01 mm, of each measure and of all."""
    ends = [(-0.015, 0.015), (-0.02, 0.02), (-0.01, 0.004), (-0.015, np.inf), (-0.028, 0.028)]
    found = [float(stats.norm.cdf(high / 0.01) - stats.norm.cdf(low / 0.01)) for low, high in ends]
    return [*found, found[2]]


def gauss(dims: int, order: int, width: float = T) -> tuple[list[Array], Array]:
    """Nodes and weights of so many independent deviations, normal with σ = width/3, in a list by dimension."""
    x, w = hermegauss(order)
    grids = np.meshgrid(*[x] * dims, indexing="ij")
    weights = np.prod(np.meshgrid(*[w / np.sum(w)] * dims, indexing="ij"), axis=0)
    return [grid.ravel() * width / 3 for grid in grids], weights.ravel()


def below(angle: float) -> float:
    """Chance that the rocker of the four-bar is below an angle: the fourth length by its normal distribution.

    The rocker is at the angle if |l₁ + l₄ e^{iθ} − B| = l₃; it turns back as l₄ is made shorter.
    """
    (d1, d2, d3), weights = gauss(3, 24)
    l1, l2, l3, l4 = FOURBAR.values()
    away = (l1 + d1) - (l2 + d2) * np.exp(1j * np.pi / 3)
    along, across = np.real(away * np.exp(-1j * angle)), np.imag(away * np.exp(-1j * angle))
    length = -along + np.sqrt((l3 + d3) ** 2 - across**2)
    return float(weights @ stats.norm.cdf((length - l4) / (T / 3)))


def moments() -> tuple[float, float, float]:
    """Mean, standard deviation and kurtosis of the angle of the rocker."""
    d, weights = gauss(4, 8)
    y = fourbar_angle(*(value + change for value, change in zip(FOURBAR.values(), d, strict=True)))
    mean = weights @ y
    second = weights @ (y - mean) ** 2
    return float(mean), float(np.sqrt(second)), float(weights @ (y - mean) ** 4 / second**2)


LIMITS = {"angle": {"angle": "rocker", "at": "60 deg", "limit": "+0.05/-0.04 deg"}}
LOW, HIGH = fourbar_angle(**FOURBAR) + np.radians([-0.04, 0.05])


def test_quadrature() -> None:
    """It is what a million own samples say."""
    rng = np.random.default_rng(4)
    own = fourbar_angle(*(value + rng.normal(0, T / 3, 1_000_000) for value in FOURBAR.values()))
    mean, sigma, kurtosis = moments()
    assert np.mean(own) == pytest.approx(mean, abs=4e-3 * sigma)
    assert np.std(own) == pytest.approx(sigma, rel=4e-3)
    assert kurtosis == pytest.approx(3, abs=0.01)
    assert np.mean(own < HIGH) == pytest.approx(below(HIGH), abs=2e-3)
    assert np.mean(own < LOW) == pytest.approx(below(LOW), abs=2e-3)


# ---- honest intervals -----------------------------------------------------------------------------------------


def intervals(mechanism: Mechanism, method: str, samples: int) -> dict[str, Array]:
    """(seed, measure) each: ends of the intervals, of the yields with that of all measures together."""
    found = study(mechanism)
    first = found.sampling(method, samples, 0).prepare()
    rows = [_arrays(found, first, seed) for seed in range(SEEDS)]
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


def _arrays(found: ToleranceStudy, first: Any, seed: int) -> dict[str, Array]:
    batch = replace(first, job=replace(first.job, seed=seed))
    arrays = sampled(batch.job.joined([batch(block) for block in range(batch.job.blocks)]), found).arrays
    keys = ("mean", "deviation", "quantile")
    kept = {f"{key}_{end}": arrays[f"{key}_{end}"] for key in keys for end in ("low", "high")}
    for end in ("low", "high"):
        kept[f"yield_{end}"] = np.append(arrays[f"yield_{end}"], arrays[f"yield_all_{end}"])
    return kept


def covered(rows: dict[str, Array], key: str, true: Any) -> Array:
    """Share of the seeds whose interval covers the true figure."""
    return np.mean((rows[f"{key}_low"] <= true) & (true <= rows[f"{key}_high"]), axis=0)


@pytest.mark.slow
@pytest.mark.parametrize(("method", "samples"), [("monte-carlo", 1000), ("quasi-monte-carlo", 1024)])
def test_intervals_are_honest(method: str, samples: int) -> None:
    """Over 200 seeds the 95 % interval covers the true yield in 95 ± 3 %: of each measure, and of all together.

    Sobol points, turned to the gradient of this linear measure, leave counts that are all but certain: of them the
    intervals are on the safe side.
    """
    rows = intervals(sledge(), method, samples)
    share = covered(rows, "yield", of_sledge())
    assert np.all(share >= 0.92 - 1e-12), share
    if method == "monte-carlo":
        assert np.all(share <= 0.98 + 1e-12), share
        assert abs(np.mean(share) - 0.95) < 0.015
    for key, true in (("mean", 0.06), ("deviation", 1e-5)):
        assert np.all(np.abs(covered(rows, key, true) - 0.95) <= 0.04)
    if method == "monte-carlo":
        quantiles_are_covered(rows)


@pytest.mark.slow
@pytest.mark.parametrize(("method", "samples"), [("monte-carlo", 1000), ("quasi-monte-carlo", 2048)])
def test_intervals_of_the_four_bar_are_honest(method: str, samples: int) -> None:
    rows = intervals(fourbar(measures=LIMITS), method, samples)
    mean, sigma, _ = moments()
    share = covered(rows, "yield", below(HIGH) - below(LOW))
    assert np.all(share >= 0.92 - 1e-12), share
    assert method != "monte-carlo" or np.all(share <= 0.98 + 1e-12), share
    assert abs(covered(rows, "mean", mean)[0] - 0.95) <= 0.03
    assert abs(covered(rows, "deviation", sigma)[0] - 0.95) <= 0.03


@pytest.mark.slow
def test_intervals_of_quantiles_of_sobol_points() -> None:
    """By their replicates; those of plain samples, by order statistics, stand in `test_intervals_are_honest`."""
    quantiles_are_covered(intervals(sledge(), "quasi-monte-carlo", 8192))


def quantiles_are_covered(rows: dict[str, Array]) -> None:
    """Never below 95 % but for chance."""
    true = 0.06 + 1e-5 * stats.norm.ppf(QUANTILES)
    known = np.all(np.isfinite(rows["quantile_low"][:, 0] + rows["quantile_high"][:, 0]), axis=0)
    assert np.count_nonzero(known) >= len(QUANTILES) - 2
    assert np.all(covered(rows, "quantile", true)[0, known] >= 0.87)


# ---- Sobol points ---------------------------------------------------------------------------------------------


def test_sobol_points_reach_a_million_plain_samples() -> None:
    """At 32 768 points: root mean square errors over seeds against σ/√n and its like for 10⁶ plain samples."""
    found = study(fourbar(measures=LIMITS))
    first = found.sampling("quasi-monte-carlo", 32_768, 0).prepare()
    assert first.job.samples == 32_768
    mean, sigma, kurtosis = moments()
    true_yield = below(HIGH) - below(LOW)
    q = 0.99865
    place = optimize.brentq(lambda y: below(y) - q, mean + 2 * sigma, mean + 4 * sigma, xtol=1e-14)
    density = (below(place + 1e-7) - below(place - 1e-7)) / 2e-7
    errors = []
    for seed in range(12):
        batch = replace(first, job=replace(first.job, seed=seed))
        arrays = sampled(batch.job.joined([batch(block) for block in range(batch.job.blocks)]), found).arrays
        errors.append([
            arrays["mean"][0] - mean, arrays["deviation"][0] - sigma, arrays["quantile_value"][0, -1] - place,
            arrays["yield"][0] - true_yield,
        ])  # fmt: skip
    rms = np.sqrt(np.mean(np.square(errors), axis=0))
    plain = np.array([
        sigma, sigma * np.sqrt((kurtosis - 1) / 4), np.sqrt(q * (1 - q)) / density,
        np.sqrt(true_yield * (1 - true_yield)),
    ]) / 1000  # fmt: skip
    gain = rms / plain  # measured: 0.032, 0.11, 1.03, 0.11
    assert np.all(gain[[0, 1, 3]] < 0.3)  # of mean, standard deviation and yield
    assert gain[2] < 1.3  # of the 99.865 % quantile, beyond which 44 points lie
