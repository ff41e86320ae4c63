"""What the studio lays over sheet and plots, against `analyse`, closed forms and differences."""

from __future__ import annotations

import json
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import trunnion
from studio.asking import unpacked
from trunnion.errors import Status
from trunnion.model.file import entries_of
from trunnion.model.mechanism import Mechanism
from trunnion.results.scales import without_noise
from trunnion.studio.answers import answer

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = {path.stem: path.read_text("utf-8") for path in (ROOT / "examples").glob("*.yaml")}
FOURBAR = "durango-fourbar"
FLOAT = 1e-6  # columns are float32


def ask(kind, text, **question):
    found = unpacked(answer(json.dumps({"ask": kind, "text": text, "revision": 1} | question).encode()))
    assert "error" not in found, found
    return found


def analysed(text, friction=True, steps=360):
    mechanism = Mechanism(**entries_of(text)[0])
    return trunnion.analyse(mechanism if friction else mechanism.with_friction("off"), steps)


def array(column):
    return np.array(column, float)


def near(found, expected, **rest):
    expected = np.asarray(expected, float)
    scale = np.nanmax(np.abs(expected))
    np.testing.assert_allclose(array(found), expected, atol=3 * FLOAT * scale, rtol=0, **rest)


# ---- a point -------------------------------------------------------------------------------------------------------


def test_velocity_and_acceleration_of_a_point_are_those_of_analyse_and_of_differences():
    text = EXAMPLES[FOURBAR]
    names = [f"coupler.E.{rate}_{axis}" for rate in ("velocity", "acceleration") for axis in "xy"]
    found = ask("layers", text, names=names, steps=720)["columns"]
    result = analysed(text, steps=720)
    place = result["point_position"].sel(point="coupler.E")
    step = 2 * np.pi / 10 / 720  # s, at 10 rad/s
    for axis in "xy":
        track = place.sel(axis=axis).values
        velocity, acceleration = (found[f"coupler.E.{rate}_{axis}"]["values"] for rate in ("velocity", "acceleration"))
        near(velocity, result["point_velocity"].sel(point="coupler.E", axis=axis))
        near(acceleration, result["point_acceleration"].sel(point="coupler.E", axis=axis))
        before, after = np.roll(track, 1), np.roll(track, -1)
        speed, second = (after - before) / (2 * step), (after - 2 * track + before) / step**2
        np.testing.assert_allclose(array(velocity), speed, atol=2e-3 * np.abs(speed).max())
        np.testing.assert_allclose(array(acceleration), second, atol=5e-3 * np.abs(second).max())


def test_a_column_that_is_not_known_is_none():
    assert ask("layers", EXAMPLES[FOURBAR], names=["coupler.Z.velocity_x"])["columns"] == {}
    assert ask("layers", EXAMPLES[FOURBAR])["columns"] == {}


def test_in_space_there_is_the_motion_of_a_point_alone():
    found = ask("layers", EXAMPLES["rssr"], wanted=["centres", "transmission"])
    assert not {"centres", "transmission"} & set(found)


# ---- instant centres -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("example", ["slider-crank", "jansen"])
def test_three_links_have_their_instant_centres_on_one_line(example):
    """The theorem of Aronhold and Kennedy, at every position, for every three links whose centres are at hand."""
    rows = ask("layers", EXAMPLES[example], wanted=["centres"])["centres"]
    at = {frozenset(row["pair"]): row for row in rows}
    links = {link for row in rows for link in row["pair"]}
    size = np.ptp(
        [array(row[axis])[np.isfinite(array(row[axis]))].mean() for row in rows if row["joint"] for axis in "xy"]
    )
    assert len(rows) == len(links) * (len(links) - 1) // 2
    checked = 0
    for three in combinations(sorted(links), 3):
        a, b, c = (at[frozenset(pair)] for pair in combinations(three, 2))
        if a["far"] or b["far"] or c["far"]:
            continue
        (ax, ay), (bx, by), (cx, cy) = ([array(row[axis]) for axis in "xy"] for row in (a, b, c))
        cross = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        longest = np.max([np.hypot(bx - ax, by - ay), np.hypot(cx - ax, cy - ay), np.hypot(cx - bx, cy - by)], axis=0)
        longest = np.maximum(longest, size)
        off = np.abs(cross) / longest  # distance of the one from the line of the others, near enough
        scale = np.max(np.abs([ax, ay, bx, by, cx, cy]), axis=0) + size
        known = np.isfinite(off)
        assert np.all(off[known] <= 20 * FLOAT * scale[known]), three
        checked += np.count_nonzero(known)
    assert checked > 350


def test_a_point_moves_across_its_line_to_the_instant_centre():
    """v = ω × (P − I), with the angular velocity of `analyse`."""
    text = EXAMPLES[FOURBAR]
    result = analysed(text)
    (row,) = [one for one in ask("layers", text, wanted=["centres"])["centres"] if one["pair"] == ["ground", "coupler"]]
    x, y = (result["point_position"].sel(point="coupler.E", axis=axis).values for axis in "xy")
    turn = result["link_angle_velocity"].sel(link="coupler").values
    fit = np.hypot(array(row["x"]) - x, array(row["y"]) - y) < 100  # m: nearer than float32 has digits for
    assert fit.sum() > 300
    vx, vy = -turn * (y - array(row["y"])), turn * (x - array(row["x"]))
    for axis, speed in (("x", vx), ("y", vy)):
        own = result["point_velocity"].sel(point="coupler.E", axis=axis).values
        np.testing.assert_allclose(speed[fit], own[fit], atol=1e-5 * np.abs(own).max())


def test_a_slider_has_its_centre_at_infinity_across_its_guide():
    rows = ask("layers", EXAMPLES["slider-crank"], wanted=["centres"])["centres"]
    result = analysed(EXAMPLES["slider-crank"])
    links = [link for link in result["link"].values if np.all(result["link_angle_velocity"].sel(link=link) == 0)]
    (block,) = [link for link in links if link not in ("ground", "frame")]
    (row,) = [one for one in rows if one["ground"] and block in one["pair"]]
    assert all(one is None for one in row["x"])
    far = array(row["far"]["x"]), array(row["far"]["y"])
    moving = np.isfinite(far[0])
    assert moving.sum() > 350
    np.testing.assert_allclose(np.abs(far[1][moving]), 1.0, atol=FLOAT)
    (pin,) = [one for one in rows if block in one["pair"] and one["joint"]]
    assert pin["far"] is None


# ---- transmission angles -------------------------------------------------------------------------------------------


def test_the_transmission_angle_of_a_four_bar_is_that_of_the_law_of_cosines():
    text = EXAMPLES[FOURBAR]
    result, (row,) = analysed(text), ask("layers", text, wanted=["transmission"])["transmission"]
    numbers = ask("model", text)["numbers"]
    ab, bc, cd, da = (numbers[f"dimensions.{name}"] for name in ("AB", "BC", "CD", "AD"))
    crank = result["point_position"].sel(point="crank.B").values - result["point_position"].sel(point="ground.A").values
    pin = result["point_position"].sel(point="ground.D").values
    square = np.sum((np.array(crank) - pin) ** 2, axis=0)
    assert ab == pytest.approx(np.hypot(*crank[:, 0]))
    assert da == pytest.approx(np.hypot(*pin[:, 0]))
    angle = np.arccos((bc**2 + cd**2 - square) / (2 * bc * cd))
    np.testing.assert_allclose(np.abs(array(row["angle"])), np.minimum(angle, np.pi - angle), atol=1e-6)
    assert row["joint"] == "C"


@pytest.mark.parametrize("example", ["whitworth-quick-return", "toggle-press"])
def test_transmission_angles_are_those_of_design(example):
    from trunnion.solve.run import prepare
    from trunnion.studies.design import transmission_angles

    run = prepare(Mechanism(**entries_of(EXAMPLES[example])[0]))
    told = transmission_angles(run.walk(run.cycle.times(360)))
    rows = {row["name"]: row for row in ask("layers", EXAMPLES[example], wanted=["transmission"])["transmission"]}
    assert rows.keys() == told.keys()
    for name, angle in told.items():
        np.testing.assert_allclose(np.abs(array(rows[name]["angle"])), np.broadcast_to(angle, 360), atol=1e-6)


# ---- variants ------------------------------------------------------------------------------------------------------


def compared(before, after, friction=("stated", "stated"), **rest):
    other = {"text": before, "friction": friction[0]}
    told = ask("compare", after, friction=friction[1], others=[other], **rest)
    (found,) = told["others"]
    was = {row["name"]: row for row in found["figures"]}
    none = {"value": None, "text": "—"}
    rows = {}
    for row in told["figures"]:
        old = was.get(row["name"], none)
        rows[row["title"]] = {"a": old["value"], "b": row["value"], "texts": [old["text"], row["text"]]}
    return found, rows


def test_a_table_of_two_variants_is_that_of_two_analyses():
    before, after = EXAMPLES["drawing-press"], EXAMPLES["drawing-press"].replace("friction: 0.1", "friction: 0.15")
    assert before != after
    found, rows = compared(before, after, steps=60)
    results = [analysed(one, steps=60) for one in (before, after)]
    peaks = [{figure.name: figure.value for figure in one.trunnion.summary}["Z.effort_max"] for one in results]
    assert peaks == pytest.approx([float(np.abs(one["drive_effort"]).max()) for one in results], rel=1e-11)
    (effort,) = [row for label, row in rows.items() if label.startswith("drive force of Z, maximum")]
    assert [effort["a"], effort["b"]] == pytest.approx(peaks, rel=1e-12)
    figures = [{figure.name: figure.value for figure in one.trunnion.summary} for one in results]
    for label, name in (
        ("efficiency of the cycle", "efficiency"),
        ("locking margin, minimum", "locking_margin"),
    ):
        assert [rows[label]["a"], rows[label]["b"]] == pytest.approx([one[name] for one in figures], rel=1e-12)
    least = [float(one["locking_margin"].min()) for one in results]
    assert least[1] == pytest.approx(least[0] / 1.5, rel=1e-3)  # a multiple of the friction
    reaction = [
        float(np.hypot(*(one["reaction_force"].sel(axis=axis, joint="O") for axis in "xy")).max()) for one in results
    ]
    row = rows["reaction of O, maximum"]
    assert [row["a"], row["b"]] == pytest.approx([one["O.reaction_max"] for one in figures], rel=1e-12)
    assert [row["a"], row["b"]] == pytest.approx(reaction, rel=1e-11)  # of the positions
    near(found["scene"]["drivers"][0]["effort"], results[0]["drive_effort"].values[0])


def test_a_table_has_the_stroke_and_the_time_ratio_of_a_quick_return():
    """Ram in line with the lever's pivot: φ = 2 acos(d/r) of the crank, the shorter way, stands about 270°."""
    after = EXAMPLES["whitworth-quick-return"]
    before = after.replace("d: 60 mm", "d: 40 mm")
    _, rows = compared(before, after, steps=60)
    assert rows["time ratio of G"]["b"] == pytest.approx(2.0, rel=1e-4)
    short = 2 * np.arccos(40 / 120)
    assert rows["time ratio of G"]["a"] == pytest.approx((2 * np.pi - short) / short, rel=1e-4)
    assert rows["stroke of G"]["texts"] == ["200.0\u00a0mm", "200.0\u00a0mm"]
    assert rows["stroke of G"]["b"] == pytest.approx(0.2, rel=1e-9)
    figures = dict(ask("cycle", after)["figures"])
    assert figures["time ratio of G"] == "2.000"
    assert figures["stroke of G"] == "200.0\u00a0mm"


@pytest.mark.slow
def test_a_time_ratio_the_other_way_near_a_singularity_and_through_one():
    after = EXAMPLES["whitworth-quick-return"]
    backwards = dict(ask("cycle", after.replace("speed: 40 rpm", "speed: -40 rpm"))["figures"])
    assert backwards["time ratio of G"] == "2.000"
    sharp = dict(ask("cycle", after.replace("d: 60 mm", "d: 40 mm").replace("r: 120 mm", "r: 40.01 mm"))["figures"])
    short = 2 * np.arccos(40 / 40.01)
    assert float(sharp["time ratio of G"]) == pytest.approx((2 * np.pi - short) / short, rel=1e-3)
    jumps = dict(ask("cycle", after.replace("d: 60 mm", "d: 120 mm"), steps=60)["figures"])
    assert "time ratio of G" not in jumps


def test_the_same_without_friction():
    text = EXAMPLES[FOURBAR]
    found, rows = compared(text, text, friction=("off", "stated"))
    free = analysed(text, friction=False)
    near(found["scene"]["drivers"][0]["effort"], free["drive_effort"].values[0])
    assert rows["friction power, mean"]["a"] in (0, None)
    assert rows["locking margin, minimum"] == {"a": None, "b": None, "texts": ["—", "> 10"]}
    assert rows["friction power, mean"]["b"] > 0
    assert found["margin"] is None


def test_a_variant_over_another_stroke_has_its_own():
    after = EXAMPLES["drawing-press"]
    found, rows = compared(after.replace("range: [0 mm, 118 mm]", "range: [20.3 mm, 100 mm]"), after, steps=60)
    assert found["scene"]["abscissa"]["values"][0] == pytest.approx(20.3)  # so that the page does not lay it over
    assert rows["stroke of Z"]["texts"] == ["79.70\u00a0mm", "118.0\u00a0mm"]


@pytest.mark.slow
def test_the_motion_of_a_point_is_laid_over():
    after = EXAMPLES["drawing-press"]
    before = after.replace("L: 200 mm", "L: 205 mm")
    names = {f"lower.P.{rate}_{axis}": (rate, axis) for rate in ("velocity", "acceleration") for axis in "xy"}
    (found,) = ask("compare", text=after, others=[{"text": before}], steps=60, names=list(names))["others"]
    own = without_noise(analysed(before, steps=60))
    for name, (rate, axis) in names.items():
        near(found["columns"][name]["values"], own[f"point_{rate}"].sel(point="lower.P", axis=axis).values)


def test_another_drive_has_no_figure_of_this_one():
    _, rows = compared(EXAMPLES["drawing-press"], EXAMPLES[FOURBAR])
    assert rows["drive torque of A, maximum"]["texts"][0] == "—"


@pytest.mark.slow
def test_a_variant_without_an_answer_says_why():
    broken = EXAMPLES[FOURBAR].replace("BC: 6.00 m", "BC: 1.00 m")
    found, rows = compared(broken, EXAMPLES[FOURBAR])
    assert rows["positions solved, of 360"]["a"] < 360
    efforts = found["scene"]["drivers"][0]["effort"]
    assert all(one is None for one in efforts) == (rows["positions solved, of 360"]["a"] == 0)
    found, rows = compared("links: 3", EXAMPLES[FOURBAR])
    assert found["scene"] is None
    assert "cannot be solved" in found["why"]
    assert found["figures"] == []


# ---- the margin ----------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_the_margin_is_there_with_locking():
    text = EXAMPLES["drawing-press"].replace("friction: 0.1", "friction: 0.4")
    found, result = ask("model", text, steps=60), analysed(text, steps=60)
    assert np.count_nonzero(result["status"] == Status.LOCKED) > 5
    near(found["margin"], np.minimum(result["locking_margin"], 10))
    assert found["margin_least"]["value"] == pytest.approx(float(result["locking_margin"].min()), rel=1e-6)
    assert found["margin_least"]["value"] < 1
    assert found["margin_why"] is None


def test_the_margin_is_there_for_one_position():
    found = ask("model", EXAMPLES["drawing-press"], steps=1)
    assert found["scene"]["count"] == 1
    assert found["margin_least"]["value"] == pytest.approx(3.44903, rel=1e-5)
    assert len(found["margin"]) == 1


@pytest.mark.parametrize(
    ("example", "friction", "why"),
    [(FOURBAR, "off", "no friction"), ("andrews-squeezer", "stated", "no friction")],
)
def test_why_there_is_no_margin(example, friction, why):
    found = ask("model", EXAMPLES[example], friction=friction)
    assert (found["margin"], found["margin_least"], found["margin_why"]) == (None, None, why)


def test_a_structure_that_rubs_is_driven_by_nothing():
    rubs = "\njoint_defaults: {pin: {radius: 5 mm}, guide: {length: 20 mm}, friction: 0.1}\n"
    assert ask("model", EXAMPLES["one-way-clutch"] + rubs)["margin_why"] == "no driver"
