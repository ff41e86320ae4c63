"""Stands for a GPU and its driver: threads become the counters of a loop, and the same module runs on the processor.

Memory of the device is memory of the process. PTX cannot be run here, so the driver is given the module itself: a test
puts `as_text` in the place of `engines.device.ptx`.
"""

from __future__ import annotations

import ctypes
import re
from threading import Lock
from types import SimpleNamespace
from typing import Any

import llvmlite.binding as llvm

from trunnion.engines import machine_code
from trunnion.engines.program import PLACE

SUCCESS, FAULT = 0, 2


def as_text(text: str) -> bytes:
    """A module as it is, in the place of PTX."""
    return text.encode()


class StandIn:
    """`cuda.bindings.driver`, as far as it is used.

    calls: names in their order; memory: what is held; failing: calls that report an error.
    """

    def __init__(self, devices: int = 1) -> None:
        self.calls: list[str] = []
        self.memory: dict[int, Any] = {}
        self.failing: set[str] = set()
        self.devices = devices
        self._engines: list[Any] = []
        self._turn = Lock()

    def __getattr__(self, name: str) -> Any:
        own = object.__getattribute__(self, re.sub("([A-Z])", r"_\1", name.removeprefix("cu")).lower())

        def call(*args: Any) -> tuple[Any, ...]:
            self.calls.append(name)
            if name in self.failing:
                return SimpleError(FAULT, "CUDA_ERROR_OUT_OF_MEMORY"), None
            return own(*args)

        return call

    def _init(self, flags: int) -> tuple[Any, ...]:
        return (SimpleError(SUCCESS) if self.devices else SimpleError(100, "CUDA_ERROR_NO_DEVICE"),)

    def _device_get(self, number: int) -> tuple[Any, ...]:
        return SimpleError(SUCCESS), number

    def _device_primary_ctx_retain(self, device: int) -> tuple[Any, ...]:
        return SimpleError(SUCCESS), "context"

    def _ctx_set_current(self, context: str) -> tuple[Any, ...]:
        assert context == "context"
        return (SimpleError(SUCCESS),)

    def _ctx_synchronize(self) -> tuple[Any, ...]:
        return (SimpleError(SUCCESS),)

    def _mem_alloc(self, size: int) -> tuple[Any, ...]:
        block = ctypes.create_string_buffer(b"\xff" * size, size)  # nothing in it is 0 by chance
        address = ctypes.addressof(block)
        self.memory[address] = block
        return SimpleError(SUCCESS), address

    def _mem_free(self, address: int) -> tuple[Any, ...]:
        del self.memory[address]
        return (SimpleError(SUCCESS),)

    def _within(self, address: int, size: int) -> None:
        assert any(start <= address and address + size <= start + len(block) for start, block in self.memory.items())

    def _memcpy_hto_d(self, to: int, source: int, size: int) -> tuple[Any, ...]:
        self._within(to, size)
        ctypes.memmove(to, source, size)
        return (SimpleError(SUCCESS),)

    def _memcpy_dto_h(self, to: int, source: int, size: int) -> tuple[Any, ...]:
        self._within(source, size)
        ctypes.memmove(to, source, size)
        return (SimpleError(SUCCESS),)

    def _memset_d8(self, to: int, value: int, size: int) -> tuple[Any, ...]:
        self._within(to, size)
        ctypes.memset(to, value, size)
        return (SimpleError(SUCCESS),)

    def _module_load_data(self, text: bytes) -> tuple[Any, ...]:
        return SimpleError(SUCCESS), _hosted(text.decode())

    def _module_get_function(self, engine: Any, name: bytes) -> tuple[Any, ...]:
        self._engines.append(engine)
        address = engine.get_function_address(f"launch.{name.decode()}")
        return SimpleError(SUCCESS), ctypes.CFUNCTYPE(None, ctypes.c_int32, ctypes.c_int32, ctypes.c_void_p)(address)

    def _launch_kernel(self, function: Any, *told: Any) -> tuple[Any, ...]:
        blocks, one, two, threads, three, four, shared, stream, places, extra = told
        assert (one, two, three, four, shared, stream, extra) == (1, 1, 1, 1, 0, 0, 0)
        with self._turn:  # the counters of the loop are the module's
            function(blocks, threads, places)
        return (SimpleError(SUCCESS),)


class SimpleError(SimpleNamespace):
    """A result of a call."""

    def __init__(self, code: int, name: str = "CUDA_SUCCESS") -> None:
        super().__init__(code=code, name=name)

    def __int__(self) -> int:
        return int(self.code)


def _hosted(text: str) -> Any:
    """The module with a function `launch.NAME(blocks, threads, arguments)` for each kernel, as machine code."""
    text = text.replace("ptx_kernel ", "")
    for register in PLACE:
        text = text.replace(f'"{register}"', f'"host.{register}"')
        text = re.sub(rf'declare i32 @"host\.{re.escape(register)}"\(\)', "", text)
        text += f'\n@"at.{register}" = internal global i32 0\n'
        text += f'define internal i32 @"host.{register}"() {{ %v = load i32, ptr @"at.{register}" ret i32 %v }}\n'
    for name, kinds in re.findall(r'define void @"(\w+)"\(([^)]*)\)', text):
        text += _launch(name, [kind.split()[0] for kind in kinds.split(",")])
    with machine_code.COMPILING:
        machine_code._target()
        module = llvm.parse_assembly(text)
        module.verify()
        return machine_code._linked(machine_code._machine().emit_object(module))


def _launch(name: str, kinds: list[str]) -> str:
    block, size, thread = (f'ptr @"at.{register}"' for register in PLACE)
    lines = []
    for k, kind in enumerate(kinds):
        lines += [f"%g{k} = getelementptr ptr, ptr %args, i32 {k}", f"%p{k} = load ptr, ptr %g{k}"]
        lines += [f"%a{k} = load {kind}, ptr %p{k}"]
    told = ", ".join(f"{kind} %a{k}" for k, kind in enumerate(kinds))
    return f"""
define void @"launch.{name}"(i32 %blocks, i32 %size, ptr %args) {{
entry:
  {chr(10).join(lines)}
  store i32 %size, {size}
  br label %head
head:
  %b = phi i32 [0, %entry], [%b1, %next]
  store i32 %b, {block}
  br label %inner
inner:
  %t = phi i32 [0, %head], [%t1, %inner]
  store i32 %t, {thread}
  call void @"{name}"({told})
  %t1 = add i32 %t, 1
  %more = icmp slt i32 %t1, %size
  br i1 %more, label %inner, label %next
next:
  %b1 = add i32 %b, 1
  %again = icmp slt i32 %b1, %blocks
  br i1 %again, label %head, label %done
done:
  ret void
}}
"""
