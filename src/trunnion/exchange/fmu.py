"""FMU: the motion in time as a unit for co-simulation (FMI 3), run by Python with trunnion installed."""

from __future__ import annotations

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

from pythonfmu3 import FmuBuilder

from trunnion.dynamics.continued import Continued
from trunnion.errors import Finding, Severity, counted
from trunnion.exchange import fmu_slave
from trunnion.exchange.skeleton import Positions

__all__ = ["write"]


def write(positions: Positions, path: Path) -> list[Finding]:
    """Write the motion of a mechanism; of its positions nothing but the mechanism is looked at."""
    motion = Continued(positions.mechanism)
    with TemporaryDirectory() as folder:
        model = Path(folder) / fmu_slave.MODEL
        positions.mechanism.write(model)
        built = FmuBuilder.build_FMU(Path(str(fmu_slave.__file__)), folder, [model])
        shutil.copyfile(built, path)
    what = f"the unit has {counted(len(motion.inputs), 'input')}, holds the model file and runs where Python has "
    what += "trunnion installed, on Linux and Windows on x86-64"
    return [Finding.weighed(Severity.NOTE, "exchange.fmu_needs", "", what, "pip install 'trunnion[cad]' there")]
