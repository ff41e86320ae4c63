"""The main question: how does it move, what force is in each joint, what drives it, where does the power go."""

from __future__ import annotations

import functools
import operator
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion import results
from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number
from trunnion.algebra.nested import flat
from trunnion.analysis import account, contact_loss, diagnosis, rest
from trunnion.analysis.asbuilt import COMPARED, fill_errors, fill_seats
from trunnion.analysis.blanks import blank
from trunnion.analysis.branches import Chosen, choose
from trunnion.analysis.bristles import History, histories
from trunnion.analysis.engine import build
from trunnion.analysis.friction import FrictionMethod
from trunnion.analysis.kinematics import Forward, Travel, forward
from trunnion.analysis.kinetostatics import Backward, Given, Sense, solve
from trunnion.analysis.means import AVERAGED, Means, means_of, still
from trunnion.analysis.quadrature import Effort
from trunnion.analysis.seating import Seat, seats, settle
from trunnion.analysis.space.determinacy import Determinacy
from trunnion.analysis.switches import Mechanisms, edges
from trunnion.analysis.system import COMMON_TURNS, Cycle, System, Values, sticking
from trunnion.analysis.travel import Lanes, around, lanes
from trunnion.errors import Finding, MechanismError, Status
from trunnion.groups.gear import rotation
from trunnion.model.mechanism import Mechanism

if TYPE_CHECKING:
    import xarray as xr

__all__ = [
    "Positions",
    "Run",
    "analyse",
    "analyse_run",
    "check_steps",
    "filled",
    "pose_status",
    "positions",
    "prepare",
    "status_of",
]

CHUNK = 8192  # positions at a time: the arrays of a walk stay in cache
MOST_STEPS = 100_000_000
SINGULAR = 1e6  # condition from which less than about four digits would be left
TURN_STEPS = 720
NEAR_SINGULAR = 100.0  # a transmission angle of about a degree
SEATED = Effort(1e-6, 2)  # for means with pins in seats, which themselves settle to 1e-6 of their clearance

Arrays = dict[str, NDArray[np.float64]]


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
        zero_slip: Mapping[str, Sense] | None = None,
    ) -> Backward:
        """Motion and forces at the given times (s), nominal or with other values; see `kinetostatics.solve`.

        zero_slip: see `kinetostatics.Given`.
        """
        values = self.values if values is None else values
        past = self._past if values is self.values else self._histories(values)
        return self._solve(time, values, past, method, zero_slip)

    def walk(self, time: Number) -> Forward:
        """Motion alone at the given times (s)."""
        return forward(self.system, self.values, self.chosen.assembly, time)

    def _solve(
        self,
        time: Number,
        values: Values,
        past: Mapping[str, History],
        method: FrictionMethod | None,
        zero_slip: Mapping[str, Sense] | None = None,
        travel: Mapping[str, Travel] | None = None,
    ) -> Backward:
        deflections = {joint: history.at(time) for joint, history in past.items()}
        given = Given(zero_slip or {}, deflections, travel or {})
        return solve(self.system, values, self.chosen.assembly, time, method, given)

    def at(
        self,
        time: Number,
        offsets: Mapping[str, Number],
        method: FrictionMethod | None = None,
        zero_slip: Mapping[str, Sense] | None = None,
        travel: Mapping[str, Travel] | None = None,
    ) -> Backward:
        """Motion and forces at the given times (s) with the pins at offsets in their holes, as they travel there."""
        return self._solve(time, {**self.values, **offsets}, self._past, method, zero_slip, travel)

    def ideal(self, time: Number, method: FrictionMethod | None = None) -> Backward:
        """Motion and forces at the given times (s) without errors and with every pin in the middle of its hole."""
        return self._solve(time, self.ideal_values, self._ideal_past, method)

    @functools.cached_property
    def seats(self) -> list[Seat]:
        """Joints whose pins lie in seats that are given or follow the load."""
        return seats(self.system, self.values)

    @functools.cached_property
    def edges(self) -> NDArray[np.float64]:
        """Times, s, from the start to the end of the cycle, between which its forces are smooth; see `switches`."""
        return edges(Mechanisms(self.system, self.chosen.assembly, self.values, [self.cycle]))[0]

    @property
    def ideal_values(self) -> Values:
        """The numbers of the mechanism without errors."""
        return self.values if self._ideal_values is None else self._ideal_values

    @functools.cached_property
    def _ideal_values(self) -> Values | None:
        """The numbers of the ideal mechanism; None if they are those of the mechanism itself."""
        ideal = self.system.mechanism.ideal_parameters()
        same = all(value is self.values[path] or value == self.values[path] for path, value in ideal.items())
        return None if same else ideal

    @functools.cached_property
    def erring(self) -> bool:
        """Whether it is another mechanism than the ideal one."""
        return bool(self.seats) or self._ideal_values is not None

    @functools.cached_property
    def _ideal_past(self) -> dict[str, History]:
        return self._past if self._ideal_values is None else self._histories(self._ideal_values)

    def _histories(self, values: Values) -> dict[str, History]:
        with np.errstate(all="ignore"):
            return histories(self.system, values, self.chosen.assembly, self.cycle)

    @functools.cached_property
    def determinacy(self) -> Determinacy | None:
        """What of motion and reactions the joints leave open; None in the plane, where the structure decides it."""
        found: Determinacy | None = self.system.engine.determinacy(self.system, self.values, self.chosen, self.cycle)
        return found

    @functools.cached_property
    def _past(self) -> dict[str, History]:
        """Histories of the bristles at the nominal values."""
        return self._histories(self.values)


@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
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


@np.errstate(all="ignore")
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
    check_steps(steps)
    run = prepare(mechanism)
    if run.determinacy is not None:
        run.determinacy.refuse()
    return analyse_run(run, steps, method, progress)


def check_steps(steps: int) -> None:
    if not isinstance(steps, (int, np.integer)) or not 1 <= steps <= MOST_STEPS:
        remedy = f"give a whole number from 1 to {MOST_STEPS:,}"
        raise MechanismError(Finding(f"cannot analyse {steps} positions", "steps", remedy))


@np.errstate(all="ignore")
def analyse_run(
    run: Run,
    steps: int = 360,
    method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """What `analyse` does, for a mechanism that is prepared."""
    found = positions(run, steps, method, progress)
    return account.finish(run, found)


@dataclass(frozen=True)
class Positions:
    """What every position of a cycle came to, before the books of the cycle are made of it.

    means: over the cycle; ideal: those of the mechanism without errors, if it has any; losses: of contact.
    """

    arrays: Arrays
    labels: dict[str, list[str]]
    time: NDArray[np.float64]
    method: FrictionMethod
    causes: diagnosis.Causes
    means: Means
    ideal: Means | None
    losses: list[contact_loss.Loss]


def positions(
    run: Run,
    steps: int = 360,
    method: FrictionMethod | None = None,
    progress: Callable[[int], None] | None = None,
    margin: bool = True,
    averaged: bool = True,
) -> Positions:
    """The numbers of every variable of `results` at equally spaced positions, their statuses and causes.

    margin: whether the locking margin is looked for; it is infinite if not. averaged: whether the means over the cycle
    are, which ask for many positions more; they are NaN if not.
    """
    check_steps(steps)
    _refuse_seats(run)
    method = replace(method or FrictionMethod(), margin_up_to=account.MARGIN if margin else 0.0)
    steps = steps if run.cycle.duration > 0 else 1
    time = run.cycle.times(steps)
    labels = run.system.engine.labels(run.system) | ({"end": ["1", "2"]} if run.seats else {})
    parts = [part for part, there in (("seats", run.seats), ("errors", run.erring)) if there]
    arrays = results.allocate(labels, steps, run.system.engine.absent(run.system), parts)
    causes = diagnosis.Causes(run.system)
    ideal = {name: np.zeros(arrays[name].shape, arrays[name].dtype) for name in IDEAL} if run.erring else {}
    for low in range(0, steps, CHUNK):
        window = slice(low, min(low + CHUNK, steps))
        if run.erring:
            _fill_as_built(arrays, ideal, run, time, window, method, causes)
        else:
            _fill(arrays, run.solve(time[window], method=method), time[window], window, causes)
        if progress:
            progress(window.stop)
    quick = replace(method, margin_up_to=0.0)  # the margin is known by now
    rest.bracket(arrays, run, time, quick, causes.zero_slip(), causes.seats())
    losses = contact_loss.find(arrays, run, time) if run.seats else []
    run.system.engine.unwrap(arrays, run.system, run.values, time)

    means = _means(run, arrays, quick) if averaged else still(arrays)
    meant = (_means(run, ideal, quick, ideal=True) if averaged else still(ideal)) if run.erring else None
    return Positions(arrays, labels, time, method, causes, means, meant, losses)


def _means(run: Run, arrays: Arrays, method: FrictionMethod, ideal: bool = False) -> Means:
    """Means over the cycle; NaN where a position has no answer. ideal: of the mechanism without errors."""
    of = Mechanisms(run.system, run.chosen.assembly, run.ideal_values if ideal else run.values, [run.cycle])
    if run.cycle.duration <= 0 or np.any(arrays["status"] >= Status.NOT_CONVERGED):
        return still(arrays)
    if ideal or not run.seats:
        look = run.ideal if ideal else run.solve
        between = None if ideal else [run.edges]
        return means_of(of, lambda rows, time: _powers(look(time.ravel(), method=method), time), between)[0]
    gaps = contact_loss.gaps(run)

    def seated(rows: NDArray[np.intp], time: NDArray[np.float64]) -> Arrays:
        seen = around(time.ravel(), run.cycle)
        found = settle(run, seen, method, run.ideal(seen.times, method))
        valid = contact_loss.valid(found, run, gaps, time.ravel()).reshape(time.shape)
        # a gap left out would weigh the rest of the cycle otherwise: play changes little of what flows there
        meant = _powers(run.ideal(time.ravel(), method=method), time)
        return {name: np.where(valid, array, meant[name]) for name, array in _powers(found.back, time).items()}

    between = [np.unique(np.concatenate([run.edges, np.clip(gaps.ravel(), 0.0, run.cycle.duration)]))]
    return means_of(of, seated, between, SEATED)[0]


def _powers(back: Backward, time: NDArray[np.float64]) -> Arrays:
    """What means are made of, (…, lane, node), from a walk at all these times in a row."""
    arrays, _ = filled(back, None, time.ravel(), (1, time.size), AVERAGED)
    return {name: arrays[name].reshape(*arrays[name].shape[:-2], *time.shape) for name in AVERAGED}


def _refuse_seats(run: Run) -> None:
    """MechanismError where pins lie in seats of a module that closes with special dimensions only."""
    seated = {seat.joint for seat in run.seats}
    for module in run.system.plan.modules:
        names = [name for name in module.joints if name in seated]
        if module.redundant and names:
            what = f"the links {', '.join(module.links)} are over-constrained: seats by loads do not close them"
            remedy = "analyse it with --seat free; `trunnion assemble` tells what its play takes up"
            raise MechanismError(Finding(what, f"joints.{names[0]}.seat", remedy))


IDEAL = (*AVERAGED, "status")  # what the means of the ideal mechanism are made of


def _fill_as_built(
    arrays: Arrays,
    ideal: Arrays,
    run: Run,
    time: NDArray[np.float64],
    window: slice,
    method: FrictionMethod,
    causes: diagnosis.Causes,
) -> None:
    """One chunk of a mechanism with errors beside the ideal one."""
    part, quick = time[window], replace(method, margin_up_to=0.0)
    labels = run.system.engine.labels(run.system)
    seen = lanes(part, run.cycle) if run.seats else Lanes(part, np.arange(len(part)), 0)
    scratch = results.allocate(
        labels, len(seen.times), run.system.engine.absent(run.system), wanted={*IDEAL, *COMPARED}
    )
    meant = run.ideal(seen.times, quick)
    _fill(scratch, meant, seen.times, slice(0, len(seen.times)))
    own = slice(int(seen.own[0]), int(seen.own[-1]) + 1)
    scratch = {name: array[..., own] for name, array in scratch.items()}
    for name, array in ideal.items():
        array[..., window] = scratch[name]
    if run.seats:
        seated = settle(run, seen, method, meant)
        causes.note_seats(seated.offsets, seated.sticks, window.start)
        _fill(arrays, seated.back, part, window, causes)
        fill_seats(arrays, run.seats, seated, window)
        status = arrays["status"][window]
        np.maximum(status, np.where(seated.sticks, status.dtype.type(Status.ZERO_SLIP), 0), out=status)
    else:
        _fill(arrays, run.solve(part, method=method), part, window, causes)
    fill_errors(arrays, scratch, _link_numbers(run.system), window)
    blank(arrays, arrays["status"][window].astype(np.int8), window)


def filled(
    back: Backward,
    meant: Backward | None,
    time: NDArray[np.float64],
    shape: tuple[int, int],
    wanted: Collection[str],
) -> tuple[Arrays, Arrays]:
    """Variables of `results` by name, (…, mechanism, position), of one walk over many mechanisms; the same of `meant`.

    meant: the walk of the mechanisms without errors, if any has some; the first arrays then hold the differences too.
    time: (mechanism, position) or (position,), s; wanted: what will be read, of the rest there is nothing.
    """
    system, everything = back.walk.system, slice(None)
    if meant is None:
        arrays = _of_many(system, shape, {*wanted, "status"}, [])
        _fill(arrays, back, time, everything)
        return arrays, {}
    arrays, ideal = (_of_many(system, shape, {*wanted, *IDEAL, *COMPARED}, ["errors"]) for _ in range(2))
    _fill(arrays, back, time, everything)
    _fill(ideal, meant, time, everything)
    fill_errors(arrays, ideal, _link_numbers(system), everything)
    blank(arrays, arrays["status"].astype(np.int8), everything)
    return arrays, ideal


def _of_many(system: System, shape: tuple[int, int], wanted: Collection[str], parts: Sequence[str]) -> Arrays:
    """Arrays to be filled, (…, mechanism, position)."""
    labels, absent = system.engine.labels(system), system.engine.absent(system)
    flat = results.allocate(labels, shape[0] * shape[1], absent, parts, wanted)
    return {name: array.reshape(*array.shape[:-1], *shape) for name, array in flat.items()}


def _link_numbers(system: System) -> list[tuple[int, int]]:
    """Numbers of the links of every joint."""
    links = system.engine.labels(system)["link"]
    return [(links.index(first), links.index(second)) for _, (first, second) in system.joints.values()]


def _fill(
    arrays: Arrays,
    back: Backward,
    time: NDArray[np.float64],
    window: slice,
    causes: diagnosis.Causes | None = None,
) -> None:
    """Write one chunk into the result; what a status rules out becomes NaN."""
    status = status_of(back, arrays["status"][window].shape)
    arrays["status"][window] = status
    if causes:
        causes.note(back, status, window.start)
    with np.errstate(all="ignore"):
        engine = back.walk.system.engine
        engine.fill_motion(arrays, back, window)
        engine.fill_forces(arrays, back, window)
        _fill_settled(arrays, back, window)
        account.fill_power(arrays, back, time, window)
    blank(arrays, status, window)


def status_of(back: Backward, shape: tuple[int, ...]) -> NDArray[np.int8]:
    """The gravest status of every position."""
    return _of_shape(status_number(back), shape)


def pose_status(walk: Forward, shape: tuple[int, ...]) -> NDArray[np.int8]:
    """The gravest status of every position that its motion alone decides."""
    return _of_shape(pose_status_number(walk), shape)


def _of_shape(status: Number, shape: tuple[int, ...]) -> NDArray[np.int8]:
    return np.array(np.broadcast_to(status, shape), np.int8)


def status_number(back: Backward) -> Number:
    """The gravest status in whatever shape the numbers of the walk have."""
    walk = back.walk
    status = pose_status_number(walk)

    def raised(code: Status, where: Number) -> Number:
        return np.maximum(status, np.where(where, np.int8(code), np.int8(0)))

    for name in sticking(walk.system):
        status = raised(Status.ZERO_SLIP, back.slips[name].zero)
    for settled in back.settled:
        status = raised(Status.NOT_CONVERGED, np.logical_not(settled.converged))
        status = raised(Status.LOCKED, np.less(settled.share, 1.0))
    status = raised(Status.NOT_CONVERGED, ~np.isfinite(_sum_of_forces(back)))
    for undefined in back.undefined.values():
        status = raised(Status.LOAD_UNDEFINED, undefined)
    return status


def pose_status_number(walk: Forward) -> Number:
    """The gravest status that the motion alone decides, in whatever shape its numbers have."""
    placed: Number = True
    condition = worst_condition(walk)
    for pose in walk.poses:
        for frame in pose.frames:
            placed = placed & np.isfinite(_sum(flat(frame)))
    status = np.where(condition > NEAR_SINGULAR, np.int8(Status.NEAR_SINGULAR), np.int8(Status.SOLVED))
    status = np.where(condition <= SINGULAR, status, np.int8(Status.SINGULAR))
    return np.where(placed, status, np.int8(Status.NOT_ASSEMBLED))


def worst_condition(walk: Forward) -> Number:
    """Largest condition of a module."""
    parts = (primal(group.condition(pose)) for group, pose in zip(walk.system.groups, walk.poses, strict=True))
    return functools.reduce(np.maximum, parts, 1.0)


def _sum_of_forces(back: Backward) -> Number:
    """Finite where every reaction and effort is."""
    reactions = (number for reaction in back.reactions.values() for number in flat(tuple(reaction)[:2]))
    return _sum((*back.efforts.values(), *back.friction.values(), *reactions))


def _sum(numbers: Iterable[Number]) -> Number:
    """Without derivatives: whether it is finite is what is asked for."""
    return functools.reduce(operator.add, (primal(number) for number in numbers), 0.0)


def _fill_settled(arrays: Arrays, back: Backward, window: slice) -> None:
    """Figures of the friction iteration."""
    settled = back.settled
    for key, field in (
        ("friction_iterations", "iterations"),
        ("friction_change", "change"),
        ("friction_residual", "residual"),
        ("friction_contraction", "contraction"),
    ):
        worst = functools.reduce(np.maximum, (getattr(one, field) for one in settled), 0.0)
        arrays[key][window] = worst
    arrays["locking_margin"][window] = functools.reduce(np.minimum, (one.margin for one in settled), np.inf)
