"""A planar model as it is drawn: its plain data, which may be unfinished, and where its points are shown.

Gestures of the hand become changes of the numbers of the file: what is dragged follows the pointer, its neighbours
keep their places, and lengths follow.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from math import atan2, copysign, cos, dist, floor, hypot, isfinite, log10, sin, sqrt
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from trunnion.errors import Finding, MechanismError
from trunnion.model.fields import FIXED_NAMES
from trunnion.model.parameters import Numbers
from trunnion.model.units import unit

__all__ = ["TOGETHER", "Change", "Frame", "Sketch", "length_unit"]

Vector = tuple[float, float]
Entries = dict[str, Any]

TOGETHER = 1e-9  # of the size: joints nearer than this lie on one spot
SHORT = 1e-5  # of the size: a link that a hand made so short was to have no length
FIGURES = 9
LENGTH = re.compile(r"[\d.]\s*(mm|cm|µm|um|m|in|ft)\b")
LIMITS = re.compile(r"\s*(?:±|\+/-|\+-|\s[+-]\S.*/).*$")
NAME = re.compile(r"\s*(-?)\s*([^\W\d]\w*)\s*")


class Frame(NamedTuple):
    """A frame of a link in the plane: its origin, m, and the direction of its x."""

    x: float
    y: float
    c: float
    s: float

    def out(self, local: Vector) -> Vector:
        """Where a point of the link is."""
        return self.x + self.c * local[0] - self.s * local[1], self.y + self.s * local[0] + self.c * local[1]

    def into(self, place: Vector) -> Vector:
        """A place in coordinates of the link."""
        x, y = place[0] - self.x, place[1] - self.y
        return self.c * x + self.s * y, -self.s * x + self.c * y


GROUND = Frame(0.0, 0.0, 1.0, 0.0)


class Change(NamedTuple):
    """A number to be changed: a path such as `dimensions.AB`, where it stands in the entries, and its value, m."""

    path: str
    location: tuple[str | int, ...]
    value: float


@dataclass
class Sketch:
    """entries: plain data of the model, changed in place; places: of "link.point" in the plane, m, as shown.

    made: section and name of what a gesture made whose numbers are to be looked at.
    turns: in space, rotation of every link, (3, 3), at a position of the cycle.
    fine: what the hand can tell apart in the picture, m: lengths are rounded to a power of ten below it.
    """

    entries: Entries
    places: dict[str, Vector] = field(default_factory=dict)
    made: tuple[str, str] | None = None
    fine: float = 0.0
    turns: Callable[[int], Mapping[str, Any]] = lambda _: {}

    # ---- what is there ----------------------------------------------------------------------------------------

    def section(self, name: str) -> Entries:
        """A group of entries, made if it is missing."""
        entries = self.entries.setdefault(name, {})
        if not isinstance(entries, dict):
            raise MechanismError(Finding("is not a group of entries", name, "correct it in the text of the model"))
        return entries

    def of(self, section: str) -> Mapping[str, Any]:
        """The groups of a section, as far as it is sound."""
        entries = self.entries.get(section)
        sound = entries.items() if isinstance(entries, dict) else ()
        return {name: item for name, item in sound if isinstance(item, dict)}

    @property
    def ground(self) -> str:
        """The fixed link."""
        links = {*self.of("links"), *(row.get("link") for row in self.rows)}
        usual = next((name for name in FIXED_NAMES if name in links), FIXED_NAMES[0])
        return str(self.entries.get("ground") or usual)

    @property
    def joints(self) -> Mapping[str, Any]:
        """Joints with their two links."""
        return {name: item for name, item in self.of("joints").items() if _pair(item.get("links"))}

    def kind(self, joint: str) -> str:
        """The type of a joint, of the table of a loop too; nothing where there is none."""
        joints = self.entries.get("joints")
        joint_entry = (
            joints.get(joint) if isinstance(joints, dict) else None
        )  # not of `joints`: that goes through them all
        sound = joint_entry if isinstance(joint_entry, dict) and _pair(joint_entry.get("links")) else None
        row = next((row for row in self.rows if row.get("joint") == joint), sound)
        return "" if row is None else str(row.get("type", "revolute"))

    @property
    def rows(self) -> list[dict[str, Any]]:
        """The table of a loop in space, each row a joint and the link after it; none of other models."""
        rows = self.entries.get("loop")
        return [row for row in rows if isinstance(row, dict)] if isinstance(rows, list) else []

    def points(self, link: str) -> Mapping[str, Any]:
        """Points of a link, as stated."""
        entry: Any = self.entries
        for key in ("links", link, "points"):  # not of `of`: that goes through all links
            entry = entry.get(key) if isinstance(entry, dict) else None
        return entry if isinstance(entry, dict) else {}

    @cached_property
    def numbers(self) -> Mapping[str, Any]:
        """Every number of the model in SI, by path."""
        try:
            return Numbers(**self.entries).parameter_set.nominal
        except (ValidationError, TypeError, KeyError):  # the last of a name that is no dimension
            what = "has entries that cannot be read"
            raise MechanismError(Finding(what, "the model", "correct what is found in its text first")) from None

    def vector(self, path: str, axes: str = "xy") -> list[float]:
        """Components of a point or a direction by the path of both, SI; 0 where none is stated."""
        return [float(self.numbers.get(f"{path}.{axis}", 0.0)) for axis in axes]

    def local(self, link: str, point: str) -> Vector:
        """A point in the frame of its link, m."""
        x, y = self.vector(f"links.{link}.points.{point}")
        return (x, y) if isfinite(x) and isfinite(y) else (0.0, 0.0)

    def links_at(self, name: str) -> tuple[list[str], str]:
        """Links of a joint, or of a free point "link.P", and the name of their point there."""
        if name in self.joints:
            return list(self.joints[name]["links"]), name
        link, _, point = name.partition(".")
        return [link], point

    @cached_property
    def size(self) -> float:
        """The extent of what is shown, m."""
        spots = list(self.places.values()) or [(0.0, 0.0)]
        return max(*(max(spot[i] for spot in spots) - min(spot[i] for spot in spots) for i in (0, 1)), 1e-12)

    def frame(self, link: str) -> Frame:
        """The frame of a link that fits its points best to where they are shown."""
        if link == self.ground:
            return GROUND
        placed = [point for point in self.points(link) if f"{link}.{point}" in self.places]
        if not placed:
            return GROUND
        local = np.array([complex(*self.local(link, point)) for point in placed])
        places = np.array([complex(*self.places[f"{link}.{point}"]) for point in placed])
        turn = np.sum((local - local.mean()).conj() * (places - places.mean()))
        turn = turn / abs(turn) if turn else 1.0 + 0.0j
        origin = places.mean() - turn * local.mean()
        return Frame(*map(float, (origin.real, origin.imag, turn.real, turn.imag)))

    def show(self, link: str, frame: Frame) -> None:
        """Show the points of a link where its frame has them."""
        for point in self.points(link):
            self.places[f"{link}.{point}"] = frame.out(self.local(link, point))

    def forget(self) -> None:
        """The entries have changed: read the numbers anew."""
        self.__dict__.pop("numbers", None)
        self.__dict__.pop("size", None)

    def shifted(self, point: str, by: Sequence[float], turns: Mapping[str, Any]) -> list[Change]:
        """What changes in space where a joint, or a free point "link.point", goes by metres along the global axes.

        turns: rotation of each moving link, (3, 3), at the position at which the neighbours keep their places.
        """
        links, name = self.links_at(point)
        if any(name not in self.points(link) for link in links):
            what, remedy = "has no place of its own in the file", "change the table of the loop"
            raise MechanismError(Finding(what, point, remedy))
        changes: dict[str, Change] = {}  # a number once
        for link in links:
            columns = turns[link].T if link != self.ground else np.eye(3)
            ends = {point: np.array(self.vector(f"links.{link}.points.{point}", "xyz")) for point in self.points(link)}
            local = ends[name] + columns @ np.asarray(by, float)
            moved_to = self._at(link, name, local)
            near, *far = sorted(ends, key=lambda point: float(np.abs(ends[point]).sum()))
            plain = all(isinstance(entry, list) for entry in self.points(link).values())
            if plain and len(far) == 1 and not ends[near].any() and ends[far[0]][0] > 0 and not ends[far[0]][1:].any():
                # a rod with two balls, from its origin along its x: so it stays, for it is alike about its line
                length = float(np.linalg.norm(local - ends[near if name in far else far[0]]))
                moved_to = self._at(link, far[0], (length, 0.0, 0.0))
            changes |= {change.path: change for change in moved_to}
        return list(changes.values())

    # ---- dragging ---------------------------------------------------------------------------------------------

    def moved(self, point: str, to: Vector, keep: bool = False) -> list[Change]:
        """What changes where a joint, or a free point "link.point", is dragged to a place.

        keep: the links at a pin on the ground keep their lengths.
        """
        joints = self._together(point) if point in self.joints else []
        links, name = self.links_at(point)
        if not joints and name not in self.points(links[0]):
            raise MechanismError(Finding("is not a joint or a point", point, "drag one that is drawn"))
        pins = [joint for joint in joints if self._turns(joint)]
        if keep and any(self.ground in self.joints[pin]["links"] for pin in pins):
            links = [self.ground]
        elif joints:
            links = list(dict.fromkeys(link for joint in joints for link in self.joints[joint]["links"]))
        changes: list[Change] = []
        for link in links:
            mine = [pin for pin in pins if link in self.joints[pin]["links"]] if joints else [name]
            changes += self.followed(link, mine, to)
        return changes

    def followed(self, link: str, moving: list[str], to: Vector) -> Iterator[Change]:
        """What changes of a link some of whose points, or the block that it is, go to a place; its other pins stay.

        A link whose frame begins at one joint and has its x through another keeps that form, unless it has a slot.
        """
        slides = [name for name, item in self.joints.items() if link in item["links"] and not self._turns(name)]
        pins = [name for name in self.points(link) if name in self.joints and self._turns(name)]
        spots = {self.places.get(f"{link}.{name}") for name in (*slides, *pins)}
        if slides and len(spots) == 1 and self.joints[slides[0]]["links"][1] == link and set(moving) <= set(pins):
            yield from self._shifted(slides[0], to)
            return
        local = {point: self.local(link, point) for point in dict.fromkeys([*pins, *moving])}
        old = self.frame(link)
        places = {point: to if point in moving else old.out(local[point]) for point in local}
        self._refuse_together(link, local, places)
        origin = next((point for point in pins if local[point] == (0.0, 0.0)), None)
        ahead = next((point for point in pins if local[point][1] == 0.0 and local[point][0] != 0.0), None)
        slots = [name for name in slides if self.joints[name]["links"][0] == link]
        frame = old
        if link == self.ground:
            origin = ahead = None
        elif slots:
            ahead = None
            pivot = min(pins, key=lambda name: self.ground not in self.joints[name]["links"], default=None)
            frame = self._aimed(link, slots[0], pivot, to) if pivot in moving else old
        elif origin and ahead and {origin, ahead} & set(moving):
            sign = 1.0 if local[ahead][0] > 0 else -1.0
            (x, y), (a, b) = places[origin], places[ahead]
            length = hypot(a - x, b - y)
            frame = Frame(x, y, sign * (a - x) / length, sign * (b - y) / length)
        elif origin in moving:
            frame = old._replace(x=to[0], y=to[1])
        for point in local:
            x, y = (0.0, 0.0) if point == origin and frame is not old else frame.into(places[point])
            yield from self._at(link, point, (x, 0.0) if point == ahead and frame is not old else (x, y))

    def _turns(self, joint: str) -> bool:
        return self.kind(joint) == "revolute"

    def _together(self, joint: str) -> list[str]:
        """The joints on the spot of a joint that are connected with it by links."""
        together, links = [joint], set(self.joints[joint]["links"])
        spot = self.places.get(f"{self.joints[joint]['links'][1]}.{joint}")
        for name, item in self.joints.items():
            other = self.places.get(f"{item['links'][1]}.{name}")
            near = spot and other and hypot(spot[0] - other[0], spot[1] - other[1]) <= TOGETHER * self.size
            if name != joint and near and links & set(item["links"]):
                together.append(name)
                links |= set(item["links"])
        return together

    def _shifted(self, joint: str, to: Vector) -> Iterator[Change]:
        """The guide of a block, if it stands on the ground, shifted across to where its block is dragged."""
        first, second = self.joints[joint]["links"]
        if first != self.ground:
            return
        x, y = self.vector(f"links.{first}.points.{joint}.axis")
        norm = hypot(x, y) or 1.0
        before, base = self.places[f"{second}.{joint}"], self.local(first, joint)
        across = ((to[1] - before[1]) * x - (to[0] - before[0]) * y) / norm
        yield from self._at(first, joint, (base[0] - across * y / norm, base[1] + across * x / norm))

    def _refuse_together(self, link: str, local: Mapping[str, Vector], places: Mapping[str, Vector]) -> None:
        """Refuse to bring points of a moving link together that are apart."""
        for first, two in combinations(local if link != self.ground else (), 2):
            before, after = (dist(spots[first], spots[two]) for spots in (local, places))
            if after <= SHORT * self.size < before:
                what = f"would have no length: {first} would lie on {two}"
                raise MechanismError(Finding(what, f"links.{link}", "keep them apart"))

    def _aimed(self, link: str, slot: str, pivot: str, to: Vector) -> Frame:
        """The frame of a link whose pivot goes to a place and whose slot is led over its block.

        The slot passes the pivot at the distance e at which it lies in the link, the pivot being e to the left: with
        d from the pivot to the block, the block is √(d² − e²) along the slot, on the side where it was.
        """
        here = self.places[f"{self.joints[slot]['links'][1]}.{slot}"]
        (x, y), (a, b) = self.local(link, pivot), self.local(link, slot)
        c, s = self.vector(f"links.{link}.points.{slot}.axis")
        turn, (u, v) = atan2(s, c), self.frame(link).into(here)
        offset = cos(turn) * (y - b) - sin(turn) * (x - a)
        far = dist(to, here)
        if far <= abs(offset) + SHORT * self.size:
            raise MechanismError(Finding("would not reach its block", f"links.{link}", "keep them apart"))
        along = copysign(sqrt(far**2 - offset**2), cos(turn) * (u - x) + sin(turn) * (v - y))
        angle = atan2(here[1] - to[1], here[0] - to[0]) - atan2(-offset, along) - turn
        turned = Frame(0.0, 0.0, cos(angle), sin(angle))
        p, q = turned.out((x, y))
        return turned._replace(x=to[0] - p, y=to[1] - q)

    def _at(self, link: str, point: str, local: Sequence[float]) -> Iterator[Change]:
        """The numbers to be changed so that a point has these coordinates: dimensions, where they are stated so."""
        entry = self.points(link)[point]
        where: tuple[str | int, ...] = ("links", link, "points", point, *(("at",) if isinstance(entry, dict) else ()))
        parts = entry["at"] if isinstance(entry, dict) else entry
        numbers = self.vector(f"links.{link}.points.{point}", "xyz")
        for i, (axis, before, value) in enumerate(zip("xyz", numbers, local, strict=False)):
            if abs(value - before) <= TOGETHER * self.size:
                continue
            name = NAME.fullmatch(parts[i]) if isinstance(parts[i], str) else None
            if name and name[2] in self.section("dimensions"):
                sign = -1.0 if name[1] else 1.0
                yield Change(f"dimensions.{name[2]}", ("dimensions", name[2]), sign * value)
            else:
                yield Change(f"links.{link}.points.{point}.{axis}", (*where, i), value)

    # ---- writing ----------------------------------------------------------------------------------------------

    @cached_property
    def unit(self) -> str:
        """The unit that lengths are written in: that of the model, or one that suits its size."""
        suiting = "mm" if len(self.places) < 2 or 1e-4 <= self.size <= 10.0 else "m" if self.size > 1.0 else "µm"
        return length_unit(self.entries) or suiting

    def length(self, value: float) -> str:
        """A length as it is written: no finer than it was drawn, but one that is much smaller keeps three figures."""
        factor = float(unit(self.unit)[0])
        fine = min(self.fine, abs(value) / 100.0) if abs(value) > SHORT * self.size else self.fine
        places = min(-floor(log10(fine / factor)), 6) if fine > 0.0 else 6
        return f"{round(value / factor, places) + 0.0:.{FIGURES}g} {self.unit}"

    def write(self, changes: list[Change]) -> None:
        """Put changed lengths into the entries; a tolerance that is stated stays."""
        for _, location, value in changes:
            *parents, last = location
            group: Any = self.entries
            for key in parents:
                group = group[key]
            limits = LIMITS.search(group[last]) if isinstance(group[last], str) else None
            group[last] = self.length(value) + (limits[0] if limits else "")
        self.forget()


def _pair(links: Any) -> bool:
    return isinstance(links, list) and len(links) == 2 and all(isinstance(link, str) for link in links)


def length_unit(entries: Entries) -> str:
    """The unit of lengths that a model states most often; nothing if it states none."""
    texts = str([entries.get("dimensions"), entries.get("links")])
    units = LENGTH.findall(texts)
    return max(set(units), key=units.count) if units else ""
