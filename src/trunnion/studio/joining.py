"""Ends that are drawn already become a pin: dropped on each other or on a link, or two links where they cross."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from trunnion.studio.changing import move
from trunnion.studio.ends import begin, doubled, free, held, letter, pin, place_of, put, refused
from trunnion.studio.renaming import rename_point
from trunnion.studio.sketch import Sketch, Vector

__all__ = ["join"]

Given = Mapping[str, Any]


def join(sketch: Sketch, given: Given) -> str:
    """Two ends are pinned together where the second is; the first goes there, unless it is a place on a link.

    An end is a joint "J", a free point "link.P", or {on: link, at: place}.
    """
    begin(sketch)
    first, second = given["ends"]
    place = place_of(sketch, second)
    owners = [_owners(sketch, end) for end in (first, second)]
    (link, *_), (other, *_) = owners
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
    """The links that an end is on; of a joint the second first, which moves."""
    if isinstance(end, Mapping):
        return [str(end["on"])]
    return list(reversed(sketch.joints[end]["links"])) if end in sketch.joints else [free(sketch, end)[0]]


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
