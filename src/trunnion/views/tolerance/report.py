"""What tolerances do, as one HTML file that opens and prints anywhere without a network or a script.

Every figure is an SVG inside the page. The content security policy allows these and the one style, named by its hash,
and nothing else, so no name in a model can become code.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from trunnion.results.attributes import attribute
from trunnion.views.common.bundle import web_text
from trunnion.views.common.page import Section, drawn, inputs_of, said, template
from trunnion.views.tolerance.figure import KINDS, drawable, figure
from trunnion.views.tolerance.notes import NOTES, ON_SAMPLES
from trunnion.views.tolerance.readings import MeasureReading, methods, readings
from trunnion.views.tolerance.tables import (
    contributions,
    corners,
    failed,
    figures,
    headline,
    indices,
    inputs,
    overview,
)

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["report"]


def report(result: xr.Dataset, first: Sequence[Section] = (), kicker: str = "Tolerance analysis of a linkage") -> str:
    """The whole report as HTML; first: parts that stand before those of the measures, as an allocation has them."""
    style = web_text("report.css") + web_text("tolerance.css")
    reads, run = readings(result), methods(result)
    parts = [*first, *(_measure(result, read) for read in reads)]
    stated = said(result, style)
    first_lines = set(attribute(result, "missed"))  # what is wrong stands first, once, with its remedy
    missed = [row for row in stated["findings"] if f"{row['where']}: {row['what']}".lstrip(": ") in first_lines]
    stated["findings"] = [row for row in stated["findings"] if row not in missed]
    context: dict[str, Any] = {
        "kicker": kicker, "name": str(result.attrs.get("name", "")) or "Mechanism",
        "formula": str(result.attrs.get("formula", "")), "facts": _facts(result, run),
        "summary": headline(result), "missed": missed,
        "overview": overview(result), "sections": [drawn(part) for part in parts], "whole": failed(result),
        "toleranced": inputs(result), "inputs": inputs_of(result),
        "methods": [NOTES[name] for name in run if name in NOTES],
        "on_samples": ON_SAMPLES if any("monte-carlo" in name for name in run) else "",
        **stated,
    }  # fmt: skip
    return template("tolerance.html.j2").render(context)


def _facts(result: xr.Dataset, run: Sequence[str]) -> list[tuple[str, str]]:
    """(figure, what it counts) of the run."""
    counts = [(result.sizes["measure"], "measure"), (result.sizes["parameter"], "toleranced parameter")]
    found = [(f"{count:,}", f"{what}{'' if count == 1 else 's'}") for count, what in counts]
    if any("monte-carlo" in name for name in run):
        count = int(result["samples"].values) if "samples" in result else int(result.attrs.get("samples", 0))
        found.append((f"{count:,}".replace(",", "\u202f"), "samples"))
        found.append((f"seed {result.attrs.get('seed', '')}", ""))
    return [*found, ("", ", ".join(NOTES[name][0] for name in run if name in NOTES))]


def _measure(result: xr.Dataset, read: MeasureReading) -> Section:
    """What there is of one measure."""
    about = "; ".join(part for part in (read.text, f"limits {read.told_limits}" if read.limited else "") if part)
    pictures = [(f"{KINDS[kind].title} of {read.name}", figure(result, kind, [read.name])) for kind in drawable(read)]
    told = [figures(read)._replace(title="results")]
    if read.has("contribution_worst_case"):
        told.append(contributions(read, short=True))
    if read.has("total_order"):
        told.append(indices(read, short=True))
    corner = corners(read)
    return Section(read.name, about, pictures, [*told, *([corner] if corner else [])])
