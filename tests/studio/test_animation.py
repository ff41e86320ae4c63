"""The animation of a cycle has a picture for each position, which differ."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from studio.asking import ask
from studio.whitworth import TEXT


@pytest.mark.slow
def test_the_pictures_of_a_cycle_differ():
    shown = Image.open(io.BytesIO(ask(ask="export", text=TEXT, what="gif", steps=12)["bytes"]))
    assert shown.n_frames == 12
    frames = []
    for index in (0, 6):
        shown.seek(index)
        frames.append(np.asarray(shown.convert("RGB"), int))
    assert 0.001 < np.mean(np.abs(frames[0] - frames[1]).sum(axis=2) > 60) < 0.5
