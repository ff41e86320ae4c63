"""The books of a cycle: power, efficiency, summary, findings and provenance, gathered into the result."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle import contact_loss, diagnosis, near_locking
from trunnion.cycle.asbuilt import summary_rows
from trunnion.cycle.means import Means
from trunnion.cycle.scene import DRAWN
from trunnion.errors import Finding, Severity, Status
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.checks.check import check_model
from trunnion.model.contact import clearance
from trunnion.model.mechanism import Mechanism
from trunnion.model.quantity import Quantity
from trunnion.model.units import KINDS, Dimension, si_unit
from trunnion.results import variables as results
from trunnion.results.attributes import cited, finding_rows, origin
from trunnion.solve.forward import start
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import Stated
from trunnion.solve.system import Dial, System, rubbing

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.cycle.positions import Positions
    from trunnion.solve.run import Run

from trunnion.cycle.variables import fill_of
from trunnion.solve.friction_method import MARGIN
from trunnion.solve.loads import useful_loads

__all__ = [
    "effort_units",
    "finish",
    "inputs",
    "model_notes",
    "references",
    "sound_positions",
]


Arrays = Mapping[str, NDArray[np.float64]]
ZERO_INERTIA = Quantity(0, KINDS["moment of inertia"])

DURANGO = (
    "S. Durango, G. Calle, O. Ruiz, Analytical method for the kinetostatic analysis of the second-class RRR Assur "
    "group allowing for friction in the kinematic pairs, J. Braz. Soc. Mech. Sci. & Eng., 2010"
)

PEZZUTI = (
    "E. Pezzuti, R. Stefanelli, P. P. Valentini, L. Vita, Computer-aided simulation and testing of spatial linkages "
    "with joint mechanical errors, Int. J. Numer. Meth. Eng. 65 (2006) 1735-1748"
)


def finish(run: Run, found_positions: Positions) -> xr.Dataset:
    """The Dataset with its attributes: formula, findings, summary, input data, drawing data, provenance."""
    mechanism, arrays, time = run.system.mechanism, found_positions.arrays, found_positions.time
    method = found_positions.method
    found, near = findings(run, found_positions)
    attributes: dict[str, Any] = {
        **origin(mechanism, run.system.plan.formula, mobility=run.system.plan.mobility),
        "method": method.name,
        **cited(references(mechanism)),
        "driver_units": effort_units(run.system),
        "spring_units": spring_units(run.system),
        "findings": finding_rows(found),
        "summary": _summary(run, found_positions, near),
        "inputs": inputs(mechanism),
        "scene": _scene(run),
        "periodic": int(run.cycle.periodic),
    }
    return results.dataset(
        arrays, found_positions.labels, time, found_positions.means, attributes, found_positions.ideal
    )


def findings(run: Run, at: Positions) -> tuple[list[Finding], near_locking.Locking | None]:
    """What is to be known of a mechanism at some positions of its cycle, and how near to locking it is."""
    near = _near_locking(run, at.arrays, at.time, at.method)
    return [
        *model_notes(run.system.mechanism, run.system),
        *run.chosen.findings,
        *(run.determinacy.findings() if run.determinacy else []),
        *_over_the_cycle(run, at.arrays, at.causes, at.time, near),
        *_missed_peaks(run.system, at),
        *contact_loss.findings(at.losses, at.arrays, list(run.system.joints), run.system.dial(run.values, at.time)),
    ], near


def effort_units(system: System) -> list[str]:
    """Unit of every driver's effort."""
    return ["N m" if system.turns(name) else "N" for name in system.mechanism.drivers]


def spring_units(system: System) -> list[list[str]]:
    """Units of every spring's force and elongation."""
    turns = [spring.joint is not None and system.turns(spring.joint) for spring in system.mechanism.springs.values()]
    return [["N m", "rad"] if turn else ["N", "m"] for turn in turns]


def model_notes(mechanism: Mechanism, system: System) -> list[Finding]:
    """What the model says that this analysis leaves out, and warnings about the data."""
    notes = [finding for finding in check_model(mechanism) if finding.severity is not Severity.ERROR]
    values = mechanism.parameters()
    playing = [
        name
        for name, joint in mechanism.effective_joints.items()
        if name not in mechanism.seated and clearance(name, values) is not None
    ]
    bodies = {name: link for name, link in mechanism.effective_links.items() if name != mechanism.fixed_link}
    heavy = [name for name, link in bodies.items() if link.mass.source != 0]
    if heavy and mechanism.gravity is None:
        what = f"gravity is not stated and taken as none, though {', '.join(heavy)} have mass"
        down, none = ("[0, -9.81]", "[0, 0]") if mechanism.space == "planar" else ("[0, 0, -9.81]", "[0, 0, 0]")
        notes.append(Finding(what, "gravity", f"state gravity: {down}, or {none} to say so", Severity.NOTE))
    sliding = {link for joint in mechanism.joints.values() if PAIRS[joint.type].guided for link in joint.links}
    points = [name for name in heavy if bodies[name].inertia == ZERO_INERTIA and name not in sliding]
    if points:
        what = f"{', '.join(points)} have a mass but no inertia: they are taken as point masses at their centres"
        notes.append(Finding(what, "links", "state inertia: …", Severity.NOTE))
    tight = [
        name
        for name, joint in mechanism.effective_joints.items()
        if joint.seat not in (None, "free") and name not in mechanism.seated and clearance(name, values) is not None
    ]
    if tight:
        what = f"{', '.join(tight)} have a seat but no play at their nominal sizes: the joints are ideal"
        notes.append(Finding(what, "joints", "analyse with --set fits=maximum for the widest", Severity.NOTE))
    if playing:
        what = f"the pins of {', '.join(playing)} are taken to lie in the middle of their play"
        # no seats are taken where links are over-constrained
        held = {name for module in system.plan.modules if module.redundant for name in module.joints}
        remedy = "the play verb tells what the play can do; `trunnion assemble FILE` whether the links go together"
        if seatable := [name for name in playing if name not in held]:
            of = f" of {', '.join(seatable)}" if len(seatable) < len(playing) else ", or analyse with --seat loaded"
            remedy = f"state seat: loaded{of}; the play verb tells what the play can do"
        notes.append(Finding(what, "joints", remedy, Severity.NOTE))
    return notes


def _over_the_cycle(
    run: Run,
    arrays: Arrays,
    causes: diagnosis.Causes,
    time: NDArray[np.float64],
    near: near_locking.Locking | None,
) -> list[Finding]:
    units = effort_units(run.system)
    efforts = {
        name: (arrays["drive_effort_lower"][i], arrays["drive_effort_upper"][i], units[i])
        for i, name in enumerate(run.system.mechanism.drivers)
    }
    found = diagnosis.findings(
        causes, run.system.dial(run.values, time), arrays["status"], arrays["condition"], efforts, near
    )
    found += near_locking.findings(near, run.system.dial(run.values, near.times)) if near else []
    spans = [run.system.span(run.values, name) for name in run.system.mechanism.drivers]
    several = len(spans) > 1 or run.system.mechanism.gears
    if several and not run.cycle.periodic and spans and all(span.periodic for span in spans):
        whom = "drivers" if len(spans) > 1 else "driver and the gears"
        what = f"the {whom} do not come back together; the cycle is the slowest period, {run.cycle.duration:g} s"
        remedy = "means and efficiency are of that time; choose speeds with a common period, or ranges"
        found.append(Finding(what, "drivers", remedy, Severity.WARNING))
    return [*found, *_loads_over_the_cycle(run, arrays, time)]


def _missed_peaks(system: System, at: Positions) -> Iterator[Finding]:
    """An effort whose mean square says that it is larger between the positions than at any of them."""
    sound = sound_positions(at.arrays["status"])
    if not len(sound):
        return
    for i, (name, unit) in enumerate(zip(system.mechanism.drivers, effort_units(system), strict=True)):
        largest, rms = float(np.max(np.abs(at.arrays["drive_effort"][i][sound]))), float(at.means.drive_effort_rms[i])
        if rms > (1 + 1e-6) * largest:
            what = (
                f"its RMS over the cycle, {rms:.4g} {unit}, is above the largest at any position, {largest:.4g} {unit}"
            )
            remedy = "use more --steps: what acts between two positions is in the means, not in the extremes"
            yield Finding(what, f"drivers.{name}", remedy, Severity.WARNING)


def _loads_over_the_cycle(run: Run, arrays: Arrays, time: NDArray[np.float64]) -> Iterator[Finding]:
    """What only the motion shows of a load or spring: a resistance that drives, a torsional spring that unwinds."""
    walk, dial = start(run.system, run.values), run.system.dial(run.values, time)
    walk.time = time
    stated = Stated(walk)
    for path, entry in run.system.mechanism.parameter_set.entries.items():
        if entry.varies and entry.location[-1] in ("resisting_torque", "resisting_force"):
            negative = np.flatnonzero(np.broadcast_to(np.asarray(stated.get(path)), time.shape) < 0)
            if len(negative):
                what = f"is negative {dial.intervals(negative)}: it drives the joint there"
                yield Finding(what, path, "use max(0 N, …), or a load with a sign", Severity.WARNING)
    for i, (name, spring) in enumerate(run.system.mechanism.springs.items()):
        if spring.joint is not None and spring_units(run.system)[i][1] == "rad":
            jumps = np.flatnonzero(np.abs(np.diff(arrays["spring_elongation"][i])) > np.pi)
            if len(jumps):
                what = f"turns through half a turn from its free angle at {dial.at(int(jumps[0]))} and jumps there"
                yield Finding(what, f"springs.{name}", "no whole turns are counted in this joint", Severity.WARNING)


def references(mechanism: Mechanism) -> list[str]:
    laws = {
        joint.friction.law or "coulomb" for joint in mechanism.effective_joints.values() if joint.friction is not None
    }
    method = DURANGO if mechanism.space == "planar" else PEZZUTI
    return [method, *(f"{law}: {FRICTION_LAWS[law].source}" for law in sorted(laws)), *mechanism.references]


def _summary(run: Run, found: Positions, near: near_locking.Locking | None) -> list[dict[str, Any]]:
    """The figures one looks at first."""
    rows: list[dict[str, Any]] = []
    arrays, time, means = found.arrays, found.time, found.means
    dial = run.system.dial(run.values, time)
    # extremes are of positions that can be relied on: beside a dead centre they depend on the sampling
    sound = sound_positions(arrays["status"])
    with np.errstate(all="ignore"):
        for i, (name, unit) in enumerate(zip(run.system.mechanism.drivers, effort_units(run.system), strict=True)):
            effort = arrays["drive_effort"][i]
            kind = "torque" if unit == "N m" else "force"
            if len(sound):
                low, high = (int(sound[pick(effort[sound])]) for pick in (np.argmin, np.argmax))
                rows += [
                    {"label": f"drive {kind} of {name}, least, at {dial.at(low)}", "value": effort[low], "unit": unit},
                    {
                        "label": f"drive {kind} of {name}, largest, at {dial.at(high)}",
                        "value": effort[high],
                        "unit": unit,
                    },
                ]
            rows.append({"label": f"drive {kind} of {name}, RMS", "value": means.drive_effort_rms[i], "unit": unit})
        rows += _reaction_rows(run.system, arrays, dial, sound)
        lost = np.sum(arrays["friction_power"], axis=0)
        if rubbing(run.system):
            valid = arrays["status"] != Status.CONTACT_LOST
            rows.append(_margin(np.where(valid, arrays["locking_margin"], np.nan), dial))
            rows += near.rows(run, dial) if near else []
            rows.append({"label": "friction power, mean", "value": means.friction_power.net, "unit": "W"})
            if len(sound):
                top = int(sound[np.argmax(lost[sound])])
                rows.append({"label": f"friction power, largest, at {dial.at(top)}", "value": lost[top], "unit": "W"})
        efficiency = {"label": f"efficiency of the cycle{_why(means, arrays)}", "value": means.efficiency, "unit": "1"}
        rows.append(efficiency)
        rows.append({"label": "efficiency, error of its integrals", "value": means.efficiency_error, "unit": "1"})
        if found.ideal is not None:
            ideal = found.ideal.efficiency
            rows.append({"label": "efficiency of the cycle without errors", "value": ideal, "unit": "1"})
            rows += summary_rows(run, arrays, dial, arrays["status"] != Status.CONTACT_LOST)
        back = near_locking.reverse_row(run, near.back, useful_loads(run.system.mechanism)) if near else None
        rows += [back] if back else []
        solved = int(np.count_nonzero(arrays["status"] < Status.NOT_CONVERGED))
        residual = balance(arrays) if solved else None
        rows.append({"label": "power residual, largest, of peak drive power", "value": residual, "unit": "1"})
    rows.append(
        {"label": "friction iterations, most", "value": int(np.max(arrays["friction_iterations"])), "unit": "1"}
    )
    lost = int(np.count_nonzero(arrays["status"] == Status.CONTACT_LOST))
    rows.append({"label": f"positions solved, of {len(time)}", "value": solved - lost, "unit": "1"})
    if lost:
        rows.append({"label": "positions not valid, for a pin loses contact", "value": lost, "unit": "1"})
    return [{**row, "value": _finite(row["value"])} for row in rows]


def _finite(value: float | None) -> float | None:
    return None if value is None or not np.isfinite(value) else float(value)


def sound_positions(status: NDArray[Any]) -> NDArray[np.intp]:
    """Positions whose figures can be relied on: solved; those with a zero speed only if there are no others.

    Where a pin loses contact it is taken to stay in a seat that would jump: forces there are no answer.
    """
    best = np.flatnonzero(status == Status.SOLVED)
    return best if len(best) else np.flatnonzero(status == Status.ZERO_SLIP)


def _reaction_rows(system: System, arrays: Arrays, dial: Dial, sound: NDArray[np.intp]) -> list[dict[str, Any]]:
    """Largest reaction of every joint, in space its moment too; stroke of every slide."""
    rows: list[dict[str, Any]] = []
    loads = [("reaction", "reaction_force", "N")]
    if system.mechanism.space == "spatial":
        loads.append(("reaction moment", "reaction_moment", "N m"))
    for i, (name, (kind, _)) in enumerate(system.joints.items()):
        for what, variable, unit in loads if len(sound) else ():
            size = np.sqrt(np.sum(arrays[variable][i] ** 2, axis=0))
            top = int(sound[np.argmax(size[sound])])
            if system.mechanism.space == "planar" or size[top] > _rounding(arrays, variable):
                rows.append(
                    {"label": f"{what} of {name}, largest, at {dial.at(top)}", "value": size[top], "unit": unit}
                )
        slide = arrays["joint_slide"][i]
        slide = slide[arrays["status"] != Status.CONTACT_LOST]
        if PAIRS[kind].guided and np.any(np.isfinite(slide)):
            stroke = np.nanmax(slide) - np.nanmin(slide)
            rows.append({"label": f"stroke of {name}", "value": stroke, "unit": "m"})
    return rows


def _rounding(arrays: Arrays, variable: str) -> float:
    """What is no more than rounding of the reactions or of the drive."""
    return 1e-11 * max(_peak(arrays[variable]), _peak(arrays["drive_effort"]), 1e-300)


def _margin(margin: NDArray[np.float64], dial: Dial) -> dict[str, Any]:
    """The least multiple of the friction at which the mechanism locks."""
    if np.all(np.isnan(margin)):
        return {"label": "locking margin (times the friction)", "value": float("nan"), "unit": "1"}
    least = np.nanmin(margin, initial=np.inf)
    if not np.isfinite(least):
        return {"label": "locking margin (times the friction), more than", "value": MARGIN, "unit": "1"}
    at = dial.at(int(np.nanargmin(margin)))
    return {"label": f"locking margin (times the friction), least, at {at}", "value": least, "unit": "1"}


def _near_locking(
    run: Run, arrays: Arrays, time: NDArray[np.float64], method: FrictionMethod
) -> near_locking.Locking | None:
    """What is to know of locking, if there is friction and a driver."""
    if not rubbing(run.system) or not run.system.mechanism.drivers:
        return None
    with np.errstate(all="ignore"):
        return near_locking.look(run, time, arrays["locking_margin"], method, useful_loads(run.system.mechanism))


def _why(means: Means, arrays: Arrays) -> str:
    """What an efficiency of 0, or none, means."""
    value = means.efficiency
    if value == 0:
        return " (the useful loads do no net work)"
    if np.isfinite(value):
        return ""
    if np.any(arrays["status"] >= Status.NOT_CONVERGED):
        return " (not every position has an answer)"
    if not np.isfinite(means.drive_power.value):
        return " (there is no answer between some positions)"
    if means.drive_power.net < 0:
        return " (the loads drive: the driver takes work)"
    return " (the driver does no net work)"


def balance(arrays: Arrays) -> float:
    """Largest power residual over the largest power that any driver, or else any load, has."""
    residual = _peak(arrays["power_residual"])
    kinds = ("drive_power", "useful_power", "friction_power", "spring_power")
    highest = max(_peak(arrays[name]) for name in kinds if name in arrays)
    return residual / highest if highest > 0 else residual


def _peak(values: NDArray[np.float64]) -> float:
    """Largest magnitude, without a copy of the values."""
    return float(max(np.nanmax(values, initial=0.0), -np.nanmin(values, initial=0.0)))


def inputs(mechanism: Mechanism) -> list[dict[str, Any]]:
    """Every number that was stated: path, SI value, unit, and the text of the model."""
    values = mechanism.parameters()
    dimensions: dict[str, Dimension | None] = {}
    rows = []
    for path, entry in mechanism.parameter_set.entries.items():  # dimensions first, in order of evaluation
        unit = entry.kind.unit
        if path.startswith("dimensions."):
            name = path.removeprefix("dimensions.")
            dimensions[name] = entry.quantity.check(dimensions)
            unit = si_unit(dimensions[name])
        text = str(entry.quantity.source)
        if not entry.alias and text != "0":
            value = float(values[path]) if path in values else None  # an expression of the motion has many
            rows.append({"path": path, "value": value, "unit": unit, "text": text})
    return rows


def _scene(run: Run) -> dict[str, Any]:
    """What a drawing needs to know beside the positions of the points."""
    system = run.system
    found: dict[str, Any] = fill_of(system).scene(
        system, run.values, run.cycle.times(DRAWN), useful_loads(system.mechanism)
    )
    return found
