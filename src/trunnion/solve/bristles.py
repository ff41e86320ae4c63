"""Deflection of the bristles of Dahl's and the LuGre law along the cycle.

Their state follows ż = v − d(v) z, linear in z, where v is the slip speed of the joint: known from the motion alone,
for the laws are proportional to the load. Over one interval of the cycle z therefore changes by an affine map
z ↦ A z + B; the maps are found for all intervals at once, chained, and closed over a periodic cycle by
z₀ = B/(1 − A). Over a range the bristles start at rest, z₀ = 0.

Inside an interval v is the cubic through the speeds and accelerations at its ends. It is cut at the reversal of v, if
there is one, and into steps that grow with the distance from it; in each the way is integrated exactly, d per way is
taken at its middle and the steady deflection v/d as changing evenly, so that Dahl's law, where both are constant, is
solved without error, and stiff bristles follow the steady deflection.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra import literal
from trunnion.algebra.dual import primal, single
from trunnion.algebra.literal import is_zero
from trunnion.algebra.namespace import Number, namespace
from trunnion.joints.friction import FrictionLaw
from trunnion.solve.forward import Assembly, forward
from trunnion.solve.switches import root
from trunnion.solve.system import Cycle, System, Values, law_of, rubbing

INTERVALS = 720  # of one turn of the fastest driver
GROWN = np.linspace(0.0, 1.0, 13) ** 2  # steps on either side of a reversal, by the distance from it
SLOWEST = 1e-30  # m/s, so that d/|v| has a value at rest
NEAR = 1e-9  # of an interval: from where one step of Newton's method gives a reversal to rounding
PerWay = Callable[[Number], Number]  # d/|v|, 1/m, of a slip speed


class _Slip(NamedTuple):
    """Slip speed at the ends of intervals and its derivative by the share of the interval; interval length, s."""

    v0: Number
    v1: Number
    a0: Number
    a1: Number
    length: Number

    @classmethod
    def between(cls, speeds: Number, rates: Number, first: NDArray[np.intp], length: Number) -> _Slip:
        """Of the intervals that begin at the first of the ends given."""
        ends = _picked(speeds, first), _picked(speeds, first + 1)
        return cls(*ends, _picked(rates, first) * length, _picked(rates, first + 1) * length, length)

    def speed(self, s: Number) -> Number:
        """Cubic at the share s."""
        u = 1 - s
        return u * u * ((1 + 2 * s) * self.v0 + s * self.a0) + s * s * ((3 - 2 * s) * self.v1 - u * self.a1)

    def slope(self, s: Number) -> Number:
        """Derivative of the cubic by the share."""
        u = 1 - s
        return 6 * s * u * (self.v1 - self.v0) + u * (1 - 3 * s) * self.a0 - s * (2 - 3 * s) * self.a1


@dataclass(frozen=True)
class History:
    """Deflections of one joint's bristles at the ends of the intervals of a cycle, and how to get between them."""

    per_way: PerWay
    speeds: Number  # (…, interval + 1), m/s
    rates: Number  # likewise, m/s²
    length: Number  # of an interval, s
    deflections: Number  # (…, interval + 1), m
    periodic: bool

    def at(self, time: Number) -> Number:
        """Deflection at times from the start of the cycle, m."""
        count = np.shape(primal(self.speeds))[-1] - 1
        place = time / self.length
        if self.periodic:
            place = place - count * np.floor(primal(place) / count)
        index = np.clip(np.floor(primal(place)).astype(int), 0, count - 1)
        slip = _Slip.between(self.speeds, self.rates, index, self.length)
        keep, gain = _mapped(self.per_way, slip, place - index)
        return keep * _picked(self.deflections, index) + gain


@np.errstate(all="ignore")
def histories(
    system: System, values: Values, assembly: Assembly, cycle: Cycle, reverse: bool = False
) -> dict[str, History]:
    """The history of every joint whose law has bristles, for these values; reverse: with the cycle run backward."""
    joints = [name for name in rubbing(system) if law_of(system, name).relaxation is not None]
    if not joints or cycle.duration <= 0:
        return {}
    # the cycle takes longer than the nominal one as its slowest driver does
    nominal = system.mechanism.parameters()
    spans = {name: single(system.span(nominal, name).duration) for name in system.mechanism.drivers}
    slowest = max(spans, key=spans.__getitem__)
    duration = cycle.duration * (system.span(values, slowest).duration / spans[slowest])
    count = INTERVALS * max(1, int(np.ceil(cycle.turns)))
    length, ends = duration / count, np.arange(count + 1)
    walk = forward(system, values, assembly, np.linspace(0.0, 1.0, count + 1) * duration)
    histories_of = {}
    for joint in joints:
        per_way = functools.partial(_per_way, law_of(system, joint), values, f"joints.{joint}.friction")
        which, lever = 0 if system.turns(joint) else 1, 1.0
        if system.turns(joint):  # the contact slips along its thread if it has one
            lever, lead = values[f"joints.{joint}.pin.radius"], system.lead(values, joint)
            if joint in system.screws:
                lead = system.ratio(values, system.screws[joint][0])
            if not is_zero(lead):
                lever = namespace(lever, lead).sqrt(lever * lever + lead * lead)
        motions = (walk.rates(joint)[which], walk.second_rates(joint)[which])
        speed, rate = (literal.times(lever, number) + np.zeros(count + 1) for number in motions)
        if reverse:
            speed, rate = -_picked(speed, ends[::-1]), _picked(rate, ends[::-1])
        keep, gain = _mapped(per_way, _Slip.between(speed, rate, ends[:-1], length), np.ones(count))
        deflections = _chained(keep, gain, cycle.periodic)
        histories_of[joint] = History(per_way, speed, rate, length, deflections, cycle.periodic)
    return histories_of


def _mapped(per_way: PerWay, slip: _Slip, until: Number) -> tuple[Number, Number]:
    """A and B of z ↦ A z + B from the start of intervals to the share `until` of them."""
    real = _Slip(*(primal(number) for number in slip))
    v0, v1 = np.broadcast_arrays(real.v0, real.v1)
    changes = v0 * v1 < 0
    # where the speed changes sign: exact to rounding, so that the step beside it has no way to lose
    s = root(real.speed, np.zeros(v0.shape), np.ones(v0.shape), v0, v1, np.where(changes, NEAR, np.inf))
    step = slip.speed(s) / np.where(changes, real.slope(s), 1.0)  # 0 but for its dual part
    cut = namespace(step).where(changes, s - step, 0.0)
    cut = namespace(cut, until).minimum(cut, until)
    keep: Number = 1.0
    gain: Number = 0.0
    for low, high, shares in ((0.0, cut, 1 - GROWN[::-1]), (cut, until, GROWN)):
        for left, right in pairwise(shares):
            left_over, change = _stepped(per_way, slip, low + left * (high - low), low + right * (high - low))
            keep, gain = left_over * keep, left_over * gain + change
    return keep, gain


def _stepped(per_way: PerWay, slip: _Slip, left: Number, right: Number) -> tuple[Number, Number]:
    """One step of z′ = z_s − z by x = ∫ d dt, where z_s = v/d changes evenly from z₀ to z₁:
    z ↦ e z + z₁ − e z₀ − (z₁ − z₀) (1 − e)/x, e = exp(−x). d/|v| is that of the middle."""
    v0, middle, v1 = slip.speed(left), slip.speed((left + right) / 2), slip.speed(right)
    travel = slip.length * (right - left) * (v0 + 4 * middle + v1) / 6
    xp = namespace(travel)
    sense = xp.sign(travel)
    x = per_way(middle) * xp.abs(travel)
    z0, z1 = (sense / per_way(speed) for speed in (v0, v1))
    xp = namespace(x)
    left_over = xp.exp(-x)
    tiny = primal(x) < 1e-12
    share = xp.where(tiny, 1.0, (1 - left_over) / xp.where(tiny, 1.0, x))
    return left_over, z1 - left_over * z0 - (z1 - z0) * share


def _per_way(law: FrictionLaw, values: Values, path: str, speed: Number) -> Number:
    """d/|v|, 1/m, also where v is 0, of the friction whose parameters stand under a path."""
    assert law.relaxation is not None  # it has bristles
    xp = namespace(speed)
    size = xp.maximum(xp.abs(speed), SLOWEST)
    return law.relaxation(size, **{name: values[f"{path}.{name}"] for name in law.parameters}) / size


def _chained(keep: Number, gain: Number, periodic: bool) -> Number:
    """Deflections at all ends of intervals from their maps, periodic or from rest: by doubling the span of the maps."""
    xp = namespace(keep, gain)
    count = np.shape(primal(gain))[-1]
    finite = np.isfinite(primal(keep) + primal(gain))  # where there is no motion the bristles come to rest
    keep, gain = xp.where(finite, keep, 0.0), xp.where(finite, gain, 0.0)
    whole_keep, whole_gain = keep, gain
    index = np.arange(count)
    reach = 1
    while reach < count:
        earlier = np.maximum(index - reach, 0)
        inside = index >= reach
        before_keep, before_gain = _picked(whole_keep, earlier), _picked(whole_gain, earlier)
        whole_gain = xp.where(inside, whole_keep * before_gain + whole_gain, whole_gain)
        whole_keep = xp.where(inside, whole_keep * before_keep, whole_keep)
        reach *= 2
    start: Number = 0.0
    if periodic:
        last = np.array([count - 1])
        lost = 1 - _picked(whole_keep, last)
        moves = primal(lost) > 0
        start = xp.where(moves, _picked(whole_gain, last) / xp.where(moves, lost, 1.0), 0.0)
    ends = whole_keep * start + whole_gain
    first = np.arange(count + 1) == 0
    return xp.where(first, start, _picked(ends, np.maximum(np.arange(count + 1) - 1, 0)))


def _picked(number: Number, index: NDArray[np.intp]) -> Number:
    """Entries along the last axis: the same for all samples, or a row of indices for each."""
    if np.ndim(index) <= 1:
        return number[..., index]
    if len(np.shape(primal(number))) == 1:
        return number[index]
    rows = np.arange(np.shape(index)[0])[:, None]
    return number[rows if np.shape(primal(number))[0] > 1 else 0 * rows, index]
