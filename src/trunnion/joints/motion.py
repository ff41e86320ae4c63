"""Motion laws of a driver: coordinate, rate and second derivative over time.

A law knows nothing of joints: a coordinate is an angle or a slide, by the joint that is driven. Rises between two
coordinates are made of a profile, a normalised displacement s(u) with s(0) = 0 and s(1) = 1. A new profile is one
function and one entry of `MOTION_LAWS`; the model's schema, its checks, the documentation and the tests read it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import reduce
from typing import NamedTuple

import numpy as np

from trunnion.algebra.dual import primal
from trunnion.algebra.namespace import Number, namespace
from trunnion.algebra.spline import Spline, spline

# What a driver states, by key: `speed`, `range.from`, `points.0.time` …, SI; `returns` and `periodic` are bool.
Parameters = Mapping[str, Number]


class Drive(NamedTuple):
    """A coordinate (rad or m) with its rate and second derivative by time (s), or a displacement with those by u."""

    value: Number
    rate: Number
    second: Number


Profile = Callable[[Number], Drive]  # s, s′, s″ on 0 ≤ u ≤ 1


class Span(NamedTuple):
    """One cycle of a driver.

    duration: s; periodic: it repeats; rests: it stays at its end afterwards; one_way: its coordinate names the
    position; peak: largest rate, rad/s or m/s; travel: distance between its extreme coordinates, rad or m.
    """

    duration: Number
    periodic: bool
    rests: bool
    one_way: bool
    peak: Number
    travel: Number


@dataclass(frozen=True)
class MotionLaw:
    """A motion law with what it is stated by and where it comes from.

    function: `(time, parameters) -> Drive`; span: its cycle; needs: keys that must be given; takes: keys that may
    be; profile: of a rise, with the largest s′ and |s″| as published; knots: times, s, within one cycle, at which a
    derivative of the coordinate jumps.
    """

    function: Callable[[Number, Parameters], Drive]
    span: Callable[[Parameters], Span]
    needs: tuple[str, ...]
    takes: tuple[str, ...] = ()
    source: str = ""
    validity: str = ""
    profile: Profile | None = None
    peak_rate: float = 0.0
    peak_second: float = 0.0
    knots: Callable[[Parameters], list[Number]] = lambda parameters: []


# ---- steady laws ----------------------------------------------------------------------------------------------


def constant(time: Number, parameters: Parameters) -> Drive:
    """Constant speed: q = q₀ + v t from the start, or from the first end of the range."""
    first = parameters["range.from"] if "range.from" in parameters else parameters.get("start", 0.0)
    return Drive(first + parameters["speed"] * time, parameters["speed"], 0.0)


def _constant_span(parameters: Parameters) -> Span:
    """The range, or a full turn. A range against the speed has a negative duration."""
    speed = primal(parameters["speed"])
    if "range.from" in parameters:
        extent = primal(parameters["range.to"]) - primal(parameters["range.from"])
        return Span(extent / speed, False, False, True, np.abs(speed), np.abs(extent))
    return Span(2 * np.pi / np.abs(speed), True, False, True, np.abs(speed), 2 * np.pi)


def harmonic(time: Number, parameters: Parameters) -> Drive:
    """Harmonic motion: q = mean + amplitude sin(2π t / period + phase)."""
    w = 2 * np.pi / parameters["period"]
    angle = w * time + parameters["phase"]
    xp = namespace(angle)
    swing, slope = parameters["amplitude"] * xp.sin(angle), parameters["amplitude"] * xp.cos(angle)
    return Drive(parameters["mean"] + swing, w * slope, -(w * w) * swing)


def _harmonic_span(parameters: Parameters) -> Span:
    period, amplitude = primal(parameters["period"]), np.abs(primal(parameters["amplitude"]))
    return Span(period, True, False, False, 2 * np.pi * amplitude / period, 2 * amplitude)


# ---- profiles -------------------------------------------------------------------------------------------------

NORTON = "R. L. Norton, Design of Machinery, McGraw-Hill, chapter 8 (cam design)"


def cycloidal(u: Number) -> Drive:
    """Cycloidal displacement: s = u − sin(2πu)/2π. Source: R. L. Norton, Design of Machinery, chapter 8."""
    xp = namespace(u)
    angle = 2 * np.pi * u
    sine = xp.sin(angle)
    return Drive(u - sine / (2 * np.pi), 1 - xp.cos(angle), 2 * np.pi * sine)


def polynomial_345(u: Number) -> Drive:
    """3-4-5 polynomial: s = 10u³ − 15u⁴ + 6u⁵. Source: R. L. Norton, Design of Machinery, chapter 8."""
    rest = u * (1 - u)
    return Drive(u * u * u * (10 + u * (6 * u - 15)), 30 * rest * rest, 60 * rest * (1 - 2 * u))


def modified_sine(u: Number) -> Drive:
    """Modified sine: acceleration is a sine of period 1/2 in the first and last eighth, of period 3/2 between.

    With c = π/(4 + π): s″ = 4πc sin 4πu, 4πc cos(4πu/3 − π/6), 4πc sin 4πu.
    """
    xp = namespace(u)
    c = np.pi / (4 + np.pi)
    outer, inner = 4 * np.pi * u, 4 * np.pi * u / 3 - np.pi / 6
    ends, middle = primal(u), (primal(u) >= 0.125) & (primal(u) <= 0.875)
    shift = np.where(ends > 0.5, 4 / (4 + np.pi), 0.0)
    s = xp.where(middle, (2 - 2.25 * xp.cos(inner)) / (4 + np.pi), shift - xp.sin(outer) / (4 * (4 + np.pi)))
    rate = xp.where(middle, 1 + 3 * xp.sin(inner), 1 - xp.cos(outer))
    second = xp.where(middle, xp.cos(inner), xp.sin(outer))
    return Drive(c * u + s, c * rate, 4 * np.pi * c * second)


def _risen(profile: Profile, time: Number, duration: Number) -> Drive:
    """A profile with its derivatives by time, exactly at rest before 0 and after its duration."""
    xp = namespace(time, duration)
    u = time / duration
    before, after = primal(u) <= 0, primal(u) >= 1
    s, rate, second = profile(xp.where(before, 0.0, xp.where(after, 1.0, u)))
    moving = ~(before | after)
    return Drive(s, xp.where(moving, rate / duration, 0.0), xp.where(moving, second / (duration * duration), 0.0))


def _return_duration(parameters: Parameters) -> Number:
    """Time of the return, s: that of the rise if it is not stated."""
    return parameters["return_duration"] if "return_duration" in parameters else parameters["duration"]


def _between(profile: Profile) -> Callable[[Number, Parameters], Drive]:
    """The law that rises and returns along a profile."""

    def motion(time: Number, parameters: Parameters) -> Drive:
        """Rise from the first to the second end of the range, dwell, return, dwell; or rise and stay."""
        duration, step = parameters["duration"], parameters["duration"] + parameters["dwell"]
        back = _return_duration(parameters)
        moment = time - parameters["delay"]
        if not parameters["returns"]:
            parts = _risen(profile, moment, duration)
        else:
            period = step + back + parameters["dwell"]
            moment = moment - np.floor(primal(moment) / primal(period)) * period
            up, down = _risen(profile, moment, duration), _risen(profile, moment - step, back)
            parts = Drive(*(a - b for a, b in zip(up, down, strict=True)))
        extent = parameters["range.to"] - parameters["range.from"]
        return Drive(parameters["range.from"] + extent * parts.value, extent * parts.rate, extent * parts.second)

    return motion


def _profile(profile: Profile, peak_rate: float, peak_second: float, source: str, validity: str) -> MotionLaw:
    """The law of a profile."""

    def span(parameters: Parameters) -> Span:
        duration, dwell, delay = (primal(parameters[key]) for key in ("duration", "dwell", "delay"))
        travel = np.abs(primal(parameters["range.to"] - parameters["range.from"]))
        if parameters["returns"]:
            back = primal(_return_duration(parameters))
            peak = peak_rate * travel / np.minimum(duration, back)
            return Span(duration + back + 2 * dwell, True, False, False, peak, travel)
        peak = peak_rate * travel / duration
        one_way = bool(np.all(dwell == 0) and np.all(delay == 0))
        return Span(delay + duration + dwell, False, True, one_way, peak, travel)

    def knots(parameters: Parameters) -> list[Number]:
        """Ends of the rise and of the return, and where the profile goes from one function to the next."""
        duration, start = parameters["duration"], parameters["delay"]
        inner = (0.0, 0.125, 0.875, 1.0) if profile is modified_sine else (0.0, 1.0)
        instants = [start + part * duration for part in inner]
        if parameters["returns"]:
            start, back = start + duration + parameters["dwell"], _return_duration(parameters)
            instants += [start + part * back for part in inner]
        return instants

    return MotionLaw(
        _between(profile),
        span,
        needs=("range", "duration"),
        takes=("return_duration", "dwell", "returns", "delay"),
        source=source,
        validity=validity,
        profile=profile,
        peak_rate=peak_rate,
        peak_second=peak_second,
        knots=knots,
    )


# ---- table ----------------------------------------------------------------------------------------------------


def table(time: Number, parameters: Parameters) -> Drive:
    """A cubic spline through points (time, coordinate).

    Periodic: again and again, advancing by what its last coordinate is beyond its first. Else its ends are
    clamped: it starts from rest, ends at rest and stays there; or natural: no acceleration at its ends.
    """
    curve = _curve(parameters)
    first, last = curve.knots[0], curve.knots[-1]
    moment = time - parameters["delay"]
    if parameters["periodic"]:
        periods = np.floor(primal(moment - first) / primal(last - first))
        value, rate, second = curve.at(moment - periods * (last - first))
        return Drive(value + periods * (curve.values[-1] - curve.values[0]), rate, second)
    value, rate, second = curve.at(moment)
    if parameters["ends"] == "natural":
        return Drive(value, rate, second)
    xp = namespace(value)
    before, after = primal(moment - first) < 0, primal(moment - last) > 0
    resting = before | after
    value = xp.where(before, curve.values[0], xp.where(after, curve.values[-1], value))
    return Drive(value, xp.where(resting, 0.0, rate), xp.where(resting, 0.0, second))


def _curve(parameters: Parameters) -> Spline:
    count = 0
    while f"points.{count}.time" in parameters:
        count += 1
    times, values = ([parameters[f"points.{k}.{key}"] for k in range(count)] for key in ("time", "coordinate"))
    return spline(times, values, "periodic" if parameters["periodic"] else parameters["ends"])


def _table_span(parameters: Parameters) -> Span:
    """Rates are looked at in the points and midway between them, where a cubic's rate has its extremes but for a
    skewed one."""
    curve = _curve(parameters)
    knots, values, slopes = ([primal(n) for n in numbers] for numbers in curve[:3])
    steps = range(len(knots) - 1)
    chords = [(values[k + 1] - values[k]) / (knots[k + 1] - knots[k]) for k in steps]
    midway = [1.5 * chords[k] - (slopes[k] + slopes[k + 1]) / 4 for k in steps]
    rates = [*midway, *(slopes[1:-1] if parameters["ends"] == "clamped" else slopes)]
    peak, high, low = reduce(np.maximum, map(np.abs, rates)), reduce(np.maximum, values), reduce(np.minimum, values)
    signs = {float(sign) for rate in rates for sign in np.ravel(np.sign(rate))}
    delay = primal(parameters["delay"])
    one_way = len(signs) == 1 and 0.0 not in signs and bool(parameters["periodic"] or np.all(delay == 0))
    if parameters["periodic"]:
        return Span(knots[-1] - knots[0], True, False, one_way, peak, high - low)
    return Span(delay + knots[-1], False, parameters["ends"] == "clamped", one_way, peak, high - low)


MOTION_LAWS: dict[str, MotionLaw] = {
    "constant": MotionLaw(
        constant,
        _constant_span,
        needs=("speed",),
        takes=("start", "range"),
        source="definition",
        validity="constant speed; one full turn, or a range",
    ),
    "harmonic": MotionLaw(
        harmonic,
        _harmonic_span,
        needs=("amplitude", "period"),
        takes=("mean", "phase"),
        source="definition: q = mean + amplitude sin(2π t / period + phase)",
        validity="periodic oscillation; all derivatives are continuous",
    ),
    "cycloidal": _profile(
        cycloidal,
        2.0,
        2 * math.pi,
        source=f"{NORTON}: s = u − sin(2πu)/2π",
        validity="no jump of acceleration at the ends; the highest peak acceleration of the three profiles",
    ),
    "polynomial-345": _profile(
        polynomial_345,
        15 / 8,
        10 / math.sqrt(3),
        source=f"{NORTON}: s = 10u³ − 15u⁴ + 6u⁵",
        validity="no jump of acceleration at the ends; nearly as gentle in speed as in acceleration",
    ),
    "modified-sine": _profile(
        modified_sine,
        4 * math.pi / (4 + math.pi),
        4 * math.pi**2 / (4 + math.pi),
        source=f"C. N. Neklutin, Mechanisms and Cams for Automatic Machines, Elsevier 1969; {NORTON}",
        validity="no jump of acceleration at the ends; the lowest peak speed of the three: for heavy loads",
    ),
    "table": MotionLaw(
        table,
        _table_span,
        needs=("points",),
        takes=("periodic", "ends", "delay"),
        source="cubic spline: C. de Boor, A Practical Guide to Splines, Springer 1978, chapter IV",
        validity="the curve may swing between points far apart: state enough of them",
        knots=lambda parameters: [knot + parameters["delay"] for knot in _curve(parameters).knots],
    ),
}
