"""A nut goes on along its thread: after a turn of the screw the links are not where they were."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import trunnion

PITCH, MASS, G, STOP = 0.006, 400.0, 9.81, 2000.0  # m, kg, m/s², N

ROUND = {"xx": 1.0, "yy": 1.0, "zz": 1.0}


def lift(driver: dict[str, Any], direct: bool = False) -> trunnion.Mechanism:
    """A table on a screw of a right-hand thread, kept from turning by a shoe in a plane, or by the driver itself."""
    axis: dict[str, Any] = {"at": [0, 0, 0], "axis": [0, 0, 1], "x": [1, 0, 0]}
    side: dict[str, Any] = {"at": [0.1, 0, 0], "axis": [0, 1, 0], "x": [1, 0, 0]}
    shoe: dict[str, Any] = {"S": {"at": [0, 0, 0], "axis": [1, 0, 0]}, "G": side | {"at": [0, 0, 0]}}
    table = {"mass": MASS, "centre": [0, 0, 0]}
    data: dict[str, Any] = {
        "space": "spatial",
        "gravity": [0, 0, -G],
        "loads": {"stop": {"link": "table", "at": "H", "force": [0, 0, f"-{STOP} N * between(table.H.z, 10 mm, 1 m)"]}},
        "joint_defaults": {"friction": 0},
    }
    helix = {"type": "helical", "pitch": PITCH}
    if direct:
        return trunnion.Mechanism(
            **data,
            links={"ground": {"points": {"H": axis}}, "table": {"points": {"H": axis}, **table, "inertia": ROUND}},
            joints={"H": {**helix, "links": ["ground", "table"]}},
            drivers={"H": driver},
        )
    return trunnion.Mechanism(
        **data,
        links={
            "ground": {"points": {"A": axis, "G": side}},
            "screw": {"points": {"A": axis, "H": axis}},
            "table": {"points": {"H": axis, "S": {"at": [0.1, 0, 0], "axis": [0, 0, 1]}}, **table},
            "shoe": {"points": shoe},
        },
        joints={
            "A": {"type": "revolute", "links": ["ground", "screw"]},
            "H": {**helix, "links": ["screw", "table"]},
            "S": {"type": "universal", "links": ["table", "shoe"]},
            "G": {"type": "planar", "links": ["ground", "shoe"]},
        },
        drivers={"A": driver},
        assembly={"H": 0.0, "S": [0.1, 0, 0]},
    )


@pytest.mark.parametrize("direct", [False, True])
def test_a_turn_of_a_screw_is_no_cycle_that_comes_back(direct: bool) -> None:
    """The table rises by one pitch, and the work of the drive lifts it."""
    result = trunnion.analyse(lift({"speed": "60 rpm" if direct else "-60 rpm"}, direct), steps=25)
    z = result["point_position"].sel(point="table.H", axis="z").values
    assert z[-1] - z[0] == pytest.approx(PITCH, rel=1e-9)
    np.testing.assert_allclose(np.abs(result["drive_effort"].values), MASS * G * PITCH / (2 * np.pi), rtol=1e-9)
    assert [one.code for one in result.trunnion.findings].count("cycle.not_common") == 1


@pytest.mark.parametrize("direct", [False, True])
def test_a_motion_of_a_nut_asks_for_the_end_of_its_way(direct: bool) -> None:
    with pytest.raises(trunnion.MechanismError, match="state how far it goes"):
        trunnion.simulate(lift({"speed": 1.0, "free": True}, direct), 0.1)


def test_a_load_of_a_nut_acts_where_the_nut_is_after_some_turns() -> None:
    """½ J ω² of the screw lifts the table to where the load acts, and against it: h = h₀ + (E − m g h₀)/(m g + F)."""
    inertia, speed = 0.02, 50.0
    driver: dict[str, Any] = {"speed": -speed, "free": True, "initial": {"speed": -speed}}
    driver |= {"range": ["0 turn", "-50 turn"], "motor": {"kind": "constant", "effort": 0.0}}
    model = lift(driver).data()
    model["links"]["screw"]["inertia"] = dict.fromkeys(("xx", "yy", "zz"), inertia)
    model["links"]["screw"]["mass"] = 1e-9
    result = trunnion.simulate(trunnion.Mechanism(**model), 0.5, 501)
    z = result["point_position"].sel(point="table.H", axis="z").values
    energy = 0.5 * inertia * speed**2 + 0.5 * MASS * (speed * PITCH / (2 * np.pi)) ** 2
    height = 0.01 + (energy - MASS * G * 0.01) / (MASS * G + STOP) if energy > MASS * G * 0.01 else energy / (MASS * G)
    assert np.nanmax(z) == pytest.approx(height, rel=1e-4)
