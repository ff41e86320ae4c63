"""Errors and play as the studio draws them, against `analyse`, closed forms and the verb that tells of tolerances."""

import re

import numpy as np
import pytest

import trunnion
from studio.asking import EXAMPLES, analysed, ask, model_of

PLAY, TOLERANCED, PISTON = (EXAMPLES[f] for f in ("fourbar-with-play", "toleranced-fourbar", "toleranced-slider-crank"))
MODELS = {"play": PLAY}
SECOND = {"A": "crank", "B": "coupler", "C": "rocker", "D": "rocker"}


def test_seats_are_those_of_analyse_and_lie_the_angle_of_friction_beside_their_loads():
    result = analysed(PLAY)
    seats = ask(ask="layers", text=PLAY, wanted=["seats"])["seats"]
    assert [one["joint"] for one in seats] == list("ABCD")
    for one in seats:
        (end,) = one["ends"]
        of = result.sel(joint=one["joint"]).isel(end=0)
        for name, rows in (("seat_offset", end["offset"]), ("end_force", end["force"])):
            for axis, row in rows.items():
                np.testing.assert_allclose(np.array(row), of[name].sel(axis=axis), rtol=1e-12, atol=0)
        offset, force = (np.array(end[what]["x"]) + 1j * np.array(end[what]["y"]) for what in ("offset", "force"))
        np.testing.assert_allclose(np.abs(offset), 20e-6, rtol=1e-9)
        aside = np.abs(np.angle(offset / force))
        np.testing.assert_allclose(np.median(aside), np.arctan(0.1), rtol=1e-3)  # shifted by what the seat itself does


def rocker(angle, l1, l2, l3, l4):
    """The angle of the rocker of a four-bar, by the triangle of rocker, coupler and the line between their ends."""
    pin = l2 * np.exp(1j * angle) - l1
    return np.angle(pin) - np.arccos((l4**2 + np.abs(pin) ** 2 - l3**2) / (2 * l4 * np.abs(pin)))


@pytest.mark.parametrize("side", [0, 1])
def test_the_worst_corner_is_that_of_tolerance_and_of_a_four_bar_in_closed_form(side):
    found = ask(ask="corner", text=TOLERANCED, measure="rocker-angle", side=("least", "largest")[side], steps=360)
    verb = trunnion.tolerance(model_of(TOLERANCED), ["rocker-angle"], methods=("worst-case",), jobs=1)
    assert found["values"] == [float(verb[f"searched_{end}"].item()) for end in ("lower", "upper")]
    assert found["side"] == side
    lengths = np.array([100e-3, 30e-3, 90e-3, 70e-3])
    signs = [-1.0 if row[2].startswith("−") else 1.0 for row in found["rows"][:4]]
    corner = lengths + np.array([30e-6, 20e-6, 30e-6, 30e-6]) * signs
    angle = np.radians(np.linspace(0, 360, 36001))
    change = rocker(angle, *corner) - rocker(angle, *lengths)
    change -= 2 * np.pi * np.round(change / (2 * np.pi))
    worst = int(np.argmax(np.abs(change)))
    assert change[worst] == pytest.approx(found["values"][side], rel=1e-7)
    assert float(found["at"][:-1]) == pytest.approx(np.degrees(angle[worst]), abs=0.02)
    scene, index = found["scene"], found["index"]
    link = next(link for link in scene["links"] if link["name"] == "rocker")
    there = rocker(np.radians(index), *corner)
    assert np.exp(1j * link["angle"][index]) == pytest.approx(np.exp(1j * there), rel=1e-6)
    assert scene["built"]["links"]["rocker"][index] == pytest.approx(change[100 * index], rel=2e-5)


def test_a_corner_of_plays_has_its_pins_at_the_walls():
    found = ask(ask="corner", text=PISTON, measure="stroke-position", steps=360)
    verb = trunnion.tolerance(model_of(PISTON), ["stroke-position"], methods=("worst-case",), jobs=1)
    assert found["values"] == [float(verb[f"searched_{side}"].item()) for side in ("lower", "upper")]
    scene, index = found["scene"], found["index"]
    assert scene["built"]["points"]["piston.Q"]["x"][index] == pytest.approx(found["values"][0], rel=1e-3)
    pins = {seat["joint"]: seat["clearance"] for seat in scene["built"]["seats"]}
    assert pins["Q"] == pytest.approx(28e-6)  # the nominal play and its tolerance
    for joint, (pin, hole) in {"P": ("crank", "rod"), "Q": ("rod", "piston")}.items():
        errors = [scene["built"]["points"][f"{link}.{joint}"] for link in (pin, hole)]
        at = [np.array([np.ravel(one[axis])[index % np.size(one[axis])] for axis in "xy"]) for one in errors]
        assert np.hypot(*(at[0] - at[1])) == pytest.approx(pins[joint], rel=1e-3)


@pytest.mark.slow
def test_a_model_without_tolerances_and_plays_has_no_worst_corner():
    assert ask(ask="model", text=EXAMPLES["durango-fourbar"])["worst"] == []
    assert ask(ask="model", text=PLAY)["worst"] == ["rotation:D"]
    assert ask(ask="model", text=PLAY)["unseated"] == []
    assert ask(ask="model", text=PISTON)["unseated"] == list("OPQS")
    assert "is no measure" in ask(ask="corner", text=TOLERANCED, measure="none")["error"]


def spot(user, selector):
    """Where a part is moved to, px."""
    moved = user.page.locator(selector).first.get_attribute("transform")
    return complex(*map(float, re.findall(r"-?[\d.]+", moved)[:2]))


def pins(user):
    """By joint: from the middle of the hole to the pin and to the contact, px, upwards; radius of the hole."""
    found = {}
    for name in "ABCD":
        hole = spot(user, f'.joint[data-name="{name}"]')
        pin = spot(user, f'.joint[data-name="{name}"] + .joint .pin')
        radius = float(user.page.locator(f'.joint[data-name="{name}"] circle').get_attribute("r"))
        found[name] = ((pin - hole).conjugate(), radius)
    return found


@pytest.mark.slow
def test_pins_are_drawn_in_their_holes_so_many_times_off(user):
    result, index = analysed(PLAY), 57
    user.until("s.solved.value")
    user.of("motion", "m.crank.go(given)", index)
    scale = user.of("sheet", "m.sheet.view.frame.scale")
    turn = {name: float(result.link_angle.sel(link=link)[index]) for name, link in SECOND.items()}
    for factor in (100, 200):
        user.state(f"s.factor.value = {factor}")
        user.idle()
        seats = user.of("layers", "m.laid.value.seats")
        for seat, (name, (off, radius)) in zip(seats, pins(user).items(), strict=True):
            of = result.sel(joint=name).isel(end=0, position=index)
            for what, variable in (("offset", "seat_offset"), ("force", "end_force")):
                row = [seat["ends"][0][what][axis][index] for axis in "xy"]
                np.testing.assert_allclose(row, of[variable], rtol=1e-12)
            offset = complex(*of["seat_offset"].values) * np.exp(1j * turn[name])
            assert off == pytest.approx(factor * scale * offset, abs=0.15)  # px, as they are rounded
            assert radius == pytest.approx(5 + factor * scale * 20e-6, abs=0.06)
        assert f"errors × {factor}" in user.page.locator(".overlay").text_content()
        assert user.page.locator(".contact").count() == 4
        touch = [float(user.page.locator(".contact").nth(1).get_attribute(at)) for at in ("cx", "cy")]
        middle, (off, radius) = spot(user, '.joint[data-name="B"]'), pins(user)["B"]
        assert complex(*touch) == pytest.approx(middle + radius * off.conjugate() / abs(off), abs=0.2)
    assert user.page.locator(".variants-of-sheet .ideal").count() == 3


@pytest.mark.slow
def test_pins_are_pressed_by_one_click_and_lie_in_holes_that_are_bored_off(user):
    off = PLAY.replace("links: [coupler, rocker]}", "links: [coupler, rocker], misalignment: {offset: 0.05 mm}}")
    user.of("actions", "m.takeText(given, 'Edit')", off.replace("  seat: loaded\n", ""))
    user.until("s.solved.value && s.answer.value.unseated.length === 4")
    user.page.click("text=Press the pins by their loads")
    user.until("s.solved.value && s.answer.value.scene.built?.seats.length === 4")
    user.state("s.factor.value = 100")
    user.idle()
    scale = user.of("sheet", "m.sheet.view.frame.scale")
    assert abs(pins(user)["C"][0]) == pytest.approx(100 * scale * 20e-6, abs=0.15)
    middle = user.of(
        "sheet", "m.sheet.view.frame.to(['x', 'y'].map((axis) => m.drawn.value.scene.points['rocker.C'][axis][0]))"
    )
    assert abs(spot(user, '.joint[data-name="C"]') - complex(*middle)) == pytest.approx(100 * scale * 50e-6, abs=0.15)


@pytest.mark.slow
def test_a_worst_corner_is_one_choice_and_lengths_stay_while_it_is_drawn(user):
    user.until("s.solved.value")
    user.page.get_by_label("Worst case of").select_option("rotation:D")
    user.until("s.corner.value")
    found = ask(ask="corner", text=PLAY, measure="rotation:D", steps=360)
    assert user.state("s.corner.value.values") == found["values"]
    assert [user.state("s.factor.value"), user.state("s.index.value")] == [100, found["index"]]
    shown = user.page.locator(".errors-drawn button[aria-pressed=true]").all_text_contents()
    assert f"{found['texts'][found['side']]} at {found['at']}" in shown
    text = user.state("s.text.value")
    x, y = user.handle("C")
    user.page.mouse.move(x, y)
    user.page.mouse.down()
    user.page.mouse.move(x + 60, y + 60, steps=4)
    user.page.mouse.up()
    user.idle()
    user.page.locator('.handle[data-name="C"]').focus()
    user.keys("ArrowUp")
    assert "Lengths are changed where errors are drawn × 1" in user.state("s.notice.value.words")
    assert user.state("s.text.value") == text
    user.page.get_by_label("Worst case of").select_option("")
    user.idle()
    assert user.state("s.corner.value") is None


@pytest.mark.slow
def test_in_space_errors_are_magnified_beside_the_ideal_mechanism(user):
    user.of("actions", "m.takeText(given, 'Edit')", EXAMPLES["rssr-with-play"])
    user.until("s.spatial.value && s.solved.value && s.answer.value.scene.name.includes('RSSR')")
    user.page.click(".errors-drawn button:has-text('× 50')")
    user.idle()
    assert user.page.locator(".in-space .errors").text_content() == "errors × 50, ideal as pale lines"
    user.page.click("role=tab[name=Plots]")
    user.page.click("summary:has-text('Pins in their holes')")
    user.page.wait_for_selector(".seat figcaption")
    assert user.page.locator(".seat figcaption .title").all_text_contents() == ["D, end 1", "D, end 2"]
    result = analysed(EXAMPLES["rssr-with-play"]).sel(joint="D").isel(position=0)
    for end in (0, 1):
        load = float(np.linalg.norm(np.nan_to_num(result["end_force"].isel(end=end))))
        value = user.page.locator(".seat figcaption .value").nth(end).text_content()
        assert float(value.split()[0]) == pytest.approx(load, abs=0.006)
