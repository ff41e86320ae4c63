"""Names in a drawing keep off each other, off their joints and inside the figure."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

import trunnion
from trunnion.views.common.figures import Labels
from trunnion.views.cycle import plots

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def boxes(figure: Figure) -> dict[str, np.ndarray]:
    """The corners of every name, pixels."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    found = {}
    for axes in figure.axes:
        for text in axes.texts:
            if text.get_text() and text.get_fontweight() == "bold":
                extent = text.get_window_extent(canvas.get_renderer())
                found[text.get_text()] = np.array([extent.min, extent.max])
    return found


def meet(one: np.ndarray, other: np.ndarray) -> bool:
    return bool(np.all(one[0] < other[1]) and np.all(other[0] < one[1]))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["indexing-press", "rssr"])
def test_names_of_a_mechanism(name: str) -> None:
    figure = plots.mechanism(trunnion.analyse(trunnion.read(EXAMPLES / f"{name}.yaml"), 12))
    found = boxes(figure)
    assert len(found) >= 4
    assert not [pair for pair in combinations(found, 2) if meet(*(found[text] for text in pair))]
    size = figure.dpi * figure.get_size_inches()
    assert all(np.all(box[0] >= 0) and np.all(box[1] <= size) for box in found.values())


def sheet() -> tuple[Figure, mpl.axes.Axes]:
    figure = Figure(figsize=(4, 4), dpi=100)
    axes = figure.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, 1), ylim=(0, 1))
    axes.axis("off")
    return figure, axes


def test_names_that_would_meet_are_moved_apart() -> None:
    """Eight places within a few points of each other."""
    figure, axes = sheet()
    labels = Labels(figure)
    for k in range(8):
        labels.add(axes, f"name {k}", np.array([0.5 + 0.005 * k, 0.5]))
    labels.place()
    found = boxes(figure)
    assert len(found) == 8
    assert not [pair for pair in combinations(found, 2) if meet(*(found[text] for text in pair))]
