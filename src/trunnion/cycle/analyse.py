"""The main question: how does it move, what force is in each joint, what drives it, where does the power go."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from trunnion.cycle import summary
from trunnion.deprecation import renamed
from trunnion.model.mechanism import Mechanism
from trunnion.solve.friction_method import FrictionMethod

if TYPE_CHECKING:
    import xarray as xr
from trunnion.cycle.positions import check_steps, positions
from trunnion.solve.run import Run, prepare

__all__ = ["analyse", "analyse_run"]


@renamed(method="friction_method")
@np.errstate(all="ignore")
def analyse(
    mechanism: Mechanism,
    steps: int = 360,
    friction_method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """Motion, reactions with friction, drive effort and power of a mechanism over its cycle.

    steps: equally spaced positions; over a full turn the end is not repeated. Returns a Dataset with the names,
    units and dims of `results.VARIABLES`; positions without an answer are NaN and have a status.
    friction_method: how friction and reactions are settled; Newton's method if not given.
    progress: called with the number of positions done.
    Method: the modules' closed forms or the general group, friction settled per module (`friction.settle`).
    Raises MechanismError if the structure does not determine the motion or `steps` is out of range.
    """
    check_steps(steps)
    run = prepare(mechanism)
    if run.determinacy is not None:
        run.determinacy.refuse()
    return analyse_run(run, steps, friction_method, progress)


@np.errstate(all="ignore")
def analyse_run(
    run: Run,
    steps: int = 360,
    method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """What `analyse` does, for a mechanism that is prepared."""
    found = positions(run, steps, method, progress)
    return summary.finish(run, found)
