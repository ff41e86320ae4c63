"""Whole walks written into the arrays of a result: variables, statuses, and nothing where a status rules it out."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.cycle import diagnosis
from trunnion.cycle.deviations import fill_seats
from trunnion.cycle.fill import Into, fill_forces, fill_motion, fill_power, labels
from trunnion.cycle.unanswered import blank
from trunnion.results import variables as results
from trunnion.solve.backward import Backward
from trunnion.solve.margin import locking_margin
from trunnion.solve.status import status_of
from trunnion.solve.system import System

__all__ = ["CONDITIONS", "Arrays", "fill_chunk", "fill_lanes", "link_numbers", "write"]

Arrays = dict[str, NDArray[np.float64]]
CONDITIONS = "module_condition"  # (module, …, position), beside the variables of a result where somebody asks for it


def fill_chunk(
    arrays: Arrays,
    back: Backward,
    time: NDArray[np.float64],
    window: slice,
    causes: diagnosis.Causes | None = None,
) -> None:
    """Write one chunk into the result; what a status rules out becomes NaN."""
    status = status_of(back, arrays["status"][window].shape)
    arrays["status"][window] = status
    if causes:
        causes.note(back, status, np.arange(window.start, window.stop))
    with np.errstate(all="ignore"):
        write(arrays, back, time, window)
    blank(arrays, status, window)


def fill_lanes(
    arrays: Arrays,
    back: Backward,
    time: NDArray[np.float64],
    lanes: tuple[NDArray[np.intp], ...],
    causes: diagnosis.Causes | None = None,
) -> None:
    """The same of some positions, wherever they are: their numbers in the last dims of the arrays."""
    place: Any = (..., *lanes)
    there = {name: array for name, array in arrays.items() if array.flags.writeable and array.strides[-1]}
    some = {name: array[place] for name, array in arrays.items()}
    some |= {name: some[other] for name, other in results.SAME_AS.items() if name in some}
    fill_chunk(some, back, time, slice(0, len(lanes[-1])))
    if causes:
        causes.note(back, some["status"].astype(np.int8), lanes[-1])
    for name, array in there.items():
        # rows that stay as they are may be zeros that take no memory until they are written
        for row in np.argwhere(np.any(some[name] != array[place], axis=-1)):
            array[(*row, *lanes)] = some[name][tuple(row)]


def write(arrays: Into, back: Backward, time: Number, window: slice) -> None:
    """Every variable but the status, of one walk."""
    fill_motion(arrays, back, window)
    fill_forces(arrays, back, window)
    _fill_settled(arrays, back, window)
    fill_power(arrays, back, time, window)
    if "seat_offset" in arrays:
        fill_seats(arrays, back, window)
    if CONDITIONS in arrays:
        for i, (group, pose) in enumerate(zip(back.walk.system.groups, back.walk.poses, strict=True)):
            arrays[CONDITIONS][i, window] = group.condition(pose)


def _fill_settled(arrays: Into, back: Backward, window: slice) -> None:
    """Figures of the friction iteration."""
    settled = back.settled
    for key, field in (
        ("friction_iterations", "iterations"),
        ("friction_change", "change"),
        ("friction_residual", "residual"),
        ("friction_contraction", "contraction"),
    ):
        worst = functools.reduce(np.maximum, (getattr(one, field) for one in settled), 0.0)
        arrays[key][window] = worst
    arrays["locking_margin"][window] = locking_margin(back)


def link_numbers(system: System) -> list[tuple[int, int]]:
    """Numbers of the links of every joint."""
    links = labels(system)["link"]
    return [(links.index(first), links.index(second)) for _, (first, second) in system.joints.values()]
