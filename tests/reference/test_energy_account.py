"""The energy account of motions in time: works and energies agree at every time of every example."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from timed import slider_crank
from trunnion import read, simulate
from trunnion.dynamics.integrate import Integration
from trunnion.dynamics.solution import Solution
from trunnion.views.motion.shown import ENERGIES

Array = NDArray[np.float64]
EXAMPLES = Path(__file__).parents[2] / "examples"


def test_works_and_energies_agree() -> None:
    """Works and energies agree to 1e-8 of the energy turned over, at every time."""
    result = simulate(slider_crank(), 0.5, 100)
    turned_over = float(np.abs(result["work_drive"].values).max())
    assert np.abs(result["energy_residual"].values).max() < 1e-8 * turned_over
    assert np.abs(result["power_residual"].values).max() < 1e-9 * np.abs(result["drive_power"].values).max()


MOVING = {"andrews-squeezer-in-time": 0.03, "flywheel-press": 3.0, "landing-gear": 50.0, "stick-slip-drive": 0.8,
          "tilting-gudgeon-pin": 1e-3, "worn-gudgeon-pin": 2e-3}  # fmt: skip


def unbalanced(result: Any) -> float:
    """Largest residual of the account, as a share of the largest work or energy turned over."""
    accounts = [result[name] for name, _ in ENERGIES if name in result]
    turned_over = max(float(abs(one - one[0]).max()) for one in accounts)
    return float(abs(result["energy_residual"]).max()) / turned_over


@pytest.mark.parametrize("example", MOVING)
def test_the_account_of_the_examples_as_they_begin(example: str) -> None:
    assert unbalanced(simulate(read(EXAMPLES / f"{example}.yaml"), MOVING[example], 200)) < 1e-8


@pytest.mark.sample(3)
@pytest.mark.slow
@pytest.mark.parametrize("example", MOVING)
def test_the_account_of_the_examples_as_they_stand(example: str) -> None:
    """The whole time that each runs where nothing else is asked; part of a turn of the one that takes minutes."""
    duration = 0.003 if example == "tilting-gudgeon-pin" else None
    assert unbalanced(simulate(read(EXAMPLES / f"{example}.yaml"), duration)) < 1e-8


def test_every_example_that_moves_in_time_has_its_account_tested() -> None:
    moving = set()
    for path in EXAMPLES.glob("*.yaml"):
        one = read(path)
        if any(driver.found for driver in one.drivers.values()) or any(
            joint.contact is not None for joint in one.effective_joints.values()
        ):
            moving.add(path.stem)
    assert moving == MOVING.keys()


@pytest.mark.slow
def test_a_motion_whose_account_is_off_is_found_again_with_a_finer_tolerance(monkeypatch: pytest.MonkeyPatch) -> None:
    """Coarsened, all that is integrated with 1e-9 is off by more than 1e-8."""
    asked: list[float] = []
    plain = Integration.run

    def coarse(integration: Integration, row: Array) -> Solution:
        asked.append(integration.tolerance)
        integration.tolerance *= 1e3
        return plain(integration, row)

    monkeypatch.setattr(Integration, "run", coarse)
    result = simulate(slider_crank(), 0.2, 20)
    assert asked == pytest.approx([1e-9, 1e-10, 1e-11][: len(asked)])
    assert len(asked) > 1
    turned_over = float(np.abs(result["work_drive"].values).max())
    assert float(np.abs(result["energy_residual"].values).max()) < 1e-7 * turned_over
