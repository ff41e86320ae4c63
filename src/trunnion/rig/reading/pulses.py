"""Pulses of an encoder: from a running count, which may wrap, or from the edges of a level; pulses lost on the way."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from trunnion.errors import Finding, MechanismError
from trunnion.rig.reading.log import Account, counted, times
from trunnion.rig.reading.mapping import AngleSource
from trunnion.rig.reading.timebase import GAP, Timeline

__all__ = ["Pulses", "by_index", "index_times", "pulses_of", "unwrapped"]

Array = NDArray[np.float64]
TOLD_BY = 5  # samples between pulses from which a lost one shows in the time between its neighbours
Places = NDArray[np.intp]
MODULI = (1 << 8, 1 << 16, 1 << 24, 1 << 32)  # at which counters usually wrap
AROUND = 8  # steps about a fall, that tell how far the count would have gone
STANDS = 3.0  # times the usual time of a count, from which the shaft stands or a pulse is lost
WILD = 20.0  # times the largest usual step, by which a single reading is off
SURE = 0.15  # of a count, standard error of a place to wrap at that can be rounded to a whole number


@dataclass(frozen=True)
class Pulses:
    """Times at which counts were reached.

    counts: (pulse,), of a turn `per_turn`; spoilt: from when to when pulses were lost, (stretch, 2); until: from when
    on they were missed; crossings: whether the times are finer than the sampling; slack: counts between two samples.
    """

    times: Array
    counts: Array
    spoilt: Array
    until: float | None = None
    crossings: bool = False

    def slack(self, step: float) -> float:
        """Counts from one sample to the next, in the mean while the shaft turns.

        The median would be 1 of 1.2: most samples then count on by one, some by two.
        """
        counts, times = np.abs(np.diff(self.counts)), np.diff(self.times)
        each = times / np.maximum(counts, 0.5)
        turning = each < STANDS * np.median(each)
        return step * float(np.sum(counts[turning]) / np.sum(times[turning]))


def pulses_of(source: AngleSource, readings: Array, line: Timeline, indexed: bool, account: Account) -> Pulses:
    """The pulses in the readings of an encoder's column; indexed: whether an index sets the count right."""
    finite = np.isfinite(readings)
    bad = readings.size - int(np.count_nonzero(finite))
    if bad:
        what = f"{counted(bad, 'cell')} of '{source.column}' of {readings.size:,} are no number"
        account.warn(
            "data.counter.missing",
            "angle",
            f"{what}; the previous reading is used there",
            "check the counter and its cable",
        )
    if source.kind == "level":
        found = _edges(readings, line)
        if found.times.size > 2:
            found = _of_level(source, found, line, indexed, account)
    else:
        found = _of_count(source, readings[finite], line.seconds[finite], line.step, indexed, account)
    if indexed or found.times.size < 9:
        return found
    return _missed(found, line.step, 0.5 * (source.per_turn or 0), account)


def _of_count(
    source: AngleSource, readings: Array, seconds: Array, step: float, indexed: bool, account: Account
) -> Pulses:
    """The rows where the count changes; the edge lies between two samples, its time is taken in the middle.

    From a to b it passes b if it counts on by one; if it jumps, half way the count is (a + b + 1)/2 in the mean.
    """
    if readings.size < 2:
        return Pulses(np.empty(0), np.empty(0), np.empty((0, 2)))
    counts, back = unwrapped(source, readings, seconds, account)
    at = np.flatnonzero(np.diff(counts) != 0)
    at = at[np.diff(seconds)[at] <= GAP * step]
    before, after = counts[at], counts[at + 1]
    found = Pulses(0.5 * (seconds[at] + seconds[at + 1]), 0.5 * (before + after + 1.0), np.empty((0, 2)))
    if not back.size:
        return found
    if indexed:
        return replace(found, spoilt=np.column_stack([seconds[back], seconds[back + 1]]))
    return replace(found, until=float(seconds[back[0]]))


def _edges(readings: Array, line: Timeline) -> Pulses:
    """Rising edges of a level: it passes the middle, having been in the lower quarter since the last one."""
    held = _held(readings)
    if not held.size:
        return Pulses(np.empty(0), np.empty(0), np.empty((0, 2)))
    low, high = (float(one) for one in np.percentile(held, (0.1, 99.9)))
    low, high = (low, high) if high > low else (float(held.min()), float(held.max()))
    if high <= low:
        return Pulses(np.empty(0), np.empty(0), np.empty((0, 2)))
    state = np.zeros(held.size, dtype=np.int8)
    state[held > low + 0.6 * (high - low)] = 1
    state[held < low + 0.4 * (high - low)] = -1
    known = np.flatnonzero(state)
    rises = known[1:][(state[known[1:]] == 1) & (state[known[:-1]] == -1)]
    middle = low + 0.5 * (high - low)
    before, after = np.maximum(rises - 1, 0), rises
    share = np.clip(
        (middle - held[before]) / np.where(held[after] == held[before], 1.0, held[after] - held[before]), 0, 1
    )
    seconds = line.seconds[before] + share * (line.seconds[after] - line.seconds[before])
    between = np.count_nonzero(state == 0) > 0.02 * state.size
    return Pulses(seconds, np.arange(seconds.size, dtype=np.float64), np.empty((0, 2)), crossings=bool(between))


def _held(readings: Array) -> Array:
    """Readings with the one before where there is none."""
    finite = np.isfinite(readings)
    if finite.all() or not finite.any():
        return readings if finite.all() else np.empty(0)
    last = np.maximum.accumulate(np.where(finite, np.arange(readings.size), 0))
    first = int(np.argmax(finite))
    return np.asarray(np.where(np.arange(readings.size) < first, readings[first], readings[last]))


def _of_level(source: AngleSource, found: Pulses, line: Timeline, indexed: bool, account: Account) -> Pulses:
    """The pulses of a level with what the sampling makes of them."""
    usual = float(np.median(np.diff(found.times))) / line.step
    if usual < 2.5:
        what = f"a pulse of the encoder has {usual:.3g} samples: edges are missed"
        account.warn("data.pulses.few_samples", "angle", what, "sample at least 4 times a pulse, or record a count")
    inside = line.breaks[line.seconds[line.breaks] < found.times[-1]] if line.breaks.size else line.breaks
    if inside.size and not indexed:
        until = float(line.seconds[inside[0] - 1])
        what = f"no pulses are counted in gaps of time: the angle is not known after {until:.5g} s"
        account.warn(
            "data.pulses.gap",
            "angle",
            f"{what}; the turns from there on are left out",
            "record a count, or add an index",
        )
        return replace(found, until=until)
    return found


def _missed(found: Pulses, step: float, most: float, account: Account) -> Pulses:
    """Pulses that are missing or too many, told by the time between their neighbours; the count is set right.

    most: pulses in a row that are taken for lost; more, and the shaft stood.
    """
    between = np.diff(found.times)
    jumps = np.abs(np.diff(found.counts))
    each = between / np.maximum(jumps, 1.0)
    usual = median_filter(each, size=7, mode="nearest")
    if float(np.median(usual)) < TOLD_BY * step:
        return found
    calm = np.abs(median_filter(each, size=3, mode="nearest") / usual - 1) < 0.25
    single = jumps == 1
    lost = np.where(calm & single & (each > 1.6 * usual) & (each < most * usual), np.rint(each / usual) - 1, 0.0)
    pairs = np.zeros(each.size)
    short = (each[:-1] + each[1:] < 1.4 * usual[:-1]) & (each[:-1] + each[1:] > 0.6 * usual[:-1])
    pairs[1:][short & single[1:] & single[:-1]] = -1.0
    pairs[2:][(pairs[1:-1] < 0) & (pairs[2:] < 0)] = 0.0
    change = lost + pairs
    if not np.any(change):
        return found
    if np.count_nonzero(change) > 0.02 * each.size:  # the shaft itself runs unevenly
        return found
    at = found.times[:-1][change != 0]
    told = []
    if np.any(lost):
        told.append(f"{counted(int(lost.sum()), 'pulse')} lost")
    if np.any(pairs):
        told.append(f"{counted(int(-pairs.sum()), 'pulse')} too many")
    what = f"the encoder: {' and '.join(told)}, {times(at)}; the count is corrected, these turns are left out"
    account.warn("data.pulses.wrong", "angle", what, "check encoder, cable and counter")
    way = np.sign(found.counts[-1] - found.counts[0]) or 1.0
    mended = found.counts + way * np.concatenate([[0.0], np.cumsum(change)])
    return replace(found, counts=mended, spoilt=np.column_stack([at, found.times[1:][change != 0]]))


def index_times(readings: Array, line: Timeline, name: str, account: Account) -> Array:
    """Times of the pulses of an index."""
    found = _edges(line.rows(readings), line).times
    if found.size == 0:
        account.warn(
            "data.index.none", "angle.index", f"the column '{name}' has no pulse", "check the column, or remove index"
        )
    return found


def by_index(found: Pulses, index: Array, per_turn: int, step: float, account: Account) -> tuple[Array, Array]:
    """Counts from the first index pulse, set right at each; times of the turns in which pulses were lost.

    With few samples a pulse the count at an index is known to about one: then its median over nine turns is taken.
    """
    at = np.interp(index, found.times, found.counts)
    way = np.sign(at[-1] - at[0]) or 1.0
    _check_per_turn(np.diff(at) * way, per_turn, account)
    turns = np.concatenate([[0.0], np.cumsum(np.maximum(np.rint(np.diff(at) * way / per_turn), 1.0))])
    over = (at - at[0]) * way - per_turn * turns
    usual = float(np.angle(np.mean(np.exp(2j * np.pi * over)))) / (2 * np.pi)
    level = over - usual
    if found.slack(step) > 0.25 and level.size >= 9:
        level = median_filter(level, size=9, mode="nearest")
    level = np.rint(level)
    change = np.diff(level)
    wrong = change != 0
    if np.any(wrong):
        lost, more = -int(change[change < 0].sum()), int(change[change > 0].sum())
        told = [f"{counted(lost, 'pulse')} lost"] * (lost > 0) + [f"{counted(more, 'pulse')} too many"] * (more > 0)
        where = f"in {counted(int(np.count_nonzero(wrong)), 'turn')} of {change.size}, {times(index[:-1][wrong])}"
        what = f"the encoder: {' and '.join(told)} {where}; corrected at the index, these turns are left out"
        account.warn("data.pulses.wrong_index", "angle", what, "check encoder, cable and counter")
    place = np.clip(np.searchsorted(index, found.times, side="right") - 1, 0, index.size - 1)
    return found.counts - at[0] - way * usual - way * level[place], np.column_stack(
        [index[:-1][wrong], index[1:][wrong]]
    )


def _check_per_turn(between: Array, per_turn: int, account: Account) -> None:
    """Tell where most turns of the index have another number of pulses than is stated.

    between: counts from one index pulse to the next.
    """
    usual = float(np.median(between))
    alike = np.abs(between - usual) < max(1.5, 0.01 * abs(usual))
    if between.size < 2 or np.mean(alike) <= 0.5 or abs(usual - per_turn) < max(0.75, 0.01 * per_turn):
        return
    found = float(np.mean(between[alike]))
    what = f"from one index pulse to the next the encoder counts {found:.4g}, angle.per_turn is {per_turn:,}"
    account.warn(
        "data.pulses.per_turn", "angle.per_turn", what, f"state per_turn: {found:.0f}, if the index comes once a turn"
    )


def unwrapped(source: AngleSource, readings: Array, seconds: Array, account: Account) -> tuple[Array, Places]:
    """A count that goes on, and the readings after which its counter was set back, so that what follows has no zero.

    A count that falls by as much each time wraps; where, is told by what is missing for a step like those around.
    """
    if source.wrap is not None:
        return np.unwrap(readings, period=float(source.wrap)), np.empty(0, dtype=np.intp)
    readings = _without_wild(source, readings, seconds, account)
    steps = np.diff(readings)
    way = float(np.sign(np.sum(np.sign(steps)))) or 1.0
    gone = _gone(steps * way)
    span = float(np.ptp(readings))
    least = max(WILD * gone, 1.0) if not source.per_turn else min(max(WILD * gone, 1.0), 0.5 * source.per_turn)
    falls = np.flatnonzero(steps * way < -min(least, 0.5 * span))
    if not falls.size or span < 2:
        return readings, np.empty(0, dtype=np.intp)
    onward, apart = _onward(steps * way, falls)
    sizes = onward - steps[falls] * way  # what the counter has lost at each
    modulus = _modulus(source, sizes, apart)
    if modulus is not None:
        account.say(f"the count of '{source.column}' wraps at {modulus:,.0f}, {counted(falls.size, 'time')}")
        return np.unwrap(readings, period=modulus), np.empty(0, dtype=np.intp)
    if falls.size > 2 and float(np.ptp(sizes)) <= 2 * float(apart.max()) + 1:
        what = f"the count of '{source.column}' falls by about {np.mean(sizes):,.0f}, {counted(falls.size, 'time')}"
        what = f"{what}, and its wrap cannot be located to the pulse"
        raise MechanismError(Finding(what, "angle", "state wrap: of the counter", file=account.file))
    first = falls[0]
    what = f"the count of '{source.column}' is set back {counted(falls.size, 'time')}, {times(seconds[falls])}"
    what = f"{what}, first from {readings[first]:,.0f} to {readings[first + 1]:,.0f}"
    account.warn("data.counter.set_back",
        "angle", f"{what}; without an index the turns from there on are left out",
        "name the parts in files: over:, each by itself, or add an index; state wrap: if the counter is full there",
    )  # fmt: skip
    mended = steps.copy()
    mended[falls] = way * np.rint(onward)
    return np.concatenate([readings[:1], readings[0] + np.cumsum(mended)]), falls


def _gone(steps: Array) -> float:
    """The usual step of those that go on."""
    on = steps[steps > 0]
    return float(np.percentile(on, 90)) if on.size else 0.0


def _without_wild(source: AngleSource, readings: Array, seconds: Array, account: Account) -> Array:
    """The count without single readings that are far off both neighbours, which are close to each other."""
    if readings.size < 5:
        return readings
    steps = np.diff(readings)
    usual = max(float(np.percentile(np.abs(steps), 95)), 1.0)
    out = (np.abs(steps[:-1]) > WILD * usual) & (np.abs(steps[1:]) > WILD * usual)
    wild = 1 + np.flatnonzero(out & (np.abs(steps[:-1] + steps[1:]) <= 3 * usual))
    if not wild.size or wild.size > 0.01 * readings.size:
        return readings
    what = f"{counted(wild.size, 'count')} of '{source.column}' of {readings.size:,} far off the ones before and after"
    what = f"{what}, {times(seconds[wild])}, such as {readings[wild[0]]:,.6g}; the previous reading is used there"
    account.warn("data.counter.wild", "angle", what, "check the counter and its cable")
    mended = readings.copy()
    mended[wild] = mended[wild - 1]
    return mended


def _onward(steps: Array, falls: Places) -> tuple[Array, Array]:
    """How far a count would have gone at each fall, by the steps around that go on, and how far these are apart."""
    going = np.flatnonzero(steps > 0)
    means, spans = np.ones(falls.size), np.zeros(falls.size)
    if not going.size:
        return means, spans
    middle = np.searchsorted(going, falls)
    for k, place in enumerate(middle.tolist()):
        near = steps[going[max(place - AROUND // 2, 0) : place + AROUND // 2]]
        means[k], spans[k] = float(np.mean(near)), float(np.ptp(near))
    return means, spans


def _modulus(source: AngleSource, sizes: Array, apart: Array) -> float | None:
    """Where a counter wraps that has lost so much at each fall; None if that cannot be told."""
    usual = float(np.median(sizes))
    error = float(np.std(sizes)) / np.sqrt(sizes.size) if sizes.size > 1 else float(apart.max())
    near = max(0.5, 3 * error, float(apart.max()) if sizes.size < AROUND else 0.0)
    if np.any(np.abs(sizes - usual) > 2 * apart.max() + 1):
        return None
    known = [float(one) for one in (source.per_turn or 0, *MODULI) if one and abs(one - np.mean(sizes)) <= near]
    if known:
        return known[0]
    whole = float(np.rint(np.mean(sizes)))
    return whole if sizes.size > 1 and (error < SURE or not apart.any()) else None
