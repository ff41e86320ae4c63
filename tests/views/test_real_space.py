"""The views on real analyses of mechanisms in space, and their columns."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from test_report import Page

import trunnion
from trunnion import Mechanism, analyse
from trunnion.errors import Status
from trunnion.results.export import save as write
from trunnion.solve.assembly_modes import AssemblyMode, GroupModes
from trunnion.views.assembly.mode_drawings import ways
from trunnion.views.cycle.plots import save
from trunnion.views.cycle.report import report
from trunnion.views.cycle.scene import scene
from trunnion.views.space.bodies import space

EXAMPLES = Path(__file__).parents[2] / "examples"
SPATIAL = sorted(path.stem for path in EXAMPLES.glob("*.yaml") if "space: spatial" in path.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def results():
    """Every other spatial example, and those that tests name, as far as it can be analysed, by name."""
    found = {}
    for name in sorted({*SPATIAL[::2], "pezzuti-cardan", "spherical-four-bar"}):
        mechanism = Mechanism.read(EXAMPLES / f"{name}.yaml")
        try:
            result = analyse(mechanism, 24)
        except trunnion.MechanismError:  # one that is there to be refused
            continue
        if (result["status"] < Status.NOT_CONVERGED).any():  # not one whose errors only its plays take up
            found[name] = result
    assert len(found) >= 8
    return found


@pytest.mark.slow
def test_poses_and_frames_put_the_joints_where_the_points_are(results):
    """What the drawings are made of gives the places that the result tells, on both links."""
    for name, result in results.items():
        shown = space(result)
        size = max(shown.size, 1e-3)
        for joint, one in shown.joints.items():
            for side, link in enumerate(one["links"]):
                track = result["point_position"].sel(point=f"{link}.{joint}").transpose("axis", "position").values
                assert shown.at(joint, side) == pytest.approx(track, abs=1e-9 * size, nan_ok=True), (name, joint)
            if joint in shown.stated["plays"]:  # its pin does not lie in the middle of its hole
                continue
            if one["type"] in ("revolute", "cylindrical", "helical", "prismatic"):
                both = shown.axis(joint, 0), shown.axis(joint, 1)
                assert both[0] == pytest.approx(both[1], abs=1e-9, nan_ok=True), (name, joint)
            if one["type"] in ("prismatic", "cylindrical"):
                slide = result["joint_slide"].sel(joint=joint).values
                assert shown.slides(joint) == pytest.approx(slide, abs=1e-9 * size, nan_ok=True), (name, joint)


@pytest.mark.slow
def test_every_report_is_sound_and_small(results):
    for name, result in results.items():
        text = report(result)
        page = Page(text)
        assert not page.open, name
        assert page.scene()["space"] == "spatial"
        assert len(text) < 1_500_000


@pytest.mark.slow
def test_the_screw_axis_of_a_shaft_is_its_bearing(results):
    links = {link["name"]: link for link in scene(results["pezzuti-cardan"])["links"]}
    screw = links["input-shaft"]["screw"]
    assert np.abs(screw["w"]) == pytest.approx(np.ones(len(screw["w"])), abs=1e-6)
    assert np.abs(screw["pitch"]).max() < 1e-9


@pytest.mark.slow
def test_reactions_that_are_rounding_are_not_drawn(results):
    """The axes of a spherical linkage without weight carry moments alone."""
    for joint in scene(results["spherical-four-bar"])["joints"]:
        assert [set(part) for part in joint["reaction"].values()] == [{0.0}] * 3
        assert max(abs(value) for part in joint["moment"].values() for value in part) > 1e-3


@pytest.mark.slow
def test_columns_of_the_cardan_joint(results, tmp_path):
    result = results["pezzuti-cardan"]
    write(result, tmp_path / "cardan.csv")
    table = pd.read_csv(tmp_path / "cardan.csv")
    assert len(table.columns) == len(set(table.columns))
    for axis in "xyz":
        expected = result["reaction_moment"].sel(joint="pin-1", axis=axis).values
        assert table[f"pin-1.reaction_moment_{axis}"].values == pytest.approx(expected)
    assert table["output.slide"].values == pytest.approx(result["joint_slide"].sel(joint="output").values)
    assert "input.slide" not in table
    quaternion = table[[f"cross.rotation_{one}" for one in "wxyz"]].values
    assert np.linalg.norm(quaternion, axis=1) == pytest.approx(np.ones(24))


@pytest.mark.slow
def test_ways_of_a_spatial_group_are_drawn(tmp_path):
    mechanism = Mechanism.read(EXAMPLES / "pezzuti-cardan.yaml")
    told = tuple(AssemblyMode(f"way-{number}", {"pin-2": (0.0, 0.0, 0.0)}, number == 1) for number in (1, 2, 9))
    figure = ways(mechanism, [GroupModes(1, "II(2,3)CCC", ("cross", "output-shaft"), "cross", 0.0, "", told)])
    titles = [axes.get_title(loc="left") for axes in figure.axes if axes.get_visible()]
    assert titles == ["cross: way-1  used", "cross: way-2", "cross: way-9"]
    words = [{text.get_text() for text in axes.texts} for axes in figure.axes if axes.get_visible()]
    assert words == [{"pin-2"}, {"pin-2"}, {"cannot be assembled in this mode"}]
    assert save(figure, tmp_path / "ways.png").stat().st_size > 10_000


if shutil.which("node"):  # as in test_browser.py
    from test_browser import page

    @pytest.mark.slow
    def test_every_example_makes_a_page(results, tmp_path):
        for name, result in results.items():
            shown = page(result, tmp_path)
            assert shown["polars"] == result.sizes["joint"], name
            assert shown["space"]["painted"] > 500, name
            turning = [joint for joint in json.loads(result.attrs["scene"])["joints"].values()
                       if joint["type"] not in ("spherical", "universal", "fixed")]  # fmt: skip
            assert shown["space"]["after"]["axes"] >= len(turning), name
