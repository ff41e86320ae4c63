"""Whether the joints determine motion and reactions of a spatial mechanism, told from the rank of its Jacobians.

Grübler's count knows numbers of freedoms only. Where axes are parallel, or meet in a point, some constraints repeat
others: a planar four-bar drawn in space moves though the count is −2, and what its bearings carry in excess no equation
of statics tells. The rank of J at assembled poses does: rows − rank constraints are redundant, columns − rank freedoms
are not determined.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.nested import each
from trunnion.algebra.space import ZERO, Screw, moment_at
from trunnion.algebra.vector import dot, minus
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.groups.redundant import RANK, stacked
from trunnion.groups.spatial import SpatialGroup, SpatialPose
from trunnion.results.sentences import finding_for
from trunnion.solve.backward import Given, backward
from trunnion.solve.branch_tracking import SEED, at, extent, guess_reaches, lane_of
from trunnion.solve.branches import Chosen
from trunnion.solve.forward import forward, posed
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.system import Cycle, System, Values, driven_coordinates

__all__ = ["Determinacy", "ModuleDeterminacy", "look"]

LOOKED = 12  # positions: what is special at one of them only is a singular position
TRIES = 96  # guesses at a pose
PRESENT = 1e-6  # of the largest entry of a null vector


class ModuleDeterminacy(NamedTuple):
    """Of one module: redundant constraints and undetermined freedoms at every position looked at; joints that carry the
    former, links that have the latter. surplus: drivers more than there are freedoms, for which it does not close.
    """

    module: int
    redundant: int
    undetermined: int
    joints: tuple[str, ...]
    links: tuple[str, ...]
    surplus: int = 0


@dataclass(frozen=True)
class _Module:
    number: int
    names: tuple[str, ...]
    links: tuple[str, ...]
    group: SpatialGroup
    pose: SpatialPose


@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def look(system: System, values: Values, chosen: Chosen, cycle: Cycle) -> Determinacy:
    """What the rank says of every module that closes a loop and could be assembled."""
    # places alone decide the rank, but a link that may spin is looked at as it moves
    walked = forward if system.plan.passive else posed
    walk = walked(system, values, chosen.assembly, cycle.times(LOOKED) if cycle.duration else np.zeros(1))
    found = []
    for number, module in enumerate(system.plan.modules):
        group = cast(SpatialGroup, system.groups[number])
        if not group.chords:
            continue
        pose = walk.poses[number]
        if not np.any(np.isfinite(np.asarray(pose.gap))):
            pose = _by_least_squares(system, walk, number, group)
        if pose is None and module.redundant:
            found += _too_many(system, walk, number, group)
        if pose is None or not pose.jacobian:
            continue
        table = stacked(pose.jacobian)
        lanes = np.flatnonzero(np.isfinite(table).all(axis=(-2, -1)))
        if not len(lanes):
            continue
        ranks = np.linalg.matrix_rank(table[lanes], rtol=RANK) if table.size else np.zeros(len(lanes))
        rank, best = int(np.max(ranks)), int(lanes[np.argmax(ranks)])
        rows, columns = table.shape[1:]
        joints: tuple[str, ...] = ()
        links: tuple[str, ...] = ()
        if rank < max(rows, columns):
            one = _Module(number, module.joints, module.links, group, _lane(pose, best, len(table)))
            joints, links = _strained(one, table[best]), _loose(one, table[best])
        found.append(ModuleDeterminacy(number, rows - rank, columns - rank, joints, links))
    return Determinacy(system, tuple(found), *_spins(walk))


def _spins(walk: Any) -> tuple[dict[str, float], dict[str, float]]:
    """Largest torques about the line of each link with a free spin, N m, where they are more than rounding: what keeps
    it from spinning, and what friction in its joints adds."""
    if not walk.system.plan.passive:
        return {}, {}
    with np.errstate(all="ignore"):
        back = backward(walk, FrictionMethod(), Given())
    found, dragged = {}, {}
    for link, torque in back.spins.items():
        joints = [name for name, (_, links) in walk.system.joints.items() if link in links]
        force = max(_largest(np.sqrt(dot(back.reactions[name].u, back.reactions[name].u))) for name in joints)
        size = _largest(walk.system.size(walk.values))
        if _largest(torque) > PRESENT * force * size:
            found[link] = _largest(torque)
        one, two = (walk.element(link, name).place for name in joints)
        line = minus(two, one)
        drag: Any = 0.0
        for name in joints:
            sign = 1.0 if walk.system.joints[name][1][1] == link else -1.0
            drag = drag + sign * dot(moment_at(back.friction_wrenches[name], one), line)
        length = np.sqrt(primal(dot(line, line)))
        drag = primal(drag) / np.where(length > 0, length, np.nan)
        if _largest(drag) > PRESENT * force * size:
            dragged[link] = _largest(drag)
    return found, dragged


def _largest(values: Any) -> float:
    return float(np.nanmax(np.abs(primal(values)), initial=0.0))


def _too_many(system: System, walk: Any, number: int, group: SpatialGroup) -> list[ModuleDeterminacy]:
    """Whether a module does not close because it has more drivers than freedoms: it is solved without any."""
    pose = _by_least_squares(system, walk, number, replace(group, driven=()))
    if pose is None:
        return []
    table = stacked(pose.jacobian)[0]
    freedoms = table.shape[1] - int(np.linalg.matrix_rank(table, rtol=RANK))
    surplus = len(group.driven) - freedoms  # without any freedom it is its dimensions that do not let it move
    return [ModuleDeterminacy(number, 0, 0, (), (), surplus)] if freedoms and surplus > 0 else []


def _by_least_squares(system: System, walk: Any, number: int, group: SpatialGroup) -> SpatialPose | None:
    """A module that Newton's method does not close because J is singular, at the start, solved all the same."""
    module, places = system.plan.modules[number], system.places[number]
    free = SpatialGroup(group.links, group.joints, group.driven, group.spinning, redundant=True)
    drive = driven_coordinates(system, module, places, walk.values, walk.time)[0] if group.driven else []
    elements, drive = at(walk.pairs(places), 0), [lane_of(q, 0) for q in drive]
    rng, reaches = np.random.default_rng(SEED), guess_reaches(free, extent(free, elements))
    with np.errstate(all="ignore"):
        pose = free.position(elements, [rng.uniform(-reach, reach, TRIES) for reach in reaches], drive)
        closed = np.flatnonzero(np.isfinite(np.broadcast_to(pose.gap, (TRIES,))))
        if not len(closed):
            return None
        table = stacked(pose.jacobian)
        ranks = np.linalg.matrix_rank(np.broadcast_to(table, (TRIES, *table.shape[1:]))[closed], rtol=RANK)
        best = closed[int(np.argmax(ranks))]
        return free.position(elements, [lane_of(pose.q[i], best) for i in free.kept], drive)


def _lane(pose: SpatialPose | None, lane: int, count: int) -> SpatialPose:
    """The pose at one position, with plain numbers."""

    def pick(number: Any) -> Any:
        values = np.ravel(number)
        return float(values[lane if len(values) == count else 0])

    assert pose is not None
    frames, elements = each((pose.frames, pose.elements), pick)
    screws = tuple([each(screw, pick) for screw in joint] for joint in pose.screws)
    size = pick(pose.size)
    return pose._replace(frames=frames, elements=elements, screws=screws, size=size)


def _strained(module: _Module, table: NDArray[np.float64]) -> tuple[str, ...]:
    """Joints whose reactions a redundant constraint leaves open: those of self-stress, Jᵀ λ = 0."""
    left, values, _ = np.linalg.svd(table)
    rank = int(np.sum(values > RANK * values[0])) if len(values) else 0
    names: list[str] = []
    none = [ZERO] * module.group.links
    for column in left[:, rank:].T:
        wrenches = module.group.link_by_link(module.pose, none, list(column))
        sizes = np.array([_size(wrench) for wrench in wrenches])
        names += [name for name, size in zip(module.names, sizes, strict=True) if size > PRESENT * sizes.max()]
    return tuple(dict.fromkeys(name for name in module.names if name in names))


def _loose(module: _Module, table: NDArray[np.float64]) -> tuple[str, ...]:
    """Links that move in the freedoms that nothing determines, J q̇ = 0."""
    _, values, right = np.linalg.svd(table)
    rank = int(np.sum(values > RANK * values[0])) if len(values) else 0
    names: list[str] = []
    for row in right[rank:]:
        rates: list[list[float]] = [[0.0] * len(screws) for screws in module.pose.screws]
        for (k, i), value in zip(module.group.free, row, strict=True):
            rates[k][i] = float(value)
        twists = module.group.twists(module.pose, [None] * len(module.names), rates)
        sizes = np.array([_size(twist) for twist in twists])
        moving = sizes > PRESENT * max(sizes.max(), 1e-300)
        names += [name for name, moves in zip(module.links, moving, strict=True) if moves]
    return tuple(name for name in module.links if name in names)


def _size(screw: Screw) -> float:
    return float(np.sqrt(sum(float(n) ** 2 for vector in screw for n in vector)))


@dataclass(frozen=True)
class Determinacy:
    """What the joints of a mechanism leave open, module by module.

    spins: torque that would keep a link with a free spin from spinning, where its masses or loads make it spin, N m;
    dragged: what friction in its joints leaves out of balance about the line, N m.
    """

    system: System
    parts: tuple[ModuleDeterminacy, ...]
    spins: Mapping[str, float]
    dragged: Mapping[str, float]

    @property
    def mobility(self) -> int:
        """Mobility by rank: what the drivers prescribe, spins that move nothing else, and what is not determined."""
        undetermined = sum(one.undetermined - one.surplus for one in self.parts)
        return len(self.system.mechanism.drivers) + len(self.system.plan.passive) + undetermined

    def refuse(self) -> None:
        """Raises MechanismError for what is not determined, unless the smallest reactions are asked for."""
        errors = [finding for finding in self.findings() if finding.severity is Severity.ERROR]
        if errors:
            raise MechanismError(errors)

    def findings(self) -> list[Finding]:
        """What there is to say of redundant constraints, undetermined freedoms and free spins."""
        found: list[Finding] = []
        for one in self.parts:
            found += [self._overdriven()] if one.surplus else []
            found += [self._undetermined(one)] if one.undetermined else []
            found += [self._redundant(one)] if one.redundant else []
        for module in self.system.plan.modules:
            for link, *points in module.spinning:
                where, drag = f"links.{link}", self.dragged.get(link)
                found.append(finding_for("mobility.spin", where, link=link, points=points, torque=drag))
                if link in self.spins:
                    found.append(
                        finding_for("mobility.spin_loaded", where, link=link, points=points, torque=self.spins[link])
                    )
        return found

    @property
    def _counts(self) -> dict[str, Any]:
        return {"formula": self.system.plan.mobility, "rank": self.mobility}

    def _overdriven(self) -> Finding:
        spins, drivers = len(self.system.plan.passive), len(self.system.mechanism.drivers)
        return finding_for("mobility.overdriven", "drivers", **self._counts, spins=spins, drivers=drivers)

    def _undetermined(self, one: ModuleDeterminacy) -> Finding:
        return finding_for(
            "mobility.undetermined", "drivers", **self._counts, freedoms=one.undetermined, links=list(one.links)
        )

    def _redundant(self, one: ModuleDeterminacy) -> Finding:
        code = "redundant" if self.system.mechanism.over_constraint == "refuse" else "redundant_least"
        return finding_for(
            f"mobility.{code}", "joints", **self._counts, constraints=one.redundant, joints=list(one.joints)
        )
