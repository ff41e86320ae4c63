"""What the play of every joint does to measures: worst case and scatter, one number for each clearance.

It is first order of tolerances with nothing but the plays: a small offset cᵢ of the pin at the end i of its hole
changes a measure y by Qᵢ · cᵢ, Qᵢ its derivative by the offset, friction included (`tolerance.effects`). Of a
coordinate or an angle Qᵢ is what the pin presses on that end under the measure's unit load alone: virtual work. With
the offset anywhere in a disc of radius ρ (an interval, a ball, n components):

    worst case   Σ ρᵢ |Qᵢ|
    variance     Σ ρᵢ² |Qᵢ|²/(n + 2)      offsets independent, each uniform over its disc

since ∫ x² over the unit ball of n dimensions is 1/(n + 2) of its volume: ρ²/3 in an interval, ρ²/4 in a disc, ρ²/5 in
a ball. What pins at the rims of their holes do beyond first order is searched on the mechanism itself
(`tolerance.search`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.cycle.model_findings import of_run
from trunnion.cycle.positions import check_steps
from trunnion.cycle.scales import scales_of
from trunnion.cycle.summary import inputs, references
from trunnion.errors import Finding, MechanismError, Severity, Status
from trunnion.joints.clearance import CLEARANCE_MODELS
from trunnion.measures.curves import MOTIONS
from trunnion.measures.measures import Measure, chosen
from trunnion.measures.positions import place_of
from trunnion.model.arguments import strict_arguments
from trunnion.model.joint_parts import clearance
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import cited, finding_rows, origin
from trunnion.results.dataset import MemberUnits, Variable, dataset_of, described, driven
from trunnion.results.figure import Figure
from trunnion.results.quantities import readable
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare
from trunnion.solve.space.determinacy import spins_of
from trunnion.statistics.population import Population
from trunnion.studies.tolerance.effects import FirstOrder
from trunnion.studies.tolerance.inputs import Inputs, plays_of
from trunnion.studies.tolerance.linear import MeasureOrder, Table, ToleranceStudy, stated_or_outputs

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["EXTREMES", "VARIABLES", "play"]

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


@dataclass(frozen=True)
class Played:
    """What play does to measures over the cycle, and at the one place of each.

    measures: as they were asked for; courses: of all of them at every position; figures: of each at its place, which is
    a stated one, that of a maximum or minimum, or where its worst case is largest; over_cycle, at_places: what the
    joints do there.
    """

    run: Run
    measures: Sequence[Measure]
    courses: ToleranceStudy
    table: Table
    figures: ToleranceStudy
    over_cycle: list[JointEffects]
    at_places: list[JointEffects]

    @property
    def inputs(self) -> Inputs:
        """The plays."""
        return self.courses.inputs

    @property
    def status(self) -> NDArray[np.int8]:
        """Of every position."""
        return self.table.status

    @property
    def time(self) -> Array:
        """Times of the positions, s."""
        return self.table.plan.times

    def place(self, i: int) -> str:
        """Where in the cycle the place of a measure is, in words."""
        time = self.figures.orders[i].time
        near = float(self.time[np.argmin(np.abs(self.time - time))])
        time = near if abs(time - near) <= BESIDE * self.run.cycle.duration else time
        return self.run.system.dial(self.run.values, np.array([time])).at(0)


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
    measures_chosen, notes = _measures(run, measures)
    plays = plays_of(run)
    if not plays:
        remedy = "state joints.NAME.pin.clearance (guide.clearance), such as 20 um"
        raise MechanismError(Finding("no joint states a clearance", "joints", remedy))
    value, timed = (None, False) if at is None else place_of(mechanism, at)
    courses = [replace(measure, at=value, timed=timed, over=None, statistic="") for measure in measures_chosen]
    if run.cycle.duration <= 0:  # there is one position
        courses = [replace(measure, statistic="value") for measure in courses]
    inputs_of_plays = Inputs(run, (), tuple(plays), (), (), Population([], None))
    over_cycle = figures = ToleranceStudy(run, inputs_of_plays, tuple(courses), FrictionMethod())
    if at is not None or run.cycle.duration <= 0:
        measures_chosen = courses
    else:
        largest = [order.time for order in over_cycle.orders]
        placed = [
            replace(measure, at=time, timed=True) if measure.rule == "deviation" and np.isfinite(time) else measure
            for measure, time in zip(measures_chosen, largest, strict=True)
        ]
        figures = replace(over_cycle, measures=tuple(placed))
    table = over_cycle.table(steps)
    singular = np.where(table.status >= Status.SINGULAR, np.nan, 0.0)  # there is no answer
    played = Played(
        run, measures_chosen, over_cycle, table, figures,
        [_by_joint(course, singular + 0.0 * curve) for course, curve in zip(table.courses, table.curves, strict=True)],
        [_by_joint(of.figure, np.zeros(())) for of in figures.orders],
    )  # fmt: skip
    return _dataset(played, [*_findings(played), *notes])


def _measures(run: Run, names: Sequence[str] | None) -> tuple[list[Measure], list[Finding]]:
    """The measures asked for; notes where they are chosen because none is stated, or some are left out.

    Each has one number at every position, and its figure is of one place: no mean, and no peak-to-peak.
    """
    measures = chosen(run.system.mechanism, names, run.values)
    covered = [
        measure for measure in measures
        if (measure.kind in MOTIONS or measure.single(run.system)) and measure.statistic in ("", "value", *EXTREMES)
    ]  # fmt: skip
    others = [measure.name for measure in measures if measure not in covered]
    remedy, notes = "use `trunnion tolerance` for other measures", []
    if others and names is not None:
        what = f"this study covers measures with one value at every position, which {', '.join(others)} has not"
        raise MechanismError(Finding(what, "measures", remedy))
    if others:
        what = f"left out: {', '.join(others)}, which have no one value at every position"
        notes = [Finding.note("play.measures_left_out", "measures", what, remedy, measures=others)]
    covered, outputs_taken = stated_or_outputs(run, covered)
    return covered, [*outputs_taken, *notes]


def _by_joint(first: FirstOrder, blank: Array) -> JointEffects:
    """What first order makes of each play. blank: 0, or NaN where there is no answer."""
    inputs, ends = first.inputs, max(len(first.inputs.ends(joint)) for joint in first.inputs.loose)
    shape = (len(inputs.loose), *first.slope.shape[1:])
    loads = np.full((shape[0], ends, 3, *shape[1:]), np.nan)
    effects = JointEffects(np.zeros(shape), np.zeros(shape), loads)
    for j, joint in enumerate(inputs.loose):
        carriers = first.plays(j)
        worst = np.array([pin.worst for pin in carriers])
        best = np.argmax(np.nan_to_num(worst) > (1 - EQUAL) * np.nan_to_num(np.max(worst, axis=0)), axis=0)[None]
        effects.worst_case[j] = np.take_along_axis(worst, best, axis=0)[0]
        effects.deviation[j] = np.take_along_axis(np.array([pin.deviation for pin in carriers]), best, axis=0)[0]
        for k, keys in enumerate(inputs.ends(joint)):
            at_end = np.array([pin.loads[k] for pin in carriers])  # (carrier, component, …)
            for key, load in zip(keys, np.moveaxis(at_end, 1, 0), strict=True):
                loads[j, k, "xyz".index(key.rpartition(".")[2])] = np.take_along_axis(load, best, axis=0)[0]
    return JointEffects(*(part + blank for part in effects))


# ---- findings -------------------------------------------------------------------------------------------------


def _findings(played: Played) -> Iterator[Finding]:
    run, mechanism, loose = played.run, played.run.system.mechanism, played.inputs.loose
    yield from of_run(run, notes=False)
    if run.determinacy is not None and any(part.redundant for part in run.determinacy.parts):
        what = "constraints are redundant: the worst case is an upper bound, because pins constrain one another"
        remedy = "the deviation assumes that each pin can be anywhere within its play"
        yield Finding.warning("play.redundant", "joints", what, remedy)
    models = CLEARANCE_MODELS[mechanism.space]
    kinds = [
        f"{name} ({kind})" for name, (kind, _) in run.system.joints.items()
        if kind not in models and clearance(name, run.values) is not None
    ]  # fmt: skip
    if kinds:
        what, remedy = f"the play of {', '.join(kinds)} is left out", f"play is modelled in {', '.join(models)} joints"
        yield Finding.warning("play.left_out", "joints", what, remedy, joints=kinds)
    toothed = sorted({
        joint for gear in mechanism.gears.values() if gear.touches for joint in gear.joints if joint in loose
    })  # fmt: skip
    if toothed:
        what = f"gears turn in {', '.join(toothed)}: the effect of this play on the tooth contact is left out"
        remedy = "an offset e of a gear's centre across the line of centres turns the gear by e over its pitch radius"
        yield Finding.warning("play.gears", "gears", what, remedy, joints=toothed)
    for _, (link, *ends), members in spins_of(run.system):
        for measure in played.measures:
            owner, _, point = measure.subject.partition(".")
            if owner in members and (measure.kind == "angle" or (measure.kind == "point" and point not in ends)):
                what = f"'{owner}' can spin about the line {ends[0]}-{ends[1]}; this study sets that spin to zero"
                remedy, figures = "measure one of these two points", {"link": link, "points": list(ends)}
                yield Finding.warning("play.spin", f"measures.{measure.name}", what, remedy, **figures)
    if run.seats:
        what = "play is relative to the middle of the holes: the worst case is over all positions of the pins and "
        what += f"does not use the seats of {', '.join(seat.joint for seat in run.seats)}"
        remedy = "`trunnion analyse` has the deviation with these seats"
        yield Finding.note("play.seats_not_taken", "joints", what, remedy, joints=[seat.joint for seat in run.seats])
    yield from _fits(run, loose)
    dial, remedy = run.system.dial(run.values, played.time), "the effect of play is undefined there"
    for i, measure in enumerate(played.measures):
        yield from _of_measure(played, i)
        yield from _beyond_first_order(played, i, played.figures.orders[i])
        lost = np.any(np.isnan(played.over_cycle[i].worst_case), axis=0)
        lost &= np.isfinite(played.table.curves[i]) & (played.status < Status.SINGULAR)
        if lost.any():
            at = dial.intervals(np.flatnonzero(lost))
            what = f"a magnitude that is 0 has no derivative {at}"
            yield Finding.warning("play.no_answer", f"measures.{measure.name}", what, remedy, at=at)
    for code in Status:
        where = np.flatnonzero(played.status == code)
        if code >= Status.NOT_CONVERGED and len(where):
            at = dial.intervals(where)
            yield Finding.error("play.no_answer", "", f"{code.text} {at}", remedy, at=at, status=code.text)


def _fits(run: Run, loose: Sequence[str]) -> Iterator[Finding]:
    """Plays that are the mean of a fit, with the largest that its limits allow."""
    mechanism, limits = run.system.mechanism, run.system.mechanism.tolerances()
    largest: dict[str, float] = {}
    for name in loose if mechanism.fits == "mean" else ():
        hole, pin = (f"joints.{name}.pin.{key}" for key in ("hole_radius", "radius"))
        joint = mechanism.effective_joints[name]
        if joint.pin is not None and joint.pin.fit is not None and {hole, pin} <= limits.keys():
            largest_clearance = run.values[hole] + limits[hole][1] - run.values[pin] - limits[pin][0]
            largest[name] = float(np.ravel(primal(largest_clearance))[0])
    if largest:
        most = max(largest, key=largest.__getitem__)
        what = f"the play of {', '.join(largest)} is the mean of their fits; the largest is "
        what += f"{readable(largest[most], 'm')}, of {most}"
        remedy = "--set fits=maximum takes the largest play"
        figures = {"joints": list(largest), "largest": largest[most], "most": most}
        yield Finding.note("play.mean_of_fits", "fits", what, remedy, **figures)


def _judged_limit(measure: Measure) -> float | None:
    """The deviation that is allowed to either side where the measure is judged: at its place, or at every position."""
    sides = [abs(side) for side in (measure.limit, measure.upper, measure.lower) if side is not None]
    placed = measure.at is not None or measure.rule in EXTREMES
    return min(sides) if placed and sides else measure.limit


def _of_measure(played: Played, i: int) -> Iterator[Finding]:
    """Whether the worst case of a measure keeps its limit, and joints whose play does nothing to it."""
    run, measure, course = played.run, played.measures[i], played.table.curves[i]
    limit, worst, unit = _judged_limit(measure), float(np.sum(played.at_places[i].worst_case)), measure.unit(run.system)
    if limit is not None and np.isfinite(worst):
        where, figures = f"measures.{measure.name}.limit", {"worst": worst, "limit": limit, "at": played.place(i)}
        what = f"the worst case to first order, {readable(worst, unit)} at {played.place(i)}, "
        allowed = f"the limit of {readable(limit, unit)}"
        if worst <= limit:
            yield Finding.note("limit.kept", where, f"{what}is within {allowed}", **figures)
        else:
            remedy = "reduce the play of the joints with the largest share"
            yield Finding.error("limit.exceeded", where, f"{what}exceeds {allowed}", remedy, **figures)
    floor = scales_of(run).floor(unit)
    largest = np.nanmax(played.over_cycle[i].worst_case.reshape(len(played.inputs.loose), -1), axis=1, initial=0.0)
    joints = [joint for joint, most in zip(played.inputs.loose, largest, strict=True) if most <= floor]
    if joints and np.any(np.isfinite(course)):
        what, figures = (
            f"the play of {', '.join(joints)} has no effect on it",
            {"joints": joints, "measure": measure.name},
        )
        yield Finding.note("play.no_effect", f"measures.{measure.name}", what, **figures)


def _beyond_first_order(played: Played, i: int, of: MeasureOrder) -> Iterator[Finding]:
    """A measure that pins at the rims of their holes change otherwise than first order says, at its place.

    One of forces is not looked at where a joint is at rest: there the pins turn the sense of its friction.
    """
    measure, study, first = played.measures[i], played.figures, float(np.sum(played.at_places[i].worst_case))
    if not (first > 0 and np.isfinite(first)):
        return
    if not measure.of_motion:
        _, status = study.kernel.courses(study.run.values, np.array([of.time]))
        if np.ravel(status)[0] != Status.SOLVED:
            return
    least, largest = study.searched(of)
    low, high = least.value, largest.value
    off = max(abs(low + first), abs(high - first)) / first
    if off > SLIGHT and least.assembles and largest.assembles:  # else pins cannot get there
        unit, place = measure.unit(played.run.system), played.place(i)
        severity = Severity.WARNING if max(-low, high) > (1 + GRAVE) * first else Severity.NOTE
        what = f"to first order it changes by ±{readable(first, unit)} at {place}; the worst found on the mechanism "
        what += f"itself is {readable(low, unit)} and {readable(high, unit)}"
        figures = {"low": low, "high": high, "first": first, "unit": unit, "at": place}
        where = f"measures.{measure.name}"
        yield Finding.weighed(severity, "play.beyond_first_order", where, what, "use these figures", **figures)


# ---- the result -----------------------------------------------------------------------------------------------


def _dataset(played: Played, findings: Sequence[Finding]) -> xr.Dataset:
    """The arrays with names, units, summary and provenance."""
    run, system, mechanism = played.run, played.run.system, played.run.system.mechanism
    worst, deviation, loads = (np.array(parts) for parts in zip(*played.over_cycle, strict=True))
    places = played.at_places
    arrays: dict[str, Array | NDArray[np.int8]] = {
        "value": np.array(played.table.curves),
        "worst_case": worst,
        "deviation": deviation,
        "worst_case_total": np.sum(worst, axis=1),
        "rss": np.sqrt(np.sum(worst**2, axis=1)),
        "deviation_total": np.sqrt(np.sum(deviation**2, axis=1)),
        "sensitivity": loads,
        "radius": _radii(played.inputs, loads.shape[2]),
        "status": played.status,
        "extreme_worst_case": np.array([place.worst_case for place in places]),
        "extreme_deviation": np.array([place.deviation for place in places]),
        "extreme_time": np.array([of.time for of in played.figures.orders]),
    }
    units = [measure.unit(system) for measure in played.measures]
    plain_units, per_length = MemberUnits("measure", units), MemberUnits("measure", [f"{unit}/m" for unit in units])
    labels = {
        "measure": [measure.name for measure in played.measures],
        "joint": list(played.inputs.loose),
        "end": [str(k + 1) for k in range(loads.shape[2])],
        "axis": ["x", "y", "z"],
    }
    dial = system.dial(run.values, played.time)
    attributes = {
        **origin(mechanism, system.plan.formula),
        **cited(references(mechanism)),
        "limits": [_judged_limit(measure) for measure in played.measures],
        "inputs": inputs(mechanism),
        "drive": dial.of,
        "drive_unit": dial.unit.strip(),
        "periodic": int(run.cycle.periodic),
        "places": [[_kind_of_place(played, i), played.place(i)] for i in range(len(units))],
        **scales_of(run).summary(_summary(played, units)),
        "findings": finding_rows(findings),
    }
    variables = described(arrays, VARIABLES, {"measure": plain_units, "sensitivity": per_length})
    return dataset_of("play", variables, labels, attributes, driven(played.time, *dial))


def _radii(inputs: Inputs, ends: int) -> Array:
    radii = np.full((len(inputs.loose), ends), np.nan)
    for row, joint in zip(radii, inputs.loose, strict=True):
        radii_of = inputs.play(joint, inputs.run.values).radii
        row[: len(radii_of)] = [max(float(np.ravel(primal(radius))[0]), 0.0) for radius in radii_of]
    return radii


def _kind_of_place(played: Played, i: int) -> str:
    """What the place of a measure is, for tables: empty where it is stated."""
    measure = played.measures[i]
    is_place = measure.at is not None or len(played.time) == 1
    return "" if is_place else f"the {measure.rule}" if measure.rule in EXTREMES else "largest"


def _summary(played: Played, units: Sequence[str]) -> Iterator[Figure]:
    """Of each measure the worst case at its place: what each joint has in it, RSS and deviation."""
    for i, (measure, unit) in enumerate(zip(played.measures, units, strict=True)):
        name, at_place, kind = measure.name, played.at_places[i], _kind_of_place(played, i)
        total = float(np.sum(at_place.worst_case))
        if not np.isfinite(total):
            yield Figure(f"{name}.worst_case", f"{name}, worst case to first order", None, unit)
            continue
        aspect = "maximum" if kind == "largest" else f"of {kind}" if kind else ""
        at = f"at {played.place(i)}"
        yield Figure(f"{name}.worst_case", f"{name}, worst case to first order", total, unit, aspect, at)
        rss, deviation = (float(np.sqrt(np.sum(part**2))) for part in (at_place.worst_case, at_place.deviation))
        yield Figure(f"{name}.rss", f"{name}, RSS there", rss, unit)
        yield Figure(f"{name}.deviation", f"{name}, standard deviation there", deviation, unit)
        for joint, effect in zip(played.inputs.loose, at_place.worst_case, strict=True):
            yield Figure(f"{name}.{joint}.worst_case", f"{name}, of which {joint}", float(effect), unit)
