"""A mechanism built of blocks: a driver, gears, a dyad or triad, wired to pins that are there or new on the ground."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import atan2, cos, degrees, hypot, sin
from typing import Any

from trunnion.studio.acting import driver, gear
from trunnion.studio.sketch import Frame, Sketch, Vector
from trunnion.studio.strokes import bar, begin, letter, line_near, numbered, place_of, point_of, refused, slide, typed

__all__ = ["block"]

Given = Mapping[str, Any]
APEX = 0.6  # of the distance of its pins, how far off their line the inner pin of an RRR is put
INNER, TURNED = 0.8, 1.4  # corners of a triad's plate: its pins, so near to its middle, turned so far about it, rad
BEYOND = 1.5  # of the distance of its pins, how long the link of an RPR is


def block(sketch: Sketch, gesture: Given) -> str:
    """A block of the list BLOCKS.

    pins: joints, free points "link.P", or {ground: "x, y"} for a new pin on the ground. at: "x, y" of the inner pin,
    of a driver or RPR the end of its link, of a CCC the angle between the shafts; as it fits if empty. ratio: of gears.
    """
    kind = str(gesture["kind"])
    if kind not in BLOCKS:
        raise refused(f"'{kind}' is no block", "the block", f"choose {', '.join(BLOCKS)}")
    begin(sketch)
    if len(set(map(str, gesture["pins"]))) < len(gesture["pins"]):
        raise refused("has the same pin twice", "the block", "choose other pins")
    if kind == "CCC":
        return _loop_in_space(sketch, gesture.get("at") or "30 deg")
    if kind == "gear":
        if not all(isinstance(pin, str) for pin in gesture["pins"]):
            raise refused("need two pivots that are drawn", "the gears", "choose two pins")
        return gear(sketch, {"joints": gesture["pins"], "ratio": gesture.get("ratio")})
    pins = [pin if isinstance(pin, str) else {"ground": _place(sketch, pin["ground"])} for pin in gesture["pins"]]
    BLOCKS[kind](sketch, pins, _place(sketch, gesture["at"]) if str(gesture.get("at") or "").strip() else None)
    return f"Add {kind if kind.isupper() else f'a {kind}'}"


def _place(sketch: Sketch, text: Any) -> Vector:
    """A place of two lengths, "120 mm, 0.4 in", m; plain numbers are in the unit of the sheet."""
    parts = str(text).replace(";", ",").split(",")
    if len(parts) != 2:
        what = f"'{str(text)[:40]}' is no place (two lengths are needed)"
        raise refused(what, "the block", "write two lengths, such as 120 mm, 40 mm")
    x, y = (typed(part, "length", "the block", sketch.unit) for part in parts)
    return x, y


def _end(sketch: Sketch, name: str) -> str:
    """The free point of a link that was just drawn."""
    point = next(point for point in reversed(list(sketch.points(name))) if point not in sketch.joints)
    return f"{name}.{point}"


def _across(sketch: Sketch, pins: list[Any], share: float) -> Vector:
    """A place left of the middle of two pins, by a share of their distance."""
    (x, y), (a, b) = (place_of(sketch, pin) for pin in pins)
    if not hypot(a - x, b - y) > 0:
        raise refused("has its two pins on one spot", "the block", "choose two that are apart")
    return (x + a) / 2 - share * (b - y), (y + b) / 2 + share * (a - x)


def _crank(sketch: Sketch, pins: list[Any], at: Vector | None) -> None:
    x, y = place_of(sketch, pins[0])
    crank = bar(sketch, pins[0], list(at or (x, y + max(0.3 * sketch.size, 0.04))))
    driver(sketch, {"joint": next(iter(sketch.points(crank))), "add": True})


def _rrr(sketch: Sketch, pins: list[Any], at: Vector | None) -> None:
    first = bar(sketch, pins[0], list(at or _across(sketch, pins, APEX)))
    bar(sketch, pins[1], _end(sketch, first))


def _rrp(sketch: Sketch, pins: list[Any], at: Vector | None) -> None:
    x, y = place_of(sketch, pins[0])
    level = next((sketch.places[f"{sketch.ground}.{name}"][1] for name in sketch.points(sketch.ground)), y)
    rod = bar(sketch, pins[0], list(at or (x + 2 * max(sketch.size, 0.04), level)))
    slide(sketch, {"joint": _end(sketch, rod), "angle": 0.0})


def _rpr(sketch: Sketch, pins: list[Any], at: Vector | None) -> None:
    if not isinstance(pins[1], str):
        raise refused("is what slides along the link", "the second pin", "choose a pin that is drawn")
    (x, y), (a, b) = (place_of(sketch, pin) for pin in pins)
    lever = bar(sketch, pins[0], list(at or (x + BEYOND * (a - x), y + BEYOND * (b - y))))
    slide(sketch, {"joint": pins[1], "along": lever})


def _rpp(sketch: Sketch, pins: list[Any], at: Vector | None) -> None:
    """A block on the pin, in a slot of a link that is guided across the slot: towards `at`, or along x."""
    if not isinstance(pins[0], str):
        raise refused("carries the block that slides in the slot", "the pin", "choose a pin that is drawn")
    x, y = place_of(sketch, pins[0])
    a, b = at or (x + max(sketch.size, 0.04), y)
    angle, half = atan2(b - y, a - x), max(sketch.size, 0.04)
    across = (-half * sin(angle), half * cos(angle))
    yoke = bar(sketch, [x - across[0], y - across[1]], [x + across[0], y + across[1]])
    slide(sketch, {"joint": pins[0], "along": yoke, "near": half})
    slide(sketch, {"joint": {"on": yoke, "at": [a, b]}, "angle": angle})


def _prp(sketch: Sketch, pins: list[Any], at: Vector | None) -> None:
    """A pin between a block that slides along the link of the pin that is given, and one in a guide on the ground."""
    carrier, _ = point_of(sketch, pins[0])
    if carrier == sketch.ground:
        raise refused("is on no link that moves", "the pin", "choose a pin of the link along which it slides")
    spots = [sketch.places[f"{carrier}.{point}"] for point in sketch.points(carrier)]
    x, y = at or (sum(spot[0] for spot in spots) / len(spots), sum(spot[1] for spot in spots) / len(spots))
    _, (c, s), _ = line_near(sketch, carrier, (x, y))
    slider, point, angle = numbered(sketch, "links", "block"), letter(sketch), atan2(c, -s)  # across the link
    sketch.section("links")[slider] = {"points": {point: [0, 0]}}
    sketch.show(slider, Frame(x, y, cos(angle), sin(angle)))
    slide(sketch, {"joint": {"on": slider, "at": [x, y]}, "angle": angle})
    slide(sketch, {"joint": f"{slider}.{point}", "along": carrier})


def _triad(sketch: Sketch, pins: list[Any], at: Vector | None) -> None:
    """A group of class III: a link with three pins on three rods."""
    spots = [place_of(sketch, pin) for pin in pins]
    x, y = at or (sum(spot[0] for spot in spots) / 3, sum(spot[1] for spot in spots) / 3)
    c, s = INNER * cos(TURNED), INNER * sin(TURNED)
    corners = [[x + c * (a - x) - s * (b - y), y + s * (a - x) + c * (b - y)] for a, b in spots]
    first, second = (bar(sketch, pin, corner) for pin, corner in zip(pins[:2], corners, strict=False))
    plate = bar(sketch, _end(sketch, first), _end(sketch, second))
    bar(sketch, pins[2], {"on": plate, "at": corners[2]})


def _loop_in_space(sketch: Sketch, angle: str) -> str:
    """Three cylindrical pairs from the link of a driver to the ground: with it a loop in space, here a Cardan joint.

    The axes of both shafts and of the cross meet in a point, and the pins of the cross are at right angles.
    """
    head = ("trunnion", "name", "notes", "joint_defaults")
    plain = {*head, "space", "links", "joints", "drivers", "assembly"}
    joints, links = list(sketch.joints), [link for link in sketch.of("links") if link != sketch.ground]
    more = {key for key, part in sketch.entries.items() if part} - plain
    if more or len(links) > 1 or len(joints) > 1 or sketch.entries.get("space") == "spatial":
        remedy = "place it on a new sheet, or on that of a driver alone; change a loop by its table"
        raise refused("closes a loop in space with a driver", "a CCC", remedy)
    joints += [name for name in "ABCDE" if name not in joints][: 4 - len(joints)]
    links += [name for name in ("link1", "link2", "link3", "link4") if name not in links][: 3 - len(links)]
    driver = sketch.of("drivers").get(joints[0], {"speed": "60 rpm"})
    shafts, start = typed(angle, "angle", "the CCC", "deg"), typed(driver.get("start") or "0 deg", "angle", "the CCC")
    rows = [{"joint": joint, "type": "cylindrical", "link": link, "twist": "90 deg"}
            for joint, link in zip(joints, [*links, sketch.ground], strict=True)]  # fmt: skip
    rows[0]["type"], rows[3]["twist"] = "revolute", f"{round(180.0 - degrees(shafts), 12):.15g} deg"
    output = degrees(atan2(-cos(start) * cos(shafts), sin(start)))  # the pins of the cross are at right angles
    sketch.entries, sketch.places = {
        **{key: part for key, part in sketch.entries.items() if key in head}, "space": "spatial", "loop": rows,
        "drivers": {joints[0]: driver}, "assembly": {joints[3]: f"{output:.6g} deg"},
    }, {}  # fmt: skip
    return "Add CCC"


BLOCKS: dict[str, Callable[[Sketch, list[Any], Vector | None], None]] = {
    "driver": _crank, "RRR": _rrr, "RRP": _rrp, "RPR": _rpr, "PRP": _prp, "RPP": _rpp, "triad": _triad,
    "CCC": lambda *_: None, "gear": lambda *_: None,
}  # fmt: skip
