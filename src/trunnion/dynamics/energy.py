"""Energy of a mechanism in motion: of its masses in motion and in the field of gravity."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.solve.forward import Forward, Motion

__all__ = ["kinetic_energy", "potential_energy"]


def kinetic_energy(walk: Forward) -> Number:
    """T = ½ Σ (m v² + ωᵀ J ω), J.

    Worked out from the momenta, as the inertia loads of links that stand still and are accelerated at their velocities:
    so that a body is described once, by its inertia load.
    """
    algebra, system = walk.algebra, walk.system
    moved = {
        link: Motion(motion.frame, algebra.times(0.0, motion.twist), type(motion.acceleration)(*motion.twist))
        for link, motion in walk.motions.items()
    }
    still, energy = replace(walk, motions=moved), 0.0
    for link in system.mechanism.effective_links:
        if link == system.mechanism.fixed_link:
            continue
        mass, moment = walk.values[f"links.{link}.mass"], still.inertia_moment(link)
        centre = still.at(link, system.centre(walk.values, link))
        force = tuple(-mass * a for a in centre.acceleration)
        load = algebra.about(force, algebra.NO_MOMENT if moment is None else moment, centre.place)
        energy = energy - 0.5 * algebra.power(load, walk.motions[link].twist)
    return energy


def potential_energy(walk: Forward) -> Number:
    """−Σ m g·r, J: of gravity, against the origin of the ground."""
    system, energy = walk.system, 0.0
    gravity = system.vector(walk.values, "gravity")
    if not any(np.any(part) for part in gravity):
        return 0.0
    for link in system.mechanism.effective_links:
        if link != system.mechanism.fixed_link:
            place = walk.at(link, system.centre(walk.values, link)).place
            for g, coordinate in zip(gravity, place, strict=True):
                energy = energy - walk.values[f"links.{link}.mass"] * g * coordinate
    return energy
