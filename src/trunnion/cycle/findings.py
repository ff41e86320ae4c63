"""What is to be known of a mechanism over its cycle: a list of questions, each of them a small function.

What concerns the cycle is read of courses, so that it does not depend on which positions were asked for; causes of
positions without an answer are those of the positions (`causes`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.algebra.dual import primal, single
from trunnion.cycle.course import CycleCourse, course_of
from trunnion.cycle.locking_course import LockingCourse, LockingState, locking_course
from trunnion.cycle.positions import Positions
from trunnion.cycle.scales import scales_of
from trunnion.errors import Finding, Severity, Status, agreeing
from trunnion.model.joint_parts import clearance
from trunnion.model.mechanism import Mechanism
from trunnion.results.quantities import between, readable
from trunnion.solve import loads
from trunnion.solve.loads import Stated, stated_walk
from trunnion.solve.margin import margin_in
from trunnion.solve.seating import NO_LOAD, UNSETTLED, Crossing, seating_of
from trunnion.solve.system import System, felt, rubbing

if TYPE_CHECKING:
    from trunnion.solve.run import Run

Array = NDArray[np.float64]
RESISTING = ("resisting_torque", "resisting_force")  # loads that are to be positive
CLASS_TWO = 2
NEGLIGIBLE = 1e-3  # of the largest effort of a driver: an interval of its effort that is less is no finding
RESOLVED = 1e-7  # of its largest value: a resistance that is below 0 by less is 0, for so well its course is known
ROUNDED = 1e-6  # beside its error: an efficiency is above 1 by more, for seats settle to as much of their clearance
MOST_PLACES = 8  # named in one sentence
WITHIN = 17  # times at which a range that locks between the positions is looked at, with its ends
ENDS = ("", " (end 1)", " (end 2)", " (along its axis)")  # by the place of an end


@dataclass(frozen=True)
class Cycle:
    """A run with its positions: what findings and figures of a cycle are made of."""

    run: Run
    at: Positions

    @property
    def course(self) -> CycleCourse | None:
        """That of the cycle, if it was looked for."""
        return self.at.course

    @property
    def mechanism(self) -> Mechanism:
        return self.run.system.mechanism

    @cached_property
    def locking(self) -> LockingCourse | None:
        """Locking over the cycle, if there is friction and a driver."""
        return locking_course(self.run, self.at.method) if rubbing(self.run.system) else None

    def course_of(self, look: Callable[[Array], Sequence[Array]]) -> Courses:
        """The course of some numbers of the motion."""
        run = self.run

        def rows(time: Array) -> tuple[Array, NDArray[np.intp]]:
            numbers = look(time)
            return np.array([np.broadcast_to(primal(row), time.shape) for row in numbers]), np.zeros(time.shape, int)

        return run.courses(rows)

    def place(self, time: float) -> str:
        """A time, s, on the dial of the drive."""
        return self.between(time, time).removeprefix("at ")

    def between(self, low: float, high: float) -> str:
        """A range of times, s, on the dial of the drive, as one place if its ends read alike."""
        return self.run.system.dial(self.run.values, np.array([low, high, self.run.cycle.duration])).between(0, 1)


def listed(places: Sequence[str]) -> str:
    """Places in words, in their order; of many how often, and the first and the last."""
    if len(places) <= MOST_PLACES:
        return ", ".join(places)
    return f"{len(places)} times, first {places[0]}, last {places[-1]}"


def findings(cycle: Cycle) -> list[Finding]:
    """What is to be known of a mechanism over its cycle."""
    return [*of_run(cycle.run), *(finding for question in QUESTIONS for finding in question(cycle))]


def effort_units(system: System) -> list[str]:
    """Unit of every driver's effort."""
    return ["N m" if system.turns(name) else "N" for name in system.mechanism.drivers]


# ---- of a model, before any position is solved ----------------------------------------------------------------


def of_run(run: Run, notes: bool = True) -> list[Finding]:
    """What there is to say before any position is solved. notes: of the model, too."""
    model = run.once("notes", lambda: model_notes(run.system.mechanism, run.system))
    graver = [finding for finding in model if notes or finding.severity is not Severity.NOTE]
    return [*graver, *run.chosen.findings, *(run.determinacy.findings() if run.determinacy else [])]


def model_notes(mechanism: Mechanism, system: System) -> list[Finding]:
    """What the model says that this analysis leaves out, and warnings about the data."""
    notes = list(mechanism.checked)
    values = mechanism.parameters()
    play = {name: clearance(name, values) for name in mechanism.effective_joints if name not in mechanism.seated}
    playing = [name for name, gap in play.items() if gap is not None and gap > 0]
    bodies = {name: link for name, link in mechanism.effective_links.items() if name != mechanism.fixed_link}
    heavy = [name for name, link in bodies.items() if link.mass.source != 0]
    if heavy and mechanism.gravity is None:
        down, none = ("[0, -9.81]", "[0, 0]") if mechanism.space == "planar" else ("[0, 0, -9.81]", "[0, 0, 0]")
        what = f"gravity is not stated and taken as zero, although {', '.join(heavy)} have mass"
        remedy = f"state gravity: {down}, or gravity: {none}"
        notes.append(Finding.note("model.gravity", "gravity", what, remedy, links=heavy))
    if playing:
        remedy = "for pins pressed to one side by their loads state seat: loaded, or analyse with --seat loaded"
        if any(module.redundant for module in system.plan.modules):  # no seats are taken in over-constrained links
            remedy = "see `trunnion play` for the effect of the play, and `trunnion assemble` for whether links fit"
        what = f"the pins of {', '.join(playing)} are at the middle of their play"
        notes.append(Finding.note("model.play_centred", "joints", what, remedy, joints=playing))
    return notes


def shared_dimensions(mechanism: Mechanism) -> Iterator[Finding]:
    """Of each toleranced dimension that alone sets points of more than one link: as one they vary together, as parts do
    not.

    Where it stands beside other dimensions, as the radius of a roller between two links does, it is one part's own.
    """
    placed = [
        (path, entry.depends)
        for path, entry in mechanism.parameter_set.entries.items()
        if path.startswith("links.") and ".points." in path
    ]
    for tolerance in mechanism.tolerated():
        used = [path for path, depends in placed if depends == (tolerance.path,)]
        links = list(dict.fromkeys(path.split(".")[1] for path in used))
        if tolerance.path.startswith("dimensions.") and len(links) > 1:
            name = tolerance.path.removeprefix("dimensions.")
            names = [path.removeprefix("links.").replace(".points.", ".") for path in used]
            what = f"one tolerance sets {', '.join(names)}: these links deviate together, by the same amount"
            remedy = "if the links are made separately, give each a dimension of its own with its own tolerance"
            yield Finding.note("tolerance.shared_dimension", tolerance.path, what, remedy, name=name, links=links)


# ---- assembly, locking and singular positions -----------------------------------------------------------------


def _not_assembled(cycle: Cycle) -> Iterator[Finding]:
    """Modules that do not close, and by how much."""
    dial, system = cycle.at.dial, cycle.run.system
    moving = [name for name, driver in cycle.mechanism.drivers.items() if driver.moves]
    for (number, *reasons), (places, sizes) in sorted(cycle.at.causes.of("open").items(), key=lambda item: item[0][0]):
        module, at = system.plan.modules[number], dial.intervals(places)
        drives = {name: system.drive(cycle.run.values, name, cycle.at.time[places]) for name in moving}
        # a driver that cannot move another joint to there has a rate, and no coordinate
        past = (name for name, (at_, rate, _) in drives.items() if np.all(np.isnan(at_) & np.isfinite(rate)))
        everywhere, where = len(places) == len(dial.values) > 1, f"links {', '.join(module.links)}"
        nowhere = f"cannot be assembled {'at any position' if everywhere else at}"
        remedy = "change the lengths or the range of the driver"
        if reasons:
            gaps = {reason: np.nanmax(row) for reason, row in zip(reasons, sizes, strict=True) if np.any(row > 0)}
            by = "; ".join(f"{name} by up to {readable(size, 'm')}" for name, size in gaps.items())
            what = f"{nowhere}: {by or 'an earlier group has no position'}"
            yield Finding.error("assembly.gap", where, what, remedy, at=at, gaps=gaps)
        elif system.inverse and (driver := next(past, None)):
            what = f"has no position {at}: {system.inverse.moves[driver]} is past a dead centre of {driver}"
            remedy = "end the motion before it"
            yield Finding.error("assembly.past_dead_centre", f"drivers.{driver}.moves", what, remedy, at=at)
        else:
            why = "these links do not close" if everywhere or np.any(places == 0) else "not reached from the start"
            if module.redundant:
                remedy = "these links are over-constrained: see `trunnion assemble` for the play that they need"
            yield Finding.error("assembly.open", where, f"{nowhere}: {why}", remedy, at=at)


def _without_answer(cycle: Cycle) -> Iterator[Finding]:
    """Positions that are singular or close to it, that do not converge, or in which a load or a sense is undefined."""
    arrays, dial, causes = cycle.at.arrays, cycle.at.dial, cycle.at.causes
    status = arrays["status"]
    condition = np.where(np.isnan(arrays["condition"]), np.inf, arrays["condition"])
    for places, _ in causes.of("stuck").values():
        if len(places := places[status[places] == Status.ZERO_SLIP]):
            at = dial.intervals(places)
            what = f"a joint with friction reverses {at} while its pin moves within its play: friction may act either "
            yield Finding.note("friction.sense", "joints", f"{what}way there, and the seat changes with it", at=at)
    for number, (places, _) in causes.of("singular").items():
        module, at, most = cycle.run.system.plan.modules[number], dial.intervals(places), np.max(condition[places])
        kind = "dead centre (singular position)" if module.rank == CLASS_TWO else "singular position"
        what = f"{kind} {at}: condition number {readable(most, digits=3)}"
        remedy = "speeds have no finite value there, nor have forces without friction; limit the range of the driver"
        where = f"links {', '.join(module.links)}"
        yield Finding.error("position.singular", where, what, remedy, at=at, condition=most)
    for path, (places, _) in causes.of("undefined").items():
        at = dial.intervals(places)
        if path.startswith("loads."):
            remedy = "extend its tables over the whole cycle, or make them periodic; check divisions and roots"
            yield Finding.error("load.undefined", path, f"has no value {at}", remedy, at=at)
        else:
            remedy = "its line has no direction where its ends coincide: move one end"
            yield Finding.error("spring.undefined", path, f"has no value {at}", remedy, at=at)
    if len(late := np.flatnonzero(status == Status.NOT_CONVERGED)):
        what, at = "the friction iteration did not converge", dial.intervals(late)
        remedy = "use the Newton method, a larger criterion or more iterations"
        yield Finding.error("friction.not_converged", "joints", f"{what} {at}", remedy, at=at)
    if len(close := np.flatnonzero(status == Status.NEAR_SINGULAR)):
        at, most = dial.intervals(close), np.max(condition[close])
        what = f"close to a dead centre {at}: condition number up to {readable(most, digits=3)}"
        remedy = "forces there depend strongly on small changes of the dimensions"
        yield Finding.warning("position.near_singular", "links", what, remedy, at=at, condition=most)


def _locked(cycle: Cycle) -> Iterator[Finding]:
    """Modules that lock: how far they are from running, the joint that decides, and whether they lock backward too."""
    rubs = felt(cycle.run.system, cycle.run.values)
    for number, where, share, margin in _locks(cycle):
        module = cycle.run.system.plan.modules[number]
        joints = [name for name in module.joints if name in rubs]
        what = f"locked by friction {where}: there is a solution only up to "
        what += f"{share:.4g} times the friction of {', '.join(joints)}"
        remedy = f"lower the coefficients of all joints below {min(share, margin):.3g} times their values, shorten the "
        remedy += "arms or lengthen the guides"
        figures: dict[str, Any] = {"at": where, "share": share, "joints": joints, "whole": margin}
        figures |= {"decides": "", "multiple": None}
        if cycle.locking is not None:
            if LockingState.JAMMED in cycle.locking.all_states():
                what += "; driven backward it locks too (jammed)"
            decides, multiple = cycle.locking.responsible or ("", 1.0)
            if decides in module.joints and multiple < 1:
                remedy = f"lower the coefficient of {decides} alone below {multiple:.3g} times its value; or {remedy}"
                figures |= {"decides": decides, "multiple": multiple}
        yield Finding.error("friction.locked", f"links {', '.join(module.links)}", what, remedy, **figures)


def _locks(cycle: Cycle) -> Iterator[tuple[int, str, float, float]]:
    """Each module that locks, where, its share of the friction and the margin of all; between the positions if only
    there."""
    at, run, course = cycle.at, cycle.run, cycle.course
    noted = at.causes.of("locked")
    for number, (places, shares) in noted.items():
        margin = float(np.nanmin(at.arrays["locking_margin"][places], initial=np.inf))
        yield number, at.dial.intervals(places), float(np.min(shares)), margin
    if course is None or noted or not np.any(course.status == Status.LOCKED):
        return
    panels, edges = np.flatnonzero(course.status == Status.LOCKED), course.courses.edges
    time = np.linspace(edges[panels], edges[panels + 1], WITHIN)[1:-1].T.ravel()
    back = seating_of(run, at.method).at(time, at.method).back if run.seats else run.solve(time, method=at.method)
    margin = float(np.nanmin(margin_in(back, 1.0), initial=np.inf))
    runs = np.split(panels, np.flatnonzero(np.diff(panels) > 1) + 1)
    where = listed([cycle.between(edges[part[0]], edges[part[-1] + 1]) for part in runs])
    for number, settled in zip(reversed(range(len(back.settled))), back.settled, strict=True):
        if (share := float(np.min(settled.share))) < 1.0:
            yield number, where, share, margin


def _resting(cycle: Cycle) -> Iterator[Finding]:
    """Joints at rest, those that are at the same positions as one, and the interval of the efforts there."""
    system, at, scales = cycle.run.system, cycle.at, scales_of(cycle.run)
    holding = {*felt(system, cycle.run.values), *system.resisted}  # without friction either way is the same
    together: dict[bytes, tuple[list[str], NDArray[np.intp]]] = {}
    for joint, (places, _) in at.causes.of("rest").items():
        if joint in holding:
            together.setdefault(places.tobytes(), ([], places))[0].append(joint)
    for joints, places in together.values():
        bounds = list[str]()
        matters = not cycle.mechanism.drivers
        for i, (driver, unit) in enumerate(zip(cycle.mechanism.drivers, effort_units(system), strict=True)):
            lower, upper = (scales.zeroed(at.arrays[f"drive_effort_{end}"][i], unit) for end in ("lower", "upper"))
            widths, largest = (upper - lower)[places], np.nanmax(np.abs([lower, upper]), initial=0.0)
            matters |= bool(np.any(~(widths <= max(NEGLIGIBLE * largest, scales.floor(unit)))))
            if np.any(np.isfinite(widths)):
                k = places[int(np.nanargmax(widths))]
                what = "torque" if unit == "N m" else "force"
                bounds.append(f"{what} of {driver} {between(lower[k], upper[k], unit)} at {at.dial.at(k)}")
        if matters:
            if not bounds and cycle.mechanism.drivers:
                bounds = ["with one sign it locks, so the drive effort has no bounds"]
            where = at.dial.intervals(places)
            what = f"{', '.join(joints)} {agreeing(len(joints), 'is', 'are')} at rest {where}; friction may act either "
            what += ": ".join(filter(None, ["way there", ", ".join(bounds)]))
            remedy = "the bounds are in drive_effort_lower and drive_effort_upper"
            figures = {"joints": joints, "at": where}
            yield Finding.note("friction.interval", f"joints.{', '.join(joints)}", what, remedy, **figures)


def _ranges(cycle: Cycle) -> Iterator[Finding]:
    """Where it can be assembled, if there are several such ranges: extremes are of that which holds the start."""
    ranges = cycle.course.ranges if cycle.course else []
    if len(ranges) > 1:
        places = [cycle.between(*ends) for *ends, _ in ranges]
        starts = [place for place, (*_, start) in zip(places, ranges, strict=True) if start]
        of = f"extremes are of the one that holds the start, {starts[0]}" if starts else "none of them holds the start"
        what = f"it can be assembled in {len(places)} ranges that are not reached from each other: {', '.join(places)}"
        remedy = "start the driver in another range to have the extremes of that"
        yield Finding.note("assembly.ranges", "links", f"{what}; {of}", remedy, ranges=places, starts=starts)


def _no_common_period(cycle: Cycle) -> Iterator[Finding]:
    """Drivers whose periods have no common multiple."""
    run, drivers = cycle.run, cycle.mechanism.drivers
    spans = [run.system.span(run.values, name) for name in drivers]
    several = len(spans) > 1 or cycle.mechanism.gears or run.cycle.advances
    if several and not run.cycle.periodic and spans and all(span.periodic for span in spans):
        what = f"drivers, gears and threads have no common period; the cycle is the longest, {run.cycle.duration:g} s"
        remedy = "means and efficiency are over that time; choose speeds with a common period, or ranges"
        yield Finding.warning("cycle.not_common", "drivers", what, remedy, duration=run.cycle.duration)


def _rough(cycle: Cycle) -> Iterator[Finding]:
    """Figures of the cycle that are known to fewer digits, for something changes too finely to be resolved."""
    course, tolerance = cycle.course, Accuracy().tolerance
    if course is not None and not cycle.run.seats and course.courses.loosened > 1.0:
        share = course.courses.loosened * tolerance
        what = f"something changes very finely over the cycle: its figures are accurate to {share:.1g} of the largest"
        remedy = "look for singular positions, and for loads, laws or tables that change many times, or at random"
        yield Finding.warning("cycle.rough", "", what, remedy, share=share)


# ---- loads and springs ----------------------------------------------------------------------------------------


def _driving_resistances(cycle: Cycle) -> Iterator[Finding]:
    """Resistances that are negative somewhere, and so drive."""
    run, entries = cycle.run, cycle.mechanism.parameter_set.entries.items()
    paths = [path for path, entry in entries if entry.varies and entry.location[-1] in RESISTING]
    if not paths:
        return

    def look(time: Array) -> list[Array]:
        steady = Stated(stated_walk(run.system, run.values, run.chosen.assembly, time))
        return [np.asarray(steady.get(path)) for path in paths]

    courses = cycle.course_of(look)
    for row, path in enumerate(paths):
        floor = max(RESOLVED * courses.sizes[row], scales_of(run).floor("N m" if path.endswith("torque") else "N"))
        places = [cycle.between(*ends) for ends in courses.below([row], floor)]
        if places:
            what = f"this resistance is negative {listed(places)}: it drives the joint"
            remedy = "use max(0 N, …), or a load with a sign"
            yield Finding.warning("load.drives", path, what, remedy, at=listed(places))


def _springs(cycle: Cycle) -> Iterator[Finding]:
    """Springs whose torque jumps."""
    run, springs = cycle.run, cycle.mechanism.springs
    turning = [row for row, item in enumerate(springs.values()) if item.joint and run.system.turns(item.joint)]
    if not turning:
        return
    courses = cycle.course_of(lambda time: [state.elongation for *_, state in loads.springs(run.walk(time))])
    for row in turning:
        before, after = courses.sides(row)
        if len(jumps := np.flatnonzero(np.abs(after - before) > np.pi)):
            at = cycle.place(float(courses.edges[1 + jumps[0]]))
            what = f"its torque jumps at {at}, where its angle passes half a turn from the free angle"
            remedy = "whole turns are not counted in this joint"
            yield Finding.warning("spring.jump", f"springs.{list(springs)[row]}", what, remedy, at=at)


def _slack(cycle: Cycle) -> Iterator[Finding]:
    """Ropes and chains whose force changes its sign: which way they pull is not stated, but a rope cannot push."""
    ropes = [name for name, gear in cycle.mechanism.gears.items() if gear.radius is not None and not gear.teeth]
    if not ropes or cycle.course is None:
        return
    course = course_of(cycle.run, replace(cycle.at.method, margin_up_to=0.0), names=("gear_torque",))
    least_force = scales_of(cycle.run).floor("N")
    for name in ropes:
        row, radius = list(cycle.mechanism.gears).index(name), single(cycle.run.values[f"gears.{name}.radius"])
        ends = [course.extreme("gear_torque", row, sign=sign, unit="N m") for sign in (-1.0, 1.0)]
        low, high = (0.0 if top is None else top.value / abs(radius) for top in ends)
        if low < -least_force and high > least_force:
            places = " and ".join(course.told(top) for top in ends if top is not None)
            what = f"the force in {name} changes its sign: {between(low, high, 'N')}, {places}"
            remedy = "a closed chain or belt bears both ways; a rope goes slack where it would push"
            yield Finding.note("gears.slack", f"gears.{name}", what, remedy, lower=low, upper=high)


def _uncounted_work(cycle: Cycle) -> Iterator[Finding]:
    """An efficiency above 1: something beside the drives supplies work, which is not counted as input."""
    means = cycle.at.means
    if means.efficiency > 1 + ROUNDED + means.efficiency_error:
        drive = means.drive_power.net * cycle.run.cycle.duration
        what = f"the efficiency of the cycle is {means.efficiency:.4g}, above 1: the drive gives {readable(drive, 'J')}"
        remedy = "work of loads, springs and masses is not counted as input; leave out a load that stands for the drive"
        figures = {"efficiency": means.efficiency, "drive": drive}
        yield Finding.warning("efficiency.above_one", "", what, remedy, **figures)


# ---- pins and errors ------------------------------------------------------------------------------------------


def _lost_contacts(cycle: Cycle) -> Iterator[Finding]:
    """Pins that lose contact, those that do at the same places as one, and pins that nothing presses."""
    run, at = cycle.run, cycle.at
    if not run.seats:
        return
    seating = seating_of(run, at.method)
    loads, unsettled = seating.loads, seating.states(at.time) == UNSETTLED
    idle: dict[str, dict[str, None]] = {}
    for end, low, high in loads.idle:
        idle.setdefault(cycle.between(low, high), {})[end.seat.joint] = None
    for text, joints in idle.items():
        what = f"no load presses the pins of {', '.join(joints)} {text}: positions there are not valid"
        remedy = "expect impact where the load sets in"
        yield Finding.note("contact.unloaded", "joints", what, remedy, joints=list(joints), at=text)
    lost: dict[tuple[str, str], list[Crossing]] = {}
    for seat in run.seats:
        joint, where = seat.joint, f"joints.{seat.joint}"
        part = "pin" if any(len(end) > 1 for end in seat.play.model.ends) else "slider"
        crossings = [cross for cross in loads.passages if cross.end.seat.joint == joint]
        if crossings:
            text = listed([f"at {cycle.place(cross.time)}{ENDS[cross.end.place]}" for cross in crossings])
            lost.setdefault((part, text), []).extend(crossings)
        elif seat.given is None and loads.largest > 0 and all(end.seat.joint != joint for end, _ in loads.pressed):
            what = f"the {part} carries no load: it is at the middle of its play"
            yield Finding.note("seat.unloaded", where, what, "state the seat, or seat: free", part=part)
        halts = [
            cycle.between(halt.low, halt.high) for halt in seating.halts
            if halt.joint == joint and not any(halt.low <= cross.high and cross.low <= halt.high for cross in crossings)
        ]  # fmt: skip
        if halts:
            text = listed([*dict.fromkeys(halts)])
            what = f"the {part} lifts off the wall {text}: the inertia of its motion within the play exceeds the load"
            remedy = "forces there are those of a pin that stays in contact"
            yield Finding.warning("contact.lifted", where, what, remedy, part=part, at=text)
        late = unsettled & (at.arrays["contact_lost"][list(run.system.joints).index(joint)] > 0)
        if np.any(late):
            intervals, change = at.dial.intervals(np.flatnonzero(late)), np.max(at.arrays["seat_change"][late])
            what = f"the seat did not converge {intervals}: it still changes by {change:.2g} times the clearance"
            remedy = "the pin floats there: treat it as loss of contact"
            yield Finding.warning("seat.unsettled", where, what, remedy, at=intervals, change=change)
    for (part, text), crossings in lost.items():
        names = list(dict.fromkeys(cross.end.seat.joint for cross in crossings))
        nearest = min(crossings, key=lambda cross: cross.least / cross.peak)
        least = nearest.least if nearest.least > NO_LOAD * nearest.peak else 0.0  # less than that is rounding
        what = f"the {part}{agreeing(len(names), ' loses', 's lose')} contact {text}: the load falls to "
        what += f"{readable(least, 'N')} (peak {readable(nearest.peak, 'N')}) and reverses"
        facts: dict[str, Any] = {
            "part": part,
            "count": len(names),
            "at": text,
            "least": least,
            "peak": nearest.peak,
        }
        yield Finding.warning("contact.lost", f"joints.{', '.join(names)}", what, "expect impact there", **facts)


QUESTIONS: tuple[Callable[[Cycle], Iterable[Finding]], ...] = (
    _not_assembled, _without_answer, _locked, _resting, _ranges, _no_common_period, _rough, _driving_resistances,
    _springs, _slack, _uncounted_work, _lost_contacts,
)  # fmt: skip
