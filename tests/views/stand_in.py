"""Results of two mechanisms as a view must bear them: with gaps, one position, odd names, a sliding drive."""

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


@cache
def _analysed(count, ideal):
    mechanism = trunnion.read(DURANGO)
    return trunnion.analyse(mechanism.with_friction("off") if ideal else mechanism, count)


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
    """A press whose cylinder drives its slide: a prismatic drive, lengths of millimetres."""
    return trunnion.analyse(trunnion.read(DURANGO.with_name("drawing-press.yaml")), count).copy(deep=True)
