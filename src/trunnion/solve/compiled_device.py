"""The kernel of many samples on a GPU: a thread for each lane, of the same record as machine code of a processor."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.solve.compiled import Array, Lanes
from trunnion.solve.compiled_vectors import VectorKernel, arrays_of, inputs_of
from trunnion.solve.system import Values

if TYPE_CHECKING:
    from trunnion.engines.device import DeviceCode
    from trunnion.engines.graph import Graph

__all__ = ["DeviceKernel"]

PROBES = 64  # lanes of every run that NumPy computes too
APART = 1e-6  # of their peak: more is no rounding, not even of a locking margin
ZERO = 1e-9  # m, rad, N: what rounding may leave of a figure that is 0
TURN = 2 * np.pi


class DeviceKernel(VectorKernel):
    """Recorded once and run on the first GPU. What NumPy has to decide, and some lanes by which it checks, it computes.

    Raises MechanismError, beside what `CompiledKernel` does, where there is no GPU or a call of its driver fails.
    """

    def prepare(self) -> None:
        """Find the device."""
        from trunnion.engines.device import device

        self.device = device()
        super().prepare()

    def fill(self, values: Values, time: Array, found: Lanes) -> None:
        """All lanes on the device. Raises MechanismError if some are not what NumPy finds."""
        inputs = inputs_of(values, time)
        samples, positions = found.status.shape
        self.program(inputs).run(inputs.numbers, arrays_of(found), (0, samples), (0, positions))
        self.verify(values, time, found)

    def verify(self, values: Values, time: Array, found: Lanes) -> None:
        """MechanismError unless some lanes, spread over all that are not in doubt, are what NumPy finds."""
        sure = np.flatnonzero(~found.doubtful.ravel())
        if not len(sure):
            return
        lanes = sure[np.linspace(0, len(sure) - 1, min(PROBES, len(sure))).astype(np.intp)]
        row, column = np.divmod(lanes, found.status.shape[1])
        curves, status = self.decided(values, time, row, column)
        apart = int(np.count_nonzero(status != found.status[row, column]))
        if apart:
            raise _differs(f"the status of {apart} of {len(lanes)} positions")
        for name, curve in curves.items():
            off = found.curves[name][row, column] - curve
            turned = off - TURN * np.rint(off / TURN)
            off = np.abs(np.where(np.abs(turned) <= APART, turned, off))  # an angle of half a turn has either sign
            peak = np.max(np.abs(curve), initial=0.0)
            if not np.all(off <= max(APART * peak, ZERO)):
                raise _differs(f"'{name}' by {np.max(off):.2g} where its peak is {peak:.2g} (SI)")

    def _made(self, graph: Graph, outputs: list[int]) -> Any:
        from trunnion.engines.device import DeviceCode
        from trunnion.engines.program import program

        code: DeviceCode = DeviceCode(program(graph, outputs, 1, threads=True), self.device)
        return code

    def _key(self, inputs: Any) -> None:
        """The driver keeps what it compiled."""


def _differs(what: str) -> MechanismError:
    told = f"the GPU gives other numbers than NumPy for {what}: its result is refused"
    return MechanismError(Finding(told, "engine", "use the engine compiled, and report it with the name of the GPU"))
