"""What a study of tolerances knows before any sample is drawn: measures, what varies, and its first order."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from trunnion.cycle.cycle_kernel import Engine
from trunnion.cycle.positions import check_steps
from trunnion.errors import Finding, MechanismError
from trunnion.measures.evaluation import NumpyKernel
from trunnion.measures.many import Many
from trunnion.measures.measures import Measure, chosen, outputs
from trunnion.measures.positions import PositionPlan, place_of, plan
from trunnion.model.mechanism import Mechanism
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare
from trunnion.studies.tolerance.effects import Effects, effects_of
from trunnion.studies.tolerance.indices import Indices
from trunnion.studies.tolerance.inputs import Inputs, inputs_of
from trunnion.studies.tolerance.kernel import engine_for, kernel_of, many_of
from trunnion.studies.tolerance.linear import Linear, Reference, linear, references, searched
from trunnion.studies.tolerance.sampling import Samples, Sampling, towards
from trunnion.studies.tolerance.search import Corner

__all__ = ["FEW", "Outcome", "ToleranceStudy", "placed", "stated_or_outputs", "study"]


FEW = 10_000_000  # configurations up to which further processes cost more than they save


@dataclass(frozen=True, eq=False)
class ToleranceStudy:
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
    def plan(self) -> PositionPlan:
        """The positions that the measures need."""
        return plan(self.run, self.measures, self.steps)

    @cached_property
    def kernel(self) -> NumpyKernel:
        """The analysis of the mechanism and of others like it."""
        kernel = kernel_of("numpy", self.run, self.measures, self.friction, bool(self.inputs.pressed))
        assert isinstance(kernel, NumpyKernel)
        return kernel

    @cached_property
    def effects(self) -> Effects:
        """Rows of the batch that first order takes."""
        return effects_of(self.inputs)

    @cached_property
    def many(self) -> Many:
        """The measures of the nominal mechanism, to be read of others."""
        return many_of(self.run, self.measures, self.inputs, self.friction, "numpy")

    @cached_property
    def references(self) -> dict[str, Reference]:
        """The measures of the nominal mechanism, at the positions of the plan too."""
        return references(self.kernel, self.plan, self.many)

    @cached_property
    def linear(self) -> Linear:
        """First order of every measure."""
        return linear(self.kernel, self.plan, self.effects, self.references, self.many)

    def worst(self) -> list[tuple[Corner, Corner]]:
        """Least and largest deviation of every measure on the mechanism itself."""
        return [searched(self.many, self.linear, of) for of in self.linear.measures]

    def sampling(self, method: Any, samples: int, seed: int, engine: Engine = "numpy") -> Sampling:
        """The run of a sampling method. engine auto: see `engine_for`."""
        engine = engine_for(engine, self.kernel, self.run.values, samples * len(self.plan.times))
        model, rotation = self.run.system.mechanism.data(), None
        if method == "quasi-monte-carlo" and self.inputs.tolerances:
            rotation = towards(np.array([of.figure.gradient() for of in self.linear.measures]))
        return Sampling(
            model, self.measures, self.steps, method, samples, seed, engine, self.friction, len(self.plan.times),
            rotation, bool(self.inputs.pressed),
        )  # fmt: skip


@dataclass(frozen=True, eq=False)
class Outcome:
    """What the methods that were asked for found; None of those that were not. target: the yield asked for."""

    study: ToleranceStudy
    methods: tuple[str, ...]
    worst: Sequence[tuple[Corner, Corner]] | None = None
    samples: Samples | None = None
    indices: Indices | None = None
    target: float | None = None


def study(
    mechanism: Mechanism,
    measures: Sequence[str] | None = None,
    steps: int = 360,
    at: float | str | None = None,
    friction: FrictionMethod | None = None,
) -> ToleranceStudy:
    """A study of a mechanism. Raises MechanismError as `tolerance` does."""
    check_steps(steps)
    run = prepare(mechanism)
    inputs = inputs_of(run)
    selected, notes = stated_or_outputs(run, chosen(mechanism, measures, run.values))
    if run.determinacy is not None and not all(measure.of_motion for measure in selected):
        run.determinacy.refuse()
    if run.cycle.duration <= 0:  # there is one position
        selected = [replace(one, statistic="value") if one.rule == "deviation" else one for one in selected]
    if at is not None:
        located = [placed(mechanism, measure, at) for measure in selected]
        if all(measure in selected for measure in located):
            what = "every measure has a place, a window or a figure of its own, which this does not change"
            raise MechanismError(Finding(what, "at", "leave it out, or change at: of the measure"))
        selected = located
    return ToleranceStudy(run, inputs, tuple(selected), steps, friction or FrictionMethod(), tuple(notes))


def stated_or_outputs(run: Run, measures: Sequence[Measure]) -> tuple[list[Measure], list[Finding]]:
    """The measures, or outputs with a note if there are none; MechanismError if there is no output either."""
    if measures:
        return list(measures), []
    remedy, outputs_taken = "state measures: in the model, or use --measure link.point.x", outputs(run.system)
    if not outputs_taken:
        what = "no measure is stated, and no joint to the ground is an output"
        raise MechanismError(Finding(what, "measures", remedy))
    names = [measure.name for measure in outputs_taken]
    what = f"the model states no measure; {', '.join(names)} are used (joints to the ground without a driver)"
    return outputs_taken, [Finding.note("measure.none_stated", "measures", what, remedy, measures=names)]


def placed(mechanism: Mechanism, measure: Measure, at: float | str) -> Measure:
    """A measure taken at a place if it has none of its own and no figure of a whole course."""
    if measure.at is not None or measure.over is not None or measure.statistic or measure.rule not in ("deviation",):
        return measure
    value, timed = place_of(mechanism, at)
    return replace(measure, at=value, timed=timed)
