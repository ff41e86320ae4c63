"""Files written whole or not at all, and never over what is read."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from trunnion.errors import Finding, MechanismError

__all__ = ["folder", "spare", "whole"]


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


UMASK = _umask()  # read once: reading it means setting it, for the whole process


@contextmanager
def whole(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary path beside `path`, with its extension; it takes the place of `path` when the block ends well.

    Raises MechanismError if the folder is missing or not writable, or `path` is a folder.
    """
    target = Path(path)
    if target.is_dir():
        raise MechanismError(Finding("cannot be written: it is a folder", str(target), "name a file"))
    try:
        handle, name = tempfile.mkstemp(suffix=target.suffix, prefix=f".{target.stem[:40]}-", dir=target.parent)
        os.close(handle)
    except OSError as error:
        remedy = "make the folder first, or write elsewhere"
        raise MechanismError(Finding(f"cannot be written: {error.strerror or error}", str(target), remedy)) from None
    temporary = Path(name)
    try:
        yield temporary
        mode = 0o777 if temporary.is_dir() else 0o666  # mkstemp makes it private; a result is an ordinary file
        temporary.chmod(mode & ~UMASK)
        temporary.replace(target)
    except OSError as error:
        raise MechanismError(Finding(f"cannot be written: {error.strerror or error}", str(target))) from None
    finally:
        if temporary.is_dir():
            shutil.rmtree(temporary, ignore_errors=True)
        temporary.unlink(missing_ok=True)


def spare(read: Iterable[Path], written: Iterable[tuple[str, Path]]) -> None:
    """MechanismError if a file that is to be written, by the option that names it, is one of those that are read.

    A link to one counts as well.
    """
    kept = [one for one in read if one.exists()]
    findings = []
    for option, path in written:
        if path.exists() and any(path.samefile(one) for one in kept):
            what = f"'{path}' is read here, and would be written over"
            findings.append(Finding(what, option, "name another file"))
    if findings:
        raise MechanismError(findings)


def folder(path: Path) -> None:
    """Make a folder of figures; MechanismError if it cannot be one."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        what = f"cannot be made a folder: {error.strerror or error}"
        raise MechanismError(Finding(what, str(path), "name a folder, or a .png, .svg or .pdf file")) from None
