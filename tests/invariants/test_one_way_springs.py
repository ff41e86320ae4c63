"""Springs that act one way: ropes that pull beyond their free length, bumpers that push below it."""

from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
import pytest

import trunnion
from mechanisms import Data, four_bar, prismatic, slide
from trunnion import Mechanism, MechanismError
from trunnion.algebra.dual import Dual, derivative
from trunnion.errors import Status
from trunnion.solve.run import prepare

FREE = 0.62  # m: within the lengths that the spring goes through


def sprung(joint: str = "", **spring: Any) -> Data:
    """A massless four-bar with a spring between the ground and the coupler."""
    data = copy.deepcopy(four_bar())
    for link in data["links"].values():
        for key in ("mass", "inertia", "centre"):
            link.pop(key, None)
    data["links"]["ground"]["points"]["S"] = [0.2, 1.1]
    place = {"joint": joint} if joint else {"between": ["ground.S", "coupler.E"]}
    return {**data, "loads": {}, "springs": {"S": {**place, **spring}}}


def run(data: Data, steps: int = 180) -> Any:
    return trunnion.analyse(Mechanism(**data), steps)


@pytest.mark.parametrize("preload", [0.0, 15.0])
@pytest.mark.parametrize("damping", [0.0, 20.0])
def test_a_rope_and_a_bumper_are_halves_of_the_spring(damping: float, preload: float) -> None:
    """Where one acts it is the spring of both ways, where it does not there is nothing; so with the drive torque."""
    stated = {"stiffness": 900.0, "free_length": FREE, "damping": damping}
    both = run(sprung(**stated, preload=preload))
    pull = run(sprung(**stated, preload=preload, only="pull"))
    beyond = both["spring_elongation"].values[0] > 0
    assert 10 < np.count_nonzero(beyond) < 170
    for name in ("spring_force", "spring_power", "damping_power", "drive_effort"):
        np.testing.assert_allclose(pull[name][0], np.where(beyond, both[name][0], 0.0), rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(pull["spring_elongation"], both["spring_elongation"])
    push = run(sprung(**stated, preload=-preload, only="push"))
    whole = run(sprung(**stated, preload=-preload))
    for name in ("spring_force", "spring_power", "damping_power", "drive_effort"):
        np.testing.assert_allclose(push[name][0], np.where(beyond, 0.0, whole[name][0]), rtol=1e-12, atol=1e-12)
    for one in (pull, push):
        residual = np.abs(one["power_residual"].values).max()
        assert residual < 1e-12 * np.abs(one["drive_power"].values).max()


def test_a_rope_without_a_damper_gives_back_what_it_takes() -> None:
    """k e²/2 is continuous with its slope at the free length, so the mean over a turn vanishes."""
    power = run(sprung(stiffness=900.0, free_length=FREE, only="pull"), 2000)["spring_power"].values[0]
    assert np.abs(power.mean()) < 1e-5 * np.abs(power).max()
    assert power.max() > 0


def test_a_slack_rope_needs_no_direction() -> None:
    """Its ends meet at 0°, where a spring of both ways has no value."""
    data = sprung()
    pin = data["links"]["crank"]["points"]["B"]
    data["links"]["ground"]["points"]["S"] = list(pin)
    data["springs"]["S"] = {"between": ["ground.S", "crank.B"], "stiffness": 10.0, "free_length": 0.05}
    assert int(run(data, 12).status.values[0]) == Status.LOAD_UNDEFINED
    data["springs"]["S"]["only"] = "pull"
    result = run(data, 12)
    assert int(result.status.values.max()) <= Status.ZERO_SLIP
    assert result["spring_force"].values[0, 0] == 0
    assert result["spring_elongation"].values[0, 0] == -0.05


def cart(**more: Any) -> Data:
    """A cart that is driven along the ground, from 0 to 0.25 m."""
    return {
        "links": {"ground": {"points": {"X": slide(0, 0)}}, "cart": {"points": {"X": slide(0, 0)}}},
        "joints": {"X": prismatic("ground", "cart")},
        "drivers": {"X": {"speed": 0.1, "range": [0.0, 0.25]}},
        **more,
    }


def test_a_bumper_at_the_end_of_a_slide() -> None:
    data = cart(springs={"S": {"joint": "X", "stiffness": 2000.0, "free_length": 0.05, "only": "push"}})
    result = run(data, 6)
    np.testing.assert_allclose(result["drive_effort"].values[0], [-100, 0, 0, 0, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("only", "free", "nearest"), [("push", 0.05, None), ("push", -0.01, 0.0), ("pull", 0.3, 0.25), ("pull", 0.2, None)]
)
def test_one_that_never_acts_is_told(only: str, free: float, nearest: float | None) -> None:
    """The slide goes from 0 to 0.25 m."""
    data = cart(springs={"S": {"joint": "X", "stiffness": 2000.0, "free_length": free, "only": only, "useful": True}})
    told = [row for row in json.loads(run(data, 6).attrs["findings"]) if row["where"] == "springs.S"]
    expected = [] if nearest is None else [("spring.never_acts", free, pytest.approx(nearest, abs=1e-15))]
    assert [(row["code"], row["figures"]["free"], row["figures"]["nearest"]) for row in told] == expected


@pytest.mark.parametrize(("load", "told"), [({"only": "positive"}, False), ({"only": "negative"}, True)])
def test_a_useful_load_that_takes_no_power_is_told(load: Data, told: bool) -> None:
    data = cart(loads={"F": {"joint": "X", "resisting_force": 5.0, "useful": True, **load}})
    assert ("load.no_power" in [row["code"] for row in json.loads(run(data, 6).attrs["findings"])]) is told


@pytest.mark.parametrize("only", ["pull", "push"])
def test_duals_equal_central_differences(only: str) -> None:
    mechanism = Mechanism(**sprung(stiffness=900.0, free_length=FREE, damping=20.0, only=only))
    prepared = prepare(mechanism)
    time = prepared.cycle.times(23)[1:]
    for path in ("springs.S.stiffness", "springs.S.free_length", "springs.S.damping", "links.ground.points.S.x"):
        value = mechanism.parameters()[path]
        step = 1e-5 * max(abs(value), 0.1)

        def solved(number: Any, path: str = path) -> Any:
            return prepared.solve(time, mechanism.parameters({path: number})).efforts["A"]

        differences = (solved(value + step) - solved(value - step)) / (2 * step)
        scale = np.abs(differences).max()
        np.testing.assert_allclose(derivative(solved(Dual(value, 1.0))), differences, atol=1e-6 * scale, err_msg=path)


@pytest.mark.parametrize(
    ("spring", "words"),
    [
        ({"only": "pull", "damping": 5.0}, "a spring that can only pull needs a stiffness — add stiffness"),
        (
            {"only": "twist", "stiffness": 5.0, "free_length": 0.1},
            "springs.S.only: 'twist' is not one of 'pull' or 'push'",
        ),
        ({"only": "pull", "stiffness": 5.0, "free_length": 0.1, "preload": "-3 N"}, "preload: is -3 N, which pushes"),
        ({"only": "push", "stiffness": 5.0, "free_length": 0.1, "preload": "3 N"}, "preload: is 3 N, which pulls"),
        (
            {"joint": "C", "only": "pull", "stiffness": 5.0, "free_angle": 0.1},
            "a spring in a joint that turns cannot only pull",
        ),
    ],
)
def test_bad_ones_are_refused(spring: Data, words: str) -> None:
    with pytest.raises(MechanismError) as caught:
        Mechanism(**sprung(**spring))
    assert words in str(caught.value)


def test_it_is_written_and_read_again() -> None:
    mechanism = Mechanism(**sprung(stiffness=900.0, free_length=FREE, only="pull"))
    assert json.loads(json.dumps(mechanism.data()))["springs"]["S"]["only"] == "pull"
    assert Mechanism(**mechanism.data()) == mechanism


def test_a_spring_without_free_length_needs_no_direction() -> None:
    """Its ends meet at 0°: it pulls by k times the way between them, and turns the crank by k r² sin θ everywhere."""
    data = sprung()
    data["springs"]["S"] = {"between": ["ground.S", "crank.B"], "stiffness": 10.0, "free_length": 0}
    x, y = data["links"]["ground"]["points"]["S"] = list(data["links"]["crank"]["points"]["B"])
    result = run(data, 12)
    turn = np.arange(12) * np.pi / 6
    assert result["drive_effort"].values[0] == pytest.approx(10.0 * (x * x + y * y) * np.sin(turn), abs=1e-12)


@pytest.mark.parametrize(
    ("end", "spring", "told"),
    [
        (0.12, {"free_length": 0.2, "only": "push"}, True),
        (0.12, {"free_length": 0.2}, True),
        (0.12, {"free_length": 0.2, "only": "pull"}, False),  # it is slack there
        (0.12, {"free_length": 0.0}, False),  # without free length its force goes through zero
        (0.3, {"free_length": 0.2, "only": "push"}, False),
    ],
)
def test_a_spring_whose_ends_pass_each_other_is_told(end: float, spring: Data, told: bool) -> None:
    """The cart goes from 0 to 0.25 m past the other end, or stays before it; its force turns round there."""
    data = cart(springs={"S": {"between": ["ground.E", "cart.X"], "stiffness": 2000.0, **spring}})
    data["links"]["ground"]["points"]["E"] = [end, 0]
    result = run(data, 21)
    codes = [row["code"] for row in json.loads(result.attrs["findings"]) if row["where"] == "springs.S"]
    assert ("spring.turned_round" in codes) == told
    if told:
        force = result["drive_effort"].values[0]
        assert force[9] * force[11] < 0
        assert abs(force[9]) > 100
