"""What a notebook shows of a mechanism and of a result: plain HTML with an inline drawing, no script."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Iterable, Sequence
from html import escape
from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np
from matplotlib import rc_context

from trunnion.cycle.analyse import drawable
from trunnion.cycle.inspect import check
from trunnion.errors import Finding, MechanismError, agreeing
from trunnion.model.mechanism import Mechanism
from trunnion.results.attributes import findings_of, summary_of
from trunnion.results.figure import MORE_THAN
from trunnion.results.quantities import readable
from trunnion.results.tables import kind_of
from trunnion.views.cycle import plots
from trunnion.views.page import with_code

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

__all__ = ["mechanism_figure", "mechanism_html", "result_html"]

LOOKED_AT = 36  # positions over which findings are looked for: a notebook must not wait
MOST_FIGURES = 40  # of a summary
MOST_FINDINGS = 12
COLOURS = {"error": "#a1260d", "warning": "#8a4b00", "note": "#5a636e"}
CELL = "text-align:left;padding:1px 12px 1px 0;vertical-align:top"


def mechanism_figure(mechanism: Mechanism) -> Figure:
    """The mechanism at the first position of its cycle that can be assembled; MechanismError if there is none."""
    result = drawable(mechanism)
    points = result["point_position"].values
    finite = np.flatnonzero(np.isfinite(points).all(axis=tuple(range(points.ndim - 1))))
    return plots.mechanism(result, index=int(finite[0]) if finite.size else 0)


def mechanism_html(mechanism: Mechanism) -> str:
    """Name, parts, structural formula, mobility, drawing and findings.

    What cannot be told of a mechanism that cannot be assembled or driven is left out, and its findings say why: a
    notebook shows what it is given, and an error here would hide the value itself.
    """
    kinds = Counter(joint.type for joint in mechanism.effective_joints.values())
    joints = ", ".join(f"{count} {kind}" for kind, count in kinds.items())
    driven = f"driven at {', '.join(mechanism.drivers)}" if mechanism.drivers else "not driven"
    sizes = f"{len(mechanism.effective_links)} links · {sum(kinds.values())} joints ({joints})"
    facts, findings, drawing = [escape(f"{mechanism.space} · {sizes} · {driven}")], [], ""
    try:
        checked = check(mechanism, LOOKED_AT)
        facts.append(f"<code>{escape(checked.formula)}</code>, mobility {checked.mobility}")
        findings, text = list(checked.findings), io.StringIO()
        with rc_context({"svg.hashsalt": mechanism.digest}):  # keeps its ids apart from those of other drawings
            mechanism_figure(mechanism).savefig(text, format="svg", metadata={"Date": None})
        drawing = f'<div style="max-width:640px">{text.getvalue()[text.getvalue().index("<svg") :]}</div>'
    except MechanismError as error:
        findings = findings or list(error.findings)  # that there is nothing to draw, the findings have said better
    except Exception as error:  # what else may go wrong is told too, and by the next call that is asked for an answer
        findings.append(Finding(f"it cannot be shown whole: {type(error).__name__}: {error}"))
    return _page(mechanism.name or "Mechanism", facts, drawing, findings)


def result_html(result: xr.Dataset) -> str:
    """Name, kind and size of a result, the figures that one looks at first, and its findings."""
    telling = ("position", "measure", "parameter", "condition", "channel")  # of how large a study is
    sizes = [
        f"{result.sizes[dim]} {agreeing(result.sizes[dim], dim, dim + 's')}" for dim in telling if dim in result.sizes
    ]
    facts = [escape(", ".join([kind_of(result), *sizes]))]
    if formula := result.attrs.get("formula"):
        facts.append(f"<code>{escape(str(formula))}</code>")
    figures, rows = summary_of(result), []
    for subject, members in groupby(figures[:MOST_FIGURES], key=lambda figure: figure.subject):
        cells = []
        for member in members:  # with as many digits as the terminal shows: four would hide what a limit is about
            number = "—" if member.value is None else member.value
            text = number if isinstance(number, str) else readable(float(number), member.unit, 7).replace(" ", "\u00a0")
            text = f"> {text}" if member.aspect == MORE_THAN else text
            cells.append(f"<b>{escape(text)}</b>" + (f" {escape(member.remark)}" if member.remark else ""))
        head = f'<th style="{CELL}" scope="row">{escape(subject)}</th>'
        rows.append(f'<tr>{head}<td style="{CELL}">{"; ".join(cells)}</td></tr>')
    table = f"<table>{''.join(rows)}</table>{_more(len(figures) - MOST_FIGURES, 'figures')}" if rows else ""
    return _page(str(result.attrs.get("name") or "Result"), facts, table, findings_of(result))


def _page(name: str, facts: Iterable[str], body: str, findings: Sequence[Finding]) -> str:
    """A name, facts below one another, and the findings after the body."""
    rows = []
    for finding in findings[:MOST_FINDINGS]:
        where = f"<code>{escape(finding.where)}</code> " if finding.where else ""
        where = f"{finding.kind_of_part} " if finding.kind_of_part else where
        remedy = f" — {with_code(finding.remedy)}" if finding.remedy else ""
        severity = str(finding.severity)
        head = f'<b style="color:{COLOURS.get(severity, "inherit")}">{escape(severity)}</b>'
        rows.append(f"<li>{head} {where}{with_code(finding.what)}{remedy}</li>")
    listed = f'<ul style="margin:4px 0 0;padding-left:1.2em">{"".join(rows)}</ul>' if rows else ""
    lines = "".join(f"<div>{fact}</div>" for fact in facts)
    more = _more(len(findings) - MOST_FINDINGS, "findings")
    return f'<div class="trunnion"><div style="font-weight:600">{escape(name)}</div>{lines}{body}{listed}{more}</div>'


def _more(count: int, what: str) -> str:
    return f"<p>… and {count} more {what}</p>" if count > 0 else ""
