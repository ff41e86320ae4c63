"""Sentences about measured data: a virtual rig, a comparison, an identification."""

from __future__ import annotations

from trunnion.results.sentences.sentence import ERROR, NOTE, WARNING, Sentence

__all__ = ["RIG"]

VIRTUAL = {
    "rig.no_answer": Sentence(
        WARNING,
        "{cases} left out: {status}; in condition {condition} at {count} of {positions:#position}, first at "
        "{first_deg:.4g}° of the cycle",
        "run `trunnion analyse` with these values to see where in the cycle, and why",
    ),
    "rig.load_at_rest": Sentence(
        NOTE,
        "{cases}: a load has no unique value at up to {positions:#position}, because its joint is at rest; sensors "
        "read 0 during a rest, and the mean of the neighbours at a single position",
    ),
    "rig.no_angle": Sentence(
        ERROR,
        "the conditions differ in speed, and no channel measures the angle of {driver}",
        "state an encoder, or a sensor of rate:{driver}",
    ),
    "rig.both_ways": Sentence(
        ERROR,
        "the conditions turn in both directions, and no channel measures the angle of the driver",
        "state an encoder of kind: count, or one rig for each direction",
    ),
    "rig.both_ways_level": Sentence(
        ERROR,
        "the conditions turn in both directions, which the level of an encoder does not distinguish",
        "record kind: count",
    ),
    "rig.clipped": Sentence(
        WARNING,
        "{cases}: {measures} reaches {peak:~{unit}}, beyond the range of {limit:~{unit}}: readings are clipped",
        "use a sensor with a larger range",
    ),
    "rig.pulses_lost": Sentence(
        WARNING,
        "{cases}: some encoder pulses are lost: up to {pulses:.4g} pulses per second, sampled at {rate:.4g} Hz",
        "use a sampling rate of four times the pulse rate, or record kind: count",
    ),
    "rig.range_wide": Sentence(
        NOTE,
        "the readings use {percent:.2g} % of the range: errors in % of full scale dominate",
        "use a sensor with a smaller range",
    ),
    "rig.steps_few": Sentence(
        NOTE,
        "the readings cover only {steps:.3g} steps of the converter",
        "use a converter with more bits, or a smaller span",
    ),
    "rig.biased": Sentence(
        WARNING,
        "in {count} of {of:#condition} the bias of the efficiency exceeds its standard uncertainty, at most "
        "{bias:+.2g} in condition {condition}: the sensors are too slow for the cycle, or clipped",
        "use sensors with a larger bandwidth or range, more pulses, or a lower speed",
    ),
    "rig.no_efficiency": Sentence(
        NOTE,
        "the sensors do not measure input and output power: no efficiency is predicted",
        "measure effort: and rate: of the driver, load: of a load on a joint and rate: of that joint",
    ),
}

COMPARE = {
    "compare.turns_few": Sentence(
        WARNING,
        lambda turns, cases, **_: (
            (
                "measured in one turn only"
                if turns == 1
                else f"has values from only one turn at a position, although up to {turns} turns were measured"
            )
            + f": its uncertainty cannot be estimated without scatter, {cases}"
        ),
        lambda turns, **_: "see the gaps reported by `trunnion data`" if turns > 1 else "measure more turns",
    ),
    "compare.nothing": Sentence(
        WARNING, "not compared, for lack of measured values or of a solution of the model, {cases}"
    ),
    "compare.not_within": Sentence(
        ERROR,
        lambda cases, apart, within_percent, rms_told, several, **_: (
            f"does not agree within U {cases}{apart}: {'down to ' * several}{within_percent:.0f} % of the positions "
            f"agree, RMS of the residual {'up to ' * several}{rms_told}"
        ),
        "see what would explain it; `trunnion identify` fits friction and other numbers of the model",
    ),
    "compare.efficiency": Sentence(
        ERROR,
        "does not agree within U {cases}{most}: measured {measured:.4f} ± {expanded:.2g}, model {model:.4f}",
        "check the channels; `trunnion identify` fits the friction of the model to them",
    ),
    "compare.efficiency_unmeasured": Sentence(
        WARNING,
        "not compared {cases}: the power of {missing} is not measured",
        "measure effort: of every driver and load: of every useful load, each with its rate:",
    ),
    "compare.efficiency_unknown": Sentence(WARNING, "not known {cases}: {reason}", "{remedy}"),
    "compare.speed": Sentence(
        WARNING,
        "the measured speed of the driver differs from that of the model {cases}: {told}",
        "state set: {{{key}: {{mean: {mean}}}}} in the mapping: the model then runs at the measured speed",
    ),
    "compare.no_answer": Sentence(
        ERROR,
        "the model has no solution {cases}, the first at {count:,} of {positions:#position}: {status}",
        "{analyse} to see where in the cycle, and why",
    ),
    "compare.left_out": Sentence(
        NOTE,
        lambda counts: (
            "positions left out of the statistics: "
            + ", ".join(f"{name} {count:,}" for name, count in counts.items())
            + "; a joint is momentarily at rest there, or a dead centre is close"
        ),
        "the model gives an interval there, not a single value",
    ),
    "compare.turns_alike": Sentence(
        WARNING,
        "the errors of successive turns are correlated, {correlation:+.2f}: U assumes independent turns and is too "
        "small, also for the efficiency",
        "measure many more turns, or turns further apart; state the drift of the zero in accuracy:",
    ),
    "compare.no_accuracy": Sentence(
        NOTE,
        "no accuracy of zero and gain is stated for {channels}: U includes only the scatter between turns",
        "state accuracy: {{gain: …, zero: …}} in the mapping",
    ),
}

IDENTIFY = {
    "search.not_ended": Sentence(
        ERROR,
        "the search did not converge within {evaluations} evaluations",
        "give start values closer to the solution, or fewer parameters",
    ),
    "search.unsettled": Sentence(
        WARNING,
        "the search did not converge: the set of usable positions changes with the estimates",
        "use a guard of 2 or more",
    ),
    "search.other": Sentence(
        WARNING, "other values fit equally well: {told}", "hold out a condition, or measure more conditions"
    ),
    "fit.misfit": Sentence(
        WARNING,
        "the model does not fit: reduced χ² {reduced_told} (1 is expected from the scatter between turns), p-value "
        "{chance_told}; {worth}",
        "see the residuals; identify another parameter as well, or use another friction law",
    ),
    "fit.cause": Sentence(
        WARNING,
        "{story}{times} would explain {explains_percent:.0f} % of the misfit{left}{also}; the estimates would then be "
        "{estimates}",
        lambda kind, channel, size_told, times, **_: {
            "angle": f"check the zero of the angle; if it is off, add {size_told} to angle: zero: in the mapping",
            "zero": f"check the zero of {channel}"
            + ("" if times else "; with accuracy: {zero: …} in the mapping it is estimated too"),
            "gain": f"check unit and gain of {channel}, and lengths and loads of the model, which may act alike"
            + ("" if times else "; with accuracy: {gain: …} in the mapping a gain is estimated too"),
        }[kind],
    ),
    "fit.unused": Sentence(NOTE, "no parameter acts on {channels}: not used in the fit"),
    "fit.conditions_disagree": Sentence(
        NOTE,
        "the conditions disagree: the estimates from single conditions vary {times_told} times as much as expected "
        "from the scatter between turns; the interval is widened accordingly",
        "look for differences between conditions: settings, speed, temperature, the zero of each file",
    ),
    "fit.not_repeated": Sentence(
        WARNING,
        "no turn is repeated: the scatter is estimated from the residuals, the model cannot be tested, and the "
        "intervals are too narrow if the data are filtered",
        "record several turns",
    ),
    "fit.turns_alike": Sentence(
        WARNING,
        "successive turns are correlated ({correlation:.2f}): the intervals are widened accordingly",
        "look for a drift; warm the rig up",
    ),
    "fit.few_positions": Sentence(
        ERROR,
        "{positions:#position} with data for {unknowns}{out_told}: they are not separately identifiable",
        "state more positions: in the mapping, add channels, or identify fewer parameters",
    ),
    "parameter.no_effect": Sentence(
        WARNING,
        "{name} is not identifiable: it has no effect on {channels}",
        "fix it, or measure a quantity that depends on it",
    ),
    "parameter.not_told_apart": Sentence(
        WARNING, "{alike}; {known}", "fix one or more of them, or measure a quantity that separates them"
    ),
    "parameter.limit": Sentence(NOTE, "is at its bound {limit_told}: {side} {far_told} (95 %, one-sided)"),
    "sensor.off": Sentence(
        WARNING,
        lambda beyond, times, times_told, **_: (
            f"would have to be off by {times_told} stated standard uncertainties: the estimates mean nothing"
            if beyond
            else f"differs from its stated value by {times:.1f} standard uncertainties"
        ),
        lambda of_angle, **_: (
            "check the zero of the angle, and the lengths and loads of the model"
            if of_angle
            else "check the sensor, its unit, its stated accuracy, and the loads of the model"
        ),
    ),
    "sensor.no_accuracy": Sentence(
        NOTE,
        "no accuracy is stated for {channels}: zero and gain count as exact{too_narrow}",
        "state accuracy: {{zero: …, gain: …}} in the mapping",
    ),
    "data.left_out": Sentence(
        NOTE,
        "{count:,} of {positions:#position} {count:#is/are} left out: friction reverses, a joint is at rest, a load "
        "has a corner or a jump, the position is close to singular, or the model has no solution",
    ),
    "held_out.missed": Sentence(
        WARNING,
        "the held-out data ({names}) differ from the prediction by {times:.1f} times its "
        "standard uncertainty (scatter and estimates)",
        "the model lacks an effect that differs there",
    ),
}

RIG: dict[str, Sentence] = {**VIRTUAL, **COMPARE, **IDENTIFY}
