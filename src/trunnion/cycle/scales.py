"""The scales of a mechanism: the largest length, rate and force that occur in its cycle."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.cycle.variables import fill_of
from trunnion.cycle.written import fill_chunk
from trunnion.results import variables as results
from trunnion.results.scales import Scales
from trunnion.solve.run import Run

__all__ = ["largest", "peak", "scales_of"]

LOOKED = 24  # positions: the scales are orders of magnitude


def scales_of(run: Run) -> Scales:
    """The scales over the cycle, whatever positions are asked for; pins are in the middle of their play."""
    return run.once("scales", lambda: largest(run, _looked(run)))


def _looked(run: Run) -> Mapping[str, NDArray[np.float64]]:
    time = run.cycle.times(LOOKED if run.cycle.duration > 0 else 1)
    filling = fill_of(run.system)
    arrays = results.allocate(filling.labels(run.system), len(time), filling.absent(run.system))
    with np.errstate(all="ignore"):
        fill_chunk(arrays, run.solve(time), time, slice(0, len(time)))
    return arrays


def largest(run: Run, arrays: Mapping[str, NDArray[np.float64]]) -> Scales:
    """The scales of some positions.

    Parameters
    ----------
    run
        Of the mechanism: its stated lengths, loads and weights count too, for they may cancel at every position.
    arrays
        Over the positions, by the names of `results.variables`.
    """
    system, stated = run.system, _stated(run)
    size = float(np.max(primal(system.size(run.values))))
    length = max(size, *stated["m"], peak(arrays["point_position"]), peak(arrays["joint_slide"]))
    speed = max(peak(arrays["joint_slide_velocity"]), peak(arrays["point_velocity"]))
    rate = max(peak(arrays["joint_rotation_velocity"]), speed / length) or 1 / (run.cycle.duration or 1.0)
    forces, torques = [*stated["N"], peak(arrays["reaction_force"])], [*stated["N m"], peak(arrays["reaction_moment"])]
    for driver, efforts in zip(system.mechanism.drivers, arrays["drive_effort"], strict=True):
        (torques if system.turns(driver) else forces).append(peak(efforts))
    return Scales(length, rate, max(0.0, *forces, max(torques) / length))


def _stated(run: Run) -> dict[str, list[float]]:
    """Stated lengths, moments, and forces with the weight of all links, by their units."""
    values = {path: peak(np.asarray(primal(value), float)) for path, value in run.values.items()}
    gravity = float(np.linalg.norm([values.get(f"gravity.{axis}", 0.0) for axis in "xyz"]))
    masses = [value for path, value in values.items() if path.startswith("links.") and path.endswith(".mass")]
    found = {"m": [0.0], "N m": [0.0], "N": [gravity * sum(masses)]}
    for path, one in run.system.mechanism.parameter_set.entries.items():
        if one.kind.unit in found and path in values:
            found[one.kind.unit].append(values[path])
    return found


def peak(values: NDArray[np.float64]) -> float:
    """Largest magnitude, without a copy of the values; 0 of none."""
    return float(max(np.nanmax(values, initial=0.0), -np.nanmin(values, initial=0.0)))
