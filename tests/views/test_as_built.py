"""Errors and seats: figures, scene and tables; magnified in the page; none without what they need."""

import re
import shutil

import numpy as np
import pytest
from as_built_models import EXAMPLES, four_bar, loaded

import trunnion
from drawn import labels, line
from trunnion.views.as_built import losses, seated
from trunnion.views.scene import scene
from trunnion.views.shown import plot


@pytest.fixture(scope="module")
def slider():
    return loaded("toleranced-slider-crank")


@pytest.fixture(scope="module")
def cardan():
    return loaded("pezzuti-cardan")


@pytest.mark.slow
def test_errors_are_those_of_the_result(slider):
    place, slide = plot(slider, "error").axes
    size = np.linalg.norm(slider.point_error.sel(point="piston.Q").values, axis=0)
    assert line(place, "piston.Q").get_ydata()[:-1] == pytest.approx(1e6 * size)
    assert place.get_ylabel() == "position error [µm]"
    wrong = slider.joint_slide_error.sel(joint="S").values
    assert line(slide, "S").get_ydata()[:-1] == pytest.approx(1e6 * wrong)
    assert "slide [µm]" in slide.get_ylabel()
    dotted = [line for line in place.lines if str(line.get_linestyle()) == "--" and len(line.get_xdata()) == 2]
    assert len(dotted) >= len(np.unique(np.concatenate(list(losses(slider).values()))))
    assert "contact lost: S" in labels(place)


def test_a_seat_that_is_given_is_drawn_where_it_is():
    result = four_bar()
    (one,) = seated(result)
    assert (one.joint, one.kind, one.clearance, one.links) == ("B", "pin", pytest.approx(2e-5), ("crank", "coupler"))
    axes = plot(result, "beta").axes
    assert len(axes) == 1  # no β in the plane
    assert axes[0].lines[1].get_ydata() == pytest.approx(30.0)


@pytest.fixture(scope="module")
def misaligned():
    return trunnion.analyse(trunnion.Mechanism.read(EXAMPLES / "pezzuti-cardan-as-built.yaml"), 72)


def _full(series, count):
    return np.array(series * count if len(series) == 1 else series, dtype=float)


def test_points_less_their_errors_are_those_of_the_ideal_mechanism():
    shown = scene(four_bar(AB="0.1 mm"))
    ideal = scene(four_bar(seat=""))
    for key, track in ideal["points"].items():
        for axis in "xy":
            here = _full(shown["points"][key][axis], 72) - _full(shown["built"]["points"][key][axis], 72)
            assert here == pytest.approx(_full(track[axis], 72), abs=1e-8)
    turned = {link["name"]: _full(link["angle"], 72) for link in shown["links"]}
    for link in ideal["links"]:
        error = _full(shown["built"]["links"][link["name"]], 72)
        assert turned[link["name"]] - error == pytest.approx(_full(link["angle"], 72), abs=1e-6)


@pytest.mark.slow
def test_a_link_in_space_is_moved_turned_and_stretched_to_its_errors(misaligned):
    """The mean shift, the turn about the middle and the stretch of each point add up to the error of that point."""
    for link, told in scene(misaligned)["built"]["links"].items():
        shift, turn = (np.array([_full(told[what][axis], 72) for axis in "xyz"]) for what in ("shift", "turn"))
        own = [key for key in misaligned.point.values if key.split(".")[0] == link]
        errors = misaligned.point_error.sel(point=own).transpose("point", "axis", "position").values
        places = misaligned.point_position.sel(point=own).transpose("point", "axis", "position").values
        arms = places - places.mean(axis=0)
        rigid = shift + np.cross(turn[None], arms, axis=1)
        left = np.linalg.norm(errors - rigid, axis=1)
        bys = np.array([np.linalg.norm(row["by"]) for row in told["stretch"]] or [0.0] * len(own))
        assert left == pytest.approx(np.repeat(bys[:, None], 72, axis=1), abs=2e-9)


if shutil.which("node"):  # as in test_scene.py
    from test_scene import page, run

    def test_arithmetic_of_magnified_errors():
        run("built.test.mjs")

    def test_errors_are_magnified_in_the_plane(slider, tmp_path):
        shown = page(slider, tmp_path)["built"]
        assert shown["presets"][0] == "× 1"
        assert shown["seats"] == ["O", "P", "Q", "S"]
        assert all(re.search(r"play × \d+; longest load", text) for text in shown["remarks"])
        assert shown["lost"] > 0
        assert shown["clear"] == 1  # the block of S, as long as its guide, hides nothing
        assert {"Position errors, largest", "Transmission error, slide of S", "ξ, direction of the seats"} <= set(
            shown["titles"]
        )
        for factor in (1, 100, 1000):
            told = shown["at"][str(factor)]
            (said,) = told["said"]
            assert said.startswith(f"errors × {factor}")
            assert told["output"] == [f"× {factor}"]
            assert (told["ideal"] > 0) == (factor > 1)
            assert len(told["apart"]) == len(told["holes"]) == 3
            for pin, (x, y, radius) in zip(told["apart"], told["holes"], strict=True):
                assert np.hypot(pin[0] - x, pin[1] - y) == pytest.approx(radius - 5, abs=0.2)  # at the wall

    @pytest.mark.slow
    def test_errors_are_magnified_in_space(misaligned, tmp_path):
        shown = page(misaligned, tmp_path)["built"]
        assert shown["seats"] == [
            f"{joint}, end {end}" for joint in ("input", "pin-1", "pin-2", "output") for end in (1, 2)
        ]
        counts = {factor: told["painted"] for factor, told in shown["at"].items()}
        assert counts["100"] > counts["1"] > 500
        assert shown["at"]["100"]["said"] == ["errors × 100, ideal as pale lines"]


def test_links_that_have_no_place_as_built_are_not_moved():
    mechanism = trunnion.read(EXAMPLES / "pezzuti-cardan-10mm.yaml").with_seats("loaded")
    result = trunnion.analyse(mechanism, 6)
    assert np.isnan(result.link_error.sel(link="cross")).all()  # locked by friction at every position
    assert "cross" not in scene(result)["built"]["links"]
