"""The Dataset of `tolerance`: names, units, summary and provenance; its measures and courses in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.scales import scales_of
from trunnion.cycle.summary import provenance
from trunnion.errors import Finding, Status
from trunnion.measures.measures import Measure
from trunnion.results.dataset import MemberUnits, Variable, dataset_of, described, driven
from trunnion.solve.system import System
from trunnion.statistics import intervals
from trunnion.statistics.intervals import moments_of
from trunnion.studies.tolerance.effects import Spread
from trunnion.studies.tolerance.findings import Outcome, findings_of, summary
from trunnion.studies.tolerance.linear import Table, ToleranceStudy
from trunnion.studies.tolerance.sampling import Samples

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Interval = tuple[Any, Any]
QUANTILES = (0.00135, 0.005, 0.025, 0.05, 0.25, 0.5, 0.75, 0.95, 0.975, 0.995, 0.99865)
CAUSES = len(Status) + 1  # by status; the last: a figure that does not exist, such as a dead centre out of range
FEWEST = 4.0  # points of a replicate expected beyond a quantile, from which its interval is given
BINS = 240
CORE, FAR = 0.005, 1.5  # share of the samples at either end, and widths of the others, beyond which bins do not reach
LEAST = 1e-9, 1e-12  # width of the bins of a figure that does not scatter: of the figure, and SI
SIZES = 12  # at which it is shown how figures converge
# units: "measure": that of each figure; "curve": of each course; "parameter": of each parameter; "ratio" and "curve
# ratio": the former over the latter; "drive": deg, mm or s, as `drive_unit` says
M, P, MP, MPOS = ("measure",), ("parameter",), ("measure", "parameter"), ("measure", "position")


def _interval(name: str, dims: tuple[str, ...], unit: str, what: str) -> dict[str, Variable]:
    """The ends of a 95 % interval."""
    ends = {"low": "lower", "high": "upper"}
    return {
        f"{name}_{end}": Variable(dims, unit, f"{what}, {word} end of the 95 % interval") for end, word in ends.items()
    }


VARIABLES: dict[str, Variable] = {
    "nominal": Variable(M, "measure", "figure of the nominal mechanism"),
    "place": Variable(M, "drive", "drive coordinate of the measure; for an extreme, the nominal one"),
    "parameter_nominal": Variable(P, "parameter", "nominal value; of a clearance its radius"),
    "parameter_lower": Variable(P, "parameter", "lower limit of the deviation from nominal"),
    "parameter_upper": Variable(P, "parameter", "upper limit of the deviation from nominal"),
    "parameter_deviation": Variable(P, "parameter", "standard deviation; of a clearance, of an offset along one axis"),
    "parameter_shift": Variable(P, "parameter", "mean deviation from nominal"),
    "sensitivity": Variable(MP, "ratio", "derivative of the figure; of a clearance, by its radius in the worst case"),
    "contribution_worst_case": Variable(
        MP, "measure", "largest change of the figure by the parameter alone, to first order"
    ),
    "contribution_rss": Variable(MP, "1", "share of the parameter in the square of the RSS half width"),
    "contribution_variance": Variable(
        MP, "1", "share of the parameter in the variance, to first order: its covariance with the figure, signed"
    ),
    "worst_case_lower": Variable(M, "measure", "least deviation of the figure, to first order"),
    "worst_case_upper": Variable(M, "measure", "largest deviation of the figure, to first order"),
    "rss": Variable(M, "measure", "half width by the root of the sum of squares; without correlation"),
    "deviation_linear": Variable(M, "measure", "standard deviation, to first order"),
    "shift_linear": Variable(M, "measure", "mean deviation from nominal, to first order"),
    "searched_lower": Variable(M, "measure", "least deviation found on the mechanism itself"),
    "searched_upper": Variable(M, "measure", "largest deviation found on the mechanism itself"),
    "corner_lower": Variable(MP, "parameter", "value of the parameter at the least deviation"),
    "corner_upper": Variable(MP, "parameter", "value of the parameter at the largest deviation"),
    "curve": Variable(MPOS, "curve", "curve of the measure of the nominal mechanism"),
    "curve_sensitivity": Variable(("measure", "parameter", "position"), "curve ratio", "derivative of the curve"),
    "curve_worst_case_lower": Variable(MPOS, "curve", "least deviation of the curve, to first order"),
    "curve_worst_case_upper": Variable(MPOS, "curve", "largest deviation of the curve, to first order"),
    "curve_rss": Variable(
        MPOS, "curve", "half width of the curve by the root of the sum of squares; without correlation"
    ),
    "curve_shift": Variable(MPOS, "curve", "mean deviation of the curve from nominal, to first order"),
    "curve_deviation": Variable(MPOS, "curve", "standard deviation of the curve, to first order"),
    "status": Variable(("position",), "1", "code of the position's status; see the attribute flag_meanings"),
    "samples": Variable((), "1", "number of samples"),
    "mean": Variable(M, "measure", "mean of the figure"),
    **_interval("mean", M, "measure", "mean"),
    "deviation": Variable(M, "measure", "standard deviation of the figure"),
    **_interval("deviation", M, "measure", "standard deviation"),
    "skewness": Variable(M, "1", "skewness of the figure"),
    "kurtosis": Variable(M, "1", "kurtosis of the figure, 3 of a normal distribution"),
    "least": Variable(M, "measure", "least figure"),
    "most": Variable(M, "measure", "largest figure"),
    "quantile_value": Variable(("measure", "quantile"), "measure", "figure that this share does not exceed"),
    **_interval("quantile", ("measure", "quantile"), "measure", "quantile"),
    "yield": Variable(
        M, "1", "share of the samples within the limits of the measure, or with an answer if it has none"
    ),
    **_interval("yield", M, "1", "yield"),
    "yield_all": Variable((), "1", "share of the samples within all limits"),
    **_interval("yield_all", (), "1", "yield of all"),
    "cp": Variable(M, "1", "capability index C_p of the figure"),
    "cpk": Variable(M, "1", "capability index C_pk of the figure"),
    "failed": Variable(("cause",), "1", "samples not solved, by the gravest status of their positions"),
    "histogram": Variable(("measure", "bin"), "1", "samples in a bin"),
    "edge": Variable(("measure", "edge"), "measure", "edges of the bins; those at the ends stand for all beyond"),
    "band": Variable(
        ("measure", "quantile", "position"),
        "curve",
        "quantile of the deviation of the curve from nominal",
    ),
    "convergence_samples": Variable(("size",), "1", "first so many samples"),
    "convergence_mean": Variable(("measure", "size"), "measure", "mean of the first samples"),
    "convergence_deviation": Variable(("measure", "size"), "measure", "standard deviation of the first samples"),
    "convergence_yield": Variable(("measure", "size"), "1", "yield of the first samples"),
    "first_order": Variable(MP, "1", "Sobol' index of first order: share of the variance by the parameter alone"),
    **_interval("first_order", MP, "1", "first order"),
    "total_order": Variable(MP, "1", "Sobol' index of total order: share with all its interactions"),
    **_interval("total_order", MP, "1", "total order"),
}


def dataset(outcome: Outcome, notes: Sequence[Finding]) -> xr.Dataset:
    """The numbers of all methods with all that is said of them."""
    study, table = outcome.study, outcome.table
    system = study.run.system
    counted = sampled(outcome.samples, study, table) if outcome.samples else None
    job = outcome.samples.job if outcome.samples else None
    arrays = {**_linear(study, table), **_worst(outcome), **(counted or {})}
    arrays |= outcome.indices.arrays if outcome.indices else {}
    units = [measure.figure_unit(system, study.run.values) for measure in study.measures]
    curve_units = [measure.unit(system) for measure in study.measures]
    kinds = system.mechanism.parameter_kinds()
    parameter_units = [kinds[name].unit if name in kinds else "m" for name in study.inputs.names]
    dial = system.dial(study.run.values, table.plan.times)
    variables = described(arrays, VARIABLES, _units(units, curve_units, parameter_units, dial.unit))
    used = {dim for each in variables.values() for dim in each.dims}
    labels = {
        "measure": [measure.name for measure in study.measures],
        "parameter": study.inputs.names,
        "cause": [*(code.text for code in Status), "the figure does not exist"],
    }
    labels = {dim: names for dim, names in labels.items() if dim in used}
    quantiles = {"quantile": ("quantile", np.array(QUANTILES))} if "quantile" in used else {}
    attributes: dict[str, Any] = {
        **provenance(system, [*findings_of(outcome, counted), *notes]),
        "methods": outcome.methods,
        "sampling": job.method if job else "",
        "engine": job.engine if job else "numpy",
        "seed": job.seed if job else -1,
        "measure_texts": [text_of(measure, system) for measure in study.measures],
        "measure_rules": [measure.rule for measure in study.measures],
        "curve_texts": [course_text(measure, system) for measure in study.measures],
        "limits": [
            None if (measure.lower, measure.upper) == (None, None) else [measure.lower, measure.upper]
            for measure in study.measures
        ],
        "bounds": [[measure.at_least, measure.at_most] for measure in study.measures],
        "distributions": [
            *(each.distribution for each in study.inputs.tolerances),
            *("play" for _ in study.inputs.loose),
        ],
        "correlated": int(study.effects.correlated),
        "drive": dial.of,
        "drive_unit": dial.unit.strip(),
        "periodic": int(study.run.cycle.periodic),
        "steps": outcome.steps,
        **scales_of(study.run).summary(summary(outcome, counted, units, dial)),
    }
    return dataset_of("tolerance", variables, labels, attributes, {**quantiles, **driven(table.plan.times, *dial)})


def _units(
    figures: Sequence[str], courses: Sequence[str], parameters: Sequence[str], drive: str
) -> dict[str, str | MemberUnits]:
    """The units that `Variable` names by a word; of a ratio "N m/m", "(N m or rad)/(m)" where several units meet."""
    figure, curve = MemberUnits("measure", figures), MemberUnits("measure", courses)
    parameter = MemberUnits("parameter", parameters)

    def over(unit: MemberUnits) -> str:
        several = len({*unit.each}) > 1 or len({*parameter.each}) > 1
        return f"({unit.text})/({parameter.text})" if several else f"{unit.text}/{parameter.text}"

    return {
        "measure": figure, "curve": curve, "parameter": parameter, "ratio": over(figure), "curve ratio": over(curve),
        "drive": drive.strip().replace("°", "deg"),
    }  # fmt: skip


def _linear(study: ToleranceStudy, table: Table) -> dict[str, Any]:
    """What first order says."""
    rows, run = study.orders, study.run
    # drive coordinates at which figures are taken; NaN of those of no single position
    placed = [np.isfinite(of.time) and run.cycle.duration > 0 for of in rows]
    times = np.array([of.time % run.cycle.duration if run.cycle.periodic else of.time for of in rows])
    places = [run.system.dial(run.values, times[[k]]).values[0] if at else np.nan for k, at in enumerate(placed)]
    total = Spread(*np.array([of.total for of in rows], float).reshape(-1, 5).T)
    halves = np.array([of.figure.spread.half for of in rows])
    scatter = np.array([of.figure.covariances for of in rows])
    shares = halves**2 / np.sum(halves**2, axis=1, keepdims=True)
    variance = scatter / np.sum(scatter, axis=1, keepdims=True)
    return {
        "nominal": np.array([of.nominal for of in rows]),
        "place": np.array(places, float),
        **{f"parameter_{key}": array for key, array in study.effects.numbers().items()},
        "sensitivity": np.array([of.figure.sensitivity for of in rows]),
        "contribution_worst_case": np.array([(of.worst if of.by_place else of.figure).spread.worst for of in rows]),
        "contribution_rss": shares,
        "contribution_variance": variance,
        "worst_case_lower": total.lower, "worst_case_upper": total.upper, "rss": total.half,
        "shift_linear": total.shift, "deviation_linear": total.deviation,
        "curve": table.spread(table.curves),
        "curve_sensitivity": table.spread([course.sensitivity for course in table.courses]),
        **{f"curve_{name}": table.spread([getattr(course.total, part) for course in courses])
           for courses, parts in (
               (table.worst, {"worst_case_lower": "lower", "worst_case_upper": "upper"}),
               (table.courses, {"rss": "half", "shift": "shift", "deviation": "deviation"}),
           ) for name, part in parts.items()},
        "status": table.status,
    }  # fmt: skip


def _worst(outcome: Outcome) -> dict[str, Any]:
    """What the search of the worst case came to."""
    values: dict[str, Any] = {}
    names, radii = outcome.study.inputs.names, outcome.study.effects.numbers()["nominal"]
    for key, corners in zip(("lower", "upper"), zip(*(outcome.worst or ()), strict=True), strict=False):
        values[f"searched_{key}"] = np.array([corner.value for corner in corners])
        at = [[corner.at.get(name, radii[i]) for i, name in enumerate(names)] for corner in corners]
        values[f"corner_{key}"] = np.array(at)
    return values


def text_of(measure: Measure, system: System) -> str:
    """What a measure is: "coordinate of point ram.Q, y at 270° of O"."""
    kind = measure.of.long_name.replace(" a ", " ")
    alone = measure.subject in ("mechanism", "cycle", "instant")
    subject = f" ({measure.subject})" if alone else f" {measure.subject}"
    axis = f", {measure.axis}" if measure.axis else ""
    rule = {
        "deviation": ", largest deviation from nominal", "value": "", "line": "", "ratio": "", "work": "",
        "dead centre": "", "dead centre, least": " (least)",
    }.get(measure.rule, f", {measure.rule.replace('-', ' ')}")  # fmt: skip
    usual = measure.of.rule == measure.rule and measure.rule != "deviation"
    return f"{kind}{subject}{axis}{'' if usual else rule}{_where(measure, system)}"


def course_text(measure: Measure, system: System) -> str:
    """What the course is, position by position: "slide of S", also of the stroke and of the dead centre of S."""
    about, along = (f" {word} {measure.axis}" if measure.axis else "" for word in ("about", "along"))
    kind = measure.coordinate(system).kind
    return {
        "point": f"{measure.axis} of {measure.subject}",
        "path_error": f"distance of {measure.subject} from its nominal place",
        "straightness": f"distance of {measure.subject} from the line through its path",
        "angle": f"angle of {measure.subject}{about}",
        "reaction": f"reaction in {measure.subject}{along}",
        "efficiency": "efficiency of the instant",
        "locking_margin": "locking margin",
    }.get(measure.kind, f"{kind} of {measure.subject}")


def _where(measure: Measure, system: System) -> str:
    """The place at which, or the range over which, a measure is taken; empty if it is the whole cycle.

    A coordinate of the first driver, or a time, in the unit in which places are told.
    """
    first = "" if measure.timed else next(iter(system.mechanism.drivers), "")

    def at(place: float) -> str:
        if not first:
            return f"{place:.6g} s".replace("-", "−")
        turns = system.turns(first)
        return f"{math.degrees(place) if turns else 1e3 * place:.6g}{'°' if turns else ' mm'}".replace("-", "−")

    of = f" of {first}" if first else ""
    if measure.at is not None:
        return f" at {at(measure.at)}{of}"
    return f" over {at(measure.over[0])} to {at(measure.over[1])}{of}" if measure.over is not None else ""


# ---- what samples say ----------------------------------------------------------------------------------------------


def sampled(samples: Samples, study: ToleranceStudy, table: Table) -> dict[str, Any]:
    """All figures of the samples: arrays by the names of `result.VARIABLES`."""
    job, figure, passed = samples.job, samples.figure, samples.passed
    count, done = figure.shape
    everything = np.concatenate([passed, np.all(passed, axis=0)[None]])
    moments = moments_of(figure)
    ordered = [np.sort(row[~np.isnan(row)]) for row in figure]
    replicates = (job.replicates, -1)
    each = [moments_of(part) for part in np.moveaxis(figure.reshape(count, *replicates), 1, 0)]
    yields = np.mean(everything, axis=1)
    if job.replicates > 1:
        number, mean, deviation, *_ = np.moveaxis(np.array(each), 1, 0)
        # by n: the mean of the points of a replicate is all but true and uses none up
        deviation = deviation * np.sqrt(np.maximum(number - 1, 0) / np.maximum(number, 1))
        ends = {
            "mean": intervals.by_replicates(mean, axis=0),
            "deviation": intervals.by_replicates(deviation, axis=0),
        }
        right = np.sum(everything.reshape(count + 1, *replicates), axis=2)
        # turned to where a measure changes most, a replicate's count is all but one of two numbers: on the safe side
        ends["yield"] = intervals.share_by_replicates(right, done // job.replicates, axis=1, least=0.25)
    else:
        ends = {
            "mean": intervals.of_mean(moments.mean, moments.deviation, moments.number),
            "deviation": intervals.of_deviation(moments.deviation, moments.kurtosis, moments.number),
            "yield": intervals.share(np.sum(everything, axis=1), done),
        }
    ends["quantile"] = _quantile_ends(ordered, figure.reshape(count, *replicates))
    histogram, edge = _histogram(ordered)
    gravest = samples.status[np.any(np.isnan(figure), axis=0)]
    between = [limits_of(measure, order.nominal) for measure, order in zip(job.measures, study.orders, strict=True)]
    capability = [  # of a largest |deviation|, towards the limits' smaller side
        intervals.capability(*ends_of, *pair) if np.any(np.isfinite(ends_of)) else (np.nan, np.nan)
        for ends_of, *pair in zip(between, moments.mean, moments.deviation, strict=True)
    ]
    arrays: dict[str, Any] = {
        "samples": np.array(done),
        "mean": moments.mean,
        "deviation": moments.deviation,
        "skewness": moments.skewness,
        "kurtosis": moments.kurtosis,
        "least": np.array([row[0] if row.size else np.nan for row in ordered]),
        "most": np.array([row[-1] if row.size else np.nan for row in ordered]),
        "failed": np.bincount(np.where(gravest >= Status.NOT_CONVERGED, gravest, CAUSES - 1), minlength=CAUSES),
        "histogram": histogram,
        "edge": edge,
        "quantile_value": np.array([_quantiles(row, np.array(QUANTILES)) for row in ordered]),
        "yield": yields[:-1],
        "yield_all": yields[-1],
        "yield_all_low": ends["yield"][0][-1],
        "yield_all_high": ends["yield"][1][-1],
        **dict(zip(("cp", "cpk"), np.array(capability).T, strict=True)),
        "band": _bands(samples, study, table),
        **_convergence(samples),
    }
    for name, (low, high) in ends.items():
        arrays |= {f"{name}_low": low[:count], f"{name}_high": high[:count]}
    return arrays


def _quantiles(ordered: Array, shares: Array) -> Array:
    """Quantiles of figures in order, of which the k-th stands for the share (k − ½)/n; linear between two of them."""
    if not ordered.size:
        return np.full(shares.shape, np.nan)
    values = np.quantile(ordered, np.clip(np.nan_to_num(shares), 0.0, 1.0), method="hazen")
    values = np.where(np.isnan(values), _of_rank(ordered, shares), values)
    return np.where(np.isnan(shares), np.nan, values)


def _of_rank(ordered: Array, shares: Array) -> Array:
    """The figures that so large shares do not exceed, NaN of a share that is not known."""
    rank = np.ceil(np.nan_to_num(shares) * len(ordered) - 1e-9).astype(int) - 1
    return np.where(np.isnan(shares), np.nan, ordered[np.clip(rank, 0, len(ordered) - 1)])


def _quantile_ends(ordered: list[Array], figure: Array) -> Interval:
    """Intervals of the quantiles. figure: (measure, replicate, sample)."""
    shares = np.array(QUANTILES)
    ends = np.full((2, len(ordered), len(shares)), np.nan)
    for i, row in enumerate(ordered):
        if not row.size:
            continue
        if figure.shape[1] == 1:
            ends[:, i] = [_of_rank(row, end) for end in intervals.of_quantile(shares, len(row))]
            continue
        each = np.array([_quantiles(np.sort(part[~np.isnan(part)]), shares) for part in figure[i]])
        low, high = intervals.by_replicates(each, axis=0)
        # even points tell a share to half of one: an error that the replicates have in common
        half = 0.5 * figure.shape[1] / len(row)
        low, high = np.minimum(low, _quantiles(row, shares - half)), np.maximum(high, _quantiles(row, shares + half))
        # the quantile of a replicate with hardly a point beyond it is its extreme
        few = len(row) / figure.shape[1] * np.minimum(shares, 1 - shares) < FEWEST
        ends[:, i] = np.where(few, np.nan, [low, high])
    return ends[0], ends[1]


def _histogram(ordered: list[Array]) -> tuple[NDArray[np.int64], Array]:
    """Samples in even bins, (measure, bin), and their edges; what lies far out is in the outermost bins."""
    counts, edges = np.zeros((len(ordered), BINS), np.int64), np.empty((len(ordered), BINS + 1))
    for i, row in enumerate(ordered):
        finite = row[np.isfinite(row)]
        least, low, high, most = np.quantile(finite, [0.0, CORE, 1 - CORE, 1.0]) if finite.size else np.zeros(4)
        room = FAR * (high - low)
        least, most = max(least, low - room), min(most, high + room)
        if not most - least > (slight := max(LEAST[0] * abs(least), LEAST[1])):
            least, most = least - slight, most + slight
        edges[i] = np.linspace(least, most, BINS + 1)
        counts[i] = np.histogram(np.clip(row, edges[i, 0], edges[i, -1]), edges[i])[0]
    return counts, edges


def limits_of(measure: Measure, nominal: float) -> tuple[float, float]:
    """Least and largest figure within limits and bounds; ±∞ where there is none."""
    low = -np.inf if measure.at_least is None else measure.at_least
    high = np.inf if measure.at_most is None else measure.at_most
    lower, upper = measure.lower, measure.upper
    if measure.rule == "deviation":
        return low, high if lower is None or upper is None else min(high, -lower, upper)
    return low if lower is None else max(low, nominal + lower), high if upper is None else min(high, nominal + upper)


def _bands(samples: Samples, study: ToleranceStudy, table: Table) -> Array:
    """Quantiles of the deviation of the course at every position, of the samples whose curves are kept."""
    bands = np.full((len(samples.curves), len(QUANTILES), len(table.plan.times)), np.nan)
    for i, (curves, order) in enumerate(zip(samples.curves, study.orders, strict=True)):
        ordered = np.sort(curves - (0.0 if order.against else np.nan_to_num(table.curves[i])), axis=0)  # NaN last
        index = table.plan.windows[order.measure.name].index
        for position, column in zip(index, ordered.T, strict=True):
            bands[i, :, position] = _quantiles(column[~np.isnan(column)], np.array(QUANTILES))
    return bands


def _convergence(samples: Samples) -> dict[str, Any]:
    """Figures of all samples, of half of them, of a quarter, …; of replicates, of the first of each together."""
    count, done = samples.figure.shape
    each = done // samples.job.replicates
    sizes = sorted({-(-each >> k) for k in range(SIZES)} - {0, 1}) or [each]
    replicates = (count, samples.job.replicates, each)
    figure, passed = samples.figure.reshape(replicates), samples.passed.reshape(replicates)
    rows = [moments_of(figure[..., :size].reshape(count, -1)) for size in sizes]
    return {
        "convergence_samples": np.array(sizes, np.int64) * samples.job.replicates,
        "convergence_mean": np.array([row.mean for row in rows]).T,
        "convergence_deviation": np.array([row.deviation for row in rows]).T,
        "convergence_yield": np.array([np.mean(passed[..., :size], axis=(1, 2)) for size in sizes]).T,
    }
