"""Limits and fits of ISO 286: the deviations of holes and shafts up to 500 mm by tolerance class.

The numbers are those of the tables of ISO 286-1:2010 (standard tolerance grades IT, fundamental deviations of shafts
and holes); their sums are those that ISO 286-2:2010 lists. The tables are kept and not the formulas behind them, since
the standard rounds case by case. What is not here (other letters, grades above IT16, sizes above 500 mm) is a finding.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from dataclasses import dataclass

from trunnion.errors import Finding, MechanismError

__all__ = ["GRADES", "HOLES", "SHAFTS", "FitLimits", "fit", "limits", "standard_tolerance"]

# Ranges of nominal size, mm: each begins above the entry before and includes its own. The steps between are for
# letters whose deviation changes faster with the size.
SIZES = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
STEPS = (3, 6, 10, 14, 18, 24, 30, 40, 50, 65, 80, 100, 120, 140, 160, 180, 200, 225, 250, 280, 315, 355, 400, 450, 500)

# Standard tolerances, µm, one row a grade from IT1 on, one column a range of SIZES.
GRADES: dict[int, tuple[float, ...]] = dict(
    enumerate(
        (
            (0.8, 1, 1, 1.2, 1.5, 1.5, 2, 2.5, 3.5, 4.5, 6, 7, 8),
            (1.2, 1.5, 1.5, 2, 2.5, 2.5, 3, 4, 5, 7, 8, 9, 10),
            (2, 2.5, 2.5, 3, 4, 4, 5, 6, 8, 10, 12, 13, 15),
            (3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20),
            (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
            (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
            (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
            (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
            (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
            (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
            (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
            (100, 120, 150, 180, 210, 250, 300, 350, 400, 460, 520, 570, 630),
            (140, 180, 220, 270, 330, 390, 460, 540, 630, 720, 810, 890, 970),
            (250, 300, 360, 430, 520, 620, 740, 870, 1000, 1150, 1300, 1400, 1550),
            (400, 480, 580, 700, 840, 1000, 1200, 1400, 1600, 1850, 2100, 2300, 2500),
            (600, 750, 900, 1100, 1300, 1600, 1900, 2200, 2500, 2900, 3200, 3600, 4000),
        ),
        start=1,
    )
)

# Fundamental deviations of shafts, µm: the upper one, below zero, of c to h; the lower one, above zero, of k to u.
# A row has a column for each range of SIZES, or of STEPS.
UPPER: dict[str, tuple[int, ...]] = {
    "c": (60, 70, 80, 95, 95, 110, 110, 120, 130, 140, 150, 170, 180,
          200, 210, 230, 240, 260, 280, 300, 330, 360, 400, 440, 480),
    "d": (20, 30, 40, 50, 65, 80, 100, 120, 145, 170, 190, 210, 230),
    "e": (14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135),
    "f": (6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68),
    "g": (2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20),
    "h": (0,) * 13,
}  # fmt: skip
LOWER: dict[str, tuple[int | None, ...]] = {
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5),  # of IT4 to IT7; 0 in every other grade
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68),
    "r": (10, 15, 19, 23, 23, 28, 28, 34, 34, 41, 43, 51, 54,
          63, 65, 68, 77, 80, 84, 94, 98, 108, 114, 126, 132),
    "s": (14, 19, 23, 28, 28, 35, 35, 43, 43, 53, 59, 71, 79,
          92, 100, 108, 122, 130, 140, 158, 170, 190, 208, 232, 252),
    "t": (None, None, None, None, None, None, 41, 48, 54, 66, 75, 91, 104,
          122, 134, 146, 166, 180, 196, 218, 240, 268, 294, 330, 360),
    "u": (18, 23, 28, 33, 33, 41, 48, 60, 70, 87, 102, 124, 144,
          170, 190, 210, 236, 258, 284, 315, 350, 390, 435, 490, 540),
}  # fmt: skip
# j and J lie about the nominal size, unevenly: lower deviations of j, below zero, and upper ones of J, by grade.
SHAFT_J: dict[int, tuple[int, ...]] = {
    5: (2, 2, 2, 3, 4, 5, 7, 9, 11, 13, 16, 18, 20),
    6: (2, 2, 2, 3, 4, 5, 7, 9, 11, 13, 16, 18, 20),
    7: (4, 4, 5, 6, 8, 10, 12, 15, 18, 21, 26, 28, 32),
}
HOLE_J: dict[int, tuple[int, ...]] = {
    6: (2, 5, 5, 6, 8, 10, 13, 16, 18, 22, 25, 29, 33),
    7: (4, 6, 8, 10, 12, 14, 18, 22, 26, 30, 36, 39, 43),
    8: (6, 10, 12, 15, 20, 24, 28, 34, 41, 47, 55, 60, 66),
}
# Δ, µm, by grade: how much less holes K to N up to IT8 and P to U up to IT7 interfere than the shafts of their letters,
# so that such a hole with a shaft h one grade finer fits as the shaft does in a hole H.
DELTA: dict[int, tuple[float, ...]] = {
    3: (0, 1, 1, 1, 1.5, 1.5, 2, 2, 3, 3, 4, 4, 5),
    4: (0, 1.5, 1.5, 2, 2, 3, 3, 4, 4, 4, 4, 5, 5),
    5: (0, 1, 2, 3, 3, 4, 5, 5, 6, 6, 7, 7, 7),
    6: (0, 3, 3, 3, 4, 5, 6, 7, 7, 9, 9, 11, 13),
    7: (0, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    8: (0, 6, 7, 9, 12, 14, 16, 19, 23, 26, 29, 32, 34),
}
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
    return FitLimits(_metres(bore), _metres(pin), *(_metre(limit) for limit in (least, (least + most) / 2, most)))


def limits(size: float, tolerance_class: str) -> tuple[float, float]:
    """Lower and upper deviation, m, of a class such as H7 (a hole) or g6 (a shaft) at a nominal diameter, m."""
    return _metres(_deviations(size, tolerance_class))


def standard_tolerance(size: float, grade: int) -> float:
    """Width, m, of the tolerance of an IT grade at a nominal size, m: the whole, from limit to limit."""
    lower, upper = limits(size, f"js{grade}")
    return upper - lower


def _metre(micrometres: float) -> float:
    """Rounded once: 21 µm is the float 21e-6."""
    return round(micrometres * 1000) / 1e9


def _metres(pair: tuple[float, float]) -> tuple[float, float]:
    return _metre(pair[0]), _metre(pair[1])


def _deviations(size: float, tolerance_class: str) -> tuple[float, float]:
    """(lower, upper), µm."""
    match = re.fullmatch(r"([A-Za-z]{1,2})([0-9]{1,2})", tolerance_class)
    letter, grade = (match[1], int(match[2])) if match else ("", 0)
    table = HOLES if letter.isupper() else SHAFTS
    if letter not in table:
        kind = "holes" if tolerance_class[:1].isupper() else "shafts"
        letters = ", ".join(HOLES if kind == "holes" else SHAFTS)
        raise _refused(
            f"the class '{tolerance_class[:20]}' is not in the tables", f"the letters of {kind} are {letters}"
        )
    if grade not in GRADES:
        raise _refused(f"the grade of '{tolerance_class}' is not in the tables", "the grades are 1 to 16")
    diameter = round(size * 1e3, 9)  # mm; without the rounding of the conversion, which could pass a limit
    if not 0 < diameter <= SIZES[-1]:
        raise _refused(
            f"the size {diameter:g} mm is not in the tables", f"the tables cover sizes above 0 up to {SIZES[-1]} mm"
        )
    if grade >= 14 and diameter <= 1:
        raise _refused(f"there is no '{tolerance_class}' of {diameter:g} mm", "grades from 14 on begin above 1 mm")
    width = _at(GRADES[grade], diameter)
    if letter in ("js", "JS"):
        return -width / 2, width / 2
    lower, upper = (_hole if letter.isupper() else _shaft)(letter, grade, diameter)
    if upper is None:
        assert lower is not None  # each letter states one of them
        return lower, lower + width
    return upper - width, upper


def _shaft(letter: str, grade: int, diameter: float) -> tuple[float | None, float | None]:
    """The fundamental deviation of a shaft as lower or as upper one."""
    if letter in UPPER:
        return None, -_at(UPPER[letter], diameter)
    if letter == "j":
        return -_at(_graded(SHAFT_J, letter, grade), diameter), None
    if letter == "k" and not 4 <= grade <= 7:
        return 0.0, None
    return _stated(letter, letter, diameter), None


def _hole(letter: str, grade: int, diameter: float) -> tuple[float | None, float | None]:
    """The fundamental deviation of a hole as lower or as upper one."""
    shaft = letter.lower()
    if shaft in UPPER:
        return _at(UPPER[shaft], diameter), None
    if letter == "J":
        return None, _at(_graded(HOLE_J, letter, grade), diameter)
    if letter == "K":
        _graded(DELTA, letter, grade)
    last = 8 if letter in "KMN" else 7  # the coarsest grade with Δ
    if letter == "N" and grade > last and diameter > SIZES[0]:
        return None, 0.0
    if grade < min(DELTA):
        raise _refused(f"there is no '{letter}{grade}' in the tables", f"'{letter}' begins at grade {min(DELTA)}")
    if letter == "M" and grade == 6 and M6_SPECIAL[0] < diameter <= M6_SPECIAL[1]:
        return None, M6_SPECIAL[2]
    delta = _at(DELTA[grade], diameter) if grade <= last else 0.0
    return None, delta - _stated(shaft, letter, diameter)


def _graded(
    table: dict[int, tuple[int, ...]] | dict[int, tuple[float, ...]], letter: str, grade: int
) -> tuple[float, ...]:
    """The row of a grade in a table that has only some."""
    if grade not in table:
        grades = f"{min(table)} to {max(table)}"
        raise _refused(f"there is no '{letter}{grade}' in the tables", f"'{letter}' has the grades {grades}")
    return table[grade]


def _stated(shaft: str, letter: str, diameter: float) -> float:
    """The fundamental deviation of a letter that does not begin at the smallest size."""
    row = LOWER[shaft]
    deviation = row[_place(diameter, len(row))]
    if deviation is None:
        first = next(STEPS[place - 1] for place, entry in enumerate(row) if entry is not None)
        other = "u" if letter.islower() else "U"
        raise _refused(f"there is no '{letter}' of {diameter:g} mm", f"it begins above {first} mm; use '{other}'")
    return deviation


def _at(row: tuple[float, ...], diameter: float) -> float:
    """The entry of a row at a diameter, mm."""
    return row[_place(diameter, len(row))]


def _place(diameter: float, columns: int) -> int:
    return bisect_left(SIZES if columns == len(SIZES) else STEPS, diameter)


def _refused(what: str, remedy: str) -> MechanismError:
    return MechanismError(Finding(what, remedy=remedy))
