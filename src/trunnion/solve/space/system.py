"""A spatial mechanism made ready to run: its modules, and where each joint's element lies on its links."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import ClassVar, cast

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.space import ORIGIN, Frame, element, relative, slid, turned, vector_minus
from trunnion.algebra.vector import Vector3, dot
from trunnion.groups.cylindrical_dyad import CylindricalDyad
from trunnion.groups.spatial import SpatialGroup
from trunnion.joints.pairs import PAIRS
from trunnion.solve.system import Place, System, Values, group_joints
from trunnion.structure.decompose import Module

__all__ = ["SpatialSystem"]

AXIS: Vector3 = (0.0, 0.0, 1.0)


class SpatialSystem(System):
    """A mechanism in space, its plan and its modules."""

    axes: ClassVar[str] = "xyz"

    def _group(self, module: Module, places: Sequence[Place]) -> SpatialGroup:
        joints = group_joints(module, places)
        if module.kind == "CCC" and not self._parallel(module):
            return CylindricalDyad(2, joints)
        driven, number = tuple(module.joints.index(name) for name in module.driven), module.links.index
        spins = tuple((number(link), module.joints.index(a), module.joints.index(b)) for link, a, b in module.spinning)
        return SpatialGroup(len(module.links), joints, driven, spins, module.redundant)

    def _place(self, module: Module, name: str) -> Place:
        kind, links = self.joints[name]
        return Place(name, kind, links, (links[0] not in module.links, links[1] not in module.links), False)

    def resting(self, joint: str) -> int:
        """A cross has two pins, by `pezzuti` a cylinder turns and slides."""
        pair, friction = PAIRS[self.joints[joint][0]], self.mechanism.effective_joints[joint].friction
        summed = friction is not None and friction.model == "pezzuti"
        return 2 if pair.crossed or (len(pair.freedoms) == 2 and summed) else 1

    def _parallel(self, module: Module) -> bool:
        """Whether the two axes of a link of a cylindrical dyad are parallel: it has no closed form then."""
        elements = self.elements(self.mechanism.parameters())
        for link in module.links:
            one, two = (elements[link, joint].z for joint in module.joints if link in self.joints[joint][1])
            if abs(float(dot(one, two))) > 1 - 1e-12:
                return True
        return False

    @cached_property
    def points(self) -> tuple[tuple[str, str], ...]:
        """(link, point) of every named point; the joints of a loop are points of its links."""
        found = [(name, point) for name, link in self.mechanism.effective_links.items() for point in link.points]
        if self.mechanism.loop:
            found += [(link, joint) for joint, (_, links) in self.joints.items() for link in links]
        return tuple(dict.fromkeys(found))

    # ---- elements -------------------------------------------------------------------------------------------

    def stated_elements(self, values: Values) -> dict[tuple[str, str], Frame]:
        """The same without errors of joints: its place, z along the axis of the joint."""
        if self.mechanism.loop:
            return self._loop_elements(values)
        found: dict[tuple[str, str], Frame] = {}
        for name, (_, links) in self.joints.items():
            for link in links:
                stated = self.mechanism.links[link].points[name]
                path = f"links.{link}.points.{name}"
                axis = self._vector(values, f"{path}.axis") if stated.axis is not None else AXIS
                x = self._vector(values, f"{path}.x") if stated.x is not None else None
                found[link, name] = element(self._vector(values, path), axis, x)
        return found

    def _vector(self, values: Values, path: str) -> Vector3:
        return cast(Vector3, self.vector(values, path))

    def _loop_elements(self, values: Values) -> dict[tuple[str, str], Frame]:
        """Elements from the dual Denavit–Hartenberg table: joint k is Z(θ̂), the link after it X(α̂) to joint k + 1."""
        rows = self.mechanism.loop
        found: dict[tuple[str, str], Frame] = {}
        for row, after in zip(rows, (*rows[1:], rows[0]), strict=True):
            path = f"loop.{row.joint}"
            own, following = ORIGIN, _twisted(values[f"{path}.twist"], values[f"{path}.distance"])
            stated = self.mechanism.links.get(row.link)
            home = stated.frame if stated and stated.frame else None
            if home is None and row.link == self.mechanism.fixed_link:
                home = after.joint
            if home == after.joint and home != row.joint:
                own, following = relative(ORIGIN, following), ORIGIN
            found[row.link, row.joint] = own
            found[row.link, after.joint] = self._shifted(values, after.joint, following)
        return found

    def _shifted(self, values: Values, joint: str, frame: Frame) -> Frame:
        """The first element of a joint, moved by its constant slide or rotation."""
        path = f"loop.{joint}"
        if f"{path}.slide" in values:
            frame = slid(frame, values[f"{path}.slide"])
        if f"{path}.rotation" in values:
            frame = turned(frame, values[f"{path}.rotation"])
        return frame

    def lead(self, values: Values, joint: str) -> Number:
        """Slide for one radian of a helical pair, m; 0 of others."""
        return values[f"joints.{joint}.pitch"] / (2 * np.pi) if PAIRS[self.joints[joint][0]].threaded else 0.0

    def size(self, values: Values, elements: Mapping[tuple[str, str], Frame] | None = None) -> Number:
        """Length typical of the mechanism, m: the widest spread of two joints on one link; elements: if known."""
        elements = self.elements(values) if elements is None else elements
        widest: Number = 0.0
        for name in self.mechanism.effective_links:
            places = [frame.place for (link, _), frame in elements.items() if link == name]
            for place in places[1:]:
                apart = vector_minus(place, places[0])
                widest = np.maximum(widest, np.sqrt(primal(dot(apart, apart))))
        return np.where(widest > 0, widest, self._smallest_size(values))

    def _smallest_size(self, values: Values) -> Number:
        """Of a mechanism whose axes all meet in one point: the largest length of its pins, or 1 m."""
        lengths = [primal(value) for path, value in values.items() if path.endswith((".pin.bearing", ".pin.radius"))]
        largest = functools.reduce(np.maximum, lengths, 0.0)
        return np.where(largest > 0, largest, 1.0)


def _twisted(twist: Number, distance: Number) -> Frame:
    """X(α + ε a)."""
    xp = namespace(twist)
    c, s = xp.cos(twist), xp.sin(twist)
    return Frame((1.0, 0.0, 0.0), (0.0, c, s), (0.0, -s, c), (distance, 0.0, 0.0))
