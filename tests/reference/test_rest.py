"""Bounds of the drive effort where a joint rests, against a scan over all that its resistance may be."""

from pathlib import Path

import numpy as np
import pytest

from brief import brief
from mechanisms import build, slider_crank
from trunnion import Status, read
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
PEZZUTI = {"joint_defaults.friction.model": "pezzuti"}
FINE = 2001  # shares of one contact
CASES = {
    "one contact, smooth, in space": ("pezzuti-cardan", {"bearing": "25 mm"}, "pin-2", True),
    "one contact, steep": ("pezzuti-cardan", {"bearing": "30 mm", "misalignment": "45 deg"}, "pin-2", True),
    "turn and slide of [P], one of them at rest": ("pezzuti-cardan", PEZZUTI, "pin-2", True),
    "guide of a trammel, whose load has a kink": ("elliptic-trammel", {}, "X", True),
    "slotted guide": ("scotch-yoke", {}, "G", True),
    "pin of a compressor, ends are the bounds": ("slider-crank", {}, "Q", False),
    "load that resists the joint that rests": ("indexing-press", {}, "F", False),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", CASES)
def test_the_bounds_are_the_extremes_over_the_whole_interval(case):
    name, values, joint, inside = CASES[case]
    mechanism = read(EXAMPLES / f"{name}.yaml").with_values(values)
    result, run = brief(mechanism, 72), prepare(mechanism)
    lower, own, upper = (result[f"drive_effort{end}"].values for end in ("_lower", "", "_upper"))
    driver = int(np.argmax(np.nanmax(upper - lower, axis=1))) if joint != "F" else 1
    shares = np.linspace(-1.0, 1.0, FINE)
    if run.system.resting(joint) == 2:
        shares = np.linspace(-1.0, 1.0, 41)
        grid = tuple(part.ravel() for part in np.meshgrid(shares, shares))
    else:
        grid = (shares,)
    beyond = []
    for at in np.flatnonzero(upper[driver] - lower[driver] > 0):
        time = np.full(grid[0].shape, result["time"].values[at])
        found = run.at(time, {}, FrictionMethod(), {joint: grid}).efforts[str(result["driver"].values[driver])]
        scan = np.broadcast_to(found, grid[0].shape)
        if np.ptp(scan) < 1e-9 * abs(own[driver, at]):
            continue  # it moves here
        corners = scan[np.all(np.abs(np.array(grid)) == 1.0, axis=0)]
        beyond.append(max(corners.min() - scan.min(), scan.max() - corners.max()) / np.ptp(scan))
        step = np.abs(np.diff(scan)).max() if len(grid) == 1 else 0.02 * np.ptp(scan)  # what a scan may miss
        noise = 1e-9 * np.ptp(scan)
        assert scan.min() - step <= lower[driver, at] <= scan.min() + noise
        assert scan.max() - noise <= upper[driver, at] <= scan.max() + step
    assert (max(beyond) > 1e-4) == inside


@pytest.mark.slow
def test_a_resisting_load_at_rest_is_part_of_the_interval():
    """At a dead centre the load of a slider may act either way: both one-sided limits lie within the bounds."""
    data = slider_crank()
    (slide,) = (name for name, joint in data["joints"].items() if joint["type"] == "prismatic")
    (driver,) = data["drivers"]
    data["loads"] = {"work": {"joint": slide, "resisting_force": 500.0, "useful": True}}
    result = brief(build(data, friction=0.1), 72_000)
    at_rest = np.flatnonzero(np.diff(np.sign(result["joint_slide_velocity"].sel(joint=slide).values)) != 0)
    flagged = np.flatnonzero(result["status"].values == Status.ZERO_SLIP)
    lower, upper = (result[f"drive_effort_{end}"].sel(driver=driver).values for end in ("lower", "upper"))
    effort = result["drive_effort"].sel(driver=driver).values
    assert len(at_rest)
    for k in flagged:
        sides = effort[[k - 1, (k + 1) % len(effort)]]
        slack = 1e-2 * np.max(np.abs(effort))
        assert np.all(sides >= lower[k] - slack)
        assert np.all(sides <= upper[k] + slack)
