"""What is told of a solved mechanism over its drawing: centres, angles, seats, blocks and wires, the worst corner."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.measures.measures import chosen, outputs
from trunnion.model.mechanism import Mechanism
from trunnion.results.quantities import quantity
from trunnion.solve.forward import Forward
from trunnion.solve.run import Run, prepare
from trunnion.solve.shifts import play_of
from trunnion.solve.system import System
from trunnion.studies.design import instant_centres, transmission_angles
from trunnion.studio.message import Exact
from trunnion.studio.placed import column
from trunnion.views.cycle.deviations import seated
from trunnion.views.cycle.scene import scene

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.studies.tolerance.first_order import ToleranceStudy

__all__ = ["blocks_of", "centres_of", "corner_of", "measured", "seats_of", "transmission_of"]

MOST_LINKS = 12  # whose instant centres against each other are told; of more only those against the ground


def centres_of(walk: Forward, steps: int) -> list[dict[str, Any]]:
    """Instant centres of the pairs of links; `ground`: whether one of them is it."""
    ground = walk.system.mechanism.fixed_link
    return [
        {**vars(row), "ground": ground in row.pair, "far": row.far and dict(zip("xy", row.far, strict=True))}
        for row in instant_centres(walk, steps, MOST_LINKS)
    ]


def seats_of(result: xr.Dataset) -> list[dict[str, Any]]:
    """Of each joint with a seat, at each end: offset of the pin from the middle of its hole, m, and force of the pin on
    the hole, N, both in the hole's axes.
    """
    return [
        {
            "joint": seat.joint, "kind": seat.kind, "clearance": seat.clearance, "length": seat.length,
            "ends": [{what: {axis: Exact(row) for axis, row in zip("xy", rows, strict=True)}
                      for what, rows in (("offset", offset), ("force", force))}
                     for offset, force in zip(seat.offsets, seat.forces, strict=True)],
        }
        for seat in seated(result)
    ]  # fmt: skip


@np.errstate(all="ignore")
def transmission_of(walk: Forward, steps: int) -> list[dict[str, Any]]:
    """Transmission angle of each dyad, rad, 0 … π/2, and its middle joint."""
    middle = {"-".join(module.joints): module.joints[1:2] for module in walk.system.plan.modules}
    angles = transmission_angles(walk)
    return [{"name": name, "joint": joint, "angle": column(angle, steps)}
            for name, angle in angles.items() for joint in middle[name]]  # fmt: skip


# ---- blocks and wires -------------------------------------------------------------------------------------------


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
    back = {
        "force": dict(zip(axes, sign * result["reaction_force"].sel(joint=joint).values, strict=True)),
        "moment": dict(zip(axes, moment, strict=True)) if moment.ndim > 1 else moment,
        "friction": result["friction_torque" if system.turns(joint) else "friction_force"].sel(joint=joint).values,
    }
    return {"forward": forward, "back": back}


def _share(result: xr.Dataset, joints: tuple[str, ...]) -> np.ndarray:
    """The share of some joints in the power that friction takes, at every position; NaN where there is none."""
    power = np.abs(result["friction_power"].values)
    joint_loss = np.abs(result["friction_power"].sel(joint=list(joints)).values).sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.asarray(joint_loss / power.sum(axis=0))


# ---- the worst corner ---------------------------------------------------------------------------------------------


def measured(run: Run) -> dict[str, list[str]]:
    """What the page offers: `worst`, measures that have a worst corner, none where nothing has a tolerance or a play;
    `unseated`, joints whose pins lie nowhere in their play.
    """
    system, mechanism = run.system, run.system.mechanism
    loose = [name for name, (kind, _) in system.joints.items()
             if play_of(mechanism.space, kind, run.values, name) is not None]  # fmt: skip
    varies = loose or mechanism.tolerated()
    measures = (chosen(mechanism, None, run.values) or outputs(system)) if varies else []
    unseated = [name for name in loose if name not in mechanism.seated]
    return {"worst": [measure.name for measure in measures], "unseated": unseated}


@np.errstate(all="ignore")
def corner_of(mechanism: Mechanism, name: str, side: str | None, steps: int) -> dict[str, Any]:
    """Return the worst corner for a measure as the page shows it.

    Returns
    -------
    dict
        values: least and largest deviation, SI, and their texts; side: the shown one, 0 or 1; index, at: position
        nearest to where it stands, and that in words, None of a figure of the whole cycle; rows: numbers that matter,
        [name, nominal, change]; scene: of the mechanism there, its errors being those against the nominal one.
    """
    from trunnion.studies.tolerance.corner import worst_corner  # it takes long to load

    corner = worst_corner(mechanism, name, side, steps)
    run, time = corner.prepared.run, corner.time
    over_cycle = not np.isfinite(time)
    return {
        "values": list(corner.deviations),
        "texts": [_signed(value, corner.unit) for value in corner.deviations],
        "side": corner.side,
        "index": None if over_cycle else int(np.argmin(np.abs(run.cycle.times(steps) - time))),
        "at": None if over_cycle else run.system.dial(run.values, np.array([time])).at(0),
        "rows": [[path, quantity(nominal, unit), _signed(there - nominal, unit)]
                 for path, unit, nominal, there in corner.rows],
        "scene": _scene(corner.prepared, corner.numbers, steps),
    }  # fmt: skip


def _scene(prepared: ToleranceStudy, numbers: Mapping[str, float], steps: int) -> dict[str, Any]:
    """The scene of a mechanism with other numbers, beside the nominal one and with its holes as wide as they are.

    Its places alone count: it is solved without friction, with which it might lock.
    """
    from trunnion.cycle.positions import positions
    from trunnion.cycle.summary import result_of

    inputs, bare = prepared.inputs, prepare(prepared.run.system.mechanism.with_friction("off"))
    run = replace(bare, values={**bare.values, **numbers})
    run.__dict__.update(ideal_values=inputs.nominal, erring=True, seats=[])  # its pins lie where the corner has them
    result = result_of(run, positions(run, steps, margin=False, averaged=False)).dataset
    drawn_scene = scene(result, max_positions=steps)
    for joint in inputs.loose:
        play, links = inputs.play(joint, numbers), run.system.joints[joint][1]
        assert play is not None  # else it would not be loose
        guide = play.model.size is not None and play.model.size[0] == "guide"
        drawn_scene["built"]["seats"].append({
            "joint": joint, "kind": "guide" if guide else "pin", "clearance": float(np.ravel(primal(play.radii[0]))[0]),
            "length": float(np.ravel(primal(play.length))[0]) if guide else None, "links": list(links), "ends": [],
        })  # fmt: skip
    return drawn_scene


def _signed(value: float, unit: str) -> str:
    """A change with its sign and unit."""
    return f"{'−' if value < 0 else '+'}{quantity(abs(float(value)), unit)}"
