"""The question of tolerances: what the scatter of a mechanism's numbers does to measures, and which of them does it."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.analysis.analyse import Run, check_steps, prepare
from trunnion.analysis.friction import FrictionMethod
from trunnion.analysis.measure_figures import Reference
from trunnion.analysis.measure_positions import Plan, plan
from trunnion.analysis.measures import Measure, named, outputs
from trunnion.analysis.tolerance import runner
from trunnion.analysis.tolerance.effects import Effects, effects_of
from trunnion.analysis.tolerance.indices import Indices, indices
from trunnion.analysis.tolerance.inputs import Inputs, inputs_of
from trunnion.analysis.tolerance.kernel import NumpyKernel, references
from trunnion.analysis.tolerance.linear import Linear, linear, searched
from trunnion.analysis.tolerance.sampling import METHODS as SAMPLINGS
from trunnion.analysis.tolerance.sampling import Sampler, Sampling, Tally, towards
from trunnion.analysis.tolerance.search import Corner
from trunnion.errors import Finding, MechanismError, Severity, counted
from trunnion.model.measure_kinds import place_kind
from trunnion.model.mechanism import Mechanism
from trunnion.model.quantity import Quantity
from trunnion.model.units import UnitError

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["DEFAULT_METHODS", "METHODS", "Study", "study", "tolerance"]

ENGINES = ("numpy", "jax")
METHODS = ("linear", "worst-case", *SAMPLINGS, "sobol")
DEFAULT_METHODS = ("linear", "worst-case", "monte-carlo")
DEFAULT_SAMPLES = 10_000
MOST_SAMPLES = 10**15
FEW = 10_000_000  # configurations up to which further processes cost more than they save


@dataclass(frozen=True, eq=False)
class Study:
    """A mechanism whose numbers vary, with what is measured, made ready: evaluate it by any method.

    told: what there is to say of the choice of measures.
    """

    run: Run
    inputs: Inputs
    measures: tuple[Measure, ...]
    steps: int
    friction: FrictionMethod
    told: tuple[Finding, ...] = ()

    @cached_property
    def plan(self) -> Plan:
        """The positions that the measures need."""
        return plan(self.run, self.measures, self.steps)

    @cached_property
    def kernel(self) -> NumpyKernel:
        return NumpyKernel(self.run, self.measures, self.friction)

    @cached_property
    def effects(self) -> Effects:
        """Rows of the batch that first order takes."""
        return effects_of(self.inputs)

    @cached_property
    def references(self) -> dict[str, Reference]:
        """The measures of the nominal mechanism."""
        return references(self.kernel, self.plan, self.inputs)

    @cached_property
    def linear(self) -> Linear:
        """First order of every measure."""
        return linear(self.kernel, self.plan, self.effects, self.references)

    def worst(self) -> list[tuple[Corner, Corner]]:
        """Least and largest deviation of every measure on the mechanism itself."""
        return [searched(self.kernel, self.linear, of) for of in self.linear.measures]

    def sampling(self, method: Any, samples: int, seed: int, engine: str = "numpy") -> Sampling:
        """The run of a sampling method."""
        spread, curves = [], []
        for of in self.linear.measures:
            known = of.reference
            centre = known.figure + _finite(of.total[3])
            spread.append((centre, _finite(of.total[4])))
            middle = 0.0 * of.curve if known.against else of.curve  # what `shown` gives of the nominal mechanism
            curves.append((np.nan_to_num(middle), np.nan_to_num(of.curve_total[4])))
        model = self.run.system.mechanism.data()
        rotation = None
        if method == "quasi-monte-carlo" and self.inputs.tolerances:
            count = len(self.inputs.tolerances)
            rotation = towards(np.array([self.effects.gradient(of.slope)[:count] for of in self.linear.measures]))
        return Sampling(
            model, self.measures, self.steps, method, samples, seed, engine, self.friction, len(self.plan.times),
            tuple(spread), tuple(curves), rotation,
        )  # fmt: skip

    def sampler(self, job: Sampling) -> Sampler:
        """What draws and analyses blocks, in this process."""
        return job.prepare()


def _finite(number: Any) -> float:
    return float(np.nan_to_num(number, posinf=0.0, neginf=0.0))


def study(
    mechanism: Mechanism,
    measures: Sequence[str] | None = None,
    steps: int = 360,
    at: float | str | None = None,
    friction: FrictionMethod | None = None,
) -> Study:
    """A study of a mechanism. Raises MechanismError as `tolerance` does."""
    check_steps(steps)
    run = prepare(mechanism)
    inputs = inputs_of(run)
    names = list(mechanism.measures) if measures is None else list(measures)
    told: list[Finding] = []
    if names:
        found = named(mechanism, names, run.values)
    else:
        found = outputs(run.system)
        remedy = "state measures: in the model, or give --measure link.point.x"
        if not found:
            what = "no measure is stated, and no joint to the ground is an output"
            raise MechanismError(Finding(what, "measures", remedy))
        listed = ", ".join(one.name for one in found)
        what = f"no measure is stated: {listed} taken, joints to the ground without a driver"
        told.append(Finding(what, "measures", remedy, Severity.NOTE))
    if run.determinacy is not None and not all(one.of_motion for one in found):
        run.determinacy.refuse()
    if run.cycle.duration <= 0:  # there is one position
        found = [replace(one, statistic="value") if one.rule == "deviation" else one for one in found]
    if at is not None:
        found = [placed(mechanism, one, at) for one in found]
    return Study(run, inputs, tuple(found), steps, friction or FrictionMethod(), tuple(told))


def tolerance(
    mechanism: Mechanism,
    measures: Sequence[str] | None = None,
    methods: Sequence[str] = DEFAULT_METHODS,
    samples: int = DEFAULT_SAMPLES,
    seed: int = 1,
    steps: int = 360,
    at: float | str | None = None,
    *,
    friction: FrictionMethod | None = None,
    jobs: int | None = None,
    chunk: int | None = None,
    engine: str = "numpy",
    cluster: str | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    resume: bool = False,
    progress: Callable[[int], None] | None = None,
    target: float | None = None,
) -> xr.Dataset:
    """What the tolerances and plays of a mechanism do to measures: limits, scatter, yield, and what each contributes.

    measures: names of the model's, or as on the command line (`measures.named`); all of the model if not given, or,
    where it states none, rotation and slide of every joint to the ground that is not driven. methods: of METHODS.
    samples: of the sampling method, and of the variance-based indices; seed: of its random numbers. steps: positions of
    a whole cycle; at: the place (driver coordinate or time) of measures that state neither a place nor a figure.
    jobs: processes, one a core if not given and worth it; chunk, cluster, checkpoint, resume, progress: `runner.run`.
    engine: numpy, or jax (an extra). target: the yield that is asked for; limits are missed below it, and if none is
    given where a worst case, a yield below 1 or a C_pk below 1 breaks them: errors among the findings.
    Returns a Dataset over (measure, parameter, position, …) of `result.VARIABLES`; SI, each measure in its own unit.
    Method: exact first derivatives by dual numbers; the worst corner of the tolerances found on the mechanism itself;
    Monte Carlo or scrambled Sobol points through the whole analysis; Sobol' indices. Samples that have no answer are
    counted, and are outside every limit.
    Raises MechanismError if nothing varies, for an unknown measure or method, or as `analyse` does.
    """
    from trunnion.analysis.tolerance.result import Outcome, dataset

    _check(methods, samples, seed, engine)
    _check_target(target, methods)
    found = study(mechanism, measures, steps, at, friction)
    worst = found.worst() if "worst-case" in methods else None
    method = next((one for one in methods if one in SAMPLINGS), None)
    job: Sampling | None = None
    tally: Tally | None = None
    shares: Indices | None = None
    notes: list[Finding] = []
    stopped = False
    if method is not None:
        job = found.sampling(method, samples, seed, engine)
        alone = job.samples * job.positions < FEW and cluster is None
        jobs = 1 if jobs is None and (alone or engine != "numpy") else jobs
        ran = runner.run(
            job, jobs=jobs, chunk=chunk, cluster=cluster, checkpoint=checkpoint, resume=resume, progress=progress
        )
        tally, stopped = ran.tally, ran.stopped
        notes += ran.notes
        if stopped:
            what = f"stopped before the end: {done_of(job, tally):,} of {counted(job.samples, 'sample')}"
            remedy = "go on with --resume" if checkpoint is not None else "with --checkpoint FILE what is done is kept"
            notes.append(Finding(what, "samples", remedy, Severity.WARNING))
    if "sobol" in methods:
        # Not turned: each number is to have its own coordinates of the points.
        own = replace(found.sampling("quasi-monte-carlo", samples, seed), rotation=None)
        shares = indices(found.sampler(own), samples, seed)
    return dataset(Outcome(found, tuple(methods), worst, job, tally, shares, stopped, target), [*found.told, *notes])


def done_of(job: Sampling, tally: Tally) -> int:
    """Samples in a tally."""
    return int(sum(np.max(total.count) for tree in tally.trees if (total := tree.total()) is not None))


def _check(methods: Sequence[str], samples: int, seed: int, engine: str) -> None:
    known = ", ".join(METHODS)
    findings = [
        Finding(f"there is no method '{method}'", "method", f"use {known}")
        for method in methods
        if method not in METHODS
    ]
    if sum(method in SAMPLINGS for method in methods) > 1:
        findings.append(Finding("two sampling methods at once", "method", f"take one of {' and '.join(SAMPLINGS)}"))
    if not isinstance(samples, int) or not 1 <= samples <= MOST_SAMPLES:
        remedy = f"give a whole number from 1 to {MOST_SAMPLES:,}, or leave the sampling methods out"
        findings.append(Finding(f"{samples} samples", "samples", remedy))
    if engine not in ENGINES:
        findings.append(Finding(f"there is no engine '{engine}'", "engine", f"use {' or '.join(ENGINES)}"))
    if not 0 <= seed < 1 << 63:
        findings.append(Finding(f"a seed of {seed}", "seed", "give a whole number from 0"))
    if findings:
        raise MechanismError(findings)


def _check_target(target: float | None, methods: Sequence[str]) -> None:
    """MechanismError for a yield that cannot be asked for."""
    if target is None:
        return
    if not 0 < target < 1:
        what = f"a yield of {target:g} cannot be asked for"
        raise MechanismError(Finding(what, "yield", "give a share above 0 and below 1, such as 0.9973"))
    if not any(method in SAMPLINGS for method in methods):
        raise MechanismError(Finding("a yield is one of samples", "yield", f"add the method {' or '.join(SAMPLINGS)}"))


def placed(mechanism: Mechanism, measure: Measure, at: float | str) -> Measure:
    """A measure taken at a place if it has none of its own and no figure of a whole course."""
    if measure.at is not None or measure.over is not None or measure.statistic or measure.rule not in ("deviation",):
        return measure
    remedy = "write 60deg, 20mm or 0.1s, as the driver turns or slides"
    try:
        quantity = Quantity.read(at)
        kind = place_kind(mechanism, quantity, {})
        quantity.check({}, kind)
        value = float(quantity.evaluate())
    except UnitError as error:
        raise MechanismError(Finding(f"'{at}' is no place: {error.what}", "at", remedy)) from None
    except KeyError:
        raise MechanismError(Finding(f"'{at}' is no place", "at", remedy)) from None
    return replace(measure, at=value, timed=kind.unit == "s")
