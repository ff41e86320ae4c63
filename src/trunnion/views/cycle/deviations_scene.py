"""The part of a scene that shows errors: what the browser needs to draw a mechanism with its errors magnified.

A link with errors is drawn at its ideal pose and M times the difference. In the plane the points and angles of the
links have their errors; in space a link is moved by the mean of the errors of its points and turned by its error of
orientation, and what is left, an error of its own dimensions, stretches it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trunnion.results.quantities import prefixed
from trunnion.views.common.cycle import Array, abscissa, column, names, numbers
from trunnion.views.cycle.deviations import (
    JUMP,
    Seats,
    continued,
    jumps,
    outputs,
    point_errors,
    seated,
    worst_points,
)
from trunnion.views.space.bodies import Space, gathered, is_spatial

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["built"]

DIGITS = 5
FAR, LEANT = 0.06, 0.2  # what is offered: the largest error of place as this share of the size, or of angle, rad
FACTORS = (1.0, 2.0, 5.0)
MOST = 1000.0
SLIGHT = 1e-3  # a stretch of less than this share of the largest error of place is not told


def built(result: xr.Dataset, lost: list[int]) -> dict[str, Any] | None:
    """Errors and seats for the browser; None of a result without errors. lost: positions without contact."""
    if "point_error" not in result:
        return None
    spatial = is_spatial(result)
    shown = gathered(result) if spatial else None
    return {
        "preset": _preset(result, shown.size if shown else _size(result)),
        "points": {} if spatial else _points(result),
        "links": _moved(result, shown) if shown else _turned(result),
        "worst": [{"label": key, "values": _series(values)} for key, values in worst_points(result).items()],
        "outputs": _outputs(result),
        "lost": lost,
        "seats": [_seat(one) for one in seated(result)],
        "angles": _angles(result, np.array(lost, np.intp)),
    }


def _series(values: Array) -> list[float | None]:
    """Five digits of a series; one number if it never changes."""
    rounded = [None if one is None else float(f"{one:.{DIGITS}g}") for one in numbers(values)]
    return rounded[:1] if rounded and all(one == rounded[0] for one in rounded) else rounded


def _vector(values: Array) -> dict[str, list[float | None]]:
    return {axis: _series(part) for axis, part in zip("xyz", values, strict=False)}


def _size(result: xr.Dataset) -> float:
    """Diagonal of the box around all points of a mechanism in the plane, m."""
    places = np.asarray(result["point_position"].transpose("axis", ...).values, dtype=float).reshape(2, -1)
    known = places[:, np.isfinite(places).all(axis=0)]
    return float(np.linalg.norm(np.ptp(known, axis=1))) if known.size else 0.0


def _preset(result: xr.Dataset, size: float) -> float:
    """A round magnification at which the errors are well seen and the links are still where one looks for them."""
    far = max((float(np.nanmax(one)) for one in point_errors(result).values()), default=0.0)
    turned = float(np.nanmax(np.abs(result["link_error"].values), initial=0.0))
    most = min(FAR * size / far if far else np.inf, LEANT / turned if turned else np.inf, MOST)
    if not most > 1:
        return 1.0
    base = 10.0 ** np.floor(np.log10(most))
    return float(max(one * base for one in FACTORS if one * base <= most * (1 + 1e-9)))


# ---- the plane ------------------------------------------------------------------------------------------------


def _points(result: xr.Dataset) -> dict[str, Any]:
    found = {key: column(result, "point_error", point=key) for key in names(result, "point")}
    return {key: _vector(error) for key, error in found.items() if error is not None}


def _turned(result: xr.Dataset) -> dict[str, Any]:
    found = {link: column(result, "link_error", link=link) for link in names(result, "link")}
    return {link: _series(error) for link, error in found.items() if error is not None}


# ---- space ----------------------------------------------------------------------------------------------------


def _moved(result: xr.Dataset, shown: Space) -> dict[str, Any]:
    """Of each link the mean error of its points, its rotation vector, the middle of the points, and its stretch."""
    found = {}
    for link, pose in shown.poses.items():
        turn = column(result, "link_error", link=link) if link in names(result, "link") else None
        if turn is None or not shown.drawable.any():
            continue
        own = {key: error for key in names(result, "point") if key.split(".", 1)[0] == link
               and (error := column(result, "point_error", point=key)) is not None}  # fmt: skip
        places = {key: _local(result, key, pose.matrix, pose.origin) for key in own}
        if not own:
            continue
        about = np.mean(list(places.values()), axis=0)
        shift = np.mean(list(own.values()), axis=0)
        found[link] = {
            "about": [float(f"{one:.7g}") for one in about], "shift": _vector(shift), "turn": _vector(turn),
            "stretch": _stretch(shown, link, own, places, about, shift, turn),
        }  # fmt: skip
    return found


def _local(result: xr.Dataset, key: str, matrix: Array, origin: Array) -> Array:
    """A point in the frame of its link, the mean over the positions that are known."""
    place = column(result, "point_position", point=key)
    assert place is not None
    return np.asarray(np.nanmean(np.einsum("jin,jn->in", matrix, place - origin), axis=1))


def _stretch(
    shown: Space, link: str, own: dict[str, Array], places: dict[str, Array], about: Array, shift: Array, turn: Array
) -> list[dict[str, Any]]:
    """By how much each point of a link lies elsewhere in it than in the ideal one, with where it is drawn."""
    matrix = shown.poses[link].matrix
    largest = max(float(np.nanmax(np.abs(error), initial=0.0)) for error in own.values())
    rows = []
    for key, error in own.items():
        arm = np.einsum("ijn,j->in", matrix, places[key] - about)
        left = error - shift - np.cross(turn, arm, axis=0)
        by = np.nan_to_num(np.nanmedian(np.einsum("jin,jn->in", matrix, left), axis=1))
        rows.append(
            {"at": _drawn(shown, link, key.split(".", 1)[1], places[key]), "by": [float(f"{n:.5g}") for n in by]}
        )
    return rows if max(np.abs(row["by"]).max() for row in rows) > SLIGHT * largest else []


def _drawn(shown: Space, link: str, point: str, place: Array) -> list[float]:
    """Where a point of a link is drawn: that of a joint where its symbol is."""
    joint = shown.joints.get(point)
    at = shown.seat(point, joint["links"].index(link)) if joint and link in joint["links"] else place
    return [float(f"{one:.7g}") for one in at]


# ---- charts ---------------------------------------------------------------------------------------------------


def _outputs(result: xr.Dataset) -> list[dict[str, Any]]:
    """Transmission errors, m or °; the band of the worst case of the play if the result has it."""
    rows = []
    for one in outputs(result):
        centre, reach = (column(result, f"transmission_{name}", joint=one.joint) for name in ("centre", "reach"))
        band = [] if centre is None or reach is None else [centre - reach, centre + reach]
        factor, unit = prefixed(1.0, "rad") if one.unit == "rad" else (1.0, "m")
        worst = {side: _series(edge * factor) for side, edge in zip(("low", "high"), band, strict=False)}
        rows.append({"label": one.label, "unit": unit, "values": _series(one.error * factor), "worst": worst or None})
    return rows


def _seat(one: Seats) -> dict[str, Any]:
    return {
        "joint": one.joint, "kind": one.kind, "clearance": one.clearance, "length": one.length, "links": one.links,
        "ends": [{"offset": _vector(offset), "force": _vector(force)}
                 for offset, force in zip(one.offsets, one.forces, strict=True)],
    }  # fmt: skip


def _angles(result: xr.Dataset, lost: NDArray[np.intp]) -> list[dict[str, Any]]:
    """β and ξ of the pins, °, with the positions before which they jump; offsets of the guides of the plane."""
    closed = abscissa(result).closed
    rows = []
    for one in seated(result):
        both = [column(result, f"seat_{name}", joint=one.joint) for name in ("beta", "xi")]
        if one.planar_guide or both[0] is None or both[1] is None or not np.isfinite(both[0]).any():
            continue
        for sign, values in zip("βξ", np.degrees(continued(both[0], both[1])), strict=True):
            if sign == "ξ" or len(one.offsets) == 2:
                round_ = np.append(values, values[0]) if closed else values
                cuts = [int(index) % values.size for index in jumps(round_, float(np.degrees(JUMP)), lost)]
                rows.append({"sign": sign, "joint": one.joint, "values": _series(values), "breaks": cuts})
    return rows
