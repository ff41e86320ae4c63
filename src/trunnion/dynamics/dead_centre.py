"""The dead centre of a driven joint, seen before it is reached.

There the links go on while the driven coordinate q turns round, q* − q ~ (t* − t)²: the inertia reduced to it grows
without bound, and the links cannot be assembled beyond. Steps shrink in proportion to t* − t and would never arrive.
The place is foreseen from the last step, t* = t − q̇/q̈ and q* = q − q̇²/(2 q̈), and confirmed by poses on both sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.dynamics.rates import Layout
from trunnion.dynamics.state import FreeMotion
from trunnion.errors import Status
from trunnion.solve.status import NEAR_SINGULAR, pose_status, worst_condition

__all__ = ["DeadCentre"]

Array = NDArray[np.float64]

SHRUNK = 3  # steps one after the other, each no longer than the last, from which it is looked for
RUBBING = 20.0  # condition from which it is near where joints rub: their friction grows with it and costs more and more
BESIDE = 0.25  # of the way that is left: poses there, on both sides, confirm the place


@dataclass
class DeadCentre:
    """Watches the steps of one free coordinate."""

    motion: FreeMotion
    layout: Layout
    shrunk: int = 0
    last: float = np.inf

    def reached(self, solver: Any, size: float) -> tuple[float, dict[str, float]] | None:
        """Time, s, and place of a dead centre that the steps run into, if they are near; size: of the last step, s."""
        self.shrunk, self.last = (self.shrunk + 1 if size <= self.last else 0), size
        n = self.layout.coordinates
        if len(self.motion.names) != 1 or not hasattr(solver, "f"):
            return None
        row, speed, second = solver.y, float(solver.y[n]), float(solver.f[n])
        if self.shrunk < SHRUNK or not speed * second < 0.0:
            return None
        left, way = -speed / second, -0.5 * speed * speed / second
        beside = np.array([float(row[0]), float(row[0]) + (1 - BESIDE) * way, float(row[0]) + (1 + BESIDE) * way])
        rows = np.repeat(np.asarray(row, float)[:, None], 3, axis=1)
        rows[0] = beside
        at = self.layout.moment(np.full(3, float(solver.t)), rows)
        with np.errstate(all="ignore"):
            walk = self.motion.walk(at, np.zeros_like(at.q))
            nearest = NEAR_SINGULAR if self.motion.affine else RUBBING
            near = np.broadcast_to(worst_condition(walk), (3,))[0] > nearest
            status = pose_status(walk, (3,))
        if not near or status[1] == Status.NOT_ASSEMBLED or status[2] != Status.NOT_ASSEMBLED:
            return None
        return float(solver.t) + left, {"coordinate": float(row[0]) + way, "rate": 0.0}
