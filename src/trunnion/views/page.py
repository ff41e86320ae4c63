"""The one page of all studies, and what every HTML report has: findings, input data, and where it is from.

Every figure is an SVG inside the page. The content security policy names the one style, and the one script of a page
that moves, by their hashes, and allows nothing else, so no name in a model can become code.
"""

from __future__ import annotations

import base64
import hashlib
import json
import posixpath
import re
from collections.abc import Callable, Collection, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cache
from html import escape
from importlib.resources import files
from itertools import groupby
from typing import TYPE_CHECKING, Any

from trunnion.errors import agreeing
from trunnion.model.names import is_number
from trunnion.results.attributes import MORE_THAN, attribute, summary_of, units_of
from trunnion.results.quantities import quantity
from trunnion.views.charts import Plot

if TYPE_CHECKING:
    import xarray as xr
    from jinja2 import Template

NONE = "—"  # a cell whose number is not known
CODE = re.compile(r"`([^`]+)`")
FIGURE = re.compile(r"(?<=\d) (?=\S+$)")  # between the number of a place and its unit
Summary = Sequence[tuple[str, list[tuple[str, str]]]]


# ---- tables and sections --------------------------------------------------------------------------------------------


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
    pictures: Sequence[tuple[str, Plot]] = ()
    tables: Sequence[Table] = ()
    after: Sequence[Table] = ()
    small: bool = False
    lines: Sequence[str] = ()
    findings: Sequence[dict[str, str]] = ()
    calm: str = ""
    anchor: str = ""


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
    findings = [row for row in attribute(result, "findings") if row not in missed]
    drawn = [[{**asdict(replace(part, pictures=())),
               "pictures": [{"alt": alt, "source": source(result, plot)} for alt, plot in part.pictures]}
              for part in some] for some in (parts, end)]  # fmt: skip
    return rendered(
        "page.html.j2", result, web_text("report.css") + web_text("page.css"), findings, kicker=kicker, name=name,
        facts=facts, summary=summary, missed=missed, sections=drawn[0], end=drawn[1], about_data=about_data,
        signed=signed,
    )  # fmt: skip


def source(result: xr.Dataset, plot: Plot) -> str:
    """A plot as an address that holds its figure."""
    from trunnion.views.draw import figure, svg

    return "data:image/svg+xml;base64," + base64.b64encode(svg(figure(result, plot)).encode()).decode()


def counts(*pairs: tuple[int, str]) -> list[tuple[str, str]]:
    """Facts of a page: (12, "position") as ("12", "positions")."""
    return [(f"{count:,}".replace(",", "\u202f"), agreeing(count, what, what + "s")) for count, what in pairs]


# ---- what every report has ------------------------------------------------------------------------------------------


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


def with_code(text: str) -> str:
    """The text escaped for HTML, with `…` as code: "see `trunnion play`" has no backtick left."""
    return CODE.sub(r"<code>\1</code>", escape(str(text)))


def rendered(
    page: str, result: xr.Dataset, style: str, findings: Sequence[dict[str, str]] = (), name: str = "", **parts: Any
) -> str:
    """A page of `views/web` with what every report has: findings, notes apart from them, input data, where it is from.

    parts: what else the page shows; scene: what moves on it.
    """
    from markupsafe import Markup  # with jinja2 only needed here, and slow to import

    if "scene" in parts:
        script = bundle("report.js")
        parts |= {"scene": Markup(embedded(parts["scene"])), "script": Markup(script), "script_hash": hashed(script)}
    nothing: dict[str, Any] = {"summary": (), "missed": (), "sections": (), "end": (), "about_data": 0, "signed": False}
    return template(page).render(nothing | parts | {
        "name": name or str(result.attrs.get("name", "")) or "Mechanism",
        "formula": str(result.attrs.get("formula", "")),
        "findings": [row for row in findings if row["severity"] != "note"],
        "notes": [row for row in findings if row["severity"] == "note"],
        "inputs": inputs_of(result) if "inputs" in result.attrs else [],
        "references": [line for line in str(result.attrs.get("references", "")).splitlines() if line.strip()],
        "version": result.attrs.get("trunnion_version", ""), "model_hash": result.attrs.get("model_hash", ""),
        "style": Markup(style), "style_hash": hashed(style),
    })  # fmt: skip


def embedded(data: Any) -> str:
    """JSON that may stand inside a script element: no text in it can close the element or open a comment."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for sign in "<>&\u2028\u2029":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return text


def hashed(text: str) -> str:
    """The text's hash as a content security policy names it."""
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def headline(result: xr.Dataset) -> Summary:
    """Subjects, each with its figures and what they are: ("drive torque of A", [("9.3 kN m", "maximum, at 24°")])."""
    units, subjects = units_of(result), []
    rows = [row for row in summary_of(result) if not row.numerical]
    for subject, rows_of in groupby(rows, key=lambda row: row.subject):
        figures = []
        for row in rows_of:
            text = row.value if isinstance(row.value, str) else quantity(row.value, row.unit, units) or NONE
            figures.append((f"> {text}" if row.aspect == MORE_THAN else text, FIGURE.sub("\u00a0", row.remark)))
        subjects.append((subject, figures))
    return subjects


def inputs_of(result: xr.Dataset) -> list[tuple[str, list[dict[str, str]]]]:
    """Input rows by section of the model, the first name of their path: a plain number with its SI unit, a text as it
    was written, an expression with what it comes to."""
    sections = []
    for section, rows in groupby(attribute(result, "inputs"), key=lambda row: str(row["path"]).split(".")[0]):
        lines = []
        for row in rows:
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


# ---- our ES modules as one ------------------------------------------------------------------------------------------

# A page opened from a file may not import files, and a browser spends some 10 ms on each. So each module becomes a
# function of its own scope that returns what it exports, an import the unpacking of that. Only the forms that our
# modules use are known: `import { a, b as c }` or `import * as a` `from "./x.js";`, `export function | const | class`.
IMPORT = re.compile(r'^import (\{[^}]*\}|\* as \w+|\w+) from "([^"]+)";$', re.MULTILINE)
EXPORT = re.compile(r"^export (?=(?:async )?(?:function|const|class) (\w+))", re.MULTILINE)
LEFT_OVER = re.compile(r"^\s*(?:import|export)\b|\bimport\s*\(", re.MULTILINE)

Read = Callable[[str], str]


def web_text(name: str) -> str:
    """A file of `views/web` as text."""
    return (files("trunnion.views") / "web" / name).read_text(encoding="utf-8")


def bundle(entry: str, read: Read = web_text) -> str:
    """The module `entry` ("report.js") and all it imports as one script, in the order of dependence."""
    functions = _functions(entry, read, ())
    for name, text in functions.items():
        if "</" in text or "<!--" in text:
            raise _refusal(name)
    return '"use strict";\n' + "\n".join(functions.values())


def module(entry: str, read: Read, libraries: Collection[str]) -> str:
    """The module `entry` ("studio/main.js") and all it imports as one module; `libraries` stay imports.

    It exports each by the name of its path, `module_studio_main`.
    """
    functions = _functions(entry, read, libraries)
    imports = [f'import * as {_variable(name)} from "{name}";' for name in libraries]
    return "\n".join([*imports, *functions.values(), f"export {{ {', '.join(map(_variable, functions))} }};\n"])


def _functions(entry: str, read: Read, libraries: Collection[str]) -> dict[str, str]:
    """Every module as a function, by its path without .js, after those that it imports."""
    done: dict[str, str] = {}

    def collect(name: str, path: tuple[str, ...]) -> None:
        if name in path:
            raise ValueError(f"modules import each other: {' → '.join([*path, name])}")
        if name in done:
            return
        source = read(f"{name}.js")

        def unpacked(match: re.Match[str]) -> str:
            what, other = match.groups()
            if other not in libraries:
                if what.isidentifier() or not other.startswith("."):
                    return match[0]
                other = posixpath.normpath(posixpath.join(posixpath.dirname(name), other)).removesuffix(".js")
                collect(other, (*path, name))
            named = {"{": what.replace(" as ", ": "), "*": what.split()[-1]}.get(what[0], f"{{ default: {what} }}")
            return f"const {named} = {_variable(other)};"

        body = IMPORT.sub(unpacked, EXPORT.sub("", source))
        if LEFT_OVER.search(body):
            raise _refusal(name)
        exported = ", ".join(EXPORT.findall(source))
        done[name] = f"const {_variable(name)} = (() => {{\n{body}return {{ {exported} }};\n}})();\n"

    collect(entry.removesuffix(".js"), ())
    return done


def _refusal(name: str) -> ValueError:
    return ValueError(f"{name}.js cannot be put into a page: unknown import or export, or the text `</` or `<!--`")


def _variable(name: str) -> str:
    return "module_" + re.sub(r"\W", "_", name)
