"""What `trunnion.analyse` returns of positions alone: the means over the cycle ask for most positions."""

from __future__ import annotations

from typing import Any

import numpy as np

from trunnion import FrictionMethod, Mechanism
from trunnion.cycle.positions import ALL, positions
from trunnion.cycle.summary import member_units
from trunnion.results import variables
from trunnion.results.dataset import driven
from trunnion.solve.run import prepare


@np.errstate(all="ignore")
def brief(mechanism: Mechanism, steps: int, method: FrictionMethod | None = None, refuse: bool = True) -> Any:
    """The variables of every position as `analyse` has them; NaN for what is a mean over the cycle.

    Without findings and summary: where a position locks, those are read of the whole cycle, which takes far longer.

    refuse: whether what statics does not determine is an error.
    """
    run = prepare(mechanism)
    if refuse and run.determinacy is not None:
        run.determinacy.refuse()
    at = positions(run, steps, method, averaged=False)
    along, units = driven(at.time, *at.dial), member_units(run.system)
    return variables.dataset(at.arrays, at.labels, along, at.means, {}, units, at.ideal, None, ALL.dtype, {})
