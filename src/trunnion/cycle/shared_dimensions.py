"""Toleranced dimensions that several links use: as one parameter, they vary together, as parts do not."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.errors import Finding
from trunnion.model.mechanism import Mechanism
from trunnion.model.tolerances import tolerated
from trunnion.results.sentences import finding_for

__all__ = ["findings"]

MOST = 6  # entries named in a finding


def findings(mechanism: Mechanism) -> Iterator[Finding]:
    """Of each toleranced dimension that sets points of more than one link: which, and what to do."""
    entries = mechanism.parameter_set.entries
    placed = [path for path in entries if path.startswith("links.") and ".points." in path]
    for tolerance in tolerated(mechanism):
        if not tolerance.path.startswith("dimensions."):
            continue
        used = [path for path in placed if tolerance.path in _sources(mechanism, path)]
        links = list(dict.fromkeys(path.split(".")[1] for path in used))
        if len(links) > 1:
            name = tolerance.path.removeprefix("dimensions.")
            shown = [path.removeprefix("links.").replace(".points.", ".") for path in used]
            more = f" and {len(shown) - MOST} more" if len(shown) > MOST else ""
            phrases = {"shown": ", ".join(shown[:MOST]) + more}
            yield finding_for("tolerance.shared_dimension", tolerance.path, phrases=phrases, name=name, links=links)


def _sources(mechanism: Mechanism, path: str) -> set[str]:
    """Paths of all numbers that a number is computed from, through other dimensions too."""
    entries, found, waiting = mechanism.parameter_set.entries, set[str](), [path]
    while waiting:
        entry = entries.get(waiting.pop())
        fresh = [one for one in (entry.depends if entry else ()) if one not in found]
        found.update(fresh)
        waiting += fresh
    return found
