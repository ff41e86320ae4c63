"""What is laid over a drawing of a solved mechanism: instant centres, transmission angles, seats, the worst corner."""

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
from trunnion.studies.design import instant_centres, transmission_angles
from trunnion.studio.live import columns
from trunnion.studio.message import Exact
from trunnion.views.as_built import seated
from trunnion.views.scene import scene

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.studies.tolerance.linear import ToleranceStudy

__all__ = ["centres_of", "corner_of", "measured", "seats_of", "transmission_of"]

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
    rows = zip(angles, columns(list(angles.values()), steps), strict=True)
    return [{"name": name, "joint": joint, "angle": angle} for name, angle in rows for joint in middle[name]]


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
    from trunnion.studies.tolerance.linear import worst_corner  # it takes long to load

    corner = worst_corner(mechanism, name, side)
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
    run.__dict__.update(
        ideal=replace(run, values=inputs.nominal), erring=True, seats=[]
    )  # its pins lie where the corner has them
    result = result_of(run, positions(run, steps, margin=False, averaged=False)).dataset
    drawn_scene = scene(result, max_positions=steps)
    for joint in inputs.loose:
        play, links = inputs.play(joint, numbers), run.system.joints[joint][1]
        guide = play.model.size is not None and play.model.size[0] == "guide"
        drawn_scene["built"]["seats"].append({
            "joint": joint, "kind": "guide" if guide else "pin", "clearance": float(np.ravel(primal(play.radii[0]))[0]),
            "length": float(np.ravel(primal(play.length))[0]) if guide else None, "links": list(links), "ends": [],
        })  # fmt: skip
    return drawn_scene


def _signed(value: float, unit: str) -> str:
    """A change with its sign and unit."""
    return f"{'−' if value < 0 else '+'}{quantity(abs(float(value)), unit)}"
