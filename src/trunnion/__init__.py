"""Trunnion: the analysis of linkages as built. See `read`, `analyse`, `Mechanism`.

Names are loaded when first used, so that importing the package costs nothing.
"""

from __future__ import annotations

TYPE_CHECKING = False  # as a type checker takes it for True; `typing` itself is not needed to start

__version__ = "0.1.0"

if TYPE_CHECKING:
    from typing import Any

    from trunnion import dual
    from trunnion.analysis.allocation.allocate import allocate
    from trunnion.analysis.analyse import analyse, prepare
    from trunnion.analysis.assemblability import assemble
    from trunnion.analysis.friction import FrictionMethod
    from trunnion.analysis.inspect import Check, check
    from trunnion.analysis.locking import locking
    from trunnion.analysis.play import play
    from trunnion.analysis.rig.compare import compare
    from trunnion.analysis.rig.identify import identify
    from trunnion.analysis.rig.virtual import observe
    from trunnion.analysis.sweep import sweep
    from trunnion.analysis.tolerance.study import tolerance
    from trunnion.errors import Finding, MechanismError, Status
    from trunnion.export import save
    from trunnion.measured.read import read_measured
    from trunnion.model.file import read_mechanism as read
    from trunnion.model.mechanism import Mechanism
    from trunnion.views.report import report

_PLACES = {
    "FrictionMethod": "trunnion.analysis.friction",
    "Finding": "trunnion.errors",
    "Mechanism": "trunnion.model.mechanism",
    "MechanismError": "trunnion.errors",
    "Status": "trunnion.errors",
    "Check": "trunnion.analysis.inspect",
    "allocate": "trunnion.analysis.allocation.allocate",
    "analyse": "trunnion.analysis.analyse",
    "assemble": "trunnion.analysis.assemblability",
    "check": "trunnion.analysis.inspect",
    "compare": "trunnion.analysis.rig.compare",
    "identify": "trunnion.analysis.rig.identify",
    "locking": "trunnion.analysis.locking",
    "observe": "trunnion.analysis.rig.virtual",
    "play": "trunnion.analysis.play",
    "prepare": "trunnion.analysis.analyse",
    "read": "trunnion.model.file",
    "read_measured": "trunnion.measured.read",
    "report": "trunnion.views.report",
    "save": "trunnion.export",
    "sweep": "trunnion.analysis.sweep",
    "tolerance": "trunnion.analysis.tolerance.study",
}
_ELSEWHERE = {"read": "read_mechanism"}
_MODULES = {"dual": "trunnion.dual"}

__all__ = [
    "Check",
    "Finding",
    "FrictionMethod",
    "Mechanism",
    "MechanismError",
    "Status",
    "allocate",
    "analyse",
    "assemble",
    "check",
    "compare",
    "dual",
    "identify",
    "locking",
    "observe",
    "play",
    "prepare",
    "read",
    "read_measured",
    "report",
    "save",
    "sweep",
    "tolerance",
]


def __getattr__(name: str) -> Any:
    """Load a public name from where it lives."""
    from importlib import import_module

    if name in _MODULES:
        return import_module(_MODULES[name])
    if name not in _PLACES:
        raise AttributeError(f"module 'trunnion' has no attribute '{name}'")
    return getattr(import_module(_PLACES[name]), _ELSEWHERE.get(name, name))


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
