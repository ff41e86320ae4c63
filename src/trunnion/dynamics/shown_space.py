"""Joints in play in space, and joints for which chains stand in, as variables of the mechanism that was stated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.space import NULL, Screw, about, added, moment_at
from trunnion.algebra.unwrap import unwrap_row
from trunnion.algebra.vector import Vector3, dot, scaled
from trunnion.cycle.fill import allocate, fill_joint, put
from trunnion.dynamics.opened import Opened, in_play
from trunnion.dynamics.touching import Contacts, ContactState, Push
from trunnion.joints.pairs import PAIRS
from trunnion.results import variables as results
from trunnion.solve.backward import Backward
from trunnion.solve.contacts import bearing_middle
from trunnion.solve.forward import SpatialWalk

__all__ = ["JointsInSpace"]

Array = NDArray[np.float64]
Touched = Sequence[tuple[ContactState, Push]]


@dataclass
class JointsInSpace:
    """Motion and reaction of the joints that the opened mechanism does not have. arrays: of the mechanism as stated,
    in which their rows alone are filled; times: how many there are."""

    opened: Opened
    contacts: Contacts
    times: int
    arrays: dict[str, Array] = field(init=False)

    def __post_init__(self) -> None:
        system = self.opened.run.system
        self.arrays = allocate(system, self.times)
        self.cut = in_play(system.mechanism)
        self.rows = {joint: k for k, joint in enumerate(system.joints) if joint in (*self.cut, *self.opened.parts)}
        for name, array in self.arrays.items():
            if "joint" in results.variables("spatial")[name].dims:
                array[list(self.rows.values())] = np.nan

    def fill(self, back: Backward, touched: Touched, window: slice) -> None:
        """The rows of one walk of the opened mechanism."""
        run = self.opened.run
        local = run.system.elements(run.values)
        own = {key: hole for key, hole in run.system.holes(run.values).items() if key[1] in self.cut}
        motions = {link: back.walk.motions[link] for link in run.system.mechanism.effective_links}
        walk = SpatialWalk(run.system, run.values, {**local, **own}, motions, back.walk.time)
        for joint, row in self.rows.items():
            fill_joint(self.arrays, walk, row, joint, window)
            middle, axis = bearing_middle(walk, joint), walk.ends(joint)[1].z
            whole, rubbing, lost = self._wrenches(back, joint, touched)
            put(self.arrays["reaction_force"], row, whole.u, window)
            put(self.arrays["reaction_moment"], row, moment_at(whole, middle), window)
            put(self.arrays["friction_moment"], row, moment_at(rubbing, middle), window)
            self.arrays["friction_torque"][row, window] = dot(moment_at(rubbing, middle), axis)
            self.arrays["friction_force"][row, window] = dot(rubbing.u, axis)
            self.arrays["friction_power"][row, window] = lost

    def _wrenches(self, back: Backward, joint: str, touched: Touched) -> tuple[Screw, Screw, Array | float]:
        """What a joint does to its second link, all and by friction, and what is lost to this, W."""
        if joint in self.opened.parts:
            return back.reactions[self.opened.parts[joint][-1]], Screw(NULL, NULL), 0.0
        whole, rubbing, lost = Screw(NULL, NULL), Screw(NULL, NULL), np.zeros(1)
        for one, (state, push) in zip(self.contacts.each, touched, strict=True):
            if one.joint != joint:
                continue
            tangent, normal, place = _vector(state.tangent), _vector(state.normal), _vector(state.place)
            along = about(scaled(-push.friction, tangent), NULL, place)
            rubbing = added(rubbing, along)
            whole = added(whole, added(about(scaled(push.normal, normal), NULL, place), along))
            lost = lost - push.friction * state.slip
        return whole, rubbing, lost

    def unwrap(self, time: Array) -> None:
        """Rotations without jumps of a whole turn."""
        step = float(time[1] - time[0]) if len(time) > 1 else 0.0
        for joint, row in self.rows.items():
            if PAIRS[self.opened.run.system.joints[joint][0]].angle:
                unwrap_row(self.arrays["joint_rotation"][row], self.arrays["joint_rotation_velocity"][row], step)


def _vector(numbers: Sequence[float | Array]) -> Vector3:
    x, y, z = numbers
    return x, y, z
