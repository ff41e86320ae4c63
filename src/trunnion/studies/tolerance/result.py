"""The Dataset of `tolerance`: names, units, summary and provenance; its measures and courses in words."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.scales import scales_of
from trunnion.cycle.summary import references
from trunnion.errors import Finding, Status
from trunnion.measures.measures import Measure
from trunnion.model.measure_units import dimension_kinds
from trunnion.results.attributes import cited, finding_rows, origin
from trunnion.results.dataset import MemberUnits, Variable, dataset_of, described, driven
from trunnion.solve.system import System
from trunnion.studies.tolerance.effects import Spread
from trunnion.studies.tolerance.findings import Outcome, findings_of, summary
from trunnion.studies.tolerance.linear import Table, ToleranceStudy
from trunnion.studies.tolerance.sampled import QUANTILES, sampled

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["VARIABLES", "course_text", "dataset", "text_of"]

Array = NDArray[np.float64]
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
    system, mechanism = study.run.system, study.run.system.mechanism
    counted = sampled(outcome.samples, study, table) if outcome.samples else None
    job = outcome.samples.job if outcome.samples else None
    findings = [*findings_of(outcome, counted), *notes]
    arrays = {**_linear(study, table), **_worst(outcome), **(counted or {})}
    arrays |= outcome.indices.arrays if outcome.indices else {}
    units = [measure.figure_unit(system, study.run.values) for measure in study.measures]
    curve_units = [measure.unit(system) for measure in study.measures]
    dimensions = {f"dimensions.{name}": kind for name, kind in dimension_kinds(mechanism).items()}
    kinds = {**mechanism.parameter_kinds(), **dimensions}
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
        **origin(mechanism, system.plan.formula),
        **cited(references(mechanism)),
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
        "findings": finding_rows(findings),
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
    with np.errstate(all="ignore"):
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
