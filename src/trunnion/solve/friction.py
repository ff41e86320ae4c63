"""Friction and reactions of one module, settled with each other.

The reactions are linear in the friction loads, R(φ) = R₀ + Σ_l G_l φ_l, so a module is asked once for R₀ and once
for each G_l; what remains is φ_k = law(N_k(R), slip_k), one equation for each joint with friction. φ is the
friction force at the contact, N: the friction torque of a pin is φ r.

Two methods: [D]'s successive approximation, steps 1 to 5, and Newton (default). Where the friction is too
strong for the map φ → law(N(R(φ))) to be a contraction, the solution is followed from no friction to full
friction; where it ceases to exist on the way, the module is locked, and the share of the friction at which that
happens is reported.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import linalg
from trunnion.algebra.dual import Dual, primal
from trunnion.algebra.literal import is_zero
from trunnion.algebra.namespace import Number, looped
from trunnion.algebra.nested import replaced
from trunnion.joints.friction import LawFunction
from trunnion.joints.pairs import Reaction
from trunnion.solve import continuation
from trunnion.solve.friction_method import FrictionMethod, peak
from trunnion.solve.friction_problem import Contact, FrictionProblem, State, added, largest, total

__all__ = [
    "Contact",
    "FrictionMethod",
    "FrictionProblem",
    "Settled",
    "balance",
    "frictionless",
    "identity_minus",
    "primal_of",
    "scaled",
    "settle",
    "with_own",
]

OBEYED = 1e-10  # of the largest friction: by how much a friction may miss its law where it is called settled
SETTLED = 1e-11  # of the largest friction: where the iteration ends
SLOW = 1e-2  # of the miss: a round of Newton's method that leaves more has another matrix after it
STUBBORN = 20  # rounds of Newton's method: a lane that takes more goes back and forth between the sides of a kink
COMPILED_ROUNDS = 3  # of Newton's method where the numbers have no values to tell when to end; one more beyond FEW
FEW = 3  # contacts of a dyad


class Reacting(Protocol):
    """A module, as far as its reactions go: flat tuples, linear in the loads on its links."""

    def reactions(self, pose: Any, loads: Sequence[Any]) -> Sequence[Reaction]: ...


class Settled(NamedTuple):
    """Reactions (friction not included) and friction forces, with the figures of the iteration.

    share: largest share of the friction for which a solution that starts frictionless was found, 1 unless the
    module locks; contraction: ∞-norm of the derivative of φ → law(N(R(φ))) (Newton), or the ratio of the last two
    changes (successive approximation). residual: largest difference between a friction and what its law says for the
    load that is found, N; where converged below OBEYED of the largest friction, unless a criterion is given. certain:
    whether it is proved that there is no other solution; problem: the equations themselves.
    """

    reactions: Sequence[Reaction]
    forces: list[Number]
    iterations: Number
    change: Number
    contraction: Number
    converged: Number
    residual: Number = 0.0
    share: Number = 1.0
    certain: Number = True
    problem: FrictionProblem | None = None


def settle(
    group: Reacting, pose: object, loads: Sequence[Any], contacts: Sequence[Contact], method: FrictionMethod
) -> Settled:
    """Reactions and friction forces of one module under `loads` (about the link origins, friction not included)."""
    start = group.reactions(pose, loads)
    if not contacts:
        return Settled(start, [], 0, 0.0, 0.0, True)
    if method.multiple is not None:
        contacts = [_times(method.multiple, contact) if contact.rubs else contact for contact in contacts]
    influence = [with_own(contact, list(group.reactions(pose, contact.unit_loads))) for contact in contacts]
    problem = FrictionProblem(contacts, start, influence)
    if method.name == "successive-approximation":
        return _successive(problem, method)
    if problem.one_way:
        return _at_once(problem)
    return _unrolled(problem, method) if problem.compiled else _newton(problem, method)


def _times(multiple: Number, contact: Contact) -> Contact:
    """The contact with a multiple of its friction."""
    law = replace(contact.law, function=functools.partial(_multiplied, contact.law.function))
    return contact._replace(law=law, parameters={**contact.parameters, "multiple": multiple})


def _multiplied(function: LawFunction, normal: Number, slip: Number, *, multiple: Number, **own: Number) -> Number:
    """A multiple of what the law says."""
    return multiple * function(normal, slip, **own)


def with_own(contact: Contact, column: list[Reaction]) -> list[Reaction]:
    """What 1 N of friction changes in the reactions of a module, with what the joint itself feels of it."""
    if contact.own is not None:
        column[contact.joint] = added(column[contact.joint], contact.own)
    return column


def _newton(problem: FrictionProblem, method: FrictionMethod) -> Settled:
    """Newton from no friction; lanes without the certificate of `bound` are followed by continuation.

    So are certain lanes that kinks keep from settling: their continuation leads to the same, only solution. The rounds
    counted are Newton's. A followed lane gets as many as it needs to obey its laws, as the others do.
    """
    real = primal_of(problem)
    none: list[Number] = [0.0] * len(real.contacts)
    # a lane whose loads are no numbers, because another module locked or opened, is not this module's affair
    state = real.state(none)
    bound = np.where(np.isfinite(peak(state.normals)), real.bound(), 0.0)
    certain = ~(bound >= 1.0)
    found = _iterated(real, _Iterate(none, ~certain, state, real.gaps(state, none)), method)
    shares: Number = 1.0
    left = ~certain
    if method.limit >= STUBBORN:
        left = left | ~(found.done | _obeyed(real, found))
    if np.any(left):
        forces, shares = _follow(real, found.forces, left)
        state = real.state(forces)
        again = _Iterate(forces, ~left, state, real.gaps(state, forces), found.rows, found.inverse, found.rounds)
        found = _iterated(real, again, method)
    state, rows, inverse = found.state, found.rows, found.inverse
    depth = _depth(problem)
    forces = found.forces
    if depth:  # the ε parts need the matrix of the solution, not that of the way there
        rows = real.map_derivative(state)
        inverse = linalg.quick_inverse(identity_minus(rows))
    for _ in range(depth):
        forces = _corrected(forces, problem.gaps(problem.state(forces), forces), inverse)
        state = problem.state(forces)
    # of no lanes at all nothing is known
    contraction = largest([total([np.abs(entry) for entry in row]) for row in rows]) if rows else 0.0
    converged = found.done if method.criterion is not None else _obeyed(real, found)
    return Settled(
        reactions=problem.reactions(forces, state),
        forces=forces,
        iterations=found.rounds,
        change=found.change,
        contraction=contraction,
        converged=converged & (shares >= 1.0),
        residual=real.misfit(found.gaps),
        share=shares,
        certain=certain,
        problem=real,
    )


@dataclass(frozen=True)
class _Iterate:
    """Where Newton's method is: forces and, by lane, whether it is done there.

    state, gaps: reactions and law − force under these forces; rows, inverse: A and (1 − A)⁻¹ as last needed; rounds,
    change: how many it took and the last change of a normal load, N.
    """

    forces: list[Number]
    done: Number
    state: State
    gaps: list[Number]
    rows: Sequence[Sequence[Number]] = ()
    inverse: Sequence[Sequence[Number]] = ()
    rounds: Number = 0
    change: Number = np.inf


def _obeyed(real: FrictionProblem, at: _Iterate) -> Number:
    """Where every law is obeyed as closely as a solved position promises; NaN is no answer and breaks no promise."""
    return ~(real.excess(at.gaps, at.forces) > OBEYED)


def _iterated(real: FrictionProblem, start: _Iterate, method: FrictionMethod) -> _Iterate:
    """Newton's method from a start, in the lanes that are not done; those that are stay as they are.

    A is that of the side of each kink on which the normal loads are. It is kept while a round leaves less than a
    hundredth of the residual, which in all but the worst cases is always; a lane that crosses a kink leaves more and
    gets the A of its new side. So what a lane comes to does not depend on the lanes beside it. It is done when every
    friction is what its law says for the load, whatever the last round changed.
    """
    forces, done, state, gaps = start.forces, start.done, start.state, start.gaps
    rows, inverse, rounds, change = start.rows, start.inverse, start.rounds, start.change
    excess: Number = 1.0  # of no friction at all
    slow: Number = ~done
    for _ in range(min(method.limit, STUBBORN)):
        going = ~done
        if not np.any(going):
            break
        rounds = rounds + going
        if np.any(slow):
            fresh = real.map_derivative(state)
            rows = _chosen(slow, fresh, rows)
            inverse = _chosen(slow, linalg.quick_inverse(identity_minus(fresh)), inverse)
        (forces,) = _chosen(going, [_corrected(forces, gaps, inverse)], [forces])
        before, state = state, real.state(forces)
        gaps = real.gaps(state, forces)
        previous, excess = excess, real.excess(gaps, forces)
        here = _changed(state, before)
        change = np.where(going, here, change)
        # a lane of NaN has nothing to wait for
        ends = ~(excess > SETTLED) if method.criterion is None else ~np.greater(here, method.criterion)
        done = done | ends
        slow = (excess > SLOW * previous) & ~done
    return _Iterate(forces, done, state, gaps, rows, inverse, rounds, change)


def _chosen(lanes: Number, rows: Sequence[Sequence[Number]], others: Sequence[Sequence[Number]]) -> list[list[Number]]:
    """The rows in the chosen lanes, the others elsewhere; either whole where that is what it comes to."""
    if not others or np.all(lanes):
        return [list(row) for row in rows]
    if not np.any(lanes):
        return [list(row) for row in others]
    return [[np.where(lanes, a, b) for a, b in zip(*pair, strict=True)] for pair in zip(rows, others, strict=True)]


def _unrolled(problem: FrictionProblem, method: FrictionMethod) -> Settled:
    """Newton with a fixed number of rounds, for numbers that are compiled; the last one carries the derivatives.

    Lanes that need more, and those without the certificate, are for whoever compiles to compute again; so are those
    whose margin comes out as NaN.
    """
    real = primal_of(problem)
    forces: list[Number] = [0.0] * len(real.contacts)
    state = real.state(forces)
    bound = np.where(np.isfinite(peak(state.normals)), real.bound(), 0.0)
    certain = ~(bound >= 1.0)
    rows = real.map_derivative(state)

    def step(now: list[Number]) -> list[Number]:
        at = real.state(now)
        return _corrected(now, real.gaps(at, now), _matrix(real, at))

    if len(forces) <= FEW:  # written out: quicker to run, but not to compile
        for _ in range(COMPILED_ROUNDS - 2):
            forces = step(forces)
    else:
        forces = looped(step, forces, COMPILED_ROUNDS - 1)
    forces = step(forces)
    state = real.state(forces)
    forces = _corrected(forces, problem.gaps(problem.state(forces), forces), _matrix(real, state))
    before, state = state, problem.state(forces)
    plain = [primal(force) for force in forces]
    gaps = real.gaps(real.state(plain), plain)
    return Settled(
        reactions=problem.reactions(forces, state),
        forces=forces,
        iterations=COMPILED_ROUNDS,
        change=_changed(state, before),
        contraction=largest([total([np.abs(entry) for entry in row]) for row in rows]),
        converged=certain & ~(real.excess(gaps, plain) > SETTLED),
        residual=real.misfit(gaps),
        share=1.0,
        certain=certain,
        problem=real,
    )


def _matrix(problem: FrictionProblem, state: State) -> list[list[Number]]:
    """(1 − A)⁻¹ at a state where the rows of |A| add up to less than 1: no pivots are needed."""
    matrix = identity_minus(problem.map_derivative(state))
    return linalg.quick_inverse(matrix) if len(matrix) <= FEW else linalg.inverse(matrix, pivoting=False)


def _at_once(problem: FrictionProblem) -> Settled:
    """Friction from the frictionless reactions, which it does not change but in what no law looks at."""
    forces = problem.target(problem.state([0.0] * len(problem.contacts)).normals)
    reactions = problem.reactions(forces, problem.state(forces))
    return Settled(reactions, forces, 1, 0.0, 0.0, True, problem=primal_of(problem))


def _corrected(forces: Sequence[Number], gaps: Sequence[Number], inverse: Sequence[Sequence[Number]]) -> list[Number]:
    """φ + (1 − A)⁻¹ (law − φ)."""
    moves = [total([entry * part for entry, part in zip(row, gaps, strict=True)]) for row in inverse]
    return [move if is_zero(force) else force + move for force, move in zip(forces, moves, strict=True)]


def _changed(state: State, before: State) -> Number:
    """Largest change of a normal load, N."""
    return largest([a - b for a, b in zip(state.normals, before.normals, strict=True)])


def _successive(problem: FrictionProblem, method: FrictionMethod) -> Settled:
    """[D] steps 1-5: friction from the last reactions, reactions from the last friction, until they rest."""
    forces: list[Number] = [0.0] * len(problem.contacts)
    state = problem.state(forces)
    change: Number = np.inf
    previous: Number = np.inf
    done: Number = np.False_
    rounds: Number = 0
    for _ in range(method.limit):
        rounds = rounds + ~done
        forces = problem.target(state.normals)
        before, state = state, problem.state(forces)
        gaps = problem.gaps(state, forces)
        previous, change = change, _changed(state, before)
        done = ~(problem.excess(gaps, forces) > SETTLED) if method.criterion is None else ~(change > method.criterion)
        if np.all(done):
            break
    done = ~(problem.excess(gaps, forces) > OBEYED) if method.criterion is None else change <= method.criterion
    measurable = np.isfinite(previous) & (previous > 0)
    ratio = np.where(measurable, change / np.where(measurable, previous, 1.0), 0.0)
    real = primal_of(problem)
    bound = np.where(np.isfinite(peak(real.state([0.0] * len(real.contacts)).normals)), real.bound(), 0.0)
    return Settled(
        reactions=problem.reactions(forces, state),
        forces=forces,
        iterations=rounds,
        change=change,
        contraction=ratio,
        converged=done & np.isfinite(change),  # not so where it ran off to infinity
        residual=problem.misfit(gaps),
        certain=~(bound >= 1.0),
        problem=real,
    )


def _follow(
    problem: FrictionProblem, forces: Sequence[Number], lanes: Number
) -> tuple[list[Number], NDArray[np.float64]]:
    """Forces with the chosen lanes followed from no friction; NaN where they lock, and the share reached."""
    part, chosen = problem.picked(lanes)
    shape = chosen.shape
    found, reached = continuation.follow(scaled(part), frictionless(part))
    result = [replaced(force, chosen, value) for force, value in zip(forces, found, strict=True)]
    shares = np.ones(shape)
    shares[chosen] = reached
    return result, shares


def scaled(
    problem: FrictionProblem, weights: Callable[[Number], Sequence[Number]] | None = None
) -> continuation.System:
    """Residual φ − w(s) law(N(φ)) and its Jacobian. weights: multiple of each contact's friction at a share, or s."""
    last: list[Any] = [(), (), ()]  # forces, and what follows from them: the next share begins where one ended

    def laws(forces: Sequence[Number]) -> tuple[list[Number], list[list[Number]]]:
        if problem.compiled or not last[0] or not all(map(np.array_equal, forces, last[0])):
            state = problem.state(forces)
            last[:] = forces, problem.target(state.normals), problem.map_derivative(state)
        return last[1], last[2]

    def system(forces: Sequence[Number], share: Number) -> tuple[list[Number], list[list[Number]]]:
        multiples = [share] * len(problem.contacts) if weights is None else weights(share)
        return balance(problem, forces, *laws(forces), multiples)

    return system


def balance(
    problem: FrictionProblem,
    forces: Sequence[Number],
    target: Sequence[Number],
    slopes: Sequence[Sequence[Number]],
    multiples: Sequence[Number],
) -> tuple[list[Number], list[list[Number]]]:
    """Residual and Jacobian with multiples of the contacts' friction. target, slopes: of the laws, and derivatives."""
    shares = [multiple if contact.rubs else 1.0 for multiple, contact in zip(multiples, problem.contacts, strict=True)]
    residual = [f - s * t for f, s, t in zip(forces, shares, target, strict=True)]
    rows = [[s * entry for entry in row] for s, row in zip(shares, slopes, strict=True)]
    return residual, identity_minus(rows)


def frictionless(problem: FrictionProblem) -> list[Number]:
    """Forces without friction: none but those that push gears apart."""
    target = problem.target(problem.state([0.0] * len(problem.contacts)).normals)
    return [0.0 if contact.rubs else load for contact, load in zip(problem.contacts, target, strict=True)]


def identity_minus(rows: Sequence[Sequence[Number]]) -> list[list[Number]]:
    return [[(1.0 if k == j else 0.0) - entry for j, entry in enumerate(row)] for k, row in enumerate(rows)]


def _depth(problem: FrictionProblem) -> int:
    """Levels of ε among the inputs: each costs one Newton step at the solution."""
    return max((n.depth for n in problem.numbers if isinstance(n, Dual)), default=0)


def primal_of(problem: FrictionProblem) -> FrictionProblem:
    """The problem without derivatives."""
    return problem.mapped(primal) if _depth(problem) or problem.compiled else problem
