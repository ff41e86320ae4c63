"""What integrates a free motion without play: and where it stops for a force that jumps."""

from __future__ import annotations

from collections.abc import Callable

from trunnion.dynamics.active_motion import ActiveMotion
from trunnion.dynamics.bridged import bridged
from trunnion.dynamics.clutch_motion import ClutchMotion
from trunnion.dynamics.integrate import MOST_EVALUATIONS, Integration
from trunnion.dynamics.rates import Dynamics
from trunnion.dynamics.start import Places, load_times, ranges
from trunnion.dynamics.state import FreeMotion

__all__ = ["CYCLES", "FINEST", "integration_of"]

FINEST = 3e-14  # the least relative tolerance of SciPy's integrators
CYCLES = 10  # of the nominal motion: the duration if none is stated


def integration_of(
    motion: FreeMotion, rates: Dynamics, load_places: Places, duration: float, tolerance: float,
    progress: Callable[[float], None] | None = None, evaluations: int = MOST_EVALUATIONS, start: float = 0.0,
    senses: tuple[int, ...] = (),
) -> Integration:  # fmt: skip
    """What integrates a motion. duration, evaluations, start, senses: see `Integration`."""
    times = load_times(motion, duration)
    limits = ranges(motion, motion.names, load_places)
    if motion.resisted:
        return ActiveMotion(
            motion, rates, duration, tolerance, limits=limits, progress=progress, times=times, evaluations=evaluations,
            senses=senses, start=start,
        )  # fmt: skip
    kind = ClutchMotion if any(drive.clutched for drive in motion.drives.values()) else Integration
    return kind(
        motion, bridged(motion, rates), duration, tolerance, load_places.bends, load_places.period, limits, progress,
        times, evaluations, load_places.meetings, start=start,
    )  # fmt: skip
