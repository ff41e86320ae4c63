"""The question of tolerances: what the scatter of a mechanism's numbers does to measures, and which of them does it."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Literal

import numpy as np

from trunnion.cycle.cycle_kernel import Engine
from trunnion.errors import Finding, MechanismError
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.solve.friction_method import FrictionMethod
from trunnion.studies import batch
from trunnion.studies.tolerance.sampling import METHODS as SAMPLINGS
from trunnion.studies.tolerance.sampling import Samples, Sampling, indices

if TYPE_CHECKING:
    import xarray as xr

from trunnion.cycle.positions import check_steps
from trunnion.studies.tolerance.findings import Outcome
from trunnion.studies.tolerance.linear import study
from trunnion.studies.tolerance.result import dataset

Method = Literal["linear", "worst-case", "monte-carlo", "quasi-monte-carlo", "sobol"]
DEFAULT_METHODS: tuple[Method, ...] = ("linear", "worst-case", "monte-carlo")
DEFAULT_SAMPLES = 10_000
FEW = 10_000_000  # configurations up to which further processes cost more than they save
MOST_SAMPLES = 10**8  # whose figures are kept, 9 bytes a measure


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def tolerance(
    mechanism: Mechanism,
    measures: Sequence[str] | None = None,
    methods: Sequence[Method] = DEFAULT_METHODS,
    samples: int = DEFAULT_SAMPLES,
    seed: int = 1,
    steps: int = 360,
    at: float | str | None = None,
    *,
    friction_method: FrictionMethod | None = None,
    jobs: int | None = None,
    engine: Engine = "auto",
    cluster: str | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: Callable[[int], None] | None = None,
    target: float | None = None,
) -> xr.Dataset:
    """What the tolerances and plays of a mechanism do to measures: limits, scatter, yield, and what each contributes.

    Exact first derivatives by dual numbers; the worst corner of the tolerances found on the mechanism itself; Monte
    Carlo or scrambled Sobol points through the whole analysis; Sobol' indices. Samples that have no answer are counted,
    and are outside every limit.

    Parameters
    ----------
    measures
        Names of the model's, or as on the command line (`measures.named`); all of the model if not given, or, where it
        states none, rotation and slide of every joint to the ground that is not driven.
    methods
        See `Method`.
    samples, seed
        Of the sampling method, and of the variance-based indices; of its random numbers.
    steps, at
        Positions of a whole cycle; the place (driver coordinate or time) of measures that state none and no figure.
    friction_method
        How friction and reactions are settled; Newton's method if not given.
    jobs, cluster, checkpoint
        Processes, one a core if not given and worth it; see `batch.run`.
    engine
        numpy, compiled, or auto: compiled where it pays and can do the mechanism.
    progress
        Called with the samples done.
    target
        The yield that is asked for: limits are missed below it. If none is given, they are where a worst case, a yield
        below 1 or a C_pk below 1 breaks them: errors among the findings.

    Returns
    -------
    Dataset
        Over (measure, parameter, position, …), of `result.VARIABLES`; SI, each measure in its own unit.

    Raises
    ------
    MechanismError
        Nothing varies, a measure or method is unknown, or as `analyse` does.
    """
    methods, trouble = tuple(dict.fromkeys(methods)), list[Finding]()
    _check(methods, samples, seed, target)
    check_steps(steps)
    prepared = study(mechanism, measures, at, friction_method)
    worst = prepared.worst() if "worst-case" in methods else None
    drawn, shares = None, None
    if (method := next((sampling for sampling in methods if sampling in SAMPLINGS), None)) is not None:
        # the workers of a cluster may have no other
        job = prepared.sampling(method, samples, seed, "numpy" if cluster and engine == "auto" else engine, steps)
        drawn, trouble = sample(job, jobs, cluster, checkpoint, progress)
    if "sobol" in methods:
        # each number is to have its own coordinates of the points
        plain = replace(prepared.sampling("quasi-monte-carlo", samples, seed, engine), rotation=None)
        shares = indices(plain.prepare(), samples, seed)
    return dataset(Outcome(prepared, steps, tuple(methods), worst, drawn, shares, target), [*prepared.notes, *trouble])


def sample(
    job: Sampling,
    jobs: int | None = None,
    cluster: str | None = None,
    checkpoint: str | os.PathLike[str] | None = None,
    progress: Callable[[int], None] | None = None,
) -> tuple[Samples, list[Finding]]:
    """All samples of a run, and what there is to say of its checkpoint. jobs: one a core if not given and worth it."""
    if jobs is None:
        jobs = 1 if job.work < FEW and cluster is None else None

    def tell(share: float) -> None:
        if progress is not None:
            progress(round(share * job.samples))

    try:
        parts, trouble = batch.run(
            job, jobs=jobs, threads=job.engine == "compiled", cluster=cluster, checkpoint=checkpoint, progress=tell
        )
    except KeyboardInterrupt:
        hint = (f"samples are in {checkpoint}: the same command goes on from them",) if checkpoint else ()
        raise KeyboardInterrupt(*hint) from None
    return job.joined(parts), trouble


def _check(methods: Sequence[str], samples: int, seed: int, target: float | None) -> None:
    findings = [] if methods else [Finding("no method is chosen", "method", "name one, or leave it out for three")]
    if sum(method in SAMPLINGS for method in methods) > 1:
        findings.append(Finding("two sampling methods at once", "method", f"use one of {' and '.join(SAMPLINGS)}"))
    drawn = any(method in (*SAMPLINGS, "sobol") for method in methods)
    if not (1 if drawn else 0) <= samples <= MOST_SAMPLES:
        remedy = f"give a whole number from 1 to {MOST_SAMPLES:,}, or leave the sampling methods out"
        findings.append(Finding(f"{samples} samples", "samples", remedy))
    if not 0 <= seed < 1 << 63:
        findings.append(Finding(f"a seed of {seed}", "seed", "give a whole number from 0"))
    findings += check_share(target)
    if target is not None and not any(method in SAMPLINGS for method in methods):
        findings.append(Finding("a yield is one of samples", "yield", f"add the method {' or '.join(SAMPLINGS)}"))
    if findings:
        raise MechanismError(findings)


def check_share(share: float | None) -> list[Finding]:
    """What is wrong with a yield that is asked for."""
    if share is None or 0 < share < 1:
        return []
    what = f"a yield of {share:g} is not possible"
    return [Finding(what, "yield", "give a share above 0 and below 1, such as 0.9973")]
