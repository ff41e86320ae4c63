"""A Whitworth with a ram, as a user draws it: loads, dimensions, its animation; in the page by keys."""

import numpy as np
import pytest

from studio.asking import analysed, ask, edited, solved
from trunnion.model.file import entries_of
from trunnion.views.scene import scene

TEXT = """\
trunnion: 1
name: Ram
space: planar
dimensions:
  crank: 30 mm
links:
  ground:
    points: {A: [0, 0], C: [0, -80 mm], G: {at: [-100 mm, 100 mm], axis: [1, 0]}}
  link1:
    points: {A: [0, 0], B: [crank, 0]}
  link2:
    points: {C: [0, 0], D: [180 mm, 0], F: {at: [0, 0], axis: [1, 0]}}
  link3:
    points: {D: [0, 0], E: [100 mm, 0]}
  block1:
    points: {B: [0, 0], F: {at: [0, 0], axis: [1, 0]}}
  block2:
    points: {E: [0, 0], G: {at: [0, 0], axis: [1, 0]}}
joints:
  A: {type: revolute, links: [ground, link1]}
  C: {type: revolute, links: [ground, link2]}
  D: {type: revolute, links: [link2, link3]}
  F: {type: prismatic, links: [link2, block1]}
  B: {type: revolute, links: [link1, block1]}
  G: {type: prismatic, links: [ground, block2]}
  E: {type: revolute, links: [link3, block2]}
assembly: {D: [0 mm, 100 mm], F: 110 mm, B: [0 mm, 30 mm], E: [-100 mm, 100 mm]}
drivers:
  A: {speed: 60 rpm, start: 90 deg}
loads:
  load1: {link: block2, at: G, force: ["-150 N * max(-1, min(1, G.slide_velocity / (1 mm/s)))", 0 N]}
joint_defaults:
  friction: 0.12
  pin: {radius: 8 mm}
  guide: {length: 40 mm}
"""


FORCE = "-150 N * max(-1, min(1, G.slide_velocity / (1 mm/s)))"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("force", "law"),
    [(FORCE, lambda v: -150 * np.clip(v / 1e-3, -1, 1)), ("-400 N*s/m * G.slide_velocity", lambda v: -400 * v)],
)
def test_a_force_is_that_of_each_position(force, law):
    text = TEXT.replace(FORCE, force)
    speed = analysed(text, 360)["joint_slide_velocity"].sel(joint="G").values
    (load,) = solved(text)["scene"]["loads"]
    x, y = load["course"]["force"]
    np.testing.assert_allclose(x, law(speed), atol=1e-4)
    assert np.all(np.asarray(y) == 0)
    assert np.ptp(np.sign(x)) == 2  # it has turned round


def test_of_thinned_positions_it_is_that_of_those_shown_and_of_others_unknown():
    result = analysed(TEXT, 360)
    (load,) = scene(result, max_positions=90)["loads"]
    (whole,) = scene(result)["loads"]
    assert load["course"]["force"][0] == whole["course"]["force"][0][::4]
    assert scene(result.isel(position=slice(0, 90)))["loads"][0]["course"] is None


@pytest.mark.parametrize(("typed", "rod"), [("rod = 120 mm", "120 mm"), ("rod=120 mm ± 0.05", "120 mm ± 0.05")])
def test_a_definition_typed_for_a_number_makes_a_dimension(typed, rod):
    pin = ["links", "link3", "points", "E"]
    text, _ = edited(TEXT, {}, {"do": "set", "path": pin, "value": [typed, "0"]})
    entries = entries_of(text)[0]
    assert entries["dimensions"] == {"crank": "30 mm", "rod": rod}
    assert entries["links"]["link3"]["points"]["E"] == ["rod", 0]
    assert ask(ask="model", text=text)["solved"]


@pytest.mark.parametrize("typed", ["crank", "2 * crank", "max(crank, 5 mm)", "drive", "off"])
def test_words_that_mean_something_make_none(typed):
    text, _ = edited(TEXT, {}, {"do": "set", "path": ["joint_defaults", "friction"], "value": typed})
    entries = entries_of(text)[0]
    assert entries["dimensions"] == {"crank": "30 mm"}
    assert entries["joint_defaults"]["friction"] == typed
