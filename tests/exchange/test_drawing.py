"""DXF out: what is drawn comes back, and the force polygons close and are those of an independent calculation."""

import math
import re
from itertools import pairwise

import ezdxf
import numpy as np
import pytest

import trunnion
from mechanisms import DURANGO
from trunnion.exchange import export_model, import_file
from trunnion.exchange.draft import positions_of

EXAMPLES = DURANGO.parent
ROUND = ("durango-fourbar", "slider-crank", "scotch-yoke", "jansen", "whitworth-quick-return", "toggle-press",
         "toleranced-slider-crank", "elliptic-trammel", "peaucellier", "stick-slip-drive")  # fmt: skip
FORCED = (*ROUND[:6], "geared-five-bar", "spring-balanced-lamp", "fourbar-with-play", "andrews-squeezer",
          "landing-gear")  # fmt: skip
QUICK = ("durango-fourbar", "geared-five-bar", "fourbar-with-play")
AB, BC, CD, AD = 2.0, 6.0, 3.0, 5.5  # of the four-bar of [D], Table 1


def lines(path):
    """The lines of a drawing by layer, as (start, end) in mm."""
    drawn = {}
    for line in ezdxf.readfile(path).modelspace().query("LINE"):
        ends = [np.array(end.xyz) for end in (line.dxf.start, line.dxf.end)]
        drawn.setdefault(line.dxf.layer, []).append(ends)
    return drawn


@pytest.mark.spread(1, *QUICK)
@pytest.mark.parametrize("name", ROUND)
def test_what_is_drawn_comes_back(name, tmp_path):
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


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", FORCED)
def test_every_force_polygon_of_the_file_closes_head_to_tail(name, tmp_path):
    mechanism = trunnion.read(EXAMPLES / f"{name}.yaml")
    time = 0.37 * float(positions_of(mechanism, 2).result["time"].values[1]) * 2
    export_model(mechanism, tmp_path / "out.dxf", f"{time:.9g}s")
    polygons = {layer: sides for layer, sides in lines(tmp_path / "out.dxf").items() if layer.startswith("~forces")}
    assert polygons
    for layer, sides in polygons.items():
        perimeter = sum(np.linalg.norm(end - start) for start, end in sides)
        for (_, end), (start, _) in pairwise([*sides, sides[0]]):
            assert np.linalg.norm(end - start) <= 1e-9 * perimeter, layer


def durango(friction):
    mechanism = trunnion.read(DURANGO)
    return mechanism if friction == "on" else mechanism.with_friction("off")


def forces(path):
    """Size by its label, N, and vector by its line and scale, N, of every force of every polygon."""
    space = ezdxf.readfile(path).modelspace()
    drawn = {}
    for layer, sides in lines(path).items():
        if not layer.startswith("~forces") or " round " in layer:
            continue
        texts = [text.dxf.text for text in space.query(f'TEXT[layer=="{layer}"]')]
        scale = float(next(re.search(r"([\d.e+-]+) N/mm", text) for text in texts if "N/mm" in text)[1])
        labels = [text.rsplit(": ", 1) for text in texts if "N/mm" not in text]
        drawn[layer] = {
            name: (float(size.removesuffix(" N")), scale * (end - start)[:2])
            for (name, size), (start, end) in zip(labels, sides, strict=True)
        }
    return drawn


def poses(angle):
    """Of the four-bar of [D]: x, y, turn of crank, coupler and rocker at their mass centres; its own closed form."""
    b = AB * np.exp(1j * angle)
    d = complex(AD)
    span = d - b
    bend = math.acos((BC**2 + abs(span) ** 2 - CD**2) / (2 * BC * abs(span)))
    c = b + BC * span / abs(span) * np.exp(1j * bend)
    coupler, rocker = np.angle(c - b), np.angle(c - d)
    centres = [b / 2, b + 2.8 * np.exp(1j * (coupler + 0.152)), (c + d) / 2]
    return np.array([[p.real, p.imag, t] for p, t in zip(centres, (angle, coupler, rocker), strict=True)])


def reactions(angle, speed=10.0):
    """Forces of [D 2-7] without friction at a crank angle: inertia by differences, statics by one linear system."""
    step = 1e-4
    second = (poses(angle + step) - 2 * poses(angle) + poses(angle - step)) / step**2 * speed**2
    masses, inertias = np.array([4.8, 30.0, 7.2]), np.array([1.7, 48.8, 5.5])
    inertia = -masses[:, None] * second[:, :2]
    moments = -inertias * second[:, 2]
    places = poses(angle)
    b, d = AB * np.array([math.cos(angle), math.sin(angle)]), np.array([AD, 0.0])
    c = d + CD * np.array([math.cos(places[2, 2]), math.sin(places[2, 2])])
    turn = places[1, 2] + math.pi / 6
    e = b + 2.5 * np.array([math.cos(turn), math.sin(turn)])
    work = np.array([0.0, -1000.0])

    def moment(arm, force):
        return float(arm[0] * force[1] - arm[1] * force[0])

    # unknowns: F_B on the coupler, F_C on the rocker by the coupler, F_D on the rocker
    rows, right = np.zeros((6, 6)), np.zeros(6)
    rows[0:2, 0:2], rows[0:2, 2:4], right[0:2] = np.eye(2), -np.eye(2), -(inertia[1] + work)
    rows[2:4, 2:4], rows[2:4, 4:6], right[2:4] = np.eye(2), np.eye(2), -inertia[2]
    rows[4, 0:2] = [-(b - c)[1], (b - c)[0]]
    right[4] = -(moment(places[1, :2] - c, inertia[1]) + moments[1] + moment(e - c, work))
    rows[5, 4:6] = [-(d - c)[1], (d - c)[0]]
    right[5] = -(moment(places[2, :2] - c, inertia[2]) + moments[2] - 250.0)
    solved = np.linalg.solve(rows, right)
    return {
        "reaction B on coupler": solved[0:2], "reaction C on rocker": solved[2:4], "reaction D on rocker": solved[4:6],
        "inertia of coupler": inertia[1], "inertia of rocker": inertia[2], "work on coupler": work,
        "reaction A on crank": solved[0:2] - inertia[0],
    }  # fmt: skip


@pytest.mark.spread(1, *QUICK)
@pytest.mark.parametrize("degrees", [0, 36, 72, 144, 252, 324])
def test_forces_of_the_drawing_are_those_of_the_papers_equations(degrees, tmp_path):
    export_model(durango("off"), tmp_path / "out.dxf", f"{degrees}deg")
    drawn = {name: force for polygon in forces(tmp_path / "out.dxf").values() for name, force in polygon.items()}
    expected = reactions(math.radians(degrees))
    for name, vector in expected.items():
        size, drawn_vector = drawn[name]
        np.testing.assert_allclose(drawn_vector, vector, atol=2e-6 * max(1000, np.hypot(*vector)))
        assert size == pytest.approx(np.hypot(*vector), rel=1e-5)


@pytest.mark.spread(1, *QUICK)
@pytest.mark.parametrize("degrees", range(0, 360, 36))
def test_three_rounds_of_approximation_end_at_the_settled_polygon(degrees, tmp_path):
    """[D], graphical validation: three iterations differ by less than 0.1 % at ten positions of the crank."""
    export_model(durango("on"), tmp_path / "out.dxf", f"{degrees}deg")
    drawn = lines(tmp_path / "out.dxf")
    layer = next(layer for layer in drawn if layer.startswith("~forces group 2") and " round " not in layer)
    settled, bare, last = (drawn[name] for name in (layer, f"{layer} round 0", f"{layer} round 3"))
    size = max(np.linalg.norm(end - start) for start, end in settled)
    settled, bare, last = (np.array([end - start for start, end in shape]) for shape in (settled, bare, last))
    assert np.abs(last - settled).max() < 1e-3 * size
    assert np.abs(last - settled).max() < 1e-2 * np.abs(bare - settled).max()


def test_curves_of_points_are_drawn_over_the_cycle(tmp_path):
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
