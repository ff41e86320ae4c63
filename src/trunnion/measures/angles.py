"""Angles without jumps: by how many whole turns those of a mechanism, in (−π, π], are off."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number
from trunnion.measures.curves import MotionRequest, rate, value
from trunnion.solve.run import Run
from trunnion.solve.status import pose_status
from trunnion.solve.turns import near, turned

__all__ = ["angle_at", "angles", "near", "within"]

Array = NDArray[np.float64]


def within(run: Run, times: Number) -> Number:
    """Times within the cycle, s, of such as may run over its end."""
    if not run.cycle.periodic or run.cycle.duration <= 0:
        return times
    real = primal(times) % run.cycle.duration
    return Dual(real, times.dual) if isinstance(times, Dual) else real


def angles(run: Run, turning: Mapping[str, MotionRequest], span: tuple[float, float]) -> dict[str, tuple[Array, Array]]:
    """Times, s, and angles of the nominal mechanism over a span, by name: integrals of their rates."""
    if not turning:
        return {}

    def look(time: Array) -> tuple[Array, NDArray[np.integer]]:
        walk = run.walk(within(run, time))
        speeds = [np.asarray(primal(rate(angle, walk)), float) for angle in turning.values()]
        return np.array(np.broadcast_arrays(*speeds, time)[:-1]), pose_status(walk, time.shape)

    knots = np.array([bend.time for bend in run.bends if bend.scan < 0])

    def firsts(times: Array) -> list[Number]:
        walk = run.walk(within(run, times))
        return [value(angle, walk) for angle in turning.values()]

    return dict(zip(turning, turned(run.cycle, look, firsts, knots, span), strict=True))


def angle_at(run: Run, angle: MotionRequest, time: Array) -> Array:
    """An angle of the nominal mechanism at times of its cycle, s, that goes on from its start."""
    key = ("angle without jumps", angle.kind, angle.subject)
    table = run.once(key, lambda: angles(run, {"": angle}, (0.0, run.cycle.duration))[""])
    return np.asarray(np.interp(time, *table))
