"""Modules of a mechanism: drivers and Assur groups, on numbers.

A module has `position(elements, assembly, drive)`, which gives a pose with the `frames` of its links;
`moved(pose, outer, outer_seconds, drive, seconds)`, the twists of its links and their derivatives;
`reactions(pose, loads)`, `closure(pose)` and `condition(pose)`; and `BRANCHES`, the assemblies that `position` takes.
Modules see numbers only: no model, no friction, no clearance. Friction and inertia arrive as loads. `GROUPS` lists the
closed forms in the plane by the letters of their joints; everything else is a `general.General`.
"""

from __future__ import annotations

from trunnion.groups.dyad import Dyad
from trunnion.groups.dyads import PRP, RPP, RPR, RRP, RRR

GROUPS: dict[str, Dyad] = {dyad.letters: dyad for dyad in (RRR(), RRP(), RPR(), PRP(), RPP())}
