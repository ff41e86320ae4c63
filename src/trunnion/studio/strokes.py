"""Drawing: links, pins, guides and slots, points; and ends that are drawn already, joined."""

from __future__ import annotations

from collections.abc import Mapping
from math import atan2, cos, hypot, sin
from typing import Any

from trunnion.studio.changing import move
from trunnion.studio.ends import (
    SHORTEST,
    begin,
    doubled,
    free,
    held,
    joined,
    letter,
    line_near,
    numbered,
    pin,
    place_of,
    point_of,
    put,
    refused,
    vector,
)
from trunnion.studio.renaming import rename_point
from trunnion.studio.sketch import Frame, Sketch, Vector

__all__ = ["add_point", "bar", "join", "link", "pinned", "slide"]

Given = Mapping[str, Any]


def link(sketch: Sketch, given: Given) -> str:
    """A bar from one end to another; ends on joints, points and links are joined with them.

    length: as it was typed, if it was; it says the same as the places.
    """
    return f"Draw {bar(sketch, given['from'], given['to'], length=given.get('length'))}"


def bar(sketch: Sketch, *ends: Any, length: Any = None) -> str:
    """A new link between two ends; its name."""
    begin(sketch)
    (x, y), (a, b) = places = [place_of(sketch, end) for end in ends]
    far = hypot(a - x, b - y)
    if far <= SHORTEST:
        raise refused("the link has no length", "", "click at two places")
    name = numbered(sketch, "links", "link")
    frame = Frame(x, y, (a - x) / far, (b - y) / far)
    sketch.section("links")[name] = {"points": {}}
    for end, place, local in zip(ends, places, (0, length or sketch.length(far)), strict=True):
        sketch.forget()
        point = joined(sketch, name, end, place)
        sketch.section("links")[name]["points"][point] = [local, 0]
    sketch.forget()
    sketch.show(name, frame)
    return name


def pinned(sketch: Sketch, given: Given) -> str:
    """A free point becomes a pin on the ground; given {on: link, at: place} instead, a new point of that link."""
    end = given["point"]
    if isinstance(end, Mapping) and end["on"] == sketch.ground:
        raise refused("is the ground", sketch.ground, "choose a link that moves")
    own, point = point_of(sketch, end) if isinstance(end, Mapping) else free(sketch, end)
    begin(sketch)
    place = sketch.places[f"{own}.{point}"]
    put(sketch, sketch.ground, point, place)
    pin(sketch, point, sketch.ground, own, place)
    return f"Pin {point} to the ground"


def add_point(sketch: Sketch, given: Given) -> str:
    """A point on a link."""
    begin(sketch)
    point = letter(sketch)
    put(sketch, str(given["link"]), point, vector(given["at"]))
    sketch.made = ("points", f"{given['link']}.{point}")  # and so its velocity and acceleration are shown
    return f"Add point {point}"


# ---- guides and slots -----------------------------------------------------------------------------------------


def slide(sketch: Sketch, given: Given) -> str:
    """A point slides, by a block that is pinned to it; given {on: link, at: place} instead, that link itself.

    It slides along the ground in the direction of `angle`, rad, or in a slot of the link `along`: on the line through
    two of that link's points, and beside it by as much as it is drawn there, if that is more than `near`, m.
    """
    begin(sketch)
    carrier, slid = str(given.get("along") or sketch.ground), given["joint"]
    if carrier != sketch.ground and carrier not in sketch.of("links"):
        raise refused("is not there", f"links.{carrier}", "choose a link that is drawn")
    place = place_of(sketch, slid)
    if isinstance(slid, Mapping):
        own = str(slid["on"])
        if own in (carrier, sketch.ground):
            raise refused("cannot slide along itself", f"links.{own}", "choose two links")
        name, angle = _guided(sketch, carrier, place, given)
        sketch.section("joints")[name] = {"type": "prismatic", "links": [carrier, own]}
        put(sketch, own, name, place, angle)
        return f"Guide {own}" if carrier == sketch.ground else f"Slide {own} along {carrier}"
    own, point = _end_to_slide(sketch, str(slid), carrier)
    block, (name, angle) = numbered(sketch, "links", "block"), _guided(sketch, carrier, place, given)
    sketch.section("links")[block] = {"points": {point: [0, 0], name: {"at": [0, 0], "axis": [1, 0]}}}
    sketch.section("joints")[name] = {"type": "prismatic", "links": [carrier, block]}
    sketch.forget()
    pin(sketch, point, own, block, place)
    sketch.show(block, Frame(*place, cos(angle), sin(angle)))
    return f"Guide {point}" if carrier == sketch.ground else f"Slide {point} along {carrier}"


def _guided(sketch: Sketch, carrier: str, place: Vector, given: Given) -> tuple[str, float]:
    """The guide of a new sliding joint on the link that carries it: name of the joint, and its angle, rad."""
    name = letter(sketch)
    if carrier == sketch.ground:
        angle = float(given.get("angle", 0.0))
        put(sketch, carrier, name, place, angle)
        return name, angle
    line = line_near(sketch, carrier, place)
    (x, y), (c, s) = line.start, line.direction
    beside = line.beside if abs(line.beside) > float(given.get("near", 0.0)) else 0.0
    put(sketch, carrier, name, (x - s * beside, y + c * beside), atan2(s, c))
    along = c * (place[0] - x) + s * (place[1] - y)
    sketch.section("assembly")[name] = sketch.length(along)  # on which side of the point the block is
    return name, atan2(s, c)


def _end_to_slide(sketch: Sketch, name: str, carrier: str) -> tuple[str, str]:
    """Link and point that a block is pinned to. A pin on the carrier of the guide becomes the pin on the block."""
    if name not in sketch.joints:
        own, point = free(sketch, name)
        if own == carrier:
            raise refused("cannot slide along itself", f"links.{own}", "choose two links")
        return own, point
    joint = sketch.joints[name]
    if joint.get("type", "revolute") != "revolute":
        raise refused("slides already", f"joints.{name}", "choose a pin, or the free end of a link")
    if carrier not in joint["links"]:
        own, point = held(sketch, name)
        return own, doubled(sketch, own, point)
    own = next(one for one in joint["links"] if one != carrier)
    for section, what in (("loads", "load"), ("springs", "spring")):
        for one, entry in sketch.of(section).items():
            if (entry.get("link"), entry.get("at")) == (carrier, name) or f"{carrier}.{name}" in entry.get(
                "between", ()
            ):
                raise refused(f"carries the {what} {one}", f"joints.{name}", f"delete that {what} first")
    del sketch.section("joints")[name]
    for section in ("drivers", "assembly"):
        sketch.section(section).pop(name, None)
    sketch.section("links")[carrier]["points"].pop(name, None)
    sketch.places.pop(f"{carrier}.{name}", None)
    sketch.forget()
    return own, name


# ---- ends that are drawn already ------------------------------------------------------------------------------


def join(sketch: Sketch, given: Given) -> str:
    """Two ends are pinned together where the second is; the first goes there, unless it is a place on a link.

    An end is a joint "J", a free point "link.P", or {on: link, at: place}.
    """
    begin(sketch)
    first, second = given["ends"]
    place = place_of(sketch, second)
    owners = [_owners(sketch, end) for end in (first, second)]
    (*_, link), (*_, other) = owners  # of a joint its second, which moves
    if set(owners[0]) & set(owners[1]):
        raise refused("would be joined with itself", link, "choose ends of two links")
    for name, joint in sketch.joints.items():
        if {link, other} == set(joint["links"]):
            raise refused(f"and {other} are joined at {name} already", link, "choose two other links")
    if isinstance(first, str):
        move(sketch, {"point": first, "to": place})
    name = _name(sketch, (link, other), (first, second))
    for side, end in ((link, first), (other, second)):
        _call(sketch, side, end, name, place)
    sketch.forget()
    pin(sketch, name, other, link, place)
    sketch.made = ("joints", name)
    return f"Join {link} with {other}"


def _owners(sketch: Sketch, end: Any) -> list[str]:
    """The links that an end is on."""
    if isinstance(end, Mapping):
        return [str(end["on"])]
    held(sketch, end)
    return sketch.links_at(end)[0]


def _name(sketch: Sketch, links: tuple[str, str], ends: tuple[Any, Any]) -> str:
    """The name of the new pin: that of a free end, the second's before the first's, if nothing else has it."""
    for side in (1, 0):
        if not isinstance(ends[side], str) or ends[side] in sketch.joints:
            continue
        name = free(sketch, ends[side])[1]
        if all(name not in sketch.points(link) for link in sketch.of("links") if link != links[side]):
            return name
    return letter(sketch)


def _call(sketch: Sketch, link: str, end: Any, name: str, place: Vector) -> None:
    """The link has a point of this name at an end of it."""
    if not isinstance(end, str):
        put(sketch, link, name, place)
        return
    point = held(sketch, end)[1]
    if point in sketch.joints:
        doubled(sketch, link, point, name)
    elif point != name:
        rename_point(sketch, f"{link}.{point}", name)
