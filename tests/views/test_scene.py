"""The scene is plain JSON, small, true to the result, and bears every kind of result."""

from __future__ import annotations

import json

import numpy as np
import pytest
from stand_in import four_bar

from trunnion.errors import Status
from trunnion.views.cycle.scene import scene


def test_every_kind_of_result_becomes_plain_json(case):
    _, result = case
    text = json.dumps(scene(result, result), allow_nan=False)
    assert json.loads(text)["count"] == result.sizes["position"]


def test_numbers_are_those_of_the_result_to_seven_digits(plain, ideal):
    shown = scene(plain, ideal)
    joint = shown["joints"][1]
    assert joint["name"] == "B"
    assert joint["at"] == "coupler.B"  # the reaction acts on the second link
    assert joint["reaction"]["x"] == pytest.approx(plain.reaction_force.sel(joint="B", axis="x").values, rel=1e-6)
    assert joint["ideal"]["y"] == pytest.approx(ideal.reaction_force.sel(joint="B", axis="y").values, rel=1e-6)
    assert shown["drivers"][0]["effort"] == pytest.approx(plain.drive_effort.values[0], rel=1e-6)
    assert shown["abscissa"]["closed"]


def test_points_that_are_no_joints_are_named(plain):
    links = {link["name"]: link for link in scene(plain)["links"]}
    assert links["coupler"]["free"] == ["coupler.E"]
    assert links["ground"]["ground"]


def test_a_gap_is_none_with_its_cause():
    shown = scene(four_bar(gap=(132, 229, Status.NOT_ASSEMBLED)))
    assert shown["drivers"][0]["effort"][131] is not None
    assert shown["drivers"][0]["effort"][132] is None
    assert shown["points"]["coupler.E"]["x"][200] is None
    assert shown["states"][str(int(Status.NOT_ASSEMBLED))] == Status.NOT_ASSEMBLED.text
    assert shown["gaps"] == [{"from": "132°", "to": "228°", "text": Status.NOT_ASSEMBLED.text}]


def test_many_positions_are_thinned_evenly_and_said():
    result = four_bar(1000)
    shown = scene(result, max_positions=300)
    assert (shown["count"], shown["thinned"]) == (250, 1000)
    assert np.diff(shown["abscissa"]["values"]) == pytest.approx(4 * 0.36)
    assert scene(result, max_positions=1000)["thinned"] is None


def test_a_comparison_of_other_length_is_refused(plain):
    with pytest.raises(ValueError, match="12 positions"):
        scene(plain, four_bar(12))


def test_loads_without_a_point_are_not_drawn_at_one(plain):
    loads = {load["name"]: load for load in scene(plain)["loads"]}
    assert loads["work"]["at"] == "coupler.E"
    assert loads["brake"]["at"] is None
    assert loads["brake"]["moment"] == -250.0
