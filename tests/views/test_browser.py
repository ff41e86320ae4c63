"""The browser modules, run by node where there is one: their arithmetic, and the page in a document of our own."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from stand_in import four_bar

from geared import geared_five_bar
from mechanisms import MODELS, analyse, slider_crank
from trunnion import analyse as analysed
from trunnion import read
from trunnion.views.cycle.scene import scene

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
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

    def test_pitch_circles_are_drawn(tmp_path):
        result = analyse(geared_five_bar(), 24)
        assert len(page(result, tmp_path)["circles"]) == 2

    def test_slots_on_moving_links_are_drawn(tmp_path):
        """The slit is as long as the slide travels and the block needs; a guide on the ground has none."""
        result = analyse(MODELS["inverted slider-crank"](), 24)
        (path,) = page(result, tmp_path)["slits"]
        ends = [[float(text) for text in end.split(",")] for end in path[1:].split("L")]
        assert np.hypot(*np.subtract(*ends)) > 2 * 26
        assert page(analyse(slider_crank(), 24), tmp_path)["slits"] == []

    @pytest.mark.slow
    def test_a_driven_slide_is_a_barrel_with_a_rod_out_of_it(tmp_path):
        """Rod and barrel end at their eyes and overlap; neither sticks out behind the other's pin."""
        result = analysed(read(EXAMPLES / "toggle-press.yaml"), 24)
        ((rod, barrel),) = page(result, tmp_path)["cylinders"]
        ends = [[float(text) for text in re.findall(r"-?[\d.]+", path)] for path in (rod, barrel)]
        (x, y), by = ends[1][:2], ends[0][:2]
        apart = np.hypot(by[0] - x, by[1] - y)
        lengths = [np.hypot(*end[2:]) for end in ends]
        assert max(lengths) < apart < sum(lengths)
        for end in ends:
            assert (by[0] - x) * end[3] - (by[1] - y) * end[2] == pytest.approx(0, abs=0.3 * apart)
        assert page(analyse(MODELS["inverted slider-crank"](), 24), tmp_path)["cylinders"] == []

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
