"""What is found and done while the files are read: findings with their file, and sentences for a report."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, Severity, counted

__all__ = ["Account", "counted", "few_digits", "gathered", "places", "runs", "times", "told"]

FILES = 4  # named in a sentence


@dataclass
class Account:
    """Findings about one data file, and what was done to its data.

    recorded: turns that the driver goes through; left_out: whole ones that are not used.
    """

    file: str
    findings: list[Finding] = field(default_factory=list)
    done: dict[str, list[float | str]] = field(default_factory=dict)
    recorded: float = 0.0
    left_out: int = 0
    failed: bool = False

    def warn(self, code: str, where: str, what: str, remedy: str, severity: Severity = Severity.WARNING) -> None:
        """A fault of the data."""
        self.findings.append(Finding(what, where, remedy, severity, file=self.file, code=code))

    def note(self, code: str, where: str, what: str, remedy: str = "") -> None:
        """Something to know."""
        self.warn(code, where, what, remedy, Severity.NOTE)

    def error(self, code: str, where: str, what: str, remedy: str) -> None:
        """Why there is no result of this part."""
        self.warn(code, where, what, remedy, Severity.ERROR)

    def say(self, sentence: str, value: float | str | None = None) -> None:
        """Something that was done; `{}` in the sentence stands for a value, which may differ from file to file."""
        self.done.setdefault(sentence, []).extend([] if value is None else [value])


def few_digits(number: float, digits: int = 2) -> str:
    """A number to so many digits, without a power of ten as far as that is readable."""
    return f"{float(f'{number:.{digits}g}'):,.6g}"


def told(accounts: Sequence[Account]) -> list[str]:
    """What was done to the files of accounts, each sentence once, with the files where it is not all of them."""
    sentences = list(dict.fromkeys(sentence for one in accounts for sentence in one.done))
    found = []
    for sentence in sentences:
        said = [one for one in accounts if sentence in one.done]
        values = [(value, Path(one.file).name) for one in said for value in one.done[sentence]]
        low, high = _ends(values) if values else ("", "")
        text = sentence.replace("{}", low if low == high else f"{low} to {high}")
        names = [Path(one.file).name for one in said]
        most = ", ".join(names[:FILES]) + (f" and {len(names) - FILES} more" if len(names) > FILES else "")
        found.append(text if len(said) == len(accounts) else f"{most}: {text}")
    return found


def gathered(findings: Iterable[Finding], same: bool = False) -> list[Finding]:
    """Findings about data files, those of one code and place only told once, with the files they are of.

    same: only those that say the same; else the first speaks for all.
    """
    alike: dict[tuple[str, ...], list[Finding]] = {}
    for one in findings:
        key = one.severity, one.where.partition(" ")[0], one.code, one.remedy, one.what if same else ""
        alike.setdefault(key, []).append(one)
    found = []
    for rows in alike.values():
        first, files = rows[0], list(dict.fromkeys(Path(one.file).name for one in rows if one.file))
        if len(rows) > 1:
            where = first.where if len({one.where for one in rows}) == 1 else f"{first.where.partition(' ')[0]}s"
            some = ", ".join(files[:4]) + (", …" if len(files) > 4 else "")
            what = f"{first.what} — {len(rows)} such findings" + (f": {some}" if files else "")
            first = replace(first, what=what, where=where, file="", line=None)
        found.append(first)
    return found


def _ends(values: Sequence[tuple[float | str, str]]) -> tuple[str, str]:
    """The least and the largest of numbers; the first and the last of texts, with their files where they differ."""
    numbers = [value for value, _ in values if not isinstance(value, str)]
    if len(numbers) == len(values):
        return few_digits(min(numbers)), few_digits(max(numbers))
    (first, file), (last, other) = values[0], values[-1]
    return (str(first), str(last)) if first == last else (f"{first} in {file}", f"{last} in {other}")


def runs(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """First place and length of every stretch of a mask that is true."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    return edges[::2], edges[1::2] - edges[::2]


def times(found: Sequence[float] | NDArray[np.float64], most: int = 3) -> str:
    """Some times in words."""
    told = ", ".join(f"{t:.5g}" for t in found[:most])
    return f"at {told}{', …' if len(found) > most else ''} s"


def places(mask: NDArray[np.bool_], time: NDArray[np.float64]) -> str:
    """Where the stretches of a mask are: how many, where the first, how long the longest."""
    starts, lengths = runs(mask)
    if starts.size <= 3:
        where = times(time[starts])
    else:
        where = f"in {starts.size:,} places from {time[starts[0]]:.5g} to {time[starts[-1]]:.5g} s"
    longest = int(np.argmax(lengths))
    if lengths[longest] < 3:
        return where
    last = min(starts[longest] + lengths[longest], time.size - 1)
    span = f"{time[last] - time[starts[longest]]:.3g} s"
    return (
        f"{where} for {span}" if starts.size == 1 else f"{where}, the longest {span} at {time[starts[longest]]:.5g} s"
    )
