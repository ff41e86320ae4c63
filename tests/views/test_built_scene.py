"""Errors in the report: what its scene tells, how it is magnified, its tables; one file that fetches nothing."""

from __future__ import annotations

import re
import shutil

import numpy as np
import pytest
from as_built_models import EXAMPLES, four_bar, loaded

import trunnion
from trunnion.views.cycle.deviations import error_rows, loss_rows
from trunnion.views.cycle.scene import scene


@pytest.fixture(scope="module")
def slider():
    return loaded("toleranced-slider-crank")


@pytest.fixture(scope="module")
def cardan():
    return trunnion.analyse(trunnion.Mechanism.read(EXAMPLES / "pezzuti-cardan-as-built.yaml"), 72)


def _full(series, count):
    return np.array(series * count if len(series) == 1 else series, dtype=float)


def test_points_less_their_errors_are_those_of_the_ideal_mechanism():
    shown = scene(four_bar(AB="0.1 mm"))
    ideal = scene(trunnion.analyse(_without_errors(), 72))
    for key, track in ideal["points"].items():
        for axis in "xy":
            here = _full(shown["points"][key][axis], 72) - _full(shown["built"]["points"][key][axis], 72)
            assert here == pytest.approx(_full(track[axis], 72), abs=1e-8)
    turned = {link["name"]: _full(link["angle"], 72) for link in shown["links"]}
    for link in ideal["links"]:
        error = _full(shown["built"]["links"][link["name"]], 72)
        assert turned[link["name"]] - error == pytest.approx(_full(link["angle"], 72), abs=1e-6)


def _without_errors():
    from as_built_models import FOUR_BAR
    from ruamel.yaml import YAML

    return trunnion.Mechanism.model_validate(YAML(typ="safe").load(FOUR_BAR.replace(", seat: {xi: 30 deg}", "")))


@pytest.mark.slow
def test_a_link_in_space_is_moved_turned_and_stretched_to_its_errors(cardan):
    """The mean shift, the turn about the middle and the stretch of each point add up to the error of that point."""
    built = scene(cardan)["built"]
    for link, told in built["links"].items():
        shift, turn = (np.array([_full(told[what][axis], 72) for axis in "xyz"]) for what in ("shift", "turn"))
        own = [key for key in cardan.point.values if key.split(".")[0] == link]
        errors = np.array([cardan.point_error.sel(point=key).transpose("axis", "position").values for key in own])
        places = np.array([cardan.point_position.sel(point=key).transpose("axis", "position").values for key in own])
        arms = places - places.mean(axis=0)
        rigid = shift + np.cross(turn[None], arms, axis=1)
        left = np.linalg.norm(errors - rigid, axis=1)
        bys = (
            np.array([np.linalg.norm(row["by"]) for row in told["stretch"]]) if told["stretch"] else np.zeros(len(own))
        )
        assert left == pytest.approx(np.repeat(bys[:, None], 72, axis=1), abs=2e-9)


@pytest.mark.slow
def test_the_table_of_errors_has_the_figures_of_the_result(cardan):
    rows = {row["label"]: row for row in error_rows(cardan)}
    efficiency = rows["Efficiency of the cycle"]
    assert efficiency["built"] == f"{float(cardan.efficiency):.4f}"
    assert efficiency["ideal"] == f"{float(cardan.efficiency_ideal):.4f}"
    wrong = np.degrees(cardan.joint_rotation_error.sel(joint="output").values)
    index = int(np.argmax(np.abs(wrong)))
    told = rows["Transmission error, rotation of output, largest"]
    assert told["difference"] == f"{wrong[index]:.4g}°".replace("-", "−")
    assert told["place"] == f"{5 * index}°"
    effort = cardan.drive_effort.sel(driver="input").values
    ideal = effort - cardan.drive_effort_change.sel(driver="input").values
    torque = rows["Drive torque of input, largest"]
    assert torque["built"] == f"{np.max(effort):.2f}\u00a0N m"
    assert torque["ideal"] == f"{np.max(ideal):.2f}\u00a0N m"


@pytest.mark.slow
def test_losses_are_told_with_their_angles(slider):
    (row,) = loss_rows(slider)
    lost = np.flatnonzero(slider.contact_lost.sel(joint="S").values)
    assert row["joint"] == "S"
    assert row["places"] == ", ".join(f"{5 * index}°" for index in lost)
    assert loss_rows(four_bar()) == []


if shutil.which("node"):  # as in test_browser.py
    from test_browser import page, run

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
    def test_errors_are_magnified_in_space(cardan, tmp_path):
        shown = page(cardan, tmp_path)["built"]
        assert shown["seats"] == [
            f"{joint}, end {end}" for joint in ("input", "pin-1", "pin-2", "output") for end in (1, 2)
        ]
        counts = {factor: told["painted"] for factor, told in shown["at"].items()}
        assert counts["100"] > counts["1"] > 500
        assert shown["at"]["100"]["said"] == ["errors × 100, ideal as pale lines"]
