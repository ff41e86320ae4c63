"""Programs of LLVM on a GPU of NVIDIA: as PTX, which its driver makes into machine code; memory there, and launches.

Nothing of CUDA's toolkit is needed: LLVM writes PTX, and the driver is called through cuda-bindings.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from functools import cache, cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError

if TYPE_CHECKING:
    from trunnion.engines.program import Program

__all__ = ["THREADS", "Buffer", "Device", "DeviceCode", "device", "ptx"]

Array = NDArray[Any]
A = TypeVar("A", bound=NDArray[Any])
THREADS = 128  # of a block
OLDEST = "sm_75", "+ptx63"  # the oldest GPU that PTX is for (Turing, 2018); drivers take it for all newer ones
REMEDY = "use the engine compiled"


def ptx(text: str) -> bytes:
    """A module of LLVM as PTX, ended by a zero."""
    import llvmlite.binding as llvm

    from trunnion.engines.machine_code import COMPILING

    with COMPILING:
        return _ptx(llvm, text)


def _ptx(llvm: Any, text: str) -> bytes:
    llvm.initialize_all_targets()
    llvm.initialize_all_asmprinters()
    target = llvm.Target.from_triple("nvptx64-nvidia-cuda")
    machine = target.create_target_machine(cpu=OLDEST[0], features=OLDEST[1], opt=3)
    module = llvm.parse_assembly(text)
    module.triple, module.data_layout = machine.triple, str(machine.target_data)
    module.verify()
    return str(machine.emit_assembly(module)).encode() + b"\0"


def device() -> Device:
    """The first GPU. Raises MechanismError if there is none, or a package that it needs is not installed."""
    try:
        import_module("llvmlite")
        driver = import_module("cuda.bindings.driver")
    except ImportError as error:
        what = f"the engine gpu needs the packages llvmlite and cuda-bindings: {error}"
        raise MechanismError(Finding(what, "engine", f"pip install 'trunnion[gpu]', or {REMEDY}")) from None
    return _opened(driver)


@cache
def _opened(driver: Any) -> Device:
    return Device(driver)


class Buffer:
    """Memory of a device, bytes, until it is left."""

    def __init__(self, of: Device, size: int) -> None:
        of.enter()
        self.device = of
        self.address = int(of.call("cuMemAlloc", max(size, 8)))

    def __enter__(self) -> Buffer:
        return self

    def __exit__(self, *_: object) -> None:
        self.device.call("cuMemFree", self.address)

    def put(self, array: Array) -> None:
        """Copy a contiguous array there."""
        self.device.call("cuMemcpyHtoD", self.address, array.ctypes.data, array.nbytes)

    def get(self, array: A, offset: int = 0) -> A:
        """The array, contiguous, filled by what is there from so many bytes on."""
        self.device.call("cuMemcpyDtoH", array.ctypes.data, self.address + offset, array.nbytes)
        return array


class Device:
    """A GPU by its driver, the module `cuda.bindings.driver`: its calls return an error and what they give."""

    def __init__(self, driver: Any) -> None:
        self.driver = driver
        try:
            self.call("cuInit", 0)
            self._number = self.call("cuDeviceGet", 0)
            self._context = self.call("cuDevicePrimaryCtxRetain", self._number)
        except (RuntimeError, OSError, MechanismError) as error:  # no library of the driver; none of its devices
            what = f"no GPU of NVIDIA with its driver is found: {_first_line(error)}"
            raise MechanismError(Finding(what, "engine", REMEDY)) from None

    def call(self, name: str, *args: Any) -> Any:
        """What a call of the driver gives; MechanismError if it fails."""
        error, *found = getattr(self.driver, name)(*args)
        if int(error):
            remedy = f"ask for fewer positions, or {REMEDY}"
            raise MechanismError(Finding(f"the GPU reports {_name(error)} at {name}", "engine", remedy))
        return found[0] if found else None

    def enter(self) -> None:
        """Let this thread use the device."""
        self.call("cuCtxSetCurrent", self._context)

    def functions(self, text: str, names: Iterable[str]) -> dict[str, Any]:
        """The kernels of a module, by name."""
        self.enter()
        module = self.call("cuModuleLoadData", ptx(text))
        return {name: self.call("cuModuleGetFunction", module, name.encode()) for name in names}

    @cached_property
    def _reductions(self) -> dict[str, Any]:
        from trunnion.engines.reductions import NAMES, reductions

        return self.functions(reductions(), NAMES)

    def reduce(self, name: str, threads: int, *args: int) -> None:
        """Run a kernel of `engines.reductions`."""
        self.launch(self._reductions[name], threads, (threads, *args))

    def listed(self, name: str, threads: int, room: int, *args: int) -> NDArray[np.int64]:
        """The list that a kernel of `engines.reductions` writes, in rising order."""
        with self.holding(np.zeros(1, np.int64), 8 * room) as (count, found):
            self.reduce(name, threads, *args, count.address, found.address)
            return np.sort(found.get(np.empty(int(count.get(np.empty(1, np.int64))[0]), np.int64)))

    def launch(self, function: Any, threads: int, args: Sequence[int]) -> None:
        """Run a function in so many threads, and those that fill their block; all arguments have 64 bits. Waits."""
        if not threads:
            return
        told = (ctypes.c_int64 * len(args))(*args)
        first = ctypes.addressof(told)
        places = (ctypes.c_void_p * len(args))(*(first + 8 * k for k in range(len(args))))
        blocks = -(-threads // THREADS)
        self.call("cuLaunchKernel", function, blocks, 1, 1, THREADS, 1, 1, 0, 0, ctypes.addressof(places), 0)
        self.call("cuCtxSynchronize")

    @contextmanager
    def holding(self, *given: Array | int) -> Iterator[list[Buffer]]:
        """Memory with what is in contiguous arrays, or of so many bytes."""
        with ExitStack() as held:
            buffers = []
            for one in given:
                size = one if isinstance(one, int) else one.nbytes
                buffers.append(held.enter_context(Buffer(self, size)))
                if not isinstance(one, int):
                    buffers[-1].put(one)
            yield buffers


class DeviceCode:
    """A program for the threads of a device, ready to run."""

    def __init__(self, program: Program, of: Device) -> None:
        self.device, self.inputs = of, program.inputs
        self._function = of.functions(program.text, ["kernel"])["kernel"]

    @contextmanager
    def running(
        self, inputs: Mapping[str, Array], kinds: Sequence[np.dtype[Any]], samples: int, positions: int
    ) -> Iterator[tuple[Buffer, list[int]]]:
        """What the outputs, of these kinds, come to: the memory that holds them, and where each begins, bytes."""
        sizes = [-(-samples * positions * kind.itemsize // 8) * 8 for kind in kinds]
        offsets = np.cumsum([0, *sizes])
        arrays = [np.ravel(inputs[name]) for names in self.inputs for name in names]
        numbers = np.concatenate([np.zeros(1), *arrays])  # with one before them, so that there are some
        starts = 8 * np.cumsum([1, *map(len, arrays)])
        firsts = np.cumsum([0, *map(len, self.inputs)])
        with Buffer(self.device, int(offsets[-1])) as found:
            with Buffer(self.device, 8 * (len(numbers) + len(arrays) + len(kinds))) as given:
                told = np.concatenate([given.address + starts[:-1], found.address + offsets[:-1]])
                given.put(np.concatenate([numbers.view(np.int64), told]))
                lists = (given.address + 8 * (len(numbers) + firsts)).tolist()
                self.device.launch(
                    self._function, samples * positions, (0, samples, 0, positions, positions, *lists, 0)
                )
            yield found, offsets[:-1].tolist()


def _name(error: Any) -> str:
    return str(getattr(error, "name", error))


def _first_line(error: Exception) -> str:
    told = error.findings[0].what if isinstance(error, MechanismError) else str(error)
    return told.splitlines()[0] if told else type(error).__name__
