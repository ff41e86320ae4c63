"""The oracle of spatial mechanisms by itself: closed forms of gyroscopes, power, differences of its own poses."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mechanisms_space import MODELS, Drawn, cardan, rssr
from reference.maximal_space import Array, Drive, Frame, Motion, unrolled
from reference.newton_euler_space import Body, Joint, Load, solve
from reference.space_oracle import Oracle

WEIGHTS_1 = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
WEIGHTS_2 = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560])


def drives(drawn: Drawn, time: float) -> dict[str, Drive]:
    """Coordinates of drives at constant speed."""
    found = {}
    for name, driver in drawn.data["drivers"].items():
        start = driver["range"][0] if "range" in driver else driver.get("start", 0.0)
        found[name] = Drive(start + driver["speed"] * time, driver["speed"])
    return found


def cardan_drawn(**options: Any) -> Drawn:
    """The Cardan joint unrolled, in its pose at the start."""
    data = unrolled(cardan(**options))
    oracle = Oracle(data)
    clean = unrolled(
        cardan(error=0.0, offset=0.0, **{n: v for n, v in options.items() if n not in ("error", "offset")})
    )
    del clean, oracle
    return Drawn(data, {})


def moved(drawn: Drawn, time: float = 0.04) -> tuple[Oracle, dict[str, Motion]]:
    """A mechanism a little after the start."""
    oracle, frames = Oracle(drawn.data), drawn.home
    for share in np.linspace(0, 1, 5):
        motions = oracle.move(frames, drives(drawn, share * time))
        frames = {link: motion.frame for link, motion in motions.items()}
    return oracle, motions
