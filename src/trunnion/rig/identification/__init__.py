"""Numbers of the model from measurements: estimates, how far they may be off, and what the data cannot tell."""

from trunnion.rig.identification.identify import identify, with_estimates

__all__ = ["identify", "with_estimates"]
