"""What a notebook shows of mechanisms and results: axes, tables, drawings."""

from __future__ import annotations

import re
from html import unescape
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from matplotlib import pyplot

import trunnion
from trunnion.views import notebook
from trunnion.views.page import hashed

EXAMPLES = Path(__file__).parents[2] / "examples"
STEPS = 12


def example(name: str) -> trunnion.Mechanism:
    return trunnion.read(EXAMPLES / f"{name}.yaml")


@pytest.fixture
def four_bar() -> xr.Dataset:
    return trunnion.analyse(example("durango-fourbar"), STEPS)


@pytest.mark.parametrize(
    ("name", "label"),
    [("durango-fourbar", "angle of A [°]"), ("five-bar-robot", "time [s]"), ("swash-plate-pump", "angle of shaft [°]")],
)
def test_a_plot_of_xarray_is_drawn_over_the_drive(name: str, label: str) -> None:
    result = trunnion.analyse(example(name), STEPS)
    (line,) = result["drive_effort"].isel(driver=0).plot()
    try:
        assert line.axes.get_xlabel() == label
        assert np.array_equal(line.get_xdata(), result["drive"])
        assert "drive effort" in line.axes.get_ylabel()
    finally:
        pyplot.close(line.figure)


@pytest.mark.parametrize(
    "made",
    [
        lambda: trunnion.analyse(example("durango-fourbar"), STEPS),
        lambda: trunnion.locking(example("durango-fourbar"), STEPS),
        lambda: trunnion.play(example("fourbar-with-play"), steps=STEPS),
        lambda: trunnion.assemble(example("misaligned-fourbar"), STEPS),
        lambda: trunnion.tolerance(example("toleranced-fourbar"), methods=("linear",), steps=STEPS, jobs=1),
    ],
)
def test_positions_bear_the_drive_as_coordinate(made: object) -> None:
    result = made()  # type: ignore[operator]
    assert np.allclose(result["drive"], 30.0 * np.arange(STEPS) + float(result["drive"][0]))
    assert np.array_equal(result["position"], result["drive"])
    assert result["position"].attrs["units"] == "°"
    assert "position" not in result.indexes


def test_results_are_combined_position_by_position(four_bar: xr.Dataset) -> None:
    """Not by angles, which may differ in their last digit."""
    place = four_bar["position"].variable.copy(data=four_bar["position"].values + 1e-9)
    other = four_bar.assign_coords(xr.Coordinates({"position": place}, indexes={}))
    assert (four_bar["drive_effort"] - other["drive_effort"]).sizes["position"] == STEPS


class Read(HTMLParser):
    """Text and elements of a page; every element that is opened must be closed."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.elements: list[str] = []
        self.words = ""
        self.feed(page)
        assert not self.open

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.elements.append(tag)
        if tag not in ("meta", "link", "br"):
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: Any) -> None:
        self.elements.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words += data


@pytest.mark.sample(6)
@pytest.mark.spread(3, "misaligned-fourbar")
@pytest.mark.parametrize("name", sorted(path.stem for path in EXAMPLES.glob("*.yaml")))
def test_every_example_is_shown(name: str) -> None:
    mechanism = example(name)
    shown = Read(mechanism._repr_html_())
    known = trunnion.check(mechanism, notebook.LOOKED_AT)
    assert known.formula in shown.words
    assert f"mobility {known.mobility}" in shown.words
    assert all(one.what in shown.words for one in known.findings[: notebook.MOST_FINDINGS])
    assert ("svg" in shown.elements) == (name not in ("misaligned-fourbar", "misaligned-hinges"))
    assert "script" not in shown.elements


@pytest.mark.parametrize(
    "changed",
    [
        {"dimensions": {"AB": "12 m", "BC": "0.1 m"}},  # no position goes together
        {"drivers": {}},  # the structure does not determine the motion
    ],
)
def test_a_mechanism_that_cannot_be_drawn_shows_why(changed: dict[str, Any]) -> None:
    data = example("durango-fourbar").data()
    for section, entries in changed.items():
        data[section] = {**data[section], **entries} if entries else {}
    shown = Read(trunnion.Mechanism(**data)._repr_html_())
    assert "svg" not in shown.elements
    assert "error" in shown.words


def test_names_become_no_markup(four_bar: xr.Dataset) -> None:
    data = {**example("durango-fourbar").data(), "name": "<script>alert(1)</script>"}
    odd = trunnion.Mechanism(**data)
    for page in (odd._repr_html_(), trunnion.analyse(odd, 2).trunnion._repr_html_()):
        shown = Read(page)
        assert "script" not in shown.elements
        assert "<script>alert(1)</script>" in shown.words


def test_a_mechanism_is_drawn_at_its_start() -> None:
    figure = example("durango-fourbar").plot()
    assert "0°" in figure.axes[0].get_title(loc="left")
    assert figure.axes[0].patches


@pytest.mark.parametrize(
    "made",
    [
        lambda: trunnion.analyse(example("durango-fourbar"), STEPS),
        lambda: trunnion.sweep(example("slider-crank"), {"r": ["50 mm", "51 mm"]}, STEPS),
        lambda: trunnion.play(example("fourbar-with-play"), steps=STEPS),
    ],
)
def test_a_result_shows_its_summary_and_findings(made: Any) -> None:
    result = made().trunnion
    shown = Read(result._repr_html_())
    assert result.kind in shown.words
    assert all(one.subject in shown.words and one.remark in shown.words for one in result.summary)
    assert all(one.what in shown.words for one in result.findings[: notebook.MOST_FINDINGS])


def test_an_animation_is_a_page_in_a_frame(four_bar: xr.Dataset, tmp_path: Path) -> None:
    moving = four_bar.trunnion.animate(height=500)
    frame = moving._repr_html_()
    assert Read(frame).elements == ["iframe"]
    assert 'height="500"' in frame
    assert 'sandbox="allow-scripts"' in frame
    page = unescape(re.search(r'srcdoc="([^"]*)"', frame)[1])  # type: ignore[index]
    assert page == moving.page
    script = re.search(r'<script type="module">(.*?)</script>', page, re.DOTALL)[1]  # type: ignore[index]
    assert f"script-src '{hashed(script)}'" in page
    assert not re.search(r"""(?:src|href)=["'](?!data:,)""", page)  # nothing is fetched
    assert moving.save(tmp_path / "motion.html").read_text(encoding="utf-8") == page


def test_what_does_not_move_is_not_animated() -> None:
    swept = trunnion.sweep(example("slider-crank"), {"r": ["50 mm", "51 mm"]}, STEPS)
    with pytest.raises(trunnion.MechanismError, match="animation"):
        swept.trunnion.animate()
