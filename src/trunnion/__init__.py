"""Trunnion: the analysis of linkages as built. See `read`, `analyse`, `Mechanism`.

Names are loaded when first used, so that importing the package costs nothing.
"""

from __future__ import annotations

from trunnion.version import __version__ as __version__

TYPE_CHECKING = False  # as a type checker takes it for True; `typing` itself is not needed to start


if TYPE_CHECKING:
    from typing import Any

    from trunnion import dual
    from trunnion.cycle.analyse import analyse
    from trunnion.cycle.inspect import Check, check
    from trunnion.cycle.locking import locking
    from trunnion.cycle.vocabulary import vocabulary
    from trunnion.errors import Finding, MechanismError, Status
    from trunnion.model.mechanism import Mechanism
    from trunnion.model.mechanism import read_mechanism as read
    from trunnion.results.export import save
    from trunnion.rig.compare.study import compare
    from trunnion.rig.identify import identify
    from trunnion.rig.reading.read import read_measured
    from trunnion.rig.virtual.observe import observe
    from trunnion.solve.friction_method import FrictionMethod
    from trunnion.solve.run import prepare
    from trunnion.studies.allocation.allocate import allocate
    from trunnion.studies.assembly.study import assemble
    from trunnion.studies.play.study import play
    from trunnion.studies.sweep.study import sweep
    from trunnion.studies.tolerance.study import tolerance
    from trunnion.views.cycle.report import report

_PLACES = {
    "FrictionMethod": "trunnion.solve.friction_method",
    "Finding": "trunnion.errors",
    "Mechanism": "trunnion.model.mechanism",
    "MechanismError": "trunnion.errors",
    "Status": "trunnion.errors",
    "Check": "trunnion.cycle.inspect",
    "allocate": "trunnion.studies.allocation.allocate",
    "analyse": "trunnion.cycle.analyse",
    "assemble": "trunnion.studies.assembly.study",
    "check": "trunnion.cycle.inspect",
    "compare": "trunnion.rig.compare.study",
    "identify": "trunnion.rig.identify",
    "locking": "trunnion.cycle.locking",
    "observe": "trunnion.rig.virtual.observe",
    "play": "trunnion.studies.play.study",
    "prepare": "trunnion.solve.run",
    "read": "trunnion.model.mechanism",
    "read_measured": "trunnion.rig.reading.read",
    "report": "trunnion.views.cycle.report",
    "save": "trunnion.results.export",
    "sweep": "trunnion.studies.sweep.study",
    "tolerance": "trunnion.studies.tolerance.study",
    "vocabulary": "trunnion.cycle.vocabulary",
}
_RESULTS = {"analyse", "assemble", "allocate", "compare", "identify", "locking", "play", "sweep", "tolerance"}
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
    "vocabulary",
]


def __getattr__(name: str) -> Any:
    """Load a public name from where it lives."""
    from importlib import import_module

    if name in _MODULES:
        return import_module(_MODULES[name])
    if name not in _PLACES:
        raise AttributeError(f"module 'trunnion' has no attribute '{name}'")
    if name in _RESULTS:
        import_module("trunnion.accessor")  # result.trunnion
    return getattr(import_module(_PLACES[name]), _ELSEWHERE.get(name, name))


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
