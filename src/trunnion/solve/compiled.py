"""The kernel of many samples or positions, compiled: the same walk forward and back, written down once and run often.

`solve.forward`, `solve.backward`, the groups and the laws run on numbers that stand for values; what comes out is one
function of the numbers that vary and of the times. Lanes that cannot be decided without values - not plainly solved, or
without proof that the friction has one solution - are computed again by NumPy, so that the answer is NumPy's
everywhere.
"""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Callable, Collection, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number, UntraceableError
from trunnion.errors import Finding, MechanismError, Status
from trunnion.solve.backward import Backward
from trunnion.solve.forward import forward
from trunnion.solve.friction import STUBBORN
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.margin import locking_margin
from trunnion.solve.memory import CHUNK
from trunnion.solve.run import Run
from trunnion.solve.status import (
    NEAR_SINGULAR,
    pose_status,
    pose_status_number,
    status_number,
    status_of,
    worst_condition,
)
from trunnion.solve.system import Values, law_of, rubbing

__all__ = ["Array", "CompiledKernel", "Figure", "Lanes", "lanes_of"]

Array = NDArray[np.float64]
Figure = Callable[[Backward], Number]  # one number of every position, of the motion (`back.walk`) or of the forces
BORDER = 0.99 * NEAR_SINGULAR  # condition from which NumPy decides what a position is


class Lanes(NamedTuple):
    """Of every lane: figures by name, status, and whether NumPy has to decide it."""

    curves: dict[str, Any]
    status: Any
    doubtful: Any


class CompiledKernel(ABC):
    """Curves of measures over samples and positions.

    run: the prepared mechanism; figures: by name, what to read off each walk; forces: whether one of them needs more
    than the motion; threads: at a time, by default one for each core; gravest: status from which on NumPy computes a
    lane again; undefined: figures that may have no finite value; described: tells these figures from all others of the
    model, so that machine code that was kept is found without recording anything. Raises MechanismError if
    the mechanism has what only NumPy does.
    """

    def __init__(
        self,
        run: Run,
        figures: Mapping[str, Figure],
        forces: bool = True,
        method: FrictionMethod | None = None,
        threads: int | None = None,
        gravest: Status = Status.ZERO_SLIP,
        undefined: Collection[str] = (),
        described: str | None = None,
    ) -> None:
        self.run = run
        self.figures = dict(figures)
        self.forces = forces
        self.method = method or FrictionMethod()
        self.threads = threads or os.cpu_count() or 1
        self.gravest, self.undefined = gravest, undefined
        self.described = described and f"{described} {list(self.figures)}"
        self.again = 0  # lanes that NumPy computed again, so far
        _check(run, self.method)

    @abstractmethod
    def check(self, values: Values, time: Array | None = None) -> None:
        """MechanismError if this mechanism cannot be compiled, found without compiling it.

        time: one that it will be asked for, s, by whose shape what is known already is found.
        """

    @abstractmethod
    def fill(self, values: Values, time: Array, found: Lanes) -> None:
        """Compute all lanes, (sample, position), into arrays. time: (position,) or (sample, position)."""

    def curves(self, values: Values, time: Array) -> tuple[dict[str, Array], NDArray[np.int8]]:
        """Figures by name, and the status, both (sample, position).

        values: every number by path; floats are the same in all samples, arrays are (sample, 1).
        time: (position,) s, or (sample, position).
        """
        counts = [len(value) for value in (*values.values(), np.atleast_2d(time)) if np.ndim(value)]
        shape = (max(counts), time.shape[-1])
        curves = {name: np.empty(shape) for name in self.figures}
        found = Lanes(curves, np.empty(shape, np.int8), np.empty(shape, bool))
        self.fill(values, time, found)
        self.decide(values, time, found)
        return found.curves, found.status

    def walked(self, values: Values, time: Number) -> Lanes:
        """Figures, status and doubt of numbers of whatever kind."""
        with np.errstate(all="ignore"):
            back = self._back(values, time)
            status = status_number(back) if self.forces else pose_status_number(back.walk)
            doubtful = (status > self.gravest) | (worst_condition(back.walk) > BORDER)
            for settled in back.settled:
                doubtful = doubtful | np.logical_not(settled.certain)
            doubtful = doubtful | np.isnan(locking_margin(back))
            return Lanes({name: figure(back) for name, figure in self.figures.items()}, status, doubtful)

    def _back(self, values: Values, time: Number) -> Backward:
        """One walk, back again only where forces are asked for."""
        run = self.run
        try:
            if self.forces:
                return run.solve(time, values, self.method)
            return Backward(forward(run.system, values, run.chosen.assembly, time), {})
        except UntraceableError as error:
            what = f"this mechanism is not compiled: {error}"
            raise MechanismError(Finding(what, "engine", "use the engine numpy")) from error

    def by_numpy(self, values: Values, time: Number) -> Backward:
        """The same walk by NumPy."""
        with np.errstate(all="ignore"):
            return self._back(values, time)

    def decide(self, values: Values, time: Array, found: Lanes) -> None:
        """Compute the doubtful lanes with NumPy, a chunk at a time."""
        if not found.doubtful.any():  # as a rule; to list them takes longer
            return
        rows, columns = np.nonzero(found.doubtful)
        self.again += len(rows)
        for low in range(0, len(rows), CHUNK):
            row, column = rows[low : low + CHUNK], columns[low : low + CHUNK]
            curves, status = self.decided(values, time, row, column)
            found.status[row, column] = status
            for name, curve in curves.items():
                found.curves[name][row, column] = curve

    def decided(
        self, values: Values, time: Array, row: NDArray[np.intp], column: NDArray[np.intp]
    ) -> tuple[dict[str, Any], NDArray[np.int8]]:
        """Figures by name and status of some lanes, one after the other, by NumPy."""
        part = {path: lanes_of(value, row, column) for path, value in values.items()}
        times = time[column] if time.ndim == 1 else time[row, column]
        back = self.by_numpy(part, times)
        with np.errstate(all="ignore"):
            status = status_of(back, row.shape) if self.forces else pose_status(back.walk, row.shape)
            return {name: figure(back) for name, figure in self.figures.items()}, status


def lanes_of(value: Number, rows: NDArray[np.intp], columns: NDArray[np.intp] | None = None) -> Number:
    """The number in some lanes, one after the other: (sample, 1) or, with columns, (1, position)."""
    if not np.ndim(value):
        return value
    flat = np.ravel(value)
    if columns is not None and len(flat) > 1 and np.shape(value)[0] == 1 < np.ndim(value):
        return flat[columns]
    return flat[rows] if len(flat) > 1 else float(flat[0])


def _check(run: Run, method: FrictionMethod) -> None:
    """MechanismError for what only NumPy does."""
    remedy = "use the engine numpy"
    if method.name != "newton" or method.criterion is not None or method.limit < STUBBORN:
        what = "friction by successive approximation, or with a criterion or limit of its own, is not compiled"
        raise MechanismError(Finding(what, "engine", remedy))
    for module in run.system.plan.modules:
        if module.redundant:
            what = f"the links {', '.join(module.links)} are over-constrained, which is solved by least squares"
            raise MechanismError(Finding(f"{what}: that is not compiled", "engine", remedy))
    for joint in rubbing(run.system):
        if law_of(run.system, joint).relaxation is not None:
            what = f"the friction of {joint} has a memory along the cycle: that is not compiled"
            raise MechanismError(Finding(what, f"joints.{joint}.friction", remedy))
