"""The locking margin as the page has it always in view: over the cycle, the least, or why there is none."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Status
from trunnion.solve.friction_method import MARGIN
from trunnion.views.common.cycle import abscissa, names

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["margin_of"]


def margin_of(result: xr.Dataset, rubs: bool) -> dict[str, Any]:
    """The locking margin over the cycle, the least and where it is; where there is none, `margin_why` says why.

    It is the multiple of the friction at which a position locks: 1 and less where it locks, at most MARGIN; `beyond`:
    it is more everywhere. Positions that cannot be assembled have none, nor has a mechanism whose joints carry nothing.
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
    return {"margin": shown, "margin_least": least, "margin_why": None}
