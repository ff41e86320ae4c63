"""What loaded seats cost: `analyse` with its pins where their loads press them, beside the ideal analysis of the same.

Both are the whole of `trunnion.analyse`, Dataset and findings included, in turns; what the seats add is counted in
times of the ideal analysis. The seats take their courses, and at each position the ideal mechanism and one walk.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from rich.table import Table

import trunnion
from trunnion import Mechanism

EXAMPLES = Path(__file__).parents[1] / "examples"
LIMIT = 2.0  # times the ideal analysis, added
MODELS = {  # positions; the four-bar of Durango et al. states no play
    "toleranced-slider-crank": 100_000,
    "fourbar-with-play": 100_000,
    "durango-fourbar": 100_000,
    "rssr-with-play": 10_000,
    "pezzuti-cardan": 10_000,
}

__all__ = ["Found", "fill", "verdicts"]


@dataclass(frozen=True)
class Found:
    """µs per configuration of the ideal analysis and of that with loaded seats."""

    ideal: float
    loaded: float

    @property
    def added(self) -> float:
        """What the seats add, in times of the ideal analysis."""
        return self.loaded / self.ideal - 1


def _models(name: str) -> tuple[Mechanism, Mechanism]:
    mechanism = Mechanism.read(EXAMPLES / f"{name}.yaml")
    if name == "durango-fourbar":
        mechanism = mechanism.with_values({"joint_defaults.pin.clearance": "0.05 mm"})
    return mechanism.with_seats("free"), mechanism.with_seats("loaded")


def fill(rounds: int) -> tuple[Table, dict[str, Found]]:
    """Measure all; the table and the figures by model."""
    table = Table(title="Loaded seats beside the ideal analysis, one thread", title_justify="left", pad_edge=False)
    table.add_column("model")
    for title in ("positions", "ideal,\nµs per position", "loaded seats,\nµs per position", "added,\n× ideal", "kept"):
        table.add_column(title, justify="right")
    found: dict[str, Found] = {}
    for name, count in MODELS.items():
        best = [float("inf"), float("inf")]
        for _ in range(max(2, rounds // 5)):
            for i, one in enumerate(_models(name)):
                begin = time.perf_counter()
                trunnion.analyse(one, steps=count)
                best[i] = min(best[i], (time.perf_counter() - begin) / count * 1e6)
        found[name] = Found(*best)
        row = found[name]
        kept = "yes" if row.added <= LIMIT else "NO"
        table.add_row(name, f"{count:,}", f"{row.ideal:.2f}", f"{row.loaded:.2f}", f"{row.added:.2f}", kept)
    return table, found


def verdicts(found: dict[str, Found]) -> list[tuple[str, bool]]:
    """The limit for every model, with whether it is kept."""
    return [
        (f"loaded seats of {name} add {one.added:.2f} × the ideal analysis, at most {LIMIT:g}", one.added <= LIMIT)
        for name, one in found.items()
    ]
