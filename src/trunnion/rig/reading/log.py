"""What is found while data files are read: warnings and notes, where in time they are, and the same ones only once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, Severity, counted

__all__ = ["at_times", "counted", "gathered", "note", "places", "runs", "warning"]


def warning(code: str, where: str, what: str, remedy: str = "") -> Finding:
    """A fault of the data."""
    return Finding(what, where, remedy, Severity.WARNING, code=f"data.{code}")


def note(code: str, where: str, what: str, remedy: str = "") -> Finding:
    """Something to know."""
    return Finding(what, where, remedy, Severity.NOTE, code=f"data.{code}")


def gathered(findings: Iterable[Finding], same: bool = False) -> list[Finding]:
    """Findings about data files, those of one code and place only once, with the files they are of.

    same: only those that say the same; else the first speaks for all.
    """
    groups: dict[tuple[str, ...], list[Finding]] = {}
    for one in findings:
        key = one.severity, one.where.partition(" ")[0], one.code, one.remedy, one.what if same else ""
        groups.setdefault(key, []).append(one)
    merged = []
    for group in groups.values():
        first, files = group[0], list(dict.fromkeys(Path(one.file).name for one in group if one.file))
        if len(group) > 1:
            where = first.where if len({one.where for one in group}) == 1 else f"{first.where.partition(' ')[0]}s"
            some = ", ".join(files[:4]) + (", …" if len(files) > 4 else "")
            what = f"{first.what} — {len(group)} such findings" + (f": {some}" if files else "")
            first = replace(first, what=what, where=where, file="", line=None)
        merged.append(first)
    return merged


def runs(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First place and length of every stretch of a mask that is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return edges[::2], edges[1::2] - edges[::2]


def at_times(seconds: Sequence[float] | NDArray[np.float64], most: int = 3) -> str:
    """Some times in words."""
    return f"at {', '.join(f'{t:.5g}' for t in seconds[:most])}{', …' if len(seconds) > most else ''} s"


def places(mask: NDArray[np.bool_], time: NDArray[np.float64]) -> str:
    """Where the stretches of a mask are: the first times, and how long the longest is."""
    starts, lengths = runs(mask)
    longest = int(np.argmax(lengths))
    if lengths[longest] < 3:
        return at_times(time[starts])
    end = min(starts[longest] + lengths[longest], time.size - 1)
    return f"{at_times(time[starts])}, up to {time[end] - time[starts[longest]]:.3g} s long"
