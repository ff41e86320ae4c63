"""The other ways in which a mechanism can be put together, as ghosts that one click takes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from trunnion.errors import MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.solve.assembly_modes import choices
from trunnion.solve.forward import Forward
from trunnion.solve.run import Run, prepare

__all__ = ["other_assemblies"]

MOST = 3


def other_assemblies(run: Run, entries: Mapping[str, Any], steps: int) -> Iterator[tuple[str, list[Any], Forward]]:
    """Name, gestures that take it, and walk over the cycle of each other assembly, a few at most.

    Each is that of one group, named in place of the hints inside it; the groups after it follow by their own hints.
    """
    stated = dict(entries.get("assembly") or {})
    ways = [(group, way) for group in choices(run) for way in group.ways if not way.taken]
    for group, way in ways[:MOST]:
        changes = {name: None for name in stated if name in way.joints or name in group.links} | {group.link: way.name}
        hints = {name: hint for name, hint in (stated | changes).items() if hint is not None}
        try:
            other = prepare(Mechanism(**{**entries, "assembly": hints}))
            with np.errstate(all="ignore"):
                walk = other.walk(other.cycle.times(steps))
        except MechanismError:
            continue  # what is stated elsewhere in the model forbids this one
        gestures = [{"do": "set", "path": ["assembly", name], "value": hint} for name, hint in changes.items()]
        yield f"{' and '.join(group.links)} assembled the other way ({way.name})", gestures, walk
