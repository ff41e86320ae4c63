"""Whether measures keep their limits, and what helps where they do not.

The worst case is that found on the mechanism where it was searched, else that of first order. A yield below 1 and a
C_pk below 1 miss them too; but where the worst case keeps the limits no mechanism breaks them, however it scatters.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding
from trunnion.measures.measures import Measure
from trunnion.results.quantities import decimals_of, scale_of, signed
from trunnion.studies.tolerance.linear import by_position

if TYPE_CHECKING:
    from trunnion.studies.tolerance.linear import Of
    from trunnion.studies.tolerance.outcome import Outcome
    from trunnion.studies.tolerance.sampled import Sampled

__all__ = ["ENOUGH", "MISSED", "OTHERWISE", "against", "limited", "limits", "missed", "scatters"]

Array = NDArray[np.float64]
MISSED = "limit.missed"  # with which the code of such a finding begins
CLOSE, SLIGHT = 1e-6, 1e-3  # of a limit: rounding, and what first order leaves out where it was kept
OTHERWISE, ENOUGH = 1.5, 100  # ratio of standard deviations that first order does not explain, and samples for it
HALF = 0.5  # of the room: a nominal figure that is further off its middle is to be brought there first


def limited(measure: Measure) -> bool:
    """Whether a measure has a limit or a bound."""
    return any(one is not None for one in (measure.lower, measure.upper, measure.at_least, measure.at_most))


def limits(of: Of) -> tuple[float, float]:
    """Least and largest deviation from nominal that a measure may have; infinite where there is no limit."""
    measure = of.measure
    lower = -np.inf if measure.lower is None else measure.lower
    upper = np.inf if measure.upper is None else measure.upper
    least = -np.inf if measure.at_least is None else measure.at_least
    most = np.inf if measure.at_most is None else measure.at_most
    if measure.rule == "deviation":
        return max(lower, -most), min(upper, most)
    if not against(of):
        return max(lower, least - of.reference.figure), min(upper, most - of.reference.figure)
    if measure.rule == "maximum" and measure.kind != "path_error":
        return -np.inf, min(upper, most)
    if measure.rule == "minimum" and measure.kind != "path_error":
        return max(lower, least), np.inf
    if measure.rule == "mean" and measure.kind != "path_error":
        return max(lower, least), min(upper, most)
    return -min(upper, most), min(upper, most)  # what has a size and no sign


def against(of: Of) -> bool:
    """Whether the figure is made of deviations from the nominal mechanism and is 0 there."""
    return of.measure.kind == "path_error" or (of.reference.against and of.measure.rule != "value")


def scatters(of: Of, sampled: Sampled | None, i: int) -> tuple[float, float] | None:
    """Standard deviations of the samples and of first order, where they differ so much that the latter means little."""
    if sampled is None or by_position(of.reference) or sampled.done < ENOUGH:
        return None
    found, linear = float(sampled.arrays["deviation"][i]), float(of.total.deviation)
    if not np.isfinite(found + linear) or not max(found, linear) > 0:
        return None
    return None if 1 / OTHERWISE < found / max(linear, 1e-300) < OTHERWISE else (found, linear)


# ---- what is missed -------------------------------------------------------------------------------------------


def missed(outcome: Outcome, sampled: Sampled | None) -> Iterator[Finding]:
    """Each measure whose worst case, yield or capability is outside its limits: errors, with what helps.

    Where a yield is asked for, that alone decides.
    """
    if outcome.target is not None:
        yield from _below(outcome, sampled, outcome.target)
        return
    for i, of in enumerate(outcome.study.linear.measures):
        if not limited(of.measure):
            continue
        say = _Words(outcome, of, sampled, i)
        known, beyond = _worst(outcome, i, of)
        parts = [say.range(*known)] if beyond else []
        short = _short(sampled, i, sure=bool(np.all(np.isfinite(known))) and not beyond)
        if parts or short:
            what = f"limits not met: {'; '.join([*parts, *short])}; {say.limits()}"
            remedy = _remedy(outcome, of, say, scatters(of, sampled, i) is not None)
            figures = {"worst_lower": known[0], "worst_upper": known[1], **_sampled(sampled, i)}
            yield Finding.error("limit.missed", f"measures.{of.measure.name}", what, remedy, **figures)


def _below(outcome: Outcome, sampled: Sampled | None, target: float) -> Iterator[Finding]:
    """Measures with a lower yield than is asked for, or else all of them together."""
    if sampled is None or not sampled.done:
        return
    fine = True
    for i, of in enumerate(outcome.study.linear.measures):
        if limited(of.measure) and float(sampled.arrays["yield_high"][i]) < target:
            fine, say = False, _Words(outcome, of, sampled, i)
            short = _short(sampled, i, sure=True)[0]
            remedy = _remedy(outcome, of, say, scatters(of, sampled, i) is not None)
            what = f"limits not met: {short}, required {100 * target:.6g} %; {say.limits()}"
            figures = {"target_percent": 100 * target, **_sampled(sampled, i)}
            yield Finding.error("limit.missed_yield", f"measures.{of.measure.name}", what, remedy, **figures)
    share, low, high = (float(sampled.arrays[f"yield_all{end}"]) for end in ("", "_low", "_high"))
    if fine and high < target:
        percents: dict[str, Any] = {"percent": 100 * share, "percent_low": 100 * low, "percent_high": 100 * high}
        what = f"limits not met: yield of all measures together {100 * share:.6g} % (95 % confidence interval "
        what += f"{100 * low:.5g} to {100 * high:.5g} %), required {100 * target:.6g} %"
        remedy = "narrow the tolerances of the measure with the lowest yield first"
        percents["target_percent"] = 100 * target
        yield Finding.error("limit.missed_together", "measures", what, remedy, **percents)


def _sampled(sampled: Sampled | None, i: int) -> dict[str, Any]:
    """What the samples say of a measure with limits, as figures of a finding."""
    keys = ("yield", "yield_low", "yield_high", "cpk") if sampled is not None and sampled.done else ()
    return {key: float(sampled.arrays[key][i]) for key in keys if sampled is not None}


def _worst(outcome: Outcome, i: int, of: Of) -> tuple[tuple[float, float], bool]:
    """Worst case to either side, as far as it was asked for, and whether it is outside the limits."""
    known, slight = (np.nan, np.nan), CLOSE
    if "linear" in outcome.methods:
        known = float(of.total.lower), float(of.total.upper)
    if outcome.worst is not None and all(np.isfinite(one.value) for one in outcome.worst[i]):
        known, slight = (outcome.worst[i][0].value, outcome.worst[i][1].value), SLIGHT
    lower, upper = limits(of)
    size = max([abs(end) for end in (lower, upper) if np.isfinite(end)], default=0.0)
    return known, known[0] < lower - slight * size or known[1] > upper + slight * size


def _short(sampled: Sampled | None, i: int, sure: bool) -> list[str]:
    """What the samples say of the yield and of C_pk, if they are short; sure: the worst case keeps the limits."""
    if sampled is None or not sampled.done:
        return []
    share, low, high, cpk = (float(sampled.arrays[key][i]) for key in ("yield", "yield_low", "yield_high", "cpk"))
    found = []
    if share < 1:
        own, least, most = (f"{100 * one:.{decimals_of(high - low)}f}" for one in (share, low, high))
        found.append(f"yield {own} % (95 % interval {least} to {most} %)")
    if cpk < 1 and not sure:
        found.append(f"Cpk {cpk:.3g}")
    return found


class _Words:
    """Deviations of a measure in the unit that the tables have them in."""

    def __init__(self, outcome: Outcome, of: Of, sampled: Sampled | None, i: int) -> None:
        self.worst = "worst case" if outcome.worst is not None else "worst case, first order,"
        run = outcome.study.run
        unit = of.measure.figure_unit(run.system, run.values)
        one = of.measure
        known = [end for end in (one.lower, one.upper) if end is not None]
        known += [float(part) for part in of.total[:3]]
        if sampled is not None:
            known.append(3 * float(sampled.arrays["deviation"][i]))
        nominal = of.reference.figure
        self.of = of
        self.factor, self.unit = scale_of(nominal if np.isfinite(nominal) else 0.0, known, unit)

    def say(self, value: float, sign: str = "+") -> str:
        return signed(value, self.factor, self.unit, sign)

    def range(self, low: float, high: float) -> str:
        if limits(self.of)[0] == -limits(self.of)[1] and low == 0.0:
            return f"{self.worst} {self.say(high, '')}"
        return f"{self.worst} {signed(low, self.factor, '')} to {self.say(high)}"

    def limits(self) -> str:
        """Deviations, and bounds of the figure itself with the nominal one."""
        one, told = self.of.measure, []
        if one.lower is not None or one.upper is not None:
            ends = [self.say(end) for end in (one.lower, one.upper) if end is not None]
            told.append(f"allowed {' to '.join(ends)}")
        bounds = (("at least", one.at_least), ("at most", one.at_most))
        told += [f"{word} {self.say(end, '')}" for word, end in bounds if end is not None]
        if one.at_least is not None or one.at_most is not None:
            told.append(f"nominal {self.say(self.of.reference.figure, '')}")
        return ", ".join(told)


# ---- what helps -----------------------------------------------------------------------------------------------


def _remedy(outcome: Outcome, of: Of, say: _Words, otherwise: bool) -> str:
    """What brings the measure within its limits: another nominal mechanism, other middles, or narrower tolerances.

    otherwise: whether samples scatter otherwise than first order, which then does not tell what to narrow.
    """
    lower, upper = limits(of)
    if lower > 0 or upper < 0:
        return (
            "the nominal value is outside the limits: change the mechanism or the limit, tolerances cannot correct it"
        )
    if otherwise:
        return "first order does not describe this measure: use --method sobol to find what to narrow first"
    middle, fixed = _middle(outcome, of)
    if not np.isfinite(middle):
        return "there is no first-order result: change the nominal mechanism, or narrow the tolerances and sample again"
    if not lower < middle < upper:
        what = f"the middle of the tolerances is off by {say.say(middle)}"
        return f"{what}: centre them or change the nominal mechanism, narrower ones cannot correct it"
    off = _off_middle(lower, upper, middle)
    first = f"bring the nominal mechanism {say.say(-off)} nearer to the middle of the limits, and " if off else ""
    name, share = _largest(outcome, of)
    priced = bool(outcome.study.run.system.mechanism.costs)
    whole = "variance" if outcome.target is not None else "worst case"
    narrow = f"{first}narrow first '{name}', {100 * share:.3g} % of the {whole}"
    if not priced:
        return f"{narrow}; `trunnion allocate` finds the cheapest tolerances if the model states `costs`"
    if not fixed and outcome.target is None:
        return f"{narrow}; tolerances without a cost, which `trunnion allocate` keeps, exceed the limits by themselves"
    return f"{narrow}; `trunnion allocate` finds the cheapest tolerances"


def _middle(outcome: Outcome, of: Of) -> tuple[float, bool]:
    """Deviation of the middle of all tolerances, and whether what has no cost keeps the limits by itself."""
    study = outcome.study
    priced = {one.path for one in study.run.system.mechanism.prices()}
    alone = [name for name in study.inputs.names if name not in priced]
    lower, upper = of.figure.spread.lower, of.figure.spread.upper
    middles = 0.5 * (lower + upper)
    some = np.array([name in alone for name in study.inputs.names])
    ends = [float(np.sum(np.where(some, end, middles))) for end in (lower, upper)]
    low, high = limits(of)
    return float(np.sum(middles)), low <= ends[0] and ends[1] <= high


def _off_middle(lower: float, upper: float, middle: float) -> float:
    """How far the middle of the tolerances is off that of the limits, if it is much; 0 else, or of a single limit."""
    room = 0.5 * (upper - lower)
    off = middle - 0.5 * (lower + upper)
    return off if np.isfinite(room) and abs(off) > HALF * room else 0.0


def _largest(outcome: Outcome, of: Of) -> tuple[str, float]:
    """The number with the largest part in the worst case, and its share.

    Where a yield is asked for, in the variance: that decides it, and the worst case knows no correlation.
    """
    parts = np.nan_to_num(of.figure.covariances if outcome.target is not None else of.figure.spread.worst)
    top, total = int(np.argmax(parts)), float(np.sum(parts))
    return outcome.study.inputs.names[top], float(parts[top]) / total if total > 0 else 0.0
