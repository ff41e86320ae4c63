"""Files of strangers as text: of bounded size, UTF-8, not empty."""

from __future__ import annotations

from pathlib import Path

from trunnion.errors import Finding, MechanismError
from trunnion.files import reading

__all__ = ["read_text"]


def read_text(path: Path, kind: str, limit: int, start_from: str) -> str:
    """The content of a file, at most `limit` bytes; MechanismError says what it is not.

    kind: what it should be, with its article; start_from: remedy for an empty one.
    """
    reading(path)
    try:
        if path.exists() and not path.is_file():
            raise MechanismError(Finding("is not a file", remedy=f"name {kind}"))
        with path.open("rb") as stream:
            raw = stream.read(limit + 1)
        if len(raw) > limit:
            what = f"has {max(path.stat().st_size, len(raw)) / 1e6:.1f} MB, {kind} at most {limit / 1e6:.1f} MB"
            raise MechanismError(Finding(what, remedy=f"check that it is {kind}, or make it smaller"))
    except MechanismError:
        raise
    except (OSError, ValueError) as error:
        reason = str(getattr(error, "strerror", None) or error)
        raise MechanismError(Finding(f"cannot be read: {reason}", remedy="check the path")) from error
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        what = f"is not UTF-8 text (byte {error.start})"
        raise MechanismError(Finding(what, remedy="save it as UTF-8", line=line)) from error
    if not text.strip():
        raise MechanismError(Finding("is empty", remedy=start_from, line=1))
    return text
