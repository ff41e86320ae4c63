"""The figures an engineer expects of a linkage: each a function of the result, and if wanted of the ideal one.

`PLOTS` is the list; `save` writes a figure as PNG, SVG or PDF. `ideal` is the same run without friction.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rc_context
from matplotlib.lines import Line2D

from trunnion.errors import Finding, MechanismError, Status
from trunnion.files import whole
from trunnion.joints.pairs import GUIDED
from trunnion.results.dataset import units_along
from trunnion.results.quantities import prefixed, quantity
from trunnion.results.scales import without_noise
from trunnion.views.common.cycle import (
    Abscissa,
    Array,
    abscissa,
    column,
    layout,
    mean_friction,
    names,
    status_text,
    thin,
)
from trunnion.views.common.drawing import draw, picture
from trunnion.views.common.figures import (
    INK,
    MUTED,
    PALETTE,
    SHADE,
    along,
    curve,
    dress,
    frame_peak,
    legend,
    new,
    shade,
    square,
    style_of,
)
from trunnion.views.common.joined import joined
from trunnion.views.common.labels import Labels
from trunnion.views.common.lettering import plain
from trunnion.views.common.peaks import ease, peak, usual_peak
from trunnion.views.cycle.deviations import has
from trunnion.views.cycle.deviations_plot import error
from trunnion.views.cycle.locking_plot import has_friction, locking
from trunnion.views.cycle.marked import OVER_DRIVE, mark, position_at
from trunnion.views.cycle.measures_plot import drawn, measures
from trunnion.views.cycle.seat_curves import beta, described
from trunnion.views.cycle.seat_plot import seat
from trunnion.views.cycle.speed import speed, varying
from trunnion.views.space import figure as space_figure
from trunnion.views.space import plots as space_plots
from trunnion.views.space.bodies import is_spatial

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "PLOTS", "check_figure", "drawable", "friction_power", "mechanism", "motion", "polar", "power", "reactions", "save",
    "torque",
]  # fmt: skip

FORMATS = ("png", "svg", "pdf", "jpg", "jpeg")
NOTE: dict[str, Any] = {"textcoords": "offset points", "fontsize": 7.5, "color": INK, "ha": "center", "va": "center"}
FREE: dict[str, Any] = {"color": INK, "linewidth": 0.9, "linestyle": (0, (3, 2))}  # without friction, among many curves


def torque(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Figure:
    """Drive effort over the drive, one panel a driver; without friction dashed, its interval at zero slip as a band."""
    over, drivers = abscissa(result), names(result, "driver")
    units = units_along(result["drive_effort"], "driver")
    title = (
        "Drive force" if units and set(units) == {"N"} else "Drive torque" if set(units) == {"N m"} else "Drive effort"
    )
    figure = new(title, result, 2.0 + 2.3 * max(len(drivers), 1))
    panels = figure.subplots(max(len(drivers), 1), 1, sharex=True, squeeze=False)[:, 0]
    for axes, driver, unit in zip(panels, drivers, units, strict=False):
        effort = column(result, "drive_effort", driver=driver)
        free = None if ideal is None else column(ideal, "drive_effort", driver=driver)
        if effort is None:
            continue
        ends = [column(result, f"drive_effort_{end}", driver=driver) for end in ("lower", "upper")]
        scope = usual_peak(ease(result), effort, free, *ends)
        factor, shown = prefixed(scope, unit)
        noun = "force" if unit == "N" else "torque"
        along(axes, over, f"{noun} {plain(driver)} [{shown}]")
        shade(axes, result, over)
        label = "with friction" if free is not None else noun
        curve(axes, over, effort * factor, label, color=PALETTE[0], linewidth=2.0)
        if free is not None:
            curve(axes, over, free * factor, "without friction", **FREE)
        _band(axes, result, over, driver, factor)
        frame_peak(axes, peak(effort, free, *ends), scope, factor, unit)
    _only_last_titled(list(panels))
    legend(panels[0])
    return figure


def _band(axes: Axes, result: xr.Dataset, over: Abscissa, driver: str, factor: float) -> None:
    """Where the friction of a joint at rest is an interval, so is the effort: a bar at each such position."""
    low = column(result, "drive_effort_lower", driver=driver)
    high = column(result, "drive_effort_upper", driver=driver)
    if low is None or high is None:
        return
    wide = np.flatnonzero(high - low > 0.002 * usual_peak(ease(result), low, high))  # narrower ones would not be seen
    if wide.size:
        x = over.values[wide]
        axes.vlines(x, low[wide] * factor, high[wide] * factor, color=PALETTE[0], alpha=0.35, linewidth=4.0,
                    label="range, friction at rest")  # fmt: skip


def _only_last_titled(panels: list[Axes]) -> None:
    for axes in panels[:-1]:
        axes.set_xlabel("")


def friction_power(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Figure:
    """Power lost to friction in each joint and in all, with the mean of each over the run."""
    over, joints = abscissa(result), names(result, "joint")
    losses = {joint: column(result, "friction_power", joint=joint) for joint in joints}
    known = {joint: values for joint, values in losses.items() if values is not None and peak(values) > 0}
    total = np.sum(list(known.values()), axis=0) if known else np.zeros(over.values.size)
    scope = usual_peak(ease(result), total)
    factor, unit = prefixed(scope, "W")
    figure = new("Friction power by joint", result)
    axes = figure.subplots()
    along(axes, over, f"friction power [{unit}]")
    shade(axes, result, over)
    picked = thin(total)
    axes.fill_between(over.values[picked], 0, total[picked] * factor, color=SHADE, alpha=0.6, linewidth=0, zorder=1)
    means = {joint: mean_friction(result, joint) for joint in known}
    curve(axes, over, total * factor, f"all joints, {_mean(sum(means.values()))}", color=INK, linewidth=1.8)
    for joint, values in known.items():
        label = f"{joint}, {_mean(means[joint])}"
        curve(axes, over, values * factor, label, **style_of(joints.index(joint)), linewidth=1.4)
    frame_peak(axes, peak(total), scope, factor, "W")
    legend(axes, most=3)
    return figure


def _mean(value: float) -> str:
    return f"mean {quantity(value, 'W')}" if np.isfinite(value) else "not solved"


def _reaction(result: xr.Dataset, joint: str, plane: tuple[str, str] = ("x", "y")) -> Array:
    """Two components of the force, (2, position) N."""
    picked = result["reaction_force"].sel(joint=joint, axis=list(plane)).transpose("axis", "position")
    return np.asarray(picked.values, dtype=float)


def reactions(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Figure:
    """Magnitude of the reaction in each joint, of those with the same as one curve; without friction thin, dotted."""
    if is_spatial(result):
        return space_plots.reactions(result, ideal, FREE)
    over, joints = abscissa(result), names(result, "joint")
    forces = [np.hypot(*_reaction(result, joint)) for joint in joints]
    free = [] if ideal is None else [np.hypot(*_reaction(ideal, joint)) for joint in joints]
    scope = usual_peak(ease(result), *forces, *free)
    factor, unit = prefixed(scope, "N")
    figure = new("Joint reactions", result)
    axes = figure.subplots()
    along(axes, over, f"magnitude of the reaction [{unit}]")
    shade(axes, result, over)
    for label, first, force in joined(dict(zip(joints, forces, strict=True))):
        curve(axes, over, force * factor, label, **style_of(first))
    for index, (_, _, force) in enumerate(joined(dict(zip(joints, free, strict=False)))):
        curve(axes, over, force * factor, "without friction" if index == 0 else None, **FREE)
    frame_peak(axes, peak(*forces, *free), scope, factor, "N")
    legend(axes)
    return figure


def polar(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Figure:
    """Polar reaction diagrams: the tip of each joint's force vector over the run, in the global frame.

    In space a row for each joint: the vector seen along z, y and x.
    """
    over, joints = abscissa(result), names(result, "joint")
    planes = space_plots.PLANES if is_spatial(result) else (("x", "y"),)
    easy = ease(result)
    panels = [(index, joint, plane) for index, joint in enumerate(joints) for plane in planes]
    columns = min(len(panels), 2 if len(panels) in (2, 4) else 3) or 1
    rows = -(-len(panels) // columns) or 1
    figure = new("Polar diagrams of the joint reactions", result, 0.9 + rows * 7.4 / columns * 0.92)
    grid = figure.subplots(rows, columns, squeeze=False).ravel()
    for axes in grid[len(panels) :]:
        axes.set_visible(False)
    for axes, (index, joint, plane) in zip(grid, panels, strict=False):
        free = None if ideal is None else _reaction(ideal, joint, plane)
        colour = PALETTE[index % len(PALETTE)]
        title, force = joint if plane == planes[0] else "", _reaction(result, joint, plane)
        _hodograph(axes, over, title, plane, force, free, colour, easy)
    if ideal is not None:
        lines = [Line2D([], [], color=PALETTE[0], linewidth=1.6), Line2D([], [], **FREE)]
        figure.legend(lines, ["with friction", "without friction"], loc="upper right", ncols=2, frameon=False,
                      fontsize=8.5, labelcolor=INK)  # fmt: skip
    return figure


def _hodograph(
    axes: Axes, over: Abscissa, joint: str, plane: tuple[str, str], force: Array, free: Array | None, colour: str,
    easy: Array,
) -> None:  # fmt: skip
    sizes = [np.hypot(*vector) for vector in (force, free) if vector is not None]
    scope = usual_peak(easy, *sizes)
    factor, unit = prefixed(scope, "N")
    dress(axes, f"F{plane[0]} [{unit}]", f"F{plane[1]} [{unit}]")
    axes.set_title(plain(joint), fontsize=10, fontweight="bold", color=INK, loc="left")
    axes.axhline(0, color=MUTED, linewidth=0.8, zorder=1.5)
    axes.axvline(0, color=MUTED, linewidth=0.8, zorder=1.5)
    if free is not None:
        axes.plot(*_loop(free, over) * factor, **FREE)
    axes.plot(*_loop(force, over) * factor, color=colour, linewidth=1.6)
    if force.shape[1] == 1:  # one position has no track
        axes.plot(*np.hstack([np.zeros((2, 1)), force * factor]), color=colour, linewidth=1.6)
    _marks(axes, over, force * factor, colour, scope * factor)
    square(axes, peak(*sizes), scope, factor, "N")


def _loop(force: Array, over: Abscissa) -> Array:
    """The track of a vector, closed over a whole turn, at most some 5000 points of it."""
    stride = -(-force.shape[1] // 5000)
    kept = force[:, ::stride]
    return np.hstack([kept, force[:, :1]]) if over.closed else kept


def _marks(axes: Axes, over: Abscissa, force: Array, colour: str, scope: float) -> None:
    """Dots every 30°, with the angle at every 90° unless it would lie on another; without a turn only the start."""
    labelled: list[Array] = []
    wanted = np.arange(0, 360, 30) if over.closed else over.values[:1]
    for angle in wanted:
        index = int(np.argmin(np.abs((over.values - angle + 180) % 360 - 180))) if over.closed else 0
        place = force[:, index]
        if not np.isfinite(place).all() or np.abs(place).max() > scope:
            continue
        axes.plot(*place, "o", markersize=3.2, color=colour, markeredgecolor="white", markeredgewidth=0.5, zorder=4)
        crowded = any(np.hypot(*(place - other)) < 0.12 * scope for other in labelled)
        if not over.closed or (angle % 90 == 0 and not crowded):
            labelled.append(place)
            away = _outward(force, index)
            axes.annotate(over.say(index), (place[0], place[1]), xytext=(13 * away[0], 10 * away[1]), **NOTE)


def _outward(force: Array, index: int) -> Array:
    """Direction across the track of a vector at a position, away from the middle of the track."""
    known = force[:, np.isfinite(force).all(axis=0)]
    along = force[:, (index + 1) % force.shape[1]] - force[:, index - 1]
    size = np.hypot(*along)
    if not size > 0.0:  # one position, or a vector that stands still or has no value beside it
        return np.array([0.7, 0.9])
    across: Array = np.array([along[1], -along[0]]) / size
    inwards = across @ (force[:, index] - known.mean(axis=1)) < 0
    return -across if inwards else across


def mechanism(result: xr.Dataset, ideal: xr.Dataset | None = None, index: int | None = None) -> Figure:
    """The mechanism at a position, with coupler curves, joints named.

    If the position is not told: in the plane a telling one, with ghosts; in space that of the largest reaction.
    """
    if is_spatial(result):
        return space_figure.mechanism(result, index)
    shown = picture(result)
    count = result.sizes["position"]
    if index is None:
        index = _first_drawable(list(shown.tracks.values()))
    elif not 0 <= index < count:
        remedy = f"name one from 0 to {count - 1}"
        raise MechanismError(Finding(f"there is no position {index} among the {count}", "index", remedy))
    low_x, low_y, high_x, high_y = shown.box
    margin = 0.09 * shown.size
    width, height = high_x - low_x + 2 * margin, high_y - low_y + 2 * margin
    figure = new("Mechanism", result, min(max(7.0 * height / width, 2.6), 8.0) + 0.5)
    axes = figure.subplots()
    axes.set_aspect("equal")
    axes.set_xlim(low_x - margin, high_x + margin)
    axes.set_ylim(low_y - margin, high_y + margin)
    axes.axis("off")
    labels = Labels(figure)
    draw(axes, shown, index, labels)
    over = abscissa(result)
    facts = [f"{over.label} = {over.say(index)}", str(result.attrs.get("formula", ""))]
    status = int(result["status"].values[index])
    if status >= Status.NOT_CONVERGED:
        facts.append(status_text(status).split(":")[0])
    axes.set_title(plain("    ".join(facts)), fontsize=8.5, color=MUTED, loc="left")
    labels.place()
    return figure


def _first_drawable(tracks: list[Array]) -> int:
    """A telling position: an eighth into the longest of what can be drawn, so that links do not lie in one line."""
    known = np.flatnonzero(np.all([np.isfinite(track).all(axis=0) for track in tracks], axis=0))
    return int(known[known.size // 8]) if known.size else 0


def power(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Figure:
    """Where the power goes: drive, useful, friction, and the remainder that masses and other loads take or give."""
    over = abscissa(result)
    drive = np.asarray(result["drive_power"].sum("driver", skipna=False).values, dtype=float)
    useful = column(result, "useful_power")
    lost = np.asarray(result["friction_power"].sum("joint", skipna=False).values, dtype=float)
    useful = np.zeros_like(lost) if useful is None else useful
    rest = drive - useful - lost
    scope = usual_peak(ease(result), drive, useful, lost, rest)
    factor, unit = prefixed(scope, "W")
    figure = new("Power over the run", result)
    axes = figure.subplots()
    along(axes, over, f"power [{unit}]")
    shade(axes, result, over)
    curve(axes, over, drive * factor, "drive", color=PALETTE[0])
    curve(axes, over, useful * factor, "useful", color=PALETTE[2])
    curve(axes, over, lost * factor, "friction", color=PALETTE[1])
    if peak(rest) > 1e-9 * peak(drive, useful, lost):
        label = "masses, springs and other loads" if "spring" in result.dims else "masses and other loads"
        curve(axes, over, rest * factor, label, color=MUTED, linestyle=(0, (2, 1.5)), linewidth=1.2)
    frame_peak(axes, peak(drive, useful, lost, rest), scope, factor, "W")
    legend(axes)
    return figure


def motion(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Figure:
    """Angles of the turning links, slides of the sliding joints, and their rates; in space also those of the joints."""
    if is_spatial(result):
        return space_plots.motion(result)
    over, stated = abscissa(result), layout(result)
    turning = [name for name in names(result, "link")
               if name != stated["ground"] and _turns(column(result, "link_angle", link=name))]  # fmt: skip
    sliding = [name for name in names(result, "joint") if stated["joints"].get(name, {}).get("type") in GUIDED]
    kinds = [("link", "link_angle", turning, "angle", "rad")] if turning or not sliding else []
    if sliding:
        kinds.append(("joint", "joint_slide", sliding, "slide", "m"))
    figure = new("Motion", result, 6.4, 7.4 if len(kinds) == 1 else 9.6)
    grid = figure.subplots(3, len(kinds), sharex=True, squeeze=False)
    for panels, (dim, variable, members, noun, unit) in zip(grid.T, kinds, strict=True):
        _rates(list(panels), result, over, dim, variable, members, noun, unit)
        legend(panels[0], most=6 if len(kinds) == 1 else 3)
        if len(members) == 1:
            panels[0].set_title(plain(members[0]), fontsize=8.5, color=INK, loc="left")
    return figure


def _turns(angle: Array | None) -> bool:
    known = np.array([]) if angle is None else angle[np.isfinite(angle)]
    return known.size == 1 or (known.size > 1 and bool(np.ptp(known) > 1e-9))


def _rates(
    panels: list[Axes], result: xr.Dataset, over: Abscissa, dim: str, variable: str, members: list[str],
    noun: str, unit: str,
) -> None:  # fmt: skip
    """Three panels: the quantity and its first and second rate."""
    for order, axes in enumerate(panels):
        name = variable + ("", "_velocity", "_acceleration")[order]
        columns = {member: column(result, name, **{dim: member}) for member in members}
        scope = usual_peak(ease(result), *columns.values())
        scale, shown = prefixed(scope, unit) if order == 0 or unit == "m" else (1.0, unit)
        title = noun if order == 0 else ("velocity", "acceleration")[order - 1]
        rate = ("", "/s", "/s²")[order]
        along(axes, over, f"{title} [{shown}{rate}]")
        shade(axes, result, over)
        for index, (member, values) in enumerate(columns.items()):
            if values is not None:
                curve(axes, over, values * scale, member, close=order > 0 or unit == "m", **style_of(index))
        frame_peak(axes, peak(*columns.values()), scope, scale, unit + rate)
    _only_last_titled(panels)


PLOTS: dict[str, Callable[[xr.Dataset, xr.Dataset | None], Figure]] = {
    "torque": torque,
    "speed": speed,
    "friction-power": friction_power,
    "reactions": reactions,
    "polar": polar,
    "power": power,
    "mechanism": mechanism,
    "motion": motion,
    "error": error,
    "seat": seat,
    "beta": beta,
    "locking": locking,
    "measures": measures,
}
# whether a result has what a figure needs that not all results have
READY: dict[str, Callable[[xr.Dataset], bool]] = {
    "speed": lambda result: bool(varying(result)),
    "error": lambda result: has(result, "errors"),
    "seat": lambda result: has(result, "seats"),
    "beta": described,
    "locking": has_friction,
    "measures": lambda result: bool(drawn(result)),
}


def figure(
    result: xr.Dataset, kind: str = "torque", ideal: xr.Dataset | None = None, at: str | float | None = None
) -> Figure:
    """One figure. kind: of PLOTS; ideal: the same run without friction, to compare with.

    at: a place such as "60deg": the mechanism is drawn there, and curves over the drive are marked.
    """
    check_kinds([kind])
    index = None if at is None else position_at(result, at)
    result, ideal = without_noise(result), None if ideal is None else without_noise(ideal)
    if kind == "mechanism":
        return mechanism(result, ideal, index)
    whole_figure = PLOTS[kind](result, ideal)
    return whole_figure if index is None or kind not in OVER_DRIVE else mark(whole_figure, result, index)


def check_kind(kind: str) -> None:
    """MechanismError if there is no such kind of figure."""
    check_kinds([kind])


def check_kinds(kinds: Sequence[str]) -> None:
    """MechanismError if there is no such kind of figure."""
    unknown = [name for name in kinds if name not in PLOTS]
    if unknown:
        raise MechanismError(Finding(f"there is no plot '{unknown[0]}'", "--kind", f"use one of {', '.join(PLOTS)}"))


def drawable(result: xr.Dataset) -> list[str]:
    """The kinds of figures that a result has something for."""
    return [name for name in PLOTS if name not in READY or READY[name](result)]


def check_figure(path: Path) -> str:
    """The format that a figure would be written in, by the extension; MechanismError if it is none."""
    kind = path.suffix.lower().lstrip(".")
    if kind not in FORMATS:
        raise MechanismError(Finding("is no kind of figure", str(path), "end the name in .png, .svg, .pdf or .jpg"))
    return kind


def save(figure: Figure, path: str | os.PathLike[str]) -> Path:
    """Write a figure by its extension, whole or not at all; the same figure gives the same file.

    Raises MechanismError for another extension than .png, .svg, .pdf and .jpg, and where it cannot be written.
    """
    target = Path(path)
    kind = check_figure(target)
    undated = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
    made = BytesIO()  # written by Python: where the disk is full, matplotlib's PDF raises what is no OSError
    with whole(target) as draft:
        with rc_context({"svg.hashsalt": "trunnion"}):
            figure.savefig(made, format=kind, dpi=200, metadata=undated)
        draft.write_bytes(made.getbuffer())
    return target
