"""Figures of the walk forward and back as a kernel of the compiled engine.

Lanes that are not plainly solved, or without proof that the friction has one solution, are left to NumPy.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number, UntraceableError
from trunnion.engines.kernel import Array, Kernel, Lanes
from trunnion.errors import Finding, MechanismError, Status
from trunnion.solve.backward import Backward
from trunnion.solve.forward import forward
from trunnion.solve.friction import STUBBORN
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.margin import locking_margin
from trunnion.solve.run import Run
from trunnion.solve.status import (
    NEAR_SINGULAR,
    pose_status,
    pose_status_number,
    status_number,
    status_of,
)
from trunnion.solve.system import Values, law_of, rubbing

__all__ = ["Figure", "WalkKernel"]

Figure = Callable[[Backward], Number]  # one number of every position, of the motion (`back.walk`) or of the forces
BORDER = 0.99 * NEAR_SINGULAR  # condition from which NumPy decides what a position is


class WalkKernel(Kernel):
    """Figures of a mechanism over samples and positions.

    run: the prepared mechanism; figures: by name, what to read off each walk; forces: whether one of them needs more
    than the motion; threads: at a time, by default one for each core; gravest: status from which on NumPy computes a
    lane again; undefined: figures that may have no finite value; described: tells these figures from all others of the
    model. Raises MechanismError if the mechanism has what only NumPy does.
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
        self.run, self.figures, self.forces = run, dict(figures), forces
        self.method = method or FrictionMethod()
        self.gravest = gravest
        _check(run, self.method)
        request = described, list(figures), forces, self.method, gravest, sorted(undefined)
        laws = (law_of(run.system, joint).function.__module__ for joint in rubbing(run.system))
        keyed = described is not None and all(name.startswith("trunnion.") for name in laws)
        model = (run.system.mechanism.model_dump_json(), repr(run.chosen.assembly), repr(request)) if keyed else ()
        super().__init__(list(figures), threads, undefined, "\0".join(model) if keyed else None)

    def walked(self, values: Values, time: Number) -> Lanes:
        """See `Kernel.walked`."""
        with np.errstate(all="ignore"):
            back = self.back(values, time)
            status = status_number(back) if self.forces else pose_status_number(back.walk)
            doubtful = (status > self.gravest) | (back.walk.condition > BORDER)
            for settled in back.settled:
                doubtful = doubtful | np.logical_not(settled.certain)
            doubtful = doubtful | np.isnan(locking_margin(back))
            return Lanes({name: figure(back) for name, figure in self.figures.items()}, status, doubtful)

    def decided(self, values: Values, time: Array) -> tuple[dict[str, Number], NDArray[np.int8]]:
        """See `Kernel.decided`."""
        with np.errstate(all="ignore"):
            back = self.back(values, time)
            status = status_of(back, time.shape) if self.forces else pose_status(back.walk, time.shape)
            return {name: figure(back) for name, figure in self.figures.items()}, status

    def back(self, values: Values, time: Number) -> Backward:
        """One walk, back again only where forces are asked for."""
        run = self.run
        try:
            if self.forces:
                return run.solve(time, values, self.method)
            return Backward(forward(run.system, values, run.chosen.assembly, time), {})
        except UntraceableError as error:
            what = f"this mechanism is not compiled: {error}"
            raise MechanismError(Finding(what, "engine", "use the engine numpy")) from error


def _check(run: Run, method: FrictionMethod) -> None:
    """MechanismError for what only NumPy does."""
    remedy = "use the engine numpy"
    if method.name != "newton" or method.criterion is not None or method.limit < STUBBORN:
        what = "friction by successive approximation, or with a criterion or limit of its own, is not compiled"
        raise MechanismError(Finding(what, "engine", remedy))
    if run.system.inverse:
        what = "a driver that moves another joint by its law is not compiled"
        raise MechanismError(Finding(what, f"drivers.{next(iter(run.system.inverse.moves))}.moves", remedy))
    for module in run.system.plan.modules:
        if module.redundant:
            what = f"the links {', '.join(module.links)} are over-constrained, which is solved by least squares"
            raise MechanismError(Finding(f"{what}: that is not compiled", "engine", remedy))
    for joint in rubbing(run.system):
        if law_of(run.system, joint).relaxation is not None:
            what = f"the friction of {joint} has a memory along the cycle: that is not compiled"
            raise MechanismError(Finding(what, f"joints.{joint}.friction", remedy))
