"""Where a pin loses contact: the load of an end passes through zero, and its seat would have to jump across the hole.

The massless-link model of play keeps the pin at the wall of its hole. That ends where the load vanishes or turns
round: seen here by a load that turns by more than a right angle from one position to the next while it passes near
zero, or by a seat that does not settle, since there the load changes more by the seat than it presses. Beside it the
figure of a zero-clearance analysis that S. W. E. Earles and C. L. S. Wu (Predicting the occurrence of contact loss
and impact at a bearing from a zero-clearance analysis, Proc. 4th World Congress on the Theory of Machines and
Mechanisms, 1975, 1013-1018) found to tell impact: rate of turn of the reaction over its size, from about 1 rad/(N s)
on. It is empirical, and has a unit.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trunnion.analysis.seating import NO_LOAD, ROUNDS, TOLERANCE, Seat, loads_of
from trunnion.analysis.system import Dial
from trunnion.errors import Finding, Severity, Status

if TYPE_CHECKING:
    from trunnion.analysis.analyse import Run

__all__ = ["EARLES_WU", "Loss", "find", "findings"]

EARLES_WU = 1.0  # rad/(N s)
NEAR = 0.1  # of the largest load: as near to zero as a load passes that turns round between two positions
CLOSE = 20_000  # positions of a cycle that are near enough to tell a passage through zero from a quick turn
PARTS = 96  # into which a wider step, and a quarter of it on either side, is parted
MOST_PLACES = 6  # named in one finding

NOWHERE = np.zeros(0, np.intp)
Arrays = dict[str, NDArray[np.float64]]


@dataclass(frozen=True)
class Loss:
    """Loss of contact of one joint: where (position, whole and fraction), at which end, least load there, N, largest
    load, N.

    unsettled: positions whose seats did not settle; lifted: where the inertia of the pin's own way outdoes its load;
    loaded: whether anything presses it at all; turns: whether its load has a direction that can turn, as that of a
    guide has not.
    """

    joint: str
    places: list[tuple[float, int]]
    least: float
    peak: float
    unsettled: NDArray[np.intp]
    lifted: NDArray[np.intp]
    loaded: bool = True
    turns: bool = True


def find(arrays: Arrays, run: Run, time: NDArray[np.float64]) -> list[Loss]:
    """Losses of contact of every joint that its load seats; written into `contact_lost` and the status."""
    found: list[Loss] = []
    joints = list(run.system.joints)
    arrays["contact_loss_number"][:] = _numbers(arrays, run, time)
    largest = float(np.nanmax(np.abs(arrays["reaction_force"]), initial=0.0))
    # where a joint turns round, the sense of its friction is what does not settle
    late = np.flatnonzero((arrays["seat_change"] > TOLERANCE) & (arrays["status"] != Status.ZERO_SLIP))
    loaded = [seat for seat in run.seats if seat.given is None]
    least = _least_loaded(arrays["end_force"][..., late], [joints.index(one.joint) for one in loaded])
    for seat in loaded:
        i = joints.index(seat.joint)
        loss = _of_joint(run, seat, arrays["end_force"][i], time, largest)
        turns = any(len(end) > 1 for end in seat.play.model.ends)
        lifted = _lifted(arrays["end_force"][i], arrays["seat_offset"][i]) if loss.loaded else NOWHERE
        loss = replace(loss, unsettled=late[least == i], lifted=lifted, turns=turns)
        if loss.places or len(loss.unsettled) or len(lifted) or not loss.loaded:
            found.append(loss)
        lost = np.array([round(place) % len(time) for place, _ in loss.places], np.intp)
        for where in (lost, loss.unsettled, lifted):
            arrays["contact_lost"][i, where] = 1
    anywhere = np.any(arrays["contact_lost"] > 0, axis=0)
    status = arrays["status"]
    np.maximum(status, np.where(anywhere, status.dtype.type(Status.CONTACT_LOST), status.dtype.type(0)), out=status)
    return found


def _lifted(forces: NDArray[np.float64], offsets: NDArray[np.float64]) -> NDArray[np.intp]:
    """Positions at which the load of an end points away from the wall that its pin lies at."""
    across = np.sum(forces * offsets, axis=1)
    size = np.sqrt(np.sum(forces**2, axis=1) * np.sum(offsets**2, axis=1))
    return np.flatnonzero(np.any(across < -1e-6 * size, axis=0))


def _numbers(arrays: Arrays, run: Run, time: NDArray[np.float64]) -> NDArray[np.float64]:
    """The figure of Earles and Wu of every joint: of its reaction without play, in space of the force on an end."""
    if run.system.mechanism.space == "planar":
        return _earles_wu(arrays["reaction_force"] - arrays["reaction_force_change"], time, run.cycle.periodic)
    ends = [_earles_wu(arrays["end_force"][:, end], time, run.cycle.periodic) for end in (0, 1)]
    return np.fmax(*ends)


def _earles_wu(force: NDArray[np.float64], time: NDArray[np.float64], periodic: bool) -> NDArray[np.float64]:
    """|F × Ḟ|/|F|³, rad/(N s), of every joint, by central differences over the positions; NaN of a single one."""
    if len(time) < 3:
        return np.full((len(force), len(time)), np.nan)
    step = time[1] - time[0]
    rate = (np.roll(force, -1, axis=-1) - np.roll(force, 1, axis=-1)) / (2 * step)
    if not periodic:
        rate[..., 0], rate[..., -1] = (force[..., 1] - force[..., 0]) / step, (force[..., -1] - force[..., -2]) / step
    size = np.sum(force * force, axis=1)
    along = np.sum(force * rate, axis=1)
    with np.errstate(all="ignore"):
        across = np.sqrt(np.maximum(np.sum(rate * rate, axis=1) - along**2 / size, 0.0))
        jumps = np.sum(np.roll(force, -1, axis=-1) * np.roll(force, 1, axis=-1), axis=1) < 0  # no rate tells that
        return np.where((size > 0) & ~jumps, across / size, np.nan)


def _least_loaded(forces: NDArray[np.float64], rows: Sequence[int]) -> NDArray[np.intp]:
    """Of the joints with loaded seats that whose end bears least, at each of some positions."""
    if not len(rows) or not forces.shape[-1]:
        return NOWHERE
    sizes = np.sqrt(np.sum(forces[rows] ** 2, axis=2))
    least = np.argmin(np.nan_to_num(np.min(np.where(np.isfinite(sizes), sizes, np.inf), axis=1)), axis=0)
    return np.array([rows[k] for k in least], np.intp)


def _of_joint(run: Run, seat: Seat, forces: NDArray[np.float64], time: NDArray[np.float64], largest: float) -> Loss:
    """Where the load of an end of one joint passes through zero."""
    places: list[tuple[float, int]] = []
    least, peak = np.inf, 0.0
    loads = list(_end_loads(seat, forces))
    top = max((float(np.nanmax(_size(load), initial=0.0)) for _, load in loads), default=0.0)
    if top <= NO_LOAD * largest:
        return Loss(seat.joint, [], 0.0, top, NOWHERE, NOWHERE, loaded=False)
    for number, load in loads:
        own = float(np.nanmax(_size(load), initial=0.0))
        if own <= NO_LOAD * largest:
            continue  # nothing ever presses this end
        for place, size in _seen(run, seat, number, _passages(load, own, run.cycle.periodic), time, own):
            places.append((place, min(int(seat.play.model.ends[number][0][0]), 2)))
            least = min(least, size)
        peak = max(peak, own)
    return Loss(seat.joint, sorted(places), least, peak, NOWHERE, NOWHERE)


def _seen(
    run: Run, seat: Seat, number: int, found: Iterable[tuple[float, float]], time: NDArray[np.float64], peak: float
) -> Iterator[tuple[float, float]]:
    """Those passages through zero that are still there when looked at closely, by the loads without play between."""
    step = time[1] - time[0] if len(time) > 1 else 0.0
    if step <= run.cycle.duration / CLOSE:
        yield from found
        return
    for place, _ in found:
        from_ = np.floor(place) - 0.25
        times = time[0] + step * (from_ + np.arange(PARTS + 1) * (1.5 / PARTS))
        times = times if run.cycle.periodic else np.clip(times, 0.0, run.cycle.duration)
        load = np.array([np.broadcast_to(part, times.shape) for part in loads_of(run.ideal(times), seat)[number]])
        for fine, size in _passages(load, peak, periodic=False):
            yield from_ + fine * (1.5 / PARTS), size


def _end_loads(seat: Seat, forces: NDArray[np.float64]) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """(number, load (component, position)) of every end that can move at all."""
    for number, (end, radius) in enumerate(zip(seat.play.model.ends, seat.play.radii, strict=True)):
        if np.any(np.asarray(radius) > 0):
            place = min(int(end[0][0]), 2) - 1
            rows = ["xyz".index(key.split(".")[1]) for key in end]
            yield number, forces[place][rows]


def _size(load: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.sqrt(np.sum(load * load, axis=0)))


def _passages(load: NDArray[np.float64], peak: float, periodic: bool) -> Iterator[tuple[float, float]]:
    """(position with its fraction, least load) wherever a load turns round near zero, or is zero."""
    after = np.roll(load, -1, axis=1)
    step = after - load
    square = np.sum(step * step, axis=0)
    with np.errstate(all="ignore"):
        share = np.clip(-np.sum(load * step, axis=0) / square, 0.0, 1.0)
    nearest = _size(load + share * step)
    turns = (np.sum(load * after, axis=0) < 0) & (nearest <= NEAR * peak)
    if not periodic and len(turns):
        turns[-1] = False
    nothing = _size(load) <= NO_LOAD * peak
    for k in np.flatnonzero(turns | nothing):
        yield (float(k), float(_size(load)[k])) if nothing[k] else (float(k + share[k]), float(nearest[k]))


def findings(found: Sequence[Loss], arrays: Arrays, joints: Sequence[str], dial: Dial) -> list[Finding]:
    """One finding for each joint that loses contact, and for each that nothing presses."""
    told: list[Finding] = []
    if "seat_change" not in arrays:
        return told
    stuck = np.flatnonzero((arrays["seat_change"] > TOLERANCE) & (arrays["status"] == Status.ZERO_SLIP))
    if len(stuck):
        worst = float(np.nanmax(arrays["seat_change"][stuck]))
        what = f"a joint with friction turns round while its pin travels {dial.intervals(stuck)}: its friction may act "
        what += f"either way, and a seat changes by up to {worst:.2g} of its clearance with it"
        told.append(Finding(what, "joints", severity=Severity.NOTE))
    held = np.flatnonzero((arrays["seat_travel"] == 0) & (arrays["status"] < Status.CONTACT_LOST))
    if len(held):
        what = f"the seats turn too fast to tell how they travel {dial.intervals(held)}: velocities and accelerations "
        what += "there are those of pins held in their seats"
        told.append(Finding(what, "joints", severity=Severity.NOTE))
    for loss in found:
        where = f"joints.{loss.joint}"
        if not loss.loaded:
            what = "no load presses it to a wall: it is taken to lie in the middle of its play"
            told.append(Finding(what, where, "give the seat, or leave it free", Severity.NOTE))
            continue
        if loss.places:
            remedy = _number(arrays, joints.index(loss.joint), dial) if loss.turns else "expect impact there"
            told.append(Finding(_lost(loss, dial), where, remedy, Severity.WARNING))
        if len(loss.lifted):
            what = f"it lifts off the wall {dial.intervals(loss.lifted)}: its seat turns so fast that the inertia of "
            what += "its way outdoes the load"
            told.append(Finding(what, where, "forces there are those of a seat that stays", Severity.WARNING))
        if len(loss.unsettled):
            worst = float(np.nanmax(arrays["seat_change"][loss.unsettled]))
            what = f"its seat did not settle in {ROUNDS} rounds {dial.intervals(loss.unsettled)}: it still changes by "
            what += f"{worst:.2g} of its clearance, as the load there changes more with the seat than it presses"
            told.append(Finding(what, where, "there the pin floats: contact is lost", Severity.WARNING))
    return told


def _lost(loss: Loss, dial: Dial) -> str:
    shown = [f"{_at(dial, place)}{f' (end {end})' if end else ''}" for place, end in loss.places[:MOST_PLACES]]
    more = len(loss.places) - MOST_PLACES
    text = ", ".join(shown) + (f" and {more} more" if more > 0 else "")
    head = f"it loses contact at {text}: the load comes down to {loss.least:.3g} of {loss.peak:.3g} N, turns round"
    return f"{head} and the seat would jump"


def _number(arrays: Arrays, i: int, dial: Dial) -> str:
    numbers = arrays["contact_loss_number"][i]
    if not np.any(np.isfinite(numbers)):
        return "expect impact there"
    top = int(np.nanargmax(numbers))
    return (
        f"expect impact: the reaction turns at up to {numbers[top]:.3g} rad/(N s) at {dial.at(top)}, "
        f"impact is likely from {EARLES_WU:g} (Earles and Wu)"
    )


def _at(dial: Dial, place: float) -> str:
    """A place between two positions."""
    k = int(place)
    values = dial.values
    step = values[1] - values[0] if len(values) > 1 else 0.0
    return f"{values[k % len(values)] + (place - k) * step:.4g}{dial.unit}"
