"""The one page of all studies, and what every HTML report has: findings, input data, and where it is from.

Every figure is an SVG inside the page. The content security policy allows these and the one style, named by its hash,
and nothing else, so no name in a model can become code.
"""

from __future__ import annotations

import base64
import hashlib
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from html import escape
from io import BytesIO
from itertools import groupby
from typing import TYPE_CHECKING, Any

from trunnion.errors import agreeing
from trunnion.model.names import is_number
from trunnion.results.attributes import attribute, summary_of, units_of
from trunnion.results.figure import MORE_THAN
from trunnion.results.figure import Figure as Stated
from trunnion.results.quantities import Units, quantity
from trunnion.views.common.bundle import web_text

if TYPE_CHECKING:
    import xarray as xr
    from jinja2 import Template
    from matplotlib.figure import Figure

__all__ = [
    "NONE", "Section", "Summary", "Table", "counts", "hashed", "headline", "inputs_of", "page", "said", "source",
    "template", "value_of", "with_code",
]  # fmt: skip


NONE = "—"  # a cell whose number is not known


@dataclass(frozen=True)
class Table:
    """A title, the heads of the columns, the rows of texts with their units.

    left_out: how many points of the result have no row, where a long table is thinned.
    """

    title: str
    head: list[str]
    rows: list[list[str]]
    left_out: int = 0

    def titled(self, title: str) -> Table:
        """The same table under another title."""
        return replace(self, title=title)

    def without_empty(self) -> Table:
        """The same without the columns after the first in which no row has a number or word."""
        filled = [k for k in range(len(self.head)) if k == 0 or any(row[k] not in ("", NONE) for row in self.rows)]
        rows = [[row[k] for k in filled] for row in self.rows]
        return replace(self, head=[self.head[k] for k in filled], rows=rows)


CODE = re.compile(r"`([^`]+)`")


def with_code(text: str) -> str:
    """The text escaped for HTML, with `…` as code: "see `trunnion play`" has no backtick left."""
    return CODE.sub(r"<code>\1</code>", escape(str(text)))


@dataclass(frozen=True)
class Section:
    """A part of the page, in this order: what it is about, lines, tables, pictures, further tables, findings.

    title: of the part, as what is shown
    pictures: (what it shows in words, figure), the only one broad, several side by side; small: of half the size
    findings: rows of `attrs["findings"]`; calm: what is said where there are none, if anything
    anchor: by which the page leads to it
    """

    title: str
    about: str = ""
    pictures: Sequence[tuple[str, Figure]] = ()
    tables: Sequence[Table] = ()
    after: Sequence[Table] = ()
    small: bool = False
    lines: Sequence[str] = ()
    findings: Sequence[dict[str, str]] = ()
    calm: str = ""
    anchor: str = ""


FIGURE = re.compile(r"(?<=\d) (?=\S+$)")  # between the number of a place and its unit
Summary = Sequence[tuple[str, list[tuple[str, str]]]]


def page(
    result: xr.Dataset,
    kicker: str,
    facts: Sequence[tuple[str, str]],
    parts: Sequence[Section],
    *,
    summary: Summary = (),
    missed: Sequence[dict[str, str]] = (),
    end: Sequence[Section] = (),
    name: str = "",
    about_data: int = 0,
    signed: bool = False,
) -> str:
    """The report of a study as one HTML file that opens and prints anywhere without a network or a script.

    Parameters
    ----------
    result : with its findings, inputs, formula and references
    kicker : what kind of report it is
    facts : (figure, what it counts)
    parts, end : before and after the notes
    summary : subjects with their figures and what these are, read first
    missed : findings that stand before all else
    name : of what is reported, the mechanism if not given
    about_data : findings about the data, to which the page leads where there is no other
    signed : with room for names and dates
    """
    style = web_text("report.css") + web_text("page.css")
    text = said(result, style)
    text["findings"] = [row for row in text["findings"] if row not in missed]
    context: dict[str, Any] = {
        "kicker": kicker, "name": name or str(result.attrs.get("name", "")) or "Mechanism",
        "formula": str(result.attrs.get("formula", "")), "facts": facts, "summary": summary, "missed": missed,
        "sections": [_drawn(part) for part in parts], "end": [_drawn(part) for part in end],
        "inputs": inputs_of(result) if "inputs" in result.attrs else [], "about_data": about_data, "signed": signed,
        **text,
    }  # fmt: skip
    return template("page.html.j2").render(context)


def counts(*pairs: tuple[int, str]) -> list[tuple[str, str]]:
    """Facts of a page: (12, "position") as ("12", "positions")."""
    return [(f"{count:,}".replace(",", "\u202f"), agreeing(count, what, what + "s")) for count, what in pairs]


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


def _drawn(part: Section) -> dict[str, Any]:
    """A part as the page takes it: its figures as addresses that hold them."""
    pictures = [{"alt": alt, "source": source(figure)} for alt, figure in part.pictures]
    return {**vars(part), "pictures": pictures}


def source(figure: Figure) -> str:
    """A figure as an address that holds it."""
    from matplotlib import rc_context

    buffer = BytesIO()
    with rc_context({"svg.hashsalt": "trunnion"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode()


def said(result: xr.Dataset, style: str, findings: Sequence[dict[str, str]] | None = None) -> dict[str, Any]:
    """What every report says: findings, notes apart from them, and where the result comes from; with its style."""
    from markupsafe import Markup

    rows = attribute(result, "findings") if findings is None else findings
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
    rows = [row for row in summary_of(result) if not row.numerical]
    units = units_of(result)
    return [
        (subject, [(value_of(row, units), FIGURE.sub("\u00a0", row.remark)) for row in members])
        for subject, members in groupby(rows, key=lambda row: row.subject)
    ]


def value_of(row: Stated, units: Units) -> str:
    """A figure with its unit, in those of its page."""
    text = row.value if isinstance(row.value, str) else quantity(row.value, row.unit, units) or "—"
    return f"> {text}" if row.aspect == MORE_THAN else text


def inputs_of(result: xr.Dataset) -> list[tuple[str, list[dict[str, str]]]]:
    """Input rows by section of the model, the first name of their path: a plain number with its SI unit, a text as it
    was written, an expression with what it comes to."""
    sections = []
    for section, members in groupby(attribute(result, "inputs"), key=lambda row: str(row["path"]).split(".")[0]):
        lines = []
        for row in members:
            text, value, unit = str(row.get("text") or ""), row.get("value"), str(row.get("unit") or "")
            unit = "" if unit in ("1", "SI") else unit  # a dimension is a length or an angle, as its own text says
            if not text:
                text = quantity(value, unit)
            elif value is not None and text.lstrip("+-")[:1] not in "0123456789.±":
                text = f"{text} = {quantity(value, unit)}"
            elif value is not None and unit and is_number(text):
                text = f"{text}\u00a0{unit}"
            lines.append({"path": str(row["path"]).removeprefix(f"{section}."), "text": text})
        sections.append((section.replace("_", " ").capitalize(), lines))
    return sections
