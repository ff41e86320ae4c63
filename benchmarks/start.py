"""What short commands take as processes of their own, the commands in turn: `python -m benchmarks.start`.

Clock and CPU, the least of several rounds each; Python's own start stands beside them.
"""

from __future__ import annotations

import math
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from rich.console import Console
from rich.table import Table

EXAMPLES = Path(__file__).parents[1] / "examples"
FOUR_BAR, CARDAN = str(EXAMPLES / "durango-fourbar.yaml"), str(EXAMPLES / "pezzuti-cardan.yaml")


def _spent() -> float:
    """Seconds of CPU of all processes started so far that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main(rounds: int = 10) -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as folder:
        program, lab = [sys.executable, "-m", "trunnion"], f"{folder}/lab"
        rig = [*program, "rig", CARDAN, str(EXAMPLES / "rig" / "cardan-rig.yaml"), "--out", lab]
        subprocess.run(rig, stdout=subprocess.DEVNULL, check=True)
        commands = {
            "python -c pass": [sys.executable, "-c", "pass"],
            "--help": [*program, "--help"],
            "check, four-bar": [*program, "check", FOUR_BAR],
            "analyse, four-bar": [*program, "analyse", FOUR_BAR],
            "compare, Cardan joint, 21 files": [*program, "compare", CARDAN, f"{lab}/mapping.yaml"],
            "plot, four-bar, 8 figures": [*program, "plot", FOUR_BAR, "--out", f"{folder}/figures"],
            "report, four-bar": [*program, "report", FOUR_BAR, "--out", f"{folder}/report.html"],
        }
        least = dict.fromkeys(commands, (math.inf, math.inf))
        for _ in range(rounds):
            for name, words in commands.items():
                begin, before = time.perf_counter(), _spent()
                subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
                took = time.perf_counter() - begin, _spent() - before
                least[name] = min(least[name][0], took[0]), min(least[name][1], took[1])
    table = Table(title=f"Processes, least of {rounds}", title_justify="left", pad_edge=False)
    table.add_column("command")
    table.add_column("s", justify="right")
    table.add_column("s of CPU", justify="right")
    for name, (clock, busy) in least.items():
        table.add_row(name, f"{clock:.3f}", f"{busy:.3f}")
    Console().print(table)


if __name__ == "__main__":
    main()
