"""`identify`: numbers of a model from measurements by least squares, with what they are worth; as a Dataset, and in the
model.

Settings of the conditions and paths of the unknowns → one prepared model → blocks of data → fit → covariances → result.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import PurePath
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.summary import inputs, references
from trunnion.errors import Finding, MechanismError, Severity, Status
from trunnion.measures.measures import Measure
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import attribute, finding_rows, origin
from trunnion.results.dataset import Variable, dataset_of, described
from trunnion.results.quantities import decimals, with_uncertainty
from trunnion.rig.comparison import of_data, other_speed, written_unit
from trunnion.rig.identification.fit import (
    FAR,
    Block,
    Fit,
    Solution,
    evaluations,
    refined,
    sensor_errors,
    shared_zero,
    sizes_of,
    solved,
)  # fmt: skip
from trunnion.rig.identification.signals import Model, Parameters, paths_of, unknowns
from trunnion.rig.identification.uncertainty import (
    CONFIDENCE,
    Covariances,
    inseparable,
    lack_of_fit,
    quantile,
    spread_of,
)  # fmt: skip
from trunnion.rig.modelled import each, in_condition, measure_of, same_cycle
from trunnion.rig.reading.measurement import Condition, Measurement, rms
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
SOURCES = (
    "G. A. F. Seber, C. J. Wild, Nonlinear Regression, Wiley, 1989, doi:10.1002/0471725315",
    "JCGM 100:2008, Evaluation of measurement data: Guide to the expression of uncertainty in measurement",
)
NOTHING = 1e-9  # of a course: what an unknown does to it
MOST_NAMED = 6  # conditions in a message
HALVINGS = 8  # of a friction that locks at the start
NEAR_LIMIT = 0.98  # of the most that a stated error may come to
AT_LIMIT = 0.05  # of the standard uncertainty: nearer than this to a limit is on it
MUCH = 3.0  # times what scatter explains, between conditions
POOR = 2.0  # times what is expected, of predictions
UNEXPLAINED = 0.2  # of a misfit: what is left if an error explains it
OFF = 3.0  # standard uncertainties from what was stated of a sensor

PARAMETER, SENSOR, BLOCK = ("parameter",), ("sensor",), ("channel", "condition")
COURSE = (*BLOCK, "position")
VARIABLES = {
    "start": Variable(PARAMETER, "of the parameter", "start of the search"),
    "estimate": Variable(PARAMETER, "of the parameter", "estimate; NaN if not identifiable"),
    "standard_uncertainty": Variable(PARAMETER, "of the parameter", "standard uncertainty of the estimate"),
    "lower": Variable(PARAMETER, "of the parameter", "lower end of the 95 % interval"),
    "upper": Variable(PARAMETER, "of the parameter", "upper end of the 95 % interval"),
    "degrees_of_freedom": Variable(PARAMETER, "1", "effective degrees of freedom of the standard uncertainty"),
    "limit": Variable(PARAMETER, "1", "−1 on the lower limit, 1 on the upper: the interval is one-sided"),
    "told": Variable(PARAMETER, "1", "1 if identifiable, 0 if not, or if the interval is wider than the value itself"),
    "correlation": Variable(("parameter", "parameter_2"), "1", "correlation of the estimates"),
    "share": Variable(("parameter", "source"), "1", "share of a source in the variance of an estimate"),
    "sensor_error": Variable(SENSOR, "1", "estimated error of a sensor, in its standard uncertainties"),
    "sensor_size": Variable(
        SENSOR, "of the sensor", "stated standard uncertainty, of the angle rad; NaN if it differs"
    ),
    "sensor_uncertainty": Variable(SENSOR, "1", "standard uncertainty of that, in those stated"),
    "rms_before": Variable(BLOCK, "of the channel", "root mean square of the residual at the start"),
    "rms_after": Variable(BLOCK, "of the channel", "root mean square of the residual with the estimates"),
    "rms_expected": Variable(BLOCK, "of the channel", "its expected value from the scatter between turns"),
    "used": Variable(BLOCK, "1", "positions used", np.int32),
    "left_out": Variable(BLOCK, "1", "positions with data that are not used", np.int32),
    "turns": Variable(BLOCK, "1", "turns used", np.int32),
    "held_out_turns": Variable(BLOCK, "1", "held-out turns", np.int32),
    "held_out_before": Variable(BLOCK, "of the channel", "rms of the residual of the held-out data, at the start"),
    "held_out_after": Variable(BLOCK, "of the channel", "the same with the estimates"),
    "held_out_expected": Variable(BLOCK, "of the channel", "its expected value, by scatter and prediction"),
    "reduced_chi_squared": Variable((), "1", "χ² of the residuals relative to the scatter between turns"),
    "chi_squared_freedom": Variable((), "1", "degrees of freedom of that χ²"),
    "chi_squared_chance": Variable((), "1", "chance of a larger one if the model is right"),
    "turn_correlation": Variable((), "1", "correlation of the contributions of successive turns"),
    "hold_out_ratio": Variable((), "1", "residuals of the held-out data over their expected value"),
    "phase": Variable(("condition", "position"), "1", "share of the cycle"),
    "measured": Variable(COURSE, "of the channel", "mean over the turns"),
    "residual_before": Variable(COURSE, "of the channel", "measured minus model, at the start"),
    "residual_after": Variable(COURSE, "of the channel", "measured value minus predicted reading of the sensor"),
    "residual_uncertainty": Variable(COURSE, "of the channel", "standard uncertainty of the mean over the turns"),
}


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def identify(
    mechanism: Mechanism,
    measurement: Measurement,
    parameters: Parameters,
    channels: Sequence[str] | None = None,
    start: Mapping[str, float | str] | None = None,
    hold_out: Sequence[str] = (),
    guard: int | None = None,
    friction_method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """Identify numbers of a mechanism, with 95 % intervals, correlation, and what cannot be told apart.

    Weighted least squares with exact derivatives by a trust region; covariances by the scatter between turns.

    Parameters
    ----------
    mechanism : the model.
    measurement : as `rig.read` or `rig.observe` has it.
    parameters : names as for `Mechanism.with_values`, each an unknown; or by a name of your own the numbers that are to
        be one unknown: `{"pins": ["pin-1.friction.coefficient", "pin-2.friction.coefficient"]}`.
    channels : of the measurement; all that an unknown acts on if not given.
    start : where the search begins, by name, SI or texts with units; the model's values if not given.
    hold_out : conditions by name, file or setting, that are not fitted but predicted.
    guard : positions left out on each side where the sense of a friction changes; one for every 90 of a cycle if not
        given.
    friction_method : how friction and reactions are settled; Newton's method if not given.
    progress : called with the number of models evaluated.

    Returns
    -------
    Dataset with the estimates by parameter, errors of the sensors, and residuals by channel, condition and position.

    Raises
    ------
    MechanismError
        For names, channels or conditions that are not there, or where the model has no answer.
    """
    if guard is not None and guard < 0:
        raise MechanismError(Finding(f"{guard} positions cannot be left out", "guard", "give 0 or more"))
    conditions = measurement.conditions
    each(conditions, partial(in_condition, mechanism))
    paths = paths_of(mechanism, parameters)
    mechanism, settings = _with_settings(mechanism, conditions, paths, start or {})
    run = prepare(mechanism)
    if run.determinacy is not None:
        run.determinacy.refuse()
    blocks, measures = _blocks(run, measurement, channels, hold_out)
    if follow := [seat.joint for seat in run.seats if seat.given is None]:
        what = f"pins lie as their loads press them, which carries no derivatives: {', '.join(follow)}"
        raise MechanismError(Finding(what, "seat", "state seat: free, or the side that each lies on"))
    phases = tuple(np.asarray(condition.phase, float) for condition in conditions)
    sought = tuple(unknowns(mechanism, paths, start or {}))
    model = Model(run, sought, measures, settings, phases, friction_method or FrictionMethod())
    if channels is None:
        model = replace(model, measures=_acted_on(model))
        blocks = [block for block in blocks if block.channel in model.measures]
    encoder = f"drivers.{next(iter(mechanism.drivers), '')}.start"  # an unknown of data that state an angle
    starts = [condition.start for condition in conditions]
    if not (any(encoder in unknown.paths for unknown in sought) and np.isfinite(starts).any()):
        encoder = ""
    at = np.array([unknown.before[0] if encoder in unknown.paths else unknown.start for unknown in sought])

    def check(k: int) -> None:
        cycle = model.cycle(k, at)
        same_cycle(run, conditions[k], model.cycles[k].duration, cycle.begin, cycle.turn)

    each(range(len(conditions)), check)
    errors = sensor_errors(model, conditions, blocks)
    fit = Fit(model, evaluations(model, progress or (lambda count: None)), blocks, errors, guard)
    fit, best = refined(fit, _runnable(fit))
    spread = spread_of(fit, best.x)
    if spread.excess > 1 and fit.sensors:
        fit = replace(fit, inflation=spread.excess)
        best = best._replace(x=solved(fit, best.x).x)
        spread = spread_of(fit, best.x)
    return _result(mechanism, measurement, fit, best, spread, encoder)


# ---- the data and the model -----------------------------------------------------------------------------------


def _blocks(
    run: Run, measurement: Measurement, channels: Sequence[str] | None, hold_out: Sequence[str]
) -> tuple[list[Block], dict[str, Measure]]:
    """One for each channel in each condition; all channels if none is named. What each channel measures.

    hold_out: conditions by name, by a setting in it, or by file. MechanismError for what names none, or has no course.
    """
    conditions, held = measurement.conditions, set[int]()
    every = list(dict.fromkeys(name for condition in conditions for name in condition.courses))
    if not every:
        raise MechanismError(Finding("the measurement has no channels", measurement.name, "map one to a measure"))
    if missing := [name for name in channels or () if name not in every]:
        remedy = f"the measurement has {', '.join(every)}"
        raise MechanismError(Finding(f"there is no channel '{missing[0]}'", "channels", remedy))
    names_of = []
    for condition in conditions:  # spaces and signs of equality as one likes
        files = [PurePath(file) for file in condition.files]
        names = [condition.name, *condition.name.split(", "), *(file.name for file in files)]
        names += [file.stem for file in files]
        names_of.append({re.sub(r"[\s=]", "", name) for name in names} - {""})
    for text in [hold_out] if isinstance(hold_out, str) else hold_out:
        named = {k for k, names in enumerate(names_of) if re.sub(r"[\s=]", "", text) in names}
        if not named:
            listed = "; ".join(condition.name for condition in conditions[:MOST_NAMED])
            remedy = f"name one of {listed}{'; …' * (len(conditions) > MOST_NAMED)}; or a file, or NAME=VALUE"
            raise MechanismError(Finding(f"there is no condition '{text}'", "hold_out", remedy))
        held |= named
    if len(held) == len(conditions):
        raise MechanismError(Finding("all conditions are held out", "hold_out", "leave some to fit"))
    blocks: list[Block] = []
    measures: dict[str, Measure] = {}
    for (k, condition), channel in product(enumerate(conditions), every if channels is None else channels):
        if (signal := condition.courses.get(channel)) is not None:
            turns = np.where(np.isinf(signal.turns), np.nan, signal.turns)
            blocks.append(Block(k, channel, replace(signal, turns=turns), k in held))
            measure = measure_of(run.system.mechanism, run, channel, signal.measures, signal)
            if measures.setdefault(channel, measure).name != measure.name:
                what = f"measures {measures[channel].name} in one condition and {measure.name} in another"
                raise MechanismError(Finding(what, f"channel {channel}", "use separate channels"))
    return blocks, measures


def _with_settings(
    mechanism: Mechanism,
    conditions: Sequence[Condition],
    paths: Mapping[str, Sequence[str]],
    start: Mapping[str, float | str],
) -> tuple[Mechanism, tuple[dict[str, float], ...]]:
    """The mechanism with all numbers stated that conditions set or that are looked for, and what each sets, by path.

    MechanismError where a condition sets what is looked for, or what is no number.
    """
    values = (condition.values.items() for condition in conditions)
    settings = [{mechanism.path_of(name): float(value) for name, value in pairs} for pairs in values]
    owners = {path: name for name, members in paths.items() for path in members}
    numbers: dict[str, float | str] = {path: value for row in reversed(settings) for path, value in row.items()}
    numbers |= {path: start.get(name, 0.0) for path, name in owners.items()}
    missing = {path: item for path, item in numbers.items() if path not in mechanism.parameter_set.entries}
    mechanism = mechanism.with_values(missing) if missing else mechanism
    every = mechanism.parameters()
    for condition, row in zip(conditions, settings, strict=True):
        for path in row:
            what = f"the condition {condition.name} sets {path}"
            if path in owners:
                raise MechanismError(Finding(what, f"parameter {owners[path]}", "leave it out of the conditions"))
            if path not in every:
                what += ", but it is no number: it changes with the motion"
                raise MechanismError(Finding(what, path, "set a dimension in it"))
    return mechanism, tuple(settings)


def _acted_on(model: Model) -> dict[str, Measure]:
    """The channels that an unknown acts on, as far as the start shows; all if there are none."""
    sizes, moved = np.array([unknown.size or 1.0 for unknown in model.unknowns])[:, None], set[str]()
    for row in model.courses(model.start):
        for name, value in row.values.items():
            most = float(np.nanmax(np.abs(value), initial=0.0)) or 1.0
            if np.nanmax(np.abs(np.nan_to_num(row.slopes[name])) * sizes, initial=0.0) > NOTHING * most:
                moved.add(name)
    return {name: measure for name, measure in model.measures.items() if not moved or name in moved}


def _runnable(fit: Fit) -> Array:
    """The start, with less friction where that locks. MechanismError if no position can be used."""
    rubs = [p for p, unknown in enumerate(fit.model.unknowns) if any(".friction." in path for path in unknown.paths)]
    starts, lost = [fit.start], list[int]()
    for k in range(HALVINGS + 1):
        lost.append(sum(int(np.sum(row.status >= Status.NOT_CONVERGED)) for row in fit.courses(starts[-1])))
        if not (lost[-1] and rubs):
            break
        starts.append(fit.start.copy())
        starts[-1][rubs] = np.maximum(fit.start[rubs] * 0.5 ** (k + 1), fit.bounds[0][rubs])
    best = starts[int(np.argmin(lost))]
    masks = replace(fit, variances=fit.scatter()).allowed(best)
    if not any(np.any(masks[k]) for k in fit.fitted):
        codes = np.concatenate([row.status for row in fit.courses(best)])
        what = "no position can be used: no channel has a value there, friction reverses beside it, or the model has "
        what += f"no sound answer (most often {list(Status)[int(np.bincount(codes).argmax())].text})"
        remedy = "see the gaps with `trunnion data`; give a smaller guard, or start values with which the model runs"
        raise MechanismError(Finding(what, "data", remedy))
    return best


# ---- the result -----------------------------------------------------------------------------------------------


def _result(
    mechanism: Mechanism, measurement: Measurement, fit: Fit, solution: Solution, spread: Covariances, encoder: str
) -> xr.Dataset:
    """Estimates with their uncertainty, residuals and findings, errors and warnings first.

    encoder: path of an unknown by which the encoder of the data is off, no number of the mechanism; empty without.
    """
    model, conditions, n, x = fit.model, measurement.conditions, fit.count, solution.x
    names, system = [unknown.name for unknown in model.unknowns], model.run.system
    drive = next(iter(mechanism.drivers), "")
    groups = inseparable(fit, x, spread)
    figures = _figures(fit, x, spread, groups)
    lost, u = figures["lost"], figures["standard_uncertainty"]
    variances = np.array([*map(np.diagonal, spread.parts.values())])
    sizes = [{abs(error.angle)} if error.angle else set(error.sizes[error.sizes != 0]) for error in fit.sensors]
    arrays = {
        **_residuals(fit, x, spread, conditions),
        **{name: row[:n] for name, row in figures.items()},
        "start": fit.start[:n],
        "degrees_of_freedom": spread.freedom[:n],
        "told": (~lost & ~figures["vague"])[:n].astype(np.int8),
        "correlation": np.clip(spread.covariance[:n, :n] / np.outer(u[:n], u[:n]), -1.0, 1.0),
        "share": np.where(lost[:n, None], np.nan, (variances / np.sum(variances, axis=0))[:, :n].T),
        "sensor_error": np.where(lost, np.nan, x)[n:],
        "sensor_uncertainty": u[n:],
        "sensor_size": np.array([size.pop() if len(size) == 1 else np.nan for size in sizes]),
        "reduced_chi_squared": np.asarray(spread.test.reduced),
        "chi_squared_freedom": np.asarray(spread.test.freedom),
        "chi_squared_chance": np.asarray(spread.test.chance),
        "turn_correlation": np.asarray(spread.follows),
    }
    labels = {
        "parameter": names, "parameter_2": names, "source": list(spread.parts),
        "sensor": [error.name for error in fit.sensors], "channel": list(model.measures),
        "condition": [condition.name for condition in conditions],
    }  # fmt: skip
    evaluations = fit.evaluate.cache_info().misses  # without those that tell what refutes the estimates
    refuting = {} if spread.test.gross else _refuting(fit, x, spread)
    values = np.asarray(np.where(lost, fit.start, x)[:n])
    cycles = [model.cycle(k, values) for k in range(len(conditions))]
    ends = [(cycle.begin, cycle.begin + cycle.turn) for cycle in cycles]
    speeds = [(conditions[k], cycles[k].speed) for k in sorted({fit.blocks[k].condition for k in fit.fitted})]
    findings = [
        *other_speed(drive, speeds),
        *_of_fit(fit, solution, spread, lost, spread.test.gross or bool(refuting), float(arrays["hold_out_ratio"])),
        *_of_unknowns(fit, x, spread.test.gross, figures, groups, refuting),
    ]
    attributes = {
        "name": mechanism.name,
        "identified": measurement.name,
        **origin(mechanism, system.plan.formula),
        "confidence": CONFIDENCE,
        "encoder": encoder,
        "parameter_paths": [unknown.paths for unknown in model.unknowns],
        "parameter_units": [unknown.unit for unknown in model.unknowns],
        "channel_units": [measure.unit(system) for measure in model.measures.values()],
        "channel_measures": [measure.name for measure in model.measures.values()],
        "drive": drive,
        # angles of the first driver where the cycle begins and ends, rad; None if they name no position
        "drive_range": [list(pair) if np.isfinite(pair).all() else None for pair in ends],
        "files": [list(condition.files) for condition in conditions],
        **of_data(measurement),
        "inputs": inputs(mechanism),
        "evaluations": evaluations,
        "converged": int(solution.converged),
        "references": "\n".join([*SOURCES, *references(mechanism)]),
        "findings": finding_rows(sorted(findings, key=lambda finding: list(Severity).index(finding.severity))),
    }
    variables = described({name: arrays[name] for name in VARIABLES}, VARIABLES)
    return dataset_of("identification", variables, labels, attributes)


def _figures(fit: Fit, x: Array, spread: Covariances, groups: Sequence[tuple[int, ...]]) -> dict[str, NDArray[Any]]:
    """Of unknowns and, behind them, of errors of sensors: estimate, uncertainty and 95 % interval within the limits.

    limit: that an estimate is on, −1, 0 or 1; the interval is then one-sided, from where a step without limits ends if
    that is inside. lost: what the data do not tell; half: of a two-sided interval, whether they do or not; vague: whose
    interval is wider than twice itself, or than its limits are apart.
    """
    (low, high), half = fit.bounds, quantile(spread.freedom) * spread.deviation
    lost = np.isin(np.arange(len(x)), [member for group in groups for member in group])
    u = np.where(lost, np.nan, spread.deviation)
    step = -spread.inverse @ (fit.jacobian(x).T @ fit.residuals(x))
    near = AT_LIMIT * np.nan_to_num(u) + 1e-9 * np.abs(x)
    upper, lower = (~lost & (gap <= near) for gap in (high - x, x - low))
    limit = np.where(upper & (step >= 0), 1, np.where(lower & (step <= 0), -1, 0))
    estimate = np.where(lost, np.nan, np.where(limit < 0, low, np.where(limit > 0, high, x)))
    one_sided = quantile(spread.freedom, one_sided=True) * u
    least = np.where(limit > 0, np.minimum(x + step, high) - one_sided, np.where(limit < 0, low, estimate - half))
    most = np.where(limit < 0, np.maximum(x + step, low) + one_sided, np.where(limit > 0, high, estimate + half))
    return {
        "limit": limit.astype(np.int8), "estimate": estimate, "standard_uncertainty": u,
        "lower": np.maximum(least, low), "upper": np.minimum(most, high),
        "lost": lost, "half": half, "vague": (half > np.minimum(sizes_of(fit, x), (high - low) / 2)) & ~lost,
    }  # fmt: skip


def _refuting(fit: Fit, x: Array, spread: Covariances) -> dict[int, float]:
    """What errors of sensors come to with nothing stated of them, by place, where that is far off: of those at their
    limit, and of those without which there is hardly a misfit."""
    test, excess = spread.test, dict[int, float]()
    fit = replace(fit, inflation=1.0) if test.misfit else fit
    for s, (error, size) in enumerate(zip(fit.sensors, x[fit.count :], strict=True)):
        at_limit = abs(size) > NEAR_LIMIT * error.most
        if error.stated and (at_limit or test.misfit):
            free = replace(fit, sensors=[*fit.sensors[:s], replace(error, stated=False), *fit.sensors[s + 1 :]])
            end = solved(free, x).x
            explained = at_limit or lack_of_fit(free, end).reduced - 1 < UNEXPLAINED * (test.reduced - 1)
            if explained and abs(end[fit.count + s]) >= FAR:
                excess[s] = float(end[fit.count + s])
    return excess


def _residuals(fit: Fit, x: Array, spread: Covariances, conditions: Sequence[Condition]) -> dict[str, NDArray[Any]]:
    """Residuals, (channel, condition) and (channel, condition, position), with the phases of the conditions; and those
    of all predictions over what is expected of them, NaN if nothing is held out."""
    channels, longest = list(fit.model.measures), max(len(condition.phase) for condition in conditions)
    sizes = {"channel": len(channels), "condition": len(conditions), "position": longest}
    arrays = {name: var.blank(sizes) for name, var in VARIABLES.items() if var.dims and {*var.dims} <= {*sizes}}
    for k, condition in enumerate(conditions):
        arrays["phase"][k, : len(condition.phase)] = condition.phase
    allowed = fit.allowed(x)
    for k, block in enumerate(fit.blocks):
        at, signal, mask = (channels.index(block.channel), block.condition), block.signal, fit.masks[k]
        mask = allowed[k] if block.held else mask
        before, after = (np.where(mask, fit.gap(values, k), np.nan) for values in (fit.start, x))
        # of the positions that are used: beside jumps turns scatter more
        variance, rows = block.pooled(mask) / np.maximum(signal.count, 1), dict[str, Array]()
        figures: dict[str, float]
        if block.held:
            columns = np.where(mask, np.nan_to_num(fit.reading(x, k)[1]), 0.0)
            predicted = np.einsum("pi,pq,qi->i", columns, spread.covariance, columns)
            expected = np.where(mask, np.sqrt(variance + predicted), np.nan)
            figures = {"held_out_turns": len(signal.turns), "held_out_before": rms(before),
                       "held_out_after": rms(after), "held_out_expected": rms(expected)}  # fmt: skip
        else:
            expected = np.where(mask & block.repeats, np.sqrt(variance + block.unresolved**2), np.nan)
            rows = {"measured": signal.mean, "residual_before": before, "residual_after": after,
                    "residual_uncertainty": expected}  # fmt: skip
            figures = {"turns": len(signal.turns), "rms_before": rms(before), "rms_after": rms(after),
                       "rms_expected": rms(expected), "used": int(np.count_nonzero(mask)),
                       "left_out": int(np.count_nonzero(np.isfinite(signal.mean) & ~mask))}  # fmt: skip
        for name, row in rows.items():
            arrays[name][at][: len(row)] = row
        for name, figure in figures.items():
            arrays[name][at] = figure
    arrays["hold_out_ratio"] = np.asarray(rms(arrays["held_out_after"] / arrays["held_out_expected"]))
    return arrays


# ---- findings -------------------------------------------------------------------------------------------------


def _of_fit(
    fit: Fit, solution: Solution, spread: Covariances, lost: NDArray[np.bool_], refuted: bool, ratio: float
) -> Iterator[Finding]:
    """Whether the search converged, the model fits and predicts, and turns and conditions repeat."""
    test = spread.test
    if not (solution.converged and solution.settled):
        what, remedy = "the search did not converge", "give start values closer to the solution, or fewer parameters"
        severity = Severity.WARNING if solution.converged else Severity.ERROR
        yield Finding.weighed(severity, "search.not_ended", "search", what, remedy, evaluations=solution.evaluations)
    if test.misfit:
        worth = "the estimates mean nothing" if refuted else "the intervals are widened accordingly"
        reduced = f"{float(f'{test.reduced:.3g}'):,.10g}"  # without a power of ten
        what = f"the model does not fit: reduced χ² {reduced} (1 is expected from the scatter between turns), p-value "
        what += f"{max(test.chance, 1e-4):.2g}{' or less' * (test.chance < 1e-4)}; {worth}"
        remedy = "`trunnion compare` shows what zero, gain, angle or friction would explain it; or identify more "
        severity = Severity.ERROR if refuted else Severity.WARNING
        figures = {"reduced": test.reduced, "chance": test.chance}
        yield Finding.weighed(severity, "fit.misfit", "fit", what, f"{remedy}parameters", **figures)
    if ratio > POOR:
        what = f"the held-out data differ from the prediction by {ratio:.1f} times its standard uncertainty"
        remedy = "the model lacks an effect that differs there"
        yield Finding.warning("held_out.missed", "hold_out", what, remedy, times=ratio)
    for p, unknown in enumerate(fit.model.unknowns):
        times = float(np.sqrt(spread.apart[p]))
        if times > 1 and not lost[p]:
            what = f"the conditions disagree: estimates from single ones vary {times:.2g} times as much as the "
            what += "scatter between turns explains; the interval is widened accordingly"
            remedy = "look for differences between conditions: settings, speed, temperature, the zero of each file"
            severity = Severity.WARNING if times > MUCH else Severity.NOTE
            where = f"parameter {unknown.name}"
            yield Finding.weighed(severity, "fit.conditions_disagree", where, what, remedy, times=times)
    fitted = [fit.blocks[k] for k in fit.fitted]
    if not any(block.repeats for block in fitted):
        what = "no turn is repeated: the scatter is estimated from the residuals, the model cannot be tested, and the "
        what += "intervals are too narrow if the data are filtered"
        yield Finding.warning("fit.not_repeated", "data", what, "record several turns")
    if spread.follows > 2 / np.sqrt(max(sum(len(block.spread) - 1 for block in fitted), 1)):
        what = f"successive turns are correlated ({spread.follows:.2f}): the intervals are widened accordingly"
        remedy = "look for a drift; warm the rig up"
        yield Finding.warning("fit.turns_alike", "data", what, remedy, correlation=spread.follows)


def _of_unknowns(
    fit: Fit,
    x: Array,
    gross: bool,
    figures: Mapping[str, NDArray[Any]],
    groups: Sequence[tuple[int, ...]],
    refuting: Mapping[int, float],
) -> Iterator[Finding]:
    """Channels whose zero and gain count as exact; errors far from what is stated, where nothing explains a misfit;
    unknowns without an effect, that are not told apart, or that the data hardly determine."""
    stated = {fit.blocks[k].channel for k in fit.fitted for accuracy in [fit.blocks[k].signal.accuracy]
              if shared_zero(accuracy) or accuracy.gain}  # fmt: skip
    channels = dict.fromkeys(fit.blocks[k].channel for k in fit.fitted)
    if bare := [name for name in channels if name not in stated and not fit.model.measures[name].of_motion]:
        what = f"no accuracy is stated for {', '.join(bare)}: zero and gain count as exact, and the intervals are too "
        remedy = "state accuracy: {zero: …, gain: …} in the mapping"
        yield Finding.warning("sensor.no_accuracy", "sensors", f"{what}narrow", remedy)
    for s, sensor in enumerate(fit.sensors) if not gross else ():
        excess, times = s in refuting, abs(refuting.get(s, float(x[fit.count + s])))
        if sensor.stated and times > OFF:
            what = f"differs from its stated value by {times:.1f} standard uncertainties"
            what += ", which no stated error does: the estimates mean nothing" * excess
            remedy = "check the sensor, its unit, its stated accuracy, and lengths and loads of the model"
            where, severity = "angle.zero" if sensor.angle else sensor.name, (Severity.WARNING, Severity.ERROR)[excess]
            yield Finding.weighed(severity, "sensor.off", where, what, remedy, times=times, beyond=excess)
    every = [*(unknown.name for unknown in fit.model.unknowns), *(f"the {error.name}" for error in fit.sensors)]
    for group in groups:
        names = [every[i] for i in group]
        what = "is not identifiable: it has no effect on" if len(names) == 1 else "are not separately identifiable: "
        what = f"{' and '.join(names)} {what}{'they have the same effect on' * (len(names) > 1)} {', '.join(channels)}"
        remedy = "fix one or more, or measure a quantity that tells them"
        yield Finding.warning("parameter.not_told_apart", f"parameter {names[0]}", what, remedy, names=names)
    for p, unknown in enumerate(fit.model.unknowns) if not (gross or refuting) else ():
        if figures["vague"][p]:  # of a model that does not fit, that is why
            about = with_uncertainty(float(x[p]), float(figures["half"][p]), unknown.unit)
            what = f"{unknown.name} is not identifiable: its 95 % interval, {about}, is wider than the value itself"
            remedy = "fix it, or measure a quantity that depends on it more"
            yield Finding.warning("parameter.vague", f"parameter {unknown.name}", what, remedy)


# ---- estimates in the model -----------------------------------------------------------------------------------


def with_estimates(mechanism: Mechanism, result: xr.Dataset) -> Mechanism:
    """Put the estimates of a result into the mechanism, rounded to two digits of their standard uncertainty.

    Parameters
    ----------
    mechanism : the model that was identified.
    result : of `identify`.

    Returns
    -------
    The mechanism with the estimates, in the units that were written there; what is not identifiable stays as it is, and
    so does the start of a driver: by that the encoder is off, and the zero of the angle in the mapping.
    """
    values: dict[str, float | str] = {}
    units = attribute(result, "parameter_units")
    for p, paths in enumerate(attribute(result, "parameter_paths")):
        estimate, u = (float(result[name].values[p]) for name in ("estimate", "standard_uncertainty"))
        if not result["told"].values[p] or result.attrs["encoder"] in paths:
            continue
        for path in paths:
            entry = mechanism.parameter_set.entries.get(path)
            unit, factor = written_unit(entry.quantity.source if entry else "", units[p])
            places, value = decimals(u / factor) if u > 0 else 6, estimate / factor
            number = f"{round(value, places):.{max(places, 0)}f}" if places < 12 else f"{value:.6g}"
            values[path] = f"{number} {unit}" if unit else float(number)
    return mechanism.with_values(values)
