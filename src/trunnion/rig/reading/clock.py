"""Times of day and time stamps in cells of text: `11:40:00,0002`, `22.11.2026 11:40:00.5`, `2026-11-22T11:40:00Z`.

They are kept in whole nanoseconds: seconds since a year as floats would be off by more than a sample.

By hand: dateutil takes 18 times as long, stops at microseconds and takes "5" for a date; pandas wants one form stated.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import date
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Clock", "is_time"]

DAY = 86_400 * 10**9
NOT = np.iinfo(np.int64).min  # of a cell that is no time
_TIME = re.compile(
    r"(?:(?P<date>\d{1,4}[-./]\d{1,2}[-./]\d{1,4})[ T]\s*)?"
    r"(?P<hour>\d{1,2}):(?P<minute>[0-5]\d):(?P<second>[0-5]\d)(?:[.,](?P<part>\d{1,12}))?"
    r"(?:\s?(?P<noon>[AaPp])[Mm])?(?:\s?(?:Z|(?P<zone>[-+]\d\d):?(?P<off>\d\d)))?",
    re.ASCII,
)
_DATE = re.compile(r"(\d+)([-./])(\d+)\2(\d+)", re.ASCII)


def is_time(text: object) -> bool:
    """Whether a cell is a time of day or a time stamp."""
    return isinstance(text, str) and _TIME.fullmatch(text.strip()) is not None


@dataclass
class Clock:
    """The times of a column, piece by piece. dates: those met, with their number; first: the first cell that is one."""

    dates: dict[str, int] = field(default_factory=dict)
    first: str = ""
    _pieces: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = field(default_factory=list)

    def add(self, cells: Sequence[Any]) -> None:
        """The cells of the next rows."""
        days, within = np.zeros(len(cells), np.int64), np.full(len(cells), NOT)
        for place, cell in enumerate(cells):
            found = _TIME.fullmatch(cell.strip()) if isinstance(cell, str) else None
            if found is None or int(found["hour"]) > 23:
                continue
            self.first = self.first or cell.strip()
            days[place] = self.dates.setdefault(found["date"] or "", len(self.dates))
            within[place] = _of_day(found)
        self._pieces.append((days, within))

    @classmethod
    def picked(cls, told: Sequence[Any], places: NDArray[np.intp]) -> Clock:
        """The times of cells that are told by their place in a list; -1 where there is none."""
        clock = cls()
        clock.add([*told, None])
        days, within = clock._pieces.pop()
        clock._pieces.append((days[places], within[places]))
        return clock

    def known(self) -> NDArray[np.bool_]:
        """Which cells are times."""
        return np.concatenate([within != NOT for _, within in self._pieces])

    def cut(self, rows: int) -> None:
        """Keep the first rows only."""
        days, within = (np.concatenate(part)[:rows] for part in zip(*self._pieces, strict=True))
        self._pieces = [(days, within)]

    def seconds(self) -> NDArray[np.float64]:
        """Seconds since the first, NaN where there is none; ValueError, in words, where the dates tell no order.

        Without a date a step back by more than half a day is midnight.
        """
        days, within = (np.concatenate(part) for part in zip(*self._pieces, strict=True))
        known = np.flatnonzero(within != NOT)
        values = np.full(within.size, np.nan)
        if not known.size:
            return values
        ordinals = np.array(_ordinals(list(self.dates)), np.int64)
        told = (ordinals - ordinals.min())[days[known]] * DAY + within[known]
        if set(self.dates) == {""}:
            told += DAY * np.concatenate([[0], np.cumsum(np.diff(told) < -DAY // 2)])
        values[known] = (told - told[0]) * 1e-9
        return values


def _of_day(found: re.Match[str]) -> int:
    """Nanoseconds since midnight, of world time where the zone is told."""
    hour = int(found["hour"])
    if found["noon"]:
        hour = hour % 12 + 12 * (found["noon"] in "Pp")
    minutes = 60 * hour + int(found["minute"])
    if found["zone"]:
        minutes -= 60 * int(found["zone"]) + int(found["zone"][0] + found["off"])
    return (60 * minutes + int(found["second"])) * 10**9 + int((found["part"] or "").ljust(9, "0")[:9])


def _ordinals(dates: Sequence[str]) -> list[int]:
    """The number of the day of every date; all the same where there is none. ValueError if the order is not told."""
    if dates == [""]:
        return [0]
    for order in ("ymd", "dmy", "mdy"):
        found = [_ordinal(one, order) for one in dates]
        if None in found:
            continue
        other = [_ordinal(one, "mdy") for one in dates]
        if order == "dmy" and len(dates) > 1 and "." not in dates[0] and None not in other:
            raise ValueError(f"the dates, such as {dates[0]}, may begin with the day or with the month")
        return [one for one in found if one is not None]
    raise ValueError(f"the dates, such as {dates[0] or dates[-1]}, are not all dates of one form")


def _ordinal(text: str, order: str) -> int | None:
    """The number of the day; None if it is no date in this order."""
    found = _DATE.fullmatch(text)
    if not found:
        return None
    parts = dict(zip(order, (found[1], found[3], found[4]), strict=True))
    if len(parts["y"]) not in (2, 4) or (order == "ymd") != (len(found[1]) == 4):
        return None
    try:
        return date(int(parts["y"]) + 2000 * (len(parts["y"]) == 2), int(parts["m"]), int(parts["d"])).toordinal()
    except ValueError:
        return None
