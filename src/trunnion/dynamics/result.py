"""The result of a motion in time: variables at its rows as `analyse` has them, energy, events, summary and findings.

A motion with joints in play is shown as one of the mechanism that was stated: with these joints, and without what
stands in for them; beside it stands what contacts and impacts come to.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal import periodogram

from trunnion.algebra.course import Accuracy, Courses
from trunnion.algebra.space import moment_at
from trunnion.algebra.vector import dot
from trunnion.cycle import fill
from trunnion.cycle.findings import effort_units
from trunnion.cycle.scales import largest
from trunnion.cycle.scene import scene_of
from trunnion.cycle.summary import inputs, member_units, provenance
from trunnion.dynamics.findings import motion_findings, stated_drivers, undefined
from trunnion.dynamics.measured import steady_figures
from trunnion.dynamics.motor import switched
from trunnion.dynamics.opened import Opened, in_play
from trunnion.dynamics.rates import CONTACT as IN_CONTACTS
from trunnion.dynamics.rates import kinetic_energy, potential_energy
from trunnion.dynamics.solution import Event, Impact, Solution, Stretch
from trunnion.dynamics.state import FreeMotion, Moment
from trunnion.dynamics.touching import Contact, ContactState, Push, pushes_of
from trunnion.errors import Finding, Status
from trunnion.results import variables as results
from trunnion.results.attributes import Figure, encoded
from trunnion.results.dataset import Result, Scales, Variable, dataset_of, described
from trunnion.solve.backward import Backward
from trunnion.solve.contacts import bearing_middle
from trunnion.solve.forward import Forward, SpatialWalk
from trunnion.solve.run import CHUNK, Run

if TYPE_CHECKING:
    import xarray as xr

Array = NDArray[np.float64]
Touched = Sequence[tuple[ContactState, Push]]

# what there is beside the variables of a cycle
MOTION: dict[str, Variable] = {
    "drive_coordinate": Variable(("driver", "time"), "coordinate", "coordinate of the driver, whole turns included"),
    "drive_rate": Variable(("driver", "time"), "rate", "rate of the driver's coordinate"),
    "work_drive": Variable(("time",), "J", "work of the drivers since the start"),
    "work_loads": Variable(("time",), "J", "work of the loads since the start, positive into the mechanism"),
    "work_springs": Variable(("time",), "J", "work of the springs since the start, likewise, and of dampers"),
    "work_friction": Variable(("time",), "J", "work lost to friction since the start"),
    "work_clutch": Variable(("time",), "J", "work lost in the clutch since the start"),
    "rotor_speed": Variable(("driver", "time"), "rate", "speed of the motor's rotor behind its clutch"),
    "kinetic_energy": Variable(("time",), "J", "kinetic energy of the links"),
    "potential_energy": Variable(("time",), "J", "potential energy of the links in the field of gravity"),
    "energy_residual": Variable(("time",), "J", "works less changes of energy; 0 but for the errors of integration"),
    "resting": Variable(("time",), "1", "1 while the mechanism rests in friction", np.int8),
    "sticking": Variable(("joint", "time"), "1", "1 while the joint sticks; with several free coordinates", np.int8),
    "event_time": Variable(("event",), "s", "time of the event"),
}

CONTACT: dict[str, Variable] = {
    "contact_gap": Variable(("contact", "time"), "m", "gap of the contact, negative where it touches"),
    "contact_normal_force": Variable(("contact", "time"), "N", "normal force of the contact"),
    "contact_friction_force": Variable(("contact", "time"), "N", "friction force of the contact, against its slip"),
    "contact_slip": Variable(("contact", "time"), "m/s", "slip of the surfaces"),
    "contact_touching": Variable(("contact", "time"), "1", "1 while the contact touches", np.int8),
    "contact_offset": Variable(
        ("contact", "axis", "time"), "m", "offset of the pin in its hole, of a corner in its guide; in the hole's axes"
    ),
    "contact_energy": Variable(("time",), "J", "elastic energy in the contacts"),
    "work_contact": Variable(("time",), "J", "work lost in contacts since the start, friction in them included"),
}
IMPACT: dict[str, Variable] = {
    "impact_begin": Variable(("impact",), "s", "time at which a contact begins"),
    "impact_end": Variable(("impact",), "s", "time at which it ends"),
    "impact_approach": Variable(("impact",), "m/s", "speed of approach where it begins"),
    "impact_separation": Variable(("impact",), "m/s", "speed of separation where it ends"),
    "impact_force": Variable(("impact",), "N", "largest normal force"),
    "impact_depth": Variable(("impact",), "m", "largest penetration"),
    "impact_impulse": Variable(("impact",), "N s", "impulse of the normal force"),
    "impact_wear": Variable(("impact",), "J", "wear index, integral of normal force times slip"),
}
FREQUENCY = Variable(("frequency",), "Hz", "frequency")
SPECTRUM = Variable(("contact", "frequency"), "N", "amplitude of the normal force by frequency, with Hann's window")
FEWEST = 16  # rows from which there is a spectrum

PORTION = 10_000  # times whose books are read at once: these are many numbers
BLURRED = 1e3  # condition from which the velocities of links in line, and so energies, are not told to all digits
SHORTEST = 1e-12  # of the duration: a step that has no course of its own
# of what an integration knows; a step is one panel, but where a force bends or jumps within it
ACCURACY = Accuracy(tolerance=1e-6, widest=1.0, rounds=10, most=16)
ROUNDING = 1e-12  # of the energy turned over: a work that is none
WORST = 1e-6  # of the energy turned over: a difference that is worth a warning


# ---- variables at rows ------------------------------------------------------------------------------------------


class Books(NamedTuple):
    """What is known at the rows of a result: variables as `analyse` has them, state, accelerations of the free
    coordinates, energies (kinetic, potential, of contacts), works, where the mechanism rests, what `CONTACT` has, and
    which joints stick, (joint, time)."""

    time: Array
    arrays: Mapping[str, Array]
    labels: dict[str, list[str]]
    at: Moment
    seconds: Array
    energies: Array
    works: Array
    resting: NDArray[np.bool_]
    contacts: dict[str, Array]
    sticking: NDArray[np.bool_] | None = None


def filled(motion: FreeMotion, solution: Solution, time: Array, opened: Opened | None = None) -> Books:
    """Every variable over rows up to where a motion ends, by walks, as `analyse` has them; NaN after it.

    time: s, of the rows, rising; opened: where joints in play were taken out, so that the rows are of those stated.
    """
    stated, layout = None if opened is None else Stated(opened, motion.contacts), solution.layout
    system = (motion.run if stated is None else stated.run).system
    arrays, (rows, which) = fill.allocate(system, len(time)), solution.at(time)
    seconds, energies = np.full((layout.coordinates, len(time)), np.nan), np.full((2, len(time)), np.nan)
    sizes = {"contact": len(motion.contacts), "axis": len(system.axes), "time": len(time)}
    contacts = {
        name: np.zeros([sizes[dim] for dim in variable.dims]) * (1 if variable.dtype is np.int8 else np.nan)
        for name, variable in CONTACT.items()
    }
    sticking, resting = np.zeros((len(system.joints), len(time)), bool), np.zeros(len(time), bool)
    arrays["status"][...] = Status.NOT_CONVERGED
    for lanes, stretch in _alike(solution, which):
        motion.begin(stretch.snapshot)
        at = layout.moment(time[lanes], rows[:, lanes], stretch.mode)
        accelerated = motion.accelerate(at)
        seconds[:, lanes], back = accelerated.second, accelerated.back
        energies[0, lanes], energies[1, lanes] = kinetic_energy(back.walk), potential_energy(back.walk)
        touched = pushes_of(motion.contacts, back.walk, accelerated.onsets)
        for k, ((state, push), onset) in enumerate(zip(touched, accelerated.onsets, strict=True)):
            numbers = state.gap, push.normal, push.friction, state.slip, float(onset is not None)
            for name, number in zip(CONTACT, numbers, strict=False):
                contacts[name][k, lanes] = number
            for axis in range(len(system.axes)):
                contacts["contact_offset"][k, axis, lanes] = state.offset[axis]
        contacts["contact_energy"][lanes] = sum(push.stored for _, push in touched)
        stated_back = back if stated is None else stated.back(back, touched)
        window = slice(int(lanes[0]), int(lanes[-1]) + 1)
        fill.fill_chunk(arrays, stated_back, window)
        if stated is not None:
            stated.fill(arrays, stated_back.walk, touched, window)
        resting[lanes] = stretch.resting
        for name, sense in zip(motion.resisted, stretch.mode.senses, strict=False):
            sticking[list(system.joints).index(name), lanes] = sense == 0
    for array in arrays.values():  # there is no motion any more
        if array.dtype == np.float64:
            array[..., which < 0] = np.nan
    moments, works = layout.moment(time, rows), layout.works(rows)
    fill.unwrap(arrays, system, motion.values_at(moments, np.nan_to_num(seconds)), time)
    if stated is not None:
        energies, contacts["work_contact"] = np.vstack([energies, contacts["contact_energy"]]), works[-1]
    by_joint = sticking if motion.resisted and motion.several else None
    return Books(time, arrays, fill.labels(system), moments, seconds, energies, works, resting, contacts, by_joint)


def _alike(solution: Solution, which: NDArray[np.intp]) -> Iterator[tuple[NDArray[np.intp], Stretch]]:
    """Runs of rows that one walk can solve: of the same sense, switches and assembly. which: stretch of every row."""

    def key(row: Any) -> object:
        stretch = solution.stretches[which[row]]
        return stretch.mode, stretch.resting, id(stretch.snapshot)

    for _, rows in itertools.groupby(np.flatnonzero(which >= 0), key):
        lanes = np.array(list(rows))
        for part in np.split(lanes, range(CHUNK, len(lanes), CHUNK)):
            yield part, solution.stretches[which[part[0]]]


class Stated:
    """A motion whose joints in play were taken out, as one of the mechanism that was stated."""

    def __init__(self, opened: Opened, contacts: Sequence[Contact]) -> None:
        self.run, self.parts, self.contacts = opened.run, opened.parts, contacts
        self.cut = in_play(self.run.system.mechanism)
        local, holes = self.run.system.elements(self.run.values), self.run.system.holes(self.run.values)
        self.local = {**local, **{key: hole for key, hole in holes.items() if key[1] in self.cut}}

    def back(self, back: Backward, touched: Touched) -> Backward:
        """What a walk of the opened mechanism came to, with the stated joints: those in play have the forces of their
        contacts, those that chains stand in for the reaction of the last part."""
        system, opened = replace(self.run.system), back.walk.system
        vars(system)["groups"] = opened.groups
        values, local = {**self.run.values, **back.walk.values}, {**self.local, **back.walk.local}
        motions = {link: back.walk.motions[link] for link in system.mechanism.effective_links}
        walk = type(back.walk)(system, values, local, motions, back.walk.time, poses=back.walk.poses)
        zero, joints = walk.algebra.ZERO_LOAD, [*self.cut, *self.parts]
        reactions, rubbing = dict(back.reactions), {**back.friction_wrenches, **dict.fromkeys(joints, zero)}
        friction: dict[str, Any] = {**back.friction, **dict.fromkeys(joints, 0.0)}
        for joint in joints:
            reaction = back.reactions[self.parts[joint][-1]] if joint in self.parts else zero
            second = system.joints[joint].links[1]
            for contact, (state, push) in zip(self.contacts, touched, strict=True):
                if contact.joint == joint:
                    along = push._replace(normal=0.0 * push.normal)
                    reaction = walk.algebra.added(reaction, dict(contact.action(back.walk, state, push).on)[second])
                    loss = dict(contact.action(back.walk, state, along).on)[second]
                    rubbing[joint] = walk.algebra.added(rubbing[joint], loss)
            if isinstance(walk, SpatialWalk):
                friction[joint] = dot(moment_at(rubbing[joint], bearing_middle(walk, joint)), walk.ends(joint)[1].z)
            elif system.turns(joint):
                friction[joint] = walk.algebra.moment_at(reaction, walk.point(second, joint).place)
            reactions[joint] = reaction
        return replace(
            back, walk=walk, reactions=reactions, friction=friction, friction_wrenches=rubbing, margin=None,
            losses={**dict.fromkeys(joints, 0.0), **back.losses},
            resting={**dict.fromkeys(joints, np.False_), **back.resting},
        )  # fmt: skip

    def fill(self, arrays: Mapping[str, Array], walk: Forward, touched: Touched, window: slice) -> None:
        """What joints in play have beside what any joint has: the power lost in their contacts, and in the plane how
        they slide and turn."""
        for joint in self.cut:
            row = list(self.run.system.joints).index(joint)
            arrays["friction_power"][row, window] = -sum(
                push.friction * state.slip
                for contact, (state, push) in zip(self.contacts, touched, strict=True)
                if contact.joint == joint
            )
            if isinstance(walk, SpatialWalk):
                continue
            first, second = (walk.motions[link] for link in walk.system.joints[joint].links)
            arrays["joint_rotation_velocity"][row, window] = second.twist.w - first.twist.w
            arrays["joint_rotation_acceleration"][row, window] = second.acceleration.w - first.acceleration.w
            motion = walk.coordinates(joint), walk.rates(joint), walk.second_rates(joint)
            for suffix, numbers in zip(("", "_velocity", "_acceleration"), motion, strict=True):
                arrays[f"joint_slide{suffix}"][row, window] = numbers[1]


# ---- courses between rows ---------------------------------------------------------------------------------------


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


class Integrated(NamedTuple):
    """A motion with its books at its rows, and its course, None if it does not begin."""

    solution: Solution
    books: Books
    course: Course | None

    @classmethod
    def of(cls, run: Run, solution: Solution, time: Array, between: Callable[[Array], Books]) -> Integrated:
        """time: s, of the rows, up to the end; between: the books at some rising times, s."""
        if solution.ended is not None:
            time = np.append(time[time < solution.end], solution.end)
        return cls(solution, between(time), Course.of(run, solution, between))

    @property
    def exhausted(self) -> bool:
        """Whether it ended because its evaluations were used up."""
        return self.solution.ended is not None and self.solution.ended.code == "simulate.evaluations"

    @property
    def share(self) -> float:
        """What works and energies differ by at most, of the energy turned over; 0 where it is rounding."""
        if self.course is None or not self.course.worst > ROUNDING * self.course.stored:
            return 0.0
        return self.course.worst / self.course.turned_over if self.course.turned_over > 0 else 0.0


def _residual(works: Array, energies: Array) -> Array:
    """What works and energies differ by at every time, J."""
    # to friction, and to contacts; from the first time on, which is that after a stop at the start
    drive, loads, springs, *lost = works - works[:, :1]
    energy = energies.sum(axis=0)
    return np.asarray(drive + loads + springs - sum(lost) - (energy - energy[0]))


# ---- the result -------------------------------------------------------------------------------------------------


def result_of(motion: FreeMotion, integrated: Integrated, duration: float, run: Run) -> Result:
    """The result of a motion in time. run: of the mechanism as it was stated, its joints in play included."""
    solution, books, contacts = integrated.solution, integrated.books, motion.contacts
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
        **provenance(system, findings, mobility=system.plan.mobility),
        "free_drivers": stated_drivers(motion, run),
        "duration": duration,
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
            labels["contact"] = [contact.label for contact in motion.contacts]
            parts |= described(books.contacts, CONTACT)
            impacts = {name: [getattr(impact, name.removeprefix("impact_")) for impact in solution.impacts]
                       for name in IMPACT}  # fmt: skip
            parts |= described({name: np.array(row, float) for name, row in impacts.items()}, IMPACT)
            forces = books.contacts["contact_normal_force"]
            rows = np.flatnonzero(np.all(np.isfinite(forces), axis=0))
            rows = rows if solution.ended is None else rows[:-1]  # the end is not evenly spaced
            rigid = any(contact.rigid for contact in contacts)  # their impacts have no force
            if len(rows) >= FEWEST and not rigid:
                along["frequency"] = FREQUENCY
                coordinates["frequency"], amplitude = spectrum(books.time[rows], forces[:, rows])
                parts |= described({"contact_force_amplitude": amplitude}, {"contact_force_amplitude": SPECTRUM})
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


def spectrum(time: Array, forces: Array) -> tuple[Array, Array]:
    """Frequencies, Hz, and one-sided amplitudes, N, (…, frequency), of forces (…, time) at equally spaced times, s.

    A harmonic of amplitude A that lies on a frequency has A there and, by Hann's window, A/2 at its two neighbours.
    Source: F. J. Harris, On the use of windows for harmonic analysis with the discrete Fourier transform, Proc. IEEE 66
    (1978) 51-83, doi:10.1109/PROC.1978.10837.
    """
    rate = (len(time) - 1) / (time[-1] - time[0])
    frequencies, powers = periodogram(forces, rate, "hann", detrend=False, scaling="spectrum")
    powers[..., 1 : -1 if len(time) % 2 == 0 else None] *= 2.0  # of a harmonic A²/2, of a mean its square
    return frequencies, np.sqrt(powers)


# ---- summary --------------------------------------------------------------------------------------------------


def _summary(motion: FreeMotion, integrated: Integrated, run: Run, scales: Scales) -> Iterator[Figure]:
    """The figures that one looks at first; none of a motion that does not begin."""
    solution, course, names = integrated.solution, integrated.course, list(run.system.mechanism.drivers)
    if course is None:
        return
    for i, name in enumerate(stated_drivers(motion, run)):
        turns, effort = motion.system.turns(name), effort_units(motion.system)[names.index(name)]
        unit, speed = "rad/s" if turns else "m/s", f"speed of {name}"
        value, time = course.farthest(i)
        yield Figure(f"{name}.speed_max", speed, value, unit, "largest", f"at {time:.4g} s")
        last, end = float(course.last.at.rate[i, 0]), f"at {solution.end:.4g} s"
        yield Figure(f"{name}.speed_end", speed, last, unit, "at the end", end)
        value, time = course.farthest(course.counts[0] + names.index(name))
        # of others it is rounding; where nothing has inertia at a dead centre there is none
        if motion.system.mechanism.drivers[name].motor is not None and np.isfinite(value):
            subject = f"drive {'torque' if turns else 'force'} of {name}"
            yield Figure(f"{name}.effort_max", subject, value, effort, "largest", f"at {time:.4g} s")
        yield from steady_figures(motion, solution, i)
    ended = solution.ended is not None and solution.ended.code == "simulate.change_point"
    if not ended and not any(event.kind == "change-point" for event in solution.events):  # there they have no bound
        for i, joint in enumerate(run.system.joints):
            value, time = course.reaction(i)
            if value > 0:
                name, when = f"{joint}.reaction_max", f"at {time:.4g} s"
                yield Figure(name, f"reaction in {joint}", value, "N", "largest", when)
    for contact in motion.contacts:
        of_contact = [impact for impact in solution.impacts if impact.label == contact.label]
        yield from _impact_figures(contact.label, of_contact, solution.end)
    for key, work in zip(solution.layout.works_named, course.last.works, strict=True):
        if abs(work[0]) > scales.floor("J"):
            subject, _, _ = (MOTION | CONTACT)[f"work_{key}"].long_name.partition(" since")
            yield Figure(f"work_{key}", subject, float(work[0]), "J")
    yield Figure("energy_residual", "largest error of the energy account", course.worst, "J")


def _impact_figures(label: str, impacts: Sequence[Impact], end: float) -> Iterator[Figure]:
    """What a summary says of a contact: how often and how hard it touches, for how long, and how much it wears."""
    yield Figure(f"{label}.impacts", f"contacts of {label}", len(impacts))
    if not impacts:
        return
    long = sum((impact.end if np.isfinite(impact.end) else end) - impact.begin for impact in impacts)
    if struck := [impact for impact in impacts if np.isnan(impact.force)]:  # of rigid bodies: without a force
        hardest = max(struck, key=lambda impact: impact.impulse)
        when = f"at {hardest.begin:.4g} s"
        yield Figure(f"{label}.impulse_max", f"impulse in {label}", hardest.impulse, "N s", "largest", when)
    if pushed := [impact for impact in impacts if np.isfinite(impact.force)]:
        most = max(pushed, key=lambda impact: impact.force)
        when = f"in the contact from {most.begin:.4g} s"
        yield Figure(f"{label}.contact_force_max", f"contact force in {label}", most.force, "N", "largest", when)
    if (depth := max(impact.depth for impact in impacts)) > 0:
        yield Figure(f"{label}.contact_depth_max", f"penetration in {label}", depth, "m", "largest")
    speed, wear = max(impact.approach for impact in impacts), sum(impact.wear for impact in impacts)
    yield Figure(f"{label}.approach_max", f"speed of approach in {label}", speed, "m/s", "largest")
    yield Figure(f"{label}.contact_time", f"time in contact of {label}", long / end if end else np.nan, aspect="of all")
    yield Figure(f"{label}.wear", f"wear index of {label}", wear, "J")
