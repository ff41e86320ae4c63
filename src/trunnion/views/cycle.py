"""What a cycle has over its drive, as plots: efforts, powers, reactions, motion, measures, errors, seats, locking.

`PLOTS` is the list: each kind is a function of the result and, if wanted, of the same run without friction (`ideal`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from trunnion.cycle.locking_course import HELD_AND_DRIVEN, LockingState
from trunnion.errors import Finding, MechanismError
from trunnion.joints.pairs import GUIDED, PAIRS
from trunnion.model.quantity import Quantity
from trunnion.model.units import ANY, UnitError
from trunnion.model.units import KINDS as UNITS
from trunnion.results.attributes import attribute, summary_of
from trunnion.results.dataset import units_along, without_noise
from trunnion.results.quantities import number, prefixed, quantity, scaled
from trunnion.solve.friction_method import MARGIN
from trunnion.views.as_built import Seats, losses, outputs, point_errors, seat_angles, seated, worst_points
from trunnion.views.axis import Array, abscissa, column, is_spatial, larger_end, layout, members, names
from trunnion.views.charts import Axis, Band, Chart, Legend, Line, Look, Mark, Note, Panel, Plot, Ring, Rule, Stripe
from trunnion.views.curves import FREE, check_kind, ease, nth, outside, over_drive, peak, silent, usual_peak

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

SEEN = 0.002  # of the largest effort: narrower ranges would not be seen
STEADY = 1e-6  # of the largest speed: variations that are none
PLANES = ((0, 1), (0, 2), (1, 2))
TURN = 2 * np.pi
RATES = {"": "", "_velocity": "/s", "_acceleration": "/s²"}
LEVELS = ("maximum", "minimum", "mean", "value", "largest")  # aspects of a figure that is a value of the course
HEIGHT = 2.3  # of one of several charts below one another, inches
LONGEST = 1.5  # steps: a place further from every position is not one of the cycle


def _stack(title: str, charts: Sequence[Chart], parts: Sequence[float] = ()) -> Plot:
    """Charts below one another; parts: shares of the height."""
    return Plot(title, [Panel("", charts, 0.6 + HEIGHT * len(charts) if len(charts) > 1 else 3.75, parts)])


def _varies(values: Array, least: float) -> bool:
    finite = values[np.isfinite(values)]
    return bool(finite.size) and float(np.ptp(finite)) > least


# ---- effort and power ---------------------------------------------------------------------------------------------


def torque(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Drive effort over the drive, one panel a driver; without friction dashed, its interval at zero slip as bars."""
    x, charts, nouns = abscissa(result).values, list[Chart](), set[str]()
    efforts, lows, highs = (members(result, f"drive_effort{end}", "driver") for end in ("", "_lower", "_upper"))
    free = {} if ideal is None else members(ideal, "drive_effort", "driver")
    for (driver, effort), unit in zip(efforts.items(), units_along(result["drive_effort"], "driver"), strict=True):
        noun = "force" if unit == "N" else "torque"
        nouns.add(noun)
        lines = [Line(x, effort, "with friction" if driver in free else noun, Look(0, 2.0), close=True)]
        if driver in free:
            lines.append(Line(x, free[driver], "without friction", FREE, close=True))
        if driver in lows:
            low, high = lows[driver], highs[driver]
            wide = high - low > SEEN * usual_peak(ease(result), low, high)
            if wide.any():
                middle, half = np.where(wide, (low + high) / 2, np.nan), (high - low) / 2
                look = Look(0, 2.0, "none", alpha=0.35)
                lines.append(Line(x, middle, "range, friction at rest", look, half, half))
        charts.append(over_drive(result, f"{noun} {driver}", unit, lines))
    title = f"Drive {nouns.pop() if len(nouns) == 1 else 'effort'}"
    return _stack(title, charts or [Chart(abscissa(result), Axis(), [])])


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
    return _stack("Speed", [over_drive(result, f"speed {name}", unit, {name: values})
                            for name, (values, unit) in varying(result).items()])  # fmt: skip


def friction_power(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Power lost to friction in each joint and in all, with the mean of each over the run."""
    x, lost = abscissa(result).values, members(result, "friction_power", "joint")
    rubbing = {joint: values for joint, values in lost.items() if peak(values) > 0}
    total = np.sum(list(rubbing.values()), axis=0) if rubbing else np.zeros(x.size)
    factor, unit = prefixed(usual_peak(ease(result), total), "W")
    means = {joint: float(mean) for joint, mean in members(result, "friction_power_mean", "joint").items()}
    rows = [("all joints", total, sum(means[joint] for joint in rubbing), Look("ink", 1.8))]
    rows += [(joint, row, means[joint], nth(k)._replace(width=1.4)) for k, (joint, row) in enumerate(lost.items())
             if joint in rubbing]  # fmt: skip
    lines = [Line(x, row, f"{text}, {f'mean {number(mean * factor)} {unit}' if np.isfinite(mean) else 'not solved'}",
                  look, close=True) for text, row, mean, look in rows]  # fmt: skip
    area = Band(x, np.zeros(x.size), total, None, Look("shade", alpha=0.6, order=1.0), close=True)
    chart = over_drive(result, "friction power", "W", lines, bands=[area], scale=(factor, unit))
    return _stack("Friction power by joint", [chart])


def power(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Where the power goes: drive, useful, friction, and the remainder that masses and other loads take or give."""
    x = abscissa(result).values
    drive, lost = (np.sum([np.zeros(x.size), *members(result, name, dim).values()], axis=0)
                   for name, dim in (("drive_power", "driver"), ("friction_power", "joint")))  # fmt: skip
    useful = column(result, "useful_power")
    useful = np.zeros_like(lost) if useful is None else useful
    rest = drive - useful - lost
    parts = [("drive", drive, Look(0)), ("useful", useful, Look(2)), ("friction", lost, Look(1))]
    if peak(rest) > 1e-9 * peak(drive, useful, lost):
        label = "masses, springs and other loads" if "spring" in result.dims else "masses and other loads"
        parts.append((label, rest, Look("muted", 1.2, "short")))
    lines = [Line(x, values, name, look, close=True) for name, values, look in parts]
    return _stack("Power over the run", [over_drive(result, "power", "W", lines)])


# ---- reactions ----------------------------------------------------------------------------------------------------


def reactions(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Magnitude of the reaction in each joint, in space also of its moment, and the larger load on the ends of each
    bearing; without friction thin, dotted."""
    x, joints, charts = abscissa(result).values, names(result, "joint"), []
    parts = [("magnitude of the reaction", "reaction_force", "N")]
    if is_spatial(result):
        parts = [("force of the reaction", "reaction_force", "N"), ("moment of the reaction", "reaction_moment", "N m")]
    for title, variable, unit in [*parts, ("larger load on an end", "end_load", "N")]:
        lines = list[Line]()
        for of in (result,) if ideal is None else (result, ideal):
            for joint, vector in members(of, variable, "joint").items():
                size = np.linalg.norm(vector, axis=0) if variable != "end_load" else larger_end(of, joint)
                look = nth(joints.index(joint)) if of is result else FREE
                name = joint if of is result else None if lines and lines[-1].look == FREE else "without friction"
                lines += [Line(x, size, name, look, close=True)] if size is not None else []
        if lines or variable != "end_load":
            charts.append(over_drive(result, title, unit, lines))
    return _stack("Joint reactions", charts)


def polar(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Polar reaction diagrams: the tip of each joint's force vector over the run, in the global frame.

    A dot every 30° of the drive, named every 90°. In space a row for each joint: the vector seen along z, y and x.
    """
    over, easy = abscissa(result), ease(result)
    forces = [members(of, "reaction_force", "joint") for of in (result, ideal) if of is not None]
    at = [0]
    if over.closed:
        at = [int(np.argmin(np.abs((over.values - angle + 180) % 360 - 180))) for angle in np.arange(0.0, 360.0, 30.0)]

    def track(vector: Array, factor: float, look: Look) -> Line:
        points = np.hstack([vector, vector[:, :1]]) if over.closed else vector
        points = np.hstack([np.zeros((2, 1)), points]) if points.shape[1] == 1 else points  # one position has no track
        return Line(points[0] * factor, points[1] * factor, None, look)

    panels: list[Chart] = []
    for index, joint in enumerate(forces[0]):
        for plane in PLANES if is_spatial(result) else PLANES[:1]:
            vectors = [of[joint][list(plane)] for of in forces]
            sizes = [np.hypot(*vector) for vector in vectors]
            usual, most = usual_peak(easy, *sizes), peak(*sizes)
            factor, unit = prefixed(usual, "N")
            dots = np.where(sizes[0][at] <= usual, vectors[0][:, at] * factor, np.nan)
            marks: list[Mark] = [Rule(0.0, None, Look("muted", 0.8, order=1.5), upright) for upright in (True, False)]
            marks += [track(vector, factor, FREE) for vector in vectors[1:]]
            marks.append(track(vectors[0], factor, Look(index)))
            marks.append(Line(dots[0], dots[1], None, Look(index, dash="none", mark="o", size=3.2, order=4.0)))
            marks += [
                Note(over.say(place), x, y, data=True, size=7.5, colour="ink", outwards=True)
                for place, (x, y) in zip(at[::3], dots[:, ::3].T.tolist(), strict=True)
                if np.isfinite(x + y)
            ]
            marks += [outside(most, "N")] if usual < most else []
            limits = (-usual * factor, usual * factor) if usual < most else (None, None)
            across, up = (Axis(f"F{'xyz'[axis]} [{unit}]", limits, margin=0.13, count=5) for axis in plane)
            panels.append(Chart(across, up, marks, title=joint if plane == PLANES[0] else "", legend=None, equal=True))
    columns = min(len(panels), 2 if len(panels) in (2, 4) else 3) or 1
    dashed = "" if ideal is None else "; dashed: without friction"
    charts = [Panel("", [chart], 6.8 / columns) for chart in panels]
    return Plot(f"Polar diagrams of the joint reactions{dashed}", charts, columns, 7.4)


# ---- motion and measures --------------------------------------------------------------------------------------------


def motion(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Angles of the turning links, in space of the joints, slides of the sliding joints, and their rates."""
    facts, x, panels = layout(result), abscissa(result).values, list[Panel]()
    pairs = {name: PAIRS[facts["joints"][name]["type"]] for name in names(result, "joint")}
    parts = [("joint rotation", "rad", "joint_rotation", "joint", {name for name in pairs if pairs[name].turns}),
             ("joint slide", "m", "joint_slide", "joint", {name for name in pairs if pairs[name].slides})]  # fmt: skip
    if not is_spatial(result):
        links, guides = set(facts["links"]) - {facts["ground"]}, {name for name in pairs if pairs[name].guided}
        parts = [("angle", "rad", "link_angle", "link", links), ("slide", "m", "joint_slide", "joint", guides)]
    for noun, unit, variable, dim, of in parts:
        moving = [name for name, course in members(result, variable, dim).items() if name in of
                  and (np.isfinite(course).sum() == 1 or _varies(course, 1e-9 * max(1.0, peak(course)))
                       or (dim, noun) == ("joint", "slide"))]  # fmt: skip
        if not moving and (panels or unit == "rad"):
            continue
        charts = []
        for suffix, rate in RATES.items():
            rows = {name: values for name, values in members(result, variable + suffix, dim).items() if name in moving}
            turn = TURN if unit == "rad" and not rate else 0.0
            lines = [Line(x, row, name, nth(k), close=True, turn=turn) for k, (name, row) in enumerate(rows.items())]
            scale = (1.0, unit) if rate else None
            if unit == "m":  # as the drive
                scale = scaled(usual_peak(ease(result), *rows.values()), "m")
            charts.append(over_drive(result, suffix[1:] or noun, unit, lines, rate=rate, scale=scale,
                                     legend=None if rate else Legend(1)))  # fmt: skip
        panels.append(Panel("", charts, 5.8))
    return Plot("Motion", panels, len(panels), 7.4 if len(panels) == 1 else 2.8 + 3.6 * len(panels))


def drawn_measures(result: xr.Dataset) -> list[int]:
    """Numbers of the measures of a result that have one number at every position."""
    if "measure_value" not in result:
        return []
    return [i for i, row in enumerate(result["measure_value"].values) if np.any(np.isfinite(row))]


def measures(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """The model's measures over the drive: a panel for each course, with the figures of all measures of it."""
    rows, charts = drawn_measures(result), list[Chart]()
    units, figure_units = (units_along(result[f"measure_{part}"], "measure") for part in ("value", "figure"))
    texts, aspects = layout(result).get("measures", {}), {row.name: row.aspect for row in summary_of(result)}
    labels, values, figures = names(result, "measure"), result["measure_value"].values, result["measure_figure"].values
    while rows:
        i = rows[0]
        same = [k for k in rows if units[k] == units[i] and np.array_equal(values[k], values[i], equal_nan=True)]
        rows = [k for k in rows if k not in same]
        title = labels[i] if len(same) == 1 else texts.get(labels[i], "course of the measures")
        scale = (scaled if units[i] == "m" else prefixed)(usual_peak(ease(result), values[i]), units[i])
        marks = list[Mark]()
        for k in (k for k in same if np.isfinite(figures[k])):
            aspect = aspects.get(labels[k], "")
            level = aspect in LEVELS and figure_units[k] == units[i]  # what is none stands in the legend alone
            text = f"{labels[k]}: {aspect and f'{aspect} '}{quantity(float(figures[k]), figure_units[k])}"
            look = nth(1 + len(marks))._replace(width=1.2, dash="dashed")
            marks.append(Rule(figures[k] * scale[0] if level else np.nan, text, look, upright=False))
        charts.append(over_drive(result, title, units[i], {title: values[i]}, marks=marks, scale=scale))
    return _stack("Measures", charts)


# ---- errors and seats -----------------------------------------------------------------------------------------------

PIN = 1.1  # radius of the pin as drawn, of the clearance: the play is to scale, pin and hole are not
WALL = 0.25  # thickness of the hole's wall as drawn
ARROW = 0.8  # length of the largest load
ROOM = 1.0 + PIN + ARROW + 0.6  # half width of a diagram
WEAK = 0.02  # of the largest load: a smaller one has no arrow


def error(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Errors against the mechanism without any: of the worst points and of the joints of the ground, over the drive."""
    lost_at = losses(result)
    places = np.unique(np.concatenate(list(lost_at.values()))) if lost_at else np.empty(0, int)
    lost = [Rule(float(abscissa(result).values[place]), None if k else f"contact lost: {', '.join(lost_at)}",
                 Look("limit", 0.9, "dotted", order=1.4)) for k, place in enumerate(places)]  # fmt: skip
    # the scale is that of all points: those that are not drawn err less
    scale = prefixed(usual_peak(ease(result), *point_errors(result).values()), "m")
    worst = worst_points(result)
    charts = [over_drive(result, "position error", "m", worst, scale=scale, marks=lost, legend=Legend(1))]
    for unit, noun in (("rad", "rotation"), ("m", "slide")):
        if errors := {joint: error for joint, (_, unit_of, error) in outputs(result).items() if unit_of == unit}:
            title = f"transmission error,\n{noun}"
            charts.append(over_drive(result, title, unit, errors, marks=lost, legend=Legend(1)))
    return _stack("Errors of the mechanism as built", charts)


def seat(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """Pin in hole for every joint and end: locus of the pin's centre over the drive, marked positions, their loads."""
    charts, paired = list[Chart](), False
    for seats in seated(result):
        if seats.planar_guide:  # see `beta`
            continue
        both = [(0, (0, 1)), (0, (0, 2))] if seats.kind == "ball" else [(k, (0, 1)) for k in range(len(seats.offsets))]
        paired |= len(both) == 2  # both ends of a joint stay side by side
        charts += [_hole(seats, end, plane, result) for end, plane in both]
    columns = 4 if paired and len(charts) > 2 else len(charts) if len(charts) <= 2 else 2 if len(charts) == 4 else 3
    width = {1: 4.6, 4: 10.4}.get(columns, 7.4)
    panels = [Panel("", [chart], width / columns + 0.55) for chart in charts]
    return Plot("Seats of the pins in their holes", panels, columns, width)


def _hole(seats: Seats, end: int, plane: tuple[int, int], result: xr.Dataset) -> Chart:
    """Pin in hole: wall, clearance, locus, and at the marked positions the pin with its load."""
    over, (factor, unit) = abscissa(result), prefixed(seats.clearance, "m")
    rho, offset = seats.clearance * factor, seats.offsets[end, list(plane)] * factor
    force, square, most = seats.forces[end, list(plane)], seats.kind == "guide", seats.peak
    marks: list[Mark] = [Ring((0.0, 0.0), size * rho, look, square, filled) for size, look, filled in (
        (1 + PIN + WALL, Look("shade", 0.0, order=0.7), 1.0), (1 + PIN, Look("ink", 1.4, order=0.8), 0.0),
        (1.0, Look("muted", 0.8, "dashed", order=2.0), 0.0))]  # fmt: skip
    locus = np.hstack([offset, offset[:, :1]]) if over.closed else offset
    jumps = np.flatnonzero(~(np.linalg.norm(np.diff(locus, axis=1), axis=0) < rho)) + 1
    x, y = np.insert(locus, jumps, np.nan, axis=1)
    marks.append(Line(x, y, None, Look("ink", 2.0, order=3.0)))
    picked = [0, over.values.size // 2, over.values.size - 1]  # positions that are named
    if over.closed:
        angles = over.values[0] + over.period * np.arange(4) / 4
        picked = [int(np.argmin(np.abs(over.values - angle))) for angle in angles]
    for k, index in enumerate(index for index in dict.fromkeys(picked) if np.isfinite(offset[:, index]).all()):
        paint, place = Look(k), offset[:, index]
        at, size = (float(place[0]), float(place[1])), float(np.hypot(*place))
        marks.append(Ring(at, PIN * rho, paint._replace(width=1.1, alpha=0.85, order=1.5), square, 0.07))
        marks.append(Note(over.say(index), 1.0, 1.0 - 0.09 * k, "right", "top", colour=k, size=8.0))  # the key
        marks.append(Line(place[:1], place[1:], None, paint._replace(dash="none", mark="o", size=5.5, order=5.0)))
        if np.hypot(*force[:, index]) > WEAK * most:
            start = place * (1 + PIN * rho / size) if size > 1e-9 * rho else place
            tip = start + force[:, index] / most * ARROW * rho
            path = np.stack([start, tip], axis=1)
            marks.append(Line(path[0], path[1], None, paint._replace(width=1.5, order=6.0), arrow=True))
    slack = seats.offsets[end, 2] * factor if seats.along > 0 else np.empty(0)
    if np.isfinite(slack).any():
        text = f"along the axis {number(float(np.nanmin(slack)), 3)} to {number(float(np.nanmax(slack)), 3)} {unit}"
        marks.append(Note(text, 0.02, 0.02, "left", "bottom", size=7.0))
    ends = [(-rho, f"−{rho:.3g}"), (0.0, ""), (rho, f"{rho:.3g}")]
    first, second = (name if len(name) <= 16 else f"{name[:15]}…" for name in seats.links)
    below = f"\n{seats.kind} of {first} in {second}\nlongest load {quantity(most, 'N')}"
    across, up = (Axis(f"{'xyz'[axis]} [{unit}]{text}", (-ROOM * rho, ROOM * rho), ends)
                  for axis, text in zip(plane, (below, ""), strict=True))  # fmt: skip
    title = seats.joint + (f", end {end + 1}" if len(seats.offsets) == 2 else "")
    title = f"{seats.joint}: {''.join('xyz'[axis] for axis in plane)}" if seats.kind == "ball" else title
    return Chart(across, up, marks, title=title, legend=None, equal=True)


def beta(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """β and ξ of every pin in space, ξ of those of the plane, the offsets of both ends of a guide of the plane.

    A dot for every position, as seats jump; crosses mark the positions without contact.
    """
    charts = _seat_courses(result)
    return Plot("Seats over the run", [Panel("", charts, 0.8 + 2.3 * len(charts))])


def _seat_courses(result: xr.Dataset) -> list[Chart]:
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
                named = any(mark.look == crosses for mark in marks if isinstance(mark, Line))
                marks.append(Line(over.values[places], values[places], None if named else "contact lost", crosses))
        if marks:
            marks = [*silent(result, over), *marks]
            charts.append(Chart(over, Axis(title, margin=0.12), marks, zero=True, legend=Legend(1)))
    return charts


# ---- locking ------------------------------------------------------------------------------------------------------

# what is shaded: values of `locking_state` and the colour; over the stripes that say why there is no answer
STATES = {
    LockingState.RUNS: "#eef0f3", LockingState.BACKDRIVABLE: "#cfe9dd", LockingState.SELF_LOCKING: "#fbe3c4",
    LockingState.SELF_LOCKING_FORWARD: "#f4bf7f", LockingState.DRIVEN_ON: "#c9dff3",
    LockingState.LOCKED_BACKWARD: "#e0cdea", LockingState.LOCKED: "#f3c4bf", LockingState.JAMMED: "#dea8a3",
    LockingState.UNSOLVED: "#c6ccd3",
}  # fmt: skip
LEAST_TOP = 2.0  # of the axis of the margin, so that 1 does not lie on its frame


def has_friction(result: xr.Dataset) -> bool:
    """Whether the locking margin is known anywhere, and some joint takes power."""
    margin, lost = column(result, "locking_margin"), column(result, "friction_power")
    if margin is None or lost is None or np.all(np.isnan(margin)):
        return False
    return bool(np.any(np.nan_to_num(lost) != 0)) or bool(np.any(margin < 1))


def locking(result: xr.Dataset, ideal: xr.Dataset | None = None) -> Plot:
    """The locking margin over the drive above the efficiency; locked ranges are shaded.

    Of a result of `locking` also the critical multiple of each joint, and the efficiency backward. Efficiencies beyond
    ±1 are left out: there the driver hardly works beside springs and masses.
    """
    margin = np.asarray(result["locking_margin"].values, float)
    over, alone = abscissa(result), members(result, "critical_multiple", "joint")
    every = np.concatenate([margin, *alone.values()])
    largest = float(np.max(every[np.isfinite(every)], initial=0.0))
    reached = bool(np.any(np.isinf(every))) or largest >= MARGIN
    never = f": more than {MARGIN:g}" if not np.isfinite(margin).any() else ""
    courses = {f"{joint} alone": np.where(np.isfinite(row), row, np.nan) for joint, row in alone.items()}
    marks: list[Mark] = [*_states(result, named=True), *silent(result, over)]
    of_all, title = np.where(np.isfinite(margin), margin, np.nan), f"locking margin, all friction{never}"
    marks.append(Line(over.values, of_all, title, Look("ink", 2.0), close=True))
    marks += [Line(over.values, course, name, nth(k)._replace(width=1.3), close=True)
              for k, (name, course) in enumerate(courses.items()) if np.isfinite(course).any()]  # fmt: skip
    marks.append(Rule(1.0, "locks at 1", Look("ink", 1.0, "dashed", order=1.6), upright=False))
    if not largest:  # nothing to draw
        marks.append(Note(f"more than {MARGIN:g} at every position", 0.5, 0.5, size=10, colour="ink"))
    searched = f", searched to {MARGIN:g}" if reached and largest else ""
    top = MARGIN if reached else max(1.1 * largest, LEAST_TOP)
    upper = Chart(over, Axis(f"times the friction{searched}", (0.0, top)), marks, legend=Legend(1))
    lines = list[Line]()
    for name, variable, look in (
        ("forward", "efficiency_instant", Look(0)),
        ("backward, by the useful loads", "efficiency_reverse_instant", Look(2, dash="long")),
    ):
        values = column(result, variable)
        values = None if values is None else np.where(np.abs(values) <= 1 + 1e-9, 100 * values, np.nan)
        if values is not None and (np.isfinite(values).any() or not lines):
            lines.append(Line(over.values, values, name, look, close=True))
    low = min((float(np.nanmin(line.y)) for line in lines if np.isfinite(line.y).any()), default=0.0)
    lower = Chart(over, Axis("efficiency [%]", (min(0.0, max(1.05 * low, -105.0)), 103.0)),
                  [*_states(result, named=False), *silent(result, over), *lines], zero=True)  # fmt: skip
    centred = "; ranges: pins centred" * ("seat_offset" in result and "locking_state" in result)
    return _stack(f"Locking by friction{centred}", [upper, lower], (3, 2) if largest else (1, 2))


def _states(result: xr.Dataset, named: bool) -> list[Mark]:
    """The ranges of a result of `locking`, in their colours, and where the drive effort changes sign; named: for the
    legend."""
    if "locking_state" not in result:
        return []
    time, values = result["time"].values, abscissa(result).values
    if len(time) > 1:  # a motion that comes again has ranges beyond its last position
        time, values = (np.append(row, 2 * row[-1] - row[-2]) for row in (time, values))
    rows = [row for row in attribute(result, "locking_ranges", '{"rows": []}')["rows"] if row["state"]]
    marks, both = list[Mark](), {state.name.lower() for state in HELD_AND_DRIVEN}
    for state, colour in STATES.items():
        for k, row in enumerate(row for row in rows if row["state"] == state.name.lower()):
            low, high = np.interp(row["times"], time, values)
            name = state.text if named and not k else None
            marks.append(Stripe(float(low), float(high), "", Look(colour, order=0.55), name))
    changes = [after["times"][0] for before, after in pairwise(rows) if {before["state"], after["state"]} == both]
    marks += [Rule(float(np.interp(at, time, values)), "drive effort changes sign" if named and not k else None,
                   Look("ink", 1.0, "dotted", order=1.5)) for k, at in enumerate(changes)]  # fmt: skip
    return marks


# ---- all kinds ------------------------------------------------------------------------------------------------------


def mechanism(result: xr.Dataset, ideal: xr.Dataset | None = None, index: int | None = None) -> Figure:
    """The mechanism at a position, see `sketch.mechanism`."""
    from trunnion.views.sketch import mechanism as drawing  # with matplotlib, which is slow to import

    return drawing(result, index)


PLOTS: dict[str, Callable[[xr.Dataset, xr.Dataset | None], Plot | Figure]] = {
    "torque": torque, "speed": speed, "friction-power": friction_power, "reactions": reactions, "polar": polar,
    "power": power, "mechanism": mechanism, "motion": motion, "error": error,
    "seat": seat, "beta": beta, "locking": locking, "measures": measures,
}  # fmt: skip
KINDS = PLOTS
# of a figure that not all results have: whether a result has it, what it lacks otherwise, and what to do
PINS = "state a clearance and seat: loaded of a joint (--set joint_defaults.seat=loaded)"
READY: dict[str, tuple[Callable[[xr.Dataset], bool], str, str]] = {
    "speed": (lambda result: bool(varying(result)), "the speed of no driver varies",
              "use `trunnion simulate --steady`, or a motion law"),
    "error": (lambda result: "point_error" in result, "the mechanism has no errors",
              "state errors, a misalignment, or a seat: loaded (--set joint_defaults.seat=loaded)"),
    "seat": (lambda result: any(not seats.planar_guide for seats in seated(result)), "no pin has a known seat", PINS),
    "beta": (lambda result: bool(_seat_courses(result)), "no pin or guide has a known seat", PINS),
    "locking": (has_friction, "no joint has friction, so nothing can lock", "state friction"),
    "measures": (lambda result: bool(drawn_measures(result)), "no measure has one number at every position",
                 "state measures: in the model"),
}  # fmt: skip


def drawable(result: xr.Dataset) -> list[str]:
    """The kinds of figures that a result has something for."""
    return [name for name in PLOTS if name not in READY or READY[name][0](result)]


def figure(
    result: xr.Dataset, kind: str = "torque", ideal: xr.Dataset | None = None, at: str | float | None = None
) -> Plot | Figure:
    """One figure. kind: of PLOTS; ideal: the same run without friction, to compare with.

    at: a place such as "60deg", at which the mechanism is drawn.
    """
    check_kind(kind, PLOTS)
    ready, lacks, remedy = READY.get(kind, (lambda _: True, "", ""))
    if not ready(result):
        raise MechanismError(Finding(f"{lacks}: there is no figure '{kind}'", "--kind", remedy))
    index = None if at is None else position_at(result, at)
    result, ideal = without_noise(result), None if ideal is None else without_noise(ideal)
    return mechanism(result, ideal, index) if kind == "mechanism" else PLOTS[kind](result, ideal)


def position_at(result: xr.Dataset, place: str | float) -> int:
    """The number of the position nearest to a place: a coordinate of the drive, or a time with its unit.

    A number without unit is SI. MechanismError of a text that names no place, or of one beyond the cycle.
    """
    kinds = {"°": UNITS["angle"], "mm": UNITS["length"], "s": UNITS["time"]}
    try:
        given = Quantity.read(place, ANY)
        if given.names:
            raise UnitError(f"'{place}' is no place", "write 60deg, 20mm or 0.1s")
        timed = isinstance(place, str) and given.check({}) == UNITS["time"].dimensions[0]
        unit = str(result["drive"].attrs["units"]) if "drive" in result.coords and not timed else "s"
        value = float(np.asarray(Quantity.read(place, kinds.get(unit, UNITS["time"])).evaluate()))
    except UnitError as wrong:
        raise MechanismError(Finding(wrong.what, "--at", wrong.remedy or "write 60deg, 20mm or 0.1s")) from None
    values = np.asarray(result["time" if unit == "s" else "drive"].values, dtype=float)
    sought = value * {"°": 180 / np.pi, "mm": 1e3}.get(unit, 1.0)
    away = np.abs(values - sought)
    if unit == "°" and result.attrs.get("periodic"):  # the same place after each turn
        away = np.abs((values - sought + 180) % 360 - 180)
    step = abs(float(values[1] - values[0])) if values.size > 1 else np.inf
    if not np.min(away) <= LONGEST * step:
        low, high = float(np.min(values)), float(np.max(values))
        what = f"{sought:.4g}{unit} is not in the cycle"
        raise MechanismError(Finding(what, "--at", f"name a place from {low:.4g}{unit} to {high:.4g}{unit}"))
    return int(np.argmin(away))
