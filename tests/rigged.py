"""Measurements made of a model, with noise and errors of sensors, for the tests of identification."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

import trunnion
from trunnion.measures.evaluation import NumpyKernel
from trunnion.measures.measures import named
from trunnion.rig.reading.measurement import Accuracy, Condition, Measurement, Signal
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import prepare

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Sensors:
    """What sensors do, in shares of the largest value of their channel but for the gain.

    step: between two readings; cut_off: of a low-pass of the noise, in shares of half the sampling rate.
    """

    noise: float = 0.002
    zero: float = 0.0005
    gain: float = 0.0005
    step: float = 0.0
    cut_off: float = 0.0


@dataclass(frozen=True)
class True_:  # noqa: N801
    """True courses in some conditions."""

    conditions: tuple[dict[str, float], ...]
    measures: Mapping[str, str]
    units: Mapping[str, str]
    phase: Array
    courses: tuple[dict[str, Array], ...]

    def measured(self, seed: int = 0, turns: int = 10, sensors: Sensors = Sensors()) -> Measurement:
        """Readings by sensors whose actual errors are drawn from what is stated of them."""
        draw = np.random.default_rng(seed)
        size = {name: max(float(np.max(np.abs(one[name]))) for one in self.courses) for name in self.measures}
        zero = {name: draw.normal() * sensors.zero * size[name] for name in self.measures}
        gain = {name: draw.normal() * sensors.gain for name in self.measures}
        conditions = []
        for k, (values, true) in enumerate(zip(self.conditions, self.courses, strict=True)):
            courses = {}
            for name, measures in self.measures.items():
                noise = draw.normal(size=turns * len(self.phase))
                if sensors.cut_off:
                    noise = sosfiltfilt(butter(2, sensors.cut_off, output="sos"), noise)
                    noise /= noise.std()
                read = (1 + gain[name]) * np.tile(true[name], turns) + zero[name] + sensors.noise * size[name] * noise
                if sensors.step:
                    read = np.round(read / (sensors.step * size[name])) * sensors.step * size[name]
                accuracy = Accuracy(sensors.zero * size[name], sensors.gain, sensors.step * size[name])
                courses[name] = Signal(name, measures, self.units[name], read.reshape(turns, -1), accuracy)
            conditions.append(Condition(f"run-{k + 1}", values, self.phase, courses))
        return Measurement("simulated", tuple(conditions))


def truth(
    mechanism: trunnion.Mechanism,
    conditions: Sequence[dict[str, float]],
    measures: Mapping[str, str],
    values: Mapping[str, Any],
    positions: int = 72,
) -> True_:
    """What the model says with these values."""
    phase = np.arange(positions) / positions
    courses = []
    for condition in conditions:
        run = prepare(mechanism.with_values({**values, **condition}))
        found = named(run.system.mechanism, measures.values(), run.values)
        curves, _ = NumpyKernel(run, found, FrictionMethod()).courses(run.values, run.cycle.duration * phase)
        both = zip(measures, found, strict=True)
        courses.append({name: np.array(np.broadcast_to(curves[one.name][0], phase.shape)) for name, one in both})
    units = {name: one.unit(run.system) for name, one in zip(measures, found, strict=True)}
    return True_(tuple(conditions), measures, units, phase, tuple(courses))
