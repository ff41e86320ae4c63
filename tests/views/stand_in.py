"""Results of two mechanisms as a view must bear them: with gaps, one position, odd names, a sliding drive."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path

import numpy as np

import trunnion

DURANGO = Path(__file__).parents[2] / "examples" / "durango-fourbar.yaml"
# names that try to break out of a page or a plot
NASTY = {
    "A": "Ω—Welle",
    "B": "</script><script>alert(1)</script>",
    "C": '<img src=x onerror="alert(2)">',
    "D": "_$x$ & <!-- 曲柄",
}
GUIDE = [float(np.cos(np.pi / 6)), 0.5]
PUSHER = {
    "name": "Inclined pusher",
    "links": {
        "frame": {"points": {"S": {"at": [0, 0], "axis": GUIDE}, "T": {"at": [0, -0.02], "axis": [1, 0]}}},
        "block": {"points": {"S": {"at": [0, 0], "axis": GUIDE}, "Q": [0, 0]}},
        "rod": {"points": {"Q": [0, 0], "R": [0.2, 0]}},
        "foot": {"points": {"R": [0, 0], "T": {"at": [0, 0], "axis": [1, 0]}}},
    },
    "joints": {
        "S": {"type": "prismatic", "links": ["frame", "block"]},
        "Q": {"type": "revolute", "links": ["block", "rod"]},
        "R": {"type": "revolute", "links": ["rod", "foot"]},
        "T": {"type": "prismatic", "links": ["frame", "foot"]},
    },
    "joint_defaults": {"pin": {"radius": 0.01}, "guide": {"length": 0.1}, "friction": 0.1},
    "drivers": {"S": {"speed": 0.05, "range": [0, 0.08]}},
    "loads": {"push": {"link": "foot", "at": "R", "force": [-50.0, 0], "useful": True}},
    "assembly": {"R": [0.2, -0.02]},
}


@cache
def _analysed(count, ideal):
    mechanism = trunnion.read(DURANGO)
    return trunnion.analyse(mechanism.with_friction("off") if ideal else mechanism, count)


@cache
def _pushed(count):
    return trunnion.analyse(trunnion.Mechanism(**PUSHER), count)


def four_bar(count=360, ideal=False, rename=None, gap=None):
    """The four-bar of Durango; `rename` maps joint names, `gap` (start, stop, status) blanks positions."""
    result = _analysed(count, ideal).copy(deep=True)
    if rename:
        points = (key.partition(".") for key in result["point"].values.tolist())
        result = result.assign_coords(
            joint=[rename[name] for name in result["joint"].values.tolist()],
            driver=[rename[name] for name in result["driver"].values.tolist()],
            point=[f"{link}.{rename.get(name, name)}" for link, _, name in points],
        )
        scene = json.loads(result.attrs["scene"])
        scene["joints"] = {rename[name]: joint for name, joint in scene["joints"].items()}
        for link in scene["links"].values():
            link["points"] = [rename.get(name, name) for name in link["points"]]
        result.attrs["scene"] = json.dumps(scene)
    return blank(result, *gap) if gap else result


def blank(result, start, stop, status):
    """The same result with no answer at the positions start ≤ i < stop."""
    hole = (np.arange(result.sizes["position"]) >= start) & (np.arange(result.sizes["position"]) < stop)
    out = result.copy(deep=True)
    for name, column in out.data_vars.items():
        if "position" in column.dims and name != "status":
            out[name] = column.astype(float).where(~hole)
            out[name].attrs = column.attrs
    out["status"] = ("position", np.where(hole, int(status), out["status"].values).astype(np.int8), out["status"].attrs)
    return out


def slider(count=90):
    """A block pushed along an inclined guide, dragging a rod: a prismatic drive, lengths of millimetres."""
    return _pushed(count).copy(deep=True)
