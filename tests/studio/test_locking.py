"""What locks while it is shown, what can be tried against it, and what each block has to do with it."""

from __future__ import annotations

import re

import numpy as np
import pytest

import trunnion
from brief import brief
from studio.asking import EXAMPLES, ask
from trunnion.model.file import entries_of
from trunnion.model.mechanism import Mechanism

PRESS = EXAMPLES["drawing-press"].replace("friction: 0.1", "friction: 0.45")
STEPS = 45


def mechanism_of(text, friction):
    """The mechanism of a text, some of its joints with another coefficient."""
    entries = entries_of(text)[0]
    for joint, coefficient in friction.items():
        entries["joints"][joint] = dict(entries["joints"][joint]) | {"friction": coefficient}
    return Mechanism(**entries)


@pytest.mark.parametrize(("name", "index"), [("elliptic-trammel", 180), ("scotch-yoke", 270)])
def test_the_margin_does_not_jump_where_a_joint_turns_round(name, index):
    """Beside it the margin is smooth on at least one side, and the least of the cycle is the figure of `analyse`."""
    text = EXAMPLES[name]
    found, cycle = (ask(ask=kind, text=text) for kind in ("model", "cycle"))
    margin = np.array(found["margin"], float)
    sides = np.array([np.roll(margin, 1), np.roll(margin, -1)])
    assert np.all(margin <= 1.05 * sides.max(axis=0))
    rough, stated = re.sub(r"friction: 0\.\d+", "friction: 0.2", text), float(re.search(r"friction: (0\.\d+)", text)[1])
    live = ask(ask="try", text=rough, values={}, index=index)["margin"]
    assert live == {"value": pytest.approx(margin[index] * stated / 0.2, rel=1e-6), "beyond": False}
    (figure,) = [
        one for one in trunnion.analyse(mechanism_of(text, {})).trunnion.summary if one.name == "locking_margin"
    ]
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


def test_the_margin_without_a_block_is_that_without_the_friction_of_its_joints():
    groups = (("O", "C", "R"), ("K", "P", "B"))
    found = ask(ask="margins", text=PRESS, steps=STEPS)["without"]
    for joints, margin in zip(groups, found, strict=True):
        result = brief(mechanism_of(PRESS, dict.fromkeys(joints, 0)), STEPS)
        expected = np.minimum(result["locking_margin"].values, 10)
        np.testing.assert_allclose(np.array(margin, float), expected, rtol=1e-6)


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
