"""A virtual test rig: the model observed through sensors, under a schedule of working conditions.

`observe` puts a rig to a mechanism: it solves the model in every condition and draws the errors that the sensors have.
The Observation that it returns makes the readings, condition by condition (`records`), and writes them like those of a
real rig, with the mapping that reads them and the truth (`write`); or it hands them on as a Measurement.

The machine stands still and unloaded while it is idle, and moves as its drivers say from the first sample after: it is
not brought up to speed, and neither motor nor brake has a dynamics of its own. Sensors do not act back on the machine.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trunnion.errors import Finding, MechanismError, Severity
from trunnion.model.arguments import strict_arguments
from trunnion.model.mechanism import Mechanism
from trunnion.rig.reading.rig_file import Rig
from trunnion.rig.virtual.cases import Case, case_names, case_of, channels_of, findings_of, measures_of, placed_at
from trunnion.rig.virtual.files import mapping_of, truth_of, write
from trunnion.rig.virtual.observation import Recorded, check_seed
from trunnion.rig.virtual.sensors import SensorChannel, draw
from trunnion.solve.run import prepare

__all__ = ["observe"]

Array = NDArray[np.float64]


@strict_arguments
class Observation(Recorded):
    """What a virtual rig has recorded, with its files: data, mapping and truth."""

    def mapping(self, form: str = "") -> dict[str, Any]:
        """The mapping that reads the files; see `files.mapping_of`."""
        return mapping_of(self, form or self.rig.format)

    def truth(self) -> dict[str, Any]:
        """What was drawn and what is true; see `files.truth_of`."""
        return truth_of(self)

    def write(
        self, folder: str | os.PathLike[str], form: str = "", progress: Callable[[int], None] | None = None
    ) -> list[str]:
        """Write a file for each condition, `mapping.yaml` and `truth.yaml` into a folder; their names.

        form: csv, parquet or tdms, that of the rig file if not given; progress: called with the files written.
        """
        return write(self, folder, form or self.rig.format, progress)


@strict_arguments
@np.errstate(all="ignore")  # of numbers near the end of the floats: what has no value is NaN, and its status says so
def observe(
    mechanism: Mechanism,
    rig: Rig | Mapping[str, Any] | str | os.PathLike[str],
    seed: int = 1,
    progress: Callable[[int], None] | None = None,
) -> Observation:
    """Put a rig to a mechanism: solve the model in all conditions of the schedule, draw the errors of the sensors.

    rig: a Rig, the entries of a rig file, or its path; seed: of all random numbers: the same seed, the same readings to
    the last bit; progress: called with the conditions done. A condition that the model cannot be in at every position,
    because it locks or does not go together, is left out, and a finding says which and why.
    Raises MechanismError for a rig that does not fit the mechanism, or if no condition is left.
    """
    check_seed(seed)
    if not isinstance(rig, Rig):
        rig = Rig(**rig) if isinstance(rig, Mapping) else Rig.read(rig)
    with placed_at("set"):
        mechanism = mechanism.with_values(dict(rig.set_)) if rig.set_ else mechanism
    rows = rig.schedule.rows()
    channels: dict[str, SensorChannel] = {}
    cases: list[Case] = []
    for number, (name, row) in enumerate(zip(case_names(len(rows)), rows, strict=True), 1):
        key = f"conditions.{number - 1}" if rig.schedule.conditions else "over"
        with placed_at(f"schedule.{key}", number):
            run = prepare(mechanism.with_values(dict(row)) if row else mechanism)
        measures = measures_of(rig, run)
        channels = channels or channels_of(rig, run, measures)
        case = case_of(number, name, row, run, rig, measures, channels)
        cases.append(case)
        if progress:
            progress(number)
    findings = tuple(findings_of(cases, channels, rig))
    sound = tuple(case for case in cases if case.worst.solved)
    if not sound:
        what = (
            f"none of the {len(rows)} conditions can be measured"
            if len(rows) > 1
            else "the condition cannot be measured"
        )
        remedy = "choose conditions in which the model has a solution at every position"
        raise MechanismError([*findings, Finding(what, "schedule", remedy)])
    if any(one.severity is Severity.ERROR for one in findings):
        raise MechanismError(findings)
    skipped = tuple(case.number for case in cases if not case.worst.solved)
    drawn = {name: draw(channel, int(seed)) for name, channel in channels.items()}
    return Observation(mechanism, rig, int(seed), channels, drawn, sound, skipped, findings)
