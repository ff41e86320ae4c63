"""What there is to say of an identification, in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from trunnion.errors import Finding, Severity, Status, agreeing, counted
from trunnion.rig.compare.said import other_speed
from trunnion.rig.identify.amounts import amount, share
from trunnion.rig.identify.blocks import OWN, shared_zero
from trunnion.rig.identify.judged import Judged
from trunnion.rig.identify.separate import Combination, Group, known_of, sizes_of
from trunnion.rig.identify.uncertainty import RANDOM, quantile

__all__ = ["sentences"]

ALIKE = 0.95  # correlation from which two are hardly told apart
MUCH = 3.0  # times what scatter explains, between conditions
FAR = 3.0  # standard uncertainties from what was stated of a sensor
MOSTLY = 0.5  # of the variance
POOR = 2.0  # times what is expected, of predictions
MOST_NAMED = 3
FEW = 5.0  # degrees of freedom
NUMBERS = ("no", "one", "two", "three", "four", "five", "six")


def sentences(judged: Judged) -> list[Finding]:
    """Errors and warnings first."""
    parts = (_search, _fit, _speeds, _groups, _near, _limits, _sensors, _exact, _data, _held)
    found = [one for part in parts for one in part(judged)]
    order = (Severity.ERROR, Severity.WARNING, Severity.NOTE)
    return sorted(found, key=lambda one: order.index(one.severity))


def _joined(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _count(number: int, what: str) -> str:
    return f"{NUMBERS[number] if number < len(NUMBERS) else f'{number:,}'} {what}{'s' * (number != 1)}"


def _search(judged: Judged) -> Iterator[Finding]:
    """How the search went."""
    search, problem = judged.found.search, judged.problem
    if search.shared < 1:
        what = f"the start has no answer at some positions: the search began with {search.shared:g} of its friction"
        yield Finding(what, "start", severity=Severity.NOTE)
    if problem.refused:
        were = "was" if problem.refused == 1 else "were"
        what = f"{_count(problem.refused, 'step')} to where the model locks or cannot be assembled {were} taken back"
        yield Finding(what, "search", severity=Severity.NOTE)
    if not search.fit.converged:
        what = f"the search did not end within {search.fit.evaluations} evaluations"
        yield Finding(what, "search", "give a start that is nearer, or fewer parameters")
    elif not search.settled:
        what = "which positions are used changes back and forth with the estimates"
        yield Finding(what, "search", "give a guard of 2 or more", Severity.WARNING)
    lost = judged.lost[: problem.count]
    if search.other is not None and not np.any(lost):
        values = (
            f"{one.name} = {amount(value, None, one.unit)}"
            for one, value in zip(problem.model.unknowns, search.other, strict=False)
        )
        what = f"other values fit as well: {', '.join(values)}"
        yield Finding(what, "search", "hold out a condition, or measure in more of them", Severity.WARNING)


def _fit(judged: Judged) -> Iterator[Finding]:
    """Whether the model fits, and whether turns repeat."""
    test, problem = judged.found.spread.test, judged.problem
    if test.misfit:
        chance = "less than 0.01 %" if test.chance < 1e-4 else f"{100 * test.chance:.2g} %"
        what = (
            f"the model does not fit: its residuals are {test.reduced:.3g} times (reduced χ²) what the scatter between "
            f"turns explains, chance {chance}; the intervals contain what is left over"
        )
        yield Finding(what, "fit", "look at the residuals; free another number, or take another friction law",
                      Severity.WARNING)  # fmt: skip
    apart = judged.found.spread.apart
    for p in np.flatnonzero((apart > 1) & ~judged.lost[: problem.count]):
        what = (
            f"the conditions disagree: what each says of it varies by {np.sqrt(apart[p]):.2g} times what the scatter "
            "between turns explains; the interval is wider for it"
        )
        where = f"parameter {problem.model.unknowns[p].name}"
        remedy = "look for what differs between them: settings, speed, temperature, the zero of each file"
        yield Finding(what, where, remedy, Severity.WARNING if apart[p] > MUCH**2 else Severity.NOTE)
    single = [block for block in problem.blocks if block.fitted and not block.repeats]
    if single and len(single) == sum(block.fitted for block in problem.blocks):
        what = (
            "no turn is repeated: the scatter is taken from the residuals, nothing tests the model, and of filtered "
            "data the intervals are too narrow"
        )
        yield Finding(what, "data", "record several turns", Severity.WARNING)
    freedom = judged.found.spread.freedom[: problem.count][~judged.lost[: problem.count]]
    if freedom.size and np.min(freedom) < FEW:
        degrees = _count(round(float(np.min(freedom))), "degree")
        what = f"the scatter is known from {degrees} of freedom: the intervals are wide for that"
        yield Finding(what, "data", "record more turns", Severity.NOTE)
    follows = judged.found.spread.follows
    pairs = sum(len(block.turns) - 1 for block in problem.blocks if block.fitted)
    if follows > 2 / np.sqrt(max(pairs, 1)):
        what = f"each turn resembles the one before it (correlation {follows:.2f}): the intervals are wider for it"
        yield Finding(what, "data", "look for a drift; warm the rig up", Severity.WARNING)


def _speeds(judged: Judged) -> Iterator[Finding]:
    """A driver that ran at another speed than the model's."""
    model = judged.problem.model
    driver = next(iter(model.run.system.mechanism.drivers), "")
    conditions = judged.found.measurement.conditions
    fitted = dict.fromkeys(block.condition for block in judged.problem.blocks if block.fitted)
    rows = [(conditions[k].name, conditions[k].speed, model.driven(k, judged.told)[2]) for k in fitted]
    yield from other_speed(driver, [row for row in rows if np.isfinite(row[2])], len(rows))


# ---- what cannot be told apart --------------------------------------------------------------------------------


def _groups(judged: Judged) -> Iterator[Finding]:
    for group in judged.found.groups:
        names = [_name(judged, i) for i in group.members]
        channels = _joined(list(dict.fromkeys(block.channel for block in judged.problem.blocks if block.fitted)))
        where = f"parameter {names[0]}"
        if len(group.members) == 1:
            what = f"{names[0]} has no effect on {channels}: the data say nothing of it"
            yield Finding(what, where, "fix it, or measure what it acts on", Severity.WARNING)
            continue
        verb = "act on" if group.exact else "act nearly alike on"
        alike = f"{_joined(names)} {verb} {channels}{' in the same way' if group.exact else ''}"
        what = f"{alike}: {_known(judged, group, names)}"
        remedy = f"fix {'one' if len(names) == 2 else 'some'} of them, or measure what tells them apart"
        yield Finding(what, where, remedy, Severity.WARNING)


def _near(judged: Judged) -> Iterator[Finding]:
    """Pairs that are told apart, but badly: what of them is known far better than either."""
    n = judged.problem.count
    size = sizes_of(judged.problem, judged.found.x)
    for p in range(n):
        for q in range(p):
            if not abs(judged.correlation[p, q]) > ALIKE:  # NaN of what is not told
                continue
            pair = (q, p)
            known = known_of(judged.problem, judged.found.x, judged.found.spread, pair, size)
            names = [_name(judged, i) for i in pair]
            together = f"{judged.correlation[p, q]:.3f}".replace("-", "−")
            what = f"is hardly told from {names[0]} (correlation {together})"
            if known:
                what += f": {_known(judged, Group(pair, known, exact=False), names, short=True)}"
            remedy = "fix one of them, or measure what tells them apart"
            yield Finding(what, f"parameter {names[1]}", remedy, Severity.NOTE)


def _name(judged: Judged, i: int) -> str:
    problem = judged.problem
    if i < problem.count:
        return problem.model.unknowns[i].name
    return f"the {problem.sensors[i - problem.count].name}"


def _known(judged: Judged, group: Group, names: Sequence[str], short: bool = False) -> str:
    """What of them is known, and that the rest is not; short: of what is known only."""
    if not group.known:
        return "no combination of them is known"
    units = [_unit(judged, i) for i in group.members]
    pair = len(names) == 2
    if pair:
        one = group.known[0]
        said = amount(one.value, one.uncertainty, _leading(one, units) if one.form == "sum" else "1")
        if short:
            subject = f"their {one.form}" if one.form != "sum" else _formula(one, names, units)
            return f"{subject} = {said} is known best"
        other = {"sum": "difference", "product": "ratio", "ratio": "product"}[one.form]
        if one.form == "sum" and one.factors == (1.0, 1.0):
            return f"their sum is known, {said}, their {other} is not"
        if one.form == "sum" and one.factors == (1.0, -1.0):
            return f"their difference is known, {said}, their sum is not"
        if one.form != "sum":
            return f"their {one.form} is known, {said}, neither alone"
        return f"{_formula(one, names, units)} = {said} is known, neither alone"
    told = "; ".join(
        f"{_formula(one, names, units)} = {amount(one.value, one.uncertainty, _leading(one, units))}"
        for one in group.known
    )
    many = f"{_count(len(group.known), 'combination')} of them {'is' if len(group.known) == 1 else 'are'} known"
    return f"{many}, none alone: {told}"


def _unit(judged: Judged, i: int) -> str:
    """SI unit of an unknown; errors of sensors are in their standard uncertainties."""
    return judged.problem.model.unknowns[i].unit if i < judged.problem.count else "1"


def _leading(one: Combination, units: Sequence[str]) -> str:
    """SI unit of a combination: that of its first number, whose factor is 1."""
    return next(unit for factor, unit in zip(one.factors, units, strict=True) if factor != 0)


def _formula(one: Combination, names: Sequence[str], units: Sequence[str]) -> str:
    parts: list[str] = []
    lead = _leading(one, units)
    for factor, name, unit in zip(one.factors, names, units, strict=True):
        if factor == 0:
            continue
        per = "" if unit == lead else f"{_ratio(lead, unit)} "
        size = "" if abs(factor) == 1 and not per else f"{abs(factor):.3g} {per}"
        sign = ("− " if factor < 0 else "+ ") if parts else ("−" if factor < 0 else "")
        parts.append(f"{sign}{size}{name}")
    return " ".join(parts)


def _ratio(over: str, under: str) -> str:
    """A unit by another: 1/m, N m/rad."""
    if under in ("", "1"):
        return over
    return f"{over}/({under})" if set(under) & set(" /*") else f"{over}/{under}"


# ---- limits, sensors, data ------------------------------------------------------------------------------------


def _limits(judged: Judged) -> Iterator[Finding]:
    low, high = judged.interval
    for p, unknown in enumerate(judged.problem.model.unknowns):
        where = f"parameter {unknown.name}"
        if judged.limit[p]:
            end = judged.estimate[p]
            far = high[p] if judged.limit[p] < 0 else low[p]
            side = "at most" if judged.limit[p] < 0 else "at least"
            ends = [amount(one, None, unknown.unit) for one in (end, far)]
            what = f"is on its limit {ends[0]}: {side} {ends[1]} (95 %, one-sided)"
            yield Finding(what, where, severity=Severity.NOTE)
            continue
        size = max(abs(judged.estimate[p]), unknown.size)
        half = quantile(judged.found.spread.freedom[p]) * judged.deviation[p]
        if size > 0 and half > size:
            said = amount(judged.estimate[p], half, unknown.unit)
            what = f"is hardly known: {said}, an interval wider than the number itself"
            yield Finding(what, where, "record more turns, or conditions in which it does more", Severity.NOTE)


def _sensors(judged: Judged) -> Iterator[Finding]:
    """Which sensor limits what is known, and whether one is off by more than was stated of it."""
    problem = judged.problem
    names, shares = judged.budget
    for p, unknown in enumerate(problem.model.unknowns):
        for source, part in zip(names, shares[p], strict=True):
            if source not in (*RANDOM, "resolution") and part > MOSTLY:
                what = f"{share(part)} of its variance is the {source}: more turns do not help"
                remedy = "calibrate that sensor better"
                if source.startswith(OWN):
                    remedy = "record a longer unloaded stretch in each file, or more files"
                yield Finding(what, f"parameter {unknown.name}", remedy, Severity.NOTE)
    for s, sensor in enumerate(problem.sensors, problem.count):
        if sensor.stated and abs(judged.found.x[s]) > FAR:
            what = f"comes out {abs(judged.found.x[s]):.1f} standard uncertainties from what is stated of it"
            remedy = "check the sensor, its stated accuracy, and the loads of the model"
            yield Finding(what, sensor.name, remedy, Severity.WARNING)


def _exact(judged: Judged) -> Iterator[Finding]:
    """Channels whose zero and gain are taken as exact: of torques and forces that is hardly so."""
    measures = judged.problem.model.measures
    known: dict[str, bool] = {}
    for one in judged.problem.blocks:
        accuracy = one.course.accuracy
        if one.fitted:
            stated = bool(one.effects or shared_zero(accuracy) or accuracy.gain)
            known[one.channel] = known.get(one.channel, False) or stated
    bare = [channel for channel, told in known.items() if not told]
    forces = [channel for channel in bare if not measures[channel].of_motion]
    for channels, severity in ((forces, Severity.WARNING), ([one for one in bare if one not in forces], Severity.NOTE)):
        if channels:
            what = f"no accuracy is stated of {_joined(channels)}: zero and gain are taken as exact"
            what += ", and the intervals are too narrow by that" if severity is Severity.WARNING else ""
            yield Finding(what, "sensors", "state accuracy: {zero: …, gain: …} in the mapping", severity)


def _data(judged: Judged) -> Iterator[Finding]:
    """What was left out."""
    problem = judged.problem
    courses = problem.courses(judged.found.x)
    used, out = (sum(getattr(one, key) for one in judged.misses) for key in ("used", "out"))
    if out:
        what = (
            f"{out:,} of {counted(used + out, 'position')} {agreeing(out, 'is', 'are')} left out: "
            "a friction turns round or the speed is zero there, the position is close to singular, or the model has no "
            "answer"
        )
        yield Finding(what, "data", severity=Severity.NOTE)
    locked = sum(int(np.count_nonzero(status == Status.LOCKED)) for status in courses.status)
    lost = sum(int(np.count_nonzero(status >= Status.NOT_CONVERGED)) for status in courses.status) - locked
    for number, why in ((locked, "locked by friction"), (lost, "without an answer")):
        if number:
            are = agreeing(number, "that was measured is", "that were measured are")
            what = f"with the estimates {counted(number, 'position')} {are} {why} in the model"
            yield Finding(
                what, "fit", "look at it with analyse, and at the setting of the conditions", Severity.WARNING
            )


def _held(judged: Judged) -> Iterator[Finding]:
    """How well what was held out is predicted."""
    rows = judged.held_out
    if not rows:
        return
    trust = judged.trust
    conditions = judged.found.measurement.conditions
    held = list(dict.fromkeys(conditions[judged.problem.blocks[one.block].condition].name for one in rows))
    names = "; ".join(held) if len(held) <= MOST_NAMED else f"of {len(held)} conditions"
    if not np.isfinite(trust):
        what = f"nothing tells how well {names} should be predicted"
        yield Finding(what, "hold_out", severity=Severity.NOTE)
    elif trust > POOR:
        what = f"what was held out ({names}) is missed by {trust:.1f} times what its scatter and the estimates explain"
        yield Finding(what, "hold_out", "it lacks something that differs there", Severity.WARNING)
    else:
        what = f"what was held out ({names}) is missed by {trust:.2f} times what its scatter and the estimates explain"
        yield Finding(what, "hold_out", severity=Severity.NOTE)
