"""PMKS+: the links it shares and the files it saves, which hold the same text.

The text is `settings.joints..links..forces..selection.extras`, each of the first four settings and each record ended by
a point, then one sign that checks its length and, in newer ones, `*` and six that check the rest. Numbers are
thousandths to the base 64, those below 0 with a 0 before them; `extras` correct them to full precision.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.exchange.draft import Body, Draft, free_name
from trunnion.exchange.formats import ImportOptions
from trunnion.exchange.pins import GROUND, PlanarPin, few, meet, space

__all__ = ["read", "read_link"]

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


def read(path: Path, options: ImportOptions) -> Draft:
    """Read a saved file, or a text with a link."""
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise MechanismError(_damaged("it is no text", str(path))) from None
    return read_link(text, options, str(path))


def read_link(text: str, options: ImportOptions, file: str = "") -> Draft:
    """Read a link or its query; nothing is fetched."""
    if len(text) > LONGEST:
        raise MechanismError(_damaged(f"it has {len(text):,} signs; at most {LONGEST:,} are read", file))
    lines = (unquote(line).strip().partition("?") for line in text.splitlines())
    queries = [(after or before).strip() for before, _, after in lines]
    if any("pmks2:" in query for query in queries):
        what = "is in the newest format of PMKS+, 'pmks2', which is not read"
        raise MechanismError(Finding(what, file=file, remedy="share it from a version that gives links without it"))
    query = next((query for query in queries if TEXT.fullmatch(query)), None)
    if query is None:
        raise MechanismError(_damaged("it has no link of PMKS+", file))
    try:
        return _draft(_checked(query), file)
    except MechanismError:
        raise
    except (ValueError, IndexError, KeyError):
        raise MechanismError(_damaged("a record of it cannot be read", file)) from None


def _damaged(what: str, file: str) -> Finding:
    remedy = "copy the link again, from Share in PMKS+, or save the drawing there"
    return Finding(f"is no drawing of PMKS+ that can be read: {what}", file=file, remedy=remedy)


def _checked(query: str) -> str:
    """The text without its check signs; ValueError if they do not fit."""
    if re.search(r"\*[0-9A-Za-z]{6}$", query):
        query, digest = query[:-7], query[-6:]
        code = 0x811C9DC5
        for sign in query:
            code = (code ^ ord(sign)) * 0x01000193 & 0xFFFFFFFF
        if code != sum(CHECKS.index(sign) * 62**k for k, sign in enumerate(reversed(digest))):
            raise ValueError
    if CHECKS[(len(query) - 1) % 62] != query[-1]:
        raise ValueError
    return query[:-1]


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


def _sections(text: str) -> tuple[Record, Record, Record, list[str], list[str]]:
    """Settings, joints and links by id, forces, and what corrects or adds to them."""
    few(text.count("."), "")
    flags, scales, speeds, units, *rest = text.split(".")
    settings: Record = {"flags": _integer(flags), "D": [*map(_number, scales.split(",")), 0.0], "unit": int(units[0])}
    settings["I"] = [*map(_integer, speeds.split(","))]
    records, groups = iter(rest), []
    for _ in range(3):
        group = []
        for record in records:
            if not record:
                break
            group.append(record)
        groups.append(group)
    next(records, None)  # what is selected
    extras = [entry for entry in ".".join(records).split(",") if entry]
    joints = {joint["id"]: joint for joint in map(_joint, groups[0])}
    links = {link["id"]: link for link in map(_link, groups[1])}
    if len(joints) + len(links) < len(groups[0]) + len(groups[1]):
        raise ValueError  # two of them have the same name
    if any(name not in joints for link in links.values() for name in link["joints"]):
        raise ValueError
    for entry in extras:
        if entry[0] != "P":
            continue
        name, number, value = entry[1:].split("~")
        if name in ("D", "I"):
            settings[name][int(number)] = float(value)
        elif name[0] in FIELDS:
            (joints if name[0] == "J" else links)[name[1:]][FIELDS[name[0]][int(number)]] = float(value)
    return settings, joints, links, groups[2], extras


def _draft(text: str, file: str) -> Draft:
    settings, joints, links, forces, extras = _sections(text)
    unit, length, mass, inertia = UNITS[settings["unit"]]
    draft = Draft("" if file else "Linkage of PMKS+", {GROUND: Body(GROUND)}, ground=GROUND, plane=True)
    draft.source = "" if file else "link of PMKS+"
    bodies: dict[str, str] = {}  # name of the body by the id of a link
    for link in (link for link in links.values() if link["root"] and not link["block"]):
        name = free_name(link["name"] or link["id"], draft.bodies)
        body = Body(name, link["mass"] * mass, space((link["x"] * length, link["y"] * length)))
        body.inertia = link["inertia"] * inertia * np.diag([0.5, 0.5, 1.0])
        draft.bodies[name] = body
        bodies |= dict.fromkeys([link["id"], *link["parts"]], name)
    sense = -1.0 if settings["flags"] & CLOCKWISE else 1.0
    speeds = sense * settings["I"][0] * math.pi / 30, sense * settings["D"][1] * length
    meet(draft, list(_pins(joints, links, bodies, (length, mass, *speeds))))
    weighed = any(body.mass > 0 for body in draft.bodies.values())
    if weighed:
        what = f"masses and lengths are taken in {unit}"
        draft.note("exchange.unit", "links", what, "mend the masses if the file means others")
    if weighed and not settings["flags"] & WEIGHTLESS:
        draft.gravity = np.array([0.0, -9.81, 0.0])
    if forces:
        draft.lose(f"{len(forces)} forces")
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
