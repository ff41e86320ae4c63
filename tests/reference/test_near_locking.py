"""Which joint locks a mechanism, and driving backward: closed forms and consistency."""

from __future__ import annotations

import numpy as np
import pytest

import trunnion
from mechanisms import Data, build, five_bar, four_bar, model, slider_crank
from trunnion import Mechanism, Status, locking
from trunnion.cycle.locking_course import critical_multiples
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


def multiples_of(mechanism: Mechanism, steps: int) -> dict[str, np.ndarray]:
    """Critical multiples of the joints at every position, without what `locking` asks of the cycle."""
    run = prepare(mechanism)
    return critical_multiples(run.solve(run.cycle.times(steps), method=FrictionMethod()), MARGIN)


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", CASES)
def test_critical_multiples_are_where_it_locks(name: str) -> None:
    """Just below it runs, just above it is locked: one joint's coefficient changed in the model, at every position."""
    data, options = CASES[name]
    steps, coefficient = 12, options["friction"]
    mechanism = build(data(), **options)
    found = multiples_of(mechanism, steps)
    time = prepare(mechanism).cycle.times(steps)
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
    assert checked >= 6


def test_locking_says_nothing_where_there_is_no_answer() -> None:
    """Positions that cannot be assembled have no margin and no multiple."""
    found = locking(build(four_bar(2.0, 1.5, 1.5, 4.0)), 36)
    gone = found["status"].values == Status.NOT_ASSEMBLED
    assert np.any(gone)
    assert np.any(~gone)
    for name in ("locking_margin", "critical_multiple"):
        assert np.all(np.isnan(found[name].values[..., gone]))
        assert not np.any(np.isnan(found[name].values[..., found["status"].values < Status.NOT_CONVERGED]))
