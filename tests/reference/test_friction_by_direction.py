"""Friction that differs by direction, and rolling friction, against runs with one coefficient and closed forms."""

from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
import pytest

import trunnion
from brief import brief
from mechanisms import Data, build, four_bar
from mechanisms_parts import prismatic, slide
from trunnion import Mechanism, MechanismError

FORWARD, BACKWARD = 0.1, 0.35
G = 9.81


def with_friction(data: Data, joint: str, friction: Any) -> Mechanism:
    """The data with another friction of one joint."""
    changed = copy.deepcopy(data)
    changed["joints"][joint]["friction"] = friction
    return Mechanism(**changed)


def by_direction() -> Data:
    return {"coefficient": FORWARD, "backward": BACKWARD}


@pytest.mark.parametrize(
    ("name", "joint", "engine"),
    [
        ("durango-fourbar", "D", "numpy"),
        ("durango-fourbar", "D", "compiled"),
        ("offset-slider-crank", "S", "compiled"),
        ("rssr", "D", "numpy"),
    ],
)
def test_each_way_is_a_run_with_its_coefficient(name: str, joint: str, engine: Any) -> None:
    """Forces, locking margin and losses are those of the coefficient of the direction at hand."""
    data = trunnion.read(f"examples/{name}.yaml").data()
    runs = [
        trunnion.analyse(with_friction(data, joint, friction), steps=60, engine=engine)
        for friction in (by_direction(), FORWARD, BACKWARD)
    ]
    rate = sum(runs[0][f"joint_{motion}_velocity"].sel(joint=joint).values for motion in ("rotation", "slide"))
    ahead = rate > 0
    slips = np.abs(rate) > 1e-6 * np.max(np.abs(rate))
    assert 10 < np.count_nonzero(ahead & slips) < 50
    for variable in ("drive_effort", "reaction_force", "friction_power", "locking_margin", "status"):
        both, forward, backward = (run[variable].values[..., slips] for run in runs)
        assert both == pytest.approx(np.where(ahead[slips], forward, backward), rel=1e-9, abs=1e-9), variable
    different = np.abs(runs[1]["drive_effort"] - runs[2]["drive_effort"]).max()
    assert different > 1e-3 * np.abs(runs[0]["drive_effort"]).max()


def test_at_rest_each_bound_has_its_own() -> None:
    """A block of 2 kg that turns round: between −μ₋ m g and μ₊ m g."""
    data = block(0.0, by_direction())
    data["drivers"] = {"S": {"law": "harmonic", "mean": 0.1, "amplitude": 0.1, "period": 1.0}}
    found = brief(Mechanism(**data), steps=8)
    still = int(np.argmin(np.abs(found["joint_slide_velocity"].values[0])))
    inertia = 2.0 * found["joint_slide_acceleration"].values[0, still]
    low, high = (found[f"drive_effort_{end}"].values[0, still] - inertia for end in ("lower", "upper"))
    assert (low, high) == pytest.approx((-BACKWARD * 2 * G, FORWARD * 2 * G), rel=1e-9)


def block(slope: float, friction: Any) -> Data:
    """A block of 2 kg on a slope, rad, up along x; a long guide carries no moment."""
    return {
        "gravity": [-G * np.sin(slope), -G * np.cos(slope)],
        "links": {"ground": {"points": {"S": slide(0, 0)}}, "block": {"points": {"S": slide(0, 0)}, "mass": 2.0}},
        "joints": {"S": {**prismatic("ground", "block"), "guide": {"length": 0.5}, "friction": friction}},
    }


@pytest.mark.parametrize("friction", [(0.1, 0.35), (0.35, 0.1), (0.1, 0.8)])
def test_a_block_thrown_up_a_slope(friction: tuple[float, float]) -> None:
    """Up with μ₊ against it, down with μ₋, or it stays where μ₋ holds: times and way by the closed form."""
    slope, speed = np.radians(30), 2.0
    data = block(slope, {"coefficient": friction[0], "backward": friction[1]})
    data["drivers"] = {"S": thrown(speed)}
    found = trunnion.simulate(Mechanism(**data), duration=1.2, steps=120)
    assert found["joint_slide"].sel(joint="S").values == pytest.approx(
        on_slope(found, slope, speed, friction), abs=1e-7
    )


def thrown(speed: float) -> Data:
    return {"range": [-9, 9], "speed": 0.1, "free": True, "initial": {"coordinate": 0, "speed": speed}}


def on_slope(found: Any, slope: float, speed: float, friction: tuple[float, float]) -> Any:
    """Where a block is, m: it stays where tan of the slope is below the coefficient of the way down."""
    stays = np.tan(slope) < friction[1]
    up = G * (np.sin(slope) + friction[0] * np.cos(slope))
    down = G * (np.sin(slope) - friction[1] * np.cos(slope))
    time, top = found["time"].values, speed / up
    after = 0.0 if stays else 0.5 * down * (time - top) ** 2
    return np.where(time <= top, speed * time - 0.5 * up * time**2, 0.5 * speed**2 / up - after)


def test_two_blocks_of_which_one_stays() -> None:
    """Of several freedoms each joint sticks and slips for itself."""
    slope, cases = np.radians(30), {"S": (2.0, (0.1, 0.35)), "R": (1.5, (0.2, 0.8))}
    data = block(slope, None)
    data["links"]["other"] = {"points": {"R": slide(0, 0)}, "mass": 3.0}
    data["links"]["ground"]["points"]["R"] = slide(0, 1)
    data["joints"]["R"] = {**data["joints"]["S"], "links": ["ground", "other"]}
    for joint, (_, (forward, backward)) in cases.items():
        data["joints"][joint] = {**data["joints"][joint], "friction": {"coefficient": forward, "backward": backward}}
    data["drivers"] = {joint: thrown(speed) for joint, (speed, _) in cases.items()}
    found = trunnion.simulate(Mechanism(**data), duration=1.2, steps=120)
    for joint, (speed, friction) in cases.items():
        way = on_slope(found, slope, speed, friction)
        assert found["joint_slide"].sel(joint=joint).values == pytest.approx(way, abs=1e-7), joint


def test_a_locking_figure_is_a_multiple_of_both() -> None:
    """There is no one coefficient to name."""
    data = trunnion.read("examples/pezzuti-cardan-10mm.yaml").data()
    data["joint_defaults"]["friction"] = 0.15
    assert Mechanism(**data)
    four = build(four_bar())
    changed = four.data()
    changed["joint_defaults"]["friction"] = by_direction()
    found = trunnion.analyse(Mechanism(**changed), steps=24)
    names = {row["name"] for row in json.loads(found.attrs["summary"])}
    assert not any(name.endswith(("critical_coefficient", "holding_coefficient")) for name in names)


@pytest.mark.parametrize("name", ["durango-fourbar", "rssr"])
def test_rolling_is_a_pin_of_that_moment(name: str) -> None:
    """Moment arm · N: Coulomb's law with coefficient times radius = arm has the same."""
    data = trunnion.read(f"examples/{name}.yaml").data()
    radius = 0.02
    data["joints"]["D"]["pin"] = {"radius": radius, "bearing": 0.03}
    coulomb = brief(with_friction(data, "D", 0.1), steps=48)
    data["joints"]["D"]["pin"] = {"radius": 5 * radius, "bearing": 0.03}
    rolls = brief(with_friction(data, "D", {"law": "rolling", "arm": 0.1 * radius}), steps=48)
    for variable in ("drive_effort", "friction_torque", "friction_power", "drive_effort_lower", "locking_margin"):
        assert rolls[variable].values == pytest.approx(coulomb[variable].values, rel=1e-9, abs=1e-12), variable


def test_a_loaded_roller() -> None:
    """Torque arm · W of a wheel under the weight W, which needs no radius of a pin."""
    wheel = {
        "gravity": [0, -G],
        "links": {"ground": {"points": {"A": [0, 0]}}, "wheel": {"points": {"A": [0, 0]}, "mass": 50.0}},
        "joints": {
            "A": {"type": "revolute", "links": ["ground", "wheel"], "friction": {"law": "rolling", "arm": 5e-4}}
        },
        "drivers": {"A": {"speed": 1.0}},
    }
    found = brief(Mechanism(**wheel), steps=4)
    assert found["drive_effort"].values == pytest.approx(np.full((1, 4), 5e-4 * 50 * G), rel=1e-12)


@pytest.mark.parametrize(
    ("name", "joint", "friction", "what"),
    [
        ("rssr", "B", by_direction(), "friction by direction in a joint of the type spherical"),
        (
            "offset-slider-crank",
            "S",
            {"law": "rolling", "arm": 1e-3},
            "rolling friction in a joint of the type prismatic",
        ),
        ("durango-fourbar", "B", {"law": "stribeck", "backward": 0.1}, "unknown to the friction law stribeck"),
        ("durango-fourbar", "B", {"law": "rolling"}, "needs 'arm'"),
    ],
)
def test_what_has_no_direction_or_does_not_roll(name: str, joint: str, friction: Any, what: str) -> None:
    with pytest.raises(MechanismError, match=what):
        with_friction(trunnion.read(f"examples/{name}.yaml").data(), joint, friction)


def test_a_coefficient_of_its_own_is_of_both_directions() -> None:
    """Defaults by direction do not reach into a joint that states one number; 0 is without friction."""
    data = four_bar()
    data["joint_defaults"] = {"pin": {"radius": 0.01}, "friction": by_direction()}
    data["joints"]["B"]["friction"] = 0.2
    data["joints"]["C"]["friction"] = 0
    stated = Mechanism(**data).effective_joints
    assert set(stated["B"].friction.parameters) == {"coefficient", "pair_factor"}
    assert set(stated["A"].friction.parameters) == {"coefficient", "backward", "pair_factor"}
    assert stated["C"].friction is None or float(stated["C"].friction.parameters["coefficient"].evaluate()) == 0


def test_tolerances_know_the_backward_coefficient() -> None:
    """Its exact sensitivity against a central difference."""
    data = trunnion.read("examples/durango-fourbar.yaml").data()
    data["measures"] = {"least": {"effort": "A", "as": "minimum"}}

    def least(backward: float, **more: Any) -> Mechanism:
        return with_friction({**data, **more}, "D", {"coefficient": 0.1, "backward": backward})

    tolerances = {"joints.D.friction.backward": 0.05}
    found = float(trunnion.tolerance(least(0.3, tolerances=tolerances))["sensitivity"].values.ravel()[0])
    ends = [float(trunnion.analyse(least(0.3 + step), steps=4)["measure_figure"][0]) for step in (-1e-5, 1e-5)]
    assert found == pytest.approx((ends[1] - ends[0]) / 2e-5, rel=1e-6)
    assert abs(found) > 1
