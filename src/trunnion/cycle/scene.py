"""What a drawing needs to know of a mechanism beside the positions of its points, as plain data."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal, single
from trunnion.algebra.namespace import Number
from trunnion.algebra.space import Frame
from trunnion.solve.loads import Stated, stated_walk, useful_loads
from trunnion.solve.run import Run
from trunnion.solve.shifts import hole, play_of
from trunnion.solve.system import System, Values, rubbing

DRAWN = 360  # positions at which a load that varies is looked at for the drawing
COURSE = 3600  # positions up to which it is drawn as it is at each of them


def scene_of(run: Run) -> dict[str, Any]:
    """Links, joints, drivers, loads, springs, gears and plays; of joints in space the elements (place, z, x) in the
    frames of both links."""
    system, values, mechanism = run.system, run.values, run.system.mechanism
    elements, rubbed, spatial = system.elements(values), rubbing(system), mechanism.space == "spatial"
    points: dict[str, list[str]] = {link: [] for link in mechanism.effective_links}
    for link, point in system.points:
        points[link].append(point)
    joints: dict[str, dict[str, Any]] = {}
    plays = {name: play for name in mechanism.seated if (play := _play(system, values, name)) is not None}
    for name, joint in system.joints.items():
        joints[name] = {"type": joint.type, "links": list(joint.links), "friction": name in rubbed}
        if spatial:
            frames: list[Any] = [elements[link, name] for link in joint.links]
            joints[name]["frames"] = [_plain(frame) for frame in frames]
            if name in plays:
                plays[name]["hole"] = _plain(hole(frames[1], values, name))
        elif "planar" in joint.pair.needs_axis:
            axis = elements[joint.links[0], name]
            joints[name]["axis"] = [float(axis.c), float(axis.s)]
    teeth = [name for name, gear in mechanism.gears.items() if gear.touches and not spatial]
    # what each measure of the model is of, in words: "slide of S", "effort of A"
    measures = {
        name: f"{entry.kind.replace('_', ' ')} of {entry.subject}{f'.{entry.axis}' if entry.axis else ''}"
        for name, entry in mechanism.measures.items()
    }
    spinning = [spin for module in system.plan.modules for spin in module.spinning]
    return {
        "space": mechanism.space,
        "ground": mechanism.fixed_link,
        "links": {name: {"points": names} for name, names in points.items()},
        "joints": joints,
        "drivers": list(mechanism.drivers),
        "loads": _loads(run),
        "springs": {
            name: {"between": spring.between and list(spring.between), "joint": spring.joint}
            for name, spring in mechanism.springs.items()
        },
        "gears": {name: pitch_circles(system, values, name) for name in teeth},
        "plays": plays,
        **({"measures": measures} if measures else {}),
        **({"passive": [{"link": link, "joints": [a, b]} for link, a, b in spinning]} if spatial else {}),
    }


def _plain(frame: Frame) -> list[list[float]]:
    return [[single(n) for n in vector] for vector in (frame.place, frame.z, frame.x)]


def _play(system: System, values: Values, name: str) -> dict[str, Any] | None:
    """The play of a joint with a seat, m: what has it, to either side, along the axis, length H, pin's radius."""
    play = play_of(system.mechanism.space, system.joints[name].type, values, name)
    if play is None:
        return None
    axial = play.model.axial
    kind = "ball" if len(play.model.ends[0]) == 3 else play.model.size[0] if play.model.size else "pin"
    return {
        "kind": kind,
        "clearance": _float(next(radius for i, radius in enumerate(play.radii) if i not in axial)),
        "float": _float(play.radii[axial[0]]) if axial else 0.0,
        "length": _float(play.length) if play.model.size else None,
        "radius": _float(values.get(f"joints.{name}.pin.radius")),
    }


def _float(number: Number | None) -> float | None:
    """A number for JSON; None of what is not stated."""
    value = None if number is None else single(number)
    return value if value is not None and np.isfinite(value) else None


def pitch_circles(system: System, values: Values, name: str) -> list[dict[str, Any]]:
    """Pitch circles of a gear pair with teeth, or of the wheel of a rack, chain or rope: their centres and radii, m."""
    gear, joints = system.mechanism.gears[name], system.mechanism.coupled(name)
    carriers = system.mechanism.carriers(name) or (0, 0)
    links = [system.joints[joint].links for joint in joints]
    if gear.slides:
        carried = links[0][1 - carriers[0]]
        return [{"at": f"{carried}.{joints[0]}", "radius": abs(float(system.ratio(values, name)))}]
    elements = system.elements(values)
    first, second = (elements[links[0][carriers[0]], joint] for joint in joints)
    sign = 1.0 if carriers[0] == carriers[1] else -1.0
    ratio = sign * float(values[f"gears.{name}.ratio"])
    centres = float(np.hypot(second.x - first.x, second.y - first.y))
    radii = abs(ratio / (ratio - 1)) * centres, abs(1 / (ratio - 1)) * centres
    return [
        {"at": f"{pair[1 - side]}.{joint}", "radius": radius}
        for pair, side, joint, radius in zip(links, carriers, joints, radii, strict=True)
    ]


# ---- loads ----------------------------------------------------------------------------------------------------


def _loads(run: Run) -> dict[str, Any]:
    """The loads as a drawing shows them; of one that varies, its largest value over the cycle."""
    mechanism, useful = run.system.mechanism, useful_loads(run.system.mechanism)
    numbers = _numbers(run, run.cycle.times(DRAWN))
    loads: dict[str, Any] = {}
    for name, load in mechanism.loads.items():
        largest = {what: _largest(parts) for what, parts in numbers[name].items()}
        moment, resists = largest.get("moment"), largest.get("resists")
        loads[name] = {
            "link": load.link,
            "joint": load.joint,
            "at": load.at,
            "force": largest.get("force"),
            "moment": moment and (moment if mechanism.space == "spatial" else moment[0]),
            "resists": resists and resists[0],
            "only": load.only,
            "frame": load.frame,
            "varies": _varies(run, name),
            "useful": name in useful,
        }
    return loads


def load_courses(run: Run, time: NDArray[np.float64]) -> dict[str, Any]:
    """Of each load that varies the components of its force, N, and moment, N m, and what resists its joint, at every
    position, to seven digits; None where there is no value. Beyond COURSE positions a drawing shows the largest."""
    varying = [name for name in run.system.mechanism.loads if _varies(run, name)]
    if len(time) > COURSE or not varying:
        return {}
    numbers = _numbers(run, time)

    def plain(number: Number) -> list[float | None]:
        values = np.broadcast_to(np.asarray(primal(number), float), time.shape).tolist()
        return [float(f"{value:.7g}") if np.isfinite(value) else None for value in values]

    courses = {
        name: {what: [plain(part) for part in parts] for what, parts in numbers[name].items()} for name in varying
    }
    return {"load_courses": courses}


def _numbers(run: Run, time: NDArray[np.float64]) -> dict[str, dict[str, list[Number]]]:
    """Force, moment and resistance of every load, of those that it states, at times, s."""
    steady = Stated(stated_walk(run.system, run.values, run.chosen.assembly, time))
    axes, space = "xyz"[: run.system.mechanism.coordinates], run.system.mechanism.space == "spatial"
    numbers: dict[str, dict[str, list[Number]]] = {}
    for name in run.system.mechanism.loads:
        keys = {
            "force": [f"force.{axis}" for axis in axes],
            "moment": [f"moment.{axis}" for axis in axes] if space else ["moment"],
            "resists": ["resisting_torque"],
        }
        if steady.get(f"loads.{name}.resisting_torque") is None:
            keys["resists"] = ["resisting_force"]
        parts = {what: [steady.get(f"loads.{name}.{key}") for key in paths] for what, paths in keys.items()}
        numbers[name] = {
            what: [part for part in rows if part is not None]
            for what, rows in parts.items() if all(part is not None for part in rows)
        }  # fmt: skip
    return numbers


def _varies(run: Run, load: str) -> bool:
    """Whether a load has numbers that speak of the motion."""
    paths = {path for path in run.system.mechanism.parameter_set.entries if path.startswith(f"loads.{load}.")}
    return not run.values.keys() >= paths


def _largest(components: list[Number]) -> list[float]:
    """The components where the vector is longest; zeros if it never has a value."""
    columns = np.broadcast_arrays(*(np.atleast_1d(part) for part in components))
    size = np.nan_to_num(np.hypot.reduce(np.array(columns)) if len(columns) > 1 else np.abs(columns[0]))
    return [float(np.nan_to_num(column[np.argmax(size)])) for column in columns]
