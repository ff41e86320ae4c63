"""Numbers of the model from measurements: estimates, how far they may be off, and what the data cannot tell."""

from trunnion.rig.identification.result import corrected_mapping, with_estimates
from trunnion.rig.identification.run import identify

__all__ = ["corrected_mapping", "identify", "with_estimates"]
