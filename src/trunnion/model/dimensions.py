"""The named dimensions of a model: in which order they are evaluated, and their values."""

from __future__ import annotations

from collections.abc import Mapping
from graphlib import CycleError, TopologicalSorter

import numpy as np

from trunnion.algebra.namespace import Number
from trunnion.model.quantity import Quantity

__all__ = ["evaluation_order", "nominal_dimensions"]


def evaluation_order(
    dimensions: Mapping[str, Quantity], errors: Mapping[str, Quantity] | None = None
) -> tuple[list[str], list[list[str]]]:
    """Dimensions in an order in which each follows those it speaks of, and the circles that have none.

    errors: deviations of some of them, which may speak of dimensions too.
    """
    graph = {name: {one for one in quantity.names if one in dimensions} for name, quantity in dimensions.items()}
    for name, quantity in (errors or {}).items():
        graph[name] |= {one for one in quantity.names if one in dimensions}
    circles: list[list[str]] = []
    while True:
        try:
            return list(TopologicalSorter(graph).static_order()), circles
        except CycleError as error:
            circle = list(reversed(error.args[1]))[:-1]
            circles.append(circle)
            graph = {name: set() if name in circle else needs for name, needs in graph.items()}


def nominal_dimensions(dimensions: Mapping[str, Quantity]) -> dict[str, Number]:
    """The dimensions without errors; nan where one has no value."""
    order, circles = evaluation_order(dimensions)
    lost = {name for circle in circles for name in circle}
    names: dict[str, Number] = {}
    for name in order:
        quantity = dimensions[name]
        sound = name not in lost and set(quantity.names) <= names.keys()
        names[name] = quantity.evaluate(names) if sound else np.nan
    return names
