"""A model beside a measurement: residual and verdict of every channel in every working condition, and the efficiency.

The model is run with the values of each condition and taken at the positions of the measurement. It has no uncertainty
of its own here: what its numbers are uncertain by is not in the verdict.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.findings import model_notes
from trunnion.cycle.summary import PEZZUTI, inputs, references
from trunnion.errors import Finding, MechanismError, Severity, Status, counted
from trunnion.model.arguments import strict_arguments
from trunnion.model.expression import LITERAL
from trunnion.model.mechanism import Mechanism
from trunnion.model.names import as_key, nearest
from trunnion.model.units import UnitError, normalise, unit
from trunnion.results.attributes import cited, codes, finding_rows, origin
from trunnion.results.dataset import Variable, dataset_of, described
from trunnion.results.quantities import readable
from trunnion.rig.judge import Judgement, Verdict, difference, expanded, going_on, judge, probability, uncertainty_of
from trunnion.rig.modelled import Modelled, apart, each, in_condition, modelled
from trunnion.rig.reading.measurement import Condition, Measurement, Signal, efficiency_of, load_joints, pairs_of
from trunnion.rig.reading.timebase import gathered
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import useful_loads, useful_springs

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "CAUSES", "GUM", "VARIABLES", "Cause", "causes", "compare", "data_findings", "hashed_files", "other_speed",
    "written_unit",
]  # fmt: skip

Array = NDArray[np.float64]
GUM = "JCGM 100:2008, Evaluation of measurement data - Guide to the expression of uncertainty in measurement (GUM)"
VAGUE = 0.5  # expanded uncertainty from which an efficiency is none
SIGNIFICANT = 3.5  # standard deviations: of a correlation of turns that is none, in 1 of 4000 channels
SLOWER = 0.01  # of a speed: a difference to speak of
MOST_NAMED = 3  # conditions in one finding

# unit empty: that of each channel, in the attribute `channel_units`; "set": of what is set, in `set_units`; "drive":
# rad, m or s, as `drive_unit` says
CC, C = ("channel", "condition"), ("condition",)
COURSE = (*CC, "position")
EXPLAINED = "share of the mean square of the residual that it explains"
VARIABLES: dict[str, Variable] = {
    "value": Variable(
        ("set", "condition"), "set", "number of the model that was set in the condition; NaN if it was not"
    ),
    "phase": Variable(("condition", "position"), "1", "share of the cycle from its start"),
    "drive": Variable(("condition", "position"), "drive", "coordinate of the first driver, or time"),
    "status": Variable(
        ("condition", "position"), "1", "code of the model's status; see the attribute flag_meanings", np.int8
    ),
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
    "zero_error": Variable(CC, "", "error of the zero that fits the residual best"),
    "zero_explains": Variable(CC, "1", EXPLAINED),
    "gain_error": Variable(CC, "1", "relative error of the gain that fits the residual best"),
    "gain_explains": Variable(CC, "1", EXPLAINED),
    "angle_error": Variable(CC, "rad", "angle by which the readings would be ahead of the model"),
    "angle_explains": Variable(CC, "1", EXPLAINED),
    "friction_error": Variable(CC, "1", "change of all friction, relative to the model's, that fits the residual best"),
    "friction_explains": Variable(CC, "1", EXPLAINED),
    "efficiency": Variable(C, "1", "measured efficiency"),
    "efficiency_expanded": Variable(C, "1", "expanded uncertainty of the measured efficiency"),
    "efficiency_model": Variable(C, "1", "efficiency of the model"),
    "efficiency_within": Variable(
        C, "1", "1 where the model's efficiency is within ±U, −1 where one is unknown", np.int8
    ),
}


# ---- what is compared -----------------------------------------------------------------------------------------


class Cause(NamedTuple):
    """An error by itself: its size, and the share of the mean square of the residual that goes away with it."""

    size: float = np.nan
    share: float = np.nan


CAUSES = ("zero", "gain", "angle", "friction")


def causes(
    residual: Array, model: Array, datum: float = 0.0, drive: Array | None = None, frictionless: Array | None = None
) -> dict[str, Cause]:
    """Fit the shape of each error to a residual by least squares, one coefficient each, to first order.

    Parameters
    ----------
    residual : (position,), measured minus model; NaN where the two are not compared.
    model : (position,), the course of the model.
    datum : value at which the sensor reads 0: from there an error of its gain acts.
    drive : (position,), angle of the driver, rad; None if turns of a driver do not name the positions.
    frictionless : (position,), the model without its friction; None if it has none.

    Returns
    -------
    By kind, of those that change the course: the size of a zero in the unit of the course; of a gain relative; of the
    angle in rad by which the readings are ahead of the model; of friction relative to the model's.
    """
    shapes = {"zero": np.ones_like(model), "gain": model - datum}
    if drive is not None and len(drive) > 1:
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
            explained[kind] = Cause(size, size**2 * square / total)
    return explained


class ChannelComparison(NamedTuple):
    """One channel in one condition. causes: what would explain the residual, by kind; empty where it is within U."""

    signal: Signal
    model: Array
    comparable: NDArray[np.bool_]
    judgement: Judgement
    causes: Mapping[str, Cause]


class EfficiencyComparison(NamedTuple):
    """Efficiency of a condition: measured, its expanded uncertainty, and of the model.

    doubt: why the uncertainty is not known, with what to do about it; both empty if it is.
    """

    measured: float
    expanded: float
    model: float
    doubt: tuple[str, str] = ("", "")

    @property
    def within(self) -> int:
        """1 if the model lies within ±U, 0 if not, −1 where one of the three is unknown."""
        complete = np.isfinite([self.measured, self.expanded, self.model]).all()
        return int(abs(self.measured - self.model) <= self.expanded) if complete else -1


@dataclass(frozen=True, eq=False)
class ConditionComparison:
    """A condition with its model and its channels.

    unmeasured: drivers, useful loads and springs whose power no channel measures, where others do: no efficiency then.
    """

    condition: Condition
    model: Modelled
    channels: Mapping[str, ChannelComparison]
    efficiency: EfficiencyComparison | None
    unmeasured: tuple[str, ...]


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
    measures = _measures(measurement, channels)
    method = friction_method or FrictionMethod()
    rows = each(measurement.conditions, lambda one: _condition(mechanism, one, measures, coverage, method), progress)
    arrays, sets = _arrays(measures, rows, coverage)
    labels = {"channel": list(measures), "condition": [row.condition.name for row in rows], "set": sets}
    attributes = _attributes(mechanism, measurement, measures, rows, coverage, method)
    return dataset_of("comparison", described(arrays, VARIABLES), labels, attributes)


def _measures(measurement: Measurement, channels: Sequence[str] | None) -> dict[str, str]:
    """What each channel measures, by name; MechanismError if there is none, or not one that is asked for."""
    every: dict[str, str] = {}
    for name, signal in (
        (name, one) for condition in measurement.conditions for name, one in condition.courses.items()
    ):
        if signal.measures:
            every.setdefault(name, signal.measures)
    if missing := [name for name in channels or () if name not in every]:
        raise MechanismError(
            [Finding(f"there is no channel '{name}'", "--channel", nearest(name, every)) for name in missing]
        )
    if not every:
        what = "no channel measures anything of the model" if measurement.conditions else "there is no condition in it"
        remedy = "state measures: effort:DRIVER of a channel in the mapping"
        raise MechanismError(Finding(what, measurement.name, remedy))
    return every if channels is None else {name: every[name] for name in dict.fromkeys(channels)}


def _condition(
    mechanism: Mechanism, condition: Condition, measures: Mapping[str, str], coverage: float, method: FrictionMethod
) -> ConditionComparison:
    measured = {name: what for name, what in measures.items() if name in condition.courses}
    joints = load_joints(mechanism)
    powers = pairs_of(condition, joints)
    pairs = (*powers.driven, *powers.loaded) if powers else ()
    of_powers = {signal.channel: signal.measures for pair in pairs for signal in pair}
    model = modelled(mechanism, condition, measured, method, of_powers)
    without_friction = cache(lambda: _frictionless(mechanism, condition, measured, method))
    channels = {}
    for name in measured:
        signal = replace(condition.courses[name], local=model.left_open.get(name, 0.0))
        course, comparable = model.courses[name], model.comparable(name)
        judgement, explained = judge(signal, course, comparable, coverage), {}
        if judgement.verdict in (Verdict.NOT, Verdict.OFFSET):
            residual = np.where(comparable, difference(signal.mean, course), np.nan)
            drive = model.drive if model.unit == "rad" else None
            free = None if model.measures[name].of_motion else without_friction().get(name)
            explained = causes(residual, course, signal.accuracy.datum, drive, free)
        channels[name] = ChannelComparison(signal, course, comparable, judgement, explained)
    unmeasured = _unmeasured(mechanism, condition) if powers else ()
    comparable_powers = powers is not None and not unmeasured and of_powers.keys() <= model.courses.keys()
    efficiency = _efficiency(condition, model, joints, coverage) if comparable_powers else None
    return ConditionComparison(condition, model, channels, efficiency, unmeasured)


def _frictionless(
    mechanism: Mechanism, condition: Condition, channels: Mapping[str, str], method: FrictionMethod
) -> Mapping[str, Array]:
    """Courses of the model without its friction; none where it has no friction, or has no answer without it."""
    stated = in_condition(mechanism, condition)
    try:
        free = stated.with_friction("off")
        if free.data() == stated.data():
            return {}
        return modelled(free, replace(condition, values={}, units={}), channels, method).courses
    except MechanismError:
        return {}


def _unmeasured(mechanism: Mechanism, condition: Condition) -> tuple[str, ...]:
    """Drivers, useful loads and springs whose effort no channel measures, by their entries in the model."""
    measured = {signal.measures for signal in condition.courses.values()}
    drivers = (f"drivers.{name}" for name in mechanism.drivers if f"effort:{name}" not in measured)
    loads = (f"loads.{name}" for name in useful_loads(mechanism) if f"load:{name}" not in measured)
    return (*drivers, *loads, *(f"springs.{name}" for name in useful_springs(mechanism)))


def _efficiency(
    condition: Condition, model: Modelled, joints: Mapping[str, str], coverage: float
) -> EfficiencyComparison:
    """Efficiency as a rig computes it: of the measured courses, and of the model's in their place."""
    solved, theirs = model.status < Status.NOT_CONVERGED, float("nan")
    courses = {  # a load has no torque where its joint rests, and takes no power
        name: replace(condition.courses[name], turns=np.where(solved, np.nan_to_num(course), course)[np.newaxis])
        for name, course in model.courses.items()
    }
    with suppress(MechanismError):  # it has no answer at some position
        # its positions are equal steps of time, whatever those of the measurement are
        theirs = efficiency_of(replace(condition, courses=courses, speed=np.nan), joints).value
    try:
        measured = efficiency_of(condition, joints)
    except MechanismError as error:  # no turn is whole, or no power goes in
        return EfficiencyComparison(np.nan, np.nan, theirs, (error.findings[0].what, error.findings[0].remedy))
    wrong = "a sign, a gain, a unit or a column of its channels is wrong"
    half, doubt = measured.factor(coverage) * measured.uncertainty, ("", "")
    if measured.turns < 2:
        doubt = "there is only one turn: the uncertainty cannot be estimated without scatter", "measure more turns"
    elif half > VAGUE:
        doubt = f"its U of {half:.3g} is not meaningful: {wrong}", "check their means"
    elif measured.value > 1 + half:
        doubt = f"{measured.value:.4g} is above 1: {wrong}", "check their means"
    return EfficiencyComparison(measured.value, np.nan if doubt[0] else half, theirs, doubt)


# ---- the result -----------------------------------------------------------------------------------------------


def _arrays(
    measures: Mapping[str, str], rows: Sequence[ConditionComparison], coverage: float
) -> tuple[dict[str, NDArray[Any]], list[str]]:
    """All variables, and the names of what is set."""
    sets = list(dict.fromkeys(name for row in rows for name in row.condition.values))
    positions = max(len(row.condition.phase) for row in rows)
    sizes = {"set": len(sets), "condition": len(rows), "channel": len(measures), "position": positions}
    arrays: dict[str, NDArray[Any]] = {name: variable.blank(sizes) for name, variable in VARIABLES.items()}
    arrays["verdict"][:], arrays["efficiency_within"][:] = Verdict.NOTHING, -1
    arrays["status"][:] = Status.NOT_ASSEMBLED  # of positions that a condition with fewer does not have
    for k, row in enumerate(rows):
        arrays["value"][:, k] = [row.condition.values.get(name, np.nan) for name in sets]
        for name, course in (("phase", row.condition.phase), ("drive", row.model.drive), ("status", row.model.status)):
            arrays[name][k, : len(course)] = course
        for i, name in enumerate(measures):
            if name in row.channels:
                for key, number in _numbers(row.channels[name], row.model.drive, coverage):
                    at = (i, k, slice(0, len(row.condition.phase)))
                    arrays[key][at[: arrays[key].ndim]] = number
        if (efficiency := row.efficiency) is not None:
            arrays["efficiency"][k], arrays["efficiency_expanded"][k] = efficiency.measured, efficiency.expanded
            arrays["efficiency_model"][k], arrays["efficiency_within"][k] = efficiency.model, efficiency.within
    if all(row.efficiency is None for row in rows):
        arrays = {name: array for name, array in arrays.items() if not name.startswith("efficiency")}
    return arrays, sets


def _numbers(channel: ChannelComparison, drive: Array, coverage: float) -> Iterator[tuple[str, Any]]:
    """The numbers of one channel in one condition, by variable."""
    signal, model, judgement, of = channel.signal, channel.model, channel.judgement, uncertainty_of(channel.signal)
    yield from {
        "measured": signal.mean, "scatter": signal.scatter, "uncertainty": of.total,
        "expanded": expanded(of.total, of.freedom, coverage), "model": model,
        "residual": difference(signal.mean, model),
        "compared": channel.comparable & np.isfinite(signal.mean) & np.isfinite(model),
        "turns": len(signal.turns), "accuracy_zero": signal.accuracy.zero, "accuracy_gain": signal.accuracy.gain,
        "within_least": judgement.least,
        "largest_at": drive[judgement.place] if judgement.place >= 0 else np.nan,
    }.items()  # fmt: skip
    for name, figure in vars(judgement).items():
        if name in VARIABLES:
            yield name, figure
    for kind, cause in channel.causes.items():
        yield f"{kind}_error", cause.size
        yield f"{kind}_explains", cause.share


def _attributes(
    mechanism: Mechanism,
    measurement: Measurement,
    measures: Mapping[str, str],
    rows: Sequence[ConditionComparison],
    coverage: float,
    method: FrictionMethod,
) -> dict[str, Any]:
    first = rows[0].model
    signals = {name: next(row.channels[name].signal for row in rows if name in row.channels) for name in measures}
    entries = {row["path"]: row for row in inputs(mechanism)}
    names = dict.fromkeys(name for row in rows for name in row.condition.values)
    sets = [entries.get(mechanism.path_of(name), {"unit": "", "text": ""}) for name in names]
    efficiencies = [row.efficiency.within for row in rows if row.efficiency is not None]
    verdicts = [channel.judgement.verdict for row in rows for channel in row.channels.values()]
    return {
        "comparing": measurement.name,
        **origin(
            mechanism,
            first.run.system.plan.formula,
            drive_unit=first.unit,
            drive_name=next(iter(mechanism.drivers), "") if first.unit != "s" else "",
            drive_span=first.span,
            periodic=int(all(row.model.run.cycle.periodic for row in rows)),
            all_within=int(all(one == Verdict.WITHIN for one in verdicts) and all(one == 1 for one in efficiencies)),
            coverage=coverage,
            probability=probability(coverage),
        ),
        "method": method.name,
        **cited(dict.fromkeys([GUM, PEZZUTI, *references(mechanism)])),
        **codes("verdict", Verdict),
        "channel_units": [signal.unit for signal in signals.values()],
        "channel_read_in": [signal.read_in for signal in signals.values()],
        "channel_measures": list(measures.values()),
        "set_units": [one["unit"] for one in sets],
        "set_written": [written_unit(one["text"], one["unit"]) for one in sets],
        "findings": finding_rows(_findings(mechanism, measures, rows)),
        "data_findings": data_findings(measurement),
        "done": list(measurement.done),
        "files": hashed_files(row.condition for row in rows),
        "condition_files": [list(row.condition.files) for row in rows],
        "inputs": inputs(mechanism),
    }


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


def data_findings(measurement: Measurement) -> list[dict[str, Any]]:
    """What was found while the data were read, with the file."""
    findings = gathered(measurement.findings)
    return [{**row, "file": one.file} for row, one in zip(finding_rows(findings), findings, strict=True)]


def hashed_files(conditions: Iterable[Condition]) -> list[dict[str, Any]]:
    """Name, size and SHA-256 of every file of the data; without the last two where it is not at hand."""
    rows = []
    for name in dict.fromkeys(name for condition in conditions for name in condition.files):
        path = Path(name)
        row: dict[str, Any] = {"file": path.name, "bytes": None, "sha256": ""}
        if path.is_file():
            with path.open("rb") as file:
                row |= {"bytes": path.stat().st_size, "sha256": hashlib.file_digest(file, "sha256").hexdigest()}
        rows.append(row)
    return rows


# ---- findings -------------------------------------------------------------------------------------------------


def _findings(mechanism: Mechanism, channels: Iterable[str], rows: Sequence[ConditionComparison]) -> list[Finding]:
    """Errors first."""
    names = list(channels)
    findings = [
        *_no_answer(rows),
        *other_speed(next(iter(mechanism.drivers), ""), [(row.condition, row.model.speed) for row in rows]),
        *(finding for name in names for finding in _of_channel(name, rows)),
        *_of_efficiency(rows),
        *_of_model(rows),
    ]
    accuracies = [(name, one.signal.accuracy) for row in rows for name, one in row.channels.items()]
    stated = {name for name, accuracy in accuracies if accuracy.zero or accuracy.gain}
    if bare := [name for name in names if name not in stated]:
        what = f"no accuracy of zero and gain is stated for {', '.join(bare)}: U includes only the scatter between "
        remedy = "state accuracy: {gain: …, zero: …} in the mapping"
        findings.append(Finding.note("compare.no_accuracy", "channels", f"{what}turns", remedy, channels=bare))
    return sorted(findings, key=lambda finding: list(Severity).index(finding.severity))


def _in_which(conditions: Sequence[Condition], count: int) -> str:
    """In which of so many conditions."""
    if len(conditions) == count:
        return "in every condition" if count > 1 else f"in {conditions[0].name}"
    names = "; ".join(one.name for one in conditions[:MOST_NAMED]) + "; …" * (len(conditions) > MOST_NAMED)
    return f"in {len(conditions)} of {counted(count, 'condition')} ({names})"


def _of_channel(name: str, rows: Sequence[ConditionComparison]) -> Iterator[Finding]:
    """Where a channel is not within U, cannot be judged, or has turns that resemble each other."""
    cases = [(row.condition, row.channels[name]) for row in rows if name in row.channels]
    where = f"channels.{name}"

    def of(*verdicts: Verdict) -> tuple[list[ChannelComparison], str]:
        chosen = [(condition, one) for condition, one in cases if one.judgement.verdict in verdicts]
        return [one for _, one in chosen], _in_which([one for one, _ in chosen], len(cases)) if chosen else ""

    off, in_which = of(Verdict.NOT, Verdict.OFFSET)
    if off:
        rms, within = max(one.judgement.rms for one in off), min(one.judgement.within for one in off)
        unit, size = off[0].signal.shown
        rms_text = f"{rms / size:.3g} {unit}" if unit not in ("rad", "1") else readable(rms, unit, 3)
        offset = " apart from a constant offset" * all(one.judgement.verdict is Verdict.OFFSET for one in off)
        down, up = ("down to ", "up to ") if len(off) > 1 else ("", "")
        what = f"does not agree within U {in_which}{offset}: {down}{100 * within:.0f} % of the positions agree, RMS of "
        what += f"the residual {up}{rms_text}"
        remedy = "see what would explain it; `trunnion identify` fits friction and other numbers of the model"
        yield Finding.error("compare.not_within", where, what, remedy, within_percent=100 * within, rms=rms)
    unknown, in_which = of(Verdict.UNKNOWN)
    if unknown:
        turns = max(len(one.signal.turns) for one in unknown)
        what = f"has no position with values from two turns, of {counted(turns, 'turn')}: its uncertainty cannot be "
        what += f"estimated without scatter, {in_which}"
        remedy = "measure more turns, or see the gaps reported by `trunnion data`"
        yield Finding.warning("compare.turns_few", where, what, remedy, turns=turns)
    nothing, in_which = of(Verdict.NOTHING)
    if nothing:
        what = f"not compared, for lack of measured values or of a solution of the model, {in_which}"
        yield Finding.warning("compare.nothing", where, what)
    correlations = [going_on(one.signal) for _, one in cases]
    count = sum(turns for _, turns in correlations)
    mean = sum(value * turns for value, turns in correlations if turns) / max(count, 1)
    if mean * math.sqrt(count) > SIGNIFICANT:
        what = f"the errors of successive turns are correlated, {mean:+.2f}: U assumes independent turns"
        remedy = "measure many more turns, or turns further apart; state the drift of the zero in accuracy:"
        yield Finding.warning("compare.turns_alike", where, what, remedy, correlation=mean)


def _of_efficiency(rows: Sequence[ConditionComparison]) -> Iterator[Finding]:
    """Where the efficiencies do not agree, and where there is none."""
    cases = [(row.condition, row.efficiency) for row in rows if row.efficiency is not None]
    if off := [(condition, one) for condition, one in cases if one.within == 0]:
        worst, most = max(off, key=lambda case: abs(case[1].measured - case[1].model))
        where = _in_which([condition for condition, _ in off], len(cases))
        where += f"; the most in {worst.name}" if len(off) > 1 else ""
        what = f"does not agree within U {where}: measured {most.measured:.4f} ± {most.expanded:.2g}, "
        remedy = "check the channels; `trunnion identify` fits the friction of the model to them"
        figures = {"measured": most.measured, "expanded": most.expanded, "model": most.model}
        yield Finding.error("compare.efficiency", "efficiency", f"{what}model {most.model:.4f}", remedy, **figures)
    for missing in dict.fromkeys(row.unmeasured for row in rows if row.unmeasured):
        where = _in_which([row.condition for row in rows if row.unmeasured == missing], len(rows))
        what = f"not compared {where}: the power of {', '.join(missing)} is not measured"
        remedy = "measure effort: of every driver and load: of every useful load, each with its rate:"
        yield Finding.warning("compare.efficiency_unmeasured", "efficiency", what, remedy, missing=list(missing))
    for what, remedy in dict.fromkeys(one.doubt for _, one in cases if one.doubt[0]):
        where = _in_which([condition for condition, one in cases if one.doubt == (what, remedy)], len(cases))
        yield Finding.warning("compare.efficiency_unknown", "efficiency", f"not known {where}: {what}", remedy)


def other_speed(driver: str, rows: Sequence[tuple[Condition, float]]) -> Iterator[Finding]:
    """Of a driver whose speed, rad/s, in the model differs from that of the conditions; an error if by much."""
    off = [(condition, speed) for condition, speed in rows if apart(condition.speed, speed, SLOWER)]
    if not off:
        return
    sensor = {signal.measures: signal for one, _ in rows for signal in one.courses.values()}.get(f"rate:{driver}")
    unit, size = sensor.shown if sensor is not None and sensor.read_in[0] else ("rpm", np.pi / 30)
    first, speed = off[0]
    where = _in_which([one for one, _ in off], len(rows))
    what = f"the measured speed of the driver differs from that of the model {where}: "
    what += f"{first.speed / size:.4g} {unit} measured, {speed / size:.4g} {unit} in the model in {first.name}"
    mean = f"{{mean: {sensor.channel if sensor is not None else 'angle'}}}"
    remedy = f"state set: {{{as_key(f'{driver}.speed')}: {mean}}} in the mapping: the model then runs at this speed"
    severity = Severity.ERROR if any(apart(one.speed, model) for one, model in off) else Severity.WARNING
    figures = {"measured": first.speed, "model": speed, "driver": driver}
    yield Finding.weighed(severity, "compare.speed", f"drivers.{driver}", what, remedy, **figures)


def _no_answer(rows: Sequence[ConditionComparison]) -> Iterator[Finding]:
    """An error for every status that leaves positions of the model without numbers."""
    for code in Status:
        cases = [row for row in rows if not code.solved and np.any(row.model.status == code)]
        if not cases:
            continue
        first = cases[0]
        count, positions = int(np.count_nonzero(first.model.status == code)), len(first.condition.phase)
        values = "".join(f" --set {name}={value:.6g}" for name, value in first.condition.values.items())
        what = f"the model has no solution {_in_which([row.condition for row in cases], len(rows))}, the first at "
        what += f"{count:,} of {counted(positions, 'position')}: {code.text}"
        remedy = f"run analyse{values} to see where in the cycle, and why"
        figures = {"count": count, "positions": positions, "status": code.text}
        yield Finding.error("compare.no_answer", "", what, remedy, **figures)


def _of_model(rows: Sequence[ConditionComparison]) -> Iterator[Finding]:
    """What every analysis of this model says, and warnings of single conditions."""
    alike: dict[tuple[str, str], list[Finding]] = {}
    for row in rows:
        run = row.model.run
        left_open = run.determinacy.findings() if run.determinacy is not None else []
        for finding in (*model_notes(run.system.mechanism, run.system), *run.chosen.findings, *left_open):
            alike.setdefault((finding.where, finding.what), []).append(finding)
    for findings in alike.values():
        if len(findings) == len(rows) or findings[0].severity is not Severity.NOTE:
            yield findings[0]
