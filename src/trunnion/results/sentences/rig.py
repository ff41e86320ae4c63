"""Sentences about a virtual rig."""

from __future__ import annotations

from trunnion.results.sentences.sentence import ERROR, NOTE, WARNING, Sentence

__all__ = ["RIG"]

RIG = {
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
