"""A comparison as one HTML file to be filed: it opens and prints anywhere without a network or a script.

Every figure is an SVG inside the page. The content security policy allows these and the one style, named by its hash,
and nothing else, so no name in a model or a file can become code.
"""

from __future__ import annotations

import re
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.results.attributes import attribute
from trunnion.views.common.bundle import web_text
from trunnion.views.common.cycle import names
from trunnion.views.compare.comparison import label, units
from trunnion.views.compare.figure import efficiency, panels, small
from trunnion.views.compare.notes import definitions
from trunnion.views.compare.tables import (
    conditions,
    efficiencies,
    explained,
    files,
    headline,
    results,
    sensors,
    verdicts,
)
from trunnion.views.page import inputs_of, said, source, template

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MOST_DRAWN", "of_file", "report"]

MOST_DRAWN = 6  # conditions of a channel


def report(result: xr.Dataset) -> str:
    """The whole report as HTML."""
    from markupsafe import Markup  # with jinja2 only needed here, and slow to import

    style = web_text("report.css") + web_text("tolerance.css") + web_text("compare.css")
    table = efficiencies(result)
    context: dict[str, Any] = {
        "name": str(result.attrs["comparing"]) or "Measurement", "model": str(result.attrs["name"]) or "model",
        "formula": str(result.attrs["formula"]), "facts": _facts(result), "summary": headline(result),
        "data_findings": [of_file(row) for row in attribute(result, "data_findings")],
        "efficiency": table,
        "picture": _picture("Measured and modelled efficiency", efficiency(result)) if table else None,
        "verdicts": verdicts(result), "conditions": conditions(result), "sensors": sensors(result),
        "files": files(result), "done": attribute(result, "done"),
        "channels": [_channel(result, i, name) for i, name in enumerate(names(result, "channel"))],
        "definitions": [(term, Markup(_lowered(text))) for term, text in definitions(result)],
        "inputs": inputs_of(result),
        **said(result, style),
    }  # fmt: skip
    return template("compare.html.j2").render(context)


def of_file(row: dict[str, str]) -> dict[str, str]:
    """A finding about data with the name of its file."""
    return {**row, "where": " ".join(part for part in (Path(row["file"]).name, row["where"]) if part)}


def _lowered(text: str) -> str:
    """A text for the page with its indices, written behind a low line, set low."""
    return re.sub(r"_([a-z]+)", r"<sub>\1</sub>", escape(text, quote=False))


def _facts(result: xr.Dataset) -> list[tuple[str, str]]:
    """(figure, what it counts)."""
    counts = [(result.sizes["condition"], "condition"), (result.sizes["channel"], "channel")]
    counts += [(result.sizes["position"], "position")]
    return [(f"{count:,}", f"{what}{'' if count == 1 else 's'}") for count, what in counts]


def _picture(alt: str, drawn: Any) -> dict[str, str]:
    return {"alt": alt, "source": source(drawn)}


def _channel(result: xr.Dataset, channel: int, name: str) -> dict[str, Any]:
    """The courses of one channel; of many conditions those with the largest residuals for their uncertainty."""
    there = [k for _, k in panels(result, name)]
    shown = there
    if len(there) > MOST_DRAWN:
        worst = {k: _severity(result, channel, k) for k in there}
        shown = sorted(sorted(there, key=lambda k: -worst[k])[:MOST_DRAWN])
    unit = units(result)[channel]
    about = [f"measures {attribute(result, 'channel_measures')[channel]}{f', {unit}' if unit != '1' else ''}"]
    if len(shown) < len(there):
        about.append(
            f"{len(shown)} of {len(there)} conditions are drawn, those with the largest residuals for their uncertainty"
        )
    pictures = [_picture(f"{name}, {label(result, k)}", small(result, channel, k)) for k in shown]
    return {
        "title": name,
        "about": "; ".join(about),
        "pictures": pictures,
        "table": results(result, channel),
        "explained": explained(result, channel),
    }


def _severity(result: xr.Dataset, channel: int, condition: int) -> float:
    """Root mean square of the residual in expanded uncertainties; of an unknown one in its own unit."""
    residual, wide = (result[name].values[channel, condition] for name in ("residual", "expanded"))
    there = np.isfinite(residual)
    if not there.any():
        return -1.0
    scale = np.where(np.isfinite(wide) & (wide > 0), wide, 1.0)
    return float(np.sqrt(np.mean((residual / scale)[there] ** 2)))
