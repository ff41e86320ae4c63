"""The scene is plain JSON, true to the result, and bears every kind of result; the page that node draws of it."""

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from stand_in import four_bar
from test_report import Page

from mechanisms import MODELS, analyse, slider_crank
from mechanisms_parts import EXAMPLES, joined
from trunnion import Mechanism, read
from trunnion import analyse as analysed
from trunnion.errors import Status
from trunnion.results.attributes import summary_of
from trunnion.views.report import report
from trunnion.views.scene import scene


def test_every_kind_of_result_becomes_plain_json(case):
    _, result = case
    text = json.dumps(scene(result, result), allow_nan=False)
    assert json.loads(text)["count"] == result.sizes["position"]


def test_numbers_are_those_of_the_result_to_seven_digits(plain, ideal):
    shown = scene(plain, ideal)
    joint = shown["joints"][1]
    assert joint["name"] == "B"
    assert joint["at"] == "coupler.B"  # the reaction acts on the second link
    assert joint["reaction"]["x"] == pytest.approx(plain.reaction_force.sel(joint="B", axis="x").values, rel=1e-6)
    assert joint["ideal"]["y"] == pytest.approx(ideal.reaction_force.sel(joint="B", axis="y").values, rel=1e-6)
    assert shown["drivers"][0]["effort"] == pytest.approx(plain.drive_effort.values[0], rel=1e-6)
    assert shown["abscissa"]["closed"]


def test_a_gap_is_none_with_its_cause():
    shown = scene(four_bar(gap=(132, 229, Status.NOT_ASSEMBLED)))
    assert shown["drivers"][0]["effort"][131] is not None
    assert shown["drivers"][0]["effort"][132] is None
    assert shown["points"]["coupler.E"]["x"][200] is None
    assert shown["states"][str(int(Status.NOT_ASSEMBLED))] == Status.NOT_ASSEMBLED.text


def test_many_positions_are_thinned_evenly_and_said():
    result = four_bar(1000)
    shown = scene(result, max_positions=300)
    assert (shown["count"], shown["thinned"]) == (250, 1000)
    assert np.diff(shown["abscissa"]["values"]) == pytest.approx(4 * 0.36)
    assert scene(result, max_positions=1000)["thinned"] is None


def test_loads_without_a_point_are_not_drawn_at_one(plain):
    loads = {load["name"]: load for load in scene(plain)["loads"]}
    assert loads["work"]["at"] == "coupler.E"
    assert loads["brake"]["at"] is None
    assert loads["brake"]["moment"] == -250.0


def test_the_report_tells_the_published_figures(plain, ideal):
    text = report(plain, ideal)
    words = " ".join("".join(Page(text).words).split())
    for figure in ("9.288 kN m", "−18.57 kN m", "0.5175 kW", "2.376 kW"):  # of the course
        assert figure in words
    assert len(text) < 1_500_000


def test_a_joint_that_bears_nothing_has_no_reaction_from_rounding():
    """A ram between two pins: its guide bears nothing, however the ram lies."""
    ram = Mechanism(
        trunnion=1,
        links={
            "ground": {"points": {"D": [0, 0], "H": [-0.7, 0.15]}},
            "lever": {"points": {"D": [0, 0], "G": [0.03, 0.15]}},
            "barrel": {"points": {"H": [0, 0], "Z": {"at": [0, 0], "axis": [1, 0]}}},
            "rod": {"points": {"Z": {"at": [0, 0], "axis": [1, 0]}, "G": [0, 0]}},
        },
        joints=joined("ground -D- lever, ground -H- barrel =Z= rod -G- lever"),
        drivers={"Z": {"range": [0.65, 0.75], "speed": 0.05}},
        loads={"work": {"joint": "D", "resisting_torque": 60.0}},
        assembly={"G": [0, 0.15]},
    )
    result = analysed(ram, 24)
    assert 0 < float(np.abs(result["reaction_force"].sel(joint="Z")).max()) < 1e-9
    (figure,) = [one for one in summary_of(result) if one.name == "Z.reaction_max"]
    assert (figure.value, figure.place) == (0.0, "everywhere")
    shown = {joint["name"]: joint["reaction"] for joint in scene(result)["joints"]}
    assert not np.any([shown["Z"]["x"], shown["Z"]["y"]])
    np.testing.assert_allclose(shown["G"]["x"], result["reaction_force"].sel(joint="G", axis="x"), rtol=1e-6)


NODE = shutil.which("node")

if NODE:  # not a skip: what must hold everywhere is tested in Python; this is the browser's own part

    def run(script, *arguments):
        """What a script of this folder prints."""
        command = [NODE, str(Path(__file__).with_name(script)), *map(str, arguments)]
        done = subprocess.run(command, capture_output=True, text=True, timeout=120)
        if done.returncode:
            pytest.fail((done.stdout + done.stderr)[-4000:])
        return done.stdout

    def page(result, folder, ideal=None):
        """What the report's page shows of a result."""
        path = folder / "scene.json"
        path.write_text(json.dumps(scene(result, ideal)), encoding="utf-8")
        return json.loads(run("page.test.mjs", path))

    def test_arithmetic():
        run("format.test.mjs")

    @pytest.mark.spread(3)
    def test_every_kind_of_result_makes_a_page(case, tmp_path):
        _, result = case
        shown = page(result, tmp_path, result)
        assert shown["charts"] >= 4
        assert shown["polars"] == result.sizes["joint"]

    def test_loads_are_drawn_forces_and_moments(plain, tmp_path):
        shown = page(plain, tmp_path)
        assert (shown["loads"], shown["moments"]) == (2, 1)

    @pytest.mark.slow
    def test_springs_and_following_forces_are_drawn(tmp_path):
        result = four_bar(36)
        stated = json.loads(result.attrs["scene"])
        stated["springs"] = {"S": {"between": ["ground.A", "coupler.E"], "joint": None}}
        stated["loads"]["work"] |= {"frame": "link", "varies": True}
        result.attrs["scene"] = json.dumps(stated)
        shown = page(result, tmp_path)
        assert shown["loads"] == 2
        assert len(shown["springs"]) == 1
        assert re.fullmatch(r"M[-\d.,]+(L[-\d.]+,[-\d.]+)+", shown["springs"][0])
        assert shown["dashes"] == ["none"]
        idle = result.assign_coords(spring=["S"]).assign(spring_force=(("spring", "position"), np.zeros((1, 36))))
        assert page(idle, tmp_path)["dashes"] == ["2 3"]  # it acts one way and does not here

    @pytest.mark.slow
    def test_slots_on_moving_links_are_drawn(tmp_path):
        """The slit is as long as the slide travels and the block needs; a guide on the ground has none."""
        (path,) = page(analyse(MODELS["inverted slider-crank"](), 24), tmp_path)["slits"]
        ends = [[float(text) for text in end.split(",")] for end in path[1:].split("L")]
        assert np.hypot(*np.subtract(*ends)) > 2 * 26
        assert page(analyse(slider_crank(), 24), tmp_path)["slits"] == []

    @pytest.mark.slow
    @pytest.mark.parametrize("example", ["toggle-press", "drawing-press", "slider-crank"])
    def test_loads_are_on_the_scale_of_the_reactions_and_no_name_covers_their_values(example, tmp_path):
        shown = page(analysed(read(EXAMPLES / f"{example}.yaml"), 24), tmp_path)
        assert shown["covered"] == 0
        units = {"N": 1.0, "kN": 1e3, "mN": 1e-3}
        sizes = [(length, re.search(r"([\d.]+)\u00a0(\w+)", text)) for length, text in shown["arrows"]]
        scale = [length / (float(text[1]) * units[text[2]]) for length, text in sizes if length > 12.5]
        assert len(scale) >= 2
        assert scale == pytest.approx([scale[-1]] * len(scale), rel=0.02)

    def test_the_longest_reaction_stays_in_the_picture(plain, tmp_path):
        largest = int(np.hypot(*plain.reaction_force.sel(joint="A").values).argmax())
        turned = plain.roll(position=-1 - largest, roll_coords=False)  # then it is the last that the page shows
        for path in page(turned, tmp_path)["reaction"]:
            numbers = [float(text) for text in re.findall(r"-?[\d.]+", path)]
            assert min(numbers) >= 0
            assert max(numbers) <= 490  # the width it is printed at, the last it was drawn at
