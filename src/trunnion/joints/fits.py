"""Limits and fits of ISO 286: the deviations of holes and shafts up to 500 mm by tolerance class.

The numbers are those of the tables of ISO 286-1:2010 (standard tolerance grades IT, fundamental deviations of shafts
and holes); their sums are those that ISO 286-2:2010 lists. The tables are kept and not the formulas behind them, since
the standard rounds case by case. What is not here (other letters, grades above IT16, sizes above 500 mm) is a finding.
"""

from __future__ import annotations

import csv
import re
from bisect import bisect_left
from dataclasses import dataclass
from pathlib import Path

from trunnion.errors import Finding, MechanismError

# Ranges of nominal size, mm: each begins above the entry before and includes its own. The steps between are for
# letters whose deviation changes faster with the size.
SIZES = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
STEPS = (3, 6, 10, 14, 18, 24, 30, 40, 50, 65, 80, 100, 120, 140, 160, 180, 200, 225, 250, 280, 315, 355, 400, 450, 500)


def _tables() -> dict[str, dict[str, tuple[float | None, ...]]]:
    """The rows of `iso286.csv`, µm, by table and by grade or letter.

    IT: standard tolerances. upper, lower: fundamental deviations of shafts, the upper one below zero of c to h, the
    lower one above zero of k to u; k is that of IT4 to IT7. shaft j, hole J: they lie about the nominal size, unevenly:
    lower deviations of j, below zero, and upper ones of J. delta: how much less holes K to N up to IT8 and P to U up to
    IT7 interfere than the shafts of their letters, so that such a hole with a shaft h one grade finer fits as the shaft
    does in a hole H.
    """
    tables: dict[str, dict[str, tuple[float | None, ...]]] = {}
    with (Path(__file__).parent / "iso286.csv").open(encoding="utf-8", newline="") as file:
        for table, key, *entries in csv.reader(line for line in file if not line.startswith("#")):
            tables.setdefault(table, {})[key] = tuple(float(entry) if entry else None for entry in entries)
    return tables


_TABLES = _tables()
GRADES = {int(grade): row for grade, row in _TABLES["IT"].items()}
UPPER, LOWER = _TABLES["upper"], _TABLES["lower"]
SHAFTS = (*UPPER, "j", "js", *LOWER)
HOLES = tuple(letter.upper() for letter in SHAFTS)
M6_SPECIAL = (250, 315, -9.0)  # mm, mm, µm: where the standard departs from its own rule (which gives −11)


@dataclass(frozen=True)
class FitLimits:
    """A fit in numbers, m: deviations (lower, upper) of hole and shaft from the size, and the play on the diameter.

    Interference is negative play.
    """

    hole_limits: tuple[float, float]
    shaft_limits: tuple[float, float]
    minimum: float
    mean: float
    maximum: float


def fit(size: float, hole: str, shaft: str) -> FitLimits:
    """The play of a fit such as 25 mm H7/g6; MechanismError says what a class lacks. size: nominal diameter, m."""
    if hole != hole.upper() or shaft != shaft.lower():
        raise MechanismError(Finding(f"'{hole}/{shaft}' is not hole and shaft", remedy="write H7/g6, the hole first"))
    bore, pin = _deviations(size, hole), _deviations(size, shaft)
    least, most = bore[0] - pin[1], bore[1] - pin[0]
    play = (_metre(limit) for limit in (least, (least + most) / 2, most))
    return FitLimits(limits(size, hole), limits(size, shaft), *play)


def limits(size: float, tolerance_class: str) -> tuple[float, float]:
    """Lower and upper deviation, m, of a class such as H7 (a hole) or g6 (a shaft) at a nominal diameter, m."""
    lower, upper = _deviations(size, tolerance_class)
    return _metre(lower), _metre(upper)


def standard_tolerance(size: float, grade: int) -> float:
    """Width, m, of the tolerance of an IT grade at a nominal size, m: the whole, from limit to limit."""
    lower, upper = limits(size, f"js{grade}")
    return upper - lower


def _metre(micrometres: float) -> float:
    """Rounded once: 21 µm is the float 21e-6."""
    return round(micrometres * 1000) / 1e9


def _deviations(size: float, tolerance_class: str) -> tuple[float, float]:
    """(lower, upper), µm."""
    match = re.fullmatch(r"([A-Za-z]{1,2})([0-9]{1,2})", tolerance_class)
    letter, grade = (match[1], int(match[2])) if match else ("", 0)
    kind, letters = ("holes", HOLES) if tolerance_class[:1].isupper() else ("shafts", SHAFTS)
    diameter = round(size * 1e3, 9)  # mm; without the rounding of the conversion, which could pass a limit
    for missing, what, remedy in (
        (letter not in letters, f"the class '{tolerance_class[:20]}' is not in the tables",
         f"the letters of {kind} are {', '.join(letters)}"),
        (grade not in GRADES, f"the grade of '{tolerance_class[:20]}' is not in the tables",
         f"the grades are 1 to {max(GRADES)}"),
        (not 0 < diameter <= SIZES[-1], f"the size {diameter:g} mm is not in the tables",
         f"the tables cover sizes above 0 up to {SIZES[-1]} mm"),
        (grade >= 14 and diameter <= 1, f"there is no '{tolerance_class[:20]}' of {diameter:g} mm",
         "grades from 14 on begin above 1 mm"),
    ):  # fmt: skip
        if missing:
            raise MechanismError(Finding(what, remedy=remedy))
    width = _entry("IT", grade, diameter, letter)
    if letter in ("js", "JS"):
        return -width / 2, width / 2
    shaft = letter.lower()
    if letter.islower():
        if letter in UPPER:
            upper = -_entry("upper", letter, diameter, letter)
            return upper - width, upper
        if letter == "j":
            lower = -_entry("shaft j", grade, diameter, letter)
        else:
            lower = 0.0 if letter == "k" and not 4 <= grade <= 7 else _entry("lower", letter, diameter, letter)
        return lower, lower + width
    if shaft in UPPER:
        lower = _entry("upper", shaft, diameter, letter)
        return lower, lower + width
    upper = _upper_of_hole(letter, grade, diameter)
    return upper - width, upper


def _upper_of_hole(letter: str, grade: int, diameter: float) -> float:
    """The upper deviation, µm, of holes J to U."""
    last = 8 if letter in "KMN" else 7  # the coarsest grade with Δ
    if letter == "J":
        return _entry("hole J", grade, diameter, letter)
    if letter == "N" and grade > last and diameter > SIZES[0]:
        return 0.0
    if letter == "M" and grade == 6 and M6_SPECIAL[0] < diameter <= M6_SPECIAL[1]:
        return M6_SPECIAL[2]
    delta = _entry("delta", grade, diameter, letter) if grade <= last or letter == "K" else 0.0
    return delta - _entry("lower", letter.lower(), diameter, letter)


def _entry(table: str, key: int | str, diameter: float, letter: str) -> float:
    """Of a row of a table at a diameter, mm, for a letter; some have a few grades, or begin at a larger size."""
    rows = _TABLES[table]
    if str(key) not in rows:
        first, *_, last = map(int, rows)
        remedy = f"'{letter}' begins at grade {first}" if int(key) < first else f"'{letter}' ends at grade {last}"
        raise MechanismError(Finding(f"there is no '{letter}{key}' in the tables", remedy=remedy))
    row = rows[str(key)]
    entry = row[bisect_left(SIZES if len(row) == len(SIZES) else STEPS, diameter)]
    if entry is None:
        above = next(STEPS[place - 1] for place, number in enumerate(row) if number is not None)
        remedy = f"it begins above {above} mm; use '{'u' if letter.islower() else 'U'}'"
        raise MechanismError(Finding(f"there is no '{letter}' of {diameter:g} mm", remedy=remedy))
    return entry
