"""A mechanism as a DXF drawing: links on layers of their own, curves of points, force polygons to scale.

Layers whose names begin with AUXILIARY hold what is no link; `exchange.dxf` does not read them. A force polygon has
every force on a link or Assur group head to tail, as on a drawing board: those of d'Alembert, weight and inertia force,
loads, springs and teeth, and in each joint the reaction, the friction along a guide and the force of a driver.
[D 2, 3, 6, 7; Fig. 4 step 5]
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from ezdxf.enums import InsertUnits
from ezdxf.filemanagement import new
from ezdxf.math import Vec3

from trunnion.algebra.dual import primal
from trunnion.errors import Finding
from trunnion.exchange.draft import Array, Draft, Pair, Positions, positions_of
from trunnion.solve.backward import Backward, gear_load
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import springs, stated_loads
from trunnion.solve.run import prepare
from trunnion.solve.seating import seating_of

if TYPE_CHECKING:
    from ezdxf.layouts.layout import Modelspace

AUXILIARY = "~"
FORBIDDEN = str.maketrans(dict.fromkeys('<>/\\":;?*|=`,', "_"))
MM = 1e3  # of a metre
CURVE = 360  # positions of the curve of a point
RAIL, STUB = 2.87, 0.1  # length of a rail, of its slider; half of a guide of unknown length, of the drawing
LETTER = 0.02  # height, of the drawing
ROUND = (1.0, 2.0, 5.0, 10.0)  # a scale is one of these times a power of ten
SAME = 1e-9  # of the drawing: places that are one
CLOSED = 1e-9  # of the perimeter
ROUNDS = 3  # of successive approximation, as in the graphical validation of [D]
FELT = 1e-12  # of the largest force: a smaller one is rounding, not a side of a polygon
GREY, BLUE = 8, 5  # colours of DXF


@dataclass(frozen=True)
class Polygon:
    """Forces that are in equilibrium.

    Parameters
    ----------
    name : the link, or the group as `Plan` labels it.
    labels : what each force is, as "reaction B on coupler".
    forces : N, (force, 2), in the order in which they are drawn.
    """

    name: str
    labels: tuple[str, ...]
    forces: Array

    @property
    def corners(self) -> Array:
        """Where each side begins, and where the last one ends, N, (force + 1, 2)."""
        return np.vstack([np.zeros(2), np.cumsum(self.forces, axis=0)])

    @property
    def gap(self) -> float:
        """Distance between the end of the last force and the start of the first, of the perimeter."""
        perimeter = np.hypot(*self.forces.T).sum()
        return float(np.hypot(*self.forces.sum(axis=0)) / perimeter) if perimeter else 0.0


def write(positions: Positions, path: Path) -> list[Finding]:
    """Draw the links at a position, the curves of named points and, in a plane, the force polygons; in mm."""
    draft = positions.draft()
    document = new("R2010", units=InsertUnits.Millimeters)
    arrow = document.blocks.new("arrow")  # the head of an arrow of length 1 that points along x and ends at the origin
    arrow.add_solid([(0, 0), (-1, 0.25), (-1, -0.25)])
    space = document.modelspace()
    layers: dict[str, str] = {}  # of each link, ground first; DXF knows no case and fewer signs than a model file
    for number, link in enumerate(sorted(draft.bodies, key=lambda name: name != draft.ground)):
        base = link.translate(FORBIDDEN).lstrip(f"{AUXILIARY} ").strip() or "link"
        used = {layer.casefold() for layer in layers.values()}
        names = (base, *(f"{base}-{other}" for other in range(2, len(layers) + 3)))
        layers[link] = next(name for name in names if name.casefold() not in used)
        _layer(space, layers[link], GREY if number == 0 else 1 + (number - 1) % 6)
        if layers[link] != link:
            what = f"lies on the layer {layers[link]!r}, for DXF allows no other name"
            draft.note("exchange.name", f"links.{link}", what)
    corners = np.array([pair.at for pair in draft.pairs.values()] or [np.zeros(3)])
    size = float(np.ptp(corners, axis=0).max()) or 1.0
    for link, layer in layers.items():
        _link(space, draft, link, {"layer": layer}, size)
    curves = _curves(space, positions, layers, size)
    draft.note("exchange.lost", "file", "a DXF holds no masses, friction, loads or drivers", "keep the model file")
    if draft.plane:
        right = max(float(part[:, 0].max()) for part in (corners, *curves))
        _polygons(space, positions, draft, np.array([right + 0.5 * size, corners[:, 1].min()]), size)
    document.saveas(path)
    return draft.findings


def _layer(space: Modelspace, name: str, color: int) -> None:
    """Add a layer; every drawing has 0 and Defpoints already."""
    layers: Any = space.doc.layers
    (layers.get(name) if name in layers else layers.add(name)).color = color


def _link(space: Modelspace, draft: Draft, link: str, here: dict[str, Any], size: float) -> None:
    """A link as lines between its joints, with its pins, holes, guides and points."""
    pairs = draft.pairs_of(link)
    ends = [_ends(pair, link, draft.plane, size) for pair in pairs]
    for first, last in zip(ends, ends[1:] + (ends[:1] if len(ends) > 2 else []), strict=False):
        touching = [np.linalg.norm(a - _nearest(a, last)) for a in first]
        touching += [np.linalg.norm(b - _nearest(b, first)) for b in last]
        if min(touching) > SAME * size:
            lines = [(a, b) for a in first for b in last]
            start, end = min(lines, key=lambda both: np.linalg.norm(both[1] - both[0]))
            space.add_line(_mm(start), _mm(end), dxfattribs=here)
    for pair, places in zip(pairs, ends, strict=True):
        second = link == pair.links[1]
        radius = pair.hole_radius if second else pair.pin_radius
        if len(places) > 1:
            space.add_line(_mm(places[0]), _mm(places[1]), dxfattribs=here)
        elif draft.plane and radius:
            space.add_circle(_mm(pair.at), radius=MM * radius, dxfattribs=here)
        else:
            space.add_point(_mm(pair.at), dxfattribs=here)
        if second:  # of a slider on its pin the name lies below that of the pin
            others = [other for other in pairs if other is not pair and len(places) > 1]
            shared = any(np.linalg.norm(pair.at - other.at) < SAME * size for other in others)
            _text(space, pair.name, pair.at - [0.0, 1.5 * LETTER * size * shared, 0.0], size, here)
    for name, place in draft.bodies[link].points.items():
        space.add_point(_mm(place), dxfattribs=here)
        _text(space, name, place, size, here)


def _ends(pair: Pair, link: str, plane: bool, size: float) -> list[Array]:
    """Where the lines of a link may end at a joint: at a pin of the plane, at the ends of a rail, slider or axis.

    A rail is longer than the slider in it; if its length is not known, they are equal. The pin is on the first link.
    """
    second = link == pair.links[1]
    if pair.type == "prismatic":
        half = (pair.length or 2 * STUB * size) / 2 * (1.0 if second or not pair.length else RAIL)
    elif plane or pair.type == "spherical":
        return [pair.at]
    else:
        half = STUB * size / 2
    axis = pair.second_axis if second and pair.second_axis is not None else pair.axis
    along = half * axis / np.linalg.norm(axis)
    return [pair.at - along, pair.at + along]


def _nearest(place: Array, ends: list[Array]) -> Array:
    """The point nearest to a place on the line between two ends, or the only one."""
    span = ends[-1] - ends[0]
    share = np.clip((place - ends[0]) @ span / (span @ span), 0.0, 1.0) if len(ends) > 1 else 0.0
    return ends[0] + share * span


def _text(space: Modelspace, text: str, place: Array, size: float, here: dict[str, Any]) -> None:
    """A name at a place, so near to it that it cannot be that of another."""
    plain = text.replace("%%", "% %").replace("^", "^ ")
    space.add_text(plain, height=MM * LETTER * size, dxfattribs=here).set_placement(_mm(place))


def _curves(space: Modelspace, positions: Positions, layers: dict[str, str], size: float) -> list[Array]:
    """The curves of the named points and joints of moving links over the cycle, m, (position, 3)."""
    mechanism, curves, joints = positions.mechanism, list[Array](), set[str]()
    result = positions_of(mechanism, CURVE).result
    for point in result["point"].values.astype(str):
        link, _, name = point.partition(".")
        if link == mechanism.fixed_link or name in joints:
            continue
        joints |= {name} & mechanism.effective_joints.keys()
        track = result["point_position"].sel(point=point).values.T
        solved = np.isfinite(track).all(axis=1)
        run = np.pad(track[solved], ((0, 0), (0, 3 - track.shape[1])))
        if len(run) > 1 and np.ptp(run, axis=0).max() > SAME * size:
            layer = f"{AUXILIARY}curve {layers[link]} {name.translate(FORBIDDEN)}"
            ends = bool(result.attrs.get("periodic", 0)) and bool(solved.all())
            space.add_polyline3d(MM * run, close=ends, dxfattribs={"layer": layer, "color": GREY})
            curves.append(run)
    return curves


# ---- force polygons -----------------------------------------------------------------------------------------------


def _polygons(space: Modelspace, positions: Positions, draft: Draft, corner: Array, size: float) -> None:
    """The polygons in rows from a corner upwards, each group with its links, approximations in grey below them."""
    drawn = polygons_of(positions)
    if not drawn or not any(len(polygon.forces) for polygon in drawn[0]):
        draft.note("exchange.forces", "file", f"there are no forces to draw at {positions.drive(0)}")
        return
    settled = [polygon for polygon in drawn[0] if len(polygon.forces)]
    largest = max(float(np.ptp(polygon.corners, axis=0).max()) for polygon in settled)
    most = 0.5 * size / largest
    power = 10.0 ** math.floor(math.log10(most))
    scale = power * max(step for step in ROUND if step * power <= most * (1 + 1e-12))  # m for each N
    for polygon in settled:
        if not polygon.gap <= CLOSED:
            what = f"the polygon of {polygon.name} does not close, by {polygon.gap:.2g} of its perimeter"
            draft.warn("exchange.polygon", "file", what, "`trunnion analyse` says how well it is solved")
        layer = f"{AUXILIARY}forces {polygon.name}".translate(FORBIDDEN)
        _layer(space, layer, BLUE)
        rounds = [others for approximation in drawn[1:] for others in approximation if others.name == polygon.name]
        low = np.min([shape.corners.min(axis=0) for shape in [polygon, *rounds]], axis=0)
        high = np.max([shape.corners.max(axis=0) for shape in [polygon, *rounds]], axis=0)
        origin = corner - scale * low
        title = f"{polygon.name}: {1 / scale / MM:.6g} N/mm, drive at {positions.drive(0)}"
        _text(space, title, np.array([*(corner - [0.0, 2 * LETTER * size]), 0.0]), size, {"layer": layer})
        for number, shape in enumerate(rounds):
            _sides(space, shape, origin, scale, 0.0, {"layer": f"{layer} round {number}", "color": GREY})
        _sides(space, polygon, origin, scale, LETTER * size, {"layer": layer})
        corner = corner + np.array([0.0, scale * (high - low)[1] + 6 * LETTER * size])


def _sides(
    space: Modelspace, polygon: Polygon, origin: Array, scale: float, height: float, here: dict[str, Any]
) -> None:
    """The forces of a polygon as lines head to tail; with a height of letters also arrows and labels."""
    corners = origin + scale * polygon.corners
    for label, force, start, end in zip(polygon.labels, polygon.forces, corners, corners[1:], strict=False):
        space.add_line(_mm(start), _mm(end), dxfattribs=here)
        if height:
            attributes = {**here, "rotation": math.degrees(math.atan2(force[1], force[0]))}
            attributes |= {"xscale": MM * height, "yscale": MM * height}
            space.add_blockref("arrow", _mm(end), dxfattribs=attributes)
            third = np.array([*(2 * start + end) / 3, 0.0])  # where two long sides lie apart
            _text(space, f"{label}: {np.hypot(*force):.6g} N", third, height / (2 * LETTER), here)


@np.errstate(all="ignore")  # a position without forces has no polygon
def polygons_of(positions: Positions) -> list[list[Polygon]]:
    """The force polygons of all groups of a planar mechanism, and of their links, at the first of its positions.

    Parameters
    ----------
    positions : where the mechanism is.

    Returns
    -------
    list of list of Polygon : first those with friction and reactions settled, then, if there is friction, those of
        the rounds of successive approximation that lead there, without friction first; an unsolved position has none.
    """
    run = prepare(positions.mechanism)
    time = np.array([float(positions.result["time"].values[0])])
    if run.seats:  # pins that their loads seat have no approximations: seats and reactions settle together
        backs = [seating_of(run, FrictionMethod()).at(time).back]
    else:
        backs = [run.solve(time)]
        if any(contact.rubs for rubbed in backs[0].rubbed for contact, _ in rubbed):
            backs.append(run.solve(time, method=FrictionMethod(multiple=0.0)))
            for limit in range(1, ROUNDS + 1):
                method = FrictionMethod("successive-approximation", criterion=1e-3, limit=limit)
                backs.append(run.solve(time, method=method))
    drawn = [_groups(back) for back in backs]
    return drawn if all(np.isfinite(polygon.forces).all() for polygon in drawn[0]) else []


def _groups(back: Backward) -> list[Polygon]:
    """The polygon of every module, and of each of its links if it has several; forces that are zero have no side."""
    plan, applied, polygons = back.walk.system.plan, _applied(back), []
    for number, module in enumerate(plan.modules):
        groups = [module.links] if len(module.links) == 1 else [module.links, *((link,) for link in module.links)]
        for links in groups:
            forces: list[tuple[str, Any]] = []
            for k, link in enumerate(links):
                joints, loads = _in_joints(back, link, links), applied[link]
                forces += joints + loads if k < len(links) - 1 or k == 0 else loads + joints
            parts = [[float(np.ravel(primal(part))[0]) for part in force[:2]] for _, force in forces]
            numbers = np.array(parts).reshape(-1, 2)
            sizes = np.hypot(*numbers.T)
            felt = ~(sizes <= FELT * np.max(sizes, initial=0.0))
            labels = tuple(label for (label, _), keep in zip(forces, felt, strict=True) if keep)
            name = f"group {number + 1} {module.label}" if links is module.links else links[0]
            polygons.append(Polygon(name, labels, numbers[felt]))
    return polygons


def _applied(back: Backward) -> dict[str, list[tuple[str, Any]]]:
    """What acts on each moving link beside the joints: its name and the force."""
    walk, system = back.walk, back.walk.system
    forces: dict[str, list[tuple[str, Any]]] = defaultdict(list)
    gravity = system.vector(walk.values, "gravity")
    for link in system.mechanism.effective_links:
        if link != system.mechanism.fixed_link:
            mass = walk.values[f"links.{link}.mass"]
            acceleration = walk.at(link, system.centre(walk.values, link)).acceleration
            forces[link] += [
                (f"weight of {link}", [mass * part for part in gravity]),
                (f"inertia of {link}", [-mass * part for part in acceleration]),
            ]
    actions = [*stated_loads(walk, {}), *((name, action) for name, action, _ in springs(walk))]
    for name, action in actions:
        for link, wrench in action.on:
            forces[link].append((f"{name} on {link}", wrench))
    modules = zip(reversed(range(len(system.plan.modules))), back.settled, back.rubbed, strict=True)
    for number, settled, rubbed in modules:  # what the gear pairs do to the links
        places = system.places[number]
        along = {contact.joint: force for (contact, _), force in zip(rubbed, settled.forces, strict=True)}
        for i, name in enumerate(system.plan.modules[number].gears):
            effort, force = settled.reactions[len(places) + i][-1], along.get(len(places) + i, 0.0)
            for joint, side, wrench in gear_load(back.walk, number, i, effort, force)[1]:
                link = places[joint].links[side]
                forces[link].append((f"{name} on {link}", wrench))
    return forces


def _in_joints(back: Backward, link: str, group: Sequence[str]) -> list[tuple[str, Any]]:
    """What the joints of a link with links outside of its group do to it."""
    walk, system = back.walk, back.walk.system
    forces: list[tuple[str, Any]] = []
    for joint, entry in system.joints.items():
        links = entry.links
        other = links[1 - links.index(link)] if link in links else link
        if other in group:
            continue
        sign = 1.0 if link == links[1] else -1.0
        parts = [("reaction", back.reactions[joint]), ("friction", back.friction_wrenches[joint])]
        if joint in back.efforts and not system.turns(joint):
            drive = walk.algebra.times(back.efforts[joint], walk.freedom(joint, False)[1])
            parts.append(("drive", drive))
        forces += [(f"{what} {joint} on {link}", [sign * part for part in wrench[:2]]) for what, wrench in parts]
    return forces


def _mm(place: Array) -> Vec3:
    """A place in mm, as ezdxf takes it."""
    return Vec3(*(float(MM * part) for part in place))
