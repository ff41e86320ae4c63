"""Why a position has no answer, told over the cycle: cause, interval, figure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.cycle.locking_states import LockingState
from trunnion.errors import Finding, Status
from trunnion.groups.dyad import DyadPose
from trunnion.results.scales import Scales
from trunnion.results.sentences import finding_for
from trunnion.solve.backward import Backward
from trunnion.solve.forward import Forward
from trunnion.solve.system import Dial, Positions, System, rubbing, sticking

__all__ = ["Causes", "findings"]

CLASS_TWO = 2
NEGLIGIBLE = 1e-3  # of the largest effort of a driver: an interval of its effort that is less is no finding


class Locking(Protocol):
    """What is known of locking over the cycle: its states, and the joint that decides with the multiple of it."""

    def all_states(self) -> set[LockingState]: ...
    def responsible(self) -> tuple[str, float] | None: ...


class _Open(NamedTuple):
    """Positions at which one module does not close, and for each possible reason by how much (m) it holds there."""

    module: int
    positions: Positions
    reasons: dict[str, NDArray[np.float64]]


@dataclass
class Causes:
    """Collects, chunk by chunk, what the findings need to say."""

    system: System
    _open: list[_Open] = field(default_factory=list)
    _zero: dict[str, list[Positions]] = field(default_factory=dict)
    _locked: dict[int, list[tuple[Positions, NDArray[np.float64]]]] = field(default_factory=dict)
    _singular: dict[int, list[Positions]] = field(default_factory=dict)
    _undefined: dict[str, list[Positions]] = field(default_factory=dict)
    _stuck: list[Positions] = field(default_factory=list)

    def note(self, back: Backward, status: NDArray[np.int8], places: Positions) -> None:
        """Look at some positions, by their numbers in the cycle."""
        if np.any(status == Status.NOT_ASSEMBLED):
            self._note_open(back.walk, status, places)
        for name in sticking(self.system):
            zero = np.broadcast_to(back.slips[name].zero, status.shape) & (status < Status.NOT_CONVERGED)
            if np.any(zero):
                self._zero.setdefault(name, []).append(places[np.flatnonzero(zero)])
        if np.any(status == Status.LOAD_UNDEFINED):
            for path, where in back.undefined.items():
                bad = np.broadcast_to(where, status.shape) & (status == Status.LOAD_UNDEFINED)
                if np.any(bad):
                    self._undefined.setdefault(path, []).append(places[np.flatnonzero(bad)])
        if np.any(status == Status.SINGULAR):
            self._note_singular(back.walk, status, places)
        if np.any(status == Status.LOCKED):
            modules = reversed(range(len(back.settled)))  # settled from the last module to the first
            for number, settled in zip(modules, back.settled, strict=True):
                share = np.broadcast_to(settled.share, status.shape)
                locked = np.flatnonzero((share < 1.0) & (status == Status.LOCKED))
                if len(locked):
                    self._locked.setdefault(number, []).append((places[locked], share[locked]))

    def note_sticking(self, positions: Positions) -> None:
        """Keep where joints stick while pins travel."""
        self._stuck.append(positions)

    def stuck(self) -> Positions:
        """Positions at which only the travel of seats decides the sense of a friction."""
        return np.concatenate(self._stuck) if self._stuck else np.zeros(0, np.intp)

    def _note_singular(self, walk: Forward, status: NDArray[np.int8], places: Positions) -> None:
        """The module whose condition is the worst at each singular position."""
        conditions = [
            np.broadcast_to(np.nan_to_num(group.condition(pose), nan=np.inf), status.shape)
            for group, pose in zip(walk.system.groups, walk.poses, strict=True)
        ]
        worst = np.argmax(conditions, axis=0)
        for number in range(len(conditions)):
            here = np.flatnonzero((status == Status.SINGULAR) & (worst == number))
            if len(here):
                self._singular.setdefault(number, []).append(places[here])

    def singular(self) -> dict[int, Positions]:
        """Singular positions by module."""
        return {number: np.concatenate(parts) for number, parts in self._singular.items()}

    def _note_open(self, walk: Forward, status: NDArray[np.int8], places: Positions) -> None:
        """The first module of each unassembled position that does not close, and by how much."""
        left = status == Status.NOT_ASSEMBLED
        for number, pose in enumerate(walk.poses):
            bad = np.zeros(status.shape, bool)
            for frame in pose.frames:
                bad |= ~np.isfinite(np.broadcast_to(_sum(frame), status.shape))
            here = np.flatnonzero(bad & left)
            left = left & ~bad
            if not len(here):
                continue
            reasons = {
                text: np.broadcast_to(figure, status.shape)[here] for text, figure in _shortfalls(walk, number).items()
            }
            self._open.append(_Open(number, places[here], reasons))

    def zero_slip(self) -> dict[str, Positions]:
        """Positions at which the relative speed of a joint with friction is zero."""
        return {name: np.concatenate(parts) for name, parts in self._zero.items()}

    def undefined(self) -> dict[str, Positions]:
        """Positions at which a load or spring, by path, has no value."""
        return {path: np.concatenate(parts) for path, parts in self._undefined.items()}

    def open_modules(self) -> dict[int, _Open]:
        """What each module that does not close everywhere said, over the whole cycle."""
        merged: dict[int, _Open] = {}
        for number in sorted({part.module for part in self._open}):
            parts = [part for part in self._open if part.module == number]
            reasons = {text: np.concatenate([part.reasons[text] for part in parts]) for text in parts[0].reasons}
            merged[number] = _Open(number, np.concatenate([part.positions for part in parts]), reasons)
        return merged

    def locked(self) -> dict[int, tuple[Positions, NDArray[np.float64]]]:
        """Positions at which a module locks and the share of the friction at which it does."""
        return {
            number: (np.concatenate([p for p, _ in parts]), np.concatenate([s for _, s in parts]))
            for number, parts in self._locked.items()
        }


def _sum(frame: Any) -> Number:
    """A number that is finite where every number of a frame is: of a planar one (x, y, c, s), of one of vectors."""
    return sum(_sum(part) if isinstance(part, tuple) else part for part in frame)


def findings(
    causes: Causes,
    dial: Dial,
    status: NDArray[Any],
    condition: NDArray[np.float64],
    efforts: dict[str, tuple[NDArray[np.float64], NDArray[np.float64], str]],
    margin: NDArray[np.float64],
    scales: Scales,
    near: Locking | None = None,
    felt: Sequence[str] | None = None,
) -> list[Finding]:
    """One finding for each cause. efforts: least and largest effort and unit of every driver; margin: multiple of all
    friction at which a position locks; felt: joints with friction that is not 0, all that have a law if not given;
    scales: beside which an effort may be rounding."""
    felt = rubbing(causes.system) if felt is None else felt
    found = [_not_assembled(causes, dial, part) for part in causes.open_modules().values()]
    stuck = causes.stuck()
    stuck = stuck[status[stuck] == Status.ZERO_SLIP]
    if len(stuck):
        found.append(finding_for("friction.sense", "joints", at=dial.intervals(stuck)))
    for number, singular in causes.singular().items():
        module = causes.system.plan.modules[number]
        kind = "dead centre (singular position)" if module.rank == CLASS_TWO else "singular position"
        where, most = f"links {', '.join(module.links)}", _most(condition[singular])
        found.append(
            finding_for("position.singular", where, at=dial.intervals(singular), condition=most, phrases={"kind": kind})
        )
    for path, positions in causes.undefined().items():
        code = "load.undefined" if path.startswith("loads.") else "spring.undefined"
        found.append(finding_for(code, path, at=dial.intervals(positions)))
    for number, (positions, share) in causes.locked().items():
        whole = float(np.nanmin(margin[positions], initial=np.inf))
        found.append(_locked(causes.system, dial, number, positions, share, whole, near, felt))
    late = np.flatnonzero(status == Status.NOT_CONVERGED)
    if len(late):
        found.append(finding_for("friction.not_converged", "joints", at=dial.intervals(late)))
    close = np.flatnonzero(status == Status.NEAR_SINGULAR)
    if len(close):
        found.append(
            finding_for("position.near_singular", "links", at=dial.intervals(close), condition=_most(condition[close]))
        )
    holding = {*felt, *causes.system.resisted}  # without friction either way is the same
    for joints, positions in _together({name: at for name, at in causes.zero_slip().items() if name in holding}):
        if not efforts or any(_matters(positions, *effort, scales) for effort in efforts.values()):
            found.append(_zero_slip(dial, joints, positions, efforts))
    return found


def _matters(
    positions: Positions, lower: NDArray[np.float64], upper: NDArray[np.float64], unit: str, scales: Scales
) -> bool:
    """Whether an effort has an interval worth a word at one of some positions: no bounds, or ends far enough apart, by
    more than rounding."""
    widths = upper[positions] - lower[positions]
    largest = np.nanmax(np.abs([lower, upper]), initial=0.0)
    return bool(np.any(np.isnan(widths) | (widths > np.fmax(NEGLIGIBLE * largest, scales.floor(unit)))))


def _together(zero: dict[str, Positions]) -> list[tuple[list[str], Positions]]:
    """Joints that rest at the same positions, as all do in a dwell, with these."""
    found: dict[bytes, tuple[list[str], Positions]] = {}
    for joint, positions in zero.items():
        found.setdefault(positions.tobytes(), ([], positions))[0].append(joint)
    return list(found.values())


def _not_assembled(causes: Causes, dial: Dial, part: _Open) -> Finding:
    mechanism, module = causes.system.mechanism, causes.system.plan.modules[part.module]
    everywhere = len(part.positions) == len(dial.values) > 1
    where, at = f"links {', '.join(module.links)}", dial.intervals(part.positions)
    if not part.reasons:
        errors, redundant = mechanism.has_errors, bool(module.redundant)
        return finding_for(
            "assembly.open", where, at=at, everywhere=everywhere, redundant=redundant, errors=errors,
            start=bool(np.any(np.asarray(part.positions) == 0)),
        )  # fmt: skip
    gaps = {name: np.nanmax(sizes) for name, sizes in part.reasons.items() if np.any(sizes > 0)}
    return finding_for("assembly.gap", where, at=at, everywhere=everywhere, gaps=gaps)


def _shortfalls(walk: Forward, number: int) -> dict[str, Number]:
    """Why a closed form has no position: each reason with the length by which it holds where it is positive."""
    module, pose = walk.system.plan.modules[number], walk.poses[number]
    if not isinstance(pose, DyadPose):
        return {}
    b, c, d = module.joints
    if module.kind == "RRR":
        (pin_b, b_i), (c_i, c_j), (pin_d, d_j) = walk.pairs(walk.system.places[number])
        gap, bc, cd = (np.hypot(two.x - one.x, two.y - one.y) for one, two in ((pin_b, pin_d), (b_i, c_i), (c_j, d_j)))
        return {
            f"|{b}{d}| exceeds {b}{c} + {c}{d}": gap - (bc + cd),
            f"|{b}{d}| falls short of |{b}{c} − {c}{d}|": np.abs(bc - cd) - gap,
        }
    if module.kind == "RRP":
        return {f"the path of {c} is farther from {b} than |{b}{c}|": np.abs(pose.lost) - pose.scale}
    if module.kind == "RPR":
        return {f"|{b}{d}| falls short of the offset of the slide {c}": np.abs(pose.lost) - pose.scale}
    return {}


def _locked(
    system: System,
    dial: Dial,
    number: int,
    positions: Positions,
    share: NDArray[np.float64],
    whole: float,
    near: Locking | None,
    felt: Sequence[str],
) -> Finding:
    """How far it is from running, the joint that decides, and whether it locks the other way too."""
    module = system.plan.modules[number]
    joints = [name for name in module.joints if name in felt]
    reverse, decides, multiple = "", "", None
    if near is not None:
        states = near.all_states()
        jammed, locked = LockingState.JAMMED in states, LockingState.LOCKED in states
        reverse = "" if not jammed else "some" if locked else "all"
        responsible = near.responsible()
        if responsible and responsible[0] in module.joints:
            decides, multiple = responsible
    return finding_for(
        "friction.locked", f"links {', '.join(module.links)}", at=dial.intervals(positions), share=np.min(share),
        joints=joints, reverse=reverse, decides=decides, multiple=multiple, whole=whole,
    )  # fmt: skip


def _zero_slip(
    dial: Dial,
    joints: list[str],
    positions: Positions,
    efforts: dict[str, tuple[NDArray[np.float64], NDArray[np.float64], str]],
) -> Finding:
    widest: dict[str, dict[str, float | str]] = {}
    for driver, (lower, upper, unit) in efforts.items():
        widths = upper[positions] - lower[positions]
        if np.any(np.isfinite(widths)):
            k = positions[int(np.nanargmax(widths))]
            widest[driver] = {"from": lower[k], "to": upper[k], "unit": unit, "at": f"at {dial.at(k)}"}
    where, at = f"joints.{', '.join(joints)}", dial.intervals(positions)
    return finding_for("friction.interval", where, joints=joints, at=at, efforts=widest, locks=bool(efforts))


def _most(values: NDArray[np.float64]) -> float:
    """The largest; ∞ if any has no value."""
    finite = values[np.isfinite(values)]
    return float(np.max(finite)) if len(finite) == len(values) and len(finite) else np.inf
