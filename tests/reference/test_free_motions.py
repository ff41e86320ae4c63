"""Random mechanisms that are let go, against SciPy on the equations of all their links with multipliers."""

from __future__ import annotations

import pytest
from benchmarks.free_motions import LIMIT, SPATIAL_LIMIT, examine, examine_spatial

SEEDS = (1, 2, 12, 5, 10, 24, 34)


@pytest.mark.spread(0, "2")
@pytest.mark.parametrize("seed", SEEDS)
def test_they_move_as_all_their_links_must(seed: int) -> None:
    """Gravity, forces, springs, dampers, and friction in pins and guides by its law from the multipliers."""
    what, off = examine(seed)
    assert what.startswith("compared")
    assert off < LIMIT


@pytest.mark.slow
def test_a_spatial_one_moves_as_all_its_links_must() -> None:
    """A crank with a rod of two balls: gravity, forces, moments, and a spring with a damper of some."""
    what, off = examine_spatial(2)
    assert what.startswith("compared")
    assert off < SPATIAL_LIMIT
