"""What is to know of locking beside the margin: which joint does it, other solutions, and the way back.

All of it is read from the equations φ = law(N(R₀ + G φ)) that `friction.settle` has solved, one set for each module.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import linalg
from trunnion.algebra.dual import primal
from trunnion.errors import Finding
from trunnion.results.figure import MORE_THAN, Figure
from trunnion.results.scales import extreme_place
from trunnion.results.sentences import finding_for
from trunnion.solve import continuation
from trunnion.solve.backward import Backward, Given, backward
from trunnion.solve.bristles import histories
from trunnion.solve.forward import Forward
from trunnion.solve.friction import FrictionProblem, frictionless, identity_minus, scaled
from trunnion.solve.friction_method import MARGIN, FrictionMethod, peak
from trunnion.solve.loads import useful_powers
from trunnion.solve.system import Dial, law_of

if TYPE_CHECKING:
    from trunnion.solve.run import Run

__all__ = [
    "Locking",
    "Passage",
    "critical_figure",
    "critical_multiples",
    "findings",
    "least_margin",
    "locks",
    "look",
    "others",
    "passage",
    "passed",
    "reverse",
]

Array = NDArray[np.float64]
STARTS = 48
ROUNDS = 40
SEED = 1785  # of the starts
LOOKED = 360  # positions
SAME = 1e-6  # of the largest force: two solutions nearer than this are one


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
        loads = peak(settled.problem.state([0.0] * len(contacts)).normals)
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


# ---- other solutions ------------------------------------------------------------------------------------------


def others(back: Backward) -> Array:
    """How many solutions at full friction were found beside the one that grows from no friction, by position.

    Only where the certificate of uniqueness fails is there anything to look for: there by Newton's method from many
    starts, so it is a count of those found, not a proof that there are no more.
    """
    total: Array = np.zeros(np.shape(back.walk.time))
    for settled in back.settled:
        if settled.problem is None or np.all(settled.certain):
            continue
        part, chosen = settled.problem.picked(~np.asarray(settled.certain))
        known = [np.broadcast_to(np.asarray(force, float), chosen.shape)[chosen] for force in settled.forces]
        count = np.zeros(chosen.shape)
        count[chosen] = _count(part, np.array(known))
        total = total + count
    return total


def _count(problem: FrictionProblem, known: Array) -> Array:
    """Solutions other than the known ones (contact, lane), NaN where there is none, lane by lane."""
    contacts, lanes = known.shape
    many = problem.mapped(lambda number: np.repeat(number, STARTS))
    scale = np.repeat(_size(problem, lanes), STARTS)
    rng = np.random.default_rng(SEED)
    factors = rng.choice([-1.0, 1.0], (contacts, lanes * STARTS)) * 10 ** rng.uniform(-1.5, 2.0, lanes * STARTS)
    forces = list(factors * scale)
    with np.errstate(all="ignore"):
        for _ in range(ROUNDS):
            state = many.state(forces)
            residual = [f - t for f, t in zip(forces, many.target(state.normals), strict=True)]
            (move,) = linalg.solve(identity_minus(many.map_derivative(state)), residual)
            forces = [f - m for f, m in zip(forces, move, strict=True)]
        target = many.target(many.state(forces).normals)
        error = np.max(np.abs(np.array(forces) - np.array(target)), axis=0)
        found = np.array(forces).reshape(contacts, lanes, STARTS)
        closed = (error <= 1e-9 * np.maximum(scale, np.max(np.abs(forces), axis=0))).reshape(lanes, STARTS)
    counted = np.zeros(lanes)
    for i in range(lanes):
        counted[i] = _distinct(found[:, i, closed[i]], known[:, i], scale[i * STARTS])
    return counted


def _size(problem: FrictionProblem, lanes: int) -> Array:
    """The largest load without friction, N."""
    normals = problem.state([np.zeros(lanes) for _ in problem.contacts]).normals
    largest: Array = np.max([np.abs(np.broadcast_to(normal, lanes)) for normal in normals], axis=0)
    return largest + 1e-300


def _distinct(found: Array, known: Array, scale: float) -> float:
    """How many of the columns are neither alike nor the known one."""
    kept = [known] if np.all(np.isfinite(known)) else []
    before = len(kept)
    for column in found.T:
        near = SAME * max(scale, float(np.max(np.abs(column))))
        if all(np.max(np.abs(column - other)) > near for other in kept):
            kept.append(column)
    return float(len(kept) - before)


# ---- the way back ---------------------------------------------------------------------------------------------


def least_margin(name: str, subject: str, values: Array, dial: Dial, note: str = "") -> Figure:
    """The least of multiples of friction over the cycle; MARGIN is as far as they are looked for."""
    if np.all(np.isnan(values)):
        return Figure(name, subject, None, note=note)
    if not np.any(np.isfinite(values)):
        return Figure(name, subject, MARGIN, aspect=MORE_THAN, note=note)
    at = int(np.nanargmin(values))
    return Figure(
        name, subject, values[at], aspect="minimum", place=extreme_place(values, f"at {dial.at(at)}"), note=note
    )


def critical_figure(run: Run, joint: str, multiple: float, place: str) -> Figure:
    """The critical friction of a joint alone: its coefficient if its law is proportional to one, else the multiple."""
    parameter = law_of(run.system, joint).scale
    if not multiple > 0:
        return Figure(
            f"{joint}.critical_multiple",
            f"critical multiple of the friction of {joint} alone (it locks even without)",
            0.0,
            place=place,
        )
    if not parameter:
        subject = f"critical multiple of the friction of {joint} alone"
        return Figure(f"{joint}.critical_multiple", subject, multiple, place=place)
    value = float(np.ravel(primal(run.values[f"joints.{joint}.friction.{parameter}"]))[0])
    subject = f"critical friction {parameter} of {joint} alone"
    return Figure(f"{joint}.critical_{parameter}", subject, multiple * value, place=place)


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
        other = backward(walk, method, Given({}, deflections))
    return passage(other)


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


# ---- over a cycle ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Locking:
    """What one cycle shows, looked at some times (s).

    ahead, back: the positions passed forward and backward; first: time, s, of the least margin, None if all are beyond
    what was looked for; critical: for each joint, the multiple of its own friction at
    which it locks there; others: solutions at full friction beside the one that grows from none.
    """

    times: Array
    ahead: Passage
    first: float | None
    critical: dict[str, float]
    others: Array
    back: Passage

    def responsible(self) -> tuple[str, float] | None:
        """The joint whose friction, changed alone, decides, and the multiple of it at which it does.

        Of a mechanism that runs, the first to lock it; of one that is locked, the one that need be lowered the least.
        """
        sound = {joint: multiple for joint, multiple in self.critical.items() if np.isfinite(multiple)}
        locked = [joint for joint, multiple in sound.items() if multiple < 1.0]
        if locked:
            joint = max(locked, key=sound.__getitem__)
            return (joint, sound[joint]) if sound[joint] > 0 else None
        joint = min(sound, key=sound.__getitem__, default="")
        return (joint, sound[joint]) if joint else None

    def figures(self, run: Run, place: str) -> list[Figure]:
        """The joint that decides, at the place of the least margin."""
        decides = self.responsible()
        return [] if decides is None else [critical_figure(run, *decides, place)]


def look(
    run: Run,
    time: Array,
    margin: Array,
    method: FrictionMethod,
    walked: Backward | None = None,
    worst: float | None = None,
) -> Locking:
    """Look at no more than LOOKED times of a cycle.

    margin: of every position analysed, NaN where unknown; walked: the walk through all of them by the method, if it is
    there, which is not taken again; worst: time, s, of the least margin, that of the position with it if not given.
    """
    times = run.cycle.times(min(len(time), LOOKED))
    plain = replace(method, name="newton", margin_up_to=0.0)
    same = walked is not None and len(times) == len(time) and method.name == plain.name
    if len(times) == len(time) and np.all(margin < 1.0):  # at each of them: there is nothing left to be solved
        more, unknown = np.zeros(len(times)), np.full(len(times), np.nan)
        ahead, behind = (
            Passage({}, np.ones(len(times), bool), unknown, unknown, unknown),
            reverse(run, run.walk(times), plain),
        )
    else:
        known = walked if same else None
        key = "both ways", len(times), plain
        ahead, more, behind = run.once(key, lambda: _both_ways(run, times, plain, known))
    if worst is None and np.any(np.isfinite(margin)):
        worst = float(time[int(np.nanargmin(margin))])
    critical: dict[str, float] = {}
    if worst is not None:
        place, most = worst, method.margin_up_to
        critical = run.once(("critical", place, plain, most), lambda: _critical(run, np.array([place]), plain, most))
    return Locking(times, ahead, worst, critical, more, behind)


def _critical(run: Run, time: Array, method: FrictionMethod, most: float) -> dict[str, float]:
    """The critical multiples of the joints at one time."""
    at = critical_multiples(run.solve(time, method=method), most)
    return {joint: float(multiple[0]) for joint, multiple in at.items()}


def _both_ways(
    run: Run, times: Array, method: FrictionMethod, walked: Backward | None
) -> tuple[Passage, Array, Passage]:
    """The way forward, other solutions, and the way back. walked: the walk through these times, if it is there."""
    back = walked or run.solve(times, method=method)
    return passage(back), others(back), reverse(run, back.walk, method)


def findings(near: Locking, dial: Dial) -> Iterator[Finding]:
    """What to say of other solutions."""
    more = np.flatnonzero((near.others > 0) & ~near.ahead.locked)
    if len(more):
        count = int(np.max(near.others[more]))
        yield finding_for("friction.other_solutions", "joints", count=count, at=dial.intervals(more))


def locks(back: Backward) -> NDArray[np.bool_]:
    """Where a module locks."""
    shape = np.shape(back.walk.time)
    locked = np.zeros(shape, bool)
    for settled in back.settled:
        locked |= np.broadcast_to(np.asarray(settled.share) < 1.0, shape)
    return locked
