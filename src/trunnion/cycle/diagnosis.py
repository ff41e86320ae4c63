"""Why a position has no answer, told over the cycle: cause, interval, figure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.errors import Finding, Severity, Status
from trunnion.groups import rpr, rrp, rrr
from trunnion.solve.backward import Backward
from trunnion.solve.forward import Forward
from trunnion.solve.system import Dial, Positions, System, rubbing, sticking

if TYPE_CHECKING:
    from trunnion.cycle.near_locking import Locking

__all__ = ["Causes", "findings"]

CLASS_TWO = 2


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
    _seats: dict[str, list[NDArray[np.float64]]] = field(default_factory=dict)
    _stuck: list[Positions] = field(default_factory=list)

    def note(self, back: Backward, status: NDArray[np.int8], offset: int) -> None:
        """Look at one chunk, whose first position has the number `offset`."""
        if np.any(status == Status.NOT_ASSEMBLED):
            self._note_open(back.walk, status, offset)
        for name in sticking(self.system):
            zero = np.broadcast_to(back.slips[name].zero, status.shape) & (status < Status.NOT_CONVERGED)
            if np.any(zero):
                self._zero.setdefault(name, []).append(np.flatnonzero(zero) + offset)
        if np.any(status == Status.LOAD_UNDEFINED):
            for path, where in back.undefined.items():
                bad = np.broadcast_to(where, status.shape) & (status == Status.LOAD_UNDEFINED)
                if np.any(bad):
                    self._undefined.setdefault(path, []).append(np.flatnonzero(bad) + offset)
        if np.any(status == Status.SINGULAR):
            self._note_singular(back.walk, status, offset)
        if np.any(status == Status.LOCKED):
            modules = reversed(range(len(back.settled)))  # settled from the last module to the first
            for number, settled in zip(modules, back.settled, strict=True):
                share = np.broadcast_to(settled.share, status.shape)
                locked = np.flatnonzero((share < 1.0) & (status == Status.LOCKED))
                if len(locked):
                    self._locked.setdefault(number, []).append((locked + offset, share[locked]))

    def note_seats(self, offsets: Mapping[str, NDArray[np.float64]], sticks: NDArray[np.bool_], offset: int) -> None:
        """Keep where the pins of one chunk lie, and where joints stick while pins travel."""
        self._stuck.append(np.flatnonzero(sticks) + offset)
        for path, numbers in offsets.items():
            self._seats.setdefault(path, []).append(numbers)

    def stuck(self) -> Positions:
        """Positions at which only the travel of seats decides the sense of a friction."""
        return np.concatenate(self._stuck) if self._stuck else np.zeros(0, np.intp)

    def seats(self) -> dict[str, NDArray[np.float64]]:
        """Offsets of the pins at all positions, by the names of `shifts`."""
        return {path: np.concatenate(parts) for path, parts in self._seats.items()}

    def _note_singular(self, walk: Forward, status: NDArray[np.int8], offset: int) -> None:
        """The module whose condition is the worst at each singular position."""
        conditions = [
            np.broadcast_to(np.nan_to_num(group.condition(pose), nan=np.inf), status.shape)
            for group, pose in zip(walk.system.groups, walk.poses, strict=True)
        ]
        worst = np.argmax(conditions, axis=0)
        for number in range(len(conditions)):
            here = np.flatnonzero((status == Status.SINGULAR) & (worst == number))
            if len(here):
                self._singular.setdefault(number, []).append(here + offset)

    def singular(self) -> dict[int, Positions]:
        """Singular positions by module."""
        return {number: np.concatenate(parts) for number, parts in self._singular.items()}

    def _note_open(self, walk: Forward, status: NDArray[np.int8], offset: int) -> None:
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
            self._open.append(_Open(number, here + offset, reasons))

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
    near: Locking | None = None,
) -> list[Finding]:
    """One finding for each cause. efforts: least and largest effort and unit of every driver."""
    found = [_not_assembled(causes, dial, part) for part in causes.open_modules().values()]
    stuck = causes.stuck()
    stuck = stuck[status[stuck] == Status.ZERO_SLIP]
    if len(stuck):
        what = f"a joint with friction turns round while its pin travels {dial.intervals(stuck)}: its friction may act "
        found.append(Finding(f"{what}either way, and its seat with it", "joints", severity=Severity.NOTE))
    for number, singular in causes.singular().items():
        module = causes.system.plan.modules[number]
        kind = "dead centre (singular position)" if module.rank == CLASS_TWO else "singular position"
        what = f"{kind} {dial.intervals(singular)}: condition {_most(condition[singular])}"
        remedy = "speeds and forces have no finite value there; keep out of it"
        found.append(Finding(what, f"links {', '.join(module.links)}", remedy))
    for path, positions in causes.undefined().items():
        what = f"has no value {dial.intervals(positions)}"
        remedy = "its line has no direction where its ends meet: move one"
        if path.startswith("loads."):
            remedy = "let its tables reach over the whole cycle, or be periodic; check divisions and roots"
        found.append(Finding(what, path, remedy))
    for number, (positions, share) in causes.locked().items():
        found.append(_locked(causes.system, dial, number, positions, share, near))
    late = np.flatnonzero(status == Status.NOT_CONVERGED)
    if len(late):
        what = f"the friction iteration did not converge {dial.intervals(late)}"
        found.append(Finding(what, "joints", "use the Newton method, a larger criterion or more iterations"))
    close = np.flatnonzero(status == Status.NEAR_SINGULAR)
    if len(close):
        what = f"close to a dead centre {dial.intervals(close)}: condition up to {_most(condition[close])}"
        found.append(Finding(what, "links", "forces there are very sensitive to the dimensions", Severity.WARNING))
    for joints, positions in _together(causes.zero_slip()):
        widths = [upper[positions] - lower[positions] for lower, upper, _ in efforts.values()]
        if not widths or np.any(np.array(widths) != 0):  # a coefficient of 0 leaves no interval
            found.append(_zero_slip(dial, joints, positions, efforts))
    return found


def _together(zero: dict[str, Positions]) -> list[tuple[str, Positions]]:
    """Joints that rest at the same positions, as all do in a dwell, with these."""
    found: dict[bytes, tuple[list[str], Positions]] = {}
    for joint, positions in zero.items():
        found.setdefault(positions.tobytes(), ([], positions))[0].append(joint)
    return [(", ".join(joints), positions) for joints, positions in found.values()]


def _not_assembled(causes: Causes, dial: Dial, part: _Open) -> Finding:
    module = causes.system.plan.modules[part.module]
    everywhere = len(part.positions) == len(dial.values) > 1
    head = f"cannot be assembled {'at any position' if everywhere else dial.intervals(part.positions)}"
    where = f"links {', '.join(module.links)}"
    remedy = "change the lengths or the range of the driver"
    if not part.reasons:
        why = "do not close" if everywhere else "do not get there from their start without being taken apart"
        if everywhere and module.redundant:
            remedy = "its joints constrain more than they free, so it closes with special dimensions only: check them, "
            remedy += "or let joints slide or tilt (cylindrical, spherical)"
            if causes.system.mechanism.has_errors:
                why = "are over-constrained, and with their errors they go together only by their play, if at all: "
                why += "they cannot be analysed as rigid parts"
                remedy = "`trunnion assemble FILE` tells whether they go together, and how much play that takes"
        return Finding(f"{head}: these links {why}", where, remedy)
    told = [
        f"{text} by up to {_length(float(np.nanmax(figure)))}"
        for text, figure in part.reasons.items()
        if np.any(figure > 0)
    ]
    return Finding(f"{head}: {'; '.join(told) or 'an earlier module has no position'}", where, remedy)


def _shortfalls(walk: Forward, number: int) -> dict[str, Number]:
    """Why a closed form has no position: each reason with the length by which it holds where it is positive."""
    module, pose = walk.system.plan.modules[number], walk.poses[number]
    if isinstance(pose, rrr.Pose):
        b, c, d = module.joints
        (pin_b, _), _, (pin_d, _) = walk.pairs(walk.system.places[number])
        gap = np.hypot(pin_d.x - pin_b.x, pin_d.y - pin_b.y)
        bc, cd = pose.lengths
        return {
            f"|{b}{d}| exceeds {b}{c} + {c}{d}": gap - (bc + cd),
            f"|{b}{d}| falls short of |{b}{c} − {c}{d}|": np.abs(bc - cd) - gap,
        }
    if isinstance(pose, rrp.Pose):
        b, c, _ = module.joints
        return {f"the path of {c} is farther from {b} than |{b}{c}|": np.abs(pose.p) - pose.length}
    if isinstance(pose, rpr.Pose):
        b, c, d = module.joints
        return {f"|{b}{d}| falls short of the offset of the slide {c}": np.abs(pose.offset) - pose.length}
    return {}


def _locked(
    system: System,
    dial: Dial,
    number: int,
    positions: Positions,
    share: NDArray[np.float64],
    near: Locking | None,
) -> Finding:
    """How far it is from running, the joint that decides, and whether it locks the other way too."""
    module = system.plan.modules[number]
    joints = ", ".join(name for name in module.joints if name in rubbing(system))
    worst = float(np.min(share))
    what = (
        f"locked by friction {dial.intervals(positions)}: no solution beyond {worst:.4g} of the friction "
        f"in joints {joints}"
    )
    remedy = f"lower these coefficients below {worst:.3g} of their values, shorten the arms or lengthen the guides"
    if near is not None:
        both = near.locked & near.back.locked
        if np.any(both):
            everywhere = np.array_equal(both, near.locked)
            what += "; it locks in reverse too: jammed" + ("" if everywhere else " at some of them")
        decides = near.responsible()
        if decides and decides[0] in module.joints:
            remedy = f"{decides[0]} decides: below {decides[1]:.3g} of its coefficient alone it runs; or {remedy}"
    return Finding(what, f"links {', '.join(module.links)}", remedy)


def _zero_slip(
    dial: Dial,
    joints: str,
    positions: Positions,
    efforts: dict[str, tuple[NDArray[np.float64], NDArray[np.float64], str]],
) -> Finding:
    parts = []
    for driver, (lower, upper, unit) in efforts.items():
        widths = upper[positions] - lower[positions]
        if np.any(np.isfinite(widths)):
            worst = int(np.nanargmax(widths))
            place = positions[worst]
            parts.append(f"effort of {driver} {lower[place]:.6g} … {upper[place]:.6g} {unit} at {dial.at(place)}")
    bounds = ", ".join(parts) or ("with one sign it locks, so the effort has no bounds" if efforts else "")
    what = f"relative speed zero {dial.intervals(positions)}: what resists it is an interval"
    what += f"; {bounds}" if bounds else ""
    return Finding(
        what, f"joints.{joints}", "the bounds are in drive_effort_lower and drive_effort_upper", Severity.NOTE
    )


def _length(metres: float) -> str:
    """A length in the unit a drawing would use."""
    size = abs(metres)
    if size >= 1:
        return f"{metres:.4g} m"
    return f"{metres * 1e3:.4g} mm" if size >= 1e-4 else f"{metres * 1e6:.4g} µm"


def _most(values: NDArray[np.float64]) -> str:
    finite = values[np.isfinite(values)]
    return f"{np.max(finite):.3g}" if len(finite) == len(values) and len(finite) else "∞"
