"""Views of assembly: whether a mechanism goes together with its clearances, and the ways in which its groups can be.

The ways stand in lines of text, as `check` prints them; their drawings are in `mode_drawings`.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from trunnion.results.attributes import summary_of
from trunnion.results.quantities import parts, prefixed, quantity
from trunnion.views.axis import Abscissa, abscissa, column, names
from trunnion.views.charts import Axis, Chart, Legend, Line, Look, Mark, Note, Panel, Plot, Rule, Stripe
from trunnion.views.curves import nth
from trunnion.views.page import Section, Table, counts, page

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.solve.assembly_modes import AssemblyMode, GroupModes

TITLE = "Clearance needed for assembly"
FITS = 0  # code of the status of a position that goes together
LEAST = 0.01  # of the need: a joint whose part is nowhere larger has no curve
MOST_JOINTS = 8  # named in a line
MOST_WAYS = 24  # in lines


# ---- clearance ------------------------------------------------------------------------------------------------------


def figure(result: xr.Dataset) -> Plot:
    """Needed clearance of all pins over the drive; needed share of the stated clearances, if any; parts of the joints.

    Grey: where the stated clearances do not suffice, if they are enough somewhere.
    """
    over, share = abscissa(result), column(result, "needed_share")
    need, most = np.asarray(result["needed_clearance"].values, float), float(result["smallest_clearance"])
    need = np.where(np.isfinite(need), need, np.nan)
    factor, unit = prefixed(float(np.nanmax(need, initial=0.0)), "m")
    short = np.asarray(result["status"].values) != FITS
    grey: list[Mark] = [Stripe(float(over.values[at]) - over.half_step, float(over.values[at]) + over.half_step)
                        for at in np.flatnonzero(short & ~short.all())]  # fmt: skip
    marks: list[Mark] = [*grey, Line(over.values, need * factor, None, Look(0, 2.0), close=True)]
    axis = Axis(f"needed clearance [{unit}]", (-0.1, 1), places=[])
    if np.isfinite(most) and most > 0:
        text = f"smallest clearance, the same in {result.attrs['assembling']}: {quantity(most, 'm')}"
        marks += _limit(most * factor, text, over, "ink", "muted")
        axis = Axis(axis.title, (0, 1.22 * most * factor))
    elif np.isfinite(need).any() and most == 0:
        marks.append(Note("no clearance is needed", 0.5, 0.5, colour="ink", size=9.0))
    charts = [Chart(over, axis, marks, zero=True)]
    if share is not None and np.any(np.isfinite(share) & (share > 0)):  # above 1 they do not suffice
        share = np.where(np.isfinite(share), share, np.nan)
        marks = [*grey, Line(over.values, share, None, Look(1, 2.0), close=True),
                 *_limit(1.0, "all of the stated clearances", over, "limit", "limit")]  # fmt: skip
        top = 1.2 * max(1.0, float(np.nanmax(share, initial=0.0)))
        charts.append(Chart(over, Axis("share of the stated", (0, top)), marks, zero=True))
    parts_of = 100 * np.asarray(result["uniform_part"].values, float).sum(axis=1)
    if (largest := float(np.nanmax(parts_of, initial=0.0))) > 0:
        lines = [Line(over.values, row, joint, nth(i), close=True)
                 for i, (joint, row) in enumerate(zip(names(result, "joint"), parts_of, strict=True))
                 if np.nanmax(row, initial=0.0) > 100 * LEAST]  # fmt: skip
        axis = Axis("share of the joint [%]", (0, min(105.0, 1.1 * largest)))
        charts.append(Chart(over, axis, lines, zero=True, legend=Legend(1)))
    return Plot(TITLE, [Panel("", charts, 1.4 + 1.6 * len(charts))])


def _limit(at: float, text: str, over: Abscissa, ink: str, paint: str) -> list[Mark]:
    """A level line with what it is, written above it."""
    left = float(over.values.min()) + 0.01 * over.span
    return [Rule(at, None, Look(paint, 0.9, "dashed"), upright=False),
            Note(text, left, at, "left", "bottom", data=True, colour=ink, shift=(0, 3))]  # fmt: skip


def report(result: xr.Dataset) -> str:
    """The whole report as HTML."""
    rows = []  # the figures of the summary, as the terminal shows them
    for row in summary_of(result):
        value = "undefined" if row.value is None else row.value
        text, unit = (value, "") if isinstance(value, str) else parts(value, row.unit)
        rows.append([row.label, text, "" if unit == "1" else unit])
    after = [Table("results", ["", "value", "unit"], rows)]
    part = Section("Over the cycle", pictures=[(TITLE, figure(result))], after=after)
    return page(result, TITLE, counts((result.sizes["position"], "position")), [part])


# ---- ways to assemble -----------------------------------------------------------------------------------------------


def lines(choice: GroupModes) -> list[str]:
    """The position if it is not the start, each way with its joints, and what to write to take another."""
    wide = max(len(mode.name) for mode in choice.ways)
    texts = [f"at {choice.where}:"] * bool(choice.where)
    modes = some(choice, MOST_WAYS)
    texts += [f"{mode.name:<{wide}}  {places(choice, mode)}{'  <- used' * mode.taken}" for mode in modes]
    texts += [f"… and {len(choice.ways) - len(modes)} more"] * (len(modes) < len(choice.ways))
    other = next(mode for mode in choice.ways if not mode.taken)
    return [*texts, f"to use another: {choice.line(other)}"]


def some(choice: GroupModes, most: int) -> list[AssemblyMode]:
    """The first ways of a choice, no more than `most`, the one that is taken always among them."""
    first = list(choice.ways[:most])
    used = [mode for mode in choice.ways[most:] if mode.taken]
    return [*first[: len(first) - len(used)], *used]


def places(choice: GroupModes, assembly_mode: AssemblyMode) -> str:
    """Where the inner joints of a group are in one of its ways: 'C (70, 130) mm'; stated as a hint, it selects this."""
    sizes = [abs(n) for mode in choice.ways for joint in mode.joints.values() for n in joint if math.isfinite(n)]
    turned = ", ".join(f"{name} {round(math.degrees(angle), 6) + 0.0:.6g}°"
                       for name, angle in list(assembly_mode.turns.items())[:MOST_JOINTS])  # fmt: skip
    if not max(sizes, default=0.0):
        return turned or ("at the origin" if sizes else "")
    factor, unit = prefixed(max(sizes), "m")
    placed = []
    for name, joint in list(assembly_mode.joints.items())[:MOST_JOINTS]:
        texts = [f"{round(value * factor, 6) + 0.0:.6g}" for value in joint]
        placed.append(f"{name} ({', '.join(texts)})" if len(texts) > 1 else f"{name} at {texts[0]}")
    listed = ", ".join(placed) + ", …" * (len(assembly_mode.joints) > MOST_JOINTS) + f" {unit}"
    return f"{listed}; {turned}" if turned else listed
