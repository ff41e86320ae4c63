"""The variables of a motion in time at the times of its rows, by walks, as `analyse` has them.

A motion with joints in play is shown as one of the mechanism that was stated: with these joints, and without what
stands in for them; beside it stands what contacts and impacts come to.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.signal.windows import hann

from trunnion.algebra.plane import Wrench
from trunnion.algebra.space import moment_at
from trunnion.algebra.vector import dot
from trunnion.cycle import fill
from trunnion.cycle.fill import fill_chunk
from trunnion.dynamics.opened import Opened, in_play
from trunnion.dynamics.rates import kinetic_energy, potential_energy
from trunnion.dynamics.solution import Impact, Solution, Stretch
from trunnion.dynamics.state import FreeMotion, Moment
from trunnion.dynamics.touching import Contacts, ContactState, Push
from trunnion.errors import Status
from trunnion.results.dataset import Variable
from trunnion.results.figure import Figure
from trunnion.solve.backward import Backward
from trunnion.solve.contacts import bearing_middle
from trunnion.solve.forward import Forward, SpatialWalk
from trunnion.solve.memory import CHUNK

__all__ = [
    "CONTACT", "FEWEST", "FREQUENCY", "IMPACT", "SPECTRUM", "Books", "Stated", "Touches", "filled", "impact_arrays",
    "impact_figures", "spectrum",
]  # fmt: skip

Array = NDArray[np.float64]


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
    touches: Touches
    sticking: NDArray[np.bool_] | None = None


def filled(motion: FreeMotion, solution: Solution, time: Array, opened: Opened | None = None) -> Books:
    """Every variable over rows up to where a motion ends, by walks, as `analyse` has them; NaN after it.

    time: s, of the rows, rising; opened: where joints in play were taken out, so that the rows are of those stated.
    """
    stated, layout = None if opened is None else Stated(opened, motion.contacts), solution.layout
    system = (motion.run if stated is None else stated.run).system
    arrays, (rows, which) = fill.allocate(system, len(time)), solution.at(time)
    seconds, energies = np.full((layout.coordinates, len(time)), np.nan), np.full((2, len(time)), np.nan)
    touches = Touches.empty(len(motion.contacts.each), len(system.axes), len(time))
    sticking = np.zeros((len(system.joints), len(time)), bool)
    resting = np.zeros(len(time), bool)
    arrays["status"][...] = Status.NOT_CONVERGED
    for lanes, stretch in _alike(solution, which):
        motion.begin(stretch.snapshot)
        at = layout.moment(time[lanes], rows[:, lanes], stretch.mode)
        accelerated = motion.accelerate(at)
        seconds[:, lanes], back, onsets = accelerated.second, accelerated.back, accelerated.onsets
        window = slice(int(lanes[0]), int(lanes[-1]) + 1)
        energies[0, lanes], energies[1, lanes] = kinetic_energy(back.walk), potential_energy(back.walk)
        touched = motion.contacts.pushes(back.walk, onsets)
        touches.fill(lanes, touched, onsets)
        stated_back = back if stated is None else stated.back(back, touched)
        fill_chunk(arrays, stated_back, window)
        if stated is not None:
            stated.fill(arrays, stated_back.walk, touched, window)
        resting[lanes] = stretch.resting
        for name, sense in zip(motion.resisted, stretch.mode.senses, strict=False):
            sticking[list(system.joints).index(name), lanes] = sense == 0
    for array in arrays.values():  # there is no motion any more
        if array.dtype == np.float64:
            array[..., which < 0] = np.nan
    moments = layout.moment(time, rows)
    fill.unwrap(arrays, system, motion.values_at(moments, np.nan_to_num(seconds)), time)
    if stated is not None:
        energies = np.vstack([energies, touches.stored.sum(axis=0)])
    one_by_one = sticking if motion.resisted and motion.several else None
    labels, works = fill.labels(system), layout.works(rows)
    return Books(time, arrays, labels, moments, seconds, energies, works, resting, touches, one_by_one)


def _alike(solution: Solution, which: NDArray[np.intp]) -> Iterator[tuple[NDArray[np.intp], Stretch]]:
    """Runs of rows that one walk can solve: of the same sense, switches and assembly. which: stretch of every row."""

    def key(row: Any) -> object:
        stretch = solution.stretches[which[row]]
        return stretch.mode, stretch.resting, id(stretch.snapshot)

    for _, rows in itertools.groupby(np.flatnonzero(which >= 0), key):
        lanes = np.array(list(rows))
        for part in np.split(lanes, range(CHUNK, len(lanes), CHUNK)):
            yield part, solution.stretches[which[part[0]]]


Touched = Sequence[tuple[ContactState, Push]]
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
    "work_contact": Variable(("time",), "J", "work lost in the contacts since the start, friction in them included"),
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


class Touches(NamedTuple):
    """What the contacts were at every row: (contact, time), and the offsets (contact, axis, time)."""

    gap: Array
    normal: Array
    friction: Array
    slip: Array
    touching: Array
    stored: Array
    offset: Array

    @classmethod
    def empty(cls, contacts: int, axes: int, times: int) -> Touches:
        """Nothing known."""
        sizes = [*[(contacts, times)] * 6, (contacts, axes, times)]
        return cls(*(np.full(size, np.nan) for size in sizes))

    def fill(self, lanes: NDArray[np.intp], touched: Touched, onsets: Sequence[object]) -> None:
        """Write the rows of one walk."""
        for k, (state, push) in enumerate(touched):
            self.gap[k, lanes], self.normal[k, lanes] = state.gap, push.normal
            self.friction[k, lanes], self.slip[k, lanes] = push.friction, state.slip
            self.touching[k, lanes], self.stored[k, lanes] = float(onsets[k] is not None), push.stored
            for axis in range(self.offset.shape[1]):
                self.offset[k, axis, lanes] = state.offset[axis]

    def arrays(self, work: Array) -> dict[str, Array]:
        """The variables of `CONTACT`."""
        return {
            "contact_gap": self.gap,
            "contact_normal_force": self.normal,
            "contact_friction_force": self.friction,
            "contact_slip": self.slip,
            "contact_touching": np.nan_to_num(self.touching),
            "contact_offset": self.offset,
            "contact_energy": self.stored.sum(axis=0),
            "work_contact": work,
        }


class Stated:
    """A motion whose joints in play were taken out, as one of the mechanism that was stated."""

    def __init__(self, opened: Opened, contacts: Contacts) -> None:
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
            second = system.joints[joint][1][1]
            for contact, (state, push) in zip(self.contacts.each, touched, strict=True):
                if contact.joint == joint:
                    along = push._replace(normal=0.0 * push.normal)
                    reaction = walk.algebra.added(reaction, dict(contact.action(back.walk, state, push).on)[second])
                    loss = dict(contact.action(back.walk, state, along).on)[second]
                    rubbing[joint] = walk.algebra.added(rubbing[joint], loss)
            if isinstance(walk, SpatialWalk):
                friction[joint] = dot(moment_at(rubbing[joint], bearing_middle(walk, joint)), walk.ends(joint)[1].z)
            else:  # about the joint's point on the second link
                moment = walk.algebra.moment_at(reaction, walk.point(second, joint).place)
                reaction = Wrench(reaction.x, reaction.y, moment)
                friction[joint] = moment if system.turns(joint) else 0.0
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
                for contact, (state, push) in zip(self.contacts.each, touched, strict=True)
                if contact.joint == joint
            )
            if isinstance(walk, SpatialWalk):
                continue
            first, second = (walk.motions[link] for link in walk.system.joints[joint][1])
            arrays["joint_rotation_velocity"][row, window] = second.twist.w - first.twist.w
            arrays["joint_rotation_acceleration"][row, window] = second.acceleration.w - first.acceleration.w
            motion = walk.coordinates(joint), walk.rates(joint), walk.second_rates(joint)
            for suffix, numbers in zip(("", "_velocity", "_acceleration"), motion, strict=True):
                arrays[f"joint_slide{suffix}"][row, window] = numbers[1]


def impact_arrays(impacts: Sequence[Impact]) -> dict[str, Array]:
    """The variables of `IMPACT`."""
    keys = ("begin", "end", "approach", "separation", "force", "depth", "impulse", "wear")
    return {f"impact_{key}": np.array([getattr(impact, key) for impact in impacts], float) for key in keys}


def impact_figures(labels: Sequence[str], impacts: Sequence[Impact], end: float) -> list[Figure]:
    """What a summary says of every contact: how often and how hard it touches, for how long, and how much it wears."""
    figures: list[Figure] = []
    for label in labels:
        of_contact = [impact for impact in impacts if impact.label == label]
        figures.append(Figure(f"{label}.impacts", f"contacts of {label}", float(len(of_contact)), "1"))
        if not of_contact:
            continue
        long = sum((impact.end if np.isfinite(impact.end) else end) - impact.begin for impact in of_contact)
        if struck := [impact for impact in of_contact if np.isnan(impact.force)]:  # of rigid bodies: without a force
            hardest = max(struck, key=lambda impact: impact.impulse)
            subject, when = f"impulse in {label}", f"at {hardest.begin:.4g} s"
            figures.append(Figure(f"{label}.impulse_max", subject, hardest.impulse, "N s", "largest", when))
        if pushed := [impact for impact in of_contact if np.isfinite(impact.force)]:
            most = max(pushed, key=lambda impact: impact.force)
            subject, when = f"contact force in {label}", f"in the contact from {most.begin:.4g} s"
            figures.append(Figure(f"{label}.contact_force_max", subject, most.force, "N", "largest", when))
        if (depth := max(impact.depth for impact in of_contact)) > 0:
            figures.append(Figure(f"{label}.contact_depth_max", f"penetration in {label}", depth, "m", "largest"))
        speed, wear = max(impact.approach for impact in of_contact), sum(impact.wear for impact in of_contact)
        share = long / end if end else np.nan
        figures += [
            Figure(f"{label}.approach_max", f"speed of approach in {label}", speed, "m/s", "largest"),
            Figure(f"{label}.contact_time", f"time in contact of {label}", share, "1", "of all"),
            Figure(f"{label}.wear", f"wear index of {label}", wear, "J"),
        ]
    return figures


FEWEST = 16  # rows from which there is a spectrum
SPECTRUM: dict[str, Variable] = {
    "contact_force_amplitude": Variable(
        ("contact", "frequency"), "N", "amplitude of the normal force by frequency, with Hann's window"
    )
}
FREQUENCY = Variable(("frequency",), "Hz", "frequency")


def spectrum(time: Array, forces: Array) -> tuple[Array, Array]:
    """Frequencies, Hz, and one-sided amplitudes, N, (…, frequency), of forces (…, time) at equally spaced times, s.

    A_k = 2 |Σ w_n F_n e^(−2πi kn/N)| / Σ w_n, half of it at 0 and at half the rate of the rows, with Hann's window w: a
    harmonic of amplitude A that lies on a frequency has A there and A/2 at its two neighbours. Source: F. J. Harris, On
    the use of windows for harmonic analysis with the discrete Fourier transform, Proc. IEEE 66 (1978) 51-83,
    doi:10.1109/PROC.1978.10837.
    """
    count = len(time)
    window = hann(count, sym=False)
    amplitude = 2.0 * np.abs(np.fft.rfft(forces * window, axis=-1)) / np.sum(window)
    amplitude[..., 0] *= 0.5
    if count % 2 == 0:
        amplitude[..., -1] *= 0.5
    return np.fft.rfftfreq(count, (time[-1] - time[0]) / (count - 1)), amplitude
