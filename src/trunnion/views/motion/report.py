"""The report of a motion in time as one HTML file: the moving mechanism in real time, curves, events, energy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.results.quantities import prefixed, quantity
from trunnion.views.cycle.report import page
from trunnion.views.motion.figure import pictures
from trunnion.views.motion.scene import motion_scene
from trunnion.views.motion.shown import Shown, energies, shown
from trunnion.views.page import source

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MOST_EVENTS", "report"]

MOST_EVENTS = 200  # rows of the table
LOST = ("work_friction", "work_contact", "work_clutch")
HELD = (
    "kinetic_energy",
    "potential_energy",
    "contact_energy",
)  # what is left in the links of what came in and went out
RESIDUAL = "works less changes of the energies, relative to the largest of them"


def report(result: xr.Dataset) -> str:
    """The report as one HTML page: figures of the motion, moving mechanism, curves over time, events, findings."""
    motion = shown(result)
    events = motion.events[:MOST_EVENTS]
    over = {
        "length": _stated(motion.end),
        "asked": _stated(motion.asked) if motion.early else "",
        "events": [{"seconds": f"{one.time:.9g}", "time": quantity(one.time, "s"), "cells": one[1:]} for one in events],
        "more": len(motion.events) - len(events),
        "account": _account(motion.rows),
        "pictures": [{"alt": title, "source": source(drawn)} for title, drawn in pictures(result)],
    }
    return page(motion.rows, motion_scene(motion), over, _residual(motion))


def _stated(seconds: float) -> str:
    """A time as one would state it, without zeros that promise precision: "3 s"."""
    factor, unit = prefixed(seconds, "s")
    return f"{seconds * factor:.4g}\u00a0{unit}"


def _account(rows: xr.Dataset) -> dict[str, list[tuple[str, str]]]:
    """What came in and went out until the end, and what is left; empty where nothing moves."""
    known = energies(rows)
    if not known:
        return {}

    def lines(held: bool) -> list[tuple[str, str]]:
        found = []
        for name, text, course in known:
            if (name in HELD) is held:
                title = f"change of the {text}" if held else text
                value = float(course[-1]) * (-1 if name in LOST else 1)
                found.append((title[:1].upper() + title[1:], quantity(value, "J")))
        return found

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
