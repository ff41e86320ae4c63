"""The drawings of the ways to assemble: every way with its name, the taken one marked, what has no place said."""

import pytest
from matplotlib.colors import to_hex

import trunnion
from drawn import texts
from mechanisms import MODELS, build, stephenson_six_bar, watt_six_bar
from trunnion.errors import MechanismError
from trunnion.views.draw import INK, RULE, save
from trunnion.views.mode_drawings import ways


def panels(figure):
    """Title and axes of every drawing."""
    return {axes.get_title(loc="left"): axes for axes in figure.axes if axes.get_visible()}


def test_each_way_is_drawn_under_its_name_and_one_is_marked():
    figure = ways(build(watt_six_bar()))
    drawn = panels(figure)
    assert list(drawn) == ["coupler: way-1  used", "coupler: way-2", "rod: way-1  used", "rod: way-2"]
    assert [part.get_suptitle() for part in figure.subfigs] == [
        "II(2,3)RRR    coupler, rocker",
        "II(4,5)RRR    rod, output",
    ]
    for title, axes in drawn.items():
        assert to_hex(axes.spines["top"].get_edgecolor()) == (INK if "used" in title else RULE)
        assert "CH"["rod" in title] in texts(axes)  # the inner pin of the group


@pytest.mark.slow
def test_what_has_no_place_is_said():
    data = stephenson_six_bar()
    data["links"]["rod"]["points"]["H"] = [0.3, 0]  # long enough for one way of the four-bar only
    drawn = panels(ways(build(data)))
    silent = [title for title, axes in drawn.items() if "cannot be assembled in this mode" in texts(axes)]
    assert silent == ["coupler: way-2"]


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
