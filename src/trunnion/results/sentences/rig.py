"""Sentences about measured data: a virtual rig, a comparison, an identification."""

from __future__ import annotations

from trunnion.results.sentences.sentence import ERROR, NOTE, WARNING, Sentence

__all__ = ["RIG"]

HELD_OUT = " times what its scatter and the estimates explain"

VIRTUAL = {
    "rig.no_answer": Sentence(
        WARNING,
        "{cases} left out: {status}; in condition {condition} at {count} of {positions:#position}, first at "
        "{first_deg:.4g}° of the cycle",
        "run analyse with these values: it says where in the cycle, and why; or do without",
    ),
    "rig.load_at_rest": Sentence(
        NOTE,
        "{cases}: a load has no single value at up to {positions:#position}, its joint being at rest there; sensors "
        "are given 0 in a rest, the mean of the neighbours at a single position",
    ),
    "rig.no_angle": Sentence(
        ERROR,
        "the conditions differ in speed, and nothing measured tells where {driver} is",
        "state an encoder, or a sensor of rate:{driver}",
    ),
    "rig.both_ways": Sentence(
        ERROR,
        "the conditions turn both ways, and nothing measured tells where the driver is",
        "state an encoder of kind: count, or a rig for each way",
    ),
    "rig.both_ways_level": Sentence(
        ERROR, "the conditions turn both ways, and the level of an encoder does not tell which", "record kind: count"
    ),
    "rig.clipped": Sentence(
        WARNING,
        "{cases}: {measures} reaches {peak:.4g} {unit}, beyond the range of {limit:.4g} {unit}: readings are clipped",
        "take a sensor with a larger range",
    ),
    "rig.pulses_lost": Sentence(
        WARNING,
        "{cases}: the encoder gives up to {pulses:.4g} pulses a second; sampled {rate:.4g} times a second, some are "
        "lost",
        "sample four times as fast as there are pulses, or record kind: count",
    ),
    "rig.range_wide": Sentence(
        NOTE,
        "the readings take {percent:.2g} % of the range: its errors in % of full scale count",
        "take a sensor of a smaller range",
    ),
    "rig.steps_few": Sentence(
        NOTE, "the readings go through {steps:.3g} steps of the converter", "take more bits, or a smaller span"
    ),
    "rig.biased": Sentence(
        WARNING,
        "in {count} of {of:#condition} the efficiency is off by more than its standard uncertainty even without "
        "random errors, most in condition {condition} by {bias:+.2g}: the sensors are too slow for the cycle, or "
        "clipped",
        "take sensors of a larger bandwidth or range, more pulses, or a lower speed",
    ),
    "rig.no_efficiency": Sentence(
        NOTE,
        "the sensors do not tell the power in and out, so there is no efficiency to expect",
        "measure effort: and rate: of the driver, load: of a load on a joint and rate: of that joint",
    ),
}

COMPARE = {
    "compare.turns_few": Sentence(
        WARNING,
        "{once}: without scatter its uncertainty is not known, {cases}",
        lambda turns, **_: "look at the gaps that `trunnion data` reports" if turns > 1 else "measure more turns",
    ),
    "compare.nothing": Sentence(
        WARNING, "has nothing to compare: nothing measured, or no answer of the model, {cases}"
    ),
    "compare.offset": Sentence(
        ERROR,
        "is within U {cases} apart from {story}: {within_percent:.0f} % of the positions are within with it",
        "{remedy}",
    ),
    "compare.not_within": Sentence(
        ERROR,
        lambda cases, within_percent, rms_told, several, explained, **_: (
            f"is not within U {cases}: {'down to ' if several else ''}{within_percent:.0f} % of the positions are "
            f"within, RMS of the residual {'up to ' if several else ''}{rms_told}{explained}"
        ),
        "{remedy}",
    ),
    "compare.angle_shifted": Sentence(
        ERROR,
        "{channels} are not within U {cases}; the crank angle read off by {range} explains {explains_percent:.0f} % "
        "of the mean square of the residuals",
        "add {mean_told} to the zero of the angle in the mapping",
    ),
    "compare.efficiency": Sentence(
        ERROR,
        "the model's is not within U {cases}{most}: measured {measured:.4f} ± {expanded:.2g}, model {model:.4f}",
        "look at the channels; `trunnion identify` fits friction to them",
    ),
    "compare.efficiency_unmeasured": Sentence(
        WARNING,
        "is not compared {cases}: the power of {missing} is not measured",
        "measure effort: of every driver and load: of every useful load, each with its rate:",
    ),
    "compare.efficiency_unknown": Sentence(WARNING, "is not known {cases}: {reason}", "{remedy}"),
    "compare.speed": Sentence(
        WARNING,
        "the driver did not turn at the model's speed {cases}: {measured_told} measured, {model_told} in the model",
        "state set: {{{key}: {{mean: …}}}} in the mapping, of a channel that measures rate:{driver}",
    ),
    "compare.no_answer": Sentence(
        ERROR,
        "the model has no answer {cases}, first at {count:,} of {positions:#position}: {status}",
        "{analyse}: it says where in the cycle, and why",
    ),
    "compare.left_out": Sentence(
        NOTE,
        lambda counts: (
            "positions left out of the figures: "
            + ", ".join(f"{name} {count:,}" for name, count in counts.items())
            + "; a relative speed is zero there, or a dead centre near"
        ),
        "the model has an interval there and not one number",
    ),
    "compare.turns_alike": Sentence(
        WARNING,
        "the errors of neighbouring turns are alike, correlation {correlation:+.2f}: U, which takes turns as "
        "independent, is too small, and so is that of the efficiency",
        "measure many more turns, or apart from each other; state a zero that wanders in accuracy:",
    ),
    "compare.no_accuracy": Sentence(
        NOTE,
        "no accuracy of zero and gain is stated of {channels}: U has only the scatter between turns",
        "state accuracy: {{gain: …, zero: …}} in the mapping",
    ),
    "compare.model_exact": Sentence(
        NOTE,
        "the model is taken as exact: the verdicts have the uncertainty of the measurement only",
        lambda toleranced: "`trunnion tolerance` tells what the tolerances do to a measure" if toleranced else "",
    ),
}

IDENTIFY = {
    "search.start": Sentence(
        NOTE, "the start has no answer at some positions: the search began with {share:g} of its friction"
    ),
    "search.refused": Sentence(
        NOTE, "{told} to where the model locks or cannot be assembled {count:#was/were} taken back"
    ),
    "search.not_ended": Sentence(
        ERROR,
        "the search did not end within {evaluations} evaluations",
        "give a start that is nearer, or fewer parameters",
    ),
    "search.unsettled": Sentence(
        WARNING, "which positions are used changes back and forth with the estimates", "give a guard of 2 or more"
    ),
    "search.other": Sentence(
        WARNING, "other values fit as well: {told}", "hold out a condition, or measure in more of them"
    ),
    "fit.misfit": Sentence(
        WARNING,
        "the model does not fit: its residuals are {reduced:.3g} times (reduced χ²) what the scatter between turns "
        "explains, chance {chance_told}; the intervals contain what is left over",
        "look at the residuals; free another number, or take another friction law",
    ),
    "fit.conditions_disagree": Sentence(
        NOTE,
        "the conditions disagree: what each says of it varies by {times:.2g} times what the scatter between turns "
        "explains; the interval is wider for it",
        "look for what differs between them: settings, speed, temperature, the zero of each file",
    ),
    "fit.not_repeated": Sentence(
        WARNING,
        "no turn is repeated: the scatter is taken from the residuals, nothing tests the model, and of filtered data "
        "the intervals are too narrow",
        "record several turns",
    ),
    "fit.freedom": Sentence(
        NOTE,
        "the scatter is known from {told} of freedom: the intervals are wide for that",
        "record more turns",
    ),
    "fit.turns_alike": Sentence(
        WARNING,
        "each turn resembles the one before it (correlation {correlation:.2f}): the intervals are wider for it",
        "look for a drift; warm the rig up",
    ),
    "fit.no_answer": Sentence(
        WARNING,
        "with the estimates {count:#position} {count:#that was measured is/that were measured are} {why} in the model",
        "look at it with analyse, and at the setting of the conditions",
    ),
    "parameter.no_effect": Sentence(
        WARNING,
        "{name} has no effect on {channels}: the data say nothing of it",
        "fix it, or measure what it acts on",
    ),
    "parameter.not_told_apart": Sentence(
        WARNING, "{alike}: {known}", "fix {some} of them, or measure what tells them apart"
    ),
    "parameter.hardly_told_apart": Sentence(
        NOTE,
        "is hardly told from {other} (correlation {correlation_told}){known}",
        "fix one of them, or measure what tells them apart",
    ),
    "parameter.limit": Sentence(NOTE, "is on its limit {limit_told}: {side} {far_told} (95 %, one-sided)"),
    "parameter.hardly_known": Sentence(
        NOTE,
        "is hardly known: {told}, an interval wider than the number itself",
        "record more turns, or conditions in which it does more",
    ),
    "parameter.sensor": Sentence(
        NOTE, "{share_told} of its variance is the {source}: more turns do not help", "{remedy}"
    ),
    "sensor.off": Sentence(
        WARNING,
        "comes out {times:.1f} standard uncertainties from what is stated of it",
        "check the sensor, its stated accuracy, and the loads of the model",
    ),
    "sensor.no_accuracy": Sentence(
        NOTE,
        "no accuracy is stated of {channels}: zero and gain are taken as exact{too_narrow}",
        "state accuracy: {{zero: …, gain: …}} in the mapping",
    ),
    "data.left_out": Sentence(
        NOTE,
        "{count:,} of {positions:#position} {count:#is/are} left out: a friction turns round or the speed is zero "
        "there, the position is close to singular, or the model has no answer",
    ),
    "held_out.untested": Sentence(NOTE, "nothing tells how well {names} should be predicted"),
    "held_out.missed": Sentence(
        WARNING,
        "what was held out ({names}) is missed by {times:.1f}" + HELD_OUT,
        "it lacks something that differs there",
    ),
    "held_out.predicted": Sentence(NOTE, "what was held out ({names}) is missed by {times:.2f}" + HELD_OUT),
}

RIG: dict[str, Sentence] = {**VIRTUAL, **COMPARE, **IDENTIFY}
