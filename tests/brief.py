"""What `trunnion.analyse` returns of positions alone: the means over the cycle ask for most positions."""

from __future__ import annotations

from typing import Any

import numpy as np

from trunnion import FrictionMethod, Mechanism
from trunnion.cycle.positions import positions
from trunnion.cycle.summary import result_of
from trunnion.solve.run import prepare


@np.errstate(all="ignore")
def brief(mechanism: Mechanism, steps: int, method: FrictionMethod | None = None, refuse: bool = True) -> Any:
    """The variables of every position as `analyse` has them; NaN for what is a mean over the cycle.

    refuse: whether what statics does not determine is an error.
    """
    run = prepare(mechanism)
    if refuse and run.determinacy is not None:
        run.determinacy.refuse()
    return result_of(run, positions(run, steps, method, averaged=False)).dataset
