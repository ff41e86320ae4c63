"""The books of a motion in time: variables, energy, events, summary and findings, gathered into the result."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.cycle.findings import effort_units
from trunnion.cycle.scales import largest
from trunnion.cycle.scene import scene_of
from trunnion.cycle.summary import inputs, member_units, references
from trunnion.dynamics.filling import (
    CONTACT,
    FEWEST,
    FREQUENCY,
    IMPACT,
    SPECTRUM,
    Books,
    impact_arrays,
    impact_figures,
    spectrum,
)
from trunnion.dynamics.findings import motion_findings, stated_drivers, undefined
from trunnion.dynamics.motor import switched
from trunnion.dynamics.rates import CLUTCH, WORKS
from trunnion.dynamics.rates import CONTACT as IN_CONTACTS
from trunnion.dynamics.solution import Event, Solution
from trunnion.dynamics.started import steady_figures
from trunnion.dynamics.state import FreeMotion
from trunnion.errors import Finding
from trunnion.results import variables as results
from trunnion.results.attributes import cited, encoded, finding_rows, origin
from trunnion.results.dataset import Variable, dataset_of, described
from trunnion.results.figure import Figure
from trunnion.results.result import Result
from trunnion.results.scales import Scales
from trunnion.solve.run import Run

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["MOTION", "Found", "result_of"]

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

    def reaction(self, i: int) -> tuple[float, float]:
        """The largest size of the reaction of a joint, N, and its time, s."""
        axes = self.counts[2][1]
        first = sum(self.counts[:2]) + i * axes
        return self._top(lambda rows: np.sqrt(np.sum(rows[first : first + axes] ** 2, axis=0)))

    def farthest(self, row: int) -> tuple[float, float]:
        """What is farthest from 0 of a rate of a free coordinate or, after those, an effort of a driver, and its time,
        s; NaN where it has none."""
        most, least = self._top(lambda rows: rows[row]), self._top(lambda rows: -rows[row])
        return (-least[0], least[1]) if least[0] > most[0] else most

    def _top(self, of: Callable[[Array], Array]) -> tuple[float, float]:
        place = self.courses.extreme(of)
        if place is None:
            return np.nan, np.nan
        return place.value, float(self.courses.edges[0]) if place.everywhere else place.time


class Found(NamedTuple):
    """A motion with its books at its rows, and its course, None if it does not begin."""

    solution: Solution
    books: Books
    course: Course | None

    @classmethod
    def of(cls, run: Run, solution: Solution, time: Array, between: Callable[[Array], Books]) -> Found:
        """time: s, of the rows, up to the end; between: the books at some rising times, s."""
        if solution.ended is not None:
            time = np.append(time[time < solution.end], solution.end)
        return cls(solution, between(time), Course.of(run, solution, between))

    @property
    def share(self) -> float:
        """What works and energies differ by at most, of the energy turned over; 0 where it is rounding."""
        if self.course is None or not self.course.worst > ROUNDING * self.course.stored:
            return 0.0
        return self.course.worst / self.course.turned_over if self.course.turned_over > 0 else 0.0


def result_of(motion: FreeMotion, integrated: Found, duration: float, run: Run) -> Result:
    """The result of a motion in time. run: of the mechanism as it was stated, its joints in play included."""
    solution, books, contacts = integrated.solution, integrated.books, motion.contacts.each
    mechanism, system = run.system.mechanism, run.system
    for time, kind, of, effort in switched(motion.drives, solution.end):
        unit = "" if np.isnan(effort) else "N m" if motion.system.turns(of) else "N"
        solution.events.append(Event(time, kind, of, effort, unit))
    solution.events.sort(key=lambda event: event.time)
    scales = integrated.course.scales if integrated.course else largest(run, books.arrays)
    findings = [*motion_findings(motion, solution, run), *undefined(books.time, books.arrays["status"])]
    if integrated.share > WORST:
        what = f"works and energies differ by {integrated.share:.2g} of the energy turned over"
        remedy = "ask for a smaller --tolerance"
        findings.append(Finding.warning("simulate.energy", "", what, remedy, share=integrated.share))
    labelled = {
        "impacts": [impact.label for impact in solution.impacts],
        "contact_pins": [contact.label for contact in contacts if contact.bored],
    }
    attributes = encoded({
        **origin(mechanism, system.plan.formula, mobility=system.plan.mobility),
        **cited(references(mechanism)),
        "free_drivers": stated_drivers(motion, run),
        "duration": duration,
        "findings": finding_rows(findings),
        **(labelled if contacts else {}),
        **scales.summary(_summary(motion, integrated, run, scales)),
        "inputs": inputs(mechanism),
        "scene": scene_of(run),
        "events": [[event.kind, event.of, event.figure if np.isfinite(event.figure) else None, event.unit]
                   for event in solution.events],
    })  # fmt: skip

    def build() -> xr.Dataset:
        variables = {name: variable.over("time") for name, variable in results.variables(mechanism.space).items()}
        units, labels = member_units(system), dict(books.labels)
        parts = described(books.arrays, variables, units)
        parts |= described(_beside(motion, run, solution, books), MOTION, units)
        along, coordinates = {"time": Variable(("time",), "s", "time from the start")}, {"time": books.time}
        if contacts:
            labels["contact"] = list(motion.contacts.labels)
            parts |= described(books.touches.arrays(books.works[-1]), CONTACT)
            parts |= described(impact_arrays(solution.impacts), IMPACT)
            rows = np.flatnonzero(np.all(np.isfinite(books.touches.normal), axis=0))
            rows = rows if solution.ended is None else rows[:-1]  # the end is not evenly spaced
            rigid = any(contact.rigid for contact in contacts)  # their impacts have no force
            if len(rows) >= FEWEST and not rigid:
                along["frequency"] = FREQUENCY
                coordinates["frequency"], amplitude = spectrum(books.time[rows], books.touches.normal[:, rows])
                parts |= described({"contact_force_amplitude": amplitude}, SPECTRUM)
        return dataset_of("motion", parts, labels, attributes, described(coordinates, along))

    return Result(attributes, build)


def _beside(motion: FreeMotion, run: Run, solution: Solution, books: Books) -> dict[str, Any]:
    """What there is beside the variables of a cycle."""
    names = list(run.system.mechanism.drivers)
    coordinates, rates, rotors = np.full((3, len(names), len(books.time)), np.nan)
    for row, name in enumerate(names):
        if name in motion.names:
            i, drive = motion.names.index(name), motion.drives[name]
            coordinates[row], rates[row] = books.at.q[i], books.at.rate[i]
            if drive.clutched:
                rotors[row] = books.at.slip[0] + drive.ratio * books.at.rate[i]
        else:
            over = ~np.isfinite(books.works[0])  # there is no motion any more
            moved = run.system.drive(motion.values, name, books.time)[:2]
            coordinates[row], rates[row] = (np.where(over, np.nan, part) for part in moved)
    works = zip(solution.layout.works_named, books.works, strict=True)
    return {
        "drive_coordinate": coordinates,
        "drive_rate": rates,
        **{f"work_{name}": work for name, work in works if name != IN_CONTACTS},
        **({"rotor_speed": rotors} if len(books.at.slip) else {}),
        "kinetic_energy": books.energies[0],
        "potential_energy": books.energies[1],
        "energy_residual": _residual(books.works, books.energies),
        "resting": books.resting,
        **({} if books.sticking is None else {"sticking": books.sticking}),
        "event_time": np.array([event.time for event in solution.events], float),
    }


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
ROUNDING = 1e-12  # of the energy turned over: a work that is none
WORST = 1e-6  # of the energy turned over: a difference that is worth a warning


# ---- summary --------------------------------------------------------------------------------------------------


def _summary(motion: FreeMotion, integrated: Found, run: Run, scales: Scales) -> Sequence[Figure]:
    """The figures that one looks at first; none of a motion that does not begin."""
    figures: list[Figure] = []
    solution, course, names = integrated.solution, integrated.course, list(run.system.mechanism.drivers)
    if course is None:
        return figures
    for i, name in enumerate(stated_drivers(motion, run)):
        turns, effort = motion.system.turns(name), effort_units(motion.system)[names.index(name)]
        unit, speed = "rad/s" if turns else "m/s", f"speed of {name}"
        value, time = course.farthest(i)
        figures.append(Figure(f"{name}.speed_max", speed, value, unit, "largest", f"at {time:.4g} s"))
        last, end = float(course.last.at.rate[i, 0]), f"at {solution.end:.4g} s"
        figures.append(Figure(f"{name}.speed_end", speed, last, unit, "at the end", end))
        value, time = course.farthest(course.counts[0] + names.index(name))
        # of others it is rounding; where nothing has inertia at a dead centre there is none
        if motion.system.mechanism.drivers[name].motor is not None and np.isfinite(value):
            subject, when = f"drive {'torque' if turns else 'force'} of {name}", f"at {time:.4g} s"
            figures.append(Figure(f"{name}.effort_max", subject, value, effort, "largest", when))
        figures += steady_figures(motion, solution, i)
    ended = solution.ended is not None and solution.ended.code == "simulate.change_point"
    if not ended and not any(event.kind == "change-point" for event in solution.events):  # there they have no bound
        for i, joint in enumerate(run.system.joints):
            value, time = course.reaction(i)
            if value > 0:
                subject, when = f"reaction in {joint}", f"at {time:.4g} s"
                figures.append(Figure(f"{joint}.reaction_max", subject, value, "N", "largest", when))
    figures += impact_figures(motion.contacts.labels, solution.impacts, solution.end)
    for key, work in zip(solution.layout.works_named, course.last.works, strict=True):
        if abs(work[0]) > scales.floor("J"):
            figures.append(Figure(f"work_{key}", WORDS[key], float(work[0]), "J"))
    figures.append(Figure("energy_residual", "largest error of the energy account", course.worst, "J"))
    return figures
