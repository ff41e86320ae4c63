"""Figures of a comparison against closed forms: uncertainty of a bias, scatter, and how turns follow each other."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from rig_measurements import course
from trunnion.rig.judge import judge
from trunnion.rig.reading.measurement import Accuracy

COVERED = stats.norm.cdf(2) - stats.norm.cdf(-2)  # of k = 2


def test_scatter_between_turns_is_that_of_a_sample() -> None:
    """1, 2, 4: s² = (16 + 1 + 25)/9/2 = 7/3, of the mean s²/3."""
    one = course("torque", np.array([[1.0], [2.0], [4.0]]))
    assert one.scatter == pytest.approx((7 / 3) ** 0.5)
    assert one.uncertainty == pytest.approx((7 / 9) ** 0.5)
    assert np.isnan(course("torque", np.array([[1.0]])).scatter).all()


@pytest.mark.parametrize("resolution", [0.0, 0.9, 3.0])
@pytest.mark.parametrize("zero", [0.0, 0.05])
def test_uncertainty_of_a_bias(resolution: float, zero: float) -> None:
    """Means of turns scatter by s/√n; steps of the readings give step/√12 at each of the positions, each its own, so
    /√N in the mean; the zero is that of all of them. k is Student's for (n − 1) u⁴/u_A⁴."""
    offsets, positions = np.array([-0.2, 0.1, 0.3, -0.2]), 25
    found = judge(
        course("torque", 5.0 + offsets[:, None] + np.zeros((4, positions)), Accuracy(zero, 0.0, resolution)),
        np.full(positions, 4.0),
        np.ones(positions, bool),
        np.arange(positions),
    )
    own = float(np.sum(offsets**2)) / 3 / 4
    steps = resolution**2 / 12 / positions
    total = own + steps + zero**2
    factor = stats.t.ppf(0.5 + COVERED / 2, 3 * total**2 / own**2)
    assert found["bias"] == pytest.approx(1.0)
    assert found["bias_expanded"] == pytest.approx(factor * total**0.5, rel=1e-6)
