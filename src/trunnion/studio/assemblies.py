"""The other ways in which a mechanism can be put together, as ghosts that one click takes."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from trunnion.errors import MechanismError
from trunnion.model.mechanism import Mechanism
from trunnion.solve.assembly_modes import AssemblyMode, GroupModes, choices
from trunnion.solve.forward import Forward
from trunnion.solve.run import Run, prepare
from trunnion.studio.gestures import done
from trunnion.studio.sketch import Sketch

__all__ = ["other_assemblies"]

MOST = 3


def other_assemblies(run: Run, entries: Mapping[str, Any], steps: int) -> Iterator[tuple[str, list[Any], Forward]]:
    """Name, gestures that take it, and walk over the cycle of each other assembly, a few at most.

    Each is that of one group; the groups after it follow by their own hints.
    """
    ways = [(group, way) for group in choices(run) for way in group.ways if not way.taken]
    for group, way in ways[:MOST]:
        sketch = Sketch(copy.deepcopy(dict(entries)))
        gestures = _taking(sketch, group, way)
        try:
            for gesture in gestures:
                done(sketch, gesture)
            other = prepare(Mechanism(**sketch.entries))
            with np.errstate(all="ignore"):
                yield (
                    f"{' and '.join(group.links)} assembled the other way ({way.name})",
                    gestures,
                    other.walk(other.cycle.times(steps)),
                )
        except MechanismError:
            continue  # what is stated elsewhere in the model forbids this one


def _taking(sketch: Sketch, group: GroupModes, way: AssemblyMode) -> list[dict[str, Any]]:
    """Gestures that take a way: by where its pins are at the start, else by its name."""
    hints = sketch.entries.get("assembly") or {}
    own = [name for name in hints if name in way.joints or name in group.links]
    gestures: list[dict[str, Any]] = [{"do": "set", "path": ["assembly", name], "value": None} for name in own]
    pins = {name: place for name, place in way.joints.items() if len(place) == 2}
    if group.where or not pins:
        return [*gestures, {"do": "set", "path": ["assembly", group.link], "value": way.name}]
    return [
        *(one for one in gestures if one["path"][1] not in pins),
        *({"do": "set", "path": ["assembly", name], "value": [sketch.length(part) for part in place]}
          for name, place in pins.items()),
    ]  # fmt: skip
