"""FMU: the motion in time as a unit for co-simulation (FMI 3). This file is copied into it, and imports trunnion.

Variables are in SI, angles in rad. Inputs are the efforts on the free drivers beside their motors', and the components
of loads that are plain numbers; they are constant during a step. Outputs are coordinates and rates of the free
drivers, efforts of all drivers, and reactions of the joints, as `simulate` has them. Parameters are the dimensions that
are plain numbers, and where free drivers begin.
"""

from __future__ import annotations

import math
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import pythonfmu3 as fmi
from pythonfmu3 import Fmi3Slave, Unit

from trunnion.dynamics.result import Books
from trunnion.dynamics.simulate import Continued
from trunnion.errors import Finding, MechanismError, Severity, counted
from trunnion.exchange.draft import Positions
from trunnion.model.mechanism import read_mechanism

MODEL = "model.yaml"  # beside this file
UNITS = {
    "s": Unit("s", s=1), "rad": Unit("rad", rad=1), "rad/s": Unit("rad/s", rad=1, s=-1), "m": Unit("m", m=1),
    "m/s": Unit("m/s", m=1, s=-1), "N": Unit("N", kg=1, m=1, s=-2), "N m": Unit("N m", kg=1, m=2, s=-2),
}  # fmt: skip


def write(positions: Positions, path: Path) -> list[Finding]:
    """Write the motion of a mechanism; of its positions nothing but the mechanism is looked at."""
    motion = Continued(positions.mechanism)
    with TemporaryDirectory() as folder:
        model = Path(folder) / MODEL
        positions.mechanism.write(model)
        shutil.copyfile(fmi.FmuBuilder.build_FMU(Path(__file__), folder, [model]), path)
    what = f"the unit has {counted(len(motion.inputs), 'input')}, holds the model file and runs where Python has "
    what += "trunnion installed, on Linux and Windows on x86-64"
    return [Finding.weighed(Severity.NOTE, "exchange.fmu_needs", "", what, "pip install 'trunnion[cad]' there")]


class Linkage(Fmi3Slave):  # type: ignore[misc]
    """The motion of the mechanism in the model file beside this file."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        self.mechanism = read_mechanism(Path(self.resources) / MODEL)
        self.description = self.mechanism.name
        self.register_units(list(UNITS.values()))
        self.time = self.begin = 0.0
        motion = self.motion = Continued(self.mechanism)
        self.parameters = dict(self._parameters())
        self.values = {"time": 0.0, **self.parameters, **motion.inputs}
        self._add("time", "time", "s", fmi.Fmi3Causality.independent)
        for path in self.parameters:
            self._add(path, path, self._unit(path), fmi.Fmi3Causality.parameter)
        for path in motion.inputs:
            self._add(path, path, self._unit(path), fmi.Fmi3Causality.input)
        for name, text, unit, _ in self._outputs(motion.now()):
            self._add(name, text, unit, fmi.Fmi3Causality.output)

    def _parameters(self) -> Iterator[tuple[str, float]]:
        """What others may set before the motion begins, by path, with what the model says."""
        values = self.mechanism.parameters()
        for path, entry in self.mechanism.parameter_set.entries.items():
            first, *_, last = path.split(".")
            plain = first == "dimensions" and not entry.quantity.names
            if plain or (first == "drivers" and path.endswith(f".initial.{last}")):
                yield path, float(values[path])

    def _unit(self, path: str) -> str:
        """The unit of what others set; of a dimension, which may be anything, none."""
        section, *_, last = path.split(".")
        if section == "loads":
            return "N m" if "moment" in path.split(".") else "N"
        if section != "drivers":
            return ""
        turns = any(path.startswith(f"drivers.{name}.") and self._turns(name) for name in self.mechanism.drivers)
        units = {"applied": ("N", "N m"), "coordinate": ("m", "rad"), "speed": ("m/s", "rad/s")}
        return units[last][turns]

    def _turns(self, driver: str) -> bool:
        return self.mechanism.effective_joints[driver].pair.turns

    def _outputs(self, books: Books) -> Iterator[tuple[str, str, str, float]]:
        """Name, text, unit and value of every output."""
        for i, name in enumerate(self.motion.motion.names):
            unit = "rad" if self._turns(name) else "m"
            yield f"{name}.coordinate", f"coordinate of {name}", unit, float(books.at.q[i, 0])
            yield f"{name}.rate", f"rate of {name}", f"{unit}/s", float(books.at.rate[i, 0])
        for i, name in enumerate(books.labels["driver"]):
            unit, effort = "N m" if self._turns(name) else "N", float(books.arrays["drive_effort"][i, 0])
            yield f"{name}.effort", f"effort that moves {name}", unit, effort
        for kind, unit in (("force", "N"), ("moment", "N m")):
            numbers = books.arrays[f"reaction_{kind}"]
            rows = numbers.reshape(len(numbers), -1)
            axes = books.labels["axis"] if rows.shape[1] > 1 else ["z"]
            for joint, row in zip(books.labels["joint"], rows, strict=True):
                for axis, value in zip(axes, row, strict=True):
                    text = f"reaction {kind} on the second link of {joint}, {axis}"
                    yield f"{joint}.reaction_{kind}_{axis}", text, unit, float(value)

    def _add(self, key: str, text: str, unit: str, causality: Any) -> None:
        """A variable, under a name that the standard allows: words with points between."""
        words = (re.sub(r"^(?=\d)", "_", re.sub(r"\W", "_", word, flags=re.ASCII)) for word in key.split("."))
        name = ".".join(words)
        if any(name == variable.name for variable in self.vars.values()):
            name += f"_{len(self.vars)}"
        fixed = causality == fmi.Fmi3Causality.parameter
        self.register_variable(
            fmi.Float64(
                name,
                causality=causality,
                variability=fmi.Fmi3Variability.fixed if fixed else fmi.Fmi3Variability.continuous,
                initial=fmi.Fmi3Initial.calculated if causality == fmi.Fmi3Causality.output else None,
                description=text,
                unit=unit or None,
                getter=lambda: self.values[key],
                setter=lambda value: self.values.update({key: value}),
            ),
            nested=False,
        )

    def setup_experiment(self, start_time: float) -> None:
        """Take the time at which it begins, s."""
        self.values["time"] = self.begin = start_time

    def exit_initialization_mode(self) -> None:
        """Begin the motion, with parameters and inputs as they are set."""
        changed = {path: self.values[path] for path, value in self.parameters.items() if self.values[path] != value}
        try:
            self.motion = Continued(self.mechanism.with_values(changed) if changed else self.mechanism)
        except MechanismError as error:
            self.log(str(error), fmi.Fmi3Status.error)
            raise
        self.motion.inputs.update({path: self.values[path] for path in self.motion.inputs})
        self.values.update({name: value for name, _, _, value in self._outputs(self.motion.now())})

    def do_step(self, current_time: float, step_size: float) -> fmi.Fmi3StepResult:
        """Go on by a step, s; where the motion ends, ask for the end of the simulation."""
        motion, time = self.motion, current_time + step_size
        inputs = {path: self.values[path] for path in motion.inputs}
        if not all(map(math.isfinite, inputs.values())):
            self.log("an input is no finite number", fmi.Fmi3Status.error)
            return fmi.Fmi3StepResult(status=fmi.Fmi3Status.error)
        motion.inputs.update(inputs)
        self.values.update({name: value for name, _, _, value in self._outputs(motion.advance(time - self.begin))})
        self.values["time"] = time if motion.ended is None else self.begin + motion.time
        if motion.ended is not None:
            self.log(str(motion.ended), fmi.Fmi3Status.warning)
        return fmi.Fmi3StepResult(status=fmi.Fmi3Status.ok, terminateSimulation=motion.ended is not None)
