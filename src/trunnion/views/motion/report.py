"""The report of a motion in time as one HTML file: the moving mechanism in real time, curves, events, energy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.results.quantities import prefixed, quantity
from trunnion.views.axis import abscissa, members, series
from trunnion.views.cycle.report import page
from trunnion.views.cycle.scene import scene
from trunnion.views.motion.figure import pictures
from trunnion.views.motion.shown import OF_IMPACTS, Shown, drivers_of, energies, shown
from trunnion.views.page import source

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MOST_EVENTS", "MOST_ROWS", "motion_scene", "report"]


MOST_EVENTS = 200  # rows of the table
LOST = ("work_friction", "work_contact", "work_clutch")
# what is left in the links of what came in and went out
HELD = ("kinetic_energy", "potential_energy", "contact_energy")
RESIDUAL = "works less changes of the energies, relative to the largest of them"


def report(result: xr.Dataset) -> str:
    """The report as one HTML page: figures of the motion, moving mechanism, curves over time, events, findings."""
    motion = shown(result)
    events = motion.events[:MOST_EVENTS]
    over = {
        "length": _stated(motion.end),
        "asked": _stated(motion.asked) if motion.early else "",
        "events": [{"seconds": f"{event.time:.9g}", "time": quantity(event.time, "s"), "cells": event[1:]}
                   for event in events],
        "more": len(motion.events) - len(events),
        "account": _account(motion.rows),
        "pictures": [{"alt": title, "source": source(result, drawn)} for title, drawn in pictures(result)],
    }  # fmt: skip
    return page(motion.rows, motion_scene(motion), over, _residual(motion))


def _stated(seconds: float) -> str:
    """A time as one would state it, without zeros that promise precision: "3 s"."""
    factor, unit = prefixed(seconds, "s")
    return f"{seconds * factor:.4g}\u00a0{unit}"


def _account(rows: xr.Dataset) -> dict[str, list[tuple[str, str]]]:
    """What came in and went out until the end, and what is left; empty where nothing moves."""
    energy_rows = energies(rows)
    if not energy_rows:
        return {}

    def lines(at_rest: bool) -> list[tuple[str, str]]:
        account = []
        for name, text, course in energy_rows:
            if (name in HELD) is at_rest:
                title = f"change of the {text}" if at_rest else text
                value = float(course[-1]) * (-1 if name in LOST else 1)
                account.append((title[:1].upper() + title[1:], quantity(value, "J")))
        return account

    rest = quantity(float(rows["energy_residual"].values[-1]), "J")
    return {"works": lines(False), "held": lines(True), "rest": [("Difference", rest)]}


def _residual(motion: Shown) -> list[dict[str, Any]]:
    """The largest error of the energy account as a row of the numerical quality."""
    rows = motion.rows
    sizes = np.abs(np.nan_to_num(rows["energy_residual"].values))
    worst = int(sizes.argmax())
    turned = max((float(np.nanmax(np.abs(course))) for *_, course in energies(rows)), default=0.0)
    if not turned > 0:
        return []
    place = _stated(float(rows["time"].values[worst]))
    value = quantity(float(sizes[worst] / turned), "1")
    return [{"label": "Energy account", "value": value, "place": place, "meaning": RESIDUAL}]


# ---- scene ----------------------------------------------------------------------------------------------------------


MOST_ROWS = 1200  # more than a cycle has: turns follow each other
RESTS, NONE = -1, 99  # statuses that a cycle does not have
STATES = {RESTS: "at rest: friction holds it", NONE: "there is no motion"}


def motion_scene(motion: Shown) -> dict[str, Any]:
    """The motion as JSON-able data, its rows thinned to MOST_ROWS with the peaks of the reactions kept; see
    `cycle.scene.scene`.
    """
    rows = motion.rows
    picked = _picked(rows)
    drawn = scene(rows, picked=picked)
    picked_rows = rows.isel(position=picked)
    status = np.where(picked_rows["resting"].values == 1, RESTS, picked_rows["status"].values)
    status = np.where(np.isfinite(picked_rows["kinetic_energy"].values), status, NONE)
    over = abscissa(rows)
    last = float(picked_rows["time"].values[-1])
    factor = over.values[-1] / float(rows["time"].values[-1]) if last > 0 else 1.0
    forces, gaps = (members(picked_rows, f"contact_{name}", "contact") for name in ("normal_force", "gap"))
    # fmt: off
    of_motion: dict[str, Any] = {
        "duration": last,
        "free": [
            {"name": name, "unit": "rad" if effort == "N m" else "m",
             "coordinate": series(picked_rows["drive_coordinate"].values[i]),
             "rate": series(picked_rows["drive_rate"].values[i])}
            for i, name, effort in drivers_of(picked_rows)
        ],
        "contacts": [{"name": name, "force": series(force), "gap": series(gaps[name])}
                     for name, force in forces.items()],
        "energies": [{"label": text, "values": series(values)} for _, text, values in energies(picked_rows)],
        "events": [
            {"at": float(f"{min(event.time, last) * factor:.9g}"), "word": event.word,
             "quiet": event.word in OF_IMPACTS} for event in motion.events
        ],
    }
    # fmt: on
    return drawn | {
        "status": [int(code) for code in status],
        "states": drawn["states"] | {str(code): text for code, text in STATES.items()},
        "gaps": [],
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
