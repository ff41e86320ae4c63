"""Several links at once: shifted, mirrored, copied, deleted, with the joints, loads, springs and gears between them.

All goes through one map of the plane, p' = (sx x + a, sy y + b) with signs sx, sy. A mirrored link keeps its frame at
its own points: its y changes sign, and the rotation of a joint on the ground, which was q, becomes π − q or −q.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import degrees, pi
from typing import Any

from trunnion.model.expression import parse
from trunnion.model.units import unit
from trunnion.studio.changing import delete
from trunnion.studio.ends import letter, numbered, refused, vector
from trunnion.studio.renaming import renamed
from trunnion.studio.sketch import Sketch, Vector

__all__ = ["group"]

Given = Mapping[str, Any]
LITERAL = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([^\W\d]*|°)\s*")
ALONE = re.compile(rf"{LITERAL.pattern}|\s*[^\W\d]\w*\s*")  # a number or a name
AS_IT_IS = (
    "law", "period", "phase", "duration", "return_duration", "dwell", "returns", "delay", "periodic", "ends", "moves"
)  # fmt: skip
MIRRORED = (1, -1)  # what is stated in the frame of a link, which keeps its x
OPPOSITE = ("speed", "amplitude")
TURNED = ("start", "mean", "range", "points")  # angles of the joint


def group(sketch: Sketch, given: Given) -> str:
    """Links are changed together, `what`: "shift" by `by`, m; "mirror" over a line through `at`, upright or `level`;
    "copy", which is shifted by `by` or, with `at`, mirrored; "delete". start: whether the sketch has the places of the
    start, by which a mirrored mechanism without hints is assembled.
    """
    links, what = list(dict.fromkeys(str(one) for one in given["links"])), str(given["what"])
    if not links or any(one not in sketch.of("links") or one == sketch.ground for one in links):
        raise refused("is no link that moves", ", ".join(links), "choose links that are drawn")
    if sketch.entries.get("space") == "spatial":
        raise refused("is of a mechanism in space", ", ".join(links), "change it in the table or the text")
    title = links[0] if len(links) == 1 else f"{len(links)} links"
    if what == "delete":
        for one in links:
            if one in sketch.of("links"):  # a block goes with what it slides on
                delete(sketch, {"what": ["links", one]})
        return f"Delete {title}"
    if what == "copy":
        links = _copied(sketch, links)
        sketch.made = ("group", " ".join(links))
    if given.get("at") is None:
        by = vector(given["by"])
        _Moving(sketch, links, (1, 1), by).do()
    else:
        x, y = vector(given["at"])
        signs, offset = ((1, -1), (0.0, 2 * y)) if given.get("level") else ((-1, 1), (2 * x, 0.0))
        _Moving(sketch, links, signs, offset).do()
        if given.get("start"):
            _assembled(sketch, links)
    return f"{ {'shift': 'Move', 'mirror': 'Mirror'}.get(what, 'Copy') } {title}"


@dataclass
class _Moving:
    """A map of the plane for some links."""

    sketch: Sketch
    links: list[str]
    signs: tuple[int, int]
    offset: Vector

    def do(self) -> None:
        """Change what the file states of them."""
        sketch, ground = self.sketch, self.sketch.ground
        mine = {name: one for name, one in sketch.joints.items() if set(one["links"]) & set(self.links)}
        outside = [name for name, one in mine.items() if not set(one["links"]) <= {*self.links, ground}]
        if held := [name for name in mine if name in sketch.locked]:
            raise refused("is locked where it is", ", ".join(held), "unlock it first (K)")
        if self.signs != (1, 1):
            self._refuse(mine, outside)
            self._flip(mine)
            self._flip_acting(mine)
        for name in outside:
            if not self._turns(name):
                raise refused("slides along a link that is not chosen", f"joints.{name}", "choose both links")
        pinned = {name for name, one in mine.items() if ground in one["links"]} | _fastened(sketch, self.links)
        fixed = sketch.points(ground)
        for point in pinned & set(fixed):
            stated = fixed[point]
            if not isinstance(stated.get("at") if isinstance(stated, dict) else stated, list):
                raise refused("is not stated by x and y", f"links.{ground}.points.{point}", "write it so")
            sketch.section("links")[ground]["points"][point] = self._placed(stated)
        hints = sketch.section("assembly")
        for name in mine:
            if isinstance(hints.get(name), list):
                hints[name] = self._placed(hints[name])
            elif hints.get(name) is not None and self.signs != (1, 1) and self._turns(name):
                hints[name] = self._angle(name, hints[name])
        moving = {f"{link}.{point}" for link in self.links for point in sketch.points(link)}
        for key in (moving | {f"{ground}.{point}" for point in pinned}) & set(sketch.places):
            x, y = sketch.places[key]
            sketch.places[key] = (self.signs[0] * x + self.offset[0], self.signs[1] * y + self.offset[1])
        sketch.forget()
        for name in outside:
            self._follow(name)

    def _follow(self, joint: str) -> None:
        """The link outside follows with its end; its other joints stay."""
        sketch = self.sketch
        pair = sketch.joints[joint]["links"]
        inside, other = pair if pair[0] in self.links else reversed(pair)
        sketch.write(list(sketch.followed(other, [joint], sketch.places[f"{inside}.{joint}"])))
        sketch.places[f"{other}.{joint}"] = sketch.places[f"{inside}.{joint}"]
        sketch.show(other, sketch.frame(other))

    def _placed(self, stated: Any) -> Any:
        return _mapped(stated, self.signs, self.offset, self.sketch.unit)

    # ---- mirrored --------------------------------------------------------------------------------------------

    def _turns(self, joint: str) -> bool:
        return self.sketch.kind(joint) == "revolute"

    def _half(self, joint: str) -> float:
        """What the rotation q of a joint is taken from when it is mirrored, rad: q' = half − q."""
        if self.signs[0] > 0 or self.sketch.ground not in self.sketch.joints[joint]["links"]:
            return 0.0
        return pi if self.sketch.joints[joint]["links"][0] == self.sketch.ground else -pi

    def _angle(self, joint: str, stated: Any) -> Any:
        return _plus(_minus(stated), self._half(joint), "deg")

    def _refuse(self, joints: Mapping[str, Any], outside: list[str]) -> None:
        """What would not be mirrored with the drawing."""
        sketch = self.sketch
        if "at" in sketch.section("assembly"):
            raise refused("says where the driver is", "assembly.at", "mirror it in the text")
        if outside:
            what = "is at a link that is not chosen, which would be bent"
            raise refused(what, ", ".join(f"joints.{name}" for name in outside), "choose the links up to the ground")
        for name, one in joints.items():
            if set(one) & {"seat", "seat_on", "misalignment"}:
                raise refused("has a seat, which is not mirrored", f"joints.{name}", "mirror it in the text")
            rubs = one.get("friction", (sketch.entries.get("joint_defaults") or {}).get("friction"))
            if isinstance(rubs, Mapping) and "backward" in rubs:
                raise refused(
                    "has friction by direction, which is not mirrored", f"joints.{name}", "mirror it in the text"
                )
            hint = (sketch.entries.get("assembly") or {}).get(name)
            if isinstance(hint, str) and not LITERAL.fullmatch(hint):
                raise refused(f"is assembled by '{hint}'", f"joints.{name}", "state where it is at the start")
        self._refuse_said({*self.links, *joints})
        for section in ("drivers", "gears", "springs", "loads"):
            for name, one in sketch.of(section).items():
                meant = [name] if section == "drivers" else [one.get("joint"), *one.get("joints", ())]
                if set(meant) & set(outside) or 0 < len(set(meant) & set(joints)) < len({*meant} - {None}):
                    raise refused("is at a link that is not chosen", f"{section}.{name}", "choose that link too")

    def _refuse_said(self, names: set[str]) -> None:
        """Limits that differ, and measures, of what is mirrored: they would be of another side or place."""
        for section in ("tolerances", "measures", "errors"):
            for name, one in (self.sketch.entries.get(section) or {}).items():
                even = section == "tolerances" and "±" in str(one)
                if not even and names & set(re.findall(r"\w+", f"{name} {one}")):
                    raise refused("names what is mirrored", f"{section}.{name}", "mirror it in the text")

    def _flip(self, joints: Mapping[str, Any]) -> None:
        """Frames of links, drivers and what acts, as a mirror shows them."""
        sketch = self.sketch
        for link in self.links:
            entry = sketch.section("links")[link]
            for point, one in sketch.points(link).items():
                entry["points"][point] = _mapped(one, MIRRORED)
            if "centre" in entry:
                entry["centre"] = _mapped(entry["centre"], MIRRORED)
        for name in joints:
            if name in sketch.of("drivers") and self._turns(name):
                self._driver(name, sketch.section("drivers")[name])

    def _flip_acting(self, joints: Mapping[str, Any]) -> None:
        """Gears, springs and loads."""
        sketch = self.sketch
        for name, gear in sketch.of("gears").items():
            if set(gear["joints"]) <= set(joints):
                self._gear(name, gear)
        for name, spring in sketch.of("springs").items():
            if spring.get("joint") in joints and self._turns(spring["joint"]):
                if "preload" in spring or "only" in spring:
                    raise refused("has a preload or acts one way", f"springs.{name}", "mirror it in the text")
                spring["free_angle"] = self._angle(spring["joint"], spring.get("free_angle", 0))
        for name, load in sketch.of("loads").items():
            if load.get("link") in self.links or load.get("joint") in joints:
                _still(sketch, name, load)
                if "force" in load:
                    load["force"] = _mapped(load["force"], MIRRORED if load.get("frame") == "link" else self.signs)
                if "moment" in load:
                    load["moment"] = _minus(load["moment"])
                if "only" in load and load.get("joint") and self._turns(load["joint"]):
                    load["only"] = {"positive": "negative", "negative": "positive"}[load["only"]]

    def _driver(self, name: str, driver: dict[str, Any]) -> None:
        if strange := [key for key in driver if key not in (*AS_IT_IS, *OPPOSITE, *TURNED)]:
            raise refused(f"has a {strange[0]}, which is not mirrored", f"drivers.{name}", "mirror it in the text")
        first = {"constant": "start", "harmonic": "mean"}.get(driver.get("law", "constant"))
        if first and "range" not in driver:
            driver.setdefault(first, 0)
        for key in set(driver) & set(OPPOSITE):
            driver[key] = _minus(driver[key])
        if "range" in driver:
            driver["range"] = [self._angle(name, end) for end in driver["range"]]
        if "points" in driver:
            driver["points"] = [[time, self._angle(name, angle)] for time, angle in driver["points"]]
        for key in {"start", "mean"} & set(driver):
            driver[key] = self._angle(name, driver[key])
            if driver[key] in (0, "0 deg"):
                del driver[key]

    def _gear(self, name: str, gear: dict[str, Any]) -> None:
        """φ' = half₂ − r half₁ − φ, from q₂ = r q₁ + φ."""
        if "ratio" not in gear:
            raise refused("has a joint that slides, which is not mirrored", f"gears.{name}", "mirror it in the text")
        one, two = gear["joints"]
        ratio, phase = (float(self.sketch.numbers[f"gears.{name}.{key}"]) for key in ("ratio", "phase"))
        turned = degrees(self._half(two) - ratio * self._half(one) - phase) % 360.0
        gear["phase"] = f"{turned:.15g} deg"


def _mapped(stated: Any, signs: tuple[int, int], offset: Vector = (0.0, 0.0), usual: str = "") -> Any:
    """A place or a direction of the file, or a point with its axis, with other signs and so much more, m."""
    if isinstance(stated, list):
        signed = [part if sign > 0 else _minus(part) for part, sign in zip(stated, signs, strict=True)]
        return [_plus(part, by, usual) for part, by in zip(signed, offset, strict=True)]
    mapped = dict(stated)
    if "at" in stated:
        mapped["at"] = _mapped(stated["at"], signs, offset, usual)
    if "axis" in stated:
        mapped["axis"] = _mapped(stated["axis"], signs)
    if "angle" in stated:  # of a point of a link, whose x stays
        mapped["angle"] = _minus(stated["angle"])
    return mapped


def _assembled(sketch: Sketch, links: list[str]) -> None:
    """Hints of where the joints between some links are at the start: without them the other assembly may be taken."""
    hints = sketch.section("assembly")
    for name, one in sketch.joints.items():
        if (
            set(one["links"]) <= set(links)
            and name not in hints
            and (key := f"{one['links'][1]}.{name}") in sketch.places
        ):
            hints[name] = [sketch.length(part) for part in sketch.places[key]]


def _fastened(sketch: Sketch, links: list[str]) -> set[str]:
    """Points of the ground that springs of some links are fastened to."""
    points = set()
    for spring in sketch.of("springs").values():
        ends = [str(end).partition(".") for end in spring.get("between") or ()]
        if any(end[0] in links for end in ends):
            points |= {point for link, _, point in ends if link == sketch.ground}
    return points


def _still(sketch: Sketch, name: str, load: Mapping[str, Any]) -> None:
    """Refuse a load that follows the motion: its formula speaks of angles or joints as they were."""
    for key in ("force", "moment", "resisting_torque", "resisting_force"):
        stated = load.get(key, ())
        for part in stated if isinstance(stated, (list, tuple)) else [stated]:
            if isinstance(part, str) and set(parse(part.partition("±")[0]).names) - set(sketch.section("dimensions")):
                raise refused("follows the motion by a formula", f"loads.{name}", "copy or mirror it in the text")


# ---- copied ---------------------------------------------------------------------------------------------------


def _copied(sketch: Sketch, links: list[str]) -> list[str]:
    """The links again, on the spot, with what is between them, under names that are free."""
    ground, part = sketch.ground, _between(sketch, links)
    names: dict[str, str] = {}
    for link in links:
        names[link] = _again(sketch, "links", link)
        sketch.section("links")[names[link]] = {"points": {}}  # its name is spoken for
    points: dict[str, str] = {}
    theirs = [point for link in (*links, ground) for point in part["links"][link].get("points", ())]
    for point in dict.fromkeys([*part["joints"], *theirs]):
        points[point] = letter(sketch, points.values())
    places = {
        f"{names.get(link, link)}.{points[point]}": sketch.places[key]
        for link, entry in part["links"].items()
        for point in entry.get("points", ())
        if (key := f"{link}.{point}") in sketch.places
    }
    for section, pairs in (("links", names), ("joints", points)):
        for old, new in pairs.items():
            part = renamed(part, section, old, new)
    if fixed := part["links"].pop(ground)["points"]:
        sketch.section("links")[ground]["points"] |= fixed
    for section, entries in part.items():
        for name, entry in entries.items():
            numbers_its_parts = section in ("loads", "springs", "gears")
            sketch.section(section)[_again(sketch, section, name) if numbers_its_parts else name] = entry
    sketch.places |= places
    sketch.forget()
    return list(names.values())


def _between(sketch: Sketch, links: list[str]) -> dict[str, Any]:
    """What the file states of some links and of what is between them and the ground: a copy."""
    ground = sketch.ground
    inner = {name: one for name, one in sketch.joints.items() if set(one["links"]) <= {*links, ground}}
    if seated := [name for name, one in inner.items() if "seat_on" in one]:
        raise refused("states the link of its seat", f"joints.{seated[0]}.seat_on", "copy it in the text")
    pinned = {*inner, *_fastened(sketch, links)}
    part: dict[str, Any] = {"links": {link: sketch.section("links")[link] for link in links}, "joints": inner}
    part["links"][ground] = {"points": {name: at for name, at in sketch.points(ground).items() if name in pinned}}
    for section in ("drivers", "assembly"):
        part[section] = {name: one for name, one in sketch.section(section).items() if name in inner}
    loads, springs, gears = map(sketch.of, ("loads", "springs", "gears"))
    part["loads"] = {name: one for name, one in loads.items() if one.get("link") in links or one.get("joint") in inner}
    for name, load in part["loads"].items():
        _still(sketch, name, load)
    part["springs"] = {}
    for name, spring in springs.items():
        ends = {str(end).partition(".")[0] for end in spring.get("between") or ()}
        if spring.get("joint") in inner or (ends & {*links} and ends <= {*links, ground}):
            part["springs"][name] = spring
    part["gears"] = {name: one for name, one in gears.items() if set(one["joints"]) <= {*inner}}
    return copy.deepcopy(part)


def _again(sketch: Sketch, section: str, name: str) -> str:
    return numbered(sketch, section, name.rstrip("0123456789") or name)


# ---- numbers as they are written -----------------------------------------------------------------------------


def _minus(stated: Any) -> Any:
    """A number or text of the file with the other sign; limits that are alike on both sides stay."""
    if not isinstance(stated, str):
        return -stated if stated else stated
    value, sign, limits = stated.partition("±")
    if re.search(r"\s[+-]\S.*/", value):
        raise refused(f"'{stated}' has limits that differ", "a number", "mirror it in the text")
    value = value.strip()
    if (number := LITERAL.fullmatch(value)) and float(number[1]) == 0:
        return stated
    rest = f" {sign}{limits}" if sign else ""
    if value.startswith("-") and ALONE.fullmatch(value[1:].strip()):
        return f"{value[1:].strip()}{rest}"
    return f"-{value.lstrip('+')}{rest}" if ALONE.fullmatch(value.lstrip("+")) else f"-({value}){rest}"


def _plus(stated: Any, by: float, usual: str) -> Any:
    """A number or text of the file and so much more, SI; usual: the unit of what had none."""
    if by == 0.0:
        return stated
    value, sign, limits = str(stated).partition("±")
    if "%" in limits or '"' in value or re.search(r"\s[+-]\S.*/", value):
        raise refused(f"'{stated}' is not moved as it is written", "a number", "change it in the text")
    rest = f" {sign}{limits}" if sign else ""
    found = LITERAL.fullmatch(value)
    name = found[2] if found and (found[2] or float(found[1])) else usual
    more = by / float(unit(name)[0]) if name else by
    if not found:
        return f"{value.strip()} {'-' if by < 0 else '+'} {abs(round(more, 12)):.15g} {name}{rest}"
    total = round(float(found[1]) + more, 12) + 0.0
    return f"{total:.15g} {name}{rest}" if name else f"{total:.15g}{rest}" if rest else total
