"""Names that do exist, for messages about one that does not; texts that a spreadsheet would take for a formula."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable
from difflib import get_close_matches

__all__ = ["FORMULA", "as_key", "guarded", "nearest", "unguarded"]

SHOWN = 8
FORMULA = frozenset("=+-@\t\r\n＝＋－＠")  # with which a cell begins that a spreadsheet executes; some are full width
_PLAIN = re.compile(r"[^\W\d](?:[\w. +/-]*\w)?")  # what YAML takes for a text as it stands, in braces too
# words in common use for those of a model file: too unlike them to be found by their letters
MEANT = {
    "rectangular": "uniform",
    "gauss": "normal",
    "gaussian": "normal",
    "diameter": "radius",
}
REMARKS = {"radius": ", half the diameter"}
_WORDS = ("true", "false", "null", "yes", "no", "on", "off")  # and what it does not


def as_key(name: str) -> str:
    """A name as it is written as a key in a model file: in quotation marks where its signs mean something in YAML."""
    plain = _PLAIN.fullmatch(name) and name.casefold() not in _WORDS
    return name if plain else json.dumps(name, ensure_ascii=False)


def nearest(name: str, known: Iterable[str]) -> str:
    """A remedy for an unknown name: the nearest known ones, else the first few that exist."""
    name, names = str(name), list(dict.fromkeys(known))
    folded = {one.casefold(): one for one in reversed(names)}
    if (meant := MEANT.get(name.casefold())) in names:
        return f"did you mean '{meant}'{REMARKS.get(meant, '')}?"
    close = [folded[one] for one in get_close_matches(name.casefold()[:80], folded, n=3, cutoff=0.6)]
    if close:
        return "did you mean " + " or ".join(f"'{one}'" for one in close) + "?"
    if not names:
        return "none is defined"
    more = ", …" if len(names) > SHOWN else ""
    return "known: " + ", ".join(f"'{one}'" for one in names[:SHOWN]) + more


def guarded(text: str) -> str:
    """A text for a cell of CSV, with an apostrophe before it if a spreadsheet would take it for a formula."""
    return f"'{text}" if text[:1] in FORMULA and text and not _is_number(text) else text


def unguarded(cell: str) -> str:
    """The text of a cell that `guarded` has written."""
    return cell[1:] if cell[:1] == "'" and cell[1:2] in FORMULA and cell[1:] else cell


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
