"""What the studio lays over sheet and plots, and what locks; against `analyse`, closed forms and differences."""

import re
from itertools import combinations

import numpy as np
import pytest

from brief import brief
from studio.asking import EXAMPLES, FLOAT, analysed, ask, column, near, sound
from studio.test_whitworth import TEXT as RAM
from trunnion.model.file import entries_of
from trunnion.model.mechanism import Mechanism

FOURBAR = "durango-fourbar"


def test_velocity_and_acceleration_of_a_point_are_those_of_analyse_and_of_differences():
    text = EXAMPLES[FOURBAR]
    names = [f"coupler.E.{rate}_{axis}" for rate in ("velocity", "acceleration") for axis in "xy"]
    found = sound("layers", text, names=names, steps=720)["columns"]
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
        np.testing.assert_allclose(column(velocity), speed, atol=2e-3 * np.abs(speed).max())
        np.testing.assert_allclose(column(acceleration), second, atol=5e-3 * np.abs(second).max())


def test_a_column_that_is_not_known_is_none():
    assert sound("layers", EXAMPLES[FOURBAR], names=["coupler.Z.velocity_x"])["columns"] == {}
    assert sound("layers", EXAMPLES[FOURBAR])["columns"] == {}


@pytest.mark.parametrize("example", ["slider-crank", "jansen"])
def test_three_links_have_their_instant_centres_on_one_line(example):
    """The theorem of Aronhold and Kennedy, at every position, for every three links whose centres are at hand."""
    rows = sound("layers", EXAMPLES[example], wanted=["centres"])["centres"]
    at = {frozenset(row["pair"]): row for row in rows}
    links = {link for row in rows for link in row["pair"]}
    size = np.ptp(
        [column(row[axis])[np.isfinite(column(row[axis]))].mean() for row in rows if row["joint"] for axis in "xy"]
    )
    assert len(rows) == len(links) * (len(links) - 1) // 2
    checked = 0
    for three in combinations(sorted(links), 3):
        a, b, c = (at[frozenset(pair)] for pair in combinations(three, 2))
        if a["far"] or b["far"] or c["far"]:
            continue
        (ax, ay), (bx, by), (cx, cy) = ([column(row[axis]) for axis in "xy"] for row in (a, b, c))
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
    rows = sound("layers", text, wanted=["centres"])["centres"]
    (row,) = [one for one in rows if one["pair"] == ["ground", "coupler"]]
    x, y = (result["point_position"].sel(point="coupler.E", axis=axis).values for axis in "xy")
    turn = result["link_angle_velocity"].sel(link="coupler").values
    fit = np.hypot(column(row["x"]) - x, column(row["y"]) - y) < 100  # m: nearer than float32 has digits for
    assert fit.sum() > 300
    vx, vy = -turn * (y - column(row["y"])), turn * (x - column(row["x"]))
    for axis, speed in (("x", vx), ("y", vy)):
        own = result["point_velocity"].sel(point="coupler.E", axis=axis).values
        np.testing.assert_allclose(speed[fit], own[fit], atol=1e-5 * np.abs(own).max())


def test_a_slider_has_its_centre_at_infinity_across_its_guide():
    rows = sound("layers", EXAMPLES["slider-crank"], wanted=["centres"])["centres"]
    result = analysed(EXAMPLES["slider-crank"])
    links = [link for link in result["link"].values if np.all(result["link_angle_velocity"].sel(link=link) == 0)]
    (block,) = [link for link in links if link not in ("ground", "frame")]
    (row,) = [one for one in rows if one["ground"] and block in one["pair"]]
    assert all(one is None for one in row["x"])
    far = column(row["far"]["x"]), column(row["far"]["y"])
    moving = np.isfinite(far[0])
    assert moving.sum() > 350
    np.testing.assert_allclose(np.abs(far[1][moving]), 1.0, atol=FLOAT)
    (pin,) = [one for one in rows if block in one["pair"] and one["joint"]]
    assert pin["far"] is None


def test_the_transmission_angle_of_a_four_bar_is_that_of_the_law_of_cosines():
    text = EXAMPLES[FOURBAR]
    result, (row,) = analysed(text), sound("layers", text, wanted=["transmission"])["transmission"]
    numbers = sound("model", text)["numbers"]
    ab, bc, cd, da = (numbers[f"dimensions.{name}"] for name in ("AB", "BC", "CD", "AD"))
    crank = result["point_position"].sel(point="crank.B").values - result["point_position"].sel(point="ground.A").values
    pin = result["point_position"].sel(point="ground.D").values
    square = np.sum((np.array(crank) - pin) ** 2, axis=0)
    assert ab == pytest.approx(np.hypot(*crank[:, 0]))
    assert da == pytest.approx(np.hypot(*pin[:, 0]))
    angle = np.arccos((bc**2 + cd**2 - square) / (2 * bc * cd))
    np.testing.assert_allclose(np.abs(column(row["angle"])), np.minimum(angle, np.pi - angle), atol=1e-6)
    assert row["joint"] == "C"


def compared(before, after, friction=("stated", "stated"), **rest):
    other = {"text": before, "friction": friction[0]}
    told = sound("compare", after, friction=friction[1], others=[other], **rest)
    (found,) = told["others"]
    was, none = {row["name"]: row for row in found["figures"]}, {"value": None, "text": "—"}
    pairs = [(was.get(row["name"], none), row) for row in told["figures"]]
    return found, {
        row["title"]: {"a": old["value"], "b": row["value"], "texts": [old["text"], row["text"]]} for old, row in pairs
    }


def test_a_table_of_two_variants_is_that_of_two_analyses():
    before, after = EXAMPLES["drawing-press"], EXAMPLES["drawing-press"].replace("friction: 0.1", "friction: 0.15")
    assert before != after
    found, rows = compared(before, after, steps=60)
    results = [analysed(one, steps=60) for one in (before, after)]
    figures = [{figure.name: figure.value for figure in one.trunnion.summary} for one in results]
    peaks = [one["Z.effort_max"] for one in figures]
    assert peaks == pytest.approx([float(np.abs(one["drive_effort"]).max()) for one in results], rel=1e-11)
    (effort,) = [row for label, row in rows.items() if label.startswith("drive force of Z, maximum")]
    assert [effort["a"], effort["b"]] == pytest.approx(peaks, rel=1e-12)
    for label, name in (("efficiency of the cycle", "efficiency"), ("locking margin, minimum", "locking_margin")):
        assert [rows[label]["a"], rows[label]["b"]] == pytest.approx([one[name] for one in figures], rel=1e-12)
    lost = [float(one["friction_power_mean"].sum()) for one in results]
    assert [rows["friction power, mean"][key] for key in "ab"] == pytest.approx(lost, rel=1e-9)
    least = [float(one["locking_margin"].min()) for one in results]
    assert least[1] == pytest.approx(least[0] / 1.5, rel=1e-3)  # a multiple of the friction
    reaction = [float(np.hypot(*one["reaction_force"].sel(joint="O").values).max()) for one in results]
    row = rows["reaction of O, maximum"]
    assert [row["a"], row["b"]] == pytest.approx([one["O.reaction_max"] for one in figures], rel=1e-12)
    assert [row["a"], row["b"]] == pytest.approx(reaction, rel=1e-11)  # of the positions
    near(found["scene"]["drivers"][0]["effort"], results[0]["drive_effort"].values[0])


@pytest.mark.slow
def test_a_table_has_the_stroke_and_the_time_ratio_of_a_quick_return():
    """Ram in line with the lever's pivot: φ = 2 acos(d/r) of the crank, the shorter way, stands about 270°."""
    after = EXAMPLES["whitworth-quick-return"]
    _, rows = compared(after.replace("d: 60 mm", "d: 40 mm"), after, steps=60)
    assert rows["time ratio of G"]["b"] == pytest.approx(2.0, rel=1e-4)
    short = 2 * np.arccos(40 / 120)
    assert rows["time ratio of G"]["a"] == pytest.approx((2 * np.pi - short) / short, rel=1e-4)
    assert rows["stroke of G"]["texts"] == ["200.0\u00a0mm", "200.0\u00a0mm"]
    assert rows["stroke of G"]["b"] == pytest.approx(0.2, rel=1e-9)
    figures = dict(sound("cycle", after)["figures"])
    assert figures["time ratio of G"] == "2.000"
    assert figures["stroke of G"] == "200.0\u00a0mm"


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


@pytest.mark.parametrize(
    ("example", "friction", "why"), [(FOURBAR, "off", "no friction"), ("andrews-squeezer", "stated", "no friction")]
)
def test_why_there_is_no_margin(example, friction, why):
    found = sound("model", EXAMPLES[example], friction=friction)
    assert (found["margin"], found["margin_least"], found["margin_why"]) == (None, None, why)


PRESS = EXAMPLES["drawing-press"].replace("friction: 0.1", "friction: 0.45")
STEPS = 45


def mechanism_of(text, friction):
    """The mechanism of a text, some of its joints with another coefficient."""
    entries = entries_of(text)[0]
    for joint, coefficient in friction.items():
        entries["joints"][joint] = dict(entries["joints"][joint]) | {"friction": coefficient}
    return Mechanism(**entries)


@pytest.mark.spread(1)
@pytest.mark.parametrize(("name", "index"), [("elliptic-trammel", 180), ("scotch-yoke", 270)])
def test_the_margin_does_not_jump_where_a_joint_turns_round(name, index):
    """Beside it the margin is smooth on at least one side, and the least of the cycle is the figure of `analyse`."""
    text = EXAMPLES[name]
    found, cycle = (ask(ask=kind, text=text) for kind in ("model", "cycle"))
    margin = np.array(found["margin"], float)
    assert np.all(margin <= 1.05 * np.array([np.roll(margin, 1), np.roll(margin, -1)]).max(axis=0))
    rough, stated = re.sub(r"friction: 0\.\d+", "friction: 0.2", text), float(re.search(r"friction: (0\.\d+)", text)[1])
    live = ask(ask="try", text=rough, values={}, index=index)["margin"]
    assert live == {"value": pytest.approx(margin[index] * stated / 0.2, rel=1e-6), "beyond": False}
    (figure,) = [one for one in analysed(text).trunnion.summary if one.name == "locking_margin"]
    assert cycle["margin_least"]["value"] == pytest.approx(figure.value, rel=1e-9)
    assert f"at {cycle['margin_least']['at']}" == figure.place


def test_a_joint_locks_at_the_multiple_of_its_friction_that_is_told():
    found = ask(ask="model", text=PRESS, steps=STEPS)
    (joint,) = found["locks"]
    index = 2
    multiple = found["locks"][joint][index]
    assert joint == "B"
    live = ask(ask="try", text=PRESS, steps=STEPS, values={}, index=index)["locks"]  # while it is being changed
    assert live == {"B": pytest.approx(multiple, rel=1e-6)}
    for times, locks in ((0.999, False), (1.001, True)):
        result = brief(mechanism_of(PRESS, {"B": 0.45 * multiple * times}), STEPS)
        assert (float(result["locking_margin"][index]) < 1) is locks


def test_what_is_tried_is_written_and_lets_it_run():
    (finding,) = [one for one in ask(ask="cycle", text=PRESS)["findings"] if one["code"] == "friction.locked"]
    assert (finding["part"], finding["line"], finding["index"]) == ("joints.B", 28, 0)
    labels = [cure["label"] for cure in finding["cures"]]
    assert labels == [
        "friction coefficient of B 0.45 → 0.291",
        "friction coefficients of K, P, B × 0.69",
        "guide length of B 80 mm → 124 mm",
    ]
    for cure in finding["cures"]:
        text = ask(ask="edit", text=PRESS, places={}, gestures=cure["gestures"])["text"]
        assert float(brief(mechanism_of(text, {}), STEPS)["locking_margin"].min()) > 1
        assert text.count("#") == PRESS.count("#")  # remarks stay


def test_a_coefficient_that_all_joints_share_is_tried_where_it_is_stated():
    text = RAM.replace("friction: 0.12", "friction: 1.6")
    (finding,) = [one for one in ask(ask="cycle", text=text)["findings"] if one["code"] == "friction.locked"]
    (cure,) = [one for one in finding["cures"] if "all joints" in one["label"]]
    tried = ask(ask="edit", text=text, places={}, gestures=cure["gestures"])["text"]
    assert tried == text.replace("1.6", cure["label"].rpartition(" ")[2])
    assert float(brief(mechanism_of(tried, {}), STEPS)["locking_margin"].min()) > 1


def test_the_margin_without_a_block_is_that_without_the_friction_of_its_joints():
    groups = (("O", "C", "R"), ("K", "P", "B"))
    found = ask(ask="margins", text=PRESS, steps=STEPS)["without"]
    for joints, margin in zip(groups, found, strict=True):
        result = brief(mechanism_of(PRESS, dict.fromkeys(joints, 0)), STEPS)
        expected = np.minimum(result["locking_margin"].values, 10)
        np.testing.assert_allclose(np.array(margin, float), expected, rtol=1e-6)


@pytest.mark.slow
def test_a_joint_that_locks_is_ringed_and_a_remedy_is_tried(user):
    page = user.page
    user.of("actions", "m.takeText(given, 'Edit')", PRESS)
    user.until(f"s.solved.value && s.answer.value.text.length === {len(PRESS)}")
    user.of("state", "m.index.value = 200")
    page.locator(".message-card.bad").click()
    assert user.state("s.index.value") == 0  # where it is the nearest to locking
    assert user.state("s.selection.value.name") == "B"
    assert page.locator(".laid.of-lock").text_content().startswith("B locks: it runs up to 0.72 times")
    page.get_by_role("button", name="line 28").click()
    assert "B: {type: prismatic" in page.get_by_label("Model file").evaluate(
        "area => area.value.slice(area.selectionStart, area.selectionEnd)"
    )
    page.get_by_role("tab", name="Findings").click()
    page.get_by_role("button", name="Try friction coefficient of B").click()
    user.until("s.answer.value.margin_least.value > 1")
    least = float(brief(mechanism_of(PRESS, {"B": 0.291}), STEPS)["locking_margin"].min())
    assert f"least locking margin 0.766 at 0 mm, now {least:.3g} at" in page.locator(".tried").inner_text()
    assert page.locator(".lock-ring").count() == 0
    page.get_by_role("button", name="Take it back").click()
    user.until(f"s.text.value.length === {len(PRESS)} && s.answer.value.margin_least.value < 1")
    page.locator(".lock-ring").wait_for(state="attached")
