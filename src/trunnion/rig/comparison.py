"""A model beside a measurement: residual and verdict of every channel in every working condition, and the efficiency.

The model is run with the values of each condition and taken at the positions of the measurement. It has no uncertainty
of its own here: what its numbers are uncertain by is not in the verdict.

The expanded uncertainty U = k_p u of a position has the coverage probability that `coverage` (2) has of a normal
distribution: k_p is Student's for the effective degrees of freedom of u (GUM, JCGM 100:2008, G.4 and G.6.4). Of a true
model about that share of the positions lies within ±U. How far a single course may stay below it depends on how many
of its positions are independent of each other, which the turns show (`independent`).
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from math import erf, sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.summary import PEZZUTI, inputs, references
from trunnion.errors import Coded, Finding, MechanismError, Severity, Status, counted
from trunnion.model.arguments import strict_arguments
from trunnion.model.expression import LITERAL
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import as_key, nearest
from trunnion.model.units import UnitError, normalise, unit
from trunnion.results.attributes import cited, codes, finding_rows, origin
from trunnion.results.dataset import Variable, dataset_of, described
from trunnion.results.quantities import joined, number, readable
from trunnion.rig.modelled import Modelled, apart, each, in_condition, modelled
from trunnion.rig.reading.measurement import (
    Condition,
    Measurement,
    Signal,
    Uncertainty,
    efficiency_of,
    pairs_of,
    rms,
)  # fmt: skip
from trunnion.rig.reading.turns import gathered
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import useful_loads, useful_springs

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
GUM = "JCGM 100:2008, Evaluation of measurement data - Guide to the expression of uncertainty in measurement (GUM)"
SURE = 2.326  # standard deviations: the share of a true model falls below its least in 1 % of courses
ROUNDING = 1e-9  # of the size of a course: differences below it are none
FAR = 3.0  # times the RMS of U, beyond which the RMS of a residual is no chance even where all positions err alike
VAGUE = 0.5  # expanded uncertainty from which an efficiency is none
SLOWER = 0.01  # of a speed: a difference to speak of
MOST_NAMED = 3  # conditions in one finding
CAUSES = {
    "zero": ("", "error of the zero that fits the residual best"),
    "gain": ("1", "relative error of the gain that fits the residual best"),
    "angle": ("rad", "angle by which the readings would be ahead of the model"),
    "friction": ("1", "change of all friction, relative to the model's, that fits the residual best"),
}

# unit empty: that of each channel, in the attribute `channel_units`; "set": of what is set, in `set_units`; "drive":
# rad, m or s, as `drive_unit` says
CC, C = ("channel", "condition"), ("condition",)
COURSE = (*CC, "position")
EXPLAINED = "share of the mean square of the residual that it explains"
VARIABLES: dict[str, Variable] = {
    "value": Variable(("set", "condition"), "set", "number of the model that the condition sets; NaN if it does not"),
    "phase": Variable(("condition", "position"), "1", "share of the cycle from its start"),
    "drive": Variable(("condition", "position"), "drive", "coordinate of the first driver, or time"),
    "status": Variable(("condition", "position"), "1", "code of the model's status; see flag_meanings", np.int8),
    "measured": Variable(COURSE, "", "mean over the turns"),
    "scatter": Variable(COURSE, "", "standard deviation between turns"),
    "uncertainty": Variable(COURSE, "", "standard uncertainty of the mean: scatter, zero, gain"),
    "expanded": Variable(COURSE, "", "expanded uncertainty U of the mean"),
    "model": Variable(COURSE, "", "the model with the values of the condition"),
    "residual": Variable(COURSE, "", "measured minus model"),
    "compared": Variable(COURSE, "1", "1 where the position counts in the figures of the channel", np.int8),
    "turns": Variable(CC, "1", "turns that were measured", np.int32),
    "accuracy_zero": Variable(CC, "", "standard uncertainty of the zero"),
    "accuracy_gain": Variable(CC, "1", "standard uncertainty of the gain, relative"),
    "rms": Variable(CC, "", "root mean square of the residual"),
    "largest": Variable(CC, "", "residual of the largest size"),
    "largest_at": Variable(CC, "drive", "where the largest residual is"),
    "bias": Variable(CC, "", "mean residual"),
    "bias_expanded": Variable(CC, "", "expanded uncertainty of the bias"),
    "rms_unbiased": Variable(CC, "", "root mean square of the residual less the bias"),
    "within": Variable(CC, "1", "share of the positions within ±U"),
    "within_least": Variable(CC, "1", "least share of agreeing positions for agreement of the signal"),
    "correlation": Variable(CC, "1", "correlation of measured and model over the positions"),
    "verdict": Variable(CC, "1", "code of the verdict; see the attribute verdict_meanings", np.int8),
    **{f"{kind}_error": Variable(CC, unit, what) for kind, (unit, what) in CAUSES.items()},
    **{f"{kind}_explains": Variable(CC, "1", EXPLAINED) for kind in CAUSES},
    "efficiency": Variable(C, "1", "measured efficiency"),
    "efficiency_expanded": Variable(C, "1", "expanded uncertainty of the measured efficiency"),
    "efficiency_model": Variable(C, "1", "efficiency of the model"),
    "efficiency_within": Variable(C, "1", "1 if the model's efficiency is within ±U, −1 if one is unknown", np.int8),
}


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def compare(
    mechanism: Mechanism,
    measurement: Measurement,
    channels: Sequence[str] | None = None,
    coverage: float = 2.0,
    *,
    friction_method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """Compare the model with a measurement, condition by condition and channel by channel.

    At each position the model has the condition's values; U is that of the GUM from the scatter between turns, the zero
    and the gain of the sensor. Where a course is not within U, the size of an error of the zero, the gain, the crank
    angle and the friction is fitted to the residual, each by itself, with the share that it explains.

    Parameters
    ----------
    mechanism : the model.
    measurement : as `rig.read` or `rig.observe` has it.
    channels : some of the measurement's by name; all that measure something if not given.
    coverage : factor k of the expanded uncertainty U = k u where turns are many.
    friction_method : how friction and reactions are settled; Newton's method if not given.
    progress : called with the number of conditions done.

    Returns
    -------
    Dataset over (channel, condition, position), SI, residual = measured − model; NaN where the model has no answer or
    nothing was measured.

    Raises
    ------
    MechanismError
        For values, channels or measures that the model does not have.
    """
    if not (np.isfinite(coverage) and 0 < coverage <= 8):
        raise MechanismError(Finding(f"{coverage:g} is no coverage factor", "coverage", "give such as 2, up to 8"))
    measures, method = _measures(measurement, channels), friction_method or FrictionMethod()
    rows = each(measurement.conditions, lambda item: _compared(mechanism, item, measures, coverage, method), progress)
    sets = list(dict.fromkeys(name for row in rows for name in row.condition.values))
    channels, positions = list(measures), max(len(row.condition.phase) for row in rows)
    sizes = {"set": len(sets), "condition": len(rows), "channel": len(channels), "position": positions}
    arrays: dict[str, NDArray[Any]] = {name: variable.blank(sizes) for name, variable in VARIABLES.items()}
    arrays["verdict"][:], arrays["efficiency_within"][:] = Verdict.NOTHING, -1
    arrays["status"][:] = Status.NOT_ASSEMBLED  # of positions that a condition with fewer does not have
    for k, row in enumerate(rows):
        arrays["value"][:, k] = [row.condition.values.get(name, np.nan) for name in sets]
        for channel, figures in row.figures.items():
            at: dict[str, int | slice] = {"condition": k, "position": slice(0, len(row.condition.phase))}
            at["channel"] = channels.index(channel) if channel else 0
            for name, figure in figures.items():
                arrays[name][tuple(at[dim] for dim in VARIABLES[name].dims)] = figure
    if not any("efficiency" in row.figures[""] for row in rows):
        arrays = {name: array for name, array in arrays.items() if not name.startswith("efficiency")}
    labels = {"channel": channels, "condition": [row.condition.name for row in rows], "set": sets}
    attributes = _attributes(mechanism, measurement, measures, sets, rows, coverage, method)
    return dataset_of("comparison", described(arrays, VARIABLES), labels, attributes)


def _measures(measurement: Measurement, channels: Sequence[str] | None) -> dict[str, str]:
    """What each channel measures, by name; MechanismError if there is none, or not one that is asked for."""
    every: dict[str, str] = {}
    for condition in measurement.conditions:
        every = {name: signal.measures for name, signal in condition.courses.items() if signal.measures} | every
    if missing := [name for name in channels or () if name not in every]:
        raise MechanismError(Finding(f"there is no channel '{missing[0]}'", "--channel", nearest(missing[0], every)))
    if not every:
        what = "no channel measures anything of the model" if measurement.conditions else "there is no condition in it"
        remedy = "state measures: effort:DRIVER of a channel in the mapping"
        raise MechanismError(Finding(what, measurement.name, remedy))
    return {name: every[name] for name in dict.fromkeys(every if channels is None else channels)}


# ---- one condition ----------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class ConditionComparison:
    """A condition beside its model.

    figures: by channel, by variable of the result; under "" those of the condition, with the efficiency if there is
    one; doubt: why its uncertainty is not known, and what to do about it.
    """

    condition: Condition
    model: Modelled
    signals: Mapping[str, Signal]
    figures: Mapping[str, Mapping[str, Any]]
    doubt: tuple[str, str]


def _compared(
    mechanism: Mechanism, condition: Condition, measures: Mapping[str, str], coverage: float, method: FrictionMethod
) -> ConditionComparison:
    measured = {name: what for name, what in measures.items() if name in condition.courses}
    joints = {name: load.joint for name, load in mechanism.loads.items() if load.joint is not None}
    powers = pairs_of(condition, joints)
    of_powers = {signal.channel: signal.measures for side in powers or () for pair in side for signal in pair}
    model = modelled(mechanism, condition, measured, method, of_powers)

    @cache
    def frictionless() -> Mapping[str, Array]:
        """Courses of the model without its friction; none where it has no friction, or has no answer without it."""
        with suppress(MechanismError):
            stated = in_condition(mechanism, condition)
            if (free := stated.with_friction("off")).data() != stated.data():
                return modelled(free, replace(condition, values={}, units={}), measured, method).courses
        return {}

    figures: dict[str, dict[str, Any]] = {"": {"phase": condition.phase, "drive": model.drive, "status": model.status}}
    signals = {name: replace(condition.courses[name], local=model.left_open.get(name, 0.0)) for name in measured}
    drive = model.drive if model.unit == "rad" and len(model.drive) > 1 else None
    for name, signal in signals.items():
        course, comparable = model.courses[name], model.comparable(name)
        slope = np.gradient(course) / np.gradient(model.drive) if drive is not None else np.zeros_like(course)
        angle = np.nan_to_num(np.hypot(condition.lag * condition.speed, condition.cut) * slope)
        figures[name] = judge(signal, course, comparable, model.drive, coverage, angle)
        if figures[name]["verdict"] in (Verdict.NOT, Verdict.OFFSET):
            free = None if model.measures[name].of_motion else frictionless().get(name)
            gap = np.where(comparable, figures[name]["residual"], np.nan)
            for kind, (size, share) in causes(gap, course, signal.accuracy.datum, drive, free).items():
                figures[name] |= {f"{kind}_error": size, f"{kind}_explains": share}
    doubt = ("", "")
    efforts = {signal.measures for signal in condition.courses.values()}
    needed = {f"effort:{name}": f"drivers.{name}" for name in mechanism.drivers}
    needed |= {f"load:{name}": f"loads.{name}" for name in useful_loads(mechanism)}
    missing = [name for measure, name in needed.items() if measure not in efforts]
    missing += [f"springs.{name}" for name in useful_springs(mechanism)]
    if powers and missing:
        remedy = "measure effort: of every driver and load: of every useful load, each with its rate:"
        doubt = f"the power of {', '.join(missing)} is not measured", remedy
    elif powers and of_powers.keys() <= model.courses.keys():
        efficiency, doubt = _efficiency(condition, model, joints, coverage)
        figures[""] |= efficiency
    return ConditionComparison(condition, model, signals, figures, doubt)


def causes(
    residual: Array, model: Array, datum: float = 0.0, drive: Array | None = None, frictionless: Array | None = None
) -> dict[str, tuple[float, float]]:
    """Fit the shape of each error to a residual by least squares, one coefficient each, to first order.

    residual: measured minus model, NaN where they are not compared; datum: value at which the sensor reads 0, from
    where an error of its gain acts; drive: angle of the driver, rad, None if it does not name the positions;
    frictionless: the model without its friction, None if it has none. Returns by kind, of those that change the course,
    the size, see CAUSES, and the share of the mean square of the residual that goes away with it.
    """
    shapes = {"zero": np.ones_like(model), "gain": model - datum}
    if drive is not None:
        shapes["angle"] = np.gradient(model) / np.gradient(drive)
    if frictionless is not None:
        shapes["friction"] = model - frictionless
    explained = {}
    for kind, shape in shapes.items():
        where = np.isfinite(residual) & np.isfinite(shape)
        gap, along = residual[where], shape[where]
        square, total = float(along @ along), float(gap @ gap)
        if square > 0 and total > 0:
            size = float(along @ gap) / square
            explained[kind] = size, size**2 * square / total
    return explained


def _efficiency(
    condition: Condition, model: Modelled, joints: Mapping[str, str], coverage: float
) -> tuple[dict[str, float], tuple[str, str]]:
    """Efficiency as a rig computes it, of the measured courses and of the model's in their place; and a doubt."""
    solved = model.status < Status.NOT_CONVERGED
    courses = {  # a load has no torque where its joint rests, and takes no power
        name: replace(condition.courses[name], turns=np.where(solved, np.nan_to_num(course), course)[np.newaxis])
        for name, course in model.courses.items()
    }
    value, half, theirs, doubt = np.nan, np.nan, np.nan, ("", "")
    with suppress(MechanismError):  # the model has no answer at some position
        # its positions are equal steps of time, whatever those of the measurement are
        theirs = efficiency_of(replace(condition, courses=courses, speed=np.nan), joints).value
    try:
        measured = efficiency_of(condition, joints)
        value, half = measured.value, measured.factor(coverage) * measured.uncertainty
        if len(measured.per_turn) < 2:
            doubt = "there is only one turn: the uncertainty cannot be estimated without scatter", "measure more turns"
        elif half > VAGUE or value > 1 + half:
            doubt = f"{value:.4f} ± {half:.3g} is no efficiency", "check sign, gain, unit and column of its channels"
    except MechanismError as error:  # no turn is whole, or no power goes in
        doubt = error.findings[0].what, error.findings[0].remedy
    half = np.nan if doubt[0] else half
    within = float(abs(value - theirs) <= half) if np.isfinite([value, half, theirs]).all() else -1.0
    figures = {"": value, "_expanded": half, "_model": theirs, "_within": within}
    return {f"efficiency{key}": figure for key, figure in figures.items()}, doubt


# ---- the verdict ----------------------------------------------------------------------------------------------


class Verdict(Coded):
    """What a comparison of one course comes to."""

    WITHIN = 0, "within"
    OFFSET = 1, "offset only"
    NOT = 2, "not within"
    UNKNOWN = 3, "U unknown"
    NOTHING = 4, "no data"


def judge(
    signal: Signal,
    model: Array,
    comparable: NDArray[np.bool_],
    drive: Array,
    coverage: float = 2.0,
    angle: Array | float = 0.0,
) -> dict[str, Any]:
    """Compare a signal with the course of the model, (position,), where that is `comparable`, one number.

    drive: coordinate of the driver; coverage: factor k of U = k u where turns are many; angle: standard uncertainty by
    the angle of the drive. Returns courses, figures of the residual and verdict, by the name of the variable of a
    comparison; no figures where nothing can be compared.
    """
    where, every = comparable & np.isfinite(signal.mean) & np.isfinite(model), signal.parts(angle)
    courses: dict[str, Any] = {
        "measured": signal.mean, "scatter": signal.scatter, "uncertainty": every.total,
        "expanded": every.expanded(coverage), "model": model,
        "residual": difference(signal.mean, model), "compared": where, "turns": len(signal.turns),
        "accuracy_zero": signal.accuracy.zero, "accuracy_gain": signal.accuracy.gain, "verdict": Verdict.NOTHING,
    }  # fmt: skip
    if not np.any(where):
        return courses
    measured, modelled, of = signal.mean[where], model[where], every.at(where)
    residual, size = difference(measured, modelled), float(np.max(np.abs([measured, modelled])))
    bias, bias_expanded, correlation = float(np.mean(residual)), np.nan, np.nan
    means = np.mean(_nearly_complete(of.turns), axis=1)
    if len(means) > 1:  # of the mean residual: scatter of the means of the turns, resolution, zero and gain
        random = np.array([np.std(means, ddof=1) / np.sqrt(len(means))])
        local = np.array([np.sqrt(np.mean(of.local**2) / len(of.local))])
        shared = np.mean(of.shared, axis=1, keepdims=True)
        mean = Uncertainty(random, local, shared, np.array([len(means)]), of.turns[:, :1])
        bias_expanded = float(mean.expanded(coverage)[0])
    if min(np.max(np.abs(course - np.mean(course))) for course in (measured, modelled)) > ROUNDING * size:
        correlation = float(np.corrcoef(measured, modelled)[0, 1])  # Pearson's; of none that is flat
    worst = int(np.argmax(np.abs(residual)))
    share, least, near = _share(residual, of, coverage, ROUNDING * size)
    # a constant is taken out: what is left is against the scatter and what the gain makes of the shape
    shape = replace(of, shared=(of.shared - np.mean(of.shared, axis=1, keepdims=True))[1:])
    unbiased_share, unbiased_least, alike = _share(residual - bias, shape, coverage, ROUNDING * size)
    verdict = Verdict.OFFSET if alike and unbiased_share >= unbiased_least else Verdict.NOT
    verdict = Verdict.UNKNOWN if np.isnan(share) else Verdict.WITHIN if near and share >= least else verdict
    return courses | {
        "rms": rms(residual), "largest": float(residual[worst]), "largest_at": float(drive[where][worst]),
        "bias": bias, "bias_expanded": bias_expanded, "rms_unbiased": rms(residual - bias), "within": share,
        "within_least": least, "correlation": correlation, "verdict": verdict,
    }  # fmt: skip


def difference(measured: Array, model: Array) -> Array:
    """Measured less model, 0 where it is rounding."""
    residual = measured - model
    size = float(np.nanmax(np.abs(np.append(measured, model)), initial=0.0))
    return np.where(np.abs(residual) <= ROUNDING * size, 0.0, residual)


def _share(residual: Array, of: Uncertainty, coverage: float, rounding: float) -> tuple[float, float, bool]:
    """Share of the positions within ±U, and how small that of a true model may be; NaN if no uncertainty is known.

    And whether the residual as a whole is less than `FAR`: the share says nothing of how far off the others are.
    """
    limit, p = of.expanded(coverage), erf(coverage / sqrt(2.0))
    finite = np.isfinite(limit)
    if not np.any(finite):
        return np.nan, np.nan, False
    share = float(np.mean(np.abs(residual[finite]) <= limit[finite] + rounding))
    least = p - SURE * float(np.sqrt(p * (1 - p) / independent(of.at(finite))))
    return share, least, rms(residual[finite]) <= FAR * rms(limit[finite] + rounding)


def independent(of: Uncertainty) -> float:
    """How many positions are as good as independent of each other: N²/Σρᵢⱼ², from 1 to N.

    Correlated are the parts shared by all positions, and the scatter as the turns show it; its Σρ² is that of n turns
    less what chance makes of n, by Srivastava (2005), J. Japan Statist. Soc. 35, 251-272. Two turns do not show it:
    then it is 1.
    """
    total, turns = of.total, _nearly_complete(of.turns)
    count, freedom = len(total), len(turns) - 1
    if freedom < 2 or not np.any(of.random > 0):
        return 1.0
    unit = np.where(total > 0, total, 1.0)
    rows = turns / unit / np.sqrt(len(turns) * freedom)  # Σ rows² is the random share of the variance of each position
    gram = rows @ rows.T if len(rows) < count else rows.T @ rows  # the smaller has the same trace, and its square
    trace, square = float(np.trace(gram)), float(np.sum(gram**2))
    scatter = freedom**2 / ((freedom - 1) * (freedom + 2)) * (square - trace**2 / freedom)
    parts = of.shared / unit
    mixed = 2 * float(np.sum((rows @ parts.T) ** 2))
    both = max(scatter, 0.0) + mixed + float(np.sum((parts @ parts.T) ** 2))
    return float(np.clip(count**2 / max(both, count), 1.0, count))


def _nearly_complete(turns: Array) -> Array:
    """The turns that have at least half of their positions, with no deviation where a position is missing."""
    return np.asarray(np.nan_to_num(turns[np.mean(np.isfinite(turns), axis=1) >= 0.5]))


# ---- the result -----------------------------------------------------------------------------------------------


def _attributes(
    mechanism: Mechanism, measurement: Measurement, measures: Mapping[str, str], sets: Sequence[str],
    rows: Sequence[ConditionComparison], coverage: float, method: FrictionMethod,
) -> dict[str, Any]:  # fmt: skip
    first, entries = rows[0].model, {row["path"]: row for row in inputs(mechanism)}
    signals = {name: next(row.signals[name] for row in rows if name in row.signals) for name in measures}
    set_entries = [entries.get(mechanism.path_of(name), {"unit": "", "text": ""}) for name in sets]
    figures = [figures for row in rows for figures in row.figures.values()]
    agreed = [item["verdict"] is Verdict.WITHIN for item in figures if "verdict" in item]
    agreed += [item["efficiency_within"] == 1 for item in figures if "efficiency_within" in item]
    drive = {"drive_unit": first.unit, "drive_name": next(iter(mechanism.drivers)) if first.unit != "s" else ""}
    return {
        "comparing": measurement.name,
        **origin(mechanism, first.run.system.plan.formula, **drive),
        "periodic": int(all(row.model.run.cycle.periodic for row in rows)),
        "all_within": int(all(agreed)),
        "method": method.name, "coverage": coverage, "probability": erf(coverage / sqrt(2.0)),
        **cited(dict.fromkeys([GUM, PEZZUTI, *references(mechanism)])),
        **codes("verdict", Verdict),
        "channel_units": [signal.unit for signal in signals.values()],
        "channel_read_in": [signal.read_in for signal in signals.values()],
        "channel_measures": list(measures.values()),
        "set_units": [entry["unit"] for entry in set_entries],
        "set_written": [written_unit(entry["text"], entry["unit"]) for entry in set_entries],
        "findings": finding_rows(_findings(mechanism, list(measures), rows)),
        **of_data(measurement),
        "condition_files": [list(row.condition.files) for row in rows],
        "inputs": inputs(mechanism),
    }  # fmt: skip


def written_unit(source: object, si: str) -> tuple[str, float]:
    """The unit that a number is written in, else one that is usual for its SI unit, and its factor to SI."""
    text = normalise(source).strip().removeprefix("-").strip() if isinstance(source, str) else ""
    literal = LITERAL.fullmatch(text)
    usual = {"rad": "deg", "m": "mm", "1": ""}.get(si, si)
    written = (literal["unit"] or literal["per"] if literal else "") or usual
    try:
        return written, float(unit(written)[0]) if written else 1.0
    except UnitError:
        return "", 1.0


def of_data(measurement: Measurement) -> dict[str, Any]:
    """What a result says of its data: name, size and SHA-256 of every file, the last two where it is at hand; what was
    found while they were read, and what was done to them."""
    rows, findings = [], gathered(measurement.findings)
    for path in dict.fromkeys(Path(name) for condition in measurement.conditions for name in condition.files):
        row: dict[str, Any] = {"file": path.name, "bytes": None, "sha256": ""}
        if path.is_file():
            with path.open("rb") as file:
                row |= {"bytes": path.stat().st_size, "sha256": hashlib.file_digest(file, "sha256").hexdigest()}
        rows.append(row)
    pairs = zip(finding_rows(findings), findings, strict=True)
    found = [{**row, "file": finding.file} for row, finding in pairs]
    return {"data_files": rows, "data_findings": found, "done": list(measurement.done)}


# ---- findings -------------------------------------------------------------------------------------------------


def _findings(mechanism: Mechanism, channels: Sequence[str], rows: Sequence[ConditionComparison]) -> list[Finding]:
    """Errors first: positions without an answer, speeds, channels and efficiencies that do not agree or are unknown."""
    findings = [*dict.fromkeys(finding for row in rows for finding in row.model.run.chosen.findings)]
    findings += other_speed(next(iter(mechanism.drivers), ""), [(row.condition, row.model.speed) for row in rows])
    for code in Status:
        if cases := [row for row in rows if not code.solved and np.any(row.model.status == code)]:
            count, positions = int(np.count_nonzero(cases[0].model.status == code)), len(cases[0].condition.phase)
            values = "".join(f" --set {name}={value:.6g}" for name, value in cases[0].condition.values.items())
            what = f"the model has no solution {_in_which(cases, rows)}, the first at {count:,} of "
            what += f"{counted(positions, 'position')}: {code.text}"
            figures = {"count": count, "positions": positions, "status": code.text}
            findings.append(Finding.error("compare.no_answer", "", what, f"run analyse{values} to see why", **figures))
    for name in channels:  # where a channel is not within U, or cannot be judged
        judged = [(row, row.figures[name]["verdict"]) for row in rows if name in row.signals]
        if cases := [row for row, verdict in judged if verdict in (Verdict.NOT, Verdict.OFFSET)]:
            rms = max(row.figures[name]["rms"] for row in cases)
            within = 100 * min(row.figures[name]["within"] for row in cases)
            signal = cases[0].signals[name]
            (unit, size), turning = signal.shown, signal.unit == "rad/s"  # a speed in the unit of its file
            size_text = joined(number(rms / size, 3), unit) if turning else readable(rms, signal.unit, 3)
            offset = " apart from a constant offset" * (Verdict.NOT not in (verdict for _, verdict in judged))
            what = f"does not agree within U {_in_which(cases, [*judged])}{offset}: at worst {within:.0f} % of the "
            what += f"positions agree, and the RMS of the residual is {size_text}"
            remedy = "see what would explain it; `trunnion identify` fits friction and other numbers of the model"
            figures = {"within_percent": within, "rms": rms}
            findings.append(Finding.error("compare.not_within", f"channels.{name}", what, remedy, **figures))
        if cases := [row for row, verdict in judged if verdict in (Verdict.UNKNOWN, Verdict.NOTHING)]:
            what = f"not compared {_in_which(cases, [*judged])}: no values of two turns, or no solution of the model"
            remedy = "see the gaps reported by `trunnion data`"
            findings.append(Finding.warning("compare.nothing", f"channels.{name}", what, remedy))
    cases = [row for row in rows if "efficiency" in row.figures[""]]
    if off := [row for row in cases if row.figures[""]["efficiency_within"] == 0]:
        most = max(off, key=lambda row: abs(row.figures[""]["efficiency"] - row.figures[""]["efficiency_model"]))
        measured, half, model = (most.figures[""][f"efficiency{key}"] for key in ("", "_expanded", "_model"))
        what = f"does not agree within U {_in_which(off, cases)}; the most in {most.condition.name}: measured "
        what += f"{measured:.4f} ± {half:.2g}, model {model:.4f}"
        remedy = "check the channels; `trunnion identify` fits the friction of the model to them"
        figures = {"measured": measured, "expanded": half, "model": model}
        findings.append(Finding.error("compare.efficiency", "efficiency", what, remedy, **figures))
    for what, remedy in dict.fromkeys(row.doubt for row in rows if row.doubt[0]):
        where = _in_which([row for row in rows if row.doubt == (what, remedy)], rows)
        unknown = f"not known {where}: {what}"
        findings.append(Finding.warning("compare.efficiency_unknown", "efficiency", unknown, remedy))
    stated = {name for row in rows for name, signal in row.signals.items()
              if signal.accuracy.zero or signal.accuracy.gain}  # fmt: skip
    if bare := [name for name in channels if name not in stated]:
        what = f"no accuracy of zero and gain is stated for {', '.join(bare)}: U includes only the scatter between "
        remedy = "state accuracy: {gain: …, zero: …} in the mapping"
        findings.append(Finding.note("compare.no_accuracy", "channels", f"{what}turns", remedy, channels=bare))
    return sorted(findings, key=lambda finding: list(Severity).index(finding.severity))


def _in_which(rows: Sequence[ConditionComparison | Condition], every: Sequence[Any]) -> str:
    """In which of all conditions."""
    names = [(row if isinstance(row, Condition) else row.condition).name for row in rows]
    if len(names) == len(every):
        return "in every condition" if len(names) > 1 else f"in {names[0]}"
    named = "; ".join(names[:MOST_NAMED]) + "; …" * (len(names) > MOST_NAMED)
    return f"in {len(names)} of {counted(len(every), 'condition')} ({named})"


def other_speed(driver: str, rows: Sequence[tuple[Condition, float]]) -> Iterator[Finding]:
    """Of a driver whose speed, rad/s, in the model differs from that of the conditions; an error if by much."""
    if off := [(condition, speed) for condition, speed in rows if apart(condition.speed, speed, SLOWER)]:
        (first, speed), signals = off[0], [signal for condition, _ in rows for signal in condition.courses.values()]
        sensor = next((signal for signal in signals if signal.measures == f"rate:{driver}"), None)
        unit, size = sensor.shown if sensor is not None and sensor.read_in[0] else ("rpm", np.pi / 30)
        what = "the measured speed of the driver differs from that of the model "
        what += f"{_in_which([condition for condition, _ in off], rows)}: {first.speed / size:.4g} {unit} measured, "
        what += f"{speed / size:.4g} {unit} in the model in {first.name}"
        mean = f"{{mean: {sensor.channel if sensor is not None else 'angle'}}}"
        remedy = f"state set: {{{as_key(f'{driver}.speed')}: {mean}}} in the mapping: the model then runs at this speed"
        much = any(apart(condition.speed, model) for condition, model in off)
        figures = {"measured": first.speed, "model": speed, "driver": driver}
        severity = Severity.ERROR if much else Severity.WARNING
        yield Finding.weighed(severity, "compare.speed", f"drivers.{driver}", what, remedy, **figures)
