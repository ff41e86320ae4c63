"""A job whose answer is easily compared: random numbers counted and summed, block by block."""

import os
import signal
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.studies.batch import Part


@dataclass(frozen=True)
class ToyJob:
    """Blocks of 500 numbers; `fatal`: a block that ends its worker, once (if `folder`) or always."""

    blocks: int = 37
    seed: int = 1
    pause: float = 0.0  # s a block
    fatal: int = -1
    folder: Path | None = None
    fault: str = ""
    model: dict[str, Any] = field(default_factory=lambda: {"AB": 2.0})

    def identity(self) -> dict[str, Any]:
        return {"seed": self.seed, "blocks": self.blocks, "model": self.model}

    def prepare(self) -> "ToyJob":
        if self.fault == "prepare":
            raise MechanismError(Finding("no such link", "links.x", "name one"))
        if self.fault == "deaf":  # as a process that is terminated before it has begun
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
        return self

    def __call__(self, block: int) -> Part:
        time.sleep(self.pause)
        if block == self.fatal:
            self._perish()
        if self.fault == "evaluate" and block == 5:
            raise ZeroDivisionError("block 5")
        stream = np.random.Generator(np.random.Philox(key=self.seed, counter=[0, 0, 0, block]))
        values = stream.standard_normal(500) * 10.0 ** stream.integers(-8, 8)
        return {"counts": np.histogram(values, np.linspace(-1, 1, 17))[0], "sum": values.sum(keepdims=True)}

    def _perish(self) -> None:
        if self.folder is not None:
            try:
                (self.folder / "perished").touch(exist_ok=False)
            except FileExistsError:
                return
        os.kill(os.getpid(), signal.SIGKILL)


def bits(parts: list[Part]) -> list[dict[str, tuple[Any, ...]]]:
    """Every array of every part, byte by byte."""
    return [{name: (array.tobytes(), array.shape, str(array.dtype)) for name, array in part.items()} for part in parts]
