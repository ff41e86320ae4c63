"""Figures of a cycle as the page has them, and of two variants beside each other.

A variant is another text, or the same without friction.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from trunnion.errors import MechanismError
from trunnion.measures.many import figures_of
from trunnion.measures.measures import Measure, outputs
from trunnion.results.attributes import summary_of, units_of
from trunnion.results.figure import MORE_THAN, Figure
from trunnion.results.quantities import Units, quantity
from trunnion.solve.friction_method import FrictionMethod
from trunnion.studio.loaded import Asked, Loaded
from trunnion.studio.margin import margin_of
from trunnion.views.common.cycle import abscissa
from trunnion.views.cycle.scene import scene

__all__ = ["compared", "figures", "worded"]


def figures(asked: Asked) -> list[Figure]:
    """The figures one looks at first, without those of the solution: of the result, and time ratios."""
    found = [one for one in summary_of(asked.result) if not one.numerical]
    return found + [
        Figure(f"{joint}.time_ratio", f"time ratio of {joint}", ratio) for joint, ratio in _ratios(asked.state)
    ]


@lru_cache(maxsize=8)
def _ratios(state: Loaded) -> tuple[tuple[str, float], ...]:
    """Time ratios of what slides on the ground, or where nothing does of what turns back on it."""
    run = state.run
    found = [] if run.seats or run.cycle.duration <= 0 else outputs(run.system)
    found = [one for one in found if one.kind == "slide"] or found
    measures = [Measure(one.subject, "time_ratio", one.subject) for one in found]
    ratios = figures_of(run, measures, FrictionMethod()) if measures else {}
    return tuple((joint, float(ratio)) for joint, ratio in ratios.items() if np.isfinite(ratio))


def worded(figure: Figure | None, units: Units) -> str:
    """A figure with its unit, or a dash."""
    if figure is None or figure.value is None:
        return "—"
    text = figure.value if isinstance(figure.value, str) else quantity(figure.value, figure.unit, units)
    return f"> {text}" if figure.aspect == MORE_THAN else text


def compared(variant: Asked, present: Asked) -> dict[str, Any]:
    """A variant to lay over the present result, and the table of the figures of both.

    Returns
    -------
    dict
        rows: label, values a and b in SI units (None where there is none), texts of both and of the change; scene,
        margin: of the variant, None where `why` says that it has no cycle, or none over the same positions of a drive.
    """
    try:
        result = variant.result
    except MechanismError as error:
        first = error.findings[0]
        return {"scene": None, "why": f"cannot be solved: {first.where} {first.what}".strip(), "rows": []}
    own, over = abscissa(result), abscissa(present.result)
    same = (own.label, own.unit, own.values.shape) == (over.label, over.unit, over.values.shape)
    if not same or not np.allclose(own.values, over.values, rtol=1e-9, atol=1e-12):
        why = "runs over other positions of the drive than the present one: its curves cannot be laid over"
        return {"scene": None, "why": why, "rows": _rows(variant, present)}
    return {
        "scene": scene(result, None, max_positions=result.sizes["position"]),
        "margin": margin_of(result, variant.rubs)["margin"],
        "why": None,
        "rows": _rows(variant, present),
    }


def _rows(variant: Asked, present: Asked) -> list[dict[str, Any]]:
    before, units = {one.name: one for one in figures(variant)}, units_of(present.result)
    rows = []
    for one in figures(present):
        other = before.get(one.name)
        values = [None if figure is None else figure.value for figure in (other, one)]
        a, b = (float(value) if isinstance(value, float) else np.nan for value in values)
        bound = any(figure is not None and figure.aspect == MORE_THAN for figure in (other, one))
        change = "—" if bound or not np.isfinite(a + b) or a == 0 else f"{100 * (b - a) / abs(a):+.1f} %"
        label = ", ".join(part for part in (one.subject, one.aspect.replace(MORE_THAN, "minimum")) if part)
        texts = [worded(other, units), worded(one, units), change.replace("-", "−")]
        rows.append({"label": label, "a": values[0], "b": values[1], "texts": texts})
    return rows
