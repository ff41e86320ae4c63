"""The drawings of the ways to assemble: every way with its name, the taken one marked, what has no place said."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.colors import to_hex

import trunnion
from mechanisms import MODELS, build, class_three, four_bar, scotch_yoke, stephenson_six_bar, watt_six_bar
from trunnion.errors import MechanismError
from trunnion.solve.assembly_modes import choices
from trunnion.solve.run import prepare
from trunnion.views.assembly.mode_drawings import _drawn, ways
from trunnion.views.assembly.modes import lines
from trunnion.views.common.cycle import layout
from trunnion.views.common.drawing import PALE
from trunnion.views.common.figures import INK, RULE
from trunnion.views.cycle.plots import save

SIGNATURES = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}


def panels(figure):
    """Title and axes of every drawing."""
    return {axes.get_title(loc="left"): axes for axes in figure.axes if axes.get_visible()}


def texts(axes):
    return [text.get_text() for text in axes.texts]


def colours(axes):
    """Of the outlines of links, which are lines of some width or filled."""
    return {to_hex(line.get_color()) for line in axes.lines if line.get_linewidth() > 4} | {
        to_hex(patch.get_edgecolor()) for patch in axes.patches if patch.get_zorder() == 4
    }


def test_each_way_is_drawn_under_its_name_and_one_is_marked():
    figure = ways(build(watt_six_bar()))
    drawn = panels(figure)
    assert list(drawn) == ["coupler: way-1  used", "coupler: way-2", "rod: way-1  used", "rod: way-2"]
    assert [part.get_suptitle() for part in figure.subfigs] == [
        "II(2,3)RRR    coupler, rocker",
        "II(4,5)RRR    rod, output",
    ]
    for title, axes in drawn.items():
        frame = to_hex(axes.spines["top"].get_edgecolor())
        assert frame == (INK if "used" in title else RULE)
        assert "CH"["rod" in title] in texts(axes)  # the inner pin of the group


def test_the_links_of_the_group_have_a_colour_and_the_others_none():
    drawn = panels(ways(build(watt_six_bar())))
    for title, axes in drawn.items():
        seen = colours(axes)
        assert PALE in seen
        assert (
            len({colour for colour in seen if colour in ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00")}) == 2
        ), title


@pytest.mark.slow
def test_all_drawings_have_one_scale_and_hold_the_mechanism():
    drawn = panels(ways(build(class_three()))).values()
    assert len({axes.get_xlim() + axes.get_ylim() for axes in drawn}) == 1
    for axes in drawn:
        for line in axes.lines:
            x, y = (np.asarray(data, dtype=float) for data in line.get_data())
            known = np.isfinite(x) & np.isfinite(y)
            low, high = zip(axes.get_xlim(), axes.get_ylim(), strict=True)
            assert (x[known] >= low[0]).all()
            assert (x[known] <= high[0]).all()
            assert (y[known] >= low[1]).all()
            assert (y[known] <= high[1]).all()


@pytest.mark.slow
def test_what_has_no_place_is_said():
    data = stephenson_six_bar()
    data["links"]["rod"]["points"]["H"] = [0.3, 0]  # long enough for one way of the four-bar only
    drawn = panels(ways(build(data)))
    silent = [
        title for title, axes in drawn.items() if any("not assembled here: rod, output" in one for one in texts(axes))
    ]
    assert silent == ["coupler: way-2"]


def test_a_name_of_another_group_that_then_does_not_exist_is_left_out():
    data = watt_six_bar()
    mechanism = build(data)
    stated = layout(trunnion.analyse(mechanism, 1))
    choice = choices(prepare(mechanism))[0]
    void = build({**data, "assembly": {**data["assembly"], "rod": "way-7"}})
    known, unknown = (_drawn(one, stated, choice, choice.ways[1]) for one in (mechanism, void))
    assert known.shown.tracks["rod.H"] == pytest.approx(unknown.shown.tracks["rod.H"])


@pytest.mark.spread(1)
@pytest.mark.parametrize("extension", SIGNATURES)
def test_written_whole_in_every_format_with_the_names_in_it(tmp_path, extension):
    path = save(ways(build(four_bar())), tmp_path / f"ways{extension}")
    content = path.read_bytes()
    assert content.startswith(SIGNATURES[extension])
    assert len(content) > 10_000
    assert [one.name for one in tmp_path.iterdir()] == [path.name]
    if extension == ".svg":
        assert b"<!-- coupler: way-1  used -->" in content
        assert b"<!-- coupler: way-2 -->" in content


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", MODELS)
def test_every_mechanism_with_a_choice_is_drawn(name, tmp_path):
    mechanism = build(MODELS[name]())
    found = trunnion.check(mechanism, 12).choices
    if not found:
        with pytest.raises(MechanismError, match="no group has more than one assembly"):
            ways(mechanism, found)
        return
    figure = ways(mechanism, found)
    assert len(panels(figure)) == sum(len(choice.ways) for choice in found)
    assert save(figure, tmp_path / "ways.png").stat().st_size > 10_000


def test_nothing_to_choose_is_no_figure():
    with pytest.raises(MechanismError, match="nothing to draw"):
        ways(build(scotch_yoke()))


# ---- in words -------------------------------------------------------------------------------------------------


def test_a_start_in_line_is_told_farther_on():
    (choice,) = choices(prepare(build(four_bar(0.3, 1.0, 0.3, 1.0))))
    assert lines(choice)[0] == "at 1° of A:"
