"""Contacts of joints in play in figures: gaps and forces over time, and the way of a pin in its hole."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.results.attributes import attribute
from trunnion.results.quantities import prefixed, quantity
from trunnion.views.common.cycle import Abscissa, names
from trunnion.views.common.figures import MUTED, PALETTE, along, curve, dress, legend, new, style_of
from trunnion.views.common.lettering import plain

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["OF_CONTACTS", "check_kind", "forces", "gaps", "in_play", "orbit", "pictures", "spectrum"]

OF_CONTACTS = ("contacts", "gaps", "orbit", "spectrum")  # kinds of figures that need a joint in play
LONGEST = 0.6  # of the clearance: how far the largest force is drawn beyond the wall
MOST_SPOKES = 240  # forces drawn around a hole
DEEPEST = 1e-4  # of the largest amplitude: the lowest that is drawn
RESOLVED = 4.0  # rows in a contact whose force is resolved
SIDE = 4.6  # of the figure of a hole, inches


def in_play(result: xr.Dataset) -> bool:
    """Whether a joint of the result is in play."""
    return "contact" in result.dims


def check_kind(kind: str, in_play: bool) -> None:
    """MechanismError for a figure of contacts where no joint is in play."""
    if kind in OF_CONTACTS and not in_play:
        remedy = "state a contact of a joint with play, such as contact: {restitution: 0.8, modulus: 210 GPa}"
        raise MechanismError(Finding("no joint of this motion is in play", f"--kind {kind}", remedy))


def refuse(result: xr.Dataset, kind: str) -> None:
    """MechanismError for a figure of contacts where there are none."""
    check_kind(kind, in_play(result))
    if kind == "orbit" and not _pins(result):
        raise MechanismError(Finding("no pin of this motion is in play", "--kind orbit", "use --kind gaps for guides"))

    if kind == "spectrum" and "frequency" not in result.dims:
        what = "no contact forces over time: bodies are rigid, or there are too few rows"
        raise MechanismError(Finding(what, "--kind spectrum", "state a contact law, or give more --steps"))


def pictures(result: xr.Dataset) -> Iterator[tuple[str, Figure]]:
    """What a report has beside the courses, with what it shows: the ways of pins in their holes, and the spectrum."""
    if in_play(result) and _pins(result):
        yield "The ways of the pins in their holes, with the forces on the walls", orbit(result)
    if "frequency" in result.dims:
        yield "Amplitude of the contact forces over frequency", spectrum(result)


def forces(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    """Normal forces over time."""
    values = result["contact_normal_force"].values
    factor, label = prefixed(float(np.nanmax(values, initial=0.0)), "N")
    along(axes, over, f"contact force [{label}]")
    for k, contact in enumerate(names(result, "contact")):
        curve(axes, over, values[k] * factor, contact, close=False, **style_of(k))


def gaps(axes: Axes, result: xr.Dataset, over: Abscissa) -> None:
    """Gaps over time; below 0 the surfaces press each other in."""
    values = result["contact_gap"].values
    factor, label = prefixed(float(np.nanmax(np.abs(values), initial=0.0)), "m")
    along(axes, over, f"gap [{label}]")
    for k, contact in enumerate(names(result, "contact")):
        curve(axes, over, values[k] * factor, contact, close=False, **style_of(k))


def spectrum(result: xr.Dataset) -> Figure:
    """Amplitude of the contact forces over frequency, both logarithmic."""
    made = new("Spectrum of the contact forces", result, height=4.3)
    axes, frequency = made.subplots(), result["frequency"].values[1:]
    amplitude = result["contact_force_amplitude"].values[:, 1:]
    largest = float(np.max(amplitude, initial=0.0))
    factor, label = prefixed(largest, "N")
    dress(axes, "frequency [Hz]", f"amplitude [{label}]")
    for k, contact in enumerate(names(result, "contact")):
        axes.plot(frequency, amplitude[k] * factor, label=plain(contact), linewidth=1.2, **style_of(k))
    axes.set_xscale("log")
    if largest > 0:
        axes.set_yscale("log")
        axes.set_ylim(DEEPEST * largest * factor, 2 * largest * factor)
    axes.set_title(f"Hann's window, {quantity(float(frequency[0]), 'Hz')} apart{_aliased(result)}", fontsize=9,
                   color=MUTED)  # fmt: skip
    legend(axes)
    return made


def _aliased(result: xr.Dataset) -> str:
    """A warning where contacts are shorter than a few rows."""
    lasts, step = result["impact_end"].values - result["impact_begin"].values, float(np.diff(result["time"][:2])[0])
    shortest = float(np.nanmin(lasts, initial=np.inf))
    if shortest >= RESOLVED * step:
        return ""
    return f"; contacts last {quantity(shortest, 's')} and rows are {quantity(step, 's')} apart: give more --steps"


def _pins(result: xr.Dataset) -> list[int]:
    """The contacts that are pins in holes: of a guide there are four to a joint."""
    joints = set(attribute(result, "contact_pins"))
    return [k for k, contact in enumerate(names(result, "contact")) if contact in joints]


def orbit(result: xr.Dataset) -> Figure:
    """The way of each pin's centre in its hole, in the hole's axes, with the force on the wall where it touches."""
    pins = _pins(result)
    made = new("Pin in its hole", result, height=0.7 + SIDE, width=0.4 + SIDE * len(pins))
    panels = made.subplots(1, len(pins), squeeze=False)[0]
    for axes, k in zip(panels, pins, strict=True):
        _hole(axes, result, k)
    return made


def _hole(axes: Any, result: xr.Dataset, k: int) -> None:
    x, y = result["contact_offset"].values[k][:2]
    gap, force = result["contact_gap"].values[k], result["contact_normal_force"].values[k]
    size = np.hypot(x, y)
    clearance = float(np.nanmedian(gap + size))
    factor, label = prefixed(clearance, "m")
    name = names(result, "contact")[k]
    dress(axes, f"along x of the hole [{label}]", f"along y [{label}]")
    turn = np.linspace(0, 2 * np.pi, 361)
    axes.plot(clearance * factor * np.cos(turn), clearance * factor * np.sin(turn), color=MUTED, linewidth=1.0)
    touching = np.flatnonzero(result["contact_touching"].values[k] == 1)
    largest = float(np.nanmax(force, initial=0.0))
    if largest > 0:
        for i in touching[:: max(1, len(touching) // MOST_SPOKES)]:
            out = np.array([1.0, 1.0 + LONGEST * force[i] / largest]) * clearance * factor / size[i]
            axes.plot(x[i] * out, y[i] * out, color=PALETTE[1], linewidth=1.0, alpha=0.6, zorder=1.5)
    axes.plot(x * factor, y * factor, color=PALETTE[0], linewidth=1.0, zorder=2.0)
    axes.plot(x[:1] * factor, y[:1] * factor, "o", color=PALETTE[0], markersize=4)
    unit, text = prefixed(largest, "N")
    axes.set_title(f"{plain(name)}: largest force {largest * unit:.4g} {text}", fontsize=9, color=MUTED)
    room = 1.08 * clearance * factor * (1 + LONGEST)
    axes.set_xlim(-room, room)
    axes.set_ylim(-room, room)
    axes.set_aspect("equal")
