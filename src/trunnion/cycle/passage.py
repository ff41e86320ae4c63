"""A mechanism passed forward or backward through positions: efforts, where it locks, and what flows where.

All of it is read from the equations φ = law(N(R₀ + G φ)) that `friction.settle` has solved, one set for each module.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.solve import continuation
from trunnion.solve.backward import Backward, Given, backward
from trunnion.solve.bristles import histories
from trunnion.solve.forward import Forward
from trunnion.solve.friction import FrictionProblem, frictionless, scaled
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.friction_problem import largest
from trunnion.solve.loads import useful_powers

if TYPE_CHECKING:
    from trunnion.solve.run import Run

__all__ = ["Passage", "critical_multiples", "locks", "passage", "passed", "reverse"]

Array = NDArray[np.float64]


class Passage(NamedTuple):
    """Positions passed forward or backward: effort of every driver, where it locks, and what flows where.

    delivered: power that the drivers take out, W; acting: power that loads, springs, weight and inertia put in, W;
    given: that of the useful loads and springs alone.
    """

    efforts: dict[str, Array]
    locked: NDArray[np.bool_]
    delivered: Array
    acting: Array
    given: Array


def reverse(run: Run, ahead: Forward, method: FrictionMethod) -> Passage:
    """Drive the mechanism backward through the positions of a walk: speeds turned round, friction and all that resists
    with them; inertia stays, for accelerations do."""
    return passed(run, ahead.backward(), method)


def passed(run: Run, walk: Forward, method: FrictionMethod) -> Passage:
    """Positions of a walk, in its direction."""
    turned, time = walk.direction < 0, np.asarray(walk.time, float)
    past = histories(run.system, run.values, run.chosen.assembly, run.cycle, turned)
    time = run.cycle.duration - time if turned else time
    deflections = {joint: history.at(time) for joint, history in past.items()}
    with np.errstate(all="ignore"):
        return passage(backward(walk, method, Given({}, deflections)))


def passage(back: Backward) -> Passage:
    """What flows where as the positions are passed in the direction of a walk that is solved."""
    walk, shape = back.walk, np.shape(back.walk.time)
    efforts = {name: np.broadcast_to(effort, shape) for name, effort in back.efforts.items()}
    delivered = -sum((effort * walk.rate(name) for name, effort in efforts.items()), np.zeros(shape))
    powers = useful_powers(walk.system.mechanism, back.load_powers, back.springs)
    given = sum((np.broadcast_to(power, shape) for power in powers), np.zeros(shape))
    every = [back.body_power, *back.load_powers.values(), *(spring.power for spring in back.springs.values())]
    acting = sum((np.broadcast_to(power, shape) for power in every), np.zeros(shape))
    return Passage(efforts, locks(back), delivered, acting, given)


def locks(back: Backward) -> NDArray[np.bool_]:
    """Where a module locks."""
    shape = np.shape(back.walk.time)
    locked = np.zeros(shape, bool)
    for settled in back.settled:
        locked |= np.broadcast_to(np.asarray(settled.share) < 1.0, shape)
    return locked


def critical_multiples(back: Backward, most: float) -> dict[str, Array]:
    """For each joint the multiple of its own friction at which it locks its module, the others' being as they are.

    ∞ where it does not up to `most`, 0 where the module locks even without friction in this joint, NaN where it has no
    loads, because another one locks.
    """
    system, positions = back.walk.system, np.shape(back.walk.time)
    found: dict[str, Array] = {}
    for number, settled in zip(reversed(range(len(system.plan.modules))), back.settled, strict=True):
        if settled.problem is None:
            continue
        contacts = settled.problem.contacts
        places = list(dict.fromkeys(contact.joint for contact in contacts if contact.rubs))
        if not places:  # nothing but gears pushed apart
            continue
        own = np.array([[contact.joint == place for contact in contacts] for place in places], bool)
        loads = largest(settled.problem.state([0.0] * len(contacts)).normals)
        for place, multiple in zip(places, _alone(settled.problem, own, most), strict=True):
            multiple = np.where(np.isfinite(loads), multiple, np.nan)
            found[system.places[number][place].joint] = np.broadcast_to(multiple, positions)
    return {joint: found[joint] for joint in system.joints if joint in found}


def _alone(problem: FrictionProblem, own: NDArray[np.bool_], most: float) -> list[Array]:
    """The multiples for the contacts of each joint: the others' friction is raised to full first, then theirs.

    own: (joint, contact). The joints are followed side by side, each in lanes of its own.
    """
    every, all_ = problem.picked(True)
    bounds = [np.asarray(problem.bound([most if mine else 1.0 for mine in row])) for row in own]
    doubtful = np.array([np.broadcast_to(np.isfinite(bound) & (bound >= 1.0), all_.shape) for bound in bounds])
    result = np.full(doubtful.shape, np.inf)
    joint, lane = np.nonzero(doubtful.reshape(len(own), -1))
    if len(lane):
        part, mine = every.mapped(lambda number: number[lane]), own[joint].T

        def weights(share: Array) -> Sequence[Array]:
            others_, theirs = np.minimum(share, 1.0), np.maximum(share - 1.0, 0.0)
            return list(np.where(mine, theirs, others_))

        _, reached = continuation.follow(scaled(part, weights), frictionless(part), 1.0 + most)
        result[doubtful] = np.where(reached >= 1.0 + most, np.inf, np.maximum(reached - 1.0, 0.0))
    return list(result)
