"""Locking as the page has it always in view: the margin, its least or why there is none, and what can be tried
against it.
"""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, Status
from trunnion.results.attributes import summary_of
from trunnion.results.figure import MORE_THAN
from trunnion.solve.friction_method import MARGIN
from trunnion.solve.system import Values, felt
from trunnion.studio.loaded import Loaded
from trunnion.studio.sketch import Sketch
from trunnion.views.common.cycle import abscissa, names

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["cures", "margin_of"]

Array = NDArray[np.float64]

ENOUGH = 0.9  # of the friction at which it just runs: what is tried
SIZES = {"pin.radius": ENOUGH, "guide.length": 1.0 / ENOUGH}  # a shorter arm, a longer guide


def margin_of(result: xr.Dataset, rubs: bool) -> dict[str, Any]:
    """The locking margin over the cycle, the least and where it is; where there is none, `margin_why` says why.

    It is the multiple of the friction at which a position locks: 1 and less where it locks, at most MARGIN; `beyond`:
    it is more everywhere. Positions that cannot be assembled have none, nor has a mechanism whose joints carry nothing.
    The least is the figure of the cycle where the result has that, else that of the positions.
    """
    margin = np.where(result["status"].values <= Status.LOCKED, result["locking_margin"].values, np.nan)
    reactions = np.concatenate([np.ravel(result[name].values) for name in ("reaction_force", "reaction_moment")])
    why = None
    if not rubs:
        why = "no friction"
    elif not names(result, "driver"):
        why = "no driver"
    elif np.all(np.isnan(margin)):
        why = "no position is solved"
    elif not np.any(np.nan_to_num(reactions)):
        why = "nothing loads its joints"
    if why is not None:
        return {"margin": None, "margin_least": None, "margin_why": why}
    index = int(np.flatnonzero(margin == np.nanmin(margin))[0])  # `nanargmin` takes a nan for inf
    beyond, shown = bool(margin[index] > MARGIN), np.minimum(margin, MARGIN)
    least = {"value": float(shown[index]), "beyond": beyond, "at": abscissa(result).say(index)}
    figure = next((one for one in summary_of(result) if one.name == "locking_margin" and one.value is not None), None)
    if figure is not None and figure.aspect != MORE_THAN:
        least = {"value": figure.value, "beyond": False, "at": figure.place.removeprefix("at ")}
    return {"margin": shown, "margin_least": least, "margin_why": None}


def cures(state: Loaded, finding: Finding) -> list[dict[str, Any]]:
    """What the remedy of a locked position comes to in numbers: gestures that write it, with the words for them."""
    figures, entries, numbers = finding.figures, dict(state.entries or {}), state.run.values
    joints = entries.get("joints")
    if finding.code != "friction.locked" or not isinstance(joints, Mapping):
        return []
    coefficients = {joint: f"joints.{joint}.friction.coefficient" for joint in felt(state.run.system, numbers)}
    alike = figures["whole"] >= (1 - 1e-3) * figures["share"]  # else other joints lock where these no longer do
    share = min(figures["share"], figures["whole"])
    group = list(figures["joints"]) if alike else list(coefficients)
    trials = [(group, share)]
    decides, multiple = figures["decides"], figures["multiple"]
    if decides and multiple and group != [decides]:
        trials.insert(0, ([decides], multiple))
    listed = []
    for rubbing, times in trials:
        able = all(coefficients.get(joint) in numbers and isinstance(joints.get(joint), Mapping) for joint in rubbing)
        if not able or not times > 0:
            continue
        gestures = []
        for joint in rubbing:
            before = float(np.ravel(numbers[coefficients[joint]])[0])
            stated = joints[joint].get("friction", {})
            path = ["joints", joint, "friction", *(["coefficient"] if isinstance(stated, Mapping) else [])]
            gestures.append({"do": "set", "path": path, "value": float(f"{ENOUGH * times * before:.3g}")})
        what = f"friction coefficient{'s' * (len(rubbing) > 1)} of {', '.join(rubbing)}"
        values = f"{before:.3g} → {gestures[-1]['value']:.3g}" if len(rubbing) == 1 else f"× {ENOUGH * times:.3g}"
        listed.append({"label": f"{what} {values}", "gestures": gestures})
    return listed + list(_resized(entries, numbers, decides, multiple))


def _resized(entries: dict[str, Any], numbers: Values, joint: str | None, multiple: float) -> Iterator[dict[str, Any]]:
    """The radius and length by which the friction of a joint is as much less as it need be, where they are stated."""
    sketch = Sketch(copy.deepcopy(entries))
    for key, enough in SIZES.items():
        path = ["joints", str(joint), *key.split(".")]
        part = entries["joints"].get(joint, {}).get(path[2], {})
        if ".".join(path) not in numbers or not isinstance(part, Mapping) or "fit" in part:
            continue  # a fit states the radius
        before = float(np.ravel(numbers[".".join(path)])[0])
        times = enough * (multiple if key == "pin.radius" else 1.0 / multiple)
        length = sketch.length(float(f"{times * before:.3g}"))
        label = f"{key.replace('.', ' ')} of {joint} {sketch.length(before)} → {length}"
        yield {"label": label, "gestures": [{"do": "set", "path": path, "value": length}]}
