"""A spatial result as bodies that move: poses of the links, frames of the joints, and how large all of it is.

Vectors have their component first: places are (3, position), rotations (3, 3, position) from the link's frame to the
global one. What no position has is NaN.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.space import rotation_matrix
from trunnion.errors import Finding, MechanismError
from trunnion.joints.pairs import PAIRS
from trunnion.results.attributes import attribute
from trunnion.views.axis import Array, layout, members

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["BodyPose", "Space", "gathered", "space"]

PIN = 14.0  # a mechanism is drawn at least as large as so many radii of its thickest pin
NEAR = 0.1  # joints whose points lie closer than this share of the size are drawn apart
SMALLEST = 1e-9  # m, of a mechanism that has a size
APART = 0.34  # as far from their common point as this share of the size, where all axes meet in one
ASIDE = 0.16  # where only some do


@dataclass(frozen=True)
class BodyPose:
    """Where a link is: matrix (3, 3, position) and origin (3, position), m."""

    matrix: Array
    origin: Array

    def place(self, point: Array) -> Array:
        """A point of the link, (3,) in its frame, in the global one, (3, position)."""
        return np.asarray(self.origin + np.einsum("ijn,j->in", self.matrix, point), dtype=float)

    def direction(self, vector: Array) -> Array:
        """A direction fixed in the link, in the global frame, (3, position)."""
        return np.asarray(np.einsum("ijn,j->in", self.matrix, vector), dtype=float)

    @property
    def known(self) -> NDArray[np.bool_]:
        """Whether it has a place, (position,)."""
        return np.asarray(np.isfinite(self.matrix).all(axis=(0, 1)) & np.isfinite(self.origin).all(axis=0))


@dataclass(frozen=True)
class Space:
    """What is needed to draw a spatial result at any position.

    stated: the layout; poses: of every link; free: "link.point" → place in the link's frame, of points that are no
    joints; thickest: radius of the thickest pin, 0 if none is told, m.
    """

    stated: dict[str, Any]
    poses: dict[str, BodyPose]
    free: dict[str, Array]
    thickest: float = 0.0

    @property
    def ground(self) -> str:
        """The name of the fixed link."""
        return str(self.stated["ground"])

    @property
    def moving(self) -> list[str]:
        """The names of the other links."""
        return [link for link in self.stated["links"] if link != self.ground]

    @cached_property
    def joints(self) -> dict[str, dict[str, Any]]:
        """The joints whose links have poses."""
        joints_stated: dict[str, dict[str, Any]] = self.stated["joints"]
        return {name: entry for name, entry in joints_stated.items() if set(entry["links"]) <= self.poses.keys()}

    def element(self, joint: str, side: int) -> Array:
        """Point, z and x of a joint's element on its first (0) or second (1) link, rows (3, 3), in the link's frame."""
        return np.array(self.joints[joint]["frames"][side], dtype=float)

    def at(self, joint: str, side: int = 1) -> Array:
        """Track of the joint's point on a link, (3, position)."""
        return self.poses[self.joints[joint]["links"][side]].place(self.element(joint, side)[0])

    def axis(self, joint: str, side: int = 1) -> Array:
        """Direction of the axis of a joint's element, (3, position)."""
        return self.poses[self.joints[joint]["links"][side]].direction(self.element(joint, side)[1])

    def slides(self, joint: str) -> Array:
        """How far the point on the second link is along the axis of the first, (position,) m."""
        apart = self.at(joint, 1) - self.at(joint, 0)
        return np.asarray((apart * self.axis(joint, 0)).sum(axis=0), dtype=float)

    @cached_property
    def middle(self) -> Array:
        """Middle of the box around all places, (3,) m."""
        low, high = self.spots.min(axis=0), self.spots.max(axis=0)
        return np.asarray((low + high) / 2, dtype=float)

    def track(self, key: str) -> Array:
        """Track of a free point, (3, position)."""
        return self.poses[key.split(".", 1)[0]].place(self.free[key])

    @cached_property
    def drawable(self) -> NDArray[np.bool_]:
        """Whether every link has a place, (position,)."""
        return np.asarray(np.all([pose.known for pose in self.poses.values()], axis=0))

    @cached_property
    def spots(self) -> Array:
        """All places of joints and points over the run, (n, 3)."""
        tracks = [self.at(name, side) for name in self.joints for side in (0, 1)]
        tracks += [self.track(key) for key in self.free]
        spots = np.concatenate([track.T for track in tracks]) if tracks else np.empty((0, 3))
        return np.asarray(spots[np.isfinite(spots).all(axis=1)], dtype=float)

    @cached_property
    def extent(self) -> float:
        """Diagonal of the box around all that moves, or what the pins ask for, m; 0 where nothing has a length."""
        extent = float(np.linalg.norm(np.ptp(self.spots, axis=0))) if len(self.spots) else 0.0
        extent = max(extent, PIN * self.thickest)
        return extent if extent > SMALLEST else 0.0

    @property
    def size(self) -> float:
        """The extent; 1 m where there is none, as where all axes meet in one point and no pin has a radius."""
        return self.extent or 1.0

    @cached_property
    def shifts(self) -> dict[str, float]:
        """How far along its axis each joint is drawn from its point, m, so that joints on one spot are told apart."""
        shifts: dict[str, float] = dict.fromkeys(self.joints, 0.0)
        places = [self.at(name)[:, self.drawable] for name in self.joints]
        spread = float(np.linalg.norm(np.ptp(np.hstack(places), axis=1))) if places else 0.0
        share = APART if spread < APART * self.size else ASIDE
        index = int(np.argmax(self.drawable))
        for name in self._crowded():
            before = sum((np.sign(shift) * self.axis(other)[:, index] for other, shift in shifts.items()
                          if shift and self.ground in self.joints[other]["links"]), np.zeros(3))  # fmt: skip
            # along the axis, a joint of the ground away from those of the ground before it
            turned = self.ground in self.joints[name]["links"] and float(self.axis(name)[:, index] @ before) > 0
            shifts[name] = share * self.size * (-1.0 if turned else 1.0)
        return shifts

    def _crowded(self) -> list[str]:
        """Joints with an axis whose point lies on that of another joint of one of their links, with another axis."""
        index = int(np.argmax(self.drawable))
        crowded = []
        for name, joint in self.joints.items():
            if not PAIRS[joint["type"]].one_axis:  # else its symbol may lie anywhere on the axis
                continue
            others = [
                neighbour
                for neighbour, other in self.joints.items()
                if neighbour != name and set(joint["links"]) & set(other["links"])
            ]
            for other in others:
                near = np.linalg.norm(self.at(name)[:, index] - self.at(other)[:, index]) < NEAR * self.size
                turned = np.linalg.norm(np.cross(self.axis(name)[:, index], self.axis(other)[:, index])) > 0.02
                if near and (turned or not PAIRS[self.joints[other]["type"]].one_axis):
                    crowded.append(name)
                    break
        return crowded

    def seat(self, joint: str, side: int = 1) -> Array:
        """Place of a joint's symbol on a link, (3,) in the link's frame."""
        point, z, _ = self.element(joint, side)
        return np.asarray(point + self.shifts[joint] * z, dtype=float)

    def seated(self, joint: str) -> Array:
        """Track of a joint's symbol, (3, position)."""
        return self.poses[self.joints[joint]["links"][1]].place(self.seat(joint))


def space(result: xr.Dataset) -> Space:
    """Gather what the drawings need; raises MechanismError if no position can be drawn."""
    bodies = gathered(result)
    if not bodies.drawable.any():
        what = "no position of the mechanism can be assembled: there is nothing to draw"
        raise MechanismError(Finding(what, remedy="change the lengths or the range of the driver"))
    return bodies


def gathered(result: xr.Dataset) -> Space:
    """The same, whether or not a position can be drawn."""
    facts, count = layout(result), result.sizes["position"]
    turns, origins = members(result, "link_rotation", "link"), members(result, "link_position", "link")
    poses = {link: BodyPose(rotation_matrix(turns[link]), origins[link]) for link in turns}
    still = np.broadcast_to(np.eye(3)[:, :, None], (3, 3, count)), np.zeros((3, count))
    poses[facts["ground"]] = BodyPose(*still)  # the global frame, also where nothing else is known
    free = {}
    for key, track in members(result, "point_position", "point").items():
        link, point = key.split(".", 1)
        if link in poses and point not in facts["joints"]:
            pose = poses[link]
            for index in np.flatnonzero(np.isfinite(track).all(axis=0) & pose.known)[:1]:  # the first that is known
                free[key] = np.asarray(pose.matrix[:, :, index].T @ (track[:, index] - pose.origin[:, index]), float)
    radii = [float(row["value"]) for row in attribute(result, "inputs")
             if str(row["path"]).endswith("pin.radius") and isinstance(row.get("value"), int | float)]  # fmt: skip
    return Space(facts, poses, free, max(radii, default=0.0))
