"""A planar model as it is drawn: its plain data, which may be unfinished, and where its points are shown.

Gestures of the hand become changes of the numbers of the file: what is dragged follows the pointer, its neighbours
keep their places, and lengths follow. Places and directions in the plane are complex numbers, m.
"""

from __future__ import annotations

import re
from cmath import isfinite
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from math import copysign, floor, log10, sqrt
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from trunnion.errors import Finding, MechanismError
from trunnion.model.fields import FIXED_NAMES
from trunnion.model.parameters import Numbers
from trunnion.model.units import unit

Entries = dict[str, Any]

TOGETHER = 1e-9  # of the size: joints nearer than this lie on one spot
SHORT = 1e-5  # of the size: a link that a hand made so short was to have no length
FIGURES = 9
LENGTH = re.compile(r"[\d.]\s*(mm|cm|µm|um|m|in|ft)\b")
LIMITS = re.compile(r"\s*(?:±|\+/-|\+-|\s[+-]\S.*/).*$")
NAME = re.compile(r"\s*(-?)\s*([^\W\d]\w*)\s*")


def refused(what: str, where: str, remedy: str) -> MechanismError:
    """The error of a gesture that cannot be done."""
    return MechanismError(Finding(what, where, remedy))


def coordinates(entry: Any) -> Any:
    """The coordinates of a point in the file, beside which an axis may stand."""
    return entry["at"] if isinstance(entry, dict) else entry


class Frame(NamedTuple):
    """A frame of a link in the plane: its origin, m, and the direction of its x, of length 1."""

    origin: complex
    turn: complex

    def out(self, local: complex) -> complex:
        """Where a point of the link is."""
        return self.origin + self.turn * local

    def into(self, place: complex) -> complex:
        """A place in coordinates of the link."""
        return self.turn.conjugate() * (place - self.origin)


GROUND = Frame(0j, 1 + 0j)


@dataclass
class Sketch:
    """entries: plain data of the model, changed in place; places: of "link.point" in the plane, m, as shown.

    made: section and name of what a gesture made whose numbers are to be looked at.
    turns: in space, rotation of every link, (3, 3), at a position of the cycle.
    fine: what the hand can tell apart in the picture, m: lengths are rounded to a power of ten below it.
    """

    entries: Entries
    places: dict[str, complex] = field(default_factory=dict)
    made: tuple[str, str] | None = None
    fine: float = 0.0
    turns: Callable[[int], Mapping[str, Any]] = lambda _: {}

    # ---- what is there ----------------------------------------------------------------------------------------

    def section(self, name: str) -> Entries:
        """A group of entries to be changed, made if it is missing: what was read of the entries is read anew."""
        self.forget()
        entries = self.entries.setdefault(name, {})
        if not isinstance(entries, dict):
            raise refused("is not a group of entries", name, "correct it in the text of the model")
        return entries

    def begin(self) -> None:
        """The fixed link is there."""
        self.section("links").setdefault(self.ground, {"points": {}}).setdefault("points", {})
        self.section("joints")

    def forget(self) -> None:
        """The entries have changed: read them anew."""
        for name in ("numbers", "size", "joints"):
            self.__dict__.pop(name, None)

    def names(self, section: str) -> set[str]:
        """Names of the entries of a section."""
        entries = self.entries.get(section)
        return set(entries) if isinstance(entries, dict) else set()

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

    @cached_property
    def joints(self) -> Mapping[str, Any]:
        """Joints with their two links."""
        return {
            name: item for name, item in self.of("joints").items()
            if isinstance(links := item.get("links"), list) and [type(link) for link in links] == [str, str]
        }  # fmt: skip

    def kind(self, joint: str) -> str:
        """The type of a joint, of the table of a loop too; nothing where there is none."""
        entry = next((row for row in self.rows if row.get("joint") == joint), self.joints.get(joint))
        return "" if entry is None else str(entry.get("type", "revolute"))

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
            raise refused(what, "the model", "correct what is found in its text first") from None

    def vector(self, path: str, axes: str = "xy") -> list[float]:
        """Components of a point or a direction by the path of both, SI; 0 where none is stated."""
        return [float(self.numbers.get(f"{path}.{axis}", 0.0)) for axis in axes]

    def local(self, link: str, point: str) -> complex:
        """A point in the frame of its link, m."""
        local = complex(*self.vector(f"links.{link}.points.{point}"))
        return local if isfinite(local) else 0j

    def links_at(self, name: str) -> tuple[list[str], str]:
        """Links of a joint, or of a free point "link.P", and the name of their point there."""
        if name in self.joints:
            return list(self.joints[name]["links"]), name
        link, _, point = name.partition(".")
        return [link], point

    @cached_property
    def size(self) -> float:
        """The extent of what is shown, m."""
        spots = np.array([*self.places.values()] or [0j])
        return float(max(np.ptp(spots.real), np.ptp(spots.imag), 1e-12))

    def frame(self, link: str) -> Frame:
        """The frame of a link that fits its points best to where they are shown."""
        placed = [point for point in self.points(link) if f"{link}.{point}" in self.places]
        if link == self.ground or not placed:
            return GROUND
        local = np.array([self.local(link, point) for point in placed])
        places = np.array([self.places[f"{link}.{point}"] for point in placed])
        turn = np.sum((local - local.mean()).conj() * (places - places.mean()))
        turn = turn / abs(turn) if turn else 1.0 + 0.0j
        return Frame(complex(places.mean() - turn * local.mean()), complex(turn))

    def show(self, link: str, frame: Frame) -> None:
        """Show the points of a link where its frame has them."""
        for point in self.points(link):
            self.places[f"{link}.{point}"] = frame.out(self.local(link, point))

    # ---- dragging: numbers that change, m, by their paths such as `dimensions.AB` ---------------------------------

    def shifted(self, point: str, by: Sequence[float], turns: Mapping[str, Any]) -> dict[str, float]:
        """What changes in space where a joint, or a free point "link.point", goes by metres along the global axes.

        turns: rotation of each moving link, (3, 3), at the position at which the neighbours keep their places.
        """
        links, name = self.links_at(point)
        if any(name not in self.points(link) for link in links):
            raise refused("has no place of its own in the file", point, "change the table of the loop")
        changes: dict[str, float] = {}
        for link in links:
            columns = turns[link].T if link != self.ground else np.eye(3)
            ends = {point: np.array(self.vector(f"links.{link}.points.{point}", "xyz")) for point in self.points(link)}
            local = ends[name] + columns @ np.asarray(by, float)
            changed = self._at(link, name, local)
            near, *far = sorted(ends, key=lambda point: float(np.abs(ends[point]).sum()))
            plain = all(isinstance(entry, list) for entry in self.points(link).values())
            if plain and len(far) == 1 and not ends[near].any() and ends[far[0]][0] > 0 and not ends[far[0]][1:].any():
                # a rod with two balls, from its origin along its x: so it stays, for it is alike about its line
                length = float(np.linalg.norm(local - ends[near if name in far else far[0]]))
                changed = self._at(link, far[0], (length, 0.0, 0.0))
            changes |= changed
        return changes

    def moved(self, point: str, to: complex, keep: bool = False) -> dict[str, float]:
        """What changes where a joint, or a free point "link.point", is dragged to a place.

        keep: the links at a pin on the ground keep their lengths.
        """
        joints = self._together(point) if point in self.joints else []
        links, name = self.links_at(point)
        if not joints and name not in self.points(links[0]):
            raise refused("is not a joint or a point", point, "drag one that is drawn")
        pins = [joint for joint in joints if self.kind(joint) == "revolute"]
        if keep and any(self.ground in self.joints[pin]["links"] for pin in pins):
            links = [self.ground]
        elif joints:
            links = list(dict.fromkeys(link for joint in joints for link in self.joints[joint]["links"]))
        changes: dict[str, float] = {}
        for link in links:
            moving = [pin for pin in pins if link in self.joints[pin]["links"]] if joints else [name]
            changes |= self.followed(link, moving, to)
        return changes

    def followed(self, link: str, moving: list[str], to: complex) -> dict[str, float]:
        """What changes of a link some of whose points, or the block that it is, go to a place; its other pins stay.

        A link whose frame begins at one joint and has its x through another keeps that form, unless it has a slot.
        """
        kinds = {name: self.kind(name) for name, item in self.joints.items() if link in item["links"]}
        slides = [name for name, kind in kinds.items() if kind != "revolute"]
        pins = [name for name in self.points(link) if kinds.get(name) == "revolute"]
        spots = {self.places.get(f"{link}.{name}") for name in (*slides, *pins)}
        if slides and len(spots) == 1 and self.joints[slides[0]]["links"][1] == link and set(moving) <= set(pins):
            return self._across_guide(slides[0], to)
        local = {point: self.local(link, point) for point in dict.fromkeys([*pins, *moving])}
        frame = old = self.frame(link)
        places = {point: to if point in moving else old.out(local[point]) for point in local}
        for first, second in combinations(local if link != self.ground else (), 2):
            if abs(places[first] - places[second]) <= SHORT * self.size < abs(local[first] - local[second]):
                what = f"would have no length: {first} would lie on {second}"
                raise refused(what, f"links.{link}", "keep them apart")
        origin = next((point for point in pins if local[point] == 0), None)
        ahead = next((point for point in pins if local[point].imag == 0 and local[point] != 0), None)
        slots = [name for name in slides if self.joints[name]["links"][0] == link]
        if link == self.ground:
            origin = ahead = None
        elif slots:
            ahead = None
            pivot = min(pins, key=lambda name: self.ground not in self.joints[name]["links"], default=None)
            frame = self._aimed(link, slots[0], pivot, to) if pivot in moving else old
        elif origin and ahead and {origin, ahead} & set(moving):
            direction = places[ahead] - places[origin]
            frame = Frame(places[origin], copysign(1.0, local[ahead].real) * direction / abs(direction))
        elif origin in moving:
            frame = old._replace(origin=to)
        changes: dict[str, float] = {}
        for point, place in places.items():
            at = 0j if point == origin and frame is not old else frame.into(place)
            changes |= self._at(link, point, (at.real, 0.0 if point == ahead and frame is not old else at.imag))
        return changes

    def _together(self, joint: str) -> list[str]:
        """The joints on the spot of a joint that are connected with it by links."""
        together, links = [joint], set(self.joints[joint]["links"])
        spot, near = self.places.get(f"{self.joints[joint]['links'][1]}.{joint}"), TOGETHER * self.size
        for name, item in self.joints.items():
            other = self.places.get(f"{item['links'][1]}.{name}")
            on_spot = spot is not None and other is not None and abs(spot - other) <= near
            if name != joint and on_spot and links & set(item["links"]):
                together.append(name)
                links |= set(item["links"])
        return together

    def _across_guide(self, joint: str, to: complex) -> dict[str, float]:
        """The guide of a block, if it stands on the ground, shifted across to where its block is dragged."""
        first, second = self.joints[joint]["links"]
        if first != self.ground:
            return {}
        axis = complex(*self.vector(f"links.{first}.points.{joint}.axis"))
        axis /= abs(axis) or 1.0
        across = ((to - self.places[f"{second}.{joint}"]) * axis.conjugate()).imag
        base = self.local(first, joint) + 1j * axis * across
        return self._at(first, joint, (base.real, base.imag))

    def _aimed(self, link: str, slot: str, pivot: str, to: complex) -> Frame:
        """The frame of a link whose pivot goes to a place and whose slot is led over its block.

        The slot passes the pivot at the distance e at which it lies in the link, the pivot being e to the left: with
        d from the pivot to the block, the block is √(d² − e²) along the slot, on the side where it was.
        """
        block = self.places[f"{self.joints[slot]['links'][1]}.{slot}"]
        local, axis = self.local(link, pivot), complex(*self.vector(f"links.{link}.points.{slot}.axis")) or 1 + 0j
        axis /= abs(axis)
        offset, far = ((local - self.local(link, slot)) * axis.conjugate()).imag, abs(to - block)
        if far <= abs(offset) + SHORT * self.size:
            raise refused("would not reach its block", f"links.{link}", "keep them apart")
        side = ((self.frame(link).into(block) - local) * axis.conjugate()).real
        turn = (block - to) / (complex(copysign(sqrt(far**2 - offset**2), side), -offset) * axis)
        return Frame(to - turn * local, turn)

    def _at(self, link: str, point: str, local: Sequence[float]) -> dict[str, float]:
        """The numbers to be changed so that a point has these coordinates: dimensions, where they are stated so."""
        parts, path = coordinates(self.points(link)[point]), f"links.{link}.points.{point}"
        dimensions, changes = self.entries.get("dimensions") or {}, dict[str, float]()
        for part, axis, before, value in zip(parts, "xyz", self.vector(path, "xyz"), local, strict=False):
            if abs(value - before) <= TOGETHER * self.size:
                continue
            name = NAME.fullmatch(part) if isinstance(part, str) else None
            if name and name[2] in dimensions:
                changes[f"dimensions.{name[2]}"] = -value if name[1] else value
            else:
                changes[f"{path}.{axis}"] = value
        return changes

    # ---- writing ----------------------------------------------------------------------------------------------

    @cached_property
    def unit(self) -> str:
        """The unit that lengths are written in: that most often in the model, or one that suits its size."""
        units = LENGTH.findall(str([self.entries.get("dimensions"), self.entries.get("links")]))
        suiting = "mm" if len(self.places) < 2 or 1e-4 <= self.size <= 10.0 else "m" if self.size > 1.0 else "µm"
        return max(units, key=units.count) if units else suiting

    def length(self, value: float) -> str:
        """A length as it is written: no finer than it was drawn, but one that is much smaller keeps three figures."""
        factor = float(unit(self.unit)[0])
        fine = min(self.fine, abs(value) / 100.0) if abs(value) > SHORT * self.size else self.fine
        places = min(-floor(log10(fine / factor)), 6) if fine > 0.0 else 6
        return f"{round(value / factor, places) + 0.0:.{FIGURES}g} {self.unit}"

    def place(self, place: complex) -> list[str]:
        """A place as it is written."""
        return [self.length(place.real), self.length(place.imag)]

    def write(self, changes: Mapping[str, float]) -> None:
        """Put changed lengths into the entries; a tolerance that is stated stays."""
        for path, value in changes.items():
            section, name, *inner = path.split(".")
            group: Any = self.entries[section]
            key: Any = name  # of a dimension
            if inner:  # points, the point and its axis
                group, key = coordinates(self.points(name)[inner[1]]), "xyz".index(inner[2])
            limits = LIMITS.search(group[key]) if isinstance(group[key], str) else None
            group[key] = self.length(value) + (limits[0] if limits else "")
        self.forget()
