"""A mechanism prepared once, to be solved at any times: what everything after solving stands on."""

from __future__ import annotations

import functools
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.course import Accuracy, Courses
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, MechanismError
from trunnion.groups.gear import rotation
from trunnion.model.mechanism import Mechanism
from trunnion.solve.assembly import Chosen, choose
from trunnion.solve.backward import Backward, Given, Sense, row_code, solve
from trunnion.solve.bristles import History, histories
from trunnion.solve.forward import Forward, Travel, forward, posed
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.inverse import Inverse, driven_at_outputs
from trunnion.solve.shifts import GivenSeat, seats
from trunnion.solve.space.determinacy import Determinacy, look
from trunnion.solve.switches import Bend, Mechanisms, accuracy_of, bends, breaks_between
from trunnion.solve.system import COMMON_TURNS, Cycle, System, Values, build

TURN_STEPS = 720
COMES_BACK = 1e-6  # of the mechanism's size
CHUNK = 8192  # solved at a time: the arrays of a walk stay in cache
JOINTS = 2**18  # at all the positions that are solved at a time: each takes some 300 bytes
BLOCK = 30 * 2**20  # bytes; glibc learns from blocks of up to 32 MiB
Found = TypeVar("Found")


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
        conditions: Given | None = None,
        past: Mapping[str, History] | None = None,
    ) -> Backward:
        """Motion and forces at the given times (s), nominal or with other values; see `backward.solve`.

        past: of the bristles of joints; that with these values if not given.
        """
        values = self.values if values is None else values
        if past is None:
            nominal = values is self.values
            past = self._past if nominal else histories(self.system, values, self.chosen.assembly, self.cycle)
        deflections = {joint: history.at(time) for joint, history in past.items()}
        conditions = replace(conditions or Given(), deflections=deflections)
        return solve(self.system, values, self.chosen.assembly, time, method, conditions)

    def walk(self, time: Number) -> Forward:
        """Motion alone at the given times (s)."""
        return forward(self.system, self.values, self.chosen.assembly, time)

    def posed(self, time: NDArray[np.float64], values: Values) -> Forward:
        """Places alone at the given times (s) with other values; velocities may be missing."""
        code = row_code(self.system, values, self.chosen.assembly)
        if code is not None:
            return code.walked(self.system, values, time)
        return posed(self.system, values, self.chosen.assembly, time)

    def at(
        self,
        time: Number,
        offsets: Mapping[str, Number],
        method: FrictionMethod | None = None,
        zero_slip: Mapping[str, Sense] | None = None,
        travel: Mapping[str, Travel] | None = None,
        rests: Mapping[str, bool] | None = None,
    ) -> Backward:
        """Motion and forces at the given times (s) with the pins at offsets in their holes, as they travel there."""
        conditions = Given(zero_slip or {}, travel=travel or {}, rests=rests or {})
        return self.solve(time, {**self.values, **offsets}, method, conditions, self._past)

    @functools.cached_property
    def ideal(self) -> Run:
        """The mechanism without errors and with every pin in the middle of its hole; this very one if that is so."""
        ideal = self.system.mechanism.ideal_parameters()
        same = all(value is self.values[path] or value == self.values[path] for path, value in ideal.items())
        return self if same else replace(self, values=ideal)

    @functools.cached_property
    def erring(self) -> bool:
        """Whether it is another mechanism than the ideal one."""
        return bool(self.seats) or self.ideal is not self

    @functools.cached_property
    def _past(self) -> dict[str, History]:
        return histories(self.system, self.values, self.chosen.assembly, self.cycle)

    @functools.cached_property
    def _found(self) -> dict[Hashable, Any]:
        return {}

    def once(self, what: Hashable, find: Callable[[], Found]) -> Found:
        """What `find` finds, found once: for what is the same however often and at whatever positions it is run."""
        if what not in self._found:
            self._found[what] = find()
        entry: Found = self._found[what]
        return entry

    @functools.cached_property
    def seats(self) -> list[GivenSeat]:
        """Joints whose pins lie in seats that are given or follow the load."""
        return seats(self.system.mechanism, self.values)

    @functools.cached_property
    def bends(self) -> list[Bend]:
        """Where in the cycle its forces may jump or bend as the model says it, in no order; see `switches`."""
        passed = {time for met in self.chosen.meetings.values() for place in met.at for time in place}
        (stated,) = bends(Mechanisms(self.system, self.chosen.assembly, self.values, [self.cycle]))
        return [*stated, *(Bend(time) for time in sorted(passed))]

    @np.errstate(all="ignore")
    def courses(
        self,
        look: Callable[[NDArray[np.float64]], tuple[NDArray[np.float64], NDArray[np.integer]]],
        bends: Sequence[float] | NDArray[np.float64] | None = None,
        accuracy: Accuracy | None = None,
        like: Callable[[NDArray[np.float64]], NDArray[np.float64]] | None = None,
        joints: int | None = None,
    ) -> Courses:
        """Courses over the cycle; of what stands as if for a second.

        Parameters
        ----------
        look
            Rows, (row, time), and states at some times, s.
        bends
            Times, s, at which rows may jump or bend; those of the mechanism if not given.
        accuracy, like
            See `Courses.many`.
        joints
            Whose numbers a look holds in memory at once; those of the mechanism if not given.
        """
        moves = self.cycle.duration > 0
        times = np.array([bend.time for bend in self.bends] if bends is None else bends, float)
        breaks = breaks_between(self.cycle, times) if moves else np.array([0.0, 1.0])

        def in_blocks(time: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.integer]]:
            parts = blocks(len(time), joints or len(self.system.joints))
            rows, states = zip(*(look(time[part] * moves) for part in parts), strict=True)
            return np.concatenate(rows, axis=1), np.concatenate(states)

        return Courses.of(in_blocks, breaks, like, accuracy_of(self.cycle, accuracy or Accuracy()))

    @functools.cached_property
    def determinacy(self) -> Determinacy | None:
        """What of motion and reactions the joints leave open; None in the plane where the structure decides it."""
        if not self.system.spatial and not any(module.redundant for module in self.system.plan.modules):
            return None
        return look(self.system, self.values, self.chosen, self.cycle)


@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def prepare(mechanism: Mechanism, free: bool = False) -> Run:
    """Decompose a mechanism and choose its assembly. Raises MechanismError if its structure is not determined.

    Done once for each mechanism, which does not change. free: the motion of its free drivers is to be found, so that
    their ranges may last as long as they like.
    """
    free = free and len(mechanism.drivers) > 1  # else it is all the same
    key = "run of free drivers" if free else "run"
    run: Run | None = mechanism.worked_out.get(key)
    if run is None or run.system.mechanism is not mechanism:  # of one that this is a copy of
        run = mechanism.worked_out[key] = _prepared(mechanism, free)
    return run


def _prepared(mechanism: Mechanism, free: bool) -> Run:
    keep_pages()
    system, values = built(mechanism), mechanism.parameters()

    def over(cycle: Cycle) -> Run:
        chosen, inverse = choose(system, values, cycle), system.inverse
        if isinstance(inverse, Inverse):
            more = tuple(finding for finding in inverse.findings if finding not in chosen.findings)
            chosen = replace(chosen, findings=(*chosen.findings, *more))
        return Run(system, values, cycle, chosen)

    run = over(system.cycle(values, None, free))
    if any((turns := _unknown_turns(run)).values()):
        run = over(system.cycle(values, turns, free))
    if isinstance(system.inverse, Inverse):
        system.inverse.check(system, values, run.chosen.assembly)
    while run.chosen.mirrored and run.cycle.turns < COMMON_TURNS:
        run = over(replace(run.cycle, duration=2 * run.cycle.duration, turns=2 * run.cycle.turns))
    return run if _comes_back(run) else over(replace(run.cycle, periodic=False, advances=True))


def built(mechanism: Mechanism) -> System:
    """The mechanism decomposed; with what its drivers do that move other joints than their own."""
    outward = driven_at_outputs(mechanism)
    if outward is None:
        return build(mechanism)
    moves = {name: driver.moves for name, driver in mechanism.drivers.items() if driver.moves}
    try:
        run = prepare(outward)
    except MechanismError as error:
        name, joint = next(iter(moves.items()))
        what = f"the mechanism is not moved by {joint}: {error.findings[0].what}"
        raise MechanismError(Finding(what, f"drivers.{name}.moves", error.findings[0].remedy)) from None
    inverse = Inverse(moves, run.system, run.values, run.cycle, run.chosen.assembly, run.chosen.findings)
    return build(mechanism, inverse)


def _comes_back(run: Run) -> bool:
    """Whether the links are after a period of the drivers where they were, which a nut or rack that goes on is not."""
    threaded = any(joint.pair.threaded for joint in run.system.joints.values())
    racks = any(gear.slides for gear in run.system.mechanism.gears.values())
    if not (run.cycle.periodic and (threaded or racks)):
        return True
    # up to just before the end: there a track begins again
    walk = run.walk(run.cycle.duration * np.array([0.0, 1 - 1e-9]))
    size = float(np.max(primal(run.system.size(run.values))))
    origin = (0.0,) * run.system.mechanism.coordinates
    origins = [walk.algebra.point_of(motion.frame, origin) for motion in walk.motions.values()]
    places = [np.broadcast_to(np.asarray(part, float), 2) for place in origins for part in place]
    return not np.any(np.abs(np.diff(places)) > COMES_BACK * size)


def _unknown_turns(run: Run) -> dict[str, float]:
    """Turns in the cycle of a joint of every chain of gear pairs that no driver turns, from a first walk."""
    mechanism = run.system.mechanism
    turns_of: dict[str, float] = {}
    if not mechanism.gears or not run.cycle.periodic:
        return turns_of
    duration = run.cycle.duration
    for gear in mechanism.gears.values():
        joint = gear.joints[0]
        if gear.slides or joint in run.system.geared_turns(run.values, duration, turns_of):
            continue
        # up to just before the end: there a track begins again
        time = np.linspace(0.0, duration * (1 - 1e-9), TURN_STEPS)
        walk = forward(run.system, run.values, run.chosen.assembly, time)
        first, second = (walk.motions[link].frame for link in run.system.joints[joint].links)
        angle = np.unwrap(np.ravel(rotation((first, second))))
        turns = (angle[-1] - angle[0]) / (2 * np.pi)
        fraction = np.rint(COMMON_TURNS * turns) / COMMON_TURNS
        turns_of[joint] = float(fraction if abs(fraction - turns) < 1e-6 else turns) if np.isfinite(turns) else 0.0
    return turns_of


# ---- memory that is used again ---------------------------------------------------------------------------------


def blocks(count: int, joints: int) -> Iterator[slice]:
    """Parts of some positions that are solved at a time, so that memory does not grow with how many there are."""
    size = max(1, min(CHUNK, JOINTS // max(1, joints)))
    yield from (slice(low, min(low + size, count)) for low in range(0, count, size))


@functools.cache
def keep_pages() -> None:
    """Let the C library keep the pages of arrays that are freed, for the next ones.

    glibc returns freed memory at the top of its heap to the system beyond a threshold of 128 KiB, and what is asked for
    anew then costs a page fault every 4 KiB: half the time of a walk over 20 000 positions. It raises the threshold to
    twice the size of a mapped block that is freed (mallopt(3), M_MMAP_THRESHOLD), here without touching the block. Some
    60 MiB at most stay with the process; other C libraries see an allocation and nothing else.
    """
    with suppress(MemoryError):
        np.empty(BLOCK, np.uint8)
