"""What the play of every joint does to measures: worst case and scatter, one number for each clearance.

It is first order of tolerances with nothing but the plays: a small offset cᵢ of the pin at the end i of its hole
changes a measure y by Qᵢ · cᵢ, Qᵢ its derivative by the offset, friction included (`tolerance.effects`). Of a
coordinate or an angle Qᵢ is what the pin presses on that end under the measure's unit load alone: virtual work. With
the offset anywhere in a disc of radius ρ (an interval, a ball, n components):

    worst case   Σ ρᵢ |Qᵢ|
    variance     Σ ρᵢ² |Qᵢ|²/(n + 2)      offsets independent, each uniform over its disc

since ∫ x² over the unit ball of n dimensions is 1/(n + 2) of its volume: ρ²/3 in an interval, ρ²/4 in a disc, ρ²/5 in
a ball. What pins at the rims of their holes do beyond first order is searched on the mechanism itself
(`tolerance.effects.search`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import single
from trunnion.cycle.findings import of_run
from trunnion.cycle.positions import check_steps
from trunnion.cycle.scales import scales_of
from trunnion.cycle.summary import inputs, provenance
from trunnion.errors import Finding, MechanismError, Severity, Status
from trunnion.joints.clearance import CLEARANCE_MODELS
from trunnion.measures.measures import MOTIONS, Measure, chosen
from trunnion.measures.positions import place_of
from trunnion.model.arguments import strict_arguments
from trunnion.model.joint_parts import clearance
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import Figure
from trunnion.results.dataset import MemberUnits, Variable, dataset_of, described, driven
from trunnion.results.quantities import readable
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare
from trunnion.statistics.distributions import Population
from trunnion.studies.tolerance.effects import FirstOrder
from trunnion.studies.tolerance.inputs import Inputs, plays_of
from trunnion.studies.tolerance.linear import MeasureOrder, Table, ToleranceStudy, stated_or_outputs

if TYPE_CHECKING:
    import xarray as xr

EXTREMES = ("maximum", "minimum", "largest")  # statistics that are of one place
BESIDE = 1e-6  # of the cycle: a place on one side of a break, which is named by the break
EQUAL = 1e-9  # of a worst case: links on which a pin does as much, of which the first is taken
SLIGHT, GRAVE = 0.01, 0.05  # of the worst case to first order: how far off is a note, how much more a warning

Array = NDArray[np.float64]

# unit "measure": that of each measure; "sensitivity": that over m
OVER = ("measure", "position")
BY_JOINT = ("measure", "joint", "position")
AT = "worst case at the place of a measure: a stated one, that of its maximum or minimum, else of the largest total"
LOADS = "change of the measure for an offset of 1 m at an end, of the link on which the worst case is larger"
VARIABLES: dict[str, Variable] = {
    "value": Variable(OVER, "measure", "the measure with every pin in the middle of its hole"),
    "worst_case": Variable(BY_JOINT, "measure", "largest change that the play of the joint can make, to either side"),
    "deviation": Variable(
        BY_JOINT, "measure", "standard deviation by the play of the joint, pins anywhere in their holes"
    ),
    "worst_case_total": Variable(OVER, "measure", "worst case of all joints to first order: the sum"),
    "rss": Variable(OVER, "measure", "root of the sum of the squares of the joints' worst cases"),
    "deviation_total": Variable(
        OVER, "measure", "standard deviation by the play of all joints, independent of one another"
    ),
    "sensitivity": Variable(("measure", "joint", "end", "axis", "position"), "sensitivity", LOADS),
    "radius": Variable(("joint", "end"), "m", "largest displacement of the pin from the middle, at an end"),
    "extreme_worst_case": Variable(("measure", "joint"), "measure", AT),
    "extreme_deviation": Variable(("measure", "joint"), "measure", "standard deviation at that place"),
    "extreme_time": Variable(("measure",), "s", "time of that place"),
    "status": Variable(("position",), "1", "code of the position's status; see the attribute flag_meanings", np.int8),
}


class JointEffects(NamedTuple):
    """What the play of each joint does: worst case and standard deviation, (joint, …); loads, (joint, end, axis, …).

    Where the model does not say which link carries the seat of a pin, all are of the one on which it does more.
    """

    worst_case: Array
    deviation: Array
    loads: Array


class Reading(NamedTuple):
    """What play does to one measure over the cycle, and at its place.

    The place is a stated one, that of a maximum or minimum, or where the worst case is largest. kind: what the place
    is, for tables, empty where it is stated; limit: the deviation allowed to either side where the measure is judged,
    at its place, or at every position.
    """

    measure: Measure
    order: MeasureOrder
    curve: Array
    over_cycle: JointEffects
    at_place: JointEffects
    place: str
    kind: str
    limit: float | None


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def play(
    mechanism: Mechanism,
    measures: Sequence[str] | None = None,
    steps: int = 360,
    at: float | str | None = None,
) -> xr.Dataset:
    """What the play of every joint does to measures over the cycle: worst case and standard deviation.

    Parameters
    ----------
    measures
        Names of the model's, or written as `--measure` takes them, of what has one number at every position:
        `link.point.x`, `angle:link`, `effort:driver`, `velocity:link.point` …; all of the model if not given, or,
        where it states none, rotation and slide of every joint to the ground that is not driven. The figures of a
        maximum or minimum are those at its place, `extreme_worst_case`; other statistics are left out.
    steps
        Equally spaced positions of the cycle.
    at
        One position instead, such as "20 mm" or, in SI, 0.02.

    Returns
    -------
    Dataset
        Over (measure, joint, position), the variables of `VARIABLES`: SI, each measure in its own unit. First order in
        the play, about the mechanism with every pin in the middle of its hole. NaN where a position has no answer.

    Raises
    ------
    MechanismError
        No joint states a clearance, a measure is unknown, or as `analyse` does.
    """
    check_steps(steps)
    run = prepare(mechanism)
    if run.determinacy is not None:
        run.determinacy.refuse()
    named = chosen(mechanism, measures, run.values)
    picked = [  # those with one value at every position, and a figure of one place: no mean, and no peak-to-peak
        measure for measure in named
        if (measure.kind in MOTIONS or measure.single(run.system)) and measure.statistic in ("", "value", *EXTREMES)
    ]  # fmt: skip
    others, notes = [measure.name for measure in named if measure not in picked], list[Finding]()
    if others:
        what = f"play covers measures with one value at every position, which {', '.join(others)} has not"
        remedy = "use `trunnion tolerance` for other measures"
        if measures is not None:
            raise MechanismError(Finding(what, "measures", remedy))
        notes.append(Finding.note("play.measures_left_out", "measures", what, remedy, measures=others))
    picked, outputs_taken = stated_or_outputs(run, picked)
    notes = [*outputs_taken, *notes]
    loose = tuple(plays_of(run))
    if not loose:
        remedy = "state joints.NAME.pin.clearance (guide.clearance), such as 20 um"
        raise MechanismError(Finding("no joint states a clearance", "joints", remedy))
    value, timed = (None, False) if at is None else place_of(mechanism, at)
    courses = [replace(measure, at=value, timed=timed, over=None, statistic="") for measure in picked]
    if run.cycle.duration <= 0:  # there is one position
        courses = [replace(measure, statistic="value") for measure in courses]
    varying = Inputs(run, (), loose, (), (), Population([], None))
    over_cycle = figures = ToleranceStudy(run, varying, tuple(courses), FrictionMethod())
    if at is not None or run.cycle.duration <= 0:
        picked = courses
    else:
        placed = [
            replace(measure, at=order.time, timed=True)
            if measure.rule == "deviation" and np.isfinite(order.time) else measure
            for measure, order in zip(picked, over_cycle.orders, strict=True)
        ]  # fmt: skip
        figures = replace(over_cycle, measures=tuple(placed))
    table = over_cycle.table(steps)
    times, duration = table.plan.times, run.cycle.duration
    singular = np.where(table.status >= Status.SINGULAR, np.nan, 0.0)  # there is no answer
    readings = []
    for measure, order, course, curve in zip(picked, figures.orders, table.courses, table.curves, strict=True):
        near = float(times[np.argmin(np.abs(times - order.time))])
        time = near if abs(order.time - near) <= BESIDE * duration else order.time
        extreme = measure.rule in EXTREMES
        kind = f"the {measure.rule}" if extreme else "largest"
        sides = [abs(side) for side in (measure.limit, measure.upper, measure.lower) if side is not None]
        judged_there = bool((measure.at is not None or extreme) and sides)
        readings.append(
            Reading(
                measure, order, curve, _by_joint(course, singular + 0.0 * curve),
                _by_joint(order.figure, np.zeros(())), run.system.dial(run.values, np.array([time])).at(0),
                kind if measure.at is None and len(times) > 1 else "", min(sides) if judged_there else measure.limit,
            )
        )  # fmt: skip
    return _dataset(figures, table, readings, [*_findings(figures, table, readings), *notes])


def _by_joint(first: FirstOrder, blank: Array) -> JointEffects:
    """What first order makes of each play. blank: 0, or NaN where there is no answer."""
    inputs, ends = first.inputs, max(len(first.inputs.ends(joint)) for joint in first.inputs.loose)
    shape = (len(inputs.loose), *first.slope.shape[1:])
    effects = JointEffects(np.zeros(shape), np.zeros(shape), np.full((shape[0], ends, 3, *shape[1:]), np.nan))
    for j, joint in enumerate(inputs.loose):
        carriers = first.plays(j)
        worst = np.array([pin.worst for pin in carriers])
        best = np.argmax(np.nan_to_num(worst) > (1 - EQUAL) * np.nan_to_num(np.max(worst, axis=0)), axis=0)[None]
        effects.worst_case[j] = np.take_along_axis(worst, best, axis=0)[0]
        effects.deviation[j] = np.take_along_axis(np.array([pin.deviation for pin in carriers]), best, axis=0)[0]
        for k, keys in enumerate(inputs.ends(joint)):
            at_end = np.array([pin.loads[k] for pin in carriers])  # (carrier, component, …)
            for key, load in zip(keys, np.moveaxis(at_end, 1, 0), strict=True):
                axis = "xyz".index(key.rpartition(".")[2])
                effects.loads[j, k, axis] = np.take_along_axis(load, best, axis=0)[0]
    return JointEffects(*(part + blank for part in effects))


# ---- findings -------------------------------------------------------------------------------------------------


def _findings(study: ToleranceStudy, table: Table, readings: Sequence[Reading]) -> Iterator[Finding]:
    run, mechanism = study.run, study.run.system.mechanism
    yield from of_run(run, notes=False)
    if run.determinacy is not None and any(part.redundant for part in run.determinacy.parts):
        what = "constraints are redundant: the worst case is an upper bound, because pins constrain one another"
        yield Finding.warning("play.redundant", "joints", what)
    models = CLEARANCE_MODELS[mechanism.space]
    kinds = [
        f"{name} ({joint.type})" for name, joint in run.system.joints.items()
        if joint.type not in models and clearance(name, run.values) is not None
    ]  # fmt: skip
    if kinds:
        what, remedy = f"the play of {', '.join(kinds)} is left out", f"play is modelled in {', '.join(models)} joints"
        yield Finding.warning("play.left_out", "joints", what, remedy, joints=kinds)
    touching = {joint for gear in mechanism.gears.values() if gear.touches for joint in gear.joints}
    if toothed := sorted(touching & {*study.inputs.loose}):
        what = f"gears turn in {', '.join(toothed)}: the effect of this play on the tooth contact is left out"
        yield Finding.warning("play.gears", "gears", what, joints=toothed)
    dial = run.system.dial(run.values, table.plan.times)
    for reading in readings:
        yield from _of_measure(study, reading)
        lost = np.any(np.isnan(reading.over_cycle.worst_case), axis=0) & np.isfinite(reading.curve)
        if np.any(lost & (table.status < Status.SINGULAR)):
            at = dial.intervals(np.flatnonzero(lost & (table.status < Status.SINGULAR)))
            what = f"a magnitude that is 0 has no derivative {at}"
            yield Finding.warning("play.no_answer", f"measures.{reading.measure.name}", what, at=at)
    for code in Status:
        where = np.flatnonzero(table.status == code)
        if code >= Status.NOT_CONVERGED and len(where):
            at = dial.intervals(where)
            yield Finding.error("play.no_answer", "", f"{code.text} {at}", at=at, status=code.text)


def _of_measure(study: ToleranceStudy, reading: Reading) -> Iterator[Finding]:
    """Whether the worst case of a measure keeps its limit, and whether pins at the rims of their holes change it
    otherwise than first order says.

    One of forces is not looked at where a joint is at rest: there the pins turn the sense of its friction.
    """
    measure, order, limit, place = reading.measure, reading.order, reading.limit, reading.place
    first, unit = float(np.sum(reading.at_place.worst_case)), measure.unit(study.run.system)
    where = f"measures.{measure.name}"
    if not np.isfinite(first):
        return
    if limit is not None:
        figures: dict[str, Any] = {"worst": first, "limit": limit, "at": place}
        what = f"the worst case to first order, {readable(first, unit)} at {place}, "
        allowed = f"the limit of {readable(limit, unit)}"
        if first <= limit:
            yield Finding.note("limit.kept", f"{where}.limit", f"{what}is within {allowed}", **figures)
        else:
            remedy = "reduce the play of the joints with the largest share"
            yield Finding.error("limit.exceeded", f"{where}.limit", f"{what}exceeds {allowed}", remedy, **figures)
    solved = measure.of_motion or study.kernel.courses(study.run.values, np.array([order.time]))[1] == Status.SOLVED
    if not (first > 0 and np.all(solved)):
        return
    least, largest = study.searched(order)
    low, high = least.value, largest.value
    off = max(abs(low + first), abs(high - first)) / first
    if off > SLIGHT and least.assembles and largest.assembles:  # else pins cannot get there
        severity = Severity.WARNING if max(-low, high) > (1 + GRAVE) * first else Severity.NOTE
        what = f"to first order it changes by ±{readable(first, unit)} at {place}; the worst found on the mechanism "
        what += f"itself is {readable(low, unit)} and {readable(high, unit)}"
        figures = {"low": low, "high": high, "first": first, "unit": unit, "at": place}
        yield Finding.weighed(severity, "play.beyond_first_order", where, what, "use these figures", **figures)


# ---- the result -----------------------------------------------------------------------------------------------


def _dataset(
    study: ToleranceStudy, table: Table, readings: Sequence[Reading], findings: Sequence[Finding]
) -> xr.Dataset:
    """The arrays with names, units, summary and provenance."""
    run, system, joints = study.run, study.run.system, study.inputs.loose
    worst, deviation, loads = (np.array([reading.over_cycle[k] for reading in readings]) for k in range(3))
    radii = np.full((len(joints), loads.shape[2]), np.nan)
    for row, joint in zip(radii, joints, strict=True):
        for end, radius in enumerate(study.inputs.play(joint, run.values).radii):
            row[end] = max(single(radius), 0.0)
    arrays: dict[str, Array | NDArray[np.int8]] = {
        "value": np.array(table.curves),
        "worst_case": worst,
        "deviation": deviation,
        "worst_case_total": np.sum(worst, axis=1),
        "rss": np.sqrt(np.sum(worst**2, axis=1)),
        "deviation_total": np.sqrt(np.sum(deviation**2, axis=1)),
        "sensitivity": loads,
        "radius": radii,
        "status": table.status,
        "extreme_worst_case": np.array([reading.at_place.worst_case for reading in readings]),
        "extreme_deviation": np.array([reading.at_place.deviation for reading in readings]),
        "extreme_time": np.array([reading.order.time for reading in readings]),
    }
    units = [reading.measure.unit(system) for reading in readings]
    labels = {
        "measure": [reading.measure.name for reading in readings],
        "joint": list(joints),
        "end": [str(k + 1) for k in range(loads.shape[2])],
        "axis": ["x", "y", "z"],
    }
    dial, summary = system.dial(run.values, table.plan.times), list[Figure]()
    for reading, unit in zip(readings, units, strict=True):
        name, (effects, deviations, _) = reading.measure.name, reading.at_place
        total, aspect = float(np.sum(effects)), f"of {reading.kind}" if reading.kind else ""
        figure = Figure(f"{name}.worst_case", f"{name}, worst case to first order", None, unit)
        if not np.isfinite(total):
            summary.append(figure)
            continue
        aspect = "maximum" if reading.kind == "largest" else aspect
        rss, sigma = (float(np.sqrt(np.sum(part**2))) for part in (effects, deviations))
        summary += [
            replace(figure, value=total, aspect=aspect, place=f"at {reading.place}"),
            Figure(f"{name}.rss", f"{name}, RSS there", rss, unit),
            Figure(f"{name}.deviation", f"{name}, standard deviation there", sigma, unit),
            *(
                Figure(f"{name}.{joint}.worst_case", f"{name}, of which {joint}", float(effect), unit)
                for joint, effect in zip(joints, effects, strict=True)
            ),
        ]
    attributes = {
        **provenance(system, findings),
        "limits": [reading.limit for reading in readings],
        "inputs": inputs(system.mechanism),
        "drive": dial.of,
        "drive_unit": dial.unit.strip(),
        "periodic": int(run.cycle.periodic),
        "places": [[reading.kind, reading.place] for reading in readings],
        **scales_of(run).summary(summary),
    }
    members = {"measure": MemberUnits("measure", units)}
    members["sensitivity"] = MemberUnits("measure", [f"{unit}/m" for unit in units])
    variables = described(arrays, VARIABLES, members)
    return dataset_of("play", variables, labels, attributes, driven(table.plan.times, *dial))
