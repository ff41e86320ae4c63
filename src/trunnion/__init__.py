"""Trunnion: the analysis of linkages as built. See `read`, `analyse`, `Mechanism`.

Names are loaded when first used, so that importing the package costs nothing.
"""

from __future__ import annotations

from trunnion.lazy import TYPE_CHECKING, loader
from trunnion.version import __version__ as __version__

if TYPE_CHECKING:
    from trunnion import dual as dual
    from trunnion import exchange, rig
    from trunnion.cycle.analyse import analyse
    from trunnion.cycle.inspect import check
    from trunnion.cycle.locking import locking
    from trunnion.dynamics.simulate import simulate
    from trunnion.errors import MechanismError, Status
    from trunnion.model.mechanism import Mechanism
    from trunnion.model.mechanism import read_mechanism as read
    from trunnion.results.save import save
    from trunnion.solve.friction_method import FrictionMethod
    from trunnion.studies.allocation.allocate import allocate
    from trunnion.studies.assembly import assemble
    from trunnion.studies.design import design
    from trunnion.studies.play import play
    from trunnion.studies.sweep import sweep
    from trunnion.studies.tolerance.study import tolerance
    from trunnion.views.shown import plot, report

# public name: module and the name there
_PLACES = {
    "FrictionMethod": ("trunnion.solve.friction_method", "FrictionMethod"),
    "Mechanism": ("trunnion.model.mechanism", "Mechanism"),
    "MechanismError": ("trunnion.errors", "MechanismError"),
    "Status": ("trunnion.errors", "Status"),
    "allocate": ("trunnion.studies.allocation.allocate", "allocate"),
    "analyse": ("trunnion.cycle.analyse", "analyse"),
    "assemble": ("trunnion.studies.assembly", "assemble"),
    "check": ("trunnion.cycle.inspect", "check"),
    "design": ("trunnion.studies.design", "design"),
    "dual": ("trunnion.dual", ""),
    "exchange": ("trunnion.exchange", ""),
    "locking": ("trunnion.cycle.locking", "locking"),
    "play": ("trunnion.studies.play", "play"),
    "plot": ("trunnion.views.shown", "plot"),
    "read": ("trunnion.model.mechanism", "read_mechanism"),
    "report": ("trunnion.views.shown", "report"),
    "rig": ("trunnion.rig", ""),
    "save": ("trunnion.results.save", "save"),
    "simulate": ("trunnion.dynamics.simulate", "simulate"),
    "sweep": ("trunnion.studies.sweep", "sweep"),
    "tolerance": ("trunnion.studies.tolerance.study", "tolerance"),
}
_RESULTS = {"analyse", "assemble", "allocate", "locking", "play", "simulate", "sweep", "tolerance"}

__all__ = [
    "FrictionMethod", "Mechanism", "MechanismError", "Status", "allocate", "analyse", "assemble", "check", "design",
    "exchange", "locking", "play", "plot", "read", "report", "rig", "save", "simulate", "sweep", "tolerance",
]  # fmt: skip

__getattr__ = loader("trunnion", _PLACES, _RESULTS)


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
