"""Figures of measures of a mechanism and of others like it, for the tests of measures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from trunnion.measures.figures import Reference, figure, reference
from trunnion.measures.measures import Measure
from trunnion.measures.positions import PositionPlan, plan
from trunnion.solve.friction_method import MARGIN, FrictionMethod
from trunnion.solve.run import Run

__all__ = ["courses", "figures", "references"]


def references(run: Run, measures: Sequence[Measure], steps: int) -> tuple[PositionPlan, dict[str, Reference]]:
    """The positions of measures, and what they are of the nominal mechanism."""
    found = plan(run, measures, steps)
    back = run.solve(found.times, method=FrictionMethod(margin_up_to=MARGIN))
    return found, {
        one.name: reference(one, one.curve(back), found.windows[one.name], run.system, one.rate_of_course(back.walk))
        for one in measures
    }


def courses(
    run: Run, positions: PositionPlan, measures: Sequence[Measure], changes: Mapping[str, Any]
) -> dict[str, Any]:
    """The courses of mechanisms with other numbers."""
    values = run.system.mechanism.parameters(changes) if changes else run.values
    back = run.solve(positions.moved(values), values, FrictionMethod(margin_up_to=MARGIN))
    return {one.name: one.curve(back) for one in measures}


def figures(
    run: Run, measures: Sequence[Measure], steps: int = 360, changes: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """The figures of measures by name: of the nominal mechanism, or of others with numbers changed."""
    positions, nominal = references(run, measures, steps)
    if changes is None:
        return {name: one.figure for name, one in nominal.items()}
    return {name: figure(curve, nominal[name]) for name, curve in courses(run, positions, measures, changes).items()}
