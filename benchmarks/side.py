"""A contender in the comparison, and what all contenders share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Job = Literal["motion", "friction", "frictionless"]

__all__ = ["JOBS", "MOTION_COLUMNS", "OUTPUTS", "Job", "Side", "crank_angles", "version"]

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


def crank_angles(n: int) -> NDArray[np.float64]:
    """n equally spaced crank angles over a turn, rad; the end is not repeated."""
    return np.linspace(0.0, 2.0 * np.pi, n, endpoint=False)


def version(package: str) -> str:
    """Installed version of a package, empty if it is not installed."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""
