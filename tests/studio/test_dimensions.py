"""Dimensions made in the panel: by a name typed for a number."""

from __future__ import annotations

import pytest

from studio.asking import ask, edited
from studio.whitworth import TEXT
from trunnion.model.file import entries_of

PIN = ["links", "link3", "points", "E"]


def put(text, path, value):
    return edited(text, {}, {"do": "set", "path": path, "value": value})[0]


@pytest.mark.parametrize(
    ("typed", "rod"), [("rod", "100 mm"), ("rod = 120 mm", "120 mm"), ("rod=120 mm ± 0.05", "120 mm ± 0.05")]
)
def test_a_name_typed_for_a_number_makes_a_dimension(typed, rod):
    text = put(TEXT, PIN, [typed, "0"])
    entries = entries_of(text)[0]
    assert entries["dimensions"] == {"crank": "30 mm", "rod": rod}
    assert entries["links"]["link3"]["points"]["E"] == ["rod", 0]
    assert ask(ask="model", text=text)["solved"]


@pytest.mark.parametrize("typed", ["crank", "2 * crank", "max(crank, 5 mm)", "drive", "off"])
def test_words_that_mean_something_make_none(typed):
    entries = entries_of(put(TEXT, ["joint_defaults", "friction"], typed))[0]
    assert entries["dimensions"] == {"crank": "30 mm"}
    assert entries["joint_defaults"]["friction"] == typed


@pytest.mark.parametrize(
    ("force", "says"),
    [
        ("-150 N * sign(G.slide_velocity)", "max(-1, min(1, v / (1 mm/s)))"),
        ("-150 N * velocity_of_it", "G.slide_velocity"),
    ],
)
def test_what_an_expression_cannot_say_is_told_with_what_can(force, says):
    text = put(TEXT, ["loads", "load1", "force"], [force, "0 N"])
    (error,) = [one for one in ask(ask="model", text=text)["findings"] if one["severity"] == "error"]
    assert says in error["remedy"]
