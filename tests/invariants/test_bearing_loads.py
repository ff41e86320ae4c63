"""Normal load of bearings and guides against the forces at their ends, and its gradient against differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from trunnion.algebra.space import ORIGIN
from trunnion.joints.pairs import PlanarContactLoad
from trunnion.joints.spatial_load import BearingLoad

LENGTH, WIDTH = 0.3, 0.05


def of(load: Any, *reaction: float) -> float:
    """Normal load under a reaction about the middle of the bearing."""
    return float(load.normal(load.felt(reaction)))


@pytest.mark.parametrize("summed", [False, True])
def test_torsion_of_a_guide_is_carried_by_two_forces_its_width_apart(summed: bool) -> None:
    """M = F w with F on either side: 2 M/w, to which a force across adds itself; along it nothing presses."""
    guide = BearingLoad(ORIGIN, LENGTH, summed, width=WIDTH)
    assert of(guide, 0, 0, 0, 0, 0, 3.0) == pytest.approx(2 * 3.0 / WIDTH)
    assert of(guide, 0, 0, 0, 0, 0, -3.0) == pytest.approx(2 * 3.0 / WIDTH)
    assert of(guide, 30.0, 40.0, 500.0, 0, 0, 3.0) == pytest.approx(50.0 + 2 * 3.0 / WIDTH)


def test_a_moment_across_a_bearing_is_carried_by_its_ends() -> None:
    """M = F L with F on either end; a force off the middle by a loads the ends as a lever: F (1/2 ± a/L)."""
    bearing = BearingLoad(ORIGIN, LENGTH)
    assert of(bearing, 0, 0, 0, 3.0, 0, 0) == pytest.approx(2 * 3.0 / LENGTH)
    inside, outside = 0.1 * LENGTH, 0.8 * LENGTH
    assert of(bearing, 0, 60.0, 0, -60.0 * inside, 0, 0) == pytest.approx(60.0)
    assert of(bearing, 0, 60.0, 0, -60.0 * outside, 0, 0) == pytest.approx(60.0 * 2 * outside / LENGTH)
    threaded = BearingLoad(ORIGIN, LENGTH, flank=1.25)
    assert of(threaded, 0, 0, -80.0, 0, 0, 0) == pytest.approx(100.0)


@pytest.mark.parametrize("off", [0.0, 0.1, 0.4, 0.9])
def test_a_guide_in_the_plane_is_loaded_at_its_two_ends(off: float) -> None:
    """A force off the middle by `off` presses on the ends, L/2 to either side, as on a beam on two supports."""
    guide = PlanarContactLoad(across=(0.0, 1.0), length=LENGTH)
    ends = [70.0 * (0.5 + sign * off) for sign in (1, -1)]
    assert of(guide, 11.0, 70.0, 70.0 * off * LENGTH) == pytest.approx(sum(abs(end) for end in ends))
    moved = PlanarContactLoad(across=(0.0, 1.0), length=LENGTH, arm=(off * LENGTH, 0.02))
    assert of(moved, 11.0, 70.0, 70.0 * off * LENGTH - 11.0 * 0.02) == pytest.approx(70.0)


LOADS = {
    "pin": PlanarContactLoad(),
    "guide in the plane": PlanarContactLoad(across=(0.6, 0.8), length=LENGTH, arm=(0.04, -0.03)),
    "bearing": BearingLoad(ORIGIN, LENGTH),
    "bearing, summed": BearingLoad(ORIGIN, LENGTH, True),
    "guide": BearingLoad(ORIGIN, LENGTH, width=WIDTH),
    "thread": BearingLoad(ORIGIN, LENGTH, flank=1.25),
}


@pytest.mark.parametrize("name", LOADS)
def test_the_gradient_of_a_normal_load_is_that_of_differences(name: str) -> None:
    load, random = LOADS[name], np.random.default_rng(3)
    size = 3 if isinstance(load, PlanarContactLoad) else 6
    for _ in range(20):
        felt = np.array(load.felt(tuple(random.normal(size=size))), float)
        found = load.gradient(tuple(felt), load.normal(tuple(felt)))
        steps = 1e-6 * np.eye(len(felt))
        expected = [(load.normal(tuple(felt + h)) - load.normal(tuple(felt - h))) / 2e-6 for h in steps]
        np.testing.assert_allclose(np.array(found, float), expected, rtol=1e-6, atol=1e-6)
