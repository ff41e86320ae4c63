"""The main question: how does it move, what force is in each joint, what drives it, where does the power go."""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion import results
from trunnion.algebra.namespace import Number
from trunnion.analysis import account, diagnosis
from trunnion.analysis.branches import Chosen, choose
from trunnion.analysis.bristles import History, histories
from trunnion.analysis.friction import FrictionMethod
from trunnion.analysis.kinematics import forward
from trunnion.analysis.kinetostatics import Backward, Given, solve
from trunnion.analysis.system import COMMON_TURNS, Cycle, System, Values, build, sticking
from trunnion.errors import Finding, MechanismError, Status
from trunnion.groups.gear import rotation
from trunnion.groups.planar import accelerated
from trunnion.model.mechanism import Mechanism

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Run", "analyse", "analyse_run", "prepare"]

CHUNK = 8192  # positions at a time: the arrays of a walk stay in cache
MOST_STEPS = 100_000_000
SINGULAR = 1e6  # condition from which less than about four digits would be left
TURN_STEPS = 720
NEAR_SINGULAR = 100.0  # a transmission angle of about a degree


@dataclass(frozen=True)
class Run:
    """A mechanism prepared once: its system, nominal values, cycle and assembly. Evaluate it as often as needed."""

    system: System
    values: Values
    cycle: Cycle
    chosen: Chosen

    def solve(
        self,
        time: Number,
        values: Values | None = None,
        method: FrictionMethod | None = None,
        zero_slip: Mapping[str, float] | None = None,
    ) -> Backward:
        """Motion and forces at the given times (s), nominal or with other values; see `kinetostatics.solve`.

        zero_slip: see `kinetostatics.Given`.
        """
        values = self.values if values is None else values
        past = self._past if values is self.values else self._histories(values)
        deflections = {joint: history.at(time) for joint, history in past.items()}
        given = Given(zero_slip or {}, deflections)
        return solve(self.system, values, self.chosen.assembly, time, method, given)

    def _histories(self, values: Values) -> dict[str, History]:
        with np.errstate(all="ignore"):
            return histories(self.system, values, self.chosen.assembly, self.cycle)

    @functools.cached_property
    def _past(self) -> dict[str, History]:
        """Histories of the bristles at the nominal values."""
        return self._histories(self.values)


def prepare(mechanism: Mechanism) -> Run:
    """Decompose a mechanism and choose its assembly. Raises MechanismError if its structure is not determined."""
    system = build(mechanism)
    values = mechanism.parameters()
    cycle = system.cycle(values)
    run = Run(system, values, cycle, choose(system, values, cycle))
    turns = _unknown_turns(run)
    if any(turns.values()):
        cycle = system.cycle(values, turns)
        run = Run(system, values, cycle, choose(system, values, cycle))
    return run


def _unknown_turns(run: Run) -> dict[str, float]:
    """Turns in the cycle of a joint of every chain of gear pairs that no driver turns, from a first walk."""
    mechanism = run.system.mechanism
    found: dict[str, float] = {}
    if not mechanism.gears or not run.cycle.periodic:
        return found
    duration = run.cycle.duration
    for gear in mechanism.gears.values():
        joint = gear.joints[0]
        if joint in run.system.geared_turns(run.values, duration, found):
            continue
        # up to just before the end: there a track begins again
        time = np.linspace(0.0, duration * (1 - 1e-9), TURN_STEPS)
        walk = forward(run.system, run.values, run.chosen.assembly, time)
        first, second = (walk.motions[link].frame for link in run.system.joints[joint][1])
        angle = np.unwrap(np.ravel(rotation((first, second))))
        turns = (angle[-1] - angle[0]) / (2 * np.pi)
        whole = np.rint(COMMON_TURNS * turns) / COMMON_TURNS
        found[joint] = float(whole if abs(whole - turns) < 1e-6 else turns) if np.isfinite(turns) else 0.0
    return found


def analyse(
    mechanism: Mechanism,
    steps: int = 360,
    method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """Motion, reactions with friction, drive effort and power of a mechanism over its cycle.

    steps: equally spaced positions; over a full turn the end is not repeated. Returns a Dataset with the names,
    units and dims of `results.VARIABLES`; positions without an answer are NaN and have a status.
    progress: called with the number of positions done.
    Method: the modules' closed forms or the general group, friction settled per module (`friction.settle`).
    Raises MechanismError if the structure does not determine the motion or `steps` is out of range.
    """
    _check_steps(steps)
    return analyse_run(prepare(mechanism), steps, method, progress)


def _check_steps(steps: int) -> None:
    if not 1 <= steps <= MOST_STEPS:
        remedy = f"give a number from 1 to {MOST_STEPS:,}"
        raise MechanismError(Finding(f"cannot analyse {steps} positions", "steps", remedy))


def analyse_run(
    run: Run,
    steps: int = 360,
    method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """What `analyse` does, for a mechanism that is prepared."""
    _check_steps(steps)
    method = replace(method or FrictionMethod(), margin_up_to=account.MARGIN)
    steps = steps if run.cycle.duration > 0 else 1
    time = run.cycle.times(steps)
    labels = _labels(run.system)
    arrays = results.allocate(labels, steps, _absent(run.system))
    causes = diagnosis.Causes(run.system)
    for low in range(0, steps, CHUNK):
        window = slice(low, min(low + CHUNK, steps))
        back = run.solve(time[window], method=method)
        _fill(arrays, back, time[window], window, causes)
        if progress:
            progress(window.stop)
    _bracket(arrays, run, time, replace(method, margin_up_to=0.0), causes)  # the margin is known by now
    _unwrap(arrays, run, time)
    return account.finish(run, arrays, labels, time, method, causes)


def _labels(system: System) -> dict[str, list[str]]:
    mechanism = system.mechanism
    springs = {"spring": list(mechanism.springs)} if mechanism.springs else {}
    gears = {"gear": list(mechanism.gears)} if mechanism.gears else {}
    return (
        springs
        | gears
        | {
            "joint": list(system.joints),
            "link": list(mechanism.links),
            "point": [f"{link}.{point}" for link, point in system.points],
            "axis": ["x", "y"],
            "driver": list(mechanism.drivers),
        }
    )


def _absent(system: System) -> list[str]:
    """Variables that this mechanism cannot have: zero without taking memory."""
    if any(kind == "prismatic" for kind, _ in system.joints.values()):
        return []
    slides = ["joint_slide", "joint_slide_velocity", "joint_slide_acceleration", "friction_force"]
    return [*slides, "reaction_moment"]


Arrays = dict[str, NDArray[np.float64]]


def _fill(arrays: Arrays, back: Backward, time: NDArray[np.float64], window: slice, causes: diagnosis.Causes) -> None:
    """Write one chunk into the result; what a status rules out becomes NaN."""
    status = _status(back, arrays["status"][window].shape)
    arrays["status"][window] = status
    causes.note(back, status, window.start)
    with np.errstate(all="ignore"):
        _fill_motion(arrays, back, time, window)
        _fill_forces(arrays, back, window)
        account.fill_power(arrays, back, time, window)
    _blank(arrays, status, window)


def _status(back: Backward, shape: tuple[int, ...]) -> NDArray[np.int8]:
    """The gravest status of every position."""
    walk = back.walk
    status = np.zeros(shape, np.int8)

    def raise_to(code: Status, where: Number) -> None:
        np.maximum(status, np.where(where, np.int8(code), np.int8(0)), out=status)

    placed: Number = True
    condition: Number = 1.0
    for group, pose in zip(walk.system.groups, walk.poses, strict=True):
        for frame in pose.frames:
            placed = placed & np.isfinite(frame.x + frame.y + frame.c + frame.s)
        condition = np.maximum(condition, group.condition(pose))
    for name in sticking(walk.system):
        raise_to(Status.ZERO_SLIP, back.slips[name].zero)
    raise_to(Status.NEAR_SINGULAR, condition > NEAR_SINGULAR)
    for settled in back.settled:
        raise_to(Status.NOT_CONVERGED, ~np.asarray(settled.converged, bool))
        raise_to(Status.LOCKED, np.asarray(settled.share) < 1.0)
    raise_to(Status.NOT_CONVERGED, ~np.isfinite(_sum_of_forces(back)))
    for undefined in back.undefined.values():
        raise_to(Status.LOAD_UNDEFINED, undefined)
    raise_to(Status.SINGULAR, ~(condition <= SINGULAR))
    raise_to(Status.NOT_ASSEMBLED, ~np.asarray(placed))
    return status


def _sum_of_forces(back: Backward) -> Number:
    """Finite where every reaction and effort is."""
    total: Number = 0.0
    for effort in (*back.efforts.values(), *back.friction.values()):
        total = total + effort
    for reaction in back.reactions.values():
        total = total + reaction.x + reaction.y
    return total


def _fill_motion(arrays: Arrays, back: Backward, time: NDArray[np.float64], window: slice) -> None:
    walk = back.walk
    ground = walk.system.mechanism.fixed_link
    for i, link in enumerate(walk.system.mechanism.links):
        if link == ground:
            continue
        motion = walk.motions[link]
        arrays["link_angle"][i, window] = np.arctan2(motion.frame.s, motion.frame.c)
        arrays["link_angle_velocity"][i, window] = motion.twist.w
        arrays["link_angle_acceleration"][i, window] = motion.acceleration.w
    for i, (link, name) in enumerate(walk.system.points):
        moved = walk.point(link, name)
        for axis in (0, 1):
            arrays["point_position"][i, axis, window] = moved.place[axis]
            if link == ground:
                continue
            arrays["point_velocity"][i, axis, window] = moved.velocity[axis]
            arrays["point_acceleration"][i, axis, window] = moved.acceleration[axis]
    for i, (kind, links) in enumerate(walk.system.joints.values()):
        first, second = (walk.motions[link] for link in links)
        arrays["joint_rotation_velocity"][i, window] = second.twist.w - first.twist.w
        arrays["joint_rotation_acceleration"][i, window] = second.acceleration.w - first.acceleration.w
        if kind == "prismatic":
            _fill_slide(arrays, back, i, window)
        elif arrays["joint_slide"].flags.writeable:
            for name in ("joint_slide", "joint_slide_velocity", "joint_slide_acceleration"):
                arrays[name][i, window] = 0.0


def _fill_slide(arrays: Arrays, back: Backward, i: int, window: slice) -> None:
    """Slide of one joint with its derivatives, along the axis on its first link."""
    walk = back.walk
    name = list(walk.system.joints)[i]
    first, second = walk.system.joints[name][1]
    one, two = walk.element(first, name), walk.element(second, name)
    dx, dy = two.x - one.x, two.y - one.y
    w, base, end = walk.motions[first].twist.w, walk.acceleration(first, name), walk.acceleration(second, name)
    carried = accelerated(base, w, dx, dy)
    arrays["joint_slide"][i, window] = one.c * dx + one.s * dy
    arrays["joint_slide_velocity"][i, window] = back.slips[name].speed
    # the Coriolis part 2 ω × ṡ lies across the slide
    arrays["joint_slide_acceleration"][i, window] = one.c * (end.x - carried.x) + one.s * (end.y - carried.y)


def _fill_forces(arrays: Arrays, back: Backward, window: slice) -> None:
    system = back.walk.system
    for i, (name, (kind, _)) in enumerate(system.joints.items()):
        reaction, friction = back.reactions[name], back.friction[name]
        arrays["reaction_force"][i, 0, window] = reaction.x
        arrays["reaction_force"][i, 1, window] = reaction.y
        if arrays["reaction_moment"].flags.writeable:
            arrays["reaction_moment"][i, window] = reaction.m
        rotates = kind == "revolute"
        arrays["friction_torque"][i, window] = friction if rotates else 0.0
        if arrays["friction_force"].flags.writeable:
            arrays["friction_force"][i, window] = 0.0 if rotates else friction
    for i, name in enumerate(system.mechanism.drivers):
        arrays["drive_effort"][i, window] = back.efforts[name]
    for i, name in enumerate(system.mechanism.springs):
        state = back.springs[name]
        for key, number in zip(("spring_force", "spring_elongation"), state[:2], strict=True):
            arrays[key][i, window] = number
    for i, name in enumerate(system.mechanism.gears):
        gear = back.gears[name]
        arrays["gear_torque"][i, window] = gear.torque
        for axis in (0, 1):
            arrays["gear_force"][i, axis, window] = gear.force[axis]
    settled = back.settled
    for key, field in (
        ("friction_iterations", "iterations"),
        ("friction_change", "change"),
        ("friction_contraction", "contraction"),
    ):
        worst = functools.reduce(np.maximum, (getattr(one, field) for one in settled), 0.0)
        arrays[key][window] = worst
    arrays["locking_margin"][window] = functools.reduce(np.minimum, (one.margin for one in settled), np.inf)


FORCES = [
    *("reaction_force", "reaction_moment", "friction_torque", "friction_force", "friction_power"),
    *("drive_effort", "drive_power", "power_residual", "friction_change", "friction_contraction"),
    *("spring_force", "spring_power", "damping_power", "gear_torque", "gear_force"),
]
RATES = [name for name in results.VARIABLES if name.endswith(("_velocity", "_acceleration"))]


def _blank(arrays: Arrays, status: NDArray[np.int8], window: slice) -> None:
    """NaN for every number that a status rules out."""
    if not np.any(status >= Status.NOT_CONVERGED):
        return
    for names, where in (
        (FORCES, status >= Status.NOT_CONVERGED),
        (RATES, status >= Status.SINGULAR),
        (["locking_margin"], status >= Status.LOAD_UNDEFINED),
        (["useful_power", "efficiency_instant"], status >= Status.NOT_CONVERGED),
    ):
        for name in names:
            if name in arrays and arrays[name].flags.writeable:
                arrays[name][..., window][..., where] = np.nan
    # a driver's own link is known where the rest is not; a whole position is either assembled or not
    for name in ("point_position", "link_angle", "joint_slide", "spring_elongation", "closure_residual", "condition"):
        if name in arrays and arrays[name].flags.writeable:
            arrays[name][..., window][..., status == Status.NOT_ASSEMBLED] = np.nan


def _bracket(
    arrays: Arrays, run: Run, time: NDArray[np.float64], method: FrictionMethod, causes: diagnosis.Causes
) -> None:
    """Least and largest drive effort: where a relative speed is zero, friction may act either way.

    Exact for one such joint at a position; with several, their separate effects are added (first order).
    """
    if not causes.zero_slip():
        return  # both are the effort itself
    lower = arrays["drive_effort_lower"] = arrays["drive_effort"].copy()
    upper = arrays["drive_effort_upper"] = arrays["drive_effort"].copy()
    for joint, positions in causes.zero_slip().items():
        for low in range(0, len(positions), CHUNK):
            part = positions[low : low + CHUNK]
            _widen(lower, upper, arrays["drive_effort"], run, time[part], part, joint, method)


def _widen(
    lower: NDArray[np.float64],
    upper: NDArray[np.float64],
    effort: NDArray[np.float64],
    run: Run,
    time: NDArray[np.float64],
    positions: NDArray[np.intp],
    joint: str,
    method: FrictionMethod,
) -> None:
    """Widen the interval by what the friction of one joint can do with either sign."""
    ends = [run.solve(time, method=method, zero_slip={joint: sign}).efforts for sign in (-1.0, 1.0)]
    for i, name in enumerate(run.system.mechanism.drivers):
        changes = [np.broadcast_to(end[name], time.shape) - effort[i, positions] for end in ends]
        lower[i, positions] += np.minimum(0.0, np.minimum(*changes))
        upper[i, positions] += np.maximum(0.0, np.maximum(*changes))


def _unwrap(arrays: Arrays, run: Run, time: NDArray[np.float64]) -> None:
    """Angles without jumps of a whole turn along each run of solved positions, and the joints' rotations.

    A driven rotation is the prescribed coordinate itself, whole turns included.
    """
    system, angles = run.system, arrays["link_angle"]
    order = list(system.mechanism.links)
    step = float(time[1] - time[0]) if len(time) > 1 else 0.0
    for link, angle, rate in zip(order, angles, arrays["link_angle_velocity"], strict=True):
        if link != system.mechanism.fixed_link:
            _unwrap_row(angle, rate, step)
    for i, (name, (kind, (first, second))) in enumerate(system.joints.items()):
        rotation = arrays["joint_rotation"][i]
        np.subtract(angles[order.index(second)], angles[order.index(first)], out=rotation)
        if name in system.mechanism.drivers and kind == "revolute":
            rotation[:] = np.where(np.isfinite(rotation), system.drive(run.values, name, time)[0], np.nan)


def _unwrap_row(angle: NDArray[np.float64], rate: NDArray[np.float64], step: float) -> None:
    """Add whole turns in place so that the angle follows its rate from position to position (`step` s apart).

    A gap of NaN is bridged to the nearest turn. Some positions at a time, to save memory.
    """
    turns, last, last_rate, last_at = 0, np.nan, 0.0, -1
    for low in range(0, len(angle), CHUNK):
        part = angle[low : low + CHUNK]
        solved = np.flatnonzero(np.isfinite(part))
        if not len(solved):
            continue
        values, rates = part[solved], np.nan_to_num(rate[low : low + CHUNK][solved])
        before = np.concatenate([[last if np.isfinite(last) else values[0]], values[:-1]])
        mean_rate = (np.concatenate([[last_rate], rates[:-1]]) + rates) / 2
        next_to = np.diff(np.concatenate([[last_at], solved + low])) == 1
        expected = np.where(next_to & np.isfinite(before), mean_rate * step, 0.0)
        if not np.isfinite(last):
            expected[0] = 0.0
        added = np.cumsum(np.rint((expected - (values - before)) / (2 * np.pi)))
        part[solved] = values + 2 * np.pi * (turns + added)
        turns, last, last_rate, last_at = turns + added[-1], values[-1], rates[-1], int(solved[-1]) + low
