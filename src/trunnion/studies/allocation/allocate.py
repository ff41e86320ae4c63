"""The question of allocation: the tolerances and plays of least cost with which a mechanism keeps its limits.

First order makes rows of the mechanism (`rows`), the rows and the costs make a convex or mixed-integer problem
(`solve`), and what it finds goes back into the mechanism: effects that depend on the tolerances are taken again until
they stay the same. Then the mechanism is analysed with the tolerances found: worst case by search, and samples.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.model.tolerances import Price
from trunnion.solve.friction_method import FrictionMethod
from trunnion.statistics import intervals
from trunnion.statistics.costs import Cost
from trunnion.studies.allocation.problem import (
    AllocationProblem,
    Answer,
    Contribution,
    Criterion,
    SampledYield,
)
from trunnion.studies.allocation.result import CLOSE, DEFAULT_YIELD, Allocated, dataset, share_of
from trunnion.studies.allocation.rows import Rows, joined, rows_of
from trunnion.studies.allocation.solve import cheapest
from trunnion.studies.allocation.yields import meet
from trunnion.studies.tolerance.linear import ToleranceStudy, study
from trunnion.studies.tolerance.study import DEFAULT_SAMPLES, Method, check_share, sample, tolerance

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
START = 1e-5  # m: a play that is none yet is first looked at with this one
ROUNDS = 10
FRESH = 1_000_003  # between the seeds of samples that choose and of those that check: nobody states seeds so far off
SAME = 1e-9  # of a limit: effects that no longer change
MOST_FACTORS = 201
RANGE = (0.5, 2.0)  # of the stated limits: the curve of cost over accuracy


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def allocate(
    mechanism: Mechanism,
    measures: Sequence[str] | None = None,
    criterion: Criterion = "worst-case",
    target: float | None = None,
    steps: int = 360,
    at: float | str | None = None,
    samples: int = DEFAULT_SAMPLES,
    seed: int = 1,
    curve: int = 0,
    *,
    exact: bool = False,
    sure: bool = False,
    friction_method: FrictionMethod | None = None,
    jobs: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """The tolerances and plays of least cost with which measures keep their limits, and what they do then.

    What is to be chosen are the tolerances and plays with a cost (`Mechanism.prices`); all others stay as they are.

    Parameters
    ----------
    measures
        Those with limits that are to be kept; all of the model if not given.
    criterion, target
        One of `Criterion`: worst-case, rss, or yield, of which target is the share of mechanisms within all limits,
        0.9973 if not given; with another criterion it is an error.
    steps, at
        Positions of a whole cycle; the place of measures that state none.
    samples, seed, jobs
        Of the samples that verify it, none if 0; processes for them.
    curve
        How many points of cost over accuracy, all limits being multiplied by 0.5 to 2.
    exact
        Take limits narrower until the worst case found on the mechanism keeps them, and not first order alone.
    sure
        Of a yield, that the lower end of the 95 % interval of fresh samples meets the target, not its estimate.
    friction_method
        How friction and reactions are settled; Newton's method if not given.
    progress
        Called with the samples done.

    Returns
    -------
    Dataset
        That of `tolerance` for the mechanism with the tolerances found (`half_widths`), and over (parameter),
        (measure), (offer) the variables of `result.VARIABLES`. That no tolerances keep the limits is a finding of it.

    Raises
    ------
    MechanismError
        Nothing has a cost, no measure a limit, or as `tolerance` does.
    """
    share = DEFAULT_YIELD if target is None else target
    _check(criterion, target, sure, share, samples, curve)
    names = _limited(mechanism, measures)
    if not mechanism.costs:
        remedy = "state the costs of tolerances, as costs: {AB: {model: power, B: 1, k: 0.45, unit: mm}}"
        raise MechanismError(Finding("no tolerance has a cost", "costs", remedy))
    absent = {
        price.path: _start(price)
        for price in mechanism.prices()
        if price.play and not _clearance(mechanism, price.path)
    }
    start = study(mechanism.with_tolerances(absent), names, at, friction_method)
    prices, notes = _prices(start)
    before = {**_stated(start, prices), **{path: 0.0 for path in absent if path in prices}}
    varying = start.inputs.names
    rounds = _Rounds(
        mechanism, varying, names, criterion, share, at, samples, seed, friction_method, jobs, sure, prices
    )
    settled = rounds.settled(start, {})
    if exact and criterion == "worst-case":
        settled = rounds.exact(settled)
    answer = settled.answer

    offers: list[tuple[float, Answer]] = []
    for factor in np.geomspace(*RANGE, curve if answer.found else 0).tolist():  # of a yield with the margin that it has
        effects = answer.problem.effects
        wider = replace(effects, lower=factor * effects.lower, upper=factor * effects.upper)
        as_stated = abs(factor - 1) < SAME
        offers.append((factor, answer if as_stated else cheapest(replace(answer.problem, effects=wider))))
    what = "the measure has no first-order result: its limits were ignored in the allocation"
    remedy = "check with the samples whether they are met"
    notes += [Finding.warning("allocation.unknown", f"measures.{name}", what, remedy) for name in settled.rows.unknown]
    notes += settled.findings
    allocated = Allocated(criterion, share, settled.study, settled.rows, answer, prices, before, notes, offers)
    methods: list[Method] = ["linear"]
    if answer.found:
        mechanism = mechanism.with_tolerances(allocated.bought)
        methods += ["worst-case", "monte-carlo"] if samples else ["worst-case"]
    toleranced = tolerance(
        mechanism, names, methods, max(samples, 1), seed, steps, at, friction_method=friction_method, jobs=jobs,
        progress=progress,
    )  # fmt: skip
    return dataset(allocated, toleranced)


def _check(criterion: Criterion, target: float | None, sure: bool, share: float, samples: int, curve: int) -> None:
    """MechanismError with what is wrong with the question."""
    findings = check_share(share)
    if criterion != "yield" and target is not None:
        findings.append(Finding(f"{criterion} has no yield", "yield", "leave it out, or use the criterion yield"))
    elif criterion != "yield" and sure:
        findings.append(Finding("only a yield can be sure", "sure", "leave it out, or use the criterion yield"))
    if samples < 0:
        findings.append(Finding(f"{samples} samples", "samples", "give a number from 0"))
    if not (curve == 0 or 2 <= curve <= MOST_FACTORS):
        findings.append(Finding(f"a curve of {curve} points", "curve", f"give 2 to {MOST_FACTORS}"))
    if findings:
        raise MechanismError(findings)


def half_widths(result: xr.Dataset) -> dict[str, float]:
    """What an allocation found other than stated, by path, SI, for `Mechanism.with_tolerances`."""
    if not result.attrs["found"]:
        return {}
    columns = (result[key].values.tolist() for key in ("parameter", "bought", "tolerance", "tolerance_before"))
    return {
        name: t for name, toleranced, t, was in zip(*columns, strict=True) if toleranced and abs(t - was) > 1e-12 * t
    }


def _limited(mechanism: Mechanism, measures: Sequence[str] | None) -> list[str]:
    """Names of the measures that have a limit, of those named; MechanismError if none has."""
    names = list(mechanism.measures) if measures is None else list(measures)
    keys = ("limit", "at_least", "at_most")
    stated = mechanism.measures
    limited = [name for name in names if name in stated and any(getattr(stated[name], key) is not None for key in keys)]
    if not limited:
        what = f"none of the measures {', '.join(names)} has a limit" if names else "no measure is stated"
        remedy = "state the measures with limits, as measures: {position: {angle: rocker, limit: ±0.1 deg}}"
        raise MechanismError(Finding(what, "measures", remedy))
    return limited


# ---- what is bought -------------------------------------------------------------------------------------------


def _clearance(mechanism: Mechanism, path: str) -> float:
    """The radial clearance of a joint as it is stated."""
    numbers, joint = mechanism.parameter_set.nominal, path.split(".")[1]
    paths = (f"joints.{joint}.{part}.clearance" for part in ("pin", "guide"))
    return next((float(numbers[path]) for path in paths if path in numbers), 0.0)


def _start(price: Price) -> float:
    """A half width to begin with, where there is none."""
    if price.choices:
        return price.choices[0].tolerance
    ends = [end for end in (price.least, price.most) if 0 < end < np.inf]
    return float(np.sqrt(np.prod(ends))) if len(ends) == 2 else (ends[0] if ends else START)


def _prices(study: ToleranceStudy) -> tuple[dict[str, Price], list[Finding]]:
    """What can be bought of a study's numbers, by path, and a warning of each cost that is of no use."""
    mechanism, inputs = study.run.system.mechanism, study.inputs
    tolerances = {tolerance.path: tolerance for tolerance in inputs.tolerances}
    prices, findings = {}, []
    for price in mechanism.prices():
        what = ""
        if price.path not in inputs.names:
            what = "its pin has a stated seat, so the play does not vary"
        elif price.path in tolerances and tolerances[price.path].direction:
            what = "its direction is arbitrary, so the tolerance has no middle"
        elif price.path in tolerances:
            i = inputs.names.index(price.path)
            plays = {joint: inputs.play(joint, inputs.duals).radii for joint in inputs.loose}
            moved = [joint for joint, radii in plays.items() if any(inputs.derivatives(r)[i] for r in radii)]
            if moved:
                instead = f"state pin.clearance and a cost of {moved[0]}.clearance instead"
                what = f"it changes the play of {', '.join(moved)}; {instead}"
        if what:
            what = f"this tolerance is not allocated: {what}"
            remedy = "remove the cost; the tolerance stays as stated"
            findings.append(Finding.warning("allocation.not_for_sale", f"costs.{price.path}", what, remedy))
        else:
            prices[price.path] = price
    if not prices:
        raise MechanismError(findings or [Finding("no tolerance has a cost", "costs", "state the cost of a tolerance")])
    return prices, findings


def _stated(study: ToleranceStudy, prices: Mapping[str, Price]) -> dict[str, float]:
    """Half widths and clearances of a study, of what can be bought."""
    widths = {tolerance.path: tolerance.half_width for tolerance in study.inputs.tolerances}
    mechanism = study.run.system.mechanism
    return {path: widths[path] if path in widths else _clearance(mechanism, path) for path in prices}


# ---- rounds ---------------------------------------------------------------------------------------------------


class Settled(NamedTuple):
    """An answer with the rows that it keeps, and the study of its own tolerances."""

    answer: Answer
    study: ToleranceStudy
    rows: Rows
    findings: Sequence[Finding] = ()


@dataclass(frozen=True)
class _Rounds:
    """What is asked for, see `allocate`, paths of all that varies, and what can be bought of it."""

    mechanism: Mechanism
    names: Sequence[str]
    measures: Sequence[str]
    criterion: Criterion
    target: float
    at: float | str | None
    samples: int
    seed: int
    friction: FrictionMethod | None
    jobs: int | None
    sure: bool
    prices: Mapping[str, Price]

    def studied(self, tolerances: Array) -> tuple[ToleranceStudy, dict[str, float]]:
        """First order of the mechanism with half widths (contribution,), and those that are bought, by path."""
        pairs = zip(self.names, tolerances.tolist(), strict=True)
        bought = {name: t for name, t in pairs if name in self.prices}
        return study(self.mechanism.with_tolerances(bought), self.measures, self.at, self.friction), bought

    def solved(self, problem: AllocationProblem) -> Answer:
        """The answer of a problem; of a yield that of the samples."""
        if self.criterion != "yield":
            return cheapest(problem)

        def verify(tolerances: Array, number: int) -> SampledYield:
            job = self.studied(tolerances)[0].sampling(
                "monte-carlo", self.samples, self.seed + FRESH * number, "auto", steps=1
            )
            passed = np.all(sample(job, self.jobs)[0].passed, axis=0)
            return SampledYield(float(np.mean(passed)), *map(float, intervals.share(np.sum(passed), len(passed))))

        return meet(problem, self.target, verify if self.samples else None, self.sure)

    def settled(self, now: ToleranceStudy, tight: Mapping[str, float]) -> Settled:
        """The answer with rows taken at its own tolerances, in rounds from those of a study.

        Rows that move stay in the problem, so that the answer keeps all that they were. tight: what the limits of a
        measure are multiplied by.
        """
        contributions = list[Contribution]()
        for name in now.inputs.names:
            if (price := self.prices.get(name)) is None:  # the whole tolerance
                contributions.append(Contribution(name, 1.0))
            else:
                cost = Cost(price.model, price.parameters) if price.model else None
                bounds = price.choices, price.group, price.least, price.most
                contributions.append(Contribution(name, 0.0, cost, *bounds))
        rows = everything = rows_of(now, _stated(now, self.prices), self.criterion, tight)
        for count in range(ROUNDS):
            everything = joined([rows, everything.picked(everything.moving)]) if count else rows
            problem = AllocationProblem(tuple(contributions), everything.effects)
            answer = self.solved(problem)
            if not answer.found:
                return Settled(answer, now, everything)
            after, bought = self.studied(answer.tolerances)
            ahead = rows_of(after, bought, self.criterion, tight)
            if _same(answer, rows, ahead):
                return Settled(answer, after, everything)
            rows, last, now = ahead, now, after
        what = f"the effects depend on the tolerances themselves and did not converge in {ROUNDS} iterations"
        doubt = Finding.warning("allocation.unsettled", "costs", what, "use the verification", rounds=ROUNDS)
        return Settled(answer, last, everything, [doubt])

    def exact(self, settled: Settled) -> Settled:
        """The same with limits narrowed until the worst case that is found on the mechanism keeps the stated ones."""
        tight: dict[str, float] = {}
        for _ in range(ROUNDS):
            if not settled.answer.found:
                break
            excess = {}
            for order, corners in zip(settled.study.orders, settled.study.worst(), strict=True):
                shares = (share_of(end.value, limit) for end, limit in zip(corners, order.limits, strict=True))
                excess[order.measure.name] = max(shares)
            if max(excess.values()) <= 1 + CLOSE:
                break
            for name, share in excess.items():
                if share > 1:
                    tight[name] = tight.get(name, 1.0) / (share * (1 + CLOSE / 2))
            settled = self.settled(settled.study, tight)
        return settled


def _same(answer: Answer, rows: Rows, ahead: Rows) -> bool:
    """Whether the rows at the tolerances found take as much of their room as those they were found with."""
    if len(ahead.measure) != len(rows.measure):
        return False
    caps = None if answer.problem.caps is None else answer.problem.caps[: len(rows.measure)]
    before, after = (
        replace(answer.problem, effects=each.effects, caps=caps).used(answer.tolerances) for each in (rows, ahead)
    )
    still = ~rows.moving
    return bool(np.all(np.abs(after - before)[still] <= SAME) and np.all(after[rows.moving] <= 1 + SAME))
