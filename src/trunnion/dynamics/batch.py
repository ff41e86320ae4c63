"""Figures of the motions in time of many mechanisms that differ in numbers alone.

What can be tabulated goes together (`sampled`, `starts`); what cannot, or is not certain there, is integrated by
itself, as `simulate` does it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.dynamics.course import FIGURES, Courses
from trunnion.dynamics.lanes import picked_drive
from trunnion.dynamics.motor import Drive, drives
from trunnion.dynamics.prepared import CYCLES, integration_of
from trunnion.dynamics.sampled import picked, sampled_tables, tabulates
from trunnion.dynamics.start import initial_row, nominal_motion, places
from trunnion.dynamics.starts import ENDED, LEFT, Starts
from trunnion.dynamics.state import FreeMotion
from trunnion.dynamics.tables import Tables
from trunnion.errors import MechanismError
from trunnion.solve.run import Run
from trunnion.solve.system import Values

__all__ = ["TOLERANCE", "figures_in_time", "together"]

Array = NDArray[np.float64]

TOLERANCE = 1e-9  # of the steps, relative: figures to 1e-6 and better


@np.errstate(all="ignore")
def figures_in_time(
    run: Run, driver: str, values: Values, count: int, duration: float | None = None, tolerance: float = TOLERANCE
) -> dict[str, Array]:
    """Every figure of `course.FIGURES` of a free driver, (sample,); NaN of a motion that has none.

    values: of the mechanism, (sample, 1) where they vary; duration: s, ten cycles of the stated motion if not given.
    A motion that ends before its time, because it can go no farther, has no figures.
    """
    duration = CYCLES * run.cycle.duration if duration is None else duration
    motion, nominal = _nominal(run)
    found = {name: np.full(count, np.nan) for name in FIGURES}
    left = np.ones(count, bool)
    own = _drive(motion, values) if nominal is not None else None
    if nominal is not None and own is not None:
        begin = _begin(motion, values, count)
        rotates = float(np.ravel(motion.system.size(motion.values))[0])
        size = 1.0 if motion.system.turns(motion.names[0]) else rotates
        sticks = bool(motion.sticking) or bool(np.any(np.isfinite(own.brake_from)) | np.any(own.efficiency != 1.0))
        for tables in sampled_tables(nominal, values, count):
            rows = tables.samples
            starts = Starts(
                tables,
                picked_drive(own, rows),
                begin[:, rows],
                duration,
                tolerance,
                float(motion.unit[0]),
                size,
                sticks,
            )
            figures = starts.run().figures()
            done, ended = starts.status != LEFT, starts.status == ENDED
            for name, figure in figures.items():
                found[name][rows[done]] = np.where(ended, np.nan, figure)[done]
            left[rows[done]] = False
    for i in np.flatnonzero(left):
        for name, value in _alone(run, driver, picked(values, int(i)), duration, tolerance).items():
            found[name][i] = value
    return found


def together(run: Run) -> bool:
    """Whether many motions of a mechanism and its like are integrated at once."""
    return _nominal(run)[1] is not None


def _nominal(run: Run) -> tuple[FreeMotion, Tables | None]:
    """The motion of the nominal mechanism, with its tables."""

    def find() -> tuple[FreeMotion, Tables | None]:
        motion = FreeMotion.of(run)
        if any(drive.clutched for drive in motion.drives.values()):  # whose slips are events of each motion alone
            return motion, None
        return motion, tabulates(motion, places(motion))

    return run.once("motion in time", find)


def _drive(motion: FreeMotion, values: Values) -> Drive | None:
    """The drive, numbers that vary (sample,); None where points of a table vary."""

    def number(value: Any) -> Any:
        return value[:, 0] if np.ndim(value) == 2 else float(value)

    if any(np.ndim(value) == 2 and ".motor.points." in path for path, value in values.items()):
        return None
    (found,) = drives(motion.system, values, number).values()
    return found


def _begin(motion: FreeMotion, values: Values, count: int) -> Array:
    """Coordinate and speed at the start, (2, sample)."""
    path = f"drivers.{motion.names[0]}.initial"
    begin = values.get(f"{path}.coordinate", nominal_motion(motion, values)[0]), values.get(f"{path}.speed", 0.0)
    return np.array([np.broadcast_to(np.asarray(primal(one), float), (count, 1))[:, 0] for one in begin])


def _alone(run: Run, driver: str, values: Values, duration: float, tolerance: float) -> dict[str, float]:
    """The figures of one motion by itself; none where it cannot begin or ends before its time."""
    try:
        own = Run(run.system, values, run.system.cycle(values), run.chosen)
        motion = FreeMotion.of(own)
        known = places(motion)
        row = initial_row(motion)
        if not known.limits[0] <= row[0] <= known.limits[1]:
            return {}
        solution = integration_of(motion, known, duration, tolerance).run(row)
    except MechanismError:
        return {}
    if solution.ended is not None or not solution.stretches:
        return {}
    course = Courses.of_solution(motion, solution, motion.names.index(driver))
    return {name: float(value[0]) for name, value in course.figures().items()}
