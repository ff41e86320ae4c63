"""A load given by an expression is shown as it is at the position that is shown."""

from __future__ import annotations

import numpy as np
import pytest

import trunnion
from studio.asking import solved
from studio.whitworth import TEXT
from trunnion.model.file import entries_of
from trunnion.model.mechanism import Mechanism
from trunnion.views.cycle.scene import scene

FORCE = "-150 N * max(-1, min(1, G.slide_velocity / (1 mm/s)))"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("force", "law"),
    [(FORCE, lambda v: -150 * np.clip(v / 1e-3, -1, 1)), ("-400 N*s/m * G.slide_velocity", lambda v: -400 * v)],
)
def test_a_force_is_that_of_each_position(force, law):
    text = TEXT.replace(FORCE, force)
    speed = trunnion.analyse(Mechanism(**entries_of(text)[0]), 360)["joint_slide_velocity"].sel(joint="G").values
    (load,) = solved(text)["scene"]["loads"]
    x, y = load["course"]["force"]
    np.testing.assert_allclose(x, law(speed), atol=1e-4)
    assert np.all(np.asarray(y) == 0)
    assert np.ptp(np.sign(x)) == 2  # it has turned round


def test_of_thinned_positions_it_is_that_of_those_shown_and_of_others_unknown():
    result = trunnion.analyse(Mechanism(**entries_of(TEXT)[0]), 360)
    (load,) = scene(result, max_positions=90)["loads"]
    (whole,) = scene(result)["loads"]
    assert load["course"]["force"][0] == whole["course"]["force"][0][::4]
    assert scene(result.isel(position=slice(0, 90)))["loads"][0]["course"] is None
