"""What integrates a free motion without play: how its rates are told, and where it stops for a force that jumps."""

from __future__ import annotations

from collections.abc import Callable

from trunnion.dynamics.active_motion import ActiveMotion
from trunnion.dynamics.clutch_motion import ClutchMotion
from trunnion.dynamics.compiled_rates import compiled_rates
from trunnion.dynamics.integrate import INSIDE, MOST_EVALUATIONS, Integration
from trunnion.dynamics.rates import Dynamics, Walks
from trunnion.dynamics.start import Places, load_times, ranges
from trunnion.dynamics.state import FreeMotion
from trunnion.dynamics.tables import tabulated
from trunnion.dynamics.tabulated import TabulatedRates

__all__ = ["CYCLES", "FINEST", "integration_of", "rates_of"]

TABLED = 1e-12  # as `integrate.INSIDE`, of tables, which know on which side they are asked
FINEST = 3e-14  # the least relative tolerance of SciPy's integrators
CYCLES = 10  # of the nominal motion: the duration if none is stated


def rates_of(motion: FreeMotion, known: Places) -> Dynamics:
    """The rates of a motion: from tables where it has them, else by walks."""
    tables, walks = tabulated(motion, known), Walks(motion)
    return (compiled_rates(motion) or walks) if tables is None else TabulatedRates(tables, walks)


def integration_of(
    motion: FreeMotion, known: Places, duration: float, tolerance: float,
    progress: Callable[[float], None] | None = None, rates: Dynamics | None = None,
    evaluations: int = MOST_EVALUATIONS,
) -> Integration:  # fmt: skip
    """What integrates a motion. rates: those of `rates_of`, if they are there; evaluations: see `Integration`."""
    rates, times = rates or rates_of(motion, known), load_times(motion, duration)
    limits = ranges(motion, motion.names, known)
    if motion.resisted:
        assert not isinstance(rates, TabulatedRates)  # which are of one coordinate
        return ActiveMotion(
            motion, rates, duration, tolerance, limits=limits, progress=progress, times=times, evaluations=evaluations
        )
    kind = ClutchMotion if any(drive.clutched for drive in motion.drives.values()) else Integration
    return kind(
        motion, rates, duration, tolerance, known.bends, known.period, limits, progress,
        TABLED if isinstance(rates, TabulatedRates) else INSIDE, times, evaluations, known.meetings,
    )  # fmt: skip
