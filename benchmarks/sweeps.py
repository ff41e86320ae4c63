"""Sweeps in one pass beside the same points one after the other, and beside the bare walk over all of them.

The grid is that of Fig. 9 of Pezzuti et al. (2006) for the Cardan joint: 13 misalignments by 20 speeds, 360 positions.
One after the other is what a sweep does with points that may not go together: each prepared and run as `analyse` does.
The bare walk is `Run.solve` over all configurations at once, in chunks, without checks, books or figures.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

import trunnion
from trunnion.solve.friction_method import FrictionMethod
from trunnion.studies.sweep import AT_ONCE, Points
from trunnion.studies.sweep_grid import grid

EXAMPLES = Path(__file__).parents[1] / "examples"
STEPS = 360
GRIDS: dict[str, Mapping[str, Any]] = {
    "pezzuti-cardan": {"misalignment": ("0 deg", "30 deg", 13), "input.speed": ("50 rpm", "1500 rpm", 20)},
    "durango-fourbar": {"AB": ("1.5 m", "2.2 m", 13), "joint_defaults.friction.coefficient": (0.0, 0.4, 20)},
    "jansen": {"dimensions.a": ("37 cm", "39 cm", 13), "dimensions.m": ("14 cm", "15.5 cm", 20)},
    "rssr": {"a": ("25 mm", "35 mm", 13), "A.speed": (5, 50, 20)},
}


def _best(call: Callable[[], object], rounds: int) -> tuple[float, float]:
    """Seconds by the clock and of CPU."""
    found = (float("inf"), float("inf"))
    for _ in range(rounds):
        begin, busy = time.perf_counter(), time.process_time()
        call()
        found = min(found[0], time.perf_counter() - begin), min(found[1], time.process_time() - busy)
    return found


def _bare(points: Points) -> None:
    """All configurations through the walk, and nothing else."""
    every = list(np.ndindex(points.shape))
    size = max(1, AT_ONCE // STEPS)
    for low in range(0, len(every), size):
        part = every[low : low + size]
        values = points._values(part)
        time_ = np.array([cycle.times(STEPS) for cycle in points._cycles(part, values)])
        points.run.solve(time_, values, points.method)


def main(rounds: int = 3, some: int = 13) -> None:
    """Print the table. some: how many points are run one after the other, spread over the grid."""
    table = Table(title="Sweeps of 13 × 20 points, 360 positions, one thread", title_justify="left", pad_edge=False)
    table.add_column("model")
    for title in ("in one pass,\ns", "s of\nCPU", "of it the\nbare walk, s", "one after the\nother, s", "ratio"):
        table.add_column(title, justify="right")
    for name, over in GRIDS.items():
        mechanism = trunnion.read(EXAMPLES / f"{name}.yaml")
        pass_, busy = _best(lambda: trunnion.sweep(mechanism, over, STEPS), rounds)  # noqa: B023
        points = Points(mechanism, grid(mechanism, over), STEPS, FrictionMethod())
        bare, _ = _best(lambda: _bare(points), rounds)  # noqa: B023
        places = list(np.ndindex(points.shape))[:: points.shape[0] * points.shape[1] // some]
        alone, _ = _best(lambda: [points._alone(place) for place in places], 1)  # noqa: B023
        alone *= points.shape[0] * points.shape[1] / len(places)
        table.add_row(name, f"{pass_:.2f}", f"{busy:.2f}", f"{bare:.2f}", f"{alone:.2f}", f"{alone / pass_:.1f}")
    Console().print(table)


if __name__ == "__main__":
    main()
