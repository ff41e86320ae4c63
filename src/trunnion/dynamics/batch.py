"""Figures of the motions in time of mechanisms that differ in numbers alone, one motion after another."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.dynamics.compiled_rates import Codes
from trunnion.dynamics.prepared import CYCLES, integration_of, rates_of
from trunnion.dynamics.start import initial_row, places
from trunnion.dynamics.started import FIGURES, DriveCourse
from trunnion.dynamics.state import FreeMotion
from trunnion.errors import MechanismError
from trunnion.solve.run import Run
from trunnion.solve.system import Values

__all__ = ["TOLERANCE", "figures_in_time"]

Array = NDArray[np.float64]

TOLERANCE = 1e-10  # of the steps, relative: figures to 1e-7 and better, a coordinate being many turns


@np.errstate(all="ignore")
def figures_in_time(
    run: Run, driver: str, values: Values, count: int, duration: float | None = None, tolerance: float = TOLERANCE
) -> dict[str, Array]:
    """Every figure of `started.FIGURES` of a free driver, (sample,); NaN of a motion that has none.

    values: of the mechanism, (sample, 1) where they vary; duration: s, ten cycles of the stated motion if not given.
    A motion that ends before its time, because it can go no farther, has no figures.
    """
    duration = CYCLES * run.cycle.duration if duration is None else duration
    varied = frozenset(path for path, value in values.items() if np.ndim(value) == 2)
    figures = {name: np.full(count, np.nan) for name in FIGURES}
    for i in range(count):
        alone = {path: float(value[i, 0]) if path in varied else value for path, value in values.items()}
        for name, figure in _alone(run, driver, alone, duration, tolerance, varied).items():
            figures[name][i] = figure
    return figures


def _alone(
    run: Run, driver: str, values: Mapping[str, Any], duration: float, tolerance: float, varied: Collection[str]
) -> dict[str, float]:
    """The figures of one motion; none where it cannot begin or ends before its time."""
    codes: Codes = run.once("machine code of motions", dict)
    try:
        motion = FreeMotion.of(Run(run.system, values, run.system.cycle(values), run.chosen))
        known, row = places(motion), initial_row(motion)
        if not known.limits[0] <= row[0] <= known.limits[1]:
            return {}
        solution = integration_of(motion, rates_of(motion, codes, varied), known, duration, tolerance).run(row)
    except MechanismError:
        return {}
    if solution.ended is not None or not solution.stretches:
        return {}
    return DriveCourse.of(motion, solution, motion.names.index(driver)).figures()
