"""What a notebook shows of mechanisms and results: axes, tables, drawings."""

import re
from html import unescape

import numpy as np
import pytest
from matplotlib import pyplot
from test_report import Page

import trunnion
from mechanisms_parts import EXAMPLES, example
from trunnion.views import shown as notebook
from trunnion.views.page import hashed

STEPS = 12


@pytest.fixture
def four_bar():
    return trunnion.analyse(example("durango-fourbar"), STEPS)


@pytest.mark.spread(1)
@pytest.mark.parametrize(
    ("name", "label"),
    [("durango-fourbar", "angle of A [°]"), ("five-bar-robot", "time [s]"), ("swash-plate-pump", "angle of shaft [°]")],
)
def test_a_plot_of_xarray_is_drawn_over_the_drive(name, label):
    result = trunnion.analyse(example(name), STEPS)
    (line,) = result["drive_effort"].isel(driver=0).plot()
    try:
        assert line.axes.get_xlabel() == label
        assert np.array_equal(line.get_xdata(), result["drive"])
        assert "drive effort" in line.axes.get_ylabel()
    finally:
        pyplot.close(line.figure)


def read(page):
    """Elements and text of a page, of which every element that is opened is closed."""
    found = Page(page)
    assert not found.open
    return {tag for tag, _ in found.tags}, "".join(found.words)


@pytest.mark.spread(1)
@pytest.mark.sample(6)
@pytest.mark.parametrize("name", sorted(path.stem for path in EXAMPLES.glob("*.yaml")))
def test_every_example_is_shown(name):
    mechanism = example(name)
    elements, words = read(mechanism._repr_html_())
    known = trunnion.check(mechanism, notebook.LOOKED_AT)
    assert known.formula in words
    assert f"mobility {known.mobility}" in words
    assert all(one.what in words for one in known.findings[: notebook.MOST_FINDINGS])
    assert ("svg" in elements) == (name not in ("misaligned-fourbar", "misaligned-hinges"))
    assert "script" not in elements


@pytest.mark.parametrize(
    "changed",
    [
        {"dimensions": {"AB": "12 m", "BC": "0.1 m"}},  # no position goes together
        {"drivers": {}},  # the structure does not determine the motion
    ],
)
def test_a_mechanism_that_cannot_be_drawn_shows_why(changed):
    data = example("durango-fourbar").data()
    for section, entries in changed.items():
        data[section] = {**data[section], **entries} if entries else {}
    elements, words = read(trunnion.Mechanism(**data)._repr_html_())
    assert "svg" not in elements
    assert "error" in words


def test_names_become_no_markup(four_bar):
    data = {**example("durango-fourbar").data(), "name": "<script>alert(1)</script>"}
    odd = trunnion.Mechanism(**data)
    for page in (odd._repr_html_(), trunnion.analyse(odd, 2).trunnion._repr_html_()):
        elements, words = read(page)
        assert "script" not in elements
        assert "<script>alert(1)</script>" in words


@pytest.mark.spread(1)
@pytest.mark.parametrize(
    "made",
    [
        lambda: trunnion.analyse(example("durango-fourbar"), STEPS),
        lambda: trunnion.sweep(example("slider-crank"), {"r": ["50 mm", "51 mm"]}, STEPS),
        lambda: trunnion.play(example("fourbar-with-play"), steps=STEPS),
    ],
)
def test_a_result_shows_its_summary_and_findings(made):
    result = made().trunnion
    _, words = read(result._repr_html_())
    assert result.kind in words
    assert all(one.subject in words and one.remark in words for one in result.summary)
    assert all(one.what in words for one in result.findings[: notebook.MOST_FINDINGS])


def test_an_animation_is_a_page_in_a_frame(four_bar, tmp_path):
    moving = four_bar.trunnion.animate(height=500)
    frame = moving._repr_html_()
    assert read(frame)[0] == {"iframe"}
    assert 'height="500"' in frame
    assert 'sandbox="allow-scripts"' in frame
    page = unescape(re.search(r'srcdoc="([^"]*)"', frame)[1])
    assert page == moving.page
    script = re.search(r'<script type="module">(.*?)</script>', page, re.DOTALL)[1]
    assert f"script-src '{hashed(script)}'" in page
    assert not re.search(r"""(?:src|href)=["'](?!data:,)""", page)  # nothing is fetched
    assert moving.save(tmp_path / "motion.html").read_text(encoding="utf-8") == page
