"""A result of any kind as a figure, a report or the HTML of a notebook: which view it has."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from html import escape
from importlib import import_module
from inspect import signature
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from trunnion.errors import Finding, MechanismError, agreeing
from trunnion.model.arguments import check_keywords, strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import MORE_THAN, findings_of, summary_of, whole
from trunnion.results.quantities import readable
from trunnion.results.tables import kind_of
from trunnion.views.charts import Plot
from trunnion.views.curves import check_kind as one_of
from trunnion.views.page import with_code

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# kind of result: the modules in which its `figure` and its `report` stand; loaded when they are asked for
VIEWS = {
    "cycle": ("cycle", "report"), "motion": ("motion", "report"),
    "sweep": ("sweep", "sweep"), "play": ("play", "play"), "assembly": ("assembly", "assembly"),
    "tolerance": ("tolerance", "tolerance"), "allocation": ("allocation", "allocation"),
    "comparison": ("compare", "compare"), "identification": ("identify", "identify"),
}  # fmt: skip


@strict_arguments
def plot(of: Mechanism | xr.Dataset, kind: str | None = None, **options: Any) -> Figure:
    """A matplotlib Figure of a mechanism at its start, or of a result.

    kind: of a result one of the figures of its view, such as "reactions" of a cycle (`trunnion plot --help` lists
    them); the main one if not given. options: those of the figure, as ideal= (the same run without friction) of a
    cycle. Raises MechanismError for a kind that there is not, or where there is nothing to draw.
    """
    if isinstance(of, Mechanism):
        if kind is not None or options:
            remedy = "analyse it first, and plot the result"
            raise MechanismError(Finding("a mechanism has one drawing", "kind", remedy))
        return of.plot()
    made = view(of, "figure").figure
    _, *parameters = signature(made).parameters
    if kind is not None and "kind" not in parameters:
        raise MechanismError(Finding(f"a result of {kind_of(of)} has one figure", "kind", "leave the kind out"))
    check_keywords(f"plot() of a {kind_of(of)}", options, parameters)
    drawn = made(of, **(options if kind is None else {"kind": kind, **options}))
    if not isinstance(drawn, Plot):  # a drawing of the mechanism
        return drawn  # type: ignore[no-any-return]
    from trunnion.views.draw import figure  # with matplotlib, which is slow to import

    return figure(of, drawn)


@strict_arguments
def report(result: xr.Dataset, ideal: xr.Dataset | None = None, **options: Any) -> str:
    """The report of a result as one HTML page that needs no network.

    ideal: of a cycle, the same run without friction, drawn beside; options: others of its report. Raises MechanismError
    of a result that has no report, ValueError if `ideal` has other positions.
    """
    options |= {} if ideal is None else {"ideal": ideal}
    made = view(result, "report").report
    check_keywords(f"report() of a {kind_of(result)}", options, [*signature(made).parameters][1:])
    return str(made(result, **options))


def check_kind(of: str, kind: str) -> None:
    """MechanismError if a result of some kind (`of`) has no such kind of figure."""
    one_of(kind, import_module(f"trunnion.views.{VIEWS[of][0]}").KINDS)


def view(result: xr.Dataset, what: str) -> Any:
    """The module in which the figure or the report of a whole result stands."""
    whole(result, f"a {what}")
    if kind_of(result) not in VIEWS:
        remedy = f"there are {what}s of {', '.join(VIEWS)}"
        raise MechanismError(Finding(f"there is no {what} of a {kind_of(result)}", "kind", remedy))
    return import_module(f"trunnion.views.{VIEWS[kind_of(result)][what != 'figure']}")


# ---- notebooks ------------------------------------------------------------------------------------------------------

LOOKED_AT = 36  # positions over which findings are looked for: a notebook must not wait
MOST_FIGURES, MOST_FINDINGS = 40, 12  # of a summary
COLOURS = {"error": "#a1260d", "warning": "#8a4b00", "note": "#5a636e"}
CELL = "text-align:left;padding:1px 12px 1px 0;vertical-align:top"


def mechanism_figure(mechanism: Mechanism) -> Figure:
    """The mechanism at the first position of its cycle that can be assembled; MechanismError if there is none."""
    from trunnion.cycle.analyse import drawable
    from trunnion.views.cycle import mechanism as drawing

    result = drawable(mechanism)
    points = result["point_position"].values
    finite = np.flatnonzero(np.isfinite(points).all(axis=tuple(range(points.ndim - 1))))
    return drawing(result, index=int(finite[0]) if finite.size else 0)


def mechanism_html(mechanism: Mechanism) -> str:
    """Name, parts, structural formula, mobility, drawing and findings, without a script.

    What cannot be told of a mechanism that cannot be assembled or driven is left out, and its findings say why: a
    notebook shows what it is given, and an error here would hide the value itself.
    """
    from trunnion.cycle.inspect import check
    from trunnion.views.draw import svg

    kinds = Counter(joint.type for joint in mechanism.effective_joints.values())
    joints = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
    driven = f"driven at {', '.join(mechanism.drivers)}" if mechanism.drivers else "not driven"
    sizes = f"{len(mechanism.effective_links)} links · {sum(kinds.values())} joints ({joints})"
    facts, findings, body = [escape(f"{mechanism.space} · {sizes} · {driven}")], list[Finding](), ""
    try:
        checked = check(mechanism, LOOKED_AT)
        facts.append(f"<code>{escape(checked.formula)}</code>, mobility {checked.mobility}")
        findings = list(checked.findings)
        text = svg(mechanism_figure(mechanism), salt=mechanism.digest)  # its ids apart from those of other drawings
        body = f'<div style="max-width:640px">{text[text.index("<svg") :]}</div>'
    except MechanismError as error:
        findings = findings or list(error.findings)  # that there is nothing to draw, the findings have said better
    except Exception as error:  # what else may go wrong is told too, and by the next call that is asked for an answer
        findings.append(Finding(f"it cannot be shown whole: {type(error).__name__}: {error}"))
    return _html(mechanism.name or "Mechanism", facts, body, findings)


def result_html(result: xr.Dataset) -> str:
    """Name, kind and size of a result, the figures that one looks at first, and its findings."""
    telling = ("position", "measure", "parameter", "condition", "channel")  # of how large a study is
    sizes = [f"{count} {agreeing(count, dim, dim + 's')}" for dim in telling if (count := result.sizes.get(dim))]
    facts = [escape(", ".join([kind_of(result), *sizes]))]
    if formula := result.attrs.get("formula"):
        facts.append(f"<code>{escape(str(formula))}</code>")
    figures, rows = summary_of(result), []
    for subject, parts in groupby(figures[:MOST_FIGURES], key=lambda figure: figure.subject):
        cells = []
        for part in parts:  # with as many digits as the terminal shows: four would hide what a limit is about
            number = "—" if part.value is None else part.value
            text = number if isinstance(number, str) else readable(float(number), part.unit, 7).replace(" ", "\u00a0")
            text = f"> {text}" if part.aspect == MORE_THAN else text
            cells.append(f"<b>{escape(text)}</b>" + (f" {escape(part.remark)}" if part.remark else ""))
        head = f'<th style="{CELL}" scope="row">{escape(subject)}</th>'
        rows.append(f'<tr>{head}<td style="{CELL}">{"; ".join(cells)}</td></tr>')
    more = f"<p>… and {len(figures) - MOST_FIGURES} more figures</p>" if len(figures) > MOST_FIGURES else ""
    table = f"<table>{''.join(rows)}</table>{more}" if rows else ""
    return _html(str(result.attrs.get("name") or "Result"), facts, table, findings_of(result))


def _html(name: str, facts: Sequence[str], body: str, findings: Sequence[Finding]) -> str:
    """A name, facts below one another, and the findings after the body."""
    rows = []
    for finding in findings[:MOST_FINDINGS]:
        where = f"<code>{escape(finding.where)}</code> " if finding.where else ""
        where = f"{finding.kind_of_part} " if finding.kind_of_part else where
        remedy = f" — {with_code(finding.remedy)}" if finding.remedy else ""
        colour = COLOURS.get(str(finding.severity), "inherit")
        what = f'<b style="color:{colour}">{finding.severity}</b> {where}{with_code(finding.what)}{remedy}'
        rows.append(f"<li>{what}</li>")
    listed = f'<ul style="margin:4px 0 0;padding-left:1.2em">{"".join(rows)}</ul>' if rows else ""
    lines, more = "".join(f"<div>{fact}</div>" for fact in facts), len(findings) - MOST_FINDINGS
    listed += f"<p>… and {more} more findings</p>" if more > 0 else ""
    return f'<div class="trunnion"><div style="font-weight:600">{escape(name)}</div>{lines}{body}{listed}</div>'
