"""A mechanism built of blocks: a driver, gears, a dyad or triad, wired to pins that are there or new on the ground."""

from __future__ import annotations

from cmath import phase, rect
from collections.abc import Callable, Mapping
from math import atan2, cos, degrees, sin
from typing import Any

from trunnion.studio.drawing import bar, driver, gear, letter, line_near, numbered, place_of, point_of, slide, typed
from trunnion.studio.sketch import Frame, Sketch, refused

APEX = 0.6  # of the distance of its pins, how far off their line the inner pin of an RRR is put
CORNER = rect(0.8, 1.4)  # of a triad's plate: from its middle, in the direction of its pin, how near and how far turned
LEVER = 1.5  # of the distance of its pins, how long the link of an RPR is
SMALLEST = 0.04  # m: what the size of a drawing counts at least


def block(sketch: Sketch, gesture: Mapping[str, Any]) -> str:
    """A block of the list BLOCKS.

    pins: joints, free points "link.P", or {ground: "x, y"} for a new pin on the ground. at: "x, y" of the inner pin,
    of a driver or RPR the end of its link, of a CCC the angle between the shafts; as it fits if empty. ratio: of gears.
    """
    kind, pins = str(gesture["kind"]), gesture["pins"]
    if kind not in (*BLOCKS, "CCC", "gear"):
        raise refused(f"'{kind}' is no block", "the block", f"choose {', '.join(BLOCKS)}, CCC, gear")
    sketch.begin()
    if len(set(map(str, pins))) < len(pins):
        raise refused("has the same pin twice", "the block", "choose other pins")
    if kind == "CCC":
        return _loop_in_space(sketch, gesture.get("at") or "30 deg")
    if kind == "gear":
        if not all(isinstance(pin, str) for pin in pins):
            raise refused("need two pivots that are drawn", "the gears", "choose two pins")
        return gear(sketch, {"joints": pins, "ratio": gesture.get("ratio")})
    pins = [pin if isinstance(pin, str) else {"ground": _place(sketch, pin["ground"])} for pin in pins]
    BLOCKS[kind](sketch, pins, _place(sketch, gesture["at"]) if str(gesture.get("at") or "").strip() else None)
    return f"Add {kind if kind.isupper() else f'a {kind}'}"


def _place(sketch: Sketch, text: Any) -> complex:
    """A place of two lengths, "120 mm, 0.4 in", m; plain numbers are in the unit of the sheet."""
    parts = str(text).replace(";", ",").split(",")
    if len(parts) != 2:
        what = f"'{str(text)[:40]}' is no place (two lengths are needed)"
        raise refused(what, "the block", "write two lengths, such as 120 mm, 40 mm")
    return complex(*(typed(part, "length", "the block", sketch.unit) for part in parts))


def _end(sketch: Sketch, name: str) -> str:
    """The free point of a link that was just drawn."""
    return f"{name}.{list(sketch.points(name))[-1]}"


# ---- what each block draws: at its pins, its inner pin or the end of its link `at` a place, or as it fits -----------


def _crank(sketch: Sketch, pins: list[Any], at: complex | None) -> None:
    usual = place_of(sketch, pins[0]) + 1j * max(0.3 * sketch.size, SMALLEST)
    crank = bar(sketch, pins[0], usual if at is None else at)
    driver(sketch, {"joint": next(iter(sketch.points(crank))), "add": True})


def _rrr(sketch: Sketch, pins: list[Any], at: complex | None) -> None:
    if at is None:
        start, end = (place_of(sketch, pin) for pin in pins)
        at = (start + end) / 2 + APEX * 1j * (end - start)
    bar(sketch, pins[1], _end(sketch, bar(sketch, pins[0], at)))


def _rrp(sketch: Sketch, pins: list[Any], at: complex | None) -> None:
    pin, ground = place_of(sketch, pins[0]), sketch.ground
    level = next((sketch.places[f"{ground}.{name}"].imag for name in sketch.points(ground)), pin.imag)
    usual = complex(pin.real + 2 * max(sketch.size, SMALLEST), level)
    rod = bar(sketch, pins[0], usual if at is None else at)
    slide(sketch, {"joint": _end(sketch, rod), "angle": 0.0})


def _rpr(sketch: Sketch, pins: list[Any], at: complex | None) -> None:
    if not isinstance(pins[1], str):
        raise refused("is what slides along the link", "the second pin", "choose a pin that is drawn")
    start, end = (place_of(sketch, pin) for pin in pins)
    lever = bar(sketch, pins[0], start + LEVER * (end - start) if at is None else at)
    slide(sketch, {"joint": pins[1], "along": lever})


def _rpp(sketch: Sketch, pins: list[Any], at: complex | None) -> None:
    """A block on the pin, in a slot of a link that is guided across the slot: towards `at`, or along x."""
    if not isinstance(pins[0], str):
        raise refused("carries the block that slides in the slot", "the pin", "choose a pin that is drawn")
    pin, half = place_of(sketch, pins[0]), max(sketch.size, SMALLEST)
    guide = pin + half if at is None else at
    across = 1j * rect(half, phase(guide - pin))
    yoke = bar(sketch, pin - across, pin + across)
    slide(sketch, {"joint": pins[0], "along": yoke, "near": half})
    slide(sketch, {"joint": {"on": yoke, "at": guide}, "angle": phase(guide - pin)})


def _prp(sketch: Sketch, pins: list[Any], at: complex | None) -> None:
    """A pin between a block that slides along the link of the pin that is given, and one in a guide on the ground."""
    carrier, _ = point_of(sketch, pins[0])
    if carrier == sketch.ground:
        raise refused("is on no link that moves", "the pin", "choose a pin of the link along which it slides")
    spots = [sketch.places[f"{carrier}.{point}"] for point in sketch.points(carrier)]
    place = sum(spots) / len(spots) if at is None else at
    _, direction, _ = line_near(sketch, carrier, place)
    slider, point = numbered(sketch, "links", "block"), letter(sketch)
    sketch.section("links")[slider] = {"points": {point: [0, 0]}}
    sketch.show(slider, Frame(place, 1j * direction))  # across the link
    slide(sketch, {"joint": {"on": slider, "at": place}, "angle": phase(1j * direction)})
    slide(sketch, {"joint": f"{slider}.{point}", "along": carrier})


def _triad(sketch: Sketch, pins: list[Any], at: complex | None) -> None:
    """A group of class III: a link with three pins on three rods."""
    spots = [place_of(sketch, pin) for pin in pins]
    middle = sum(spots) / 3 if at is None else at
    corners = [middle + CORNER * (spot - middle) for spot in spots]
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


BLOCKS: dict[str, Callable[[Sketch, list[Any], complex | None], None]] = {
    "driver": _crank, "RRR": _rrr, "RRP": _rrp, "RPR": _rpr, "PRP": _prp, "RPP": _rpp, "triad": _triad,
}  # fmt: skip
