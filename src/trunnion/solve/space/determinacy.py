"""Whether the joints determine motion and reactions of a spatial mechanism, told from the rank of its Jacobians.

Grübler's count knows numbers of freedoms only. Where axes are parallel, or meet in a point, some constraints repeat
others: a planar four-bar drawn in space moves though the count is −2, and what its bearings carry in excess no equation
of statics tells. The rank of J at assembled poses does: rows − rank constraints are redundant, columns − rank freedoms
are not determined. What the joints carry in excess are the self-stresses, Jᵀ λ = 0.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import flat
from trunnion.algebra.space import moment_at
from trunnion.algebra.vector import dot
from trunnion.errors import Finding, MechanismError, Severity, agreeing, counted
from trunnion.groups.cylindrical_dyad import CylindricalDyad
from trunnion.groups.redundant import RANK, stacked
from trunnion.groups.spatial import SpatialGroup
from trunnion.groups.tree import Pose, Tree
from trunnion.results.quantities import readable
from trunnion.solve.assembly import Chosen
from trunnion.solve.backward import Given, backward
from trunnion.solve.contacts import contacts_of
from trunnion.solve.forward import Forward, forward, posed
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.system import Cycle, System, Values, driven_coordinates, felt
from trunnion.solve.track import SEED, at, extent, guess_reaches, lane_of

LOOKED = 12  # positions: what is special at one of them only is a singular position
TRIES = 96  # guesses at a pose
PRESENT = 1e-6  # of the largest entry of a null vector
CONTACTS = 2  # of a joint with friction at most: both pins of a cross, turn and slide of a sleeve

Array = NDArray[Any]


class ModuleDeterminacy(NamedTuple):
    """Of one module: redundant constraints and undetermined freedoms at every position looked at; joints that carry the
    former, links that have the latter. surplus: drivers more than there are freedoms, for which it does not close;
    rubbing: joints whose friction follows what the redundant constraints leave open; change: by how much at most their
    normal loads change, as a part of the largest, where one of the joints is twice or half as stiff.
    """

    redundant: int
    undetermined: int
    joints: tuple[str, ...]
    links: tuple[str, ...]
    surplus: int = 0
    rubbing: tuple[str, ...] = ()
    change: float = 0.0


@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def look(system: System, values: Values, chosen: Chosen, cycle: Cycle) -> Determinacy:
    """What the rank says of every module that closes a loop and could be assembled."""
    rubbing = felt(system, values) if system.mechanism.over_constraint == "minimum-norm" else []
    # places alone decide the rank, but a link that may spin, and a contact with friction, is looked at as it moves
    walked = forward if system.plan.passive or rubbing else posed
    time = cycle.times(LOOKED) if cycle.duration else np.zeros(1)
    walk = walked(system, values, chosen.assembly, time)
    modules = (_of_module(walk, number, rubbing, len(time)) for number in range(len(system.plan.modules)))
    return Determinacy(system, tuple(part for part in modules if part is not None), *_spins(walk))


def _of_module(walk: Forward, number: int, rubbing: Sequence[str], lanes: int) -> ModuleDeterminacy | None:
    """Of one module, nothing if it closes no loop or could not be assembled."""
    module, group = walk.system.plan.modules[number], cast(Tree, walk.system.groups[number])
    pose: Pose | None = walk.poses[number] if group.chords else None
    if isinstance(group, CylindricalDyad):  # its closed form takes a branch, not a guess
        group = SpatialGroup(group.links, group.joints)
    if pose is not None and not np.any(np.isfinite(np.asarray(pose.gap))):
        pose = _by_least_squares(walk, number, group)
        if pose is None and module.redundant:
            return _too_many(walk, number, group)
    if pose is None or not pose.jacobian:
        return None
    table = stacked(pose.jacobian)
    rows, columns = table.shape[1:]
    table = np.broadcast_to(table, (lanes, rows, columns))
    finite = np.asarray(np.isfinite(table).all(axis=(-2, -1)))
    if not np.any(finite):
        return None
    left, sizes, right = np.linalg.svd(np.where(finite[:, None, None], table, 0.0))
    ranks = np.where(finite, np.sum(sizes > RANK * sizes[:, :1], axis=-1), -1)
    rank = int(np.max(ranks))
    regular = ranks == rank
    stresses, motions, none = list[Array](), list[Array](), [group.algebra.ZERO_LOAD] * group.links
    for null in np.moveaxis(left, -1, 0)[rank:]:  # the wrenches of a self-stress, (joint, 6 or 3, lane)
        wrenches = group.link_by_link(pose, none, list(null.T))
        stresses.append(_table(wrenches[: len(group.joints)], lanes))
    for null in np.moveaxis(right, -2, 0)[rank:]:  # the twists of a motion that nothing determines
        rates = group.unmoved()
        for (k, i), rate in zip(group.free, null.T, strict=True):
            rates[k][i] = rate
        motions.append(_table(group.twists(pose, [None] * len(group.joints), rates), lanes))
    normals = []  # by which a self-stress presses on the contacts with friction, times size
    for stress in stresses:
        # a normal load is a seminorm, |N(R + S) − N(R)| ≤ N(S): where it is 0, so is what S changes of the friction
        table = np.zeros((len(module.joints), CONTACTS, lanes))
        for k, joint in enumerate(module.joints):
            for i, contact in enumerate(contacts_of(walk, joint) if joint in rubbing else ()):
                table[k, i] = pose.size * contact.load.normal(contact.load.felt(tuple(stress[k])))
        normals.append(table)
    strained, pressed = (_present(module.joints, parts, stresses, regular) for parts in (stresses, normals))
    return ModuleDeterminacy(
        rows - rank,
        columns - rank,
        strained,
        _present(module.links, motions, motions, regular),
        rubbing=pressed,
        change=_change(walk, number, strained) if pressed and module.redundant else 0.0,
    )


def _change(walk: Forward, number: int, joints: Sequence[str]) -> float:
    """Largest change of a normal load where one of the joints is twice or half as stiff, of the largest normal load."""

    def pressing(values: Values) -> Array:
        """(contact, position): normal loads, N."""
        back = backward(replace(walk, values=values), FrictionMethod(), Given())
        module = walk.system.plan.modules[number]
        loads = [
            contact.load.normal(contact.load.felt(back.module_reactions[module.joints[contact.joint]]))
            for contact, rub in back.rubbed[len(walk.system.plan.modules) - 1 - number]
            if rub is not None
        ]
        return np.array([np.broadcast_to(primal(load), np.shape(walk.time)) for load in loads])

    nominal, most = pressing(walk.values), 0.0
    for joint in joints:
        stiffness = f"joints.{joint}.stiffness"
        for factor in (0.5, 2.0):
            stiffer = {f"{stiffness}.radial": factor} | {
                path: factor * value for path, value in walk.values.items() if path.startswith(f"{stiffness}.")
            }
            most = max(most, _largest(pressing({**walk.values, **stiffer}) - nominal))
    return most / max(_largest(nominal), 1e-300)


def _spins(walk: Forward) -> tuple[dict[str, float], dict[str, float]]:
    """Largest torques about the line of each link with a free spin, N m, where they are more than rounding: what keeps
    it from spinning, and what friction in its joints adds."""
    if not walk.system.plan.passive:
        return {}, {}
    with np.errstate(all="ignore"):
        back = backward(walk, FrictionMethod(), Given())
    torques, dragged, size = {}, {}, _largest(walk.system.size(walk.values))
    for number, (link, *joints), members in spins_of(walk.system):
        torque, group = back.spins[link], walk.system.groups[number]
        force = max(_largest(np.sqrt(dot(back.reactions[name].u, back.reactions[name].u))) for name in joints)
        if _largest(torque) > PRESENT * force * size:
            torques[link] = _largest(torque)
        a, b = (walk.system.plan.modules[number].joints.index(name) for name in joints)
        axis, pose = group.spin_axis(walk.poses[number].elements, a, b), walk.poses[number]
        centre = pose.elements[a if group.joints[a].pair.ball else b].second.place
        drag: Any = 0.0
        for name in joints:
            sign = 1.0 if walk.system.joints[name].links[1] in members else -1.0
            drag = drag + sign * dot(moment_at(back.friction_wrenches[name], centre), axis)
        if _largest(drag) > PRESENT * force * size:
            dragged[link] = _largest(drag)
    return torques, dragged


def spins_of(system: System) -> Iterator[tuple[int, tuple[str, str, str], list[str]]]:
    """Every free spin: the number of its module, the link it is named by with its two joints, and all that spin."""
    for number, module in enumerate(system.plan.modules):
        for spin, places in zip(module.spinning, getattr(system.groups[number], "spinning", ()), strict=True):
            members = system.groups[number].spun(*places)
            yield number, spin, [module.links[member] for member in sorted(members)]


def _largest(values: Any) -> float:
    return float(np.nanmax(np.abs(primal(values)), initial=0.0))


def _too_many(walk: Forward, number: int, group: Tree) -> ModuleDeterminacy | None:
    """Whether a module does not close because it has more drivers than freedoms: it is solved without any."""
    pose = _by_least_squares(walk, number, replace(group, driven=()))
    if pose is None:
        return None
    table = stacked(pose.jacobian)[0]
    freedoms = table.shape[1] - int(np.linalg.matrix_rank(table, rtol=RANK))
    surplus = len(group.driven) - freedoms  # without any freedom it is its dimensions that do not let it move
    return ModuleDeterminacy(0, 0, (), (), surplus) if freedoms and surplus > 0 else None


def _by_least_squares(walk: Forward, number: int, group: Tree) -> Pose | None:
    """A module that Newton's method does not close because J is singular, at the start, solved all the same."""
    system = walk.system
    module, places = system.plan.modules[number], system.places[number]
    free = replace(group, redundant=True)
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


def _table(screws: Sequence[Any], lanes: int) -> Array:
    """(screw, 6, lane)."""
    return np.array([[np.broadcast_to(entry, lanes) for entry in flat(screw)] for screw in screws])


def _present(names: Sequence[str], parts: Sequence[Array], vectors: Sequence[Array], lanes: Array) -> tuple[str, ...]:
    """Names whose part in any null vector is, at any of the lanes, more than rounding of the whole.

    parts, wholes: (name, entry, lane) of each null vector.
    """
    present = np.zeros(len(names), bool)
    for part, vector in zip(parts, vectors, strict=True):
        largest = np.max(np.linalg.norm(vector, axis=1), axis=0)
        present |= np.any((np.linalg.norm(part, axis=1) > PRESENT * largest) & lanes, axis=-1)
    return tuple(name for name, is_present in zip(names, present, strict=True) if is_present)


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
        undetermined = sum(part.undetermined - part.surplus for part in self.parts)
        return len(self.system.mechanism.drivers) + len(self.system.plan.passive) + undetermined

    def refuse(self) -> None:
        """Raises MechanismError for what is not determined, unless those of least elastic energy are asked for."""
        errors = [finding for finding in self.findings() if finding.severity is Severity.ERROR]
        if errors:
            raise MechanismError(errors)

    def findings(self) -> list[Finding]:
        """What there is to say of redundant constraints, undetermined freedoms and free spins."""
        spins, drivers = len(self.system.plan.passive), len(self.system.mechanism.drivers)
        counts: dict[str, Any] = {"formula": self.system.plan.mobility, "rank": self.mobility}
        mobility = f"the mobility is {counts['formula']} by Grübler's formula and {counts['rank']} by rank"
        findings: list[Finding] = []
        for part in self.parts:
            joints, links = list(part.joints), list(part.links)
            if part.surplus:
                suffix = f", {spins} of them passive" if spins else ""
                what = f"{mobility}{suffix}, but there {agreeing(drivers, 'is', 'are')} {counted(drivers, 'driver')}"
                figures = {**counts, "spins": spins, "drivers": drivers}
                findings.append(Finding.error("mobility.overdriven", "drivers", what, "remove a driver", **figures))
            if part.undetermined:
                what = f"{mobility}: {counted(part.undetermined, 'freedom is', 'freedoms are')} not determined, of the "
                what += f"links {', '.join(links)}"
                figures = {**counts, "freedoms": part.undetermined, "links": links}
                remedy = "add drivers or joints to these links"
                findings.append(Finding.error("mobility.undetermined", "drivers", what, remedy, **figures))
            if part.redundant:
                figures = {**counts, "constraints": part.redundant, "joints": joints}
                redundant = counted(part.redundant, "constraint is", "constraints are")
                what = f"{mobility}: {redundant} redundant, in the joints {', '.join(joints)}; "
                if self.system.mechanism.over_constraint == "refuse":
                    what += "statics does not determine their reactions"
                    remedy = "use a joint with more freedoms (cylindrical, spherical), or state over_constraint: "
                    remedy += "minimum-norm for those of least elastic energy"
                    findings.append(Finding.error("mobility.redundant", "joints", what, remedy, **figures))
                else:
                    findings += self._shared(part, what, figures)
        for _, (link, *points), members in spins_of(self.system):
            where, drag = f"links.{link}", self.dragged.get(link)
            who = f"the link '{link}'" if len(members) == 1 else f"the links {', '.join(members)} together"
            what = f"{who} can spin about the line {points[0]}-{points[1]} (a passive freedom)"
            remedy = "the analysis sets this spin to zero"
            if drag is not None:
                remedy += f"; friction of its joints would drag it with up to {readable(drag, 'N m')}"
            figures = {"link": link, "links": members, "points": points}
            findings.append(Finding.note("mobility.spin", where, what, remedy, torque=drag, **figures))
            if link in self.spins:
                what = f"{who} may spin about {points[0]}-{points[1]}, but a torque of up to "
                what += f"{readable(self.spins[link], 'N m')} acts about that line"
                ball = next(name for name in points if self.system.joints[name].pair.ball)
                remedy = f"make it symmetric about the line, or {ball} a universal joint, which holds the spin"
                # joints that err a little leave the line, and the spin is no less free
                say = Finding.warning if self.system.mechanism.has_errors else Finding.error
                findings.append(say("mobility.spin_loaded", where, what, remedy, torque=self.spins[link], **figures))
        return findings

    def _shared(self, part: ModuleDeterminacy, what: str, figures: Mapping[str, Any]) -> Iterator[Finding]:
        """How redundant joints share their load."""
        joints = self.system.joints
        lacking = [name for name in part.joints if joints[name].stiffness is None]
        if 0 < len(lacking) < len(part.joints):
            lack = f"the stiffness of {', '.join(lacking)} is not stated, that of the joints beside is"
            remedy = "state it for each of the joints that share the load, or for none"
            yield Finding.error("mobility.stiffness_lacks", f"joints.{lacking[0]}", lack, remedy, joints=lacking)
            return
        stiff = "equally stiff joints" if lacking else "the stated stiffness of the joints"
        what += f"the reactions given are those of {stiff} without preload, the least elastic energy"
        remedy = "misfit and preload add to them"
        yield Finding.warning("mobility.redundant_least", "joints", what, remedy, **figures)
        if part.rubbing and lacking:
            what = f"the friction in the joints {', '.join(part.rubbing)} depends on how the joints share the load: "
            what += f"normal loads change by up to {100 * part.change:.2g} % of the largest "
            what += "if one joint is twice or half as stiff"
            remedy = f"state the stiffness of the joints, or give them {counted(part.redundant, 'freedom')} more "
            remedy += "(cylindrical, spherical)"
            figures = {"joints": list(part.rubbing), "constraints": part.redundant, "change": part.change}
            yield Finding.warning("mobility.friction_open", "joints", what, remedy, **figures)
