"""What `allocate` was asked for and found, and its Dataset: that of `tolerance` with the tolerances and their cost."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, Severity, agreeing
from trunnion.model.mechanism import Mechanism
from trunnion.model.tolerances import Price
from trunnion.results.attributes import encoded, finding_rows, findings_of, summary_of
from trunnion.results.dataset import MemberUnits, Variable, described, units_along, with_variables
from trunnion.results.figure import Figure
from trunnion.results.quantities import readable
from trunnion.results.scales import scales_in
from trunnion.solve.friction_method import FrictionMethod
from trunnion.statistics.costs import Cost
from trunnion.studies.allocation.problem import Answer, Criterion
from trunnion.studies.allocation.rows import Rows
from trunnion.studies.tolerance.first_order import ToleranceStudy, study
from trunnion.studies.tolerance.linear import limits

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "CLOSE",
    "DEFAULT_YIELD",
    "VARIABLES",
    "Allocated",
    "AllocationRequest",
    "Choice",
    "Way",
    "cost_of",
    "dataset",
    "share_of",
]

Array = NDArray[np.float64]
Way = Literal["continuous", "discrete"]
Choice = Literal["auto", "continuous", "discrete"]
DEFAULT_YIELD = 0.9973
CLOSE = 1e-6  # of a limit: how close to it the worst case found is brought
TWICE = 2.0  # so many rejects as an RSS stands for are an error
SHOWN = {"rad": (180 / np.pi, "deg"), "m": (1e3, "mm")}
ROUGH, SLIGHT = 0.01, 0.001  # of a limit: what first order may leave out before it is an error, and a warning
M, P, T = ("measure",), ("parameter",), ("trial",)
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
    "trial_margin": Variable(
        T, "1", "margin of the limits in a trial, in standard deviations; the mean over the measures"
    ),
    "trial_cost": Variable(T, "1", "cost of a trial"),
    "trial_yield": Variable(T, "1", "share of the samples within all limits in a trial"),
    "trial_yield_low": Variable(T, "1", "yield of a trial, lower end of the 95 % interval"),
    "trial_yield_high": Variable(T, "1", "yield of a trial, upper end of the 95 % interval"),
    "trade_off_factor": Variable(("offer",), "1", "common factor of all limits"),
    "trade_off_cost": Variable(("offer",), "1", "minimum cost for such limits; NaN if infeasible"),
    "trade_off_tolerance": Variable(("offer", "parameter"), "parameter", "half widths of least cost of such limits"),
}


@dataclass(frozen=True)
class AllocationRequest:
    """What was asked for; see `allocate`. measures: those with limits; target: the yield, for that criterion."""

    mechanism: Mechanism
    measures: Sequence[str]
    criterion: Criterion
    target: float
    choice: Choice
    steps: int
    at: float | str | None
    samples: int
    seed: int
    friction: FrictionMethod | None
    jobs: int | None
    curve: int
    exact: bool
    sure: bool

    def studied(self, bought: Mapping[str, float]) -> ToleranceStudy:
        """First order of the mechanism with these half widths and clearances, by path."""
        mechanism = self.mechanism.with_tolerances(bought)
        return study(mechanism, self.measures, self.steps, self.at, self.friction)


@dataclass(frozen=True, eq=False)
class Allocated:
    """What was found. study: of the tolerances that the rows of the answer belong to; way: how it was solved.

    prices: of what could be bought, by path; before: half widths as stated; tight: what limits were multiplied by, by
    measure, so that the mechanism itself keeps them; offers: factors of all limits with their answers.
    """

    asked: AllocationRequest
    study: ToleranceStudy
    rows: Rows
    answer: Answer
    way: Way
    prices: Mapping[str, Price]
    before: Mapping[str, float]
    findings: tuple[Finding, ...]
    tight: Mapping[str, float] = field(default_factory=dict)
    offers: tuple[tuple[float, Answer], ...] = field(default=())

    @property
    def bought(self) -> dict[str, float]:
        """Half widths that were found, and radial clearances, by path, SI."""
        return {name: t for name, t in self.answer.by_name.items() if name in self.prices}


def share_of(value: float, limit: float) -> float:
    """A deviation as a share of a limit to the same side; 0 of another side, or without a limit."""
    return max(value / limit, 0.0) if np.isfinite(limit) and limit != 0 and np.isfinite(value) else 0.0


def cost_of(price: Price, t: float) -> float:
    """Cost of a half width, SI; of options, of the cheapest that keeps it, NaN if none does."""
    if price.model:
        return Cost(price.model, price.parameters).value(t)
    return min((choice.cost for choice in price.choices if choice.tolerance <= t * (1 + 1e-9)), default=np.nan)


def stated_cost(allocated: Allocated) -> float:
    """What all costs as it is stated; NaN where a half width has no cost."""
    return float(np.sum([cost_of(price, allocated.before[name]) for name, price in allocated.prices.items()]))


def dataset(allocated: Allocated, toleranced: xr.Dataset) -> xr.Dataset:
    """The result with the numbers of the allocation. toleranced: of the mechanism with these tolerances."""
    arrays = {
        **_bought(allocated, toleranced),
        **_rows(allocated, toleranced),
        **_whole(allocated, toleranced.sizes["measure"]),
    }
    parameters = MemberUnits("parameter", units_along(toleranced["parameter_nominal"], "parameter"))
    saving = MemberUnits("measure", [f"1/({unit})" for unit in units_along(toleranced["nominal"], "measure")])
    variables = described(arrays, VARIABLES, {"parameter": parameters, "saving": saving})
    # the criterion says what is to be kept
    findings_kept = [finding for finding in findings_of(toleranced) if not finding.code.startswith("limit.missed")]
    findings = list(_findings(allocated, toleranced))
    attributes: dict[str, Any] = {
        "kind": "allocation",
        "found": int(allocated.answer.found),
        "criterion": allocated.asked.criterion,
        "target": allocated.asked.target,
        "choices": allocated.way,
        "proven": int(allocated.answer.proven),
        "prices": [_plain(price) for price in allocated.prices.values()],
        **scales_in(toleranced).summary([*_summary(allocated, toleranced, arrays), *summary_of(toleranced)]),
        "findings": finding_rows([*findings, *findings_kept]),
        "missed": [
            f"{finding.where}: {finding.what}".lstrip(": ")
            for finding in findings
            if finding.severity is Severity.ERROR
        ],
    }
    return with_variables(toleranced, variables).assign_attrs(encoded(attributes))


def _plain(price: Price) -> dict[str, Any]:
    """A price for JSON, which has no infinite numbers."""
    return {**asdict(price), "most": price.most if np.isfinite(price.most) else None}


def _bought(allocated: Allocated, toleranced: xr.Dataset) -> dict[str, Any]:
    """What is of each parameter."""
    names = [str(name) for name in toleranced["parameter"].values]
    answer, prices = allocated.answer, allocated.prices
    halves = (toleranced["parameter_upper"].values - toleranced["parameter_lower"].values) / 2
    as_stated = [
        float(toleranced["parameter_nominal"].values[i]) if _is_play(allocated, name) else float(halves[i])
        for i, name in enumerate(names)
    ]
    costs = dict(zip((item.name for item in answer.problem.contributions), answer.costs.tolist(), strict=True))
    chosen, before = allocated.bought, allocated.before
    cost = np.array([costs[name] if name in prices else np.nan for name in names])
    width = max((len(item.choices) for item in prices.values()), default=0)
    options = np.full((2, len(names), width), np.nan)
    for i, name in enumerate(names):
        for k, item in enumerate(prices[name].choices if name in prices else ()):
            options[:, i, k] = item.tolerance, item.cost
    arrays: dict[str, Any] = {
        "tolerance": np.array([chosen.get(name, half) for name, half in zip(names, as_stated, strict=True)]),
        "bought": np.array([int(name in prices) for name in names], np.int8),
        "choice": np.array([answer.choices.get(name, "") for name in names], str),
        "cost": cost,
        "cost_share": cost / answer.cost if answer.cost else np.full(len(names), np.nan),
        "tolerance_before": np.array([before.get(name, half) for name, half in zip(names, as_stated, strict=True)]),
        "cost_before": np.array([cost_of(prices[name], before[name]) if name in prices else np.nan for name in names]),
        "tolerance_least": np.array([prices[name].least if name in prices else np.nan for name in names]),
        "tolerance_most": np.array([_most(prices[name]) if name in prices else np.nan for name in names]),
    }
    if width:
        arrays |= {"option_tolerance": options[0], "option_cost": options[1]}
    if allocated.offers:
        offered = [answer.by_name for _, answer in allocated.offers]
        arrays["trade_off_tolerance"] = np.array([[item[name] if name in prices else np.nan for name in names]
                                                  for item in offered])  # fmt: skip
    return arrays


def _is_play(allocated: Allocated, name: str) -> bool:
    return name.endswith(".clearance") and name.split(".")[1] in allocated.study.inputs.loose and name.count(".") == 2


def _most(price: Price) -> float:
    return price.most if np.isfinite(price.most) else np.nan


def _rows(allocated: Allocated, toleranced: xr.Dataset) -> dict[str, Any]:
    """How much of its room each measure takes, and what more of it would save."""
    count, positions = toleranced.sizes["measure"], toleranced.sizes["position"]
    used, curve, saving = np.full(count, np.nan), np.full((count, positions), np.nan), np.full(count, np.nan)
    margin = np.full(count, np.nan)
    if allocated.answer.found:
        shares = allocated.answer.used[: len(allocated.rows.measure)]
        prices = allocated.answer.price[: len(allocated.rows.measure)]
        margin = _margins(allocated, count)
        for k in range(count):
            rows_of_measure = allocated.rows.measure == k
            if np.any(rows_of_measure):
                used[k], saving[k] = float(np.max(shares[rows_of_measure])), float(np.sum(prices[rows_of_measure]))
                placed = rows_of_measure & (allocated.rows.position >= 0)
                curve[k, allocated.rows.position[placed]] = shares[placed]
    arrays = {"used": used, "used_curve": curve, "saving": saving}
    return {**arrays, "yield_margin": margin} if allocated.asked.criterion == "yield" else arrays


def _margins(allocated: Allocated, count: int, z: float | None = None) -> NDArray[np.float64]:
    """The margin of each measure, NaN without limits: of the answer, or with another z."""
    problem = allocated.answer.problem if z is None else replace(allocated.answer.problem, z=z)
    margins = problem.margins()
    first = {int(k): margins[np.flatnonzero(allocated.rows.measure == k)[0]] for k in np.unique(allocated.rows.measure)}
    return np.array([first.get(k, np.nan) for k in range(count)])


def _whole(allocated: Allocated, count: int) -> Mapping[str, Any]:
    """What is of the whole."""
    answer = allocated.answer
    arrays: dict[str, Any] = {
        "cost_total": np.array(answer.cost),
        "cost_total_before": np.array(stated_cost(allocated)),
        "cost_bound": np.array(answer.bound),
        "gap": np.array(answer.gap),
    }
    if allocated.asked.criterion == "yield":
        arrays["yield_expected"] = np.array(answer.expected)
    if answer.checked is not None:
        ends = zip(("", "_low", "_high"), answer.checked, strict=True)
        arrays |= {f"yield_checked{end}": np.array(number) for end, number in ends}
    if answer.trials:
        arrays |= {
            "trial_margin": np.array([np.nanmean(_margins(allocated, count, trial.z)) for trial in answer.trials]),
            "trial_cost": np.array([trial.cost for trial in answer.trials]),
            "trial_yield": np.array([trial.sampled.share for trial in answer.trials]),
            "trial_yield_low": np.array([trial.sampled.low for trial in answer.trials]),
            "trial_yield_high": np.array([trial.sampled.high for trial in answer.trials]),
        }
    if allocated.offers:
        arrays["trade_off_factor"] = np.array([factor for factor, _ in allocated.offers])
        arrays["trade_off_cost"] = np.array([answer.cost for _, answer in allocated.offers])
    return arrays


# ---- summary and findings --------------------------------------------------------------------------------------


def _summary(allocated: Allocated, toleranced: xr.Dataset, arrays: Mapping[str, Any]) -> Iterator[Figure]:
    """What all costs, and before; what of the room is taken."""
    answer = allocated.answer
    yield Figure("cost", "cost", answer.cost if answer.found else None, aspect="least")
    if np.isfinite(arrays["cost_total_before"]):
        yield Figure("cost_before", "cost as stated", arrays["cost_total_before"])
    if answer.found:
        yield Figure("cost_bound", "lower bound of the cost", answer.bound)
    if answer.sampled is not None:
        yield Figure("yield_asked", "required yield", allocated.asked.target)
        yield Figure("yield", "yield of the samples", answer.sampled.share)
    if answer.checked is not None:
        yield Figure("yield_checked", "yield of fresh samples", answer.checked.share)
    for name, used in zip(toleranced["measure"].values.tolist(), arrays["used"].tolist(), strict=True):
        if answer.found and np.isfinite(used):
            yield Figure(f"{name}.used", f"{name}, share of the limits used", used)


def _findings(allocated: Allocated, toleranced: xr.Dataset) -> Iterator[Finding]:
    """Why there is no allocation; limits that are not kept on the mechanism itself; what the criterion leaves out."""
    answer, criterion = allocated.answer, allocated.asked.criterion
    yield from allocated.findings
    yield from answer.findings
    if not answer.found:
        return
    yield from _plays(allocated)
    for name, share in allocated.tight.items():
        what = f"its limits were narrowed by {100 * (1 - share):.2g} % so that the mechanism meets them exactly, not "
        what += "to first order"
        yield Finding.note("allocation.narrowed", f"measures.{name}", what, percent=100 * (1 - share))
    if criterion != "yield" and allocated.study.effects.correlated:
        what = f"the criterion {criterion} ignores the correlations"
        remedy = "use a yield, which includes them"
        yield Finding.warning("allocation.correlations_left_out", "correlations", what, remedy, criterion=criterion)
    if criterion == "worst-case":
        yield from _searched(allocated, toleranced)
    if criterion == "rss" and "yield" in toleranced:
        yield from _promised(toleranced)
    factors_met = [factor for factor, offer in allocated.offers if offer.found]
    if len(factors_met) < len(allocated.offers):
        points, lost = len(allocated.offers), len(allocated.offers) - len(factors_met)
        what = f"{lost} of the {points} points of the curve {agreeing(lost, 'is', 'are')} infeasible"
        remedy = f"limits of at least {min(factors_met):.3g} times the stated ones are feasible" if factors_met else ""
        yield Finding.note("allocation.curve_short", "", what, remedy, points=points, lost=lost)


def _plays(allocated: Allocated) -> Iterator[Finding]:
    """Allocated plays whose clearance has a tolerance of its own, which no cost is of."""
    for path in allocated.prices:
        joint = path.split(".")[1]
        sizes = [f"joints.{joint}.{part}.clearance" for part in ("pin", "guide")]
        for tolerance in allocated.study.inputs.tolerances:
            if path == f"joints.{joint}.clearance" and tolerance.path in sizes:
                lower, upper = 1e6 * tolerance.lower, 1e6 * tolerance.upper
                what = (
                    f"the clearance is allocated; the tolerance {lower:+g}/{upper:+g} µm of {tolerance.path} stays as "
                )
                what += "stated, in addition to it, and the limits include it"
                remedy = "remove this tolerance if the cost covers the largest clearance"
                figures = {"number": tolerance.path, "lower_um": lower, "upper_um": upper}
                yield Finding.note("allocation.play_tolerance", f"costs.{joint}.clearance", what, remedy, **figures)


def _promised(toleranced: xr.Dataset) -> Iterator[Finding]:
    """Measures of whose samples fewer keep the limits than three deviations of a normal one would.

    That is what RSS means where the tolerances are three deviations of theirs; other distributions, means off the
    middle, and correlations make it another.
    """
    for name, share, high in zip(
        *(toleranced[key].values.tolist() for key in ("measure", "yield", "yield_high")), strict=True
    ):
        if not high < DEFAULT_YIELD:
            continue
        severity = Severity.ERROR if 1 - high > TWICE * (1 - DEFAULT_YIELD) else Severity.WARNING
        yield Finding.weighed(
            severity,
            "yield.below_rss",
            f"measures.{name}",
            f"the yield of the samples is {share:.6g}; an RSS within the limits implies {DEFAULT_YIELD:g}",
            "require that yield instead, which uses distributions, means and correlations as stated",
            share=share,
            target=DEFAULT_YIELD,
        )


def _searched(allocated: Allocated, toleranced: xr.Dataset) -> Iterator[Finding]:
    """Measures whose worst case, as found on the mechanism, is beyond a limit that first order keeps."""
    units = units_along(toleranced["nominal"], "measure")
    for k, of in enumerate(allocated.study.linear.measures):
        lower, upper = limits(of)
        low, high = float(toleranced["searched_lower"][k]), float(toleranced["searched_upper"][k])
        shares = share_of(low, lower), share_of(high, upper)
        excess = max(shares) - 1
        if not excess > CLOSE:
            continue
        factor, unit = SHOWN.get(units[k], (1.0, units[k]))
        value, limit = (high, upper) if shares[1] >= shares[0] else (low, lower)
        severity = Severity.ERROR if excess > ROUGH else Severity.WARNING if excess > SLIGHT else Severity.NOTE
        yield Finding.weighed(
            severity,
            "allocation.worst_case_beyond",
            f"measures.{of.measure.name}",
            f"the worst case of the mechanism, {readable(factor * value, unit)}, exceeds the "
            f"limit {readable(factor * limit, unit)} by {100 * excess:.2g} %; to first order it "
            f"is met (up to {100 * ROUGH:g} % beyond is accepted)",
            "use --exact (in Python exact=True), which narrows the tolerances",
            worst=factor * value,
            unit=unit,
            percent=100 * excess,
            limit=factor * limit,
            accepted=100 * ROUGH,
        )
