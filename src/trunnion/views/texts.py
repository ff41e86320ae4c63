"""Numbers as the views of studies write them: fixed decimals, limits as on a drawing, shares with their interval."""

from __future__ import annotations

import math

from trunnion.results.quantities import decimals_of, drawn_in, joined, number

__all__ = ["ending", "fixed", "is_play", "limits_in", "limits_text", "rounded", "share", "share_interval",
           "share_parts", "signed_limit", "value_text"]  # fmt: skip


def fixed(value: float, decimals: int) -> str:
    """A number with so many decimals, thin spaces between thousands, a true minus, and no minus before a 0."""
    if not math.isfinite(value):
        return number(value)
    text = f"{value:,.{decimals}f}"
    return text.replace(",", "\u202f").replace("-", "−" if float(text.replace(",", "")) else "")


def rounded(value: float, digits: int = 6) -> str:
    """A number with at most so many significant digits, a true minus and a sign for what has no end."""
    return f"{value + 0.0:.{digits}g}".replace("inf", "∞").replace("-", "−")


def signed_limit(value: float) -> str:
    """One limit of a deviation: "+0.02", "−0.01", "0", and "—" where there is none."""
    if math.isinf(value):
        return "—"
    return f"+{rounded(value)}" if value > 0 else rounded(value)


def limits_text(lower: float, upper: float) -> str:
    """Limits of a deviation as a drawing has them: "±0.05", "+0.02/−0.01"."""
    return f"±{rounded(upper)}" if lower == -upper else f"{signed_limit(upper)}/{signed_limit(lower)}"


def limits_in(lower: float, upper: float, unit: str, path: str) -> str:
    """Limits of a toleranced number with their unit; of a play how far its pin may be from the middle."""
    if math.isnan(lower) or math.isnan(upper):
        return ""
    factor, shown = drawn_in(max(abs(lower), abs(upper)), unit)
    within = f"within\u00a0{rounded(upper * factor)}"
    text = within if is_play(path) else limits_text(lower * factor, upper * factor)
    return joined(text, shown.replace(" ", "\u00a0"))


def is_play(path: str) -> bool:
    """Whether a parameter is the play of a joint: how far its pin may be from the middle, to any side."""
    return path.startswith("joints.") and path.endswith(".clearance") and path.count(".") == 2


def value_text(value: float, unit: str, digits: int = 8) -> str:
    """A toleranced number with its unit, lengths in mm, with all digits that a drawing would show."""
    if not math.isfinite(value):
        return "—"
    factor, shown = drawn_in(abs(value), unit)
    return joined(rounded(value * factor, digits), shown.replace(" ", "\u00a0"))


def ending(name: str, most: int) -> str:
    """A name of so many characters: the end of a longer one, by which those of one folder differ."""
    return name if len(name) <= most else f"…{name[1 - most :]}"


def share(value: float, decimals: int | None = None) -> str:
    """A share in per cent, near 1 with the digits that tell how near: "99.62 %", "99.998 %", "−3.1 %"."""
    if math.isnan(value):
        return "—"
    if decimals is None:
        decimals = decimals_of(min(value, 1 - value))
    return f"{fixed(100 * value, 0 if value in (0.0, 1.0) else decimals)}\u00a0%"


def share_interval(value: float, low: float, high: float) -> str:
    """A share with its interval: "99.62 % (99.41 to 99.76 %)"."""
    text, ends, _ = share_parts(value, low, high)
    return f"{text} ({ends})" if ends else text


def share_parts(value: float, low: float, high: float) -> tuple[str, str, int | None]:
    """A share, its interval ("" if there is none), and the decimals of a per cent that the interval bears."""
    if math.isnan(low) or math.isnan(high):
        return share(value), "", None
    decimals = decimals_of(high - low)
    least = share(low, decimals).removesuffix("\u00a0%")
    return share(value, decimals), f"{least} to {share(high, decimals)}", decimals
