"""What the turns of a condition say together: drift of a zero, wrong signs, a speed that is not steady."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding
from trunnion.model.names import as_key
from trunnion.rig.reading.log import Account, counted
from trunnion.rig.reading.mapping import Channel
from trunnion.rig.reading.turns import Turns, turn_means

__all__ = ["Drift", "backward_finding", "backwards", "drift", "signs", "speeds", "steady"]

Array = NDArray[np.float64]
RPM = np.pi / 30
STEADY = 0.03  # of the mean speed, between the slowest and the fastest turn
CERTAIN = 6.0  # standard errors from which a slope is one
PLAIN = 3.0  # times what turns scatter about the line, that a drift amounts to
MOST = 0.95  # of the turns, in which a power has the wrong sign if the channel has it
APART = 0.03  # of a mean speed, between the angle and the channel that reads it
SHARE = 0.002  # of the largest value over the turn, that a drift amounts to


@dataclass(frozen=True)
class Drift:
    """A zero that creeps: slope and its standard error, SI a second, and what it amounts to over the turns.

    span: from the middle of the first turn to that of the last, over which the change is.
    """

    slope: float
    error: float
    change: float
    scatter: float
    span: float


def drift(parts: Sequence[tuple[Turns, Array]]) -> Drift | None:
    """The slope that the means of turns have in common in all conditions of a file, where it is plain; else None."""
    times: list[Array] = []
    means: list[Array] = []
    largest, within, ends = 0.0, 0, []
    for turns, course in parts:
        mean = turn_means(course)
        middle = 0.5 * (turns.begin + turns.end)
        finite = np.isfinite(mean)
        if np.count_nonzero(finite) < 3:
            continue
        within += 1
        ends += [float(middle[finite].min()), float(middle[finite].max())]
        times.append(middle[finite] - middle[finite].mean())
        means.append(mean[finite] - mean[finite].mean())
        largest = max(largest, float(np.nanmax(np.abs(course))))
    if not times:
        return None
    t, y = np.concatenate(times), np.concatenate(means)
    free = t.size - within - 1
    square = float(np.sum(t**2))
    if free < 4 or square == 0:
        return None
    slope = float(np.sum(t * y)) / square
    scatter = float(np.sqrt(np.sum((y - slope * t) ** 2) / free))
    error = scatter / np.sqrt(square)
    span = max(ends) - min(ends)
    change = slope * span
    if change == 0 or abs(slope) < CERTAIN * error or abs(change) < PLAIN * scatter or abs(change) < SHARE * largest:
        return None
    return Drift(slope, error, change, scatter, span)


def steady(turns: Turns, step: float, where: str, account: Account) -> None:
    """Tell where the turns of a condition are not equally fast, by more than the sampling can tell."""
    lengths = turns.end - turns.begin
    if lengths.size < 2:
        return
    spread = float(np.ptp(1 / lengths)) / float(np.mean(1 / lengths))
    if spread > STEADY + 2 * step / float(np.mean(lengths)):
        slow, fast = 60 / float(lengths.max()), 60 / float(lengths.min())
        what = f"the speed is not steady: {slow:.4g} to {fast:.4g} cycles a minute, {100 * spread:.3g} % between turns"
        account.warn(
            "data.speed.unsteady",
            where,
            what,
            "state files: over: to use the steady part, or improve the speed control",
        )


def signs(
    channels: Mapping[str, Channel],
    courses: Mapping[str, Array],
    zeros: Mapping[str, float],
    turning: float | None,
    account: Account,
) -> list[str]:
    """Channels that are likely to have the wrong sign: power in, or power out, below zero in all turns of a file.

    courses: turns of all conditions; zeros: standard uncertainty of the zero of each channel, SI, within which the mean
    of a power tells no sign; turning: mean speed of the driver by its angle, rad/s with its sign.
    """
    rates = {one.measures.partition(":")[2]: key for key, one in channels.items() if one.measures.startswith("rate:")}
    drivers = {
        one.measures.partition(":")[2]: key for key, one in channels.items() if one.measures.startswith("effort:")
    }
    suspects, gives = [], False
    for driver, effort in drivers.items():
        rate = rates.get(driver)
        if rate is None and (turning is None or len(drivers) > 1):
            continue
        against = courses[rate] if rate else np.full_like(courses[effort], turning or 0.0)
        power = turn_means(courses[effort] * against)
        power = power[np.isfinite(power)]
        if _against(power, zeros[effort] * against):
            opposed = (
                rate and turning is not None and float(np.nanmean(courses[rate])) * turning < 0 and len(drivers) == 1
            )
            likely = str(rate) if opposed else effort
            cause = (
                "the angle has the wrong sign"
                if opposed
                else f"the sign of {likely} is wrong, unless the load drives the motor"
            )
            what = f"the power into {driver} is negative in {_of(power)}"
            account.warn(
                "data.power.sign",
                f"channels.{likely}",
                f"sign: {what} ({power.mean():.4g} W): {cause}",
                f"write sign: {-channels[likely].sign}"
                + ("" if rate else "; or sign: in angle:, if that runs backwards"),
            )
            suspects.append(likely)
        gives = gives or bool(power.size and np.mean(power > 0) > MOST) or effort in suspects
    loads = {one.measures.partition(":")[2]: key for key, one in channels.items() if one.measures.startswith("load:")}
    out = [key for joint, key in rates.items() if joint not in drivers]
    for load, key in loads.items():
        rate = rates.get(load) or (out[0] if len(out) == 1 else None)
        if rate is None or not gives:
            continue
        power = turn_means(courses[key] * courses[rate])
        power = power[np.isfinite(power)]
        if _against(power, zeros[key] * courses[rate]):
            what = f"sign: the power delivered to {load} is negative in {_of(power)}"
            what = f"{what} ({power.mean():.4g} W) while the drive delivers power"
            remedy = f"write sign: {-channels[key].sign} (or turn that of {rate})"
            account.warn("data.power.sign", f"channels.{key}", what, remedy)
            suspects.append(key)
    return suspects


def backwards(
    channels: Mapping[str, Channel], values: Sequence[Mapping[str, float]], turning: float, account: Account
) -> bool:
    """Tell where the angle turns the other way than a driver whose speed is set; turning: by the angle, rad/s."""
    drivers = {name for one in channels.values() for kind, _, name in [one.measures.partition(":")] if kind == "effort"}
    stated = {name: row[f"{name}.speed"] for row in values for name in drivers if f"{name}.speed" in row}
    for name, speed in stated.items():
        if len(drivers) == 1 and speed * turning < 0:
            account.findings.append(backward_finding(name, turning, speed, account.file))
            return True
    return False


def backward_finding(driver: str, measured: float, stated: float, file: str = "") -> Finding:
    """An error of an angle that runs against the driver; speeds in rad/s."""
    what = f"the angle runs backwards: {measured / RPM:.4g} rpm measured, {stated / RPM:.4g} rpm stated of {driver}"
    speed = as_key(f"{driver}.speed")
    remedy = f"if it does turn so, set {speed} below zero; else add sign: -1 to angle:, or remove it there"
    figures = {"measured": measured, "stated": stated, "driver": driver}
    return Finding(what, "angle", remedy, file=file, code="data.angle.backwards", figures=figures)


def speeds(
    channels: Mapping[str, Channel],
    courses: Mapping[str, Array],
    units: Mapping[str, tuple[str, float]],
    turning: float,
    told: Sequence[str],
    account: Account,
) -> None:
    """Tell where the angle turns at another mean speed than the channel of its driver reads, or the other way.

    units: in which the figures of each channel are told, with their size in SI; turning: mean speed by the angle, rad/s
    with its sign; told: channels whose sign is said to be wrong.
    """
    drivers = [one.measures.partition(":")[2] for one in channels.values() if one.measures.startswith("effort:")]
    names = [key for key, one in channels.items() if one.measures in {f"rate:{driver}" for driver in drivers}]
    if len(set(drivers)) != 1 or not names or names[0] in told or not turning:
        return
    course = courses[names[0]]
    known = course[np.isfinite(course)]
    if not known.size or not known.any():
        return
    # over equal angles the mean of a speed in time is the harmonic one
    one_way = np.all(known > 0) or np.all(known < 0)
    read = float(1 / np.mean(1 / known)) if one_way else float(np.mean(known))
    ratio = turning / read if read else np.inf
    if abs(ratio - 1) <= APART:
        return
    unit, size = units[names[0]]
    where = f"channels.{names[0]}"
    both = f"the angle turns at {turning / size:.4g} {unit}, '{names[0]}' reads {read / size:.4g} {unit}"
    if abs(ratio + 1) <= APART:
        account.warn(
            "data.rate.sign", where, f"sign: {both}", f"write sign: {-channels[names[0]].sign}, or turn angle.sign"
        )
        return
    account.warn(
        "data.rate.ratio",
        where,
        f"{both}, {ratio:.4g} times",
        "check unit and gain of the channel, and per_turn or unit of angle",
    )


def _against(power: Array, by_zero: Array) -> bool:
    """Whether a power is below zero in most turns, by more than an error of the zero may make it."""
    return bool(power.size and np.mean(power < 0) > MOST and abs(np.mean(power)) > 2 * abs(np.nanmean(by_zero)))


def _of(power: Array) -> str:
    below = int(np.count_nonzero(power < 0))
    return f"all {counted(below, 'turn')}" if below == power.size else f"{below:,} of {counted(power.size, 'turn')}"
