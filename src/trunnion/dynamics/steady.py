"""The steady cycle of a motion in time as a cycle: what `analyse` says, at the speed that the motors give."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from trunnion.cycle import summary
from trunnion.cycle.positions import Positions, positions
from trunnion.dynamics.filling import Filling
from trunnion.dynamics.integrate import MOST_EVALUATIONS
from trunnion.dynamics.repeated import Repeated, motion_law
from trunnion.dynamics.started import DriveCourse
from trunnion.dynamics.state import FreeMotion
from trunnion.dynamics.steady_cycle import INDIFFERENT, SteadyCycle, refuse_unsteady, steady_cycle
from trunnion.errors import Finding, MechanismError, Status
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import encoded, finding_rows, findings_of, summary_of
from trunnion.results.figure import Figure
from trunnion.results.result import Result
from trunnion.results.scales import scales_in
from trunnion.solve.run import prepare

__all__ = ["steady"]

DIFFERS = 1e-3  # of the largest effort: a cycle that is not the one that was found


@np.errstate(all="ignore")
def steady(
    mechanism: Mechanism, duration: float, steps: int, tolerance: float,
    progress: Callable[[float], None] | None = None, evaluations: int = MOST_EVALUATIONS,
) -> Result:  # fmt: skip
    """The steady cycle of a mechanism as `analyse` gives a cycle: with the speed that varies as it was found.

    Positions are equally spaced in time. Raises MechanismError where a cycle cannot be asked for, UnsteadyError where
    there is none.
    """
    refuse_unsteady(mechanism)
    motion = FreeMotion.of(prepare(mechanism))
    if motion.resisted:
        what = "it may stick while others slide, as several drivers are free, which is not followed in a steady cycle"
        remedy = "use friction laws that are smooth at rest (brown-mcphee, dahl, lugre), or leave --steady out"
        raise MechanismError([Finding(what, f"joints.{joint}", remedy) for joint in motion.resisted])
    repeated_cycle = steady_cycle(motion, duration, tolerance, progress, evaluations)
    each = Repeated.of(motion, repeated_cycle.solution)
    moving = mechanism.with_motions(
        {name: motion_law(repeated) for name, repeated in zip(motion.names, each, strict=True)}
    )
    run = prepare(moving)
    at = positions(run, steps, engine="numpy")
    cycle = summary.result_of(run, at)
    missing = _missing(repeated_cycle, at)
    findings = [*findings_of(cycle), *_findings(repeated_cycle, missing)]
    attributes = encoded({
        **cycle.attrs,
        "findings": finding_rows(findings),
        **scales_in(cycle).summary([*_figures(repeated_cycle, each, missing), *summary_of(cycle)]),
        "steady": 1,
    })  # fmt: skip
    return Result(attributes, lambda: cycle.dataset.assign_attrs(attributes))


def _missing(cycle_found: SteadyCycle, at: Positions) -> float:
    """By how much the efforts that the cycle takes differ from those of the motors, of the largest.

    Where a joint is at rest for a moment its friction may act either way: such positions tell nothing.
    """
    efforts_given = Filling(cycle_found.motion, cycle_found.solution, at.time).books().arrays["drive_effort"]
    solved = at.arrays["status"] == Status.SOLVED
    largest = float(np.max(np.abs(efforts_given)))
    return float(np.nanmax(np.abs(at.arrays["drive_effort"] - efforts_given)[:, solved], initial=0.0)) / max(
        largest, 1e-300
    )


def _figures(cycle_found: SteadyCycle, each: Sequence[Repeated], missing: float) -> list[Figure]:
    """What is said of a steady cycle before what is said of any cycle."""
    name, repeated = cycle_found.motion.names[cycle_found.first], each[cycle_found.first]
    course, mean = (
        DriveCourse.of(cycle_found.motion, cycle_found.solution, cycle_found.first),
        abs(repeated.advance) / repeated.period,
    )
    speed = np.abs(course.speed)
    most, least = course.largest(speed), -course.largest(-speed)
    return [
        Figure("cycle_time", "time of the cycle", repeated.period, "s"),
        Figure(f"{name}.speed_mean", f"speed of {name}", mean, "rad/s", "mean"),
        Figure(f"{name}.speed_max", f"speed of {name}", most, "rad/s", "largest"),
        Figure(f"{name}.speed_min", f"speed of {name}", least, "rad/s", "smallest"),
        Figure(f"{name}.fluctuation", f"coefficient of fluctuation of {name}", (most - least) / mean, "1"),
        Figure("decay", "what is left of a difference after a cycle", cycle_found.factor, "1"),
        Figure("repeats", "by how much the end misses the begin", cycle_found.residual, "1", "of the state"),
        Figure("efforts_differ", "efforts of cycle and motors, difference", missing, "1", "of the largest"),
    ]


def _findings(cycle_found: SteadyCycle, missing: float) -> Iterator[Finding]:
    if cycle_found.factor > 1.0 + INDIFFERENT:
        what = (
            f"the steady cycle is not stable: a difference from it grows by the factor {cycle_found.factor:.4g} with "
        )
        what += "every cycle"
        remedy = "run it without --steady to see how it leaves this cycle"
        where = f"drivers.{cycle_found.motion.names[cycle_found.first]}"
        figures = {"factor": cycle_found.factor}
        yield Finding.warning("simulate.unstable", where, what, remedy, **figures)
    if not missing <= DIFFERS:
        what = f"the cycle takes efforts that differ from those of the motors by up to {missing:.2g} of the largest: "
        what += "it is not the motion that was found"
        remedy = "run it without --steady to see the motion from its start"
        yield Finding.error("simulate.cycle_differs", "", what, remedy, share=missing)
