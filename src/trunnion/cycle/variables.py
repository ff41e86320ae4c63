"""What of the results differs in the plane and in space: labels, how walks are written into arrays, data to draw."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from trunnion.cycle import fill, fill_space, scene
from trunnion.solve.system import System

__all__ = ["FILLS", "Fill", "fill_of"]


@dataclass(frozen=True)
class Fill:
    """labels: of the dimensions; absent: variables that are zero; motion, forces: write a walk into the arrays; unwrap:
    makes angles run on; scene: for the drawings.
    """

    labels: Callable[..., dict[str, list[str]]]
    absent: Callable[..., list[str]]
    motion: Callable[..., None]
    forces: Callable[..., None]
    unwrap: Callable[..., None]
    scene: Callable[..., dict[str, Any]]


FILLS = {
    "planar": Fill(fill.labels, fill.absent, fill.fill_motion, fill.fill_forces, fill.unwrap, scene.planar),
    "spatial": Fill(
        fill_space.labels,
        fill_space.absent,
        fill_space.fill_motion,
        fill_space.fill_forces,
        fill_space.unwrap,
        scene.spatial,
    ),
}


def fill_of(system: System) -> Fill:
    """The row of a system."""
    return FILLS[system.mechanism.space]
