"""A result as one HTML file that opens anywhere without a network: text, tables, moving mechanism, curves.

Tables and text are written here, so they are read without scripts too; what moves is drawn by the modules in
`web/` from the scene that the page carries. A content security policy names the one script and the one style by
their hashes and forbids everything else, so no name in a model can become code and nothing is ever fetched.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Sequence
from functools import cache
from itertools import groupby
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.cycle.locking_states import HEAD
from trunnion.results.attributes import attribute, summary_of
from trunnion.results.figure import MORE_THAN, Figure
from trunnion.results.quantities import number, quantity
from trunnion.views.common.bundle import bundle, web_text
from trunnion.views.common.cycle import abscissa, column, intervals, names
from trunnion.views.common.markup import with_code
from trunnion.views.cycle.deviations_tables import error_rows, loss_rows
from trunnion.views.cycle.scene import scene

if TYPE_CHECKING:
    import xarray as xr
    from jinja2 import Template

__all__ = ["embedded", "hashed", "inputs_of", "page", "report", "said"]

MOST_RANGES = 24  # rows of the table of states
# Variable, label, unit, what a reader may make of it.
BALANCE = (
    ("closure_residual", "Closure of the loops", "m", "distance between the pins of a joint after assembly"),
    ("condition", "Condition number", "1", "sensitivity of forces and speeds to the dimensions"),
    ("friction_iterations", "Friction iterations", "1", "iterations until reactions and friction agree"),
    ("friction_contraction", "Contraction", "1", "error ratio of successive iterations; below 1 it converges"),
    ("friction_residual", "Friction residual", "N", "largest difference between a friction force and its law"),
    ("friction_change", "Last change", "N", "change of the reactions in the last iteration"),
    ("seat_rounds", "Seat iterations", "1", "iterations until the pins lie where their loads press them"),
)


def report(result: xr.Dataset, ideal: xr.Dataset | None = None) -> str:
    """The whole report as HTML; `ideal` is the same run without friction, overlaid where given."""
    return page(result, scene(result, ideal), compared=ideal is not None)


def page(
    result: xr.Dataset,
    shown: dict[str, Any],
    motion: dict[str, Any] | None = None,
    quality: Sequence[dict[str, str]] = (),
    compared: bool = False,
) -> str:
    """The report of a result whose scene is `shown`; motion: what it says of a motion in time, quality: rows beside."""
    from markupsafe import Markup  # with jinja2 only needed here, and slow to import

    style, script = web_text("report.css"), bundle("report.js")
    runs = intervals(result)
    context = {
        "name": shown["name"] or "Mechanism", "formula": shown["formula"], "compared": compared,
        "motion": motion, "closed": shown["abscissa"]["closed"],
        "spatial": shown.get("space") == "spatial",
        "positions": result.sizes["position"], "thinned": _ordinal(shown),
        "drawn": shown["count"], "method": result.attrs.get("method", ""),
        "unanswered": sum(run.stop - run.start for run in runs),
        "summary": _summary(result),
        "holding": _holding(result), "errors": error_rows(result), "losses": loss_rows(result),
        "seats": bool(shown["built"] and shown["built"]["seats"]),
        "balance": [*quality, *_balance(result)], "inputs": inputs_of(result),
        **said(result, style, _findings(result)), "script": Markup(script), "script_hash": hashed(script),
        "scene": Markup(embedded(shown)),
    }  # fmt: skip
    return _template().render(context)


@cache
def _template() -> Template:
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    environment = Environment(autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True)
    environment.filters["code"] = lambda text: Markup(with_code(text))
    return environment.from_string(web_text("report.html.j2"))


def embedded(data: Any) -> str:
    """JSON that may stand inside a script element: no text in it can close the element or open a comment."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for sign in "<>&\u2028\u2029":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return text


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


def _ordinal(shown: dict[str, Any]) -> str:
    """ "3rd" if every third position is shown, empty if all are."""
    if shown["thinned"] is None:
        return ""
    stride = -(-shown["thinned"] // shown["count"])
    suffix = "th" if 10 <= stride % 100 <= 20 else {1: "st", 2: "nd", 3: "rd"}.get(stride % 10, "th")
    return f"{stride}{suffix}"


def _summary(result: xr.Dataset) -> list[tuple[str, list[tuple[str, str]]]]:
    """Subjects, each with its figures and what they are: ("drive torque of A", [("9.3 kN m", "maximum, at 24°")])."""
    found = []
    headline = [one for one in summary_of(result) if not one.numerical]
    for subject, members in groupby(headline, key=lambda one: one.subject):
        found.append((subject, [(_value(one), one.remark) for one in members]))
    return found


def _holding(result: xr.Dataset) -> dict[str, Any] | None:
    """The ranges of the states of locking as a table and a strip; None where the result has none."""
    found = attribute(result, "locking_ranges", "{}")
    if not found:
        return None
    rows = found["rows"]
    strip = [row for row in rows if row["state"]]
    return {**found, "head": HEAD, "strip": strip, "rows": rows[:MOST_RANGES], "more": max(0, len(rows) - MOST_RANGES)}


def _value(one: Figure) -> str:
    text = one.value if isinstance(one.value, str) else quantity(one.value, one.unit) or "—"
    return f"> {text}" if one.aspect == MORE_THAN else text


def _findings(result: xr.Dataset) -> list[dict[str, str]]:
    """The findings of the result; intervals without an answer, if no error among them speaks of such."""
    rows = [{key: str(row.get(key) or "") for key in ("severity", "where", "what", "remedy")}
            for row in attribute(result, "findings")]  # fmt: skip
    over = abscissa(result)
    if any(row["severity"] == "error" for row in rows):
        return rows
    for run in intervals(result):
        what = f"{run.text}, from {over.say(run.start)} to {over.say(run.stop - 1)} ({over.label})"
        rows.append({"severity": "error", "where": "", "what": what, "remedy": ""})
    return rows


def _balance(result: xr.Dataset) -> list[dict[str, str]]:
    """The worst figure of each check over the run, and where it stands."""
    over = abscissa(result)
    rows = []
    residual = column(result, "power_residual")
    if residual is not None and names(result, "driver"):
        drive = np.abs(np.asarray(result["drive_power"].sum("driver").values, dtype=float))
        most = float(drive[np.isfinite(drive)].max(initial=0.0))
        meaning = "sum of the powers of drive, loads, masses and friction, relative to the peak drive power"
        rows.append(
            _worst("Power balance residual", residual / most if most else residual, "1" if most else "W", meaning, over)
        )
    error = column(result, "efficiency_error")
    if error is not None and np.isfinite(error):
        meaning = "effect of the errors of the integrals over the cycle"
        rows.append({"label": "Error of the efficiency", "value": quantity(float(error), "1"), "place": "",
                     "meaning": meaning})  # fmt: skip
    for name, label, unit, meaning in BALANCE:
        values = column(result, name)
        if values is not None:
            rows.append(_worst(label, values, unit, meaning, over))
    return rows


def _worst(label: str, values: Any, unit: str, meaning: str, over: Any) -> dict[str, str]:
    sizes = np.where(np.isfinite(values), np.abs(values), -1.0)
    index = int(sizes.argmax()) if sizes.size else 0
    if not sizes.size or sizes[index] < 0:
        return {"label": label, "value": "—", "place": "", "meaning": meaning}
    worst = float(sizes[index])
    text = quantity(worst, unit) if unit != "m" else f"{number(worst, 3)}\u00a0m"
    same = sizes.size > 1 and bool((sizes == worst).all())
    return {"label": label, "value": text, "place": "everywhere" if same else over.say(index), "meaning": meaning}


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
    if not text[0].isdigit() and text[0] not in "+-.":
        return f"{text} = {quantity(value, unit)}"
    return f"{text}\u00a0{unit}" if unit and _is_number(text) else text


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
