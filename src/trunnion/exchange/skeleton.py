"""The bodies and pairs of a mechanism at a position of its cycle, as writers of other formats take them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial.transform import Rotation

from trunnion.algebra.dual import primal
from trunnion.algebra.space import rotation_matrix
from trunnion.errors import Finding, MechanismError
from trunnion.exchange.draft import Array, Body, Draft, Pair
from trunnion.joints.pairs import PAIRS
from trunnion.model.parts import InertiaTensor
from trunnion.solve.system import System, build

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.model.mechanism import Mechanism

__all__ = ["Positions", "positions_of"]

LENGTHS = "pin.bearing", "pin.length", "guide.length"  # of a bearing: the first that is stated
CYCLE = 720  # positions at which the stroke of a driven slide is looked for


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
            draft.drives[name] = self.rate(name, row) if driver.moves else _float(system.drive(values, name, time)[1])
            pair = draft.pairs[name]
            if not PAIRS[pair.type].turns and not driver.moves:
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

    def rate(self, joint: str, row: int) -> float:
        """Rate of a joint's coordinate at a position, rad/s or m/s."""
        kind = self.mechanism.effective_joints[joint].type
        motion = "rotation" if PAIRS[kind].turns else "slide"
        return float(self.result[f"joint_{motion}_velocity"].sel(joint=joint).values[row])

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
            inertia = inertia - mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
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
