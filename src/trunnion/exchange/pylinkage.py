"""pylinkage: the JSON of a mechanism, with its joints and links."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from trunnion.errors import Finding, MechanismError
from trunnion.exchange.draft import Body, Draft, free_name
from trunnion.exchange.formats import ImportOptions
from trunnion.exchange.pins import GROUND, PlanarPin, few, meet
from trunnion.model.names import nearest

__all__ = ["read"]

LARGEST = 10_000_000  # bytes of a file
Item = Mapping[str, Any]


def read(path: Path, options: ImportOptions) -> Draft:
    """Read what `mechanism_to_json` has written."""
    if path.stat().st_size > LARGEST:
        raise _wrong(f"has more than {LARGEST:,} bytes", str(path))
    try:
        data = json.loads(path.read_text(encoding="utf-8-sig"))
    except (ValueError, RecursionError):
        raise _wrong("is no JSON that can be read", str(path)) from None
    joints = data.get("joints") if isinstance(data, dict) else None
    if not isinstance(joints, list) or not all(isinstance(joint, dict) for joint in joints):
        raise _wrong("has no joints of pylinkage with places", str(path))
    few(len(joints), str(path))
    names = [joint.get("id", joint.get("name")) for joint in joints]
    if len(set(map(str, names))) < len(names):
        raise _wrong("has two joints of the same name", str(path))
    draft = Draft(str(data.get("name") or ""), {GROUND: Body(GROUND)}, ground=GROUND, plane=True)
    draft.note("exchange.unit", "", f"lengths are taken in units of {options.unit:g} m", "state another with --unit")
    try:
        pins = _mechanism(draft, data, options.unit)
    except MechanismError:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, IndexError):
        raise _wrong("has a joint or link without what it needs", str(path)) from None
    meet(draft, list(pins.values()))
    return draft


def _wrong(what: str, file: str) -> MechanismError:
    remedy = "write it with pylinkage.mechanism.mechanism_to_json"
    return MechanismError(Finding(what, file=file, remedy=remedy))


def _place(name: str, place: Sequence[Any], unit: float) -> tuple[float, float]:
    """A place in m; MechanismError if it is not stated."""
    if any(part is None for part in place):
        what = f"{name!r} has no place: it has not been worked out yet"
        raise MechanismError(Finding(what, f"joints.{name}", "step the linkage once before it is saved"))
    x, y = (float(part) * unit for part in place)
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError
    return x, y


def _one_of(name: Any, names: Mapping[str, Any]) -> str:
    if name in names:
        return str(name)
    raise MechanismError(Finding(f"{name!r} is no joint of the file", "joints", nearest(str(name), names)))


def _mechanism(draft: Draft, data: Item, unit: float) -> dict[str, PlanarPin]:
    """The pins of a mechanism: links name their joints, a tracker is a point of the link that has both its joints."""
    pins, trackers = dict[str, PlanarPin](), []
    for joint in data["joints"]:
        pin = PlanarPin(str(joint.get("name") or joint["id"]), _place(joint["id"], joint["position"], unit))
        pins[joint["id"]] = pin
        if joint.get("type") == "prismatic":
            pin.carrier, pin.direction = GROUND, [float(part) for part in joint["axis"]]
        elif joint.get("type") == "tracker":
            trackers.append((pin, joint["ref_joint1_id"], joint["ref_joint2_id"]))
    for link in data["links"]:
        kind, name = link.get("type", "link"), GROUND
        if kind != "ground" and link["id"] != data.get("ground"):
            name = free_name(str(link.get("name") or link["id"]), draft.bodies)
            draft.bodies[name] = Body(name)
        for pin in (pins[_one_of(joint, pins)] for joint in link["joints"]):
            pin.bodies += [name] * (name != pin.carrier)  # the frame has the line that a slider is on
        if kind in ("driver", "arc_driver") and link.get("motor_joint"):
            pins[_one_of(link["motor_joint"], pins)].drive = 0.0
    for joint in data["joints"]:
        if joint.get("type") == "ground":
            pins[joint["id"]].bodies.append(GROUND)
    for pin, first, second in trackers:
        shared = [name for name in pins[first].bodies if name in pins[second].bodies]
        pin.bodies += shared[:1]
    return pins
