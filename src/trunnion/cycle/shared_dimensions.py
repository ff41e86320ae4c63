"""Toleranced dimensions that several links have as a length: as one parameter, they vary together, as parts do not."""

from __future__ import annotations

from collections.abc import Iterator

from trunnion.errors import Finding
from trunnion.model.mechanism import Mechanism
from trunnion.model.tolerances import tolerated
from trunnion.results.sentences import finding_for

__all__ = ["findings"]

MOST = 6  # entries named in a finding


def findings(mechanism: Mechanism) -> Iterator[Finding]:
    """Of each toleranced dimension that alone sets points of more than one link: which, and what to do.

    Where it stands beside other dimensions, as the radius of a roller between two links does, it is one part's own.
    """
    placed = [
        (path, entry.depends)
        for path, entry in mechanism.parameter_set.entries.items()
        if path.startswith("links.") and ".points." in path
    ]
    for tolerance in tolerated(mechanism):
        used = [path for path, depends in placed if depends == (tolerance.path,)]
        links = list(dict.fromkeys(path.split(".")[1] for path in used))
        if tolerance.path.startswith("dimensions.") and len(links) > 1:
            name = tolerance.path.removeprefix("dimensions.")
            shown = [path.removeprefix("links.").replace(".points.", ".") for path in used]
            more = f" and {len(shown) - MOST} more" if len(shown) > MOST else ""
            phrases = {"shown": ", ".join(shown[:MOST]) + more}
            yield finding_for("tolerance.shared_dimension", tolerance.path, phrases=phrases, name=name, links=links)
