"""A motion of joints in play as the mechanism was stated: with these joints, and without what stands in for them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.plane import Wrench
from trunnion.algebra.space import Screw, moment_at
from trunnion.algebra.unwrap import unwrap_row
from trunnion.algebra.vector import dot
from trunnion.cycle import fill
from trunnion.dynamics.active_motion import Impact
from trunnion.dynamics.opened import Opened, in_play
from trunnion.dynamics.touching import Contacts, ContactState, Push
from trunnion.joints.pairs import PAIRS
from trunnion.results import variables as results
from trunnion.results.dataset import Variable
from trunnion.results.figure import Figure
from trunnion.solve.backward import Backward
from trunnion.solve.contacts import bearing_middle
from trunnion.solve.forward import Forward, SpatialWalk
from trunnion.solve.run import Run

__all__ = ["CONTACT", "IMPACT", "PlayedJoints", "Touches", "as_stated", "impact_arrays", "impact_figures"]

Array = NDArray[np.float64]
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


def as_stated(
    run: Run, played: PlayedJoints, arrays: Mapping[str, Array], labels: Mapping[str, Sequence[str]]
) -> tuple[dict[str, Array], dict[str, list[str]]]:
    """Arrays and labels of the mechanism as it is stated, from those of the mechanism without its joints in play."""
    system = run.system
    stated_labels, arrays_played = fill.labels(system), played.arrays
    variables = results.variables(system.mechanism.space)
    for name, array in arrays.items():
        if name not in arrays_played or results.SAME_AS.get(name) in arrays_played:
            continue
        into, dims = arrays_played[name], variables[name].dims
        places = [[(i, labels[dim].index(label)) for i, label in enumerate(stated_labels[dim]) if label in labels[dim]]
                  for dim in dims if dim in stated_labels]  # fmt: skip
        if not places:
            into[...] = array
            continue
        to, of = (np.ix_(*([pair[side] for pair in place] for place in places)) for side in (0, 1))
        into[to] = array[of]
    if system.mechanism.space == "planar":
        for joint, row in played.rows.items():
            first, second = (stated_labels["link"].index(link) for link in system.joints[joint][1])
            for suffix in ("", "_velocity", "_acceleration"):
                angles = arrays_played[f"link_angle{suffix}"]
                arrays_played[f"joint_rotation{suffix}"][row] = angles[second] - angles[first]
    return arrays_played, stated_labels


@dataclass
class PlayedJoints:
    """Motion and reaction of the joints that the opened mechanism does not have. arrays: of the mechanism as stated,
    in which their rows alone are filled; times: how many there are."""

    opened: Opened
    contacts: Contacts
    times: int
    arrays: dict[str, Array] = field(init=False)

    def __post_init__(self) -> None:
        system = self.opened.run.system
        self.arrays = fill.allocate(system, self.times)
        self.cut = in_play(system.mechanism)
        self.rows = {joint: k for k, joint in enumerate(system.joints) if joint in (*self.cut, *self.opened.parts)}
        for name, array in self.arrays.items():
            if "joint" in results.variables(system.mechanism.space)[name].dims:
                array[list(self.rows.values())] = np.nan

    def fill(self, back: Backward, touched: Touched, window: slice) -> None:
        """The rows of one walk of the opened mechanism."""
        run = self.opened.run
        local = run.system.elements(run.values)
        own_holes = {key: hole for key, hole in run.system.holes(run.values).items() if key[1] in self.cut}
        motions = {link: back.walk.motions[link] for link in run.system.mechanism.effective_links}
        walk = type(back.walk)(run.system, run.values, {**local, **own_holes}, motions, back.walk.time)
        for joint, row in self.rows.items():
            reaction, rubbing, lost = self._wrenches(back, joint, touched)
            self.arrays["friction_power"][row, window] = lost
            if isinstance(walk, SpatialWalk):
                self._fill_in_space(walk, joint, row, window, reaction, rubbing)
            else:
                self._fill_in_plane(walk, joint, row, window, reaction)

    def _fill_in_space(
        self, walk: SpatialWalk, joint: str, row: int, window: slice, reaction: Screw, rubbing: Screw
    ) -> None:
        fill.fill_joint(self.arrays, walk, row, joint, window)
        middle, axis = bearing_middle(walk, joint), walk.ends(joint)[1].z
        fill.put(self.arrays["reaction_force"], row, reaction.u, window)
        fill.put(self.arrays["reaction_moment"], row, moment_at(reaction, middle), window)
        fill.put(self.arrays["friction_moment"], row, moment_at(rubbing, middle), window)
        self.arrays["friction_torque"][row, window] = dot(moment_at(rubbing, middle), axis)
        self.arrays["friction_force"][row, window] = dot(rubbing.u, axis)
        fill.fill_bearing(self.arrays, walk, row, joint, reaction, rubbing, window)

    def _fill_in_plane(self, walk: Forward, joint: str, row: int, window: slice, reaction: Any) -> None:
        point = walk.point(walk.system.joints[joint][1][1], joint).place
        fill.put(self.arrays["reaction_force"], row, reaction[:2], window)
        moment, turns = walk.algebra.moment_at(reaction, point), walk.system.turns(joint)
        for name in ("reaction_moment", "friction_torque", "friction_force"):
            self.arrays[name][row, window] = 0.0
        self.arrays["friction_torque" if turns else "reaction_moment"][row, window] = moment
        fill.fill_bearing(self.arrays, walk, row, joint, Wrench(reaction.x, reaction.y, moment), None, window)
        motion = walk.coordinates(joint), walk.rates(joint), walk.second_rates(joint)
        for suffix, numbers in zip(("", "_velocity", "_acceleration"), motion, strict=True):
            self.arrays[f"joint_slide{suffix}"][row, window] = numbers[1]

    def _wrenches(self, back: Backward, joint: str, touched: Touched) -> tuple[Any, Any, Array | float]:
        """What a joint does to its second link, all and by friction, and what is lost to this, W."""
        algebra = back.walk.algebra
        reaction, rubbing, lost = algebra.ZERO_LOAD, algebra.ZERO_LOAD, np.zeros(1)
        if joint in self.opened.parts:
            return back.reactions[self.opened.parts[joint][-1]], rubbing, 0.0
        second = self.opened.run.system.joints[joint][1][1]
        for contact, (state, push) in zip(self.contacts.each, touched, strict=True):
            if contact.joint == joint:
                along = push._replace(normal=0.0 * push.normal)
                reaction = algebra.added(reaction, dict(contact.action(back.walk, state, push).on)[second])
                rubbing = algebra.added(rubbing, dict(contact.action(back.walk, state, along).on)[second])
                lost = lost - push.friction * state.slip
        return reaction, rubbing, lost

    def unwrap(self, time: Array) -> None:
        """Rotations in space without jumps of a whole turn."""
        step = float(time[1] - time[0]) if len(time) > 1 else 0.0
        system = self.opened.run.system
        for joint, row in self.rows.items() if system.mechanism.space == "spatial" else ():
            if PAIRS[system.joints[joint][0]].angle:
                unwrap_row(self.arrays["joint_rotation"][row], self.arrays["joint_rotation_velocity"][row], step)


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
        share = long / end if end else np.nan
        depth, speed = max(impact.depth for impact in of_contact), max(impact.approach for impact in of_contact)
        struck, pushed = (
            [impact for impact in of_contact if np.isnan(impact.force)],
            [impact for impact in of_contact if np.isfinite(impact.force)],
        )
        if struck:  # an impact of rigid bodies has no largest force
            hardest = max(struck, key=lambda impact: impact.impulse)
            when = f"at {hardest.begin:.4g} s"
            figures.append(
                Figure(f"{label}.impulse_max", f"impulse in {label}", hardest.impulse, "N s", "largest", when)
            )
        if pushed:
            most = max(pushed, key=lambda impact: impact.force)
            when = f"in the contact from {most.begin:.4g} s"
            figures.append(
                Figure(f"{label}.contact_force_max", f"contact force in {label}", most.force, "N", "largest", when)
            )
        if depth > 0:
            figures.append(Figure(f"{label}.contact_depth_max", f"penetration in {label}", depth, "m", "largest"))
        figures += [
            Figure(f"{label}.approach_max", f"speed of approach in {label}", speed, "m/s", "largest"),
            Figure(f"{label}.contact_time", f"time in contact of {label}", share, "1", "of all"),
            Figure(f"{label}.wear", f"wear index of {label}", sum(impact.wear for impact in of_contact), "J"),
        ]
    return figures
