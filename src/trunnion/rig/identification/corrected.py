"""A mapping with the zero of the angle, or of a channel, that an identification has found to be off."""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from typing import TYPE_CHECKING, Any

import numpy as np

from trunnion.errors import Finding, MechanismError
from trunnion.model.quantity import Quantity
from trunnion.results.attributes import attribute, findings_of
from trunnion.rig.reading.mapping import DataMapping
from trunnion.rig.reading.units import Amount

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["corrected_mapping"]


def corrected_mapping(mapping: Mapping[str, Any], result: xr.Dataset) -> dict[str, Any]:
    """Put into a mapping the zero of the angle or of a channel that a result says is off.

    Parameters
    ----------
    mapping : entries of the mapping that was identified with.
    result : of `identify`, with the start of the first driver among its parameters, or with one error of the angle or
        of a zero that explains its misfit.

    Returns
    -------
    The entries with other zeros: identification with them finds none off.

    Raises
    ------
    MechanismError
        Where the result finds no such error, or the zero of the channel is that of an unloaded stretch.
    """
    entries = deepcopy(dict(mapping))
    path, paths = str(result.attrs["encoder"]), attribute(result, "parameter_paths")
    p = next((p for p, own in enumerate(paths) if path in own and result["told"].values[p]), None)
    causes = (one.figures for one in findings_of(result) if one.code == "fit.cause")
    cause: Mapping[str, Any] = next(causes, {"kind": ""})
    if p is not None:
        _turn(entries, float(result["estimate"].values[p]) - _model_start(result, path))
    elif cause["kind"] == "angle":
        _turn(entries, cause["size"])
    elif cause["kind"] == "zero":
        _shift(entries, cause["channel"], cause["size"])
    else:
        what = "no zero of the angle or of a channel explains a misfit: there is nothing to correct in the mapping"
        raise MechanismError(Finding(what, "mapping", "identify drivers.NAME.start for the zero of the angle"))
    return entries


def _model_start(result: xr.Dataset, path: str) -> float:
    """The coordinate of the first driver at the start of the cycle in the model, rad."""
    return next((float(row["value"]) for row in attribute(result, "inputs") if row["path"] == path), 0.0)


def _turn(entries: dict[str, Any], angle: float) -> None:
    """Another zero of the angle, rad, and of the files that state their own."""
    parts = [entries.get("angle"), *(file.get("angle") for file in entries.get("files", ()))]
    for part in (part for part in parts if isinstance(part, dict)):
        zero = float(Quantity.read(part.get("zero", 0)).evaluate()) + angle
        part["zero"] = f"{np.degrees(zero):.4f} deg"


def _shift(entries: dict[str, Any], name: str, size: float) -> None:
    """Another zero of a channel that reads too much by a size, SI."""
    channel, part = DataMapping.model_validate(entries).channels[name], entries["channels"][name]
    scale = channel.scale(channel.unit or "")
    own = any("zero" in file.get("channels", {}).get(name, {}) for file in entries.get("files", ()))
    if own or not isinstance(channel.zero, Amount):
        what = f"the zero of an unloaded stretch, or of single files, is off by {size:.4g} {scale.unit}"
        raise MechanismError(Finding(what, f"channels.{name}.zero", "check what loads the sensor there"))
    zero = scale.factor * scale.reading(channel.zero, "zero") + channel.sign * size
    part["zero"] = f"{zero:.6g} {scale.unit}"
