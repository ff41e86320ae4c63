"""DXF out: what is drawn comes back."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import trunnion
from mechanisms import (
    DURANGO,
    build,
    class_three,
    elliptic_bar,
    four_bar,
    inverted_slider_crank,
    model,
    scotch_yoke,
    slider_crank,
    transformed,
    watt_six_bar,
)
from trunnion.exchange import export_model, import_file
from trunnion.exchange.drawing import write
from trunnion.exchange.skeleton import positions_of

EXAMPLES = DURANGO.parent
ROUND = ("durango-fourbar", "slider-crank", "scotch-yoke", "jansen", "whitworth-quick-return", "toggle-press",
         "toleranced-slider-crank", "elliptic-trammel", "peaucellier", "stick-slip-drive")  # fmt: skip
QUICK = ("durango-fourbar", "geared-five-bar", "fourbar-with-play")
AB, BC, CD, AD = 2.0, 6.0, 3.0, 5.5  # of the four-bar of [D], Table 1


def lines(path: Path) -> dict[str, list[Any]]:
    """The lines of a drawing by layer, as (start, end) in mm."""
    drawn: dict[str, list[Any]] = {}
    for line in ezdxf.readfile(path).modelspace().query("LINE"):
        ends = [np.array(end.xyz) for end in (line.dxf.start, line.dxf.end)]
        drawn.setdefault(line.dxf.layer, []).append(ends)
    return drawn


@pytest.mark.spread(1, *QUICK)
@pytest.mark.parametrize("name", ROUND)
def test_what_is_drawn_comes_back(name: str, tmp_path: Path) -> None:
    mechanism = trunnion.read(EXAMPLES / f"{name}.yaml")
    at = None if name in ("toggle-press", "stick-slip-drive", "peaucellier") else "77deg"
    export_model(mechanism, tmp_path / "out.dxf", at)
    drawn = positions_of(mechanism, 4, at).draft()
    again = import_file(tmp_path / "out.dxf", ground=drawn.ground)
    assert again.bodies.keys() == drawn.bodies.keys()
    assert again.pairs.keys() == drawn.pairs.keys()
    for joint, pair in drawn.pairs.items():
        read = again.pairs[joint]
        assert (read.type, read.links) == (pair.type, pair.links)
        np.testing.assert_allclose(read.at, pair.at, atol=1e-12)
        if pair.type == "revolute":
            assert read.pin_radius == pytest.approx(pair.pin_radius, rel=1e-9)
            assert (read.clearance or 0) == pytest.approx(pair.clearance or 0, abs=1e-12)
        else:
            assert abs(read.axis @ pair.axis) == pytest.approx(np.linalg.norm(pair.axis), rel=1e-12)
            assert (read.length or 0) == pytest.approx(pair.length or 0, rel=1e-9)
    for link, body in drawn.bodies.items():
        joints = [pair.at for pair in drawn.pairs.values() if link in pair.links]
        for point, place in body.points.items():
            if min(np.linalg.norm(place - at) for at in joints) < 1e-12:
                continue  # what lies at a joint is the joint
            np.testing.assert_allclose(again.bodies[link].points[point], place, atol=1e-12)


TURNED = (four_bar, slider_crank, inverted_slider_crank, watt_six_bar, class_three, scotch_yoke, elliptic_bar)


@settings(deadline=None, max_examples=8)
@given(made=st.sampled_from(TURNED), turn=st.floats(-180, 180), shift=st.floats(-10, 10), mirror=st.booleans())
def test_what_is_drawn_comes_back_in_any_frame(
    made: Any, turn: float, shift: float, mirror: bool, tmp_path_factory: pytest.TempPathFactory
) -> None:
    mechanism = build(transformed(model(made()), math.radians(turn), (shift, -shift), mirror))
    path = tmp_path_factory.mktemp("frame") / "out.dxf"
    positions = positions_of(mechanism, 11)
    row = 7 if np.isfinite(positions.result["point_position"].values[..., 7]).all() else 0
    positions = positions_of(mechanism, 11, f"{float(positions.result['time'].values[row]):.17g}s")
    write(positions, path)
    drawn = positions.draft()
    again = import_file(path, ground=drawn.ground)
    assert again.pairs.keys() == drawn.pairs.keys()
    for joint, pair in drawn.pairs.items():
        read = again.pairs[joint]
        assert (read.type, set(read.links)) == (pair.type, set(pair.links))
        np.testing.assert_allclose(read.at, pair.at, atol=1e-9)
        if pair.type == "prismatic":
            assert abs(read.axis @ pair.axis) == pytest.approx(np.linalg.norm(pair.axis), rel=1e-9)


def poses(angle: float) -> np.ndarray:
    """Of the four-bar of [D]: x, y, turn of crank, coupler and rocker at their mass centres; its own closed form."""
    b = AB * np.exp(1j * angle)
    d = complex(AD)
    span = d - b
    bend = math.acos((BC**2 + abs(span) ** 2 - CD**2) / (2 * BC * abs(span)))
    c = b + BC * span / abs(span) * np.exp(1j * bend)
    coupler, rocker = np.angle(c - b), np.angle(c - d)
    centres = [b / 2, b + 2.8 * np.exp(1j * (coupler + 0.152)), (c + d) / 2]
    return np.array([[p.real, p.imag, t] for p, t in zip(centres, (angle, coupler, rocker), strict=True)])


def test_curves_of_points_are_drawn_over_the_cycle(tmp_path: Path) -> None:
    export_model(trunnion.read(DURANGO), tmp_path / "out.dxf")
    space = ezdxf.readfile(tmp_path / "out.dxf").modelspace()
    curves = {curve.dxf.layer: curve for curve in space.query("POLYLINE")}
    assert set(curves) == {"~curve crank B", "~curve coupler C", "~curve coupler E"}
    drawn = np.array([point.xyz[:2] for point in curves["~curve coupler E"].points()])
    for angle, place in zip(2 * np.pi * np.arange(360) / 360, drawn, strict=True):
        turn = poses(float(angle))[1, 2] + math.pi / 6
        np.testing.assert_allclose(
            1e-3 * place, [AB * math.cos(angle) + 2.5 * math.cos(turn), AB * math.sin(angle) + 2.5 * math.sin(turn)],
            atol=1e-9,
        )  # fmt: skip
    assert curves["~curve coupler E"].is_closed


def test_names_that_dxf_forbids_are_changed_and_noted(tmp_path: Path) -> None:
    text = DURANGO.read_text("utf-8").replace("coupler", '"rod/1"').replace("crank", "Rod_1").replace("rocker", "~é")
    (tmp_path / "model.yaml").write_text(text, "utf-8")
    noted = export_model(trunnion.read(tmp_path / "model.yaml"), tmp_path / "out.dxf")
    assert [finding.where for finding in noted if finding.code == "exchange.name"] == ["links.rod/1", "links.~é"]
    assert set(import_file(tmp_path / "out.dxf").bodies) == {"ground", "Rod_1", "rod_1-2", "é"}
