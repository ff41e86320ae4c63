"""Are the figures of a cycle the same whatever --steps is, and right? `python -m benchmarks.courses`

Summary and measures of the examples, of a four-bar with a resisting torque on its rocker, and of random mechanisms are
taken at 12, 60, 360 and 3600 positions: they have to be the same to 1e-6 of their scale. Extremes of efforts, reactions
and friction power are then held against very many positions and both sides of every break. The count of figures that do
not agree is printed; it ends with 1 if there are any.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import trunnion
from benchmarks.drawn import planar, spatial
from trunnion.cycle.course import course_of
from trunnion.cycle.positions import stretch
from trunnion.errors import MechanismError, Status
from trunnion.results.attributes import NUMERICAL
from trunnion.solve.friction_method import FrictionMethod
from trunnion.solve.run import Run, prepare

Array = NDArray[np.float64]
STEPS = (12, 60, 360, 3600)
SAME, DENSE = 1e-6, 1e-4  # of the scale of a figure
PEAK = 201  # positions beside an extreme
SIDE = 1e-9  # of the cycle: from a break to its sides
EXAMPLES = Path(__file__).parent.parent / "examples"
OF_POSITIONS = (*NUMERICAL, "positions_solved", "positions_lost")

RESISTED: dict[str, Any] = {
    "space": "planar",
    "gravity": [0, 0],
    "links": {
        "frame": {"points": {"A": [0, 0], "D": ["300 mm", 0]}},
        "crank": {"points": {"A": [0, 0], "B": ["100 mm", 0]}},
        "coupler": {"points": {"B": [0, 0], "C": ["250 mm", 0]}},
        "rocker": {"points": {"D": [0, 0], "C": ["200 mm", 0]}, "mass": "2 kg", "centre": ["100 mm", 0]},
    },
    "joints": {
        "A": {"type": "revolute", "links": ["frame", "crank"]},
        "B": {"type": "revolute", "links": ["crank", "coupler"]},
        "C": {"type": "revolute", "links": ["coupler", "rocker"]},
        "D": {"type": "revolute", "links": ["frame", "rocker"]},
    },
    "drivers": {"A": {"speed": "60 rpm"}},
    "loads": {"work": {"joint": "D", "resisting_torque": "1 N m", "useful": True}},
    "assembly": {"C": ["250 mm", "150 mm"]},
    "measures": {"effort": {"effort": "A", "as": "minimum"}, "swing": {"stroke": "D"}},
}

__all__ = ["main"]


def mechanisms(random: int) -> Iterator[tuple[str, trunnion.Mechanism]]:
    """Examples, the four-bar, and so many random ones of the plane and of space."""
    for path in sorted(EXAMPLES.glob("*.yaml")):
        if not path.stem.endswith("-rig"):
            yield path.stem, trunnion.read(path)
    yield "resisted four-bar", trunnion.Mechanism(**RESISTED)
    for seed in range(random):
        drawn = (planar.drawn, spatial.drawn)[seed % 2]
        yield f"random {seed}", trunnion.Mechanism(**drawn(seed)[1])


def figures(mechanism: trunnion.Mechanism, steps: int) -> dict[str, tuple[float, float]]:
    """Value and scale of every figure of the cycle by name: the scale is the largest of its kind."""
    result = trunnion.analyse(mechanism, steps)
    rows = {one.name: one for one in result.trunnion.summary if isinstance(one.value, float)}
    rows = {name: one for name, one in rows.items() if name not in OF_POSITIONS}
    most: dict[tuple[str, str], float] = {}
    for name, one in rows.items():
        kind = one.unit, name.rpartition(".")[2].rpartition("_")[0]
        most[kind] = max(most.get(kind, 0.0), abs(float(one.value or 0.0)))
    return {
        name: (float(one.value or 0.0), most[one.unit, name.rpartition(".")[2].rpartition("_")[0]])
        for name, one in rows.items()
    }


def dense(run: Run, count: int) -> dict[str, float]:
    """Extremes at very many positions, on both sides of every break, and at as many more beside each extreme of these
    as a peak between two of them needs."""
    breaks, duration = course_of(run, FrictionMethod()).courses.breaks, run.cycle.duration
    sides = (breaks[:, None] + SIDE * duration * np.array([-1.0, 1.0])).ravel()
    sides = sides % duration if run.cycle.periodic else sides[(sides > 0) & (sides < duration)]
    time = np.sort(np.concatenate([run.cycle.times(count), sides]))
    found: dict[str, tuple[float, float]] = {}
    extremes(run, time, found)
    for place in {place for _, place in found.values()}:
        k = int(np.searchsorted(time, place))
        extremes(run, np.linspace(time[max(k - 1, 0)], time[min(k + 1, len(time) - 1)], PEAK), found)
    return {name: value for name, (value, _) in found.items()}


def extremes(run: Run, time: Array, found: dict[str, tuple[float, float]]) -> None:
    """Replace the extremes, by name with their times, that are surpassed at these times."""
    for part in np.array_split(time, max(1, len(time) // 20_000)):
        arrays = stretch(run, part, FrictionMethod()).arrays
        solved = arrays["status"] == Status.SOLVED
        if not np.any(solved):
            continue
        rows = {"friction_power_max": np.sum(arrays["friction_power"], axis=0)}
        for i, name in enumerate(run.system.mechanism.drivers):
            rows[f"{name}.effort_max"] = rows[f"{name}.effort_min"] = arrays["drive_effort"][i]
        for i, name in enumerate(run.system.joints):
            rows[f"{name}.reaction_max"] = np.sqrt(np.sum(arrays["reaction_force"][i] ** 2, axis=0))
        for name, row in rows.items():
            sign = -1.0 if name.endswith("_min") else 1.0
            k = int(np.argmax(sign * row[solved]))
            value = float(row[solved][k])
            if name not in found or sign * value > sign * found[name][0]:
                found[name] = value, float(part[solved][k])


def examine(mechanism: trunnion.Mechanism, count: int) -> tuple[int, int, list[str]]:
    """Figures, positions asked for the course, and figures that do not agree."""
    run, every = prepare(mechanism), [figures(mechanism, steps) for steps in STEPS]
    wrong = []
    for name in dict.fromkeys(name for one in every for name in one):
        values = [one.get(name, (np.nan, np.nan)) for one in every]
        spread = max(value for value, _ in values) - min(value for value, _ in values)
        if not spread <= SAME * max(scale for _, scale in values):
            wrong.append(f"{name} at {STEPS}: {', '.join(f'{value:.8g}' for value, _ in values)}")
    if count and run.cycle.duration > 0:
        for name, value in dense(run, count).items():
            known, scale = every[-1].get(name, (np.nan, 1.0))
            if not abs(known - value) <= DENSE * max(scale, abs(value)) and name in every[-1]:
                wrong.append(f"{name}: {known:.8g}, densely {value:.8g}")
    return len(every[0]), course_of(run, FrictionMethod()).courses.asked, wrong


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.courses", description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", help="mechanisms, all if not given")
    parser.add_argument("--dense", type=int, default=100_000, help="positions; 0: none")
    parser.add_argument("--random", type=int, default=20, help="random mechanisms")
    options = parser.parse_args(arguments)
    warnings.simplefilter("ignore")
    total, bad = 0, 0
    for name, mechanism in mechanisms(options.random):
        if options.names and name not in options.names:
            continue
        try:
            with np.errstate(all="ignore"):
                figures_, asked, wrong = examine(mechanism, options.dense)
        except MechanismError as error:
            print(f"{name:30} refused: {error.findings[0].what[:80]}", flush=True)
            continue
        total, bad = total + figures_, bad + len(wrong)
        print(f"{name:30} {figures_:4} figures, {asked:6} positions asked", *wrong, sep="\n    ", flush=True)
    print(f"{bad} of {total} figures do not agree")
    return int(bad > 0)


if __name__ == "__main__":
    sys.exit(main())
