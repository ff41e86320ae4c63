"""Programs of LLVM as machine code: compiled for this processor, kept on disk, run by as many threads as one likes."""

from __future__ import annotations

import ctypes
import hashlib
import os
import platform
import stat
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cache
from pathlib import Path
from threading import Lock
from typing import Any

import llvmlite
import llvmlite.binding as llvm
import numpy as np
from numpy.typing import NDArray

from trunnion.engines.program import Program
from trunnion.files import cache_directory
from trunnion.version import __version__

Array = NDArray[np.float64]
COMPILING = Lock()  # LLVM's own state is not made for several threads
MAGIC = b"trunnion object 1\n"


@cache
def _target() -> tuple[str, str]:
    """Name and features of this processor, once LLVM is ready."""
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()


@cache
def vector_width() -> int:
    """Floats that this processor takes at a time."""
    features = _target()[1].split(",")
    return 8 if "+avx512f" in features else 4 if "+avx" in features else 2


class MachineCode:
    """A program, ready to run. folder: where its object code is kept; read from there if it is, written if it can be.

    compiled: whether it had to be compiled.
    """

    def __init__(self, program: Program, folder: Path | None = None) -> None:
        with COMPILING:
            # its file, by what it does, for which processor, made by which versions and sources
            sources = str([path.stat().st_mtime_ns for path in sorted(Path(__file__).parent.glob("*.py"))])
            text = "\0".join((program.key, *_target(), llvmlite.__version__, __version__, sources))
            folder = cache_directory("compiled") if folder is None else folder
            self.path = folder / f"{hashlib.sha256(text.encode()).hexdigest()}.o"
            code = _read(self.path)
            self.compiled = code is None
            if code is None:
                module = llvm.parse_assembly(program.write())
                module.verify()
                code = bytes(_machine().emit_object(module))
                _keep(self.path, code)
        self.inputs, self.rows, self.width = program.inputs, program.rows, program.width
        with COMPILING:
            self._engine = llvm.create_mcjit_compiler(llvm.parse_assembly(""), _machine())
            self._engine.add_object_file(llvm.object_file.ObjectFileRef.from_data(code))
            self._engine.finalize_object()
        kinds = [*[ctypes.c_int64] * 5, *[ctypes.c_void_p] * 6]
        self.address = self._engine.get_function_address("kernel")
        self.function = ctypes.CFUNCTYPE(None, *kinds)(self.address)

    def bound(
        self,
        inputs: Mapping[str, Array],
        outputs: Sequence[NDArray[Any]],
        samples: tuple[int, int],
        positions: tuple[int, int],
    ) -> Callable[[], None]:
        """What fills the outputs, (sample, position), from the first to before the last sample and position.

        It may be called often: what the arrays hold may change in between. inputs: by name, (1,), (sample,),
        (position,) or (sample, position), contiguous floats. There are at least as many positions as a vector holds.
        """
        if positions[1] - positions[0] < self.width:  # it would write before the beginning of the row
            raise ValueError(f"{positions[1] - positions[0]} positions, where a vector holds {self.width}")
        stride = outputs[0].shape[-1]
        table = np.empty(max(1, self.rows * (positions[1] - positions[0])))
        tables = (*([inputs[name] for name in names] for names in self.inputs), outputs)
        pointers = [
            (ctypes.c_void_p * max(1, len(arrays)))(*(array.ctypes.data for array in arrays)) for arrays in tables
        ]
        arguments = (*samples, *positions, stride, *pointers, table.ctypes.data)
        alive = inputs, outputs, table  # as long as their addresses are in use

        def call() -> None:
            self.function(*arguments)

        call.held = alive  # type: ignore[attr-defined]
        return call


def _machine() -> Any:
    name, features = _target()
    target = llvm.Target.from_default_triple()
    # with the small code model, code that is loaded far from the tables it reads ends the process
    model = "large" if platform.machine().lower() in ("x86_64", "amd64") else "jitdefault"
    # with more than the first level kernels take a tenth longer to compile and run as fast, within 4 %
    return target.create_target_machine(cpu=name, features=features, opt=1, reloc="pic", codemodel=model)


# ---- on disk --------------------------------------------------------------------------------------------------


def _read(path: Path) -> bytes | None:
    """Object code that this user has kept; None if there is none, or it is not whole, or another's."""
    with suppress(OSError):
        if not _own(path.parent) or not _own(path):
            return None
        data = path.read_bytes()
        head, digest, code = data[: len(MAGIC)], data[len(MAGIC) : len(MAGIC) + 32], data[len(MAGIC) + 32 :]
        if head == MAGIC and hashlib.sha256(code).digest() == digest:
            return code
    return None


def _own(path: Path) -> bool:
    """Whether a file or folder is this user's and nobody else can write it; of Windows the user's folders are."""
    if not hasattr(os, "getuid"):
        return True
    file_status = path.stat()
    return file_status.st_uid == os.getuid() and not file_status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)


def _keep(path: Path, code: bytes) -> None:
    """Keep object code, if the folder can be written and is this user's."""
    with suppress(OSError):
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        if _own(path.parent):
            handle, name = tempfile.mkstemp(dir=path.parent)  # for this user alone, unlike what `files.whole` writes
            try:
                with os.fdopen(handle, "wb") as file:
                    file.write(MAGIC + hashlib.sha256(code).digest() + code)
                os.replace(name, path)
            except BaseException:
                os.unlink(name)
                raise
