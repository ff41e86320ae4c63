"""STEP files: parts, joints and placements against closed forms; torques against models written by hand."""

import json
import math
import re
import subprocess
import sys
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

import trunnion
from exchange.step_files import UNITS, Shape, StepFile, box, prism, turn, turned
from exchange.step_mechanisms import STILL, bar, boss, cardan, four_bar, placed, slider_crank, written
from trunnion.cli.app import app
from trunnion.errors import MechanismError
from trunnion.exchange import export_model, import_file, model_text
from trunnion.exchange.brep import Geometry, Part21, mass_of
from trunnion.exchange.draft import positions_of
from trunnion.exchange.step_assembly import Assembly

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


@pytest.mark.parametrize(
    ("split", "unit", "splines"), [("seam", "mm", True), ("halves", "in", False), ("none", "m", False)]
)
def test_the_plate_of_the_theory_sheet(tmp_path, split, unit, splines):
    size, path = UNITS[unit], written(tmp_path / "a.step", {"plate": (plate(split), *STILL)}, unit, splines=splines)
    assert ("RATIONAL_B_SPLINE_CURVE" in path.read_text()) == splines
    body = import_file(path).bodies["plate"]
    assert body.mass / STEEL / size**3 == pytest.approx(80217.34565773529, rel=1e-12)
    assert body.centre[0] / size == pytest.approx(98.30813645699342, rel=1e-12)
    assert body.inertia[2, 2] / STEEL / size**5 == pytest.approx(358878138.926531, rel=1e-12)


def shapes(split):
    """Solids with faces of every kind: cones, apexes, balls, fillets and grooves, blind holes."""
    cross = box((-10, -10, -10), (10, 10, 10), split)
    cross.feature(1, (10, 0, 0), [(6, 0), (5, 1, (6, 1)), (5, 10), (4, 11), (0, 11)])
    cross.feature("top", (2, 3, 10), [(3, 0), (3, -5), (0, -7)])
    root, tube = math.sqrt(3), (10, 3)  # an O-ring, whose moments are those of three pieces: one face, with its seams
    ring = turned([(12, 3), (9, 3 + root, tube), (9, 3 - root, tube), (12, 3, tube)], origin=(3, 2, -2), split=split)
    middle, up, across, start = np.array([3, 2, 1.0]), np.eye(3)[2], np.eye(3)[1], np.array([15, 2, 1.0])
    seams = [("circle", middle, up, 12, start, start), ("circle", start - [2, 0, 0], -across, 2, start, start)]
    seams += [(kind, at, -axis, *rest) for kind, at, axis, *rest in seams]
    loops = [] if split == "none" else [seams]
    ring.faces = [{"surface": ("TOROIDAL_SURFACE", middle, up, 10, 2), "sense": True, "loops": loops}]
    return {
        "ring": ring,
        "cross": cross,
        "pin": turned([(0, 0), (5, 0), (6, 1), (6, 30), (4, 32, (4, 30)), (4, 40), (0, 44, (0, 40))], split=split),
        "cone": turned([(0, 0), (6, 0), (0, 10)], (1, 1, 0), (3, 2, 1), split),
        "ball": turned([(0, -5), (5, 0, (0, 0)), (0, 5, (0, 0))], (1, 1, 0), (3, 2, 1), split),
        "groove": turned([(0, 0), (10, 0), (10, 5), (8, 7, (10, 7)), (10, 9, (10, 7)), (10, 20), (0, 20)], split=split),
        "bush": turned([(4, 0), (6, 0), (6, 9), (4, 9), (4, 0)], (0, 1, 0), (1, 1, 1), split),
    }


def exact(path, parts, within, of_inertia, angle=1.0):
    """The moments of all solids of a file are those of the shapes in closed form."""
    file = Part21(path)
    geometry = Geometry(file, 1e-3, angle)
    for number, (name, shape) in zip(file.of("MANIFOLD_SOLID_BREP"), parts.items(), strict=True):
        solid = geometry.solid(number)
        assert not solid.doubts, name
        mass, centre, inertia = shape.moments()
        found = mass_of(STEEL * solid.moments)
        assert found[0] == pytest.approx(mass, rel=within), name
        np.testing.assert_allclose(found[1], centre, atol=within)
        np.testing.assert_allclose(found[2], inertia, atol=of_inertia * np.abs(inertia).max())


@pytest.mark.spread(2)
@pytest.mark.parametrize("split", ["seam", "halves", "none"])
@pytest.mark.parametrize("degrees", [False, True])
def test_moments_are_exact_for_every_kind_of_face(tmp_path, split, degrees):
    parts = shapes(split)
    path = written(tmp_path / "a.step", {name: (shape, *STILL) for name, shape in parts.items()}, degrees=degrees)
    exact(path, parts, 1e-12, 1e-12, math.radians(1) if degrees else 1.0)


@settings(max_examples=10, deadline=None)
@given(
    st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda axis: np.linalg.norm(axis) > 0.1),
    st.floats(-3, 3),
    st.tuples(*[st.floats(-500, 500)] * 3),
    st.sampled_from(["seam", "halves", "none"]),
    st.booleans(),
)
def test_turned_shifted_and_mirrored_parts(tmp_path_factory, axis, angle, shift, split, mirrored):
    matrix = turn(axis, angle) @ np.diag([1, 1, -1 if mirrored else 1])
    parts = {name: shape.placed(matrix, shift) for name, shape in shapes(split).items()}
    exact(
        written(tmp_path_factory.mktemp("step") / "a.step", {n: (s, *STILL) for n, s in parts.items()}),
        parts,
        1e-9,
        1e-7,
    )


def test_a_solid_that_is_not_read_exactly_is_left_to_its_mesh(tmp_path, monkeypatch):
    """A loop of another kind is a doubt, not a hole that is none; what the mesh came to is said as it is."""
    path = written(tmp_path / "a.step", {"plate": (plate(), *STILL), "pin": (shapes("seam")["pin"], *STILL)})
    path.write_text(path.read_text().replace("MANIFOLD_SOLID_BREP", "FACETED_BREP"))
    assert set(import_file(path).bodies) == {"plate", "pin"}
    path.write_text(re.sub(r"EDGE_LOOP\('',\(.*?\)\)", "POLY_LOOP('',())", path.read_text()))
    meshed = subprocess.CompletedProcess([], 0, "[0, [0, 0, 0], [[0, 0, 0], [0, 0, 0], [0, 0, 0]]]\n" * 2)
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: meshed)
    draft = import_file(path)
    assert set(draft.bodies) == {"plate", "pin"}
    said = "".join(finding.what for finding in draft.findings)
    assert "a loop POLY_LOOP" in said
    assert "encloses no volume" in said


# ---- assemblies as they are drawn ---------------------------------------------------------------------------------

Parts = dict[str, tuple[Any, ...]]


@dataclass
class Case:
    """An assembly and what is read of it: parts of each body, pairs as type, pin and hole radius, length, mm."""

    parts: Parts
    ground: str
    codes: set[str]
    bodies: dict[str, list[str]]
    pairs: dict[tuple[str, str], tuple[Any, ...]]

    def check(self, path):
        draft = import_file(path, ground=self.ground)
        assert codes(draft) == self.codes
        assert set(draft.bodies) == set(self.bodies)
        for name, members in self.bodies.items():
            expect_body(draft.bodies[name], [self.parts[member] for member in members])
        assert {frozenset(pair.links) for pair in draft.pairs.values()} == {frozenset(links) for links in self.pairs}
        for links, (kind, *sizes) in self.pairs.items():
            pair = joint(draft, *links)
            found = [pair.pin_radius, pair.hole_radius, pair.length][: len(sizes)]
            assert pair.type == kind
            np.testing.assert_allclose(found, 1e-3 * np.array(sizes), atol=1e-9)
        return draft


def loose_pins():
    bodies = {"ground": ["ground"], "crank": ["crank", "pin"], "coupler": ["coupler", "pin-2", "pin-3"]}
    bodies["rocker"] = ["rocker", "pin-4"]
    sizes = {("ground", "crank"): 5.02, ("crank", "coupler"): 5.025, ("coupler", "rocker"): 5.03}
    sizes["ground", "rocker"] = 5.02
    pairs = {links: ("revolute", 5, hole, 10) for links, hole in sizes.items()}
    return Case(four_bar(), "ground", {"fixed", "drive"}, bodies, pairs)


def bolted(screws):
    """A flange on a plate: four screws through equal holes, each a use of one part; they move as one."""
    corners = [(20, 20), (-20, 20), (-20, -20), (20, -20)]

    def flange(low, high):
        shape = box((-30, -30, low), (30, 30, high))
        for x, y in corners:
            shape.feature("bottom", (x, y, low), [(3.3, 0), (3.3, low - high)], "top")
        return shape

    screw = turned([(0, 0), (3, 0), (3, 20), (5, 20), (5, 24), (0, 24)])
    top = flange(0, 10).feature("top", (0, 0, 10), [(8, 0), (8, 15), (0, 15)])
    parts = {"base": (flange(-10, 0), *STILL), "flange": (top, *STILL), "arm": (bar(50, [(0, 16.05)], 10, 20), *STILL)}
    if screws:
        parts |= {f"screw{n}": (screw, np.eye(3), np.array([*corner, -10.0])) for n, corner in enumerate(corners)}
    one = [name for name in parts if name != "arm"]
    pairs = {("base", "arm"): ("revolute" if screws else "cylindrical", 8, 8.025, 10)}  # between plate and heads
    return Case(parts, "base", {"drive", "fixed"}, {"base": one, "arm": ["arm"]}, pairs)


def in_hole(hole, pin, said, kind=()):
    """An arm with a pin on a plate with a hole; fixed where no kind of pair is stated and nothing else is said."""
    parts = {"base": (bar(80, [(0, hole)], 0, 10), *STILL)}
    parts["arm"] = (boss(bar(60, [], 10, 20), "bottom", (0, 0, 10), pin, 10), *STILL)
    bodies = {"base": ["base"], "arm": ["arm"]} if kind else {"base": ["base", "arm"]}
    return Case(parts, "base", said, bodies, {("base", "arm"): kind} if kind else {})


def around():
    """The foot is fixed to the frame it stands under, once, and the stray is left out."""
    parts = slider_crank() | {"foot": (box((-20, -20, -30), (20, 20, -12)), *STILL)}
    parts["stray"] = (box((0, 0, 0), (10, 10, 10)), np.eye(3), np.array([0, 900, 0]))
    bodies = {"frame": ["frame", "foot"], **{name: [name] for name in ("crank", "rod", "slider")}}
    return Case(parts, "frame", {"drive", "fixed", "unconnected"}, bodies, SLIDER_CRANK)


def ball():
    pin = turned([(0, -30), (4, -30), (4, -3), (5, 0, (0, 0)), (0, 5, (0, 0))])
    hollow, height = box((-10, -10, -6), (10, 10, 10)), math.sqrt(5.02**2 - 4.5**2)
    hollow.feature("bottom", (0, 0, -6), [(4.5, 0), (4.5, -6 + height), (0, -11.02, (0, -6))])
    parts = {"ball": (pin, *STILL), "cup": (hollow, *STILL)}
    return Case(parts, "cup", {"gap"}, {"ball": ["ball"], "cup": ["cup"]}, {("ball", "cup"): ("spherical", 5, 5.02)})


def universal():
    pairs = {
        ("input", "frame"): ("revolute", 10, 10.02, 20),
        ("output", "frame"): ("cylindrical", 10, 10.03, 20),
        ("input", "cross"): ("cylindrical", 5, 5.01, 46),  # two lugs of 8 mm, from end to end
        ("cross", "output"): ("cylindrical", 5, 5.01, 46),
    }
    return Case(cardan(), "frame", {"drive"}, {name: [name] for name in cardan()}, pairs)


SLIDER_CRANK = {
    ("crank", "frame"): ("revolute", 10, 10.02, 12),
    ("crank", "rod"): ("revolute", 8, 8.015, 10),
    ("rod", "slider"): ("revolute", 6, 6.01, 10),
    ("frame", "slider"): ("prismatic", 15, 15.02, 40),
}
CASES = {
    "loose pins": loose_pins,
    "cardan": universal,
    "bolted": lambda: bolted(True),
    "a pattern of holes": lambda: bolted(False),
    "play": lambda: in_hole(10.9, 10, {"drive"}, ("cylindrical", 5, 5.45, 10)),
    "too wide": lambda: in_hole(11.2, 10, {"gap", "fixed"}),
    "pressed": lambda: in_hole(9.96, 10, {"fixed"}),
    "a thread": lambda: in_hole(6.8, 8, {"fixed"}),
    "through": lambda: in_hole(5, 10, {"gap", "fixed"}),
    "touching and far away": around,
    "a ball": ball,
}


@pytest.mark.parametrize("name", CASES)
def test_an_assembly_is_read_as_it_is_drawn(name, tmp_path):
    case = CASES[name]()
    case.check(written(tmp_path / "a.step", case.parts))


@pytest.mark.spread(2)
@pytest.mark.parametrize("split", ["seam", "halves", "none"])
@pytest.mark.parametrize(("rotation", "shift"), [(np.eye(3), (0, 0, 0)), (turn((1, 2, 3), 0.7), (100, -50, 30))])
def test_slider_crank(tmp_path, split, rotation, shift):
    parts = placed(slider_crank(split=split), rotation, shift)
    case = Case(parts, "frame", {"drive"}, {name: [name] for name in parts}, SLIDER_CRANK)
    draft = case.check(written(tmp_path / "a.step", parts))
    for links, (kind, *_) in SLIDER_CRANK.items():
        along = abs(joint(draft, *links).axis @ rotation[:, 0 if kind == "prismatic" else 2])
        np.testing.assert_allclose(along, 1, atol=1e-9)
    pin = 1e-3 * (np.array(shift) + rotation @ [25, 50 * math.sin(math.pi / 3), 15])
    np.testing.assert_allclose(joint(draft, "crank", "rod").at, pin, atol=1e-12)


def test_a_piston_in_its_bore_slides(tmp_path):
    """The slider-crank with a round slider; the frame is a part of two solids."""
    parts = slider_crank()
    x = parts["slider"][2][0]
    plate_ = box((-30, -40, -12), (30, 40, 0)).feature("bottom", (0, 0, -12), [(10.02, 0), (10.02, -12)], "top")
    block = box((x + 30, -30, -30), (x + 60, 30, 30)).feature(1, (x + 60, 0, 0), [(12.02, 0), (12.02, -30)], 3)
    head = box((-10, -14, -10), (10, 14, 10)).feature("bottom", (0, 0, -10), [(6.01, 0), (6.01, -20)], "top")
    boss(head, 1, (10, 0, 0), 24, 60)
    rod = boss(bar(200, [(0, 16.03)], 10, 20, 12), "bottom", (200, 0, 10), 12, 20)
    file = StepFile()
    frame = file.part("frame", plate_, block)
    uses = [(file.part("crank", parts["crank"][0]), *parts["crank"][1:]), (file.part("rod", rod), *parts["rod"][1:])]
    file.assembly("engine", (frame, *STILL), *uses, (file.part("piston", head), np.eye(3), parts["slider"][2]))
    draft = import_file(file.write(tmp_path / "a.step"), ground="frame")
    pair = joint(draft, "frame", "piston")
    assert pair.type == "prismatic"
    np.testing.assert_allclose([pair.pin_radius, pair.hole_radius, pair.length], [0.012, 0.01202, 0.03], atol=1e-12)
    assert codes(draft) == {"drive", "rigid"}


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


def slider_crank_by_hand():
    shapes = {name: numbers((part[0], *STILL)) for name, part in slider_crank().items()}
    return f"""trunnion: 1
space: planar
ground: frame
links:
  frame: {{points: {{O: [0, 0], S: {{at: [0, 0], axis: [1, 0]}}}}}}
  crank: {{points: {{O: [0, 0], P: [50 mm, 0]}}, {shapes["crank"]}}}
  rod: {{points: {{P: [0, 0], Q: [200 mm, 0]}}, {shapes["rod"]}}}
  slider: {{points: {{Q: [0, 0], S: {{at: [0, 0], axis: [1, 0]}}}}, {shapes["slider"]}}}
joints:
  O: {{type: revolute, links: [frame, crank], pin: {{radius: 10 mm, length: 12 mm, clearance: 20 um}}}}
  P: {{type: revolute, links: [crank, rod], pin: {{radius: 8 mm, length: 10 mm, clearance: 15 um}}}}
  Q: {{type: revolute, links: [slider, rod], pin: {{radius: 6 mm, length: 10 mm, clearance: 10 um}}}}
  S: {{type: prismatic, links: [frame, slider], guide: {{length: 40 mm, clearance: 20 um}}}}
drivers: {{O: {{speed: 600 rpm, start: 60 deg}}}}
assembly: {{Q: [0.2, 0]}}
"""


def cardan_by_hand():
    drawn = {name: numbers(part, spatial=True) for name, part in cardan().items()}
    c, s = math.cos(math.pi / 6), math.sin(math.pi / 6)
    axes = {"A": (1, 0, 0), "B": (0, 0, 1), "C": (-s, c, 0), "D": (c, s, 0)}
    at = {"A": np.array([-0.05, 0, 0]), "B": np.zeros(3), "C": np.zeros(3), "D": np.array([0.05 * c, 0.05 * s, 0])}

    def point(name):
        place, axis = (", ".join(f"{float(part):.15g}" for part in vector) for vector in (at[name], axes[name]))
        return f"{name}: {{at: [{place}], axis: [{axis}]}}"

    return f"""trunnion: 1
space: spatial
ground: frame
links:
  frame: {{points: {{{point("A")}, {point("D")}}}}}
  input: {{points: {{{point("A")}, {point("B")}}}, {drawn["input"]}}}
  cross: {{points: {{{point("B")}, {point("C")}}}, {drawn["cross"]}}}
  output: {{points: {{{point("C")}, {point("D")}}}, {drawn["output"]}}}
joints:
  A: {{type: revolute, links: [frame, input], pin: {{radius: 10 mm, length: 20 mm, clearance: 20 um}}}}
  B: {{type: cylindrical, links: [cross, input], pin: {{radius: 5 mm, length: 46 mm, clearance: 10 um}}}}
  C: {{type: cylindrical, links: [cross, output], pin: {{radius: 5 mm, length: 46 mm, clearance: 10 um}}}}
  D: {{type: cylindrical, links: [output, frame], pin: {{radius: 10 mm, length: 20 mm, clearance: 30 um}}}}
drivers: {{A: {{speed: 600 rpm}}}}
"""


@pytest.mark.parametrize(
    ("parts", "by_hand", "shaft", "steps"),
    [(slider_crank, slider_crank_by_hand, "crank", 48), (cardan, cardan_by_hand, "input", 24)],
)
def test_torque_is_that_of_the_model_by_hand(parts, by_hand, shaft, steps, tmp_path):
    path = written(tmp_path / "a.step", parts())
    drive = joint(import_file(path, ground="frame"), shaft, "frame").name
    draft = import_file(path, ground="frame", drive=drive, speed="600 rpm")
    (tmp_path / "by-hand.yaml").write_text(by_hand() + FRICTION)
    mechanisms = model(draft, tmp_path, FRICTION), trunnion.read(tmp_path / "by-hand.yaml")
    results = [trunnion.analyse(mechanism, steps) for mechanism in mechanisms]
    assert all((result["status"].values <= 2).all() for result in results)
    imported, expected = (result["drive_effort"].values for result in results)
    np.testing.assert_allclose(imported, expected, rtol=1e-6, atol=1e-6 * np.abs(expected).max())


def test_a_part_used_twice_is_two_links_and_twins_are_one(tmp_path):
    """A rocker whose two side plates are uses of one part; the pins are of the crank and the ground."""
    parts = four_bar()
    shape, matrix, shift = parts["rocker"]
    parts["pin-3"] = (turned([(0, 0), (5, 0), (5, 40), (0, 40)]), np.eye(3), parts["pin-3"][2])
    parts["pin-4"] = (turned([(0, 0), (5, 0), (5, 40), (0, 40)]), np.eye(3), parts["pin-4"][2])
    file = StepFile()
    made = {name: file.part(name, part) for name, (part, *_) in parts.items()}
    uses = [(made[name], *place) for name, (_, *place) in parts.items()]
    file.assembly("fixed", *uses, (made["rocker"], matrix, shift + np.array([0, 0, 20])))
    draft = import_file(file.write(tmp_path / "a.step"), ground="ground")
    assert set(draft.bodies) == {"ground", "crank", "coupler", "rocker"}
    assert draft.bodies["rocker"].mass > 1.9 * STEEL * shape.volume * 1e-9
    assert "fixed" in codes(draft)
    mechanism = model(draft, tmp_path)
    assert (trunnion.analyse(mechanism, 12)["status"].values <= 2).all()


def test_other_layouts_of_the_text(tmp_path):
    """Blanks, comments, line breaks, entities in any order, texts with brackets and semicolons, unicode."""
    parts = slider_crank()
    path = written(tmp_path / "a.step", parts)
    head, _, data = path.read_text().partition("DATA;\n")
    lines = data.split("ENDSEC")[0].splitlines()
    spaced = [re.sub(r"([(),=])", r" \1\n ", line) + " /* a comment; with ( */" for line in lines[::-1]]
    text = "\n".join(spaced).replace("'rod'", "'Pleuel \\X2\\00FC\\X0\\;(''1'') é'")
    path.write_text(f"{head}DATA;\n{text}\nENDSEC;\nEND-ISO-10303-21;\n", encoding="utf-8")
    draft = import_file(path, ground="frame")
    assert set(draft.bodies) == {"frame", "crank", "Pleuel ü;('1') é", "slider"}
    expect_body(draft.bodies["Pleuel ü;('1') é"], [parts["rod"]])
    assert len(draft.pairs) == 4
    assert (trunnion.analyse(model(draft, tmp_path), 4)["status"].values <= 2).all()


def test_a_sub_assembly_is_one_rigid_link_at_its_place(tmp_path):
    """A crank with its pressed pin, nested two deep; the mechanism lies turned in an assembly of its own."""
    parts = slider_crank()
    file = StepFile()
    base, rod, slider = (file.part(name, parts[name][0]) for name in ("frame", "rod", "slider"))
    disc = file.part("disc", bar(50, [(50, 16)], 0, 10))
    pins = file.part("pins", turned([(0, 0), (8, 0), (8, 20), (0, 20)]))
    shaft = file.part("shaft", turned([(0, -12), (10, -12), (10, 0), (0, 0)]))
    inner = file.assembly("inner", (disc, *STILL), (pins, np.eye(3), np.array([50.0, 0, 0])))
    crank = file.assembly("crank", (inner, turn((0, 0, 1), 0.4), np.zeros(3)), (shaft, *STILL))
    angle = parts["crank"][1] @ turn((0, 0, 1), -0.4)
    top = file.assembly(
        "top", (base, *parts["frame"][1:]), (crank, angle, np.zeros(3)), (rod, *parts["rod"][1:]),
        (slider, *parts["slider"][1:]),
    )  # fmt: skip
    file.assembly("outer", (top, turn((0, 1, 1), 0.3), np.array([5.0, 6, 7])))
    draft = import_file(file.write(tmp_path / "a.step"), ground="frame")
    assert set(draft.bodies) == {"frame", "crank", "rod", "slider"}
    matrix = turn((0, 1, 1), 0.3)
    crank_shapes = [
        (bar(50, [(50, 16)], 0, 10), matrix @ parts["crank"][1], (5, 6, 7)),
        (turned([(0, 0), (8, 0), (8, 20), (0, 20)]), matrix @ parts["crank"][1],
         matrix @ parts["crank"][1] @ [50, 0, 0] + [5, 6, 7]),
        (turned([(0, -12), (10, -12), (10, 0), (0, 0)]), matrix, (5, 6, 7)),
    ]  # fmt: skip
    expect_body(draft.bodies["crank"], crank_shapes)
    assert len(draft.pairs) == 4
    assert [finding.severity for finding in draft.findings if finding.code == "exchange.rigid"] == ["warning"]


def test_voids_bent_bars_and_mirroring_placements(tmp_path):
    """A hollow, a quarter of a torus, and a part placed by a mirroring operator through a mapped item."""
    file = StepFile()
    hollow = file.solid(box((0, 0, 0), (20, 20, 20)))
    void = file.solid(box((5, 5, 5), (10, 15, 12)))
    shells = [re.search(r"#(\d+)\)$", file.lines[solid - 1])[1] for solid in (hollow, void)]
    turned_in = file(f"ORIENTED_CLOSED_SHELL('',*,#{shells[1]},.F.)")
    file.lines[hollow - 1] = f"BREP_WITH_VOIDS('',#{shells[0]},(#{turned_in}))"
    block = file.product("block", [hollow])
    wedge = prism([(0, 0), (30, 0), (0, 10)], 0, 5)
    drawn = file.part("wedge", wedge)
    x, y, z = (file.vector("DIRECTION", axis) for axis in np.eye(3) * [1, 1, -1])
    origin = file.vector("CARTESIAN_POINT", (100, 0, 0))
    operator = file(f"CARTESIAN_TRANSFORMATION_OPERATOR_3D('',$,'',#{x},#{y},#{origin},1.,#{z})")
    source = file(f"REPRESENTATION_MAP(#{drawn[2]},#{drawn[1]})")
    top = file.product("top", [file(f"MAPPED_ITEM('',#{source},#{operator})")], "SHAPE_REPRESENTATION")
    file(f"NEXT_ASSEMBLY_USAGE_OCCURRENCE('1','','',#{top[0]},#{drawn[0]},$)")
    file.assembly("all", (block, *STILL), (top, *STILL))
    draft = import_file(file.write(tmp_path / "a.step"))
    outer, inner = box((0, 0, 0), (20, 20, 20)), box((5, 5, 5), (10, 15, 12))
    outer.gain(-inner.volume, -inner.first, -inner.second)
    expect_body(draft.bodies["block"], [(outer, *STILL)])
    expect_body(draft.bodies["top"], [(wedge, np.diag([1, 1, -1]), (100, 0, 0))])

    ring, tube = 20.0, 4.0
    bend = StepFile()
    ends = [(np.array([ring, 0, 0.0]), np.array([0, -1.0, 0])), (np.array([0, ring, 0.0]), np.array([-1.0, 0, 0]))]
    faces, back = [], []
    for centre, normal in ends:
        start = centre + tube * np.array([0, 0, 1.0])
        circle = ("circle", centre, normal, tube, start, start)
        faces.append({"surface": ("PLANE", centre, normal), "sense": True, "loops": [[circle]]})
        back.append([("circle", centre, -normal, tube, start, start)])
    bent = ("TOROIDAL_SURFACE", np.zeros(3), np.array([0, 0, 1.0]), ring, tube)
    faces.append({"surface": bent, "sense": True, "loops": back})
    bend.part("bend", Shape(faces))
    body = import_file(bend.write(tmp_path / "b.step")).bodies["bend"]
    volume = math.pi * tube**2 * math.pi / 2 * ring
    assert body.mass == pytest.approx(STEEL * volume * 1e-9, rel=1e-12)
    middle = math.pi * tube**2 * (ring**2 + tube**2 / 4) / volume  # ∬ r² cos φ dA dφ over a quarter turn
    np.testing.assert_allclose(1e3 * body.centre, [middle, middle, 0], atol=1e-9)


def test_density_of_the_file_goes_before_that_of_the_option(tmp_path):
    file = StepFile()
    part = file.part("plate", plate())
    gram, centi = (
        file("(MASS_UNIT()NAMED_UNIT(*)SI_UNIT($,.GRAM.))"),
        file("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.CENTI.,.METRE.))"),
    )
    one, three = (file(f"DERIVED_UNIT_ELEMENT(#{unit},{power}.)") for unit, power in ((gram, 1), (centi, -3)))
    unit = file(f"DERIVED_UNIT((#{one},#{three}))")
    item = file(f"MEASURE_REPRESENTATION_ITEM('density measure',POSITIVE_RATIO_MEASURE(2.7),#{unit})")
    held = file(f"REPRESENTATION('density',(#{item}),#{file.context})")
    owner = file(f"PROPERTY_DEFINITION('material property','density',#{part[0]})")
    file(f"PROPERTY_DEFINITION_REPRESENTATION(#{owner},#{held})")
    body = import_file(file.write(tmp_path / "a.step"), material="brass").bodies["plate"]
    assert body.mass == pytest.approx(2700 * 80217.34565773529e-9)
    plain = import_file(written(tmp_path / "b.step", {"plate": (plate(), *STILL)}), material="brass").bodies["plate"]
    assert plain.mass == pytest.approx(8500 * 80217.34565773529e-9)


CLASS = ["LIMITS_AND_FITS('H','','7','')"]
DEVIATIONS = [
    "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.),#{unit})",
    "LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(0.021),#{unit})",
    "TOLERANCE_VALUE(#{low},#{high})",
]


@pytest.mark.parametrize(("entities", "words"), [(CLASS, "H7"), (DEVIATIONS, "+0.021/+0 mm")])
def test_limits_of_the_file_are_tolerances_of_the_model(entities, words, tmp_path):
    """H7 of 20 mm is 0 to 21 µm in ISO 286-2: the radius of the hole is 10.02 mm + 5.25 µm ± 5.25 µm."""
    file = StepFile()
    parts = {name: file.part(name, part[0]) for name, part in slider_crank().items()}
    bores = [n for n, line in enumerate(file.lines, 1) if line.startswith("CYLINDRICAL") and "1.002" in line]
    face = next(n for n, line in enumerate(file.lines, 1) if line.startswith("ADV") and f"#{bores[0]},." in line)
    file.assembly("all", *((part, *slider_crank()[name][1:]) for name, part in parts.items()))
    shape = file(f"PRODUCT_DEFINITION_SHAPE('','',#{parts['frame'][0]})")
    aspect = file(f"SHAPE_ASPECT('','',#{shape},.T.)")
    size = file(f"DIMENSIONAL_SIZE(#{aspect},'diameter')")
    numbers = {"unit": next(n for n, line in enumerate(file.lines, 1) if ".MILLI.,.METRE." in line)}
    for entity, name in zip(entities, ("low", "high", "limits"), strict=False):
        numbers[name] = file(entity.format(**numbers))
    file(f"PLUS_MINUS_TOLERANCE(#{len(file.lines)},#{size})")
    file(f"GEOMETRIC_ITEM_SPECIFIC_USAGE('','',#{aspect},#{parts['frame'][1]},#{face})")
    draft = import_file(file.write(tmp_path / "a.step"), ground="frame")
    bearing = joint(draft, "crank", "frame")
    assert any(f"hole d=20.04 mm {words} of frame" in comment for comment in bearing.comments)
    (varying,) = model(draft, tmp_path).tolerated()
    assert varying.path == f"joints.{bearing.name}.pin.hole_radius"
    assert (varying.nominal, varying.lower, varying.upper) == pytest.approx((0.01002525, -5.25e-6, 5.25e-6), abs=1e-12)


def free_form(path):
    """The plate with its top, the second of its faces, as a spline surface, which is flat."""
    file = StepFile()
    file.assembly("all", (file.part("plate", plate()), *STILL))
    rows = [[(x, y, 12) for y in (-30, 30)] for x in (-30, 230)]
    numbers = [[file.vector("CARTESIAN_POINT", corner) for corner in row] for row in rows]
    poles = ",".join(f"(#{one},#{other})" for one, other in numbers)
    knots = "(2,2),(2,2),(0.,1.),(0.,1.),.UNSPECIFIED."
    surface = file(f"B_SPLINE_SURFACE_WITH_KNOTS('',1,1,({poles}),.PLANE_SURF.,.F.,.F.,.F.,{knots})")
    top = [n for n, line in enumerate(file.lines) if line.startswith("ADVANCED_FACE")][1]
    file.lines[top] = re.sub(r"#\d+,(\.[TF]\.\))$", rf"#{surface},\1", file.lines[top])
    return file.write(path)


@pytest.mark.slow
def test_a_free_form_solid_has_the_mass_of_a_mesh_and_says_so(tmp_path):
    pytest.importorskip("cascadio")
    draft = import_file(free_form(tmp_path / "a.step"))
    assert "mesh" in codes(draft)
    body = draft.bodies["plate"]
    mass, centre, inertia = plate().moments()
    assert body.mass == pytest.approx(mass, rel=1e-4)
    np.testing.assert_allclose(body.centre, centre, atol=1e-5)
    np.testing.assert_allclose(body.inertia, inertia, atol=1e-4 * np.abs(inertia).max())
    assert any("by a mesh, to about" in comment for comment in body.comments)


@pytest.mark.spread(2)
@pytest.mark.parametrize(("rotation", "swapped"), [(np.eye(3), False), (turn((1, 2, 3), 0.7), True)])
@pytest.mark.parametrize("turned_by", [0.0, 40.0, 200.0])
def test_parts_of_the_original_are_moved(tmp_path, rotation, swapped, turned_by):
    """swapped: some programs state the placement the other way round."""
    parts, file = placed(slider_crank(), rotation, (30, 20, -10)), StepFile()
    file.assembly("all", *((file.part(name, part[0]), *part[1:]) for name, part in parts.items()), swapped=swapped)
    path = file.write(tmp_path / "a.step")
    draft = import_file(path, ground="frame")
    mechanism = model(draft, tmp_path)
    assert export_model(mechanism, tmp_path / "b.step", f"{turned_by} deg", original=path) == []
    again = import_file(tmp_path / "b.step", ground="frame")
    normal = rotation[:, 2]
    way = np.sign(normal[np.argmax(abs(normal))])  # the model turns about the normal's side with the largest component
    near = placed(slider_crank(math.pi / 3 + way * math.radians(turned_by)), rotation, (30, 20, -10))
    for name, part in near.items():
        expect_body(again.bodies[name], [part])
    assert len(again.pairs) == len(draft.pairs)


@pytest.mark.slow
def test_welded_parts_move_with_their_link_and_edited_models_are_refused(tmp_path):
    path = written(tmp_path / "a.step", four_bar())
    draft = import_file(path, ground="ground")
    mechanism = model(draft, tmp_path)
    export_model(mechanism, tmp_path / "b.step", "90 deg", original=path)
    again = import_file(tmp_path / "b.step", ground="ground")
    assert {name: body.mass for name, body in again.bodies.items()} == pytest.approx(
        {name: body.mass for name, body in draft.bodies.items()}
    )
    text = (tmp_path / "model.yaml").read_text()
    (tmp_path / "other.yaml").write_text(re.sub(r"D: \[100 mm", "D: [101 mm", text))
    assert "101 mm" in (tmp_path / "other.yaml").read_text()
    with pytest.raises(MechanismError, match="other points"):
        export_model(trunnion.read(tmp_path / "other.yaml"), tmp_path / "c.step", original=path)
    with pytest.raises(MechanismError, match="cannot be read"):
        export_model(mechanism, tmp_path / "c.step", original=tmp_path / "none.step")


def skeleton(path):
    """The points of each link of a skeleton in the global frame, m, by name."""
    file = Part21(path)
    assembly = Assembly(file, 1e-3)
    (root,) = assembly.tree()
    found = {}
    for part in root.children:
        shape = assembly.shapes[part.definition][0]
        (wires,) = assembly.items(shape, "GEOMETRIC_CURVE_SET")
        found[part.name] = {
            file[item]["CARTESIAN_POINT"][0]: part.place.matrix @ assembly.geometry(shape).point(item)
            + part.place.shift
            for item in file[wires]["GEOMETRIC_CURVE_SET"][1]
            if "CARTESIAN_POINT" in file[item]
        }
    return found


@pytest.mark.spread(1)
@pytest.mark.parametrize("name", ["slider-crank", "rssr", "universal-joint"])
def test_the_skeleton_has_the_points_of_the_position(tmp_path, name):
    mechanism = trunnion.read(f"examples/{name}.yaml")
    findings = export_model(mechanism, tmp_path / "a.step", "30 deg")
    assert "exchange.skeleton" in {finding.code for finding in findings}
    drawn, points = positions_of(mechanism, 4, "30 deg").draft(), skeleton(tmp_path / "a.step")
    assert list(points) == list(drawn.bodies)
    for link in points:
        for pair in drawn.pairs_of(link):
            if pair.type in ("revolute", "spherical"):
                np.testing.assert_allclose(points[link][pair.name], pair.at, atol=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "factor"), [("fourbar-with-play", 500.0), ("pezzuti-cardan-as-built", 20.0)])
def test_errors_are_magnified(tmp_path, name, factor):
    """Displacements from the ideal mechanism are so many times larger; links stay rigid."""
    mechanism = trunnion.read(f"examples/{name}.yaml")
    export_model(mechanism, tmp_path / "a.step", "30 deg", magnify=factor)
    points = skeleton(tmp_path / "a.step")
    result, moved = trunnion.analyse(mechanism, at="30 deg"), 0.0
    for link, named in points.items():
        places = {point: result["point_position"].sel(point=f"{link}.{point}").values[:, 0] for point in named}
        first = next(point for point in result["point"].values.astype(str) if point.startswith(f"{link}."))
        error = result["point_error"].sel(point=first).values[:, 0]
        first = first.partition(".")[2]
        expected = places[first] + (factor - 1) * error
        np.testing.assert_allclose(named[first][: len(expected)], expected, atol=1e-9)
        moved = max(moved, float(np.linalg.norm(error)))
        for other in named:
            length = np.linalg.norm(places[other] - places[first])
            assert np.linalg.norm(named[other] - named[first]) == pytest.approx(length, abs=1e-9)
        turn = float(np.linalg.norm(np.atleast_1d(result["link_error"].sel(link=link).values[..., 0])))
        ideal, larger = (positions_of(mechanism, 4, "30 deg", magnify=f).rotations[link][0] for f in (0.0, factor))
        assert Rotation.from_matrix(larger @ ideal.T).magnitude() == pytest.approx(factor * turn, abs=1e-9)
    assert moved > 0


OPENED = """
import io, json, sys
import cascadio, trimesh
glb = cascadio.load(open(sys.argv[1], "rb").read(), tol_linear=0.01, tol_angular=0.1, use_parallel=False)
scene = trimesh.load(io.BytesIO(glb), file_type="glb")
shapes = [scene.geometry[scene.graph[node][1]].copy().apply_transform(scene.graph[node][0])
          for node in scene.graph.nodes_geometry]
print(json.dumps([[*shape.center_mass, shape.volume] if hasattr(shape, "center_mass") else shape.bounds.tolist()
                  for shape in shapes]))
"""


def opencascade(path):
    """What OpenCASCADE sees in a file: centre and volume of each solid, bounds of each wire."""
    pytest.importorskip("cascadio")
    command = [sys.executable, "-c", OPENED, str(path)]
    done = subprocess.run(command, capture_output=True, timeout=60, check=True)
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.slow
def test_opencascade_sees_the_same_parts_and_the_skeleton(tmp_path):
    path = written(tmp_path / "a.step", slider_crank())
    mechanism = model(import_file(path, ground="frame"), tmp_path)
    export_model(mechanism, tmp_path / "b.step", "40 deg", original=path)
    draft = import_file(tmp_path / "b.step", ground="frame")
    ours = sorted([*body.centre, body.mass / STEEL] for body in draft.bodies.values())
    for expected, mesh in zip(ours, sorted(opencascade(tmp_path / "b.step")), strict=True):
        np.testing.assert_allclose(mesh[:3], expected[:3], atol=2e-5)
        assert mesh[3] == pytest.approx(expected[3], rel=1e-3)
    export_model(mechanism, tmp_path / "c.step", "40 deg")
    wires = opencascade(tmp_path / "c.step")
    assert len(wires) == 4
    points = [pair.at for pair in draft.pairs.values()]
    reach = np.max([high for _, high in wires], axis=0)
    np.testing.assert_allclose(reach[0], max(point[0] for point in points) + 0.02, atol=1e-5)  # the guide of 40 mm


def test_the_command_line_imports_and_moves(tmp_path):
    path = written(tmp_path / "a.step", slider_crank())
    run = CliRunner().invoke
    done = run(app, ["import", str(path), "-o", str(tmp_path / "a.yaml"), "--ground", "frame", "--material", "brass"])
    assert done.exit_code == 0, done.output
    assert "4 links, 4 joints" in done.output
    text = (tmp_path / "a.yaml").read_text()
    assert "8500 kg/m³ of the import, exact by its faces" in text
    assert "nearest usual fit: 16 mm H7/f7" in text
    moved = ["export", str(tmp_path / "a.yaml"), "-o", str(tmp_path / "b.step"), "--at", "60deg", "--from", str(path)]
    assert run(app, moved).exit_code == 0
    assert import_file(tmp_path / "b.step").bodies.keys() == {"frame", "crank", "rod", "slider"}
    over = run(app, [*moved[:3], str(path), *moved[4:]])
    assert isinstance(over.exception, MechanismError)
    assert path.read_text() == written(tmp_path / "c.step", slider_crank()).read_text()
