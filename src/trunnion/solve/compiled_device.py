"""The kernel of many samples on a GPU: a thread for each lane, of the same record as machine code of a processor."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.solve.compiled import Array, Lanes
from trunnion.solve.compiled_vectors import VectorKernel, arrays_of, inputs_of
from trunnion.solve.memory import CHUNK
from trunnion.solve.system import Values

if TYPE_CHECKING:
    from trunnion.engines.device import Buffer, Device, DeviceCode
    from trunnion.engines.graph import Graph

__all__ = ["DeviceKernel", "Resident", "differs"]

PROBES = 64  # lanes of every run that NumPy computes too
APART = 1e-6  # of their peak: more is no rounding, not even of a locking margin
ZERO = 1e-9  # m, rad, N: what rounding may leave of a figure that is 0
TURN, GOLDEN = 2 * np.pi, (5**0.5 - 1) / 2
STATUS, DOUBT = "status of the lane", "doubt of the lane"

Places = NDArray[np.int64]


class Resident(NamedTuple):
    """Lanes that stay on a device: where the figures begin, by name, (sample, position), and the status and doubt."""

    device: Device
    buffer: Buffer
    offsets: Mapping[str, int]
    samples: int
    positions: int

    def address(self, name: str) -> int:
        return self.buffer.address + self.offsets[name]

    def rows(self, name: str, samples: int) -> Array:
        """A figure of the first samples."""
        return self.buffer.get(np.empty((samples, self.positions)), self.offsets[name])

    def take(self, name: str, lanes: Places) -> NDArray[Any]:
        """A figure or the status of some lanes, in the shape of their numbers."""
        found = np.empty(lanes.shape, np.int8 if name == STATUS else float)
        with self.device.holding(np.ascontiguousarray(lanes), found.nbytes) as (places, into):
            self.device.reduce(f"take{found.itemsize}", lanes.size, places.address, self.address(name), into.address)
            return into.get(found)

    def put(self, name: str, lanes: Places, values: Any) -> None:
        """Let a figure or the status of some lanes be what it is."""
        given = np.ascontiguousarray(np.broadcast_to(values, lanes.shape), np.int8 if name == STATUS else float)
        with self.device.holding(lanes, given) as (places, source):
            self.device.reduce(f"put{given.itemsize}", lanes.size, places.address, source.address, self.address(name))

    def doubtful(self) -> Places:
        """The lanes that NumPy has to decide."""
        lanes = self.samples * self.positions
        return self.device.listed("pick", lanes, lanes, self.address(DOUBT))

    def gravest(self) -> NDArray[np.int8]:
        """The gravest status of each sample."""
        found = np.empty(self.samples, np.int8)
        with self.device.holding(found.nbytes) as (into,):
            self.device.reduce("gravest", self.samples, self.positions, self.address(STATUS), into.address)
            return into.get(found)


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
        with self._running(inputs, samples, positions) as (buffer, offsets):
            for array, offset in zip(arrays_of(found), offsets, strict=True):
                buffer.get(array, offset)
        lanes = _probes(samples * positions, np.flatnonzero(found.doubtful))
        curves = {name: curve.ravel()[lanes] for name, curve in found.curves.items()}
        self._verify(values, time, positions, lanes, Lanes(curves, found.status.ravel()[lanes], None))

    @contextmanager
    def resident(
        self, values: Values, time: Array, samples: int, there: Callable[[str, NDArray[np.int8]], NDArray[np.bool_]]
    ) -> Iterator[Resident]:
        """All lanes, those in doubt decided by NumPy, on the device while they are looked at.

        there: where a figure has an answer, by its name and the status; it is NaN elsewhere.
        """
        inputs, names = inputs_of(values, time), [*self.figures, STATUS, DOUBT]
        positions = time.shape[-1]
        with self._running(inputs, samples, positions) as (buffer, offsets):
            found = Resident(self.device, buffer, dict(zip(names, offsets, strict=True)), samples, positions)
            doubtful = found.doubtful()
            lanes = _probes(samples * positions, doubtful)
            curves = {name: found.take(name, lanes) for name in self.figures}
            self._verify(values, time, positions, lanes, Lanes(curves, found.take(STATUS, lanes), None))
            self.again += len(doubtful)
            for low in range(0, len(doubtful), CHUNK):
                some = doubtful[low : low + CHUNK]
                decided, status = self.decided(values, time, *np.divmod(some, positions))
                for name, curve in decided.items():
                    found.put(name, some, np.where(there(name, status), curve, np.nan))
                found.put(STATUS, some, status)
            yield found

    def _running(self, inputs: Any, samples: int, positions: int) -> AbstractContextManager[tuple[Buffer, list[int]]]:
        """The figures, status and doubt of all lanes, see `DeviceCode.running`."""
        kinds = [np.dtype(float)] * len(self.figures) + [np.dtype(np.int8), np.dtype(bool)]
        code: Any = self.program(inputs)
        running: AbstractContextManager[tuple[Buffer, list[int]]] = code.running(
            inputs.numbers, kinds, samples, positions
        )
        return running

    def _verify(self, values: Values, time: Array, positions: int, lanes: Places, found: Lanes) -> None:
        """MechanismError unless some lanes, none in doubt, are what NumPy finds."""
        if not len(lanes):
            return
        curves, status = self.decided(values, time, *np.divmod(lanes, positions))
        if apart := int(np.count_nonzero(status != found.status)):
            raise differs(f"the status of {apart} of {len(lanes)} positions")
        for name, curve in curves.items():
            off = found.curves[name] - curve
            turned = off - TURN * np.rint(off / TURN)
            off = np.abs(np.where(np.abs(turned) <= APART, turned, off))  # an angle of half a turn has either sign
            peak = np.max(np.abs(curve), initial=0.0)
            if not np.all(off <= max(APART * peak, ZERO)):
                raise differs(f"'{name}' by {np.max(off):.2g} where its peak is {peak:.2g} (SI)")

    def _made(self, graph: Graph, outputs: list[int]) -> Any:
        from trunnion.engines.device import DeviceCode
        from trunnion.engines.program import program

        code: DeviceCode = DeviceCode(program(graph, outputs, 1, threads=True), self.device)
        return code

    def _key(self, inputs: Any) -> None:
        """The driver keeps what it compiled."""


def _probes(count: int, doubtful: Places) -> Places:
    """Lanes spread over all samples and positions, by the golden section, without those in doubt."""
    return np.setdiff1d((count * (np.arange(PROBES) * GOLDEN % 1.0)).astype(np.int64), doubtful)


def differs(what: str) -> MechanismError:
    """The error of a device that errs."""
    told = f"the GPU gives other numbers than NumPy for {what}: its result is refused"
    return MechanismError(Finding(told, "engine", "use the engine compiled, and report it with the name of the GPU"))
