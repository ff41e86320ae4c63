"""What a cycle has over its drive as charts: efforts, powers, reactions, motion, measures, errors.

Each kind is a function of the result and, if wanted, of the same run without friction, and gives a `Plot`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from trunnion.cycle.locking import HELD_AND_DRIVEN, LockingState
from trunnion.errors import Finding, MechanismError
from trunnion.joints.pairs import GUIDED, PAIRS
from trunnion.results.attributes import attribute, summary_of
from trunnion.results.dataset import units_along
from trunnion.results.quantities import number, prefixed, quantity, scaled
from trunnion.solve.friction_method import MARGIN
from trunnion.views.axis import (
    Abscissa,
    Array,
    abscissa,
    column,
    ease,
    is_spatial,
    larger_end,
    layout,
    mean_friction,
    members,
    names,
    peak,
    usual_peak,
)
from trunnion.views.charts import (
    FREE,
    Axis,
    Band,
    Chart,
    Legend,
    Line,
    Look,
    Mark,
    Note,
    Panel,
    Plot,
    Rule,
    Stripe,
    nth,
    outside,
    over_drive,
    silent,
)
from trunnion.views.cycle.deviations import losses, need, outputs, point_errors, worst_points

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "drawn_measures", "error", "friction_power", "has_friction", "locking", "measures", "motion", "polar", "power",
    "reactions", "speed", "torque", "varying",
]  # fmt: skip

SEEN = 0.002  # of the largest effort: narrower ranges would not be seen
STEADY = 1e-6  # of the largest speed: variations that are none
MOST_POINTS = 5000  # of the track of a vector
PLANES = ((0, 1), (0, 2), (1, 2))
TURN = 2 * np.pi
RATES = ("", "/s", "/s²")
LEVELS = ("maximum", "minimum", "mean", "value", "largest")  # aspects of a figure that is a value of the course
HEIGHT = 2.3  # of one of several charts below one another, inches


def _stack(title: str, charts: Sequence[Chart], parts: Sequence[float] = ()) -> Plot:
    """Charts below one another; parts: shares of the height."""
    return Plot(title, [Panel("", charts, 0.6 + HEIGHT * len(charts) if len(charts) > 1 else 3.75, parts)])


def _lines(over: Abscissa, courses: Mapping[str, Array], width: float = 1.6) -> list[Line]:
    """A curve for every course, in the colours of their order."""
    return [Line(over.values, course, name, nth(k).but(width=width), close=True)
            for k, (name, course) in enumerate(courses.items())]  # fmt: skip


# ---- effort and power ---------------------------------------------------------------------------------------------


def torque(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Drive effort over the drive, one panel a driver; without friction dashed, its interval at zero slip as bars."""
    over, charts, nouns = abscissa(result), list[Chart](), dict[str, None]()
    efforts, lows, highs = (members(result, f"drive_effort{end}", "driver") for end in ("", "_lower", "_upper"))
    free = {} if ideal is None else members(ideal, "drive_effort", "driver")
    for (driver, effort), unit in zip(efforts.items(), units_along(result["drive_effort"], "driver"), strict=True):
        noun = "force" if unit == "N" else "torque"
        nouns[noun] = None
        lines = [Line(over.values, effort, "with friction" if driver in free else noun, Look(0, 2.0), close=True)]
        if driver in free:
            lines.append(Line(over.values, free[driver], "without friction", FREE, close=True))
        if driver in lows:
            low, high = lows[driver], highs[driver]
            wide = high - low > SEEN * usual_peak(ease(result), low, high)
            if wide.any():
                middle, half = np.where(wide, (low + high) / 2, np.nan), (high - low) / 2
                look = Look(0, 2.0, "none", alpha=0.35)
                lines.append(Line(over.values, middle, "range, friction at rest", look, half, half))
        charts.append(over_drive(result, over, f"{noun} {driver}", unit, lines))
    return _stack(f"Drive {'effort' if len(nouns) != 1 else ''.join(nouns)}", charts or [Chart(over, Axis(), [])])


def varying(result: xr.Dataset) -> dict[str, tuple[Array, str]]:
    """Speed and unit of every driver whose speed varies."""
    speeds, joints = {}, layout(result)["joints"]
    for driver in names(result, "driver"):
        slides = joints.get(driver, {}).get("type") in GUIDED
        values = column(result, f"joint_{'slide' if slides else 'rotation'}_velocity", joint=driver)
        if values is not None and _varies(values, STEADY * peak(values)):
            speeds[driver] = values, "m/s" if slides else "rad/s"
    return speeds


def speed(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Speed of the drivers over the cycle, where it varies: of a stated motion law, or of a steady cycle."""
    over, speeds = abscissa(result), varying(result)
    if not speeds:
        what, remedy = "the speed of no driver varies", "use `trunnion simulate --steady`, or a motion law"
        raise MechanismError(Finding(what, "speed", remedy))
    charts = []
    for name, (values, unit) in speeds.items():
        line = Line(over.values, values, name, Look(0, 2.0), close=True)
        charts.append(over_drive(result, over, f"speed {name}", unit, [line]))
    return _stack("Speed", charts)


def friction_power(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Power lost to friction in each joint and in all, with the mean of each over the run."""
    over, losses_of = abscissa(result), members(result, "friction_power", "joint")
    rubbing = {joint: values for joint, values in losses_of.items() if peak(values) > 0}
    total = np.sum(list(rubbing.values()), axis=0) if rubbing else np.zeros(over.values.size)
    factor, unit = prefixed(usual_peak(ease(result), total), "W")
    means = {joint: mean_friction(result, joint) for joint in rubbing}

    def named(text: str, mean: float) -> str:
        return f"{text}, mean {number(mean * factor)} {unit}" if np.isfinite(mean) else f"{text}, not solved"

    lines = [line._replace(name=named(str(line.name), means[str(line.name)]))
             for line in _lines(over, losses_of, 1.4) if line.name in rubbing]  # fmt: skip
    every = Line(over.values, total, named("all joints", sum(means.values())), Look("ink", 1.8), close=True)
    area = Band(over.values, np.zeros(total.size), total, None, Look("shade", alpha=0.6, order=1.0), close=True)
    return _stack("Friction power by joint", [over_drive(
        result, over, "friction power", "W", [every, *lines], bands=[area], scale=(factor, unit), legend=Legend()
    )])  # fmt: skip


def power(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Where the power goes: drive, useful, friction, and the remainder that masses and other loads take or give."""
    over = abscissa(result)
    drive, lost = (np.sum(list(members(result, name, dim).values()), axis=0)
                   for name, dim in (("drive_power", "driver"), ("friction_power", "joint")))  # fmt: skip
    useful = column(result, "useful_power")
    useful = np.zeros_like(lost) if useful is None else useful
    rest = drive - useful - lost
    parts = [("drive", drive, Look(0)), ("useful", useful, Look(2)), ("friction", lost, Look(1))]
    if peak(rest) > 1e-9 * peak(drive, useful, lost):
        label = "masses, springs and other loads" if "spring" in result.dims else "masses and other loads"
        parts.append((label, rest, Look("muted", 1.2, "short")))
    lines = [Line(over.values, values, name, look, close=True) for name, values, look in parts]
    return _stack("Power over the run", [over_drive(result, over, "power", "W", lines)])


# ---- reactions ----------------------------------------------------------------------------------------------------


def reactions(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Magnitude of the reaction in each joint, in space also of its moment, and the larger load on the ends of each
    bearing; without friction thin, dotted."""
    over, joints = abscissa(result), names(result, "joint")
    parts = [("magnitude of the reaction", "reaction_force", "N")]
    if is_spatial(result):
        parts = [("force of the reaction", "reaction_force", "N"), ("moment of the reaction", "reaction_moment", "N m")]
    if "end_load" in result:
        parts.append(("larger load on an end", "end_load", "N"))

    def sizes(of: xr.Dataset, variable: str) -> dict[str, Array]:
        if variable == "end_load":
            return {joint: size for joint in joints if (size := larger_end(of, joint)) is not None}
        return {joint: np.linalg.norm(values, axis=0) for joint, values in members(of, variable, "joint").items()}

    charts = []
    for title, variable, unit in parts:
        lines = [Line(over.values, size, joint, nth(joints.index(joint)), close=True)
                 for joint, size in sizes(result, variable).items()]  # fmt: skip
        free = [] if ideal is None else sizes(ideal, variable).values()
        lines += [Line(over.values, size, None if k else "without friction", FREE, close=True)
                  for k, size in enumerate(free)]  # fmt: skip
        charts.append(over_drive(result, over, title, unit, lines))
    return _stack("Joint reactions", charts)


def polar(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Polar reaction diagrams: the tip of each joint's force vector over the run, in the global frame.

    In space a row for each joint: the vector seen along z, y and x.
    """
    over = abscissa(result)
    forces = [members(of, "reaction_force", "joint") for of in (result, ideal) if of is not None]
    planes = PLANES if is_spatial(result) else PLANES[:1]
    charts = [_hodograph([of[joint][list(plane)] for of in forces], ease(result), over, joint, plane, index)
              for index, joint in enumerate(forces[0]) for plane in planes]  # fmt: skip
    columns = min(len(charts), 2 if len(charts) in (2, 4) else 3) or 1
    panels = [Panel("", [chart], 6.8 / columns) for chart in charts]
    note = "" if ideal is None else "dashed: without friction"
    return Plot("Polar diagrams of the joint reactions", panels, columns, 7.4, note)


def _hodograph(
    forces: list[Array], easy: Array, over: Abscissa, joint: str, plane: tuple[int, int], index: int
) -> Chart:
    """The tracks of a joint's force in a plane, a dot every 30° of the drive, named every 90°."""
    sizes = [np.hypot(*vector) for vector in forces]
    usual, most = usual_peak(easy, *sizes), peak(*sizes)
    factor, unit = prefixed(usual, "N")

    def track(vector: Array, look: Look) -> Line:
        points = vector[:, :: -(-vector.shape[1] // MOST_POINTS)]
        points = np.hstack([points, vector[:, :1]]) if over.closed else points
        points = np.hstack([np.zeros((2, 1)), points]) if points.shape[1] == 1 else points  # one position has no track
        return Line(points[0] * factor, points[1] * factor, None, look)

    marks: list[Mark] = [Rule(0.0, None, Look("muted", 0.8, order=1.5), upright) for upright in (True, False)]
    marks += [track(vector, FREE) for vector in forces[1:]]
    marks.append(track(forces[0], Look(index)))
    at = [0]
    if over.closed:
        at = [int(np.argmin(np.abs((over.values - angle + 180) % 360 - 180))) for angle in np.arange(0.0, 360.0, 30.0)]
    dots = np.where(np.abs(forces[0][:, at]).max(axis=0) <= usual, forces[0][:, at] * factor, np.nan)
    marks.append(Line(dots[0], dots[1], None, Look(index, dash="none", mark="o", size=3.2, order=4.0)))
    for place, (x, y) in zip(at[::3], dots[:, ::3].T.tolist(), strict=True):
        if np.isfinite(x + y):
            marks.append(Note(over.say(place), x, y, data=True, size=7.5, colour="ink", beside=True))
    limits: tuple[float | None, float | None] = (None, None)
    if usual < most:
        limits = (-usual * factor, usual * factor)
        marks.append(outside(most, "N"))
    across, up = (Axis(f"F{'xyz'[axis]} [{unit}]", limits, margin=0.13, count=5) for axis in plane)
    return Chart(across, up, marks, title=joint if plane == PLANES[0] else "", legend=None, equal=True)


# ---- motion -------------------------------------------------------------------------------------------------------


def motion(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Angles of the turning links, in space of the joints, slides of the sliding joints, and their rates."""
    over, facts, panels = abscissa(result), layout(result), list[Panel]()
    kinds = {name: facts["joints"].get(name, {}).get("type") for name in names(result, "joint")}
    if is_spatial(result):
        moving = [(f"joint {noun}", unit, f"joint_{noun}", "joint",
                   [name for name, course in members(result, f"joint_{noun}", "joint").items()
                    if getattr(PAIRS[kinds[name]], moves) and _moves(course)])
                  for noun, unit, moves in (("rotation", "rad", "turns"), ("slide", "m", "slides"))]  # fmt: skip
    else:
        turning = [link for link, angle in members(result, "link_angle", "link").items()
                   if link != facts["ground"] and _moves(angle)]  # fmt: skip
        sliding = [name for name, kind in kinds.items() if kind in GUIDED]
        moving = [("angle", "rad", "link_angle", "link", turning), ("slide", "m", "joint_slide", "joint", sliding)]
    for noun, unit, variable, dim, of in [part for part in moving if part[-1]] or moving[:1]:
        charts = []
        for order, rate in enumerate(("", "_velocity", "_acceleration")):
            rows = {name: values for name, values in members(result, variable + rate, dim).items() if name in of}
            turn = TURN if unit == "rad" and not order else 0.0
            lines = [line._replace(turn=turn) for line in _lines(over, rows)]
            scale = (1.0, unit) if order else None
            if unit == "m":  # as the drive
                scale = scaled(usual_peak(ease(result), *rows.values()), "m")
            title, legend = (noun, "velocity", "acceleration")[order], None if order else Legend(1)
            charts.append(over_drive(result, over, title, unit, lines, rate=RATES[order], scale=scale, legend=legend))
        panels.append(Panel("", charts, 5.8))
    return Plot("Motion", panels, len(panels), 7.4 if len(panels) == 1 else 2.8 + 3.6 * len(panels))


def _varies(values: Array, least: float) -> bool:
    finite = values[np.isfinite(values)]
    return bool(finite.size) and float(np.ptp(finite)) > least


def _moves(values: Array) -> bool:
    """Also where it is known at one position alone."""
    return np.isfinite(values).sum() == 1 or _varies(values, 1e-9 * max(1.0, peak(values)))


# ---- measures -----------------------------------------------------------------------------------------------------


def drawn_measures(result: xr.Dataset) -> list[int]:
    """Numbers of the measures of a result that have one number at every position."""
    if "measure_value" not in result:
        return []
    return [i for i, row in enumerate(result["measure_value"].values) if np.any(np.isfinite(row))]


def measures(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """The model's measures over the drive: a panel for each course, with the figures of all measures of it."""
    rows, over, charts = drawn_measures(result), abscissa(result), list[Chart]()
    if not rows:
        what = "there is no measure with one number at every position"
        raise MechanismError(Finding(what, "measures", "state measures: in the model"))
    units, figure_units = (units_along(result[f"measure_{part}"], "measure") for part in ("value", "figure"))
    texts, aspects = layout(result).get("measures", {}), {row.name: row.aspect for row in summary_of(result)}
    labels, values, figures = names(result, "measure"), result["measure_value"].values, result["measure_figure"].values
    for i in rows:
        same = [k for k in rows if units[k] == units[i] and np.array_equal(values[k], values[i], equal_nan=True)]
        if i != same[0]:
            continue
        title = labels[i] if len(same) == 1 else texts.get(labels[i], "course of the measures")
        scope, marks = usual_peak(ease(result), values[i]), list[Mark]()
        scale = (scaled if units[i] == "m" else prefixed)(scope, units[i])
        for k in (k for k in same if np.isfinite(figures[k])):
            aspect = aspects.get(labels[k], "")
            level = aspect in LEVELS and figure_units[k] == units[i]  # what is none is told in the legend alone
            text = f"{labels[k]}: {aspect} {quantity(float(figures[k]), figure_units[k])}"
            look = nth(1 + len(marks)).but(width=1.2, dash="dashed")
            marks.append(Rule(figures[k] * scale[0] if level else np.nan, text, look, upright=False))
        line = Line(over.values, values[i], title, Look(0, 2.0), close=True)
        charts.append(over_drive(result, over, title, units[i], [line], marks=marks, scale=scale, legend=Legend()))
    return _stack("Measures", charts)


# ---- errors -------------------------------------------------------------------------------------------------------


def error(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Errors against the mechanism without any: of the worst points and of the joints of the ground, over the drive."""
    need(result, "errors", "error")
    over, lost_at, legend = abscissa(result), losses(result), Legend(1)
    places = np.unique(np.concatenate(list(lost_at.values()))) if lost_at else np.empty(0, int)
    lost = [Rule(float(over.values[place]), None if k else f"contact lost: {', '.join(lost_at)}",
                 Look("limit", 0.9, "dotted", order=1.4)) for k, place in enumerate(places)]  # fmt: skip
    # the scale is that of all points: those that are not drawn err less
    scale = prefixed(usual_peak(ease(result), *point_errors(result).values()), "m")
    charts = [over_drive(result, over, "position error", "m", _lines(over, worst_points(result)), scale=scale,
                         marks=lost, legend=legend)]  # fmt: skip
    for unit, noun in (("rad", "rotation"), ("m", "slide")):
        errors = {output.joint: output.error for output in outputs(result) if output.unit == unit}
        if errors:
            title = f"transmission error,\n{noun}"
            charts.append(over_drive(result, over, title, unit, _lines(over, errors), marks=lost, legend=legend))
    return _stack("Errors of the mechanism as built", charts)


# ---- locking ------------------------------------------------------------------------------------------------------

# what is shaded: values of `locking_state` and the colour; over the stripes that say why there is no answer
STATES = (
    (LockingState.RUNS, "#eef0f3"),
    (LockingState.BACKDRIVABLE, "#cfe9dd"),
    (LockingState.SELF_LOCKING, "#fbe3c4"),
    (LockingState.SELF_LOCKING_FORWARD, "#f4bf7f"),
    (LockingState.DRIVEN_ON, "#c9dff3"),
    (LockingState.LOCKED_BACKWARD, "#e0cdea"),
    (LockingState.LOCKED, "#f3c4bf"),
    (LockingState.JAMMED, "#dea8a3"),
    (LockingState.UNSOLVED, "#c6ccd3"),
)
LEAST_TOP = 2.0  # of the axis of the margin, so that 1 does not lie on its frame


def has_friction(result: xr.Dataset) -> bool:
    """Whether the locking margin is known anywhere, and some joint takes power."""
    margin, lost = column(result, "locking_margin"), column(result, "friction_power")
    if margin is None or lost is None:
        return False
    rubs = bool(np.any(np.nan_to_num(lost) != 0)) or bool(np.any(margin < 1))
    return rubs and not bool(np.all(np.isnan(margin)))


def locking(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """The locking margin over the drive above the efficiency; locked ranges are shaded.

    Of a result of `locking` also the critical multiple of each joint, and the efficiency backward.
    """
    margin = column(result, "locking_margin")
    if margin is None or not has_friction(result):
        raise MechanismError(Finding("no joint has friction, so nothing can lock", "locking", "state friction"))
    over = abscissa(result)
    margins = members(result, "critical_multiple", "joint")
    every = np.concatenate([margin, *margins.values()])
    largest = float(np.max(every[np.isfinite(every)], initial=0.0))
    reached = bool(np.any(np.isinf(every))) or largest >= MARGIN
    top = MARGIN if reached else max(1.1 * largest, LEAST_TOP)
    never = f": more than {MARGIN:g}" if not np.isfinite(margin).any() else ""
    finite = {f"{joint} alone": np.where(np.isfinite(row), row, np.nan) for joint, row in margins.items()}
    lines = [Line(over.values, np.where(np.isfinite(margin), margin, np.nan), f"locking margin, all friction{never}",
                  Look("ink", 2.0), close=True)]  # fmt: skip
    lines += [line for line in _lines(over, finite, 1.3) if np.isfinite(line.y).any()]
    marks: list[Mark] = [*_states(result, over, named=True), *silent(result, over), *lines]
    marks.append(Rule(1.0, "locks at 1", Look("ink", 1.0, "dashed", order=1.6), upright=False))
    if not largest:  # nothing to draw
        marks.append(Note(f"more than {MARGIN:g} at every position", 0.5, 0.5, size=10, colour="ink"))
    searched = f", searched to {MARGIN:g}" if reached and largest else ""
    upper = Chart(over, Axis(f"times the friction{searched}", (0.0, top)), marks, legend=Legend(1))
    lower = _efficiency(result, over)
    centred = "; ranges: pins centred" * ("seat_offset" in result and "locking_state" in result)
    return _stack(f"Locking by friction{centred}", [upper, lower], (3, 2) if largest else (1, 2))


def _efficiency(result: xr.Dataset, over: Abscissa) -> Chart:
    """Forward and, of a result of `locking`, backward; beyond ±1 a driver hardly works beside springs and masses."""
    courses = [
        ("forward", "efficiency_instant", Look(0)),
        ("backward, by the useful loads", "efficiency_reverse_instant", Look(2, dash="long")),
    ]
    lines = list[Line]()
    for name, variable, look in courses:
        values = column(result, variable)
        values = None if values is None else np.where(np.abs(values) <= 1 + 1e-9, 100 * values, np.nan)
        if values is not None and (np.isfinite(values).any() or not lines):
            lines.append(Line(over.values, values, name, look, close=True))
    low = min((float(np.nanmin(line.y)) for line in lines if np.isfinite(line.y).any()), default=0.0)
    limits = min(0.0, max(1.05 * low, -105.0)), 103.0
    return Chart(over, Axis("efficiency [%]", limits),
                 [*_states(result, over, named=False), *silent(result, over), *lines], zero=True)  # fmt: skip


def _states(result: xr.Dataset, over: Abscissa, named: bool) -> list[Mark]:
    """The ranges of a result of `locking`, in their colours, and where the drive effort changes sign; named: for the
    legend."""
    if "locking_state" not in result:
        return []
    time, values = result["time"].values, over.values
    if len(time) > 1:  # a motion that comes again has ranges beyond its last position
        time, values = (np.append(row, 2 * row[-1] - row[-2]) for row in (time, values))
    rows = [row for row in attribute(result, "locking_ranges", '{"rows": []}')["rows"] if row["state"]]
    marks, both, names_marked = list[Mark](), {state.name.lower() for state in HELD_AND_DRIVEN}, set[str]()
    for state, colour in STATES:
        for row in (row for row in rows if row["state"] == state.name.lower()):
            low, high = np.interp(row["times"], time, values)
            name = state.text if named and state.text not in names_marked else None
            names_marked.add(state.text)
            marks.append(Stripe(float(low), float(high), "", Look(colour, order=0.55), name))
    label = "drive effort changes sign" if named else None
    for before, after in pairwise(rows):
        if {before["state"], after["state"]} == both:
            place = float(np.interp(after["times"][0], time, values))
            marks.append(Rule(place, label, Look("ink", 1.0, "dotted", order=1.5)))
            label = None
    return marks
