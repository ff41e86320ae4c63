"""DXF in: drawings made by ezdxf as a draughtsman would, read as links and joints; and what is asked or refused."""

import math

import ezdxf
import numpy as np
import pytest
from ezdxf.math import Matrix44
from hypothesis import given, settings
from hypothesis import strategies as st

import trunnion
from trunnion.exchange import import_file, model_text

A, B, C, D, E = (0.0, 0.0), (30.0, 40.0), (150.0, 90.0), (120.0, 0.0), (80.0, 110.0)
PIN, HOLE = 5.0, 5.05
BOX = ("box", (85, -8), (115, -8), (115, 8), (85, 8))
FOUR_BAR = {"A": ("ground", "crank"), "B": ("crank", "coupler"), "C": ("coupler", "rocker"), "D": ("ground", "rocker")}


def drawing(units=4, **layers):
    """A drawing of layers with ("line", a, b), ("circle", c, r), ("point", p), ("text", p, name), ("slot", a, b, r)."""
    document = ezdxf.new("R2010", units=units)
    for layer, marks in layers.items():
        draw(document.modelspace(), layer, marks)
    return document


def draw(space, layer, marks):
    here = {"layer": {"zero": "0"}.get(layer, layer)}
    for kind, *numbers in marks:
        if kind == "line":
            space.add_line(*numbers, dxfattribs=here)
        elif kind == "circle":
            space.add_circle(*numbers, dxfattribs=here)
        elif kind == "halves":  # a circle as two arcs
            space.add_arc(*numbers, 10, 190, dxfattribs=here)
            space.add_arc(*numbers, 190, 10, dxfattribs=here)
        elif kind == "ellipse":
            space.add_ellipse(numbers[0], (0, numbers[1]), 1.0, dxfattribs=here)
        elif kind == "point":
            space.add_point(*numbers, dxfattribs=here)
        elif kind == "text":
            space.add_text(numbers[1], height=3, dxfattribs=here).set_placement(numbers[0])
        elif kind == "box":
            space.add_lwpolyline(numbers, close=True, dxfattribs=here)
        elif kind == "slot":
            a, b, radius = (np.array(n, float) for n in numbers)
            across = radius * np.array([-(b - a)[1], (b - a)[0]]) / np.hypot(*(b - a))
            corners = [(*(a - across), 0), (*(b - across), 1), (*(b + across), 0), (*(a + across), 1)]
            space.add_lwpolyline(corners, format="xyb", close=True, dxfattribs=here)


def four_bar():
    return {
        "ground": [("circle", A, PIN), ("circle", D, PIN), ("line", A, D)],
        "crank": [("circle", A, HOLE), ("circle", B, PIN), ("line", A, B), ("text", (1, 1), "A")],
        "coupler": [("circle", B, HOLE), ("circle", C, PIN), ("line", B, C), ("point", E), ("text", (30, 41), "B"),
                    ("text", E, "E")],
        "rocker": [("circle", C, HOLE), ("circle", D, HOLE), ("line", C, D), ("text", (150, 92), "C"),
                   ("text", (121, 1), "D")],
    }  # fmt: skip


def read(document, folder, **options):
    path = folder / "drawing.dxf"
    document.saveas(path)
    return import_file(path, **options)


def codes(draft):
    return sorted(finding.code.removeprefix("exchange.") for finding in draft.findings)


@pytest.mark.parametrize("circle", ["circle", "halves", "ellipse"])
def test_concentric_circles_of_two_layers_are_a_joint_with_pin_hole_and_name(circle, tmp_path):
    marks = {layer: [(circle, *mark[1:]) if mark[0] == "circle" else mark for mark in drawn]
             for layer, drawn in four_bar().items()}  # fmt: skip
    draft = read(drawing(**marks), tmp_path)
    assert {name: pair.links for name, pair in draft.pairs.items()} == FOUR_BAR
    for name, place in zip("ABCD", (A, B, C, D), strict=True):
        pair = draft.pairs[name]
        np.testing.assert_allclose(pair.at, [1e-3 * place[0], 1e-3 * place[1], 0], atol=1e-15)
        assert pair.pin_radius == pytest.approx(5e-3, rel=1e-12)
        assert pair.clearance == pytest.approx(0.05e-3, rel=1e-9)
    np.testing.assert_allclose(draft.bodies["coupler"].points["E"], [0.08, 0.11, 0])
    assert draft.ground == "ground"
    assert codes(draft) == ["drive", "lost"]
    (tmp_path / "model.yaml").write_text(model_text(draft), "utf-8")
    model = trunnion.read(tmp_path / "model.yaml")
    assert model.space == "planar"
    assert trunnion.check(model).mobility == 1


@settings(deadline=None, max_examples=12)
@given(
    turn=st.floats(-180, 180),
    shift=st.floats(-1e3, 1e3),
    scale=st.floats(0.2, 5),
    mirrored=st.booleans(),
    nested=st.integers(0, 3),
)
def test_blocks_are_read_where_they_are_inserted(turn, shift, scale, mirrored, nested, tmp_path_factory):
    document = ezdxf.new("R2010", units=4)
    block = document.blocks.new("part0")
    for layer, marks in four_bar().items():
        draw(block, layer, marks)
    for depth in range(nested):
        document.blocks.new(f"part{depth + 1}").add_blockref(f"part{depth}", (0, 0))
    attributes = {"rotation": turn, "xscale": -scale if mirrored else scale, "yscale": scale, "zscale": scale}
    document.modelspace().add_blockref(f"part{nested}", (shift, 7.0), dxfattribs=attributes)
    draft = read(document, tmp_path_factory.mktemp("block"), gap="5 mm")
    place = Matrix44.chain(
        Matrix44.scale(-scale if mirrored else scale, scale, 1),
        Matrix44.z_rotate(math.radians(turn)),
        Matrix44.translate(shift, 7, 0),
    )
    assert {frozenset(pair.links) for pair in draft.pairs.values()} == {frozenset(two) for two in FOUR_BAR.values()}
    joined = {frozenset(pair.links): pair for pair in draft.pairs.values()}
    for point, links in zip((A, B, C, D), FOUR_BAR.values(), strict=True):
        pair = joined[frozenset(links)]
        np.testing.assert_allclose(1e3 * pair.at, place.transform((*point, 0)).xyz, atol=1e-9 * (abs(shift) + 1e3))
        assert pair.pin_radius == pytest.approx(5e-3 * scale, rel=1e-9)
        assert pair.hole_radius == pytest.approx(5.05e-3 * scale, rel=1e-9)


def test_units_are_those_of_the_file_else_stated_and_a_finding(tmp_path):
    inches = read(drawing(units=1, **four_bar()), tmp_path)
    np.testing.assert_allclose(inches.pairs["D"].at, [120 * 0.0254, 0, 0], rtol=1e-15)
    bare = read(drawing(units=0, **four_bar()), tmp_path)
    np.testing.assert_allclose(bare.pairs["D"].at, [0.12, 0, 0])
    assert "unit" in codes(bare)
    stated = read(drawing(units=0, **four_bar()), tmp_path, unit="in", gap="0.05in")
    np.testing.assert_allclose(stated.pairs["D"].at, [120 * 0.0254, 0, 0])


ON_GROUND = [("circle", A, PIN), ("line", (0, -40), (100, -40))]
CIRCLES = [
    # marks by layer, what is said, links of the joints and radii of their pins
    ({layer: [mark for mark in marks if mark[0] == "line"] for layer, marks in four_bar().items()},
     "bare_end", [*FOUR_BAR.values()], [None] * 4),
    ({"ground": ON_GROUND, "crank": [("circle", A, 12.0)]}, "radius", [("ground", "crank")], [None]),  # too wide
    ({"ground": ON_GROUND, "crank": [("circle", A, 5.0), ("circle", A, 5.1)]},  # which of the two?
     "radius", [("ground", "crank")], [None]),
    ({"ground": ON_GROUND, "crank": [("circle", (0.2, 0), 5.0)]}, "circles almost about", [], []),
    ({"ground": ON_GROUND, "crank": [("circle", (0.2, 0), 5.0), ("line", (0.2, 0), B)]}, "circles almost", [], []),
    ({"a": [("circle", A, HOLE), ("line", A, B)], "b": [("circle", A, PIN), ("line", A, C)],  # three on one pin
      "c": [("circle", A, HOLE), ("line", A, D)]}, "shared_pin", [("b", "a"), ("b", "c")], [5e-3, 5e-3]),
]  # fmt: skip


@pytest.mark.parametrize(("marks", "says", "joints", "radii"), CIRCLES)
def test_what_is_not_clearly_pin_and_hole_is_asked(marks, says, joints, radii, tmp_path):
    draft = read(drawing(**marks), tmp_path)
    assert says in codes(draft) or any(what.startswith(says) for what in draft.lost)
    assert {frozenset(pair.links) for pair in draft.pairs.values()} == {frozenset(links) for links in joints}
    assert [pair.pin_radius for pair in draft.pairs.values()] == [radius and pytest.approx(radius) for radius in radii]


def slotted():
    """A crank of 40 mm whose pin runs in the slot of a lever 100 mm away, drawn at 90°."""
    way = np.array([100.0, 40.0]) / math.hypot(100, 40)
    lever = np.array([-100.0, 0.0])
    return {
        "frame": [("circle", A, PIN), ("circle", tuple(lever), PIN)],
        "crank": [("circle", A, PIN), ("line", A, (0, 40)), ("circle", (0, 40), 6.0)],
        "lever": [("circle", tuple(lever), PIN), ("slot", tuple(lever + 50 * way), tuple(lever + 150 * way), 6.1)],
    }


def test_a_pin_in_a_slot_turns_and_slides(tmp_path):
    draft = read(drawing(**slotted()), tmp_path, drive="J1", speed="10 rad/s")
    kinds = sorted((pair.type, *pair.links) for pair in draft.pairs.values())
    block = "block in lever"
    assert kinds == [("prismatic", "lever", block), ("revolute", "crank", block), ("revolute", "frame", "crank"),
                     ("revolute", "frame", "lever")]  # fmt: skip
    guide = next(pair for pair in draft.pairs.values() if pair.type == "prismatic")
    length = math.hypot(100, 40)
    assert guide.limits == pytest.approx([1e-3 * (50 - length), 1e-3 * (150 - length)])
    (tmp_path / "model.yaml").write_text(model_text(draft), "utf-8")
    result = trunnion.analyse(trunnion.read(tmp_path / "model.yaml"), 24)
    crank = math.pi / 2 + result["link_angle"].sel(link="crank").values
    lever = np.arctan2(40 * np.sin(crank), 100 + 40 * np.cos(crank))
    turned = result["link_angle"].sel(link="lever").values
    np.testing.assert_allclose(turned, lever - lever[0], atol=1e-9)


@pytest.mark.parametrize("pin", [(0.0, 40.0), (1.0, 40.0), (0.0, 39.0), (-100.0, 100.0)])
def test_a_pin_beside_the_middle_of_a_slot_is_no_guide(pin, tmp_path):
    marks = slotted()
    marks["crank"][-1] = ("circle", pin, 6.0)
    types = [pair.type for pair in read(drawing(**marks), tmp_path).pairs.values()]
    assert ("prismatic" in types) == (pin == (0.0, 40.0))


def slider(rail, block):
    return {
        "ground": [("circle", A, PIN), *rail],
        "crank": [("circle", A, PIN), ("line", A, (0, 30)), ("circle", (0, 30), PIN)],
        "rod": [("circle", (0, 30), PIN), ("line", (0, 30), (100, 0)), ("circle", (100, 0), PIN)],
        "slider": [("circle", (100, 0), PIN), *block],
    }


@pytest.mark.parametrize(
    ("rail", "block"),
    [
        ([("line", (40, 0), (160, 0))], [("line", (85, 0), (115, 0))]),
        ([("line", (40, 8), (160, 8)), ("line", (40, -8), (160, -8))], [BOX]),
        ([("line", (40, 8.1), (160, 8.1)), ("line", (160, -8.1), (40, -8.1))], [BOX]),
        ([("slot", (40, 0), (160, 0), 8)], [BOX]),
    ],
)
def test_lines_that_lie_on_each_other_are_a_guide(rail, block, tmp_path):
    draft = read(drawing(**slider(rail, block)), tmp_path)
    (guide,) = (pair for pair in draft.pairs.values() if pair.type == "prismatic")
    assert guide.links == ("ground", "slider")
    np.testing.assert_allclose(guide.at, [0.1, 0, 0], atol=1e-12)
    np.testing.assert_allclose(guide.axis, [1, 0, 0], atol=1e-12)
    assert guide.length == pytest.approx(0.03)
    assert "guide" in codes(draft)
    assert draft.mobility(planar=True) == 1


def test_hidden_layers_and_other_entities_are_left_and_listed(tmp_path):
    document = drawing(**four_bar(), notes=[("circle", A, PIN)], Defpoints=[("point", B)])
    document.layers.add("notes").off()
    space = document.modelspace()
    space.add_spline([(0, 0), (5, 9), (9, 2)], dxfattribs={"layer": "crank"})
    space.add_circle((0, 0, 0), 3, dxfattribs={"layer": "crank", "extrusion": (1, 0, 0)})
    draft = read(document, tmp_path)
    assert set(draft.bodies) == {"ground", "crank", "coupler", "rocker"}
    left = " ".join(draft.lost)
    assert "SPLINE" in left
    assert "tilted CIRCLE" in left
    assert "hidden layer notes" in left


def test_a_drawing_in_space_is_read_flat_with_a_warning(tmp_path):
    document = drawing(**four_bar())
    for circle in document.modelspace().query('CIRCLE[layer=="crank"]'):
        circle.translate(0, 0, 7)
    draft = read(document, tmp_path)
    assert {finding.severity for finding in draft.findings if finding.code == "exchange.flat"} == {"warning"}
    assert set(draft.pairs) == set(FOUR_BAR)


def test_what_lies_on_layer_0_of_a_block_is_on_the_layer_of_the_block(tmp_path):
    document = drawing(ground=[("circle", A, PIN)])
    draw(document.blocks.new("arm"), "zero", [("circle", A, HOLE), ("circle", (50, 0), PIN)])
    document.modelspace().add_blockref("arm", (0, 0), dxfattribs={"layer": "arm"})
    assert [pair.links for pair in read(document, tmp_path).pairs.values()] == [("ground", "arm")]
