"""Names that do exist, for messages about one that does not; names of numbers as people write them; texts in cells."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from difflib import get_close_matches
from functools import cached_property

from trunnion.errors import Finding, MechanismError

SHOWN = 8
FORMULA = frozenset("=+-@\t\r\n＝＋－＠")  # with which a cell begins that a spreadsheet executes; some are full width
_PLAIN = re.compile(r"[^\W\d](?:[\w. +/-]*\w)?")  # what YAML takes for a text as it stands, in braces too
_WORDS = ("true", "false", "null", "yes", "no", "on", "off")  # and what it does not


def as_key(name: str) -> str:
    """A name as it is written as a key in a model file: in quotation marks where its signs mean something in YAML."""
    plain = _PLAIN.fullmatch(name) and name.casefold() not in _WORDS
    return name if plain else json.dumps(name, ensure_ascii=False)


def nearest(name: str, names_known: Iterable[str]) -> str:
    """A remedy for an unknown name: the nearest known ones, else the first few that exist."""
    name, names = str(name), list(dict.fromkeys(names_known))
    folded = {name_known.casefold(): name_known for name_known in reversed(names)}
    close = [folded[name_known] for name_known in get_close_matches(name.casefold()[:80], folded, n=3, cutoff=0.6)]
    if close:
        return "did you mean " + " or ".join(f"'{name_known}'" for name_known in close) + "?"
    if not names:
        return "none is defined"
    more = ", …" if len(names) > SHOWN else ""
    return "known: " + ", ".join(f"'{name_known}'" for name_known in names[:SHOWN]) + more


def guarded(text: str) -> str:
    """A text for a cell of CSV, with an apostrophe before it if a spreadsheet would take it for a formula."""
    return f"'{text}" if text[:1] in FORMULA and text and not is_number(text) else text


def unguarded(cell: str) -> str:
    """The text of a cell that `guarded` has written."""
    return cell[1:] if cell[:1] == "'" and cell[1:2] in FORMULA and cell[1:] else cell


def is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


SHORT_FORM = "coefficient"  # what a plain number as friction states
ERRORS = "errors."  # before the path of a number: that of its deviation


class ParameterNames:
    """The paths of a model's numbers, found by shorter names."""

    def __init__(self, paths: Iterable[str]) -> None:
        self.all = dict.fromkeys(paths)
        # a deviation is named by what it shifts: its own endings would only make those of the numbers ambiguous
        self.paths = [path for path in self.all if not path.startswith(ERRORS)]

    def resolve(self, name: str) -> str:
        """The path that a name means; MechanismError names the nearest if there is none or several."""
        if name in self.all:
            return name
        if f"dimensions.{name}" in self.all:
            return f"dimensions.{name}"
        paths = self.endings.get(name, [])
        if len(paths) == 1:
            return paths[0]
        if not paths and name.startswith(ERRORS):  # the deviation of a number, by a name of that number
            path = self.resolve(name.removeprefix(ERRORS))
            if f"{ERRORS}{path}" in self.all:
                return f"{ERRORS}{path}"
            remedy = f"state it in the file: errors: {{{as_key(path)}: …}}"
            raise MechanismError(Finding(f"the model states no error of '{path}'", remedy=remedy))
        below = [path for path in self.paths if f".{name}." in f".{path}."]
        short = [path for path in below if path.endswith(f"{name}.{SHORT_FORM}")]
        if len(short) == 1 and name.endswith("friction"):  # `friction: 0.1` in a file is the coefficient, so here too
            return short[0]
        if several := paths or below:
            examples = ", ".join(several[:6]) + (", …" if len(several) > 6 else "")
            why = f"stands for {len(several)} numbers" if len(several) > 1 else "is no number, but has one"
            raise MechanismError(Finding(f"the name '{name}' {why}", remedy=f"say which: {examples}"))
        dimensions = [path.partition(".")[2] for path in self.paths if path.startswith("dimensions.")]
        # a short name is most likely a mistyped dimension; endings such as `x` resemble everything
        remedy = nearest(name, [*self.paths, *self.endings] if "." in name or not dimensions else dimensions)
        if not remedy.startswith("did you mean"):
            longer = [ending for ending in self.endings if len(ending) > 2 and "." not in ending]
            remedy = near if (near := nearest(name, longer)).startswith("did you mean") else remedy
        raise MechanismError(Finding(f"there is no number named '{name}'", remedy=remedy))

    @cached_property
    def endings(self) -> dict[str, list[str]]:
        """Paths by every ending they have."""
        endings: dict[str, list[str]] = {}
        for path in self.paths:
            parts = path.split(".")
            for start in range(1, len(parts)):
                endings.setdefault(".".join(parts[start:]), []).append(path)
        return endings
