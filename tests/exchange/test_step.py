"""STEP files: parts, joints and placements against closed forms; torques against models written by hand."""

from __future__ import annotations

import math
import re
import time

import numpy as np
import pytest
import trunnion
from exchange.step_files import StepFile, box, prism, turn, turned
from exchange.step_mechanisms import STILL, bar, boss, cardan, four_bar, placed, slider_crank, written
from hypothesis import given, settings
from hypothesis import strategies as st
from trunnion.errors import MechanismError
from trunnion.exchange import ExportOptions, export_model, import_file, model_text
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
    draft = import_file(written(tmp_path / "a.step", parts, degrees=degrees))
    file = Part21(tmp_path / "a.step")
    geometry = Geometry(file, 1e-3, math.radians(1) if degrees else 1.0)
    for number, (name, (shape, *_)) in zip(file.of("MANIFOLD_SOLID_BREP"), parts.items(), strict=True):
        solid = geometry.solid(number)
        assert not solid.doubts, name
        mass, centre, inertia = shape.moments()
        assert STEEL * solid.moments.volume == pytest.approx(mass, rel=1e-12), name
        np.testing.assert_allclose(solid.moments.centre, centre, atol=1e-12)
        np.testing.assert_allclose(STEEL * solid.moments.inertia, inertia, atol=1e-12 * np.abs(inertia).max())
    assert draft.source == "a.step"


@settings(max_examples=15, deadline=None)
@given(
    st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda axis: np.linalg.norm(axis) > 0.1),
    st.floats(-3, 3),
    st.tuples(*[st.floats(-500, 500)] * 3),
    st.sampled_from(["seam", "halves", "none"]),
    st.booleans(),
)
def test_turned_shifted_and_mirrored_parts(tmp_path_factory, axis, angle, shift, split, mirrored):
    matrix = turn(axis, angle) @ np.diag([1, 1, -1 if mirrored else 1])
    made = {name: (shape.placed(matrix, shift), *STILL) for name, shape in shapes(split).items()}
    path = written(tmp_path_factory.mktemp("step") / "a.step", made | {"plate": (plate(split).placed(matrix, shift), *STILL)})
    file = Part21(path)
    geometry = Geometry(file, 1e-3, 1.0)
    for number, shape in zip(file.of("MANIFOLD_SOLID_BREP"), [*shapes(split).values(), plate(split)], strict=True):
        solid = geometry.solid(number)
        mass, centre, inertia = shape.placed(matrix, shift).moments()
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
        np.testing.assert_allclose([pair.pin_radius, pair.hole_radius, pair.length], 1e-3 * np.array(expected), atol=1e-12)
        np.testing.assert_allclose(abs(pair.axis @ rotation[:, 2]), 1, atol=1e-12)
    guide = joint(draft, "frame", "slider")
    assert guide.type == "prismatic"
    np.testing.assert_allclose([guide.pin_radius, guide.hole_radius, guide.length], [0.015, 0.01502, 0.04], atol=1e-9)
    np.testing.assert_allclose(abs(guide.axis @ rotation[:, 0]), 1, atol=1e-9)
    pin = 1e-3 * (np.array(shift) + rotation @ [25, 50 * math.sin(math.pi / 3), 15])
    np.testing.assert_allclose(joint(draft, "crank", "rod").at, pin, atol=1e-12)


FRICTION = "joint_defaults: {friction: 0.1}\n"
KEYS = ("xx", (0, 0)), ("yy", (1, 1)), ("zz", (2, 2)), ("xy", (0, 1)), ("xz", (0, 2)), ("yz", (1, 2))


def hand_written_slider_crank():
    """The slider-crank in local frames with masses in closed form."""
    lines = ["trunnion: 1", "name: By hand", "space: planar", "links:"]
    lines.append("  frame: {points: {O: [0, 0], S: {at: [0, 0], axis: [1, 0]}}}")
    points = {
        "crank": "{O: [0, 0], P: [50 mm, 0]}",
        "rod": "{P: [0, 0], Q: [200 mm, 0]}",
        "slider": "{Q: [0, 0], S: {at: [0, 0], axis: [1, 0]}}",
    }
    for name, text in points.items():
        mass, centre, inertia = slider_crank()[name][0].moments()
        numbers = f"mass: {mass!r}, centre: [{centre[0]!r}, {centre[1]!r}], inertia: {inertia[2, 2]!r}"
        lines.append(f"  {name}: {{points: {text}, {re.sub(r'np.float64.([^)]*).', r'{}', numbers).format(*_floats(numbers))}}}")
    lines += [
        "joints:",
        "  O: {type: revolute, links: [crank, frame], pin: {radius: 10 mm, length: 12 mm, clearance: 20 um}}",
        "  P: {type: revolute, links: [crank, rod], pin: {radius: 8 mm, length: 10 mm, clearance: 15 um}}",
        "  Q: {type: revolute, links: [slider, rod], pin: {radius: 6 mm, length: 10 mm, clearance: 10 um}}",
        "  S: {type: prismatic, links: [frame, slider], guide: {length: 40 mm, clearance: 20 um}}",
        "drivers: {O: {speed: 60 rpm}}",
        "assembly: {Q: [0.2, 0]}",
    ]
    return "\n".join(lines) + "\n"
