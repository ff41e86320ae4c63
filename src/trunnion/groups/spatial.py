"""Any module in space: what its chords ask for, links whose spin is free, and loops that ask for too much.

Every joint keeps its coordinates q. The second element of a chord must be where its coordinates, seen from the first,
put it [P 8]: six equations, a twist, for each loop. A link whose spin is free (both its joints are spherical) adds one
row: it does not spin about the line of its joints.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import space
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.space import NULL, Screw, about, moment_at, vector_minus
from trunnion.algebra.vector import Vector3, cross, dot, plus, scaled
from trunnion.groups.tree import OUTER, Coordinates, Element, Pose, Tree
from trunnion.joints.pairs import MOTIONS, PairMotion

Array = NDArray[np.float64]
ROUNDS = 4  # of taking a spin out, each of which leaves the third power
BEFORE, AFTER = slice(None, -1), slice(1, None)


@dataclass(frozen=True)
class SpatialGroup(Tree):
    """The module with the given joints.

    spinning: links whose spin is free, each with the two joints between which it is.
    """

    spinning: tuple[tuple[int, int, int], ...] = ()
    algebra: ClassVar[Any] = space
    motions: ClassVar[Mapping[str, PairMotion]] = MOTIONS["spatial"]

    @cached_property
    def order(self) -> tuple[int, ...]:
        """All joints."""
        return tuple(range(len(self.joints)))

    # ---- loops ------------------------------------------------------------------------------------------------

    def count(self, chord: int) -> int:
        """Three turns and three lengths."""
        return 6

    def gaps(
        self, placed: Sequence[Element], q: Coordinates, size: Number, drive: Sequence[Number] = ()
    ) -> list[Number]:
        """Turn and way from where each loop's last joint puts its second element to where that is.

        A spin is never open.
        """
        rows: list[Number] = []
        for k in self.chords:
            first, second, lead = placed[k]
            aim = self.motion(k).place(first, q[k], lead)
            turn = plus(plus(cross(aim.x, second.x), cross(aim.y, second.y)), cross(aim.z, second.z))
            rows += [*scaled(0.5, turn), *(length / size for length in vector_minus(second.place, aim.place))]
        return rows + [0.0] * len(self.spinning)

    def opening(self, placed: Sequence[Element], q: Coordinates, size: Number) -> Number:
        """Largest opening of a loop, m; an angle, taken from the axes themselves, counts as angle times size."""
        worst: Number = 0.0
        for k in self.chords:
            first, second, lead = placed[k]
            aim = self.motion(k).place(first, q[k], lead)
            for axis, other, scale in zip(second, aim, (size, size, size, 1.0), strict=True):
                for a, b in zip(axis, other, strict=True):
                    worst = np.maximum(worst, scale * np.abs(primal(a) - primal(b)))
        return worst

    def entries(self, chord: int, pair: Element, screw: Screw, size: Number, slides: bool = False) -> list[Number]:
        """Turn and velocity at the chord's point on the second link."""
        if slides:
            return [0.0, 0.0, 0.0, *screw.m]
        x, y, z = moment_at(screw, pair.second.place)
        return [*screw.u, x / size, y / size, z / size]

    def cut_wrench(self, pose: Pose, chord: int, multipliers: Sequence[Number]) -> Screw:
        """Moment and force at the place where the loop is closed."""
        mx, my, mz, *force = multipliers
        x, y, z = (part / pose.size for part in force)
        return about((x, y, z), (mx, my, mz), pose.elements[chord].second.place)

    # ---- free spins -------------------------------------------------------------------------------------------

    def spun(self, link: int, a: int, b: int) -> tuple[int, ...]:
        """The links that spin as one between two joints, one of which is stated."""
        together = [link]
        for member in together:
            for k, joint in enumerate(self.joints):
                if k not in (a, b) and member in joint.sides:
                    together += [other for other in joint.sides if other not in (OUTER, *together)]
        return tuple(together)

    def spin_axis(self, placed: Mapping[int, Element] | Sequence[Element], a: int, b: int) -> Vector3:
        """Unit vector of the line about which a link can spin: from ball to ball, or the axis of its other joint."""
        for k in (a, b):
            if not self.joints[k].pair.ball:
                axis: Vector3 = placed[k].second.z
                return axis
        apart = vector_minus(placed[b].second.place, placed[a].second.place)
        square = dot(apart, apart)
        xp = namespace(square)
        stretched = primal(square) > 0  # a link without a length has no line
        return scaled(1 / xp.sqrt(xp.where(stretched, square, 1.0)), apart)

    def further_rows(
        self, placed: Sequence[Element], screws: Sequence[list[Screw]], drive: Sequence[Number], size: Number
    ) -> list[list[Number]]:
        """Rates of the free spins."""
        rows = []
        for link, a, b in self.spinning:
            axis, path = self.spin_axis(placed, a, b), self.paths[link]
            rows.append([path.get(k, 0) * dot(axis, screws[k][i].u) for k, i in self.free])
        return rows

    def further_rates(self, pose: Pose, twists: Sequence[Screw], outer: Sequence[Any]) -> list[Number]:
        """ω · u of the free spins; of accelerations ω̇ · u, to which `further_carried` adds."""
        return [dot(self.spin_axis(pose.elements, a, b), twists[link].u) for link, a, b in self.spinning]

    def further_carried(self, pose: Pose, twists: Sequence[Screw], outer: Sequence[Any]) -> list[Number]:
        """ω · u̇ of the free spins: the line turns against links that change their shape."""
        return [dot(twists[link].u, self._axis_rate(pose, twists, outer, a, b)) for link, a, b in self.spinning]

    def _axis_rate(self, pose: Pose, twists: Sequence[Screw], outer: Sequence[Any], a: int, b: int) -> Vector3:
        """u̇: of an axis with its joint, else of the line across the links by how the balls at its ends move apart."""
        axis = self.spin_axis(pose.elements, a, b)
        for k in (a, b):
            if not self.joints[k].pair.ball:
                return cross(self.of(k, 1, twists, outer).u, axis)
        ends = [pose.elements[k].second.place for k in (a, b)]
        speeds = [moment_at(self.of(k, 1, twists, outer), place) for k, place in zip((a, b), ends, strict=True)]
        away, along = vector_minus(speeds[1], speeds[0]), dot(vector_minus(ends[1], ends[0]), axis)
        stretched = namespace(along).where(primal(along) > 0, along, 1.0)
        return scaled(1 / stretched, vector_minus(away, scaled(dot(away, axis), axis)))

    def further_loads(self, pose: Pose, multipliers: Sequence[Number]) -> list[tuple[int, Screw]]:
        """The torque about its line that keeps each link from spinning."""
        return [
            (link, Screw(NULL, scaled(torque, self.spin_axis(pose.elements, a, b))))
            for (link, a, b), torque in zip(self.spinning, multipliers, strict=True)
        ]

    def from_line(
        self, placed: Mapping[int, Element] | Sequence[Element], a: int, b: int, place: Vector3
    ) -> tuple[Number, Number]:
        """How far a place is along the line of a spin and from it, m; from the ball at its end."""
        axis = self.spin_axis(placed, a, b)
        away = vector_minus(place, placed[a if self.joints[a].pair.ball else b].second.place)
        across = cross(away, axis)
        return dot(away, axis), np.sqrt(dot(across, across))

    def signature(self, pose: Pose, spread: float) -> list[Number]:
        """Axes and places of the links; of those that spin what a spin leaves alone."""
        spun = {member for spin in self.spinning for member in self.spun(*spin)}
        numbers: list[Number] = []
        for link, frame in enumerate(pose.frames):
            if link not in spun:
                numbers += [*frame.x, *frame.y, *frame.z, *(n / spread for n in frame.place)]
        return numbers + [n / spread for n in self.unturned(pose.elements)]

    def unturned(self, placed: Sequence[Element]) -> list[Number]:
        """Places of the joints of links that spin, m: of those between two such links, along the line and from it."""
        sets = sorted(({*self.spun(*spin)}, *spin[1:]) for spin in self.spinning)
        numbers: list[Number] = []
        for k, joint in enumerate(self.joints):
            place = placed[k].second.place
            spins = [(len(members), a, b) for members, a, b in sets if members.issuperset(joint.sides)]
            if spins:
                numbers += self.from_line(placed, *min(spins)[1:], place)
            elif joint.kind != "planar" and any(members.intersection(joint.sides) for members, *_ in sets):
                numbers += place
        return numbers


# ---- tracks without spin --------------------------------------------------------------------------------------


def unspun(group: SpatialGroup, elements: Sequence[Element], rows: Array, drive: Sequence[Any]) -> Array:
    """Coordinates (kept, grid) of a track with the same poses but for the spins, which are taken out.

    Which way links have turned about their line moves nothing else, so position by Newton's method leaves it as it was
    guessed. The velocity is that of no spin, ω · u = 0; a track on which a link does so as well is had by turning it,
    with those that spin with it, at each of its poses by what it has spun since the start.
    """
    if not group.spinning or rows.shape[1] < 2:
        return rows
    grid = rows.shape[1]
    place = {i: n for n, i in enumerate(group.kept)}
    rows = rows.copy()
    sets = sorted(((group.spun(*spin), *spin) for spin in group.spinning), key=lambda spin: -len(spin[0]))
    pose, stale = group.position(elements, list(rows), drive), set[int]()
    for members, link, a, b in sets:
        if stale.intersection(members):  # of links that another spin has turned
            pose, stale = group.position(elements, list(rows), drive), set()
        stale.update(members)
        axis = _full(group.spin_axis(pose.elements, a, b), grid)
        centre = _full(pose.elements[a if group.joints[a].pair.ball else b].second.place, grid)
        spun = _spun(axis, np.array([_full(side, grid) for side in pose.frames[link][:3]]))
        for k in (a, b):
            first, second, _ = pose.elements[k]
            sense = -1.0 if group.joints[k].sides[1] in members else 1.0  # back by what it has spun
            begin = group.starts[k]
            if group.joints[k].pair.ball:
                local = np.array(
                    [np.sum(axis * _full(direction, grid), axis=0) for direction in (first.x, first.y, first.z)]
                )
                where = [place[begin + i] for i in range(4)]
                rows[where] = _turned(rows[where], local, sense * spun)
            elif group.joints[k].kind == "planar":
                ends = [[_full(part, grid) for part in (end.x, end.y, end.place)] for end in (first, second)]
                turns = int(group.joints[k].sides[1] in members)
                x, y, at = ends[turns]
                at = centre + _about(at - centre, axis, -spun)
                ends[turns] = [_about(x, axis, -spun), _about(y, axis, -spun), at]
                # both slides and the turn of a planar joint
                (x, y, at), (along, _, second_at) = ends
                slides = [np.sum((second_at - at) * direction, axis=0) for direction in (x, y)]
                turn = np.arctan2(np.sum(along * y, axis=0), np.sum(along * x, axis=0))
                rows[[place[begin + i] for i in range(3)]] = [*slides, np.unwrap(turn)]
            elif begin in place:
                rows[place[begin]] += sense * spun
    return rows


def _about(vector: Array, axis: Array, angle: Array) -> Array:
    """Vectors turned about unit axes (Rodrigues), (3, grid)."""
    along = np.sum(vector * axis, axis=0) * axis
    return np.asarray(along + np.cos(angle) * (vector - along) + np.sin(angle) * np.cross(axis, vector, axis=0))


def _full(vector: Sequence[Any], grid: int) -> Array:
    return np.array([np.broadcast_to(n, (grid,)) for n in vector], float)


def _spun(axis: Array, sides: Array) -> Array:
    """Angle by which a link has spun since the first pose of a run without gaps, rad; (3, grid), sides: (3, 3, grid).

    Each step of what is left is a turn about the line midway: u · the turn from one pose to the next, by sin and cos.
    """
    midway = axis[:, :-1] + axis[:, 1:]
    midway = midway / np.linalg.norm(midway, axis=0)
    spun = np.zeros(axis.shape[1])
    for _ in range(ROUNDS):
        before, after = (np.array([_about(side, axis, -spun)[:, part] for side in sides]) for part in (BEFORE, AFTER))
        sine = np.sum(midway * np.sum(np.cross(before, after, axis=1), axis=0), axis=0)
        cosine = np.sum(before * after, axis=(0, 1)) - 1.0
        spun += np.concatenate([[0.0], np.cumsum(np.nan_to_num(np.arctan2(sine, cosine)))])
    return spun


def _turned(q: Array, axis: Array, angle: Array) -> Array:
    """Quaternion (4, grid) of a turn about an axis after the turn q: the product of both."""
    c, v = np.cos(angle / 2), np.sin(angle / 2) * axis
    w, u = q[0], q[1:]
    return np.vstack([c * w - np.sum(v * u, axis=0), c * u + w * v + np.cross(v, u, axis=0)])
