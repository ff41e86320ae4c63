"""What the model says of starts: figures and courses of its motion in time, with derivatives by central differences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trunnion.algebra.namespace import Number
from trunnion.dynamics.checks import refuse
from trunnion.dynamics.measured import numbers_in_time
from trunnion.dynamics.opened import in_play
from trunnion.errors import Finding, MechanismError, Status
from trunnion.measures.measures import Measure
from trunnion.model.mechanism import Mechanism
from trunnion.rig.identification.blocks import Block
from trunnion.rig.identification.signals import ConditionSaid, Model, said_of
from trunnion.rig.reading.measurement import Condition

__all__ = ["StartModel", "check_starts"]

Array = NDArray[np.float64]
OVER_TIME = {"rate": "rate", "effort": "effort", "slide": "coordinate"}  # kinds, as in `course.OVER_TIME`
FORMS = "starting_time:O, steady_speed:O, fluctuation:O or peak_effort:O of a free driver"
CURVES = "rate:O, effort:O or slide:O of a free driver"


def check_starts(mechanism: Mechanism, measures: Mapping[str, Measure], blocks: Sequence[Block]) -> None:
    """MechanismError for a mechanism that no motor moves, and for what is measured of a start and is none of it."""
    refuse(mechanism)
    if playing := in_play(mechanism):
        what = f"{playing[0]} is in play, and starts are followed with all pins in the middle of their holes"
        raise MechanismError(Finding(what, f"joints.{playing[0]}.contact", "remove it"))
    findings = []
    for name, measure in measures.items():
        free = measure.subject in mechanism.drivers and mechanism.drivers[measure.subject].found
        value = any(block.turns.shape[1] == 1 for block in blocks if block.channel == name)
        if measure.in_time and free and not measure.statistic and value:
            continue
        if not value and measure.everywhere and measure.kind in OVER_TIME and free:
            continue
        what = f"measures {measure.name}, which is no {'one value' if value else 'number at each time'} of a start"
        findings.append(Finding(what, f"channel {name}", f"{FORMS if value else CURVES} is"))
    if findings:
        raise MechanismError(findings)


@dataclass(frozen=True)
class StartModel(Model):
    """A Model of starts. durations: of each condition, s, NaN for what the measure or the model states; channels: what
    was measured in each."""

    durations: tuple[float, ...] = ()
    channels: tuple[frozenset[str], ...] = ()

    @classmethod
    def of(cls, model: Model, conditions: Sequence[Condition]) -> StartModel:
        """A model as one of starts."""
        given = {one.name: getattr(model, one.name) for one in fields(model)}
        durations, channels = [one.duration for one in conditions], [frozenset(one.courses) for one in conditions]
        return cls(**given, durations=tuple(durations), channels=tuple(channels))

    def _parts(self) -> Iterator[list[int]]:
        """Conditions with as many positions at the same times."""
        for part in super()._parts():
            for duration in dict.fromkeys(str(self.durations[k]) for k in part):
                yield [k for k in part if str(self.durations[k]) == duration]

    def _batch(self, part: Sequence[int], at: Array) -> list[ConditionSaid]:
        many, size = len(self.unknowns), len(self.phases[part[0]])
        shape, courses = (len(part) * many, size), self._in_time(part, self._values(part, at))
        turned = np.zeros(size, bool)
        turned[0] = size > 1  # where a motor is switched on its effort jumps
        rows: list[ConditionSaid] = []
        for k, condition in enumerate(part):
            own = slice(k * many, (k + 1) * many)
            said = {name: said_of(number, shape, own) for name, number in courses.items()}
            known = all(np.all(np.isfinite(said[name].value)) for name in self.channels[condition] if name in said)
            status = np.full(size, Status.SOLVED if known else Status.NOT_ASSEMBLED, np.int8)
            rows.append((said, status, turned))
        return rows

    def _in_time(self, part: Sequence[int], values: dict[str, Number]) -> dict[str, Number]:
        """What was measured in some of the conditions, by channel: every motion is followed once."""
        duration, count = self.durations[part[0]], len(part) * len(self.unknowns)
        there = frozenset().union(*(self.channels[k] for k in part))
        times = self.phases[part[0]] * duration if len(self.phases[part[0]]) > 1 else None
        motions: dict[tuple[str, float | None], dict[str, Number]] = {}
        found: dict[str, Number] = {}
        for name, measure in self.measures.items():
            if name not in there:
                continue
            asked = measure.subject, duration if np.isfinite(duration) else measure.duration
            if asked not in motions:
                motions[asked] = numbers_in_time(self.run, *asked, values, (count, 1), times)
            found[name] = motions[asked][measure.kind if measure.in_time else OVER_TIME[measure.kind]]
        return found

    def rate(self, condition: int, row: Array) -> Array:
        """Derivative by time of courses in a condition, (…, position), by differences of neighbours."""
        phase = self.phases[condition]
        if row.shape[-1] < 3 or row.shape[-1] != len(phase):
            return np.zeros_like(row)
        return np.asarray(np.gradient(row, phase * self.durations[condition], axis=-1))

    @cached_property
    def bends(self) -> tuple[Array, ...]:
        """None: a speed has no corner, and a motor's effort none that its speed does not have."""
        return tuple(np.zeros(0) for _ in self.phases)

    def driven(self, condition: int, at: Array) -> tuple[float, float, float]:
        """NaN: times name the positions."""
        return float("nan"), float("nan"), float("nan")
