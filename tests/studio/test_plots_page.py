"""Plots, layers and variants of the studio's page in a real browser, where there is one, against `analyse`.

Every test fails on an error of the page, on one in its console, and on a request to anywhere but this machine.
"""

import json

import numpy as np
import pytest

from studio.asking import EXAMPLES, analysed, unpacked
from trunnion.studio.answers import answer

FLOAT = 1e-6  # of the peak


def number(text):
    """A number as the page writes it."""
    return float(text.replace("\u202f", "").replace("−", "-").split("\u00a0")[0].split()[0])


def written(user, text):
    user.of("actions", "m.takeText(given, 'Edit')", text)
    user.until(f"s.solved.value && s.answer.value.text.length === {len(text)}")


def show(user, *names):
    user.page.click("summary:has-text('Show')")
    for name in names:
        user.page.get_by_label(name, exact=True).click()
    user.keys("Escape")


@pytest.mark.slow
def test_the_radius_of_a_friction_circle_is_that_of_coulomb(user):
    """f′ r = 0.40 · 7.5 mm; the two forces and the moment together act along a line that touches the circle."""
    show(user, "Friction circles")
    user.until("m.laid.value?.circles", "layers")
    result, found = analysed(user.state("s.text.value")), user.of("layers", "m.laid.value.circles")
    assert [one["joint"] for one in found] == list("ABCD")
    for one in found:
        np.testing.assert_allclose(np.array(one["radius"], float), 0.4 * 0.0075, rtol=1e-6)
        offset = np.array(one["offset"], float)
        force = [result["reaction_force"].sel(joint=one["joint"], axis=axis).values for axis in "xy"]
        size = np.hypot(*force)
        arm = offset * force[1] / size, -offset * force[0] / size  # to the right of the force
        moment = arm[0] * force[1] - arm[1] * force[0]
        moves = np.isfinite(offset)
        assert moves.sum() > 350
        torque = result["friction_torque"].sel(joint=one["joint"]).values
        np.testing.assert_allclose(moment[moves], torque[moves], rtol=1e-5)
    user.state("s.friction.value = 'off'")
    user.until("m.laid.value?.circles?.length === 0", "layers")
    show(user, "Friction circles")
    user.state("s.friction.value = 'stated'")
    user.idle()


@pytest.mark.slow
def test_two_variants_are_compared(user):
    user.page.click("role=tab[name=Plots]")
    user.page.click("button:has-text('Keep as variant A')")
    before = user.state("s.text.value")
    after = before.replace("BC: 6.00 m", "BC: 5.50 m")
    written(user, after)
    user.page.wait_for_selector(".changes td")
    results = [analysed(text) for text in (before, after)]
    told = [{figure.name: figure.value for figure in one.trunnion.summary} for one in results]
    peaks = [one["A.effort_min"] / 1000 for one in told]  # between positions
    cells = user.page.locator(".changes tr", has_text="drive torque of A, minimum").locator("td").all_inner_texts()
    assert [number(one) for one in cells[:2]] == pytest.approx(peaks, rel=1e-3)
    assert number(cells[2]) == pytest.approx(100 * (peaks[1] - peaks[0]) / abs(peaks[0]), abs=0.06)
    legend = user.page.locator(".chart").first.locator(".legend .label").all_inner_texts()
    assert legend == ["torque", "torque, variant A"]
    user.state("s.selection.value = { kind: 'joints', name: 'C' }")
    user.idle()
    moving = user.page.locator(".chart", has_text="Velocity of").locator(".legend .label").all_inner_texts()
    assert moving[0] == "magnitude"
    assert user.page.locator(".chart", has_text="Velocity of").locator("path.curve.variant").count() == 3
    overlaid = user.of("variants", "m.compared.value[0].scene.drivers[0].effort")
    own = results[0]["drive_effort"].values[0]
    np.testing.assert_allclose(overlaid, own, atol=FLOAT * np.abs(own).max())
    assert user.page.locator("path.outline-of-variant").count() == 4  # three links and the key
    user.page.click("button:has-text('Go back to A')")
    user.until("s.solved.value && s.text.value.includes('BC: 6.00 m')")
    assert user.page.locator(".changes").count() == 0
    assert user.page.locator("path.outline-of-variant").count() == 0
    user.page.locator(".sheet > svg").focus()
    user.keys("Control+z")
    assert user.state("s.text.value") == after
    user.page.click("button:has-text('Drop A')")
    user.idle()
    assert user.page.locator(".changes").count() == 0


def test_every_column_of_the_table_can_be_a_curve():
    """Names, units and values are those of the table that is written."""
    text = EXAMPLES["durango-fourbar"]
    question = {"ask": "curves", "text": text, "revision": 1, "names": ["coupler.angle_velocity", "A.effort", "none"]}
    found = unpacked(answer(json.dumps(question).encode()))
    result = analysed(text)
    assert dict(found["names"])["coupler.angle_velocity"] == "rad/s"
    assert found["columns"].keys() == {"coupler.angle_velocity", "A.effort"}
    expected = result["link_angle_velocity"].sel(link="coupler").values
    np.testing.assert_allclose(found["columns"]["coupler.angle_velocity"]["values"], expected, atol=1e-5)


@pytest.mark.slow
def test_curves_are_chosen_over_another_and_the_table_of_joints_has_the_largest(user):
    page = user.page
    page.get_by_role("tab", name="Plots").click()
    page.locator("#columns option").nth(20).wait_for(state="attached")
    for name in ("coupler.angle_velocity", "rocker.angle_velocity"):
        page.get_by_label("Curve to add").press_sequentially(name)  # though rocker.angle is a column too
        page.keyboard.press("Enter")
    page.locator(".own-curves figure").wait_for()
    page.locator(".own-curves path.curve").nth(1).wait_for(state="attached")
    page.get_by_label("Over", exact=True).fill("rocker.angle")
    page.get_by_label("Over", exact=True).press("Enter")
    page.locator(".own-curves .axis", has_text="rocker.angle [°]").wait_for()
    assert "NaN" not in page.locator(".own-curves path.curve").first.get_attribute("d")
    page.locator(".of-joints summary").click()
    rows = page.locator(".of-joints tbody tr")
    assert rows.count() == 4
    assert rows.first.inner_text().split("\t")[0] == "A"
