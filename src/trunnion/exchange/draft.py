"""A mechanism as other programs hold it: bodies and pairs that all lie in one frame, as drawn.

Every reader makes a Draft of its file, and `model_text` makes the model of it; every writer gets the `Positions` of a
mechanism, and of these the Draft at a position. Places are in m, in the global frame.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from itertools import count
from pathlib import Path
from traceback import walk_tb
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from trunnion.algebra.dual import primal
from trunnion.algebra.space import rotation_matrix
from trunnion.errors import Finding, MechanismError, Severity
from trunnion.joints.pairs import PAIRS
from trunnion.model.parts import InertiaTensor
from trunnion.solve.system import System, build

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism

Array = NDArray[np.float64]
MATERIALS = {"steel": 7850.0, "stainless": 7900.0, "aluminium": 2700.0, "brass": 8500.0, "cast-iron": 7200.0,
             "titanium": 4430.0, "nylon": 1140.0, "pom": 1410.0, "abs": 1050.0, "pla": 1240.0}  # fmt: skip
FARTHEST = 1e9  # m; what lies farther is a mistake of the file
PARALLEL = 1e-6  # rad, between axes that count as parallel
LENGTHS = "pin.bearing", "pin.length", "guide.length"  # of a bearing: the first that is stated
BUGS = (NameError, AttributeError, AssertionError)  # of the program, not of a file
CYCLE = 720  # positions at which the stroke of a driven slide is looked for


def refused(what: str, where: str = "", remedy: str = "mend the file, or export it again") -> MechanismError:
    """What forbids to read a file, to be raised; `import_file` adds which file."""
    return MechanismError(Finding(what, where, remedy))


@contextmanager
def faults_of(path: Path) -> Iterator[None]:
    """Report what goes wrong with a file of another program as a fault of that file."""
    try:
        yield
    except MechanismError as error:
        raise MechanismError([replace(finding, file=finding.file or str(path)) for finding in error.findings]) from None
    except OSError as error:
        raise MechanismError(Finding(f"cannot be read: {error.strerror or error}", file=str(path))) from None
    except (RecursionError, MemoryError):
        raise MechanismError(Finding("is nested too deeply or too large to be read", file=str(path))) from None
    except Exception as error:  # a library raises anything at a damaged file
        frame = [frame for frame, _ in walk_tb(error.__traceback__)][-1]
        if isinstance(error, BUGS) and frame.f_globals.get("__name__", "").startswith("trunnion."):
            raise  # our own mistake, not the file's
        what = printable(f"is damaged, or not as its format has it: {type(error).__name__} {error}")
        raise MechanismError(Finding(what, remedy="mend the file, or export it again", file=str(path))) from error


def few(number: int, most: int, noun: str) -> None:
    """Refuse a file that holds more than a mechanism needs, before it fills the memory."""
    if number > most:
        raise refused(f"has {number:,} {noun}; at most {most:,} are read", remedy="export the mechanism alone")


@dataclass(frozen=True)
class ImportOptions:
    """How a file is read.

    Parameters
    ----------
    ground : the part that does not move; found by the reader if empty.
    density : kg/m³ of parts whose file states none.
    gap : greatest difference of the radii of a pin and its hole that still is a joint, m.
    drive : the joint that is driven; found by the reader if empty.
    unit : length unit of a file that states none, in m; unit_stated : whether the user stated it.
    """

    ground: str = ""
    density: float = MATERIALS["steel"]
    gap: float = 0.5e-3
    drive: str = ""
    unit: float = 1e-3
    unit_stated: bool = False


@dataclass(frozen=True, eq=False)
class Place:
    """A frame in another one: matrix · q + shift, m; the matrix is a rotation, and may mirror and scale a part."""

    matrix: Array = field(default_factory=lambda: np.asarray(np.eye(3)))
    shift: Array = field(default_factory=lambda: np.zeros(3))

    def __matmul__(self, inner: Place) -> Place:
        return Place(self.matrix @ inner.matrix, self.at(inner.shift))

    def at(self, point: Array) -> Array:
        """A point of the frame in the other one."""
        return np.asarray(self.matrix @ point + self.shift)

    def inertia(self, tensor: Array) -> Array:
        """A tensor of the frame in the axes of the other one."""
        return np.asarray(self.matrix @ tensor @ self.matrix.T)

    @property
    def inverse(self) -> Place:
        """The other frame in this one."""
        matrix = np.asarray(np.linalg.inv(self.matrix), dtype=float)
        return Place(matrix, -matrix @ self.shift)


@dataclass
class Body:
    """A rigid body.

    Parameters
    ----------
    name : name of the part, later of the link.
    mass : kg; 0 if the file says nothing of it.
    centre : mass centre, m, (3,).
    inertia : tensor about the mass centre in global axes, kg m², (3, 3).
    points : further points of interest, m, by name.
    comments : how the numbers were found, a line each; they stand above the link in the model file.
    """

    name: str
    mass: float = 0.0
    centre: Array = field(default_factory=lambda: np.zeros(3))
    inertia: Array = field(default_factory=lambda: np.zeros((3, 3)))
    points: dict[str, Array] = field(default_factory=dict)
    comments: list[str] = field(default_factory=list)


@dataclass
class Pair:
    """A pair between two bodies.

    Parameters
    ----------
    name : later of the joint.
    type : of `joints.pairs.PAIRS`.
    links : names of the two bodies; coordinates and rates are of the second against the first.
    at : a point of the pair, m, (3,): on its axis, centre of its ball or cross, middle of its bearing.
    axis : direction of its axis, or normal of a planar pair; of a universal joint of the pin in the first body.
    second_axis : of a universal joint, direction of the pin in the second body.
    pin_radius, hole_radius : of the pin or ball, and of what it runs in, m; of a slider and its guide half the widths.
    pin_limits, hole_limits : lower and upper deviation of these radii that the file states, m.
    length : of a bearing or guide, m.
    elements : place, m, and axis of its element on each body, by name, where they are not the same.
    pitch : of a helical pair, m for a turn.
    limits : range of its coordinate from where it is drawn, rad or m.
    comments : how it was found, a line each; they stand above the joint in the model file.
    """

    name: str
    type: str
    links: tuple[str, str]
    at: Array
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))
    second_axis: Array | None = None
    pin_radius: float | None = None
    hole_radius: float | None = None
    pin_limits: tuple[float, float] | None = None
    hole_limits: tuple[float, float] | None = None
    length: float | None = None
    elements: dict[str, tuple[Array, Array]] = field(default_factory=dict)
    pitch: float | None = None
    limits: tuple[float, float] | None = None
    comments: list[str] = field(default_factory=list)

    def element(self, body: str) -> tuple[Array, Array]:
        """Place, m, and axis of its element on a body."""
        if body in self.elements:
            return self.elements[body]
        second = self.second_axis is not None and body == self.links[1]
        return self.at, self.second_axis if second else self.axis  # type: ignore[return-value]

    @property
    def clearance(self) -> float | None:
        """Radius of the hole less that of the pin, m."""
        return None if self.pin_radius is None or self.hole_radius is None else self.hole_radius - self.pin_radius


@dataclass
class Draft:
    """Bodies, pairs and drives of a mechanism at one position.

    Parameters
    ----------
    name : of the mechanism.
    bodies, pairs : by name, in the order of the file.
    ground : name of the body that does not move; empty if the file does not say it.
    gravity : m/s², (3,); None if the file does not say it.
    drives : rate of a driven joint, rad/s or m/s, by its name.
    plane : whether it is known to move in the plane z = 0.
    source : the file it comes from, for the comment on top.
    findings : what is doubtful; lost : names of what is left out, by what it is.
    """

    name: str = ""
    bodies: dict[str, Body] = field(default_factory=dict)
    pairs: dict[str, Pair] = field(default_factory=dict)
    ground: str = ""
    gravity: Array | None = None
    drives: dict[str, float] = field(default_factory=dict)
    plane: bool = False
    source: str = ""
    findings: list[Finding] = field(default_factory=list)
    lost: dict[str, list[str]] = field(default_factory=dict)

    def lose(self, what: str, *names: str) -> None:
        """Leave something out: `checked` says in one finding all that is."""
        self.lost.setdefault(what, []).extend(names)

    def warn(self, code: str, where: str, what: str, remedy: str = "", **figures: Any) -> None:
        """Note a doubt; code: of the list in the manual, `exchange.…`."""
        self.findings.append(Finding.weighed(Severity.WARNING, code, where, what, remedy, **figures))

    def note(self, code: str, where: str, what: str, remedy: str = "", **figures: Any) -> None:
        """Note something that is lost or assumed."""
        self.findings.append(Finding.weighed(Severity.NOTE, code, where, what, remedy, **figures))

    def assumed_unit(self, options: ImportOptions) -> float:
        """The length unit of a file that states none, m; a doubt unless the user states it."""
        if not options.unit_stated:
            what = f"states no unit of length: {1e3 * options.unit:.6g} mm is taken for 1"
            self.warn("exchange.unit", "file", what, "state it with --unit")
        return options.unit

    def pairs_of(self, body: str) -> list[Pair]:
        """The pairs that a body takes part in."""
        return [pair for pair in self.pairs.values() if body in pair.links]

    def mobility(self, planar: bool = False) -> int:
        """Mobility by Grübler's formula, of a mechanism in space or in a plane."""
        moving, most = len(self.bodies) - 1, 3 if planar else 6
        return most * moving - sum(most - (1 if planar else PAIRS[pair.type].count) for pair in self.pairs.values())

    def welded(self) -> Draft:
        """The same with bodies that fixed pairs join made one; the ground, else the first, gives its name."""
        leader = self.leaders()
        bodies: dict[str, Body] = {}
        for name, body in self.bodies.items():
            lead = leader[name]
            bodies[lead] = united(bodies[lead], body, lead) if lead in bodies else replace(body, name=lead)
        pairs = {
            name: replace(pair, links=(leader[pair.links[0]], leader[pair.links[1]]))
            for name, pair in self.pairs.items()
            if leader[pair.links[0]] != leader[pair.links[1]]
        }
        drives = {name: rate for name, rate in self.drives.items() if name in pairs}
        return replace(self, bodies=bodies, pairs=pairs, drives=drives)

    def leaders(self) -> dict[str, str]:
        """Of each body the one that stands for all that fixed pairs join it to: the ground, else the first of them."""
        groups = components(self.bodies, [pair.links for pair in self.pairs.values() if pair.type == "fixed"])
        order = (self.ground, *self.bodies)
        return {name: next(lead for lead in order if lead in group) for group in groups for name in group}

    def plane_normal(self) -> Array | None:
        """The normal of the plane that all bodies move in parallel to; None if there is none.

        Axes of turning pairs are parallel to it, slides of prismatic pairs normal to it. Balls are pins of the plane
        where the mechanism could not move otherwise, as in a loop that a format closes by a point.
        """
        if self.plane:
            return np.array([0.0, 0.0, 1.0])
        axes = {name: pair.axis / np.linalg.norm(pair.axis) for name, pair in self.pairs.items()}
        turning = [
            axes[pair.name] for pair in self.pairs.values() if pair.type in ("revolute", "cylindrical", "planar")
        ]
        sliding = [axes[pair.name] for pair in self.pairs.values() if pair.type == "prismatic"]
        types = {pair.type for pair in self.pairs.values()}
        if types & {"universal", "helical"} or ("spherical" in types and self.mobility() > 0):
            return None
        normals = turning or [np.cross(sliding[0], sliding[1])] if turning or len(sliding) > 1 else []
        if not normals or np.linalg.norm(normals[0]) < PARALLEL:
            return None
        normal = normals[0] / np.linalg.norm(normals[0])
        if any(np.linalg.norm(np.cross(axis, normal)) > PARALLEL for axis in turning):
            return None
        if any(abs(axis @ normal) > PARALLEL for axis in sliding):
            return None
        return np.asarray(normal * np.sign(normal[int(np.argmax(abs(normal)))]), dtype=float)

    def checked(self) -> Draft:
        """The same, with a finding of all that is left out; MechanismError if a body or pair is none of a mechanism."""
        faults = []
        if self.lost:
            named = {what: ", ".join(names[:10]) + " …" * (len(names) > 10) for what, names in self.lost.items()}
            all_lost = "; ".join(f"{what} ({names})" if names else what for what, names in named.items())
            self.note("exchange.lost", "", f"is read without {all_lost}", "add to the model what moves or loads it")
        for name, pair in self.pairs.items():
            numbers = np.concatenate([pair.at, pair.axis])
            if not np.abs(pair.at).max() < FARTHEST:
                faults.append((f"joints.{name}", f"lies {np.abs(pair.at).max():.3g} m away"))
            if not np.isfinite(numbers).all() or not np.linalg.norm(pair.axis) > 0:
                faults.append((f"joints.{name}", "has no place or no axis"))
            strange = [link for link in pair.links if link not in self.bodies]
            faults += [(f"joints.{name}", f"joins {link!r}, which it does not have") for link in strange]
        for name, body in self.bodies.items():
            if not (np.isfinite(body.mass) and np.isfinite(body.centre).all() and np.isfinite(body.inertia).all()):
                faults.append((f"links.{name}", "has a mass, centre or inertia that is no number"))
            if body.mass < 0:
                faults.append((f"links.{name}", f"has the mass {body.mass:g} kg"))
        if faults:
            raise MechanismError([Finding(what, where, "mend the file", file=self.source) for where, what in faults])
        return self


def components(names: Iterable[str], links: Iterable[tuple[str, str]]) -> list[set[str]]:
    """The groups of names that links join, in the order of their first names."""
    groups = {name: {name} for name in names}
    for left, other in links:
        if groups[left] is not groups[other]:
            both = groups[left] | groups[other]
            groups.update(dict.fromkeys(both, both))
    return list({id(group): group for group in groups.values()}.values())


def united(first: Body, other: Body, name: str) -> Body:
    """Two bodies as one."""
    mass = first.mass + other.mass
    centre = (first.mass * first.centre + other.mass * other.centre) / mass if mass else first.centre
    inertia = sum(body.inertia + body.mass * steiner(body.centre - centre) for body in (first, other))
    comments = [*first.comments, *other.comments]
    return Body(name, mass, centre, np.asarray(inertia), first.points | other.points, comments)


def steiner(offset: Array) -> Array:
    """d² 1 − d dᵀ: what the parallel axes theorem adds to an inertia for each kg, m² (3, 3)."""
    return np.asarray(offset @ offset * np.eye(3) - np.outer(offset, offset))


def moved(draft: Draft, rotation: Array, shift: Array) -> Draft:
    """The whole draft turned by a rotation matrix about the origin, then shifted."""

    def body(old: Body) -> Body:
        points = {name: rotation @ place + shift for name, place in old.points.items()}
        inertia = rotation @ old.inertia @ rotation.T
        return replace(old, centre=rotation @ old.centre + shift, inertia=inertia, points=points)

    def pair(old: Pair) -> Pair:
        second = None if old.second_axis is None else rotation @ old.second_axis
        elements = {link: (rotation @ at + shift, rotation @ axis) for link, (at, axis) in old.elements.items()}
        at, axis = rotation @ old.at + shift, rotation @ old.axis
        return replace(old, at=at, axis=axis, second_axis=second, elements=elements)

    bodies = {name: body(old) for name, old in draft.bodies.items()}
    pairs = {name: pair(old) for name, old in draft.pairs.items()}
    gravity = None if draft.gravity is None else rotation @ draft.gravity
    return replace(draft, bodies=bodies, pairs=pairs, gravity=gravity)


def perpendicular(axis: Array) -> Array:
    """A unit vector at a right angle to an axis, towards the global axis that lies furthest from it."""
    unit = axis / np.linalg.norm(axis)
    base = np.eye(3)[int(np.argmin(abs(unit)))]
    across = base - (base @ unit) * unit
    return np.asarray(across / np.linalg.norm(across), dtype=float)


def printable(text: str) -> str:
    """Text on one line that any terminal and file takes."""
    return "".join(sign if sign.isprintable() else " " for sign in text)[:300]


def free_name(text: str, used: Iterable[str], default: str = "part") -> str:
    """A name that a model file accepts and that is not taken yet: short, printable, without a dot."""
    name = "".join(sign for sign in text.replace(".", "-") if sign.isprintable()).strip().lstrip("=+-@ ")[:40].strip()
    name, used = name or default, set(used)
    numbered = (f"{name}-{number}" for number in count(2))
    return name if name not in used else next(other for other in numbered if other not in used)


# ---- a mechanism at positions of its cycle ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Positions:
    """A mechanism with its solved positions.

    Parameters
    ----------
    mechanism, result : the model, and the Dataset of `analyse`.
    rotations : of every link, from its frame to the global one, (position, 3, 3) by name; NaN where unsolved.
    origins : of every link's frame, m, (position, 3) by name.
    """

    mechanism: Mechanism
    result: xr.Dataset
    rotations: dict[str, Array]
    origins: dict[str, Array]

    def draft(self, row: int = 0) -> Draft:
        """The bodies and pairs at a position.

        Raises MechanismError if it has no solution there.
        """
        if not all(np.isfinite(origin[row]).all() for origin in self.origins.values()):
            what = f"has no solution at {self.drive(row)}"
            raise MechanismError(Finding(what, "--at", "choose another position; `trunnion analyse` says why"))
        mechanism, values = self.mechanism, self.mechanism.parameters()
        system = build(mechanism)
        draft = Draft(mechanism.name, ground=mechanism.fixed_link, plane=not system.spatial)
        if mechanism.gravity is not None:
            axes = "xyz"[: mechanism.coordinates]
            draft.gravity = np.zeros(3)
            draft.gravity[: len(axes)] = [_float(values[f"gravity.{axis}"]) for axis in axes]
        for link, entry in mechanism.effective_links.items():
            rotation, origin = self.rotations[link][row], self.origins[link][row]
            centre, inertia = _mass_properties(system, values, link)
            body = Body(link, _float(values[f"links.{link}.mass"]), origin + rotation @ centre)
            body.inertia = rotation @ inertia @ rotation.T
            for name in entry.points:
                if name not in mechanism.effective_joints:
                    local = _in_space(system.vector(values, f"links.{link}.points.{name}"))
                    body.points[name] = origin + rotation @ local
            draft.bodies[link] = body
        elements = system.elements(values)
        for name, joint in mechanism.effective_joints.items():
            ends = [self._placed(elements[link, name], link, row) for link in joint.links]
            draft.pairs[name] = _pair(name, joint.type, (joint.links[0], joint.links[1]), ends, values, system.spatial)
        time = np.array([self.result["time"].values[row]])
        for name, driver in mechanism.drivers.items():
            pair = draft.pairs[name]
            motion = "rotation" if PAIRS[pair.type].turns else "slide"
            if driver.moves:
                rates = self.result[f"joint_{motion}_velocity"].sel(joint=name).values
                draft.drives[name] = float(rates[row])
                continue
            draft.drives[name] = _float(system.drive(values, name, time)[1])
            if motion == "slide":
                places = primal(system.drive(values, name, system.cycle(values).times(CYCLE))[0])
                here = _float(system.drive(values, name, time)[0])
                pair.limits = float(np.min(places)) - here, float(np.max(places)) - here
        if mechanism.gears:
            what = f"gears, racks and screws are not written: {', '.join(mechanism.gears)}"
            draft.warn("exchange.gears", "gears", what, "join their turns in the other program")
        return draft

    def drive(self, row: int) -> str:
        """Where the driver is at a position, in words."""
        value, unit = float(self.result["drive"].values[row]), str(self.result["drive"].attrs.get("units", "rad"))
        return f"{math.degrees(value):.6g}°" if unit == "rad" else f"{value:.6g} {unit}"

    def _placed(self, element: Any, link: str, row: int) -> tuple[Array, Array, Array]:
        """Place, axis and x of a joint's element in the global frame."""
        rotation, origin = self.rotations[link][row], self.origins[link][row]
        if hasattr(element, "place"):
            place, axis, across = (_in_space(part) for part in (element.place, element.z, element.x))
        else:
            place, axis, across = _in_space((element.x, element.y)), np.array([0.0, 0.0, 1.0]), _in_space(element[2:])
        return origin + rotation @ place, rotation @ axis, rotation @ across


def _pair(name: str, kind: str, links: tuple[str, str], ends: Sequence[Any], values: Any, spatial: bool) -> Pair:
    """The pair of a joint whose two elements lie so: its point is that on the second link."""
    along = 2 if kind == "prismatic" and not spatial else 1
    first, second = ends
    pair = Pair(name, kind, links, second[0], first[along], second[1] if kind == "universal" else None)
    if not PAIRS[kind].guided:  # a slide's element on its guide is a point of the rail, wherever the slider is
        pair.elements = {link: (end[0], end[along]) for link, end in zip(links, ends, strict=True)}
    paths = {key: f"joints.{name}.{key}" for key in ("pin.radius", "pin.clearance", "pitch", *LENGTHS)}
    numbers = {key: _float(values[path]) for key, path in paths.items() if values.get(path) is not None}
    pair.pin_radius, pair.pitch = numbers.get("pin.radius"), numbers.get("pitch")
    if {"pin.radius", "pin.clearance"} <= numbers.keys():
        pair.hole_radius = numbers["pin.radius"] + numbers["pin.clearance"]
    pair.length = next((numbers[key] for key in LENGTHS if numbers.get(key)), None)
    return pair


def _mass_properties(system: System, values: Any, link: str) -> tuple[Array, Array]:
    """Mass centre, and inertia about it, in the link's frame.

    A body that moves in a plane feels J_zz alone; J_xx = J_yy = J_zz / 2 are those of a thin plate.
    """
    centre = _in_space(system.centre(values, link))
    link_entry, path = system.mechanism.effective_links[link], f"links.{link}.inertia"
    mass = _float(values[f"links.{link}.mass"])
    if isinstance(link_entry.inertia, InertiaTensor):
        xx, yy, zz, xy, xz, yz = (_float(values[f"{path}.{key}"]) for key in ("xx", "yy", "zz", "xy", "xz", "yz"))
        inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        if link_entry.inertia_about == "origin":
            inertia = inertia - mass * steiner(centre)
        return centre, inertia
    zz = _float(values.get(path, 0.0))
    if link_entry.inertia_about == "origin":
        zz -= mass * float(centre @ centre)
    return centre, np.diag([zz / 2, zz / 2, zz])


def positions_of(
    mechanism: Mechanism, steps: int = 360, at: float | str | None = None, magnify: float = 1.0
) -> Positions:
    """The mechanism at positions of its cycle, or at one.

    Parameters
    ----------
    mechanism : of any kind, errors of its joints included.
    steps : number of positions; at : one position instead, as for `analyse`.
    magnify : factor of the displacements and rotations of the links from the ideal mechanism.

    Raises
    ------
    MechanismError : if its structure does not determine the motion, or there is nothing to magnify.
    """
    from trunnion.cycle.analyse import analyse

    spatial = mechanism.space == "spatial"
    variables = ["point_position", "joint_rotation_velocity", "joint_slide_velocity"]
    variables += ["link_position", "link_rotation"] if spatial else ["link_angle"]
    if magnify != 1:
        if not mechanism.has_errors:
            what = "has nothing to magnify: no errors, and no pin that lies off the middle of its hole"
            raise MechanismError(Finding(what, "--magnify", "leave it out, or state `errors` or seats"))
        variables += ["point_error", "link_error"]
    result = analyse(mechanism, steps, variables=variables, at=at)
    values, rotations, origins = mechanism.parameters(), dict[str, Array](), dict[str, Array]()
    for link in result["link"].values.astype(str):
        points = [str(point) for point in result["point"].values if str(point).startswith(f"{link}.")]
        if spatial:
            matrix = np.moveaxis(rotation_matrix(result["link_rotation"].sel(link=link).values), 2, 0)
            origin = result["link_position"].sel(link=link).values.T
        else:
            angle, name = result["link_angle"].sel(link=link).values, next(iter(mechanism.links[link].points))
            matrix = np.repeat(np.eye(3)[None], len(angle), axis=0)
            matrix[:, 0, 0] = matrix[:, 1, 1] = np.cos(angle)
            matrix[:, 1, 0], matrix[:, 0, 1] = np.sin(angle), -np.sin(angle)
            local = _in_space([values[f"links.{link}.points.{name}.{axis}"] for axis in "xy"])
            origin = _places(result["point_position"], f"{link}.{name}") - matrix @ local
        if magnify != 1 and points:
            error = np.atleast_2d(result["link_error"].sel(link=link).values)  # a rotation vector, about z in a plane
            turn = (magnify - 1) * np.pad(error, ((3 - len(error), 0), (0, 0))).T
            shift = (magnify - 1) * _places(result["point_error"], points[0])
            place = _places(result["point_position"], points[0])
            fixed = np.einsum("nji,nj->ni", matrix, place - origin)
            matrix = Rotation.from_rotvec(turn).as_matrix() @ matrix
            origin = place + shift - np.einsum("nij,nj->ni", matrix, fixed)
        rotations[link], origins[link] = matrix, origin
    return Positions(mechanism, result, rotations, origins)


def _places(values: xr.DataArray, point: str) -> Array:
    """A vector of a point in space, (position, 3)."""
    vectors = values.sel(point=point).values.T
    return np.pad(vectors, ((0, 0), (0, 3 - vectors.shape[1])))


def _in_space(vector: Sequence[Any]) -> Array:
    """A vector of two or three numbers as one of three floats."""
    numbers = [_float(part) for part in vector]
    return np.array(numbers + [0.0] * (3 - len(numbers)))


def _float(number: Any) -> float:
    """The value of a number, its derivatives dropped."""
    return float(np.ravel(primal(number))[0])
