"""A run on disk: the tally, which blocks it holds and of what job, in one file that is replaced as a whole."""

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
from trunnion.studies.tolerance.protocol import Job, T
from trunnion.studies.tolerance.ranges import count
from trunnion.version import __version__

__all__ = ["Checkpoint", "job_hash"]

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


def job_hash(job: Job[Any]) -> str:
    """SHA-256 of all that the answer depends on, hexadecimal."""
    return _hash(job.identity())


def _settings(job: Job[Any]) -> dict[str, Any]:
    """The identity in short, for messages: what is not a single value stands by its hash."""
    single = (str, int, float, bool, type(None))
    return {key: value if isinstance(value, single) else _hash(value) for key, value in job.identity().items()}


def _differences(there: Mapping[str, Any], here: Mapping[str, Any], job: Job[Any]) -> str:
    identity = job.identity()
    texts = []
    for key in sorted({*there, *here}):
        old, new = there.get(key), here.get(key)
        if old != new:
            single = not isinstance(identity.get(key), (Mapping, list, tuple))
            texts.append(f"{key} is {old} there and {new} here" if single else f"{key} differs")
    return "; ".join(texts)


class Checkpoint(Generic[T]):
    """One file for one job."""

    def __init__(self, path: str | os.PathLike[str], job: Job[T]) -> None:
        self.path = Path(path)
        self._job = job
        self._head = {"format": FORMAT, "version": __version__, "job": job_hash(job), "settings": _settings(job)}
        self._written = perf_counter()
        self._cost = 0.0
        self.arithmetic: set[str] = set()  # fingerprints of the machines that took part
        self.trouble: Finding | None = None

    def begin(self, resume: bool) -> T:
        """The tally to start from; MechanismError if the file cannot be used, or stands in the way."""
        if self.path.exists():
            if resume:
                return self._read()
            with suppress(MechanismError):
                tally = self._read()
                if not tally.blocks:  # left by a run that did not get under way
                    return tally
            remedy = "continue with --resume, delete the file, or name another one"
            raise MechanismError(Finding("the checkpoint is there already", str(self.path), remedy))
        empty = self._job.empty()
        self._write(empty)  # so that a folder that cannot be written to is known now and not after an hour
        return empty

    def _read(self) -> T:
        if self.path.is_file() and not is_zipfile(self.path):
            remedy = "name the file that the run was begun with, or another for a new run"
            raise MechanismError(
                Finding("cannot be read as a checkpoint: it is none, or its end is missing", str(self.path), remedy)
            )
        try:
            with self.path.open("rb") as stream, np.load(stream, allow_pickle=False) as file:
                head = json.loads(bytes(file[HEAD]))
                self._check(head)
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
            raise MechanismError(Finding(what, str(self.path), remedy)) from None
        return tally

    def _check(self, head: Mapping[str, Any]) -> None:
        """MechanismError unless it was written for this job by this version."""
        if head["format"] != FORMAT or head["version"] != self._head["version"]:
            what = f"a checkpoint of version {head['version']}; this is {self._head['version']}, whose bits may differ"
            raise MechanismError(Finding(what, str(self.path), "finish it with that version, or start again"))
        if head["job"] != self._head["job"]:
            what = f"a checkpoint of another job: {_differences(head['settings'], _settings(self._job), self._job)}"
            raise MechanismError(Finding(what, str(self.path), "run it as it was begun, or name another file"))

    def _write(self, tally: T) -> None:
        start = perf_counter()
        arrays: dict[str, Any] = {TALLY + name: array for name, array in tally.to_arrays().items()}
        head = self._head | {"arithmetic": sorted(self.arithmetic)}
        arrays[HEAD] = np.frombuffer(json.dumps(head).encode(), np.uint8)
        arrays[DONE] = np.array(tally.blocks, np.int64).reshape(-1, 2)
        with whole(self.path) as temporary, temporary.open("wb") as file:
            np.savez_compressed(file, **arrays)
            file.flush()
            os.fsync(file.fileno())  # a power cut leaves the old file or the new one
        self._written = perf_counter()
        self._cost = self._written - start

    def perhaps(self, tally: T) -> None:
        """Write if it is time to."""
        if perf_counter() - self._written >= max(INTERVAL, self._cost / SHARE):
            self.keep(tally)

    def keep(self, tally: T) -> None:
        """Write now. A full disk is no reason to lose the run: it is tried again later and `trouble` tells."""
        try:
            self._write(tally)
            self.trouble = None
        except MechanismError as error:
            self._written = perf_counter()
            self.trouble = Finding(error.findings[0].what, str(self.path), severity=Severity.WARNING)
