"""An identification as one HTML file that opens and prints anywhere without a network or a script.

Every figure is an SVG inside the page. The content security policy allows these and the one style, named by its hash,
and nothing else, so no name in a model or a file can become code.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.results.attributes import attribute
from trunnion.results.quantities import number
from trunnion.views.common.bundle import web_text
from trunnion.views.compare.report import of_file
from trunnion.views.compare.tables import files
from trunnion.views.identify.figure import figure
from trunnion.views.identify.identification import estimates
from trunnion.views.identify.tables import budget, correlations, estimated, fits, held_out, sensors, stated
from trunnion.views.page import inputs_of, said, source, template
from trunnion.views.table import Table

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["report"]

FEW = 2  # estimates whose correlation needs no picture
DEFINITIONS = (
    (
        "Estimate",
        "The values that minimise Σ w (ȳ − (1 + g) f − z)² + Σ a²: ȳ the means over the turns, f the model, g and z "
        "the errors of gain and zero of each sensor, a the same in their stated standard uncertainties. The weights w "
        "are 1 over the variance of the mean, by the scatter between turns and its correlation along a turn.",
    ),
    (
        "Standard uncertainty",
        "From the contribution of each turn to the estimate, whatever the correlation within it (type A), and from the "
        "stated uncertainties of zero, gain and resolution (type B), both with the exact derivatives of the model. "
        "Where the model does not fit, or the conditions disagree, the remaining deviation is added.",
    ),
    (
        "Interval",
        "It holds the true value in 95 of 100 such experiments if the model is right: estimate ± t u, Student's t for "
        "the effective degrees of freedom (Welch and Satterthwaite, GUM G.4.1). At a bound it is one-sided.",
    ),
    (
        "Reduced χ²",
        "Mean square of the residuals relative to that expected from the scatter between turns, frequency by "
        "frequency along the cycle: near 1 if the model fits.",
    ),
    (
        "Not identifiable",
        "Parameters with the same effect on the data have no estimate; a finding names the combinations that are "
        "determined.",
    ),
)


def report(result: xr.Dataset) -> str:
    """The whole report as HTML."""
    style = web_text("report.css") + web_text("tolerance.css") + web_text("compare.css")
    context: dict[str, Any] = {
        "name": str(result.attrs["identified"]) or "Measurement", "model": str(result.attrs["name"]) or "model",
        "formula": str(result.attrs["formula"]), "facts": _facts(result), "summary": _summary(result),
        "sections": _sections(result), "done": attribute(result, "done"),
        "files": files(result, "data_files"), "definitions": DEFINITIONS,
        "data_findings": [of_file(row) for row in attribute(result, "data_findings")],
        "parameters": stated(result), "inputs": inputs_of(result) if "inputs" in result.attrs else [],
        **said(result, style),
    }  # fmt: skip
    return template("identify.html.j2").render(context)


def _facts(result: xr.Dataset) -> list[tuple[str, str]]:
    """(figure, what it counts)."""
    counts = [(result.sizes["parameter"], "parameter"), (result.sizes["channel"], "channel")]
    counts += [(result.sizes["condition"], "condition"), (int(result["used"].sum()), "position")]
    return [(f"{count:,}", f"{what}{'' if count == 1 else 's'}") for count, what in counts]


def _summary(result: xr.Dataset) -> list[tuple[str, list[tuple[str, str]]]]:
    """The first estimates, and whether the model fits."""
    rows = [(one.short, [_told(one)]) for one in estimates(result)[:MOST_TILES]]
    chi = float(result["reduced_chi_squared"])
    if np.isfinite(chi):
        rows.append(("reduced χ²", [(number(chi, 3), "near 1 if the model fits")]))
    return rows


MOST_TILES = 8


def _told(one: Any) -> tuple[str, str]:
    if not one.told:
        return "not identifiable", "from these data"
    if one.limit:
        return one.say(one.value), "at its bound"
    return one.say(one.value), f"± {one.say(one.half)}, 95 %"


def _sections(result: xr.Dataset) -> list[dict[str, Any]]:
    """Parts of the page: a title, what it is about, a picture, tables."""
    told = [one for one in estimates(result) if one.told]
    several = correlations(result)
    held = held_out(result)
    unheld = "Measured minus model over the cycle, before and after the fit."
    found = [
        _section("Estimates", result, "intervals", [estimated(result), budget(result), sensors(result)]),
        _section("Correlation", result, "correlation" if len(told) > FEW else "", [several]) if several else None,
        _section("Residuals", result, "residuals", [fits(result)], unheld),
        _section("Held out", result, "", [held], "Data not used in the fit, and the error of their prediction.")
        if held
        else None,
    ]
    return [one for one in found if one is not None]


def _section(title: str, result: xr.Dataset, kind: str, tables: list[Table | None], about: str = "") -> dict[str, Any]:
    picture = {"alt": title, "source": source(figure(result, kind))} if kind else None
    return {"title": title, "about": about, "picture": picture, "tables": [one for one in tables if one is not None]}
