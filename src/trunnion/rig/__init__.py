"""Measured data: a virtual test rig, the reading of data, model beside measurement, identification.

`observe` puts sensors to a model, `read` reads a measurement, `compare` sets the model beside it, `identify` finds
numbers of the model from it. Names are loaded when first used.
"""

from __future__ import annotations

from trunnion.lazy import TYPE_CHECKING, loader

if TYPE_CHECKING:
    from trunnion.rig.comparison import compare as compare
    from trunnion.rig.identification.identify import identify as identify
    from trunnion.rig.reading.measurement import Measurement as Measurement
    from trunnion.rig.reading.read import read_measured as read
    from trunnion.rig.virtual.observe import Observation as Observation
    from trunnion.rig.virtual.observe import observe as observe

_PLACES = {
    "Measurement": ("trunnion.rig.reading.measurement", "Measurement"),
    "Observation": ("trunnion.rig.virtual.observe", "Observation"),
    "compare": ("trunnion.rig.comparison", "compare"),
    "identify": ("trunnion.rig.identification.identify", "identify"),
    "observe": ("trunnion.rig.virtual.observe", "observe"),
    "read": ("trunnion.rig.reading.read", "read_measured"),
}

__all__ = ["Measurement", "Observation", "compare", "identify", "observe", "read"]

__getattr__ = loader("trunnion.rig", _PLACES, ("compare", "identify"))


def __dir__() -> list[str]:
    return sorted(__all__)
