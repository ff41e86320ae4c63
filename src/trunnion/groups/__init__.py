"""Modules of a mechanism: drivers and Assur groups, on numbers.

`GROUPS` lists the closed forms by the letters of their joints; everything else is a `general.General`.
"""

from __future__ import annotations

from trunnion.groups import driver, prp, rpp, rpr, rrp, rrr
from trunnion.groups.protocol import Group

__all__ = ["GROUPS", "Group"]

GROUPS: dict[str, Group] = {
    "R": driver.REVOLUTE,
    "P": driver.PRISMATIC,
    "RRR": rrr,
    "RRP": rrp,
    "RPR": rpr,
    "PRP": prp,
    "RPP": rpp,
}
