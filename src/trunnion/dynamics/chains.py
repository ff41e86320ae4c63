"""Chains of slides and turns between two links in space: what stands in for a joint, or holds a link that none holds.

Every freedom of such a chain is a coordinate that a driver can move. Its joints carry nothing but what the joint itself
carried. All are counted from the pose at the start, about axes at right angles to each other there. Three turns leave a
direction in which the links cannot turn where the third axis lies along the first: the axes are chosen so that this is
as far as can be from all poses of the cycle.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal, single
from trunnion.algebra.nested import each
from trunnion.algebra.space import moment_at
from trunnion.errors import Finding, MechanismError
from trunnion.solve.forward import Forward, SpatialWalk
from trunnion.solve.run import Run

__all__ = ["Chain", "chain_of_joint", "hanging_chain"]

Array = NDArray[np.float64]

LOOKS = 73  # poses of the cycle at which axes of three turns are tried
MEETING = 0.99  # cosine of the angle of first and third axis: nearer they are as good as one
ANGLES = 24  # of the third axis about the first, and directions of the first beside those of the motion


class Chain(NamedTuple):
    """What a file says of a chain: its points on the first and the last link, links between, joints, and coordinates
    with their rates at the start, by joint."""

    points: tuple[dict[str, Any], dict[str, Any]]
    links: dict[str, dict[str, Any]]
    joints: dict[str, dict[str, Any]]
    coordinates: dict[str, tuple[float, float]]


def chain_of_joint(run: Run, walk: Forward, joint: str) -> Chain:
    """Single slides and turns for a joint of several freedoms. walk: at the start."""
    assert isinstance(walk, SpatialWalk)
    kind, (first, second) = run.system.joints[joint]
    one_element, two = (_plain(element) for element in walk.ends(joint))
    if kind == "cylindrical":  # it keeps its elements, and with them its turn and its slide
        (turn, slide), rates = walk.coordinates(joint), walk.rates(joint)
        start = [(single(turn), single(rates[0])), (single(slide), single(rates[1]))]
        local = [_plain(walk.local[link, joint]) for link in (first, second)]
        at = [_point(np.array(frame.place), np.array(frame.z), np.array(frame.x)) for frame in local]
        return _chained(joint, (first, second), "RP", (2, 2), (at[0], at[1]), start)
    if kind == "universal":
        kinds, basis = "RR", np.array([one_element.z, two.z, np.cross(one_element.z, two.z)])
    elif kind == "planar":
        kinds, basis = "PPR", np.array([two.x, two.y, two.z])
    else:
        kinds, basis = "RRR", _turning(run, walk, first, second)
    return _counted(walk, joint, (first, second), kinds, basis, two.place)


def hanging_chain(run: Run, walk: Forward, link: str) -> Chain:
    """Three slides of the mass centre and three turns, from the ground to a link that no joint holds."""
    ground = run.system.mechanism.fixed_link
    centre = walk.at(link, run.system.centre(walk.values, link)).place
    return _counted(walk, link, (ground, link), "PPPRRR", _turning(run, walk, ground, link), centre)


def _counted(walk: Forward, name: str, links: tuple[str, str], kinds: str, basis: Array, place: Sequence[Any]) -> Chain:
    """A chain whose coordinates are 0 at the start, along and about the rows of `basis`, from a place, m."""
    order = [kinds[:k].count(kind) if kinds != "PPR" or kind == "P" else 2 for k, kind in enumerate(kinds)]
    at = np.array([single(part) for part in place])
    frames, twists = (
        [_plain(getattr(walk.motions[link], part)) for link in links] for part in ("frame", "twist")
    )  # fmt: skip
    spin = np.subtract(twists[1].u, twists[0].u)
    speed = np.subtract(moment_at(twists[1], tuple(at)), moment_at(twists[0], tuple(at)))
    start = [(0.0, float(basis[i] @ (spin if kind == "R" else speed))) for i, kind in zip(order, kinds, strict=True)]
    points = []
    for frame, i in zip(frames, (order[0], order[-1]), strict=True):
        axes = np.array(frame[:3])  # rows: axes of the link
        points.append(_point(axes @ (at - np.array(frame.place)), axes @ basis[i], axes @ basis[(i + 1) % 3]))
    return _chained(name, links, kinds, order, (points[0], points[1]), start)


def _chained(
    name: str, links: tuple[str, str], kinds: str, order: Sequence[int],
    ends: tuple[dict[str, Any], dict[str, Any]], start: Sequence[tuple[float, float]],
) -> Chain:  # fmt: skip
    """The parts of a chain. order: along which axis of its carriers each of its joints is."""
    names = [f"{name}_in_play_{k}" for k in range(1, len(kinds) + 1)]
    carriers = [f"{link}_carrier" for link in names[:-1]]
    row, axes = [links[0], *carriers, links[1]], np.eye(3)
    bodies: dict[str, dict[str, Any]] = {link: {"points": {}} for link in carriers}
    joints: dict[str, dict[str, Any]] = {}
    for k, (link, kind, i) in enumerate(zip(names, kinds, order, strict=True)):
        pair = {"R": "revolute", "P": "prismatic"}[kind]
        joints[link] = {"type": pair, "links": row[k : k + 2], "friction": 0, "seat": "free"}
        for carrier in (row[k], row[k + 1]):
            if carrier in bodies:
                bodies[carrier]["points"][link] = _point(np.zeros(3), axes[i], axes[(i + 1) % 3])
    points = {names[0]: ends[0]}, {names[-1]: ends[1]}
    return Chain(points, bodies, joints, dict(zip(names, start, strict=True)))


def _point(at: Array, axis: Array, x: Array) -> dict[str, Any]:
    return {"at": at.tolist(), "axis": axis.tolist(), "x": x.tolist()}


# ---- axes of three turns --------------------------------------------------------------------------------------


def _turning(run: Run, walk: Forward, first: str, second: str) -> Array:
    """Rows: three axes at right angles at the start, of which first and last keep apart over the cycle."""
    start = _relative(walk, first, second)[0]
    moving = _relative(run.walk(np.linspace(0.0, run.cycle.duration, LOOKS)), first, second)
    turned = np.array(
        [rotation @ start.T for rotation in (start, *moving) if np.all(np.isfinite(rotation))]
    )  # as the first link sees it
    home = np.array(_plain(walk.motions[first].frame)[:3]).T
    best, least = np.eye(3), np.inf
    for axis in _tried(turned):
        rotation = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
        rotation /= np.linalg.norm(rotation)
        other = np.cross(axis, rotation)
        for angle in np.arange(ANGLES) * np.pi / ANGLES:
            last = np.cos(angle) * rotation + np.sin(angle) * other
            near = float(np.max(np.abs(axis @ turned @ last)))
            if near < least - 1e-9:
                best, least = np.array([axis, np.cross(last, axis), last]), near
    if least > MEETING:
        what = f"{second} turns so far against {first} that no three axes of its turns keep apart over the cycle"
        raise MechanismError(
            Finding(what, f"links.{second}", "let fewer joints of this link be in play, or it turn less")
        )
    cosines: Array = best @ home.T
    return cosines


def _tried(turned: Array) -> Iterator[Array]:
    """First axes to be tried: those about which the links turn most, then those of the first link."""
    halves = np.array(
        [[matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]] for matrix in turned]
    )
    yield from np.linalg.eigh(halves.T @ halves)[1].T[::-1]
    yield from np.eye(3)


def _relative(walk: Forward, first: str, second: str) -> Array:
    """How the second link is turned as the first sees it, (time, row, column)."""
    first_axis, other = (
        np.array([[np.broadcast_to(primal(part), np.shape(walk.time)).ravel() for part in axis]
                  for axis in walk.motions[link].frame[:3]])
        for link in (first, second)
    )  # fmt: skip
    products: Array = np.einsum("art,brt->tab", first_axis, other)  # axis of the first, of the second
    return products


def _plain(numbers: Any) -> Any:
    """Numbers of one lane as floats."""
    return each(numbers, single)
