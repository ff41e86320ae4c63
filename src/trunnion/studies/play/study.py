"""What the play of every joint does to a measure: worst case and scatter, one number for each clearance.

A small offset cᵢ of the pin in the end i of its hole changes a measure y by Qᵢ · cᵢ. Of a coordinate or an angle, Qᵢ
is what the pin presses on that end under the measure's unit load alone, without friction and with the drivers at
rest: virtual work. So one walk backward through the modules serves all joints. For a speed or a force no load stands,
and Qᵢ is its derivative by the offset, friction included: dual numbers through the whole analysis.

With the offset anywhere in a disc of radius ρ (an interval, a ball, n components):

    worst case   Σ ρᵢ |Qᵢ|
    variance     Σ ρᵢ² |Qᵢ|²/(n + 2)      offsets independent, each uniform over its disc

since ∫ x² over the unit ball of n dimensions is 1/(n + 2) of its volume: ρ²/3 in an interval, ρ²/4 in a disc, ρ²/5 in
a ball. Both are of first order in the play.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy
from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.unwrap import unwrap_row
from trunnion.cycle.findings import model_notes
from trunnion.cycle.positions import check_steps
from trunnion.cycle.scales import scales_of
from trunnion.errors import Finding, MechanismError, Severity, Status
from trunnion.joints.clearance import CLEARANCE_MODELS, Vector, worst_case
from trunnion.measures import curves
from trunnion.measures.curves import MOTIONS
from trunnion.measures.evaluation import NumpyKernel
from trunnion.measures.many import Many
from trunnion.measures.measures import Measure, chosen, outputs
from trunnion.measures.positions import place_of, plan, within
from trunnion.model.arguments import strict_arguments
from trunnion.model.joint_parts import clearance
from trunnion.model.mechanism import Mechanism
from trunnion.results.sentences import finding_for
from trunnion.solve import shifts
from trunnion.solve.backward import under
from trunnion.solve.forward import Forward, forward
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare
from trunnion.solve.shifts import HOLE, Play
from trunnion.solve.status import pose_status, status_of
from trunnion.solve.system import System, Values
from trunnion.studies.play.effect import Effect
from trunnion.studies.play.exact import beyond_first_order, figures_with
from trunnion.studies.play.result import EXTREMES, dataset

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Effect", "by_duals", "by_virtual_load", "play", "plays", "variance"]

CHUNK = 4096  # positions at a time
LOCATED = Accuracy(1e-6, 1e-9, shortest=1e-7, rounds=16)  # of the worst case, which is of first order

Array = NDArray[np.float64]
Loads = dict[str, list[Vector]]  # load at each end, by joint


# ---- what an offset does --------------------------------------------------------------------------------------


def plays(system: System, values: Values) -> dict[str, Play]:
    """The play of every joint that states some, by joint; where it is less than none, the fit presses: none."""
    space, found = system.mechanism.space, {}
    for name, (kind, _) in system.joints.items():
        one = shifts.play_of(space, kind, values, name)
        if one is not None:
            found[name] = one._replace(radii=tuple(np.where(radius > 0, radius, 0.0) for radius in one.radii))
    return found


def by_virtual_load(walk: Forward, measure: Measure, known: Mapping[str, Play]) -> Loads:
    """Qᵢ of a measure of the motion at each end of each joint: ∂y/∂cᵢ, in its unit a metre, hole's frame."""
    loads = curves.loads(measure, walk)
    back = under(walk, loads)
    return {name: play.model.loads(*back.on_hole(name), play.length) for name, play in known.items()}


def by_duals(
    run: Run, measure: Measure, known: Mapping[str, Play], time: Array, method: FrictionMethod, carrier: str = HOLE
) -> Loads:
    """The same by derivatives through the whole analysis, of any measure that is one number at each position.

    carrier: of `shifts.CARRIERS`, the link on which seats stay: pins that turn with one or the other move otherwise.
    """
    rows = _offsets(known, carrier)
    offsets = {path: Dual(0.0, row) for path, row in rows.items()}
    with np.errstate(all="ignore"):
        if measure.kind in MOTIONS:
            number = curves.value(measure, forward(run.system, {**run.values, **offsets}, run.chosen.assembly, time))
        elif measure.of_motion:
            number = measure.curve(forward(run.system, {**run.values, **offsets}, run.chosen.assembly, time))[0]
        else:
            number = measure.curve(run.at(time, offsets, method))[0]
    return _by_end(known, np.broadcast_to(derivative(number), (len(rows), len(time))))


def of_figure(many: Many, measure: Measure, known: Mapping[str, Play], carrier: str = HOLE) -> Loads:
    """The same of an extreme, whose place moves with the pins."""
    rows = _offsets(known, carrier)
    values = {**many.run.values, **{path: Dual(0.0 * row, row) for path, row in rows.items()}}
    return _by_end(known, np.reshape(derivative(many.read(values)[measure.name].figure), (len(rows), 1)))


def _offsets(known: Mapping[str, Play], carrier: str) -> dict[str, Array]:
    """Paths of the offsets with a row each, (sample, 1), in which it is 1 in a sample of its own."""
    paths = [f"{carrier}.{name}.{key}" for name, play in known.items() for end in play.model.ends for key in end]
    return dict(zip(paths, np.eye(len(paths))[:, :, None], strict=True))


def _by_end(known: Mapping[str, Play], slopes: Array) -> Loads:
    each = iter(slopes)
    return {name: [tuple(next(each) for _ in end) for end in play.model.ends] for name, play in known.items()}


def variance(loads: Sequence[Vector], radii: Sequence[Number]) -> Number:
    """Variance of the work of the loads with each offset uniform over its interval, disc or ball: Σ ρ² |Q|²/(n + 2)."""
    total: Number = 0.0
    for load, radius in zip(loads, radii, strict=True):
        square: Number = 0.0
        for part in load:
            square = square + part * part
        total = total + radius * radius * square / (len(load) + 2)
    return total


# ---- over the cycle -------------------------------------------------------------------------------------------


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def play(
    mechanism: Mechanism,
    measures: Sequence[str] | None = None,
    steps: int = 360,
    progress: Callable[[int], None] | None = None,
    at: float | str | None = None,
) -> xr.Dataset:
    """What the play of every joint does to measures over the cycle: worst case and standard deviation.

    measures: names of the model's, or written as `named` reads them, of what has one number at every position:
    `link.point.x`, `angle:link`, `effort:driver`, `velocity:link.point` …; all of the model if not given, or, where it
    states none, rotation and slide of every joint to the ground that is not driven. The figures of a maximum or minimum
    are those at its place, `extreme_worst_case`; other statistics are left out. Returns a Dataset over (measure,
    joint, position) of `result.VARIABLES`: SI, each measure in its own unit. NaN where a position has no answer.
    steps: equally spaced positions of the cycle. at: one position instead, such as "20 mm" or, in SI, 0.02.
    progress: called with the number of positions done.
    Method: virtual work for coordinates and angles, derivatives by dual numbers for others; first order in the play,
    about the mechanism with every pin in the middle of its hole.
    Raises MechanismError if no joint states a clearance, for an unknown measure, or as `analyse` does.
    """
    check_steps(steps)
    run = prepare(mechanism)
    if run.determinacy is not None:
        run.determinacy.refuse()
    found, told = _measures(run, measures)
    known = plays(run.system, run.values)
    _check(known)
    if at is None:
        effect = _over(run, found, known, run.cycle.times(steps if run.cycle.duration > 0 else 1), progress)
        effect = replace(effect, there=_theres(run, found, known))
    else:
        value, timed = place_of(mechanism, at)
        there = plan(run, [replace(found[0], at=value, over=None, timed=timed)], 1)
        found = [replace(one, at=None) for one in found]
        effect = _over(run, found, known, there.times, progress)
        effect = replace(effect, there={one.name: _over(run, [one], known, there.times) for one in found})
    return dataset(effect, [*_model_findings(run, effect), *told])


def _measures(run: Run, names: Sequence[str] | None) -> tuple[list[Measure], list[Finding]]:
    """The measures asked for; notes where they are chosen because none is stated, or some are left out."""
    found = chosen(run.system.mechanism, names, run.values)
    others = [one.name for one in found if not _covered(run, one)]
    what = f"this study covers measures with one value at every position, which {', '.join(others)} has not"
    remedy = "use `trunnion tolerance` for other measures"
    if others and names is not None:
        raise MechanismError(Finding(what, "measures", remedy))
    notes = [finding_for("play.measures_left_out", "measures", measures=others)] if others else []
    found = [one for one in found if one.name not in others]
    if found:
        return found, notes
    found = outputs(run.system)
    remedy = "state measures: in the model, or give --measure link.point.x"
    if not found:
        raise MechanismError(
            Finding("no measure is stated, and no joint to the ground is an output", "measures", remedy)
        )
    return found, [finding_for("measure.none_stated", "measures", measures=[one.name for one in found]), *notes]


def _covered(run: Run, measure: Measure) -> bool:
    """Whether it has one number at every position, and its figure is of one place: no mean, and no peak-to-peak."""
    return (measure.kind in MOTIONS or measure.single(run.system)) and measure.statistic in ("", "value", *EXTREMES)


def _theres(run: Run, measures: Sequence[Measure], known: Mapping[str, Play]) -> dict[str, Effect]:
    """What play does to each measure at its place, that of a maximum or minimum with every pin in the middle.

    To first order an extreme changes as its course does there: where the course turns back, to move along it does
    nothing. One at a break of its course changes as the break moves too.
    """
    found = {}
    for measure in measures:
        if measure.at is not None:
            found[measure.name] = _over(run, [measure], known, plan(run, [measure], 1).times)
        elif measure.rule in EXTREMES:
            many = Many(run, [measure], run.values, lambda some: NumpyKernel(run, some, FrictionMethod()))
            there = _over(run, [measure], known, within(run, np.nan_to_num([many.times[measure.name]])))
            if measure.kind not in MOTIONS:
                loads, others = _both(run, known, partial(of_figure, many, measure))
                _put(there, 0, loads, slice(None), np.ones(1, bool), others)
            found[measure.name] = replace(there, figure=partial(figures_with, many, measure))
        else:
            found[measure.name] = _over(run, [measure], known, np.array([_largest(run, measure, known)]))
    return found


def _largest(run: Run, measure: Measure, known: Mapping[str, Play]) -> float:
    """Time, s, of the largest worst case of a measure in the cycle, away from dead centres if it is anywhere else."""

    def look(time: Array) -> tuple[Array, NDArray[np.intp]]:
        effect = _over(run, [measure], known, time)
        return effect.total, effect.status.astype(np.intp)

    courses = run.courses(look, accuracy=LOCATED)
    sound = courses.states < Status.NEAR_SINGULAR
    floor = scales_of(run).floor(measure.unit(run.system))
    place = courses.extreme(lambda rows: rows[0], 1.0, sound if np.any(sound) else None, floor)
    return 0.0 if place is None or place.everywhere or run.cycle.duration <= 0 else place.time


def _check(known: Mapping[str, Play]) -> None:
    """MechanismError if there is no play, or not all that is to know of one."""
    if not known:
        remedy = "state joints.NAME.pin.clearance (guide.clearance), such as 20 um"
        raise MechanismError(Finding("no joint states a clearance", "joints", remedy))
    findings = [finding for name, one in known.items() for finding in shifts.unstated_length(name, one)]
    if findings:
        raise MechanismError(findings)


def _over(
    run: Run,
    measures: Sequence[Measure],
    known: Mapping[str, Play],
    time: Array,
    progress: Callable[[int], None] | None = None,
) -> Effect:
    """The effect at some positions of the cycle, by their times, s."""
    steps = len(time)
    shape = (len(measures), len(known), steps)
    ends = max(len(play.model.ends) for play in known.values())
    loads, others = np.full((2, len(measures), len(known), ends, 3, steps), np.nan)
    effect = Effect(
        run, measures, known, time, np.zeros((len(measures), steps)), np.zeros(shape), np.zeros(shape), loads, others,
        np.zeros(shape, bool), np.zeros(steps, np.int8),
    )  # fmt: skip
    rates = np.zeros((len(measures), steps))
    for low in range(0, steps, CHUNK):
        window = slice(low, min(low + CHUNK, steps))
        with np.errstate(all="ignore"):
            _fill(effect, rates, window)
        if progress:
            progress(window.stop)
    step = float(time[1] - time[0]) if steps > 1 else 0.0
    for i, measure in enumerate(measures):
        if measure.turning(run.system):
            unwrap_row(effect.value[i], rates[i], step)
    return effect


def _fill(effect: Effect, rates: Array, window: slice) -> None:
    """The numbers of some positions; NaN where there is no answer."""
    run, time = effect.run, effect.time[window]
    walk = forward(run.system, run.values, run.chosen.assembly, time)
    status = pose_status(walk, time.shape)
    posed = status < Status.SINGULAR
    method = FrictionMethod()
    back, acting = None, posed
    if not all(measure.of_motion for measure in effect.measures):
        back = run.solve(time, method=method)
        status = np.maximum(status, status_of(back, time.shape))
        acting = status < Status.NOT_CONVERGED
    effect.status[window] = status
    for i, measure in enumerate(effect.measures):
        if measure.kind in MOTIONS:
            value, known, rates[i, window] = curves.value(measure, walk), posed, curves.rate(measure, walk)
            loads, others = by_virtual_load(walk, measure, effect.plays), None
            placed = status < Status.NOT_ASSEMBLED
        else:
            value = measure.curve(walk if back is None or measure.of_motion else back)[0]
            known = placed = posed if measure.of_motion else acting
            loads, others = _both(run, effect.plays, partial(by_duals, run, measure, time=time, method=method))
        effect.value[i, window] = np.where(placed, value, np.nan)
        _put(effect, i, loads, window, known, others or {})


def _both(run: Run, known: Mapping[str, Play], loads_of: Callable[..., Loads]) -> tuple[Loads, Loads]:
    """Loads of a speed or a force, of plays and the link that carries their seats: on the links that do, and the others
    if the model does not say."""
    carriers = {name: shifts.carriers_of(run.system.mechanism, name) for name in known}
    found = []
    for place in range(2):
        loads: Loads = {}
        for carrier in shifts.CARRIERS:
            own = {name: one for name, one in known.items() if carriers[name][place : place + 1] == (carrier,)}
            loads |= loads_of(known=own, carrier=carrier) if own else {}
        found.append(loads)
    return found[0], found[1]


def _put(effect: Effect, i: int, loads: Loads, window: slice, known: NDArray[np.bool_], others: Loads) -> None:
    """Worst case and deviation of one measure; others: loads with seats on the other links, which count where they do
    more."""
    for j, (name, one) in enumerate(effect.plays.items()):
        most, scatter = worst_case(loads[name], one.radii), variance(loads[name], one.radii)
        if name in others:
            other = worst_case(others[name], one.radii)
            effect.on_others[i, j, window] = elsewhere = other > most
            most, scatter = (
                np.where(elsewhere, other, most),
                np.where(elsewhere, variance(others[name], one.radii), scatter),
            )
        effect.worst_case[i, j, window] = np.where(known, most, np.nan)
        effect.deviation[i, j, window] = np.where(known, np.sqrt(scatter), np.nan)
        for of, kept in ((loads, effect.loads), (others, effect.others)):
            for k, (end, load) in enumerate(zip(one.model.ends, of.get(name, ()), strict=False)):
                for key, part in zip(end, load, strict=True):
                    kept[i, j, k, "xyz".index(key.rpartition(".")[2]), window] = np.where(known, part, np.nan)


# ---- what there is to say -------------------------------------------------------------------------------------


def _model_findings(run: Run, effect: Effect) -> Iterator[Finding]:
    mechanism = run.system.mechanism
    yield from (one for one in model_notes(mechanism, run.system) if one.severity is not Severity.NOTE)
    yield from run.chosen.findings
    if run.determinacy is not None:
        yield from run.determinacy.findings()
        if any(part.redundant for part in run.determinacy.parts):
            yield finding_for("play.redundant", "joints")
    yield from _left_out(run, effect.plays)
    yield from _spinning(run, effect.measures)
    if run.seats:
        yield finding_for("play.seats_not_taken", "joints", joints=[one.joint for one in run.seats])
    yield from _fits(run, effect.plays)
    yield from _limits(run, effect)
    for i, measure in enumerate(effect.measures):
        yield from _idle(run, effect, i)
        yield from beyond_first_order(effect.there[measure.name])
    dial = run.system.dial(run.values, effect.time)
    for code in Status:
        where = np.flatnonzero(effect.status == code)
        if code >= Status.NOT_CONVERGED and len(where):
            yield finding_for("play.no_answer", at=dial.intervals(where), status=code.text)


def _left_out(run: Run, known: Mapping[str, Play]) -> Iterator[Finding]:
    """Joints whose play has no model, or does more than the model of the mechanism knows."""
    mechanism = run.system.mechanism
    models = CLEARANCE_MODELS[mechanism.space]
    stated = [
        name
        for name, (kind, _) in run.system.joints.items()
        if kind not in models and clearance(name, run.values) is not None
    ]
    if stated:
        kinds = [f"{name} is {run.system.joints[name][0]}" for name in stated]
        yield finding_for("play.left_out", "joints", joints=list(stated), kinds=kinds, modelled=list(models))
    toothed = sorted({
        joint for gear in mechanism.gears.values() if gear.teeth for joint in gear.joints if joint in known
    })  # fmt: skip
    if toothed:
        yield finding_for("play.gears", "gears", joints=toothed)


def _fits(run: Run, known: Mapping[str, Play]) -> Iterator[Finding]:
    """Plays that are the mean of a fit, with the largest that its limits allow."""
    mechanism, limits = run.system.mechanism, run.system.mechanism.tolerances()
    largest: dict[str, float] = {}
    for name in known if mechanism.fits == "mean" else ():
        hole, pin = (f"joints.{name}.pin.{key}" for key in ("hole_radius", "radius"))
        joint = mechanism.effective_joints[name]
        if joint.pin is not None and joint.pin.fit is not None and {hole, pin} <= limits.keys():
            own = run.values[hole] + limits[hole][1] - run.values[pin] - limits[pin][0]
            largest[name] = float(np.ravel(primal(own))[0])
    if largest:
        most = max(largest, key=largest.__getitem__)
        yield finding_for("play.mean_of_fits", "fits", joints=list(largest), largest=largest[most], most=most)


def _spinning(run: Run, measures: Sequence[Measure]) -> Iterator[Finding]:
    """Measures of links that may spin about the line of their joints."""
    for link, *ends in (one for module in run.system.plan.modules for one in module.spinning):
        for measure in measures:
            owner, _, point = measure.subject.partition(".")
            if owner == link and (measure.kind == "angle" or (measure.kind == "point" and point not in ends)):
                yield finding_for("play.spin", f"measures.{measure.name}", link=link, points=list(ends))


def _limits(run: Run, effect: Effect) -> Iterator[Finding]:
    """Measures whose worst case is above their limit, and those that keep theirs."""
    for measure in effect.measures:
        there, unit, where = effect.there[measure.name], measure.unit(run.system), f"measures.{measure.name}.limit"
        sides = [abs(side) for side in (measure.limit, measure.upper, measure.lower) if side is not None]
        placed = measure.at is not None or measure.rule in EXTREMES
        limit, worst = min(sides) if placed and sides else measure.limit, float(there.total[0, 0])
        if limit is None or not np.isfinite(worst):
            continue
        factor, shown = (180 / np.pi, "deg") if unit == "rad" else (1e3, "mm") if unit == "m" else (1.0, unit)
        code, at = "limit.kept" if worst <= limit else "limit.exceeded", run.system.dial(run.values, there.time).at(0)
        yield finding_for(code, where, worst=factor * worst, limit=factor * limit, unit=shown, at=at)


def _idle(run: Run, effect: Effect, i: int) -> Iterator[Finding]:
    """Joints whose play does nothing to a measure.

    Of a measure that moves, likely another joint is driven in the machine; of one that stays as it is over the cycle
    the other joints hold it, whatever is driven.
    """
    measure, course = effect.measures[i], effect.value[i]
    floor = scales_of(run).floor(measure.unit(run.system))
    largest = [float(np.nanmax(row, initial=0.0)) for row in effect.worst_case[i]]
    idle = [joint for joint, most in zip(effect.plays, largest, strict=True) if most <= floor]
    told: dict[str, Any] = {"where": f"measures.{measure.name}", "joints": idle, "measure": measure.name}
    known, drivers = course[np.isfinite(course)], list(run.system.mechanism.drivers)
    if not idle:
        return
    if len(effect.time) == 1:  # elsewhere it may have some
        yield finding_for("play.no_effect_there", at=run.system.dial(run.values, effect.time).at(0), **told)
    elif len(known) and np.ptp(known) <= floor:
        yield finding_for("play.held", holding=[joint for joint in effect.plays if joint not in idle], **told)
    else:
        yield finding_for("play.no_effect", drivers=drivers, count=len(drivers), **told)
