"""Files written whole or not at all, and never over what is read.

A run of the program says once what it will write (`writing`); every reader says what it reads (`reading`). So no output
is an input of the run, whatever the two are called and wherever the input was named, and this is known before anything
is computed. What a run writes beyond what it said, such as the figures of a folder, is looked at when it is written.
"""

from __future__ import annotations

import os
import secrets
import shutil
import stat
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass, field
from itertools import combinations
from pathlib import Path

from trunnion.errors import Finding, MechanismError

REMEDY = "name another file"
UMASK = os.umask(0)  # read once: reading it means setting it, for the whole process
os.umask(UMASK)


# ---- what is read and what is written -------------------------------------------------------------------------


@dataclass(frozen=True)
class Target:
    """A file to be written, the option that names it, and the input that it may be nevertheless."""

    option: str
    path: Path
    over: Path | None = None


@dataclass
class _Run:
    """What a run of the program has said that it writes, and has read so far."""

    written: Sequence[Target]
    read: list[Path] = field(default_factory=list)

    def findings(self, path: Path, targets: Sequence[Target]) -> list[Finding]:
        """Which targets an input would be lost to."""
        return [Finding(f"{_called(target.path, path)} is read here, and would be written over"
                        + f" by {target.option}" * bool(target.option), "", REMEDY) for target in targets
                if same(target.path, path) and not (target.over and same(target.over, path))]  # fmt: skip


def _called(written: Path, read: Path) -> str:
    """A file by the name it is written under, and the other that it has."""
    return f"'{written}'" if str(written) == str(read) else f"'{written}', which is '{read}',"


_RUN: ContextVar[_Run | None] = ContextVar("run", default=None)


@contextmanager
def writing(targets: Sequence[Target]) -> Iterator[None]:
    """A run that writes these; MechanismError if two are one file, or, while it lasts, if one is read."""
    findings = [Finding(f"{_called(two.path, first.path)} is written by {first.option} already", two.option, REMEDY)
                for first, two in combinations(targets, 2) if same(first.path, two.path)]  # fmt: skip
    if findings:
        raise MechanismError(findings)
    before = _RUN.set(_Run(targets))
    try:
        yield
    finally:
        _RUN.reset(before)


def reading(path: str | os.PathLike[str]) -> None:
    """Say that a file is read; MechanismError if the run is to write it."""
    run = _RUN.get()
    if run is None:
        return
    path = Path(path)
    if findings := run.findings(path, run.written):
        raise MechanismError(findings)
    if path not in run.read:
        run.read.append(path)


def guard(path: Path) -> None:
    """MechanismError if something that the run has read would be written over."""
    run = _RUN.get()
    if run is None:
        return
    targets = [target for target in run.written if same(target.path, path)] or [Target("", path)]
    findings = [finding for read in run.read for finding in run.findings(read, targets)]
    if findings:
        raise MechanismError(findings)


def same(first: Path, two: Path) -> bool:
    """Whether two paths are one file, under another name or through links; a device or a pipe is nobody's."""
    try:
        kind = first.stat().st_mode
        return (stat.S_ISREG(kind) or stat.S_ISDIR(kind)) and two.exists() and first.samefile(two)
    except (OSError, ValueError):
        return not two.exists() and os.path.realpath(first) == os.path.realpath(two)


# ---- writing --------------------------------------------------------------------------------------------------


@contextmanager
def whole(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary path with the extension of `path`, whose place it takes when the block ends well.

    A link stays a link: what it leads to is written. A file that is replaced hands on its permissions. A device or a
    pipe is written to and stays what it is. Raises MechanismError if the folder is missing or not writable, `path` is
    a folder, or it is read in this run.
    """
    destination = Path(path)
    guard(destination)
    with _unwritable(destination):
        target = _destination(destination)
    folder = target.parent if target else Path(tempfile.gettempdir())
    draft = f".{destination.stem[:40]}-{secrets.token_hex(4)}{destination.suffix}"
    temporary = folder / draft  # known before it is there
    try:
        with _unwritable(destination, "make the folder first, or write elsewhere"):
            os.close(os.open(temporary, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
        with _unwritable(destination):
            yield temporary
            if target is None:
                _poured(temporary, destination)
                return
            temporary.chmod(_mode(temporary, target))
            temporary.replace(target)
    finally:
        if temporary.is_dir():
            shutil.rmtree(temporary, ignore_errors=True)
        with suppress(OSError):  # it was not made, or has taken its place
            temporary.unlink()


def _mode(made: Path, target: Path) -> int:
    """The permissions of what is replaced; else those of any new file or folder, for a draft is private."""
    try:
        return target.stat().st_mode & 0o777
    except FileNotFoundError:
        return (0o777 if made.is_dir() else 0o666) & ~UMASK


@contextmanager
def _unwritable(path: Path, remedy: str = "") -> Iterator[None]:
    """What the system refuses is a finding about the file."""
    try:
        yield
    except OSError as error:
        raise MechanismError(Finding(f"cannot be written: {error.strerror or error}", str(path), remedy)) from None


def _destination(path: Path) -> Path | None:
    """The file to be replaced, behind all links; None for what is written to: a device, a pipe, where output goes."""
    if path.is_dir():
        raise MechanismError(Finding("cannot be written: it is a folder", str(path), "name a file"))
    target = Path(os.path.realpath(path))
    try:
        there = path.stat()
    except FileNotFoundError:
        return target
    return target if stat.S_ISREG(there.st_mode) and not _is_output(path) else None


def _is_output(path: Path) -> bool:
    """Whether a file, or what it leads to, is where the output of the program goes."""
    with suppress(OSError):  # of a program without an output
        return os.path.samestat(path.stat(), os.fstat(1))
    return False


def _poured(temporary: Path, path: Path) -> None:
    """Write what was made into a device or a pipe, or behind what the output of the program has."""
    if temporary.is_dir():
        what = "cannot be written: a folder of files does not go through a pipe"
        raise MechanismError(Finding(what, str(path), "name a file"))
    sys.stdout.flush()
    target = os.dup(1) if _is_output(path) else os.open(path, os.O_WRONLY)  # by one descriptor they go on in turn
    with open(target, "wb") as stream, temporary.open("rb") as made:
        shutil.copyfileobj(made, stream)


def folder(path: Path) -> None:
    """Make a folder of figures; MechanismError if it cannot be one."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        what = f"cannot be made a folder: {error.strerror or error}"
        raise MechanismError(Finding(what, str(path), "name a folder, or a .png, .svg or .pdf file")) from None


def cache_directory(engine: str) -> Path:
    """Where what an engine has compiled is kept between runs: in the user's cache directory."""
    if sys.platform == "win32":
        base = Path(os.environ.get("LOCALAPPDATA") or _home() / "AppData" / "Local")
    elif sys.platform == "darwin":
        base = _home() / "Library" / "Caches"
    else:
        base = Path(os.environ.get("XDG_CACHE_HOME") or _home() / ".cache")
    return base / "trunnion" / engine


def _home() -> Path:
    """The user's home folder; of a user without one, a place in which no folder can be made."""
    try:
        return Path.home()
    except RuntimeError:
        return Path(os.devnull)
