"""Loads that depend on place and speed of any joint or point: the same however the motion is stated."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from brief import brief
from timed import slider_crank, wheel
from trunnion import MechanismError, analyse, read, simulate, sweep
from trunnion.errors import Status
from trunnion.model.mechanism import Mechanism

EXAMPLES = Path(__file__).parents[2] / "examples"
# the height of the ram by the crank angle, and by name
HEIGHTS = {
    "drive": "(0.035 m * cos(drive) + sqrt((0.12 m)^2 - (0.035 m * sin(drive))^2))",
    "slide": "S.slide",
    "point": "piston.Q.x",
    "named slide": "way",
    "named point": "height",
    "distance": "hypot(rod.Q.x - frame.O.x, rod.Q.y - frame.O.y)",
}
NAMED = {
    "measures": {
        "way": {"slide": "S"}, "height": {"point": "piston.Q", "axis": "x"},
        "pace": {"rate": "S"}, "rise": {"velocity": "piston.Q", "axis": "x"},
    }
}  # fmt: skip
PRESS = "-30 N - 4000 N/m * ({0} - 0.11 m) - 500 N/m * abs({0} - 0.13 m) - 100 N * between({0}, 0.1 m, 0.12 m)"


def pressed(force: str, **more: Any) -> Mechanism:
    return slider_crank(0.1, loads={"work": {"link": "piston", "at": "Q", "force": [force, 0]}}, **NAMED, **more)


@pytest.mark.parametrize("name", ["slide", "distance", "named point"])
def test_a_press_force_over_the_height_of_the_ram(name: str) -> None:
    """It equals the same force stated over the crank angle, at every position and in the means."""
    one, other = (analyse(pressed(PRESS.format(HEIGHTS[key])), 90) for key in (name, "drive"))
    bare = analyse(slider_crank(0.1, loads={}), 90)
    largest = float(np.abs(other["drive_effort"]).max())
    assert float(np.abs(other["drive_effort"] - bare["drive_effort"]).max()) > 0.1 * largest
    for key in ("drive_effort", "reaction_force", "useful_power", "drive_effort_rms"):
        size = float(np.abs(other[key]).max())
        assert one[key].values == pytest.approx(other[key].values, rel=0, abs=1e-12 * size), key


def test_it_is_the_same_in_time() -> None:
    """Tabulated, with the places found at which the force jumps or bends."""
    one, other = (simulate(pressed(PRESS.format(HEIGHTS[key])), 0.1, 5) for key in ("named slide", "drive"))
    assert one["drive_rate"].values == pytest.approx(other["drive_rate"].values, rel=1e-9)
    assert np.abs(one["energy_residual"]).max() < 1e-8 * np.abs(one["work_drive"]).max()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["S.slide_velocity", "piston.Q.velocity_x"])
def test_a_force_by_a_speed_is_that_of_a_damper(name: str) -> None:
    damped = slider_crank(0.1, loads={}, springs={"oil": {"joint": "S", "damping": 50}})
    own = pressed(f"-50 N s/m * {name}")
    one, other = analyse(own, 36), analyse(damped, 36)
    assert one["drive_effort"].values == pytest.approx(other["drive_effort"].values, rel=1e-12)
    swift, slow = simulate(own, 0.05, 2), simulate(damped, 0.05, 2)
    assert swift["drive_rate"].values == pytest.approx(slow["drive_rate"].values, rel=1e-7)


def test_a_driven_joint_turns_as_the_drive_does() -> None:
    """In time its turns begin again, so that a wave over the angle is one at every turn."""
    one, other = (brief(pressed(f"-50 N * sin({name})"), 24) for name in ("O.rotation", "drive"))
    assert one["drive_effort"].values == pytest.approx(other["drive_effort"].values, rel=1e-12)
    data = wheel({"kind": "constant", "effort": 1.0}, drag=0.0).data()
    data["loads"] = {"wave": {"link": "wheel", "moment": "-0.5 N m * sin(A.rotation)"}}
    result = simulate(Mechanism(**data), 2.0, 4, 1e-10)
    turned, rate = result["drive_coordinate"].values[0], result["drive_rate"].values[0]
    assert 0.5 * 0.05 * rate**2 == pytest.approx(turned + 0.5 * (np.cos(turned) - 1), abs=1e-7)


def test_in_space() -> None:
    """A torque that resists by the rate of its joint is a damper's."""
    data = read(EXAMPLES / "rssr.yaml").data()
    last = [name for name, one in data["joints"].items() if one["type"] == "revolute"][-1]
    resisted = {"joint": last, "resisting_torque": f"0.3 N m s/rad * abs({last}.rotation_velocity)"}
    one = brief(Mechanism(**{**data, "loads": {"oil": resisted}}), 24)
    other = brief(Mechanism(**{**data, "loads": {}, "springs": {"oil": {"joint": last, "damping": 0.3}}}), 24)
    largest = float(np.abs(other["drive_effort"]).max())
    assert one["drive_effort"].values == pytest.approx(other["drive_effort"].values, abs=1e-12 * largest)


def test_the_compiled_engine_has_them() -> None:
    model = pressed(PRESS.format("S.slide"))
    one, other = (sweep(model, {"rod.mass": [0.4, 0.5]}, steps=36, engine=engine) for engine in ("numpy", "compiled"))
    assert other["drive_effort_max"].values == pytest.approx(one["drive_effort_max"].values, rel=1e-9)


@pytest.mark.parametrize(
    ("force", "remedy"),
    [
        ("-50 N/m * S.slied", "S.slide"),
        ("-50 N * S.rotation", "Q.rotation"),
        ("-50 N/m * pistn.Q.x", "piston.Q.x"),
        ("-50 N * S.slide", "force"),
    ],
)
def test_a_name_that_means_nothing_is_one_finding(force: str, remedy: str) -> None:
    with pytest.raises(MechanismError) as caught:
        pressed(force)
    (finding,) = caught.value.findings
    assert finding.where == "loads.work.force.x"
    assert remedy in finding.remedy


def test_a_dimension_cannot_speak_of_the_motion() -> None:
    with pytest.raises(MechanismError) as caught:
        slider_crank(0.1, dimensions={"a": "2 * S.slide"})
    assert caught.value.findings[0].where == "dimensions.a"


@pytest.mark.parametrize("measure", [{"effort": "O"}, {"slide": "S", "as": "maximum"}, {"angle": "rod"}])
def test_a_measure_that_is_no_motion_at_every_position_is_told_what_to_name(measure: dict[str, str]) -> None:
    data = slider_crank().model_dump(exclude_unset=True)
    data["measures"] = {"way": measure}
    data["loads"] = {"work": {"link": "crank", "moment": "-3 N m * way/(1 m)"}}
    with pytest.raises(MechanismError, match=r"the measure 'way', which is no coordinate or speed .* — .*O\.rotation"):
        Mechanism(**data)


def test_a_dimension_goes_before_a_measure_of_its_name() -> None:
    one = pressed("-30 N - 1000 N/m * way", dimensions={"way": "5 mm"})
    other = pressed("-35 N")
    assert brief(one, 12)["drive_effort"].values == pytest.approx(brief(other, 12)["drive_effort"].values)


@pytest.mark.parametrize(("free_length", "rows"), [(0.0, 0), (0.01, 1)])
def test_a_spring_whose_ends_meet_at_the_start(free_length: float, rows: int) -> None:
    """Without a free length x = v/w sin w t; with one there is no direction at 0 s, which is said and marked."""
    slide = {"at": [0, 0], "axis": [1, 0]}
    block = Mechanism(
        links={
            "ground": {"points": {"S": slide, "F": [0, 0]}},
            "block": {"points": {"S": slide, "P": [0, 0]}, "mass": 1},
        },
        joints={"S": {"type": "prismatic", "links": ["ground", "block"]}},
        drivers={"S": {"range": [-1, 1], "speed": 1, "free": True, "initial": {"coordinate": 0, "speed": 0.5}}},
        springs={"k": {"between": ["ground.F", "block.P"], "stiffness": 100, "free_length": free_length}},
    )
    result = simulate(block, 0.2, 4)
    assert np.sum(result["status"] == Status.LOAD_UNDEFINED) == rows
    assert [one.code for one in result.trunnion.findings] == ["simulate.undefined"] * rows
    if not rows:
        wanted = 0.05 * np.sin(10 * result["time"].values)
        assert result["drive_coordinate"].values[0] == pytest.approx(wanted, abs=1e-9)
