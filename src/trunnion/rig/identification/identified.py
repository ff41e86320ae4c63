"""An identification: the model, the data and what was found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.model.mechanism import Mechanism
from trunnion.rig.identification.fit import FitProblem
from trunnion.rig.identification.identifiability import InseparableUnknowns
from trunnion.rig.identification.misfit import MisfitCause
from trunnion.rig.identification.search import Search
from trunnion.rig.identification.uncertainty import Covariances
from trunnion.rig.identification.unused import UnusedChannels
from trunnion.rig.reading.measurement import Measurement
from trunnion.solve.run import Run

__all__ = ["Identified"]


Array = NDArray[np.float64]


@dataclass(frozen=True)
class Identified:
    """All that an identification found, before it is written down. causes: what would explain a misfit, best first."""

    mechanism: Mechanism
    measurement: Measurement
    run: Run
    problem: FitProblem
    search: Search
    spread: Covariances
    groups: Sequence[InseparableUnknowns]
    causes: Sequence[MisfitCause] = ()
    unused: UnusedChannels | None = None

    @property
    def x(self) -> Array:
        """Estimates of the unknowns, then of the sensors' errors."""
        return self.search.fit.x
