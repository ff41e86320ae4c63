"""The forces that the animation draws balance each other; each picture shows them."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

import trunnion
from studio.asking import ask
from studio.whitworth import TEXT
from trunnion.model.file import entries_of
from trunnion.model.mechanism import Mechanism
from trunnion.studio.animation import _forces
from trunnion.views.common.drawing import picture


@pytest.mark.slow
def test_forces_on_the_ram_are_in_balance():
    """It has no mass: guide with its friction, pin and load add up to nothing."""
    result = trunnion.analyse(Mechanism(**entries_of(TEXT)[0]), 90)
    forces = _forces(result, picture(result))
    load = np.array([-150 * np.clip(result["joint_slide_velocity"].sel(joint="G").values / 1e-3, -1, 1), np.zeros(90)])
    moves = np.abs(load[0]) > 149
    np.testing.assert_allclose((forces["G"] + forces["E"] + load)[:, moves], 0.0, atol=1e-6)
    assert np.nanmax(np.abs(forces["G"][0])) > 1.0  # friction along the guide


@pytest.mark.slow
def test_names_forces_and_loads_are_drawn():
    frames = {}
    for force in ("150 N", "0 N"):
        text = TEXT.replace("-150 N * max", f"-{force} * max")
        content = ask(ask="export", text=text, what="gif", steps=12)
        shown = Image.open(io.BytesIO(content["bytes"]))
        shown.seek(3)
        frames[force] = np.asarray(shown.convert("RGB"), int)
    assert shown.n_frames == 12
    differs = np.abs(frames["150 N"] - frames["0 N"]).sum(axis=2) > 60
    assert 200 < differs.sum() < 0.05 * differs.size
