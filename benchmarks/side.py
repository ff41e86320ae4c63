"""A contender in the comparison, and what all contenders share."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from importlib import metadata
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Job = Literal["motion", "friction", "frictionless"]

__all__ = ["JOBS", "MOTION_COLUMNS", "OUTPUTS", "Job", "Side", "crank_angles", "take_turns", "timed", "version"]

JOBS: dict[Job, str] = {
    "motion": "position, velocity, acceleration",
    "friction": "kinetostatics with friction",
    "frictionless": "kinetostatics without friction",
}
# What a full answer holds for each configuration; links 1 crank, 2 coupler, 3 rocker
JOINTS = "ABCD"
OUTPUTS = (
    *(f"link_{quantity}.{link}" for quantity in ("angle", "velocity", "acceleration") for link in (1, 2, 3)),
    *(f"reaction.{joint}.{axis}" for joint in JOINTS for axis in "xy"),
    *(f"friction_torque.{joint}" for joint in JOINTS),
    *(f"friction_power.{joint}" for joint in JOINTS),
    "drive_torque",
    "iterations",
)
MOTION_COLUMNS = OUTPUTS[:9] + tuple(
    f"{pin}.{quantity}.{axis}" for quantity in ("position", "velocity", "acceleration") for pin in "BC" for axis in "xy"
)


@dataclass(frozen=True)
class Side:
    """One contender for one job.

    run(n) analyses n equally spaced positions of one turn: this is what is timed, model building apart. What it
    returns becomes, by `table`, a (configuration, columns) array that is compared with the Numba loop's.
    configurations: how many a timed run takes (less than 10⁵ for tools that walk through Python objects).
    """

    name: str
    job: Job
    run: Callable[[int], Any]
    table: Callable[[Any], NDArray[np.floating[Any]]]
    columns: tuple[str, ...]
    configurations: int = 100_000
    note: str = ""


def timed(call: Callable[[], Any]) -> float:
    """Seconds one call takes."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def take_turns(sides: Iterable[Side], rounds: int, busy: dict[str, float] | None = None) -> dict[str, float]:
    """Best µs per configuration of each side; they run in turn so that a busy spell hits all of them.

    busy: is given the least µs of CPU of each, all threads together.
    """
    sides = list(sides)
    best = dict.fromkeys((side.name for side in sides), math.inf)
    for round_ in range(rounds + 1):
        for side in sides:
            begin = time.process_time()
            seconds = timed(partial(side.run, side.configurations))
            spent, each = time.process_time() - begin, side.configurations * 1e-6
            if round_ > 0:  # the first warms caches and compilers
                best[side.name] = min(best[side.name], seconds / each)
                if busy is not None:
                    busy[side.name] = min(busy.get(side.name, math.inf), spent / each)
    return best


def crank_angles(n: int) -> NDArray[np.float64]:
    """n equally spaced crank angles over a turn, rad; the end is not repeated."""
    return np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)


def version(package: str) -> str:
    """Installed version of a package, empty if it is not installed."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""
