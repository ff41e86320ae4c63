"""A mechanism drawn in a DXF: layers are links, concentric circles joints, slots and lines on each other guides.

What is drawn is gathered as marks on layers, then read: nothing is a joint that does not lie in the same place on both
layers, and whatever could be read in two ways is a finding.
"""

from __future__ import annotations

import itertools
import math
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from ezdxf import recover

from trunnion.exchange.draft import Array, Body, Draft, ImportOptions, Pair, few, free_name, printable, refused
from trunnion.exchange.drawing import AUXILIARY

if TYPE_CHECKING:
    from ezdxf.document import Drawing

GROUNDS = ("ground", "frame", "base", "fixed")  # words in the name of a layer that does not move; else it is layer 0
CHAINED = ("CENTER", "DASHDOT", "DIVIDE", "MITTE", "ACAD_ISO04", "ACAD_ISO10")  # how linetypes of centre lines begin
CENTRES = ("center", "centre", "mittel", "axis")  # words in the names of layers of centre lines
SKIPPED = ("defpoints", AUXILIARY)  # how the names of layers begin that hold no link
MOST_OBJECTS, MOST_PARTS, MOST_MARKS = 40_000, 20_000, 2_000  # in a file, blocks taken apart, and in a skeleton
DEEPEST, FARTHEST = 12, 1e6  # blocks in blocks; m from the origin
TOUCH = 1e-5  # of the drawing: what lies nearer is in one place; rad, what differs less is parallel
UNITS = {1: 0.0254, 2: 0.3048, 4: 1e-3, 5: 1e-2, 6: 1.0, 9: 2.54e-5, 10: 0.9144, 13: 1e-6, 14: 0.1}  # m, by $INSUNITS
HALF = 1e-3  # rad, by which a half circle may differ from one
NEAR = 0.05  # of the drawing: within it a text names what it lies at
Text = tuple[str, Array, str]  # layer, place and words


@dataclass(frozen=True, eq=False)
class Line:
    """A line of a layer from one place to another, m."""

    layer: str
    start: Array
    end: Array

    @property
    def span(self) -> Array:
        """From start to end, m."""
        return self.end - self.start

    @property
    def length(self) -> float:
        """Of the line, m."""
        return float(np.hypot(*self.span))


@dataclass(frozen=True, eq=False)
class Slot(Line):
    """A slot of a layer between the centres of its ends, or a half circle between its ends; half its width, m."""

    half: float

    def holds(self, at: Array, radius: float, near: float) -> bool:
        """Whether a pin lies on the middle line and fits in."""
        off = at - self.start
        along, aside = off @ self.span / self.length, abs(_cross(self.span, off)) / self.length
        return bool(-near <= along <= self.length + near and aside <= near and radius <= self.half + near)

    def completes(self, other: Slot) -> bool:
        """Whether two half circles of a layer run between the same ends, the other way."""
        apart = np.linalg.norm([*(self.start - other.end), *(self.end - other.start), self.half - other.half])
        return self.layer == other.layer and float(apart) < HALF * other.half


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
    few(len(re.findall(rb"\n *0\r?\n[A-Z]|\x00[A-Z][A-Z0-9_]{2,}\x00", path.read_bytes())), MOST_OBJECTS, "objects")
    document, auditor = recover.readfile(path)
    if auditor.has_errors or auditor.has_fixes:
        mended = "; ".join(entry.message for entry in [*auditor.errors, *auditor.fixes][:3])
        what = printable(f"is damaged; what could be mended is read: {mended}")
        draft.warn("exchange.damaged", "file", what, "compare it with the drawing")
    sketch = Sketch(document, UNITS.get(document.header.get("$INSUNITS", 0)) or draft.assumed_unit(options))
    marks = (*sketch.circles, *sketch.lines, *sketch.halves, *sketch.texts)
    few(len(marks), MOST_MARKS, "lines, circles and texts")
    places = [place for _, place, _ in sketch.circles]
    places += [end for line in sketch.lines for end in (line.start, line.end)]
    if not places or not np.abs(places).max() < FARTHEST:
        what = f"holds no circle, point or line, or coordinates that are no numbers or beyond {FARTHEST:g} m"
        what = f"is damaged, and {what}" if any(f.code == "exchange.damaged" for f in draft.findings) else what
        raise refused(what, remedy="draw each link on a layer of its own: its pins as circles, lines between them")
    for kind, number in sketch.left.most_common(6):
        draft.lose(f"{number} {kind}")
    draft.lose("masses, which a DXF does not hold")
    size = max(float(np.ptp(places, axis=0).max()), 1e-6)
    if np.ptp(sketch.heights) > TOUCH * size:
        draft.warn("exchange.flat", "file", "is drawn in space; it is read as seen along z", "draw all at z = 0")
    _Reader(sketch, draft, options, size).read()
    return draft


# ---- what is drawn ------------------------------------------------------------------------------------------------


class Sketch:
    """What of a drawing may be part of a mechanism, m: circles and points (radius 0), lines, half circles, texts.

    left: how many entities of each kind are not read; heights: along z.
    """

    def __init__(self, document: Drawing, unit: float) -> None:
        self.unit, self.count = unit, 0
        self.circles: list[tuple[str, Array, float]] = []
        self.lines: list[Line] = []
        self.halves: list[Slot] = []
        self.texts: list[Text] = []
        self.left: Counter[str] = Counter()
        self.heights: list[float] = []
        hidden = {entry.dxf.name.casefold() for entry in document.layers if entry.is_off() or entry.is_frozen()}
        names: dict[str, str] = {}
        for layer, entity in self._entities(document.modelspace(), "", 0):
            key, linetype = layer.casefold(), entity.dxf.get("linetype", "BYLAYER").upper()
            if linetype == "BYLAYER":
                linetype = document.layers.get(layer).dxf.linetype.upper() if layer in document.layers else ""
            chained = linetype.startswith(CHAINED) or any(word in key for word in CENTRES)
            if key in hidden and not key.startswith(SKIPPED):
                self.left[f"entity on the hidden layer {layer}"] += 1
            elif chained and entity.dxftype() in ("LINE", "ARC") and not key.startswith(SKIPPED):
                self.left["centre line"] += 1
            elif not key.startswith(SKIPPED):
                if key not in names:
                    names[key] = free_name(layer, names.values())
                self._add(names[key], entity)
        halves, self.halves = self.halves, []
        for half in halves:  # two half arcs about one centre, which is how some programs draw a circle, are a circle
            other = next((other for other in self.halves if half.completes(other)), None)
            if other is None:
                self.halves.append(half)
            else:
                self.halves.remove(other)
                self.circles.append((half.layer, (half.start + half.end) / 2, half.half))

    def _entities(self, entities: Iterable[Any], inserted: str, depth: int) -> Iterator[tuple[str, Any]]:
        """Lines, arcs, circles, points and texts with their layers, blocks and polylines taken apart.

        inserted: the layer on which the block lies; it is that of what lies on layer 0 in the block.
        """
        for entity in entities:
            self.count += 1
            few(self.count, MOST_PARTS, "parts of blocks")
            few(depth, DEEPEST, "blocks in one another")
            layer = entity.dxf.get("layer", "0")
            layer = inserted if inserted and layer == "0" else layer
            kind = entity.dxftype()
            if kind == "INSERT":
                for single in entity.multi_insert() if entity.mcount > 1 else (entity,):
                    self.count += 1
                    yield from self._entities(single.virtual_entities(), layer, depth + 1)
                    yield from ((layer, attribute) for attribute in single.attribs)
            elif kind in ("LWPOLYLINE", "POLYLINE"):
                for part in entity.virtual_entities():
                    self.count += 1
                    yield layer, part
            else:
                yield layer, entity

    def _add(self, layer: str, entity: Any) -> None:
        """Add an entity, in m."""
        kind, dxf = entity.dxftype(), entity.dxf

        def place(point: Any) -> Array:
            self.heights.append(self.unit * point.z)
            return self.unit * np.array([point.x, point.y])

        if kind in ("CIRCLE", "ARC", "ELLIPSE") and abs(abs(dxf.extrusion.normalize().z) - 1) > TOUCH:
            kind = f"tilted {kind}"
        sweep = dxf.end_angle - dxf.start_angle if kind == "ARC" else 0.0
        if kind == "LINE":
            self.lines.append(Line(layer, place(dxf.start), place(dxf.end)))
        elif kind == "CIRCLE" or (kind == "ARC" and abs(sweep) >= 360 - math.degrees(HALF)):
            self.circles.append((layer, place(entity.ocs().to_wcs(dxf.center)), abs(self.unit * dxf.radius)))
        elif kind == "POINT":
            self.circles.append((layer, place(dxf.location), 0.0))
        elif kind == "ARC" and abs(sweep % 360 - 180) < math.degrees(HALF):
            self.halves.append(Slot(layer, place(entity.start_point), place(entity.end_point), self.unit * dxf.radius))
        elif (
            kind == "ELLIPSE" and abs(dxf.ratio - 1) < TOUCH and abs(dxf.end_param - dxf.start_param - math.tau) < HALF
        ):
            self.circles.append((layer, place(dxf.center), self.unit * dxf.major_axis.magnitude))  # of a scaled block
        elif kind in ("TEXT", "ATTRIB"):
            self.texts.append((layer, place(entity.get_placement()[1]), entity.plain_text()))
        elif kind == "MTEXT" and "\n" not in entity.plain_text().strip():
            self.texts.append((layer, place(dxf.insert), entity.plain_text()))
        else:
            self.left[kind] += 1


# ---- what it means ------------------------------------------------------------------------------------------------


class _Reader:
    """Links and joints of a sketch, written into a draft.

    places: where marks lie, m; what touches is in one place. marks: at each place the radii of the circles of each
    layer, 0 of a point; none where only its lines end. joined: the places that are joints.
    """

    def __init__(self, sketch: Sketch, draft: Draft, options: ImportOptions, size: float) -> None:
        self.sketch, self.draft, self.gap, self.size = sketch, draft, options.gap, size
        self.places = np.zeros((0, 2))
        self.joined: set[int] = set()
        self.marks: dict[int, dict[str, list[float]]] = {}
        layers = list(dict.fromkeys([*(layer for layer, *_ in sketch.circles), *(line.layer for line in sketch.lines)]))
        named = [layer for layer in layers if any(word in layer.casefold() for word in GROUNDS)]
        named += [layer for layer in layers if layer == "0"]
        if options.ground or not named:
            draft.ground = options.ground if options.ground in layers else ""
        else:
            draft.ground = named[0]
            if len(named) > 1:
                what = f"is taken as what does not move, and {', '.join(named[1:])} as links that may"
                draft.warn("exchange.ground", f"links.{named[0]}", what, "draw it on one layer, or state --ground")
        draft.bodies = {layer: Body(layer) for layer in sorted(layers, key=lambda layer: layer != draft.ground)}
        for layer, place, radius in sketch.circles:
            self.marks.setdefault(self._place(place), {}).setdefault(layer, []).append(radius)
        self.drawn = list(self.marks)
        self.ends = {line: (self._place(line.start), self._place(line.end)) for line in sketch.lines}
        self.slots, sides = self._slots()
        if loose := len(sketch.halves) - 2 * len(self.slots):
            draft.lose(f"{loose} half circles")
        for line in sketch.lines:
            for number in () if line in sides else self.ends[line]:
                self.marks.setdefault(number, {}).setdefault(line.layer, [])

    def _place(self, point: Array) -> int:
        """The number of a place, a new one if none is near."""
        near = np.flatnonzero(np.hypot(*(self.places - point).T) <= TOUCH * self.size)
        if not len(near):
            self.places = np.vstack([self.places, point])
        return int(near[0]) if len(near) else len(self.places) - 1

    def read(self) -> None:
        """Pins, guides, points and names, in this order; what no joint holds is left out."""
        draft = self.draft
        for number in self.drawn:
            if len(self.marks[number]) > 1:
                self._pin(number)
        guided = self._guides()
        for number, layers in self.marks.items():
            if number not in self.joined and len(layers) > 1 and not any(pair <= layers.keys() for pair in guided):
                self._pin(number)
        for number in self.drawn:
            if number not in self.joined:
                self._single(number)
        loose = [layer for layer in draft.bodies if draft.pairs and not draft.pairs_of(layer)]
        for layer in loose:
            del draft.bodies[layer]
            draft.ground = "" if layer == draft.ground else draft.ground
            draft.lose("layer without a joint with another", layer)
        self._names()

    def _add(self, kind: str, links: tuple[str, str], number: int, comment: str, axis: Array | None = None) -> Pair:
        """A new pair that has no name yet, of two links of which the first bears the pin or rail; ground is first."""
        first, second = links[::-1] if links[1] == self.draft.ground else links
        pair = Pair(f"J{len(self.draft.pairs) + 1}", kind, (first, second), np.array([*self.places[number], 0.0]))
        pair.comments.append(comment)
        if axis is not None:  # as it would be drawn: to the right, or upwards
            pair.axis = np.array([*axis, 0.0]) / np.hypot(*axis) * np.sign(axis[int(np.argmax(np.abs(axis)))])
        self.draft.pairs[pair.name] = pair
        return pair

    def _pin(self, number: int) -> None:
        """The joints of a place where several layers lie: all turn on the link whose circle is smallest."""
        draft = self.draft
        self.joined.add(number)
        drawn, marks = self.marks[number], dict[str, list[float]]()
        for layer, radii in drawn.items():
            sizes = sorted(radius for radius in radii if radius)
            marks[layer] = [b for a, b in itertools.pairwise([0.0, *sizes]) if b - a > TOUCH * self.size]
        layers = [layer for layer in draft.bodies if layer in marks]
        hub = min(layers, key=lambda layer: (min(marks[layer], default=math.inf), -len(drawn[layer])))
        if len(layers) > 2:
            what = f"is taken as the link that bears the pin of {', '.join(layers)}"
            draft.warn("exchange.shared_pin", f"links.{hub}", what, "mend the links of these joints if another does")
        for other in layers:
            if other == hub:
                continue
            pins, holes = marks[hub], marks[other]
            near = [sorted(both) for both in itertools.product(pins, holes) if abs(both[0] - both[1]) <= self.gap]
            fits = near[0] if len(near) == 1 else pins if len(pins) == 1 and not holes else []
            circles = ", ".join(f"{_mm(radius)} mm" for radius in sorted({*pins, *holes}))
            comment = f"{hub} and {other} share a place; radii: {circles or 'none'}"
            pair = self._add("revolute", (hub, other), number, comment)
            pair.pin_radius, pair.hole_radius = [*fits, None, None][:2]
            if circles and not fits:
                what = f"has circles of {circles} radius, of which none are clearly its pin and hole"
                draft.warn("exchange.radius", f"joints.{pair.name}", what, "state its pin, or draw pin and hole alone")
            if not any(drawn.values()):
                what = f"is read where lines of {hub} and {other} end; no circle or point marks it"
                draft.note("exchange.bare_end", f"joints.{pair.name}", what, "draw its pin as a circle")

    def _guides(self) -> set[frozenset[str]]:
        """Prismatic pairs where lines of two layers lie on each other, the shorter ones the slider's; these layers.

        A line between two joints is the body of a link, which may lie on another by chance.
        """
        draft, order = self.draft, list(self.draft.bodies)
        guided, chance = defaultdict[frozenset[str], list[Line]](list), defaultdict[frozenset[str], list[Line]](list)
        for both in _lying(self.sketch.lines, self.gap):
            layers = frozenset(line.layer for line in both)
            bodies = [all(k in self.joined or self.marks.get(k, {}).keys() - layers for k in self.ends[line])
                      for line in both]  # fmt: skip
            if not all(bodies) and not any(layers <= self.marks[k].keys() for k in self.joined):
                (chance if any(bodies) else guided)[layers] += both
        for layers in sorted(chance.keys() - guided.keys(), key=sorted):
            draft.lose("guides along lines between joints", " and ".join(sorted(layers)))
        for layers, pairs in guided.items():
            lines = {layer: [line for line in dict.fromkeys(pairs) if line.layer == layer] for layer in layers}
            for layer, drawn in lines.items():
                lines[layer] = [line for line in drawn if not self.joined & {*self.ends[line]}] or drawn
            length = {layer: max(line.length for line in lines[layer]) for layer in layers}
            slider, rail = sorted(layers, key=lambda layer: (length[layer], -order.index(layer)))
            along = lines[slider][0].span / lines[slider][0].length
            ways = np.array([sorted(end @ along for end in (line.start, line.end)) for line in lines[slider]])
            same = all(abs(_cross(along, line.span)) <= 3 * TOUCH * line.length for line in lines[slider])
            if not same or np.ptp(ways, axis=0).max() > TOUCH * self.size:
                several = "lengths" if same else "directions"
                what = f"has lines of several {several} on those of {rail}; no guide is read"
                draft.warn("exchange.line", f"links.{slider}", what, "draw the slider as lines of one length")
                continue
            middle = self._place(np.mean([(line.start + line.end) / 2 for line in lines[slider]], axis=0))
            pair = self._add("prismatic", (rail, slider), middle, f"lines of {slider} lie on lines of {rail}", along)
            longer = all(line.length - length[slider] > TOUCH * self.size for line in lines[rail])
            pair.length = length[slider] if longer else None
            what = f"is taken as a guide, for lines of {slider} lie on lines of {rail}"
            remedy = "if it is none, draw the links at another position"
            draft.note("exchange.guide", f"joints.{pair.name}", what, remedy)
        return set(guided)

    def _slots(self) -> tuple[list[Slot], set[Line]]:
        """What two half circles and two lines of a layer enclose, and these lines."""
        leads: dict[tuple[str, int], list[tuple[int, Line]]] = {}  # where the lines of a layer lead from a place
        for line, (start, end) in self.ends.items():
            leads.setdefault((line.layer, start), []).append((end, line))
            leads.setdefault((line.layer, end), []).append((start, line))
        halves = [(half, self._place(half.start), self._place(half.end)) for half in self.sketch.halves]
        chords = {(half.layer, *chord): half for half, a, b in halves for chord in ((a, b), (b, a))}
        slots, sides = [], set[Line]()
        for half, a, b in halves:
            for (c, left), (d, right) in itertools.product(*(leads.get((half.layer, k), ()) for k in (a, b))):
                other = chords.get((half.layer, c, d), half)
                if other is not half and not {left, right} & sides:
                    ends = [(part.start + part.end) / 2 for part in (half, other)]
                    slots.append(Slot(half.layer, ends[0], ends[1], (half.half + other.half) / 2))
                    sides |= {left, right}
        return slots, sides

    def _single(self, number: int) -> None:
        """A circle or point that no other layer meets: a pin in a slot of another layer, else a point of the link.

        Between pin and slot lies a block without mass, which turns on the one and slides in the other.
        """
        draft, at = self.draft, self.places[number]
        layer, radii = next(iter(self.marks[number].items()))
        radius, slack = min(radii), 10 * TOUCH * self.size
        slots = [slot for slot in self.slots if slot.layer != layer and slot.holds(at, radius, slack)]
        if len(slots) == 1:
            slot = slots[0]
            comment = f"a pin of {layer}, radius {_mm(radius)} mm, in a slot of {slot.layer}, {_mm(2 * slot.half)} mm"
            block = free_name(f"block in {slot.layer}", draft.bodies, "block")
            draft.bodies[block] = Body(block, comments=[f"{comment}: a block without mass lies between them"])
            self._add("revolute", (layer, block), number, comment).pin_radius = radius or None
            guide = self._add("prismatic", (slot.layer, block), number, comment, slot.end - slot.start)
            ways = sorted(float((end - at) @ guide.axis[:2]) for end in (slot.start, slot.end))
            guide.limits = ways[0], ways[1]
            if radius and slot.half - radius > self.gap:
                what = f"has {_mm(slot.half - radius)} mm of play in the slot of {slot.layer}, which is taken as none"
                draft.warn("exchange.slot", f"joints.{guide.name}", what, "draw the pin as wide as the slot")
            return
        if slots:
            draft.lose("pins in several slots", layer)
        points = draft.bodies[layer].points
        points[f"P{len(points) + 1}"] = np.array([*at, 0.0])
        near = [k for k in self.drawn if k != number and np.hypot(*(self.places[k] - at)) <= self.gap]
        if max(radii) > 0 and any(self.marks[k].keys() - {layer} for k in near):
            draft.lose("circles almost about the centre of another, which are no joint", layer)

    def _names(self) -> None:
        """Texts name the joint or point nearest to them, those on a layer of its links first.

        A name on the layer of a link that moves makes it the second link of the joint.
        """
        draft, near = self.draft, NEAR * self.size
        targets = [("", pair.name, pair.links, pair.at) for pair in draft.pairs.values()]  # layer of a point, old name
        for link, body in draft.bodies.items():
            targets += [(link, name, (link, link), at) for name, at in body.points.items()]
            body.points = {}
        texts: dict[int, Text] = {}
        words = self.sketch.texts
        places, written = (
            np.array(part).reshape(-1, 2) for part in ([t[3][:2] for t in targets], [t[1] for t in words])
        )
        apart = np.hypot(*(places[:, None] - written).transpose(2, 0, 1))
        choices = []
        for j, i in np.argwhere(apart <= near):
            layer, links = words[i][0], targets[j][2]
            strange = 0.0 if layer == links[-1] else 0.5 if layer in links else 1.0
            choices.append((apart[j, i] + near * strange, j, i))
        free = set(range(len(words)))
        for _, j, i in sorted(choices):
            if j not in texts and i in free:
                texts[j] = words[i]
                free.remove(i)
        used: dict[str, list[str]] = {link: [] for link in ("", *draft.bodies)}  # "": by joints
        pairs, draft.pairs = draft.pairs, {}
        renamed: dict[str, str] = {}
        for j in sorted(range(len(targets)), key=lambda j: (targets[j][0] != "", j not in texts)):
            link, old, links, at = targets[j]
            layer, _, label = texts.get(j, ("", at, old))
            name = free_name(label.strip(), [*used[""], *used[link]])
            used[link].append(name)
            if link:
                draft.bodies[link].points[name] = at
            else:
                turned = layer == links[0] != draft.ground
                draft.pairs[name] = replace(pairs[old], name=name, links=(links[turned], links[not turned]))
                renamed[f"joints.{old}"] = f"joints.{name}"
        draft.findings = [replace(note, where=renamed.get(note.where, note.where)) for note in draft.findings]


def _lying(lines: list[Line], gap: float) -> Iterator[tuple[Line, Line]]:
    """Lines of different layers that are parallel, nearer to each other than the gap, and overlap."""
    lines = [line for line in lines if line.length > 0]
    starts, ends = (np.array([getattr(n, end) for n in lines]).reshape(-1, 2) for end in ("start", "end"))
    lengths, count = np.array([line.length for line in lines]), 0
    for i, line in enumerate(lines):
        along = line.span / line.length
        ways = np.stack([(places[i + 1 :] - line.start) @ along for places in (starts, ends)])
        aside = np.stack([_cross(along, places[i + 1 :] - line.start) for places in (starts, ends)])
        overlap = np.minimum(ways.max(axis=0), line.length) - np.maximum(ways.min(axis=0), 0.0)
        lies = (np.ptp(aside, axis=0) <= TOUCH * lengths[i + 1 :]) & (np.abs(aside).max(axis=0) <= gap)
        for j in np.flatnonzero(lies & (overlap > 0.01 * np.minimum(lengths[i + 1 :], line.length))):
            if lines[i + 1 + j].layer != line.layer:
                count += 1
                few(count, 5 * MOST_MARKS, "lines that lie on lines of other layers")
                yield line, lines[i + 1 + j]


def _cross(a: Array, b: Array) -> Any:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]


def _mm(length: float) -> str:
    return f"{1e3 * length:.6g}"
