"""Seats of the pins in their holes: each pin in its hole, much magnified, and its place over the drive.

The play is to scale; the radii of pin and hole are not, or the play could not be seen beside them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.results.quantities import number, prefixed, quantity
from trunnion.views.charts import Arrow, Axis, Chart, Legend, Line, Look, Mark, Note, Panel, Plot, Ring, nth, silent
from trunnion.views.common.cycle import Abscissa, Array, abscissa, names
from trunnion.views.cycle.deviations import JUMP, NOWHERE, Seats, broken, losses, need, seat_angles, seated

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["PIN", "beta", "described", "seat"]

PIN = 1.1  # radius of the pin as drawn, of the clearance
WALL = 0.25  # thickness of the hole's wall as drawn
ARROW = 0.8  # length of the largest load
ROOM = 1.0 + PIN + ARROW + 0.6  # half width of a diagram
WEAK = 0.02  # of the largest load: a smaller one has no arrow
LONGEST = 16  # signs of a link's name
# two curves that often coincide: one broad and pale, one thin and dashed over it
ENDS = (Look(0, 4.0, alpha=0.4), Look(0, 1.4, "long"))


# ---- in the hole --------------------------------------------------------------------------------------------------


def seat(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Pin in hole for every joint and end: locus of the pin's centre over the drive, marked positions, their loads."""
    need(result, "seats", "seat")
    over, charts, paired = abscissa(result), list[Chart](), False
    for seats in seated(result):
        if seats.planar_guide:
            charts.append(_guide(seats, over))
            continue
        both = [(0, (0, 1)), (0, (0, 2))] if seats.kind == "ball" else [(k, (0, 1)) for k in range(len(seats.offsets))]
        paired |= len(both) == 2  # both ends of a joint stay side by side
        charts += [_hole(seats, end, plane, over) for end, plane in both]
    few = len(charts) if len(charts) <= 2 else 2 if len(charts) == 4 else 3
    columns = few if not paired else 2 if len(charts) <= 2 else 4
    width = {1: 4.6, 4: 10.4}.get(columns, 7.4)
    panels = [Panel("", [chart], width / columns + 0.55) for chart in charts]
    return Plot("Seats of the pins in their holes", panels, columns, width)


def _share(over: Abscissa) -> Array:
    """Places of the positions on the scale of colours."""
    low = float(over.values.min(initial=np.inf))
    return (over.values - low) / (over.span or 1.0)


def _marked(over: Abscissa, solved: NDArray[np.bool_]) -> list[int]:
    """Positions that are told by name: every quarter of a turn, or start, middle and end of a way."""
    picked = [0, over.values.size // 2, over.values.size - 1]
    if over.closed:
        angles = over.values[0] + over.period * np.arange(4) / 4
        picked = [int(np.argmin(np.abs(over.values - angle))) for angle in angles]
    return [index for index in dict.fromkeys(picked) if solved[index]]


def _hole(seats: Seats, end: int, plane: tuple[int, int], over: Abscissa) -> Chart:
    """Pin in hole: wall, clearance, locus, and at the marked positions the pin with its load."""
    factor, unit = prefixed(seats.clearance, "m")
    rho, offset = seats.clearance * factor, seats.offsets[end, list(plane)] * factor
    force, square, share, most = seats.forces[end, list(plane)], seats.kind == "guide", _share(over), seats.peak
    wall = [Ring((0.0, 0.0), size * rho, look, square, filled) for size, look, filled in (
        (1 + PIN + WALL, Look("shade", 0.0, order=0.7), 1.0), (1 + PIN, Look("ink", 1.4, order=0.8), 0.0),
        (1.0, Look("muted", 0.8, "dashed", order=2.0), 0.0))]  # fmt: skip
    marks: list[Mark] = [*wall, *_locus(offset, share, over, rho)]
    for index in _marked(over, np.asarray(np.isfinite(offset).all(axis=0))):
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
    ends = [(-rho, _tick(-rho)), (0.0, ""), (rho, _tick(rho))]
    x, y = (Axis(f"{'xyz'[axis]} [{unit}]", (-ROOM * rho, ROOM * rho), ends) for axis in plane)
    title = seats.joint
    if seats.kind == "ball":
        title = f"{seats.joint}: {''.join('xyz'[axis] for axis in plane)}"
    elif len(seats.offsets) == 2:
        title = f"{seats.joint}, end {end + 1}"
    return Chart(_described(x, seats), y, marks, title=title, legend=None, equal=True)


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


def _guide(seats: Seats, over: Abscissa) -> Chart:
    """A guide of the plane: the middle line of the bar between its limits, across magnified, along to another scale."""
    factor, unit = prefixed(seats.clearance, "m")
    long, long_unit = prefixed(seats.length or 1.0, "m")
    rho, half = seats.clearance * factor, 0.5 * (seats.length or 1.0) * long
    x, ends, share = np.array([-half, half]), seats.offsets[:, 1] * factor, _share(over)
    marks: list[Mark] = [Line(x, np.full(2, side * rho), None, Look("ink", 1.4, order=1.0)) for side in (1, -1)]
    marks.append(Line(x, np.zeros(2), None, Look("muted", 0.8, "dash-dot", order=0.8)))
    for index in _marked(over, np.asarray(np.isfinite(ends).all(axis=0))):
        paint = Look(float(share[index]), 2.2, mark="o", size=4.0, order=3.0)
        marks.append(Line(x, ends[:, index], None, paint))
        for end, load in enumerate(seats.forces[:, 1, index]):
            if abs(load) > WEAK * seats.peak:
                low = (float(x[end]), float(ends[end, index]))
                tip = (low[0], float(low[1] + load / seats.peak * ARROW * rho))
                marks.append(Arrow(low, tip, paint.but(width=1.5, order=6.0)))
        marks.append(
            Note(over.say(index), 0.5 * half, float(ends[:, index] @ [0.25, 0.75]), data=True, size=7.5, beside=True)
        )
    y = Axis(f"across [{unit}]", (-2.4 * rho, 2.4 * rho), [(side * rho, _tick(side * rho)) for side in (-1, 0, 1)])
    along = Axis(f"along the guide [{long_unit}]", (-1.2 * half, 1.2 * half), count=4)
    return Chart(_described(along, seats), y, marks, title=seats.joint, legend=None)


def _described(axis: Axis, seats: Seats) -> Axis:
    """The axis with what lies in what, and the load that the longest arrow stands for."""
    first, second = (name if len(name) <= LONGEST else f"{name[: LONGEST - 1]}…" for name in seats.links)
    lines = [axis.title, f"{seats.kind} of {first} in {second}", f"longest load {quantity(seats.peak, 'N')}"]
    return Axis("\n".join(lines), axis.limits, axis.places, count=axis.count)


def _tick(value: float) -> str:
    return f"{value:.3g}".replace("-", "−")


# ---- over the drive -----------------------------------------------------------------------------------------------


def beta(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """β and ξ of every pin in space, ξ of those of the plane, the offsets of both ends of a guide of the plane.

    Jumps are not crossed; crosses mark the positions without contact.
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
    order = {joint: k for k, joint in enumerate(names(result, "joint"))}
    curves: dict[str, list[tuple[str, Line]]] = {"β": [], "ξ": [], "guide": []}
    guides = [seats for seats in seated(result) if seats.planar_guide]
    scale, unit = prefixed(max((seats.clearance for seats in guides), default=0.0), "m")
    for seats in guides:
        for end, look in enumerate(ENDS):
            line = Line(over.values, seats.offsets[end, 1] * scale, f"{seats.joint}, end {end + 1}",
                        look.but(colour=order[seats.joint]))  # fmt: skip
            curves["guide"].append((seats.joint, line))
    for sign, joint, values in seat_angles(result):
        curves[sign].append((joint, Line(over.values, values, joint, nth(order[joint]))))
    turn = float(np.degrees(JUMP))
    titles = {
        "β": ("β, between the seats\nof the ends [°]", turn), "ξ": ("ξ, direction of\nthe seat [°]", turn),
        "guide": (f"offset across\nthe guide [{unit}]", scale * min((g.clearance for g in guides), default=0.0)),
    }  # fmt: skip
    charts, gone = [], np.concatenate([NOWHERE, *lost.values()])
    for sign, lines in curves.items():
        if lines:
            title, jump = titles[sign]
            marks = [*silent(result, over), *(_cut(line, over, jump, gone) for _, line in lines)]
            axis = Axis(title, angles=sign != "guide", margin=0.12)
            charts.append(Chart(over, axis, [*marks, *_crosses(lines, lost)], zero=True, legend=Legend(least=1)))
    return charts


def _cut(line: Line, over: Abscissa, jump: float, lost: NDArray[np.intp]) -> Line:
    """The curve, over a whole turn led on to its first value, with a gap wherever it jumps."""
    x, y = line.x, line.y
    if over.closed:
        x, y = np.append(x, x[0] + over.period), np.append(y, y[0])
    x, y = broken(x, y, jump, lost)
    if over.closed and np.isnan(y[-2]):  # a jump on closing: the last point is the first once more
        x, y = x[:-2], y[:-2]
    return line._replace(x=x, y=y)


def _crosses(lines: list[tuple[str, Line]], lost: dict[str, NDArray[np.intp]]) -> list[Mark]:
    """Crosses on the curves where their joints lose contact."""
    marks = list[Mark]()
    for joint, line in lines:
        places = lost.get(joint, NOWHERE)
        places = places[np.isfinite(line.y[places])]
        if places.size:
            look = Look("limit", dash="none", mark="x", size=6.0, order=4.0)
            marks.append(Line(line.x[places], line.y[places], None if marks else "contact lost", look))
    return marks
