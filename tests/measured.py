"""Figures of measures of a mechanism and of others like it, for the tests of measures."""

from collections.abc import Mapping, Sequence
from typing import Any

from trunnion.measures.evaluation import NumpyKernel
from trunnion.measures.many import Many, Read
from trunnion.measures.measures import Measure
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run


def many(run: Run, measures: Sequence[Measure]) -> Many:
    """Measures of the nominal mechanism, to be read of others."""
    return Many(run, measures, run.values, lambda some: NumpyKernel(run, some, FrictionMethod()))


def reads(run: Run, measures: Sequence[Measure], changes: Mapping[str, Any], steps: int = 0) -> dict[str, Read]:
    """What the courses of mechanisms with other numbers say; at so many times of the cycle too."""
    values = run.system.mechanism.parameters(changes)
    times = dict.fromkeys((one.name for one in measures), run.cycle.times(steps)) if steps else {}
    return many(run, measures).read(values, times)


def figures(
    run: Run, measures: Sequence[Measure], steps: int = 360, changes: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """The figures of measures by name: of the nominal mechanism, or of others with numbers changed."""
    if changes is None:
        return dict(many(run, measures).figures)
    return {name: read.figure for name, read in reads(run, measures, changes).items()}
