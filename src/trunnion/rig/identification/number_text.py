"""Numbers with their uncertainty in words: as many digits as it leaves, in the unit that is read most easily."""

from __future__ import annotations

import math
from collections.abc import Sequence

__all__ = ["amount", "decimals", "few_digits", "joined", "scaled"]

READ = {"rad": (180 / math.pi, "°"), "m": (1e3, "mm"), "1": (1.0, ""), "": (1.0, "")}


def scaled(unit: str) -> tuple[float, str]:
    """Factor and unit in which a number in SI is read."""
    return READ.get(unit, (1.0, unit))


def decimals(uncertainty: float) -> int:
    """Decimals that leave two digits of an uncertainty; negative for tens, hundreds."""
    if not math.isfinite(uncertainty) or uncertainty <= 0:
        return 6
    shown = float(f"{uncertainty:.1e}")  # 0.0996 is 0.10
    return 1 - math.floor(math.log10(shown))


def amount(value: float, half: float | None, unit: str) -> str:
    """A value, ± half if given: `0.3012 ± 0.0034`, `15.02 ± 0.05 °`."""
    factor, shown = scaled(unit)
    tail = f" {shown}" if shown else ""
    size = abs(value * factor)
    if half is None or not math.isfinite(half) or half <= 0:
        return f"{value * factor:.6g}{tail}"
    half = half * factor
    if half < 1e-5 or max(size, half) >= 1e7:
        power = math.floor(math.log10(max(size, half)))
        places = max(decimals(half / 10**power), 0)
        return f"({value * factor / 10**power:.{places}f} ± {half / 10**power:.{places}f})e{power}{tail}"
    places = decimals(half)
    if places < 0:
        return f"{round(value * factor, places):.0f} ± {round(half, places):.0f}{tail}"
    return f"{value * factor + 0.0:.{places}f} ± {half:.{places}f}{tail}"


def few_digits(number: float, digits: int = 2) -> str:
    """A number to so many digits, without a power of ten as far as that is readable."""
    return f"{float(f'{number:.{digits}g}'):,.6g}"


def joined(names: Sequence[str]) -> str:
    """Names one after the other."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
