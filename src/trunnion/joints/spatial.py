"""How each kinematic pair moves in space: from its coordinates to frames, and the screws of its freedoms.

The second element of a pair is seen from the first: turned and slid along the z axis of the first for a pair on one
axis. A pair with several freedoms is a row of such screws. The coordinates of a spherical pair are a unit quaternion;
its three freedoms are turns about the axes of the first element, so it has no pose in which a freedom is lost.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.space import Frame, Screw, line_of, slid, turned
from trunnion.algebra.vector import Vector3, cross, dot, plus, scaled

__all__ = ["MOTIONS", "PairMotion"]

Coordinates = Sequence[Number]


@dataclass(frozen=True)
class PairMotion:
    """A pair in motion. lead: slide for one radian of a helical pair, m; other pairs take no notice of it.

    kinds: of each coordinate, "turn" (rad), "slide" (m) or "part" (of a quaternion). place: `(first element,
    coordinates, lead)` → second element; unplace: the other way round; screws: `(first, second, lead)` → screw of each
    freedom, global; advance: `(coordinates, steps)` → coordinates after a step in each freedom; together: the screws
    are all fixed in the first element (else each is carried along by those before it). steps: "turn" or "slide" of
    each freedom.
    """

    kinds: tuple[str, ...]
    steps: tuple[str, ...]
    place: Callable[..., Any]  # of the frames and screws of its algebra
    unplace: Callable[..., Any]
    screws: Callable[..., list[Any]]
    advance: Callable[[Coordinates, Sequence[Number]], list[Number]] | None = None
    together: bool = False

    def advanced(self, q: Coordinates, steps: Sequence[Number]) -> list[Number]:
        """The coordinates after a step in each freedom."""
        if self.advance is not None:
            return self.advance(q, steps)
        return [value + step for value, step in zip(q, steps, strict=True)]


NULL: Vector3 = (0.0, 0.0, 0.0)


def _slide(direction: Vector3) -> Screw:
    return Screw(NULL, direction)


def _turned_back(frame: Frame, q: Coordinates, lead: Number) -> Frame:
    return turned(frame, -q[0])


# ---- helical, universal, planar -------------------------------------------------------------------------------


def _helix(first: Frame, second: Frame, lead: Number) -> list[Screw]:
    line = line_of(first)
    return [Screw(line.u, plus(line.m, scaled(lead, line.u)))]


def _crossed(frame: Frame) -> Frame:
    """X(90°): z is where −y was."""
    x, y, z, place = frame
    return Frame(x, z, (-y[0], -y[1], -y[2]), place)


def _uncrossed(frame: Frame) -> Frame:
    x, y, z, place = frame
    return Frame(x, (-z[0], -z[1], -z[2]), y, place)


def _planar(frame: Frame, q: Coordinates, lead: Number) -> Frame:
    place = plus(frame.place, plus(scaled(q[0], frame.x), scaled(q[1], frame.y)))
    return turned(frame._replace(place=place), q[2])


def _planar_back(frame: Frame, q: Coordinates, lead: Number) -> Frame:
    back = turned(frame, -q[2])
    return back._replace(place=plus(back.place, plus(scaled(-q[0], back.x), scaled(-q[1], back.y))))


# ---- spherical ------------------------------------------------------------------------------------------------


def _rotated_by(frame: Frame, q: Coordinates) -> Frame:
    """The frame turned by a quaternion in its own axes."""
    w, a, b, c = q
    columns = (
        (1 - 2 * (b * b + c * c), 2 * (a * b + w * c), 2 * (a * c - w * b)),
        (2 * (a * b - w * c), 1 - 2 * (a * a + c * c), 2 * (b * c + w * a)),
        (2 * (a * c + w * b), 2 * (b * c - w * a), 1 - 2 * (a * a + b * b)),
    )
    x, y, z = (plus(plus(scaled(u, frame.x), scaled(v, frame.y)), scaled(t, frame.z)) for u, v, t in columns)
    return Frame(x, y, z, frame.place)


def _ball(frame: Frame, q: Coordinates, lead: Number) -> Frame:
    return _rotated_by(frame, _unit(q))


def _ball_back(frame: Frame, q: Coordinates, lead: Number) -> Frame:
    w, a, b, c = _unit(q)
    return _rotated_by(frame, (w, -a, -b, -c))


def _unit(q: Coordinates) -> list[Number]:
    """A quaternion of length one; its dual parts then keep it so."""
    square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
    size = 1 / namespace(square).sqrt(square)
    return [size * part for part in q]


def _ball_step(q: Coordinates, steps: Sequence[Number]) -> list[Number]:
    """exp(δ) q, δ in the axes of the first element, to the order of δ²; the length is put right."""
    w, *v = _unit(q)
    half: Vector3 = (0.5 * steps[0], 0.5 * steps[1], 0.5 * steps[2])
    vector: Vector3 = (v[0], v[1], v[2])
    turn = plus(plus(vector, scaled(w, half)), cross(half, vector))
    return _unit([w - dot(half, vector), *turn])


def _ball_screws(first: Frame, second: Frame, lead: Number) -> list[Screw]:
    return [Screw(axis, cross(first.place, axis)) for axis in (first.x, first.y, first.z)]


MOTIONS: dict[str, PairMotion] = {
    "revolute": PairMotion(
        ("turn",),
        ("turn",),
        lambda frame, q, lead: turned(frame, q[0]),
        _turned_back,
        lambda first, second, lead: [line_of(first)],
    ),
    "prismatic": PairMotion(
        ("slide",),
        ("slide",),
        lambda frame, q, lead: slid(frame, q[0]),
        lambda frame, q, lead: slid(frame, -q[0]),
        lambda first, second, lead: [_slide(first.z)],
    ),
    "cylindrical": PairMotion(
        ("turn", "slide"),
        ("turn", "slide"),
        lambda frame, q, lead: slid(turned(frame, q[0]), q[1]),
        lambda frame, q, lead: slid(turned(frame, -q[0]), -q[1]),
        lambda first, second, lead: [line_of(first), _slide(first.z)],
    ),
    "helical": PairMotion(
        ("turn",),
        ("turn",),
        lambda frame, q, lead: slid(turned(frame, q[0]), lead * q[0]),
        lambda frame, q, lead: slid(turned(frame, -q[0]), -lead * q[0]),
        _helix,
    ),
    "universal": PairMotion(
        ("turn", "turn"),
        ("turn", "turn"),
        lambda frame, q, lead: turned(_crossed(turned(frame, q[0])), q[1]),
        lambda frame, q, lead: turned(_uncrossed(turned(frame, -q[1])), -q[0]),
        lambda first, second, lead: [line_of(first), line_of(second)],
    ),
    "planar": PairMotion(
        ("slide", "slide", "turn"),
        ("slide", "slide", "turn"),
        _planar,
        _planar_back,
        lambda first, second, lead: [_slide(first.x), _slide(first.y), line_of(second)],
    ),
    "spherical": PairMotion(
        ("part", "part", "part", "part"),
        ("turn", "turn", "turn"),
        _ball,
        _ball_back,
        _ball_screws,
        _ball_step,
        together=True,
    ),
    "fixed": PairMotion(
        (),
        (),
        lambda frame, q, lead: frame,
        lambda frame, q, lead: frame,
        lambda first, second, lead: [],
    ),
}
