"""The model file of a draft: every number as found, every guess as a comment beside it."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.exchange.draft import Array, Body, Draft, Pair, moved
from trunnion.joints.pairs import PAIRS

__all__ = ["complete", "flat_frame", "model_text"]

DIGITS = 12  # significant digits of a written number
FIXED = ("ground", "frame", "base", "housing", "world", "gestell", "rahmen", "bâti")  # in names of fixed parts
TINY = 1e-12  # of the size of the mechanism: below it a coordinate is rounding
USUAL = {True: 2 * math.pi, False: 0.1}  # speeds of joints that turn and slide, rad/s and m/s
STROKE = 0.1  # of the size, of a driven slide whose file states no limits
IN_PLANE = {"revolute", "prismatic"}
RELEASED = {"cylindrical": "revolute", "spherical": "revolute", "planar": ""}  # what a pair is in a plane


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
    draft = replace(draft, findings=list(draft.findings))
    if ground:
        draft.ground = _existing(draft, ground, list(draft.bodies), "part", "--ground")
    draft = draft.welded()
    if not draft.ground and draft.bodies:
        named = [name for name in draft.bodies if any(word in name.casefold() for word in FIXED)]
        joined = {name: len(draft.pairs_of(name)) for name in named or draft.bodies}
        draft.ground = max(joined, key=lambda name: (joined[name], draft.bodies[name].mass))
        reason = "by its name" if named else f"it has the most joints, {joined[draft.ground]}"
        what = f"is taken as the part that does not move: {reason}"
        draft.note("exchange.ground", f"links.{draft.ground}", what, "state it with --ground")
    drivable = [name for name, pair in draft.pairs.items() if draft.ground in pair.links and PAIRS[pair.type].drivable]
    draft.drives = {name: rate for name, rate in draft.drives.items() if name in draft.pairs}
    if drive:
        drive = _existing(draft, drive, list(draft.pairs), "joint", "--drive")
        draft.drives = {drive: draft.drives.get(drive, 0.0)}
    elif not draft.drives and drivable:
        first = min(drivable, key=lambda name: not PAIRS[draft.pairs[name].type].turns)
        draft.drives = {first: 0.0 if speed is not None else USUAL[PAIRS[draft.pairs[first].type].turns]}
        what = "is taken as the driver, at a usual speed: the first joint on the part that does not move"
        draft.note("exchange.drive", f"joints.{first}", what, "state it with --drive and --speed")
    draft.drives = {name: _rate(draft, name, rate, speed, turns) for name, rate in draft.drives.items()}
    return draft


def _rate(draft: Draft, name: str, rate: float, speed: float | None, turns: bool | None) -> float:
    """The rate of a drive: as stated, else that of the file, else a usual one, which is said."""
    does = PAIRS[draft.pairs[name].type].turns
    usual = "60 rpm" if does else "0.1 m/s"
    if speed is not None:
        if turns is not None and turns != does:
            moves = {True: "turns", False: "slides"}
            what = f"is a speed of a joint that {moves[turns]}, and {name} {moves[does]}"
            raise MechanismError(Finding(what, "speed", f"give one such as {usual}"))
        return speed
    if not rate:
        what = f"has no speed in the file; it gets {usual}"
        draft.note("exchange.speed", f"drivers.{name}", what, "state it with --speed")
    return rate or USUAL[does]


def _existing(draft: Draft, name: str, names: list[str], noun: str, option: str) -> str:
    if name in names:
        return name
    from trunnion.model.names import nearest

    remedy = nearest(name, names)
    raise MechanismError(Finding(f"{name!r} is no {noun} of the file", option, remedy, file=draft.source))


def model_text(draft: Draft) -> str:
    """The text of a model file, YAML, of a draft that is `complete`.

    The model is planar if all axes are parallel and all slides normal to them, else spatial. All links have the
    global frame, in a plane that of the plane through the first joint, so the mechanism starts as it is drawn.
    """
    normal = draft.plane_normal()
    if normal is None:
        return "\n".join(_lines(draft, spatial=True)) + "\n"
    return "\n".join(_lines(_laid_flat(draft, normal), spatial=False)) + "\n"


def flat_frame(normal: Array) -> Array:
    """The rotation from the frame of a file to that of a model in the plane with a normal: rows x, y, normal."""
    largest = int(np.argmax(abs(normal)))
    across = np.eye(3)[(largest + 1) % 3]
    x = across - (across @ normal) * normal
    x /= np.linalg.norm(x)
    return np.array([x, np.cross(normal, x), normal])


def _laid_flat(draft: Draft, normal: Array) -> Draft:
    """The draft turned so that z is the normal of its plane; pairs that only a plane allows become those it has."""
    turned = moved(draft, flat_frame(normal), np.zeros(3))
    pairs = {}
    for name, pair in turned.pairs.items():
        if pair.type in IN_PLANE:
            pairs[name] = replace(pair, axis=pair.axis * (1.0 if pair.type == "prismatic" else np.sign(pair.axis[2])))
            if pair.type == "revolute" and pair.axis[2] < 0 and name in turned.drives:
                turned.drives = {**turned.drives, name: -turned.drives[name]}
        elif RELEASED.get(pair.type):
            comment = f"{pair.type} in the file; in a plane it only turns"
            pairs[name] = replace(pair, type=RELEASED[pair.type], comments=[*pair.comments, comment])
        else:
            turned.note("exchange.flat", f"joints.{name}", f"is {pair.type}, which constrains nothing in a plane", "")
    turned.pairs = pairs
    return turned


def _lines(draft: Draft, spatial: bool) -> Iterator[str]:
    if draft.source:
        yield f"# Made of {_comment(draft.source)}. Comments say how each number was found."
    yield "trunnion: 1"
    yield f"name: {_quoted(draft.name or 'Imported mechanism')}"
    yield f"space: {'spatial' if spatial else 'planar'}"
    if draft.gravity is not None:
        yield f"gravity: {_plain(draft.gravity[: 3 if spatial else 2], float(np.abs(draft.gravity).max()))}"
    yield f"ground: {_quoted(draft.ground)}"
    if draft.mobility(planar=not spatial) < len(draft.drives):
        yield "over_constraint: minimum-norm # joints hold more than statics can tell apart"
    yield ""
    yield "links:"
    size = _size(draft)
    for body in draft.bodies.values():
        yield from _link(draft, body, spatial, size)
    yield ""
    yield "joints:" if draft.pairs else "joints: {}"
    for pair in draft.pairs.values():
        yield from _joint(pair, size)
    yield ""
    yield "drivers:" if draft.drives else "drivers: {}"
    for name, rate in draft.drives.items():
        pair = draft.pairs[name]
        if PAIRS[pair.type].turns:
            low, high = pair.limits or (-math.inf, math.inf)
            ends = f", range: [{_number(math.degrees(low))} deg, {_number(math.degrees(high))} deg]"
            closed = high - low >= 2 * math.pi
            speed = _number(rate if closed else abs(rate))
            yield f"  {_quoted(name)}: {{speed: {speed} rad/s{'' if closed else ends}}}"
        else:
            low, high = pair.limits or (0.0, size * STROKE)
            ends = f"range: [{_number(1e3 * low)} mm, {_number(1e3 * high)} mm]"
            yield f"  {_quoted(name)}: {{speed: {_number(abs(rate))} m/s, {ends}}}" + (
                "" if pair.limits else "  # of the file's size; state the stroke"
            )


def _link(draft: Draft, body: Body, spatial: bool, size: float) -> Iterator[str]:
    for comment in body.comments:
        yield f"  # {_comment(comment)}"
    yield f"  {_quoted(body.name)}:"
    yield "    points:" if draft.pairs_of(body.name) or body.points else "    points: {}"
    for pair in draft.pairs_of(body.name):
        yield f"      {_quoted(pair.name)}: {_point(pair, body.name, spatial, size)}"
    for name, place in body.points.items():
        yield f"      {_quoted(name)}: {_place(place, spatial, size)}"
    if body.mass > 0 and body.name != draft.ground:
        yield f"    mass: {_number(body.mass)} kg"
        yield f"    centre: {_place(body.centre, spatial, size)}"
        inertia = body.inertia
        if not spatial:
            yield f"    inertia: {_number(inertia[2, 2])} kg m^2"
        elif np.abs(inertia).max() > 0:
            keys = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
            least = TINY * np.abs(inertia).max()
            parts = {key: inertia[at] for key, at in keys.items() if len(set(at)) == 1 or abs(inertia[at]) > least}
            yield f"    inertia: {{{', '.join(f'{key}: {_number(part)}' for key, part in parts.items())}}}"


def _point(pair: Pair, body: str, spatial: bool, size: float) -> str:
    place = _place(pair.at, spatial, size)
    if not PAIRS[pair.type].needs_axis or (not spatial and pair.type != "prismatic"):
        return place
    axis = pair.axis
    if pair.type == "universal" and pair.second_axis is not None and body == pair.links[1]:
        axis = pair.second_axis
    unit = axis / np.linalg.norm(axis)
    return f"{{at: {place}, axis: {_plain(unit[: 3 if spatial else 2], 1.0)}}}"


def _joint(pair: Pair, size: float) -> Iterator[str]:
    for comment in pair.comments:
        yield f"  # {_comment(comment)}"
    if pair.limits is not None:
        low, high = ((math.degrees(n), "deg") if PAIRS[pair.type].turns else (1e3 * n, "mm") for n in pair.limits)
        yield f"  # moves from {_number(low[0])} to {_number(high[0])} {low[1]} from here"
    parts = [f"type: {pair.type}", f"links: [{', '.join(_quoted(link) for link in pair.links)}]"]
    if pair.pitch is not None:
        parts.append(f"pitch: {_mm(pair.pitch, size)}")
    turns = PAIRS[pair.type].turns
    if turns and pair.pin_radius is not None:
        pin = [f"radius: {_limited(pair.pin_radius, pair.pin_limits, size)}"]
        if pair.length is not None:
            pin.append(f"length: {_mm(pair.length, size)}")
        if pair.hole_radius is not None and (pair.pin_limits or pair.hole_limits):
            pin.append(f"hole_radius: {_limited(pair.hole_radius, pair.hole_limits, size)}")
        elif pair.clearance is not None and pair.clearance > 0:
            pin.append(f"clearance: {_mm(pair.clearance, size)}")
        parts.append(f"pin: {{{', '.join(pin)}}}")
    elif not turns and pair.length is not None and pair.type == "prismatic":
        play = f", clearance: {_mm(pair.clearance, size)}" if pair.clearance else ""
        parts.append(f"guide: {{length: {_mm(pair.length, size)}{play}}}")
    yield f"  {_quoted(pair.name)}: {{{', '.join(parts)}}}"


def _size(draft: Draft) -> float:
    """The largest extent of the places of all pairs, m."""
    places = [pair.at for pair in draft.pairs.values()]
    places += [body.centre for body in draft.bodies.values() if body.mass > 0]
    return float(np.ptp(places, axis=0).max()) if places else 1.0


def _place(place: Array, spatial: bool, size: float) -> str:
    return f"[{', '.join(_mm(float(part), size) for part in place[: 3 if spatial else 2])}]"


def _mm(length: float, size: float) -> str:
    return "0" if abs(length) <= TINY * size else f"{_number(1e3 * length)} mm"


def _limited(radius: float, limits: tuple[float, float] | None, size: float) -> str:
    """A radius between limits that its file states: their middle and half their distance."""
    if limits is None:
        return _mm(radius, size)
    return f"{_mm(radius + sum(limits) / 2, size)} ± {_mm((limits[1] - limits[0]) / 2, size)}"


def _plain(vector: Array, largest: float) -> str:
    parts = ("0" if abs(part) <= TINY * largest else _number(float(part)) for part in vector)
    return f"[{', '.join(parts)}]"


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


def _comment(text: str) -> str:
    """Text that stays a comment: on one line, printable."""
    return "".join(sign if sign.isprintable() else " " for sign in text)[:300]
