"""What every HTML report has: its template, figures and tables by parts, findings, input data, and where it is from.

Every figure is an SVG inside the page. The content security policy allows these and the one style, named by its hash,
and nothing else, so no name in a model can become code.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from functools import cache
from io import BytesIO
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

from trunnion.results.attributes import attribute, summary_of
from trunnion.results.figure import MORE_THAN
from trunnion.results.figure import Figure as Stated
from trunnion.results.quantities import quantity
from trunnion.views.common.bundle import web_text
from trunnion.views.common.markup import with_code
from trunnion.views.common.table import TextTable

if TYPE_CHECKING:
    import xarray as xr
    from jinja2 import Template
    from matplotlib.figure import Figure

__all__ = ["Section", "drawn", "hashed", "headline", "inputs_of", "said", "source", "study_page", "template"]


class Section(NamedTuple):
    """A part of the page: a title, what it is about, figures with what they show in words, tables."""

    title: str
    about: str
    figures: Sequence[tuple[str, Figure]]
    tables: Sequence[TextTable]


def study_page(result: xr.Dataset, kicker: str, facts: Sequence[tuple[str, str]], parts: Sequence[Section]) -> str:
    """The report of a study that is a figure and tables: what it is about, its parts, findings and the input data.

    facts: (figure, what it counts).
    """
    context: dict[str, Any] = {
        "kicker": kicker, "name": str(result.attrs.get("name", "")) or "Mechanism",
        "formula": str(result.attrs.get("formula", "")), "facts": facts,
        "sections": [drawn(part) for part in parts], "inputs": inputs_of(result),
        **said(result, web_text("report.css") + web_text("tolerance.css")),
    }  # fmt: skip
    return template("study.html.j2").render(context)


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


def drawn(part: Section) -> dict[str, Any]:
    """A part as the page takes it: its figures as addresses that hold them."""
    pictures = [{"alt": alt, "source": source(figure)} for alt, figure in part.figures]
    return {"title": part.title, "about": part.about, "pictures": pictures, "tables": part.tables}


def source(figure: Figure) -> str:
    """A figure as an address that holds it."""
    from matplotlib import rc_context

    buffer = BytesIO()
    with rc_context({"svg.hashsalt": "trunnion"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode()


def said(result: xr.Dataset, style: str, found: Sequence[dict[str, str]] | None = None) -> dict[str, Any]:
    """What every report says: findings, notes apart from them, and where the result comes from; with its style."""
    from markupsafe import Markup

    rows = attribute(result, "findings") if found is None else found
    return {
        "findings": [row for row in rows if row["severity"] != "note"],
        "notes": [row for row in rows if row["severity"] == "note"],
        "references": [line for line in str(result.attrs.get("references", "")).splitlines() if line.strip()],
        "version": result.attrs.get("trunnion_version", ""),
        "model_hash": result.attrs.get("model_hash", ""),
        "style": Markup(style),
        "style_hash": hashed(style),
    }


def hashed(text: str) -> str:
    """The text's hash as a content security policy names it."""
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def headline(result: xr.Dataset) -> list[tuple[str, list[tuple[str, str]]]]:
    """Subjects, each with its figures and what they are: ("drive torque of A", [("9.3 kN m", "maximum, at 24°")])."""
    found = []
    rows = [one for one in summary_of(result) if not one.numerical]
    for subject, members in groupby(rows, key=lambda one: one.subject):
        found.append((subject, [(_value(one), one.remark) for one in members]))
    return found


def _value(one: Stated) -> str:
    text = one.value if isinstance(one.value, str) else quantity(one.value, one.unit) or "—"
    return f"> {text}" if one.aspect == MORE_THAN else text


def inputs_of(result: xr.Dataset) -> list[tuple[str, list[dict[str, str]]]]:
    """Input rows by section of the model, the first name of their path."""
    rows = attribute(result, "inputs")
    sections = []
    for section, members in groupby(rows, key=lambda row: str(row["path"]).split(".")[0]):
        lines = [{"path": str(row["path"]).removeprefix(f"{section}."), "text": _stated(row)} for row in members]
        sections.append((section.replace("_", " ").capitalize(), lines))
    return sections


def _stated(row: dict[str, Any]) -> str:
    """An input as it was written: a plain number with its SI unit, an expression with what it comes to."""
    text, value = str(row.get("text") or ""), row.get("value")
    unit = str(row.get("unit") or "")
    unit = "" if unit in ("1", "SI") else unit  # a dimension is a length or an angle, as its own text says
    if not text:
        return quantity(value, unit)
    if value is None:  # an expression of the motion
        return text
    if text.lstrip("+-")[:1] not in "0123456789.±":
        return f"{text} = {quantity(value, unit)}"
    return f"{text}\u00a0{unit}" if unit and _is_number(text) else text


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
