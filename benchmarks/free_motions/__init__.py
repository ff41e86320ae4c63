"""Random mechanisms in free motion, beside SciPy on the equations of all their links: see `__main__`."""

from benchmarks.free_motions.planar import LIMIT, examine
from benchmarks.free_motions.spatial import LIMIT as SPATIAL_LIMIT
from benchmarks.free_motions.spatial import examine as examine_spatial

__all__ = ["LIMIT", "SPATIAL_LIMIT", "examine", "examine_spatial"]
