"""Finished blocks of a run in one file that grows, so that a run that was stopped does not do them again.

Every record is its length, its CRC-32 and its bytes: the first says of which job the file is, each of the others holds
a block in the format of `numpy.savez`. A run that was killed while it wrote leaves a record without its end, which is
dropped.
"""

from __future__ import annotations

import errno
import hashlib
import json
import os
import struct
import zlib
from collections.abc import Iterator, Mapping
from io import BytesIO, FileIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.version import __version__

if TYPE_CHECKING:
    from trunnion.studies.job import Job, Part

__all__ = ["Checkpoint", "settings"]

HEAD = struct.Struct("<4sQI")  # of a record: mark, length, CRC-32
MARK = b"trnc"
BLOCK = "block number"  # its name among the arrays of a part
SHORT = 1 << 20  # bytes, which what is said of a job never has


class Checkpoint:
    """The parts of a job that are done, in memory by block, and in a file if there is a path.

    trouble: why the file could not be written to the end; the run goes on without it.
    """

    def __init__(self, path: str | os.PathLike[str] | None, job: Job) -> None:
        self.parts: dict[int, Part] = {}
        self.trouble: Finding | None = None
        self._file: FileIO | None = None
        if path is not None:
            try:
                self._open(Path(path), job)
            except MechanismError:
                self.__exit__()
                raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._file is not None:
            self._file.close()

    def add(self, block: int, part: Part) -> None:
        """Keep the part of one more block."""
        self.parts[block] = part
        if self._file is None or self.trouble is not None:
            return
        stream = BytesIO()
        np.savez(stream, allow_pickle=False, **{**part, BLOCK: np.array(block)})
        try:
            self._write(stream.getvalue())
        except OSError as error:  # a full disk is no reason to lose the run
            what = f"blocks are not kept from here on: {error.strerror or error}"
            self.trouble = Finding(what, self._file.name, severity=Severity.WARNING)

    def _write(self, raw: bytes) -> None:
        """Add a record. OSError if it does not go in whole."""
        assert self._file is not None
        record = HEAD.pack(MARK, len(raw), zlib.crc32(raw)) + raw
        if self._file.write(record) != len(record):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    def _open(self, path: Path, job: Job) -> None:
        """Read the file and go on at its end, or begin it. MechanismError if it is of another job, or no checkpoint."""
        try:
            self._file = path.open("a+b", buffering=0)
            self._file.seek(0)
            records = _records(self._file)
            head = next(records, None)
            if head is None and _begun(self._file):
                self._file.truncate(0)
                self._write(json.dumps(settings(job)).encode())
                return
            if head is None:
                remedy = "name the file that the run was begun with, or another for a new run"
                raise MechanismError(Finding("is no checkpoint", str(path), remedy))
            if differences := _differences(json.loads(head), job):
                what, remedy = f"a checkpoint of another job: {differences}", "run it as it was begun, or name another"
                raise MechanismError(Finding(what, str(path), f"{remedy} file"))
            end = self._file.tell()
            for raw in records:
                with np.load(BytesIO(raw), allow_pickle=False) as file:
                    part = dict(file)
                self.parts[int(part.pop(BLOCK))] = part
                end = self._file.tell()
            self._file.truncate(end)
        except OSError as error:
            what = f"cannot be used as a checkpoint: {error.strerror or error}"
            raise MechanismError(Finding(what, str(path), "name another file")) from None


def _records(file: FileIO) -> Iterator[bytes]:
    """The whole records from here to the first that is damaged or has no end."""
    while len(head := file.read(HEAD.size)) == HEAD.size:
        mark, length, check = HEAD.unpack(head)
        raw = file.read(length) if mark == MARK and length <= os.fstat(file.fileno()).st_size else b""
        if len(raw) != length or zlib.crc32(raw) != check:
            return
        yield raw


def _begun(file: FileIO) -> bool:
    """Whether a file holds nothing, or the beginning of its first record and no more."""
    file.seek(0)
    head, size = file.read(HEAD.size), os.fstat(file.fileno()).st_size
    if len(head) < HEAD.size:
        return head[: len(MARK)] == MARK[: len(head)]
    mark, length, _ = HEAD.unpack(head)
    return bool(mark == MARK and size < HEAD.size + length < SHORT)


def settings(job: Job) -> dict[str, Any]:
    """All that the answer depends on, by name; what is not a single value stands by its SHA-256, hexadecimal."""
    single = (str, int, float, bool, type(None))
    identity = {"version": __version__, **job.identity()}
    return {key: value if isinstance(value, single) else _hash(value) for key, value in identity.items()}


def _hash(value: object) -> str:
    text = json.dumps(value, sort_keys=True, separators=(",", ":"), default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()


def _plain(value: object) -> object:
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    raise TypeError(f"{value!r} in the identity of a job has no JSON")


def _differences(before: Mapping[str, Any], job: Job) -> str:
    """In what a checkpoint's job differs from this one."""
    identity, now, texts = job.identity(), settings(job), []
    for key in sorted({*before, *now}):
        if before.get(key) != now.get(key):
            several = isinstance(identity.get(key), (Mapping, list, tuple, np.ndarray))
            other = f"{key} not the same"
            texts.append(other if several else f"{key} is {before.get(key)} there and {now.get(key)} here")
    return "; ".join(texts)
