"""Files written whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from trunnion.errors import Finding, MechanismError

__all__ = ["whole"]


@contextmanager
def whole(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary path beside `path`, with its extension; it takes the place of `path` when the block ends well.

    Raises MechanismError if the folder is missing or not writable, or `path` is a folder.
    """
    target = Path(path)
    if target.is_dir():
        raise MechanismError(Finding("is a folder", str(target), "name a file"))
    try:
        handle, name = tempfile.mkstemp(suffix=target.suffix, prefix=f".{target.stem[:40]}-", dir=target.parent)
        os.close(handle)
    except OSError as error:
        remedy = "make the folder first, or write elsewhere"
        raise MechanismError(Finding(f"cannot be written: {error.strerror or error}", str(target), remedy)) from None
    temporary = Path(name)
    try:
        yield temporary
        temporary.chmod(0o666 & ~_umask())  # mkstemp makes it private; a result is an ordinary file
        temporary.replace(target)
    except OSError as error:
        raise MechanismError(Finding(f"cannot be written: {error.strerror or error}", str(target))) from None
    finally:
        temporary.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
