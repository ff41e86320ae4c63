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
    found = ask("layers", text, point="coupler.E", steps=720)["point"]
    result = analysed(text, steps=720)
    place = result["point_position"].sel(point="coupler.E")
    step = 2 * np.pi / 10 / 720  # s, at 10 rad/s
    for axis in "xy":
        track = place.sel(axis=axis).values
        near(found["velocity"][axis], result["point_velocity"].sel(point="coupler.E", axis=axis))
        near(found["acceleration"][axis], result["point_acceleration"].sel(point="coupler.E", axis=axis))
        before, after = np.roll(track, 1), np.roll(track, -1)
        speed, second = (after - before) / (2 * step), (after - 2 * track + before) / step**2
        np.testing.assert_allclose(array(found["velocity"][axis]), speed, atol=2e-3 * np.abs(speed).max())
        np.testing.assert_allclose(array(found["acceleration"][axis]), second, atol=5e-3 * np.abs(second).max())


def test_a_point_that_is_not_known_has_no_motion():
    assert ask("layers", EXAMPLES[FOURBAR], point="coupler.Z")["point"] is None
    assert ask("layers", EXAMPLES[FOURBAR])["point"] is None


def test_any_place_on_a_link_moves_as_a_point_there():
    text, index = EXAMPLES[FOURBAR], 50
    result = analysed(text)
    own = {
        name: result[f"point_{name}"].sel(point="coupler.E").values for name in ("position", "velocity", "acceleration")
    }
    at = [float(row[index]) for row in own["position"]]
    found = ask("layers", text, place={"link": "coupler", "at": at, "index": index})["point"]
    for name, rows in own.items():
        for axis, row in zip("xy", rows, strict=True):
            near(found[name][axis], row)
    longer = text.replace("BC: 6.00 m", "BC: 6.20 m")  # and it stays on its link when the model changes
    again = ask("layers", longer, place={key: found[key] for key in ("link", "start", "local")})["point"]
    near(again["position"]["x"], analysed(longer)["point_position"].sel(point="coupler.E", axis="x"))
    assert ask("layers", text, place={"link": "none", "at": at, "index": index})["point"] is None


def test_in_space_there_is_the_motion_of_a_point_alone():
    found = ask("layers", EXAMPLES["rssr"], wanted=["centres", "circles", "transmission"])
    assert not {"centres", "circles", "transmission"} & set(found)


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


# ---- friction circles ----------------------------------------------------------------------------------------------


def test_the_radius_of_a_friction_circle_is_that_of_coulomb():
    """f′ r = 0.40 · 7.5 mm; the two forces and the moment together act along a line that touches the circle."""
    text = EXAMPLES[FOURBAR]
    result, found = analysed(text), ask("layers", text, wanted=["circles"])["circles"]
    assert [one["joint"] for one in found] == list("ABCD")
    for one in found:
        np.testing.assert_allclose(array(one["radius"]), 0.4 * 0.0075, rtol=1e-6)
        offset = array(one["offset"])
        force = [result["reaction_force"].sel(joint=one["joint"], axis=axis).values for axis in "xy"]
        size = np.hypot(*force)
        arm = offset * force[1] / size, -offset * force[0] / size  # to the right of the force
        moment = arm[0] * force[1] - arm[1] * force[0]
        moves = np.isfinite(offset)
        assert moves.sum() > 350
        torque = result["friction_torque"].sel(joint=one["joint"]).values
        np.testing.assert_allclose(moment[moves], torque[moves], rtol=1e-5)
    assert ask("layers", text, wanted=["circles"], friction="off")["circles"] == []


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
    corner = [result["point_position"].sel(point="rocker.C", axis=axis).values for axis in "xy"]
    near(row["x"], corner[0])
    near(row["y"], corner[1])
    to_b = np.arctan2(crank[1] - corner[1], crank[0] - corner[0])
    np.testing.assert_allclose(np.cos(array(row["first"]) - to_b), 1.0, atol=1e-6)


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
    (found,) = ask("compare", after, friction=friction[1], others=[other], **rest)["others"]
    return found, {row["label"]: row for row in found["rows"]}


def test_a_table_of_two_variants_is_that_of_two_analyses():
    before, after = EXAMPLES["drawing-press"], EXAMPLES["drawing-press"].replace("friction: 0.1", "friction: 0.15")
    assert before != after
    found, rows = compared(before, after, steps=60)
    results = [analysed(one, steps=60) for one in (before, after)]
    peaks = [float(np.abs(one["drive_effort"]).max()) for one in results]
    (effort,) = [row for label, row in rows.items() if label.startswith("peak force")]
    assert [effort["a"], effort["b"]] == pytest.approx(peaks, rel=1e-12)
    assert effort["texts"][2] == f"+{100 * (peaks[1] / peaks[0] - 1):.1f} %".replace("+-", "−")
    figures = [{figure.name: figure.value for figure in one.trunnion.summary} for one in results]
    for label, name in (("efficiency", "efficiency"), ("least locking margin", "locking_margin")):
        assert [rows[label]["a"], rows[label]["b"]] == pytest.approx([one[name] for one in figures], rel=1e-12)
    least = [float(one["locking_margin"].min()) for one in results]
    assert least[1] == pytest.approx(least[0] / 1.5, rel=1e-3)  # a multiple of the friction
    reaction = [
        float(np.hypot(one["reaction_force"].sel(axis="x"), one["reaction_force"].sel(axis="y")).max())
        for one in results
    ]
    assert [rows["largest reaction"]["a"], rows["largest reaction"]["b"]] == pytest.approx(reaction, rel=1e-12)
    near(found["scene"]["drivers"][0]["effort"], results[0]["drive_effort"].values[0])
    assert not found["shifted"]


def test_a_table_has_the_stroke_and_the_time_ratio_of_a_quick_return():
    """Ram in line with the lever's pivot: φ = 2 acos(d/r) of the crank, the shorter way, stands about 270°."""
    after = EXAMPLES["whitworth-quick-return"]
    before = after.replace("d: 60 mm", "d: 40 mm")
    _, rows = compared(before, after, steps=60)
    assert rows["time ratio of G"]["b"] == pytest.approx(2.0, rel=1e-4)
    short = 2 * np.arccos(40 / 120)
    assert rows["time ratio of G"]["a"] == pytest.approx((2 * np.pi - short) / short, rel=1e-4)
    assert rows["stroke of G"]["texts"] == ["200.0\u00a0mm", "200.0\u00a0mm", "0 %"]
    figures = dict(ask("cycle", after)["figures"])
    assert figures["time ratio of G"] == "2.000 (forth 240.0°, back 120.0° from 210.0° to 330.0°)"
    assert figures["stroke of G"] == "200.0\u00a0mm"


@pytest.mark.slow
def test_a_time_ratio_the_other_way_near_a_singularity_and_through_one():
    after = EXAMPLES["whitworth-quick-return"]
    backwards = dict(ask("cycle", after.replace("speed: 40 rpm", "speed: -40 rpm"))["figures"])
    assert backwards["time ratio of G"] == "2.000 (forth 120.0° from 330.0° to 210.0°, back 240.0°)"
    sharp = dict(ask("cycle", after.replace("d: 60 mm", "d: 40 mm").replace("r: 120 mm", "r: 40.01 mm"))["figures"])
    short = 2 * np.arccos(40 / 40.01)
    assert sharp["time ratio of G"].startswith(f"{(2 * np.pi - short) / short:.1f} (")
    assert "from 268.7° to 271.3°" in sharp["time ratio of G"]
    jumps = dict(ask("cycle", after.replace("d: 60 mm", "d: 120 mm"), steps=60)["figures"])
    assert "time ratio of G" not in jumps
    assert "time ratio of G" not in compared(after, after, friction=("off", "stated"))[1]


def test_the_same_without_friction():
    text = EXAMPLES[FOURBAR]
    found, rows = compared(text, text, friction=("off", "stated"))
    free = analysed(text, friction=False)
    near(found["scene"]["drivers"][0]["effort"], free["drive_effort"].values[0])
    assert rows["mean friction power"]["a"] == 0
    assert rows["least locking margin"]["texts"] == ["—", "> 10", "—"]
    assert found["margin"] is None


def test_a_variant_over_another_stroke_shows_the_nearest_of_its_own_positions():
    after = EXAMPLES["drawing-press"]
    before = after.replace("range: [0 mm, 118 mm]", "range: [20.3 mm, 100 mm]")
    found, _ = compared(before, after, steps=60)
    assert found["shifted"]
    own, present = analysed(before, steps=60), analysed(after, steps=60)
    slides = [one["joint_slide"].sel(joint="Z").values for one in (own, present)]
    gap = np.abs(slides[0][None, :] - slides[1][:, None])
    expected = np.where(gap.min(axis=1) <= 0.5 * 0.0797 / 59, own["drive_effort"].values[0][gap.argmin(axis=1)], np.nan)
    assert 38 <= np.isfinite(expected).sum() <= 42
    near(found["scene"]["drivers"][0]["effort"], expected)
    near(
        found["margin"],
        np.where(np.isfinite(expected), np.minimum(own["locking_margin"].values[gap.argmin(axis=1)], 10), np.nan),
    )


@pytest.mark.slow
@pytest.mark.parametrize("stroke", ["[0 mm, 118 mm]", "[20.3 mm, 100 mm]"])
def test_the_motion_of_a_point_is_laid_over(stroke):
    after = EXAMPLES["drawing-press"]
    before = after.replace("range: [0 mm, 118 mm]", f"range: {stroke}").replace("L: 200 mm", "L: 205 mm")
    asked = {"text": after, "others": [{"text": before}], "steps": 60}
    (found,) = ask("compare", point="lower.P", **asked)["others"]
    own, present = (without_noise(analysed(text, steps=60)) for text in (before, after))
    slides = [one["joint_slide"].sel(joint="Z").values for one in (own, present)]
    gap = np.abs(slides[0][None, :] - slides[1][:, None])
    spacing = np.diff(slides[0]).max()
    for name in ("velocity", "acceleration"):
        for axis in "xy":
            row = own[f"point_{name}"].sel(point="lower.P", axis=axis).values
            near(
                found["point"][name][axis], np.where(gap.min(axis=1) <= 0.5 * spacing, row[gap.argmin(axis=1)], np.nan)
            )
    placed = ask("layers", text=after, steps=60, place={"link": "lower", "at": [0, 0], "index": 0})["point"]
    place = {key: placed[key] for key in ("link", "start", "local")}
    (found,) = ask("compare", place=place, **asked)["others"]
    assert found["point"]["key"] == placed["key"]


def test_another_drive_is_not_laid_over():
    found, rows = compared(EXAMPLES["drawing-press"], EXAMPLES[FOURBAR])
    assert found["scene"] is None
    assert "cannot be laid over" in found["why"]
    assert rows["peak torque, drive A"]["texts"][0] == "—"


@pytest.mark.slow
def test_a_variant_without_an_answer_says_why():
    broken = EXAMPLES[FOURBAR].replace("BC: 6.00 m", "BC: 1.00 m")
    found, rows = compared(broken, EXAMPLES[FOURBAR])
    assert rows["positions solved"]["a"] < 360
    assert all(one is None for one in found["scene"]["drivers"][0]["effort"]) == (rows["positions solved"]["a"] == 0)
    found, rows = compared("links: 3", EXAMPLES[FOURBAR])
    assert found["scene"] is None
    assert "cannot be solved" in found["why"]
    assert rows == {}


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
    ("example", "friction", "why"), [(FOURBAR, "off", "no friction"), ("andrews-squeezer", "stated", "no friction")]
)
def test_why_there_is_no_margin(example, friction, why):
    found = ask("model", EXAMPLES[example], friction=friction)
    assert (found["margin"], found["margin_least"], found["margin_why"]) == (None, None, why)


def test_a_structure_that_rubs_is_driven_by_nothing():
    rubs = "\njoint_defaults: {pin: {radius: 5 mm}, guide: {length: 20 mm}, friction: 0.1}\n"
    assert ask("model", EXAMPLES["one-way-clutch"] + rubs)["margin_why"] == "no driver"
