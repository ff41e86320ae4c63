"""Trunnion's side of the comparison: as arrays, and as the whole `analyse` with its Dataset."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.side import MOTION_COLUMNS, OUTPUTS, Job, Side, version

if version("trunnion"):
    from trunnion import Mechanism, analyse
    from trunnion.solve.forward import forward
    from trunnion.solve.run import prepare

Array = NDArray[np.floating[Any]]
MODEL = Path(__file__).parents[1] / "examples" / "durango-fourbar.yaml"
CHUNK = 8192  # positions at a time
LINKS = ("crank", "coupler", "rocker")
FORCE_OUTPUTS = OUTPUTS[:-1]  # without the number of iterations

__all__ = ["compiled_side", "compiled_threads_side", "dataset_side", "trunnion_side"]


def trunnion_side(job: Job) -> Side | None:
    """Trunnion on `examples/durango-fourbar.yaml`, all outputs kept as arrays; None if it is not installed."""
    if not version("trunnion"):
        return None
    mechanism = Mechanism.read(MODEL)
    prepared = prepare(mechanism.with_friction("off") if job == "frictionless" else mechanism)
    columns = MOTION_COLUMNS if job == "motion" else FORCE_OUTPUTS
    rows: Callable[[Any, Array], Iterator[Any]] = _motion_rows if job == "motion" else _force_rows

    def run(n: int) -> Array:
        times = prepared.cycle.times(n)
        out = np.empty((len(columns), n))
        for start in range(0, n, CHUNK):
            part = slice(start, start + CHUNK)
            for k, numbers in enumerate(rows(prepared, times[part])):
                out[k, part] = numbers
        return out

    return Side("Trunnion", job, run, np.transpose, columns, note=version("trunnion"))


def compiled_side(job: Job, threads: int = 1) -> Side | None:
    """The same numbers by the compiled engine; None where Trunnion is not installed."""
    if not version("trunnion"):
        return None
    from trunnion.solve.walk_kernel import Lanes, WalkKernel

    mechanism = Mechanism.read(MODEL)
    prepared = prepare(mechanism.with_friction("off") if job == "frictionless" else mechanism)
    columns = MOTION_COLUMNS if job == "motion" else FORCE_OUTPUTS

    def figure(k: int) -> Callable[[Any], Any]:
        if job == "motion":
            return lambda back: list(_rows_of_motion(back.walk))[k]
        return lambda back: list(_rows_of_forces(back))[k]

    kernel = WalkKernel(prepared, {name: figure(k) for k, name in enumerate(columns)}, job != "motion", threads=threads)

    def run(n: int) -> Array:
        out = np.empty((len(columns), 1, n))
        lanes = Lanes(dict(zip(columns, out, strict=True)), np.empty((1, n), np.int8), np.empty((1, n), bool))
        times = prepared.cycle.times(n)
        kernel.fill(prepared.values, times, lanes)
        kernel.decide(prepared.values, times, lanes)
        return out[:, 0]

    name = "Trunnion compiled" if threads == 1 else f"Trunnion compiled, {threads} threads"
    return Side(name, job, run, np.transpose, columns, note=f"llvmlite {version('llvmlite')}")


def compiled_threads_side(job: Job) -> Side | None:
    """The same on two threads."""
    return compiled_side(job, threads=2)


def dataset_side(job: Job) -> Side | None:
    """The public `analyse`: also points, balance, diagnosis and efficiency, as a labelled Dataset."""
    if not version("trunnion"):
        return None
    mechanism = Mechanism.read(MODEL)

    def table(found: Any) -> Array:
        links = found.sel(link=list(LINKS))
        blocks = [links[name] for name in ("link_angle", "link_angle_velocity", "link_angle_acceleration")]
        force = found["reaction_force"].transpose("joint", "axis", "position")
        blocks += [force.stack(component=("joint", "axis")).transpose("component", "position")]
        blocks += [found[name] for name in ("friction_torque", "friction_power", "drive_effort")]
        return np.concatenate([np.asarray(block) for block in blocks]).T

    return Side("Trunnion analyse()", job, lambda n: analyse(mechanism, steps=n), table, FORCE_OUTPUTS, note="Dataset")


def _motion_rows(prepared: Any, times: Array) -> Iterator[Any]:
    """The numbers of MOTION_COLUMNS for one chunk."""
    yield from _rows_of_motion(forward(prepared.system, prepared.values, prepared.chosen.assembly, times))


def _rows_of_motion(walk: Any) -> Iterator[Any]:
    yield from _link_rows(walk)
    b, c = walk.point("crank", "B"), walk.point("rocker", "C")
    for at_b, at_c in zip(b, c, strict=True):  # position, velocity, acceleration
        yield from (*at_b, *at_c)


def _force_rows(prepared: Any, times: Array) -> Iterator[Any]:
    """The numbers of FORCE_OUTPUTS for one chunk."""
    yield from _rows_of_forces(prepared.solve(times))


def _rows_of_forces(back: Any) -> Iterator[Any]:
    yield from _link_rows(back.walk)
    for joint in "ABCD":
        yield from back.reactions[joint][:2]
    for joint in "ABCD":
        yield back.friction[joint]
    for joint in "ABCD":
        yield -back.friction[joint] * back.walk.speed(joint)
    yield back.efforts["A"]


def _link_rows(walk: Any) -> Iterator[Any]:
    """Angle, velocity and acceleration of the links."""
    motions = [walk.motions[link] for link in LINKS]
    yield from (np.arctan2(motion.frame.s, motion.frame.c) for motion in motions)
    yield from (motion.twist.w for motion in motions)
    yield from (motion.acceleration.w for motion in motions)
