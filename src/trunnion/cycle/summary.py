"""The books of a cycle: power, efficiency, summary, findings and provenance, gathered into the result."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Place
from trunnion.algebra.dual import single
from trunnion.cycle.course import MOST_SUPPOSED, CycleCourse, magnitude
from trunnion.cycle.fill import pin_area
from trunnion.cycle.findings import Cycle, effort_units, findings
from trunnion.cycle.locking_course import critical_figure
from trunnion.cycle.model_measures import watched
from trunnion.cycle.positions import ALL, Kept, Positions
from trunnion.cycle.scales import peak, scales_of
from trunnion.cycle.scene import load_courses, scene_of
from trunnion.errors import Finding, Status
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.model.mechanism import Mechanism
from trunnion.model.units import ANY
from trunnion.results import variables as results
from trunnion.results.attributes import KEPT, Figure, cited, encoded, finding_rows, origin
from trunnion.results.dataset import MemberUnits, Result, driven
from trunnion.solve.contacts import bearing_ends, has_pressure
from trunnion.solve.loads import NOTHING_USEFUL, STATE_USEFUL
from trunnion.solve.system import System, rubbing

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.solve.run import Run

Arrays = Mapping[str, NDArray[np.float64]]
ALIKE = 1e-9  # sizes of errors that are equal

DURANGO = (
    "S. Durango, G. Calle, O. Ruiz, Analytical method for the kinetostatic analysis of the second-class RRR Assur "
    "group allowing for friction in the kinematic pairs, J. Braz. Soc. Mech. Sci. & Eng., 2010"
)

PEZZUTI = (
    "E. Pezzuti, R. Stefanelli, P. P. Valentini, L. Vita, Computer-aided simulation and testing of spatial linkages "
    "with joint mechanical errors, Int. J. Numer. Meth. Eng. 65 (2006) 1735-1748"
)


def result_of(run: Run, at: Positions, selection: Kept = ALL) -> Result:
    """The result of a cycle: formula, findings, summary, input data, drawing data, provenance; and its Dataset.

    selection: the variables that the Dataset has.
    """
    mechanism, cycle = run.system.mechanism, Cycle(run, at)
    near = cycle.locking if cycle.course else None
    measured = watched(run, at.time, at.method)
    drawn = run.once("inputs, scene", lambda: encoded({"inputs": inputs(mechanism), "scene": scene_of(run)}))
    attributes = encoded(
        {
            **provenance(run.system, [*findings(cycle), *measured.findings], mobility=run.system.plan.mobility),
            "method": at.method.name,
            **scales_of(run).summary([*figures(cycle), *measured.summary()]),
            **({"locking_ranges": near.attribute(at.time)} if near and near.pushed() else {}),
            **drawn,
            **load_courses(run, at.time),
            "periodic": int(run.cycle.periodic),
            **({} if selection.variables is None else {KEPT: selection.variables}),
        }
    )

    def dataset() -> xr.Dataset:
        along, units = driven(at.time, *at.dial), member_units(run.system)
        parts = at.arrays, at.labels | measured.labels, along, at.means, attributes, units, at.ideal
        return results.dataset(*parts, selection.variables, selection.dtype, measured.variables())

    return Result(attributes, dataset)


def member_units(system: System) -> dict[str, MemberUnits]:
    """Units of what a driver or a spring has, by the words of the variables, where it may turn or slide."""

    def units(dim: str, turning: Iterable[bool], words: Mapping[str, tuple[str, str]]) -> dict[str, MemberUnits]:
        turns = list(turning)
        return {
            word: MemberUnits(dim, [turn if turns_round else slide for turns_round in turns])
            for word, (turn, slide) in words.items()
        }

    drives = {"effort": ("N m", "N"), "coordinate": ("rad", "m"), "rate": ("rad/s", "m/s")}
    pulls = {"spring_force": ("N m", "N"), "spring_elongation": ("rad", "m")}
    springs = system.mechanism.springs.values()
    return {
        **units("driver", map(system.turns, system.mechanism.drivers), drives),
        **units("spring", (spring.joint is not None and system.turns(spring.joint) for spring in springs), pulls),
    }


def provenance(system: System, findings_made: Iterable[Finding], **more: Any) -> dict[str, Any]:
    """Where a result comes from, what it is founded on, and what there is to say of it. more: see `origin`."""
    mechanism = system.mechanism
    attributes = {**origin(mechanism, system.plan.formula, **more), **cited(references(mechanism))}
    return {**attributes, "findings": finding_rows(findings_made)}


def references(mechanism: Mechanism) -> list[str]:
    laws = {
        joint.friction.law or "coulomb" for joint in mechanism.effective_joints.values() if joint.friction is not None
    }
    method = DURANGO if mechanism.space == "planar" else PEZZUTI
    return [method, *(f"{law}: {FRICTION_LAWS[law].source}" for law in sorted(laws)), *mechanism.references]


# ---- the summary ----------------------------------------------------------------------------------------------


def figures(cycle: Cycle) -> Iterator[Figure]:
    """The figures one looks at first. Those of the cycle are read of its course, whatever the positions are."""
    with np.errstate(all="ignore"):
        if (course := cycle.course) is not None:
            key = "figures of the cycle", cycle.at.method
            yield from cycle.run.once(key, lambda: [figure for of in OF_CYCLE for figure in of(cycle, course)])
        yield from _solution(cycle)


def _efforts(cycle: Cycle, course: CycleCourse) -> Iterator[Figure]:
    """Extremes and RMS of every drive effort."""
    system = cycle.run.system
    for i, (name, unit) in enumerate(zip(system.mechanism.drivers, effort_units(system), strict=True)):
        subject = f"drive {'torque' if unit == 'N m' else 'force'} of {name}"
        for end, aspect, sign in (("min", "minimum", -1.0), ("max", "maximum", 1.0)):
            top = course.extreme("drive_effort", i, sign=sign, unit=unit)
            if top is not None:
                yield course.figure(f"{name}.effort_{end}", subject, top, unit, aspect)
        yield Figure(f"{name}.effort_rms", subject, course.means.drive_effort_rms[i], unit, "RMS")


def _reactions(cycle: Cycle, course: CycleCourse) -> Iterator[Figure]:
    """Largest reaction of every joint, in space its moment too; stroke of every slide."""
    system, scales = cycle.run.system, scales_of(cycle.run)
    loads = [("reaction", "reaction_force", "N")]
    if system.mechanism.space == "spatial":
        loads.append(("reaction moment", "reaction_moment", "N m"))
    planar = system.mechanism.space == "planar"
    for i, (name, joint) in enumerate(system.joints.items()):
        for what, variable, unit in loads:
            top = course.extreme(variable, i, of=magnitude, unit=unit)
            if top is None:
                continue
            if planar or top.value > scales.floor(unit):
                key = f"{name}.{what.replace(' ', '_')}_max"
                yield course.figure(key, f"{what} of {name}", top, unit, "maximum")
        yield from _bearing(cycle, course, i, name)
        if joint.pair.guided:
            valid = course.valid
            ends = [course.extreme("joint_slide", i, sign=sign, panels=valid, unit="m") for sign in (1.0, -1.0)]
            if ends[0] is not None and ends[1] is not None:
                stroke, note = ends[0].value - ends[1].value, course.note
                yield Figure(f"{name}.stroke", f"stroke of {name}", stroke, "m", note=note)


def _bearing(cycle: Cycle, course: CycleCourse, i: int, joint: str) -> Iterator[Figure]:
    """Largest load on an end of a joint's bearing or guide, and largest pressure of its pin."""
    mechanism, axes = cycle.mechanism, cycle.mechanism.coordinates

    def larger(rows: NDArray[np.float64]) -> NDArray[np.float64]:
        """The size of the largest of the vectors."""
        return np.asarray(np.max([magnitude(rows[k : k + axes]) for k in range(0, len(rows), axes)], axis=0))

    ends = bearing_ends(mechanism, joint)
    if not ends and not has_pressure(mechanism, joint):
        return
    top = course.extreme("end_load" if ends else "reaction_force", i, of=larger, unit="N")
    if top is not None and ends:
        yield course.figure(f"{joint}.end_load_max", f"load on an end of {joint}", top, "N", "maximum")
    if top is not None and has_pressure(mechanism, joint):
        share = (2.0 if ends else 1.0) / single(pin_area(cycle.run.values, joint))
        pressure = top._replace(value=top.value * share)
        yield course.figure(f"{joint}.pin_pressure_max", f"pin pressure of {joint}", pressure, "Pa", "maximum")


def _friction(cycle: Cycle, course: CycleCourse) -> Iterator[Figure]:
    """How near to locking it is, and what friction takes."""
    if not rubbing(cycle.run.system):
        return
    if cycle.locking and (margin := cycle.locking.margin_figure()):
        yield margin
        decides = cycle.locking.responsible
        yield from [] if decides is None else [critical_figure(cycle.run, *decides, margin.place)]
    means = course.means
    yield Figure("friction_power_mean", "friction power", means.friction_power.net, "W", "mean")
    if means.supposed > 0:
        off = means.friction_power.error + means.supposed * abs(means.drive_power.net)
        yield Figure("friction_power_error", "friction power, numerical error, at most", off, "W")
    lost = course.extreme("friction_power", of=lambda rows: np.sum(rows, axis=0), unit="W")
    if lost is not None:
        yield course.figure("friction_power_max", "friction power", lost, "W", "maximum")


def _efficiency(cycle: Cycle, course: CycleCourse) -> Iterator[Figure]:
    """Efficiency of the cycle, with its error, and without errors of the joints."""
    means, value, note = course.means, course.means.efficiency, ""
    if not means.has_useful_work:
        note = f"{NOTHING_USEFUL}: {STATE_USEFUL}"
    elif np.isfinite(value):
        note = "the useful loads do no net work" if value == 0 else "the useful loads supply work" * bool(value < 0)
    elif means.supposed > MOST_SUPPOSED:
        note = f"pins do not settle, which may change {means.supposed:.0%} of the work"
    elif not np.isfinite(means.drive_power.value):
        note = "not every position is solved"
    else:
        note = "the driver does no net work, or absorbs work"
    yield Figure("efficiency", "efficiency of the cycle", value, note=note)
    yield Figure("efficiency_error", "efficiency, numerical error", means.efficiency_error)
    if cycle.at.ideal is not None:
        ideal = cycle.at.ideal.efficiency
        yield Figure("efficiency_ideal", "efficiency of the cycle without errors", ideal)


def _errors(cycle: Cycle, course: CycleCourse) -> Iterator[Figure]:
    """What the errors do; where no pin loses contact."""
    if cycle.at.ideal is None:
        return
    run = cycle.run

    def largest(variable: str, i: int, unit: str) -> Place | None:
        return course.extreme(variable, i, of=magnitude, panels=course.valid, unit=unit)

    points = {".".join(point): largest("point_error", k, "m") for k, point in enumerate(run.system.points)}
    tops = {point: top for point, top in points.items() if top is not None}
    if tops:
        highest = max(top.value for top in tops.values()) * (1 - ALIKE)
        point = next(point for point, top in tops.items() if top.value >= highest)  # of equal ones the first
        yield course.figure("point_error_max", "position error", tops[point], "m", f"largest: {point}")
    for i, (joint, entry) in enumerate(run.system.joints.items()):
        if run.system.mechanism.fixed_link not in entry.links or joint in run.system.mechanism.drivers:
            continue
        what, unit = ("slide", "m") if entry.pair.guided else ("rotation", "rad")
        if (error := largest(f"joint_{what}_error", i, unit)) is not None:
            name, subject = f"{joint}.{what}_error_max", f"transmission error of {joint}"
            yield course.figure(name, subject, error, unit, "largest magnitude")
    for i, joint in enumerate(run.system.mechanism.drivers):
        kind, unit = ("torque", "N m") if run.system.turns(joint) else ("force", "N")
        subject, name = f"change of the drive {kind} of {joint} by the errors", f"{joint}.effort_change_max"
        variable, valid = "drive_effort_change", course.valid
        ends = [course.extreme(variable, i, sign=sign, panels=valid, unit=unit) for sign in (1.0, -1.0)]
        change = max(filter(None, ends), key=lambda end: abs(end.value), default=None)
        if change is not None:
            yield course.figure(name, subject, change, unit, "largest magnitude")


def _backward(cycle: Cycle, course: CycleCourse) -> Iterator[Figure]:
    """Efficiency when the loads drive it backward."""
    back = cycle.locking.reverse_figure() if cycle.locking else None
    yield from [] if back is None else [back]


def _solution(cycle: Cycle) -> Iterator[Figure]:
    """How well the positions are solved, and how many."""
    arrays, status = cycle.at.arrays, cycle.at.arrays["status"]
    counted = status < Status.NOT_CONVERGED
    residual = balance(arrays, scales_of(cycle.run).floor("W")) if np.any(counted) else None
    yield Figure("power_residual", "power balance residual", residual, aspect="maximum, of peak power")
    if cycle.run.seats:
        yield Figure("seat_rounds", "seat iterations", np.max(arrays["seat_rounds"]), aspect="maximum")
    rounds = int(np.max(arrays["friction_iterations"]))
    yield Figure("friction_iterations", "friction iterations", rounds, aspect="maximum")
    lost = int(np.count_nonzero(status == Status.CONTACT_LOST))
    solved = int(np.count_nonzero(counted)) - lost
    yield Figure("positions_solved", "positions solved", solved, aspect=f"of {len(cycle.at.time)}")
    if lost:
        yield Figure("positions_lost", "positions not valid (a pin loses contact or bears no load)", lost)


OF_CYCLE: tuple[Callable[[Cycle, CycleCourse], Iterator[Figure]], ...] = (
    _efforts, _reactions, _friction, _efficiency, _errors, _backward,
)  # fmt: skip

# the power balance: what is left over, and what that is held against
BALANCED = ("power_residual", "drive_power", "useful_power", "friction_power", "spring_power")


def balance(arrays: Arrays, floor: float) -> float:
    """Largest power residual over the largest power that any driver, or else any load, has; 0 where all are rounding.

    floor: power that is rounding, W.
    """
    residual, *powers = (peak(arrays[name]) for name in BALANCED if name in arrays)
    highest = max(powers)
    if max(residual, highest) <= floor:
        return 0.0
    return residual / highest if highest > 0 else residual


def inputs(mechanism: Mechanism) -> list[dict[str, Any]]:
    """Every number that was stated: path, SI value, unit, and the text of the model."""
    values, kinds, rows = mechanism.parameters(), mechanism.parameter_kinds(), []
    for path, entry in mechanism.parameter_set.entries.items():
        text = str(entry.quantity.source)
        if not entry.alias and text != "0":
            value = float(values[path]) if path in values else None  # an expression of the motion has many
            plain = kinds[path] is ANY and path.startswith("dimensions.")  # its use alone tells its unit
            rows.append({"path": path, "value": value, "unit": "" if plain else kinds[path].unit, "text": text})
    return rows
