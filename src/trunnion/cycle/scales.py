"""The scales of a mechanism: the largest length, rate and force that occur in its cycle."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trunnion.algebra.dual import primal
from trunnion.cycle.fill import allocate, fill_chunk
from trunnion.errors import Status
from trunnion.results.dataset import Scales, powers_of
from trunnion.solve.run import Run

CANCELLED = 1e-4  # of what masses and springs may exert: the least that counts as a force beside their rounding
LOOKED = 24  # positions: the scales are orders of magnitude


def scales_of(run: Run) -> Scales:
    """The scales over the cycle, whatever positions are asked for; pins are in the middle of their play."""

    def looked() -> Scales:
        time = run.cycle.times(LOOKED if run.cycle.duration > 0 else 1)
        arrays = allocate(run.system, len(time))
        with np.errstate(all="ignore"):
            fill_chunk(arrays, run.solve(time), slice(None))
        return largest(run, arrays)

    return run.once("scales", looked)


def largest(run: Run, arrays: Mapping[str, NDArray[np.float64]]) -> Scales:
    """The scales of some positions.

    Positions near a dead centre count only if there are no others: their forces and rates have no bound. Of points
    those of the joints count, and of stated forces those on links that move: nothing else is in what is solved.

    Parameters
    ----------
    run
        Of the mechanism: its loads and weights count too, for they may cancel at every position.
    arrays
        Over the positions, by the names of `results.variables`.
    """
    system, mechanism = run.system, run.system.mechanism
    sound = arrays["status"] < Status.NEAR_SINGULAR
    if np.any(sound):
        arrays = {name: array[..., sound] for name, array in arrays.items() if array.shape[-1:] == sound.shape}
    joints = [point in system.joints for _, point in system.points]
    size = float(np.max(primal(system.size(run.values))))  # joints that meet in one point have places of rounding only
    length = max(size, peak(arrays["point_position"][joints]), peak(arrays["joint_slide"]))
    speed = max(peak(arrays["joint_slide_velocity"]), peak(arrays["point_velocity"][joints]))
    rate = max(peak(arrays["joint_rotation_velocity"]), speed / length) or 1 / (run.cycle.duration or 1.0)
    forces, torques, sources = _stated(run, length, rate)
    forces.append(peak(arrays["reaction_force"]))
    torques.append(peak(arrays["reaction_moment"]))
    for driver, efforts in zip(mechanism.drivers, arrays["drive_effort"], strict=True):
        (torques if system.turns(driver) else forces).append(peak(efforts))
    return Scales(length, rate, max(*forces, max(torques) / length, CANCELLED * sources))


def _stated(run: Run, length: float, rate: float) -> tuple[list[float], list[float], float]:
    """Stated forces with the weight of all links that move, N, stated moments, N m, and the largest force, N, that
    masses and springs have at the scales of the motion: of such all forces are differences, whose rounding is there
    where they cancel."""
    mechanism, values = run.system.mechanism, run.values
    gravity = float(np.linalg.norm([peak(primal(values.get(f"gravity.{axis}", 0.0))) for axis in "xyz"]))
    masses = [peak(primal(values[f"links.{name}.mass"])) for name in mechanism.links if f"links.{name}.mass" in values]
    resting = {name for name, load in mechanism.loads.items() if load.link == mechanism.fixed_link}
    sizes, sources = {"N": [gravity * sum(masses)], "N m": [0.0]}, [0.0]
    for path, entry in mechanism.parameter_set.entries.items():
        if path not in values:
            continue
        section, unit = entry.location[0], entry.kind.unit
        if unit in sizes and not (section == "loads" and entry.location[1] in resting):
            sizes[unit].append(peak(primal(values[path])))
        lengths, rates, forces = powers_of(unit)[0] if section in ("links", "springs") else (0, 0, 0)
        if forces == 1.0 and (lengths or rates):
            with np.errstate(all="ignore"):  # a scale beyond the floats makes no force
                scale = np.float64(length) ** -lengths * np.float64(rate) ** -rates
                sources.append(float(np.nan_to_num(peak(primal(values[path])) * scale, posinf=0.0)))
    return sizes["N"], sizes["N m"], max(sources)


def peak(values: ArrayLike) -> float:
    """Largest magnitude, without a copy of the values; 0 of none."""
    return float(max(np.nanmax(values, initial=0.0), -np.nanmin(values, initial=0.0)))
