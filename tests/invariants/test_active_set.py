"""The active set against complementarity problems that have one solution."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from trunnion.dynamics.active import Mode, Modes, settled


@given(st.integers(0, 2**32 - 1), st.integers(1, 6))
def test_the_worst_row_first_finds_what_all_cases_have(seed: int, count: int) -> None:
    """w = M z + q, z ≥ 0, w ≥ 0, z·w = 0; of a positive definite M exactly one case agrees."""
    random = np.random.default_rng(seed)
    root, begin = random.normal(size=(count, count)), random.normal(size=count)
    matrix = root @ root.T + 0.1 * np.eye(count) + 0.5 * (root - root.T)

    def missed(modes: Modes) -> dict[int, float]:
        held = [k for k, mode in enumerate(modes) if mode == 0]
        force = np.zeros(count)
        force[held] = np.linalg.solve(matrix[np.ix_(held, held)], -begin[held])
        gap = matrix @ force + begin
        return {k: min(0.0, force[k] if k in held else gap[k]) for k in range(count)}

    def objections(modes: Modes) -> Mapping[int, Mode]:
        rows = missed(modes)
        worst = min(rows, key=lambda k: rows[k])
        return {worst: None if modes[worst] == 0 else 0} if rows[worst] < -1e-12 else {}

    solutions = [case for case in itertools.product((None, 0), repeat=count) if not any(missed(case).values())]
    assert [settled([None] * count, objections, [(None, 0)] * count)] == solutions


def test_where_changes_come_round_all_cases_are_tried() -> None:
    def objections(modes: Modes) -> Mapping[int, Mode]:
        return {} if modes == (0, None) else {k: None if mode == 0 else 0 for k, mode in enumerate(modes)}

    assert settled([None, None], objections, [(None, 0)] * 2) == (0, None)
    assert settled([None], lambda modes: None, [(None, 0)]) is None
