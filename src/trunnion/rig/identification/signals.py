"""What the model says of every channel in every condition, with exact derivatives by the unknowns.

All conditions and unknowns are one batch: row c·P + p of it is condition c with the derivative by unknown p.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import inf, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import Dual, derivative, primal
from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError
from trunnion.measures.measures import Measure, coordinate_unit
from trunnion.model.mechanism import Mechanism
from trunnion.model.rules import Within
from trunnion.rig.modelled import turned
from trunnion.solve import shifts
from trunnion.solve.backward import Backward, pose_status, status_of
from trunnion.solve.forward import Forward, posed
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run

Array = NDArray[np.float64]
Parameters = Mapping[str, Sequence[str] | str] | Sequence[str]
AT_ONCE = 20_000  # numbers in an array
STEP = 1e-6  # of a number, for what it does to the duration of the cycle
SMALL = 1e-6  # of 1 in SI: the least of numbers that must be above 0


class DriveCycle(NamedTuple):
    """Duration of a cycle, s, the angle of the first driver where it begins, and what it turns by, rad.

    NaN where its turns name no position.
    """

    duration: float
    begin: float
    turn: float

    @property
    def speed(self) -> float:
        """Mean, rad/s."""
        return self.turn / self.duration if self.duration else nan


class Courses(NamedTuple):
    """What the model has in one condition at some values of the unknowns.

    values: by channel, (position,); slopes: their derivatives, (unknown, position); status: of the positions; turned:
    where the sense of a friction or of a resisting load changes from one position to the next.
    """

    values: Mapping[str, Array]
    slopes: Mapping[str, Array]
    status: NDArray[np.int8]
    turned: NDArray[np.bool_]


@dataclass(frozen=True)
class Unknown:
    """One unknown: its name, the paths of the numbers that it stands for, SI unit, start and limits in SI.

    before: what the model has at each path.
    """

    name: str
    paths: tuple[str, ...]
    unit: str
    start: float
    lower: float
    upper: float
    before: tuple[float, ...]

    @property
    def size(self) -> float:
        """How large it is by the model; 0 if that has none."""
        return max(abs(self.start), max(map(abs, self.before)))


@dataclass(frozen=True)
class Model:
    """A prepared mechanism with its unknowns and the conditions it is observed in.

    measures: by channel; settings: values by path, SI, of each condition; phases: (position,) of each.
    """

    run: Run
    unknowns: tuple[Unknown, ...]
    measures: Mapping[str, Measure]
    settings: tuple[Mapping[str, float], ...]
    phases: tuple[Array, ...]
    friction: FrictionMethod

    def courses(self, at: Array) -> list[Courses]:
        """What the model says in each condition at these values of the unknowns, SI."""
        rows: dict[int, Courses] = {}
        many, sizes = len(self.unknowns), [len(phase) for phase in self.phases]
        for size in dict.fromkeys(sizes):  # conditions with as many positions as each other, not too many at once
            alike = [k for k, item in enumerate(sizes) if item == size]
            most = max(1, AT_ONCE // (size * many))
            for part in (alike[low : low + most] for low in range(0, len(alike), most)):
                shape, values = (len(part) * many, size), self._values(part, at)
                # shares of a cycle that an unknown may make longer, (row, position), s
                phase = np.repeat(np.stack([self.phases[k] for k in part]), many, axis=0)
                duration = np.repeat([self.cycle(k, at).duration for k in part], many)[:, None]
                slope, time = np.zeros((len(part), many)), phase * duration
                for p in self._timing:
                    step = STEP * (abs(at[p]) or 1.0) * (np.arange(many) == p)
                    ends = [[self.cycle(k, at + sign * step).duration for k in part] for sign in (-1, 1)]
                    slope[:, p] = np.diff(ends, axis=0)[0] / (2 * step[p])
                lasts: Number = Dual(time, phase * slope.reshape(-1, 1)) if self._timing else time
                solved: Forward | Backward
                with np.errstate(all="ignore"):
                    if all(measure.of_motion for measure in self.measures.values()):
                        solved = posed(self.run.system, values, self.run.chosen.assembly, lasts)
                        status, sides = pose_status(solved, shape), np.zeros(shape, bool)
                    else:
                        solved = self.run.solve(lasts, values, self.friction)
                        status, sides = status_of(solved, shape), turned(self.run, solved.walk, shape)
                    curves = {name: measure.curve(solved)[0] for name, measure in self.measures.items()}
                reals, slopes = ({name: np.broadcast_to(np.asarray(of(curve), float), shape)
                                  for name, curve in curves.items()} for of in (primal, derivative))  # fmt: skip
                for i, k in enumerate(part):
                    lanes = slice(i * many, (i + 1) * many)
                    rows[k] = Courses(
                        {name: course[i * many] for name, course in reals.items()},
                        {name: course[lanes] for name, course in slopes.items()},
                        np.max(status[lanes], axis=0), np.any(sides[lanes], axis=0),
                    )  # fmt: skip
        return [rows[k] for k in range(len(self.phases))]

    def by_share(self, condition: int, row: Array) -> Array:
        """Derivative by the share of the cycle of courses in a condition, (…, position), by differences of neighbours.

        Linear in the course, so that what is exact of the course stays so.
        """
        phase = self.phases[condition]
        if row.shape[-1] < 3 or row.shape[-1] != len(phase):
            return np.zeros_like(row)
        if not self.run.cycle.periodic:
            return np.asarray(np.gradient(row, phase, axis=-1))
        gap = (np.roll(phase, -1) - np.roll(phase, 1)) % 1.0
        return np.asarray((np.roll(row, -1, axis=-1) - np.roll(row, 1, axis=-1)) / gap)

    @property
    def start(self) -> Array:
        """Where the unknowns start, SI."""
        return np.array([unknown.start for unknown in self.unknowns])

    @cached_property
    def cycles(self) -> list[DriveCycle]:
        """The cycle in every condition, with the unknowns at their start."""
        return [self.cycle(k, self.start) for k in range(len(self.phases))]

    def cycle(self, condition: int, at: Array) -> DriveCycle:
        """The cycle at some values of the unknowns. Gear pairs that no driver turns are taken to turn as nominally."""
        system, cycle = self.run.system, self.run.cycle
        pairs = zip(at, self.unknowns, strict=True)
        sought = {path: float(value) for value, unknown in pairs for path in unknown.paths}
        values = system.mechanism.parameters({**self.settings[condition], **sought})
        if cycle.duration == 0:
            return DriveCycle(0.0, nan, nan)
        duration = float(cycle.duration * system.cycle(values).duration / system.cycle(self.run.values).duration)
        if coordinate_unit(system, self.run.values) != "rad":
            return DriveCycle(duration, nan, nan)
        drive = system.drive(values, next(iter(system.mechanism.drivers)), np.array([0.0, duration * (1 - 1e-12)]))[0]
        first, *_, last = np.ravel(np.asarray(primal(drive), float)).tolist()
        return DriveCycle(duration, first, last - first)

    # ---- the batch --------------------------------------------------------------------------------------------

    def _values(self, part: Sequence[int], at: Array) -> dict[str, Number]:
        """Every number: (row, 1) what differs between conditions, duals (row, 1) the unknowns."""
        many, mechanism, nominal = len(self.unknowns), self.run.system.mechanism, self.run.values
        entries = mechanism.parameter_set.entries.items()
        errors = {path: float(np.ravel(nominal[entry.error])[0]) for path, entry in entries if entry.error}
        overrides: dict[str, Number] = {}
        for path in dict.fromkeys(path for k in part for path in self.settings[k]):
            column = [self.settings[k].get(path, nominal[path]) + errors.get(path, 0.0) for k in part]
            overrides[path] = np.repeat(np.array(column, float), many)[:, None]
        for p, unknown in enumerate(self.unknowns):
            seed = np.tile(np.eye(many)[p], len(part))[:, None]
            for path in unknown.paths:
                overrides[path] = Dual(np.full((len(seed), 1), at[p] + errors.get(path, 0.0)), seed)
        values = mechanism.parameters(overrides)
        for seat in self.run.seats:
            play = shifts.play_of(mechanism.space, self.run.system.joints[seat.joint].type, values, seat.joint)
            if play is not None:
                values.update(play.model.paths(f"seats.{seat.joint}", shifts.given_offsets(values, seat.joint, play)))
        return values

    @cached_property
    def _timing(self) -> list[int]:
        """Unknowns that make the cycle longer or shorter."""
        start, places = self.start, range(len(self.unknowns))
        moved = [start + 1e3 * STEP * (abs(start[p]) or 1.0) * (np.arange(len(start)) == p) for p in places]
        return [p for p in places if self.cycle(0, moved[p]).duration != self.cycles[0].duration]


# ---- unknowns --------------------------------------------------------------------------------------------------


def paths_of(mechanism: Mechanism, parameters: Parameters) -> dict[str, tuple[str, ...]]:
    """Paths by the name of the unknown; MechanismError for what means no number, or one that is named twice."""
    groups = parameters if isinstance(parameters, Mapping) else {name: [name] for name in parameters}
    if not groups:
        remedy = "name one, such as joint_defaults.friction.coefficient"
        raise MechanismError(Finding("no parameter to identify is given", "parameters", remedy))
    findings: list[Finding] = []
    paths: dict[str, tuple[str, ...]] = {}
    owners: dict[str, str] = {}
    for name, members in groups.items():
        paths[name] = ()
        for number in [members] if isinstance(members, str) else list(members) or [name]:
            try:
                path = mechanism.path_of(number)
            except MechanismError as error:
                findings += error.findings
                continue
            if path in owners:
                what = f"{path} is in '{owners[path]}' already"
                findings.append(Finding(what, f"parameter {name}", "name each number once"))
            owners[path] = name
            paths[name] += (path,)
    if findings:
        raise MechanismError(findings)
    return paths


def unknowns(
    mechanism: Mechanism, paths: Mapping[str, tuple[str, ...]], start: Mapping[str, float | str]
) -> list[Unknown]:
    """The unknowns of a mechanism that states all their numbers; start: of some, by name."""
    if extra := [name for name in start if name not in paths]:
        what = f"'{extra[0]}' is not one of the parameters"
        raise MechanismError(Finding(what, "start", f"they are {', '.join(paths)}"))
    values = mechanism.parameters()
    kinds = mechanism.parameter_kinds()
    sought, findings = [], []
    for name, members in paths.items():
        where = f"parameter {name}"
        if missing := [path for path in members if path not in values]:
            what = f"{missing[0]} is no number but changes with the motion"
            findings.append(Finding(what, where, "identify a dimension in it"))
            continue
        units = {"1" if kinds[path].unit == "SI" else kinds[path].unit for path in members}
        if len(units) > 1:
            what = f"its numbers are not of one kind: {', '.join(sorted(units))}"
            findings.append(Finding(what, where, "use one parameter for each kind"))
            continue
        before = tuple(float(np.ravel(values[path])[0]) for path in members)
        lows, highs = zip(*(limits(mechanism, path) for path in members), strict=True)
        first, lower, upper = float(np.mean(before)), max(lows), min(highs)
        if name in start:
            numbers = mechanism.with_values({members[0]: start[name]}).parameters()
            first = float(np.ravel(numbers[members[0]])[0])
        if not lower <= first <= upper:
            what = f"the start {first:g} is beyond its limits, {lower:g} to {upper:g} (SI)"
            findings.append(Finding(what, where, "give another start"))
        sought.append(Unknown(name, members, units.pop(), first, lower, upper, before))
    if findings:
        raise MechanismError(findings)
    return sought


def limits(mechanism: Mechanism, path: str) -> tuple[float, float]:
    """Where a number may lie by its law or its kind, SI; infinite where nothing is known against it.

    A dimension has the limits of all numbers that are it and nothing else.
    """
    entries = mechanism.parameter_set.entries
    same = [path]
    for equal in same if path.startswith("dimensions.") else ():  # dimensions that are this one, and so on
        name = equal.removeprefix("dimensions.")
        for other, entry in entries.items():
            source = entry.alias.removeprefix("dimensions.") if entry.alias else entry.quantity.source
            if other not in same and isinstance(source, str) and source.strip() == name:
                same.append(other)
    low, high = -inf, inf
    for number in same:
        for rule in (rule for rule in entries[number].rules if isinstance(rule, Within)):
            low = max(low, SMALL if rule.ends[0] == "(" and rule.low == 0 else rule.low)
            high = min(high, rule.high)
        if number.startswith("links.") and number.endswith(".inertia"):
            low = max(low, 0.0)
    return low, high
