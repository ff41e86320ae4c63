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

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import linalg
from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.namespace import Number
from trunnion.analysis import continuation
from trunnion.groups.planar import Wrench
from trunnion.groups.protocol import Group
from trunnion.joints.friction import FrictionLaw
from trunnion.joints.pairs import Load, Reaction

__all__ = ["Contact", "FrictionMethod", "Settled", "settle"]

Method = Literal["newton", "successive-approximation"]


@dataclass(frozen=True)
class FrictionMethod:
    """How friction and reactions are settled.

    name: "newton" or "successive-approximation" ([D] steps 1-5).
    criterion: largest change of a joint's reaction between two rounds, N, at which the iteration ends ([D] used
    1e-3 N); None: 1e-8 of the largest reaction for Newton, which is then exact to rounding, 1e-3 N for [D].
    limit: most rounds; a position that needs more is not converged.
    """

    name: Method = "newton"
    criterion: float | None = None
    limit: int = 200

    def tolerance(self, normals: Sequence[Number]) -> Number:
        """Allowed change, N."""
        if self.criterion is not None:
            return self.criterion
        if self.name == "successive-approximation":
            return 1e-3
        return 1e-8 * _largest(normals)


class Contact(NamedTuple):
    """A joint with friction, as its module sees it.

    joint: its number in the module; unit_loads: what a friction force of 1 N on the second side does to the
    links; load: normal load and its gradient from the joint's reaction; law with parameters; slip: m/s.
    """

    joint: int
    unit_loads: Sequence[Wrench]
    load: Load
    law: FrictionLaw
    parameters: dict[str, Number]
    slip: Number

    def mapped(self, change: Callable[[Number], Number]) -> Contact:
        """The same with `change` applied to every number that the laws see."""
        parameters = {name: change(value) for name, value in self.parameters.items()}
        return self._replace(load=self.load.mapped(change), parameters=parameters, slip=change(self.slip))


class Settled(NamedTuple):
    """Reactions (friction not included) and friction forces, with the figures of the iteration.

    share: largest share of the friction for which a solution that starts frictionless was found, 1 unless the
    module locks; contraction: ∞-norm of the derivative of φ → law(N(R(φ))) (Newton), or the ratio of the last two
    changes (successive approximation).
    """

    reactions: list[Wrench]
    forces: list[Number]
    iterations: int
    change: Number
    contraction: Number
    converged: Number
    share: Number


def settle(
    group: Group, pose: object, loads: Sequence[Wrench], contacts: Sequence[Contact], method: FrictionMethod
) -> Settled:
    """Reactions and friction forces of one module under `loads` (about the link origins, friction not included)."""
    start = group.reactions(pose, loads)
    if not contacts:
        return Settled(start, [], 0, 0.0, 0.0, True, 1.0)
    influence = [group.reactions(pose, contact.unit_loads) for contact in contacts]
    problem = _Problem(contacts, start, influence)
    state = _newton(problem, method) if method.name == "newton" else _successive(problem, method)
    return state._replace(reactions=problem.reactions(state.forces))


@dataclass(frozen=True)
class _Problem:
    """φ = law(N(R₀ + G φ))."""

    contacts: Sequence[Contact]
    start: Sequence[Wrench]
    influence: Sequence[Sequence[Wrench]]

    def mapped(self, change: Callable[[Number], Number]) -> _Problem:
        """The same with `change` applied to every number."""

        def each(wrenches: Sequence[Wrench]) -> list[Wrench]:
            return [Wrench(*(change(n) for n in wrench)) for wrench in wrenches]

        contacts = [contact.mapped(change) for contact in self.contacts]
        return _Problem(contacts, each(self.start), [each(column) for column in self.influence])

    def numbers(self) -> list[Number]:
        """All numbers of the problem."""
        found: list[Number] = []

        def note(number: Number) -> Number:
            found.append(number)
            return number

        self.mapped(note)
        return found

    def at(self, joint: int, forces: Sequence[Number]) -> Wrench:
        """Reaction of one joint under friction forces."""
        x, y, m = self.start[joint]
        for force, column in zip(forces, self.influence, strict=True):
            dx, dy, dm = column[joint]
            x, y = x + dx * force, y + dy * force
            if not (isinstance(dm, float) and dm == 0.0):
                m = m + dm * force
        return Wrench(x, y, m)

    def reactions(self, forces: Sequence[Number]) -> list[Wrench]:
        return [self.at(joint, forces) for joint in range(len(self.start))]

    def normals(self, forces: Sequence[Number]) -> list[Number]:
        return [contact.load.normal(self.at(contact.joint, forces)) for contact in self.contacts]

    def target(self, normals: Sequence[Number]) -> list[Number]:
        """What the laws say for these normal loads."""
        return [c.law.function(n, c.slip, **c.parameters) for c, n in zip(self.contacts, normals, strict=True)]

    def slopes(self, normals: Sequence[Number]) -> list[Number]:
        """Derivative of each law by its normal load."""
        return [
            derivative(c.law.function(Dual(n, 1.0), c.slip, **c.parameters))
            for c, n in zip(self.contacts, normals, strict=True)
        ]

    def map_derivative(self, normals: Sequence[Number], forces: Sequence[Number]) -> list[list[Number]]:
        """A with A_kl = ∂ law_k / ∂ φ_l."""
        rows = []
        for contact, normal, slope in zip(self.contacts, normals, self.slopes(normals), strict=True):
            gradient = contact.load.gradient(self.at(contact.joint, forces), normal)
            rows.append([slope * _along(gradient, column[contact.joint]) for column in self.influence])
        return rows

    def bound(self, slopes: Sequence[Number]) -> Number:
        """Largest row sum of |A| over all reactions: below 1 the solution exists, alone, for any share of friction."""
        rows = [
            sum(np.abs(primal(slope)) * primal(contact.load.bound(column[contact.joint])) for column in self.influence)
            for contact, slope in zip(self.contacts, slopes, strict=True)
        ]
        return _largest(rows)


def _newton(problem: _Problem, method: FrictionMethod) -> Settled:
    """Newton from no friction; lanes without the certificate of `bound` are followed by continuation."""
    real = _primal(problem)
    n = len(real.contacts)
    forces: list[Number] = [0.0] * n
    normals = real.normals(forces)
    bound = real.bound(real.slopes(normals))
    rows: list[list[Number]] = []
    change: Number = np.inf
    iterations = 0
    done: Number = False
    while iterations < method.limit and not np.all(done):
        iterations += 1
        rows, forces = _newton_step(real, normals, forces)
        before, normals = normals, real.normals(forces)
        change = _largest([after - n for after, n in zip(normals, before, strict=True)])
        done = ~(change > method.tolerance(normals))  # a lane of NaN has nothing to wait for
    shares: Number = 1.0
    certain = ~(bound >= 1.0)
    if not np.all(certain):
        forces, shares = _follow(real, forces, ~certain)
        normals = real.normals(forces)
        rows = real.map_derivative(normals, forces)
        done = np.where(certain, done, shares >= 1.0)
    for _ in range(_depth(problem)):
        residual = [a - b for a, b in zip(problem.target(problem.normals(forces)), forces, strict=True)]
        (step,) = linalg.solve(_identity_minus(rows), residual)
        forces = [f + s for f, s in zip(forces, step, strict=True)]
    contraction = _largest([sum(np.abs(entry) for entry in row) for row in rows])
    return Settled([], forces, iterations, change, contraction, done, shares)


def _newton_step(
    problem: _Problem, normals: Sequence[Number], forces: Sequence[Number]
) -> tuple[list[list[Number]], list[Number]]:
    """A at the present forces, and the forces after one step of (1 − A) δφ = law − φ."""
    rows = problem.map_derivative(normals, forces)
    residual = [a - b for a, b in zip(problem.target(normals), forces, strict=True)]
    (step,) = linalg.solve(_identity_minus(rows), residual)
    return rows, [f + s for f, s in zip(forces, step, strict=True)]


def _successive(problem: _Problem, method: FrictionMethod) -> Settled:
    """[D] steps 1-5: friction from the last reactions, reactions from the last friction, until they rest."""
    forces: list[Number] = [0.0] * len(problem.contacts)
    normals = problem.normals(forces)
    change: Number = np.inf
    previous: Number = np.inf
    done: Number = False
    iterations = 0
    while iterations < method.limit and not np.all(done):
        iterations += 1
        forces = problem.target(normals)
        before, normals = normals, problem.normals(forces)
        previous, change = change, primal(_largest([a - b for a, b in zip(normals, before, strict=True)]))
        done = ~(change > method.tolerance(normals))
    with np.errstate(all="ignore"):
        ratio = np.where(np.isfinite(previous) & (previous > 0), change / np.where(previous > 0, previous, 1.0), 0.0)
    return Settled([], forces, iterations, change, ratio, done, 1.0)


def _follow(problem: _Problem, forces: Sequence[Number], lanes: Number) -> tuple[list[Number], NDArray[np.float64]]:
    """Forces with the chosen lanes followed from no friction; NaN where they lock, and the share reached."""
    shape = np.broadcast_shapes(np.shape(lanes), *(np.shape(number) for number in problem.numbers()))
    chosen = np.broadcast_to(lanes, shape)
    part = problem.mapped(lambda number: np.broadcast_to(np.asarray(number, float), shape)[chosen])
    found, reached = continuation.follow(_scaled_system(part), len(problem.contacts), int(np.count_nonzero(chosen)))
    result = []
    for force, value in zip(forces, found, strict=True):
        whole = np.array(np.broadcast_to(force, shape), float)
        whole[chosen] = value
        result.append(whole)
    shares = np.ones(shape)
    shares[chosen] = reached
    return result, shares


def _scaled_system(problem: _Problem) -> continuation.System:
    """Residual φ − s law(N(φ)) and its Jacobian, for the share s of the friction."""

    def system(
        forces: Sequence[NDArray[np.float64]], share: NDArray[np.float64]
    ) -> tuple[list[Number], list[list[Number]]]:
        normals = problem.normals(forces)
        residual = [f - share * t for f, t in zip(forces, problem.target(normals), strict=True)]
        rows = [[share * entry for entry in row] for row in problem.map_derivative(normals, forces)]
        return residual, _identity_minus(rows)

    return system


def _identity_minus(rows: Sequence[Sequence[Number]]) -> list[list[Number]]:
    return [[(1.0 if k == j else 0.0) - entry for j, entry in enumerate(row)] for k, row in enumerate(rows)]


def _along(gradient: Reaction, column: Reaction) -> Number:
    """Derivative of a normal load along a change of the reaction."""
    total = gradient[0] * column[0] + gradient[1] * column[1]
    if isinstance(gradient[2], float) and gradient[2] == 0.0:
        return total
    return total + gradient[2] * column[2]


def _largest(values: Sequence[Number]) -> Number:
    """Largest magnitude, elementwise; NaN if one is NaN."""
    largest = np.abs(primal(values[0]))
    for value in values[1:]:
        largest = np.maximum(largest, np.abs(primal(value)))
    return largest


def _depth(problem: _Problem) -> int:
    """Levels of ε among the inputs: each costs one Newton step at the solution."""
    return max((n.depth for n in problem.numbers() if isinstance(n, Dual)), default=0)


def _primal(problem: _Problem) -> _Problem:
    """The problem without its dual parts."""
    return problem.mapped(primal) if _depth(problem) else problem
