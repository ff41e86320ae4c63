"""STEP files: parts, joints and placements against closed forms; torques against models written by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import trunnion
from exchange.step_files import box, turn, turned
from exchange.step_mechanisms import STILL, cardan, four_bar, placed, slider_crank, written
from trunnion.exchange import import_file, model_text
from trunnion.exchange.brep import Geometry
from trunnion.exchange.part21 import Part21

STEEL = 7850.0


def plate(split="seam"):
    """The plate of the theory sheet."""
    shape = box((-20, -15, 0), (220, 15, 12), split)
    shape.feature("bottom", (0, 0, 0), [(8, 0), (8, -12)], "top")
    return shape.feature("bottom", (200, 0, 0), [(10, 0), (10, -12)], "top")


def model(draft, tmp_path, extra=""):
    """The mechanism of an imported draft."""
    path = tmp_path / "model.yaml"
    path.write_text(model_text(draft) + extra)
    return trunnion.read(path)


def stated(tmp_path, text):
    path = tmp_path / "stated.yaml"
    path.write_text(text)
    return trunnion.read(path)


def codes(draft):
    return {finding.code.removeprefix("exchange.") for finding in draft.findings}


def joint(draft, *links):
    """The pair between two links."""
    return next(pair for pair in draft.pairs.values() if set(pair.links) == set(links))


def expect_body(body, parts, scale=1e-3, density=STEEL):
    """A body against closed forms: parts are (shape, matrix, shift) in the unit of the file."""
    moments = [shape.placed(matrix, shift).moments(scale, density) for shape, matrix, shift in parts]
    mass = sum(part[0] for part in moments)
    centre = sum(part[0] * part[1] for part in moments) / mass
    inertia = np.zeros((3, 3))
    for part, at, own in moments:
        off = at - centre
        inertia += own + part * (off @ off * np.eye(3) - np.outer(off, off))
    assert body.mass == pytest.approx(mass, rel=1e-9)
    np.testing.assert_allclose(body.centre, centre, atol=1e-9)
    np.testing.assert_allclose(body.inertia, inertia, atol=1e-9 * np.abs(inertia).max())


# ---- moments --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("split", ["seam", "halves", "none"])
def test_the_plate_of_the_theory_sheet(tmp_path, split):
    body = import_file(written(tmp_path / "a.step", {"plate": (plate(split), *STILL)})).bodies["plate"]
    assert body.mass / STEEL * 1e9 == pytest.approx(80217.34565773529, rel=1e-12)
    assert body.centre[0] * 1e3 == pytest.approx(98.30813645699342, rel=1e-12)
    assert body.inertia[2, 2] / STEEL * 1e15 == pytest.approx(358878138.926531, rel=1e-12)


def shapes(split):
    """Solids with faces of every kind: cones, apexes, balls, fillets and grooves, blind holes."""
    cross = box((-10, -10, -10), (10, 10, 10), split)
    cross.feature(1, (10, 0, 0), [(6, 0), (5, 1, (6, 1)), (5, 10), (4, 11), (0, 11)])
    cross.feature("top", (2, 3, 10), [(3, 0), (3, -5), (0, -7)])
    return {
        "cross": cross,
        "pin": turned([(0, 0), (5, 0), (6, 1), (6, 30), (4, 32, (4, 30)), (4, 40), (0, 44, (0, 40))], split=split),
        "cone": turned([(0, 0), (6, 0), (0, 10)], (1, 1, 0), (3, 2, 1), split),
        "ball": turned([(0, -5), (5, 0, (0, 0)), (0, 5, (0, 0))], (1, 1, 0), (3, 2, 1), split),
        "groove": turned([(0, 0), (10, 0), (10, 5), (8, 7, (10, 7)), (10, 9, (10, 7)), (10, 20), (0, 20)], split=split),
        "bush": turned([(4, 0), (6, 0), (6, 9), (4, 9), (4, 0)], (0, 1, 0), (1, 1, 1), split),
    }


@pytest.mark.parametrize("split", ["seam", "halves", "none"])
@pytest.mark.parametrize("degrees", [False, True])
def test_moments_are_exact_for_every_kind_of_face(tmp_path, split, degrees):
    parts = {name: (shape, *STILL) for name, shape in shapes(split).items()}
    file = Part21(written(tmp_path / "a.step", parts, degrees=degrees))
    geometry = Geometry(file, 1e-3, math.radians(1) if degrees else 1.0)
    for number, (name, (shape, *_)) in zip(file.of("MANIFOLD_SOLID_BREP"), parts.items(), strict=True):
        solid = geometry.solid(number)
        assert not solid.doubts, name
        mass, centre, inertia = shape.moments()
        assert STEEL * solid.moments.volume == pytest.approx(mass, rel=1e-12), name
        np.testing.assert_allclose(solid.moments.centre, centre, atol=1e-12)
        np.testing.assert_allclose(STEEL * solid.moments.inertia, inertia, atol=1e-12 * np.abs(inertia).max())


@settings(max_examples=10, deadline=None)
@given(
    st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda axis: np.linalg.norm(axis) > 0.1),
    st.floats(-3, 3),
    st.tuples(*[st.floats(-500, 500)] * 3),
    st.sampled_from(["seam", "halves", "none"]),
    st.booleans(),
    st.sampled_from(["cross", "pin", "cone", "ball", "groove", "bush"]),
)
def test_turned_shifted_and_mirrored_parts(tmp_path_factory, axis, angle, shift, split, mirrored, name):
    matrix = turn(axis, angle) @ np.diag([1, 1, -1 if mirrored else 1])
    shape = shapes(split)[name].placed(matrix, shift)
    file = Part21(written(tmp_path_factory.mktemp("step") / "a.step", {name: (shape, *STILL)}))
    solid = Geometry(file, 1e-3, 1.0).solid(file.of("MANIFOLD_SOLID_BREP")[0])
    mass, centre, inertia = shape.moments()
    assert not solid.doubts
    assert STEEL * solid.moments.volume == pytest.approx(mass, rel=1e-9)
    np.testing.assert_allclose(solid.moments.centre, centre, atol=1e-9)
    np.testing.assert_allclose(STEEL * solid.moments.inertia, inertia, atol=1e-7 * np.abs(inertia).max())


def test_edges_that_are_splines(tmp_path):
    path = written(tmp_path / "a.step", {"plate": (plate(), *STILL)}, splines=True)
    assert "RATIONAL_B_SPLINE_CURVE" in path.read_text()
    expect_body(import_file(path).bodies["plate"], [(plate(), *STILL)])


# ---- mechanisms -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("split", ["seam", "halves", "none"])
@pytest.mark.parametrize(("rotation", "shift"), [(np.eye(3), (0, 0, 0)), (turn((1, 2, 3), 0.7), (100, -50, 30))])
def test_slider_crank(tmp_path, split, rotation, shift):
    parts = placed(slider_crank(split=split), rotation, shift)
    draft = import_file(written(tmp_path / "a.step", parts), ground="frame", drive="B")
    assert codes(draft) <= {"drive"}
    for name, part in parts.items():
        expect_body(draft.bodies[name], [part])
    sizes = {("crank", "frame"): (10, 10.02, 12), ("crank", "rod"): (8, 8.015, 10), ("rod", "slider"): (6, 6.01, 10)}
    for links, expected in sizes.items():
        pair = joint(draft, *links)
        assert pair.type == "revolute"
        np.testing.assert_allclose(
            [pair.pin_radius, pair.hole_radius, pair.length], 1e-3 * np.array(expected), atol=1e-12
        )
        np.testing.assert_allclose(abs(pair.axis @ rotation[:, 2]), 1, atol=1e-12)
    guide = joint(draft, "frame", "slider")
    assert guide.type == "prismatic"
    np.testing.assert_allclose([guide.pin_radius, guide.hole_radius, guide.length], [0.015, 0.01502, 0.04], atol=1e-9)
    np.testing.assert_allclose(abs(guide.axis @ rotation[:, 0]), 1, atol=1e-9)
    pin = 1e-3 * (np.array(shift) + rotation @ [25, 50 * math.sin(math.pi / 3), 15])
    np.testing.assert_allclose(joint(draft, "crank", "rod").at, pin, atol=1e-12)


FRICTION = "joint_defaults: {friction: 0.1}\n"
KEYS = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


def numbers(*parts, spatial=False):
    """Mass, centre and inertia of shapes (shape, matrix, shift), in closed form, as keys of a link."""
    moved = [shape.placed(matrix, shift) for shape, matrix, shift in parts]
    united = moved[0]
    for other in moved[1:]:
        united.gain(other.volume, other.first, other.second)
    mass, centre, inertia = united.moments()
    middle = ", ".join(f"{float(part):.15g}" for part in centre[: 3 if spatial else 2])
    tensor = ", ".join(f"{key}: {float(inertia[at]):.15e}" for key, at in KEYS.items())
    about = f"{{{tensor}}}" if spatial else f"{float(inertia[2, 2]):.15e}"
    return f"mass: {float(mass):.15g}, centre: [{middle}], inertia: {about}"


def torques(draft, tmp_path, by_hand, extra=FRICTION, steps=48):
    """Drive torques of an imported mechanism and of the one that is written by hand."""
    results = []
    for mechanism in (model(draft, tmp_path, extra), stated(tmp_path, by_hand + extra)):
        result = trunnion.analyse(mechanism, steps)
        assert (result["status"].values <= 2).all()
        results.append(result["drive_effort"].values.ravel())
    return results


def test_torque_of_the_slider_crank_is_that_of_the_model_by_hand(tmp_path):
    shapes = {name: numbers((part[0], *STILL)) for name, part in slider_crank().items()}
    by_hand = f"""trunnion: 1
space: planar
ground: frame
links:
  frame: {{points: {{O: [0, 0], S: {{at: [0, 0], axis: [1, 0]}}}}}}
  crank: {{points: {{O: [0, 0], P: [50 mm, 0]}}, {shapes["crank"]}}}
  rod: {{points: {{P: [0, 0], Q: [200 mm, 0]}}, {shapes["rod"]}}}
  slider: {{points: {{Q: [0, 0], S: {{at: [0, 0], axis: [1, 0]}}}}, {shapes["slider"]}}}
joints:
  O: {{type: revolute, links: [crank, frame], pin: {{radius: 10 mm, length: 12 mm, clearance: 20 um}}}}
  P: {{type: revolute, links: [crank, rod], pin: {{radius: 8 mm, length: 10 mm, clearance: 15 um}}}}
  Q: {{type: revolute, links: [slider, rod], pin: {{radius: 6 mm, length: 10 mm, clearance: 10 um}}}}
  S: {{type: prismatic, links: [frame, slider], guide: {{length: 40 mm, clearance: 20 um}}}}
drivers: {{O: {{speed: -600 rpm, start: -60 deg}}}}
assembly: {{Q: [0.2, 0]}}
"""
    path = written(tmp_path / "a.step", slider_crank())
    draft = import_file(path, ground="frame", drive="B", speed="-600 rpm")
    imported, expected = torques(draft, tmp_path, by_hand)
    np.testing.assert_allclose(imported, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


def test_four_bar_with_loose_pins(tmp_path):
    parts = four_bar()
    draft = import_file(written(tmp_path / "a.step", parts), ground="ground", speed="600 rpm")
    held = {"ground": ["ground"], "crank": ["crank", "pin"], "coupler": ["coupler", "pin-2", "pin-3"]}
    held["rocker"] = ["rocker", "pin-4"]
    assert set(draft.bodies) == set(held)
    for name, members in held.items():
        expect_body(draft.bodies[name], [parts[member] for member in members])
    sizes = {("ground", "crank"): 10.04, ("crank", "coupler"): 10.05, ("coupler", "rocker"): 10.06}
    sizes[("ground", "rocker")] = 10.04
    for links, hole in sizes.items():
        pair = joint(draft, *links)
        np.testing.assert_allclose(
            [pair.pin_radius, pair.hole_radius, pair.length], [5e-3, hole / 2e3, 0.01], atol=1e-12
        )
    assert codes(draft) == {"loose", "drive"}


def test_torque_of_the_four_bar_is_that_of_the_model_by_hand(tmp_path):
    parts = four_bar()
    drawn = {
        name: numbers(*(parts[member] for member in members))
        for name, members in {
            "crank": ("crank", "pin"),
            "coupler": ("coupler", "pin-2", "pin-3"),
            "rocker": ("rocker", "pin-4"),
        }.items()
    }
    b, c = (1e3 * 1e-3 * np.array(parts[name][2])[:2] for name in ("pin-2", "pin-3"))
    b, c = (f"[{float(p[0]):.15g} mm, {float(p[1]):.15g} mm]" for p in (b, c))
    by_hand = f"""trunnion: 1
space: planar
ground: ground
links:
  ground: {{points: {{A: [0, 0], D: [100 mm, 0]}}}}
  crank: {{points: {{A: [0, 0], B: {b}}}, {drawn["crank"]}}}
  coupler: {{points: {{B: {b}, C: {c}}}, {drawn["coupler"]}}}
  rocker: {{points: {{C: {c}, D: [100 mm, 0]}}, {drawn["rocker"]}}}
joints:
  A: {{type: revolute, links: [crank, ground], pin: {{radius: 5 mm, length: 10 mm, clearance: 20 um}}}}
  B: {{type: revolute, links: [coupler, crank], pin: {{radius: 5 mm, length: 10 mm, clearance: 25 um}}}}
  C: {{type: revolute, links: [coupler, rocker], pin: {{radius: 5 mm, length: 10 mm, clearance: 30 um}}}}
  D: {{type: revolute, links: [rocker, ground], pin: {{radius: 5 mm, length: 10 mm, clearance: 20 um}}}}
drivers: {{A: {{speed: -600 rpm}}}}
"""
    draft = import_file(written(tmp_path / "a.step", parts), ground="ground", speed="-600 rpm")
    imported, expected = torques(draft, tmp_path, by_hand)
    np.testing.assert_allclose(imported, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


def test_cardan(tmp_path):
    parts = cardan()
    draft = import_file(written(tmp_path / "a.step", parts), ground="frame")
    for name, part in parts.items():
        expect_body(draft.bodies[name], [part])
    expected = {
        ("input", "frame"): ("revolute", 10, 10.02, 20),
        ("output", "frame"): ("cylindrical", 10, 10.03, 20),
        ("input", "cross"): ("cylindrical", 5, 5.01, 38),  # two lugs of 8 mm, 46 mm from end to end: 23 − 15 each
        ("cross", "output"): ("cylindrical", 5, 5.01, 38),
    }
    for links, (kind, *sizes) in expected.items():
        pair = joint(draft, *links)
        sizes[2] = 46 if "cross" in links else sizes[2]
        assert pair.type == kind
        np.testing.assert_allclose([pair.pin_radius, pair.hole_radius, pair.length], 1e-3 * np.array(sizes), atol=1e-12)
    drawn = {name: numbers(part, spatial=True) for name, part in parts.items()}
    c, s = math.cos(math.pi / 6), math.sin(math.pi / 6)
    axes = {"A": (1, 0, 0), "B": (0, 0, 1), "C": (-s, c, 0), "D": (c, s, 0)}
    at = {"A": np.array([-0.05, 0, 0]), "B": np.zeros(3), "C": np.zeros(3), "D": np.array([0.05 * c, 0.05 * s, 0])}

    def point(name):
        place, axis = (", ".join(f"{float(part):.15g}" for part in vector) for vector in (at[name], axes[name]))
        return f"{name}: {{at: [{place}], axis: [{axis}]}}"

    by_hand = f"""trunnion: 1
space: spatial
ground: frame
links:
  frame: {{points: {{{point("A")}, {point("D")}}}}}
  input: {{points: {{{point("A")}, {point("B")}}}, {drawn["input"]}}}
  cross: {{points: {{{point("B")}, {point("C")}}}, {drawn["cross"]}}}
  output: {{points: {{{point("C")}, {point("D")}}}, {drawn["output"]}}}
joints:
  A: {{type: revolute, links: [input, frame], pin: {{radius: 10 mm, length: 20 mm, clearance: 20 um}}}}
  B: {{type: cylindrical, links: [cross, input], pin: {{radius: 5 mm, length: 46 mm, clearance: 10 um}}}}
  C: {{type: cylindrical, links: [cross, output], pin: {{radius: 5 mm, length: 46 mm, clearance: 10 um}}}}
  D: {{type: cylindrical, links: [output, frame], pin: {{radius: 10 mm, length: 20 mm, clearance: 30 um}}}}
drivers: {{A: {{speed: 600 rpm}}}}
"""
    shaft = joint(draft, "input", "frame").name
    draft = import_file(tmp_path / "a.step", ground="frame", drive=shaft, speed="600 rpm")
    imported, expected = torques(draft, tmp_path, by_hand, steps=24)
    np.testing.assert_allclose(imported, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())
