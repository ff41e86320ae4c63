"""The mechanism as driver and Assur-group blocks wired by their pins, and what passes the wires at each position."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.solve.system import System

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["blocks_of"]


def blocks_of(system: System, result: xr.Dataset) -> dict[str, Any]:
    """Return blocks and wires of a solved mechanism.  [D 17, Fig. 9]

    Returns
    -------
    dict
        blocks: in the order of solution, the ground first: label, kind, links, joints (those inside, and all), and
        their share of the friction power at each position. wires: one for each joint between two blocks, from the
        block that is solved earlier: joint, type, the two links, the motion that goes forward (position, m, velocity,
        m/s, by axis; in the plane angle, rad, and rate, rad/s, of the earlier link) and the load that comes back
        (force by axis, N, and moment, N m, on the earlier link, friction included).
    """
    home = {system.mechanism.fixed_link: 0}
    blocks: list[dict[str, Any]] = [{"label": "ground", "kind": "ground", "links": [system.mechanism.fixed_link]}]
    wires = []
    for number, module in enumerate(system.plan.modules, start=1):
        home |= dict.fromkeys(module.links, number)
        inner = []
        for joint in module.joints:
            kind, links = system.joints[joint]
            earlier = next((link for link in links if home.get(link, number) != number), None)
            if earlier is None:
                inner.append(joint)
                continue
            later = next(link for link in links if link != earlier)
            wire = {"joint": joint, "type": kind, "from": home[earlier], "to": number, "links": [earlier, later]}
            wires.append(wire | _passing(system, result, joint, earlier, later))
        blocks.append({
            "label": module.label, "kind": "driver" if module.rank == 1 else module.kind, "links": list(module.links),
            "inner": inner, "driven": list(module.driven), "gears": list(module.gears),
            "share": _share(result, module.joints),
        })  # fmt: skip
    return {"blocks": blocks, "wires": wires}


def _passing(system: System, result: xr.Dataset, joint: str, earlier: str, later: str) -> dict[str, Any]:
    """What a wire carries forward and back at every position."""
    axes = [str(axis) for axis in result["axis"].values]
    key = f"{later}.{joint}"
    if key not in result["point"].values:
        return {"forward": {}, "back": {}}
    forward: dict[str, Any] = {
        name: dict(zip(axes, result[f"point_{name}"].sel(point=key).values, strict=True))
        for name in ("position", "velocity")
    }
    if not system.spatial:
        forward["angle"] = result["link_angle"].sel(link=earlier).values
        forward["rate"] = result["link_angle_velocity"].sel(link=earlier).values
    sign = -1.0 if system.joints[joint][1][1] == later else 1.0  # reactions are on the second link, by the first
    moment = sign * result["reaction_moment"].sel(joint=joint).values
    friction = result["friction_torque" if system.turns(joint) else "friction_force"].sel(joint=joint).values
    back = {
        "force": dict(zip(axes, sign * result["reaction_force"].sel(joint=joint).values, strict=True)),
        "moment": dict(zip(axes, moment, strict=True)) if moment.ndim > 1 else moment,
        "friction": sign * friction,
    }
    return {"forward": forward, "back": back}


def _share(result: xr.Dataset, joints: tuple[str, ...]) -> np.ndarray:
    """The share of some joints in the power that friction takes, at every position; NaN where there is none."""
    power = np.abs(result["friction_power"].values)
    joint_loss = np.abs(result["friction_power"].sel(joint=list(joints)).values).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(joint_loss / power.sum(axis=0))
