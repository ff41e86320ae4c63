"""What a seeded fault is."""

from __future__ import annotations

from typing import NamedTuple

__all__ = ["Fault"]


class Fault(NamedTuple):
    """One fault: its name, the file below src/trunnion, the text to find, what takes its place, and the tests."""

    name: str
    file: str
    find: str
    replacement: str
    tests: tuple[str, ...]
