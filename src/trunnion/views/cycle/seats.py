"""Seats of the pins in their holes: each pin in its hole, much magnified, and its place over the drive.

The play is to scale; the radii of pin and hole are not, or the play could not be seen beside them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.quantities import number, prefixed, quantity
from trunnion.views.axis import Abscissa, Array, abscissa, names
from trunnion.views.charts import Arrow, Axis, Chart, Legend, Line, Look, Mark, Note, Panel, Plot, Ring, silent
from trunnion.views.cycle.deviations import Seats, losses, need, seat_angles, seated

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["PIN", "beta", "described", "seat"]

PIN = 1.1  # radius of the pin as drawn, of the clearance
WALL = 0.25  # thickness of the hole's wall as drawn
ARROW = 0.8  # length of the largest load
ROOM = 1.0 + PIN + ARROW + 0.6  # half width of a diagram
WEAK = 0.02  # of the largest load: a smaller one has no arrow
LONGEST = 16  # signs of a link's name


# ---- in the hole --------------------------------------------------------------------------------------------------


def seat(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Pin in hole for every joint and end: locus of the pin's centre over the drive, marked positions, their loads."""
    need(result, "seats", "seat")
    over, charts, paired = abscissa(result), list[Chart](), False
    for seats in seated(result):
        if seats.planar_guide:  # see `beta`
            continue
        both = [(0, (0, 1)), (0, (0, 2))] if seats.kind == "ball" else [(k, (0, 1)) for k in range(len(seats.offsets))]
        paired |= len(both) == 2  # both ends of a joint stay side by side
        charts += [_hole(seats, end, plane, over) for end, plane in both]
    if not charts:
        raise MechanismError(
            Finding("the seats are those of guides in the plane", "--kind seat", "see the figure 'beta'")
        )
    few = len(charts) if len(charts) <= 2 else 2 if len(charts) == 4 else 3
    columns = few if not paired else 2 if len(charts) <= 2 else 4
    width = {1: 4.6, 4: 10.4}.get(columns, 7.4)
    panels = [Panel("", [chart], width / columns + 0.55) for chart in charts]
    return Plot("Seats of the pins in their holes", panels, columns, width)


def _hole(seats: Seats, end: int, plane: tuple[int, int], over: Abscissa) -> Chart:
    """Pin in hole: wall, clearance, locus, and at the marked positions the pin with its load."""
    factor, unit = prefixed(seats.clearance, "m")
    rho, offset = seats.clearance * factor, seats.offsets[end, list(plane)] * factor
    force, square, most = seats.forces[end, list(plane)], seats.kind == "guide", seats.peak
    share = (over.values - float(over.values.min())) / (over.span or 1.0)  # places on the scale of colours
    wall = [Ring((0.0, 0.0), size * rho, look, square, filled) for size, look, filled in (
        (1 + PIN + WALL, Look("shade", 0.0, order=0.7), 1.0), (1 + PIN, Look("ink", 1.4, order=0.8), 0.0),
        (1.0, Look("muted", 0.8, "dashed", order=2.0), 0.0))]  # fmt: skip
    marks: list[Mark] = [*wall, *_locus(offset, share, over, rho)]
    picked = [0, over.values.size // 2, over.values.size - 1]  # positions that are named
    if over.closed:
        angles = over.values[0] + over.period * np.arange(4) / 4
        picked = [int(np.argmin(np.abs(over.values - angle))) for angle in angles]
    for index in (index for index in dict.fromkeys(picked) if np.isfinite(offset[:, index]).all()):
        paint, place = Look(float(share[index])), offset[:, index]
        at = (float(place[0]), float(place[1]))
        marks.append(Ring(at, PIN * rho, paint.but(width=1.1, alpha=0.85, order=1.5), square, 0.07))
        marks.append(Line(place[:1], place[1:], None, paint.but(dash="none", mark="o", size=5.5, order=5.0)))
        if np.hypot(*force[:, index]) > WEAK * most:
            size = float(np.hypot(*place))
            start = place * (1 + PIN * rho / size) if size > 1e-9 * rho else place
            tip = start + force[:, index] / most * ARROW * rho
            marks.append(Arrow((start[0], start[1]), (tip[0], tip[1]), paint.but(width=1.5, order=6.0)))
            marks.append(Note(over.say(index), tip[0], tip[1], data=True, size=7.5, beside=True))
    slack = seats.offsets[end, 2] * factor if seats.along > 0 else np.empty(0)
    if np.isfinite(slack).any():
        text = f"along the axis {number(float(np.nanmin(slack)), 3)} to {number(float(np.nanmax(slack)), 3)} {unit}"
        marks.append(Note(text, 0.02, 0.02, "left", "bottom", size=7.0))
    ends = [(-rho, f"−{rho:.3g}"), (0.0, ""), (rho, f"{rho:.3g}")]
    first, second = (name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…" for name in seats.links)
    below = f"\n{seats.kind} of {first} in {second}\nlongest load {quantity(seats.peak, 'N')}"
    x, y = (Axis(f"{'xyz'[axis]} [{unit}]{text}", (-ROOM * rho, ROOM * rho), ends)
            for axis, text in zip(plane, (below, ""), strict=True))  # fmt: skip
    title = seats.joint
    if seats.kind == "ball":
        title = f"{seats.joint}: {''.join('xyz'[axis] for axis in plane)}"
    elif len(seats.offsets) == 2:
        title = f"{seats.joint}, end {end + 1}"
    return Chart(x, y, marks, title=title, legend=None, equal=True)


def _locus(offset: Array, share: Array, over: Abscissa, jump: float) -> list[Mark]:
    """The track of the pin's centre in the colours of the drive, broken where it jumps, with a dot on each position."""
    if over.closed:
        offset, share = np.hstack([offset, offset[:, :1]]), np.append(share, share[0])
    cuts = np.flatnonzero(~(np.linalg.norm(np.diff(offset, axis=1), axis=0) < jump)) + 1
    marks = list[Mark]()
    for part, hue in zip(np.split(offset, cuts, axis=1), np.split(share, cuts), strict=True):
        if part.shape[1] > 1:
            marks.append(Line(part[0], part[1], None, Look(0, 2.6, order=3.0), shares=hue))
        elif np.isfinite(part).all():
            marks.append(Line(part[0], part[1], None, Look(float(hue[0]), dash="none", mark="o", size=3.7, order=3.0)))
    return marks


# ---- over the drive -----------------------------------------------------------------------------------------------


def beta(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """β and ξ of every pin in space, ξ of those of the plane, the offsets of both ends of a guide of the plane.

    A dot for every position, as seats jump; crosses mark the positions without contact.
    """
    need(result, "seats", "beta")
    charts = _courses(result)
    if not charts:
        what = "the seats of balls are directions, not angles: there is no figure 'beta'"
        raise MechanismError(Finding(what, "--kind", "see the figure 'seat'"))
    return Plot("Seats over the run", [Panel("", charts, 0.8 + 2.3 * len(charts))])


def described(result: xr.Dataset) -> bool:
    """Whether any seat has angles or offsets to draw over the run."""
    return bool(_courses(result))


def _courses(result: xr.Dataset) -> list[Chart]:
    """A chart of each of β, ξ and the offsets across guides, of those that any joint has."""
    over, lost = abscissa(result), losses(result)
    guides = [seats for seats in seated(result) if seats.planar_guide]
    factor, unit = prefixed(max((seats.clearance for seats in guides), default=0.0), "m")
    titles = {"β": "β, between the seats\nof the ends [°]", "ξ": "ξ, direction of\nthe seat [°]",
              "guide": f"offset across\nthe guide [{unit}]"}  # fmt: skip
    curves = [(sign, joint, joint, values, True) for sign, joint, values in seat_angles(result)]
    curves += [("guide", seats.joint, f"{seats.joint}, end {end + 1}", seats.offsets[end, 1] * factor, end == 0)
               for seats in guides for end in range(2)]  # fmt: skip
    charts, order = [], names(result, "joint")
    for kind, title in titles.items():
        marks = list[Mark]()
        for _, joint, name, values, filled in (curve for curve in curves if curve[0] == kind):
            dots = Look(order.index(joint), dash="none", mark="o", size=2.5 if filled else 4.0, hollow=not filled)
            marks.append(Line(over.values, values, name, dots))
            places = lost.get(joint, np.empty(0, int))
            if np.isfinite(values[places]).any():
                crosses = Look("limit", dash="none", mark="x", size=6.0, order=4.0)
                marks.append(Line(over.values[places], values[places], "contact lost", crosses))
        if marks:
            axis = Axis(title, angles=kind != "guide", margin=0.12)
            charts.append(Chart(over, axis, [*silent(result, over), *marks], zero=True, legend=Legend(1)))
    return charts
