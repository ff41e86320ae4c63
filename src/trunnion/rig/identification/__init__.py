"""Numbers of the model from measurements: estimates, how far they may be off, and what the data cannot tell."""

from trunnion.rig.identification.result import with_estimates
from trunnion.rig.identification.run import identify

__all__ = ["identify", "with_estimates"]
