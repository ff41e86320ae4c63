"""A mechanism as a DXF drawing: links on layers of their own, curves of points, force polygons to scale.

Layers whose names begin with AUXILIARY hold what is no link; `exchange.dxf` does not read them.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from ezdxf.enums import InsertUnits
from ezdxf.filemanagement import new
from ezdxf.math import Vec3

from trunnion.errors import Finding
from trunnion.exchange.draft import Array, Draft, Pair
from trunnion.exchange.polygons import Polygon, polygons_of
from trunnion.exchange.skeleton import Positions, positions_of

if TYPE_CHECKING:
    from ezdxf.document import Drawing
    from ezdxf.layouts.layout import Modelspace

__all__ = ["AUXILIARY", "write"]

AUXILIARY = "~"
FORBIDDEN = str.maketrans(dict.fromkeys('<>/\\":;?*|=`,', "_"))
MM = 1e3  # of a metre
CURVE = 360  # positions of the curve of a point
RAIL, STUB = 2.87, 0.1  # length of a rail, of its slider; half of a guide of unknown length, of the drawing
LETTER = 0.02  # height, of the drawing
ROUND = (1.0, 2.0, 5.0, 10.0)  # a scale is one of these times a power of ten
SAME = 1e-9  # of the drawing: places that are one
CLOSED = 1e-9  # of the perimeter
GREY, BLUE = 8, 5  # colours of DXF


def _add_layer(document: Any, name: str, color: int) -> None:
    """Add a layer; every drawing has 0 and Defpoints already."""
    (document.layers.get(name) if name in document.layers else document.layers.add(name)).color = color


def write(positions: Positions, path: Path) -> list[Finding]:
    """Draw the links at a position, the curves of named points and, in a plane, the force polygons; in mm."""
    draft = positions.draft()
    document = new("R2010", units=InsertUnits.Millimeters)
    _arrow_block(document)
    space = document.modelspace()
    layers = _layers(draft)
    for number, layer in enumerate(layers.values()):
        _add_layer(document, layer, GREY if number == 0 else 1 + (number - 1) % 6)
    corners = np.array([place for pair in draft.pairs.values() for place in [pair.at]] or [np.zeros(3)])
    size = float(np.ptp(corners, axis=0).max()) or 1.0
    _links(space, draft, layers, size)
    curves = _curves(space, positions, layers, size)
    draft.note("exchange.lost", "file", "a DXF holds no masses, friction, loads or drivers", "keep the model file")
    if draft.plane:
        right = float(max(corners[:, 0].max(), *(curve[:, 0].max() for curve in curves), -math.inf))
        _polygons(space, positions, draft, np.array([right + 0.5 * size, corners[:, 1].min()]), size)
    else:
        draft.note("exchange.spatial", "file", "lines are drawn in space; only planar mechanisms have force polygons")
    document.saveas(path)
    return draft.findings


def _layers(draft: Draft) -> dict[str, str]:
    """A layer for each link, ground first; DXF knows no case and fewer signs than a model file."""
    layers: dict[str, str] = {}
    used: set[str] = set()
    for link in sorted(draft.bodies, key=lambda name: name != draft.ground):
        layer = base = link.translate(FORBIDDEN).lstrip(f"{AUXILIARY} ").strip() or "link"
        number = 1
        while layer.casefold() in used:
            number += 1
            layer = f"{base}-{number}"
        used.add(layer.casefold())
        layers[link] = layer
        if layer != link:
            draft.note("exchange.name", f"links.{link}", f"lies on the layer {layer!r}, for DXF allows no other name")
    return layers


def _links(space: Modelspace, draft: Draft, layers: dict[str, str], size: float) -> None:
    """Each link as lines between its joints, with its pins, holes, guides and points."""
    for link, layer in layers.items():
        here = {"layer": layer}
        pairs = draft.pairs_of(link)
        ends = [_ends(pair, link, draft.plane, size) for pair in pairs]
        for first, last in zip(ends, ends[1:] + (ends[:1] if len(ends) > 2 else []), strict=False):
            touching = [np.linalg.norm(a - _nearest(a, last)) for a in first]
            touching += [np.linalg.norm(b - _nearest(b, first)) for b in last]
            if min(touching) > SAME * size:
                start, end = min(
                    ((a, b) for a in first for b in last), key=lambda both: np.linalg.norm(both[1] - both[0])
                )
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
                shared = len(places) > 1 and any(
                    np.linalg.norm(pair.at - q.at) < SAME * size for q in pairs if q is not pair
                )
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
    cycle = positions_of(positions.mechanism, CURVE)
    result, curves = cycle.result, []
    closed = bool(result.attrs.get("periodic", 0))
    joints: set[str] = set()
    for point in result["point"].values.astype(str):
        link, _, name = point.partition(".")
        if link == positions.mechanism.fixed_link or name in joints:
            continue
        joints |= {name} & positions.mechanism.effective_joints.keys()
        places = np.zeros((len(cycle), 3))
        track = result["point_position"].sel(point=point).values.T
        places[:, : track.shape[1]] = track
        solved = np.isfinite(places).all(axis=1)
        if solved.sum() > 1 and np.ptp(places[solved], axis=0).max() > SAME * size:
            run = places[solved]
            layer = f"{AUXILIARY}curve {layers[link]} {name.translate(FORBIDDEN)}"
            ends = closed and bool(solved.all())
            space.add_polyline3d(MM * run, close=ends, dxfattribs={"layer": layer, "color": GREY})
            curves.append(run)
    return curves


def _polygons(space: Modelspace, positions: Positions, draft: Draft, corner: Array, size: float) -> None:
    """The polygons in rows from a corner upwards, each group with its links, approximations in grey below them."""
    drawn = polygons_of(positions)
    if not drawn or not any(len(polygon.forces) for polygon in drawn[0]):
        draft.note("exchange.forces", "file", f"there are no forces to draw at {positions.drive(0)}")
        return
    settled = [polygon for polygon in drawn[0] if len(polygon.forces)]
    largest = max(float(np.ptp(polygon.corners, axis=0).max()) for polygon in settled)
    scale = _rounded(0.5 * size / largest)  # m for each N
    for polygon in settled:
        if not polygon.gap <= CLOSED:
            what = f"the polygon of {polygon.name} does not close, by {polygon.gap:.2g} of its perimeter"
            draft.warn("exchange.polygon", "file", what, "`trunnion analyse` says how well it is solved")
        layer = f"{AUXILIARY}forces {polygon.name}".translate(FORBIDDEN)
        _add_layer(space.doc, layer, BLUE)
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


def _arrow_block(document: Drawing) -> None:
    """The head of an arrow of length 1 that points along x and ends at the origin."""
    block = document.blocks.new("arrow")
    block.add_solid([(0, 0), (-1, 0.25), (-1, -0.25)])


def _rounded(scale: float) -> float:
    """The largest round number that is at most this."""
    power = 10.0 ** math.floor(math.log10(scale))
    return power * max(step for step in ROUND if step * power <= scale * (1 + 1e-12))


def _mm(place: Array) -> Vec3:
    """A place in mm, as ezdxf takes it."""
    return Vec3(*(float(MM * part) for part in place))
