"""The margin where several groups can lock, held against the coefficient that is lowered until nothing locks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from brief import brief
from trunnion import Mechanism, Status, locking

STEPS = 24


def ram(coefficient: float, aside: float = 0.0) -> Mechanism:
    """A crank with its block on a lever, which pushes a ram by a rod. aside: load on the lever alone, N."""
    axis = {"at": [0, 0], "axis": [1, 0]}
    return Mechanism(
        links={
            "ground": {"points": {"A": [0, 0], "C": [0, -0.08], "G": {"at": [-0.1, 0.1], "axis": [1, 0]}}},
            "crank": {"points": {"A": [0, 0], "B": [0.03, 0]}},
            "lever": {"points": {"C": [0, 0], "D": [0.18, 0], "F": axis}},
            "rod": {"points": {"D": [0, 0], "E": [0.1, 0]}},
            "block": {"points": {"B": [0, 0], "F": axis}},
            "slide": {"points": {"E": [0, 0], "G": axis}},
        },
        joints={
            "A": {"type": "revolute", "links": ["ground", "crank"]},
            "C": {"type": "revolute", "links": ["ground", "lever"]},
            "D": {"type": "revolute", "links": ["lever", "rod"]},
            "F": {"type": "prismatic", "links": ["lever", "block"]},
            "B": {"type": "revolute", "links": ["crank", "block"]},
            "G": {"type": "prismatic", "links": ["ground", "slide"]},
            "E": {"type": "revolute", "links": ["rod", "slide"]},
        },
        assembly={"D": [0, 0.1], "F": 0.11, "B": [0, 0.03], "E": [-0.1, 0.1]},
        drivers={"A": {"speed": 6.0, "start": 1.6}},
        loads={
            "work": {"joint": "G", "resisting_force": 150.0},
            "aside": {"link": "lever", "at": "D", "force": [aside, -2 * aside]},
        },
        joint_defaults={"friction": coefficient, "pin": {"radius": 0.008}, "guide": {"length": 0.04}},
    )


def margins(mechanism: Mechanism) -> Any:
    return brief(mechanism, STEPS)["locking_margin"].values


@pytest.mark.parametrize(("coefficient", "aside"), [(0.4, 0.0), (2.0, 400.0)])
def test_below_the_margin_nothing_locks_and_above_it_something_does(coefficient: float, aside: float) -> None:
    """Whether it runs, one group locks or both, and whatever loads the inner one beside the outer."""
    found = margins(ram(coefficient, aside))
    times = float(np.nanmin(found)) * coefficient
    assert 0.4 < times < 4.0
    for multiple, locks in ((1 - 1e-4, False), (1 + 1e-4, True)):
        status = brief(ram(multiple * times, aside), STEPS)["status"].values
        assert np.any(status == Status.LOCKED) == locks


@pytest.mark.parametrize("aside", [0.0, 400.0])
def test_the_margin_of_a_position_is_of_the_mechanism_not_of_its_coefficient(aside: float) -> None:
    """Times the coefficient it is the same, whatever the coefficient at which it was looked for."""
    critical = [coefficient * margins(ram(coefficient, aside)) for coefficient in (0.5, 1.2, 2.0)]
    known = np.isfinite(critical).all(axis=0)
    assert np.count_nonzero(known) > STEPS // 2
    np.testing.assert_allclose(critical[1][known], critical[0][known], rtol=1e-6)
    np.testing.assert_allclose(critical[2][known], critical[0][known], rtol=1e-6)


def test_joints_of_a_group_without_loads_have_no_critical_multiple() -> None:
    found = locking(ram(2.0), STEPS)
    locked = found["status"].values == Status.LOCKED
    for joint, unknown in (("E", False), ("B", True)):
        assert np.all(np.isnan(found["critical_multiple"].sel(joint=joint).values[locked]) == unknown)
