"""Files written whole or not at all."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from trunnion.errors import Finding, MechanismError

__all__ = ["folder", "whole"]


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


def folder(path: Path) -> None:
    """Make a folder of figures; MechanismError if it cannot be one."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        what = f"cannot be made a folder: {error.strerror or error}"
        raise MechanismError(Finding(what, str(path), "name a folder, or a .png, .svg or .pdf file")) from None
