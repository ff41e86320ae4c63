"""Shares of friction whose largest is least, against linear programming."""

import numpy as np
import pytest
from scipy.optimize import linprog

from trunnion.dynamics.bordered import least_shares


@pytest.mark.parametrize(("rank", "count"), [(1, 1), (1, 4), (2, 2), (2, 5), (3, 6)])
def test_the_largest_share_is_the_least(rank: int, count: int) -> None:
    random = np.random.default_rng(rank * 10 + count)
    for _ in range(10):
        ways, wanted = random.normal(size=(rank, count)), random.normal(size=rank)
        found = least_shares(ways, wanted)
        assert ways @ found == pytest.approx(wanted, abs=1e-12)
        both = np.vstack([np.hstack([np.eye(count), -np.ones((count, 1))]),
                          np.hstack([-np.eye(count), -np.ones((count, 1))])])  # fmt: skip
        told = linprog(
            np.append(np.zeros(count), 1.0), both, np.zeros(2 * count), np.hstack([ways, np.zeros((rank, 1))]), wanted,
            bounds=(None, None),
        )  # fmt: skip
        assert np.max(np.abs(found)) == pytest.approx(told.fun, rel=1e-9)
