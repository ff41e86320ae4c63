"""Figures of a cycle as the page has them."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from trunnion.measures.many import figures_of
from trunnion.measures.measures import Measure, outputs
from trunnion.results.attributes import summary_of, units_of
from trunnion.results.figure import MORE_THAN, Figure
from trunnion.results.quantities import quantity
from trunnion.solve.friction_method import FrictionMethod
from trunnion.studio.loaded import Asked, Loaded

__all__ = ["figures"]


def figures(asked: Asked) -> list[dict[str, Any]]:
    """The figures one looks at first, without those of the solution: of the result, and time ratios.

    Returns
    -------
    list
        name: by which that of another model is found; label; title: without its place; text: with its unit; value: SI,
        None where there is none, or nothing but a bound.
    """
    units = units_of(asked.result)
    found = [one for one in summary_of(asked.result) if not one.numerical]
    ratios = [Figure(f"{joint}.time_ratio", f"time ratio of {joint}", ratio) for joint, ratio in _ratios(asked.state)]
    rows = []
    for one in (*found, *ratios):
        bound = one.aspect == MORE_THAN
        text = one.value if isinstance(one.value, str) else quantity(one.value, one.unit, units) or "—"
        rows.append({
            "name": one.name,
            "label": one.label,
            "title": ", ".join(part for part in (one.subject, "minimum" if bound else one.aspect) if part),
            "text": f"> {text}" if bound else text,
            "value": None if bound or isinstance(one.value, str) else one.value,
        })  # fmt: skip
    return rows


@lru_cache(maxsize=8)
def _ratios(state: Loaded) -> tuple[tuple[str, float], ...]:
    """Time ratios of what slides on the ground, or where nothing does of what turns back on it."""
    run = state.run
    found = [] if run.seats or run.cycle.duration <= 0 else outputs(run.system)
    found = [one for one in found if one.kind == "slide"] or found
    measures = [Measure(one.subject, "time_ratio", one.subject) for one in found]
    ratios = figures_of(run, measures, FrictionMethod()) if measures else {}
    return tuple((joint, float(ratio)) for joint, ratio in ratios.items() if np.isfinite(ratio))
