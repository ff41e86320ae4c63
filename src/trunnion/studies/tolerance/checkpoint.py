"""What is done of a run: the tally, and on disk, in one file replaced as a whole, which blocks it holds of what job."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from time import perf_counter
from typing import Any, Generic
from zipfile import is_zipfile

import numpy as np

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.files import whole
from trunnion.studies.tolerance.protocol import Job, Portion, T
from trunnion.studies.tolerance.ranges import count
from trunnion.version import __version__

__all__ = ["Checkpoint", "settings"]

FORMAT = 1
INTERVAL = 30.0  # s between two checkpoints, at least
SHARE = 0.02  # of the time at most goes into checkpoints
HEAD, DONE, TALLY = "head", "done", "tally."  # names in the file


def _plain(value: object) -> object:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"{value!r} in the identity of a job has no JSON")


def _hash(value: object) -> str:
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()


def settings(job: Job[Any]) -> dict[str, Any]:
    """All that the answer depends on, by name; what is not a single value stands by its SHA-256, hexadecimal."""
    single = (str, int, float, bool, type(None))
    return {key: value if isinstance(value, single) else _hash(value) for key, value in job.identity().items()}


def _differences(there: Mapping[str, Any], job: Job[Any]) -> str:
    identity, here, texts = job.identity(), settings(job), []
    for key in sorted({*there, *here}):
        old, new = there.get(key), here.get(key)
        if old != new:
            single = not isinstance(identity.get(key), (Mapping, list, tuple))
            texts.append(f"{key} is {old} there and {new} here" if single else f"{key} differs")
    return "; ".join(texts)


class Checkpoint(Generic[T]):
    """The tally of one job as it grows, in one file if there is a path."""

    def __init__(self, path: str | os.PathLike[str] | None, job: Job[T]) -> None:
        self.path = None if path is None else Path(path)
        self.tally = job.empty()
        self.arithmetic: set[str] = set()  # fingerprints of the machines that took part
        self.trouble: Finding | None = None
        self._job = job
        self._written = perf_counter()
        self._cost = 0.0

    @property
    def left(self) -> int:
        """Blocks that are not done."""
        return self._job.blocks - count(self.tally.blocks)

    def add(self, part: Portion[T]) -> None:
        """More blocks."""
        self.tally = self.tally.merge(part.tally)
        self.arithmetic.add(part.arithmetic)

    def begin(self, resume: bool) -> None:
        """Go on from the file, or begin it; MechanismError if it cannot be used, or stands in the way."""
        if self.path is None:
            return
        if not self.path.exists():
            self._write(self.path)  # so that a folder that cannot be written to is known now and not after an hour
        elif resume:
            self.tally = self._read(self.path)
        else:
            with suppress(MechanismError):
                if not self._read(self.path).blocks:  # left by a run that did not get under way
                    return
            remedy = "continue with --resume, delete the file, or name another one"
            raise MechanismError(Finding("the checkpoint is there already", str(self.path), remedy))

    def _read(self, path: Path) -> T:
        if path.is_file() and not is_zipfile(path):
            remedy = "name the file that the run was begun with, or another for a new run"
            raise MechanismError(
                Finding("cannot be read as a checkpoint: it is none, or its end is missing", str(path), remedy)
            )
        try:
            with path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
                head = json.loads(bytes(file[HEAD]))
                self._check(path, head)
                self.arithmetic |= set(head["arithmetic"])
                done = [(int(first), int(last)) for first, last in file[DONE]]
                arrays = {name.removeprefix(TALLY): file[name] for name in file.files if name.startswith(TALLY)}
            tally = self._job.empty().from_arrays(arrays)
            if done != [tuple(pair) for pair in tally.blocks] or count(done) > self._job.blocks:
                raise ValueError("the blocks done are not those of the tally")
        except MechanismError:
            raise
        except Exception as error:  # whatever a damaged file leads to, it is one fact about the file
            what = f"cannot be read as a checkpoint ({type(error).__name__}: {error})"
            remedy = "delete it and start again, or name another file"
            raise MechanismError(Finding(what, str(path), remedy)) from None
        return tally

    def _check(self, path: Path, head: Mapping[str, Any]) -> None:
        """MechanismError unless it was written for this job by this version."""
        if head["format"] != FORMAT or head["version"] != __version__:
            what = f"a checkpoint of version {head['version']}; this is {__version__}, whose bits may differ"
            raise MechanismError(Finding(what, str(path), "finish it with that version, or start again"))
        if head["settings"] != settings(self._job):
            what = f"a checkpoint of another job: {_differences(head['settings'], self._job)}"
            raise MechanismError(Finding(what, str(path), "run it as it was begun, or name another file"))

    def _write(self, path: Path) -> None:
        start = perf_counter()
        arrays: dict[str, Any] = {TALLY + name: array for name, array in self.tally.to_arrays().items()}
        head = {"format": FORMAT, "version": __version__, "settings": settings(self._job)}
        head["arithmetic"] = sorted(self.arithmetic)
        arrays[HEAD] = np.frombuffer(json.dumps(head).encode(), np.uint8)
        arrays[DONE] = np.array(self.tally.blocks, np.int64).reshape(-1, 2)
        with whole(path) as temporary, temporary.open("wb") as file:
            np.savez_compressed(file, **arrays)
            file.flush()
            os.fsync(file.fileno())  # a power cut leaves the old file or the new one
        self._written = perf_counter()
        self._cost = self._written - start

    def perhaps(self) -> None:
        """Write if it is time to."""
        if perf_counter() - self._written >= max(INTERVAL, self._cost / SHARE):
            self.keep()

    def keep(self) -> None:
        """Write now. A full disk is no reason to lose the run: it is tried again later and `trouble` tells."""
        if self.path is None:
            return
        try:
            self._write(self.path)
            self.trouble = None
        except MechanismError as error:
            self._written = perf_counter()
            self.trouble = Finding(error.findings[0].what, str(self.path), severity=Severity.WARNING)
