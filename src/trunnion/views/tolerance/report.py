"""What tolerances do, as one HTML file that opens and prints anywhere without a network or a script.

Every figure is an SVG inside the page. The content security policy allows these and the one style, named by its hash,
and nothing else, so no name in a model can become code.
"""

from __future__ import annotations

import base64
from collections.abc import Sequence
from functools import cache
from io import BytesIO
from typing import TYPE_CHECKING, Any, NamedTuple

from matplotlib import rc_context

from trunnion.results.attributes import attribute
from trunnion.views.common.bundle import web_text
from trunnion.views.common.markup import with_code
from trunnion.views.cycle.report import inputs_of, said
from trunnion.views.tolerance.figure import KINDS, drawable, figure
from trunnion.views.tolerance.notes import NOTES, ON_SAMPLES
from trunnion.views.tolerance.readings import MeasureReading, methods, readings
from trunnion.views.tolerance.tables import (
    TextTable,
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
    from jinja2 import Template
    from matplotlib.figure import Figure

__all__ = ["Section", "report", "source", "template"]


class Section(NamedTuple):
    """A part of the page: a title, what it is about, figures with what they show in words, tables."""

    title: str
    about: str
    figures: Sequence[tuple[str, Figure]]
    tables: Sequence[TextTable]


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
        "overview": overview(result), "sections": [_drawn(part) for part in parts], "whole": failed(result),
        "toleranced": inputs(result), "inputs": inputs_of(result),
        "methods": [NOTES[name] for name in run if name in NOTES],
        "on_samples": ON_SAMPLES if any("monte-carlo" in name for name in run) else "",
        **stated,
    }  # fmt: skip
    return template("tolerance.html.j2").render(context)


@cache
def template(name: str) -> Template:
    """A page of `views/web`, which may import the others."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True, loader=FunctionLoader(web_text)
    )
    environment.filters["code"] = lambda text: Markup(with_code(text))
    return environment.get_template(name)


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


def _drawn(part: Section) -> dict[str, Any]:
    pictures = [{"alt": alt, "source": source(drawn)} for alt, drawn in part.figures]
    return {"title": part.title, "about": part.about, "pictures": pictures, "tables": part.tables}


def source(drawn: Figure) -> str:
    """A figure as an address that holds it."""
    buffer = BytesIO()
    with rc_context({"svg.hashsalt": "trunnion"}):
        drawn.savefig(buffer, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode()
