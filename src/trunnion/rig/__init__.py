"""Measured data: a virtual test rig, the reading of data, model beside measurement, identification.

`observe` puts sensors to a model, `read` reads a measurement, `compare` sets the model beside it, `identify` finds
numbers of the model from it. Names are loaded when first used.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as in `trunnion`

if TYPE_CHECKING:
    from typing import Any

    from trunnion.rig.comparison import compare as compare
    from trunnion.rig.identification.run import identify as identify
    from trunnion.rig.reading.measurement import Measurement as Measurement
    from trunnion.rig.reading.read import read_measured as read
    from trunnion.rig.virtual.observe import Observation as Observation
    from trunnion.rig.virtual.observe import observe as observe

_PLACES = {
    "Measurement": ("trunnion.rig.reading.measurement", "Measurement"),
    "Observation": ("trunnion.rig.virtual.observe", "Observation"),
    "compare": ("trunnion.rig.comparison", "compare"),
    "identify": ("trunnion.rig.identification.run", "identify"),
    "observe": ("trunnion.rig.virtual.observe", "observe"),
    "read": ("trunnion.rig.reading.read", "read_measured"),
}

__all__ = ["Measurement", "Observation", "compare", "identify", "observe", "read"]


def __getattr__(name: str) -> Any:
    """Load a public name from where it lives."""
    from importlib import import_module

    if name not in _PLACES:
        raise AttributeError(f"module 'trunnion.rig' has no attribute '{name}'")
    if name in ("compare", "identify"):
        import_module("trunnion.accessor")  # result.trunnion
    module, attribute = _PLACES[name]
    return getattr(import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted(__all__)
