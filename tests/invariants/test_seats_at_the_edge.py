"""Seats where there is little to seat: no load for a while, locked, two positions, forces that have no answer."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

from trunnion import Mechanism, MechanismError, analyse, read
from trunnion.cycle.findings import listed

EXAMPLES = Path(__file__).parents[2] / "examples"


def changed(name: str, values: dict[str, float | str]) -> Mechanism:
    return read(EXAMPLES / f"{name}.yaml").with_values(values)


def told(result: xr.Dataset, what: str) -> list[dict[str, Any]]:
    return [one for one in json.loads(result.attrs["findings"]) if one["code"] == what]


def test_a_passage_is_told_once_however_few_the_positions() -> None:
    """35.66° is 0.198 of two positions a turn."""
    result = analyse(read(EXAMPLES / "fourbar-with-play.yaml"), steps=2)
    found = {one["where"]: one["figures"] for one in told(result, "contact.lost")}
    (together,) = [where for where, figures in found.items() if figures["at"] == "at 35.66°, at 223.5°"]
    assert "B" in together
    assert found[together]["count"] == together.count(",") + 1 > 1  # the other pin of the coupler, in one finding
    assert len({figures["at"] for figures in found.values()}) == len(found)


@pytest.mark.slow
def test_the_end_float_is_no_end_of_the_pin() -> None:
    """Its passages are told as those along the axis; what is least is compared with the largest of the same end."""
    result = analyse(changed("rssr-with-play", {"D.pin.end_float": "0.1 mm"}), steps=36)
    (finding,) = told(result, "contact.lost")
    assert finding["figures"]["at"].count("at 200.8° (along its axis)") == 1
    axial = np.abs(result["end_force"].sel(joint="D", axis="z")).max().item()
    assert finding["figures"]["least"] == 0
    assert finding["figures"]["peak"] == pytest.approx(2 * axial, rel=0.01)  # each end has half of it


def massless_compressor() -> dict[str, Any]:
    """The model's data, pins in loaded seats; without pressure, from 40° to 180°, nothing presses."""
    data = read(EXAMPLES / "slider-crank.yaml").data()
    data["gravity"] = [0, 0]
    for link in data["links"].values():
        for key in ("mass", "centre", "inertia"):
            link.pop(key, None)
    data["joint_defaults"] = {"pin": {"clearance": "10 um"}, "seat": "loaded"}
    return data


@pytest.mark.slow
def test_a_stretch_without_load_is_one_loss_of_contact() -> None:
    """The massless compressor has no pressure from 40° to 180°: nothing presses there."""
    data = massless_compressor()
    result = analyse(Mechanism(**data), steps=360)
    lost = np.flatnonzero(result["contact_lost"].sel(joint="P"))
    assert np.array_equal(lost, np.arange(40, 181))
    assert np.all(result["seat_offset"].sel(joint="P", end="1", axis=["x", "y"]).isel(position=slice(41, 180)) == 0)
    (finding,) = told(result, "contact.unloaded")  # of all joints at once, and no loss of any of them
    assert finding["figures"] == {"joints": ["O", "P", "Q"], "at": "between 40° and 180°"}
    assert not told(result, "contact.lost")


@pytest.mark.slow
def test_figures_say_which_positions_they_are_of_where_contact_is_lost() -> None:
    """No load from 40° to 180°."""
    data = massless_compressor()
    data["measures"] = {"course": {"slide": "S"}, "stroke": {"stroke": "S"}, "mean": {"slide": "S", "as": "rms"}}
    data["measures"] |= {one: {"slide": "S", "as": one} for one in ("minimum", "maximum")}
    window = {"slide": "S", "over": ["50 deg", "170 deg"]}
    data["measures"] |= {"low": window | {"as": "minimum"}, "swing": window | {"as": "peak-to-peak"}}
    data["measures"]["there"] = {"slide": "S", "at": "90 deg"}
    result = analyse(Mechanism(**data), steps=360)
    valid = result["status"].values != 3
    slide = result["joint_slide"].sel(joint="S").values
    figures = {one.name: one for one in result.trunnion.summary}
    share = np.count_nonzero(~valid) / 360
    assert figures["S.stroke"].note == f"without {share:.2g} of the cycle"
    assert figures["S.stroke"].value == pytest.approx(figures["stroke"].value, rel=1e-4)
    assert figures["course.max"].value == pytest.approx(np.max(slide[valid]))
    dense = analyse(Mechanism(**data), steps=20_000)
    slide = dense["joint_slide"].sel(joint="S").values[dense["status"].values != 3]
    for name, pick in (("minimum", np.min), ("maximum", np.max)):
        assert figures[name].value == pytest.approx(pick(slide), rel=1e-5)  # valid, next to the stretch
    found = {one.where: one for one in result.trunnion.findings if one.code == "measure.contact_lost"}
    for name in ("low", "swing", "there"):
        assert figures[name].value is None
        assert "loses contact" in figures[name].note
        told = found[f"measures.{name}"].figures["at"]  # where, for a place or a window beside it
        assert told.endswith("°")
        assert told in figures[name].note
        assert np.isnan(result["measure_figure"].sel(measure=name))
    assert figures["mean"].value is not None
    assert "loses contact at " in figures["mean"].note


@pytest.mark.slow
def test_nothing_is_said_of_contact_where_it_is_locked() -> None:
    result = analyse(changed("fourbar-with-play", {"joint_defaults.friction.coefficient": 5}), steps=60)
    locked = result["status"].values >= 4
    assert np.any(locked)
    assert not np.any(result["contact_lost"].values[:, locked])
    assert not told(result, "seat.unsettled")


@pytest.mark.slow
def test_where_no_force_is_known_nothing_is_said_of_what_presses() -> None:
    """With pins of 10 mm the Cardan joint locks at every position."""
    model = changed("pezzuti-cardan-as-built", {"bearing": "10 mm"})
    result = analyse(model, steps=12)
    assert np.all(result["status"] == 5)
    assert not told(result, "seat.unloaded")


@pytest.mark.slow
def test_a_shaft_that_fits_but_for_its_end_float() -> None:
    """It lies at one end or the other, by its thrust."""
    values: dict[str, float | str] = {"D.pin.hole_radius": "10 mm", "D.pin.end_float": "0.1 mm"}
    result = analyse(changed("rssr-with-play", values), steps=36)
    offset, force = (result[name].sel(joint="D", end="1") for name in ("seat_offset", "end_force"))
    assert np.all(offset.sel(axis=["x", "y"]) == 0)
    away = np.abs(force.sel(axis="z")) > 0.5  # N: from where the thrust turns round
    assert np.allclose(offset.sel(axis="z")[away], 5e-5 * np.sign(force.sel(axis="z"))[away], rtol=0, atol=1e-12)
    assert np.any(result["point_error"] != 0)


def test_a_fit_that_cannot_be_read_is_the_only_finding() -> None:
    data = read(EXAMPLES / "fourbar-with-play.yaml").data()
    data["joint_defaults"]["pin"] = {"fit": "12 H7/g6"}
    with pytest.raises(MechanismError) as raised:
        Mechanism(**data)
    assert [one.where for one in raised.value.findings] == ["joint_defaults.pin.fit"]


@pytest.mark.slow
@pytest.mark.parametrize("steps", [36, 97, 360])
def test_passages_are_found_between_wide_steps(steps: int) -> None:
    """At 4.96° the load of end 1 turns round within 0.05 of its peak; seen over a wide step it does so far from 0."""
    (finding,) = told(analyse(read(EXAMPLES / "rssr-with-play.yaml"), steps=steps), "contact.lost")
    first, *more = finding["figures"]["at"].split(", ")
    assert 4.89 < float(first.removeprefix("at ").removesuffix("° (end 1)")) < 4.97
    assert more == ["at 191.6° (end 1)", "at 191.6° (end 2)"]


@pytest.mark.parametrize(("pinch", "known"), [("0.05 mm", False), ("5 mm", True)])
def test_no_efficiency_where_the_pins_do_not_settle_over_much_of_the_work(pinch: str, known: bool) -> None:
    """A ram touches its work with the pins on one side of their holes and not on the other: what flows is not known.

    Pressed by much more than the play, nearly all of the work is known: it is that of the spring.
    """
    pin = {"at": [0, 0], "axis": [1, 0]}
    model = {
        "trunnion": 1, "name": "press", "space": "planar", "gravity": [0, 0],
        "dimensions": {"r": "40 mm", "l": "150 mm", "pinch": pinch},
        "links": {
            "ground": {"points": {"O": [0, 0], "S": pin, "W": ["r + l + 50 mm", 0]}},
            "crank": {"points": {"O": [0, 0], "P": ["r", 0]}},
            "rod": {"points": {"P": [0, 0], "Q": ["l", 0]}},
            "ram": {"points": {"Q": [0, 0], "S": pin}},
        },
        "joints": {
            "O": {"type": "revolute", "links": ["ground", "crank"]},
            "P": {"type": "revolute", "links": ["crank", "rod"]},
            "Q": {"type": "revolute", "links": ["rod", "ram"]},
            "S": {"type": "prismatic", "links": ["ground", "ram"], "friction": 0},
        },
        "joint_defaults": {"pin": {"radius": "5 mm", "clearance": "0.05 mm"}, "friction": 0.1, "seat": "loaded"},
        "drivers": {"O": {"range": ["-90 deg", "-1 deg"], "speed": "1 rad/s"}},
        "springs": {"work": {"between": ["ground.W", "ram.Q"], "stiffness": "800 N/mm", "only": "push", "useful": True,
                             "free_length": "50 mm + pinch"}},
        "assembly": {"Q": ["l", 0]},
    }  # fmt: skip
    figures = {one.name: one for one in analyse(Mechanism(**model), steps=36).trunnion.summary}
    for name in ("efficiency", "efficiency_error", "friction_power_mean"):
        assert (figures[name].value is not None) == known
    assert ("pins do not settle" in figures["efficiency"].note) != known
    assert figures["efficiency_ideal"].value is not None


def test_many_places_are_told_by_how_often_and_the_ends() -> None:
    places = [f"at {k}°" for k in range(12)]
    assert listed(places[:3]) == "at 0°, at 1°, at 2°"
    assert listed(places) == "12 times, first at 0°, last at 11°"
