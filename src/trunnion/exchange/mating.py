"""Joints between solids by their faces: pins in holes, balls in sockets, slides between facing planes.

Faces say which bodies touch; what the touching bodies can do against each other follows from all their contacts. What
is not certain is a finding.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from trunnion.errors import MechanismError
from trunnion.exchange.brep import Face
from trunnion.exchange.draft import Array, Draft, Pair, components, free_name, perpendicular
from trunnion.joints.fits import fit, limits

ANGLE = 1e-4  # rad, between axes or planes that count as parallel
NEAR = 1e-6  # m, between places that count as equal
COVERED = 0.55, 0.45  # of a turn: a hole that holds its pin; one that may
THREAD = 0.2  # of the radius: a pin that much larger than its hole is pressed or threaded in
FITS = ("H7/h6", "H7/g6", "H7/f7", "H8/f7", "H8/e8", "H9/d9", "H11/c11")
TRIED = 24  # directions of edges for the least box around a face
ALIKE = 3  # of the gap: the difference of radii up to which a pin without a joint is spoken of


@dataclass(frozen=True, eq=False)
class Round:
    """A pin or hole of a body: cylindrical faces of one axis and radius that follow each other, or a ball."""

    body: str
    point: Array
    axis: Array
    radius: float
    low: float  # along the axis from the point, m
    high: float
    hole: bool
    covered: float  # of its full area
    faces: tuple[int, ...]
    tolerance: str | tuple[float, float] = ""  # of its diameter: a class such as H7, or lower and upper deviation, m

    @property
    def label(self) -> str:
        """In words, with its numbers in the file."""
        numbers = ", ".join(f"#{number}" for number in self.faces[:4])
        kind = (("pin", "hole") if self.high > self.low else ("ball", "socket"))[self.hole]
        deviation = self.tolerance
        if isinstance(deviation, tuple):
            deviation = f"{1e3 * deviation[1]:+.6g}/{1e3 * deviation[0]:+.6g} mm"
        size = f"{2e3 * self.radius:.9g} mm {deviation}".rstrip()
        return f"{kind} d={size} of {self.body} ({numbers})"

    @property
    def deviations(self) -> tuple[float, float] | None:
        """Limits of the radius from that drawn, m; None where the file states none, or a class that ISO 286 has not."""
        try:
            either = self.tolerance if isinstance(self.tolerance, tuple) else limits(2 * self.radius, self.tolerance)
        except MechanismError:
            return None
        return either[0] / 2, either[1] / 2


@dataclass(frozen=True, eq=False)
class Contact:
    """A pin in a hole, or a ball in a socket: low to high along the hole's axis from its point."""

    pin: Round
    hole: Round
    low: float
    high: float

    @property
    def play(self) -> float:
        """Radius of the hole less that of the pin, m; what is rounding is none."""
        play = self.hole.radius - self.pin.radius
        return 0.0 if abs(play) < 1e-9 * self.hole.radius else play

    @property
    def middle(self) -> Array:
        """Middle of the bearing."""
        return np.asarray(self.hole.point + (self.low + self.high) / 2 * self.hole.axis)


@dataclass(frozen=True, eq=False)
class Facing:
    """Two flat faces that look at each other.

    Parameters
    ----------
    bodies : names. outlines : points of the bounds of their faces, m.
    normal : out of the first body. level : of its face along the normal, m. gap : to the other face, m.
    corners : of the overlap, m, (4, 3).
    """

    bodies: tuple[str, str]
    outlines: tuple[Array, Array]
    normal: Array
    level: float
    gap: float
    corners: Array


def parallel(left: Array, other: Array) -> bool:
    """Whether two unit vectors are parallel or opposite."""
    return bool(np.linalg.norm(np.cross(left, other)) < ANGLE)


def _line_numbers(points: Sequence[Array], axes: Sequence[Array], slack: Sequence[float]) -> list[int]:
    """A number for each line, equal for lines that lie on each other but for their slack, m."""
    numbers: list[int] = []
    first: list[int] = []
    for index, (point, axis) in enumerate(zip(points, axes, strict=True)):
        if first:
            other = np.array([axes[line] for line in first])
            off = point - np.array([points[line] for line in first])
            away = np.linalg.norm(off - (off * other).sum(axis=1)[:, None] * other, axis=1)
            turned = np.linalg.norm(np.cross(other, axis), axis=1)
            room = slack[index] + np.array([slack[line] for line in first]) + NEAR
            same = np.nonzero((away <= room) & (turned < ANGLE))[0]
            if len(same):
                numbers.append(int(same[0]))
                continue
        numbers.append(len(first))
        first.append(index)
    return numbers


def joined(draft: Draft, faces: dict[str, list[Face]], gap: float) -> None:
    """Add the pairs between the bodies of a draft, found by their faces.

    Parameters
    ----------
    draft : gets the pairs and the findings. faces : of every body, in the global frame.
    gap : greatest difference of the radii of a pin and its hole, and distance of facing planes, m.
    """
    mechanism = _Contacts(draft, faces, gap)
    mechanism.bolt()
    while (rigid := next(mechanism.rigid(), None)) is not None:
        mechanism.weld(*rigid)
    mechanism.unconnected()
    mechanism.pairs()


# ---- features -------------------------------------------------------------------------------------------------


def _rounds(faces: dict[str, list[Face]], kind: str) -> list[Round]:
    """Pins and holes, or balls and sockets, of all bodies; faces that are parts of the same are united."""
    rounds: list[Round] = []
    ball = kind == "sphere"
    for body, all_faces in faces.items():
        round_faces = [face for face in all_faces if face.kind == kind and (ball or len(face.outline))]
        axes = [face.axis * np.sign(face.axis[int(np.argmax(abs(face.axis)))]) for face in round_faces]
        numbers: list[Any] = _line_numbers([face.origin for face in round_faces], axes, [0.0] * len(round_faces))
        if ball:
            numbers = [tuple(np.round(face.origin / NEAR)) for face in round_faces]
        groups: dict[tuple[int, int, bool], list[tuple[float, float, Face]]] = defaultdict(list)
        for face, number in zip(round_faces, numbers, strict=True):
            lead = numbers.index(number)
            along = np.zeros(1) if ball else (face.outline - round_faces[lead].origin) @ axes[lead]
            piece = float(along.min()), float(along.max()), face
            groups[lead, round(face.radius * 1e9), not face.outward].append(piece)
        for (lead, _, hole), pieces in groups.items():
            pieces.sort(key=lambda piece: piece[0])
            while pieces:
                low, high, face = pieces.pop(0)
                parts = [face]
                while pieces and pieces[0][0] <= high + NEAR:
                    high = max(high, pieces[0][1])
                    parts.append(pieces.pop(0)[2])
                full = 2 * math.pi * face.radius * (2 * face.radius if ball else high - low)
                if full > 0:
                    covered = sum(part.area for part in parts) / full
                    ids = tuple(part.number for part in parts)
                    where = round_faces[lead].origin, axes[lead], face.radius, low, high
                    rounds.append(Round(body, *where, hole, covered, ids, face.tolerance))
    return rounds


def _overlaps(rounds: Sequence[Round], widest: float) -> Iterator[Contact]:
    """Pins in holes of other bodies whose radius exceeds theirs by at most `widest`, or balls in sockets."""
    holes = [item for item in rounds if item.hole and item.covered >= COVERED[1]]
    points, axes = (np.array([getattr(hole, key) for hole in holes]).reshape(-1, 3) for key in ("point", "axis"))
    radii, lows, highs = (np.array([getattr(hole, key) for hole in holes]) for key in ("radius", "low", "high"))
    for pin in (item for item in rounds if not item.hole and item.covered >= COVERED[0]):
        off, ball = pin.point - points, pin.low == pin.high
        shift = np.zeros(len(holes)) if ball else (off * axes).sum(axis=1)
        aside = np.linalg.norm(off - shift[:, None] * axes, axis=1)
        turned = np.linalg.norm(np.cross(axes, pin.axis), axis=1)
        ends = shift + np.outer([pin.low, pin.high], np.sign(axes @ pin.axis))
        low, high = np.maximum(ends.min(axis=0), lows), np.minimum(ends.max(axis=0), highs)
        fits = (radii - pin.radius <= widest) & (aside <= abs(radii - pin.radius) + NEAR)
        fits &= ball | ((turned < ANGLE) & (high - low >= NEAR))
        for hole, start, end in ((holes[k], float(low[k]), float(high[k])) for k in np.nonzero(fits)[0]):
            if hole.body != pin.body:
                yield Contact(pin, hole, start, end)


def _facings(faces: dict[str, list[Face]], gap: float) -> Iterator[Facing]:
    """Flat faces of different bodies that look at each other across at most the gap and overlap."""
    planes = []  # body, normal out of it, level along the normal and outline
    for body, all_faces in faces.items():
        for face in (face for face in all_faces if face.kind == "plane" and len(face.outline)):
            normal = face.axis if face.outward else -face.axis
            planes.append((body, normal, float(face.outline[0] @ normal), face.outline))
    if not planes:
        return
    normals, levels = np.array([plane[1] for plane in planes]), np.array([plane[2] for plane in planes])
    for index, (body, normal, level, outline) in enumerate(planes):
        distance = -levels - level
        near = (normals @ normal < -1 + ANGLE**2) & (distance >= -NEAR) & (distance <= gap)
        others = [other for other in np.nonzero(near[index + 1 :])[0] + index + 1 if planes[other][0] != body]
        frame = _tight(outline, normal) if others else np.eye(3)
        for other in others:
            left, two = (points @ frame[:2].T for points in (outline, planes[other][3]))
            low, high = np.maximum(left.min(axis=0), two.min(axis=0)), np.minimum(left.max(axis=0), two.max(axis=0))
            if (high - low > NEAR).all():
                flat = np.array([(a, b) for a in (low[0], high[0]) for b in (low[1], high[1])]) @ frame[:2]
                corners = flat + (level + distance[other] / 2) * normal
                outlines = outline, planes[other][3]
                yield Facing((body, planes[other][0]), outlines, normal, level, float(distance[other]), corners)


def _tight(outline: Array, normal: Array) -> Array:
    """Rows x, y and normal of the frame whose axes run along an edge of a flat face, with the least box around it."""
    steps = np.diff(outline, axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    longest = np.argsort(lengths)[-TRIED:]
    x = np.vstack([perpendicular(normal), steps[longest[lengths[longest] > NEAR]]])
    x = x - np.outer(x @ normal, normal)
    x /= np.linalg.norm(x, axis=1)[:, None]
    y = np.cross(normal, x)
    best = int(np.argmin(np.ptp(outline @ x.T, axis=0) * np.ptp(outline @ y.T, axis=0)))
    return np.array([x[best], y[best], normal])


# ---- what the contacts mean -----------------------------------------------------------------------------------


class _Contacts:
    """The contacts of all bodies, and what they leave free. leader: of bodies that move together, the first."""

    def __init__(self, draft: Draft, faces: dict[str, list[Face]], gap: float) -> None:
        self.draft, self.leader = draft, {name: name for name in draft.bodies}
        self.rounds = _rounds(faces, "cylinder")
        self.facings, self.contacts = list(_facings(faces, gap)), list[Contact]()
        self.contacts = self._joining(self.rounds, gap)
        self.balls = self._joining(_rounds(faces, "sphere"), gap)
        axes, slack = [contact.hole.axis for contact in self.contacts], [abs(contact.play) for contact in self.contacts]
        numbers = _line_numbers([contact.middle for contact in self.contacts], axes, slack)
        self.line = dict(zip(self.contacts, numbers, strict=True))  # number of the axis of each contact
        self.regroup()
        self.plane: Array | None = None  # its normal where it may move in one: two pins along it, others slide in it
        for normal in [] if self.balls else axes:
            along = [other for other in self.contacts if parallel(other.hole.axis, normal)]
            across = [
                other
                for other in self.contacts
                if abs(other.hole.axis @ normal) < ANGLE
                and self.stops(other.hole.body, other.pin.body, other.hole.axis) < 2
            ]
            if len(self.lines(along)) > 1 and len(along) + len(across) == len(self.contacts):
                self.plane = normal
                break

    def _joining(self, rounds: Sequence[Round], gap: float) -> list[Contact]:
        """Pins in holes of other bodies; doubtful ones are findings, pressed ones are welded."""
        draft, contacts, doubts = self.draft, list[Contact](), list[Contact]()
        for contact in _overlaps(rounds, ALIKE * gap):
            pin, hole, play = contact.pin, contact.hole, contact.play
            if hole.covered < COVERED[0]:
                if 0 <= play <= gap:
                    what = f"{hole.label} covers only half of {pin.label}: no joint is made of it"
                    draft.warn("exchange.half", f"links.{hole.body}", what, "add the joint to the model if it is one")
            elif 0 <= play <= gap:
                contacts.append(contact)
            elif play < 0 and -play <= max(gap, THREAD * pin.radius):
                what = f"{pin.label} is larger than {hole.label}: pressed or threaded, the two parts are fixed"
                self.weld(hole.body, pin.body, what, "draw the play if they turn")
            else:
                doubts.append(contact)
        met = {frozenset((contact.pin.body, contact.hole.body)) for contact in contacts}
        for pin, hole, play in ((contact.pin, contact.hole, contact.play) for contact in doubts):
            if frozenset((pin.body, hole.body)) not in met and self.leader[pin.body] != self.leader[hole.body]:
                what = f"{pin.label} and {hole.label} differ by {1e3 * play:.6g} mm in radius: no joint is made of them"
                draft.warn("exchange.gap", f"links.{pin.body}", what, "a larger --gap makes one", gap=play)
        return contacts

    def lines(self, contacts: Sequence[Contact]) -> set[int]:
        """Numbers of the axes of contacts."""
        return {self.line[contact] for contact in contacts}

    def regroup(self) -> None:
        """Sort contacts of pins, and planes that face each other, by the bodies that move together."""
        self.between: dict[tuple[str, str], list[Contact]] = defaultdict(list)
        for contact in self.contacts:
            left, other = sorted((self.leader[contact.hole.body], self.leader[contact.pin.body]))
            if left != other:
                self.between[left, other].append(contact)
        self.ends: dict[tuple[str, str], list[Facing]] = defaultdict(list)  # seen from the first body
        for facing in self.facings:
            first, second = (self.leader[name] for name in facing.bodies)
            if first < second:
                self.ends[first, second].append(facing)
            elif second < first:
                level = -facing.level - facing.gap
                back = replace(facing, outlines=facing.outlines[::-1], normal=-facing.normal, level=level)
                self.ends[second, first].append(back)

    def weld(self, left: str, other: str, what: str, remedy: str = "") -> None:
        """Make two bodies one and say so; a doubt if there is a remedy."""
        draft, first, second = self.draft, self.leader[left], self.leader[other]
        if remedy:
            draft.warn("exchange.fixed", f"links.{other}", what, remedy)
        else:
            draft.note("exchange.fixed", f"links.{other}", what)
        if first == second:
            return
        if draft.ground and second == self.leader[draft.ground]:
            first, second = second, first
        self.leader = {name: first if lead == second else lead for name, lead in self.leader.items()}
        name = free_name(f"fixed {left} {other}", draft.pairs)
        draft.pairs[name] = Pair(name, "fixed", (first, second), np.zeros(3), comments=[what])
        draft.bodies[other].comments.append(what)
        self.regroup()

    def stops(self, left: str, other: str, axis: Array) -> int:
        """In how many of the two directions along an axis end faces hold two bodies."""
        pair = (left, other) if left < other else (other, left)
        along = [facing.normal @ axis for facing in self.ends.get(pair, [])]
        return int(any(part > 1 - ANGLE for part in along)) + int(any(part < -1 + ANGLE for part in along))

    def bolt(self) -> None:
        """Make one of bodies that touch where two holes of each lie on the same axes."""
        holes = [item for item in self.rounds if item.hole and item.covered > COVERED[0]]
        numbers = _line_numbers([hole.point for hole in holes], [hole.axis for hole in holes], [0.0] * len(holes))
        bolts: dict[str, dict[int, Array]] = defaultdict(dict)
        for hole, number in zip(holes, numbers, strict=True):
            bolts[hole.body][number] = hole.axis
        for facing in (facing for facing in self.facings if facing.gap <= NEAR):
            left, other = facing.bodies
            shared = bolts[left].keys() & bolts[other].keys()
            count = sum(parallel(bolts[left][number], facing.normal) for number in shared)
            if count > 1 and self.leader[left] != self.leader[other]:
                what = f"{left} and {other} touch, and {count} holes of each lie on the same axes: fixed"
                self.weld(left, other, what, "draw the pins if they move")

    def rigid(self) -> Iterator[tuple[str, ...]]:
        """Two bodies that cannot move against each other, why, and what to do if they do; the surest first."""
        between = self.between
        for (left, other), contacts in between.items():
            axis, parallels = contacts[0].hole.axis, [parallel(contacts[0].hole.axis, c.hole.axis) for c in contacts]
            if len(self.lines(contacts)) > 1 and (self.stops(left, other, axis) or not all(parallels)):
                yield left, other, f"{left} and {other} are fixed to each other: pins on several axes join them"
        for left, other in self.ends:
            if (left, other) not in between and len(self._walls(left, other)) > 2:
                what = f"{left} and {other} hold each other in all directions: they are taken as fixed"
                yield left, other, what, "draw the play if they move"
        lines: dict[str, set[int]] = defaultdict(set)
        for pair, contacts in between.items():
            for body in pair:
                lines[body] |= self.lines(contacts)
        for left, other in combinations(lines, 2):  # such as the two side plates of a link
            if len(lines[left] & lines[other]) > 1 and tuple(sorted((left, other))) not in between:
                yield left, other, f"{left} and {other} turn about the same axes and are one link"
        for body in (name for name in dict.fromkeys(self.leader.values()) if name in lines and len(between) > 1):
            mine = {pair: contacts for pair, contacts in between.items() if body in pair}
            centred = self._centred(body, next(iter(mine.values()))[0])
            if body == self.draft.ground or len(lines[body]) > 1 or not centred:
                continue
            ball = any(body in (self.leader[item.pin.body], self.leader[item.hole.body]) for item in self.balls)
            others = (other for other in self.leader.values() if other != body)
            if ball or any(tuple(sorted((body, other))) not in mine and self._walls(body, other) for other in others):
                continue
            tightest = min(mine, key=lambda pair: min(contact.play for contact in mine[pair]))
            holder = next(name for name in tightest if name != body)
            least = ", where its play is least" if len(mine) > 1 else ""
            yield holder, body, f"{body} turns only about its own axis: it is taken as fixed in {holder}{least}"

    def _centred(self, body: str, contact: Contact) -> bool:
        """Whether the mass centre of a body lies on the axis of a contact."""
        parts = [part for name, part in self.draft.bodies.items() if self.leader[name] == body]
        mass = sum(part.mass for part in parts)
        centre = sum(part.mass * part.centre for part in parts) / mass if mass else parts[0].centre
        off = centre - contact.hole.point
        across = off - (off @ contact.hole.axis) * contact.hole.axis
        return bool(np.linalg.norm(across) <= contact.play + 1e-3 * contact.hole.radius)

    def _walls(self, left: str, other: str) -> list[tuple[Facing, Facing]]:
        """Opposite walls that hold two bodies, for independent directions, seen from the first by name."""
        walls: list[tuple[Facing, Facing]] = []
        pair = (left, other) if left < other else (other, left)
        for front, back in combinations(self.ends.get(pair, []), 2):
            if front.normal @ back.normal < -1 + ANGLE**2:
                normals = [*(wall[0].normal for wall in walls), front.normal]
                if np.linalg.matrix_rank(np.array(normals), tol=ANGLE) == len(normals):
                    walls.append((front, back))
        if len(walls) == 1 and self.plane is not None and parallel(walls[0][0].normal, self.plane):
            return []  # the plates of a plane mechanism lie against each other
        return walls

    def unconnected(self) -> None:
        """What no joint connects with the rest is fixed to what it touches, or left out."""
        draft = self.draft
        while True:
            near = [(self.leader[i.pin.body], self.leader[i.hole.body]) for i in (*self.contacts, *self.balls)]
            near += [pair for pair in self.ends if self._walls(*pair)]
            groups = components(self.leader.values(), near)
            main = next((group for group in groups if self.leader.get(draft.ground) in group), max(groups, key=len))
            flush = [[self.leader[name] for name in facing.bodies] for facing in self.facings if facing.gap <= NEAR]
            touching = [pair for pair in flush if (pair[0] in main) != (pair[1] in main)]
            if not touching:
                break
            left, other = touching[0] if touching[0][0] in main else touching[0][::-1]
            what = f"{other} has no joint with the rest, and touches {left}: it is taken as fixed to it"
            self.weld(left, other, what, "draw the pin if it moves")
        if len(main) == 1:
            return
        for body in (body for body in dict.fromkeys(self.leader.values()) if body not in main):
            what = f"{body} has no joint with the rest and is left out"
            draft.warn("exchange.unconnected", f"links.{body}", what, "draw the pin in its hole, or a larger --gap")
        self.leader = {name: lead for name, lead in self.leader.items() if lead in main}
        names = self.leader.keys()
        draft.bodies = {name: body for name, body in draft.bodies.items() if name in names}
        draft.pairs = {name: pair for name, pair in draft.pairs.items() if names >= {*pair.links}}
        self.contacts = [item for item in self.contacts if {item.pin.body, item.hole.body} <= names]
        self.balls = [item for item in self.balls if {item.pin.body, item.hole.body} <= names]
        self.facings = [facing for facing in self.facings if names >= {*facing.bodies}]
        self.regroup()

    # ---- pairs -------------------------------------------------------------------------------------------------

    def pairs(self) -> None:
        """Add the pairs of all bodies that touch and move against each other."""
        for (left, other), contacts in self.between.items():
            axis = contacts[0].hole.axis
            stops = self.stops(left, other, axis)
            if len(self.lines(contacts)) > 1:
                comment = "pins on several parallel axes, and no end faces along them: it slides"
                pair = _pair("prismatic", contacts, comment)
            elif self.plane is not None and abs(axis @ self.plane) < ANGLE:
                pair = _pair("prismatic", contacts, "its axis lies in the plane of the mechanism: it slides")
            else:
                comment = f"end faces hold it in {('neither direction', 'one direction only', '')[stops]}"
                turns = stops == 2 or self.plane is not None
                pair = _pair("revolute" if turns else "cylindrical", contacts, comment if stops < 2 else "")
            self._add(pair)
        for ball in self.balls:
            if self.leader[ball.pin.body] != self.leader[ball.hole.body]:
                self._add(replace(_pair("spherical", [ball]), at=ball.hole.point, length=None))
        for left, other in sorted(self.ends.keys() - self.between.keys()):
            if walls := self._walls(left, other):
                self._sliding(left, other, walls)

    def _add(self, pair: Pair) -> None:
        letters = (f"{chr(65 + n % 26)}{n // 26 or ''}" for n in range(26 * 1000))
        pair.name = next(name for name in letters if name not in self.draft.pairs and name not in self.draft.bodies)
        self.draft.pairs[pair.name] = pair

    def _sliding(self, left: str, other: str, walls: list[tuple[Facing, Facing]]) -> None:
        """The pair of bodies that flat walls guide."""
        normals = np.array([wall[0].normal for wall in walls])
        comment = "; ".join(
            f"walls {1e3 * abs(a.level + b.level):.9g} mm apart, play {1e3 * (a.gap + b.gap):.6g} mm" for a, b in walls
        )
        middle = np.mean([facing.corners for facing in walls[0]], axis=(0, 1))
        if len(walls) == 1 and self.plane is None:
            self._add(Pair("", "planar", (left, other), middle, normals[0], comments=[comment]))
            return
        plane = np.zeros(3) if self.plane is None else self.plane
        axis = np.cross(normals[0], normals[1] if len(walls) == 2 else plane)
        axis = axis / np.linalg.norm(axis)
        front, back = min(walls, key=lambda wall: abs(float(wall[0].normal @ plane)))
        width, play = front.level + back.level, front.gap + back.gap  # a width below 0: the first body is outside
        half = width / 2 if width > 0 else -(width + play) / 2
        along = np.concatenate([face.corners for face in (front, back)]) @ axis
        reach = [np.ptp(outline @ axis) for outline in front.outlines]
        links = (other, left) if reach[0] <= reach[1] else (left, other)  # the second carries the bearing along
        middle = np.mean([front.corners, back.corners], axis=(0, 1))
        pair = Pair("", "prismatic", links, middle, axis, comments=[comment])
        pair.pin_radius, pair.hole_radius, pair.length = half, half + play / 2, float(np.ptp(along))
        self._add(pair)


def _pair(kind: str, contacts: list[Contact], comment: str = "") -> Pair:
    """A pair of pins on one axis: sizes of its longest bearing, length from the first end to the last."""
    main = max(contacts, key=lambda contact: contact.high - contact.low)
    axis = main.hole.axis
    ends = []
    for contact in contacts:
        shift = float((contact.hole.point - main.hole.point) @ axis)
        sign = float(np.sign(contact.hole.axis @ axis))
        ends += [shift + sign * contact.low, shift + sign * contact.high]
    links = main.pin.body, main.hole.body
    if kind != "revolute" and main.pin.high - main.pin.low < main.hole.high - main.hole.low:
        links = links[::-1]  # the second carries the bearing along
    pair = Pair("", kind, links, main.hole.point + (min(ends) + max(ends)) / 2 * axis, axis)
    pair.pin_radius, pair.hole_radius, pair.length = main.pin.radius, main.hole.radius, max(ends) - min(ends)
    if main.play == 0:
        pair.hole_radius = pair.pin_radius
    pair.pin_limits, pair.hole_limits = main.pin.deviations, main.hole.deviations
    for contact in contacts:
        over = f", over {1e3 * (contact.high - contact.low):.9g} mm" if contact.high > contact.low else ""
        pair.comments.append(f"{contact.pin.label} in {contact.hole.label}{over}")
    if kind in ("revolute", "cylindrical"):
        size, play = round(2e3 * main.hole.radius, 1) * 1e-3, 2 * main.play
        try:  # the usual fit whose mean play is nearest to that drawn
            fits = {name: fit(size, *name.split("/")) for name in FITS}
            name = min(fits, key=lambda name: abs(fits[name].mean - play))
            drawn = "no play is drawn" if play == 0 else f"play {1e6 * play:.4g} µm on the diameter"
            span = f"{1e6 * fits[name].minimum:.4g} to {1e6 * fits[name].maximum:.4g} µm"
            pair.comments.append(f"{drawn}; nearest usual fit: {1e3 * size:.6g} mm {name}, {span}")
        except MechanismError:
            pair.comments.append("no ISO fit for its size")
    pair.comments += [comment] if comment else []
    return pair
