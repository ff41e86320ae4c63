"""Angles without jumps: by how many whole turns those of a mechanism, in (−π, π], are off."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.namespace import Number
from trunnion.measures.curves import MotionRequest, rate, value
from trunnion.solve.run import Run
from trunnion.solve.status import pose_status
from trunnion.solve.switches import accuracy_of, breaks_between

__all__ = ["angle_at", "angles", "near", "within"]

Array = NDArray[np.float64]
TURN = 2 * np.pi
TURNING = Accuracy(1e-4, 1e-6, shortest=1e-6)  # of the rate of an angle, whose integral tells its whole turns


def within(run: Run, times: Number) -> Number:
    """Times within the cycle, s, of such as may run over its end."""
    if not run.cycle.periodic or run.cycle.duration <= 0:
        return times
    real = primal(times) % run.cycle.duration
    return Dual(real, times.dual) if isinstance(times, Dual) else real


def near(number: Number, to: Any, turn: float = TURN) -> Number:
    """The number and so many whole turns that it is as near as can be to another."""
    return number - turn * np.rint((primal(number) - to) / turn)


def angles(run: Run, turning: Mapping[str, MotionRequest], span: tuple[float, float]) -> dict[str, tuple[Array, Array]]:
    """Times, s, and angles of the nominal mechanism over a span, by name: integrals of their rates."""
    if not turning:
        return {}

    def look(time: Array) -> tuple[Array, NDArray[np.integer]]:
        walk = run.walk(within(run, time))
        speeds = [np.asarray(primal(rate(angle, walk)), float) for angle in turning.values()]
        return np.array(np.broadcast_arrays(*speeds, time)[:-1]), pose_status(walk, time.shape)

    knots = np.array([bend.time for bend in run.bends if bend.scan < 0])
    rates = Courses.of(look, breaks_between(run.cycle, knots, *span), None, accuracy_of(run.cycle, TURNING))
    turned = [rates.integral(row) for row in range(len(turning))]
    nodes = turned[0][0]
    starts = np.argmax(np.isfinite(rates.at(nodes)), axis=1)
    walk = run.walk(within(run, nodes[starts]))
    found = {}
    for row, (name, angle) in enumerate(turning.items()):
        time, course = turned[row]
        first = np.broadcast_to(primal(value(angle, walk)), starts.shape)[row]
        found[name] = (time, course - course[starts[row]] + np.nan_to_num(float(first)))
    return found


def angle_at(run: Run, angle: MotionRequest, time: Array) -> Array:
    """An angle of the nominal mechanism at times of its cycle, s, that goes on from its start."""
    key = ("angle without jumps", angle.kind, angle.subject)
    table = run.once(key, lambda: angles(run, {"": angle}, (0.0, run.cycle.duration))[""])
    return np.asarray(np.interp(time, *table))
