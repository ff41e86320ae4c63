"""A running count of pulses without what its counter does to it: it wraps, is set back, or reads wild for a moment."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError
from trunnion.rig.reading.account import Account, counted, times
from trunnion.rig.reading.mapping import AngleSource

__all__ = ["unwrapped"]

Array = NDArray[np.float64]
Places = NDArray[np.intp]
MODULI = (1 << 8, 1 << 16, 1 << 24, 1 << 32)  # at which counters usually wrap
AROUND = 8  # steps about a fall, that tell how far the count would have gone
WILD = 20.0  # times the largest usual step, by which a single reading is off
SURE = 0.15  # of a count, standard error of a place to wrap at that can be rounded to a whole number


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
        what = f"{what}, and where it wraps cannot be told to the pulse"
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
    what = f"{what}, {times(seconds[wild])}, such as {readings[wild[0]]:,.6g}; the one before holds there"
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
