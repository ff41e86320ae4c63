"""Which joint locks a mechanism, and driving backward: closed forms and consistency."""

from __future__ import annotations

import numpy as np
import pytest

import trunnion
from brief import brief
from mechanisms import Data, analyse, build, findings, five_bar, four_bar, model, slider_crank
from trunnion import Mechanism, Status, locking
from trunnion.cycle.locking_course import multiples_at
from trunnion.results.attributes import summary_of
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.run import prepare
from trunnion.solve.status import status_of


def drawer(arm: float, coefficient: float, length: float = 0.3) -> Data:
    """A slide driven along its middle against a useful load beside it."""
    return {
        "links": {
            "ground": {"points": {"S": {"at": [0, 0], "axis": [1, 0]}}},
            "block": {"points": {"S": {"at": [0, 0], "axis": [1, 0]}, "P": [0, arm]}},
        },
        "joints": {
            "S": {
                "type": "prismatic",
                "links": ["ground", "block"],
                "guide": {"length": length},
                "friction": coefficient,
            }
        },
        "drivers": {"S": {"speed": 0.1, "range": [0, 0.2]}},
        "loads": {"weight": {"link": "block", "at": "P", "force": [-50.0, 0], "useful": True}},
    }


@pytest.mark.parametrize(("arm", "coefficient"), [(0.1, 0.2), (0.3, 0.2), (0.3, 0.5), (0.45, 0.6)])
def test_drawer_driven_backward(arm: float, coefficient: float) -> None:
    """N₁ + N₂ = 2 F a/L, so η = 1/(1 + 2 f a/L) forward and 1 − 2 f a/L backward: it holds itself from f = L/2a."""
    mechanism = Mechanism(**drawer(arm, coefficient))
    result = trunnion.analyse(mechanism, 20)
    loss = 2 * coefficient * arm / 0.3
    assert float(result["efficiency"]) == pytest.approx(1 / (1 + loss), rel=1e-12)
    found = locking(mechanism, 20)
    np.testing.assert_allclose(found["drive_effort_reverse"], 50.0 * (1 - loss), rtol=1e-12, atol=1e-12)
    (row,) = [row for row in summary_of(result) if row.name == "efficiency_reverse"]
    assert row.value == pytest.approx(1 - loss, rel=1e-12)
    assert (row.note == "self-locking") == (loss >= 1)


CASES = {
    "slider-crank": (lambda: slider_crank(0.3, 0.5, 0.1), {"friction": 0.35, "guide": 0.06, "radius": 0.05}),
    "five-bar": (five_bar, {"friction": 0.5, "radius": 0.15}),
    "four-bar": (four_bar, {"friction": 0.5, "radius": 0.12}),
}


def multiples_of(mechanism: Mechanism, steps: int, after: float = 0.0) -> dict[str, np.ndarray]:
    """Critical multiples of the joints at times, or `after` each, without what `locking` asks of the cycle."""
    run = prepare(mechanism)
    return multiples_at(run, run.cycle.times(steps) + after, MARGIN)


def test_the_result_has_the_multiples_of_every_position() -> None:
    data, options = CASES["four-bar"]
    found, expected = (of(build(data(), **options), 4) for of in (locking, multiples_of))
    assert any(np.any(np.isfinite(multiple)) for multiple in expected.values())
    for joint, multiple in expected.items():
        np.testing.assert_array_equal(found["critical_multiple"].sel(joint=joint), multiple)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_critical_multiples_are_where_it_locks(name: str) -> None:
    """Just below it runs, just above it is locked: one joint's coefficient changed, away from reversals."""
    data, options = CASES[name]
    steps, coefficient = 12, options["friction"]
    mechanism = build(data(), **options)
    after = 0.1 * prepare(mechanism).cycle.duration / steps
    found = multiples_of(mechanism, steps, after)
    time = prepare(mechanism).cycle.times(steps) + after
    factors = np.array([1 - 1e-6, 1 + 1e-6])
    checked = 0
    for joint, multiple in found.items():
        at = np.flatnonzero(np.isfinite(multiple) & (multiple > 0))[::3]
        stated = float(coefficient) * multiple[at][:, None] * factors
        whole = model(data(), **options)
        whole["joints"][joint]["friction"] = coefficient
        run = prepare(Mechanism(**whole))
        values = run.system.mechanism.parameter_set.evaluate(
            {f"joints.{joint}.friction.coefficient": stated.reshape(-1, 1)}
        )
        status = status_of(run.solve(np.repeat(time[at], 2)[:, None], values), (stated.size, 1)).reshape(stated.shape)
        for k, position in enumerate(at):
            assert (status[k] == Status.LOCKED).tolist() == [False, True], (joint, position, multiple[position])
            checked += 2
        if len(at) and checked == 2 * len(
            at
        ):  # what was solved together is what the analysis of a model by itself says
            for factor in range(2):
                whole["joints"][joint]["friction"] = float(stated[0, factor])
                alone = prepare(Mechanism(**whole))
                assert status_of(alone.solve(time[at[:1]]), (1,))[0] == status[0, factor]
    assert checked >= 6


@pytest.mark.slow
def test_joint_without_which_it_still_locks() -> None:
    """Where all friction together locks early, no single joint need be able to free it: then its multiple is 0."""
    data, options = CASES["slider-crank"]
    mechanism = build(data(), **{**options, "friction": 0.9})
    found = brief(mechanism, 8)
    locked = found["locking_margin"].values < 1
    multiple = np.array(list(multiples_of(mechanism, 8).values()))
    assert np.any(locked)
    assert np.all(np.nanmin(multiple, axis=0)[locked] < 1)
    assert np.any(multiple == 0)


@pytest.mark.slow
def test_locked_findings_name_the_joint_that_decides() -> None:
    data, options = CASES["slider-crank"]
    result = analyse(data(), 12, **{**options, "friction": 0.9})
    assert np.any(result["status"] == Status.LOCKED)
    (finding,) = [one for one in findings(result) if one["code"] == "friction.locked"]
    assert "decides" in finding["remedy"] or "lower these" in finding["remedy"]
    assert ("jammed" in finding["what"]) == bool(finding["figures"]["reverse"])


def test_there_is_nothing_to_lock_without_friction() -> None:
    found = locking(build(four_bar(), friction=None), 12)
    assert np.all(np.isnan(found["critical_multiple"]))
    assert np.all(np.isinf(found["locking_margin"]))


@pytest.mark.slow
def test_coefficient_only_where_the_law_is_proportional_to_it() -> None:
    data, options = CASES["slider-crank"]
    stribeck = {"law": "stribeck", "coefficient": 0.2, "static": 0.35, "stribeck_speed": 0.5}
    curved = summary_of(analyse(data(), 12, **{**options, "friction": stribeck}))
    plain = summary_of(analyse(data(), 12, **options))
    ends = [{row.name.partition(".critical_")[2] for row in rows} - {""} for rows in (curved, plain)]
    assert ends == [{"multiple"}, {"coefficient"}]


@pytest.mark.slow
def test_successive_approximation_has_the_same_margin() -> None:
    data, options = CASES["slider-crank"]
    mechanism = build(data(), **{**options, "friction": 0.2})
    plain = brief(mechanism, 12)
    named = brief(mechanism, 12, FrictionMethod("successive-approximation", 1e-10))
    assert np.isfinite(plain["locking_margin"]).any()
    solved = named["status"].values < Status.NOT_CONVERGED
    np.testing.assert_allclose(
        named["locking_margin"].values[solved], plain["locking_margin"].values[solved], rtol=1e-6
    )


def test_locking_says_nothing_where_there_is_no_answer() -> None:
    """Positions that cannot be assembled have no margin and no multiple."""
    found = locking(build(four_bar(2.0, 1.5, 1.5, 4.0)), 36)
    gone = found["status"].values == Status.NOT_ASSEMBLED
    assert np.any(gone)
    assert np.any(~gone)
    for name in ("locking_margin", "critical_multiple"):
        assert np.all(np.isnan(found[name].values[..., gone]))
        assert not np.any(np.isnan(found[name].values[..., found["status"].values < Status.NOT_CONVERGED]))
