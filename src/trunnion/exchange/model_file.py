"""The model file of a draft: every number as found, every guess as a comment beside it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.exchange.draft import Array, Body, Draft, Pair, moved, printable
from trunnion.joints.pairs import PAIRS
from trunnion.model.names import nearest

DIGITS = 12  # significant digits of a written number
FIXED = ("ground", "frame", "base", "housing", "world", "gestell", "rahmen", "bâti")  # in names of fixed parts
TINY = 1e-12  # of the size of the mechanism: below it a coordinate is rounding
USUAL = {True: 2 * math.pi, False: 0.1}  # speeds of joints that turn and slide, rad/s and m/s
STROKE = 0.1  # of the size, of a driven slide whose file states no limits
RELEASED = {"cylindrical": "revolute", "spherical": "revolute"}  # what a pair is in a plane


def complete(
    draft: Draft, ground: str = "", drive: str = "", speed: float | None = None, turns: bool | None = None
) -> Draft:
    """The draft with welded bodies united, a ground and a drive.

    ground, drive: names that the user states. Without them the ground is the body that the file says, else one with
    such a name, else the one with the most pairs (the heaviest of several); the drive is that of the file, else the
    first pair on the ground that has one coordinate. Both choices are findings. speed: of the drive, rad/s if it
    `turns`, m/s if not; the file's, else a usual one, if not given.
    Raises MechanismError if a stated name is not in the file, or the speed is not one of the driven joint.
    """
    parts = list(draft.bodies)
    draft = replace(draft, ground=ground or draft.ground, findings=list(draft.findings)).welded()
    for name, names, noun, option in ((ground, parts, "part", "--ground"), (drive, draft.pairs, "joint", "--drive")):
        if name and name not in names:
            what = f"{name!r} is no {noun} of the file"
            raise MechanismError(Finding(what, option, nearest(name, names), file=draft.source))
    if not draft.ground and draft.bodies:
        named = [name for name in draft.bodies if any(word in name.casefold() for word in FIXED)]
        joined = {name: len(draft.pairs_of(name)) for name in named or draft.bodies}
        draft.ground = max(joined, key=lambda name: (joined[name], draft.bodies[name].mass))
        reason = "by its name" if named else f"it has the most joints, {joined[draft.ground]}"
        what = f"is taken as the part that does not move: {reason}"
        draft.note("exchange.ground", f"links.{draft.ground}", what, "state it with --ground")
    turning = {name: PAIRS[pair.type].turns for name, pair in draft.pairs.items()}
    drivable = [name for name, pair in draft.pairs.items() if draft.ground in pair.links and PAIRS[pair.type].one_axis]
    draft.drives = {name: rate for name, rate in draft.drives.items() if name in draft.pairs}
    if drive:
        draft.drives = {drive: draft.drives.get(drive, 0.0)}
    elif not draft.drives and drivable:
        first = min(drivable, key=lambda name: not turning[name])
        draft.drives = {first: USUAL[turning[first]]}
        what = "is taken as the driver, at a usual speed: the first joint on the part that does not move"
        draft.note("exchange.drive", f"joints.{first}", what, "state it with --drive and --speed")
    for name, rate in draft.drives.items():
        usual = "60 rpm" if turning[name] else "0.1 m/s"
        if speed is not None and turns is not None and turns != turning[name]:
            moves = {True: "turns", False: "slides"}
            what = f"is a speed of a joint that {moves[turns]}, and {name} {moves[turning[name]]}"
            raise MechanismError(Finding(what, "speed", f"give one such as {usual}"))
        if speed is None and not rate:
            what = f"has no speed in the file; it gets {usual}"
            draft.note("exchange.speed", f"drivers.{name}", what, "state it with --speed")
        draft.drives[name] = speed if speed is not None else rate or USUAL[turning[name]]
    return draft


def model_text(draft: Draft) -> str:
    """The text of a model file, YAML, of a draft that is `complete`.

    The model is planar if all axes are parallel and all slides normal to them, else spatial. All links have the
    global frame, in a plane that of the plane through the first joint, so the mechanism starts as it is drawn.
    """
    normal = draft.plane_normal()
    if normal is not None:  # turned so that z is the normal of its plane; pairs become what a plane allows
        draft = moved(draft, flat_frame(normal), np.zeros(3))
        for name, pair in list(draft.pairs.items()):
            if pair.type == "revolute":
                if pair.axis[2] < 0 and name in draft.drives:
                    draft.drives = {**draft.drives, name: -draft.drives[name]}
                draft.pairs[name] = replace(pair, axis=pair.axis * np.sign(pair.axis[2]))
            elif RELEASED.get(pair.type):
                comment = f"{pair.type} in the file; in a plane it only turns"
                draft.pairs[name] = replace(pair, type=RELEASED[pair.type], comments=[*pair.comments, comment])
            elif pair.type != "prismatic":
                del draft.pairs[name]
                draft.note("exchange.flat", f"joints.{name}", f"is {pair.type}, which constrains nothing in a plane")
    return "\n".join(_Writer(draft, spatial=normal is None).lines()) + "\n"


def flat_frame(normal: Array) -> Array:
    """The rotation from the frame of a file to that of a model in the plane with a normal: rows x, y, normal."""
    largest = int(np.argmax(abs(normal)))
    across = np.eye(3)[(largest + 1) % 3]
    x = across - (across @ normal) * normal
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(normal, x), normal])


class _Writer:
    """The lines of the model file of a draft. Lengths below TINY of its largest extent are rounding."""

    def __init__(self, draft: Draft, spatial: bool) -> None:
        self.draft, self.spatial, self.axes = draft, spatial, 3 if spatial else 2
        places = [pair.at for pair in draft.pairs.values()]
        places += [body.centre for body in draft.bodies.values() if body.mass > 0]
        self.size = float(np.ptp(places, axis=0).max()) if places else 1.0

    def mm(self, length: float) -> str:
        return "0" if abs(length) <= TINY * self.size else f"{_number(1e3 * length)} mm"

    def place(self, point: Array) -> str:
        return f"[{', '.join(self.mm(float(part)) for part in point[: self.axes])}]"

    def plain(self, vector: Array) -> str:
        """A vector in SI, or a direction."""
        least = TINY * float(np.abs(vector).max())
        return f"[{', '.join('0' if abs(part) <= least else _number(part) for part in vector[: self.axes])}]"

    def radius(self, size: float, limits: tuple[float, float] | None) -> str:
        """With limits, the middle between them and half their distance."""
        if limits is None:
            return self.mm(size)
        return f"{self.mm(size + sum(limits) / 2)} ± {self.mm((limits[1] - limits[0]) / 2)}"

    def lines(self) -> Iterator[str]:
        draft = self.draft
        if draft.source:
            yield f"# Made of {printable(draft.source)}. Comments say how each number was found."
        yield "trunnion: 1"
        yield f"name: {_quoted(draft.name or 'Imported mechanism')}"
        yield f"space: {'spatial' if self.spatial else 'planar'}"
        if draft.gravity is not None:
            yield f"gravity: {self.plain(draft.gravity)}"
        yield f"ground: {_quoted(draft.ground)}"
        if draft.mobility(planar=not self.spatial) < len(draft.drives):
            yield "over_constraint: minimum-norm # joints hold more than statics can tell apart"
        yield from ("", "links:")
        for body in draft.bodies.values():
            yield from self.link(body)
        yield from ("", "joints:" if draft.pairs else "joints: {}")
        for pair in draft.pairs.values():
            yield from self.joint(pair)
        yield from ("", "drivers:" if draft.drives else "drivers: {}")
        for name, rate in draft.drives.items():
            pair, note = draft.pairs[name], ""
            low, high = pair.limits or (0.0, self.size * STROKE)
            if not PAIRS[pair.type].turns:
                stated = f"{_number(abs(rate))} m/s, range: [{_number(1e3 * low)} mm, {_number(1e3 * high)} mm]"
                note = "" if pair.limits else "  # of the file's size; state the stroke"
            elif pair.limits and high - low < 2 * math.pi:
                low, high = math.degrees(low), math.degrees(high)
                stated = f"{_number(abs(rate))} rad/s, range: [{_number(low)} deg, {_number(high)} deg]"
            else:
                stated = f"{_number(rate)} rad/s"
            yield f"  {_quoted(name)}: {{speed: {stated}}}{note}"

    def link(self, body: Body) -> Iterator[str]:
        points = {name: self.place(point) for name, point in body.points.items()}
        joints = {}
        for pair in self.draft.pairs_of(body.name):
            joints[pair.name] = self.place(pair.at)
            if PAIRS[pair.type].needs_axis and (self.spatial or pair.type == "prismatic"):
                second = pair.type == "universal" and pair.second_axis is not None and body.name == pair.links[1]
                axis: Any = pair.second_axis if second else pair.axis
                joints[pair.name] = f"{{at: {self.place(pair.at)}, axis: {self.plain(axis / np.linalg.norm(axis))}}}"
        yield from (f"  # {printable(comment)}" for comment in body.comments)
        yield f"  {_quoted(body.name)}:"
        yield "    points:" if joints or points else "    points: {}"
        yield from (f"      {_quoted(name)}: {text}" for name, text in (*joints.items(), *points.items()))
        if body.mass > 0 and body.name != self.draft.ground:
            yield f"    mass: {_number(body.mass)} kg"
            yield f"    centre: {self.place(body.centre)}"
            entries = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
            parts = {key: body.inertia[at] for key, at in entries.items()}
            least = TINY * np.abs(body.inertia).max()
            if not self.spatial:
                yield f"    inertia: {_number(parts['zz'])} kg m^2"
            elif least > 0:
                parts = {key: part for key, part in parts.items() if key[0] == key[1] or abs(part) > least}
                yield f"    inertia: {{{', '.join(f'{key}: {_number(part)}' for key, part in parts.items())}}}"

    def joint(self, pair: Pair) -> Iterator[str]:
        yield from (f"  # {printable(comment)}" for comment in pair.comments)
        turns = PAIRS[pair.type].turns
        if pair.limits is not None:
            factor, unit = (180 / math.pi, "deg") if turns else (1e3, "mm")
            low, high = (_number(factor * end) for end in pair.limits)
            yield f"  # moves from {low} to {high} {unit} from here"
        parts = [f"type: {pair.type}", f"links: [{', '.join(_quoted(link) for link in pair.links)}]"]
        if pair.pitch is not None:
            parts.append(f"pitch: {self.mm(pair.pitch)}")
        length = [] if pair.length is None else [f"length: {self.mm(pair.length)}"]
        play = [f"clearance: {self.mm(pair.clearance)}"] if pair.clearance is not None and pair.clearance > 0 else []
        if turns and pair.pin_radius is not None:
            if pair.hole_radius is not None and (pair.pin_limits or pair.hole_limits):
                play = [f"hole_radius: {self.radius(pair.hole_radius, pair.hole_limits)}"]
            radius = f"radius: {self.radius(pair.pin_radius, pair.pin_limits)}"
            parts.append(f"pin: {{{', '.join([radius, *length, *play])}}}")
        elif pair.type == "prismatic" and length:
            parts.append(f"guide: {{{', '.join([*length, *play])}}}")
        yield f"  {_quoted(pair.name)}: {{{', '.join(parts)}}}"


def _number(value: float) -> str:
    """A number with DIGITS digits, as YAML reads a float: 1.0e-05, not 1e-05."""
    text = f"{value:.{DIGITS}g}"
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa}{'' if '.' in mantissa or not e else '.0'}{e}{exponent}"


def _quoted(name: str) -> str:
    """A name as YAML; in quotes if it is more than a plain word."""
    plain = name.isascii() and name.replace("-", "").replace("_", "").isalnum() and name[:1].isalpha()
    words = {"y", "n", "yes", "no", "on", "off", "true", "false", "null"}
    if plain and name.lower() not in words:
        return name
    escaped = name.replace("\\", "\\\\").replace('"', '\\"')
    return f'"{escaped}"'
