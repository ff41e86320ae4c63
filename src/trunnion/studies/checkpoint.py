"""Finished blocks of a run in a folder, so that a run that was stopped does not do them again.

`job.json` says of which job the folder is; every block is a file in the format of `numpy.savez`, which is moved to its
place whole. Its checksums tell a file that was damaged: that block is done again.
"""

from __future__ import annotations

import hashlib
import json
import os
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.version import __version__

if TYPE_CHECKING:
    from trunnion.studies.job import Job, Part

__all__ = ["Checkpoint", "settings"]

HEAD = "job.json"


class Checkpoint:
    """The parts of a job that are done, in memory by block, and in a folder if there is a path.

    trouble: why the folder could not be written to the end; the run goes on without it.
    """

    def __init__(self, path: str | os.PathLike[str] | None, job: Job) -> None:
        self.parts: dict[int, Part] = {}
        self.trouble: Finding | None = None
        self.folder = None if path is None else Path(path)
        if self.folder is not None:
            try:
                self._open(self.folder, job)
            except OSError as error:
                what = f"cannot be used as a checkpoint: {error.strerror or error}"
                raise MechanismError(Finding(what, str(path), "name another folder")) from None

    def add(self, block: int, part: Part) -> None:
        """Keep the part of one more block."""
        self.parts[block] = part
        if self.folder is None or self.trouble is not None:
            return
        stream = BytesIO()
        np.savez(stream, allow_pickle=False, **part)
        try:
            _write(self.folder / f"{block}.npz", stream.getvalue())
        except OSError as error:  # a full disk is no reason to lose the run
            what = f"blocks are not kept from here on: {error.strerror or error}"
            self.trouble = Finding(what, str(self.folder), severity=Severity.WARNING)

    def _open(self, folder: Path, job: Job) -> None:
        """Read what the folder holds, or begin it. MechanismError if it is of another job, or no checkpoint."""
        folder.mkdir(exist_ok=True)
        now = settings(job)
        if not any(folder.iterdir()):
            _write(folder / HEAD, json.dumps(now).encode())
        try:
            before = json.loads((folder / HEAD).read_bytes())
        except (FileNotFoundError, ValueError):
            remedy = "name the folder that the run was begun with, or another for a new run"
            raise MechanismError(Finding("is no checkpoint", str(folder), remedy)) from None
        differing = [key for key in sorted({*before, *now}) if before.get(key) != now.get(key)]
        if differing:
            texts = (f"{key} is {before.get(key)} there and {now.get(key)} here" for key in differing)
            what, remedy = "a checkpoint of another job: " + "; ".join(texts), "run it as it was begun, or name another"
            raise MechanismError(Finding(what, str(folder), f"{remedy} folder"))
        for file in folder.glob("*.npz"):
            try:
                with file.open("rb") as stream, np.load(stream, allow_pickle=False) as arrays:
                    self.parts[int(file.stem)] = dict(arrays)
            except Exception:  # a damaged file raises almost anything; its block is done again
                self.parts.pop(int(file.stem), None)


def _write(place: Path, raw: bytes) -> None:
    """Write a file that is there whole or not at all."""
    partial = place.with_suffix(".part")
    partial.write_bytes(raw)
    partial.replace(place)


def settings(job: Job) -> dict[str, Any]:
    """All that the answer depends on, by name; what is not a single value stands by its SHA-256, in 12 digits."""
    single = (str, int, float, bool, type(None))
    identity = {"version": __version__, **job.identity()}
    return {key: value if isinstance(value, single) else _hash(value) for key, value in identity.items()}


def _hash(value: object) -> str:
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def _plain(value: object) -> object:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"{value!r} in the identity of a job has no JSON")
