"""Numbers as an engineer reads them: an SI prefix that fits, four digits, true minus signs.

`web/format.js` writes the same in the browser; both are held to one table of cases in `tests/views`.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from trunnion.model.units import in_use

PREFIXES = {-4: "p", -3: "n", -2: "µ", -1: "m", 0: "", 1: "k", 2: "M", 3: "G"}
SCALABLE = ("N m", "N", "W", "m", "s", "J", "Pa")
SMALL = 1e-5  # m: lengths below are told in µm
WORDS = {"rad/s^2": "rad/s²", "m/s^2": "m/s²", "kg m^2": "kg m²"}


def prefixed(peak: float, unit: str) -> tuple[float, str]:
    """The factor and the unit that bring `peak` between 1 and 1000: (0.001, "kN m") for 18 750 N m.

    Units without a use for prefixes (rad, 1, kg m²) come back as they are; so does a peak of zero or NaN. Of a model in
    feet and pounds it is that which the model has.
    """
    if unit in in_use():
        return in_use()[unit]
    if unit == "rad":
        return 180.0 / math.pi, "°"
    if unit not in SCALABLE or not math.isfinite(peak) or peak == 0:
        return 1.0, "" if unit == "1" else WORDS.get(unit, unit)
    step = math.floor(math.log10(abs(float(f"{peak:.4g}"))) / 3 + 1e-12)  # 999.99 N reads as 1.000 kN
    step = min(max(step, min(PREFIXES)), max(PREFIXES))
    return 10.0 ** (-3 * step), PREFIXES[step] + unit


def number(value: float, digits: int = 4) -> str:
    """`value` with so many significant digits, thin spaces between thousands and a true minus: "3.1×10⁻¹²"."""
    if not math.isfinite(value):
        return "—" if math.isnan(value) else ("∞" if value > 0 else "−∞")
    if value == 0:
        return "0"
    size = int(f"{value:.{digits - 1}e}".partition("e")[2])
    if not -4 <= size < 7:
        mantissa, power = f"{value:.{min(digits, 3) - 1}e}".split("e")
        return f"{mantissa}×10{str(int(power)).translate(SUPERSCRIPT)}".replace("-", "−")
    return f"{value:,.{max(digits - 1 - size, 0)}f}".replace(",", "\u202f").replace("-", "−")


Units = dict[str, tuple[float, str]]  # SI unit → factor and unit in which a page shows it
SMALLEST, LARGEST = 0.01, 1e4  # of a figure in the unit of its page; others have their own


def common(sizes: Iterable[tuple[float, str]]) -> Units:
    """The units of a page: of each quantity that of the largest of its figures, (value, SI unit)."""
    most: dict[str, float] = {}
    for size, unit in sizes:
        if unit in SCALABLE and math.isfinite(size):
            most[unit] = max(most.get(unit, 0.0), abs(size))
    return {**{unit: prefixed(size, unit) for unit, size in most.items() if size > 0}, **in_use()}


def quantity(value: object, unit: str = "", units: Units | None = None) -> str:
    """A value with its unit for a table, in those of its page where it fits; what is no number is shown as its text."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        text = "" if value is None else str(value)
        return f"{text}\u00a0{unit}" if text and unit not in ("", "1") else text
    if unit in ("1", "") and float(value).is_integer() and abs(value) < 1e7:
        return number(value, 1)
    if math.isnan(value):
        return number(value)
    factor, unit_shown = (units or {}).get(unit, (0.0, ""))
    if not SMALLEST <= abs(value) * factor < LARGEST:
        factor, unit_shown = prefixed(value, unit)
    return joined(number(value * factor), unit_shown)


def joined(text: str, unit: str) -> str:
    """A number with its unit, which stays on its line: "18.75 kN", "0.5°"."""
    return f"{text}{unit}" if unit in ("°", "") else f"{text}\u00a0{unit}"


def parts(value: float, unit: str, digits: int = 6) -> tuple[str, str]:
    """A number and its unit for a line of plain text or a table of the terminal: ("18.75", "kN m").

    No thin spaces and no zeros at the end, so that it can be searched for and copied.
    """
    if unit == "mm" and (abs(value) < 0.01 or "m" in in_use()):
        value, unit = value * 1e-3, "m"
    factor, unit_shown = prefixed(value, unit)
    text = number(value * factor, digits).replace("\u202f", "")
    if "." in text and "×" not in text:
        text = text.rstrip("0").rstrip(".")
    return text, {"1": "", "deg": "°"}.get(unit_shown, unit_shown)


def readable(value: float, unit: str = "", digits: int = 4) -> str:
    """A quantity within a sentence: "18.75 kN m", "−0.5°", "3.10×10⁻¹²"."""
    text, unit_shown = parts(value, unit, digits)
    return f"{text}{'' if unit_shown in ('°', '') else ' '}{unit_shown}"


def drawn_in(peak: float, unit: str) -> tuple[float, str]:
    """The factor and the unit of what has limits: lengths in mm as on a drawing, others as `prefixed` has them."""
    return (1e3, "mm") if unit == "m" and unit not in in_use() else prefixed(peak, unit)


def scaled(peak: float, unit: str) -> tuple[float, str]:
    """Factor and unit for a size: degrees, millimetres (below 10 µm micrometres), others by a prefix that fits."""
    millimetres = unit == "m" and unit not in in_use() and (peak >= SMALL or not peak > 0)
    return (1e3, "mm") if millimetres else prefixed(peak, unit)


def scale_of(nominal: float, parts_of: Iterable[float], unit: str) -> tuple[float, str]:
    """Factor and unit for all that is written of one figure: its nominal value, and its deviations and limits.

    It is the unit of the largest deviation, or of the nominal value where that is larger, but not by 1000 times.
    """
    sizes = [abs(size) for size in parts_of if math.isfinite(size) and size != 0]
    spread = max(sizes, default=abs(nominal))
    return scaled(max(spread, min(abs(nominal), 1e3 * spread)), unit)


def decimals_of(small: float) -> int:
    """Of a share in per cent, so that a part of this size shows two digits."""
    return min(max(1 - math.floor(math.log10(100 * small)), 1), 8) if small > 0 else 1


def read_in(unit: str) -> tuple[float, str]:
    """Factor and unit of a figure that is compared with others of its kind: degrees, millimetres, else SI."""
    return {"rad": (180 / math.pi, "°"), "m": (1e3, "mm"), "1": (1.0, ""), **in_use()}.get(unit, (1.0, unit))


def decimals(uncertainty: float) -> int:
    """Decimals that leave two digits of an uncertainty (GUM 7.2.6), 6 of none; negative for tens, hundreds."""
    if not math.isfinite(uncertainty) or uncertainty <= 0:
        return 6
    return 1 - math.floor(math.log10(float(f"{uncertainty:.1e}")))  # 0.0996 is 0.10


def with_uncertainty(value: float, half: float | None, unit: str) -> str:
    """A value ± U, if there is one, as `read_in` has it: "0.3012 ± 0.0034", "15.02 ± 0.05 °"."""
    factor, unit_shown = read_in(unit)
    tail = f" {unit_shown}" if unit_shown else ""
    value, half = value * factor + 0.0, (half or math.nan) * factor
    places = decimals(half)
    if not half > 0:
        return f"{value:.6g}{tail}"
    if not -7 < places < 7:
        power = math.floor(math.log10(max(abs(value), half)))
        digits = max(decimals(half / 10**power), 0)
        return f"({value / 10**power:.{digits}f} ± {half / 10**power:.{digits}f})e{power}{tail}"
    return f"{round(value, places):.{max(places, 0)}f} ± {round(half, places):.{max(places, 0)}f}{tail}"


def signed(value: float, factor: float, unit: str, sign: str = "+", digits: int = 4) -> str:
    """A deviation in a unit of `drawn_in`: "+0.4831°", "−0.8014 mm"; sign: "" for a plus that is not written."""
    text = format(value * factor + 0.0, f"{sign}.{digits}g").replace("-", "−")
    return f"{text}{'' if unit in ('°', '') else ' '}{unit}"


def between(low: float, high: float, unit: str) -> str:
    """Two ends of one quantity with a common unit, in as many digits as it takes to tell them apart:
    "between −10.6059 and −10.6055 kN m"."""
    size, width = max(abs(low), abs(high)), abs(high - low)
    digits = 4 if not 0 < width < size else min(max(4, 2 + math.ceil(math.log10(size / width))), 9)
    factor, unit_shown = prefixed(size, unit)
    ends = [parts(end * factor, "", digits)[0] for end in (low, high)]
    return f"between {ends[0]} and {ends[1]}{'' if unit_shown in ('°', '') else ' '}{unit_shown}"


SUPERSCRIPT = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
