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

import functools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, Status
from trunnion.results.sentences import finding_for
from trunnion.solve.eccentricity_rate import FINE as LANES
from trunnion.solve.memory import CHUNK
from trunnion.solve.seating import NO_LOAD, ROUNDS, TOLERANCE, Seated, loads_of
from trunnion.solve.seats import GivenSeat
from trunnion.solve.system import Dial

if TYPE_CHECKING:
    from trunnion.solve.backward import Backward
    from trunnion.solve.run import Run

__all__ = ["EARLES_WU", "Loss", "find", "findings", "gaps", "valid"]

EARLES_WU = 1.0  # rad/(N s)
NEAR = 0.1  # of the largest load: as near to zero as a load passes that turns round between two positions
CLOSE = 20_000  # positions of a cycle that are near enough to tell a passage through zero from a quick turn
PARTS = 96  # into which a wider step, and a quarter of it on either side, is parted
FINE = 1.5 / PARTS  # of a step
REACH = 3.0  # in lanes of `travel`: how far on either side of a jump the differences of seats reach, and one more
OFF = 1e-6  # of load and offset: a load that points away from the wall, not along it but for rounding
BESIDE = 1e-9  # of a cycle: on the sides of a place at which the model switches
MOST_PLACES = 6  # named in one finding
ENDS = ("", " (end 1)", " (end 2)", " (along its axis)")

NOWHERE = np.zeros(0, np.intp)
Arrays = dict[str, NDArray[np.float64]]


@dataclass(frozen=True)
class Loss:
    """Loss of contact of one joint: where (position, whole and fraction), at which end (1, 2, 3 along the axis, 0 of a
    play that has one end), least load there, N, largest load of that end, N.

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

    @property
    def part(self) -> str:
        """What lies in the hole."""
        return "pin" if self.turns else "slider"


def find(arrays: Arrays, run: Run, time: NDArray[np.float64]) -> list[Loss]:
    """Losses of contact of every joint that its load seats; written into `contact_lost` and the status."""
    found: list[Loss] = []
    joints = list(run.system.joints)
    _fill_numbers(arrays, run, time)
    arrays["contact_loss_number"][:, arrays["status"] == Status.ZERO_SLIP] = np.nan  # friction jumps there
    force = arrays["reaction_force"]
    largest = float(max(np.nanmax(force, initial=0.0), -np.nanmin(force, initial=0.0)))
    # where a joint turns round, the sense of its friction is what does not settle; where forces have no answer, nothing
    status = arrays["status"]
    open_ = (status < Status.NOT_CONVERGED) & (status != Status.ZERO_SLIP)
    late = np.flatnonzero((arrays["seat_change"] > TOLERANCE) & open_)
    loaded = [seat for seat in run.seats if seat.given is None]
    least = _least_loaded(arrays["end_force"][..., late], [joints.index(one.joint) for one in loaded])
    ends = [_ends(seat, arrays["end_force"][joints.index(seat.joint)]) for seat in loaded]
    seen = iter(_seen(run, [end for own in ends for end in own if end.peak > NO_LOAD * largest], time))
    for seat, own in zip(loaded, ends, strict=True):
        i = joints.index(seat.joint)
        loss = _of_joint(run, seat, own, seen, len(time), largest)
        turns = any(len(end) > 1 for end in seat.play.model.ends)
        lifted = _lifted(arrays["end_force"][i], arrays["seat_offset"][i]) if loss.loaded else NOWHERE
        loss = replace(loss, unsettled=late[least == i], lifted=lifted, turns=turns)
        if loss.places or len(loss.unsettled) or len(lifted) or not loss.loaded:
            found.append(loss)
        lost = np.array([round(place) for place, _ in loss.places], np.intp)
        lost = lost % len(time) if run.cycle.periodic else np.clip(lost, 0, len(time) - 1)
        for where in (lost, loss.unsettled, lifted):
            arrays["contact_lost"][i, where] = 1
    anywhere = np.any(arrays["contact_lost"] > 0, axis=0)
    np.maximum(status, np.where(anywhere, status.dtype.type(Status.CONTACT_LOST), status.dtype.type(0)), out=status)
    return found


def gaps(run: Run) -> NDArray[np.float64]:
    """Times, s, from and to, round every loss, in which the travel of a seat that jumps reaches; (2, loss).

    Of the loads without play, all along the cycle and on either side of every place at which the model switches: they
    do not depend on which positions were asked for.
    """
    duration, near = run.cycle.duration, REACH * run.cycle.duration / LANES
    scan = np.linspace(0.0, duration, LANES + 1)
    time = np.unique(np.clip(np.concatenate([scan, run.edges - BESIDE * duration, run.edges + BESIDE * duration]),
                             0.0, duration))  # fmt: skip
    with np.errstate(all="ignore"):
        back = run.ideal(time)
        at = np.array([moment for seat in run.seats if seat.given is None for moment in _turned(run, back, seat, time)])
    again = [at, at - duration, at + duration] if run.cycle.periodic else [at]  # beside the start or the end
    every = np.concatenate(again)
    every = every[(every > -near) & (every < duration + near)]
    return np.array([every - near, every + near])


def _turned(run: Run, back: Backward, seat: GivenSeat, time: NDArray[np.float64]) -> Iterator[float]:
    """Times at which the load of an end passes near zero, seen closely wherever it turns round between two of these.

    back: the ideal mechanism at these times.
    """
    largest = max((float(np.nanmax(np.abs(row), initial=0.0)) for row in _all_loads(run, back)), default=0.0)
    for number, load in enumerate(_loads_at(back, seat, time)):
        peak = float(np.nanmax(_size(load), initial=0.0))
        if peak <= NO_LOAD * largest:
            continue
        places = [place for place, _ in _passages(load, peak, periodic=False, near=np.inf)]
        # where there is no load there is nothing to look at more closely
        yield from (float(time[int(place)]) for place in places if place == min(int(place), len(time) - 2))
        wide = np.array([k for place in places if (k := min(int(place), len(time) - 2)) != place], np.intp)
        if not len(wide):
            continue
        fine = np.linspace(time[wide], time[wide + 1], PARTS + 1, axis=-1)  # (passage, time)
        close = _loads_at(run.ideal(fine.ravel()), seat, fine.ravel())[number].reshape(-1, *fine.shape)
        for k, times in enumerate(fine):
            for one, _ in _passages(close[:, k], peak, periodic=False):
                yield float(np.interp(one, np.arange(len(times)), times))


def _loads_at(back: Backward, seat: GivenSeat, time: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Loads of the ends of a joint, (component, time) each."""
    return [np.array([np.broadcast_to(part, time.shape) for part in load]) for load in loads_of(back, seat)]


def _all_loads(run: Run, back: Backward) -> Iterator[NDArray[np.float64]]:
    """Every component of the load of every end."""
    yield from (np.asarray(part) for seat in run.seats for load in loads_of(back, seat) for part in load)


def valid(found: Seated, run: Run, near: NDArray[np.float64], time: NDArray[np.float64]) -> NDArray[np.bool_]:
    """At which times, s, seats are settled, loaded pins press against their walls, and no loss is near (`gaps`)."""
    good = found.change <= TOLERANCE
    for low, high in near.T:
        good &= ~((time > low) & (time < high))
    for seat in run.seats:
        if seat.given is None:
            offsets = seat.play.model.offsets(found.offsets, f"seats.{seat.joint}") or []
            for load, offset in zip(found.loads[seat.joint], offsets, strict=True):
                across, *sizes = (sum(a * b for a, b in zip(*two, strict=True))
                                  for two in ((load, offset), (load, load), (offset, offset)))  # fmt: skip
                good &= ~np.less(across, -OFF * np.sqrt(sizes[0] * sizes[1]))
    return np.asarray(good)


def _lifted(forces: NDArray[np.float64], offsets: NDArray[np.float64]) -> NDArray[np.intp]:
    """Positions at which the load of an end points away from the wall that its pin lies at."""
    across, *sizes = (
        np.einsum("eap,eap->ep", *two) for two in ((forces, offsets), (forces, forces), (offsets, offsets))
    )
    return np.flatnonzero(np.any(across < -OFF * np.sqrt(sizes[0] * sizes[1]), axis=0))


def _fill_numbers(arrays: Arrays, run: Run, time: NDArray[np.float64]) -> None:
    """The figure of Earles and Wu of every joint: of its reaction without play, in space of the force on an end.

    NaN of fewer than three positions, and at the ends of a cycle that does not close: there the load has no rate.
    """
    count, found = len(time), arrays["contact_loss_number"]
    for low in range(0, count if count > 2 else 0, CHUNK):
        inner = slice(low, min(low + CHUNK, count))
        if run.system.mechanism.space == "planar":
            ends = [_with_neighbours(arrays["reaction_force"], inner)]
            ends[0] -= _with_neighbours(arrays["reaction_force_change"], inner)
        else:
            ends = [_with_neighbours(arrays["end_force"][:, end], inner) for end in (0, 1)]
        found[:, inner] = functools.reduce(np.fmax, (_earles_wu(force, time[1] - time[0]) for force in ends))
    if not run.cycle.periodic:
        found[:, [0, -1]] = np.nan


def _with_neighbours(force: NDArray[np.float64], inner: slice) -> NDArray[np.float64]:
    """A copy of some positions with the one before and the one after, in a cycle."""
    count = force.shape[-1]
    before, after = (force[..., k : k + 1] for k in ((inner.start - 1) % count, inner.stop % count))
    return np.concatenate([before, force[..., inner], after], axis=-1)


def _earles_wu(force: NDArray[np.float64], step: float) -> NDArray[np.float64]:
    """|F × Ḟ|/|F|³, rad/(N s), of every joint between the first position and the last, by central differences."""
    before, force, after = force[..., :-2], force[..., 1:-1], force[..., 2:]
    rate = (after - before) / (2 * step)
    size = np.sum(force * force, axis=1)
    along = np.sum(force * rate, axis=1)
    with np.errstate(all="ignore"):
        across = np.sqrt(np.sum((rate - force * (along / size)[:, None]) ** 2, axis=1))
        # no rate tells a jump, of the load or of a friction: there the second difference is no smaller than the first
        bends = np.sum((after - 2 * force + before) ** 2, axis=1) > 0.25 * np.sum((after - before) ** 2, axis=1)
        jumps = (np.sum(after * before, axis=1) < 0) | bends
        return np.where((size > 0) & ~jumps, across / size, np.nan)


def _least_loaded(forces: NDArray[np.float64], rows: Sequence[int]) -> NDArray[np.intp]:
    """Of the joints with loaded seats that whose end bears least, at each of some positions."""
    if not len(rows) or not forces.shape[-1]:
        return NOWHERE
    sizes = np.sqrt(np.sum(forces[rows] ** 2, axis=2))
    least = np.argmin(np.nan_to_num(np.min(np.where(np.isfinite(sizes), sizes, np.inf), axis=1)), axis=0)
    return np.array([rows[k] for k in least], np.intp)


class _End(NamedTuple):
    """The load of one end of a joint, (component, position), N, and its largest size."""

    seat: GivenSeat
    number: int
    load: NDArray[np.float64]
    peak: float


def _ends(seat: GivenSeat, forces: NDArray[np.float64]) -> list[_End]:
    loads = _end_loads(seat, forces)
    return [_End(seat, number, load, float(np.nanmax(_size(load), initial=0.0))) for number, load in loads]


def _of_joint(
    run: Run,
    seat: GivenSeat,
    ends: Sequence[_End],
    seen: Iterator[list[tuple[float, float]]],
    count: int,
    largest: float,
) -> Loss:
    """Where the load of an end of one joint passes through zero. seen: the passages of each end that is pressed."""
    places: list[tuple[float, int]] = []
    least, peak = np.inf, 1.0
    known = any(np.any(np.isfinite(end.load)) for end in ends)
    top = max((end.peak for end in ends), default=0.0)
    if known and top <= NO_LOAD * largest:
        return Loss(seat.joint, [], 0.0, top, NOWHERE, NOWHERE, loaded=False)
    for _, number, _, own in ends:
        if own <= NO_LOAD * largest:
            continue  # nothing ever presses this end
        end = int(seat.play.model.ends[number][0][0]) if len(seat.play.model.ends) > 1 else 0
        for place, size in _once(next(seen), count, run.cycle.periodic):
            places.append((place, end))
            if size / own < least / peak:
                least, peak = size, own
    return Loss(seat.joint, sorted(places), least, peak, NOWHERE, NOWHERE)


def _seen(run: Run, ends: Sequence[_End], time: NDArray[np.float64]) -> list[list[tuple[float, float]]]:
    """Passages of loads near zero; between wide steps those that are there when looked at closely, without play.

    How near a load comes to zero from one position to the next is not known of wide steps, only that it turns round.
    """
    step = time[1] - time[0] if len(time) > 1 else 0.0
    if step <= run.cycle.duration / CLOSE:
        return [list(_passages(end.load, end.peak, run.cycle.periodic)) for end in ends]
    turns = [_passages(end.load, end.peak, run.cycle.periodic, near=np.inf) for end in ends]
    starts = [[float(np.floor(place)) - 0.25 for place, _ in own] for own in turns]
    places = np.array([start + np.arange(PARTS + 1) * FINE for own in starts for start in own]).ravel()
    times = time[0] + step * places
    close = _closely(run, ends, times if run.cycle.periodic else np.clip(times, 0.0, run.cycle.duration))
    found: list[list[tuple[float, float]]] = []
    parts = iter(range(0, len(times), PARTS + 1))
    for end, load, own in zip(ends, close, starts, strict=True):
        looked = [(start, load[:, low : low + PARTS + 1]) for start, low in zip(own, parts, strict=False)]
        found.append([
            (start + fine * FINE, size)
            for start, there in looked for fine, size in _passages(there, end.peak, periodic=False)
        ])  # fmt: skip
    return found


def _closely(run: Run, ends: Sequence[_End], time: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Loads of ends without play at some times, all from the same walks."""
    found: list[list[NDArray[np.float64]]] = [[np.zeros((len(end.load), 0))] for end in ends]
    for low in range(0, len(time), CHUNK):
        some = time[low : low + CHUNK]
        back = run.ideal(some)
        for own, end in zip(found, ends, strict=True):
            own.append(_loads_at(back, end.seat, some)[end.number])
    return [np.concatenate(own, axis=1) for own in found]


def _once(found: Iterable[tuple[float, float]], count: int, periodic: bool) -> Iterator[tuple[float, float]]:
    """Each passage once: one near a position is seen from both sides of it, over a turn also from its other end."""
    places = sorted((place % count if periodic else min(max(place, 0.0), count - 1.0), size) for place, size in found)
    for k, (place, size) in enumerate(places):
        before = places[k - 1][0] if k else places[-1][0] - count if periodic and len(places) > 1 else -np.inf
        if place - before > 0.5 * FINE:
            yield place, size


def _end_loads(seat: GivenSeat, forces: NDArray[np.float64]) -> Iterator[tuple[int, NDArray[np.float64]]]:
    """(number, load (component, position)) of every end that can move at all."""
    for number, (end, radius) in enumerate(zip(seat.play.model.ends, seat.play.radii, strict=True)):
        if np.any(np.asarray(radius) > 0):
            place = int(end[0][0])
            rows = ["xyz".index(key.split(".")[1]) for key in end]
            # what is along the axis stands by halves with either end
            yield number, forces[place - 1][rows] if place < 3 else forces[0][rows] + forces[1][rows]


def _size(load: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(np.sqrt(sum(row * row for row in load)))


def _passages(
    load: NDArray[np.float64], peak: float, periodic: bool, near: float = NEAR
) -> Iterator[tuple[float, float]]:
    """(position with its fraction, least load) wherever a load turns round near zero, or is zero.

    near: how near, of the peak.
    """
    after, size = np.roll(load, -1, axis=1), _size(load)
    turns = np.sum(load * after, axis=0) < 0
    if not periodic and len(turns):
        turns[-1] = False
    places = np.flatnonzero(turns | (size <= NO_LOAD * peak))
    load, size = load[:, places], size[places]
    step = after[:, places] - load
    with np.errstate(all="ignore"):
        share = np.clip(-np.sum(load * step, axis=0) / np.sum(step * step, axis=0), 0.0, 1.0)
    nearest = _size(load + share * step)
    for i, k in enumerate(places):
        if size[i] <= NO_LOAD * peak:
            yield float(k), float(size[i])
        elif nearest[i] <= near * peak:
            yield float(k + share[i]), float(nearest[i])


def findings(found: Sequence[Loss], arrays: Arrays, joints: Sequence[str], dial: Dial) -> Iterator[Finding]:
    """One finding for all joints that lose contact at the same places, and for those that nothing presses."""
    if "seat_change" not in arrays:
        return
    held = np.flatnonzero((arrays["seat_travel"] == 0) & (arrays["status"] < Status.CONTACT_LOST))
    if len(held):
        joint, jump = _jump(arrays["seat_offset"], held, joints)
        yield finding_for("seat.held", "joints", at=dial.intervals(held), joint=joint, jump=jump)
    yield from _unloaded(found, dial)
    lost: dict[tuple[str, str], list[Loss]] = {}
    lifted: dict[tuple[str, str], list[Loss]] = {}
    for loss in found:
        shown = sorted(_told(loss.places, dial))
        if not loss.loaded:
            yield finding_for("seat.unloaded", f"joints.{loss.joint}", part=loss.part)
        elif not all(long for *_, long in shown):
            at = _listed([text + end for _, text, end, long in shown if not long])
            lost.setdefault((loss.part, at), []).append(loss)
        if len(loss.lifted):
            lifted.setdefault((loss.part, dial.intervals(loss.lifted)), []).append(loss)
    for (part, at), some in lost.items():
        yield _lost(some, part, at, arrays["contact_loss_number"][[joints.index(one.joint) for one in some]], dial)
    for (part, at), some in lifted.items():
        yield finding_for("contact.lifted", _where(some), part=part, at=at, count=len(some))
    for loss in found:
        if loss.loaded and len(loss.unsettled):
            at, worst = dial.intervals(loss.unsettled), np.nanmax(arrays["seat_change"][loss.unsettled])
            yield finding_for("seat.unsettled", _where([loss]), rounds=ROUNDS, at=at, change=worst)


def _unloaded(found: Sequence[Loss], dial: Dial) -> Iterator[Finding]:
    """The joints that bear no load over a range, with the end that does not where the other does."""
    idle: dict[str, dict[str, str]] = {}
    for loss in found:
        for _, text, end, long in _told(loss.places, dial):
            if long:
                ends = idle.setdefault(text, {})
                ends[loss.joint] = "" if loss.joint in ends else end
    for text, ends in idle.items():
        yield finding_for("contact.unloaded", "joints", joints=[name + end for name, end in ends.items()], at=text)


def _where(losses: Sequence[Loss]) -> str:
    return f"joints.{', '.join(one.joint for one in losses)}"


def _jump(offsets: NDArray[np.float64], held: NDArray[np.intp], joints: Sequence[str]) -> tuple[str, float]:
    """The joint whose pin moves furthest between some positions and those beside them, and how far, m.

    offsets: of pins from the middle of their holes, (joint, end, axis, position), m.
    """
    if offsets.shape[-1] < 2:
        return joints[0], 0.0
    beside = np.unique(np.clip([held - 1, held], 0, offsets.shape[-1] - 2))
    step = np.sqrt(np.sum((offsets[..., beside + 1] - offsets[..., beside]) ** 2, axis=-2))  # (joint, end, step)
    furthest = np.nan_to_num(step).max(axis=(1, 2), initial=0.0)
    return joints[int(np.argmax(furthest))], float(np.max(furthest))


def _lost(losses: Sequence[Loss], part: str, at: str, numbers: NDArray[np.float64], dial: Dial) -> Finding:
    """Of joints that lose contact at the same places: the load of that where it falls nearest to zero of its peak.

    numbers: of Earles and Wu, (joint, position).
    """
    loss = min(losses, key=lambda one: one.least / one.peak)
    least = loss.least if loss.least > NO_LOAD * loss.peak else 0.0  # less than that is rounding
    number, turning = None, ""
    if loss.turns and np.any(np.isfinite(numbers)):
        number = np.nanmax(numbers)
        turning = f"at {dial.at(int(np.nanargmax(numbers)) % numbers.shape[1])}"
    return finding_for(
        "contact.lost", _where(losses), part=part, least=least, peak=loss.peak, at=at, likely=EARLES_WU,
        number=number, turning=turning, count=len(losses),
    )  # fmt: skip


def _listed(shown: Sequence[str]) -> str:
    more = len(shown) - MOST_PLACES
    return ", ".join(shown[:MOST_PLACES]) + (f" and {more} more" if more > 0 else "")


def _told(places: Sequence[tuple[float, int]], dial: Dial) -> Iterator[tuple[float, str, str, bool]]:
    """Where, and in words, with the end, of every passage; those of an end without a load for a while are one, and
    long."""
    for end, name in enumerate(ENDS):
        own = np.array(sorted(place for place, one in places if one == end))
        for run in np.split(own, np.flatnonzero(np.diff(own) > 1.5) + 1):
            if len(run) > MOST_PLACES:
                yield run[0], f"between {_at(dial, run[0])} and {_at(dial, run[-1])}", name, True
            else:
                yield from ((place, f"at {_at(dial, place)}", name, False) for place in run)


def _at(dial: Dial, place: float) -> str:
    """A place between two positions."""
    k = int(place)
    values = dial.values
    step = values[1] - values[0] if len(values) > 1 else 0.0
    return f"{values[k % len(values)] + (place - k) * step:.4g}{dial.unit}"
