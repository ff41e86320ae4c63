"""Tables of a comparison: results, efficiency, conditions, sensors, files; every cell a text."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from trunnion.results.attributes import attribute
from trunnion.results.quantities import number, prefixed
from trunnion.rig.comparison import CAUSES
from trunnion.rig.judge import Verdict
from trunnion.views.common.cycle import Array, names
from trunnion.views.compare.comparison import coverage_of, scale_of, sets, setting, text, units, verdict
from trunnion.views.rig.conditions import shortened
from trunnion.views.table import Table

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["conditions", "efficiencies", "explained", "files", "headline", "results", "sensors", "verdicts"]

NONE = "—"


def results(result: xr.Dataset, channel: int | None = None) -> Table:
    """Residual and verdict of every channel in every condition, or of one channel."""
    wanted = range(result.sizes["channel"]) if channel is None else [channel]
    what, told = shortened(names(result, "condition"))
    rows = []
    for k, name in enumerate(told):
        for i in wanted:
            if int(result["turns"].values[i, k]) == 0:
                continue
            head = [name] if channel is not None else [name, names(result, "channel")[i]]
            rows.append([*head, *_figures(result, i, k)])
    first = [what] if channel is not None else [what, "channel"]
    head = ["RMS", "largest", "at", "bias", "within ±U", "required", "correlation", "verdict"]
    return Table("results", [*first, *head], rows)


def explained(result: xr.Dataset, channel: int | None = None) -> Table | None:
    """What would explain each residual beyond U: size and share, of all channels or of one; None if there is none."""
    what, told = shortened(names(result, "condition"))
    rows = []
    for k, name in enumerate(told):
        for i in range(result.sizes["channel"]) if channel is None else [channel]:
            cells = [_cause(result, kind, i, k) for kind in CAUSES]
            if any(cell != NONE for cell in cells):
                rows.append([name, *([] if channel is not None else [names(result, "channel")[i]]), *cells])
    head = [what, *([] if channel is not None else ["channel"]), *CAUSES]
    return Table("what would explain the residual, each by itself", head, rows) if rows else None


def _cause(result: xr.Dataset, kind: str, i: int, k: int) -> str:
    """An error that would explain a residual, with the share that it explains."""
    size, share = (float(result[f"{kind}_{what}"].values[i, k]) for what in ("error", "explains"))
    if not np.isfinite(size):
        return NONE
    factor, unit = {"zero": scale_of(result, i, k), "angle": (180 / math.pi, "°")}.get(kind, (100.0, "%"))
    sign = "+" * (size > 0)
    return f"{sign}{text(size * factor, unit)} ({100 * share:.1f}\u00a0%)"


def verdicts(result: xr.Dataset) -> Table:
    """The verdict of every channel in every condition."""
    channels = names(result, "channel")
    what, told = shortened(names(result, "condition"))
    rows = []
    for k, name in enumerate(told):
        cells = [verdict(result, i, k).text if result["turns"].values[i, k] else NONE for i in range(len(channels))]
        rows.append([name, *cells])
    return Table("verdicts", [what, *channels], rows)


def _figures(result: xr.Dataset, i: int, k: int) -> list[str]:
    factor, unit = scale_of(result, i, k)

    def of(name: str) -> float:
        return float(result[name].values[i, k])

    def sized(value: float) -> str:
        return text(value * factor, unit) if np.isfinite(value) else NONE

    bias, wide = of("bias"), of("bias_expanded")
    told = sized(bias)
    if np.isfinite(bias) and np.isfinite(wide):
        told = _beside(bias * factor, wide * factor, unit)
    alike = of("correlation")
    return [
        sized(of("rms")),
        sized(of("largest")),
        place(result, of("largest_at")),
        told,
        _share(of("within")),
        _share(of("within_least")),
        f"{alike:.4f}".replace("-", "−") if np.isfinite(alike) else NONE,
        verdict(result, i, k).text,
    ]


def _beside(value: float, wide: float, unit: str) -> str:
    """A value with its expanded uncertainty, to two digits of that (GUM 7.2.6)."""
    places = 1 - math.floor(math.log10(wide)) if wide > 0 else 3
    if not 0 <= places <= 6:
        return f"{number(value, 3)}\u00a0±\u00a0{text(wide, unit, 2)}"
    shown = round(value, places) + 0.0  # no negative zero
    digits = f"{shown:.{places}f}".replace("-", "−"), f"{wide:.{places}f}"
    return f"{digits[0]}\u00a0±\u00a0{digits[1]}\u00a0{unit}".rstrip().replace(" ", "\u00a0")


def place(result: xr.Dataset, value: float) -> str:
    """A place of the drive in words."""
    if not np.isfinite(value):
        return NONE
    factor, shown = prefixed(value, str(result.attrs["drive_unit"]))
    return setting(value * factor, shown)


def _share(value: float) -> str:
    return f"{100 * value:.1f}\u00a0%" if np.isfinite(value) else NONE


def efficiencies(result: xr.Dataset) -> Table | None:
    """Measured efficiency with U beside the model's; None if it was not measured."""
    if "efficiency" not in result:
        return None
    words = {1: "within", 0: "not within", -1: "unknown"}
    what, told = shortened(names(result, "condition"))
    rows = []
    for k, name in enumerate(told):
        measured, wide, model = (
            float(result[one].values[k]) for one in ("efficiency", "efficiency_expanded", "efficiency_model")
        )
        within = words[int(result["efficiency_within"].values[k])]
        rows.append([name, *(_plain(value) for value in (measured, wide, model, measured - model)), within])
    head = [what, "η measured", f"U ({coverage_of(result)})", "η model", "difference", "model within ±U"]
    return Table("efficiency", head, rows)


def _plain(value: float) -> str:
    return f"{value:.4f}".replace("-", "−") if np.isfinite(value) else NONE


def conditions(result: xr.Dataset) -> Table:
    """What was set in every condition, in how many turns it was measured, and where the data are."""
    told, held = sets(result), attribute(result, "condition_files")
    rows = []
    for k, name in enumerate(names(result, "condition")):
        values = [setting(one.values[k], one.unit) if np.isfinite(one.values[k]) else NONE for one in told]
        turns = result["turns"].values[:, k]
        low, high = int(turns.min()), int(turns.max())
        kept = [file.replace("\\", "/").rsplit("/", 1)[-1] for file in held[k]] if held else []
        rows.append([name, *values, str(high) if low == high else f"{low} to {high}", ", ".join(kept) or NONE])
    return Table("conditions", ["condition", *(one.name for one in told), "turns", "file"], rows)


def sensors(result: xr.Dataset) -> Table:
    """What each channel measures, with the standard uncertainties of its zero and gain."""
    measures, held = attribute(result, "channel_measures"), attribute(result, "channel_read_in")
    rows = []
    for i, (name, own) in enumerate(zip(names(result, "channel"), units(result), strict=True)):
        read, size = held[i] if held else ("", 1.0)
        unit = read or own
        zero, gain = (_spread(result[f"accuracy_{what}"].values[i]) for what in ("zero", "gain"))
        zeros = " to ".join(dict.fromkeys(_small(one, own, read, size) if one else "0" for one in zero)) or NONE
        gains = " to ".join(dict.fromkeys(f"{number(100 * one, 3)}\u00a0%" if one else "0" for one in gain)) or NONE
        rows.append([name, measures[i], "" if unit == "1" else unit, zeros, gains])
    return Table("sensors", ["channel", "measures", "unit", "u of the zero", "u of the gain"], rows)


def _small(value: float, unit: str, read: str, size: float) -> str:
    factor, shown = (1 / size, read) if read and size != 1 else prefixed(value, unit)
    return text(value * factor, shown)


def _spread(values: Array) -> list[float]:
    known = values[np.isfinite(values)]
    return [float(known.min()), float(known.max())] if known.size else []


def files(result: xr.Dataset, key: str = "files") -> Table | None:
    """The files of the data with their size and hash; None if none is known. key: of the attribute that has them."""
    held = attribute(result, key)
    rows = [
        [
            row["file"],
            f"{row['bytes']:,}".replace(",", "\u202f") if row["bytes"] is not None else NONE,
            row["sha256"] or NONE,
        ]
        for row in held
    ]
    return Table("files", ["file", "bytes", "SHA-256"], rows) if rows else None


def headline(result: xr.Dataset) -> list[tuple[str, list[tuple[str, str]]]]:
    """The figures at the head: how many courses are within, and how far the efficiencies are apart."""
    codes = result["verdict"].values[result["turns"].values > 0]
    total = len(codes)
    count = int(np.count_nonzero(codes == Verdict.WITHIN))
    rows: list[tuple[str, list[tuple[str, str]]]] = [
        ("signals within ±U", [(f"{count} of {total}", f"channels in conditions, {coverage_of(result)} coverage")])
    ]
    if "efficiency" in result:
        within = result["efficiency_within"].values
        known = int(np.count_nonzero(within >= 0))
        gap = np.abs(result["efficiency"].values - result["efficiency_model"].values)
        most = float(np.nanmax(gap)) if np.isfinite(gap).any() else float("nan")
        rows.append(("efficiencies within ±U", [(f"{int(np.count_nonzero(within == 1))} of {known}", "conditions")]))
        if np.isfinite(most):
            rows.append(("largest difference of efficiency", [(number(most, 3), "measured minus model, magnitude")]))
    return rows
