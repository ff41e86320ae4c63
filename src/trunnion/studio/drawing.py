"""Drawing: links, pins, guides and slots, points, and ends that are joined; drivers, loads, springs, masses and gears.

An end is a joint "J", a free point "link.P", {on: link, at: place} for a place on a link, {ground: place} for a place
on the ground, or a place [x, y], m.
"""

from __future__ import annotations

import itertools
import re
from cmath import isfinite, phase, rect
from collections.abc import Iterable, Mapping, Sequence
from math import degrees
from typing import Any

import numpy as np

from trunnion.model.quantity import Quantity
from trunnion.model.units import KINDS, UnitError
from trunnion.studio.sketch import TOGETHER, Frame, Sketch, coordinates, refused

Fields = Mapping[str, Any]
NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
LETTERS = "ABCDEFGHIJKLMNOPQRSTUVWXYZ"
SHORTEST = 1e-9  # m


def vector(value: Any) -> complex:
    """A place of the page, m."""
    place = value if isinstance(value, complex) else complex(*map(float, value))
    if not isfinite(place):
        raise ValueError(f"({place.real}, {place.imag}) is no place")
    return place


def typed(text: Any, kind: str, where: str, unit: str = "") -> float:
    """A quantity as it was typed, SI; unit: of a plain number. MechanismError where it is none."""
    text = str(text or "").strip()
    try:
        read = Quantity.read(f"{text} {unit}" if unit and NUMBER.fullmatch(text) else text, KINDS[kind])
        value = float(np.asarray(read.evaluate()))
        if not isfinite(value):
            raise ValueError(text)
    except (UnitError, ValueError, TypeError, KeyError, ZeroDivisionError) as error:
        remedy = getattr(error, "remedy", "") or f"type it as {KINDS[kind].example}"
        raise refused(f"'{text[:30]}' is no {kind}", where, remedy) from None
    return value


# ---- names ----------------------------------------------------------------------------------------------------


def names_in_use(sketch: Sketch) -> set[str]:
    """Names of joints, points, links and dimensions."""
    links = sketch.of("links")
    points = (name for link in links for name in sketch.points(link))
    rows = (str(row.get(key)) for row in sketch.rows for key in ("joint", "link"))
    return {*sketch.joints, *points, *links, *rows, *sketch.names("dimensions")}


def letter(sketch: Sketch, also: Iterable[str] = ()) -> str:
    """The next free name of a point: A, B, …, Z, A2, …; also: names that are to be used."""
    used = {*names_in_use(sketch), *also}
    names = (sign + number for number in ("", *map(str, range(2, 1000))) for sign in LETTERS)
    return next(name for name in names if name not in used)


def numbered(sketch: Sketch, section: str, stem: str, also: Iterable[str] = ()) -> str:
    """The next free name of a link, load, spring or gear pair: link1, link2, …; also: names that are to be used."""
    used = {*sketch.names(section), *names_in_use(sketch), *also}
    return next(name for number in itertools.count(1) if (name := f"{stem}{number}") not in used)


# ---- ends -----------------------------------------------------------------------------------------------------


def located(sketch: Sketch, end: Any) -> tuple[str, str]:
    """Link and point of an end; no point of a place on a link or on the ground."""
    if not isinstance(end, str):
        return str(end.get("on", sketch.ground)), ""
    (*_, link), point = sketch.links_at(end)
    if end not in sketch.joints and point not in sketch.points(link):
        raise refused("is not a joint or a point", end, "choose one that is drawn")
    return link, point


def place_of(sketch: Sketch, end: Any) -> complex:
    """Where an end is."""
    if isinstance(end, str):
        return sketch.places[".".join(located(sketch, end))]
    return vector(end["at" if "on" in end else "ground"] if isinstance(end, Mapping) else end)


def free(sketch: Sketch, name: str) -> tuple[str, str]:
    """Link and name of a point that is no joint."""
    link, point = located(sketch, name)
    if point in sketch.joints:
        remedy = "delete the joint first, or draw another link from it"
        raise refused("is a joint already", f"links.{link}.points.{point}", remedy)
    return link, point


def acted_on(entry: Fields) -> set[str]:
    """What a load, spring or gear pair acts on: links, joints, and points "link.P"."""
    link, at = entry.get("link"), entry.get("at")
    names = {*(entry.get("between") or ()), *(entry.get("joints") or ()), entry.get("joint"), link}
    return {str(name) for name in names if name} | ({f"{link}.{at}"} if link and at else set())


def point_of(sketch: Sketch, end: Any) -> tuple[str, str]:
    """Link and point of an end, where a force acts or a spring is fastened: on the moving link of a pin on the ground.

    A place on a link, or on the ground, becomes a point of it.
    """
    if isinstance(end, str):
        link, point = located(sketch, end)
        other = sketch.joints[end]["links"][0] if end in sketch.joints else link
        return (other, point) if link == sketch.ground and point in sketch.points(other) else (link, point)
    sketch.begin()
    link, point = str(end["on"]) if isinstance(end, Mapping) and "on" in end else sketch.ground, letter(sketch)
    put(sketch, link, point, place_of(sketch, end))
    return link, point


def connect(sketch: Sketch, ends: Sequence[tuple[str, str]], place: complex) -> str:
    """A pin between two links: its name, that of a free end, of the first before the second, else a new one.

    ends: (link, its point there); without a point the link gets one. A point that is a joint already is doubled.
    Where the pin is at the start chooses the assembly.
    """
    free_names = (
        point for link, point in ends if point and point not in sketch.joints
        and all(point not in sketch.points(other) for other in sketch.of("links") if other != link)
    )  # fmt: skip
    name = next(free_names, None) or letter(sketch)
    for link, point in ends:
        if not point:
            put(sketch, link, name, place)
        elif point in sketch.joints:
            sketch.section("links")[link]["points"][name] = list(coordinates(sketch.points(link)[point]))
            sketch.places[f"{link}.{name}"] = sketch.places[f"{link}.{point}"]
        elif point != name:
            rename_point(sketch, f"{link}.{point}", name)
    (first, _), (second, _) = ends
    sketch.section("joints")[name] = {"type": "revolute", "links": [first, second]}
    sketch.places[f"{second}.{name}"] = place
    if first != sketch.ground:
        sketch.section("assembly")[name] = sketch.place(place)
    return name


def put(sketch: Sketch, link: str, point: str, place: complex, axis: complex | None = None) -> None:
    """A point on a link where a place is; axis: its direction in the plane, of length 1."""
    frame = sketch.frame(link)
    local, least = frame.into(place), max(SHORTEST, sketch.fine / 20.0)  # a smaller one is what rounding left
    entry: Any = [sketch.length(part) if abs(part) > least else 0 for part in (local.real, local.imag)]
    if axis is not None:
        direction = axis * frame.turn.conjugate()
        parts = [round(part, 12) + 0.0 for part in (direction.real, direction.imag)]  # without the noise of rounding
        entry = {"at": entry, "axis": [int(part) if part.is_integer() else part for part in parts]}
    sketch.section("links")[link]["points"][point] = entry
    sketch.places[f"{link}.{point}"] = place


def line_near(sketch: Sketch, link: str, place: complex) -> tuple[complex, complex, float]:
    """The line through two points of a link that passes nearest to a place; of several the longest.

    Where it begins, m, its direction, and how far left of it the place lies, m.
    """
    spots = [sketch.places[key] for point in sketch.points(link) if (key := f"{link}.{point}") in sketch.places]
    lines: list[tuple[float, float, tuple[complex, complex, float]]] = []
    for start, end in itertools.combinations(spots, 2):
        if (length := abs(end - start)) > TOGETHER * sketch.size:
            direction = (end - start) / length
            offset = ((place - start) * direction.conjugate()).imag
            lines.append((round(abs(offset) / sketch.size, 6), -length, (start, direction, offset)))
    if not lines:
        raise refused("has no two points that a slot could go along", f"links.{link}", "add a point to it first")
    return min(lines, key=lambda row: row[:2])[2]


# ---- links, pins, points --------------------------------------------------------------------------------------


def link(sketch: Sketch, gesture: Fields) -> str:
    """A bar from one end to another; ends on joints, points and links are joined with them.

    length: as it was typed, if it was; it says the same as the places.
    """
    return f"Draw {bar(sketch, gesture['from'], gesture['to'], length=gesture.get('length'))}"


def bar(sketch: Sketch, *ends: Any, length: Any = None) -> str:
    """A new link between two ends; its name."""
    sketch.begin()
    start, finish = places = [place_of(sketch, end) for end in ends]
    far = abs(finish - start)
    if far <= SHORTEST:
        raise refused("the link has no length", "", "choose two places that are apart")
    name = numbered(sketch, "links", "link")
    sketch.section("links")[name] = {"points": {}}
    for end, place, local in zip(ends, places, (0, length or sketch.length(far)), strict=True):
        on_something = isinstance(end, (str, Mapping))
        point = connect(sketch, (located(sketch, end), (name, "")), place) if on_something else letter(sketch)
        sketch.section("links")[name]["points"][point] = [local, 0]
    sketch.show(name, Frame(start, (finish - start) / far))
    return name


def pinned(sketch: Sketch, gesture: Fields) -> str:
    """A free point becomes a pin on the ground; given {on: link, at: place} instead, a new point of that link."""
    end = gesture["point"]
    if isinstance(end, Mapping) and end["on"] == sketch.ground:
        raise refused("is the ground", sketch.ground, "choose a link that moves")
    sketch.begin()
    owner = located(sketch, end) if isinstance(end, Mapping) else free(sketch, end)
    return f"Pin {connect(sketch, ((sketch.ground, ''), owner), place_of(sketch, end))} to the ground"


def add_point(sketch: Sketch, gesture: Fields) -> str:
    """A point on a link."""
    sketch.begin()
    point = letter(sketch)
    put(sketch, str(gesture["link"]), point, vector(gesture["at"]))
    sketch.made = ("points", f"{gesture['link']}.{point}")  # and so its velocity and acceleration are shown
    return f"Add point {point}"


def join(sketch: Sketch, gesture: Fields) -> str:
    """Two ends are pinned together where the second is; the first goes there, unless it is a place on a link."""
    sketch.begin()
    first, second = gesture["ends"]
    place = place_of(sketch, second)
    (link, _), (other, _) = ends = [located(sketch, end) for end in (first, second)]
    owners = [sketch.links_at(end)[0] if isinstance(end, str) else [str(end["on"])] for end in (first, second)]
    if set(owners[0]) & set(owners[1]):
        raise refused("would be joined with itself", link, "choose ends of two links")
    for name, joint in sketch.joints.items():
        if {link, other} == set(joint["links"]):
            raise refused(f"and {other} are joined at {name} already", link, "choose two other links")
    if isinstance(first, str):
        move(sketch, {"point": first, "to": place})
    sketch.made = ("joints", connect(sketch, ends[::-1], place))
    return f"Join {link} with {other}"


# ---- guides and slots -----------------------------------------------------------------------------------------


def slide(sketch: Sketch, gesture: Fields) -> str:
    """A point slides, by a block that is pinned to it; given {on: link, at: place} instead, that link itself.

    It slides along the ground in the direction of `angle`, rad, or in a slot of the link `along`: on the line through
    two of that link's points, and beside it by as much as it is drawn there, if that is more than `near`, m.
    """
    sketch.begin()
    carrier, end = str(gesture.get("along") or sketch.ground), gesture["joint"]
    if carrier != sketch.ground and carrier not in sketch.of("links"):
        raise refused("is not there", f"links.{carrier}", "choose a link that is drawn")
    place = place_of(sketch, end)
    pin = ("", "") if isinstance(end, Mapping) else _pin_of_block(sketch, str(end), carrier)
    slider = str(end["on"]) if isinstance(end, Mapping) else numbered(sketch, "links", "block")
    if slider in (carrier, sketch.ground):
        raise refused("cannot slide along itself", f"links.{slider}", "choose two links")
    name = letter(sketch)
    if carrier == sketch.ground:
        direction = rect(1.0, float(gesture.get("angle", 0.0)))
        put(sketch, carrier, name, place, direction)
    else:
        start, direction, beside = line_near(sketch, carrier, place)
        offset = beside if abs(beside) > float(gesture.get("near", 0.0)) else 0.0
        put(sketch, carrier, name, start + 1j * direction * offset, direction)
        along = ((place - start) * direction.conjugate()).real
        sketch.section("assembly")[name] = sketch.length(along)  # on which side of the point the block is
    sketch.section("joints")[name] = {"type": "prismatic", "links": [carrier, slider]}
    title = slider
    if isinstance(end, Mapping):
        put(sketch, slider, name, place, direction)
    else:
        sketch.section("links")[slider] = {"points": {}}
        title = connect(sketch, (pin, (slider, "")), place)
        sketch.section("links")[slider]["points"] = {title: [0, 0], name: {"at": [0, 0], "axis": [1, 0]}}
        sketch.show(slider, Frame(place, direction))
    return f"Guide {title}" if carrier == sketch.ground else f"Slide {title} along {carrier}"


def _pin_of_block(sketch: Sketch, name: str, carrier: str) -> tuple[str, str]:
    """Link and point that a block is pinned to. A pin on the carrier of the guide becomes the pin on the block."""
    if name not in sketch.joints:
        slider, point = free(sketch, name)
        if slider == carrier:
            raise refused("cannot slide along itself", f"links.{slider}", "choose two links")
        return slider, point
    links = sketch.joints[name]["links"]
    if sketch.kind(name) != "revolute":
        raise refused("slides already", f"joints.{name}", "choose a pin, or the free end of a link")
    if carrier not in links:
        return located(sketch, name)
    for section, what in (("loads", "load"), ("springs", "spring")):
        for other, entry in sketch.of(section).items():
            if f"{carrier}.{name}" in acted_on(entry):
                raise refused(f"carries the {what} {other}", f"joints.{name}", f"delete that {what} first")
    for section in ("joints", "drivers", "assembly"):
        sketch.section(section).pop(name, None)
    sketch.section("links")[carrier]["points"].pop(name, None)
    sketch.places.pop(f"{carrier}.{name}", None)
    return next(other for other in links if other != carrier), name


# ---- what is drawn already ------------------------------------------------------------------------------------


def move(sketch: Sketch, gesture: Fields) -> str:
    """A joint or point goes to a place; in space by so much, as the links are turned at a position."""
    point, hints = str(gesture["point"]), sketch.entries.get("assembly") or {}
    hinted = isinstance(hints.get(point), list) and not gesture.get("index")
    if "by" in gesture:
        by = [float(part) for part in gesture["by"]]
        if len(by) != 3 or not np.all(np.isfinite(by)):
            raise ValueError(f"{gesture['by']} is no shift")
        sketch.size, turns = float(gesture["size"]), sketch.turns(int(gesture.get("index") or 0))
        changes = sketch.shifted(point, by, turns)
        if hinted:
            hints[point] = [sketch.length(part) for part in np.add(sketch.vector(f"assembly.{point}", "xyz"), by)]
        sketch.write(changes)
        return f"Move {point}"
    to = vector(gesture["to"])
    changes = sketch.moved(point, to, bool(gesture.get("keep")))
    sketch.write(changes)
    if hinted:
        hints[point] = sketch.place(to)
    links, name = sketch.links_at(point)
    for link in links:
        sketch.places[f"{link}.{name}"] = to
    for link in links:
        sketch.show(link, sketch.frame(link))
    return f"Move {point}" if changes else f"Move {point}: no length changes"


def rename_point(sketch: Sketch, old: str, new: str) -> None:
    """A point of a link that is no joint, with the loads and springs at it."""
    link, point = free(sketch, old)
    entry = sketch.section("links")[link]
    entry["points"] = {(new if name == point else name): at for name, at in entry["points"].items()}
    for load in sketch.of("loads").values():
        if (load.get("link"), load.get("at")) == (link, point):
            load["at"] = new
    for spring in sketch.of("springs").values():
        if "between" in spring:
            spring["between"] = [f"{link}.{new}" if end == old else end for end in spring["between"]]
    for named in (sketch.section("assembly"), sketch.places):
        if old in named:
            named[f"{link}.{new}"] = named.pop(old)


# ---- what acts ------------------------------------------------------------------------------------------------


def driver(sketch: Sketch, gesture: Fields) -> str:
    """A joint is driven, from where it is shown."""
    joint = str(gesture["joint"])
    if not sketch.kind(joint):
        raise refused("is not a joint", joint, "choose a joint")
    if not gesture.get("add"):
        sketch.section("drivers").clear()
    if sketch.kind(joint) == "prismatic":
        entry = {"speed": gesture.get("speed") or "10 mm/s", "range": [0, sketch.length(0.2 * sketch.size)]}
    else:
        start = _rotation(sketch, joint) if joint in sketch.joints else 0.0
        entry = {"speed": gesture.get("speed") or "60 rpm"} | ({"start": f"{start:g} deg"} if start else {})
    sketch.section("drivers")[joint], sketch.made = entry, ("joints", joint)
    return f"Drive {joint}"


def _rotation(sketch: Sketch, joint: str) -> float:
    """The rotation of a joint as it is shown, degrees from 0 to 360."""
    first, second = (sketch.frame(end) for end in sketch.joints[joint]["links"])
    return round(degrees(phase(second.turn * first.turn.conjugate())) % 360.0, 4) % 360.0


def load(sketch: Sketch, gesture: Fields) -> str:
    """A force at a joint, a point or a place of a moving link; or what opposes the motion of the joint `against`.

    size: of that, N or N m, as it was typed.
    """
    name = numbered(sketch, "loads", "load")
    if "against" in gesture:
        joint = str(gesture["against"])
        kind = sketch.kind(joint)
        if kind not in ("revolute", "prismatic", "cylindrical"):
            raise refused("does not turn or slide", joint, "choose a pin or a slide")
        what, usual = ("resisting_force", "100 N") if kind == "prismatic" else ("resisting_torque", "10 N m")
        entry = {"joint": joint, what: gesture.get("size") or usual}
    else:
        link, point = point_of(sketch, gesture["at"])
        if link == sketch.ground:
            raise refused("would act on the ground", "the force", "choose a point of a moving link")
        entry = {"link": link, "at": point, "force": list(gesture["force"])}
    return _add(sketch, "loads", name, entry)


def spring(sketch: Sketch, gesture: Fields) -> str:
    """A spring between two ends, without force as it is drawn; an end on nothing is fastened to the ground."""
    ends = [".".join(point_of(sketch, end)) for end in gesture["between"]]
    start, end = (sketch.places[end] for end in ends)
    if ends[0].partition(".")[0] == ends[1].partition(".")[0]:
        raise refused("would have both ends on one link", "the spring", "choose points of two links")
    entry = {"between": ends, "stiffness": gesture.get("stiffness") or "1 N/mm"}
    entry["free_length"] = sketch.length(abs(end - start))
    return _add(sketch, "springs", numbered(sketch, "springs", "spring"), entry)


def _add(sketch: Sketch, section: str, name: str, entry: Any) -> str:
    sketch.section(section)[name], sketch.made = entry, (section, name)
    return f"Add {name}"


def bar_mass(sketch: Sketch, gesture: Fields) -> str:
    """Mass, mass centre and inertia of a link that is a flat bar between its two points that are farthest apart.

    width, thickness, density: as they were typed. With length l and width b: J = m (l² + b²) / 12 about the middle.
    """
    link = str(gesture["link"])
    if len(sketch.points(link)) < 2 or link == sketch.ground or sketch.entries.get("space") == "spatial":
        raise refused("is no bar in the plane", f"links.{link}", "choose a moving link with two points")
    length, middle = _bar(sketch, link)
    sizes = []
    for key, kind in (("width", "length"), ("thickness", "length"), ("density", "density")):
        sizes.append(typed(gesture.get(key), kind, f"the {key}"))
        if sizes[-1] <= 0:
            raise refused("is not above 0", f"the {key}", f"type it as {KINDS[kind].example}")
    width, thickness, density = sizes
    mass = density * length * width * thickness
    sketch.section("links")[link].pop("inertia_about", None)
    sketch.section("links")[link] |= {
        "mass": f"{mass:.6g} kg",
        "centre": sketch.place(middle),
        "inertia": f"{mass * (length**2 + width**2) / 12:.6g} kg m^2",
    }
    return f"Mass of {link}"


def centre(sketch: Sketch, gesture: Fields) -> str:
    """The mass centre of a link goes to the place `at`; without that to the middle of the bar between its points."""
    link = str(gesture["link"])
    if link == sketch.ground or link not in sketch.of("links") or sketch.entries.get("space") == "spatial":
        raise refused("has no mass centre in the plane", f"links.{link}", "choose a link that moves")
    middle = sketch.frame(link).into(vector(gesture["at"])) if gesture.get("at") else _bar(sketch, link)[1]
    sketch.section("links")[link]["centre"] = sketch.place(middle)
    return f"Mass centre of {link}"


def _bar(sketch: Sketch, link: str) -> tuple[float, complex]:
    """Length and middle of a link between its two points that are farthest apart, m, in its frame."""
    points = [sketch.local(link, point) for point in sketch.points(link)] or [0j]
    pairs = itertools.combinations_with_replacement(points, 2)
    start, end = max(pairs, key=lambda ends: abs(ends[1] - ends[0]))
    return abs(end - start), (start + end) / 2


def gear(sketch: Sketch, gesture: Fields) -> str:
    """A gear pair between two links, by their pivots or by themselves, meshing as they are drawn.

    ratio: turns of the second for one of the first, against it, such as "1/2"; or their teeth, "20:40"; with a + they
    turn the same way (an internal gear). They are equal if it is not given.
    """
    sketch.begin()
    first, second = (_pivot(sketch, end) for end in gesture["joints"])
    if first == second:
        raise refused("would mesh with itself", f"joints.{first}", "choose two pivots")
    if len({*sketch.joints[first]["links"]} & {*sketch.joints[second]["links"]}) != 1:
        what = f"and {second} have no link in common that carries both gears"
        raise refused(what, first, "choose two pivots on the ground")
    if any({*pair.get("joints", ())} == {first, second} for pair in sketch.of("gears").values()):
        raise refused(f"and {second} are geared already", first, "change the ratio of that gear pair")
    text = str(gesture.get("ratio") or "1").replace(":", "/").strip()
    written: float | int | str = f"{'' if text.startswith('+') else '-'}{text.lstrip('+-')}"
    ratio = typed(written, "number", "the ratio")
    if not ratio:
        raise refused(f"'{text}' is no ratio of gears", "", "type the teeth as 20:40, or a number")
    if "/" not in text:
        written = int(ratio) if ratio.is_integer() else ratio
    phase_shown = round((_rotation(sketch, second) - ratio * _rotation(sketch, first)) % 360.0, 4)
    entry: dict[str, Any] = {"joints": [first, second], "ratio": written}
    entry |= {"phase": f"{phase_shown:g} deg"} if phase_shown else {}
    return _add(sketch, "gears", numbered(sketch, "gears", "gear"), entry)


def _pivot(sketch: Sketch, end: Any) -> str:
    """The joint that a gear turns in: a pin, or that of a link on the ground."""
    if isinstance(end, Mapping):
        link = str(end.get("on"))
        pins = [name for name, joint in sketch.joints.items() if {*joint["links"]} == {link, sketch.ground}]
        if len(pins) != 1:
            raise refused("has no pivot on the ground", f"links.{link}", "pin one of its ends to the ground first")
        end = pins[0]
    if end not in sketch.joints or sketch.kind(end) != "revolute":
        raise refused("is no pin that turns", str(end), "choose the pivot of a link")
    return str(end)
