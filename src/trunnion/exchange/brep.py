"""The text of a STEP file, and its solids as their faces bound them: exact moments, and the faces of joints.

`#12=CARTESIAN_POINT('',(0.,1.,2.));` is the entity 12 of the kind CARTESIAN_POINT with the arguments
`['', [0., 1., 2.]]`; a complex entity has several kinds. Entities are read when they are asked for.

A face is a piece of a plane or of a surface of revolution with the profile (r(v), z(v)), cut out by edges. With the
divergence theorem volume integrals are integrals of q·n over the faces, and with Green's theorem these are integrals
along the edges, ∬ f du dv = −∮ (∫ f dv) du, which Gauss's rule gives to rounding. Nothing is meshed.
"""

from __future__ import annotations

import math
import re
from collections import Counter, defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import BSpline

from trunnion.exchange.draft import Array, Place, few, perpendicular, refused, steiner

LARGEST = 400_000  # entities of a file that is read; an assembly of a hundred parts has about half of it

_START = re.compile(r"#(\d+)\s*+=\s*+")
# text, comments and what stands between them, up to the semicolon; nothing is tried twice
_BODY = re.compile(r"(?:[^;'/]++|'[^']*+'|/\*(?:[^*]++|\*(?!/))*+\*/|/(?!\*))*+;")
_KIND = re.compile(r"\s*([A-Z][A-Z0-9_]*)\s*\(")
_TOKEN = re.compile(
    r"\s*+(?:/\*.*?\*/\s*+)*(?:(?P<string>'(?:[^']|'')*')|#(?P<ref>\d+)|(?P<number>[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)"
    r"|\.(?P<enum>\w+)\.|(?P<kind>[A-Za-z_]\w*)|(?P<sign>[()$*,])|\"(?P<binary>[0-9A-F]*)\")",
    re.DOTALL,
)
_WIDE = re.compile(r"\\X2\\((?:[0-9A-F]{4})+)\\X0\\|\\X\\([0-9A-F]{2})|\\S\\(.)")
Entity = dict[str, list[Any]]  # kind → arguments
GAUSS = np.polynomial.legendre.leggauss(12)  # along an edge, a piece of at most 45°
INNER = np.polynomial.legendre.leggauss(24)  # across a face: exact for powers, 1e-14 for a full turn of a torus
CLOSED = 1e-9  # rad: an arc shorter than this is a full turn
MISSED = 1e-6  # of a spline, by which its ends may miss its vertices
KINDS = {
    "PLANE": "plane",
    "CYLINDRICAL_SURFACE": "cylinder",
    "CONICAL_SURFACE": "cone",
    "SPHERICAL_SURFACE": "sphere",
    "TOROIDAL_SURFACE": "torus",
}
WRAPPED = ("SURFACE_CURVE", "SEAM_CURVE", "INTERSECTION_CURVE", "TRIMMED_CURVE")


class Ref(int):
    """The number of another entity."""


class Part21:
    """A STEP file.

    Parameters
    ----------
    path : the file.

    Raises
    ------
    MechanismError : if it is no STEP file, is cut off or has too many entities.
    """

    def __init__(self, path: Path) -> None:
        raw = path.read_bytes()
        if b"ISO-10303-21" not in raw[:4096]:
            raise refused("is not a STEP file: it does not begin with ISO-10303-21")
        if b"ENDSEC" not in raw[-4096:]:
            raise refused("is cut off: its end is missing")
        few(raw.count(b"="), LARGEST, "entities")
        self.text = raw.decode("utf-8", errors="replace")
        self.spans: dict[int, tuple[int, int]] = {}
        self._kinds: dict[str, list[int]] = defaultdict(list)
        self._read: dict[int, Entity] = {}
        start = _START.search(self.text)
        while start is not None:
            number, body = int(start[1][:18]), _BODY.match(self.text, start.end())
            if body is None:
                raise refused(f"is damaged at #{number}: the entity has no end")
            self.spans[number] = start.end(), body.end() - 1
            kind = _KIND.match(body[0])
            for name in [kind[1]] if kind else re.findall(r"([A-Z][A-Z0-9_]*)\s*\(", body[0]):
                self._kinds[name].append(number)
            start = _START.search(self.text, body.end())
        if not self.spans:
            raise refused("has no entities")

    def of(self, kind: str) -> list[int]:
        """Numbers of all entities of a kind, in the order of the file."""
        return self._kinds.get(kind, [])

    def __getitem__(self, number: int) -> Entity:
        """An entity: its arguments by kind."""
        entity = self._read.get(number)
        if entity is None:
            if number not in self.spans:
                raise refused(f"refers to #{number}, which it does not have")
            start, end = self.spans[number]
            entity = self._read[number] = self._parsed(number, self.text[start:end])
        return entity

    def kind(self, number: int) -> str:
        """The kind of an entity, of a complex one the first."""
        return next(iter(self[number]))

    def args(self, number: Any, kind: str) -> list[Any]:
        """The arguments of an entity that must be of a kind."""
        entity = self[number] if isinstance(number, Ref | int) else {}
        if kind not in entity:
            raise refused(f"has {', '.join(entity) or 'nothing'} at #{number} where {kind} belongs")
        return entity[kind]

    def references(self, number: int) -> set[int]:
        """Numbers that the text of an entity names."""
        start, end = self.spans.get(number, (0, 0))
        bare = re.sub(r"'[^']*'", "", self.text[start:end])
        return {int(digits) for digits in re.findall(r"#(\d+)", bare)}

    def _parsed(self, number: int, text: str) -> Entity:
        values: list[Any] = []
        stack: list[list[Any]] = [values]
        kinds: list[str] = []  # the kind in front of each open list; empty if none
        pending = ""
        position, end = 0, len(text.rstrip())
        while position < end:
            token = _TOKEN.match(text, position)
            if token is None:
                raise refused(f"cannot be read at #{number}: '{text[position : position + 30].strip()}'")
            position = token.end()
            name = token.lastgroup or "sign"
            value: str = token[name]
            if name == "kind":
                pending = value.upper()
            elif value == "(" and name == "sign":
                stack.append([])
                kinds.append(pending)
                pending = ""
            elif value == ")" and name == "sign":
                if len(stack) < 2:
                    raise refused(f"has a bracket too many at #{number}")
                inner, kind = stack.pop(), kinds.pop()
                stack[-1].append((kind, inner) if kind else inner)
            elif name == "sign":
                if value != ",":
                    stack[-1].append(None)
            else:
                stack[-1].append(_value(name, value))
        records = values[0] if len(values) == 1 and isinstance(values[0], list) else values
        if len(stack) > 1 or not all(isinstance(record, tuple) for record in records):
            raise refused(f"cannot be read at #{number}: its brackets do not match")
        return dict(records)


def _value(name: str, text: str) -> Any:
    """A token as a Python value; in a text \\X2\\…\\X0\\ are signs in UTF-16, \\X\\… and \\S\\… those of ISO 8859-1."""

    def decoded(match: re.Match[str]) -> str:
        if match[1]:
            return bytes.fromhex(match[1]).decode("utf-16-be", errors="replace")
        return chr(int(match[2], 16)) if match[2] else chr(ord(match[3]) + 128)

    if name == "string":
        return _WIDE.sub(decoded, text[1:-1].replace("''", "'")).replace("\\\\", "\\")
    if name == "ref":
        return Ref(text)
    if name == "number":
        return float(text)
    return text == "T" if name == "enum" and text in ("T", "F") else text


def quoted(text: str) -> str:
    """A text as a string of a STEP file."""
    signs = text.replace("\\", "\\\\").replace("'", "''")
    coded = (c if " " <= c <= "~" else f"\\X2\\{c.encode('utf-16-be').hex().upper()}\\X0\\" for c in signs)
    return f"'{''.join(coded)}'"


# ---- moments ---------------------------------------------------------------------------------------------------------


class UnreadError(Exception):
    """A curve that is not integrated along."""


def moments_of(volume: float, first: Array, second: Array) -> Array:
    """∫ h hᵀ dV with h = (1, q), (4, 4): volume, m³, first moment, m⁴, and second moment, m⁵, about the origin.

    Those of several bodies add up; times a density they are those of the mass.
    """
    return np.block([[np.array([[volume]]), first[None]], [first[:, None], second]])


def moved(moments: Array, place: Place) -> Array:
    """The moments of the same body at another place."""
    frame = np.block([[np.ones((1, 1)), np.zeros((1, 3))], [place.shift[:, None], place.matrix]])
    return np.asarray(abs(np.linalg.det(place.matrix)) * frame @ moments @ frame.T)


def mass_of(moments: Array) -> tuple[float, Array, Array]:
    """Volume or mass, its centre and the inertia tensor about that."""
    volume, first, second = moments[0, 0], moments[0, 1:], moments[1:, 1:]
    centre = first / volume
    return float(volume), centre, np.trace(second) * np.eye(3) - second - volume * steiner(centre)


@dataclass
class Face:
    """A face of a solid, in its frame.

    Parameters
    ----------
    kind : plane, cylinder, cone, sphere, torus; free for any other surface.
    frame : rows are x, y and axis, or normal, of the surface (3, 3).
    origin : point on the axis or plane, centre of a sphere or torus, m.
    radius : of a cylinder or sphere, m; of a torus that of its middle circle.
    outward : whether the surface's own normal (away from its axis or centre) leaves the material: a pin, not a hole.
    area : m². outline : points of its boundary, m, (n, 3).
    number : of the entity in the file.
    """

    kind: str
    frame: Array
    origin: Array
    radius: float
    outward: bool
    number: int
    minor: float = 0.0  # angle of a cone, rad; radius of the tube of a torus, m
    tolerance: str | tuple[float, float] = ""  # of its diameter: a class such as H7, or lower and upper deviation, m
    area: float = 0.0
    outline: Array = field(default_factory=lambda: np.zeros((0, 3)))

    @property
    def axis(self) -> Array:
        """Direction of the axis, or normal of the plane."""
        return np.asarray(self.frame[2])


@dataclass
class Solid:
    """A body of a file: its faces, its moments by `moments_of`; doubts: why these are not exact."""

    number: int
    faces: list[Face]
    moments: Array
    doubts: list[str]


class Geometry:
    """The geometry of a representation of a file.

    Parameters
    ----------
    file : the STEP file.
    length, angle : its units, in m and rad.
    """

    def __init__(self, file: Part21, length: float, angle: float) -> None:
        self.file, self.length, self.angle = file, length, angle
        self._edges: dict[int, tuple[Array, Array, Array]] = {}

    # ---- points and frames ---------------------------------------------------------------------------------

    def point(self, number: Any) -> Array:
        """A CARTESIAN_POINT, m."""
        values = [float(part) for part in self.file.args(number, "CARTESIAN_POINT")[1]]
        return self.length * np.array([*values, 0.0, 0.0, 0.0][:3])

    def direction(self, number: Any) -> Array:
        """A DIRECTION, of unit length."""
        values = np.array([*self.file.args(number, "DIRECTION")[1], 0.0][:3], dtype=float)
        size = float(np.linalg.norm(values))
        if not size > 0:
            raise refused(f"has a direction without length at #{number}")
        return values / size

    def placement(self, number: Any) -> tuple[Array, Array]:
        """The frame, rows x, y, z, and origin, m, of an AXIS2_PLACEMENT_3D."""
        _, location, axis, reference = (*self.file.args(number, "AXIS2_PLACEMENT_3D"), None, None)[:4]
        z = np.array([0.0, 0.0, 1.0]) if axis is None else self.direction(axis)
        x = np.array([1.0, 0.0, 0.0]) if reference is None else self.direction(reference)
        x = x - (x @ z) * z
        if np.linalg.norm(x) < 1e-9:  # the standard lets a reader choose x where the file's is along the axis
            x = perpendicular(z)
        x /= np.linalg.norm(x)
        return np.array([x, np.cross(z, x), z]), self.point(location)

    # ---- edges ---------------------------------------------------------------------------------------------

    def edge(self, number: int) -> tuple[Array, Array, Array]:
        """Nodes, m, weighted tangents and ends of an EDGE_CURVE: ∫ f dq = Σ f(node) · tangent; or UnreadError."""
        if number not in self._edges:
            _, start, end, curve, same = self.file.args(number, "EDGE_CURVE")
            ends = [self.point(self.file.args(vertex, "VERTEX_POINT")[1]) for vertex in (start, end)]
            self._edges[number] = *self._nodes(curve, ends, start == end, bool(same)), np.array(ends)
        return self._edges[number]

    def _nodes(self, curve: Any, ends: list[Array], closed: bool, same: bool) -> tuple[Array, Array]:
        entity = self.file[curve]
        kind = self.file.kind(curve)
        if kind in WRAPPED:
            return self._nodes(entity[kind][1], ends, closed, same)
        if kind == "LINE":
            start, span = ends[0], ends[1] - ends[0]
            return _gauss(lambda t: (start + np.outer(t, span), np.outer(t**0, span)), [0, 1])
        if "B_SPLINE_CURVE_WITH_KNOTS" in entity:
            args = entity["B_SPLINE_CURVE_WITH_KNOTS"]
            degree, poles = (entity["B_SPLINE_CURVE"] if "B_SPLINE_CURVE" in entity else args[1:])[:2]
            repeats, knots = np.array(args[-3], dtype=int), np.array(args[-2], dtype=float)
            weights = np.array(entity.get("RATIONAL_B_SPLINE_CURVE", [[1.0] * len(poles)])[0], dtype=float)[:, None]
            points = np.array([self.point(pole) for pole in poles])
            spline = BSpline(np.repeat(knots, repeats), np.hstack([points * weights, weights]), int(degree))
            rates = spline.derivative()

            def drawn(t: Array) -> tuple[Array, Array]:
                h, dh = spline(t), rates(t)
                place = h[:, :3] / h[:, 3:]
                return place, (dh[:, :3] - place * dh[:, 3:]) / h[:, 3:]

            breaks = np.unique(knots)[:: 1 if same else -1]
            if not closed and np.abs(drawn(breaks[[0, -1]])[0] - ends).max() > MISSED * np.ptp(points, axis=0).max():
                raise UnreadError("a part of a spline")
            return _gauss(drawn, breaks)
        if kind not in ("CIRCLE", "ELLIPSE"):
            raise UnreadError(f"a curve {kind}")
        frame, centre = self.placement(entity[kind][1])
        sizes = [self.length * float(size) for size in entity[kind][2:]]
        a, b = sizes[0] * frame[0], sizes[-1] * frame[1]
        first, last = (math.atan2((p - centre) @ b / (b @ b), (p - centre) @ a / (a @ a)) for p in ends)
        turn = (last - first if same else first - last) % (2 * math.pi)
        turn = 2 * math.pi if closed or turn < CLOSED else turn

        def course(t: Array) -> tuple[Array, Array]:
            sine, cosine = np.sin(t), np.cos(t)
            return centre + np.outer(cosine, a) + np.outer(sine, b), np.outer(cosine, b) - np.outer(sine, a)

        pieces = max(1, math.ceil(turn / (math.pi / 4)))
        return _gauss(course, np.linspace(first, first + (turn if same else -turn), pieces + 1))

    def loop(self, number: Any) -> list[tuple[Array, Array, Array, int, bool]]:
        """The edges of a loop in its order: nodes, tangents, ends, number and whether it runs along its edge."""
        kind = self.file.kind(number)
        if kind not in ("EDGE_LOOP", "VERTEX_LOOP"):
            raise UnreadError(f"a loop {kind}")
        edges = []  # none of a vertex loop, which bounds a whole sphere or torus
        for oriented in self.file.args(number, kind)[1] if kind == "EDGE_LOOP" else ():
            *_, edge, along = self.file.args(oriented, "ORIENTED_EDGE")
            nodes, tangents, ends = self.edge(edge)
            edges.append((nodes, tangents if along else -tangents, ends, int(edge), bool(along)))
        return edges

    # ---- faces and solids ----------------------------------------------------------------------------------

    def surface(self, number: Any, outward: bool, face: int) -> Face:
        """The surface of a face, without its bounds."""
        kind = self.file.kind(number)
        args = self.file[number][kind]
        if kind not in KINDS:
            return Face("free", np.eye(3), np.zeros(3), 0.0, outward, face)
        frame, origin = self.placement(args[1])
        sizes = [float(size) for size in args[2:4]]
        radius = self.length * sizes[0] if sizes else 0.0
        minor = sizes[1] * (self.angle if kind == "CONICAL_SURFACE" else self.length) if len(sizes) > 1 else 0.0
        return Face(KINDS[kind], frame, origin, radius, outward, face, minor)

    def solid(self, number: int) -> Solid:
        """A MANIFOLD_SOLID_BREP, BREP_WITH_VOIDS or FACETED_BREP."""
        kind = self.file.kind(number)
        args = self.file[number][kind]
        shells = [(args[1], True)]
        for void in args[2] if kind == "BREP_WITH_VOIDS" else []:
            *_, shell, along = self.file.args(void, "ORIENTED_CLOSED_SHELL")
            shells.append((shell, bool(along)))
        solid = Solid(number, [], np.zeros((4, 4)), [])
        used: Counter[tuple[int, bool]] = Counter()
        for shell, along in shells:
            for face in self.file[shell][self.file.kind(shell)][1]:
                self._face(face, along, solid, used)
        if any(used[edge, True] != used[edge, False] for edge, _ in used):
            solid.doubts.append("its surface is not closed")
        if not solid.doubts and solid.moments[0, 0] < 0:  # inside out
            solid.moments = -solid.moments
            for piece in solid.faces:
                piece.outward = not piece.outward
        return solid

    def _face(self, number: Any, along: bool, solid: Solid, used: Counter[tuple[int, bool]]) -> None:
        """Add a face and its share of the moments to a solid."""
        kind = self.file.kind(number)
        if kind not in ("ADVANCED_FACE", "FACE_SURFACE"):
            raise refused(f"has {kind} at #{number} where a face belongs")
        _, bounds, surface, same = self.file[number][kind][:4]
        face = self.surface(surface, bool(same) == along, int(number))
        loops, points = [], []
        for bound in bounds:
            _, loop, forward = self.file[bound][self.file.kind(bound)]
            sign = 1.0 if bool(forward) == along else -1.0
            try:
                edges = self.loop(loop)
            except UnreadError as error:
                solid.doubts.append(f"it has {error}")
                continue
            used.update((edge, direction == (sign > 0)) for *_, edge, direction in edges)
            if edges:
                loops.append((np.vstack([edge[0] for edge in edges]), sign * np.vstack([edge[1] for edge in edges])))
                points += [np.vstack([edge[0], edge[2]]) for edge in edges]
        face.outline = np.vstack(points) if points else np.zeros((0, 3))
        solid.faces.append(face)
        if face.kind == "free":
            solid.doubts.append("it has free-form faces")
            return
        area, moments = _integrals(face, loops)
        face.area = area if face.outward else -area
        if face.kind in ("sphere", "torus") and face.area <= 1e-12 * face.radius**2:  # loops of what is cut out of it
            r, a, at = face.radius, face.minor, face.origin
            full, volume, squares = 4 * math.pi * r**2, 4 / 3 * math.pi * r**3, np.full(3, r**2 / 5)
            if face.kind == "torus":
                full, volume = 4 * math.pi**2 * r * a, 2 * math.pi**2 * r * a**2
                squares = np.array([r**2 / 2 + 3 / 8 * a**2, r**2 / 2 + 3 / 8 * a**2, a**2 / 4])
            face.area += full
            second = volume * (np.outer(at, at) + face.frame.T @ np.diag(squares) @ face.frame)
            moments = moments + (1.0 if face.outward else -1.0) * moments_of(volume, volume * at, second)
        if not face.area > 0:
            solid.doubts.append("it has faces whose bounds run the wrong way round")
        solid.moments = solid.moments + moments


def _gauss(course: Any, breaks: Any) -> tuple[Array, Array]:
    """Nodes of a curve, and its tangents times the weights, over pieces of its parameter."""
    breaks = np.asarray(breaks, dtype=float)
    half = np.diff(breaks) / 2
    t = (breaks[:-1] + half)[:, None] + half[:, None] * GAUSS[0]
    places, rates = course(t.ravel())
    return places, rates * (half[:, None] * GAUSS[1]).ravel()[:, None]


def _profile(face: Face, v: Array) -> tuple[Array, Array, Array, Array]:
    """r(v), z(v), r′(v), z′(v) of a surface of revolution."""
    unit, nought = np.ones_like(v), np.zeros_like(v)
    if face.kind == "cylinder":
        return face.radius * unit, v, nought, unit
    if face.kind == "cone":
        slope = math.tan(face.minor)
        return face.radius + slope * v, v, slope * unit, unit
    ring, tube = (0.0, face.radius) if face.kind == "sphere" else (face.radius, face.minor)
    return ring + tube * np.cos(v), tube * np.sin(v), -tube * np.sin(v), tube * np.cos(v)


def _integrals(face: Face, loops: list[tuple[Array, Array]]) -> tuple[float, Array]:
    """∬ |n| and the moments by the divergence theorem over the part of a surface that loops bound.

    Both have the sign of the loops: positive if they run counter-clockwise as the surface's own normal sees them. Of a
    sphere or torus they are determined but for a multiple of the closed surface.
    """
    if not loops:
        return 0.0, np.zeros((4, 4))
    frame, places = face.frame, np.vstack([nodes for nodes, _ in loops]) - face.origin
    if face.kind == "sphere":  # turned so that its axis stays away from the edges, where the longitude would jump
        axes = np.random.default_rng(0).normal(size=(64, 3))
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        axis = axes[int(np.argmin(abs(places @ axes.T).max(axis=0)))]
        x = perpendicular(axis)
        frame = np.array([x, np.cross(axis, x), axis])
    places = places @ frame.T
    rates = np.vstack([tangents for _, tangents in loops]) @ frame.T
    (x, y, z), (dx, dy, dz) = places.T, rates.T
    if face.kind == "plane":
        v = np.multiply.outer(y, (INNER[0] + 1) / 2)
        q = x[:, None, None] * frame[0] + v[..., None] * frame[1]
        normal = np.broadcast_to(frame[2], q.shape)
        return _summed(face.origin + q, normal, -dx * y / 2)
    rho = np.hypot(x, y)
    radial = (x[:, None] * frame[0] + y[:, None] * frame[1]) / rho[:, None]
    du = (x * dy - y * dx) / rho**2
    if face.kind in ("cylinder", "cone"):
        v, start = z, float(z.mean())
        if face.kind == "cone" and abs(du.sum()) > 1e-6:  # the loops do not close without the apex: it is in the face
            start = -face.radius / math.tan(face.minor)
    elif face.kind == "sphere":
        v, start = np.arctan2(z, rho), -math.pi / 2
    else:
        level = rho - face.radius
        middle = math.atan2(z.mean(), level.mean())
        v, start = middle + np.angle(np.exp(1j * (np.arctan2(z, level) - middle))), middle
        dv = (level * dz - z * (x * dx + y * dy) / rho) / face.minor**2
        ends = np.cumsum([len(nodes) for nodes, _ in loops])[:-1]
        if max(abs(part.sum()) for part in np.split(dv, ends)) > math.pi:  # a piece of a bent bar: ∮ (∫ f du) dv
            angle = math.atan2(y.mean(), x.mean())
            u = np.angle(np.exp(1j * (np.arctan2(y, x) - angle)))
            turned = angle + np.multiply.outer(u, (INNER[0] + 1) / 2)
            radial = np.cos(turned)[..., None] * frame[0] + np.sin(turned)[..., None] * frame[1]
            return _revolved(face, frame, v[:, None], radial, u / 2 * dv)
    across = start + np.multiply.outer(v - start, (INNER[0] + 1) / 2)
    return _revolved(face, frame, across, radial[:, None, :], -du * (v - start) / 2)


def _revolved(face: Face, frame: Array, v: Array, radial: Array, weights: Array) -> tuple[float, Array]:
    """The sums over nodes on a surface of revolution; its normal times the area element is r (z′ e_r − r′ e_z)."""
    r, z, dr, dz = (part[..., None] for part in _profile(face, v))
    q = face.origin + r * radial + z * frame[2]
    return _summed(q, np.broadcast_to(r * (dz * radial - dr * frame[2]), q.shape), weights)


def _summed(q: Array, normal: Array, weights: Array) -> tuple[float, Array]:
    """Σ over nodes (n, 24): areas and moments; ∫ q…q dV = ∬ q…q (q·n) dA / (3 + number of q)."""
    total = weights[:, None] * INNER[1]
    area = float((total * np.linalg.norm(normal, axis=-1)).sum())
    flux = total * (q * normal).sum(axis=-1)
    h, count = np.concatenate([np.ones_like(q[..., :1]), q], axis=-1), np.array([0, 1, 1, 1])
    return area, np.einsum("ij,ijk,ijl->kl", flux, h, h) / (3 + count + count[:, None])
