"""The books of a motion in time: variables, energy, events, summary and findings, gathered into the result."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.cycle.findings import effort_units
from trunnion.cycle.scales import largest
from trunnion.cycle.scene import scene_of
from trunnion.cycle.summary import inputs, member_units, references
from trunnion.dynamics.active_motion import Impact
from trunnion.dynamics.motor import switched
from trunnion.dynamics.opened import is_rigid
from trunnion.dynamics.rates import CLUTCH, WORKS
from trunnion.dynamics.rates import CONTACT as IN_CONTACTS
from trunnion.dynamics.rest import Rest
from trunnion.dynamics.shown import CONTACT, IMPACT, Touches, impact_arrays, impact_figures
from trunnion.dynamics.solution import Ended, Event, Solution, Stretch
from trunnion.dynamics.spectrum import FEWEST, FREQUENCY, SPECTRUM, spectrum
from trunnion.dynamics.started import steady_figures
from trunnion.dynamics.state import FreeMotion, Moment
from trunnion.dynamics.touching import SLOWEST
from trunnion.errors import Finding, Status, agreeing, counted
from trunnion.joints.contact import restitution_of
from trunnion.results import variables as results
from trunnion.results.attributes import cited, encoded, finding_rows, origin
from trunnion.results.dataset import Variable, dataset_of, described
from trunnion.results.figure import Figure
from trunnion.results.quantities import readable
from trunnion.results.result import Result
from trunnion.results.scales import Scales
from trunnion.solve.run import Run

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MOTION", "Books", "Found", "motion_findings", "result_of"]

Array = NDArray[np.float64]

# what there is beside the variables of a cycle
MOTION: dict[str, Variable] = {
    "drive_coordinate": Variable(("driver", "time"), "coordinate", "coordinate of the driver, whole turns included"),
    "drive_rate": Variable(("driver", "time"), "rate", "rate of the driver's coordinate"),
    "work_drive": Variable(("time",), "J", "work of the drivers since the start"),
    "work_loads": Variable(("time",), "J", "work of the loads since the start, positive into the mechanism"),
    "work_springs": Variable(("time",), "J", "work of springs and dampers since the start, likewise"),
    "work_friction": Variable(("time",), "J", "work lost to friction since the start"),
    "work_clutch": Variable(("time",), "J", "work lost in the clutch of a motor since the start"),
    "rotor_speed": Variable(("driver", "time"), "rate", "speed of the motor's rotor behind its clutch"),
    "kinetic_energy": Variable(("time",), "J", "kinetic energy of the links"),
    "potential_energy": Variable(("time",), "J", "potential energy of the links in the field of gravity"),
    "energy_residual": Variable(("time",), "J", "works less changes of energy; 0 but for the errors of integration"),
    "resting": Variable(("time",), "1", "1 while the mechanism rests in friction", np.int8),
    "sticking": Variable(("joint", "time"), "1", "1 while the joint sticks; with several free coordinates", np.int8),
    "event_time": Variable(("event",), "s", "time of the event"),
}


WORDS = dict(zip((*WORKS, IN_CONTACTS, CLUTCH), (
    "work of the drivers", "work of the loads", "work of the springs", "work lost to friction",
    "work lost in contacts", "work lost in the clutch",
), strict=True))  # fmt: skip


class Books(NamedTuple):
    """What is known at the rows of a result: variables as `analyse` has them, state, accelerations of the free
    coordinates, kinetic and potential energy, works, where the mechanism rests, and (joint, time) which
    joints stick."""

    time: Array
    arrays: Mapping[str, Array]
    labels: dict[str, list[str]]
    at: Moment
    seconds: Array
    energies: Array
    works: Array
    resting: NDArray[np.bool_]
    touches: Touches | None = None
    sticking: NDArray[np.bool_] | None = None


class Course(NamedTuple):
    """A motion as courses between the ends of its steps, from which its figures are read, whatever the rows.

    courses: rates of the free coordinates, efforts of the drivers, reactions of the joints by component; counts: how
    many there are of each; last: the books at the end; scales: of all that was read; worst: the largest difference of
    works and energies, J; turned_over, stored: the largest work or change of energy, and the largest energy, J.
    """

    courses: Courses
    counts: tuple[int, int, tuple[int, int]]
    last: Books
    scales: Scales
    worst: float
    turned_over: float
    stored: float

    @classmethod
    def of(cls, run: Run, solution: Solution, between: Callable[[Array], Books]) -> Course | None:
        """That of a solution, None if it does not begin. between: the books at some rising times, s."""
        if not solution.end > 0.0:
            return None
        ends = np.array([0.0, *(stretch.end for stretch in solution.stretches)])
        breaks = ends[np.append(np.diff(ends) > SHORTEST * solution.end, True)]
        begin, sizes = between(np.nextafter(ends[:1], np.inf)), [np.zeros(6)]

        def solve(time: Array) -> tuple[Array, NDArray[np.integer]]:
            numbers, order = np.empty((len(begin.at.rate) + len(flat(begin)), len(time))), np.argsort(time)
            for part in np.split(order, range(PORTION, len(order), PORTION)):
                books = between(time[part])
                works, changes = books.works - begin.works, books.energies - begin.energies
                residual = np.where(books.arrays["condition"] > BLURRED, np.nan, _residual(works, changes))
                account = residual, np.concatenate([works, changes]), books.energies
                scales = largest(run, books.arrays)
                sizes.append(np.array([*scales, *(np.nanmax(np.abs(stretch), initial=0.0) for stretch in account)]))
                numbers[:, part] = np.concatenate([books.at.rate, flat(books)])
            return numbers, np.zeros(len(time), np.intp)

        def flat(books: Books) -> Array:
            forces = books.arrays["reaction_force"]
            return np.concatenate([books.arrays["drive_effort"], forces.reshape(-1, forces.shape[-1])])

        courses = Courses.of(solve, breaks, accuracy=ACCURACY)
        counts = len(begin.at.rate), len(begin.arrays["drive_effort"]), begin.arrays["reaction_force"].shape[:2]
        *scales, worst, turned_over, stored = (float(stretch) for stretch in np.max(sizes, axis=0))
        return cls(courses, counts, between(ends[-1:]), Scales(*scales), worst, turned_over, stored)

    def rate(self, i: int) -> tuple[float, float]:
        """The rate of a free coordinate that is farthest from 0, and its time, s."""
        return self._farthest(i)

    def effort(self, i: int) -> tuple[float, float]:
        """The effort of a driver that is farthest from 0, and its time, s; NaN where it has none."""
        return self._farthest(self.counts[0] + i)

    def reaction(self, i: int) -> tuple[float, float]:
        """The largest size of the reaction of a joint, N, and its time, s."""
        axes = self.counts[2][1]
        first = sum(self.counts[:2]) + i * axes
        return self._top(lambda rows: np.sqrt(np.sum(rows[first : first + axes] ** 2, axis=0)))

    def _farthest(self, row: int) -> tuple[float, float]:
        most, least = self._top(lambda rows: rows[row]), self._top(lambda rows: -rows[row])
        return (-least[0], least[1]) if least[0] > most[0] else most

    def _top(self, of: Callable[[Array], Array]) -> tuple[float, float]:
        place = self.courses.extreme(of)
        if place is None:
            return np.nan, np.nan
        return place.value, float(self.courses.edges[0]) if place.everywhere else place.time


class Found(NamedTuple):
    """A motion with its books at its rows, and its course, None if it does not begin; impacts: of joints in play."""

    solution: Solution
    books: Books
    course: Course | None
    impacts: Sequence[Impact] = ()

    @classmethod
    def of(
        cls, run: Run, solution: Solution, time: Array, between: Callable[[Array], Books],
        impacts: Sequence[Impact] = (),
    ) -> Found:  # fmt: skip
        """time: s, of the rows, up to the end; between: the books at some rising times, s."""
        if solution.ended is not None:
            time = np.append(time[time < solution.end], solution.end)
        return cls(solution, between(time), Course.of(run, solution, between), impacts)

    @property
    def share(self) -> float:
        """What works and energies differ by at most, of the energy turned over; 0 where it is rounding."""
        if self.course is None or not self.course.worst > ROUNDING * self.course.stored:
            return 0.0
        return self.course.worst / self.course.turned_over if self.course.turned_over > 0 else 0.0


def result_of(motion: FreeMotion, integrated: Found, duration: float, nominal: Run | None = None) -> Result:
    """The result of a motion in time. nominal: the mechanism as it was stated, where joints in play were taken out."""
    solution, books, impacts = integrated.solution, integrated.books, integrated.impacts
    run = nominal or motion.run
    _note_switches(motion, solution)
    mechanism, system = run.system.mechanism, run.system
    scales = integrated.course.scales if integrated.course else largest(run, books.arrays)
    findings = [
        *motion_findings(motion, solution, run, impacts),
        *_unbalanced(integrated),
        *_undefined(books),
    ]
    attributes = encoded(
        {
            **origin(mechanism, system.plan.formula, mobility=system.plan.mobility),
            **cited(references(mechanism)),
            "free_drivers": _shown(motion, run),
            "duration": duration,
            "findings": finding_rows(findings),
            **(_named_contacts(motion, impacts) if nominal else {}),
            **scales.summary(_summary(motion, integrated, run, scales)),
            "inputs": inputs(mechanism),
            "scene": scene_of(run),
            "events": [[event.kind, event.of, event.figure if np.isfinite(event.figure) else None, event.unit]
                       for event in solution.events],
        }
    )  # fmt: skip

    def build() -> xr.Dataset:
        variables = {name: event.over("time") for name, event in results.variables(mechanism.space).items()}
        units = member_units(system)
        parts = described(books.arrays, variables, units)
        parts |= described(_own(motion, run, solution, books), MOTION, units)
        labels, along = dict(books.labels), {"time": Variable(("time",), "s", "time from the start")}
        coordinates = {"time": books.time}
        if nominal is not None and books.touches is not None:
            labels["contact"] = list(motion.contacts.labels)
            parts |= described(books.touches.arrays(books.works[-1]), CONTACT) | described(
                impact_arrays(impacts), IMPACT
            )
            rows = np.flatnonzero(np.all(np.isfinite(books.touches.normal), axis=0))
            rows = rows if solution.ended is None else rows[:-1]  # the end is not evenly spaced
            if len(rows) >= FEWEST and not is_rigid(mechanism):  # an impact of rigid bodies has no force
                along["frequency"] = FREQUENCY
                coordinates["frequency"], amplitude = spectrum(books.time[rows], books.touches.normal[:, rows])
                parts |= described({"contact_force_amplitude": amplitude}, SPECTRUM)
        return dataset_of("motion", parts, labels, attributes, described(coordinates, along))

    return Result(attributes, build)


def _named_contacts(motion: FreeMotion, impacts: Sequence[Impact]) -> dict[str, list[str]]:
    """The contact of every impact, and the contacts that are pins in holes."""
    pins = [contact.label for contact in motion.contacts.each if contact.bored]
    return {"impacts": [contact.label for contact in impacts], "contact_pins": pins}


def _shown(motion: FreeMotion, run: Run) -> list[str]:
    """The free drivers that the file states."""
    return [name for name in motion.names if name in run.system.mechanism.drivers]


def _own(motion: FreeMotion, run: Run, solution: Solution, books: Books) -> dict[str, Any]:
    """What there is beside the variables of a cycle."""
    system, names = run.system, list(run.system.mechanism.drivers)
    coordinates, rates = np.empty((2, len(names), len(books.time)))
    for row, name in enumerate(names):
        if name in motion.names:
            i = motion.names.index(name)
            coordinates[row], rates[row] = books.at.q[i], books.at.rate[i]
        else:
            over = ~np.isfinite(books.works[0])  # there is no motion any more
            moved = system.drive(motion.values, name, books.time)[:2]
            coordinates[row], rates[row] = (np.where(over, np.nan, part) for part in moved)
    return {
        "drive_coordinate": coordinates,
        "drive_rate": rates,
        **{f"work_{name}": work for name, work in _works(solution, books.works).items() if name != IN_CONTACTS},
        **_rotors(motion, names, books),
        "kinetic_energy": books.energies[0],
        "potential_energy": books.energies[1],
        "energy_residual": _residual(books.works, books.energies),
        "resting": books.resting,
        **({} if books.sticking is None else {"sticking": books.sticking}),
        "event_time": np.array([event.time for event in solution.events], float),
    }


def _works(solution: Solution, works: Array) -> dict[str, Array]:
    """Works by their names."""
    return dict(zip(solution.layout.works_named, works, strict=True))


def _rotors(motion: FreeMotion, names: Sequence[str], books: Books) -> dict[str, Array]:
    """Speeds of the rotors behind clutches, (driver, time), where there are any."""
    coordinates = np.full((len(names), len(books.time)), np.nan)
    for i, (name, drive) in enumerate(motion.drives.items()):
        if drive.clutched:
            coordinates[names.index(name)] = books.at.slip[0] + drive.ratio * books.at.rate[i]
    return {"rotor_speed": coordinates} if len(books.at.slip) else {}


def _note_switches(motion: FreeMotion, solution: Solution) -> None:
    """Add the motors that are switched off and the brakes that are put on to the events, in their order."""
    for time, kind, of, effort in switched(motion.drives, solution.end):
        unit = "" if np.isnan(effort) else "N m" if motion.system.turns(of) else "N"
        solution.events.append(Event(time, kind, of, effort, unit))
    solution.events.sort(key=lambda event: event.time)


# ---- energy ---------------------------------------------------------------------------------------------------


def _residual(works: Array, energies: Array) -> Array:
    """What works and energies differ by at every time, J."""
    # to friction, and to contacts; from the first time on, which is that after a stop at the start
    drive, loads, springs, *lost = works - works[:, :1]
    energy = energies.sum(axis=0)
    return np.asarray(drive + loads + springs - sum(lost) - (energy - energy[0]))


PORTION = 10_000  # times whose books are read at once: these are many numbers
BLURRED = 1e3  # condition from which the velocities of links in line, and so energies, are not told to all digits
SHORTEST = 1e-12  # of the duration: a step that has no course of its own
# of what an integration knows; a step is one panel, but where a force bends or jumps within it
ACCURACY = Accuracy(tolerance=1e-6, widest=1.0, rounds=10, most=16)
DIFFERS = 0.01  # of a restitution: a difference that is worth a note
FEW = 2  # contacts that begin slowly, of which nothing is said
ROUNDING = 1e-12  # of the energy turned over: a work that is none
WORST = 1e-6  # of the energy turned over: a difference that is worth a warning


def _unbalanced(integrated: Found) -> Iterator[Finding]:
    if integrated.share > WORST:
        what = f"works and energies differ by {integrated.share:.2g} of the energy turned over"
        remedy = "ask for a smaller --tolerance"
        yield Finding.warning("simulate.energy", "", what, remedy, share=integrated.share)


def _undefined(books: Books) -> Iterator[Finding]:
    """Rows of a motion that goes on, without forces."""
    rows = np.flatnonzero(books.arrays["status"] == Status.LOAD_UNDEFINED)
    if len(rows):
        what = f"a load or spring has no value in {counted(len(rows), 'row')} of the result, first at "
        what += f"{readable(float(books.time[rows[0]]), 's')}: there are no forces there"
        remedy = "extend its tables, check divisions and roots; the line of a spring has no direction where its ends "
        remedy += "coincide"
        figures = {"count": len(rows), "time": float(books.time[rows[0]])}
        yield Finding.error("simulate.undefined", "loads", what, remedy, **figures)


# ---- findings -------------------------------------------------------------------------------------------------


def motion_findings(
    motion: FreeMotion, solution: Solution, run: Run, impacts: Sequence[Impact] = ()
) -> Iterator[Finding]:
    """What is to be known of a motion: how it rests, locks or ends."""
    system = motion.system
    yield from (finding for finding in motion.run.chosen.findings if finding.code != "assembly.change_point")
    centred = [finding.joint for finding in motion.run.seats]
    if centred:
        what = f"pins of {', '.join(centred)} are taken in the middle of their holes: a seat that follows the load is "
        what += "left out"
        yield Finding.note("simulate.centred", "", what, joints=centred)
    yield from _of_contacts(motion, run, impacts)
    for code, figures in solution.notes.items():
        if code == "simulate.several_accelerations":
            what = f"from {readable(figures['time'], 's')} on there are several accelerations: friction that grows "
            what += "with the acceleration allows others than that which is followed (Painlevé's paradox)"
            remedy = "lower the friction or the inertia behind the joints that could lock"
            yield Finding.warning("simulate.several_accelerations", "joints", what, remedy, **figures)
        else:
            what = f"in {counted(figures['times'], 'impact')}, the first at {readable(figures['time'], 's')}, the "
            what += "stated restitution would gain energy by friction, or the impacts have no end: the restitution is "
            what += f"lowered there, to {figures['share']:.3g} of itself at the most"
            yield Finding.note("simulate.restitution_lowered", "joints", what, **figures)
    if passed := [event.time for event in solution.events if event.kind == "change-point"]:
        what = f"change points are passed {counted(len(passed), 'time')}, first at {readable(passed[0], 's')}, with "
        what += "the velocities that the links have: reactions have no bound there, so that no largest ones are told"
        yield Finding.warning("simulate.passed", "assembly", what, times=len(passed), time=passed[0])
    name = next(iter(_shown(motion, run)), next(iter(system.mechanism.drivers)))
    effort = effort_units(system)[list(system.mechanism.drivers).index(name)]
    yield from _locks(motion, solution)
    yield from _rests(motion, solution, name, effort)
    if (ended := solution.ended) is not None:
        driver = ended.figures.get("driver", name)
        yield _end(ended, driver, "rad" if system.turns(driver) else "m")


def _end(ended: Ended, driver: str, unit: str) -> Finding:
    """Why a motion ended before its time. driver: the one concerned; unit: of its coordinate."""
    where, at = f"drivers.{driver}", readable(ended.time, "s")
    figures = {**ended.figures, "driver": driver, "unit": unit, "time": ended.time}
    place = f"coordinate {figures['coordinate']:.6g}" if "coordinate" in figures else ""
    state = f"{place}, rate {figures['rate']:.6g}" if "rate" in figures else place
    match ended.code:
        case "simulate.range":
            what = f"{driver} reaches {readable(figures['coordinate'], unit)}, the end of its stated range, at {at}: "
            what += "the motion ends there"
            remedy = f"widen drivers.{driver}.range, or stop the motion before by a load or a brake"
            return Finding.warning("simulate.range", where, what, remedy, **figures)
        case "simulate.no_acceleration":
            what = f"there is no acceleration at {at} ({state}), as the mechanism locks itself under its inertia: the "
            what += f"effort that an acceleration takes (det ∂E/∂q̈) is {figures['growth']:.4g} of that without "
            what += "friction, and must be above 0"
            remedy = "lower the friction or the inertia behind the joints that lock; see `trunnion locking`"
            return Finding.error("simulate.no_acceleration", where, what, remedy, **figures)
        case "simulate.unsolved":
            what = f"the accelerations are not found at {at} ({state})"
            remedy = "check the forces there: one of them has no value, jumps, or grows without bound"
            return Finding.error("simulate.unsolved", where, what, remedy, **figures)
        case "simulate.dead_centre":
            what = f"{driver} reaches its dead centre, {figures['coordinate']:.6g} {unit}, at {at}: the links cannot "
            what += f"be assembled beyond it, and go on as {driver} reverses; the motion ends there"
            remedy = "drive a joint that has no dead centre there, or limit the motion by a stop or a load"
            return Finding.error("simulate.dead_centre", where, what, remedy, **figures)
        case "simulate.not_assembled":
            what = f"the links cannot be assembled beyond {at} ({place}): the motion ends there"
            remedy = "limit the motion by a stop or a load, or drive a joint that has no dead centre there"
            return Finding.error("simulate.not_assembled", where, what, remedy, **figures)
        case "simulate.step":
            what = f"the integration needs steps below rounding at {at} ({state})"
            remedy = "check the forces there: one of them jumps or grows without bound"
            return Finding.error("simulate.step", where, what, remedy, **figures)
        case "simulate.events":
            what = f"there are {figures['count']:.0f} events up to {at}: the motion is not followed farther"
            remedy = "ask for a shorter time"
            return Finding.error("simulate.events", where, what, remedy, **figures)
        case "simulate.change_point":
            what = f"at {at}, at {readable(figures['coordinate'], unit)} of {driver}, the links "
            what += f"{', '.join(figures['links'])} come to a change point, where two of their assembly modes "
            what += "coincide: neither reactions nor what follows are determined, and the motion ends there"
            remedy = f"change a length, or stop the motion before it by drivers.{driver}.range, a load or a brake"
            return Finding.error("simulate.change_point", where, what, remedy, **figures)
        case "simulate.evaluations":
            what = f"{figures['count']:,} evaluations of the forces are used up at {at} of "
            what += f"{readable(figures['of'], 's')}: the motion ends there"
            remedy = "check for a stiff spring, damper or contact on a small mass, ask for a shorter --time or more --evaluations"
            return Finding.error("simulate.evaluations", where, what, remedy, **figures)
        case _:
            what = f"there are no forces or impulses of the contacts that touch at {at} ({state}) under which nothing "
            what += "sinks in (Painlevé's paradox): the motion is kept until then"
            remedy = "lower the friction of the joints in play, or state a stiffness instead of law: rigid"
            return Finding.error("simulate.no_contact_force", where, what, remedy, **figures)


def _locks(motion: FreeMotion, solution: Solution) -> Iterator[Finding]:
    """What locks as it runs."""
    locks = [lock for lock in solution.events if lock.kind == "lock"]
    if not motion.resisted:
        for event in locks:
            what = f"the mechanism locks as it runs, at {readable(event.time, 's')}: it stops at once, and loses "
            what += f"{readable(event.figure, 'J')}"
            remedy = "see `trunnion locking` for where and by how much"
            figures = {"time": event.time, "energy": event.figure}
            yield Finding.warning("simulate.locks", f"drivers.{event.of}", what, remedy, **figures)
    elif locks:
        joints, energy = (
            list(dict.fromkeys(lock.of for lock in locks)),
            float(np.nansum([lock.figure for lock in locks])),
        )
        times = len({lock.time for lock in locks})
        what = f"{', '.join(joints)} {agreeing(len(joints), 'locks', 'lock')} as the mechanism runs, "
        what += f"{counted(times, 'time')}, first at {readable(locks[0].time, 's')}: "
        what += f"{agreeing(len(joints), 'it stops', 'they stop')} at once, {readable(energy, 'J')} is lost, and what "
        what += "is still free moves on"
        remedy = "see `trunnion locking` for where and by how much"
        figures = {"count": len(joints), "times": times, "time": locks[0].time, "energy": energy}
        yield Finding.warning("simulate.joints_lock", f"joints.{joints[0]}", what, remedy, joints=joints, **figures)


def _rests(motion: FreeMotion, solution: Solution, name: str, effort: str) -> Iterator[Finding]:
    """What holds it where it rests at the end."""
    rests = [event for event in solution.events if event.kind == "rest"]
    if not (rests and solution.stretches and solution.stretches[-1].resting):
        return
    last, stays = solution.stretches[-1], all(event.resting for event in solution.stretches)
    on = _on(motion, solution)
    figures: dict[str, Any] = {} if stays else {"time": rests[-1].time, **({} if on else {"times": len(rests)})}
    since, times = readable(rests[-1].time, "s"), counted(len(rests), "time")
    stronger = "use a stronger motor or a gear, lower the friction, or begin elsewhere"
    larger = "use a larger flywheel, a stronger motor or a gear, or lower the load there"
    if motion.resisted:
        at = solution.layout.moment(np.array([last.begin]), solution.at(np.array([last.begin]))[0], now=last.now)
        shares = np.abs(np.asarray(motion.accelerate(at._replace(onsets=last.onsets, senses=last.senses)).shares)[:, 0])
        worst = int(np.argmax(shares))
        joint, share = motion.resisted[worst], float(shares[worst])
        where, figures = f"joints.{joint}", {**figures, "joint": joint, "share": share}
        needs = f"needs {share:.2%} of what resists it at rest in {joint}, and no more in the other joints"
        if stays:
            what = f"nothing starts: what acts {needs}"
            yield Finding.warning("simulate.none_starts", where, what, stronger, **figures)
        elif on:
            what = (
                f"all free drivers rest from {since} on, with the motor of {', '.join(on)} on: what acts then {needs}"
            )
            yield Finding.error("simulate.all_stall", where, what, larger, **figures, drivers=on)
        else:
            what = f"all free drivers come to rest {times}, for the last time at {since}: what acts then {needs}"
            yield Finding.note("simulate.all_rest", where, what, **figures)
        return
    drive_given, needed = _holding(motion, solution, last)
    where, figures = (
        f"drivers.{name}",
        {**figures, "driver": name, "given": drive_given, "needed": needed, "unit": effort},
    )
    act, breaks = f"{readable(drive_given, effort)} act on it", f"it breaks away from {readable(needed, effort)} on"
    if stays:
        what = f"{name} does not start: {act}, and {breaks}"
        yield Finding.warning("simulate.stays_at_rest", where, what, stronger, **figures)
    elif on:
        place, turns = float(solution.at(np.array([last.begin]))[0][0, 0]), motion.system.turns(motion.names[0])
        place, unit = (place % (2 * np.pi), "rad") if turns else (place, "m")
        what = f"{name} stalls at {since}, at {readable(place, unit)}, with the motor on: {act} then, and {breaks}"
        yield Finding.error("simulate.stalls", where, what, larger, **figures, coordinate=place, place=unit)
    else:
        what = f"{name} comes to rest {times}, for the last time at {since}: {act} then, and {breaks}"
        yield Finding.note("simulate.rests", where, what, **figures)


def _on(motion: FreeMotion, solution: Solution) -> list[str]:
    """The free drivers whose motor still acts at the end, through its clutch if it has one, and is not braked."""
    last, time = solution.stretches[-1], np.array([solution.end])
    at = solution.layout.moment(time, solution.at(time)[0], now=last.now)
    findings = []
    for i, (name, drive) in enumerate(motion.drives.items()):
        effort = drive.seen(last.now, last.slips).shaft(time, at.rate[i], at.integral[i], last.now)
        if np.any(effort != 0.0) and not drive.braking(last.now):
            findings.append(name)
    return findings


def _of_contacts(motion: FreeMotion, run: Run, impacts: Sequence[Impact]) -> Iterator[Finding]:
    """What the laws of the contacts return, where that is not what was stated; how deep soft surfaces sink in; what is
    lost in contacts that begin so slowly that their law is not followed."""
    for contact in motion.contacts.each:
        of_contact = [impact for impact in impacts if impact.label == contact.label]
        slow = [impact for impact in of_contact if impact.approach < SLOWEST]
        lost, total = (sum(impact.loss for impact in group) for group in (slow, of_contact))
        if len(slow) > FEW and lost > DIFFERS * total:
            what = f"{contact.label}: {len(slow):.0f} of {len(of_contact):.0f} contacts begin slower than "
            what += f"{readable(SLOWEST, 'm/s')} and are treated as beginning at that speed; {lost / total:.2%} of "
            what += "what the contact law loses is lost in them"
            remedy = "compare with another restitution: the law is one of impacts, and tells little of slow pressing"
            figures = {
                "contact": contact.label,
                "count": len(slow),
                "of": len(of_contact),
                "slowest": SLOWEST,
                "share": lost / total,
            }
            yield Finding.note("simulate.slow_onsets", f"joints.{contact.joint}.contact", what, remedy, **figures)
        depth = max((impact.depth for impact in impacts if impact.label == contact.label), default=0.0)
        if depth > contact.clearance:
            what = (
                f"{contact.label}: the surfaces sink {readable(depth, 'm')} into each other, more than the clearance "
            )
            what += f"of {readable(contact.clearance, 'm')}"
            remedy = "check the stiffness of the contact; a contact law holds for small penetrations"
            figures = {"contact": contact.label, "depth": depth, "clearance": contact.clearance}
            yield Finding.warning("simulate.soft", f"joints.{contact.joint}.contact", what, remedy, **figures)
    for contact in {contact.joint: contact for contact in motion.contacts.each}.values():
        law = run.system.mechanism.effective_joints[contact.joint].contact
        returned = restitution_of(contact.factor)
        if law is not None and not law.of.rigid and abs(returned - contact.restitution) > DIFFERS:
            what = f"{contact.joint}: with a stated restitution of {contact.restitution:.3g} the contact law {law.law} "
            what += f"returns {returned:.3g}"
            remedy = "state law: restitution to get back what is stated"
            figures = {"joint": contact.joint, "law": law.law, "stated": contact.restitution, "returned": returned}
            yield Finding.note("simulate.restitution", f"joints.{contact.joint}.contact", what, remedy, **figures)


def _holding(motion: FreeMotion, solution: Solution, stretch: Stretch) -> tuple[float, float]:
    """Effort that acts as a rest begins, and the break-away effort: the way it acts, or the nearer one."""
    time = stretch.begin
    rows, _ = solution.at(np.array([time]))
    rest = Rest(motion, solution.layout, stretch.slips)
    at = solution.layout.moment(np.array([time]), rows, 1.0, time, stretch.slips)
    drive_given = float(motion.given(at._replace(sense=0.0), np.zeros_like(at.q))[0, 0])
    forward, backward = (float(efforts[0]) for efforts in rest.beyond(np.array([time]), rows[:, 0], time, time))
    ahead = drive_given > 0 or (drive_given == 0 and forward >= backward)
    return drive_given, drive_given - forward if ahead else drive_given + backward


# ---- summary --------------------------------------------------------------------------------------------------


def _summary(motion: FreeMotion, integrated: Found, run: Run, scales: Scales) -> Sequence[Figure]:
    """The figures that one looks at first; none of a motion that does not begin."""
    figures: list[Figure] = []
    solution, course, impacts, names = (
        integrated.solution,
        integrated.course,
        integrated.impacts,
        list(run.system.mechanism.drivers),
    )
    if course is None:
        return figures
    for i, name in enumerate(_shown(motion, run)):
        turns, effort = motion.system.turns(name), effort_units(motion.system)[names.index(name)]
        unit, speed = "rad/s" if turns else "m/s", f"speed of {name}"
        figures.append(_largest(f"{name}.speed_max", speed, unit, *course.rate(i)))
        last = float(course.last.at.rate[i, 0])
        figures.append(Figure(f"{name}.speed_end", speed, last, unit, "at the end", _at(solution.end)))
        peak, noun = course.effort(names.index(name)), "drive torque" if turns else "drive force"
        # of others it is rounding; where nothing has inertia at a dead centre there is none
        if motion.system.mechanism.drivers[name].motor is not None and np.isfinite(peak[0]):
            figures.append(_largest(f"{name}.effort_max", f"{noun} of {name}", effort, *peak))
        figures += steady_figures(motion, solution, i)
    ended = solution.ended is not None and solution.ended.code == "simulate.change_point"
    if not ended and not any(event.kind == "change-point" for event in solution.events):  # there they have no bound
        for i, joint in enumerate(run.system.joints):
            if (peak := course.reaction(i))[0] > 0:
                figures.append(_largest(f"{joint}.reaction_max", f"reaction in {joint}", "N", *peak))
    figures += impact_figures(motion.contacts.labels, impacts, solution.end)
    for key, work in _works(solution, course.last.works).items():
        if abs(work[0]) > scales.floor("J"):
            figures.append(Figure(f"work_{key}", WORDS[key], float(work[0]), "J"))
    figures.append(Figure("energy_residual", "largest error of the energy account", course.worst, "J"))
    return figures


def _largest(name: str, subject: str, unit: str, value: float, time: float) -> Figure:
    """What is farthest from 0, with its time, s."""
    return Figure(name, subject, value, unit, "largest", _at(time))


def _at(time: float) -> str:
    return f"at {time:.4g} s"
