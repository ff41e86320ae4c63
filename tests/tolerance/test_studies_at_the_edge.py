"""Studies at the edge: samples without an answer, nothing that varies, one of everything, odd names, sizes, limits."""

from __future__ import annotations

import json
import warnings
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

import mechanisms
import trunnion
from mechanisms import Array
from toleranced import FOURBAR, alone, fourbar, fourbar_angle, many, sampler
from trunnion import MechanismError, Status
from trunnion.statistics.streams import uniforms
from trunnion.studies.tolerance.first_order import study

LIMIT = {"angle": {"angle": "rocker", "at": "60 deg", "limit": "±0.1 deg"}}
ALL = ("linear", "worst-case", "monte-carlo")
CAUSES = [code.text for code in Status]


def findings(result: Any) -> list[str]:
    return [row["what"] for row in json.loads(result.attrs["findings"])]


def own_uniforms(seed: int, count: int) -> Array:
    """The uniform numbers of a run of the four-bar, from the streams themselves."""
    size = study(fourbar(measures=LIMIT)).sampling("monte-carlo", count, seed).drawing
    blocks = [uniforms(seed, i, 4, min(size, count - i * size)) for i in range(-(-count // size))]
    return np.concatenate(blocks, axis=1)


def own_samples(seed: int, count: int, sigma: float) -> list[Any]:
    z = stats.norm.ppf(own_uniforms(seed, count))
    return [value + sigma * row for value, row in zip(FOURBAR.values(), z, strict=True)]


# ---- samples without an answer --------------------------------------------------------------------------------


def test_samples_that_do_not_go_together_at_a_place() -> None:
    """Counted by cause and as outside every limit; moments, quantiles and extremes are of the others."""
    widths = {"l1": 0.028, "l2": 0.028, "l3": 0.04, "l4": 0.04}
    mechanism = fourbar(
        tolerances={name: {"limits": width, "distribution": "uniform"} for name, width in widths.items()},
        measures={"angle": {"angle": "rocker", "at": "60 deg", "limit": "±40 deg"}},
    )
    result = trunnion.tolerance(mechanism, methods=["monte-carlo"], samples=4000, seed=3)
    shares = 2 * own_uniforms(3, 4000) - 1
    sizes = zip(FOURBAR.values(), widths.values(), shares, strict=True)
    own = fourbar_angle(*(value + width * row for value, width, row in sizes))
    good = own[np.isfinite(own)]
    assert 10 < len(own) - len(good) < 1000
    assert (
        int(result["failed"].sel(cause=Status.NOT_ASSEMBLED.text))
        == len(own) - len(good)
        == int(result["failed"].sum())
    )
    away = np.remainder(good - fourbar_angle(**FOURBAR) + np.pi, 2 * np.pi) - np.pi
    figures = away + fourbar_angle(**FOURBAR)
    assert result["samples"].item() == 4000
    assert result["mean"].item() == pytest.approx(np.mean(figures), rel=1e-12)
    assert result["deviation"].item() == pytest.approx(np.std(figures, ddof=1), rel=1e-10)
    assert result["most"].item() == pytest.approx(np.max(figures), rel=1e-12)
    assert result["yield"].item() == np.count_nonzero(np.abs(away) <= np.radians(40)) / 4000
    assert int(result["histogram"].sum()) == len(good)
    said = next(text for text in findings(result) if "could not be solved" in text)
    assert said.startswith(f"{len(own) - len(good)} of 4,000 samples")
    assert Status.NOT_ASSEMBLED.text in said


def test_samples_that_do_not_go_together_everywhere() -> None:
    """A measure over the turn needs all positions; one of a place only its own, but the sample fails for both."""
    measures = {"turn": {"angle": "rocker"}, "place": {"angle": "rocker", "at": "60 deg"}}
    result = trunnion.tolerance(
        fourbar("±40 mm", measures=measures), methods=["monte-carlo"], samples=2000, seed=3, steps=24
    )
    sizes = own_samples(3, 2000, 0.04 / 3)
    turn = np.array([fourbar_angle(*sizes, crank=crank) for crank in np.arange(24) * 2 * np.pi / 24])
    lost, away = np.any(np.isnan(turn), axis=0), np.isnan(turn[4])
    assert 0 < np.sum(away) < np.sum(lost) < 1000
    assert int(result["failed"].sum()) == np.sum(lost)
    np.testing.assert_allclose(result["yield"].values, [np.mean(~lost), np.mean(~away)], rtol=1e-15)
    assert result["yield_all"].item() == np.mean(~lost)
    assert result["mean"].sel(measure="place").item() == pytest.approx(np.mean(turn[4][~away]), abs=1e-12)


def test_corner_that_does_not_go_together_is_told() -> None:
    mechanism = fourbar("±40 mm", measures={"angle": {"angle": "rocker", "at": "60 deg"}})
    result = trunnion.tolerance(mechanism, methods=["linear", "worst-case"])
    found = findings(result)
    assert any("cannot be solved at the tolerance limits that give the least deviation" in text for text in found)
    # what is found all the same is a mechanism that goes together
    corner = result["corner_lower"].values[0]
    change = np.remainder(fourbar_angle(*corner) - fourbar_angle(**FOURBAR) + np.pi, 2 * np.pi) - np.pi
    assert result["searched_lower"].item() == pytest.approx(change, rel=1e-9)


@pytest.mark.slow
def test_samples_that_lock() -> None:
    """By the gravest status of each mechanism analysed alone; an effort has no figure, a motion has."""
    data = mechanisms.model(mechanisms.slider_crank(offset=0.0), friction=0.35)
    data["tolerances"] = {"joints.C.friction.coefficient": "+4/+2"}
    data["measures"] = {"peak": {"effort": "A", "as": "maximum", "at_most": "1e6 N m"}, "way": {"stroke": "C"}}
    mechanism = trunnion.Mechanism(**data)
    found, batch = many(mechanism, steps=12)
    u = uniforms(1, 0, batch.inputs.dims, 12)
    part = batch.figures(u)
    figures, passed, status = part["figure"], part["passed"], part["status"]
    values = batch.inputs.values(u)
    for i in (0, 4, 9):
        single = trunnion.analyse(alone(mechanism, values, i), 360)["status"].values
        assert np.max(single[single != Status.ZERO_SLIP]) == status[i]  # an instant at a break is no place of a course
    locked = status == Status.LOCKED
    assert 0 < np.sum(locked) < 12
    np.testing.assert_array_equal(np.isnan(figures[0]), locked)
    np.testing.assert_array_equal(passed[0] == 0, locked)
    assert np.all(np.isfinite(figures[1]))
    result = trunnion.tolerance(mechanism, methods=["monte-carlo"], samples=32, steps=12)
    lost = int(result["failed"].sel(cause=Status.LOCKED.text))
    assert 0 < lost < 32
    assert result["yield"].sel(measure="peak").item() == 1 - lost / 32
    assert result["yield"].sel(measure="way").item() == 1
    assert result["yield_all"].item() == 1 - lost / 32
    assert any(Status.LOCKED.text in text for text in findings(result))
    assert found.linear.measures[0].reference.figure > 0


def test_figure_that_does_not_exist() -> None:
    """The dead centre of a rocker within a range that some samples leave: no status, but counted."""
    measures = {"turn": {"dead_centre": "D", "over": ["180 deg", "217 deg"], "at_least": "200 deg"}}
    result = trunnion.tolerance(fourbar("±2 mm", measures=measures), methods=["monte-carlo"], samples=500, steps=180)
    lost = result["failed"].values
    assert lost[-1] > 0
    assert np.sum(lost[:-1]) == 0
    assert result["yield"].item() <= 1 - lost[-1] / 500


def test_nothing_goes_together() -> None:
    result = trunnion.tolerance(fourbar(dimensions=FOURBAR | {"l1": 0.5}, measures=LIMIT), methods=ALL, samples=50)
    assert np.isnan(result["mean"].item())
    assert result["yield"].item() == 0
    assert int(result["failed"].sel(cause=Status.NOT_ASSEMBLED.text)) == 50


# ---- nothing, and one of everything ---------------------------------------------------------------------------


def test_no_width() -> None:
    result = trunnion.tolerance(fourbar("±0 mm", measures=LIMIT), methods=ALL, samples=300)
    for name in ("worst_case_upper", "rss", "deviation_linear", "deviation", "searched_lower", "searched_upper"):
        assert result[name].item() == pytest.approx(0, abs=1e-15), name
    assert result["yield"].item() == 1
    assert result["mean"].item() == pytest.approx(result["nominal"].item(), abs=1e-15)


def test_indices_of_what_does_not_vary() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        result = trunnion.tolerance(fourbar("±0 mm", measures=LIMIT), methods=["sobol"], samples=300)
    assert not np.any(result["first_order"].values > 0)


@pytest.mark.parametrize("method", ["monte-carlo", "quasi-monte-carlo"])
@pytest.mark.parametrize("samples", [1, 2, 7, 8])
def test_few_samples(method: str, samples: int) -> None:
    result = trunnion.tolerance(fourbar(measures=LIMIT), methods=["linear", method], samples=samples, seed=2)
    done = result["samples"].item()
    assert done == (samples if method == "monte-carlo" else 8)
    assert np.isfinite(result["mean"].item())
    assert np.isnan(result["deviation"].item()) == (done == 1)
    assert result["yield"].item() == 1
    assert 0 < result["yield_low"].item() < result["yield_high"].item() == 1


@pytest.mark.slow
@pytest.mark.parametrize("steps", [1, 3])
def test_few_positions(steps: int) -> None:
    measures = {
        "angle": {"angle": "rocker"}, "stroke": {"stroke": "D"}, "line": {"straightness": "coupler.C"},
        "path": {"path_error": "coupler.C"}, "peak": {"effort": "A", "as": "maximum"},
        "rms": {"effort": "A", "as": "rms"},
    }  # fmt: skip
    result = trunnion.tolerance(fourbar(loaded=True, measures=measures), methods=ALL, samples=40, steps=steps)
    assert result.sizes["position"] >= steps  # the places of the mean square come on top
    assert np.all(np.isfinite(result["mean"].values))
    del measures["rms"]
    result = trunnion.tolerance(fourbar(loaded=True, measures=measures), methods=ALL, samples=40, steps=steps)
    assert result.sizes["position"] == steps


def test_many_samples_at_one_place() -> None:
    result = trunnion.tolerance(fourbar(measures=LIMIT), methods=["linear", "monte-carlo"], samples=100_000)
    assert result.nbytes < 2e6  # what is kept does not grow with the samples
    sigma = result["deviation_linear"].item()
    assert result["mean"].item() == pytest.approx(result["nominal"].item(), abs=5 * sigma / np.sqrt(1e5))
    assert result["deviation"].item() == pytest.approx(sigma, rel=0.012)


# ---- names, sizes, limits -------------------------------------------------------------------------------------


def test_names_of_any_script() -> None:
    measures = {
        "Winkel φ, ±": {"angle": "rocker", "at": "60 deg", "at_least": "95.19 deg"},
        "角度": {"angle": "rocker", "at": "60 deg", "at_most": "95.19 deg"},
    }
    result = trunnion.tolerance(fourbar(measures=measures), methods=["monte-carlo"], samples=2000)
    assert [str(name) for name in result["measure"].values] == list(measures)
    assert float(result["yield"].sum()) == 1  # one or the other
    assert 0.3 < result["yield"].values[0] < 0.7
    assert result["yield_all"].item() == 0
    assert np.all(np.isnan(result["cp"].values))  # of one limit there is C_pk alone
    assert np.all(np.isfinite(result["cpk"].values))


@pytest.mark.slow
@settings(max_examples=25)
@given(st.floats(-9, 9), st.integers(0, 100))
def test_any_unit_of_length(power: float, seed: int) -> None:
    """From a linkage of 0.1 nm to one of 100 000 km: the angle, the share of each length and the yield are the same."""
    scale = 10.0**power
    sizes = {name: scale * value for name, value in FOURBAR.items()}
    options: dict[str, Any] = {"methods": ["linear", "monte-carlo"], "samples": 64, "seed": seed}
    plain = trunnion.tolerance(fourbar(measures=LIMIT), **options)
    scaled = trunnion.tolerance(
        fourbar(
            dimensions=sizes, tolerances=dict.fromkeys(sizes, 5e-5 * scale), measures=LIMIT,
            assembly={"C": [0.1 * scale, 0.07 * scale]},
        ),
        **options,
    )  # fmt: skip
    for name in ("mean", "deviation", "worst_case_upper", "rss"):
        assert scaled[name].item() == pytest.approx(plain[name].item(), rel=1e-9)
    np.testing.assert_allclose(scaled["contribution_rss"].values, plain["contribution_rss"].values, rtol=1e-9)
    assert scaled["yield"].item() == plain["yield"].item()


def test_limits_to_one_side_and_without_the_nominal() -> None:
    measures = {
        "above": {"angle": "rocker", "at": "60 deg", "limit": "+0.02/0 deg"},
        "beyond": {"angle": "rocker", "at": "60 deg", "limit": "+0.05/+0.01 deg"},
        "nothing": {"angle": "rocker", "at": "60 deg", "limit": "±0 deg"},
    }
    found, batch = many(fourbar(measures=measures), 1000)
    part = batch.figures(uniforms(1, 0, 4, 1000))
    figures, passed = part["figure"], part["passed"]
    change = np.degrees(figures[0] - found.linear.measures[0].reference.figure)
    np.testing.assert_array_equal(passed[0], (change >= 0) & (change <= 0.02))
    np.testing.assert_array_equal(passed[1], (change >= 0.01) & (change <= 0.05))
    assert np.sum(passed[2]) == 0


def test_limits_of_a_measure_over_the_turn() -> None:
    """Its largest |deviation| is the figure; limits hold of the signed deviation at every position."""
    measures = {"angle": {"angle": "rocker", "limit": "+0.06/-0.1 deg"}}
    found, batch = many(fourbar(measures=measures), 500, steps=120)
    part = batch.figures(uniforms(1, 0, 4, 500), 500)
    figures, passed = part["figure"], part["passed"]
    assert found.linear.measures[0].reference.figure == 0
    change = np.degrees(part["curve0"])
    near = np.abs(np.degrees(figures[0]) - np.max(np.abs(change), axis=1))
    assert np.max(near) < 1e-4  # between positions it is no more than that higher
    clear = (np.abs(np.max(change, axis=1) - 0.06) > 1e-4) & (np.abs(np.min(change, axis=1) + 0.1) > 1e-4)
    kept = np.all((change <= 0.06) & (change >= -0.1), axis=1)
    np.testing.assert_array_equal(passed[0][clear], kept[clear])
    assert 0 < np.sum(kept) < 500


REFUSED: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {
    "nothing varies": ({"tolerances": {}}, {}, "nothing has a tolerance"),
    "no such measure": ({}, {"measures": ["bogus"]}, "is no measure"),
    "no such method": ({}, {"methods": ["bogus"]}, "no method 'bogus'"),
    "two at once": ({}, {"methods": ["monte-carlo", "quasi-monte-carlo"]}, "two sampling methods"),
    "no samples": ({}, {"samples": 0}, "0 samples"),
    "no positions": ({}, {"steps": 0}, "0 positions"),
    "negative seed": ({}, {"seed": -1}, "a seed of -1"),
    "no workers": ({}, {"jobs": 0}, "0 jobs"),
    "no such engine": ({}, {"engine": "bogus"}, "no engine 'bogus'"),
    "contradicting correlations": (
        {"correlations": [{"of": ["l1", "l2"], "coefficient": 0.9}, {"of": ["l2", "l3"], "coefficient": 0.9},
                          {"of": ["l1", "l3"], "coefficient": -0.9}]},
        {}, "contradict",
    ),
    "indices of correlated numbers": (
        {"correlations": [{"of": ["l1", "l2"], "coefficient": 0.5}]}, {"methods": ["sobol"]}, "independent",
    ),
    "place in no unit": ({"measures": {"angle": {"angle": "rocker"}}}, {"at": float("nan")}, "is not a position"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_a_finding(name: str) -> None:
    model, options, said = REFUSED[name]
    with pytest.raises(MechanismError, match=said):
        trunnion.tolerance(fourbar(**model), **{"samples": 10, **options})


@pytest.mark.parametrize("place", ["bogus", "3 mm"])
def test_place_that_is_none(place: str) -> None:
    with pytest.raises(MechanismError):
        trunnion.tolerance(fourbar(measures={"angle": {"angle": "rocker"}}), methods=["linear"], at=place)


# ---- variance-based indices -----------------------------------------------------------------------------------


def test_indices_of_a_nearly_linear_measure() -> None:
    """First and total order are the shares of the variance, S² σ²/Σ; a run-out and a play count once."""
    tolerances = {"l1": "±0.05 mm", "l2": "±0.02 mm", "l3": "±0.08 mm", "l4": "±0.05 mm"}
    result = trunnion.tolerance(fourbar(tolerances=tolerances), methods=["linear", "sobol"], samples=12_000)
    share = result["contribution_variance"].values
    np.testing.assert_allclose(result["first_order"].values, share, rtol=0, atol=0.02)
    np.testing.assert_allclose(result["total_order"].values, share, rtol=0, atol=0.02)
    for order in ("first", "total"):
        low, high = result[f"{order}_order_low"].values, result[f"{order}_order_high"].values
        assert np.all((low - 0.01 <= share) & (share <= high + 0.01))


def test_indices_of_a_play_and_its_size() -> None:
    """The angle by a pin anywhere in a hole: the size of the hole does nothing alone, the place in it nearly all."""
    joints = fourbar().data()["joints"]
    joints["C"]["pin"] = {"radius": "5 mm", "clearance": "0.2 mm ± 0.1 mm"}
    result = trunnion.tolerance(fourbar(tolerances={}, joints=joints), methods=["linear", "sobol"], samples=16_000)
    first, total = result["first_order"].values[0], result["total_order"].values[0]
    # y = ρ c: V(E(y|ρ)) = 0, V(E(y|c)) = E(ρ)² E(c²); all V = E(ρ²) E(c²)
    known = 0.2**2 / (0.2**2 + (0.1 / 3) ** 2)
    np.testing.assert_allclose(first, [0, known], rtol=0, atol=0.02)
    np.testing.assert_allclose(total, [1 - known, 1], rtol=0, atol=0.02)


def test_draws_of_a_study_are_those_of_its_sampler() -> None:
    """The helper of these tests draws what a run does."""
    found = study(fourbar(measures=LIMIT))
    job = found.sampling("monte-carlo", 300, 7)
    own = sampler(found, 300, seed=7)
    np.testing.assert_array_equal(job.prepare().drawn(0), own.drawn(0))
