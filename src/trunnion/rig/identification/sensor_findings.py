"""What there is to say of the errors of the sensors: which of them limits an estimate, and which is further off."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trunnion.errors import Finding, Severity
from trunnion.results.sentences import finding_for
from trunnion.rig.identification.assessment import Assessment
from trunnion.rig.identification.blocks import OWN, shared_zero
from trunnion.rig.identification.fit import SensorError
from trunnion.rig.identification.number_text import joined, share
from trunnion.rig.identification.uncertainty import RANDOM
from trunnion.rig.reading.log import few_digits

__all__ = ["exact_channels", "of_sensors"]

FAR = 3.0  # standard uncertainties from what was stated of a sensor
MOSTLY = 0.5  # of the variance


def of_sensors(judged: Assessment) -> Iterator[Finding]:
    """Which sensor limits what is known, and whether one is off by more than was stated of it."""
    yield from _off(judged)
    if judged.refuted:  # then they stand for what the model lacks
        return
    names, shares = judged.budget
    for p, unknown in enumerate(judged.problem.model.unknowns):
        for source, part in zip(names, shares[p], strict=True):
            if source not in (*RANDOM, "resolution") and part > MOSTLY:
                remedy = "calibrate that sensor better"
                if source.startswith(OWN):
                    remedy = "record a longer unloaded stretch in each file, or more files"
                elif source.startswith("angle "):
                    remedy = "use an encoder with finer steps"
                phrases = {"share_told": share(part), "remedy": remedy}
                yield finding_for(
                    "parameter.sensor", f"parameter {unknown.name}", phrases=phrases, share=part, source=source
                )


def _off(judged: Assessment) -> Iterator[Finding]:
    """Sensors whose error is far from what is stated of it; an error of one that would have to be beyond it."""
    problem, spread = judged.problem, judged.found.spread
    if judged.found.causes or spread.test.gross:  # it is off because of what explains the misfit
        return
    for s, sensor in enumerate(problem.sensors):
        value = spread.beyond.get(s, float(judged.found.x[problem.count + s]))
        if sensor.stated and abs(value) > FAR:
            far = s in spread.beyond
            phrases = {"size_told": _size(judged, sensor, value), "times_told": few_digits(abs(value))}
            yield finding_for(
                "sensor.off", "angle.zero" if sensor.angle else sensor.name, severity=Severity.ERROR if far else None,
                phrases=phrases, times=abs(value), beyond=far, of_angle=bool(sensor.angle),
            )  # fmt: skip


def _size(judged: Assessment, sensor: SensorError, value: float) -> str:
    """How far a sensor is off in its unit."""
    if sensor.angle:
        return f"{few_digits(abs(np.degrees(value * sensor.angle)))}°"
    course = next((one.course for one in judged.problem.blocks if one.channel == sensor.channel), None)
    unit, size = course.shown if course is not None and sensor.kind == "zero" else ("1", 1.0)
    factor, unit = {"gain": (100.0, "%"), "delay": (1e3, "ms")}.get(sensor.kind, (1 / size, unit))
    told = few_digits(abs(value) * max(map(abs, sensor.sizes)) * factor)
    return told if unit == "1" else f"{told} {unit}"


def exact_channels(judged: Assessment) -> Iterator[Finding]:
    """Channels whose zero and gain are taken as exact: of torques and forces that is hardly so."""
    measures = judged.problem.model.measures
    known: dict[str, bool] = {}
    for one in judged.problem.blocks:
        accuracy = one.course.accuracy
        if one.fitted:
            stated = bool(one.effects or shared_zero(accuracy) or accuracy.gain)
            known[one.channel] = known.get(one.channel, False) or stated
    bare = [channel for channel, stated in known.items() if not stated]
    forces = [channel for channel in bare if not measures[channel].of_motion]
    for channels, severity in ((forces, Severity.WARNING), ([one for one in bare if one not in forces], Severity.NOTE)):
        if channels:
            narrow = ", and the intervals are too narrow" if severity is Severity.WARNING else ""
            phrases = {"channels": joined(channels), "too_narrow": narrow}
            yield finding_for("sensor.no_accuracy", "sensors", severity=severity, phrases=phrases)
