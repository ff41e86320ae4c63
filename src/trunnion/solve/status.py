"""What a solved position is worth: its status, from the walk alone."""

from __future__ import annotations

import functools
import operator
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import flat
from trunnion.errors import Status
from trunnion.solve.backward import Backward
from trunnion.solve.forward import Forward
from trunnion.solve.system import sticking

__all__ = ["pose_status", "pose_status_number", "status_number", "status_of"]


SINGULAR = 1e6  # condition from which less than about four digits would be left
NEAR_SINGULAR = 100.0  # a transmission angle of about a degree


def status_of(back: Backward, shape: tuple[int, ...]) -> NDArray[np.int8]:
    """The gravest status of every position."""
    return np.array(np.broadcast_to(status_number(back), shape), np.int8)


def pose_status(walk: Forward, shape: tuple[int, ...]) -> NDArray[np.int8]:
    """The gravest status of every position that its motion alone decides."""
    return np.array(np.broadcast_to(pose_status_number(walk), shape), np.int8)


def status_number(back: Backward) -> Number:
    """The gravest status in whatever shape the numbers of the walk have."""
    status = pose_status_number(back.walk)
    reactions = (number for reaction in back.reactions.values() for number in flat(tuple(reaction)[:2]))
    forces = (*back.efforts.values(), *back.friction.values(), *reactions)
    reasons = {
        Status.ZERO_SLIP: [back.resting[name] for name in sticking(back.walk.system)],
        Status.NOT_CONVERGED: [np.logical_not(back.converged), ~np.isfinite(_sum(forces))],
        Status.LOCKED: [np.less(back.share, 1.0)],
        Status.LOAD_UNDEFINED: back.undefined.values(),
    }
    for code, where in reasons.items():
        reached = functools.reduce(np.logical_or, where, np.False_)
        status = np.maximum(status, np.where(reached, np.int8(code), np.int8(0)))
    return status


def pose_status_number(walk: Forward) -> Number:
    """The gravest status that the motion alone decides, in whatever shape its numbers have."""
    condition = walk.condition
    status = np.where(condition > NEAR_SINGULAR, np.int8(Status.NEAR_SINGULAR), np.int8(Status.SOLVED))
    status = np.where(condition <= SINGULAR, status, np.int8(Status.SINGULAR))
    return np.where(walk.assembled, status, np.int8(Status.NOT_ASSEMBLED))


def _sum(numbers: Iterable[Number]) -> Number:
    """Without derivatives: whether it is finite is what is asked for."""
    return functools.reduce(operator.add, (primal(number) for number in numbers), 0.0)
