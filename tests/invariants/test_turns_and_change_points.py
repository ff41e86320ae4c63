"""Whole turns of the drive and coarse steps, positions where assemblies meet, and hints that tell them apart."""

from __future__ import annotations

import json

import numpy as np
import pytest
from ruamel.yaml import YAML

import trunnion
from brief import brief
from mechanisms import MODELS, build, five_bar, four_bar, watt_six_bar
from trunnion.solve.run import prepare


def findings(result) -> list[dict[str, str]]:
    return json.loads(result.attrs["findings"])


@pytest.mark.slow
def test_a_change_point_is_told() -> None:
    """A parallelogram goes through a position where it may become an antiparallelogram."""
    data = four_bar(0.3, 1.0, 0.3, 1.0)
    data["drivers"]["A"]["start"] = 1.0
    data["assembly"] = {"C": [1.16, 0.25]}
    rows = [row for row in findings(trunnion.analyse(build(data), 7)) if row["code"] == "assembly.change_point"]
    assert [row["figures"]["places"] for row in rows] == [["180°", "360°"]]


def test_assemblies_that_coincide_over_a_range_are_told_by_its_ends() -> None:
    """Coupler and rocker lie on the crank at every angle: A and D are at one place, and their lengths add up to it."""
    data = four_bar(0.04, 0.025, 0.015, 0.04)
    data["links"]["ground"]["points"]["D"] = [0.0, 0.0]
    data["assembly"] = {"C": [0.015, 0.0]}
    (told,) = [row for row in findings(trunnion.analyse(build(data), 7)) if row["code"] == "assembly.change_point"]
    assert told["figures"]["places"] == ["between 0° and 360°"]


CLAMP = """
trunnion: 1
gravity: [0, 0]
links:
  ground: {points: {A: [0, 0], D: [-25 mm, -35 mm], G: [-600 mm, 128 mm]}}
  arm: {points: {A: [0, 0], B: [-25 mm, 8 mm]}}
  handle: {points: {B: [0, 0], C: [22 mm, 0], H: [-120 mm, 0]}}
  link: {points: {C: [0, 0], D: [21 mm, 0]}}
  barrel: {points: {G: [0, 0], Z: {at: [400 mm, 0], axis: [1, 0]}}}
  rod: {points: {Z: {at: [-175 mm, 0], axis: [1, 0]}, H: [0, 0]}}
joints:
  A: {type: revolute, links: [ground, arm]}
  B: {type: revolute, links: [arm, handle]}
  C: {type: revolute, links: [handle, link]}
  D: {type: revolute, links: [ground, link]}
  G: {type: revolute, links: [ground, barrel]}
  H: {type: revolute, links: [handle, rod]}
  Z: {type: prismatic, links: [barrel, rod]}
assembly: {C: [-15 mm, -16 mm], B: [-26 mm, 3 mm]}
"""


@pytest.mark.parametrize(("low", "high", "start"), [(-90, 0, True), (0, -90, False)])
def test_positions_without_an_assembly_are_told_whether_the_start_is_among_them(
    low: int, high: int, start: bool
) -> None:
    """They are not said to be out of reach from a start that does not close itself."""
    driver = {"range": [f"{low} mm", f"{high} mm"], "speed": f"{100 if high > low else -100} mm/s"}
    model = trunnion.Mechanism.model_validate(YAML(typ="safe").load(CLAMP) | {"drivers": {"Z": driver}})
    (told,) = [row for row in findings(trunnion.analyse(model, 60)) if row["code"] == "assembly.open"]
    assert told["figures"]["start"] is start
    assert ("from the start" in told["what"]) != start


@pytest.mark.spread(3)
@pytest.mark.parametrize("name", MODELS)
def test_an_ordinary_linkage_has_no_change_point(name: str) -> None:
    result = trunnion.analyse(build(MODELS[name]()), 12)
    assert not any(row["code"] == "assembly.change_point" for row in findings(result))


@pytest.mark.parametrize("branch", [1, -1])
def test_a_hint_on_a_joint_of_a_later_group_counts(branch: int) -> None:
    """F joins the rocker to a later dyad: its place tells the assemblies of the rocker's own dyad apart."""
    data = watt_six_bar()
    data["assembly"]["C"][1] *= branch
    stated = brief(build(data), 3)
    f = stated["point_position"].sel(point="rocker.F")[:, 0].values
    data["assembly"] = {"F": f.tolist(), "H": data["assembly"]["H"]}
    hinted = trunnion.analyse(build(data), 3)
    np.testing.assert_array_equal(hinted["point_position"], stated["point_position"])
    assert not any(row["code"] == "assembly.choice" for row in findings(hinted))


def test_a_driven_rotation_is_the_prescribed_coordinate() -> None:
    """Whole turns, a start beyond half a turn and coarse steps included."""
    data = five_bar()
    data["drivers"]["E"] |= {"speed": -20.0, "start": 3.5}
    result = brief(build(data), 12)
    np.testing.assert_allclose(result["joint_rotation"].sel(joint="E"), 3.5 - 20.0 * result["time"], rtol=1e-13)


def test_angles_follow_their_rate_across_coarse_steps() -> None:
    """A link that turns 0.9 turns a step is not taken to turn back 0.1."""
    data = four_bar()
    data["drivers"]["A"] |= {"range": [0.0, 36 * np.pi * 0.9]}
    result = brief(build(data), 19)
    crank = result["link_angle"].sel(link="crank").values
    np.testing.assert_allclose(np.diff(crank), 2 * np.pi * 0.9, rtol=1e-12)


@pytest.mark.parametrize("factor", [-1.0, 0.5, 3.0])
def test_another_speed_is_the_same_motion_at_other_times(factor: float) -> None:
    """General groups too: their track is read by the drive coordinate, not by time."""
    run = prepare(build(MODELS["class III"]()))
    speed = float(run.values["drivers.A.speed"])
    time = run.cycle.times(10)
    plain = run.solve(time)
    values = run.system.mechanism.parameters({"drivers.A.speed": factor * speed})
    other = run.solve(time / factor, values)
    for link, motion in plain.walk.motions.items():
        np.testing.assert_allclose(
            np.broadcast_to(other.walk.motions[link].frame.x, time.shape),
            np.broadcast_to(motion.frame.x, time.shape),
            atol=1e-12,
        )
