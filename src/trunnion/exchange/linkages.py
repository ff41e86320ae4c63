"""Planar linkages as programs for them hold them: links and files of PMKS+, and the JSON of pylinkage.

Both have pins at which bars meet, some of them on a slot. The text of PMKS+ is
`settings.joints..links..forces..selection.extras`, each of the first four settings and each record ended by a point,
then one sign that checks its length and, in newer ones, `*` and six that check the rest. Numbers are thousandths to the
base 64, those below 0 with a 0 before them; `extras` correct them to full precision.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from trunnion.exchange.draft import Array, Body, Draft, ImportOptions, Pair, few, free_name, refused
from trunnion.model.names import nearest

GROUND = "ground"
MOST = 2000  # pins and bars of a linkage
LARGEST = 10_000_000  # bytes of a file


@dataclass
class PlanarPin:
    """A place where bodies of a plane meet.

    Parameters
    ----------
    name : later of the joint.
    at : its place, m, (x, y).
    bodies : that turn about it.
    carrier, direction : the body along a line of which it slides, and the direction of the line; it only turns without.
    welded : whether its bodies slide without turning.
    mass : of the block that slides, kg.
    drive : rate of its turn or slide, rad/s or m/s; 0 if it is driven at a rate that is not stated.
    """

    name: str
    at: Sequence[float]
    bodies: list[str] = field(default_factory=list)
    carrier: str = ""
    direction: Sequence[float] = (1.0, 0.0)
    welded: bool = False
    mass: float = 0.0
    drive: float | None = None


def read(path: Path, options: ImportOptions) -> Draft:
    """Read a saved file of PMKS+ or a text with a link to it, or what `mechanism_to_json` of pylinkage has written."""
    few(path.stat().st_size, LARGEST, "bytes")
    text = path.read_text(encoding="utf-8-sig")
    return _of_pylinkage(json.loads(text), options) if path.suffix.lower() == ".json" else read_link(text, saved=True)


def _space(place: Sequence[float]) -> Array:
    """A place of the plane in space."""
    return np.array([place[0], place[1], 0.0])


def _meet(draft: Draft, pins: Sequence[PlanarPin]) -> Draft:
    """Add the pairs of pins to a draft that has their bodies.

    A pin of n bodies becomes n − 1 revolute pairs, with the ground first; that of a single body a point of it. On a
    slot slides a block, about which the bodies turn, or to which they are fixed.
    """
    for pin in pins:
        at, turns = _space(pin.at), "fixed" if pin.carrier and pin.welded else "revolute"
        bodies = sorted(dict.fromkeys(pin.bodies), key=lambda name: name != GROUND)
        joints = [(pin.name, turns, bodies[0], other) for other in bodies[1:]]
        if pin.carrier and bodies:
            block = free_name(f"{pin.name} block", draft.bodies)
            draft.bodies[block] = Body(block, pin.mass, at, comments=[f"the block that slides at {pin.name}"])
            joints = [(f"{pin.name} slide", "prismatic", pin.carrier, block)]
            joints += [(pin.name, turns, body, block) for body in bodies]
        elif len(bodies) == 1:
            points = draft.bodies[bodies[0]].points
            points[free_name(pin.name, points)] = at
        for number, (text, kind, first, second) in enumerate(joints):
            name = free_name(text, draft.pairs)
            axis = _space(pin.direction) if kind == "prismatic" else np.array([0.0, 0.0, 1.0])
            draft.pairs[name] = Pair(name, kind, (first, second), at, axis)
            if number == 0 and pin.drive is not None:
                draft.drives[name] = pin.drive
    return draft


# ---- PMKS+ --------------------------------------------------------------------------------------------------------

DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
CHECKS = DIGITS[:62]
LONGEST = 1_000_000  # signs of a link
TEXT = re.compile(r"[\w-]{1,3}\.[\w,-]+\.[\w,-]+\.[0-3]{3,4}\..*", re.ASCII)
# length in m, mass in kg, moment of inertia in kg m² of a unit, by the first of the settings in words
UNITS = (
    ("in, lb and lb in²", 0.0254, 0.45359237, 0.45359237 * 0.0254**2),
    ("cm, g and kg cm²", 1e-2, 1e-3, 1e-4),
    ("m, kg and kg m²", 1.0, 1.0, 1.0),
)
ROOTS = "YAMG0123"  # first signs of links that are whole bodies; the others are parts of them
CLOCKWISE, WEIGHTLESS = 1 << 0, 1 << 8  # of the flags in the settings
SLIDES, DRIVEN, GROUNDED, WELDED = 1, 2, 4, 8  # of the flags of a joint
# what a correction means, by the kind of the record: in the order of its number
FIELDS = {"J": ("x", "y", "angle", "speed", "mass"), "L": ("mass", "inertia", "x", "y")}
Record = dict[str, Any]


def read_link(text: str, saved: bool = False) -> Draft:
    """Read a link or its query; nothing is fetched. saved: whether it comes from a file."""
    few(len(text), LONGEST, "signs")
    lines = (unquote(line).strip().partition("?") for line in text.splitlines())
    queries = [(after or before).strip() for before, _, after in lines]
    if any("pmks2:" in query for query in queries):
        what = "is in the newest format of PMKS+, 'pmks2', which is not read"
        raise refused(what, "", "share it from a version that gives links without it")
    query = next((query for query in queries if TEXT.fullmatch(query)), None)
    if query is None:
        raise refused("has no link of PMKS+", "", "copy the link from Share in PMKS+, or save the drawing there")
    draft = Draft("" if saved else "Linkage of PMKS+", {GROUND: Body(GROUND)}, ground=GROUND, plane=True)
    draft.source = "" if saved else "link of PMKS+"
    if re.search(r"\*[0-9A-Za-z]{6}$", query):
        query, digest = query[:-7], query[-6:]
        code = 0x811C9DC5
        for sign in query:
            code = (code ^ ord(sign)) * 0x01000193 & 0xFFFFFFFF
        if code != sum(CHECKS.index(sign) * 62**k for k, sign in enumerate(reversed(digest))):
            raise ValueError("the signs at its end are not those of its text")
    if CHECKS[(len(query) - 1) % 62] != query[-1]:
        raise ValueError("the sign at its end is not that of its length")
    return _drawing(query[:-1], draft)


def _integer(text: str) -> int:
    value = 0
    for sign in text:
        value = 64 * value + DIGITS.index(sign)
    return -value if text[:1] == "0" else value


def _number(text: str) -> float:
    return _integer(text) / 1000


def _joint(text: str) -> Record:
    flags, (name, label, x, y, angle, *rest) = DIGITS.index(text[0]), text[1:].split(",")
    carrier, first, second, speed, *_ = [*rest, "", "", "", ""]
    return {
        "id": name, "name": label, "x": _number(x), "y": _number(y), "angle": _number(angle), "flags": flags,
        "slot": (carrier, first, second), "speed": _number(speed), "mass": 0.0,
    }  # fmt: skip


def _link(text: str) -> Record:
    name, label, mass, inertia, x, y, _, *rest = text[2:].split(",")
    end = rest.index("")
    return {
        "id": name, "name": label, "root": text[0] in ROOTS, "block": text[1] == "P", "mass": _number(mass),
        "inertia": _number(inertia), "x": _number(x), "y": _number(y), "joints": rest[:end],
        "parts": [part for part in rest[end + 1 :] if part],
    }  # fmt: skip


def _drawing(text: str, draft: Draft) -> Draft:
    """The draft of the text without its check signs."""
    few(text.count("."), MOST, "joints and links")
    flags, scales, speeds, units, *rest = text.split(".")
    settings: Record = {"D": [*map(_number, scales.split(",")), 0.0], "I": [*map(_integer, speeds.split(","))]}
    groups: list[list[str]] = []
    for _ in range(3):  # joints, links and forces
        end = rest.index("") if "" in rest else len(rest)
        groups.append(rest[:end])
        rest = rest[end + 1 :]
    extras = [entry for entry in ".".join(rest[1:]).split(",") if entry]  # after what is selected
    joints = {joint["id"]: joint for joint in map(_joint, groups[0])}
    links = {link["id"]: link for link in map(_link, groups[1])}
    strange = any(name not in joints for link in links.values() for name in link["joints"])
    if strange or len(joints) + len(links) < len(groups[0]) + len(groups[1]):
        raise ValueError("two records have the same name, or a link names a joint that there is not")
    for entry in (entry for entry in extras if entry[0] == "P"):
        name, number, value = entry[1:].split("~")
        if name in ("D", "I"):
            settings[name][int(number)] = float(value)
        elif name[0] in FIELDS:
            (joints if name[0] == "J" else links)[name[1:]][FIELDS[name[0]][int(number)]] = float(value)
    unit, length, mass, inertia = UNITS[int(units[0])]
    bodies: dict[str, str] = {}  # name of the body by the id of a link
    for link in (link for link in links.values() if link["root"] and not link["block"]):
        name = free_name(link["name"] or link["id"], draft.bodies)
        body = Body(name, link["mass"] * mass, _space((link["x"] * length, link["y"] * length)))
        body.inertia = link["inertia"] * inertia * np.diag([0.5, 0.5, 1.0])
        draft.bodies[name] = body
        bodies |= dict.fromkeys([link["id"], *link["parts"]], name)
    sense = -1.0 if _integer(flags) & CLOCKWISE else 1.0
    speeds_of = sense * settings["I"][0] * math.pi / 30, sense * settings["D"][1] * length
    _meet(draft, list(_pins(joints, links, bodies, (length, mass, *speeds_of))))
    if any(body.mass > 0 for body in draft.bodies.values()):
        what = f"masses and lengths are taken in {unit}"
        draft.note("exchange.unit", "links", what, "mend the masses if the file means others")
        draft.gravity = None if _integer(flags) & WEIGHTLESS else np.array([0.0, -9.81, 0.0])
    if groups[2]:
        draft.lose(f"{len(groups[2])} forces")
    if lost := [entry for entry in extras if entry[0] not in "PJLFCSK"]:
        draft.lose(f"{len(lost)} records such as gears and holds")
    return draft


def _pins(
    joints: Mapping[str, Record], links: Mapping[str, Record], bodies: Mapping[str, str], scale: tuple[float, ...]
) -> Iterator[PlanarPin]:
    """The pins of a drawing. A slider is a joint of its links, or a block between such a joint and a pin."""
    length, mass, turning, sliding = scale
    blocks = [link for link in links.values() if link["block"]]
    sliders = {name: block for block in blocks for name in block["joints"] if joints[name]["flags"] & SLIDES}
    pinned = {name: slider for slider, block in sliders.items() for name in block["joints"] if name != slider}
    for name, joint in joints.items():
        if name in sliders:
            continue
        slider = joints[pinned.get(name, name)]
        members = [bodies[key] for key, link in links.items() if key in bodies and name in link["joints"]]
        pin = PlanarPin(joint["name"] or name, (joint["x"] * length, joint["y"] * length), members)
        flags, (carrier, first, second) = joint["flags"] | slider["flags"], slider["slot"]
        if slider["flags"] & SLIDES:
            block = sliders.get(slider["id"], slider)
            pin.mass, pin.welded = block["mass"] * mass, bool(flags & WELDED)
            pin.carrier = bodies[carrier] if carrier else GROUND
            pin.direction = math.cos(slider["angle"]), math.sin(slider["angle"])
            if carrier:
                ends = joints[first], joints[second]
                pin.direction = ends[1]["x"] - ends[0]["x"], ends[1]["y"] - ends[0]["y"]
        elif flags & GROUNDED:
            pin.bodies.append(GROUND)
        if flags & DRIVEN:
            speed = slider["speed"] or joint["speed"]
            pin.drive = (speed * length or sliding) if pin.carrier else (speed * math.pi / 30 or turning)
        yield pin


# ---- pylinkage ----------------------------------------------------------------------------------------------------

WRITTEN = "write it with pylinkage.mechanism.mechanism_to_json"


class _Part(dict[str, Any]):
    """A joint or link of the file, which says what it lacks."""

    def __missing__(self, key: str) -> Any:
        raise refused(f"has {str(self.get('id', 'a joint or link'))!r} without {key!r}", "", WRITTEN)


def _joint_pins(joints: Sequence[Record], unit: float) -> dict[str, PlanarPin]:
    """The pins of the joints, by their names."""
    pins = dict[str, PlanarPin]()
    for joint in joints:
        name, place = joint["id"], joint["position"]
        if any(part is None for part in place):
            what = f"{name!r} has no place: it has not been worked out yet"
            raise refused(what, f"joints.{name}", "step the linkage once before it is saved")
        x, y = (float(part) * unit for part in place)
        pins[name] = PlanarPin(str(joint.get("name") or name), (x, y))
        if joint.get("type") == "prismatic":
            pins[name].carrier, pins[name].direction = GROUND, [float(part) for part in joint["axis"]]
    if len(pins) < len(joints):
        raise refused("has two joints of the same name", "", WRITTEN)
    return pins


def _of_pylinkage(data: Any, options: ImportOptions) -> Draft:
    """The draft of a mechanism: links name their joints, a tracker is a point of the link that has both its joints."""
    rows: list[Any] = [data.get(key) if isinstance(data, dict) else None for key in ("joints", "links")]
    if not all(isinstance(row, list) and all(isinstance(part, dict) for part in row) for row in rows):
        raise refused("has no joints and links of pylinkage", "", WRITTEN)
    joints, links = ([_Part(part) for part in row] for row in rows)
    few(len(joints), MOST, "joints")
    draft = Draft(str(data.get("name") or ""), {GROUND: Body(GROUND)}, ground=GROUND, plane=True)
    pins = _joint_pins(joints, draft.assumed_unit(options))

    def pin_of(name: Any) -> PlanarPin:
        if name not in pins:
            raise refused(f"{name!r} is no joint of the file", "joints", nearest(str(name), pins))
        return pins[name]

    for link in links:
        kind, name = link.get("type", "link"), GROUND
        if kind != "ground" and link["id"] != data.get("ground"):
            name = free_name(str(link.get("name") or link["id"]), draft.bodies)
            draft.bodies[name] = Body(name)
        for pin in map(pin_of, link["joints"]):
            pin.bodies += [name] * (name != pin.carrier)  # the frame has the line that a slider is on
        if kind in ("driver", "arc_driver") and link.get("motor_joint"):
            pin_of(link["motor_joint"]).drive = 0.0
    for joint in joints:
        if joint.get("type") == "ground":
            pins[joint["id"]].bodies.append(GROUND)
    for joint in (joint for joint in joints if joint.get("type") == "tracker"):
        first, second = (pin_of(joint[f"ref_joint{number}_id"]).bodies for number in (1, 2))
        pins[joint["id"]].bodies += [name for name in first if name in second][:1]
    return _meet(draft, list(pins.values()))
