"""A cycle or a motion in time as one HTML file that opens anywhere without a network: text, tables, moving mechanism.

Tables and text are written here, so they are read without scripts too; what moves is drawn by the modules in
`web/` from the scene that the page carries. A content security policy names the one script and the one style by
their hashes and forbids everything else, so no name in a model can become code and nothing is ever fetched.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.cycle.locking_course import HEAD
from trunnion.errors import Finding, MechanismError
from trunnion.files import whole
from trunnion.results.attributes import attribute
from trunnion.results.attributes import whole as check_whole
from trunnion.results.quantities import number, prefixed, quantity
from trunnion.results.tables import kind_of
from trunnion.views.as_built import error_rows, loss_rows
from trunnion.views.axis import Abscissa, abscissa, column, intervals, members, names, series
from trunnion.views.motion import OF_IMPACTS, Shown, drivers_of, energies, figure, pins, shown
from trunnion.views.page import NONE, counts, headline, rendered, source, web_text
from trunnion.views.scene import scene

if TYPE_CHECKING:
    import xarray as xr

MOST_RANGES, MOST_EVENTS = 24, 200  # rows of the tables of states and of events
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
POWERS = "sum of the powers of drive, loads, masses and friction, relative to the peak drive power"
INTEGRALS = "effect of the errors of the integrals over the cycle, and of pins that do not settle"
ENERGY = "works less changes of the energies, relative to the largest of them"
LOST = ("work_friction", "work_contact", "work_clutch")
# what is left in the links of what came in and went out
HELD = ("kinetic_energy", "potential_energy", "contact_energy")


# ---- the page -------------------------------------------------------------------------------------------------------


def report(result: xr.Dataset, ideal: xr.Dataset | None = None) -> str:
    """The whole report as HTML; `ideal` is the same run without friction, of a cycle, overlaid where given."""
    if kind_of(result) != "motion":
        drawn = scene(result, ideal)
        ((count, noun),) = counts((result.sizes["position"], "position"))
        if drawn["thinned"] is not None:
            noun += f", one in {-(-drawn['thinned'] // drawn['count'])} shown"
        return _page(result, drawn, [(count, noun)], compared=ideal is not None)
    if ideal is not None:
        raise TypeError("report() of a motion has no argument 'ideal'")
    motion = shown(result)
    events, rows, residual = motion.events[:MOST_EVENTS], motion.rows, motion.rows["energy_residual"].values
    account: tuple[list[tuple[str, str]], ...] = [], []  # what came in and went out, what is left
    turned, quality = 0.0, list[list[str]]()
    for name, text, course in energies(rows):
        title = f"change of the {text}" if name in HELD else text
        value = quantity(float(course[-1]) * (-1 if name in LOST else 1), "J")
        account[name in HELD].append((title[:1].upper() + title[1:], value))
        turned = max(turned, float(np.nanmax(np.abs(course))))
    if turned > 0:
        account = *account, [("Difference", quantity(float(residual[-1]), "J"))]
        worst = int(np.abs(np.nan_to_num(residual)).argmax())
        quality.append(["Energy account", quantity(abs(float(residual[worst])) / turned, "1"),
                        _stated(float(rows["time"].values[worst])), ENERGY])  # fmt: skip
    in_play = "contact" in result.dims and pins(result)
    about = {
        "length": _stated(motion.end),
        "events": [{"seconds": f"{event.time:.9g}", "time": quantity(event.time, "s"), "cells": event[1:]}
                   for event in events],
        "more": len(motion.events) - len(events),
        "account": account if turned > 0 else (),
        "orbits": source(result, figure(result, "orbit")) if in_play else "",
    }  # fmt: skip
    drawn = motion_scene(motion)
    ((steps, noun),) = counts((rows.sizes["position"] - 1, "step"))
    if drawn["thinned"] is not None:
        noun += f", {drawn['count']} rows shown with every peak of the reactions"
    early = f"of {_stated(motion.asked)}, then the motion ends" if motion.early else ""
    return _page(rows, drawn, [(_stated(motion.end), early), (steps, noun)], about, quality)


def _page(
    result: xr.Dataset, drawn: dict[str, Any], facts: list[tuple[str, str]], motion: dict[str, Any] | None = None,
    quality: Sequence[list[str]] = (), compared: bool = False,
) -> str:  # fmt: skip
    """The report of a result whose scene is `drawn`; motion: what it says of one in time, quality: rows beside."""
    unanswered = sum(run.stop - run.start for run in intervals(result))
    holding = attribute(result, "locking_ranges", "{}")
    if holding:  # the ranges of the states of locking as a table and a strip
        rows = holding["rows"]
        holding |= {"head": HEAD, "centred": "seat_offset" in result, "strip": [row for row in rows if row["state"]],
                    "more": max(0, len(rows) - MOST_RANGES), "rows": rows[:MOST_RANGES]}  # fmt: skip
    facts = [*facts, *([(str(unanswered), "not solved")] if unanswered else [])]
    if method := result.attrs.get("method", ""):
        facts.append(("", f"friction by {method}"))
    if motion is None:
        facts.append(("", f"{'with' if compared else 'no'} comparison without friction"))
    kicker = "Motion in time: speed, forces and energy" if motion else "Motion, reactions, friction and power"
    return rendered(
        "report.html.j2", result, web_text("report.css"), _findings(result), scene=drawn,
        kicker=f"{kicker} of a linkage", facts=facts, summary=headline(result), motion=motion, compared=compared,
        closed=drawn["abscissa"]["closed"], spatial=drawn.get("space") == "spatial", holding=holding,
        errors=error_rows(result), seats=bool(drawn["built"] and drawn["built"]["seats"]), losses=loss_rows(result),
        balance=[*quality, *_balance(result)],
    )  # fmt: skip


def _findings(result: xr.Dataset) -> list[dict[str, str]]:
    """The findings of the result; intervals without an answer, if no error among them speaks of such."""
    rows = [{key: str(row.get(key) or "") for key in ("severity", "where", "what", "remedy")}
            for row in attribute(result, "findings")]  # fmt: skip
    over = abscissa(result)
    for run in intervals(result) if not any(row["severity"] == "error" for row in rows) else ():
        what = f"{run.text}, from {over.say(run.start)} to {over.say(run.stop - 1)} ({over.label})"
        rows.append({"severity": "error", "where": "", "what": what, "remedy": ""})
    return rows


def _balance(result: xr.Dataset) -> list[list[str]]:
    """The worst figure of each check over the run, and where it stands."""
    over, rows = abscissa(result), []
    residual, error = column(result, "power_residual"), column(result, "efficiency_error")
    if residual is not None and names(result, "driver"):
        drive = np.abs(np.asarray(result["drive_power"].sum("driver").values, dtype=float))
        most = float(drive[np.isfinite(drive)].max(initial=0.0))
        rows.append(_worst("Power balance residual", residual / (most or 1.0), "1" if most else "W", POWERS, over))
    if error is not None and np.isfinite(error):
        rows.append(["Error of the efficiency", quantity(float(error), "1"), "", INTEGRALS])
    rows += [_worst(label, values, unit, meaning, over) for name, label, unit, meaning in BALANCE
             if (values := column(result, name)) is not None]  # fmt: skip
    return rows


def _worst(label: str, values: Any, unit: str, meaning: str, over: Abscissa) -> list[str]:
    sizes = np.where(np.isfinite(values), np.abs(values), -1.0)
    index = int(sizes.argmax()) if sizes.size else 0
    if not sizes.size or sizes[index] < 0:
        return [label, NONE, "", meaning]
    worst = float(sizes[index])
    text = quantity(worst, unit) if unit != "m" else f"{number(worst, 3)}\u00a0m"
    same = sizes.size > 1 and bool((sizes == worst).all())
    return [label, text, "everywhere" if same else over.say(index), meaning]


# ---- a motion in time -----------------------------------------------------------------------------------------------

MOST_ROWS = 1200  # more than a cycle has: turns follow each other
RESTS, MISSING = -1, 99  # statuses that a cycle does not have
STATES = {RESTS: "at rest: friction holds it", MISSING: "there is no motion"}


def _stated(seconds: float) -> str:
    """A time as one would state it, without zeros that promise precision: "3 s"."""
    factor, unit = prefixed(seconds, "s")
    return f"{seconds * factor:.4g}\u00a0{unit}"


def motion_scene(motion: Shown) -> dict[str, Any]:
    """The motion as JSON-able data, its rows thinned to MOST_ROWS with the peaks of the reactions kept; see `scene`."""
    picked = _picked(motion.rows)
    drawn, rows = scene(motion.rows, picked=picked), motion.rows.isel(position=picked)
    status = np.where(rows["resting"].values == 1, RESTS, rows["status"].values)
    status = np.where(np.isfinite(rows["kinetic_energy"].values), status, MISSING)
    last, over = float(rows["time"].values[-1]), abscissa(motion.rows)
    factor = over.values[-1] / float(motion.rows["time"].values[-1]) if last > 0 else 1.0
    gaps = members(rows, "contact_gap", "contact")
    # fmt: off
    of_motion: dict[str, Any] = {
        "duration": last,
        "free": [
            {"name": name, "unit": "rad" if effort == "N m" else "m",
             "coordinate": series(rows["drive_coordinate"].values[i]), "rate": series(rows["drive_rate"].values[i])}
            for i, name, effort in drivers_of(rows)
        ],
        "contacts": [{"name": name, "force": series(force), "gap": series(gaps[name])}
                     for name, force in members(rows, "contact_normal_force", "contact").items()],
        "energies": [{"label": text, "values": series(values)} for _, text, values in energies(rows)],
        "events": [
            {"at": float(f"{min(event.time, last) * factor:.9g}"), "word": event.word,
             "quiet": event.word in OF_IMPACTS} for event in motion.events
        ],
    }
    # fmt: on
    return drawn | {
        "status": [int(code) for code in status],
        "states": drawn["states"] | {str(code): text for code, text in STATES.items()},
        "sums": {name: values for name, values in drawn["sums"].items() if name != "efficiency_instant"},
        "ease": [1.0],  # no peak is cut: a motion in time has no dead centre that forces it
        "motion": of_motion,
    }


def _picked(rows: xr.Dataset) -> NDArray[np.intp]:
    """The rows that are shown: all, or of each of many stretches the first and that of the largest reaction, and the
    last, so that no peak is lost.
    """
    count = rows.sizes["position"]
    if count <= MOST_ROWS:
        return np.arange(count)
    sizes = np.nan_to_num(np.sqrt(np.sum(rows["reaction_force"].values ** 2, axis=1)))
    most = sizes.max(axis=1, keepdims=True)
    size = np.max(np.divide(sizes, most, out=np.zeros_like(sizes), where=most > 0), axis=0)
    firsts = np.arange(0, count, -(-count // (MOST_ROWS // 2 - 1)))
    peaks = [begin + int(part.argmax()) for begin, part in zip(firsts, np.split(size, firsts[1:]), strict=True)]
    return np.unique([*firsts, *peaks, count - 1])


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
    if `ideal` has other positions, MechanismError of a result of another kind.
    """
    if kind_of(result) != "cycle":
        raise MechanismError(Finding(f"there is no animation of a {kind_of(result)}", "kind", "analyse a cycle"))
    check_whole(result, "an animation")

    drawn, kicker = scene(result, ideal), "Moving mechanism"
    return Animation(rendered("animation.html.j2", result, web_text("report.css"), scene=drawn, kicker=kicker), height)
