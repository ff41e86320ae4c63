"""Figures of the motions in time of many mechanisms that differ in numbers alone.

What can be tabulated goes together (`sampled`, `starts`); what cannot, or is not certain there, is integrated by
itself, as `simulate` does it.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.dynamics.course import FIGURES, OVER_TIME, Courses
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

__all__ = ["TOLERANCE", "figures_in_time", "one_by_one"]

Array = NDArray[np.float64]

MOTOR_POINTS = ".motor.points."  # in the path of a number of a motor's table
TOLERANCE = 1e-9  # of the steps, relative: figures to 1e-6 and better


@np.errstate(all="ignore")
def figures_in_time(
    run: Run, driver: str, values: Values, count: int, duration: float | None = None, tolerance: float = TOLERANCE,
    times: Array | None = None,
) -> dict[str, Array]:  # fmt: skip
    """Every figure of `course.FIGURES` of a free driver, (sample,); NaN of a motion that has none. times: at which the
    numbers of `course.OVER_TIME` are told beside them, (sample, time).

    values: of the mechanism, (sample, 1) where they vary; duration: s, ten cycles of the stated motion if not given.
    A motion that ends before its time, because it can go no farther, has no figures.
    """
    duration = CYCLES * run.cycle.duration if duration is None else duration
    motion, nominal = _nominal(run)
    found = {name: np.full(count, np.nan) for name in FIGURES}
    if times is not None:
        found |= {name: np.full((count, len(times)), np.nan) for name in OVER_TIME}
    left = np.ones(count, bool)
    own = None if isinstance(nominal, str) else _drive(motion, values)
    if not isinstance(nominal, str) and own is not None:
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
            figures = starts.run().figures(times)
            done, ended = starts.status != LEFT, starts.status == ENDED
            for name, figure in figures.items():
                figure[ended] = np.nan
                found[name][rows[done]] = figure[done]
            left[rows[done]] = False
    for i in np.flatnonzero(left):
        for name, value in _alone(run, driver, picked(values, int(i)), duration, tolerance, times).items():
            found[name][i] = value
    return found


def one_by_one(run: Run, varied: Iterable[str] = ()) -> str:
    """Why motions of a mechanism and its like are integrated one by one; empty if they are at once. varied: paths of
    the numbers in which they differ."""
    _, nominal = _nominal(run)
    if isinstance(nominal, str):
        return nominal
    path = next((path for path in varied if MOTOR_POINTS in path), "")
    return f"the motor's table varies ({path})" if path else ""


def _nominal(run: Run) -> tuple[FreeMotion, Tables | str]:
    """The motion of the nominal mechanism, with its tables, or why its like are not tabulated together."""

    def find() -> tuple[FreeMotion, Tables | str]:
        motion = FreeMotion.of(run)
        if any(drive.clutched for drive in motion.drives.values()):
            return motion, "a clutch slips at times that each motion has for itself"
        return motion, tabulates(motion, places(motion))

    return run.once("motion in time", find)


def _drive(motion: FreeMotion, values: Values) -> Drive | None:
    """The drive, numbers that vary (sample,); None where points of a table vary."""

    def number(value: Any) -> Any:
        return value[:, 0] if np.ndim(value) == 2 else float(value)

    if any(np.ndim(value) == 2 and MOTOR_POINTS in path for path, value in values.items()):
        return None
    (found,) = drives(motion.system, values, number).values()
    return found


def _begin(motion: FreeMotion, values: Values, count: int) -> Array:
    """Coordinate and speed at the start, (2, sample)."""
    path = f"drivers.{motion.names[0]}.initial"
    begin = values.get(f"{path}.coordinate", nominal_motion(motion, values)[0]), values.get(f"{path}.speed", 0.0)
    return np.array([np.broadcast_to(np.asarray(primal(one), float), (count, 1))[:, 0] for one in begin])


def _alone(
    run: Run, driver: str, values: Values, duration: float, tolerance: float, times: Array | None
) -> dict[str, Array]:
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
    return {name: value[0] for name, value in course.figures(times).items()}
