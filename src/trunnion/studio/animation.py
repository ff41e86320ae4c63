"""The mechanism going round as a GIF: links, names of the joints, what the loads do and the forces in the joints."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray
from PIL import Image

from trunnion.errors import Finding, MechanismError
from trunnion.results.quantities import quantity
from trunnion.views.common.cycle import column
from trunnion.views.common.drawing import Picture, picture, sketch
from trunnion.views.common.figures import INK, PALETTE
from trunnion.views.cycle.scene import scene
from trunnion.views.space.bodies import is_spatial

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.axes import Axes

__all__ = ["animation"]

Array = NDArray[np.float64]
IMAGES = 60
PACE = 50  # ms an image
SIZE, DOTS = 600, 100  # dots along the longer side, dots an inch
LONGEST, LOAD = 0.16, 0.09  # of the mechanism's size: the largest force of a joint, every load
ROOM = 0.14  # of the same around it


def animation(result: xr.Dataset) -> bytes:
    """A cycle of 60 pictures in 3 seconds; MechanismError in space and where nothing can be drawn."""
    if is_spatial(result):
        raise MechanismError(Finding("is not drawn as GIF in space", remedy="write the report, whose drawing moves"))
    shown, told = picture(result), scene(result, max_positions=result.sizes["position"])
    forces = _forces(result, shown)
    largest = max((float(np.nanmax(np.hypot(*one), initial=0.0)) for one in forces.values()), default=0.0)
    low_x, low_y, high_x, high_y = shown.box
    margin = ROOM * shown.size
    width, height = high_x - low_x + 2 * margin, high_y - low_y + 2 * margin
    scale, images = SIZE / max(width, height), list[Image.Image]()
    dots = max(int(scale * width), 2), max(int(scale * height), 2)
    figure = Figure((dots[0] / DOTS, dots[1] / DOTS), dpi=DOTS)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(low_x - margin, high_x + margin), ylim=(low_y - margin, high_y + margin), aspect="equal")
    axes.axis("off")
    steps = result.sizes["position"]
    for index in range(0, steps, -(-steps // IMAGES)):
        for artist in (*axes.lines, *axes.patches, *axes.texts, *axes.collections):  # new axes would take longer
            artist.remove()
        sketch(axes, shown, index)
        for order, (name, force) in enumerate(forces.items()):
            at = _place(shown, name, index)
            if largest > 0:
                _arrow(axes, at, force[:, index] * LONGEST * shown.size / largest, PALETTE[order % len(PALETTE)])
            slides = (
                shown.stated["joints"][name]["type"] == "prismatic"
            )  # pinned to its block, mostly, on the same spot
            _words(axes, at, name, (-13, 10) if slides else (9, 9), "bold")
        for load in told["loads"]:
            _load(axes, shown, load, index)
        drawn = io.BytesIO()
        figure.savefig(drawn, format="rgba", dpi=DOTS)
        images.append(Image.frombytes("RGBA", dots, drawn.getvalue()).quantize(64, Image.Quantize.FASTOCTREE))
    stream = io.BytesIO()
    images[0].save(stream, "GIF", save_all=True, append_images=images[1:], duration=PACE, loop=0)
    return stream.getvalue()


def _forces(result: xr.Dataset, shown: Picture) -> dict[str, Array]:
    """Force, N, on the second link of each joint over the cycle, (axis, position), a slide's friction included."""
    found = {}
    for name, joint in shown.stated["joints"].items():
        force = np.array([column(result, "reaction_force", joint=name, axis=axis) for axis in "xy"])
        friction = column(result, "friction_force", joint=name)
        if joint["type"] == "prismatic" and friction is not None:
            along = np.array([shown.axis(name, index) for index in range(force.shape[1])])
            force = force + friction * np.array([np.cos(along), np.sin(along)])
        found[name] = force
    return found


def _place(shown: Picture, joint: str, index: int) -> Array:
    first, second = shown.stated["joints"][joint]["links"]
    return shown.tracks[f"{second}.{joint}" if f"{second}.{joint}" in shown.tracks else f"{first}.{joint}"][:, index]


def _load(axes: Axes, shown: Picture, load: dict[str, Any], index: int) -> None:
    """A force at its point, or what resists a slide, with its size; moments are left out."""
    course = load.get("course") or {}

    def now(key: str, stated: Any) -> list[float]:
        parts = [one[index] for one in course[key]] if key in course else np.ravel(stated or 0.0).tolist()
        return [float(part or 0.0) for part in parts]

    joint = load.get("joint")
    if load["at"]:
        at, force = shown.tracks[load["at"]][:, index], np.array(now("force", load["force"]))
        if load["frame"] == "link":
            angle = shown.angles[load["link"]][index]
            force = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]) @ force
    elif joint and shown.stated["joints"][joint]["type"] == "prismatic":
        acts = load["acts"][index if len(load["acts"]) > 1 else 0] if load["acts"] else 0.0
        along, size = shown.axis(joint, index), now("resists", load.get("resists"))[0] * (acts or 0.0)
        at, force = _place(shown, joint, index), size * np.array([np.cos(along), np.sin(along)])
    else:
        return
    size = float(np.hypot(*force))
    if size > 0 and np.isfinite(at).all():
        tip = force / size * LOAD * shown.size
        _arrow(axes, at, tip, INK)
        _words(axes, at + tip, quantity(float(f"{size:.4g}"), "N"), (0, -9), "normal")


def _words(axes: Axes, at: Array, text: str, beside: tuple[float, float], weight: str) -> None:
    """Words beside a place, points."""
    if np.isfinite(at).all():
        axes.annotate(
            text, (at[0], at[1]), beside, textcoords="offset points", ha="center", va="center", zorder=30,
            fontsize=7.5, weight=weight, color=INK, path_effects=[withStroke(linewidth=2, foreground="white")],
        )  # fmt: skip


def _arrow(axes: Axes, at: Array, along: Array, colour: str) -> None:
    """An arrow from a place, m."""
    if np.isfinite([*at, *along]).all() and np.any(along):
        style = {"arrowstyle": "-|>,head_width=0.22,head_length=0.45", "color": colour, "linewidth": 1.4}
        ends = (at[0] + along[0], at[1] + along[1]), (at[0], at[1])
        axes.annotate("", *ends, arrowprops={**style, "shrinkA": 0, "shrinkB": 0}, zorder=29)
