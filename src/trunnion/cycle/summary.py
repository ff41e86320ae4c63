"""The books of a cycle: power, efficiency, summary, findings and provenance, gathered into the result."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Place
from trunnion.algebra.dual import primal
from trunnion.cycle import contact_loss, diagnosis, moved_jumps, near_locking, uncounted
from trunnion.cycle.course import CycleCourse, Rows, margin_of
from trunnion.cycle.holding import reverse_figure
from trunnion.cycle.kept import ALL, Kept
from trunnion.cycle.locking_states import cells, in_order, ranges_of
from trunnion.cycle.model_measures import Watched, watched
from trunnion.cycle.positions import Positions
from trunnion.cycle.scales import peak, scales_of
from trunnion.cycle.scene import COURSE, DRAWN, courses
from trunnion.cycle.variables import fill_of
from trunnion.errors import Finding, Status
from trunnion.joints.friction import FRICTION_LAWS
from trunnion.joints.pairs import PAIRS
from trunnion.model.contact import clearance
from trunnion.model.mechanism import Mechanism
from trunnion.model.quantity import Quantity
from trunnion.model.units import KINDS, Dimension, si_unit
from trunnion.results import variables as results
from trunnion.results.attributes import KEPT, cited, encoded, finding_rows, origin
from trunnion.results.dataset import MemberUnits, driven
from trunnion.results.figure import MORE_THAN, Figure
from trunnion.results.quantities import quantity
from trunnion.results.result import Result
from trunnion.results.scales import Scales
from trunnion.results.sentences import finding_for
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.loads import Stated, stated_walk, useful_loads
from trunnion.solve.margin import locking_margin
from trunnion.solve.seating import seating_of
from trunnion.solve.system import Dial, System, felt, rubbing

if TYPE_CHECKING:
    import xarray as xr

    from trunnion.solve.run import Run

__all__ = [
    "effort_units",
    "inputs",
    "member_units",
    "model_notes",
    "references",
    "result_of",
    "scene_of",
]


Arrays = Mapping[str, NDArray[np.float64]]
RESISTING = ("resisting_torque", "resisting_force")  # loads that are to be positive
TIMES = "times the friction"  # what a locking margin is
ALIKE = 1e-9  # sizes of errors that are equal
FAR = 1.0  # of the size: a hint farther off than this was meant for other lengths
ZERO_INERTIA = Quantity(0, KINDS["moment of inertia"])

DURANGO = (
    "S. Durango, G. Calle, O. Ruiz, Analytical method for the kinetostatic analysis of the second-class RRR Assur "
    "group allowing for friction in the kinematic pairs, J. Braz. Soc. Mech. Sci. & Eng., 2010"
)

PEZZUTI = (
    "E. Pezzuti, R. Stefanelli, P. P. Valentini, L. Vita, Computer-aided simulation and testing of spatial linkages "
    "with joint mechanical errors, Int. J. Numer. Meth. Eng. 65 (2006) 1735-1748"
)


def result_of(run: Run, found: Positions, kept: Kept = ALL) -> Result:
    """The result of a cycle. kept: the variables that its Dataset has."""
    attributes, measured = books(run, found, kept)
    return Result(attributes, lambda: dataset_of(run, found, measured, attributes, kept))


def books(run: Run, found_positions: Positions, kept: Kept = ALL) -> tuple[dict[str, Any], Watched]:
    """What the result says: formula, findings, summary, input data, drawing data, provenance; and the measures."""
    mechanism, arrays, time = run.system.mechanism, found_positions.arrays, found_positions.time
    method = found_positions.method
    found, near = findings(run, found_positions)
    measured = watched(run, time, method, arrays["status"])
    drawn = run.once("inputs, scene", lambda: encoded({"inputs": inputs(mechanism), "scene": scene_of(run)}))
    drawn = drawn | _courses(run, time)
    attributes = encoded(
        {
            **origin(mechanism, run.system.plan.formula, mobility=run.system.plan.mobility),
            "method": method.name,
            **cited(references(mechanism)),
            "findings": finding_rows([*found, *measured.findings]),
            **scales_of(run).summary([*figures(run, found_positions, near), *measured.summary()]),
            **_ranges(run, found_positions, near),
            **drawn,
            "periodic": int(run.cycle.periodic),
            **({} if kept.variables is None else {KEPT: kept.variables}),
        }
    )

    return attributes, measured


def dataset_of(
    run: Run, found: Positions, measured: Watched, attributes: Mapping[str, Any], kept: Kept = ALL
) -> xr.Dataset:
    """The Dataset of some positions."""
    along = driven(found.time, *found.dial)
    own = found.arrays, found.labels, along, found.means, attributes, member_units(run.system), found.ideal
    return measured.joined(results.dataset(*own, kept.variables, kept.dtype))


def findings(run: Run, at: Positions) -> tuple[list[Finding], near_locking.Locking | None]:
    """What is to be known of a mechanism at some positions of its cycle, and how near to locking it is."""
    near, units, scales = _near_locking(run, at), effort_units(run.system), scales_of(run)
    efforts = {
        name: np.array([scales.zeroed(row, unit) for row, unit in zip(at.arrays[name], units, strict=True)])
        for name in at.arrays
        if name in ("drive_effort", "drive_effort_lower", "drive_effort_upper", "drive_effort_change")
    }
    at = replace(at, arrays={**at.arrays, **efforts})
    return [
        *run.once("notes", lambda: model_notes(run.system.mechanism, run.system)),
        *run.chosen.findings,
        *run.once("far hints", lambda: list(_far_hints(run))),
        *(run.determinacy.findings() if run.determinacy else []),
        *_over_the_cycle(run, at, near),
        *_beside_gaps(run.system, at.course),
        *(moved_jumps.findings(at.course, units) if at.course and run.erring else ()),
        *uncounted.findings(run, at.means),
        *(contact_loss.findings(at.arrays, seating_of(run, at.method), at.time, at.dial) if run.seats else ()),
    ], near


def _far_hints(run: Run) -> Iterator[Finding]:
    """Hints of places that are far from where their points are at the start: they choose an assembly by chance."""
    size = float(np.ravel(primal(run.system.size(run.values)))[0])
    walk = run.walk(np.zeros(1))
    for name, hint in run.system.mechanism.assembly.items():
        if not isinstance(hint, tuple):
            continue
        link, _, point = name.rpartition(".")
        link = link or run.system.joints[name][1][1]
        place = [float(np.ravel(primal(part))[0]) for part in walk.point(link, point).place]
        stated = [float(run.values[f"assembly.{name}.{axis}"]) for axis in "xyz"[: len(place)]]
        distance = float(np.linalg.norm(np.subtract(place, stated)))
        if distance > FAR * size:
            words = ", ".join(quantity(part, "m") for part in place)
            yield finding_for("assembly.far_hint", f"assembly.{name}", point=name, distance=distance, place=words)


def effort_units(system: System) -> list[str]:
    """Unit of every driver's effort."""
    return ["N m" if system.turns(name) else "N" for name in system.mechanism.drivers]


def member_units(system: System) -> dict[str, MemberUnits]:
    """Units of what a driver or a spring has, by the words of the variables, where it may turn or slide."""

    def units(dim: str, turning: Iterable[bool], words: Mapping[str, tuple[str, str]]) -> dict[str, MemberUnits]:
        turns = list(turning)
        return {
            word: MemberUnits(dim, [turn if own else slide for own in turns]) for word, (turn, slide) in words.items()
        }

    drives = {"effort": ("N m", "N"), "coordinate": ("rad", "m"), "rate": ("rad/s", "m/s")}
    pulls = {"spring_force": ("N m", "N"), "spring_elongation": ("rad", "m")}
    springs = system.mechanism.springs.values()
    return {
        **units("driver", map(system.turns, system.mechanism.drivers), drives),
        **units("spring", (one.joint is not None and system.turns(one.joint) for one in springs), pulls),
    }


def model_notes(mechanism: Mechanism, system: System) -> list[Finding]:
    """What the model says that this analysis leaves out, and warnings about the data."""
    notes = list(mechanism.checked)
    values = mechanism.parameters()
    play = {name: clearance(name, values) for name in mechanism.effective_joints if name not in mechanism.seated}
    playing = [name for name, own in play.items() if own is not None and own > 0]
    bodies = {name: link for name, link in mechanism.effective_links.items() if name != mechanism.fixed_link}
    heavy = [name for name, link in bodies.items() if link.mass.source != 0]
    if heavy and mechanism.gravity is None:
        down, none = ("[0, -9.81]", "[0, 0]") if mechanism.space == "planar" else ("[0, 0, -9.81]", "[0, 0, 0]")
        notes.append(finding_for("model.gravity", "gravity", links=heavy, phrases={"down": down, "none": none}))
    if not heavy and any(part.source != 0 for part in mechanism.gravity or ()):
        notes.append(finding_for("model.no_mass", "gravity"))
    sliding = {link for joint in mechanism.joints.values() if PAIRS[joint.type].guided for link in joint.links}
    points = [name for name in heavy if bodies[name].inertia == ZERO_INERTIA and name not in sliding]
    if points:
        notes.append(finding_for("model.point_mass", "links", links=points))
    tight = [
        name
        for name, joint in mechanism.effective_joints.items()
        if joint.seat not in (None, "free")
        and play.get(name) is not None
        and f"joints.{name}.pin.hole_radius" in values
    ]
    if tight:
        notes.append(finding_for("model.seat_without_play", "joints", joints=tight))
    if playing:
        # no seats are taken where links are over-constrained
        held = {name for module in system.plan.modules if module.redundant for name in module.joints}
        seatable = [name for name in playing if name not in held]
        notes.append(finding_for("model.play_centred", "joints", joints=playing, seatable=seatable))
    return notes


def _over_the_cycle(run: Run, at: Positions, near: near_locking.Locking | None) -> list[Finding]:
    arrays, units = at.arrays, effort_units(run.system)
    efforts = {
        name: (arrays["drive_effort_lower"][i], arrays["drive_effort_upper"][i], units[i])
        for i, name in enumerate(run.system.mechanism.drivers)
    }
    found = diagnosis.findings(
        at.causes, at.dial, arrays["status"], arrays["condition"], efforts, arrays["locking_margin"],
        scales_of(run), near, felt(run.system, run.values),
    )  # fmt: skip
    found += near_locking.findings(near, _dial_of(near, run, at)) if near else []
    spans = [run.system.span(run.values, name) for name in run.system.mechanism.drivers]
    several = len(spans) > 1 or run.system.mechanism.gears
    if several and not run.cycle.periodic and spans and all(span.periodic for span in spans):
        whom = "drivers" if len(spans) > 1 else "driver and the gears"
        found.append(finding_for("cycle.not_common", "drivers", duration=run.cycle.duration, phrases={"whom": whom}))
    return [*found, *_loads_over_the_cycle(run, at)]


def _beside_gaps(system: System, course: CycleCourse | None) -> Iterator[Finding]:
    """Efforts that are largest next to where pins cross their play, and nearer to it are not known."""
    for i, name in enumerate(system.mechanism.drivers if course else ()):
        assert course is not None
        largest = course.extreme(lambda rows, i=i: np.abs(rows["drive_effort"][i]))  # type: ignore[misc]
        if largest is not None and course.beside(largest, Status.CONTACT_LOST):
            yield finding_for("effort.beside_gap", f"drivers.{name}", at=course.told(largest).removeprefix("at "))


def _loads_over_the_cycle(run: Run, at: Positions) -> Iterator[Finding]:
    """What only the motion shows of a load or spring: a resistance that drives, a torsional spring that unwinds."""
    entries = run.system.mechanism.parameter_set.entries.items()
    resisting = [path for path, one in entries if one.varies and one.location[-1] in RESISTING]
    if resisting:
        stated = Stated(stated_walk(run.system, run.values, run.chosen.assembly, at.time))
    for path in resisting:
        negative = np.flatnonzero(np.broadcast_to(np.asarray(stated.get(path)), at.time.shape) < 0)
        if len(negative):
            yield finding_for("load.drives", path, at=at.dial.intervals(negative))
    for i, (name, spring) in enumerate(run.system.mechanism.springs.items()):
        if spring.joint is not None and run.system.turns(spring.joint):
            jumps = np.flatnonzero(np.abs(np.diff(at.arrays["spring_elongation"][i])) > np.pi)
            if len(jumps):
                yield finding_for("spring.jump", f"springs.{name}", at=at.dial.at(int(jumps[0])))
        if spring.only is not None:
            yield from _never_acts(run, name, at.arrays["spring_elongation"][i])
        if spring.between is not None and spring.only != "pull":
            yield from _turned_round(run, name, at.arrays["spring_elongation"][i], at.dial)
    marked = [name for name, load in run.system.mechanism.loads.items() if load.useful]
    useful = at.arrays["useful_power"]
    if marked and np.all(np.isfinite(useful)) and not np.any(useful):  # where positions have no answer, that is why
        yield finding_for("load.no_power", "loads", loads=marked, count=len(marked))


def _never_acts(run: Run, name: str, elongation: NDArray[np.float64]) -> Iterator[Finding]:
    """A spring that only pulls or only pushes and is on its other side throughout: nothing ever touches it."""
    only = str(run.system.mechanism.springs[name].only)
    sign = 1.0 if only == "pull" else -1.0
    if np.any(np.isfinite(elongation)) and np.nanmax(sign * elongation) < 0:
        free = float(np.max(run.values[f"springs.{name}.free_length"]))
        nearest = free + sign * float(np.nanmax(sign * elongation))
        yield finding_for("spring.never_acts", f"springs.{name}", only=only, free=free, nearest=nearest)


def _turned_round(run: Run, name: str, elongation: NDArray[np.float64], dial: Dial) -> Iterator[Finding]:
    """A spring whose ends pass each other: where it is shortest, it is shorter than the step to a position beside."""
    free, preload = (float(np.max(run.values.get(f"springs.{name}.{key}", 0.0))) for key in ("free_length", "preload"))
    length = elongation + free
    if len(length) < 3 or not (free or preload):
        return
    before, here, after = length[:-2], length[1:-1], length[2:]
    passed = np.flatnonzero((here <= before) & (here <= after) & (2 * here < np.maximum(before, after)))
    if len(passed):
        yield finding_for("spring.turned_round", f"springs.{name}", at=dial.at(int(passed[0]) + 1))


def references(mechanism: Mechanism) -> list[str]:
    laws = {
        joint.friction.law or "coulomb" for joint in mechanism.effective_joints.values() if joint.friction is not None
    }
    method = DURANGO if mechanism.space == "planar" else PEZZUTI
    return [method, *(f"{law}: {FRICTION_LAWS[law].source}" for law in sorted(laws)), *mechanism.references]


def figures(run: Run, found: Positions, near: near_locking.Locking | None = None) -> Iterator[Figure]:
    """The figures one looks at first. Those of the cycle are read of its course, whatever the positions are."""
    arrays, status = found.arrays, found.arrays["status"]
    counted = status < Status.NOT_CONVERGED
    with np.errstate(all="ignore"):
        if found.course is not None:
            yield from _cycle_figures(run, found, near, found.course)
        if near and (back := reverse_figure(run)):
            yield back
        residual = balance(arrays, scales_of(run).floor("W")) if np.any(counted) else None
        yield Figure("power_residual", "power balance residual", residual, aspect="maximum, of peak power")
    if run.seats:
        yield Figure("seat_rounds", "seat iterations", np.max(arrays["seat_rounds"]), aspect="maximum")
    rounds = int(np.max(arrays["friction_iterations"]))
    yield Figure("friction_iterations", "friction iterations", rounds, aspect="maximum")
    lost = int(np.count_nonzero(status == Status.CONTACT_LOST))
    solved = int(np.count_nonzero(counted)) - lost
    yield Figure("positions_solved", "positions solved", solved, aspect=f"of {len(found.time)}")
    if lost:
        yield Figure("positions_lost", "positions not valid (a pin loses contact or bears no load)", lost)


def _cycle_figures(
    run: Run, found: Positions, near: near_locking.Locking | None, course: CycleCourse
) -> Iterator[Figure]:
    """Efforts, reactions, friction and efficiency over the cycle, and what errors change."""
    yield from _effort_figures(run.system, course)
    yield from _reaction_figures(run.system, course, scales_of(run))
    if rubbing(run.system):
        yield from _friction_figures(run, found, near, course)
    means = course.means
    note = uncounted.meaning(run.system.mechanism, means, course.status)
    yield Figure("efficiency", "efficiency of the cycle", means.efficiency, note=note)
    yield Figure("efficiency_error", "efficiency, numerical error", means.efficiency_error)
    if found.ideal is not None:
        yield Figure("efficiency_ideal", "efficiency of the cycle without errors", found.ideal.efficiency)
        yield from _error_figures(run, course)


def _effort_figures(system: System, course: CycleCourse) -> Iterator[Figure]:
    for i, (name, unit) in enumerate(zip(system.mechanism.drivers, effort_units(system), strict=True)):
        subject = f"drive {'torque' if unit == 'N m' else 'force'} of {name}"
        for end, aspect, sign in (("min", "minimum", -1.0), ("max", "maximum", 1.0)):
            top = course.top(lambda rows, i=i: rows["drive_effort"][i], sign, unit)  # type: ignore[misc]
            if top is not None:
                yield Figure(f"{name}.effort_{end}", subject, top.value, unit, aspect, top.place)
        yield Figure(f"{name}.effort_rms", subject, course.means.drive_effort_rms[i], unit, "RMS")


def _friction_figures(
    run: Run, found: Positions, near: near_locking.Locking | None, course: CycleCourse
) -> Iterator[Figure]:
    """How near to locking it is, and what friction takes."""
    if found.method.margin_up_to:
        margin = _least_margin(run, found.method)
        yield margin
        yield from near.figures(run, margin.place) if near else ()
    means = course.means
    yield Figure("friction_power_mean", "friction power", means.friction_power.net, "W", "mean")
    if means.supposed > 0:
        off = means.friction_power.error + means.supposed * abs(means.drive_power.net)
        yield Figure("friction_power_error", "friction power, numerical error, at most", off, "W")
    lost = course.top(lambda rows: np.sum(rows["friction_power"], axis=0), unit="W")
    if lost is not None:
        yield Figure("friction_power_max", "friction power", lost.value, "W", "maximum", lost.place)


def _least_margin(run: Run, method: FrictionMethod) -> Figure:
    """The least multiple of all friction at which it locks; `margin_up_to` is as far as that is looked for."""
    name, subject, margins = "locking_margin", "locking margin", margin_of(run, method)
    least = margins.extreme(lambda rows: rows["locking_margin"], -1.0, margins.valid)
    if least is not None:
        return Figure(name, subject, least.value, aspect="minimum", place=margins.told(least), note=TIMES)
    if np.any(margins.valid & (margins.status < Status.LOAD_UNDEFINED)):
        return Figure(name, subject, method.margin_up_to, aspect=MORE_THAN, note=TIMES)
    return Figure(name, subject, None, note=TIMES)


def _reaction_figures(system: System, course: CycleCourse, scales: Scales) -> Iterator[Figure]:
    """Largest reaction of every joint, in space its moment too; stroke of every slide."""
    loads = [("reaction", "reaction_force", "N")]
    if system.mechanism.space == "spatial":
        loads.append(("reaction moment", "reaction_moment", "N m"))
    planar = system.mechanism.space == "planar"
    for i, (name, (kind, _)) in enumerate(system.joints.items()):
        for what, variable, unit in loads:
            top = course.top(
                lambda rows, of=variable, i=i: np.sqrt(np.sum(rows[of][i] ** 2, axis=0)),  # type: ignore[misc]
                unit=unit,
            )
            if top is None:
                continue
            if planar or top.value > scales.floor(unit):
                key = f"{name}.{what.replace(' ', '_')}_max"
                yield Figure(key, f"{what} of {name}", top.value, unit, "maximum", top.place)
        if PAIRS[kind].guided:
            ends = [
                course.extreme(lambda rows, i=i: rows["joint_slide"][i], sign, course.valid)  # type: ignore[misc]
                for sign in (1.0, -1.0)
            ]
            if ends[0] is not None and ends[1] is not None:
                stroke, note = ends[0].value - ends[1].value, course.note
                yield Figure(f"{name}.stroke", f"stroke of {name}", stroke, "m", note=note)


def _error_figures(run: Run, course: CycleCourse) -> Iterator[Figure]:
    """What the errors do, in the figures one looks at first; where no pin loses contact."""

    def top(of: Callable[[Rows], NDArray[np.float64]]) -> Place | None:
        return course.extreme(of, 1.0, course.valid)

    points = [
        (found.value, k, found)
        for k in range(len(run.system.points))
        if (found := top(lambda rows, k=k: np.sqrt(np.sum(rows["point_error"][k] ** 2, axis=0)))) is not None  # type: ignore[misc]
    ]
    if points:
        highest = max(points)[0] * (1 - ALIKE)
        size, k, found = next(one for one in points if one[0] >= highest)  # of equal ones the first
        most = f"largest: {'.'.join(run.system.points[k])}"
        yield Figure("point_error_max", "position error", size, "m", most, course.told(found))
    for i, (joint, (kind, links)) in enumerate(run.system.joints.items()):
        if run.system.mechanism.fixed_link not in links or joint in run.system.mechanism.drivers:
            continue
        what, unit = ("slide", "m") if PAIRS[kind].guided else ("rotation", "rad")
        error = top(lambda rows, of=f"joint_{what}_error", i=i: np.abs(rows[of][i]))  # type: ignore[misc]
        if error is not None:
            name, subject = f"{joint}.{what}_error_max", f"transmission error of {joint}"
            yield Figure(name, subject, error.value, unit, "largest magnitude", course.told(error))
    for i, joint in enumerate(run.system.mechanism.drivers):
        kind, unit = ("torque", "N m") if run.system.turns(joint) else ("force", "N")
        subject, name = f"change of the drive {kind} of {joint} by the errors", f"{joint}.effort_change_max"
        ends = [
            found
            for sign in (1.0, -1.0)
            if (found := course.extreme(lambda rows, i=i: rows["drive_effort_change"][i], sign, course.valid))  # type: ignore[misc]
        ]
        if ends:
            change = max(ends, key=lambda one: abs(one.value))
            yield Figure(name, subject, change.value, unit, "largest magnitude", course.told(change))


def _near_locking(run: Run, at: Positions) -> near_locking.Locking | None:
    """What is to know of locking, if there is friction and a driver."""
    if not rubbing(run.system) or not run.system.mechanism.drivers:
        return None
    with np.errstate(all="ignore"):
        worst = None
        if at.course is not None and at.method.margin_up_to:
            margins = margin_of(run, at.method)
            least = margins.extreme(lambda rows: rows["locking_margin"], -1.0, margins.valid)
            worst = None if least is None else margins.side(least, "locking_margin", -1.0)
        return near_locking.look(run, at.time, at.arrays["locking_margin"], at.method, at.walked, worst)


def _dial_of(near: near_locking.Locking, run: Run, found: Positions) -> Dial:
    """Names of the positions that were looked at: most often all."""
    return found.dial if len(near.times) == len(found.time) else run.system.dial(run.values, near.times)


def _ranges(run: Run, found: Positions, near: near_locking.Locking | None) -> dict[str, Any]:
    """Where it holds itself, for the report: the ranges of `locking` with their share of the positions looked at."""
    if near is None or not np.any(np.abs(near.back.acting) > 0):
        return {}
    margin = found.arrays["locking_margin"]
    if len(near.times) != len(found.time):
        with np.errstate(all="ignore"):
            margin = np.zeros(len(near.times)) + locking_margin(run.solve(near.times, method=found.method))
    dial = _dial_of(near, run, found)
    rows = [
        {"state": "" if one.state is None else one.state.name.lower(), "cells": cells(one, dial),
         "first": one.first, "count": one.last - one.first + 1}
        for one in ranges_of(_states(found, near), margin)
    ]  # fmt: skip
    return {"locking_ranges": {"of": dial.of, "positions": len(near.times), "rows": rows}}


def _states(found: Positions, near: near_locking.Locking) -> NDArray[np.int8]:
    """The codes of `LockingState` of the positions looked at."""
    known, status = np.isfinite(near.back.acting), found.arrays["status"]
    if len(near.times) == len(found.time):
        known = (status < Status.NOT_CONVERGED) | (status == Status.LOCKED)
    return in_order(near.ahead, near.back, known)


# the power balance: what is left over, and what that is held against
BALANCED = ("power_residual", "drive_power", "useful_power", "friction_power", "spring_power")


def balance(arrays: Arrays, floor: float) -> float:
    """Largest power residual over the largest power that any driver, or else any load, has; 0 where all are rounding.

    floor: power that is rounding, W.
    """
    residual, *powers = (peak(arrays[name]) for name in BALANCED if name in arrays)
    highest = max(powers)
    if max(residual, highest) <= floor:
        return 0.0
    return residual / highest if highest > 0 else residual


def inputs(mechanism: Mechanism) -> list[dict[str, Any]]:
    """Every number that was stated: path, SI value, unit, and the text of the model."""
    values = mechanism.parameters()
    dimensions: dict[str, Dimension | None] = {}
    rows = []
    for path, entry in mechanism.parameter_set.entries.items():  # dimensions first, in order of evaluation
        unit = entry.kind.unit
        if path.startswith("dimensions."):
            name = path.removeprefix("dimensions.")
            dimensions[name] = entry.quantity.check(dimensions)
            unit = si_unit(dimensions[name])
        text = str(entry.quantity.source)
        if not entry.alias and text != "0":
            value = float(values[path]) if path in values else None  # an expression of the motion has many
            rows.append({"path": path, "value": value, "unit": unit, "text": text})
    return rows


def _courses(run: Run, time: NDArray[np.float64]) -> dict[str, Any]:
    """Loads that vary at every position, for the drawing; beyond COURSE positions it shows their largest value."""
    if len(time) > COURSE:
        return {}
    found = courses(run.system, run.values, stated_walk(run.system, run.values, run.chosen.assembly, time))
    return {"load_courses": found} if found else {}


def scene_of(run: Run) -> dict[str, Any]:
    """What a drawing needs to know beside the positions of the points."""
    system = run.system
    walk = stated_walk(system, run.values, run.chosen.assembly, run.cycle.times(DRAWN))
    found: dict[str, Any] = fill_of(system).scene(system, run.values, walk, useful_loads(system.mechanism))
    return found
