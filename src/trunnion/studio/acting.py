"""What acts on a drawing and what couples it: drivers, loads, springs, gear pairs."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from math import atan2, degrees, dist, hypot
from typing import Any

from trunnion.model.units import KINDS
from trunnion.studio.sketch import Sketch, Vector
from trunnion.studio.strokes import begin, numbered, point_of, refused, typed, vector

__all__ = ["bar_mass", "centre", "driver", "gear", "load", "spring"]

Given = Mapping[str, Any]


def driver(sketch: Sketch, gesture: Given) -> str:
    """A joint is driven, from where it is shown."""
    joint = str(gesture["joint"])
    if not sketch.kind(joint):
        raise refused("is not a joint", joint, "choose a joint")
    if not gesture.get("add"):
        for other in list(sketch.section("drivers")):
            del sketch.section("drivers")[other]
    if sketch.kind(joint) == "prismatic":
        entry = {"speed": gesture.get("speed") or "10 mm/s", "range": [0, sketch.length(0.2 * sketch.size)]}
    else:
        start = _turned(sketch, joint) if joint in sketch.joints else 0.0
        entry = {"speed": gesture.get("speed") or "60 rpm"} | ({"start": f"{start:g} deg"} if start else {})
    sketch.section("drivers")[joint], sketch.made = entry, ("joints", joint)
    return f"Drive {joint}"


def _turned(sketch: Sketch, joint: str) -> float:
    """The rotation of a joint as it is shown, degrees from 0 to 360."""
    first, second = (sketch.frame(end) for end in sketch.joints[joint]["links"])
    turn = degrees(atan2(second.s, second.c) - atan2(first.s, first.c))
    return round(turn % 360.0, 4) % 360.0


def load(sketch: Sketch, gesture: Given) -> str:
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
    sketch.section("loads")[name] = entry
    sketch.made = ("loads", name)
    return f"Add {name}"


def spring(sketch: Sketch, gesture: Given) -> str:
    """A spring between two ends, without force as it is drawn; an end on nothing is fastened to the ground."""
    ends = [".".join(point_of(sketch, end)) for end in gesture["between"]]
    (x, y), (a, b) = (sketch.places[end] for end in ends)
    if ends[0].partition(".")[0] == ends[1].partition(".")[0]:
        raise refused("would have both ends on one link", "the spring", "choose points of two links")
    name = numbered(sketch, "springs", "spring")
    entry = {"between": ends, "stiffness": gesture.get("stiffness") or "1 N/mm"}
    sketch.made = ("springs", name)
    sketch.section("springs")[name] = entry | {"free_length": sketch.length(hypot(a - x, b - y))}
    return f"Add {name}"


def bar_mass(sketch: Sketch, gesture: Given) -> str:
    """Mass, mass centre and inertia of a link that is a flat bar between its two points that are farthest apart.

    width, thickness, density: as they were typed. With length l and width b: J = m (l² + b²) / 12 about the middle.
    """
    link = str(gesture["link"])
    if len(sketch.points(link)) < 2 or link == sketch.ground or sketch.entries.get("space") == "spatial":
        raise refused("is no bar in the plane", f"links.{link}", "choose a moving link with two points")
    length, (x, y) = _bar(sketch, link)
    kinds = {"width": "length", "thickness": "length", "density": "density"}
    width, thickness, density = (_above_zero(gesture.get(key), key, kind) for key, kind in kinds.items())
    mass = density * length * width * thickness
    sketch.section("links")[link].pop("inertia_about", None)
    sketch.section("links")[link] |= {
        "mass": f"{mass:.6g} kg",
        "centre": [sketch.length(x), sketch.length(y)],
        "inertia": f"{mass * (length**2 + width**2) / 12:.6g} kg m^2",
    }
    return f"Mass of {link}"


def centre(sketch: Sketch, gesture: Given) -> str:
    """The mass centre of a link goes to the place `at`; without that to the middle of the bar between its points."""
    link = str(gesture["link"])
    if link == sketch.ground or link not in sketch.of("links") or sketch.entries.get("space") == "spatial":
        raise refused("has no mass centre in the plane", f"links.{link}", "choose a link that moves")
    x, y = sketch.frame(link).into(vector(gesture["at"])) if gesture.get("at") else _bar(sketch, link)[1]
    sketch.section("links")[link]["centre"] = [sketch.length(x), sketch.length(y)]
    return f"Mass centre of {link}"


def _bar(sketch: Sketch, link: str) -> tuple[float, Vector]:
    """Length and middle of a link between its two points that are farthest apart, m, in its frame."""
    points = [sketch.local(link, point) for point in sketch.points(link)]
    pairs = combinations(points if len(points) > 1 else [*points, *points] or [(0.0, 0.0)] * 2, 2)
    (x, y), (a, b) = max(pairs, key=lambda ends: dist(*ends))
    return dist((x, y), (a, b)), ((x + a) / 2, (y + b) / 2)


def _above_zero(text: Any, key: str, kind: str) -> float:
    """A quantity that was typed, in SI."""
    value = typed(text, kind, f"the {key}")
    if value <= 0:
        raise refused("is not above 0", f"the {key}", f"type it as {KINDS[kind].example}")
    return value


# ---- gears ----------------------------------------------------------------------------------------------------


def gear(sketch: Sketch, gesture: Given) -> str:
    """A gear pair between two links, by their pivots or by themselves, meshing as they are drawn.

    ratio: turns of the second for one of the first, against it, such as "1/2"; or their teeth, "20:40"; with a + they
    turn the same way (an internal gear). They are equal if it is not given.
    """
    begin(sketch)
    one, two = (_pivot(sketch, end) for end in gesture["joints"])
    if one == two:
        raise refused("would mesh with itself", f"joints.{one}", "choose two pivots")
    first, second = (sketch.joints[joint]["links"] for joint in (one, two))
    if len({*first} & {*second}) != 1:
        raise refused(
            f"and {two} have no link in common that carries both gears", one, "choose two pivots on the ground"
        )
    if any({*pair.get("joints", ())} == {one, two} for pair in sketch.of("gears").values()):
        raise refused(f"and {two} are geared already", one, "change the ratio of that gear pair")
    text = str(gesture.get("ratio") or "1").replace(":", "/").strip()
    written: float | int | str = f"{'' if text.startswith('+') else '-'}{text.lstrip('+-')}"
    ratio = typed(written, "number", "the ratio")
    if not ratio:
        raise refused(f"'{text}' is no ratio of gears", "", "type the teeth as 20:40, or a number")
    if "/" not in text:
        written = int(ratio) if ratio.is_integer() else ratio
    name = numbered(sketch, "gears", "gear")
    phase = (_turned(sketch, two) - ratio * _turned(sketch, one)) % 360.0
    entry: dict[str, Any] = {"joints": [one, two], "ratio": written}
    sketch.made = ("gears", name)
    sketch.section("gears")[name] = entry | ({"phase": f"{round(phase, 4):g} deg"} if round(phase % 360.0, 4) else {})
    return f"Add {name}"


def _pivot(sketch: Sketch, end: Any) -> str:
    """The joint that a gear turns in: a pin, or that of a link on the ground."""
    if isinstance(end, Mapping):
        link = str(end.get("on"))
        pins = [name for name, joint in sketch.joints.items() if {*joint["links"]} == {link, sketch.ground}]
        if len(pins) != 1:
            raise refused("has no pivot on the ground", f"links.{link}", "pin one of its ends to the ground first")
        end = pins[0]
    if end not in sketch.joints or sketch.joints[end].get("type", "revolute") != "revolute":
        raise refused("is no pin that turns", str(end), "choose the pivot of a link")
    return str(end)
