"""Does the compiled engine say what NumPy says? `python -m benchmarks.engines [--planar N] [--spatial N] [--seed S]`

Random mechanisms, three numbers of each spread over a few samples: drive efforts and reactions at every position by
both engines, and the statuses. A mechanism that only NumPy takes is counted. `--only planar-17` shows one.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from benchmarks.drawn import planar, spatial
from trunnion import Mechanism, MechanismError
from trunnion.solve.backward import status_of
from trunnion.solve.run import prepare
from trunnion.solve.walk_kernel import WalkKernel

DRAWN = {"planar": planar.drawn, "spatial": spatial.drawn}
SAMPLES, POSITIONS, SPREAD = 3, 24, 1e-4
LIMIT = 1e-9  # of the peak

__all__ = ["Found", "compared"]


class Found(NamedTuple):
    """apart: largest difference of a curve, of the largest of its kind; statuses: positions at which they differ;
    again: share that NumPy decided; refused: why there is nothing to compare.
    """

    apart: float = 0.0
    statuses: int = 0
    again: float = 0.0
    refused: str = ""

    @property
    def agrees(self) -> bool:
        return self.apart <= LIMIT and not self.statuses


def compared(space: str, seed: int) -> Found:
    """Both engines on one mechanism."""
    try:
        mechanism = Mechanism.model_validate(DRAWN[space](seed)[1])
        run = prepare(mechanism)
        kernel = WalkKernel(run, _figures(run))
    except MechanismError as error:
        return Found(refused=error.findings[0].what)
    rng, entries = np.random.default_rng(seed), mechanism.parameter_set.entries
    free = [p for p, e in entries.items() if p.startswith("links.") and not e.depends and run.values.get(p)][:3]
    spread = {path: run.values[path] * (1 + SPREAD * rng.standard_normal((SAMPLES, 1))) for path in free}
    values, time = mechanism.parameter_set.evaluate(spread), run.cycle.times(POSITIONS)
    shape = (SAMPLES if free else 1, len(time))
    try:
        curves, status = kernel.curves(values, time)
    except MechanismError as error:
        return Found(refused=error.findings[0].what)
    with np.errstate(all="ignore"):
        back = run.solve(time, values)
        expected = {name: np.broadcast_to(figure(back), shape) for name, figure in kernel.figures.items()}
        statuses = status_of(back, shape)
    apart = 0.0
    for kind in {name.partition(":")[0] for name in expected}:
        own = [name for name in expected if name.startswith(kind)]
        known = [np.abs(expected[name][statuses <= 1]) for name in own]
        peak = max((float(np.max(one, initial=0.0)) for one in known), default=0.0)
        for name in own if peak else ():
            apart = max(apart, float(np.max(np.abs(curves[name] - expected[name])[statuses <= 1], initial=0.0)) / peak)
    return Found(apart, int(np.count_nonzero(status != statuses)), kernel.again / status.size)


def _figures(run: Any) -> dict[str, Callable[[Any], Any]]:
    def effort(driver: str) -> Callable[[Any], Any]:
        return lambda back: back.efforts[driver]

    def force(joint: str) -> Callable[[Any], Any]:
        def figure(back: Any) -> Any:
            parts = back.reactions[joint]
            return parts[0][0] if isinstance(parts[0], tuple) else parts[0]

        return figure

    efforts = {f"effort:{driver}": effort(driver) for driver in run.system.mechanism.drivers}
    return efforts | {f"force:{joint}": force(joint) for joint in run.system.joints}


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m benchmarks.engines", description=__doc__)
    parser.add_argument("--planar", type=int, default=100)
    parser.add_argument("--spatial", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", default="")
    asked = parser.parse_args()
    counts = {"planar": asked.planar, "spatial": asked.spatial}
    names = [(space, asked.seed + k) for space, count in counts.items() for k in range(count)]
    if asked.only:
        space, _, number = asked.only.partition("-")
        names = [(space, int(number))]
    refused: Counter[str] = Counter()
    worst: dict[str, float] = dict.fromkeys(counts, 0.0)
    again: dict[str, list[float]] = {space: [] for space in counts}
    wrong = 0
    for space, seed in names:
        found = compared(space, seed)
        if found.refused:
            refused[" ".join(found.refused.split()[-6:])] += 1
            continue
        worst[space] = max(worst[space], found.apart)
        again[space].append(found.again)
        if not found.agrees:
            wrong += 1
            print(f"{space}-{seed}: apart {found.apart:.1e}, {found.statuses} statuses differ", flush=True)
    for space, shares in again.items():
        if shares:
            print(f"{space}: {len(shares)} compared, largest difference {worst[space]:.1e} of the peak, "
                  f"{np.mean(shares):.1%} of the lanes decided by NumPy")  # fmt: skip
    print(f"{sum(refused.values())} left to NumPy: {dict(refused)}")
    print(f"{wrong} disagree")
    return int(bool(wrong))


if __name__ == "__main__":
    sys.exit(main())
