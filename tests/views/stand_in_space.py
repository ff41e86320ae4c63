"""Spatial results of every kind that a view must bear: an RSSR, a Cardan joint, chains with a joint of every pair."""

from functools import cache

from stand_in import blank

import trunnion
from mechanisms_parts import example
from mechanisms_space import chain
from trunnion.errors import Status

# closed chains and seeds whose joint B is of the pair that is named
CHAINS = {"helical": ("RHSC", 1), "planar": ("RECR", 1), "universal": ("RUSR", 4), "prismatic": ("RPSC", 404),
          "fixed": ("RFSCR", 404)}  # fmt: skip


@cache
def _analysed(name, count):
    if name in CHAINS:
        return trunnion.analyse(trunnion.Mechanism(**chain(*CHAINS[name]).data), count)
    data = example(name).data()
    if name == "rssr":
        data["links"]["rod"]["points"]["E"] = [0.06, 0.03, 0]
        data["links"]["rocker"]["points"]["tip"] = [0.11, 0, "s4"]
        data["loads"] = {"work": {"link": "rocker", "at": "tip", "force": [0, -150, 60], "useful": True},
                         "brake": {"link": "rocker", "moment": [0, 0, -3], "frame": "link"}}  # fmt: skip
    return trunnion.analyse(trunnion.Mechanism(**data), count)


def rssr(count=120, gap=None):
    """THEORY, section 7, with free points on rod and rocker, a force and a moment that turns with its link."""
    result = _analysed("rssr", count).copy(deep=True)
    return blank(result, *gap) if gap else result


def of_pair(kind, count=24):
    """A closed chain whose joint B is of a pair."""
    return _analysed(kind, count).copy(deep=True)


SPATIAL = {
    "RSSR": rssr,
    "gap": lambda: rssr(gap=(40, 60, Status.NOT_ASSEMBLED)),
    "nowhere": lambda: rssr(24, gap=(0, 24, Status.NOT_ASSEMBLED)),
    "locked": lambda: rssr(24, gap=(0, 24, Status.LOCKED)),
    "one position": lambda: rssr(1),
    "Cardan": lambda: of_pair("pezzuti-cardan", 120),
    **{kind: lambda kind=kind: of_pair(kind) for kind in CHAINS},
}
