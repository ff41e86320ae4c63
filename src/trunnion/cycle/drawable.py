"""The motion of a mechanism alone, to draw it: no friction, no seats by loads, no books of the cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trunnion.cycle.positions import positions
from trunnion.cycle.summary import member_units, scene_of
from trunnion.model.mechanism import Mechanism
from trunnion.results import variables as results
from trunnion.results.attributes import origin
from trunnion.results.dataset import driven
from trunnion.solve.run import prepare

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["drawable"]

STEPS = 72  # positions of the curves of its points


@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN
def drawable(mechanism: Mechanism) -> xr.Dataset:
    """The result of a cycle of STEPS positions without reactions, as the drawings read it.

    Raises MechanismError if the structure does not determine the motion.
    """
    bare = mechanism.with_friction("off")
    run = prepare(bare.with_seats("free") if bare.seated else bare)
    found = positions(run, STEPS, margin=False, averaged=False)
    arrays = {name: array for name, array in found.arrays.items() if not name.startswith("reaction_")}
    attributes = {
        **origin(mechanism, run.system.plan.formula, mobility=run.system.plan.mobility),
        "scene": scene_of(run),
        "periodic": int(run.cycle.periodic),
    }
    along = driven(found.time, *found.dial)
    units = member_units(run.system)
    return results.dataset(arrays, found.labels, along, found.means, attributes, units, found.ideal)
