"""What `allocate` was asked for and found, and its Dataset: that of `tolerance` with the tolerances and their cost."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, Severity
from trunnion.model.tolerances import Price
from trunnion.results.attributes import Figure, encoded, finding_rows, findings_of, summary_of
from trunnion.results.dataset import MemberUnits, Variable, described, scales_in, units_along, with_variables
from trunnion.results.quantities import drawn_in, signed
from trunnion.statistics.costs import Cost
from trunnion.studies.allocation.problem import Answer, Criterion
from trunnion.studies.allocation.rows import Rows, used_curve
from trunnion.studies.tolerance.linear import ToleranceStudy

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
DEFAULT_YIELD = 0.9973
CLOSE = 1e-6  # of a limit: how close to it the worst case found is brought
TWICE = 2.0  # so many rejects as an RSS stands for are an error
ROUGH, SLIGHT = 0.01, 0.001  # of a limit: what first order may leave out before it is an error, and a warning
M, P = ("measure",), ("parameter",)
VARIABLES: dict[str, Variable] = {
    "tolerance": Variable(P, "parameter", "half width found; of a clearance the radial clearance; else as stated"),
    "bought": Variable(P, "1", "1 if the tolerance has a cost and was chosen, 0 if it stays as stated"),
    "choice": Variable(P, "", "process or option, where there are such"),
    "cost": Variable(P, "1", "cost of the tolerance found"),
    "cost_share": Variable(P, "1", "share of the whole cost"),
    "tolerance_before": Variable(P, "parameter", "half width as stated"),
    "cost_before": Variable(P, "1", "cost of the tolerance as stated; NaN where no option has that half width"),
    "tolerance_least": Variable(P, "parameter", "lower bound of the half width"),
    "tolerance_most": Variable(P, "parameter", "upper bound of the half width"),
    "option_tolerance": Variable(("parameter", "option"), "parameter", "half width of an option"),
    "option_cost": Variable(("parameter", "option"), "1", "cost of an option"),
    "used": Variable(M, "1", "largest share of its limits that the measure uses, by the criterion"),
    "used_curve": Variable(("measure", "position"), "1", "share of its limits that the measure uses, by the criterion"),
    "yield_margin": Variable(M, "1", "margin of the limits that a required yield asks for, in standard deviations"),
    "saving": Variable(M, "saving", "cost saved by limits one unit wider at every position"),
    "cost_total": Variable((), "1", "cost of all tolerances found"),
    "cost_total_before": Variable((), "1", "cost of all tolerances as stated"),
    "cost_bound": Variable((), "1", "lower bound of the cost of feasible tolerances, to first order"),
    "gap": Variable((), "1", "optimality gap, relative to the part of the cost that depends on the tolerances"),
    "yield_expected": Variable((), "1", "yield of normal deviations, to first order"),
    "yield_checked": Variable((), "1", "share within all limits of fresh samples, which had no part in the choice"),
    "yield_checked_low": Variable((), "1", "yield of the fresh samples, lower end of the 95 % interval"),
    "yield_checked_high": Variable((), "1", "yield of the fresh samples, upper end of the 95 % interval"),
    "trade_off_factor": Variable(("offer",), "1", "common factor of all limits"),
    "trade_off_cost": Variable(("offer",), "1", "minimum cost for such limits; NaN if infeasible"),
    "trade_off_tolerance": Variable(("offer", "parameter"), "parameter", "half widths of least cost of such limits"),
}


@dataclass(frozen=True, eq=False)
class Allocated:
    """What was found. study: of the tolerances that the rows of the answer belong to.

    target: the yield, for that criterion; prices: of what could be bought, by path; before: half widths as stated;
    offers: factors of all limits with their answers.
    """

    criterion: Criterion
    target: float
    study: ToleranceStudy
    rows: Rows
    answer: Answer
    prices: Mapping[str, Price]
    before: Mapping[str, float]
    findings: Sequence[Finding]
    offers: Sequence[tuple[float, Answer]] = ()

    @property
    def bought(self) -> dict[str, float]:
        """Half widths that were found, and radial clearances, by path, SI."""
        return {name: t for name, t in self.answer.by_name.items() if name in self.prices}


def share_of(value: float, limit: float) -> float:
    """A deviation as a share of a limit to the same side; 0 of another side, or without a limit."""
    return max(value / limit, 0.0) if np.isfinite(limit) and limit != 0 and np.isfinite(value) else 0.0


def _cost_of(price: Price, t: float) -> float:
    """Cost of a half width, SI; of options, of the cheapest that keeps it, NaN if none does."""
    if price.model:
        return Cost(price.model, price.parameters).value(t)
    return min((choice.cost for choice in price.choices if choice.tolerance <= t * (1 + 1e-9)), default=np.nan)


def dataset(allocated: Allocated, toleranced: xr.Dataset) -> xr.Dataset:
    """The result with the numbers of the allocation. toleranced: of the mechanism with these tolerances."""
    answer = allocated.answer
    arrays = {**_by_parameter(allocated, toleranced), **_by_measure(allocated, toleranced)}
    before = [_cost_of(price, allocated.before[name]) for name, price in allocated.prices.items()]
    arrays |= {
        "cost_total": answer.cost,
        "cost_total_before": sum(before),
        "cost_bound": answer.bound,
        "gap": answer.gap,
    }
    if allocated.criterion == "yield":
        arrays["yield_expected"] = answer.expected
    if answer.checked is not None:
        arrays |= zip(("yield_checked", "yield_checked_low", "yield_checked_high"), answer.checked, strict=True)
    if allocated.offers:
        arrays["trade_off_factor"] = np.array([factor for factor, _ in allocated.offers])
        arrays["trade_off_cost"] = np.array([offer.cost for _, offer in allocated.offers])
    parameters = MemberUnits("parameter", units_along(toleranced["parameter_nominal"], "parameter"))
    saving = MemberUnits("measure", [f"1/({unit})" for unit in units_along(toleranced["nominal"], "measure")])
    variables = described(arrays, VARIABLES, {"parameter": parameters, "saving": saving})
    # the criterion says what is to be kept, but of measures that have no rows
    ignored = {f"measures.{name}" for name in allocated.rows.unknown}
    findings_kept = [
        finding
        for finding in findings_of(toleranced)
        if finding.where in ignored or not finding.code.startswith("limit.missed")
    ]
    attributes: dict[str, Any] = {
        "kind": "allocation",
        "found": int(allocated.answer.found),
        "criterion": allocated.criterion,
        "target": allocated.target,
        "choices": "discrete" if any(price.choices for price in allocated.prices.values()) else "continuous",
        "proven": int(allocated.answer.proven),
        "prices": [  # JSON has no infinite numbers
            {**asdict(price), "most": price.most if np.isfinite(price.most) else None}
            for price in allocated.prices.values()
        ],
        **scales_in(toleranced).summary([*_summary(allocated, arrays, toleranced), *summary_of(toleranced)]),
        "findings": finding_rows([*_findings(allocated, toleranced), *findings_kept]),
    }
    return with_variables(toleranced, variables).assign_attrs(encoded(attributes))


def _by_parameter(allocated: Allocated, toleranced: xr.Dataset) -> dict[str, Any]:
    """What is of each parameter: NaN of one without a cost, but for its half width, which stays as stated."""
    names, answer, prices = toleranced["parameter"].values.tolist(), allocated.answer, allocated.prices
    plays = {f"joints.{joint}.clearance" for joint in allocated.study.inputs.loose}
    halves = (toleranced["parameter_upper"].values - toleranced["parameter_lower"].values) / 2
    stated = np.where([name in plays for name in names], toleranced["parameter_nominal"].values, halves)
    costs = dict(zip((item.name for item in answer.problem.contributions), answer.costs.tolist(), strict=True))
    chosen, before = allocated.bought, allocated.before

    def of_prices(number: Callable[[str, Price], float]) -> Array:
        return np.array([number(name, prices[name]) if name in prices else np.nan for name in names])

    cost = of_prices(lambda name, _: costs[name])
    arrays: dict[str, Any] = {
        "tolerance": np.array([chosen.get(name, half) for name, half in zip(names, stated, strict=True)]),
        "bought": np.array([int(name in prices) for name in names], np.int8),
        "choice": np.array([answer.choices.get(name, "") for name in names], str),
        "cost": cost,
        "cost_share": cost / answer.cost if answer.cost else np.full(len(names), np.nan),
        "tolerance_before": np.array([before.get(name, half) for name, half in zip(names, stated, strict=True)]),
        "cost_before": of_prices(lambda name, price: _cost_of(price, before[name])),
        "tolerance_least": of_prices(lambda _, price: price.least),
        "tolerance_most": of_prices(lambda _, price: price.most if np.isfinite(price.most) else np.nan),
    }
    if width := max(len(price.choices) for price in prices.values()):
        options = np.full((2, len(names), width), np.nan)
        for i, name in enumerate(names):
            for k, item in enumerate(prices[name].choices if name in prices else ()):
                options[:, i, k] = item.tolerance, item.cost
        arrays |= {"option_tolerance": options[0], "option_cost": options[1]}
    if allocated.offers:
        offered = [answer.by_name for _, answer in allocated.offers]
        arrays["trade_off_tolerance"] = np.array([of_prices(lambda name, _: item[name]) for item in offered])  # noqa: B023
    return arrays


def _by_measure(allocated: Allocated, toleranced: xr.Dataset) -> dict[str, Any]:
    """How much of its room each measure takes, and what more of it would save."""
    count, positions, rows = toleranced.sizes["measure"], toleranced.sizes["position"], allocated.rows
    used, saving, curve = np.full(count, np.nan), np.full(count, np.nan), np.full((count, positions), np.nan)
    if allocated.answer.found:
        answer = allocated.answer
        shares, table = answer.used, allocated.study.table(int(toleranced.attrs["steps"]))
        for k in np.unique(rows.measure):
            used[k], saving[k] = np.max(shares[rows.measure == k]), np.sum(answer.price[rows.measure == k])
        for k in range(count):
            curve[k] = used_curve(
                allocated.study, table, rows, allocated.criterion, answer.problem, answer.tolerances, k
            )
    arrays = {"used": used, "used_curve": curve, "saving": saving}
    if allocated.criterion == "yield":
        arrays["yield_margin"] = np.full(count, np.nan)
        if allocated.answer.found:
            arrays["yield_margin"][rows.measure] = allocated.answer.problem.margins()
    return arrays


# ---- summary and findings --------------------------------------------------------------------------------------


def _summary(allocated: Allocated, arrays: Mapping[str, Any], toleranced: xr.Dataset) -> Iterator[Figure]:
    """What all costs, and before; what of the room is taken."""
    answer = allocated.answer
    yield Figure("cost", "cost", answer.cost if answer.found else None, aspect="least")
    if np.isfinite(arrays["cost_total_before"]):
        yield Figure("cost_before", "cost as stated", arrays["cost_total_before"])
    if not answer.found:
        return
    yield Figure("cost_bound", "lower bound of the cost", answer.bound)
    if answer.sampled is not None:
        yield Figure("yield_asked", "required yield", allocated.target)
        yield Figure("yield", "yield of the samples", answer.sampled.share)
    if answer.checked is not None:
        yield Figure("yield_checked", "yield of fresh samples", answer.checked.share)
    for name, used in zip(toleranced["measure"].values.tolist(), arrays["used"].tolist(), strict=True):
        if np.isfinite(used):
            yield Figure(f"{name}.used", f"{name}, share of the limits used", used)


def _findings(allocated: Allocated, toleranced: xr.Dataset) -> Iterator[Finding]:
    """Why there is no allocation; limits that are not kept on the mechanism itself; what the criterion leaves out."""
    answer, criterion = allocated.answer, allocated.criterion
    yield from allocated.findings
    yield from answer.findings
    if not answer.found:
        return
    if not answer.proven:
        what = f"the optimality gap is {answer.gap:.1e} of the cost of the tolerances"
        remedy = "check the orders of magnitude"
        yield Finding.warning("allocation.proven_roughly", "costs", what, remedy, gap=answer.gap)
    if criterion != "yield" and allocated.study.effects.correlated:
        what = f"the criterion {criterion} ignores the correlations"
        remedy = "use a yield, which includes them"
        yield Finding.warning("allocation.correlations_left_out", "correlations", what, remedy, criterion=criterion)
    if criterion == "worst-case":
        yield from _searched(allocated, toleranced)
    if criterion == "rss" and "yield" in toleranced:  # three deviations of a normal distribution is what RSS stands for
        columns = (toleranced[key].values.tolist() for key in ("measure", "yield", "yield_high"))
        for name, share, high in zip(*columns, strict=True):
            if high < DEFAULT_YIELD:
                severity = Severity.ERROR if 1 - high > TWICE * (1 - DEFAULT_YIELD) else Severity.WARNING
                what = f"the yield of the samples is {share:.6g}; an RSS within the limits implies {DEFAULT_YIELD:g}"
                remedy = "require that yield instead, which uses distributions, means and correlations as stated"
                figures = {"share": share, "target": DEFAULT_YIELD}
                yield Finding.weighed(severity, "yield.below_rss", f"measures.{name}", what, remedy, **figures)


def _searched(allocated: Allocated, toleranced: xr.Dataset) -> Iterator[Finding]:
    """Measures whose worst case, as found on the mechanism, is beyond a limit that first order keeps."""
    units = units_along(toleranced["nominal"], "measure")
    for k, of in enumerate(allocated.study.orders):
        ends = [float(toleranced[f"searched_{end}"][k]) for end in ("lower", "upper")]
        excess, worst, limit = max(
            (share_of(value, limit) - 1, value, limit) for value, limit in zip(ends, of.limits, strict=True)
        )
        if excess > CLOSE:
            severity = Severity.ERROR if excess > ROUGH else Severity.WARNING if excess > SLIGHT else Severity.NOTE
            texts = [signed(value, *drawn_in(limit, units[k]), "", 6) for value in (worst, limit)]
            what = (
                f"the worst case of the mechanism, {texts[0]}, exceeds the limit {texts[1]}, which first order meets, "
            )
            what += f"by {100 * excess:.2g} % (up to {100 * ROUGH:g} % beyond is accepted)"
            remedy = "use --exact (in Python exact=True), which narrows the tolerances"
            figures = {"worst": worst, "limit": limit, "percent": 100 * excess, "accepted": 100 * ROUGH}
            where = f"measures.{of.measure.name}"
            yield Finding.weighed(severity, "allocation.worst_case_beyond", where, what, remedy, **figures)
