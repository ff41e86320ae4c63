"""A mechanism drawn in a DXF: layers are links, concentric circles joints, slots and lines on each other guides.

What is drawn is gathered as marks on layers, then read: nothing is a joint that does not lie in the same place on both
layers, and whatever could be read in two ways is a finding.
"""

from __future__ import annotations

import itertools
import logging
import math
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from logging.handlers import BufferingHandler
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from ezdxf import recover
from ezdxf.filemanagement import readfile
from ezdxf.lldxf.const import DXFError

from trunnion.errors import Finding, MechanismError
from trunnion.exchange.draft import Array, Body, Draft, Pair, free_name
from trunnion.exchange.drawing import AUXILIARY, write

if TYPE_CHECKING:
    from ezdxf.document import Drawing

    from trunnion.exchange.formats import ImportOptions

__all__ = ["read", "write"]

GROUNDS = ("ground", "frame", "base", "fixed")  # words in the name of a layer that does not move; else it is layer 0
SKIPPED = ("defpoints", AUXILIARY)  # how the names of layers begin that hold no link
MOST_OBJECTS, MOST_PARTS, MOST_MARKS = 40_000, 20_000, 2_000  # in a file, blocks taken apart, and in a skeleton
DEEPEST, FARTHEST = 12, 1e6  # blocks in blocks; m from the origin
TOUCH = 1e-5  # of the drawing: what lies nearer is in one place; rad, what differs less is parallel
UNITS = {1: 0.0254, 2: 0.3048, 4: 1e-3, 5: 1e-2, 6: 1.0, 9: 2.54e-5, 10: 0.9144, 13: 1e-6, 14: 0.1}  # m, by $INSUNITS
HALF = 1e-3  # rad, by which a half circle may differ from one
NEAR = 0.05  # of the drawing: within it a text names what it lies at
SPOILT = (DXFError, ArithmeticError, AssertionError, AttributeError, LookupError, TypeError, ValueError)


class Line(NamedTuple):
    """A line of a layer from one place to another, m."""

    layer: str
    start: Array
    end: Array

    @property
    def span(self) -> Array:
        """From start to end, m."""
        return self.end - self.start


class Slot(NamedTuple):
    """A slot of a layer: the centres of its ends, m, and half its width, m."""

    layer: str
    start: Array
    end: Array
    half: float


@dataclass
class Sketch:
    """What of a drawing may be part of a mechanism, m: circles and points (radius 0), lines, half circles, texts.

    left: how many entities of each kind are not read; heights: along z.
    """

    circles: list[tuple[str, Array, float]] = field(default_factory=list)
    lines: list[Line] = field(default_factory=list)
    halves: list[Slot] = field(default_factory=list)
    texts: list[tuple[str, Array, str]] = field(default_factory=list)
    left: Counter[str] = field(default_factory=Counter)
    heights: list[float] = field(default_factory=list)


def read(path: Path, options: ImportOptions) -> Draft:
    """The links and joints of a drawing.

    Parameters
    ----------
    path : the file, text or binary. options : `unit` of a drawing without $INSUNITS; `gap`, the greatest difference of
        the radii of a pin and its hole; `ground`, the layer that does not move.

    Returns
    -------
    Draft : in the plane, without masses.

    Raises
    ------
    MechanismError : if the file cannot be read or holds no mechanism.
    """
    draft = Draft(plane=True)
    try:
        document = _document(path, draft)
        sketch = _gathered(document, _unit(document, options, draft))
    except SPOILT as error:
        if isinstance(error, MechanismError):
            raise
        raise MechanismError(Finding("is no DXF, or too damaged to be read", file=str(path))) from None
    count = len(sketch.circles) + len(sketch.lines) + len(sketch.halves)
    places = np.array([place for _, place, _ in sketch.circles] + [end for line in sketch.lines for end in line[1:]])
    what = "" if len(places) else "holds no circle, point or line"
    if count > MOST_MARKS:
        what = f"holds {count:,} lines and circles; a skeleton has at most {MOST_MARKS:,}"
    elif not np.abs(places).max(initial=0.0) < FARTHEST:
        what = f"holds coordinates that are no numbers or beyond {FARTHEST:g} m"
    if what:
        what = f"is damaged, and {what}" if any(f.code == "exchange.damaged" for f in draft.findings) else what
        remedy = "draw each link on a layer of its own: its pins as circles, lines between them"
        raise MechanismError(Finding(what, file=str(path), remedy=remedy))
    if sketch.left:
        left = ", ".join(f"{count} {kind}" for kind, count in sketch.left.most_common(6))
        draft.note("left", "file", f"is not read: {left}", "joints are circles, points, lines and slots")
    size = max(float(np.ptp(places, axis=0).max()), 1e-6)
    if np.ptp(sketch.heights) > TOUCH * size:
        draft.warn("flat", "file", "is drawn in space; it is read as seen along z", "draw a plane mechanism at z = 0")
    _Reader(sketch, draft, options, size).read()
    draft.note("mass", "file", "a DXF holds no masses", "add mass, centre and inertia to the links")
    return draft


def _document(path: Path, draft: Draft) -> Drawing:
    """The drawing, mended if it is damaged; MechanismError if it holds too much."""
    objects = len(re.findall(rb"\n *0\r?\n[A-Z]|\x00[A-Z][A-Z0-9_]{2,}\x00", path.read_bytes()))
    if objects > MOST_OBJECTS:
        what = f"holds some {objects:,} objects; at most {MOST_OBJECTS:,} are read"
        raise MechanismError(Finding(what, file=str(path), remedy="export the skeleton alone"))
    heard, logger = BufferingHandler(MOST_OBJECTS), logging.getLogger("ezdxf")
    logger.addHandler(heard)
    try:
        return readfile(path)
    except SPOILT:
        document, _ = recover.readfile(path)
        mended = "; ".join(record.getMessage() for record in heard.buffer[:3])
        what = "is damaged; what could be mended is read" + (f": {mended}" if mended else "")
        draft.warn("damaged", "file", what, "compare it with the drawing")
        return document
    finally:
        logger.removeHandler(heard)


def _unit(document: Drawing, options: ImportOptions, draft: Draft) -> float:
    """The length unit of the drawing, m."""
    stated = UNITS.get(document.header.get("$INSUNITS", 0))
    if stated is not None:
        return stated
    draft.warn("unit", "file", f"states no unit; {1e3 * options.unit:g} mm is taken for 1", "state it with --unit")
    return options.unit


# ---- what is drawn ------------------------------------------------------------------------------------------------


def _gathered(document: Drawing, unit: float) -> Sketch:
    """The marks on the layers that are switched on."""
    sketch = Sketch()
    hidden = {entry.dxf.name.casefold() for entry in document.layers if entry.is_off() or entry.is_frozen()}
    names: dict[str, str] = {}
    for layer, entity in _entities(document.modelspace(), "", 0, [0]):
        key = layer.casefold()
        if key.startswith(SKIPPED):
            continue
        if key in hidden:
            sketch.left[f"entity on the hidden layer {layer}"] += 1
            continue
        _gather(sketch, names.setdefault(key, layer), entity, unit)
    return sketch


def _entities(entities: Iterable[Any], inserted: str, depth: int, count: list[int]) -> Iterator[tuple[str, Any]]:
    """Lines, arcs, circles, points and texts with their layers, blocks and polylines taken apart.

    inserted: the layer on which the block lies; it is that of what lies on layer 0 in the block.
    """
    for entity in entities:
        count[0] += 1
        if count[0] > MOST_PARTS or depth > DEEPEST:
            what = f"holds blocks of over {MOST_PARTS:,} parts, or {DEEPEST} deep"
            raise MechanismError(Finding(what, "file", "export the skeleton alone"))
        layer = entity.dxf.get("layer", "0")
        layer = inserted if inserted and layer == "0" else layer
        kind = entity.dxftype()
        if kind == "INSERT":
            for single in entity.multi_insert() if entity.mcount > 1 else (entity,):
                count[0] += 1
                yield from _entities(single.virtual_entities(), layer, depth + 1, count)
                yield from ((layer, attribute) for attribute in single.attribs)
        elif kind in ("LWPOLYLINE", "POLYLINE"):
            for part in entity.virtual_entities():
                count[0] += 1
                yield layer, part
        else:
            yield layer, entity


def _gather(sketch: Sketch, layer: str, entity: Any, unit: float) -> None:
    """Add an entity to a sketch, in m."""
    kind, dxf = entity.dxftype(), entity.dxf

    def place(point: Any) -> Array:
        sketch.heights.append(unit * point.z)
        return unit * np.array([point.x, point.y])

    if kind in ("CIRCLE", "ARC", "ELLIPSE") and abs(abs(dxf.extrusion.normalize().z) - 1) > TOUCH:
        kind = f"tilted {kind}"
    if kind == "LINE":
        sketch.lines.append(Line(layer, place(dxf.start), place(dxf.end)))
    elif kind == "CIRCLE":
        sketch.circles.append((layer, place(entity.ocs().to_wcs(dxf.center)), abs(unit * dxf.radius)))
    elif kind == "POINT":
        sketch.circles.append((layer, place(dxf.location), 0.0))
    elif kind == "ARC" and abs((dxf.end_angle - dxf.start_angle) % 360 - 180) < math.degrees(HALF):
        sketch.halves.append(Slot(layer, place(entity.start_point), place(entity.end_point), unit * dxf.radius))
    elif kind == "ELLIPSE" and abs(dxf.ratio - 1) < TOUCH and abs(dxf.end_param - dxf.start_param - math.tau) < HALF:
        sketch.circles.append((layer, place(dxf.center), unit * dxf.major_axis.magnitude))  # of a scaled block
    elif kind in ("TEXT", "ATTRIB"):
        sketch.texts.append((layer, place(entity.get_placement()[1]), entity.plain_text()))
    elif kind == "MTEXT":
        sketch.texts.append((layer, place(dxf.insert), entity.plain_text()))
    else:
        sketch.left[kind] += 1


# ---- what it means ------------------------------------------------------------------------------------------------


class _Places:
    """Places numbered as they come; those that touch are one."""

    def __init__(self, touch: float) -> None:
        self.touch = touch
        self.at: list[Array] = []
        self.cells: dict[tuple[int, int], list[int]] = {}

    def number(self, place: Array) -> int:
        """The number of a place, a new one if none is near."""
        column, row = (math.floor(part / self.touch) for part in place)
        for i, j in itertools.product((-1, 0, 1), repeat=2):
            for number in self.cells.get((column + i, row + j), ()):
                if np.hypot(*(self.at[number] - place)) <= self.touch:
                    return number
        self.cells.setdefault((column, row), []).append(len(self.at))
        self.at.append(place)
        return len(self.at) - 1


class _Reader:
    """Links and joints of a sketch, written into a draft.

    marks: at each place the radii of the circles of each layer, 0 of a point; none where only its lines end. joined:
    the places that are joints.
    """

    def __init__(self, sketch: Sketch, draft: Draft, options: ImportOptions, size: float) -> None:
        self.sketch, self.draft, self.gap, self.size = sketch, draft, options.gap, size
        self.places = _Places(TOUCH * size)
        self.marks: dict[int, dict[str, list[float]]] = {}
        self.joined: set[int] = set()
        layers: dict[str, None] = {}
        for mark in (*sketch.circles, *sketch.lines, *sketch.halves):
            layers.setdefault(str(mark[0]))
        draft.ground = self._ground(list(layers), options.ground)
        self.rank = {layer: number for number, layer in enumerate(sorted(layers, key=lambda n: n != draft.ground))}
        draft.bodies = {layer: Body(layer) for layer in self.rank}
        for layer, place, radius in sketch.circles:
            self.marks.setdefault(self.places.number(place), {}).setdefault(layer, []).append(radius)
        self.drawn = list(self.marks)
        self.slots, lines = self._slots()
        for line in lines:
            for end in (line.start, line.end):
                self.marks.setdefault(self.places.number(end), {}).setdefault(line.layer, [])

    def _ground(self, layers: list[str], stated: str) -> str:
        """The layer that does not move: that which is stated, or has such a name, or layer 0; empty if none."""
        named = [layer for layer in layers if any(word in layer.casefold() for word in GROUNDS)]
        named += [layer for layer in layers if layer == "0"]
        if stated or not named:
            return stated if stated in layers else ""
        if len(named) > 1:
            what = f"is taken as what does not move, and {', '.join(named[1:])} as links that may"
            self.draft.warn("ground", f"links.{named[0]}", what, "draw all of it on one layer, or state --ground")
        return named[0]

    def read(self) -> None:
        """Pins, guides and names, in this order."""
        single = []
        for number in self.drawn:
            if len(self.marks[number]) > 1:
                self._pin(number)
            else:
                single.append(number)
        guided = self._guides()
        for number, layers in self.marks.items():
            if number not in self.joined and len(layers) > 1 and not any(pair <= layers.keys() for pair in guided):
                self._pin(number)
        for number in single:
            layer, radii = next(iter(self.marks[number].items()))
            self._single(layer, self.places.at[number], min(radii))
            near = [k for k in self.drawn if k != number and self._apart(k, number) <= self.gap]
            others = sorted({other for k in near for other in self.marks[k]} - {layer})
            if others and max(radii) > 0:
                what = f"has a circle almost about the centre of one of {', '.join(others)}, which is no joint"
                self.draft.warn("near", f"links.{layer}", what, "draw both about one centre if they are a joint")
        self._names()

    def _apart(self, one: int, other: int) -> float:
        return float(np.hypot(*(self.places.at[one] - self.places.at[other])))

    def _add(self, kind: str, links: tuple[str, str], at: Array, comment: str, axis: Array | None = None) -> Pair:
        """A new pair that has no name yet, of two links of which the first bears the pin or rail; ground is first."""
        first, second = links[::-1] if links[1] == self.draft.ground else links
        pair = Pair(f"J{len(self.draft.pairs) + 1}", kind, (first, second), np.array([*at, 0.0]), comments=[comment])
        if axis is not None:  # as it would be drawn: to the right, or upwards
            pair.axis = np.array([*axis, 0.0]) / np.hypot(*axis) * np.sign(axis[int(np.argmax(np.abs(axis)))])
        self.draft.pairs[pair.name] = pair
        return pair

    def _pin(self, number: int) -> None:
        """The joints of a place where several layers lie: all turn on the link whose circle is smallest."""
        self.joined.add(number)
        digits = 1 - math.floor(math.log10(TOUCH * self.size))
        marks = {layer: sorted({round(radius, digits): radius for radius in radii if radius}.values())
                 for layer, radii in self.marks[number].items()}  # fmt: skip
        layers = sorted(marks, key=self.rank.__getitem__)
        hub = min(layers, key=lambda layer: (min(marks[layer], default=math.inf), -len(self.marks[number][layer])))
        if len(layers) > 2:
            what = f"is taken as the link that bears the pin of {', '.join(layers)}"
            self.draft.warn("shared-pin", f"links.{hub}", what, "mend the links of these joints if another does")
        for other in layers:
            if other == hub:
                continue
            pair = self._add("revolute", (hub, other), self.places.at[number], "")
            one, two = marks[hub], marks[other]
            near = [sorted(both) for both in itertools.product(one, two) if abs(both[0] - both[1]) <= self.gap]
            if len(near) == 1:
                pair.pin_radius, pair.hole_radius = near[0]
            elif not two and len(one) == 1:
                pair.pin_radius = one[0]
            elif one or two:
                radii = ", ".join(f"{_mm(radius)} mm" for radius in sorted({*one, *two}))
                what = f"has circles of {radii} radius, of which none are clearly its pin and hole"
                self.draft.warn("radius", f"joints.{pair.name}", what, "state its pin, or draw pin and hole alone")
            if not any(self.marks[number].values()):
                what = f"is read where lines of {hub} and {other} end; no circle or point marks it"
                self.draft.note("bare-end", f"joints.{pair.name}", what, "draw its pin as a circle")
            circles = [f"{_mm(radius)} mm" for radius in (pair.pin_radius, pair.hole_radius) if radius]
            pair.comments = [f"circles of radius {' and '.join(circles)}" if circles else f"{hub} and {other} meet"]

    def _guides(self) -> set[frozenset[str]]:
        """Prismatic pairs where lines of two layers lie on each other; the layers that they join.

        A line between two joints is the body of a link, which may lie on another by chance.
        """
        guided: dict[frozenset[str], list[tuple[Line, Line]]] = {}
        chance: dict[frozenset[str], list[tuple[Line, Line]]] = {}
        for both in _lying(self.sketch.lines, self.gap):
            layers = frozenset(line.layer for line in both)
            bodies = []
            for line in both:
                ends = [self.places.number(end) for end in (line.start, line.end)]
                bodies.append(all(k in self.joined or self.marks.get(k, {}).keys() - layers for k in ends))
            pinned = any(layers <= self.marks[k].keys() for k in self.joined)
            if pinned or all(bodies):
                continue
            (chance if any(bodies) else guided).setdefault(layers, []).append(both)
        for layers in chance.keys() - guided.keys():
            names = " and ".join(sorted(layers))
            what = f"lines of {names} lie on each other, but one ends at joints; no guide is read"
            self.draft.note("line", f"links.{min(layers)}", what, "let its lines end elsewhere if it is a guide")
        for layers, pairs in guided.items():
            lines = {layer: list({id(line): line for both in pairs for line in both if line.layer == layer}.values())
                     for layer in layers}  # fmt: skip
            self._guide({layer: [line for line in own if not self._bears(line)] or own for layer, own in lines.items()})
        return set(guided)

    def _guide(self, lines: dict[str, list[Line]]) -> None:
        """The prismatic pair of two layers with lines that lie on each other: the shorter ones are the slider's."""
        length = {layer: max(float(np.hypot(*line.span)) for line in lines[layer]) for layer in lines}
        slider, rail = sorted(lines, key=lambda layer: (length[layer], -self.rank[layer]))
        along = lines[slider][0].span / np.hypot(*lines[slider][0].span)
        ways = np.array([sorted(end @ along for end in (line.start, line.end)) for line in lines[slider]])
        same = all(abs(_cross(along, line.span)) <= 3 * TOUCH * np.hypot(*line.span) for line in lines[slider])
        if not same or np.ptp(ways, axis=0).max() > TOUCH * self.size:
            what = f"has lines of several {'lengths' if same else 'directions'} on those of {rail}; no guide is read"
            remedy = "draw the slider as lines of one length along its guide"
            self.draft.warn("line", f"links.{slider}", what, remedy)
            return
        middle = np.mean([(line.start + line.end) / 2 for line in lines[slider]], axis=0)
        pair = self._add("prismatic", (rail, slider), middle, f"lines of {slider} lie on lines of {rail}", along)
        equal = [line for line in lines[rail] if np.hypot(*line.span) - length[slider] <= TOUCH * self.size]
        pair.length = None if equal else length[slider]
        what = f"is taken as a guide, for lines of {slider} lie on lines of {rail}"
        self.draft.note("guide", f"joints.{pair.name}", what, "if it is none, draw the links at another position")

    def _bears(self, line: Line) -> bool:
        """Whether a line ends at a joint."""
        return any(self.places.number(end) in self.joined for end in (line.start, line.end))

    def _slots(self) -> tuple[list[Slot], list[Line]]:
        """What two half circles and two lines of a layer enclose, and the lines that are of no slot."""
        sides: dict[tuple[str, int], dict[int, int]] = {}  # at an end of a half circle: where a line leads, and which
        for i, line in enumerate(self.sketch.lines):
            start, end = self.places.number(line.start), self.places.number(line.end)
            sides.setdefault((line.layer, start), {})[end] = i
            sides.setdefault((line.layer, end), {})[start] = i
        numbers = [tuple(self.places.number(end) for end in half[1:3]) for half in self.sketch.halves]
        chords = {(half.layer, *chord): half for half, both in zip(self.sketch.halves, numbers, strict=True)
                  for chord in (both, both[::-1])}  # fmt: skip
        slots, used = [], set[int]()
        for half, (a, b) in zip(self.sketch.halves, numbers, strict=True):
            for c, d in itertools.product(sides.get((half.layer, a), ()), sides.get((half.layer, b), ())):
                other = chords.get((half.layer, c, d))
                lines = {sides[half.layer, a][c], sides[half.layer, b][d]}
                if other is not None and other is not half and not lines & used:
                    ends = [(part.start + part.end) / 2 for part in (half, other)]
                    slots.append(Slot(half.layer, ends[0], ends[1], (half.half + other.half) / 2))
                    used |= lines
        return slots, [line for i, line in enumerate(self.sketch.lines) if i not in used]

    def _single(self, layer: str, at: Array, radius: float) -> None:
        """A circle or point that no other layer meets: a pin in a slot of another layer, else a point of the link.

        Between pin and slot lies a block without mass, which turns on the one and slides in the other.
        """
        slots = [slot for slot in self.slots if slot.layer != layer and self._inside(at, radius, slot)]
        if len(slots) != 1:
            points = self.draft.bodies[layer].points
            points[free_name(f"P{len(points) + 1}", points)] = np.array([*at, 0.0])
            if slots:
                self.draft.warn("slot", f"links.{layer}", "has a pin in several slots; none is read", "draw one slot")
            return
        slot = slots[0]
        comment = (
            f"a pin of {layer} of radius {_mm(radius)} mm in a slot of {slot.layer} of half width {_mm(slot.half)} mm"
        )
        block = free_name(f"block in {slot.layer}", self.draft.bodies, "block")
        self.draft.bodies[block] = Body(block, comments=[f"{comment}: a block without mass lies between them"])
        self.rank[block] = len(self.rank)
        self._add("revolute", (layer, block), at, comment).pin_radius = radius or None
        guide = self._add("prismatic", (slot.layer, block), at, comment, slot.end - slot.start)
        ways = [float((end - at) @ guide.axis[:2]) for end in (slot.start, slot.end)]
        guide.limits = min(ways), max(ways)
        if radius and slot.half - radius > self.gap:
            what = f"has {_mm(slot.half - radius)} mm of play in the slot of {slot.layer}, which is taken as none"
            self.draft.warn("slot", f"joints.{guide.name}", what, "draw the pin as wide as the slot if it guides")

    def _inside(self, at: Array, radius: float, slot: Slot) -> bool:
        """Whether a pin lies on the middle line of a slot and fits into it."""
        span, small = slot.end - slot.start, 10 * TOUCH * self.size
        length = float(np.hypot(*span))
        way, aside = (at - slot.start) @ span / length, abs(_cross(span, at - slot.start)) / length
        return bool(-small <= way <= length + small and aside <= small and radius <= slot.half + small)

    def _names(self) -> None:
        """Texts name the joint or point nearest to them, those on a layer of its links first.

        A name on the layer of a link that moves makes it the second link of the joint.
        """
        pairs, bodies = self.draft.pairs, self.draft.bodies
        targets: list[tuple[str, str, tuple[str, ...], Array]] = []
        targets += [("", pair.name, pair.links, pair.at) for pair in pairs.values()]
        targets += [(layer, name, (layer,), at) for layer, body in bodies.items() for name, at in body.points.items()]
        choices = []
        for i, (layer, place, text) in enumerate(self.sketch.texts):
            for j, (_, _, links, at) in enumerate(targets):
                distance = float(np.hypot(*(at[:2] - place)))
                if distance <= NEAR * self.size and "\n" not in text.strip():
                    apart = 0.0 if layer == links[-1] else 0.5 if layer in links else 1.0
                    choices.append((distance + apart * NEAR * self.size, j, i))
        names: dict[tuple[str, str], str] = {}
        used: set[int] = set()
        for _, j, i in sorted(choices):
            body, old, links, _ = targets[j]
            if (body, old) not in names and i not in used:
                names[body, old] = free_name(self.sketch.texts[i][2], names.values())
                used.add(i)
                if not body and self.sketch.texts[i][0] == links[0] != self.draft.ground:
                    pairs[old].links = links[1], links[0]
        for name, pair in pairs.items():
            pair.name = names.get(("", name), name)
        self.draft.pairs = {pair.name: pair for pair in pairs.values()}
        for layer, link in bodies.items():
            link.points = {names.get((layer, name), name): at for name, at in link.points.items()}
        places = {f"joints.{old}": f"joints.{new}" for (layer, old), new in names.items() if not layer}
        findings = self.draft.findings
        self.draft.findings = [replace(finding, where=places.get(finding.where, finding.where)) for finding in findings]


def _lying(lines: list[Line], gap: float) -> Iterator[tuple[Line, Line]]:
    """Lines of different layers that are parallel, nearer to each other than the gap, and overlap."""
    lines = [line for line in lines if np.hypot(*line.span) > 0]
    starts, ends = (np.array([line[k] for line in lines]).reshape(-1, 2) for k in (1, 2))
    lengths = np.hypot(*(ends - starts).T)
    for i, line in enumerate(lines[:-1]):
        along = line.span / lengths[i]
        ways = np.stack([(places[i + 1 :] - line.start) @ along for places in (starts, ends)])
        aside = np.stack([_cross(along, places[i + 1 :] - line.start) for places in (starts, ends)])
        shorter = np.minimum(lengths[i + 1 :], lengths[i])
        overlap = np.minimum(ways.max(axis=0), lengths[i]) - np.maximum(ways.min(axis=0), 0.0)
        lies = (np.ptp(aside, axis=0) <= TOUCH * lengths[i + 1 :]) & (np.abs(aside).max(axis=0) <= gap)
        for j in np.flatnonzero(lies & (overlap > 0.01 * shorter)):
            if lines[i + 1 + j].layer != line.layer:
                yield line, lines[i + 1 + j]


def _cross(a: Array, b: Array) -> Any:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _mm(length: float) -> str:
    return f"{1e3 * length:.6g}"
