"""Names that do exist, for messages about one that does not."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches

__all__ = ["nearest"]

SHOWN = 8


def nearest(name: str, known: Iterable[str]) -> str:
    """A remedy for an unknown name: the nearest known ones, else the first few that exist."""
    names = list(dict.fromkeys(known))
    folded = {one.casefold(): one for one in reversed(names)}
    close = [folded[one] for one in get_close_matches(name.casefold()[:80], folded, n=3, cutoff=0.6)]
    if close:
        return "did you mean " + " or ".join(f"'{one}'" for one in close) + "?"
    if not names:
        return "none is defined"
    more = ", …" if len(names) > SHOWN else ""
    return "known: " + ", ".join(f"'{one}'" for one in names[:SHOWN]) + more
