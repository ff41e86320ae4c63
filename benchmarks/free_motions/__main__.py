"""Do random mechanisms move freely as they should? `python -m benchmarks.free_motions [--planar 150] [--spatial 50]`

Mechanisms of `benchmarks.drawn` whose one crank is let go. Beside `trunnion.simulate` stands SciPy's integrator on the
equations of all links at once, which shares nothing with Trunnion: `planar` with friction, `spatial` without. Both are
compared up to the end of the motion, or to where it comes to rest or meets a dead centre first. `--only planar-17
spatial-3` replays seeds; one that is not compared counts as a failure there.
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter

from rich.console import Console

from benchmarks.free_motions import LIMIT, SPATIAL_LIMIT, examine, examine_spatial

SPACES = {"planar": (examine, LIMIT), "spatial": (examine_spatial, SPATIAL_LIMIT)}


def compare(console: Console, space: str, count: int) -> bool:
    """Compare so many motions of the seeds from 0; whether all are within the limit."""
    inspect, limit = SPACES[space]
    outcomes, worst, over, seed = Counter[str](), (0.0, -1), list[tuple[int, float]](), 0
    while sum(number for what, number in outcomes.items() if what.startswith("compared")) < count:
        what, off = inspect(seed)
        outcomes[what] += 1
        worst = max(worst, (off, seed))
        if not off <= limit:
            over.append((seed, off))
        seed += 1
    for what, number in outcomes.most_common():
        console.print(f"{space}: {number:6d} {what}")
    if count:
        console.print(f"{space}: largest difference {worst[0]:.1e} (seed {worst[1]}); over {limit:g}: {over}")
    return not over


def replay(console: Console, name: str) -> bool:
    """Compare one motion; whether it was compared and is within the limit."""
    space, _, seed = name.partition("-")
    inspect, limit = SPACES[space]
    what, off = inspect(int(seed))
    console.print(f"{name}: {what}, {off:.1e}")
    return what.startswith("compared") and off <= limit


def main() -> int:
    """Compare; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.free_motions", description=__doc__)
    parser.add_argument("--planar", type=int, default=150, help="planar motions to compare (150)")
    parser.add_argument("--spatial", type=int, default=50, help="spatial motions to compare (50)")
    parser.add_argument("--only", nargs="+", metavar="NAME", help="replay these alone, such as planar-17 spatial-3")
    options = parser.parse_args()
    console = Console()
    if options.only:
        right = [replay(console, name) for name in options.only]
    else:
        right = [compare(console, space, getattr(options, space)) for space in SPACES]
    return 0 if all(right) else 1


if __name__ == "__main__":
    sys.exit(main())
