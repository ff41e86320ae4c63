"""`analyse` with its number of positions: `python -m benchmarks.cycles [--most 1000000]`.

The four-bar of Durango et al. with friction, each line in its own process, and written to a Parquet file. Time of the
second analysis, once the machine code is there; processor time of all threads.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

import trunnion
from benchmarks.run import peak_memory

MODEL = Path(__file__).parent.parent / "examples" / "durango-fourbar.yaml"
WAYS = {
    "all variables": {},
    "efforts and reactions": {"variables": ["drive_effort", "reaction_force"]},
    "all, float32": {"dtype": "float32"},
    "to a file, effort and status": {"out": "cycle.parquet", "columns": ["A.effort", "status"]},
}


def alone(way: str, steps: int) -> None:
    """Measure one line in this process, and print it as JSON."""
    mechanism, asked = trunnion.read(MODEL), dict(WAYS[way])
    with tempfile.TemporaryDirectory() as folder:
        if "out" in asked:
            asked["out"] = Path(folder) / str(asked["out"])
        trunnion.analyse(mechanism, steps, **asked)
        begin, busy = time.perf_counter(), time.process_time()
        trunnion.analyse(mechanism, steps, **asked)
        took = time.perf_counter() - begin, time.process_time() - busy
    print(json.dumps({"seconds": took[0], "busy": took[1], "bytes": peak_memory()}))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--most", type=int, default=1_000_000, help="positions, at most")
    parser.add_argument("--alone", nargs=2, metavar=("WAY", "STEPS"), help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.alone:
        alone(options.alone[0], int(options.alone[1]))
        return
    shown = Table("kept", title="analyse(), four-bar with friction", title_justify="left", pad_edge=False)
    for title in ("positions", "ms", "ms of CPU", "µs of CPU\na position", "peak, MiB"):
        shown.add_column(title, justify="right")
    for way in WAYS:
        for steps in (10**power for power in range(3, 8) if 10**power <= options.most):
            command = [sys.executable, "-m", "benchmarks.cycles", "--alone", way, str(steps)]
            told = json.loads(subprocess.run(command, capture_output=True, text=True, check=True).stdout)
            times = [f"{1e3 * told[key]:.1f}" for key in ("seconds", "busy")]
            size = f"{told['bytes'] / 2**20:.0f}"
            shown.add_row(way, f"{steps:,}", *times, f"{1e6 * told['busy'] / steps:.2f}", size)
    Console(width=120).print(shown)


if __name__ == "__main__":
    main()
