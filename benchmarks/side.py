"""A contender in the comparison, and what all contenders share."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Job = Literal["motion", "friction", "frictionless"]

__all__ = ["Job", "Side", "crank_angles", "version"]


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
