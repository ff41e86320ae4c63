"""What the model says where pins lie as their loads press them: each condition by itself, derivatives by differences.

The seats follow the loads and the loads the seats, in an iteration that carries no derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.errors import MechanismError, Status
from trunnion.rig.identify.courses import Courses, Model, Said
from trunnion.solve.run import prepare
from trunnion.solve.seating import settle
from trunnion.solve.status import status_of
from trunnion.solve.travel import lanes

__all__ = ["SeatedModel"]

Array = NDArray[np.float64]
STEP = 1e-4  # of an unknown: seats are settled to some 1e-6 of their clearance
Found = tuple[dict[str, Array], NDArray[np.int8], NDArray[np.bool_]]


@dataclass(frozen=True)
class SeatedModel(Model):
    """A Model of a mechanism with pins in seats that follow their loads."""

    def courses(self, at: Array) -> Courses:
        """What the model says at these values of the unknowns, SI."""
        found = [self._condition(k, at) for k in range(len(self.phases))]
        said, status, turned = [], [], []
        for values, codes, senses in found:
            said.append({name: Said(row, row[None, :].repeat(len(at), 0) * np.nan) for name, row in values.items()})
            status.append(codes)
            turned.append(senses)
        for p, unknown in enumerate(self.unknowns):
            step = STEP * (abs(at[p]) or unknown.size or 1.0)
            low, high = (np.clip(at[p] + sign * step, unknown.lower, unknown.upper) for sign in (-1.0, 1.0))
            for k in range(len(self.phases)):
                ends = [self._condition(k, np.where(np.arange(len(at)) == p, end, at))[0] for end in (low, high)]
                for name, one in said[k].items():
                    one.slope[p] = (ends[1][name] - ends[0][name]) / (high - low)
        return Courses(tuple(said), tuple(status), tuple(turned))

    def _condition(self, k: int, at: Array) -> Found:
        """One condition: courses, statuses, where a sense changes."""
        values: dict[str, float | str] = dict(self.settings[k])
        for value, unknown in zip(at, self.unknowns, strict=True):
            values.update(dict.fromkeys(unknown.paths, float(value)))
        size = len(self.phases[k])
        try:
            run = prepare(self.run.system.mechanism.with_values(values))
        except MechanismError:
            lost = dict.fromkeys(self.measures, np.full(size, np.nan))
            return lost, np.full(size, Status.NOT_ASSEMBLED, np.int8), np.zeros(size, bool)
        with np.errstate(all="ignore"):
            seen = lanes(self.phases[k] * run.cycle.duration, run.cycle)
            seated = settle(run, seen, self.friction, run.ideal(seen.times, self.friction))
            status = status_of(seated.back, (size,))
            found = {
                name: np.array(np.broadcast_to(primal(self._course(measure, seated.back)), (size,)), float)
                for name, measure in self.measures.items()
            }
            turned = self._turned(seated.back, (size,))
        return found, np.where(seated.sticks, np.maximum(status, Status.ZERO_SLIP), status).astype(np.int8), turned
