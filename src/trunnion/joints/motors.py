"""Motors: effort on a free coordinate from its speed and time.

A motor knows nothing of joints: its effort is a torque or a force, by the joint it drives. A new kind is one function
and one entry of `MOTORS`; the model's schema, its checks, the documentation and the tests read the table.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.spline import look_up

Array = NDArray[np.float64]
Parameters = Mapping[str, Array]  # what a motor states, by key, SI; of `points` lists, of `over` a word


@dataclass(frozen=True)
class MotorKind:
    """A kind of motor with what it is stated by and where it comes from.

    function: `(speed, time, parameters, integral) -> effort` at the motor's own shaft, N m or N; speed in rad/s or m/s;
    integral: of the controller's error over time, 0 of a motor without. error: of a kind with such an integral, its
    rate `(speed, time, parameters, integral) -> rate`; excess: by how much what it aims at is beyond its limit,
    likewise. needs: keys that must be given; takes: keys that may be.
    """

    function: Callable[[Array, Array, Parameters, Array], Array]
    needs: tuple[str, ...]
    takes: tuple[str, ...] = ()
    source: str = ""
    validity: str = ""
    error: Callable[[Array, Array, Parameters, Array], Array] | None = None
    excess: Callable[[Array, Array, Parameters, Array], Array] | None = None


def constant(speed: Array, time: Array, parameters: Parameters, integral: Array) -> Array:
    """The same effort at every speed."""
    return parameters["effort"] + 0.0 * speed


def linear(speed: Array, time: Array, parameters: Parameters, integral: Array) -> Array:
    """Direct-current motor: T = T_s (1 − ω/ω₀), T_s at standstill, ω₀ without load."""
    return parameters["stall_effort"] * (1.0 - speed / parameters["no_load_speed"])


def induction(speed: Array, time: Array, parameters: Parameters, integral: Array) -> Array:
    """Induction motor by Kloss's formula: T = 2 T_k/(s/s_k + s_k/s), s = 1 − ω/ω_s; 0 at the synchronous speed.

    Written as 2 T_k s s_k/(s² + s_k²), which has a value at s = 0 too.
    """
    slip, most = 1.0 - speed / parameters["synchronous_speed"], parameters["breakdown_slip"]
    return 2.0 * parameters["breakdown_effort"] * slip * most / (slip * slip + most * most)


def table(speed: Array, time: Array, parameters: Parameters, integral: Array) -> Array:
    """Points (speed or time, effort) joined by straight lines; before the first and after the last the effort stays."""
    knots, efforts = list(parameters["points.place"]), list(parameters["points.effort"])
    place = time + 0.0 * speed if str(parameters["over"]) == "time" else speed
    effort: Array = look_up(knots, efforts, np.clip(place, knots[0], knots[-1]))
    return effort


def speed_control(speed: Array, time: Array, parameters: Parameters, integral: Array) -> Array:
    """Controller of the speed: T = K_p (ω* − ω) + K_i ∫ (ω* − ω) dt, between −limit and limit."""
    limit = parameters["limit"]
    return np.clip(_wanted(speed, parameters, integral), -limit, limit)


def _wanted(speed: Array, parameters: Parameters, integral: Array) -> Array:
    return parameters["proportional"] * (parameters["target"] - speed) + parameters["integral"] * integral


def over_limit(speed: Array, time: Array, parameters: Parameters, integral: Array) -> Array:
    """By how much what the controller aims at is beyond its limit."""
    return np.abs(_wanted(speed, parameters, integral)) - parameters["limit"]


# of the limit: by how much what is wanted may exceed it before the integral is held. At the limit itself it would be
# held and let go in turn, endlessly often, where the speed rises as fast as the integral makes up for.
BEYOND = 0.01


def control_error(speed: Array, time: Array, parameters: Parameters, integral: Array) -> Array:
    """Rate of the controller's integral: ω* − ω; less of it, down to 0, while what is wanted goes beyond the limit by
    up to BEYOND of it and the error would drive it farther."""
    error, limit = parameters["target"] - speed, parameters["limit"]
    aimed = _wanted(speed, parameters, integral)
    left = np.clip(1.0 - (np.abs(aimed) / limit - 1.0) / BEYOND, 0.0, 1.0)
    return np.where(aimed * error > 0, left * error, error)


MOTORS: dict[str, MotorKind] = {
    "constant": MotorKind(constant, ("effort",), validity="a hanging weight, a cylinder at constant pressure"),
    "linear": MotorKind(
        linear,
        ("stall_effort", "no_load_speed"),
        source="A. Hughes, B. Drury, Electric Motors and Drives, 5th ed., Newnes, 2019, chapter 3",
        validity="direct-current and permanent-magnet motors at constant voltage",
    ),
    "induction": MotorKind(
        induction,
        ("breakdown_effort", "breakdown_slip", "synchronous_speed"),
        source="M. Kloss, Archiv für Elektrotechnik 5 (1916) 59-87",
        validity="induction motors at constant voltage and frequency; electrical transients are left out",
    ),
    "table": MotorKind(table, ("points",), ("over",), validity="a measured characteristic"),
    "speed-control": MotorKind(
        speed_control,
        ("target", "proportional", "limit"),
        ("integral",),
        source="K. J. Åström, R. M. Murray, Feedback Systems, 2nd ed., Princeton University Press, 2021, chapter 11",
        validity="a servo drive whose current loop is fast against the mechanism",
        error=control_error,
        excess=over_limit,
    ),
}


def transmitted(effort: Array, speed: Array, ratio: float, efficiency: float) -> Array:
    """Effort on the driven coordinate of an effort at the motor's shaft, through a gear.

    ratio: motor speed over the coordinate's; efficiency: of the gear in the direction in which the power flows, so that
    a mechanism that drives its motor has to overcome the loss. At rest the gear is taken to drive.
    """
    joint = ratio * effort
    return np.where(joint * speed >= 0.0, joint * efficiency, joint / efficiency)
