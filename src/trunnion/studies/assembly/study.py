"""Whether a mechanism whose joints constrain more than its links have freedoms can be put together as it is built.

Its loops close only if the axes fit exactly. Where they do not, pins lie in their holes as the closure asks: of the
offsets of their ends the smallest are looked for that close every loop, position by position (`solve.space.loops`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.dual import primal
from trunnion.algebra.nested import flat
from trunnion.cycle.positions import check_steps
from trunnion.errors import Finding, MechanismError
from trunnion.joints.clearance import CLEARANCE_MODELS
from trunnion.model.arguments import strict_arguments
from trunnion.model.joint_parts import clearance
from trunnion.model.mechanism import Mechanism
from trunnion.solve import shifts
from trunnion.solve.assembly import choose
from trunnion.solve.forward import forward
from trunnion.solve.space.loops import CLOSED, Ask, End, LeastPlay, Loops, Start, ends_of, least_play, start_of
from trunnion.solve.system import Cycle, System, Values, build
from trunnion.studies.assembly.result import ENOUGH, FIGURES, AssemblyStatus, Result, labels

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["FIGURES", "AssemblyStatus", "assemble", "assembled"]

Array = NDArray[np.float64]
Uniform = Literal["pins", "all"]
ROUNDING = 1e-9  # rad, or of the size: an opening below it beside a larger one of the other kind is none
CLOSE = 0.9  # of the largest need: maxima between the positions are looked for beside those above it
MOST_TOPS = 4
BETWEEN, NARROWED = 9, 5  # points in the interval around a maximum, and how often it is narrowed to a quarter


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def assemble(
    mechanism: Mechanism,
    steps: int = 360,
    uniform: Uniform = "pins",
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """Whether the stated clearances take up the errors of a mechanism, and the smallest clearance that would.

    steps: equally spaced positions of the cycle. uniform: what has one and the same clearance where the smallest is
    looked for: all pins with a play (all pins, if no play is stated), other plays as stated; or "all" kinds of play.
    Returns a Dataset with the variables of `FIGURES`; `smallest_clearance` (m) is the largest need of the whole cycle,
    between the positions too. `status`: see `AssemblyStatus`.
    progress: called with the number of positions done.
    Raises MechanismError for a play without a length, or a structure that leaves a freedom undetermined.
    """
    return assembled(mechanism, mechanism.parameters(), mechanism.ideal_parameters(), steps, uniform, progress)


def assembled(
    mechanism: Mechanism,
    values: Values,
    ideal: Values,
    steps: int = 360,
    uniform: Uniform = "pins",
    progress: Callable[[int], None] | None = None,
) -> xr.Dataset:
    """What `assemble` does, with the numbers as built and those without errors given."""
    check_steps(steps)
    system = build(mechanism)
    cycle = system.cycle(values)
    time = cycle.times(steps if cycle.duration > 0 else 1)
    if not any(module.redundant for module in system.plan.modules):
        result = _regular(system, values, cycle, time)
    else:
        result = AssemblyStudy.of(system, values, ideal, cycle, uniform).result(time)
    if progress:
        progress(len(time))
    return result.dataset()


def _regular(system: System, values: Values, cycle: Cycle, time: Array) -> Result:
    """Every loop has as many equations as coordinates: it closes as it is, or not at all."""
    chosen = choose(system, values, cycle)
    walk = forward(system, values, chosen.assembly, time)
    there = np.ones(len(time), bool)
    for pose in walk.poses:
        for frame in pose.frames:
            there &= np.isfinite(sum(primal(number) for number in flat(frame)))
    result = Result(system, values, time, list(chosen.findings))
    for name in ("needed_share", "needed_clearance", "open_angle", "open_length", "certificate", "closure_residual"):
        result.arrays[name] = np.where(there, 0.0, np.nan)
    result.arrays["status"] = np.where(there, AssemblyStatus.FITS, AssemblyStatus.APART).astype(np.int8)
    plane = "in the plane no joint constrains twice" if system.mechanism.space == "planar" else ""
    what = plane or "its joints constrain no more than its links have freedoms"
    result.findings.append(
        Finding.note("assembly.no_need", "joints", f"{what}: errors only shift its links, so it needs no clearance")
    )
    result.tell()
    return result


@dataclass(frozen=True)
class AssemblyStudy:
    """An over-constrained mechanism with its errors, the plays that it states, and those of the smallest clearance.

    evened: for each end of `pins`, whether its play is the clearance that is looked for; the others stay.
    """

    system: System
    values: Values
    cycle: Cycle
    start: Start
    stated: tuple[End, ...]
    pins: tuple[End, ...]
    evened: tuple[bool, ...]
    findings: tuple[Finding, ...]

    @classmethod
    def of(cls, system: System, values: Values, ideal: Values, cycle: Cycle, uniform: Uniform) -> AssemblyStudy:
        stated = tuple(ends_of(system, values, every_pin=False))
        every = not any(end.pin for end in stated) and not (uniform == "all" and stated)
        pins = tuple(ends_of(system, values, every_pin=every))
        evened = tuple(end.pin or uniform == "all" for end in pins)
        start, findings = start_of(system, values, ideal, cycle)
        return cls(system, values, cycle, start, stated, pins, evened, tuple(findings))

    def solve(self, time: Array, stated: bool) -> LeastPlay:
        """The least share of the stated plays, or the smallest clearance, at times; ∞ where no play is there."""
        ends = self.stated if stated else self.pins
        radii = np.array([end.radius for end in ends])
        evened = np.array(self.evened, float)
        base, share = (np.zeros(len(ends)), radii) if stated else (radii * (1 - evened), evened)
        ask = Ask(base, share, tuple(len(end.axes) for end in ends))
        loops, none = Loops.of(self.system, self.values, ends, time), np.zeros((len(time), sum(ask.widths)))
        with np.errstate(all="ignore"):
            q, gap = loops.least_open(self.start(time), none)
            fits = gap <= CLOSED
            if not ends or np.all(fits | np.isnan(gap)):
                least = np.where(np.isnan(gap), np.nan, np.where(fits, 0.0, np.inf))
                return LeastPlay(least, least, q, none, np.zeros((len(time), len(ends))), gap, 0)
            found = least_play(loops, q, none, ask)
        # what is found where it closes as it is is rounding
        found.least[fits], found.bound[fits], found.offsets[fits], found.weights[fits] = 0.0, 0.0, 0.0, 0.0
        return found

    def result(self, time: Array) -> Result:
        """The whole answer."""
        result = Result(self.system, self.values, time, list(self.findings))
        even = [end for end, evened in zip(self.pins, self.evened, strict=True) if evened]
        result.of, result.pins = ", ".join(dict.fromkeys(end.joint for end in even)), all(end.pin for end in even)
        result.played, result.nil = bool(self.stated), _nil(self.system, self.values)
        arrays, (there, opened) = result.arrays, self._open(result)
        if not np.any(opened):
            return self._fitting(result, there)
        _check_lengths(self.system, self.values, self.pins)
        shares, needs = self.solve(time, stated=True), self.solve(time, stated=False)
        for found, ends, name in ((shares, self.stated, "stated"), (needs, self.pins, "uniform")):
            self._place(found, ends, arrays[f"{name}_offset"], arrays[f"{name}_part"])
        arrays["needed_share"], arrays["needed_clearance"] = share, _ = shares.least, needs.least
        arrays["closure_residual"] = _worst(shares, needs, lambda one: one.opening)
        arrays["certificate"] = _worst(
            shares, needs, lambda one: (one.least - one.bound) / np.where(one.least > 0, one.least, 1.0)
        )
        status = np.where(
            np.isinf(share), AssemblyStatus.RIGID, np.where(share > ENOUGH, AssemblyStatus.SHORT, AssemblyStatus.FITS)
        )
        status = np.where(np.isnan(share) | np.isnan(needs.least), AssemblyStatus.UNSETTLED, status)
        arrays["status"] = np.where(there, status, AssemblyStatus.APART).astype(np.int8)
        result.share = self._largest(time, share, stated=True)
        result.clearance = self._largest(time, needs.least, stated=False)
        result.tell()
        return result

    def _fitting(self, result: Result, there: NDArray[np.bool_]) -> Result:
        """The answer where the loops close without any play."""
        for name in ("needed_share", "needed_clearance", "certificate", "closure_residual"):
            result.arrays[name] = np.where(there, 0.0, np.nan)
        for ends, name in ((self.stated, "stated"), (self.pins, "uniform")):
            none = np.zeros((len(there), sum(len(end.axes) for end in ends)))
            found = LeastPlay(
                result.arrays["needed_share"], none, none, none, np.zeros((len(there), len(ends))), none, 0
            )
            self._place(found, ends, result.arrays[f"{name}_offset"], result.arrays[f"{name}_part"])
        result.arrays["status"] = np.where(there, AssemblyStatus.FITS, AssemblyStatus.APART).astype(np.int8)
        result.tell()
        return result

    def _open(self, result: Result) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """How far the loops are open where they are so least without play, in angle and in length.

        Returns where they exist, and where they are open.
        """
        time = result.time
        loops, none = Loops.of(self.system, self.values, (), time), np.zeros((len(time), 0))
        with np.errstate(all="ignore"):
            q, gap = loops.least_open(self.start(time), none)
            rows = loops.linear(q, none).gap[:, : 6 * len(loops.group.chords)].reshape(len(time), -1, 2, 3)
        rows = np.where((gap <= CLOSED)[:, None, None, None], 0.0, rows)  # rounding
        sizes = np.max(np.linalg.norm(rows, axis=-1), axis=1)
        sizes[(sizes < ROUNDING) & (sizes < np.max(sizes, axis=1, keepdims=True))] = 0.0
        result.arrays["open_angle"], result.arrays["open_length"] = sizes[:, 0], sizes[:, 1] * loops.size
        return np.isfinite(gap), gap > CLOSED

    def _place(self, found: LeastPlay, ends: Sequence[End], offsets: Array, parts: Array) -> None:
        """Offsets and parts of the ends at their places in the result."""
        joints, column = labels(self.system)["joint"], 0
        solved = np.isfinite(found.least)
        for k, end in enumerate(ends):
            joint = joints.index(end.joint)
            parts[joint, end.number] = np.where(solved, found.weights[:, k], np.nan)
            for axis in end.axes:
                offsets[joint, end.number, "xyz".index(axis)] = np.where(solved, found.offsets[:, column], np.nan)
                column += 1

    def _largest(self, time: Array, needs: Array, stated: bool) -> tuple[float, float]:
        """The largest need of the cycle and its time: between the positions too, beside the largest of them."""
        known = np.where(np.isnan(needs), -np.inf, needs)
        top = int(np.argmax(known))
        if not np.all(np.isfinite(needs)) or len(time) < 3 or not known[top] > 0:
            return float(needs[top]) if np.all(~np.isnan(needs)) else float("nan"), float(time[top])
        high = (known >= np.roll(known, 1)) & (known >= np.roll(known, -1)) & (known >= CLOSE * known[top])
        tops = np.flatnonzero(high)
        tops = tops[np.argsort(-known[tops], kind="stable")][:MOST_TOPS]
        reach = float(time[1] - time[0])
        best, most = time[tops], known[tops]
        for _ in range(NARROWED):
            near = best[:, None] + reach * np.linspace(-1, 1, BETWEEN)
            near = near if self.cycle.periodic else np.clip(near, 0.0, self.cycle.duration)
            found = np.nan_to_num(self.solve(near.ravel(), stated).least.reshape(near.shape), nan=-np.inf)
            place = np.argmax(found, axis=1)[:, None]
            better = np.take_along_axis(found, place, 1)[:, 0]
            best = np.where(better > most, np.take_along_axis(near, place, 1)[:, 0], best)
            most, reach = np.maximum(most, better), reach / 4
        top = int(np.argmax(most))
        return float(most[top]), float(best[top])


def _nil(system: System, values: Values) -> bool:
    """Whether any joint states a clearance of 0."""
    stated = (clearance(name, values) for name in system.joints)
    return any(one is not None and np.all(primal(one) == 0) for one in stated)


def _worst(one: LeastPlay, other: LeastPlay, of: Callable[[LeastPlay], Array]) -> Array:
    """The larger of a number of two searches, of those that have an answer."""
    with np.errstate(invalid="ignore"):
        rows = [np.where(np.isfinite(found.least), of(found), -np.inf) for found in (one, other)]
    most = np.maximum(*rows)
    return np.where(np.isfinite(most), most, np.nan)


def _check_lengths(system: System, values: Values, ends: Sequence[End]) -> None:
    """MechanismError for every play that has no length over which a pin or guide could lean."""
    findings = []
    for name in dict.fromkeys(end.joint for end in ends):
        model = CLEARANCE_MODELS["spatial"][system.joints[name][0]]
        if model.size and not np.all(primal(shifts.length_of(model, values, name)) > 0):
            part, keys = model.size
            what = f"how far the {part} can lean in its play depends on its length, which is not stated"
            findings.append(Finding(what, f"joints.{name}.{part}", f"state {' or '.join(keys)}: 20 mm"))
    if findings:
        raise MechanismError(findings)
