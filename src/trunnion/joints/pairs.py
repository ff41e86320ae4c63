"""Kinematic pairs: which motions a joint frees, and how it moves: from its coordinates to frames, and its screws.

The table `PAIRS` is the vocabulary of `type:` in a model file, `MOTIONS` has the motion of each. A new pair is one
entry of both. The second element of a pair is seen from the first: turned and slid along the z axis of the first for a
pair on one axis; in the plane slid along its x axis. A pair with several freedoms is a row of such screws. The
coordinates of a spherical pair are a unit quaternion; its three freedoms are turns about the axes of the first element,
so it has no pose in which a freedom is lost.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from trunnion.algebra import plane
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.space import NULL, Frame, Screw, line_of, slid, turned
from trunnion.algebra.vector import Vector3, cross, dot, plus, scaled


@dataclass(frozen=True)
class Pair:
    """A kind of lower pair.

    symbol: its letter in a structural formula. freedoms: which of ("rotation", "slide") it frees: a rotation has a pin,
    a slide alone a guide, and a driver prescribes the first. count: freedoms of the relative motion in space.
    planar: whether it exists in the plane. needs_axis: the spaces in which the points on both links must state an axis.
    one_axis: whether it does nothing but turn about and slide along one axis that both links share; angle: whether its
    turn is one angle, about an axis that has the same direction in both links; crossed: whether it turns about two axes
    at right angles, one in each link; threaded: whether a turn slides it along; body: how it is drawn in space.
    """

    name: str
    symbol: str
    freedoms: tuple[str, ...]
    count: int
    planar: bool = False
    needs_axis: tuple[str, ...] = ("spatial",)
    one_axis: bool = False
    angle: bool = False
    crossed: bool = False
    threaded: bool = False
    body: str = "sleeve"

    @property
    def turns(self) -> bool:
        """Whether its coordinate, as drivers and loads see it, is an angle: it has a pin, else a guide."""
        return "rotation" in self.freedoms

    @property
    def slides(self) -> bool:
        """Whether it slides along its axis."""
        return self.one_axis and ("slide" in self.freedoms or self.threaded)

    @property
    def guided(self) -> bool:
        """Whether it slides along its axis and does nothing else."""
        return self.one_axis and not self.turns

    @property
    def pivot(self) -> bool:
        """Whether it turns about one axis and does nothing else."""
        return self.motions == ("rotation",)

    @property
    def bored(self) -> bool:
        """Whether a plain pin turns in a hole about one axis, be it that it also slides."""
        return self.one_axis and self.turns and not self.threaded

    @property
    def motions(self) -> tuple[str, ...]:
        """Which of rotation and slide it makes about and along the one axis that both links share."""
        both = (("rotation", self.one_axis and self.turns), ("slide", self.slides))
        return tuple(motion for motion, makes in both if makes)

    @property
    def meets(self) -> bool:
        """Whether the points of its two elements are one."""
        return "slide" not in self.freedoms and not self.threaded

    @property
    def ball(self) -> bool:
        """Whether it turns about any axis through its point."""
        return self.turns and self.count == 3


PAIRS: dict[str, Pair] = {
    "revolute": Pair("revolute", "R", ("rotation",), 1, planar=True, one_axis=True, angle=True),
    "prismatic": Pair(
        "prismatic", "P", ("slide",), 1, planar=True, needs_axis=("planar", "spatial"), one_axis=True, body="rail"
    ),
    "cylindrical": Pair("cylindrical", "C", ("rotation", "slide"), 2, one_axis=True, angle=True),
    "spherical": Pair("spherical", "S", ("rotation",), 3, needs_axis=(), body="ball"),
    "universal": Pair("universal", "U", ("rotation",), 2, crossed=True, body="cross"),
    "helical": Pair("helical", "H", ("rotation",), 1, one_axis=True, angle=True, threaded=True),
    "planar": Pair("planar", "E", ("slide",), 3, angle=True, body="plate"),
    "fixed": Pair("fixed", "F", (), 0, needs_axis=(), body="cube"),
}
GUIDED = tuple(kind for kind, pair in PAIRS.items() if pair.guided)


# ---- pairs in motion --------------------------------------------------------------------------------------------

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


def _tipped(frame: Frame, sense: float) -> Frame:
    """Turned about x by 90° in the sense 1, so that z is where −y was, or in the sense −1."""
    x, y, z, place = frame
    return Frame(x, scaled(sense, z), scaled(-sense, y), place)


def _moved_aside(frame: Frame, x: Number, y: Number) -> Frame:
    """Moved along its own axes x and y."""
    return frame._replace(place=plus(frame.place, plus(scaled(x, frame.x), scaled(y, frame.y))))


def _rotated_by(frame: Frame, q: Coordinates, sense: float = 1.0) -> Frame:
    """The frame turned by a quaternion in its own axes, forward or back."""
    w, *vector = _unit(q)
    a, b, c = (sense * part for part in vector)
    columns = (
        (1 - 2 * (b * b + c * c), 2 * (a * b + w * c), 2 * (a * c - w * b)),
        (2 * (a * b - w * c), 1 - 2 * (a * a + c * c), 2 * (b * c + w * a)),
        (2 * (a * c + w * b), 2 * (b * c - w * a), 1 - 2 * (a * a + b * b)),
    )
    x, y, z = (plus(plus(scaled(u, frame.x), scaled(v, frame.y)), scaled(t, frame.z)) for u, v, t in columns)
    return Frame(x, y, z, frame.place)


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


MOTIONS: dict[str, dict[str, PairMotion]] = {
    "planar": {
        "revolute": PairMotion(
            ("turn",),
            ("turn",),
            lambda frame, q, lead=0.0: plane.turned(frame, q[0]),
            lambda frame, q, lead=0.0: plane.turned(frame, -q[0]),
            lambda first, second, lead=0.0: [plane.line_of(second)],
        ),
        "prismatic": PairMotion(
            ("slide",),
            ("slide",),
            lambda frame, q, lead=0.0: plane.slid(frame, q[0]),
            lambda frame, q, lead=0.0: plane.slid(frame, -q[0]),
            lambda first, second, lead=0.0: [plane.Twist(first.c, first.s, 0.0)],
        ),
    },
    "spatial": {
        "revolute": PairMotion(
            ("turn",),
            ("turn",),
            lambda frame, q, lead: turned(frame, q[0]),
            lambda frame, q, lead: turned(frame, -q[0]),
            lambda first, second, lead: [line_of(first)],
        ),
        "prismatic": PairMotion(
            ("slide",),
            ("slide",),
            lambda frame, q, lead: slid(frame, q[0]),
            lambda frame, q, lead: slid(frame, -q[0]),
            lambda first, second, lead: [Screw(NULL, first.z)],
        ),
        "cylindrical": PairMotion(
            ("turn", "slide"),
            ("turn", "slide"),
            lambda frame, q, lead: slid(turned(frame, q[0]), q[1]),
            lambda frame, q, lead: slid(turned(frame, -q[0]), -q[1]),
            lambda first, second, lead: [line_of(first), Screw(NULL, first.z)],
        ),
        "helical": PairMotion(
            ("turn",),
            ("turn",),
            lambda frame, q, lead: slid(turned(frame, q[0]), lead * q[0]),
            lambda frame, q, lead: slid(turned(frame, -q[0]), -lead * q[0]),
            lambda first, second, lead: [Screw(first.z, plus(line_of(first).m, scaled(lead, first.z)))],
        ),
        "universal": PairMotion(
            ("turn", "turn"),
            ("turn", "turn"),
            lambda frame, q, lead: turned(_tipped(turned(frame, q[0]), 1.0), q[1]),
            lambda frame, q, lead: turned(_tipped(turned(frame, -q[1]), -1.0), -q[0]),
            lambda first, second, lead: [line_of(first), line_of(second)],
        ),
        "planar": PairMotion(
            ("slide", "slide", "turn"),
            ("slide", "slide", "turn"),
            lambda frame, q, lead: turned(_moved_aside(frame, q[0], q[1]), q[2]),
            lambda frame, q, lead: _moved_aside(turned(frame, -q[2]), -q[0], -q[1]),
            lambda first, second, lead: [Screw(NULL, first.x), Screw(NULL, first.y), line_of(second)],
        ),
        "spherical": PairMotion(
            ("part", "part", "part", "part"),
            ("turn", "turn", "turn"),
            lambda frame, q, lead: _rotated_by(frame, q),
            lambda frame, q, lead: _rotated_by(frame, q, -1.0),
            lambda first, second, lead: [Screw(axis, cross(first.place, axis)) for axis in first[:3]],
            _ball_step,
            together=True,
        ),
        "fixed": PairMotion(
            (), (), lambda frame, q, lead: frame, lambda frame, q, lead: frame, lambda first, second, lead: []
        ),
    },
}
