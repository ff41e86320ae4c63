"""What a drawing needs to know of a mechanism beside the positions of its points, as plain data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.space import Frame
from trunnion.joints.pairs import PAIRS
from trunnion.solve.forward import Forward
from trunnion.solve.loads import Stated
from trunnion.solve.shifts import hole, play_of
from trunnion.solve.system import System, Values, rubbing

__all__ = ["COURSE", "DRAWN", "courses", "pitch_circles", "planar", "spatial"]

DRAWN = 360  # positions at which a load that varies is looked at for the drawing
COURSE = 3600  # positions up to which it is drawn as it is at each of them


def planar(system: System, values: Values, walk: Forward, useful: Sequence[str]) -> dict[str, Any]:
    """Of a mechanism in the plane. walk: over the cycle, for loads that vary; useful: names of the useful loads."""
    joints = _joints(system)
    elements = system.elements(values)
    for name, (kind, links) in system.joints.items():
        if "planar" in PAIRS[kind].needs_axis:
            axis = elements[links[0], name]
            joints[name]["axis"] = [float(axis.c), float(axis.s)]
    gears = {name: pitch_circles(system, values, name) for name, gear in system.mechanism.gears.items() if gear.teeth}
    return {**_common(system, values, walk, useful), "space": "planar", "joints": joints, "gears": gears}


def spatial(system: System, values: Values, walk: Forward, useful: Sequence[str]) -> dict[str, Any]:
    """Of a mechanism in space: the elements of its joints (place, z, x) in the frames of both links."""
    joints, elements = _joints(system), system.elements(values)
    for name, (_, links) in system.joints.items():
        frames: list[Any] = [elements[link, name] for link in links]
        joints[name]["frames"] = [_plain(frame) for frame in frames]
    spinning = [spin for module in system.plan.modules for spin in module.spinning]
    passive = [{"link": link, "joints": [a, b]} for link, a, b in spinning]
    plays = _plays(system, values)
    for name, play in plays.items():
        second: Any = elements[system.joints[name][1][1], name]
        play["hole"] = _plain(hole(second, values, name))
    common = {**_common(system, values, walk, useful), "plays": plays}
    return {**common, "space": "spatial", "joints": joints, "gears": {}, "passive": passive}


def _plain(frame: Frame) -> list[list[float]]:
    return [[float(np.ravel(primal(n))[0]) for n in vector] for vector in (frame.place, frame.z, frame.x)]


def _joints(system: System) -> dict[str, Any]:
    rubbed = rubbing(system)
    return {
        name: {"type": kind, "links": list(links), "friction": name in rubbed}
        for name, (kind, links) in system.joints.items()
    }


def _common(system: System, values: Values, walk: Forward, useful: Sequence[str]) -> dict[str, Any]:
    mechanism = system.mechanism
    points: dict[str, list[str]] = {link: [] for link in mechanism.effective_links}
    for link, point in system.points:
        points[link].append(point)
    return {
        "ground": mechanism.fixed_link,
        "links": {name: {"points": own} for name, own in points.items()},
        "drivers": list(mechanism.drivers),
        "loads": _loads(system, values, walk, useful),
        "springs": {
            name: {"between": spring.between and list(spring.between), "joint": spring.joint}
            for name, spring in mechanism.springs.items()
        },
        "plays": _plays(system, values),
    }


def _plays(system: System, values: Values) -> dict[str, dict[str, Any]]:
    """The play of every joint with a seat, m: what has it, to either side, along the axis, length H, pin's radius."""
    found: dict[str, dict[str, Any]] = {}
    for name in system.mechanism.seated:
        play = play_of(system.mechanism.space, system.joints[name][0], values, name)
        if play is None:
            continue
        axial = play.model.axial
        kind = "ball" if len(play.model.ends[0]) == 3 else play.model.size[0] if play.model.size else "pin"
        found[name] = {
            "kind": kind,
            "clearance": _float(next(one for i, one in enumerate(play.radii) if i not in axial)),
            "float": _float(play.radii[axial[0]]) if axial else 0.0,
            "length": _float(play.length) if play.model.size else None,
            "radius": _float(values.get(f"joints.{name}.pin.radius")),
        }
    return found


def _float(number: Number | None) -> float | None:
    """A number for JSON; None of what is not stated."""
    value = None if number is None else float(np.ravel(primal(number))[0])
    return value if value is not None and np.isfinite(value) else None


def pitch_circles(system: System, values: Values, name: str) -> list[dict[str, Any]]:
    """Pitch circles of a gear pair with teeth: the point each turns about, and its radius, m."""
    gear = system.mechanism.gears[name]
    carriers = system.mechanism.carriers(name) or (0, 0)
    links = [system.joints[joint][1] for joint in gear.joints]
    carrier = links[0][carriers[0]]
    elements = system.elements(values)
    one, two = (elements[carrier, joint] for joint in gear.joints)
    sign = 1.0 if carriers[0] == carriers[1] else -1.0
    ratio = sign * float(values[f"gears.{name}.ratio"])
    centres = float(np.hypot(two.x - one.x, two.y - one.y))
    radii = abs(ratio / (ratio - 1)) * centres, abs(1 / (ratio - 1)) * centres
    return [
        {"at": f"{pair[1 - side]}.{joint}", "radius": radius}
        for pair, side, joint, radius in zip(links, carriers, gear.joints, radii, strict=True)
    ]


def _loads(system: System, values: Values, walk: Forward, useful: Sequence[str]) -> dict[str, Any]:
    """The loads as a drawing shows them; of one that varies, its largest value over the cycle."""
    mechanism, stated = system.mechanism, Stated(walk)
    found: dict[str, Any] = {}
    for name, load in mechanism.loads.items():
        path = f"loads.{name}"
        force = _vector(stated, f"{path}.force", mechanism.coordinates)
        moment = (
            _vector(stated, f"{path}.moment", 3) if mechanism.space == "spatial" else _number(stated, path, "moment")
        )
        varies = _varies(system, values, name)
        found[name] = {
            "link": load.link,
            "joint": load.joint,
            "at": load.at,
            "force": force,
            "moment": moment,
            "resists": _number(stated, path, "resisting_torque", "resisting_force"),
            "only": load.only,
            "frame": load.frame,
            "varies": varies,
            "useful": name in useful,
        }
    return found


def _varies(system: System, values: Values, load: str) -> bool:
    """Whether a load has numbers that speak of the motion."""
    return not values.keys() >= {p for p in system.mechanism.parameter_set.entries if p.startswith(f"loads.{load}.")}


def courses(system: System, values: Values, walk: Forward) -> dict[str, dict[str, list[list[float | None]]]]:
    """Of each load that varies the components of its force, N, and moment, N m, and what resists its joint, at every
    position of a walk, to seven digits; None where there is no value."""
    stated, space = Stated(walk), system.mechanism.space == "spatial"
    found: dict[str, dict[str, list[list[float | None]]]] = {}
    for name in [one for one in system.mechanism.loads if _varies(system, values, one)]:
        axes = "xyz"[: system.mechanism.coordinates]
        paths = {"force": [f".force.{axis}" for axis in axes]}
        paths["moment"] = [f".moment.{axis}" for axis in axes] if space else [".moment"]
        paths["resists"] = [
            ".resisting_torque" if f"loads.{name}.resisting_torque" in stated.entries else ".resisting_force"
        ]
        parts = {what: [stated.get(f"loads.{name}{path}") for path in own] for what, own in paths.items()}
        found[name] = {
            what: [_plain_numbers(one, np.shape(walk.time)) for one in own]
            for what, own in parts.items()
            if all(one is not None for one in own)
        }
    return found


def _plain_numbers(number: Number, shape: tuple[int, ...]) -> list[float | None]:
    values = np.broadcast_to(np.asarray(primal(number), float), shape).tolist()
    return [float(f"{value:.7g}") if np.isfinite(value) else None for value in values]


def _vector(stated: Stated, path: str, count: int) -> list[float] | None:
    parts = [stated.get(f"{path}.{axis}") for axis in "xyz"[:count]]
    return None if any(part is None for part in parts) else _largest(*parts)


def _number(stated: Stated, path: str, *keys: str) -> float | None:
    """The one of some numbers that is stated."""
    found = next((number for key in keys if (number := stated.get(f"{path}.{key}")) is not None), None)
    return None if found is None else _largest(found)[0]


def _largest(*components: Number) -> list[float]:
    """The components where the vector is longest; zeros if it never has a value."""
    columns = np.broadcast_arrays(*(np.atleast_1d(one) for one in components))
    size = np.nan_to_num(np.hypot.reduce(np.array(columns)) if len(columns) > 1 else np.abs(columns[0]))
    return [float(np.nan_to_num(one[np.argmax(size)])) for one in columns]
