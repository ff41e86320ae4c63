"""A motion that repeats, as it was integrated, as the motion law of a driver: so that what knows cycles can take it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.dynamics.filling import filled
from trunnion.dynamics.solution import Solution
from trunnion.dynamics.state import FreeMotion
from trunnion.joints.motion import Drive, MotionLaw, Parameters, Span

__all__ = ["Repeated", "motion_law"]

Array = NDArray[np.float64]

DEGREE = 7  # of the polynomials, as of the dense output of DOP853
# of a step, from its begin −1 to its end 1: within it, for forces may jump at its ends
NODES: Array = -np.cos(np.pi * (np.arange(DEGREE + 1) + 0.5) / (DEGREE + 1))
COEFFICIENTS: Array = np.asarray(np.linalg.inv(chebyshev.chebvander(NODES, DEGREE)), np.float64)


@dataclass(frozen=True)
class Repeated:
    """Coordinate, rate and second derivative over one cycle, as polynomials step by step.

    begins: of the steps, s, and the end of the last; parts: coefficients of Chebyshev polynomials, (number, step,
    degree); advance: of the coordinate, rad or m, from cycle to cycle.
    """

    begins: Array
    parts: Array
    advance: float

    @classmethod
    def of(cls, motion: FreeMotion, solution: Solution) -> list[Repeated]:
        """Those of the free coordinates, over a solution that ends as it begins but for whole turns."""
        begins = np.array([stretch.begin for stretch in solution.stretches] + [solution.end])
        time = 0.5 * (begins[1:] + begins[:-1])[:, None] + 0.5 * np.diff(begins)[:, None] * NODES
        books = filled(motion, solution, time.ravel())
        ends, _ = solution.at(np.array([0.0, solution.end]))
        numbers = np.array([books.at.q, books.at.rate, books.seconds]).reshape(3, -1, *time.shape) @ COEFFICIENTS.T
        return [cls(begins, numbers[:, i], float(ends[i, 1] - ends[i, 0])) for i in range(len(motion.names))]

    @property
    def period(self) -> float:
        """How long a cycle takes, s."""
        return float(self.begins[-1])

    def at(self, time: Number, parameters: Parameters) -> Drive:
        """As a motion law has it; `parameters` are not looked at. Of a dual time with its derivative."""
        moment = np.asarray(primal(time), float)
        cycles = np.floor(moment / self.period)
        moment = moment - cycles * self.period
        step = np.clip(np.searchsorted(self.begins, moment, side="right") - 1, 0, len(self.begins) - 2)
        place = 2 * (moment - self.begins[step]) / (self.begins[step + 1] - self.begins[step]) - 1
        basis = np.cos(np.arange(DEGREE + 1) * np.arccos(np.clip(place, -1.0, 1.0))[..., None])
        value, rate, second = np.sum(self.parts[:, step] * basis, axis=-1)
        zero = time - primal(time)  # 0, and the derivative of a dual time
        return Drive(value + cycles * self.advance + rate * zero, rate + second * zero, second + 0.0 * zero)

    def span(self, parameters: Parameters) -> Span:
        """One cycle, from the nodes of the steps."""
        values, rates = self.parts[:2] @ chebyshev.chebvander(NODES, DEGREE).T
        one_way = bool(np.all(rates > 0.0) or np.all(rates < 0.0))
        return Span(self.period, True, False, one_way, float(np.max(np.abs(rates))), float(np.ptp(values)))


def motion_law(repeated: Repeated) -> MotionLaw:
    """A motion that repeats as the law of a driver."""
    return MotionLaw(
        repeated.at, repeated.span, needs=(), source="motion in time", validity="the mechanism it was found for"
    )
