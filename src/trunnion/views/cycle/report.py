"""A result as one HTML file that opens anywhere without a network: text, tables, moving mechanism, curves.

Tables and text are written here, so they are read without scripts too; what moves is drawn by the modules in
`web/` from the scene that the page carries. A content security policy names the one script and the one style by
their hashes and forbids everything else, so no name in a model can become code and nothing is ever fetched.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.cycle.locking_course import HEAD
from trunnion.files import whole
from trunnion.results.attributes import attribute
from trunnion.results.quantities import number, quantity
from trunnion.views.axis import abscissa, column, intervals, names
from trunnion.views.cycle.deviations import error_rows, loss_rows
from trunnion.views.cycle.scene import scene
from trunnion.views.page import bundle, hashed, headline, inputs_of, said, template, web_text

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Animation", "animation", "embedded", "page", "report"]


MOST_RANGES = 24  # rows of the table of states
# Variable, label, unit, what a reader may make of it.
BALANCE = (
    ("closure_residual", "Closure of the loops", "m", "distance between the pins of a joint after assembly"),
    ("condition", "Condition number", "1", "sensitivity of forces and speeds to the dimensions"),
    ("friction_iterations", "Friction iterations", "1", "iterations until reactions and friction agree"),
    ("friction_contraction", "Contraction", "1", "error ratio of successive iterations; below 1 it converges"),
    ("friction_residual", "Friction residual", "N", "largest difference between a friction force and its law"),
    ("friction_change", "Last change", "N", "move of the reactions in the last iteration; it left the residual above"),
    ("seat_rounds", "Seat iterations", "1", "iterations until the pins lie where their loads press them"),
)


def report(result: xr.Dataset, ideal: xr.Dataset | None = None) -> str:
    """The whole report as HTML; `ideal` is the same run without friction, overlaid where given."""
    return page(result, scene(result, ideal), compared=ideal is not None)


def page(
    result: xr.Dataset,
    scene_of: dict[str, Any],
    motion: dict[str, Any] | None = None,
    quality: Sequence[dict[str, str]] = (),
    compared: bool = False,
) -> str:
    """The report of a result whose scene is `scene_of`; motion: what it says of one in time, quality: rows beside."""
    from markupsafe import Markup  # with jinja2 only needed here, and slow to import

    style, script = web_text("report.css"), bundle("report.js")
    runs, thinned = intervals(result), ""
    if scene_of["thinned"] is not None:  # "3rd" if every third position is shown
        stride = -(-scene_of["thinned"] // scene_of["count"])
        thinned = f"{stride}{'th' if 10 <= stride % 100 <= 20 else {1: 'st', 2: 'nd', 3: 'rd'}.get(stride % 10, 'th')}"
    context = {
        "name": scene_of["name"] or "Mechanism", "formula": scene_of["formula"], "compared": compared,
        "motion": motion, "closed": scene_of["abscissa"]["closed"],
        "spatial": scene_of.get("space") == "spatial",
        "positions": result.sizes["position"], "thinned": thinned,
        "drawn": scene_of["count"], "method": result.attrs.get("method", ""),
        "unanswered": sum(run.stop - run.start for run in runs),
        "summary": headline(result),
        "holding": _holding(result), "errors": error_rows(result), "losses": loss_rows(result),
        "seats": bool(scene_of["built"] and scene_of["built"]["seats"]),
        "balance": [*quality, *_balance(result)], "inputs": inputs_of(result),
        **said(result, style, _findings(result)), "script": Markup(script), "script_hash": hashed(script),
        "scene": Markup(embedded(scene_of)),
    }  # fmt: skip
    return template("report.html.j2").render(context)


def embedded(data: Any) -> str:
    """JSON that may stand inside a script element: no text in it can close the element or open a comment."""
    text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    for sign in "<>&\u2028\u2029":
        text = text.replace(sign, f"\\u{ord(sign):04x}")
    return text


def _holding(result: xr.Dataset) -> dict[str, Any] | None:
    """The ranges of the states of locking as a table and a strip; None where the result has none."""
    ranges = attribute(result, "locking_ranges", "{}")
    if not ranges:
        return None
    rows = ranges["rows"]
    strip = [row for row in rows if row["state"]]
    holding = {
        "head": HEAD,
        "centred": "seat_offset" in result,
        "strip": strip,
        "more": max(0, len(rows) - MOST_RANGES),
    }
    return {**ranges, **holding, "rows": rows[:MOST_RANGES]}


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
        meaning = "effect of the errors of the integrals over the cycle, and of pins that do not settle"
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


# ---- the moving mechanism alone -------------------------------------------------------------------------------------


HEIGHT = 760  # of the frame in a notebook, px: drawing, player, figures of the position


@dataclass(frozen=True)
class Animation:
    """A moving drawing that a notebook shows in its place.

    page: all of it as one HTML file that needs no network; height: of its frame in a notebook, px.
    """

    page: str
    height: int = HEIGHT

    def _repr_html_(self) -> str:
        """The page in a frame of its own, which has no access to the notebook around it."""
        frame = 'sandbox="allow-scripts" title="Moving mechanism" width="100%" style="border:0"'
        return f'<iframe {frame} height="{self.height}" srcdoc="{escape(self.page)}"></iframe>'

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page, whole or not at all; MechanismError where it cannot be written."""
        target = Path(path)
        with whole(target) as temporary:
            temporary.write_text(self.page, encoding="utf-8")
        return target


def animation(result: xr.Dataset, ideal: xr.Dataset | None = None, height: int = HEIGHT) -> Animation:
    """The mechanism of a cycle moving through its positions, with reactions, player and figures of the position.

    ideal: the same run without friction, whose reactions are drawn beside; height: of the frame, px. Raises ValueError
    if `ideal` has other positions.
    """
    from markupsafe import Markup

    drawn = scene(result, ideal)
    style, script = web_text("report.css"), bundle("report.js")
    context = {
        "name": drawn["name"] or "Mechanism", "version": result.attrs.get("trunnion_version", ""),
        "style": Markup(style), "style_hash": hashed(style), "script": Markup(script), "script_hash": hashed(script),
        "scene": Markup(embedded(drawn)),
    }  # fmt: skip
    return Animation(template("animation.html.j2").render(context), height)
