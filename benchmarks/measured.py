"""A recording of 10⁶ rows and five channels with dropouts, drifting zero and wrong sign: time and memory to read it.

Each format in a process of its own, since what is measured of memory is the most that a process ever had.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

ROWS, RATE, RPM = 1_000_000, 10_000.0, 600.0
MAPPING: dict[str, Any] = {
    "trunnion-data": 1,
    "time": {"column": "t", "unit": "s"},
    "angle": {"from": "pulses", "column": "encoder", "per_turn": 60},
    "channels": {
        "torque-in": {
            "column": "T1",
            "measures": "effort:input",
            "unit": "V",
            "gain": "100 mV/(N m)",
            "zero": {"over": ["0 s", "0.45 s"]},
        },
        "brake": {"column": "T2", "measures": "load:brake", "unit": "N m"},
        "speed-in": {"column": "n1", "measures": "rate:input", "unit": "rpm"},
        "speed-out": {"column": "n2", "measures": "rate:output", "unit": "rpm"},
    },
    "filter": {"cut_off": "200 Hz"},
}


def recording() -> dict[str, np.ndarray]:
    """The columns of a run with its faults."""
    rng = np.random.default_rng(3)
    t = np.arange(ROWS) / RATE
    runs = t >= 0.5
    angle = np.where(runs, RPM * np.pi / 30 * (t - 0.5), 0.0) + 0.37
    torque = np.where(runs, 20 + 5 * np.sin(angle), 0.0) + 0.2 * rng.normal(size=ROWS) + 0.005 * t
    for begin in rng.integers(20_000, ROWS - 1000, 20):
        torque[begin : begin + rng.integers(1, 300)] = np.nan
    return {
        "t": t,
        "T1": 0.1 * torque,
        "T2": -(np.where(runs, 18 + 4 * np.sin(angle + 0.3), 0.0) + 0.2 * rng.normal(size=ROWS)),
        "n1": np.where(runs, RPM, 0.0) + 0.05 * rng.normal(size=ROWS),
        "n2": np.where(runs, RPM * (1 + 0.05 * np.cos(2 * angle)), 0.0) + 0.05 * rng.normal(size=ROWS),
        "encoder": np.floor(angle / (2 * np.pi) * 60),
    }


def write(folder: Path) -> list[Path]:
    """The recording in each format."""
    from nptdms import ChannelObject, TdmsWriter

    columns = recording()
    paths = [folder / f"run{end}" for end in (".csv", ".parquet", ".tdms")]
    frame = pd.DataFrame(columns)
    frame.to_csv(paths[0], index=False)
    frame.to_parquet(paths[1])
    with TdmsWriter(paths[2]) as writer:
        writer.write_segment([ChannelObject("rig", name, values) for name, values in columns.items()])
    return paths


def measure(path: Path) -> None:
    """Read one file; time, most memory, faults."""
    from trunnion.rig import read as read_measured

    begin = time.perf_counter()
    found = read_measured(MAPPING, [path])
    took = time.perf_counter() - begin
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    turns = found.conditions[0].courses["brake"].turns.shape[0]
    print(f"{path.suffix:<9} {took:5.2f} s  {most:4.0f} MiB  {turns} turns")
    for finding in found.findings:
        print(f"  {finding.where}: {finding.what}")


def main() -> None:
    """Write the files, then read each in a fresh process."""
    with tempfile.TemporaryDirectory() as folder:
        for path in write(Path(folder)):
            subprocess.run([sys.executable, __file__, str(path)], check=True)


if __name__ == "__main__":
    if len(sys.argv) > 1:
        measure(Path(sys.argv[1]))
    else:
        main()
